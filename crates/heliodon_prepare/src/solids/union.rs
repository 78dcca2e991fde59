//! The union of a group's solids.

use crate::interim::Kept;
use glam::{DVec3, Vec3};
use heliodon_mesh::Mesh;
use manifold_rust::manifold::Manifold;
use manifold_rust::types::{Error, MeshGL64, WindingRule};
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A union's surface; nothing but its volume where it is what was there.
#[derive(Debug, PartialEq)]
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
    Ok(match changed {
        true => Union { positions, triangles, replaced: replaced.to_vec(), volume_m3, changed },
        false => Union { positions: Vec::new(), triangles: Vec::new(), replaced: Vec::new(), volume_m3, changed },
    })
}

/// A reason as its bytes behind their number and a one, or a union behind a zero.
impl Kept for Result<Union, String> {
    fn put(&self, into: &mut Vec<u32>) {
        let union = match self {
            Ok(union) => union,
            Err(reason) => {
                into.push(1);
                return reason.bytes().map(u32::from).collect::<Vec<_>>().put(into);
            }
        };
        let volume = union.volume_m3.to_bits();
        into.extend([0, u32::from(union.changed), volume as u32, (volume >> 32) as u32]);
        union.positions.iter().flat_map(|p| p.to_array().map(f32::to_bits)).collect::<Vec<_>>().put(into);
        union.triangles.iter().flat_map(|&([a, b, c], from)| [a, b, c, from]).collect::<Vec<_>>().put(into);
        union.replaced.put(into);
    }

    fn get(from: &mut impl Iterator<Item = u32>) -> Option<Self> {
        if from.next()? == 1 {
            let bytes = Vec::<u32>::get(from)?.into_iter().map(u8::try_from).collect::<Result<_, _>>().ok()?;
            return Some(Err(String::from_utf8(bytes).ok()?));
        }
        let changed = from.next()? == 1;
        let volume_m3 = f64::from_bits(u64::from(from.next()?) | u64::from(from.next()?) << 32);
        let (positions, triangles, replaced) = (Vec::get(from)?, Vec::get(from)?, Vec::get(from)?);
        let positions = positions.as_chunks().0.iter().map(|p: &[u32; 3]| Vec3::from(p.map(f32::from_bits))).collect();
        let triangles = triangles.as_chunks().0.iter().map(|&[a, b, c, from]| ([a, b, c], from)).collect();
        Some(Ok(Union { positions, triangles, replaced, volume_m3, changed }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_union_is_kept_as_it_is() {
        let union = Union {
            positions: vec![Vec3::new(-1.5, 0.25, 3.0e7), Vec3::ZERO],
            triangles: vec![([0, 1, 2], 9), ([7, 8, 9], u32::MAX)],
            replaced: vec![3, 5, 8],
            volume_m3: 0.1 + 0.2,
            changed: true,
        };
        let all = [Ok(union), Err("not a manifold \u{2260}".to_owned()), Err(String::new())];
        let mut numbers = Vec::new();
        all.iter().for_each(|one| one.put(&mut numbers));
        let mut from = numbers.into_iter();
        let mut next = || <Result<Union, String>>::get(&mut from);
        for one in all {
            assert_eq!(next(), Some(one));
        }
        assert_eq!(next(), None);
    }
}
