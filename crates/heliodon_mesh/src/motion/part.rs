//! Vertices that move by the same rule: those of one primitive of one node.

use super::rig::JointMatrix;
use crate::Mesh;
use crate::import::{FARTHEST_M, rounded};
use crate::place::Affine;
use glam::{Vec3, Vec3A};

/// Joints and weights of each vertex; the weights of one add to 1.
#[derive(Clone, Debug, Default)]
pub(crate) struct Influences {
    /// Where each vertex's begin, and the end of the last.
    pub starts: Vec<u32>,
    /// Indices into the skin's joints, and weights above 0.
    pub pairs: Vec<(u16, f32)>,
}

impl Influences {
    pub fn of(&self, vertex: usize) -> &[(u16, f32)] {
        &self.pairs[self.starts[vertex] as usize..self.starts[vertex + 1] as usize]
    }
}

/// What places a part.
#[derive(Clone, Debug)]
pub(crate) enum Drive {
    /// Nothing but the placement.
    Scene,
    Node(usize),
    Skin(usize, Influences),
}

/// What a morph target adds to vertices at weight 1, in mesh space; those that it leaves alone are not listed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Deltas {
    /// Sorted by vertex, but for appended ones at the end.
    pub positions: Vec<(u32, Vec3)>,
    pub normals: Vec<(u32, Vec3)>,
}

#[derive(Clone, Debug)]
pub(crate) struct Morph {
    /// The weight of the first target.
    pub first_weight: usize,
    pub targets: Vec<Deltas>,
    /// Whether the file does not say what becomes of the normals.
    pub renews: bool,
}

#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub drive: Drive,
    /// Its first vertex in the mesh; its own ones follow one another.
    pub first: usize,
    /// Vertices that the importer appended, copies of its own.
    pub extra: Vec<u32>,
    /// Positions in mesh space, own ones then appended ones; finite.
    pub base: Vec<Vec3>,
    /// Unit normals in mesh space.
    pub normals: Vec<Vec3>,
    pub morph: Option<Morph>,
    /// By which the importer placed the vertices; not flat.
    pub modelled: Affine,
    /// Whether the default pose is another one than the importer's.
    pub settles: bool,
}

impl Part {
    pub fn len(&self) -> usize {
        self.base.len()
    }

    pub fn own_count(&self) -> usize {
        self.base.len() - self.extra.len()
    }

    pub fn renews(&self) -> bool {
        self.morph.as_ref().is_some_and(|morph| morph.renews)
    }

    /// Whether one of the weights that are marked is its own.
    pub fn morphs_by(&self, marked: &[bool]) -> bool {
        let own = |morph: &Morph| marked[morph.first_weight..morph.first_weight + morph.targets.len()].contains(&true);
        self.morph.as_ref().is_some_and(own)
    }

    /// Its vertex `i` as the mesh counts them.
    #[inline]
    pub fn vertex(&self, i: usize) -> usize {
        let own = self.own_count();
        if i < own { self.first + i } else { self.extra[i - own] as usize }
    }

    /// Appends a copy of its own vertex `i`, which is `vertex` in the mesh.
    pub fn repeat(&mut self, i: usize, vertex: u32) {
        let new = self.base.len() as u32;
        self.base.push(self.base[i]);
        self.extra.push(vertex);
        if let Drive::Skin(_, influences) = &mut self.drive {
            let of = influences.starts[i] as usize..influences.starts[i + 1] as usize;
            influences.pairs.extend_from_within(of);
            influences.starts.push(influences.pairs.len() as u32);
        }
        for target in self.morph.iter_mut().flat_map(|morph| &mut morph.targets) {
            for deltas in [&mut target.positions, &mut target.normals] {
                // own ones stand in front, sorted
                let own = deltas.partition_point(|d| d.0 <= i as u32);
                if let Some(&(_, delta)) = own.checked_sub(1).and_then(|at| deltas.get(at)).filter(|d| d.0 == i as u32) {
                    deltas.push((new, delta));
                }
            }
        }
    }

    /// Takes the mesh's normals back to mesh space: the placement's inverse transpose, inverted, is its transpose.
    pub fn take_normals(&mut self, mesh: &Mesh) {
        let mesh_from_site = self.modelled.linear().transpose();
        let local = |i: usize| (mesh_from_site * mesh.normals[self.vertex(i)].as_dvec3()).try_normalize();
        self.normals = (0..self.len()).map(|i| local(i).map_or(Vec3::Y, |n| n.as_vec3())).collect();
    }

    /// Positions and normals in mesh space under the weights.
    pub fn morphed<'s>(
        &'s self,
        weights: &[f64],
        positions: &'s mut Vec<Vec3>,
        normals: &'s mut Vec<Vec3>,
    ) -> (&'s [Vec3], &'s [Vec3]) {
        let Some(morph) = &self.morph else { return (&self.base, &self.normals) };
        positions.clone_from(&self.base);
        normals.clone_from(&self.normals);
        for (target, &weight) in morph.targets.iter().zip(&weights[morph.first_weight..]) {
            let weight = weight as f32;
            if weight == 0.0 {
                continue;
            }
            target.positions.iter().for_each(|&(i, delta)| positions[i as usize] += delta * weight);
            target.normals.iter().for_each(|&(i, delta)| normals[i as usize] += delta * weight);
        }
        (positions, normals)
    }

    /// Places the part as a whole. What comes out of reach or has no direction keeps what the pose holds, its rest.
    pub fn carry(
        &self,
        base: &[Vec3],
        base_normals: &[Vec3],
        site_from_mesh: &Affine,
        positions: &mut [Vec3],
        normals: &mut [Vec3],
    ) {
        for (i, (p, n)) in base.iter().zip(base_normals).enumerate() {
            let v = self.vertex(i);
            let placed = rounded(site_from_mesh.position(p.as_dvec3()));
            if !placed.is_nan() {
                positions[v] = placed;
            }
            let turned = site_from_mesh.normal(n.as_dvec3());
            if turned != Vec3::ZERO {
                normals[v] = turned;
            }
        }
    }

    /// Places each vertex by the weighted mean of its joints' matrices, its normal by that one's inverse transpose.
    pub fn blend(
        &self,
        base: &[Vec3],
        base_normals: &[Vec3],
        influences: &Influences,
        joints: &[JointMatrix],
        positions: &mut [Vec3],
        normals: &mut [Vec3],
    ) {
        let farthest = Vec3A::splat(FARTHEST_M as f32);
        for (i, (p, n)) in base.iter().zip(base_normals).enumerate() {
            let mut m = [Vec3A::ZERO; 4];
            for &(joint, weight) in influences.of(i) {
                let columns = &joints[usize::from(joint)].columns;
                for (m, column) in m.iter_mut().zip(columns) {
                    *m += *column * weight;
                }
            }
            let [x, y, z, offset] = m;
            let v = self.vertex(i);
            let placed = x * p.x + y * p.y + z * p.z + offset;
            // false for NaN
            if placed.abs().cmple(farthest).all() {
                positions[v] = placed.into();
            }
            // the cofactors are the inverse transpose times the determinant, of which only the sign matters
            let (yz, zx, xy) = (y.cross(z), z.cross(x), x.cross(y));
            let turned = yz * n.x + zx * n.y + xy * n.z;
            if let Some(turned) = turned.try_normalize() {
                normals[v] = if x.dot(yz) < 0.0 { -turned } else { turned }.into();
            }
        }
    }
}
