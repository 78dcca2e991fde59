//! Films that are none, or not quite: one message each, with file, place and remedy.

use crate::{counting_film, ffmpeg, made};
use heliodon_film::{Film, FilmFormat, FilmWriter, FrameReader, Rate, ReadParams, Source, WriteParams};
use std::fs;
use std::path::Path;

fn told(path: &Path) -> String {
    let told = Film::probe(path).unwrap_err().to_string();
    assert!(!told.contains('\n') && told.contains("; "), "one line with a remedy: {told}");
    told
}

#[test]
fn what_is_no_film_is_told() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    assert!(told(&at("none.mp4")).contains("cannot be read"));
    assert!(told(folder.path()).contains("is a folder"));
    fs::write(at("empty.mp4"), b"").unwrap();
    assert!(told(&at("empty.mp4")).contains("is empty"));
    // text, playlists and scripts that name other files
    let secret = at("secret.mp4");
    counting_film(&secret, 32, 32, Rate::ASSUMED, 5);
    for text in [
        "hello\nworld\n".to_owned(),
        format!("#EXTM3U\n#EXTINF:1,\n{}\n", secret.display()),
        format!("ffconcat version 1.0\nfile {}\n", secret.display()),
        "\u{1b}[31mred\u{1b}[0m".repeat(200),
    ] {
        fs::write(at("text.mp4"), text).unwrap();
        assert!(told(&at("text.mp4")).contains("is no film"), "{}", told(&at("text.mp4")));
    }
    made(&["-f", "lavfi", "-i", "sine=d=1"], &at("sound.mp4"));
    assert!(told(&at("sound.mp4")).contains("no moving picture"));
    assert!(told(&at("%04d.png")).contains("no pictures are named so"));
}

#[test]
fn films_that_were_cut_off_give_what_they_have_or_say_why_not() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let noise = ["-f", "lavfi", "-i", "testsrc2=s=160x120:r=25:d=4", "-pix_fmt", "yuv420p", "-g", "12"];
    made(&noise, &at("last.mp4"));
    made(&[&noise[..], &["-movflags", "+faststart"]].concat(), &at("first.mp4"));
    made(&[&noise[..], &["-c:v", "libvpx", "-cpu-used", "8", "-deadline", "realtime"]].concat(), &at("a.webm"));
    for (name, cut) in [("last.mp4", "cut-last.mp4"), ("first.mp4", "cut-first.mp4"), ("a.webm", "cut.webm")] {
        let bytes = fs::read(at(name)).unwrap();
        fs::write(at(cut), &bytes[..bytes.len() / 2]).unwrap();
    }
    // the index stands at the end
    assert!(told(&at("cut-last.mp4")).contains("was cut off"));
    for name in ["cut-first.mp4", "cut.webm"] {
        let film = Film::probe(at(name)).unwrap();
        let mut reader = FrameReader::open(Source::Film(film.clone()), &ReadParams::archival()).unwrap();
        let mut count = 0;
        while reader.next_frame().unwrap().is_some() {
            count += 1;
        }
        assert!((10..95).contains(&count), "{name}: {count}");
        assert_eq!(film.frames().unwrap_or(100), 100, "{name}");
    }
    // every prefix gives frames or a message, and never hangs
    let bytes = fs::read(at("first.mp4")).unwrap();
    for length in [1, 3, 8, 20, 31, 40, 100, 700, 1500, 2500] {
        fs::write(at("prefix.mp4"), &bytes[..length.min(bytes.len())]).unwrap();
        if let Ok(film) = Film::probe(at("prefix.mp4")) {
            let mut reader = FrameReader::open(Source::Film(film), &ReadParams::archival()).unwrap();
            if let Err(error) = reader.next_frame() {
                assert!(error.to_string().contains("not one frame"), "{error}");
            }
        }
    }
}

#[test]
fn odd_sizes_turned_films_and_odd_rates_are_read_as_people_see_them() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let source = |size: &str, rate: &str| format!("testsrc2=s={size}:r={rate}:d=1");
    for (width, height) in [(321, 193), (1, 1), (3, 500)] {
        let params =
            WriteParams { format: FilmFormat::Vp9 { alpha: false }, ..WriteParams::archival(width, height, Rate::ASSUMED) };
        let mut writer = FilmWriter::rgba(&at("odd.webm"), &params).unwrap();
        (0..3).for_each(|_| writer.write_rgba(&vec![[200, 100, 50, 255]; (width * height) as usize]).unwrap());
        writer.finish().unwrap();
        let film = Film::probe(at("odd.webm")).unwrap();
        assert_eq!((film.width, film.height), (width, height));
        let mut reader = FrameReader::open(Source::Film(film), &ReadParams::archival()).unwrap();
        assert_eq!(reader.next_frame().unwrap().unwrap().pixels.len(), (width * height) as usize);
    }
    for (rate, is) in [("24000/1001", 23.976), ("30000/1001", 29.97), ("7", 7.0), ("120", 120.0)] {
        made(&["-f", "lavfi", "-i", &source("64x64", rate), "-pix_fmt", "yuv420p"], &at("rate.mp4"));
        let film = Film::probe(at("rate.mp4")).unwrap();
        assert!((film.rate.per_second() - is).abs() < 0.001 && !film.rate_varies, "{rate}: {film:?}");
    }
    // frames at uneven times, as phones write them; every second one of the later half is missing
    made(
        &[
            "-f",
            "lavfi",
            "-i",
            "testsrc2=s=64x64:r=30:d=4",
            "-vf",
            "select='lt(n,60)+not(mod(n,3))'",
            "-vsync",
            "vfr",
            "-pix_fmt",
            "yuv420p",
        ],
        &at("varies.mp4"),
    );
    let film = Film::probe(at("varies.mp4")).unwrap();
    assert!(film.rate_varies, "{film:?}");
    let mut reader = FrameReader::open(Source::Film(film.clone()), &ReadParams::archival()).unwrap();
    let count = std::iter::from_fn(|| reader.next_frame().unwrap()).count() as f64;
    assert!((count / film.rate.per_second() - 4.0).abs() < 0.15, "{count} frames at {:?}", film.rate);
    // a header without a rate: raw H.264 in a container of nothing but frames is taken at the times it has
    made(
        &[
            "-f",
            "lavfi",
            "-i",
            &source("64x64", "25"),
            "-c:v",
            "libvpx",
            "-f",
            "webm",
            "-cpu-used",
            "8",
            "-deadline",
            "realtime",
        ],
        &at("no_rate.webm"),
    );
    let film = Film::probe(at("no_rate.webm")).unwrap();
    assert!((film.rate.per_second() - 25.0).abs() < 0.1, "{film:?}");
    // turned by its header
    made(&["-f", "lavfi", "-i", &source("64x32", "25"), "-pix_fmt", "yuv420p"], &at("flat.mp4"));
    let flat = at("flat.mp4");
    made(&["-i", flat.to_str().unwrap(), "-c", "copy", "-metadata:s:v:0", "rotate=90"], &at("turned.mp4"));
    let film = Film::probe(at("turned.mp4")).unwrap();
    assert_eq!((film.width, film.height), (32, 64));
}
