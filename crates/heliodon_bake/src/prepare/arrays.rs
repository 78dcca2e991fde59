//! Arrays, meshes and reports in the blocks of a cache: found whole, or not at all.

use crate::cache::{Cache, CacheError};
use crate::codec::{Decoder, Encoder};
use bytemuck::Pod;
use glam::Vec3;
use heliodon_image::SrgbImage;
use heliodon_mesh::{Material, Mesh, Texture, TextureWrap};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::sync::Arc;

/// The most bytes of a block: arrays of gigabytes are not copied whole to be written.
const BLOCK_BYTES: usize = 1 << 26;

const WRAPS: [TextureWrap; 3] = [TextureWrap::Repeat, TextureWrap::Mirror, TextureWrap::Clamp];

/// The name of the block that is written last: with it, all is there.
pub(super) fn index_of(name: &str) -> String {
    format!("{name}-index")
}

/// The textures of materials, each once, in the order in which materials name them.
pub(crate) fn textures_of(materials: &[Material]) -> Vec<Arc<Texture>> {
    let mut textures: Vec<Arc<Texture>> = Vec::new();
    for texture in materials.iter().filter_map(|material| material.texture.as_ref()) {
        if !textures.iter().any(|known| Arc::ptr_eq(known, texture)) {
            textures.push(Arc::clone(texture));
        }
    }
    textures
}

/// Writes what belongs together into blocks whose names begin with one name.
pub(super) struct Writer<'a> {
    cache: &'a Cache,
    name: &'a str,
    /// Textures that meshes share; those kept elsewhere first.
    textures: Vec<Arc<Texture>>,
    elsewhere: usize,
    index: Encoder,
}

impl<'a> Writer<'a> {
    /// `elsewhere` are textures that whoever reads will have at hand.
    pub fn new(cache: &'a Cache, name: &'a str, elsewhere: &[Arc<Texture>]) -> Self {
        Self { cache, name, textures: elsewhere.to_vec(), elsewhere: elsewhere.len(), index: Encoder::default() }
    }

    pub fn array<T: Pod>(&mut self, what: &str, values: &[T]) -> Result<(), CacheError> {
        let stage = format!("{}-{what}", self.name);
        let bytes: &[u8] = bytemuck::cast_slice(values);
        for (block, bytes) in bytes.chunks(BLOCK_BYTES).enumerate() {
            self.cache.store(&stage, block, bytes)?;
        }
        self.number(values.len() as u64);
        Ok(())
    }

    pub fn number(&mut self, value: u64) {
        self.index.number(value);
    }

    /// A report, or other small things.
    pub fn told(&mut self, value: &impl Serialize) {
        // plain structs of numbers and words always have a JSON form; without one it is not found again, and made anew
        self.index.run(&serde_json::to_vec(value).unwrap_or_default());
    }

    pub fn mesh(&mut self, what: &str, mesh: &Mesh) -> Result<(), CacheError> {
        self.array(&format!("{what}-positions"), &mesh.positions)?;
        self.array(&format!("{what}-triangles"), &mesh.triangles)?;
        self.array(&format!("{what}-normals"), &mesh.normals)?;
        self.array(&format!("{what}-uvs"), &mesh.uvs)?;
        self.array(&format!("{what}-colors"), &mesh.colors_linear)?;
        self.array(&format!("{what}-materials"), &mesh.triangle_material)?;
        self.number(mesh.materials.len() as u64);
        for material in &mesh.materials {
            let texture = match &material.texture {
                Some(texture) => self.texture(texture)?,
                None => u64::MAX,
            };
            self.index.run(material.name.as_bytes()).run(&[material.base_color_linear]).number(texture);
        }
        Ok(())
    }

    /// The number of a texture, which is written when it is first met.
    fn texture(&mut self, texture: &Arc<Texture>) -> Result<u64, CacheError> {
        if let Some(known) = self.textures.iter().position(|known| Arc::ptr_eq(known, texture)) {
            return Ok(known as u64);
        }
        let wrap = texture.wrap.map(|wrap| WRAPS.iter().position(|known| *known == wrap).unwrap_or(0) as u32);
        let mut encoder = Encoder::default();
        encoder.run(texture.source.as_bytes()).run(&[texture.image.width, texture.image.height, wrap[0], wrap[1]]);
        encoder.run(&texture.image.pixels);
        let number = self.textures.len();
        self.cache.store(&texture_stage(self.name), number - self.elsewhere, &encoder.finish())?;
        self.textures.push(Arc::clone(texture));
        Ok(number as u64)
    }

    pub fn finish(self) -> Result<(), CacheError> {
        self.cache.store(&index_of(self.name), 0, &self.index.finish())
    }
}

fn texture_stage(name: &str) -> String {
    format!("{name}-texture")
}

/// Takes back what a [`Writer`] has written, in the same order; `None` where it is missing or damaged.
pub(super) struct Reader<'a> {
    cache: &'a Cache,
    name: &'a str,
    textures: Vec<Arc<Texture>>,
    elsewhere: usize,
    index: Decoder<'a>,
}

/// Reads what is kept under a name; `elsewhere` are the textures that its writer was told of.
pub(super) fn read<T>(
    cache: &Cache,
    name: &str,
    elsewhere: &[Arc<Texture>],
    take: impl FnOnce(&mut Reader) -> Option<T>,
) -> Option<T> {
    let index = cache.load(&index_of(name), 0)?;
    let (textures, index) = (elsewhere.to_vec(), Decoder::new(&index));
    let mut reader = Reader { cache, name, textures, elsewhere: elsewhere.len(), index };
    take(&mut reader).filter(|_| reader.index.is_empty())
}

impl Reader<'_> {
    pub fn array<T: Pod>(&mut self, what: &str) -> Option<Vec<T>> {
        let stage = format!("{}-{what}", self.name);
        let mut values: Vec<T> = vec![T::zeroed(); usize::try_from(self.number()?).ok()?];
        for (block, bytes) in bytemuck::cast_slice_mut::<T, u8>(&mut values).chunks_mut(BLOCK_BYTES).enumerate() {
            let content = self.cache.load(&stage, block)?;
            if content.len() != bytes.len() {
                return None;
            }
            bytes.copy_from_slice(&content);
        }
        Some(values)
    }

    pub fn number(&mut self) -> Option<u64> {
        self.index.number()
    }

    pub fn told<T: DeserializeOwned>(&mut self) -> Option<T> {
        serde_json::from_slice(&self.index.run::<u8>()?).ok()
    }

    pub fn mesh(&mut self, what: &str) -> Option<Mesh> {
        self.unclean_mesh(what).filter(|mesh| mesh.validate().is_ok())
    }

    /// As [`Reader::mesh`], of one that may still be as it came in a file.
    pub fn unclean_mesh(&mut self, what: &str) -> Option<Mesh> {
        let mut mesh = Mesh {
            positions: self.array(&format!("{what}-positions"))?,
            triangles: self.array(&format!("{what}-triangles"))?,
            normals: self.array(&format!("{what}-normals"))?,
            uvs: self.array(&format!("{what}-uvs"))?,
            colors_linear: self.array(&format!("{what}-colors"))?,
            triangle_material: self.array(&format!("{what}-materials"))?,
            materials: Vec::new(),
        };
        for _ in 0..self.number()? {
            let name = String::from_utf8(self.index.run()?).ok()?;
            let [base_color_linear] = self.index.run::<Vec3>()?[..] else { return None };
            let texture = match self.number()? {
                u64::MAX => None,
                number => Some(self.texture(usize::try_from(number).ok()?)?),
            };
            mesh.materials.push(Material { name, base_color_linear, texture });
        }
        Some(mesh)
    }

    fn texture(&mut self, number: usize) -> Option<Arc<Texture>> {
        while self.textures.len() <= number {
            let bytes = self.cache.load(&texture_stage(self.name), self.textures.len() - self.elsewhere)?;
            let mut decoder = Decoder::new(&bytes);
            let source = String::from_utf8(decoder.run()?).ok()?;
            let [width, height, u, v] = decoder.run::<u32>()?[..] else { return None };
            let wrap = [*WRAPS.get(u as usize)?, *WRAPS.get(v as usize)?];
            let image = SrgbImage { width, height, pixels: decoder.run()? };
            self.textures.push(Arc::new(Texture { source, image, wrap }));
        }
        Some(Arc::clone(&self.textures[number]))
    }
}

/// Keeps one array alone.
pub(crate) fn store_array<T: Pod>(cache: &Cache, name: &str, values: &[T]) -> Result<(), CacheError> {
    let mut writer = Writer::new(cache, name, &[]);
    writer.array(VALUES, values)?;
    writer.finish()
}

/// What [`store_array`] has kept; `None` where it is missing or damaged.
pub(crate) fn load_array<T: Pod>(cache: &Cache, name: &str) -> Option<Vec<T>> {
    read(cache, name, &[], |reader| reader.array(VALUES))
}

const VALUES: &str = "values";

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;
    use std::fs;
    use std::path::Path;

    fn texture(grey: u8) -> Arc<Texture> {
        let image = SrgbImage { width: 1, height: 1, pixels: vec![[grey; 4]] };
        Arc::new(Texture { source: format!("{grey}.png"), image, wrap: [TextureWrap::Mirror, TextureWrap::Clamp] })
    }

    fn textured() -> Mesh {
        let [one, other] = [texture(1), texture(2)];
        let material = |texture: Option<&Arc<Texture>>| Material {
            name: "stone".to_owned(),
            base_color_linear: Vec3::splat(0.5),
            texture: texture.cloned(),
        };
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            uvs: vec![Vec2::ZERO; 3],
            triangles: vec![[0, 1, 2]; 4],
            triangle_material: vec![0, 1, 2, 3],
            materials: vec![material(Some(&one)), material(None), material(Some(&other)), material(Some(&one))],
            ..Mesh::default()
        }
    }

    #[test]
    fn meshes_come_back_whole_or_not_at_all() {
        let root = tempfile::tempdir().unwrap();
        let cache = Cache::open(root.path(), "key", Path::new("bundle")).unwrap();
        let mesh = textured();
        for elsewhere in [Vec::new(), textures_of(&mesh.materials)] {
            let mut writer = Writer::new(&cache, "part", &elsewhere);
            writer.mesh("mesh", &mesh).unwrap();
            writer.told(&["limestone"]);
            assert!(read(&cache, "part", &elsewhere, |reader| reader.mesh("mesh")).is_none(), "the index comes last");
            writer.finish().unwrap();
            let take = |reader: &mut Reader| Some((reader.mesh("mesh")?, reader.told::<[String; 1]>()?));
            let (back, told) = read(&cache, "part", &elsewhere, take).unwrap();
            assert_eq!(
                (back.positions, back.uvs, back.triangles),
                (mesh.positions.clone(), mesh.uvs.clone(), mesh.triangles.clone())
            );
            assert_eq!((back.triangle_material, told), (mesh.triangle_material.clone(), ["limestone".to_owned()]));
            // what shared a texture shares it again, for a bundle holds each once
            let textures = textures_of(&back.materials);
            assert_eq!(textures.iter().map(|texture| texture.source.as_str()).collect::<Vec<_>>(), ["1.png", "2.png"]);
            assert_eq!(textures[1].wrap, [TextureWrap::Mirror, TextureWrap::Clamp]);
            if let Some(own) = elsewhere.first() {
                assert!(Arc::ptr_eq(own, &textures[0]));
            }
            // not all that was written is asked for: it is something else
            assert!(read(&cache, "part", &elsewhere, |reader| reader.mesh("mesh")).is_none());
            fs::remove_file(cache.folder().join("part-index-00000")).unwrap();
        }
        let mut writer = Writer::new(&cache, "part", &[]);
        writer.mesh("mesh", &mesh).unwrap();
        writer.finish().unwrap();
        fs::write(cache.folder().join("part-mesh-triangles-00000"), "damaged").unwrap();
        assert!(read(&cache, "part", &[], |reader| reader.mesh("mesh")).is_none());
    }
}
