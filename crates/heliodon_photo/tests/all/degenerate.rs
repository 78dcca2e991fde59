//! What cannot be solved is said, what can is kept.

use glam::{DVec2, DVec3};
use heliodon_photo::camera::{Camera, Intrinsics, Pose};
use heliodon_photo::solve::bundle::Free;
use heliodon_photo::solve::random::Random;
use heliodon_photo::solve::{
    Direction, Distance, Edge, Focal, LensGroup, Mark, Params, Photo, PhotoResult, PointResult, Problem, Reference, Solution,
    solve,
};

/// Photographs that look from places at the origin, points that all of them see, marks with 0.3 px of noise.
fn scene(eyes: &[DVec3], points: &[DVec3], focal: Focal) -> (Problem, Vec<Camera>) {
    let mut random = Random::new(77);
    let lens = Intrinsics::pinhole(2000, 1500, 1700.0);
    let cameras: Vec<Camera> =
        eyes.iter().map(|e| Camera { intrinsics: lens, pose: Pose::look_at(*e, DVec3::ZERO).unwrap() }).collect();
    let mut problem = Problem {
        lenses: vec![LensGroup {
            name: "lens".to_owned(),
            intrinsics: Intrinsics::pinhole(2000, 1500, 1.0),
            focal,
            free: Free::default(),
        }],
        photos: (0..eyes.len()).map(|i| Photo { name: format!("{i}.jpg"), lens: 0, pose: None }).collect(),
        points: (0..points.len()).map(|i| Reference { name: format!("p{i}"), known_m: None, ground: false }).collect(),
        ..Problem::default()
    };
    for (photo, camera) in cameras.iter().enumerate() {
        for (point, position) in points.iter().enumerate() {
            let noise = DVec2::new(random.normal(), random.normal()) * 0.3;
            problem.marks.push(Mark { photo, point, pixel: camera.project(*position).unwrap() + noise });
        }
    }
    (problem, cameras)
}

fn cloud(count: usize, flat: bool) -> Vec<DVec3> {
    let mut random = Random::new(3);
    (0..count).map(|_| DVec3::new(random.normal(), random.normal(), if flat { 0.0 } else { random.normal() }) * 1.5).collect()
}

fn ring(count: usize) -> Vec<DVec3> {
    (0..count).map(|i| DVec3::new(10.0 * (i as f64 * 0.35).sin(), 2.0, 10.0 * (i as f64 * 0.35).cos())).collect()
}

fn reason(solution: &Solution, photo: usize) -> &str {
    match &solution.photos[photo] {
        PhotoResult::Unsolved(why) => why,
        PhotoResult::Solved(solved) => panic!("solved: {solved:?}"),
    }
}

#[test]
fn nothing_at_all_is_no_panic() {
    let solution = solve(&Problem::default(), &Params::default());
    assert_eq!((solution.photos.len(), solution.points.len()), (0, 0));
    let (mut problem, _) = scene(&ring(2), &cloud(8, false), Focal::Known(1700.0));
    problem.marks.clear();
    assert!(reason(&solve(&problem, &Params::default()), 0).contains("nothing is marked"));
}

#[test]
fn two_marks_are_too_few() {
    let (problem, _) = scene(&ring(3), &cloud(2, false), Focal::Known(1700.0));
    let solution = solve(&problem, &Params::default());
    assert!(reason(&solution, 0).contains("only 2 points"), "{}", reason(&solution, 0));
    assert!(solution.notes.iter().any(|n| n.contains("no two photographs share enough points")), "{:?}", solution.notes);
}

#[test]
fn a_plane_does_not_tell_an_unknown_focal_length_but_a_known_one_suffices() {
    let (problem, _) = scene(&ring(4), &cloud(30, true), Focal::Free);
    let solution = solve(&problem, &Params::default());
    assert!(reason(&solution, 0).contains("lie in one plane"), "{}", reason(&solution, 0));
    let (problem, _) = scene(&ring(4), &cloud(30, true), Focal::Known(1700.0));
    let solution = solve(&problem, &Params::default());
    assert_eq!(solution.solved_photos(), 4, "{:?}", solution.notes);
    assert!(solution.sigma_px < 0.4);
}

#[test]
fn photographs_from_one_place_tell_no_depth() {
    let (mut problem, cameras) = scene(&ring(1), &cloud(30, false), Focal::Known(1700.0));
    let points = cloud(30, false);
    // A second photograph from the same place, turned.
    let turn = glam::DQuat::from_rotation_y(0.1);
    let pose = Pose::from_centre(turn * cameras[0].pose.rotation, cameras[0].centre());
    let other = Camera { pose, ..cameras[0] };
    problem.photos.push(Photo { name: "turned.jpg".to_owned(), lens: 0, pose: None });
    problem.marks.extend(points.iter().enumerate().map(|(point, p)| Mark {
        photo: 1,
        point,
        pixel: other.project(*p).unwrap(),
    }));
    let solution = solve(&problem, &Params::default());
    assert!(reason(&solution, 0).contains("from one place"), "{}", reason(&solution, 0));
}

#[test]
fn a_photograph_of_another_scene_is_told_and_the_others_are_kept() {
    let (mut problem, _) = scene(&ring(5), &cloud(25, false), Focal::Known(1700.0));
    let mut random = Random::new(9);
    for mark in problem.marks.iter_mut().filter(|m| m.photo == 3) {
        mark.pixel = DVec2::new(2000.0 * random.unit(), 1500.0 * random.unit());
    }
    // And one that shares two points only.
    problem.marks.retain(|m| m.photo != 4 || m.point < 2);
    let solution = solve(&problem, &Params::default());
    assert_eq!(solution.solved_photos(), 3, "{:?}", solution.photos);
    assert!(reason(&solution, 3).contains("too few agree"), "{}", reason(&solution, 3));
    assert!(reason(&solution, 4).contains("shares 2 solved points"), "{}", reason(&solution, 4));
    assert!(solution.points.iter().all(|p| matches!(p, PointResult::Solved(_))));
}

#[test]
fn groups_that_do_not_hang_together_are_told() {
    let (mut problem, _) = scene(&ring(6), &cloud(40, false), Focal::Known(1700.0));
    problem.marks.retain(|m| (m.photo < 4) == (m.point < 25));
    let solution = solve(&problem, &Params::default());
    assert_eq!(solution.solved_photos(), 4);
    assert!(reason(&solution, 5).contains("other unsolved photographs"), "{}", reason(&solution, 5));
}

#[test]
fn mirrored_coordinates_are_told() {
    let points = cloud(20, false);
    let (mut problem, _) = scene(&ring(4), &points, Focal::Known(1700.0));
    for (point, at) in problem.points.iter_mut().zip(&points).take(5) {
        point.known_m = Some(*at * DVec3::new(1.0, 1.0, -1.0));
    }
    let solution = solve(&problem, &Params::default());
    assert!(solution.notes.iter().any(|n| n.contains("mirror")), "{:?}", solution.notes);
    for (point, at) in problem.points.iter_mut().zip(&points) {
        point.known_m = point.known_m.map(|_| *at);
    }
    let solution = solve(&problem, &Params::default());
    assert!(!solution.notes.iter().any(|n| n.contains("mirror")));
    assert!(solution.position_m(12).unwrap().distance(points[12]) < 0.01);
}

#[test]
fn a_measured_corner_that_no_photograph_shows_is_there() {
    let (mut problem, _) = scene(&ring(3), &cloud(12, false), Focal::Known(1700.0));
    let behind = DVec3::new(4.0, 5.0, -6.0);
    problem.points.push(Reference { name: "behind".to_owned(), known_m: Some(behind), ground: false });
    problem.points.push(Reference { name: "nowhere".to_owned(), known_m: None, ground: false });
    let solution = solve(&problem, &Params::default());
    match &solution.points[12..] {
        [PointResult::Solved(solved), PointResult::Unsolved(why)] => {
            assert_eq!((solved.position_m, solved.marks), (behind, 0));
            assert!(why.contains("nowhere"), "{why}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn marks_that_are_not_numbers_or_come_twice_are_passed_over() {
    let (mut problem, _) = scene(&ring(4), &cloud(20, false), Focal::Known(1700.0));
    problem.marks[5].pixel.x = f64::NAN;
    let twice = problem.marks[6];
    problem.marks.push(Mark { pixel: DVec2::new(3.0, 4.0), ..twice });
    problem.marks.push(Mark { photo: 99, ..twice });
    problem.distances.push(Distance { between: [0, 99], metres: 1.0 });
    let solution = solve(&problem, &Params::default());
    assert_eq!(solution.solved_photos(), 4);
    assert!(solution.notes.iter().any(|n| n.starts_with("3 of 82 marks")), "{:?}", solution.notes);
}

#[test]
fn poses_that_are_given_are_kept() {
    let points = cloud(20, false);
    let (mut problem, cameras) = scene(&ring(4), &points, Focal::Known(1700.0));
    for (photo, camera) in problem.photos.iter_mut().zip(&cameras).take(2) {
        photo.pose = Some(camera.pose);
    }
    let solution = solve(&problem, &Params::default());
    assert_eq!(solution.camera(0).unwrap(), cameras[0]);
    assert!((solution.camera(3).unwrap().centre() - cameras[3].centre()).length() < 0.05);
    assert!(solution.position_m(4).unwrap().distance(points[4]) < 0.02);
}

fn edges(camera: &Camera, photo: usize) -> Vec<Edge> {
    let mut all = Vec::new();
    for axis in 0..3 {
        for corner in 0..4 {
            let mut ends = [DVec3::splat(-1.5); 2];
            for end in &mut ends {
                end[(axis + 1) % 3] *= if corner & 1 == 0 { 1.0 } else { -1.0 };
                end[(axis + 2) % 3] *= if corner & 2 == 0 { 1.0 } else { -1.0 };
            }
            ends[1][axis] = 1.5;
            all.push(Edge { photo, axis, ends: ends.map(|e| camera.project(e).unwrap()) });
        }
    }
    all
}

#[test]
fn one_photograph_is_solved_by_its_edges_and_two_points() {
    let points = [DVec3::new(1.0, 0.0, 1.0), DVec3::new(1.0, 2.0, 1.0)];
    let (mut problem, cameras) = scene(&[DVec3::new(6.0, 3.0, 9.0)], &points, Focal::Free);
    problem.edges = edges(&cameras[0], 0);
    let solution = solve(&problem, &Params::default());
    assert!(solution.notes.iter().any(|n| n.contains("but not its place")), "{:?}", solution.notes);
    problem.points[0].known_m = Some(points[0]);
    problem.distances = vec![Distance { between: [0, 1], metres: 2.0 }];
    problem.directions = vec![Direction { between: [0, 1], world: DVec3::Y }];
    let solution = solve(&problem, &Params::default());
    let found = solution.camera(0).unwrap_or_else(|| panic!("{:?}", solution.notes));
    assert!((found.intrinsics.focal_px[0] - 1700.0).abs() < 5.0, "{found:?}");
    assert!((found.centre() - cameras[0].centre()).length() < 0.1, "{}", found.centre());
    assert!(solution.alignment.scale_from.is_some());
}

#[test]
fn edges_level_and_turn_what_marks_solve() {
    let points = cloud(20, false);
    let (mut problem, cameras) = scene(&ring(4), &points, Focal::Free);
    problem.edges = (0..3).flat_map(|photo| edges(&cameras[photo], photo)).collect();
    // One is drawn along the wrong axis.
    problem.edges[4].axis = 2;
    problem.distances = vec![Distance { between: [0, 1], metres: points[0].distance(points[1]) }];
    let solution = solve(&problem, &Params::default());
    assert_eq!(solution.solved_photos(), 4, "{:?}", solution.notes);
    assert!(solution.notes.iter().any(|n| n.contains("an edge along z in 0.jpg")), "{:?}", solution.notes);
    for (photo, camera) in cameras.iter().enumerate() {
        let turn = solution.camera(photo).unwrap().pose.rotation * camera.pose.rotation.conjugate();
        assert!(turn.w.abs() > (0.5f64 * 0.1f64.to_radians()).cos(), "{photo}: {turn}");
    }
    assert_eq!(solution.alignment.north_from.as_deref(), Some("parallel edges"));
    let between = solution.position_m(5).unwrap() - solution.position_m(6).unwrap();
    assert!((between - (points[5] - points[6])).length() < 0.02);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let (mut problem, cameras) = scene(&ring(5), &cloud(30, false), Focal::Free);
    problem.edges = edges(&cameras[1], 1);
    problem.marks[17].pixel.x += 60.0;
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        format!("{:?}", pool.install(|| solve(&problem, &Params::default())))
    };
    let one = run(1);
    assert!(one.contains("Wrong"));
    assert_eq!(one, run(3));
}

#[test]
fn nonsense_is_no_panic_and_no_endless_work() {
    let mut random = Random::new(1);
    for (width, scale) in [(2000, 1e300), (2000, 1e-300), (0, 1000.0), (2000, 2000.0), (u32::MAX, 1e9)] {
        for focal in [Focal::Free, Focal::Known(f64::NAN), Focal::Guess(-5.0), Focal::Known(1e-12), Focal::Known(1700.0)] {
            let (mut problem, _) = scene(&ring(3), &cloud(12, false), focal);
            problem.lenses[0].intrinsics.width = width;
            problem.lenses[0].free = Free { radial: 3, centre: true, tangential: true, ..Free::default() };
            for mark in &mut problem.marks {
                mark.pixel = DVec2::new(random.unit(), random.unit()) * scale;
            }
            problem.edges =
                (0..6).map(|i| Edge { photo: i % 3, axis: i % 2, ends: [DVec2::splat(scale), DVec2::ZERO] }).collect();
            let solution = solve(&problem, &Params { rounds: 50, ..Params::default() });
            assert_eq!(solution.marks.len(), problem.marks.len());
            for result in &solution.points {
                if let PointResult::Solved(point) = result {
                    assert!(point.position_m.is_finite(), "{point:?}");
                }
            }
        }
    }
}

#[test]
fn a_wrong_exif_does_not_stop_the_solution() {
    for guess in [700.0, 1300.0, 3400.0] {
        let (problem, _) = scene(&ring(5), &cloud(30, false), Focal::Guess(guess));
        let solution = solve(&problem, &Params::default());
        assert_eq!(solution.solved_photos(), 5, "{guess}: {:?}", solution.notes);
        let focal = solution.lenses[0].intrinsics.focal_px[0];
        assert!((focal / 1700.0 - 1.0).abs() < 0.01, "{guess}: {focal}");
    }
}
