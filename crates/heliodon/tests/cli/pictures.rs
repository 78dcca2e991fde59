//! Stills, sheets and films, drawn by whatever Vulkan there is. Without any driver these tests say that they skip.

use crate::sites::{TestSite, sunny_probe, waves};
use crate::{Ran, done, run};
use heliodon_image::{HdrImage, SrgbImage};
use std::ffi::OsStr;
use std::path::Path;
use std::process::Command;

/// A small lit bundle, and a view of it from close by.
fn site() -> TestSite {
    let site = TestSite::smallest(&waves(24));
    sunny_probe().write_hdr(site.path("grey.hdr")).unwrap();
    done(&[&"bake", &site.folder()]);
    site
}

/// Runs `render`; `None` where the machine has no graphics driver.
#[expect(clippy::print_stderr, reason = "a test that skips says so")]
fn render(site: &TestSite, arguments: &[&str], out: &Path) -> Option<Ran> {
    let bundle = site.path("bundle");
    let mut all: Vec<&dyn AsRef<OsStr>> =
        vec![&"render", &bundle, &"-o", &out, &"--eye", &"0.5,0.6,0.9", &"--look", &"0.5,0,-0.4"];
    all.extend(arguments.iter().map(|argument| argument as &dyn AsRef<OsStr>));
    let ran = run(&all);
    if ran.err.contains("no graphics driver") {
        eprintln!("skipped: this machine has no graphics driver");
        return None;
    }
    assert_eq!(ran.code, 0, "{}", ran.err);
    Some(ran)
}

/// Mean difference of two pictures' codes.
fn difference(a: &SrgbImage, b: &SrgbImage) -> f64 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let codes = |image: &SrgbImage| image.pixels.iter().flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect::<Vec<_>>();
    let (a, b) = (codes(a), codes(b));
    a.iter().zip(&b).map(|(&a, &b)| f64::from(a.abs_diff(b))).sum::<f64>() / a.len() as f64
}

#[test]
fn a_still_looks_like_its_reference() {
    let site = site();
    let (live, truth) = (site.path("live.png"), site.path("truth.png"));
    let shot = ["--time", "12:00", "--size", "160x120"];
    if render(&site, &shot, &live).is_none() {
        return;
    }
    done(&[
        &"render",
        &site.path("bundle"),
        &"-o",
        &truth,
        &"--eye",
        &"0.5,0.6,0.9",
        &"--look",
        &"0.5,0,-0.4",
        &"--time",
        &"12:00",
        &"--size",
        &"160x120",
        &"--reference",
        &"64",
    ]);
    let (live, truth) = (SrgbImage::read(live).unwrap(), SrgbImage::read(truth).unwrap());
    let mean: f64 = truth.pixels.iter().map(|pixel| f64::from(pixel[1])).sum::<f64>() / truth.pixels.len() as f64;
    assert!(mean > 20.0, "the picture is not black: {mean}");
    // shadow edges are as coarse as the mesh; everything else agrees
    let difference = difference(&live, &truth);
    assert!(difference < 6.0, "{difference} of 255");
    let bundle = site.path("bundle");
    let file = site.path("shape.png");
    let ran = run(&[&"render", &bundle, &"-o", &file, &"--time", &"12:00", &"--reference", &"1", &"--shape", &bundle]);
    assert!(ran.code == 1 && ran.err.contains("was not prepared") && !file.exists(), "{}", ran.err);
    assert!(ran.err.contains(&bundle.display().to_string()), "it names which bundle: {}", ran.err);
}

#[test]
fn linear_pictures_are_the_displayed_ones_before_exposure() {
    let site = site();
    let out = site.path("linear.exr");
    if render(&site, &["--time", "12:00", "--size", "64x48"], &out).is_none() {
        return;
    }
    let linear = HdrImage::read(&out).unwrap();
    assert_eq!((linear.width, linear.height), (64, 48));
    assert!(linear.pixels.iter().all(|pixel| pixel.is_finite() && pixel.min_element() >= 0.0));
    assert!(linear.pixels.iter().any(|pixel| pixel.max_element() > 0.1));
}

#[test]
fn a_sheet_and_a_film_of_the_day() {
    let site = site();
    let sheet = site.path("sheet.png");
    if render(&site, &["--sheet", "3x2", "--size", "64x48"], &sheet).is_none() {
        return;
    }
    let sheet = SrgbImage::read(sheet).unwrap();
    assert!(sheet.width > 3 * 64 && sheet.height > 2 * 48);
    let film = site.path("film.mp4");
    render(&site, &["--size", "64x48", "--fps", "10", "--seconds", "1.5"], &film);
    let bytes = std::fs::read(&film).unwrap();
    assert_eq!(&bytes[4..8], b"ftyp");
    let probed = Command::new("ffprobe")
        .args(["-v", "error", "-count_frames", "-select_streams", "v", "-of", "csv=p=0"])
        .args(["-show_entries", "stream=codec_name,width,height,color_space,r_frame_rate,nb_read_frames"])
        .arg(&film)
        .output();
    match probed {
        Ok(probed) => {
            let errors = String::from_utf8_lossy(&probed.stderr).into_owned();
            assert!(probed.status.success() && errors.is_empty(), "{errors}");
            assert_eq!(String::from_utf8_lossy(&probed.stdout).trim(), "h264,64,48,bt709,10/1,15");
        }
        Err(_) => eprintln!("skipped: ffprobe is not here to decode the film"),
    }
}

#[test]
fn pictures_that_cannot_be_meant_are_refused() {
    let site = TestSite::smallest(&waves(2));
    let bundle = site.path("bundle");
    for arguments in [
        &["-o", "a.png"][..],
        &["-o", "a.exr"],
        &["-o", "a.jpg", "--time", "10:00"],
        &["-o", "a.png", "--time", "10:00..11:00"],
        &["-o", "a.mp4", "--time", "10:00"],
        &["-o", "a.mp4", "--sheet", "2x2"],
        &["-o", "a.mp4", "--size", "63x48"],
        &["-o", "a.png", "--time", "11:00..10:00"],
        &["-o", "a.png", "--time", "10:00", "--size", "0x0"],
        &["-o", "a.png", "--time", "10:00", "--fov", "nan"],
        &["-o", "a.png", "--time", "10:00", "--reference", "0"],
        &["-o", "a.png", "--time", "10:00", "--shape", "prepared"],
    ] {
        let mut all: Vec<&dyn AsRef<OsStr>> = vec![&"render", &bundle];
        all.extend(arguments.iter().map(|argument| argument as &dyn AsRef<OsStr>));
        let ran = run(&all);
        assert_eq!(ran.code, 2, "{arguments:?}: {}", ran.err);
    }
    let ran = run(&[&"render", &bundle, &"-o", &"a.png", &"--time", &"10:00"]);
    assert_eq!(ran.code, 1, "there is no bundle: {}", ran.err);
}
