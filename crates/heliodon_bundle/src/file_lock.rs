//! The operating system's locks on files, which die with the process that holds them.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::Path;

/// What Linux says where a network file system has no daemon for locks.
const ENOLCK: i32 = 37;

/// Who may hold a lock at the same time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Company {
    /// Nobody else.
    Alone,
    /// Whoever asks for it in company as well.
    Together,
}

/// What keeps a lock from being taken.
#[derive(Debug)]
pub enum LockFault {
    /// Another process holds it.
    Busy,
    /// The file cannot be made or locked.
    Io(io::Error),
}

impl From<io::Error> for LockFault {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// Locks a file, which is made if need be, until what is returned is dropped. Where a file system has no locks, nobody is kept out.
///
/// # Errors
/// [`LockFault`].
pub fn take_lock(path: &Path, company: Company) -> Result<File, LockFault> {
    locked(path, |file| match if company == Company::Alone { file.try_lock() } else { file.try_lock_shared() } {
        Ok(()) => Ok(()),
        Err(TryLockError::WouldBlock) => Err(LockFault::Busy),
        Err(TryLockError::Error(error)) => without_locks(error),
    })
}

/// As [`take_lock`], alone; waits until nobody else holds it.
///
/// # Errors
/// [`LockFault::Io`].
pub fn wait_for_lock(path: &Path) -> Result<File, LockFault> {
    locked(path, |file| file.lock().or_else(without_locks))
}

/// Some network file systems have no locks: that is no fault.
fn without_locks(error: io::Error) -> Result<(), LockFault> {
    let none = error.kind() == io::ErrorKind::Unsupported || error.raw_os_error() == Some(ENOLCK);
    if none { Ok(()) } else { Err(error.into()) }
}

fn locked(path: &Path, lock: impl Fn(&File) -> Result<(), LockFault>) -> Result<File, LockFault> {
    loop {
        let file = File::options().write(true).create(true).truncate(false).open(path)?;
        lock(&file)?;
        // between opening and locking, the one before may have removed the file: then the lock is on nothing
        if is_same_file(&file, path) {
            return Ok(file);
        }
    }
}

#[cfg(unix)]
fn is_same_file(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (file.metadata(), fs::metadata(path)) {
        (Ok(a), Ok(b)) => (a.dev(), a.ino()) == (b.dev(), b.ino()),
        _ => false,
    }
}

#[cfg(not(unix))]
fn is_same_file(_: &File, path: &Path) -> bool {
    fs::exists(path).unwrap_or(false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn who_waits_gets_a_file_that_is_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        let first = take_lock(&path, Company::Alone).unwrap();
        assert!(matches!(take_lock(&path, Company::Together), Err(LockFault::Busy)));
        std::thread::scope(|scope| {
            let second = scope.spawn(|| wait_for_lock(&path).unwrap());
            std::thread::sleep(Duration::from_millis(50));
            assert!(!second.is_finished());
            // the first removes the file before it lets go, as bundles and caches do
            fs::remove_file(&path).unwrap();
            drop(first);
            let second = second.join().unwrap();
            assert!(path.exists() && matches!(take_lock(&path, Company::Alone), Err(LockFault::Busy)));
            drop(second);
        });
        let together = [(); 2].map(|()| take_lock(&path, Company::Together).unwrap());
        assert!(matches!(take_lock(&path, Company::Alone), Err(LockFault::Busy)));
        drop(together);
        assert!(matches!(take_lock(&folder.path().join("none/lock"), Company::Alone), Err(LockFault::Io(_))));
    }
}
