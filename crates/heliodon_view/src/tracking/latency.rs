//! How long it takes from a tracker's report to the picture that shows it.

use super::Trackers;
use bevy::prelude::*;
use bevy::render::extract_resource::{ExtractResource, ExtractResourcePlugin};
use bevy::render::{Render, RenderApp, RenderSystems};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Frames whose median is told.
const FRAMES: usize = 120;

/// Times that are reckoned from seconds differ by less where they are of one report.
const SAME: Duration = Duration::from_micros(10);

/// When the newest report that a frame uses arrived.
#[derive(Resource, ExtractResource, Clone, Copy, Debug, Default)]
pub(super) struct Newest(Option<Instant>);

/// From the arrival of the newest report that a frame uses to when its picture is handed to the system: over the last frames. What monitors and projectors
/// add is not in it.
#[derive(Resource, Clone, Debug, Default)]
pub struct PictureLatency(Arc<Mutex<VecDeque<Duration>>>);

impl PictureLatency {
    /// The median over the last frames that had a report, milliseconds.
    #[must_use]
    pub fn median_ms(&self) -> Option<f64> {
        let mut last: Vec<Duration> = self.0.lock().unwrap_or_else(PoisonError::into_inner).iter().copied().collect();
        last.sort_unstable();
        last.get(last.len() / 2).map(|latency| latency.as_secs_f64() * 1e3)
    }

    fn add(&self, latency: Duration) {
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if last.len() == FRAMES {
            last.pop_front();
        }
        last.push_back(latency);
    }
}

/// Measures.
pub(super) struct LatencyPlugin;

impl Plugin for LatencyPlugin {
    fn build(&self, app: &mut App) {
        let latency = PictureLatency::default();
        app.init_resource::<Newest>().insert_resource(latency.clone());
        app.add_systems(Last, note.run_if(resource_exists::<Trackers>));
        if app.get_sub_app(RenderApp).is_some() {
            app.add_plugins(ExtractResourcePlugin::<Newest>::default());
            app.sub_app_mut(RenderApp).insert_resource(latency).add_systems(Render, measure.in_set(RenderSystems::Cleanup));
        }
    }
}

/// Reports are taken once a frame, and none comes while it is made.
fn note(trackers: Res<Trackers>, mut newest: ResMut<Newest>) {
    newest.0 = trackers.newest();
}

/// A report that two frames use counts for the first: for the second nothing came.
fn measure(newest: Option<Res<Newest>>, latency: Res<PictureLatency>, mut before: Local<Option<Instant>>) {
    let newest = newest.and_then(|newest| newest.0);
    let is_new = |arrived: &Instant| before.is_none_or(|before| arrived.saturating_duration_since(before) > SAME);
    if let Some(arrived) = newest.filter(is_new) {
        latency.add(arrived.elapsed());
    }
    *before = newest;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_the_last_frames_is_told() {
        let latency = PictureLatency::default();
        assert_eq!(latency.median_ms(), None);
        for ms in [10, 500, 30] {
            latency.add(Duration::from_millis(ms));
        }
        assert_eq!(latency.median_ms(), Some(30.0));
        for _ in 0..FRAMES {
            latency.add(Duration::from_millis(20));
        }
        assert_eq!(latency.median_ms(), Some(20.0));
        assert_eq!(latency.0.lock().unwrap().len(), FRAMES);
    }
}
