//! What a delay line loses each time, so that every band dies away in its own time.
//!
//! J.-M. Jot and A. Chaigne, "Digital delay networks for designing artificial reverberators", 90th AES Convention, 1991: a line of
//! `m` samples takes `60 m / (rate T)` decibels at a frequency whose reverberation time is `T`. Here by a gain and two shelves of
//! first order, solved together so that the three bands' middles are right, as S. J. Schlecht and E. A. P. Habets do with more
//! bands ("Accurate reverberation time control in feedback delay networks", DAFx 2017).

use super::BANDS_HZ;
use crate::RATE_HZ;
use std::f64::consts::{PI, TAU};

/// Where the shelves stand, hertz: half way between the bands.
const CORNERS_HZ: [f64; 2] = [500.0, 2000.0];

/// The longest time in which anything dies away, seconds: whatever is asked for between the bands and beyond them.
const LONGEST_S: f64 = 30.0;

/// One line's loss.
#[derive(Clone, Copy, Debug)]
pub(super) struct Decay {
    pub(super) gain: f32,
    /// `b0, b1, a1` of the shelf below 500 Hz and of the one above 2 kHz.
    pub(super) low: [f32; 3],
    pub(super) high: [f32; 3],
}

/// A shelf of first order, 1 at the far end of its corner and `gain` beyond it, half way (in decibels) at the corner.
fn shelf(gain: f64, corner_hz: f64, above: bool) -> [f64; 3] {
    let k = libm::tan(PI * corner_hz / f64::from(RATE_HZ));
    let root = gain.sqrt();
    // low: (s + root k) / (s + k / root); high: (gain s + root k) / (s + root k), with s = (1 - z) / (1 + z)
    let (n1, n0, d1, d0) = if above { (gain, root * k, 1.0, root * k) } else { (1.0, root * k, 1.0, k / root) };
    [(n1 + n0) / (d1 + d0), (n0 - n1) / (d1 + d0), (d0 - d1) / (d1 + d0)]
}

/// Decibels of a shelf at a frequency.
fn shelf_db(filter: [f64; 3], frequency_hz: f64) -> f64 {
    let (sine, cosine) = libm::sincos(TAU * frequency_hz / f64::from(RATE_HZ));
    let [b0, b1, a1] = filter;
    let square = |real: f64, imaginary: f64| real * real + imaginary * imaginary;
    10.0 * libm::log10(square(b0 + b1 * cosine, b1 * sine) / square(1.0 + a1 * cosine, a1 * sine))
}

/// The solution of three linear equations by Cramer's rule; the matrix is never singular here, for the shelves differ.
fn solve(m: [[f64; 3]; 3], right: [f64; 3]) -> [f64; 3] {
    let det = |m: [[f64; 3]; 3]| {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    };
    let whole = det(m);
    std::array::from_fn(|column| {
        let mut replaced = m;
        for row in 0..3 {
            replaced[row][column] = right[row];
        }
        det(replaced) / whole
    })
}

impl Decay {
    /// What a line of `delay` samples loses.
    pub(super) fn new(delay: usize, rt60_s: [f32; 3]) -> Self {
        let seconds = delay as f64 / f64::from(RATE_HZ);
        let wanted: [f64; 3] = rt60_s.map(|time| -60.0 * seconds / f64::from(time));
        let least = -60.0 * seconds / LONGEST_S;
        // decibels of the gain, the low and the high shelf, by Newton's method. Bands of very different times in a long line are
        // beyond what two shelves can do: the nearest that was met is taken then.
        let told = |parts: [f64; 3]| {
            let filters = Self::shelves(parts);
            BANDS_HZ.map(|hz| parts[0] + shelf_db(filters[0], f64::from(hz)) + shelf_db(filters[1], f64::from(hz)))
        };
        let (mut parts, mut best) = ([wanted[1], 0.0, 0.0], ([wanted[1], 0.0, 0.0], f64::INFINITY));
        for _ in 0..16 {
            let now = told(parts);
            let missing: [f64; 3] = std::array::from_fn(|band| wanted[band] - now[band]);
            let worst = missing.iter().fold(0.0, |worst: f64, m| worst.max(m.abs()));
            if worst < best.1 {
                best = (parts, worst);
            }
            let slopes: [[f64; 3]; 3] = std::array::from_fn(|part| {
                let mut moved = parts;
                moved[part] += 0.01;
                let then = told(moved);
                std::array::from_fn(|band| (then[band] - now[band]) / 0.01)
            });
            let matrix = std::array::from_fn(|band| std::array::from_fn(|part| slopes[part][band]));
            let step = solve(matrix, missing);
            parts = std::array::from_fn(|k| (parts[k] + step[k].clamp(-6.0, 6.0)).clamp(-60.0, 60.0));
        }
        let parts = best.0;
        // beyond the bands the shelves go on: nothing there may ring longer than the longest, let alone for ever
        let filters = Self::shelves(parts);
        let total = |frequency: f64| parts[0] + shelf_db(filters[0], frequency) + shelf_db(filters[1], frequency);
        let nyquist = f64::from(RATE_HZ) / 2.0 - 1.0;
        let loudest = [1.0, 60.0, 500.0, 700.0, 1400.0, 2000.0, 8000.0, nyquist].map(total).into_iter().fold(-1e9, f64::max);
        let gain_db = parts[0] - (loudest - least).max(0.0);
        let narrow = |filter: [f64; 3]| filter.map(|c| c as f32);
        Self { gain: from_db(gain_db) as f32, low: narrow(filters[0]), high: narrow(filters[1]) }
    }

    fn shelves(parts: [f64; 3]) -> [[f64; 3]; 2] {
        [shelf(from_db(parts[1]), CORNERS_HZ[0], false), shelf(from_db(parts[2]), CORNERS_HZ[1], true)]
    }
}

fn from_db(db: f64) -> f64 {
    libm::pow(10.0, db / 20.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_band_loses_what_it_should() {
        for rt60_s in [[1.0, 1.0, 1.0], [4.0, 3.0, 1.0], [0.3, 0.5, 0.2], [2.0, 6.0, 3.0]] {
            for delay in [700, 1100, 2000, 5000] {
                // as much as 6 dB a turn: rooms that die away quickly are small, and their lines short
                if rt60_s.iter().any(|time| delay as f32 / RATE_HZ as f32 * 60.0 > 6.0 * time) {
                    continue;
                }
                let decay = Decay::new(delay, rt60_s);
                let (low, high) = (decay.low.map(f64::from), decay.high.map(f64::from));
                for (band, time) in BANDS_HZ.iter().zip(rt60_s) {
                    let hz = f64::from(*band);
                    let db = 20.0 * f64::from(decay.gain).log10() + shelf_db(low, hz) + shelf_db(high, hz);
                    let wanted = -60.0 * delay as f64 / f64::from(RATE_HZ) / f64::from(time);
                    assert!((db - wanted).abs() < 0.02 * wanted.abs() + 0.005, "{rt60_s:?} {delay} {band}: {db} for {wanted}");
                }
            }
        }
    }

    #[test]
    fn nothing_rings_for_ever() {
        let decay = Decay::new(3000, [20.0, 0.1, 20.0]);
        let (low, high) = (decay.low.map(f64::from), decay.high.map(f64::from));
        for hz in (1..24_000).step_by(50) {
            let hz = f64::from(hz);
            let db = 20.0 * f64::from(decay.gain).log10() + shelf_db(low, hz) + shelf_db(high, hz);
            assert!(db < -0.1, "{hz}: {db}");
        }
    }
}
