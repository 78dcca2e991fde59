//! Cameras from what a person would mark of the temple: half a pixel of noise, one mark in ten wrong.

use crate::render::Stage;
use crate::temple::{self, SIZE_M};
use glam::{DVec2, DVec3};
use heliodon_photo::camera::{Camera, Intrinsics};
use heliodon_photo::solve::bundle::Free;
use heliodon_photo::solve::random::Random;
use heliodon_photo::solve::{
    Direction, Distance, Focal, LensGroup, Mark, MarkResult, Params, Photo, PhotoResult, PointResult, Problem, Reference,
    Similarity, Solution, fit_similarity, solve,
};
use heliodon_rays::Ray;

/// Twelve photographs' marks, and what is true of them.
pub struct Marked {
    pub problem: Problem,
    pub cameras: Vec<Camera>,
    pub points: Vec<(String, DVec3)>,
    pub wrong: Vec<bool>,
    /// How far each mark is off, pixels, beside what is wrong with it.
    pub noise_px: Vec<f64>,
}

/// Corners, the ends of the roof, the rims of the columns that stand for others, stakes on the ground: one name for each thing that the shapes ask for.
fn is_marked(name: &str) -> bool {
    let is_of_last = ["nw-", "ne-", "south-2-", "north-2-"].iter().any(|column| name.starts_with(column));
    !is_of_last || name.ends_with("foot-0")
}

/// Photographs that are to show a point: fewer where columns hide it from most.
fn fewest(name: &str) -> usize {
    if ["c-", "south-", "north-"].iter().any(|start| name.starts_with(start)) { 3 } else { 4 }
}

/// Whether a camera sees a point of the temple.
fn sees(stage: &Stage, camera: &Camera, point: DVec3) -> Option<DVec2> {
    let pixel = camera.project(point).filter(|pixel| temple::is_inside(camera, *pixel))?;
    let way = point - camera.centre();
    let ray = Ray {
        origin: camera.centre().as_vec3(),
        direction: way.try_normalize()?.as_vec3(),
        t_min: 0.0,
        // a corner hides itself
        t_max: way.length() as f32 - 0.01,
    };
    let mut occluded = [0];
    stage.rays.occluded(&[ray], &mut occluded);
    (occluded[0] == 0).then_some(pixel)
}

/// Marks in twelve photographs of 12 megapixels.
pub fn marked(stage: &Stage, focal: Focal, seed: u64) -> Marked {
    let mut random = Random::new(seed);
    let cameras = temple::cameras(12, [4000, 3000]);
    let shown = |position: DVec3| cameras.iter().filter(|camera| sees(stage, camera, position).is_some()).count();
    // what few photographs show is not worth a mark: two of them, one wrong, tell nothing
    let points: Vec<(String, DVec3)> =
        temple::points().into_iter().filter(|(name, position)| is_marked(name) && shown(*position) >= fewest(name)).collect();
    let (mut marks, mut wrong, mut noise_px) = (Vec::new(), Vec::new(), Vec::new());
    for (photo, camera) in cameras.iter().enumerate() {
        for (point, (_, position)) in points.iter().enumerate() {
            let Some(pixel) = sees(stage, camera, *position) else { continue };
            let noise = DVec2::new(random.normal(), random.normal()) * 0.5;
            noise_px.push(noise.length());
            let mut pixel = pixel + noise;
            let is_wrong = random.unit() < 0.1;
            if is_wrong {
                let turn = std::f64::consts::TAU * random.unit();
                pixel += DVec2::new(libm::cos(turn), libm::sin(turn)) * (20.0 + 180.0 * random.unit());
            }
            marks.push(Mark { photo, point, pixel });
            wrong.push(is_wrong);
        }
    }
    let find = |name: &str| points.iter().position(|(other, _)| other == name).unwrap();
    let [a, b] = ["s1-sw", "s1-nw"].map(find);
    let problem = Problem {
        lenses: vec![LensGroup {
            name: "camera".to_owned(),
            intrinsics: Intrinsics::pinhole(4000, 3000, 1.0),
            focal,
            free: Free { radial: 1, ..Free::default() },
        }],
        photos: (0..12).map(|i| Photo { name: format!("{i}.png"), lens: 0, pose: None }).collect(),
        points: points
            .iter()
            .map(|(name, position)| Reference { name: name.clone(), known_m: None, ground: position.y == 0.0 })
            .collect(),
        marks,
        distances: vec![Distance { between: [a, b], metres: (points[a].1 - points[b].1).length() }],
        directions: vec![Direction { between: [a, b], world: DVec3::NEG_Z }],
        ..Problem::default()
    };
    Marked { problem, cameras, points, wrong, noise_px }
}

/// From the solution's frame to the temple's, by all points.
pub fn onto_truth(marked: &Marked, solution: &Solution) -> Similarity {
    fit_similarity(&pairs(marked, solution)).unwrap()
}

/// The way back.
pub fn onto_solution(marked: &Marked, solution: &Solution) -> Similarity {
    let back: Vec<(DVec3, DVec3)> = pairs(marked, solution).into_iter().map(|(found, truth)| (truth, found)).collect();
    fit_similarity(&back).unwrap()
}

fn pairs(marked: &Marked, solution: &Solution) -> Vec<(DVec3, DVec3)> {
    let pair = |(p, (_, truth)): (usize, &(String, DVec3))| Some((solution.position_m(p)?, *truth));
    marked.points.iter().enumerate().filter_map(pair).collect()
}

fn check(stage: &Stage, focal: Focal, seed: u64) -> [f64; 4] {
    let marked = marked(stage, focal, seed);
    let solution = solve(&marked.problem, &Params::default());
    assert_eq!(solution.solved_photos(), 12, "{:?}", solution.notes);
    let found: Vec<bool> = solution.marks.iter().map(|m| matches!(m, MarkResult::Wrong(_))).collect();
    let missed = (0..found.len()).filter(|i| marked.wrong[*i] && matches!(solution.marks[*i], MarkResult::Used(_))).count();
    let blamed = (0..found.len()).filter(|i| !marked.wrong[*i] && found[*i]).count();
    for i in (0..found.len()).filter(|i| !marked.wrong[*i] && found[*i]) {
        println!("{:?} was only {:.2} px off", marked.problem.marks[i], marked.noise_px[i]);
    }
    let unsolved = solution.points.iter().filter(|point| matches!(point, PointResult::Unsolved(_))).count();
    let similarity = onto_truth(&marked, &solution);
    let truth = &marked.cameras[0].intrinsics;
    let focal = (solution.lenses[0].intrinsics.focal_px[0] / truth.focal_px[0] - 1.0).abs();
    let (mut turn, mut squares, mut place, mut expected) = (0.0f64, 0.0, 0.0f64, 0.0f64);
    for (photo, truth) in marked.cameras.iter().enumerate() {
        let pose = similarity.pose(&solution.camera(photo).unwrap().pose);
        let between = pose.rotation * truth.pose.rotation.conjugate();
        let off = 2.0 * DVec3::new(between.x, between.y, between.z).length().min(1.0).asin().to_degrees();
        (turn, squares) = (turn.max(off), squares + off * off);
        if let PhotoResult::Solved(solved) = &solution.photos[photo] {
            expected = expected.max(solved.rotation_sigma_rad.unwrap().to_degrees());
        }
        place = place.max((pose.centre() - truth.centre()).length() / SIZE_M);
    }
    let offs = (0..marked.points.len())
        .filter_map(|p| Some((similarity.point(solution.position_m(p)?) - marked.points[p].1).length() / SIZE_M));
    let point = offs.fold(0.0, f64::max);
    let (count, sum) = solution.marks.iter().fold((0, 0.0), |(n, s), m| match m {
        MarkResult::Used(off) => (n + 1, s + off.length_squared()),
        _ => (n, s),
    });
    let rms = (sum / (2 * count) as f64).sqrt();
    println!(
        "seed {seed}: {} points, {} marks, {} wrong, missed {missed}, blamed {blamed}, unsolved {unsolved}; focal {:.3} %, turn rms {:.4} worst {turn:.4} (sigma at most {expected:.4}) deg, place {:.3} %, points {:.3} %, rms {rms:.3} px, sigma {:.3} px",
        marked.points.len(),
        marked.wrong.len(),
        marked.wrong.iter().filter(|w| **w).count(),
        100.0 * focal,
        (squares / 12.0).sqrt(),
        100.0 * place,
        100.0 * point,
        solution.sigma_px,
    );
    assert_eq!(missed, 0);
    // residuals are smaller than the noise by what the solution follows of it; sigma has that taken out
    assert!(rms < 0.5 && (solution.sigma_px - 0.5).abs() < 0.06);
    [focal, turn, place, point]
}

#[test]
fn cameras_of_the_temple_are_found_among_wrong_marks() {
    let stage = Stage::new(&temple::truth());
    for seed in 1..=6 {
        let focal = if seed % 2 == 0 { Focal::Free } else { Focal::Guess(3000.0) };
        let [focal, turn, place, point] = check(&stage, focal, seed);
        assert!(focal < 0.003 && turn < 0.05 && place < 0.002 && point < 0.002);
    }
}
