//! The visibility matrix on a GPU, software if need be: analytic scenes, and rays as the truth.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic, and tell what it found")]

use glam::Vec3;
use heliodon_gpu::{Answered, DepthMaps, GpuError, Headless, Method, Rays, VisibilityGpu, headless};
use heliodon_math::light_sphere::LightSphere;
use heliodon_math::sphere::fibonacci_sphere;
use heliodon_math::visibility::{VisibilityBackend, VisibilityMatrix};
use heliodon_rays::VisibilityCpu;
use heliodon_testkit::scenes::{Scene, ball, cuboid, ground, rectangle};
use std::sync::OnceLock;

/// One device for all tests.
fn own() -> &'static Headless {
    static DEVICE: OnceLock<Headless> = OnceLock::new();
    DEVICE.get_or_init(|| headless().expect("software Vulkan at least: ./x test installs it"))
}

fn gpu(method: impl Into<Method>) -> VisibilityGpu {
    let Headless { device, queue, fault, .. } = own();
    VisibilityGpu::new(device, queue, fault, method)
}

/// Both methods, the maps with so many pixels.
fn both(size_px: Option<u32>) -> [Method; 2] {
    [DepthMaps { size_px, ..DepthMaps::default() }.into(), Rays::default().into()]
}

fn set(backend: &mut impl VisibilityBackend, scene: &Scene) {
    backend.set_mesh(&scene.positions, &scene.normals, &scene.triangles).unwrap();
}

fn occlusion(method: Method, scene: &Scene, level: u32) -> Vec<f32> {
    let sphere = LightSphere::new(level);
    let mut gpu = gpu(method);
    set(&mut gpu, scene);
    gpu.compute(sphere.directions()).unwrap();
    gpu.light(sphere.weights(), sphere.directions()).unwrap().ambient_occlusion
}

/// Entries of both matrices by point and direction.
fn entries<'a>(matrix: &'a VisibilityMatrix) -> impl Fn(usize, usize) -> bool + 'a {
    let mut row_of = vec![0; matrix.order().len()];
    matrix.order().iter().enumerate().for_each(|(row, &point)| row_of[point as usize] = row);
    move |point, direction| matrix.is_visible(row_of[point], direction)
}

/// Balls on the ground beside a wall: contacts, penumbrae and grazing light.
fn still_life() -> Scene {
    let turned = rectangle(Vec3::new(-2.0, 0.0, -1.3), Vec3::new(3.9, 0.0, 0.8), Vec3::Y * 2.0, 30);
    let balls = ball(0.5, 32).moved(Vec3::Y * 0.5).and(ball(0.3, 24).moved(Vec3::new(0.7, 0.3, 0.4)));
    ground(6.0, 80).and(turned).and(balls)
}

#[test]
fn depth_maps_agree_with_rays() {
    agree(DepthMaps::default().into(), &still_life(), 0.02, 0.01);
}

#[test]
fn rays_of_a_gpu_are_those_of_a_processor() {
    agree(Rays::default().into(), &still_life(), 0.001, 0.0005);
    // far from the origin, and turned so that nothing lies along an axis
    let mut scene = still_life();
    let turn = glam::Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.7);
    scene.positions.iter_mut().chain(&mut scene.normals).for_each(|v| *v = turn * *v);
    agree(Rays::default().into(), &scene, 0.001, 0.0005);
    agree(Rays::default().into(), &scene.moved(Vec3::new(900.0, 40.0, -700.0)), 0.001, 0.0005);
}

/// Asserts that at most this share of the entries differs from the processor's rays, and ambient occlusion by so much on the average.
fn agree(method: Method, scene: &Scene, most: f64, most_mean: f64) {
    let sphere = LightSphere::new(3);
    let (mut cpu, mut gpu) = (VisibilityCpu::new(None), gpu(method));
    set(&mut cpu, scene);
    set(&mut gpu, scene);
    if let Some(offset_m) = gpu.offset_m() {
        assert!((offset_m - cpu.offset_m()).abs() < 1e-6 * offset_m, "{offset_m} {}", cpu.offset_m());
    }
    cpu.compute(sphere.directions()).unwrap();
    gpu.compute(sphere.directions()).unwrap();
    let (exact, found) = (cpu.matrix().unwrap(), gpu.matrix().unwrap());
    assert_eq!(found.validate(), Ok(()));
    let (exact, found) = (entries(&exact), entries(&found));
    let (points, count) = (scene.positions.len(), sphere.directions().len());
    let differing =
        (0..points).flat_map(|i| (0..count).map(move |j| (i, j))).filter(|&(i, j)| exact(i, j) != found(i, j)).count();
    let share = differing as f64 / (points * count) as f64;
    println!("{:.4} % of entries differ", 100.0 * share);
    assert!(share < most, "{share}");

    let exact = cpu.light(sphere.weights(), sphere.directions()).unwrap();
    let found = gpu.light(sphere.weights(), sphere.directions()).unwrap();
    let differences = exact.ambient_occlusion.iter().zip(&found.ambient_occlusion).map(|(a, b)| f64::from((a - b).abs()));
    let mean = differences.sum::<f64>() / points as f64;
    println!("mean difference of ambient occlusion {mean:.6}");
    assert!(mean < most_mean, "{mean}");
}

#[test]
fn light_is_summed_on_the_gpu_as_from_the_matrix() {
    let scene = still_life();
    // Not whole words: 66 and 18.
    for (level, method) in [1, 2].into_iter().flat_map(|level| both(Some(256)).map(|method| (level, method))) {
        let sphere = LightSphere::new(level);
        let radiance: Vec<Vec3> = sphere.directions().iter().map(|l| Vec3::new(1.0 + l.x, 1.0 + l.y, 2.0)).collect();
        let mut gpu = gpu(method);
        set(&mut gpu, &scene);
        gpu.compute(sphere.directions()).unwrap();
        let there = gpu.light(sphere.weights(), &radiance).unwrap();
        let here = gpu.matrix().unwrap().light(sphere.weights(), &radiance);
        for i in 0..scene.positions.len() {
            assert!((there.light[i] - here.light[i]).abs().max_element() < 1e-4, "{} {}", there.light[i], here.light[i]);
            assert!((there.ambient_occlusion[i] - here.ambient_occlusion[i]).abs() < 1e-5);
            assert!((there.open[i] - here.open[i]).abs() < 1e-4);
        }
    }
}

#[test]
fn convex_solids_are_open() {
    let turned = |mut scene: Scene| {
        let turn = glam::Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.7);
        scene.positions.iter_mut().chain(&mut scene.normals).for_each(|v| *v = turn * *v);
        scene
    };
    let solids = [ball(1.0, 24), turned(cuboid(Vec3::splat(-1.0), Vec3::new(1.0, 2.0, 3.0), 9)), turned(ground(10.0, 3))];
    for (solid, method) in solids.iter().flat_map(|solid| both(None).map(|method| (solid, method))) {
        let ao = occlusion(method, solid, 3);
        let mean = ao.iter().sum::<f32>() / ao.len() as f32;
        let least = ao.iter().fold(1.0f32, |least, &ao| least.min(ao));
        println!("mean {mean}, least {least}");
        assert!(mean > 0.999 && least > 0.98, "mean {mean}, least {least}");
    }
}

#[test]
fn a_wall_takes_half_of_the_ground_at_its_foot() {
    let wall = rectangle(Vec3::new(-8.0, 0.0, 0.0), Vec3::X * 16.0, Vec3::Y * 16.0, 1);
    let mut scene = ground(2.0, 20).moved(Vec3::Z * 1.05).and(wall);
    let turn = glam::Quat::from_rotation_y(0.3);
    scene.positions.iter_mut().chain(&mut scene.normals).for_each(|v| *v = turn * *v);
    for method in both(None) {
        let ao = occlusion(method, &scene, 4);
        for (p, ao) in scene.positions.iter().zip(ao).take(21 * 21).filter(|(p, _)| (turn.inverse() * **p).z < 0.3) {
            assert!((ao - 0.5).abs() < 0.03, "{p}: {ao}");
        }
    }
}

#[test]
fn a_mesh_that_moves_is_seen_where_it_is() {
    let (above, beside) = (Vec3::Y * 0.5, Vec3::new(9.0, 0.5, 0.0));
    let at = |place: Vec3| ground(2.0, 10).and(ball(0.4, 16).moved(place));
    let sphere = LightSphere::new(2);
    for method in both(Some(512)) {
        let mut gpu = gpu(method);
        set(&mut gpu, &at(above));
        let middle = |gpu: &mut VisibilityGpu, scene: &Scene| {
            gpu.move_vertices(&scene.positions, &scene.normals).unwrap();
            let stale = gpu.light(sphere.weights(), sphere.directions());
            assert!(matches!(stale, Err(GpuError::Input(_))), "the matrix was of another place");
            gpu.compute(sphere.directions()).unwrap();
            gpu.light(sphere.weights(), sphere.directions()).unwrap().ambient_occlusion[60]
        };
        let (dark, open) = (middle(&mut gpu, &at(above)), middle(&mut gpu, &at(beside)));
        assert!(dark < 0.4 && open > 0.98, "{dark} {open}");
        assert!(gpu.move_vertices(&[Vec3::ZERO], &[Vec3::Y]).is_err());
    }
}

#[test]
fn what_cannot_be_asked_is_told() {
    let mut gpu = gpu(DepthMaps::default());
    assert!(matches!(gpu.compute(&[Vec3::Y]), Err(GpuError::Input(_))));
    assert!(matches!(gpu.set_mesh(&[Vec3::ZERO], &[], &[]), Err(GpuError::Input(_))));
    assert!(matches!(gpu.set_mesh(&[Vec3::ZERO], &[Vec3::Y], &[[0, 0, 1]]), Err(GpuError::Input(_))));
    set(&mut gpu, &ground(1.0, 2));
    assert!(matches!(gpu.light(&[], &[]), Err(GpuError::Input(_))));
    gpu.compute(&[Vec3::Y]).unwrap();
    assert!(matches!(gpu.light(&[1.0], &[]), Err(GpuError::Input(_))));
    let most = gpu.most_directions(9);
    let too_many = vec![Vec3::Y; (own().device.limits().max_storage_buffer_binding_size / 4 / 9 * 32 + 320) as usize];
    assert!(most < too_many.len());
    match gpu.compute(&too_many) {
        Err(GpuError::TooLarge { needed_bytes, most_bytes, .. }) => assert!(needed_bytes > most_bytes),
        other => panic!("{other:?}"),
    }
}

#[test]
fn hostile_meshes_give_finite_numbers() {
    let sphere = LightSphere::new(1);
    for mut gpu in both(Some(64)).map(gpu) {
        for hostile in heliodon_testkit::hostile::meshes() {
            set(&mut gpu, &hostile.scene);
            gpu.compute(sphere.directions()).unwrap_or_else(|error| panic!("{}: {error}", hostile.name));
            let light = gpu.light(sphere.weights(), sphere.directions()).unwrap();
            assert_eq!(light.light.len(), hostile.scene.positions.len(), "{}", hostile.name);
            assert!(light.ambient_occlusion.iter().all(|ao| (0.0..=1.0).contains(ao)), "{}: {light:?}", hostile.name);
            assert!(light.light.iter().all(|light| light.is_finite()), "{}", hostile.name);
            assert_eq!(gpu.matrix().unwrap().validate(), Ok(()), "{}", hostile.name);
        }
    }
}

#[test]
fn no_ray_leaves_a_closed_room() {
    let turn = glam::Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.7);
    let turned = |mut scene: Scene| {
        scene.positions.iter_mut().chain(&mut scene.normals).for_each(|v| *v = turn * *v);
        scene
    };
    // those that ask hang in the middle; from the lattice's points most rays meet a vertex or an edge of the room
    let asking = |mut scene: Scene| {
        let lattice = (0..512).map(|i| (Vec3::new((i % 8) as f32, (i / 8 % 8) as f32, (i / 64) as f32) - 3.5) / 4.0);
        let inside: Vec<Vec3> = lattice.chain(fibonacci_sphere(2000).into_iter().map(|p| 0.8 * p)).collect();
        let walls = scene.positions.len();
        scene.normals.fill(Vec3::ZERO);
        for (i, p) in inside.into_iter().enumerate() {
            scene.positions.push(p);
            scene.normals.push(if i % 2 == 0 { Vec3::Y } else { Vec3::new(0.6, -0.8, 0.0) });
        }
        (scene, walls)
    };
    let room = asking(cuboid(Vec3::new(-1.0, -2.0, -3.0), Vec3::new(1.0, 2.0, 3.0), 16));
    let hall = asking(ball(3.0, 48));
    let far = Vec3::new(5000.0, 0.0, 3.0);
    for (name, (scene, walls)) in [
        ("room", room.clone()),
        ("turned room", (turned(room.0), room.1)),
        ("hall", hall.clone()),
        ("turned hall", (turned(hall.0.clone()), hall.1)),
        ("far hall", (hall.0.moved(far), hall.1)),
    ] {
        let sphere = LightSphere::new(5);
        let mut gpu = gpu(Rays { offset_m: Some(0.0) });
        set(&mut gpu, &scene);
        gpu.compute(sphere.directions()).unwrap();
        let leaks = gpu.matrix().unwrap().visible_count();
        println!("{name}: {leaks} of {} rays leave", (scene.positions.len() - walls) * sphere.directions().len() / 2);
        assert_eq!(leaks, 0, "{name}");
    }
}

#[test]
fn rays_are_asked_only_of_the_points_that_are_wanted() {
    let scene = still_life();
    let (coarse, fine) = (LightSphere::new(1), LightSphere::new(2));
    let count = scene.positions.len();
    let (first, all): (Vec<bool>, Vec<bool>) = ((0..count).map(|i| i % 3 == 0).collect(), vec![true; count]);
    let mut whole = gpu(Rays::default());
    set(&mut whole, &scene);
    whole.compute(fine.directions()).unwrap();
    let exact = whole.matrix().unwrap();
    let mut gpu = gpu(Rays::default());
    set(&mut gpu, &scene);
    // another matrix, whose bits must not shine through
    gpu.compute(fine.directions()).unwrap();
    gpu.move_vertices(&scene.positions, &scene.normals).unwrap();
    gpu.compute_for(&first, fine.directions()).unwrap();
    let part = gpu.matrix().unwrap();
    assert_eq!(part.validate(), Ok(()));
    assert_eq!(part.order().len(), first.iter().filter(|&&wanted| wanted).count());
    let exactly = entries(&exact);
    for (row, &point) in part.order().iter().enumerate() {
        assert!((0..66).all(|j| part.is_visible(row, j) == exactly(point as usize, j)), "{point}");
    }
    let light = gpu.light(fine.weights(), fine.directions()).unwrap();
    let dark = (0..count).filter(|&i| !first[i]).all(|i| light.light[i] == Vec3::ZERO && light.open[i] == 0.0);
    assert!(dark, "what was not asked has no light");
    gpu.compute_for(&all, fine.directions()).unwrap();
    assert_eq!(gpu.matrix().unwrap(), exact);
    gpu.compute_for(&first, coarse.directions()).unwrap();
    assert_eq!(gpu.matrix().unwrap().directions().len(), 18);
    assert!(matches!(gpu.compute_for(&[true], coarse.directions()), Err(GpuError::Input(_))));
}

#[test]
fn a_gpu_says_how_it_answers() {
    let scene = ground(1.0, 2);
    for (method, expected) in both(None).into_iter().zip([Answered::DepthMaps, Answered::Rays]) {
        let mut gpu = gpu(method);
        assert_eq!((gpu.answered(), gpu.offset_m()), (None, None));
        set(&mut gpu, &scene);
        assert_eq!(gpu.answered(), Some(expected));
        assert_eq!(gpu.offset_m().is_some(), expected == Answered::Rays);
    }
    let mut gpu = gpu(Rays { offset_m: Some(0.25) });
    set(&mut gpu, &scene);
    assert_eq!(gpu.offset_m(), Some(0.25));
}

#[test]
fn hostile_meshes_are_asked_by_rays_as_on_the_processor() {
    let sphere = LightSphere::new(2);
    let mut gpu = gpu(Rays::default());
    for hostile in heliodon_testkit::hostile::meshes() {
        let mut cpu = VisibilityCpu::new(None);
        set(&mut cpu, &hostile.scene);
        set(&mut gpu, &hostile.scene);
        cpu.compute(sphere.directions()).unwrap();
        gpu.compute(sphere.directions()).unwrap();
        let (exact, found) = (cpu.matrix().unwrap(), gpu.matrix().unwrap());
        let (exact, found) = (entries(&exact), entries(&found));
        let all = hostile.scene.positions.len() * sphere.directions().len();
        let differ = |&at: &usize| {
            let (i, j) = (at / sphere.directions().len(), at % sphere.directions().len());
            exact(i, j) != found(i, j)
        };
        let differing = (0..all).filter(differ).count();
        println!("{}: {differing} of {all} entries differ", hostile.name);
        assert!(differing * 1000 <= all, "{}: {differing} of {all} entries differ", hostile.name);
    }
}

#[test]
fn a_triangle_comes_and_goes_with_its_vertices() {
    let roof = rectangle(Vec3::new(-9.0, 1.0, -9.0), Vec3::Z * 18.0, Vec3::X * 18.0, 1);
    let scene = ground(0.5, 2).and(roof);
    let mut gone = scene.clone();
    gone.positions.iter_mut().rev().take(4).for_each(|p| *p = Vec3::NAN);
    let mut gpu = gpu(Rays::default());
    set(&mut gpu, &gone);
    for (place, expected) in [(&gone, 1.0), (&scene, 0.0), (&gone, 1.0)] {
        gpu.move_vertices(&place.positions, &place.normals).unwrap();
        gpu.compute(&[Vec3::Y]).unwrap();
        assert_eq!(gpu.light(&[1.0], &[Vec3::ONE]).unwrap().ambient_occlusion[4], expected);
    }
}
