//! Values of `site.toml` that have a notation of their own: times of day, dates, offsets from UTC.
//!
//! Each is accepted as text; times and dates also in TOML's own notation (`date = 2006-05-03`, without quotes).

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;

/// A time of day in the site's own offset from UTC, written `HH:MM` or `HH:MM:SS`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TimeOfDay {
    seconds: u32,
}

impl TimeOfDay {
    /// Noon.
    pub const NOON: Self = Self { seconds: 12 * 3600 };

    /// The time that many seconds after midnight; `None` from 24:00 on.
    #[must_use]
    pub fn from_seconds(seconds: u32) -> Option<Self> {
        (seconds < 86_400).then_some(Self { seconds })
    }

    /// Seconds after midnight, below 86,400.
    #[must_use]
    pub fn seconds(self) -> u32 {
        self.seconds
    }
}

impl FromStr for TimeOfDay {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is no time of day: write HH:MM or HH:MM:SS, from 00:00 to 23:59:59");
        let parts = two_digit_numbers(text, ':').ok_or_else(wrong)?;
        match parts[..] {
            [h, m] if h < 24 && m < 60 => Ok(Self { seconds: h * 3600 + m * 60 }),
            [h, m, s] if h < 24 && m < 60 && s < 60 => Ok(Self { seconds: h * 3600 + m * 60 + s }),
            _ => Err(wrong()),
        }
    }
}

/// `12:34:56` as [12, 34, 56]: numbers of exactly two digits.
fn two_digit_numbers(text: &str, separator: char) -> Option<Vec<u32>> {
    text.split(separator)
        .map(|part| if part.len() == 2 && part.bytes().all(|b| b.is_ascii_digit()) { part.parse().ok() } else { None })
        .collect()
}

impl fmt::Display for TimeOfDay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (h, m, s) = (self.seconds / 3600, self.seconds / 60 % 60, self.seconds % 60);
        if s == 0 { write!(f, "{h:02}:{m:02}") } else { write!(f, "{h:02}:{m:02}:{s:02}") }
    }
}

/// A day of the proleptic Gregorian calendar, ISO 8601 with astronomical years: `2006-05-03`, `-0437-08-01` (438 BCE).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Date {
    /// Astronomical year: 0 is 1 BCE. From -2000 to 6000.
    pub year: i32,
    /// 1 to 12.
    pub month: u32,
    /// 1 to the length of the month.
    pub day: u32,
}

/// Years for which the sun's position is known well enough.
const YEARS: std::ops::RangeInclusive<i32> = -2000..=6000;

impl FromStr for Date {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = |why: &str| format!("`{text}` is no date: {why}");
        let form = "write YYYY-MM-DD, years before 1 CE with a minus sign, as in -0437-08-01";
        let (sign, digits) = match text.strip_prefix('-') {
            Some(rest) => (-1, rest),
            None => (1, text.strip_prefix('+').unwrap_or(text)),
        };
        let (year, rest) = digits.split_once('-').ok_or_else(|| wrong(form))?;
        if year.len() != 4 || !year.bytes().all(|b| b.is_ascii_digit()) {
            return Err(wrong(form));
        }
        let year = sign * year.parse::<i32>().map_err(|_| wrong(form))?;
        let [month, day] = two_digit_numbers(rest, '-').ok_or_else(|| wrong(form))?[..] else { return Err(wrong(form)) };
        if !YEARS.contains(&year) {
            return Err(wrong("the year must be from -2000 to 6000"));
        }
        if !(1..=12).contains(&month) {
            return Err(wrong("the month must be from 01 to 12"));
        }
        let last = days_in_month(year, month);
        if !(1..=last).contains(&day) {
            return Err(wrong(&format!("that month has {last} days")));
        }
        Ok(Self { year, month, day })
    }
}

fn days_in_month(year: i32, month: u32) -> u32 {
    let leap = year.rem_euclid(4) == 0 && (year.rem_euclid(100) != 0 || year.rem_euclid(400) == 0);
    match month {
        2 if leap => 29,
        2 => 28,
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    }
}

impl fmt::Display for Date {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.year < 0 { "-" } else { "" };
        write!(f, "{sign}{:04}-{:02}-{:02}", self.year.unsigned_abs(), self.month, self.day)
    }
}

/// An offset from UTC, written `"+02:00"`, `"-03:30"`, `"+01:34:52"` (a local mean solar time), `"Z"`, or as a number of hours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct UtcOffset {
    seconds: i32,
}

impl UtcOffset {
    /// The widest offset that is accepted: 18 hours either way, as in ISO 8601's users.
    const LIMIT_SECONDS: i32 = 18 * 3600;

    /// The offset of that many seconds east of UTC; `None` beyond 18 hours.
    #[must_use]
    pub fn from_seconds(seconds: i32) -> Option<Self> {
        (seconds.abs() <= Self::LIMIT_SECONDS).then_some(Self { seconds })
    }

    /// The offset of that many hours, rounded to a second; `None` beyond 18 hours or not finite.
    #[must_use]
    pub fn from_hours(hours: f64) -> Option<Self> {
        let seconds = libm::round(hours * 3600.0);
        if seconds.abs() <= f64::from(Self::LIMIT_SECONDS) { Self::from_seconds(seconds as i32) } else { None }
    }

    /// Seconds east of UTC.
    #[must_use]
    pub fn seconds(self) -> i32 {
        self.seconds
    }

    /// Hours east of UTC.
    #[must_use]
    pub fn hours(self) -> f64 {
        f64::from(self.seconds) / 3600.0
    }
}

impl FromStr for UtcOffset {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("`{text}` is no offset from UTC: write \"+02:00\", \"-03:30\" or hours as a number, within 18 hours");
        if text == "Z" {
            return Ok(Self::default());
        }
        let (sign, digits) = match text.as_bytes().first() {
            Some(b'+') => (1, &text[1..]),
            Some(b'-') => (-1, &text[1..]),
            _ => return Err(wrong()),
        };
        let (h, m, s) = match two_digit_numbers(digits, ':').ok_or_else(wrong)?[..] {
            [h] => (h, 0, 0),
            [h, m] => (h, m, 0),
            [h, m, s] => (h, m, s),
            _ => return Err(wrong()),
        };
        if m >= 60 || s >= 60 {
            return Err(wrong());
        }
        Self::from_seconds(sign * (h * 3600 + m * 60 + s) as i32).ok_or_else(wrong)
    }
}

impl fmt::Display for UtcOffset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (sign, all) = (if self.seconds < 0 { '-' } else { '+' }, self.seconds.unsigned_abs());
        let (h, m, s) = (all / 3600, all / 60 % 60, all % 60);
        if s == 0 { write!(f, "{sign}{h:02}:{m:02}") } else { write!(f, "{sign}{h:02}:{m:02}:{s:02}") }
    }
}

/// Reads text, TOML's own dates and times, or a number, and parses it.
struct TextVisitor<T> {
    what: &'static str,
    number: Option<fn(f64) -> Option<T>>,
}

impl<'de, T: FromStr<Err = String>> de::Visitor<'de> for TextVisitor<T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.what)
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<T, E> {
        text.parse().map_err(E::custom)
    }

    fn visit_map<A: de::MapAccess<'de>>(self, map: A) -> Result<T, A::Error> {
        let datetime = toml::value::Datetime::deserialize(de::value::MapAccessDeserializer::new(map))?;
        datetime.to_string().parse().map_err(de::Error::custom)
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<T, E> {
        let Some(from_number) = self.number else { return Err(E::invalid_type(de::Unexpected::Float(value), &self)) };
        from_number(value).ok_or_else(|| E::invalid_value(de::Unexpected::Float(value), &self))
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<T, E> {
        let Some(from_number) = self.number else { return Err(E::invalid_type(de::Unexpected::Signed(value), &self)) };
        from_number(value as f64).ok_or_else(|| E::invalid_value(de::Unexpected::Signed(value), &self))
    }

    fn visit_u64<E: de::Error>(self, value: u64) -> Result<T, E> {
        let Some(from_number) = self.number else { return Err(E::invalid_type(de::Unexpected::Unsigned(value), &self)) };
        from_number(value as f64).ok_or_else(|| E::invalid_value(de::Unexpected::Unsigned(value), &self))
    }
}

/// When the probes of a series were taken: `"names"`, or a list of times of day.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum ProbeTimes {
    /// The time stands in each file's name, as in `sky_0657.hdr` or `06-57-30.exr`.
    #[default]
    InNames,
    /// One time for each probe, in the order of the sorted file names.
    List(Vec<TimeOfDay>),
}

impl ProbeTimes {
    /// Whether the times stand in the files' names.
    #[must_use]
    pub fn are_in_names(&self) -> bool {
        *self == Self::InNames
    }
}

impl Serialize for ProbeTimes {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::InNames => serializer.serialize_str("names"),
            Self::List(times) => times.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for ProbeTimes {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct TimesVisitor;
        impl<'de> de::Visitor<'de> for TimesVisitor {
            type Value = ProbeTimes;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"names\" or a list of times of day such as [\"06:57\", \"07:04\"]")
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<ProbeTimes, E> {
                if text == "names" { Ok(ProbeTimes::InNames) } else { Err(E::invalid_value(de::Unexpected::Str(text), &self)) }
            }

            fn visit_seq<A: de::SeqAccess<'de>>(self, mut list: A) -> Result<ProbeTimes, A::Error> {
                let mut times = Vec::new();
                while let Some(time) = list.next_element()? {
                    times.push(time);
                }
                Ok(ProbeTimes::List(times))
            }
        }
        deserializer.deserialize_any(TimesVisitor)
    }
}

impl JsonSchema for ProbeTimes {
    fn schema_name() -> Cow<'static, str> {
        "ProbeTimes".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let time = TimeOfDay::json_schema(generator);
        json_schema!({ "anyOf": [{ "const": "names" }, { "type": "array", "items": time }] })
    }
}

macro_rules! text_value {
    ($type:ident, $what:literal, $number:expr, $schema:expr) => {
        impl<'de> Deserialize<'de> for $type {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                deserializer.deserialize_any(TextVisitor { what: $what, number: $number })
            }
        }

        impl Serialize for $type {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_str(self)
            }
        }

        impl JsonSchema for $type {
            fn schema_name() -> Cow<'static, str> {
                stringify!($type).into()
            }

            fn inline_schema() -> bool {
                true
            }

            fn json_schema(_: &mut SchemaGenerator) -> Schema {
                $schema
            }
        }
    };
}

text_value!(
    TimeOfDay,
    "a time of day such as \"06:57\"",
    None,
    json_schema!({
        "type": "string", "pattern": "^([01][0-9]|2[0-3]):[0-5][0-9](:[0-5][0-9])?$"
    })
);
text_value!(
    Date,
    "a date such as \"2006-05-03\"",
    None,
    json_schema!({
        "type": "string", "pattern": "^[+-]?[0-9]{4}-[0-9]{2}-[0-9]{2}$"
    })
);
text_value!(
    UtcOffset,
    "an offset from UTC such as \"+02:00\" or a number of hours within 18",
    Some(UtcOffset::from_hours),
    json_schema!({
        "anyOf": [
            { "type": "string", "pattern": "^(Z|[+-][0-9]{2}(:[0-5][0-9]){0,2})$" },
            { "type": "number", "minimum": -18, "maximum": 18 }
        ]
    })
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_day_are_read_and_written() {
        for (text, seconds) in [("00:00", 0), ("06:57", 25_020), ("23:59:59", 86_399)] {
            let time: TimeOfDay = text.parse().unwrap();
            assert_eq!(time.seconds(), seconds);
            assert_eq!(time.to_string(), text);
        }
        for text in ["", "7:00", "24:00", "12:60", "12:00:60", "12:00:00:00", "noon", "+1:00", "12:00 "] {
            assert!(text.parse::<TimeOfDay>().is_err(), "{text}");
        }
    }

    #[test]
    fn dates_before_our_era_are_read_and_written() {
        let date: Date = "-0437-08-01".parse().unwrap();
        assert_eq!(date, Date { year: -437, month: 8, day: 1 });
        assert_eq!(date.to_string(), "-0437-08-01");
        assert!("-0004-02-29".parse::<Date>().is_ok(), "the year -4 is a leap year");
        for text in ["437-08-01", "2006-13-01", "2006-02-29", "1900-02-29", "2006-00-01", "-2001-01-01", "2006-5-3", "2006"] {
            assert!(text.parse::<Date>().is_err(), "{text}");
        }
    }

    #[test]
    fn offsets_from_utc_are_read_and_written() {
        for (text, seconds) in [("+02:00", 7200), ("-03:30", -12_600), ("+01:34:52", 5692)] {
            let offset: UtcOffset = text.parse().unwrap();
            assert_eq!(offset.seconds(), seconds);
            assert_eq!(offset.to_string(), text);
        }
        assert_eq!("Z".parse::<UtcOffset>().unwrap().seconds(), 0);
        assert_eq!(UtcOffset::from_hours(-3.5).unwrap().to_string(), "-03:30");
        assert!(UtcOffset::from_hours(f64::NAN).is_none() && UtcOffset::from_hours(18.1).is_none());
        for text in ["2", "02:00", "+2:00", "+19:00", "+01:60", "+"] {
            assert!(text.parse::<UtcOffset>().is_err(), "{text}");
        }
    }
}
