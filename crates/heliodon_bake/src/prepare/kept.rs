//! Prepared geometry, kept: whoever bakes the same files with the same settings again, or one shard of them, finds it done.

use crate::cache::{Cache, CacheError};
use crate::codec::{Decoder, Encoder};
use crate::plan::Plan;
use crate::scene::{Original, PartRange, Scene};
use bytemuck::Pod;
use glam::Vec3;
use heliodon_bundle::site::{InputKind, SITE_FILE_NAME};
use heliodon_image::SrgbImage;
use heliodon_mesh::{Material, Mesh, Texture, TextureWrap};
use std::sync::Arc;

/// What the folders of prepared geometry are called, before their key.
pub(crate) const GEOMETRY: &str = "geometry-";

/// The last block that is written: with it, all is there.
const INDEX: &str = "index";

/// The most bytes of a block: arrays of gigabytes are not copied whole to be written.
const BLOCK_BYTES: usize = 1 << 26;

const WRAPS: [TextureWrap; 3] = [TextureWrap::Repeat, TextureWrap::Mirror, TextureWrap::Clamp];

/// Hash of all that decides what preparation makes of a site: program, files, how they are placed, settings, rooms and display.
pub(super) fn geometry_key(plan: &Plan) -> String {
    let mut hasher = blake3::Hasher::new();
    let mut run = |bytes: &[u8]| {
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    };
    let site = &plan.site;
    let probes: Vec<String> = plan.files.iter().filter(|f| f.kind == InputKind::Probe).map(|f| plan.told_name(f)).collect();
    let inputs: Vec<_> = plan.inputs.iter().filter(|i| i.path != SITE_FILE_NAME && !probes.contains(&i.path)).collect();
    run(crate::TOOL.as_bytes());
    for parameters in [
        serde_json::to_vec(&inputs),
        serde_json::to_vec(&site.parts),
        serde_json::to_vec(&site.site.origin),
        serde_json::to_vec(&site.prepare),
        serde_json::to_vec(&site.rooms),
        serde_json::to_vec(&site.display),
    ] {
        // plain structs of numbers and words always have a JSON form; without one the key is only less specific
        run(&parameters.unwrap_or_default());
    }
    format!("{GEOMETRY}{}", &hasher.finalize().to_hex()[..32])
}

fn store<T: Pod>(cache: &Cache, stage: &str, values: &[T], lengths: &mut Vec<u64>) -> Result<(), CacheError> {
    let bytes: &[u8] = bytemuck::cast_slice(values);
    for (block, bytes) in bytes.chunks(BLOCK_BYTES).enumerate() {
        cache.store(stage, block, bytes)?;
    }
    lengths.push(values.len() as u64);
    Ok(())
}

fn load<T: Pod>(cache: &Cache, stage: &str, lengths: &mut impl Iterator<Item = u64>) -> Option<Vec<T>> {
    let length = usize::try_from(lengths.next()?).ok()?;
    let mut values: Vec<T> = vec![T::zeroed(); length];
    for (block, bytes) in bytemuck::cast_slice_mut::<T, u8>(&mut values).chunks_mut(BLOCK_BYTES).enumerate() {
        let content = cache.load(stage, block)?;
        if content.len() != bytes.len() {
            return None;
        }
        bytes.copy_from_slice(&content);
    }
    Some(values)
}

/// Keeps a prepared scene, and what is told of it.
///
/// # Errors
/// A cache that cannot be written.
pub(super) fn keep(cache: &Cache, scene: &Scene, report_json: &[u8]) -> Result<(), CacheError> {
    let (mesh, mut lengths) = (&scene.mesh, Vec::new());
    store(cache, "positions", &mesh.positions, &mut lengths)?;
    store(cache, "normals", &mesh.normals, &mut lengths)?;
    store(cache, "uvs", &mesh.uvs, &mut lengths)?;
    store(cache, "colors", &mesh.colors_linear, &mut lengths)?;
    store(cache, "triangles", &mesh.triangles, &mut lengths)?;
    store(cache, "materials-of-triangles", &mesh.triangle_material, &mut lengths)?;
    if let Some(original) = &scene.original {
        store(cache, "original-positions", &original.positions, &mut lengths)?;
        store(cache, "original-triangles", &original.triangles, &mut lengths)?;
        store(cache, "stands-for", &original.stands_for, &mut lengths)?;
        store(cache, "clearance", &original.clearance_m, &mut lengths)?;
    }
    let mut textures: Vec<&Arc<Texture>> = Vec::new();
    let mut materials = Encoder::default();
    materials.number(mesh.materials.len() as u64);
    for material in &mesh.materials {
        let texture = material.texture.as_ref().map_or(u64::MAX, |texture| {
            let known = textures.iter().position(|known| Arc::ptr_eq(known, texture));
            known.unwrap_or_else(|| {
                textures.push(texture);
                textures.len() - 1
            }) as u64
        });
        materials.run(material.name.as_bytes()).run(&[material.base_color_linear]).number(texture);
    }
    for (block, texture) in textures.iter().enumerate() {
        let wrap = texture.wrap.map(|wrap| WRAPS.iter().position(|known| *known == wrap).unwrap_or(0) as u32);
        let mut encoder = Encoder::default();
        encoder.run(texture.source.as_bytes()).run(&[texture.image.width, texture.image.height, wrap[0], wrap[1]]);
        encoder.run(&texture.image.pixels);
        cache.store("texture", block, &encoder.finish())?;
    }
    cache.store("materials", 0, &materials.finish())?;
    cache.write_note("report.json", report_json)?;
    let mut index = Encoder::default();
    index.run(&lengths).number(textures.len() as u64).number(u64::from(scene.original.is_some()));
    index.number(scene.parts.len() as u64);
    for part in &scene.parts {
        let PartRange { vertices, triangles, drawn, files } = part;
        let numbers = [vertices.start, vertices.end, triangles.start, triangles.end, *drawn, *files];
        index.run(&numbers.map(|number| number as u64));
    }
    index.number(scene.warnings.len() as u64);
    for warning in &scene.warnings {
        index.run(warning.as_bytes());
    }
    cache.store(INDEX, 0, &index.finish())
}

/// The scene that was kept; `None` where there is none, or it is damaged.
pub(super) fn recall(cache: &Cache) -> Option<Scene> {
    let index = cache.load(INDEX, 0)?;
    let mut index = Decoder::new(&index);
    let lengths: Vec<u64> = index.run()?;
    let (textures, has_original) = (index.number()?, index.number()? != 0);
    let parts = (0..index.number()?)
        .map(|_| {
            let [v0, v1, t0, t1, drawn, files] = index.run::<u64>()?[..] else { return None };
            let at = |number: u64| number as usize;
            Some(PartRange { vertices: at(v0)..at(v1), triangles: at(t0)..at(t1), drawn: at(drawn), files: at(files) })
        })
        .collect::<Option<Vec<_>>>()?;
    let text = |bytes: Option<Vec<u8>>| String::from_utf8(bytes?).ok();
    let warnings = (0..index.number()?).map(|_| text(index.run())).collect::<Option<Vec<_>>>()?;
    let textures = (0..textures as usize).map(|block| recall_texture(cache, block)).collect::<Option<Vec<_>>>()?;
    let materials = cache.load("materials", 0)?;
    let mut decoder = Decoder::new(&materials);
    let materials = (0..decoder.number()?)
        .map(|_| {
            let name = text(decoder.run())?;
            let [base_color_linear] = decoder.run::<Vec3>()?[..] else { return None };
            let texture = match decoder.number()? {
                u64::MAX => None,
                number => Some(Arc::clone(textures.get(number as usize)?)),
            };
            Some(Material { name, base_color_linear, texture })
        })
        .collect::<Option<Vec<_>>>()?;
    let lengths = &mut lengths.into_iter();
    let mesh = Mesh {
        positions: load(cache, "positions", lengths)?,
        normals: load(cache, "normals", lengths)?,
        uvs: load(cache, "uvs", lengths)?,
        colors_linear: load(cache, "colors", lengths)?,
        triangles: load(cache, "triangles", lengths)?,
        triangle_material: load(cache, "materials-of-triangles", lengths)?,
        materials,
    };
    let original = if has_original {
        Some(Original {
            positions: load(cache, "original-positions", lengths)?,
            triangles: load(cache, "original-triangles", lengths)?,
            stands_for: load(cache, "stands-for", lengths)?,
            clearance_m: load(cache, "clearance", lengths)?,
        })
    } else {
        None
    };
    mesh.validate().ok()?;
    Some(Scene { mesh, parts, warnings, original })
}

fn recall_texture(cache: &Cache, block: usize) -> Option<Arc<Texture>> {
    let bytes = cache.load("texture", block)?;
    let mut decoder = Decoder::new(&bytes);
    let source = String::from_utf8(decoder.run()?).ok()?;
    let [width, height, u, v] = decoder.run::<u32>()?[..] else { return None };
    let wrap = [*WRAPS.get(u as usize)?, *WRAPS.get(v as usize)?];
    Some(Arc::new(Texture { source, image: SrgbImage { width, height, pixels: decoder.run()? }, wrap }))
}
