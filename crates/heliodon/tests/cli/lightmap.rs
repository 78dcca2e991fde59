//! `heliodon lightmap`: light in texels, as files.

use crate::{contents, done, run};
use heliodon_image::{HdrImage, SrgbImage, from_rgbe8};
use heliodon_math::color::luminance;
use heliodon_mesh::import::{ImportOptions, read};
use heliodon_testkit::gltf::{Glb, assert_valid};
use serde_json::Value;
use std::ffi::OsStr;
use std::fmt::Write;
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

/// The report of a light map of 64 texels a side, and its light.
pub fn solved(site: &Path, more: &[&str]) -> (Value, HdrImage) {
    let out = site.join("out");
    let mut arguments: Vec<&dyn AsRef<OsStr>> = vec![&"lightmap", &site, &"--size", &"64", &"-o", &out, &"--json"];
    arguments.extend(more.iter().map(|argument| argument as &dyn AsRef<OsStr>));
    let report = serde_json::from_str(&done(&arguments).out).unwrap();
    (report, HdrImage::read(out.join("light.exr")).unwrap())
}

pub fn mean(report: &Value) -> f64 {
    report["notes"]["mean"][0].as_f64().unwrap()
}

/// Writes a file with a lamp two metres above the middle of the ground, and tells its name.
fn lamp(site: &Path) -> String {
    let lamps = site.join("lamps.toml");
    fs::write(&lamps, "[[light]]\nkind = \"point\"\nplace = [0.5, 2.0, -0.5]\namount = { intensity_cd = 4000.0 }\n").unwrap();
    lamps.to_str().unwrap().to_owned()
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
    let (lamps, mean) = (lamp(&site), |more: &[&str]| mean(&solved(&site, more).0));
    let (sky, lamp) = (mean(&["--time", "12:00"]), mean(&["--sky", "none", "--lights", &lamps]));
    let both = mean(&["--time", "12:00", "--lights", &lamps]);
    // straight below it 4 kcd over pi and 4 square metres, a little less at the corners
    assert!(lamp > 0.25 && lamp < 0.32, "{lamp}");
    assert!(sky > 5.0 && (both / (sky + lamp) - 1.0).abs() < 0.01, "{sky}, {lamp}, {both}");
}

#[test]
fn a_file_of_lights_says_what_a_lumen_is() {
    let folder = TempDir::new().unwrap();
    let site = ground(folder.path());
    let lit_by = |unit: &str, amount: &str| {
        let lamps = lamp(&site);
        let text = fs::read_to_string(&lamps).unwrap().replace("intensity_cd = 4000.0", amount);
        fs::write(&lamps, format!("{unit}{text}")).unwrap();
        mean(&solved(&site, &["--sky", "none", "--lights", &lamps]).0)
    };
    let (house, radiance) = (lit_by("", "intensity_cd = 4000.0"), "lumens_per_unit = 179.0\n");
    let brighter = lit_by(radiance, "intensity_cd = 4000.0") / house;
    assert!((brighter / (1000.0 / 179.0) - 1.0).abs() < 1e-3, "{brighter}");
    let as_it_stands = lit_by(radiance, "radiant_intensity = 4.0") / house;
    assert!((as_it_stands - 1.0).abs() < 1e-3, "{as_it_stands}");
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
    let point = "[[light]]\nkind = \"point\"\nplace = [0, 1, 0]\namount = { flux_lm = 3.0 }\n";
    for wrong in ["0.0", "-1000.0", "inf", "nan"] {
        refused(&format!("lumens_per_unit = {wrong}\n{point}"), &["lamps.toml", "lumens_per_unit"]);
    }
    refused(&format!("lumens_per_unit = \"1\"\n{point}"), &["lamps.toml", "lumens_per_unit"]);
}

#[test]
fn what_is_read_is_not_written_over_and_the_place_is_looked_at_first() {
    let folder = TempDir::new().unwrap();
    let site = three_parts(folder.path());
    let text = fs::read_to_string(site.join("site.toml")).unwrap();
    let taken = |name: &str, arguments: &[&str]| {
        let out = site.join("hall");
        let before = contents(&site);
        let mut all: Vec<&dyn AsRef<OsStr>> = vec![&"lightmap", &site, &"--sky", &"even", &"-o", &out];
        all.extend(arguments.iter().map(|argument| argument as &dyn AsRef<OsStr>));
        let ran = run(&all);
        assert!(ran.code == 1 && ran.err.contains(name), "{name}: {}", ran.err);
        assert_eq!(contents(&site), before, "{name}");
    };
    solved(&site, &["--sky", "even", "--samples", "64"]);
    fs::create_dir(site.join("hall")).unwrap();
    fs::rename(site.join("out/model.glb"), site.join("hall/model.glb")).unwrap();
    fs::write(site.join("site.toml"), text.replace("\"step.obj\"", "\"hall/model.glb\"")).unwrap();
    taken("model.glb would be written over", &[]);
    // a mesh that shines
    fs::rename(site.join("hall/model.glb"), site.join("hall/lit.glb")).unwrap();
    let lamps = site.join("hall/lightmap.json");
    fs::write(site.join("site.toml"), &text).unwrap();
    let mesh = "[[light]]\nkind = \"mesh\"\nfile = \"lit.glb\"\namount = { radiance = 1.0 }\n";
    fs::write(&lamps, mesh).unwrap();
    taken("lit.glb would be written over", &["--lights", lamps.to_str().unwrap(), "--kind", "combined"]);
    fs::remove_file(&lamps).unwrap();
    // what is not written may be read
    fs::write(site.join("site.toml"), text.replace("\"step.obj\"", "\"hall/lit.glb\"")).unwrap();
    let out = site.join("hall");
    done(&[&"lightmap", &site, &"--sky", &"even", &"--size", &"64", &"--samples", &"64", &"-o", &out]);
    fs::write(site.join("site.toml"), &text).unwrap();
    // a folder in a file's place is found before the light is solved
    fs::remove_dir_all(site.join("hall")).unwrap();
    fs::create_dir_all(site.join("hall/light-2.exr")).unwrap();
    taken("light-2.exr: a folder has that name", &["--textures", "2", "--samples", "1048576", "--error", "0.0001"]);
    fs::remove_dir_all(site.join("hall")).unwrap();
    fs::write(site.join("file"), "").unwrap();
    let refused = run(&[&"lightmap", &site, &"-o", &site.join("file")]);
    assert!(refused.code == 1 && refused.err.contains("the folder cannot be made"), "{}", refused.err);
}

#[test]
fn what_would_do_nothing_is_refused() {
    let folder = TempDir::new().unwrap();
    let site = ground(folder.path());
    for (arguments, says) in [
        ("--sky even --time 10:00", "--time"),
        ("--sky none --sharp-sun", "--sharp-sun"),
        ("--radiance 2", "--radiance"),
        ("--sky none --radiance 1", "--radiance"),
        ("--exposure 1", "--exposure"),
        ("--exposure auto --kind exr,ktx2", "--exposure"),
        ("--model sky --bounces 0", "--bounces"),
        ("--model sky --lights none.toml", "--lights"),
        ("--model occlusion --lights none.toml", "--lights"),
        ("--model occlusion --sharp-sun", "--sharp-sun"),
        ("--model occlusion --time 10:00", "--time"),
        ("--model occlusion --sky even --radiance 2", "--radiance"),
    ] {
        let out = site.join("out");
        let mut all: Vec<&dyn AsRef<OsStr>> = vec![&"lightmap", &site, &"-o", &out];
        let more: Vec<&str> = arguments.split(' ').collect();
        all.extend(more.iter().map(|argument| argument as &dyn AsRef<OsStr>));
        let ran = run(&all);
        assert!(ran.code == 2 && ran.err.contains(says) && !out.exists(), "{arguments}: {}", ran.err);
    }
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
    let mut all: Vec<&dyn AsRef<OsStr>> =
        vec![&"lightmap", &site, &"--sky", &"even", &"--size", &"128", &"--samples", &"64", &"--bounces", &"0", &"--json"];
    all.extend(arguments.iter().map(|argument| argument as &dyn AsRef<OsStr>));
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
    let charts_with = |sides: [f64; 2], parts: [&str; 2], more: &str, arguments: &[&str]| {
        two_squares(sides, parts, more, arguments)["charts"].as_u64().unwrap()
    };
    let charts = |sides, parts, more| charts_with(sides, parts, more, &[]);
    assert_eq!(charts([1.0, 0.1], ["", ""], ""), 2, "nothing is said: all");
    assert_eq!(charts([1.0, 0.1], ["", "light = \"texel\""], ""), 1);
    assert_eq!(charts([1.0, 0.1], ["light = \"vertex\"", ""], ""), 1);
    assert_eq!(charts([1.0, 0.1], ["", ""], "[bake]\ntexels = 256\n"), 1, "the small one is lit at its corners");
    assert_eq!(charts([0.1, 0.1], ["", ""], "[bake]\ntexels = 256\n"), 2, "or else there would be no light map");
    assert_eq!(charts([0.1, 1.0], ["light = \"texel\"", ""], "[bake]\ntexels = 256\n"), 2);
    let every = |parts, more| charts_with([1.0, 0.1], parts, more, &["--every-part"]);
    assert_eq!(every(["", ""], "[bake]\ntexels = 256\n"), 2, "the small one too");
    assert_eq!(every(["light = \"texel\"", ""], ""), 2);
    assert_eq!(every(["", "light = \"vertex\""], ""), 1);
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

#[test]
fn an_overcast_sky_is_three_times_as_bright_above() {
    let folder = TempDir::new().unwrap();
    let site = ground(folder.path());
    // the horizon has a third of the zenith's radiance: 7/9 of it in the mean
    for (radiance, expected) in [("1", 7.0 / 9.0), ("3", 7.0 / 3.0)] {
        let (report, _) = solved(&site, &["--sky", "overcast", "--radiance", radiance]);
        assert!((mean(&report) / expected - 1.0).abs() < 0.005, "{report}");
    }
}

#[test]
fn models_leave_out_what_they_do_not_know() {
    let folder = TempDir::new().unwrap();
    let site = ground(folder.path());
    let text = fs::read_to_string(site.join("site.toml")).unwrap();
    let lamp = "[[light]]\nplace = [0.5, 2.0, -0.5]\nintensity = [4.0, 4.0, 4.0]\n";
    fs::write(site.join("site.toml"), format!("{text}{lamp}")).unwrap();
    let has_lights = |report: &Value| !report["lights"].as_array().unwrap().is_empty();
    let (sky, _) = solved(&site, &["--model", "sky", "--sky", "even", "--radiance", "2"]);
    assert!((mean(&sky) - 2.0).abs() < 2e-3 && sky["notes"]["illumination"] == "sky only" && !has_lights(&sky), "{sky}");
    let (own, _) = solved(&site, &["--model", "sky", "--time", "12:00"]);
    assert!(own["sky"].as_str().unwrap().contains("12:00") && !has_lights(&own), "nor is its sun: {own}");
    let (open, _) = solved(&site, &["--model", "occlusion"]);
    assert!((mean(&open) - 1.0).abs() < 1e-3 && open["notes"]["illumination"] == "occlusion only", "{open}");
    assert!(open["sky"] == "no sky" && !has_lights(&open), "{open}");
    fs::write(site.join("site.toml"), text).unwrap();
    assert!(open["notes"]["denoised"] == false && sky["notes"]["denoised"] == false);
    let (smooth, _) = solved(&site, &["--sky", "even", "--denoise"]);
    assert!((mean(&smooth) - 1.0).abs() < 1e-3 && smooth["notes"]["denoised"] == true, "{smooth}");
}

#[test]
fn lamps_of_the_site_are_as_a_bake_takes_them() {
    let folder = TempDir::new().unwrap();
    let site = ground(folder.path());
    let text = fs::read_to_string(site.join("site.toml")).unwrap();
    let lit_by = |lights: &str| {
        fs::write(site.join("site.toml"), format!("{text}{lights}")).unwrap();
        let out = site.join("out");
        let ran = done(&[&"lightmap", &site, &"--sky", &"none", &"--size", &"64", &"-o", &out, &"--json"]);
        (serde_json::from_str::<Value>(&ran.out).unwrap(), ran.err)
    };
    let place = "place = [0.5, 2.0, -0.5]";
    let lamp = format!("[[light]]\n{place}\nintensity = [4.0, 4.0, 4.0]\n");
    let off = format!("[[light]]\nname = \"off\"\n{place}\nintensity = [0.0, 0.0, 0.0]\nreach_m = 1.0\n");
    let (plain, silent) = lit_by(&lamp);
    assert!(mean(&plain) > 0.25 && !silent.contains("for the viewer alone"), "{plain} {silent}");
    let (with_off, silent) = lit_by(&format!("{off}{lamp}"));
    assert_eq!((mean(&with_off), &with_off["lights"]), (mean(&plain), &plain["lights"]), "a lamp that is off is none");
    assert!(!silent.contains("light off"), "{silent}");
    let (short, told) = lit_by(&format!("{off}{lamp}shadows = false\nreach_m = 1.0\n"));
    assert_eq!(mean(&short), mean(&plain), "it reaches the ground two metres below all the same");
    assert!(["light 2", "shadows = false", "reach_m = 1"].iter().all(|says| told.contains(says)), "{told}");
}

/// The ground below slats half a metre wide and as far apart, five metres up.
fn slats(folder: &Path) -> PathBuf {
    let site = ground(folder);
    let mut text = String::new();
    for i in 0..40 {
        let x = f64::from(i) - 20.0;
        let corners = [[x, 20.0], [x + 0.5, 20.0], [x + 0.5, -20.0], [x, -20.0]];
        corners.iter().for_each(|[x, z]| writeln!(text, "v {x} 5 {z}").unwrap());
        writeln!(text, "f {} {} {} {}", 4 * i + 1, 4 * i + 2, 4 * i + 3, 4 * i + 4).unwrap();
    }
    fs::write(site.join("slats.obj"), text).unwrap();
    let above = "[[part]]\nfile = \"slats.obj\"\nlight = \"vertex\"\n[sky]\n";
    let text = fs::read_to_string(site.join("site.toml")).unwrap().replace("[sky]\n", above);
    fs::write(site.join("site.toml"), text).unwrap();
    site
}

#[test]
fn a_sharp_sun_s_shadows_end_within_a_texel() {
    let folder = TempDir::new().unwrap();
    let site = slats(folder.path());
    let steepest = |more: &[&str]| {
        let (_, light) = solved(&site, &[&["--time", "12:00", "--bounces", "0"][..], more].concat());
        let beside = |x: u32, y: u32| [(x - 1, y), (x, y - 1)].map(|(a, b)| (light.pixel(x, y) - light.pixel(a, b)).x.abs());
        (1..64).flat_map(|y| (1..64).flat_map(move |x| beside(x, y))).fold(0.0, f32::max)
    };
    // over six metres the sun's disc blurs an edge over as many centimetres, of which a texel has 1.6
    let (sharp, soft) = (steepest(&["--sharp-sun"]), steepest(&[]));
    assert!(sharp > 1.0 && sharp > 1.8 * soft, "{sharp} and {soft}");
}

#[test]
fn a_cartoon_has_its_bands_under_the_brightest_sky() {
    let folder = TempDir::new().unwrap();
    let site = slats(folder.path());
    let (report, light) = solved(&site, &["--time", "12:00", "--model", "cartoon"]);
    assert_eq!(report["notes"]["surface"], "cartoon");
    let all: Vec<f32> = light.pixels.iter().map(|p| luminance(*p)).collect();
    let white = all.iter().copied().fold(0.0, f32::max);
    let share = |band: f32| all.iter().filter(|light| (3.0 * **light / white - band).abs() < 0.01).count();
    assert!(white > 5.0 && share(3.0) > 1000 && share(1.0) + share(2.0) > 1000, "{white}: {:?}", [1.0, 2.0, 3.0].map(share));
}

#[test]
fn a_measured_luminaire_shines_as_its_file_says() {
    let folder = TempDir::new().unwrap();
    let site = ground(folder.path());
    // 4,000 candelas all around below, nothing above; as much as a point of them from there
    let ies = "IESNA:LM-63-2002\n[TEST] own\n[MANUFAC] none\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 10\n0 90\n0\n4000 4000\n";
    fs::write(site.join("lamp.ies"), ies).unwrap();
    let lit_by = |light: &str| {
        let lamps = site.join("lamps.toml");
        fs::write(&lamps, format!("[[light]]\nplace = [0.5, 2.0, -0.5]\n{light}\n")).unwrap();
        solved(&site, &["--sky", "none", "--lights", lamps.to_str().unwrap()])
    };
    let (report, measured) = lit_by("kind = \"ies\"\nfile = \"lamp.ies\"");
    let (_, point) = lit_by("kind = \"point\"\namount = { intensity_cd = 4000.0 }");
    assert!(mean(&report) > 0.25, "{report}");
    for (a, b) in measured.pixels.iter().zip(&point.pixels) {
        assert!((*a - *b).abs().max_element() < 1e-4, "{a} and {b}");
    }
    let (dimmed, _) = lit_by("kind = \"ies\"\nfile = \"lamp.ies\"\nfactor = 0.5");
    assert!((mean(&dimmed) / mean(&report) - 0.5).abs() < 1e-3, "{dimmed}");
}

/// A floor of two colours with a wall, a post that is lit at its vertices, and a step that has coordinates and a plain albedo; nothing says where two of them end.
fn three_parts(folder: &Path) -> PathBuf {
    let site = ground(folder);
    let floor = "mtllib floor.mtl\nv 0 0 0\nv 2 0 0\nv 2 0 -2\nv 0 0 -2\nv 2 1 -2\nv 0 1 -2\nvt 0 0\nvt 3 0\nvt 3 3\nvt 0 3\nvt 3 5\nvt 0 5\n\
                 usemtl red\nf 1/1 2/2 3/3\nusemtl blue\nf 1/1 3/3 4/4\nusemtl red\nf 4/4 3/3 5/5 6/6\n";
    fs::write(site.join("floor.obj"), floor).unwrap();
    fs::write(site.join("floor.mtl"), "newmtl red\nKd 0.6 0.2 0.2\nnewmtl blue\nKd 0.2 0.2 0.6\n").unwrap();
    fs::write(site.join("post.obj"), "v 1 0 -1\nv 1.1 0 -1\nv 1.1 1 -1\nv 1 1 -1\nf 1 2 3 4\n").unwrap();
    let step = "v 0 0 1\nv 1 0 1\nv 1 0.5 1\nv 0 0.5 1\nv 1 0.5 0.5\nv 0 0.5 0.5\nvt 0.1 0.1\nvt 0.9 0.1\nvt 0.9 0.5\nvt 0.1 0.5\nvt 0.9 0.9\nvt 0.1 0.9\n\
                f 4/4 3/3 5/5 6/6\nf 1/1 2/2 3/3 4/4\n";
    fs::write(site.join("step.obj"), step).unwrap();
    let text = fs::read_to_string(site.join("site.toml")).unwrap();
    let (head, rest) = text.split_once("[[part]]").unwrap();
    let sky = &rest[rest.find("[sky]").unwrap()..];
    let parts = "[[part]]\nfile = \"floor.obj\"\n[[part]]\nfile = \"post.obj\"\nname = \"a post\"\nlight = \"vertex\"\n\
                 [[part]]\nfile = \"step.obj\"\nalbedo = [0.5, 0.5, 0.5]\n";
    fs::write(site.join("site.toml"), format!("{head}{parts}{sky}")).unwrap();
    site
}

#[test]
fn parts_return_as_their_files_are() {
    let folder = TempDir::new().unwrap();
    let site = three_parts(folder.path());
    solved(&site, &["--sky", "even", "--kind", "exr,combined", "--samples", "64"]);
    let models = ["model.glb", "lit.glb"].map(|name| site.join("out").join(name));
    for model in &models {
        let glb = Glb::read(model);
        let names: Vec<&str> =
            glb.json["nodes"].as_array().unwrap().iter().map(|node| node["name"].as_str().unwrap()).collect();
        assert_eq!(names, ["floor", "a post", "step"]);
        for (mesh, file) in ["floor", "post", "step"].into_iter().enumerate() {
            let of_file = read(&site.join(format!("{file}.obj")), &ImportOptions::default()).unwrap();
            let count = of_file.positions.len();
            let primitives = glb.json["meshes"][mesh]["primitives"].as_array().unwrap();
            let attributes = &primitives[0]["attributes"];
            let positions = glb.floats::<3>(&attributes["POSITION"]);
            assert!(of_file.positions.iter().zip(&positions).all(|(a, b)| a.to_array() == *b), "{file}");
            let triangles = primitives.iter().flat_map(|primitive| glb.triangles(&primitive["indices"]));
            let triangles: Vec<[u32; 3]> = triangles.collect();
            // red, and then blue, in the model of two materials; in one piece where light and albedo are one
            let order =
                if file == "floor" && model.ends_with("model.glb") { vec![0, 2, 3, 1] } else { (0..triangles.len()).collect() };
            assert_eq!((triangles.len(), order.len()), (of_file.triangles.len(), of_file.triangles.len()));
            for (triangle, t) in triangles.iter().zip(order) {
                let corners = of_file.triangles[t].map(|v| of_file.positions[v as usize].to_array());
                assert_eq!(triangle.map(|v| positions[v as usize]), corners, "{file}, triangle {t}");
                if !of_file.uvs.is_empty() {
                    let uvs = glb.floats::<2>(&attributes["TEXCOORD_0"]);
                    assert_eq!(
                        triangle.map(|v| uvs[v as usize]),
                        of_file.triangles[t].map(|v| of_file.uvs[v as usize].to_array())
                    );
                }
            }
            let split = positions.len() - count;
            assert_eq!(
                (split, attributes["TEXCOORD_1"].is_null()),
                if file == "post" { (0, true) } else { (2, false) },
                "{file}"
            );
        }
        let post = &glb.json["materials"][glb.json["meshes"][1]["primitives"][0]["material"].as_u64().unwrap() as usize];
        assert!(post["extras"].is_null() && post["extensions"].is_null(), "{post}");
    }
    assert_valid(&models);
}

#[test]
fn several_textures_hold_more() {
    let folder = TempDir::new().unwrap();
    let site = three_parts(folder.path());
    let out = folder.path().join("several");
    let lit = |textures: &str| -> Value {
        let ran = done(&[
            &"lightmap",
            &site,
            &"--sky",
            &"even",
            &"--size",
            &"64",
            &"--samples",
            &"64",
            &"--textures",
            &textures,
            &"--kind",
            &"exr,ktx2,rgbe,combined",
            &"-o",
            &out,
            &"--json",
        ]);
        serde_json::from_str(&ran.out).unwrap()
    };
    let (one, two) = (lit("1"), lit("2"));
    assert_eq!((one["textures"].as_u64(), two["textures"].as_u64()), (Some(1), Some(2)));
    assert!(two["texels_per_m"].as_f64().unwrap() > 1.1 * one["texels_per_m"].as_f64().unwrap(), "{one} {two}");
    let files: Vec<&str> = two["files"].as_array().unwrap().iter().map(|file| file.as_str().unwrap()).collect();
    let expected =
        "light-1.exr light-1.ktx2 light-1.rgbe.png light-2.exr light-2.ktx2 light-2.rgbe.png lit.glb model.glb lightmap.json";
    assert_eq!(files, expected.split(' ').collect::<Vec<_>>());
    for file in ["light-1.exr", "light-2.exr"] {
        let light = HdrImage::read(out.join(file)).unwrap();
        assert!(light.width == 64 && light.pixels.iter().all(|p| p.min_element() > 0.1), "{file}");
    }
    let (model, lit_model) = (Glb::read(&out.join("model.glb")), Glb::read(&out.join("lit.glb")));
    let mut named: Vec<String> = model.json["materials"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|material| material["extras"]["lightMap"]["file"].as_str().map(str::to_owned))
        .collect();
    named.sort();
    named.dedup();
    assert_eq!(named, ["light-1.exr", "light-2.exr"]);
    assert_eq!(lit_model.json["images"].as_array().unwrap().len(), 2);
    let ran = run(&[&"lightmap", &site, &"--textures", &"65"]);
    assert_eq!(ran.code, 2, "{}", ran.err);
}

#[test]
fn the_size_that_would_do_is_told_and_does() {
    let folder = TempDir::new().unwrap();
    let site = three_parts(folder.path());
    let sized =
        |size: &str| run(&[&"lightmap", &site, &"--sky", &"even", &"--samples", &"64", &"--margin", &"64", &"--size", &size]);
    let refused = sized("16");
    let needed = refused.err.split("give --size ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap_or_default();
    assert!(refused.code == 1 && refused.err.contains("charts do not fit"), "{}", refused.err);
    let ran = sized(needed);
    assert_eq!(ran.code, 0, "{needed}: {}", ran.err);
}
