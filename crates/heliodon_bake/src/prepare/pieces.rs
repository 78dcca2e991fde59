//! What preparation has done so far, kept step by step, and within long steps: whoever is killed goes on behind what was kept last.

use super::arrays::{Reader, Writer, index_of, read};
use crate::cache::{Cache, CacheError};
use crate::error::BakeError;
use crate::report::Reporter;
use heliodon_mesh::Texture;
use heliodon_prepare::Interim;
use std::cell::Cell;
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// What the blocks of pieces are called, before their names.
pub(super) const PIECE: &str = "piece-";

/// What those are called that depend on one part alone: they outlive the preparation, for the next may be of another place of another part.
pub(super) const PART: &str = "part-";

/// Within long steps work is kept when so much time has passed since anything of it was.
const DUE: Duration = Duration::from_secs(8);
/// A milestone is kept after so many times as long as keeping the one before it took: what it costs is no more than what it saves.
const WORTH: u32 = 1;

/// What can be kept.
pub(super) trait Piece: Sized {
    fn write(&self, into: &mut Writer) -> Result<(), CacheError>;
    fn read(from: &mut Reader) -> Option<Self>;
}

/// Where pieces are kept, and whether those of an earlier run are taken.
pub(super) struct Pieces<'a> {
    cache: Option<&'a Cache>,
    takes: bool,
    reporter: &'a dyn Reporter,
    /// Names that were asked for.
    asked: Mutex<BTreeSet<String>>,
    /// Whether there was no room for what need not be kept.
    full: AtomicBool,
    /// After how long it is worth while to keep something within a step.
    pub due: Duration,
    /// And after how many times as long as keeping it took the last time.
    pub worth: u32,
}

impl<'a> Pieces<'a> {
    /// Without a cache nothing is kept.
    pub fn new(cache: Option<&'a Cache>, takes: bool, reporter: &'a dyn Reporter) -> Self {
        Self { cache, takes, reporter, asked: Mutex::default(), full: AtomicBool::new(false), due: DUE, worth: WORTH }
    }

    /// The names under which things were made or taken.
    pub fn asked(self) -> BTreeSet<String> {
        self.asked.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether something is there under a name; it may still turn out to be damaged.
    pub fn has(&self, name: &str) -> bool {
        self.cache.is_some_and(|cache| cache.has(&index_of(name), 0))
    }

    /// What is kept under a name, if it is whole and wanted; `textures` are those that its writer had at hand.
    pub fn take<T: Piece>(&self, name: &str, textures: &[Arc<Texture>]) -> Option<T> {
        if !self.takes || !self.has(name) {
            return None;
        }
        let taken = self.cache.and_then(|cache| read(cache, name, textures, T::read));
        if taken.is_none() {
            self.reporter.note(&format!("kept geometry was damaged ({name}) and is made again"));
        }
        taken
    }

    /// Whether work within steps is kept: it saves time, and what there is no room for only costs some.
    fn keeps_more(&self) -> bool {
        self.cache.is_some() && !self.full.load(Ordering::Relaxed)
    }

    /// Something that need not be kept could not be: what of it was written goes, to leave the room to what must be.
    fn no_room(&self, begin: &str, error: &CacheError) {
        self.remove(begin);
        if !self.full.swap(true, Ordering::Relaxed) {
            self.reporter.note(&format!("steps are not kept before they are done: {error}"));
        }
    }

    /// Removes the blocks whose names begin so: what they led to is kept.
    pub fn remove(&self, begin: &str) {
        if let Some(cache) = self.cache {
            cache.remove_blocks(begin);
        }
    }

    /// Where something is kept on its way through so many stages.
    pub fn milestones(&self, name: String, stages: u32) -> Milestones<'_> {
        Milestones { pieces: self, name, stages, clock: Cell::new((Instant::now(), self.due)) }
    }

    /// Where a step keeps what it has done so far.
    pub fn interim(&self, name: String) -> Steppingstones<'_> {
        Steppingstones { pieces: self, name, kept: Mutex::new(Instant::now()), told: AtomicBool::new(false) }
    }

    /// Keeps something under a name.
    ///
    /// # Errors
    /// A cache that cannot be written.
    pub fn keep<T: Piece>(&self, name: &str, textures: &[Arc<Texture>], piece: &T) -> Result<(), CacheError> {
        let Some(cache) = self.cache else { return Ok(()) };
        let mut writer = Writer::new(cache, name, textures);
        piece.write(&mut writer)?;
        writer.finish()
    }

    /// As it was kept, or made now and kept.
    ///
    /// # Errors
    /// Those of `make`, and a cache that cannot be written.
    pub fn kept_or<T: Piece>(
        &self,
        name: &str,
        textures: &[Arc<Texture>],
        make: impl FnOnce() -> Result<T, BakeError>,
    ) -> Result<T, BakeError> {
        self.asked.lock().unwrap_or_else(PoisonError::into_inner).insert(name.to_owned());
        if let Some(taken) = self.take(name, textures) {
            return Ok(taken);
        }
        let made = make()?;
        self.keep(name, textures, &made)?;
        Ok(made)
    }
}

/// Something on its way through stages, the last of which that was kept is taken.
pub(super) struct Milestones<'a> {
    pieces: &'a Pieces<'a>,
    name: String,
    stages: u32,
    /// Since when nothing of it was kept, and after how long something is to be.
    clock: Cell<(Instant, Duration)>,
}

impl Milestones<'_> {
    /// Each has a name of its own: of one that is written over, part might be the old one's.
    fn name(&self, stage: u32) -> String {
        format!("{}{stage}", self.name)
    }

    /// The last that was kept.
    pub fn last<T: Piece>(&self) -> Option<T> {
        let last = (0..=self.stages).rev().find_map(|stage| self.pieces.take(&self.name(stage), &[]));
        if last.is_some() {
            self.pieces.reporter.note(GOING_ON);
        }
        last
    }

    /// After so many stages: kept if it is worth while, in place of those before.
    pub fn reached<T: Piece>(&self, stage: u32, piece: &T) {
        let (since, due) = self.clock.get();
        if !self.pieces.keeps_more() || since.elapsed() < due {
            return;
        }
        let begun = Instant::now();
        match self.pieces.keep(&self.name(stage), &[], piece) {
            Ok(()) => (0..stage).for_each(|before| self.pieces.remove(&format!("{}-", self.name(before)))),
            Err(error) => self.pieces.no_room(&format!("{}-", self.name(stage)), &error),
        }
        self.clock.set((Instant::now(), self.pieces.due.max(self.pieces.worth * begun.elapsed())));
    }
}

/// What is told where a step goes on within itself.
const GOING_ON: &str = "going on within a step that was broken off";

/// What a step has done so far, in blocks.
pub(super) struct Steppingstones<'a> {
    pieces: &'a Pieces<'a>,
    name: String,
    /// When something of it was kept or taken for the last time.
    kept: Mutex<Instant>,
    /// Whether it was told that the step goes on.
    told: AtomicBool,
}

impl Steppingstones<'_> {
    fn now_kept(&self) {
        *self.kept.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
    }
}

impl Interim for Steppingstones<'_> {
    fn take(&self, number: usize) -> Option<Vec<u8>> {
        let taken = self.pieces.cache.filter(|_| self.pieces.takes)?.load(&self.name, number)?;
        self.now_kept();
        if !self.told.swap(true, Ordering::Relaxed) {
            self.pieces.reporter.note(GOING_ON);
        }
        Some(taken)
    }

    fn is_due(&self) -> bool {
        self.pieces.keeps_more() && self.kept.lock().unwrap_or_else(PoisonError::into_inner).elapsed() >= self.pieces.due
    }

    fn keep(&self, number: usize, bytes: &[u8]) {
        let Some(cache) = self.pieces.cache else { return };
        if let Err(error) = cache.store(&self.name, number, bytes) {
            self.pieces.no_room(&format!("{}-", self.name), &error);
        }
        self.now_kept();
    }
}
