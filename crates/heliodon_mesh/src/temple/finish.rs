//! The last cut: what still shows larger than asked in some visitor's picture is halved until nothing does.
//!
//! Stones and ground are cut by how large their pieces *should* show; where stone is carved, broken or worn, a few triangles come out larger.
//! Here the pictures themselves are drawn and asked. A middle lies on its edge, so shapes and silhouettes stay as they are.

use super::halve::{Halving, edge};
use super::projected::{PictureCamera, visible_triangles};
use super::sizing::View;
use crate::Mesh;
use glam::Vec3;
use heliodon_math::frame::unit_or;
use rayon::prelude::*;
use std::collections::HashSet;

/// A triangle may show with this part of the square of the length asked: four square pixels for the 2.7 of the demo.
const LARGEST: f32 = 0.53;
/// Lengths below this ask for triangles so small that none shows with four square pixels; drawing them from every eye would take longer than cutting.
const FINEST_PX: f32 = 1.2;
/// Rounds of halving, at most.
const ROUNDS: usize = 8;

/// Halves edges until no triangle shows larger than `LARGEST px^2` from any corner or from the middle of the view's room.
pub fn finish(meshes: &mut [&mut Mesh], view: &View, look_at: Vec3, px: f32) {
    if px < FINEST_PX {
        return;
    }
    let limit = LARGEST * px * px;
    for _ in 0..ROUNDS {
        let shown: Vec<&Mesh> = meshes.iter().map(|mesh| &**mesh).collect();
        let large: Vec<(u32, u32, u8)> = view
            .eyes()
            .par_iter()
            .flat_map_iter(|&eye| {
                let seen = visible_triangles(&shown, &PictureCamera::standard(eye, look_at));
                seen.into_iter().filter(|t| t.area_px > limit).map(|t| (t.mesh, t.triangle, t.longest))
            })
            .collect();
        if large.is_empty() {
            return;
        }
        for (m, mesh) in meshes.iter_mut().enumerate() {
            let edges = large.iter().filter(|found| found.0 as usize == m).map(|&(_, triangle, side)| {
                let t = mesh.triangles[triangle as usize];
                edge(t[usize::from(side)], t[(usize::from(side) + 1) % 3])
            });
            let edges: Vec<(u32, u32)> = edges.collect();
            halve(mesh, &edges);
        }
    }
}

/// Halves edges of a mesh, and those that lie in the same place: vertices are doubled at creases.
fn halve(mesh: &mut Mesh, edges: &[(u32, u32)]) {
    if edges.is_empty() {
        return;
    }
    let place = |i: u32| mesh.positions[i as usize].to_array().map(f32::to_bits);
    let places = |(a, b): (u32, u32)| {
        let (a, b) = (place(a), place(b));
        (a.min(b), a.max(b))
    };
    let marked: HashSet<_> = edges.iter().map(|&edge| places(edge)).collect();
    let ends: HashSet<_> = marked.iter().flat_map(|&(a, b)| [a, b]).collect();
    let touched: Vec<bool> = (0..mesh.positions.len() as u32).into_par_iter().map(|i| ends.contains(&place(i))).collect();
    let mut halving = Halving::new(mesh.positions.len());
    for t in &mesh.triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            if touched[a as usize] && touched[b as usize] && marked.contains(&places((a, b))) {
                halving.mark(edge(a, b));
            }
        }
    }
    for &(a, b) in halving.edges() {
        let (a, b) = (a as usize, b as usize);
        mesh.positions.push((mesh.positions[a] + mesh.positions[b]) * 0.5);
        mesh.normals.push(unit_or(mesh.normals[a] + mesh.normals[b], mesh.normals[a]));
        mesh.colors_linear.push((mesh.colors_linear[a] + mesh.colors_linear[b]) * 0.5);
    }
    halving.cut(&mesh.positions, &mut mesh.triangles);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_sides_of_a_crease_are_halved() {
        // two triangles that meet along x, each with vertices of its own
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X, Vec3::ZERO, Vec3::Z].to_vec();
        let mut mesh = Mesh {
            normals: vec![Vec3::Z, Vec3::Z, Vec3::Z, Vec3::Y, Vec3::Y, Vec3::Y],
            colors_linear: positions.clone(),
            positions,
            triangles: vec![[0, 1, 2], [3, 4, 5]],
            ..Mesh::default()
        };
        halve(&mut mesh, &[(0, 1)]);
        assert_eq!(mesh.triangles.len(), 4);
        assert_eq!(mesh.positions[6..], [Vec3::X * 0.5; 2]);
        assert_eq!(mesh.colors_linear[6..], [Vec3::X * 0.5; 2]);
        assert_eq!(mesh.normals[6..], [Vec3::Z, Vec3::Y]);
        let doubled = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a).length();
        let area = (0..4).map(|t| 0.5 * doubled(mesh.corners(t))).sum::<f32>();
        assert!((area - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_wall_is_cut_until_it_shows_as_small_as_asked() {
        let view = View::new((Vec3::splat(-0.5), Vec3::splat(0.5)), Vec3::new(0.0, 0.0, -10.0));
        let positions = [(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)].map(|(x, y)| Vec3::new(x, y, -10.0)).to_vec();
        let mut mesh = Mesh {
            normals: vec![Vec3::Z; 4],
            colors_linear: vec![Vec3::ONE; 4],
            positions,
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        let px = 300.0;
        finish(&mut [&mut mesh], &view, Vec3::new(0.0, 0.0, -10.0), px);
        for &eye in view.eyes() {
            let seen = visible_triangles(&[&mesh], &PictureCamera::standard(eye, Vec3::new(0.0, 0.0, -10.0)));
            assert!(seen.len() > 8 && seen.iter().all(|t| t.area_px <= LARGEST * px * px));
        }
    }
}
