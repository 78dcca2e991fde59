//! Cutting a mesh into compact pieces of bounded size, as bundles store them and viewers cull them.
//!
//! Triangles are halved at the median of their centroids along the longest axis of these, so that pieces are tight in space and
//! all nearly full; better than runs along a Morton curve, whose pieces jump where the curve does. Inside a piece, triangles are
//! ordered for the GPU's vertex cache and against overdraw by meshoptimizer, and vertices by first use. The same mesh gives the
//! same pieces, whatever the number of threads.

use crate::device_order::{Ordered, ordered};
use crate::{Material, Mesh, Texture};
use glam::Vec3;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;

/// A piece of a mesh with vertices of its own.
///
/// A vertex of the mesh that lies between materials of different colours is there once for each of them: one vertex holds one
/// albedo, and a mean would run over whole triangles on either side.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chunk {
    /// Corners, as indices into `vertices`, in the mesh's winding.
    pub triangles: Vec<[u32; 3]>,
    /// Which vertices of the mesh they are.
    pub vertices: Vec<u32>,
    /// For each of `vertices` a material with the base colour of the triangles that use it; 0 where the mesh has none.
    pub materials: Vec<u16>,
    /// A material with the texture that all its triangles share; `None` for triangles without a texture. Triangles of several
    /// materials that differ in their base colour only go together.
    pub textured_material: Option<u16>,
    /// The kind of the materials of all its triangles ([`split_by_kind`]); 0 where nobody tells kinds.
    pub kind: u32,
}

/// Cuts the mesh into pieces of at most `max_triangles`, each with one texture or none.
///
/// # Panics
/// When `max_triangles` is zero, or a triangle names a vertex that does not exist.
#[must_use]
pub fn split(mesh: &Mesh, max_triangles: usize) -> Vec<Chunk> {
    split_by_kind(mesh, max_triangles, &[])
}

/// As [`split`], each piece with materials of one kind; `kinds` tells that of each material, and those that it does not reach are of kind 0.
///
/// # Panics
/// As [`split`].
#[must_use]
pub fn split_by_kind(mesh: &Mesh, max_triangles: usize, kinds: &[u32]) -> Vec<Chunk> {
    assert!(max_triangles > 0, "a piece must have room for a triangle");
    let leaders = texture_leaders(mesh);
    let leader = |t: u32| {
        let material = usize::from(material(mesh, t));
        (leaders.get(material).copied().flatten(), kinds.get(material).copied().unwrap_or(0))
    };
    let first_of_color = first_of_color(mesh);
    let mut order: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
    if leaders.iter().any(Option::is_some) || !kinds.is_empty() {
        order.par_sort_by_key(|&t| (leader(t), t));
    }
    let centers: Vec<Vec3> = mesh.triangles.par_iter().map(|t| center(mesh, t)).collect();
    let cut = Cut { mesh, centers: &centers, first_of_color: &first_of_color, most: max_triangles };
    let mut chunks = Vec::with_capacity(order.len().div_ceil(max_triangles));
    let mut rest = order.as_mut_slice();
    while let Some(&first) = rest.first() {
        let look = leader(first);
        let length = rest.partition_point(|&t| leader(t) == look);
        let (group, after) = rest.split_at_mut(length);
        chunks.extend(cut.halve(group, look));
        rest = after;
    }
    chunks
}

/// For each material the first one with the same texture, or `None` without one.
fn texture_leaders(mesh: &Mesh) -> Vec<Option<u16>> {
    let mut seen: Vec<(*const Texture, u16)> = Vec::new();
    let leader = |(index, material): (usize, &Material)| {
        let texture = Arc::as_ptr(material.texture.as_ref().filter(|_| !mesh.uvs.is_empty())?);
        if let Some(&(_, first)) = seen.iter().find(|(known, _)| *known == texture) {
            return Some(first);
        }
        seen.push((texture, index as u16));
        Some(index as u16)
    };
    mesh.materials.iter().enumerate().map(leader).collect()
}

/// For each material the first one with the same base colour.
fn first_of_color(mesh: &Mesh) -> Vec<u16> {
    let mut first = HashMap::new();
    let of = |(index, material): (usize, &Material)| {
        *first.entry(material.base_color_linear.to_array().map(f32::to_bits)).or_insert(index as u16)
    };
    mesh.materials.iter().enumerate().map(of).collect()
}

fn material(mesh: &Mesh, triangle: u32) -> u16 {
    mesh.triangle_material.get(triangle as usize).copied().unwrap_or(0)
}

/// A material with the texture that triangles share, and the kind of their materials.
type Look = (Option<u16>, u32);

/// Three times the centroid.
fn center(mesh: &Mesh, triangle: &[u32; 3]) -> Vec3 {
    triangle.iter().map(|&i| mesh.positions[i as usize]).sum()
}

/// What every piece is cut from.
struct Cut<'m> {
    mesh: &'m Mesh,
    centers: &'m [Vec3],
    first_of_color: &'m [u16],
    most: usize,
}

impl Cut<'_> {
    fn halve(&self, triangles: &mut [u32], look: Look) -> Vec<Chunk> {
        if triangles.len() <= self.most {
            return vec![self.finish(triangles, look)];
        }
        let pieces = triangles.len().div_ceil(self.most);
        let middle = (triangles.len() as u64 * (pieces / 2) as u64 / pieces as u64) as usize;
        let (low, high) = triangles.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &t| {
            (low.min(self.centers[t as usize]), high.max(self.centers[t as usize]))
        });
        let axis = (high - low).max_position();
        let key = |t: &u32| self.centers[*t as usize][axis];
        triangles.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
        let (left, right) = triangles.split_at_mut(middle);
        let (mut chunks, more) = rayon::join(|| self.halve(left, look), || self.halve(right, look));
        chunks.extend(more);
        chunks
    }

    fn finish(&self, triangles: &mut [u32], (textured_material, kind): Look) -> Chunk {
        // What selection left in no order of its own becomes the mesh's.
        triangles.sort_unstable();
        let corners: Vec<(u32, u16)> = triangles
            .iter()
            .flat_map(|&t| {
                let color = self.first_of_color.get(usize::from(material(self.mesh, t))).copied().unwrap_or(0);
                self.mesh.triangles[t as usize].map(|vertex| (vertex, color))
            })
            .collect();
        let mut used = corners.clone();
        used.sort_unstable();
        used.dedup();
        let local: Vec<u32> = corners.iter().map(|corner| used.binary_search(corner).map_or(0, |place| place as u32)).collect();
        let places: Vec<[f32; 3]> = used.iter().map(|&(vertex, _)| self.mesh.positions[vertex as usize].to_array()).collect();
        let Ordered { corners, vertices } = ordered(&local, &places);
        let (vertices, materials) = vertices.iter().map(|&place| used[place as usize]).unzip();
        let triangles = corners.as_chunks::<3>().0.to_vec();
        Chunk { triangles, vertices, materials, textured_material, kind }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TextureWrap;
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
    fn what_faces_outward_comes_first_in_a_piece() {
        // a sheet that looks up, and one beneath it, which comes first in the mesh
        let (low, mut mesh) = (grid(20), grid(20));
        mesh.positions.iter_mut().for_each(|p| p.y += 9.0);
        let first = mesh.positions.len() as u32;
        mesh.triangles.splice(0..0, low.triangles.iter().map(|t| t.map(|vertex| vertex + first)));
        mesh.positions.extend(&low.positions);
        let [chunk] = &split(&mesh, 2000)[..] else { panic!("one piece") };
        let (early, late) = chunk.triangles.split_at(chunk.triangles.len() / 2);
        let height = |half: &[[u32; 3]]| -> f32 {
            half.as_flattened().iter().map(|&i| mesh.positions[chunk.vertices[i as usize] as usize].y).sum()
        };
        assert!(height(early) > 2.0 * height(late), "{} {}", height(early), height(late));
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
            Some(Arc::new(Texture {
                source: name.into(),
                image: SrgbImage::filled(1, 1, [9; 4]),
                wrap: [TextureWrap::Repeat; 2],
            }))
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
    fn kinds_part_pieces() {
        let mut mesh = grid(10);
        let material = Material { name: String::new(), base_color_linear: Vec3::ONE, texture: None };
        mesh.materials = vec![material; 4];
        mesh.triangle_material = (0..200).map(|t| t % 4).collect();
        assert_eq!(split(&mesh, 1000).len(), 1);
        // the last material is told nothing of
        let chunks = split_by_kind(&mesh, 1000, &[2, 0, 2]);
        assert_eq!(chunks.iter().map(|c| (c.kind, c.triangles.len())).collect::<Vec<_>>(), [(0, 100), (2, 100)]);
        assert_eq!(global(&chunks), canonical(mesh.triangles.iter().copied()));
    }

    #[test]
    fn vertices_between_colours_are_there_for_each() {
        let mut mesh = grid(10);
        let material = |x: f32| Material { name: String::new(), base_color_linear: Vec3::splat(x), texture: None };
        // the fourth looks like the first
        mesh.materials = [0.25, 0.5, 0.75, 0.25].map(material).to_vec();
        mesh.triangle_material = (0..200).map(|t| t % 4).collect();
        mesh.uvs = vec![Vec2::ZERO; mesh.positions.len()];
        for textured in [false, true] {
            if textured {
                let image = SrgbImage::filled(1, 1, [9; 4]);
                let texture = Arc::new(Texture { source: String::new(), image, wrap: [TextureWrap::Repeat; 2] });
                mesh.materials.iter_mut().for_each(|material| material.texture = Some(texture.clone()));
            }
            let chunks = split(&mesh, 1000);
            assert_eq!(chunks.len(), 1, "one texture, one piece");
            let chunk = &chunks[0];
            assert_eq!(global(&chunks), canonical(mesh.triangles.iter().copied()));
            let mut keys: Vec<_> = chunk.vertices.iter().zip(&chunk.materials).collect();
            assert_eq!(keys.len(), chunk.vertices.len());
            keys.sort_unstable();
            keys.dedup();
            assert_eq!(keys.len(), chunk.vertices.len(), "each once for each colour");
            // every triangle of the piece has one colour, and as many have it as in the mesh
            let mut counts = [0; 3];
            for triangle in &chunk.triangles {
                let [a, b, c] = triangle.map(|i| chunk.materials[i as usize]);
                assert!(a == b && b == c);
                counts[usize::from(a)] += 1;
            }
            assert_eq!(counts, [100, 50, 50]);
        }
    }

    #[test]
    fn all_triangles_in_one_place_still_part() {
        let mesh = Mesh { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]; 1000], ..Mesh::default() };
        let sizes: Vec<usize> = split(&mesh, 300).iter().map(|c| c.triangles.len()).collect();
        assert_eq!(sizes, [250; 4]);
        assert!(split(&Mesh::default(), 10).is_empty());
    }
}
