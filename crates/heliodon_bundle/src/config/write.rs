//! Files for people to go on from: what is set, and beside it, commented out, what could be.

use serde::Serialize;
use std::fmt::Write;

/// Writes lines `key = value  # comment`, commented out where the value is the default.
#[derive(Default)]
pub(crate) struct Writer {
    pub(crate) text: String,
}

/// TOML's notation of a value. The types here always have one.
fn toml_value(value: impl Serialize) -> String {
    let mut text = String::new();
    match value.serialize(toml::ser::ValueSerializer::new(&mut text)) {
        Ok(_) => text,
        Err(error) => format!("\"{error}\""),
    }
}

impl Writer {
    /// A line as it is.
    pub(crate) fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    /// A key and its value.
    pub(crate) fn set(&mut self, key: &str, value: impl Serialize, comment: &str) {
        let value = toml_value(value);
        let gap = if comment.is_empty() { "" } else { "  # " };
        let _ = writeln!(self.text, "{key} = {value}{gap}{comment}");
    }

    /// A key whose value may be its default; then it stands there as a comment.
    pub(crate) fn optional<T: Serialize + PartialEq>(&mut self, key: &str, value: &T, default: &T, comment: &str) {
        if value == default {
            self.text.push_str("# ");
        }
        self.set(key, value, comment);
    }

    /// A key that may be absent; then an example stands there as a comment.
    pub(crate) fn absent<T: Serialize>(&mut self, key: &str, value: Option<&T>, example: &str, comment: &str) {
        match value {
            Some(value) => self.set(key, value, comment),
            None => {
                let _ = writeln!(self.text, "# {key} = {example}  # {comment}");
            }
        }
    }
}

/// Writes a table as a comment.
pub(crate) fn write_example(w: &mut Writer, write: impl Fn(&mut Writer)) {
    let mut example = Writer::default();
    write(&mut example);
    for line in example.text.lines() {
        let gap = if line.is_empty() || line.starts_with('#') { "" } else { "# " };
        w.line(&format!("{gap}{line}"));
    }
}
