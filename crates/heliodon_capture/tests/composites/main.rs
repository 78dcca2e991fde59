//! Keyed films against the alpha that they were composed with.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod scene;

use heliodon_capture::key::{Blending, KeyParams, Keyed, Keyer, Mixing, Picture, Region, ScreenKind};
use heliodon_film::{Film, FilmWriter, FrameReader, Rate, ReadParams, Source, WriteParams};
use scene::{BLUE, Frame, GREEN, Scene, frame};

/// How far a matte lies from the truth.
#[derive(Debug)]
struct Errors {
    /// The mean of |alpha - truth| over all pixels, and over those that are partly covered.
    mean: f64,
    edge: f64,
    /// How many codes edge pixels have at most of the screen's colour more than `max(others)`, over black.
    worst: i32,
}

fn errors(keyed: &Keyed, frame: &Frame, limited: usize) -> Errors {
    let (mut sum, mut edge_sum, mut edges, mut worst) = (0.0, 0.0, 0, 0);
    for ((pixel, &mask), &truth) in keyed.image.iter().zip(&keyed.mask).zip(&frame.alpha) {
        let error = f64::from((1.0 - f32::from(mask) / 255.0 - truth).abs());
        sum += error;
        if truth > 0.01 && truth < 0.99 {
            edge_sum += error;
            edges += 1;
        }
        if mask > 0 && mask < 255 {
            let others = (0..3).filter(|&c| c != limited).map(|c| i32::from(pixel[c])).max().unwrap();
            worst = worst.max(i32::from(pixel[limited]) - others);
        }
    }
    let count = frame.alpha.len() as f64;
    Errors { mean: sum / count, edge: edge_sum / f64::from(edges.max(1)), worst }
}

fn frames(scene: &Scene) -> Vec<Frame> {
    (0..6).map(|k| frame(scene, k as f32 / 5.0)).collect()
}

fn keyed(scene: &Scene, frames: &[Frame], params: &KeyParams) -> (Keyer, Vec<Keyed>) {
    let (w, h) = (scene.width as u32, scene.height as u32);
    let pictures: Vec<Picture<'_>> = frames.iter().map(|frame| Picture::new(w, h, &frame.pixels).unwrap()).collect();
    let mut keyer = Keyer::prepare(&pictures, params).unwrap();
    let keyed: Vec<Keyed> = pictures.iter().map(|picture| keyer.key(picture).unwrap()).collect();
    assert!(keyed.iter().all(|keyed| keyed.validate(params.blending)));
    (keyer, keyed)
}

#[test]
fn alpha_is_found_before_green_and_blue() {
    for (name, screen, limited, kind) in [("green", GREEN, 1, ScreenKind::Green), ("blue", BLUE, 2, ScreenKind::Blue)] {
        for linear in [true, false] {
            for (noise, spill) in [(0.0, 0.0), (2.0, 0.06), (4.0, 0.09)] {
                let scene = Scene { linear, noise, spill, ..Scene::studio(screen) };
                let frames = frames(&scene);
                let (keyer, keyed) = keyed(&scene, &frames, &KeyParams::studio());
                assert_eq!(keyer.screen().kind, kind);
                for (k, (keyed, frame)) in keyed.iter().zip(&frames).enumerate() {
                    let errors = errors(keyed, frame, limited);
                    if k % 5 == 0 {
                        println!(
                            "{name} linear {linear} noise {noise} spill {spill} frame {k}: {errors:.4?} {:?} noise {:.4}",
                            keyer.mixing(),
                            keyer.noise()
                        );
                    }
                    assert!(errors.mean <= 0.03, "{name} {linear} {noise} {spill} frame {k}: {errors:?}");
                    assert!(errors.edge <= 0.15 && errors.worst <= 2, "{name} {linear} {noise} {spill} frame {k}: {errors:?}");
                }
                assert_eq!(keyer.mixing(), if linear { Mixing::Linear } else { Mixing::Encoded });
            }
        }
    }
}

/// The same through a codec: 4:2:0, quantised. And the pair through another.
#[test]
fn alpha_survives_h264_before_and_after() {
    if std::process::Command::new("ffmpeg").arg("-version").output().is_err() {
        println!("skipped: ffmpeg is not installed");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let rate = Rate { numerator: 25, denominator: 1 };
    let read = |name: &str| -> Vec<Vec<[u8; 4]>> {
        let film = Film::probe(at(name)).unwrap();
        let mut reader = FrameReader::open(Source::Film(film), &ReadParams::archival()).unwrap();
        std::iter::from_fn(|| reader.next_frame().unwrap().map(|frame| frame.pixels)).collect()
    };
    for (name, screen, limited) in [("green", GREEN, 1), ("blue", BLUE, 2)] {
        let scene = Scene::studio(screen);
        let mut frames = frames(&scene);
        let params = WriteParams { quality: 20, ..WriteParams::archival(scene.width as u32, scene.height as u32, rate) };
        let mut writer = FilmWriter::rgba(&at("film.mp4"), &params).unwrap();
        frames.iter().for_each(|frame| writer.write_rgba(&frame.pixels).unwrap());
        writer.finish().unwrap();
        let decoded = read("film.mp4");
        assert_eq!(decoded.len(), frames.len());
        frames.iter_mut().zip(decoded).for_each(|(frame, pixels)| frame.pixels = pixels);
        let (keyer, keyed) = keyed(&scene, &frames, &KeyParams::studio());
        let pair = WriteParams { quality: 14, ..params };
        let mut image = FilmWriter::rgba(&at("image.mp4"), &pair).unwrap();
        let mut mask = FilmWriter::grey(&at("mask.mp4"), &pair).unwrap();
        for keyed in &keyed {
            image.write_rgba(&keyed.image).unwrap();
            mask.write_grey(&keyed.mask).unwrap();
        }
        image.finish().unwrap();
        mask.finish().unwrap();
        let (images, masks) = (read("image.mp4"), read("mask.mp4"));
        for (k, frame) in frames.iter().enumerate() {
            let before = errors(&keyed[k], frame, limited);
            let mask: Vec<u8> = masks[k].iter().map(|pixel| pixel[1]).collect();
            let decoded = Keyed { image: images[k].clone(), mask, ..keyed[k] };
            let after = errors(&decoded, frame, limited);
            println!(
                "{name} frame {k}: {before:.4?}, after H.264 {after:.4?}, noise {:.4} {:?}",
                keyer.noise(),
                keyer.mixing()
            );
            assert!(before.mean <= 0.03 && before.worst <= 2, "{name} frame {k}: {before:?}");
            // a codec's own error is a few codes in any direction
            assert!(after.mean <= 0.03 && after.worst <= 12, "{name} frame {k}: {after:?}");
            let empty = frame.alpha.iter().zip(&decoded.mask).filter(|(alpha, mask)| **alpha == 0.0 && **mask < 250).count();
            assert!(empty * 50 < frame.alpha.len(), "{name} frame {k}: {empty} pixels of screen are not empty");
        }
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let scene = Scene { width: 120, height: 160, ..Scene::studio(GREEN) };
    let frames = frames(&scene);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| keyed(&scene, &frames, &KeyParams { soften_px: 1.0, shrink_px: 0.5, ..KeyParams::rough() }).1)
    };
    assert!(with(1) == with(5));
}

#[test]
fn what_is_cut_away_is_empty_and_nothing_panics() {
    let scene = Scene { width: 60, height: 80, ..Scene::studio(BLUE) };
    let frames = frames(&scene);
    let keep = vec![Region::rectangle(20.0, 0.0, 15.0, 80.0)];
    let (_, all) = keyed(&scene, &frames, &KeyParams { keep, ..KeyParams::studio() });
    let outside = |k: usize| !(20..35).contains(&(k % 60));
    assert!(
        all.iter().all(|keyed| (0..60 * 80).filter(|&k| outside(k)).all(|k| keyed.mask[k] == 255 && keyed.image[k] == [0; 4]))
    );
    // prepared with pictures of a screen, given anything
    let pictures: Vec<Picture<'_>> = frames.iter().map(|frame| Picture::new(60, 80, &frame.pixels).unwrap()).collect();
    let mut keyer = Keyer::prepare(&pictures, &KeyParams { largest_only: true, ..KeyParams::studio() }).unwrap();
    for color in [[0, 0, 0, 255], [255; 4], [255, 0, 255, 0], [36, 64, 190, 255], [128, 128, 128, 255]] {
        let pixels = vec![color; 60 * 80];
        let keyed = keyer.key(&Picture::new(60, 80, &pixels).unwrap()).unwrap();
        assert!(keyed.validate(Blending::Linear));
    }
    let wrong = vec![[0; 4]; 6];
    assert!(keyer.key(&Picture::new(2, 3, &wrong).unwrap()).is_err() && Picture::new(2, 2, &wrong).is_err());
    // one pixel is a screen, too
    for (w, h) in [(1, 1), (1, 300), (3, 2)] {
        let pixels = vec![[40, 180, 60, 255]; w as usize * h as usize];
        let picture = Picture::new(w, h, &pixels).unwrap();
        let keyed = Keyer::prepare(&[picture], &KeyParams::rough()).unwrap().key(&picture).unwrap();
        assert!(keyed.mask.iter().all(|&mask| mask == 255));
    }
    assert!(KeyParams { spill: f32::NAN, ..KeyParams::studio() }.validate().is_err());
    assert!(KeyParams { keep: vec![Region { points: vec![[0.0; 2]; 2] }], ..KeyParams::studio() }.validate().is_err());
}
