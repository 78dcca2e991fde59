use super::*;
use crate::{Screen, ViewCell};
use heliodon_math::random::Pcg32;
use heliodon_rays::BuildParams;
use heliodon_testkit::hostile;
use heliodon_testkit::scenes::{Scene, ball, cuboid, ground, rectangle};
use proptest::prelude::*;

fn views(cells: Vec<ViewCell>) -> Views {
    Views { cells, screen: Screen { width_px: 320, height_px: 240, fov_rad: 1.0 } }
}

fn room(low: [f32; 3], high: [f32; 3]) -> ViewCell {
    ViewCell { low: low.into(), high: high.into(), windows: Vec::new() }
}

fn quick() -> PurgeParams {
    PurgeParams { max_eyes: 256, frames: 200, pixels: 2000, ..PurgeParams::default() }
}

fn rays(scene: &Scene) -> TriangleScene {
    TriangleScene::build(&scene.positions, &scene.triangles, &BuildParams::default()).unwrap()
}

/// A ball that is closed: the vertices of its lower pole, which round in their own ways, are one.
fn closed_ball(rings: u32) -> Scene {
    let mut ball = ball(1.0, rings);
    ball.positions.iter_mut().filter(|p| p.y < -0.99999).for_each(|p| *p = Vec3::NEG_Y);
    ball
}

fn purged(scene: &Scene, views: &Views, params: &PurgeParams) -> Purged {
    let surface = Surface { positions: &scene.positions, triangles: &scene.triangles, single_sided: &[] };
    let purged = purge(&rays(scene), &surface, views, params);
    let report = &purged.report;
    let dropped = report.facing_away + report.outside_windows + report.occluded;
    assert_eq!(report.kept + dropped, report.triangles);
    assert_eq!(report.kept, purged.keep.iter().filter(|&&kept| kept).count() as u64);
    purged
}

fn kept(purged: &Purged, range: std::ops::Range<usize>) -> usize {
    purged.keep[range].iter().filter(|&&kept| kept).count()
}

#[test]
fn a_wall_hides_what_stands_behind_it() {
    let wall = rectangle(Vec3::new(-5.0, -5.0, 0.0), Vec3::X * 10.0, Vec3::Y * 10.0, 8);
    let hidden = closed_ball(16).moved(Vec3::NEG_Z * 2.0);
    let (all, front) = (wall.triangles.len() + hidden.triangles.len(), wall.triangles.len());
    let scene = wall.and(hidden);
    let before = purged(&scene, &views(vec![room([-1.0, -1.0, 2.0], [1.0, 1.0, 3.0])]), &quick());
    assert_eq!((kept(&before, 0..front), kept(&before, front..all)), (front, 0));
    assert!(before.report.passed && before.report.occluded > 0 && before.report.facing_away > 0);
    assert_eq!(before.report.rooms[0].verified.wrong, 0);
    // A second room behind the wall sees both; what one room sees is kept for all.
    let both = views(vec![room([-1.0, -1.0, 2.0], [1.0, 1.0, 3.0]), room([-1.0, -1.0, -9.0], [1.0, 1.0, -8.0])]);
    let both = purged(&scene, &both, &quick());
    assert!(kept(&both, 0..front) == front && kept(&both, front..all) > (all - front) / 3);
}

#[test]
fn of_a_ball_the_cap_that_some_eye_sees_stays() {
    let ball = closed_ball(64);
    let cell = room([-0.5, -0.5, 3.0], [0.5, 0.5, 4.0]);
    let corners = windows::corners_of(&cell);
    let after = purged(&ball, &views(vec![cell]), &quick());
    let (mut shown, mut hidden) = (0, 0);
    for (t, &keep) in ball.triangles.iter().zip(&after.keep) {
        let [a, b, c] = t.map(|i| ball.positions[i as usize]);
        let normal = (b - a).cross(c - a).try_normalize().unwrap();
        // nothing else is in the way, so a front that an eye lies before is seen by it
        let most = corners.iter().map(|&eye| normal.dot(eye - a)).fold(f32::NEG_INFINITY, f32::max);
        assert!(keep || most < 1e-3, "triangle at {a} is seen, {most}");
        assert!(!keep || most > -1e-3, "triangle at {a} turns its back on the box, {most}");
        shown += usize::from(keep);
        hidden += usize::from(!keep);
    }
    assert!(shown > 4000 && hidden > 4000, "{shown} {hidden}");
    assert_eq!(after.report.facing_away as usize, hidden);
}

#[test]
fn an_open_sheet_stays_though_only_its_back_is_seen_unless_it_is_single_sided() {
    let sheet = rectangle(Vec3::new(-2.0, -2.0, 0.0), Vec3::X * 4.0, Vec3::Y * 4.0, 6);
    let behind = sheet.clone().moved(Vec3::NEG_Z);
    let scene = sheet.and(behind).inside_out();
    let views = views(vec![room([-0.2, -0.2, 2.0], [0.2, 0.2, 3.0])]);
    let half = scene.triangles.len() / 2;
    let after = purged(&scene, &views, &quick());
    assert_eq!(kept(&after, 0..half), half);
    // what no eye sees of the farther sheet is its middle, a ring of neighbours apart: its rim is too small to show beside the nearer
    assert_eq!(kept(&after, half..2 * half), 0);
    let mut single_sided = vec![true; half];
    single_sided.resize(2 * half, false);
    let surface = Surface { positions: &scene.positions, triangles: &scene.triangles, single_sided: &single_sided };
    let after = purge(&rays(&scene), &surface, &views, &quick());
    assert_eq!((kept(&after, 0..half), kept(&after, half..2 * half)), (0, half), "the nearer is looked through");
    assert!(after.report.passed && after.report.facing_away as usize == half);
}

#[test]
fn through_a_window_a_cone_is_seen() {
    let far = rectangle(Vec3::new(-20.0, -20.0, -10.0), Vec3::X * 40.0, Vec3::Y * 40.0, 80);
    let window = [Vec3::new(-0.5, -0.5, -2.0), Vec3::new(0.5, -0.5, -2.0), Vec3::new(-0.5, 0.5, -2.0)];
    let cell = ViewCell { windows: vec![window], ..room([-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]) };
    let after = purged(&far, &views(vec![cell]), &quick());
    // From an eye at x = -0.5, z = -0.5 through the window's far edge x = 0.5: 8 m beyond, it is 1/1.5 * 8 farther still.
    let reach = 0.5 + 8.0 / 1.5;
    for (t, &keep) in far.triangles.iter().zip(&after.keep) {
        let corners = t.map(|i| far.positions[i as usize].truncate().abs().max_element());
        let (least, most) = (corners.into_iter().fold(f32::INFINITY, f32::min), corners.into_iter().fold(0.0, f32::max));
        assert!(keep || most > reach, "{corners:?} is seen");
        // half a metre is one ring
        assert!(!keep || least < reach + 0.51, "{corners:?} is not seen");
    }
    assert!(after.report.outside_windows > 10_000 && after.report.rooms[0].verified.wrong == 0);
}

/// A wall with a square hole, and a board far behind it.
fn keyhole(side: f32) -> (Scene, usize) {
    let (x, y, half) = (Vec3::X * 10.0, Vec3::Y * 10.0, 0.5 * side);
    let strip =
        |x: f32, y: f32, z: f32, width: f32, height: f32| rectangle(Vec3::new(x, y, z), Vec3::X * width, Vec3::Y * height, 4);
    // Edge to edge, they would leave cracks where vertices of one lie on edges of the other, and through cracks one sees.
    let wall = strip(-10.0, -10.0, 0.0, 10.0 - half, 20.0)
        .and(strip(half, -10.0, 0.0, 10.0 - half, 20.0))
        .and(strip(-0.1, -10.0, -1e-4, 0.2, 10.0 - half))
        .and(strip(-0.1, half, -1e-4, 0.2, 10.0 - half));
    let count = wall.triangles.len();
    (wall.and(rectangle(-0.2 * (x + y) - Vec3::Z * 2.0, x * 0.4, y * 0.4, 40)), count)
}

#[test]
fn a_keyhole_is_found() {
    // 1 cm at 3 m is 1.1e-5 of a steradian: less than one pixel of these item buffers, 1.5e-5 at 0.5 of 320 x 240 pixels
    let (scene, wall) = keyhole(0.01);
    let cell = room([-0.5, -0.5, 2.5], [0.5, 0.5, 3.5]);
    let params = PurgeParams { max_eyes: 512, ..quick() };
    let after = purged(&scene, &views(vec![cell.clone()]), &params);
    // Through the hole, the eyes see the board as far as |x| = (0.5 + 0.005) / 2.5 * 2 + 0.005 = 0.409.
    let within = |reach: f32| {
        let inside =
            |t: &usize| scene.triangles[*t].iter().all(|&i| scene.positions[i as usize].truncate().abs().max_element() < reach);
        let seen: Vec<usize> = (wall..scene.triangles.len()).filter(inside).collect();
        (seen.len(), seen.iter().filter(|&&t| after.keep[t]).count())
    };
    // as far as the farthest eyes look, all but one or two; as far as those at its nearest corners do, six sevenths
    let [(near, found_near), (all, found)] = [0.305, 0.405].map(within);
    assert!(near == 72 && found_near >= 70, "{found_near} of {near}");
    assert!(all == 128 && found >= 110, "{found} of {all}");
    // and what none sees through it is gone: half a metre and two rings
    let beyond = |t: &[u32; 3]| t.iter().all(|&i| scene.positions[i as usize].truncate().abs().max_element() > 0.71);
    assert!((wall..scene.triangles.len()).filter(|&t| beyond(&scene.triangles[t])).all(|t| !after.keep[t]));
    assert!(after.report.passed);
}

#[test]
fn a_wrong_list_is_caught_and_a_right_one_is_not() {
    let scene = ground(40.0, 40).and(ball(1.0, 24).moved(Vec3::Y));
    let (rays, views) = (rays(&scene), views(vec![room([3.0, 1.0, -1.0], [5.0, 2.0, 1.0])]));
    let check = CheckParams { frames: 300, pixels: 1000, near_m: 0.05, seed: 3 };
    let all = vec![true; scene.triangles.len()];
    let right = &verify(&rays, &[], &all, &views, &check)[0];
    assert!(right.wrong == 0 && right.worst.is_none() && right.met > 100_000 && right.frames == 300);
    let mut wrong = all;
    let gone: Vec<u32> = (0..40).collect();
    gone.iter().for_each(|&t| wrong[t as usize] = false);
    let caught = &verify(&rays, &[], &wrong, &views, &check)[0];
    assert!(caught.wrong > 0 && caught.missing.iter().all(|t| gone.contains(t)));
    assert_eq!((caught.met, caught.pixels), (right.met, right.pixels));
    assert!(caught.worst.is_some_and(|worst| worst.wrong > 0 && worst.wrong <= worst.met));
}

#[test]
fn what_the_search_missed_the_check_puts_back() {
    let scene = ground(40.0, 60).and(ball(1.0, 24).moved(Vec3::Y));
    let views = views(vec![room([3.0, 1.0, -1.0], [5.0, 2.0, 1.0])]);
    let blunt = PurgeParams { resolution: 0.0, max_eyes: 1, face_rays: 0, border_rays: 0, ring: 0, ..quick() };
    let once = purged(&scene, &views, &PurgeParams { max_checks: 1, ..blunt });
    assert!(!once.report.passed && once.report.rooms[0].verified.wrong_share() > blunt.wrong_share);
    let mended = purged(&scene, &views, &PurgeParams { max_checks: 40, frames: 600, ..blunt });
    assert!(mended.report.passed && mended.report.checks > 1 && mended.report.kept > once.report.kept);
}

#[test]
fn eyes_in_stone_are_left_out_and_told() {
    let stone = cuboid(Vec3::ZERO, Vec3::splat(4.0), 4);
    let half_in = views(vec![room([-2.0, 1.0, 1.0], [2.0, 3.0, 3.0])]);
    // with a near plane, whoever stands close to the stone looks through it
    let after = purged(&stone, &half_in, &PurgeParams { near_m: 0.0, ..quick() });
    let of_room = &after.report.rooms[0];
    assert!((of_room.in_stone - 0.5).abs() < 0.1 && !of_room.is_blind(), "{}", of_room.in_stone);
    // From x < 0 one side of six is seen; of its neighbours across an edge none, since all eyes that look see their backs.
    let lies_at = |t: &[u32; 3], x: f32| t.iter().all(|&i| stone.positions[i as usize].x == x);
    let side = |x: f32| stone.triangles.iter().zip(&after.keep).filter(|(t, keep)| **keep && lies_at(t, x)).count();
    assert_eq!((side(0.0), side(4.0)), (32, 0));
    let within = views(vec![room([1.0; 3], [3.0; 3])]);
    let after = purged(&stone, &within, &quick());
    assert!(after.keep.iter().all(|&keep| keep) && after.report.rooms[0].is_blind() && after.report.rooms[0].in_stone == 1.0);
}

#[test]
fn without_rooms_everything_stays() {
    let scene = ball(1.0, 12);
    let after = purged(&scene, &views(Vec::new()), &quick());
    assert!(after.keep.iter().all(|&keep| keep));
}

#[test]
fn any_number_of_threads_gives_the_same() {
    let scene = ground(30.0, 30).and(ball(1.0, 40).moved(Vec3::Y)).and(cuboid(
        Vec3::new(-3.0, 0.0, -3.0),
        Vec3::new(-2.0, 3.0, 2.0),
        12,
    ));
    let views = views(vec![room([2.0, 1.0, -1.0], [4.0, 2.0, 1.0]), room([-8.0, 1.0, -1.0], [-7.0, 2.0, 1.0])]);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| purged(&scene, &views, &PurgeParams { max_eyes: 64, ..quick() }))
    };
    let alone = with(1);
    assert_eq!(alone, with(2));
    assert_eq!(alone, with(5));
}

#[test]
fn hostile_meshes_are_lived_through() {
    for mesh in hostile::meshes() {
        let params = PurgeParams { max_eyes: 16, frames: 8, pixels: 100, max_checks: 2, ..quick() };
        let window = [Vec3::new(-0.5, 0.5, 0.5), Vec3::new(0.5, 0.5, 0.5), Vec3::new(-0.5, 1.5, 0.5)];
        for windows in [Vec::new(), vec![window], vec![[Vec3::ZERO; 3], [Vec3::NAN; 3]]] {
            let cell = ViewCell { windows, ..room([-0.5, 0.5, -0.5], [0.5, 1.5, 1.0]) };
            purged(&mesh.scene, &views(vec![cell]), &params);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn soups_never_panic_and_miss_little(seed in 0u64..1000, count in 1usize..300) {
        let mut random = Pcg32::new(seed, 7);
        let mut point = |size: f32| Vec3::from_array(core::array::from_fn(|_| random.range_f32(-size, size)));
        let mut scene = Scene::default();
        for t in 0..count as u32 {
            let middle = point(5.0);
            scene.positions.extend([point(1.0) + middle, point(1.0) + middle, point(1.0) + middle]);
            scene.triangles.push([3 * t, 3 * t + 1, 3 * t + 2]);
        }
        let params = PurgeParams { max_eyes: 32, frames: 40, pixels: 500, ..quick() };
        let after = purged(&scene, &views(vec![room([-1.0; 3], [1.0; 3])]), &params);
        prop_assert!(after.report.rooms[0].verified.wrong_share() < 1e-3);
    }
}
