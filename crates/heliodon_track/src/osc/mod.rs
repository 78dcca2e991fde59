//! Open Sound Control 1.0: what most trackers of heads and hands can send, or can be made to.
//!
//! Matthew Wright: "The Open Sound Control 1.0 Specification", CNMAT, 2002. Messages are read by the kept library `rosc`; the
//! frames of bundles are walked here, because `rosc` recurses as deep as a packet bids it (a packet of 64 KiB nests 3,000
//! bundles, more than a thread's stack holds) and passes over what is broken inside a bundle.
//!
//! For a body with the address `/heliodon/head`:
//!
//! | address | arguments | meaning |
//! | --- | --- | --- |
//! | `/heliodon/head` or `/heliodon/head/pose` | 3 numbers | x y z |
//! | | 7 numbers | x y z, then a quaternion x y z w |
//! | | 12 numbers | x y z, then a rotation matrix by rows |
//! | `/heliodon/head/button/n` | true, false or a number (held from 0.5 up) | button n, 0 to 31 |
//! | `/heliodon/head/axis/n` | a number | axis n, 0 to 7 |
//! | `/heliodon/head/lost` | none, or true, false or a number | the tracker does not see it |
//!
//! Numbers are `f`, `d`, `i` or `h`. Before them may stand strings and whole numbers, such as VMC's names of devices. Where the
//! whole numbers could be coordinates as well, as many as can be are taken for coordinates. Time tags are not looked at: what
//! arrives is of now. Patterns (`/heliodon/*`) match nothing.

mod arguments;
mod frames;
mod write;

pub use frames::{MAX_DEPTH, MAX_ELEMENTS};
pub use rosc::OscType as Argument;
pub use write::{axis_packet, button_packet, lost_packet, message_packet, pose_packet};

use crate::report::{AXES, Heard, Malformed, Report};
use crate::settings::Body;
use rosc::OscType;

/// Reads a packet and appends what it reports of `bodies`, by their addresses, to `into`.
///
/// Messages at other addresses, or with another serial, count as ignored. `arrival_s` is put into the reports as it is.
///
/// # Errors
///
/// Where anything in the packet is wrong but for messages at other addresses; then `into` is as it was.
pub fn parse(packet: &[u8], bodies: &[Body], arrival_s: f64, into: &mut Vec<Report>) -> Result<Heard, Malformed> {
    let before = into.len();
    let mut reader = Reader { packet, bodies, arrival_s, into, heard: Heard::default() };
    match frames::messages(packet, |at, end| reader.message(at, end)) {
        Ok(()) => Ok(reader.heard),
        Err(malformed) => {
            into.truncate(before);
            Err(malformed)
        }
    }
}

/// A message of whatever meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// Where it is sent to: "/heliodon/time".
    pub address: String,
    /// What it says.
    pub arguments: Vec<Argument>,
}

/// Reads a packet's messages, whatever they are about.
///
/// # Errors
///
/// Where anything in the packet is wrong.
pub fn messages(packet: &[u8]) -> Result<Vec<Message>, Malformed> {
    let mut found = Vec::new();
    frames::messages(packet, |at, end| {
        let bytes = &packet[at..end];
        let address = frames::address(bytes, at)?;
        let arguments = arguments::read(bytes, address.len(), at)?;
        match std::str::from_utf8(address) {
            Ok(address) => found.push(Message { address: address.to_owned(), arguments }),
            Err(_) => return wrong(at, "an address is no text"),
        }
        Ok(())
    })?;
    Ok(found)
}

struct Reader<'a> {
    packet: &'a [u8],
    bodies: &'a [Body],
    arrival_s: f64,
    into: &'a mut Vec<Report>,
    heard: Heard,
}

/// What a message at a body's address is about.
#[derive(Clone, Copy, Debug)]
enum Topic {
    Pose,
    Lost,
    Button(u32),
    Axis(usize),
}

fn wrong<T>(offset: usize, reason: &'static str) -> Result<T, Malformed> {
    Err(Malformed { offset, reason })
}

impl Reader<'_> {
    fn message(&mut self, at: usize, end: usize) -> Result<(), Malformed> {
        let bytes = &self.packet[at..end];
        let address = frames::address(bytes, at)?;
        let bodies = self.bodies;
        let topics = || {
            bodies.iter().enumerate().filter_map(|(i, body)| {
                let rest = address.strip_prefix(body.address.as_ref()?.as_bytes())?;
                Some((i, body.serial.as_deref(), topic(rest)?))
            })
        };
        if topics().next().is_none() {
            self.heard.ignored += 1;
            return Ok(());
        }
        let arguments = arguments::read(bytes, address.len(), at)?;
        let mut wanted = false;
        for (body, serial, topic) in topics() {
            let named = |argument: &OscType| matches!(argument, OscType::String(text) if Some(text.as_str()) == serial);
            if serial.is_some() && !arguments.iter().any(named) {
                continue;
            }
            wanted = true;
            match arguments::report(topic, &arguments, Report::of(body, self.arrival_s)) {
                Ok(report) => self.into.extend(report),
                Err(reason) => return wrong(at, reason),
            }
        }
        self.heard.ignored += u64::from(!wanted);
        Ok(())
    }
}

/// What follows the body's own address.
fn topic(rest: &[u8]) -> Option<Topic> {
    let number = |digits: &[u8]| {
        let digits = std::str::from_utf8(digits).ok().filter(|text| text.bytes().all(|c| c.is_ascii_digit()))?;
        digits.parse::<u32>().ok()
    };
    match rest {
        b"" | b"/pose" => Some(Topic::Pose),
        b"/lost" => Some(Topic::Lost),
        _ => match rest.strip_prefix(b"/button/") {
            Some(digits) => number(digits).filter(|n| *n < u32::BITS).map(Topic::Button),
            None => {
                let axis = number(rest.strip_prefix(b"/axis/")?)? as usize;
                (axis < AXES).then_some(Topic::Axis(axis))
            }
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Pose;
    use crate::report::{Buttons, Sight};
    use glam::{Quat, Vec3};
    use rosc::{OscBundle, OscMessage, OscPacket, OscTime};

    fn bodies() -> Vec<Body> {
        vec![Body::osc("head", "/heliodon/head"), Body::osc("wand", "/heliodon/wand")]
    }

    fn heard(packet: &[u8]) -> (Vec<Report>, Heard) {
        let mut reports = Vec::new();
        let heard = parse(packet, &bodies(), 5.0, &mut reports).unwrap();
        (reports, heard)
    }

    fn fault(packet: &[u8]) -> &'static str {
        let mut reports = vec![Report::of(0, 0.0)];
        let fault = parse(packet, &bodies(), 5.0, &mut reports).unwrap_err();
        assert_eq!(reports.len(), 1, "nothing of a malformed packet is used");
        fault.reason
    }

    fn message(address: &str, args: Vec<OscType>) -> OscPacket {
        OscPacket::Message(OscMessage { addr: address.into(), args })
    }

    fn encode(packet: &OscPacket) -> Vec<u8> {
        rosc::encoder::encode(packet).unwrap()
    }

    fn bundle(content: Vec<OscPacket>) -> OscPacket {
        OscPacket::Bundle(OscBundle { timetag: OscTime { seconds: 0, fractional: 1 }, content })
    }

    const POSE: Pose = Pose { position: Vec3::new(0.5, 1.7, -2.0), orientation: Quat::from_xyzw(0.0, 0.6, 0.0, 0.8) };

    #[test]
    fn what_is_written_is_read() {
        let expected = Report::of(0, 5.0).with_sight(Sight::Pose(POSE));
        assert_eq!(heard(&pose_packet("/heliodon/head", &POSE)).0, [expected]);
        assert_eq!(heard(&pose_packet("/heliodon/head/pose", &POSE)).0, [expected]);
        let lost = Report::of(1, 5.0).with_sight(Sight::Lost);
        assert_eq!(heard(&lost_packet("/heliodon/wand")).0, [lost]);
        let button = Report::of(1, 5.0).with_buttons(Buttons { pressed: 0b100, told: 0b100 });
        assert_eq!(heard(&button_packet("/heliodon/wand", 2, true)).0, [button]);
        assert_eq!(heard(&axis_packet("/heliodon/wand", 7, -0.5)).0[0].axes[7], Some(-0.5));
    }

    #[test]
    fn bundles_are_walked_to_their_ends() {
        let inner = bundle(vec![message("/heliodon/wand/button/0", vec![OscType::Int(1)]), message("/other", vec![])]);
        let whole = bundle(vec![message("/heliodon/head/lost", vec![]), inner, message("/heliodon/wand/lost", vec![])]);
        let (reports, heard) = heard(&encode(&whole));
        assert_eq!(reports.iter().map(|report| report.body).collect::<Vec<_>>(), [0, 1, 1]);
        assert_eq!(heard, Heard { ignored: 1, frame: None });
    }

    #[test]
    fn other_addresses_are_ignored_whatever_they_say() {
        for address in ["/", "/heliodon", "/heliodon/headway", "/heliodon/head/button/32", "/heliodon/head/axis/+1", "/*"] {
            let (reports, heard) = heard(&encode(&message(address, vec![OscType::Nil])));
            assert_eq!((reports.len(), heard.ignored), (0, 1), "{address}");
        }
    }

    #[test]
    fn a_serial_tells_bodies_at_one_address_apart() {
        let vmc = |serial: &str| Body { serial: Some(serial.into()), ..Body::osc(serial, "/VMC/Ext/Tra/Pos") };
        let bodies = [vmc("LHR-1"), vmc("LHR-2")];
        let sent = |serial: &str| {
            let numbers = [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0].map(OscType::Float);
            let args = std::iter::once(OscType::String(serial.into())).chain(numbers).collect();
            let mut reports = Vec::new();
            let heard = parse(&encode(&message("/VMC/Ext/Tra/Pos", args)), &bodies, 0.0, &mut reports).unwrap();
            (reports.iter().map(|report| report.body).collect::<Vec<_>>(), heard.ignored)
        };
        assert_eq!(sent("LHR-2"), (vec![1], 0));
        assert_eq!(sent("LHR-3"), (vec![], 1));
    }

    #[test]
    fn whatever_is_broken_drops_the_whole_packet() {
        assert_eq!(fault(b""), "the length is not a multiple of four above 0");
        assert_eq!(fault(b"/he"), "the length is not a multiple of four above 0");
        assert_eq!(fault(b"/hea"), "an address does not end");
        assert_eq!(fault(b"head\0\0\0\0"), "an address does not begin with /");
        assert_eq!(fault(b"#bundle\0\0\0\0\0"), "a bundle without a time tag");
        // a sound message, then one that is cut short inside the bundle
        let mut packet = encode(&bundle(vec![message("/heliodon/head/lost", vec![]), message("/a", vec![])]));
        packet.truncate(packet.len() - 4);
        assert_eq!(fault(&packet), "an element of a bundle is longer than the bundle");
        let mut packet = pose_packet("/heliodon/head", &POSE);
        packet.extend([0; 4]);
        assert_eq!(fault(&packet), "something stands behind the arguments");
        packet.truncate(packet.len() - 8);
        assert_eq!(fault(&packet), "the arguments are not what their type tags say");
    }

    #[test]
    fn no_depth_and_no_number_of_bundles_overflows() {
        let mut deep = message("/heliodon/head/lost", vec![]);
        for _ in 0..MAX_DEPTH {
            deep = bundle(vec![deep]);
        }
        assert_eq!(heard(&encode(&deep)).0.len(), 1);
        assert_eq!(fault(&encode(&bundle(vec![deep]))), "bundles are nested too deep");
        // as deep as 64 KiB can be
        let mut packet = Vec::new();
        for level in (1..3000_u32).rev() {
            packet.extend(b"#bundle\0\0\0\0\0\0\0\0\x01");
            packet.extend((level * 20).to_be_bytes());
        }
        packet.extend(encode(&bundle(vec![])));
        packet.extend([0; 4]);
        assert_eq!(fault(&packet), "bundles are nested too deep");
        let arrays: Vec<u8> = b"/heliodon/head\0\0,".iter().copied().chain([b'['; 30_000]).chain([0; 3]).collect();
        assert_eq!(fault(&arrays), "arrays are not understood");
        let many = bundle(vec![message("/a", vec![]); MAX_ELEMENTS]);
        assert_eq!(fault(&encode(&many)), "more messages than a packet may have");
    }
}
