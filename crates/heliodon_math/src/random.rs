//! Deterministic random numbers: a hash for "the k-th number of item i", and a small sequential generator.
//!
//! Counter-based numbers keep results the same for any number of threads and any division of the work.

/// A well-mixed 32-bit hash of a 32-bit number.
///
/// PCG-RXS-M-XS as recommended by Jarzynski and Olano: "Hash Functions for GPU Rendering", JCGT 9(3), 2020.
#[must_use]
#[inline]
pub fn hash_u32(x: u32) -> u32 {
    let state = x.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// A hash of two numbers.
#[must_use]
#[inline]
pub fn hash2_u32(a: u32, b: u32) -> u32 {
    hash_u32(a ^ hash_u32(b).wrapping_mul(0x9E37_79B9))
}

/// A hash of three numbers.
#[must_use]
#[inline]
pub fn hash3_u32(a: u32, b: u32, c: u32) -> u32 {
    hash2_u32(a, hash2_u32(b, c))
}

/// The 24 upper bits of `bits` as a number in [0, 1).
#[must_use]
#[inline]
pub fn unit_f32(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// A sequential generator (PCG32: O'Neill, "PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms for
/// Random Number Generation", 2014).
#[derive(Clone, Debug)]
pub struct Pcg32 {
    state: u64,
    increment: u64,
}

impl Pcg32 {
    /// A generator whose sequence depends on `seed` and on `stream`; different streams are independent.
    #[must_use]
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut rng = Self { state: 0, increment: (stream << 1) | 1 };
        rng.next_u32();
        rng.state = rng.state.wrapping_add(seed);
        rng.next_u32();
        rng
    }

    /// The next 32 bits.
    #[inline]
    pub fn next_u32(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(self.increment);
        let xorshifted = (((old >> 18) ^ old) >> 27) as u32;
        xorshifted.rotate_right((old >> 59) as u32)
    }

    /// The next number in [0, 1).
    #[inline]
    pub fn next_f32(&mut self) -> f32 {
        unit_f32(self.next_u32())
    }

    /// The next number in [low, high).
    #[inline]
    pub fn range_f32(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.next_f32()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_numbers_stay_below_one_and_average_a_half() {
        assert!(unit_f32(u32::MAX) < 1.0);
        let mut rng = Pcg32::new(7, 1);
        let mean = (0..100_000).map(|_| f64::from(rng.next_f32())).sum::<f64>() / 100_000.0;
        // five standard deviations of the mean of 100,000 uniform numbers
        assert!((mean - 0.5).abs() < 5.0 * (1.0_f64 / 12.0 / 100_000.0).sqrt());
    }

    #[test]
    fn pcg32_gives_the_published_sequence() {
        // pcg32-demo of the reference implementation: pcg32_srandom(42, 54)
        let mut rng = Pcg32::new(42, 54);
        let got: Vec<u32> = (0..6).map(|_| rng.next_u32()).collect();
        assert_eq!(got, [0xa15c_02b7, 0x7b47_f409, 0xba1d_3330, 0x83d2_f293, 0xbfa4_784b, 0xcbed_606e]);
    }
}
