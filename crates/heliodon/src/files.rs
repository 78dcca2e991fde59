//! Files that appear whole or not at all.

use anyhow::{Context, Result, bail};
use std::ffi::OsString;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// Writes a file beside its place and renames it there, so that a failure leaves what was there before.
///
/// # Errors
/// What `write` returns or the operating system says, with the file's name.
pub fn write_whole(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> Result<()> {
    let beside = beside(path);
    let written = File::create(&beside).and_then(|mut file| {
        write(&mut file)?;
        file.sync_all()
    });
    written
        .and_then(|()| fs::rename(&beside, path))
        .map_err(|error| {
            let _ = fs::remove_file(&beside);
            anyhow::Error::new(error)
        })
        .with_context(|| format!("cannot write {}", path.display()))
}

/// Lets `write` make a file beside its place, then renames it there.
///
/// # Errors
/// What `write` returns, or the operating system says; it speaks of `path`, not of the file beside it.
pub fn replace(path: &Path, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let beside = beside(path);
    let renamed = write(&beside).and_then(|()| Ok(fs::rename(&beside, path)?));
    renamed.map_err(|error| {
        let _ = fs::remove_file(&beside);
        let told = format!("{error:#}").replace(&beside.display().to_string(), &path.display().to_string());
        anyhow::Error::msg(told)
    })
}

/// Looks whether a file can be made at `path`, before long work is done for it.
///
/// # Errors
/// No such folder, a folder of that name, or a place that cannot be written to.
pub fn check_place(path: &Path) -> Result<()> {
    if path.is_dir() {
        bail!("cannot write {}: a folder has that name; give a file's", path.display());
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        bail!("cannot write {}: there is no folder {}; make it, or name another place", path.display(), folder.display());
    }
    let beside = beside(path);
    File::create(&beside).and_then(|_| fs::remove_file(&beside)).with_context(|| format!("cannot write {}", path.display()))
}

/// A name in the same folder, with the same ending (writers look at it), that no other run uses.
pub fn beside(path: &Path) -> PathBuf {
    let name = path.file_name().map_or_else(OsString::new, OsString::from);
    let mut hidden = OsString::from(format!(".{}-", std::process::id()));
    hidden.push(name);
    path.with_file_name(hidden)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn a_failed_write_keeps_the_old_file_and_leaves_no_new_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("film.mp4");
        write_whole(&path, |file| file.write_all(b"good")).unwrap();
        let failed = write_whole(&path, |file| {
            file.write_all(b"half")?;
            Err(io::Error::from(io::ErrorKind::StorageFull))
        });
        assert!(format!("{:#}", failed.unwrap_err()).contains("film.mp4"));
        assert_eq!(fs::read(&path).unwrap(), b"good");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn places_are_looked_at_before_the_work() {
        let folder = tempfile::tempdir().unwrap();
        let told = |path: &Path| format!("{:#}", check_place(path).unwrap_err());
        assert!(told(&folder.path().join("none/day.mp4")).contains("there is no folder"));
        assert!(told(folder.path()).contains("a folder has that name"));
        check_place(&folder.path().join("day.mp4")).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        let path = folder.path().join("a.png");
        let failed = replace(&path, |beside| bail!("{}: no room", beside.display())).unwrap_err();
        assert_eq!(failed.to_string(), format!("{}: no room", path.display()));
    }
}
