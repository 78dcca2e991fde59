//! Normals computed anew for each pose, by the same weights as [`crate::normals`].
//!
//! Why not [`crate::normals::compute`]: it decides at each call which vertices at one place smooth one another, by an angle. Over a
//! motion that decision would flip, and the shade would jump. Here it is made once, in the rest pose: vertices at one place whose rest
//! normals agree share one normal in every pose, so seams stay smooth and hard edges hard.

use crate::normals::face;
use crate::{Mesh, weld};
use glam::Vec3;

/// Vertices that share a normal: their rest normals were the same sum, or one number of the file, rounded.
const SAME_NORMAL_RAD: f32 = 0.01;

/// As in [`crate::normals`]: more vertices at one place are damage, and would take time with their square.
const LARGEST_GROUP: usize = 256;

/// Which vertices share a normal.
#[derive(Clone, Debug, Default)]
pub(crate) struct Renewal {
    /// Where each group begins in `members`, and the end of the last.
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl Renewal {
    /// By the rest pose; `stay_together` says of two vertices at one place whether they stay so.
    pub fn new(rest: &Mesh, stay_together: impl Fn(usize, usize) -> bool) -> Self {
        let first = weld::first_of_position(&rest.positions);
        let mut order: Vec<u32> =
            (0..first.len() as u32).filter(|&i| first[i as usize] != i).flat_map(|i| [first[i as usize], i]).collect();
        order.sort_unstable_by_key(|&i| (first[i as usize], i));
        order.dedup();
        let least = libm::cosf(SAME_NORMAL_RAD);
        let (mut starts, mut members) = (vec![0], Vec::new());
        let mut left: Vec<u32> = Vec::new();
        for place in order.chunk_by(|&a, &b| first[a as usize] == first[b as usize]) {
            if place.len() > LARGEST_GROUP {
                continue;
            }
            left.clear();
            left.extend_from_slice(place);
            while let Some(&head) = left.first() {
                let n = rest.normals[head as usize];
                let begin = members.len();
                left.retain(|&i| {
                    let same = i == head || rest.normals[i as usize].dot(n) > least && stay_together(head as usize, i as usize);
                    if same {
                        members.push(i);
                    }
                    !same
                });
                if members.len() == begin + 1 {
                    members.truncate(begin);
                } else {
                    starts.push(members.len() as u32);
                }
            }
        }
        Self { starts, members }
    }

    /// Vertices that share a normal, group after group.
    pub fn groups(&self) -> impl Iterator<Item = &[u32]> {
        self.starts.windows(2).map(|group| &self.members[group[0] as usize..group[1] as usize])
    }

    /// Unit normals of a pose; where no triangle with an area uses a vertex, the rest normal.
    pub fn renew(&self, rest: &Mesh, positions: &[Vec3], normals: &mut Vec<Vec3>) {
        normals.clear();
        normals.resize(positions.len(), Vec3::ZERO);
        for &corners in &rest.triangles {
            let (normal, angles) = face(positions, corners);
            for (vertex, angle) in corners.into_iter().zip(angles) {
                normals[vertex as usize] += (normal * angle).as_vec3();
            }
        }
        for group in self.groups() {
            let sum: Vec3 = group.iter().map(|&i| normals[i as usize]).sum();
            group.iter().for_each(|&i| normals[i as usize] = sum);
        }
        for (n, &rest) in normals.iter_mut().zip(&rest.normals) {
            *n = n.try_normalize().unwrap_or(rest);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::normals;

    #[test]
    fn seams_stay_smooth_and_hard_edges_hard_and_the_rest_pose_is_its_own() {
        // two triangles that fold at an edge, its vertices written twice
        let mut mesh = Mesh {
            positions: [[-1., 0., 0.], [0., 0.2, 1.], [0., 0.2, -1.], [0., 0.2, 1.], [1., 0., 0.], [0., 0.2, -1.]]
                .map(Vec3::from)
                .to_vec(),
            triangles: vec![[0, 1, 2], [3, 4, 5]],
            ..Mesh::default()
        };
        normals::compute(&mut mesh);
        let smooth = Renewal::new(&mesh, |_, _| true);
        let mut renewed = Vec::new();
        smooth.renew(&mesh, &mesh.positions, &mut renewed);
        assert!(renewed.iter().zip(&mesh.normals).all(|(a, b)| a.distance(*b) < 1e-6));
        // folded by more than the angle at which an import would part them, it is still smooth
        let mut folded = mesh.positions.clone();
        for i in [1, 2, 3, 5] {
            folded[i].y = 3.0;
        }
        smooth.renew(&mesh, &folded, &mut renewed);
        assert!(renewed[1].distance(Vec3::Y) < 1e-6 && renewed[3].distance(Vec3::Y) < 1e-6);
        // and an edge that was hard stays so when it lies flat
        mesh.normals = [Vec3::X, Vec3::X, Vec3::X, Vec3::Z, Vec3::Z, Vec3::Z].to_vec();
        let hard = Renewal::new(&mesh, |_, _| true);
        hard.renew(&mesh, &mesh.positions, &mut renewed);
        assert!(renewed[0].distance(renewed[1]) < 1e-6);
        assert!(renewed[1].distance(renewed[3]) > 0.1);
        let apart = Renewal::new(&mesh, |_, _| false);
        assert_eq!(apart.members.len(), 0);
    }
}
