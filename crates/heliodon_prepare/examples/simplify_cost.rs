//! What simplification costs, and what comes of it:
//! `cargo run -p heliodon_prepare --example simplify_cost -- temple 2000000 [--write FOLDER] [--edge PX] [--error PX]
//! [--threads N] [--bare]`,
//! or the name of a mesh file in place of the temple, which is then seen from a box beside it.
//!
//! Prints seconds, errors and the process's peak memory. With `--write`, the mesh goes to `in.glb` and `out.glb`; without
//! `--bare`, the result is measured and the original's triangles find theirs.

use glam::Vec3;
use heliodon_mesh::export::scene::{Node, Scene, SceneMesh};
use heliodon_mesh::export::write_glb;
use heliodon_mesh::import::{ImportOptions, read};
use heliodon_mesh::temple::{TempleParams, build};
use heliodon_mesh::{Mesh, MeshError};
use heliodon_prepare::simplify::{SimplifyParams, measure, nearest_triangles, simplify};
use heliodon_prepare::{Screen, ViewCell, Views};
use heliodon_testkit::process::peak_bytes;
use std::error::Error;
use std::path::Path;
use std::time::Instant;

#[expect(clippy::print_stdout, reason = "a program for people")]
fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str| arguments.iter().position(|a| a == name).and_then(|i| arguments.get(i + 1));
    let number = |name: &str, otherwise: f32| value(name).map_or(Ok(otherwise), |text| text.parse::<f32>());
    if let Some(threads) = value("--threads") {
        rayon::ThreadPoolBuilder::new().num_threads(threads.parse()?).build_global()?;
    }
    let (mesh, low, high) = match arguments.first().map(String::as_str) {
        Some("temple") => {
            let triangles = arguments.get(1).ok_or("how many triangles?")?.parse()?;
            let temple = build(&TempleParams { triangles, ..TempleParams::default() });
            let (low, high) = temple.room;
            (join(temple.parts.into_iter().map(|part| part.mesh)), low, high)
        }
        Some(file) => {
            let mesh = read(Path::new(file), &ImportOptions::default())?;
            let (low, high) = mesh.bounds().unwrap_or_default();
            let size = high - low;
            let eye = 0.5 * (low + high) + Vec3::Z * size.length();
            (mesh, eye - 0.05 * size, eye + 0.05 * size)
        }
        None => return Err("temple N, or a mesh file?".into()),
    };
    println!(
        "{} triangles, {} vertices; eyes from {low} to {high}; peak {:.2} GB",
        mesh.triangles.len(),
        mesh.positions.len(),
        peak_gb()
    );
    let views = Views {
        cells: vec![ViewCell { low, high, windows: Vec::new() }],
        screen: Screen { width_px: 1024, height_px: 768, fov_rad: 50.0_f32.to_radians() },
    };
    let params = SimplifyParams {
        error_px: number("--error", SimplifyParams::default().error_px)?,
        edge_px: number("--edge", SimplifyParams::default().edge_px)?,
        normal_weight: number("--normal", SimplifyParams::default().normal_weight)?,
        color_weight: number("--color", SimplifyParams::default().color_weight)?,
        ..SimplifyParams::default()
    };
    let start = Instant::now();
    let simplified = simplify(&mesh, &views, &params);
    println!("simplify: {:.2} s, peak {:.2} GB\n{:#?}", start.elapsed().as_secs_f64(), peak_gb(), simplified.report);
    simplified.mesh.validate()?;
    if !arguments.iter().any(|a| a == "--bare") {
        let start = Instant::now();
        let measured = measure(&mesh, &simplified.mesh, &views, &params);
        println!("measure: {:.2} s, peak {:.2} GB\n{:#?}", start.elapsed().as_secs_f64(), peak_gb(), measured.report);
        let start = Instant::now();
        let nearest = nearest_triangles(&mesh, &simplified.mesh, &views, &params);
        let farthest = nearest.distance_m.iter().copied().fold(0.0, f32::max);
        println!("nearest: {:.2} s, peak {:.2} GB, farthest {farthest} m", start.elapsed().as_secs_f64(), peak_gb());
    }
    if let Some(folder) = value("--write") {
        write(&Path::new(folder).join("in.glb"), mesh)?;
        write(&Path::new(folder).join("out.glb"), simplified.mesh)?;
    }
    Ok(())
}

fn join(parts: impl Iterator<Item = Mesh>) -> Mesh {
    parts.fold(Mesh::default(), |mut whole, part| {
        let first = whole.positions.len() as u32;
        whole.positions.extend(part.positions);
        whole.normals.extend(part.normals);
        whole.colors_linear.extend(part.colors_linear);
        whole.triangles.extend(part.triangles.into_iter().map(|t| t.map(|i| i + first)));
        whole
    })
}

fn write(path: &Path, mesh: Mesh) -> Result<(), Box<dyn Error>> {
    let node = Node { mesh: Some(0), ..Node::at("mesh", Vec3::ZERO) };
    let mesh = SceneMesh { mesh, ..SceneMesh::default() };
    mesh.mesh.validate().map_err(|error: MeshError| error.to_string())?;
    Ok(write_glb(path, &Scene { nodes: vec![node], meshes: vec![mesh], ..Scene::default() })?)
}

/// The most memory that the process ever had; 0 where the system does not say.
fn peak_gb() -> f64 {
    peak_bytes().unwrap_or(0) as f64 * 1e-9
}
