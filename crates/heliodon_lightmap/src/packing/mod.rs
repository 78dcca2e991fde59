//! Packing: all charts into one texture of the size that is asked for, as large as they can be.
//!
//! At one scale charts are laid, the longest first, each turned by the quarter with which it comes to lie lowest, where all texels are free that filtering
//! takes into account on it; small ones fill what large ones leave. The scale itself is searched for: two are tried at once near the one that is expected of
//! how charts fill their rectangles, then two between the largest that fits and the least that does not.

mod bitmap;
mod inner;
mod lay;
mod mask;
mod room;
mod rooms;
mod scale;
mod sheet;

use crate::charts::Chart;
use glam::{Vec2, Vec3};
use lay::Shape;
use rayon::prelude::*;
use scale::largest;
use serde::{Deserialize, Serialize};
use sheet::LARGEST;

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
    let (per_m, placements) = largest(&shapes, params);
    let sheets = placements.iter().map(|placement| placement.sheet + 1).max().unwrap_or(1);
    let covered = area * f64::from(per_m) * f64::from(per_m);
    let utilisation = (covered / (f64::from(width) * f64::from(height) * f64::from(sheets))) as f32;
    Ok(Packing { per_m, placements, sheets, utilisation })
}
