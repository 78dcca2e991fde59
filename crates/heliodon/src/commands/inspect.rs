//! `heliodon inspect`: what is in a file.

use crate::App;
use crate::output::{count, counted};
use anyhow::{Context, Result, bail};
use heliodon_bundle::BundleReader;
use heliodon_bundle::impostor::{Impostor, ImpostorInfo};
use heliodon_bundle::inspect::{BundleSummary, SiteSummary};
use heliodon_bundle::lineage::site_beside;
use heliodon_bundle::manifest::MANIFEST_FILE_NAME;
use heliodon_bundle::site::{SITE_FILE_NAME, Site};
use heliodon_image::ktx2::Ktx2;
use heliodon_image::texture::WRITER;
use heliodon_image::{HdrImage, SrgbImage};
use heliodon_math::color::luminance;
use heliodon_mesh::import::{ImportOptions, ImportReport, read_reporting};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Tells what is in a mesh, a sky image, a picture, a texture, an impostor, a site or a bundle.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon inspect scan.ply\n  heliodon inspect sky/0657.hdr --json\n  heliodon inspect mysite/bundle --verify\n  heliodon inspect bundles/temple --site mysite --json"
)]
pub struct Args {
    /// A mesh, an image, a texture, an impostor, a site's folder or site.toml, or a bundle's folder
    file: PathBuf,
    /// Read a bundle's files whole and compare their hashes
    #[arg(long)]
    verify: bool,
    /// Compare a bundle's inputs with the files of this site [default: the one in whose folder the bundle stands]
    #[arg(long, value_name = "DIR")]
    site: Option<PathBuf>,
}

#[derive(Serialize)]
struct MeshSummary {
    vertices: u64,
    triangles: u64,
    min: [f32; 3],
    max: [f32; 3],
    normals: bool,
    texture_coordinates: bool,
    vertex_colours: bool,
    materials: usize,
    textures: usize,
    dropped_triangles: u64,
    warnings: Vec<String>,
}

#[derive(Serialize)]
struct HdrSummary {
    width: u32,
    height: u32,
    least_luminance: f32,
    mean_luminance: f64,
    greatest_luminance: f32,
    /// Components that were no radiance and have been replaced.
    repaired: Repaired,
}

#[derive(Serialize)]
struct Repaired {
    nan: u64,
    infinite: u64,
    negative: u64,
}

#[derive(Serialize)]
struct PictureSummary {
    width: u32,
    height: u32,
    opaque: bool,
}

#[derive(Serialize)]
struct TextureSummary {
    format: String,
    width: u32,
    height: u32,
    layers: u32,
    levels: u32,
}

#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
enum Summary {
    Mesh(MeshSummary),
    SkyImage(HdrSummary),
    Picture(PictureSummary),
    Impostor(ImpostorInfo),
    Texture(TextureSummary),
    Site(SiteSummary),
    Bundle(Box<BundleSummary>),
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let summary = summarise(args)?;
    app.output.result(&summary, |summary| match summary {
        Summary::Mesh(mesh) => describe_mesh(mesh),
        Summary::SkyImage(image) => describe_hdr(image),
        Summary::Picture(picture) => {
            let alpha = if picture.opaque { "opaque" } else { "with alpha" };
            format!("{} x {} pixels of 8 bits, {alpha}", picture.width, picture.height)
        }
        Summary::Impostor(info) => describe_impostor(info),
        Summary::Texture(texture) => {
            let TextureSummary { format, width, height, levels, .. } = texture;
            format!("a texture: {format} of {width} x {height} texels, {}", counted(u64::from(*levels), "level", "levels"))
        }
        Summary::Site(site) => site.to_string(),
        Summary::Bundle(bundle) => bundle.to_string(),
    })
}

fn summarise(args: &Args) -> Result<Summary> {
    let path = &args.file;
    let is_bundle = path.join(MANIFEST_FILE_NAME).exists();
    if args.site.is_some() && !is_bundle {
        bail!(
            "{}: --site compares a bundle with its site, and this is no bundle ({MANIFEST_FILE_NAME} is not in it)",
            path.display()
        );
    }
    if path.is_dir() {
        if is_bundle {
            let bundle = BundleReader::open(path)?;
            if args.verify {
                bundle.verify()?;
            }
            let summary = BundleSummary::of(&bundle);
            let summary = match args.site.as_deref().map(site_folder).transpose()?.or_else(|| site_beside(path)) {
                Some(site) => summary.compared_with(&bundle, &site),
                None => summary,
            };
            return Ok(Summary::Bundle(Box::new(summary)));
        }
        if path.join(SITE_FILE_NAME).exists() {
            return Ok(Summary::Site(SiteSummary::of(&Site::read(path)?)?));
        }
        bail!("{}: neither a site ({SITE_FILE_NAME}) nor a bundle ({MANIFEST_FILE_NAME}) is in this folder", path.display());
    }
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    match ending.as_str() {
        "toml" => Ok(Summary::Site(SiteSummary::of(&Site::read(path)?)?)),
        "hdr" | "pic" | "exr" => Ok(Summary::SkyImage(summarise_hdr(path)?)),
        "png" | "jpg" | "jpeg" => {
            let image = SrgbImage::read(path)?;
            let opaque = image.pixels.iter().all(|pixel| pixel[3] == u8::MAX);
            Ok(Summary::Picture(PictureSummary { width: image.width, height: image.height, opaque }))
        }
        "ktx2" => {
            let name = path.display().to_string();
            let bytes = std::fs::read(path).with_context(|| format!("cannot read {name}"))?;
            if Ktx2::text_of(&bytes, "KTXwriter") == Some(WRITER) {
                let shape = Ktx2::shape_of(&bytes, &name)?;
                let ([width, height], format) = (shape.size, format!("{:?}", shape.format));
                return Ok(Summary::Texture(TextureSummary {
                    format,
                    width,
                    height,
                    layers: shape.layers,
                    levels: shape.levels,
                }));
            }
            Ok(Summary::Impostor(Impostor::info_of(&bytes, &name)?))
        }
        _ => Ok(Summary::Mesh(summarise_mesh(path)?)),
    }
}

fn describe_impostor(info: &ImpostorInfo) -> String {
    let ([width, height], views) = (info.frame_px, counted(u64::from(info.views()), "view", "views"));
    let mut text = format!(
        "{}: an impostor, {:.2} m high, {views}, frames of {width} x {height} texels, made for {} m and more\n",
        info.name,
        info.heights_m[1] - info.heights_m[0],
        info.distance_m
    );
    for ring in &info.rings {
        let around = if ring.is_closed() {
            "all around".to_owned()
        } else {
            format!("from {} to {} degrees", ring.from_deg, ring.to_deg)
        };
        let views = counted(u64::from(ring.views), "view", "views");
        text += &format!("from {} degrees above its middle: {views} {around}\n", ring.elevation_deg);
    }
    for clip in &info.clips {
        let frames = counted(u64::from(clip.frames), "frame", "frames");
        text += &format!("clip \"{}\": {frames}, {:.2} s\n", clip.name, clip.duration_s);
    }
    text
}

/// A site's folder, given it or its site.toml.
fn site_folder(path: &Path) -> Result<PathBuf> {
    let folder = if path.is_dir() { path } else { path.parent().unwrap_or(Path::new("")) };
    if !folder.join(SITE_FILE_NAME).is_file() {
        bail!("{}: no site is there ({SITE_FILE_NAME})", path.display());
    }
    Ok(folder.to_owned())
}

fn summarise_hdr(path: &Path) -> Result<HdrSummary> {
    let (image, repairs) = HdrImage::read_counted(path)?;
    let values = || image.pixels.iter().map(|&pixel| luminance(pixel));
    Ok(HdrSummary {
        width: image.width,
        height: image.height,
        least_luminance: values().fold(f32::INFINITY, f32::min),
        mean_luminance: values().map(f64::from).sum::<f64>() / image.pixels.len().max(1) as f64,
        greatest_luminance: values().fold(f32::NEG_INFINITY, f32::max),
        repaired: Repaired { nan: repairs.nan, infinite: repairs.infinite, negative: repairs.negative },
    })
}

fn describe_hdr(image: &HdrSummary) -> String {
    let mut text = format!(
        "{} x {} pixels of HDR radiance; luminance {:.4} to {:.4}, mean {:.4}\n",
        image.width, image.height, image.least_luminance, image.greatest_luminance, image.mean_luminance
    );
    let Repaired { nan, infinite, negative } = image.repaired;
    if nan + infinite + negative > 0 {
        text += &format!("warning: {nan} components are NaN, {infinite} infinite, {negative} negative; they were replaced\n");
    }
    text
}

fn summarise_mesh(path: &Path) -> Result<MeshSummary> {
    let mut report = ImportReport::default();
    let mesh = read_reporting(path, &ImportOptions::default(), &mut report)?;
    let (min, max) = mesh.bounds().unwrap_or_default();
    Ok(MeshSummary {
        vertices: mesh.positions.len() as u64,
        triangles: mesh.triangles.len() as u64,
        min: min.to_array(),
        max: max.to_array(),
        normals: !mesh.normals.is_empty(),
        texture_coordinates: !mesh.uvs.is_empty(),
        vertex_colours: !mesh.colors_linear.is_empty(),
        materials: mesh.materials.len(),
        textures: mesh.materials.iter().filter(|material| material.texture.is_some()).count(),
        dropped_triangles: report.dropped_triangles,
        warnings: report.warnings,
    })
}

fn describe_mesh(mesh: &MeshSummary) -> String {
    let size: Vec<String> = (0..3).map(|axis| format!("{:.3}", mesh.max[axis] - mesh.min[axis])).collect();
    let mut text = format!(
        "{} triangles, {} vertices, {} from {:?} to {:?}\n",
        count(mesh.triangles),
        count(mesh.vertices),
        size.join(" x "),
        mesh.min,
        mesh.max
    );
    let has = |there: bool, what: &str| if there { format!("with {what}") } else { format!("without {what}") };
    text += &format!(
        "{}, {}; {}, {} with an image\n",
        has(mesh.vertex_colours, "vertex colours"),
        has(mesh.texture_coordinates, "texture coordinates"),
        counted(mesh.materials as u64, "material", "materials"),
        mesh.textures
    );
    for warning in &mesh.warnings {
        text += &format!("warning: {warning}\n");
    }
    text
}
