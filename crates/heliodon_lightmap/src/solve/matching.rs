//! Both sides of borders between charts are made to show the same.

use super::walls::DARK;
use super::{Scene, nearly_brightest};
use crate::refine::Grid;
use crate::seams::Seams;
use glam::Vec3;

/// Both sides of a border may be shown apart by so many codes of eight bits.
const SEAM_CODES: f32 = 0.5;

/// By how much both sides of borders still differ at most.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Widest {
    /// Of light.
    pub value: f32,
    /// In codes of eight bits ([`crate::seams::shown_codes`]).
    pub codes: f32,
    /// How many places were matched, and how many not.
    pub places: [usize; 2],
}

/// Which texels may be changed, so that what is dark stays dark: those that are whole, and of the others, which lie within something or have a wall on them, those that only lit texels, or only dark
/// ones, are filtered with. Such a texel of a narrow chart below a wall shows a little of itself beside the wall, and has nobody in its own chart to borrow from. Returns at how many places that will
/// not be matched none of the texels is valid as well: they lie within things.
pub(super) fn may_be_matched(scene: &Scene, grid: &Grid, valid: &[bool], whole: &[bool], light: &[Vec3]) -> (Vec<bool>, usize) {
    let of = |texel: u32| {
        let most = light[texel as usize].max_element();
        // one that is not valid may be as dark as it is, nobody is to see that; what it has borrowed is not to come to what is dark
        Span { least: if valid[texel as usize] { most } else { f32::INFINITY }, most }
    };
    let open = |texel: u32| !whole[texel as usize];
    let in_chart = |of: &dyn Fn(u32) -> Span| -> Vec<Span> {
        let around = |texel: u32| (-1..=1).flat_map(move |y| (-1..=1).filter_map(move |x| grid.beside(texel, x, y)));
        let spans = |texel: u32| if open(texel) { around(texel).map(of).fold(Span::NONE, Span::and) } else { Span::NONE };
        (0..light.len() as u32).map(spans).collect()
    };
    let mut around = in_chart(&of);
    let seams = scene.seams(&[]);
    for place in seams.places() {
        let all = place.clone().map(of).fold(Span::NONE, Span::and);
        place.filter(|&texel| open(texel)).for_each(|texel| around[texel as usize] = around[texel as usize].and(all));
    }
    // one may border on what is lit, and the one beside it, with which it is filtered, on what is dark
    let further = in_chart(&|texel| around[texel as usize]);
    let is_kept = |texel: u32| !open(texel) || further[texel as usize].is_of_one_side();
    let mut matched: Vec<bool> = (0..light.len() as u32).map(is_kept).collect();
    for place in seams.places().filter(|place| place.clone().all(|texel| !valid[texel as usize])) {
        let all = place.clone().map(|texel| around[texel as usize]).fold(Span::NONE, Span::and);
        if !all.is_of_one_side() {
            place.for_each(|texel| matched[texel as usize] = false);
        }
    }
    let left = seams.places().filter(|place| place.clone().any(|texel| !matched[texel as usize]));
    let hidden = left.filter(|place| place.clone().all(|texel| !valid[texel as usize])).count();
    (matched, hidden)
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

/// Matches both sides of borders between charts, where texels are `matched` ([`super::LightMap::matched`]); no colour becomes negative. `light` may be what was made of it, as the
/// light times the albedo.
///
/// # Panics
/// When there is not a colour and a mark for each texel.
pub fn match_seams(scene: &Scene, matched: &[bool], light: &mut [Vec3]) -> Widest {
    let seams = scene.seams(matched);
    let mut bright: Vec<f32> = light.iter().map(|light| light.max_element()).collect();
    let white = nearly_brightest(&mut bright);
    let count = light.len();
    let mut values: Vec<f32> = (0..3).flat_map(|c| light.iter().map(move |light| light[c])).collect();
    seams.close_shown(&mut values, white, SEAM_CODES);
    for (i, light) in light.iter_mut().enumerate() {
        *light = Vec3::new(values[i], values[count + i], values[2 * count + i]);
    }
    let colors = || values.chunks(count.max(1));
    Widest {
        value: colors().map(|values| seams.widest(values)).fold(0.0, f32::max),
        codes: colors().map(|values| seams.widest_shown(values, white)).fold(0.0, f32::max),
        places: [seams.len(), scene.seams(&[]).len() - seams.len()],
    }
}

impl Scene<'_> {
    /// The borders of its charts, as far as they take from `valid` texels alone.
    fn seams(&self, valid: &[bool]) -> Seams {
        let surface = (self.positions, self.normals, &self.triangles[..self.unwrapped.triangles.len()]);
        Seams::new(self.unwrapped, surface, self.texels, self.sides, valid)
    }
}
