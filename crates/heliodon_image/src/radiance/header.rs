//! The text at the head of a Radiance picture.

use crate::error::{COPY_AGAIN, ImageError};
use crate::primaries;
use glam::{Mat3, Vec3};

/// One axis of the resolution line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Axis {
    pub is_x: bool,
    pub increasing: bool,
    pub count: u32,
}

/// What the head of a picture says.
#[derive(Clone, Copy, Debug)]
pub(super) struct Header {
    /// The axis along which scanlines follow one another.
    pub slow: Axis,
    /// The axis along a scanline.
    pub fast: Axis,
    /// To multiply pixels by.
    pub scale: Vec3,
    /// To linear Rec. 709.
    pub rec709_from_file: Mat3,
    /// Where the pixels begin.
    pub pixels_at: usize,
}

/// A header line is not longer than this in any file that is meant well.
const MAX_LINE: usize = 65_536;

impl Header {
    pub(super) fn parse(bytes: &[u8], name: &str) -> Result<Self, ImageError> {
        let bad =
            |line: usize, problem: String| ImageError::malformed(name, format!("header line {line}"), problem, COPY_AGAIN);
        let mut lines = Lines { bytes, at: 0, number: 0 };
        let mut scale = Vec3::ONE;
        let mut is_xyz = false;
        loop {
            let line = lines.next_line(name)?;
            let text = String::from_utf8_lossy(line);
            let text = text.trim();
            if text.is_empty() {
                break;
            }
            let Some((key, value)) = text.split_once('=') else { continue };
            let number = lines.number;
            match key.trim() {
                "FORMAT" => match value.trim() {
                    "32-bit_rle_rgbe" => is_xyz = false,
                    "32-bit_rle_xyze" => is_xyz = true,
                    other => return Err(bad(number, format!("pixels of the unknown format `{}`", shorten(other)))),
                },
                "EXPOSURE" => {
                    scale /= positive::<1>(value).ok_or_else(|| bad(number, "EXPOSURE is no positive number".into()))?[0]
                }
                "COLORCORR" => {
                    let c =
                        positive::<3>(value).ok_or_else(|| bad(number, "COLORCORR is not three positive numbers".into()))?;
                    scale /= Vec3::from_array(c);
                }
                _ => {}
            }
        }
        let resolution = String::from_utf8_lossy(lines.next_line(name)?).into_owned();
        let number = lines.number;
        let (slow, fast) = parse_resolution(&resolution)
            .ok_or_else(|| bad(number, format!("`{}` is no image size", shorten(resolution.trim()))))?;
        if !(scale.is_finite() && scale.min_element() > 0.0) {
            return Err(bad(1, "EXPOSURE and COLORCORR leave no finite scale".into()));
        }
        let xyze = || primaries::rec709_from_xyze().unwrap_or(Mat3::IDENTITY);
        let rec709_from_file = if is_xyz { xyze() } else { Mat3::IDENTITY };
        Ok(Self { slow, fast, scale, rec709_from_file, pixels_at: lines.at })
    }
}

struct Lines<'a> {
    bytes: &'a [u8],
    at: usize,
    number: usize,
}

impl<'a> Lines<'a> {
    fn next_line(&mut self, name: &str) -> Result<&'a [u8], ImageError> {
        self.number += 1;
        let rest = &self.bytes[self.at..];
        let window = &rest[..rest.len().min(MAX_LINE)];
        let Some(length) = window.iter().position(|&b| b == b'\n') else {
            return Err(ImageError::malformed(
                name,
                format!("header line {}", self.number),
                "the header has no end",
                COPY_AGAIN,
            ));
        };
        self.at += length + 1;
        Ok(&rest[..length])
    }
}

fn positive<const N: usize>(text: &str) -> Option<[f32; N]> {
    let mut numbers = text.split_whitespace().map(|word| word.parse::<f32>().ok());
    let mut out = [0.0; N];
    for value in &mut out {
        *value = numbers.next()??;
        if !(value.is_finite() && *value > 0.0) {
            return None;
        }
    }
    Some(out)
}

fn parse_resolution(line: &str) -> Option<(Axis, Axis)> {
    let mut words = line.split_whitespace();
    let mut axis = || {
        let (is_x, increasing) = match words.next()? {
            "+X" => (true, true),
            "-X" => (true, false),
            "+Y" => (false, true),
            "-Y" => (false, false),
            _ => return None,
        };
        Some(Axis { is_x, increasing, count: words.next()?.parse().ok()? })
    };
    let (slow, fast) = (axis()?, axis()?);
    (slow.is_x != fast.is_x).then_some((slow, fast))
}

fn shorten(text: &str) -> String {
    text.chars().take(40).filter(|c| !c.is_control()).collect()
}
