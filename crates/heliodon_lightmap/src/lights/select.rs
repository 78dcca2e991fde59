//! One light out of many.

use crate::lights::light::Light;
use glam::Vec3;

/// A light that was picked for a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PickedLight {
    /// Its place in the slice.
    pub index: usize,
    /// With which chance it was picked, above 0, at most 1: divide its light by it, and multiply its densities by it.
    pub chance: f32,
    /// A number in [0, 1) for the light itself, from what the choice left of the one given: neighbouring numbers stay neighbours.
    pub number: f32,
}

/// Picks one of some lights for a point of unit normal `normal`, each with a chance in proportion to [`Light::upper_bound`]; the estimate stays
/// unbiased, for that is 0 only where nothing comes. `None` where no light can reach the point. Each light is asked: for hundreds of them, ask
/// once for a group of texels and keep those of the greatest [`Light::power`] near it.
///
/// Shirley, Wang, Zimmerman: "Monte Carlo Techniques for Direct Lighting Calculations", ACM TOG 15(1), 1996.
#[must_use]
pub fn pick_light(lights: &[Light], point: Vec3, normal: Vec3, number: f32) -> Option<PickedLight> {
    let weight = |light: &Light| f64::from(light.upper_bound(point, normal));
    let total: f64 = lights.iter().map(weight).sum();
    let wanted = f64::from(number) * total;
    let (mut sum, mut picked) = (0.0, None);
    for (index, light) in lights.iter().enumerate() {
        let weight = weight(light);
        if weight > 0.0 {
            // the last that shines stays picked where rounding leaves the number beyond all sums
            let within = ((wanted - sum) / weight).clamp(0.0, 1.0);
            let below_one = (within as f32).min(1.0 - f32::EPSILON);
            picked = Some(PickedLight { index, chance: (weight / total) as f32, number: below_one });
            sum += weight;
            if wanted < sum {
                break;
            }
        }
    }
    picked.filter(|picked| picked.chance > 0.0)
}
