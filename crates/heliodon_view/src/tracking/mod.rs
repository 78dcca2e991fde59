//! Trackers: heads and hands of a [`Room`], followed by `heliodon_track`.
//!
//! What a tracker says is taken once a frame, as late as can be. A body that is lost rests gently where it was; a tracker that cannot
//! be listened to is told and left out.

mod latency;
#[cfg(feature = "xr")]
mod openxr;
mod simulated;

use crate::costs::FrameTold;
use crate::display::Room;
use crate::input::{InputSet, WandInput};
use crate::navigation::{MouseLook, Travel};
use bevy::prelude::*;
use heliodon_bundle::ConfigError;
use heliodon_bundle::display::{BodyKind, Display, Protocol, TrackerEntry};
use heliodon_track::calibration::{Axes, Calibration};
pub use heliodon_track::filter::State;
use heliodon_track::filter::{FilterSettings, OneEuro};
use heliodon_track::follow::{Follower, Protocol as Language, Statistics};
use heliodon_track::gesture::{FlickSettings, WandFlickDetector};
use heliodon_track::pose::Pose;
use heliodon_track::receiver::{Arrival, Receiver, ReceiverSettings};
use heliodon_track::recording::{Player, PoseRecording};
use heliodon_track::report::Report;
use heliodon_track::settings::{Body, DtrackTarget, Settings};
use latency::LatencyPlugin;
pub use latency::PictureLatency;
use std::time::{Duration, Instant};

/// Where a tracker's reports come from.
enum Source {
    Udp(Receiver, Language),
    Recording(Player),
    #[cfg(feature = "xr")]
    OpenXr(Box<openxr::Runtime>),
    /// Keyboard and mouse; where the head is, and its heading and pitch.
    Simulated(simulated::Head),
}

struct Tracker {
    name: String,
    source: Source,
    follower: Follower,
    bodies: Vec<BodyKind>,
    /// Whether each body's loss was told.
    told_lost: Vec<bool>,
}

impl Tracker {
    /// Whether its reports are made now, by somebody who moves.
    fn is_live(&self) -> bool {
        !matches!(self.source, Source::Simulated(_) | Source::Recording(_))
    }
}

/// The trackers of a room.
#[derive(Resource)]
pub struct Trackers {
    trackers: Vec<Tracker>,
    /// What could not be listened to, and why.
    faults: Vec<String>,
    /// What reports are dated by.
    start: Instant,
    /// Time as somebody else tells it, seconds: for films and visits that are played.
    clock_s: Option<f64>,
    arrivals: Vec<Arrival>,
    reports: Vec<Report>,
    flicks: WandFlickDetector,
}

/// Settings of a follower, as a display's tracker says.
fn settings(display: &Display, number: usize, entry: &TrackerEntry) -> Result<Settings, ConfigError> {
    let number = number.to_string();
    let at = |key: &'static str| ["tracker", number.as_str(), key];
    let axes: Axes = entry.axes.parse().map_err(|why| {
        let message = format!("`{}`: {why}", entry.axes);
        display.error_at(&at("axes"), message, "name the tracker's axes that are the room's x, y and z, such as \"x z -y\"")
    })?;
    let [x, y, z] = entry.rotate_deg.map(|degrees| degrees.to_radians() as f32);
    let rotation = Quat::from_rotation_z(z) * Quat::from_rotation_y(y) * Quat::from_rotation_x(x);
    let translation = Vec3::from(entry.translate.map(|v| v as f32));
    let usual = FilterSettings::default();
    let smooth = |beta: f64| OneEuro { min_cutoff_hz: entry.smoothing_hz as f32, beta: beta as f32, ..usual.position };
    let filter = match entry.protocol {
        // What was recorded or moved by hand is shown as it is.
        Protocol::Recording | Protocol::Simulated => FilterSettings::unfiltered(),
        Protocol::Osc | Protocol::Dtrack | Protocol::Openxr => {
            let (position, orientation) = match entry.smoothing_hz > 0.0 {
                true => (smooth(entry.smoothing_beta), smooth(entry.smoothing_beta / 3.0)),
                false => (OneEuro::OFF, OneEuro::OFF),
            };
            FilterSettings {
                position,
                orientation,
                prediction_s: (entry.prediction_ms / 1e3) as f32,
                lost_after_s: (entry.lost_after_ms / 1e3) as f32,
                ..usual
            }
        }
    };
    let bodies = entry.bodies.iter().map(|body| Body {
        name: body.is.name().to_owned(),
        address: body.address.clone(),
        dtrack: body.id.map(DtrackTarget::Body).or(body.flystick.map(DtrackTarget::Flystick)),
        target_from_body: Pose { position: Vec3::from(body.offset.map(|v| v as f32)), ..Pose::IDENTITY },
        ..Body::default()
    });
    Ok(Settings {
        bodies: bodies.collect(),
        calibration: Calibration { axes, scale: entry.scale as f32, rotation, translation },
        filter,
    })
}

impl Trackers {
    /// The trackers of a display. Those that cannot be listened to are left out; [`Self::faults`] tells why.
    ///
    /// # Errors
    /// If the display's file says something of a tracker that cannot be.
    pub fn new(display: &Display) -> Result<Self, ConfigError> {
        Self::of(display, |_| true)
    }

    /// Those trackers of a display that are recordings, for films.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn recordings(display: &Display) -> Result<Self, ConfigError> {
        Self::of(display, |protocol| protocol == Protocol::Recording)
    }

    fn of(display: &Display, wanted: impl Fn(Protocol) -> bool) -> Result<Self, ConfigError> {
        let (mut trackers, mut faults) = (Vec::new(), Vec::new());
        for (number, entry) in display.trackers.iter().enumerate().filter(|(_, entry)| wanted(entry.protocol)) {
            let path = number.to_string();
            let follower = Follower::new(settings(display, number, entry)?)
                .map_err(|why| display.error_at(&["tracker", &path], format!("{}: {}", why.key, why.message), why.remedy))?;
            let source = match entry.protocol {
                Protocol::Osc => listen(entry, Language::Osc),
                Protocol::Dtrack => listen(entry, Language::Dtrack),
                #[cfg(feature = "xr")]
                Protocol::Openxr => {
                    openxr::Runtime::open(entry).map(|runtime| Source::OpenXr(Box::new(runtime))).map_err(|why| why.to_string())
                }
                #[cfg(not(feature = "xr"))]
                Protocol::Openxr => Err("this program was built without OpenXR (feature headset)".to_owned()),
                Protocol::Recording => {
                    let file = entry.file.as_deref().map(|file| display.resolve(file)).unwrap_or_default();
                    PoseRecording::read(&file)
                        .map(|recording| Source::Recording(Player::new(&recording, entry.repeat)))
                        .map_err(|why| why.to_string())
                }
                Protocol::Simulated => Ok(Source::Simulated(simulated::Head::default())),
            };
            match source {
                Ok(source) => trackers.push(Tracker {
                    name: entry.name.clone(),
                    source,
                    follower,
                    bodies: entry.bodies.iter().map(|body| body.is).collect(),
                    told_lost: vec![false; entry.bodies.len()],
                }),
                Err(why) => faults.push(format!("tracker `{}` is left out: {why}", entry.name)),
            }
        }
        Ok(Self {
            trackers,
            faults,
            start: Instant::now(),
            clock_s: None,
            arrivals: Vec::new(),
            reports: Vec::new(),
            flicks: WandFlickDetector::new(FlickSettings::wand()),
        })
    }

    /// What could not be listened to.
    #[must_use]
    pub fn faults(&self) -> &[String] {
        &self.faults
    }

    /// Where datagrams are listened for.
    pub fn addresses(&self) -> impl Iterator<Item = std::net::SocketAddr> + '_ {
        self.trackers.iter().filter_map(|tracker| match &tracker.source {
            Source::Udp(receiver, _) => Some(receiver.address()),
            _ => None,
        })
    }

    /// How many datagrams have come, all trackers together. Whoever sends them knows by it when the next frame will find them.
    #[must_use]
    pub fn received(&self) -> u64 {
        let counted = |tracker: &Tracker| match &tracker.source {
            Source::Udp(receiver, _) => receiver.counters().received,
            _ => 0,
        };
        self.trackers.iter().map(counted).sum()
    }

    /// From now on it is this late, in place of what the clock says: recordings are played at it, and what comes has come at it.
    pub fn set_clock(&mut self, seconds: f64) {
        self.clock_s = Some(seconds);
    }

    fn now_s(&self) -> f64 {
        self.clock_s.unwrap_or_else(|| self.start.elapsed().as_secs_f64())
    }

    /// Takes what has come since this was called last. Apps with a [`Room`] and the [`TrackingPlugin`] do so in each frame.
    pub fn take(&mut self) {
        let (now_s, start, told_s) = (self.now_s(), self.start, self.clock_s);
        for tracker in &mut self.trackers {
            let follower = &mut tracker.follower;
            match &mut tracker.source {
                Source::Udp(receiver, language) => {
                    receiver.drain(&mut self.arrivals);
                    for arrival in self.arrivals.drain(..) {
                        // What is malformed is counted.
                        let arrival_s = told_s.unwrap_or_else(|| arrival.seconds_after(start));
                        follower.packet(*language, &arrival.packet, arrival_s).ok();
                    }
                }
                Source::Recording(player) => player.reports(now_s, now_s, &mut self.reports),
                #[cfg(feature = "xr")]
                Source::OpenXr(runtime) => runtime.reports(&tracker.name, now_s, &mut self.reports),
                Source::Simulated(_) => {}
            }
            self.reports.drain(..).for_each(|report| follower.report(&report));
        }
    }

    /// Each body: its tracker's name, what it is, whether it is seen, and where in the room it is once it was.
    pub fn bodies(&self) -> impl Iterator<Item = (&str, BodyKind, State, Option<Pose>)> {
        let now_s = self.now_s();
        self.trackers.iter().flat_map(move |tracker| {
            let of = |(index, body): (usize, &BodyKind)| {
                (*body, tracker.follower.state(index, now_s), tracker.follower.pose(index, now_s))
            };
            let bodies: Vec<_> = tracker.bodies.iter().enumerate().map(of).collect();
            bodies.into_iter().map(|(body, state, pose)| (tracker.name.as_str(), body, state, pose))
        })
    }

    /// When the newest report that is used arrived.
    fn newest(&self) -> Option<Instant> {
        let now_s = self.now_s();
        let hardware = self.trackers.iter().filter(|tracker| tracker.is_live());
        let latest = hardware.filter_map(|tracker| tracker.follower.statistics(now_s).latency_s).fold(f64::INFINITY, f64::min);
        let arrived = Duration::try_from_secs_f64(now_s - latest).ok().filter(|_| self.clock_s.is_none())?;
        Some(self.start + arrived)
    }

    /// Each tracker's name but for keyboards, what it counted with how long ago its newest report arrived, and whether each of its bodies is seen.
    pub fn told(&self) -> impl Iterator<Item = (&str, Statistics, Vec<(BodyKind, State)>)> {
        let now_s = self.now_s();
        let hardware = self.trackers.iter().filter(|tracker| !matches!(tracker.source, Source::Simulated(_)));
        hardware.map(move |tracker| {
            let seen = |(index, body): (usize, &BodyKind)| (*body, tracker.follower.state(index, now_s));
            (tracker.name.as_str(), tracker.follower.statistics(now_s), tracker.bodies.iter().enumerate().map(seen).collect())
        })
    }
}

fn listen(entry: &TrackerEntry, language: Language) -> Result<Source, String> {
    let address = entry.address().ok_or_else(|| "it has no address".to_owned())?;
    let settings = ReceiverSettings { address: address.ip(), port: address.port(), ..ReceiverSettings::default() };
    Receiver::bind(&settings).map(|receiver| Source::Udp(receiver, language)).map_err(|why| why.to_string())
}

/// Follows the [`Trackers`], once there are any.
#[derive(Default)]
pub struct TrackingPlugin;

impl Plugin for TrackingPlugin {
    fn build(&self, app: &mut App) {
        let there = resource_exists::<Trackers>.and_then(resource_exists::<Room>);
        let told = FrameTold::in_app(app);
        app.add_plugins(LatencyPlugin)
            .init_resource::<WandInput>()
            .init_resource::<MouseLook>()
            .add_systems(PreUpdate, told.of("trackers", follow).before(InputSet).run_if(there.clone()))
            .add_systems(Update, simulated::simulate.before(Travel).run_if(there));
    }
}

/// Moves the room's head and hands to where the trackers say.
fn follow(mut trackers: ResMut<Trackers>, mut room: ResMut<Room>, mut wand_input: ResMut<WandInput>) {
    let trackers = &mut *trackers;
    trackers.take();
    let now_s = trackers.now_s();
    let (mut head, mut wand, mut left_hand) = (None, None, None);
    let mut input = WandInput::default();
    for tracker in &mut trackers.trackers {
        for (index, body) in tracker.bodies.iter().enumerate() {
            let lost = matches!(tracker.follower.state(index, now_s), State::Lost { .. });
            if lost != tracker.told_lost[index] && !matches!(tracker.source, Source::Simulated(_)) {
                tracker.told_lost[index] = lost;
                let what = if lost { "is lost" } else { "is back" };
                info!("tracker `{}`: the {} {what}", tracker.name, body.name());
            }
            let Some(pose) = tracker.follower.pose(index, now_s) else { continue };
            match body {
                BodyKind::Head => head = Some(pose),
                BodyKind::LeftHand => left_hand = Some(pose),
                BodyKind::Wand => {
                    wand = Some(pose);
                    let axes = tracker.follower.axes(index, now_s);
                    let angular = tracker.follower.velocity(index, now_s).angular_rad_s;
                    input = WandInput {
                        buttons: tracker.follower.buttons(index, now_s),
                        stick: Vec2::new(axes[0], axes[1]).clamp(Vec2::NEG_ONE, Vec2::ONE),
                        flick: trackers.flicks.turn(pose.orientation, angular, now_s),
                        present: true,
                    };
                }
            }
        }
    }
    if let Some(head) = head
        && room.head != head
    {
        room.head = head;
    }
    if (room.wand, room.left_hand) != (wand, left_hand) {
        (room.wand, room.left_hand) = (wand, left_hand);
    }
    wand_input.set_if_neq(input);
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_bundle::display::{DisplayFile, Preset};
    use std::net::UdpSocket;
    use std::time::Duration;

    fn app(tracker: &str) -> App {
        let mut file: DisplayFile = Preset::Flatworld.file();
        file.trackers.clear();
        let text = format!("{}\n{tracker}", file.to_toml_string());
        let display = Display::parse(&text, "display.toml").unwrap_or_else(|error| panic!("{error}"));
        let mut app = crate::input::tests::app();
        app.add_plugins(TrackingPlugin)
            .insert_resource(Trackers::new(&display).unwrap())
            .insert_resource(Room::new(display.into()).unwrap())
            .init_resource::<crate::stage::Stage>();
        app
    }

    const OSC: &str = "[[tracker]]\nname = \"phone\"\nprotocol = \"osc\"\nlisten = \"127.0.0.1:0\"\nprediction_ms = 0.0\n\
        [[tracker.body]]\nis = \"head\"\naddress = \"/head\"\n[[tracker.body]]\nis = \"wand\"\naddress = \"/wand\"\n";

    fn address(app: &App) -> std::net::SocketAddr {
        match &app.world().resource::<Trackers>().trackers[0].source {
            Source::Udp(receiver, _) => receiver.address(),
            _ => panic!("listens"),
        }
    }

    #[test]
    fn heads_and_wands_come_over_loopback_and_floods_end_nothing() {
        let mut app = app(OSC);
        let to = address(&app);
        let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
        let pose = Pose { position: Vec3::new(0.5, 1.7, -0.25), orientation: Quat::from_rotation_y(0.3) };
        for _ in 0..2000 {
            sender.send_to(b"/head\0\0\0,fff\0\0\0\0 too short", to).unwrap();
        }
        let until = Instant::now() + Duration::from_secs(20);
        while app.world().resource::<Room>().head.position.distance(pose.position) > 1e-3 {
            assert!(Instant::now() < until, "nothing came");
            sender.send_to(&heliodon_track::osc::pose_packet("/head", &pose), to).unwrap();
            sender.send_to(&heliodon_track::osc::pose_packet("/wand", &pose), to).unwrap();
            sender.send_to(&heliodon_track::osc::button_packet("/wand", 0, true), to).unwrap();
            app.update();
            std::thread::sleep(Duration::from_millis(2));
        }
        app.update();
        assert!(app.world().resource::<WandInput>().present && app.world().resource::<Room>().wand.is_some());
        let (_, statistics, seen) = app.world().resource::<Trackers>().told().next().unwrap();
        assert!(statistics.malformed > 0 && seen[0] == (BodyKind::Head, State::Tracked));
    }

    #[test]
    fn a_port_in_use_and_a_missing_recording_are_told_and_left_out() {
        let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
        let port = taken.local_addr().unwrap().port();
        let app = app(&format!(
            "[[tracker]]\nname = \"optical\"\nprotocol = \"dtrack\"\nlisten = \"{port}\"\n[[tracker.body]]\nis = \"head\"\nid = 0\n\
             [[tracker]]\nname = \"film\"\nprotocol = \"recording\"\nfile = \"nowhere.poses\"\n[[tracker.body]]\nis = \"wand\"\n"
        ));
        let faults = app.world().resource::<Trackers>().faults();
        assert_eq!(faults.len(), 2);
        assert!(faults[0].contains("optical") && faults[0].contains(&port.to_string()), "{}", faults[0]);
        assert!(faults[1].contains("nowhere.poses"), "{}", faults[1]);
    }

    #[test]
    fn axes_that_are_none_are_told_with_their_place() {
        let display = format!(
            "{}\n{}",
            DisplayFile::default().to_toml_string(),
            OSC.replace("prediction_ms", "axes = \"x y y\"\nprediction_ms")
        );
        let display = Display::parse(&display, "display.toml").unwrap();
        let told = Trackers::new(&display).err().unwrap().to_string();
        assert!(told.starts_with("display.toml:") && told.contains("x y y"), "{told}");
    }
}
