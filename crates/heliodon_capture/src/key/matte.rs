//! How much of each pixel is screen.

use super::Picture;
use super::edges::{lowest_around, softened};
use super::plate::Plate;
use super::pyramid::{Grid, fill};
use super::space::{Rgb, Space, Wedge, dot, smoothstep};
use rayon::prelude::*;

/// What a matte is computed with.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setup {
    pub space: Space,
    pub wedge: Wedge,
    pub metric: Metric,
    /// Alpha below which all is screen, and above which all is foreground.
    pub black: f32,
    pub white: f32,
    /// Pixels from an edge at which a colour is the foreground's own: further where colour has fewer samples.
    pub margin: usize,
}

/// How differences of colour count: brightness in full, the rest by a weight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Metric {
    chroma: f32,
}

/// The unit vector of brightness, by BT.709's weights.
const BRIGHTNESS: Rgb = [0.283_86, 0.954_95, 0.096_4];

impl Metric {
    pub fn new(subsampled: bool) -> Self {
        Self { chroma: if subsampled { 0.5 } else { 1.0 } }
    }

    #[inline]
    fn dot(&self, a: Rgb, b: Rgb) -> f32 {
        self.chroma * dot(a, b) + (1.0 - self.chroma) * dot(a, BRIGHTNESS) * dot(b, BRIGHTNESS)
    }
}

/// A frame's matte, before anything is done to it.
#[derive(Clone, Debug)]
pub(super) struct Matte {
    pub alpha: Vec<f32>,
    /// By the colour difference alone.
    pub rough: Vec<f32>,
    /// The foreground's colour at half the size, spread over the edges; `None` where there is no sure foreground at all.
    pub foreground: Option<Grid>,
}

/// Where the colour difference says so much, a pixel begins to be the foreground's own, and surely is.
const SURE: (f32, f32) = (0.7, 0.85);
/// How strongly the foreground's share and the screen's are pulled to a sum of 1.
const PULL: f32 = 0.03;
/// The share of the screen's energy that may stay unexplained before the colour difference is believed more, and alone.
const UNEXPLAINED: (f32, f32) = (0.004, 0.03);

/// How much brighter a foreground may be than what was spread from near it.
const BRIGHTER: f32 = 1.5;

/// Alpha by the colour difference alone: `1 - d / d(screen)`, up to 1.
pub(super) fn rough(picture: &Picture<'_>, plate: &Plate, space: &Space, wedge: &Wedge) -> Vec<f32> {
    let mut rough = vec![0.0; picture.pixels.len()];
    let rows = picture.pixels.par_chunks(picture.width);
    rough.par_chunks_mut(picture.width).zip(rows).enumerate().for_each(|(y, (out, pixels))| {
        for (x, (out, &pixel)) in out.iter_mut().zip(pixels).enumerate() {
            let full = wedge.difference(plate.at(x, y)).max(1e-3);
            *out = (1.0 - wedge.difference(space.of(pixel)) / full).min(1.0);
        }
    });
    rough
}

/// The matte of a frame.
pub(super) fn solve(picture: &Picture<'_>, plate: &Plate, setup: &Setup) -> Matte {
    let width = picture.width;
    let rough = self::rough(picture, plate, &setup.space, &setup.wedge);
    // without its noise: the lowest of many noisy values is far too low
    let inner = lowest_around(&softened(rough.clone(), width, std::f32::consts::SQRT_2), width, setup.margin);
    let foreground = spread(picture, &inner, &setup.space);
    let mut alpha = vec![0.0; rough.len()];
    let known = rough.par_chunks(width).zip(inner.par_chunks(width));
    let rows = alpha.par_chunks_mut(width).zip(picture.pixels.par_chunks(width)).zip(known);
    rows.enumerate().for_each(|(y, ((alpha, pixels), (rough, inner)))| {
        for (x, (alpha, &pixel)) in alpha.iter_mut().zip(pixels).enumerate() {
            *alpha = if inner[x] >= SURE.1 {
                1.0
            } else if rough[x] <= setup.black {
                0.0
            } else {
                let color = setup.space.of(pixel);
                let refined = foreground.as_ref().map_or(rough[x], |grid| {
                    let own = grid.at((x as f32 + 0.5) * 0.5, (y as f32 + 0.5) * 0.5);
                    refined(color, own, plate.at(x, y), rough[x].max(0.0), setup)
                });
                pointed(refined, setup.black, setup.white)
            };
        }
    });
    Matte { alpha, rough, foreground }
}

/// Alpha of a pixel near to a foreground of colour `own`.
#[inline]
fn refined(color: Rgb, own: Rgb, screen: Rgb, rough: f32, setup: &Setup) -> f32 {
    let (share, unexplained) = unmixed(color, own, screen, setup.metric);
    let doubt = smoothstep(UNEXPLAINED.0, UNEXPLAINED.1, unexplained);
    let solved = (1.0 - share) * (1.0 - doubt) + rough * doubt;
    // `rough` is alpha times what it is of the foreground alone: 1 at most where that lies within the wedge, as skin before a yellow wall, and
    // above 1 where it does not. Highlights that neither colour explains would otherwise let the scene through.
    let beyond = (-setup.wedge.difference(own)).max(0.0) * BRIGHTER / setup.wedge.difference(screen).max(1e-3);
    solved.max(rough / (1.0 + beyond))
}

/// The foreground's own colours at half the size, spread from where they are sure.
fn spread(picture: &Picture<'_>, inner: &[f32], space: &Space) -> Option<Grid> {
    let (width, height) = (picture.width, picture.height);
    let (columns, rows) = (width.div_ceil(2), height.div_ceil(2));
    let mut cells = vec![([0.0; 3], 0.0); columns * rows];
    cells.par_chunks_mut(columns).enumerate().for_each(|(row, cells)| {
        for (column, cell) in cells.iter_mut().enumerate() {
            let (mut sum, mut weight) = ([0.0; 3], 0.0);
            for y in 2 * row..(2 * row + 2).min(height) {
                for x in 2 * column..(2 * column + 2).min(width) {
                    let sure = smoothstep(SURE.0, SURE.1, inner[y * width + x]);
                    if sure > 0.0 {
                        let color = space.of(picture.pixels[y * width + x]);
                        (0..3).for_each(|c| sum[c] += color[c] * sure);
                        weight += sure;
                    }
                }
            }
            if weight > 0.0 {
                *cell = (sum.map(|x| x / weight), weight.min(1.0));
            }
        }
    });
    fill(columns, rows, cells)
}

/// The screen's share q in `color = p foreground + q screen`, and what that leaves unexplained, over the screen's own energy.
#[inline]
fn unmixed(color: Rgb, foreground: Rgb, screen: Rgb, metric: Metric) -> (f32, f32) {
    let (ff, fb, bb) =
        (metric.dot(foreground, foreground), metric.dot(foreground, screen), metric.dot(screen, screen).max(1e-6));
    let (cf, cb) = (metric.dot(color, foreground), metric.dot(color, screen));
    let pull = PULL * ff;
    // black has no share that could be found, and needs none
    let (a, b, d) = (ff + pull + 1e-4 * bb, fb + pull, bb + pull);
    let (u, v) = (cf + pull, cb + pull);
    let determinant = a * d - b * b;
    let mut p = if determinant > 1e-9 * a * d { (u * d - v * b) / determinant } else { 0.0 };
    let mut q = (v - p * b) / d;
    if p < 0.0 {
        (p, q) = (0.0, cb / bb);
    }
    if q < 0.0 {
        (p, q) = (cf / ff.max(1e-6), 0.0);
    }
    let rest: Rgb = std::array::from_fn(|c| color[c] - p * foreground[c] - q * screen[c]);
    (q.min(1.0), metric.dot(rest, rest) / bb)
}

/// Black and white points: exactly 0 below one and exactly 1 above the other, unchanged from 2.5 times as far from the ends on.
#[inline]
fn pointed(alpha: f32, black: f32, white: f32) -> f32 {
    const REACH: f32 = 2.5;
    let low = |x: f32, point: f32| {
        if x <= point {
            0.0
        } else if x >= REACH * point {
            x
        } else {
            // from 0 to where the rest goes on
            (x - point) / ((REACH - 1.0) * point) * REACH * point
        }
    };
    let held = alpha.clamp(0.0, 1.0);
    if held < 0.5 { low(held, black.min(0.2)) } else { 1.0 - low(1.0 - held, white.min(0.2)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_found_whatever_the_foregrounds_brightness() {
        let screen = [0.02, 0.45, 0.05];
        for subsampled in [false, true] {
            let metric = Metric::new(subsampled);
            for foreground in [[0.58, 0.26, 0.16], [0.5, 0.5, 0.5], [0.6, 0.6, 0.02], [0.02, 0.02, 0.03], [0.9, 0.02, 0.3]] {
                for alpha in [0.0, 0.1, 0.5, 0.9, 1.0_f32] {
                    for brightness in [0.7, 1.0, 1.3] {
                        let color = std::array::from_fn(|c| alpha * brightness * foreground[c] + (1.0 - alpha) * screen[c]);
                        let (share, unexplained) = unmixed(color, foreground, screen, metric);
                        assert!((1.0 - share - alpha).abs() < 0.06, "{foreground:?} {alpha} {brightness}: {share}");
                        assert!(unexplained < 2e-3, "{unexplained}");
                    }
                }
            }
        }
    }

    #[test]
    fn points_change_nothing_between_them() {
        assert_eq!((pointed(0.03, 0.04, 0.08), pointed(0.93, 0.04, 0.08), pointed(1.4, 0.04, 0.08)), (0.0, 1.0, 1.0));
        for k in 11..80 {
            let alpha = k as f32 / 100.0;
            assert_eq!(pointed(alpha, 0.04, 0.08), alpha);
        }
        let steps: Vec<f32> = (0..=1000).map(|k| pointed(k as f32 / 1000.0, 0.1, 0.2)).collect();
        assert!(steps.windows(2).all(|w| w[0] <= w[1] && w[1] - w[0] < 0.003));
    }
}
