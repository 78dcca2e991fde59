//! Which way round triangles are.

use super::{CleanParams, CleanReport, Mark, Winding, double_area, share};
use crate::Tell;
use crate::topology::{Patches, Sense, senses, turned_mostly};
use heliodon_mesh::Mesh;
use heliodon_mesh::topology::Edges;

/// How often triangles are turned: what that joins to a closed surface may be inside out as a whole.
const ROUNDS: usize = 4;

/// Finds triangles wound the wrong way and, where the parameters say so, turns them round. Answers with the edges of what is kept.
pub(super) fn mend(mesh: &mut Mesh, places: &[u32], params: &CleanParams, tell: Tell, report: &mut CleanReport) -> Edges {
    let mut flipped: Vec<u32> = Vec::new();
    let mut round = 0;
    let edges = loop {
        let kept = |t: usize| !report.marks[t].is_removed();
        let edges = Edges::new(&mesh.triangles, places, kept);
        tell.done(share::EDGED);
        let patches = Patches::new(&mesh.positions, &mesh.triangles, &edges, kept);
        tell.done(share::PATCHED);
        let wrong = find(mesh, &patches, params, round == 0, report);
        if params.winding == Winding::Report {
            wrong.iter().for_each(|&t| report.marks[t as usize] = Mark::WrongWay);
            break edges;
        }
        for &t in &wrong {
            mesh.triangles[t as usize].swap(1, 2);
        }
        let joins = |&t: &u32| patches.of(t as usize).is_some_and(|(patch, _)| patches.list[patch].shares_edges);
        let settled = !wrong.iter().any(joins);
        flipped.extend(wrong);
        round += 1;
        if settled || round == ROUNDS {
            break edges;
        }
    };
    // what was turned twice is as it was
    flipped.sort_unstable();
    let flipped: Vec<u32> =
        flipped.chunk_by(|a, b| a == b).filter(|times| times.len() % 2 == 1).map(|times| times[0]).collect();
    for &t in &flipped {
        report.marks[t as usize] = Mark::Flipped;
    }
    report.flipped = flipped.len() as u64;
    report.flipped_normals = turn_normals(mesh, &flipped, &report.marks);
    edges
}

/// The triangles that are wound the wrong way. What is found is counted and marked if this is the first time.
fn find(mesh: &Mesh, patches: &Patches, params: &CleanParams, first: bool, report: &mut CleanReport) -> Vec<u32> {
    report.patches = patches.list.iter().filter(|patch| patch.triangles > 0).count() as u64;
    report.closed_patches = patches.list.iter().filter(|patch| patch.closed).count() as u64;
    let senses = senses(mesh, patches, &params.eyes);
    report.hollows = senses.iter().filter(|&&sense| matches!(sense, Sense::Hollow | Sense::Room)).count() as u64;
    let mut all_wrong = Vec::new();
    for t in 0..mesh.triangles.len() {
        let Some((patch, turned)) = patches.of(t) else { continue };
        let against = turned != turned_mostly(&patches.list[patch]);
        if senses[patch] == Sense::OneSided {
            if first {
                report.one_sided.add(mesh, t);
                report.marks[t] = Mark::OneSided;
            }
            continue;
        }
        let inside_out = senses[patch] == Sense::InsideOut;
        if against && first {
            report.inconsistent.add(mesh, t);
        }
        if inside_out && first {
            report.inside_out.add(mesh, t);
        }
        if against != inside_out {
            all_wrong.push(t as u32);
        }
    }
    all_wrong
}

/// Turns the normals of turned triangles' vertices that look away from all that they now belong to.
fn turn_normals(mesh: &mut Mesh, flipped: &[u32], marks: &[Mark]) -> u64 {
    if mesh.normals.is_empty() || flipped.is_empty() {
        return 0;
    }
    let mut touched = vec![false; mesh.positions.len()];
    for &t in flipped {
        for vertex in mesh.triangles[t as usize] {
            touched[vertex as usize] = true;
        }
    }
    // how much area faces the normal less how much looks away, at each such vertex
    let mut facing = vec![0.0_f32; mesh.positions.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        if !marks[t].is_removed() && triangle.iter().any(|&vertex| touched[vertex as usize]) {
            let normal = double_area(mesh, t);
            for vertex in triangle.map(|vertex| vertex as usize) {
                facing[vertex] += normal.dot(mesh.normals[vertex].as_dvec3()) as f32;
            }
        }
    }
    let mut turned = 0;
    for ((normal, facing), touched) in mesh.normals.iter_mut().zip(facing).zip(touched) {
        if touched && facing < 0.0 {
            *normal = -*normal;
            turned += 1;
        }
    }
    turned
}
