//! Which way round triangles are.

use super::{CleanParams, CleanReport, Mark, Winding, double_area};
use crate::topology::{Patches, Sense, senses, turned_mostly};
use heliodon_mesh::Mesh;

/// Finds triangles wound the wrong way and, where the parameters say so, turns them round.
pub(super) fn mend(mesh: &mut Mesh, patches: &Patches, params: &CleanParams, report: &mut CleanReport) {
    report.patches = patches.list.iter().filter(|patch| patch.triangles > 0).count() as u64;
    report.closed_patches = patches.list.iter().filter(|patch| patch.closed).count() as u64;
    let senses = senses(mesh, patches, &params.eyes);
    report.hollows = senses.iter().filter(|&&sense| matches!(sense, Sense::Hollow | Sense::Room)).count() as u64;
    let mut flipped = Vec::new();
    for t in 0..mesh.triangles.len() {
        let Some((patch, turned)) = patches.of(t) else { continue };
        let against = turned != turned_mostly(&patches.list[patch]);
        if senses[patch] == Sense::OneSided {
            report.one_sided.add(mesh, t);
            report.marks[t] = Mark::OneSided;
            continue;
        }
        if against {
            report.inconsistent.add(mesh, t);
        }
        let inside_out = senses[patch] == Sense::InsideOut;
        if inside_out {
            report.inside_out.add(mesh, t);
        }
        let wrong = against != inside_out;
        if wrong && params.winding == Winding::Mend {
            flipped.push(t as u32);
            report.marks[t] = Mark::Flipped;
        } else if wrong {
            report.marks[t] = Mark::WrongWay;
        }
    }
    for &t in &flipped {
        mesh.triangles[t as usize].swap(1, 2);
    }
    report.flipped = flipped.len() as u64;
    report.flipped_normals = turn_normals(mesh, &flipped, &report.marks);
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
