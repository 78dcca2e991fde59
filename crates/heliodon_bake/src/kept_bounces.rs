//! Light between two bounces, kept where these take long: whoever is killed goes on from there.

use crate::cache::Cache;
use crate::report::Reporter;
use heliodon_light::{KeptBounces, LightParams, MAX_FOLLOWED};
use std::cell::Cell;
use std::time::{Duration, Instant};

/// Light is kept when so much time has passed since it was for the last time, and so many times as long as keeping it took then.
const DUE: Duration = Duration::from_secs(4);
const WORTH: u32 = 4;

/// Where light is kept between two bounces.
pub(crate) struct Bounces<'a> {
    cache: Option<&'a Cache>,
    stage: &'a str,
    reporter: &'a dyn Reporter,
    /// Since when nothing was kept, and after how long something is to be; never again once there was no room.
    clock: Cell<(Instant, Option<Duration>)>,
    /// Whether it was told that light goes on bouncing.
    told: Cell<bool>,
}

impl<'a> Bounces<'a> {
    /// Under the name `stage`; without a cache nothing is kept.
    pub fn new(cache: Option<&'a Cache>, stage: &'a str, reporter: &'a dyn Reporter) -> Self {
        Self::due_after(DUE, cache, stage, reporter)
    }

    fn due_after(due: Duration, cache: Option<&'a Cache>, stage: &'a str, reporter: &'a dyn Reporter) -> Self {
        Self { cache, stage, reporter, clock: Cell::new((Instant::now(), cache.map(|_| due))), told: Cell::new(false) }
    }

    /// Leaves the room to what must be kept: tries `store` again without what is here if it failed.
    ///
    /// # Errors
    /// Those of `store`.
    pub fn giving_way<E>(&self, store: impl Fn() -> Result<(), E>) -> Result<(), E> {
        store().or_else(|_| {
            self.remove();
            store()
        })
    }

    /// Removes what was kept.
    pub fn remove(&self) {
        self.cache.iter().for_each(|cache| cache.remove_blocks(self.stage));
    }
}

/// What is kept on disk at most of `passes` of light ([`LightParams::bounce_passes`]) over so many points that take so many seconds.
pub(crate) fn kept_bytes(params: &LightParams, passes: u64, points: u64, seconds: f64) -> u64 {
    if seconds < DUE.as_secs_f64() || params.bounces == 0 {
        return 0;
    }
    // sixteen lanes of each point, and of about as many cells, whose bounces before take half as much
    let before = MAX_FOLLOWED.min(params.bounces as usize - 1) as u64;
    passes / u64::from(params.bounces) * points * (64 + 64 + 32 * before)
}

impl KeptBounces for Bounces<'_> {
    fn take(&self, number: usize) -> Option<Vec<u8>> {
        let taken = self.cache?.load(self.stage, number)?;
        if !self.told.replace(true) {
            self.reporter.note("going on between two bounces");
        }
        Some(taken)
    }

    fn is_due(&self) -> bool {
        let (since, due) = self.clock.get();
        due.is_some_and(|due| since.elapsed() >= due)
    }

    fn keep(&self, number: usize, runs: &[&[u8]]) {
        let (begun, (_, due)) = (Instant::now(), self.clock.get());
        let kept = self.cache.map_or(Ok(()), |cache| cache.store_runs(self.stage, number, runs));
        let due = match kept {
            Ok(()) => due.max(Some(WORTH * begun.elapsed())),
            Err(_) => {
                self.remove();
                None
            }
        };
        self.clock.set((Instant::now(), due));
    }

    fn told(&self, done: u64) {
        self.reporter.progress(done);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cache::CacheError;
    use crate::report::Collector;
    use std::fs;
    use std::path::Path;

    #[test]
    fn the_last_state_is_taken_and_makes_room_for_what_must_be_kept() {
        let root = tempfile::tempdir().unwrap();
        let cache = Cache::open(root.path(), "key", Path::new("bundle")).unwrap();
        let heard = Collector::default();
        assert!(!Bounces::due_after(Duration::ZERO, None, "bounces-1", &heard).is_due(), "nowhere to keep it");
        assert!(!Bounces::new(Some(&cache), "bounces-1", &heard).is_due(), "too early");
        let bounces = Bounces::due_after(Duration::ZERO, Some(&cache), "bounces-1", &heard);
        assert!(bounces.is_due() && bounces.take(1).is_none());
        bounces.keep(0, &[b"one"]);
        bounces.keep(0, &[b"t", b"wo"]);
        bounces.keep(1, &[b"three"]);
        assert_eq!((bounces.take(0).unwrap(), bounces.take(1).unwrap()), (b"two".to_vec(), b"three".to_vec()));
        assert_eq!(heard.heard().notes.len(), 1, "told once");

        let block = |name: &str| cache.folder().join(name);
        fs::write(block("bounces-1-00000"), "damaged").unwrap();
        assert!(bounces.take(0).is_none());
        let tries = Cell::new(0);
        let store = || {
            tries.set(tries.get() + 1);
            if block("bounces-1-00001").exists() { Err("no room") } else { Ok(()) }
        };
        assert_eq!((bounces.giving_way(store), tries.get()), (Ok(()), 2));
        // no room: nothing is kept, nothing is asked any more, nothing stays
        fs::create_dir(block("bounces-1-00001")).unwrap();
        bounces.keep(0, &[b"four"]);
        bounces.keep(1, &[b"five"]);
        assert!(matches!(cache.store("bounces-1", 1, b"five"), Err(CacheError::Write { .. })), "the test's own hindrance");
        assert!(!bounces.is_due() && !cache.has("bounces-1", 0));
    }
}
