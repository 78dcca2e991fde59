//! Keyframes and what lies between them: glTF 2.0 specification, appendix C ("Animation Sampler Interpolation Modes").

use super::rig::unit_quaternion;
use glam::DQuat;

/// What lies between two keyframes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Interpolation {
    Step,
    Linear,
    Cubic,
}

/// Values of `width` numbers over time; with cubic interpolation a key is three of them: tangent in, value, tangent out.
#[derive(Clone, Debug)]
pub(crate) struct Track {
    times_s: Vec<f32>,
    values: Vec<f32>,
    width: usize,
    interpolation: Interpolation,
    /// Whether the values are quaternions, which go the shortest way round.
    turns: bool,
}

/// Below this angle between quaternions, the straight line between them is the arc to within the 24 bits of a keyframe: they part by
/// angle^3 / 16 at most, which is 6e-8 at 0.01 radians.
const STRAIGHT_RAD: f64 = 0.01;

impl Track {
    /// # Errors
    /// What is wrong with it, as the predicate of a sentence.
    pub fn new(
        times_s: Vec<f32>,
        values: Vec<f32>,
        width: usize,
        interpolation: Interpolation,
        turns: bool,
    ) -> Result<Self, String> {
        let keys = times_s.len();
        if keys == 0 || width == 0 {
            return Err("has no keyframes".to_owned());
        }
        if let Some(key) = times_s.iter().position(|t| !t.is_finite()) {
            return Err(format!("the time of its key {key} is NaN or infinite"));
        }
        if let Some(key) = times_s.windows(2).position(|pair| pair[0] >= pair[1]) {
            return Err(format!("the time of its key {} is not later than that of the key before", key + 1));
        }
        let belongs = keys.saturating_mul(width).saturating_mul(if interpolation == Interpolation::Cubic { 3 } else { 1 });
        if values.len() != belongs {
            return Err(format!("its {keys} keys ask for {belongs} numbers, but there are {}", values.len()));
        }
        if let Some(at) = values.iter().position(|v| !v.is_finite()) {
            return Err(format!("the value of its key {} is NaN or infinite", at * keys / belongs));
        }
        Ok(Self { times_s, values, width, interpolation, turns })
    }

    /// The times of its keys in seconds, rising.
    pub fn times_s(&self) -> &[f32] {
        &self.times_s
    }

    /// The time of its last key in seconds.
    pub fn last_s(&self) -> f32 {
        self.times_s.last().copied().unwrap_or(0.0)
    }

    /// Whether it says the same at every time.
    pub fn is_constant(&self) -> bool {
        let first = self.value(0);
        let same = (0..self.times_s.len()).all(|key| self.value(key) == first);
        same && (self.interpolation != Interpolation::Cubic || self.times_s.len() == 1 || self.tangents_are_zero())
    }

    fn tangents_are_zero(&self) -> bool {
        self.values.chunks_exact(3 * self.width).all(|key| {
            let zero = |part: &[f32]| part.iter().all(|v| *v == 0.0);
            zero(&key[..self.width]) && zero(&key[2 * self.width..])
        })
    }

    fn value(&self, key: usize) -> &[f32] {
        match self.interpolation {
            Interpolation::Cubic => self.part(key, 1),
            _ => &self.values[key * self.width..(key + 1) * self.width],
        }
    }

    /// Of a cubic key the tangent in (0), the value (1), the tangent out (2).
    fn part(&self, key: usize, part: usize) -> &[f32] {
        let from = (3 * key + part) * self.width;
        &self.values[from..from + self.width]
    }

    /// The value at a time, of which `out` takes as much as it holds; before the first key the first value, after the last one the last.
    pub fn sample(&self, time_s: f32, out: &mut [f64]) {
        let after = self.times_s.partition_point(|&t| t <= time_s);
        let key = after.saturating_sub(1);
        if after == 0 || after == self.times_s.len() || self.interpolation == Interpolation::Step {
            out.iter_mut().zip(self.value(key)).for_each(|(out, &v)| *out = f64::from(v));
        } else {
            let (from, to) = (f64::from(self.times_s[key]), f64::from(self.times_s[after]));
            let (step, u) = (to - from, (f64::from(time_s) - from) / (to - from));
            if self.interpolation == Interpolation::Cubic {
                self.cubic(key, step, u, out);
            } else if self.turns {
                let end = |key: usize| quaternion(self.value(key));
                let turned = slerp(end(key), end(after), u).to_array();
                out.iter_mut().zip(turned).for_each(|(out, v)| *out = v);
            } else {
                let ends = self.value(key).iter().zip(self.value(after));
                out.iter_mut().zip(ends).for_each(|(out, (&a, &b))| *out = f64::from(a) + (f64::from(b) - f64::from(a)) * u);
            }
        }
    }

    /// Hermite's spline; the tangents are per second, so they are scaled by the keys' distance.
    fn cubic(&self, key: usize, step: f64, u: f64, out: &mut [f64]) {
        let (u2, u3) = (u * u, u * u * u);
        let weights = [2.0 * u3 - 3.0 * u2 + 1.0, step * (u3 - 2.0 * u2 + u), 3.0 * u2 - 2.0 * u3, step * (u3 - u2)];
        let parts = [self.part(key, 1), self.part(key, 2), self.part(key + 1, 1), self.part(key + 1, 0)];
        for (k, out) in out.iter_mut().enumerate().take(self.width) {
            *out = weights.iter().zip(parts).map(|(w, part)| w * f64::from(part[k])).sum();
        }
    }
}

fn quaternion(v: &[f32]) -> DQuat {
    match v {
        [x, y, z, w] => unit_quaternion([*x, *y, *z, *w].map(f64::from)),
        _ => DQuat::IDENTITY,
    }
}

/// From `a` to `b` at constant speed, the shortest way.
fn slerp(a: DQuat, b: DQuat, u: f64) -> DQuat {
    // a quaternion and its negative turn alike; the nearer one is the shorter way
    let b = if a.dot(b) < 0.0 { -b } else { b };
    let difference = b - a;
    // acos loses half its digits near 1
    let angle = 2.0 * libm::asin((difference.length() * 0.5).min(1.0));
    if angle < STRAIGHT_RAD {
        return unit_quaternion((a + difference * u).to_array());
    }
    // the sine of the whole angle, by which both are to be divided, falls out where the sum is made unit
    let turned = a * libm::sin((1.0 - u) * angle) + b * libm::sin(u * angle);
    unit_quaternion(turned.to_array())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_4;

    fn track(times: &[f32], values: &[f32], width: usize, interpolation: Interpolation) -> Track {
        Track::new(times.to_vec(), values.to_vec(), width, interpolation, width == 4).unwrap()
    }

    fn at(track: &Track, time_s: f32) -> Vec<f64> {
        let mut out = vec![f64::NAN; track.width];
        track.sample(time_s, &mut out);
        out
    }

    #[test]
    fn steps_and_lines_and_what_lies_outside_of_the_keys() {
        let step = track(&[1.0, 2.0, 4.0], &[10.0, 20.0, 40.0], 1, Interpolation::Step);
        for (time, value) in [(0.0, 10.0), (1.0, 10.0), (1.999, 10.0), (2.0, 20.0), (3.9, 20.0), (4.0, 40.0), (9.0, 40.0)] {
            assert_eq!(at(&step, time), [value], "{time}");
        }
        let line = track(&[1.0, 2.0, 4.0], &[10.0, 0.0, 20.0, 1.0, 40.0, -1.0], 2, Interpolation::Linear);
        for (time, value) in [(0.0, [10.0, 0.0]), (1.25, [12.5, 0.25]), (3.0, [30.0, 0.0]), (4.0, [40.0, -1.0])] {
            assert_eq!(at(&line, time), value, "{time}");
        }
        assert_eq!(at(&track(&[3.0], &[7.0], 1, Interpolation::Linear), 1.0), [7.0]);
    }

    #[test]
    fn a_cubic_spline_of_a_parabola_is_that_parabola() {
        // t^2 has the slope 2 t, and Hermite's spline is exact up to t^3
        let cubed = |t: f32| [3.0 * t * t, t * t * t, 3.0 * t * t];
        let values: Vec<f32> = [0.0, 2.0, 3.0].into_iter().flat_map(cubed).collect();
        let spline = track(&[0.0, 2.0, 3.0], &values, 1, Interpolation::Cubic);
        for time in [0.0_f32, 0.5, 1.0, 1.9, 2.0, 2.5, 3.0] {
            assert!((at(&spline, time)[0] - f64::from(time).powi(3)).abs() < 1e-12, "{time}");
        }
        // by hand: from 0 to 1 in two seconds, leaving with slope 1 and arriving flat, half way: 1/2 + 2 * 1/8
        let by_hand = track(&[0.0, 2.0], &[0.0, 0.0, 1.0, 0.0, 1.0, 5.0], 1, Interpolation::Cubic);
        assert!((at(&by_hand, 1.0)[0] - 0.75).abs() < 1e-12);
    }

    #[test]
    fn rotations_go_the_shortest_way_at_constant_speed() {
        let half = std::f32::consts::FRAC_1_SQRT_2;
        // a quarter turn about y, written as its negative
        let turn = track(&[0.0, 1.0], &[0.0, 0.0, 0.0, 1.0, 0.0, -half, 0.0, -half], 4, Interpolation::Linear);
        for u in [0.25_f32, 0.5, 0.8] {
            let q = DQuat::from_slice(&at(&turn, u));
            let expected = DQuat::from_rotation_y(f64::from(u) * 2.0 * FRAC_PI_4);
            assert!(q.dot(expected).abs() > 1.0 - 1e-12, "{q} {expected}");
        }
        // nearly the same, and exactly opposite: finite and unit
        let near = track(&[0.0, 1.0], &[0.0, 0.0, 0.0, 1.0, 0.0, 1e-4, 0.0, 1.0], 4, Interpolation::Linear);
        assert!((DQuat::from_slice(&at(&near, 0.5)).length() - 1.0).abs() < 1e-12);
        let flip = track(&[0.0, 1.0], &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0], 4, Interpolation::Linear);
        assert_eq!(at(&flip, 0.5), [0.0, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn what_is_no_track_says_why() {
        let wrong =
            |times: &[f32], values: &[f32], kind| Track::new(times.to_vec(), values.to_vec(), 1, kind, false).unwrap_err();
        assert!(wrong(&[], &[], Interpolation::Step).contains("no keyframes"));
        assert!(wrong(&[0.0, f32::NAN], &[0.0; 2], Interpolation::Step).contains("key 1 is NaN"));
        assert!(wrong(&[0.0, 1.0, 1.0], &[0.0; 3], Interpolation::Linear).contains("key 2 is not later"));
        assert!(wrong(&[0.0, 1.0], &[0.0; 2], Interpolation::Cubic).contains("ask for 6 numbers, but there are 2"));
        assert!(wrong(&[0.0, 1.0], &[0.0, f32::INFINITY], Interpolation::Linear).contains("value of its key 1"));
    }

    #[test]
    fn constant_tracks_are_known() {
        assert!(track(&[0.0, 1.0], &[1.0; 6], 3, Interpolation::Linear).is_constant());
        assert!(!track(&[0.0, 1.0], &[1.0, 1.0, 1.0, 1.0, 1.0, 2.0], 3, Interpolation::Linear).is_constant());
        assert!(!track(&[0.0, 1.0], &[0.0, 1.0, 3.0, 0.0, 1.0, 0.0], 1, Interpolation::Cubic).is_constant());
    }
}
