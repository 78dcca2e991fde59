//! The workshop of Feidias, played to its end.

use crate::done;
use serde_json::Value;
use std::ffi::OsStr;
use std::fs;

/// Every task in its order; a blow of the mallet says its own anew.
const TASKS: [&str; 8] = ["do-take-mallet", "do-carve", "do-carve", "do-carve", "do-ivory", "do-melt", "do-glass", "do-gold"];

#[test]
fn the_statue_is_finished_with_every_device() {
    let folder = tempfile::tempdir().unwrap();
    let site = folder.path().join("hall");
    done(&[&"new", &site, &"--template", &"workshop"]);
    // its light is another test's matter
    let path = site.join("site.toml");
    let mut text = fs::read_to_string(&path).unwrap();
    for (as_made, quick) in
        [("\nsamples = 512", "\nsamples = 16"), ("\nbounces = 6", "\nbounces = 1"), ("\ntexels = 2048", "\ntexels = 256")]
    {
        assert!(text.contains(as_made), "{as_made}");
        text = text.replace(as_made, quick);
    }
    fs::write(&path, text).unwrap();
    assert!(done(&[&"check", &site]).out.contains("Nothing is wrong."));
    // the visit that lies in the site, without its pictures, which need minutes where a processor draws
    let tour = fs::read_to_string(site.join("tour.play")).unwrap();
    let inputs = folder.path().join("tour.play");
    let lines: Vec<&str> = tour.lines().filter(|line| !line.starts_with("shot")).collect();
    fs::write(&inputs, lines.join("\n")).unwrap();
    for scheme in ["keyboard", "pad", "hand"] {
        let asked: [&dyn AsRef<OsStr>; 7] = [&"play", &site, &"--inputs", &inputs, &"--scheme", &scheme, &"--json"];
        let report: Value = serde_json::from_str(&done(&asked).out).unwrap();
        let tasks: Vec<&str> = report["tasks"].as_array().unwrap().iter().map(|task| task[0].as_str().unwrap()).collect();
        assert_eq!(tasks, TASKS, "{scheme}");
    }
    assert!(!site.join("memory.json").exists(), "nothing of it is kept");
}
