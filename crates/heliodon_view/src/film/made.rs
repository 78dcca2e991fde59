//! Surfaces that flow and flicker: pictures that are made rather than filmed, a closed function of their time.

use heliodon_bundle::site::FilmKind;
use heliodon_film::Frame;
use heliodon_math::color::srgb8_from_linear;

/// Pictures a second.
pub const RATE_PER_S: f64 = 12.0;
/// Texels along a side: a tile shows some six shapes across.
pub const SIDE: u32 = 96;
/// Cells of the coarsest noise along a tile's side; finer ones are twice as many each.
const CELLS: u32 = 5;
/// Cells of time, after which all of it comes again: some minutes.
const CELLS_OF_TIME: u32 = 256;
const OCTAVES: u32 = 3;

/// The picture of a number; it tiles to all sides.
#[must_use]
pub fn picture(kind: FilmKind, number: u64) -> Frame {
    let seconds = (number as f64 / RATE_PER_S) as f32;
    let texel = |x: u32, y: u32| {
        let at = [x, y].map(|v| (v as f32 + 0.5) / SIDE as f32);
        match kind {
            FilmKind::Embers => ember(at, seconds),
            FilmKind::Water => ripple(at, seconds),
        }
    };
    let pixels = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| texel(x, y))).collect();
    Frame { number, width: SIDE, height: SIDE, pixels }
}

/// Coals that glow where air reaches them: crusts of ash that stay, and a heat that wanders over them.
fn ember(at: [f32; 2], seconds: f32) -> [u8; 4] {
    let crust = noise(at, 0.0, 1);
    let breath = noise(at, 0.55 * seconds, 2);
    let heat = ((0.55 * crust + 0.75 * breath - 0.64) * 3.5).clamp(0.0, 1.0);
    // as a black body between 900 and 1,400 kelvin looks: red first, then orange
    let glow = [heat, 0.42 * heat * heat, 0.10 * heat * heat * heat];
    let ash = 0.012 + 0.02 * crust;
    let [r, g, b] = glow.map(|light| srgb8_from_linear((ash + light).min(1.0)));
    [r, g, b, 255]
}

/// Water that runs over something: what is beneath shows through, darker, and crests catch the light.
fn ripple([x, y]: [f32; 2], seconds: f32) -> [u8; 4] {
    // two sheets that slide over one another; a whole number of tiles a period keeps them seamless
    let first = noise([x, (y - 0.12 * seconds).rem_euclid(1.0)], 0.25 * seconds, 3);
    let second = noise([(x + 0.05 * seconds).rem_euclid(1.0), (y - 0.08 * seconds).rem_euclid(1.0)], 0.2 * seconds + 90.0, 4);
    // crests are where both are nearly half way: thin and winding
    let crest = (1.0 - 9.0 * (first - 0.5).abs()).clamp(0.0, 1.0) * (1.0 - 5.0 * (second - 0.5).abs()).clamp(0.0, 1.0);
    let (wet, bright) = ([0.05, 0.09, 0.10], [0.9, 0.95, 1.0]);
    let cover = 0.35 + 0.5 * crest;
    let [r, g, b] = [0, 1, 2].map(|i| srgb8_from_linear(wet[i] + (bright[i] - wet[i]) * crest));
    [r, g, b, (cover * 255.0) as u8]
}

/// A number from 0 to 1 for a lattice point.
fn hash(x: u32, y: u32, t: u32, seed: u32) -> f32 {
    let mut h = x.wrapping_mul(0x9E37_79B1)
        ^ y.wrapping_mul(0x85EB_CA77)
        ^ t.wrapping_mul(0xC2B2_AE3D)
        ^ seed.wrapping_mul(0x27D4_EB2F);
    h = (h ^ h >> 15).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ h >> 12).wrapping_mul(0x297A_2D39);
    (h ^ h >> 15) as f32 / u32::MAX as f32
}

/// Value noise of three octaves from 0 to 1, smooth in place and time, that tiles.
fn noise(at: [f32; 2], time: f32, seed: u32) -> f32 {
    let (mut sum, mut whole, mut weight, mut cells) = (0.0, 0.0, 1.0, CELLS);
    for octave in 0..OCTAVES {
        let [x, y] = at.map(|v| v * cells as f32);
        let t = time.rem_euclid(CELLS_OF_TIME as f32);
        let (corner, part) = ([x, y, t].map(f32::floor), [x, y, t].map(|v| smooth(v - v.floor())));
        let value = |dx: u32, dy: u32, dt: u32| {
            let [cx, cy, ct] = corner.map(|v| v as u32);
            hash((cx + dx) % cells, (cy + dy) % cells, (ct + dt) % CELLS_OF_TIME, seed + 16 * octave)
        };
        let mix = |a: f32, b: f32, x: f32| a + (b - a) * x;
        let layer = |dt: u32| {
            let row = |dy: u32| mix(value(0, dy, dt), value(1, dy, dt), part[0]);
            mix(row(0), row(1), part[1])
        };
        sum += weight * mix(layer(0), layer(1), part[2]);
        whole += weight;
        (weight, cells) = (0.5 * weight, 2 * cells);
    }
    sum / whole
}

fn smooth(x: f32) -> f32 {
    x * x * (3.0 - 2.0 * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn far(a: &[u8; 4], b: &[u8; 4]) -> u32 {
        a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(*b))).sum()
    }

    #[test]
    fn pictures_flow_and_tile() {
        for kind in [FilmKind::Embers, FilmKind::Water] {
            let (now, next, later) = (picture(kind, 40), picture(kind, 41), picture(kind, 70));
            assert_eq!(now, picture(kind, 40));
            let change = |other: &Frame| {
                let sum: u32 = now.pixels.iter().zip(&other.pixels).map(|(a, b)| far(a, b)).sum();
                f64::from(sum) / now.pixels.len() as f64
            };
            assert!(change(&next) > 0.5 && change(&next) < 60.0, "{kind:?}: {}", change(&next));
            assert!(change(&later) > 1.3 * change(&next), "{kind:?}: {} {}", change(&later), change(&next));
            // across the edge no pixel differs more than across the middle
            let side = SIDE as usize;
            let across = |left: usize, right: usize| {
                (0..side).map(|y| far(&now.pixels[y * side + left], &now.pixels[y * side + right])).max().unwrap_or(0)
            };
            let within = (0..side - 1).map(|x| across(x, x + 1)).max().unwrap_or(0);
            assert!(across(side - 1, 0) <= within, "{kind:?}: {} {within}", across(side - 1, 0));
        }
    }

    #[test]
    fn embers_glow_and_have_ash() {
        let frame = picture(FilmKind::Embers, 3);
        let bright = frame.pixels.iter().filter(|p| p[0] > 180).count();
        let dark = frame.pixels.iter().filter(|p| p[0] < 70).count();
        assert!(bright * 12 > frame.pixels.len() && dark * 12 > frame.pixels.len(), "{bright} {dark}");
        assert!(frame.pixels.iter().all(|[r, g, b, a]| r >= g && g >= b && *a == 255));
    }
}
