//! Real photographs: the castle of Maupertuis, solved from its matches and EXIF alone, against OpenMVG's own cameras.

use crate::accuracy::{Accuracy, compare};
use heliodon_photo::camera::{Camera, Intrinsics};
use heliodon_photo::exif::PhotoFacts;
use heliodon_photo::formats::{ImportedCameras, openmvg};
use heliodon_photo::solve::bundle::Free;
use heliodon_photo::solve::{Focal, LensGroup, Mark, MarkResult, Params, Photo, Problem, Reference, solve};
use std::path::Path;

#[test]
fn the_castle_is_solved_from_matches_and_exif() {
    let folder = Path::new("../../../shared/data/photosets/kapture_maupertuis");
    if !folder.is_dir() {
        eprintln!("skipped: there is no {}", folder.display());
        return;
    }
    let theirs = openmvg::read(&folder.join("sfm_data.json")).unwrap();
    let facts = PhotoFacts::read(&folder.join("images/MaupertuisTest_01.jpg"));
    let focal = facts.focal_px([1600, 1200]).unwrap();
    // Their principal point is their own finding; it is taken over, as a laboratory's calibration would be.
    let truth = theirs.cameras[0].camera.intrinsics;
    let intrinsics = Intrinsics { centre_px: truth.centre_px, ..Intrinsics::pinhole(1600, 1200, focal) };
    let free = Free { radial: 3, ..Free::default() };
    let mut problem = Problem {
        lenses: vec![LensGroup { name: "ixus".to_owned(), intrinsics, focal: Focal::Guess(focal), free }],
        photos: theirs.cameras.iter().map(|c| Photo { name: c.name.clone(), lens: 0, pose: None }).collect(),
        ..Problem::default()
    };
    for (index, point) in theirs.points.iter().enumerate() {
        problem.points.push(Reference { name: format!("match-{index}"), known_m: None, ground: false });
        problem.marks.extend(point.seen.iter().map(|(photo, pixel)| Mark { photo: *photo, point: index, pixel: *pixel }));
    }
    // Theirs keeps every match; ours leaves out six in a hundred that lie off by many times the others' spread, unless told not to.
    let (focal_off, turn, place) = compared(&problem, &theirs, &Params { wrong_from: 20.0, ..Params::default() });
    assert!(focal_off < 0.001 && turn < 0.1 && place < 0.003);
    let (focal_off, turn, place) = compared(&problem, &theirs, &Params::default());
    assert!(focal_off < 0.02 && turn < 0.1 && place < 0.003);
}

/// The worst differences to their cameras: focal length, turn in degrees, place in parts of the longest baseline.
fn compared(problem: &Problem, theirs: &ImportedCameras, params: &Params) -> (f64, f64, f64) {
    let truth = theirs.cameras[0].camera.intrinsics;
    let start = std::time::Instant::now();
    let solution = solve(problem, params);
    let seconds = start.elapsed().as_secs_f64();
    assert_eq!(solution.solved_photos(), 4, "{:?}", solution.notes);
    let cameras = |all: &dyn Fn(usize) -> Camera| (0..4).map(all).collect::<Vec<_>>();
    let known = cameras(&|i| theirs.cameras[i].camera);
    let Accuracy { turn_deg: turn, turn_rms_deg, place, place_rms } =
        compare(&cameras(&|i| solution.camera(i).unwrap()), &known);
    let wrong = solution.marks.iter().filter(|m| matches!(m, MarkResult::Wrong(_))).count();
    let found = solution.lenses[0];
    println!(
        "{} marks, {wrong} wrong, sigma {:.2} px; focal {:.1} +- {:.1} px (theirs {:.1}), turn {turn:.4} deg at worst, \
         {turn_rms_deg:.4} rms, place {:.3} % of the baseline at worst, {:.3} rms, {seconds:.2} s",
        problem.marks.len(),
        solution.sigma_px,
        found.intrinsics.focal_px[0],
        found.sigmas[0],
        truth.focal_px[0],
        100.0 * place,
        100.0 * place_rms
    );
    ((found.intrinsics.focal_px[0] / truth.focal_px[0] - 1.0).abs(), turn, place)
}
