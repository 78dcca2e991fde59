//! What the arguments of a message say.

use super::{Topic, wrong};
use crate::pose::Pose;
use crate::report::{Buttons, Malformed, NO_ROTATION, Report, Sight};
use crate::rotation;
use glam::{Quat, Vec3};
use rosc::{OscMessage, OscPacket, OscType};

/// The arguments of a message whose address has `address` bytes.
pub(super) fn read(bytes: &[u8], address: usize, at: usize) -> Result<Vec<OscType>, Malformed> {
    let tags = &bytes[(address / 4 + 1) * 4..];
    // senders older than the specification leave the type tags out where there are no arguments
    if tags.is_empty() {
        return Ok(Vec::new());
    }
    if tags[0] != b',' {
        return wrong(at, "the arguments have no type tags");
    }
    // arrays nest as deep as a packet bids, and to free them recurses as deep
    if tags.iter().take_while(|tag| **tag != 0).any(|tag| *tag == b'[') {
        return wrong(at, "arrays are not understood");
    }
    match rosc::decoder::decode_udp(bytes) {
        Ok(([], OscPacket::Message(OscMessage { args, .. }))) => Ok(args),
        Ok(_) => wrong(at, "something stands behind the arguments"),
        Err(_) => wrong(at, "the arguments are not what their type tags say"),
    }
}

/// What a message at a body's address reports of it; nothing where it says that the body is not lost.
pub(super) fn report(topic: Topic, arguments: &[OscType], report: Report) -> Result<Option<Report>, &'static str> {
    let last = arguments.last();
    match topic {
        Topic::Pose => Ok(Some(report.with_sight(sight(arguments)?))),
        Topic::Lost => match last.map_or(Some(1.0), switch) {
            Some(value) => Ok((value >= 0.5).then(|| report.with_sight(Sight::Lost))),
            None if matches!(last, Some(OscType::String(_))) => Ok(Some(report.with_sight(Sight::Lost))),
            None => Err("loss is told without an argument, or by true, false or a number"),
        },
        Topic::Button(number) => {
            let held = last.and_then(switch).ok_or("a button is told by true, false or a number")? >= 0.5;
            Ok(Some(Report { buttons: Buttons::one(number, held), ..report }))
        }
        Topic::Axis(axis) => {
            let mut axes = report.axes;
            axes[axis] = Some(last.and_then(number).ok_or("an axis is told by a number")?);
            Ok(Some(Report { axes, ..report }))
        }
    }
}

fn number(argument: &OscType) -> Option<f32> {
    match argument {
        OscType::Float(value) => Some(*value),
        OscType::Double(value) => Some(*value as f32),
        OscType::Int(value) => Some(*value as f32),
        OscType::Long(value) => Some(*value as f32),
        _ => None,
    }
}

fn switch(argument: &OscType) -> Option<f32> {
    match argument {
        OscType::Bool(held) => Some(if *held { 1.0 } else { 0.0 }),
        other => number(other),
    }
}

/// The pose that the arguments end with.
fn sight(arguments: &[OscType]) -> Result<Sight, &'static str> {
    let whole = |argument: &OscType| matches!(argument, OscType::Int(_) | OscType::Long(_));
    let after_text = arguments.iter().rposition(|argument| matches!(argument, OscType::String(_))).map_or(0, |i| i + 1);
    let (before, behind) = arguments.split_at(after_text);
    if !before.iter().all(|argument| whole(argument) || matches!(argument, OscType::String(_))) {
        return Err("before a pose stand only strings and whole numbers");
    }
    let values: Vec<f32> = behind.iter().filter_map(number).collect();
    if values.len() != behind.len() {
        return Err("a pose has numbers only");
    }
    let serials = behind.iter().take_while(|argument| whole(argument)).count();
    let pose = (0..=serials).filter_map(|skipped| values.get(skipped..)).find(|rest| [3, 7, 12].contains(&rest.len()));
    let vec3 = |values: &[f32]| Vec3::new(values[0], values[1], values[2]);
    match pose {
        Some(v) if v.len() == 3 => Ok(Sight::Position(vec3(v))),
        Some(v) if v.len() == 7 => {
            Ok(Sight::Pose(Pose { position: vec3(v), orientation: Quat::from_xyzw(v[3], v[4], v[5], v[6]) }))
        }
        Some(v) => {
            let column = |i: usize| Vec3::new(v[3 + i], v[6 + i], v[9 + i]);
            let orientation = rotation::from_columns(column(0), column(1), column(2)).unwrap_or(NO_ROTATION);
            Ok(Sight::Pose(Pose { position: vec3(v), orientation }))
        }
        None => Err("a pose has 3, 7 or 12 numbers"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn floats(values: &[f32]) -> Vec<OscType> {
        values.iter().map(|value| OscType::Float(*value)).collect()
    }

    #[test]
    fn three_seven_or_twelve_numbers_are_a_pose() {
        assert_eq!(sight(&floats(&[1.0, 2.0, 3.0])), Ok(Sight::Position(Vec3::new(1.0, 2.0, 3.0))));
        let quaternion = sight(&floats(&[1.0, 2.0, 3.0, 0.0, 1.0, 0.0, 0.0]));
        let half_turn = Quat::from_xyzw(0.0, 1.0, 0.0, 0.0);
        assert_eq!(quaternion, Ok(Sight::Pose(Pose { position: Vec3::new(1.0, 2.0, 3.0), orientation: half_turn })));
        // by rows: the body's +X lies along +Y, its +Y along -X
        let matrix = sight(&floats(&[1.0, 2.0, 3.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]));
        let Ok(Sight::Pose(pose)) = matrix else { panic!("{matrix:?}") };
        assert!((pose.orientation * Vec3::X - Vec3::Y).length() < 1e-6);
        assert!((pose.orientation * Vec3::Y - Vec3::NEG_X).length() < 1e-6);
        for count in [0, 1, 2, 4, 6, 8, 11, 13] {
            assert_eq!(sight(&floats(&vec![0.0; count])), Err("a pose has 3, 7 or 12 numbers"), "{count}");
        }
    }

    #[test]
    fn numbers_are_of_any_kind() {
        let mixed = [OscType::Int(1), OscType::Double(2.5), OscType::Long(-3)];
        assert_eq!(sight(&mixed), Ok(Sight::Position(Vec3::new(1.0, 2.5, -3.0))));
        assert_eq!(sight(&[OscType::Int(1), OscType::Bool(true), OscType::Int(3)]), Err("a pose has numbers only"));
    }

    #[test]
    fn names_and_serials_before_a_pose_are_passed_over() {
        let named = |before: Vec<OscType>, values: &[f32]| sight(&[before, floats(values)].concat());
        let (name, serial) = (OscType::String("HMD".into()), OscType::Int(17));
        let here = Ok(Sight::Position(Vec3::ZERO));
        assert_eq!(named(vec![name.clone()], &[0.0; 3]), here);
        assert_eq!(named(vec![serial.clone()], &[0.0; 3]), here);
        assert_eq!(named(vec![serial.clone(), name.clone(), serial.clone()], &[0.0; 3]), here);
        assert!(matches!(named(vec![serial.clone()], &[0.0; 7]), Ok(Sight::Pose(_))));
        assert!(matches!(named(vec![serial.clone(), serial], &[0.0; 12]), Ok(Sight::Pose(_))));
        assert!(named(vec![OscType::Float(0.0), name], &[0.0; 3]).is_err(), "a number before the name");
    }

    #[test]
    fn a_matrix_that_is_none_leaves_a_quaternion_of_zeros() {
        let Ok(Sight::Pose(pose)) = sight(&floats(&[0.0; 12])) else { panic!("no pose") };
        assert_eq!(pose.checked(), None);
    }

    #[test]
    fn loss_may_carry_a_switch_or_a_name() {
        let lost = |arguments: &[OscType]| report(Topic::Lost, arguments, Report::of(0, 0.0)).map(|report| report.is_some());
        assert_eq!(lost(&[]), Ok(true));
        assert_eq!(lost(&[OscType::String("LHR-1".into())]), Ok(true));
        assert_eq!(lost(&[OscType::Bool(false)]), Ok(false));
        assert_eq!(lost(&[OscType::Int(1)]), Ok(true));
        assert!(lost(&[OscType::Nil]).is_err());
    }
}
