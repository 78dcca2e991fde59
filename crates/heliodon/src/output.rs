//! Results on standard output: text for people, or one JSON object.

use anyhow::{Context, Result};
use serde::Serialize;
use std::io::{self, Write};

/// Whoever read our output has closed it; the work is over, and well.
#[derive(Debug, thiserror::Error)]
#[error("the reader of the output has gone")]
pub struct ReaderGone;

/// What a command has to say, in both forms. Only the one that was asked for is made.
pub struct Output {
    /// Whether a JSON object was asked for.
    pub json: bool,
}

impl Output {
    /// Writes `text()`, or `value` as one JSON object.
    ///
    /// # Errors
    /// If standard output cannot be written; [`ReaderGone`] where nobody reads any more.
    pub fn result<T: Serialize>(&self, value: &T, text: impl FnOnce(&T) -> String) -> Result<()> {
        let mut bytes = if self.json {
            serde_json::to_vec_pretty(value).context("the result cannot be written as JSON")?
        } else {
            text(value).into_bytes()
        };
        if bytes.last() != Some(&b'\n') {
            bytes.push(b'\n');
        }
        let mut out = io::stdout().lock();
        match out.write_all(&bytes).and_then(|()| out.flush()) {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Err(ReaderGone.into()),
            other => other.context("cannot write to standard output"),
        }
    }
}

/// Rows of cells with aligned columns, numbers to the right.
pub fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let width = |column: usize| {
        rows.iter().filter_map(|row| row.get(column)).chain([&head[column].to_owned()]).map(|cell| cell.chars().count()).max()
    };
    let widths: Vec<usize> = (0..head.len()).map(|column| width(column).unwrap_or(0)).collect();
    let numeric: Vec<bool> = (0..head.len())
        .map(|column| {
            rows.iter()
                .filter_map(|row| row.get(column))
                .all(|cell| cell.starts_with(|c: char| c.is_ascii_digit() || "-+–".contains(c)) || cell.is_empty())
        })
        .collect();
    let line = |cells: &mut dyn Iterator<Item = &str>| {
        let mut line = String::new();
        for (column, cell) in cells.enumerate() {
            let pad = " ".repeat(widths[column].saturating_sub(cell.chars().count()));
            let gap = if column == 0 { "" } else { "  " };
            line += &if numeric[column] { format!("{gap}{pad}{cell}") } else { format!("{gap}{cell}{pad}") };
        }
        line.trim_end().to_owned() + "\n"
    };
    let mut text = line(&mut head.iter().copied());
    for row in rows {
        text += &line(&mut row.iter().map(String::as_str));
    }
    text
}

/// A count with its thousands set apart.
pub fn count(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::with_capacity(digits.len() * 4 / 3);
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A count with what is counted: `1 sky`, `2 skies`.
pub fn counted(number: u64, one: &str, many: &str) -> String {
    format!("{} {}", count(number), if number == 1 { one } else { many })
}

/// Bytes in the unit that suits them.
pub fn bytes(number: u64) -> String {
    match number {
        0..1_000 => format!("{number} B"),
        1_000..1_000_000 => format!("{:.1} kB", number as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", number as f64 / 1e6),
        _ => format!("{:.2} GB", number as f64 / 1e9),
    }
}

/// Seconds as people say them.
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..10 => format!("{seconds:.1} s"),
        10..100 => format!("{whole} s"),
        100..6000 => format!("{} min {:02} s", whole / 60, whole % 60),
        _ => format!("{} h {:02} min", whole / 3600, whole / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_set_for_people() {
        assert_eq!(
            (count(0), count(999), count(1_000), count(12_345_678)),
            ("0".into(), "999".into(), "1,000".into(), "12,345,678".into())
        );
        assert_eq!((counted(1, "sky", "skies"), counted(1000, "sky", "skies")), ("1 sky".into(), "1,000 skies".into()));
        assert_eq!((bytes(12), bytes(1_500), bytes(2_500_000_000)), ("12 B".into(), "1.5 kB".into(), "2.50 GB".into()));
        assert_eq!(
            (duration(1.25), duration(75.0), duration(125.0), duration(7260.0)),
            ("1.2 s".into(), "75 s".into(), "2 min 05 s".into(), "2 h 01 min".into())
        );
    }

    #[test]
    fn tables_align() {
        let rows = [vec!["ground".into(), "12".into()], vec!["a".into(), "3,456".into()]];
        assert_eq!(table(&["part", "triangles"], &rows), "part    triangles\nground         12\na           3,456\n");
    }
}
