//! What each photograph says of each texel that it sees: a colour, and how much that is to count.

use super::eye::{Outlines, shown, to_camera};
use super::layout::Layout;
use super::pyramid::Pyramid;
use super::surface::Surface;
use super::{Photograph, TextureError, TextureParams};
use crate::camera::Camera;
use glam::{DVec2, Vec3};
use heliodon_rays::Ray;
use rayon::prelude::*;

/// A photograph's word on a texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Which texel.
    pub texel: u32,
    /// Linear, as the photograph has it.
    pub color: Vec3,
    /// How fine it is, square pixels for a square metre, and how far from borders and outlines: goes to 0 at both.
    pub weight: f32,
    /// Whether its brightness is that of the place alone, and can be compared with that of others.
    pub tells: bool,
}

/// Texels that are asked for together.
const BLOCK: usize = 4096;
/// What remains of the weight of a pixel whose sensor was at its end, or that shows two faces: better it than nothing.
const LEAST_TELLING: f32 = 1.0e-2;

/// 0 at 0 and 1 from 1 on, without corners.
fn smooth(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// Those of a photograph's samples that are of some texels.
pub(super) fn within(samples: &[Sample], texels: std::ops::Range<usize>) -> &[Sample] {
    let at = |texel: usize| samples.partition_point(|sample| (sample.texel as usize) < texel);
    &samples[at(texels.start)..at(texels.end)]
}

/// A photograph's samples, in the order of texels. What reading it changed is added to `warnings`.
pub(super) fn layer(
    photograph: &Photograph,
    surface: &Surface,
    layout: &Layout,
    params: &TextureParams,
    warnings: &mut Vec<String>,
) -> Result<Vec<Sample>, TextureError> {
    // before the pixels are there: what it takes to find outlines is gone by then
    let outlines = Outlines::new(&photograph.camera, surface);
    let mut samples = Ok(Vec::new());
    let told = photograph.picture.show(&mut |picture| {
        samples = photograph.check(picture.size()).map(|()| {
            let pyramid = Pyramid::new(picture);
            looked_up(&photograph.camera, &pyramid, &outlines, surface, layout, params)
        });
    });
    warnings.extend(told.map_err(|why| photograph.unread(why))?);
    samples
}

fn looked_up(
    camera: &Camera,
    pyramid: &Pyramid,
    outlines: &Outlines,
    surface: &Surface,
    layout: &Layout,
    params: &TextureParams,
) -> Vec<Sample> {
    let offset_m = params.offset_m + surface.scene.start_offset();
    let (centre, least) = (camera.centre(), params.least_cosine());
    let size = DVec2::new(f64::from(camera.intrinsics.width), f64::from(camera.intrinsics.height));
    let per_m_of = |texel: usize| layout.per_m[layout.starts.partition_point(|start| *start <= texel) - 1];
    let block = |(block, texels): (usize, &[super::layout::Texel])| {
        let mut candidates: Vec<(u32, DVec2, f32, f32)> = Vec::new();
        let mut rays: Vec<Ray> = Vec::new();
        for (i, texel) in texels.iter().enumerate() {
            let normal = surface.triangles[texel.triangle as usize].normal;
            let Some(shown) = shown(camera, texel.place, normal) else { continue };
            // from the least angle on over a tenth of the cosine
            let steep = smooth((shown.cosine - least) / 0.1);
            let to_border = shown.pixel.min(size - shown.pixel).min_element() as f32;
            let border = smooth(to_border / params.feather_px);
            let distance_m = centre.distance(texel.place.as_dvec3());
            let outline = smooth(outlines.clear_px(shown.pixel, distance_m, params.edge_px) / params.feather_px);
            let tells = pyramid.tells(shown.pixel) && !outlines.is_mixed(shown.pixel);
            let telling = if outlines.is_mixed(shown.pixel) { LEAST_TELLING } else { 1.0 };
            let telling = telling * smooth(pyramid.headroom(shown.pixel)).max(LEAST_TELLING);
            let weight = shown.px_per_m * shown.px_per_m * steep * border * outline * telling;
            if weight > 0.0 {
                candidates.push((
                    (block * BLOCK + i) as u32,
                    shown.pixel,
                    shown.px_per_m,
                    if tells { weight } else { -weight },
                ));
                rays.push(to_camera(camera, texel.place, normal, offset_m));
            }
        }
        let mut occluded = vec![0; rays.len().div_ceil(64)];
        surface.scene.occluded(&rays, &mut occluded);
        let sees = |i: &usize| occluded[i / 64] >> (i % 64) & 1 == 0;
        let sample = |i: usize| {
            let (texel, pixel, px_per_m, weight) = candidates[i];
            let color = pyramid.sample(pixel, px_per_m / per_m_of(texel as usize));
            Sample { texel, color, weight: weight.abs(), tells: weight > 0.0 }
        };
        (0..rays.len()).filter(sees).map(sample).collect::<Vec<Sample>>()
    };
    layout.texels.par_chunks(BLOCK).enumerate().flat_map_iter(block).collect()
}
