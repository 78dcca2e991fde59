//! Actors and lamps in pictures of the GPU (a software one will do).

#![expect(clippy::unwrap_used, reason = "a test ends where something fails")]

use crate::common;
use glam::Vec3;
use heliodon_bundle::BundleReader;
use heliodon_bundle::moment::{Blend, Day, Moment};
use heliodon_capture::impostor::{CaptureParams, capture};
use heliodon_image::HdrImage;
use heliodon_mesh::Mesh;
use heliodon_mesh::export::glb;
use heliodon_mesh::import::{Format, ImportOptions, ImportReport};
use heliodon_mesh::motion::{MovingMesh, from_bytes};
use heliodon_testkit::flip::mean_flip;
use heliodon_testkit::scenes::cuboid;
use heliodon_view::Pose;
use heliodon_view::actors::course::Course;
use heliodon_view::actors::levels::Directions;
use heliodon_view::actors::{Actors, Backend};
use heliodon_view::headless::{RenderOptions, Renderer, Shot};
use heliodon_view::impostor::Impostors;
use heliodon_view::lamps::{Cone, Lamp, Lamps};
use std::path::Path;
use tempfile::TempDir;

const EYE: Vec3 = Vec3::new(3.0, 6.0, 14.0);
/// What it looks at, on the ground.
const TARGET: Vec3 = Vec3::new(0.0, 0.0, 6.0);
const SIZE: [usize; 2] = [192, 144];

/// A court with one column, at noon.
struct Stage {
    folder: TempDir,
    renderer: Renderer,
    shot: Shot,
    moment: Moment,
}

impl Stage {
    fn new() -> Self {
        Self::sampled(1)
    }

    /// With so many samples along each side of a pixel.
    fn sampled(samples: u32) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let bundle = folder.path().join("court");
        common::Court { shafts: (1, 1), sun_steps: 4, sky_columns: 64, ..common::Court::small() }.write(&bundle).unwrap();
        let renderer = Renderer::new(&bundle, SIZE[0] as u32, SIZE[1] as u32, RenderOptions { samples }).unwrap();
        let day = Day::new(BundleReader::open(&bundle).unwrap().lapse().clone());
        let (first, last) = day.span_seconds();
        let clock_s = 0.5 * (first + last);
        let shot = Shot { pose: Pose::looking(EYE, TARGET), fov_deg: 60.0, ..renderer.home_shot(clock_s) };
        let moment = day.at(clock_s, Blend::Smooth);
        assert!(moment.sun_irradiance.max_element() > 0.0);
        Self { folder, renderer, shot, moment }
    }

    fn actors(&mut self) -> bevy::prelude::Mut<'_, Actors> {
        self.renderer.app_mut().world_mut().resource_mut::<Actors>()
    }

    fn add(&mut self, moving: MovingMesh, course: Course) {
        self.actors().add("somebody", moving, None, 1.0, course);
    }

    fn set_lamps(&mut self, lamps: Vec<Lamp>) {
        self.renderer.app_mut().world_mut().resource_mut::<Lamps>().lamps = lamps;
    }

    /// A picture; what is new is taken in one frame, and lit and drawn from the next on.
    fn picture(&mut self) -> HdrImage {
        for _ in 0..4 {
            self.renderer.render_linear(&self.shot).unwrap();
        }
        self.renderer.render_linear(&self.shot).unwrap()
    }

    /// The pixel in which a point of the world is.
    fn pixel(&self, place: Vec3) -> usize {
        let half = 30f32.to_radians().tan();
        let view = self.shot.pose.rotation().inverse() * (place - EYE);
        let x = 0.5 + 0.5 * view.x / -view.z / (half * 4.0 / 3.0);
        let y = 0.5 - 0.5 * view.y / -view.z / half;
        (y * SIZE[1] as f32) as usize * SIZE[0] + (x * SIZE[0] as f32) as usize
    }

    /// The point of the ground in the middle of a pixel.
    fn ground(&self, pixel: usize) -> Vec3 {
        let half = 30f32.to_radians().tan();
        let [x, y] = [pixel % SIZE[0], pixel / SIZE[0]].map(|at| at as f32 + 0.5);
        let across = (2.0 * x / SIZE[0] as f32 - 1.0) * half * 4.0 / 3.0;
        let ray = self.shot.pose.rotation() * Vec3::new(across, (1.0 - 2.0 * y / SIZE[1] as f32) * half, -1.0);
        EYE - ray * (EYE.y / ray.y)
    }

    /// The ground's albedo there.
    fn albedo(&self, place: Vec3) -> Vec3 {
        let reader = BundleReader::open(self.folder.path().join("court")).unwrap();
        let chunks = (0..reader.chunk_count()).map(|index| reader.read_chunk(index).unwrap());
        let near = |chunk: heliodon_bundle::LitChunk| {
            let vertices = chunk.positions.into_iter().zip(chunk.albedo);
            vertices.map(|(p, albedo)| (p.distance(place), albedo)).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
        };
        chunks.map(near).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap().1
    }
}

fn solid(low: Vec3, high: Vec3) -> MovingMesh {
    let cube = cuboid(low, high, 6);
    let (positions, normals, triangles) = (cube.positions, cube.normals, cube.triangles);
    MovingMesh::still(Mesh { positions, normals, triangles, ..Mesh::default() })
}

fn cube() -> MovingMesh {
    solid(Vec3::new(-0.4, 0.8, -0.4), Vec3::new(0.4, 1.6, 0.4))
}

fn walker() -> MovingMesh {
    let mut bytes = Vec::new();
    glb(&mut bytes, &heliodon_mesh::figures::walker()).unwrap();
    let (options, mut report) = (ImportOptions::default(), ImportReport::default());
    from_bytes(&bytes, Format::Gltf, Path::new("walker.glb"), &options, &mut report).unwrap()
}

#[test]
fn an_actor_is_lit_and_takes_the_sun_from_the_ground_behind_it() {
    let mut stage = Stage::new();
    let empty = stage.picture();
    stage.add(cube(), Course::stands(TARGET, 0.0));
    let with = stage.picture();
    assert_eq!(stage.picture().pixels, with.pixels, "a picture depends on its shot alone");
    let moment = stage.moment.clone();
    let shadow = stage.pixel(TARGET + Vec3::Y * 1.2 - moment.sun_direction * (1.2 / moment.sun_direction.y));
    let (before, after) = (empty.pixels[shadow], with.pixels[shadow]);
    assert!(after.max_element() < 0.8 * before.max_element(), "in the shadow {after} after {before}");
    assert!(after.min_element() > 0.0, "the sky stays");
    let top = with.pixels[stage.pixel(TARGET + Vec3::new(0.0, 1.6, 0.1))];
    // An albedo of half, in the open: the sun and the sky that a level surface gets, to what 66 directions and 4 coefficients say.
    let facing = moment.sun_direction.y * std::f32::consts::FRAC_1_PI;
    assert!(top.max_element() > 0.5 * 0.9 * (moment.shading.sun_irradiance * facing).max_element(), "{top}");
    // Far away nothing has changed.
    let far = stage.pixel(Vec3::new(-7.0, 0.0, -4.0));
    assert_eq!(empty.pixels[far], with.pixels[far]);
    let changed = empty.pixels.iter().zip(&with.pixels).filter(|(a, b)| a != b).count();
    assert!(changed * 4 < with.pixels.len(), "{changed} pixels");
}

#[test]
fn a_gpu_poses_and_lights_as_the_processor_does() {
    let mut stage = Stage::new();
    stage.add(walker(), Course::stands(TARGET + Vec3::Z * 4.0, 0.6));
    stage.add(cube(), Course::stands(TARGET + Vec3::new(0.6, 0.0, 3.5), 0.3));
    stage.actors().options.directions = Directions::Fixed(2);
    let lamp = Lamp { place: TARGET + Vec3::new(1.0, 2.0, 5.0), ..lamp() };
    stage.set_lamps(vec![lamp]);
    for seconds in [0.0, 0.4] {
        stage.shot.actors_s = seconds;
        let [cpu, gpu] = [Backend::Cpu, Backend::Gpu].map(|backend| {
            stage.actors().options.backend = backend;
            stage.picture()
        });
        let mean = |image: &HdrImage| image.pixels.iter().sum::<Vec3>() / image.pixels.len() as f32;
        let off = cpu.pixels.iter().zip(&gpu.pixels).map(|(a, b)| (*a - *b).abs()).sum::<Vec3>() / cpu.pixels.len() as f32;
        // Single rays graze.
        assert!(off.max_element() < 5e-4 * mean(&cpu).max_element(), "{off} of {} at {seconds} s", mean(&cpu));
        let wrong = cpu.pixels.iter().zip(&gpu.pixels).filter(|(a, b)| (**a - **b).abs().max_element() > 0.1 * a.max_element());
        assert!(wrong.count() < 30, "at {seconds} s");
    }
}

#[test]
fn actors_take_the_sun_from_one_another() {
    let mut stage = Stage::new();
    let to_sun = stage.moment.sun_direction;
    stage.add(cube(), Course::stands(TARGET, 0.0));
    let alone = stage.picture();
    // A plate between the first one's top and the sun, out of the picture of the top.
    let way = to_sun * (2.0 / to_sun.y);
    stage.add(
        solid(Vec3::new(-0.5, 3.5, -0.5), Vec3::new(0.5, 3.6, 0.5)),
        Course::stands(TARGET + Vec3::new(way.x, 0.0, way.z), 0.0),
    );
    let shaded = stage.picture();
    let top = stage.pixel(TARGET + Vec3::new(0.0, 1.6, 0.0));
    let (before, after) = (alone.pixels[top], shaded.pixels[top]);
    assert!(after.max_element() < 0.6 * before.max_element() && after.min_element() > 0.0, "{after} after {before}");
}

/// A lamp that shines to all sides, dark where it is not said.
fn lamp() -> Lamp {
    Lamp { place: TARGET + Vec3::Y * 2.0, intensity: Vec3::new(9.0, 6.0, 3.0), cone: None, reach_m: 8.0, shadows: true }
}

#[test]
fn lamps_light_the_ground_by_the_square_of_the_distance() {
    let mut stage = Stage::new();
    let dark = stage.picture();
    let cone = Cone { direction: Vec3::NEG_Y, half_angle_rad: 0.6, edge: 0.2 };
    for (lamp, lit, unlit) in [
        (lamp(), vec![Vec3::ZERO, Vec3::X * 1.5, Vec3::Z * 2.0], vec![Vec3::new(-7.0, 0.0, -4.0)]),
        (Lamp { cone: Some(cone), ..lamp() }, vec![Vec3::ZERO, Vec3::X * 0.8], vec![Vec3::X * 1.6, Vec3::Z * 2.0]),
    ] {
        stage.set_lamps(vec![lamp]);
        let with = stage.picture();
        for offset in lit {
            let pixel = stage.pixel(TARGET + offset);
            let place = stage.ground(pixel);
            let to = lamp.place - place;
            let left = to.length_squared() / (lamp.reach_m * lamp.reach_m);
            let window = (1.0 - left * left) * (1.0 - left * left);
            let irradiance = lamp.intensity * ((to.y / to.length()) / to.length_squared() * window);
            let wanted = stage.albedo(place) * irradiance * std::f32::consts::FRAC_1_PI;
            let got = with.pixels[pixel] - dark.pixels[pixel];
            // The albedo is that of the nearest vertex.
            assert!((got - wanted).abs().max_element() < 0.15 * wanted.max_element(), "{offset}: {got} for {wanted}");
            // Against one right above, whatever the albedo.
            let above = Lamp { place: place + Vec3::Y * 2.0, cone: None, ..lamp };
            stage.set_lamps(vec![above]);
            let reference = stage.picture().pixels[pixel] - dark.pixels[pixel];
            let above_window = 1.0 - (4.0 / (lamp.reach_m * lamp.reach_m)).powi(2);
            let part = 4.0 * (to.y / to.length()) / to.length_squared() * window / (above_window * above_window);
            assert!(
                (got - reference * part).abs().max_element() < 0.02 * got.max_element(),
                "{offset}: {got} for {}",
                reference * part
            );
        }
        for offset in unlit {
            let pixel = stage.pixel(TARGET + offset);
            assert!(
                (with.pixels[pixel] - dark.pixels[pixel]).abs().max_element() < 1e-3 * dark.pixels[pixel].max_element(),
                "{offset}"
            );
        }
    }
    stage.set_lamps(Vec::new());
    assert_eq!(stage.picture().pixels, dark.pixels, "a lamp that is gone leaves nothing");
}

#[test]
fn stone_and_actors_stand_in_the_way_of_lamps() {
    let mut stage = Stage::new();
    let dark = stage.picture();
    let place = TARGET + Vec3::new(1.2, 0.0, 0.0);
    let lamp = Lamp { place: TARGET + Vec3::new(-1.8, 2.5, 0.0), ..lamp() };
    let added = |stage: &mut Stage, lamp: Lamp, place: Vec3, dark: &HdrImage| {
        stage.set_lamps(vec![lamp]);
        let pixel = stage.pixel(place);
        (stage.picture().pixels[pixel] - dark.pixels[pixel]).max_element()
    };
    let free = added(&mut stage, lamp, place, &dark);
    assert!(free > 0.02, "{free}");
    // The column is in the midst of the court, one metre across: what lies behind it stays dark.
    let behind = Vec3::new(-0.8, 0.0, 2.4);
    let far = Lamp { place: Vec3::new(-0.3, 2.0, -3.0), reach_m: 20.0, ..lamp };
    let hidden = added(&mut stage, far, behind, &dark);
    let through = added(&mut stage, Lamp { shadows: false, ..far }, behind, &dark);
    assert!(through > 0.005 && hidden < 0.05 * through, "{hidden} of {through}");
    // An actor half-way.
    let half = solid(Vec3::new(-0.4, -0.4, -0.4), Vec3::new(0.4, 0.4, 0.4));
    stage.add(half, Course::stands((lamp.place + place) * 0.5, 0.0));
    stage.set_lamps(Vec::new());
    let dark = stage.picture();
    let shaded = added(&mut stage, lamp, place, &dark);
    assert!(shaded < 0.05 * free, "{shaded} of {free}");
    // And the actor's own side that looks at the lamp is lit.
    let side = (lamp.place + place) * 0.5 + Vec3::Y * 0.4;
    assert!(added(&mut stage, lamp, side, &dark) > free);
}

#[test]
fn what_is_no_mesh_does_no_harm() {
    let corner = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
    let mesh = |positions: Vec<Vec3>, triangles: Vec<[u32; 3]>| Mesh { positions, triangles, ..Mesh::default() };
    let meshes = [
        mesh(Vec::new(), Vec::new()),
        mesh(vec![Vec3::ZERO; 3], vec![[0, 1, 2]]),
        mesh(corner.clone(), vec![[0, 1, 2]]),
        mesh(corner.clone(), Vec::new()),
        mesh(corner.iter().map(|p| *p * 1e9 + 1e9).collect(), vec![[0, 1, 2], [2, 1, 0]]),
        Mesh { normals: vec![Vec3::ZERO; 3], ..mesh(corner, vec![[0, 1, 2]]) },
    ];
    for backend in [Backend::Cpu, Backend::Gpu] {
        let mut stage = Stage::new();
        stage.actors().options.backend = backend;
        let empty = stage.picture();
        for mesh in &meshes {
            stage.add(MovingMesh::still(mesh.clone()), Course::stands(TARGET, 0.0));
        }
        stage.set_lamps(vec![lamp(), Lamp { reach_m: 0.0, ..lamp() }, Lamp { place: Vec3::NAN, ..lamp() }]);
        let with = stage.picture();
        assert!(with.pixels.iter().all(|pixel| pixel.is_finite()), "{backend:?}");
        let far = stage.pixel(Vec3::new(-7.0, 0.0, -4.0));
        assert_eq!(empty.pixels[far], with.pixels[far], "{backend:?}");
    }
}

/// What a display shows of scene light.
fn shown(image: &HdrImage, exposure: f32) -> Vec<[u8; 3]> {
    image.pixels.iter().map(|pixel| (*pixel * exposure).to_array().map(heliodon_math::color::srgb8_from_linear)).collect()
}

#[test]
fn an_impostor_stands_in_the_light_as_its_model_does() {
    let model = walker();
    let eye = TARGET + Vec3::new(1.2, 1.9, 3.4);
    let distance_m = eye.distance(TARGET);
    let px_per_radian = 0.5 * SIZE[1] as f32 / 30f32.to_radians().tan();
    let params = CaptureParams {
        distance_m,
        px_per_radian: 2.0 * px_per_radian,
        frames_per_s: 2.0,
        clips: vec![model.clip_named("walk").unwrap()],
        rings: vec![heliodon_bundle::impostor::Ring::around(10.0, 12), heliodon_bundle::impostor::Ring::around(40.0, 12)],
        ..CaptureParams::preview()
    };
    let impostor = capture(&model, "walker", &params, &|_| ()).unwrap();
    let course = || Course::stands(TARGET, 0.7);
    let near = || {
        let mut stage = Stage::sampled(3);
        stage.shot.pose = Pose::looking(eye, TARGET + Vec3::Y * 0.7);
        stage
    };
    let empty = near().picture();
    let mut stage = near();
    stage.actors().options.directions = Directions::Fixed(3);
    stage.add(model, course());
    let real = stage.picture();
    let mut stage = near();
    stage.renderer.app_mut().world_mut().resource_mut::<Impostors>().add(impostor, vec![course()]);
    let image = stage.picture();
    assert_eq!(stage.picture().pixels, image.pixels, "a picture depends on its shot alone");
    let exposure = 0.4 / (empty.pixels.iter().sum::<Vec3>() / empty.pixels.len() as f32).max_element();
    let [width, height] = SIZE.map(|side| side as u32);
    let flip = |a: &HdrImage, b: &HdrImage| mean_flip(&shown(a, exposure), &shown(b, exposure), width, height);
    let (of_image, of_nobody) = (flip(&real, &image), flip(&real, &empty));
    println!("FLIP of the impostor {of_image:.4}, of nobody {of_nobody:.4}");
    // thin bones of half a pixel each: what is not the same is what lights them, rays for each vertex there and six sides here
    assert!(of_image < 0.02 && of_image < 0.8 * of_nobody, "{of_image} against {of_nobody}");
    // its shadow lies where the model's does
    let darker = |image: &HdrImage| -> Vec<bool> {
        image
            .pixels
            .iter()
            .zip(&empty.pixels)
            .map(|(with, without)| with.max_element() < 0.85 * without.max_element())
            .collect()
    };
    let (of_model, of_impostor) = (darker(&real), darker(&image));
    let both = of_model.iter().zip(&of_impostor).filter(|(a, b)| **a && **b).count();
    let any = of_model.iter().zip(&of_impostor).filter(|(a, b)| **a || **b).count();
    println!("dark pixels of both {both}, of any {any}");
    assert!(both * 2 > any && any > 50, "{both} of {any}");
}
