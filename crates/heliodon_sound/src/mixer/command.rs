//! What goes to the audio thread, and what comes back.

use super::bed::Bed;
use super::rooms::RoomSet;
use super::source::{Source, SourceSettings};
use crate::head::Head;
use glam::Vec3;
use std::sync::atomic::{AtomicU32, AtomicU64};

/// An order, and the frame at which it is to be carried out; none: as soon as it is read.
#[derive(Debug)]
pub(crate) struct Timed {
    pub(crate) at: Option<u64>,
    pub(crate) command: Command,
}

#[derive(Debug)]
pub(crate) enum Command {
    Add { slot: u32, source: Box<Source> },
    Change { slot: u32, generation: u32, change: Change },
    Listener(Head),
    Rooms(Box<RoomSet>),
    AddBed { slot: u32, bed: Box<Bed> },
    BedGain { slot: u32, gain: f32 },
    RemoveBed { slot: u32 },
    Hour(f32),
    Volume(f32),
    Mute(bool),
    Pause(bool),
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Change {
    Place(Vec3),
    Gain(f32),
    Occlusion(f32),
    Rate(f32),
    Settings(SourceSettings),
    Start,
    Stop,
    Seek(f64),
    Remove,
}

/// What the audio thread has done with: taken apart elsewhere, for that frees memory.
#[derive(Debug)]
pub(crate) enum Returned {
    /// It came to its end; it stays.
    Finished {
        slot: u32,
        generation: u32,
    },
    /// Its slot is free again; whether it came to its end.
    Source {
        slot: u32,
        source: Box<Source>,
        finished: bool,
    },
    Rooms(Box<RoomSet>),
    Bed {
        slot: u32,
        bed: Box<Bed>,
    },
}

/// Figures that the audio thread leaves for whoever asks.
#[derive(Debug, Default)]
pub(crate) struct Figures {
    pub(crate) sources: AtomicU32,
    pub(crate) voices: AtomicU32,
    pub(crate) loudest: AtomicU32,
    pub(crate) late: AtomicU64,
}
