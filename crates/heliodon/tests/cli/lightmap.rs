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
