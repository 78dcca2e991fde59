//! What weather has left, as a layer over the albedo.

use super::Amounts;
use glam::Vec3;

/// How much of it shows, and in which colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// How far dust covers the surface where it lies thickest, 0 to 1.
    pub dust: f32,
    /// How far the corroded surface takes the place of the sound one where it is exposed most, 0 to 1.
    pub corrosion: f32,
    /// Albedo of the dust, linear, each in [0, 1].
    pub dust_color: Vec3,
    /// Albedo of the corroded surface.
    pub corrosion_color: Vec3,
}

/// A layer over a surface, colour times cover, so that layers are filtered as they are: what lies below shows by `1 - cover`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Layer {
    /// Its albedo times its cover, linear, each in [0, `cover`].
    pub paint: Vec3,
    /// The part of the surface that it covers, 0 to 1.
    pub cover: f32,
}

impl Look {
    /// Whether nothing of it shows.
    #[must_use]
    pub fn is_off(&self) -> bool {
        self.dust <= 0.0 && self.corrosion <= 0.0
    }

    /// The layer of some amounts: dust over the corroded surface.
    #[must_use]
    pub fn layer(&self, amounts: Amounts) -> Layer {
        let part = |strength: f32, amount: f32| (strength * amount).clamp(0.0, 1.0);
        let (dust, corroded) = (part(self.dust, amounts.dust), part(self.corrosion, amounts.corrosion));
        let below = corroded * (1.0 - dust);
        Layer { paint: self.dust_color * dust + self.corrosion_color * below, cover: dust + below }
    }
}

impl Layer {
    /// The albedo of a surface under it.
    #[must_use]
    pub fn over(self, albedo: Vec3) -> Vec3 {
        albedo * (1.0 - self.cover) + self.paint
    }

    /// The factor of a texture's colour, in place of `factor`, that comes closest to the layer: right where the texture shows its `mean`, and never above 1, so that
    /// dust that is brighter than the mean brightens it no further.
    #[must_use]
    pub fn factor(self, factor: Vec3, mean: Vec3) -> Vec3 {
        if self == Self::default() {
            return factor;
        }
        let weathered = self.over(factor * mean);
        // below this, any factor shows black
        let black = Vec3::splat(1.0 / 4096.0);
        Vec3::select(mean.cmpgt(black), weathered / mean.max(black), factor).clamp(Vec3::ZERO, Vec3::ONE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOOK: Look =
        Look { dust: 0.8, corrosion: 0.5, dust_color: Vec3::new(0.4, 0.3, 0.2), corrosion_color: Vec3::new(0.1, 0.1, 0.05) };

    #[test]
    fn layers_mix_corrosion_first_and_dust_over_it() {
        let albedo = Vec3::new(0.9, 0.6, 0.3);
        for (dust, corrosion) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.3, 0.7), (1.0, 1.0)] {
            let corroded = albedo.lerp(LOOK.corrosion_color, corrosion * LOOK.corrosion);
            let both = corroded.lerp(LOOK.dust_color, dust * LOOK.dust);
            let layer = LOOK.layer(Amounts { dust, corrosion });
            assert!(layer.over(albedo).abs_diff_eq(both, 1e-6), "{} {both}", layer.over(albedo));
            assert!(layer.cover <= 1.0 && layer.paint.max_element() <= layer.cover);
        }
        let nothing = LOOK.layer(Amounts::default());
        assert_eq!(nothing.over(albedo), albedo, "not a bit of what is not weathered changes");
    }

    #[test]
    fn textures_are_weathered_at_their_mean() {
        let (factor, mean) = (Vec3::new(0.9, 0.8, 0.7), Vec3::new(0.5, 0.4, 0.6));
        let layer = LOOK.layer(Amounts { dust: 0.2, corrosion: 0.9 });
        assert!((layer.factor(factor, mean) * mean).abs_diff_eq(layer.over(factor * mean), 1e-6));
        assert_eq!(Layer::default().factor(factor, Vec3::ZERO), factor);
        let thick = LOOK.layer(Amounts { dust: 1.0, corrosion: 0.0 });
        assert_eq!(
            thick.factor(Vec3::ONE, Vec3::new(0.05, 0.0, 0.9)).truncate(),
            glam::Vec2::ONE,
            "dark textures stay as they are"
        );
    }
}
