//! The details of a site's parts, and what single photographs saw of them: read and generated before the light is solved, for what is wrong with them
//! should be known then.

use crate::error::BakeError;
use crate::report::Reporter;
use crate::scene::Scene;
use glam::Mat3;
use heliodon_bundle::detail::{DetailFault, import};
use heliodon_bundle::site::{Detail, DetailMapping, InputFile, InputKind, Site};
use heliodon_bundle::{BundleWriter, ConfigError};
use heliodon_image::SrgbImage;
use heliodon_image::detail::{DetailError, DetailImport, DetailTexture};
use heliodon_image::view_layers::ViewLayers;
use heliodon_mesh::Material;
use std::collections::BTreeSet;
use std::path::PathBuf;

/// Names of materials that a warning lists at most.
const MOST_NAMES_TOLD: usize = 8;

/// The detail textures of a site's parts that have one, and the files of views.
#[derive(Debug, Default)]
pub(crate) struct Details {
    of_parts: Vec<PartDetail>,
    views: Vec<PartViews>,
}

/// A detail of a part.
#[derive(Debug)]
struct PartDetail {
    part: usize,
    /// Which of the part's.
    number: usize,
    texture: DetailTexture,
}

/// The views of a part. They are large, and read again when they are written.
#[derive(Debug)]
struct PartViews {
    part: usize,
    file: PathBuf,
    /// The linear part of the map that places the part.
    linear: Mat3,
}

impl PartViews {
    fn read(&self, site: &Site) -> Result<ViewLayers, ConfigError> {
        ViewLayers::read(&self.file).map_err(|error| {
            let remedy = "`heliodon photo texture --views 4` writes them beside the atlas";
            site.error_at(&["part", &self.part.to_string(), "views"], error.to_string(), remedy)
        })
    }
}

impl Details {
    /// Reads images and generates what is built in.
    ///
    /// # Errors
    /// An image that cannot serve, with its place in `site.toml` and a remedy.
    pub fn read(site: &Site, files: &[InputFile], reporter: &dyn Reporter) -> Result<Self, BakeError> {
        let mut of_parts = Vec::new();
        let all = site
            .parts
            .iter()
            .enumerate()
            .flat_map(|(part, of)| (0..).zip(&of.detail).map(move |(k, detail)| (part, k, detail)));
        for (part, number, detail) in all {
            let fault = |fault: &DetailFault| {
                let (message, remedy) = told(fault);
                site.error_at(&["part", &part.to_string(), "detail", &number.to_string(), "file"], message, remedy)
            };
            let texture = match detail.generated() {
                Some(params) => DetailTexture::generate(&params).map_err(|error| fault(&error.into()))?,
                None => {
                    let Some(file) = files.iter().find(|file| file.kind == InputKind::Detail(part, number)) else { continue };
                    let how = if detail.correct { DetailImport::corrected() } else { DetailImport::strict() };
                    let image = SrgbImage::read(&file.path).map_err(|error| fault(&DetailError::from(error).into()))?;
                    let (texture, doubts) = import(&image, &file.name, how).map_err(|error| fault(&error))?;
                    doubts.iter().for_each(|doubt| reporter.warning(doubt));
                    texture
                }
            };
            of_parts.push(PartDetail { part, number, texture });
        }
        Ok(Self { of_parts, views: part_views(site, files)? })
    }

    /// Sentences of parts whose details go by texture coordinates that some of their faces have not, or by names of materials that there are not.
    pub fn doubts(&self, site: &Site, scene: &Scene) -> Vec<String> {
        let mesh = &scene.mesh;
        let material = |triangle: usize| mesh.triangle_material.get(triangle).map_or(0, |&material| usize::from(material));
        let is_bare = |material: usize| mesh.materials.get(material).is_none_or(|material| material.texture.is_none());
        let mut doubts = Vec::new();
        for PartDetail { part, number, .. } in &self.of_parts {
            let (of_site, range) = (&site.parts[*part], scene.parts[*part].drawn_triangles());
            let (name, detail) = (of_site.display_name(), &of_site.detail[*number]);
            let kinds = material_kinds(&of_site.detail, &mesh.materials);
            // kind 0 is none
            let is_of = |triangle: &usize| kinds.get(material(*triangle)).is_none_or(|&kind| kind as usize == number + 1);
            if let Some(pattern) = detail.material.as_ref().filter(|_| !range.clone().any(|triangle| is_of(&triangle))) {
                let names: BTreeSet<&str> = range
                    .clone()
                    .filter_map(|triangle| mesh.materials.get(material(triangle)))
                    .map(|material| material.name.as_str())
                    .filter(|name| !name.is_empty())
                    .collect();
                let has = if names.is_empty() {
                    "none with a name".to_owned()
                } else {
                    let more = names.len().saturating_sub(MOST_NAMES_TOLD);
                    let told = names.into_iter().take(MOST_NAMES_TOLD).collect::<Vec<_>>().join(", ");
                    if more > 0 { format!("{told} and {more} more") } else { told }
                };
                doubts.push(format!("part {name}: no material `{pattern}` of its detail is left for it; there are: {has}"));
            }
            if detail.mapping == DetailMapping::Uv {
                let (own, bare) = range.filter(is_of).fold((0_usize, 0_usize), |(own, bare), triangle| {
                    (own + 1, bare + usize::from(is_bare(material(triangle))))
                });
                if bare > 0 {
                    doubts.push(format!(
                        "part {name}: {bare} of {own} triangles have no texture, whose coordinates its detail goes by: they show none; write mapping = \"triplanar\""
                    ));
                }
            }
        }
        doubts
    }

    /// Puts them into a bundle, views with the directions that they have where their parts stand.
    ///
    /// # Errors
    /// As [`BundleWriter::add_detail`] and [`BundleWriter::add_views`], and views that cannot be read any more.
    pub fn write(&self, site: &Site, writer: &mut BundleWriter) -> Result<(), BakeError> {
        for PartDetail { part, number, texture } in &self.of_parts {
            match &site.parts[*part].detail[..] {
                [one] if one.material.is_none() => writer.add_detail(*part, texture, one)?,
                several => writer.add_material_detail(*part, texture, &several[*number])?,
            }
        }
        for views in &self.views {
            writer.add_views(views.part, &views.read(site)?.placed(views.linear))?;
        }
        Ok(())
    }
}

/// Which of a part's details each material has: 0 none, else one more than its index. Empty where all of the part has the same, which needs no telling apart.
#[must_use]
pub fn material_kinds(details: &[Detail], materials: &[Material]) -> Vec<u32> {
    if details.iter().all(|detail| detail.material.is_none()) {
        return Vec::new();
    }
    let of = |name: &str| details.iter().position(|detail| detail.is_for(name)).map_or(0, |index| index as u32 + 1);
    // a mesh without materials is all of one without a name
    if materials.is_empty() { vec![of("")] } else { materials.iter().map(|material| of(&material.name)).collect() }
}

/// Looks at the views of all parts that have some.
fn part_views(site: &Site, files: &[InputFile]) -> Result<Vec<PartViews>, BakeError> {
    let mut views = Vec::new();
    for file in files {
        let InputKind::Views(part) = file.kind else { continue };
        let placed = site.parts[part].placement(site.site.origin).affine();
        let linear = placed.map_or(Mat3::IDENTITY, |affine| affine.linear().as_mat3());
        let own = PartViews { part, file: file.path.clone(), linear };
        drop(own.read(site)?);
        views.push(own);
    }
    Ok(views)
}

/// What is wrong, and what to do about it in `site.toml`.
fn told(fault: &DetailFault) -> (String, &'static str) {
    match fault {
        DetailFault::Image(DetailError::Mean { name, mean }) => (
            format!("{name}: its mean is {mean:.2}, not 128: surfaces would change their brightness where it fades in"),
            "add correct = true, which shifts it, or shift its brightness",
        ),
        other => (
            other.to_string(),
            "`heliodon detail IMAGE` tells what is wrong with an image, `heliodon detail stone -o stone.png` makes one",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Silent;
    use std::path::Path;

    fn read(folder: &Path, detail: &str) -> Result<Details, BakeError> {
        let text = format!(
            "[site]\nname = \"a\"\n[[part]]\nfile = \"a.ply\"\ndetail = {detail}\n[sky]\nprobes = \"a.hdr\"\nmapping = \"angular\"\n"
        );
        let site = Site::parse(&text, folder.join("site.toml")).unwrap();
        let files = site.input_files().unwrap();
        Details::read(&site, &files, &Silent)
    }

    #[test]
    fn an_image_that_cannot_serve_is_told_before_the_light_is_solved() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.ply", "a.hdr"] {
            std::fs::write(folder.path().join(name), "x").unwrap();
        }
        let save = |side: u32, of: &dyn Fn(u32) -> [u8; 4]| {
            let image = SrgbImage { width: side, height: side, pixels: (0..side * side).map(of).collect() };
            std::fs::write(folder.path().join("d.png"), image.to_png_bytes().unwrap()).unwrap();
        };
        let file = "{ file = \"d.png\" }";
        let told = |detail: &str| read(folder.path(), detail).unwrap_err().to_string();
        save(64, &|i| [[90, 90, 90, 255], [130, 130, 130, 255]][i as usize % 2]);
        let dark = told(file);
        assert!(dark.contains("its mean is 110.00, not 128") && dark.contains("correct = true"), "{dark}");
        assert!(dark.contains("site.toml:5:"), "{dark}");
        let corrected = read(folder.path(), "{ file = \"d.png\", correct = true }").unwrap();
        corrected.of_parts[0].texture.validate().unwrap();
        save(64, &|i| [[128, 90, 90, 255], [128, 166, 166, 255]][i as usize % 2]);
        assert!(told(file).contains("save it as a grey image"));
        save(32, &|i| [[90, 90, 90, 255], [166, 166, 166, 255]][i as usize % 2]);
        assert!(told(file).contains("64, 128, 256 or 512") && told(file).contains("`heliodon detail stone -o stone.png`"));
        std::fs::write(folder.path().join("d.png"), "no image").unwrap();
        assert!(told(file).contains("d.png"));
        assert_eq!(read(folder.path(), "{ kind = \"wood\", texels = 64 }").unwrap().of_parts[0].texture.width(), 64);
    }
}
