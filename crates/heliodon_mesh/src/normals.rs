//! Vertex normals from triangles, weighted by the angle at the vertex, so that they do not depend on how a face is cut.
//!
//! Thürmer, Wüthrich: "Computing Vertex Normals from Polygonal Facets", Journal of Graphics Tools 3(1), 1998.
//!
//! Everything is computed in `f64` from `f32` positions, where neither the smallest nor the largest triangle under- or overflows
//! (lengths from 1e-45 to 2e8 m square to 1e-90 and 4e16), and added up in the order of the triangles, so that the result has
//! the same bits for any number of threads. A triangle without area adds nothing.

use crate::{Mesh, weld};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Triangles whose corners are worked out at a time, in parallel, before they are added up in order.
const BLOCK: usize = 1 << 16;

/// Vertices at one position whose own normals differ by less smooth one another: the seams of a texture atlas do, the edges of a
/// cube that was written with a vertex for each face do not.
pub const SEAM_ANGLE_RAD: f32 = std::f32::consts::FRAC_PI_3;

/// The unit normal of each triangle, or zero, and the angles at its corners in radians.
#[inline]
pub(crate) fn face(positions: &[Vec3], corners: [u32; 3]) -> (DVec3, [f64; 3]) {
    let [a, b, c] = corners.map(|i| positions[i as usize].as_dvec3());
    let (ab, bc, ca) = (b - a, c - b, a - c);
    let cross = ab.cross(-ca);
    let double_area = cross.length();
    // NaN fails the comparison
    if !(double_area > 0.0 && double_area.is_finite()) {
        return (DVec3::ZERO, [0.0; 3]);
    }
    let angle = |u: DVec3, v: DVec3| libm::atan2(double_area, u.dot(v));
    let (at_a, at_b) = (angle(ab, -ca), angle(-ab, bc));
    (cross / double_area, [at_a, at_b, (std::f64::consts::PI - at_a - at_b).max(0.0)])
}

/// The angle-weighted normals of vertices as the triangles share them; zero where no triangle with an area uses a vertex.
#[must_use]
pub fn angle_weighted(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = weighted_sums(positions, triangles);
    sums.par_iter_mut().for_each(|n| *n = unit_or_zero(*n));
    sums
}

fn weighted_sums(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; positions.len()];
    let mut faces = Vec::new();
    for block in triangles.chunks(BLOCK) {
        block.par_iter().map(|&t| face(positions, t)).collect_into_vec(&mut faces);
        for (corners, (normal, angles)) in block.iter().zip(&faces) {
            for (&vertex, &angle) in corners.iter().zip(angles) {
                sums[vertex as usize] += (*normal * angle).as_vec3();
            }
        }
    }
    sums
}

fn unit_or_zero(n: Vec3) -> Vec3 {
    n.as_dvec3().try_normalize().unwrap_or(DVec3::ZERO).as_vec3()
}

/// Gives a mesh computed normals without touching its vertices. Vertices at one position smooth one another where their own
/// normals are within [`SEAM_ANGLE_RAD`]. A vertex that no triangle with an area uses looks up (+Y).
pub fn compute(mesh: &mut Mesh) {
    let own = weighted_sums(&mesh.positions, &mesh.triangles);
    mesh.normals = across_seams(&mesh.positions, own);
    for n in &mut mesh.normals {
        if *n == Vec3::ZERO {
            *n = Vec3::Y;
        }
    }
}

fn across_seams(positions: &[Vec3], sums: Vec<Vec3>) -> Vec<Vec3> {
    let first = weld::first_of_position(positions);
    let seams = first.iter().enumerate().any(|(i, &f)| i != f as usize);
    let mut unit: Vec<Vec3> = sums.par_iter().map(|&n| unit_or_zero(n)).collect();
    if !seams {
        return unit;
    }
    // Vertices sorted by position, those of one position together and in order.
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.par_sort_by_key(|&i| (first[i as usize], i));
    let least = libm::cosf(SEAM_ANGLE_RAD);
    let smooth: Vec<(u32, Vec3)> = order
        .par_chunk_by(|&a, &b| first[a as usize] == first[b as usize])
        .filter(|group| group.len() > 1 && group.len() <= LARGEST_GROUP)
        .flat_map_iter(|group| {
            group.iter().map(|&i| {
                let own = unit[i as usize];
                let near = group.iter().filter(|&&j| unit[j as usize].dot(own) > least);
                let sum = near.fold(DVec3::ZERO, |sum, &j| sum + sums[j as usize].as_dvec3());
                (i, sum.try_normalize().map_or(own, |n| n.as_vec3()))
            })
        })
        .collect();
    for (i, n) in smooth {
        unit[i as usize] = n;
    }
    unit
}

/// More vertices than this at one position are a heap of damaged points, not a seam, and would take time with their square.
const LARGEST_GROUP: usize = 256;

/// Makes a mesh's own normals unit and computes those that have no direction; answers how many it computed.
pub fn mend(mesh: &mut Mesh) -> u64 {
    mesh.normals.resize(mesh.positions.len(), Vec3::ZERO);
    mesh.normals.par_iter_mut().for_each(|n| *n = unit_or_zero(*n));
    let used = {
        let mut used = vec![false; mesh.positions.len()];
        mesh.triangles.as_flattened().iter().for_each(|&i| used[i as usize] = true);
        used
    };
    let lacking = mesh.normals.iter().zip(&used).filter(|(n, used)| **n == Vec3::ZERO && **used).count() as u64;
    if lacking > 0 {
        let computed = across_seams(&mesh.positions, weighted_sums(&mesh.positions, &mesh.triangles));
        for (n, computed) in mesh.normals.iter_mut().zip(computed) {
            if *n == Vec3::ZERO {
                *n = computed;
            }
        }
    }
    for n in &mut mesh.normals {
        if *n == Vec3::ZERO {
            *n = Vec3::Y;
        }
    }
    lacking
}

/// Gives a mesh computed normals with hard edges: around a position, triangles whose normals differ by at most `crease_rad` from
/// one another's smooth group share a vertex, others get one each.
///
/// Groups are grown over neighbours: two triangles at a position belong together where an edge joins them (in positions) and
/// their normals differ by at most the angle. The first group keeps the vertex, further ones append copies.
///
/// Answers for each appended vertex which one it copies; that one stands before it.
pub fn split_creases(mesh: &mut Mesh, crease_rad: f32) -> Vec<u32> {
    let least = f64::from(libm::cosf(crease_rad.clamp(0.0, std::f32::consts::PI)));
    let count = mesh.positions.len();
    let mut first = weld::first_of_position(&mesh.positions);
    let (starts, corners) = corners_by_position(&mesh.triangles, &first);
    let mut claimed = vec![false; count];
    let mut sums = vec![DVec3::ZERO; count];
    mesh.normals = Vec::new();
    let mut groups: Vec<Vec<Grouped>> = Vec::new();
    let mut vertex_of_group: Vec<(u32, u32, u32)> = Vec::new();
    let mut appended = Vec::new();
    // In blocks, because a list for each position of a large mesh would take more than the mesh.
    for begin in (0..count).step_by(BLOCK) {
        let block = (begin..(begin + BLOCK).min(count)).into_par_iter();
        let around = |position: usize| &corners[starts[position] as usize..starts[position + 1] as usize];
        block.map(|position| group_corners(around(position), mesh, &first, least)).collect_into_vec(&mut groups);
        for around in &groups {
            vertex_of_group.clear();
            for &Grouped { corner, group, .. } in around {
                let (triangle, k) = (corner as usize / 3, corner as usize % 3);
                let old = mesh.triangles[triangle][k];
                let known = vertex_of_group.iter().find(|&&(g, v, _)| g == group && v == old).map(|&(_, _, new)| new);
                let new = known.unwrap_or_else(|| {
                    let new = if std::mem::replace(&mut claimed[old as usize], true) {
                        first.push(first[old as usize]);
                        sums.push(DVec3::ZERO);
                        appended.push(old);
                        repeat_vertex(mesh, old)
                    } else {
                        old
                    };
                    vertex_of_group.push((group, old, new));
                    new
                });
                mesh.triangles[triangle][k] = new;
            }
            // All vertices of a group, also those that a texture seam keeps apart, take the group's normal.
            for &(group, _, vertex) in &vertex_of_group {
                let of_group = around.iter().filter(|g| g.group == group);
                sums[vertex as usize] = of_group.fold(DVec3::ZERO, |sum, g| sum + g.weighted_normal);
            }
        }
    }
    mesh.normals = sums.into_iter().map(|n| n.try_normalize().unwrap_or(DVec3::Y).as_vec3()).collect();
    appended
}

/// Appends a copy of a vertex, but for its normal; answers its index.
fn repeat_vertex(mesh: &mut Mesh, vertex: u32) -> u32 {
    let old = vertex as usize;
    mesh.positions.push(mesh.positions[old]);
    if !mesh.uvs.is_empty() {
        mesh.uvs.push(mesh.uvs[old]);
    }
    if !mesh.colors_linear.is_empty() {
        mesh.colors_linear.push(mesh.colors_linear[old]);
    }
    mesh.positions.len() as u32 - 1
}

/// Corners sorted by the position that they stand on: where each position's begin, and the corners.
fn corners_by_position(triangles: &[[u32; 3]], first: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0_u32; first.len() + 1];
    for &vertex in triangles.as_flattened() {
        starts[first[vertex as usize] as usize + 1] += 1;
    }
    for i in 0..first.len() {
        starts[i + 1] += starts[i];
    }
    let mut next = starts.clone();
    let mut corners = vec![0; triangles.len() * 3];
    for (corner, &vertex) in triangles.as_flattened().iter().enumerate() {
        let at = &mut next[first[vertex as usize] as usize];
        corners[*at as usize] = corner as u32;
        *at += 1;
    }
    (starts, corners)
}

/// A corner (3 t + k is corner k of triangle t), the group that it belongs to, named by the least corner in it, and its triangle's
/// normal times the angle there.
struct Grouped {
    corner: u32,
    group: u32,
    weighted_normal: DVec3,
}

/// Unites the corners around one position that a smooth edge joins.
fn group_corners(around: &[u32], mesh: &Mesh, first: &[u32], least: f64) -> Vec<Grouped> {
    let mut normals = Vec::with_capacity(around.len());
    let grouped = |&corner: &u32| {
        let (normal, angles) = face(&mesh.positions, mesh.triangles[corner as usize / 3]);
        normals.push(normal);
        Grouped { corner, group: corner, weighted_normal: normal * angles[corner as usize % 3] }
    };
    let mut groups: Vec<Grouped> = around.iter().map(grouped).collect();
    if around.len() > LARGEST_GROUP {
        return groups;
    }
    let others = |corner: u32| {
        let t = mesh.triangles[corner as usize / 3];
        let k = corner as usize % 3;
        [first[t[(k + 1) % 3] as usize], first[t[(k + 2) % 3] as usize]]
    };
    for i in 0..around.len() {
        for j in 0..i {
            if groups[i].group == groups[j].group {
                continue;
            }
            let (a, b) = (others(around[i]), others(around[j]));
            let joined = a.iter().any(|v| b.contains(v));
            let (n, m) = (normals[i], normals[j]);
            // A triangle without area goes with any neighbour.
            let smooth = n.dot(m) >= least || n == DVec3::ZERO || m == DVec3::ZERO;
            if joined && smooth {
                let (from, to) = (groups[i].group.max(groups[j].group), groups[i].group.min(groups[j].group));
                groups.iter_mut().filter(|g| g.group == from).for_each(|g| g.group = to);
            }
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    fn cube() -> Mesh {
        let positions = (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32)).collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Mesh { positions, triangles, ..Mesh::default() }
    }

    #[test]
    fn a_cube_s_corners_look_along_its_diagonals_however_its_faces_are_cut() {
        let mut mesh = cube();
        compute(&mut mesh);
        for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
            assert!(n.distance((*p - Vec3::splat(0.5)) / 0.75_f32.sqrt()) < 1e-6);
        }
    }

    #[test]
    fn creases_give_a_cube_flat_faces() {
        let mut mesh = cube();
        split_creases(&mut mesh, 60_f32.to_radians());
        assert_eq!(mesh.positions.len(), 24);
        mesh.validate().unwrap();
        for &t in &mesh.triangles {
            let (n, _) = face(&mesh.positions, t);
            assert!(t.iter().all(|&i| mesh.normals[i as usize].as_dvec3().distance(n) < 1e-6));
        }
        let mut smooth = cube();
        split_creases(&mut smooth, 100_f32.to_radians());
        assert_eq!(smooth.positions.len(), 8);
    }

    #[test]
    fn texture_seams_stay_smooth_and_split_cubes_stay_hard() {
        // A shallow roof, its ridge split by a texture seam.
        let mut roof = Mesh {
            positions: vec![
                Vec3::new(-1.0, 0.0, 0.0),
                Vec3::new(0.0, 0.2, 1.0),
                Vec3::new(0.0, 0.2, -1.0),
                Vec3::new(0.0, 0.2, 1.0),
                Vec3::new(1.0, 0.0, 0.0),
                Vec3::new(0.0, 0.2, -1.0),
            ],
            uvs: vec![Vec2::ZERO; 6],
            triangles: vec![[0, 1, 2], [3, 4, 5]],
            ..Mesh::default()
        };
        compute(&mut roof);
        assert!(roof.normals[1].distance(Vec3::Y) < 1e-6 && roof.normals[3].distance(Vec3::Y) < 1e-6);
        let mut hard = cube();
        split_creases(&mut hard, 1.0);
        let expected = std::mem::take(&mut hard.normals);
        compute(&mut hard);
        assert!(hard.normals.iter().zip(&expected).all(|(a, b)| a.distance(*b) < 1e-6));
    }

    #[test]
    fn slivers_points_and_extremes_do_no_harm() {
        for scale in [1e-30_f32, 1.0, 1e8] {
            let positions: Vec<Vec3> =
                [(0., 0.), (1., 0.), (0., 1.), (2., 0.)].map(|(x, y)| Vec3::new(x, y, 0.0) * scale).to_vec();
            let mut mesh = Mesh { positions, triangles: vec![[0, 1, 2], [0, 1, 3], [0, 0, 1]], ..Mesh::default() };
            compute(&mut mesh);
            assert_eq!(mesh.normals[..3], [Vec3::Z; 3], "scale {scale}");
            mesh.validate().unwrap();
        }
        let heap = vec![Vec3::ONE; 1000];
        let mut mesh = Mesh { positions: heap, triangles: (0..998).map(|i| [i, i + 1, i + 2]).collect(), ..Mesh::default() };
        compute(&mut mesh);
        split_creases(&mut mesh, 1.0);
        mesh.validate().unwrap();
    }

    #[test]
    fn the_file_s_normals_are_kept_and_only_the_broken_ones_computed() {
        let mut mesh = cube();
        mesh.normals = vec![Vec3::new(0.0, 3.0, 0.0); 8];
        mesh.normals[2] = Vec3::ZERO;
        mesh.normals[5] = Vec3::NAN;
        assert_eq!(mend(&mut mesh), 2);
        assert_eq!(mesh.normals[0], Vec3::Y);
        assert!(mesh.normals[5].distance(Vec3::new(1.0, -1.0, 1.0) / 3_f32.sqrt()) < 1e-6);
        mesh.validate().unwrap();
    }
}
