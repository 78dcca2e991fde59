//! What parts bury of each other: walls between solids of two parts, and what lies within another's solid whole, are not drawn.

use super::arrays::{Reader, Writer};
use super::part::eyes;
use super::pieces::{PIECE, Piece};
use super::steps::{Step, Steps};
use super::{PartReport, PrepareReport, Work};
use crate::cache::CacheError;
use crate::error::BakeError;
use heliodon_bundle::site::{Role, SITE_FILE_NAME};
use heliodon_mesh::Mesh;
use heliodon_prepare::clean::Finding;
use heliodon_prepare::solids::{Member, buried_among, meet};

/// What is buried of all parts.
struct Buried {
    /// Triangles over all parts in order.
    triangles: Vec<u32>,
    /// Part by part.
    found: Vec<Finding>,
    steps: Vec<Step>,
}

/// Takes from what is drawn what parts bury of each other, but what is known to be `seen`, and tells of it; answers with what is odd about it. Only fillings and
/// props have solids, as within one part.
///
/// # Errors
/// A cache that cannot be written.
pub(super) fn bury(
    work: &Work,
    meshes: &[Mesh],
    (keep, mut seen): (&mut [bool], &[bool]),
    report: &mut PrepareReport,
) -> Result<Vec<String>, BakeError> {
    let mut members = Vec::with_capacity(meshes.len());
    for (mesh, part) in meshes.iter().zip(&work.site.parts) {
        let of_part = seen.split_off(..mesh.triangles.len().min(seen.len())).unwrap_or_default();
        members.push(Member { mesh, has_solids: has_solids(part.role), seen: of_part });
    }
    if !work.settings.solids || !meet(&members) {
        return Ok(Vec::new());
    }
    let mut buried = work.pieces.kept_or(&format!("{PIECE}buried"), &[], || Ok(find(work, &members)))?;
    report.steps.append(&mut buried.steps);
    for (of_part, found) in report.parts.iter_mut().zip(buried.found) {
        of_part.buried = found;
    }
    for t in buried.triangles {
        keep[t as usize] = false;
    }
    Ok(meshes.iter().zip(&report.parts).filter_map(|(mesh, part)| doubt(mesh, part)).collect())
}

/// Whether closed surfaces of a part are solids.
pub(super) fn has_solids(role: Role) -> bool {
    matches!(role, Role::Filling | Role::Prop)
}

/// Parts of which so much is buried are told of, in hundredths.
const MUCH: u64 = 90;

/// One sentence for a part of which next to nothing is drawn since others' solids bury it: one of these may be a backdrop and no solid.
fn doubt(mesh: &Mesh, part: &PartReport) -> Option<String> {
    let (buried, all) = (part.buried.triangles, mesh.triangles.len() as u64);
    (all > 0 && 100 * buried >= MUCH * all).then(|| {
        format!(
            "part {}: {buried} of its {all} triangles lie within solids of other parts and are not drawn; \
             where one of these is no solid, write solids = false into [prepare] of {SITE_FILE_NAME}",
            part.name
        )
    })
}

fn find(work: &Work, members: &[Member]) -> Buried {
    let mut steps = Steps::new(work.reporter);
    let total = members.iter().map(|member| member.mesh.triangles.len() as u64).sum();
    let eyes = eyes(&work.views);
    let buried = steps.run("finding what parts bury", total, |_| buried_among(members, &eyes));
    let (mut triangles, mut first) = (Vec::new(), 0);
    for (member, buried) in members.iter().zip(&buried) {
        triangles.extend(buried.triangles.iter().map(|t| first + t));
        first += member.mesh.triangles.len() as u32;
    }
    Buried { triangles, found: buried.into_iter().map(|buried| buried.found).collect(), steps: steps.taken }
}

impl Piece for Buried {
    fn write(&self, into: &mut Writer) -> Result<(), CacheError> {
        into.array("triangles", &self.triangles)?;
        into.told(&self.found);
        into.told(&self.steps);
        Ok(())
    }

    fn read(from: &mut Reader) -> Option<Self> {
        Some(Self { triangles: from.array("triangles")?, found: from.told()?, steps: from.told()? })
    }
}
