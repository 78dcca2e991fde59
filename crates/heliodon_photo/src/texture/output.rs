//! The atlas, what it rests on, and the meshes that show it.

use super::fill::filled;
use super::gains::PhotoGain;
use super::gaps;
use super::layout::Layout;
use super::surface::{Face, Surface};
use crate::model::Part;
use glam::{Vec2, Vec3};
use heliodon_image::{SrgbImage, TextureWrap};
use heliodon_math::color::srgb8_from_linear;
use heliodon_mesh::{Material, Mesh, Texture};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;

/// [`Evidence`]: a texel that shows no surface.
pub const OUTSIDE: u8 = 0;
/// [`Evidence`]: a texel that no photograph saw; its colour is made up.
pub const GUESSED: u8 = 1;
/// [`Evidence`]: a texel that at least one photograph saw.
pub const SEEN: u8 = 2;

/// What each texel of an atlas rests on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Evidence {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// [`OUTSIDE`], [`GUESSED`] or [`SEEN`] for each texel, rows from the top.
    pub codes: Vec<u8>,
}

impl Evidence {
    /// As a picture for people: black outside, grey what was guessed, white what was seen.
    #[must_use]
    pub fn image(&self) -> SrgbImage {
        let shade = |code: &u8| [0, 128, 255][usize::from(*code).min(2)];
        let pixels = self.codes.iter().map(shade).map(|shade| [shade, shade, shade, 255]).collect();
        SrgbImage { width: self.width, height: self.height, pixels }
    }
}

/// What became of a face.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceReport {
    /// The part, by its index.
    pub part: usize,
    /// The face's number in it.
    pub face: u32,
    /// Its area, square metres.
    pub area_m2: f32,
    /// The part of it that a photograph saw.
    pub seen: f32,
    /// Whether it lies inside of the model, where nobody can see it: it hardly gets texels.
    pub buried: bool,
    /// Texels for a metre.
    pub texels_per_m: f32,
}

/// A textured model.
#[derive(Clone, Debug)]
pub struct Textured {
    /// For each part its mesh, with normals and texture coordinates and the atlas as its only material; triangles in the part's order.
    pub meshes: Vec<Mesh>,
    /// The colours of all parts.
    pub atlas: Arc<Texture>,
    /// The same in linear light, as bright as the mean of the photographs, not clipped: for solving the stone's own colour. Rows from the top.
    pub linear: Vec<Vec3>,
    /// What they rest on.
    pub evidence: Evidence,
    /// How photographs differ in exposure and white balance.
    pub gains: Vec<PhotoGain>,
    /// What became of each face.
    pub faces: Vec<FaceReport>,
    /// The part of the model's area that a photograph saw, of all that can be seen at all.
    pub seen: f32,
    /// The part of the atlas that triangles cover.
    pub utilisation: f32,
    /// What reading photographs changed, in words.
    pub warnings: Vec<String>,
}

/// The colour where there is nothing to go by: the albedo of what has none.
const GREY: f32 = 0.5;

pub(super) fn textured(
    parts: &[Part],
    surface: &Surface,
    layout: &Layout,
    colors: &[Option<Vec3>],
    gains: Vec<PhotoGain>,
    warnings: Vec<String>,
) -> Textured {
    let [width, height] = layout.size;
    let (columns, rows) = (width as usize, height as usize);
    let range = |face: usize| layout.starts[face]..layout.starts[face + 1];
    let means = means(parts.len(), &surface.faces, |face| &colors[range(face)]);
    let complete = gaps::filled(parts, surface, layout, colors, &means);
    let mut pixels: Vec<Option<Vec3>> = vec![None; columns * rows];
    let mut codes = vec![OUTSIDE; columns * rows];
    for (texel, (color, seen)) in complete.iter().zip(colors).enumerate() {
        let at = layout.cell(texel);
        pixels[at] = Some(*color);
        codes[at] = if seen.is_some() { SEEN } else { GUESSED };
    }
    // between charts too, so that coarse mip levels find no foreign colour
    filled(&mut pixels, columns, rows);
    let linear: Vec<Vec3> = pixels.into_iter().map(|pixel| pixel.unwrap_or(Vec3::splat(GREY))).collect();
    let encoded = |color: &Vec3| {
        let [r, g, b] = color.to_array().map(srgb8_from_linear);
        [r, g, b, 255]
    };
    let image = SrgbImage { width, height, pixels: linear.par_iter().map(encoded).collect() };
    let atlas = Arc::new(Texture { source: "photographs".into(), image, wrap: [TextureWrap::Clamp; 2] });
    let faces: Vec<FaceReport> =
        (0..surface.faces.len()).map(|face| report(face, surface, layout, &colors[range(face)])).collect();
    let open = || faces.iter().filter(|face| !face.buried);
    let area: f32 = open().map(|face| face.area_m2).sum();
    let seen = open().map(|face| face.area_m2 * face.seen).sum::<f32>() / area.max(f32::MIN_POSITIVE);
    let meshes = parts.iter().enumerate().map(|(index, part)| mesh(part, index, surface, layout, &atlas)).collect();
    let evidence = Evidence { width, height, codes };
    Textured { meshes, atlas, linear, evidence, gains, faces, seen, utilisation: layout.utilisation, warnings }
}

/// The mean colour that was seen of each part; of all, where nothing was seen of a part.
fn means<'a>(parts: usize, faces: &[Face], colors: impl Fn(usize) -> &'a [Option<Vec3>]) -> Vec<Vec3> {
    let mut sums = vec![(glam::DVec3::ZERO, 0.0); parts + 1];
    for (index, face) in faces.iter().enumerate() {
        for color in colors(index).iter().flatten() {
            for sum in [face.part, parts] {
                sums[sum].0 += color.as_dvec3();
                sums[sum].1 += 1.0;
            }
        }
    }
    let all = if sums[parts].1 > 0.0 { (sums[parts].0 / sums[parts].1).as_vec3() } else { Vec3::splat(GREY) };
    sums[..parts].iter().map(|(sum, count)| if *count > 0.0 { (*sum / *count).as_vec3() } else { all }).collect()
}

fn report(face: usize, surface: &Surface, layout: &Layout, colors: &[Option<Vec3>]) -> FaceReport {
    let of_face = &surface.faces[face];
    let area = |&t: &u32| {
        let [a, b, c] = surface.triangles[t as usize].corners;
        0.5 * (b - a).cross(c - a).length()
    };
    let texels = &layout.texels[layout.starts[face]..layout.starts[face + 1]];
    let inside = texels.iter().zip(colors).filter(|(texel, _)| texel.inside);
    let (seen, all) = inside.fold((0_u32, 0_u32), |(seen, all), (_, color)| (seen + u32::from(color.is_some()), all + 1));
    FaceReport {
        part: of_face.part,
        face: of_face.number,
        area_m2: of_face.triangles.iter().map(area).sum(),
        seen: seen as f32 / all.max(1) as f32,
        buried: layout.buried[face],
        texels_per_m: layout.per_m[face],
    }
}

/// A part's mesh with its corners in the atlas: vertices are split where faces meet, and where a shaft's side closes.
fn mesh(part: &Part, index: usize, surface: &Surface, layout: &Layout, atlas: &Arc<Texture>) -> Mesh {
    let mut mesh = Mesh::default();
    let mut known: HashMap<(u32, [u32; 5]), u32> = HashMap::new();
    let first = surface.starts[index] as usize;
    let size = Vec2::new(layout.size[0] as f32, layout.size[1] as f32);
    for (t, triangle) in part.mesh.triangles.iter().enumerate() {
        let corner = |k: usize| {
            let uv: Vec2 = layout.corners[first + t][k] / size;
            let normal = surface.triangles[first + t].normals[k];
            let bits = [uv.x, uv.y, normal.x, normal.y, normal.z].map(f32::to_bits);
            let position = part.mesh.positions[triangle[k] as usize];
            *known.entry((triangle[k], bits)).or_insert_with(|| {
                mesh.positions.push(position);
                mesh.normals.push(normal);
                mesh.uvs.push(uv);
                mesh.positions.len() as u32 - 1
            })
        };
        let corners = [0, 1, 2].map(corner);
        mesh.triangles.push(corners);
    }
    let material = Material { name: part.name.clone(), base_color_linear: Vec3::ONE, texture: Some(Arc::clone(atlas)) };
    mesh.materials = vec![material];
    mesh
}
