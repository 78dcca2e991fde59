//! Both sides of borders between charts are made to show the same.

use super::walls::DARK;
use super::{Scene, nearly_brightest};
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

/// Which texels may be changed: those that are whole, and others where no place of a border is filtered from dark and lit ones together, so that what is dark stays dark.
pub(super) fn may_be_matched(scene: &Scene, whole: &[bool], light: &[Vec3]) -> Vec<bool> {
    let mut matched = vec![true; light.len()];
    for place in scene.seams(&[]).places() {
        let bright = |texel: u32| light[texel as usize].max_element();
        let (least, most) =
            place.clone().map(bright).fold((f32::INFINITY, 0.0_f32), |(least, most), l| (least.min(l), most.max(l)));
        if least <= DARK * most && most > 0.0 {
            place.filter(|&texel| !whole[texel as usize]).for_each(|texel| matched[texel as usize] = false);
        }
    }
    matched
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
