//! Packing: all charts into one texture of the size that is asked for, as large as they can be.
//!
//! At one scale charts are laid, the longest first, each turned by the quarter with which it comes to lie lowest, where all texels are free that filtering
//! takes into account on it; small ones fill what large ones leave. The scale itself is searched for: two are tried at once near the one that is expected of
//! how charts fill their rectangles, then two between the largest that fits and the least that does not.

mod bitmap;
mod cover;
mod inner;
mod lay;
mod mask;
mod room;
mod rooms;
mod scale;
mod sheet;

pub use cover::cover;

use glam::Vec2;
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
    /// Texels that stay free between those that filtering takes into account on two charts, 0 to 16,384; more leaves charts fewer.
    pub margin: u32,
    /// Textures at most, 1 to 65,535; more leave charts more texels.
    pub sheets: u32,
    /// Texels for a metre at most, above 0; infinite fills the texture.
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
    /// A margin wider than any texture.
    #[error("a margin of {margin} texels between charts; it is 0 to {LARGEST}")]
    Margin {
        /// What was asked for.
        margin: u32,
    },
    /// No texture, or more than triangles can name.
    #[error("{sheets} textures at most; it is 1 to {MOST_SHEETS}")]
    Sheets {
        /// What was asked for.
        sheets: u32,
    },
    /// No texel for a metre.
    #[error("the most texels for a metre are to be above 0")]
    MostPerM,
    /// What has no size.
    #[error("triangle {triangle} has a corner, or a density, that is not finite, or too large to be laid flat: mend the mesh")]
    NotFinite {
        /// The first such triangle.
        triangle: u32,
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

/// The most textures: triangles name theirs in 16 bits.
const MOST_SHEETS: u32 = u16::MAX as u32;

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
    /// Where a place of a chart, given in the chart's own coordinates, lies in its texture, texels from the first one's corner.
    ///
    /// # Panics
    /// Where there is no such chart.
    #[must_use]
    pub fn texel(&self, chart: usize, coordinates: Vec2) -> Vec2 {
        let placement = &self.placements[chart];
        turned(coordinates * self.per_m, placement.quarters) + placement.offset
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

/// A chart as the packer sees it: laid flat already, by whatever means.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FlatChart {
    /// What names the chart in an error: its first triangle in the mesh.
    pub first_triangle: u32,
    /// The corners of its triangles, in metres times the density that is wanted there.
    pub triangles: Vec<[Vec2; 3]>,
}

/// Packs charts.
///
/// # Errors
/// Sizes that are no textures', settings out of range, triangles that are not finite, and more charts than there is room for.
pub fn pack(charts: Vec<FlatChart>, params: &PackParams) -> Result<Packing, PackError> {
    let PackParams { width, height, margin, .. } = *params;
    let sides = 1..=LARGEST;
    if !sides.contains(&width) || !sides.contains(&height) {
        return Err(PackError::Size { width, height });
    }
    if margin > LARGEST {
        return Err(PackError::Margin { margin });
    }
    let sheets = params.sheets;
    if !(1..=MOST_SHEETS).contains(&sheets) {
        return Err(PackError::Sheets { sheets });
    }
    if params.most_per_m.is_nan() || params.most_per_m <= 0.0 {
        return Err(PackError::MostPerM);
    }
    let room = |side: u32| u64::from((side + margin) / (1 + margin));
    let smallest = (charts.len() as f64 / f64::from(sheets)).sqrt().ceil() as u64 * u64::from(1 + margin) - u64::from(margin);
    let too_small = PackError::TooSmall { charts: charts.len(), width, height, smallest };
    if charts.len() as u64 > room(width) * room(height) * u64::from(sheets) {
        return Err(too_small);
    }
    let (names, shapes): (Vec<u32>, Vec<Shape>) =
        charts.into_par_iter().map(|chart| (chart.first_triangle, Shape::new(chart.triangles))).unzip();
    if let Some(chart) = shapes.iter().position(|shape| !shape.is_finite()) {
        return Err(PackError::NotFinite { triangle: names[chart] });
    }
    let area: f64 = shapes.iter().map(|shape| shape.area).sum();
    let (per_m, placements) = largest(&shapes, params).ok_or(too_small)?;
    let sheets = placements.iter().map(|placement| placement.sheet + 1).max().unwrap_or(1);
    let covered = area * f64::from(per_m) * f64::from(per_m);
    let utilisation = (covered / (f64::from(width) * f64::from(height) * f64::from(sheets))) as f32;
    Ok(Packing { per_m, placements, sheets, utilisation })
}
