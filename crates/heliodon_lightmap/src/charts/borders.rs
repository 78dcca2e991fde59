//! Borders between charts, straightened: they follow triangles, and teeth leave texels that nothing fills.

use super::clusters::Surface;
use super::neighbors::NOBODY;
use glam::Vec3;
use heliodon_math::frame::unit_or;
use std::collections::VecDeque;

/// A border must become shorter by this part of a side at least, so that rounding moves nothing to and fro.
const SHORTER: f32 = 1.0e-4;

/// Triangles that hang on their cluster by one side at most are given to a neighbour with whom they share more, where their normals are within its cone: each
/// makes borders shorter, and none parts a cluster. Returns what each cluster then has, ascending, and its direction before, to which the cone is kept; clusters
/// that lost all are left out.
pub(super) fn straightened(surface: &Surface, clusters: &[Vec<u32>], least_cosine: f32) -> Vec<(Vec<u32>, Vec3)> {
    let Surface { faces, neighbors } = *surface;
    let mut owner = vec![NOBODY; faces.len()];
    for (cluster, triangles) in clusters.iter().enumerate() {
        triangles.iter().for_each(|&t| owner[t as usize] = cluster as u32);
    }
    let sum = |triangles: &Vec<u32>| triangles.iter().map(|&t| faces[t as usize].normal * faces[t as usize].area).sum::<Vec3>();
    let axes: Vec<Vec3> = clusters.iter().map(|triangles| unit_or(sum(triangles), Vec3::ZERO)).collect();
    let beside =
        |t: u32| neighbors[t as usize].into_iter().zip(faces[t as usize].lengths).filter(|(other, _)| *other != NOBODY);
    let mut asked: VecDeque<u32> = (0..faces.len() as u32).collect();
    while let Some(t) = asked.pop_front() {
        let own = owner[t as usize];
        let shared = |with: u32, owner: &[u32]| {
            beside(t).filter(|(other, _)| owner[*other as usize] == with).map(|(_, length)| length).sum::<f32>()
        };
        if beside(t).filter(|(other, _)| owner[*other as usize] == own).count() > 1 {
            continue;
        }
        let least = shared(own, &owner) + SHORTER * faces[t as usize].lengths.iter().sum::<f32>();
        let gains = |other: u32| {
            let cluster = owner[other as usize];
            let is_within = cluster != own && faces[t as usize].normal.dot(axes[cluster as usize]) >= least_cosine;
            is_within.then(|| (shared(cluster, &owner), cluster)).filter(|(length, _)| *length > least)
        };
        let best = beside(t).filter_map(|(other, _)| gains(other)).max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
        if let Some((_, cluster)) = best {
            owner[t as usize] = cluster;
            asked.extend(beside(t).map(|(other, _)| other));
        }
    }
    let mut straight: Vec<(Vec<u32>, Vec3)> = axes.into_iter().map(|axis| (Vec::new(), axis)).collect();
    for (t, cluster) in owner.into_iter().enumerate().filter(|(_, cluster)| *cluster != NOBODY) {
        straight[cluster as usize].0.push(t as u32);
    }
    straight.retain(|(triangles, _)| !triangles.is_empty());
    straight
}

#[cfg(test)]
mod tests {
    use super::super::{Face, neighbors::neighbors};
    use super::*;
    use proptest::prelude::*;

    const SIDE: usize = 12;

    /// A square of so many squares a side, two triangles each; those whose first corner is behind `fold` stand upright.
    fn field(fold: usize) -> (Vec<Face>, Vec<[u32; 3]>) {
        let place = |i: usize, j: usize| Vec3::new(i.min(fold) as f32, j as f32, i.saturating_sub(fold) as f32);
        let positions: Vec<Vec3> = (0..=SIDE).flat_map(|j| (0..=SIDE).map(move |i| place(i, j))).collect();
        let at = |i: usize, j: usize| (j * (SIDE + 1) + i) as u32;
        let square =
            |i: usize, j: usize| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]];
        let triangles: Vec<[u32; 3]> = (0..SIDE).flat_map(|j| (0..SIDE).flat_map(move |i| square(i, j))).collect();
        let faces = triangles.iter().map(|t| Face::new(t.map(|v| positions[v as usize]), 1.0)).collect();
        (faces, neighbors(&positions, &triangles, |_| true))
    }

    fn border(surface: &Surface, owner: &[u32]) -> f32 {
        let sides = |t: usize| {
            surface.neighbors[t].into_iter().zip(surface.faces[t].lengths).map(move |(other, length)| (t, other, length))
        };
        let apart = |(t, other, _): &(usize, u32, f32)| *other != NOBODY && owner[*t] != owner[*other as usize];
        (0..owner.len()).flat_map(sides).filter(apart).map(|(.., length)| length).sum()
    }

    fn owners(clusters: &[Vec<u32>]) -> Vec<u32> {
        let mut owner = vec![NOBODY; 2 * SIDE * SIDE];
        for (cluster, triangles) in clusters.iter().enumerate() {
            for &t in triangles {
                assert_eq!(std::mem::replace(&mut owner[t as usize], cluster as u32), NOBODY, "one has it");
            }
        }
        assert!(owner.iter().all(|owner| *owner != NOBODY), "none is lost");
        owner
    }

    fn split(is_first: impl Fn(usize, usize) -> bool) -> [Vec<u32>; 2] {
        let (first, second) =
            (0..2 * (SIDE * SIDE) as u32).partition(|t| is_first(*t as usize / 2 % SIDE, *t as usize / 2 / SIDE));
        [first, second]
    }

    #[test]
    fn a_tooth_goes_to_those_around_it() {
        let (faces, neighbors) = field(SIDE);
        let surface = Surface { faces: &faces, neighbors: &neighbors };
        let [mut first, mut second] = split(|i, _| i < 5);
        let straight = [first.clone(), second.clone()];
        // with one side it hangs on the first, two are the second's
        let tooth = (2 * (7 * SIDE + 5) + 1) as u32;
        second.retain(|t| *t != tooth);
        first.push(tooth);
        first.sort_unstable();
        let toothed = [first, second];
        let triangles = |least_cosine: f32| -> Vec<Vec<u32>> {
            straightened(&surface, &toothed, least_cosine).into_iter().map(|(triangles, _)| triangles).collect()
        };
        assert_eq!(triangles(0.7), straight);
        assert_eq!(triangles(1.1), toothed, "nothing is within such a cone");
    }

    #[test]
    fn what_faces_elsewhere_goes_where_it_belongs() {
        let (faces, neighbors) = field(5);
        let surface = Surface { faces: &faces, neighbors: &neighbors };
        let [flat, upright] = split(|i, _| i < 5);
        let with_hole = split(|i, j| i < 5 && !(i == 4 && j == 7));
        let straight = straightened(&surface, &with_hole, 0.7);
        assert_eq!((&straight[0].0, &straight[1].0), (&flat, &upright));
        assert!((straight[0].1 - faces[0].normal).length() < 1e-6);
    }

    proptest! {
        #[test]
        fn borders_become_no_longer(labels in proptest::collection::vec(0_u32..6, SIDE * SIDE)) {
            let (faces, neighbors) = field(SIDE);
            let surface = Surface { faces: &faces, neighbors: &neighbors };
            let of = |label: u32| (0..2 * (SIDE * SIDE) as u32).filter(|t| labels[*t as usize / 2] == label).collect::<Vec<u32>>();
            let clusters: Vec<Vec<u32>> = (0..6).map(of).collect();
            let straight: Vec<Vec<u32>> = straightened(&surface, &clusters, 0.7).into_iter().map(|(triangles, _)| triangles).collect();
            let [before, after] = [&clusters, &straight].map(|clusters| border(&surface, &owners(clusters)));
            prop_assert!(after <= before);
            prop_assert!(straight.iter().all(|triangles| triangles.is_sorted() && !triangles.is_empty()));
        }
    }
}
