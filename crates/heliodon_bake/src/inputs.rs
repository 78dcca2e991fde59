//! The files that a bake is made from: hashed before they are read, and looked at again behind that.
//!
//! What is kept in a cache, and what a manifest says, goes by the hashes; a file that somebody writes between hashing and reading would stand
//! there under the hash of what it was before. Looking again costs a question for its time and length, and a second hash only where these
//! have changed or cannot tell.

use crate::error::BakeError;
use crate::key::told_name;
use crate::referenced::referenced_files;
use heliodon_bundle::StoredFile;
use heliodon_bundle::site::{InputFile, InputKind, SITE_FILE_NAME, Site};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// Times of files are this coarse at worst (FAT): one that was written so shortly before may be written again at the same time.
const COARSEST_TIME: Duration = Duration::from_secs(2);

/// The files of a site, with their hashes.
#[derive(Debug)]
pub(crate) struct Inputs {
    files: Vec<Input>,
}

#[derive(Debug)]
struct Input {
    path: PathBuf,
    /// What it serves as; nothing for `site.toml`, whose text the site holds.
    kinds: Vec<InputKind>,
    stored: StoredFile,
    stamp: Option<Stamp>,
}

/// What the file system tells of a file that nobody has written since.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stamp {
    bytes: u64,
    modified: SystemTime,
}

impl Stamp {
    fn of(path: &Path) -> Option<Self> {
        let data = path.metadata().ok()?;
        Some(Self { bytes: data.len(), modified: data.modified().ok()? })
    }

    /// Whether a later change would show.
    fn can_tell(self) -> bool {
        // a time to come is that of another clock
        self.modified.elapsed().is_ok_and(|age| age > COARSEST_TIME)
    }
}

impl Inputs {
    /// Hashes `site.toml`, the files that it names, and those that these name in turn.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn hash(site: &Site, files: &[InputFile]) -> Result<Self, BakeError> {
        let stored = StoredFile::of_bytes(site.text().as_bytes(), SITE_FILE_NAME);
        let mut inputs = vec![Input { path: site.path().to_owned(), kinds: Vec::new(), stored, stamp: None }];
        let mut add = |path: &Path, kind: InputKind| {
            if let Some(known) = inputs.iter_mut().find(|known| known.path == path) {
                known.kinds.push(kind);
                return Ok::<(), BakeError>(());
            }
            // two files of one name, both outside of the site, are two inputs
            let stamp = Stamp::of(path).filter(|stamp| stamp.can_tell());
            let stored = hash(path, &told_name(site.folder(), path))?;
            inputs.push(Input { path: path.to_owned(), kinds: vec![kind], stored, stamp });
            Ok(())
        };
        for file in files {
            add(&file.path, file.kind)?;
            if matches!(file.kind, InputKind::Geometry(_) | InputKind::Actor(_) | InputKind::Views(_)) {
                referenced_files(&file.path).iter().try_for_each(|path| add(path, file.kind))?;
            }
        }
        Ok(Self { files: inputs })
    }

    /// The hashes, that of `site.toml` first.
    pub fn stored(&self) -> Vec<StoredFile> {
        self.files.iter().map(|file| file.stored.clone()).collect()
    }

    /// Looks whether the files that serve as something of the `wanted` kinds still are what was hashed.
    ///
    /// # Errors
    /// [`BakeError::Changed`], and a file that cannot be read any more.
    pub fn check_unchanged(&self, wanted: impl Fn(InputKind) -> bool) -> Result<(), BakeError> {
        for file in self.files.iter().filter(|file| file.kinds.iter().any(|&kind| wanted(kind))) {
            let same = file.stamp.is_some_and(|stamp| Stamp::of(&file.path) == Some(stamp))
                || hash(&file.path, &file.stored.path)? == file.stored;
            if !same {
                return Err(BakeError::Changed { path: file.path.clone() });
            }
        }
        Ok(())
    }
}

fn hash(path: &Path, name: &str) -> Result<StoredFile, BakeError> {
    StoredFile::hash(path, name).map_err(|source| BakeError::Read { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::{self, File};

    const SITE: &str = "[site]\nname = \"a\"\n[[part]]\nfile = \"a.ply\"\n[sky]\nprobes = \"a.hdr\"\nmapping = \"lat-long\"\n";

    #[test]
    fn a_file_that_is_written_after_it_was_hashed_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let date = |name: &str, age_s: u64| {
            let time = SystemTime::now() - Duration::from_secs(age_s);
            File::options().write(true).open(path(name)).unwrap().set_modified(time).unwrap();
        };
        for name in ["a.ply", "a.hdr"] {
            fs::write(path(name), "old").unwrap();
            date(name, 100);
        }
        // of site.toml what was read counts, whatever stands there now
        fs::write(path("site.toml"), "another").unwrap();
        let site = Site::parse(SITE, path("site.toml")).unwrap();
        let files = site.input_files().unwrap();
        let inputs = || Inputs::hash(&site, &files).unwrap();
        let is_mesh = |kind: InputKind| matches!(kind, InputKind::Geometry(0));
        let hashed = inputs();
        assert_eq!(hashed.stored()[0].bytes, SITE.len() as u64);
        assert_eq!(hashed.stored()[1].blake3, blake3::hash(b"old").to_hex().as_str());
        hashed.check_unchanged(|_| true).unwrap();
        // a new time alone is no change
        date("a.ply", 50);
        hashed.check_unchanged(|_| true).unwrap();
        fs::write(path("a.ply"), "new").unwrap();
        assert!(matches!(hashed.check_unchanged(is_mesh), Err(BakeError::Changed { path }) if path.ends_with("a.ply")));
        hashed.check_unchanged(|kind| kind == InputKind::Probe).unwrap();
        // written again within the coarsest time, at the same length
        let young = inputs();
        let time = path("a.ply").metadata().unwrap().modified().unwrap();
        fs::write(path("a.ply"), "NEW").unwrap();
        File::options().write(true).open(path("a.ply")).unwrap().set_modified(time).unwrap();
        assert!(young.check_unchanged(is_mesh).is_err());
        fs::remove_file(path("a.ply")).unwrap();
        assert!(matches!(young.check_unchanged(is_mesh), Err(BakeError::Read { .. })));
    }
}
