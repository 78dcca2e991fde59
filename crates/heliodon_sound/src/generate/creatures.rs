//! Cicadas, crickets, birds.

use super::canvas::{Biquad, Canvas, Pass, RATE, between, frames, wait};
use heliodon_math::random::Pcg32;
use std::f64::consts::{PI, TAU};

/// Each cicada buckles its tymbals some 400 times a second, which rings at 4 to 6 kHz (Cicada orni), in bursts of a twelfth of a
/// second, six to eight a second, and now and then rests. A chorus of many further off is the shimmer behind.
pub(super) fn cicadas(canvas: &mut Canvas, random: &mut Pcg32) {
    for near in 0..7_u32 {
        let (hz, rate) = (between(random, 4200.0, 5800.0), between(random, 5.5, 8.0));
        let (clicks, level) = (between(random, 340.0, 460.0), 1.0 / (1.0 + f64::from(near) * 0.7));
        let curve = canvas.drift(random, 0.15);
        // a whole number of bursts, so that the loop closes
        let bursts = (canvas.seconds() * rate).round().max(1.0);
        let length = canvas.seconds() / bursts;
        for burst in 0..bursts as u32 {
            let at = f64::from(burst) * length;
            let sings = curve[frames(at).min(curve.len() - 1)];
            if sings < 0.25 {
                continue;
            }
            let mut body = Biquad::new(Pass::Band, hz * between(random, 0.995, 1.005), 9.0);
            let (count, mut next) = (frames(length * 0.62), 0.0);
            let sound: Vec<f64> = (0..count + 400)
                .map(|k| {
                    let mut push = 0.0;
                    if k < count && k as f64 >= next {
                        next += RATE / clicks * between(random, 0.93, 1.07);
                        push = libm::sin(PI * k as f64 / count as f64) * between(random, 0.7, 1.0);
                    }
                    body.next(push)
                })
                .collect();
            canvas.add(at, &sound, level * (sings - 0.25) * 20.0);
        }
    }
    // a body rings more narrowly than one resonator does
    canvas.filter(Pass::High, 3000.0, 0.8);
    canvas.filter(Pass::Low, 8000.0, 0.8);
    let shimmer: Vec<f64> = canvas.drift(random, 0.5).iter().map(|c| 0.6 + 0.4 * c).collect();
    canvas.bed(random, &[(Pass::Band, 5000.0, 3.0)], 0.3, &shimmer);
    canvas.bed(random, &[(Pass::Band, 7400.0, 4.0)], 0.08, &shimmer);
}

/// Field crickets (chirps of four pure syllables at 4.5 to 5 kHz) and tree crickets (long trills at 2.6 to 3 kHz).
pub(super) fn crickets(canvas: &mut Canvas, random: &mut Pcg32) {
    for who in 0..8_u32 {
        let tree = who % 3 == 2;
        let hz = if tree { between(random, 2550.0, 3050.0) } else { between(random, 4350.0, 5050.0) };
        let (syllable, rest) = if tree { (0.017, 0.006) } else { (0.016, 0.014) };
        let (count, level) = (if tree { 26 } else { 4 }, 1.0 / (1.0 + f64::from(who) * 0.6));
        let each = f64::from(count) * (syllable + rest);
        let pause = if tree { 0.5 } else { between(random, 0.16, 0.32) };
        let mut at = between(random, 0.0, each + pause);
        let end = at + canvas.seconds() - each - 0.05;
        while at < end {
            for part in 0..count {
                let length = frames(syllable);
                let bend = between(random, -12.0, 12.0);
                let sound: Vec<f64> = (0..length)
                    .map(|k| {
                        let t = k as f64 / length as f64;
                        let envelope = libm::pow(libm::sin(PI * t), 1.5);
                        // the wing slows: every syllable falls a little
                        libm::sin(TAU * (hz + bend - 60.0 * t) * k as f64 / RATE) * envelope
                    })
                    .collect();
                let grows = if tree { 1.0 } else { 0.55 + 0.15 * f64::from(part) };
                canvas.add(at + f64::from(part) * (syllable + rest), &sound, level * grows);
            }
            at += each + pause * between(random, 0.85, 1.15);
        }
    }
    let air: Vec<f64> = canvas.drift(random, 0.3).iter().map(|c| 0.5 + 0.5 * c).collect();
    canvas.bed(random, &[(Pass::Band, 320.0, 0.4)], 0.03, &air);
}

/// One note: a whistle that bends from one pitch to another, with a little of its octave.
fn note(from_hz: f64, to_hz: f64, seconds: f64, trill_hz: f64) -> Vec<f64> {
    let (count, mut phase) = (frames(seconds).max(1), 0.0);
    (0..count)
        .map(|k| {
            let t = k as f64 / count as f64;
            let trill = if trill_hz > 0.0 { 1.0 + 0.045 * libm::sin(TAU * trill_hz * k as f64 / RATE) } else { 1.0 };
            phase += TAU * (from_hz + (to_hz - from_hz) * t) * trill / RATE;
            let envelope = libm::pow(libm::sin(PI * t), 0.8);
            (libm::sin(phase) + 0.12 * libm::sin(2.0 * phase)) * envelope
        })
        .collect()
}

/// Five birds, each with a song of a few notes of its own, which it sings at its own times from near or far.
pub(super) fn birds(canvas: &mut Canvas, random: &mut Pcg32) {
    for _ in 0..5 {
        let far = between(random, 0.0, 1.0);
        let song: Vec<(f64, f64, f64, f64, f64)> = (0..2 + random.next_u32() % 5)
            .map(|_| {
                let from = between(random, 2300.0, 5600.0);
                let to = from * between(random, 0.72, 1.35);
                let trill = if random.next_f32() < 0.25 { between(random, 22.0, 45.0) } else { 0.0 };
                let length = if trill > 0.0 { between(random, 0.18, 0.4) } else { between(random, 0.05, 0.16) };
                (from, to.min(7000.0), length, trill, between(random, 0.03, 0.12))
            })
            .collect();
        let mut at = between(random, 0.0, 4.0);
        while at < canvas.seconds() {
            let mut when = at;
            let turn = between(random, 0.98, 1.02);
            for (from, to, length, trill, gap) in &song {
                let sound = note(from * turn, to * turn, *length, *trill);
                canvas.add(when, &sound, 1.0 - 0.75 * far);
                // a wall or a wood sends some of it back
                canvas.add(when + 0.11, &sound, 0.08);
                canvas.add(when + 0.19, &sound, 0.05);
                when += length + gap;
            }
            at = when + 2.5 + wait(random, 0.2);
        }
    }
    let air: Vec<f64> = canvas.drift(random, 0.3).iter().map(|c| 0.5 + 0.5 * c).collect();
    canvas.bed(random, &[(Pass::Band, 420.0, 0.4)], 0.02, &air);
}
