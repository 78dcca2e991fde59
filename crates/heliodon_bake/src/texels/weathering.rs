//! Weathering in texels: too fine for the few vertices of what is lit by them.

use super::atlas::{Atlas, Texels};
use super::levels::{Owners, coarser, mean};
use super::spread;
use crate::error::BakeError;
use crate::light::LightInput;
use crate::scene::Scene;
use crate::stages::{Work, lay_out};
use crate::weathering::at_points;
use glam::Vec3;
use heliodon_bundle::texels::{TEXEL_LEVELS, WEATHERING_LEVEL, weathering_texture};
use heliodon_image::ktx2::Ktx2;
use heliodon_light::{PointSet, Receiving};
use heliodon_lightmap::texels::Texel;
use heliodon_lightmap::weathering::{Amounts, Climate, Layer, Look};
use heliodon_rays::{Ray, TriangleScene};

/// Directions that are asked whether a point lies inside something: the winding number in most of them. None lies in a plane that people build.
const ASKED: [Vec3; 5] = [
    Vec3::new(0.21, 0.93, 0.13),
    Vec3::new(-0.57, 0.31, 0.43),
    Vec3::new(0.37, 0.17, -0.83),
    Vec3::new(0.71, -0.41, 0.29),
    Vec3::new(-0.33, -0.67, -0.51),
];

/// What the weather leaves at each texel of an atlas's level for it; at those inside something what it leaves at the nearest of their chart that are not.
///
/// # Errors
/// As [`crate::weathering::bake_weathering`].
pub fn weather_texels(
    climate: &Climate,
    input: &LightInput,
    (scene, atlas): (&Scene, &Atlas),
    work: &Work,
    name: &str,
) -> Result<Vec<Amounts>, BakeError> {
    let (surfaces, params) = (&input.surfaces, input.params);
    let layout = lay_out(surfaces, params, &input.names.sight, work.cache)?;
    let texels = atlas.texels(scene, WEATHERING_LEVEL);
    let places: Vec<_> = texels.texels.iter().map(|texel| atlas.place(texel)).collect();
    let receiving = Receiving::new(surfaces, &layout, params);
    let receivers = receiving.at(&places);
    let points = receivers.points();
    let of_points = at_points(points, surfaces.rays, climate, work, (name, "weather on texels"))?;
    let amounts = receivers.in_order_of_places(&of_points, 1);
    let valid = receivers.in_order_of_places(&is_outside(surfaces.rays, points), 1);
    Ok(texels.grid.nearest_valid(&valid).into_iter().map(|texel| amounts[texel as usize]).collect())
}

/// Whether each point lies outside of all that is closed.
fn is_outside(rays: &TriangleScene, points: &PointSet) -> Vec<bool> {
    let mut inside = vec![0_usize; points.len()];
    let mut counts = vec![0_i32; points.len()];
    for direction in ASKED {
        let ray = |&origin: &Vec3| Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
        let asked: Vec<Ray> = points.origins.iter().map(ray).collect();
        rays.enclosures(&asked, &mut counts);
        inside.iter_mut().zip(&counts).for_each(|(inside, &count)| *inside += usize::from(count > 0));
    }
    inside.into_iter().map(|inside| 2 * inside < ASKED.len()).collect()
}

/// The bundle's texture of it; `looks` are the parts'.
#[must_use]
pub fn weathering_layer(scene: &Scene, atlas: &Atlas, amounts: &[Amounts], looks: &[Option<Look>]) -> Ktx2 {
    let levels: Vec<Texels> = (WEATHERING_LEVEL..TEXEL_LEVELS).map(|level| atlas.texels(scene, level)).collect();
    let owners: Vec<Owners> =
        levels.iter().map(|level| Owners::new(level.side, &level.texels, &atlas.unwrapped().chart)).collect();
    let layer = |(texel, &amounts): (&Texel, &Amounts)| {
        let look = looks[atlas.part_of_triangle(texel.triangle)].as_ref();
        let Layer { paint, cover } = look.map_or_else(Layer::default, |look| look.layer(amounts));
        paint.extend(cover).to_array()
    };
    let finest: Vec<f32> = levels[0].texels.iter().zip(amounts).flat_map(layer).collect();
    let mut all = vec![spread(&levels[0], &finest, 4)];
    for pair in owners.windows(2) {
        all.extend(all.last().map(|finer| coarser(&pair[1], (&pair[0], finer), 4, mean)));
    }
    let all: Vec<Vec<[f32; 4]>> = all.iter().map(|level| level.as_chunks().0.to_vec()).collect();
    weathering_texture([levels[0].side; 2], &all)
}
