//! From numbers to codes whose mean is exactly 128.

use super::NEUTRAL;
use heliodon_math::random::hash_u32;

const LARGEST: f64 = u8::MAX as f64;

/// Codes for `values`, all shifted by one number so that the mean is exactly [`NEUTRAL`], clamped to [0, 255].
///
/// Of all codes with this sum they are the closest to the shifted values: each is rounded down, and those with the largest
/// remainders are rounded up until the sum is met. Where remainders are equal, as where an 8-bit image is shifted by part of a
/// code, a hash of the place decides, which shows no pattern.
pub(super) fn quantise(values: &[f64]) -> Vec<u8> {
    let target = values.len() as u64 * u64::from(NEUTRAL);
    let offset = find_offset(values);
    let shifted = values.iter().map(|v| (v + offset).clamp(0.0, LARGEST));
    let (mut codes, remainders): (Vec<u8>, Vec<u32>) =
        // the remainder in 2^-32: below 1, so it fits
        shifted.map(|v| (v.floor() as u8, ((v - v.floor()) * 4_294_967_296.0) as u32)).unzip();
    round_up(&mut codes, &remainders, target);
    codes
}

/// Adds 1 to the codes with the largest remainders until they sum to `target`. Codes that are 255 stay.
pub(super) fn round_up(codes: &mut [u8], remainders: &[u32], target: u64) {
    let sum: u64 = codes.iter().map(|&code| u64::from(code)).sum();
    let missing = target.saturating_sub(sum) as usize;
    // rank: remainder, then a hash of the place; the place itself decides between equal hashes
    let mut ranked: Vec<(u64, u32)> = (0_u32..)
        .zip(codes.iter().zip(remainders))
        .filter(|(_, (code, _))| **code < u8::MAX)
        .map(|(place, (_, remainder))| (u64::from(*remainder) << 32 | u64::from(hash_u32(place)), place))
        .collect();
    if missing == 0 || ranked.is_empty() {
        return;
    }
    let last = missing.min(ranked.len()) - 1;
    ranked.select_nth_unstable_by(last, |a, b| b.cmp(a));
    for &(_, place) in &ranked[..=last] {
        codes[place as usize] += 1;
    }
}

/// What is to be added to all values so that their mean, clamped to the codes' range, is [`NEUTRAL`].
fn find_offset(values: &[f64]) -> f64 {
    let count = values.len().max(1) as f64;
    let target = f64::from(NEUTRAL);
    let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(low, high), &v| (low.min(v), high.max(v)));
    let plain = target - values.iter().sum::<f64>() / count;
    if low + plain >= 0.0 && high + plain <= LARGEST {
        return plain;
    }
    // the clamped mean grows with the offset: from 0 where all are clamped below to 255 where all are above
    let (mut least, mut most) = (-high, LARGEST - low);
    for _ in 0..64 {
        let middle = 0.5 * (least + most);
        let mean = values.iter().map(|v| (v + middle).clamp(0.0, LARGEST)).sum::<f64>() / count;
        if mean < target { least = middle } else { most = middle }
    }
    // above or at the target by less than a code in all, so that rounding down and then up can meet it
    most
}

/// Codes of mean exactly 128 and of standard deviation `contrast` codes for values of mean 0 and variance 1.
pub(super) fn with_contrast(values: &[f64], contrast: f64) -> Vec<u8> {
    let count = values.len().max(1) as f64;
    // rounding adds a twelfth to the variance
    let wanted = libm::sqrt((contrast * contrast - 1.0 / 12.0).max(0.01));
    let mut gain = wanted;
    // clamping takes from the variance; a few rounds of scaling give it back, as the share that is clamped is small
    for _ in 0..6 {
        let scaled: Vec<f64> = values.iter().map(|v| v * gain).collect();
        let offset = find_offset(&scaled);
        let deviation = |v: &f64| (v + offset).clamp(0.0, LARGEST) - f64::from(NEUTRAL);
        let variance = scaled.iter().map(|v| deviation(v) * deviation(v)).sum::<f64>() / count;
        if variance <= 0.0 || (libm::sqrt(variance) - wanted).abs() < 1e-3 {
            break;
        }
        gain *= wanted / libm::sqrt(variance);
    }
    let scaled: Vec<f64> = values.iter().map(|v| v * gain).collect();
    quantise(&scaled)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean_is_neutral(codes: &[u8]) -> bool {
        codes.iter().map(|&code| u64::from(code)).sum::<u64>() == codes.len() as u64 * u64::from(NEUTRAL)
    }

    #[test]
    fn the_mean_is_exact_and_changes_are_the_smallest() {
        // 77.3 below: 64 texels of a ramp
        let values: Vec<f64> = (0..64).map(|i| f64::from(i) * 1.37 - 20.0).collect();
        let codes = quantise(&values);
        assert!(mean_is_neutral(&codes));
        let offset = 128.0 - values.iter().sum::<f64>() / 64.0;
        for (code, value) in codes.iter().zip(&values) {
            assert!((f64::from(*code) - value - offset).abs() < 0.6, "{code} {value}");
        }
    }

    #[test]
    fn codes_of_the_right_mean_stay_as_they_are() {
        let codes: Vec<u8> =
            (0..256).map(|i| if i % 2 == 0 { 3 + (i % 100) as u8 } else { 253 - ((i - 1) % 100) as u8 }).collect();
        assert!(mean_is_neutral(&codes));
        let values: Vec<f64> = codes.iter().map(|&code| f64::from(code)).collect();
        assert_eq!(quantise(&values), codes);
    }

    #[test]
    fn part_of_a_code_is_spread_without_a_pattern() {
        // all remainders are equal: 0.25 of the texels go up, in each half and each parity alike
        let values: Vec<f64> = (0..4096).map(|i| if i < 3072 { 10.0 } else { 11.0 }).collect();
        let codes = quantise(&values);
        assert!(mean_is_neutral(&codes));
        let up = |keep: &dyn Fn(usize) -> bool| (0..3072).filter(|&i| keep(i) && codes[i] == 128).count() as f64;
        let all = up(&|_| true);
        for part in [up(&|i| i % 2 == 0), up(&|i| i / 64 % 2 == 0), up(&|i| i < 1536)] {
            assert!((part / all - 0.5).abs() < 0.06, "{part} of {all}");
        }
    }

    #[test]
    fn what_is_clamped_is_made_good_by_the_rest() {
        for values in [vec![0.0, 255.0, 255.0, 255.0], vec![0.0, 0.0, 0.0, 255.0], vec![-900.0, 0.0, 0.0, 900.0]] {
            assert!(mean_is_neutral(&quantise(&values)), "{values:?}");
        }
    }
}
