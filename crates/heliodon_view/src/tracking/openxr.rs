//! A room's bodies from an OpenXR runtime, which may come late, go, and come back.

use crate::xr::tracker::{XrTracker, XrTrackerError};
use bevy::prelude::*;
use heliodon_bundle::display::{BodyKind, TrackerEntry};
use heliodon_track::report::Report;
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;

/// How long a runtime that is not there is left alone.
const RETRY_S: f64 = 5.0;

/// A runtime, and the paths of the bodies.
pub(super) struct Runtime {
    paths: Vec<String>,
    tracker: Option<XrTracker>,
    /// The looking for it, which may take as long as a service takes to start: never in a frame.
    search: Mutex<Option<JoinHandle<Result<XrTracker, XrTrackerError>>>>,
    retry_at_s: f64,
}

impl Runtime {
    /// Finds the runtime. One that does not answer yet is looked for again while there are frames.
    pub(super) fn open(entry: &TrackerEntry) -> Result<Self, XrTrackerError> {
        let usual = |kind| match kind {
            BodyKind::Head => "/user/head",
            BodyKind::Wand => "/user/hand/right",
            BodyKind::LeftHand => "/user/hand/left",
        };
        let path = |(address, kind): (&Option<String>, BodyKind)| address.clone().unwrap_or_else(|| usual(kind).to_owned());
        let paths: Vec<String> = entry.bodies.iter().map(|body| path((&body.address, body.is))).collect();
        let tracker = match XrTracker::open(&paths) {
            Ok(tracker) => Some(tracker),
            Err(why) if why.may_pass() => {
                warn!("tracker `{}`: {why}; it is looked for again", entry.name);
                None
            }
            Err(why) => return Err(why),
        };
        Ok(Self { paths, tracker, search: Mutex::default(), retry_at_s: RETRY_S })
    }

    /// What it sees. One that breaks off is told, and looked for again every few seconds.
    pub(super) fn reports(&mut self, name: &str, now_s: f64, reports: &mut Vec<Report>) {
        let search = self.search.get_mut().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = search.take_if(|search| search.is_finished()).map(JoinHandle::join)
            && let Ok(Ok(tracker)) = found
        {
            warn!("tracker `{name}` is there");
            self.tracker = Some(tracker);
        }
        if self.tracker.is_none() && search.is_none() && now_s >= self.retry_at_s {
            self.retry_at_s = now_s + RETRY_S;
            let paths = self.paths.clone();
            *search = Some(std::thread::spawn(move || XrTracker::open(&paths)));
        }
        if let Some(tracker) = &mut self.tracker
            && let Err(why) = tracker.reports(now_s, reports)
        {
            warn!("tracker `{name}`: {why}; it is looked for again");
            (self.tracker, self.retry_at_s) = (None, now_s + RETRY_S);
        }
    }
}
