//! Ambience: stereo beds without a place, loud by the hour.

use super::reader::{Content, Reader};
use crate::SLICE;
use crate::filter::{Dull, Glide, dull_coefficient};
use crate::kernel::Kernel;
use thiserror::Error;

/// Beds that a mixer holds.
pub const MAX_BEDS: usize = 32;

/// The time constant in which a bed follows its hour, seconds.
pub(crate) const BED_S: f32 = 1.0;

/// What walls take from a bed's treble where nothing of it comes in, decibels at [`crate::filter::DULLED_AT_HZ`].
const WALLS_DB: f32 = 15.0;

/// Points of a day that a curve may have.
pub const CURVE_POINTS: usize = 24;

/// A level over the day: straight between its points, and across midnight.
#[derive(Clone, Debug, PartialEq)]
pub struct DayCurve {
    points: Vec<(f32, f32)>,
}

/// Why points are no curve.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("point {point} of a day's curve: {what}; {remedy}")]
pub struct CurveError {
    /// Which, from 1.
    pub point: usize,
    /// What is wrong.
    pub what: String,
    /// What to do about it.
    pub remedy: &'static str,
}

impl DayCurve {
    /// The same at every hour.
    #[must_use]
    pub fn constant(level: f32) -> Self {
        Self { points: vec![(0.0, level)] }
    }

    /// A curve through points of hour (0 to 24, rising) and level (0 to 4).
    ///
    /// # Errors
    ///
    /// No point, more than [`CURVE_POINTS`], hours that do not rise, and numbers outside their ranges.
    pub fn new(points: &[(f32, f32)]) -> Result<Self, CurveError> {
        let refuse = |point: usize, what: String, remedy| Err(CurveError { point, what, remedy });
        if points.is_empty() || points.len() > CURVE_POINTS {
            return refuse(points.len(), format!("{} points", points.len()), "give 1 to 24");
        }
        for (k, (hour, level)) in points.iter().enumerate() {
            if !(0.0..=24.0).contains(hour) || k > 0 && *hour <= points[k - 1].0 {
                return refuse(k + 1, format!("the hour {hour}"), "give hours from 0 to 24, each later than the one before");
            }
            if !(0.0..=4.0).contains(level) {
                return refuse(k + 1, format!("the level {level}"), "give 0 to 4");
            }
        }
        Ok(Self { points: points.to_vec() })
    }

    /// The level at an hour (taken modulo 24).
    #[must_use]
    pub fn at(&self, hour: f32) -> f32 {
        let hour = if hour.is_finite() { hour.rem_euclid(24.0) } else { 12.0 };
        let (first, last) = (self.points[0], self.points[self.points.len() - 1]);
        let after = self.points.iter().position(|point| point.0 > hour);
        let (before, next) = match after {
            Some(0) => ((last.0 - 24.0, last.1), first),
            Some(k) => (self.points[k - 1], self.points[k]),
            None => (last, (first.0 + 24.0, first.1)),
        };
        let span = next.0 - before.0;
        if span <= 0.0 { before.1 } else { before.1 + (next.1 - before.1) * (hour - before.0) / span }
    }
}

/// A bed in the mixer's table.
#[derive(Debug)]
pub(crate) struct Bed {
    reader: Reader,
    curve: DayCurve,
    pub(crate) gain: f32,
    /// Whether walls keep it out.
    outdoors: bool,
    level: Glide,
    dull: Glide,
    air: [Dull; 2],
    pub(crate) leaves: bool,
    /// Its level does not rise from nothing at the very beginning of a visit.
    begun: bool,
}

impl Bed {
    pub(crate) fn new(content: Content, curve: DayCurve, gain: f32, outdoors: bool) -> Self {
        let (level, dull, air) = (Glide::default(), Glide::default(), [Dull::default(); 2]);
        Self { reader: Reader::new(content, true, 1.0), curve, gain, outdoors, level, dull, air, leaves: false, begun: false }
    }

    /// The next slice. Returns false when it has left.
    pub(crate) fn slice(
        &mut self,
        hour: f32,
        openness: f32,
        rate: f32,
        frame: u64,
        kernel: &Kernel,
        out: &mut [[f32; SLICE]; 2],
    ) -> bool {
        let open = if self.outdoors { openness } else { 1.0 };
        let target = if self.leaves { 0.0 } else { self.curve.at(hour) * self.gain * open };
        let dull = dull_coefficient(WALLS_DB * (1.0 - open));
        if !self.begun {
            // from silence in the time of a breath, already as dull as it is to be
            (self.dull, self.begun) = (Glide::at(dull), true);
        }
        let (level, dull) = (self.level.slice(target, rate), self.dull.slice(dull, rate));
        if level.from == 0.0 && level.step == 0.0 {
            self.reader.pass(0, frame);
            return !self.leaves;
        }
        let mut slice = [[0.0; SLICE]; 2];
        self.reader.slice(kernel, 0.0, 0, frame, &mut slice);
        if self.reader.content.channels() == 1 {
            slice[1] = slice[0];
        }
        for ((out, bed), air) in out.iter_mut().zip(&slice).zip(&mut self.air) {
            for (k, (out, bed)) in out.iter_mut().zip(bed).enumerate() {
                *out += air.next(dull.at(k), *bed) * level.at(k);
            }
        }
        !(self.leaves && self.level.value() < 1.0e-5)
    }

    /// A slice goes by unheard.
    pub(crate) fn pass(&mut self, frame: u64) {
        self.reader.pass(0, frame);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_straight_between_their_points_and_across_midnight() {
        let curve = DayCurve::new(&[(6.0, 0.0), (8.0, 1.0), (20.0, 1.0), (22.0, 0.0)]).expect("a curve");
        for (hour, level) in [(7.0, 0.5), (12.0, 1.0), (21.0, 0.5), (0.0, 0.0), (3.0, 0.0), (31.0, 0.5), (-17.0, 0.5)] {
            assert!((curve.at(hour) - level).abs() < 1e-6, "{hour}");
        }
        let night = DayCurve::new(&[(4.0, 1.0), (20.0, 0.0)]).expect("a curve");
        assert!((night.at(0.0) - 0.5).abs() < 1e-6 && (night.at(24.0) - 0.5).abs() < 1e-6);
        assert_eq!(DayCurve::constant(0.3).at(17.0), 0.3);
        assert!(night.at(f32::NAN).is_finite());
    }

    #[test]
    fn odd_curves_are_refused() {
        for points in [&[][..], &[(1.0, 0.0), (1.0, 1.0)], &[(f32::NAN, 0.0)], &[(25.0, 0.0)], &[(1.0, 9.0)], &[(1.0, 0.0); 30]]
        {
            assert!(DayCurve::new(points).expect_err("refused").to_string().contains(';'));
        }
    }
}
