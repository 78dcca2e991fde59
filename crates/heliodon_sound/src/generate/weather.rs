//! Fire, wind, water, dust.

use super::canvas::{Canvas, Pass, RATE, between, burst, filtered, frames, wait};
use heliodon_math::random::Pcg32;
use std::f64::consts::TAU;

/// A roar that swells, hissing, and crackles: most of them small, some loud, and some that come in volleys.
pub(super) fn fire(canvas: &mut Canvas, random: &mut Pcg32) {
    let curve: Vec<f64> = canvas.drift(random, 1.2).iter().map(|c| 0.5 + 0.5 * c).collect();
    canvas.bed(random, &[(Pass::Low, 260.0, 0.7), (Pass::High, 60.0, 0.7)], 1.0, &curve);
    let curve: Vec<f64> = canvas.drift(random, 5.0).iter().map(|c| 0.15 + c * c).collect();
    canvas.bed(random, &[(Pass::Band, 900.0, 0.5)], 0.12, &curve);
    let curve: Vec<f64> = canvas.drift(random, 2.5).iter().map(|c| c * c * c).collect();
    canvas.bed(random, &[(Pass::High, 3500.0, 0.7), (Pass::Low, 9000.0, 0.7)], 0.06, &curve);
    let mut at = 0.0;
    while at < canvas.seconds() {
        at += wait(random, 9.0);
        let volley = if random.next_f32() < 0.12 { 3 + (random.next_u32() % 7) } else { 1 };
        let mut when = at;
        for _ in 0..volley {
            // loudness falls off as a power: many small ones, few loud
            let level = 0.16 / libm::pow(between(random, 0.02, 1.0), 0.7);
            let (hz, fall) = (between(random, 900.0, 6500.0), between(random, 0.002, 0.014));
            let snap = burst(random, 0.0002, fall, level.min(1.8));
            canvas.add(when, &filtered(snap, Pass::Band, hz, between(random, 0.7, 2.5)), 1.6);
            when += wait(random, 60.0);
        }
    }
}

/// Three bands of noise that swell one after another: gusts go up in pitch as they grow.
pub(super) fn wind(canvas: &mut Canvas, random: &mut Pcg32) {
    let gusts = canvas.drift(random, 0.25);
    let flutter = canvas.drift(random, 1.6);
    for (hz, q, level, power) in
        [(110.0, 0.5, 1.0, 0.7), (260.0, 0.7, 1.0, 1.3), (520.0, 0.9, 0.8, 2.2), (1100.0, 1.4, 0.35, 3.4)]
    {
        let curve: Vec<f64> = gusts
            .iter()
            .zip(&flutter)
            .map(|(gust, flutter)| libm::pow(0.12 + 0.8 * gust, power) * (0.75 + 0.35 * flutter))
            .collect();
        canvas.bed(random, &[(Pass::Band, hz, q)], level, &curve);
    }
    let leaves: Vec<f64> = gusts.iter().map(|gust| gust * gust * 0.06).collect();
    canvas.bed(random, &[(Pass::High, 2500.0, 0.7), (Pass::Low, 7000.0, 0.7)], 1.0, &leaves);
}

/// Bubbles: K. van den Doel, "Physically based models for liquid sounds", ACM Transactions on Applied Perception 2(4), 2005. A
/// bubble of radius r rings at 3 m/s / r (Minnaert 1933), dies away with `0.13 / r + 0.0072 r^-1.5`, and rises in pitch.
fn bubble(random: &mut Pcg32, radius_m: f64) -> Vec<f64> {
    let (hz, damping) = (3.0 / radius_m, 0.13 / radius_m + 0.0072 * libm::pow(radius_m, -1.5));
    let rise = between(random, 0.0, 0.1) * damping;
    let mut phase = 0.0;
    (0..frames(6.0 / damping))
        .map(|k| {
            let t = k as f64 / RATE;
            phase += TAU * hz * (1.0 + rise * t) / RATE;
            // it is not there at once
            libm::sin(phase) * libm::exp(-damping * t) * (1.0 - libm::exp(-t * 2000.0))
        })
        .collect()
}

/// Bubbles over bubbles, and a little noise of the jet itself.
pub(super) fn water(canvas: &mut Canvas, random: &mut Pcg32) {
    let mut at = 0.0;
    while at < canvas.seconds() {
        at += wait(random, 260.0);
        let radius = 0.00075 * libm::pow(between(random, 0.02, 1.0), -0.65);
        let level = libm::pow(radius / 0.004, 0.9) * between(random, 0.2, 1.0);
        canvas.add(at, &bubble(random, radius.min(0.008)), level);
    }
    let curve: Vec<f64> = canvas.drift(random, 3.0).iter().map(|c| 0.7 + 0.3 * c).collect();
    canvas.bed(random, &[(Pass::Band, 1400.0, 0.4)], 0.05, &curve);
    canvas.bed(random, &[(Pass::High, 4000.0, 0.7)], 0.012, &curve);
}

/// Grains, ever fewer, on a sigh of dust.
pub(super) fn dust(canvas: &mut Canvas, random: &mut Pcg32) {
    let length = canvas.seconds();
    let mut at = super::LEAD_S;
    while at < length {
        let left = 1.0 - at / length;
        at += wait(random, 20.0 + 500.0 * left * left);
        let (hz, level) = (between(random, 1800.0, 9000.0), libm::pow(between(random, 0.05, 1.0), 2.0) * (0.2 + 0.8 * left));
        let fall = between(random, 0.001, 0.006);
        let grain = filtered(burst(random, 0.0002, fall, 1.0), Pass::Band, hz, 2.0);
        canvas.add(at, &grain, level);
    }
    let sigh: Vec<f64> = (0..canvas.samples.len())
        .map(|k| {
            let t = k as f64 / RATE / length;
            libm::pow(t, 0.3) * libm::exp(-4.0 * t)
        })
        .collect();
    canvas.bed(random, &[(Pass::Band, 600.0, 0.5)], 0.06, &sigh);
}
