//! `heliodon sky`: what it writes, and what it does not write over.

use crate::sites::{TestSite, plane, sunny_probe};
use crate::{contents, done, json, run};
use heliodon_image::HdrImage;
use std::path::{Path, PathBuf};

/// Three probes as a user names them who follows the help's example.
fn probes(folder: &Path) -> Vec<PathBuf> {
    std::fs::create_dir_all(folder).unwrap();
    let probe = |(hour, radiance): (u32, f32)| {
        let path = folder.join(format!("{hour:04}.hdr"));
        HdrImage::filled(32, 16, glam::Vec3::splat(radiance)).write_hdr(&path).unwrap();
        path
    };
    // 00:01 and on, as maps are named
    [(1, 1.0), (2, 2.0), (4, 4.0)].map(probe).to_vec()
}

#[test]
fn maps_go_into_a_folder_of_their_own_and_never_over_the_probes() {
    let home = tempfile::tempdir().unwrap();
    let given = probes(&home.path().join("sky"));
    let before = contents(&home.path().join("sky"));
    let lapse = home.path().join("day.json");
    let sky = |more: &[&str]| {
        let mut all: Vec<&dyn AsRef<std::ffi::OsStr>> = vec![&"sky", &"--mapping", &"lat-long"];
        all.extend(given.iter().map(|path| path as &dyn AsRef<std::ffi::OsStr>));
        all.extend(more.iter().map(|word| word as &dyn AsRef<std::ffi::OsStr>));
        run(&all)
    };
    let wrote = sky(&["-o", lapse.to_str().unwrap()]);
    assert_eq!(wrote.code, 0, "{}", wrote.err);
    assert_eq!(contents(&home.path().join("sky")), before);
    let text: serde_json::Value = serde_json::from_slice(&std::fs::read(&lapse).unwrap()).unwrap();
    for step in text["steps"].as_array().unwrap() {
        assert!(home.path().join(step["sky_map"].as_str().unwrap()).is_file(), "{step}");
    }
    let maps: Vec<String> = contents(&home.path().join("day.sky")).into_iter().map(|(name, _)| name).collect();
    assert_eq!(maps, ["0001.hdr", "0002.hdr", "0003.hdr", "found.png"]);

    // again, from fewer: no map of the first run stays
    let alone = done(&[&"sky", &given[0], &"--mapping", &"lat-long", &"-o", &lapse]);
    assert!(alone.out.contains("12:00"), "{}", alone.out);
    assert_eq!(contents(&home.path().join("day.sky")).len(), 2);

    // inputs as targets, and folders that hold something else
    let good = contents(home.path());
    for (output, words) in
        [("sky/0001.hdr", "written over"), ("none/day.json", "there is no folder"), ("sky", "a folder has that name")]
    {
        let refused = sky(&["-o", home.path().join(output).to_str().unwrap()]);
        assert_eq!(refused.code, 1, "{output}: {}", refused.err);
        assert!(refused.err.contains(words), "{output}: {}", refused.err);
        assert_eq!(contents(home.path()), good, "{output}");
    }
    let refused = sky(&["--picture", given[1].to_str().unwrap()]);
    assert!(refused.code == 1 && refused.err.contains("written over"), "{}", refused.err);
    std::fs::write(home.path().join("day.sky/thesis.txt"), "ten years").unwrap();
    let refused = sky(&["-o", lapse.to_str().unwrap()]);
    assert!(refused.code == 1 && refused.err.contains("thesis.txt"), "{}", refused.err);
}

#[test]
fn a_lapse_from_its_own_maps_is_refused_and_a_failure_leaves_the_old_one() {
    let home = tempfile::tempdir().unwrap();
    let lapse = home.path().join("day.json");
    let given = probes(home.path());
    done(&[&"sky", &given[0], &given[1], &"--mapping", &"lat-long", &"-o", &lapse]);
    let map = home.path().join("day.sky/0001.hdr");
    let refused = run(&[&"sky", &map, &"--mapping", &"lat-long", &"-o", &lapse]);
    assert!(refused.code == 1 && refused.err.contains("written over"), "{}", refused.err);
    // the second probe is damaged: found only after the first map is written
    let good = std::fs::read(&given[1]).unwrap();
    std::fs::write(&given[1], &good[..good.len() / 2]).unwrap();
    let before = contents(home.path());
    let failed = run(&[&"sky", &given[0], &given[1], &"--mapping", &"lat-long", &"-o", &lapse]);
    assert_eq!(failed.code, 1, "{}", failed.err);
    assert_eq!(contents(home.path()), before);
}

#[test]
fn what_a_sky_is_asked_for_in_vain_is_told() {
    let site = TestSite::smallest(&plane(2));
    let missing = run(&[&"sky", &site.path("nosuchsite")]);
    assert_eq!(missing.code, 1, "{}", missing.err);
    assert!(missing.err.contains("nosuchsite") && !missing.err.contains("--mapping"), "{}", missing.err);
    for option in ["--turn", "--opening"] {
        let refused = run(&[&"sky", &site.folder(), &option, &"90"]);
        assert_eq!(refused.code, 2, "{}", refused.err);
        assert!(refused.err.contains(option), "{}", refused.err);
    }
    let probe = site.path("grey.hdr");
    assert_eq!(run(&[&"sky", &probe]).code, 2);
    let refused = run(&[&"sky", &probe, &"--mapping", &"lat-long", &"--opening", &"90"]);
    assert!(refused.code == 2 && refused.err.contains("fisheye"), "{}", refused.err);
}

#[test]
fn places_and_clocks_that_do_not_belong_together_are_told() {
    let warnings = |lines: &str| {
        let site = TestSite::smallest(&plane(2));
        site.edit("[site]", &format!("[site]\nlatitude_deg = 37.97\n{lines}"));
        site.edit("probes = \"grey.hdr\"\nmapping = \"lat-long\"", "model = \"atmosphere\"\ndate = \"2006-06-21\"");
        site.edit("[bake]", "[bake]\nsun_steps = 1\nsky_steps = 1");
        json(&[&"check", &site.folder()])["warnings"].to_string()
    };
    assert!(warnings("longitude_deg = 23.7").contains("no utc_offset"));
    assert!(warnings("longitude_deg = -23.7\nutc_offset = \"+03:00\"").contains("east is positive"));
    // a single step, at dawn, has no sun, whatever the clocks say
    for right in
        ["longitude_deg = 23.7\nutc_offset = \"+03:00\"", "longitude_deg = 0.1", "longitude_deg = -9\nutc_offset = \"+02:00\""]
    {
        let told = warnings(right);
        assert!(!told.contains("utc_offset"), "{right}: {told}");
    }
}

#[test]
fn a_probe_alone_has_one_step_everywhere() {
    let site = TestSite::smallest(&plane(20));
    let ran = done(&[&"bake", &site.folder(), &"--estimate", &"--json"]);
    let estimate: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    assert_eq!(estimate["mask_rays"], 0, "a grey sky has no sun");
    // 36 bytes and one word of mask and 4 coefficients for a vertex, 6 for a triangle
    assert_eq!(estimate["bundle_bytes"], 441 * (36 + 4 + 16) + 800 * 6);
    let baked = done(&[&"bake", &site.folder()]);
    assert!(!baked.err.contains("184"), "{}", baked.err);
    sunny_probe().write_hdr(site.path("grey.hdr")).unwrap();
    let estimate = json(&[&"bake", &site.folder(), &"--estimate"]);
    let rays = estimate["mask_rays"].as_u64().unwrap();
    assert!((441..92 * 441).contains(&rays), "one sun: {rays}");
}
