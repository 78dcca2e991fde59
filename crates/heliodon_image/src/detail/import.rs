//! Detail textures from images.

use super::error::check_sides;
use super::quantise::{quantise, with_contrast};
use super::{DetailError, DetailTexture, NEUTRAL, Seam, SeamVerdict};
use crate::SrgbImage;
use glam::Vec3;
use heliodon_math::color::{linear_from_srgb8_table, luminance, srgb_from_linear};
use std::path::Path;

/// How an image becomes a detail texture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DetailImport {
    /// Whether a mean other than 128 may be corrected, by shifting all codes alike. Without it, an image whose mean is off by more than
    /// [`DetailImport::MEAN_TOLERANCE`] is refused.
    pub correct: bool,
    /// The standard deviation that codes are scaled to, 1 to 40; `None` keeps it. Only together with `correct`.
    pub contrast: Option<f32>,
}

impl DetailImport {
    /// What a mean may be off by and count as 128, in codes: it changes a surface's brightness by 0.4 %, half of what eyes tell apart side by side.
    pub const MEAN_TOLERANCE: f64 = 0.5;

    /// Takes the image as it is, or not at all.
    #[must_use]
    pub fn strict() -> Self {
        Self::default()
    }

    /// Shifts the image to the right mean.
    #[must_use]
    pub fn corrected() -> Self {
        Self { correct: true, contrast: None }
    }
}

/// What came of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedDetail {
    /// The texture; its mean is exact.
    pub texture: DetailTexture,
    /// The image's own mean, in codes.
    pub mean_before: f64,
    /// The image's own standard deviation, in codes.
    pub contrast_before: f32,
    /// Codes that are other than in the image.
    pub changed: u64,
    /// How it goes on into itself.
    pub seam: Seam,
    /// What is doubtful, each in a sentence that names the image; empty where nothing is.
    pub warnings: Vec<String>,
}

/// Above this share of codes at 0 or 255, form is lost in flat blots.
const MUCH_AT_LIMITS: f32 = 0.02;
/// Below it, in codes, nobody sees the detail; above it, it hides the surface.
const FAINT: f32 = 2.0;
const HARSH: f32 = 48.0;

impl DetailTexture {
    /// Reads a PNG (or JPEG) file; see [`DetailTexture::from_image`].
    ///
    /// # Errors
    /// Where the file cannot be read, and as [`DetailTexture::from_image`].
    pub fn read(path: impl AsRef<Path>, import: &DetailImport) -> Result<ImportedDetail, DetailError> {
        let path = path.as_ref();
        Self::from_image(&SrgbImage::read(path)?, &path.display().to_string(), import)
    }

    /// Makes a detail texture of an image, whose grey codes are taken as they are.
    ///
    /// Of colours the grey of the same luminance is taken; what is transparent is blended with 128, which does nothing. A mean within
    /// [`DetailImport::MEAN_TOLERANCE`] of 128 is made exact by changing as few codes as can be, each by 1. `name` is for messages.
    ///
    /// # Errors
    /// Sides that are no powers of two or out of range, an image of one code, a mean that is off where no correction is asked for,
    /// a contrast out of range or without correction.
    pub fn from_image(image: &SrgbImage, name: &str, import: &DetailImport) -> Result<ImportedDetail, DetailError> {
        check_contrast(import)?;
        let (width, height) = (image.width, image.height);
        check_sides(name, width, height)?;
        if image.pixels.len() as u64 != u64::from(width) * u64::from(height) {
            return Err(DetailError::Broken { name: name.into(), width, height });
        }
        let greys = greys(image);
        let before: Vec<u8> = greys.iter().map(|grey| (grey + 0.5) as u8).collect();
        if let Some(&code) = before.first().filter(|&first| before.iter().all(|code| code == first)) {
            return Err(DetailError::Constant { name: name.into(), code });
        }
        let count = greys.len() as f64;
        let mean = greys.iter().sum::<f64>() / count;
        let variance = greys.iter().map(|grey| (grey - mean) * (grey - mean)).sum::<f64>() / count;
        if !import.correct && (mean - f64::from(NEUTRAL)).abs() > DetailImport::MEAN_TOLERANCE {
            return Err(DetailError::Mean { name: name.into(), mean });
        }
        let deviation = libm::sqrt(variance);
        let codes = match import.contrast {
            Some(contrast) => {
                let scaled: Vec<f64> = greys.iter().map(|grey| (grey - mean) / deviation).collect();
                with_contrast(&scaled, f64::from(contrast))
            }
            None => quantise(&greys),
        };
        let changed = codes.iter().zip(&before).filter(|(a, b)| a != b).count() as u64;
        let texture = Self { width, height, codes };
        let seam = texture.seam();
        let warnings = doubts(&texture, name, &seam, image, has_colours(image));
        Ok(ImportedDetail { texture, mean_before: mean, contrast_before: deviation as f32, changed, seam, warnings })
    }
}

fn check_contrast(import: &DetailImport) -> Result<(), DetailError> {
    let wrong = |value: String, allowed| Err(DetailError::Parameter { parameter: "the contrast", value, allowed });
    match import.contrast {
        Some(contrast) if !(1.0..=40.0).contains(&contrast) => {
            wrong(contrast.to_string(), "a standard deviation from 1 to 40 codes")
        }
        Some(contrast) if !import.correct => wrong(contrast.to_string(), "it together with the correction only (--correct)"),
        _ => Ok(()),
    }
}

/// Each pixel's grey in codes, in [0, 255]; whole numbers where the image is grey and opaque.
fn greys(image: &SrgbImage) -> Vec<f64> {
    let linear = linear_from_srgb8_table();
    let grey = |&[r, g, b, alpha]: &[u8; 4]| {
        let opaque = if r == g && g == b {
            f64::from(r)
        } else {
            let [r, g, b] = [r, g, b].map(|code| linear[usize::from(code)]);
            f64::from(srgb_from_linear(luminance(Vec3::new(r, g, b))) * 255.0).clamp(0.0, 255.0)
        };
        f64::from(NEUTRAL) + (opaque - f64::from(NEUTRAL)) * (f64::from(alpha) / 255.0)
    };
    image.pixels.iter().map(grey).collect()
}

/// Whether an image is more than grey.
fn has_colours(image: &SrgbImage) -> bool {
    // compression leaves greys a code or two apart
    image.pixels.iter().any(|p| p[0].abs_diff(p[1]).max(p[1].abs_diff(p[2])) > 4)
}

/// What one should know of a texture before it is used.
fn doubts(texture: &DetailTexture, name: &str, seam: &Seam, image: &SrgbImage, coloured: bool) -> Vec<String> {
    let mut told = Vec::new();
    let contrast = texture.contrast();
    if coloured {
        told.push(format!("{name}: it has colours; only their luminance is used, as a detail texture changes brightness only"));
    }
    if image.pixels.iter().any(|p| p[3] < u8::MAX) {
        told.push(format!("{name}: parts of it are transparent; there it leaves the surface as it is"));
    }
    if seam.verdict > SeamVerdict::Seamless {
        let (edge, ratio) = if seam.u >= seam.v { ("left and right", seam.u) } else { ("upper and lower", seam.v) };
        told.push(format!(
            "{name}: a {} seam where its {edge} edges meet, {ratio:.1} times the steps inside; make it tile in an image editor",
            seam.verdict.name()
        ));
    }
    let at_limits = texture.share_at_limits();
    if at_limits > MUCH_AT_LIMITS {
        told.push(format!(
            "{name}: {:.1} % of its codes are 0 or 255, where form is lost; lower its contrast",
            100.0 * at_limits
        ));
    }
    if contrast < FAINT {
        told.push(format!("{name}: its contrast is {contrast:.1} codes, hardly to be seen; raise it (--contrast 15)"));
    } else if contrast > HARSH {
        told.push(format!("{name}: its contrast is {contrast:.0} codes, which hides the surface; lower it (--contrast 15)"));
    }
    if texture.width.min(texture.height) < 64 {
        told.push(format!("{name}: {} x {} texels repeat visibly; 64 x 64 and more do so less", texture.width, texture.height));
    }
    told
}
