//! What each feature takes of the processor in a frame.
//!
//! Systems are timed from outside, by what [`FrameTold::of`] puts around them where a plugin adds them, in the world of the app and in that of the renderer alike. Sets that are timed by
//! one system before and one after them would count whatever else runs meanwhile on another core; a clock within each system would stand in every one of them. What is told is the time
//! within systems: where several run at once, features together may take longer than the frame.

use bevy::app::{App, First};
use bevy::ecs::system::{Adapt, IntoAdapterSystem, RunSystemError, System, SystemIn, SystemInput};
use bevy::prelude::{Res, Resource};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// How much of a new frame goes into the smoothed time: half of it is of the last 14 frames.
const NEWER: f32 = 0.05;
/// What is left of the longest of the last frames, a frame later: half after 35.
const FADES: f32 = 0.98;

/// What a feature takes in a frame, milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Smoothed, for eyes.
    pub smoothed_ms: f32,
    /// The longest of the last frames.
    pub peak_ms: f32,
    /// The mean since [`FrameTold::begin`].
    pub mean_ms: f32,
    /// The most since then.
    pub most_ms: f32,
}

/// What every feature takes of the processor in a frame. Clones tell of the same.
#[derive(Resource, Clone, Debug, Default)]
pub struct FrameTold(Arc<Mutex<Tally>>);

#[derive(Debug, Default)]
struct Tally {
    /// Frames since it began.
    frames: u32,
    features: Vec<Feature>,
}

#[derive(Debug)]
struct Feature {
    name: &'static str,
    /// Of the frame under way.
    now: Duration,
    /// Since it began.
    all: Duration,
    cost: Cost,
}

impl FrameTold {
    /// The one of an app, whose frames are counted from now on if they were not.
    pub(crate) fn in_app(app: &mut App) -> Self {
        if let Some(told) = app.world().get_resource::<Self>() {
            return told.clone();
        }
        let told = Self::default();
        app.insert_resource(told.clone()).add_systems(First, |told: Res<FrameTold>| told.settle());
        told
    }

    /// A system whose time is the feature's.
    pub fn of<S>(&self, feature: &'static str, system: S) -> IntoAdapterSystem<Timed, S> {
        let mut tally = self.tally();
        let known = tally.features.iter().position(|known| known.name == feature);
        let feature = known.unwrap_or_else(|| {
            let cost = Cost::default();
            tally.features.push(Feature { name: feature, now: Duration::ZERO, all: Duration::ZERO, cost });
            tally.features.len() - 1
        });
        IntoAdapterSystem::new(Timed { told: self.clone(), feature }, system)
    }

    /// The features and what they take, in the order in which they came.
    #[must_use]
    pub fn costs(&self) -> Vec<(&'static str, Cost)> {
        self.tally().features.iter().map(|feature| (feature.name, feature.cost)).collect()
    }

    /// Means and greatest times are of what comes from now on.
    pub fn begin(&self) {
        let mut tally = self.tally();
        tally.frames = 0;
        for feature in &mut tally.features {
            (feature.now, feature.all) = (Duration::ZERO, Duration::ZERO);
            (feature.cost.mean_ms, feature.cost.most_ms) = (0.0, 0.0);
        }
    }

    /// A frame is over.
    fn settle(&self) {
        let mut tally = self.tally();
        tally.frames += 1;
        let frames = tally.frames;
        for feature in &mut tally.features {
            let now = std::mem::take(&mut feature.now);
            feature.all += now;
            let (ms, cost) = (now.as_secs_f32() * 1e3, &mut feature.cost);
            cost.smoothed_ms += (ms - cost.smoothed_ms) * NEWER;
            cost.peak_ms = ms.max(cost.peak_ms * FADES);
            cost.mean_ms = feature.all.as_secs_f32() * 1e3 / frames as f32;
            cost.most_ms = cost.most_ms.max(ms);
        }
    }

    fn tally(&self) -> MutexGuard<'_, Tally> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Times a system: made by [`FrameTold::of`].
#[derive(Clone, Debug)]
pub struct Timed {
    told: FrameTold,
    feature: usize,
}

impl<S: System> Adapt<S> for Timed {
    type In = S::In;
    type Out = S::Out;

    fn adapt(
        &mut self,
        input: <Self::In as SystemInput>::Inner<'_>,
        run_system: impl FnOnce(SystemIn<'_, S>) -> Result<S::Out, RunSystemError>,
    ) -> Result<Self::Out, RunSystemError> {
        let begun = Instant::now();
        let done = run_system(input);
        let took = begun.elapsed();
        if let Some(feature) = self.told.tally().features.get_mut(self.feature) {
            feature.now += took;
        }
        done
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::prelude::{IntoScheduleConfigs, ResMut, Update};

    #[derive(Resource, Default)]
    struct Order(Vec<&'static str>);

    fn slow(mut order: ResMut<Order>) {
        order.0.push("slow");
        std::thread::sleep(Duration::from_millis(3));
    }

    fn quick(mut order: ResMut<Order>) {
        order.0.push("quick");
    }

    #[test]
    fn a_features_systems_are_timed_together_and_stay_where_they_are() {
        let mut app = App::new();
        let told = FrameTold::in_app(&mut app);
        // what is timed is still found by whoever names the system itself
        app.init_resource::<Order>().add_systems(Update, told.of("slow", slow).after(quick)).add_systems(
            Update,
            (told.of("quick", quick), told.of("slow", || std::thread::sleep(Duration::from_millis(2)))).chain(),
        );
        (0..4).for_each(|_| app.update());
        told.settle();
        let costs = FrameTold::in_app(&mut app).costs();
        assert_eq!(costs.iter().map(|(name, _)| *name).collect::<Vec<_>>(), ["slow", "quick"]);
        let [(_, slow), (_, quick)] = costs[..] else { panic!("{costs:?}") };
        assert!(slow.most_ms >= 5.0 && slow.smoothed_ms > 0.2 && slow.smoothed_ms < slow.peak_ms, "{slow:?}");
        // a frame that was none is in the mean
        assert!(slow.mean_ms >= 4.0 && slow.mean_ms < slow.most_ms && quick.mean_ms < slow.mean_ms, "{slow:?} {quick:?}");
        assert_eq!(app.world().resource::<Order>().0[..2], ["quick", "slow"]);
        told.begin();
        told.settle();
        let (_, after) = told.costs()[0];
        assert!(after.mean_ms == 0.0 && after.most_ms == 0.0 && after.peak_ms > 0.0, "{after:?}");
    }
}
