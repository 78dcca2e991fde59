//! What was done, kept between visits: `remember` and `recall`.

use crate::diagnostic::{Diagnostic, Place, Severity, Wrong};
use crate::value::Value;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// Names that are remembered at most.
pub const MAX_ENTRIES: usize = 1000;
/// What one name may weigh, in bytes.
pub const MAX_ENTRY_BYTES: usize = 4 * 1024;
/// What all may weigh together.
pub const MAX_BYTES: usize = 256 * 1024;
/// A file that is longer is not ours: JSON writes a byte of text as six at most.
const MAX_FILE_BYTES: u64 = 8 * MAX_BYTES as u64;
const VERSION: u32 = 1;

/// Names and plain values, one store for all scripts of a site.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Memory {
    entries: BTreeMap<String, Value>,
    weight: usize,
    changed: bool,
}

/// The file, version first.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    heliodon_memory: u32,
    remembered: BTreeMap<String, Value>,
}

impl Memory {
    /// What a name was remembered with.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.entries.get(name)
    }

    /// All names and values, in the order of the names.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Value)> {
        self.entries.iter().map(|(name, value)| (name.as_str(), value))
    }

    /// Whether something was remembered or forgotten since it was read or written.
    #[must_use]
    pub fn changed(&self) -> bool {
        self.changed
    }

    /// Whether it is within its limits and every value is sound.
    #[must_use]
    pub fn validate(&self) -> bool {
        let weigh = |(name, value): (&String, &Value)| name.len() + value.weight();
        self.entries.len() <= MAX_ENTRIES
            && self.entries.iter().map(weigh).sum::<usize>() == self.weight
            && self.weight <= MAX_BYTES
            && self.entries.iter().all(|entry| weigh(entry) <= MAX_ENTRY_BYTES && entry.1.is_sound())
    }

    /// Remembers a value by a name, instead of what was there.
    pub(crate) fn set(&mut self, name: &str, value: Value) -> Result<(), Wrong> {
        if self.entries.get(name) == Some(&value) {
            return Ok(());
        }
        let weight = name.len() + value.weight();
        if weight > MAX_ENTRY_BYTES {
            let message = format!("`{name}` would hold {weight} bytes");
            return Err(Wrong::new(message, format!("remember at most {MAX_ENTRY_BYTES} bytes by one name")));
        }
        let old = self.entries.get(name).map(|old| name.len() + old.weight());
        if old.is_none() && self.entries.len() == MAX_ENTRIES {
            return Err(Wrong::new(format!("{MAX_ENTRIES} names are remembered already"), "forget() some of them"));
        }
        let total = self.weight - old.unwrap_or(0) + weight;
        if total > MAX_BYTES {
            return Err(Wrong::new(
                format!("the memory is full: {} KiB", MAX_BYTES / 1024),
                "forget() what is no longer needed",
            ));
        }
        (self.weight, self.changed) = (total, true);
        self.entries.insert(name.to_owned(), value);
        Ok(())
    }

    /// Forgets a name.
    pub(crate) fn forget(&mut self, name: &str) {
        if let Some(old) = self.entries.remove(name) {
            self.weight -= name.len() + old.weight();
            self.changed = true;
        }
    }

    /// Forgets everything: the next visitor begins anew.
    pub fn clear(&mut self) {
        *self = Self { changed: self.changed || !self.entries.is_empty(), ..Self::default() };
    }

    /// Reads what an earlier visit left; nothing is remembered where there is no such file. A file that is not a memory, or cannot
    /// be read, is set aside as `NAME.damaged` (with a number where there is one), told of, and nothing is remembered.
    #[must_use]
    pub fn open(path: &Path) -> (Self, Option<Diagnostic>) {
        let fault = match read(path) {
            Ok(memory) => return (memory, None),
            Err(fault) => fault,
        };
        let told = |message: String, remedy: String| {
            let diagnostic = Diagnostic::new(&path.display().to_string(), Place(None), message, remedy);
            (Self::default(), Some(diagnostic.with_severity(Severity::Warning)))
        };
        match set_aside(path) {
            Ok(aside) => told(fault, format!("it was set aside as {}; this visit begins anew", aside.display())),
            Err(error) => told(format!("{fault}, and cannot be set aside: {error}"), "move it away".to_owned()),
        }
    }

    /// Writes it, whole or not at all: beside its place first, then renamed into it.
    ///
    /// # Errors
    /// Where the file system refuses; what was there is still there.
    pub fn save(&mut self, path: &Path) -> io::Result<()> {
        let stored = Stored { heliodon_memory: VERSION, remembered: self.entries.clone() };
        let mut text = serde_json::to_vec_pretty(&stored)?;
        text.push(b'\n');
        let mut temporary = path.as_os_str().to_owned();
        temporary.push(format!(".{}.tmp", std::process::id()));
        let temporary = PathBuf::from(temporary);
        let written = File::create(&temporary).and_then(|mut file| {
            file.write_all(&text)?;
            file.sync_all()
        });
        if let Err(error) = written.and_then(|()| fs::rename(&temporary, path)) {
            // what is left of it is of no use to anybody; the first error is the one to tell
            let _ = fs::remove_file(&temporary);
            return Err(error);
        }
        self.changed = false;
        Ok(())
    }
}

fn read(path: &Path) -> Result<Memory, String> {
    let mut text = String::new();
    match File::open(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Memory::default()),
        Err(error) => return Err(format!("the memory cannot be read: {error}")),
        Ok(file) => {
            let read = file.take(MAX_FILE_BYTES + 1).read_to_string(&mut text);
            read.map_err(|error| format!("the memory cannot be read: {error}"))?;
        }
    }
    if text.len() as u64 > MAX_FILE_BYTES {
        return Err(format!("the file has more than {MAX_FILE_BYTES} bytes and is no memory"));
    }
    let stored: Stored = serde_json::from_str(&text).map_err(|error| format!("the file is damaged: {error}"))?;
    if stored.heliodon_memory != VERSION {
        return Err(format!("the memory is of version {}, this program knows {VERSION}", stored.heliodon_memory));
    }
    let weight = stored.remembered.iter().map(|(name, value)| name.len() + value.weight()).sum();
    let memory = Memory { entries: stored.remembered, weight, changed: false };
    if memory.validate() { Ok(memory) } else { Err("the memory holds more than it may".to_owned()) }
}

fn set_aside(path: &Path) -> io::Result<PathBuf> {
    for number in 0..100 {
        let mut aside = path.as_os_str().to_owned();
        aside.push(if number == 0 { ".damaged".to_owned() } else { format!(".damaged.{number}") });
        let aside = PathBuf::from(aside);
        if !aside.exists() {
            return fs::rename(path, &aside).map(|()| aside);
        }
    }
    Err(io::Error::other("a hundred damaged ones lie there already"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_remembered_is_there_at_the_next_visit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("memory.json");
        let (mut memory, told) = Memory::open(&path);
        assert!(told.is_none() && !memory.changed());
        memory.set("mallet", true.into()).unwrap();
        memory.set("blows", 0.1.into()).unwrap();
        memory.set("whole", 2.0.into()).unwrap();
        assert!(memory.changed() && memory.validate());
        memory.save(&path).unwrap();
        assert!(!memory.changed());
        let (again, told) = Memory::open(&path);
        assert_eq!((again, told), (memory, None));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left beside it");
    }

    #[test]
    fn a_damaged_file_is_set_aside_and_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("memory.json");
        let deep = format!(r#"{{"heliodon_memory":1,"remembered":{{"a":{}1{}}}}}"#, "[".repeat(100_000), "]".repeat(100_000));
        let texts = ["{\"heliodon_memory\": 1, \"rem", "", "[]", "{\"heliodon_memory\": 7, \"remembered\": {}}", &deep];
        for (i, text) in texts.iter().enumerate() {
            fs::write(&path, text).unwrap();
            let (memory, told) = Memory::open(&path);
            assert_eq!(memory, Memory::default());
            let told = told.unwrap().to_string();
            assert!(told.contains("set aside as") && told.contains("memory.json.damaged"), "{told}");
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), i + 1);
        }
        fs::write(&path, [0xFF, 0xFE]).unwrap();
        assert!(Memory::open(&path).1.is_some());
    }

    #[test]
    fn limits_hold() {
        let mut memory = Memory::default();
        let wrong = memory.set("long", Value::Text("x".repeat(MAX_ENTRY_BYTES))).unwrap_err();
        assert!(wrong.message.contains("`long` would hold"), "{wrong}");
        let mut kept = 0;
        while memory.set(&format!("name{kept}"), Value::Text("x".repeat(200))).is_ok() {
            kept += 1;
        }
        assert_eq!(kept, MAX_ENTRIES);
        assert!(memory.validate());
        memory.forget("name3");
        memory.set("another", 1.into()).unwrap();
        memory.clear();
        assert!(memory.validate() && memory.changed() && memory.get("another").is_none());
    }

    #[test]
    fn what_cannot_be_written_leaves_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let mut memory = Memory::default();
        memory.set("a", 1.into()).unwrap();
        assert!(memory.save(&folder.path().join("no/such/folder.json")).is_err());
        assert!(memory.changed());
    }
}
