//! A.R.T.'s DTrack2 and DTrack3: lines of text in UDP datagrams, one datagram a frame.
//!
//! After "DTrack2 System user manual", version 2.12, A.R.T. GmbH, 2016, Appendix B.2 "Output of Measurement Data via Ethernet";
//! DTrack3 writes the same lines. Read are
//!
//! | line | | of each target |
//! | --- | --- | --- |
//! | `fr 21753` | counter of frames | |
//! | `ts 39596.024831` | seconds of the day | |
//! | `6dcal 2` | number of targets | |
//! | `6d 1 ...` | tracked standard bodies | `[id qu][x y z eta theta phi][b0 ... b8]` |
//! | `6di 1 ...` | all of them | `[id st er][x y z][b0 ... b8]`, st 0: not tracked |
//! | `6df2 1 1 ...` | flysticks | `[id qu nbt nct][x y z][b0 ... b8][bt0 ... ct0 ct1 ...]` |
//! | `6df 1 ...` | flysticks, older | `[id qu bt][x y z eta theta phi][b0 ... b8]` |
//!
//! and of all others (`3d`, `6dmt`, `6dmt2`, `6dmtr`, `6dcov`, `6dj`, `gl`, `glcal`, those to come) nothing, whatever they
//! hold. Positions are millimetres; here they become **metres**, so the calibration's scale is 1. The nine numbers of a matrix
//! are its **columns**, b0 b1 b2 the first: the body's axes in the room (B.1.3, B.2.3). A quality below 0 says that the target
//! is not seen; numbers stand there all the same. A standard body that is not seen is left out of `6d`, so that a body of the
//! settings that is absent from a frame's line is lost in it; a frame without any such line says nothing. Buttons are bits from
//! the right of the stick to the left; the joystick's axes are right and up from -1 to 1 (of the older line, whose hat switch
//! is four of the buttons, likewise).

mod frame;
mod line;
mod write;

pub use write::{FlystickState, packet};

use crate::report::{Heard, Malformed, Report, Sight};
use crate::settings::{Body, DtrackTarget};
use frame::Frame;
use line::Line;

/// Reads a datagram and appends what it reports of `bodies`, by their numbers in DTrack, to `into`: one report of each that has
/// such a number and a line, positions in metres. Targets that no body is count as ignored.
///
/// Lines may end with CR LF, the datagram with NULs.
///
/// # Errors
///
/// Where a line that is read has anything but the numbers that belong there, or no line is DTrack's; then `into` is as it was.
pub fn parse(packet: &[u8], bodies: &[Body], arrival_s: f64, into: &mut Vec<Report>) -> Result<Heard, Malformed> {
    let end = packet.iter().rposition(|byte| *byte != 0).map_or(0, |last| last + 1);
    let mut frame = Frame::default();
    let mut offset = 0;
    for text in packet[..end].split(|byte| *byte == b'\n') {
        frame.line(Line::new(text, offset))?;
        offset += text.len() + 1;
    }
    if !frame.known {
        return Err(Malformed { offset: 0, reason: "no line is one of DTrack's" });
    }
    let mut used = 0;
    for (i, body) in bodies.iter().enumerate() {
        let (targets, id) = match body.dtrack {
            Some(DtrackTarget::Body(id)) => (&frame.bodies, id),
            Some(DtrackTarget::Flystick(id)) => (&frame.flysticks, id),
            None => continue,
        };
        let report = Report::of(i, arrival_s);
        let own = || targets.list.iter().filter(|target| target.id == id);
        used += own().count();
        // in both lines of a kind: that in which it is seen
        match own().find(|target| target.sight != Sight::Lost).or_else(|| own().next()) {
            Some(target) => {
                into.push(Report { buttons: target.buttons, axes: target.axes, ..report.with_sight(target.sight) });
            }
            None if targets.told => into.push(report.with_sight(Sight::Lost)),
            None => {}
        }
    }
    let there = frame.bodies.list.len() + frame.flysticks.list.len();
    Ok(Heard { ignored: there.saturating_sub(used) as u64, frame: frame.counter })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Pose;
    use crate::report::Buttons;
    use crate::rotation;
    use glam::Vec3;

    fn bodies() -> Vec<Body> {
        vec![
            Body::dtrack("head", DtrackTarget::Body(0)),
            Body::dtrack("hand", DtrackTarget::Body(2)),
            Body::dtrack("wand", DtrackTarget::Flystick(0)),
            Body::osc("other", "/other"),
        ]
    }

    fn heard(packet: &str) -> (Vec<Report>, Heard) {
        let mut reports = Vec::new();
        let heard = parse(packet.as_bytes(), &bodies(), 1.0, &mut reports).unwrap();
        (reports, heard)
    }

    fn fault(packet: &[u8]) -> &'static str {
        let mut reports = Vec::new();
        let fault = parse(packet, &bodies(), 1.0, &mut reports).unwrap_err();
        assert!(reports.is_empty(), "nothing of a malformed packet is used");
        fault.reason
    }

    fn pose(report: &Report) -> Pose {
        report.pose().and_then(Pose::checked).unwrap()
    }

    /// A frame as controllers write it, with the lines that it may have besides.
    const FRAME: &str = "fr 21753\r\nts 39596.024831\r\n6dcal 3\r\n\
        6d 1 [0 1.000][84.203 37.681 172.102 99.1970 6.7130 9.6575]\
        [0.979069 0.086946 0.184021 -0.166608 -0.176923 0.970021 0.116897 -0.980377 -0.158734]\r\n\
        6df2 1 1 [0 1.000 6 2][-48.603 -122.146 -389.220]\
        [0.175884 0.118374 -0.977268 0.887803 0.409816 0.209422 0.425290 -0.904455 -0.033013][5 0.25 -1.00]\r\n\
        6dmtr 1 1 [0 1.000][-485.245 -67.217 -38.328][nonsense]\r\n3d 1 [79 1.000][210.730 -90.669 -108.554]\r\n\
        gl 0 \r\n7d of times to come\r\n\0\0";

    #[test]
    fn a_frame_is_read_in_metres() {
        let (reports, heard) = heard(FRAME);
        assert_eq!(reports.iter().map(|report| report.body).collect::<Vec<_>>(), [0, 1, 2]);
        assert_eq!(heard, Heard { ignored: 0, frame: Some(21_753) });
        assert!((pose(&reports[0]).position - Vec3::new(0.084_203, 0.037_681, 0.172_102)).length() < 1e-6);
        assert_eq!(reports[1].sight, Sight::Lost, "a body of the settings that the line leaves out");
        let wand = &reports[2];
        assert_eq!((wand.buttons, &wand.axes[..3]), (Some(Buttons::all(5)), &[Some(0.25), Some(-1.0), None][..]));
        assert!((pose(wand).orientation * Vec3::Z - Vec3::new(0.425_290, -0.904_455, -0.033_013)).length() < 1e-5);
    }

    #[test]
    fn matrices_are_written_by_columns() {
        // the controller gives the orientation of the frame above as angles too, and R = Rx(eta) Ry(theta) Rz(phi), B.1.3; by
        // rows, every angle would have the other sign
        let about = |axis: Vec3, degrees: f32| rotation::from_vector(axis * degrees.to_radians());
        let expected = about(Vec3::X, 99.1970) * about(Vec3::Y, 6.7130) * about(Vec3::Z, 9.6575);
        let turned = pose(&heard(FRAME).0[0]).orientation * expected.conjugate();
        assert!(rotation::to_vector(turned).length() < 1e-5);
    }

    const UNTURNED: &str = "[1 0 0 0 1 0 0 0 1]";

    #[test]
    fn quality_below_zero_is_a_loss_but_buttons_are_heard() {
        let zeros = "[0 0 0][0 0 0 0 0 0 0 0 0]";
        let (reports, _) = heard(&format!("fr 1\n6df2 1 1 [0 -1.000 6 2]{zeros}[3 0.5 0]\n"));
        let wand = reports[0];
        assert_eq!((wand.sight, wand.buttons, wand.axes[0]), (Sight::Lost, Some(Buttons::all(3)), Some(0.5)));
        let (reports, _) = heard(&format!("6d 2 [0 -1.000]{zeros}[2 1.000][1 2 3]{UNTURNED}\n"));
        assert_eq!((reports[0].sight, pose(&reports[1]).position), (Sight::Lost, Vec3::new(1.0, 2.0, 3.0) * 0.001));
    }

    #[test]
    fn hybrid_bodies_and_older_flysticks_are_read_too() {
        let (reports, _) = heard(&format!("6di 2 [0 2 2.135][1000 0 0]{UNTURNED} [2 0 0.000][0 0 0][0 0 0 0 0 0 0 0 0]"));
        assert_eq!((pose(&reports[0]).position, reports[1].sight), (Vec3::X, Sight::Lost));
        let (reports, _) = heard(&format!("6df 1 [0 1.000 {}][0 0 0 0 0 0]{UNTURNED}", 0x20 + 0x40 + 2));
        assert_eq!((reports[0].buttons, reports[0].axes[0]), (Some(Buttons::all(0x62)), Some(-1.0)));
        assert_eq!(reports[0].axes[1], Some(1.0));
    }

    #[test]
    fn a_frame_without_a_line_says_nothing_of_its_bodies() {
        assert_eq!(heard("fr 3\n3d 0\n").0, []);
        let (reports, heard) = heard(&format!("6d 1 [7 1.000][0 0 0 0 0 0]{UNTURNED}"));
        assert_eq!((reports.len(), heard.ignored), (2, 1), "two are lost, and number 7 belongs to nobody");
    }

    #[test]
    fn thirty_two_buttons_and_more_have_words_of_their_own() {
        let sent = |buttons: &str| heard(&format!("6df2 1 1 [0 1.000 {buttons}]")).0[0];
        let stick = |buttons: u32, words: &str| sent(&format!("{buttons} 1][0 0 0]{UNTURNED}[{words} -0.5"));
        assert_eq!(stick(33, "7 1").buttons, Some(Buttons::all(7)));
        assert_eq!(stick(32, "-2147483648").buttons, Some(Buttons::all(1 << 31)));
        let none = stick(0, "");
        assert_eq!((none.buttons, none.axes[0]), (Some(Buttons::all(0)), Some(-0.5)));
    }

    #[test]
    fn whatever_is_broken_drops_the_whole_datagram() {
        let good = format!("fr 1\n6d 1 [0 1.000][0 0 0 0 0 0]{UNTURNED}\n");
        let with = |line: &str| fault(format!("{good}{line}").as_bytes());
        assert_eq!(with("fr x"), "this is no number");
        assert_eq!(with("fr -1"), "a whole number from 0 up is wanted");
        assert_eq!(with("fr 1 2"), "something stands behind the last number");
        assert_eq!(with("ts nan"), "this is no number");
        assert_eq!(with("6d 1 [0 1.000][0 0 0 0 0 0][1 0 0 0 1 0 0 0]"), "a block has another number of numbers");
        assert_eq!(with("6d 2 [0 1.000][0 0 0 0 0 0][1 0 0 0 1 0 0 0 1]"), "a block in brackets is missing");
        assert_eq!(with("6d 4000000000"), "a block in brackets is missing");
        assert_eq!(with("6df2 1 1 [0 1.0 300 2]"), "a block in brackets is missing");
        assert_eq!(with(&format!("6df2 1 1 [0 1 300 2][0 0 0]{UNTURNED}")), "a flystick has too many buttons or axes");
        assert_eq!(with(&format!("6df2 1 1 [0 1 6 2][0 0 0]{UNTURNED}[1 0]")), "a block has another number of numbers");
        assert_eq!(with(&format!("6df2 1 1 [0 1 6 2][0 0 0]{UNTURNED}[1.5 0 0]")), "a whole number from 0 up is wanted");
        for nothing in [&b""[..], b"\0\0", b"hello\nworld", b"/heliodon/head\0\0", b"\xff\xfe"] {
            assert_eq!(fault(nothing), "no line is one of DTrack's");
        }
    }

    #[test]
    fn what_is_written_is_read() {
        let head = Pose { position: Vec3::new(0.1, 1.7, -0.3), orientation: rotation::from_vector(Vec3::new(0.2, 0.9, -0.1)) };
        let stick = FlystickState { pose: None, buttons: 9, axes: vec![0.5, -0.25] };
        let text = packet(77, &[(0, Some(head)), (2, None)], &[stick]);
        let (reports, heard) = heard(&text);
        assert_eq!((heard.frame, reports.len()), (Some(77), 3));
        let turned = pose(&reports[0]).orientation * head.orientation.conjugate();
        assert!((pose(&reports[0]).position - head.position).length() < 2e-6);
        assert!(rotation::to_vector(turned).length() < 1e-5);
        assert_eq!(reports[1].sight, Sight::Lost);
        assert_eq!((reports[2].sight, reports[2].buttons), (Sight::Lost, Some(Buttons::all(9))));
        assert_eq!(reports[2].axes[1], Some(-0.25));
    }
}
