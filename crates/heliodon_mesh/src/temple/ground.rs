//! The rock on which the temple stands: a height over the plan, cut in rings about the visitor so that its triangles are
//! even on the screen from a stone's throw to the horizon.

use super::marble::rock_albedo;
use super::measures::{STYLOBATE_LENGTH, STYLOBATE_WIDTH};
use super::noise::{cells, fbm, gradient, ridged, smoothstep};
use super::sizing::{FOCAL_PX, Grain, View};
use super::solid::{RowVertex, SolidMesh, zip_rows};
use glam::Vec3;
use heliodon_math::frame::unit_or;
use rayon::prelude::*;
use std::f32::consts::TAU;

/// Where the ground ends, metres from the visitor.
const END: f32 = 900.0;
/// The first ring.
const START: f32 = 0.35;
/// Eyes look down on ground at most this steeply (tangent); nearer ground is coarser.
const STEEPEST: f32 = 0.62;
/// Entries of the tables by azimuth and by distance.
const AZIMUTHS: usize = 720;
const DISTANCES: usize = 220;

/// The ground of a site.
#[derive(Debug)]
pub struct Ground {
    seed: u32,
    /// Where the visitor stands: the rock is even there.
    stand: Vec3,
}

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

impl Ground {
    /// The ground for a seed, level where the visitor stands.
    pub fn new(seed: u32, stand: Vec3) -> Self {
        Self { seed, stand: Vec3::new(stand.x, 0.0, stand.z) }
    }

    /// Height at a place of the plan.
    pub fn height(&self, x: f32, z: f32) -> f32 {
        let p = Vec3::new(x, 0.0, z);
        let beyond = beyond_steps(x, z);
        // the rock falls away from the temple, most to the west, as it does towards the gate of the Acropolis
        let west = smoothstep(10.0, -40.0, x);
        let fall = -(0.016 + 0.016 * west) * beyond.min(95.0) * smoothstep(0.0, 14.0, beyond);
        let broad = 0.55 * fbm(self.seed, p * 0.042, 3);
        // beds of limestone: ledges with worn edges
        let tilt = 0.5 * fbm(self.seed + 1, p * 0.11, 3) + 0.012 * x - 0.02 * z;
        let bed = tilt * 2.6;
        let ledge = (bed.floor() + smoothstep(0.35, 0.95, bed - bed.floor())) / 2.6;
        let bare = self.bareness(p);
        let rough = 0.10 * fbm(self.seed + 2, p * 0.55, 4) + 0.035 * fbm(self.seed + 3, p * 2.1, 3);
        let (first, second, _) = cells(self.seed + 4, p * 0.42);
        let crack = smoothstep(0.10, 0.0, second - first) * 0.10;
        let rock = broad + 0.65 * (ledge - tilt * 0.75) + rough - crack;
        let earth = broad * 0.8 + 0.02 * fbm(self.seed + 6, p * 1.3, 3) - 0.06;
        let wild = earth + (rock - earth) * bare;
        // calm under the visitor, calm along the euthynteria, hidden below the temple
        let stand = smoothstep(2.0, 9.0, (p - self.stand).length());
        let foot = smoothstep(0.3, 5.0, beyond);
        let mut height = fall + wild * (0.25 + 0.75 * stand) * (0.18 + 0.82 * foot) - 0.17 + 0.05 * foot;
        if beyond < 0.5 {
            height = height.min(-0.12) + (-0.45 - height.min(-0.12)) * smoothstep(0.3, -1.2, beyond);
        }
        height + self.far(p)
    }

    /// Plain and hills beyond the rock.
    fn far(&self, p: Vec3) -> f32 {
        let distance = p.length();
        let rim = smoothstep(150.0, 260.0, distance + 25.0 * fbm(self.seed + 8, p * 0.012, 2));
        let hills = smoothstep(330.0, 860.0, distance);
        let shape = 0.55 + 0.6 * fbm(self.seed + 9, p * 0.0045, 3);
        -9.0 * rim + 58.0 * hills * shape
    }

    /// 1 where the rock lies bare, 0 where earth covers it.
    fn bareness(&self, p: Vec3) -> f32 {
        smoothstep(-0.22, 0.10, fbm(self.seed + 5, p * 0.075, 3) + 0.25 * fbm(self.seed + 7, p * 0.6, 2))
    }

    /// Unit normal by differences over a quarter of a metre.
    pub fn normal(&self, x: f32, z: f32) -> Vec3 {
        let d = 0.25;
        let slope_x = self.height(x + d, z) - self.height(x - d, z);
        let slope_z = self.height(x, z + d) - self.height(x, z - d);
        unit_or(Vec3::new(-slope_x, 2.0 * d, -slope_z), Vec3::Y)
    }

    fn albedo(&self, p: Vec3, n: Vec3) -> Vec3 {
        let plan = Vec3::new(p.x, 0.0, p.z);
        let rock = rock_albedo(p, n, 0.5 + 0.5 * gradient(self.seed + 21, plan * 0.09));
        // earth, trodden pale, and the dry grass of summer in it
        let trodden = smoothstep(-0.3, 0.5, fbm(self.seed + 22, plan * 0.16, 3));
        let earth = Vec3::new(0.255, 0.200, 0.140).lerp(Vec3::new(0.375, 0.320, 0.245), trodden);
        let tufts = smoothstep(0.05, 0.45, fbm(self.seed + 23, plan * 1.9, 3) + 0.5 * fbm(self.seed + 24, plan * 0.2, 2));
        let grass = Vec3::new(0.270, 0.235, 0.120)
            .lerp(Vec3::new(0.185, 0.190, 0.090), smoothstep(0.0, 0.5, gradient(self.seed + 25, plan * 0.35)));
        let soil = earth.lerp(grass, 0.75 * tufts) * (1.0 + 0.15 * fbm(self.seed + 26, plan * 4.3, 2));
        let (first, second, _) = cells(self.seed + 4, plan * 0.42);
        let crack = smoothstep(0.14, 0.02, second - first);
        let bare = (self.bareness(plan) * (1.0 - 0.75 * crack)).clamp(0.0, 1.0);
        let bare = smoothstep(0.15, 0.75, bare + 0.25 * fbm(self.seed + 27, plan * 1.1, 2));
        // chips of marble from two thousand years of masons lie about the temple
        let chips =
            smoothstep(0.80, 0.97, ridged(self.seed + 28, plan * 2.2, 2)) * smoothstep(30.0, 2.0, beyond_steps(p.x, p.z));
        let near = soil.lerp(rock, bare).lerp(Vec3::new(0.50, 0.47, 0.41), 0.45 * chips);
        // shrubs and haze-dulled slopes far off
        let far = smoothstep(190.0, 420.0, plan.length());
        let slopes = Vec3::new(0.150, 0.155, 0.105)
            .lerp(Vec3::new(0.260, 0.235, 0.185), smoothstep(-0.2, 0.4, fbm(self.seed + 29, plan * 0.018, 4)));
        near.lerp(slopes, far).clamp(Vec3::splat(0.03), Vec3::splat(0.6))
    }

    /// What the ground needs to be cut for a view.
    pub fn prepare(&self, view: &View) -> GroundCut {
        let forward = libm::atan2f(view.forward().z, view.forward().x);
        // azimuths crowd before the visitor
        let mut sums = Vec::with_capacity(AZIMUTHS + 1);
        let mut total = 0.0;
        for i in 0..=AZIMUTHS {
            sums.push(total);
            let angle = TAU * (i as f32 + 0.5) / AZIMUTHS as f32;
            let off = (angle - 0.5 * TAU).abs();
            total += TAU / AZIMUTHS as f32 / (1.0 + 6.0 * smoothstep(0.72, 1.25, off));
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
            (0..DISTANCES).into_par_iter().map(|i| self.densities(view, forward, distance_of(i as f32))).collect();
        let (along_px, across_px) = rows.into_iter().unzip();
        GroundCut { along_px, across_px, azimuth, weight }
    }

    /// Pixels a metre along and across the sight, as most of the ground before the visitor at that distance asks.
    fn densities(&self, view: &View, forward: f32, distance: f32) -> (f32, f32) {
        let step = (distance * 0.004).max(0.02);
        let mut along = Vec::new();
        let mut across = 0.0_f32;
        for i in 0..40 {
            let angle = forward + 0.80 * ((i as f32 + 0.5) / 20.0 - 1.0);
            let out = Vec3::new(libm::cosf(angle), 0.0, libm::sinf(angle));
            let side = Vec3::new(-out.z, 0.0, out.x);
            let place = |p: Vec3| Vec3::new(p.x, self.height(p.x, p.z), p.z);
            let p = place(view.centre() + out * distance);
            let radial = (place(p + out * step) - p) / step;
            let sideways = (place(p + side * step) - p) / step;
            let (mut worst_along, mut worst_across) = (0.0_f32, 0.0_f32);
            for eye in view.eyes() {
                let to = *eye - p;
                let level = Vec3::new(to.x, 0.0, to.z).length();
                let far = to.length().max(0.5);
                let looked_at = (STEEPEST * level / to.y.abs().max(0.01)).min(1.0);
                let px = looked_at * FOCAL_PX / (far * far);
                worst_along = worst_along.max(px * radial.cross(to).length());
                worst_across = worst_across.max(px * sideways.cross(to).length());
            }
            if beyond_steps(p.x, p.z) > 0.0 {
                along.push(worst_along);
            }
            across = across.max(worst_across);
        }
        along.sort_by(f32::total_cmp);
        let along = along.get(along.len() * 17 / 20).copied().unwrap_or(0.0);
        (along.max(0.02 * across), across)
    }

    fn rings(&self, cut: &GroundCut, px: f32) -> Vec<Ring> {
        let mut rings = Vec::new();
        let mut radius = START;
        while radius < END {
            let across = sample(&cut.across_px, radius);
            rings.push((radius, ((cut.weight * radius * across / px).ceil() as u32).clamp(12, 200_000)));
            radius += (px / sample(&cut.along_px, radius)).clamp(0.004, 0.25 * radius + 0.2);
        }
        rings.push((END, 64));
        rings
    }

    /// Exactly as many triangles as [`Ground::mesh`] makes.
    pub fn count(&self, cut: &GroundCut, px: f32) -> usize {
        let rings = self.rings(cut, px);
        let between: usize = rings.windows(2).map(|pair| (pair[0].1 + pair[1].1) as usize).sum();
        // the middle, the skirt and the underside
        between + rings[0].1 as usize + 3 * rings[rings.len() - 1].1 as usize
    }

    /// The closed mesh: the surface, a skirt at its end, and an underside.
    pub fn mesh(&self, cut: &GroundCut, grain: &Grain) -> SolidMesh {
        let centre = grain.view.centre();
        let rings = self.rings(cut, grain.px);
        let rows: Vec<Vec<Vec3>> = rings
            .par_iter()
            .map(|&(radius, count)| {
                (0..count)
                    .map(|i| {
                        let angle = sample_even(&cut.azimuth, i as f32 / count as f32);
                        let (x, z) = (centre.x + radius * libm::cosf(angle), centre.z + radius * libm::sinf(angle));
                        Vec3::new(x, self.height(x, z), z)
                    })
                    .collect()
            })
            .collect();
        let mut mesh = SolidMesh::default();
        let hub = mesh.vertex(Vec3::new(centre.x, self.height(centre.x, centre.z), centre.z));
        let row_of = |mesh: &mut SolidMesh, points: &[Vec3]| -> Vec<RowVertex> {
            let count = points.len() as f32;
            let mut row: Vec<RowVertex> = points.iter().enumerate().map(|(i, &p)| (i as f32 / count, mesh.vertex(p))).collect();
            let first = row[0].1;
            row.push((1.0, first));
            row
        };
        let mut inner = row_of(&mut mesh, &rows[0]);
        // azimuths grow clockwise seen from above
        mesh.triangles.extend(inner.windows(2).map(|pair| [hub, pair[1].1, pair[0].1]));
        for points in &rows[1..] {
            let outer = row_of(&mut mesh, points);
            zip_rows(&inner, &outer, &mut mesh.triangles);
            inner = outer;
        }
        let surface = mesh.triangles.len();
        let below: Vec<Vec3> = rows[rows.len() - 1].iter().map(|p| Vec3::new(p.x, -60.0, p.z)).collect();
        let skirt = row_of(&mut mesh, &below);
        zip_rows(&inner, &skirt, &mut mesh.triangles);
        let nadir = mesh.vertex(Vec3::new(centre.x, -60.0, centre.z));
        mesh.triangles.extend(skirt.windows(2).map(|pair| [nadir, pair[0].1, pair[1].1]));
        debug_assert!(surface < mesh.triangles.len());
        mesh.compute_normals();
        mesh.colors_linear = mesh.positions.par_iter().zip(&mesh.normals).map(|(&p, &n)| self.albedo(p, n)).collect();
        mesh
    }
}

/// Metres outside the lowest step; negative within.
pub fn beyond_steps(x: f32, z: f32) -> f32 {
    let dx = x.abs() - (0.5 * STYLOBATE_LENGTH + 1.63);
    let dz = z.abs() - (0.5 * STYLOBATE_WIDTH + 1.63);
    let outside = Vec3::new(dx.max(0.0), 0.0, dz.max(0.0)).length();
    outside + dx.max(dz).min(0.0)
}

/// The distance of a table's entry: evenly spaced in their logarithm.
fn distance_of(i: f32) -> f32 {
    START * libm::powf(END / START, i / (DISTANCES - 1) as f32)
}

/// A table's value at a distance.
fn sample(table: &[f32], distance: f32) -> f32 {
    let i = libm::logf(distance / START) / libm::logf(END / START);
    sample_even(table, i)
}

/// A table's value at a part in [0, 1] of its length.
fn sample_even(table: &[f32], part: f32) -> f32 {
    let at = part.clamp(0.0, 1.0) * (table.len() - 1) as f32;
    let i = (at as usize).min(table.len() - 2);
    table[i] + (table[i + 1] - table[i]) * (at - i as f32)
}
