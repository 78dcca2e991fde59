//! The light of a regular lattice of points in free space: the ambient cube of each, and whether the suns reach it.
//!
//! Each point is six points of the solver, one for each of the [`AXES`] as its normal, so that what lights a surface of any normal
//! there is mixed from the three that it faces, weighed by the squares of the normal's components, which sum to one (G. McTaggart:
//! "Half-Life 2 / Valve Source Shading", GDC 2004). Why six hemispheres and not one sphere: the transfer then has the bounces, the
//! further looks and the followed paths of vertices, and the cost is that of six vertices (`docs/decisions/014-actors.md`).
//!
//! A point that lies inside something is not valid, and takes the light of the valid point that is nearest over the fewest steps of
//! the lattice. The fill is for programs that interpolate without looking at the flags; readers that look leave such points out, for
//! what fills a wall may be the light of its other side.

use crate::inside::BACK_LIMIT;
use crate::{FreeLight, LightError, SunMasks};
use glam::Vec3;
use std::collections::HashMap;

/// The normals of each lattice point's six points, in order.
pub const AXES: [Vec3; 6] = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];

/// The light of a lattice of L points.
#[derive(Clone, Debug, PartialEq)]
pub struct LatticeLight {
    /// 1 where a point lies in the open, 0 where it lies inside something and took its light from another.
    pub valid: Vec<u8>,
    /// The point whose light each has: itself where it is valid or no valid one is within reach.
    pub source: Vec<u32>,
    /// `L * 6 * C * channels` numbers: point-major, then axis, then as those of vertices.
    pub sky_transfer: Vec<f32>,
    /// `L * 6 * R * channels` numbers; empty where no sun bounces.
    pub sun_bounce: Vec<f32>,
    /// Whether each sun reaches each point, whatever a surface's normal there.
    pub masks: SunMasks,
}

/// The places of six points for each lattice point, for [`crate::Layout::add_free_points`].
#[must_use]
pub fn lattice_places(positions: &[Vec3]) -> Vec<(Vec3, Vec3)> {
    positions.iter().flat_map(|&position| AXES.map(|axis| (position, axis))).collect()
}

impl LatticeLight {
    /// Joins the light and the masks of six points each into that of the lattice points with integer coordinates `cells`.
    ///
    /// # Errors
    /// Lists that do not agree.
    pub fn new(cells: &[[u32; 3]], light: FreeLight, masks: &SunMasks) -> Result<Self, LightError> {
        let count = cells.len();
        if light.back.len() != count * AXES.len() || (masks.steps > 0 && masks.point_count() != light.back.len()) {
            return Err(LightError::Mismatch(format!("{} points and their light for {count} of a lattice", light.back.len())));
        }
        // Under a roof of a single sheet the way up shows its back, and the place is in the open all the same: all six views count.
        let inside = |views: &[f32]| views.iter().sum::<f32>() > BACK_LIMIT * AXES.len() as f32;
        let valid: Vec<u8> = light.back.chunks_exact(AXES.len()).map(|views| u8::from(!inside(views))).collect();
        let source = nearest_valid(cells, &valid);
        let taken = |values: &[f32]| -> Vec<f32> {
            let width = values.len() / count.max(1);
            source.iter().flat_map(|&from| &values[from as usize * width..(from as usize + 1) * width]).copied().collect()
        };
        let width = masks.words_per_point();
        let mut words = Vec::with_capacity(count * width);
        for &from in &source {
            let six = &masks.words[from as usize * AXES.len() * width..(from as usize + 1) * AXES.len() * width];
            words.extend((0..width).map(|word| six.iter().skip(word).step_by(width).fold(0, |all, own| all | own)));
        }
        let masks = SunMasks { steps: masks.steps, words, rays: masks.rays };
        Ok(Self { sky_transfer: taken(&light.sky_transfer), sun_bounce: taken(&light.sun_bounce), valid, source, masks })
    }

    /// Points, L.
    #[must_use]
    pub fn point_count(&self) -> usize {
        self.valid.len()
    }

    /// Whether shapes agree and all numbers are finite.
    ///
    /// # Errors
    /// What is wrong.
    pub fn validate(&self) -> Result<(), LightError> {
        let count = self.point_count();
        let whole = |values: &[f32]| {
            let per_point = values.len().checked_div(count).unwrap_or(0);
            values.len() == per_point * count && per_point.is_multiple_of(AXES.len()) && values.iter().all(|x| x.is_finite())
        };
        let fits = whole(&self.sky_transfer)
            && whole(&self.sun_bounce)
            && self.source.len() == count
            && self.source.iter().all(|&from| (from as usize) < count)
            && self.masks.words.len() == count * self.masks.words_per_point();
        if !fits {
            return Err(LightError::Mismatch("light of a lattice whose shapes do not agree".into()));
        }
        self.masks.validate()
    }
}

/// For each point the valid one to take light from: ring by ring over the 26 neighbours, of those that its neighbours have the nearest,
/// then the first; itself where none can be reached.
fn nearest_valid(cells: &[[u32; 3]], valid: &[u8]) -> Vec<u32> {
    let mut source: Vec<u32> = (0..cells.len() as u32).collect();
    // only looked up, never walked
    let point_at: HashMap<[u32; 3], u32> = cells.iter().copied().zip(0..).collect();
    let mut reached = valid.to_vec();
    let mut waiting: Vec<u32> = (0..cells.len() as u32).filter(|&point| valid[point as usize] == 0).collect();
    let distance = |a: [u32; 3], b: [u32; 3]| -> u64 { (0..3).map(|axis| u64::from(a[axis].abs_diff(b[axis])).pow(2)).sum() };
    while !waiting.is_empty() {
        let mut ring: Vec<(u32, u32)> = Vec::new();
        waiting.retain(|&point| {
            let cell = cells[point as usize];
            let neighbours = (0..27).filter_map(|step: u32| {
                let steps = [step % 3, step / 3 % 3, step / 9];
                let near = [0, 1, 2].map(|axis: usize| (cell[axis] + steps[axis]).checked_sub(1));
                let [Some(x), Some(y), Some(z)] = near else { return None };
                point_at.get(&[x, y, z]).copied()
            });
            let best = neighbours
                .filter(|&near| reached[near as usize] != 0)
                .map(|near| source[near as usize])
                .map(|from| (distance(cell, cells[from as usize]), from))
                .min();
            ring.extend(best.map(|(_, from)| (point, from)));
            best.is_none()
        });
        if ring.is_empty() {
            break;
        }
        for (point, from) in ring {
            reached[point as usize] = 1;
            source[point as usize] = from;
        }
    }
    source
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_is_taken_from_the_nearest_valid_point_over_the_lattice() {
        let cells: Vec<[u32; 3]> = (0..7).map(|x| [x, 0, 0]).chain([[20, 0, 0]]).collect();
        let valid = [1, 0, 0, 0, 0, 0, 1, 0];
        assert_eq!(nearest_valid(&cells, &valid), [0, 0, 0, 0, 6, 6, 6, 7], "the far one keeps its own");
        assert_eq!(nearest_valid(&cells, &[0; 8]), [0, 1, 2, 3, 4, 5, 6, 7]);
        assert!(nearest_valid(&[], &[]).is_empty());
    }

    #[test]
    fn masks_of_six_points_are_one() {
        let back = [[0.0; 6], [1.0, 1.0, 1.0, 0.0, 1.0, 1.0], [0.4, 0.4, 1.0, 0.0, 0.4, 0.4]].concat();
        let light = FreeLight { sky_transfer: (0..18).map(|i| i as f32).collect(), sun_bounce: Vec::new(), back };
        let masks =
            SunMasks { steps: 33, words: (0..36).map(|i| if i % 2 == 0 { 1 << (i / 2) } else { 0 }).collect(), rays: 7 };
        let lattice = LatticeLight::new(&[[0; 3], [1, 0, 0], [2, 0, 0]], light, &masks).unwrap();
        lattice.validate().unwrap();
        assert_eq!((lattice.valid.as_slice(), lattice.source.as_slice()), (&[1, 0, 1][..], &[0, 0, 2][..]));
        assert_eq!(lattice.masks.words, [0b11_1111, 0, 0b11_1111, 0, 0b11_1111 << 12, 0]);
        assert_eq!(lattice.sky_transfer[6..13], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 12.0]);
    }
}
