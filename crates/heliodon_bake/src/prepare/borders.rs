//! Borders that parts share: held on both sides, so that no crack opens between parts that are simplified apart.

use super::Work;
use super::part::{MOST_TRIANGLES, Whole, clean_params};
use super::steps::{Step, Steps};
use crate::error::BakeError;
use crate::key::Digest;
use heliodon_prepare::borders::{Neighbor, share};
use heliodon_prepare::simplify::Held;

/// A part among the others.
pub(super) struct Border {
    /// Places whose vertices stay.
    pub held: Held,
    /// What decides the part's further steps: its own digest where it shares nothing, so that where unrelated parts are does not matter to it.
    pub digest: Digest,
}

/// Finds what the parts share, and makes their borders agree; tells as well what that took.
///
/// # Errors
/// More triangles than splitting may make.
pub(super) fn borders(work: &Work, wholes: &mut [Whole]) -> Result<(Vec<Border>, Vec<Step>), BakeError> {
    let alone = || work.parts.iter().map(|digest| Border { held: Held::NOTHING, digest: digest.clone() }).collect();
    if wholes.len() < 2 {
        return Ok((alone(), Vec::new()));
    }
    let weld_m = |part: usize| match work.settings.clean {
        true => clean_params(work.settings, work.site.parts[part].role, &work.views).weld_m,
        false => 0.0,
    };
    let mut neighbors: Vec<Neighbor> =
        wholes.iter_mut().enumerate().map(|(part, whole)| Neighbor { mesh: &mut whole.mesh, weld_m: weld_m(part) }).collect();
    let total = neighbors.iter().map(|neighbor| neighbor.mesh.triangles.len() as u64).sum();
    let mut steps = Steps::new(work.reporter);
    let shared = steps.run("comparing borders", total, |_| share(&mut neighbors, MOST_TRIANGLES))?;
    let mut borders: Vec<Border> = alone();
    for ((whole, shared), border) in wholes.iter_mut().zip(shared).zip(&mut borders) {
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
    Ok((borders, steps.taken))
}
