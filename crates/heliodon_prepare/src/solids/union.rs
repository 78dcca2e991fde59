//! The union of a group's solids.

use glam::{DVec3, Vec3};
use heliodon_mesh::Mesh;
use manifold_rust::manifold::Manifold;
use manifold_rust::types::{Error, MeshGL64, WindingRule};
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A union's surface.
pub(super) struct Union {
    /// Where its vertices are, rounded to f32 as the mesh's are.
    pub positions: Vec<Vec3>,
    /// Its triangles, and the triangle of the mesh that each is a piece of.
    pub triangles: Vec<([u32; 3], u32)>,
    /// The triangles of the mesh that it takes the place of.
    pub replaced: Vec<u32>,
    /// What it encloses, in cubic metres.
    pub volume_m3: f64,
    /// Whether it differs from what was there.
    pub changed: bool,
}

/// Everything that lies within at least one of the solids that these triangles enclose.
pub(super) fn union(mesh: &Mesh, places: &[u32], triangles: &[u32]) -> Result<Union, String> {
    // vertices by place: solids are closed by position, not by index
    let mut numbers = HashMap::new();
    let mut input = MeshGL64 { num_prop: 3, ..MeshGL64::default() };
    for &t in triangles {
        for vertex in mesh.triangles[t as usize] {
            let place = places[vertex as usize];
            let next = numbers.len() as u64;
            let number = *numbers.entry(place).or_insert_with(|| {
                input.vert_properties.extend(mesh.positions[place as usize].as_dvec3().to_array());
                next
            });
            input.tri_verts.push(number);
        }
        input.face_id.push(u64::from(t));
    }
    // a panic over there is no panic of ours: the group stays as it is
    let made = catch_unwind(AssertUnwindSafe(|| {
        let soup = Manifold::from_mesh_gl64_robust(&input);
        if soup.status() != Error::NoError {
            return Err(soup.status());
        }
        let made = soup.rebuild_solid(WindingRule::Positive);
        if made.status() == Error::NoError { Ok((made.get_mesh_gl64(-1), made.volume())) } else { Err(made.status()) }
    }));
    let (made, volume_m3) = match made {
        Ok(Ok(made)) => made,
        Ok(Err(status)) => return Err(format!("{status:?}")),
        Err(_) => return Err("the arrangement failed".to_owned()),
    };
    read(mesh, triangles, &made, volume_m3)
}

/// Reads the union, if it is whole and its pieces are where they say they come from.
fn read(mesh: &Mesh, replaced: &[u32], made: &MeshGL64, volume_m3: f64) -> Result<Union, String> {
    let properties = made.num_prop as usize;
    let position = |row: &[f64]| DVec3::new(row[0], row[1], row[2]).as_vec3() + Vec3::ZERO;
    let positions: Vec<Vec3> = made.vert_properties.chunks_exact(properties.max(3)).map(position).collect();
    if made.face_id.len() * 3 != made.tri_verts.len() || made.tri_verts.is_empty() {
        return Err("the union lost its surface".to_owned());
    }
    let mut triangles = Vec::with_capacity(made.face_id.len());
    for (corners, &from) in made.tri_verts.chunks_exact(3).zip(&made.face_id) {
        let corners = [corners[0] as u32, corners[1] as u32, corners[2] as u32];
        if replaced.binary_search(&(from as u32)).is_err() {
            return Err("a piece of the union comes from nowhere".to_owned());
        }
        let [a, b, c] = corners.map(|v| positions[v as usize]);
        // what rounding to f32 made a line or a point leaves no gap: its neighbours moved with it
        if a != b && b != c && c != a {
            triangles.push((corners, from as u32));
        }
    }
    triangles.sort_by_key(|&(_, from)| from);
    let same = |(&(corners, from), &t): (&([u32; 3], u32), &u32)| {
        from == t && {
            let (made, was) = (corners.map(|v| positions[v as usize]), mesh.corners(t as usize));
            (0..3).any(|turn| (0..3).all(|k| made[(k + turn) % 3] == was[k]))
        }
    };
    let changed = triangles.len() != replaced.len() || !triangles.iter().zip(replaced).all(same);
    Ok(Union { positions, triangles, replaced: replaced.to_vec(), volume_m3, changed })
}
