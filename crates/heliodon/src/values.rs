//! The notations of the command line's values.

use glam::Vec3;
use heliodon_bundle::site::TimeOfDay;

/// A size in pixels, `1024x768`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// The largest side of a picture that any GPU is sure to render to.
const LARGEST_SIDE: u32 = 16_384;

/// `1024x768`, each side from 1 to 16,384.
pub fn size(text: &str) -> Result<Size, String> {
    let (width, height) = pair(text)?;
    if width.max(height) > LARGEST_SIDE {
        return Err(format!("a side can have at most {LARGEST_SIDE} pixels"));
    }
    Ok(Size { width, height })
}

/// Samples of a pixel: 1, 2, 4 or 8.
pub fn samples(text: &str) -> Result<u32, String> {
    text.parse().ok().filter(|samples| matches!(samples, 1 | 2 | 4 | 8)).ok_or_else(|| "1, 2, 4 or 8 are possible".to_owned())
}

/// Columns and rows of a contact sheet, `4x3`.
pub fn sheet(text: &str) -> Result<(u32, u32), String> {
    let (columns, rows) = pair(text)?;
    if columns.saturating_mul(rows) > 1000 {
        return Err("a sheet can have at most 1,000 pictures".to_owned());
    }
    Ok((columns, rows))
}

fn pair(text: &str) -> Result<(u32, u32), String> {
    let form = || "write two numbers above 0 with an x between, as in 1024x768".to_owned();
    let (a, b) = text.split_once('x').ok_or_else(form)?;
    let number = |text: &str| text.parse().ok().filter(|&number: &u32| number > 0).ok_or_else(form);
    Ok((number(a)?, number(b)?))
}

/// A moment or a stretch of the day.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeSpan {
    /// When it begins.
    pub first: TimeOfDay,
    /// When it ends; `None` for a moment.
    pub last: Option<TimeOfDay>,
}

/// `10:00`, or `06:57..17:34`.
pub fn time_span(text: &str) -> Result<TimeSpan, String> {
    let Some((first, last)) = text.split_once("..") else { return Ok(TimeSpan { first: text.parse()?, last: None }) };
    let (first, last): (TimeOfDay, TimeOfDay) = (first.parse()?, last.parse()?);
    if last <= first {
        return Err(format!("the span must end after it begins, as in {last}..{first}"));
    }
    Ok(TimeSpan { first, last: Some(last) })
}

/// Three finite numbers in metres, `1.5,2,-3`.
pub fn point(text: &str) -> Result<Vec3, String> {
    let form = || "write three numbers with commas between, as in 1.5,2,-3".to_owned();
    let numbers: Vec<f32> = text
        .split(',')
        .map(|part| part.trim().parse().ok().filter(|x: &f32| x.is_finite()))
        .collect::<Option<_>>()
        .ok_or_else(form)?;
    let [x, y, z] = numbers[..] else { return Err(form()) };
    Ok(Vec3::new(x, y, z))
}

/// A finite number of pixels, 0 or more.
pub fn pixels(text: &str) -> Result<f32, String> {
    let pixels = text.parse().ok().filter(|x: &f32| x.is_finite() && *x >= 0.0);
    pixels.ok_or_else(|| "write a number of pixels, 0 or more, as in 1.5".to_owned())
}

/// How bright a picture is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// As the lapse has it for the hour.
    Auto,
    /// `2^stops`.
    Stops(f32),
}

/// `auto`, or stops from -40 to 40.
pub fn exposure(text: &str) -> Result<Exposure, String> {
    if text == "auto" {
        return Ok(Exposure::Auto);
    }
    let stops: Option<f32> = text.parse().ok().filter(|stops: &f32| stops.abs() <= 40.0);
    stops.map(Exposure::Stops).ok_or_else(|| "write auto, or a number of stops from -40 to 40".to_owned())
}

/// A number in a range, ends included.
pub fn within(text: &str, low: f64, high: f64) -> Result<f64, String> {
    text.parse().ok().filter(|x| (low..=high).contains(x)).ok_or_else(|| format!("write a number from {low} to {high}"))
}

/// A vertical opening angle in degrees.
pub fn fov_deg(text: &str) -> Result<f32, String> {
    within(text, 1.0, 170.0).map(|angle| angle as f32)
}

/// Frames a second.
pub fn fps(text: &str) -> Result<f64, String> {
    within(text, 1.0, 240.0)
}

/// The length of a film.
pub fn seconds(text: &str) -> Result<f64, String> {
    within(text, 0.05, 3600.0)
}

/// Seconds since something began.
pub fn elapsed(text: &str) -> Result<f64, String> {
    within(text, 0.0, 86_400.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_times_and_points_are_read() {
        assert_eq!(size("1024x768"), Ok(Size { width: 1024, height: 768 }));
        for wrong in ["", "x", "0x5", "5x0", "1024", "1024*768", "-1x5", "1x2x3", "99999x1"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
        let span = time_span("06:57..17:34").unwrap();
        assert_eq!((span.first.to_string(), span.last.unwrap().to_string()), ("06:57".into(), "17:34".into()));
        assert_eq!(time_span("12:00").unwrap().last, None);
        for wrong in ["17:34..06:57", "06:57..", "..", "25:00", "06:57..06:57"] {
            assert!(time_span(wrong).is_err(), "{wrong}");
        }
        assert_eq!(point("1.5, 2,-3"), Ok(Vec3::new(1.5, 2.0, -3.0)));
        for wrong in ["1,2", "1,2,3,4", "a,b,c", "1,2,nan", "inf,0,0"] {
            assert!(point(wrong).is_err(), "{wrong}");
        }
        assert_eq!(exposure("-3.5"), Ok(Exposure::Stops(-3.5)));
        assert!(exposure("nan").is_err() && exposure("1e9").is_err() && fov_deg("0").is_err() && fps("nan").is_err());
    }
}
