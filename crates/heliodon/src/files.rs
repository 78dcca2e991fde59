//! Files that appear whole or not at all.

use anyhow::{Context, Result, bail};
use heliodon_mesh::export::beside;
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

/// The first thing in a folder whose name is not one of `ours`, as a thing that is somebody's.
///
/// # Errors
/// A folder that cannot be read.
pub fn find_foreign(folder: &Path, ours: impl Fn(&str) -> bool) -> Result<Option<OsString>> {
    for entry in fs::read_dir(folder).with_context(|| format!("cannot look into {}", folder.display()))? {
        let name = entry?.file_name();
        if !name.to_str().is_some_and(&ours) {
            return Ok(Some(name));
        }
    }
    Ok(None)
}

/// A folder that is written beside its place and put there when all of it is done. Dropped before, it leaves nothing behind.
pub struct NewFolder {
    target: PathBuf,
    staged: PathBuf,
}

impl NewFolder {
    /// Begins a folder that is to stand at `target`.
    ///
    /// # Errors
    /// If none can be made there.
    pub fn create(target: &Path) -> Result<Self> {
        let staged = beside(target);
        fs::create_dir(&staged).with_context(|| format!("cannot make the folder {}", target.display()))?;
        Ok(Self { target: target.to_owned(), staged })
    }

    /// Where its files go until then.
    pub fn path(&self) -> &Path {
        &self.staged
    }

    /// Puts the folder in the place of what was there, does what else belongs to it, and removes what was there; a failure of
    /// either puts everything back.
    ///
    /// # Errors
    /// What `then` returns or the operating system says.
    pub fn commit(self, then: impl FnOnce() -> Result<()>) -> Result<()> {
        let failed = || format!("cannot write {}", self.target.display());
        let old = self.staged.with_extension("old");
        let had_old = self.target.exists();
        if had_old {
            fs::rename(&self.target, &old).with_context(failed)?;
        }
        let placed = fs::rename(&self.staged, &self.target).with_context(failed);
        let done = placed.and_then(|()| {
            then().inspect_err(|_| {
                // dropped, it is removed
                let _ = fs::rename(&self.target, &self.staged);
            })
        });
        match (&done, had_old) {
            (Ok(()), true) => drop(fs::remove_dir_all(&old)),
            (Err(_), true) => fs::rename(&old, &self.target).with_context(failed)?,
            (_, false) => {}
        }
        done
    }
}

impl Drop for NewFolder {
    fn drop(&mut self) {
        // after a commit there is nothing there
        let _ = fs::remove_dir_all(&self.staged);
    }
}

/// Whether a path leads to something within a folder, or to the folder itself, however both are written.
pub fn is_within(path: &Path, folder: &Path) -> bool {
    match (path.canonicalize(), folder.canonicalize()) {
        (Ok(path), Ok(folder)) => path.starts_with(folder),
        _ => false,
    }
}

/// Nothing that is read may be written over.
///
/// # Errors
/// An input that lies at one of `places`, or within.
pub fn refuse_inputs<'a>(inputs: &[PathBuf], places: impl IntoIterator<Item = &'a Path>) -> Result<()> {
    for place in places {
        if let Some(input) = inputs.iter().find(|input| is_within(input, place)) {
            bail!("{} would be written over, and it is read here; name another place", input.display());
        }
    }
    Ok(())
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
    fn a_folder_changes_places_whole_or_not_at_all() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("day.sky");
        let write = |content: &str, then: Result<()>| {
            let folder = NewFolder::create(&target).unwrap();
            fs::write(folder.path().join("0001.hdr"), content).unwrap();
            folder.commit(|| then)
        };
        let held = || fs::read_to_string(target.join("0001.hdr")).ok();
        assert!(write("none", Err(anyhow::anyhow!("no"))).is_err());
        assert_eq!(held(), None);
        write("first", Ok(())).unwrap();
        assert!(write("second", Err(anyhow::anyhow!("no"))).is_err());
        assert_eq!(held().as_deref(), Some("first"));
        drop(NewFolder::create(&target).unwrap());
        write("third", Ok(())).unwrap();
        assert_eq!(held().as_deref(), Some("third"));
        assert_eq!(fs::read_dir(home.path()).unwrap().count(), 1, "nothing is left beside it");
        assert!(
            is_within(&target.join("0001.hdr"), &target.join("..").join("day.sky"))
                && !is_within(&target, &target.join("0001.hdr"))
        );
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
