//! Cuts the ground into triangles that are even on the screen from the visitor's feet to the horizon.
//!
//! Rings about the visitor, with as many vertices and as far apart as most of the ground at that distance asks; where rock
//! rises towards the visitor and shows larger, edges are halved until they are short enough. Whether an edge is halved
//! follows from its two ends alone, so both of its triangles agree and no crack opens.

use super::ground::{Ground, beyond_steps};
use super::noise::smoothstep;
use super::sizing::{FOCAL_PX, Grain, View};
use super::solid::{RowVertex, SolidMesh, zip_rows};
use glam::Vec3;
use heliodon_math::frame::unit_or;
use rayon::prelude::*;
use std::collections::HashMap;
use std::f32::consts::TAU;

/// Where the ground ends, metres from the visitor.
const END: f32 = 900.0;
/// The first ring.
const START: f32 = 0.35;
/// Height of its underside.
const UNDERSIDE: f32 = -60.0;
/// Eyes look down on ground at most this steeply (tangent); nearer ground is coarser.
const STEEPEST: f32 = 0.37;
/// Entries of the tables by azimuth and by distance.
const AZIMUTHS: usize = 720;
const DISTANCES: usize = 220;
/// Edges may be this much longer than asked before they are halved.
const TOLERANCE: f32 = 1.12;
/// Rounds of halving.
const ROUNDS: usize = 3;
/// So many rings are cut to estimate how many triangles the halving adds.
const SAMPLED: usize = 48;

/// Pixels per metre along and across the line of sight, by distance, and the share of the turn by azimuth.
#[derive(Debug)]
pub struct GroundCut {
    along_px: Vec<f32>,
    across_px: Vec<f32>,
    /// Azimuth (radians about the visitor) by evenly spaced parts of the cut.
    azimuth: Vec<f32>,
    /// Angle that a full turn is worth at full sharpness.
    weight: f32,
}

/// One ring: its radius and how many vertices it has.
type Ring = (f32, u32);

/// How much coarser the ground is at an angle off the middle of the picture.
fn aside(off_rad: f32) -> f32 {
    1.0 + 9.0 * smoothstep(0.62, 1.0, off_rad)
}

/// Width and height in pixels that an edge of the ground has on the screen, the greater of the two, for the eye that sees it
/// largest. An edge that runs down the screen as it leads away lies on a slope that is turned away: it has no height.
fn screen_px(view: &View, p: Vec3, edge: Vec3) -> f32 {
    view.eyes().iter().fold(0.0_f32, |worst, eye| {
        let to = *eye - p;
        let level = Vec3::new(to.x, 0.0, to.z).length();
        let far = to.length().max(0.5);
        let looked_at = (STEEPEST * level / to.y.abs().max(0.01)).min(1.0);
        let looked_at = looked_at * looked_at;
        let sideways = Vec3::new(to.z, 0.0, -to.x) / level.max(1e-3);
        let upwards = to.cross(sideways) / far;
        let away = if edge.dot(to) < 0.0 { edge } else { -edge };
        let height = away.dot(upwards).max(0.0);
        worst.max(looked_at * FOCAL_PX / far * edge.dot(sideways).abs().max(height))
    })
}

impl GroundCut {
    /// Measures the ground from a view.
    pub fn new(ground: &Ground, view: &View) -> Self {
        let forward = libm::atan2f(view.forward().z, view.forward().x);
        // azimuths crowd before the visitor
        let mut sums = Vec::with_capacity(AZIMUTHS + 1);
        let mut total = 0.0;
        for i in 0..=AZIMUTHS {
            sums.push(total);
            let angle = TAU * (i as f32 + 0.5) / AZIMUTHS as f32;
            total += TAU / AZIMUTHS as f32 / aside((angle - 0.5 * TAU).abs());
        }
        let weight = sums[AZIMUTHS];
        let mut azimuth = Vec::with_capacity(AZIMUTHS + 1);
        let mut at = 0;
        for i in 0..=AZIMUTHS {
            let target = weight * i as f32 / AZIMUTHS as f32;
            while at + 1 < AZIMUTHS && sums[at + 1] <= target {
                at += 1;
            }
            let part = ((target - sums[at]) / (sums[at + 1] - sums[at])).clamp(0.0, 1.0);
            azimuth.push(forward - 0.5 * TAU + TAU * (at as f32 + part) / AZIMUTHS as f32);
        }
        let rows: Vec<(f32, f32)> =
            (0..DISTANCES).into_par_iter().map(|i| densities(ground, view, forward, distance_of(i as f32))).collect();
        let (along_px, across_px) = rows.into_iter().unzip();
        Self { along_px, across_px, azimuth, weight }
    }

    fn rings(&self, px: f32) -> Vec<Ring> {
        let mut rings = Vec::new();
        let mut radius = START;
        while radius < END {
            let across = sample(&self.across_px, radius);
            rings.push((radius, ((self.weight * radius * across / px).ceil() as u32).clamp(12, 200_000)));
            radius += (px / sample(&self.along_px, radius)).clamp(0.002, 0.25 * radius + 0.2);
        }
        rings.push((END, 64));
        rings
    }

    /// Triangles before any edge is halved.
    pub fn base_count(&self, px: f32) -> usize {
        let rings = self.rings(px);
        let between: usize = rings.windows(2).map(|pair| (pair[0].1 + pair[1].1) as usize).sum();
        // the middle, the skirt and the underside
        between + rings[0].1 as usize + 3 * rings[rings.len() - 1].1 as usize
    }

    /// By how much halving multiplies the triangles, from a sample of the rings.
    pub fn growth(&self, ground: &Ground, grain: &Grain) -> f32 {
        let rings = self.rings(grain.px);
        let step = (rings.len() / SAMPLED).max(1);
        let pairs: Vec<&[Ring]> = rings.windows(2).step_by(step).collect();
        let counts: Vec<(usize, usize)> = pairs
            .par_iter()
            .map(|pair| {
                let mut mesh = SolidMesh::default();
                let rows = [0, 1].map(|end: usize| {
                    let points = self.row(ground, grain.view.centre(), end, pair[end]);
                    row_of(&mut mesh, end, &points)
                });
                zip_rows(&rows[0], &rows[1], &mut mesh.triangles);
                let before = mesh.triangles.len();
                self.halve(ground, grain, &mut mesh);
                (before, mesh.triangles.len())
            })
            .collect();
        let (before, after) = counts.into_iter().fold((0, 0), |sum, count| (sum.0 + count.0, sum.1 + count.1));
        after as f32 / before.max(1) as f32
    }

    /// The point of the ground on a ring, by the part of the cut's turn.
    fn at(&self, ground: &Ground, centre: Vec3, radius: f32, turn: f32) -> Vec3 {
        let angle = sample_even(&self.azimuth, turn);
        ground.point(centre.x + radius * libm::cosf(angle), centre.z + radius * libm::sinf(angle))
    }

    fn row(&self, ground: &Ground, centre: Vec3, ring: usize, (radius, count): Ring) -> Vec<Vec3> {
        (0..count).map(|i| self.at(ground, centre, radius, (i as f32 + stagger(ring)) / count as f32)).collect()
    }

    /// Positions and triangles: the surface, a skirt at its end, and an underside.
    pub fn shape(&self, ground: &Ground, grain: &Grain) -> SolidMesh {
        let centre = grain.view.centre();
        let rings = self.rings(grain.px);
        let rows: Vec<Vec<Vec3>> = rings.par_iter().enumerate().map(|(i, &ring)| self.row(ground, centre, i, ring)).collect();
        let mut mesh = SolidMesh::default();
        let hub = mesh.vertex(ground.point(centre.x, centre.z));
        let mut inner = row_of(&mut mesh, 0, &rows[0]);
        // azimuths grow clockwise seen from above
        mesh.triangles.extend(inner.windows(2).map(|pair| [hub, pair[1].1, pair[0].1]));
        for (ring, points) in rows.iter().enumerate().skip(1) {
            let outer = row_of(&mut mesh, ring, points);
            zip_rows(&inner, &outer, &mut mesh.triangles);
            inner = outer;
        }
        self.halve(ground, grain, &mut mesh);
        let end = &rows[rows.len() - 1];
        let below: Vec<Vec3> = end.iter().map(|p| Vec3::new(p.x, UNDERSIDE, p.z)).collect();
        let skirt = row_of(&mut mesh, rows.len() - 1, &below);
        zip_rows(&inner, &skirt, &mut mesh.triangles);
        let nadir = mesh.vertex(Vec3::new(centre.x, UNDERSIDE, centre.z));
        mesh.triangles.extend(skirt.windows(2).map(|pair| [nadir, pair[0].1, pair[1].1]));
        mesh
    }

    /// The closed mesh with normals and colours.
    pub fn mesh(&self, ground: &Ground, grain: &Grain) -> SolidMesh {
        let mut mesh = self.shape(ground, grain);
        mesh.compute_normals(&[]);
        mesh.colors_linear = mesh.positions.par_iter().zip(&mesh.normals).map(|(&p, &n)| ground.albedo(p, n)).collect();
        mesh
    }

    /// Halves edges that show longer than asked.
    fn halve(&self, ground: &Ground, grain: &Grain, mesh: &mut SolidMesh) {
        for _ in 0..ROUNDS {
            let too_long = |a: u32, b: u32| {
                // the same bits from both sides
                let (a, b) = (mesh.positions[a.min(b) as usize], mesh.positions[a.max(b) as usize]);
                let middle = (a + b) * 0.5;
                let to = middle - grain.view.centre();
                let flat = Vec3::new(to.x, 0.0, to.z);
                // what lies below the temple is not seen; the rim belongs to the skirt too
                let on_rim =
                    |p: Vec3| Vec3::new(p.x - grain.view.centre().x, 0.0, p.z - grain.view.centre().z).length() > END - 1.0;
                if beyond_steps(middle.x, middle.z) < 0.0 || (on_rim(a) && on_rim(b)) {
                    return false;
                }
                let cosine = unit_or(flat, grain.view.forward()).dot(grain.view.forward()).clamp(-1.0, 1.0);
                screen_px(grain.view, middle, b - a) > TOLERANCE * grain.px * aside(libm::acosf(cosine))
            };
            let marks: Vec<[bool; 3]> =
                mesh.triangles.par_iter().map(|t| [too_long(t[0], t[1]), too_long(t[1], t[2]), too_long(t[2], t[0])]).collect();
            if !marks.iter().flatten().any(|&mark| mark) {
                return;
            }
            let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
            let mut triangles = Vec::with_capacity(mesh.triangles.len() * 5 / 4);
            for (t, mark) in std::mem::take(&mut mesh.triangles).into_iter().zip(marks) {
                let middle: [Option<u32>; 3] = std::array::from_fn(|k| {
                    mark[k].then(|| {
                        let (a, b) = (t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3]));
                        *middles.entry((a, b)).or_insert_with(|| {
                            let p = (mesh.positions[a as usize] + mesh.positions[b as usize]) * 0.5;
                            mesh.vertex(ground.point(p.x, p.z))
                        })
                    })
                });
                split(t, middle, &mesh.positions, &mut triangles);
            }
            mesh.triangles = triangles;
        }
    }
}

/// The one to four triangles of a triangle some of whose edges have a middle vertex; edge k runs from corner k to the next.
fn split(t: [u32; 3], middle: [Option<u32>; 3], positions: &[Vec3], triangles: &mut Vec<[u32; 3]>) {
    let marked = middle.iter().flatten().count();
    // turned so that the odd edge, marked or not, is the first
    let first = match marked {
        1 => middle.iter().position(Option::is_some),
        2 => middle.iter().position(Option::is_none),
        _ => Some(0),
    }
    .unwrap_or(0);
    let [a, b, c] = [0, 1, 2].map(|k| t[(first + k) % 3]);
    let [m, n, o] = [0, 1, 2].map(|k| middle[(first + k) % 3]);
    match (m, n, o) {
        (Some(m), None, None) => triangles.extend([[a, m, c], [m, b, c]]),
        (None, Some(n), Some(o)) => {
            triangles.push([n, c, o]);
            // the shorter diagonal of the rest
            let length = |i: u32, j: u32| (positions[i as usize] - positions[j as usize]).length_squared();
            if length(a, n) <= length(b, o) {
                triangles.extend([[a, b, n], [a, n, o]]);
            } else {
                triangles.extend([[a, b, o], [b, n, o]]);
            }
        }
        (Some(m), Some(n), Some(o)) => triangles.extend([[a, m, o], [m, b, n], [o, n, c], [m, n, o]]),
        _ => triangles.push(t),
    }
}

/// Every other ring is turned by half a step, so that triangles are nearly equilateral and fewer edges are too long.
fn stagger(ring: usize) -> f32 {
    0.5 * (ring % 2) as f32
}

/// Vertices of a closed ring, its first one again at its end.
fn row_of(mesh: &mut SolidMesh, ring: usize, points: &[Vec3]) -> Vec<RowVertex> {
    let count = points.len() as f32;
    let turn = |i: usize| (i as f32 + stagger(ring)) / count;
    let mut row: Vec<RowVertex> = points.iter().enumerate().map(|(i, &p)| (turn(i), mesh.vertex(p))).collect();
    let first = row[0].1;
    row.push((turn(points.len()), first));
    row
}

/// Pixels a metre along and across the sight, as the middle of the ground before the visitor at that distance asks.
fn densities(ground: &Ground, view: &View, forward: f32, distance: f32) -> (f32, f32) {
    let step = (distance * 0.004).max(0.02);
    let (mut along, mut across) = (Vec::new(), Vec::new());
    for i in 0..40 {
        let angle = forward + 0.62 * ((i as f32 + 0.5) / 20.0 - 1.0);
        let out = Vec3::new(libm::cosf(angle), 0.0, libm::sinf(angle));
        let side = Vec3::new(-out.z, 0.0, out.x);
        let place = |p: Vec3| ground.point(p.x, p.z);
        let p = place(view.centre() + out * distance);
        if beyond_steps(p.x, p.z) > 0.0 || i == 0 {
            along.push(screen_px(view, p, (place(p + out * step) - p) / step));
            across.push(screen_px(view, p, (place(p + side * step) - p) / step));
        }
    }
    let pick = |values: &mut Vec<f32>, part: f32| {
        values.sort_by(f32::total_cmp);
        values[((values.len() - 1) as f32 * part) as usize]
    };
    let across = pick(&mut across, 0.6);
    (pick(&mut along, 0.5).max(0.03 * across), across)
}

/// The distance of a table's entry: evenly spaced in their logarithm.
fn distance_of(i: f32) -> f32 {
    START * libm::powf(END / START, i / (DISTANCES - 1) as f32)
}

/// A table's value at a distance.
fn sample(table: &[f32], distance: f32) -> f32 {
    sample_even(table, libm::logf(distance / START) / libm::logf(END / START))
}

/// A table's value at a part in [0, 1] of its length.
fn sample_even(table: &[f32], part: f32) -> f32 {
    let at = part.clamp(0.0, 1.0) * (table.len() - 1) as f32;
    let i = (at as usize).min(table.len() - 2);
    table[i] + (table[i + 1] - table[i]) * (at - i as f32)
}
