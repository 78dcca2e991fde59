//! What single photographs saw comes into the bundle, turned as its part is.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::Vec3;
use heliodon_bake::bake::bake;
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bake::report::Silent;
use heliodon_bundle::BundleReader;
use heliodon_bundle::site::Site;
use heliodon_image::view_layers::{ViewLayer, ViewLayers, direction_code};
use heliodon_image::{HdrImage, SrgbImage};
use std::fs;
use std::path::Path;

/// A wall that looks along X of its file.
const WALL: &str = "v 0 0 2\nv 0 0 -2\nv 0 2 -2\nv 0 2 2\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";

fn views() -> ViewLayers {
    let layer = |red: u8, direction: Vec3| ViewLayer {
        colors: SrgbImage::filled(8, 8, [red, 0, 0, 255]),
        directions: SrgbImage::filled(8, 8, direction_code(direction)),
    };
    ViewLayers { layers: vec![layer(10, Vec3::X), layer(200, Vec3::Y)] }
}

fn plan(folder: &Path) -> Result<Plan, String> {
    let site = "[site]\nname = \"A wall\"\n[[part]]\nfile = \"wall.obj\"\nlight = \"vertex\"\nalbedo = \"atlas.png\"\nviews = \"views.json\"\n\
                rotate_deg = [0.0, 90.0, 0.0]\nscale = 2.0\n[sky]\nprobes = \"sky.hdr\"\nmapping = \"lat-long\"\n[bake]\nsamples = 16\nbounces = 0\n";
    fs::write(folder.join("site.toml"), site).unwrap();
    fs::write(folder.join("wall.obj"), WALL).unwrap();
    SrgbImage::filled(8, 8, [150, 140, 120, 255]).write_png(folder.join("atlas.png")).unwrap();
    HdrImage::filled(32, 16, Vec3::ONE).write_hdr(folder.join("sky.hdr")).unwrap();
    Plan::new(Site::read(folder).unwrap(), BakeOptions::new(folder.join("bundle"))).map_err(|error| error.to_string())
}

#[test]
fn directions_turn_with_the_part_and_changed_images_are_noticed() {
    let folder = tempfile::tempdir().unwrap();
    views().write(folder.path()).unwrap();
    bake(&plan(folder.path()).unwrap(), &Silent).unwrap();
    let read = || BundleReader::open(folder.path().join("bundle")).unwrap().read_views(0).unwrap().unwrap();
    let baked = read();
    assert_eq!(baked.layers[0].colors, views().layers[0].colors);
    // about Y, counter-clockwise seen from above: X becomes -Z
    assert!(baked.layers[0].sample(3, 3).direction.abs_diff_eq(Vec3::NEG_Z, 0.01));
    assert!(baked.layers[1].sample(3, 3).direction.abs_diff_eq(Vec3::Y, 0.01));
    assert!(plan(folder.path()).unwrap().is_up_to_date());
    let changed = SrgbImage::filled(8, 8, [9, 9, 9, 255]);
    changed.write_png(folder.path().join("view-1-colors.png")).unwrap();
    let plan = plan(folder.path()).unwrap();
    assert!(!plan.is_up_to_date(), "an image that views.json names has changed");
    bake(&plan, &Silent).unwrap();
    assert_eq!(read().layers[1].colors, changed);
}

#[test]
fn views_that_cannot_be_read_are_told_before_the_light_is_solved() {
    let folder = tempfile::tempdir().unwrap();
    views().write(folder.path()).unwrap();
    fs::remove_file(folder.path().join("view-0-directions.png")).unwrap();
    let error = plan(folder.path()).and_then(|plan| bake(&plan, &Silent).map_err(|error| error.to_string())).unwrap_err();
    let words = ["site.toml:7:", "view-0-directions.png", "photo texture --views"];
    assert!(words.iter().all(|word| error.contains(word)), "{error}");
}
