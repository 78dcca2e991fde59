//! Walls that stand on a surface and are thinner than its texels.
//!
//! A texel has the light of its middle, but it is filtered, and asked for by bounces, all around it: on the far side of such a wall too. So texels of a chart that lie
//! side by side and cannot see each other are found by short rays close above the surface. Where one side is dark they are dark: light that comes out at the
//! foot of a wall of a dark room is seen from far, a rim as dark as the room outside is not. Bounces do not ask them; paths go on from the place itself.

use super::stage::{ABOVE, Stage};
use crate::refine::Grid;
use glam::Vec3;
use heliodon_rays::{Hit, Ray};
use rayon::prelude::*;

/// On texels with something above them nearer than this part of the distance to those beside them it lies: nobody sees them, and what is around them need not become as dark.
const LYING: f32 = 1.0 / 4.0;
/// What has less than this part of the light on the other side of a wall is dark. Where both sides are lit, each keeps its own: which of them a texel shows is a matter of half
/// a texel, but a dark room stays dark.
pub(super) const DARK: f32 = 2e-3;
/// Half of the ways to a texel's neighbours; the other half begins at those.
const AHEAD: [[i32; 2]; 4] = [[1, 0], [0, 1], [1, 1], [-1, 1]];
/// Texels that are asked together.
const UNIT: usize = 512;
/// Answers in a word.
const WORD: usize = u64::BITS as usize;

/// What walls part.
#[derive(Clone, Debug, Default)]
pub(super) struct Walls {
    /// Pairs of valid texels that nothing lies on, ascending, each pair both ways.
    pairs: Vec<(u32, u32)>,
    /// Others, each with such ones around it, of which some do not see others.
    within: Vec<(u32, Vec<u32>)>,
}

/// The texels around one in its chart.
fn beside(grid: &Grid, texel: u32) -> impl Iterator<Item = u32> {
    let around = AHEAD.into_iter().flat_map(|[x, y]| [[x, y], [-x, -y]]);
    around.filter_map(move |[x, y]| grid.beside(texel, x, y))
}

/// The texels that something lies on, and the number of rays that it took.
pub(super) fn lain_on(stage: &Stage, grid: &Grid) -> (Vec<bool>, u64) {
    let all: Vec<u32> = (0..grid.len() as u32).collect();
    let of_unit = |unit: &[u32]| -> Vec<bool> {
        let ray = |&texel: &u32| {
            let origin = stage.origins[texel as usize];
            let far = beside(grid, texel).map(|other| origin.distance(stage.origins[other as usize])).fold(0.0, f32::max);
            Ray { origin, direction: stage.planes[texel as usize], t_min: 0.0, t_max: LYING * far }
        };
        let rays: Vec<Ray> = unit.iter().map(ray).collect();
        let mut words = vec![0; rays.len().div_ceil(WORD)];
        stage.scene.rays.occluded(&rays, &mut words);
        (0..rays.len()).map(|i| words[i / WORD] >> (i % WORD) & 1 == 1).collect()
    };
    (all.par_chunks(UNIT).flat_map_iter(of_unit).collect(), all.len() as u64)
}

impl Walls {
    /// Of all texels, those that something lies on (`lain_on`) aside; returns the number of rays as well.
    pub fn find(stage: &Stage, grid: &Grid, valid: &[bool], lain_on: &[bool]) -> (Self, u64) {
        let valid: Vec<bool> = valid.iter().zip(lain_on).map(|(valid, lain_on)| *valid && !lain_on).collect();
        let all: Vec<u32> = (0..grid.len() as u32).collect();
        let around = |texel: u32| beside(grid, texel).filter(|&other| valid[other as usize]);
        let asked = |texel: u32| -> Vec<(u32, u32)> {
            if valid[texel as usize] {
                let ahead = AHEAD.into_iter().filter_map(|[x, y]| grid.beside(texel, x, y));
                return ahead.filter(|&other| valid[other as usize]).map(|other| (texel, other)).collect();
            }
            let sources: Vec<u32> = around(texel).collect();
            let pairs = sources.iter().enumerate().flat_map(|(i, &one)| sources[..i].iter().map(move |&other| (other, one)));
            pairs.collect()
        };
        let parts: Vec<OfUnit> = all
            .par_chunks(UNIT)
            .map(|unit| {
                let asked: Vec<(u32, (u32, u32))> =
                    unit.iter().flat_map(|&texel| asked(texel).into_iter().map(move |pair| (texel, pair))).collect();
                let pairs: Vec<(u32, u32)> = asked.iter().map(|(_, pair)| *pair).collect();
                let (parted, rays) = are_parted(stage, &pairs);
                let parted = || asked.iter().zip(&parted).filter(|(_, parted)| **parted).map(|(asked, _)| *asked);
                let both = |(_, (a, b)): (u32, (u32, u32))| [(a, b), (b, a)];
                let pairs = parted().filter(|(texel, _)| valid[*texel as usize]).flat_map(both).collect();
                let mut within: Vec<u32> = parted().map(|(texel, _)| texel).filter(|texel| !valid[*texel as usize]).collect();
                within.dedup();
                (pairs, within, rays)
            })
            .collect();
        let rays = parts.iter().map(|(_, _, rays)| rays).sum();
        let mut pairs: Vec<(u32, u32)> = parts.iter().flat_map(|(pairs, ..)| pairs).copied().collect();
        pairs.par_sort_unstable();
        pairs.dedup();
        let within = parts.iter().flat_map(|(_, within, _)| within).map(|&texel| (texel, around(texel).collect())).collect();
        (Self { pairs, within }, rays)
    }

    /// The texels that a wall stands on.
    pub fn texels(&self) -> impl Iterator<Item = u32> + '_ {
        self.pairs.iter().map(|(texel, _)| *texel).chain(self.within.iter().map(|(texel, _)| *texel))
    }

    /// Gives the texels that a wall stands on the light of its dark side, where that is as good as none.
    pub fn darken(&self, light: &mut [Vec3]) {
        let dark = |own: Vec3, others: &mut dyn Iterator<Item = Vec3>| {
            let darker = |least: Vec3, other: Vec3| if other.max_element() < least.max_element() { other } else { least };
            let least = others.fold(own, darker);
            if least.max_element() <= DARK * own.max_element() { least } else { own }
        };
        let of_pairs = self.pairs.chunk_by(|a, b| a.0 == b.0).map(|pairs| {
            let texel = pairs[0].0;
            (texel, dark(light[texel as usize], &mut pairs.iter().map(|(_, other)| light[*other as usize])))
        });
        let of_within = self.within.iter().map(|(texel, around)| {
            (*texel, dark(light[*texel as usize], &mut around.iter().map(|&other| light[other as usize])))
        });
        let darkened: Vec<(u32, Vec3)> = of_pairs.chain(of_within).collect();
        darkened.into_iter().for_each(|(texel, own)| light[texel as usize] = own);
    }
}

/// Pairs that are parted, texels within walls, and the number of rays.
type OfUnit = (Vec<(u32, u32)>, Vec<u32>, u64);

/// Whether the texels of each pair do not see each other, and the number of rays that it took.
fn are_parted(stage: &Stage, pairs: &[(u32, u32)]) -> (Vec<bool>, u64) {
    let ray = |&(from, to): &(u32, u32)| {
        let ([a, b], [up_a, up_b]) =
            ([from, to].map(|t| stage.origins[t as usize]), [from, to].map(|t| stage.planes[t as usize]));
        let above = ABOVE * a.distance(b);
        let (start, end) = (a + up_a * above, b + up_b * above);
        // two that stand for one place see each other
        let (direction, t_max) = if start == end { (up_a, 0.0) } else { (end - start, 1.0) };
        Ray { origin: start, direction, t_min: 0.0, t_max }
    };
    let rays: Vec<Ray> = pairs.iter().map(ray).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    stage.scene.rays.closest(&rays, &mut hits);
    let chart = |triangle: u32| stage.scene.unwrapped.chart.get(triangle as usize);
    let of_texel = |texel: u32| chart(stage.scene.texels[texel as usize].triangle);
    // the surface itself bends
    let parted = pairs.iter().zip(&hits).map(|(&(from, _), hit)| hit.is_some() && chart(hit.triangle) != of_texel(from));
    (parted.collect(), rays.len() as u64)
}
