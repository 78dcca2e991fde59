//! `heliodon photo model` and `texture`: what is made from solved photographs.

use super::turns::turns;
use crate::App;
use crate::failure::wrong_arguments;
use anyhow::{Context, Result};
use heliodon_bake::photo::surroundings;
use heliodon_bake::report::Reporter;
use heliodon_image::view_layers::{MOST_LAYERS, VIEWS_FILE};
use heliodon_mesh::Mesh;
use heliodon_mesh::export::write_obj;
use heliodon_photo::formats::cameras_file::{CAMERAS_FILE_NAME, CamerasFile};
use heliodon_photo::model::{Model, ShapeReport, build};
use heliodon_photo::project::{Project, Witnesses};
use heliodon_photo::texture::{Photograph, Survey, TextureParams};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Points that are farther off their shape are named, standard deviations.
const FAR_SIGMAS: f64 = 3.0;

#[derive(Debug, clap::Args)]
pub(super) struct ModelArgs {
    /// The project's folder or its photos.toml; `photo solve` has to have written its cameras
    #[arg(value_name = "PROJECT")]
    pub(super) project: PathBuf,
    /// The folder to write to [default: `made` beside the project]
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
pub(super) struct TextureArgs {
    #[command(flatten)]
    model: ModelArgs,
    /// The largest side of the atlas, texels, 64 to 16384
    #[arg(long, value_name = "TEXELS", default_value_t = TextureParams::default().most_side)]
    side: u32,
    /// Texels for a pixel of the photograph that shows a face most finely
    #[arg(long, value_name = "X", default_value_t = TextureParams::default().oversampling)]
    oversampling: f32,
    /// Also write views.json, layers of what so many photographs saw of each face (1 to 8), for colours that depend on where one stands
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=MOST_LAYERS as i64))]
    views: Option<u8>,
}

/// What `model` and `texture` have to say.
#[derive(Serialize)]
pub(super) struct MadeReport {
    shapes: Vec<ShapeTold>,
    refused: Vec<String>,
    parts: Vec<PartTold>,
    texture: Option<TextureTold>,
    pub(super) folder: PathBuf,
}

#[derive(Serialize)]
struct ShapeTold {
    name: String,
    /// What it is, its value and standard deviation.
    measures: Vec<(&'static str, f64, f64)>,
    /// The root of the mean squared distance of its points, metres.
    rms_m: f64,
    /// Points that do not fit, and by how many metres.
    far: Vec<(String, f64)>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct PartTold {
    name: String,
    file: String,
    triangles: usize,
    open_edges: usize,
    watertight_asked: bool,
}

#[derive(Serialize)]
struct TextureTold {
    size: [u32; 2],
    seen: f32,
    utilisation: f32,
    /// How much brighter each photograph is than the mean, for red, green and blue.
    gains: Vec<(String, [f32; 3])>,
    /// Layers of what single photographs saw.
    views: usize,
    warnings: Vec<String>,
}

pub(super) fn run_model(app: &App, args: &ModelArgs) -> Result<()> {
    let (project, witnesses) = solved(&args.project)?;
    let (model, folder) = modelled(args, &project, &witnesses)?;
    let meshes: Vec<&Mesh> = model.parts.iter().map(|part| &part.mesh).collect();
    let report = MadeReport { texture: None, ..written(&model, &meshes, folder)? };
    app.output.result(&report, describe)
}

pub(super) fn run_texture(app: &App, args: &TextureArgs) -> Result<()> {
    let (project, witnesses) = solved(&args.model.project)?;
    let (model, folder) = modelled(&args.model, &project, &witnesses)?;
    let files = turns(app, &project, &witnesses.files);
    let photographs: Vec<Photograph> = (witnesses.photographs.iter().zip(&files))
        .map(|((name, camera), file)| Photograph { name, camera: *camera, picture: file })
        .collect();
    app.progress.stage("photographs", photographs.len() as u64);
    let params = TextureParams { most_side: args.side, oversampling: args.oversampling, ..TextureParams::default() };
    let around = surroundings(&project)?;
    let occluders: Vec<&Mesh> = around.iter().collect();
    let mut survey = Survey::new(&model.parts, &occluders, &photographs, &params)?;
    app.progress.finished();
    app.progress.stage("blending", 0);
    let gains = survey.equalize();
    let textured = survey.painted(&survey.blended(), gains);
    let meshes: Vec<&Mesh> = textured.meshes.iter().collect();
    let report = written(&model, &meshes, folder)?;
    let image = &textured.atlas.image;
    image.write_png(report.folder.join("atlas.png"))?;
    textured.evidence.image().write_png(report.folder.join("evidence.png"))?;
    let mut views = 0;
    if let Some(most) = args.views {
        let layers = survey.view_layers(most.into());
        layers.write(&report.folder)?;
        views = layers.layers.len();
    } else {
        // those of an earlier atlas fit this one no more
        let old = report.folder.join(VIEWS_FILE);
        if old.is_file() {
            std::fs::remove_file(&old).with_context(|| format!("cannot remove {}, which fits no more", old.display()))?;
        }
    }
    app.progress.finished();
    let told = TextureTold {
        size: [image.width, image.height],
        seen: textured.seen,
        utilisation: textured.utilisation,
        gains: textured.gains.iter().map(|gain| (gain.photograph.clone(), gain.gain.to_array())).collect(),
        views,
        warnings: textured.warnings,
    };
    app.output.result(&MadeReport { texture: Some(told), ..report }, describe)
}

pub(super) fn solved(project: &Path) -> Result<(Project, Witnesses)> {
    let project = Project::read(project)?;
    let path = project.folder().join(CAMERAS_FILE_NAME);
    let text = std::fs::read_to_string(&path)
        .with_context(|| format!("cannot read {}: run `heliodon photo solve` first", path.display()))?;
    let cameras = CamerasFile::parse(&text).map_err(anyhow::Error::msg).with_context(|| path.display().to_string())?;
    let witnesses = project.witnesses(&cameras);
    Ok((project, witnesses))
}

/// The model, and the folder to write to.
pub(super) fn modelled(args: &ModelArgs, project: &Project, witnesses: &Witnesses) -> Result<(Model, PathBuf)> {
    if project.file.shape.is_empty() {
        wrong_arguments!("{} has no shapes: add [[shape]] with kind = \"box\", \"column\" or another", args.project.display());
    }
    let model = build(&project.file.shape, &witnesses.points, &witnesses.photographs);
    if model.parts.is_empty() {
        let why: Vec<String> = model.refused.iter().map(ToString::to_string).collect();
        anyhow::bail!("no shape could be made: {}", why.join("; "));
    }
    Ok((model, args.output.clone().unwrap_or_else(|| project.folder().join("made"))))
}

/// Lists the meshes that were written into a folder, so that those of parts that are no more can go.
const PARTS_FILE: &str = ".parts";

/// Takes away meshes that were written into a folder before and were not now.
fn remove_old(folder: &Path, parts: &[PartTold]) -> Result<()> {
    let list = folder.join(PARTS_FILE);
    let before = std::fs::read_to_string(&list).unwrap_or_default();
    for name in before.lines().filter(|name| parts.iter().all(|part| part.file != **name) && !name.contains(['/', '\\'])) {
        let old = folder.join(name);
        if name.ends_with(".obj") && old.is_file() {
            std::fs::remove_file(&old).with_context(|| format!("cannot remove {}, whose part is no more", old.display()))?;
        }
    }
    let names: String = parts.iter().map(|part| format!("{}\n", part.file)).collect();
    std::fs::write(&list, names).with_context(|| format!("cannot write {}", list.display()))
}

/// Writes the parts' meshes.
pub(super) fn written(model: &Model, meshes: &[&Mesh], folder: PathBuf) -> Result<MadeReport> {
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let mut parts: Vec<PartTold> = Vec::new();
    for (part, mesh) in model.parts.iter().zip(meshes) {
        let plain = part.name.replace(|c: char| !c.is_alphanumeric(), "-");
        let taken = |file: &String| parts.iter().any(|told| told.file.eq_ignore_ascii_case(file));
        let names = std::iter::once(format!("{plain}.obj")).chain((2..).map(|n| format!("{plain}-{n}.obj")));
        let Some(file) = names.into_iter().find(|file| !taken(file)) else { continue };
        write_obj(&folder.join(&file), mesh)?;
        parts.push(PartTold {
            name: part.name.clone(),
            file,
            triangles: mesh.triangles.len(),
            open_edges: part.open_edges,
            watertight_asked: part.watertight,
        });
    }
    remove_old(&folder, &parts)?;
    let refused = model.refused.iter().map(ToString::to_string).collect();
    Ok(MadeReport { shapes: model.shapes.iter().map(told).collect(), refused, parts, texture: None, folder })
}

fn told(shape: &ShapeReport) -> ShapeTold {
    let squares: f64 = shape.points.iter().map(|point| point.off_m * point.off_m).sum();
    ShapeTold {
        name: shape.shape.clone(),
        measures: shape.measures.iter().map(|measure| (measure.name, measure.value, measure.sigma)).collect(),
        rms_m: (squares / shape.points.len().max(1) as f64).sqrt(),
        far: (shape.points.iter().filter(|point| point.sigmas > FAR_SIGMAS))
            .map(|point| (point.point.clone(), point.off_m))
            .collect(),
        notes: shape.notes.clone(),
    }
}

/// A standard deviation after its number; of what nothing tells it, nothing.
fn spread(sigma: f64) -> String {
    if sigma.is_finite() { format!(" +- {sigma:.3}") } else { String::new() }
}

fn describe(report: &MadeReport) -> String {
    let mut text = String::new();
    for shape in &report.shapes {
        let sizes: Vec<String> =
            shape.measures.iter().map(|(name, value, sigma)| format!("{name} {value:.3}{}", spread(*sigma))).collect();
        text += &format!("{}: {}; points {:.3} m off (rms)\n", shape.name, sizes.join(", "), shape.rms_m);
        for (point, off_m) in &shape.far {
            text += &format!("  {point} does not fit: {off_m:.3} m off\n");
        }
        shape.notes.iter().for_each(|note| text += &format!("  {note}\n"));
    }
    for why in &report.refused {
        text += &format!("left out: {why}\n");
    }
    for part in &report.parts {
        text += &format!("{}: {} triangles in {}\n", part.name, part.triangles, part.file);
        if part.watertight_asked && part.open_edges > 0 {
            text += &format!("  was to be watertight, and has {} open edges\n", part.open_edges);
        }
    }
    if let Some(texture) = &report.texture {
        let [width, height] = texture.size;
        text += &format!("atlas.png: {width} x {height}, {:.0} % used\n", 100.0 * texture.utilisation);
        text += &format!("evidence.png: a photograph saw {:.0} % of the surface, the rest is guessed\n", 100.0 * texture.seen);
        if texture.views > 0 {
            text += &format!("{VIEWS_FILE}: {} layers of what single photographs saw\n", texture.views);
        }
        for (photo, gain) in &texture.gains {
            let stops: Vec<String> = gain.iter().map(|gain| format!("{:+.2}", gain.log2())).collect();
            text += &format!("  {photo}: {} stops (red, green, blue)\n", stops.join(" "));
        }
        texture.warnings.iter().for_each(|warning| text += &format!("  {warning}\n"));
    }
    text += &format!("written to {}\n", report.folder.display());
    text
}
