//! The late echo of a room: a feedback delay network.
//!
//! J.-M. Jot and A. Chaigne, "Digital delay networks for designing artificial reverberators", 90th AES Convention, 1991. Sixteen
//! lines, a mean way between two walls long, mixed by a Hadamard matrix, which keeps energy as it is (J. Stautner and
//! M. Puckette, "Designing multi-channel reverberators", Computer Music Journal 6(1), 1982): with losses below 1 at
//! every frequency in every line ([`super::decay`]) nothing can grow. Two all-passes before it (M. R. Schroeder, 1962) make
//! the echo dense from its beginning.

use super::Room;
use super::decay::Decay;
use crate::filter::BIAS;
use crate::{RATE_HZ, SLICE};

/// Lines; a power of two for the Hadamard matrix.
const LINES: usize = 16;

/// The shortest mean line, samples: shorter ones have so few modes that they ring with a pitch of their own. 25 ms.
const SHORTEST_MEAN: f32 = 0.025 * RATE_HZ as f32;

/// The all-passes' lengths, samples, and their coefficient.
const DIFFUSERS: [usize; 2] = [229, 83];
const DIFFUSION: f32 = 0.6;

/// Below this energy of a slice of output (-120 dB a sample) a room that hears nothing sleeps.
const SILENCE: f32 = SLICE as f32 * 1.0e-12;

/// A room's echo, from what it hears to two ears.
#[derive(Debug)]
pub(crate) struct Fdn {
    lines: [Vec<f32>; LINES],
    at: [usize; LINES],
    gain: [f32; LINES],
    low: [[f32; LINES]; 3],
    high: [[f32; LINES]; 3],
    /// Input and output of both shelves.
    heard: [[f32; LINES]; 4],
    diffusers: [(Vec<f32>, usize); 2],
    /// What makes the energy of the whole answer to one sample 1, both ears together 2.
    level: f32,
    /// Slices since something was heard; asleep from the second on.
    quiet: u32,
    asleep: bool,
}

/// Lengths of the lines: spread evenly in pitch from 0.6 to 1.6 times the mean, made prime so that no two ring together.
fn lengths(mean: f32) -> [usize; LINES] {
    let mean = mean.max(SHORTEST_MEAN);
    let mut last = 0;
    std::array::from_fn(|line| {
        let part = line as f32 / (LINES - 1) as f32;
        let mut length = (mean * 0.6 * libm::powf(1.6 / 0.6, part)) as usize;
        length = length.max(last + 1);
        while !is_prime(length) {
            length += 1;
        }
        last = length;
        length
    })
}

fn is_prime(n: usize) -> bool {
    n > 2 && n % 2 == 1 && (3..).step_by(2).take_while(|d| d * d <= n).all(|d| !n.is_multiple_of(d))
}

/// The signs of the ears' two sums: rows 5 and 10 of the Hadamard matrix, which are orthogonal: the ears hear unlike noise.
fn sign(row: usize, line: usize) -> f32 {
    if (row & line).count_ones().is_multiple_of(2) { 1.0 } else { -1.0 }
}

impl Fdn {
    pub(crate) fn new(room: &Room) -> Self {
        let lengths = lengths(room.mean_delay());
        let decays = lengths.map(|length| Decay::new(length, room.rt60_s));
        let column = |pick: fn(&Decay) -> [f32; 3]| std::array::from_fn(|k| std::array::from_fn(|line| pick(&decays[line])[k]));
        // each time round a line hands out 1 / 16 of what it holds and keeps 10^(-6 t / T): their sum over all rounds is 1
        let mean = lengths.iter().sum::<usize>() as f32 / LINES as f32 / RATE_HZ as f32;
        let kept = libm::powf(10.0, -6.0 * mean / room.rt60_s[1]);
        Self {
            lines: lengths.map(|length| vec![0.0; length]),
            at: [0; LINES],
            gain: std::array::from_fn(|line| decays[line].gain),
            low: column(|decay| decay.low),
            high: column(|decay| decay.high),
            heard: [[0.0; LINES]; 4],
            diffusers: DIFFUSERS.map(|length| (vec![0.0; length], 0)),
            level: ((1.0 - kept) / kept).sqrt(),
            quiet: 2,
            asleep: true,
        }
    }

    /// Adds the echo of `input` to `out`, times a weight that moves from `weights[0]` to `weights[1]`.
    pub(crate) fn slice(&mut self, input: &[f32; SLICE], weights: [f32; 2], out: &mut [[f32; SLICE]; 2]) {
        if input.iter().any(|sample| *sample != 0.0) {
            (self.quiet, self.asleep) = (0, false);
        }
        if self.asleep {
            return;
        }
        let step = (weights[1] - weights[0]) / SLICE as f32;
        let mut energy = 0.0;
        for frame in 0..SLICE {
            let [left, right] = self.next(input[frame]);
            energy += left * left + right * right;
            let weight = weights[0] + step * (frame + 1) as f32;
            out[0][frame] += left * weight;
            out[1][frame] += right * weight;
        }
        // it sleeps when nothing has come in or out for longer than its longest line
        self.quiet = if energy > SILENCE { 0 } else { self.quiet + 1 };
        if self.quiet as usize * SLICE > self.lines[LINES - 1].len() + RATE_HZ as usize / 10 {
            self.sleep();
        }
    }

    fn sleep(&mut self) {
        self.lines.iter_mut().for_each(|line| line.fill(0.0));
        self.diffusers.iter_mut().for_each(|(line, _)| line.fill(0.0));
        (self.heard, self.asleep) = ([[0.0; LINES]; 4], true);
    }

    #[inline]
    fn next(&mut self, input: f32) -> [f32; 2] {
        let mut diffuse = input + BIAS;
        for (line, at) in &mut self.diffusers {
            let delayed = line[*at];
            let fed = diffuse + delayed * DIFFUSION;
            line[*at] = fed;
            diffuse = delayed - fed * DIFFUSION;
            *at = if *at + 1 == line.len() { 0 } else { *at + 1 };
        }
        let mut state: [f32; LINES] = std::array::from_fn(|line| self.lines[line][self.at[line]]);
        let [x1, y1, x2, y2] = &mut self.heard;
        for line in 0..LINES {
            let x = state[line] * self.gain[line];
            let y = self.low[0][line] * x + self.low[1][line] * x1[line] - self.low[2][line] * y1[line];
            let z = self.high[0][line] * y + self.high[1][line] * x2[line] - self.high[2][line] * y2[line];
            (x1[line], y1[line], x2[line], y2[line], state[line]) = (x, y, y, z, z);
        }
        let mut ears = [0.0; 2];
        for (line, heard) in state.iter().enumerate() {
            ears[0] += heard * sign(5, line);
            ears[1] += heard * sign(10, line);
        }
        // fast Walsh-Hadamard transform, over the root of 16: orthogonal
        let mut half = 1;
        while half < LINES {
            for block in (0..LINES).step_by(2 * half) {
                for k in block..block + half {
                    (state[k], state[k + half]) = (state[k] + state[k + half], state[k] - state[k + half]);
                }
            }
            half *= 2;
        }
        // the input goes into each line with a sign of its own and a root of 16 less
        for (line, ((samples, at), mixed)) in self.lines.iter_mut().zip(&mut self.at).zip(state).enumerate() {
            samples[*at] = mixed * 0.25 + diffuse * (0.25 * sign(3, line));
            *at = if *at + 1 == samples.len() { 0 } else { *at + 1 };
        }
        ears.map(|ear| ear * self.level)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::room::{BANDS_HZ, Walls};
    use glam::Vec3;

    fn answer(room: &Room, seconds: f32) -> [Vec<f32>; 2] {
        let mut fdn = Fdn::new(room);
        let mut ears = [Vec::new(), Vec::new()];
        for slice in 0..(seconds * RATE_HZ as f32) as usize / SLICE {
            let mut input = [0.0; SLICE];
            input[0] = if slice == 0 { 1.0 } else { 0.0 };
            let mut out = [[0.0; SLICE]; 2];
            fdn.slice(&input, [1.0; 2], &mut out);
            ears[0].extend_from_slice(&out[0]);
            ears[1].extend_from_slice(&out[1]);
        }
        ears
    }

    /// Two resonators one after the other: an octave around a frequency.
    fn band(samples: &[f32], hz: f32) -> Vec<f64> {
        let mut out: Vec<f64> = samples.iter().map(|s| f64::from(*s)).collect();
        let w = std::f64::consts::TAU * f64::from(hz) / f64::from(RATE_HZ);
        let alpha = w.sin() / (2.0 * 1.8);
        for _ in 0..2 {
            let (mut x1, mut x2, mut y1, mut y2) = (0.0, 0.0, 0.0, 0.0);
            for sample in &mut out {
                let x = *sample;
                let y = (alpha * x - alpha * x2 + 2.0 * w.cos() * y1 - (1.0 - alpha) * y2) / (1.0 + alpha);
                (x2, x1, y2, y1) = (x1, x, y1, y);
                *sample = y;
            }
        }
        out
    }

    /// From -5 to -25 dB of Schroeder's backward integral, times three: T20 of ISO 3382.
    fn rt60([left, right]: [Vec<f64>; 2]) -> f64 {
        let mut sum = 0.0;
        let mut rest: Vec<f64> = left.iter().zip(&right).map(|(l, r)| l * l + r * r).collect();
        for energy in rest.iter_mut().rev() {
            sum += *energy;
            *energy = sum;
        }
        let when = |db: f64| rest.iter().position(|r| 10.0 * (r / sum).log10() < db).expect("falls") as f64;
        (when(-25.0) - when(-5.0)) * 3.0 / f64::from(RATE_HZ)
    }

    #[test]
    fn every_band_dies_away_in_the_time_that_was_asked_for() {
        for (side, rt60_s) in [(8.0, [1.0, 0.8, 0.5]), (25.0, [4.0, 3.0, 1.2]), (3.0, [0.36, 0.4, 0.34])] {
            let box_ = Room::with_walls("test", Vec3::ZERO, Vec3::new(side, side * 0.7, side * 1.3), Walls::Stone);
            let room = Room { rt60_s, ..box_ };
            let [left, right] = answer(&room, 8.0);
            for (hz, asked) in BANDS_HZ.iter().zip(rt60_s) {
                let measured = rt60([&left, &right].map(|ear| band(ear, *hz)));
                println!("{side} m, {hz} Hz: {measured:.3} s for {asked}");
                assert!((measured / f64::from(asked) - 1.0).abs() < 0.1, "{side} m, {hz} Hz: {measured} for {asked}");
            }
        }
    }

    #[test]
    fn the_longest_echo_neither_grows_nor_is_ever_louder_than_it_should() {
        let hall = Room::with_walls("hall", Vec3::ZERO, Vec3::new(60.0, 30.0, 90.0), Walls::Stone);
        let [left, _] = answer(&Room { rt60_s: [20.0; 3], ..hall }, 40.0);
        let energy = |part: &[f32]| part.iter().map(|s| f64::from(*s) * f64::from(*s)).sum::<f64>();
        let seconds: Vec<f64> = left.chunks(2 * RATE_HZ as usize).map(energy).collect();
        assert!(seconds.windows(2).skip(1).all(|pair| pair[1] <= pair[0]), "{seconds:?}");
    }

    #[test]
    fn its_energy_is_one_and_the_ears_hear_unlike_noise() {
        for side in [4.0, 12.0, 30.0] {
            let room = Room::with_walls("test", Vec3::ZERO, Vec3::new(side, side * 0.7, side * 1.3), Walls::Stone);
            let room = Room { rt60_s: [1.5; 3], ..room };
            let [left, right] = answer(&room, 4.0);
            let product = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>();
            let (l, r) = (product(&left, &left), product(&right, &right));
            assert!((10.0 * l.log10()).abs() < 1.0 && (10.0 * r.log10()).abs() < 1.0, "{side}: {l} {r}");
            assert!(product(&left, &right).abs() < 0.1 * (l * r).sqrt());
        }
    }

    #[test]
    fn an_echo_that_has_died_sleeps_and_wakes() {
        let room = Room::with_walls("tent", Vec3::ZERO, Vec3::splat(3.0), Walls::Soft);
        let mut fdn = Fdn::new(&room);
        let (silence, mut loud) = ([0.0; SLICE], [0.0; SLICE]);
        loud[3] = 1.0;
        let mut out = [[0.0; SLICE]; 2];
        for turn in 0..2 {
            fdn.slice(&loud, [1.0; 2], &mut out);
            assert!(!fdn.asleep, "{turn}");
            for _ in 0..2 * RATE_HZ as usize / SLICE {
                fdn.slice(&silence, [1.0; 2], &mut out);
            }
            assert!(fdn.asleep, "{turn}");
        }
    }
}
