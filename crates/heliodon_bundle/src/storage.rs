//! Files that are hashed while they are written, and the faults of writing.

use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A file of a bundle, with what it must hold.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredFile {
    /// Its path, with `/` between folders: relative to the bundle, or, of an input, to the site.
    pub path: String,
    /// Its size.
    pub bytes: u64,
    /// BLAKE3 of its bytes, in hexadecimal.
    pub blake3: String,
}

impl StoredFile {
    /// Hashes a file that is there; `name` is the path to give it.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn hash(path: &Path, name: &str) -> io::Result<Self> {
        let mut file = File::open(path)?;
        let mut hasher = blake3::Hasher::new();
        let bytes = io::copy(&mut file, &mut hasher)?;
        Ok(Self { path: name.to_owned(), bytes, blake3: hasher.finalize().to_hex().to_string() })
    }

    /// As [`StoredFile::hash`], of what was read from it.
    #[must_use]
    pub fn of_bytes(bytes: &[u8], name: &str) -> Self {
        Self { path: name.to_owned(), bytes: bytes.len() as u64, blake3: blake3::hash(bytes).to_hex().to_string() }
    }
}

/// What keeps a bundle from being written.
#[derive(Debug, Error)]
pub enum WriteFault {
    /// The file system refused.
    #[error("{}: {}", .path.display(), explain(.source))]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What it said.
        source: io::Error,
    },
    /// A binary glTF file cannot be as large.
    #[error("{}: {bytes} bytes are more than a binary glTF file holds (4 GiB)", .path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// How large it would be.
        bytes: u64,
    },
}

impl WriteFault {
    pub(crate) fn json(path: &Path, error: &serde_json::Error) -> Self {
        Self::Io { path: path.to_owned(), source: io::Error::other(error.to_string()) }
    }
}

fn explain(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::StorageFull => "the disk is full; make room and run again".to_owned(),
        io::ErrorKind::QuotaExceeded => "the disk quota is used up; make room and run again".to_owned(),
        io::ErrorKind::FileTooLarge => "the file grew beyond what the system allows here; raise the limit".to_owned(),
        io::ErrorKind::NotFound => "there is no such folder; make it, or name another place".to_owned(),
        io::ErrorKind::AlreadyExists | io::ErrorKind::NotADirectory => {
            "a file stands where a folder is needed; choose another place".to_owned()
        }
        io::ErrorKind::ReadOnlyFilesystem => "the file system can only be read; choose another place".to_owned(),
        io::ErrorKind::PermissionDenied => "writing is not permitted there; choose another place".to_owned(),
        _ => error.to_string(),
    }
}

pub(crate) fn io_fault(path: &Path) -> impl FnOnce(io::Error) -> WriteFault + '_ {
    move |source| WriteFault::Io { path: target_of(path), source }
}

/// The file that a temporary one beside it (`.NAME.part`, `.NAME.spool`) is to become: what people have asked for.
fn target_of(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let target = name.strip_prefix('.').and_then(|name| name.strip_suffix(".part").or_else(|| name.strip_suffix(".spool")));
    target.map_or_else(|| path.to_owned(), |target| path.with_file_name(target))
}

/// A new file that is hashed as it grows.
pub(crate) struct HashedFile {
    path: PathBuf,
    out: BufWriter<File>,
    hasher: blake3::Hasher,
    bytes: u64,
}

impl HashedFile {
    pub(crate) fn create(path: &Path) -> Result<Self, WriteFault> {
        let file = File::create_new(path).map_err(io_fault(path))?;
        Ok(Self {
            path: path.to_owned(),
            out: BufWriter::with_capacity(1 << 18, file),
            hasher: blake3::Hasher::new(),
            bytes: 0,
        })
    }

    pub(crate) fn write(&mut self, bytes: &[u8]) -> Result<(), WriteFault> {
        self.out.write_all(bytes).map_err(io_fault(&self.path))?;
        self.hasher.update(bytes);
        self.bytes += bytes.len() as u64;
        Ok(())
    }

    /// Flushes to the disk itself and answers with what the file is.
    pub(crate) fn finish(mut self, name: &str) -> Result<StoredFile, WriteFault> {
        self.out.flush().map_err(io_fault(&self.path))?;
        self.out.get_ref().sync_all().map_err(io_fault(&self.path))?;
        Ok(StoredFile { path: name.to_owned(), bytes: self.bytes, blake3: self.hasher.finalize().to_hex().to_string() })
    }
}

/// Puts a file that is there and never changes at a second place, where the file system can without its bytes.
pub(crate) fn share(from: &Path, to: &Path) -> Result<(), WriteFault> {
    if std::fs::hard_link(from, to).is_err() {
        std::fs::copy(from, to).and_then(|_| File::open(to)?.sync_all()).map_err(io_fault(to))?;
    }
    Ok(())
}

/// Writes a whole file.
pub(crate) fn store(folder: &Path, name: &str, bytes: &[u8]) -> Result<StoredFile, WriteFault> {
    let mut file = HashedFile::create(&folder.join(name))?;
    file.write(bytes)?;
    file.finish(name)
}
