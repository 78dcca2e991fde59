//! Geometry that is prepared and kept: kills, damage, full disks, company, and sites of which little can be made.

use crate::resume::blocks;
#[cfg(unix)]
use crate::resume::with_little_room;
use crate::sites::{TestSite, plane, waves};
use crate::{assert_same_bundle, contents, done, heliodon, json, run};
use heliodon_image::SrgbImage;
use std::ffi::OsStr;
use std::io::{BufRead, Read};
use std::path::PathBuf;
use std::process::Stdio;
use std::time::{Duration, Instant};

const ROOM: &str = "[[room]]\nname = \"loft\"\nmin = [0.2, 0.3, -0.8]\nmax = [0.8, 0.6, -0.2]\n";

/// A site of two parts that is prepared for a room; `more` goes into `site.toml`.
fn site_with(obj: &str, more: &str) -> TestSite {
    let site = TestSite::smallest(obj);
    site.write("second.obj", plane(6));
    let second = "[[part]]\nfile = \"second.obj\"\ntranslate = [1.5, 0.0, 0.0]\n";
    let text = std::fs::read_to_string(site.path("site.toml")).unwrap();
    site.write("site.toml", format!("{text}{second}{more}[prepare]\nedge_px = 40.0\n"));
    site
}

fn prepared_site() -> TestSite {
    site_with(&waves(24), ROOM)
}

/// What a bake makes that finds nothing and leaves nothing.
fn reference(site: &TestSite) -> PathBuf {
    let (whole, cache) = (site.path("whole"), site.path("cache-of-whole"));
    done(&[&"bake", &site.folder(), &"-o", &whole, &"--cache", &cache]);
    std::fs::remove_dir_all(cache).unwrap();
    whole
}

/// What is kept of steps that depend on one part alone.
fn of_parts(site: &TestSite, what: &str) -> Vec<PathBuf> {
    let all = blocks(site.folder(), "part-").into_iter();
    all.filter(|path| path.file_name().unwrap().to_string_lossy().contains(what)).collect()
}

fn damage(path: &PathBuf) {
    let mut bytes = std::fs::read(path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn an_interrupted_prepare_goes_on_and_a_bake_finds_the_geometry() {
    let site = prepared_site();
    let whole = reference(&site);
    // It ends behind its last step, where the whole cannot be written: there is a folder of that name.
    done(&[&"prepare", &site.folder()]);
    let geometry = blocks(site.folder(), "scene-index")[0].parent().unwrap().to_owned();
    std::fs::remove_dir_all(&geometry).unwrap();
    std::fs::create_dir_all(geometry.join("scene-index-00000")).unwrap();
    let stopped = run(&[&"prepare", &site.folder()]);
    assert!(stopped.code == 1 && stopped.err.contains("cannot keep finished work"), "{}", stopped.err);
    std::fs::remove_dir(geometry.join("scene-index-00000")).unwrap();
    // of what was kept, one is damaged
    damage(&of_parts(&site, "-simple-mesh-positions")[0]);
    let resumed = done(&[&"prepare", &site.folder()]);
    for told in ["going on: preparation has read 2 of 2 parts", "damaged (part-", "-simple)"] {
        assert!(resumed.err.contains(told), "{told}: {}", resumed.err);
    }
    assert!(!resumed.err.contains("cleaning"), "{}", resumed.err);
    assert!(blocks(site.folder(), "piece-").is_empty());
    let baked = done(&[&"bake", &site.folder()]);
    assert!(baked.err.contains("going on: the geometry is prepared"), "{}", baked.err);
    assert_same_bundle(&site.path("bundle"), &whole);
}

#[test]
fn a_second_prepare_tells_the_same_and_coloured_meshes_are_made_again() {
    let site = prepared_site();
    let first = json(&[&"prepare", &site.folder()]);
    assert_eq!(json(&[&"prepare", &site.folder()]), first);
    let found = site.path("found");
    let again = done(&[&"prepare", &site.folder(), &"-o", &found]);
    assert!(again.err.contains("coloured meshes need every step"), "{}", again.err);
    let names: Vec<String> = contents(&found).into_iter().map(|(name, _)| name).collect();
    assert!(names.iter().filter(|name| name.ends_with(".ply")).count() == 4, "{names:?}");
}

#[test]
fn new_geometry_replaces_what_other_settings_left() {
    let site = prepared_site();
    let folders = || {
        let all = std::fs::read_dir(site.path(".heliodon/cache")).unwrap();
        all.filter(|entry| entry.as_ref().unwrap().file_name().to_string_lossy().starts_with("geometry-")).count()
    };
    done(&[&"prepare", &site.folder()]);
    site.edit("edge_px = 40.0", "edge_px = 60.0");
    let second = done(&[&"prepare", &site.folder()]);
    assert!(!second.err.contains("going on"), "{}", second.err);
    assert_eq!(folders(), 1);
    assert!(done(&[&"prepare", &site.folder()]).err.contains("going on: the geometry is prepared"));
}

#[test]
fn a_moved_part_leaves_the_others_as_they_were_prepared() {
    let site = prepared_site();
    done(&[&"bake", &site.folder()]);
    let kept = of_parts(&site, "").len();
    for (then, now) in [("translate = [1.5", "translate = [1.6"), ("translate = [1.6", "scale = 0.5\ntranslate = [1.6")] {
        site.edit(then, now);
        let whole = reference(&site);
        let baked = done(&[&"bake", &site.folder()]);
        assert!(baked.err.contains("going on: preparation has read 1 of 2 parts"), "{}", baked.err);
        assert_same_bundle(&site.path("bundle"), &whole);
        assert_eq!(of_parts(&site, "").len(), kept, "what is superseded goes");
    }
}

#[test]
fn a_prepared_shape_is_shown_in_the_original_s_light() {
    let site = prepared_site();
    let text = std::fs::read_to_string(site.path("site.toml")).unwrap();
    let bake = |prepare: &str, out: &str| {
        site.write("site.toml", text.replace("[prepare]\nedge_px = 40.0\n", prepare));
        done(&[&"bake", &site.folder(), &"-o", &site.path(out)]);
    };
    bake("", "original");
    bake("[prepare]\nerror_px = 60.0\nedge_px = 400.0\npurge = false\n", "simple");
    let still = |name: &str, bundle: &str, shape: Option<&str>| {
        let (bundle, out) = (site.path(bundle), site.path(name));
        let mut all: Vec<&dyn AsRef<OsStr>> = vec![&"render", &bundle, &"-o", &out, &"--time", &"12:00"];
        all.extend::<[&dyn AsRef<OsStr>; 8]>([
            &"--size",
            &"64x48",
            &"--reference",
            &"16",
            &"--eye",
            &"0.5,0.4,-0.3",
            &"--look",
            &"0.5,0,-0.8",
        ]);
        let shape = shape.map(|shape| site.path(shape));
        if let Some(shape) = &shape {
            all.extend::<[&dyn AsRef<OsStr>; 2]>([&"--shape", shape]);
        }
        (run(&all), out)
    };
    let picture = |name: &str, bundle: &str, shape: Option<&str>| {
        let (ran, out) = still(name, bundle, shape);
        assert_eq!(ran.code, 0, "{}", ran.err);
        SrgbImage::read(out).unwrap()
    };
    let truth = picture("truth.png", "original", None);
    let off = |(a, b): (&[u8; 4], &[u8; 4])| f64::from(a[1].abs_diff(b[1]));
    let difference = |other: &SrgbImage| truth.pixels.iter().zip(&other.pixels).map(off).sum::<f64>() / 3072.0;
    let shown = difference(&picture("shown.png", "original", Some("simple")));
    let simple = difference(&picture("simple.png", "simple", None));
    // other silhouettes, but of the original's light: 0.5 of 255, and 1.7 with their own
    assert!(0.1 < shown && shown < 0.6 * simple, "{shown} and {simple} of 255");
    // where its numbers mean other places nothing is shown
    site.write("site.toml", text.replace("[site]\n", "[site]\norigin = [0.0, 0.25, 0.0]\n"));
    done(&[&"bake", &site.folder(), &"-o", &site.path("moved")]);
    let (ran, out) = still("moved.png", "original", Some("moved"));
    assert!(ran.code == 1 && ran.err.contains("origin") && ran.err.contains("moved") && !out.exists(), "{}", ran.err);
}

#[test]
fn damaged_geometry_is_made_again() {
    let site = prepared_site();
    let whole = reference(&site);
    done(&[&"prepare", &site.folder()]);
    damage(&blocks(site.folder(), "scene-original-positions")[0]);
    let baked = done(&[&"bake", &site.folder()]);
    assert!(baked.err.contains("kept geometry was damaged (scene)"), "{}", baked.err);
    assert_same_bundle(&site.path("bundle"), &whole);
    let again = done(&[&"bake", &site.folder(), &"--again"]);
    assert!(again.err.contains("going on: the geometry is prepared"), "{}", again.err);
}

#[test]
fn one_run_prepares_and_the_others_wait_for_it() {
    let site = prepared_site();
    let whole = reference(&site);
    done(&[&"prepare", &site.folder()]);
    // as if another run were about to make the geometry
    let kept = blocks(site.folder(), "scene-index")[0].clone();
    let hidden = site.path("finished");
    std::fs::rename(&kept, &hidden).unwrap();
    let making = std::fs::File::options().write(true).open(kept.with_file_name("making")).unwrap();
    making.lock().unwrap();
    let mut waiting = heliodon(&[&"bake", &site.folder()]).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let mut told = std::io::BufReader::new(waiting.stderr.take().unwrap());
    let mut line = String::new();
    while !line.contains("waiting for it") {
        line.clear();
        assert!(told.read_line(&mut line).unwrap() > 0, "it did not wait");
    }
    std::fs::rename(&hidden, &kept).unwrap();
    drop(making);
    let mut rest = String::new();
    told.read_to_string(&mut rest).unwrap();
    assert!(waiting.wait().unwrap().success() && rest.contains("going on: the geometry is prepared"), "{rest}");
    assert_same_bundle(&site.path("bundle"), &whole);
}

#[test]
fn two_bakes_at_once_do_not_mix() {
    let site = prepared_site();
    let whole = reference(&site);
    let bake = || heliodon(&[&"bake", &site.folder()]).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    let first = bake();
    let patience = Instant::now();
    while of_parts(&site, "-whole-index").is_empty() {
        assert!(patience.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(2));
    }
    let ran = [first, bake()].map(|bake| crate::ran(bake.wait_with_output().unwrap()));
    assert!(ran.iter().any(|ran| ran.code == 0));
    for ran in ran {
        assert!(ran.code == 0 || ran.code == 1 && ran.err.contains("another bake"), "{}", ran.err);
    }
    assert_same_bundle(&site.path("bundle"), &whole);
    assert!(blocks(site.folder(), "piece-").is_empty());
}

#[test]
#[cfg(unix)]
fn a_full_disk_stops_preparation_and_spoils_nothing() {
    let site = prepared_site();
    let whole = reference(&site);
    let folder = site.folder().to_str().unwrap().to_owned();
    for kib in [0, 1, 4] {
        let full = with_little_room(kib, &["prepare", &folder]);
        assert_eq!(full.code, 1, "{kib}: {}", full.err);
        let errors: Vec<&str> = full.err.lines().filter(|line| line.starts_with("error:")).collect();
        assert!(errors.len() == 1 && errors[0].contains("cannot keep finished work"), "{}", full.err);
        assert!(contents(&site.path(".heliodon")).iter().all(|(name, _)| !name.ends_with(".new")));
    }
    done(&[&"bake", &site.folder()]);
    assert_same_bundle(&site.path("bundle"), &whole);
}

#[test]
#[cfg(unix)]
fn a_full_disk_leaves_no_half_report() {
    let site = site_with(&plane(1), ROOM);
    // little is split, and nothing simplified
    site.edit("edge_px = 40.0", "edge_px = 1000.0");
    // a name that is longer than a file's can be
    site.edit("role = \"scan\"", &format!("role = \"scan\"\nname = \"{}\"", "寺".repeat(200)));
    let (folder, found) = (site.folder().to_str().unwrap().to_owned(), site.path("found"));
    // reports are the largest of all that is written
    let met = (1..64).find_map(|kib| {
        let full = with_little_room(kib, &["prepare", &folder, "-o", found.to_str().unwrap()]);
        assert!(full.code == 1, "{kib} KiB are enough for all");
        full.err.contains("report.json").then_some(full.err)
    });
    assert!(met.as_ref().is_some_and(|told| told.contains("cannot write")), "{met:?}");
    let names: Vec<String> = contents(&found).into_iter().map(|(name, _)| name).collect();
    assert!(names.iter().all(|name| name.ends_with(".ply") || name == "report.txt"), "{names:?}");
}

#[test]
fn a_room_in_a_wall_and_one_that_sees_nothing_are_told() {
    // a closed box of a metre, which the lower half of the room reaches into
    let corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 -1\nv 1 0 -1\nv 1 1 -1\nv 0 1 -1\n";
    let faces = "f 1 2 3 4\nf 6 5 8 7\nf 2 6 7 3\nf 5 1 4 8\nf 4 3 7 8\nf 5 6 2 1\n";
    let cube = format!("{corners}{faces}");
    let room = |name: &str, low: &str, high: &str| format!("[[room]]\nname = \"{name}\"\nmin = {low}\nmax = {high}\n");
    let half = room("half in", "[0.2, 0.7, -0.8]", "[0.8, 1.5, -0.2]");
    let site = site_with(&cube, &half);
    let told = done(&[&"prepare", &site.folder()]).err;
    assert!(told.contains("warning: room \"half in\"") && told.contains("% of its box"), "{told}");
    assert!(told.contains("min and max in site.toml"), "{told}");
    // the bake that finds the geometry tells it as well
    assert!(json(&[&"bake", &site.folder()])["warnings"].to_string().contains("half in"));

    // one room in stone, one whose window looks away: nothing is known of what is seen, so nothing is dropped
    let within = room("crypt", "[0.3, 0.3, -0.7]", "[0.7, 0.7, -0.3]");
    let away = room("attic", "[0.2, 1.5, -0.8]", "[0.8, 1.9, -0.2]")
        + "windows = [[[0.2, 2.0, -0.2], [0.8, 2.0, -0.2], [0.2, 2.0, -0.8]]]\n";
    let site = site_with(&cube, &(within + &away));
    let ran = done(&[&"prepare", &site.folder(), &"--json"]);
    for told in ["room \"crypt\"", "room \"attic\"", "sees nothing", "nothing is dropped"] {
        assert!(ran.err.contains(told), "{told}: {}", ran.err);
    }
    let report: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    assert_eq!(report["triangles_hidden"], 0, "{report}");

    // without preparation, too: by checks and by bakes
    let text = std::fs::read_to_string(site.path("site.toml")).unwrap();
    site.write("site.toml", text.replace("[prepare]\nedge_px = 40.0\n", ""));
    for command in ["check", "bake"] {
        let told = done(&[&command, &site.folder()]).err;
        assert!(
            told.contains("room \"crypt\"") && told.contains("lies in stone") && !told.contains("attic"),
            "{command}: {told}"
        );
    }
}

#[test]
fn a_strip_without_area_is_told_and_no_half_bundle_made() {
    let strip: String =
        (0..8).map(|i| format!("v {i} 0 0\n")).chain((1..7).map(|i| format!("f {i} {} {}\n", i + 1, i + 2))).collect();
    let site = TestSite::smallest(&strip);
    let text = std::fs::read_to_string(site.path("site.toml")).unwrap();
    site.write("site.toml", format!("{text}{ROOM}[prepare]\n"));
    for command in ["prepare", "bake"] {
        let ran = run(&[&command, &site.folder()]);
        assert_eq!(ran.code, 1, "{command}: {}", ran.err);
        for told in ["mesh.obj", "nothing is left", "[prepare]"] {
            assert!(ran.err.contains(told), "{command}: {told}: {}", ran.err);
        }
    }
    assert!(!site.path("bundle").exists());
}
