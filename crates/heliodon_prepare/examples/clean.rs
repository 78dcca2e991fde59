//! What cleaning, uniting and splitting cost and find: `clean FILE...` reads meshes, `clean N` makes a noisy ground of N million triangles
//! with faults in it. Prints reports, seconds and the peak of memory.
#![expect(clippy::print_stdout, reason = "a program for people")]

use glam::Vec3;
use heliodon_mesh::Mesh;
use heliodon_mesh::import::{ImportOptions, ImportReport, read_reporting};
use heliodon_prepare::clean::{CleanParams, clean};
use heliodon_prepare::solids::{SolidsParams, unite};
use heliodon_prepare::split::split;
use heliodon_testkit::process::peak_bytes;
use std::path::Path;
use std::time::Instant;

fn main() {
    for argument in std::env::args().skip(1) {
        let (name, mut mesh) = match argument.parse::<f64>() {
            Ok(millions) => (format!("{millions} million"), noisy_ground((millions * 1.0e6) as usize)),
            Err(_) => match read_reporting(Path::new(&argument), &ImportOptions::default(), &mut ImportReport::default()) {
                Ok(mesh) => (argument, mesh),
                Err(error) => {
                    println!("{error}");
                    continue;
                }
            },
        };
        println!("\n{name}: {} MB, {}", mesh.memory_bytes() >> 20, peak());
        let begun = Instant::now();
        let report = clean(&mut mesh, &CleanParams::default());
        println!("{report}\n  cleaned in {:.2} s, {}", begun.elapsed().as_secs_f64(), peak());
        let begun = Instant::now();
        let report = unite(&mut mesh, &SolidsParams::default());
        println!("{report}\n  united in {:.2} s, {}", begun.elapsed().as_secs_f64(), peak());
        // to a thirtieth of its size, a tenth of that around its middle, and dense meshes finer than they are there
        let Some((low, high)) = mesh.bounds() else { continue };
        let (middle, size, edge) = ((low + high) * 0.5, low.distance(high), mesh.median_edge_length());
        let target = |p: Vec3, _: Vec3| {
            let distance = p.distance(middle);
            (distance * 0.06).clamp(size * 0.003, size * 0.03).min(edge * (0.6 + 6.0 * distance / size))
        };
        let begun = Instant::now();
        match split(&mut mesh, target, 100_000_000) {
            Ok(report) => println!("{report}\n  split in {:.2} s, {}", begun.elapsed().as_secs_f64(), peak()),
            Err(error) => println!("{error}"),
        }
    }
}

/// A rough square kilometre whose vertices are there three times at every fourth row, with a hundredth of its triangles turned round and
/// some missing, doubled or flat.
fn noisy_ground(triangles: usize) -> Mesh {
    let side = ((triangles / 2) as f64).sqrt() as u32;
    let row = side + 1;
    let mix = |i: u32| {
        (u64::from(i) + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(23).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 40
    };
    let noise = |i: u32| mix(i) as f32 / (1 << 24) as f32;
    let point = |i: u32| {
        let (x, z) = ((i % row) as f32, (i / row) as f32);
        Vec3::new(x + 0.3 * noise(i), noise(i ^ 0x5555_5555), z + 0.3 * noise(!i)) * (1000.0 / side as f32)
    };
    let mut mesh = Mesh { positions: (0..row * row).map(point).collect(), ..Mesh::default() };
    for i in (0..side * row).filter(|i| i % row != side) {
        let (a, b, c, d) = (i, i + row, i + 1, i + row + 1);
        mesh.triangles.extend([[a, b, c], [c, b, d]]);
        match mix(i) % 1000 {
            0..10 => mesh.triangles.last_mut().into_iter().for_each(|t| t.swap(0, 1)),
            10 => drop(mesh.triangles.pop()),
            11 => mesh.triangles.push([b, d, c]),
            12 => mesh.triangles.push([a, a, d]),
            13 => mesh.triangles.push([b, c, d]),
            _ => {}
        }
    }
    for t in (0..mesh.triangles.len()).step_by(37) {
        let vertex = mesh.triangles[t][0];
        mesh.triangles[t][0] = mesh.positions.len() as u32;
        mesh.positions.push(mesh.positions[vertex as usize]);
    }
    mesh.normals = vec![Vec3::Y; mesh.positions.len()];
    mesh
}

/// The most memory that the process has had; 0 where the system does not say.
fn peak() -> String {
    format!("peak {} MB", peak_bytes().unwrap_or(0) / 1_000_000)
}
