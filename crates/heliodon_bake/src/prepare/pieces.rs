//! What preparation has done so far, kept step by step: whoever is killed goes on behind the last step that was finished.

use super::arrays::{Reader, Writer, index_of, read};
use crate::cache::{Cache, CacheError};
use crate::error::BakeError;
use crate::report::Reporter;
use heliodon_mesh::Texture;
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

/// What the blocks of pieces are called, before their names.
pub(super) const PIECE: &str = "piece-";

/// What those are called that depend on one part alone: they outlive the preparation, for the next may be of another place of another part.
pub(super) const PART: &str = "part-";

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
}

impl<'a> Pieces<'a> {
    /// Without a cache nothing is kept.
    pub fn new(cache: Option<&'a Cache>, takes: bool, reporter: &'a dyn Reporter) -> Self {
        Self { cache, takes, reporter, asked: Mutex::default() }
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
