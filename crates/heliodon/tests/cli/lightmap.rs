//! `heliodon lightmap`: light in texels, as files.

use crate::{done, run};
use heliodon_image::{HdrImage, SrgbImage, from_rgbe8};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A square metre of ground under a clear sky at Athens.
fn ground(folder: &Path) -> PathBuf {
    fs::write(folder.join("ground.obj"), "v 0 0 0\nv 1 0 0\nv 1 0 -1\nv 0 0 -1\nf 1 2 3 4\n").unwrap();
    let site = "[site]\nname = \"Ground\"\nlatitude_deg = 38.0\nlongitude_deg = 23.7\nutc_offset = \"+02:00\"\n\
                [[part]]\nfile = \"ground.obj\"\nrole = \"ground\"\nalbedo = [0.5, 0.4, 0.3]\n\
                [sky]\nmodel = \"atmosphere\"\ndate = \"2003-03-21\"\n[bake]\nbounces = 1\n";
    fs::write(folder.join("site.toml"), site).unwrap();
    folder.to_owned()
}

#[test]
fn open_ground_has_all_of_an_even_sky_in_every_kind() {
    let folder = TempDir::new().unwrap();
    let site = ground(folder.path());
    let out = folder.path().join("out");
    let said = done(&[
        &"lightmap",
        &site,
        &"--sky",
        &"even",
        &"--size",
        &"64",
        &"--kind",
        &"exr,ktx2,rgbe,combined",
        &"-o",
        &out,
        &"--json",
    ]);
    let report: Value = serde_json::from_str(&said.out).unwrap();
    assert!((report["notes"]["mean"][0].as_f64().unwrap() - 1.0).abs() < 1e-3, "{report}");
    let exr = HdrImage::read(out.join("light.exr")).unwrap();
    let rgbe = from_rgbe8(&SrgbImage::read(out.join("light.rgbe.png")).unwrap());
    for image in [&exr, &rgbe] {
        assert_eq!((image.width, image.height), (64, 64));
        assert!(image.pixels.iter().all(|p| (p.x - 1.0).abs() < 5e-3), "what no texel covers is filled too");
    }
    assert_eq!(&fs::read(out.join("light.ktx2")).unwrap()[1..7], b"KTX 20");
    for name in ["model.glb", "lit.glb"] {
        let glb = fs::read(out.join(name)).unwrap();
        let text = String::from_utf8_lossy(&glb);
        assert!(text.starts_with("glTF") && text.contains("TEXCOORD_1"), "{name}");
    }
    let kept: Value = serde_json::from_slice(&fs::read(out.join("lightmap.json")).unwrap()).unwrap();
    assert_eq!(kept, report);
}

#[test]
fn the_site_s_sky_and_lights_of_a_file_add_up() {
    let folder = TempDir::new().unwrap();
    let site = ground(folder.path());
    let lamps = folder.path().join("lamps.toml");
    fs::write(&lamps, "[[light]]\nkind = \"point\"\nplace = [0.5, 2.0, -0.5]\namount = { intensity_cd = 4000.0 }\n").unwrap();
    let mean = |more: &[&str]| {
        let mut arguments: Vec<&dyn AsRef<std::ffi::OsStr>> = vec![&"lightmap", &site, &"--size", &"64", &"--json"];
        arguments.extend(more.iter().map(|argument| argument as &dyn AsRef<std::ffi::OsStr>));
        let report: Value = serde_json::from_str(&done(&arguments).out).unwrap();
        report["notes"]["mean"][1].as_f64().unwrap()
    };
    let lamps = lamps.to_str().unwrap();
    let (sky, lamp) = (mean(&["--time", "12:00"]), mean(&["--sky", "none", "--lights", lamps]));
    let both = mean(&["--time", "12:00", "--lights", lamps]);
    // straight below it 4 kcd over pi and 4 square metres, a little less at the corners
    assert!(lamp > 0.25 && lamp < 0.32, "{lamp}");
    assert!(sky > 5.0 && (both / (sky + lamp) - 1.0).abs() < 0.01, "{sky}, {lamp}, {both}");
}

#[test]
fn what_is_wrong_is_told_before_anything_is_written() {
    let folder = TempDir::new().unwrap();
    let site = ground(folder.path());
    let lamps = folder.path().join("lamps.toml");
    let out = folder.path().join("out");
    let refused = |text: &str, says: &[&str]| {
        fs::write(&lamps, text).unwrap();
        let ran = run(&[&"lightmap", &site, &"--lights", &lamps, &"-o", &out]);
        assert!(ran.code == 1 && says.iter().all(|says| ran.err.contains(says)), "{}", ran.err);
        assert!(!out.exists());
    };
    refused(
        "[[light]]\nkind = \"point\"\nname = \"flame\"\nplace = [0, 1, 0]\namount = { flux_lm = -3.0 }\n",
        &["flame", "flux_lm", "-3"],
    );
    refused("[[light]]\nkind = \"point\"\nplace = [0, nan, 0]\namount = { flux_lm = 3.0 }\n", &["place"]);
    refused("[[light]]\nkind = \"ies\"\nfile = \"none.ies\"\nplace = [0, 1, 0]\n", &["none.ies"]);
    refused("[[light]]\nkind = \"glow\"\n", &["lamps.toml", "glow"]);
    let ran = run(&[&"lightmap", &site, &"--sky", &"even", &"--time", &"10:00"]);
    assert!(ran.code == 2 && ran.err.contains("--time"), "{}", ran.err);
}

/// A square on the ground, `side` metres large, its least corner there.
fn square(file: &Path, [x, y, z]: [f64; 3], side: f64) {
    let corners = [[x, z], [x + side, z], [x + side, z - side], [x, z - side]];
    let vertices: String = corners.iter().map(|[x, z]| format!("v {x:.6} {y:.6} {z:.6}\n")).collect();
    fs::write(file, vertices + "f 1 2 3 4\n").unwrap();
}

/// The report of a light map of two squares: `parts` is what both say of themselves, `more` what else the site says.
fn two_squares(sides: [f64; 2], parts: [&str; 2], more: &str, arguments: &[&str]) -> Value {
    let folder = TempDir::new().unwrap();
    let site = ground(folder.path());
    square(&site.join("one.obj"), [0.0; 3], sides[0]);
    square(&site.join("other.obj"), [60.0, 0.0, 0.0], sides[1]);
    let part = |(file, own): (&str, &str)| {
        format!("[[part]]\nfile = \"{file}.obj\"\nrole = \"ground\"\nalbedo = [0.5, 0.5, 0.5]\n{own}\n")
    };
    let both: String = ["one", "other"].into_iter().zip(parts).map(part).collect();
    let site_of = |bake: &str| {
        format!(
            "[site]\nname = \"Two\"\nlatitude_deg = 38.0\nlongitude_deg = 23.7\nutc_offset = \"+02:00\"\n{both}\
             [sky]\nmodel = \"atmosphere\"\ndate = \"2003-03-21\"\n{bake}"
        )
    };
    fs::write(site.join("site.toml"), site_of(more)).unwrap();
    let mut all: Vec<&dyn AsRef<std::ffi::OsStr>> =
        vec![&"lightmap", &site, &"--sky", &"even", &"--size", &"128", &"--samples", &"64", &"--bounces", &"0", &"--json"];
    all.extend(arguments.iter().map(|argument| argument as &dyn AsRef<std::ffi::OsStr>));
    serde_json::from_str(&done(&all).out).unwrap()
}

#[test]
fn parts_have_as_many_texels_as_they_ask_for_and_as_rooms_are_near() {
    let per_m = |parts: [&str; 2], more: &str| two_squares([1.0; 2], parts, more, &[])["texels_per_m"].as_f64().unwrap();
    // side by side in 128 texels
    let alike = per_m(["", ""], "");
    assert!((55.0..65.0).contains(&alike), "{alike}");
    let four = per_m(["texels = 4.0", ""], "");
    assert!((20.0..26.0).contains(&four), "four times as long, and a strip of 1 beside it: {four}");
    // 40 times as far as what counts as near would be a 64th at least
    let room = "[[room]]\nname = \"hall\"\nmin = [0.0, 0.0, -1.0]\nmax = [1.0, 3.0, 0.0]\n";
    let near = per_m(["", ""], room);
    assert!(near > 1.7 * alike, "{near}: what lies 59 metres off has a fifteenth");
}

#[test]
fn the_parts_that_a_bake_lights_by_texels_have_them() {
    let charts =
        |sides: [f64; 2], parts: [&str; 2], more: &str| two_squares(sides, parts, more, &[])["charts"].as_u64().unwrap();
    assert_eq!(charts([1.0, 0.1], ["", ""], ""), 2, "nothing is said: all");
    assert_eq!(charts([1.0, 0.1], ["", "light = \"texel\""], ""), 1);
    assert_eq!(charts([1.0, 0.1], ["light = \"vertex\"", ""], ""), 1);
    assert_eq!(charts([1.0, 0.1], ["", ""], "[bake]\ntexels = 256\n"), 1, "the small one is lit at its corners");
    assert_eq!(charts([0.1, 0.1], ["", ""], "[bake]\ntexels = 256\n"), 2, "or else there would be no light map");
    assert_eq!(charts([0.1, 1.0], ["light = \"texel\"", ""], "[bake]\ntexels = 256\n"), 2);
}

#[test]
fn levels_and_samples_are_as_asked_for() {
    let of = |arguments: &[&str]| two_squares([1.0; 2], ["", ""], "", arguments);
    let plain = of(&[]);
    assert_eq!((plain["levels"].as_u64(), plain["light_samples"].as_u64()), (Some(1), Some(256)));
    let wide = of(&["--margin", "10", "--light-samples", "64"]);
    assert_eq!((wide["levels"].as_u64(), wide["light_samples"].as_u64()), (Some(3), Some(64)));
}

#[test]
fn meshes_that_shine_stand_where_the_parts_do_far_from_the_origin() {
    let mean = |origin: [f64; 3]| {
        let folder = TempDir::new().unwrap();
        let site = ground(folder.path());
        square(&site.join("ground.obj"), origin, 1.0);
        // it shines down as well
        square(&site.join("lamp.obj"), [origin[0] + 0.3, origin[1] + 0.2, origin[2] - 0.3], 0.4);
        let text = fs::read_to_string(site.join("site.toml")).unwrap();
        fs::write(site.join("site.toml"), text.replace("[site]\n", &format!("[site]\norigin = {origin:?}\n"))).unwrap();
        let lamps = site.join("lamps.toml");
        fs::write(&lamps, "[[light]]\nkind = \"mesh\"\nfile = \"lamp.obj\"\ntwo_sided = true\namount = { radiance = 1.0 }\n")
            .unwrap();
        let ran = done(&[&"lightmap", &site, &"--sky", &"none", &"--lights", &lamps, &"--size", &"64", &"--json"]);
        let report: Value = serde_json::from_str(&ran.out).unwrap();
        report["notes"]["mean"][0].as_f64().unwrap()
    };
    let (near, far) = (mean([0.0; 3]), mean([476_000.25, 120.0, -4_202_000.5]));
    assert!(near > 0.05 && (far / near - 1.0).abs() < 0.01, "{near} and {far}");
}
