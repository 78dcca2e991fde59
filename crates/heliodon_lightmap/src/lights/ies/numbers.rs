//! Lines and numbers of an IES file.

use super::error::{IesError, IesProblem};

/// Lines, however they end (LF, CR LF, or CR alone), with their numbers from 1.
#[derive(Clone, Debug)]
pub(super) struct Lines<'a> {
    rest: Option<&'a str>,
    /// The number of the line that was read last.
    pub line: usize,
}

impl<'a> Lines<'a> {
    pub fn new(text: &'a str) -> Self {
        Self { rest: Some(text), line: 0 }
    }

    pub fn next(&mut self) -> Option<&'a str> {
        let rest = self.rest?;
        self.line += 1;
        let Some(end) = rest.find(['\n', '\r']) else {
            self.rest = None;
            return Some(rest);
        };
        let (line, ending) = rest.split_at(end);
        self.rest = Some(ending.strip_prefix("\r\n").unwrap_or_else(|| &ending[1..]));
        Some(line)
    }
}

/// Numbers, with spaces, tabs, commas and any line ends between.
#[derive(Clone, Debug)]
pub(super) struct Numbers<'a> {
    lines: Lines<'a>,
    current: &'a str,
}

/// Between numbers; 0x1A is the end of file of DOS.
fn is_gap(c: char) -> bool {
    c.is_whitespace() || c == ',' || c == '\u{1a}' || c == '\0'
}

impl<'a> Numbers<'a> {
    /// Those of the lines that are left.
    pub fn new(lines: Lines<'a>) -> Self {
        Self { lines, current: "" }
    }

    pub fn error(&self, problem: IesProblem) -> IesError {
        IesError { line: self.lines.line.max(1), problem }
    }

    /// The next number, finite; `what` it is, for messages.
    pub fn next(&mut self, what: &'static str) -> Result<f64, IesError> {
        loop {
            self.current = self.current.trim_start_matches(is_gap);
            if !self.current.is_empty() {
                break;
            }
            self.current = self.lines.next().ok_or_else(|| self.error(IesProblem::Ends { what }))?;
        }
        let end = self.current.find(is_gap).unwrap_or(self.current.len());
        let (word, rest) = self.current.split_at(end);
        self.current = rest;
        word.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| {
            let found = word.chars().take(20).collect();
            self.error(IesProblem::NotANumber { what, found })
        })
    }

    /// The next number, where `holds` of it.
    pub fn next_where(
        &mut self,
        what: &'static str,
        allowed: &'static str,
        holds: impl Fn(f64) -> bool,
    ) -> Result<f64, IesError> {
        let value = self.next(what)?;
        if holds(value) { Ok(value) } else { Err(self.error(IesProblem::Value { what, value, allowed })) }
    }

    /// The next number, whole and within a range.
    pub fn count(&mut self, what: &'static str, allowed: &'static str, least: usize, most: usize) -> Result<usize, IesError> {
        let whole = |x: f64| x.fract() == 0.0 && x >= least as f64 && x <= most as f64;
        self.next_where(what, allowed, whole).map(|x| x as usize)
    }

    /// Rising angles, degrees.
    pub fn angles(&mut self, count: usize, what: &'static str, most: f64) -> Result<Vec<f64>, IesError> {
        let mut angles: Vec<f64> = Vec::new();
        for _ in 0..count {
            let allowed = if most > 180.0 { "from 0 to 360 degrees" } else { "from 0 to 180 degrees" };
            let after = self.next_where(what, allowed, |x| (0.0..=most).contains(&x))?;
            if let Some(&before) = angles.last()
                && after <= before
            {
                return Err(self.error(IesProblem::Order { what, before, after }));
            }
            angles.push(after);
        }
        Ok(angles)
    }
}
