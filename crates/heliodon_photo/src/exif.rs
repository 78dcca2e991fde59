//! What a photograph's file says of its lens: size, and focal length from EXIF.

use exif::{Exif, In, Reader, Tag, Value};
use std::io::BufReader;
use std::path::Path;

/// The width of 35 mm film, whose diagonal EXIF's equivalents are by.
const FILM_MM: [f64; 2] = [36.0, 24.0];

/// What is known of a photograph from its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PhotoFacts {
    /// Width and height as the file stores them.
    pub size_px: Option<[u32; 2]>,
    /// Who made the camera, and which it is.
    pub camera: Option<String>,
    /// The focal length.
    pub focal_mm: Option<f64>,
    /// What it would be on 35 mm film.
    pub focal_35_mm: Option<f64>,
    /// Pixels per millimetre on the sensor, of a photograph as large as `exif_size_px`.
    pub sensor_px_per_mm: Option<f64>,
    /// The size that EXIF tells, which may be larger than a copy's.
    pub exif_size_px: Option<[u32; 2]>,
    /// When it was taken by the camera's clock, as EXIF writes it.
    pub taken: Option<String>,
    /// By how much that clock is ahead of universal time, as EXIF writes it.
    pub utc_offset: Option<String>,
    /// Degrees north and east of where it was taken.
    pub place_deg: Option<[f64; 2]>,
    /// What is missing or odd, in words.
    pub notes: Vec<String>,
}

impl PhotoFacts {
    /// The focal length in pixels of a photograph of a size; `None` where the file does not tell it.
    #[must_use]
    pub fn focal_px(&self, size_px: [u32; 2]) -> Option<f64> {
        let diagonal = |s: [f64; 2]| (s[0] * s[0] + s[1] * s[1]).sqrt();
        let long = f64::from(size_px[0].max(size_px[1]));
        if let Some(mm) = self.focal_35_mm {
            return Some(mm * diagonal(size_px.map(f64::from)) / diagonal(FILM_MM));
        }
        let (mm, density) = (self.focal_mm?, self.sensor_px_per_mm?);
        let told = self.exif_size_px.map_or(long, |s| f64::from(s[0].max(s[1])));
        Some(mm * density * long / told)
    }

    /// What photographs by the same lens at the same setting share; `None` without a focal length.
    #[must_use]
    pub fn lens_key(&self) -> Option<String> {
        let focal = self.focal_mm.or(self.focal_35_mm)?;
        Some(format!("{} at {focal} mm", self.camera.as_deref().unwrap_or("a camera")))
    }

    /// Reads what a file says. Never fails: what cannot be read is noted, and the focal length stays free.
    #[must_use]
    pub fn read(path: &Path) -> Self {
        let mut facts = Self::default();
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        match image::image_dimensions(path) {
            Ok((width, height)) => facts.size_px = Some([width, height]),
            Err(error) => facts.notes.push(format!("{name}: {error}")),
        }
        match std::fs::File::open(path).map(BufReader::new) {
            Err(_) => return facts,
            Ok(mut file) => match Reader::new().read_from_container(&mut file) {
                Ok(exif) => facts.take(&exif),
                Err(_) => facts.notes.push(format!("{name} has no EXIF: its focal length stays free")),
            },
        }
        if facts.notes.is_empty() && facts.size_px.and_then(|s| facts.focal_px(s)).is_none() {
            facts.notes.push(format!("{name}: EXIF does not tell the focal length in pixels, it stays free"));
        }
        facts
    }

    fn take(&mut self, exif: &Exif) {
        let number = |tag: Tag| exif.get_field(tag, In::PRIMARY).and_then(|f| positive(&f.value));
        let whole = |tag: Tag| exif.get_field(tag, In::PRIMARY).and_then(|f| f.value.get_uint(0)).filter(|n| *n > 0);
        let words = |tag: Tag| {
            exif.get_field(tag, In::PRIMARY).and_then(|f| match &f.value {
                Value::Ascii(lines) => lines.first().map(|l| String::from_utf8_lossy(l).trim().to_owned()),
                _ => None,
            })
        };
        self.camera = match (words(Tag::Make), words(Tag::Model)) {
            (Some(make), Some(model)) if model.starts_with(&make) => Some(model),
            (Some(make), Some(model)) => Some(format!("{make} {model}")),
            (make, model) => model.or(make),
        };
        self.taken = words(Tag::DateTimeOriginal).filter(|words| !words.is_empty());
        self.utc_offset = words(Tag::OffsetTimeOriginal).or_else(|| words(Tag::OffsetTime)).filter(|words| !words.is_empty());
        let degrees = |tag: Tag, side: Tag, negative: &str| {
            let parts = exif.get_field(tag, In::PRIMARY).and_then(|f| match &f.value {
                Value::Rational(parts) if parts.len() == 3 => Some([0, 1, 2].map(|i| parts[i].to_f64())),
                _ => None,
            })?;
            let size = parts[0] + parts[1] / 60.0 + parts[2] / 3600.0;
            size.is_finite().then_some(if words(side).as_deref() == Some(negative) { -size } else { size })
        };
        self.place_deg = degrees(Tag::GPSLatitude, Tag::GPSLatitudeRef, "S")
            .zip(degrees(Tag::GPSLongitude, Tag::GPSLongitudeRef, "W"))
            .map(|(north, east)| [north, east]);
        self.focal_mm = number(Tag::FocalLength);
        self.focal_35_mm = number(Tag::FocalLengthIn35mmFilm);
        // 2 is inch, 3 is centimetre; 4 and 5, millimetre and micrometre, some makers write
        let unit_mm = match whole(Tag::FocalPlaneResolutionUnit) {
            Some(3) => 10.0,
            Some(4) => 1.0,
            Some(5) => 1e-3,
            _ => 25.4,
        };
        self.sensor_px_per_mm = number(Tag::FocalPlaneXResolution).map(|r| r / unit_mm);
        let told = |w: Tag, h: Tag| Some([whole(w)?, whole(h)?]);
        self.exif_size_px = told(Tag::PixelXDimension, Tag::PixelYDimension);
        if self.size_px.is_none() {
            self.size_px = told(Tag::ImageWidth, Tag::ImageLength).or(self.exif_size_px);
            if self.size_px.is_some() {
                self.notes.clear();
            }
        }
    }
}

fn positive(value: &Value) -> Option<f64> {
    let number = match value {
        Value::Rational(all) => all.first().map(|r| r.to_f64())?,
        Value::Double(all) => *all.first()?,
        Value::Float(all) => f64::from(*all.first()?),
        other => f64::from(other.get_uint(0)?),
    };
    (number > 0.0 && number.is_finite()).then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn focal_lengths_become_pixels() {
        let film = PhotoFacts { focal_35_mm: Some(36.0), ..PhotoFacts::default() };
        // A 3:2 picture is the film's shape, so 36 mm is its width.
        assert!((film.focal_px([3000, 2000]).unwrap() - 3000.0).abs() < 1e-9);
        let sensor = PhotoFacts {
            focal_mm: Some(5.8),
            sensor_px_per_mm: Some(2048.0 / 5.744),
            exif_size_px: Some([2048, 1536]),
            ..PhotoFacts::default()
        };
        // A copy at half the size has half the focal length in pixels.
        let (whole, half) = (sensor.focal_px([2048, 1536]).unwrap(), sensor.focal_px([1024, 768]).unwrap());
        assert!((whole - 5.8 * 2048.0 / 5.744).abs() < 1e-9 && (half - whole / 2.0).abs() < 1e-9);
        assert_eq!(PhotoFacts::default().focal_px([100, 100]), None);
    }

    #[test]
    fn a_file_without_exif_says_so() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plain.png");
        image::RgbImage::new(7, 5).save(&path).unwrap();
        let facts = PhotoFacts::read(&path);
        assert_eq!(facts.size_px, Some([7, 5]));
        assert!(facts.notes[0].contains("stays free"), "{facts:?}");
        let missing = PhotoFacts::read(&folder.path().join("none.jpg"));
        assert!(missing.size_px.is_none() && !missing.notes.is_empty());
    }
}
