//! An exposure for each entry.

use super::Entry;
use glam::Vec3;
use heliodon_math::color::luminance;
use heliodon_math::sh::open_transfer9;
use std::f32::consts::PI;

/// How much of the day's change the exposure follows: about two thirds, so that dawn stays darker than noon.
const FOLLOWED: f32 = 2.0 / 3.0;

/// The exposed light of the brightest hour on a surface of no particular orientation. Pale marble (albedo 0.75) that faces the sun then
/// comes to about 0.85.
const BRIGHTEST: f32 = 0.7;

/// Stops of each entry: a grey surface's light, half of it level and half upright towards four sides, smoothed over a fiftieth of the day.
pub(super) fn stops(entries: &[Entry]) -> Vec<f32> {
    let levels: Vec<f32> = entries.iter().map(|e| libm::log2f(light(e).max(1e-12))).collect();
    let smooth = smoothed(&levels, entries.len() as f32 / 100.0);
    let brightest = smooth.iter().copied().fold(f32::MIN, f32::max);
    smooth.iter().map(|level| libm::log2f(BRIGHTEST) - brightest + FOLLOWED * (brightest - level)).collect()
}

/// Luminance of the light (irradiance / pi) in the open.
fn light(entry: &Entry) -> f32 {
    let on = |normal: Vec3| {
        let sky: Vec3 = entry.sky.iter().zip(open_transfer9(normal)).map(|(&s, t)| s * t).sum();
        let sun = entry.sun.map_or(Vec3::ZERO, |sun| {
            Vec3::from_array(sun.irradiance) * (Vec3::from_array(sun.direction).dot(normal).max(0.0) / PI)
        });
        luminance(sky.max(Vec3::ZERO) + sun)
    };
    let upright = [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z].map(on);
    0.5 * on(Vec3::Y) + 0.125 * upright.iter().sum::<f32>()
}

/// A Gaussian mean whose standard deviation is `sigma` entries; at the ends the last value goes on.
fn smoothed(values: &[f32], sigma: f32) -> Vec<f32> {
    let reach = libm::ceilf(3.0 * sigma) as i64;
    let weight = |d: i64| libm::expf(-0.5 * (d as f32 / sigma.max(1e-3)).powi(2));
    let last = values.len() as i64 - 1;
    (0..=last)
        .map(|i| {
            let (mut sum, mut weights) = (0.0, 0.0);
            for d in -reach..=reach {
                sum += weight(d) * values[(i + d).clamp(0, last) as usize];
                weights += weight(d);
            }
            sum / weights
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::civil::TimeOfDay;

    fn entry(radiance: f32) -> Entry {
        let mut sky = vec![Vec3::ZERO; 4];
        sky[0] = Vec3::splat(radiance * (4.0 * PI).sqrt());
        Entry { time: TimeOfDay::NOON, sun: None, sky, fitted: None, map: String::new(), sun_in_map: false }
    }

    #[test]
    fn exposure_follows_two_thirds_of_the_change() {
        assert!((light(&entry(1.0)) - 1.0).abs() < 1e-5, "a uniform sky of 1 gives every surface 1");
        let single = stops(&[entry(4.0)]);
        assert!((single[0] - libm::log2f(0.7 / 4.0)).abs() < 1e-5);
        // dark, bright: six stops apart, so four are made up and two remain
        let day: Vec<Entry> = (0..200).map(|i| entry(if i < 100 { 1.0 } else { 64.0 })).collect();
        let stops = stops(&day);
        assert!((stops[0] - stops[199] - 4.0).abs() < 1e-3);
        assert!(stops.windows(2).all(|w| (w[1] - w[0]).abs() < 0.9), "smooth in time");
        assert!(stops.windows(2).all(|w| w[1] <= w[0] + 1e-5));
    }
}
