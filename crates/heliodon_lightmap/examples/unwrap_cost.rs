//! What charts and packing cost, and how much of the texture they use:
//! `cargo run -p heliodon_lightmap --example unwrap_cost -- MESH... [--size N] [--margin N] [--cone DEGREES] [--runs N] [--write FOLDER]`.
//!
//! Prints a line of JSON for each mesh, of several runs the median seconds; with `--write`, a picture of each texture, a colour for each chart.

use glam::{Vec2, Vec3};
use heliodon_image::SrgbImage;
use heliodon_lightmap::charts::{Chart, ChartParams, charts};
use heliodon_lightmap::packing::{PackError, PackParams, Packing, pack};
use heliodon_mesh::Mesh;
use heliodon_mesh::import::{ImportOptions, read};
use std::error::Error;
use std::path::Path;
use std::time::Instant;

#[expect(clippy::print_stdout, reason = "a program for people")]
fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str| arguments.iter().position(|a| a == name).and_then(|i| arguments.get(i + 1));
    let number = |name: &str, otherwise: u32| value(name).map_or(Ok(otherwise), |text| text.parse::<u32>());
    let size = number("--size", 2048)?;
    let pack_params = PackParams { width: size, height: size, margin: number("--margin", 2)?, ..PackParams::default() };
    let chart_params = ChartParams { cone_deg: number("--cone", 40)? as f32, ..ChartParams::default() };
    for file in arguments.iter().take_while(|argument| !argument.starts_with("--")) {
        let mesh = read(Path::new(file), &ImportOptions::default())?;
        let run = || {
            let begun = Instant::now();
            let charts = charts(&mesh.positions, &mesh.triangles, &[], &chart_params);
            let charts_s = begun.elapsed().as_secs_f64();
            let packing = pack(&charts, |t| mesh.corners(t as usize), &pack_params)?;
            Ok((begun.elapsed().as_secs_f64(), charts_s, charts, packing))
        };
        let mut runs = (0..number("--runs", 1)?.max(1)).map(|_| run()).collect::<Result<Vec<_>, PackError>>()?;
        runs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (all_s, charts_s, charts, packing) = runs.swap_remove(runs.len() / 2);
        let name = Path::new(file).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        println!(
            "{{\"mesh\": \"{name}\", \"triangles\": {}, \"charts\": {}, \"utilisation\": {:.4}, \"texels_per_m\": {:.3}, \
             \"charts_s\": {charts_s:.3}, \"pack_s\": {:.3}, \"all_s\": {all_s:.3}}}",
            mesh.triangles.len(),
            charts.len(),
            packing.utilisation,
            packing.per_m,
            all_s - charts_s,
        );
        if let Some(folder) = value("--write") {
            picture(&mesh, &charts, &packing, size).write_png(Path::new(folder).join(format!("{name}.png")))?;
        }
    }
    Ok(())
}

/// The texture: a colour for each chart, where texels' middles lie in a triangle.
fn picture(mesh: &Mesh, charts: &[Chart], packing: &Packing, size: u32) -> SrgbImage {
    let mut pixels = vec![[0, 0, 0, 255]; (size * size) as usize];
    for (index, chart) in charts.iter().enumerate() {
        let hash = (index as u32 + 1).wrapping_mul(0x9E37_79B9);
        let color = [(hash >> 24) as u8 | 64, (hash >> 16) as u8 | 64, (hash >> 8) as u8 | 64, 255];
        for &t in &chart.triangles {
            let [a, b, c] = mesh.corners(t as usize).map(|p: Vec3| packing.texel(index, chart.coordinates(p)));
            let (low, high) = (a.min(b).min(c).floor().max(Vec2::ZERO), a.max(b).max(c).ceil().min(Vec2::splat(size as f32)));
            for y in low.y as u32..high.y as u32 {
                for x in low.x as u32..high.x as u32 {
                    let p = Vec2::new(x as f32, y as f32) + 0.5;
                    let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| (to - from).perp_dot(p - from));
                    if sides.iter().all(|side| *side >= 0.0) || sides.iter().all(|side| *side <= 0.0) {
                        pixels[(y * size + x) as usize] = color;
                    }
                }
            }
        }
    }
    SrgbImage { width: size, height: size, pixels }
}
