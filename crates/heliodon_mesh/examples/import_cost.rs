//! What reading mesh files costs: `cargo run -p heliodon_mesh --example import_cost -- FILE...`
//!
//! Prints for each file its size, vertices and triangles, the seconds, and the growth of the process's peak memory in bytes a
//! triangle (Linux; give one file for a clean figure).

use heliodon_mesh::import::{ImportOptions, ImportReport, read_reporting};
use heliodon_testkit::process::peak_bytes;
use std::path::Path;
use std::time::Instant;

#[expect(clippy::print_stdout, reason = "a program for people")]
fn main() {
    let before = peak_bytes().unwrap_or(0);
    for name in std::env::args().skip(1) {
        let start = Instant::now();
        let mut report = ImportReport::default();
        let result = read_reporting(Path::new(&name), &ImportOptions::default(), &mut report);
        let seconds = start.elapsed().as_secs_f64();
        match result {
            Ok(mesh) => {
                let triangles = mesh.triangles.len();
                println!(
                    "{name}: {} vertices, {triangles} triangles, {} materials, {seconds:.3} s, {:.0} bytes a triangle at the peak, {:.0} kept{}",
                    mesh.positions.len(),
                    mesh.materials.len(),
                    (peak_bytes().unwrap_or(0) - before) as f64 / triangles as f64,
                    mesh.memory_bytes() as f64 / triangles as f64,
                    mesh.validate().map_or_else(|error| format!(", INVALID: {error}"), |()| String::new()),
                );
            }
            Err(error) => println!("{error}"),
        }
        report.warnings.iter().for_each(|warning| println!("  {warning}"));
    }
}
