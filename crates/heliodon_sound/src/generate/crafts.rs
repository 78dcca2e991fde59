//! What hands do in a workshop: chisel, beam, crucible, gold; and the chime of a game.

use super::LEAD_S;
use super::canvas::{Canvas, Mode, Pass, RATE, between, burst, filtered, ring, wait};
use heliodon_math::random::Pcg32;

/// Modes at given frequencies, each shifted a little: no two blows are alike.
fn modes(random: &mut Pcg32, spread: f64, table: &[(f64, f64, f64)]) -> Vec<Mode> {
    let mut mode = |(hz, t60_s, level): &(f64, f64, f64)| Mode {
        hz: hz * between(random, 1.0 - spread, 1.0 + spread),
        t60_s: t60_s * between(random, 0.8, 1.2),
        level: level * between(random, 0.6, 1.2),
    };
    table.iter().map(&mut mode).collect()
}

/// The mallet's thud, the iron that rings (a free bar's modes go as 3.01 squared, 5 squared, 7 squared), the stone that cracks, and chips.
pub(super) fn chisel(canvas: &mut Canvas, random: &mut Pcg32) {
    let base = between(random, 1500.0, 2100.0);
    let bar: Vec<(f64, f64, f64)> = [(1.0, 0.22, 0.5), (2.757, 0.16, 0.42), (5.404, 0.10, 0.3), (8.933, 0.06, 0.18)]
        .map(|(ratio, t60, level)| (base * ratio, t60, level))
        .to_vec();
    let iron = ring(&modes(random, 0.02, &bar), 0.35);
    let mallet = ring(&modes(random, 0.1, &[(170.0, 0.07, 0.7), (330.0, 0.05, 0.5), (610.0, 0.03, 0.3)]), 0.12);
    canvas.add(LEAD_S, &filtered(burst(random, 0.0003, 0.006, 1.0), Pass::High, 1500.0, 0.7), 0.9);
    canvas.add(LEAD_S, &iron, 1.0);
    canvas.add(LEAD_S, &mallet, 0.8);
    canvas.add(
        LEAD_S + 0.0008,
        &filtered(burst(random, 0.0005, 0.035, 1.0), Pass::Band, between(random, 2400.0, 3800.0), 0.8),
        0.8,
    );
    let mut at = between(random, 0.07, 0.14);
    for _ in 0..6 + random.next_u32() % 8 {
        let fall = between(random, 0.004, 0.015);
        let chip = burst(random, 0.0002, fall, 1.0);
        let hz = between(random, 2500.0, 8000.0);
        canvas.add(at, &filtered(chip, Pass::Band, hz, 3.0), between(random, 0.1, 0.5));
        at += wait(random, 22.0);
    }
}

/// A beam: few modes, soon gone.
pub(super) fn wood(canvas: &mut Canvas, random: &mut Pcg32) {
    let base = between(random, 170.0, 260.0);
    let table: Vec<(f64, f64, f64)> =
        [(1.0, 0.16, 1.0), (1.74, 0.12, 0.7), (2.76, 0.09, 0.5), (4.2, 0.06, 0.35), (6.3, 0.035, 0.25), (9.1, 0.02, 0.2)]
            .map(|(ratio, t60, level)| (base * ratio, t60, level))
            .to_vec();
    canvas.add(LEAD_S, &ring(&modes(random, 0.03, &table), 0.3), 1.0);
    canvas.add(LEAD_S, &filtered(burst(random, 0.0004, 0.008, 1.0), Pass::Band, 1900.0, 0.7), 0.5);
}

/// A sheet's many modes, damped by the pitch beneath it; and the tick of the hammer.
pub(super) fn gold(canvas: &mut Canvas, random: &mut Pcg32) {
    let mut table = Vec::new();
    let base = between(random, 620.0, 760.0);
    // a plate's modes are spread evenly in frequency; those of treble die first
    for k in 0..22_u32 {
        let hz = base * (1.0 + 0.62 * f64::from(k));
        table.push((hz, 0.11 / (1.0 + 0.09 * f64::from(k)), 0.5 / (1.0 + 0.12 * f64::from(k))));
    }
    canvas.add(LEAD_S, &ring(&modes(random, 0.05, &table), 0.25), 0.5);
    canvas.add(LEAD_S, &filtered(burst(random, 0.0002, 0.004, 1.0), Pass::High, 3000.0, 0.7), 0.8);
    canvas.add(LEAD_S, &ring(&modes(random, 0.05, &[(240.0, 0.05, 0.6), (420.0, 0.04, 0.4)]), 0.1), 0.7);
}

/// Gurgling of a heavy liquid, the roar of what boils at its edge, and spitting.
pub(super) fn pour(canvas: &mut Canvas, random: &mut Pcg32) {
    let length = canvas.seconds();
    let flow: Vec<f64> = (0..canvas.samples.len())
        .map(|k| {
            let t = k as f64 / RATE / length;
            let (rise, fall) = ((t / 0.12).min(1.0), ((1.0 - t) / 0.25).min(1.0));
            rise * rise * (3.0 - 2.0 * rise) * fall * fall
        })
        .collect();
    let wander = canvas.drift(random, 4.0);
    let curve: Vec<f64> = flow.iter().zip(&wander).map(|(flow, wander)| flow * (0.5 + 0.5 * wander)).collect();
    canvas.bed(random, &[(Pass::Band, 210.0, 0.8)], 0.9, &curve);
    canvas.bed(random, &[(Pass::Band, 520.0, 0.9)], 0.35, &curve);
    let hiss: Vec<f64> = flow.iter().map(|flow| flow.sqrt()).collect();
    canvas.bed(random, &[(Pass::High, 3800.0, 0.7), (Pass::Low, 10_000.0, 0.7)], 0.09, &hiss);
    let mut at = 0.05 * length;
    while at < 0.92 * length {
        at += wait(random, 26.0);
        let level = flow[((at * RATE) as usize).min(flow.len() - 1)];
        let hz = between(random, 140.0, 620.0);
        let gulp = ring(&[Mode { hz, t60_s: 18.0 / hz, level: 1.0 }], 0.2);
        canvas.add(at, &gulp, 0.35 * level * between(random, 0.3, 1.0));
        if random.next_f32() < 0.35 {
            let fall = between(random, 0.003, 0.02);
            let spit = burst(random, 0.0003, fall, 1.0);
            canvas.add(at, &filtered(spit, Pass::Band, between(random, 3000.0, 8000.0), 1.2), 0.5 * level);
        }
    }
}

/// A rising fifth and octave on small bars, struck softly.
pub(super) fn chime(canvas: &mut Canvas, random: &mut Pcg32) {
    for (k, hz) in [523.25, 783.99, 1046.5].into_iter().enumerate() {
        let hz = hz * between(random, 0.999, 1.001);
        let bar = [
            Mode { hz, t60_s: 1.9, level: 1.0 },
            Mode { hz: hz * 2.0, t60_s: 1.2, level: 0.18 },
            Mode { hz: hz * 2.757, t60_s: 0.6, level: 0.16 },
            Mode { hz: hz * 5.404, t60_s: 0.25, level: 0.06 },
        ];
        let mut note = ring(&bar, 2.2);
        // a felt mallet: it takes 5 milliseconds to be heard
        for (k, sample) in note.iter_mut().enumerate().take(240) {
            *sample *= 0.5 - 0.5 * libm::cos(std::f64::consts::PI * k as f64 / 240.0);
        }
        canvas.add(LEAD_S + 0.14 * k as f64, &note, 1.0 - 0.15 * k as f64);
    }
}
