//! Patches: triangles that hang together by edges where exactly two meet, or are closed together, and how they are wound.

use glam::{DVec3, Vec3};
use heliodon_mesh::topology::{Edges, UnionFind};

/// No patch: the triangle was left out.
const NONE: u32 = u32::MAX;

/// Triangles that edges between two join, or that make a closed surface together.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Patch {
    /// Its first triangle, whose winding is the one that others agree with or not.
    pub first: u32,
    /// How many it has.
    pub triangles: u32,
    /// How many of them are wound against the first.
    pub turned: u32,
    /// Whether it encloses a space: every edge is passed as often one way as the other if all wind as the first does.
    pub closed: bool,
    /// Whether no winding of its triangles makes all agree (as on a Moebius strip).
    pub one_sided: bool,
    /// Whether it has edges where more than two triangles meet.
    pub shares_edges: bool,
    /// The volume that it encloses where it is closed, were all wound as the first; negative where that is inside out.
    pub volume_m3: f64,
}

/// The patches of a mesh.
pub(crate) struct Patches {
    /// Twice the patch's number for each triangle, and one more where it is wound against the patch's first.
    of: Vec<u32>,
    /// The patches, in the order of their first triangles.
    pub list: Vec<Patch>,
}

impl Patches {
    /// Finds them.
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]], edges: &Edges, kept: impl Fn(usize) -> bool) -> Self {
        let mut sets = UnionFind::new(triangles.len());
        let mut one_sided = Vec::new();
        edges.for_each(|_, sides| {
            if sides.len() == 2
                && let (Some(a), Some(b)) = (sides.next(), sides.next())
                && !sets.unite(a.triangle, b.triangle, a.down == b.down)
            {
                one_sided.push(a.triangle);
            }
        });
        let (mut of, count) = sets.into_numbers();
        let mut list = vec![Patch { first: NONE, closed: true, ..Patch::default() }; count as usize];
        for triangle in one_sided {
            list[of[triangle as usize] as usize >> 1].one_sided = true;
        }
        let own_volume = |t: usize, first: u32| volume(positions, triangles, t, first as usize);
        for t in 0..triangles.len() {
            let patch = &mut list[of[t] as usize >> 1];
            if !kept(t) {
                // left out, so nothing was united with it
                patch.closed = false;
                of[t] = NONE;
                continue;
            }
            if patch.first == NONE {
                patch.first = t as u32;
            }
            patch.triangles += 1;
            patch.turned += of[t] & 1;
            let volume = own_volume(t, patch.first);
            patch.volume_m3 += if of[t] & 1 == 1 { -volume } else { volume };
        }
        let mut patches = Self { of, list };
        patches.mark_open(edges);
        patches.join_shells(edges, own_volume);
        patches
    }

    /// Bodies that share a wall or an edge fall into patches there, none of which is closed. Where patches that edges of more than two
    /// triangles join are closed together, as they are wound, they are one.
    fn join_shells(&mut self, edges: &Edges, own_volume: impl Fn(usize, u32) -> f64) {
        let mut shells = UnionFind::new(self.list.len());
        let mut balanced = vec![true; self.list.len()];
        edges.for_each(|_, sides| {
            let (mut passed, mut last, several) = (0, None, sides.len() > 2);
            for side in sides {
                let Some((patch, _)) = self.of(side.triangle as usize) else { continue };
                passed += if side.down { -1 } else { 1 };
                let before = last.replace(patch);
                if several {
                    self.list[patch].shares_edges = true;
                    shells.unite(before.unwrap_or(patch) as u32, patch as u32, false);
                }
            }
            if passed != 0
                && let Some(patch) = last
            {
                balanced[patch] = false;
            }
        });
        let (shell_of, count) = shells.into_numbers();
        let shell_of = |patch: usize| shell_of[patch] as usize >> 1;
        // of each shell its first patch, and how many it has; none where it is not closed
        let mut first = vec![(NONE, 0_u32); count as usize];
        for (patch, balanced) in balanced.iter().enumerate() {
            let shell = &mut first[shell_of(patch)];
            *shell = (shell.0.min(patch as u32), if *balanced && shell.1 != NONE { shell.1 + 1 } else { NONE });
        }
        let joined_to = |patch: usize| match first[shell_of(patch)] {
            (_, NONE | 0 | 1) => None,
            (first, _) => Some(first as usize),
        };
        for patch in 0..self.list.len() {
            if let Some(first) = joined_to(patch) {
                let joined = std::mem::take(&mut self.list[patch]);
                if patch == first {
                    self.list[first] = Patch { first: joined.first, closed: true, shares_edges: true, ..Patch::default() };
                }
            }
        }
        for t in 0..self.of.len() {
            if let Some(first) = self.of(t).and_then(|(patch, _)| joined_to(patch)) {
                self.of[t] = (first as u32) << 1;
                let shell = &mut self.list[first];
                shell.triangles += 1;
                shell.volume_m3 += own_volume(t, shell.first);
            }
        }
    }

    /// Patches that more half edges leave than enter somewhere are not closed.
    fn mark_open(&mut self, edges: &Edges) {
        let mut passed: Vec<(usize, i32)> = Vec::new();
        edges.for_each(|_, sides| {
            if sides.len() == 2 {
                return;
            }
            passed.clear();
            for side in sides {
                let Some((patch, turned)) = self.of(side.triangle as usize) else { continue };
                let way = if side.down ^ turned { -1 } else { 1 };
                passed.push((patch, way));
            }
            passed.sort_unstable();
            for of_patch in passed.chunk_by(|a, b| a.0 == b.0) {
                if of_patch.iter().map(|(_, way)| way).sum::<i32>() != 0 {
                    self.list[of_patch[0].0].closed = false;
                }
            }
        });
        for patch in &mut self.list {
            patch.closed &= !patch.one_sided;
            if !patch.closed {
                patch.volume_m3 = 0.0;
            }
        }
    }

    /// The patch of a triangle, and whether the triangle is wound against the patch's first one; none where it was left out.
    #[inline]
    pub fn of(&self, triangle: usize) -> Option<(usize, bool)> {
        let of = self.of[triangle];
        (of != NONE).then_some((of as usize >> 1, of & 1 == 1))
    }

    /// The box around each closed patch; empty boxes for the others.
    pub fn closed_bounds(&self, positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<(DVec3, DVec3)> {
        let mut bounds = vec![(DVec3::INFINITY, DVec3::NEG_INFINITY); self.list.len()];
        for (t, triangle) in triangles.iter().enumerate() {
            if let Some((patch, _)) = self.of(t)
                && self.list[patch].closed
            {
                let (low, high) = &mut bounds[patch];
                for p in triangle.map(|v| positions[v as usize].as_dvec3()) {
                    (*low, *high) = (low.min(p), high.max(p));
                }
            }
        }
        bounds
    }
}

/// The volume between a triangle and a corner of the first one of its patch, positive where that is behind it. From a corner of its own: from
/// one far away, which a scan may have, nothing would be left of it but rounding.
fn volume(positions: &[Vec3], triangles: &[[u32; 3]], t: usize, first: usize) -> f64 {
    let at = |v: u32| positions[v as usize].as_dvec3();
    let origin = at(triangles[first][0]);
    let [a, b, c] = triangles[t].map(|v| at(v) - origin);
    a.dot(b.cross(c)) / 6.0
}
