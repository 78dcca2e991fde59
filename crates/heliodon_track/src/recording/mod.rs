//! What trackers reported, kept in files: poses to play back, packets to send again.
//!
//! Both are text, a line each, words between blanks; what follows a `#` is a comment. Text rather than something denser because
//! people cut, mend and write them by hand: a minute of a head and a wand at 60 Hz is 600 KB.

mod packets;
mod player;
mod poses;
mod send;

pub use packets::{LoggedPacket, PacketLog};
pub use player::Player;
pub use poses::{PoseRecording, Sample};
pub use send::{SendError, send};

use std::fmt;
use std::path::{Path, PathBuf};

/// The latest moment of a recording, seconds: three years.
const LATEST_S: f64 = 1e8;

/// Something wrong with a recording: file, place, fault, remedy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordingError {
    /// The file, where it came from one.
    pub file: Option<PathBuf>,
    /// Line and column, both counted from 1, columns in characters, where the fault has a place.
    pub place: Option<(usize, usize)>,
    /// What is wrong.
    pub message: String,
    /// What to do about it.
    pub remedy: String,
}

impl fmt::Display for RecordingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{}:", file.display())?;
        }
        if let Some((line, column)) = self.place {
            write!(f, "{line}:{column}:")?;
        }
        let blank = if self.file.is_some() || self.place.is_some() { " " } else { "" };
        write!(f, "{blank}{}; {}", self.message, self.remedy)
    }
}

impl std::error::Error for RecordingError {}

impl RecordingError {
    fn new(message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { file: None, place: None, message: message.into(), remedy: remedy.into() }
    }
}

/// Reads a file and what is in it.
fn read<T>(path: &Path, parse: impl FnOnce(&str) -> Result<T, RecordingError>) -> Result<T, RecordingError> {
    let text = std::fs::read_to_string(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => RecordingError::new("there is no such file", "check the path"),
        std::io::ErrorKind::InvalidData => RecordingError::new("the file is not UTF-8 text", "give a recording of Heliodon's"),
        _ => RecordingError::new(format!("the file cannot be read: {error}"), "check the path and your rights"),
    });
    let result = text.and_then(|text| parse(&text));
    result.map_err(|error| RecordingError { file: Some(path.to_owned()), ..error })
}

/// Writes a file, beside it first, so that a crash never leaves half of one.
fn write(path: &Path, text: &str) -> Result<(), RecordingError> {
    let mut beside = path.as_os_str().to_owned();
    beside.push(".partial");
    let written = std::fs::write(&beside, text).and_then(|()| std::fs::rename(&beside, path));
    written.map_err(|error| {
        let message = format!("the file cannot be written: {error}");
        let error = RecordingError::new(message, "check the folder, your rights and the space left");
        RecordingError { file: Some(path.to_owned()), ..error }
    })
}

/// The words of one line, with their places.
struct Words<'a> {
    /// From 1.
    number: usize,
    line: &'a str,
    /// Where in the line the rest begins, bytes.
    at: usize,
    /// Where the last word began.
    last: usize,
}

/// The lines of a text that have words.
fn lines(text: &str) -> impl Iterator<Item = Words<'_>> {
    text.lines().enumerate().filter_map(|(i, line)| {
        let line = line.split('#').next().unwrap_or_default();
        (!line.trim().is_empty()).then_some(Words { number: i + 1, line, at: 0, last: 0 })
    })
}

impl<'a> Words<'a> {
    /// The next word; at the end of the line, nothing.
    fn word(&mut self) -> Option<&'a str> {
        let rest = &self.line[self.at..];
        let begin = rest.len() - rest.trim_start().len();
        self.last = self.at + begin;
        let word = rest[begin..].split_whitespace().next()?;
        self.at = self.last + word.len();
        Some(word)
    }

    /// An error at the word that was read last, or at the end of the line where there was none left.
    fn wrong<T>(&self, message: impl Into<String>, remedy: impl Into<String>) -> Result<T, RecordingError> {
        let column = self.line[..self.last].chars().count() + 1;
        Err(RecordingError { place: Some((self.number, column)), ..RecordingError::new(message, remedy) })
    }

    /// The next word as a number; `remedy` says what belongs there.
    fn number(&mut self, remedy: &str) -> Result<f64, RecordingError> {
        let Some(word) = self.word() else {
            return self.wrong("the line ends too early", remedy);
        };
        match word.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => self.wrong(format!("`{word}` is no number"), remedy),
        }
    }

    /// The moment that a line begins with, not before that of the line above.
    fn moment(&mut self, above_s: f64) -> Result<f64, RecordingError> {
        let seconds = self.number("begin the line with seconds")?;
        if !(0.0..=LATEST_S).contains(&seconds) {
            return self.wrong(format!("{seconds} seconds are none of a recording"), "count them from 0 up");
        }
        if seconds < above_s {
            return self.wrong(format!("{seconds} comes after {above_s}"), "sort the lines by their seconds");
        }
        Ok(seconds)
    }

    /// Nothing follows.
    fn end(&mut self) -> Result<(), RecordingError> {
        match self.word() {
            None => Ok(()),
            Some(word) => self.wrong(format!("`{word}` is too much"), "take it out, or put # before it"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_know_their_columns_in_characters() {
        let mut lines = lines("# heading\n\n  a\té bc # rest\n");
        let mut words = lines.next().unwrap();
        assert!(lines.next().is_none());
        let mut place = |expected: Option<&str>| {
            assert_eq!(words.word(), expected);
            words.wrong::<()>("", "").unwrap_err().place
        };
        assert_eq!(place(Some("a")), Some((3, 3)));
        assert_eq!(place(Some("é")), Some((3, 5)));
        assert_eq!(place(Some("bc")), Some((3, 7)));
        assert_eq!(place(None), Some((3, 10)));
    }

    #[test]
    fn files_that_cannot_be_read_or_written_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("none.poses");
        let error = PoseRecording::read(&path).unwrap_err().to_string();
        assert!(error.ends_with("none.poses: there is no such file; check the path"), "{error}");
        std::fs::write(&path, [0xff, 0xfe]).unwrap();
        assert!(PoseRecording::read(&path).unwrap_err().to_string().contains("UTF-8"));
        let error = PacketLog::default().write(&folder.path().join("no/such/folder")).unwrap_err().to_string();
        assert!(error.contains("folder: the file cannot be written"), "{error}");
    }
}
