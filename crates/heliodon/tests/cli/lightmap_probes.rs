//! `heliodon lightmap` on sites with photographed skies: their suns, and what lies between two of them.

use crate::lightmap::{mean, solved};
use crate::run;
use glam::Vec3;
use heliodon_image::HdrImage;
use serde_json::Value;
use std::f32::consts::{PI, TAU};
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const WIDTH: u32 = 256;
const HEIGHT: u32 = 128;
/// Radiance of the skies around their suns.
const SKY: f32 = 0.5;
/// Of a sun that is all there, and of one at the end of what an image holds.
const SUN: f32 = 3000.0;
const CLIPPED: f32 = 255.0;
/// What the site says of the clipped one.
const GIVEN: f32 = 40.0;

/// A sun of four pixels, whose common corner lies there.
#[derive(Clone, Copy)]
struct Spot {
    column: u32,
    row: u32,
}

/// In the south-east, and later and higher.
const MORNING: Spot = Spot { column: 224, row: 32 };
const LATER: Spot = Spot { column: 240, row: 24 };

impl Spot {
    fn direction(self) -> Vec3 {
        let azimuth = TAU * (self.column as f32 / WIDTH as f32 - 0.5);
        let (up, level) = (PI * (0.5 - self.row as f32 / HEIGHT as f32)).sin_cos();
        Vec3::new(level * azimuth.sin(), up, -level * azimuth.cos())
    }

    /// Of a radiance above the sky's: its irradiance at normal incidence.
    fn irradiance(self, radiance: f32) -> f32 {
        let edge = |row: u32| (PI * row as f32 / HEIGHT as f32).cos();
        (radiance - SKY) * 2.0 * TAU / WIDTH as f32 * (edge(self.row - 1) - edge(self.row + 1))
    }

    fn probe(self, radiance: f32, file: &Path) {
        let shines = |x: u32, y: u32| (self.column - 1..=self.column).contains(&x) && (self.row - 1..=self.row).contains(&y);
        let image = HdrImage::from_fn(WIDTH, HEIGHT, |x, y| Vec3::splat(if shines(x, y) { radiance } else { SKY }));
        image.write_exr(file).unwrap();
    }
}

/// A square under skies of three times of day; the last two suns are clipped.
fn site(folder: &Path) -> PathBuf {
    MORNING.probe(SUN, &folder.join("1000.exr"));
    LATER.probe(CLIPPED, &folder.join("1100.exr"));
    LATER.probe(CLIPPED, &folder.join("1200.exr"));
    let site = format!(
        "[site]\nname = \"Probes\"\n[[part]]\nfile = \"square.obj\"\nalbedo = [0.5, 0.5, 0.5]\n\
         [sky]\nprobes = \"*.exr\"\nmapping = \"lat-long\"\nsun_irradiance = [{GIVEN}, {GIVEN}, {GIVEN}]\n[bake]\nbounces = 0\n"
    );
    fs::write(folder.join("site.toml"), site).unwrap();
    face(folder, Vec3::Y);
    folder.to_owned()
}

/// Turns the site's square towards an axis.
fn face(site: &Path, axis: Vec3) {
    let across = [Vec3::Z, Vec3::X, Vec3::Y].into_iter().find(|a| a.dot(axis) == 0.0).unwrap();
    let up = axis.cross(across);
    let corners = [Vec3::ZERO, across, across + up, up];
    let vertices: String = corners.iter().map(|c| format!("v {} {} {}\n", c.x, c.y, c.z)).collect();
    fs::write(site.join("square.obj"), vertices + "f 1 2 3 4\n").unwrap();
}

/// The sun's irradiance times its direction, as squares that face up, east and south have it beside the sky's light.
fn sun_in_map(site: &Path, more: &[&str]) -> Vec3 {
    let beside_sky = |axis: Vec3| {
        face(site, axis);
        PI * (mean(&solved(site, more).0) as f32 - SKY)
    };
    let sun = Vec3::new(beside_sky(Vec3::X), beside_sky(Vec3::Y), beside_sky(Vec3::Z));
    face(site, Vec3::Y);
    sun
}

#[track_caller]
fn assert_near(found: Vec3, expected: Vec3) {
    assert!((found - expected).length() < 0.02 * expected.length(), "{found} and {expected}");
}

#[test]
fn the_sun_of_a_probe_is_a_light_and_a_clipped_one_as_the_site_says() {
    let folder = TempDir::new().unwrap();
    let site = site(folder.path());
    assert_near(sun_in_map(&site, &["--time", "10:00"]), MORNING.direction() * MORNING.irradiance(SUN));
    assert_near(sun_in_map(&site, &["--time", "11:00"]), LATER.direction() * GIVEN);
    let (soft, _) = solved(&site, &["--time", "11:00"]);
    let (sharp, _) = solved(&site, &["--time", "11:00", "--sharp-sun"]);
    assert!((mean(&sharp) / mean(&soft) - 1.0).abs() < 0.01 && sharp["lights"] == soft["lights"], "{sharp} {soft}");
    assert!(sharp["lights"].to_string().contains("the sun"), "{sharp}");
}

#[test]
fn between_two_probes_sky_and_sun_lie_between_theirs() {
    let folder = TempDir::new().unwrap();
    let site = site(folder.path());
    let direction = (MORNING.direction() + LATER.direction()).normalize_or_zero();
    let irradiance = 0.5 * (MORNING.irradiance(SUN) + GIVEN);
    assert_near(sun_in_map(&site, &["--time", "10:30"]), direction * irradiance);
    // the sky's own light too, of which nothing is taken from the nearer one alone
    HdrImage::filled(WIDTH, HEIGHT, Vec3::splat(1.0)).write_exr(site.join("1300.exr")).unwrap();
    let (sky, _) = solved(&site, &["--time", "12:30", "--model", "sky"]);
    assert!((mean(&sky) - 0.75).abs() < 0.01, "{sky}");
    let text = fs::read_to_string(site.join("site.toml")).unwrap();
    fs::write(site.join("site.toml"), text.replace("[bake]", "between = \"nearest\"\n[bake]")).unwrap();
    assert_near(sun_in_map(&site, &["--time", "10:20"]), MORNING.direction() * MORNING.irradiance(SUN));
}

#[test]
fn the_sky_alone_has_no_sun_of_its_probe() {
    let folder = TempDir::new().unwrap();
    let site = site(folder.path());
    for time in ["10:00", "11:00"] {
        let (sky, light) = solved(&site, &["--time", time, "--model", "sky"]);
        assert!((mean(&sky) - f64::from(SKY)).abs() < 0.01 && sky["lights"].as_array().unwrap().is_empty(), "{sky}");
        assert!(light.pixels.iter().all(|p| (p.x - SKY).abs() < 0.02));
    }
}

#[test]
fn a_time_is_told_of_what_it_does() {
    let folder = TempDir::new().unwrap();
    let site = site(folder.path());
    let out = site.join("out");
    let lit_at = |time: &str| {
        let all: [&dyn AsRef<OsStr>; 10] =
            [&"lightmap", &site, &"--size", &"64", &"--samples", &"64", &"-o", &out, &"--time", &time];
        run(&all)
    };
    let sky_of = |ran: &crate::Ran| {
        assert_eq!(ran.code, 0, "{}", ran.err);
        let report: Value = serde_json::from_slice(&fs::read(out.join("lightmap.json")).unwrap()).unwrap();
        report["sky"].as_str().unwrap().to_owned()
    };
    let between = lit_at("10:30");
    assert_eq!(sky_of(&between), "the site's sky at 10:30");
    assert!(!between.err.contains("sky_steps") && between.err.contains("sun_irradiance takes its place"), "{}", between.err);
    let late = lit_at("15:00");
    assert_eq!(sky_of(&late), "the site's sky at 12:00");
    assert!(late.err.contains("no probe was taken as late as 15:00"), "{}", late.err);
    // one alone stands for all times
    fs::remove_dir_all(&out).unwrap();
    ["1100.exr", "1200.exr"].iter().for_each(|name| fs::remove_file(site.join(name)).unwrap());
    let refused = lit_at("10:00");
    assert!(refused.code == 2 && refused.err.contains("--time") && !out.exists(), "{}", refused.err);
}
