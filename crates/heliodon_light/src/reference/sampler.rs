//! The numbers of one path.

use heliodon_math::random::{Pcg32, hash3_u32};

/// Numbers of a path from the sequence; those after come from the generator.
const DIMENSIONS: usize = 6;

/// `1 / phi^k` for k = 1..6, where `phi^7 = phi + 1`: steps of a rank-one sequence with even coverage in six dimensions (M.
/// Roberts: "The Unreasonable Effectiveness of Quasirandom Sequences", 2018).
const STEPS: [f64; DIMENSIONS] = steps();

const fn steps() -> [f64; DIMENSIONS] {
    // Newton's method on phi^7 - phi - 1, which converges from 1.2 in a few rounds
    let mut phi = 1.2_f64;
    let mut round = 0;
    while round < 32 {
        let p2 = phi * phi;
        let p6 = p2 * p2 * p2;
        phi -= (p6 * phi - phi - 1.0) / (7.0 * p6 - 1.0);
        round += 1;
    }
    let mut steps = [0.0; DIMENSIONS];
    let mut power = 1.0;
    let mut k = 0;
    while k < DIMENSIONS {
        power /= phi;
        steps[k] = power;
        k += 1;
    }
    steps
}

/// The numbers of one path.
#[derive(Clone, Debug)]
pub(crate) struct PathSampler {
    first: [f32; DIMENSIONS],
    rng: Pcg32,
}

impl PathSampler {
    /// Sample `sample` of pixel or point `item`.
    pub fn new(seed: u32, item: u32, sample: u32) -> Self {
        let shift = |k: usize| f64::from(hash3_u32(seed, item, k as u32)) / 4_294_967_296.0;
        let first = std::array::from_fn(|k| {
            let x = f64::from(sample) * STEPS[k] + shift(k);
            // the rounding to f32 may reach one
            ((x - x.floor()) as f32).min(1.0 - f32::EPSILON)
        });
        Self { first, rng: Pcg32::new(u64::from(seed) << 32 | u64::from(item), u64::from(sample)) }
    }

    /// Two numbers from the sequence, pair 0 to 2.
    pub fn first_pair(&self, pair: usize) -> [f32; 2] {
        [self.first[2 * pair], self.first[2 * pair + 1]]
    }

    /// Two numbers from the generator.
    pub fn pair(&mut self) -> [f32; 2] {
        [self.rng.next_f32(), self.rng.next_f32()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_steps_solve_their_equation() {
        let phi = 1.0 / STEPS[0];
        assert!((phi.powi(7) - phi - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_sequence_covers_squares_evenly() {
        // 4,096 samples into 16 x 16 squares of any pair: each has its 16, give or take fewer than random ones would
        for pair in 0..3 {
            let mut counts = [0_u32; 256];
            for s in 0..4096 {
                let [x, y] = PathSampler::new(1, 9, s).first_pair(pair);
                counts[(x * 16.0) as usize * 16 + (y * 16.0) as usize] += 1;
            }
            let variance = counts.iter().map(|&c| (f64::from(c) - 16.0).powi(2)).sum::<f64>() / 256.0;
            assert!(variance < 8.0, "pair {pair}: variance {variance} against 16 of random numbers");
        }
    }
}
