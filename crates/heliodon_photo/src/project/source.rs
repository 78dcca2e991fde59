//! The text of a project and the places of its keys, for messages.

use std::fmt;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};

/// Something wrong with a project: file, place, fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProjectError {
    /// The file that is wrong.
    pub file: PathBuf,
    /// Line and column, both counted from 1, where the fault has a place.
    pub place: Option<(usize, usize)>,
    /// What is wrong, and what to do about it.
    pub message: String,
}

impl fmt::Display for ProjectError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some((line, column)) = self.place {
            write!(f, ":{line}:{column}")?;
        }
        write!(f, ": {}", self.message)
    }
}

impl std::error::Error for ProjectError {}

pub(super) struct Source<'a> {
    pub(super) file: &'a Path,
    pub(super) text: &'a str,
}

impl Source<'_> {
    pub(super) fn parse<T: serde::de::DeserializeOwned>(&self) -> Result<T, ProjectError> {
        toml::from_str(self.text).map_err(|error| ProjectError {
            file: self.file.to_owned(),
            place: error.span().map(|span| line_and_column(self.text, span.start)),
            message: error.message().trim().replace('\n', ", "),
        })
    }

    /// An error at a key such as `["point", "3", "marks"]`, or at the nearest table that is there.
    pub(super) fn error_at(&self, path: &[&str], message: impl Into<String>) -> ProjectError {
        let place = self.offset_of(path).map(|offset| line_and_column(self.text, offset));
        ProjectError { file: self.file.to_owned(), place, message: message.into() }
    }

    fn offset_of(&self, path: &[&str]) -> Option<usize> {
        let root = DeTable::parse(self.text).ok()?;
        let mut offset = None;
        let mut value: Option<&DeValue<'_>> = None;
        for segment in path {
            let table = match value {
                None => Some(root.get_ref()),
                Some(DeValue::Table(table)) => Some(table),
                _ => None,
            };
            let next = match (table, value) {
                (Some(table), _) => table
                    .iter()
                    .find(|(key, _)| key.get_ref() == segment)
                    .map(|(key, inner)| (key.span().start, inner.get_ref())),
                (None, Some(DeValue::Array(array))) => {
                    segment.parse::<usize>().ok().and_then(|i| array.get(i)).map(|v| (v.span().start, v.get_ref()))
                }
                _ => None,
            };
            let Some((start, inner)) = next else { break };
            offset = Some(start);
            value = Some(inner);
        }
        offset
    }
}

/// Line and column of a byte offset, counted from 1; columns count characters.
fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let mut end = offset.min(text.len());
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let before = &text[..end];
    let line_start = before.rfind('\n').map_or(0, |i| i + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}
