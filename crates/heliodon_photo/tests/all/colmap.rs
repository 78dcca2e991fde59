//! Automatic matches by the real COLMAP, against cameras that are known. Without the program or the photographs the tests say so and are skipped.

use crate::accuracy::compare;
use glam::{DMat3, DVec2, DVec3};
use heliodon_photo::camera::{Camera, Intrinsics};
use heliodon_photo::formats::{ImportedCameras, openmvg, projection};
use heliodon_photo::matching::{Matched, Request, run};
use heliodon_photo::project::{PhotoEntry, Project};
use heliodon_photo::solve::bundle::{self, Free, Lens, Loss, Network, Observation, Point, View};
use heliodon_photo::solve::{Focal, Problem};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

const CASTLE: &str = "kapture_maupertuis";
const TEMPLE: &str = "middlebury_templeSparseRing";

/// A shared set of photographs, where it is there and COLMAP is.
fn photoset(name: &str) -> Option<PathBuf> {
    let folder = Path::new("../../../shared/data/photosets").join(name);
    if !folder.is_dir() {
        eprintln!("skipped: there is no {}", folder.display());
        return None;
    }
    if std::process::Command::new("colmap").arg("-h").env("QT_QPA_PLATFORM", "offscreen").output().is_err() {
        eprintln!("skipped: there is no program colmap");
        return None;
    }
    Some(folder)
}

/// A project of photographs in a folder of its own.
fn project(folder: &Path, files: &[PathBuf]) -> Project {
    let mut project = Project::parse("", folder.join("photos.toml")).unwrap();
    for file in files {
        let name = file.file_name().unwrap().to_string_lossy().into_owned();
        let to = folder.join(&name);
        if !to.exists() {
            std::fs::copy(file, to).unwrap();
        }
        project.file.photo.push(PhotoEntry { file: name, ..PhotoEntry::default() });
    }
    project
}

fn photographs(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut all: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    all.retain(|path| path.extension().is_some_and(|e| e == ending));
    all.sort();
    all
}

fn matched(project: &Project) -> Matched {
    matched_by(project, &project.load_for_matching().unwrap().problem)
}

fn matched_by(project: &Project, problem: &Problem) -> Matched {
    let files: Vec<String> = project.file.photo.iter().map(|p| p.file.clone()).collect();
    let request = Request { program: OsStr::new("colmap"), folder: project.folder(), files: &files, problem };
    let start = std::time::Instant::now();
    let matched = run(&request, &mut |stage| eprintln!("  {stage}")).unwrap();
    let lens = matched.solution.lenses[0];
    println!(
        "{} of {} photographs, {} points, {:.2} px, {:.0} s; focal length {:.1} +- {:.1} px, centre {:.1} {:.1} +- {:.1} px",
        matched.cameras.cameras.len(),
        files.len(),
        matched.cameras.points.len(),
        matched.solution.sigma_px,
        start.elapsed().as_secs_f64(),
        lens.intrinsics.focal_px[0],
        lens.sigmas[0],
        lens.intrinsics.centre_px[0],
        lens.intrinsics.centre_px[1],
        lens.sigmas[1]
    );
    for left in &matched.left_out {
        println!("  {}: {}", left.photo, left.why);
    }
    for note in &matched.notes {
        println!("  note: {note}");
    }
    matched
}

/// Turn in degrees and place in parts of the baseline, the worst of all photographs.
fn off(matched: &Matched, known: &ImportedCameras) -> (f64, f64) {
    let found: Vec<Camera> = matched.cameras.cameras.iter().map(|camera| camera.camera).collect();
    let accuracy = compare(&found, &in_order(matched, known));
    println!(
        "  turn {:.4} deg at worst, {:.4} rms; place {:.3} % of the baseline at worst, {:.3} rms",
        accuracy.turn_deg,
        accuracy.turn_rms_deg,
        100.0 * accuracy.place,
        100.0 * accuracy.place_rms
    );
    (accuracy.turn_deg, accuracy.place)
}

/// The known cameras in the order of those that were matched.
fn in_order(matched: &Matched, known: &ImportedCameras) -> Vec<Camera> {
    matched.cameras.cameras.iter().map(|c| known.cameras.iter().find(|k| k.name == c.name).unwrap().camera).collect()
}

/// Points of three marks and more, placed from cameras and adjusted with them: all of these held, or moved with what is free of their lens.
/// Returns the cameras and the marks' root mean squared distance to their points' pictures along an axis, in pixels.
fn adjusted(matched: &Matched, cameras: &[Camera], free: Option<Free>) -> (Vec<Camera>, f64) {
    let view = |(index, camera): (usize, &Camera)| View { pose: camera.pose, lens: 0, fixed: free.is_none() || index == 0 };
    let mut network = Network {
        lenses: vec![Lens::new(cameras[0].intrinsics, free.unwrap_or_default())],
        views: cameras.iter().enumerate().map(view).collect(),
        ..Network::default()
    };
    for point in matched.cameras.points.iter().filter(|point| point.seen.len() > 2) {
        // The place nearest to all rays.
        let (mut across, mut sum) = (DMat3::ZERO, DVec3::ZERO);
        for (camera, pixel) in &point.seen {
            let (eye, along) = cameras[*camera].ray(*pixel);
            let plane = DMat3::IDENTITY - DMat3::from_cols(along * along.x, along * along.y, along * along.z);
            across += plane;
            sum += plane * eye;
        }
        let index = network.points.len();
        network.points.push(Point { position: across.inverse() * sum, fixed: false, known: None });
        let mark = |(view, pixel): &(usize, _)| Observation { view: *view, point: index, pixel: *pixel, weight: 2.0 };
        network.observations.extend(point.seen.iter().map(mark));
    }
    bundle::adjust(&mut network, &bundle::Params { loss: Loss::Cauchy(2.385), ..bundle::Params::default() });
    let intrinsics = network.lenses[0].intrinsics;
    let cameras: Vec<Camera> = network.views.iter().map(|view| Camera { pose: view.pose, intrinsics }).collect();
    let squares = network.observations.iter().map(|mark| {
        let picture = cameras[mark.view].project(network.points[mark.point].position).unwrap();
        (picture - mark.pixel).length_squared()
    });
    let rms = (squares.sum::<f64>() / (2.0 * network.observations.len() as f64)).sqrt();
    (cameras, rms)
}

/// Copies of a quarter of the pixels: a few seconds of a processor, and every step of it.
#[test]
fn the_castle_in_small_is_matched() {
    let Some(set) = photoset(CASTLE) else { return };
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path().join("Été au château");
    std::fs::create_dir_all(&folder).unwrap();
    let files = photographs(&set.join("images"), "jpg");
    let mut project = project(&folder, &files);
    let whole = project.load_for_matching().unwrap().problem;
    let Focal::Guess(focal) = whole.lenses[0].focal else { panic!("{:?}", whole.lenses) };
    for photo in &mut project.file.photo {
        let path = folder.join(&photo.file);
        let small = image::open(&path).unwrap().resize_exact(800, 600, image::imageops::FilterType::Triangle);
        photo.file = photo.file.replace(".jpg", ".png");
        small.save(folder.join(&photo.file)).unwrap();
    }
    // The copies have no EXIF; they are taken to share a lens.
    let mut loaded = project.load_for_matching().unwrap();
    assert!(loaded.notes[0].contains("are taken to share one"), "{:?}", loaded.notes);
    assert_eq!(loaded.problem.lenses.len(), 1);
    loaded.problem.lenses[0].focal = Focal::Guess(0.5 * focal);
    let mut matched = matched_by(&project, &loaded.problem);
    assert_eq!(matched.left_out, []);
    for camera in &mut matched.cameras.cameras {
        camera.name = camera.name.replace(".png", ".jpg");
    }
    let (turn, place) = off(&matched, &openmvg::read(&set.join("sfm_data.json")).unwrap());
    assert!(turn < 0.1 && place < 0.003);
}

/// `cargo test -p heliodon_photo --test all colmap:: -- --ignored --nocapture` prints how far the cameras are from the known ones.
#[test]
#[ignore = "COLMAP on four photographs of two megapixels: a minute of a processor"]
fn the_castle_is_matched() {
    let Some(set) = photoset(CASTLE) else { return };
    let folder = tempfile::tempdir().unwrap();
    let matched = matched(&project(folder.path(), &photographs(&set.join("images"), "jpg")));
    assert_eq!(matched.left_out, []);
    let (turn, place) = off(&matched, &openmvg::read(&set.join("sfm_data.json")).unwrap());
    assert!(turn < 0.1 && place < 0.003);
}

/// Sixteen photographs around a plaster temple before black cloth, calibrated on a gantry to about a pixel.
#[test]
#[ignore = "COLMAP on sixteen small photographs, twice: two minutes of a processor"]
fn the_temple_is_matched_with_its_lens_and_without() {
    let Some(set) = photoset(TEMPLE) else { return };
    let folder = tempfile::tempdir().unwrap();
    let project = project(folder.path(), &photographs(&set, "png"));
    let known = projection::read(&set.join("templeSR_par.txt")).unwrap();
    let mut problem = project.load_for_matching().unwrap().problem;
    assert_eq!(problem.lenses.len(), 1);
    let lens = &mut problem.lenses[0];
    lens.intrinsics = Intrinsics { width: 640, height: 480, ..known.cameras[0].camera.intrinsics };
    lens.focal = Focal::Known(lens.intrinsics.focal_px[0]);
    lens.free = Free::default();
    let calibrated = matched_by(&project, &problem);
    assert_eq!(calibrated.left_out, []);
    let (turn, place) = off(&calibrated, &known);
    assert!(turn < 0.2 && place < 0.003);
    // What the known cameras are worth: they were calibrated to about a pixel, 0.04 degree. Held, they fit the matches worse than those found do,
    // and adjusted from where they are, with their own lens, they go as far from themselves.
    let truth = in_order(&calibrated, &known);
    let (_, held_px) = adjusted(&calibrated, &truth, None);
    let (moved, moved_px) = adjusted(&calibrated, &truth, Some(Free::default()));
    let away = compare(&moved, &truth);
    println!("  known cameras held: {held_px:.3} px; adjusted: {moved_px:.3} px, {:.4} deg away at worst", away.turn_deg);
    assert!(held_px > 2.0 * moved_px && away.turn_deg > 0.8 * turn);
    // Without EXIF and without a word on the lens.
    let unknown = matched(&project);
    assert_eq!(unknown.left_out, []);
    let (turn, place) = off(&unknown, &known);
    assert!(turn < 0.5 && place < 0.003);
    let truth = in_order(&unknown, &known);
    let (moved, moved_px) = adjusted(&unknown, &truth, Some(Free { focal: true, centre: true, radial: 2, tangential: false }));
    let away = compare(&moved, &truth);
    let [before, after] = [&truth, &moved].map(|cameras| DVec2::from(cameras[0].intrinsics.centre_px));
    let centre = after - before;
    println!(
        "  known cameras adjusted with their lens: {moved_px:.3} px, {:.4} deg away at worst, the lens's centre by {:.1} {:.1} px",
        away.turn_deg, centre.x, centre.y
    );
    assert!(away.turn_deg > 0.7 * turn);
}

/// Photographs of the temple among those of the castle, and one that ends too early.
#[test]
#[ignore = "COLMAP on eight photographs: two minutes of a processor"]
fn photographs_of_another_scene_are_left_out_with_a_reason() {
    let (Some(castle), Some(temple)) = (photoset(CASTLE), photoset(TEMPLE)) else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut files = photographs(&castle.join("images"), "jpg");
    files.extend(photographs(&temple, "png").into_iter().take(3));
    let mut project = project(folder.path(), &files);
    let bytes = std::fs::read(&files[0]).unwrap();
    std::fs::write(folder.path().join("broken.jpg"), &bytes[..20_000]).unwrap();
    project.file.photo.push(PhotoEntry { file: "broken.jpg".to_owned(), ..PhotoEntry::default() });
    let matched = matched(&project);
    assert!(matched.cameras.cameras.iter().all(|c| c.name.starts_with("Maupertuis")));
    assert_eq!(matched.cameras.cameras.len(), 4);
    let left: Vec<&str> = matched.left_out.iter().map(|l| l.photo.as_str()).collect();
    assert_eq!(left, ["templeSR0001.png", "templeSR0002.png", "templeSR0003.png", "broken.jpg"]);
}
