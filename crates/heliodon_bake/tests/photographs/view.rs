//! The finished model from a view that no photograph has: cameras from marks, shapes on the points that were found, textures from the photographs.

use crate::cameras::{self, Marked, onto_solution};
use crate::render::{Stage, Stones, developed, difference, hours, look, photographed};
use crate::temple;
use glam::{DMat3, DVec2, DVec3, Vec3};
use heliodon_image::{Picture, SrgbImage, TextureWrap};
use heliodon_math::color::srgb8_from_linear;
use heliodon_mesh::Mesh;
use heliodon_photo::camera::{Camera, Intrinsics};
use heliodon_photo::model::{NamedPoint, build};
use heliodon_photo::solve::{Focal, Params, PointResult, Solution, solve};
use heliodon_photo::texture::{Photograph, TextureParams, texture};
use heliodon_rays::{BuildParams, Hit, Ray, TriangleScene};
use rayon::prelude::*;
use std::time::Instant;

const EXPOSURE: f32 = 1.0 / 32.0;

/// The lens of a smaller copy of a photograph.
fn copied(camera: &Camera, [width, height]: [u32; 2]) -> Camera {
    let lens = &camera.intrinsics;
    let scale = f64::from(width) / f64::from(lens.width);
    let intrinsics = Intrinsics {
        width,
        height,
        focal_px: lens.focal_px.map(|x| x * scale),
        centre_px: lens.centre_px.map(|x| x * scale),
        ..*lens
    };
    Camera { intrinsics, ..*camera }
}

fn points(marked: &Marked, solution: &Solution) -> Vec<NamedPoint> {
    let named = |(p, (name, _)): (usize, &(String, DVec3))| {
        let PointResult::Solved(point) = &solution.points[p] else { return None };
        let covariance = point.covariance_m2.unwrap_or(DMat3::IDENTITY * 1e-6);
        Some(NamedPoint { name: name.clone(), position: point.position_m, covariance, seen_in: vec![] })
    };
    marked.points.iter().enumerate().filter_map(named).collect()
}

/// What a textured model shows, unlit, and which pixels show it.
fn drawn(meshes: &[Mesh], camera: &Camera) -> (SrgbImage, Vec<bool>) {
    const ACROSS: u32 = 3;
    let mut positions = Vec::new();
    let mut corners: Vec<(usize, [u32; 3])> = Vec::new();
    for (which, mesh) in meshes.iter().enumerate() {
        for triangle in &mesh.triangles {
            positions.extend(triangle.map(|v| mesh.positions[v as usize]));
            corners.push((which, *triangle));
        }
    }
    let triangles: Vec<[u32; 3]> = (0..corners.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let scene = TriangleScene::build(&positions, &triangles, &BuildParams::default()).unwrap();
    let color = |hit: &Hit| {
        let (which, triangle) = corners[hit.triangle as usize];
        let mesh = &meshes[which];
        let [a, b, c] = triangle.map(|v| mesh.uvs[v as usize]);
        let uv = a + (b - a) * hit.u + (c - a) * hit.v;
        let texture = mesh.materials[0].texture.as_ref().unwrap();
        texture.image.sample_bilinear(uv.x, uv.y, [TextureWrap::Clamp; 2]).truncate()
    };
    let [width, height] = [camera.intrinsics.width, camera.intrinsics.height];
    let pixel = |i: u32| {
        let (x, y) = (i % width, i / width);
        let at = |k: u32| (f64::from(k) + 0.5) / f64::from(ACROSS);
        let rays: Vec<Ray> = (0..ACROSS * ACROSS)
            .map(|k| {
                let (origin, direction) = camera.ray(DVec2::new(f64::from(x) + at(k % ACROSS), f64::from(y) + at(k / ACROSS)));
                Ray { origin: origin.as_vec3(), direction: direction.as_vec3(), t_min: 0.0, t_max: f32::INFINITY }
            })
            .collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        scene.closest(&rays, &mut hits);
        let met: Vec<Vec3> = hits.iter().filter(|hit| hit.is_some()).map(color).collect();
        let mean = met.iter().sum::<Vec3>() / met.len().max(1) as f32;
        (mean, met.len() == rays.len())
    };
    let all: Vec<(Vec3, bool)> = (0..width * height).into_par_iter().map(pixel).collect();
    let encoded = |(color, _): &(Vec3, bool)| {
        let [r, g, b] = color.to_array().map(srgb8_from_linear);
        [r, g, b, 255]
    };
    let image = SrgbImage { width, height, pixels: all.iter().map(encoded).collect() };
    (image, all.into_iter().map(|(_, is_model)| is_model).collect())
}

fn judge(size: [u32; 2], samples: u32, view_samples: u32) {
    let start = Instant::now();
    let stage = Stage::new(&temple::truth());
    let stones = Stones(&stage);
    let hour = &hours(&["10:20"])[0];
    let marked = cameras::marked(&stage, Focal::Free, 7);
    let solution = solve(&marked.problem, &Params::default());
    assert_eq!(solution.solved_photos(), 12);
    let points = points(&marked, &solution);
    let rows = temple::shapes_without(24, |name| points.iter().any(|point| point.name == name));
    let model = build(&rows, &points, &[]);
    assert_eq!(model.refused, []);
    println!("a model after {:.1} s", start.elapsed().as_secs_f64());
    let names: Vec<String> = (0..12).map(|i| format!("{i}.png")).collect();
    let pictures: Vec<Picture> = (marked.cameras.iter().enumerate())
        .map(|(i, camera)| {
            let frame = photographed(&stage.surfaces(&stones), hour, &copied(camera, size), samples, i as u32);
            Picture::Eight(developed(&frame, Vec3::splat(EXPOSURE)))
        })
        .collect();
    println!("photographed after {:.1} s", start.elapsed().as_secs_f64());
    let photographs: Vec<Photograph> = (names.iter().zip(&pictures).enumerate())
        .map(|(i, (name, picture))| Photograph { name, camera: copied(&solution.camera(i).unwrap(), size), picture })
        .collect();
    let textured = texture(&model.parts, &[], &photographs, &TextureParams::default()).unwrap();
    println!(
        "textured after {:.1} s: {} x {}",
        start.elapsed().as_secs_f64(),
        textured.atlas.image.width,
        textured.atlas.image.height
    );
    let view = temple::new_view(size);
    let truth = developed(&photographed(&stage.surfaces(&stones), hour, &view, view_samples, 99), Vec3::splat(EXPOSURE));
    // the true view in the solution's frame, which has another origin
    let back = onto_solution(&marked, &solution);
    let (drawn, is_model) = drawn(&textured.meshes, &Camera { pose: back.pose(&view.pose), ..view });
    look("view.png", &drawn);
    look("view-true.png", &truth);
    look("view-difference.png", &difference(&drawn, &truth));
    look("view-atlas.png", &textured.atlas.image);
    let (mut sum, mut count) = (0.0, 0.0);
    for ((a, b), _) in drawn.pixels.iter().zip(&truth.pixels).zip(&is_model).filter(|(_, is_model)| **is_model) {
        for c in 0..3 {
            let off = (f64::from(a[c]) - f64::from(b[c])) / 255.0;
            sum += off * off;
        }
        count += 3.0;
    }
    let psnr_db = -10.0 * libm::log10(sum / count);
    println!(
        "a new view: {psnr_db:.2} dB over {} pixels of the model, after {:.1} s",
        count / 3.0,
        start.elapsed().as_secs_f64()
    );
    assert!(count > 30_000.0 && psnr_db >= 28.0, "{psnr_db} dB");
}

#[test]
fn a_new_view_of_the_textured_model_is_the_truths() {
    judge([480, 360], 16, 64);
}

/// The same as one would do it; minutes.
#[test]
#[ignore = "minutes"]
fn a_finer_new_view_of_the_textured_model_is_the_truths() {
    judge([1024, 768], 32, 256);
}
