//! What work costs, told beforehand; the memory that it may take; and what a bundle was made of, told afterwards.

use crate::sites::{TestSite, plane, waves};
use crate::{done, json, run};

const ROOM: &str = "[[room]]\nname = \"loft\"\nmin = [0.2, 0.3, -0.8]\nmax = [0.8, 0.6, -0.2]\n";

fn prepared_site(cells: usize) -> TestSite {
    let site = TestSite::smallest(&waves(cells));
    site.write("second.obj", plane(6));
    let text = std::fs::read_to_string(site.path("site.toml")).unwrap();
    let second = "[[part]]\nfile = \"second.obj\"\nrole = \"ground\"\ntranslate = [1.5, 0.0, 0.0]\n";
    site.write("site.toml", format!("{text}{second}{ROOM}[prepare]\nedge_px = 40.0\n"));
    site
}

fn append(site: &TestSite, more: &str) {
    let text = std::fs::read_to_string(site.path("site.toml")).unwrap();
    site.write("site.toml", text + more);
}

#[test]
fn preparation_is_estimated_step_by_step_and_not_begun() {
    let site = prepared_site(60);
    let estimate = json(&[&"prepare", &site.folder(), &"--estimate"]);
    assert!(!site.path(".heliodon").exists());
    let names: Vec<&str> = estimate["steps"].as_array().unwrap().iter().map(|step| step["name"].as_str().unwrap()).collect();
    for name in ["reading", "cleaning", "simplifying", "counting what is seen", "purging", "measuring", "mapping"] {
        assert!(names.contains(&name), "{name}: {names:?}");
    }
    for step in estimate["steps"].as_array().unwrap() {
        assert!(step["seconds"].as_f64().unwrap() > 0.0 && step["memory_bytes"].as_u64().unwrap() > 1_000_000, "{step}");
    }
    let sum: f64 = estimate["steps"].as_array().unwrap().iter().map(|step| step["seconds"].as_f64().unwrap()).sum();
    assert!((sum - estimate["seconds"].as_f64().unwrap()).abs() < 1e-9 * sum);
    let text = done(&[&"prepare", &site.folder(), &"--estimate"]).out;
    assert!(text.contains("on disk after it") && text.contains("for the preparation on this machine"), "{text}");

    // a bake's estimate holds the same, and what comes then
    let bake = json(&[&"bake", &site.folder(), &"--estimate"]);
    assert!(!site.path(".heliodon").exists() && !site.path("bundle").exists());
    assert_eq!(bake["prepare"]["triangles_original"], estimate["triangles_original"]);
    assert_eq!(bake["vertices"], bake["prepare"]["vertices"]);
    assert!(bake["gather_rays"].as_u64() > bake["vertices"].as_u64());
    assert!(bake["memory_bytes"].as_u64() >= bake["prepare"]["memory_bytes"].as_u64());

    let report = json(&[&"prepare", &site.folder()]);
    let near = |what: &str, times: f64| {
        let (told, is) = (estimate[what].as_f64().unwrap(), report[what].as_f64().unwrap());
        assert!(told > is / times && told < is * times, "{what}: {told} for {is}");
    };
    assert_eq!(estimate["triangles_read"], report["triangles_read"]);
    near("triangles_original", 1.3);
    near("vertices", 3.0);
    // what is done is told as done, and a bake's estimate goes on from it
    assert_eq!(json(&[&"prepare", &site.folder(), &"--estimate"])["kept"], true);
    let bake = json(&[&"bake", &site.folder(), &"--estimate"]);
    assert_eq!((bake["prepare"].is_null(), &bake["vertices"]), (true, &report["vertices"]));
}

#[test]
fn textures_count_in_the_memory_of_a_bake() {
    let quad =
        "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 1 0 -1\nv 0 0 -1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    let site = TestSite::smallest(quad);
    site.edit("albedo = [0.5, 0.5, 0.5]\n", "");
    let memory = || json(&[&"bake", &site.folder(), &"--estimate"])["memory_bytes"].as_u64().unwrap();
    site.write("m.mtl", "newmtl m\n");
    let plain = memory();
    let side = 2048;
    site.write("t.png", heliodon_image::SrgbImage::filled(side, side, [90, 120, 80, 255]).to_png_bytes().unwrap());
    site.write("m.mtl", "newmtl m\nmap_Kd t.png\n");
    let more = memory() - plain;
    let texture = 4 * u64::from(side * side);
    // itself and the pyramid of its halves, or, where the light takes little, the copies that it takes to be written
    assert!((14 * texture / 10..4 * texture).contains(&more), "{more} of {texture}");
}

#[test]
fn preparation_stays_within_its_budget_or_is_not_begun() {
    let site = prepared_site(200);
    done(&[&"bake", &site.folder(), &"-o", &site.path("free")]);
    std::fs::remove_dir_all(site.path(".heliodon")).unwrap();
    append(&site, "[budget]\nbake_mib = 16\n");
    for command in ["prepare", "bake"] {
        let refused = run(&[&command, &site.folder()]);
        assert_eq!(refused.code, 1);
        for word in ["preparation would take about", "MiB", "bake_mib", "gives 16"] {
            assert!(refused.err.contains(word), "{word}: {}", refused.err);
        }
        assert!(!refused.err.contains("cleaning") && !site.path("bundle").exists(), "{}", refused.err);
    }
    let estimate = done(&[&"bake", &site.folder(), &"--estimate"]).out;
    assert!(estimate.contains("the bake would be refused: preparation would take about"), "{estimate}");
    site.edit("bake_mib = 16", "bake_mib = 40");
    let ran = done(&[&"prepare", &site.folder(), &"--threads", &"2"]);
    assert!(ran.err.contains("preparation stays within [budget] with 1 of 2 threads"), "{}", ran.err);
    // the light takes more, and goes on with what is prepared
    site.edit("bake_mib = 40", "bake_mib = 64");
    let ran = done(&[&"bake", &site.folder(), &"--threads", &"2"]);
    assert!(ran.err.contains("going on: the geometry is prepared"), "{}", ran.err);
    let geometry = |bundle: &str| std::fs::read(site.path(bundle).join("site.glb")).unwrap();
    assert!(geometry("bundle") == geometry("free"), "less at once makes the same");
}

#[test]
fn light_stays_within_its_budget_or_is_not_begun() {
    let site = TestSite::smallest(&waves(16));
    site.edit("samples = 64", "samples = 2048");
    done(&[&"bake", &site.folder(), &"-o", &site.path("free")]);
    append(&site, "[budget]\nbake_mib = 16\n");
    let refused = run(&[&"bake", &site.folder()]);
    assert!(refused.code == 1 && refused.err.contains("the light would take about"), "{}", refused.err);
    assert!(!refused.err.contains("sky transfer") && !site.path("bundle").exists(), "{}", refused.err);
    let why = || json(&[&"bake", &site.folder(), &"--estimate"])["refused"].as_str().map(str::to_owned);
    assert!(why().is_some_and(|why| refused.err.contains(&why)), "{}", refused.err);
    site.edit("bake_mib = 16", "bake_mib = 64");
    assert_eq!(why(), None);
    let ran = done(&[&"bake", &site.folder(), &"--threads", &"2"]);
    assert!(ran.err.contains("the light stays within [budget]") && ran.err.contains("read from the cache"), "{}", ran.err);
    let geometry = |bundle: &str| std::fs::read(site.path(bundle).join("site.glb")).unwrap();
    assert!(geometry("bundle") == geometry("free"), "what is not in memory is read again, with the same result");
    // shards keep what they like: the merge takes it all, whatever it keeps itself
    std::fs::remove_dir_all(site.path(".heliodon")).unwrap();
    let merged = site.path("merged");
    for shard in ["1/2", "2/2"] {
        done(&[&"bake", &site.folder(), &"-o", &merged, &"--shard", &shard]);
    }
    let report = json(&[&"merge", &site.folder(), &"-o", &merged]);
    let taken = report["taken"].as_array().unwrap().iter().find(|taken| taken["stage"] == "sky transfer").unwrap();
    assert!(taken["blocks"].as_u64().unwrap() > 0 && taken["blocks"] == taken["of"], "{taken}");
    assert!(geometry("merged") == geometry("free"));
}

#[test]
fn a_bundle_too_large_for_the_viewer_is_told() {
    let site = TestSite::smallest(&plane(8));
    append(&site, "[budget]\nviewer_mib = 4000\n");
    assert!(!done(&[&"check", &site.folder()]).err.contains("viewer"));
    site.edit("viewer_mib = 4000", "viewer_mib = 20");
    let told = "the viewer will need about";
    let check = json(&[&"check", &site.folder()]);
    let tells = |report: &serde_json::Value| {
        report["warnings"].as_array().unwrap().iter().any(|warning| warning.as_str().unwrap().contains(told))
    };
    assert!(tells(&check), "{check}");
    let baked = json(&[&"bake", &site.folder()]);
    assert!(tells(&baked), "{baked}");
}

#[test]
fn a_bundle_tells_what_it_was_made_of_and_whether_that_has_changed() {
    let site = prepared_site(24);
    done(&[&"bake", &site.folder()]);
    let report = json(&[&"prepare", &site.folder()]);
    let bundle = site.path("bundle");
    let text = done(&[&"inspect", &bundle]).out;
    for words in [
        "made by heliodon ",
        ", revision ",
        "second.obj: ",
        "as it is now",
        "prepare.edge_px = 40.0",
        "bake.samples = 64",
        "sky.mapping = \"lat-long\"",
        "found by cleaning: ",
        "open edges",
        "off the original by",
        "gather_rays = ",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    assert!(!text.contains("CHANGED") && !text.contains("NOT THERE"), "{text}");
    let summary = json(&[&"inspect", &bundle]);
    let parts = &summary["lineage"]["prepared"]["parts"];
    for (part, of_report) in parts.as_array().unwrap().iter().zip(report["parts"].as_array().unwrap()) {
        for key in ["triangles_read", "triangles_original", "triangles_drawn", "triangles_hidden"] {
            assert_eq!(part[key], of_report[key], "{key}");
        }
        assert_eq!(part["error"]["max_px"], of_report["error"]["from_original"]["max_px"]);
    }
    // one file has changed, one is gone; a bundle that stands elsewhere is told where its site is
    site.write("second.obj", plane(7));
    std::fs::remove_file(site.path("grey.hdr")).unwrap();
    let elsewhere = tempfile::tempdir().unwrap();
    let moved = elsewhere.path().join("bundle");
    std::fs::rename(&bundle, &moved).unwrap();
    let states = |arguments: &[&dyn AsRef<std::ffi::OsStr>]| {
        let summary = json(arguments);
        let inputs = summary["lineage"]["inputs"].as_array().unwrap().clone();
        ["mesh.obj", "second.obj", "grey.hdr"].map(|name| {
            let input = inputs.iter().find(|input| input["path"] == name).unwrap();
            assert_eq!(input["blake3"].as_str().unwrap().len(), 64);
            input["state"].as_str().map(str::to_owned)
        })
    };
    assert_eq!(states(&[&"inspect", &moved]), [const { None }; 3]);
    let of_site = states(&[&"inspect", &moved, &"--site", &site.folder()]);
    assert_eq!(of_site.each_ref().map(Option::as_deref), [Some("same"), Some("changed"), Some("missing")]);
    let refused = run(&[&"inspect", &moved, &"--site", &elsewhere.path()]);
    assert!(refused.code == 1 && refused.err.contains("no site is there"), "{}", refused.err);
    assert_eq!(run(&[&"inspect", &site.path("mesh.obj"), &"--site", &site.folder()]).code, 1);
}

#[test]
fn steps_of_preparation_tell_how_far_they_are_and_flood_nothing() {
    let site = prepared_site(120);
    let ran = done(&[&"prepare", &site.folder()]);
    let lines: Vec<&str> = ran.err.lines().collect();
    for step in
        ["reading (", "cleaning (28,800)", "simplifying (28,800)", "measuring (28,800)", "mapping (28,800)", "purging ("]
    {
        assert!(lines.iter().any(|line| line.starts_with(step)), "{step}: {}", ran.err);
    }
    let ends = lines.iter().filter(|line| line.contains("): ") || line.ends_with(" s")).count();
    assert!(lines.len() < 60 && ends > 10, "{}", ran.err);
}
