//! What a panorama makes of a picture: a scan that was simplified looks more like itself. Without a graphics driver this says that it skips.

use crate::sites::{TestSite, plane, sunny_probe};
use crate::{done, run};
use heliodon_image::SrgbImage;
use heliodon_testkit::flip::mean_flip;
use std::fmt::Write as _;
use std::path::Path;

const SIZE: [u32; 2] = [192, 144];
const PREPARE: &str = "[prepare]\nerror_px = 6.0\nedge_px = 24.0\n";

/// Twelve metres of ground with bumps as high as a fist, seen from a room in its middle, under a low sun.
fn site() -> TestSite {
    let mut ground = String::new();
    for line in plane(200).lines() {
        match line.strip_prefix("v ") {
            Some(rest) => {
                let at: Vec<f32> = rest.split(' ').map(|number| 12.0 * number.parse::<f32>().unwrap()).collect();
                let height = 0.05 * (at[0] * 7.0).sin() * (at[2] * 6.0).cos();
                let _ = writeln!(ground, "v {} {height} {}", at[0] - 6.0, at[2] + 6.0);
            }
            None => ground += &format!("{line}\n"),
        }
    }
    let site = TestSite::smallest(&ground);
    sunny_probe().write_hdr(site.path("grey.hdr")).unwrap();
    let room = "[[room]]\nname = \"amid\"\nmin = [-0.3, 1.2, -0.3]\nmax = [0.3, 1.6, 0.3]\n[display]\nwidth_px = 192\nheight_px = 144\n";
    let text = std::fs::read_to_string(site.path("site.toml")).unwrap();
    site.write("site.toml", format!("{text}{room}"));
    site
}

/// Bakes and draws; `None` where the machine has no graphics driver.
#[expect(clippy::print_stderr, reason = "a test that skips says so")]
fn picture(site: &TestSite, name: &str) -> Option<SrgbImage> {
    let (bundle, out) = (site.path(name), site.path(&format!("{name}.png")));
    done(&[&"bake", &site.folder(), &"-o", &bundle]);
    let [width, height] = SIZE;
    let size = format!("{width}x{height}");
    let place: [&dyn AsRef<std::ffi::OsStr>; 4] = [&"--eye", &"0.2,1.5,-0.2", &"--look", &"3.0,0.0,3.5"];
    let ran = run(&[
        &[&"render" as &dyn AsRef<std::ffi::OsStr>, &bundle, &"-o", &out, &"--size", &size, &"--time", &"12:00"],
        &place[..],
    ]
    .concat());
    if ran.err.contains("no graphics driver") {
        eprintln!("skipped: this machine has no graphics driver");
        return None;
    }
    assert_eq!(ran.code, 0, "{}", ran.err);
    Some(SrgbImage::read(&out).unwrap())
}

fn flip(a: &SrgbImage, b: &SrgbImage) -> f32 {
    let codes = |image: &SrgbImage| image.pixels.iter().map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect::<Vec<_>>();
    mean_flip(&codes(a), &codes(b), SIZE[0], SIZE[1])
}

fn triangles(bundle: &Path) -> u64 {
    crate::json(&[&"inspect", &bundle])["counts"]["triangles"].as_u64().unwrap()
}

#[test]
fn what_was_simplified_looks_more_like_the_original_through_a_panorama() {
    let site = site();
    let Some(original) = picture(&site, "original") else { return };
    let text = std::fs::read_to_string(site.path("site.toml")).unwrap();
    site.write("site.toml", format!("{text}{PREPARE}"));
    let estimated = |site: &TestSite| crate::json(&[&"bake", &site.folder(), &"--estimate"])["viewer_bytes"].as_u64().unwrap();
    let without = estimated(&site);
    let Some(prepared) = picture(&site, "prepared") else { return };
    site.edit("edge_px = 24.0\n", "edge_px = 24.0\npanorama = 256\n");
    assert!(estimated(&site) > without + 4 * 3 * 256 * 2 * 256, "the estimate counts its textures");
    let Some(seen) = picture(&site, "seen") else { return };
    let [all, few, as_few] = ["original", "prepared", "seen"].map(|name| triangles(&site.path(name)));
    assert!(few * 8 < all && as_few == few, "{all} {few} {as_few}");
    let told = done(&[&"inspect", &site.path("seen")]);
    assert!(told.out.contains("a panorama from (0.00, 1.40, 0.00): six faces of 256 x 256"), "{}", told.out);

    let (before, after) = (flip(&original, &prepared), flip(&original, &seen));
    println!("FLIP to the original: {before:.4} without a panorama, {after:.4} with one");
    assert!(before > 0.02, "there is something to win: {before}");
    assert!(after < 0.7 * before, "{after} against {before}");
}
