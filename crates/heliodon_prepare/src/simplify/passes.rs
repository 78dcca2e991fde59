//! Pass after pass over different tiles.
//!
//! In the first, tiles are simplified as far as they may, while the vertices that they share stay. Each further pass cuts
//! elsewhere and frees only what the one before had to leave, the shared vertices and those beside them: what was simplified
//! once is not again, since the error of simplifying what is simplified already would add up unseen.

use super::fineness::Fineness;
use super::tile::{Context, Face};
use super::tiles::Tiles;
use super::witnesses::{ByFace, NOWHERE, Witnesses, settle};
use super::{PassReport, SimplifyReport};
use crate::interim::{Kept, NUMBERS, made_or_kept};
use crate::{Interim, Tell};
use glam::Vec3;
use heliodon_math::frame::unit_or;
use meshopt::VertexDataAdapter;
use rayon::prelude::*;
use std::collections::HashSet;
use std::sync::atomic::{AtomicU32, Ordering};

/// Where each pass cuts, as shares of the triangles.
const SHARES: [f32; 4] = [0.5, 0.37, 0.58, 0.44];
/// The parts of the time after which each pass is over, before the first: the further ones have little left to do.
const ENDS: [f64; 5] = [0.0, 0.7, 0.87, 0.95, 1.0];
/// A pass that removes a smaller part of the triangles is the last.
const WORTHWHILE: f32 = 0.01;
/// The part of a pass after which its tiles are cut and owned.
const CUT: f64 = 0.2;
/// How many rings of vertices around shared ones the next pass frees with them: these had to make do with neighbours that
/// stayed.
const RINGS: usize = 2;
/// Faces are taken to show no less of their area than this: edges that lie across the view are seen at their full length.
const LEAST_SHOWN: f32 = 1.0 / 16.0;
/// How often a tile is simplified at most; each time more of it is held. What is not within its limits then stays as it was.
const MOST_ROUNDS: usize = 12;
/// In the first of these rounds, of places lost side by side one is held for all: what is left of a small stone that vanished need not be all of
/// it. Then all that are lost are, so that it comes to an end.
const SPARSE_ROUNDS: usize = 6;
/// No tile uses the point.
const NOBODY: u32 = u32::MAX;
/// Several tiles use the point.
const SEVERAL: u32 = u32::MAX - 1;

/// Tiles for each thread that are simplified before it is asked whether they are to be kept: some 3 s, of which waiting for the last takes 2 %.
const BATCH: usize = 32;

/// What all passes know. A point is what vertices at one position are together, named by the first of them.
struct Passes<'a> {
    context: &'a Context<'a>,
    fineness: &'a Fineness<'a>,
    interim: &'a dyn Interim,
}

/// The mesh between passes.
struct State<'a> {
    faces: Vec<Face>,
    /// The points that may be removed.
    free: Vec<bool>,
    witnesses: Witnesses<'a>,
}

/// A tile simplified.
struct Tile {
    faces: Vec<Face>,
    /// Its witnesses, each with its face among these.
    witnesses: Vec<(u32, u32)>,
    error_m: f32,
    rounds: usize,
}

/// Simplifies all of the mesh in tiles of at most `most` triangles. `original` are places that the mesh stands for; none where it is the original.
/// Simplified tiles are left to `interim`, and taken from there.
pub(super) fn run(
    context: &Context,
    fineness: &Fineness,
    most: usize,
    original: Option<&[Vec3]>,
    interim: &dyn Interim,
    tell: Tell,
) -> (Vec<Face>, SimplifyReport) {
    let mesh = context.mesh;
    let passes = Passes { context, fineness, interim };
    let material = |t: usize| mesh.triangle_material.get(t).copied().unwrap_or(0);
    let face = |(t, &corners): (usize, &[u32; 3])| Face { corners, material: material(t) };
    let faces: Vec<Face> = mesh.triangles.iter().enumerate().map(face).collect();
    let witnesses = match original {
        Some(places) => Witnesses::beside(places, mesh, interim),
        None => Witnesses::corners(&mesh.positions, &faces, context.point_of),
    };
    let mut state = State { faces, free: passes.not_held(), witnesses };
    let mut report = SimplifyReport { triangles_before: mesh.triangles.len(), ..SimplifyReport::default() };
    for (pass, (share, ends)) in SHARES.into_iter().zip(ENDS.windows(2)).enumerate() {
        let before = state.faces.len();
        let pass = passes.pass(&mut state, (pass, share), most, tell.within(ends[0], ends[1]));
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
    /// The points that are not held from outside.
    fn not_held(&self) -> Vec<bool> {
        let Context { mesh, held, .. } = self.context;
        if held.is_empty() {
            return vec![true; mesh.positions.len()];
        }
        mesh.positions.par_iter().map(|&p| !held.holds(p)).collect()
    }

    fn pass(&self, state: &mut State, (pass, share): (usize, f32), most: usize, tell: Tell) -> PassReport {
        let tiles = Tiles::cut(&self.context.mesh.positions, &state.faces, self.fineness, share, most);
        let owners = self.owners(&state.faces, &tiles);
        let owner = |vertex: u32| owners[self.context.point_of[vertex as usize] as usize].load(Ordering::Relaxed);
        let (by_face, before) = (state.witnesses.by_face(state.faces.len()), &*state);
        tell.done(CUT);
        let done = tell.within(CUT, 1.0).count(before.faces.len());
        let make = |index: usize| {
            let free = |v: u32| before.free[self.context.point_of[v as usize] as usize] && owner(v) == index as u32;
            self.tile(before, &by_face, &tiles.order[tiles.ranges[index].clone()], free)
        };
        let numbers = (pass * NUMBERS, tiles.ranges.len());
        let simplified = made_or_kept(self.interim, numbers, BATCH, make, |index| done.add(tiles.ranges[index].len()));
        let mut report = PassReport { tiles: tiles.ranges.len(), ..PassReport::default() };
        report.error_m = simplified.iter().map(|tile| tile.error_m).fold(0.0, f32::max);
        report.again = simplified.iter().map(|tile| tile.rounds - 1).sum();
        drop((tiles, by_face));
        state.faces = Vec::with_capacity(simplified.iter().map(|tile| tile.faces.len()).sum());
        state.witnesses.on.fill(NOWHERE);
        for tile in simplified {
            let first = state.faces.len() as u32;
            tile.witnesses.into_iter().for_each(|(witness, face)| state.witnesses.on[witness as usize] = first + face);
            state.faces.extend(tile.faces);
        }
        report.triangles = state.faces.len();
        let rim: Vec<bool> =
            (0..state.free.len()).map(|p| state.free[p] && owners[p].load(Ordering::Relaxed) == SEVERAL).collect();
        drop(owners);
        report.shared_points = rim.iter().filter(|rim| **rim).count();
        let mut free = rim;
        for _ in 0..RINGS {
            free = self.dilated(&state.faces, &free);
        }
        if !self.context.held.is_empty() {
            free.iter_mut().zip(self.not_held()).for_each(|(free, not_held)| *free &= not_held);
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
    fn tile(&self, state: &State, by_face: &ByFace, of: &[u32], free: impl Fn(u32) -> bool) -> Tile {
        let face = |t: &u32| state.faces[*t as usize];
        let (open, shut): (Vec<u32>, Vec<u32>) = of.iter().partition(|t| face(t).corners.iter().any(|&v| free(v)));
        let with_witnesses =
            |(place, t): (usize, &u32)| by_face.of(*t).iter().map(move |&witness| (witness, place as u32)).collect::<Vec<_>>();
        let mut witnesses: Vec<(u32, u32)> = shut.iter().enumerate().flat_map(with_witnesses).collect();
        let asked: Vec<(u32, u32)> = open.iter().enumerate().flat_map(with_witnesses).collect();
        let open: Vec<Face> = open.iter().map(face).collect();
        let mut faces: Vec<Face> = shut.iter().map(face).collect();
        let first = faces.len() as u32;

        let distance = |v: u32| self.fineness.distance_m(self.context.mesh.positions[v as usize]);
        let nearest_m = open.iter().flat_map(|face| face.corners).map(distance).fold(f32::INFINITY, f32::min);
        let mut allowed = self.fineness.at_distance(nearest_m);
        allowed.edge_m /= self.shown(&open).sqrt();
        let bench = self.context.bench(&open, allowed);
        let point = |v: u32| self.context.point_of[v as usize];
        let mut held: HashSet<u32> = HashSet::new();
        for rounds in 1..=MOST_ROUNDS {
            let attempt = bench.simplify(|v| free(v) && !held.contains(&point(v)));
            let places = asked.iter().map(|&(witness, _)| state.witnesses.places[witness as usize]);
            let found = settle(&attempt.surface(), self.fineness, places);
            let lost = asked.iter().zip(&found).filter(|(_, found)| **found == NOWHERE).map(|(asked, _)| asked);
            let before = held.len();
            let mut near = Near::new(if rounds <= SPARSE_ROUNDS { allowed.error_m } else { 0.0 });
            for &(witness, face) in lost {
                let corners = open[face as usize].corners.map(point);
                if corners.iter().any(|corner| !held.contains(corner))
                    && near.is_first(state.witnesses.places[witness as usize])
                {
                    held.extend(corners);
                }
            }
            if held.len() == before {
                // who was off before, and is still, keeps no face
                let settled = asked.iter().zip(found).map(|(&(witness, _), face)| (witness, face));
                witnesses.extend(settled.filter(|(_, face)| *face != NOWHERE).map(|(witness, face)| (witness, first + face)));
                faces.extend(attempt.faces());
                return Tile { faces, witnesses, error_m: attempt.error_m, rounds };
            }
        }
        faces.extend(open);
        witnesses.extend(asked.into_iter().map(|(witness, face)| (witness, first + face)));
        Tile { faces, witnesses, error_m: 0.0, rounds: MOST_ROUNDS }
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

impl Kept for Tile {
    fn put(&self, into: &mut Vec<u32>) {
        let Self { faces, witnesses, error_m, rounds } = self;
        into.extend([error_m.to_bits(), *rounds as u32, faces.len() as u32, witnesses.len() as u32]);
        faces.iter().for_each(|Face { corners: [a, b, c], material }| into.extend([*a, *b, *c, u32::from(*material)]));
        witnesses.iter().for_each(|&(witness, face)| into.extend([witness, face]));
    }

    fn get(from: &mut impl Iterator<Item = u32>) -> Option<Self> {
        let mut next = || from.next();
        let (error_m, rounds, faces, witnesses) = (f32::from_bits(next()?), next()? as usize, next()?, next()?);
        let mut face = || Some(Face { corners: [next()?, next()?, next()?], material: u16::try_from(next()?).ok()? });
        let faces = (0..faces).map(|_| face()).collect::<Option<_>>()?;
        let witnesses = (0..witnesses).map(|_| Some((from.next()?, from.next()?))).collect::<Option<_>>()?;
        Some(Self { faces, witnesses, error_m, rounds })
    }
}

/// Takes the first of places that lie near to each other.
struct Near {
    cell_m: f64,
    taken: HashSet<[i64; 3]>,
}

impl Near {
    /// Near are places in one cell of this size; with 0 none are.
    fn new(cell_m: f32) -> Self {
        Self { cell_m: f64::from(cell_m), taken: HashSet::new() }
    }

    fn is_first(&mut self, place: Vec3) -> bool {
        self.cell_m <= 0.0 || self.taken.insert(place.to_array().map(|x| (f64::from(x) / self.cell_m).floor() as i64))
    }
}
