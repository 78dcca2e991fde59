//! Walks with and without culling: what occluders hide changes no pixel, what is small changes few.

#![expect(clippy::unwrap_used, reason = "a test ends where something fails")]

use bevy::prelude::{Entity, With};
use glam::Vec3;
use heliodon_bundle::site::{Matte, Site};
use heliodon_bundle::{BundleMeta, BundleWriter, LightLayout, LitChunk, VertexLight};
use heliodon_image::{HdrImage, SrgbImage};
use heliodon_math::sh::open_transfer9;
use heliodon_mesh::Mesh;
use heliodon_mesh::chunk::split;
use heliodon_mesh::part::{PartRole, SitePart};
use heliodon_mesh::temple::{TempleParams, build};
use heliodon_mesh::workshop::{WorkshopParams, workshop};
use heliodon_sky::lapse::{Lapse, LapseStep, Sun};
use heliodon_view::bench::walk::on_the_way;
use heliodon_view::culling::{CullingTold, Saved};
use heliodon_view::headless::{RenderOptions, Renderer, Shot};
use heliodon_view::{Culling, DaylightCamera, ExactAtRest, Pose};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const LAYOUT: LightLayout = LightLayout { sun_steps: 1, coefficients: 4, channels: 1, sun_bounce_functions: 0 };
/// Columns and rows of the pictures.
const SIZE: (u32, u32) = (320, 240);

/// A bundle of meshes in the light of an open sky, and the folder that it is in as long as that is held.
fn bundle(meshes: &[Mesh], mattes: &[Matte]) -> (TempDir, PathBuf) {
    bundle_on_ground(meshes, &[], mattes, "")
}

/// A bundle of the parts of a procedural monument.
fn monument(parts: Vec<SitePart>) -> (TempDir, PathBuf) {
    let (ground, walls): (Vec<SitePart>, Vec<SitePart>) = parts.into_iter().partition(|part| part.role == PartRole::Ground);
    let [ground, walls] = [ground, walls].map(|parts| parts.into_iter().map(|part| part.mesh).collect::<Vec<Mesh>>());
    bundle_on_ground(&walls, &ground, &[], "")
}

/// Walls and ground as two parts; the site says `of_walls` of the first.
fn bundle_on_ground(walls: &[Mesh], ground: &[Mesh], mattes: &[Matte], of_walls: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bundle");
    let text = format!(
        "[site]\nname = \"Walls\"\n[[part]]\nfile = \"wall.obj\"\n{of_walls}\n[[part]]\nfile = \"ground.obj\"\nrole = \"ground\"\n[sky]\nprobes = \"*.hdr\"\nmapping = \"lat-long\"\n"
    );
    let site = Site::parse(&text, "walls/site.toml").unwrap();
    let meta = BundleMeta { mattes: mattes.to_vec(), ..BundleMeta::from_site(site.file(), LAYOUT, 1e-4) };
    let mut writer = BundleWriter::create(&path, meta).unwrap();
    for (part, mesh) in walls.iter().map(|mesh| (0, mesh)).chain(ground.iter().map(|mesh| (1, mesh))) {
        for chunk in split(mesh, 5000) {
            let of = |values: &[Vec3]| chunk.vertices.iter().map(|&vertex| values[vertex as usize]).collect::<Vec<Vec3>>();
            let chunk = lit(of(&mesh.positions), of(&mesh.normals), of(&mesh.colors_linear), chunk.triangles);
            writer.push_chunk(&LitChunk { part, ..chunk }).unwrap();
        }
    }
    let map = HdrImage::from_fn(32, 16, |x, y| Vec3::new(0.3 + 0.02 * x as f32, 0.5, 0.3 + 0.02 * y as f32));
    writer.add_sky_map("sky/0.hdr", &map.to_hdr_bytes()).unwrap();
    let step = LapseStep {
        time: "12:00".to_owned(),
        sun: Some(Sun { direction: [0.6, 0.8, 0.0], irradiance: [2.0, 1.9, 1.6], clipped: false }),
        sky: vec![[1.5, 1.8, 2.0], [0.2; 3], [0.1; 3], [0.3; 3]],
        sky_map: "sky/0.hdr".to_owned(),
        fitted: None,
        exposure_stops: 0.0,
        mask_bit: 0,
        sun_in_map: false,
    };
    writer.finish(&Lapse { steps: vec![step], sun_bounce_basis: None }).unwrap();
    (folder, path)
}

fn lit(positions: Vec<Vec3>, normals: Vec<Vec3>, albedo: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> LitChunk {
    let mut light = VertexLight::zeros(LAYOUT, positions.len());
    for (v, (position, normal)) in positions.iter().zip(&normals).enumerate() {
        light.sun_mask[v] = u32::from((position.x * 3.0).sin() + (position.z * 2.0).sin() > 0.0);
        light.sky_transfer[4 * v..4 * v + 4].copy_from_slice(&open_transfer9(*normal)[..4]);
    }
    let valid = vec![1; positions.len()];
    LitChunk {
        part: 0,
        texture: None,
        detail: None,
        positions,
        normals,
        uvs: Vec::new(),
        texel_uvs: Vec::new(),
        albedo,
        triangles,
        valid,
        light,
    }
}

/// How the pictures of a walk are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Drawn {
    /// As stills are.
    Exact,
    /// As a window's moving eye is drawn.
    ByPixel,
    /// Every triangle that culling leaves, as a GPU draws them.
    Plain,
}

fn renderer(bundle: &Path, culling: Culling, drawn: Drawn) -> Renderer {
    let mut renderer = Renderer::new(bundle, SIZE.0, SIZE.1, RenderOptions { samples: 1 }).unwrap();
    renderer.wait_for_culling().unwrap();
    let app = renderer.app_mut();
    app.insert_resource(culling);
    match drawn {
        Drawn::Exact => {}
        Drawn::ByPixel => {
            let world = app.world_mut();
            let camera = world.query_filtered::<Entity, With<DaylightCamera>>().single(world).unwrap();
            world.entity_mut(camera).remove::<ExactAtRest>();
        }
        Drawn::Plain => heliodon_view::bench::walk::draw_plainly(app),
    }
    renderer
}

fn saved(renderer: &mut Renderer) -> Saved {
    renderer.app_mut().world().resource::<CullingTold>().last()
}

/// Pictures of a walk around `path`, each with what culling saved.
fn walk(renderer: &mut Renderer, path: &[Vec3], count: usize) -> Vec<(SrgbImage, Saved)> {
    (0..count)
        .map(|step| {
            let shot =
                Shot { pose: on_the_way(path, step as f32 / count as f32), fov_deg: 60.0, ..renderer.home_shot(43200.0) };
            let picture = renderer.render(&shot).unwrap();
            (picture, saved(renderer))
        })
        .collect()
}

/// Pixels that differ.
fn differing(a: &SrgbImage, b: &SrgbImage) -> Vec<usize> {
    (0..a.pixels.len()).filter(|&i| a.pixels[i] != b.pixels[i]).collect()
}

fn the_same_with_shadow_culling(bundle: &Path, path: &[Vec3], count: usize, least_part: f64) {
    for drawn in [Drawn::Plain, Drawn::Exact, Drawn::ByPixel] {
        let [with, without] =
            [Culling::exact(), Culling::none()].map(|culling| walk(&mut renderer(bundle, culling, drawn), path, count));
        let (mut met, mut hidden) = (0, 0);
        for (step, ((with, saved), (without, nothing))) in with.iter().zip(&without).enumerate() {
            assert!(with == without, "{drawn:?}, step {step}: {} pixels", differing(with, without).len());
            assert_eq!((saved.met, nothing.hidden.triangles, saved.small.triangles), (nothing.met, 0, 0));
            (met, hidden) = (met + saved.met.triangles, hidden + saved.hidden.triangles);
        }
        let part = hidden as f64 / met as f64;
        assert!(part > least_part, "{drawn:?}: {part} of {met} triangles are hidden");
    }
}

#[test]
fn a_walk_through_the_workshop_is_the_same_with_shadow_culling() {
    let shop = workshop(&WorkshopParams::default());
    let (_folder, bundle) = monument(shop.parts);
    // Along the nave, behind the statue, through a wall, and around outside.
    let path = [
        Vec3::new(12.0, 1.7, 0.3),
        Vec3::new(-2.0, 1.7, -1.5),
        Vec3::new(-13.0, 2.5, -4.9),
        Vec3::new(-22.0, 1.7, -9.0),
        Vec3::new(-10.0, 3.0, 14.0),
        Vec3::new(21.0, 1.7, 3.0),
    ];
    the_same_with_shadow_culling(&bundle, &path, 24, 0.05);
}

#[test]
fn a_walk_through_a_colonnade_is_the_same_with_shadow_culling() {
    let temple = build(&TempleParams { triangles: 120_000, ..TempleParams::default() });
    let (_folder, bundle) = monument(temple.parts);
    // Along the north side and the west front between columns and cella, then through it.
    let path = [
        Vec3::new(25.0, 3.3, -12.3),
        Vec3::new(-31.5, 3.3, -12.3),
        Vec3::new(-31.5, 3.3, 12.3),
        Vec3::new(-26.0, 4.0, 0.5),
        Vec3::new(20.0, 4.0, 1.0),
    ];
    the_same_with_shadow_culling(&bundle, &path, 24, 0.01);
}

/// A vertical sheet of `cells` by `cells` quads across z.
fn sheet(z: f32, half: f32, cells: u32, color: Vec3) -> Mesh {
    let side = cells + 1;
    let at = |i: u32| (i as f32 / cells as f32 * 2.0 - 1.0) * half;
    let positions: Vec<Vec3> = (0..side * side).map(|v| Vec3::new(at(v % side), at(v / side), z)).collect();
    let quads = (0..cells * cells).map(|q| q / cells * side + q % cells);
    Mesh {
        normals: vec![Vec3::Z; positions.len()],
        colors_linear: vec![color; positions.len()],
        triangles: quads.flat_map(|a| [[a, a + 1, a + side], [a + 1, a + side + 1, a + side]]).collect(),
        positions,
        ..Mesh::default()
    }
}

#[test]
fn a_sheet_hides_what_is_behind_it_from_both_sides() {
    let red = Vec3::new(0.7, 0.1, 0.1);
    let meshes = [sheet(0.0, 4.0, 24, Vec3::splat(0.6)), sheet(-6.0, 2.0, 24, red), sheet(6.0, 2.0, 24, red)];
    let (_folder, bundle) = bundle(&meshes, &[]);
    let path = [Vec3::new(0.5, 0.2, 14.0), Vec3::new(-9.0, 0.4, 0.3), Vec3::new(1.0, -0.3, -14.0), Vec3::new(9.0, 1.0, 0.6)];
    the_same_with_shadow_culling(&bundle, &path, 16, 0.02);
}

#[test]
fn a_matte_hides_what_is_behind_it_though_nothing_is_seen_of_it() {
    let meshes = [sheet(-6.0, 2.0, 24, Vec3::new(0.7, 0.1, 0.1))];
    let matte = Matte::new([[-3.0, -3.0, 0.0], [3.0, -3.0, 0.0], [3.0, 3.0, 0.0], [-3.0, 3.0, 0.0]]);
    let (_folder, bundle) = bundle(&meshes, &[matte]);
    let at = |eye: Vec3| Pose::looking(eye, Vec3::new(0.0, 0.0, -6.0));
    let picture = |culling: Culling, pose: Pose| {
        let mut renderer = renderer(&bundle, culling, Drawn::Exact);
        let shot = Shot { pose, ..renderer.home_shot(43200.0) };
        let [red, green, ..] = renderer.render(&shot).unwrap().pixel(SIZE.0 / 2, SIZE.1 / 2).map(u32::from);
        (red > 2 * green, saved(&mut renderer).hidden.triangles)
    };
    assert_eq!(picture(Culling::none(), at(Vec3::Z * 8.0)), (true, 0));
    assert_eq!(picture(Culling::exact(), at(Vec3::Z * 8.0)), (false, 2 * 24 * 24));
    // Beside the matte it is seen again.
    assert_eq!(picture(Culling::exact(), at(Vec3::new(9.0, 0.0, 1.0))), (true, 0));
}

/// A pebble: a closed octahedron.
fn pebble(center: Vec3, half: f32) -> Mesh {
    let positions: Vec<Vec3> =
        [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z].map(|axis| center + axis * half).into();
    let corner = |axis: u32, negative: bool| 2 * axis + u32::from(negative);
    let mut triangles = Vec::new();
    for octant in 0..8 {
        let [x, y, z] = [0, 1, 2].map(|axis| corner(axis, octant >> axis & 1 == 1));
        let even = (octant as u32).count_ones().is_multiple_of(2);
        triangles.push(if even { [x, y, z] } else { [x, z, y] });
    }
    Mesh {
        normals: positions.iter().map(|&p| heliodon_math::frame::unit_or(p - center, Vec3::Y)).collect(),
        colors_linear: vec![Vec3::new(0.9, 0.9, 0.2); 6],
        positions,
        triangles,
        ..Mesh::default()
    }
}

/// Pebbles one behind the other on either side of a way, each far from the next.
fn pebbles() -> Vec<Mesh> {
    let mut meshes = vec![sheet(-120.0, 60.0, 4, Vec3::splat(0.4))];
    meshes.extend((0..40u16).map(|k| {
        let side = if k % 2 == 0 { -1.5 } else { 1.5 };
        pebble(Vec3::new(side - 0.1 * f32::from(k), -0.5, -2.0 * f32::from(k)), 0.04)
    }));
    meshes
}

#[test]
fn what_is_left_out_for_its_size_is_no_larger_than_the_threshold() {
    let (_folder, bundle) = bundle(&pebbles(), &[]);
    let threshold_px = 3.0;
    let small = Culling { shadow: false, contribution: true, threshold_px };
    let path = [Vec3::new(0.0, 0.0, 4.0), Vec3::new(0.3, 0.0, -20.0)];
    for drawn in [Drawn::Plain, Drawn::Exact] {
        let [with, without] = [small, Culling::none()].map(|culling| walk(&mut renderer(&bundle, culling, drawn), &path, 8));
        let mut left_out = 0;
        for ((with, saved), (without, _)) in with.iter().zip(&without) {
            left_out += saved.small.triangles;
            let mut off = differing(with, without);
            // Each pebble by itself: the box around what differs next to what differs.
            while let Some(first) = off.pop() {
                let place = |i: usize| (i as i32 % SIZE.0 as i32, i as i32 / SIZE.0 as i32);
                let mut blob = vec![first];
                let mut next = 0;
                while next < blob.len() {
                    let (x, y) = place(blob[next]);
                    let near = |&other: &usize| (place(other).0 - x).abs() <= 1 && (place(other).1 - y).abs() <= 1;
                    blob.extend(off.extract_if(.., |other| near(other)));
                    next += 1;
                }
                let reach = |of: fn((i32, i32)) -> i32| {
                    let of = |&i: &usize| of(place(i));
                    blob.iter().map(of).max().unwrap() - blob.iter().map(of).min().unwrap()
                };
                let widest = reach(|(x, _)| x).max(reach(|(_, y)| y)) + 1;
                // A ball of three pixels may reach into four.
                assert!(widest as f32 <= threshold_px + 1.0, "{drawn:?}: {widest} pixels differ together");
            }
        }
        assert!(left_out > 300, "{drawn:?}: {left_out}");
    }
}

#[test]
fn a_part_may_ask_for_its_own_least_size() {
    let mut pebbles = pebbles();
    let sheet = pebbles.remove(0);
    let small = Culling { shadow: false, contribution: true, threshold_px: 3.0 };
    let left_out = |of_walls: &str, culling: Culling| {
        let (_folder, bundle) = bundle_on_ground(&pebbles, std::slice::from_ref(&sheet), &[], of_walls);
        let mut renderer = renderer(&bundle, culling, Drawn::Plain);
        walk(&mut renderer, &[Vec3::Z * 4.0, Vec3::new(0.3, 0.0, -20.0)], 1)[0].1.small.triangles
    };
    let usual = left_out("", small);
    assert!(usual > 100, "{usual}");
    assert_eq!(left_out("least_px = 3", Culling { threshold_px: 1.0, ..small }), usual);
    assert_eq!(left_out("least_px = 0", small), 0);
    assert!(left_out("least_px = 12", small) > usual);
    assert_eq!(left_out("least_px = 12", Culling::none()), 0);
}

#[test]
fn a_pebble_that_was_left_out_comes_back_late_in_a_window_and_at_once_in_a_picture() {
    let meshes = [sheet(-120.0, 60.0, 4, Vec3::splat(0.4)), pebble(Vec3::new(0.0, 0.0, -10.0), 0.04)];
    let (_folder, bundle) = bundle(&meshes, &[]);
    let small = Culling { shadow: false, contribution: true, threshold_px: 4.0 };
    for (drawn, remembers) in [(Drawn::ByPixel, true), (Drawn::Exact, false)] {
        let mut renderer = renderer(&bundle, small, drawn);
        let mut drops = |eye_z: f32| {
            let pose = Pose::looking(Vec3::Z * eye_z, Vec3::Z * -200.0);
            let shot = Shot { pose, ..renderer.home_shot(43200.0) };
            renderer.render(&shot).unwrap();
            saved(&mut renderer).small.triangles > 0
        };
        let far = (0..800).map(|k| -9.0 + 0.05 * k as f32).find(|&z| drops(z)).unwrap();
        assert!(!drops(far - 3.0), "so near it is always there");
        assert!(drops(far + 0.1));
        assert_eq!(drops(far - 0.2), remembers, "{drawn:?}");
    }
}
