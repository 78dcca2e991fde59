//! What an interrupted bake has already computed: one file for each finished block of work.
//!
//! A bake's blocks lie in `<root>/<key>/`, where the key is a hash of everything that decides the result (inputs,
//! parameters, the revision of the code), so a block can never be taken for another bake's. A block is written
//! beside and renamed into place, and carries its length and a BLAKE3 hash of its name and content: a file that was cut
//! short, damaged or renamed is thrown away and its work done again. Blocks are not flushed to the disk (fsync): they
//! survive the end of the process, which is what they are for, and after a power failure the hash tells which did.
//!
//! The folder is locked while a bake uses it, against all others; shards of one bake share it. The lock is the operating system's and dies
//! with the process.

use crate::prepare::GEOMETRY;
use heliodon_bundle::file_lock::{Company, LockFault, take_lock, wait_for_lock};
use heliodon_mesh::export::token;
use serde::Serialize;
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

const MAGIC: [u8; 8] = *b"HELIOBLK";
const HEADER_BYTES: usize = 8 + 8 + 32;
const LOCK_FILE: &str = "lock";
const OWNER_FILE: &str = "bundle.txt";
/// Tells that a bake has ended well with what lies beside.
const FINISHED_FILE: &str = "finished";
/// Tells whoever works here that nothing of other bakes is to be taken.
const ALONE_FILE: &str = "alone";
/// The ending of files that are being written.
const UNFINISHED: &str = "new";
/// No block takes so long to write; who may not ask whether others are alive waits so long before it clears up after them.
const DEAD_AFTER: Duration = Duration::from_secs(3600);

/// How often a folder is made that others take away, before that is an error.
const MOST_TRIES: u32 = 16;

/// Why a cache cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CacheError {
    /// Another process bakes the same thing right now.
    #[error(
        "another bake of the same site is running, or a shard of it (it holds {path}); wait until it has ended, or name another --cache"
    )]
    Busy {
        /// The lock.
        path: PathBuf,
    },
    /// The folder cannot be made, or a block cannot be written.
    #[error(
        "cannot keep finished work in {path}: {source}; make room or name another folder with --cache, then run the bake again: it goes on where it stopped"
    )]
    Write {
        /// What was written.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
}

/// The finished blocks of one bake. Holds the folder's lock until dropped.
#[derive(Debug)]
pub struct Cache {
    folder: PathBuf,
    root: PathBuf,
    lock: File,
    /// Tells the files that this process writes from those of others that write the same block, on whatever machine.
    token: u64,
    /// Whose work it is.
    owner: PathBuf,
    taken: Mutex<Vec<Taken>>,
    /// Whether other bakes' folders are looked into.
    takes: AtomicBool,
    /// Stages that need not be kept.
    spare: Mutex<BTreeSet<String>>,
}

/// How much of a stage was taken from the cache.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Taken {
    /// The stage's name for people.
    pub stage: String,
    /// Blocks (skies, of the sky) that were there,
    pub blocks: u64,
    /// of so many.
    pub of: u64,
    /// In blocks that were not there, rays that did not have to be traced,
    pub rays: u64,
    /// of so many.
    pub of_rays: u64,
}

impl Cache {
    /// Opens (makes, if need be) the folder of the bake `key` below `root`; `owner` names the bundle that it serves.
    ///
    /// # Errors
    /// [`CacheError::Busy`] where another process has it, [`CacheError::Write`] where it cannot be made.
    pub fn open(root: &Path, key: &str, owner: &Path) -> Result<Self, CacheError> {
        let cache = Self::locked(root, key, owner, Company::Alone)?;
        cache.remove_unfinished(Duration::ZERO);
        Ok(cache)
    }

    /// As [`Cache::open`], for a shard: others of the same bake may work there at the same time, whole bakes may not.
    ///
    /// # Errors
    /// As [`Cache::open`].
    pub fn join(root: &Path, key: &str, owner: &Path) -> Result<Self, CacheError> {
        let cache = Self::locked(root, key, owner, Company::Together)?;
        cache.remove_unfinished(DEAD_AFTER);
        Ok(cache)
    }

    fn locked(root: &Path, key: &str, owner: &Path, company: Company) -> Result<Self, CacheError> {
        let folder = root.join(key);
        let lock_path = folder.join(LOCK_FILE);
        let mut tries = 0;
        let lock = loop {
            tries += 1;
            let made = fs::create_dir_all(&folder).map_err(LockFault::from);
            match made.and_then(|()| take_lock(&lock_path, company)) {
                Ok(lock) => break lock,
                Err(LockFault::Busy) => return Err(CacheError::Busy { path: lock_path }),
                // who clears up has taken the folder away before it was locked
                Err(LockFault::Io(error)) if error.kind() == io::ErrorKind::NotFound && tries < MOST_TRIES => {}
                Err(LockFault::Io(source)) => return Err(CacheError::Write { path: folder, source }),
            }
        };
        let takes = AtomicBool::new(!folder.join(ALONE_FILE).exists());
        let cache = Self {
            folder,
            root: root.to_owned(),
            lock,
            token: token(),
            owner: owner.to_owned(),
            taken: Mutex::default(),
            takes,
            spare: Mutex::default(),
        };
        cache.write_note(OWNER_FILE, owner.to_string_lossy().as_bytes())?;
        Ok(cache)
    }

    /// Keeps a small file beside the blocks, whole or not at all; one that says the same already stays as it is.
    ///
    /// # Errors
    /// [`CacheError::Write`].
    pub fn write_note(&self, name: &str, content: &[u8]) -> Result<(), CacheError> {
        if fs::read(self.folder.join(name)).is_ok_and(|old| old == content) {
            return Ok(());
        }
        self.write_beside(name, |path| fs::write(path, content))
    }

    fn write_beside(&self, name: &str, write: impl FnOnce(&Path) -> io::Result<()>) -> Result<(), CacheError> {
        let path = self.folder.join(name);
        let beside = self.folder.join(format!("{name}.{:016x}.{UNFINISHED}", self.token));
        write(&beside).and_then(|()| fs::rename(&beside, &path)).map_err(|source| {
            let _ = fs::remove_file(&beside);
            CacheError::Write { path, source }
        })
    }

    /// Locks a file of the folder against all others until what is returned is dropped; where another has it, says so by `waiting` and waits.
    ///
    /// # Errors
    /// [`CacheError::Write`].
    pub fn lock(&self, name: &str, waiting: impl FnOnce()) -> Result<File, CacheError> {
        let path = self.folder.join(name);
        let locked = match take_lock(&path, Company::Alone) {
            Err(LockFault::Busy) => {
                waiting();
                wait_for_lock(&path)
            }
            other => other,
        };
        locked.map_err(|fault| match fault {
            LockFault::Busy => CacheError::Busy { path },
            LockFault::Io(source) => CacheError::Write { path, source },
        })
    }

    /// Where the blocks lie.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The content of a finished block, or `None` where there is none that is whole.
    #[must_use]
    pub fn load(&self, stage: &str, block: usize) -> Option<Vec<u8>> {
        let name = block_name(stage, block);
        let path = self.folder.join(&name);
        match read_block(&path, &name) {
            Ok(content) => Some(content),
            // Damaged. If it cannot be removed it will be replaced.
            Err(BlockFault::Damaged) => {
                let _ = fs::remove_file(&path);
                None
            }
            // a server that does not answer now says nothing of the block
            Err(BlockFault::Unread) => None,
        }
    }

    /// The folders of other bakes of the same bundle, whoever may work there.
    pub fn others_of_owner(&self) -> impl Iterator<Item = PathBuf> {
        let owner = self.owner.to_string_lossy().into_owned();
        let takes = self.takes.load(Ordering::Relaxed);
        let others = entries(&self.root).filter(|other| takes && *other != self.folder).collect::<Vec<_>>();
        others.into_iter().filter(move |other| fs::read_to_string(other.join(OWNER_FILE)).is_ok_and(|name| name == owner))
    }

    /// The blocks of a folder whose stages' names begin with `begin`: the stage and the file of each.
    #[must_use]
    pub fn stages_in(&self, folder: &Path, begin: &str) -> Vec<(String, PathBuf)> {
        let of = |path: PathBuf| {
            let stage = stage_of(path.file_name()?.to_str()?)?.to_owned();
            stage.starts_with(begin).then_some((stage, path))
        };
        entries(folder).filter_map(of).collect()
    }

    /// As [`Cache::load`], of another bake's folder, in which nothing is removed.
    #[must_use]
    pub fn load_from(&self, folder: &Path, stage: &str, block: usize) -> Option<Vec<u8>> {
        let name = block_name(stage, block);
        read_block(&folder.join(&name), &name).ok()
    }

    /// Whether a file for the block is there; it may still turn out to be damaged.
    #[must_use]
    pub fn has(&self, stage: &str, block: usize) -> bool {
        has_block(&self.folder, stage, block)
    }

    /// Keeps a finished block.
    ///
    /// # Errors
    /// [`CacheError::Write`], for instance on a full disk; nothing half-written stays.
    pub fn store(&self, stage: &str, block: usize, content: &[u8]) -> Result<(), CacheError> {
        self.store_runs(stage, block, &[content])
    }

    /// As [`Cache::store`]; the content is some runs, one after the other.
    ///
    /// # Errors
    /// As [`Cache::store`].
    pub fn store_runs(&self, stage: &str, block: usize, runs: &[&[u8]]) -> Result<(), CacheError> {
        let name = block_name(stage, block);
        let store = || self.write_beside(&name, |path| write_block(path, &name, runs));
        store().or_else(|error| {
            // what can be spared makes room
            let spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner);
            let is_there = |stage: &&String| !self.stages_in(&self.folder, stage).is_empty();
            let there: Vec<&String> = spare.iter().filter(is_there).collect();
            there.iter().for_each(|stage| self.remove_blocks(stage));
            if there.is_empty() { Err(error) } else { store() }
        })
    }

    /// Lets the blocks of a stage go wherever there is no room for others.
    pub fn can_spare(&self, stage: &str) {
        self.spare.lock().unwrap_or_else(PoisonError::into_inner).insert(stage.to_owned());
    }

    /// Removes this bake's blocks, what interrupted bakes of the same bundle from other inputs or parameters left, and the
    /// folders above where they are empty now. What cannot be removed stays; it costs only room.
    pub fn remove(self, owner: &Path) {
        let Self { folder, root, lock, .. } = self;
        let _ = fs::remove_dir_all(&folder);
        drop(lock);
        // prepared geometry outlives the bakes that it was for: the next one begins with it
        remove_idle(&root, owner, |name| !name.starts_with(GEOMETRY));
        // remove_dir only removes empty folders.
        let _ = fs::remove_dir(&root);
        if let Some(above) = root.parent().filter(|above| above.ends_with(crate::CACHE_FOLDER)) {
            let _ = fs::remove_dir(above);
        }
    }

    /// Takes what other bakes of the same bundle have left of the stages `names`: their files get a second name here, which costs no room, or
    /// are copied where the file system cannot. What cannot be had is made anew.
    ///
    /// # Errors
    /// [`CacheError::Write`] where a copy finds no room.
    pub fn adopt(&self, names: &[String]) -> Result<(), CacheError> {
        self.adopt_where(|stage| names.iter().any(|name| name == stage))
    }

    /// As [`Cache::adopt`], for the stages that are `wanted`.
    ///
    /// # Errors
    /// As [`Cache::adopt`].
    pub fn adopt_where(&self, wanted: impl Fn(&str) -> bool) -> Result<(), CacheError> {
        for other in self.others_of_owner() {
            for path in entries(&other) {
                let Some(name) = path.file_name().map(|name| name.to_string_lossy().into_owned()) else { continue };
                let own = self.folder.join(&name);
                if !stage_of(&name).is_some_and(&wanted) || own.exists() || fs::hard_link(&path, &own).is_ok() {
                    continue;
                }
                if let Ok(bytes) = fs::read(&path) {
                    self.write_beside(&name, |path| fs::write(path, &bytes))?;
                }
            }
        }
        Ok(())
    }

    /// Keeps the blocks of the stages `names` for bakes to come; all others go, with the other folders of the bundle `owner` that nobody uses.
    /// Returns the bytes that stay.
    ///
    /// # Errors
    /// [`CacheError::Write`].
    pub fn finish(&self, names: &[String], owner: &Path) -> Result<u64, CacheError> {
        self.write_note(FINISHED_FILE, b"")?;
        let _ = fs::remove_file(self.folder.join(ALONE_FILE));
        let mut bytes = 0;
        for path in entries(&self.folder) {
            let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            if stage_of(&name).is_none_or(|stage| names.iter().any(|name| name == stage)) {
                bytes += path.metadata().map_or(0, |data| data.len());
            } else {
                let _ = fs::remove_file(path);
            }
        }
        let own = self.folder.file_name();
        remove_idle(&self.root, owner, |name| !name.starts_with(GEOMETRY) && own.is_none_or(|own| own != name));
        Ok(bytes)
    }

    /// Takes nothing that finished bakes have kept: what is here goes, and others' folders are not looked at. What an interrupted run of the
    /// same bake has left here stays.
    pub fn forget_finished(&self) {
        self.takes.store(false, Ordering::Relaxed);
        if self.folder.join(FINISHED_FILE).exists() {
            for path in entries(&self.folder) {
                let is_block = path.file_name().is_some_and(|name| stage_of(&name.to_string_lossy()).is_some());
                if is_block || path.ends_with(FINISHED_FILE) {
                    let _ = fs::remove_file(path);
                }
            }
        }
    }

    /// As [`Cache::forget_finished`], for all processes that work here until the bake is finished.
    ///
    /// # Errors
    /// [`CacheError::Write`].
    pub fn forget_finished_for_all(&self) -> Result<(), CacheError> {
        self.forget_finished();
        self.write_note(ALONE_FILE, b"")
    }

    /// Notes that `blocks` of a stage's `of` were there.
    pub fn taken(&self, stage: &str, blocks: usize, of: usize) {
        self.tell(stage, |taken| {
            taken.blocks += blocks as u64;
            taken.of += of as u64;
        });
    }

    /// Notes that `rays` of a block's `of` were known.
    pub fn tell_rays(&self, stage: &str, rays: u64, of: u64) {
        self.tell(stage, |taken| {
            taken.rays += rays;
            taken.of_rays += of;
        });
    }

    fn tell(&self, stage: &str, change: impl FnOnce(&mut Taken)) {
        // whoever panicked while it held the list has left it a list
        let mut all = self.taken.lock().unwrap_or_else(PoisonError::into_inner);
        let known = all.iter().position(|taken| taken.stage == stage);
        let index = known.unwrap_or_else(|| {
            all.push(Taken { stage: stage.to_owned(), blocks: 0, of: 0, rays: 0, of_rays: 0 });
            all.len() - 1
        });
        change(&mut all[index]);
    }

    /// What was noted of the stages, in their order.
    #[must_use]
    pub fn all_taken(&self) -> Vec<Taken> {
        self.taken.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Removes the blocks of all stages whose names begin with `stage`. What cannot be removed stays; it costs only room.
    pub fn remove_blocks(&self, stage: &str) {
        // not what another run is still writing
        for (_, path) in self.stages_in(&self.folder, stage) {
            let _ = fs::remove_file(path);
        }
    }

    /// Removes what interrupted runs have begun to write of the stages whose names begin so, for a caller who knows that nobody else writes any.
    pub fn remove_begun(&self, begin: &str) {
        for path in entries(&self.folder).filter(|path| path.extension().is_some_and(|extension| extension == UNFINISHED)) {
            if path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(begin)) {
                let _ = fs::remove_file(path);
            }
        }
    }

    /// Removes the blocks of stages whose names begin with `begin` and with none of `used`. What cannot be removed stays.
    pub fn remove_unused(&self, begin: &str, used: &BTreeSet<String>) {
        for (stage, path) in self.stages_in(&self.folder, begin) {
            if !used.iter().any(|name| stage.starts_with(name.as_str())) {
                let _ = fs::remove_file(path);
            }
        }
    }

    /// Removes the other folders of the bundle `owner` whose names begin with `prefix`, but none that is in use.
    pub fn remove_others(&self, prefix: &str, owner: &Path) {
        let own = self.folder.file_name();
        remove_idle(&self.root, owner, |name| name.starts_with(prefix) && own.is_none_or(|own| own != name));
    }

    /// Removes what others have begun to write `age` ago or earlier: they are dead.
    fn remove_unfinished(&self, age: Duration) {
        for path in entries(&self.folder).filter(|path| path.extension().is_some_and(|extension| extension == UNFINISHED)) {
            let written = path.metadata().and_then(|data| data.modified());
            // a time to come, of a machine whose clock is ahead, is no age
            if age.is_zero() || written.is_ok_and(|time| time.elapsed().is_ok_and(|since| since >= age)) {
                let _ = fs::remove_file(path);
            }
        }
    }
}

fn entries(folder: &Path) -> impl Iterator<Item = PathBuf> {
    fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path())
}

/// Removes the folders below `root` that serve the bundle `owner`, whose names are `wanted` gone, and that nobody uses.
fn remove_idle(root: &Path, owner: &Path, wanted: impl Fn(&str) -> bool) {
    let owner = owner.to_string_lossy();
    for stale in entries(root) {
        let gone = stale.file_name().is_some_and(|name| wanted(&name.to_string_lossy()));
        if !gone || !fs::read_to_string(stale.join(OWNER_FILE)).is_ok_and(|name| name == owner) {
            continue;
        }
        // held until the folder is gone, or somebody might begin in it meanwhile
        if let Ok(lock) = take_lock(&stale.join(LOCK_FILE), Company::Alone) {
            let _ = fs::remove_dir_all(&stale);
            drop(lock);
        }
    }
}

/// As [`Cache::has`], of a bake's folder that others work in.
#[must_use]
pub fn has_block(folder: &Path, stage: &str, block: usize) -> bool {
    folder.join(block_name(stage, block)).is_file()
}

/// The stage of a block's file; none of other files.
fn stage_of(name: &str) -> Option<&str> {
    let (stage, block) = name.rsplit_once('-')?;
    (block.len() >= 5 && block.bytes().all(|byte| byte.is_ascii_digit())).then_some(stage)
}

fn block_name(stage: &str, block: usize) -> String {
    format!("{stage}-{block:05}")
}

fn block_hash(name: &str, runs: &[&[u8]]) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&(name.len() as u64).to_le_bytes());
    hasher.update(name.as_bytes());
    for run in runs {
        hasher.update(run);
    }
    *hasher.finalize().as_bytes()
}

fn write_block(path: &Path, name: &str, runs: &[&[u8]]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(&MAGIC)?;
    file.write_all(&runs.iter().map(|run| run.len() as u64).sum::<u64>().to_le_bytes())?;
    file.write_all(&block_hash(name, runs))?;
    runs.iter().try_for_each(|run| file.write_all(run))
}

/// Why there is no content of a block.
#[derive(Debug)]
enum BlockFault {
    /// There is none, or it cannot be read now.
    Unread,
    /// It is not what was written.
    Damaged,
}

impl From<io::Error> for BlockFault {
    fn from(error: io::Error) -> Self {
        if error.kind() == io::ErrorKind::UnexpectedEof { Self::Damaged } else { Self::Unread }
    }
}

fn read_block(path: &Path, name: &str) -> Result<Vec<u8>, BlockFault> {
    let mut file = File::open(path)?;
    let bytes = file.metadata()?.len();
    let mut header = [0; HEADER_BYTES];
    file.read_exact(&mut header)?;
    let (begin, hash) = header.split_at(16);
    let length = bytes.saturating_sub(HEADER_BYTES as u64);
    if begin[..8] != MAGIC || begin[8..] != length.to_le_bytes() {
        return Err(BlockFault::Damaged);
    }
    let mut content = Vec::with_capacity(usize::try_from(length).map_err(|_| BlockFault::Unread)?);
    file.read_to_end(&mut content)?;
    let is_whole = content.len() as u64 == length && *hash == block_hash(name, &[&content]);
    is_whole.then_some(content).ok_or(BlockFault::Damaged)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(root: &Path, key: &str) -> Cache {
        Cache::open(root, key, Path::new("bundle")).unwrap()
    }

    #[test]
    fn blocks_come_back_as_they_were() {
        let root = tempfile::tempdir().unwrap();
        let cache = open(root.path(), "key");
        assert_eq!(cache.load("masks", 3), None);
        cache.store("masks", 3, b"light").unwrap();
        cache.store("masks", 4, b"").unwrap();
        drop(cache);
        let cache = open(root.path(), "key");
        assert_eq!(cache.load("masks", 3).as_deref(), Some(&b"light"[..]));
        assert_eq!(cache.load("masks", 4).as_deref(), Some(&b""[..]));
        assert_eq!(open(root.path(), "other").load("masks", 3), None);
    }

    #[test]
    fn damaged_cut_and_renamed_blocks_are_thrown_away() {
        let root = tempfile::tempdir().unwrap();
        let cache = open(root.path(), "key");
        cache.store("gather", 0, &[7; 1000]).unwrap();
        let path = cache.folder().join("gather-00000");
        let good = fs::read(&path).unwrap();
        for damaged_byte in [0, 9, 20, 48, 600, good.len() - 1] {
            let mut bad = good.clone();
            bad[damaged_byte] ^= 1;
            fs::write(&path, bad).unwrap();
            assert_eq!(cache.load("gather", 0), None, "byte {damaged_byte}");
            assert!(!path.exists());
        }
        for length in [0, 5, 47, 48, good.len() - 1] {
            fs::write(&path, &good[..length]).unwrap();
            assert_eq!(cache.load("gather", 0), None, "length {length}");
        }
        fs::write(cache.folder().join("gather-00001"), &good).unwrap();
        assert_eq!(cache.load("gather", 1), None);
    }

    #[test]
    fn one_bake_at_a_time_and_a_dead_one_holds_nothing() {
        let root = tempfile::tempdir().unwrap();
        let cache = open(root.path(), "key");
        assert!(matches!(Cache::open(root.path(), "key", Path::new("bundle")), Err(CacheError::Busy { .. })));
        drop(cache);
        open(root.path(), "key");
    }

    #[test]
    fn shards_work_side_by_side_and_no_bake_beside_them() {
        let root = tempfile::tempdir().unwrap();
        let join = || Cache::join(root.path(), "key", Path::new("bundle"));
        let (one, two) = (join().unwrap(), join().unwrap());
        assert!(one.token != two.token, "each writes files of its own");
        // what one is writing is not another's to remove
        let unfinished = one.folder().join("masks-00001.0123456789abcdef.new");
        fs::write(&unfinished, "half").unwrap();
        let three = join().unwrap();
        assert!(unfinished.exists());
        // unless it has long been dead
        let old = one.folder().join("masks-00002.0123456789abcdef.new");
        let long_ago = std::time::SystemTime::now() - 2 * DEAD_AFTER;
        File::create(&old).unwrap().set_modified(long_ago).unwrap();
        drop(join().unwrap());
        assert!(unfinished.exists() && !old.exists());
        one.store("masks", 0, b"light").unwrap();
        assert_eq!(two.load("masks", 0).as_deref(), Some(&b"light"[..]));
        assert!(matches!(Cache::open(root.path(), "key", Path::new("bundle")), Err(CacheError::Busy { .. })));
        drop((one, two, three));
        let alone = open(root.path(), "key");
        assert!(!unfinished.exists() && matches!(join(), Err(CacheError::Busy { .. })));
        drop(alone);
    }

    #[test]
    fn a_block_that_cannot_be_read_now_stays() {
        let root = tempfile::tempdir().unwrap();
        let cache = open(root.path(), "key");
        // a folder opens and cannot be read, whoever runs the test
        let path = cache.folder().join("masks-00000");
        fs::create_dir(&path).unwrap();
        assert!(cache.load("masks", 0).is_none() && path.exists());
    }

    #[test]
    fn what_is_begun_anew_takes_nothing_of_others_in_any_process_until_it_is_finished() {
        let root = tempfile::tempdir().unwrap();
        let other = open(root.path(), "other");
        other.store("masks", 0, b"old").unwrap();
        let stages = ["masks".to_owned()];
        let owner = Path::new("bundle");
        let join = |key: &str| Cache::join(root.path(), key, owner).unwrap();
        join("anew").forget_finished_for_all().unwrap();
        let later = join("anew");
        later.adopt(&stages).unwrap();
        assert!(!later.has("masks", 0));
        later.store("masks", 0, b"new").unwrap();
        later.finish(&stages, Path::new("nobody")).unwrap();
        drop(later);
        // of a finished bake nothing stays either, and then its folder is as any other
        let again = join("anew");
        assert!(again.has("masks", 0));
        again.forget_finished_for_all().unwrap();
        assert!(!again.has("masks", 0));
        again.finish(&stages, Path::new("nobody")).unwrap();
        drop(again);
        let usual = join("anew");
        usual.adopt(&stages).unwrap();
        assert_eq!(usual.load("masks", 0).as_deref(), Some(&b"old"[..]));
    }

    #[test]
    fn success_removes_the_bundles_blocks_and_nobody_elses() {
        let home = tempfile::tempdir().unwrap();
        let root = home.path().join(crate::CACHE_FOLDER).join("cache");
        open(&root, "stale").store("masks", 0, b"old").unwrap();
        Cache::open(&root, "foreign", Path::new("another")).unwrap().store("masks", 0, b"theirs").unwrap();
        let cache = open(&root, "mine");
        cache.store("masks", 0, b"new").unwrap();
        cache.remove(Path::new("bundle"));
        assert!(!root.join("mine").exists() && !root.join("stale").exists());
        assert!(root.join("foreign/masks-00000").exists());

        open(&root, "mine").remove(Path::new("another"));
        assert!(!home.path().join(crate::CACHE_FOLDER).exists(), "empty folders go too");
    }

    #[test]
    fn new_geometry_removes_what_it_replaces_unless_it_is_in_use() {
        let root = tempfile::tempdir().unwrap();
        let name = |key: &str| format!("{GEOMETRY}{key}");
        for (key, owner) in [("old", "bundle"), ("theirs", "another")] {
            Cache::open(root.path(), &name(key), Path::new(owner)).unwrap();
        }
        open(root.path(), "bake").store("masks", 0, b"light").unwrap();
        let used = Cache::join(root.path(), &name("used"), Path::new("bundle")).unwrap();
        let new = Cache::join(root.path(), &name("new"), Path::new("bundle")).unwrap();
        new.store("piece-a", 0, b"stone").unwrap();
        new.store("scene", 0, b"temple").unwrap();
        new.remove_others(GEOMETRY, Path::new("bundle"));
        let left = |key: &str| root.path().join(key).exists();
        assert!(!left(&name("old")) && left(&name("theirs")) && left(&name("used")) && left(&name("new")) && left("bake"));
        new.remove_blocks("piece-");
        assert!(!new.has("piece-a", 0) && new.has("scene", 0));
        drop(used);
    }

    #[test]
    fn a_failed_write_leaves_nothing_behind() {
        let root = tempfile::tempdir().unwrap();
        let cache = open(root.path(), "key");
        // A folder where the file should go: the rename fails whoever runs the test, root included.
        fs::create_dir(cache.folder().join("masks-00000")).unwrap();
        assert!(matches!(cache.store("masks", 0, b"light"), Err(CacheError::Write { .. })));
        let left = fs::read_dir(cache.folder())
            .unwrap()
            .filter(|entry| entry.as_ref().unwrap().path().extension().is_some_and(|extension| extension == UNFINISHED));
        assert_eq!(left.count(), 0);
    }
}
