//! Both sides of borders between charts are made to show the same.

use super::{Scene, bright};
use crate::refine::Grid;
use crate::seams::Seams;
use crate::walls::DARK;
use glam::Vec3;

/// Both sides of a border may be shown apart by so many codes of eight bits.
pub(super) const SEAM_CODES: f32 = 0.5;

/// By how much both sides of borders still differ at most.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Widest {
    /// Of light.
    pub value: f32,
    /// In codes of eight bits ([`crate::seams::shown_codes`]).
    pub codes: f32,
    /// How many places were matched, and how many not: nobody sees them.
    pub places: [usize; 2],
}

/// The places of borders that are matched, so that what is dark stays dark. Free are those that take from whole texels alone, and of the others, which take from texels within something or with a wall on
/// them, those whose texels only lit ones, or only dark ones, are filtered with. Such a texel of a narrow chart below a wall shows a little of itself beside the wall, and has nobody in its own chart
/// to borrow from. At the others texels become no brighter, and where none of their texels is `seen` by anybody, they are left.
pub(super) fn seams(scene: &Scene, grid: &Grid, seen: &[bool], whole: &[bool], light: &[Vec3]) -> Seams {
    let of = |texel: u32| {
        let most = light[texel as usize].max_element();
        // one that is not seen may be as dark as it is; what it has borrowed is not to come to what is dark
        Span { least: if seen[texel as usize] { most } else { f32::INFINITY }, most }
    };
    let open = |texel: u32| !whole[texel as usize];
    let in_chart = |of: &dyn Fn(u32) -> Span| -> Vec<Span> {
        let around = |texel: u32| (-1..=1).flat_map(move |y| (-1..=1).filter_map(move |x| grid.beside(texel, x, y)));
        let spans = |texel: u32| if open(texel) { around(texel).map(of).fold(Span::NONE, Span::and) } else { Span::NONE };
        (0..light.len() as u32).map(spans).collect()
    };
    let mut around = in_chart(&of);
    let surface = (scene.positions, scene.normals, &scene.triangles[..scene.unwrapped.triangles.len()]);
    let mut seams = Seams::new(scene.unwrapped, surface, scene.texels, scene.sides);
    for place in seams.places() {
        let all = place.clone().map(of).fold(Span::NONE, Span::and);
        place.filter(|&texel| open(texel)).for_each(|texel| around[texel as usize] = around[texel as usize].and(all));
    }
    // one may border on what is lit, and the one beside it, with which it is filtered, on what is dark
    let further = in_chart(&|texel| around[texel as usize]);
    let mut is_capped = vec![false; light.len()];
    let keep = seams.places().map(|place| {
        let of_open = place.clone().filter(|&texel| open(texel));
        let is_of_one_side = of_open.clone().all(|texel| further[texel as usize].is_of_one_side());
        let is_hidden = place.clone().all(|texel| !seen[texel as usize]);
        // where nobody sees any, what is around all of them tells
        let all = of_open.clone().map(|texel| around[texel as usize]).fold(Span::NONE, Span::and);
        let is_free = of_open.clone().next().is_none() || (is_of_one_side && (!is_hidden || all.is_of_one_side()));
        if !is_free && !is_hidden {
            place.for_each(|texel| is_capped[texel as usize] = true);
        }
        is_free || !is_hidden
    });
    let keep: Vec<bool> = keep.collect();
    seams.keep(&keep);
    seams.cap(&is_capped);
    seams
}

/// The least and the most light of some texels.
#[derive(Clone, Copy)]
struct Span {
    least: f32,
    most: f32,
}

impl Span {
    const NONE: Self = Self { least: f32::INFINITY, most: f32::NEG_INFINITY };

    fn and(self, other: Self) -> Self {
        Self { least: self.least.min(other.least), most: self.most.max(other.most) }
    }

    /// Whether there are any, and none is dark beside another.
    fn is_of_one_side(self) -> bool {
        self.most >= self.least && (self.least > DARK * self.most || self.most <= 0.0)
    }
}

/// Matches both sides of borders between charts ([`super::LightMap::seams`]); no colour becomes negative. `light` may be what was made of it, as the light times the albedo.
///
/// # Panics
/// When there is not a colour for each texel.
pub fn match_seams(seams: &Seams, light: &mut [Vec3]) -> Widest {
    let (mut values, white) = (apart(light), white(light));
    seams.close_shown(&mut values, white, SEAM_CODES);
    let count = light.len();
    for (i, light) in light.iter_mut().enumerate() {
        *light = Vec3::new(values[i], values[count + i], values[2 * count + i]);
    }
    widest_beside(seams, light, white)
}

/// By how much both sides of borders differ.
///
/// # Panics
/// As [`match_seams`].
pub fn widest(seams: &Seams, light: &[Vec3]) -> Widest {
    widest_beside(seams, light, white(light))
}

fn widest_beside(seams: &Seams, light: &[Vec3], white: f32) -> Widest {
    let values = apart(light);
    let colors = || values.chunks(light.len().max(1));
    Widest {
        value: colors().map(|values| seams.widest(values)).fold(0.0, f32::max),
        codes: colors().map(|values| seams.widest_shown(values, white)).fold(0.0, f32::max),
        places: [seams.len(), seams.left()],
    }
}

/// All reds, then all greens, then all blues.
fn apart(light: &[Vec3]) -> Vec<f32> {
    (0..3).flat_map(|c| light.iter().map(move |light| light[c])).collect()
}

/// What is shown as white.
pub(super) fn white(light: &[Vec3]) -> f32 {
    bright(light.iter().map(|light| light.max_element()).collect())
}
