//! The files of a document: itself, and beside it what a crash would lose.

use std::ffi::OsString;
use std::fs::{self, File, Metadata};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// A project's file, and what it held when it was read or written last.
#[derive(Debug)]
pub(super) struct Files {
    path: PathBuf,
    /// What it held; nothing where there was none.
    held: Option<String>,
    stamp: Option<(SystemTime, u64)>,
    autosaved: Option<String>,
}

impl Files {
    pub fn open(path: &Path) -> io::Result<(Self, Option<String>)> {
        // Of a link, the file itself is replaced, not the link.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let held = read(&path)?;
        let stamp = stamp(&path);
        let beside = Self { path, held: held.clone(), stamp, autosaved: None };
        Ok((beside, held))
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn held(&self) -> Option<&str> {
        self.held.as_deref()
    }

    /// What another program has made of it since, `None` where it is as it was.
    pub fn changed_outside(&mut self) -> Option<String> {
        let now = stamp(&self.path);
        if now == self.stamp {
            return None;
        }
        let text = read(&self.path).ok().flatten()?;
        self.stamp = now;
        (Some(&text) != self.held.as_ref()).then_some(text)
    }

    /// What it holds is known, and may be replaced.
    pub fn accept(&mut self, held: &str) {
        self.held = Some(held.to_owned());
    }

    pub fn write(&mut self, text: &str) -> io::Result<()> {
        write_whole(&self.path, text)?;
        self.held = Some(text.to_owned());
        self.stamp = stamp(&self.path);
        self.forget_autosave();
        Ok(())
    }

    fn autosave_path(&self) -> PathBuf {
        beside(&self.path, ".autosave")
    }

    /// Writes beside the file what a crash would lose, where it is not there yet.
    pub fn autosave(&mut self, text: &str) -> io::Result<bool> {
        if self.autosaved.as_deref() == Some(text) {
            return Ok(false);
        }
        write_whole(&self.autosave_path(), text)?;
        self.autosaved = Some(text.to_owned());
        Ok(true)
    }

    /// What a crash left, where it is not what the file holds.
    pub fn left_by_a_crash(&self) -> Option<String> {
        read(&self.autosave_path()).ok().flatten().filter(|text| Some(text) != self.held.as_ref())
    }

    /// Nothing of what was written here is to be found again.
    pub fn forget_own_autosave(&mut self) {
        if self.autosaved.is_some() {
            self.forget_autosave();
        }
    }

    /// Nothing is to be found again.
    pub fn forget_autosave(&mut self) {
        self.autosaved = None;
        // Where there is none, none is left.
        let _ = fs::remove_file(self.autosave_path());
    }
}

fn read(path: &Path) -> io::Result<Option<String>> {
    match fs::read_to_string(path) {
        Ok(text) => Ok(Some(text)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

fn stamp(path: &Path) -> Option<(SystemTime, u64)> {
    let of = |data: Metadata| Some((data.modified().ok()?, data.len()));
    fs::metadata(path).ok().and_then(of)
}

/// `.photos.toml.autosave` of `photos.toml`.
fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(ending);
    path.with_file_name(name)
}

/// Beside it first and then renamed into place: a crash leaves the old or the new one.
fn write_whole(path: &Path, text: &str) -> io::Result<()> {
    let new = beside(path, ".new");
    let mut file = File::create(&new)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()?;
    fs::rename(&new, path)
}
