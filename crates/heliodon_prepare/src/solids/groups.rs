//! Solids whose boxes meet.

use crate::topology::{Patches, Sense};
use glam::DVec3;
use heliodon_mesh::Mesh;
use heliodon_mesh::topology::UnionFind;

/// Solids that may overlap or touch, each within the same group as any whose box meets its own.
pub(super) struct Group {
    /// How many patches it has.
    pub patches: usize,
    /// Their triangles, in order.
    pub triangles: Vec<u32>,
    /// What they enclose one by one, in cubic metres.
    pub volume_m3: f64,
}

/// The groups of two patches and more, and of lone ones, which may run into themselves; in the order of their first triangles.
pub(super) fn groups(mesh: &Mesh, patches: &Patches, senses: &[Sense]) -> Vec<Group> {
    let is_solid = |patch: usize| matches!(senses[patch], Sense::Body | Sense::Hollow);
    let bounds = patches.closed_bounds(&mesh.positions, &mesh.triangles);
    let mut solids: Vec<usize> = (0..senses.len()).filter(|&patch| is_solid(patch)).collect();
    solids.sort_by(|&a, &b| bounds[a].0.x.total_cmp(&bounds[b].0.x).then(a.cmp(&b)));
    let mut sets = UnionFind::new(senses.len());
    let meet = |a: (DVec3, DVec3), b: (DVec3, DVec3)| a.0.cmple(b.1).all() && b.0.cmple(a.1).all();
    // those whose box may still reach the next one along x
    let mut open: Vec<usize> = Vec::new();
    for &solid in &solids {
        open.retain(|&other| bounds[other].1.x >= bounds[solid].0.x);
        for &other in open.iter().filter(|&&other| meet(bounds[other], bounds[solid])) {
            sets.unite(other as u32, solid as u32, false);
        }
        open.push(solid);
    }
    let mut group_of = vec![usize::MAX; senses.len()];
    let mut groups: Vec<Group> = Vec::new();
    for patch in (0..senses.len()).filter(|&patch| is_solid(patch)) {
        let root = sets.find(patch as u32).0 as usize;
        if root == patch {
            group_of[patch] = groups.len();
            groups.push(Group { patches: 0, triangles: Vec::new(), volume_m3: 0.0 });
        }
        group_of[patch] = group_of[root];
        let group = &mut groups[group_of[patch]];
        group.patches += 1;
        group.volume_m3 += patches.list[patch].volume_m3;
    }
    for t in 0..mesh.triangles.len() {
        if let Some((patch, _)) = patches.of(t).filter(|&(patch, _)| is_solid(patch)) {
            groups[group_of[patch]].triangles.push(t as u32);
        }
    }
    groups
}
