//! `heliodon impostor`: a model captured from many sides.

#[cfg(feature = "viewer")]
mod preview;

use crate::App;
use crate::failure::wrong_arguments;
use crate::files;
use crate::output::{bytes, count};
use crate::values::{self, Size};
use anyhow::{Result, bail};
use heliodon_bake::report::Reporter;
use heliodon_bundle::impostor::{IMPOSTOR_ENDING, Impostor, ImpostorInfo, Ring};
use heliodon_capture::impostor::{CaptureParams, Framing, capture, plan};
use heliodon_image::SrgbImage;
use heliodon_math::color::srgb8_from_linear;
use heliodon_mesh::import::{ImportOptions, ImportReport};
use heliodon_mesh::motion::{MovingMesh, read_cached, read_moving};
use heliodon_mesh::place::Placement;
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Captures a model from many sides into a billboard that is lit by the hour and turns as it is walked around: for people among many.
///
/// Any mesh is taken, still, skinned, morphed or with a vertex cache, of any format that a site takes; origin between its feet, front towards +Z. Views lie on rings of
/// equal elevation, which --ring names: as many views each as it will be looked at from there, none where nobody looks from. Its frames are as small as
/// they can be for the distance that it is made for, or as --size says. In a site it is an actor, or many of them as a crowd: docs/people.md.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon impostor walker.glb --clip walk --distance 8\n  heliodon impostor walker.glb --clip walk --ring 5:24 --ring 40:8 --sheet walker.png\n  heliodon impostor guard.glb --ring 0:9:-60:60 --size 128x256 --json"
)]
pub struct Args {
    /// The model
    model: PathBuf,
    /// The file to write [default: the model's name with .impostor.ktx2]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Views from an elevation, as ELEVATION:VIEWS, or ELEVATION:VIEWS:FROM:TO for a part of the round; degrees, 0 before the model, 90 at its left hand [default:
    /// -8:12, 8:16 and 30:12]
    #[arg(long = "ring", value_name = "RING", value_parser = ring, allow_hyphen_values = true)]
    rings: Vec<Ring>,
    /// Few views and samples, to try things out
    #[arg(long)]
    draft: bool,
    /// Metres from which it will be looked at: there a texel is as large as a pixel
    #[arg(long, value_name = "M", default_value = "10", value_parser = |text: &str| values::within(text, 0.1, 10_000.0))]
    distance: f64,
    /// Pixels and vertical opening angle of the display that it is made for, as 1024x768@50
    #[arg(long, value_name = "SIZE@DEG", default_value = "1024x768@50", value_parser = screen)]
    screen: f32,
    /// Texels of a frame, multiples of 16 [default: as many as pixels at the distance]
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    size: Option<Size>,
    /// Place the model in its frames in a window, step through views and frames, and capture it then
    #[cfg(feature = "viewer")]
    #[arg(long)]
    preview: bool,
    /// How much larger than fitted the model is in its frames, as --preview tells it
    #[arg(long, value_name = "X", default_value = "1", value_parser = |text: &str| values::within(text, 0.05, 8.0))]
    zoom: f64,
    /// How far it is moved to the right and up, in parts of a frame, as --preview tells it
    #[arg(long, value_name = "X,Y", default_value = "0,0", value_parser = shift, allow_hyphen_values = true)]
    shift: [f32; 2],
    /// A clip that it shall perform; again for more [default: all]
    #[arg(long = "clip", value_name = "NAME")]
    clips: Vec<String>,
    /// A vertex cache (PC2) that moves the mesh
    #[arg(long, value_name = "PC2")]
    cache: Option<PathBuf>,
    /// Frames of a second [default: 20]
    #[arg(long, value_parser = |text: &str| values::within(text, 0.1, 120.0))]
    fps: Option<f64>,
    /// Samples along each side of a texel, 1 to 8 [default: 4]
    #[arg(long, value_name = "N")]
    samples: Option<u32>,
    /// Multiplies the model's size
    #[arg(long, value_name = "X", default_value = "1", value_parser = |text: &str| values::within(text, 1e-6, 1e6))]
    scale: f64,
    /// Turns the model about +Y, counter-clockwise seen from above, degrees
    #[arg(long, value_name = "DEG", default_value = "0", allow_hyphen_values = true, value_parser = |text: &str| values::within(text, -360.0, 360.0))]
    turn: f64,
    /// Draw some frames of all views over several backgrounds
    #[arg(long, value_name = "PNG")]
    sheet: Option<PathBuf>,
    /// Tell what it will be, and capture nothing
    #[arg(long)]
    estimate: bool,
}

#[derive(Serialize)]
struct ImpostorReport {
    model: PathBuf,
    file: Option<PathBuf>,
    views: u32,
    frames: u32,
    frame_px: [u32; 2],
    layer_px: [u32; 2],
    /// Of a device's memory.
    texture_bytes: u64,
    file_bytes: Option<u64>,
    /// The part of all frames' texels that the model's surroundings leave to it.
    used: Option<f32>,
    distance_m: f32,
    height_m: f32,
    clips: Vec<ClipReport>,
}

#[derive(Serialize)]
struct ClipReport {
    name: String,
    frames: u32,
    duration_s: f32,
}

/// `30:12` or `0:9:-60:60`.
fn ring(text: &str) -> Result<Ring, String> {
    let parts: Vec<&str> = text.split(':').collect();
    let number = |part: &str, low: f64, high: f64| values::within(part, low, high).map(|v| v as f32);
    let views = |part: &str| part.parse::<u32>().map_err(|_| format!("`{part}` is no number of views"));
    match parts[..] {
        [elevation, count] => Ok(Ring::around(number(elevation, -90.0, 90.0)?, views(count)?)),
        [elevation, count, from, to] => Ok(Ring {
            elevation_deg: number(elevation, -90.0, 90.0)?,
            views: views(count)?,
            from_deg: number(from, -360.0, 360.0)?,
            to_deg: number(to, -360.0, 720.0)?,
        }),
        _ => Err("a ring is ELEVATION:VIEWS or ELEVATION:VIEWS:FROM:TO, as 30:12".to_owned()),
    }
}

/// `0.1,-0.05`.
fn shift(text: &str) -> Result<[f32; 2], String> {
    let (x, y) = text.split_once(',').ok_or("a shift is X,Y, as 0.1,-0.05")?;
    let part = |text: &str| values::within(text.trim(), -1.0, 1.0).map(|v| v as f32);
    Ok([part(x)?, part(y)?])
}

/// Pixels of a radian in the middle of `1024x768@50`.
fn screen(text: &str) -> Result<f32, String> {
    let (size, fov) = text.split_once('@').ok_or("a display is its size and its vertical angle, as 1024x768@50")?;
    let (size, fov_deg) = (values::size(size)?, values::fov_deg(fov)?);
    Ok(size.height as f32 * 0.5 / (0.5 * fov_deg).to_radians().tan())
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let output = args.output.clone().unwrap_or_else(|| PathBuf::from(stem(&args.model) + IMPOSTOR_ENDING));
    refuse_places(args, &output)?;
    let model = read(app, args)?;
    let params = params(args, &model)?;
    let name = stem(&args.model);
    if args.estimate {
        let plan = plan(&model, &name, &params)?;
        return app.output.result(&report(args, &plan.info, plan.bytes), describe);
    }
    #[cfg(feature = "viewer")]
    let (model, params) = if args.preview {
        let Some((model, params)) = preview::place(model, &name, params)? else { bail!("given up; nothing was captured") };
        let Framing { zoom, shift: [x, y] } = params.framing;
        app.progress.note(&format!("again without the window: --zoom {zoom} --shift {x},{y}"));
        (model, params)
    } else {
        (model, params)
    };
    app.progress.stage("capturing", 1000);
    let captured = capture(&model, &name, &params, &|part| app.progress.progress((part * 1000.0) as u64));
    app.progress.finished();
    let impostor = captured?;
    let encoded = impostor.to_bytes(&output.display().to_string())?;
    // both are made before either is written
    let sheet = args.sheet.as_ref().map(|_| sheet(&impostor).to_png_bytes()).transpose()?;
    files::write_whole(&output, |file| file.write_all(&encoded))?;
    if let (Some(path), Some(sheet)) = (&args.sheet, sheet) {
        files::write_whole(path, |file| file.write_all(&sheet))?;
    }
    let texture = &impostor.texture;
    let texture_bytes = (0..texture.levels.len()).map(|level| texture.level_bytes(level)).sum();
    let mut report = report(args, &impostor.info, texture_bytes);
    (report.file, report.file_bytes, report.used) = (Some(output), Some(encoded.len() as u64), Some(used(&impostor)));
    app.output.result(&report, describe)
}

fn stem(model: &Path) -> String {
    model.file_stem().map_or_else(|| "impostor".to_owned(), |stem| stem.to_string_lossy().into_owned())
}

/// Looks whether everything can be written, and whether nothing of anybody's is written over.
fn refuse_places(args: &Args, output: &Path) -> Result<()> {
    if !output.to_string_lossy().ends_with(IMPOSTOR_ENDING) {
        wrong_arguments!("{}: give it a name that ends in {IMPOSTOR_ENDING}", output.display());
    }
    if let Some(sheet) = &args.sheet
        && !sheet.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png"))
    {
        wrong_arguments!("{}: the sheet is written as PNG; give a name that ends in .png", sheet.display());
    }
    for path in [output].into_iter().chain(args.sheet.as_deref()) {
        files::check_place(path)?;
        if files::is_within(&args.model, path) {
            bail!("{} would be written over, and it is read here; name another place", args.model.display());
        }
    }
    let ours = |path: &Path| std::fs::read(path).is_ok_and(|bytes| Impostor::info_of(&bytes, "it").is_ok());
    if !args.estimate && output.exists() && !ours(output) {
        bail!("{} exists, and is no impostor; move it away, or name another place with -o", output.display());
    }
    Ok(())
}

fn read(app: &App, args: &Args) -> Result<MovingMesh> {
    let placement = Placement { scale: [args.scale; 3], rotate_deg: [0.0, args.turn, 0.0], ..Placement::default() };
    let options = ImportOptions { placement, ..ImportOptions::default() };
    let mut report = ImportReport::default();
    let model = match &args.cache {
        Some(cache) => read_cached(&args.model, cache, &options, &mut report)?,
        None => read_moving(&args.model, &options, &mut report)?,
    };
    report.warnings.iter().for_each(|warning| app.progress.warning(warning));
    if model.clips().is_empty() {
        app.progress.note(&format!("{}: it has no animation; it is captured at rest", args.model.display()));
    }
    Ok(model)
}

fn params(args: &Args, model: &MovingMesh) -> Result<CaptureParams> {
    let mut params = if args.draft { CaptureParams::preview() } else { CaptureParams::crowd() };
    if !args.rings.is_empty() {
        params.rings = args.rings.clone();
        params.rings.sort_by(|a, b| a.elevation_deg.total_cmp(&b.elevation_deg));
        if params.rings.windows(2).any(|pair| pair[0].elevation_deg == pair[1].elevation_deg) {
            wrong_arguments!("two rings have the same elevation; give all views of one elevation as one ring");
        }
    }
    params.frame_px = args.size.map(|size| [size.width, size.height]);
    params.framing = Framing { zoom: args.zoom as f32, shift: args.shift };
    (params.distance_m, params.px_per_radian) = (args.distance as f32, args.screen);
    params.frames_per_s = args.fps.map_or(params.frames_per_s, |fps| fps as f32);
    params.samples = args.samples.unwrap_or(params.samples);
    for name in &args.clips {
        let Some(clip) = model.clip_named(name) else {
            let known: Vec<&str> = model.clips().iter().map(|clip| clip.name.as_str()).collect();
            let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            bail!("{} has no clip `{name}`; it has {known}", args.model.display());
        };
        params.clips.push(clip);
    }
    Ok(params)
}

fn report(args: &Args, info: &ImpostorInfo, texture_bytes: u64) -> ImpostorReport {
    let clip = |clip: &heliodon_bundle::impostor::ImpostorClip| ClipReport {
        name: clip.name.clone(),
        frames: clip.frames,
        duration_s: clip.duration_s,
    };
    ImpostorReport {
        model: args.model.clone(),
        file: None,
        views: info.views(),
        frames: info.frames(),
        frame_px: info.frame_px,
        layer_px: info.layer_px(),
        texture_bytes,
        file_bytes: None,
        used: None,
        distance_m: info.distance_m,
        height_m: info.heights_m[1] - info.heights_m[0],
        clips: info.clips.iter().map(clip).collect(),
    }
}

/// The part of its frames that is covered.
fn used(impostor: &Impostor) -> f32 {
    let views = 0..impostor.info.views();
    let [width, height] = impostor.info.frame_px;
    let texels = u64::from(width * height) * u64::from(impostor.info.frames()) * u64::from(impostor.info.views());
    let covered: u64 = views.map(|view| impostor.layer(2 * view, 0).1.iter().map(|p| u64::from(p[3])).sum::<u64>()).sum();
    (covered as f64 / 255.0 / texels as f64) as f32
}

/// Backgrounds: black, white, a sky, stone; linear.
const GROUNDS: [[f32; 3]; 4] = [[0.0; 3], [1.0; 3], [0.2, 0.45, 0.9], [0.42, 0.36, 0.28]];

/// A texel's looks over a background.
fn over([r, g, b, a]: [u8; 4], ground: [f32; 3]) -> [u8; 4] {
    let cover = f32::from(a) / 255.0;
    let mix = |code: u8, ground: f32| srgb8_from_linear((f32::from(code) / 255.0).powi(2) * cover + ground * (1.0 - cover));
    [mix(r, ground[0]), mix(g, ground[1]), mix(b, ground[2]), 255]
}

/// Views below one another; beside one another eight frames of each, over black, white, a sky, stone; then their normals and depths.
fn sheet(impostor: &Impostor) -> SrgbImage {
    const FRAMES: u32 = 8;
    let info = &impostor.info;
    let ([width, height], columns) = (info.frame_px, info.grid[0]);
    let frames: Vec<u32> = (0..FRAMES.min(info.frames())).map(|k| k * info.frames() / FRAMES.min(info.frames())).collect();
    let across = frames.len() as u32 + 2;
    let mut sheet = SrgbImage::filled(across * width, info.views() * height, [0, 0, 0, 255]);
    for view in 0..info.views() {
        let layers = [0, 1].map(|layer| impostor.layer(2 * view + layer, 0));
        for (cell, frame) in frames.iter().copied().chain([frames[0]; 2]).enumerate() {
            let [left, top] = [frame % columns * width, frame / columns * height];
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                let at = ((top + y) * layers[0].0[0] + left + x) as usize;
                let (look, shape) = (layers[0].1[at], layers[1].1[at]);
                let ground = GROUNDS[cell % GROUNDS.len()];
                let pixel = match cell.checked_sub(frames.len()) {
                    None => over(look, ground),
                    Some(0) => [shape[0], shape[1], shape[2], 255],
                    Some(_) => [shape[3], shape[3], look[3], 255],
                };
                let to = (view * height + y) * sheet.width + cell as u32 * width + x;
                sheet.pixels[to as usize] = pixel;
            }
        }
    }
    sheet
}

fn describe(report: &ImpostorReport) -> String {
    let [width, height] = report.frame_px;
    let clips: Vec<String> =
        report.clips.iter().map(|c| format!("{} ({} frames, {:.2} s)", c.name, c.frames, c.duration_s)).collect();
    let mut text = format!(
        "{}: {:.2} m high, {} views, {} frames of {width} x {height} texels: {}\n",
        report.model.display(),
        report.height_m,
        count(u64::from(report.views)),
        count(u64::from(report.frames)),
        clips.join(", ")
    );
    text += &format!(
        "Made for {} m and more. {} of a device's memory in {} layers of {} x {} texels",
        report.distance_m,
        bytes(report.texture_bytes),
        2 * report.views,
        report.layer_px[0],
        report.layer_px[1]
    );
    if let Some(used) = report.used {
        text += &format!(", {:.0} % of its frames covered", used * 100.0);
    }
    text += ".\n";
    if let (Some(file), Some(size)) = (&report.file, report.file_bytes) {
        text += &format!("Written to {} ({}).\n", file.display(), bytes(size));
    }
    text
}
