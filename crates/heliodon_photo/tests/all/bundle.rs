//! Bundle adjustment against truth that was made up.

use glam::{DVec2, DVec3};
use heliodon_photo::camera::{Intrinsics, Pose};
use heliodon_photo::formats::{ImportedCamera, ImportedCameras, ImportedPoint, colmap, colmap_write};
use heliodon_photo::solve::bundle::{
    Free, Inverse, Lens, Loss, Network, Observation, Params, Point, View, adjust, rotation_from_vector,
};
use heliodon_photo::solve::random::Random;

/// Cameras on a ring that look at a cloud of points; every point in about `seen` of them.
fn ring(views: usize, points: usize, seen: usize, noise_px: f64, seed: u64) -> Network {
    let mut random = Random::new(seed);
    let lens = Intrinsics { radial: [-0.1, 0.03, 0.0], ..Intrinsics::pinhole(4000, 3000, 3600.0) };
    let free = Free { focal: true, radial: 2, ..Free::default() };
    let mut network = Network { lenses: vec![Lens::new(lens, free)], ..Network::default() };
    for i in 0..views {
        let angle = std::f64::consts::TAU * i as f64 / views as f64;
        let eye = DVec3::new(30.0 * angle.sin(), 4.0 + (i % 3) as f64, 30.0 * angle.cos());
        network.views.push(View { pose: Pose::look_at(eye, DVec3::ZERO).unwrap(), lens: 0, fixed: false });
    }
    for index in 0..points {
        let position = DVec3::new(random.normal() * 4.0, random.normal() * 2.0, random.normal() * 3.0);
        network.points.push(Point { position, fixed: false, known: None });
        let first = random.index(views);
        for k in 0..seen.min(views) {
            let view = (first + k) % views;
            if let Some(pixel) = network.camera(view).project(position) {
                let pixel = pixel + DVec2::new(random.normal(), random.normal()) * noise_px;
                network.observations.push(Observation { view, point: index, pixel, weight: 1.0 });
            }
        }
    }
    network
}

fn shake(network: &mut Network, seed: u64) {
    let mut random = Random::new(seed);
    let mut vector = |scale: f64| DVec3::new(random.normal(), random.normal(), random.normal()) * scale;
    for view in &mut network.views {
        view.pose.rotation = rotation_from_vector(vector(0.01)) * view.pose.rotation;
        view.pose.translation += vector(0.2);
    }
    for point in &mut network.points {
        point.position += vector(0.1);
    }
    network.lenses[0].intrinsics = Intrinsics { radial: [0.0; 3], ..Intrinsics::pinhole(4000, 3000, 3500.0) };
}

#[test]
fn a_shaken_network_comes_back() {
    let mut network = ring(10, 200, 5, 0.0, 3);
    shake(&mut network, 4);
    let outcome = adjust(&mut network, &Params::default());
    assert!(outcome.converged, "{outcome:?}");
    assert!(outcome.cost_after < 1e-9, "{outcome:?}");
    let lens = network.lenses[0].intrinsics;
    assert!((lens.focal_px[0] - 3600.0).abs() < 1e-3, "{lens:?}");
    assert!((lens.radial[0] + 0.1).abs() < 1e-5);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut network = ring(8, 300, 4, 0.5, 5);
            shake(&mut network, 6);
            adjust(&mut network, &Params { loss: Loss::Huber(2.0), ..Params::default() });
            network.points.iter().flat_map(|p| p.position.to_array()).map(f64::to_bits).collect::<Vec<_>>()
        })
    };
    assert_eq!(run(1), run(2));
}

#[test]
fn covariances_say_how_far_solutions_scatter() {
    // Distances between points do not depend on the datum.
    let truth = ring(6, 40, 6, 0.0, 9);
    let (a, b) = (0, 7);
    let mut ratios = Vec::new();
    let mut focal = Vec::new();
    let mut said = 0.0;
    for seed in 0..60 {
        let mut network = truth.clone();
        let mut random = Random::new(100 + seed);
        for o in &mut network.observations {
            o.pixel += DVec2::new(random.normal(), random.normal());
        }
        adjust(&mut network, &Params::default());
        let p = |i: usize| network.points[i].position;
        ratios.push((p(a) - p(b)).length() / (p(3) - p(11)).length());
        focal.push(network.lenses[0].intrinsics.focal_px[0]);
        if seed == 0 {
            said = Inverse::of(&network).unwrap().covariances(&[]).lenses[0][0];
        }
    }
    let spread = |v: &[f64]| {
        let mean = v.iter().sum::<f64>() / v.len() as f64;
        (v.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (v.len() - 1) as f64).sqrt()
    };
    let found = spread(&focal);
    assert!(spread(&ratios) > 0.0);
    // 60 draws know a standard deviation to 9 %; three times that.
    assert!((found / said - 1.0).abs() < 0.28, "focal scatters by {found} px, said {said} px");
}

/// `cargo test -p heliodon_photo --test all bundle:: -- --ignored --nocapture` prints the seconds.
#[test]
#[ignore = "a measurement: fifty photographs, 20,000 points"]
fn fifty_photographs_and_twenty_thousand_points() {
    let mut network = ring(50, 20_000, 10, 0.5, 11);
    shake(&mut network, 12);
    let start = std::time::Instant::now();
    let outcome = adjust(&mut network, &Params { relative_decrease: 1e-6, ..Params::default() });
    let seconds = start.elapsed().as_secs_f64();
    let marks = network.observations.len() as f64;
    let rms = (2.0 * outcome.cost_after / (2.0 * marks)).sqrt();
    println!("{marks} marks, {} steps, rms {rms:.4} px a coordinate, {seconds:.2} s", outcome.steps);
    assert!(outcome.converged && rms < 0.5 && seconds < 20.0);
}

/// The network as another program's model.
fn exported(network: &Network) -> ImportedCameras {
    let mut model = ImportedCameras::default();
    for view in 0..network.views.len() {
        let (name, camera) = (format!("{view}.jpg"), network.camera(view));
        model.cameras.push(ImportedCamera { name, lens: 1, camera, centred: false });
    }
    model.points = network.points.iter().map(|p| ImportedPoint { position: p.position, seen: Vec::new() }).collect();
    for o in &network.observations {
        model.points[o.point].seen.push((o.view, o.pixel));
    }
    model
}

/// The same problem by COLMAP's own adjustment (Ceres), same lens model, same start, same end (a step that lowers the cost by less than a
/// millionth), in turns. `cargo test -p heliodon_photo --test all beside -- --ignored --nocapture` prints the seconds.
#[test]
#[ignore = "a measurement beside COLMAP: fifty photographs, 20,000 points, five times"]
fn beside_colmap_on_the_same_problem() {
    if std::process::Command::new("colmap").arg("-h").output().is_err() {
        eprintln!("skipped: there is no program colmap");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (start, end) = (folder.path().join("start"), folder.path().join("end"));
    std::fs::create_dir_all(&end).unwrap();
    let mut shaken = ring(50, 20_000, 10, 0.5, 11);
    shake(&mut shaken, 12);
    colmap_write::write(&start, &exported(&shaken), shaken.lenses[0].free).unwrap();
    let coordinate_rms = |model: &ImportedCameras| model.rms_px().unwrap() / 2f64.sqrt();
    let (mut ours, mut solver, mut program) = (Vec::new(), Vec::new(), Vec::new());
    let (mut our_rms, mut their_rms) = (0.0, 0.0);
    for _ in 0..5 {
        let mut network = shaken.clone();
        let begin = std::time::Instant::now();
        let outcome = adjust(&mut network, &Params { relative_decrease: 1e-6, ..Params::default() });
        ours.push(begin.elapsed().as_secs_f64());
        assert!(outcome.converged, "{outcome:?}");
        our_rms = coordinate_rms(&exported(&network));
        let begin = std::time::Instant::now();
        let run = std::process::Command::new("colmap")
            .args(["bundle_adjuster", "--BundleAdjustment.function_tolerance", "1e-6", "--input_path"])
            .arg(&start)
            .arg("--output_path")
            .arg(&end)
            .env("QT_QPA_PLATFORM", "offscreen")
            .output()
            .unwrap();
        program.push(begin.elapsed().as_secs_f64());
        let said = String::from_utf8_lossy(&run.stdout);
        // `Time : 12.3 [s]` of its report: the solver without reading and writing.
        let time = said.lines().filter_map(|line| line.trim().strip_prefix("Time :")?.trim().strip_suffix("[s]")).next();
        solver.push(time.and_then(|t| t.trim().parse::<f64>().ok()).unwrap_or(f64::NAN));
        their_rms = coordinate_rms(&colmap::read(&end).unwrap());
    }
    let median = |times: &mut Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    println!(
        "{} marks; ours {:.2} s, rms {our_rms:.5} px; COLMAP's solver {:.2} s, program {:.2} s, rms {their_rms:.5} px",
        shaken.observations.len(),
        median(&mut ours),
        median(&mut solver),
        median(&mut program)
    );
    assert!((our_rms / their_rms - 1.0).abs() < 1e-3, "{our_rms} and {their_rms}");
}
