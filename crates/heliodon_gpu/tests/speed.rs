//! What visibility costs: `cargo test -p heliodon_gpu --test speed -- --ignored --nocapture`, on whatever GPU is at hand.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod figures;

use glam::{Affine3A, Vec3};
use heliodon_gpu::moving::{Corner, MovingFrame, MovingGpu, MovingPipelines, MovingSun};
use heliodon_gpu::wgpu::{CommandEncoderDescriptor, PollType};
use heliodon_gpu::{DepthMaps, Headless, Method, Rays, VisibilityGpu, headless};
use heliodon_math::light_sphere::LightSphere;
use heliodon_math::visibility::VisibilityBackend;
use heliodon_mesh::Mesh;
use heliodon_mesh::motion::{Palette, Pose};
use heliodon_mesh::normals;
use heliodon_rays::VisibilityCpu;
use heliodon_testkit::scenes::ball;
use std::sync::Arc;
use std::time::Instant;

/// A ball with bumps, as many triangles as the Stanford bunny has.
fn pebble() -> Mesh {
    let mut scene = ball(1.0, 132);
    for p in &mut scene.positions {
        let wave = |f: f32, q: Vec3| (f * q.x).sin() * (f * q.y + 1.0).sin() * (f * q.z + 2.0).sin();
        *p *= 1.0 + 0.25 * wave(4.0, *p) + 0.06 * wave(17.0, *p);
    }
    let mut mesh = Mesh { positions: scene.positions, triangles: scene.triangles, ..Mesh::default() };
    normals::compute(&mut mesh);
    mesh
}

fn ms(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64() * 1e3
}

/// Milliseconds for setting the mesh, moving it, and asking it, the best of some.
fn measured<B: VisibilityBackend>(backend: &mut B, mesh: &Mesh, level: u32) -> [f64; 4] {
    let Mesh { positions, normals, triangles, .. } = mesh;
    let sphere = LightSphere::new(level);
    let set = ms(|| backend.set_mesh(positions, normals, triangles).unwrap());
    let mut best = [set, f64::INFINITY, f64::INFINITY, f64::INFINITY];
    let begun = Instant::now();
    for _ in 0..3 {
        if begun.elapsed().as_secs_f64() > 5.0 {
            break;
        }
        let moved = ms(|| backend.move_vertices(positions, normals).unwrap());
        // its boxes are fitted when it is asked first: one direction takes little else
        let fitted = ms(|| {
            backend.compute(&sphere.directions()[..1]).unwrap();
            backend.wait().unwrap();
        });
        let asked = ms(|| {
            backend.compute(sphere.directions()).unwrap();
            backend.wait().unwrap();
        });
        for (best, now) in best[1..].iter_mut().zip([moved, fitted, asked]) {
            *best = best.min(now);
        }
    }
    best
}

#[test]
#[ignore = "measures"]
fn rays_and_depth_maps() {
    let Headless { adapter, device, queue, fault, .. } = headless().unwrap();
    println!("{}, {} threads", adapter.get_info().name, rayon::current_num_threads());
    // SPEED=rays for one of them, FINEST=3 for less
    let finest = std::env::var("FINEST").map_or(4, |level| level.parse().unwrap());
    let only = std::env::var("SPEED").unwrap_or_default();
    for (name, mesh, levels) in [("walker", figures::walker().rest().clone(), [2, 3]), ("pebble", pebble(), [3, 4])] {
        println!("{name}: {} vertices, {} triangles", mesh.positions.len(), mesh.triangles.len());
        for level in levels.into_iter().filter(|&level| level <= finest) {
            let k = LightSphere::count(level);
            let tell = |who: &str, [set, moved, fitted, asked]: [f64; 4]| {
                println!(
                    "  k = {k:4} {who:10} set {set:8.1} ms, move {moved:6.2}, fit and one direction {fitted:8.2}, ask {asked:9.1}"
                );
            };
            for (who, method) in [("maps", Method::from(DepthMaps::default())), ("rays", Rays::default().into())] {
                if only.is_empty() || only == who {
                    tell(who, measured(&mut VisibilityGpu::new(&device, &queue, &fault, method), &mesh, level));
                }
            }
            if only.is_empty() {
                tell("processor", measured(&mut VisibilityCpu::new(None), &mesh, level));
            }
        }
    }
}

/// The best of some, in milliseconds, of recording frames, submitting them and waiting.
fn frames(headless: &Headless, gpu: &mut MovingGpu, frame: &MovingFrame<'_>) -> f64 {
    let Headless { device, queue, .. } = headless;
    let mut best = f64::INFINITY;
    let begun = Instant::now();
    while best.is_infinite() || begun.elapsed().as_secs_f64() < 1.0 {
        best = best.min(ms(|| {
            let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
            gpu.record(&mut encoder, frame).unwrap();
            queue.submit([encoder.finish()]);
            device.poll(PollType::wait_indefinitely()).unwrap();
        }));
    }
    best
}

#[test]
#[ignore = "measures"]
fn a_walker_s_frame() {
    let headless = headless().unwrap();
    let pipelines = Arc::new(MovingPipelines::new(&headless.device));
    let moving = figures::walker();
    let corners = Corner::of_all(moving.rest().positions.len());
    println!("{}: {} corners", headless.adapter.get_info().name, corners.len());
    let (mut pose, mut palette) = (Pose::default(), Palette::default());
    moving.palette(0, 0.3, &mut palette);
    moving.pose(0, 0.3, &mut pose);
    println!(
        "  the processor's pose {:.3} ms, its palette {:.3}",
        ms(|| moving.pose(0, 0.31, &mut pose)),
        ms(|| moving.palette(0, 0.31, &mut palette))
    );
    for (who, method) in [("maps", Method::from(DepthMaps::default())), ("rays", Rays::default().into())] {
        for level in [2, 3] {
            let mut gpu = MovingGpu::new(&headless.device, &pipelines, &moving, &corners, method).unwrap();
            let sphere = LightSphere::new(level);
            let radiance = vec![Vec3::ONE; sphere.directions().len()];
            let dark = MovingFrame {
                palette: Some(&palette),
                world_from_mesh: Affine3A::IDENTITY,
                directions: &[],
                weights: &[],
                radiance: &[],
                sun: None,
                follow: 1.0,
            };
            let posed = frames(&headless, &mut gpu, &dark);
            let sun = Some(MovingSun { direction: Vec3::Y, irradiance: Vec3::ONE, lattice: None });
            let (directions, weights) = (sphere.directions(), sphere.weights());
            let whole = MovingFrame { directions, weights, radiance: &radiance, ..dark };
            let lit = frames(&headless, &mut gpu, &whole);
            let sunned = frames(&headless, &mut gpu, &MovingFrame { sun, ..whole });
            let rested = frames(&headless, &mut gpu, &MovingFrame { palette: None, sun, ..whole });
            println!(
                "  k = {:4} {who}: pose and fit {posed:.2} ms, light summed and written {rested:.2}, asked {:.1}, the sun {:.1}, all {sunned:.1}",
                directions.len(),
                lit - posed - rested,
                sunned - lit
            );
        }
    }
}
