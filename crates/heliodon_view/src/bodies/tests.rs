//! Bodies without a GPU: in a space alone, on foot, and in an app.

use super::space::Space;
use super::*;
use crate::actors::course::Course;
use crate::daylight::chunk::KeptChunk;
use crate::daylight::cluster::cluster;
use crate::navigation::walk::{BODY_RADIUS_M, EYE_HEIGHT_M};
use bevy::time::TimeUpdateStrategy;
use glam::Vec3A;
use std::sync::Arc;
use std::time::Duration;

/// A rectangle from a corner along two edges.
fn quad(corner: Vec3, u: Vec3, v: Vec3) -> Arc<KeptChunk> {
    let corners = [corner, corner + v, corner + u + v, corner + u];
    let made = cluster(&corners, &[[0, 1, 2], [0, 2, 3]]);
    let positions: Vec<Vec3> = made.vertices.iter().map(|&v| corners[v as usize]).collect();
    let bounds = positions.iter().fold((corner, corner), |(a, b), &p| (a.min(p), b.max(p)));
    Arc::new(KeptChunk { positions, indices: made.indices, clusters: made.clusters, bounds, albedo: Vec::new() })
}

/// A level floor of 40 m.
fn floor(height: f32) -> Arc<KeptChunk> {
    quad(Vec3::new(-20.0, height, -20.0), Vec3::X * 40.0, Vec3::Z * 40.0)
}

/// An upright wall, 3 m high, from one point of the floor to another.
fn upright(from: [f32; 2], to: [f32; 2]) -> Arc<KeptChunk> {
    let [from, to] = [from, to].map(|[x, z]| Vec3::new(x, 0.0, z));
    quad(from, to - from, Vec3::Y * 3.0)
}

fn ground(chunks: impl IntoIterator<Item = Arc<KeptChunk>>) -> Ground {
    let mut ground = Ground::default();
    chunks.into_iter().for_each(|chunk| ground.push(chunk));
    ground
}

/// A space with all of a ground in it.
fn space_of(ground: &Ground) -> Space {
    let (mut space, mut stone) = (Space::default(), Stone::new(ground));
    let everywhere = [(Vec3::splat(-1e3), Vec3::splat(1e3))];
    for _ in 0..1000 {
        stone.need(&mut space, &everywhere, true);
        if stone.is_built(&everywhere) {
            return space;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    panic!("the stone was not built within a second");
}

/// A cube of a size about its model's origin.
fn cube(size: f32) -> Collider {
    Hull::cuboid(Vec3::splat(-0.5 * size), Vec3::splat(0.5 * size)).collider(Vec3::ONE)
}

fn steps(space: &mut Space, count: usize) -> Vec<Impact> {
    let mut impacts = Vec::new();
    (0..count).for_each(|_| space.step(&mut impacts));
    impacts
}

fn at(x: f32, y: f32, z: f32) -> Motion {
    Motion::rest(Vec3::new(x, y, z), Quat::IDENTITY)
}

#[test]
fn a_box_falls_onto_a_floor_and_rests() {
    let mut space = space_of(&ground([floor(0.0)]));
    let body = space.add_thing("box", &cube(0.4), at(0.0, 2.0, 0.0), false);
    let impacts = steps(&mut space, 240);
    let motion = space.motion(body).unwrap();
    // Its corners do not bounce quite at once.
    assert!((motion.place.y - 0.2).abs() < 0.01 && motion.place.x.abs() < 0.15, "{motion:?}");
    assert!(!space.is_awake(body) && space.awake() == 0, "{motion:?}");
    // It fell 1.8 m.
    let hardest = impacts.iter().map(|impact| impact.speed_m_s).fold(0.0, f32::max);
    assert!((hardest - (2.0_f32 * 9.81 * 1.8).sqrt()).abs() < 0.4, "{hardest} m/s");
    assert!(impacts.iter().all(|impact| impact.name == "box" && impact.with.is_none()));
}

#[test]
fn what_is_slippery_enough_slides_off_a_slope() {
    // 45 degrees is more than the friction holds.
    let slope = quad(Vec3::new(-3.0, 3.0, -3.0), Vec3::new(6.0, -6.0, 0.0), Vec3::Z * 6.0);
    let mut space = space_of(&ground([slope]));
    let turned = Motion { turn: Quat::from_rotation_z(-std::f32::consts::FRAC_PI_4), ..at(-1.0, 1.3, 0.0) };
    let body = space.add_thing("box", &cube(0.3), turned, false);
    steps(&mut space, 90);
    let motion = space.motion(body).unwrap();
    assert!(motion.place.x > 0.0 && motion.place.x + motion.place.y > -0.5, "{motion:?}");
}

#[test]
fn two_things_stack_and_the_upper_falls_when_the_lower_is_taken() {
    let mut space = space_of(&ground([floor(0.0)]));
    let lower = space.add_thing("lower", &cube(0.4), at(0.0, 0.21, 0.0), false);
    let upper = space.add_thing("upper", &cube(0.4), at(0.0, 0.63, 0.0), false);
    steps(&mut space, 240);
    let height = space.motion(upper).unwrap().place.y;
    assert!((height - 0.6).abs() < 0.02 && space.awake() == 0, "{height}");
    space.remove(lower);
    steps(&mut space, 120);
    let height = space.motion(upper).unwrap().place.y;
    assert!((height - 0.2).abs() < 0.02, "{height}");
}

#[test]
fn what_sleeps_wakes_when_it_is_hit() {
    let mut space = space_of(&ground([floor(0.0)]));
    let target = space.add_thing("target", &cube(0.3), at(0.0, 0.15, 0.0), true);
    assert_eq!(space.awake(), 0);
    let thrown = Motion { velocity: Vec3::X * 5.0, ..at(-1.0, 0.25, 0.0) };
    space.add_thing("thrown", &cube(0.3), thrown, false);
    let impacts = steps(&mut space, 60);
    assert!(space.motion(target).unwrap().place.x > 0.05);
    assert!(impacts.iter().any(|impact| impact.with.is_some() && impact.speed_m_s > 2.0), "{impacts:?}");
}

#[test]
fn what_begins_in_a_wall_or_in_another_comes_out_gently() {
    let mut space = space_of(&ground([floor(0.0), upright([1.0, -5.0], [1.0, 5.0])]));
    let bodies: Vec<Entity> = (0..6)
        .map(|i| {
            let mut motion = at(0.9 + 0.02 * i as f32, 0.3, 0.0);
            motion.place = place::free(&mut space, &cube(0.4), motion, &[Vec3::new(-1.0, 1.6, 0.0)]);
            space.add_thing(&format!("{i}"), &cube(0.4), motion, false)
        })
        .collect();
    for _ in 0..300 {
        steps(&mut space, 1);
        for &body in &bodies {
            let motion = space.motion(body).unwrap();
            assert!(motion.is_finite() && motion.velocity.length() < 6.0, "{motion:?}");
        }
    }
    for &body in &bodies {
        let motion = space.motion(body).unwrap();
        assert!(motion.place.length() < 5.0 && motion.place.y > 0.1 && motion.place.x < 0.95, "{motion:?}");
    }
}

#[test]
fn nothing_is_thrown_through_a_thin_wall() {
    let mut space = space_of(&ground([floor(0.0), upright([2.0, -5.0], [2.0, 5.0])]));
    let thrown = Motion { velocity: Vec3::X * 500.0, spin: Vec3::Z * 500.0, ..at(0.0, 1.0, 0.0) };
    let body = space.add_thing("stone", &cube(0.1), thrown, false);
    for _ in 0..120 {
        steps(&mut space, 1);
        let motion = space.motion(body).unwrap();
        assert!(motion.place.x < 2.0 && motion.velocity.length() <= FASTEST_M_S * 1.01, "{motion:?}");
    }
}

/// Things dropped in a heap.
fn heap(count: usize) -> (Space, Vec<Entity>) {
    let mut space = space_of(&ground([floor(0.0)]));
    let drop = |i: usize| {
        let (x, y, z) = (i % 5, i / 25, i / 5 % 5);
        let turn = Quat::from_euler(EulerRot::XYZ, i as f32, 0.7 * i as f32, 0.3);
        Motion { turn, ..at(0.3 * x as f32, 0.5 + 0.4 * y as f32, 0.3 * z as f32) }
    };
    let bodies = (0..count).map(|i| space.add_thing(&format!("{i}"), &cube(0.2), drop(i), false)).collect();
    (space, bodies)
}

#[test]
fn the_same_inputs_give_the_same_bits() {
    let run = || {
        let (mut space, bodies) = heap(30);
        let impacts = steps(&mut space, 200);
        let bits = |body: &Entity| {
            let motion = space.motion(*body).unwrap();
            let numbers = [motion.place, motion.velocity, motion.spin].map(|v| v.to_array().map(f32::to_bits));
            (numbers, motion.turn.to_array().map(f32::to_bits))
        };
        (bodies.iter().map(bits).collect::<Vec<_>>(), impacts)
    };
    assert_eq!(run(), run());
}

#[test]
fn two_hundred_things_stay_together() {
    for count in [1, 20, 200] {
        let (mut space, bodies) = heap(count);
        let (mut falling_ms, mut most_ms, mut falling) = (0.0, 0.0_f32, 0);
        for _ in 0..1800 {
            let start = Instant::now();
            let awake = space.awake() > 0;
            steps(&mut space, 1);
            let ms = start.elapsed().as_secs_f32() * 1e3;
            if awake {
                (falling_ms, most_ms, falling) = (falling_ms + ms, most_ms.max(ms), falling + 1);
            }
        }
        for &body in &bodies {
            let motion = space.motion(body).unwrap();
            assert!(motion.is_finite() && motion.place.y > 0.05 && motion.place.length() < 20.0, "{motion:?}");
        }
        assert_eq!(space.awake(), 0, "{count} lie still after half a minute");
        // for people to read: how fast a machine is, no test may ask
        println!("{count} things fall for {falling} steps, {:.2} ms each, at most {most_ms:.2}", falling_ms / falling as f32);
    }
}

#[test]
fn stone_is_built_where_it_is_needed_and_no_more_is_kept() {
    let far = quad(Vec3::new(500.0, 0.0, 500.0), Vec3::X, Vec3::Z);
    let unsound = quad(Vec3::NAN, Vec3::X, Vec3::Z);
    let ground = ground([floor(0.0), far, unsound]);
    let (mut space, mut stone) = (Space::default(), Stone::new(&ground));
    let here = [(Vec3::splat(-1.0), Vec3::splat(1.0))];
    assert!(!stone.is_built(&here));
    while !stone.is_built(&here) {
        stone.need(&mut space, &here, false);
        std::thread::sleep(Duration::from_millis(1));
    }
    assert_eq!(stone.built(), (1, 2));
    assert!(stone.is_built(&[(Vec3::splat(100.0), Vec3::splat(101.0))]), "nothing is there");
}

/// Where an eye gets that walks for a number of frames of 20 ms.
fn wander(ground: &Ground, from: Vec3, wish: Vec3, count: usize) -> Vec3 {
    let (mut space, mut gait) = (space_of(ground), Fall::default());
    (0..count).fold(from, |eye, _| walk::walk(&mut space, ground, eye, wish * 0.02, 0.02, &mut gait))
}

fn standing(x: f32, z: f32) -> Vec3 {
    Vec3::new(x, EYE_HEIGHT_M, z)
}

#[test]
fn a_visitor_slides_along_a_wall_and_leaves_a_corner() {
    let ground = ground([floor(0.0), upright([2.0, -9.0], [2.0, 9.0]), upright([-9.0, 4.0], [2.0, 4.0])]);
    let slid = wander(&ground, standing(0.0, 0.0), Vec3::new(1.5, 0.0, 1.0), 100);
    assert!(slid.x < 2.0 - BODY_RADIUS_M && slid.x > 1.5 && slid.z > 1.8, "{slid}");
    let caught = wander(&ground, standing(0.0, 0.0), Vec3::new(1.5, 0.0, 1.0), 400);
    assert!(caught.x < 2.0 - BODY_RADIUS_M && caught.z < 4.0 - BODY_RADIUS_M, "{caught}");
    let out = wander(&ground, caught, Vec3::new(-1.0, 0.0, -1.0), 100);
    assert!(out.x < caught.x - 1.5 && out.z < caught.z - 1.5, "{out}");
}

#[test]
fn a_visitor_gets_through_a_door_but_through_no_wall() {
    let door = [floor(0.0), upright([2.0, -9.0], [2.0, -0.45]), upright([2.0, 0.45], [2.0, 9.0])];
    let through = wander(&ground(door.clone()), standing(0.0, 0.05), Vec3::X * 1.5, 200);
    assert!(through.x > 5.0, "{through}");
    let beside = wander(&ground(door), standing(0.0, 2.0), Vec3::X * 20.0, 50);
    assert!(beside.x < 2.0 - BODY_RADIUS_M, "{beside}");
}

#[test]
fn a_visitor_climbs_stairs_and_ducks_under_no_beam() {
    let rise = |i: usize| 0.18 * i as f32;
    let run = |i: usize| 1.0 + 0.3 * i as f32;
    let stairs = (1..=10).flat_map(|i| {
        let front = quad(Vec3::new(run(i), rise(i - 1), -2.0), Vec3::Y * 0.18, Vec3::Z * 4.0);
        let depth = if i == 10 { 9.0 } else { 0.3 };
        [front, quad(Vec3::new(run(i), rise(i), -2.0), Vec3::X * depth, Vec3::Z * 4.0)]
    });
    let up = wander(&ground(stairs.chain([floor(0.0)])), standing(0.0, 0.0), Vec3::X * 1.2, 400);
    assert!(up.x > 5.0 && (up.y - 1.8 - EYE_HEIGHT_M).abs() < 0.02, "{up}");
    let beam = quad(Vec3::new(1.0, 1.5, -9.0), Vec3::Y * 0.3, Vec3::Z * 18.0);
    let held = wander(&ground([floor(0.0), beam]), standing(-1.0, 0.0), Vec3::X * 1.5, 200);
    assert!(held.x < 1.0 - 0.1 && (held.y - EYE_HEIGHT_M).abs() < 1e-3, "{held}");
}

#[test]
fn a_visitor_is_held_by_things_and_stands_on_low_ones() {
    let ground = ground([floor(0.0)]);
    let mut space = space_of(&ground);
    let block = Hull::cuboid(Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 1.2, 0.5)).collider(Vec3::ONE);
    space.add_thing("block", &block, at(2.0, 0.0, 0.0), true);
    let plinth = Hull::cuboid(Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 0.4, 0.5)).collider(Vec3::ONE);
    space.add_thing("plinth", &plinth, at(-2.0, 0.0, 0.0), true);
    let mut go = |wish: Vec3, count: usize| {
        let mut gait = Fall::default();
        (0..count).fold(standing(0.0, 0.0), |eye, _| walk::walk(&mut space, &ground, eye, wish * 0.02, 0.02, &mut gait))
    };
    let held = go(Vec3::X, 150);
    assert!(held.x < 1.5 - BODY_RADIUS_M + 0.01 && held.x > 1.0, "{held}");
    let on = go(Vec3::NEG_X, 100);
    assert!((on.x + 2.0).abs() < 0.1 && (on.y - 0.4 - EYE_HEIGHT_M).abs() < 0.02, "{on}");
}

#[test]
fn a_capsule_does_all_that_rays_did() {
    use crate::navigation::walk::tests::{court, quad};
    let go = |ground: &Ground, from: Vec3, wish: Vec3, count: usize| {
        let by_rays = (0..count).fold((from, Fall::default()), |(eye, mut fall), _| {
            (crate::navigation::walk::walk(ground, eye, wish * 0.02, 0.02, &mut fall), fall)
        });
        (wander(ground, from, wish, count), by_rays.0)
    };
    let (down, by_rays) = go(&court(), Vec3::new(-5.0, 4.0, 0.0), Vec3::ZERO, 200);
    assert!((down.y - EYE_HEIGHT_M).abs() < 1e-3 && down.abs_diff_eq(by_rays, 1e-3), "{down}, by rays {by_rays}");
    let (up, by_rays) = go(&court(), down, Vec3::X * 1.5, 300);
    assert!(up.x > 3.0 && (up.y - 0.5 - EYE_HEIGHT_M).abs() < 1e-2 && up.abs_diff_eq(by_rays, 0.02), "{up}, by rays {by_rays}");
    let (slid, by_rays) = go(&court(), Vec3::new(4.0, 0.5 + EYE_HEIGHT_M, 0.0), Vec3::new(1.5, 0.0, 1.0), 150);
    assert!(slid.x < 6.0 - BODY_RADIUS_M + 0.05 && slid.z > 2.0, "{slid}");
    // Rays keep the radius along the way, a capsule across the wall.
    assert!(slid.abs_diff_eq(by_rays, 0.06), "{slid}, by rays {by_rays}");
    let mut ground = court();
    let beam = [[1.5, -9.0], [1.8, -9.0], [1.8, 9.0], [1.5, 9.0]].map(|[y, z]| Vec3::new(0.0, y, z));
    ground.push(quad(beam));
    let (held, by_rays) = go(&ground, standing(-2.0, 0.0), Vec3::X * 1.5, 200);
    assert!(held.x < -0.2 && held.x > -BODY_RADIUS_M - 0.05, "{held}, by rays {by_rays}");
    assert_eq!(go(&court(), Vec3::new(50.0, 3.0, 0.0), Vec3::ZERO, 50).0.y, 3.0);
}

/// Rolling ground of four chunks, 40 m wide, of twice 150 by 150 triangles each.
fn hills() -> Ground {
    const N: u32 = 150;
    let chunk = |corner: Vec3| {
        let at = |i: u32, j: u32| corner + Vec3::new(i as f32, 0.0, j as f32) * (20.0 / N as f32);
        let roll = |p: Vec3| p + Vec3::Y * (0.3 * libm::sinf(p.x) * libm::cosf(0.7 * p.z));
        let places: Vec<Vec3> = (0..=N).flat_map(|j| (0..=N).map(move |i| roll(at(i, j)))).collect();
        let quads = (0..N).flat_map(|j| (0..N).map(move |i| j * (N + 1) + i));
        let triangles: Vec<[u32; 3]> = quads.flat_map(|a| [[a, a + N + 1, a + 1], [a + 1, a + N + 1, a + N + 2]]).collect();
        let made = cluster(&places, &triangles);
        let positions: Vec<Vec3> = made.vertices.iter().map(|&v| places[v as usize]).collect();
        let bounds = positions.iter().fold((corner, corner), |(a, b), &p| (a.min(p), b.max(p)));
        Arc::new(KeptChunk { positions, indices: made.indices, clusters: made.clusters, bounds, albedo: Vec::new() })
    };
    ground([Vec3::new(-20.0, 0.0, -20.0), Vec3::new(0.0, 0.0, -20.0), Vec3::new(-20.0, 0.0, 0.0), Vec3::ZERO].map(chunk))
}

#[test]
fn hills_are_walked_as_by_rays() {
    let ground = hills();
    let start = Instant::now();
    let mut space = space_of(&ground);
    println!("180,000 triangles are solid after {:.0} ms", start.elapsed().as_secs_f32() * 1e3);
    let go = |one: &mut dyn FnMut(Vec3, Vec3, &mut Fall) -> Vec3| {
        let (mut eye, mut gait) = (Vec3::new(-15.0, 3.0, -12.0), Fall::default());
        let start = Instant::now();
        (0..1000).for_each(|_| eye = one(eye, Vec3::new(0.02, 0.0, 0.015), &mut gait));
        (eye, start.elapsed().as_secs_f32() * 1e3)
    };
    let (by_rays, rays_us) = go(&mut |eye, wish, gait| crate::navigation::walk::walk(&ground, eye, wish, 0.02, gait));
    let (capsule, capsule_us) = go(&mut |eye, wish, gait| walk::walk(&mut space, &ground, eye, wish, 0.02, gait));
    println!("a step by rays {rays_us:.1} us, by a capsule {capsule_us:.1} us");
    assert!(by_rays.abs_diff_eq(capsule, 1e-3) && by_rays.x > 4.9, "{by_rays} {capsule}");
}

/// An app in which nothing is but bodies, on an empty stage.
fn app(frame_ms: u64) -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, BodiesPlugin))
        .init_resource::<Stage>()
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(frame_ms)));
    // The first frame has no length.
    app.update();
    app
}

fn add(app: &mut App, name: &str, home: Vec3) {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE].map(|p| p * 0.2);
    app.world_mut().resource_mut::<Bodies>().add(name, &corners, Affine3A::from_translation(home));
}

fn height(app: &App, name: &str) -> Option<f32> {
    let direction = app.world().resource::<Actors>().directions.get(name)?;
    direction.world_from_model.map(|at| at.translation.y)
}

#[test]
fn things_are_let_go_taken_again_and_come_back_when_lost() {
    let mut app = app(20);
    add(&mut app, "cup", Vec3::Y);
    let bodies = |app: &mut App, ask: &dyn Fn(&mut Bodies)| ask(&mut app.world_mut().resource_mut::<Bodies>());
    (0..10).for_each(|_| app.update());
    assert_eq!(height(&app, "cup"), None, "nobody touched it");
    let hand = Affine3A::from_translation(Vec3::new(0.0, 2.0, 0.0));
    bodies(&mut app, &|bodies| bodies.hold("cup"));
    app.update();
    assert!(!app.world().resource::<Bodies>().is_falling("cup"));
    bodies(&mut app, &|bodies| bodies.release("cup", hand, Vec3::ZERO, Vec3::ZERO));
    assert!(app.world().resource::<Bodies>().is_falling("cup"));
    (0..25).for_each(|_| app.update());
    let fallen = height(&app, "cup").unwrap();
    // Half a second, less a step or two.
    assert!((2.0 - fallen - 1.23).abs() < 0.2, "{fallen}");
    bodies(&mut app, &|bodies| bodies.hold("cup"));
    (0..25).for_each(|_| app.update());
    let held = height(&app, "cup").unwrap();
    assert!((held - fallen).abs() < 0.2, "{held}");
    bodies(&mut app, &|bodies| bodies.release("cup", hand, Vec3::ZERO, Vec3::ZERO));
    (0..200).for_each(|_| app.update());
    assert_eq!(height(&app, "cup"), Some(1.0), "there is no floor: it is back where it belongs");
    assert!(!app.world().resource::<Bodies>().is_falling("cup"));
}

#[test]
fn what_is_let_go_nowhere_comes_back_and_unknown_names_do_no_harm() {
    let mut app = app(20);
    add(&mut app, "cup", Vec3::Y);
    let mut bodies = app.world_mut().resource_mut::<Bodies>();
    bodies.release("cup", Affine3A::from_translation(Vec3::NAN), Vec3::INFINITY, Vec3::NAN);
    bodies.release("nobody", Affine3A::IDENTITY, Vec3::ZERO, Vec3::ZERO);
    bodies.hold("nobody either");
    (0..5).for_each(|_| app.update());
    let at = height(&app, "cup").unwrap();
    assert!(at.is_finite() && at <= 1.0 && at > 0.5, "{at}");
    assert!(!app.world().resource::<Bodies>().is_falling("nobody"));
}

#[test]
fn what_a_script_moves_or_hides_no_body_moves() {
    let mut app = app(20);
    add(&mut app, "cup", Vec3::Y);
    app.world_mut().resource_mut::<Bodies>().release("cup", Affine3A::from_translation(Vec3::Y), Vec3::ZERO, Vec3::ZERO);
    (0..5).for_each(|_| app.update());
    let shelf = Affine3A::from_translation(Vec3::new(3.0, 4.0, 0.0));
    app.world_mut().resource_mut::<Actors>().directions.entry("cup".to_owned()).or_default().world_from_model = Some(shelf);
    (0..20).for_each(|_| app.update());
    assert_eq!(height(&app, "cup"), Some(4.0));
    app.world_mut().resource_mut::<Actors>().directions.entry("cup".to_owned()).or_default().hidden = true;
    app.world_mut().resource_mut::<Bodies>().release("cup", shelf, Vec3::ZERO, Vec3::ZERO);
    (0..20).for_each(|_| app.update());
    assert_eq!(height(&app, "cup"), Some(4.0));
}

#[test]
fn a_picture_without_time_moves_nothing_and_makes_no_space() {
    let mut app = app(0);
    add(&mut app, "cup", Vec3::Y);
    app.world_mut().resource_mut::<Bodies>().release("cup", Affine3A::IDENTITY, Vec3::ZERO, Vec3::ZERO);
    (0..5).for_each(|_| app.update());
    assert_eq!(height(&app, "cup"), None);
    assert!(app.world().resource::<Bodies>().space.is_none());
    // Nor does time without things.
    let mut app = self::app(20);
    (0..5).for_each(|_| app.update());
    assert!(app.world().resource::<Bodies>().space.is_none());
    assert_eq!(app.world().resource::<Bodies>().told(), Told::default());
}

/// Where a thing is shown.
fn shown(app: &App, name: &str) -> Affine3A {
    app.world().resource::<Actors>().directions[name].world_from_model.unwrap()
}

#[test]
fn what_is_shown_by_pictures_falls_as_models_do_and_stays_upright() {
    let mut app = app(20);
    let info = crate::impostor::outline::tests::of_a_box(Vec3::new(0.4, 0.6, 0.2));
    let course = Course::stands(Vec3::new(1.0, 0.0, 0.0), 0.0);
    app.world_mut().resource_mut::<Impostors>().place("jar", info, course);
    add(&mut app, "model", Vec3::X * 3.0);
    (0..5).for_each(|_| app.update());
    assert_eq!(height(&app, "jar"), None, "nobody touched it");
    // as a hand lets go of it: turned aside, leaning and tumbling
    let leaning = Affine3A::from_rotation_translation(Quat::from_euler(EulerRot::YXZ, 0.7, 0.5, 0.3), Vec3::Y * 3.0);
    let let_go = |app: &mut App, name: &str| {
        app.world_mut().resource_mut::<Bodies>().release(name, leaning, Vec3::ZERO, Vec3::new(4.0, 1.0, 4.0));
    };
    let_go(&mut app, "jar");
    (0..3).for_each(|_| app.update());
    // the actor is known by now: both begin at once
    let_go(&mut app, "jar");
    let_go(&mut app, "model");
    (0..25).for_each(|_| app.update());
    let [jar, model] = ["jar", "model"].map(|name| height(&app, name).unwrap());
    // half a second, less a step or two; the model tumbles about its middle
    assert!((3.0 - jar - 1.23).abs() < 0.2 && (jar - model).abs() < 0.4, "the jar is at {jar}, the model at {model}");
    let at = shown(&app, "jar");
    assert!((at.matrix3.y_axis - Vec3A::Y).length() < 1e-3, "{at:?}");
    let turned = libm::atan2f(at.matrix3.z_axis.x, at.matrix3.z_axis.z);
    assert!(turned > 0.8 && turned < 1.6, "it is turned as the hand did, and goes on turning: {turned}");
    (0..200).for_each(|_| app.update());
    assert!(!app.world().resource::<Bodies>().is_falling("jar"), "there is no floor: it is back where it belongs");
    let course = app.world().resource::<Impostors>().whereabouts("jar", app.world().resource::<Actors>()).unwrap().0;
    assert_eq!(course.translation.x, 1.0);
}

#[test]
fn a_thing_that_stays_upright_lands_on_its_foot() {
    let mut space = space_of(&ground([floor(0.0)]));
    let info = crate::impostor::outline::tests::of_a_box(Vec3::new(0.2, 0.6, 0.2));
    let jar = Hull::around(&crate::impostor::outline::corners(&info)).unwrap().collider(Vec3::ONE);
    // on the edge of a step, which tips over what is free to
    let [upright, free] = [0.0, 4.0].map(|z| {
        let corners = [[0.0, -1.0], [0.0, 1.0], [1.0, 1.0], [1.0, -1.0]].map(|[x, along]| Vec3::new(0.03 + x, 0.2, z + along));
        space.add_stone(Collider::trimesh(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]));
        space.add_thing("jar", &jar, at(0.0, 0.5, z), false)
    });
    space.keep_upright(upright);
    steps(&mut space, 240);
    let [upright, free] = [upright, free].map(|body| space.motion(body).unwrap());
    assert!((upright.turn * Vec3::Y).y > 0.999 && (upright.place.y - 0.2).abs() < 0.02, "{upright:?}");
    assert!((free.turn * Vec3::Y).y < 0.9, "{free:?}");
}
