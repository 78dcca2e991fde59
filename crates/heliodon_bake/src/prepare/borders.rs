//! Borders that parts share: held on both sides, so that no crack opens between parts that are simplified apart.

use super::Work;
use super::arrays::{Reader, Writer};
use super::part::{MOST_TRIANGLES, Whole, clean_params};
use super::pieces::{PIECE, Piece};
use super::steps::{Step, Steps};
use crate::cache::CacheError;
use crate::error::BakeError;
use crate::key::Digest;
use heliodon_mesh::Mesh;
use heliodon_prepare::borders::{BorderReport, Neighbor, Shared, share};
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
    /// Part by part, and with it what has become of a part that was changed for it, but for its materials, which stay with the part.
    parts: Vec<(Shared, Option<Mesh>)>,
    steps: Vec<Step>,
}

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
    let found = work.pieces.kept_or(&format!("{PIECE}borders"), &[], || find(work, wholes))?;
    for ((whole, (shared, changed)), border) in wholes.iter_mut().zip(found.parts).zip(&mut borders) {
        if shared.report.is_empty() {
            continue;
        }
        if let Some(mesh) = changed {
            whole.mesh = Mesh { materials: std::mem::take(&mut whole.mesh.materials), ..mesh };
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

fn find(work: &Work, wholes: &mut [Whole]) -> Result<Found, BakeError> {
    let weld_m = |part: usize| match work.settings.clean {
        true => clean_params(work.settings, work.site.parts[part].role, &work.views).weld_m,
        false => 0.0,
    };
    let mut neighbors: Vec<Neighbor> =
        wholes.iter_mut().enumerate().map(|(part, whole)| Neighbor { mesh: &mut whole.mesh, weld_m: weld_m(part) }).collect();
    let total = neighbors.iter().map(|neighbor| neighbor.mesh.triangles.len() as u64).sum();
    let mut steps = Steps::new(work.reporter);
    let shared = steps.run("comparing borders", total, |_| share(&mut neighbors, MOST_TRIANGLES))?;
    let parts = shared.into_iter().zip(wholes).map(|(shared, whole)| {
        let changed = shared.report.changes().then(|| {
            let left = Mesh { materials: std::mem::take(&mut whole.mesh.materials), ..Mesh::default() };
            std::mem::replace(&mut whole.mesh, left)
        });
        (shared, changed)
    });
    Ok(Found { parts: parts.collect(), steps: steps.taken })
}

impl Piece for Found {
    fn write(&self, into: &mut Writer) -> Result<(), CacheError> {
        into.number(self.parts.len() as u64);
        for (index, (shared, changed)) in self.parts.iter().enumerate() {
            into.array(&format!("held{index}"), shared.held.bits())?;
            into.told(&shared.report);
            if let Some(mesh) = changed {
                into.mesh(&format!("mesh{index}"), mesh)?;
            }
        }
        into.told(&self.steps);
        Ok(())
    }

    fn read(from: &mut Reader) -> Option<Self> {
        let count = usize::try_from(from.number()?).ok()?;
        let part = |index: usize| {
            let (held, report): (_, BorderReport) = (Held::of_bits(from.array(&format!("held{index}"))?), from.told()?);
            // without its materials it is not whole
            let mesh = if report.changes() { Some(from.unclean_mesh(&format!("mesh{index}"))?) } else { None };
            Some((Shared { held, report }, mesh))
        };
        Some(Self { parts: (0..count).map(part).collect::<Option<_>>()?, steps: from.told()? })
    }
}
