//! Colours that a file of fewer bits can hold, chosen so that both sides of borders show the same.
//!
//! Rounded to the nearest, each texel errs for itself, and what was within half a code is not any more. Which of its neighbours a texel is rounded to is free: one after the
//! other takes the colour with which the places around it are shown least apart, until none changes.

use super::settle::Asks;
use super::{Match, Seams, shown_codes};
use glam::Vec3;

/// How often every texel is asked at most.
const SWEEPS: usize = 64;
/// What a code counts by which a texel is off what was found, beside one by which a place is apart.
const OFF: f32 = 0.05;

impl Seams {
    /// Changes colours that a file can hold to `others` that it can hold as well (of a texel, what was found for it and what it has), until as few places as can be are shown further apart than
    /// `codes` ([`shown_codes`]). What was found to be black stays as it is. `white` and `codes` are above 0; where they are not, nothing is changed.
    ///
    /// # Panics
    /// When there are not as many colours as texels.
    pub fn choose<C: IntoIterator<Item = Vec3>>(
        &self,
        found: &[Vec3],
        held: &mut [Vec3],
        white: f32,
        codes: f32,
        others: impl Fn(usize, Vec3, Vec3) -> C,
    ) {
        assert!(found.len() == self.texels && held.len() == self.texels, "a colour for each texel");
        if !(white > 0.0 && codes > 0.0) {
            return;
        }
        let of_touched =
            |light: &[Vec3]| -> Vec<[f32; 3]> { self.touched.iter().map(|&texel| light[texel as usize].to_array()).collect() };
        let (found, mut own) = (of_touched(found), of_touched(held));
        let shown = |middle: [f32; 3]| Vec3::from_array(middle.map(|middle| shown_codes(1.0, middle, white)));
        let asks = Asks::new(&self.matches, own.len());
        let counts: Vec<Vec3> = self.matches.iter().map(|matched| shown(matched.middle(&found))).collect();
        let mut apart: Vec<Vec3> =
            self.matches.iter().zip(&counts).map(|(matched, counts)| Vec3::from_array(matched.apart(&own)) * *counts).collect();
        let beyond = |apart: Vec3| (apart.abs() - 0.5 * codes).max(Vec3::ZERO).length_squared();
        for _ in 0..SWEEPS {
            let mut is_changed = false;
            for texel in (0..own.len()).filter(|&texel| found[texel] != [0.0; 3]) {
                let places = asks.of(texel as u32);
                if places.iter().all(|&place| beyond(apart[place as usize]) == 0.0) {
                    continue;
                }
                let counted = shown(found[texel]);
                let [found, before] = [found[texel], own[texel]].map(Vec3::from_array);
                let moved = |place: u32, color: Vec3| {
                    let weight = self.matches[place as usize].weight(texel as u32);
                    apart[place as usize] + counts[place as usize] * weight * (color - before)
                };
                let costs = |color: Vec3| {
                    let off = OFF * ((color - found) * counted).length_squared();
                    off + places.iter().map(|&place| beyond(moved(place, color))).sum::<f32>()
                };
                let other = others(self.touched[texel] as usize, found, before).into_iter();
                let best = other.map(|color| (costs(color), color)).min_by(|a, b| a.0.total_cmp(&b.0));
                let Some((_, color)) = best.filter(|(cost, _)| *cost < costs(before)) else { continue };
                let after: Vec<Vec3> = places.iter().map(|&place| moved(place, color)).collect();
                places.iter().zip(after).for_each(|(&place, after)| apart[place as usize] = after);
                (own[texel], is_changed) = (color.to_array(), true);
            }
            if !is_changed {
                break;
            }
        }
        self.touched.iter().zip(own).for_each(|(&texel, color)| held[texel as usize] = Vec3::from_array(color));
    }
}

impl Match {
    /// What a texel counts.
    fn weight(&self, texel: u32) -> f32 {
        (0..8).filter(|&i| self.texels[i] == texel).map(|i| self.weights[i]).sum()
    }
}
