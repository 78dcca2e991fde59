//! `heliodon bench`: the project's benchmarks.

#[cfg(feature = "viewer")]
mod frame;
mod motion;
#[cfg(feature = "viewer")]
mod walk;

use crate::App;
use crate::failure::wrong_arguments;
use crate::output::{count, duration};
use anyhow::Result;
use clap::ValueEnum;
use glam::Vec3;
use heliodon_bake::albedo::SceneAlbedo;
use heliodon_bake::report::Reporter;
use heliodon_bundle::memory::peak_resident_bytes;
use heliodon_light::{
    GatherBlock, Layout, LightParams, MaskParams, PointSet, Surfaces, bake_sun_masks, default_offset_m, gather, solve,
};
use heliodon_math::light_sphere::{LightSphere, MAX_LEVEL};
use heliodon_mesh::Mesh;
use heliodon_mesh::import::{ImportOptions, NormalSource, read};
use heliodon_mesh::temple::{TempleParams, build};
use heliodon_rays::{BuildParams, TriangleScene};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Runs one of the project's benchmarks, on a mesh or on the procedural temple.
///
/// Times are of the whole machine that --threads leaves; run what you compare with in turn, and quote ratios.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon bench sun-masks --triangles 2000000 --json\n  heliodon bench transfer bunny.ply --samples 256 --bounces 4\n  heliodon bench import scan.ply"
)]
pub struct Args {
    /// What is measured
    #[arg(value_enum)]
    name: Benchmark,
    /// A mesh, in place of the procedural temple; for frame and walk, a bundle
    #[arg(value_name = "MESH|BUNDLE")]
    input: Option<PathBuf>,
    /// Triangles of the temple
    #[arg(long, value_name = "N", default_value_t = 2_000_000, value_parser = clap::value_parser!(u64).range(50_000..=50_000_000))]
    triangles: u64,
    /// Times that it is run; the median is told
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=1000))]
    runs: u16,
    /// Sun positions
    #[arg(long, value_name = "N", default_value_t = 92, value_parser = clap::value_parser!(u32).range(1..=1024))]
    suns: u32,
    /// Level of the light sphere: 2 is 66 directions, 3 is 258, 4 is 1026
    #[arg(long, value_name = "L", default_value_t = 3, value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_LEVEL)))]
    level: u32,
    /// Rays of each point of the transfer
    #[arg(long, value_name = "N", default_value_t = LightParams::default().samples)]
    samples: u32,
    /// Bounces of the transfer
    #[arg(long, value_name = "N", default_value_t = LightParams::default().bounces)]
    bounces: u32,
    /// For motion: a vertex cache (.pc2) that moves the mesh
    #[arg(long, value_name = "FILE")]
    cache: Option<PathBuf>,
    #[cfg(feature = "viewer")]
    #[command(flatten)]
    frame: frame::Args,
    #[cfg(feature = "viewer")]
    #[command(flatten)]
    walk: walk::Args,
    /// Also write the mesh as OBJ, for programs to compare with
    #[arg(long, value_name = "FILE")]
    write_obj: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Benchmark {
    /// Reading a mesh file
    Import,
    /// Building the hierarchy that answers rays
    Build,
    /// Shadow rays to the suns of a day
    SunMasks,
    /// The visibility matrix of the light sphere
    Visibility,
    /// A model that moves, lit anew in each of 48 frames of its first clip, with and without vertex filtering
    Motion,
    /// The sky's transfer with its bounces
    Transfer,
    /// Frames of the viewer, 1024x768, off screen
    #[cfg(feature = "viewer")]
    Frame,
    /// The viewer's frames on a walk through a bundle, without culling, with each kind of it and with both
    #[cfg(feature = "viewer")]
    Walk,
}

/// Figures of a benchmark.
#[derive(Serialize)]
struct Figures {
    benchmark: String,
    scene: String,
    vertices: u64,
    triangles: u64,
    threads: usize,
    /// Of each run, in order.
    seconds: Vec<f64>,
    median_seconds: f64,
    rays: u64,
    /// Of the median run; 0 where no rays are counted.
    million_rays_per_second: f64,
    peak_memory_bytes: Option<u64>,
    /// What else the benchmark tells, by name.
    more: BTreeMap<String, f64>,
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let params = LightParams { samples: args.samples, bounces: args.bounces, ..LightParams::default() };
    if let Err(error) = params.validate() {
        wrong_arguments!("{error}");
    }
    let mut figures = match args.name {
        Benchmark::Import => bench_import(args)?,
        Benchmark::Motion => motion::run(args)?,
        #[cfg(feature = "viewer")]
        Benchmark::Frame => frame::run(args)?,
        #[cfg(feature = "viewer")]
        Benchmark::Walk => walk::run(args)?,
        Benchmark::Build | Benchmark::SunMasks | Benchmark::Visibility | Benchmark::Transfer => bench_mesh(app, args, &params)?,
    };
    figures.seconds.iter_mut().for_each(|seconds| *seconds = (*seconds * 1e6).round() / 1e6);
    let mut sorted = figures.seconds.clone();
    sorted.sort_by(f64::total_cmp);
    figures.median_seconds = sorted[sorted.len() / 2];
    figures.million_rays_per_second = figures.rays as f64 / figures.median_seconds.max(1e-9) / 1e6;
    figures.peak_memory_bytes = peak_resident_bytes();
    app.output.result(&figures, describe)
}

fn describe(figures: &Figures) -> String {
    let mut text = format!(
        "{} on {} ({} triangles), {} threads: {}",
        figures.benchmark,
        figures.scene,
        count(figures.triangles),
        figures.threads,
        duration(figures.median_seconds)
    );
    if figures.rays > 0 {
        text += &format!(", {} rays, {:.2} million a second", count(figures.rays), figures.million_rays_per_second);
    }
    for (name, value) in &figures.more {
        text += &format!("\n  {name} {value:.4}");
    }
    text
}

fn figures(args: &Args, scene: String, mesh: &Mesh) -> Figures {
    Figures {
        benchmark: args.name.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned()),
        scene,
        vertices: mesh.positions.len() as u64,
        triangles: mesh.triangles.len() as u64,
        threads: rayon::current_num_threads(),
        seconds: Vec::new(),
        median_seconds: 0.0,
        rays: 0,
        million_rays_per_second: 0.0,
        peak_memory_bytes: None,
        more: BTreeMap::new(),
    }
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn bench_import(args: &Args) -> Result<Figures> {
    let Some(path) = &args.input else { wrong_arguments!("name a mesh: heliodon bench import FILE") };
    let mut seconds = Vec::new();
    let mut mesh = Mesh::default();
    for _ in 0..args.runs {
        drop(std::mem::take(&mut mesh));
        let begun = Instant::now();
        mesh = read(path, &ImportOptions::default())?;
        seconds.push(begun.elapsed().as_secs_f64());
    }
    let mut figures = figures(args, name_of(path), &mesh);
    figures.more.insert("file_bytes".to_owned(), std::fs::metadata(path)?.len() as f64);
    figures.seconds = seconds;
    Ok(figures)
}

fn bench_mesh(app: &App, args: &Args, params: &LightParams) -> Result<Figures> {
    app.progress.stage("mesh", 0);
    let (name, mesh) = match &args.input {
        // normals as the programs that are compared with compute them: from the triangles
        Some(path) => {
            (name_of(path), read(path, &ImportOptions { normals: NormalSource::Computed, ..ImportOptions::default() })?)
        }
        None => ("procedural temple".to_owned(), temple(args.triangles)?),
    };
    app.progress.finished();
    if let Some(path) = &args.write_obj {
        heliodon_mesh::export::write_obj(path, &mesh)?;
    }
    let mut figures = figures(args, name, &mesh);
    let begun = Instant::now();
    let rays = TriangleScene::build(&mesh.positions, &mesh.triangles, &BuildParams::default())?;
    figures.more.insert("build_seconds".to_owned(), begun.elapsed().as_secs_f64());
    figures.more.insert("hierarchy_bytes".to_owned(), rays.memory_bytes() as f64);
    let albedo = SceneAlbedo::new(&mesh, 0.0);
    let surfaces = Surfaces {
        rays: &rays,
        positions: &mesh.positions,
        normals: &mesh.normals,
        triangles: &mesh.triangles,
        albedo: &albedo,
        detail: None,
    };
    match args.name {
        Benchmark::Build => {
            for _ in 0..args.runs {
                let begun = Instant::now();
                TriangleScene::build(&mesh.positions, &mesh.triangles, &BuildParams::default())?;
                figures.seconds.push(begun.elapsed().as_secs_f64());
            }
        }
        Benchmark::SunMasks => bench_masks(args, &surfaces, &mut figures)?,
        Benchmark::Visibility => bench_visibility(args, &surfaces, &mut figures),
        Benchmark::Transfer => bench_transfer(args, &surfaces, params, &mut figures)?,
        // the others need no hierarchy
        _ => {}
    }
    Ok(figures)
}

/// All parts of the temple in one mesh.
fn temple(triangles: u64) -> Result<Mesh> {
    let mut all = Mesh::default();
    for part in build(&TempleParams { triangles: triangles as usize, ..TempleParams::default() }).parts {
        all.append(&part.mesh)?;
    }
    Ok(all)
}

/// The arc of an equinox day at 38 degrees north, from 10 degrees after sunrise to 10 before sunset.
fn equinox_suns(count: u32) -> Vec<Vec3> {
    let latitude = 38_f32.to_radians();
    (0..count)
        .map(|step| {
            let hour = (10.0 + 160.0 * step as f32 / (count.max(2) - 1) as f32).to_radians();
            Vec3::new(libm::cosf(hour), libm::sinf(hour) * libm::cosf(latitude), libm::sinf(hour) * libm::sinf(latitude))
        })
        .collect()
}

/// The part of the scene's diagonal by which shadow rays start off the surface, as in the program that is compared with.
const OFFSET_PER_DIAGONAL: f32 = 1e-4;

fn peers_offset_m(rays: &TriangleScene) -> f32 {
    let (low, high) = rays.bounds().unwrap_or_default();
    low.distance(high) * OFFSET_PER_DIAGONAL
}

fn bench_visibility(args: &Args, surfaces: &Surfaces, figures: &mut Figures) {
    let sphere = LightSphere::new(args.level);
    let offset_m = peers_offset_m(surfaces.rays);
    for _ in 0..args.runs {
        let begun = Instant::now();
        let matrix = surfaces.rays.visibility(surfaces.positions, surfaces.normals, sphere.directions(), offset_m);
        figures.seconds.push(begun.elapsed().as_secs_f64());
        let mut facing = vec![0; surfaces.normals.len().div_ceil(64)];
        let asked = |&l: &Vec3| u64::from(heliodon_rays::facing(surfaces.normals, l, &mut facing));
        figures.rays = sphere.directions().iter().map(asked).sum();
        figures.more.insert("occluded_part".to_owned(), 1.0 - matrix.visible_count() as f64 / figures.rays.max(1) as f64);
        let begun = Instant::now();
        let occlusion = matrix.ambient_occlusion(sphere.weights());
        figures.more.insert("gather_seconds".to_owned(), begun.elapsed().as_secs_f64());
        let mean = occlusion.iter().map(|&ao| f64::from(ao)).sum::<f64>() / occlusion.len().max(1) as f64;
        figures.more.insert("mean_ambient_occlusion".to_owned(), mean);
    }
}

fn bench_masks(args: &Args, surfaces: &Surfaces, figures: &mut Figures) -> Result<()> {
    let points = PointSet::at_vertices(surfaces, peers_offset_m(surfaces.rays));
    let suns = equinox_suns(args.suns);
    for _ in 0..args.runs {
        let begun = Instant::now();
        let masks = bake_sun_masks(surfaces, &points, &suns, 0..points.len(), &MaskParams::default())?;
        figures.seconds.push(begun.elapsed().as_secs_f64());
        figures.rays = masks.rays;
        let lit: u64 = masks.words.iter().map(|word| u64::from(word.count_ones())).sum();
        figures.more.insert("occluded_part".to_owned(), 1.0 - lit as f64 / masks.rays.max(1) as f64);
    }
    Ok(())
}

fn bench_transfer(args: &Args, surfaces: &Surfaces, params: &LightParams, figures: &mut Figures) -> Result<()> {
    let params = LightParams { offset_m: default_offset_m(surfaces.positions, surfaces.triangles), ..params.clone() };
    for _ in 0..args.runs {
        let begun = Instant::now();
        let mut layout = Layout::new(surfaces, &params)?;
        let mut blocks: Vec<GatherBlock> = vec![gather(surfaces, &layout, None, 0..layout.points().len(), &params)?];
        loop {
            let more = layout.add_back_sides(surfaces, &blocks, &params);
            if more.is_empty() {
                break;
            }
            blocks.push(gather(surfaces, &layout, None, more, &params)?);
        }
        let gathered = begun.elapsed().as_secs_f64();
        let light = solve(surfaces, &layout, &blocks, None, &params)?;
        figures.seconds.push(begun.elapsed().as_secs_f64());
        figures.rays = blocks.iter().map(|block| block.rays).sum();
        let hits: usize = blocks.iter().map(GatherBlock::hit_bytes).sum();
        figures.more.insert("gather_seconds".to_owned(), gathered);
        figures.more.insert("kept_hit_bytes".to_owned(), hits as f64);
        figures.more.insert("points".to_owned(), layout.points().len() as f64);
        let valid = light.validity.valid.iter().filter(|valid| **valid == 1).count();
        figures.more.insert("valid_vertices".to_owned(), valid as f64);
        // what a path tracer would have to trace for the same samples: one path of all bounces for each
        let paths = figures.vertices as f64 * f64::from(params.samples);
        figures
            .more
            .insert("million_paths_per_second".to_owned(), paths / figures.seconds.last().copied().unwrap_or(1.0) / 1e6);
    }
    Ok(())
}
