//! A film beside a renderer: decoded ahead on a thread of its own.

use crate::{FilmError, Frame, FrameReader, Rate, ReadParams, Source, Stopper};
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// Seconds that a time may lie ahead of what is decoded before it is sought for instead of decoded up to.
const SEEK_BEYOND_S: f64 = 1.5;
/// Frames that are kept behind the one that shows: clocks of sound cards step back a little.
const KEPT_BEHIND: u64 = 1;

/// How a film is played.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlayerParams {
    /// Frames that are decoded ahead, at least 2. More survive longer pauses of the machine, and take memory: 3.3 MB each at 640x1280.
    pub ahead: usize,
    /// How they are read.
    pub read: ReadParams,
}

impl PlayerParams {
    /// A quarter of a second ahead at 30 frames a second, looping, on one core.
    #[must_use]
    pub fn playing() -> Self {
        Self { ahead: 8, read: ReadParams::playing() }
    }

    /// Once, from the beginning to the end.
    #[must_use]
    pub fn once() -> Self {
        let playing = Self::playing();
        Self { read: ReadParams { looping: false, ..playing.read }, ..playing }
    }
}

/// What is shown at a time.
#[derive(Clone, Debug)]
pub struct Shown {
    /// The picture; its number says whether it is another than before.
    pub frame: Arc<Frame>,
    /// The number that belongs to the time. The picture's own is smaller where it was not decoded in time.
    pub wanted: u64,
}

/// Plays a film, or an image and its mask in step: [`Player::frame_at`] never waits.
///
/// One decoder process reads both films of a pair, so both pictures always have the same number. Times are the caller's: ask for the sound's
/// own position, and pictures follow it within a frame. The same time again is a pause; any other time is sought. Dropped, it ends its
/// decoder and its thread within moments.
#[derive(Debug)]
pub struct Player {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    rate: Rate,
    size: (u32, u32),
    looping: bool,
}

#[derive(Debug)]
struct Shared {
    state: Mutex<State>,
    wake: Condvar,
}

#[derive(Debug, Default)]
struct State {
    /// Frames in order of their numbers: what shows, what follows.
    ring: VecDeque<Arc<Frame>>,
    /// What shows while a place is sought.
    last: Option<Arc<Frame>>,
    /// Memory of frames that nobody holds any more.
    spare: Vec<Vec<[u8; 4]>>,
    wanted: u64,
    /// The number that was counted as missed or shown last.
    judged: Option<u64>,
    /// Whether a wanted frame was there since the beginning, or since a place was sought: before that, none is missed.
    settled: bool,
    missed: u64,
    seek: Option<u64>,
    /// The number that the decoder gives next.
    next: u64,
    /// The number after the last frame of what does not loop.
    end: Option<u64>,
    /// The film's frames, once its end was met.
    length: Option<u64>,
    problem: Option<Arc<FilmError>>,
    stopper: Option<Stopper>,
    stop: bool,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Player {
    /// Starts decoding.
    ///
    /// # Errors
    /// If there is no `ffmpeg`. What is wrong with the film is told by [`Player::problem`].
    pub fn start(source: Source, params: &PlayerParams) -> Result<Self, FilmError> {
        let reader = FrameReader::open(source.clone(), &params.read)?;
        let (rate, size) = (reader.rate(), reader.size());
        let state = State { next: params.read.start, stopper: Some(reader.stopper()), ..State::default() };
        let shared = Arc::new(Shared { state: Mutex::new(state), wake: Condvar::new() });
        let worker = Worker { shared: shared.clone(), source, params: *params, length: None };
        let thread = std::thread::Builder::new().name("film".into()).spawn(move || worker.run(reader));
        let thread = thread.map_err(|error| FilmError::Program { program: "ffmpeg", problem: error.to_string() })?;
        Ok(Self { shared, thread: Some(thread), rate, size, looping: params.read.looping })
    }

    /// The latest frame not later than `time_s`, of those that are decoded; `None` before the first one is. Never waits for a decoder.
    ///
    /// Behind the end of what does not loop, the last frame stays. Times of a loop count on: in a film of 4 s, 9 s is the third pass's first second.
    #[must_use]
    pub fn frame_at(&self, time_s: f64) -> Option<Shown> {
        let mut state = self.shared.state();
        let mut wanted = self.rate.frame_at(time_s);
        if let Some(end) = state.end.filter(|_| !self.looping) {
            wanted = wanted.min(end.saturating_sub(1));
        }
        state.wanted = wanted;
        let beyond = state.next + (SEEK_BEYOND_S * self.rate.per_second()).ceil() as u64;
        let oldest = state.ring.front().map_or(state.next, |frame| frame.number);
        let sought = state.seek.is_some_and(|place| place <= wanted && wanted - place <= beyond - state.next);
        if !sought && (wanted < oldest || wanted > beyond) && state.problem.is_none() {
            state.seek = Some(wanted);
            state.settled = false;
            state.last = state.ring.front().cloned().or(state.last.take());
            // what it reads is not wanted any more
            if let Some(stopper) = state.stopper.take() {
                stopper.stop();
            }
        }
        state.forget(wanted);
        let found = state.ring.iter().rev().find(|frame| frame.number <= wanted).cloned();
        let there = found.as_ref().is_some_and(|frame| frame.number == wanted) && state.seek.is_none();
        if there {
            state.settled = true;
        } else if state.settled && state.judged != Some(wanted) {
            state.missed += 1;
        }
        state.judged = Some(wanted);
        self.shared.wake.notify_all();
        let frame = found.or_else(|| state.last.clone()).or_else(|| state.ring.front().cloned())?;
        Some(Shown { frame, wanted })
    }

    /// Frames that were not decoded when their time had come; a frame is counted once. Seeking is not counted.
    #[must_use]
    pub fn missed(&self) -> u64 {
        self.shared.state().missed
    }

    /// Frames that lie ready from the one that shows on.
    #[must_use]
    pub fn ready(&self) -> usize {
        let state = self.shared.state();
        state.ring.iter().filter(|frame| frame.number >= state.wanted).count()
    }

    /// Frames a second.
    #[must_use]
    pub fn rate(&self) -> Rate {
        self.rate
    }

    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// Whether the last frame of what does not loop has been decoded, and which time ends it, in seconds.
    #[must_use]
    pub fn end_s(&self) -> Option<f64> {
        self.shared.state().end.map(|end| self.rate.time_of(end))
    }

    /// The film's frames, once its end was met; before, nobody knows for sure.
    #[must_use]
    pub fn length(&self) -> Option<u64> {
        self.shared.state().length
    }

    /// Why no more frames come, where something went wrong.
    #[must_use]
    pub fn problem(&self) -> Option<Arc<FilmError>> {
        self.shared.state().problem.clone()
    }
}

impl Drop for Player {
    fn drop(&mut self) {
        let stopper = {
            let mut state = self.shared.state();
            state.stop = true;
            state.stopper.take()
        };
        if let Some(stopper) = stopper {
            stopper.stop();
        }
        self.shared.wake.notify_all();
        if let Some(thread) = self.thread.take() {
            // it panics nowhere, and if it did, its film is over all the same
            let _ = thread.join();
        }
    }
}

impl State {
    /// Takes frames out that are over, and keeps their memory where nobody else holds it.
    fn forget(&mut self, wanted: u64) {
        while self.ring.get(1).is_some_and(|second| second.number + KEPT_BEHIND <= wanted) {
            let Some(frame) = self.ring.pop_front() else { return };
            if let Ok(frame) = Arc::try_unwrap(frame) {
                self.spare.push(frame.pixels);
                self.spare.truncate(2);
            }
        }
    }
}

/// The thread's side.
struct Worker {
    shared: Arc<Shared>,
    source: Source,
    params: PlayerParams,
    length: Option<u64>,
}

impl Worker {
    fn run(mut self, reader: FrameReader) {
        let mut reader = Some(reader);
        while let Some(order) = self.wait(reader.is_some()) {
            let went_on = match order {
                Order::Seek(place) => {
                    drop(reader.take());
                    self.open(place).map(|opened| reader = Some(opened))
                }
                Order::Read(pixels) => match &mut reader {
                    Some(open) => self.read(open, pixels).map(|more| {
                        if !more {
                            reader = None;
                        }
                    }),
                    None => Ok(()),
                },
            };
            if let Err(problem) = went_on {
                let mut state = self.shared.state();
                state.problem = Some(Arc::new(problem));
                // nothing more comes
                return;
            }
        }
    }

    /// What is to be done next; `None` when all is over.
    fn wait(&self, reading: bool) -> Option<Order> {
        let mut state = self.shared.state();
        loop {
            if state.stop {
                return None;
            }
            if let Some(place) = state.seek.take() {
                state.ring.clear();
                state.next = place;
                return Some(Order::Seek(place));
            }
            if reading && state.ring.len() < self.params.ahead.max(2) + 1 {
                return Some(Order::Read(state.spare.pop().unwrap_or_default()));
            }
            state = self.shared.wake.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// A decoder at a number, which may lie in a later pass of a loop.
    fn open(&self, place: u64) -> Result<FrameReader, FilmError> {
        let film = self.source.film();
        let length = self.length.or_else(|| {
            let rate = self.params.read.rate.unwrap_or(film.rate);
            film.duration_s.map(|seconds| ((seconds * rate.per_second()).round() as u64).max(1))
        });
        let start = match length {
            Some(length) if self.params.read.looping => place % length,
            Some(length) => place.min(length.saturating_sub(1)),
            None => place,
        };
        let mut reader = FrameReader::open(self.source.clone(), &ReadParams { start, ..self.params.read })?;
        if self.params.read.looping {
            reader.count_from(place);
        } else {
            self.shared.state().next = start;
        }
        let mut state = self.shared.state();
        state.stopper = Some(reader.stopper());
        if state.stop {
            reader.stopper().stop();
        }
        Ok(reader)
    }

    /// Reads one frame into the ring; whether more may follow.
    fn read(&mut self, reader: &mut FrameReader, mut pixels: Vec<[u8; 4]>) -> Result<bool, FilmError> {
        let number = reader.read_into(&mut pixels);
        let mut state = self.shared.state();
        if state.stop || state.seek.is_some() {
            return Ok(true);
        }
        self.length = reader.length().or(self.length);
        state.length = self.length;
        let Some(number) = number? else {
            state.end = Some(state.next);
            return Ok(false);
        };
        let (width, height) = reader.size();
        state.ring.push_back(Arc::new(Frame { number, width, height, pixels }));
        state.next = number + 1;
        let wanted = state.wanted;
        state.forget(wanted);
        Ok(true)
    }
}

enum Order {
    Seek(u64),
    Read(Vec<[u8; 4]>),
}
