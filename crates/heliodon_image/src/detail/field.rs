//! Square fields of numbers on a torus: what the generated textures are made of.
//!
//! Noise is white noise that is blurred, not lattice noise (Perlin): on the torus it is the same in every direction and at every
//! place, so nothing lines up with a grid and nothing shows where a tile begins.

use heliodon_math::random::Pcg32;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// A field of `size` x `size` numbers that goes on beyond its edges with its other side. Row-major, u to the right, v down.
#[derive(Clone, Debug)]
pub(super) struct Field {
    pub size: usize,
    pub values: Vec<f64>,
}

impl Field {
    /// A number for each texel's column and row.
    pub fn from_fn(size: usize, value: impl Fn(usize, usize) -> f64 + Sync) -> Self {
        let mut values = vec![0.0; size * size];
        values.par_chunks_mut(size.max(1)).enumerate().for_each(|(y, row)| {
            row.iter_mut().enumerate().for_each(|(x, out)| *out = value(x, y));
        });
        Self { size, values }
    }

    /// Independent Gaussian numbers of mean 0 and variance 1. `stream` tells fields of one seed apart.
    pub fn white(size: usize, seed: u64, stream: u64) -> Self {
        let mut rng = Pcg32::new(seed, stream);
        let mut values = Vec::with_capacity(size * size + 1);
        // Box and Muller, "A Note on the Generation of Random Normal Deviates", 1958
        while values.len() < size * size {
            let u = (f64::from(rng.next_u32()) + 0.5) / 4_294_967_296.0;
            let angle = TAU * f64::from(rng.next_u32()) / 4_294_967_296.0;
            let radius = libm::sqrt(-2.0 * libm::log(u));
            let (sin, cos) = libm::sincos(angle);
            values.extend([radius * cos, radius * sin]);
        }
        values.truncate(size * size);
        Self { size, values }
    }

    /// Gaussian noise whose wavelengths lie around `wavelength` texels in every direction, an octave either way: the
    /// difference of two Gaussians. Mean 0, variance 1.
    pub fn band(size: usize, seed: u64, stream: u64, wavelength: f64) -> Self {
        let white = Self::white(size, seed, stream);
        // exp(-(k s)^2 / 2) - exp(-(2 k s)^2 / 2) is greatest where (k s)^2 = (2/3) ln 4, at a wavelength of 6.5 s
        let sigma = wavelength / 6.5;
        white.blurred(sigma, sigma).minus(&white.blurred(2.0 * sigma, 2.0 * sigma)).normalised()
    }

    /// Gaussian noise without a lower limit: white noise blurred along each axis by so many texels. Mean 0, variance 1.
    pub fn smooth(size: usize, seed: u64, stream: u64, sigma: [f64; 2]) -> Self {
        Self::white(size, seed, stream).blurred(sigma[0], sigma[1]).normalised()
    }

    /// Blurred by Gaussians around the torus; standard deviations along u and v in texels, 0 for none.
    pub fn blurred(&self, sigma_u: f64, sigma_v: f64) -> Self {
        self.blurred_along_rows(sigma_u).transposed().blurred_along_rows(sigma_v).transposed()
    }

    fn blurred_along_rows(&self, sigma: f64) -> Self {
        let kernel = kernel(self.size, sigma);
        let mut values = vec![0.0; self.values.len()];
        let size = self.size.max(1);
        values.par_chunks_mut(size).zip(self.values.par_chunks(size)).for_each(|(out, row)| {
            // twice the row around, so that no index need wrap
            let around: Vec<f64> = row.iter().chain(row).chain(row).copied().collect();
            for (x, out) in out.iter_mut().enumerate() {
                let center = x + size;
                let sides = kernel.iter().enumerate().skip(1).map(|(d, w)| w * (around[center - d] + around[center + d]));
                *out = kernel[0] * around[center] + sides.sum::<f64>();
            }
        });
        Self { size: self.size, values }
    }

    fn transposed(&self) -> Self {
        Self::from_fn(self.size, |x, y| self.values[x * self.size + y])
    }

    /// The difference, texel by texel.
    pub fn minus(mut self, other: &Self) -> Self {
        self.values.iter_mut().zip(&other.values).for_each(|(a, b)| *a -= b);
        self
    }

    /// Adds `weight` times another field.
    pub fn add(&mut self, weight: f64, other: &Self) {
        self.values.iter_mut().zip(&other.values).for_each(|(a, b)| *a += weight * b);
    }

    /// Shifted and scaled to mean 0 and variance 1; all zero where it is constant.
    pub fn normalised(mut self) -> Self {
        let count = self.values.len().max(1) as f64;
        let mean = self.values.iter().sum::<f64>() / count;
        let variance = self.values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / count;
        let scale = if variance > 0.0 { 1.0 / libm::sqrt(variance) } else { 0.0 };
        self.values.iter_mut().for_each(|v| *v = (*v - mean) * scale);
        self
    }

    /// What is larger than `sigma` texels taken away and the contrast made even over it, so that no place stands out by which one could
    /// see that the texture repeats. Mean 0, variance 1.
    pub fn evened(self, sigma: f64) -> Self {
        let mut flat = self.normalised();
        flat = flat.clone().minus(&flat.blurred(sigma, sigma));
        let squares = Self { size: flat.size, values: flat.values.iter().map(|v| v * v).collect() };
        let power = squares.blurred(sigma, sigma);
        // a floor of a tenth of the mean variance, which is 1: calm places may stay calm
        flat.values.iter_mut().zip(&power.values).for_each(|(v, p)| *v /= libm::sqrt(p.max(0.0) + 0.1));
        flat.normalised()
    }

    /// The value of a texel, any distance outside of the tile.
    #[inline]
    pub fn at(&self, x: i64, y: i64) -> f64 {
        let size = self.size as i64;
        self.values[(y.rem_euclid(size) * size + x.rem_euclid(size)) as usize]
    }

    /// The value between texels, linearly; texel (x, y) lies at (x, y).
    #[inline]
    pub fn sample(&self, x: f64, y: f64) -> f64 {
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let (i, j) = (x0 as i64, y0 as i64);
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        mix(mix(self.at(i, j), self.at(i + 1, j), fx), mix(self.at(i, j + 1), self.at(i + 1, j + 1), fx), fy)
    }
}

/// Half of a Gaussian kernel on a ring, its middle first; with both halves it sums to 1.
fn kernel(size: usize, sigma: f64) -> Vec<f64> {
    if sigma <= 0.0 {
        return vec![1.0];
    }
    // beyond four standard deviations lie 0.006 %; beyond once around the ring, the ring's mean does as well
    let radius = (libm::ceil(4.0 * sigma) as usize).min(size.saturating_sub(1));
    let mut half: Vec<f64> = (0..=radius).map(|d| libm::exp(-0.5 * (d as f64 / sigma) * (d as f64 / sigma))).collect();
    let sum = half[0] + 2.0 * half[1..].iter().sum::<f64>();
    half.iter_mut().for_each(|w| *w /= sum);
    half
}

/// The shortest way around a ring of `size` from `b` to `a`: in [-size/2, size/2].
#[inline]
pub(super) fn ring_difference(a: f64, b: f64, size: f64) -> f64 {
    let d = a - b;
    d - size * (d / size + 0.5).floor()
}

/// 0 below `low`, 1 above `high`, smooth between.
#[inline]
pub(super) fn smoothstep(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_noise_is_gaussian() {
        let white = Field::white(128, 3, 1);
        let count = white.values.len() as f64;
        let moment = |n: i32| white.values.iter().map(|v| v.powi(n)).sum::<f64>() / count;
        // five standard deviations of each moment of 16,384 numbers: variances 1, 2, 15, 96
        let limit = |variance: f64| 5.0 * (variance / count).sqrt();
        assert!(moment(1).abs() < limit(1.0) && (moment(2) - 1.0).abs() < limit(2.0));
        assert!(moment(3).abs() < limit(15.0) && (moment(4) - 3.0).abs() < limit(96.0));
    }

    #[test]
    fn a_blur_goes_around_the_torus_and_keeps_the_sum() {
        let mut point = Field::from_fn(16, |_, _| 0.0);
        point.values[0] = 1.0;
        let blurred = point.blurred(1.5, 3.0);
        assert!((blurred.values.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert_eq!(blurred.at(1, 0), blurred.at(-1, 0));
        assert_eq!(blurred.at(0, 2), blurred.at(16, 14));
        assert!(blurred.at(0, 3) > blurred.at(3, 0));
    }

    #[test]
    fn a_band_has_its_wavelength() {
        // half a wavelength away a crest meets a trough, a small part of one away itself
        let band = Field::band(256, 1, 1, 16.0);
        let correlation = |d: i64| {
            let product = |k: usize| band.values[k] * band.at(k as i64 % 256 + d, k as i64 / 256);
            (0..band.values.len()).map(product).sum::<f64>() / band.values.len() as f64
        };
        assert!(correlation(2) > 0.6 && correlation(8) < -0.1 && correlation(40).abs() < 0.1);
    }

    #[test]
    fn the_ring_s_shortest_way() {
        assert_eq!(ring_difference(1.0, 15.0, 16.0), 2.0);
        assert_eq!(ring_difference(15.0, 1.0, 16.0), -2.0);
        assert_eq!(ring_difference(5.0, 3.0, 16.0), 2.0);
    }
}
