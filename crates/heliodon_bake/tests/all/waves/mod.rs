//! A scan to be prepared, and what bakes of it need.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::Vec3;
use heliodon_bake::bake::{BakeReport, bake};
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bake::report::Silent;
use heliodon_bundle::BundleReader;
use heliodon_bundle::site::Site;
use heliodon_image::HdrImage;
use heliodon_math::color::srgb_from_linear;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A scanned wall with waves, simplified to a few triangles, on a ground that goes on behind it; the sun stands behind the eye, half-way up.
pub const SITE: &str = r#"[site]
name = "A wall with waves"
[[part]]
file = "wall.ply"
[[part]]
file = "ground.ply"
role = "ground"
[sky]
probes = "sky.hdr"
mapping = "lat-long"
[bake]
samples = 32
bounces = 1
[[room]]
name = "before the wall"
min = [-0.5, 1.2, -0.5]
max = [0.5, 1.8, 0.5]
[display]
width_px = 160
height_px = 120
"#;
pub const PREPARE: &str = "[prepare]\nwinding = \"report\"\nerror_px = 4.0\nedge_px = 40.0\n";

/// How far the wall's waves stand out of x = 6 towards the room, with the slopes along y and z.
pub fn wave(y: f32, z: f32) -> [f32; 3] {
    let (a, b) = (4.0 * y, 4.0 * z);
    [0.05 * a.sin() * b.sin(), 0.2 * a.cos() * b.sin(), 0.2 * a.sin() * b.cos()]
}

/// The colour of the wall: red grows along z.
pub fn red(z: f32) -> f32 {
    0.2 + 0.1 * (z + 3.0)
}

/// A sheet of vertices with colours, as PLY; its front is where the normal of `a` and `b` points.
pub fn sheet(parts: u32, place: impl Fn(f32, f32) -> Vec3, color: impl Fn(Vec3) -> [u8; 3]) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        (parts + 1) * (parts + 1),
        2 * parts * parts
    );
    for (i, j) in (0..=parts).flat_map(|i| (0..=parts).map(move |j| (i, j))) {
        let p = place(i as f32 / parts as f32, j as f32 / parts as f32);
        let [r, g, b] = color(p);
        writeln!(text, "{} {} {} {r} {g} {b}", p.x, p.y, p.z).unwrap();
    }
    for (i, j) in (0..parts).flat_map(|i| (0..parts).map(move |j| (i, j))) {
        let at = |i: u32, j: u32| i * (parts + 1) + j;
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        writeln!(text, "3 {a} {b} {c}\n3 {a} {c} {d}").unwrap();
    }
    text
}

pub fn site(more: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    let wall = |s: f32, t: f32| {
        let (y, z) = (4.0 * s, 6.0 * t - 3.0);
        Vec3::new(6.0 - wave(y, z)[0], y, z)
    };
    let srgb = |linear: f32| (255.0 * srgb_from_linear(linear)).round() as u8;
    write("wall.ply", &sheet(120, |s, t| wall(t, s), |p| [srgb(red(p.z)), 128, 128]));
    write("ground.ply", &sheet(40, |s, t| Vec3::new(40.0 * s - 20.0, 0.0, 20.0 - 40.0 * t), |_| [128; 3]));
    // in the west
    let sun = |x: u32, y: u32| (63..65).contains(&x) && (31..33).contains(&y);
    let sky = HdrImage::from_fn(256, 128, |x, y| if sun(x, y) { Vec3::splat(20_000.0) } else { Vec3::ONE });
    sky.write_hdr(folder.path().join("sky.hdr")).unwrap();
    write("site.toml", &(SITE.to_owned() + more));
    folder
}

pub fn plan(folder: &Path, bundle: &str) -> Plan {
    Plan::new(Site::read(folder).unwrap(), BakeOptions::new(folder.join(bundle))).unwrap()
}

pub fn baked(folder: &Path, bundle: &str) -> (BakeReport, BundleReader) {
    let report = bake(&plan(folder, bundle), &Silent).unwrap();
    (report, BundleReader::open(folder.join(bundle)).unwrap())
}

/// The plan of a site's bake into a bundle of this name in its folder, with a cache of its own.
pub fn own_cache(site: &Path, bundle: &str) -> Plan {
    let cache = Some(site.join(format!("{bundle}-cache")));
    let options = BakeOptions { cache, ..BakeOptions::new(site.join(bundle)) };
    Plan::new(Site::read(site).unwrap(), options).unwrap()
}
