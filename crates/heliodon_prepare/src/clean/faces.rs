//! Triangles that are none, and triangles that are there twice.

use super::{CleanReport, DoubleWalls, Finding, Mark};
use glam::Vec3;
use heliodon_mesh::Mesh;
use heliodon_mesh::topology::{Buckets, Edges, NOWHERE};
use std::collections::HashMap;

/// A triangle whose height over its longest edge is below this part of the edge has no area. Positions are rounded to 6e-8 of their
/// distance from the origin, so such a one has a normal by chance at best; the gap that it leaves is a micrometre wide for a metre.
const LEAST_HEIGHT: f64 = 1.0e-6;

/// Whether three corners span a triangle.
pub(super) fn is_flat([a, b, c]: [Vec3; 3]) -> bool {
    let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    // not "less than": a single point has neither area nor edges
    (b - a).cross(c - a).length() <= LEAST_HEIGHT * longest
}

/// Marks triangles with corners that are not finite, or without an area.
pub(super) fn mark_unfit(mesh: &Mesh, places: &[u32], report: &mut CleanReport) {
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(|vertex| places[vertex as usize]);
        if [a, b, c].contains(&NOWHERE) {
            report.marks[t] = Mark::NonFinite;
            report.non_finite.triangles += 1;
        } else if a == b || b == c || c == a {
            report.marks[t] = Mark::Degenerate;
            report.degenerate.add(mesh, t);
        } else if is_flat(mesh.corners(t)) {
            report.marks[t] = Mark::Flat;
        }
    }
}

/// Marks those triangles without an area as removed that have an edge without a neighbour, or come to have one by that. What is left
/// of them closes a body as it is.
pub(super) fn peel_flat(mesh: &Mesh, places: &[u32], report: &mut CleanReport) {
    if !report.marks.contains(&Mark::Flat) {
        return;
    }
    let marks = &report.marks;
    // the edges of flat triangles: how many triangles are there, and which of them are flat
    let mut around: HashMap<u64, (usize, Vec<u32>)> = HashMap::new();
    let mut loose = Vec::new();
    Edges::new(&mesh.triangles, places, |t| !marks[t].is_removed()).for_each(|[a, b], sides| {
        let count = sides.len();
        let flat: Vec<u32> = sides.map(|side| side.triangle).filter(|&t| marks[t as usize] == Mark::Flat).collect();
        if !flat.is_empty() {
            if count == 1 {
                loose.push(flat[0]);
            }
            around.insert(u64::from(a) << 32 | u64::from(b), (count, flat));
        }
    });
    while let Some(t) = loose.pop() {
        if report.marks[t as usize] != Mark::Flat {
            continue;
        }
        report.marks[t as usize] = Mark::Degenerate;
        let at = mesh.triangles[t as usize].map(|v| places[v as usize]);
        for (a, b) in [(at[0], at[1]), (at[1], at[2]), (at[2], at[0])] {
            let Some((count, flat)) = around.get_mut(&(u64::from(a.min(b)) << 32 | u64::from(a.max(b)))) else { continue };
            *count -= 1;
            flat.retain(|&other| other != t);
            if *count == 1 {
                loose.extend(flat.iter());
            }
        }
    }
    for t in 0..mesh.triangles.len() {
        match report.marks[t] {
            Mark::Flat => report.flat.add(mesh, t),
            Mark::Degenerate if is_three(mesh, places, t) => report.degenerate.add(mesh, t),
            _ => {}
        }
    }
}

/// Whether a triangle's corners are at three places.
fn is_three(mesh: &Mesh, places: &[u32], t: usize) -> bool {
    let [a, b, c] = mesh.triangles[t].map(|v| places[v as usize]);
    a != b && b != c && c != a
}

/// A triangle by its places: the two higher ones, then twice its number, and one more if it runs the other way round.
type Key = [u32; 3];

/// Marks triangles at the same three places as an earlier one. Asked again it counts what is new, and double walls anew where they stay.
pub(super) fn mark_repeated(mesh: &Mesh, places: &[u32], walls: DoubleWalls, report: &mut CleanReport) {
    if walls == DoubleWalls::Keep {
        report.double_walls = Finding::default();
    }
    let marks = &report.marks;
    let buckets: Buckets<Key> = Buckets::new(places.len(), |give| {
        for (t, triangle) in mesh.triangles.iter().enumerate().filter(|(t, _)| !marks[*t].is_removed()) {
            let [a, b, c] = triangle.map(|vertex| places[vertex as usize]);
            // turned so that the lowest comes first, which keeps the sense
            let [low, next, last] = if a < b && a < c {
                [a, b, c]
            } else if b < c {
                [b, c, a]
            } else {
                [c, a, b]
            };
            give(low, [next.min(last), next.max(last), (t as u32) << 1 | u32::from(next > last)]);
        }
    });
    let (mut duplicates, mut double) = (Vec::new(), Vec::new());
    for (_, keys) in buckets.iter() {
        for same in keys.chunk_by(|a, b| a[..2] == b[..2]).filter(|same| same.len() > 1) {
            let mut first = [None; 2];
            for &[_, _, name] in same {
                match &mut first[name as usize & 1] {
                    Some(_) => duplicates.push(name >> 1),
                    none => *none = Some(name >> 1),
                }
            }
            if let [Some(a), Some(b)] = first {
                double.push([a.min(b), a.max(b)]);
            }
        }
    }
    drop(buckets);
    // in the order of the mesh, so that the first place told is the first there
    duplicates.sort_unstable();
    double.sort_unstable();
    for t in duplicates {
        report.marks[t as usize] = Mark::Duplicate;
        report.duplicate.add(mesh, t as usize);
    }
    for pair in double {
        for (t, removed) in pair.into_iter().zip([walls == DoubleWalls::Remove, walls != DoubleWalls::Keep]) {
            report.double_walls.add(mesh, t as usize);
            report.double_walls_removed += u64::from(removed);
            report.marks[t as usize] = if removed { Mark::RemovedDoubleWall } else { Mark::DoubleWall };
        }
    }
}
