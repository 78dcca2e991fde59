//! About as many triangles as the site wants.

use super::Work;
use super::arrays::{Reader, Writer, textures_of};
use super::dropped::look_around;
use super::part::{piece_name, simplifies, simplify_params};
use super::pieces::{PIECE, Piece};
use super::steps::{Step, Steps};
use crate::cache::CacheError;
use crate::error::BakeError;
use heliodon_mesh::Mesh;
use heliodon_prepare::purge::PurgeParams;
use heliodon_prepare::simplify::{SimplifyParams, simplify};

/// Rounds at most.
const MOST_ROUNDS: usize = 6;
/// What is drawn fits where it is no more than so many times what is asked for.
const FITS: f64 = 1.05;
/// Limits grow by at least this much in each round.
const LEAST_GROWTH: f64 = 1.1;

/// How many triangles would be drawn.
struct Count {
    drawn: u64,
    steps: Vec<Step>,
}

/// A part simplified once more.
struct Again {
    mesh: Mesh,
    steps: Vec<Step>,
}

/// Simplifies further until about as many triangles are drawn as the site wants; returns the limits with which they do, and what that took. What is
/// simplified again is a subset of the original's vertices still, and is compared with the original in the end.
///
/// # Errors
/// More geometry than the ray engine holds, or a cache that cannot be written.
pub(super) fn fit(work: &Work, meshes: &mut [Mesh]) -> Result<(SimplifyParams, Vec<Step>), BakeError> {
    let (mut params, mut steps) = (simplify_params(work.settings), Vec::new());
    if work.settings.triangles == 0 || !simplifies(&params, &work.views) {
        return Ok((params, steps));
    }
    for round in 1..=MOST_ROUNDS {
        let mut count = work.pieces.kept_or(&format!("{PIECE}count{round}"), &[], || count(work, meshes))?;
        steps.append(&mut count.steps);
        let excess = count.drawn as f64 / work.settings.triangles as f64;
        if excess <= FITS {
            break;
        }
        // triangles have areas
        params = coarser(&params, excess.sqrt().max(LEAST_GROWTH) as f32);
        for (index, mesh) in meshes.iter_mut().enumerate() {
            let name = piece_name(index, &format!("again{round}"));
            let mut again = work.pieces.kept_or(&name, &textures_of(&mesh.materials), || Ok(again(work, mesh, &params)))?;
            steps.append(&mut again.steps);
            *mesh = again.mesh;
        }
    }
    Ok((params, steps))
}

/// As `params`, with limits so many times as large.
pub(super) fn coarser(params: &SimplifyParams, times: f32) -> SimplifyParams {
    SimplifyParams {
        error_px: times * params.error_px,
        edge_px: times * params.edge_px,
        error_m: times * params.error_m,
        edge_m: times * params.edge_m,
        ..params.clone()
    }
}

fn count(work: &Work, meshes: &[Mesh]) -> Result<Count, BakeError> {
    if !work.purges() {
        return Ok(Count { drawn: meshes.iter().map(|mesh| mesh.triangles.len() as u64).sum(), steps: Vec::new() });
    }
    let params = PurgeParams { ring: work.settings.ring, max_checks: 1, ..PurgeParams::preview() };
    let seen = look_around(work, meshes, &params)?;
    Ok(Count { drawn: seen.keep.iter().filter(|kept| **kept).count() as u64, steps: seen.steps })
}

fn again(work: &Work, mesh: &Mesh, params: &SimplifyParams) -> Again {
    let mut steps = Steps::new(work.reporter);
    let mesh = steps.run("simplifying to the number wanted", || simplify(mesh, &work.views, params)).mesh;
    Again { mesh, steps: steps.taken }
}

impl Piece for Count {
    fn write(&self, into: &mut Writer) -> Result<(), CacheError> {
        into.number(self.drawn);
        into.told(&self.steps);
        Ok(())
    }

    fn read(from: &mut Reader) -> Option<Self> {
        Some(Self { drawn: from.number()?, steps: from.told()? })
    }
}

impl Piece for Again {
    fn write(&self, into: &mut Writer) -> Result<(), CacheError> {
        into.mesh("mesh", &self.mesh)?;
        into.told(&self.steps);
        Ok(())
    }

    fn read(from: &mut Reader) -> Option<Self> {
        Some(Self { mesh: from.mesh("mesh")?, steps: from.told()? })
    }
}
