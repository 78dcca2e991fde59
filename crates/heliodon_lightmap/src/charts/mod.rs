//! Charts: patches of neighbouring triangles that face about the same way, each laid onto a plane of its own.
//!
//! Triangles are projected straight, so within a chart lengths shrink by no more than the cosine of the cone of its normals, none is turned over and none
//! covers another; areas are kept in the mean. Triangles that hang on their chart by one side are given to those around them, so that borders have no teeth.
//! Vertices at one position are one, whatever texture coordinates or normals they have: light does not end at a texture's seam.

mod borders;
mod clusters;
mod neighbors;
mod overlap;
mod plane;

pub(crate) use neighbors::for_each_pair;
pub use plane::Plane;

use borders::straightened;
use clusters::{Limits, Surface, clusters};
use glam::{Vec2, Vec3};
use heliodon_math::frame::unit_or;
use neighbors::{NOBODY, neighbors};
use overlap::layers;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;

/// How charts are cut.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct ChartParams {
    /// No triangle's normal is farther than this from its chart's, degrees in (0, 80]. More makes fewer charts, whose slopes have fewer texels.
    pub cone_deg: f32,
    /// The same where a small chart is joined to a neighbour, degrees in (0, 80]: each chart has a rim of texels that show nothing.
    pub small_cone_deg: f32,
    /// Small are charts of no more than this part of the whole area, at least 0.
    pub small_part: f32,
    /// No chart is longer than so many times the side of a square of the whole area, above 0, but for single triangles: what is longer than the sheet
    /// makes all others small.
    pub longest: f32,
}

impl Default for ChartParams {
    fn default() -> Self {
        Self { cone_deg: 40.0, small_cone_deg: 70.0, small_part: 2.0e-5, longest: 1.0 }
    }
}

/// A patch of triangles, laid flat.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Its triangles, ascending.
    pub triangles: Vec<u32>,
    /// What they are laid onto.
    pub plane: Plane,
    /// Texels wanted for a metre along the plane, for one of the surface: more where the chart is steep to its plane, and as its density is.
    pub scale: f32,
}

impl Chart {
    /// The coordinates of a place, in the surface's metres times their density.
    #[must_use]
    pub fn coordinates(&self, place: Vec3) -> Vec2 {
        self.plane.project(place) * self.scale
    }

    /// By how much coordinates stretch a triangle's lengths, the most and the least, beside what was wanted: the singular values of the map, 1 where it keeps lengths. `None` of a triangle without area.
    #[must_use]
    pub fn stretch(&self, [a, b, c]: [Vec3; 3], density: f32) -> Option<[f32; 2]> {
        let flat = |place: Vec3| self.coordinates(place).as_dvec2() / f64::from(density);
        let (u, v) = (flat(b) - flat(a), flat(c) - flat(a));
        let (along, other) = ((b - a).as_dvec3(), (c - a).as_dvec3());
        let (length, twice) = (along.length(), along.cross(other).length());
        // of unit steps along a side and square to it
        let x = u / length;
        let y = (v - x * (other.dot(along) / length)) / (twice / length);
        let (sum, half) = (x.length_squared() + y.length_squared(), 0.5 * (x.length_squared() - y.length_squared()));
        let apart = (half * half + x.dot(y) * x.dot(y)).sqrt();
        let values = [0.5 * sum + apart, (0.5 * sum - apart).max(0.0)].map(|square| square.sqrt() as f32);
        (twice > 0.0 && values.iter().all(|value| value.is_finite())).then_some(values)
    }
}

/// What is known of a triangle.
#[derive(Clone, Copy, Debug)]
struct Face {
    /// Unit; zero where there is no area.
    normal: Vec3,
    /// In metres times the density, squared.
    area: f32,
    /// Of its sides, in metres times the density, from its first corner on.
    lengths: [f32; 3],
    /// Least and greatest corner, in the same.
    bounds: [Vec3; 2],
}

impl Face {
    fn new(corners: [Vec3; 3], density: f32) -> Self {
        let [a, b, c] = corners.map(|p| p * density);
        let twice = (b - a).cross(c - a);
        let normal = unit_or(twice, Vec3::ZERO);
        let area = if normal == Vec3::ZERO { 0.0 } else { 0.5 * twice.length() };
        let lengths = [a.distance(b), b.distance(c), c.distance(a)];
        Self { normal, area, lengths, bounds: [a.min(b).min(c), a.max(b).max(c)] }
    }
}

/// Cuts a surface into charts. `density` says how many texels each triangle is to have along a metre, beside the others; none stands for all alike. Every
/// triangle is in one chart; those without area are together in one whose scale is 0.
///
/// Takes about 0.3 s for a scan of 70,000 triangles and 0.55 s for one of 100,000, most of it on one core.
///
/// # Panics
/// When a triangle names a vertex that does not exist, or `density` is neither empty nor as long as `triangles`.
#[must_use]
pub fn charts(positions: &[Vec3], triangles: &[[u32; 3]], density: &[f32], params: &ChartParams) -> Vec<Chart> {
    assert!(density.is_empty() || density.len() == triangles.len(), "a density for each triangle");
    let corners = |t: usize| triangles[t].map(|v| positions[v as usize]);
    let density = |t: usize| density.get(t).copied().unwrap_or(1.0);
    let faces: Vec<Face> = (0..triangles.len()).into_par_iter().map(|t| Face::new(corners(t), density(t))).collect();
    let neighbors = neighbors(positions, triangles, |t| faces[t].area > 0.0);
    let area = faces.iter().map(|face| f64::from(face.area)).sum::<f64>() as f32;
    let cosine = |degrees: f32| libm::cosf(degrees.clamp(1.0, 80.0).to_radians());
    let limits = Limits {
        least_cosine: cosine(params.cone_deg),
        least_cosine_small: cosine(params.small_cone_deg),
        small: params.small_part * area,
        longest: params.longest * area.sqrt(),
    };
    let surface = Surface { faces: &faces, neighbors: &neighbors };
    let joined = straightened(&surface, &clusters(&surface, limits), limits.least_cosine);
    let laid = |(triangles, normal)| lay(triangles, normal, &faces, &neighbors, &corners, &density);
    let (whole, nothing): (Vec<_>, Vec<_>) =
        joined.into_iter().partition(|(triangles, _)| faces[triangles[0] as usize].area > 0.0);
    let mut charts: Vec<Chart> = whole.into_par_iter().flat_map_iter(laid).collect();
    if !nothing.is_empty() {
        charts.push(Chart {
            triangles: nothing.into_iter().flat_map(|(triangles, _)| triangles).collect(),
            plane: Plane::new(Vec3::Z, Vec3::ZERO),
            scale: 0.0,
        });
    }
    charts
}

/// Lays a cluster flat, square to a normal; more than one chart comes of it where it covers itself.
fn lay(
    triangles: Vec<u32>,
    normal: Vec3,
    faces: &[Face],
    neighbors: &[[u32; 3]],
    corners: &impl Fn(usize) -> [Vec3; 3],
    density: &impl Fn(usize) -> f32,
) -> Vec<Chart> {
    let plane = Plane::new(normal, corners(triangles[0] as usize)[0]);
    let flat = |plane: &Plane, t: u32| corners(t as usize).map(|p| plane.project(p));
    let laid: Vec<[Vec2; 3]> = triangles.iter().map(|&t| flat(&plane, t)).collect();
    let mut layers = layers(&laid);
    let patches = if layers.len() == 1 {
        vec![triangles]
    } else {
        layers.iter_mut().for_each(|layer| layer.iter_mut().for_each(|t| *t = triangles[*t as usize]));
        layers.into_iter().flat_map(|layer| pieces(layer, neighbors)).collect()
    };
    let chart = |triangles: Vec<u32>| {
        let laid: Vec<[Vec2; 3]> = triangles.iter().map(|&t| flat(&plane, t)).collect();
        let area: f32 = laid.iter().map(|[a, b, c]| 0.5 * (b - a).perp_dot(c - a).abs()).sum();
        let wanted: f32 = triangles.iter().map(|&t| faces[t as usize].area).sum();
        let scale = (wanted / area).sqrt();
        let scale = if scale.is_finite() { scale } else { density(triangles[0] as usize) };
        Chart { triangles, plane: plane.turned_tightly(laid.as_flattened()), scale }
    };
    patches.into_iter().map(chart).collect()
}

/// The pieces of a patch that hang together, each ascending, in the order of their first triangles.
fn pieces(patch: Vec<u32>, neighbors: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let mut left: HashSet<u32> = patch.iter().copied().collect();
    let mut pieces = Vec::new();
    for first in patch {
        if !left.remove(&first) {
            continue;
        }
        let mut piece = vec![first];
        let mut asked = 0;
        while asked < piece.len() {
            for &beside in neighbors[piece[asked] as usize].iter().filter(|&&beside| beside != NOBODY) {
                if left.remove(&beside) {
                    piece.push(beside);
                }
            }
            asked += 1;
        }
        piece.sort_unstable();
        pieces.push(piece);
    }
    pieces
}
