//! What a light map is written as.

use super::scene::SiteScene;
use super::{Kind, Report};
use crate::files::{check_place, refuse_inputs, replace, write_whole};
use crate::values::Exposure;
use anyhow::{Context, Result};
use glam::Vec3;
use heliodon_image::ktx2::ktx2_of_bc6h;
use heliodon_image::{HdrImage, SrgbImage};
use heliodon_lightmap::solve::{self, LightMap, match_seams, nearly_brightest, shown_srgb8};
use heliodon_lightmap::texels::Texel;
use heliodon_math::color::srgb8_from_linear;
use heliodon_mesh::export::{LightTextures, UnwrappedPart, write_glb_with_second_uvs};
use std::io::Write;
use std::iter;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The report's name.
pub const REPORT: &str = "lightmap.json";
/// The parts, whose light lies beside them.
const MODEL: &str = "model.glb";
/// The parts with albedo and light in one.
const LIT: &str = "lit.glb";

/// Kinds that hold the light by itself, how their files' names end, and how a pixel becomes light; models name the first that is written.
const BESIDE: [(Kind, &str, &str); 3] =
    [(Kind::Exr, "exr", "linear"), (Kind::Ktx2, "ktx2", "linear"), (Kind::Rgbe, "rgbe.png", "rgbe8")];

/// Makes the folder and looks whether all that may be written can be, before long work is done for it; `read` are files that may not be written over.
///
/// # Errors
/// A file that would be written over, and a folder that cannot be made or written to.
pub fn make_folder(folder: &Path, kinds: &[Kind], textures: u32, read: &[PathBuf]) -> Result<()> {
    // how many of the textures it takes is not known yet
    let numbers = || iter::once(None).chain((1..=textures).filter(|_| textures > 1).map(Some));
    let beside = BESIDE.iter().filter(|(kind, ..)| kinds.contains(kind));
    let mut names: Vec<String> =
        beside.flat_map(|(_, ending, _)| numbers().map(move |number| light_name(number, ending))).collect();
    names.extend((!names.is_empty()).then(|| MODEL.to_owned()));
    names.extend(kinds.contains(&Kind::Combined).then(|| LIT.to_owned()));
    names.push(REPORT.to_owned());
    let places: Vec<PathBuf> = names.iter().map(|name| folder.join(name)).collect();
    refuse_inputs(read, places.iter().map(PathBuf::as_path))?;
    std::fs::create_dir_all(folder).with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
    places.iter().try_for_each(|place| check_place(place))
}

/// What a texture's file is called: by its number where there are several.
fn light_name(number: Option<u32>, ending: &str) -> String {
    number.map_or_else(|| format!("light.{ending}"), |number| format!("light-{number}.{ending}"))
}

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
        let parts = self.scene.parts(self.lit.unwrapped);
        let beside: Vec<(Kind, &str, &str)> = BESIDE.into_iter().filter(|(kind, ..)| kinds.contains(kind)).collect();
        let (mut written, mut stops) = (Vec::new(), None);
        for sheet in self.sheets().filter(|_| !beside.is_empty()) {
            let light = self.map.image(self.lit.texels, sheet, self.lit.sides);
            for (kind, ending, _) in &beside {
                let name = self.file_name(sheet, ending);
                self.write_light(*kind, (sheet, &light), &self.folder.join(&name))?;
                written.push(name);
            }
        }
        if kinds.contains(&Kind::Combined) {
            stops = Some(self.write_combined(&self.folder.join(LIT), &parts, exposure)?);
            written.push(LIT.to_owned());
        }
        if let Some((_, ending, encoding)) = beside.first() {
            let files: Vec<String> = self.sheets().map(|sheet| self.file_name(sheet, ending)).collect();
            write_glb_with_second_uvs(&self.folder.join(MODEL), &parts, LightTextures::Beside { files: &files, encoding })?;
            written.push(MODEL.to_owned());
        }
        Ok((written, stops))
    }

    /// The textures' numbers.
    fn sheets(&self) -> Range<u16> {
        0..self.lit.unwrapped.packing.sheets as u16
    }

    fn file_name(&self, sheet: u16, ending: &str) -> String {
        light_name((self.sheets().len() > 1).then_some(u32::from(sheet) + 1), ending)
    }

    /// Both sides of borders show the same in these files of fewer bits too.
    fn write_light(&self, kind: Kind, (sheet, light): (u16, &HdrImage), path: &Path) -> Result<()> {
        let (texels, sides) = (self.lit.texels, self.lit.sides);
        match kind {
            Kind::Exr => replace(path, |path| Ok(light.write_exr(path)?)),
            Kind::Ktx2 => {
                let bytes = ktx2_of_bc6h(light, self.map.bc6h(texels, sheet, sides), self.levels);
                write_whole(path, |file| file.write_all(&bytes))
            }
            Kind::Rgbe => {
                let bytes = self.map.rgbe8(texels, sheet, sides).to_png_bytes()?;
                write_whole(path, |file| file.write_all(&bytes))
            }
            // that light is in the model
            Kind::Combined => Ok(()),
        }
    }

    /// Albedo times light as a screen shows it; returns the exposure.
    fn write_combined(&self, path: &Path, parts: &[UnwrappedPart], exposure: Exposure) -> Result<f32> {
        let albedo = self.lit.albedo;
        let color = |(texel, light): (&Texel, &Vec3)| albedo(texel.triangle, texel.weights.y, texel.weights.z) * *light;
        let mut colors: Vec<Vec3> = self.lit.texels.iter().zip(&self.map.light).map(color).collect();
        // the sides of a border have texels at other places, and their albedo differs
        match_seams(&self.map.seams, &mut colors);
        let linear = |colors: &[Vec3]| -> Vec<HdrImage> {
            self.sheets().map(|sheet| solve::image(self.lit.texels, colors, sheet, self.lit.sides)).collect()
        };
        let stops = match exposure {
            Exposure::Stops(stops) => stops,
            Exposure::Auto => automatic(&linear(&colors)),
        };
        colors.iter_mut().for_each(|color| *color *= stops.exp2());
        let image = |shown: HdrImage| {
            let pixels = shown.pixels.iter().map(|p| [p.x, p.y, p.z].map(srgb8_from_linear)).map(|[r, g, b]| [r, g, b, 255]);
            SrgbImage { width: shown.width, height: shown.height, pixels: pixels.collect() }
        };
        let images: Vec<SrgbImage> = linear(&shown_srgb8(&self.map.seams, &colors)).into_iter().map(image).collect();
        write_glb_with_second_uvs(path, parts, LightTextures::Multiplied(&images))?;
        Ok(stops)
    }
}

/// The exposure at which nearly all of the textures is within what a screen shows.
fn automatic(images: &[HdrImage]) -> f32 {
    let all = images.iter().flat_map(|image| &image.pixels);
    let mut bright: Vec<f32> = all.map(|p| p.max_element()).filter(|x| *x > 0.0).collect();
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
