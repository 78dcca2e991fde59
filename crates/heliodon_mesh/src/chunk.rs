//! Cutting a mesh into compact pieces of bounded size, as bundles store them and viewers cull them.
//!
//! Triangles are halved at the median of their centroids along the longest axis of these, so that pieces are tight in space and
//! all nearly full; better than runs along a Morton curve, whose pieces jump where the curve does. Inside a piece, triangles are
//! ordered for the GPU's vertex cache by meshoptimizer, and vertices by first use. The same mesh gives the same pieces, whatever
//! the number of threads.

use crate::{Mesh, Texture};
use glam::Vec3;
use rayon::prelude::*;
use std::sync::Arc;

/// A piece of a mesh with vertices of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chunk {
    /// Corners, as indices into `vertices`, in the mesh's winding.
    pub triangles: Vec<[u32; 3]>,
    /// Which vertices of the mesh they are, each once.
    pub vertices: Vec<u32>,
    /// A material with the texture that all its triangles share; `None` for triangles without a texture. Triangles of several
    /// materials that differ in their constant colour only go together.
    pub textured_material: Option<u16>,
}

/// Cuts the mesh into pieces of at most `max_triangles`, each with one texture or none.
///
/// # Panics
/// When `max_triangles` is zero, or a triangle names a vertex that does not exist.
#[must_use]
pub fn split(mesh: &Mesh, max_triangles: usize) -> Vec<Chunk> {
    assert!(max_triangles > 0, "a piece must have room for a triangle");
    let leaders = texture_leaders(mesh);
    let leader = |t: u32| {
        let material = mesh.triangle_material.get(t as usize).map_or(0, |&m| usize::from(m));
        leaders.get(material).copied().flatten()
    };
    let mut order: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
    if leaders.iter().any(Option::is_some) {
        order.par_sort_by_key(|&t| (leader(t), t));
    }
    let centers: Vec<Vec3> = mesh.triangles.par_iter().map(|t| center(mesh, t)).collect();
    let mut chunks = Vec::with_capacity(order.len().div_ceil(max_triangles));
    let mut rest = order.as_mut_slice();
    while let Some(&first) = rest.first() {
        let texture = leader(first);
        let length = rest.partition_point(|&t| leader(t) == texture);
        let (group, after) = rest.split_at_mut(length);
        chunks.extend(halve(mesh, &centers, group, max_triangles, texture));
        rest = after;
    }
    chunks
}

/// For each material the first one with the same texture, or `None` without one.
fn texture_leaders(mesh: &Mesh) -> Vec<Option<u16>> {
    let mut seen: Vec<(*const Texture, u16)> = Vec::new();
    let leader = |(index, material): (usize, &crate::Material)| {
        let texture = Arc::as_ptr(material.texture.as_ref().filter(|_| !mesh.uvs.is_empty())?);
        if let Some(&(_, first)) = seen.iter().find(|(known, _)| *known == texture) {
            return Some(first);
        }
        seen.push((texture, index as u16));
        Some(index as u16)
    };
    mesh.materials.iter().enumerate().map(leader).collect()
}

/// Three times the centroid.
fn center(mesh: &Mesh, triangle: &[u32; 3]) -> Vec3 {
    triangle.iter().map(|&i| mesh.positions[i as usize]).sum()
}

fn halve(mesh: &Mesh, centers: &[Vec3], triangles: &mut [u32], most: usize, texture: Option<u16>) -> Vec<Chunk> {
    if triangles.len() <= most {
        return vec![finish(mesh, triangles, texture)];
    }
    let pieces = triangles.len().div_ceil(most);
    let middle = (triangles.len() as u64 * (pieces / 2) as u64 / pieces as u64) as usize;
    let (low, high) = triangles.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &t| {
        (low.min(centers[t as usize]), high.max(centers[t as usize]))
    });
    let axis = (high - low).max_position();
    let key = |t: &u32| centers[*t as usize][axis];
    triangles.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
    let (left, right) = triangles.split_at_mut(middle);
    let (mut chunks, more) =
        rayon::join(|| halve(mesh, centers, left, most, texture), || halve(mesh, centers, right, most, texture));
    chunks.extend(more);
    chunks
}

fn finish(mesh: &Mesh, triangles: &mut [u32], texture: Option<u16>) -> Chunk {
    // What selection left in no order of its own becomes the mesh's.
    triangles.sort_unstable();
    let corners: Vec<u32> = triangles.iter().flat_map(|&t| mesh.triangles[t as usize]).collect();
    let mut used = corners.clone();
    used.sort_unstable();
    used.dedup();
    let local: Vec<u32> = corners.iter().map(|vertex| used.binary_search(vertex).map_or(0, |place| place as u32)).collect();
    let mut local = meshopt::optimize_vertex_cache(&local, used.len());
    let mut place = vec![u32::MAX; used.len()];
    let mut vertices = Vec::with_capacity(used.len());
    for corner in &mut local {
        let place = &mut place[*corner as usize];
        if *place == u32::MAX {
            *place = vertices.len() as u32;
            vertices.push(used[*corner as usize]);
        }
        *corner = *place;
    }
    let triangles = local.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
    Chunk { triangles, vertices, textured_material: texture }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, Wrap};
    use glam::Vec2;
    use heliodon_image::SrgbImage;

    fn grid(side: u32) -> Mesh {
        let at = |x, y| Vec3::new(x as f32, (x * y % 7) as f32 * 0.1, y as f32);
        let positions = (0..=side).flat_map(|y| (0..=side).map(move |x| at(x, y))).collect();
        let row = side + 1;
        let cell = |x: u32, y: u32| {
            [[y * row + x, (y + 1) * row + x, y * row + x + 1], [y * row + x + 1, (y + 1) * row + x, (y + 1) * row + x + 1]]
        };
        let triangles = (0..side).flat_map(|y| (0..side).flat_map(move |x| cell(x, y))).collect();
        Mesh { positions, triangles, ..Mesh::default() }
    }

    /// Triangles in a form that does not depend on their order or first corner, but on their winding.
    fn canonical(triangles: impl Iterator<Item = [u32; 3]>) -> Vec<[u32; 3]> {
        let mut all: Vec<[u32; 3]> = triangles
            .map(|mut t| {
                while t[0] != t[0].min(t[1]).min(t[2]) {
                    t.rotate_left(1);
                }
                t
            })
            .collect();
        all.sort_unstable();
        all
    }

    fn global(chunks: &[Chunk]) -> Vec<[u32; 3]> {
        canonical(chunks.iter().flat_map(|c| c.triangles.iter().map(|t| t.map(|i| c.vertices[i as usize]))))
    }

    #[test]
    fn pieces_hold_every_triangle_once_and_are_nearly_full() {
        let mesh = grid(100);
        let chunks = split(&mesh, 999);
        assert_eq!(chunks.len(), 21);
        assert!(chunks.iter().all(|c| (900..=999).contains(&c.triangles.len())));
        assert_eq!(global(&chunks), canonical(mesh.triangles.iter().copied()));
        for chunk in &chunks {
            let mut vertices = chunk.vertices.clone();
            vertices.sort_unstable();
            vertices.dedup();
            assert_eq!(vertices.len(), chunk.vertices.len());
            assert!(chunk.triangles.as_flattened().iter().all(|&i| (i as usize) < vertices.len()));
        }
    }

    #[test]
    fn pieces_are_tight() {
        // Square pieces of a plane of 2 x 100^2 triangles in 16 pieces have 4 x 25 long sides.
        let mesh = grid(100);
        let repeated: usize = split(&mesh, 1250).iter().map(|c| c.vertices.len()).sum();
        assert!(repeated < 101 * 101 * 107 / 100, "{repeated} vertices for {}", 101 * 101);
    }

    #[test]
    fn threads_do_not_change_the_pieces() {
        let mesh = grid(60);
        let with =
            |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| split(&mesh, 500));
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn textures_part_pieces_and_colours_do_not() {
        let mut mesh = grid(10);
        mesh.uvs = vec![Vec2::ZERO; mesh.positions.len()];
        let texture = |name: &str| {
            Some(Arc::new(Texture { source: name.into(), image: SrgbImage::filled(1, 1, [9; 4]), wrap: [Wrap::Repeat; 2] }))
        };
        let material = |texture| Material { name: String::new(), base_color_linear: Vec3::ONE, texture };
        let (a, b) = (texture("a"), texture("b"));
        mesh.materials = [None, a.clone(), b, a, None].map(material).to_vec();
        mesh.triangle_material = (0..200).map(|t| t % 5).collect();
        let chunks = split(&mesh, 1000);
        assert_eq!(
            chunks.iter().map(|c| (c.textured_material, c.triangles.len())).collect::<Vec<_>>(),
            [(None, 80), (Some(1), 80), (Some(2), 40)]
        );
        assert_eq!(global(&chunks), canonical(mesh.triangles.iter().copied()));
    }

    #[test]
    fn all_triangles_in_one_place_still_part() {
        let mesh = Mesh { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]; 1000], ..Mesh::default() };
        let sizes: Vec<usize> = split(&mesh, 300).iter().map(|c| c.triangles.len()).collect();
        assert_eq!(sizes, [250; 4]);
        assert!(split(&Mesh::default(), 10).is_empty());
    }
}
