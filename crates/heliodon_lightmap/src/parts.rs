//! The parts of what was unwrapped and lit as one, given back each by itself.

use crate::unwrap::Unwrapped;
use glam::Vec2;
use heliodon_mesh::Mesh;
use heliodon_mesh::export::UnwrappedPart;
use std::ops::Range;

/// Where a part lies in a mesh of several.
#[derive(Clone, Debug)]
pub struct PartOf<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its vertices; no other part has any of them.
    pub vertices: Range<usize>,
    /// Its triangles, of which all are unwrapped or none is.
    pub triangles: Range<usize>,
    /// Its own texture coordinates, one for each of its vertices, or none; those of the mesh may be fillers for a part that has none.
    pub uvs: &'a [Vec2],
}

/// Parts of a mesh whose first triangles are `unwrapped`. Vertices and triangles of each are in their order, those that were split off where charts meet behind the others; parts
/// whose triangles are not unwrapped have no second coordinates.
///
/// # Panics
/// Where a part names what is not there, or a triangle a vertex of another part; where there are texture coordinates for some vertices of a part only.
#[must_use]
pub fn parts(mesh: &Mesh, unwrapped: &Unwrapped, parts: &[PartOf]) -> Vec<UnwrappedPart> {
    parts.iter().map(|part| of_part(mesh, unwrapped, part)).collect()
}

fn of_part(mesh: &Mesh, unwrapped: &Unwrapped, part: &PartOf) -> UnwrappedPart {
    let PartOf { name, vertices, triangles, uvs } = part;
    assert!(uvs.is_empty() || uvs.len() == vertices.len(), "coordinates for all vertices of {name}, or for none");
    let is_unwrapped = !triangles.is_empty() && triangles.end <= unwrapped.triangles.len();
    let corners = &if is_unwrapped { &unwrapped.triangles } else { &mesh.triangles }[triangles.clone()];
    let all = mesh.positions.len() as u32;
    let mut split: Vec<u32> = corners.as_flattened().iter().copied().filter(|&vertex| vertex >= all).collect();
    split.sort_unstable();
    split.dedup();
    let own = vertices.start as u32..vertices.end as u32;
    let local = |vertex: u32| match split.binary_search(&vertex) {
        Ok(place) => (vertices.len() + place) as u32,
        Err(_) => {
            assert!(own.contains(&vertex), "{name} has a triangle over a vertex of another part");
            vertex - own.start
        }
    };
    let local_corners = corners.iter().map(|corners| corners.map(local)).collect();
    let in_unwrapped: Vec<u32> = own.clone().chain(split.iter().copied()).collect();
    let original: Vec<u32> = in_unwrapped.iter().map(|&vertex| unwrapped.original_vertex[vertex as usize]).collect();
    let material = mesh.triangle_material.get(triangles.clone()).unwrap_or(&[]).to_vec();
    let mut of_part = mesh.with_vertices(&original, local_corners, material);
    let uv = |&vertex: &u32| uvs[(vertex - own.start) as usize];
    of_part.uvs = if uvs.is_empty() { Vec::new() } else { original.iter().map(uv).collect() };
    let (second_uvs, sheet) = if is_unwrapped {
        let second_uvs = in_unwrapped.iter().map(|&vertex| unwrapped.uvs[vertex as usize]).collect();
        (second_uvs, unwrapped.sheet[triangles.clone()].to_vec())
    } else {
        Default::default()
    };
    UnwrappedPart { name: (*name).to_owned(), mesh: of_part, second_uvs, sheet }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packing::PackParams;
    use crate::unwrap::{UnwrapParams, unwrap};
    use glam::Vec3;
    use heliodon_testkit::scenes::{Scene, cuboid, ground};

    /// Two boxes over vertices that their sides share, unwrapped, and a floor that is not, between them among the vertices; the boxes in as many textures.
    fn boxes(sheets: u32) -> (Mesh, Unwrapped, [Range<usize>; 3]) {
        let shared = |scene: Scene| -> Scene {
            let mut of: Vec<Vec3> = Vec::new();
            let mut place = |p: Vec3| {
                of.iter().position(|known| *known == p).unwrap_or_else(|| {
                    of.push(p);
                    of.len() - 1
                }) as u32
            };
            let triangles = scene.triangles.iter().map(|t| t.map(|v| place(scene.positions[v as usize]))).collect();
            Scene { normals: vec![Vec3::Y; of.len()], positions: of, triangles }
        };
        let cube = |x: f32| shared(cuboid(Vec3::X * x, Vec3::new(x + 1.0, 1.0, 1.0), 1));
        let scenes = [cube(0.0), ground(4.0, 2), cube(2.0)];
        let mut mesh = Mesh::default();
        let mut vertices = Vec::new();
        let mut of_each = Vec::new();
        for Scene { positions, normals, triangles } in scenes {
            let first = mesh.positions.len();
            of_each.push(triangles.into_iter().map(|t| t.map(|v| v + first as u32)).collect::<Vec<_>>());
            mesh.positions.extend(positions);
            mesh.normals.extend(normals);
            vertices.push(first..mesh.positions.len());
        }
        mesh.triangles = [of_each[0].as_slice(), &of_each[2], &of_each[1]].concat();
        let with_texels = of_each[0].len() + of_each[2].len();
        let pack = PackParams { width: 64, height: 64, sheets, ..PackParams::default() };
        let params = UnwrapParams { pack, ..UnwrapParams::default() };
        let unwrapped = unwrap(&mesh.positions, &mesh.triangles[..with_texels], &[], &params).unwrap();
        let [one, floor, other] = vertices.try_into().unwrap();
        (mesh, unwrapped, [one, floor, other])
    }

    #[test]
    fn each_part_comes_back_with_what_was_split_off_behind_its_own() {
        for sheets in [1, 2] {
            let (mesh, unwrapped, [one, floor, other]) = boxes(sheets);
            assert_eq!(unwrapped.packing.sheets, sheets);
            assert_eq!((one.len(), other.len()), (8, 8));
            let uvs: Vec<Vec2> = (0..8).map(|i| Vec2::splat(i as f32)).collect();
            let part =
                |name, vertices: &Range<usize>, triangles, uvs| PartOf { name, vertices: vertices.clone(), triangles, uvs };
            // in the site's order, which is not that of the triangles
            let places = [
                part("one", &one, 0..12, &[]),
                part("floor", &floor, 24..mesh.triangles.len(), &[]),
                part("other", &other, 12..24, uvs.as_slice()),
            ];
            let parts = parts(&mesh, &unwrapped, &places);
            assert_eq!(parts.iter().map(|part| part.name.as_str()).collect::<Vec<_>>(), ["one", "floor", "other"]);
            for (part, place) in parts.iter().zip(&places) {
                part.mesh.validate().unwrap();
                let (count, before) = (place.vertices.len(), &mesh.triangles[place.triangles.clone()]);
                assert_eq!(part.mesh.positions[..count], mesh.positions[place.vertices.clone()]);
                for (own, before) in part.mesh.triangles.iter().zip(before) {
                    let positions = before.map(|v| mesh.positions[v as usize]);
                    assert_eq!(own.map(|v| part.mesh.positions[v as usize]), positions, "the order stays");
                    assert_eq!(own.map(|v| part.mesh.normals[v as usize]), before.map(|v| mesh.normals[v as usize]));
                }
                assert_eq!(part.mesh.triangles.len(), before.len());
            }
            for (part, place) in [(&parts[0], &places[0]), (&parts[2], &places[2])] {
                assert_eq!(part.mesh.positions.len(), 24, "three sides meet at each corner");
                let second = |t: usize| part.mesh.triangles[t].map(|v| part.second_uvs[v as usize]);
                for (t, of_all) in place.triangles.clone().enumerate() {
                    assert_eq!(second(t), unwrapped.triangles[of_all].map(|v| unwrapped.uvs[v as usize]));
                    assert_eq!(part.sheet[t], unwrapped.sheet[of_all]);
                }
            }
            assert!(parts[1].second_uvs.is_empty() && parts[1].sheet.is_empty());
            assert!(parts[0].mesh.uvs.is_empty());
            let of_corner =
                |v: usize| parts[2].mesh.positions[..8].iter().position(|p| *p == parts[2].mesh.positions[v]).unwrap();
            assert!(
                (0..24).all(|v| parts[2].mesh.uvs[v] == uvs[of_corner(v)]),
                "those split off have the coordinates of their own"
            );
        }
    }
}
