//! Meshes that are posed and lit on the GPU, against the processor's poses and rays.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic, and tell what it found")]

mod figures;
#[path = "../../heliodon_mesh/tests/motion/glb.rs"]
mod glb;

use glam::{Affine3A, Quat, Vec3};
use half::f16;
use heliodon_gpu::moving::{Corner, MovingFrame, MovingGpu, MovingPipelines, MovingSun, SunLattice, follow};
use heliodon_gpu::wgpu::{Buffer, BufferDescriptor, BufferSlice, BufferUsages, CommandEncoderDescriptor, MapMode, PollType};
use heliodon_gpu::{Answered, DepthMaps, GpuError, Headless, Method, Rays, VisibilityGpu, headless};
use heliodon_math::frame::unit_or;
use heliodon_math::light_sphere::LightSphere;
use heliodon_math::visibility::VisibilityBackend;
use heliodon_mesh::export::{write_pc2, write_ply};
use heliodon_mesh::figures::stoneyard;
use heliodon_mesh::import::{ImportOptions, ImportReport};
use heliodon_mesh::motion::pc2::PointCache;
use heliodon_mesh::motion::{MovingMesh, Palette, Pose, read_cached};
use heliodon_rays::VisibilityCpu;
use std::f32::consts::FRAC_1_PI;
use std::sync::{Arc, OnceLock};

fn own() -> &'static (Headless, Arc<MovingPipelines>) {
    static DEVICE: OnceLock<(Headless, Arc<MovingPipelines>)> = OnceLock::new();
    DEVICE.get_or_init(|| {
        let headless = headless().expect("software Vulkan at least: ./x test installs it");
        assert!(MovingPipelines::supports(&headless.device));
        let pipelines = Arc::new(MovingPipelines::new(&headless.device));
        (headless, pipelines)
    })
}

fn gpu(moving: &MovingMesh, corners: &[Corner], method: impl Into<Method>) -> MovingGpu {
    let (Headless { device, .. }, pipelines) = own();
    MovingGpu::new(device, pipelines, moving, corners, method).unwrap()
}

/// Records and submits a frame.
fn frame(gpu: &mut MovingGpu, frame: &MovingFrame<'_>) {
    let (Headless { device, queue, fault, .. }, _) = own();
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
    gpu.record(&mut encoder, frame).unwrap();
    queue.submit([encoder.finish()]);
    device.poll(PollType::wait_indefinitely()).unwrap();
    fault.check().unwrap();
}

fn read<T: bytemuck::Pod>(slice: BufferSlice<'_>) -> Vec<T> {
    let (Headless { device, queue, .. }, _) = own();
    let usage = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
    let size = slice.size().get();
    let readable = device.create_buffer(&BufferDescriptor { label: None, size, usage, mapped_at_creation: false });
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(slice.buffer(), slice.offset(), &readable, 0, size);
    queue.submit([encoder.finish()]);
    readable.slice(..).map_async(MapMode::Read, |result| result.unwrap());
    device.poll(PollType::wait_indefinitely()).unwrap();
    bytemuck::cast_slice(&readable.slice(..).get_mapped_range()).to_vec()
}

fn vectors(buffer: &Buffer) -> Vec<Vec3> {
    read::<[f32; 4]>(buffer.slice(..)).into_iter().map(|[x, y, z, _]| Vec3::new(x, y, z)).collect()
}

fn world(gpu: &MovingGpu) -> Vec<Vec3> {
    read::<[f32; 3]>(gpu.world_positions()).into_iter().map(Vec3::from).collect()
}

/// Unit normals in the world.
fn world_normals(gpu: &MovingGpu) -> Vec<Vec3> {
    let of = |both: [i16; 2]| {
        let [x, y] = both.map(|v| f32::from(v) / 32767.0);
        let fold = (x.abs() + y.abs() - 1.0).max(0.0);
        unit_or(Vec3::new(x - fold.copysign(x), y - fold.copysign(y), 1.0 - x.abs() - y.abs()), Vec3::ZERO)
    };
    read::<[i16; 2]>(gpu.world_normals()).into_iter().map(of).collect()
}

/// The light, and the sun's part in it.
fn shown(gpu: &MovingGpu) -> (Vec<Vec3>, Vec<f32>) {
    let of = |light: [u16; 4]| {
        let [r, g, b, sun] = light.map(|v| f16::from_bits(v).to_f32());
        (Vec3::new(r, g, b), sun)
    };
    read::<[u16; 4]>(gpu.light().slice(..)).into_iter().map(of).unzip()
}

/// A frame without light.
fn dark(palette: &Palette) -> MovingFrame<'_> {
    MovingFrame {
        palette: Some(palette),
        world_from_mesh: Affine3A::IDENTITY,
        directions: &[],
        weights: &[],
        radiance: &[],
        sun: None,
        follow: 1.0,
    }
}

/// Asserts that all clips are posed as the processor does it, to 1e-4 of the size and of a normal's length; triangles that are thinner than a rounding may say
/// other normals of a few vertices.
fn assert_poses(name: &str, moving: &MovingMesh) {
    let rest = moving.rest();
    let (low, high) = rest.bounds().unwrap();
    let size = low.distance(high);
    let corners = Corner::of_all(rest.positions.len());
    for method in [Method::from(Rays::default()), DepthMaps::default().into()] {
        let mut gpu = gpu(moving, &corners, method);
        let (mut pose, mut palette) = (Pose::default(), Palette::default());
        let mut worst = [0.0f32; 2];
        for clip in 0..=moving.clips().len() {
            let duration_s = moving.clips().get(clip).map_or(0.0, |clip| clip.duration_s);
            for share in [0.0, 0.31, 0.77, 1.0] {
                moving.pose(clip, share * duration_s, &mut pose);
                moving.palette(clip, share * duration_s, &mut palette);
                frame(&mut gpu, &dark(&palette));
                let [positions, normals] = gpu.posed().map(vectors);
                assert_eq!(positions, world(&gpu), "{name}: the mesh stands in its own space");
                for ((p, n), (q, m)) in positions.iter().zip(&normals).zip(pose.positions.iter().zip(&pose.normals)) {
                    worst = [worst[0].max(p.distance(*q) / size), worst[1].max(n.distance(*m))];
                }
            }
        }
        println!("{name}: positions to {:.1e} of the size, normals to {:.1e}", worst[0], worst[1]);
        assert!(worst[0] < 1e-4 && worst[1] < 1e-4, "{name}: {worst:?}");
    }
}

#[test]
fn skins_are_posed_as_on_the_processor() {
    assert_poses("walker", &figures::walker());
    assert_poses("arm", &figures::read(&glb::arm(glb::float_weights)));
}

#[test]
fn nodes_are_posed_as_on_the_processor() {
    assert_poses("stoneyard", &figures::of(&stoneyard()));
    assert_poses("objects", &figures::read(&glb::objects()));
}

#[test]
fn caches_are_posed_as_on_the_processor() {
    assert_poses("cloth", &cloth());
}

#[test]
fn morphs_are_posed_as_on_the_processor() {
    assert_poses("morph with normals", &figures::read(&glb::morphing(true)));
    assert_poses("morph without", &figures::read(&glb::morphing(false)));
}

#[test]
fn what_does_not_move_rests() {
    assert_poses("still", &MovingMesh::still(figures::walker().rest().clone()));
}

/// A curtain with a cache.
fn cloth() -> MovingMesh {
    let made = heliodon_mesh::figures::cloth();
    let folder = tempfile::tempdir().unwrap();
    let (mesh, cache) = (folder.path().join("cloth.ply"), folder.path().join("cloth.pc2"));
    write_ply(&mesh, &made.mesh, None).unwrap();
    write_pc2(&cache, &PointCache::of_frames(&made.frames)).unwrap();
    read_cached(&mesh, &cache, &ImportOptions::default(), &mut ImportReport::default()).unwrap()
}

/// The light of corners by the processor.
struct Expected {
    sky: Vec<Vec3>,
    sunned: Vec<bool>,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
}

fn expected(
    moving: &MovingMesh,
    corners: &[Corner],
    pose: &Pose,
    sphere: &LightSphere,
    radiance: &[Vec3],
    sun: Vec3,
) -> Expected {
    let positions: Vec<Vec3> = corners.iter().map(|c| pose.positions[c.vertex as usize]).collect();
    let side = |c: &Corner| if c.back { -1.0 } else { 1.0 };
    let normals: Vec<Vec3> = corners.iter().map(|c| pose.normals[c.vertex as usize] * side(c)).collect();
    let mut cpu = VisibilityCpu::new(None);
    // the first corners are the vertices themselves
    cpu.set_mesh(&positions, &normals, &moving.rest().triangles).unwrap();
    cpu.compute(sphere.directions()).unwrap();
    let sky = cpu.light(sphere.weights(), radiance).unwrap().light;
    let sunned = cpu.seen_from(&vec![true; corners.len()], sun).unwrap();
    Expected { sky, sunned, positions, normals }
}

fn sides(moving: &MovingMesh) -> Vec<Corner> {
    let fronts = Corner::of_all(moving.rest().positions.len());
    let backs = fronts.iter().map(|&corner| Corner { back: true, ..corner });
    fronts.iter().copied().chain(backs).collect()
}

#[test]
fn figures_are_lit_as_by_the_processor() {
    let place = Affine3A::from_rotation_translation(Quat::from_rotation_y(0.7), Vec3::new(30.0, 2.0, -12.0));
    let sphere = LightSphere::new(3);
    let radiance: Vec<Vec3> = sphere.directions().iter().map(|l| Vec3::new(1.0 + l.y, 1.0, 1.5 - l.x)).collect();
    let sun = Vec3::new(0.48, 0.6, 0.64);
    let irradiance = Vec3::new(9.0, 8.0, 6.0);
    for (name, moving, corners) in [("walker", figures::walker(), None), ("cloth", cloth(), Some(()))] {
        let corners = corners.map_or_else(|| Corner::of_all(moving.rest().positions.len()), |()| sides(&moving));
        // Rays: 0.1 % of the entries, and of the sun's. Depth maps: about what they err where nothing moves; there the backs of a cloth are in no
        // triangle, and so smoother than here.
        for (method, most) in [(Method::from(Rays::default()), Some(0.002)), (DepthMaps::default().into(), None)] {
            let mut gpu = gpu(&moving, &corners, method);
            let (mut pose, mut palette) = (Pose::default(), Palette::default());
            for time_s in [0.1, 0.6] {
                moving.pose(0, time_s, &mut pose);
                moving.palette(0, time_s, &mut palette);
                let exact = expected(&moving, &corners, &pose, &sphere, &radiance, sun);
                let now = MovingFrame {
                    palette: Some(&palette),
                    world_from_mesh: place,
                    directions: sphere.directions(),
                    weights: sphere.weights(),
                    radiance: &radiance,
                    sun: Some(MovingSun { direction: sun, irradiance, lattice: None }),
                    follow: 1.0,
                };
                frame(&mut gpu, &now);
                for (p, q) in world(&gpu).into_iter().zip(&exact.positions) {
                    assert!(p.distance(place.transform_point3(*q)) < 1e-4, "{name}");
                }
                for (n, m) in world_normals(&gpu).into_iter().zip(&exact.normals) {
                    assert!(n.distance(place.transform_vector3(*m)) < 2e-4, "{name}: {n} for {m}");
                }
                let (lit, sunlit) = shown(&gpu);
                // What comes from the sun is said to.
                for (light, sun) in lit.iter().zip(&sunlit) {
                    assert!((*sun * FRAC_1_PI * irradiance).cmple(*light * 1.002 + 1e-3).all(), "{name}: {sun} of {light}");
                }
                assert!(sunlit.iter().any(|&sun| sun > 0.3) && sunlit.contains(&0.0), "{name}");
                let (relative, share) = errors(&lit, &exact, sun, irradiance);
                let most = most.map_or_else(
                    || {
                        let still = still(method, &moving, &exact, &sphere, &radiance, (sun, irradiance));
                        let (relative, share) = errors(&still, &exact, sun, irradiance);
                        println!("{name} still: {relative:.5}, {share:.5}");
                        (1.2 * relative + 0.01, 1.2 * share + 0.01)
                    },
                    |most| (most, most),
                );
                println!(
                    "{name} {:?} at {time_s} s: the sky's light is {relative:.5} off, the sun wrong at {share:.5}",
                    gpu.answered()
                );
                assert!(relative < most.0 && share < most.1, "{name}");
            }
        }
    }
}

/// How much of the sky's light is wrong on the average, and the part of the corners that are lit by the sun and should not be, or are not and should.
fn errors(lit: &[Vec3], exact: &Expected, sun: Vec3, irradiance: Vec3) -> (f32, f32) {
    let (mut error, mut wrong, mut sum) = (0.0, 0, 0.0);
    for (i, light) in lit.iter().enumerate() {
        let cosine = exact.normals[i].dot(sun).max(0.0);
        let both = [exact.sky[i], exact.sky[i] + irradiance * (cosine * FRAC_1_PI)];
        let [without, with] = both.map(|expected| (*light - expected).abs().max_element());
        // what the sun reaches or not is a step, and counted apart from what the sky's light is off
        wrong += usize::from(cosine > 0.05 && exact.sunned[i] != (with < without));
        error += without.min(with);
        sum += exact.sky[i].max_element();
    }
    (error / sum, wrong as f32 / lit.len() as f32)
}

/// The light that the method makes of the pose as a mesh that stands still.
fn still(
    method: Method,
    moving: &MovingMesh,
    exact: &Expected,
    sphere: &LightSphere,
    radiance: &[Vec3],
    (sun, irradiance): (Vec3, Vec3),
) -> Vec<Vec3> {
    let (Headless { device, queue, fault, .. }, _) = own();
    let mut gpu = VisibilityGpu::new(device, queue, fault, method);
    gpu.set_mesh(&exact.positions, &exact.normals, &moving.rest().triangles).unwrap();
    gpu.compute(sphere.directions()).unwrap();
    let sky = gpu.light(sphere.weights(), radiance).unwrap().light;
    gpu.compute(&[sun]).unwrap();
    let direct = gpu.light(&[1.0], &[irradiance]).unwrap().light;
    sky.iter().zip(direct).map(|(&sky, direct)| sky + direct).collect()
}

/// A triangle under the open sky.
fn open() -> (MovingMesh, Palette) {
    let positions = vec![Vec3::ZERO, Vec3::Z, Vec3::X];
    let mesh = heliodon_mesh::Mesh { positions, triangles: vec![[0, 1, 2]], ..Default::default() };
    let (moving, mut palette) = (MovingMesh::still(mesh), Palette::default());
    moving.palette(0, 0.0, &mut palette);
    (moving, palette)
}

#[test]
fn the_sun_comes_through_a_lattice_and_half_floats_do_not_overflow() {
    let (moving, palette) = open();
    let mut gpu = gpu(&moving, &Corner::of_all(3), Method::Auto);
    let reached = [0.0, 1.0, 0.5, 0.5, 0.0, 1.0, 0.5, 0.25];
    let lattice = SunLattice { origin: Vec3::new(10.0, 0.0, 0.0), spacing_m: 1.0, size: [2, 2, 2], reached: &reached };
    let place = Affine3A::from_translation(Vec3::new(10.0, 0.0, 0.0));
    let lit = |gpu: &mut MovingGpu, place, irradiance, direction| {
        let sun = Some(MovingSun { direction, irradiance, lattice: Some(lattice) });
        frame(gpu, &MovingFrame { sun, world_from_mesh: place, ..dark(&palette) });
        shown(gpu).0
    };
    let pi = Vec3::splat(std::f32::consts::PI);
    // at x = 10, 10, 11
    let light = lit(&mut gpu, place, pi, Vec3::Y);
    assert!(light.iter().zip([0.0, 0.0, 1.0]).all(|(l, e)| (*l - e).abs().max_element() < 1e-3), "{light:?}");
    // half way along x and y: the mean of 0, 1, 0.5, 0.5
    let light = lit(&mut gpu, Affine3A::from_translation(Vec3::new(10.5, 0.5, 0.0)), pi, Vec3::Y);
    assert!((light[0] - 0.5).abs().max_element() < 1e-3, "{light:?}");
    // beyond the lattice as at its edge
    let light = lit(&mut gpu, Affine3A::from_translation(Vec3::new(99.0, -5.0, 0.0)), pi, Vec3::Y);
    assert!((light[0] - 1.0).abs().max_element() < 1e-3, "{light:?}");
    // from below nothing, and no more than a half float holds
    assert_eq!(lit(&mut gpu, place, pi, Vec3::NEG_Y), [Vec3::ZERO; 3]);
    assert_eq!(lit(&mut gpu, place, Vec3::splat(1e9), Vec3::Y)[2], Vec3::splat(65504.0));
}

#[test]
fn the_sky_s_light_follows_and_the_sun_s_does_not_wait() {
    let (moving, palette) = open();
    let mut gpu = gpu(&moving, &Corner::of_all(3), Rays::default());
    let lit = |gpu: &mut MovingGpu, bright: f32, sun: f32, follow: f32, pose: bool| {
        let sun = Some(MovingSun { direction: Vec3::Y, irradiance: Vec3::splat(sun), lattice: None });
        let radiance = [Vec3::splat(bright)];
        let frame_of = MovingFrame {
            palette: pose.then_some(&palette),
            directions: &[Vec3::Y],
            weights: &[std::f32::consts::PI],
            radiance: &radiance,
            sun,
            follow,
            ..dark(&palette)
        };
        frame(gpu, &frame_of);
        shown(gpu).0[0].x
    };
    let pi = std::f32::consts::PI;
    // the first goes all of the way
    assert_eq!(lit(&mut gpu, 8.0, 0.0, 0.1, true), 8.0);
    assert_eq!(lit(&mut gpu, 4.0, 0.0, 0.25, false), 7.0);
    assert_eq!(lit(&mut gpu, 4.0, 2.0 * pi, 0.5, true), 5.5 + 2.0);
    assert_eq!(lit(&mut gpu, 4.0, 0.0, 1.0, true), 4.0);
    assert_eq!(follow(None, 0.08), 1.0);
    assert!((follow(Some(0.08), 0.08) - (1.0 - (-1.0f32).exp())).abs() < 1e-6);
}

#[test]
fn a_mesh_at_rest_is_asked_again_only_where_the_question_is_another() {
    let moving = figures::walker();
    let corners = Corner::of_all(moving.rest().positions.len());
    let mut gpu = gpu(&moving, &corners, Rays::default());
    let mut palette = Palette::default();
    moving.palette(0, 0.3, &mut palette);
    let (coarse, fine) = (LightSphere::new(1), LightSphere::new(2));
    let ones = vec![Vec3::ONE; fine.directions().len()];
    let under = |gpu: &mut MovingGpu, sphere: &LightSphere, sun: Vec3, palette| {
        let sun = Some(MovingSun { direction: sun, irradiance: Vec3::ONE, lattice: None });
        let of = MovingFrame {
            palette,
            world_from_mesh: Affine3A::IDENTITY,
            directions: sphere.directions(),
            weights: sphere.weights(),
            radiance: &ones[..sphere.directions().len()],
            sun,
            follow: 1.0,
        };
        frame(gpu, &of);
        shown(gpu).0
    };
    let first = under(&mut gpu, &coarse, Vec3::Y, Some(&palette));
    assert_eq!(under(&mut gpu, &coarse, Vec3::Y, None), first);
    // a finer sphere, another sun, and both back
    let finer = under(&mut gpu, &fine, Vec3::X, None);
    assert_ne!(finer, first);
    assert_eq!(under(&mut gpu, &fine, Vec3::X, Some(&palette)), finer);
    assert_eq!(under(&mut gpu, &coarse, Vec3::Y, None), first);
}

#[test]
fn what_does_not_go_together_is_told() {
    let (Headless { device, .. }, pipelines) = own();
    let moving = figures::walker();
    let corners = Corner::of_all(moving.rest().positions.len());
    let made = |corners: &[Corner], method| MovingGpu::new(device, pipelines, &moving, corners, method);
    let beyond = [Corner { vertex: u32::MAX >> 1, back: false }];
    assert!(matches!(made(&beyond, Method::Auto), Err(GpuError::Input(_))));
    let back: Vec<Corner> = corners.iter().map(|&c| Corner { back: true, ..c }).collect();
    assert!(matches!(made(&back, Method::Auto), Err(GpuError::Input(_))));
    assert!(matches!(made(&corners, Rays { offset_m: Some(-1.0) }.into()), Err(GpuError::Input(_))));
    let mut gpu = made(&corners, Method::Auto).unwrap();
    assert_eq!((gpu.corner_count() as usize, gpu.answered()), (corners.len(), Answered::Rays));
    let (mut palette, other) = (Palette::default(), open().1);
    moving.palette(0, 0.0, &mut palette);
    let mut refused = |frame: &MovingFrame<'_>| {
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        matches!(gpu.record(&mut encoder, frame), Err(GpuError::Input(_)))
    };
    assert!(refused(&MovingFrame { palette: None, ..dark(&palette) }));
    assert!(refused(&dark(&other)));
    assert!(refused(&MovingFrame { directions: &[Vec3::Y], ..dark(&palette) }));
    let lattice = Some(SunLattice { origin: Vec3::ZERO, spacing_m: 1.0, size: [2, 2, 2], reached: &[1.0] });
    let sun = Some(MovingSun { direction: Vec3::Y, irradiance: Vec3::ONE, lattice });
    assert!(refused(&MovingFrame { sun, ..dark(&palette) }));
    assert!(!refused(&dark(&palette)));
}
