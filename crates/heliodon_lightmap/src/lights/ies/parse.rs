//! From the text of an IES file to its photometry.

use super::error::{IesError, IesProblem};
use super::numbers::{Lines, Numbers};
use super::profile::{IesProfile, IesStandard, Symmetry, Table, Tilt};

/// The largest file that is read, bytes; the largest that manufacturers publish have about one megabyte.
pub const MAX_BYTES: usize = 8 << 20;

/// The most angles of either kind, and of tilts.
pub const MAX_ANGLES: usize = 10_000;

/// The most candelas; each has at least two bytes of the file.
const MAX_CANDELAS: usize = MAX_BYTES / 2;

const METRES_PER_FOOT: f64 = 0.3048;

/// What one candela value may be, so that sums and squares stay finite.
const HIGHEST_CD: f64 = 1e15;

impl IesProfile {
    /// Reads an IES LM-63 file. Numbers may be parted by spaces, commas and any line ends, wherever the file breaks its lines; what follows
    /// the last candela is not looked at. Memory stays in proportion to the text, whatever counts it states.
    ///
    /// # Errors
    /// The first thing that is wrong, with its line and what to do.
    pub fn parse(text: &str) -> Result<Self, IesError> {
        if text.len() > MAX_BYTES {
            return Err(IesError { line: 1, problem: IesProblem::TooLong { bytes: text.len(), limit: MAX_BYTES } });
        }
        let mut lines = Lines::new(text.strip_prefix('\u{feff}').unwrap_or(text));
        let mut standard = None;
        let tilt = loop {
            let Some(line) = lines.next() else {
                return Err(IesError { line: lines.line, problem: IesProblem::NoTilt });
            };
            let line = line.trim();
            if standard.is_none() && !line.is_empty() {
                standard = Some(standard_of(line));
            }
            if let Some(tilt) = tilt_of(line) {
                break tilt;
            }
        };
        let tilt_line = lines.line;
        let mut numbers = Numbers::new(lines);
        let tilt = match tilt.to_ascii_uppercase().as_str() {
            "NONE" => None,
            "INCLUDE" => Some(read_tilt(&mut numbers)?),
            _ => {
                let name = tilt.chars().take(80).collect();
                return Err(IesError { line: tilt_line, problem: IesProblem::TiltFile(name) });
            }
        };
        read_photometry(&mut numbers, standard.unwrap_or(IesStandard::Lm63_1986), tilt)
    }

    /// The same for the bytes of a file, which need not be UTF-8: what is not counts as some letter of a label.
    ///
    /// # Errors
    /// As [`IesProfile::parse`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, IesError> {
        if bytes.len() > MAX_BYTES {
            return Err(IesError { line: 1, problem: IesProblem::TooLong { bytes: bytes.len(), limit: MAX_BYTES } });
        }
        Self::parse(&String::from_utf8_lossy(bytes))
    }
}

/// By the first line; files of 1986 begin with their labels.
fn standard_of(first_line: &str) -> IesStandard {
    let line = first_line.to_ascii_uppercase();
    if line.starts_with("IESNA91") {
        IesStandard::Lm63_1991
    } else if line.starts_with("IESNA:LM-63-1995") {
        IesStandard::Lm63_1995
    } else if line.starts_with("IESNA:LM-63-2002") {
        IesStandard::Lm63_2002
    } else if line.starts_with("IES:LM-63") || line.starts_with("IESNA:LM-63") {
        IesStandard::Later
    } else {
        IesStandard::Lm63_1986
    }
}

/// What follows `TILT=`, if the line begins so.
fn tilt_of(line: &str) -> Option<&str> {
    let (word, rest) = line.split_at_checked(4)?;
    let value = rest.trim_start().strip_prefix('=')?;
    word.eq_ignore_ascii_case("TILT").then_some(value.trim())
}

fn read_tilt(numbers: &mut Numbers) -> Result<Tilt, IesError> {
    numbers.count("the lamp's place in the luminaire", "1, 2 or 3", 1, 3)?;
    let count = numbers.count("the number of tilt angles", "a whole number from 1 to 10000", 1, MAX_ANGLES)?;
    let angles_deg = numbers.angles(count, "tilt angles", 180.0)?;
    let mut factors = Vec::new();
    for _ in 0..count {
        factors.push(numbers.next_where("a tilt factor", "from 0 to 100", |x| (0.0..=100.0).contains(&x))?);
    }
    Ok(Tilt { angles_deg, factors })
}

fn read_photometry(numbers: &mut Numbers, standard: IesStandard, tilt: Option<Tilt>) -> Result<IesProfile, IesError> {
    const POSITIVE: &str = "above 0 and at most 1e9";
    let positive = |x: f64| x > 0.0 && x <= 1e9;
    numbers.next("the number of lamps")?;
    let lumens_per_lamp = numbers.next("the lumens of a lamp")?;
    let multiplier = numbers.next_where("the candela multiplier", POSITIVE, positive)?;
    let vertical = numbers.count("the number of vertical angles", "a whole number from 2 to 10000", 2, MAX_ANGLES)?;
    let horizontal = numbers.count("the number of horizontal angles", "a whole number from 1 to 10000", 1, MAX_ANGLES)?;
    if vertical * horizontal > MAX_CANDELAS {
        return Err(numbers.error(IesProblem::TooMany { vertical, horizontal, limit: MAX_CANDELAS }));
    }
    match numbers.count("the photometric type", "1 (type C), 2 (type B) or 3 (type A)", 1, 3)? {
        2 => return Err(numbers.error(IesProblem::PhotometricType('B'))),
        3 => return Err(numbers.error(IesProblem::PhotometricType('A'))),
        _ => {}
    }
    let in_feet = numbers.count("the unit of the dimensions", "1 (feet) or 2 (metres)", 1, 2)? == 1;
    let unit_m = if in_feet { METRES_PER_FOOT } else { 1.0 };
    let mut size_m = [0.0; 3];
    for (size, what) in size_m.iter_mut().zip(["the luminaire's width", "the luminaire's length", "the luminaire's height"]) {
        *size = numbers.next(what)? * unit_m;
    }
    let ballast = numbers.next_where("the ballast factor", POSITIVE, positive)?;
    // since 1995 for future use, and since 2019 the way the file was made: a factor of the light only before
    let ballast_lamp = match standard {
        IesStandard::Lm63_1986 | IesStandard::Lm63_1991 => {
            numbers.next_where("the ballast-lamp photometric factor", POSITIVE, positive)?
        }
        _ => {
            numbers.next("the number for future use after the ballast factor")?;
            1.0
        }
    };
    let input_watts = numbers.next("the input watts")?;
    let vertical_deg = numbers.angles(vertical, "vertical angles", 180.0)?;
    let mut horizontal_deg = numbers.angles(horizontal, "horizontal angles", 360.0)?;
    let symmetry = symmetry_of(&horizontal_deg).map_err(|problem| numbers.error(problem))?;
    let factor = multiplier * ballast * ballast_lamp;
    let mut candelas = Vec::new();
    for _ in 0..vertical * horizontal {
        let in_range = |x: f64| x >= 0.0 && x * factor <= HIGHEST_CD;
        candelas
            .push(factor * numbers.next_where("a candela value", "0 or more, and at most 1e15 with its factors", in_range)?);
    }
    // around the circle: the first plane closes it where the file leaves 360 degrees out
    if symmetry == Symmetry::None && horizontal_deg.last().is_some_and(|&last| last < 360.0) {
        horizontal_deg.push(360.0);
        candelas.extend_from_within(..vertical);
    }
    let table = Table { vertical_deg, horizontal_deg, candelas, symmetry };
    Ok(IesProfile::new(table, standard, tilt, lumens_per_lamp, size_m, input_watts))
}

/// The symmetry that a range of horizontal angles stands for. Files whose full circle ends before 360 are closed where the gap is no wider
/// than the widest step.
fn symmetry_of(angles: &[f64]) -> Result<Symmetry, IesProblem> {
    let (Some(&first), Some(&last)) = (angles.first(), angles.last()) else {
        return Err(IesProblem::Ends { what: "horizontal angles" });
    };
    let is = |angle: f64, nominal: f64| (angle - nominal).abs() < 1e-6;
    let widest = angles.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    if angles.len() == 1 {
        Ok(Symmetry::Axial)
    } else if is(first, 90.0) && is(last, 270.0) {
        Ok(Symmetry::AcrossSides)
    } else if !is(first, 0.0) {
        Err(IesProblem::HorizontalRange { first, last })
    } else if is(last, 90.0) {
        Ok(Symmetry::Quadrant)
    } else if is(last, 180.0) {
        Ok(Symmetry::Halves)
    } else if is(last, 360.0) || (last > 180.0 && angles.len() > 2 && 360.0 - last <= widest + 1e-6) {
        Ok(Symmetry::None)
    } else {
        Err(IesProblem::HorizontalRange { first, last })
    }
}
