//! What light there is, and what surfaces make of it: both can be told by others.
//!
//! The tool of Papaioannou, Gaitatzes and Christopoulos (2003, section 4) "is built on top an extensible shader and illumination architecture", for "custom
//! illumination (e.g. skylight or cartoon models)". An [`Illumination`] says what arrives along a ray, a [`SurfaceModel`] what a surface makes of what arrives. Both are
//! traits; `examples/own_model.rs` adds one of each kind from outside.

use crate::refine::Place;
use glam::Vec3;
use heliodon_math::color::luminance;
use heliodon_math::dome::Environment;

/// What arrives at a texel.
pub trait Illumination: Sync {
    /// Its name, for the notes of a result.
    fn name(&self) -> &str;

    /// Whether the scene's lights shine.
    fn has_lights(&self) -> bool {
        true
    }

    /// How often light is reflected from surface to surface, of as many times as were asked for.
    fn bounces(&self, asked: u32) -> u32 {
        asked
    }

    /// Radiance that comes from a unit direction in which nothing is met.
    fn escaped(&self, sky: &dyn Environment, direction: Vec3) -> Vec3 {
        sky.radiance(direction)
    }

    /// Whether what escapes is the sky's light, so that its bright places are looked at more closely.
    fn is_sky_seen(&self) -> bool {
        true
    }

    /// Radiance that comes from a direction in which something is met so far away, beside what it reflects.
    fn met(&self, _distance_m: f32) -> Vec3 {
        Vec3::ZERO
    }

    /// What arrives of the radiance that something reflects so far away.
    fn reflected(&self, radiance: Vec3, _distance_m: f32) -> Vec3 {
        radiance
    }
}

/// What a surface makes of the light.
pub trait SurfaceModel: Sync {
    /// Its name, for the notes of a result.
    fn name(&self) -> &str;

    /// What part of the light is handed on to other surfaces, of the albedo that the surface has.
    fn handed_on(&self, albedo: Vec3) -> Vec3 {
        albedo
    }

    /// How much light counts that comes at an angle to the normal of this cosine, in (0, 1].
    fn response(&self, cosine: f32) -> f32 {
        cosine
    }

    /// Whether [`SurfaceModel::response`] is the cosine itself, so that closed forms hold.
    fn is_lambertian(&self) -> bool {
        true
    }

    /// What is written for a place that has so much light (irradiance over pi), at the very end. `bright` is the luminance that 95 of 100 texels do not exceed, or, where
    /// that is none, 95 of 100 of those that are lit: what is made of light by it does not depend on how strong all lights together are.
    fn shown(&self, light: Vec3, _place: &Place, _bright: f32) -> Vec3 {
        light
    }
}

/// All light: lights, sky, and what surfaces reflect.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Realistic;

impl Illumination for Realistic {
    fn name(&self) -> &str {
        "realistic"
    }
}

/// The sky alone, as far as it is seen: what light maps of the paper's time had.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SkyOnly;

impl Illumination for SkyOnly {
    fn name(&self) -> &str {
        "sky only"
    }

    fn has_lights(&self) -> bool {
        false
    }

    fn bounces(&self, _asked: u32) -> u32 {
        0
    }
}

/// How open a place is, whatever light there is: 1 where nothing lies around, 0 in a closed box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OcclusionOnly {
    /// What is further away than this does not count, metres; what is nearer counts the less the further, as a parabola. Infinite: everything counts wholly.
    pub radius_m: f32,
}

impl Default for OcclusionOnly {
    fn default() -> Self {
        Self { radius_m: f32::INFINITY }
    }
}

impl Illumination for OcclusionOnly {
    fn name(&self) -> &str {
        "occlusion only"
    }

    fn has_lights(&self) -> bool {
        false
    }

    fn bounces(&self, _asked: u32) -> u32 {
        0
    }

    fn escaped(&self, _sky: &dyn Environment, _direction: Vec3) -> Vec3 {
        Vec3::ONE
    }

    fn is_sky_seen(&self) -> bool {
        false
    }

    fn met(&self, distance_m: f32) -> Vec3 {
        let share = distance_m / self.radius_m;
        Vec3::splat((share * share).min(1.0))
    }
}

/// Matt stone, as everywhere in this house.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lambertian;

impl SurfaceModel for Lambertian {
    fn name(&self) -> &str {
        "lambertian"
    }
}

/// A drawing: light in a few even bands, its hue kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cartoon {
    /// How many bands there are, at least 1, the darkest not black.
    pub bands: u32,
    /// The luminance of the lightest band, above 0; without it the one that 95 of 100 texels do not exceed.
    pub white: Option<f32>,
    /// What part of a band's breadth the way to the next takes, 0 a hard edge to 1 no bands at all.
    pub softness: f32,
}

impl Default for Cartoon {
    fn default() -> Self {
        Self { bands: 3, white: None, softness: 0.1 }
    }
}

impl SurfaceModel for Cartoon {
    fn name(&self) -> &str {
        "cartoon"
    }

    fn shown(&self, light: Vec3, _place: &Place, bright: f32) -> Vec3 {
        let own = luminance(light);
        let white = self.white.unwrap_or(bright);
        if own <= 0.0 {
            return Vec3::ZERO;
        }
        let bands = self.bands.max(1) as f32;
        let at = (own / white).clamp(0.0, 1.0) * bands;
        let band = at.floor().min(bands - 1.0);
        let soft = self.softness.clamp(1.0e-6, 1.0);
        // the last part of each band leads over to the next one
        let over = if band + 1.0 < bands { ((at - band - (1.0 - soft)) / soft).clamp(0.0, 1.0) } else { 0.0 };
        let level = (band + over + 1.0) / bands * white;
        light * (level / own)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_are_few_and_even_and_keep_the_hue() {
        let place = Place { position: Vec3::ZERO, normal: Vec3::Y };
        let cartoon = Cartoon { bands: 4, white: Some(2.0), softness: 0.0 };
        let shown = |cartoon: &Cartoon, light: Vec3| cartoon.shown(light, &place, 7.0);
        let levels = |cartoon: &Cartoon, scale: f32| {
            let mut levels: Vec<u32> = (1..1000)
                .map(|i| luminance(shown(cartoon, Vec3::splat(i as f32 * 0.003 * scale))))
                .map(|level| (level * 1000.0).round() as u32)
                .collect();
            levels.dedup();
            levels
        };
        assert_eq!(levels(&cartoon, 1.0), [500, 1000, 1500, 2000]);
        assert_eq!(levels(&Cartoon { white: None, ..cartoon }, 3.0), [1750, 3500, 5250, 7000], "what is bright is white");
        let tinted = shown(&cartoon, Vec3::new(0.2, 0.4, 0.8));
        assert!((tinted.y / tinted.x - 2.0).abs() < 1e-5 && (tinted.z / tinted.x - 4.0).abs() < 1e-5);
        assert_eq!(shown(&cartoon, Vec3::ZERO), Vec3::ZERO);
        let smooth = Cartoon { softness: 1.0, ..cartoon };
        let (a, b) = (shown(&smooth, Vec3::splat(0.7499)), shown(&smooth, Vec3::splat(0.7501)));
        assert!((a - b).length() < 1e-3);
    }
}
