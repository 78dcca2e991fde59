//! The time of day: flowing, paused, stepped, scrubbed, and the exposure that goes with it.
//!
//! "TimeLapseNavigator" of the paper's section 6: it holds the lapse's attributes and hands those of the moment to the shaders.

pub mod exposure;

use crate::stage::frame::StageFrame;
use bevy::prelude::*;
use exposure::Exposure;
use glam::Vec3;
pub use heliodon_bundle::moment::Blend;
use heliodon_bundle::moment::{Day, Moment};
use heliodon_sky::lapse::Lapse;
use std::sync::Arc;

/// How long the whole lapse takes at speed 1, unless set otherwise: the paper's "more or less 30 s".
pub const DEFAULT_DAY_SECONDS: f32 = 30.0;

/// The controller of the day. Set its fields, or call its methods; the stage follows in the same frame.
#[derive(Resource, Clone, Debug)]
pub struct TimeLapse {
    /// Local time of day in seconds after midnight; kept within the lapse.
    pub clock_s: f64,
    /// Whether time flows.
    pub playing: bool,
    /// Seconds that the whole lapse takes at speed 1.
    pub day_seconds: f32,
    /// Multiplies the flow; negative runs backwards.
    pub speed: f32,
    /// Whether the day begins again at its end, or stops there.
    pub looping: bool,
    /// How the steps are joined.
    pub blend: Blend,
    /// First and last local time of the lapse.
    span_s: (f64, f64),
    day: Option<Arc<Day<Lapse>>>,
    entries_s: Vec<f64>,
    sun_up_s: Option<(f64, f64)>,
    jumped: bool,
}

impl Default for TimeLapse {
    fn default() -> Self {
        Self {
            clock_s: 0.0,
            playing: true,
            day_seconds: DEFAULT_DAY_SECONDS,
            speed: 1.0,
            looping: true,
            blend: Blend::Smooth,
            span_s: (0.0, 0.0),
            day: None,
            entries_s: Vec::new(),
            sun_up_s: None,
            jumped: true,
        }
    }
}

impl TimeLapse {
    /// Starts at the first moment of another lapse.
    pub(crate) fn begin(&mut self, lapse: Option<&Lapse>) {
        (self.day, self.entries_s, self.span_s, self.sun_up_s) = (None, Vec::new(), (0.0, 0.0), None);
        if let Some(lapse) = lapse {
            let day = Day::new(lapse.clone());
            self.entries_s = day.entry_seconds().to_vec();
            self.span_s = day.span_seconds();
            let up = |i: &usize| lapse.steps[*i].sun.is_some_and(|sun| sun.direction[1] > 0.0);
            let first = (0..lapse.steps.len()).find(up);
            let last = (0..lapse.steps.len()).rfind(up);
            self.sun_up_s = first.zip(last).map(|(first, last)| (self.entries_s[first], self.entries_s[last]));
            self.day = Some(Arc::new(day));
        }
        self.scrub(self.span_s.0);
    }

    /// First and last local time of the lapse, in seconds after midnight.
    #[must_use]
    pub fn span_s(&self) -> (f64, f64) {
        self.span_s
    }

    /// When the lapse first and last has the sun above the horizon.
    #[must_use]
    pub fn sun_up_s(&self) -> Option<(f64, f64)> {
        self.sun_up_s
    }

    /// Where in the lapse the time is, 0 to 1.
    #[must_use]
    pub fn fraction(&self) -> f64 {
        let (first, last) = self.span_s;
        if last > first { ((self.clock_s - first) / (last - first)).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// Lets time flow, or pauses it. Where it stopped at the end of a day that does not begin again, the day begins anew.
    pub fn toggle_playing(&mut self) {
        self.playing = !self.playing;
        let (first, last) = self.span_s;
        let (start, end) = if self.speed < 0.0 { (last, first) } else { (first, last) };
        if self.playing && !self.looping && self.clock_s == end {
            self.scrub(start);
        }
    }

    /// Goes to a local time. The exposure follows at once.
    pub fn scrub(&mut self, clock_s: f64) {
        self.clock_s = clock_s.clamp(self.span_s.0, self.span_s.1);
        self.jumped = true;
    }

    /// Goes `count` lapse steps on, or back, and pauses: first to the step where the time is, if it is between two.
    pub fn step(&mut self, count: i64) {
        self.playing = false;
        if self.entries_s.is_empty() {
            return;
        }
        // A moment that differs from a step by rounding is the step's.
        const SAME_S: f64 = 1e-3;
        let at_or_before = self.entries_s.partition_point(|&s| s <= self.clock_s + SAME_S).max(1) - 1;
        let exact = (self.entries_s[at_or_before] - self.clock_s).abs() <= SAME_S;
        let base = if count < 0 && !exact { at_or_before as i64 + 1 } else { at_or_before as i64 };
        let target = (base + count).clamp(0, self.entries_s.len() as i64 - 1);
        self.scrub(self.entries_s[target as usize]);
    }

    /// Lets time flow for `seconds`.
    fn flow(&mut self, seconds: f64) {
        let (first, last) = self.span_s;
        if !self.playing || last <= first {
            return;
        }
        let length = last - first;
        let next = self.clock_s + seconds * length * f64::from(self.speed) / f64::from(self.day_seconds.max(0.1));
        if (first..=last).contains(&next) {
            self.clock_s = next;
        } else if self.looping {
            self.clock_s = first + (next - first).rem_euclid(length);
            self.jumped = true;
        } else {
            self.clock_s = next.clamp(first, last);
            self.playing = false;
        }
    }
}

/// The moment that is shown, for whoever wants to know it.
#[derive(Resource, Clone, Debug, Default)]
pub struct Now {
    /// The moment, once a bundle is open; another one where it is another pointer.
    pub moment: Option<Arc<Moment>>,
    /// Whether the sun is somewhere: its direction counts only then.
    pub has_sun: bool,
}

/// Lets the day pass.
#[derive(Default)]
pub struct TimeLapsePlugin;

/// The systems that settle the frame's moment; what reads [`Now`] in `Update` runs after it.
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub struct SettleMoment;

impl Plugin for TimeLapsePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<TimeLapse>()
            .init_resource::<Exposure>()
            .init_resource::<Now>()
            .add_systems(PostUpdate, settle.in_set(SettleMoment));
    }
}

/// What the moment was worked out from.
type Settled = (f64, Blend, Arc<Day<Lapse>>);

/// Lets time flow and works out the moment. What stays as it is is not marked as changed, so that nobody works for nothing.
fn settle(
    time: Res<Time>,
    mut lapse: ResMut<TimeLapse>,
    mut exposure: ResMut<Exposure>,
    mut now: ResMut<Now>,
    mut frame: ResMut<StageFrame>,
    mut settled: Local<Option<Settled>>,
) {
    let flowing = lapse.bypass_change_detection();
    let Some(day) = flowing.day.clone() else {
        *settled = None;
        if frame.moment.is_some() {
            *now = Now::default();
            frame.moment = None;
        }
        return;
    };
    let seconds = time.delta_secs();
    let before = (flowing.clock_s, flowing.playing);
    flowing.flow(f64::from(seconds));
    let flowed = before != (flowing.clock_s, flowing.playing);
    let jumped = std::mem::take(&mut flowing.jumped);
    if flowed {
        lapse.set_changed();
    }
    let same = |(clock_s, blend, of): &Settled| *clock_s == lapse.clock_s && *blend == lapse.blend && Arc::ptr_eq(of, &day);
    let moment = match &now.moment {
        Some(moment) if settled.as_ref().is_some_and(same) => Arc::clone(moment),
        _ => {
            let moment = Arc::new(day.at(lapse.clock_s, lapse.blend));
            *settled = Some((lapse.clock_s, lapse.blend, Arc::clone(&day)));
            *now = Now { has_sun: moment.sun_irradiance != Vec3::ZERO, moment: Some(Arc::clone(&moment)) };
            frame.sky.sun_direction = moment.sun_direction;
            frame.sky.disc_radiance = disc_radiance(&day, &moment);
            frame.moment = Some(Arc::clone(&moment));
            moment
        }
    };
    let mut followed = *exposure;
    followed.follow(moment.exposure_stops, if jumped { f32::INFINITY } else { seconds });
    exposure.set_if_neq(followed);
    if frame.exposure_stops != exposure.stops() {
        frame.exposure_stops = exposure.stops();
    }
}

/// Radiance of the sun's disc, by its share of the maps that leave it out.
fn disc_radiance(day: &Day<Lapse>, moment: &Moment) -> Vec3 {
    let [a, b] = moment.entries;
    let share = moment.entry_fraction;
    let left_out: f32 = [(a, 1.0 - share), (b, share)]
        .into_iter()
        .filter(|&(entry, _)| !day.lapse().steps[entry].sun_in_map)
        .map(|(_, weight)| weight)
        .sum();
    moment.sun_irradiance * (left_out / crate::sky::sun_solid_angle())
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use heliodon_sky::lapse::LapseStep;

    /// Nine hundred seconds with ten steps.
    pub(crate) fn lapse() -> TimeLapse {
        TimeLapse { entries_s: (0..10).map(|i| 100.0 * f64::from(i)).collect(), span_s: (0.0, 900.0), ..TimeLapse::default() }
    }

    #[test]
    fn a_day_takes_thirty_seconds_and_begins_again() {
        let mut lapse = lapse();
        lapse.flow(15.0);
        assert!((lapse.clock_s - 450.0).abs() < 1e-9);
        lapse.flow(16.0);
        assert!((lapse.clock_s - 30.0).abs() < 1e-9);
        lapse.looping = false;
        lapse.flow(100.0);
        assert!(lapse.clock_s == 900.0 && !lapse.playing);
    }

    #[test]
    fn steps_go_to_the_lapse_steps_and_stop_at_the_ends() {
        let mut lapse = lapse();
        lapse.scrub(250.0);
        lapse.step(-1);
        assert_eq!(lapse.clock_s, 200.0);
        lapse.step(1);
        assert_eq!(lapse.clock_s, 300.0);
        lapse.scrub(250.0);
        lapse.step(1);
        assert_eq!(lapse.clock_s, 300.0);
        lapse.step(-50);
        assert_eq!(lapse.clock_s, 0.0);
        assert!(!lapse.playing);
    }
    #[test]
    fn a_day_that_ended_begins_anew() {
        let mut lapse = lapse();
        lapse.looping = false;
        for (speed, start, end) in [(1.0, 0.0, 900.0), (-1.0, 900.0, 0.0)] {
            lapse.speed = speed;
            lapse.scrub(end);
            lapse.playing = false;
            lapse.toggle_playing();
            assert!(lapse.playing && lapse.clock_s == start, "{speed}");
            lapse.scrub(450.0);
            lapse.toggle_playing();
            lapse.toggle_playing();
            assert!(lapse.playing && lapse.clock_s == 450.0, "{speed}");
        }
    }

    fn day() -> Lapse {
        let step = |hour: u32| LapseStep {
            time: format!("{hour:02}:00"),
            sun: None,
            sky: vec![[hour as f32; 3]; 4],
            fitted: None,
            exposure_stops: 1.0,
            sky_map: String::new(),
            mask_bit: 0,
            sun_in_map: false,
        };
        Lapse { steps: vec![step(8), step(9), step(10)], sun_bounce_basis: None }
    }

    #[test]
    fn what_rests_is_not_marked_as_changed() {
        #[derive(Resource, Default, PartialEq, Debug)]
        struct Seen([bool; 4]);
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, TimeLapsePlugin)).init_resource::<StageFrame>().init_resource::<Seen>();
        app.insert_resource(bevy::time::TimeUpdateStrategy::ManualDuration(std::time::Duration::from_millis(20)));
        app.add_systems(
            Last,
            |lapse: Res<TimeLapse>, now: Res<Now>, exposure: Res<Exposure>, frame: Res<StageFrame>, mut seen: ResMut<Seen>| {
                *seen = Seen([lapse.is_changed(), now.is_changed(), exposure.is_changed(), frame.is_changed()]);
            },
        );
        app.world_mut().resource_mut::<TimeLapse>().begin(Some(&day()));
        for _ in 0..3 {
            app.update();
        }
        assert_eq!(*app.world().resource::<Seen>(), Seen([true, true, false, true]), "the day passes");
        let moment = app.world().resource::<Now>().moment.clone();
        app.world_mut().resource_mut::<TimeLapse>().playing = false;
        for _ in 0..3 {
            app.update();
        }
        assert_eq!(*app.world().resource::<Seen>(), Seen([false; 4]), "nothing happens");
        app.world_mut().resource_mut::<TimeLapse>().scrub(9.5 * 3600.0);
        app.update();
        assert_eq!(*app.world().resource::<Seen>(), Seen([true, true, false, true]));
        let scrubbed = app.world().resource::<Now>().moment.clone();
        assert!(moment != scrubbed && scrubbed.is_some_and(|moment| moment.sky[0] == Vec3::splat(9.5)));
    }
}
