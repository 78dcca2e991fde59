//! The glTF profile of a bundle, version 1, and the bytes of its vertex attributes.
//!
//! `site.glb` (and `site-1.glb`, ... where one would pass 2 GiB) is plain glTF 2.0 in the binary container. Each part is a
//! node with a mesh; each chunk is a primitive of that mesh, a list of triangles with 16-bit indices and vertices of its own.
//! A bundle's chunks are numbered through the files, in each file through its meshes, in each mesh through its primitives.
//! Every attribute has a buffer view to itself, so that a reader fetches what it wants, and a chunk's views lie together.
//!
//! | attribute | type | holds |
//! | --- | --- | --- |
//! | `POSITION` | VEC3 FLOAT | metres, with min and max |
//! | `NORMAL` | VEC3 FLOAT | unit length |
//! | `COLOR_0` | VEC4 UNSIGNED_SHORT, normalised | linear albedo, alpha 1; absent from a textured chunk whose factor is 1 throughout |
//! | `TEXCOORD_0` | VEC2 FLOAT | for the base colour texture, where there is one |
//! | `_TEXEL_UV` | VEC2 FLOAT | where light in texels ([`crate::texels`]) is shown, places in its atlas |
//! | `_SUN_MASK_n` | VEC4 UNSIGNED_SHORT | 64 bits each: bit t is bit t mod 16 of component (t mod 64) / 16 of `_SUN_MASK_{t/64}` |
//! | `_SKY_TRANSFER_n` | VEC4 FLOAT | consecutive floats, coefficient-major, then channel, zero-padded |
//! | `_SUN_BOUNCE_n` | VEC4 FLOAT | likewise, function-major; `lapse.json` holds the functions |
//! | `_VALID` | SCALAR UNSIGNED_BYTE, every 4 bytes | 0 where a vertex borrowed its light; absent where all are 1 |
//!
//! Materials are Lambertian for stock viewers too: no metal, full roughness, both sides. Base colour images are opaque; of a part
//! whose evidence the manifest tells, their alpha says what the colour rests on: 1 where it was seen, 0.5 and less where it was guessed. `asset.extras.heliodon_profile` is
//! the version. Why floats and no quantisation: the files are what other programs read and what the bake's error is measured
//! on; the viewer packs its own buffers from them while loading.

use crate::chunk::{LightLayout, LitChunk, VertexLight};
use crate::grid::GridPoints;
use glam::{Vec2, Vec3};
use std::ops::Range;

/// Version of the glTF profile.
pub const PROFILE_VERSION: u32 = 1;
/// The folder of what single photographs saw of parts: PNG files, colours and directions.
pub const VIEWS_FOLDER: &str = "views";

/// The folder of the scan itself beside what is drawn of it: a bundle of its own, with the same parts and the same day.
pub const SCAN_FOLDER: &str = "scan";

/// The latest version of the bundle's manifest.
pub const FORMAT_VERSION: u32 = MATERIALS_FORMAT_VERSION;
/// The version of bundles whose parts have details for some of their materials, or `least_px`.
pub const MATERIALS_FORMAT_VERSION: u32 = 10;
/// The version of those without, but which tell what the site says of its parts, or `purge_effort` in `[prepare]`.
pub const PARTS_FORMAT_VERSION: u32 = 9;
/// The version of those without that too, but with the scan itself beside what is drawn of it, or `scan` in `[prepare]`.
pub const SCAN_FORMAT_VERSION: u32 = 8;
/// The version of those without that too, but with a panorama or a size for it in `[prepare]`.
pub const PANORAMA_FORMAT_VERSION: u32 = 7;
/// The version of those without that too, but which say what colours rest on, or what single photographs saw.
pub const EVIDENCE_FORMAT_VERSION: u32 = 6;
/// The version of those without that too, but in which something happens: things, films, sounds, scripts.
pub const LIVING_FORMAT_VERSION: u32 = 5;
/// The version of those without that too, but with details.
pub const DETAIL_FORMAT_VERSION: u32 = 4;
/// The version of those without that too, but with light in texels or a size for it in `[bake]`, weathering or mattes.
pub const TEXEL_FORMAT_VERSION: u32 = 3;
/// The version of those without that too, but with a light grid, actors, lamps or prepared geometry.
pub const MOVING_FORMAT_VERSION: u32 = 2;
/// The version of bundles without: they are what they were before there were any, and programs of that time read them.
pub const STILL_FORMAT_VERSION: u32 = 1;

/// glTF component types that the profile uses.
pub(crate) mod component {
    pub(crate) const UNSIGNED_BYTE: u32 = 5121;
    pub(crate) const UNSIGNED_SHORT: u32 = 5123;
    pub(crate) const FLOAT: u32 = 5126;
}

/// What an attribute is, as glTF says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct AttributeType {
    pub(crate) component: u32,
    pub(crate) kind: &'static str,
    pub(crate) normalized: bool,
    /// Bytes from one vertex to the next.
    pub(crate) stride: u32,
    /// Whether the view must say the stride, because elements do not fill it.
    pub(crate) spaced: bool,
}

pub(crate) const VEC2_F32: AttributeType =
    AttributeType { component: component::FLOAT, kind: "VEC2", normalized: false, stride: 8, spaced: false };
pub(crate) const VEC3_F32: AttributeType =
    AttributeType { component: component::FLOAT, kind: "VEC3", normalized: false, stride: 12, spaced: false };
pub(crate) const VEC4_F32: AttributeType =
    AttributeType { component: component::FLOAT, kind: "VEC4", normalized: false, stride: 16, spaced: false };
pub(crate) const COLOR_U16: AttributeType =
    AttributeType { component: component::UNSIGNED_SHORT, kind: "VEC4", normalized: true, stride: 8, spaced: false };
pub(crate) const MASK_U16: AttributeType =
    AttributeType { component: component::UNSIGNED_SHORT, kind: "VEC4", normalized: false, stride: 8, spaced: false };
pub(crate) const FLAG_U8: AttributeType =
    AttributeType { component: component::UNSIGNED_BYTE, kind: "SCALAR", normalized: false, stride: 4, spaced: true };

/// The attribute of places in the atlas of light in texels.
pub(crate) const TEXEL_UV: &str = "_TEXEL_UV";

/// Names of the attributes that hold the light, in the order in which they are stored.
pub(crate) struct LightAttributes {
    pub(crate) masks: Vec<String>,
    pub(crate) transfers: Vec<String>,
    pub(crate) bounces: Vec<String>,
}

impl LightAttributes {
    pub(crate) fn of(layout: LightLayout) -> Self {
        let names = |prefix: &str, count: usize| (0..count).map(|n| format!("{prefix}_{n}")).collect();
        Self {
            masks: names("_SUN_MASK", layout.mask_words().div_ceil(2)),
            transfers: names("_SKY_TRANSFER", layout.transfer_floats().div_ceil(4)),
            bounces: names("_SUN_BOUNCE", layout.bounce_floats().div_ceil(4)),
        }
    }

    /// Bytes that the light of a vertex takes.
    pub(crate) fn bytes(&self) -> u64 {
        8 * self.masks.len() as u64 + 16 * (self.transfers.len() + self.bounces.len()) as u64
    }
}

/// The attributes of a chunk in the order in which they are stored, each with its bytes.
pub(crate) fn encode(chunk: &LitChunk) -> Vec<(String, AttributeType, Vec<u8>)> {
    let mut out = vec![
        ("POSITION".to_owned(), VEC3_F32, vec3_bytes(&chunk.positions)),
        ("NORMAL".to_owned(), VEC3_F32, vec3_bytes(&chunk.normals)),
    ];
    if chunk.texture.is_some() {
        out.push(("TEXCOORD_0".to_owned(), VEC2_F32, vec2_bytes(&chunk.uvs)));
    }
    if chunk.texture.is_none() || chunk.albedo.iter().any(|&a| a != Vec3::ONE) {
        out.push(("COLOR_0".to_owned(), COLOR_U16, color_bytes(&chunk.albedo)));
    }
    if !chunk.texel_uvs.is_empty() {
        out.push((TEXEL_UV.to_owned(), VEC2_F32, vec2_bytes(&chunk.texel_uvs)));
    }
    out.extend(encode_light(&chunk.light, 0..chunk.vertex_count()));
    if chunk.valid.contains(&0) {
        out.push(("_VALID".to_owned(), FLAG_U8, chunk.valid.iter().flat_map(|&v| [v, 0, 0, 0]).collect()));
    }
    out
}

/// The attributes of some lattice points of a grid, six vertices each.
pub(crate) fn encode_grid(points: &GridPoints, range: Range<usize>) -> Vec<(String, AttributeType, Vec<u8>)> {
    let six = crate::grid::AXES.len();
    let positions: Vec<Vec3> =
        points.cells[range.clone()].iter().flat_map(|&cell| std::iter::repeat_n(points.position(cell), six)).collect();
    let normals = crate::grid::AXES.repeat(range.len());
    let mut out =
        vec![("POSITION".to_owned(), VEC3_F32, vec3_bytes(&positions)), ("NORMAL".to_owned(), VEC3_F32, vec3_bytes(&normals))];
    out.extend(encode_light(&points.light, six * range.start..six * range.end));
    let valid = &points.valid[range];
    if valid.contains(&0) {
        let flags = valid.iter().flat_map(|&v| [v, 0, 0, 0].repeat(six)).collect();
        out.push(("_VALID".to_owned(), FLAG_U8, flags));
    }
    out
}

/// The attributes of the light of some vertices.
fn encode_light(light: &VertexLight, vertices: Range<usize>) -> impl Iterator<Item = (String, AttributeType, Vec<u8>)> {
    let layout = light.layout();
    let names = LightAttributes::of(layout);
    let own = |per_vertex: usize| vertices.start * per_vertex..vertices.end * per_vertex;
    let mask = &light.sun_mask[own(layout.mask_words())];
    let transfer = &light.sky_transfer[own(layout.transfer_floats())];
    let bounce = &light.sun_bounce[own(layout.bounce_floats())];
    let masks = names.masks.into_iter().enumerate().map(move |(i, name)| {
        let words = groups(mask, layout.mask_words(), 2, i);
        (name, MASK_U16, le_bytes(words.map(u32::to_le_bytes)))
    });
    let transfers = names.transfers.into_iter().enumerate().map(move |(i, name)| {
        let floats = groups(transfer, layout.transfer_floats(), 4, i);
        (name, VEC4_F32, le_bytes(floats.map(f32::to_le_bytes)))
    });
    let bounces = names.bounces.into_iter().enumerate().map(move |(i, name)| {
        let floats = groups(bounce, layout.bounce_floats(), 4, i);
        (name, VEC4_F32, le_bytes(floats.map(f32::to_le_bytes)))
    });
    masks.chain(transfers).chain(bounces)
}

/// Of every vertex, its `group`-th run of `width` values, zero where the vertex's `per_vertex` values have ended.
fn groups<T: Copy + Default>(values: &[T], per_vertex: usize, width: usize, group: usize) -> impl Iterator<Item = T> + '_ {
    let runs = values.chunks_exact(per_vertex);
    runs.flat_map(move |vertex| (0..width).map(move |k| vertex.get(group * width + k).copied().unwrap_or_default()))
}

/// Elements one after another. Not `flat_map` to bytes, which pushes them one by one.
fn le_bytes<const N: usize>(elements: impl Iterator<Item = [u8; N]>) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(elements.size_hint().0 * N);
    for element in elements {
        bytes.extend_from_slice(&element);
    }
    bytes
}

pub(crate) fn vec3_bytes(values: &[Vec3]) -> Vec<u8> {
    le_bytes(values.iter().flat_map(|v| v.to_array()).map(f32::to_le_bytes))
}

pub(crate) fn vec2_bytes(values: &[Vec2]) -> Vec<u8> {
    le_bytes(values.iter().flat_map(|v| v.to_array()).map(f32::to_le_bytes))
}

/// Linear colours as normalised 16-bit integers with alpha 1, clamped to [0, 1].
pub(crate) fn color_bytes(linear: &[Vec3]) -> Vec<u8> {
    let code = |c: f32| (c.clamp(0.0, 1.0) * 65_535.0 + 0.5) as u16;
    le_bytes(linear.iter().flat_map(|v| [code(v.x), code(v.y), code(v.z), u16::MAX]).map(u16::to_le_bytes))
}

pub(crate) fn indices_bytes(triangles: &[[u32; 3]]) -> Vec<u8> {
    le_bytes(triangles.as_flattened().iter().map(|&i| (i as u16).to_le_bytes()))
}

pub(crate) fn read_f32(bytes: &[u8]) -> impl Iterator<Item = f32> + '_ {
    bytes.as_chunks::<4>().0.iter().map(|&b| f32::from_le_bytes(b))
}

pub(crate) fn read_u16(bytes: &[u8]) -> impl Iterator<Item = u16> + '_ {
    bytes.as_chunks::<2>().0.iter().map(|&b| u16::from_le_bytes(b))
}

pub(crate) fn read_vec3(bytes: &[u8]) -> Vec<Vec3> {
    bytes
        .as_chunks::<12>()
        .0
        .iter()
        .map(|b| {
            let mut f = read_f32(b);
            let mut next = || f.next().unwrap_or_default();
            Vec3::new(next(), next(), next())
        })
        .collect()
}

pub(crate) fn read_vec2(bytes: &[u8]) -> Vec<Vec2> {
    bytes
        .as_chunks::<8>()
        .0
        .iter()
        .map(|b| {
            let mut f = read_f32(b);
            let mut next = || f.next().unwrap_or_default();
            Vec2::new(next(), next())
        })
        .collect()
}

pub(crate) fn read_colors(bytes: &[u8]) -> Vec<Vec3> {
    bytes
        .as_chunks::<8>()
        .0
        .iter()
        .map(|b| {
            let mut c = read_u16(b).map(|code| f32::from(code) / 65_535.0);
            let mut next = || c.next().unwrap_or_default();
            Vec3::new(next(), next(), next())
        })
        .collect()
}

pub(crate) fn read_triangles(bytes: &[u8]) -> Vec<[u32; 3]> {
    bytes
        .as_chunks::<6>()
        .0
        .iter()
        .map(|b| {
            let mut i = read_u16(b).map(u32::from);
            let mut next = || i.next().unwrap_or_default();
            [next(), next(), next()]
        })
        .collect()
}

/// Puts the runs of an attribute back among each vertex's values; the inverse of [`groups`].
pub(crate) fn scatter<T: Copy>(run: impl Iterator<Item = T>, width: usize, group: usize, per_vertex: usize, values: &mut [T]) {
    for (i, value) in run.enumerate() {
        let (vertex, k) = (i / width, group * width + i % width);
        if k < per_vertex
            && let Some(slot) = values.get_mut(vertex * per_vertex + k)
        {
            *slot = value;
        }
    }
}

/// Light of `vertices` vertices, to be filled by [`scatter`].
pub(crate) fn empty_light(layout: LightLayout, vertices: usize) -> VertexLight {
    VertexLight::zeros(layout, vertices)
}
