//! The sound of a film: decoded on a thread of its own and pushed into a feed, pass after pass in step with the pictures.

use heliodon_film::{Film, SoundReader, Stopper};
use heliodon_sound::RATE_HZ;
use heliodon_sound::clock::Clock;
use heliodon_sound::feed::{FeedClock, FeedReader, FeedWriter, feed};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Seconds of sound that are decoded ahead. More survive longer pauses of the machine; each takes 0.4 MB.
const AHEAD_S: f64 = 0.5;
/// How long the thread rests where there is no space.
const REST: Duration = Duration::from_millis(4);
/// Samples that are read at once, of each channel: 21 ms.
const BLOCK: usize = 1024;

/// A film's sound on its way to the mixer.
#[derive(Debug)]
pub struct Voice {
    shared: Arc<Shared>,
    clock: FeedClock,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    stop: AtomicBool,
    /// Nanoseconds of a pass of the pictures; 0 while nobody knows.
    pass_ns: AtomicU64,
    stopper: Mutex<Option<Stopper>>,
}

impl Shared {
    fn stopper(&self) -> MutexGuard<'_, Option<Stopper>> {
        self.stopper.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The sample at which a pass begins, where it is known.
    fn begins(&self, pass: u64) -> Option<u64> {
        let pass_ns = self.pass_ns.load(Ordering::Relaxed);
        let sample = u128::from(pass) * u128::from(pass_ns) * u128::from(RATE_HZ) / 1_000_000_000;
        (pass_ns > 0 || pass == 0).then(|| u64::try_from(sample).unwrap_or(u64::MAX))
    }
}

impl Voice {
    /// Begins to decode from the film's beginning; the reader is for a source of the mixer. `None` where the film is silent, or no thread can be had.
    #[must_use]
    pub fn begin(film: &Film, looping: bool, pass_s: Option<f64>) -> Option<(Self, FeedReader)> {
        let channels = film.sound.as_ref()?.channels.clamp(1, 2);
        let (writer, reader) = feed(RATE_HZ, channels as usize, AHEAD_S).ok()?;
        let (shared, clock, film) = (Arc::new(Shared::default()), writer.clock(), film.clone());
        let theirs = Arc::clone(&shared);
        let thread = std::thread::Builder::new().name("film sound".to_owned());
        let thread = thread.spawn(move || theirs.read(&film, looping, writer)).ok();
        let voice = Self { shared, clock, thread };
        voice.set_pass_s(pass_s);
        voice.thread.is_some().then_some((voice, reader))
    }

    /// How long a pass of the pictures is, so that each pass of the sound begins with theirs: longer sound is cut, shorter is followed by silence.
    pub fn set_pass_s(&self, pass_s: Option<f64>) {
        let pass_ns = pass_s.map_or(0, |seconds| (seconds.clamp(0.0, 1e9) * 1e9).round() as u64);
        self.shared.pass_ns.store(pass_ns, Ordering::Relaxed);
    }

    /// The second of the film that is heard; counts on over passes. `None` once all has been heard.
    #[must_use]
    pub fn heard_s(&self, mixer: &Clock, now: Instant) -> Option<f64> {
        let over = self.clock.is_ended() && self.clock.waiting_s() <= 0.0;
        (!over).then(|| self.clock.heard_s(mixer, now))
    }

    /// Seconds that wait to be heard.
    #[cfg(test)]
    pub fn waiting_s(&self) -> f64 {
        self.clock.waiting_s()
    }
}

impl Drop for Voice {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(stopper) = self.shared.stopper().take() {
            stopper.stop();
        }
        if let Some(thread) = self.thread.take() {
            // it has nothing to say
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn read(&self, film: &Film, looping: bool, mut writer: FeedWriter) {
        let channels = writer.channels();
        let (mut written, mut block) = (0, vec![0.0; BLOCK * channels]);
        for pass in 0.. {
            let before = written;
            if self.read_pass(film, looping.then_some(pass), &mut writer, &mut written, &mut block).is_none() {
                return;
            }
            if !looping || written == before {
                break;
            }
        }
        writer.end();
    }

    /// One pass; of a loop, up to where the next begins. `None` where nobody listens any more.
    fn read_pass(
        &self,
        film: &Film,
        pass: Option<u64>,
        writer: &mut FeedWriter,
        written: &mut u64,
        block: &mut [f32],
    ) -> Option<()> {
        let channels = writer.channels();
        let opened = SoundReader::open(film, 0.0, RATE_HZ, channels as u32).ok().flatten();
        let mut reader = opened;
        *self.stopper() = reader.as_ref().map(SoundReader::stopper);
        if self.stop.load(Ordering::Relaxed) {
            return None;
        }
        // A pass may have turned out to be shorter or longer than the header says after some of its sound was sent.
        let begins = pass.and_then(|pass| self.begins(pass)).unwrap_or(*written);
        let mut skipped = written.saturating_sub(begins);
        self.silence(begins, writer, written, block)?;
        let ends = || pass.and_then(|pass| self.begins(pass + 1));
        while let Some(open) = &mut reader {
            let read = open.read(block) / channels;
            let skip = (read as u64).min(skipped);
            skipped -= skip;
            let room = ends().map_or(u64::MAX, |ends| ends.saturating_sub(*written));
            let sent = (read as u64 - skip).min(room) as usize;
            let first = skip as usize * channels;
            self.push(&block[first..first + sent * channels], writer, written)?;
            if read * channels < block.len() || (sent as u64) == room {
                reader = None;
            }
        }
        self.silence(ends().unwrap_or(*written), writer, written, block)
    }

    /// Nothing, up to a sample.
    fn silence(&self, until: u64, writer: &mut FeedWriter, written: &mut u64, block: &mut [f32]) -> Option<()> {
        block.fill(0.0);
        let channels = writer.channels();
        while *written < until {
            let frames = (until - *written).min(BLOCK as u64) as usize;
            self.push(&block[..frames * channels], writer, written)?;
        }
        Some(())
    }

    fn push(&self, samples: &[f32], writer: &mut FeedWriter, written: &mut u64) -> Option<()> {
        let (channels, mut sent) = (writer.channels(), 0);
        while sent < samples.len() {
            if self.stop.load(Ordering::Relaxed) || writer.is_abandoned() {
                return None;
            }
            let frames = writer.push(&samples[sent..]);
            sent += frames * channels;
            *written += frames as u64;
            if sent < samples.len() {
                std::thread::sleep(REST);
            }
        }
        Some(())
    }
}
