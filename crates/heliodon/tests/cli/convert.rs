//! `heliodon convert`: what it writes is read again, and nobody's files are harmed.

use crate::{done, json, run};
use heliodon_image::ktx2::{Ktx2, TexelFormat};
use heliodon_image::{HdrImage, SrgbImage};
use std::fs;
use std::path::Path;

/// A picture with an edge, and a triangle's file.
fn files(home: &Path) {
    let mut image = SrgbImage::filled(40, 24, [200, 100, 50, 255]);
    image.pixels.iter_mut().step_by(3).for_each(|pixel| *pixel = [128, 128, 255, 0]);
    image.write_png(home.join("wall.png")).unwrap();
    HdrImage::filled(16, 8, glam::Vec3::new(1.0, 2.0, 4.0)).write_exr(home.join("sky.exr")).unwrap();
    fs::write(home.join("quad.obj"), "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n").unwrap();
}

#[test]
fn models_and_images_are_converted_and_read_again() {
    let home = tempfile::tempdir().unwrap();
    files(home.path());
    let place = |name: &str| home.path().join(name);
    done(&[&"figures", &place("figures")]);
    let fast = place("fast");
    let walker = place("figures").join("walker.glb");
    let all =
        json(&[&"convert", &walker, &place("quad.obj"), &place("wall.png"), &place("sky.exr"), &"-o", &fast, &"--reads", &"2"]);
    let files = all["files"].as_array().unwrap();
    assert_eq!(files.len(), 4);
    for file in files {
        assert!(file["load_ms"]["before"].as_f64().unwrap() > 0.0 && file["load_ms"]["after"].as_f64().unwrap() > 0.0);
        let output = Path::new(file["output"].as_str().unwrap());
        assert_eq!(fs::metadata(output).unwrap().len(), file["bytes"]["after"].as_u64().unwrap());
        assert_eq!(file["reads"], 2);
    }
    let walker = &files[0];
    assert_eq!((&walker["kind"], &walker["clips"]), (&"model".into(), &2.into()));
    assert!(walker["gpu_bytes"]["after"].as_u64() < walker["gpu_bytes"]["before"].as_u64());
    assert!(walker["position_error_mm"].as_f64().unwrap() < 0.05);
    assert_eq!((&files[2]["format"], &files[3]["format"]), (&"BC7 sRGB".into(), &"BC6H".into()));
    let read = json(&[&"inspect", &fast.join("quad.glb")]);
    assert_eq!((&read["triangles"], &read["vertices"]), (&2.into(), &4.into()));
    assert!(done(&[&"inspect", &fast.join("wall.ktx2")]).out.contains("Bc7Srgb of 40 x 24 texels, 6 levels"));
    // an actor takes what came of it, packed, too; what was written here may be written over
    let told =
        done(&[&"convert", &place("figures").join("walker.glb"), &"-o", &fast, &"--meshopt", &"--normal-bits", &"16"]).out;
    assert!(told.contains("normals by 0.00") && told.contains("median of 5"), "{told}");
    assert_eq!(json(&[&"inspect", &fast.join("walker.glb")])["triangles"], walker["triangles"]["after"]);
}

#[test]
fn numbers_and_normals_are_no_colours() {
    let home = tempfile::tempdir().unwrap();
    files(home.path());
    let (wall, made) = (home.path().join("wall.png"), home.path().join("wall.ktx2"));
    let mut bytes = Vec::new();
    for option in ["--linear", "--normal-map"] {
        done(&[&"convert", &wall, &option, &"--quality", &"draft"]);
        let texture = Ktx2::from_bytes(&fs::read(&made).unwrap(), "it").unwrap();
        assert_eq!((texture.format, texture.levels.len()), (TexelFormat::Bc7, 6));
        bytes.push(fs::read(&made).unwrap());
    }
    assert_ne!(bytes[0], bytes[1]);
    done(&[&"convert", &wall, &"--normal-map", &"--quality", &"draft", &"--threads", &"1"]);
    assert_eq!(fs::read(&made).unwrap(), bytes[1]);
    assert_eq!(json(&[&"convert", &wall, &"--no-mips"])["files"][0]["levels"], 1);
}

#[test]
fn a_dry_run_writes_nothing() {
    let home = tempfile::tempdir().unwrap();
    files(home.path());
    let before = crate::contents(home.path());
    let told = done(&[
        &"convert",
        &home.path().join("quad.obj"),
        &home.path().join("wall.png"),
        &"--dry-run",
        &"-o",
        &home.path().join("new"),
    ]);
    assert!(told.out.contains("would become quad.glb") && told.out.contains("Nothing was written"), "{}", told.out);
    assert_eq!(crate::contents(home.path()), before);
    assert!(!home.path().join("new").exists());
}

#[test]
fn what_cannot_be_converted_is_told_and_nothing_is_written_over() {
    let home = tempfile::tempdir().unwrap();
    files(home.path());
    let place = |name: &str| home.path().join(name);
    fs::write(place("quad.glb"), "mine").unwrap();
    fs::write(
        place("points.ply"),
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n",
    )
    .unwrap();
    let png = fs::read(place("wall.png")).unwrap();
    fs::write(place("cut.png"), &png[..png.len() / 2]).unwrap();
    fs::write(place("nan.obj"), "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    fs::write(place("empty.tga"), "").unwrap();
    fs::write(place("notes.txt"), "").unwrap();
    let refused = |names: &[&str], code: i32, words: &str| {
        let paths: Vec<_> = names.iter().map(|name| if name.starts_with('-') { name.into() } else { place(name) }).collect();
        let mut all: Vec<&dyn AsRef<std::ffi::OsStr>> = vec![&"convert"];
        all.extend(paths.iter().map(|path| path as &dyn AsRef<std::ffi::OsStr>));
        let ran = run(&all);
        assert!(ran.code == code && ran.err.contains(words), "{names:?}: {} {}", ran.code, ran.err);
        ran
    };
    refused(&["quad.obj"], 1, "was not made by `heliodon convert`");
    assert_eq!(fs::read(place("quad.glb")).unwrap(), b"mine");
    refused(&["quad.glb"], 2, "would be written over");
    fs::copy(place("wall.png"), place("wall.tga")).unwrap();
    refused(&["wall.png", "wall.tga"], 2, "would both become");
    refused(&["notes.txt"], 2, "no model or image by its name");
    refused(&["wall.png", "--linear", "--normal-map"], 2, "cannot be used with");
    refused(&["points.ply"], 1, "is a cloud of 1 points");
    refused(&["nan.obj"], 1, "nan.obj");
    refused(&["cut.png"], 1, "cut.png: its pixels");
    refused(&["empty.tga"], 1, "empty.tga: its header");
    refused(&["missing.glb", "-o", "."], 1, "missing.glb");
    refused(&["sky.exr", "--normal-map"], 1, "holds floats");
    // what can be converted is
    let ran = refused(&["cut.png", "wall.png"], 1, "cut.png");
    assert!(ran.out.contains("wall.ktx2") && place("wall.ktx2").is_file() && !place("cut.ktx2").exists());
}
