//! Linear albedos of the workshop's materials.

use glam::Vec3;
use heliodon_math::random::Pcg32;

/// What a piece is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Material {
    Plaster,
    Limestone,
    Flagstone,
    Marble,
    Ivory,
    Gold,
    Ebony,
    Timber,
    Plank,
    Clay,
    Bronze,
    RoofTile,
    Earth,
}

/// Albedos that vary from piece to piece.
pub struct Palette {
    random: Pcg32,
}

impl Palette {
    /// One whose variation depends on the seed and, for each part of the workshop, on its stream.
    pub fn new(seed: u32, stream: u64) -> Self {
        Self { random: Pcg32::new(u64::from(seed), stream) }
    }

    /// The albedo of one piece.
    pub fn pick(&mut self, material: Material) -> Vec3 {
        let (mean, spread) = match material {
            Material::Plaster => ([0.66, 0.61, 0.52], 0.0),
            Material::Limestone => ([0.46, 0.42, 0.35], 0.08),
            Material::Flagstone => ([0.36, 0.33, 0.285], 0.13),
            Material::Marble => ([0.72, 0.70, 0.66], 0.03),
            Material::Ivory => ([0.74, 0.66, 0.53], 0.0),
            Material::Gold => ([0.62, 0.43, 0.14], 0.04),
            Material::Ebony => ([0.10, 0.07, 0.05], 0.1),
            Material::Timber => ([0.22, 0.145, 0.085], 0.15),
            Material::Plank => ([0.33, 0.23, 0.14], 0.18),
            Material::Clay => ([0.42, 0.22, 0.13], 0.15),
            Material::Bronze => ([0.27, 0.18, 0.08], 0.1),
            Material::RoofTile => ([0.40, 0.21, 0.13], 0.08),
            Material::Earth => ([0.40, 0.33, 0.235], 0.0),
        };
        Vec3::from_array(mean) * (1.0 + spread * self.random.range_f32(-1.0, 1.0))
    }

    /// A number in [low, high), for what is not quite straight.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        self.random.range_f32(low, high)
    }
}
