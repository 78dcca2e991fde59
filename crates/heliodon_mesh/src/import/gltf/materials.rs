//! Base colours and their textures.

use super::buffers::{Buffers, no_such};
use super::model::{Document, Index, TextureInfo};
use super::{Failure, Outcome};
use crate::import::assembly::Assembly;
use crate::import::material::UNSAID_ALBEDO;
use crate::{Material, Texture, TextureWrap};
use glam::Vec3;
use heliodon_image::SrgbImage;
use std::collections::HashMap;
use std::sync::Arc;

/// Materials in the order in which triangles first use them; `None` is glTF's default material.
#[derive(Default)]
pub(super) struct Materials {
    used: Vec<Option<Index>>,
    number: HashMap<Option<Index>, u16>,
}

impl Materials {
    pub fn number(&mut self, material: Option<Index>) -> Outcome<u16> {
        if let Some(&number) = self.number.get(&material) {
            return Ok(number);
        }
        let number = u16::try_from(self.used.len())
            .map_err(|_| Failure::new("materials", "are more than 65,536", "merge materials or split the file into several"))?;
        self.used.push(material);
        self.number.insert(material, number);
        Ok(number)
    }

    /// Gives the mesh its materials; a texture that cannot be read is a warning.
    pub fn finish(&self, document: &Document, buffers: &Buffers, assembly: &mut Assembly) {
        let mut textures: HashMap<(Index, [TextureWrap; 2]), Option<Arc<Texture>>> = HashMap::new();
        let has_colors = !assembly.mesh.colors_linear.is_empty();
        let mut said_anything = false;
        let mut materials = Vec::with_capacity(self.used.len());
        for &index in &self.used {
            let source = index.and_then(|i| document.materials.get(i as usize));
            let (factor, info) = source.map_or((None, None), base_color);
            let texture = info.as_ref().and_then(|info| load(document, buffers, info, &mut textures, assembly));
            said_anything |= factor.is_some() || texture.is_some();
            let unsaid = if texture.is_some() || has_colors { 1.0 } else { UNSAID_ALBEDO };
            let color = factor.map_or(Vec3::splat(unsaid), |[r, g, b, _]| Vec3::new(r, g, b));
            let base_color_linear = if color.is_nan() { Vec3::splat(0.5) } else { color.clamp(Vec3::ZERO, Vec3::ONE) };
            let name = source.map_or(String::new(), |m| m.name.clone());
            if let Some(mode) = source.and_then(|m| m.alpha_mode.as_deref()).filter(|mode| *mode != "OPAQUE") {
                assembly.warn(format_args!("the material \"{name}\" has alpha mode {mode}, and is taken as opaque"));
            }
            materials.push(Material { name, base_color_linear, texture });
        }
        assembly.keep_materials(materials, said_anything);
    }
}

/// The texture that texture coordinates are for.
pub(super) fn base_color(material: &super::model::Material) -> (Option<[f32; 4]>, Option<TextureInfo>) {
    if let Some(old) = &material.extensions.specular_glossiness {
        return (old.diffuse_factor, old.diffuse_texture.clone());
    }
    let pbr = &material.pbr_metallic_roughness;
    (pbr.base_color_factor, pbr.base_color_texture.clone())
}

fn load(
    document: &Document,
    buffers: &Buffers,
    info: &TextureInfo,
    textures: &mut HashMap<(Index, [TextureWrap; 2]), Option<Arc<Texture>>>,
    assembly: &mut Assembly,
) -> Option<Arc<Texture>> {
    let texture = document.textures.get(info.index as usize)?;
    let sampler = texture.sampler.and_then(|i| document.samplers.get(i as usize));
    let wrap = |code: Option<u32>| match code {
        Some(33071) => TextureWrap::Clamp,
        Some(33648) => TextureWrap::Mirror,
        _ => TextureWrap::Repeat,
    };
    let wrap = [wrap(sampler.and_then(|s| s.wrap_s)), wrap(sampler.and_then(|s| s.wrap_t))];
    let Some(source) = texture.source else {
        let index = info.index;
        assembly.warn(format_args!("textures[{index}] has no PNG or JPEG image; the surface takes its constant colour"));
        return None;
    };
    if let Some(known) = textures.get(&(source, wrap)) {
        return known.clone();
    }
    let decoded = decode(document, buffers, source, assembly);
    let texture = match decoded {
        Ok((name, image)) => Some(Arc::new(Texture { source: name, image, wrap })),
        Err(message) => {
            assembly.warn(format_args!("{message}; the surface takes its constant colour"));
            None
        }
    };
    textures.insert((source, wrap), texture.clone());
    texture
}

fn decode(document: &Document, buffers: &Buffers, index: Index, assembly: &Assembly) -> Result<(String, SrgbImage), String> {
    let images = &document.images;
    let image = images.get(index as usize).ok_or_else(|| no_such("images", index, images.len()).to_string())?;
    let item = format!("images[{index}]");
    let name = format!("{}: {item}", assembly.file.display());
    let owned;
    let bytes = match (&image.uri, image.buffer_view) {
        (_, Some(view)) => buffers.view(view).map_err(|failure| failure.to_string())?.0,
        (Some(uri), None) => {
            owned = buffers.resolve(uri, &item).map_err(|failure| failure.to_string())?;
            &owned
        }
        (None, None) => return Err(format!("{item} has neither a uri nor a buffer view")),
    };
    let image = SrgbImage::from_bytes(bytes, &name).map_err(|error| error.to_string())?;
    Ok((name, image))
}
