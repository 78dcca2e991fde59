//! Plaster, as a trowel leaves it.

use super::field::{Field, ring_difference, smoothstep};
use heliodon_math::random::{Pcg32, hash2_u32, unit_f32};
use std::f64::consts::{PI, TAU};

/// How often each texel is gone over.
const COVERAGE: f64 = 9.0;
/// What fine sand adds to the strokes, in their standard deviations.
const SAND: f64 = 0.6;

/// One stroke: an arc, wide in its middle, with streaks along it and a ridge where the trowel's edge pushed the plaster up.
struct Stroke {
    /// Its middle, in texels.
    middle: [f64; 2],
    /// The angle at which it runs there.
    heading: f64,
    /// 1 / radius of the arc, signed.
    curvature: f64,
    /// Half of its length and of its width, in texels.
    half_length: f64,
    half_width: f64,
    /// How light it is as a whole.
    tone: f64,
    salt: u32,
}

impl Stroke {
    fn random(rng: &mut Pcg32, size: f64) -> Self {
        let mut unit = || f64::from(rng.next_f32());
        // on small tiles strokes must be small, or each tile shows the same few
        let scale = (size / 256.0).clamp(0.4, 1.0);
        let half_length = scale * (20.0 + 26.0 * unit());
        Self {
            middle: [size * unit(), size * unit()],
            heading: TAU * unit(),
            curvature: (2.0 * unit() - 1.0) * 0.6 / half_length,
            half_length,
            half_width: scale * (7.0 + 9.0 * unit()),
            tone: 2.0 * unit() - 1.0,
            salt: (unit() * 16_777_216.0) as u32,
        }
    }

    /// How far along and across the stroke a place is, from -1 to 1 inside; `d` is the way from its middle.
    fn place(&self, d: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = libm::sincos(self.heading);
        let (along, across) = (d[0] * cos + d[1] * sin, d[1] * cos - d[0] * sin);
        // a parabola in place of the arc: the same to second order
        let bow = across - 0.5 * self.curvature * along * along;
        [along / self.half_length, bow / self.half_width]
    }

    /// Its height there and how much it covers what was there before.
    fn paint(&self, [along, across]: [f64; 2]) -> (f64, f64) {
        let ends = 1.0 - smoothstep(0.3, 1.0, along.abs());
        // one edge of the trowel presses, the other lifts: hard on one side, soft on the other
        let sides = (1.0 - smoothstep(0.85, 1.0, across)) * smoothstep(-1.0, 0.2, across);
        let ridge = smoothstep(0.6, 0.85, across) * (1.0 - smoothstep(0.85, 1.0, across));
        let streaks = 0.7 * self.streak(4.0 * across, 0) + self.streak(11.0 * across, 64);
        let height = 0.35 * self.tone + 0.5 * streaks + 0.7 * ridge + 0.3 * across;
        (height, 0.8 * ends * sides)
    }

    /// Smooth noise in one dimension, about in [-1, 1].
    fn streak(&self, at: f64, octave: u32) -> f64 {
        let cell = at.floor();
        let value = |k: f64| 2.0 * f64::from(unit_f32(hash2_u32(self.salt, octave + (k + 32.0) as u32))) - 1.0;
        let t = smoothstep(0.0, 1.0, at - cell);
        value(cell) * (1.0 - t) + value(cell + 1.0) * t
    }
}

/// Overlapping strokes, softened, with sand.
pub(super) fn plaster(size: usize, seed: u64) -> Field {
    let side = size as f64;
    let mut rng = Pcg32::new(seed, 50);
    let mut plaster = Field::from_fn(size, |_, _| 0.0);
    let mut covered = 0.0;
    while covered < COVERAGE * side * side {
        let stroke = Stroke::random(&mut rng, side);
        covered += PI * stroke.half_length * stroke.half_width;
        let reach = libm::ceil(
            stroke.half_length + stroke.half_width + 0.5 * stroke.curvature.abs() * stroke.half_length * stroke.half_length,
        ) as i64;
        // a stroke longer than the tile would meet itself: then each texel takes it where it is nearest
        let reach = reach.min(size as i64 / 2);
        let (column, row) = (stroke.middle[0].floor() as i64, stroke.middle[1].floor() as i64);
        for (x, y) in (row - reach..row + reach).flat_map(|y| (column - reach..column + reach).map(move |x| (x, y))) {
            let d = [ring_difference(x as f64, stroke.middle[0], side), ring_difference(y as f64, stroke.middle[1], side)];
            let place = stroke.place(d);
            if place[0].abs() < 1.0 && place[1].abs() < 1.0 {
                let (height, cover) = stroke.paint(place);
                let at = y.rem_euclid(size as i64) as usize * size + x.rem_euclid(size as i64) as usize;
                plaster.values[at] += (height - plaster.values[at]) * cover;
            }
        }
    }
    let mut plaster = plaster.blurred(0.8, 0.8).evened(side / 12.0);
    plaster.add(SAND, &Field::smooth(size, seed, 52, [0.7, 0.7]));
    plaster.add(0.2, &Field::white(size, seed, 53));
    plaster
}
