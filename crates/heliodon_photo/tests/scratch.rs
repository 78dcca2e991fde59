#[path = "common/accuracy.rs"]
mod accuracy;
use heliodon_photo::camera::*;
use heliodon_photo::formats::*;
use heliodon_photo::solve::bundle::Free;
use heliodon_photo::solve::*;
use std::path::Path;

fn load(model: &str, truth: &ImportedCameras, focal: Focal, free: Free, lens: Option<Intrinsics>) -> (Problem, Start, Vec<Camera>) {
    let got = colmap::read(Path::new(model)).unwrap();
    let lens = lens.unwrap_or(got.cameras[0].camera.intrinsics);
    let problem = Problem {
        lenses: vec![LensGroup { name: "l".into(), intrinsics: Intrinsics { radial: [0.0; 3], ..lens }, focal, free }],
        photos: got.cameras.iter().map(|c| Photo { name: c.name.clone(), lens: 0, pose: None }).collect(),
        points: got.points.iter().enumerate().map(|(i, _)| Reference { name: format!("{i}"), known_m: None, ground: false }).collect(),
        marks: got.points.iter().enumerate().flat_map(|(i, p)| p.seen.iter().map(move |(photo, pixel)| Mark { photo: *photo, point: i, pixel: *pixel })).collect(),
        ..Problem::default()
    };
    let start = Start { lenses: vec![lens], poses: got.cameras.iter().map(|c| Some(c.camera.pose)).collect(), points: got.points.iter().map(|p| Some(p.position)).collect() };
    let known = got.cameras.iter().map(|c| truth.cameras.iter().find(|t| t.name == c.name).unwrap().camera).collect();
    (problem, start, known)
}

fn report(what: &str, model: &str, truth: &ImportedCameras, focal: Focal, free: Free, lens: Option<Intrinsics>) {
    let (problem, start, known) = load(model, truth, focal, free, lens);
    let got = colmap::read(Path::new(model)).unwrap();
    let a = accuracy::compare(&got.cameras.iter().map(|c| c.camera).collect::<Vec<_>>(), &known);
    println!("--- {what} {model}: {} photos {} marks; colmap's own turn {:.3} ({:.3}) place {:.3} % ({:.3}), focal {:.1}", problem.photos.len(), problem.marks.len(), a.turn_deg, a.turn_rms_deg, 100.0*a.place, 100.0*a.place_rms, start.lenses[0].focal_px[0]);
    for sigma in [0.5] {
        let t = std::time::Instant::now();
        let s = refine(&problem, &start, &Params { mark_sigma_px: sigma, ..Params::default() });
        let t = t.elapsed().as_secs_f64();
        let cams: Vec<Camera> = (0..known.len()).map(|i| s.camera(i).unwrap()).collect();
        let a = accuracy::compare(&cams, &known);
        let l = s.lenses[0];
        let wrong = s.marks.iter().filter(|m| matches!(m, MarkResult::Wrong(_))).count();
        let rs: Vec<f64> = s.photos.iter().map(|p| if let PhotoResult::Solved(p) = p { p.rotation_sigma_rad.unwrap_or(9.0).to_degrees() } else { 0.0 }).collect();
        println!("   refined {free:?}: turn {:.3} ({:.3}) place {:.3} % ({:.3}); sigma {:.2} px, wrong {wrong}, {t:.2} s", a.turn_deg, a.turn_rms_deg, 100.0*a.place, 100.0*a.place_rms, s.sigma_px);
        println!("      f {:.1}+-{:.1} (true {:.1}) c {:.1},{:.1} +- {:.1} {:.1} (true {:?}) k {:?} +- {:?} p {:?}; turn sigma {:.3}", l.intrinsics.focal_px[0], l.sigmas[0], known[0].intrinsics.focal_px[0], l.intrinsics.centre_px[0], l.intrinsics.centre_px[1], l.sigmas[1], l.sigmas[2], known[0].intrinsics.centre_px, l.intrinsics.radial, &l.sigmas[3..6], l.intrinsics.tangential, rs.iter().copied().fold(0.0, f64::max));
    }
}

#[test]
fn scratch() {
    let sets = Path::new("../../../shared/data/photosets");
    let w = "/root/w/colmap";
    let castle = openmvg::read(&sets.join("kapture_maupertuis/sfm_data.json")).unwrap();
    let ring = projection::read(&sets.join("middlebury_templeSparseRing/templeSR_par.txt")).unwrap();
    let f = |centre, radial, tangential| Free { focal: true, centre, radial, tangential };
    for model in ["t1/sparse/0", "t6/sparse/0"] {
        for free in [f(false, 2, false), f(true, 2, false), f(true, 3, false), f(true, 3, true)] {
            report("castle", &format!("{w}/{model}"), &castle, Focal::Guess(1663.0), free, None);
        }
        let truth = castle.cameras[0].camera.intrinsics;
        report("castle, their centre", &format!("{w}/{model}"), &castle, Focal::Guess(1663.0), f(false, 3, false), Some(Intrinsics { centre_px: truth.centre_px, ..truth }));
        report("castle, their lens", &format!("{w}/{model}"), &castle, Focal::Known(truth.focal_px[0]), Free::default(), Some(truth));
    }
    for model in ["t4/sparse/0", "j1600/out"] {
        for free in [f(false, 0, false), f(false, 2, false), f(true, 0, false), f(true, 1, false), f(true, 2, false), f(true, 3, true)] {
            report("ring", &format!("{w}/{model}"), &ring, Focal::Free, free, None);
        }
        let truth = ring.cameras[0].camera.intrinsics;
        let lens = Intrinsics { width: 640, height: 480, ..truth };
        report("ring, their lens", &format!("{w}/{model}"), &ring, Focal::Known(truth.focal_px[0]), Free::default(), Some(lens));
        report("ring, their lens+0.5", &format!("{w}/{model}"), &ring, Focal::Known(truth.focal_px[0]), Free::default(), Some(Intrinsics{centre_px:[lens.centre_px[0]+0.5, lens.centre_px[1]+0.5], ..lens}));
        report("ring, their lens, k", &format!("{w}/{model}"), &ring, Focal::Known(truth.focal_px[0]), f(false, 2, false), Some(lens));
        report("ring, aspect", &format!("{w}/{model}"), &ring, Focal::Guess(truth.focal_px[0]), f(true, 1, false), Some(lens));
    }
}
