//! Sound that comes from outside as it is made, such as a film's: pushed by one thread, heard at a source, and a clock that says
//! which of it is being heard.
//!
//! Pictures follow the sound: whoever shows a film asks [`FeedClock::heard_s`] and shows the picture of that time. Where sound
//! runs dry the clock stands until there is more; after a [`FeedWriter::restart`] it goes on from where the writer said.

use crate::clock::{Clock, Together};
use crate::resample::{RateError, Resampler};
use crate::{LATENCY_FRAMES, RATE_HZ, SLICE};
use rtrb::{Consumer, Producer, RingBuffer};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;
use thiserror::Error;

/// Seconds that a feed may hold.
pub const BUFFERS_S: std::ops::RangeInclusive<f64> = 0.05..=10.0;

/// Slices that must have come before a feed begins to sound, and begins again after it ran dry: 11 ms.
const BEFORE_IT_BEGINS: usize = 8;

/// Why there is no feed.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum FeedError {
    /// See [`RateError`].
    #[error(transparent)]
    Rate(#[from] RateError),
    /// Neither mono nor stereo.
    #[error("a feed of {0} channels cannot be placed; mix it down to one or two")]
    Channels(usize),
    /// Too much or too little to hold.
    #[error("a feed that holds {0} s; give 0.05 to 10 seconds")]
    Buffer(f64),
}

#[derive(Debug)]
struct Shared {
    /// Frames that the mixer has taken, and the mixer's frame after the last of them.
    taken: Together<2>,
    /// Frames before this one, of all that were written, are not to be heard.
    from: AtomicU64,
    ended: AtomicBool,
    /// Frames that were written in all.
    written: AtomicU64,
    /// How often it ran dry.
    dry: AtomicU64,
    /// Where the present stretch begins: frames written before it, and its time in the film. Never touched by the audio thread.
    stretch: Mutex<(u64, f64)>,
}

impl Shared {
    fn stretch(&self) -> MutexGuard<'_, (u64, f64)> {
        self.stretch.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The end that is written to.
#[derive(Debug)]
pub struct FeedWriter {
    producer: Producer<f32>,
    resampler: Resampler,
    channels: usize,
    shared: Arc<Shared>,
    written: u64,
    scratch: Vec<f32>,
}

/// The end that a [source](crate::Control::add) plays.
#[derive(Debug)]
pub struct FeedReader {
    consumer: Consumer<f32>,
    channels: usize,
    shared: Arc<Shared>,
    taken: u64,
    running: bool,
}

/// Tells which time of a feed is being heard. Clones tell the same.
#[derive(Clone, Debug)]
pub struct FeedClock {
    shared: Arc<Shared>,
}

/// A feed of interleaved samples at some rate, of one or two channels, that holds up to `buffer_s` of them. More: safer against a
/// writer that is late. Less: less to throw away when a film is wound.
///
/// # Errors
///
/// What [`FeedError`] lists.
pub fn feed(rate_hz: u32, channels: usize, buffer_s: f64) -> Result<(FeedWriter, FeedReader), FeedError> {
    if !(1..=2).contains(&channels) {
        return Err(FeedError::Channels(channels));
    }
    if !BUFFERS_S.contains(&buffer_s) {
        return Err(FeedError::Buffer(buffer_s));
    }
    let resampler = Resampler::new(rate_hz, RATE_HZ, channels)?;
    let frames = (buffer_s * f64::from(RATE_HZ)) as usize + 2 * SLICE;
    let (producer, consumer) = RingBuffer::new(frames * channels);
    let shared = Arc::new(Shared {
        taken: Together::new([0; 2]),
        from: AtomicU64::new(0),
        ended: AtomicBool::new(false),
        written: AtomicU64::new(0),
        dry: AtomicU64::new(0),
        stretch: Mutex::new((0, 0.0)),
    });
    let reader = FeedReader { consumer, channels, shared: Arc::clone(&shared), taken: 0, running: false };
    Ok((FeedWriter { producer, resampler, channels, shared, written: 0, scratch: Vec::new() }, reader))
}

impl FeedWriter {
    /// 1 or 2.
    #[must_use]
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// How many frames can be pushed now.
    #[must_use]
    pub fn space_frames(&self) -> usize {
        let free = self.producer.slots() / self.channels;
        // as many as come out as no more than is free
        let (mut low, mut high) = (0, free * 1000);
        while low < high {
            let middle = (low + high).div_ceil(2);
            if self.resampler.most_frames(middle) <= free { low = middle } else { high = middle - 1 }
        }
        low
    }

    /// Takes as many of these interleaved frames as there is space for, and says how many. Samples that are no numbers are silent.
    pub fn push(&mut self, samples: &[f32]) -> usize {
        let frames = (samples.len() / self.channels).min(self.space_frames());
        self.scratch.clear();
        self.resampler.push(&samples[..frames * self.channels], &mut self.scratch);
        for sample in &self.scratch {
            // there is space: it was asked for above, and only the reader's end makes more
            let _ = self.producer.push(if sample.is_finite() { sample.clamp(-64.0, 64.0) } else { 0.0 });
        }
        self.written += (self.scratch.len() / self.channels) as u64;
        self.shared.written.store(self.written, Ordering::Release);
        frames
    }

    /// Whatever was pushed and not heard will not be; what is pushed from now on begins at `time_s` of the film.
    pub fn restart(&mut self, time_s: f64) {
        *self.shared.stretch() = (self.written, time_s);
        self.shared.ended.store(false, Ordering::Release);
        self.shared.from.store(self.written, Ordering::Release);
    }

    /// Nothing more comes: when all has been heard the source is at its end.
    pub fn end(&mut self) {
        self.scratch.clear();
        self.resampler.finish(&mut self.scratch);
        let fits = self.scratch.len().min(self.producer.slots() / self.channels * self.channels);
        for sample in &self.scratch[..fits] {
            let _ = self.producer.push(if sample.is_finite() { *sample } else { 0.0 });
        }
        self.written += (fits / self.channels) as u64;
        self.shared.written.store(self.written, Ordering::Release);
        self.shared.ended.store(true, Ordering::Release);
    }

    /// Whether nobody can hear this any more.
    #[must_use]
    pub fn is_abandoned(&self) -> bool {
        self.producer.is_abandoned()
    }

    /// Seconds that wait to be heard.
    #[must_use]
    pub fn waiting_s(&self) -> f64 {
        self.clock().waiting_s()
    }

    /// A clock of it.
    #[must_use]
    pub fn clock(&self) -> FeedClock {
        FeedClock { shared: Arc::clone(&self.shared) }
    }
}

impl FeedClock {
    /// The time of the film that is heard at an instant, seconds; `clock` is the mixer's.
    #[must_use]
    pub fn heard_s(&self, clock: &Clock, now: Instant) -> f64 {
        let [taken, frame] = self.shared.taken.read();
        let (begin, time_s) = *self.shared.stretch();
        // what was taken last sounds LATENCY later than the frame that took it
        let behind = frame as f64 - clock.heard_frame(now);
        let heard = (taken as f64 - behind.max(0.0)).max(begin as f64);
        time_s + (heard - begin as f64) / f64::from(RATE_HZ)
    }

    /// Seconds that wait to be heard.
    #[must_use]
    pub fn waiting_s(&self) -> f64 {
        let [taken, _] = self.shared.taken.read();
        let from = self.shared.from.load(Ordering::Acquire);
        self.shared.written.load(Ordering::Acquire).saturating_sub(taken.max(from)) as f64 / f64::from(RATE_HZ)
    }

    /// Whether nothing more comes.
    #[must_use]
    pub fn is_ended(&self) -> bool {
        self.shared.ended.load(Ordering::Acquire)
    }

    /// How often it ran dry.
    #[must_use]
    pub fn dry(&self) -> u64 {
        self.shared.dry.load(Ordering::Relaxed)
    }
}

impl FeedReader {
    /// 1 or 2.
    #[must_use]
    pub fn channels(&self) -> usize {
        self.channels
    }

    fn available(&self) -> usize {
        self.consumer.slots() / self.channels
    }

    /// The next slice; `frame` is the mixer's after it. Returns whether the feed is at its end.
    pub(crate) fn slice(&mut self, frame: u64, out: &mut [[f32; SLICE]; 2]) -> bool {
        let from = self.shared.from.load(Ordering::Acquire);
        let ended = self.shared.ended.load(Ordering::Acquire);
        let wound = self.taken < from;
        out.iter_mut().for_each(|channel| channel.fill(0.0));
        if wound && !self.running {
            self.discard((from - self.taken) as usize);
        }
        let available = self.available();
        let begins = !self.running && !wound && (available >= BEFORE_IT_BEGINS * SLICE || ended && available > 0);
        if !begins && !self.running {
            let over = ended && !wound && available == 0;
            self.shared.taken.write([self.taken, frame]);
            return over;
        }
        // the last slice before it runs dry or is wound fades away
        let goes_on = !wound && (available >= 2 * SLICE || ended);
        let frames = available.min(SLICE);
        self.take(frames, out);
        for k in 0..SLICE {
            let rise = 0.5 - 0.5 * libm::cosf(std::f32::consts::PI * (k as f32 + 0.5) / SLICE as f32);
            let weight = match (begins, goes_on) {
                (true, true) => rise,
                (false, false) => 1.0 - rise,
                (true, false) => 0.0,
                (false, true) => break,
            };
            out.iter_mut().for_each(|channel| channel[k] *= weight);
        }
        if !goes_on && !wound {
            self.shared.dry.fetch_add(1, Ordering::Relaxed);
        }
        self.running = goes_on;
        self.shared.taken.write([self.taken, frame]);
        ended && !wound && self.available() == 0
    }

    /// As much time goes by as a slice has, unheard.
    pub(crate) fn pass(&mut self, frame: u64) -> bool {
        let from = self.shared.from.load(Ordering::Acquire);
        let ended = self.shared.ended.load(Ordering::Acquire);
        if self.taken < from {
            self.discard((from - self.taken) as usize);
        }
        self.running = false;
        self.discard(SLICE);
        self.shared.taken.write([self.taken, frame]);
        ended && self.available() == 0
    }

    fn discard(&mut self, frames: usize) {
        let frames = frames.min(self.available());
        if let Ok(chunk) = self.consumer.read_chunk(frames * self.channels) {
            chunk.commit_all();
            self.taken += frames as u64;
        }
    }

    fn take(&mut self, frames: usize, out: &mut [[f32; SLICE]; 2]) {
        let Ok(chunk) = self.consumer.read_chunk(frames * self.channels) else { return };
        for (k, sample) in chunk.into_iter().enumerate() {
            out[k % self.channels][k / self.channels] = sample;
        }
        self.taken += frames as u64;
    }
}

/// How late a feed is heard after the mixer took it, seconds, where its source has no way through air.
pub const FEED_LATENCY_S: f64 = LATENCY_FRAMES as f64 / RATE_HZ as f64;
