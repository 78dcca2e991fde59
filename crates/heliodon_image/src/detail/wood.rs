//! Wood, cut along the fibre.

use super::field::{Field, ring_difference, smoothstep};
use heliodon_math::random::{Pcg32, hash2_u32, unit_f32};
use std::f64::consts::TAU;

/// Texels from ring to ring, in the mean; less on tiles that would show but a few.
const RING: f64 = 12.0;
/// How much fibres and pores count beside the rings, in standard deviations.
const FIBRES: f64 = 0.85;
const PORES: f64 = 2.6;

/// A knot: a branch that was cut across.
struct Knot {
    middle: [f64; 2],
    /// Across the fibre, in texels.
    radius: f64,
}

/// Growth rings, fibres and pores along v, and knots around which the rings bend.
pub(super) fn wood(size: usize, seed: u64, knots: u32) -> Field {
    let side = size as f64;
    let knots = scatter(seed, knots, side);
    let ring_width = RING.min(side / 8.0);
    let count = (side / ring_width).round();
    let salt = hash2_u32(seed as u32, (seed >> 32) as u32);
    // without it a ring would begin on the edge of every tile
    let phase = f64::from(unit_f32(hash2_u32(salt, u32::MAX)));
    // along the fibre everything changes as slowly as the tile bears
    let long = (side / 7.0).max(14.0);
    // Rings sway together, are of different width, and waver a little. All of it stays well below what would let a ring close on
    // itself: such an eye is known again in every tile. The plain rings' slope, 1 / ring_width, is more than four times the others' together.
    let sway = Field::smooth(size, seed, 60, [side / 4.0, long]);
    let sway_rings = (0.35 * side / 256.0).min(0.45);
    let widths = Field::smooth(size, seed, 61, [0.8 * ring_width, side]);
    let waver = Field::smooth(size, seed, 62, [ring_width, long / 2.0]);
    // latewood is not equally dark all along its ring
    let depth = Field::smooth(size, seed, 63, [ring_width / 4.0, long]);
    let rings = Field::from_fn(size, |x, y| {
        let at = y * size + x;
        let bent = bend(&knots, [x as f64, y as f64], side);
        let widths = widths.sample(bent, y as f64);
        let ring = phase + bent * count / side + sway_rings * sway.values[at] + 0.16 * widths + 0.05 * waver.values[at];
        let index = ring.floor();
        let part = ring - index;
        let hash = hash2_u32(salt, index.rem_euclid(count) as u32);
        // earlywood darkens slowly into latewood, which ends at once where the next spring begins
        let late = smoothstep(0.15, 0.88, part) * (1.0 - smoothstep(0.9, 1.0, part));
        (0.45 + 0.9 * f64::from(unit_f32(hash))) * (1.0 + 0.18 * depth.values[at]) * late
    });
    let mut wood = rings.normalised();
    wood.values.iter_mut().for_each(|v| *v = -*v);
    let mut fibres = Field::smooth(size, seed, 64, [0.5, long / 2.5]);
    fibres.add(0.7, &Field::smooth(size, seed, 65, [1.2, long / 1.2]));
    fibres.add(0.6, &Field::smooth(size, seed, 66, [0.3, 4.0]));
    wood.add(FIBRES, &fibres.normalised());
    let mut wood = wood.evened(side / 6.0);
    wood.add(-PORES, &pores(size, seed));
    for knot in &knots {
        darken(&mut wood, knot, salt);
    }
    wood
}

/// Short dark dashes along the fibre.
fn pores(size: usize, seed: u64) -> Field {
    let mut rng = Pcg32::new(seed, 70);
    let mut pores = Field::from_fn(size, |_, _| 0.0);
    for _ in 0..size * size / 140 {
        let (u, v, w, depth) = (rng.next_f32(), rng.next_f32(), rng.next_f32(), rng.next_f32());
        let (x, y) = ((u * size as f32) as usize % size, f64::from(v) * size as f64);
        let half_length = 2.0 + 7.0 * f64::from(w) * f64::from(w);
        let reach = libm::ceil(half_length) as i64;
        for row in y.floor() as i64 - reach..=y.floor() as i64 + reach {
            let along = ring_difference(row as f64, y, size as f64) / half_length;
            let depth = (0.3 + 0.7 * f64::from(depth)) * (1.0 - smoothstep(0.5, 1.0, along.abs()));
            let at = row.rem_euclid(size as i64) as usize * size + x;
            pores.values[at] = pores.values[at].max(depth);
        }
    }
    pores.blurred(0.35, 0.0)
}

/// Places for knots, apart from one another along the fibre.
fn scatter(seed: u64, count: u32, side: f64) -> Vec<Knot> {
    let mut rng = Pcg32::new(seed, 80);
    (0..count)
        .map(|k| {
            let mut unit = || f64::from(rng.next_f32());
            // the golden section spreads any number of them along the fibre
            let v = (f64::from(k) * 0.618_033_988_75 + 0.15 * unit()).fract();
            Knot { middle: [side * unit(), side * v], radius: (side / 28.0).clamp(3.0, 9.0) * (0.7 + 0.6 * unit()) }
        })
        .collect()
}

/// Where a place lay across the fibre before knots pushed it aside.
fn bend(knots: &[Knot], [x, y]: [f64; 2], side: f64) -> f64 {
    knots.iter().fold(x, |bent, knot| {
        let dx = ring_difference(x, knot.middle[0], side);
        let dy = ring_difference(y, knot.middle[1], side) / 2.5;
        let distance = libm::sqrt(dx * dx + dy * dy);
        // the rings that crossed the knot pass beside it, closer together
        let pushed = knot.radius * libm::exp(-(distance - knot.radius).max(0.0) / (1.8 * knot.radius));
        bent - pushed * dx / distance.max(knot.radius)
    })
}

/// Draws a knot's own rings and its dark rim.
fn darken(wood: &mut Field, knot: &Knot, salt: u32) {
    let side = wood.size as f64;
    let size = wood.size;
    for (at, value) in wood.values.iter_mut().enumerate() {
        let dx = ring_difference((at % size) as f64, knot.middle[0], side);
        let dy = ring_difference((at / size) as f64, knot.middle[1], side) / 1.5;
        let distance = libm::sqrt(dx * dx + dy * dy) / knot.radius;
        if distance < 1.4 {
            let angle = libm::atan2(dy, dx) + TAU * f64::from(unit_f32(salt));
            let uneven = distance * (1.0 + 0.08 * libm::sin(3.0 * angle) + 0.05 * libm::sin(7.0 * angle));
            let inside = 1.0 - smoothstep(0.9, 1.15, uneven);
            let own = -1.3 - 0.6 * libm::cos(TAU * 2.5 * uneven) - 1.5 * smoothstep(0.7, 0.95, uneven);
            *value += (own - *value) * inside;
        }
    }
}
