//! Orders as packets.

use glam::Vec3;
use heliodon_track::osc::{Argument, Message, message_packet, messages};
use heliodon_track::report::Malformed;
use std::fmt;

/// How far from the origin a camera is set, metres.
const FARTHEST_M: f32 = 1e6;

/// The range of exposure, stops.
const MOST_STOPS: f32 = 32.0;

/// The quickest and the slowest day, seconds.
const DAY_S: std::ops::RangeInclusive<f32> = 0.1..=1e6;

/// Something to be done.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Order {
    /// Go to a local time, seconds after midnight, and pause.
    Time(f64),
    /// Let the day pass, or pause it.
    Play(bool),
    /// Seconds of the whole day.
    DaySeconds(f32),
    /// Exposure by hand.
    Exposure(f32),
    /// Where the visitor is and looks.
    Camera { eye: Vec3, yaw_rad: f32, pitch_rad: f32 },
    /// Another site.
    Site(String),
    /// What a key would set off.
    Action(String),
    /// How things are.
    State,
    /// The end.
    Quit,
}

/// How things are: what is answered to `/heliodon/state`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Local time, seconds after midnight.
    pub clock_s: f64,
    /// Whether the day passes.
    pub playing: bool,
    /// Exposure by hand.
    pub exposure_stops: f32,
    /// The visitor's eye.
    pub eye: Vec3,
    /// The visitor's heading.
    pub yaw_rad: f32,
    /// Orders that were refused.
    pub refused: u64,
    /// From a tracker's report to the picture that shows it, milliseconds; none without trackers.
    pub picture_ms: Option<f64>,
}

/// Why a packet is no order.
#[derive(Clone, Debug, PartialEq)]
pub enum OrderFault {
    /// It is no OSC.
    Malformed(Malformed),
    /// There is no such order.
    Unknown(String),
    /// The order's arguments are others.
    Arguments {
        /// The order.
        address: String,
        /// What it wants.
        wants: &'static str,
    },
}

impl fmt::Display for OrderFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Malformed(why) => write!(f, "a packet is no Open Sound Control message: {why}"),
            Self::Unknown(address) => write!(f, "there is no order `{}`", short(address)),
            Self::Arguments { address, wants } => write!(f, "`{}` wants {wants}", short(address)),
        }
    }
}

/// As much of a stranger's text as a log is to hold.
fn short(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).take(60).collect()
}

/// The orders of a packet; none of them if one is wrong.
pub(super) fn orders(bytes: &[u8]) -> Result<Vec<Order>, OrderFault> {
    messages(bytes).map_err(OrderFault::Malformed)?.iter().map(order).collect()
}

/// A finite number.
fn number(value: &Argument) -> Option<f64> {
    match value {
        Argument::Float(v) => Some(f64::from(*v)),
        Argument::Double(v) => Some(*v),
        Argument::Int(v) => Some(f64::from(*v)),
        Argument::Long(v) => Some(*v as f64),
        _ => None,
    }
    .filter(|v| v.is_finite())
}

/// `HH:MM` or `HH:MM:SS`, or seconds after midnight.
fn clock_s(value: &Argument) -> Option<f64> {
    match value {
        Argument::String(text) => text.parse::<heliodon_bundle::site::TimeOfDay>().ok().map(|time| f64::from(time.seconds())),
        other => number(other).filter(|seconds| (0.0..172_800.0).contains(seconds)),
    }
}

fn order(message: &Message) -> Result<Order, OrderFault> {
    let arguments = message.arguments.as_slice();
    let within =
        |value: &Argument, range: std::ops::RangeInclusive<f32>| number(value).map(|v| v as f32).filter(|v| range.contains(v));
    let (found, wants) = match (message.address.as_str(), arguments) {
        ("/heliodon/time", [at]) => (clock_s(at).map(Order::Time), "\"HH:MM\" or seconds after midnight"),
        ("/heliodon/play", [on]) => {
            let on = match on {
                Argument::Bool(on) => Some(*on),
                other => number(other).map(|v| v != 0.0),
            };
            (on.map(Order::Play), "true or false")
        }
        ("/heliodon/day_seconds", [seconds]) => {
            (within(seconds, DAY_S).map(Order::DaySeconds), "seconds, from 0.1 to a million")
        }
        ("/heliodon/exposure", [stops]) => {
            (within(stops, -MOST_STOPS..=MOST_STOPS).map(Order::Exposure), "stops, from -32 to 32")
        }
        ("/heliodon/camera", [x, y, z, heading, pitch]) => {
            let coordinate = |value| within(value, -FARTHEST_M..=FARTHEST_M);
            let angle = |value, most: f32| within(value, -most..=most).map(f32::to_radians);
            let eye = coordinate(x).zip(coordinate(y)).zip(coordinate(z)).map(|((x, y), z)| Vec3::new(x, y, z));
            let look = angle(heading, 3600.0).zip(angle(pitch, 88.0));
            let camera = eye.zip(look).map(|(eye, (yaw_rad, pitch_rad))| Order::Camera { eye, yaw_rad, pitch_rad });
            (camera, "x, y, z in metres, heading and pitch in degrees")
        }
        ("/heliodon/site", [Argument::String(name)]) => (Some(Order::Site(name.clone())), ""),
        ("/heliodon/action", [Argument::String(name)]) => (Some(Order::Action(name.clone())), ""),
        ("/heliodon/state", []) => (Some(Order::State), ""),
        ("/heliodon/quit", []) => (Some(Order::Quit), ""),
        ("/heliodon/site" | "/heliodon/action", _) => (None, "a name"),
        ("/heliodon/state" | "/heliodon/quit", _) => (None, "nothing else"),
        ("/heliodon/time" | "/heliodon/play" | "/heliodon/day_seconds" | "/heliodon/exposure", _) => (None, "one argument"),
        ("/heliodon/camera", _) => (None, "five numbers"),
        _ => return Err(OrderFault::Unknown(message.address.clone())),
    };
    found.ok_or_else(|| OrderFault::Arguments { address: message.address.clone(), wants })
}

/// The answer to `/heliodon/state`: time in seconds, whether the day passes, exposure, x, y, z, heading in degrees, orders refused, milliseconds from
/// a tracker's report to its picture, which are -1 without trackers.
pub(super) fn packet(state: &State) -> Vec<u8> {
    let arguments = vec![
        Argument::Double(state.clock_s),
        Argument::Bool(state.playing),
        Argument::Float(state.exposure_stops),
        Argument::Float(state.eye.x),
        Argument::Float(state.eye.y),
        Argument::Float(state.eye.z),
        Argument::Float(state.yaw_rad.to_degrees()),
        Argument::Long(i64::try_from(state.refused).unwrap_or(i64::MAX)),
        Argument::Float(state.picture_ms.map_or(-1.0, |ms| ms as f32)),
    ];
    message_packet(&Message { address: "/heliodon/state".to_owned(), arguments })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(address: &str, arguments: Vec<Argument>) -> Result<Vec<Order>, OrderFault> {
        orders(&message_packet(&Message { address: address.to_owned(), arguments }))
    }

    #[test]
    fn times_are_clocks_or_seconds() {
        let noon = Ok(vec![Order::Time(43_200.0)]);
        assert_eq!(of("/heliodon/time", vec![Argument::String("12:00".to_owned())]), noon);
        assert_eq!(of("/heliodon/time", vec![Argument::Int(43_200)]), noon);
        for bad in [Argument::String("25:00".to_owned()), Argument::Float(-1.0), Argument::Double(f64::NAN), Argument::Nil] {
            assert!(matches!(of("/heliodon/time", vec![bad]), Err(OrderFault::Arguments { .. })));
        }
    }

    #[test]
    fn what_is_out_of_range_or_unknown_is_refused() {
        assert!(matches!(of("/heliodon/dance", vec![]), Err(OrderFault::Unknown(_))));
        assert!(of("/heliodon/exposure", vec![Argument::Float(1e9)]).is_err());
        assert!(of("/heliodon/camera", vec![Argument::Float(f32::INFINITY); 5]).is_err());
        assert!(of("/heliodon/day_seconds", vec![Argument::Float(0.0)]).is_err());
        assert!(matches!(orders(b""), Err(OrderFault::Malformed(_))));
        let told = of("/heliodon/\n\u{7}dance", vec![]).unwrap_err().to_string();
        assert!(!told.contains('\n'), "{told}");
    }
}
