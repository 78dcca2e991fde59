//! Solids that overlap, touch, or run into themselves become one; what lies buried in solids goes.
//!
//! Closed patches whose boxes meet make a group, and a group is rebuilt as the surface of all that lies within at least one of them,
//! by the winding numbers of an exact arrangement of its triangles (crate `manifold-rust`; decision 018 says why it and not others).
//! Walls that solids share vanish with what one buries in another. Every piece of surface that is left knows which triangle it comes from
//! and takes its material, normals, colours and texture coordinates. Open surfaces are no solids: only such of their triangles go as
//! lie in solids whole.
//!
//! That is for the solids of one mesh. Meshes that stay apart are not united, but [`buried_among`] tells what lies within the solids of all together.

mod among;
mod buried;
mod groups;
mod near;
mod report;
mod stitch;
mod union;

pub use among::{BuriedAmong, Member, buried_among, meet};
pub use report::{Fate, GroupReport, Outcome, SolidsReport, color, paint};

use crate::interim::made_or_kept;
use crate::topology::{Patches, Sense, senses};
use crate::{Interim, Nowhere, Tell};
use glam::Vec3;
use groups::Group;
use heliodon_mesh::Mesh;
use heliodon_mesh::topology::{Edges, places};

/// What becomes of triangles of open surfaces that lie in solids whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Buried {
    /// They go: no eye sees them and no light reaches them.
    #[default]
    Remove,
    /// They stay.
    Keep,
}

/// How to unite solids.
#[derive(Clone, Debug, PartialEq)]
pub struct SolidsParams {
    /// Groups of more triangles are left as they are, and told: an exact arrangement takes 3.9 s
    /// for a lone scan of 100,000, and more where much meets.
    pub most_triangles: usize,
    /// What becomes of buried triangles of open surfaces. Removing asks up to some hundred rays for each that may be.
    pub buried: Buried,
    /// Places where eyes can be, in metres: a closed surface around one is a room, whichever way it looks, and no solid.
    pub eyes: Vec<Vec3>,
}

impl Default for SolidsParams {
    fn default() -> Self {
        Self { most_triangles: 1_000_000, buried: Buried::default(), eyes: Vec::new() }
    }
}

/// The part of the time after which it is known which solids meet: exact arrangements take nearly all.
const GROUPED: f64 = 0.1;
/// Groups that a thread unites before it is asked whether they are to be kept: one may take many seconds.
const AT_ONCE: usize = 2;

/// Unites the solids of a clean mesh ([`crate::clean`]) in place, and tells what it found and did. A group that cannot be united stays as
/// it is, with the reason.
///
/// # Panics
/// Where a triangle names a vertex that does not exist, or an array has a wrong length.
pub fn unite(mesh: &mut Mesh, params: &SolidsParams) -> SolidsReport {
    unite_resuming(mesh, params, (&Nowhere, Tell::NOBODY))
}

/// As [`unite`], and keeps beside it which groups are united; tells how far it is, by their triangles.
///
/// # Panics
/// As [`unite`].
pub fn unite_resuming(mesh: &mut Mesh, params: &SolidsParams, (interim, tell): (&dyn Interim, Tell)) -> SolidsReport {
    let mut report = SolidsReport {
        triangles_before: mesh.triangles.len() as u64,
        fates: vec![Fate::Kept; mesh.triangles.len()],
        ..SolidsReport::default()
    };
    let places = places(&mesh.positions, 0.0);
    let (patches, senses) = solids(mesh, &places, &params.eyes);
    report.count(&senses, &patches);
    if params.buried == Buried::Remove {
        buried::mark(mesh, &patches, &senses, &mut report);
    }
    let groups = groups::groups(mesh, &patches, &senses);
    tell.done(GROUPED);
    let done = tell.within(GROUPED, 1.0).count(groups.iter().map(|group| group.triangles.len()).sum());
    let is_too_large = |group: &Group| group.triangles.len() > params.most_triangles;
    let make = |index: usize| match &groups[index] {
        group if is_too_large(group) => Err(String::new()),
        group => union::union(mesh, &places, &group.triangles),
    };
    let unions = made_or_kept(interim, (0, groups.len()), AT_ONCE, make, |index| done.add(groups[index].triangles.len()));
    let mut made = Vec::new();
    for (group, union) in groups.iter().zip(unions) {
        let (outcome, pieces) = match union {
            _ if is_too_large(group) => (Outcome::TooLarge, None),
            Ok(pieces) => (Outcome::United, Some(pieces)),
            Err(reason) => (Outcome::Refused { reason }, None),
        };
        report.tell(mesh, group, outcome, pieces.as_ref());
        made.extend(pieces.filter(|pieces| pieces.changed));
    }
    stitch::stitch(mesh, &report.fates, &made);
    report.triangles_after = mesh.triangles.len() as u64;
    report
}

/// The patches of a mesh whose vertices are at these places, and what each is.
fn solids(mesh: &Mesh, places: &[u32], eyes: &[Vec3]) -> (Patches, Vec<Sense>) {
    let spans = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| places[v as usize]);
        a != b && b != c && c != a && t.iter().all(|&v| mesh.positions[v as usize].is_finite())
    };
    let fit: Vec<bool> = mesh.triangles.iter().map(spans).collect();
    let edges = Edges::new(&mesh.triangles, places, |t| fit[t]);
    let patches = Patches::new(&mesh.positions, &mesh.triangles, &edges, |t| fit[t]);
    drop(edges);
    let mut senses = senses(mesh, &patches, eyes);
    // what is not wound one way is no solid until it has been cleaned
    for (sense, patch) in senses.iter_mut().zip(&patches.list) {
        if matches!(sense, Sense::Body | Sense::Hollow) && patch.turned != 0 {
            *sense = Sense::Open;
        }
    }
    (patches, senses)
}

#[cfg(test)]
mod tests;
