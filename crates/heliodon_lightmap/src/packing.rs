//! Packing charts into textures: what [`heliodon_mesh::packing`] does, for charts that lie on planes.

use crate::charts::Chart;
use glam::Vec3;
pub use heliodon_mesh::packing::{FlatChart, PackError, PackParams, Packing, Placement};
use rayon::prelude::*;

/// Packs charts whose triangles are given by `corners`.
///
/// # Errors
/// As [`heliodon_mesh::packing::pack`].
pub fn pack(charts: &[Chart], corners: impl Fn(u32) -> [Vec3; 3] + Sync, params: &PackParams) -> Result<Packing, PackError> {
    let flat = |chart: &Chart| FlatChart {
        first_triangle: chart.triangles.first().copied().unwrap_or(0),
        triangles: chart.triangles.iter().map(|&t| corners(t).map(|p| chart.coordinates(p))).collect(),
    };
    heliodon_mesh::packing::pack(charts.par_iter().map(flat).collect(), params)
}
