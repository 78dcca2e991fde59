//! Unions put into the mesh in the place of what they were made of.

use super::Fate;
use super::union::Union;
use glam::{DVec3, Vec3};
use heliodon_mesh::Mesh;
use std::collections::HashMap;

/// A new vertex lies on an edge of the triangle that it comes from if its weight for the opposite corner is below this: positions are
/// rounded to f32, which moves it by less.
const ON_EDGE: f64 = 1.0e-6;

/// Takes out what is gone, and puts in the unions.
pub(super) fn stitch(mesh: &mut Mesh, fates: &[Fate], unions: &[Union]) {
    let mut gone: Vec<bool> = fates.iter().map(|fate| *fate == Fate::Buried).collect();
    for &t in unions.iter().flat_map(|union| &union.replaced) {
        gone[t as usize] = true;
    }
    let mut pieces = Vec::new();
    for union in unions {
        let mut made = HashMap::new();
        for &(corners, from) in &union.triangles {
            let triangle = corners.map(|v| vertex(mesh, &mut made, v, union.positions[v as usize], from));
            pieces.push((triangle, mesh.triangle_material.get(from as usize).copied()));
        }
    }
    let mut kept = gone.iter().map(|gone| !gone);
    mesh.triangle_material.retain(|_| kept.next().unwrap_or(true));
    let mut kept = gone.iter().map(|gone| !gone);
    mesh.triangles.retain(|_| kept.next().unwrap_or(true));
    for (triangle, material) in pieces {
        mesh.triangles.push(triangle);
        mesh.triangle_material.extend(material);
    }
}

/// The mesh's vertex for one of the union's: a corner of the triangle that it comes from, or a new one on an edge of that, which
/// neighbours with the same edge share, or inside of it.
fn vertex(mesh: &mut Mesh, made: &mut HashMap<[u32; 3], u32>, of_union: u32, p: Vec3, from: u32) -> u32 {
    let corners = mesh.triangles[from as usize];
    if let Some(&corner) = corners.iter().find(|&&corner| mesh.positions[corner as usize] == p) {
        return corner;
    }
    let weights = weights(corners.map(|v| mesh.positions[v as usize].as_dvec3()), p.as_dvec3());
    // where it lies on an edge, only the edge's ends count, in one order, so that both sides come to the same
    let on_edge = (0..3).filter(|&k| weights[k] < ON_EDGE).min_by(|&a, &b| weights[a].total_cmp(&weights[b]));
    let (ends, weights) = match on_edge {
        Some(k) => {
            let (a, b) = (corners[(k + 1) % 3].min(corners[(k + 2) % 3]), corners[(k + 1) % 3].max(corners[(k + 2) % 3]));
            let [p_a, p_b] = [a, b].map(|v| mesh.positions[v as usize].as_dvec3());
            let along = (p.as_dvec3() - p_a).dot(p_b - p_a) / p_b.distance_squared(p_a);
            let along = along.clamp(0.0, 1.0);
            ([a, b, b], [1.0 - along, along, 0.0])
        }
        None => (corners, weights),
    };
    let key = if on_edge.is_some() { [of_union, ends[0], ends[1]] } else { [of_union, from, u32::MAX] };
    *made.entry(key).or_insert_with(|| {
        let vertex = mesh.positions.len() as u32;
        mesh.positions.push(p);
        let mix = |array: &[Vec3]| -> DVec3 {
            ends.iter().zip(weights).map(|(&v, weight)| array[v as usize].as_dvec3() * weight).sum()
        };
        if !mesh.normals.is_empty() {
            let normal = mix(&mesh.normals).try_normalize().map_or(mesh.normals[ends[0] as usize], |n| n.as_vec3());
            mesh.normals.push(normal);
        }
        if !mesh.colors_linear.is_empty() {
            let color = mix(&mesh.colors_linear).as_vec3().clamp(Vec3::ZERO, Vec3::ONE);
            mesh.colors_linear.push(color);
        }
        if !mesh.uvs.is_empty() {
            let uv = ends.iter().zip(weights).map(|(&v, weight)| mesh.uvs[v as usize].as_dvec2() * weight).sum::<glam::DVec2>();
            mesh.uvs.push(uv.as_vec2());
        }
        vertex
    })
}

/// The barycentric weights of a point in a triangle's plane, none below 0.
fn weights([a, b, c]: [DVec3; 3], p: DVec3) -> [f64; 3] {
    let normal = (b - a).cross(c - a);
    let part = |u: DVec3, v: DVec3| ((u - p).cross(v - p).dot(normal)).max(0.0);
    let parts = [part(b, c), part(c, a), part(a, b)];
    let sum: f64 = parts.iter().sum();
    if sum > 0.0 { parts.map(|part| part / sum) } else { [1.0, 0.0, 0.0] }
}
