//! Dressed stone.

use super::field::{Field, ring_difference, smoothstep};
use heliodon_math::random::{Pcg32, hash_u32, hash2_u32, unit_f32};

/// Wavelengths of the grain in texels and how much each adds. They fall more slowly than in a cloud: stone seen from near is as rough at
/// the finest scale as at any.
const GRAIN: [(f64, f64); 4] = [(4.0, 0.5), (7.0, 0.45), (12.0, 0.45), (24.0, 0.45)];
/// Texels across a crystal, and how much crystals differ.
const CRYSTAL: f64 = 5.0;
const CRYSTAL_TONE: f64 = 0.7;
/// One pit at most in a square of so many texels, and how likely there is one.
const PIT_SPACING: f64 = 9.0;
const PIT_CHANCE: f32 = 0.45;
/// How dark the middle of a pit is, in standard deviations of the grain.
const PIT_DEPTH: f64 = 4.6;
/// How dark a vein is.
const VEIN_DEPTH: f64 = 1.9;

/// Multi-scale grain of crystals, pits, and thin veins that break off.
pub(super) fn stone(size: usize, seed: u64) -> Field {
    let mut grain = crystals(size, seed);
    for (octave, (wavelength, weight)) in (0..).zip(GRAIN) {
        // what is longer than an eighth of the tile is seen to repeat
        if wavelength <= size as f64 / 8.0 {
            grain.add(weight, &Field::band(size, seed, 10 + octave, wavelength));
        }
    }
    let mut stone = grain.evened(size as f64 / 10.0);
    stone.add(-VEIN_DEPTH, &veins(size, seed));
    let pits = pits(size, seed);
    // a pit is dark whatever the grain around it
    stone.values.iter_mut().zip(&pits.values).for_each(|(v, &p)| *v = *v * (1.0 - 0.6 * p) - PIT_DEPTH * p);
    stone
}

/// Crystals: cells of random points (Worley, "A Cellular Texture Basis Function", 1996), each of one tone, slightly bent.
fn crystals(size: usize, seed: u64) -> Field {
    let bend = [Field::band(size, seed, 20, 7.0), Field::band(size, seed, 21, 7.0)];
    let count = (size as f64 / CRYSTAL).round().max(1.0);
    let step = size as f64 / count;
    let salt = hash2_u32(seed as u32, (seed >> 32) as u32);
    let cells = Field::from_fn(size, |x, y| {
        let at = y * size + x;
        let p = [(x as f64 + bend[0].values[at]) / step, (y as f64 + bend[1].values[at]) / step];
        let (i, j) = (p[0].floor(), p[1].floor());
        let (mut nearest, mut tone) = (f64::MAX, 0.0);
        for (di, dj) in (-1..=1).flat_map(|dj| (-1..=1).map(move |di| (f64::from(di), f64::from(dj)))) {
            let (column, row) = ((i + di).rem_euclid(count) as u32, (j + dj).rem_euclid(count) as u32);
            let hash = hash2_u32(salt, row * 4096 + column);
            let point = [i + di + f64::from(unit_f32(hash)), j + dj + f64::from(unit_f32(hash_u32(hash)))];
            let distance = (p[0] - point[0]) * (p[0] - point[0]) + (p[1] - point[1]) * (p[1] - point[1]);
            if distance < nearest {
                nearest = distance;
                tone = f64::from(unit_f32(hash_u32(hash ^ 0x5bd1_e995))) - 0.5;
            }
        }
        tone
    });
    let mut crystals = cells.blurred(0.45, 0.45).normalised();
    crystals.values.iter_mut().for_each(|v| *v *= CRYSTAL_TONE);
    crystals
}

/// 1 in the middle of pits, 0 outside: few large ones among many small ones, none quite round.
fn pits(size: usize, seed: u64) -> Field {
    let mut rng = Pcg32::new(seed, 30);
    let ragged = Field::smooth(size, seed, 31, [1.0, 1.0]);
    let mut pits = Field::from_fn(size, |_, _| 0.0);
    let count = (size as f64 / PIT_SPACING).round() as usize;
    let step = size as f64 / count.max(1) as f64;
    for cell in 0..count * count {
        let (there, u, v, w, depth) = (rng.next_f32(), rng.next_f32(), rng.next_f32(), rng.next_f32(), rng.next_f32());
        if there > PIT_CHANCE {
            continue;
        }
        let center = [((cell % count) as f64 + f64::from(u)) * step, ((cell / count) as f64 + f64::from(v)) * step];
        let w = f64::from(w);
        let radius = 0.8 + 2.4 * w * w * w * w;
        let depth = 0.45 + 0.55 * f64::from(depth);
        let reach = libm::ceil(1.6 * radius + 1.0) as i64;
        let (column, row) = (center[0].floor() as i64, center[1].floor() as i64);
        for (x, y) in (row - reach..=row + reach).flat_map(|y| (column - reach..=column + reach).map(move |x| (x, y))) {
            let dx = ring_difference(x as f64, center[0], size as f64);
            let dy = ring_difference(y as f64, center[1], size as f64);
            let ragged_radius = radius * (1.0 + 0.22 * ragged.at(x, y)).clamp(0.4, 1.6);
            let inside = depth * (1.0 - smoothstep(0.35, 1.25, libm::sqrt(dx * dx + dy * dy) / ragged_radius));
            let at = y.rem_euclid(size as i64) as usize * size + x.rem_euclid(size as i64) as usize;
            pits.values[at] = pits.values[at].max(inside);
        }
    }
    pits
}

/// 1 on veins, 0 beside them: where a smooth field crosses zero, as far as another one lets them go.
fn veins(size: usize, seed: u64) -> Field {
    // as long as the tile bears without being known by its veins
    let wavelength = (size as f64 / 5.0).min(44.0);
    let course = Field::band(size, seed, 40, wavelength);
    let bend = [Field::band(size, seed, 41, 10.0), Field::band(size, seed, 42, 10.0)];
    let strength = Field::smooth(size, seed, 43, [wavelength / 4.0, wavelength / 4.0]);
    Field::from_fn(size, |x, y| {
        let at = y * size + x;
        let (px, py) = (x as f64 + 1.6 * bend[0].values[at], y as f64 + 1.6 * bend[1].values[at]);
        let slope_x = course.sample(px + 1.0, py) - course.sample(px - 1.0, py);
        let slope_y = course.sample(px, py + 1.0) - course.sample(px, py - 1.0);
        // to first order the distance to the crossing in texels; flat places would make wide blotches
        let slope = 0.5 * libm::sqrt(slope_x * slope_x + slope_y * slope_y);
        let distance = course.sample(px, py).abs() / slope.max(0.02);
        let lasting = smoothstep(0.0, 1.0, strength.values[at]);
        // on small tiles they lie so close that they would make lumps
        (wavelength / 44.0) * lasting * (1.0 - smoothstep(0.2, 1.3, distance))
    })
}
