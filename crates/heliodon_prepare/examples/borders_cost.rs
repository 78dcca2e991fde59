//! What comparing the borders of parts costs:
//! `cargo run -p heliodon_prepare --example borders_cost -- tiles 10000000 [--same] [--weld M]`, or `temple` in place of the two tiles.
//!
//! With `--same`, both tiles lie at the same place, so that all of their vertices are shared: the worst case. Prints seconds, what is
//! shared, what cleaning takes besides, and the process's peak memory.

use glam::Vec3;
use heliodon_mesh::Mesh;
use heliodon_mesh::temple::{TempleParams, build};
use heliodon_prepare::borders::{Neighbor, share};
use heliodon_prepare::clean::{CleanParams, clean};
use heliodon_testkit::process::peak_bytes;
use std::error::Error;
use std::time::Instant;

#[expect(clippy::print_stdout, reason = "a program for people")]
fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let triangles: usize = arguments.get(1).ok_or("how many triangles?")?.parse()?;
    let weld = arguments.iter().position(|a| a == "--weld").and_then(|i| arguments.get(i + 1));
    let weld_m = weld.map_or(Ok(0.0), |text| text.parse::<f32>())?;
    let apart_m = if arguments.iter().any(|a| a == "--same") { 0.0 } else { 10.0 };
    let mut meshes = match arguments.first().map(String::as_str) {
        Some("temple") => {
            let temple = build(&TempleParams { triangles, ..TempleParams::default() });
            temple.parts.into_iter().map(|part| part.mesh).collect()
        }
        Some("tiles") => vec![tile(triangles / 2, 0.0), tile(triangles / 2, apart_m)],
        _ => return Err("temple N, or tiles N?".into()),
    };
    println!("{} meshes; peak {:.2} GB", meshes.len(), peak_gb());
    for mesh in &mut meshes {
        let start = Instant::now();
        let report = clean(mesh, &CleanParams::default());
        let (seconds, junctions) = (start.elapsed().as_secs_f64(), report.t_junctions.vertices);
        println!(
            "clean: {} triangles, {junctions} T-junctions, {seconds:.2} s, peak {:.2} GB",
            mesh.triangles.len(),
            peak_gb()
        );
    }
    let mut neighbors: Vec<Neighbor> = meshes.iter_mut().map(|mesh| Neighbor { mesh, weld_m }).collect();
    let start = Instant::now();
    let shared = share(&mut neighbors, usize::MAX)?;
    println!("borders: {:.2} s, peak {:.2} GB", start.elapsed().as_secs_f64(), peak_gb());
    shared.iter().filter(|shared| !shared.report.is_empty()).for_each(|shared| println!("  {}", shared.report));
    Ok(())
}

/// Rough ground of ten metres each way.
fn tile(triangles: usize, first_m: f32) -> Mesh {
    let side = ((triangles / 2) as f64).sqrt() as u32;
    let at = |i: u32| 10.0 * i as f32 / side as f32;
    let row = |i: u32| (0..=side).map(move |j| (at(i) + first_m, at(j)));
    let height = |x: f32, z: f32| 0.05 * (9.0 * x).sin() * (7.0 * z).cos();
    let positions = (0..=side).flat_map(row).map(|(x, z)| Vec3::new(x, height(x, z), z)).collect();
    let quads = (0..side * side).map(|i| i / side * (side + 1) + i % side);
    let triangles = quads.flat_map(|a| [[a, a + 1, a + side + 2], [a, a + side + 2, a + side + 1]]).collect();
    Mesh { positions, triangles, ..Mesh::default() }
}

/// The most memory that the process ever had; 0 where the system does not say.
fn peak_gb() -> f64 {
    peak_bytes().unwrap_or(0) as f64 * 1e-9
}
