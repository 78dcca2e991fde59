//! Dates and times of day as sites write them.

use crate::error::SkyError;
use std::fmt;
use std::str::FromStr;

/// A day of the proleptic Gregorian calendar; year 0 is 1 BCE, -437 is 438 BCE.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Date {
    /// Astronomical year.
    pub year: i32,
    /// 1 to 12.
    pub month: u32,
    /// 1 to 31.
    pub day: u32,
}

impl Date {
    /// The Julian day number of the day's noon: Fliegel and Van Flandern, "A Machine Algorithm for Processing Calendar Dates", CACM 11(10),
    /// 1968, with floored divisions so that it holds before the year -4800, too.
    #[must_use]
    pub fn julian_day_number(self) -> i64 {
        let (year, month, day) = (i64::from(self.year), i64::from(self.month), i64::from(self.day));
        let a = (14 - month).div_euclid(12);
        let y = year + 4800 - a;
        let m = month + 12 * a - 3;
        day + (153 * m + 2).div_euclid(5) + 365 * y + y.div_euclid(4) - y.div_euclid(100) + y.div_euclid(400) - 32_045
    }

    fn days_in_month(self) -> u32 {
        let leap = self.year.rem_euclid(4) == 0 && (self.year.rem_euclid(100) != 0 || self.year.rem_euclid(400) == 0);
        match self.month {
            2 => 28 + u32::from(leap),
            4 | 6 | 9 | 11 => 30,
            _ => 31,
        }
    }
}

impl FromStr for Date {
    type Err = SkyError;

    /// `YYYY-MM-DD`, with a minus before years before 1 BCE: `-0437-08-01`.
    fn from_str(text: &str) -> Result<Self, SkyError> {
        let wrong =
            || SkyError::setting("date", format!("`{text}` is no date"), "write YYYY-MM-DD, or -YYYY-MM-DD before 1 BCE");
        let (sign, rest) = match text.trim().strip_prefix('-') {
            Some(rest) => (-1, rest),
            None => (1, text.trim()),
        };
        let mut parts = rest.split('-').map(|part| {
            let digits = part.len() <= 6 && !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
            digits.then(|| part.parse::<u32>().ok()).flatten()
        });
        let mut next = || parts.next().flatten();
        let (Some(year), Some(month), Some(day), None) = (next(), next(), next(), next()) else { return Err(wrong()) };
        let date = Self { year: sign * i32::try_from(year).map_err(|_| wrong())?, month, day };
        let real = (1..=12).contains(&month) && day >= 1 && day <= date.days_in_month();
        if real { Ok(date) } else { Err(wrong()) }
    }
}

impl fmt::Display for Date {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.year < 0 { "-" } else { "" };
        write!(f, "{sign}{:04}-{:02}-{:02}", self.year.unsigned_abs(), self.month, self.day)
    }
}

/// A time of day in whole seconds since midnight, up to 24:00.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TimeOfDay {
    /// Seconds since midnight, at most 86,400.
    pub seconds: u32,
}

impl TimeOfDay {
    /// Noon.
    pub const NOON: Self = Self { seconds: 43_200 };

    /// The nearest whole second of a number of seconds, within the day.
    #[must_use]
    pub fn from_seconds(seconds: f64) -> Self {
        Self { seconds: libm::round(seconds.clamp(0.0, 86_400.0)) as u32 }
    }

    fn checked(hours: u32, minutes: u32, seconds: u32) -> Option<Self> {
        let total = hours * 3600 + minutes * 60 + seconds;
        (hours <= 24 && minutes < 60 && seconds < 60 && total <= 86_400).then_some(Self { seconds: total })
    }

    /// The time in a file's name: the last group of digits that reads as one, as `0657`, `065730`, `06-57`, `06_57_00`, `6.57` or `06h57`, so
    /// `sky_0657.hdr` and `2004-04-12_06-57.hdr` both are 06:57.
    #[must_use]
    pub fn from_file_name(name: &str) -> Option<Self> {
        groups_of_digits(name)?.iter().rev().find_map(|group| Self::from_group(group))
    }

    /// As [`TimeOfDay::from_file_name`], but without four digits on their own, which may be a size or a number as well: `venice_2048.hdr`.
    #[must_use]
    pub fn written_in_file_name(name: &str) -> Option<Self> {
        let bare = |group: &[&str]| matches!(group, [one] if one.len() == 4);
        groups_of_digits(name)?.iter().rev().filter(|group| !bare(group)).find_map(|group| Self::from_group(group))
    }

    fn from_group(group: &[&str]) -> Option<Self> {
        let number = |text: &str| (text.len() <= 2).then(|| text.parse::<u32>().ok()).flatten();
        let compact = |text: &str| match text.len() {
            4 | 6 => {
                let part = |i: usize| text.get(i..i + 2).and_then(|t| t.parse::<u32>().ok());
                Self::checked(part(0)?, part(2)?, if text.len() == 6 { part(4)? } else { 0 })
            }
            _ => None,
        };
        match group {
            // a date and a time behind it
            [_, _, _, rest @ ..] if group[0].len() == 4 && !rest.is_empty() => Self::from_group(rest),
            [.., one] if compact(one).is_some() && group.len() != 3 => compact(one),
            [h, m, s] => Self::checked(number(h)?, number(m)?, number(s)?),
            // a single digit behind a number is no minute: `quarry_01_1k`
            [h, m] if m.len() == 2 => Self::checked(number(h)?, number(m)?, 0),
            _ => None,
        }
    }
}

/// The runs of digits in a file's name, those joined by single separators as one group; `None` for no name.
fn groups_of_digits(name: &str) -> Option<Vec<Vec<&str>>> {
    let stem = name.rsplit(['/', '\\']).next()?;
    let stem = stem.rsplit_once('.').map_or(stem, |(stem, _)| stem);
    // runs of digits joined by single separators
    let mut groups: Vec<Vec<&str>> = Vec::new();
    let mut at = 0;
    let bytes = stem.as_bytes();
    let mut joined = false;
    while at < bytes.len() {
        if !bytes[at].is_ascii_digit() {
            joined = joined && at + 1 < bytes.len() && bytes[at + 1].is_ascii_digit() && b"-_:.h".contains(&bytes[at]);
            at += 1;
            continue;
        }
        let end = bytes[at..].iter().position(|b| !b.is_ascii_digit()).map_or(bytes.len(), |n| at + n);
        match groups.last_mut() {
            Some(group) if joined => group.push(&stem[at..end]),
            _ => groups.push(vec![&stem[at..end]]),
        }
        at = end;
        joined = true;
    }
    Some(groups)
}

impl FromStr for TimeOfDay {
    type Err = SkyError;

    /// `HH:MM` or `HH:MM:SS`.
    fn from_str(text: &str) -> Result<Self, SkyError> {
        let wrong =
            || SkyError::setting("time", format!("`{text}` is no time of day"), "write HH:MM or HH:MM:SS, from 00:00 to 24:00");
        let parts: Option<Vec<u32>> = text
            .trim()
            .split(':')
            .map(|p| (!p.is_empty() && p.len() <= 2 && p.bytes().all(|b| b.is_ascii_digit())).then(|| p.parse().ok()).flatten())
            .collect();
        match parts.as_deref() {
            Some([h, m]) => Self::checked(*h, *m, 0),
            Some([h, m, s]) => Self::checked(*h, *m, *s),
            _ => None,
        }
        .ok_or_else(wrong)
    }
}

impl fmt::Display for TimeOfDay {
    /// `HH:MM`, or `HH:MM:SS` where the seconds are not zero.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (h, m, s) = (self.seconds / 3600, self.seconds / 60 % 60, self.seconds % 60);
        if s == 0 { write!(f, "{h:02}:{m:02}") } else { write!(f, "{h:02}:{m:02}:{s:02}") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn julian_days_are_the_published_ones() {
        // Meeus, Astronomical Algorithms, chapter 7, and the proleptic calendar's own origin
        for (date, number) in
            [("2000-01-01", 2_451_545), ("1987-06-19", 2_446_966), ("1600-12-31", 2_305_813), ("0000-01-01", 1_721_060)]
        {
            assert_eq!(date.parse::<Date>().unwrap().julian_day_number(), number, "{date}");
        }
        assert_eq!("-4713-11-24".parse::<Date>().unwrap().julian_day_number(), 0);
    }

    #[test]
    fn dates_are_read_and_written() {
        for text in ["-0437-08-01", "2004-02-29", "0000-12-31"] {
            assert_eq!(text.parse::<Date>().unwrap().to_string(), text);
        }
        for text in
            ["2003-02-29", "2003-13-01", "2003-00-01", "2003-1-", "x", "", "--1-01-01", "2003-01-01-01", "99999999999-01-01"]
        {
            assert!(text.parse::<Date>().is_err(), "{text}");
        }
    }

    #[test]
    fn times_are_read_from_names() {
        let time = |text: &str| TimeOfDay::from_file_name(text).map(|t| t.to_string());
        for (name, expected) in [
            ("0657.hdr", "06:57"),
            ("06-57.hdr", "06:57"),
            ("sky/06_57_00.hdr", "06:57"),
            ("sky_0657.hdr", "06:57"),
            ("sky06h57.exr", "06:57"),
            ("2004-04-12_06-57-30.hdr", "06:57:30"),
            ("2004-04-12 1801.hdr", "18:01"),
            ("probe_235959.hdr", "23:59:59"),
        ] {
            assert_eq!(time(name).as_deref(), Some(expected), "{name}");
        }
        for name in ["sky.hdr", "noon_1k.hdr", "quarry_01_1k.hdr", "9999.hdr", "sky_12345.hdr", ""] {
            assert_eq!(time(name), None, "{name}");
        }
        let written = |text: &str| TimeOfDay::written_in_file_name(text).map(|t| t.to_string());
        assert_eq!((written("venice_2048.hdr"), written("0657.hdr"), written("DSC_0001.hdr")), (None, None, None));
        assert_eq!(written("06-57_venice_2048.hdr").as_deref(), Some("06:57"));
        assert_eq!(written("sky_065700.hdr").as_deref(), Some("06:57"));
        assert_eq!(written("2004-04-12_1801.hdr").as_deref(), Some("18:01"));
        assert_eq!("6:05".parse::<TimeOfDay>().unwrap().to_string(), "06:05");
        assert!(["6", "25:00", "12:60", "12:00:00:00", "-1:00", "aa:bb"].iter().all(|t| t.parse::<TimeOfDay>().is_err()));
    }
}
