//! Occluders inside walls, found when a bundle is loaded.
//!
//! Stone is mostly made of closed bodies, and large ones are seldom flat outside: columns are round, blocks are worn. But whoever looks at a polygon
//! that lies wholly inside closed bodies meets a front of one of them before it, so that it hides what it spans, exactly, whatever the surface
//! looks like; and blocks that reach a little into their neighbours make one wall of it. So planes are laid through the stone, in the directions in
//! which most of its faces look: through the middles of bodies, and just behind large faces. Where a plane cuts bodies, the largest rectangles
//! in the union of the cuts are occluders. Why inside and not on faces: docs/decisions/025-shadow-culling.md.

use super::OfChunk;
use super::rectangles::{Rectangle, area, in_union};
use super::shadow::{Kind, Occluder};
use super::slice::{Axes, Segment, cut, rectangles};
use crate::daylight::chunk::KeptChunk;
use crate::daylight::closed::Bodies;
use glam::{DVec3, Vec3};
use heliodon_math::frame::unit_or;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Directions in which planes are laid.
const DIRECTIONS: usize = 4;
/// Directions are told apart from this cosine on: 8 degrees.
const SAME_DIRECTION: f32 = 0.99;
/// Planes of each direction through the middles of bodies, and as many behind faces.
const PLANES: usize = 24;
/// The most rectangles of a plane that are joined: their lines make a grid of so many cells squared, times four.
const PARTS: usize = 300;
/// Occluders of a plane.
const OCCLUDERS_A_PLANE: usize = 24;
/// Occluders of a direction: a view asks each for its solid angle.
const OCCLUDERS_A_DIRECTION: usize = 128;
/// The least area of an occluder, square metres: what hides anything from two metres away, where visitors walk.
pub const LEAST_AREA_M2: f64 = 0.36;
/// How far behind faces planes are laid, metres: deeper than what weather takes off.
const BEHIND_M: f64 = 0.03;
/// Parallel occluders nearer than this are taken for the two sides of a wall, metres.
const WALL_M: f64 = 1.0;
/// A part of an occluder may be so much smaller: walls are joined of blocks.
const PARTS_OF_LEAST_AREA: f64 = 64.0;

/// The stone that is looked through: all chunks, and the bodies that they are parts of.
#[derive(Clone, Copy)]
pub struct Stone<'a> {
    /// All chunks.
    pub chunks: &'a [Arc<KeptChunk>],
    /// Which bodies their vertices belong to.
    pub bodies: &'a Bodies,
    /// Of each chunk what is said of it: ground, large as it is, hides nothing but what lies beneath it.
    pub of_chunks: &'a [OfChunk],
}

impl Stone<'_> {
    /// Each triangle of a closed body that is not ground: its body and its corners.
    fn solid_triangles(&self) -> impl Iterator<Item = (u32, [Vec3; 3])> {
        let walls = self.chunks.iter().zip(&self.bodies.of_vertex).zip(self.of_chunks).filter(|(_, of)| !of.is_ground);
        walls.flat_map(|((chunk, bodies), _)| {
            chunk.indices.chunks_exact(3).filter_map(|triangle| {
                let body = bodies[usize::from(triangle[0])];
                self.bodies.closed[body as usize].then(|| (body, [0, 1, 2].map(|k| chunk.positions[usize::from(triangle[k])])))
            })
        })
    }
}

/// A rectangle in the stone.
struct Found {
    direction: usize,
    height: f64,
    rectangle: Rectangle,
}

/// A rectangle counts for no longer than so many times its short side: steps and beams are long, and hide little.
const COUNTED_LENGTH: f64 = 4.0;

/// What a rectangle is likely to hide, square metres.
pub fn worth([low, high]: &Rectangle) -> f64 {
    let (a, b) = (high[0] - low[0], high[1] - low[1]);
    a.min(b) * a.max(b).min(COUNTED_LENGTH * a.min(b))
}

/// The largest occluders in the stone's closed bodies, those first that are likely to hide most.
#[must_use]
pub fn occluders(stone: Stone) -> Vec<Occluder> {
    let axes: Vec<Axes> = directions(stone).into_iter().map(Axes::new).collect();
    let of_directions: Vec<Vec<Found>> =
        axes.par_iter().enumerate().map(|(direction, axes)| in_direction(stone, direction, axes)).collect();
    let mut found: Vec<Found> = of_directions.into_iter().flatten().collect();
    // stable, so that equals stay in their order
    found.sort_by(|a, b| worth(&b.rectangle).total_cmp(&worth(&a.rectangle)));
    let mut kept: Vec<Found> = Vec::new();
    let mut of_direction = [0; DIRECTIONS];
    for one in found {
        if of_direction[one.direction] < OCCLUDERS_A_DIRECTION && !kept.iter().any(|before| repeats(before, &one)) {
            of_direction[one.direction] += 1;
            kept.push(one);
        }
    }
    kept.iter().map(|one| Occluder::new(axes[one.direction].corners(one.rectangle, one.height).into(), Kind::Solid)).collect()
}

/// Whether a better rectangle lies beside nearly all of `one`.
fn repeats(before: &Found, one: &Found) -> bool {
    let [low, high] = one.rectangle;
    let [before_low, before_high] = before.rectangle;
    let shared =
        [[low[0].max(before_low[0]), low[1].max(before_low[1])], [high[0].min(before_high[0]), high[1].min(before_high[1])]];
    before.direction == one.direction
        && (before.height - one.height).abs() < WALL_M
        && area(&shared) > 0.9 * area(&one.rectangle)
}

/// Cells along each side of the octahedron onto which normals are counted.
const NORMAL_CELLS: usize = 48;

/// The directions, but for their sign, in which most of the closed bodies' faces look.
fn directions(stone: Stone) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; NORMAL_CELLS * NORMAL_CELLS];
    for (_, [a, b, c]) in stone.solid_triangles() {
        let doubled = (b - a).cross(c - a);
        // The half of the sphere with the positive last component that is not nothing.
        let positive = [doubled.z, doubled.x, doubled.y].into_iter().find(|v| *v != 0.0).unwrap_or(0.0) > 0.0;
        let normal = if positive { doubled } else { -doubled };
        let size = normal.abs().element_sum();
        if size > 0.0 && size.is_finite() {
            // The upper half of the octahedron is a square: turned by 45 degrees it fills the grid.
            let (x, y) = (normal.x / size, normal.y / size);
            let cell = |v: f32| (((v * 0.5 + 0.5) * NORMAL_CELLS as f32) as usize).min(NORMAL_CELLS - 1);
            sums[cell(x + y) * NORMAL_CELLS + cell(x - y)] += normal;
        }
    }
    let mut order: Vec<usize> = (0..sums.len()).filter(|&cell| sums[cell] != Vec3::ZERO).collect();
    order.sort_by(|&a, &b| sums[b].length_squared().total_cmp(&sums[a].length_squared()));
    let mut chosen: Vec<Vec3> = Vec::new();
    for cell in order {
        let direction = unit_or(sums[cell], Vec3::Z);
        if !chosen.iter().any(|before| before.dot(direction).abs() > SAME_DIRECTION) {
            chosen.push(direction);
        }
        if chosen.len() == DIRECTIONS {
            break;
        }
    }
    chosen
}

/// How far a body reaches along the axes of a plane, and across it.
#[derive(Clone, Copy)]
struct Reach {
    low: DVec3,
    high: DVec3,
}

fn in_direction(stone: Stone, direction: usize, axes: &Axes) -> Vec<Found> {
    let part_area = LEAST_AREA_M2 / PARTS_OF_LEAST_AREA;
    let mut reaches = vec![Reach { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY }; stone.bodies.closed.len()];
    let mut faces: BTreeMap<(i64, bool), (f64, f64)> = BTreeMap::new();
    for (body, triangle) in stone.solid_triangles() {
        let corners = triangle.map(|corner| axes.of(corner));
        let reach = &mut reaches[body as usize];
        for corner in corners {
            (reach.low, reach.high) = (reach.low.min(corner), reach.high.max(corner));
        }
        let doubled = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        if doubled.z.abs() > f64::from(SAME_DIRECTION) * doubled.length() {
            let height = (corners[0].z + corners[1].z + corners[2].z) / 3.0;
            let face = faces.entry(((height / BEHIND_M).round() as i64, doubled.z > 0.0)).or_default();
            face.0 += 0.5 * doubled.z.abs();
            face.1 += 0.5 * doubled.z.abs() * height;
        }
    }
    let size = |reach: &Reach| (reach.high - reach.low).truncate().element_product();
    let wide: Vec<bool> = reaches.iter().map(|reach| reach.high.cmpge(reach.low).all() && size(reach) >= part_area).collect();
    let bodies: Vec<(f64, f64, f64)> = reaches
        .iter()
        .zip(&wide)
        .filter(|(_, wide)| **wide)
        .map(|(reach, _)| (0.5 * (reach.low.z + reach.high.z), 0.3 * (reach.high.z - reach.low.z), size(reach)))
        .collect();
    let mut heights = behind_faces(&faces);
    heights.extend(through_middles(bodies));
    heights.sort_by(f64::total_cmp);
    heights.dedup_by(|a, b| *a - *b < 0.5 * BEHIND_M);

    let mut pieces: Vec<(u32, u32, Segment)> = Vec::new();
    for (body, triangle) in stone.solid_triangles().filter(|(body, _)| wide[*body as usize]) {
        let corners = triangle.map(|corner| axes.of(corner));
        let [low, high] = [f64::min, f64::max].map(|pick| pick(pick(corners[0].z, corners[1].z), corners[2].z));
        let first = heights.partition_point(|&height| height <= low);
        let crossed = heights[first..].iter().take_while(|&&height| height <= high);
        pieces.extend((first as u32..).zip(crossed).filter_map(|(plane, &height)| Some((plane, body, cut(corners, height)?))));
    }
    // stable: the outline of a body keeps its order
    pieces.sort_by_key(|&(plane, body, _)| (plane, body));
    let mut found = Vec::new();
    for of_plane in pieces.chunk_by(|a, b| a.0 == b.0) {
        let mut parts: Vec<Rectangle> = Vec::new();
        for of_body in of_plane.chunk_by(|a, b| a.1 == b.1) {
            let outline: Vec<Segment> = of_body.iter().map(|piece| piece.2).collect();
            parts.extend(rectangles(&outline, part_area));
        }
        parts.sort_by(|a, b| area(b).total_cmp(&area(a)));
        parts.truncate(PARTS);
        let height = heights[of_plane[0].0 as usize];
        let joined = in_union(&parts, OCCLUDERS_A_PLANE, LEAST_AREA_M2);
        found.extend(joined.into_iter().map(|rectangle| Found { direction, height, rectangle }));
    }
    found
}

/// Heights a little behind the largest faces. Faces are counted by height and by whether they look up the direction: their area, and that times their height.
fn behind_faces(faces: &BTreeMap<(i64, bool), (f64, f64)>) -> Vec<f64> {
    let mut large: Vec<(f64, f64)> = faces
        .iter()
        .filter(|(_, face)| face.0 >= LEAST_AREA_M2)
        .map(|(&(_, up), &(area, moment))| (area, moment / area + if up { -BEHIND_M } else { BEHIND_M }))
        .collect();
    large.sort_by(|a, b| b.0.total_cmp(&a.0));
    large.into_iter().take(PLANES).map(|(_, height)| height).collect()
}

/// Heights that pass the middles of the most stone: bodies are their middle, how far off it a plane may be, and their size across.
fn through_middles(mut bodies: Vec<(f64, f64, f64)>) -> Vec<f64> {
    let mut heights = Vec::new();
    while heights.len() < PLANES {
        let mut ends: Vec<(f64, f64)> =
            bodies.iter().flat_map(|&(middle, off, size)| [(middle - off, size), (middle + off, -size)]).collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.total_cmp(&a.1)));
        let (mut sum, mut best) = (0.0, (0.0, 0.0));
        for pair in ends.windows(2) {
            sum += pair[0].1;
            if sum > best.0 {
                best = (sum, 0.5 * (pair[0].0 + pair[1].0));
            }
        }
        if best.0 < LEAST_AREA_M2 {
            break;
        }
        heights.push(best.1);
        bodies.retain(|&(middle, off, _)| (best.1 - middle).abs() > off);
    }
    heights
}
