//! From text to types, keeping the places of keys for messages.

use super::SiteError;
use super::error::line_and_column;
use super::types::SiteFile;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};

/// Tables that there may be several of.
const MANY_TABLES: [&str; 5] = ["part", "room", "actor", "light", "matte"];

/// The text of a `site.toml` and where it came from.
#[derive(Clone, Debug)]
pub(super) struct Source {
    file: PathBuf,
    text: String,
}

impl Source {
    pub(super) fn new(file: &Path, text: &str) -> Self {
        Self { file: file.to_owned(), text: text.to_owned() }
    }

    pub(super) fn file(&self) -> &Path {
        &self.file
    }

    pub(super) fn text(&self) -> &str {
        &self.text
    }

    pub(super) fn parse(&self) -> Result<SiteFile, SiteError> {
        toml::from_str(&self.text).map_err(|error| {
            let place = error.span().map(|span| line_and_column(&self.text, span.start));
            let (message, remedy) = self.single_table(error.span()).unwrap_or_else(|| explain(error.message()));
            SiteError { file: self.file.clone(), place, message, remedy }
        })
    }

    /// What to say where a table in single brackets stands for what there may be several of.
    fn single_table(&self, place: Option<Range<usize>>) -> Option<(String, String)> {
        let header = self.text.get(place?.start..)?.trim_start_matches('[').split([']', '\n']).next()?;
        let name = MANY_TABLES.into_iter().find(|name| *name == header.trim())?;
        let table = DeTable::parse(&self.text).ok()?;
        let (_, value) = lookup(table.get_ref(), name)?;
        matches!(value, DeValue::Table(_)).then(|| {
            (format!("[{name}] is one table, but a site may have several"), format!("write [[{name}]], with two brackets"))
        })
    }

    /// An error at a key such as `["part", "0", "albedo"]`: at its value, or at the nearest table that is there.
    pub(super) fn error_at(&self, path: &[String], message: String, remedy: String) -> SiteError {
        let place = self.offset_of(path).map(|offset| line_and_column(&self.text, offset));
        SiteError { file: self.file.clone(), place, message, remedy }
    }

    /// Whether a table of the text has a key.
    pub(super) fn has(&self, table: &str, key: &str) -> bool {
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
                Some(DeValue::Table(table)) => lookup(table, segment),
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
fn explain(message: &str) -> (String, String) {
    // names of Rust's types say nothing to people who write a site
    let message = message.trim().replace('\n', ", ");
    let kinds = [
        ("expected u32", "expected a whole number from 0 up"),
        ("expected u64", "expected a whole number from 0 up"),
        ("expected f64", "expected a number"),
    ];
    let message = kinds.iter().fold(message, |text, (kind, words)| text.replace(kind, words));
    for kind in ["unknown field", "unknown variant"] {
        let Some(rest) = message.strip_prefix(kind) else { continue };
        let mut quoted = rest.split('`').skip(1).step_by(2);
        let Some(found) = quoted.next() else { break };
        let known: Vec<&str> = quoted.collect();
        let what = if kind == "unknown field" { "key" } else { "value" };
        let remedy = match nearest(found, &known) {
            Some(k) => format!("did you mean `{k}`?"),
            None => format!("write one of: {}", known.join(", ")),
        };
        return (format!("unknown {what} `{found}`"), remedy);
    }
    if let Some(field) = message.strip_prefix("missing field `").and_then(|rest| rest.strip_suffix('`')) {
        let remedy = match field {
            "site" => "begin with a table [site] that holds name = \"...\"",
            "sky" => "add a table [sky] with probes and mapping, or with model and date",
            _ => "add it",
        };
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
        "schema/site.schema.json and `heliodon new` show what can be written"
    };
    (message, remedy.to_owned())
}
