//! Lights a scene that a path tracer can light as well, and writes both what was found and what the other needs to know:
//! `cargo run -p heliodon_lightmap --example truth_scene -- cornell|lamps|workshop FOLDER [--size N] [--error E] [--bounces N] [--stride N] [--samples N]`.
//!
//! In the folder, little-endian: `positions.f32`, `triangles.u32`, `albedo.f32` (one for each triangle), `texel_positions.f32` (where rays start), `texel_normals.f32`, `light.f32`
//! (irradiance over pi), `texel_flags.u8` (1: covered and valid), and `scene.json`. `scripts/lightmap/mitsuba_texels.py` reads them.

use glam::Vec3;
use heliodon_lightmap::lights::{Amount, DirectionalSpec, Light, LightSpec, NoFiles, Photometry, PointSpec, RectangleSpec};
use heliodon_lightmap::packing::PackParams;
use heliodon_lightmap::solve::models::{Lambertian, Realistic};
use heliodon_lightmap::solve::{Models, Scene, SolveParams, solve};
use heliodon_lightmap::texels::{Texel, texels};
use heliodon_lightmap::unwrap::{UnwrapParams, unwrap};
use heliodon_math::dome::ConstantSky;
use heliodon_math::frame::unit_or;
use heliodon_mesh::workshop::{WorkshopParams, workshop};
use heliodon_rays::{BuildParams, TriangleScene};
use heliodon_testkit::scenes::{self, cuboid, rectangle};
use std::error::Error;
use std::fs;
use std::path::Path;
use std::time::Instant;

/// A scene, and what lights it.
struct Stage {
    scene: scenes::Scene,
    albedo: Vec<Vec3>,
    /// Triangles that have texels: the first ones.
    with_texels: usize,
    lights: Vec<LightSpec>,
    /// Of an even sky.
    sky: Vec3,
    json: String,
}

const PANE: [[f64; 3]; 3] = [[-0.3, 1.97, -0.3], [0.3, 1.97, -0.3], [-0.3, 1.97, 0.3]];
const PANE_RADIANCE: f64 = 12.0;

/// A room of two metres with two blocks; of its own triangles those that `keep` says.
fn room(keep: impl Fn([Vec3; 3]) -> bool) -> scenes::Scene {
    let turned = |scene: scenes::Scene, angle: f32, by: Vec3| {
        let turn = glam::Quat::from_rotation_y(angle);
        let mut scene = scene;
        scene.positions.iter_mut().for_each(|p| *p = turn * *p + by);
        scene.normals.iter_mut().for_each(|n| *n = turn * *n);
        scene
    };
    let mut room = cuboid(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 2.0, 1.0), 1).inside_out();
    let positions = &room.positions;
    room.triangles.retain(|t| keep(t.map(|v| positions[v as usize])));
    let tall = turned(cuboid(Vec3::new(-0.3, 0.0, -0.3), Vec3::new(0.3, 1.2, 0.3), 1), 0.3, Vec3::new(-0.35, 0.0, -0.3));
    let short = turned(cuboid(Vec3::new(-0.3, 0.0, -0.3), Vec3::new(0.3, 0.6, 0.3), 1), -0.3, Vec3::new(0.35, 0.0, 0.3));
    room.and(tall).and(short)
}

/// The albedo of its triangles: grey, but of a red and a green wall.
fn albedos(scene: &scenes::Scene) -> Vec<Vec3> {
    let of = |t: &[u32; 3]| match t.map(|v| scene.positions[v as usize].x) {
        x if x == [-1.0; 3] => Vec3::new(0.63, 0.065, 0.05),
        x if x == [1.0; 3] => Vec3::new(0.14, 0.45, 0.091),
        _ => Vec3::new(0.725, 0.71, 0.68),
    };
    scene.triangles.iter().map(of).collect()
}

/// A closed room, a red and a green wall, two blocks, a pane that shines below the ceiling.
fn cornell() -> Stage {
    let lit = room(|_| true);
    let with_texels = lit.triangles.len();
    let [corner, right, up] = PANE.map(|p| glam::DVec3::from(p).as_vec3());
    // a black pane, a hair above what shines
    let scene = lit.and(rectangle(corner + Vec3::Y * 1e-3, right - corner, up - corner, 1));
    let pane = RectangleSpec {
        name: None,
        corners: PANE,
        two_sided: false,
        colour: [1.0, 0.8, 0.5],
        amount: Amount::Radiance(PANE_RADIANCE),
    };
    let json = format!(
        "\"pane\": {{\"corners\": {PANE:?}, \"radiance\": {:?}}}",
        [PANE_RADIANCE, 0.8 * PANE_RADIANCE, 0.5 * PANE_RADIANCE]
    );
    let mut albedo = albedos(&scene);
    albedo[with_texels..].fill(Vec3::ZERO);
    Stage { scene, albedo, with_texels, lights: vec![LightSpec::Rectangle(pane)], sky: Vec3::ZERO, json }
}

/// The same room open to the front: a sun with a wide disc and an even sky come in, and a lamp hangs between the blocks.
fn lamps() -> Stage {
    let scene = room(|corners| corners.iter().any(|p| p.z < 1.0));
    let (direction, angular_radius_deg, irradiance) = ([0.3, 0.5, 1.0], 3.0, 4.0);
    let sun = DirectionalSpec {
        name: None,
        direction,
        angular_radius_deg,
        colour: [1.0, 0.9, 0.8],
        amount: Amount::Irradiance(irradiance),
    };
    let place = [0.1, 1.5, -0.1];
    let lamp = PointSpec { name: None, place, colour: [1.0, 0.6, 0.3], amount: Amount::RadiantIntensity(1.0) };
    let json = format!(
        "\"lamps\": [{{\"place\": {place:?}, \"intensity\": [1.0, 0.6, 0.3]}}, {{\"direction\": {direction:?}, \
         \"angular_radius_deg\": {angular_radius_deg:?}, \"irradiance\": {:?}}}], \"sky\": [0.5, 0.5, 0.5]",
        [irradiance, 0.9 * irradiance, 0.8 * irradiance]
    );
    let (with_texels, albedo) = (scene.triangles.len(), albedos(&scene));
    let lights = vec![LightSpec::Directional(sun), LightSpec::Point(lamp)];
    Stage { scene, albedo, with_texels, lights, sky: Vec3::splat(0.5), json }
}

/// The sculptor's workshop, under an even sky and a sun without a disc.
fn studio() -> Stage {
    let mut scene = scenes::Scene::default();
    let mut albedo = Vec::new();
    for part in workshop(&WorkshopParams::default()).parts {
        let mesh = part.mesh;
        let color = |t: &[u32; 3]| match mesh.colors_linear.is_empty() {
            true => Vec3::splat(0.5),
            false => t.iter().map(|&v| mesh.colors_linear[v as usize]).sum::<Vec3>() / 3.0,
        };
        albedo.extend(mesh.triangles.iter().map(color));
        scene = scene.and(scenes::Scene {
            positions: mesh.positions.clone(),
            normals: mesh.normals.clone(),
            triangles: mesh.triangles.clone(),
        });
    }
    let direction = [0.25, 0.62, 0.75];
    let sun = DirectionalSpec {
        name: None,
        direction,
        angular_radius_deg: 0.0,
        colour: [1.0, 0.9, 0.8],
        amount: Amount::Irradiance(30.0),
    };
    let json =
        format!("\"sun\": {{\"direction\": {direction:?}, \"irradiance\": [30.0, 27.0, 24.0]}}, \"sky\": [1.0, 1.0, 1.0]");
    let with_texels = scene.triangles.len();
    Stage { scene, albedo, with_texels, lights: vec![LightSpec::Directional(sun)], sky: Vec3::ONE, json }
}

#[expect(clippy::print_stdout, reason = "a program for people")]
fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, folder] =
        arguments.get(..2).and_then(|a| <&[String; 2]>::try_from(a).ok()).ok_or("name a scene and a folder")?;
    let value = |name: &str| arguments.iter().position(|a| a == name).and_then(|i| arguments.get(i + 1));
    let number = |name: &str, otherwise: f32| value(name).map_or(Ok(otherwise), |text| text.parse::<f32>());
    let stage = match name.as_str() {
        "cornell" => cornell(),
        "lamps" => lamps(),
        "workshop" => studio(),
        other => return Err(format!("no scene is called {other}").into()),
    };
    let side = number("--size", 256.0)? as u32;
    let params = SolveParams {
        bounces: number("--bounces", 4.0)? as u32,
        error: number("--error", 0.02)?,
        first_stride: number("--stride", 8.0)? as u32,
        samples: number("--samples", 2048.0)? as u32,
        light_samples: number("--light-samples", 256.0)? as u32,
        ..SolveParams::default()
    };
    let scene = &stage.scene;
    let pack = PackParams { width: side, height: side, ..PackParams::default() };
    let lit = &scene.triangles[..stage.with_texels];
    let unwrapped = unwrap(&scene.positions, lit, &[], &UnwrapParams { pack, ..UnwrapParams::default() })?;
    let texels = texels(&unwrapped, side, side);
    let rays = TriangleScene::build(&scene.positions, &scene.triangles, &BuildParams::default())?;
    let lights =
        stage.lights.iter().map(|spec| Light::new(spec, Photometry::HOUSE, &NoFiles)).collect::<Result<Vec<_>, _>>()?;
    let begun = Instant::now();
    let map = solve(
        &Scene {
            rays: &rays,
            positions: &scene.positions,
            normals: &scene.normals,
            triangles: &scene.triangles,
            unwrapped: &unwrapped,
            texels: &texels,
            sides: [side; 2],
            albedo: &|t, _, _| stage.albedo[t as usize],
            lights: &lights,
            sky: &ConstantSky(stage.sky),
        },
        &Models { illumination: &Realistic, surface: &Lambertian },
        &params,
    )?;
    let seconds = begun.elapsed().as_secs_f64();
    println!(
        "{{\"scene\": \"{name}\", \"texels\": {}, \"sampled\": {:?}, \"inside\": {}, \"rays\": {}, \"seconds\": {seconds:.2}, \"mean\": {:?}, \"seam\": {}}}",
        map.notes.texels, map.notes.sampled, map.notes.inside, map.notes.rays, map.notes.mean, map.notes.widest_seam
    );
    let folder = Path::new(folder);
    fs::create_dir_all(folder)?;
    let write = |name: &str, vectors: &[Vec3]| {
        fs::write(folder.join(name), vectors.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes).collect::<Vec<u8>>())
    };
    let mix = |of: &[Vec3], t: &Texel| t.mix(scene.triangles[t.triangle as usize].map(|v| of[v as usize]));
    let normals: Vec<Vec3> = texels.iter().map(|t| unit_or(mix(&scene.normals, t), Vec3::Y)).collect();
    // off the sides of triangles: a ray that starts in the plane of a wall is on neither side of it
    let inward = |t: &Texel| Texel { weights: t.weights * 0.9985 + 0.0005, ..*t };
    let start = |(t, n): (&Texel, &Vec3)| mix(&scene.positions, &inward(t)) + *n * rays.start_offset();
    let starts: Vec<Vec3> = texels.iter().zip(&normals).map(start).collect();
    write("positions.f32", &scene.positions)?;
    write("albedo.f32", &stage.albedo)?;
    write("texel_positions.f32", &starts)?;
    write("texel_normals.f32", &normals)?;
    write("light.f32", &map.light)?;
    fs::write(
        folder.join("triangles.u32"),
        scene.triangles.iter().flatten().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>(),
    )?;
    let flags: Vec<u8> = texels.iter().zip(&map.valid).map(|(t, valid)| u8::from(t.is_covered && *valid)).collect();
    fs::write(folder.join("texel_flags.u8"), flags)?;
    fs::write(folder.join("scene.json"), format!("{{{}, \"bounces\": {}}}\n", stage.json, params.bounces))?;
    map.image(&texels, 0, [side; 2]).write_exr(folder.join("light.exr"))?;
    Ok(())
}
