//! Numbers in lines.

use super::FormatError;
use std::path::Path;

pub(super) fn read_text(path: &Path) -> Result<String, FormatError> {
    std::fs::read_to_string(path).map_err(|e| FormatError::Read { file: path.display().to_string(), why: e.to_string() })
}

pub(super) fn fault(path: &Path, line: usize, what: impl Into<String>) -> FormatError {
    FormatError::Content { file: path.display().to_string(), line: (line > 0).then_some(line), what: what.into() }
}

/// The word at a place as a number.
pub(super) fn number<T: std::str::FromStr>(
    path: &Path,
    line: usize,
    words: &[&str],
    at: usize,
    what: &str,
) -> Result<T, FormatError> {
    let word = words.get(at).ok_or_else(|| fault(path, line, format!("{what} is missing")))?;
    word.parse().map_err(|_| fault(path, line, format!("{what} should be a number, not `{word}`")))
}

/// N numbers from a place on.
pub(super) fn numbers<const N: usize>(
    path: &Path,
    line: usize,
    words: &[&str],
    at: usize,
    what: &str,
) -> Result<[f64; N], FormatError> {
    let mut all = [0.0; N];
    for (i, value) in all.iter_mut().enumerate() {
        *value = number::<f64>(path, line, words, at + i, what)?;
        if !f64::is_finite(*value) {
            return Err(fault(path, line, format!("{what} is not a finite number")));
        }
    }
    Ok(all)
}
