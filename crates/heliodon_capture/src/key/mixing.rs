//! Whether light or codes were added up where foreground and screen share a pixel.

use super::matte::{Setup, solve};
use super::plate::Plate;
use super::space::{Rgb, Space, lerp};
use super::{Mixing, Picture};
use rayon::prelude::*;

/// Shares of the foreground that are tried.
const STEPS: u32 = 24;
/// An edge that neither explains to within this, in squared codes, is some other foreground's, and says nothing.
const EXPLAINED: f32 = 3.0 * 100.0;
/// Foreground and screen that are nearer than this to each other, in squared codes, say nothing.
const APART: f32 = 3.0 * 3600.0;

/// How much better adding up light explains a picture's edges than adding up codes, as votes in [-1, 1] of its half-covered pixels; and how many voted.
///
/// Between foreground and screen light takes another way than codes: of red and green, a half of each is (188, 188, 0) or (128, 128, 0).
pub(super) fn votes_for_light(picture: &Picture<'_>, plate: &Plate, setup: &Setup) -> (f64, u64) {
    let matte = solve(picture, plate, setup);
    let Some(foreground) = &matte.foreground else { return (0.0, 0) };
    let (light, codes) = (Space::new(Mixing::Linear), Space::new(Mixing::Encoded));
    let rows: Vec<(f64, u64)> = (0..picture.height)
        .into_par_iter()
        .map(|y| {
            let (mut sum, mut count) = (0.0, 0);
            for x in 0..picture.width {
                let k = y * picture.width + x;
                if !(0.1..0.9).contains(&matte.alpha[k]) {
                    continue;
                }
                let own = setup.space.codes(foreground.at((x as f32 + 0.5) * 0.5, (y as f32 + 0.5) * 0.5));
                let screen = setup.space.codes(plate.at(x, y));
                if squared(own.map(f32::from), screen.map(f32::from)) < APART {
                    continue;
                }
                let [by_light, by_codes] = [light, codes].map(|space| error(&space, picture.pixels[k], own, screen));
                if by_light.min(by_codes) < EXPLAINED {
                    sum += f64::from((by_codes - by_light) / (by_codes + by_light + 30.0));
                    count += 1;
                }
            }
            (sum, count)
        })
        .collect();
    // in the order of rows: the same sum for any number of threads
    rows.into_iter().fold((0.0, 0), |all, row| (all.0 + row.0, all.1 + row.1))
}

/// The least squared error, in codes, of a pixel that is some share of both.
fn error(space: &Space, pixel: [u8; 4], own: [u8; 3], screen: [u8; 3]) -> f32 {
    let of = |[r, g, b]: [u8; 3]| space.of([r, g, b, 255]);
    let (own, screen, pixel) = (of(own), of(screen), [pixel[0], pixel[1], pixel[2]].map(f32::from));
    let tried = (0..=STEPS).map(|step| {
        let mixed: Rgb = lerp(screen, own, step as f32 / STEPS as f32);
        squared(space.codes(mixed).map(f32::from), pixel)
    });
    tried.fold(f32::INFINITY, f32::min)
}

fn squared(a: Rgb, b: Rgb) -> f32 {
    (0..3).map(|c| (a[c] - b[c]) * (a[c] - b[c])).sum()
}
