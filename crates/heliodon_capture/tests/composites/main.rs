//! Keyed films against the alpha that they were composed with.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod scene;

use heliodon_capture::key::{KeyParams, Keyed, Keyer, Mixing, Picture, ScreenKind};
use scene::{BLUE, Frame, GREEN, Scene, frame};

/// How far a matte lies from the truth.
#[derive(Debug)]
struct Errors {
    /// The mean of |alpha - truth| over all pixels, and over those that are partly covered.
    mean: f64,
    edge: f64,
    /// The share of edge pixels with more of the screen's colour than `max(others) + 2` codes over black.
    tinted: f64,
    /// The largest excess, in codes.
    worst: i32,
}

fn errors(keyed: &Keyed, frame: &Frame, limited: usize) -> Errors {
    let (mut sum, mut edge_sum, mut edges, mut tinted, mut worst) = (0.0, 0.0, 0, 0, 0);
    for ((pixel, &mask), &truth) in keyed.image.iter().zip(&keyed.mask).zip(&frame.alpha) {
        let error = f64::from((1.0 - f32::from(mask) / 255.0 - truth).abs());
        sum += error;
        if truth > 0.01 && truth < 0.99 {
            edge_sum += error;
            edges += 1;
        }
        if mask > 0 && mask < 255 {
            let others = (0..3).filter(|&c| c != limited).map(|c| i32::from(pixel[c])).max().unwrap();
            let excess = i32::from(pixel[limited]) - others;
            tinted += u64::from(excess > 2);
            worst = worst.max(excess);
        }
    }
    let count = frame.alpha.len() as f64;
    Errors { mean: sum / count, edge: edge_sum / f64::from(edges.max(1)), tinted: tinted as f64 / count, worst }
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
            for (noise, spill) in [(0.0, 0.0), (2.0, 0.06), (5.0, 0.12)] {
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
                    assert!(errors.worst <= 2, "{name} {linear} {noise} {spill} frame {k}: {errors:?}");
                }
                assert_eq!(keyer.mixing(), if linear { Mixing::Linear } else { Mixing::Encoded });
            }
        }
    }
}

#[test]
fn probe_mixings() {
    for (name, screen, limited) in [("green", GREEN, 1), ("blue", BLUE, 2)] {
        for linear in [true, false] {
            for (noise, spill) in [(0.0, 0.0), (2.0, 0.06), (5.0, 0.12)] {
                let scene = Scene { linear, noise, spill, ..Scene::studio(screen) };
                let frames = frames(&scene);
                for mixing in [Mixing::Find, Mixing::Linear, Mixing::Encoded] {
                    let (keyer, keyed) = keyed(&scene, &frames, &KeyParams { mixing, ..KeyParams::studio() });
                    let e = errors(&keyed[3], &frames[3], limited);
                    println!(
                        "{name} linear {linear} noise {noise} spill {spill} {mixing:?}->{:?}: mean {:.4} edge {:.4} tinted {:.4} worst {}",
                        keyer.mixing(),
                        e.mean,
                        e.edge,
                        e.tinted,
                        e.worst
                    );
                }
            }
        }
    }
}
