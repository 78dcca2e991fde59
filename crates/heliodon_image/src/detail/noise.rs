//! Gaussian noise.

use super::field::Field;

/// White noise.
pub(super) fn white(size: usize, seed: u64) -> Field {
    Field::white(size, seed, 1)
}

/// Noise around one wavelength in texels.
pub(super) fn band(size: usize, seed: u64, wavelength: f64) -> Field {
    Field::band(size, seed, 1, wavelength)
}
