//! Pictures of any kind that is read, told apart by their first bytes.

use crate::error::{self, ImageError};
use crate::{HdrImage, PixelRepairs, SrgbImage, tga, tiff};
use std::path::Path;

/// Pixels of either kind.
#[derive(Clone, Debug, PartialEq)]
pub enum Picture {
    /// Eight bits a component.
    Eight(SrgbImage),
    /// Floats, linear.
    Hdr(HdrImage),
}

impl Picture {
    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        match self {
            Self::Eight(image) => [image.width, image.height],
            Self::Hdr(image) => [image.width, image.height],
        }
    }
}

/// A picture, and what its file was.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureFile {
    /// Its pixels.
    pub picture: Picture,
    /// What was changed on the way, in words.
    pub warnings: Vec<String>,
    /// Bytes of the file.
    pub bytes: u64,
}

impl PictureFile {
    /// Reads a PNG, JPEG, TIFF, TGA, Radiance or OpenEXR file. TGA has no first bytes of its own and goes by its name.
    ///
    /// # Errors
    /// Where the file cannot be read, is no such image, or is broken.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let (bytes, name) = error::read_file(path)?;
        let is_tga = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("tga"));
        let mut warnings = Vec::new();
        let picture = if bytes.starts_with(b"#?") || bytes.starts_with(&crate::openexr::MAGIC) {
            let (image, repairs) = HdrImage::from_bytes_counted(&bytes, &name)?;
            warnings.extend(told(&repairs).map(|told| format!("{name}: {told}")));
            Picture::Hdr(image)
        } else if tiff::is_tiff(&bytes) {
            let (picture, told) = tiff::decode(&bytes, &name)?;
            warnings.extend(told);
            picture
        } else {
            if is_deep_png(&bytes) {
                warnings.push(format!("{name}: has 16 bits a component, of which 8 are kept"));
            }
            match SrgbImage::from_bytes(&bytes, &name) {
                Err(ImageError::UnknownFormat { .. }) if is_tga => Picture::Eight(tga::decode(&bytes, &name)?),
                image => Picture::Eight(image?),
            }
        };
        Ok(Self { picture, warnings, bytes: bytes.len() as u64 })
    }
}

/// What became of components that were no radiance.
pub(crate) fn told(repairs: &PixelRepairs) -> Option<String> {
    let PixelRepairs { nan, infinite, negative } = repairs;
    (!repairs.is_none())
        .then(|| format!("{nan} components are NaN, {infinite} infinite and {negative} negative; they were replaced"))
}

fn is_deep_png(bytes: &[u8]) -> bool {
    // the header's chunk comes first: its width, its height and then its depth
    bytes.starts_with(b"\x89PNG\r\n\x1a\n") && bytes.get(24) == Some(&16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn files_are_told_apart_by_what_is_in_them() {
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str| folder.path().join(name);
        let image = SrgbImage::filled(3, 2, [9, 8, 7, 255]);
        // whatever the name says
        image.write_png(place("a.tga")).unwrap();
        let read = PictureFile::read(&place("a.tga")).unwrap();
        assert_eq!((&read.picture, read.picture.size()), (&Picture::Eight(image), [3, 2]));
        let hdr = HdrImage::filled(2, 2, Vec3::new(1.0, f32::NAN, 3.0));
        hdr.write_exr(place("a.exr")).unwrap();
        let read = PictureFile::read(&place("a.exr")).unwrap();
        assert!(matches!(read.picture, Picture::Hdr(_)) && read.warnings[0].contains("4 components are NaN"));
        std::fs::write(place("b.png"), "no").unwrap();
        assert!(matches!(PictureFile::read(&place("b.png")), Err(ImageError::UnknownFormat { .. })));
        assert!(matches!(PictureFile::read(&place("none.png")), Err(ImageError::Read { .. })));
    }
}
