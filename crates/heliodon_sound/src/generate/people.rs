//! Steps, cloth, and a crowd.

use super::LEAD_S;
use super::canvas::{Biquad, Canvas, Mode, Pass, RATE, between, burst, filtered, frames, ring, wait};
use heliodon_math::random::Pcg32;
use std::f64::consts::PI;

/// A heel, and a sole a tenth of a second later: hard and bright on stone, dull and gritty on earth.
pub(super) fn step(canvas: &mut Canvas, random: &mut Pcg32, stone: bool) {
    let roll = between(random, 0.07, 0.11);
    for (at, level) in [(LEAD_S, 1.0), (LEAD_S + roll, between(random, 0.35, 0.6))] {
        let body = between(random, 75.0, 120.0);
        let thud = [
            Mode { hz: body, t60_s: 0.09, level: 1.0 },
            Mode { hz: body * 2.3, t60_s: 0.05, level: if stone { 0.5 } else { 0.3 } },
            Mode { hz: body * 4.9, t60_s: 0.025, level: if stone { 0.4 } else { 0.08 } },
        ];
        canvas.add(at, &ring(&thud, 0.15), level * 0.8);
        if stone {
            let tap = burst(random, 0.0003, 0.018, 1.0);
            canvas.add(at, &filtered(tap, Pass::Band, between(random, 1500.0, 2600.0), 0.8), level * 0.8);
            let click = burst(random, 0.0002, 0.006, 1.0);
            canvas.add(at, &filtered(click, Pass::High, 3500.0, 0.7), level * 0.35);
        } else {
            let soft = burst(random, 0.002, 0.06, 1.0);
            canvas.add(at, &filtered(soft, Pass::Low, 700.0, 0.7), level * 0.7);
        }
    }
    // leather drags over what lies there
    let (grains, length) = if stone { (14, 0.10) } else { (70, 0.22) };
    for _ in 0..grains {
        let at = LEAD_S + 0.01 + length * libm::pow(between(random, 0.0, 1.0), 1.5);
        let fall = between(random, 0.002, 0.008);
        let grain = burst(random, 0.0003, fall, 1.0);
        let hz = if stone { between(random, 2500.0, 6000.0) } else { between(random, 900.0, 5200.0) };
        canvas.add(at, &filtered(grain, Pass::Band, hz, 1.2), between(random, 0.04, if stone { 0.12 } else { 0.35 }));
    }
}

/// Folds that rub: grains of soft noise, thick where the hand moves fastest.
pub(super) fn cloth(canvas: &mut Canvas, random: &mut Pcg32) {
    let length = canvas.seconds();
    let mut at = LEAD_S;
    while at < length * 0.95 {
        at += wait(random, 160.0);
        let speed = libm::sin(PI * (at / length).min(1.0));
        let (rise, fall) = (between(random, 0.004, 0.015), between(random, 0.02, 0.06));
        let rub = burst(random, rise, fall, 1.0);
        let (hz, q) = (between(random, 700.0, 5200.0), between(random, 0.4, 0.9));
        canvas.add(at, &filtered(rub, Pass::Band, hz, q), speed * speed * between(random, 0.1, 0.5));
    }
}

/// First, second and third formants of vowels of men, hertz: G. E. Peterson and H. L. Barney, "Control methods used in a study of
/// the vowels", Journal of the Acoustical Society of America 24(2), 1952.
const VOWELS: [[f64; 3]; 6] = [
    [270.0, 2290.0, 3010.0],
    [390.0, 1990.0, 2550.0],
    [660.0, 1720.0, 2410.0],
    [730.0, 1090.0, 2440.0],
    [570.0, 840.0, 2410.0],
    [300.0, 870.0, 2240.0],
];

/// Something said: syllables, four or five a second, whose vowels and pitch glide; between them now and then a breath of a consonant.
fn phrase(random: &mut Pcg32, pitch_hz: f64, size: f64, seconds: f64) -> Vec<f64> {
    let count = frames(seconds);
    let mut out = Vec::with_capacity(count);
    let mut formants = [Biquad::new(Pass::Band, 500.0, 6.0); 3];
    let (mut phase, mut left, mut long) = (0.0_f64, 0_usize, 1_usize);
    let (mut now, mut wanted) = (VOWELS[3], VOWELS[3]);
    let (mut consonant, mut stress) = (0.0, 1.0);
    let mut pitch = pitch_hz;
    for k in 0..count {
        if left == 0 {
            long = frames(between(random, 0.13, 0.3));
            left = long;
            wanted = VOWELS[random.next_u32() as usize % VOWELS.len()].map(|hz| hz * size);
            (consonant, stress) = (if random.next_f32() < 0.5 { 1.0 } else { 0.0 }, between(random, 0.4, 1.0));
        }
        left -= 1;
        let (t, along) = (1.0 - left as f64 / long as f64, k as f64 / count as f64);
        if k % 64 == 0 {
            for formant in 0..3 {
                now[formant] += (wanted[formant] - now[formant]) * 0.03;
                formants[formant] = formants[formant].moved(Pass::Band, now[formant], 5.0 + 3.0 * formant as f64);
            }
            // voices fall towards the end of what they say
            pitch = pitch_hz * (1.12 - 0.25 * along + 0.06 * stress);
        }
        phase += pitch / RATE;
        phase -= phase.floor();
        // a glottis that is open for six tenths of its time (A. E. Rosenberg 1971), as pressure: its slope
        let glottis = if phase < 0.4 {
            libm::sin(PI * phase / 0.4) * 0.6
        } else if phase < 0.6 {
            -1.6 * (phase - 0.4) / 0.2
        } else {
            0.0
        };
        let breath = between(random, -1.0, 1.0) * (0.03 + if t < 0.2 { 0.25 * consonant } else { 0.0 });
        let voiced = libm::sin(PI * t.clamp(0.0, 1.0)) * stress;
        let source = glottis * voiced + breath;
        let spoken: f64 = formants.iter_mut().zip([1.0, 0.55, 0.25]).map(|(formant, level)| formant.next(source) * level).sum();
        let edge = (along / 0.05).min((1.0 - along) / 0.08).clamp(0.0, 1.0);
        out.push(spoken * edge);
    }
    out
}

/// Twenty-six people who talk of this and that, near and far.
pub(super) fn crowd(canvas: &mut Canvas, random: &mut Pcg32) {
    for who in 0..26_u32 {
        let woman = who % 2 == 1;
        let pitch = if woman { between(random, 175.0, 240.0) } else { between(random, 95.0, 145.0) };
        let size = if woman { between(random, 1.12, 1.22) } else { between(random, 0.95, 1.05) };
        let level = libm::pow(between(random, 0.12, 1.0), 1.5);
        let mut at = between(random, 0.0, 3.0);
        let end = at + canvas.seconds() - 1.0;
        while at < end {
            let length = between(random, 0.7, 2.6);
            let mood = between(random, 0.94, 1.06);
            let said = phrase(random, pitch * mood, size, length);
            // the farther, the duller
            canvas.add(at, &filtered(said, Pass::Low, 1500.0 + 4500.0 * level, 0.7), level);
            at += length + wait(random, 0.9);
        }
    }
    let air: Vec<f64> = canvas.drift(random, 0.4).iter().map(|c| 0.6 + 0.4 * c).collect();
    canvas.bed(random, &[(Pass::Band, 420.0, 0.5)], 0.08, &air);
}
