//! Names for what is written beside its place and then renamed there.

use std::ffi::OsString;
use std::hash::{BuildHasher, RandomState};
use std::path::{Path, PathBuf};

/// A number that nobody else has, on whatever machine: two that share a folder may well share the number of a process.
#[must_use]
pub fn token() -> u64 {
    // nothing of the standard library is random but the keys of its hash maps
    RandomState::new().hash_one(std::process::id())
}

/// A new name in the same folder, hidden, with the same ending (writers look at it). However long the name of `path` is, it fits.
#[must_use]
pub fn beside(path: &Path) -> PathBuf {
    let mut hidden = OsString::from(format!(".heliodon-{:016x}", token()));
    if let Some(ending) = path.extension() {
        hidden.push(".");
        hidden.push(ending);
    }
    path.with_file_name(hidden)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_new_and_fits() {
        let long = format!("/a/{}.ply", "n".repeat(251));
        let [one, other] = [(); 2].map(|()| beside(Path::new(&long)));
        assert!(one != other && one.parent() == Some(Path::new("/a")) && one.extension().is_some_and(|ending| ending == "ply"));
        assert!(one.file_name().is_some_and(|name| name.len() < 64));
        assert!(beside(Path::new("notes")).extension().is_none());
    }
}
