//! A first site, from mesh to numbers, with closed-form light.

use crate::sites::{TestSite, plane, sunny_probe, waves};
use crate::{assert_same_bundle, done, json, read_npy_f32};

/// Spherical harmonics coefficients of a sky of constant radiance 1 in band 0; the others are 0.
fn constant_sky() -> f32 {
    (4.0 * std::f32::consts::PI).sqrt()
}

#[test]
fn an_open_plane_under_a_grey_sky_stores_exactly_one() {
    let site = TestSite::smallest(&plane(8));
    let baked = json(&[&"bake", &site.folder()]);
    assert_eq!(baked["up_to_date"], false);
    assert_eq!(baked["counts"]["triangles"], 128);
    done(&[&"arrays", &site.path("bundle"), &site.path("arrays")]);
    let (shape, transfer) = read_npy_f32(&site.path("arrays").join("sky_transfer.npy"));
    assert_eq!(shape, [81, 4]);
    for vertex in transfer.chunks_exact(4) {
        // one rounding of the product and one of the coefficient
        assert!((vertex[0] * constant_sky() - 1.0).abs() < 2.5e-7, "{vertex:?}");
    }
    let (shape, albedo) = read_npy_f32(&site.path("arrays").join("albedo.npy"));
    assert_eq!(shape, [81, 3]);
    // 16-bit colours in the bundle
    assert!(albedo.iter().all(|albedo| (albedo - 0.5).abs() < 1.0 / 65_535.0));
    let lapse: serde_json::Value =
        serde_json::from_slice(&std::fs::read(site.path("arrays").join("lapse.json")).unwrap()).unwrap();
    let steps = lapse["steps"].as_array().unwrap();
    assert!(!steps.is_empty() && steps.iter().all(|step| step["sun"].is_null()), "a constant image has no sun");
}

#[test]
fn a_baked_site_is_not_baked_again_until_something_changes() {
    let site = TestSite::smallest(&plane(4));
    json(&[&"bake", &site.folder()]);
    let manifest = std::fs::metadata(site.path("bundle/manifest.json")).unwrap().modified().unwrap();
    assert_eq!(json(&[&"bake", &site.folder()])["up_to_date"], true);
    assert_eq!(std::fs::metadata(site.path("bundle/manifest.json")).unwrap().modified().unwrap(), manifest);
    site.write("mesh.obj", plane(5));
    assert_eq!(json(&[&"bake", &site.folder()])["up_to_date"], false);
    assert!(site.path(".heliodon").exists());
    done(&[&"bake", &site.folder(), &"--again", &"--no-cache"]);
    assert!(!site.path(".heliodon").exists(), "nothing is kept where that is not wanted");
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let site = TestSite::smallest(&waves(40));
    sunny_probe().write_hdr(site.path("grey.hdr")).unwrap();
    site.edit("samples = 64", "samples = 64\ntransfer = \"rgb\"\norder = 2");
    for (threads, bundle) in [("1", "one"), ("2", "two"), ("7", "seven")] {
        done(&[&"bake", &site.folder(), &"-o", &site.path(bundle), &"--threads", &threads, &"--no-cache"]);
    }
    assert_same_bundle(&site.path("one"), &site.path("two"));
    assert_same_bundle(&site.path("one"), &site.path("seven"));
}

#[test]
fn a_texture_that_changes_is_noticed_though_site_toml_does_not_name_it() {
    let site =
        TestSite::smallest("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 0 -1\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n");
    site.edit("albedo = [0.5, 0.5, 0.5]\n", "");
    site.write("m.mtl", "newmtl m\nKd 1 1 1\nmap_Kd t.png\n");
    let paint = |code: u8| {
        heliodon_image::SrgbImage::filled(4, 4, [code, code, code, 255]).write_png(site.path("t.png")).unwrap();
    };
    let albedo = || {
        done(&[&"arrays", &site.path("bundle"), &site.path("arrays")]);
        read_npy_f32(&site.path("arrays").join("albedo.npy")).1[0]
    };
    paint(255);
    assert_eq!(json(&[&"bake", &site.folder()])["up_to_date"], false);
    assert!((albedo() - 1.0).abs() < 1e-4, "{}", albedo());
    assert_eq!(json(&[&"bake", &site.folder()])["up_to_date"], true);
    paint(128);
    assert_eq!(json(&[&"bake", &site.folder()])["up_to_date"], false);
    // sRGB 128 is 0.2158 linear
    assert!((albedo() - 0.2158).abs() < 1e-3, "{}", albedo());
}
