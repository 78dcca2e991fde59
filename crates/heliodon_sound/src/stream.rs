//! Long files, read from disk as they are heard, on a thread of their own.

use crate::feed::{FeedClock, FeedReader, FeedWriter, feed};
use crate::file::{FileError, SoundFile};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Seconds that are read ahead. More: safer against a slow disk.
const AHEAD_S: f64 = 2.0;

/// How long the thread sleeps when enough is read.
const REST: Duration = Duration::from_millis(20);

/// A file that is being read. It stops when this is dropped, or when nobody listens any more.
#[derive(Debug)]
pub struct Stream {
    shared: Arc<Shared>,
    clock: FeedClock,
    seconds: Option<f64>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    stop: AtomicBool,
    wind: Mutex<Option<f64>>,
    trouble: Mutex<Option<String>>,
}

fn held<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Stream {
    /// Opens a file; the reader is for a [source](crate::Control::add) or a bed. Where it is repeated the feed's time goes on.
    ///
    /// # Errors
    ///
    /// What cannot be read, and what is no sound.
    pub fn open(path: &Path, looping: bool) -> Result<(Self, FeedReader), FileError> {
        let file = SoundFile::open(path)?;
        let unknown = |what: String| FileError::Unknown { path: path.to_owned(), what };
        let (writer, reader) = feed(file.rate_hz(), file.channels(), AHEAD_S).map_err(|error| unknown(error.to_string()))?;
        let (shared, clock, seconds) = (Arc::new(Shared::default()), writer.clock(), file.told_seconds());
        let theirs = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("sound file".to_owned())
            .spawn(move || theirs.read(file, writer, looping))
            .map_err(|source| FileError::Read { path: path.to_owned(), source })?;
        Ok((Self { shared, clock, seconds, thread: Some(thread) }, reader))
    }

    /// Which time of it is being heard.
    #[must_use]
    pub fn clock(&self) -> FeedClock {
        self.clock.clone()
    }

    /// Its length as the file tells it, seconds.
    #[must_use]
    pub fn seconds(&self) -> Option<f64> {
        self.seconds
    }

    /// Waits until so many seconds (at most 1.5) are read ahead or the file is at its end: where sound is rendered off line, faster than
    /// it is heard. After [`Self::wind`] render ten milliseconds first, so that what was read before makes room. Returns whether it came to
    /// that within `patience`.
    #[must_use]
    pub fn wait(&self, ahead_s: f64, patience: Duration) -> bool {
        let began = std::time::Instant::now();
        while self.clock.waiting_s() < ahead_s.min(1.5) && !self.clock.is_ended() {
            if began.elapsed() > patience {
                return false;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        true
    }

    /// To another time, seconds: what was read ahead is not heard.
    pub fn wind(&self, seconds: f64) {
        *held(&self.shared.wind) = Some(seconds);
    }

    /// What went wrong on the way, once; what was read until then is heard.
    #[must_use]
    pub fn take_trouble(&self) -> Option<String> {
        held(&self.shared.trouble).take()
    }
}

impl Drop for Stream {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // it has nothing to say but what take_trouble tells
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn read(&self, mut file: SoundFile, mut writer: FeedWriter, looping: bool) {
        let (channels, mut packet, mut sent, mut over) = (writer.channels(), Vec::new(), 0, false);
        while !self.stop.load(Ordering::Relaxed) && !writer.is_abandoned() {
            let wind = held(&self.wind).take();
            if let Some(seconds) = wind.filter(|seconds| seconds.is_finite()) {
                match file.rewind(seconds) {
                    Ok(at) => {
                        writer.restart(at);
                        packet.clear();
                        (sent, over) = (0, false);
                    }
                    Err(error) => *held(&self.trouble) = Some(error.to_string()),
                }
            }
            if sent < packet.len() {
                sent += writer.push(&packet[sent..]) * channels;
                if sent < packet.len() {
                    std::thread::sleep(REST);
                }
                continue;
            }
            if over {
                std::thread::sleep(REST);
                continue;
            }
            packet.clear();
            sent = 0;
            let more = file.packet(&mut packet).and_then(|more| match (more, looping) {
                (false, true) => file.rewind(0.0).and_then(|_| file.packet(&mut packet)),
                (more, _) => Ok(more),
            });
            match more {
                Ok(true) => {}
                Ok(false) => {
                    writer.end();
                    over = true;
                }
                Err(error) => {
                    *held(&self.trouble) = Some(error.to_string());
                    writer.end();
                    over = true;
                }
            }
        }
    }
}
