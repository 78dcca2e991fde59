//! Visits that are played by scripts of inputs.

use crate::{done, run};
use serde_json::Value;
use std::ffi::OsStr;
use std::fs;
use std::path::Path;

/// A box as OBJ.
fn block(low: [f32; 3], high: [f32; 3]) -> String {
    let mut text = String::new();
    for i in 0..8 {
        let pick = |bit: usize, axis: usize| if i >> bit & 1 == 1 { high[axis] } else { low[axis] };
        text += &format!("v {} {} {}\n", pick(0, 0), pick(1, 1), pick(2, 2));
    }
    // +X, -X, +Y, -Y, +Z, -Z
    text + "f 2 4 8\nf 2 8 6\nf 1 5 7\nf 1 7 3\nf 3 7 8\nf 3 8 4\nf 1 2 6\nf 1 6 5\nf 5 6 8\nf 5 8 7\nf 1 3 4\nf 1 4 2\n"
}

/// A block on a floor, a mallet and a leaf of gold on a bench, and a story.
fn site(folder: &Path) {
    for (name, low, high) in [
        ("floor", [-6.0, -0.2, -6.0], [6.0, 0.0, 6.0]),
        ("block", [-0.4, 0.0, -3.4], [0.4, 1.1, -2.6]),
        ("bench", [1.4, 0.0, -1.4], [2.6, 0.8, -0.8]),
        ("mallet", [-0.05, 0.0, -0.05], [0.05, 0.3, 0.05]),
        ("leaf", [-0.1, 0.0, -0.1], [0.1, 0.02, 0.1]),
    ] {
        fs::write(folder.join(format!("{name}.obj")), block(low, high)).unwrap();
    }
    let mut sky = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n".to_vec();
    sky.extend([128, 128, 128, 129].repeat(32));
    fs::write(folder.join("grey.hdr"), sky).unwrap();
    fs::write(folder.join("site.toml"), include_str!("play/site.toml")).unwrap();
    fs::write(folder.join("story.rhai"), include_str!("play/story.rhai")).unwrap();
    fs::write(folder.join("texts.toml"), include_str!("play/texts.toml")).unwrap();
    fs::write(folder.join("tour.play"), include_str!("play/tour.play")).unwrap();
}

#[test]
fn a_story_is_played_to_its_end_on_every_device() {
    let folder = tempfile::tempdir().unwrap();
    site(folder.path());
    let inputs = folder.path().join("tour.play");
    for scheme in ["keyboard", "pad", "hand"] {
        let asked: [&dyn AsRef<OsStr>; 7] = [&"play", &folder.path(), &"--inputs", &inputs, &"--scheme", &scheme, &"--json"];
        let report: Value = serde_json::from_str(&done(&asked).out).unwrap();
        let tasks: Vec<&str> = report["tasks"].as_array().unwrap().iter().map(|task| task[0].as_str().unwrap()).collect();
        assert_eq!(tasks, ["take", "strike", "strike", "strike", "gild", "done"], "{scheme}");
        let frames = &report["frames"];
        assert!(frames["count"].as_u64() > Some(300) && frames["most_ms"].as_f64() >= frames["p95_ms"].as_f64(), "{frames}");
        let told = |name: &str| report["features"].as_array().unwrap().iter().any(|feature| feature["name"] == name);
        assert!(["story", "hands", "actors"].iter().all(|name| told(name)), "{}", report["features"]);
    }
    assert!(!folder.path().join("memory.json").exists(), "nothing of it is kept");
    // what does not come about ends it, with the line
    fs::write(&inputs, "until task take\n\nexpect held mallet\n").unwrap();
    let wrong = run(&[&"play", &folder.path(), &"--inputs", &inputs]);
    assert_eq!(wrong.code, 1);
    assert!(wrong.err.contains("line 3, `expect held mallet`") && wrong.err.contains("it is none"), "{}", wrong.err);
    // and with a picture of the moment, in which something is to be seen
    let moment = heliodon_image::SrgbImage::read(folder.path().join("tour.failed.png")).unwrap();
    let darkest = moment.pixels.iter().map(|[r, ..]| *r).min();
    assert!((moment.width, moment.height) == (640, 480) && darkest < moment.pixels.iter().map(|[r, ..]| *r).max());
    fs::write(&inputs, "jump\n").unwrap();
    let wrong = run(&[&"play", &folder.path(), &"--inputs", &inputs]);
    assert!(wrong.code == 1 && wrong.err.contains("line 1: `jump`"), "{}", wrong.err);
}
