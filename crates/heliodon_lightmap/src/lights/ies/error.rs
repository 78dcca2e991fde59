//! What can be wrong with an IES file.

use thiserror::Error;

/// Why an IES file cannot be used, and where.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("line {line}: {problem}")]
pub struct IesError {
    /// The line, from 1.
    pub line: usize,
    /// What is wrong there.
    pub problem: IesProblem,
}

/// What is wrong.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum IesProblem {
    /// Larger than photometry ever is.
    #[error("the file has {bytes} bytes, more than {limit}: this is no IES file")]
    TooLong {
        /// Its size.
        bytes: usize,
        /// The most that is read.
        limit: usize,
    },
    /// No TILT line before the end.
    #[error(
        "there is no line that begins with TILT=: this is no IES LM-63 file, or its end is missing; export or download it again"
    )]
    NoTilt,
    /// The tilt's numbers are in another file.
    #[error(
        "TILT={0} names another file: write TILT=INCLUDE and that file's numbers after it, or TILT=NONE for a lamp that tilting does not change"
    )]
    TiltFile(String),
    /// Something else where a number should be.
    #[error("{found:?} is no number, but {what} should stand here: check for a missing or an extra number before it")]
    NotANumber {
        /// What should be there.
        what: &'static str,
        /// What is there, cut short.
        found: String,
    },
    /// The end where a number should be.
    #[error("the file ends where {what} should stand: its end is missing, or the numbers of angles are wrong")]
    Ends {
        /// What should be there.
        what: &'static str,
    },
    /// A number outside its range.
    #[error("{what} is {value}, but must be {allowed}")]
    Value {
        /// What it is.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// More candelas than photometry ever has.
    #[error("{vertical} vertical times {horizontal} horizontal angles are more than {limit}: check the numbers of angles")]
    TooMany {
        /// Vertical angles.
        vertical: usize,
        /// Horizontal angles.
        horizontal: usize,
        /// The most candelas that are read.
        limit: usize,
    },
    /// Angles that do not rise.
    #[error("{what} must rise, but {after} follows {before}: check the numbers of angles before them")]
    Order {
        /// Which angles.
        what: &'static str,
        /// The angle before, degrees.
        before: f64,
        /// The angle that follows, degrees.
        after: f64,
    },
    /// Horizontal angles that no symmetry explains.
    #[error(
        "horizontal angles go from {first} to {last} degrees, but must be one alone, 0 to 90, 0 to 180, 90 to 270, or 0 to 360"
    )]
    HorizontalRange {
        /// The first, degrees.
        first: f64,
        /// The last, degrees.
        last: f64,
    },
    /// Photometry of vehicles or floodlights.
    #[error(
        "type {0} photometry, whose angles are measured about another axis: convert the file to type C with a photometric tool"
    )]
    PhotometricType(char),
}
