//! Smooths noise within charts, edges kept.
//!
//! H. Dammertz, D. Sewtz, J. Hanika, H. Lensch: "Edge-Avoiding A-Trous Wavelet Transform for fast Global Illumination Filtering", HPG 2010, in the space of the light
//! map: five by five texels further and further apart, weighted by what they differ by in light (eq. 5), normal and place. It trades noise for a little blur; what
//! it was used on says so.

use crate::refine::Grid;
use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How noise is smoothed.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct DenoiseParams {
    /// How often, each with twice the distance between texels; 1 to 6. More smooths further.
    pub rounds: u32,
    /// What light may differ by to be smoothed away, as a part of it, above 0; more blurs the edges of shadows.
    pub contrast: f32,
}

impl Default for DenoiseParams {
    fn default() -> Self {
        Self { rounds: 3, contrast: 0.1 }
    }
}

/// A cubic B-spline's weights.
const SPLINE: [f32; 5] = [1.0 / 16.0, 1.0 / 4.0, 3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];
/// Texels off each other's planes by more than this part of their distance lie on other surfaces.
const OFF_PLANE: f32 = 0.2;
/// The power of the cosine between normals.
const FACING: i32 = 32;

/// Smooths the light of a grid's texels.
pub(super) fn denoise(grid: &Grid, light: &mut Vec<Vec3>, params: &DenoiseParams) {
    for round in 0..params.rounds {
        let step = 1 << round;
        // what is left of noise is halved each time
        let contrast = params.contrast / step as f32;
        let smooth = |texel: u32| {
            let (own, place) = (light[texel as usize], grid.places()[texel as usize]);
            let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
            for (j, along_y) in SPLINE.iter().enumerate() {
                for (i, along_x) in SPLINE.iter().enumerate() {
                    let Some(other) = grid.beside(texel, (i as i32 - 2) * step, (j as i32 - 2) * step) else { continue };
                    let (light, there) = (light[other as usize], grid.places()[other as usize]);
                    let away = there.position - place.position;
                    let off_plane = away.dot(place.normal).abs() > OFF_PLANE * away.length();
                    let facing = place.normal.dot(there.normal).max(0.0).powi(FACING);
                    let scale = contrast * (own + light).max_element();
                    let off = (own - light).abs().max_element();
                    let alike =
                        if scale > 0.0 { libm::expf(-(off * off) / (scale * scale)) } else { f32::from(u8::from(off == 0.0)) };
                    let weight = if off_plane { 0.0 } else { along_x * along_y * facing * alike };
                    sum += light * weight;
                    weights += weight;
                }
            }
            if weights > 0.0 { sum / weights } else { own }
        };
        *light = (0..light.len() as u32).into_par_iter().map(smooth).collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::Place;
    use crate::texels::Texel;
    use heliodon_math::random::Pcg32;

    #[test]
    fn noise_goes_and_edges_stay() {
        let side = 64_u16;
        let texel = |i: u16| Texel { x: i % side, y: i / side, sheet: 0, is_covered: true, triangle: 0, weights: Vec3::X };
        let texels: Vec<Texel> = (0..side * side).map(texel).collect();
        let place = |t: &Texel| Place { position: Vec3::new(f32::from(t.x), 0.0, f32::from(t.y)), normal: Vec3::Y };
        let grid = Grid::new(&texels, &[0], texels.iter().map(place).collect());
        let truth = |t: &Texel| Vec3::splat(if t.x < 30 { 1.0 } else { 0.3 });
        let mut rng = Pcg32::new(4, 4);
        let mut light: Vec<Vec3> = texels.iter().map(|t| truth(t) * rng.range_f32(0.92, 1.08)).collect();
        let error = |light: &[Vec3]| {
            let off = texels.iter().zip(light).map(|(t, l)| ((truth(t) - *l) / truth(t)).length_squared());
            (off.sum::<f32>() / light.len() as f32).sqrt()
        };
        let before = error(&light);
        denoise(&grid, &mut light, &DenoiseParams::default());
        assert!(error(&light) < 0.35 * before, "{} of {before}", error(&light));
        let beside_edge = [light[29], light[30]].map(|l| l.x);
        assert!((beside_edge[0] - 1.0).abs() < 0.05 && (beside_edge[1] - 0.3).abs() < 0.02, "{beside_edge:?}");
    }
}
