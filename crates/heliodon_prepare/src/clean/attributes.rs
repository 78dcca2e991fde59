//! Vertices: mended where they break promises, united where nothing tells them apart, gone where nobody uses them.

use super::Mark;
use glam::{Vec2, Vec3};
use heliodon_mesh::{Mesh, normals};

/// Vertices at one place that are compared with a further one, at most: more are a heap, whose pairs would take for ever.
const MOST_AT_A_PLACE: usize = 64;

/// A normal this far from length 1 is made unit; [`Mesh::validate`] takes 1e-5.
const UNIT_TOLERANCE: f32 = 1.0e-5;

/// Mends normals, texture coordinates, colours and materials that break the mesh's promises, and answers how many.
pub(super) fn mend(mesh: &mut Mesh) -> u64 {
    let mut mended = 0;
    for uv in mesh.uvs.iter_mut().filter(|uv| !uv.is_finite()) {
        *uv = Vec2::ZERO;
        mended += 1;
    }
    for color in &mut mesh.colors_linear {
        // NaN becomes 0
        let good = color.max(Vec3::ZERO).min(Vec3::ONE);
        if good != *color {
            *color = good;
            mended += 1;
        }
    }
    let is_unit = |n: &&Vec3| (n.length() - 1.0).abs() < UNIT_TOLERANCE;
    let bad = (mesh.normals.len() - mesh.normals.iter().filter(is_unit).count()) as u64;
    if bad > 0 {
        // a position that is not finite has no normal, and none is asked of it
        normals::mend(mesh);
    }
    mended + bad
}

/// Leaves the triangles that are not removed, and of the vertices those that they use, one for each place and look.
pub(super) fn keep(mesh: &mut Mesh, places: &[u32], crease_rad: f32, marks: &[Mark]) {
    let mut kept = marks.iter().map(|mark| !mark.is_removed());
    mesh.triangle_material.retain(|_| kept.next().unwrap_or(false));
    let mut kept = marks.iter().map(|mark| !mark.is_removed());
    mesh.triangles.retain(|_| kept.next().unwrap_or(false));

    let leaders = leaders(mesh, places, crease_rad);
    // a leader stands before those that it leads, so vertices move forward only
    let mut renamed = leaders;
    let mut count = 0;
    for vertex in 0..renamed.len() {
        renamed[vertex] = match renamed[vertex] {
            UNUSED => UNUSED,
            leader if leader as usize == vertex => {
                mesh.positions[count] = mesh.positions[vertex];
                move_to(&mut mesh.normals, vertex, count);
                move_to(&mut mesh.uvs, vertex, count);
                move_to(&mut mesh.colors_linear, vertex, count);
                count += 1;
                count as u32 - 1
            }
            leader => renamed[leader as usize],
        };
    }
    mesh.positions.truncate(count);
    mesh.normals.truncate(count);
    mesh.uvs.truncate(count);
    mesh.colors_linear.truncate(count);
    for vertex in mesh.triangles.as_flattened_mut() {
        *vertex = renamed[*vertex as usize];
    }
}

fn move_to<T: Copy>(array: &mut [T], from: usize, to: usize) {
    if let Some(&value) = array.get(from) {
        array[to] = value;
    }
}

/// No triangle uses the vertex.
const UNUSED: u32 = u32::MAX;

/// For every vertex that a triangle uses the first such vertex at its place that looks the same.
fn leaders(mesh: &Mesh, places: &[u32], crease_rad: f32) -> Vec<u32> {
    let mut leaders = vec![UNUSED; mesh.positions.len()];
    for &vertex in mesh.triangles.as_flattened() {
        leaders[vertex as usize] = vertex;
    }
    let least = libm::cosf(crease_rad.clamp(0.0, std::f32::consts::PI));
    let alike = |a: usize, b: usize| {
        let normal = mesh.normals.get(a).zip(mesh.normals.get(b)).is_none_or(|(n, m)| n == m || n.dot(*m) >= least);
        let uv = mesh.uvs.get(a).zip(mesh.uvs.get(b)).is_none_or(|(a, b)| a == b);
        normal && uv && mesh.colors_linear.get(a).zip(mesh.colors_linear.get(b)).is_none_or(|(a, b)| a == b)
    };
    // the leaders at a place make a chain, which begins at the place
    let mut first = vec![UNUSED; mesh.positions.len()];
    let mut next = vec![UNUSED; mesh.positions.len()];
    for vertex in 0..leaders.len() {
        if leaders[vertex] == UNUSED {
            continue;
        }
        let head = &mut first[places[vertex] as usize];
        if *head == UNUSED {
            *head = vertex as u32;
            continue;
        }
        let mut last = *head;
        for _ in 0..MOST_AT_A_PLACE {
            if alike(last as usize, vertex) {
                leaders[vertex] = last;
                break;
            }
            match next[last as usize] {
                UNUSED => {
                    next[last as usize] = vertex as u32;
                    break;
                }
                other => last = other,
            }
        }
    }
    leaders
}
