//! What is wrong with a script, told so that its author can mend it.

use serde::Serialize;
use std::fmt;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// What a script prints, and what else is only told.
    Note,
    /// Odd, and perhaps meant.
    Warning,
    /// The script cannot run, or what it asked for was not done.
    Error,
}

/// Something to tell an author: file, place, fault, remedy.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// The script's name, or the file's.
    pub file: String,
    /// Line and column, both counted from 1, columns in characters; none where there is no place.
    pub place: Option<(usize, usize)>,
    /// What is wrong.
    pub message: String,
    /// What to do about it; empty where nothing need be done.
    pub remedy: String,
}

impl Diagnostic {
    pub(crate) fn new(file: &str, place: Place, message: impl Into<String>, remedy: impl Into<String>) -> Self {
        let (message, remedy) = (message.into(), remedy.into());
        Self { severity: Severity::Error, file: file.to_owned(), place: place.0, message, remedy }
    }

    pub(crate) fn with_severity(self, severity: Severity) -> Self {
        Self { severity, ..self }
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file)?;
        if let Some((line, column)) = self.place {
            write!(f, ":{line}:{column}")?;
        }
        let word = if self.severity == Severity::Warning { "warning: " } else { "" };
        write!(f, ": {word}{}", self.message)?;
        if self.remedy.is_empty() { Ok(()) } else { write!(f, "; {}", self.remedy) }
    }
}

impl std::error::Error for Diagnostic {}

/// Line and column, where there are any.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct Place(pub Option<(usize, usize)>);

impl From<rhai::Position> for Place {
    fn from(position: rhai::Position) -> Self {
        // Rhai's column is 0 at the beginning of a line and its end of file has a line alone
        Self(position.line().map(|line| (line, position.position().unwrap_or(1).max(1))))
    }
}

/// What a native function refuses to do. Handed through Rhai as the value of a thrown error.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Wrong {
    pub message: String,
    pub remedy: String,
}

impl Wrong {
    pub(crate) fn new(message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { message: message.into(), remedy: remedy.into() }
    }
}

impl fmt::Display for Wrong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; {}", self.message, self.remedy)
    }
}

/// The one of `known` that a slip of the pen makes `found` of: whatever the capitals, at most every third character is another,
/// and no second word is as near.
pub(crate) fn nearest<'k>(found: &str, known: impl IntoIterator<Item = &'k str>) -> Option<&'k str> {
    let found = found.to_lowercase();
    let most = (found.chars().count() / 3).max(1);
    let (mut best, mut least, mut ties) = (None, most + 1, 0);
    for word in known {
        let distance = strsim::damerau_levenshtein(&found, &word.to_lowercase());
        if distance < least {
            (best, least, ties) = (Some(word), distance, 0);
        } else if distance == least {
            ties += 1;
        }
    }
    best.filter(|_| ties == 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_diagnostic_is_one_line() {
        let told = Diagnostic::new("yard.rhai", Place(Some((3, 12))), "there is no thing `malet`", "did you mean `mallet`?");
        assert_eq!(told.to_string(), "yard.rhai:3:12: there is no thing `malet`; did you mean `mallet`?");
        let warning = Diagnostic { place: None, remedy: String::new(), ..told }.with_severity(Severity::Warning);
        assert_eq!(warning.to_string(), "yard.rhai: warning: there is no thing `malet`");
    }

    #[test]
    fn the_nearest_word_is_found_where_there_is_one() {
        let known = ["mallet", "chisel", "ladle"];
        assert_eq!(nearest("malet", known), Some("mallet"));
        assert_eq!(nearest("CHISEL", known), Some("chisel"));
        assert_eq!(nearest("zeus", known), None);
        assert_eq!(nearest("part3", ["part1", "part2"]), None, "both are as near");
    }
}
