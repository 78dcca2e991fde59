//! `heliodon visibility`: the light that reaches the vertices of any mesh, with nothing computed beforehand.

mod animation;
mod engine;
mod found;
mod scene;

use crate::App;
use crate::failure::wrong_arguments;
use crate::files;
use crate::output::{count, duration};
use crate::probe_args::ProbeArgs;
use animation::Lighting;
use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use engine::{Engine, Question};
use found::{Found, write_found, write_matrix};
use glam::{Quat, Vec3};
use heliodon_bake::report::Reporter;
use heliodon_bundle::memory::peak_resident_bytes;
use heliodon_bundle::site::CACHE_FRAMES_PER_S_RANGE;
use heliodon_image::HdrImage;
use heliodon_math::light_sphere::{LightSphere, MAX_LEVEL};
use heliodon_math::visibility::VisibilityMatrix;
use heliodon_sky::environment::{Environment, blur_rad};
use heliodon_sky::mapping::Mapping;
use heliodon_sky::probe::Probe;
use scene::{Scene, read_scene};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

/// Computes which directions of a light sphere reach each vertex, and from that ambient occlusion, bent normals or the light of an
/// environment. Several meshes stand in one scene and occlude one another.
///
/// What is written depends on the output's ending. .npy: one row a vertex in the order of the files' own vertices, f32: ambient occlusion
/// (N), 1 where no face uses a vertex; with --bent (N,3); with --env the light itself, irradiance / pi (N,3); with --matrix M (N,k), n.l
/// where visible and 0 where not, and beside it *.directions.npy (k,3) and *.weights.npy (k). .ply: the meshes with ambient occlusion as
/// `quality` and as colour; with --bent with bent normals; with --env lit, albedo times light. .glb: likewise, without `quality`. With --animation
/// .mp4: a film of the lit model; .pc2: for each frame the vertices' three values as .npy has them (ambient occlusion thrice), and beside it *.positions.pc2.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon visibility bunny.ply --level 4 -o occluded.ply\n  heliodon visibility statue.glb pedestal.obj --env studio.hdr --exposure 1 -o lit.ply\n  heliodon visibility bunny.ply --matrix -o m.npy --json\n  heliodon visibility walker.glb --animation walk --frames 66 --level 2 -o walk.mp4"
)]
pub struct Args {
    /// Meshes: .ply, .obj, .gltf, .glb, .stl
    #[arg(required = true, value_name = "MESH")]
    meshes: Vec<PathBuf>,
    /// Level of the light sphere: 0 to 8 for 6, 18, 66, 258, 1026, 4098, 16386, 65538, 262146 directions
    #[arg(long, value_name = "L", default_value_t = 3, value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_LEVEL)))]
    level: u32,
    /// What computes
    #[arg(long, value_enum, default_value_t = Backend::Auto)]
    backend: Backend,
    /// How the GPU finds out what occludes [default: auto]
    #[cfg(feature = "gpu")]
    #[arg(long, value_enum, value_name = "METHOD")]
    gpu_method: Option<GpuMethod>,
    /// Light of this environment (.hdr, .exr), latitude-longitude unless --mapping says otherwise
    #[arg(long, value_name = "SKY")]
    env: Option<PathBuf>,
    #[command(flatten)]
    probe: ProbeArgs,
    /// Standard deviation of the environment's blur, degrees [default: half the distance between directions]
    #[arg(long, value_name = "DEG", requires = "env", value_parser = |text: &str| crate::values::within(text, 0.01, 180.0))]
    blur: Option<f64>,
    /// Brightness of lit colours: 2^STOPS
    #[arg(long, value_name = "STOPS", requires = "env", default_value_t = 0.0, allow_negative_numbers = true, value_parser = |text: &str| crate::values::within(text, -40.0, 40.0).map(|stops| stops as f32))]
    exposure: f32,
    /// Write bent normals: the mean direction from which light comes
    #[arg(long, conflicts_with = "matrix")]
    bent: bool,
    /// Write the visibility matrix itself, as .npy
    #[arg(long, conflicts_with = "env")]
    matrix: bool,
    /// Perform this animation of the one model, with -o film.mp4 or -o values.pc2
    #[arg(long, value_name = "NAME", conflicts_with = "matrix")]
    animation: Option<String>,
    /// Moments of the animation, spread evenly over it
    #[arg(long, value_name = "N", default_value_t = 48, requires = "animation", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: u32,
    /// A vertex cache (.pc2) that moves the mesh; its animation is called cache
    #[arg(long, value_name = "FILE", requires = "animation")]
    cache: Option<PathBuf>,
    /// Frames of the vertex cache that make a second, which its file does not say [default: 25]
    #[arg(long, value_name = "N", requires = "cache", value_parser = |text: &str| crate::values::within(text, *CACHE_FRAMES_PER_S_RANGE.start(), *CACHE_FRAMES_PER_S_RANGE.end()).map(|frames| frames as f32))]
    cache_frames_per_s: Option<f32>,
    /// How far off the surface rays start, metres [default: a ten-thousandth of the scene's diagonal]
    #[arg(long, value_name = "M", value_parser = |text: &str| crate::values::within(text, 0.0, 1e6).map(|offset| offset as f32))]
    offset: Option<f32>,
    /// Where the result goes; without it, only what was found is told
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// What computes visibility.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Backend {
    /// A GPU for much work, where there is one; else the processor
    Auto,
    /// Rays on the processor: exact
    Cpu,
    /// The GPU
    #[cfg(feature = "gpu")]
    Gpu,
}

/// How a GPU finds out what occludes.
#[cfg(feature = "gpu")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum GpuMethod {
    /// What is expected to be faster for the mesh
    Auto,
    /// A ray for each vertex and direction
    Rays,
    /// A depth map for each direction: loses contacts narrower than some of its pixels
    Maps,
}

#[derive(Serialize)]
struct VisibilityReport {
    vertices: u64,
    triangles: u64,
    directions: u64,
    backend: Backend,
    /// `rays` or `maps`.
    method: &'static str,
    /// Which processor or GPU.
    device: String,
    /// How far off the surface rays start; depth maps have none.
    offset_m: Option<f32>,
    /// Entries of the matrix that are not 0, where it is written.
    visible: Option<u64>,
    /// Over the vertices that faces use.
    mean_ambient_occlusion: f64,
    /// By phase.
    seconds: BTreeMap<&'static str, f64>,
    peak_memory_bytes: Option<u64>,
    output: Vec<PathBuf>,
}

/// What is written of meshes that stand still.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    Ply,
    Glb,
    Npy,
}

/// What is written of what moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moving {
    Mp4,
    Pc2,
}

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Written {
    Still(Form),
    Moving(Moving),
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let form = form(args)?;
    let environment = environment(app, args)?;
    let mut phases = Phases::default();
    let sphere = LightSphere::new(args.level);
    let radiance = environment.map(|environment| {
        let sigma_rad = args.blur.map_or_else(|| blur_rad(sphere.directions().len()), f64::to_radians);
        phases.time("environment", || environment.radiance(sphere.directions(), sphere.weights(), sigma_rad, Quat::IDENTITY))
    });
    let (scene, found, engine, written) = match (&args.animation, form) {
        (Some(name), Some(Written::Moving(form))) => {
            let acted = phases.time("reading", || animation::read(app, args, name))?;
            let lighting = Lighting { sphere: &sphere, radiance };
            animation::run(app, args, form, &acted, lighting, &mut phases)?
        }
        (_, form) => {
            let form = form.and_then(|form| if let Written::Still(form) = form { Some(form) } else { None });
            still(app, args, form, &sphere, radiance, &mut phases)?
        }
    };
    let occlusion = &found.light.ambient_occlusion;
    let used: Vec<f64> = occlusion.iter().zip(&scene.used).filter(|(_, used)| **used).map(|(&ao, _)| f64::from(ao)).collect();
    let report = VisibilityReport {
        vertices: scene.mesh.positions.len() as u64,
        triangles: scene.mesh.triangles.len() as u64,
        directions: sphere.directions().len() as u64,
        backend: engine.backend,
        method: engine.method,
        device: engine.device,
        offset_m: engine.offset_m,
        visible: found.matrix.as_ref().map(VisibilityMatrix::visible_count),
        mean_ambient_occlusion: used.iter().sum::<f64>() / used.len().max(1) as f64,
        seconds: phases.seconds,
        peak_memory_bytes: peak_resident_bytes(),
        output: written,
    };
    app.output.result(&report, describe)
}

/// What was found of meshes that stand still, and where it was written.
fn still(
    app: &App,
    args: &Args,
    form: Option<Form>,
    sphere: &LightSphere,
    radiance: Option<Vec<Vec3>>,
    phases: &mut Phases,
) -> Result<(Scene, Found, Engine, Vec<PathBuf>)> {
    app.progress.stage("reading", args.meshes.len() as u64);
    let scene = phases.time("reading", || read_scene(app, &args.meshes))?;
    app.progress.finished();
    let question = Question { scene: &scene, sphere, radiance, bent: args.bent, matrix: args.matrix };
    let (mut found, engine) = engine::answer(app, args, &question, phases)?;
    found.open_unused(&scene);
    let written = match (&args.output, form, &found.matrix) {
        (Some(path), Some(_), Some(matrix)) => phases.time("writing", || write_matrix(path, &scene, sphere, matrix))?,
        (Some(path), Some(form), None) => phases.time("writing", || write_found(path, form, &scene, &found, args))?,
        _ => Vec::new(),
    };
    Ok((scene, found, engine, written))
}

fn describe(report: &VisibilityReport) -> String {
    let mut text = format!(
        "{} vertices, {} triangles, {} directions by {} on {}: mean ambient occlusion {:.4}",
        count(report.vertices),
        count(report.triangles),
        count(report.directions),
        report.method,
        report.device,
        report.mean_ambient_occlusion
    );
    let phases: Vec<String> =
        report.seconds.iter().map(|(name, &seconds)| format!("{name} {}", milliseconds(seconds))).collect();
    text += &format!("\n{}", phases.join(", "));
    for path in &report.output {
        text += &format!("\n{}", path.display());
    }
    text
}

fn milliseconds(seconds: f64) -> String {
    if seconds < 1.0 { format!("{:.1} ms", seconds * 1e3) } else { duration(seconds) }
}

/// Seconds by phase.
#[derive(Default)]
struct Phases {
    seconds: BTreeMap<&'static str, f64>,
}

impl Phases {
    fn time<T>(&mut self, phase: &'static str, work: impl FnOnce() -> T) -> T {
        let begun = Instant::now();
        let result = work();
        *self.seconds.entry(phase).or_default() += begun.elapsed().as_secs_f64();
        result
    }
}

/// Looks whether what is asked for goes together and can be written.
fn form(args: &Args) -> Result<Option<Written>> {
    #[cfg(feature = "gpu")]
    {
        if args.offset.is_some() && args.gpu_method == Some(GpuMethod::Maps) {
            wrong_arguments!("--offset is where rays start, and depth maps have none; leave it out, or say --gpu-method rays");
        }
        if args.gpu_method.is_some() && args.backend == Backend::Cpu {
            wrong_arguments!("--gpu-method is how a GPU computes; leave it out, or say --backend gpu");
        }
    }
    if args.env.is_none() && args.probe.any() {
        wrong_arguments!("--mapping, --opening and --turn say how --env is read; name one, or leave them out");
    }
    let Some(path) = &args.output else {
        if args.matrix || args.bent {
            wrong_arguments!("say where the result goes: -o FILE.npy");
        }
        if args.animation.is_some() {
            wrong_arguments!("say where the film or the cache goes: -o FILE.mp4 or -o FILE.pc2");
        }
        return Ok(None);
    };
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    let form = match ending.as_deref() {
        Some("ply") if args.matrix => wrong_arguments!("a matrix is written as .npy, not as .ply"),
        Some("mp4" | "pc2") if args.animation.is_none() => {
            wrong_arguments!("a film and a cache show what moves; name an --animation, or write a .ply, .glb or .npy")
        }
        Some("mp4") => Written::Moving(Moving::Mp4),
        Some("pc2") => Written::Moving(Moving::Pc2),
        _ if args.animation.is_some() => wrong_arguments!("an animation is written as .mp4 or .pc2"),
        Some("glb") if args.matrix => wrong_arguments!("a matrix is written as .npy, not as .glb"),
        Some("glb") => Written::Still(Form::Glb),
        Some("ply") => Written::Still(Form::Ply),
        Some("npy") if args.bent && args.env.is_some() => {
            wrong_arguments!("one .npy holds either bent normals or light; leave out --bent or --env")
        }
        Some("npy") => Written::Still(Form::Npy),
        _ => wrong_arguments!("{}: the output's ending says what is written; name a .ply, .glb or .npy", path.display()),
    };
    files::check_place(path)?;
    if let Some(read) = args.meshes.iter().chain(&args.env).find(|read| files::is_within(read, path)) {
        bail!("{} would be written over, and it is read here; name another place", read.display());
    }
    Ok(Some(form))
}

fn environment(app: &App, args: &Args) -> Result<Option<Environment>> {
    let Some(path) = &args.env else { return Ok(None) };
    let mapping = args.probe.mapping()?.unwrap_or(Mapping::LatLong);
    let (image, repairs) = HdrImage::read_counted(path)?;
    let repaired = repairs.nan + repairs.infinite + repairs.negative;
    if repaired > 0 {
        app.progress.warning(&format!(
            "{}: {} values were NaN, infinite or negative, and are mended",
            path.display(),
            count(repaired)
        ));
    }
    let probe = Probe::new(image, mapping, args.probe.turn_deg().to_radians()).with_context(|| path.display().to_string())?;
    Ok(Some(Environment::from_probe(&probe)))
}
