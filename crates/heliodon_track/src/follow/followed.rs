//! One body that is followed: what it does with a report.

use super::Statistics;
use crate::calibration::Calibration;
use crate::filter::{FilterSettings, Motion, Taken};
use crate::pose::Pose;
use crate::report::{AXES, Report, Sight};
use glam::{Quat, Vec3};

/// After how long a silence a body's buttons are taken to be released and its axes to be at rest, seconds: whoever walks by a
/// wand whose battery dies should not walk on for ever. Only for bodies with poses, for those are reported all the time;
/// buttons alone are told when they change.
const CONTROLS_HELD_S: f64 = 1.0;

/// What is known of a body.
#[derive(Clone, Debug)]
pub(super) struct Followed {
    pub(super) motion: Motion,
    pub(super) buttons: u32,
    pub(super) axes: [f32; AXES],
    /// When anything was heard of it.
    heard_s: f64,
}

impl Followed {
    pub(super) fn new(filter: FilterSettings) -> Self {
        Self { motion: Motion::new(filter), buttons: 0, axes: [0.0; AXES], heard_s: f64::NEG_INFINITY }
    }

    /// Takes a report in the tracker's coordinates; counts what is not used.
    pub(super) fn hear(
        &mut self,
        report: &Report,
        room_from_tracker: &Calibration,
        target_from_body: Pose,
        statistics: &mut Statistics,
    ) {
        if !report.arrival_s.is_finite() {
            statistics.invalid += 1;
            return;
        }
        self.heard_s = report.arrival_s;
        if let Some(buttons) = report.buttons {
            self.buttons = buttons.after(self.buttons);
        }
        for (axis, told) in self.axes.iter_mut().zip(report.axes) {
            match told {
                Some(value) if value.is_finite() => *axis = value,
                Some(_) => statistics.invalid += 1,
                None => {}
            }
        }
        let room_from_target = match report.sight {
            Sight::Untold => return,
            Sight::Lost => return self.motion.lose(report.arrival_s),
            Sight::Pose(pose) => turned(&pose).map(|pose| room_from_tracker.pose(&pose)),
            Sight::Position(p_tracker) => {
                let room_from_body = self.motion.orientation().unwrap_or(Quat::IDENTITY);
                let orientation = room_from_body * target_from_body.orientation.conjugate();
                Some(Pose { position: room_from_tracker.point(p_tracker), orientation })
            }
        };
        let Some(room_from_body) = room_from_target.and_then(|pose| (pose * target_from_body).checked()) else {
            statistics.invalid += 1;
            return;
        };
        match self.motion.hear(&room_from_body, report.arrival_s) {
            Taken::Used => {}
            Taken::Refused => statistics.refused_jumps += 1,
            Taken::Overtaken => statistics.overtaken += 1,
        }
    }

    /// Whether its buttons and axes are still believed.
    pub(super) fn has_controls(&self, now_s: f64) -> bool {
        self.motion.seen_s().is_none() || now_s - self.heard_s <= CONTROLS_HELD_S
    }
}

/// The pose with a rotation of length one, whatever its unit of length; nothing where it has no rotation.
fn turned(pose: &Pose) -> Option<Pose> {
    Pose::new(Vec3::ZERO, pose.orientation).map(|turned| Pose { position: pose.position, ..turned })
}
