//! Packets for senders and tests.

use super::Message;
use crate::pose::Pose;
use rosc::{OscMessage, OscPacket, OscType};

/// A packet that reports a pose at an address, seven floats, as [`parse`](super::parse) reads it.
#[must_use]
pub fn pose_packet(address: &str, pose: &Pose) -> Vec<u8> {
    let numbers = pose.position.to_array().into_iter().chain(pose.orientation.to_array());
    packet(address, numbers.map(OscType::Float).collect())
}

/// A packet that reports a button at a body's address.
#[must_use]
pub fn button_packet(address: &str, button: u32, held: bool) -> Vec<u8> {
    packet(&format!("{address}/button/{button}"), vec![OscType::Bool(held)])
}

/// A packet that reports an axis at a body's address.
#[must_use]
pub fn axis_packet(address: &str, axis: usize, value: f32) -> Vec<u8> {
    packet(&format!("{address}/axis/{axis}"), vec![OscType::Float(value)])
}

/// A packet that reports a body as lost.
#[must_use]
pub fn lost_packet(address: &str) -> Vec<u8> {
    packet(&format!("{address}/lost"), Vec::new())
}

/// A packet with one message.
#[must_use]
pub fn message_packet(message: &Message) -> Vec<u8> {
    packet(&message.address, message.arguments.clone())
}

fn packet(address: &str, args: Vec<OscType>) -> Vec<u8> {
    // writing to memory does not fail, and there is no argument that rosc cannot write
    rosc::encoder::encode(&OscPacket::Message(OscMessage { addr: address.to_owned(), args })).unwrap_or_default()
}
