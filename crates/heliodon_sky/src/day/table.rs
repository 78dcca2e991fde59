//! The lapse as text.

use crate::lapse::Lapse;
use glam::Vec3;
use heliodon_math::color::luminance;
use heliodon_math::sphere::azimuth_elevation_from_direction;
use std::fmt::Write;

/// A table of a lapse for people: time, the sun's compass bearing and height, its irradiance, the sky's mean radiance, and the exposure. `north_deg`
/// is the compass bearing of the model's -Z.
#[must_use]
pub fn table(lapse: &Lapse, north_deg: f64) -> String {
    let mut text = String::from(
        "time      sun step  azimuth  height   sun irradiance (R G B)            mean sky (R G B)                  stops\n",
    );
    for step in &lapse.steps {
        let sun = match step.sun {
            Some(sun) => {
                let (azimuth, height) = azimuth_elevation_from_direction(Vec3::from_array(sun.direction));
                let bearing = (f64::from(azimuth).to_degrees() + north_deg).rem_euclid(360.0);
                let [r, g, b] = sun.irradiance;
                let clipped = if sun.clipped { " clipped" } else { "" };
                format!("{bearing:>7.2}  {:>6.2}  {r:>9.3e} {g:>9.3e} {b:>9.3e}{clipped:<8}", height.to_degrees())
            }
            None => format!("{:<53}", "      -       -  no sun"),
        };
        // the mean of y_0's part over the sphere
        let mean = step.sky.first().map_or(Vec3::ZERO, |s| Vec3::from_array(*s) * 0.282_094_8);
        // writing to a string cannot fail
        let _ = writeln!(
            text,
            "{:<9} {:>8}  {sun} {:>9.3e} {:>9.3e} {:>9.3e}  {:>7.2}",
            step.time, step.mask_bit, mean.x, mean.y, mean.z, step.exposure_stops
        );
    }
    let suns = lapse.steps.iter().filter(|s| s.sun.is_some()).count();
    let brightest =
        lapse.steps.iter().filter_map(|s| s.sun).map(|s| luminance(Vec3::from_array(s.irradiance))).fold(0.0, f32::max);
    let _ = writeln!(text, "{} entries, {suns} with a sun, the strongest of luminance {brightest:.3e}", lapse.steps.len());
    text
}
