//! Arguments, exit codes, help, and the smaller commands.

use crate::sites::{TestSite, plane, sunny_probe};
use crate::{done, heliodon, json, run};
use std::io::Read;
use std::process::Stdio;

const COMMANDS: &[&str] = &[
    "demo",
    "new",
    "check",
    "sky",
    "bake",
    "arrays",
    "export",
    "figures",
    "detail",
    "key",
    "lightmap",
    "script",
    "inspect",
    "bench",
    #[cfg(feature = "viewer")]
    "view",
    #[cfg(feature = "viewer")]
    "display",
    #[cfg(feature = "viewer")]
    "render",
];

#[test]
fn every_command_has_help_with_an_example() {
    let all = done(&[&"--help"]).out;
    for command in COMMANDS {
        assert!(all.contains(&format!("\n  {command}")), "{command} is not in the list");
        let help = done(&[command, &"--help"]).out;
        assert!(help.contains("Example") && help.contains(&format!("heliodon {command}")), "{command}: {help}");
        assert!(help.contains("--json") && help.contains("--threads"), "{command}");
    }
}

#[test]
fn wrong_arguments_end_with_two() {
    for arguments in [
        &["frobnicate"][..],
        &["bake"],
        &["bake", "site", "--frobnicate"],
        &["bake", "site", "--threads", "0"],
        &["export", "bundle", "--time", "25:00", "lit.glb"],
        &["export", "bundle", "--time", "10:00", "lit.obj"],
        &["sky"],
        &["detail"],
        &["detail", "stone"],
        &["detail", "marble", "-o", "a.png"],
        &["detail", "stone", "-o", "a.jpg"],
        &["detail", "stone", "-o", "a.png", "--picture", "a.png"],
        &["detail", "stone", "-o", "a.png", "--size", "100"],
        &["detail", "stone", "-o", "a.png", "--contrast", "nan"],
        &["detail", "stone", "-o", "a.png", "--knots", "1"],
        &["detail", "stone", "-o", "a.png", "--correct"],
        &["detail", "wall.png", "--size", "64"],
        &["detail", "wall.png", "--contrast", "15"],
        &["key"],
        &["key", "a.mp4", "--screen", "mauve"],
        &["key", "a.mp4", "--keep", "1,2,3"],
        &["key", "a.mp4", "--spill", "2"],
        &["key", "a.mp4", "--sheet", "look.jpg"],
        &["visibility", "a.obj", "--cache-frames-per-s", "30"],
        &["visibility", "a.obj", "--animation", "cache", "--cache", "a.pc2", "--cache-frames-per-s", "0"],
        &["bench", "nothing"],
        &["bench", "import"],
        #[cfg(feature = "viewer")]
        &["bench", "walk", "bundle", "--threshold-px", "nan"],
        &["new", "dir", "--template", "pyramid"],
    ] {
        let all: Vec<&dyn AsRef<std::ffi::OsStr>> = arguments.iter().map(|a| a as &dyn AsRef<std::ffi::OsStr>).collect();
        let ran = run(&all);
        assert_eq!(ran.code, 2, "{arguments:?}: {}", ran.err);
        assert!(ran.out.is_empty() && ran.err.contains("--help"), "{arguments:?}: {}", ran.err);
    }
}

#[test]
fn a_new_site_bakes_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let site = folder.path().join("grey");
    let made = json(&[&"new", &site, &"--template", &"grey", &"--triangles", &"2000"]);
    assert!((1800..=2200).contains(&made["triangles"].as_u64().unwrap()));
    let again = run(&[&"new", &site, &"--template", &"grey"]);
    assert_eq!(again.code, 1);
    assert!(again.err.contains("not empty"), "{}", again.err);
    let checked = json(&[&"check", &site]);
    assert_eq!(checked["triangles"], made["triangles"]);
    assert_eq!(checked["warnings"].as_array().unwrap().len(), 0, "{checked}");
    let baked = json(&[&"bake", &site]);
    assert_eq!(baked["counts"]["triangles"], made["triangles"]);
    let inspected = json(&[&"inspect", &site.join("bundle"), &"--verify"]);
    assert_eq!(inspected["counts"]["triangles"], made["triangles"]);
    let exported = json(&[&"export", &site.join("bundle"), &"--time", &"12:00", &folder.path().join("lit.glb")]);
    assert_eq!(exported["triangles"], made["triangles"]);
    assert_eq!(&std::fs::read(folder.path().join("lit.glb")).unwrap()[..4], b"glTF");
}

#[test]
fn an_estimate_bakes_nothing() {
    let site = TestSite::smallest(&plane(20));
    let estimate = json(&[&"bake", &site.folder(), &"--estimate"]);
    assert_eq!(estimate["vertices"], 441);
    assert!(estimate["seconds"].as_f64().unwrap() > 0.0 && estimate["gather_rays"].as_u64().unwrap() > 441 * 50);
    assert!(!site.path("bundle").exists() && !site.path(".heliodon").exists());
}

#[test]
fn the_sun_of_a_probe_is_found_and_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let probe = folder.path().join("sunny_1200.hdr");
    sunny_probe().write_hdr(&probe).unwrap();
    let picture = folder.path().join("sky.png");
    let lapse = json(&[&"sky", &probe, &"--mapping", &"lat-long", &"--picture", &picture]);
    let sun = &lapse["steps"][0]["sun"];
    let direction: Vec<f64> = sun["direction"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    // 45 degrees above the south: +Z
    let cos = (direction[1] + direction[2]) * 0.5_f64.sqrt();
    assert!(cos > 1.0_f64.to_radians().cos(), "{direction:?}");
    assert_eq!(lapse["steps"][0]["sky"].as_array().unwrap().len(), 4);
    assert_eq!(&std::fs::read(&picture).unwrap()[1..4], b"PNG");
    let table = done(&[&"sky", &probe, &"--mapping", &"lat-long"]).out;
    assert!(table.contains("12:00") || table.contains("azimuth"), "{table}");
}

#[test]
fn meshes_and_images_are_inspected() {
    let site = TestSite::smallest(&plane(3));
    let mesh = json(&[&"inspect", &site.path("mesh.obj")]);
    assert_eq!((mesh["kind"].as_str(), mesh["triangles"].as_u64()), (Some("mesh"), Some(18)));
    let image = json(&[&"inspect", &site.path("grey.hdr")]);
    assert_eq!((image["kind"].as_str(), image["width"].as_u64()), (Some("sky-image"), Some(32)));
    assert_eq!(json(&[&"inspect", &site.folder()])["kind"], "site");
    assert_eq!(run(&[&"inspect", &site.path("nothing.ply")]).code, 1);
}

#[test]
fn a_reader_who_leaves_early_is_no_failure() {
    let site = TestSite::smallest(&plane(3));
    let mut child =
        heliodon(&[&"inspect", &site.path("mesh.obj")]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let mut err = String::new();
    child.stderr.take().unwrap().read_to_string(&mut err).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0), "{err}");
    assert!(err.is_empty(), "{err}");
}

#[test]
#[cfg(target_os = "linux")]
fn an_output_that_takes_nothing_is_told() {
    let site = TestSite::smallest(&plane(3));
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    let output = heliodon(&[&"inspect", &site.path("mesh.obj")]).stdout(full).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("standard output"));
}

#[test]
fn check_says_what_is_odd_in_the_files_too() {
    let site = TestSite::smallest(&format!("mtllib stone.mtl\nusemtl wall\n{}", plane(2)));
    site.write("stone.mtl", "newmtl wall\nmap_Kd gone.png\n");
    site.edit("albedo = [0.5, 0.5, 0.5]\n", "");
    let warnings = json(&[&"check", &site.folder()])["warnings"].to_string();
    assert!(warnings.contains("gone.png"), "{warnings}");
    let ran = done(&[&"check", &site.folder()]);
    assert!(!ran.out.contains("Nothing is wrong"), "{}", ran.out);
    assert_eq!(ran.err.matches("gone.png").count(), 1, "told once: {}", ran.err);

    site.edit("role = \"scan\"", "role = \"ground\"\nrotate_deg = [180, 0, 0]");
    let warnings = json(&[&"check", &site.folder()])["warnings"].to_string();
    assert!(warnings.contains("look down"), "{warnings}");
}

#[test]
fn a_model_s_night_without_a_sunrise_is_told() {
    let site = TestSite::smallest(&plane(2));
    site.edit("[site]", "[site]\nlatitude_deg = 80\nlongitude_deg = 20");
    site.edit("probes = \"grey.hdr\"\nmapping = \"lat-long\"", "model = \"atmosphere\"\ndate = \"2006-12-21\"");
    site.edit("[bake]", "[bake]\nsun_steps = 2");
    let warnings = json(&[&"check", &site.folder()])["warnings"].to_string();
    assert!(warnings.contains("does not rise"), "{warnings}");
}

#[test]
fn faces_without_light_are_told_of_where_they_can_be_seen() {
    // two closed blocks, and a wall of one square: with its corners in both of them it is lit by its middle, all within one nobody sees it
    let block = |x: f32, first: usize| {
        let mut text = String::new();
        for i in 0..8 {
            let [dx, dy, dz] = [i & 1, i >> 1 & 1, i >> 2 & 1].map(|bit| bit as f32);
            text += &format!("v {} {} {}\n", x + dx, 4.0 * dy - 1.0, dz - 0.5);
        }
        for [a, b, c, d] in [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]] {
            text += &format!("f {} {} {} {}\n", first + a, first + b, first + c, first + d);
        }
        text
    };
    let walled = |end: f32| {
        let wall = format!("v 0.3 0 0\nv {end} 0 0\nv {end} 2 0\nv 0.3 2 0\nf 17 18 19 20\n");
        format!("{}{}{wall}", block(0.0, 0), block(5.0, 8))
    };
    // a carpet under a roof of one sheet, of which it sees the back
    let square = |side: f32, y: f32, first: usize| {
        let corners =
            [[-1, 1], [1, 1], [1, -1], [-1, -1]].map(|[x, z]| format!("v {} {y} {}\n", side * x as f32, side * z as f32));
        format!("{}f {} {} {} {}\n", corners.concat(), first, first + 1, first + 2, first + 3)
    };
    let roofed = format!("{}{}", square(2.0, 0.5, 1), square(0.5, 0.0, 5));
    for (obj, told) in [(walled(5.5), false), (walled(0.7), false), (roofed, true)] {
        let site = TestSite::smallest(&obj);
        let ran = done(&[&"bake", &site.folder()]);
        assert_eq!(ran.err.contains("4 vertices lie inside or behind something"), told, "{}", ran.err);
    }
}

#[test]
fn a_bundle_names_no_folder_outside_of_its_site() {
    let elsewhere = TestSite::smallest(&plane(2));
    let site = TestSite::smallest(&plane(2));
    let outside = elsewhere.path("mesh.obj");
    site.edit("mesh.obj", &outside.display().to_string());
    done(&[&"bake", &site.folder()]);
    let manifest = std::fs::read_to_string(site.path("bundle/manifest.json")).unwrap();
    assert!(!manifest.contains(&elsewhere.folder().display().to_string()), "{manifest}");
    assert!(json(&[&"bake", &site.folder()])["up_to_date"] == true);
}
