//! Filmed people: through the real ffmpeg; where it is not installed, the tests say that they are skipped.

use crate::{done, heliodon, json, ran, run};
use heliodon_film::{Film, FilmFormat, FilmWriter, FrameReader, Rate, ReadParams, Source, WriteParams};
use heliodon_image::SrgbImage;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const RATE: Rate = Rate { numerator: 24_000, denominator: 1001 };

#[expect(clippy::print_stdout, reason = "a test that is skipped says so")]
fn ffmpeg() -> bool {
    let there = Command::new("ffmpeg").arg("-version").output().is_ok();
    if !there {
        println!("skipped: ffmpeg is not installed");
    }
    there
}

/// A grey figure that walks before a screen.
fn film(path: &Path, width: u32, height: u32, screen: [u8; 3], count: u32) {
    let params =
        WriteParams { format: FilmFormat::Vp9 { alpha: false }, quality: 10, ..WriteParams::archival(width, height, RATE) };
    let mut writer = FilmWriter::rgba(path, &params).unwrap();
    for k in 0..count {
        let left = width / 4 + k * width / 64;
        let inside = |x: u32, y: u32| (left..left + width / 4).contains(&x) && y > height / 4;
        let pixel = |x, y| if inside(x, y) { [150, 140, 130, 255] } else { [screen[0], screen[1], screen[2], 255] };
        let pixels: Vec<[u8; 4]> =
            (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect();
        writer.write_rgba(&pixels).unwrap();
    }
    writer.finish().unwrap();
}

fn frames(path: &Path) -> (Film, Vec<Vec<[u8; 4]>>) {
    let film = Film::probe(path).unwrap();
    let mut reader = FrameReader::open(Source::Film(film.clone()), &ReadParams::archival()).unwrap();
    let frames = std::iter::from_fn(|| reader.next_frame().unwrap().map(|frame| frame.pixels)).collect();
    (film, frames)
}

#[test]
fn a_film_of_odd_size_becomes_a_pair_and_the_pairs_webm_is_taken_as_it_is() {
    if !ffmpeg() {
        return;
    }
    let home = tempfile::tempdir().unwrap();
    let (source, name, sheet) = (home.path().join("walk.webm"), home.path().join("guide"), home.path().join("look.png"));
    film(&source, 321, 193, [40, 180, 60], 12);
    let report = json(&[&"key", &source, &"-o", &name, &"--webm", &"--sheet", &sheet]);
    assert_eq!(
        (&report["screen"]["kind"], &report["frames"], &report["border_clean"]),
        (&"green".into(), &12.into(), &true.into())
    );
    assert_eq!((&report["width"], &report["height"], &report["padded"]), (&322.into(), &194.into(), &vec![1, 1].into()));
    assert_eq!(report["warnings"].as_array().unwrap().len(), 0, "{report}");
    let (image, images) = frames(&home.path().join("guide.image.mp4"));
    let (mask, masks) = frames(&home.path().join("guide.mask.mp4"));
    assert_eq!((image.width, image.height, image.rate, image.codec.as_str()), (322, 194, RATE, "h264"));
    assert_eq!((mask.width, mask.height, images.len(), masks.len()), (322, 194, 12, 12));
    for (k, (image, mask)) in images.iter().zip(&masks).enumerate() {
        let at = |x: usize, y: usize| (image[y * 322 + x], mask[y * 322 + x][1]);
        let (inside, covered) = at(80 + k * 5 + 40, 120);
        assert!(inside[0].abs_diff(150) < 8 && inside[1].abs_diff(140) < 8 && covered < 4, "{inside:?} {covered}");
        for place in [(10, 10), (300, 100), (321, 193), (160, 20)] {
            let (outside, covered) = at(place.0, place.1);
            assert!(outside[..3].iter().all(|&code| code < 4) && covered > 251, "{place:?}: {outside:?} {covered}");
        }
    }
    let sheet = SrgbImage::read(&sheet).unwrap();
    assert_eq!(sheet.width, 4 * 321 + 5 * 4);
    // what carries alpha is split
    let (with_alpha, again) = (home.path().join("guide.webm"), home.path().join("again"));
    let split = json(&[&"key", &with_alpha, &"-o", &again]);
    assert!(
        split["screen"].is_null() && split["film"]["alpha"] == true && split["padded"] == serde_json::json!([0, 0]),
        "{split}"
    );
    let (_, split) = frames(&home.path().join("again.mask.mp4"));
    let differing = split[6].iter().zip(&masks[6]).filter(|(a, b)| a[1].abs_diff(b[1]) > 24).count();
    assert!(differing * 200 < split[6].len(), "{differing}");
    let told = done(&[&"key", &source, &"-o", &name, &"--seconds", &"0.2", &"--from", &"0.1", &"--keep", &"0,0,200,193"]);
    assert!(
        told.out.contains("H.264 needs even sides") && told.out.contains("5 frames") && told.out.contains("guide.mask.mp4"),
        "{}",
        told.out
    );
    // nothing is left beside
    assert_eq!(fs::read_dir(home.path()).unwrap().count(), 7);
}

#[test]
fn what_cannot_be_keyed_is_told_in_one_message() {
    if !ffmpeg() {
        return;
    }
    let home = tempfile::tempdir().unwrap();
    let at = |name: &str| home.path().join(name);
    let refused = |file: &PathBuf, more: &[&str], what: &[&str]| {
        let mut arguments: Vec<&dyn AsRef<std::ffi::OsStr>> = vec![&"key", file];
        more.iter().for_each(|argument| arguments.push(argument));
        let ran = run(&arguments);
        assert!(
            ran.code == 1 && ran.err.trim_end().lines().last().is_some_and(|line| line.starts_with("error: ")),
            "{}",
            ran.err
        );
        assert!(what.iter().all(|what| ran.err.contains(what)), "{what:?}: {}", ran.err);
    };
    fs::write(at("text.mp4"), "hello\n").unwrap();
    refused(&at("text.mp4"), &[], &["text.mp4", "is no film", "give an MP4"]);
    refused(&at("none.mp4"), &[], &["none.mp4", "cannot be read"]);
    film(&at("grey.webm"), 64, 48, [120, 120, 120], 3);
    refused(&at("grey.webm"), &["--quiet"], &["grey.webm", "no green or blue screen", "--screen"]);
    film(&at("green.webm"), 64, 48, [40, 180, 60], 3);
    refused(&at("green.webm"), &["--from", "100", "--quiet"], &["green.webm", "no frame"]);
    refused(&at("green.webm"), &["-o", at("none/x").to_str().unwrap()], &["there is no folder"]);
    refused(&at("green.webm"), &["--webm"], &["would be written over"]);
    let before: Vec<_> = fs::read_dir(home.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(before.len(), 3, "{before:?}");
    // a screen of one pixel
    film(&at("dot.webm"), 1, 1, [40, 180, 60], 2);
    let dot = json(&[&"key", &at("dot.webm")]);
    assert_eq!((&dot["width"], &dot["transparent"]), (&2.into(), &1.0.into()));
    // without ffmpeg
    let missing = ran(heliodon(&[&"key", &at("green.webm")]).env("PATH", home.path()).output().unwrap());
    assert!(missing.code == 1 && missing.err.contains("apt-get install ffmpeg"), "{}", missing.err);
}

/// The clips that others made, where they are at hand.
#[test]
fn real_clips_are_keyed_without_a_green_edge() {
    let folder = Path::new("../../../shared/data/video");
    if !ffmpeg() || !folder.exists() {
        println!("skipped, not at hand: {}", folder.display());
        return;
    }
    let home = tempfile::tempdir().unwrap();
    for (clip, kind, sound) in
        [("aframe_chromakey/example.mp4", "green", false), ("mdn_chroma_keying/media/video.mp4", "other", true)]
    {
        let name = home.path().join("clip");
        let report = json(&[&"key", &folder.join(clip), &"-o", &name, &"--seconds", &"1", &"--quiet"]);
        assert_eq!(report["screen"]["kind"], kind, "{report}");
        let (image, images) = frames(&home.path().join("clip.image.mp4"));
        let (_, masks) = frames(&home.path().join("clip.mask.mp4"));
        assert_eq!(image.sound.is_some(), sound);
        assert_eq!(images.len(), masks.len());
        for (image, mask) in images.iter().zip(&masks) {
            let edge = image.iter().zip(mask).filter(|(_, mask)| (26..230).contains(&mask[1]));
            let (mut all, mut green) = (0, 0);
            for (pixel, _) in edge {
                all += 1;
                // the codec's own error on top of 2 codes
                green += u32::from(pixel[1] > pixel[0].max(pixel[2]).saturating_add(6));
            }
            assert!(all > 50 && green * 100 <= all, "{clip}: {green} of {all} edge pixels are green");
        }
    }
    let split = json(&[
        &"key",
        &folder.join("samdutton_videoalpha/video/dancer1.webm"),
        &"-o",
        &home.path().join("dance"),
        &"--seconds",
        &"0.5",
    ]);
    assert!(split["film"]["alpha"] == true && split["frames"] == 15 && split["transparent"].as_f64().unwrap() > 0.3, "{split}");
}
