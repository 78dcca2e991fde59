//! What values must be, whatever file they stand in.

/// A fault with the path of the key that has it.
pub(crate) struct Fault {
    /// The names and numbers of tables and keys, from the outermost.
    pub(crate) path: Vec<String>,
    /// What is wrong.
    pub(crate) message: String,
    /// What to do about it.
    pub(crate) remedy: String,
}

/// Whether something is as it should be.
pub(crate) type Checked = Result<(), Fault>;

/// What is taken for a coordinate, metres: beyond, a slip of unit or exponent is surer than a monument.
pub(crate) const COORDINATES_M: std::ops::RangeInclusive<f64> = -1e9..=1e9;

/// Something is not.
pub(crate) fn fault(path: &[&str], message: impl Into<String>, remedy: impl Into<String>) -> Checked {
    Err(Fault { path: path.iter().map(|&s| s.to_owned()).collect(), message: message.into(), remedy: remedy.into() })
}

/// A number has its range.
pub(crate) fn within(path: &[&str], value: f64, min: f64, max: f64) -> Checked {
    if (min..=max).contains(&value) {
        return Ok(());
    }
    let key = path.last().unwrap_or(&"");
    fault(path, format!("{key} is {value}"), format!("give a number from {min} to {max}"))
}

/// Coordinates are numbers, and of a monument.
pub(crate) fn finite(path: &[&str], values: &[f64]) -> Checked {
    match values.iter().find(|v| !COORDINATES_M.contains(*v)) {
        None => Ok(()),
        Some(v) => fault(
            path,
            format!("{} holds {v}", path.last().unwrap_or(&"")),
            "give finite numbers, at most a thousand million in size",
        ),
    }
}

/// A text says something.
pub(crate) fn not_empty(path: &[&str], text: &str) -> Checked {
    if text.trim().is_empty() {
        return fault(path, format!("{} is empty", path.last().unwrap_or(&"")), "write something there");
    }
    Ok(())
}
