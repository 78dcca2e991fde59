//! Datagrams for senders and tests, as a controller writes them.

use crate::pose::Pose;
use glam::{Mat3, Vec3};
use std::fmt::Write;

/// A flystick at one moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FlystickState {
    /// Where it is, metres; none: it is not seen.
    pub pose: Option<Pose>,
    /// Buttons by their bits from 0; eight are written.
    pub buttons: u8,
    /// Axes, as many as it has.
    pub axes: Vec<f32>,
}

/// A datagram as [`parse`](super::parse) reads it: a frame with standard bodies by their numbers (those without a pose are left
/// out, as a controller leaves out what it does not see) and with flysticks, numbered from 0.
#[must_use]
pub fn packet(frame: u32, bodies: &[(u32, Option<Pose>)], flysticks: &[FlystickState]) -> String {
    let seen: Vec<(u32, Pose)> = bodies.iter().filter_map(|(id, pose)| Some((*id, (*pose)?))).collect();
    let mut text = format!("fr {frame}\n6dcal {}\n6d {}", bodies.len(), seen.len());
    for (id, pose) in seen {
        let [x, y, z] = millimetres(pose.position);
        // nobody should read the angles, as the manual advises
        write_to(&mut text, format_args!(" [{id} 1.000][{x:.3} {y:.3} {z:.3} 0.0000 0.0000 0.0000]"));
        write_matrix(&mut text, pose);
    }
    write_to(&mut text, format_args!("\n6df2 {0} {0}", flysticks.len()));
    for (id, stick) in flysticks.iter().enumerate() {
        let (quality, pose) = stick.pose.map_or((-1.0, Pose::IDENTITY), |pose| (1.0, pose));
        let [x, y, z] = millimetres(pose.position);
        write_to(&mut text, format_args!(" [{id} {quality:.3} 8 {}][{x:.3} {y:.3} {z:.3}]", stick.axes.len()));
        write_matrix(&mut text, pose);
        write_to(&mut text, format_args!("[{}", stick.buttons));
        stick.axes.iter().for_each(|axis| write_to(&mut text, format_args!(" {axis:.2}")));
        text.push(']');
    }
    text.push('\n');
    text
}

fn millimetres(position: Vec3) -> [f64; 3] {
    position.to_array().map(|metres| f64::from(metres) * 1000.0)
}

fn write_matrix(text: &mut String, pose: Pose) {
    let columns = Mat3::from_quat(pose.orientation).to_cols_array().map(|value| format!("{value:.6}"));
    write_to(text, format_args!("[{}]", columns.join(" ")));
}

fn write_to(text: &mut String, what: std::fmt::Arguments<'_>) {
    // writing to a string does not fail
    let _ = text.write_fmt(what);
}
