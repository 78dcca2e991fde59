//! Files that people write, `site.toml` and `display.toml`: from text to types, keeping the places of keys for messages.

mod error;
pub(crate) mod rules;
pub(crate) mod write;

pub use error::{ConfigError, line_and_column};

use serde::de::DeserializeOwned;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};

/// What is told of a kind of file where something is wrong with it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kind {
    /// Tables that there may be several of.
    pub many_tables: &'static [&'static str],
    /// What such a file describes, for messages.
    pub subject: &'static str,
    /// Where one sees what can be written.
    pub reference: &'static str,
    /// What to do where a key is missing, by its name.
    pub missing: &'static [(&'static str, &'static str)],
    /// What to do where the file itself is.
    pub no_file: &'static str,
}

/// The text of a file and where it came from.
#[derive(Clone, Debug)]
pub(crate) struct Source {
    kind: &'static Kind,
    file: PathBuf,
    text: String,
}

impl Source {
    pub(crate) fn new(kind: &'static Kind, file: &Path, text: &str) -> Self {
        Self { kind, file: file.to_owned(), text: text.to_owned() }
    }

    /// Reads the file.
    pub(crate) fn read(kind: &'static Kind, file: &Path) -> Result<Self, ConfigError> {
        let text = std::fs::read_to_string(file).map_err(|error| ConfigError {
            file: file.to_owned(),
            place: None,
            message: match error.kind() {
                std::io::ErrorKind::NotFound => "there is no such file".to_owned(),
                std::io::ErrorKind::InvalidData => "the file is not UTF-8 text".to_owned(),
                _ => format!("the file cannot be read: {error}"),
            },
            remedy: kind.no_file.to_owned(),
        })?;
        Ok(Self::new(kind, file, &text))
    }

    pub(crate) fn file(&self) -> &Path {
        &self.file
    }

    /// The folder from which relative paths start.
    pub(crate) fn folder(&self) -> &Path {
        self.file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
    }

    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    pub(crate) fn parse<T: DeserializeOwned>(&self) -> Result<T, ConfigError> {
        toml::from_str(&self.text).map_err(|error| {
            let place = error.span().map(|span| line_and_column(&self.text, span.start));
            let (message, remedy) = self.single_table(error.span()).unwrap_or_else(|| explain(self.kind, error.message()));
            ConfigError { file: self.file.clone(), place, message, remedy }
        })
    }

    /// What to say where a table in single brackets stands for what there may be several of.
    fn single_table(&self, place: Option<Range<usize>>) -> Option<(String, String)> {
        let header = self.text.get(place?.start..)?.trim_start_matches('[').split([']', '\n']).next()?;
        let name = *self.kind.many_tables.iter().find(|name| **name == header.trim())?;
        let table = DeTable::parse(&self.text).ok()?;
        let (_, value) = lookup(table.get_ref(), name)?;
        matches!(value, DeValue::Table(_)).then(|| {
            let subject = self.kind.subject;
            (format!("[{name}] is one table, but {subject} may have several"), format!("write [[{name}]], with two brackets"))
        })
    }

    /// An error at a key such as `["part", "0", "albedo"]`: at its value, or at the nearest table that is there.
    pub(crate) fn error_at(&self, path: &[String], message: String, remedy: String) -> ConfigError {
        let place = self.offset_of(path).map(|offset| line_and_column(&self.text, offset));
        ConfigError { file: self.file.clone(), place, message, remedy }
    }

    /// An error at the key that has a fault.
    pub(crate) fn fault(&self, fault: rules::Fault) -> ConfigError {
        self.error_at(&fault.path, fault.message, fault.remedy)
    }

    /// Whether a table of the text has a key.
    pub(crate) fn has(&self, table: &str, key: &str) -> bool {
        DeTable::parse(&self.text).is_ok_and(
            |root| matches!(lookup(root.get_ref(), table), Some((_, DeValue::Table(table))) if lookup(table, key).is_some()),
        )
    }

    fn offset_of(&self, path: &[String]) -> Option<usize> {
        let table = DeTable::parse(&self.text).ok()?;
        let mut offset = None;
        let mut value: Option<&DeValue<'_>> = None;
        for segment in path {
            let next = match value {
                None => lookup(table.get_ref(), segment),
                Some(DeValue::Table(table)) => match lookup(table, segment) {
                    // one table where there may be several
                    None if segment == "0" => continue,
                    found => found,
                },
                Some(DeValue::Array(array)) => {
                    segment.parse::<usize>().ok().and_then(|i| array.get(i)).map(|v| (v.span().start, v.get_ref()))
                }
                Some(_) => None,
            };
            let Some((start, inner)) = next else { break };
            offset = Some(start);
            value = Some(inner);
        }
        offset
    }
}

/// The JSON schema of a file's type.
pub(crate) fn json_schema<T: schemars::JsonSchema>() -> String {
    let mut text = serde_json::to_string_pretty(&schemars::schema_for!(T)).unwrap_or_default();
    text.push('\n');
    text
}

fn lookup<'a, 'i>(table: &'a DeTable<'i>, key: &str) -> Option<(usize, &'a DeValue<'i>)> {
    let (found, value) = table.iter().find(|(k, _)| k.get_ref() == key)?;
    // a table's own span is its header's; an inline value is pointed at by itself, a table by its key
    let start =
        if matches!(value.get_ref(), DeValue::Table(_) | DeValue::Array(_)) { found.span() } else { value.span() }.start;
    Some((start, value.get_ref()))
}

/// The one of `known` that a slip of the pen makes `found` of: whatever the capitals, at most every third character is another, and
/// no second word is as near.
fn nearest<'k>(found: &str, known: &[&'k str]) -> Option<&'k str> {
    let found = found.to_lowercase();
    let distance = |k: &str| strsim::damerau_levenshtein(&found, &k.to_lowercase());
    let least = known.iter().map(|k| distance(k)).min().filter(|least| *least <= found.chars().count() / 3)?;
    let mut nearest = known.iter().filter(|k| distance(k) == least);
    nearest.next().filter(|_| nearest.next().is_none()).copied()
}

/// A parser's message with the remedy that follows from it.
fn explain(kind: &Kind, message: &str) -> (String, String) {
    // names of Rust's types say nothing to people who write a site
    let message = message.trim().replace('\n', ", ");
    let kinds = [
        ("expected u32", "expected a whole number from 0 up"),
        ("expected u64", "expected a whole number from 0 up"),
        ("expected f64", "expected a number"),
    ];
    let message = kinds.iter().fold(message, |text, (kind, words)| text.replace(kind, words));
    for unknown in ["unknown field", "unknown variant"] {
        let Some(rest) = message.strip_prefix(unknown) else { continue };
        let mut quoted = rest.split('`').skip(1).step_by(2);
        let Some(found) = quoted.next() else { break };
        let known: Vec<&str> = quoted.collect();
        let what = if unknown == "unknown field" { "key" } else { "value" };
        let remedy = match nearest(found, &known) {
            Some(k) => format!("did you mean `{k}`?"),
            None => format!("write one of: {}", known.join(", ")),
        };
        return (format!("unknown {what} `{found}`"), remedy);
    }
    if let Some(field) = message.strip_prefix("missing field `").and_then(|rest| rest.strip_suffix('`')) {
        let remedy = kind.missing.iter().find(|(key, _)| *key == field).map_or("add it", |(_, remedy)| remedy);
        return (format!("`{field}` is missing"), remedy.to_owned());
    }
    let remedy = if message.contains("datetime") {
        "write dates and times in quotes: \"-0437-08-01\", \"06:57\""
    } else if message.contains("duplicate key") {
        "keep one of the two"
    } else if message.contains("string values must be quoted") {
        "put text in quotes"
    } else if message.contains("write ") {
        "" // the value's own parser has said it
    } else {
        kind.reference
    };
    (message, remedy.to_owned())
}
