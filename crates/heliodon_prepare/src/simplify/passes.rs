//! Pass after pass over different tiles.
//!
//! In the first, tiles are simplified as far as they may, while the vertices that they share stay. Each further pass cuts
//! elsewhere and frees only what the one before had to leave, the shared vertices and those beside them: what was simplified
//! once is not again, since the error of simplifying what is simplified already would add up unseen.

use super::fineness::Fineness;
use super::tile::{Context, Face, Tile};
use super::tiles::Tiles;
use super::{PassReport, SimplifyReport};
use glam::Vec3;
use heliodon_math::frame::unit_or;
use meshopt::VertexDataAdapter;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};

/// Where each pass cuts, as shares of the triangles.
const SHARES: [f32; 4] = [0.5, 0.37, 0.58, 0.44];
/// A pass that removes a smaller part of the triangles is the last.
const WORTHWHILE: f32 = 0.01;
/// How many rings of vertices around shared ones the next pass frees with them: these had to make do with neighbours that
/// stayed.
const RINGS: usize = 2;
/// Faces are taken to show no less of their area than this: edges that lie across the view are seen at their full length.
const LEAST_SHOWN: f32 = 1.0 / 16.0;
/// No tile uses the point.
const NOBODY: u32 = u32::MAX;
/// Several tiles use the point.
const SEVERAL: u32 = u32::MAX - 1;

/// What all passes know. A point is what vertices at one position are together, named by the first of them.
struct Passes<'a> {
    context: &'a Context<'a>,
    fineness: &'a Fineness<'a>,
}

/// The mesh between passes.
struct State {
    faces: Vec<Face>,
    /// The points that may be removed.
    free: Vec<bool>,
}

/// Simplifies all of the mesh in tiles of at most `most` triangles.
pub(super) fn run(context: &Context, fineness: &Fineness, most: usize) -> (Vec<Face>, SimplifyReport) {
    let mesh = context.mesh;
    let passes = Passes { context, fineness };
    let material = |t: usize| mesh.triangle_material.get(t).copied().unwrap_or(0);
    let face = |(t, &corners): (usize, &[u32; 3])| Face { corners, material: material(t) };
    let faces = mesh.triangles.iter().enumerate().map(face).collect();
    let mut state = State { faces, free: vec![true; mesh.positions.len()] };
    let mut report = SimplifyReport { triangles_before: mesh.triangles.len(), ..SimplifyReport::default() };
    for share in SHARES {
        let before = state.faces.len();
        let pass = passes.pass(&mut state, share, most);
        report.passes.push(pass);
        if pass.shared_points == 0 || ((before - pass.triangles) as f32) < WORTHWHILE * before as f32 {
            break;
        }
    }
    report.triangles_after = state.faces.len();
    (state.faces, report)
}

/// For each vertex the first at the same position.
pub(super) fn points(positions: &[Vec3]) -> Vec<u32> {
    match VertexDataAdapter::new(meshopt::typed_to_bytes(positions), size_of::<Vec3>(), 0) {
        Ok(adapter) if !positions.is_empty() => meshopt::generate_position_remap(&adapter),
        _ => Vec::new(),
    }
}

impl Passes<'_> {
    fn pass(&self, state: &mut State, share: f32, most: usize) -> PassReport {
        let tiles = Tiles::cut(&self.context.mesh.positions, &state.faces, self.fineness, share, most);
        let owners = self.owners(&state.faces, &tiles);
        let owner = |vertex: u32| owners[self.context.point_of[vertex as usize] as usize].load(Ordering::Relaxed);
        let simplified: Vec<Tile> = tiles
            .ranges
            .par_iter()
            .enumerate()
            .map(|(index, range)| {
                let faces = tiles.order[range.clone()].iter().map(|&t| state.faces[t as usize]);
                let free = |v: u32| state.free[self.context.point_of[v as usize] as usize] && owner(v) == index as u32;
                self.tile(faces, free)
            })
            .collect();
        let mut report = PassReport { tiles: tiles.ranges.len(), ..PassReport::default() };
        report.error_m = simplified.iter().map(|tile| tile.error_m).fold(0.0, f32::max);
        drop(tiles);
        state.faces = Vec::with_capacity(simplified.iter().map(|tile| tile.faces.len()).sum());
        simplified.into_iter().for_each(|tile| state.faces.extend(tile.faces));
        report.triangles = state.faces.len();
        let rim: Vec<bool> =
            (0..state.free.len()).map(|p| state.free[p] && owners[p].load(Ordering::Relaxed) == SEVERAL).collect();
        drop(owners);
        report.shared_points = rim.iter().filter(|rim| **rim).count();
        let mut free = rim;
        for _ in 0..RINGS {
            free = self.dilated(&state.faces, &free);
        }
        state.free = free;
        report
    }

    /// These points and those beside them; no others that no face uses.
    fn dilated(&self, faces: &[Face], of: &[bool]) -> Vec<bool> {
        let mut dilated = vec![false; of.len()];
        for face in faces {
            let points = face.corners.map(|v| self.context.point_of[v as usize] as usize);
            if points.iter().any(|&p| of[p]) {
                points.iter().for_each(|&p| dilated[p] = true);
            }
        }
        dilated
    }

    /// A tile: faces without a free corner are passed by.
    fn tile(&self, faces: impl Iterator<Item = Face>, free: impl Fn(u32) -> bool) -> Tile {
        let (open, mut shut): (Vec<Face>, Vec<Face>) = faces.partition(|face| face.corners.iter().any(|&v| free(v)));
        let distance = |v: u32| self.fineness.distance_m(self.context.mesh.positions[v as usize]);
        let nearest_m = open.iter().flat_map(|face| face.corners).map(distance).fold(f32::INFINITY, f32::min);
        let mut allowed = self.fineness.at_distance(nearest_m);
        allowed.edge_m /= self.shown(&open).sqrt();
        let tile = self.context.simplify(&open, allowed, free);
        shut.extend(tile.faces);
        Tile { faces: shut, error_m: tile.error_m }
    }

    /// The part of their area that faces can show to an eye, in the mean. Edges may be as much longer as leaves triangles the area that they have
    /// on the screen: ground far off is seen so flat that ten even triangles would share a pixel.
    fn shown(&self, faces: &[Face]) -> f32 {
        let (mut all, mut shown) = (0.0_f64, 0.0_f64);
        for face in faces {
            let [a, b, c] = face.corners.map(|v| self.context.mesh.positions[v as usize]);
            let across = (b - a).cross(c - a);
            let area = f64::from(across.length());
            all += area;
            shown += area * f64::from(self.fineness.facing(a, unit_or(across, Vec3::ZERO)));
        }
        if all > 0.0 { ((shown / all) as f32).clamp(LEAST_SHOWN, 1.0) } else { 1.0 }
    }

    /// Which tile uses each point. The order in which threads come does not matter.
    fn owners(&self, faces: &[Face], tiles: &Tiles) -> Vec<AtomicU32> {
        let owners: Vec<AtomicU32> = self.context.point_of.iter().map(|_| AtomicU32::new(NOBODY)).collect();
        tiles.ranges.par_iter().enumerate().for_each(|(tile, range)| {
            let tile = tile as u32;
            for vertex in tiles.order[range.clone()].iter().flat_map(|&t| faces[t as usize].corners) {
                let owner = &owners[self.context.point_of[vertex as usize] as usize];
                let held = owner.load(Ordering::Relaxed);
                if held != tile && held != SEVERAL {
                    let claimed = owner.compare_exchange(NOBODY, tile, Ordering::Relaxed, Ordering::Relaxed);
                    if claimed.is_err_and(|held| held != tile) {
                        owner.store(SEVERAL, Ordering::Relaxed);
                    }
                }
            }
        });
        owners
    }
}
