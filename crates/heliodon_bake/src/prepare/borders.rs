//! Borders that parts share: held on both sides, so that no crack opens between parts that are simplified apart.

use super::Work;
use super::arrays::{Reader, Writer};
use super::part::{MOST_TRIANGLES, Whole, clean_params, piece_name, whole_part};
use super::pieces::{PIECE, Piece};
use super::steps::{Step, Steps};
use crate::cache::CacheError;
use crate::error::BakeError;
use crate::key::Digest;
use heliodon_mesh::Mesh;
use heliodon_prepare::borders::{Neighbor, Shared, share};
use heliodon_prepare::simplify::Held;

/// A part among the others.
pub(super) struct Border {
    /// Places whose vertices stay.
    pub held: Held,
    /// What decides the part's further steps: its own digest where it shares nothing, so that where unrelated parts are does not matter to it.
    pub digest: Digest,
}

/// What all parts share.
struct Found {
    /// Part by part.
    parts: Vec<Shared>,
    steps: Vec<Step>,
}

/// What a part's mesh has become that was changed, but for its materials, which stay with the part.
struct Changed(Mesh);

/// Finds what the parts share, and makes their borders agree; tells as well what that took.
///
/// # Errors
/// More triangles than splitting may make, and a cache that cannot be written.
pub(super) fn borders(work: &Work, wholes: &mut [Whole]) -> Result<(Vec<Border>, Vec<Step>), BakeError> {
    let mut borders: Vec<Border> =
        work.parts.iter().map(|digest| Border { held: Held::NOTHING, digest: digest.clone() }).collect();
    if wholes.len() < 2 {
        return Ok((borders, Vec::new()));
    }
    let found = match taken(work, wholes)? {
        Some(found) => found,
        None => find(work, wholes)?,
    };
    for ((whole, shared), border) in wholes.iter_mut().zip(found.parts).zip(&mut borders) {
        if shared.report.is_empty() {
            continue;
        }
        if shared.report.changes() {
            border.digest.run(bytemuck::cast_slice(&whole.mesh.positions));
            border.digest.run(bytemuck::cast_slice(&whole.mesh.triangles));
        }
        border.digest.run(bytemuck::cast_slice(shared.held.bits()));
        whole.report.triangles_original = whole.mesh.triangles.len() as u64;
        whole.report.borders = Some(shared.report);
        border.held = shared.held;
    }
    Ok((borders, found.steps))
}

fn borders_name() -> String {
    format!("{PIECE}borders")
}

/// What an earlier run has found, with the meshes that it has changed: one after the other, so that no part is held twice.
fn taken(work: &Work, wholes: &mut [Whole]) -> Result<Option<Found>, BakeError> {
    let Some(found) = work.pieces.take::<Found>(&borders_name(), &[]) else { return Ok(None) };
    for index in (0..found.parts.len()).filter(|&index| found.parts[index].report.changes()) {
        let materials = std::mem::take(&mut wholes[index].mesh).materials;
        let Some(Changed(mesh)) = work.pieces.take(&piece_name(index, "border"), &[]) else {
            // what was changed is needed as it was before
            for (index, whole) in wholes.iter_mut().enumerate() {
                *whole = whole_part(work, index)?;
            }
            return Ok(None);
        };
        wholes[index].mesh = Mesh { materials, ..mesh };
    }
    Ok(Some(found))
}

fn find(work: &Work, wholes: &mut [Whole]) -> Result<Found, BakeError> {
    let weld_m = |part: usize| match work.settings.clean {
        true => clean_params(work.settings, work.site.parts[part].role, &work.views).weld_m,
        false => 0.0,
    };
    let mut neighbors: Vec<Neighbor> =
        wholes.iter_mut().enumerate().map(|(part, whole)| Neighbor { mesh: &mut whole.mesh, weld_m: weld_m(part) }).collect();
    let total = neighbors.iter().map(|neighbor| neighbor.mesh.triangles.len() as u64).sum();
    let mut steps = Steps::new(work.reporter);
    let parts = steps.run("comparing borders", total, |_| share(&mut neighbors, MOST_TRIANGLES))?;
    for (index, whole) in wholes.iter_mut().enumerate().filter(|(index, _)| parts[*index].report.changes()) {
        let materials = std::mem::take(&mut whole.mesh.materials);
        let changed = Changed(std::mem::take(&mut whole.mesh));
        work.pieces.keep(&piece_name(index, "border"), &[], &changed)?;
        whole.mesh = Mesh { materials, ..changed.0 };
    }
    let found = Found { parts, steps: steps.taken };
    // last: with it, all of it is there
    work.pieces.keep(&borders_name(), &[], &found)?;
    Ok(found)
}

impl Piece for Found {
    fn write(&self, into: &mut Writer) -> Result<(), CacheError> {
        into.number(self.parts.len() as u64);
        for (index, shared) in self.parts.iter().enumerate() {
            into.array(&format!("held{index}"), shared.held.bits())?;
            into.told(&shared.report);
        }
        into.told(&self.steps);
        Ok(())
    }

    fn read(from: &mut Reader) -> Option<Self> {
        let count = usize::try_from(from.number()?).ok()?;
        let part =
            |index: usize| Some(Shared { held: Held::of_bits(from.array(&format!("held{index}"))?), report: from.told()? });
        Some(Self { parts: (0..count).map(part).collect::<Option<_>>()?, steps: from.told()? })
    }
}

impl Piece for Changed {
    fn write(&self, into: &mut Writer) -> Result<(), CacheError> {
        into.mesh("mesh", &self.0)
    }

    fn read(from: &mut Reader) -> Option<Self> {
        // without its materials it is not whole
        from.unclean_mesh("mesh").map(Self)
    }
}
