//! Settings and reports in, poses out: what a viewer asks once a frame.

mod followed;
mod statistics;

pub use crate::filter::State;
pub use statistics::Statistics;

use crate::filter::FilterSettings;
use crate::pose::{Pose, Velocity};
use crate::report::{AXES, Heard, Malformed, Report};
use crate::settings::{Settings, SettingsError};
use crate::{dtrack, osc};
use followed::Followed;
use serde::{Deserialize, Serialize};

/// How far a datagram of DTrack may be behind the last one to have been overtaken by it; one further behind is of a controller
/// that was started anew.
const OVERTAKEN_FRAMES: u32 = 30;

/// The language of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Protocol {
    /// Open Sound Control, see [`osc`].
    Osc,
    /// A.R.T. DTrack, see [`dtrack`].
    Dtrack,
}

/// Follows the bodies of its settings.
///
/// Times are seconds of one clock of the caller's that never goes back, such as those since the program began; the tracker's
/// own clocks are not looked at. Where the caller's clock does go back, bodies are eased into what is reported then.
#[derive(Clone, Debug)]
pub struct Follower {
    settings: Settings,
    bodies: Vec<Followed>,
    statistics: Statistics,
    last_frame: Option<u32>,
    /// Reports of the packet at hand.
    reports: Vec<Report>,
}

impl Follower {
    /// A follower that has heard nothing yet.
    ///
    /// # Errors
    ///
    /// Where the settings are not [valid](Settings::validate).
    pub fn new(settings: Settings) -> Result<Self, SettingsError> {
        settings.validate()?;
        let of = |filter: Option<FilterSettings>| Followed::new(filter.unwrap_or(settings.filter));
        let bodies = settings.bodies.iter().map(|body| of(body.filter)).collect();
        let statistics = Statistics::default();
        Ok(Self { settings, bodies, statistics, last_frame: None, reports: Vec::new() })
    }

    /// The settings that it was made with.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The index of the body with a name.
    #[must_use]
    pub fn body(&self, name: &str) -> Option<usize> {
        self.settings.bodies.iter().position(|body| body.name == name)
    }

    /// Takes a packet that arrived at a time.
    ///
    /// # Errors
    ///
    /// Where the packet is malformed; it is counted, and nothing of it is used. Who only watches the statistics may pass over
    /// it.
    pub fn packet(&mut self, protocol: Protocol, packet: &[u8], arrival_s: f64) -> Result<(), Malformed> {
        self.statistics.packets += 1;
        let mut reports = std::mem::take(&mut self.reports);
        reports.clear();
        let bodies = &self.settings.bodies;
        let heard = match protocol {
            Protocol::Osc => osc::parse(packet, bodies, arrival_s, &mut reports),
            Protocol::Dtrack => dtrack::parse(packet, bodies, arrival_s, &mut reports),
        };
        match heard {
            Ok(heard) if self.is_overtaken(&heard) => self.statistics.overtaken += 1,
            Ok(heard) => {
                self.statistics.ignored += heard.ignored;
                reports.iter().for_each(|report| self.report(report));
            }
            Err(malformed) => {
                self.statistics.malformed += 1;
                self.statistics.last_malformed = Some(malformed);
            }
        }
        self.reports = reports;
        heard.map(|_| ())
    }

    /// Whether a later frame has been heard; if not, this is the last.
    fn is_overtaken(&mut self, heard: &Heard) -> bool {
        let Some(frame) = heard.frame else { return false };
        let behind = self.last_frame.map_or(0, |last| last.wrapping_sub(frame));
        let overtaken = (1..=OVERTAKEN_FRAMES).contains(&behind);
        if !overtaken {
            self.last_frame = Some(frame);
        }
        overtaken
    }

    /// Takes a report, of a packet or of anything else that knows where bodies are: in the tracker's coordinates. One of a body
    /// that is not in the settings is ignored; what cannot be is counted and not used.
    pub fn report(&mut self, report: &Report) {
        let Some(followed) = self.bodies.get_mut(report.body) else {
            self.statistics.ignored += 1;
            return;
        };
        let target_from_body = self.settings.bodies[report.body].target_from_body;
        followed.hear(report, &self.settings.calibration, target_from_body, &mut self.statistics);
    }

    /// `room_from_body` of a body, by its index in the settings, at a time; nothing where it was never seen or there is none.
    /// Finite whatever was reported and whatever the time is; a question about the past is one about the last report.
    #[must_use]
    pub fn pose(&self, body: usize, now_s: f64) -> Option<Pose> {
        self.bodies.get(body)?.motion.pose(now_s)
    }

    /// How a body moves at a time; at rest where nothing is known.
    #[must_use]
    pub fn velocity(&self, body: usize, now_s: f64) -> Velocity {
        self.bodies.get(body).map_or_else(Velocity::default, |followed| followed.motion.velocity(now_s))
    }

    /// Whether a body is seen at a time.
    #[must_use]
    pub fn state(&self, body: usize, now_s: f64) -> State {
        self.bodies.get(body).map_or(State::Never, |followed| followed.motion.state(now_s))
    }

    /// The buttons of a body that are held down, bit n for button n; none of a body with poses that has been silent for a
    /// second.
    #[must_use]
    pub fn buttons(&self, body: usize, now_s: f64) -> u32 {
        self.bodies.get(body).filter(|followed| followed.has_controls(now_s)).map_or(0, |followed| followed.buttons)
    }

    /// The axes of a body, as the tracker told them, finite; 0 where none is told, and of a body with poses that has been
    /// silent for a second.
    #[must_use]
    pub fn axes(&self, body: usize, now_s: f64) -> [f32; AXES] {
        self.bodies.get(body).filter(|followed| followed.has_controls(now_s)).map_or([0.0; AXES], |followed| followed.axes)
    }

    /// What has been heard, with how old the newest pose is at a time.
    #[must_use]
    pub fn statistics(&self, now_s: f64) -> Statistics {
        let newest = self.bodies.iter().filter_map(|followed| followed.motion.seen_s()).max_by(f64::total_cmp);
        Statistics { latency_s: newest.map(|seen_s| (now_s - seen_s).max(0.0)), ..self.statistics }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::{Axes, Calibration};
    use crate::report::{Buttons, Sight};
    use crate::rotation;
    use crate::settings::{Body, DtrackTarget};
    use glam::{Quat, Vec3};

    fn follower() -> Follower {
        let bodies =
            vec![Body::osc("head", "/head"), Body { dtrack: Some(DtrackTarget::Flystick(0)), ..Body::osc("wand", "/wand") }];
        Follower::new(Settings { bodies, filter: FilterSettings::unfiltered(), ..Settings::default() }).unwrap()
    }

    fn close(pose: Option<Pose>, position: Vec3) -> bool {
        pose.is_some_and(|pose| (pose.position - position).length() < 1e-4)
    }

    const SOMEWHERE: Pose = Pose { position: Vec3::new(0.2, 1.7, -0.5), orientation: Quat::IDENTITY };

    #[test]
    fn packets_of_both_languages_arrive() {
        let mut follower = follower();
        follower.packet(Protocol::Osc, &osc::pose_packet("/head", &SOMEWHERE), 1.0).unwrap();
        let stick = dtrack::FlystickState { pose: Some(SOMEWHERE), buttons: 5, axes: vec![0.5] };
        let datagram = dtrack::packet(1, &[(3, Some(SOMEWHERE))], &[stick]);
        follower.packet(Protocol::Dtrack, datagram.as_bytes(), 1.0).unwrap();
        assert!(close(follower.pose(0, 1.0), SOMEWHERE.position) && close(follower.pose(1, 1.0), SOMEWHERE.position));
        assert_eq!((follower.buttons(1, 1.0), follower.axes(1, 1.0)[0]), (5, 0.5));
        assert_eq!((follower.body("wand"), follower.body("foot"), follower.pose(2, 1.0)), (Some(1), None, None));
        let fault = follower.packet(Protocol::Osc, b"/head", 1.0).unwrap_err();
        let expected = Statistics {
            packets: 3,
            malformed: 1,
            last_malformed: Some(fault),
            ignored: 1,
            latency_s: Some(0.5),
            ..Statistics::default()
        };
        assert_eq!(follower.statistics(1.5), expected);
    }

    #[test]
    fn targets_are_calibrated_and_bodies_stand_off_them() {
        let calibration = Calibration { axes: Axes::Z_UP, translation: Vec3::Y, ..Calibration::default() };
        let target_from_body = Pose { position: Vec3::new(0.0, -0.1, 0.0), ..Pose::IDENTITY };
        let bodies = vec![Body { target_from_body, ..Body::osc("head", "/head") }];
        let settings = Settings { bodies, calibration, filter: FilterSettings::unfiltered() };
        let mut follower = Follower::new(settings).unwrap();
        // two metres ahead of a tracker whose Z is up, a quarter turn to the left, tilted onto the left ear: down is right
        let left = rotation::from_vector(Vec3::Z * std::f32::consts::FRAC_PI_2);
        let tilted = left * rotation::from_vector(Vec3::Y * -std::f32::consts::FRAC_PI_2);
        let seen = Pose { position: Vec3::new(0.0, 2.0, 0.0), orientation: tilted };
        follower.report(&Report::of(0, 0.0).with_sight(Sight::Pose(seen)));
        let head = follower.pose(0, 0.0).unwrap();
        let forwards = head.orientation * Vec3::NEG_Z;
        assert!((forwards - Vec3::NEG_X).length() < 1e-5, "{forwards}");
        let up = head.orientation * Vec3::Y;
        assert!((head.position - (Vec3::new(0.0, 1.0, -2.0) - up * 0.1)).length() < 1e-5, "{head:?}");
        assert!(up.y.abs() < 1e-5 && (up.cross(forwards).y.abs() - 1.0).abs() < 1e-5, "{up}");
    }

    #[test]
    fn a_position_alone_keeps_the_orientation() {
        let mut follower = follower();
        let sight = |sight, at| Report::of(0, at).with_sight(sight);
        follower.report(&sight(Sight::Position(Vec3::X), 0.0));
        assert_eq!(follower.pose(0, 0.0).map(|pose| pose.orientation), Some(Quat::IDENTITY));
        let turned = Pose { position: Vec3::X, orientation: rotation::from_vector(Vec3::Y) };
        follower.report(&sight(Sight::Pose(turned), 0.01));
        follower.report(&sight(Sight::Position(Vec3::X * 1.01), 0.02));
        let pose = follower.pose(0, 0.02).unwrap();
        assert!((rotation::to_vector(pose.orientation) - Vec3::Y).length() < 1e-3);
    }

    #[test]
    fn what_cannot_be_is_counted_and_not_used() {
        let mut follower = follower();
        follower.report(&Report::of(0, 0.0).with_sight(Sight::Pose(SOMEWHERE)));
        let poses = [
            Pose { position: Vec3::NAN, ..SOMEWHERE },
            Pose { position: Vec3::X * 1001.0, ..SOMEWHERE },
            Pose { position: Vec3::X * f32::MAX, ..SOMEWHERE },
            Pose { orientation: Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), ..SOMEWHERE },
            Pose { orientation: Quat::from_xyzw(f32::INFINITY, 0.0, 0.0, 0.0), ..SOMEWHERE },
        ];
        for pose in poses {
            follower.report(&Report::of(0, 0.01).with_sight(Sight::Pose(pose)));
        }
        follower.report(&Report::of(0, f64::NAN).with_sight(Sight::Pose(SOMEWHERE)));
        follower.report(&Report { axes: [Some(f32::NAN); AXES], ..Report::of(0, 0.01) });
        assert_eq!(follower.statistics(0.0).invalid, 6 + AXES as u64);
        assert!(close(follower.pose(0, 0.01), SOMEWHERE.position));
        follower.report(&Report::of(0, 0.01).with_sight(Sight::Position(Vec3::X * 500.0)));
        follower.report(&Report::of(7, 0.01));
        assert_eq!((follower.statistics(0.0).refused_jumps, follower.statistics(0.0).ignored), (1, 1));
    }

    #[test]
    fn frames_that_were_overtaken_are_dropped() {
        let mut follower = follower();
        let mut sent = |frame, x, at| {
            let stick = dtrack::FlystickState { pose: Some(Pose { position: Vec3::X * x, ..SOMEWHERE }), ..Default::default() };
            follower.packet(Protocol::Dtrack, dtrack::packet(frame, &[], &[stick]).as_bytes(), at).unwrap();
            (follower.pose(1, 0.0).unwrap().position.x * 1000.0).round()
        };
        assert_eq!([sent(100, 0.1, 0.0), sent(102, 0.12, 0.02), sent(101, 0.11, 0.03)], [100.0, 120.0, 120.0]);
        assert_eq!(sent(1, 0.13, 0.04), 130.0, "a controller that was started anew");
        assert_eq!(follower.statistics(0.0).overtaken, 1);
    }

    #[test]
    fn buttons_of_a_silent_wand_are_released() {
        let mut follower = follower();
        let held = Report::of(1, 0.0).with_buttons(Buttons::all(1));
        follower.report(&held);
        assert_eq!(follower.buttons(1, 100.0), 1, "buttons without poses are told when they change");
        follower.report(&held.with_sight(Sight::Pose(SOMEWHERE)));
        follower.report(&Report { arrival_s: 5.0, ..held.with_sight(Sight::Lost) });
        assert_eq!((follower.buttons(1, 6.0), follower.buttons(1, 6.1)), (1, 0), "a lost one's radio still works");
        assert_eq!(follower.state(1, 5.0), State::Lost { for_s: 5.0 });
        assert_eq!((follower.state(0, 5.0), follower.state(9, 5.0)), (State::Never, State::Never));
    }
}
