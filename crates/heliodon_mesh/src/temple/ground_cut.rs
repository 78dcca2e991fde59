//! Cuts the ground into triangles that are even on the screen from the visitor's feet to the horizon.
//!
//! Rings about the visitor, with somewhat fewer vertices than most of the ground at that distance asks; then the longest
//! edge of every triangle that shows too large is halved, again and again. Rock that rises towards the visitor gets the triangles that
//! slopes behind it do not need. An edge is halved for both of its triangles, so no crack opens.

use super::ground::{Ground, beyond_steps};
use super::halve::{Halving, edge};
use super::noise::smoothstep;
use super::sizing::{FOCAL_PX, Grain, View};
use super::solid::{RowVertex, SolidMesh, zip_rows};
use glam::Vec3;
use rayon::prelude::*;
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
/// The rings are so much coarser than asked; halving makes up for it where it shows.
const BASE: f32 = 2.4;
/// Sides may be this much longer than asked while the triangle's area is small enough.
const LONGEST: f32 = 1.6;
/// How much coarser the ground beside, behind and below the picture becomes.
const COARSEST: f32 = 12.0;
/// Rounds of halving, at most.
const ROUNDS: usize = 12;
/// So many strips of rings, each so many rings wide, are cut to estimate how many triangles the halving adds.
const SAMPLED: usize = 20;
const STRIP: usize = 4;

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
    1.0 + COARSEST * smoothstep(0.62, 1.0, off_rad)
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
        let px = BASE * px;
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
        let strips: Vec<&[Ring]> = rings.windows(STRIP.min(rings.len())).step_by(step).collect();
        let counts: Vec<(usize, usize)> = strips
            .par_iter()
            .map(|strip| {
                let mut mesh = SolidMesh::default();
                let mut inner: Vec<RowVertex> = Vec::new();
                for (i, &ring) in strip.iter().enumerate() {
                    let outer = row_of(&mut mesh, i, &self.row(ground, grain.view.centre(), i, ring));
                    if i > 0 {
                        zip_rows(&inner, &outer, &mut mesh.triangles);
                    }
                    inner = outer;
                }
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

    /// Halves the longest edges of triangles that show too large.
    fn halve(&self, ground: &Ground, grain: &Grain, mesh: &mut SolidMesh) {
        let mut fresh: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        for _ in 0..ROUNDS {
            let marked: Vec<Option<(u32, u32)>> = fresh
                .par_iter()
                .map(|&t| {
                    let t = mesh.triangles[t as usize];
                    too_large(grain, t.map(|i| mesh.positions[i as usize])).map(|k| edge(t[k], t[(k + 1) % 3]))
                })
                .collect();
            let mut halving = Halving::new(mesh.positions.len());
            marked.into_iter().flatten().for_each(|edge| halving.mark(edge));
            if halving.edges().is_empty() {
                return;
            }
            let new: Vec<Vec3> = halving
                .edges()
                .par_iter()
                .map(|&(a, b)| {
                    let p = (mesh.positions[a as usize] + mesh.positions[b as usize]) * 0.5;
                    ground.point(p.x, p.z)
                })
                .collect();
            mesh.positions.extend(new);
            fresh = halving.cut(&mesh.positions, &mut mesh.triangles);
        }
    }
}

/// The edge to halve of a triangle that shows too large to some eye: edge k runs from corner k to the next.
fn too_large(grain: &Grain, corner: [Vec3; 3]) -> Option<usize> {
    let view = grain.view;
    let middle = (corner[0] + corner[1] + corner[2]) / 3.0;
    // what lies below the temple is not seen; the rim belongs to the skirt too
    let from_centre = |p: Vec3| Vec3::new(p.x - view.centre().x, 0.0, p.z - view.centre().z);
    if beyond_steps(middle.x, middle.z) < 0.0 || corner.iter().filter(|&&p| from_centre(p).length() > END - 1.0).count() > 1 {
        return None;
    }
    let edges = [0, 1, 2].map(|k| corner[(k + 1) % 3] - corner[k]);
    let area = 0.5 * edges[0].cross(edges[1]);
    let mut worst = (1.0, None);
    for eye in view.eyes() {
        let to = *eye - middle;
        let far = to.length().max(0.5);
        // a triangle may be as large as half a square of the length asked
        let facing = area.dot(to) / far;
        if facing <= 0.0 {
            continue;
        }
        let px = grain.px * (1.0 + COARSEST * smoothstep(1.06, 1.7, view.outside(-to)));
        let per_metre = FOCAL_PX / far * view.stretch(-to) / px;
        let lengths = edges.map(|edge| edge.cross(to).length() / far * per_metre);
        let longest = (0..3).max_by(|&i, &j| lengths[i].total_cmp(&lengths[j])).unwrap_or(0);
        let excess = (2.0 * facing * per_metre * per_metre).max(lengths[longest] / LONGEST);
        if excess > worst.0 {
            worst = (excess, Some(longest));
        }
    }
    worst.1
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
