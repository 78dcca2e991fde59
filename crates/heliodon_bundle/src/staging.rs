//! A folder that is written beside its final place and renamed into it.
//!
//! While `NAME` is written there are `.NAME.lock`, which the writing process holds locked, and `.NAME.tmp`. On Linux the
//! finished folder and the old one change places in one step (`renameat2` with `RENAME_EXCHANGE`). Where the system or the
//! file system has no such step the old one is moved to `.NAME.old` first; if the process ends between the two moves, the
//! next one that opens `NAME` for writing moves it back.

use crate::file_lock::{Company, LockFault, take_lock};
use crate::manifest::{FORMAT_NAME, MANIFEST_FILE_NAME, Manifest};
use crate::storage::{WriteFault, io_fault};
use crate::writer::WriteError;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// A folder in the making; removed again when dropped before [`Staging::commit`].
pub(crate) struct Staging {
    target: PathBuf,
    temporary: PathBuf,
    old: PathBuf,
    /// Removed last, after the folders.
    lock: Lock,
}

struct Lock {
    path: PathBuf,
    /// Locked until it closes.
    _file: File,
}

impl Drop for Lock {
    fn drop(&mut self) {
        // a lock file that stays costs nothing: the next writer takes it over
        let _ = fs::remove_file(&self.path);
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        // after a commit this is what was there before; a failure leaves it to the next writer
        let _ = fs::remove_dir_all(&self.temporary);
    }
}

impl Staging {
    pub(crate) fn create(target: &Path) -> Result<Self, WriteError> {
        let (Some(name), Some(parent)) = (target.file_name(), target.parent()) else {
            return Err(WriteError::NotABundle { path: target.to_owned(), what: "it has no name of its own".to_owned() });
        };
        let parent = if parent.as_os_str().is_empty() { Path::new(".") } else { parent };
        fs::create_dir_all(parent).map_err(io_fault(parent))?;
        let beside = |ending: &str| {
            let mut hidden = std::ffi::OsString::from(".");
            hidden.push(name);
            hidden.push(ending);
            parent.join(hidden)
        };
        let lock = Lock::take(beside(".lock"), target)?;
        let (temporary, old) = (beside(".tmp"), beside(".old"));
        if old.is_dir() {
            if target.exists() { remove_folder(&old)? } else { fs::rename(&old, target).map_err(io_fault(&old))? }
        }
        check_replaceable(target)?;
        remove_folder(&temporary)?;
        fs::create_dir(&temporary).map_err(io_fault(&temporary))?;
        Ok(Self { target: target.to_owned(), temporary, old, lock })
    }

    /// Where it will stand.
    pub(crate) fn target(&self) -> &Path {
        &self.target
    }

    /// The folder to write into.
    pub(crate) fn folder(&self) -> &Path {
        &self.temporary
    }

    /// Puts the folder in its place, then removes what was there.
    pub(crate) fn commit(self) -> Result<(), WriteError> {
        check_replaceable(&self.target)?;
        sync_folder(&self.temporary)?;
        if self.target.exists() {
            if !exchange(&self.temporary, &self.target) {
                fs::rename(&self.target, &self.old).map_err(io_fault(&self.target))?;
                if let Err(error) = fs::rename(&self.temporary, &self.target) {
                    fs::rename(&self.old, &self.target).map_err(io_fault(&self.old))?;
                    return Err(io_fault(&self.target)(error).into());
                }
                remove_folder(&self.old)?;
            }
        } else {
            fs::rename(&self.temporary, &self.target).map_err(io_fault(&self.target))?;
        }
        if let Some(parent) = self.lock.path.parent() {
            sync_folder(parent)?;
        }
        Ok(())
    }
}

impl Lock {
    fn take(path: PathBuf, target: &Path) -> Result<Self, WriteError> {
        match take_lock(&path, Company::Alone) {
            Ok(file) => Ok(Self { path, _file: file }),
            Err(LockFault::Busy) => Err(WriteError::Busy { path: target.to_owned() }),
            Err(LockFault::Io(error)) => Err(io_fault(&path)(error).into()),
        }
    }
}

/// Changes the places of two folders in one step; false where that cannot be done.
#[cfg(target_os = "linux")]
fn exchange(a: &Path, b: &Path) -> bool {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE).is_ok()
}

#[cfg(not(target_os = "linux"))]
fn exchange(_: &Path, _: &Path) -> bool {
    false
}

fn remove_folder(path: &Path) -> Result<(), WriteFault> {
    match fs::remove_dir_all(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(io_fault(path)(error)),
        _ => Ok(()),
    }
}

/// Makes renames and new entries of a folder outlast a power cut, where folders can be synced.
pub(crate) fn sync_folder(path: &Path) -> Result<(), WriteFault> {
    if cfg!(unix) {
        File::open(path).and_then(|folder| folder.sync_all()).map_err(io_fault(path))?;
    }
    Ok(())
}

/// Whether nothing is lost if `target` is replaced: it is not there, or empty, or a bundle and nothing but a bundle.
fn check_replaceable(target: &Path) -> Result<(), WriteError> {
    let refuse = |what: String| Err(WriteError::NotABundle { path: target.to_owned(), what });
    match fs::symlink_metadata(target) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(io_fault(target)(error).into()),
        Ok(metadata) if !metadata.is_dir() => return refuse("it is not a folder".to_owned()),
        Ok(_) => {}
    }
    let mut found = Vec::new();
    list_files(target, "", &mut found)?;
    found.retain(|name| !is_litter(name));
    if found.is_empty() {
        return Ok(());
    }
    let manifest =
        fs::read(target.join(MANIFEST_FILE_NAME)).ok().and_then(|text| serde_json::from_slice::<Manifest>(&text).ok());
    match manifest.filter(|m| m.format == FORMAT_NAME) {
        None => refuse("it holds files but no manifest of a bundle".to_owned()),
        Some(manifest) => {
            let known = |name: &String| name == MANIFEST_FILE_NAME || manifest.files.iter().any(|f| f.path == *name);
            match found.iter().find(|name| !known(name)) {
                Some(foreign) => refuse(format!("`{foreign}` in it does not belong to the bundle")),
                None => Ok(()),
            }
        }
    }
}

/// Files that desktops leave in folders that they show (macOS, KDE, Windows), in any capitals.
const LITTER: [&str; 6] = [".ds_store", ".localized", ".directory", "thumbs.db", "ehthumbs.db", "desktop.ini"];
/// What such names begin with: a file's second half on file systems that have none (macOS), one that was deleted while open (NFS).
const LITTER_BEGINS: [&str; 2] = ["._", ".nfs"];

/// Whether nobody misses a file of that name. Other dot files may be someone's own.
fn is_litter(name: &str) -> bool {
    let name = name.rsplit('/').next().unwrap_or(name).to_ascii_lowercase();
    LITTER.contains(&name.as_str()) || LITTER_BEGINS.iter().any(|begin| name.starts_with(begin))
}

fn list_files(folder: &Path, prefix: &str, found: &mut Vec<String>) -> Result<(), WriteFault> {
    for entry in fs::read_dir(folder).map_err(io_fault(folder))? {
        let entry = entry.map_err(io_fault(folder))?;
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.file_type().map_err(io_fault(folder))?.is_dir() {
            list_files(&entry.path(), &format!("{name}/"), found)?;
        } else {
            found.push(name);
        }
    }
    Ok(())
}
