//! The cubic grid that a mesh's positions are rounded to.

use super::attributes::is_position;
use crate::import::raw::{RawArray, RawPrimitive};
use glam::DVec3;

/// Steps along each side.
pub(super) const STEPS: f64 = 65_535.0;
/// Steps on either side of zero, for what morph targets add.
pub(super) const DELTA_STEPS: f64 = 32_767.0;
/// A box smaller or larger than this is left as it is: a side that is no normal float has no steps, and the squares of larger ones are none.
const SIDES: std::ops::RangeInclusive<f64> = 1.0e-12..=1.0e12;

/// `p_mesh = offset + side * q / 65535`. One side for all axes, so that directions stay as they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grid {
    pub offset: DVec3,
    pub side: f64,
    morphs: bool,
}

impl Grid {
    /// How far a vertex moves at most, in mesh space: half a step along three axes, and another half of a target's.
    pub fn error(&self) -> f64 {
        let half = 0.5 / STEPS + if self.morphs { 0.5 / DELTA_STEPS } else { 0.0 };
        // and what is lost where the reader rounds to floats
        let rounding = (self.offset.abs().max_element() + self.side) * f64::from(f32::EPSILON);
        (self.side * half + rounding) * 3.0_f64.sqrt()
    }

    pub fn step(&self, p: [f64; 3]) -> [u16; 3] {
        let p = (DVec3::from(p) - self.offset) / self.side * STEPS;
        p.to_array().map(|x| x.round().clamp(0.0, STEPS) as u16)
    }

    pub fn delta(&self, d: [f64; 3]) -> [i16; 3] {
        d.map(|x| (x / self.side * DELTA_STEPS).round().clamp(-DELTA_STEPS, DELTA_STEPS) as i16)
    }

    /// What makes two grids one, in a map.
    pub fn key(&self) -> [u64; 4] {
        let [x, y, z] = self.offset.to_array();
        [x, y, z, self.side].map(f64::to_bits)
    }
}

/// The grid around the good positions of a mesh; none where its positions are whole numbers already, or where there are none.
pub(super) fn around(mesh: &[RawPrimitive]) -> Option<Grid> {
    let (mut low, mut high, mut farthest) = (DVec3::INFINITY, DVec3::NEG_INFINITY, 0.0_f64);
    let mut morphs = false;
    for primitive in mesh {
        let positions = primitive.attributes.get("POSITION").filter(|positions| positions.is_float())?;
        for p in (0..positions.count).map(|i| positions.three(i)).filter(is_position) {
            (low, high) = (low.min(p.into()), high.max(p.into()));
        }
        for deltas in primitive.targets.iter().filter_map(|target| target.get("POSITION")) {
            if !deltas.is_float() || deltas.width != 3 {
                return None;
            }
            morphs = true;
            farthest = farthest.max(largest(deltas));
        }
    }
    let side = (high - low).max_element().max(farthest);
    // as floats, so that readers that know only these place it alike
    let offset = low.as_vec3().as_dvec3();
    let side = f64::from((side as f32).next_up());
    (offset.is_finite() && SIDES.contains(&side)).then_some(Grid { offset, side, morphs })
}

/// The largest component that is a number, without its sign.
fn largest(array: &RawArray) -> f64 {
    let all = (0..array.count).flat_map(|i| array.three(i)).map(f64::abs);
    all.filter(|x| x.is_finite()).fold(0.0, f64::max)
}
