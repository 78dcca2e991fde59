//! About as many triangles as the site wants.

use super::Work;
use super::arrays::{Reader, Writer, textures_of};
use super::dropped::look_around;
use super::part::{count as triangles, piece_name, simplifies, simplify_params};
use super::pieces::{PIECE, Piece};
use super::steps::{Step, Steps};
use crate::cache::CacheError;
use crate::error::BakeError;
use glam::Vec3;
use heliodon_bundle::site::Role;
use heliodon_mesh::Mesh;
use heliodon_prepare::Tell;
use heliodon_prepare::purge::PurgeParams;
use heliodon_prepare::simplify::{SimplifyParams, simplify_further};

/// Rounds at most.
pub(super) const MOST_ROUNDS: usize = 6;
/// What is drawn fits where it is no more than so many times what is asked for.
const FITS: f64 = 1.05;
/// Limits grow by at least this much in each round.
const LEAST_GROWTH: f64 = 1.1;
/// Ground gives way before stone does, until its limits are so many times as large. Beneath and around a room without windows it takes more
/// triangles than all that stands on it, for an eye that looks down is nearer to it than to anything.
pub(super) const GROUND_GIVES: f64 = 8.0;

/// How many triangles would be drawn.
struct Count {
    /// Part by part.
    drawn: Vec<u64>,
    steps: Vec<Step>,
}

/// A part simplified once more.
struct Again {
    mesh: Mesh,
    steps: Vec<Step>,
}

/// By how much limits grow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Growth {
    pub stone: f64,
    pub ground: f64,
}

/// Simplifies further until about as many triangles are drawn as the site wants; returns the limits of each part with which they do, and what that
/// took. `ends` are where the vertices of each part's original end among all of `original`.
///
/// # Errors
/// More geometry than the ray engine holds, or a cache that cannot be written.
pub(super) fn fit(
    work: &Work,
    meshes: &mut [Mesh],
    original: &[Vec3],
    ends: &[usize],
) -> Result<(Vec<SimplifyParams>, Vec<Step>), BakeError> {
    let (mut params, mut steps) = (vec![simplify_params(work.settings); meshes.len()], Vec::new());
    if work.settings.triangles == 0 || params.first().is_none_or(|params| !simplifies(params, &work.views)) {
        return Ok((params, steps));
    }
    let is_ground = |part: usize| work.site.parts[part].role == Role::Ground;
    let mut so_far = Growth { stone: 1.0, ground: 1.0 };
    for round in 1..=MOST_ROUNDS {
        let mut count = work.pieces.kept_or(&format!("{PIECE}count{round}"), &[], || count(work, meshes))?;
        steps.append(&mut count.steps);
        let of = |ground: bool| (0..meshes.len()).filter(|&i| is_ground(i) == ground).map(|i| count.drawn[i] as f64).sum();
        let Some(growth) = growth(of(false), of(true), work.settings.triangles as f64, so_far) else { break };
        so_far = Growth { stone: so_far.stone * growth.stone, ground: so_far.ground * growth.ground };
        for (index, mesh) in meshes.iter_mut().enumerate() {
            let times = if is_ground(index) { growth.ground } else { growth.stone };
            if times == 1.0 {
                continue;
            }
            params[index] = coarser(&params[index], times as f32);
            let name = piece_name(index, &format!("again{round}"));
            let begin = if index == 0 { 0 } else { ends[index - 1] };
            let make = || Ok(again(work, mesh, &original[begin..ends[index]], &params[index]));
            let mut again = work.pieces.kept_or(&name, &textures_of(&mesh.materials), make)?;
            steps.append(&mut again.steps);
            *mesh = again.mesh;
        }
    }
    Ok((params, steps))
}

/// By how much limits must grow so that so many triangles of stone and of ground become as many as are wanted; none where they fit. Triangles have
/// areas, so their number falls with the square.
pub(super) fn growth(stone: f64, ground: f64, wanted: f64, so_far: Growth) -> Option<Growth> {
    if stone + ground <= FITS * wanted {
        return None;
    }
    let gives = GROUND_GIVES * so_far.stone / so_far.ground;
    let asked = (ground / (wanted - stone).max(1.0)).sqrt().max(LEAST_GROWTH);
    let alone = if ground > 0.0 { asked.min(gives).max(1.0) } else { 1.0 };
    let left = (stone + ground / (alone * alone)) / wanted;
    let stone = if alone > 1.0 && left <= FITS { 1.0 } else { left.sqrt().max(LEAST_GROWTH) };
    Some(Growth { stone, ground: alone * stone })
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
        return Ok(Count { drawn: meshes.iter().map(|mesh| mesh.triangles.len() as u64).collect(), steps: Vec::new() });
    }
    let params = PurgeParams { ring: work.settings.ring, max_checks: 1, ..PurgeParams::preview() };
    let seen = look_around(work, meshes, &params)?;
    let mut keep = seen.keep.as_slice();
    let of_part = |mesh: &Mesh| {
        let (of_part, rest) = keep.split_at(mesh.triangles.len());
        keep = rest;
        of_part.iter().filter(|kept| **kept).count() as u64
    };
    Ok(Count { drawn: meshes.iter().map(of_part).collect(), steps: seen.steps })
}

fn again(work: &Work, mesh: &Mesh, original: &[Vec3], params: &SimplifyParams) -> Again {
    let mut steps = Steps::new(work.reporter);
    let further = |tell: Tell| simplify_further(mesh, original, &work.views, params, tell);
    let mesh = steps.run("simplifying to the number wanted", triangles(mesh), further).mesh;
    Again { mesh, steps: steps.taken }
}

impl Piece for Count {
    fn write(&self, into: &mut Writer) -> Result<(), CacheError> {
        into.told(&self.drawn);
        into.told(&self.steps);
        Ok(())
    }

    fn read(from: &mut Reader) -> Option<Self> {
        Some(Self { drawn: from.told()?, steps: from.told()? })
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

#[cfg(test)]
mod tests {
    use super::*;

    const BEGIN: Growth = Growth { stone: 1.0, ground: 1.0 };

    #[test]
    fn ground_gives_way_before_stone() {
        assert_eq!(growth(300.0, 700.0, 1000.0, BEGIN), None);
        // a quarter of the ground is enough
        assert_eq!(growth(300.0, 2800.0, 1000.0, BEGIN), Some(Growth { stone: 1.0, ground: 2.0 }));
        // all that it gives is not: the rest is taken from both
        let both = growth(1175.0, 1600.0, 600.0, BEGIN).unwrap();
        assert!(
            (both.stone - 2.0_f64.sqrt()).abs() < 1e-9 && (both.ground - GROUND_GIVES * both.stone).abs() < 1e-9,
            "{both:?}"
        );
        // what it has given it does not give again
        let more = growth(900.0, 300.0, 600.0, Growth { stone: 1.5, ground: 1.5 * GROUND_GIVES }).unwrap();
        assert!((more.stone - 2.0_f64.sqrt()).abs() < 1e-9 && more.ground == more.stone, "{more:?}");
    }

    #[test]
    fn stone_alone_grows_as_it_must() {
        let alone = growth(1600.0, 0.0, 400.0, BEGIN).unwrap();
        assert_eq!(alone.stone, 2.0);
        assert_eq!(growth(420.1, 0.0, 400.0, BEGIN).unwrap().stone, LEAST_GROWTH);
    }
}
