//! What a light map of a site costs, and how far it is off another one:
//! `cargo run -p heliodon_bake --example lightmap_cost -- SITE [--size N] [--error E] [--samples N] [--bounces N] [--stride N] [--seed N] [--keep FILE] [--beside FILE]`.
//!
//! The charts and the sky are those of `heliodon lightmap SITE --sky even`, without the site's lamps. One line of JSON: seconds of the solve by the clock and (Linux)
//! of the processor, what was sampled, and the difference to the map in `--beside`, the root mean square over covered texels whose eight neighbours are covered as
//! well, as a part of the mean; `scripts/lightmap/cycles_bake.py` measures the same of files. Of two maps that differ in their seed alone, it is the noise of one times the root of two. `--keep`
//! writes the light (little-endian `f32`, three for each texel).

use glam::Vec3;
use heliodon_bake::report::Silent;
use heliodon_bake::texels_first;
use heliodon_bundle::site::Site;
use heliodon_lightmap::packing::PackParams;
use heliodon_lightmap::solve::models::{Lambertian, Realistic};
use heliodon_lightmap::solve::{Models, Scene, SolveParams, solve};
use heliodon_lightmap::texels::{Texel, texels};
use heliodon_lightmap::unwrap::{UnwrapParams, unwrap};
use heliodon_math::dome::ConstantSky;
use heliodon_mesh::albedo::MeshAlbedo;
use heliodon_rays::{BuildParams, TriangleScene};
use heliodon_testkit::process::processor_seconds;
use std::collections::HashSet;
use std::error::Error;
use std::path::Path;
use std::time::Instant;

/// Whether a texel and all around it are covered.
fn inner(texels: &[Texel]) -> Vec<bool> {
    let covered = texels.iter().filter(|texel| texel.is_covered);
    let covered: HashSet<(u16, u16, u16)> = covered.map(|texel| (texel.sheet, texel.x, texel.y)).collect();
    let around = |texel: &Texel, dx: u16, dy: u16| {
        covered.contains(&(texel.sheet, (texel.x + dx).wrapping_sub(1), (texel.y + dy).wrapping_sub(1)))
    };
    texels.iter().map(|texel| (0..3).all(|dy| (0..3).all(|dx| around(texel, dx, dy)))).collect()
}

/// The root mean square of what two maps differ by where it is `asked`, as a part of the second one's mean.
fn off(light: &[Vec3], beside: &[f32], asked: &[bool]) -> f64 {
    let pairs = light.iter().zip(beside.as_chunks::<3>().0).zip(asked).filter(|(_, asked)| **asked);
    let (mut squares, mut sum, mut count) = (0.0, 0.0, 0.0);
    for ((light, beside), _) in pairs {
        let beside = Vec3::from_array(*beside);
        squares += f64::from((*light - beside).length_squared());
        sum += f64::from(beside.element_sum());
        count += 3.0;
    }
    (squares / count).sqrt() / (sum / count)
}

#[expect(clippy::print_stdout, reason = "a program for people")]
fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let site = arguments.first().ok_or("name a site")?;
    let value = |name: &str| arguments.iter().position(|a| a == name).and_then(|i| arguments.get(i + 1));
    let number = |name: &str, otherwise: f32| value(name).map_or(Ok(otherwise), |text| text.parse::<f32>());
    let site = Site::read(Path::new(site))?;
    let (scene, density) = texels_first(&site, heliodon_bake::scene::read(&site, &site.input_files()?, &Silent)?, false);
    let mesh = scene.mesh;
    let rays = TriangleScene::build(&mesh.positions, &mesh.triangles, &BuildParams::asked_for_long(mesh.triangles.len()))?;
    let side = number("--size", 512.0)? as u32;
    let pack = PackParams { width: side, height: side, ..PackParams::default() };
    let with_texels = &mesh.triangles[..density.len()];
    let unwrapped = unwrap(&mesh.positions, with_texels, &density, &UnwrapParams { pack, ..UnwrapParams::default() })?;
    let texels = texels(&unwrapped, side, side);
    let params = SolveParams {
        bounces: number("--bounces", 4.0)? as u32,
        error: number("--error", 0.1)?,
        first_stride: number("--stride", 8.0)? as u32,
        samples: number("--samples", 256.0)? as u32,
        seed: number("--seed", 1.0)? as u32,
        ..SolveParams::default()
    };
    let (begun, processor) = (Instant::now(), processor_seconds());
    let albedo = MeshAlbedo::new(&mesh, 0.0);
    let scene = Scene {
        rays: &rays,
        positions: &mesh.positions,
        normals: &mesh.normals,
        triangles: &mesh.triangles,
        unwrapped: &unwrapped,
        texels: &texels,
        sides: [side; 2],
        albedo: &|triangle, u, v| albedo.albedo(triangle, u, v),
        lights: &[],
        sky: &ConstantSky(Vec3::ONE),
    };
    let map = solve(&scene, &Models { illumination: &Realistic, surface: &Lambertian }, &params)?;
    let seconds = begun.elapsed().as_secs_f64();
    let worked = processor_seconds().zip(processor).map_or(f64::NAN, |(now, then)| now - then);
    let notes = &map.notes;
    let mut told = format!(
        "\"size\": {side}, \"seconds\": {seconds:.2}, \"processor_s\": {worked:.2}, \"texels\": {}, \"sampled\": {:?}, \"rays\": {}, \"mean\": {:?}, \"seam\": {}, \"codes\": {}, \"places\": {:?}",
        notes.texels, notes.sampled, notes.rays, notes.mean, notes.widest_seam, notes.widest_seam_codes, notes.seam_places
    );
    if let Some(file) = value("--beside") {
        let bytes = std::fs::read(file)?;
        let beside: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|four| f32::from_le_bytes(*four)).collect();
        if beside.len() != 3 * map.light.len() {
            return Err(format!("{file} has {} numbers for {} texels", beside.len(), map.light.len()).into());
        }
        let asked = inner(&texels);
        let count = asked.iter().filter(|asked| **asked).count();
        told += &format!(", \"inner\": {count}, \"off\": {:.5}", off(&map.light, &beside, &asked));
    }
    println!("{{{told}}}");
    if let Some(file) = value("--keep") {
        let bytes: Vec<u8> = map.light.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes).collect();
        std::fs::write(file, bytes)?;
    }
    Ok(())
}
