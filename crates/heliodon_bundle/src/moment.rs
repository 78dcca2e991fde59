//! The light of a lapse at one moment, ready for shading: what a viewer hands to its shader as constants.
//!
//! With [`Blend::Hard`] it is the paper's: the latest step holds until the next, masks and sun change where the mask bit
//! does, the sky with every entry (Callieri, Debevec, Pair, Scopigno: "A realtime immersive application with realistic
//! lighting: The Parthenon", Computers & Graphics 30, 2006, section 6). With [`Blend::Smooth`] all of it moves in between:
//!
//! - Sky coefficients, glow and exposure are interpolated between the two entries around the moment.
//! - Sun steps stand at the times of the first entries that name their mask bits. Between two of them, direction (on the
//!   great circle) and irradiance of the sun are interpolated, each vertex's two mask bits are weighted, and so are the
//!   functions of the bounced sunlight. Where only one of the two steps has a sun, its direction, bit and functions hold and
//!   the irradiance fades.
//!
//! At the time of a step both give exactly that step, except that smooth light has moved half way on at an entry between two
//! sun steps.

use crate::site::TimeOfDay;
use glam::Vec3;
use heliodon_math::frame::unit_or;
use heliodon_sky::lapse::{Lapse, LapseStep};
use std::borrow::Borrow;

/// How the steps of a lapse are joined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Blend {
    /// Light moves between the steps.
    #[default]
    Smooth,
    /// A step holds until the next.
    Hard,
}

/// The light of one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// Seconds after midnight, within the lapse.
    pub seconds: f64,
    /// The entries of the lapse around the moment, for sky maps; the same twice where one holds alone.
    pub entries: [usize; 2],
    /// Weight of the second entry, in [0, 1).
    pub entry_fraction: f32,
    /// Bits of the sun masks of the two sun steps.
    pub mask_bits: [u32; 2],
    /// Weights of the two bits; their sum is 1.
    pub mask_weights: [f32; 2],
    /// Unit direction to the sun; up where there is none.
    pub sun_direction: Vec3,
    /// The sun's irradiance at normal incidence; zero where there is none.
    pub sun_irradiance: Vec3,
    /// Sky coefficients: the projection of the sky's radiance.
    pub sky: Vec<Vec3>,
    /// What vertices are shaded with.
    pub shading: Shading,
    /// The value of each function of the bounced sunlight.
    pub bounce: Vec<f32>,
    /// The exposure that suits the moment, in stops.
    pub exposure_stops: f32,
}

/// Sun and sky as vertices are shaded with them: as the lapse has fitted them to receivers, or else the sun and the projected sky.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shading {
    /// Irradiance from the sun's direction, cut by its mask: the sun's and the sky's glow.
    pub sun_irradiance: Vec3,
    /// Sky coefficients without that glow.
    pub sky: Vec<Vec3>,
}

/// A lapse with its times and sun steps worked out, from which moments are made; `L` is the lapse or a reference to one.
#[derive(Clone, Debug)]
pub struct Day<L> {
    lapse: L,
    /// Seconds after midnight of every entry.
    times: Vec<f64>,
    /// The first entry of every run of entries with the same mask bit.
    sun_entries: Vec<usize>,
}

/// Two neighbours and the weight of the second, in [0, 1).
#[derive(Clone, Copy)]
struct Between {
    pair: [usize; 2],
    fraction: f32,
}

impl<L: Borrow<Lapse>> Day<L> {
    /// Works out the times of a lapse that [`crate::check_lapse`] has passed, as those of [`crate::BundleReader`] are; entries whose time
    /// does not parse, and an empty lapse, are a caller's mistake that shows as a moment of darkness at midnight.
    #[must_use]
    pub fn new(lapse: L) -> Self {
        let steps = &lapse.borrow().steps;
        let time = |step: &LapseStep| step.time.parse::<TimeOfDay>().map_or(0.0, |t| f64::from(t.seconds()));
        let starts_run = |i: &usize| *i == 0 || steps[*i].mask_bit != steps[*i - 1].mask_bit;
        let times = steps.iter().map(time).collect();
        let sun_entries = (0..steps.len()).filter(starts_run).collect();
        Self { lapse, times, sun_entries }
    }

    /// The lapse.
    #[must_use]
    pub fn lapse(&self) -> &Lapse {
        self.lapse.borrow()
    }

    /// The first and the last entry's time, seconds after midnight.
    #[must_use]
    pub fn span_seconds(&self) -> (f64, f64) {
        (self.times.first().copied().unwrap_or(0.0), self.times.last().copied().unwrap_or(0.0))
    }

    /// Seconds after midnight of every entry of the lapse.
    #[must_use]
    pub fn entry_seconds(&self) -> &[f64] {
        &self.times
    }

    /// The light at a time, seconds after midnight; before the first entry and after the last, theirs.
    #[must_use]
    pub fn at(&self, seconds: f64, blend: Blend) -> Moment {
        let (first, last) = self.span_seconds();
        let seconds = if seconds.is_nan() { first } else { seconds.clamp(first, last) };
        let mut entries = locate(seconds, self.times.len(), |i| self.times[i]);
        let mut suns = locate(seconds, self.sun_entries.len(), |i| self.times[self.sun_entries[i]]);
        if blend == Blend::Hard {
            entries = entries.first_only();
            suns = suns.first_only();
        }
        self.join(seconds, entries, suns)
    }

    fn join(&self, seconds: f64, entries: Between, suns: Between) -> Moment {
        let steps = &self.lapse().steps;
        let mut moment = Moment {
            seconds,
            entries: entries.pair,
            entry_fraction: entries.fraction,
            mask_bits: [0; 2],
            mask_weights: [1.0, 0.0],
            sun_direction: Vec3::Y,
            sun_irradiance: Vec3::ZERO,
            sky: Vec::new(),
            shading: Shading::default(),
            bounce: Vec::new(),
            exposure_stops: 0.0,
        };
        if let [Some(a), Some(b)] = entries.pair.map(|i| steps.get(i)) {
            let f = entries.fraction;
            let mixed = |a: &[[f32; 3]], b: &[[f32; 3]]| -> Vec<Vec3> {
                a.iter().zip(b).map(|(&a, &b)| Vec3::from_array(a).lerp(Vec3::from_array(b), f)).collect()
            };
            moment.sky = mixed(&a.sky, &b.sky);
            let ((glow_a, sky_a), (glow_b, sky_b)) = (shaded(a), shaded(b));
            moment.shading = Shading { sun_irradiance: glow_a.lerp(glow_b, f), sky: mixed(sky_a, sky_b) };
            moment.exposure_stops = a.exposure_stops + (b.exposure_stops - a.exposure_stops) * f;
        }
        let sun_steps = suns.pair.map(|i| self.sun_entries.get(i).map(|&entry| &steps[entry]));
        if let [Some(a), Some(b)] = sun_steps {
            self.set_sun(&mut moment, a, b, suns.fraction);
        }
        moment.shading.sun_irradiance += moment.sun_irradiance;
        moment
    }

    fn set_sun(&self, moment: &mut Moment, a: &LapseStep, b: &LapseStep, f: f32) {
        moment.mask_bits = [a.mask_bit, b.mask_bit];
        match (&a.sun, &b.sun) {
            (Some(sun_a), Some(sun_b)) => {
                let (to_a, to_b) = (Vec3::from_array(sun_a.direction), Vec3::from_array(sun_b.direction));
                moment.sun_direction = if f == 0.0 { to_a } else { unit_or(to_a.lerp(to_b, f), to_a) };
                moment.sun_irradiance = Vec3::from_array(sun_a.irradiance).lerp(Vec3::from_array(sun_b.irradiance), f);
                moment.mask_weights = [1.0 - f, f];
            }
            (Some(sun), None) => {
                moment.sun_direction = Vec3::from_array(sun.direction);
                moment.sun_irradiance = Vec3::from_array(sun.irradiance) * (1.0 - f);
            }
            (None, Some(sun)) => {
                moment.sun_direction = Vec3::from_array(sun.direction);
                moment.sun_irradiance = Vec3::from_array(sun.irradiance) * f;
                moment.mask_weights = [0.0, 1.0];
            }
            (None, None) => {}
        }
        if let Some(basis) = &self.lapse().sun_bounce_basis {
            let [w0, w1] = moment.mask_weights;
            let value = |function: &Vec<f32>, bit: u32| function.get(bit as usize).copied().unwrap_or(0.0);
            let functions = basis.functions.iter();
            moment.bounce = functions.map(|f| w0 * value(f, a.mask_bit) + w1 * value(f, b.mask_bit)).collect();
        }
    }
}

/// Glow and coefficients that a step is shaded with.
fn shaded(step: &LapseStep) -> (Vec3, &[[f32; 3]]) {
    step.fitted.as_ref().map_or((Vec3::ZERO, &step.sky), |fitted| (Vec3::from_array(fitted.glow), &fitted.sky))
}

impl Between {
    fn first_only(self) -> Self {
        Self { pair: [self.pair[0]; 2], fraction: 0.0 }
    }
}

/// The two of `count` rising times around `seconds`.
fn locate(seconds: f64, count: usize, time: impl Fn(usize) -> f64) -> Between {
    let (mut low, mut high) = (0, count);
    while low < high {
        let middle = low.midpoint(high);
        if time(middle) <= seconds { low = middle + 1 } else { high = middle }
    }
    let first = low.saturating_sub(1);
    if low == 0 || low >= count {
        return Between { pair: [first; 2], fraction: 0.0 };
    }
    let (before, after) = (time(first), time(low));
    Between { pair: [first, low], fraction: ((seconds - before) / (after - before)) as f32 }
}
