//! Orders from outside: a show-control system sets hour, exposure, site and camera by Open Sound Control over UDP.
//!
//! On loopback unless the display says otherwise: nothing asks who gives an order. What is malformed or unknown is counted and told
//! to whoever asks; it ends nothing. docs/rooms.md lists the orders.

mod order;

use crate::input::{Action, Actions, InputSet};
use crate::navigation::Visitor;
use crate::navigation::pose::Pose;
use crate::stage::Stage;
use crate::time_lapse::TimeLapse;
use crate::time_lapse::exposure::Exposure;
use crate::tracking::PictureLatency;
use bevy::prelude::*;
use heliodon_bundle::display::{Control as ControlSettings, Display};
use heliodon_track::receiver::{Arrival, Receiver, ReceiverSettings};
use order::{Order, orders, packet};
pub use order::{OrderFault, State};
use std::collections::BTreeMap;
use std::net::{SocketAddr, UdpSocket};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// From one order that is refused and told to the next.
const BETWEEN_WARNINGS: Duration = Duration::from_secs(10);

/// Answers that wait to be sent at most: a flood of questions is not answered one by one.
const MOST_ANSWERS: usize = 16;

/// What orders come by.
#[derive(Resource)]
pub struct Control {
    receiver: Receiver,
    answers: UdpSocket,
    sites: BTreeMap<String, PathBuf>,
    arrivals: Vec<Arrival>,
    counted: Counted,
    /// Why the last order was not carried out.
    last_fault: Option<String>,
    /// When that was last told.
    told: Option<Instant>,
}

/// What came.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counted {
    /// Orders that were carried out.
    pub done: u64,
    /// Packets and orders that could not be.
    pub refused: u64,
}

impl Control {
    /// Listens as a display says.
    ///
    /// # Errors
    /// Why it cannot be listened to, for people.
    pub fn new(display: &Display, settings: &ControlSettings) -> Result<Self, String> {
        let address = settings.address().ok_or_else(|| format!("`{}` is no address", settings.listen))?;
        let settings_of_socket =
            ReceiverSettings { address: address.ip(), port: address.port(), ..ReceiverSettings::default() };
        let receiver = Receiver::bind(&settings_of_socket).map_err(|why| why.to_string())?;
        let answers =
            UdpSocket::bind(SocketAddr::new(address.ip(), 0)).map_err(|why| format!("no socket for answers: {why}"))?;
        answers.set_nonblocking(true).map_err(|why| format!("no socket for answers: {why}"))?;
        let sites = settings.sites.iter().map(|(name, path)| (name.clone(), display.resolve(path))).collect();
        Ok(Self { receiver, answers, sites, arrivals: Vec::new(), counted: Counted::default(), last_fault: None, told: None })
    }

    /// Where it listens.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.receiver.address()
    }

    /// What came so far.
    #[must_use]
    pub fn counted(&self) -> Counted {
        self.counted
    }

    /// Why the last order that was refused was.
    #[must_use]
    pub fn last_fault(&self) -> Option<&str> {
        self.last_fault.as_deref()
    }

    fn refuse(&mut self, why: String) {
        self.counted.refused += 1;
        // A flood fills no disk.
        if self.told.is_none_or(|told| told.elapsed() >= BETWEEN_WARNINGS) {
            warn!("control: {why} ({} refused so far)", self.counted.refused);
            self.told = Some(Instant::now());
        }
        self.last_fault = Some(why);
    }
}

/// Carries orders out, once there is a [`Control`].
#[derive(Default)]
pub struct ControlPlugin;

impl Plugin for ControlPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(PreUpdate, obey.after(InputSet).run_if(resource_exists::<Control>));
    }
}

#[expect(clippy::too_many_arguments, reason = "a system's arguments are its resources")]
fn obey(
    mut control: ResMut<Control>,
    mut stage: ResMut<Stage>,
    mut lapse: ResMut<TimeLapse>,
    mut exposure: ResMut<Exposure>,
    mut actions: ResMut<Actions>,
    latency: Option<Res<PictureLatency>>,
    mut visitors: Query<(&mut Visitor, &mut Transform)>,
    mut exit: MessageWriter<AppExit>,
) {
    let control = &mut *control;
    let mut arrivals = std::mem::take(&mut control.arrivals);
    control.receiver.drain(&mut arrivals);
    let mut asked: Vec<SocketAddr> = Vec::new();
    for arrival in arrivals.drain(..) {
        let given = match orders(&arrival.packet) {
            Ok(given) => given,
            Err(fault) => {
                control.refuse(fault.to_string());
                continue;
            }
        };
        for order in given {
            match order {
                Order::Time(clock_s) => {
                    lapse.playing = false;
                    lapse.scrub(clock_s);
                }
                Order::Play(playing) => lapse.playing = playing,
                Order::DaySeconds(seconds) => lapse.day_seconds = seconds,
                Order::Exposure(stops) => exposure.manual_stops = stops,
                Order::Camera { eye, yaw_rad, pitch_rad } => {
                    for (mut visitor, mut transform) in &mut visitors {
                        let pitch_rad = if visitor.tilts { pitch_rad } else { 0.0 };
                        visitor.pose = Pose { eye, yaw_rad, pitch_rad };
                        *transform = visitor.pose.transform();
                    }
                }
                Order::Site(name) => {
                    let Some(path) = control.sites.get(&name).cloned() else {
                        control.refuse(format!("there is no site `{name}` under [control] sites"));
                        continue;
                    };
                    // The stage stays as it was where the bundle is none.
                    if let Err(why) = stage.open(&path) {
                        control.refuse(why.to_string());
                        continue;
                    }
                }
                Order::Action(name) => match Action::named(&name) {
                    Some(action) => actions.set_off(action),
                    None => {
                        control.refuse(format!("there is no action `{name}`"));
                        continue;
                    }
                },
                Order::State if asked.len() < MOST_ANSWERS => asked.push(arrival.from),
                Order::State => {}
                Order::Quit => {
                    exit.write(AppExit::Success);
                }
            }
            control.counted.done += 1;
        }
    }
    control.arrivals = arrivals;
    if asked.is_empty() {
        return;
    }
    let visitor = visitors.iter().next().map(|(visitor, _)| visitor.pose);
    let state = State {
        clock_s: lapse.clock_s,
        playing: lapse.playing,
        exposure_stops: exposure.manual_stops,
        eye: visitor.map_or(Vec3::ZERO, |pose| pose.eye),
        yaw_rad: visitor.map_or(0.0, |pose| pose.yaw_rad),
        refused: control.counted.refused,
        picture_ms: latency.and_then(|latency| latency.median_ms()),
    };
    for to in asked {
        // Whoever asked may be gone.
        control.answers.send_to(&packet(&state), to).ok();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_track::osc::{Argument, Message, message_packet, messages};

    fn app() -> App {
        let display =
            Display::parse("[control]\nlisten = \"127.0.0.1:0\"\nsites = { nothing = \"no/bundle\" }\n", "display.toml")
                .unwrap();
        let control = Control::new(&display, display.control.as_ref().unwrap()).unwrap();
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, ControlPlugin))
            .init_resource::<Actions>()
            .init_resource::<Stage>()
            .init_resource::<TimeLapse>()
            .init_resource::<Exposure>()
            .insert_resource(control);
        app
    }

    fn tell(socket: &UdpSocket, to: SocketAddr, address: &str, arguments: Vec<Argument>) {
        socket.send_to(&message_packet(&Message { address: address.to_owned(), arguments }), to).unwrap();
    }

    #[test]
    fn orders_are_carried_out_answered_and_refused() {
        let mut app = app();
        let visitor = app.world_mut().spawn(Visitor { tilts: false, ..Visitor::default() }).id();
        let to = app.world().resource::<Control>().address();
        let desk = UdpSocket::bind("127.0.0.1:0").unwrap();
        desk.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let floats = |values: &[f32]| values.iter().map(|&v| Argument::Float(v)).collect::<Vec<_>>();
        tell(&desk, to, "/heliodon/play", vec![Argument::Bool(false)]);
        tell(&desk, to, "/heliodon/exposure", floats(&[1.5]));
        tell(&desk, to, "/heliodon/camera", floats(&[1.0, 2.0, 3.0, 90.0, 20.0]));
        tell(&desk, to, "/heliodon/action", vec![Argument::String("day.loop".to_owned())]);
        tell(&desk, to, "/heliodon/site", vec![Argument::String("nothing".to_owned())]);
        tell(&desk, to, "/heliodon/site", vec![Argument::String("../../etc".to_owned())]);
        tell(&desk, to, "/heliodon/exposure", floats(&[f32::NAN]));
        desk.send_to(b"no OSC at all", to).unwrap();
        tell(&desk, to, "/heliodon/state", vec![]);
        let until = Instant::now() + Duration::from_secs(20);
        while app.world().resource::<Control>().counted() != (Counted { done: 5, refused: 4 }) {
            assert!(Instant::now() < until, "{:?}", app.world().resource::<Control>().counted());
            app.update();
            std::thread::sleep(Duration::from_millis(2));
        }
        let mut buffer = [0; 1000];
        let (length, _) = desk.recv_from(&mut buffer).unwrap();
        let answer = messages(&buffer[..length]).unwrap().remove(0);
        assert_eq!(answer.address, "/heliodon/state");
        assert_eq!(answer.arguments[1..3], [Argument::Bool(false), Argument::Float(1.5)]);
        let pose = app.world().get::<Visitor>(visitor).unwrap().pose;
        assert_eq!((pose.eye, pose.pitch_rad), (Vec3::new(1.0, 2.0, 3.0), 0.0));
        assert!((pose.yaw_rad - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
        assert!(app.world().resource::<Stage>().manifest().is_none());
    }

    #[test]
    fn a_port_in_use_is_told() {
        let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
        let text = format!("[control]\nlisten = \"{}\"\n", taken.local_addr().unwrap());
        let display = Display::parse(&text, "display.toml").unwrap();
        let told = Control::new(&display, display.control.as_ref().unwrap()).err().unwrap();
        assert!(told.contains("cannot be listened at"), "{told}");
    }
}
