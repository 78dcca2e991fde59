//! What a light map is written as.

use super::scene::SiteScene;
use super::{Kind, Report};
use crate::files::{replace, write_whole};
use crate::values::Exposure;
use anyhow::{Context, Result};
use glam::Vec3;
use heliodon_image::ktx2::ktx2_bc6h;
use heliodon_image::{HdrImage, SrgbImage, rgbe8};
use heliodon_lightmap::solve::{self, LightMap, match_seams, nearly_brightest};
use heliodon_lightmap::texels::Texel;
use heliodon_math::color::srgb8_from_linear;
use heliodon_mesh::Mesh;
use heliodon_mesh::export::{LightTextures, WithSecondUvs, write_glb_with_second_uvs};
use std::io::Write;
use std::path::Path;

/// The report's name.
pub const REPORT: &str = "lightmap.json";

/// All that is written from.
pub struct Output<'a> {
    pub folder: &'a Path,
    pub scene: &'a SiteScene,
    /// What was lit.
    pub lit: &'a solve::Scene<'a>,
    pub map: &'a LightMap,
    /// Levels of a texture with smaller versions.
    pub levels: u32,
}

impl Output<'_> {
    /// Writes what was asked for; returns the files' names, and the exposure that was multiplied in.
    ///
    /// # Errors
    /// What cannot be written.
    pub fn write(&self, kinds: &[Kind], exposure: Exposure) -> Result<(Vec<String>, Option<f32>)> {
        std::fs::create_dir_all(self.folder)
            .with_context(|| format!("{}: the folder cannot be made", self.folder.display()))?;
        let light = self.map.image(self.lit.texels, 0, self.lit.sides);
        let mesh = self.mesh();
        let (mut written, mut beside, mut stops) = (Vec::new(), None, None);
        for kind in [Kind::Exr, Kind::Ktx2, Kind::Rgbe, Kind::Combined].into_iter().filter(|kind| kinds.contains(kind)) {
            let (name, encoding) = match kind {
                Kind::Exr => ("light.exr", "linear"),
                Kind::Ktx2 => ("light.ktx2", "linear"),
                Kind::Rgbe => ("light.rgbe.png", "rgbe8"),
                Kind::Combined => ("lit.glb", "sRGB"),
            };
            let path = self.folder.join(name);
            match kind {
                Kind::Exr => replace(&path, |path| Ok(light.write_exr(path)?))?,
                Kind::Ktx2 => write_whole(&path, |file| file.write_all(&ktx2_bc6h(&light, self.levels)))?,
                Kind::Rgbe => {
                    let bytes = rgbe8(&light).to_png_bytes()?;
                    write_whole(&path, |file| file.write_all(&bytes))?;
                }
                Kind::Combined => stops = Some(self.write_combined(&path, &mesh, exposure)?),
            }
            if kind != Kind::Combined && beside.is_none() {
                beside = Some((name.to_owned(), encoding));
            }
            written.push(name.to_owned());
        }
        if let Some((file, encoding)) = beside {
            let files = [file];
            let model = self.model(&mesh, LightTextures::Beside { files: &files, encoding });
            write_glb_with_second_uvs(&self.folder.join("model.glb"), &model)?;
            written.push("model.glb".to_owned());
        }
        Ok((written, stops))
    }

    /// The parts that have texels, vertices split where charts meet.
    fn mesh(&self) -> Mesh {
        let mesh = &self.scene.mesh;
        let original = &self.lit.unwrapped.original_vertex;
        fn of<T: Copy>(all: &[T], original: &[u32]) -> Vec<T> {
            if all.is_empty() { Vec::new() } else { original.iter().map(|&v| all[v as usize]).collect() }
        }
        let triangles = self.lit.unwrapped.triangles.len();
        Mesh {
            positions: of(&mesh.positions, original),
            normals: of(&mesh.normals, original),
            uvs: of(&mesh.uvs, original),
            colors_linear: of(&mesh.colors_linear, original),
            triangles: self.lit.unwrapped.triangles.clone(),
            triangle_material: mesh.triangle_material.get(..triangles).unwrap_or(&[]).to_vec(),
            materials: mesh.materials.clone(),
        }
    }

    fn model<'a>(&'a self, mesh: &'a Mesh, light: LightTextures<'a>) -> WithSecondUvs<'a> {
        WithSecondUvs { mesh, second_uvs: &self.lit.unwrapped.uvs, sheet: &self.lit.unwrapped.sheet, light }
    }

    /// Albedo times light as a screen shows it; returns the exposure.
    fn write_combined(&self, path: &Path, mesh: &Mesh, exposure: Exposure) -> Result<f32> {
        let albedo = self.lit.albedo;
        let color = |(texel, light): (&Texel, &Vec3)| albedo(texel.triangle, texel.weights.y, texel.weights.z) * *light;
        let mut colors: Vec<Vec3> = self.lit.texels.iter().zip(&self.map.light).map(color).collect();
        // the sides of a border have texels at other places, and their albedo differs
        match_seams(&self.map.seams, &mut colors);
        let shown = solve::image(self.lit.texels, &colors, 0, self.lit.sides);
        let stops = match exposure {
            Exposure::Stops(stops) => stops,
            Exposure::Auto => automatic(&shown),
        };
        let scale = stops.exp2();
        let code = |x: f32| srgb8_from_linear(x * scale);
        let pixels = shown.pixels.iter().map(|p| [code(p.x), code(p.y), code(p.z), 255]).collect();
        let image = SrgbImage { width: shown.width, height: shown.height, pixels };
        write_glb_with_second_uvs(path, &self.model(mesh, LightTextures::Multiplied(&[image])))?;
        Ok(stops)
    }
}

/// The exposure at which nearly all of an image is within what a screen shows.
fn automatic(image: &HdrImage) -> f32 {
    let mut bright: Vec<f32> = image.pixels.iter().map(|p| p.max_element()).filter(|x| *x > 0.0).collect();
    if bright.is_empty() { 0.0 } else { -libm::log2f(nearly_brightest(&mut bright)) }
}

/// Writes the report beside it all.
///
/// # Errors
/// Where it cannot be written.
pub fn report(folder: &Path, report: &Report) -> Result<()> {
    let bytes = serde_json::to_vec_pretty(report).context("the report cannot be written as JSON")?;
    write_whole(&folder.join(REPORT), |file| file.write_all(&bytes))
}
