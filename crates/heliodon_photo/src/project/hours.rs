//! When photographs were taken, and what is known of the light: what `[sky]`, `time`, `probe` and `[[grey]]` say.

use super::source::Source;
use super::{Project, ProjectError, ProjectFile};
use crate::exif::PhotoFacts;
use heliodon_sky::civil::{Date, TimeOfDay};

/// When a photograph was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Taken {
    /// The day.
    pub date: Date,
    /// The time of day.
    pub time: TimeOfDay,
    /// Hours by which its clock was ahead of universal time, where the photograph says it.
    pub utc_offset_hours: Option<f64>,
}

impl Taken {
    /// Reads `YYYY-MM-DD HH:MM[:SS]`; a T may stand between, and EXIF writes colons into the date.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is no time of a photograph; write YYYY-MM-DD HH:MM or YYYY-MM-DD HH:MM:SS");
        let (date, time) = text.trim().split_once([' ', 'T']).ok_or_else(wrong)?;
        let date = date.replace(':', "-").parse::<Date>().map_err(|error| error.to_string())?;
        // cameras write fractions of seconds
        let time = time.split_once('.').map_or(time, |(whole, _)| whole);
        let time = time.parse::<TimeOfDay>().map_err(|error| error.to_string())?;
        Ok(Self { date, time, utc_offset_hours: None })
    }
}

/// Hours ahead of universal time: `+02:00`, `-3`, `5.5`, `Z`.
///
/// # Errors
/// What is wrong with it, in words.
pub fn utc_offset_hours(text: &str) -> Result<f64, String> {
    let wrong = || format!("`{text}` is no offset of a clock; write +HH:MM or -HH:MM");
    let text = text.trim();
    if text == "Z" {
        return Ok(0.0);
    }
    let (sign, rest) = match text.as_bytes().first() {
        Some(b'-') => (-1.0, &text[1..]),
        Some(b'+') => (1.0, &text[1..]),
        _ => (1.0, text),
    };
    let is_number = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    let number = |part: &str| if is_number(part) { part.parse::<f64>().map_err(|_| wrong()) } else { Err(wrong()) };
    let hours = match rest.split_once(':') {
        Some((hours, minutes)) if number(minutes)? < 60.0 => number(hours)? + number(minutes)? / 60.0,
        Some(_) => return Err(wrong()),
        None => number(rest)?,
    };
    if hours <= 24.0 { Ok(sign * hours) } else { Err(wrong()) }
}

impl Project {
    /// When a photograph of the project was taken: as the project says, or its file.
    #[must_use]
    pub fn taken(&self, photo: &str, facts: &PhotoFacts) -> Option<Taken> {
        let entry = self.file.photo.iter().find(|entry| entry.name() == photo)?;
        // what the project says was checked when it was read
        let written = entry.time.as_deref().and_then(|time| Taken::parse(time).ok());
        written.or_else(|| {
            let mut taken = Taken::parse(facts.taken.as_deref()?).ok()?;
            taken.utc_offset_hours = facts.utc_offset.as_deref().and_then(|offset| utc_offset_hours(offset).ok());
            Some(taken)
        })
    }
}

pub(super) fn check(file: &ProjectFile, source: &Source) -> Result<(), ProjectError> {
    for (i, photo) in file.photo.iter().enumerate() {
        if let Some(Err(message)) = photo.time.as_deref().map(Taken::parse) {
            return Err(source.error_at(&["photo", &i.to_string(), "time"], message));
        }
    }
    if let Some(sky) = &file.sky {
        let at = |key: &str, message: &str| Err(source.error_at(&["sky", key], message));
        let within = |value: Option<f64>, most: f64| value.is_none_or(|value| value.abs() <= most);
        if !within(sky.latitude_deg, 90.0) {
            return at("latitude_deg", "a latitude is -90 to 90");
        }
        if !within(sky.longitude_deg, 180.0) {
            return at("longitude_deg", "a longitude is -180 to 180");
        }
        if !within(sky.north_deg, 360.0) || !within(sky.turn_deg, 360.0) {
            return at(if within(sky.north_deg, 360.0) { "turn_deg" } else { "north_deg" }, "a bearing is -360 to 360");
        }
        if let Some(Err(message)) = sky.utc_offset.as_deref().map(utc_offset_hours) {
            return at("utc_offset", &message);
        }
        let parts = |of: Option<[f32; 3]>, most: f32| of.iter().flatten().all(|part| (0.0..=most).contains(part));
        if !parts(sky.ground_albedo, 1.0) {
            return at("ground_albedo", "an albedo is 0 to 1");
        }
        if !parts(sky.sun_irradiance, f32::MAX) {
            return at("sun_irradiance", "an irradiance is three numbers of 0 or more");
        }
    }
    for (i, grey) in file.grey.iter().enumerate() {
        let at = i.to_string();
        if file.photo.iter().all(|photo| photo.name() != grey.photo) {
            return Err(source.error_at(&["grey", &at, "photo"], format!("there is no [[photo]] called {}", grey.photo)));
        }
        if !grey.at.iter().all(|x| x.is_finite()) {
            return Err(source.error_at(&["grey", &at, "at"], "a pixel is two numbers"));
        }
        if !grey.radius_px.is_none_or(|radius| radius >= 0.0 && radius.is_finite()) {
            return Err(source.error_at(&["grey", &at, "radius_px"], "a radius is 0 or more"));
        }
        if !grey.albedo.rgb().iter().all(|part| *part > 0.0 && *part <= 1.0) {
            return Err(source.error_at(&["grey", &at, "albedo"], "an albedo is above 0 and at most 1"));
        }
    }
    for (i, around) in file.around.iter().enumerate() {
        if !around.albedo.iter().flatten().all(|part| (0.0..=1.0).contains(part)) {
            return Err(source.error_at(&["around", &i.to_string(), "albedo"], "an albedo is 0 to 1"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_people_and_cameras_are_read() {
        let taken = Taken::parse("2024-06-21 09:30").unwrap();
        assert_eq!((taken.date.to_string().as_str(), taken.time.seconds), ("2024-06-21", 34_200));
        assert_eq!(Taken::parse("2024:06:21 09:30:00").unwrap(), taken);
        assert_eq!(Taken::parse("2024-06-21T09:30:00.25").unwrap(), taken);
        for wrong in ["2024-06-21", "09:30", "2024-13-01 09:30", "2024-06-21 25:00", "0000:00:00 00:00:00"] {
            assert!(Taken::parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn offsets_of_clocks_are_read() {
        for (text, hours) in [("+02:00", 2.0), ("-03:30", -3.5), ("5.5", 5.5), ("Z", 0.0), ("+00:00", 0.0)] {
            assert_eq!(utc_offset_hours(text).unwrap(), hours, "{text}");
        }
        for wrong in ["", "two", "+2:75", "99", "+inf", "--2"] {
            assert!(utc_offset_hours(wrong).is_err(), "{wrong}");
        }
    }
}
