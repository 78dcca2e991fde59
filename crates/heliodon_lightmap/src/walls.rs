//! Walls that stand on a surface and are thinner than its texels.
//!
//! A texel has the light of its middle, but it is filtered, and asked for by bounces, all around it: on the far side of such a wall too. So texels of a chart that lie
//! side by side and cannot see each other are found by short rays close above the surface. Where one side is dark they are dark: light that comes out at the
//! foot of a wall of a dark room is seen from far, a rim as dark as the room outside is not. Bounces do not ask them; paths go on from the place itself.

use crate::refine::Grid;
use glam::Vec3;
use heliodon_rays::{Hit, Ray, TriangleScene};
use rayon::prelude::*;

/// On texels with something above them nearer than this part of the distance to those beside them it lies: nobody sees them, and what is around them need not become as dark.
const LYING: f32 = 1.0 / 4.0;
/// Rays between places of one surface go so far above it, as a part of their length: what is lower, as a carpet, parts nothing.
pub(crate) const ABOVE: f32 = 1.0 / 16.0;
/// What has less than this part of the light on the other side of a wall is dark. Where both sides are lit, each keeps its own: which of them a texel shows is a matter of half
/// a texel, but a dark room stays dark.
pub(crate) const DARK: f32 = 2e-3;
/// Half of the ways to a texel's neighbours; the other half begins at those.
const AHEAD: [[i32; 2]; 4] = [[1, 0], [0, 1], [1, 1], [-1, 1]];
/// Texels that are asked together.
const UNIT: usize = 512;
/// Answers in a word.
const WORD: usize = u64::BITS as usize;

/// A surface in texels, on which walls may stand.
#[derive(Clone, Copy)]
pub struct Footing<'a> {
    /// Answers rays among all triangles.
    pub rays: &'a TriangleScene,
    /// What lies beside what.
    pub grid: &'a Grid,
    /// Where the rays of a texel start, and what is up there, unit: only of those that are asked.
    pub start: &'a (dyn Fn(u32) -> (Vec3, Vec3) + Sync),
    /// Whether a triangle that was met, the first argument, is of the chart of a texel, the second: a surface that bends is no wall.
    pub is_own: &'a (dyn Fn(u32, u32) -> bool + Sync),
}

/// Which pairs of texels are asked whether a wall stands between them; whoever asks for few pays for few.
pub type Wanted<'a> = &'a (dyn Fn(u32, u32) -> bool + Sync);

/// What walls part.
#[derive(Clone, Debug, Default)]
pub struct Walls {
    /// Pairs of valid texels, ascending, each pair both ways.
    pairs: Vec<(u32, u32)>,
    /// Others, each with such ones around it, of which some do not see others.
    within: Vec<(u32, Vec<u32>)>,
}

/// Whether a light is as good as none beside another: no more than so small a part of it.
#[must_use]
pub fn is_dark_beside(light: f32, other: f32, part: f32) -> bool {
    light < other && light <= part * other
}

/// The texels around one in its chart.
fn beside(grid: &Grid, texel: u32) -> impl Iterator<Item = u32> {
    let around = AHEAD.into_iter().flat_map(|[x, y]| [[x, y], [-x, -y]]);
    around.filter_map(move |[x, y]| grid.beside(texel, x, y))
}

/// The pairs that a texel has asked: with those ahead of it where it is valid, of all valid ones around it where it is not.
fn pairs_of(grid: &Grid, valid: &[bool], wanted: Wanted, texel: u32) -> Vec<(u32, u32)> {
    let is_asked = |&(one, other): &(u32, u32)| wanted(one, other);
    if valid[texel as usize] {
        let ahead = AHEAD.into_iter().filter_map(|[x, y]| grid.beside(texel, x, y));
        return ahead.filter(|&other| valid[other as usize]).map(|other| (texel, other)).filter(is_asked).collect();
    }
    let sources: Vec<u32> = beside(grid, texel).filter(|&other| valid[other as usize]).collect();
    let pairs = sources.iter().enumerate().flat_map(|(i, &one)| sources[..i].iter().map(move |&other| (other, one)));
    pairs.filter(is_asked).collect()
}

/// The texels of all pairs that are asked, ascending.
///
/// # Panics
/// When there are not as many flags as texels.
#[must_use]
pub fn asked(grid: &Grid, valid: &[bool], wanted: Wanted) -> Vec<u32> {
    let of_texel = |texel: u32| pairs_of(grid, valid, wanted, texel).into_iter().flat_map(|(one, other)| [one, other]);
    let mut all: Vec<u32> = (0..grid.len() as u32).into_par_iter().flat_map_iter(of_texel).collect();
    all.par_sort_unstable();
    all.dedup();
    all
}

impl Footing<'_> {
    /// On which of some texels something lies, in their order, and the number of rays that it took.
    #[must_use]
    pub fn lain_on(&self, texels: &[u32]) -> (Vec<bool>, u64) {
        let places = self.grid.places();
        let of_unit = |unit: &[u32]| -> Vec<bool> {
            let ray = |&texel: &u32| {
                let (origin, direction) = (self.start)(texel);
                let distance = |other: u32| places[texel as usize].position.distance(places[other as usize].position);
                let far = beside(self.grid, texel).map(distance).fold(0.0, f32::max);
                Ray { origin, direction, t_min: 0.0, t_max: LYING * far }
            };
            let rays: Vec<Ray> = unit.iter().map(ray).collect();
            let mut words = vec![0; rays.len().div_ceil(WORD)];
            self.rays.occluded(&rays, &mut words);
            (0..rays.len()).map(|i| words[i / WORD] >> (i % WORD) & 1 == 1).collect()
        };
        (texels.par_chunks(UNIT).flat_map_iter(of_unit).collect(), texels.len() as u64)
    }

    /// Whether the texels of each pair do not see each other.
    fn are_parted(&self, pairs: &[(u32, u32)]) -> Vec<bool> {
        let ray = |&(from, to): &(u32, u32)| {
            let [(a, up_a), (b, up_b)] = [from, to].map(self.start);
            let above = ABOVE * a.distance(b);
            let (start, end) = (a + up_a * above, b + up_b * above);
            // two that stand for one place see each other
            let (direction, t_max) = if start == end { (up_a, 0.0) } else { (end - start, 1.0) };
            Ray { origin: start, direction, t_min: 0.0, t_max }
        };
        let rays: Vec<Ray> = pairs.iter().map(ray).collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        self.rays.closest(&rays, &mut hits);
        pairs.iter().zip(&hits).map(|(&(from, _), hit)| hit.is_some() && !(self.is_own)(hit.triangle, from)).collect()
    }
}

/// Pairs that are parted, texels within walls, and the number of rays.
type OfUnit = (Vec<(u32, u32)>, Vec<u32>, u64);

impl Walls {
    /// Between wanted pairs of valid texels that lie side by side, or around one that is not valid; returns the number of rays as well. Whoever asks does not call those
    /// valid that something lies on ([`Footing::lain_on`]).
    ///
    /// # Panics
    /// When there are not as many flags as texels.
    #[must_use]
    pub fn find(footing: &Footing, valid: &[bool], wanted: Wanted) -> (Self, u64) {
        let grid = footing.grid;
        let all: Vec<u32> = (0..grid.len() as u32).collect();
        let of_unit = |unit: &[u32]| -> OfUnit {
            let of_texel = |&texel: &u32| pairs_of(grid, valid, wanted, texel).into_iter().map(move |pair| (texel, pair));
            let asked: Vec<(u32, (u32, u32))> = unit.iter().flat_map(of_texel).collect();
            let pairs: Vec<(u32, u32)> = asked.iter().map(|(_, pair)| *pair).collect();
            let parted = footing.are_parted(&pairs);
            let parted = || asked.iter().zip(&parted).filter(|(_, parted)| **parted).map(|(asked, _)| *asked);
            let both = |(_, (a, b)): (u32, (u32, u32))| [(a, b), (b, a)];
            let of_valid = parted().filter(|(texel, _)| valid[*texel as usize]).flat_map(both).collect();
            let mut within: Vec<u32> = parted().map(|(texel, _)| texel).filter(|texel| !valid[*texel as usize]).collect();
            within.dedup();
            (of_valid, within, pairs.len() as u64)
        };
        let parts: Vec<OfUnit> = all.par_chunks(UNIT).map(of_unit).collect();
        let rays = parts.iter().map(|(_, _, rays)| rays).sum();
        let mut pairs: Vec<(u32, u32)> = parts.iter().flat_map(|(pairs, ..)| pairs).copied().collect();
        pairs.par_sort_unstable();
        pairs.dedup();
        let around = |texel: u32| beside(grid, texel).filter(|&other| valid[other as usize]).collect();
        let within = parts.iter().flat_map(|(_, within, _)| within).map(|&texel| (texel, around(texel))).collect();
        (Self { pairs, within }, rays)
    }

    /// The texels that a wall stands on.
    pub fn texels(&self) -> impl Iterator<Item = u32> + '_ {
        self.pairs.iter().map(|(texel, _)| *texel).chain(self.within.iter().map(|(texel, _)| *texel))
    }

    /// The texels that a wall stands on and on whose other side it is dark, where they are not, each with the one there whose light it is to have; `light` tells how much each has,
    /// and what has no more than a `part` of another's is dark beside it.
    #[must_use]
    pub fn darkened(&self, part: f32, light: impl Fn(u32) -> f32) -> Vec<(u32, u32)> {
        let dark = |texel: u32, others: &mut dyn Iterator<Item = u32>| {
            let darker = |least: u32, other: u32| if light(other) < light(least) { other } else { least };
            let least = others.fold(texel, darker);
            is_dark_beside(light(least), light(texel), part).then_some((texel, least))
        };
        let of_pairs = self.pairs.chunk_by(|a, b| a.0 == b.0);
        let of_pairs = of_pairs.filter_map(|pairs| dark(pairs[0].0, &mut pairs.iter().map(|(_, other)| *other)));
        let of_within = self.within.iter().filter_map(|(texel, around)| dark(*texel, &mut around.iter().copied()));
        of_pairs.chain(of_within).collect()
    }
}

/// Gives texels of `width` numbers each what others have ([`Walls::darkened`]).
pub fn take_from<T: Copy>(darkened: &[(u32, u32)], numbers: &mut [T], width: usize) {
    let of = |texel: u32| texel as usize * width..(texel as usize + 1) * width;
    // all as they were before: one that others take from may become darker itself
    let taken: Vec<T> = darkened.iter().flat_map(|&(_, from)| &numbers[of(from)]).copied().collect();
    for (i, &(texel, _)) in darkened.iter().enumerate() {
        numbers[of(texel)].copy_from_slice(&taken[i * width..(i + 1) * width]);
    }
}
