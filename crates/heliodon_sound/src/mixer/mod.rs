//! The mixer: everything that sounds, rendered to two ears.
//!
//! It works in slices of 64 frames that begin at the same frames however many are asked for at once, so a device and a
//! film get the same bits. Nothing in it locks, allocates, frees or opens files once it has been made: orders come through
//! a bounded queue, and what is done with goes back through another to be freed elsewhere.

pub(crate) mod bed;
pub(crate) mod command;
pub(crate) mod reader;
pub(crate) mod rooms;
pub(crate) mod source;
pub(crate) mod voice;

mod rank;

pub use bed::{CURVE_POINTS, CurveError, DayCurve, MAX_BEDS};
pub use reader::Content;
pub use rooms::MAX_ROOMS;
pub use source::{SourceSettings, Travel};

use crate::clock::Clock;
use crate::control::Control;
use crate::filter::{Glide, ShadowPole, glide_rate};
use crate::head::Head;
use crate::kernel::Kernel;
use crate::limiter::Limiter;
use crate::{RATE_HZ, SLICE};
use bed::{BED_S, Bed};
use command::{Change, Command, Figures, Returned, Timed};
use rank::Ranking;
use rooms::{CROSSING_S, RoomSet};
use rtrb::{Consumer, Producer, RingBuffer};
use source::{Source, State, Then};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use voice::{Hall, Voice};

/// The time constant of each of the two low-passes that places, levels and filters glide with, seconds.
pub const GLIDE_S: f32 = 0.02;

/// Slices in which a pause falls silent: 11 ms.
const PAUSE_SLICES: f32 = 8.0;

/// Slices in which what is sent to rooms falls silent before others take their place: seven time constants of a glide.
const CHANGE_SLICES: u32 = (7.0 * GLIDE_S * RATE_HZ as f32) as u32 / SLICE as u32;

/// Orders that may wait for their frame at once.
pub const MOST_WAITING: usize = 4096;

/// What a mixer is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MixerSettings {
    /// Sources that may exist at once, 1 to 65,536. More: 200 bytes each, and some nanoseconds to weigh each.
    pub sources: usize,
    /// Sources that are rendered at once, 1 to 256; the loudest. More: about 0.2 % of a core and 256 KiB each.
    pub voices: usize,
    /// Of these, the loudest so many get the first reflections of the room they share with the listener. Each costs as much as six more.
    pub reflected: usize,
}

impl Default for MixerSettings {
    fn default() -> Self {
        Self { sources: 4096, voices: 48, reflected: 6 }
    }
}

impl MixerSettings {
    fn within(self) -> Self {
        let voices = self.voices.clamp(1, 256);
        Self { sources: self.sources.clamp(1, 1 << 16), voices, reflected: self.reflected.min(voices) }
    }

    /// A mixer, and what it is told by. Numbers outside their ranges are brought to their nearest.
    #[must_use]
    pub fn build(&self) -> (Control, Mixer) {
        let settings = self.within();
        let (orders, commands) = RingBuffer::new(2 * settings.sources + 8192);
        let (returns, returned) = RingBuffer::new(2 * settings.sources + MAX_BEDS + 64);
        let (clock, figures) = (Clock::new(), Arc::new(Figures::default()));
        let head = Head::default();
        let mixer = Mixer {
            settings,
            kernel: Kernel::new(),
            commands,
            returns,
            waiting: Vec::with_capacity(MOST_WAITING),
            sources: (0..settings.sources).map(|_| None).collect(),
            alive: Vec::with_capacity(settings.sources),
            voices: (0..settings.voices).map(|_| Voice::new()).collect(),
            reflects: vec![false; settings.voices],
            ranking: Ranking::new(settings.sources),
            rooms: None,
            incoming: None,
            leaving: None,
            beds: (0..MAX_BEDS).map(|_| None).collect(),
            hour: 12.0,
            head,
            pole: ShadowPole::new(head.radius_m()),
            volume: (1.0, Glide::at(1.0)),
            muted: false,
            paused: false,
            open: 1.0,
            limiter: Limiter::new(),
            rates: [GLIDE_S, CROSSING_S, BED_S].map(glide_rate),
            buses: Box::new([[0.0; SLICE]; MAX_ROOMS]),
            block: [[0.0; 2]; SLICE],
            given: SLICE,
            frame: 0,
            clock: clock.clone(),
            figures: Arc::clone(&figures),
        };
        (Control::new(orders, returned, settings.sources, clock, figures), mixer)
    }
}

/// Renders. Made by [`MixerSettings::build`], together with its [`Control`].
#[derive(Debug)]
pub struct Mixer {
    settings: MixerSettings,
    kernel: Kernel,
    commands: Consumer<Timed>,
    returns: Producer<Returned>,
    /// By frame, and in the order in which they came.
    waiting: Vec<Timed>,
    sources: Vec<Option<Box<Source>>>,
    /// Slots that hold a source.
    alive: Vec<u32>,
    voices: Vec<Voice>,
    reflects: Vec<bool>,
    ranking: Ranking,
    rooms: Option<Box<RoomSet>>,
    /// Rooms that come when what is sent to those before has fallen silent, and the slices until then.
    incoming: Option<(Box<RoomSet>, u32)>,
    leaving: Option<Box<RoomSet>>,
    beds: Vec<Option<Box<Bed>>>,
    hour: f32,
    head: Head,
    pole: ShadowPole,
    volume: (f32, Glide),
    muted: bool,
    paused: bool,
    open: f32,
    limiter: Limiter,
    rates: [f32; 3],
    buses: Box<[[f32; SLICE]; MAX_ROOMS]>,
    block: [[f32; 2]; SLICE],
    /// Frames of the block that have been handed out.
    given: usize,
    frame: u64,
    clock: Clock,
    figures: Arc<Figures>,
}

impl Mixer {
    /// Fills `out` with the next frames, left and right interleaved; a last odd sample is silent. No sample is louder than
    /// [`crate::limiter::CEILING`].
    pub fn render(&mut self, out: &mut [f32]) {
        let mut frames = out.chunks_exact_mut(2);
        for frame in &mut frames {
            if self.given == SLICE {
                self.slice();
                self.given = 0;
            }
            frame.copy_from_slice(&self.block[self.given]);
            self.given += 1;
        }
        frames.into_remainder().fill(0.0);
    }

    /// Lets about so many frames go by unheard, in whole slices: where there is nothing to play them. Returns how many.
    pub fn pass(&mut self, frames: usize) -> usize {
        let slices = frames / SLICE;
        for _ in 0..slices {
            self.receive();
            if !self.paused {
                self.pass_slice();
            }
        }
        (self.block, self.given) = ([[0.0; 2]; SLICE], SLICE);
        slices * SLICE
    }

    /// The mixer's time: frames rendered, but for those of pauses.
    #[must_use]
    pub fn frame(&self) -> u64 {
        self.frame
    }

    /// The frame that comes first out of the next [`Self::render`].
    #[must_use]
    pub fn next_frame(&self) -> u64 {
        self.frame - (SLICE - self.given) as u64
    }

    /// Its clock.
    #[must_use]
    pub fn clock(&self) -> Clock {
        self.clock.clone()
    }

    fn slice(&mut self) {
        self.receive();
        let pause_step = if self.paused { -1.0 } else { 1.0 } / PAUSE_SLICES;
        let open = (self.open + pause_step).clamp(0.0, 1.0);
        let mut ears = [[0.0; SLICE]; 2];
        if self.open > 0.0 || open > 0.0 {
            self.sound(&mut ears);
            self.advance();
        }
        let volume = self.volume.1.slice(if self.muted { 0.0 } else { self.volume.0 }, self.rates[0]);
        let mut loudest = 0.0_f32;
        let [left, right] = ears;
        for (k, ears) in left.into_iter().zip(right).enumerate() {
            let pause = self.open + (open - self.open) * (k + 1) as f32 / SLICE as f32;
            let gain = volume.at(k) * pause * pause * (3.0 - 2.0 * pause);
            self.block[k] = self.limiter.next([ears.0 * gain, ears.1 * gain]);
            loudest = loudest.max(self.block[k][0].abs()).max(self.block[k][1].abs());
        }
        self.open = open;
        self.figures.loudest.store(loudest.to_bits(), Ordering::Relaxed);
    }

    fn advance(&mut self) {
        self.frame += SLICE as u64;
        self.clock.set_rendered(self.frame);
    }

    /// One slice of everything, before the volume.
    fn sound(&mut self, ears: &mut [[f32; SLICE]; 2]) {
        let after = self.frame + SLICE as u64;
        self.buses.iter_mut().for_each(|bus| bus.fill(0.0));
        self.change_rooms();
        self.choose();
        let room = self.rooms.as_ref().and_then(|set| set.room_of(self.head.position));
        let hall = Hall {
            kernel: &self.kernel,
            head: self.head,
            pole: self.pole,
            rate: self.rates[0],
            rooms: self.rooms.as_deref(),
            room,
            changing: self.incoming.is_some(),
        };
        for slot in &self.alive {
            let Some(source) = &mut self.sources[*slot as usize] else { continue };
            let Some(voice) = source.voice else {
                if source.is_sounding() {
                    source.pass(after);
                }
                continue;
            };
            let (voice, reflects) = (&mut self.voices[usize::from(voice)], self.reflects[usize::from(voice)]);
            let mut sent = [0.0; SLICE];
            if source.is_sounding() {
                source.send(&self.kernel, self.rates[0], after, &mut sent);
                source.tail = source.way_slices(voice::audible(source.settings.place, &self.head));
            } else {
                source.tail = source.tail.saturating_sub(1);
            }
            voice.ring.write(&sent);
            let stays = voice.slice(&source.settings, &hall, reflects, ears, &mut self.buses);
            if !stays || source.tail == 0 {
                (voice.source, source.voice, source.tail) = (None, None, 0);
            }
        }
        if let Some(rooms) = &mut self.rooms {
            rooms.slice(self.head.position, room, Some(&self.buses), self.rates[1], ears);
        }
        if let Some(leaving) = &mut self.leaving
            && !leaving.slice(self.head.position, None, None, self.rates[1], ears)
            && let Some(gone) = self.leaving.take()
        {
            self.give_back(Returned::Rooms(gone));
        }
        let open = self.rooms.as_ref().map_or(1.0, |rooms| rooms.openness(room));
        for slot in 0..self.beds.len() {
            let Some(bed) = &mut self.beds[slot] else { continue };
            if !bed.slice(self.hour, open, self.rates[2], after, &self.kernel, ears)
                && let Some(bed) = self.beds[slot].take()
            {
                self.give_back(Returned::Bed { slot: slot as u32, bed });
            }
        }
        self.bury();
    }

    /// Lets other rooms in, once it is quiet in those before.
    fn change_rooms(&mut self) {
        match self.incoming.take() {
            Some((rooms, 0)) => {
                let old = self.rooms.replace(rooms);
                if let Some(old) = std::mem::replace(&mut self.leaving, old) {
                    self.give_back(Returned::Rooms(old));
                }
            }
            waiting => self.incoming = waiting.map(|(rooms, slices)| (rooms, slices - 1)),
        }
    }

    /// A slice in which nothing is heard, but time goes by for everything.
    fn pass_slice(&mut self) {
        let after = self.frame + SLICE as u64;
        for slot in &self.alive {
            let Some(source) = &mut self.sources[*slot as usize] else { continue };
            if let Some(voice) = source.voice.take() {
                self.voices[usize::from(voice)].source = None;
            }
            source.tail = 0;
            if source.is_sounding() {
                source.pass(after);
            }
        }
        for slot in 0..self.beds.len() {
            let Some(bed) = &mut self.beds[slot] else { continue };
            bed.pass(after);
            if bed.leaves
                && let Some(bed) = self.beds[slot].take()
            {
                self.give_back(Returned::Bed { slot: slot as u32, bed });
            }
        }
        self.change_rooms();
        if let Some(gone) = self.leaving.take() {
            self.give_back(Returned::Rooms(gone));
        }
        self.bury();
        self.advance();
    }

    /// Takes away what is at its end and no longer on its way.
    fn bury(&mut self) {
        let mut k = 0;
        while k < self.alive.len() {
            let slot = self.alive[k];
            k += 1;
            let Some(source) = &mut self.sources[slot as usize] else { continue };
            if source.tail > 0 || !matches!(source.state, State::Over | State::Gone) {
                continue;
            }
            let finished = source.state == State::Over;
            if finished && source.settings.stays {
                source.state = State::Still;
                source.reader.seek(0.0);
                let generation = source.generation;
                self.give_back(Returned::Finished { slot, generation });
            } else if let Some(source) = self.sources[slot as usize].take() {
                self.give_back(Returned::Source { slot, source, finished });
                k -= 1;
                self.alive.remove(k);
            }
        }
        self.figures.sources.store(self.alive.len() as u32, Ordering::Relaxed);
    }

    /// The queue holds more than can ever be under way at once; were it full, this would be freed here.
    fn give_back(&mut self, returned: Returned) {
        let _ = self.returns.push(returned);
    }

    /// Reads what has been ordered, and carries out what is due in the next slice.
    fn receive(&mut self) {
        let after = self.frame + SLICE as u64;
        while let Ok(timed) = self.commands.pop() {
            match timed.at {
                Some(at) if at >= after && self.waiting.len() < MOST_WAITING => {
                    let place = self.waiting.partition_point(|other| other.at <= timed.at);
                    self.waiting.insert(place, timed);
                }
                _ => self.carry_out(timed),
            }
        }
        let due = self.waiting.partition_point(|timed| timed.at.is_none_or(|at| at < after));
        for _ in 0..due {
            // the first is the earliest; there are few
            let timed = self.waiting.remove(0);
            self.carry_out(timed);
        }
    }

    fn carry_out(&mut self, timed: Timed) {
        if timed.at.is_some_and(|at| at < self.frame) {
            self.figures.late.fetch_add(1, Ordering::Relaxed);
        }
        let offset = timed.at.map_or(0, |at| at.saturating_sub(self.frame).min(SLICE as u64 - 1) as usize);
        match timed.command {
            Command::Add { slot, mut source } => {
                if source.settings.playing {
                    source.start(offset);
                    self.ranking.again = true;
                }
                self.alive.push(slot);
                self.sources[slot as usize] = Some(source);
            }
            Command::Change { slot, generation, change } => self.change(slot, generation, change, offset),
            Command::Listener(head) => (self.head, self.pole) = (head, ShadowPole::new(head.radius_m())),
            Command::Rooms(rooms) => {
                let wait = if self.rooms.is_some() { CHANGE_SLICES } else { 0 };
                if let Some((other, _)) = self.incoming.replace((rooms, wait)) {
                    self.give_back(Returned::Rooms(other));
                }
            }
            Command::AddBed { slot, bed } => self.beds[slot as usize] = Some(bed),
            Command::BedGain { slot, gain } => {
                if let Some(bed) = &mut self.beds[slot as usize] {
                    bed.gain = gain;
                }
            }
            Command::RemoveBed { slot } => {
                if let Some(bed) = &mut self.beds[slot as usize] {
                    bed.leaves = true;
                }
            }
            Command::Hour(hour) => self.hour = hour,
            Command::Volume(volume) => self.volume.0 = volume,
            Command::Mute(muted) => self.muted = muted,
            Command::Pause(paused) => self.paused = paused,
        }
    }

    fn change(&mut self, slot: u32, generation: u32, change: Change, offset: usize) {
        // it may have come to its end while this was under way
        let Some(source) = self.sources[slot as usize].as_mut().filter(|source| source.generation == generation) else {
            return;
        };
        match change {
            Change::Place(place) => source.settings.place = place,
            Change::Gain(gain) => source.settings.gain = gain,
            Change::Occlusion(occlusion) => source.settings.occlusion = occlusion,
            Change::Rate(rate) => source.reader.rate = rate,
            Change::Settings(settings) => {
                source.settings = settings;
                (source.reader.looping, source.reader.rate) = (settings.looping, settings.rate);
            }
            Change::Start => self.ranking.again |= source.start(offset),
            Change::Stop => source.fall(Then::Stop),
            Change::Seek(seconds) => source.fall(Then::Seek(seconds)),
            Change::Remove => source.fall(Then::Remove),
        }
    }

    /// Seconds that have been rendered.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.frame as f64 / f64::from(RATE_HZ)
    }
}
