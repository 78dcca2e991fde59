//! Planes of alpha: drawn in, blurred, held still.

use rayon::prelude::*;

/// The smallest of the `2 radius + 1` values around each, along both axes; beyond the border the last value goes on.
pub(super) fn lowest_around(plane: &[f32], width: usize, radius: usize) -> Vec<f32> {
    let across = by_rows(plane, width, |row, out| {
        for (x, out) in out.iter_mut().enumerate() {
            let near = &row[x.saturating_sub(radius)..(x + radius + 1).min(row.len())];
            *out = near.iter().copied().fold(f32::INFINITY, f32::min);
        }
    });
    let height = plane.len() / width;
    let mut down = vec![0.0; plane.len()];
    down.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        out.copy_from_slice(&across[y * width..][..width]);
        for other in y.saturating_sub(radius)..(y + radius + 1).min(height) {
            out.iter_mut().zip(&across[other * width..][..width]).for_each(|(out, &value)| *out = out.min(value));
        }
    });
    down
}

/// Draws a matte in by pixels, parts of one included.
pub(super) fn shrunk(alpha: Vec<f32>, width: usize, pixels: f32) -> Vec<f32> {
    let whole = pixels as usize;
    let part = pixels - whole as f32;
    let inner = if whole > 0 { lowest_around(&alpha, width, whole) } else { alpha };
    if part == 0.0 {
        return inner;
    }
    let next = lowest_around(&inner, width, 1);
    inner.iter().zip(next).map(|(&a, b)| a + (b - a) * part).collect()
}

/// The most passes of the smallest kernel.
const MAX_PASSES: f32 = 400.0;

/// Blurs a matte: binomial, about Gaussian, with half of `pixels` as its standard deviation.
pub(super) fn softened(mut alpha: Vec<f32>, width: usize, pixels: f32) -> Vec<f32> {
    // a kernel of 1 2 1 has a variance of 1/2; with a spacing of s pixels, s^2 / 2
    let variance = pixels * pixels * 0.25;
    let spacing = libm::sqrtf(variance / 4.0).ceil().max(1.0) as usize;
    let passes = variance * 2.0 / (spacing * spacing) as f32;
    let mut left = passes.min(MAX_PASSES);
    while left > 1e-3 {
        alpha = blurred(&alpha, width, spacing, left.min(1.0));
        left -= 1.0;
    }
    alpha
}

/// One pass of `weight` parts of 1 2 1, and none for the rest.
fn blurred(alpha: &[f32], width: usize, spacing: usize, weight: f32) -> Vec<f32> {
    let side = 0.25 * weight;
    let across = by_rows(alpha, width, |row, out| {
        for (x, out) in out.iter_mut().enumerate() {
            let (left, right) = (row[x.saturating_sub(spacing)], row[(x + spacing).min(row.len() - 1)]);
            *out = row[x] * (1.0 - 2.0 * side) + (left + right) * side;
        }
    });
    let height = alpha.len() / width;
    let mut down = vec![0.0; alpha.len()];
    down.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let row = |y: usize| &across[y * width..][..width];
        let (above, own, below) = (row(y.saturating_sub(spacing)), row(y), row((y + spacing).min(height - 1)));
        for (x, out) in out.iter_mut().enumerate() {
            *out = own[x] * (1.0 - 2.0 * side) + (above[x] + below[x]) * side;
        }
    });
    down
}

fn by_rows(plane: &[f32], width: usize, each: impl Fn(&[f32], &mut [f32]) + Sync) -> Vec<f32> {
    let mut all = vec![0.0; plane.len()];
    all.par_chunks_mut(width).zip(plane.par_chunks(width)).for_each(|(out, row)| each(row, out));
    all
}

/// What a frame leaves for the next.
#[derive(Clone, Debug, Default)]
pub(super) struct Before {
    pixels: Vec<[u8; 4]>,
    alpha: Vec<f32>,
}

/// A pixel whose codes have changed by more is another one.
const STILL_CODES: f32 = 7.0;

impl Before {
    /// Holds alpha where pixels hold still, by `steadiness`, and remembers both.
    pub fn steady(&mut self, pixels: &[[u8; 4]], alpha: &mut Vec<f32>, steadiness: f32) {
        if steadiness <= 0.0 {
            return;
        }
        if self.alpha.len() == alpha.len() {
            let before = self.pixels.par_chunks(4096).zip(self.alpha.par_chunks(4096));
            alpha.par_chunks_mut(4096).zip(pixels.par_chunks(4096)).zip(before).for_each(
                |((alpha, pixels), (old_pixels, old_alpha))| {
                    for (((alpha, pixel), old_pixel), &old) in alpha.iter_mut().zip(pixels).zip(old_pixels).zip(old_alpha) {
                        let change = (0..3).map(|c| pixel[c].abs_diff(old_pixel[c])).max().unwrap_or(0);
                        let still = 1.0 - f32::from(change) / STILL_CODES;
                        if still > 0.0 {
                            *alpha += (old - *alpha) * steadiness * still;
                        }
                    }
                },
            );
        }
        self.pixels.clear();
        self.pixels.extend_from_slice(pixels);
        self.alpha.clone_from(alpha);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Vec<f32> {
        (0..32 * 32).map(|k| if (8..24).contains(&(k % 32)) && (8..24).contains(&(k / 32)) { 1.0 } else { 0.0 }).collect()
    }

    #[test]
    fn mattes_are_drawn_in_and_blurred_by_what_is_asked() {
        let sum = |plane: &[f32]| plane.iter().sum::<f32>();
        assert_eq!(sum(&shrunk(square(), 32, 2.0)), 12.0 * 12.0);
        let half = sum(&shrunk(square(), 32, 0.5));
        assert!((half - (256.0 + 196.0) * 0.5).abs() < 1e-3);
        assert_eq!(shrunk(square(), 32, 0.0), square());
        for pixels in [0.3, 1.0, 3.0, 9.0] {
            let soft = softened(square(), 32, pixels);
            assert!((sum(&soft) - 256.0).abs() < 8.0, "{pixels}: {}", sum(&soft));
            assert!(soft.iter().all(|a| (0.0..=1.0 + 1e-6).contains(a)));
        }
        assert_eq!(softened(square(), 32, 0.0), square());
        assert_eq!(lowest_around(&[0.3], 1, 5), [0.3]);
    }

    #[test]
    fn noise_is_held_and_movement_is_not() {
        let mut before = Before::default();
        before.steady(&[[10; 4], [10; 4]], &mut vec![0.5, 0.5], 0.5);
        let mut alpha = vec![0.7, 0.7];
        before.steady(&[[10; 4], [60; 4]], &mut alpha, 0.5);
        assert_eq!(alpha, [0.6, 0.7]);
    }
}
