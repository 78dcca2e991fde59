//! Borders that meshes share, so that no crack opens between meshes that are simplified apart.
//!
//! A scan often comes as tiles in several files, whose rims share their vertices. Simplified each on its own, both sides of a rim would keep other
//! vertices, and a crack would open as wide as both tolerances. So what is common is found before: places where vertices of two meshes lie, at the rim of
//! one of these or of what they share, and both hold these ([`Held`]). Within what coincides nothing is held: there no crack opens.
//!
//! First, vertices within the weld's reach of another mesh's move onto them. Then edges are halved whose middle is a vertex of another mesh: splitting
//! asks all meshes the same question, but ground may have been split less finely, and what is lit by texels not at all; so the finer side wins.
//!
//! Why positions and not edges decide: an edge between two places that both sides hold stays on both sides, and places need only be sorted. Only
//! what lies where the boxes of two meshes overlap is looked at: two tiles of five million triangles each take 0.7 s, the six meshes of a temple of
//! ten million, whose boxes lie in one another, 1.7 s, and two tiles of which every vertex is shared 10 s (two shared cores; with a weld, twice that).

mod nearby;
mod rims;

use crate::simplify::{Held, place_bits};
use crate::split::{SplitError, split};
use glam::Vec3;
use heliodon_mesh::Mesh;
use nearby::{Around, Nearby};
use rayon::prelude::*;
use rims::rims;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::fmt;

/// A mesh among others.
pub struct Neighbor<'m> {
    /// Its geometry.
    pub mesh: &'m mut Mesh,
    /// Vertices of others within this of one of its own are meant to be at the same place, metres; of two meshes the greater counts.
    pub weld_m: f32,
}

/// What a mesh has in common with others.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shared {
    /// What simplification is to leave where it is.
    pub held: Held,
    /// In numbers.
    pub report: BorderReport,
}

/// What a mesh has in common with others, and what was done for it. Its `Display` is a line for people.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct BorderReport {
    /// Places at which another mesh has a vertex, too.
    pub shared_places: u64,
    /// Those of them at a rim of a mesh or of what is shared: they are held.
    pub held_places: u64,
    /// Vertices that were moved onto another mesh's, within the weld's reach.
    pub moved_vertices: u64,
    /// Triangles that were split where another mesh has a vertex in the middle of an edge.
    pub split_triangles: u64,
    /// The first vertex that is held, metres.
    pub first: Option<[f32; 3]>,
}

impl BorderReport {
    /// Whether nothing is shared and nothing was done.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.shared_places == 0 && !self.changes()
    }

    /// Whether the mesh is another one than it was.
    #[must_use]
    pub fn changes(&self) -> bool {
        self.moved_vertices > 0 || self.split_triangles > 0
    }
}

impl fmt::Display for BorderReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { shared_places, held_places, moved_vertices, split_triangles, first } = self;
        write!(f, "{shared_places} places shared with other parts, {held_places} of them at a rim, held")?;
        if let Some([x, y, z]) = first {
            write!(f, ", first at ({x:.3}, {y:.3}, {z:.3})")?;
        }
        if *moved_vertices > 0 {
            write!(f, "; {moved_vertices} vertices moved onto another part's")?;
        }
        if *split_triangles > 0 {
            write!(f, "; {split_triangles} triangles split where another part has a vertex")?;
        }
        Ok(())
    }
}

/// Edges are halved for another mesh's vertex where they are longer than so many reaches: the vertex at the middle is then none of the ends'.
const LEAST_EDGE: f32 = 4.0;

/// Where the box of another mesh overlaps with one's own.
struct Meeting {
    other: usize,
    /// Vertices within this of each other are at one place.
    reach_m: f32,
    low: Vec3,
    high: Vec3,
}

impl Meeting {
    fn holds(&self, p: Vec3) -> bool {
        self.low.cmple(p).all() && self.high.cmpge(p).all()
    }

    /// The vertices that lie there, as far as they are `wanted`.
    fn vertices(&self, positions: &[Vec3], wanted: impl Fn(Vec3) -> bool + Sync) -> Vec<u32> {
        let is_there = |p: Vec3| self.holds(p) && wanted(p);
        (0..positions.len() as u32).into_par_iter().filter(|&v| is_there(positions[v as usize])).collect()
    }

    /// Their positions.
    fn places(&self, positions: &[Vec3], wanted: impl Fn(Vec3) -> bool + Sync) -> Vec<Vec3> {
        positions.par_iter().copied().filter(|&p| self.holds(p) && wanted(p)).collect()
    }
}

/// Finds what clean meshes ([`crate::clean`]) have in common. Vertices within reach of another mesh's are moved onto those of the earlier
/// mesh, and edges are halved in whose middle another mesh has a vertex. Meshes whose boxes do not meet are not looked at any further.
///
/// # Errors
/// When halving edges makes more than `most_triangles` of a mesh.
///
/// # Panics
/// Where a triangle names a vertex that does not exist.
pub fn share(neighbors: &mut [Neighbor], most_triangles: usize) -> Result<Vec<Shared>, SplitError> {
    let mut shared = vec![Shared::default(); neighbors.len()];
    let meetings = meetings(neighbors);
    if meetings.iter().all(Vec::is_empty) {
        return Ok(shared);
    }
    settle(neighbors, &meetings, &mut shared);
    if split_alike(neighbors, &meetings, most_triangles, &mut shared)? {
        settle(neighbors, &meetings, &mut shared);
    }
    let mut common = common_places(neighbors, &meetings);
    let at_rims = common.iter().zip(&*neighbors).flat_map(|(of, neighbor)| rims(neighbor.mesh, of)).collect();
    let at_rims = Held::of_bits(at_rims);
    for ((of, neighbor), shared) in common.iter_mut().zip(neighbors).zip(&mut shared) {
        shared.report.shared_places = of.len() as u64;
        of.retain(|place| at_rims.bits().binary_search(place).is_ok());
        shared.report.held_places = of.len() as u64;
        shared.held = Held::of_bits(std::mem::take(of));
        let first = neighbor.mesh.positions.par_iter().copied().find_first(|&p| shared.held.holds(p));
        shared.report.first = first.map(|place| place.to_array());
    }
    Ok(shared)
}

/// For each mesh the others whose boxes meet its own, in order.
fn meetings(neighbors: &[Neighbor]) -> Vec<Vec<Meeting>> {
    if neighbors.len() < 2 {
        return neighbors.iter().map(|_| Vec::new()).collect();
    }
    let bounds: Vec<Option<(Vec3, Vec3)>> = neighbors.par_iter().map(|neighbor| neighbor.mesh.bounds()).collect();
    let meeting = |index: usize, other: usize| {
        let (own, others) = (bounds[index]?, bounds[other]?);
        let reach_m = neighbors[index].weld_m.max(neighbors[other].weld_m).max(0.0);
        let (low, high) = (own.0.max(others.0) - reach_m, own.1.min(others.1) + reach_m);
        (index != other && low.cmple(high).all()).then_some(Meeting { other, reach_m, low, high })
    };
    (0..bounds.len()).map(|index| (0..bounds.len()).filter_map(|other| meeting(index, other)).collect()).collect()
}

/// Moves vertices onto those of earlier meshes that are within reach. Of several places within reach of one only the nearest moves there, so no
/// triangle loses its area.
fn settle(neighbors: &mut [Neighbor], meetings: &[Vec<Meeting>], shared: &mut [Shared]) {
    for index in 0..neighbors.len() {
        // what lies at an earlier mesh's place stays there
        let mut settled: HashSet<[u32; 3]> = HashSet::new();
        for meeting in meetings[index].iter().filter(|meeting| meeting.other < index && meeting.reach_m > 0.0) {
            // nor does anything else move there
            let is_free = |p: Vec3| settled.is_empty() || !settled.contains(&place_bits(p));
            let mut there = meeting.places(&neighbors[meeting.other].mesh.positions, is_free);
            let positions = &mut neighbors[index].mesh.positions;
            let around = Around::places(&[(meeting.reach_m, &there)]);
            let here = meeting.vertices(positions, |p| around.may_hold(p));
            let mut places: Vec<[u32; 3]> = here.iter().map(|&v| place_bits(positions[v as usize])).collect();
            places.par_sort_unstable();
            places.dedup();
            places.retain(|place| !settled.contains(place));
            let at: Vec<Vec3> = places.iter().map(|&place| of_bits(place)).collect();
            let around = Around::places(&[(meeting.reach_m, &at)]);
            there.retain(|&p| around.may_hold(p));
            let moves = moves(&places, &there, meeting.reach_m);
            for &v in &here {
                let p = &mut positions[v as usize];
                let from = place_bits(*p);
                if let Ok(at) = moves.binary_search_by_key(&from, |&(from, _)| from) {
                    let to = moves[at].1;
                    *p = of_bits(to);
                    shared[index].report.moved_vertices += u64::from(from != to);
                }
            }
            settled.extend(moves.into_iter().map(|(_, to)| to));
        }
    }
}

/// The place of such bits ([`place_bits`]).
fn of_bits(place: [u32; 3]) -> Vec3 {
    Vec3::from(place.map(f32::from_bits))
}

/// Which of some places goes to which of the others, in order.
fn moves(places: &[[u32; 3]], there: &[Vec3], reach_m: f32) -> Vec<([u32; 3], [u32; 3])> {
    let nearby = Nearby::new(there, reach_m);
    let nearest = |&from: &[u32; 3]| {
        let (to, squared) = nearby.nearest(of_bits(from))?;
        // bits of what is not negative are in its order
        Some((place_bits(there[to as usize]), squared.to_bits(), from))
    };
    let mut nearest: Vec<_> = places.par_iter().filter_map(nearest).collect();
    nearest.par_sort_unstable();
    nearest.dedup_by_key(|&mut (to, _, _)| to);
    let mut moves: Vec<_> = nearest.into_iter().map(|(to, _, from)| (from, to)).collect();
    moves.par_sort_unstable();
    moves
}

/// Halves edges in whose middle another mesh has a vertex; tells whether there were any.
fn split_alike(
    neighbors: &mut [Neighbor],
    meetings: &[Vec<Meeting>],
    most_triangles: usize,
    shared: &mut [Shared],
) -> Result<bool, SplitError> {
    let mut any = false;
    for index in (0..neighbors.len()).filter(|&index| !meetings[index].is_empty()) {
        let own = around_triangles(neighbors[index].mesh, &meetings[index]);
        let near = |meeting: &Meeting| meeting.places(&neighbors[meeting.other].mesh.positions, |p| own.may_hold(p));
        let places: Vec<Vec<Vec3>> = meetings[index].iter().map(near).collect();
        let met = meetings[index].iter().zip(&places).filter(|(_, places)| !places.is_empty());
        let met: Vec<(&Meeting, Nearby)> =
            met.map(|(meeting, places)| (meeting, Nearby::new(places, meeting.reach_m))).collect();
        if met.is_empty() {
            continue;
        }
        let of_each = meetings[index].iter().zip(&places);
        let around = Around::places(&of_each.map(|(meeting, places)| (meeting.reach_m, places.as_slice())).collect::<Vec<_>>());
        let longest_m = |middle: Vec3, _along: Vec3| {
            if !around.may_hold(middle) {
                return f32::INFINITY;
            }
            let is_there = |(meeting, nearby): &&(&Meeting, Nearby)| meeting.holds(middle) && nearby.nearest(middle).is_some();
            met.iter().find(is_there).map_or(f32::INFINITY, |(meeting, _)| LEAST_EDGE * meeting.reach_m)
        };
        let most = most_triangles.max(neighbors[index].mesh.triangles.len());
        let report = split(neighbors[index].mesh, longest_m, most)?;
        shared[index].report.split_triangles = report.split_triangles;
        any |= report.split_triangles > 0;
    }
    Ok(any)
}

/// Where a mesh has triangles, and others that it meets may have something to do with them.
fn around_triangles(mesh: &Mesh, meetings: &[Meeting]) -> Around {
    let bounds = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let bounds = meetings.iter().fold(bounds, |(low, high), meeting| (low.min(meeting.low), high.max(meeting.high)));
    let reach_m = meetings.iter().fold(0.0_f32, |reach_m, meeting| reach_m.max(meeting.reach_m));
    Around::triangles(mesh, bounds, reach_m)
}

/// For each mesh the places where another one has a vertex as well, in order.
fn common_places(neighbors: &[Neighbor], meetings: &[Vec<Meeting>]) -> Vec<Vec<[u32; 3]>> {
    let mut named: Vec<([u32; 3], u32)> = Vec::new();
    for (index, (neighbor, meetings)) in neighbors.iter().zip(meetings).enumerate() {
        let meets = |p: &&Vec3| meetings.iter().any(|meeting| meeting.holds(**p));
        named.par_extend(neighbor.mesh.positions.par_iter().filter(meets).map(|&p| (place_bits(p), index as u32)));
    }
    named.par_sort_unstable();
    named.dedup();
    let mut common = vec![Vec::new(); neighbors.len()];
    for same in named.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() > 1) {
        same.iter().for_each(|&(place, index)| common[index as usize].push(place));
    }
    common
}

#[cfg(test)]
mod tests;
