//! Bad input: one message that names file, place and remedy; exit 1; no bundle, no panic.

use crate::sites::{TestSite, plane};
use crate::{Ran, run};

/// A check and a bake of a site must both fail with one message that holds all of `words`.
fn refused(site: &TestSite, words: &[&str]) {
    for command in ["check", "bake"] {
        let ran = run(&[&command, &site.folder()]);
        one_message(&ran, words, command);
    }
    assert!(!site.path("bundle").exists());
    let left: Vec<_> = std::fs::read_dir(site.folder())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .filter(|name| name.starts_with('.') && name != ".heliodon")
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

fn one_message(ran: &Ran, words: &[&str], what: &str) {
    assert_eq!(ran.code, 1, "{what}: {}", ran.err);
    let messages: Vec<&str> = ran.err.lines().filter(|line| line.starts_with("error:")).collect();
    assert_eq!(messages.len(), 1, "{what}: {}", ran.err);
    for word in words {
        assert!(messages[0].contains(word), "{what}: `{word}` is not in: {}", messages[0]);
    }
    assert!(ran.out.is_empty(), "{}", ran.out);
}

#[test]
fn a_wrong_site_toml_is_told_with_line_and_column() {
    for (from, to, words) in [
        ("[bake]", "[bake", &["site.toml:10:"][..]),
        ("samples = 64", "sampels = 64", &["site.toml:12:1", "sampels", "samples"]),
        ("samples = 64", "samples = \"many\"", &["site.toml:12:11"]),
        ("samples = 64", "sun_steps = 1025", &["site.toml:12:", "1025", "1024"]),
        ("samples = 64", "sun_steps = 0", &["site.toml:12:", "sun_steps"]),
        ("samples = 64", "order = 3", &["site.toml:12:", "order"]),
        ("samples = 64", "first = \"25:00\"", &["site.toml:12:", "25:00", "HH:MM"]),
        ("[0.5, 0.5, 0.5]", "[0.5, 0.5, 1.5]", &["site.toml:6:", "albedo", "1.5"]),
        ("[0.5, 0.5, 0.5]", "[0.5, nan, 0.5]", &["site.toml:6:", "albedo"]),
        ("role = \"scan\"", "role = \"temple\"", &["site.toml:5:", "scan"]),
        ("mapping = \"lat-long\"", "mapping = \"sphere\"", &["site.toml:9:", "lat-long"]),
        ("mesh.obj", "nowhere.obj", &["site.toml:4:", "nowhere.obj"]),
        ("mesh.obj", "scans/*.ply", &["site.toml:4:", "scans/*.ply"]),
        ("role = \"scan\"", "role = \"scan\"\nlight = \"texels\"", &["site.toml:6:", "did you mean `texel`"]),
        ("role = \"scan\"", "role = \"scan\"\ntexels = 0.0", &["site.toml:6:", "texels"]),
        ("samples = 64", "texels = 130", &["site.toml:12:", "texels", "multiple of 4"]),
        ("grey.hdr", "nowhere.hdr", &["site.toml:8:", "nowhere.hdr"]),
    ] {
        let site = TestSite::smallest(&plane(2));
        site.edit(from, to);
        refused(&site, words);
    }
}

#[test]
fn a_file_that_is_no_text_and_a_folder_without_site_are_told() {
    let site = TestSite::smallest(&plane(2));
    site.write("site.toml", [0xFF, 0xFE, 0x00]);
    refused(&site, &["site.toml", "UTF-8"]);
    std::fs::remove_file(site.path("site.toml")).unwrap();
    refused(&site, &["site.toml", "heliodon new"]);
}

#[test]
fn hostile_meshes_are_told_with_their_place() {
    for (content, words) in [
        ("", &["mesh.obj"][..]),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n", &["mesh.obj"]),
        ("f 1 2 3\n", &["mesh.obj", "line 1"]),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", &["mesh.obj", "line 4"]),
        ("v 0 0 0\nv 1 zero 0\nv 0 1 0\nf 1 2 3\n", &["mesh.obj", "line 2"]),
        ("v nan 0 0\nv 1 nan 0\nv 0 1 inf\nf 1 2 3\n", &["mesh.obj"]),
    ] {
        let site = TestSite::smallest(content);
        refused(&site, words);
    }
}

#[test]
fn truncated_and_mislabelled_files_are_told() {
    let site = TestSite::smallest(&plane(2));
    site.edit("mesh.obj", "mesh.ply");
    for (content, words) in [
        (&b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\0\0\0"[..], &["mesh.ply"][..]),
        (b"ply\nformat ascii 1.0\nelement vertex 4294967295\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n", &["mesh.ply"]),
        (b"not a mesh at all", &["mesh.ply"]),
    ] {
        site.write("mesh.ply", content);
        refused(&site, words);
    }
}

#[test]
fn hostile_skies_are_told() {
    let site = TestSite::smallest(&plane(2));
    let good = std::fs::read(site.path("grey.hdr")).unwrap();
    for content in
        [&b""[..], b"not an image", &good[..good.len() / 2], b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 99999999 +X 99999999\n"]
    {
        site.write("grey.hdr", content);
        refused(&site, &["grey.hdr"]);
    }
}

#[test]
fn what_is_no_bundle_is_neither_read_nor_replaced() {
    let site = TestSite::smallest(&plane(2));
    let precious = site.path("bundle");
    std::fs::create_dir(&precious).unwrap();
    std::fs::write(precious.join("thesis.txt"), "ten years").unwrap();
    let ran = run(&[&"bake", &site.folder()]);
    one_message(&ran, &["bundle"], "bake");
    assert_eq!(std::fs::read_to_string(precious.join("thesis.txt")).unwrap(), "ten years");
    one_message(&run(&[&"arrays", &precious, &site.path("out")]), &["bundle"], "arrays");
    one_message(&run(&[&"inspect", &precious]), &["bundle"], "inspect");
    assert!(!site.path("out").exists());
}

#[test]
fn a_damaged_bundle_is_told() {
    let site = TestSite::smallest(&plane(2));
    crate::done(&[&"bake", &site.folder()]);
    let glb = site.path("bundle/site.glb");
    let good = std::fs::read(&glb).unwrap();
    std::fs::write(&glb, &good[..good.len() / 2]).unwrap();
    one_message(&run(&[&"arrays", &site.path("bundle"), &site.path("out")]), &["site.glb"], "arrays");
    let mut flipped = good.clone();
    let last = flipped.len() - 1;
    flipped[last] ^= 1;
    std::fs::write(&glb, flipped).unwrap();
    one_message(&run(&[&"inspect", &site.path("bundle"), &"--verify"]), &["site.glb"], "inspect --verify");
    // a bake does not take a damaged bundle for one that is up to date
    assert_eq!(crate::json(&[&"bake", &site.folder()])["up_to_date"], false);
    assert_eq!(std::fs::read(&glb).unwrap(), good);
}

#[test]
fn a_template_that_cannot_be_made_leaves_no_folder() {
    let folder = tempfile::tempdir().unwrap();
    let ran = run(&[&"new", &folder.path().join("site"), &"--triangles", &"10"]);
    assert_eq!(ran.code, 2, "{}", ran.err);
    assert!(ran.err.contains("1,000 to 20,000,000") && !folder.path().join("site").exists(), "{}", ran.err);
}

#[test]
fn an_albedo_image_of_another_kind_is_told_at_its_key() {
    let site = TestSite::smallest(&plane(2));
    site.edit("[0.5, 0.5, 0.5]", "\"grey.hdr\"");
    refused(&site, &["site.toml:6:", "grey.hdr", "PNG or JPEG"]);
}
