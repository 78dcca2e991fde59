//! Textures and colours as files name them.

use super::assembly::Assembly;
use crate::{Texture, Wrap};
use glam::Vec3;
use heliodon_image::SrgbImage;
use heliodon_math::color::linear_from_srgb;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub(crate) use crate::measure::UNSAID_ALBEDO;

/// The alpha below which a texel is meant to be seen through rather than smoothed at an edge.
const HALF_OPAQUE: u8 = 128;

/// Finds and decodes each texture file once.
pub(crate) struct Textures<'a> {
    folder: Option<&'a Path>,
    loaded: HashMap<(String, [Wrap; 2]), Option<Arc<Texture>>>,
}

impl<'a> Textures<'a> {
    /// Files are looked for in `folder`; without one (a mesh from memory) none is found.
    pub fn new(folder: Option<&'a Path>) -> Self {
        Self { folder, loaded: HashMap::new() }
    }

    pub fn load(&mut self, name: &str, assembly: &mut Assembly) -> Option<Arc<Texture>> {
        self.load_wrapped(name, [Wrap::Repeat; 2], assembly)
    }

    /// The texture file of that name; a warning and none where it is missing or cannot be decoded.
    pub fn load_wrapped(&mut self, name: &str, wrap: [Wrap; 2], assembly: &mut Assembly) -> Option<Arc<Texture>> {
        let key = (name.to_owned(), wrap);
        if let Some(known) = self.loaded.get(&key) {
            return known.clone();
        }
        let other_wrap = self.loaded.iter().find(|((n, _), t)| n == name && t.is_some()).and_then(|(_, t)| t.clone());
        let texture = match other_wrap {
            Some(other) => Some(Arc::new(Texture { wrap, ..(*other).clone() })),
            None => self.decode(name, wrap, assembly),
        };
        self.loaded.insert(key, texture.clone());
        texture
    }

    fn decode(&self, name: &str, wrap: [Wrap; 2], assembly: &mut Assembly) -> Option<Arc<Texture>> {
        let Some(path) = self.folder.and_then(|folder| locate(folder, name)) else {
            assembly.warn(format_args!("its texture \"{name}\" is not there; the surface takes its constant colour"));
            return None;
        };
        match SrgbImage::read(&path) {
            Ok(image) if image.pixels.iter().any(|pixel| pixel[3] < HALF_OPAQUE) => {
                assembly.warn(format_args!("its texture \"{name}\" is transparent in places, and is taken as opaque"));
                Some(Arc::new(Texture { source: path.display().to_string(), image, wrap }))
            }
            Ok(image) => Some(Arc::new(Texture { source: path.display().to_string(), image, wrap })),
            Err(error) => {
                assembly.warn(format_args!("its texture cannot be read, the surface takes its constant colour: {error}"));
                None
            }
        }
    }
}

/// A file that a mesh file names: as it is written, else (names from other people's disks) its last part in the same folder, else
/// the same in other capitals.
#[must_use]
pub fn locate(folder: &Path, name: &str) -> Option<PathBuf> {
    let name = name.trim().trim_matches('"').replace('\\', "/");
    let written = folder.join(&name);
    if written.is_file() {
        return Some(written);
    }
    let last = name.rsplit('/').next().filter(|last| !last.is_empty())?;
    let beside = folder.join(last);
    if beside.is_file() {
        return Some(beside);
    }
    let parent = written.parent().unwrap_or(folder);
    [parent, folder].into_iter().find_map(|folder| {
        let mut same: Vec<PathBuf> = std::fs::read_dir(folder)
            .ok()?
            .filter_map(|entry| entry.ok().map(|e| e.path()))
            .filter(|path| path.file_name().is_some_and(|n| n.to_string_lossy().to_lowercase() == last.to_lowercase()))
            .filter(|path| path.is_file())
            .collect();
        same.sort();
        same.into_iter().next()
    })
}

/// sRGB colours written as floats: up to 1, or, where one is larger than any rounding explains, up to 255.
pub(crate) fn push_srgb_colors(srgb: &[Vec3], assembly: &mut Assembly) {
    let largest = srgb.iter().filter(|c| c.is_finite()).fold(0.0_f32, |most, c| most.max(c.max_element()));
    let scale = if largest > 2.0 { 1.0 / 255.0 } else { 1.0 };
    assembly.mesh.colors_linear.reserve_exact(srgb.len());
    for color in srgb {
        assembly.push_color(Vec3::from((*color * scale).to_array().map(linear_from_srgb)));
    }
}
