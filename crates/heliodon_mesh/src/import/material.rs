//! Textures and colours as files name them.

use super::assembly::Assembly;
use crate::{Texture, TextureWrap};
use glam::Vec3;
use heliodon_image::SrgbImage;
use heliodon_math::color::linear_from_srgb;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub(crate) use crate::measure::UNSAID_ALBEDO;

/// The alpha below which a texel is meant to be seen through rather than smoothed at an edge.
const HALF_OPAQUE: u8 = 128;

/// Finds and decodes each texture file once.
#[derive(Default)]
pub(crate) struct Textures {
    loaded: HashMap<(PathBuf, [TextureWrap; 2]), Option<Arc<Texture>>>,
    /// Names that were looked for in vain, with the first folder.
    missing: HashSet<(PathBuf, String)>,
}

impl Textures {
    /// The texture file of that name in the first of `folders` that has it; a warning and none where it is missing or cannot be
    /// decoded.
    pub fn load(
        &mut self,
        folders: &[&Path],
        name: &str,
        wrap: [TextureWrap; 2],
        assembly: &mut Assembly,
    ) -> Option<Arc<Texture>> {
        let wanted = (folders.first().map_or_else(PathBuf::new, |&folder| folder.to_owned()), name.to_owned());
        if self.missing.contains(&wanted) {
            return None;
        }
        let Some(path) = folders.iter().find_map(|folder| locate(folder, name)) else {
            assembly.warn(format_args!("its texture \"{name}\" is not there; the surface takes its constant colour"));
            self.missing.insert(wanted);
            return None;
        };
        let key = (path, wrap);
        if let Some(known) = self.loaded.get(&key) {
            return known.clone();
        }
        let other_wrap = self.loaded.iter().find(|((path, _), t)| *path == key.0 && t.is_some()).and_then(|(_, t)| t.clone());
        let texture = match other_wrap {
            Some(other) => Some(Arc::new(Texture { wrap, ..(*other).clone() })),
            None => decode(&key.0, name, wrap, assembly),
        };
        self.loaded.insert(key, texture.clone());
        texture
    }
}

fn decode(path: &Path, name: &str, wrap: [TextureWrap; 2], assembly: &mut Assembly) -> Option<Arc<Texture>> {
    match SrgbImage::read(path) {
        Ok(image) => {
            if image.pixels.iter().any(|pixel| pixel[3] < HALF_OPAQUE) {
                assembly.warn(format_args!("its texture \"{name}\" is transparent in places, and is taken as opaque"));
            }
            Some(Arc::new(Texture { source: path.display().to_string(), image, wrap }))
        }
        Err(error) => {
            assembly.warn(format_args!("its texture cannot be read, the surface takes its constant colour: {error}"));
            None
        }
    }
}

/// Vertex colours beside a texture are a second rendering of it, as MeshLab writes them (PLY, OBJ): multiplied, they would darken it.
/// Answers whether the mesh has colours then.
pub(crate) fn keep_colors_without(textured: bool, assembly: &mut Assembly) -> bool {
    let mesh = &mut assembly.mesh;
    if textured && !mesh.uvs.is_empty() && !mesh.colors_linear.is_empty() {
        mesh.colors_linear = Vec::new();
        assembly.warn("has a texture and vertex colours; the texture is used");
    }
    !assembly.mesh.colors_linear.is_empty()
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
