//! Twelve simulated photographs of a temple: marks with noise, one in ten wrong.

use glam::{DVec2, DVec3};
use heliodon_photo::camera::{Camera, Intrinsics, Pose};
use heliodon_photo::solve::bundle::Free;
use heliodon_photo::solve::random::Random;
use heliodon_photo::solve::{
    Direction, Distance, Focal, LensGroup, Mark, MarkResult, Params, Photo, PhotoResult, PointResult, Problem, Reference,
    Solution, fit_similarity, solve,
};

struct Temple {
    problem: Problem,
    cameras: Vec<Camera>,
    points: Vec<DVec3>,
    wrong: Vec<bool>,
}

const SIZE_M: f64 = 30.0;

/// Corners of steps, columns and gables of a temple 30 m long; a camera sees what lies on the two sides turned to it.
fn temple(noise_px: f64, wrong_share: f64, focal: Focal, seed: u64) -> Temple {
    let mut random = Random::new(seed);
    let (half_x, half_z) = (7.0, 15.0);
    // Every point with what it can be seen from: corners from two sides, ridges from all.
    let mut points: Vec<(String, DVec3, Vec<DVec3>)> = Vec::new();
    for (side, normal, along, depth, reach, count) in [
        (0, DVec3::X, DVec3::Z, half_x, half_z, 8),
        (1, DVec3::NEG_X, DVec3::Z, half_x, half_z, 8),
        (2, DVec3::Z, DVec3::X, half_z, half_x, 4),
        (3, DVec3::NEG_Z, DVec3::X, half_z, half_x, 4),
    ] {
        for i in 0..count {
            let corner = i == 0 || i == count - 1;
            if corner && side >= 2 {
                continue;
            }
            let s = reach * (2.0 * i as f64 / (count - 1) as f64 - 1.0);
            let normals = if corner { vec![normal, along * s.signum()] } else { vec![normal] };
            let at = normal * depth + along * s;
            points.push((format!("side-{side}-column-{i}-foot"), at, normals.clone()));
            points.push((format!("side-{side}-column-{i}-top"), at - normal * 0.4 + DVec3::Y * 8.0, normals.clone()));
            points.push((format!("side-{side}-column-{i}-joint"), at - normal * 0.2 + DVec3::Y * 3.0, normals.clone()));
            points.push((format!("side-{side}-eave-{i}"), at + normal * 0.3 + DVec3::Y * 10.5, normals));
        }
        if side >= 2 {
            points.push((format!("side-{side}-gable"), normal * depth + DVec3::Y * 13.0, vec![normal, along, -along]));
        }
    }
    for i in 0..6 {
        let at = DVec3::new(0.0, 13.0, half_z * (i as f64 / 2.5 - 1.0) * 0.9);
        points.push((format!("ridge-{i}"), at, vec![DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z]));
    }
    let lens = Intrinsics { radial: [-0.08, 0.0, 0.0], ..Intrinsics::pinhole(4000, 3000, 2800.0) };
    let mut cameras = Vec::new();
    let (mut marks, mut wrong) = (Vec::new(), Vec::new());
    for photo in 0..12 {
        let angle = std::f64::consts::TAU * (photo as f64 + 0.3) / 12.0;
        let distance = 30.0 + 6.0 * random.unit();
        let eye = DVec3::new(distance * angle.sin(), 1.7 + 9.0 * random.unit(), distance * angle.cos());
        let target = DVec3::new(random.unit() * 2.0, 4.5, random.unit() * 2.0);
        let camera = Camera { intrinsics: lens, pose: Pose::look_at(eye, target).unwrap() };
        for (index, (_, position, normals)) in points.iter().enumerate() {
            let to_eye = (eye - *position).normalize_or_zero();
            if normals.iter().all(|n| n.dot(to_eye) < 0.05) {
                continue;
            }
            let Some(pixel) = camera.project(*position) else { continue };
            if pixel.x < 0.0 || pixel.y < 0.0 || pixel.x > 4000.0 || pixel.y > 3000.0 {
                continue;
            }
            let mut pixel = pixel + DVec2::new(random.normal(), random.normal()) * noise_px;
            let is_wrong = random.unit() < wrong_share;
            if is_wrong {
                let turn = std::f64::consts::TAU * random.unit();
                pixel += DVec2::new(turn.cos(), turn.sin()) * (20.0 + 180.0 * random.unit());
            }
            marks.push(Mark { photo, point: index, pixel });
            wrong.push(is_wrong);
        }
        cameras.push(camera);
    }
    let find = |name: &str| points.iter().position(|p| p.0 == name).unwrap();
    let [a, b] = [find("side-0-column-0-foot"), find("side-0-column-7-foot")];
    let group = LensGroup {
        name: "camera".to_owned(),
        intrinsics: Intrinsics::pinhole(4000, 3000, 1.0),
        focal,
        free: Free { radial: 1, ..Free::default() },
    };
    let problem = Problem {
        lenses: vec![group],
        photos: (0..12).map(|i| Photo { name: format!("photo-{i:02}.jpg"), lens: 0, pose: None }).collect(),
        points: (points.iter())
            .map(|p| Reference { name: p.0.clone(), known_m: None, ground: p.0.ends_with("foot") })
            .collect(),
        marks,
        distances: vec![Distance { between: [a, b], metres: (points[a].1 - points[b].1).length() }],
        // from the -Z end to the +Z end: south
        directions: vec![Direction { between: [a, b], world: DVec3::Z }],
        ..Problem::default()
    };
    Temple { problem, cameras, points: points.into_iter().map(|p| p.1).collect(), wrong }
}

/// What is left when the solution is laid upon the truth by all points.
struct Errors {
    /// The root mean square and the worst turn over all photographs.
    turn_deg: [f64; 2],
    /// The worst place of a camera and of a point, in parts of the scene.
    camera: f64,
    point: f64,
}

fn errors(temple: &Temple, solution: &Solution) -> Errors {
    let pairs: Vec<(DVec3, DVec3)> =
        (0..temple.points.len()).filter_map(|p| Some((solution.position_m(p)?, temple.points[p]))).collect();
    let similarity = fit_similarity(&pairs).unwrap();
    let (mut sum, mut turn, mut camera) = (0.0, 0.0f64, 0.0f64);
    for (photo, truth) in temple.cameras.iter().enumerate() {
        let pose = similarity.pose(&solution.camera(photo).unwrap().pose);
        let between = pose.rotation * truth.pose.rotation.conjugate();
        let off = 2.0 * DVec3::new(between.x, between.y, between.z).length().min(1.0).asin().to_degrees();
        turn = turn.max(off);
        sum += off * off;
        camera = camera.max((pose.centre() - truth.centre()).length() / SIZE_M);
    }
    let point = pairs.iter().map(|(m, w)| (similarity.point(*m) - *w).length() / SIZE_M).fold(0.0, f64::max);
    Errors { turn_deg: [(sum / temple.cameras.len() as f64).sqrt(), turn], camera, point }
}

fn check(temple: &Temple, label: &str) {
    let start = std::time::Instant::now();
    let solution = solve(&temple.problem, &Params::default());
    let seconds = start.elapsed().as_secs_f64();
    assert_eq!(solution.solved_photos(), 12, "{:?}", solution.notes);
    let found: Vec<bool> = solution.marks.iter().map(|m| matches!(m, MarkResult::Wrong(_))).collect();
    let missed = (0..found.len()).filter(|i| temple.wrong[*i] && matches!(solution.marks[*i], MarkResult::Used(_))).count();
    let blamed = (0..found.len()).filter(|i| !temple.wrong[*i] && found[*i]).count();
    let is_unsolved = |p: &usize| matches!(solution.points[*p], PointResult::Unsolved(_));
    let unsolved: Vec<usize> = (0..temple.points.len()).filter(is_unsolved).collect();
    let focal = solution.lenses[0].intrinsics.focal_px[0] / 2800.0 - 1.0;
    let errors = errors(temple, &solution);
    let (count, sum) = solution.marks.iter().fold((0, 0.0), |(n, s), m| match m {
        MarkResult::Used(off) => (n + 1, s + off.length_squared()),
        _ => (n, s),
    });
    let rms = (sum / (2 * count) as f64).sqrt();
    println!(
        "{label}: {} points, {} marks, {} wrong, missed {missed}, blamed {blamed}, points unsolved {}; focal {:.3} %, turn rms {:.4} \
         worst {:.4} deg, place {:.3} %, points {:.3} %, rms {rms:.3} px a coordinate, sigma {:.3} px, {seconds:.2} s",
        temple.points.len(),
        temple.wrong.len(),
        temple.wrong.iter().filter(|w| **w).count(),
        unsolved.len(),
        100.0 * focal,
        errors.turn_deg[0],
        errors.turn_deg[1],
        100.0 * errors.camera,
        100.0 * errors.point,
        solution.sigma_px,
    );
    assert_eq!((missed, blamed), (0, 0));
    // Of a point whose marks are half wrong nothing can be told, and that is said.
    for point in unsolved {
        let marks = (0..found.len()).filter(|m| temple.problem.marks[*m].point == point);
        let (all, wrong) = marks.fold((0, 0), |(n, w), m| (n + 1, w + usize::from(temple.wrong[m])));
        assert!(2 * wrong >= all - 1, "{:?}: {wrong} of {all} marks are wrong", solution.points[point]);
    }
    assert!(focal.abs() < 0.003 && errors.turn_deg[0] < 0.05 && errors.turn_deg[1] < 0.1);
    assert!(errors.camera < 0.002 && errors.point < 0.002);
    // Residuals are smaller than the noise by what the solution follows of it; sigma has that taken out.
    assert!(rms < 0.5 && (solution.sigma_px - 0.5).abs() < 0.06);
}

#[test]
fn wrong_marks_are_found_and_cameras_are_right() {
    for seed in 1..=4 {
        let focal = if seed % 2 == 0 { Focal::Free } else { Focal::Guess(2700.0) };
        check(&temple(0.5, 0.1, focal, seed), &format!("seed {seed}, {focal:?}"));
    }
}

#[test]
fn scale_north_and_level_are_the_worlds() {
    let temple = temple(0.5, 0.0, Focal::Guess(2700.0), 21);
    let solution = solve(&temple.problem, &Params::default());
    let ends = temple.problem.distances[0].between.map(|p| solution.position_m(p).unwrap());
    assert!(((ends[1] - ends[0]) - DVec3::Z * temple.problem.distances[0].metres).length() < 0.02);
    let find = |name: &str| temple.problem.points.iter().position(|p| p.name == name).unwrap();
    let [foot, top] = ["side-1-column-3-foot", "side-1-column-3-top"].map(|n| solution.position_m(find(n)).unwrap());
    assert!((top.y - foot.y - 8.0).abs() < 0.02 && foot.y.abs() < 0.02, "{foot} {top}");
    for check in &solution.alignment.checks {
        assert!(check.off.abs() < 0.05, "{check:?}");
    }
    assert_eq!(solution.alignment.scale_from.as_deref(), Some("one distance"));
}

#[test]
fn uncertainties_say_how_far_solutions_scatter() {
    let still = temple(0.0, 0.0, Focal::Guess(2700.0), 3);
    let (mut turns, mut places, mut counted) = (0.0, 0.0, 0.0);
    for seed in 0..12 {
        let mut noisy = still.problem.clone();
        let mut random = Random::new(1000 + seed);
        for mark in &mut noisy.marks {
            mark.pixel += DVec2::new(random.normal(), random.normal()) * 0.5;
        }
        let solution = solve(&noisy, &Params::default());
        // The origin is the middle of the points that are solved.
        let solved: Vec<DVec3> =
            (0..still.points.len()).filter(|p| solution.position_m(*p).is_some()).map(|p| still.points[p]).collect();
        let shift = (solved.iter().sum::<DVec3>() / solved.len() as f64).with_y(0.0);
        for (photo, result) in solution.photos.iter().enumerate() {
            let PhotoResult::Solved(solved) = result else { panic!("{result:?}") };
            let truth = still.cameras[photo];
            let between = solved.camera.pose.rotation * truth.pose.rotation.conjugate();
            let turn = 2.0 * DVec3::new(between.x, between.y, between.z).length() / solved.rotation_sigma_rad.unwrap();
            let off = solved.camera.centre() + shift - truth.centre();
            let place = off.dot(solved.centre_covariance_m2.unwrap().inverse() * off);
            turns += turn * turn;
            places += place;
            counted += 1.0;
        }
    }
    // Three degrees of freedom; a turn is told by its worst axis, so it lies between one and three.
    let (turn, place) = (turns / counted, places / counted);
    println!("squared errors over variances: turns {turn:.2}, places {place:.2}");
    assert!((2.4..3.6).contains(&place) && (1.0..3.0).contains(&turn));
}

/// A quarter of the marks is three times as coarse as the others: those that are left out for it are no slips, and what to set is said.
#[test]
fn marks_of_worn_corners_are_told_from_slips() {
    let mut worn = temple(0.5, 0.0, Focal::Guess(2700.0), 5);
    let mut random = Random::new(9);
    for mark in worn.problem.marks.iter_mut().step_by(4) {
        mark.pixel += DVec2::new(random.normal(), random.normal()) * 2.0;
    }
    let told = |notes: &[String]| notes.iter().find(|n| n.contains("mark_sigma_px")).cloned();
    let solution = solve(&worn.problem, &Params::default());
    let note = told(&solution.notes).expect("a note");
    let set: f64 = note.split("mark_sigma_px = ").nth(1).unwrap().split('`').next().unwrap().parse().unwrap();
    let wrong = |s: &Solution| s.marks.iter().filter(|m| matches!(m, MarkResult::Wrong(_))).count();
    let again = solve(&worn.problem, &Params { mark_sigma_px: set, least_sigma_px: set, ..Params::default() });
    println!("{note}; then {} of {} wrong", wrong(&again), wrong(&solution));
    assert!(4 * wrong(&again) < wrong(&solution) && told(&again.notes).is_none());
    // Slips are no reason for it.
    let slips = solve(&temple(0.5, 0.1, Focal::Guess(2700.0), 5).problem, &Params::default());
    assert_eq!(told(&slips.notes), None);
}
