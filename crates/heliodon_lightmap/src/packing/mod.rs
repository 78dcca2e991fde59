//! Packing: all charts into one texture of the size that is asked for, as large as they can be.
//!
//! At one scale charts are laid, the longest first, each turned by the quarter with which it comes to lie lowest, where all texels are free that filtering
//! takes into account on it; small ones fill what large ones leave. The scale itself is searched for: several are tried at once, then several between the
//! largest that fits and the least that does not.

mod mask;
mod sheet;

use crate::charts::Chart;
use glam::{Vec2, Vec3};
use mask::{INSET, Mask};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sheet::{LARGEST, Sheet};
use std::cmp::Reverse;

/// How charts are packed.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct PackParams {
    /// Texels of a texture along u, 1 to 16,384.
    pub width: u32,
    /// And along v.
    pub height: u32,
    /// Texels that stay free between those that filtering takes into account on two charts.
    pub margin: u32,
    /// Textures at most, at least 1; more leave charts more texels.
    pub sheets: u32,
    /// Texels for a metre at most; infinite fills the texture.
    pub most_per_m: f32,
}

impl Default for PackParams {
    fn default() -> Self {
        Self { width: 2048, height: 2048, margin: 2, sheets: 1, most_per_m: f32::INFINITY }
    }
}

/// Why charts were not packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PackError {
    /// A texture side of 0, or too large.
    #[error("a texture of {width} by {height} texels; sides are 1 to {LARGEST}")]
    Size {
        /// Texels along u.
        width: u32,
        /// And along v.
        height: u32,
    },
    /// More charts than texels.
    #[error(
        "{charts} charts do not fit into {width} by {height} texels; the smallest square that holds them has {smallest} a side"
    )]
    TooSmall {
        /// How many there are.
        charts: usize,
        /// Texels along u.
        width: u32,
        /// And along v.
        height: u32,
        /// The side of a square that has room for each, one texel large.
        smallest: u64,
    },
}

/// Where a chart lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// In which texture.
    pub sheet: u32,
    /// By how many quarters it is turned, anticlockwise.
    pub quarters: u8,
    /// What is added then, texels.
    pub offset: Vec2,
}

/// All charts, packed.
#[derive(Clone, Debug, PartialEq)]
pub struct Packing {
    /// Texels for a metre of surface of density 1.
    pub per_m: f32,
    /// Chart by chart.
    pub placements: Vec<Placement>,
    /// Textures that were used.
    pub sheets: u32,
    /// The part of the textures that triangles cover.
    pub utilisation: f32,
}

impl Packing {
    /// Where a place of a chart lies in its texture, texels from the first one's corner.
    #[must_use]
    pub fn texel(&self, chart: usize, charts: &[Chart], place: Vec3) -> Vec2 {
        let placement = &self.placements[chart];
        turned(charts[chart].coordinates(place) * self.per_m, placement.quarters) + placement.offset
    }
}

fn turned(p: Vec2, quarters: u8) -> Vec2 {
    match quarters % 4 {
        0 => p,
        1 => p.perp(),
        2 => -p,
        _ => -p.perp(),
    }
}

/// A chart's triangles in its own coordinates.
struct Shape {
    triangles: Vec<[Vec2; 3]>,
    area: f64,
    size: Vec2,
}

/// Scales that are tried at once, whatever the number of threads, so that it does not matter.
const AT_ONCE: usize = 2;
/// Rounds of such: each leaves a third of what was between.
const ROUNDS: usize = 4;
/// How full, margins counted, the first ones would make the textures: jagged charts fill 0.75 of them, rectangles 0.95.
const FIRST: [f64; 2] = [0.72, 0.97];
/// Where the lowest one fails, the next one is so many times as large.
const LOWER: f32 = 0.9;

/// Packs charts whose triangles are given by `corners`.
///
/// # Errors
/// Sizes that are no textures', and more charts than there is room for.
pub fn pack(charts: &[Chart], corners: impl Fn(u32) -> [Vec3; 3] + Sync, params: &PackParams) -> Result<Packing, PackError> {
    let PackParams { width, height, margin, .. } = *params;
    let sides = 1..=LARGEST;
    if !sides.contains(&width) || !sides.contains(&height) {
        return Err(PackError::Size { width, height });
    }
    let sheets = params.sheets.max(1);
    let room = |side: u32| u64::from((side + margin) / (1 + margin));
    if charts.len() as u64 > room(width) * room(height) * u64::from(sheets) {
        let smallest =
            (charts.len() as f64 / f64::from(sheets)).sqrt().ceil() as u64 * u64::from(1 + margin) - u64::from(margin);
        return Err(PackError::TooSmall { charts: charts.len(), width, height, smallest });
    }
    let shapes: Vec<Shape> = charts.par_iter().map(|chart| Shape::new(chart, &corners)).collect();
    let area: f64 = shapes.iter().map(|shape| shape.area).sum();
    let try_scale = |scale: f32| lay(&shapes, scale, params);
    if area <= 0.0 {
        let placements = try_scale(0.0).unwrap_or_default();
        return Ok(Packing { per_m: 0.0, placements, sheets: 1, utilisation: 0.0 });
    }
    let texels = f64::from(width) * f64::from(height) * f64::from(sheets);
    let demand = Demand::of(&shapes, area, texels, params);
    let scale_of = |fullness: f64| demand.scale(fullness * texels).min(params.most_per_m);
    let [mut from, mut high] = FIRST.map(scale_of);
    let mut low: Option<(f32, Vec<Placement>)> = None;
    for _ in 0..ROUNDS {
        let first = if low.is_some() { 1.0 } else { 0.0 };
        let step = |i: usize| from + (high - from) * (i as f32 + first) / (AT_ONCE as f32 + first);
        let tried: Vec<(f32, Option<Vec<Placement>>)> =
            (0..AT_ONCE).into_par_iter().map(step).map(|scale| (scale, try_scale(scale))).collect();
        for (scale, laid) in tried {
            match laid {
                Some(laid) => (from, low) = (scale, Some((scale, laid))),
                None => {
                    high = scale;
                    from = from.min(LOWER * high);
                    break;
                }
            }
        }
    }
    while low.is_none() {
        high *= 0.5;
        low = try_scale(high).map(|laid| (high, laid));
    }
    let (per_m, placements) = low.unwrap_or_default();
    let sheets = placements.iter().map(|placement| placement.sheet + 1).max().unwrap_or(1);
    let covered = area * f64::from(per_m) * f64::from(per_m);
    let utilisation = (covered / (f64::from(width) * f64::from(height) * f64::from(sheets))) as f32;
    Ok(Packing { per_m, placements, sheets, utilisation })
}

/// How many texels all charts take with half of their margins, for two share one: a s^2 + b s + c at the scale s, for a chart has its area, its rim and its corners.
struct Demand([f64; 3]);

impl Demand {
    /// Seen at two scales, at which the charts alone would take so many texels and a quarter of these.
    fn of(shapes: &[Shape], area: f64, texels: f64, params: &PackParams) -> Self {
        let scale = (texels / area).sqrt();
        let rest = |scale: f64| {
            let taken = |shape: &Shape| {
                // who is larger than the largest texture is not asked
                shape
                    .mask(scale as f32, 0, LARGEST)
                    .map_or(0, |(mask, _)| mask.texels + u64::from(params.margin) * mask.rim() / 2)
            };
            shapes.par_iter().map(taken).sum::<u64>() as f64 - area * scale * scale
        };
        let (all, half) = (rest(scale), rest(0.5 * scale));
        Self([area, 2.0 * (all - half) / scale, 2.0 * half - all])
    }

    /// At which scale they take so many; 0 where they always take more.
    fn scale(&self, texels: f64) -> f32 {
        let [a, b, c] = self.0;
        let root = (b * b - 4.0 * a * (c - texels)).max(0.0).sqrt();
        ((root - b) / (2.0 * a)).max(0.0) as f32
    }
}

impl Shape {
    fn new(chart: &Chart, corners: &impl Fn(u32) -> [Vec3; 3]) -> Self {
        let triangles: Vec<[Vec2; 3]> = chart.triangles.iter().map(|&t| corners(t).map(|p| chart.coordinates(p))).collect();
        let area = triangles.iter().map(|[a, b, c]| f64::from(0.5 * (b - a).perp_dot(c - a).abs())).sum();
        let (low, high) =
            triangles.iter().flatten().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
        Self { triangles, area, size: (high - low).max(Vec2::ZERO) }
    }

    /// Its mask at a scale, turned, and what then is to be added to its coordinates for the mask's least corner to be at zero.
    fn mask(&self, scale: f32, quarters: u8, most: u32) -> Option<(Mask, Vec2)> {
        let mut triangles: Vec<[Vec2; 3]> = self.triangles.iter().map(|t| t.map(|p| turned(p * scale, quarters))).collect();
        let low = triangles.iter().flatten().fold(Vec2::INFINITY, |low, p| low.min(*p));
        let offset = Vec2::splat(INSET) - low;
        triangles.iter_mut().flatten().for_each(|p| *p += offset);
        Some((Mask::new(&triangles, most)?, offset))
    }
}

/// Lays all shapes at a scale; none where they do not fit.
fn lay(shapes: &[Shape], scale: f32, params: &PackParams) -> Option<Vec<Placement>> {
    let PackParams { width, height, margin, .. } = *params;
    let mut order: Vec<usize> = (0..shapes.len()).collect();
    let longest = |i: &usize| (shapes[*i].size.max_element() * scale).ceil() as u64;
    order.sort_by_key(|i| (Reverse(longest(i)), Reverse((shapes[*i].area * 1e6) as u64), *i));
    let mut sheets = vec![Sheet::new(width, height)];
    let mut placements = vec![Placement { sheet: 0, quarters: 0, offset: Vec2::ZERO }; shapes.len()];
    for index in order {
        let mut masks: Vec<(u8, Mask, Vec2)> = Vec::with_capacity(4);
        for quarters in 0..4 {
            if let Some((mask, offset)) = shapes[index].mask(scale, quarters, width.max(height))
                && masks.iter().all(|(_, other, _)| *other != mask)
            {
                masks.push((quarters, mask, offset));
            }
        }
        let mut sheet = 0;
        let (place, quarters, offset, mask) = loop {
            let found = masks.iter().filter_map(|(quarters, mask, offset)| {
                let place = sheets[sheet as usize].find(mask)?;
                Some((place, *quarters, *offset, mask))
            });
            match found.min_by_key(|([x, y], quarters, _, mask)| (y + mask.height, *x, *quarters)) {
                Some(found) => break found,
                None if sheet + 1 < params.sheets.max(1) => {
                    sheet += 1;
                    if sheets.len() <= sheet as usize {
                        sheets.push(Sheet::new(width, height));
                    }
                }
                None => return None,
            }
        };
        sheets[sheet as usize].put(mask, place, margin);
        let [x, y] = place.map(|x| x as f32);
        placements[index] = Placement { sheet, quarters, offset: offset + Vec2::new(x, y) };
    }
    Some(placements)
}
