//! Light between two bounces, kept where these take long: whoever is killed goes on from there. And where hits that there is no room for in memory are.

use crate::cache::Cache;
use crate::names::LightNames;
use crate::report::Reporter;
use heliodon_light::{KeptBounces, LightParams, MAX_FOLLOWED};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Light is kept when so much time has passed since it was for the last time, and so many times as long as keeping it took then.
const DUE: Duration = Duration::from_secs(4);
const WORTH: u32 = 4;

/// Where light is kept between two bounces, and where blocks lie with all their hits.
pub(crate) struct Bounces<'a> {
    cache: Option<&'a Cache>,
    names: &'a LightNames,
    /// Blocks of the surfaces; those in space follow.
    fronts: usize,
    reporter: &'a dyn Reporter,
    /// It is kept no more often than this.
    due: Duration,
    /// Since when nothing was kept, and after how long something is to be; never again once there was no room.
    clock: Mutex<(Instant, Option<Duration>)>,
    /// Whether it was told that light goes on bouncing.
    told: AtomicBool,
}

impl<'a> Bounces<'a> {
    /// Of a solve whose blocks are so many of the surfaces, then those in space; without a cache nothing is kept.
    pub fn new(cache: Option<&'a Cache>, names: &'a LightNames, fronts: usize, reporter: &'a dyn Reporter) -> Self {
        Self::due_after(DUE, cache, names, fronts, reporter)
    }

    fn due_after(
        due: Duration,
        cache: Option<&'a Cache>,
        names: &'a LightNames,
        fronts: usize,
        reporter: &'a dyn Reporter,
    ) -> Self {
        let clock = Mutex::new((Instant::now(), cache.map(|_| due)));
        cache.inspect(|cache| cache.can_spare(&names.bounces));
        Self { cache, names, fronts, reporter, due, clock, told: AtomicBool::new(false) }
    }

    fn clock(&self) -> (Instant, Option<Duration>) {
        // whoever panicked while it was set has set it
        *self.clock.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Removes what was kept.
    pub fn remove(&self) {
        self.cache.iter().for_each(|cache| cache.remove_blocks(&self.names.bounces));
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
    fn block(&self, number: usize) -> Option<Vec<u8>> {
        match number.checked_sub(self.fronts) {
            None => self.cache?.load(&self.names.fronts.gather, number),
            Some(number) => self.cache?.load(&self.names.space.gather, number),
        }
    }

    fn take(&self, number: usize) -> Option<Vec<u8>> {
        let taken = self.cache?.load(&self.names.bounces, number)?;
        if !self.told.swap(true, Ordering::Relaxed) {
            self.reporter.note("going on between two bounces");
        }
        Some(taken)
    }

    fn is_due(&self) -> bool {
        let (since, due) = self.clock();
        due.is_some_and(|due| since.elapsed() >= due)
    }

    fn keep(&self, number: usize, runs: &[&[u8]]) {
        let begun = Instant::now();
        let kept = self.cache.map_or(Ok(()), |cache| cache.store_runs(&self.names.bounces, number, runs));
        let due = match kept {
            Ok(()) => Some(self.due.max(WORTH * begun.elapsed())),
            Err(_) => {
                self.remove();
                None
            }
        };
        *self.clock.lock().unwrap_or_else(PoisonError::into_inner) = (Instant::now(), due);
    }

    fn told(&self, done: u64) {
        self.reporter.progress(done);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::GridPlan;
    use crate::names::SceneDigests;
    use crate::report::Collector;
    use std::fs;
    use std::path::Path;

    fn names() -> LightNames {
        let digests = SceneDigests { geometry: [1; 32], albedo: [2; 32] };
        LightNames::new(&digests, &LightParams::default(), (&[], false), &GridPlan::default(), [None; 3])
    }

    #[test]
    fn the_last_state_is_taken_and_makes_room_for_what_must_be_kept() {
        let root = tempfile::tempdir().unwrap();
        let cache = Cache::open(root.path(), "key", Path::new("bundle")).unwrap();
        let (heard, names) = (Collector::default(), names());
        let due = |due: Duration, cache| Bounces::due_after(due, cache, &names, 0, &heard);
        assert!(!due(Duration::ZERO, None).is_due(), "nowhere to keep it");
        assert!(!Bounces::new(Some(&cache), &names, 0, &heard).is_due(), "too early");
        let bounces = due(Duration::ZERO, Some(&cache));
        assert!(bounces.is_due() && bounces.take(1).is_none());
        bounces.keep(0, &[b"one"]);
        bounces.keep(0, &[b"t", b"wo"]);
        bounces.keep(1, &[b"three"]);
        assert_eq!((bounces.take(0).unwrap(), bounces.take(1).unwrap()), (b"two".to_vec(), b"three".to_vec()));
        assert_eq!(heard.heard().notes.len(), 1, "told once");

        let block = |number: usize| cache.folder().join(format!("{}-{number:05}", names.bounces));
        fs::write(block(0), "damaged").unwrap();
        assert!(bounces.take(0).is_none());
        // what cannot be stored is tried once more without it
        fs::create_dir(cache.folder().join("light-00000")).unwrap();
        assert!(cache.store("light", 0, b"light").is_err() && !block(0).exists() && !block(1).exists());
        // no room: nothing is kept, nothing is asked any more, nothing stays
        fs::create_dir(block(1)).unwrap();
        bounces.keep(0, &[b"four"]);
        assert!(bounces.clock().1.is_some() && cache.has(&names.bounces, 0));
        bounces.keep(1, &[b"five"]);
        assert!(bounces.clock().1.is_none() && !cache.has(&names.bounces, 0));
    }

    #[test]
    fn blocks_of_the_surfaces_come_before_those_in_space() {
        let root = tempfile::tempdir().unwrap();
        let cache = Cache::open(root.path(), "key", Path::new("bundle")).unwrap();
        let names = names();
        let store = |name: &str, block: usize| cache.store(name, block, format!("{name} {block}").as_bytes()).unwrap();
        (0..2).for_each(|block| store(&names.fronts.gather, block));
        store(&names.space.gather, 0);
        let heard = Collector::default();
        let bounces = Bounces::new(Some(&cache), &names, 2, &heard);
        let block = |number: usize| bounces.block(number).map(|bytes| String::from_utf8(bytes).unwrap());
        assert_eq!(block(1), Some(format!("{} 1", names.fronts.gather)));
        assert_eq!((block(2), block(3)), (Some(format!("{} 0", names.space.gather)), None));
    }
}
