//! The surfaces that light falls on.

use crate::{Channels, LightError};
use glam::Vec3;
use heliodon_math::color::luminance;
use heliodon_rays::{Hit, NO_HIT, TriangleScene, set_bits};
use std::ops::Range;

/// Triangles with normals, albedo and the structure that answers rays among them.
///
/// Triangles occlude and reflect from both sides. Without `detail`, `triangles[i]` is triangle `i` of `rays`.
#[derive(Clone, Copy)]
pub struct Surfaces<'a> {
    /// Answers rays.
    pub rays: &'a TriangleScene,
    /// Vertex positions in metres.
    pub positions: &'a [Vec3],
    /// A unit normal for each vertex; a zero one marks a vertex that has none and will be invalid.
    pub normals: &'a [Vec3],
    /// Vertex indices, counter-clockwise seen from the front.
    pub triangles: &'a [[u32; 3]],
    /// What the triangles reflect.
    pub albedo: &'a dyn SurfaceAlbedo,
    /// How `rays` belong to the triangles where they meet others: the monument as it was scanned, of which the triangles are a
    /// simplification.
    pub detail: Option<Detail<'a>>,
}

/// The finer triangles that rays meet, and what stands for them.
///
/// Light is solved at the vertices of the surfaces, and shadows are those of the finer triangles; a ray that meets one of these is taken
/// to have met the nearest place of the surfaces' triangle that stands for it, where light and albedo are known.
#[derive(Clone, Copy, Debug)]
pub struct Detail<'a> {
    /// For each triangle of `rays` the one of the surfaces that stands for it.
    pub stands_for: &'a [u32],
    /// For each vertex how far in metres the finer triangles depart from the surfaces around it: rays start off the surface by as much more,
    /// or what was simplified would shadow itself.
    pub clearance_m: &'a [f32],
    /// Ranges of the surfaces' triangles that are shown; the others only reflect light. The day is told by functions that serve these
    /// ([`crate::BouncedSun`]). None: all are.
    pub shown: &'a [Range<usize>],
}

/// What part of the light surfaces reflect: linear Rec. 709, each component in [0, 1).
pub trait SurfaceAlbedo: Sync {
    /// At one place of a triangle; `u` and `v` weigh its second and third vertex.
    fn albedo(&self, triangle: u32, u: f32, v: f32) -> Vec3;

    /// The mean over a triangle.
    fn mean(&self, triangle: u32) -> Vec3;
}

/// The same albedo everywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstantAlbedo(pub Vec3);

impl SurfaceAlbedo for ConstantAlbedo {
    fn albedo(&self, _triangle: u32, _u: f32, _v: f32) -> Vec3 {
        self.0
    }

    fn mean(&self, _triangle: u32) -> Vec3 {
        self.0
    }
}

impl Surfaces<'_> {
    /// Whether lengths and indices agree.
    ///
    /// # Errors
    /// Normals that are not one per vertex, indices out of range, more of anything than 31 bits count.
    pub fn validate(&self) -> Result<(), LightError> {
        let (positions, normals) = (self.positions.len(), self.normals.len());
        if positions != normals {
            return Err(LightError::Normals { positions, normals });
        }
        for (what, count) in [("vertices", positions), ("triangles", self.triangles.len())] {
            if count >= i32::MAX as usize {
                return Err(LightError::TooMany { what, count });
            }
        }
        if let Some(Detail { stands_for, clearance_m, shown }) = self.detail {
            let mismatch = |what: &str| Err(LightError::Mismatch(what.into()));
            if clearance_m.len() != positions || !clearance_m.iter().all(|c| *c >= 0.0 && c.is_finite()) {
                return mismatch("clearances that are not one length for each vertex");
            }
            let named = stands_for.iter().all(|&t| (t as usize) < self.triangles.len());
            if !named || stands_for.len() < self.rays.triangle_count() {
                return mismatch("finer triangles for which no triangle stands");
            }
            if shown.iter().any(|range| range.start > range.end || range.end > self.triangles.len()) {
                return mismatch("triangles that are shown and do not exist");
            }
        }
        for (triangle, indices) in self.triangles.iter().enumerate() {
            if let Some(&vertex) = indices.iter().find(|&&i| i as usize >= positions) {
                return Err(LightError::VertexIndex { triangle, vertex, vertices: positions });
            }
        }
        Ok(())
    }

    /// The corners of a triangle.
    #[must_use]
    #[inline]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|i| self.positions[i as usize])
    }

    /// As [`TriangleScene::closest_parallel`], with what was met told in these triangles.
    pub(crate) fn closest_parallel(&self, origins: &[Vec3], direction: Vec3, active: &[u64], hits: &mut [Hit]) {
        self.rays.closest_parallel(origins, direction, active, hits);
        for i in set_bits(active) {
            hits[i] = self.told(origins[i], direction, hits[i]);
        }
    }

    /// What the ray engine has met, told in these triangles: the one that stands for what was met, and on it the place nearest to the
    /// hit. The place is reckoned from the distance even where rays meet these very triangles, so that kept hits need no more.
    pub(crate) fn told(&self, origin: Vec3, direction: Vec3, hit: Hit) -> Hit {
        if hit.triangle == NO_HIT {
            return hit;
        }
        let triangle = self.detail.map_or(hit.triangle, |detail| detail.stands_for[hit.triangle as usize]);
        let [u, v] = weights_near(self.corners(triangle), origin + direction * hit.t);
        Hit { triangle, u, v, ..hit }
    }

    /// How far the finer triangles that rays meet may depart from a triangle, metres.
    #[must_use]
    pub(crate) fn clearance_m(&self, triangle: u32) -> f32 {
        let of = |vertex: u32| self.vertex_clearance_m(vertex as usize);
        self.triangles[triangle as usize].map(of).into_iter().fold(0.0, f32::max)
    }

    /// The same around a vertex.
    #[must_use]
    pub(crate) fn vertex_clearance_m(&self, vertex: usize) -> f32 {
        self.detail.map_or(0.0, |detail| detail.clearance_m[vertex])
    }

    /// The place at barycentric weights `u` (second vertex) and `v` (third vertex).
    #[must_use]
    pub fn position_at(&self, triangle: u32, u: f32, v: f32) -> Vec3 {
        let [a, b, c] = self.corners(triangle);
        a + (b - a) * u + (c - a) * v
    }

    /// The vertex normals mixed at barycentric weights; the triangle's own normal where they cancel, zero where it has none.
    #[must_use]
    pub fn normal_at(&self, triangle: u32, u: f32, v: f32) -> Vec3 {
        let [a, b, c] = self.triangles[triangle as usize].map(|i| self.normals[i as usize]);
        (a * (1.0 - u - v) + b * u + c * v).try_normalize().unwrap_or_else(|| self.face_normal(triangle))
    }

    /// What a surface reflects where it was met; see [`reflected`].
    #[must_use]
    pub(crate) fn reflected_at(&self, hit: &Hit, channels: Channels) -> Vec3 {
        reflected(self.albedo.albedo(hit.triangle, hit.u, hit.v), channels)
    }

    /// Where a path goes on from what it met: `offset_m` and the clearance off the plane of the triangle on the side it came from, with the
    /// shading normal turned to that side.
    #[must_use]
    pub(crate) fn leave(&self, direction: Vec3, hit: &Hit, offset_m: f32) -> (Vec3, Vec3) {
        let plane = self.face_normal(hit.triangle);
        let plane = if plane.dot(direction) > 0.0 { -plane } else { plane };
        let shading = self.normal_at(hit.triangle, hit.u, hit.v);
        let shading = if hit.back { -shading } else { shading };
        let origin = self.position_at(hit.triangle, hit.u, hit.v) + plane * (offset_m + self.clearance_m(hit.triangle));
        (origin, if shading == Vec3::ZERO { plane } else { shading })
    }

    /// The normal of the plane of a triangle, zero where it has none.
    #[must_use]
    pub fn face_normal(&self, triangle: u32) -> Vec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).normalize_or_zero()
    }
}

/// Weights of the second and third corner at the place of a triangle's plane below a point, brought into the triangle.
fn weights_near([a, b, c]: [Vec3; 3], point: Vec3) -> [f32; 2] {
    let (ab, ac, to) = (b - a, c - a, point - a);
    let normal = ab.cross(ac);
    let area = normal.length_squared();
    if area <= 0.0 {
        return [0.0; 2];
    }
    let weight = |w: f32| if w.is_finite() { w.clamp(0.0, 1.0) } else { 0.0 };
    let (u, v) = (weight(to.cross(ac).dot(normal) / area), weight(ab.cross(to).dot(normal) / area));
    let all = (u + v).max(1.0);
    [u / all, v / all]
}

/// An albedo in the channels that are solved: no more than all of the light; what is not a number must not spread over the scene.
pub(crate) fn reflected(albedo: Vec3, channels: Channels) -> Vec3 {
    let albedo = if albedo.is_finite() { albedo.clamp(Vec3::ZERO, Vec3::ONE) } else { Vec3::ZERO };
    if channels == Channels::Mono { Vec3::splat(luminance(albedo)) } else { albedo }
}

/// Edge lengths of at most this many triangles, evenly picked, decide the median edge.
const EDGE_SAMPLE: usize = 100_000;

/// The median edge length of the triangles in metres; 0 without any that is finite.
///
/// Of more than 100,000 triangles every k-th is measured.
#[must_use]
pub fn median_edge_m(positions: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
    let stride = triangles.len().div_ceil(EDGE_SAMPLE).max(1);
    let mut lengths: Vec<f32> = triangles
        .iter()
        .step_by(stride)
        .flat_map(|t| {
            let [a, b, c] = t.map(|i| positions[i as usize]);
            [a.distance(b), b.distance(c), c.distance(a)]
        })
        .filter(|l| l.is_finite() && *l > 0.0)
        .collect();
    if lengths.is_empty() {
        return 0.0;
    }
    let middle = lengths.len() / 2;
    *lengths.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// The part of the median edge by which rays start off the surface,
const OFFSET_PER_EDGE: f32 = 0.01;

/// and the most, as a part of the extent, so that a few large faces are not lifted by centimetres.
const OFFSET_PER_EXTENT: f32 = 1e-4;

/// Half-ulps of the largest coordinate that a ray's start, the hit's arithmetic and the stored positions may be off by
/// together: gamma(7) for the triangle test (Pharr, Jakob, Humphreys: "Physically Based Rendering", 4th ed., section 6.8) on
/// three coordinates and the rounding of the start itself, rounded up to a power of two.
const OFFSET_HALF_ULPS: f32 = 32.0;

/// The next number below of which there are 32 between powers of two. A part that was moved has edges of other roundings and another extent; if
/// these changed where every ray of a scene starts, nothing of an earlier bake would hold.
fn coarse(x: f32) -> f32 {
    f32::from_bits(x.to_bits() & !((1 << (f32::MANTISSA_DIGITS - 1 - 5)) - 1))
}

/// How far rays should start off these surfaces, in metres: a hundredth of the median edge (rounded down by a 32nd at most), too little to lose a contact
/// shadow that the mesh could show, at most a ten-thousandth of the extent, and never less than the error bound of 32-bit
/// coordinates.
#[must_use]
pub fn default_offset_m(positions: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
    let finite = || positions.iter().filter(|p| p.is_finite());
    let largest = finite().fold(0.0_f32, |m, p| m.max(p.abs().max_element()));
    let (low, high) = finite().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)));
    let extent = (high - low).max(Vec3::ZERO).max_element();
    let wanted = coarse((median_edge_m(positions, triangles) * OFFSET_PER_EDGE).min(extent * OFFSET_PER_EXTENT));
    wanted.max(largest * OFFSET_HALF_ULPS * (f32::EPSILON * 0.5)).min(f32::MAX)
}
