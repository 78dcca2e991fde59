//! Which moment is being heard: told by the audio thread without a lock, asked by everybody.

use crate::{LATENCY_FRAMES, RATE_HZ};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering, fence};
use std::time::{Duration, Instant};

/// Numbers that are written together by one thread and read together by others: a sequence lock. The writer never waits.
#[derive(Debug)]
pub(crate) struct Together<const N: usize> {
    version: AtomicU64,
    words: [AtomicU64; N],
}

impl<const N: usize> Together<N> {
    pub(crate) fn new(words: [u64; N]) -> Self {
        Self { version: AtomicU64::new(0), words: words.map(AtomicU64::new) }
    }

    /// By one thread only.
    pub(crate) fn write(&self, words: [u64; N]) {
        let version = self.version.load(Ordering::Relaxed);
        self.version.store(version.wrapping_add(1), Ordering::Relaxed);
        fence(Ordering::Release);
        for (place, word) in self.words.iter().zip(words) {
            place.store(word, Ordering::Relaxed);
        }
        self.version.store(version.wrapping_add(2), Ordering::Release);
    }

    /// As they were after one write: asked again while a write is under way, which takes nanoseconds.
    pub(crate) fn read(&self) -> [u64; N] {
        loop {
            let before = self.version.load(Ordering::Acquire);
            let words = std::array::from_fn(|k| self.words[k].load(Ordering::Relaxed));
            fence(Ordering::Acquire);
            if before.is_multiple_of(2) && self.version.load(Ordering::Relaxed) == before {
                return words;
            }
            std::hint::spin_loop();
        }
    }
}

/// The mixer's time, in frames of [`RATE_HZ`] since it was made; it stands while the mixer is paused. Clones tell the same.
#[derive(Clone, Debug)]
pub struct Clock {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    began: Instant,
    rendered: AtomicU64,
    /// The first frame of the last block, the first after it, and when the first is heard (nanoseconds since it began, at least 1);
    /// 0: no device plays.
    block: Together<3>,
}

impl Clock {
    pub(crate) fn new() -> Self {
        let (rendered, block) = (AtomicU64::new(0), Together::new([0; 3]));
        Self { shared: Arc::new(Shared { began: Instant::now(), rendered, block }) }
    }

    /// Frames that have been rendered.
    #[must_use]
    pub fn rendered_frames(&self) -> u64 {
        self.shared.rendered.load(Ordering::Acquire)
    }

    /// The frame that is heard at an instant, with fractions: what the device still holds and what the mixer is late by
    /// ([`LATENCY_FRAMES`]) lie between it and [`Self::rendered_frames`]. Where no device plays (off line) only the latter does.
    #[must_use]
    pub fn heard_frame(&self, now: Instant) -> f64 {
        let [first, after, plays_at_ns] = self.shared.block.read();
        let late = LATENCY_FRAMES as f64;
        if plays_at_ns == 0 {
            return (self.rendered_frames() as f64 - late).max(0.0);
        }
        let since = now.saturating_duration_since(self.shared.began).as_nanos() as f64 - plays_at_ns as f64;
        // half a second back: more than devices hold; ahead: not beyond what has been rendered
        let least = (first as f64 - 0.5 * f64::from(RATE_HZ)).max(0.0);
        (first as f64 + since * 1.0e-9 * f64::from(RATE_HZ)).clamp(least, after as f64) - late
    }

    pub(crate) fn set_rendered(&self, frames: u64) {
        self.shared.rendered.store(frames, Ordering::Release);
    }

    /// A device took the frames from `first` to `after`, and will play the first of them after `latency`.
    pub(crate) fn taken(&self, first: u64, after: u64, now: Instant, latency: Duration) {
        let at = now.saturating_duration_since(self.shared.began) + latency;
        self.shared.block.write([first, after, (at.as_nanos() as u64).max(1)]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_heard_lies_behind_what_is_rendered() {
        let (clock, now) = (Clock::new(), Instant::now());
        clock.set_rendered(48_000);
        assert_eq!(clock.heard_frame(now), 48_000.0 - LATENCY_FRAMES as f64);
        clock.taken(47_520, 48_000, now, Duration::from_millis(20));
        let heard = |ms| clock.heard_frame(now + Duration::from_millis(ms)) + LATENCY_FRAMES as f64;
        assert!((heard(20) - 47_520.0).abs() < 1.0 && (heard(25) - 47_760.0).abs() < 1.0);
        assert!((heard(0) - 46_560.0).abs() < 1.0);
        assert_eq!(heard(500), 48_000.0, "a device that stands still tells no time that was not rendered");
    }

    #[test]
    fn numbers_are_read_together() {
        let numbers = Arc::new(Together::new([0, 0]));
        let theirs = Arc::clone(&numbers);
        let writer = std::thread::spawn(move || (0..200_000_u64).for_each(|k| theirs.write([k, 3 * k])));
        while !writer.is_finished() {
            let [a, b] = numbers.read();
            assert_eq!(3 * a, b);
        }
        writer.join().expect("writes");
    }
}
