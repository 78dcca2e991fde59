//! What the visit tells the mixer: sources, the listener, rooms, ambience, volume.
//!
//! Whatever is told is checked here, where there is somebody to hear of it; the audio thread gets numbers that are finite and in
//! range. Nothing here waits: where the queue is full, which takes a mixer that nobody renders, that is an error.

use crate::clock::Clock;
use crate::head::Head;
use crate::mixer::bed::{Bed, DayCurve, MAX_BEDS};
use crate::mixer::command::{Change, Command, Figures, Returned, Timed};
use crate::mixer::reader::Content;
use crate::mixer::rooms::{MAX_ROOMS, RoomSet};
use crate::mixer::source::{Source, SourceSettings};
use crate::room::{Room, RoomError};
use glam::{Quat, Vec3};
use rtrb::{Consumer, Producer};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use thiserror::Error;

/// A source of a mixer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SourceId {
    slot: u32,
    generation: u32,
}

/// A bed of a mixer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BedId(u32, u32);

/// Why something was not told.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ControlError {
    /// A place, a direction or a number that is none.
    #[error("{what} is {value}, which is no finite number; what was before stays: look where it is worked out")]
    NotFinite {
        /// Of what.
        what: &'static str,
        /// What it is.
        value: String,
    },
    /// A number outside its range.
    #[error("{what} is {value}; give {range}")]
    Range {
        /// Of what.
        what: &'static str,
        /// What it is.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
    /// More than the mixer was made for.
    #[error("there are {most} {what} already; remove some, or make the mixer for more")]
    Full {
        /// Of what.
        what: &'static str,
        /// How many there may be.
        most: usize,
    },
    /// A source that has come to its end or was removed.
    #[error("this sound has come to its end; add it again, or let it stay")]
    Gone,
    /// Nobody takes the orders.
    #[error("the mixer has not taken its orders for long; is anything rendering it?")]
    Busy,
    /// See [`RoomError`].
    #[error(transparent)]
    Room(#[from] RoomError),
}

/// Figures of a mixer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Sources that exist.
    pub sources: u32,
    /// Sources that are rendered.
    pub voices: u32,
    /// The loudest sample of the last slice.
    pub loudest: f32,
    /// Orders that came after the frame they were for.
    pub late: u64,
}

/// Tells a mixer what to do. It belongs to one thread at a time.
#[derive(Debug)]
pub struct Control {
    orders: Producer<Timed>,
    returned: Consumer<Returned>,
    generations: Vec<u32>,
    used: Vec<bool>,
    free: Vec<u32>,
    beds: [Option<u32>; MAX_BEDS],
    next_bed: u32,
    room_sets: usize,
    head: Head,
    at: Option<u64>,
    clock: Clock,
    figures: Arc<Figures>,
    finished: Vec<SourceId>,
}

fn finite(what: &'static str, value: f32) -> Result<f32, ControlError> {
    if value.is_finite() { Ok(value) } else { Err(ControlError::NotFinite { what, value: value.to_string() }) }
}

fn ranged(what: &'static str, value: f32, least: f32, most: f32, range: &'static str) -> Result<f32, ControlError> {
    let value = finite(what, value)?;
    if (least..=most).contains(&value) { Ok(value) } else { Err(ControlError::Range { what, value: value.into(), range }) }
}

fn place(what: &'static str, place: Vec3) -> Result<Vec3, ControlError> {
    if place.is_finite() { Ok(place) } else { Err(ControlError::NotFinite { what, value: place.to_string() }) }
}

fn checked(settings: &SourceSettings) -> Result<(), ControlError> {
    place("a sound's place", settings.place)?;
    ranged("a sound's gain", settings.gain, 0.0, 64.0, "0 to 64")?;
    ranged("a sound's reference distance", settings.reference_m, 0.01, 1000.0, "0.01 to 1000 m")?;
    ranged("a sound's radius", settings.radius_m, 0.01, 1000.0, "0.01 to 1000 m")?;
    ranged("a sound's rolloff", settings.rolloff, 0.0, 8.0, "0 to 8")?;
    ranged("a sound's occlusion", settings.occlusion, 0.0, 1.0, "0 to 1")?;
    ranged("a sound's rate", settings.rate, 0.25, 4.0, "0.25 to 4")?;
    Ok(())
}

impl Control {
    pub(crate) fn new(
        orders: Producer<Timed>,
        returned: Consumer<Returned>,
        sources: usize,
        clock: Clock,
        figures: Arc<Figures>,
    ) -> Self {
        Self {
            orders,
            returned,
            generations: vec![0; sources],
            used: vec![false; sources],
            free: (0..sources as u32).rev().collect(),
            beds: [None; MAX_BEDS],
            next_bed: 0,
            room_sets: 0,
            head: Head::default(),
            at: None,
            clock,
            figures,
            finished: Vec::new(),
        }
    }

    fn tell(&mut self, command: Command) -> Result<(), ControlError> {
        self.orders.push(Timed { at: self.at, command }).map_err(|_| ControlError::Busy)
    }

    /// What is told from now on is done at a frame of the mixer's [clock](Self::clock): to the sample where a sound begins, in its
    /// slice of 64 frames whatever else. None, as it comes: as soon as the mixer hears of it.
    pub fn when(&mut self, frame: Option<u64>) {
        self.at = frame;
    }

    /// The mixer's clock.
    #[must_use]
    pub fn clock(&self) -> Clock {
        self.clock.clone()
    }

    /// Adds a source.
    ///
    /// # Errors
    ///
    /// Settings outside their ranges, and more sources than the mixer was made for.
    pub fn add(&mut self, content: Content, settings: &SourceSettings) -> Result<SourceId, ControlError> {
        checked(settings)?;
        self.collect();
        let slot = self.free.pop().ok_or(ControlError::Full { what: "sounds", most: self.used.len() })?;
        let generation = self.generations[slot as usize].wrapping_add(1);
        let source = Box::new(Source::new(content, *settings, generation));
        if let Err(error) = self.tell(Command::Add { slot, source }) {
            self.free.push(slot);
            return Err(error);
        }
        (self.generations[slot as usize], self.used[slot as usize]) = (generation, true);
        Ok(SourceId { slot, generation })
    }

    /// Whether a source still exists, as far as has been heard of.
    #[must_use]
    pub fn exists(&self, id: SourceId) -> bool {
        let slot = id.slot as usize;
        self.used.get(slot).is_some_and(|used| *used) && self.generations[slot] == id.generation
    }

    fn change(&mut self, id: SourceId, change: Change) -> Result<(), ControlError> {
        if !self.exists(id) {
            return Err(ControlError::Gone);
        }
        self.tell(Command::Change { slot: id.slot, generation: id.generation, change })
    }

    /// Moves a source. It glides there in 40 milliseconds, or is faded over where it was 1.5 metres away or more.
    ///
    /// # Errors
    ///
    /// A place that is not finite; a source that is gone.
    pub fn place(&mut self, id: SourceId, p_world: Vec3) -> Result<(), ControlError> {
        place("a sound's place", p_world)?;
        self.change(id, Change::Place(p_world))
    }

    /// Its level, 0 to 64.
    ///
    /// # Errors
    ///
    /// Another number; a source that is gone.
    pub fn gain(&mut self, id: SourceId, gain: f32) -> Result<(), ControlError> {
        ranged("a sound's gain", gain, 0.0, 64.0, "0 to 64")?;
        self.change(id, Change::Gain(gain))
    }

    /// How much of it is hidden, 0 to 1: the share of rays from the listener to it that the monument stops.
    ///
    /// # Errors
    ///
    /// Another number; a source that is gone.
    pub fn occlusion(&mut self, id: SourceId, occlusion: f32) -> Result<(), ControlError> {
        ranged("a sound's occlusion", occlusion, 0.0, 1.0, "0 to 1")?;
        self.change(id, Change::Occlusion(occlusion))
    }

    /// The speed at which a clip is played, 0.25 to 4.
    ///
    /// # Errors
    ///
    /// Another number; a source that is gone.
    pub fn rate(&mut self, id: SourceId, rate: f32) -> Result<(), ControlError> {
        ranged("a sound's rate", rate, 0.25, 4.0, "0.25 to 4")?;
        self.change(id, Change::Rate(rate))
    }

    /// All settings of a source but whether it plays.
    ///
    /// # Errors
    ///
    /// Settings outside their ranges; a source that is gone.
    pub fn set(&mut self, id: SourceId, settings: &SourceSettings) -> Result<(), ControlError> {
        checked(settings)?;
        self.change(id, Change::Settings(*settings))
    }

    /// Begins, or goes on from where it was stopped.
    ///
    /// # Errors
    ///
    /// A source that is gone.
    pub fn start(&mut self, id: SourceId) -> Result<(), ControlError> {
        self.change(id, Change::Start)
    }

    /// Falls silent in 10 milliseconds, and stays where it is.
    ///
    /// # Errors
    ///
    /// A source that is gone.
    pub fn stop(&mut self, id: SourceId) -> Result<(), ControlError> {
        self.change(id, Change::Stop)
    }

    /// To a time of a clip, seconds; beyond its end is its end. Feeds are wound by those who write them.
    ///
    /// # Errors
    ///
    /// A time that is not finite; a source that is gone.
    pub fn seek(&mut self, id: SourceId, seconds: f64) -> Result<(), ControlError> {
        if !seconds.is_finite() {
            return Err(ControlError::NotFinite { what: "a time to wind a sound to", value: seconds.to_string() });
        }
        self.change(id, Change::Seek(seconds))
    }

    /// Falls silent, and is gone.
    ///
    /// # Errors
    ///
    /// A source that is gone already.
    pub fn remove(&mut self, id: SourceId) -> Result<(), ControlError> {
        self.change(id, Change::Remove)
    }

    /// Where the listener's head is, `world_from_head`.
    ///
    /// # Errors
    ///
    /// A place that is not finite, an orientation that is no rotation: the head stays where it was.
    pub fn listener(&mut self, position: Vec3, orientation: Quat) -> Result<(), ControlError> {
        place("the listener's place", position)?;
        let length = orientation.length();
        if !length.is_finite() || length < 1.0e-3 {
            return Err(ControlError::NotFinite { what: "the listener's orientation", value: orientation.to_string() });
        }
        self.head = Head { position, orientation: orientation * (1.0 / length), ..self.head };
        self.tell(Command::Listener(self.head))
    }

    /// From ear to ear, 0.1 to 0.3 metres.
    ///
    /// # Errors
    ///
    /// Another number.
    pub fn ear_spacing(&mut self, metres: f32) -> Result<(), ControlError> {
        self.head.ear_spacing_m = ranged("the spacing of the ears", metres, 0.1, 0.3, "0.1 to 0.3 m")?;
        self.tell(Command::Listener(self.head))
    }

    /// The rooms, all of them; those before fade. Works out their echoes, which takes milliseconds: not for every frame.
    ///
    /// # Errors
    ///
    /// Rooms that [cannot be](Room::validate), more than 16, and sets that follow one another faster than they fade.
    pub fn rooms(&mut self, rooms: &[Room]) -> Result<(), ControlError> {
        rooms.iter().try_for_each(Room::validate)?;
        if rooms.len() > MAX_ROOMS {
            return Err(ControlError::Full { what: "rooms", most: MAX_ROOMS });
        }
        self.collect();
        if self.room_sets >= 8 {
            return Err(ControlError::Busy);
        }
        self.tell(Command::Rooms(Box::new(RoomSet::new(rooms.to_vec()))))?;
        self.room_sets += 1;
        Ok(())
    }

    /// Adds ambience: a sound without a place, always repeated, as loud as the curve says of the [hour](Self::hour) times `gain`
    /// (0 to 4). What is `outdoors` is heard in rooms as far as they are open.
    ///
    /// # Errors
    ///
    /// Another gain; more than 32 beds.
    pub fn add_bed(&mut self, content: Content, curve: DayCurve, gain: f32, outdoors: bool) -> Result<BedId, ControlError> {
        ranged("an ambience's gain", gain, 0.0, 4.0, "0 to 4")?;
        self.collect();
        let full = ControlError::Full { what: "ambiences", most: MAX_BEDS };
        let slot = self.beds.iter().position(Option::is_none).ok_or(full)?;
        let bed = Box::new(Bed::new(content, curve, gain, outdoors));
        self.tell(Command::AddBed { slot: slot as u32, bed })?;
        self.next_bed = self.next_bed.wrapping_add(1);
        self.beds[slot] = Some(self.next_bed);
        Ok(BedId(slot as u32, self.next_bed))
    }

    /// A bed's level, 0 to 4; it follows within some seconds.
    ///
    /// # Errors
    ///
    /// Another number; a bed that is gone.
    pub fn bed_gain(&mut self, id: BedId, gain: f32) -> Result<(), ControlError> {
        ranged("an ambience's gain", gain, 0.0, 4.0, "0 to 4")?;
        self.bed(id)?;
        self.tell(Command::BedGain { slot: id.0, gain })
    }

    /// A bed fades, and is gone.
    ///
    /// # Errors
    ///
    /// A bed that is gone already.
    pub fn remove_bed(&mut self, id: BedId) -> Result<(), ControlError> {
        self.bed(id)?;
        self.tell(Command::RemoveBed { slot: id.0 })
    }

    fn bed(&self, id: BedId) -> Result<(), ControlError> {
        if self.beds.get(id.0 as usize) == Some(&Some(id.1)) { Ok(()) } else { Err(ControlError::Gone) }
    }

    /// The hour of the day, taken modulo 24.
    ///
    /// # Errors
    ///
    /// One that is not finite.
    pub fn hour(&mut self, hour: f32) -> Result<(), ControlError> {
        let hour = finite("the hour", hour)?;
        self.tell(Command::Hour(hour.rem_euclid(24.0)))
    }

    /// The level of everything, 0 to 4.
    ///
    /// # Errors
    ///
    /// Another number.
    pub fn volume(&mut self, volume: f32) -> Result<(), ControlError> {
        ranged("the volume", volume, 0.0, 4.0, "0 to 4")?;
        self.tell(Command::Volume(volume))
    }

    /// Silence, while everything goes on.
    ///
    /// # Errors
    ///
    /// [`ControlError::Busy`] only.
    pub fn mute(&mut self, muted: bool) -> Result<(), ControlError> {
        self.tell(Command::Mute(muted))
    }

    /// Silence, and everything stands, the clock too, until it goes on.
    ///
    /// # Errors
    ///
    /// [`ControlError::Busy`] only.
    pub fn pause(&mut self, paused: bool) -> Result<(), ControlError> {
        self.tell(Command::Pause(paused))
    }

    /// Frees what the mixer has done with. [`Self::add`] does it too; a visit that adds nothing calls it once a frame.
    pub fn collect(&mut self) {
        while let Ok(returned) = self.returned.pop() {
            match returned {
                Returned::Finished { slot, generation } => self.finished.push(SourceId { slot, generation }),
                Returned::Source { slot, source, finished } => {
                    if finished {
                        self.finished.push(SourceId { slot, generation: source.generation });
                    }
                    self.used[slot as usize] = false;
                    self.free.push(slot);
                }
                Returned::Rooms(rooms) => {
                    drop(rooms);
                    self.room_sets = self.room_sets.saturating_sub(1);
                }
                Returned::Bed { slot, bed } => {
                    drop(bed);
                    self.beds[slot as usize] = None;
                }
            }
        }
        // nobody may ever ask
        let most = self.used.len();
        if self.finished.len() > most {
            self.finished.drain(..self.finished.len() - most);
        }
    }

    /// Sources that came to their end since this was last asked.
    pub fn take_finished(&mut self) -> Vec<SourceId> {
        self.collect();
        std::mem::take(&mut self.finished)
    }

    /// Figures.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        let Figures { sources, voices, loudest, late } = &*self.figures;
        Statistics {
            sources: sources.load(Ordering::Relaxed),
            voices: voices.load(Ordering::Relaxed),
            loudest: f32::from_bits(loudest.load(Ordering::Relaxed)),
            late: late.load(Ordering::Relaxed),
        }
    }
}
