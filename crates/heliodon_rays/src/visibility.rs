//! The visibility matrix by rays: exact, for any mesh that fits in memory.
//!
//! What the paper does with a depth buffer for each direction (M. Sattler, R. Sarlette, G. Zachmann, R. Klein: "Hardware-accelerated
//! ambient occlusion computation", VMV 2004), parallel rays do without its resolution and without its offset: all rays of one
//! direction share their way, and neighbouring directions the top of the hierarchy ([`TriangleScene::occluded_fan`]).

use crate::beam::usable;
use crate::order::beam_order;
use crate::scene::TriangleScene;
use glam::Vec3;
use heliodon_math::frame::unit_or;
use heliodon_math::visibility::{BLOCK, BLOCK_WORDS, VisibilityMatrix};
use rayon::prelude::*;

/// Directions that are asked for together: each asks for a bit of 512 points, and their answers must stay in the cache.
const TOGETHER: usize = 64;

impl TriangleScene {
    /// Which of the unit `directions` to the light reach points with `normals` (made unit): those that face it (`n.l > 0`) and whose ray, from
    /// `offset_m` off the surface, meets nothing. Points or normals that are not finite, and zero normals, see nothing.
    ///
    /// Uses the current rayon pool; the answer does not depend on it. Memory beyond the matrix: 28 bytes a point.
    ///
    /// # Panics
    /// If there are not as many normals as positions.
    #[must_use]
    pub fn visibility(&self, positions: &[Vec3], normals: &[Vec3], directions: &[Vec3], offset_m: f32) -> VisibilityMatrix {
        assert_eq!(positions.len(), normals.len(), "one normal for each position");
        // A point that is nowhere has no normal.
        let clean = |(p, &n): (&Vec3, &Vec3)| if usable(*p) { unit_or(n, Vec3::ZERO) } else { Vec3::ZERO };
        let normals: Vec<Vec3> = positions.par_iter().zip(normals).map(clean).collect();
        let mut matrix = VisibilityMatrix::new(beam_order(positions, Some(&normals)), &normals, directions);
        let origins: Vec<Vec3> =
            matrix.order().par_iter().map(|&i| positions[i as usize] + normals[i as usize] * offset_m).collect();
        let (rows, order) = (matrix.normals().to_vec(), direction_order(directions));
        matrix.blocks_mut().zip(origins.par_chunks(BLOCK)).zip(rows.par_chunks(BLOCK)).for_each(
            |((words, origins), normals)| {
                let width = origins.len().div_ceil(64);
                let (mut active, mut occluded) = ([0; TOGETHER * BLOCK_WORDS], [0; TOGETHER * BLOCK_WORDS]);
                for order in order.chunks(TOGETHER) {
                    let toward: Vec<Vec3> = order.iter().map(|&j| directions[j as usize]).collect();
                    let (active, occluded) = (&mut active[..width * order.len()], &mut occluded[..width * order.len()]);
                    for (&l, active) in toward.iter().zip(active.chunks_exact_mut(width)) {
                        facing(normals, l, active);
                    }
                    self.occluded_fan(origins, &toward, active, occluded);
                    let answers = active.chunks_exact(width).zip(occluded.chunks_exact(width));
                    for (&j, (active, occluded)) in order.iter().zip(answers) {
                        let column = &mut words[j as usize * BLOCK_WORDS..][..width];
                        for (word, (asked, met)) in column.iter_mut().zip(active.iter().zip(occluded)) {
                            *word = asked & !met;
                        }
                    }
                }
            },
        );
        matrix
    }
}

/// Sets the bit of every point whose surface faces `direction` (bit i % 64 of word i / 64), clears the others, and returns how many there
/// are.
pub fn facing(normals: &[Vec3], direction: Vec3, active: &mut [u64]) -> u32 {
    let mut count = 0;
    for (word, normals) in active.iter_mut().zip(normals.chunks(64)) {
        *word = normals.iter().enumerate().fold(0, |bits, (bit, n)| bits | u64::from(n.dot(direction) > 0.0) << bit);
        count += word.count_ones();
    }
    count
}

/// An order of directions in which neighbours are alike: by the axis that they follow most, then along a Z-curve over the slopes.
fn direction_order(directions: &[Vec3]) -> Vec<u32> {
    let key = |d: Vec3| {
        let magnitude = d.abs();
        let k = if magnitude.x >= magnitude.y && magnitude.x >= magnitude.z {
            0
        } else if magnitude.y >= magnitude.z {
            1
        } else {
            2
        };
        let cell = |axis: usize| ((d[axis] / magnitude[k] * 0.5 + 0.5) * 1023.0) as u32;
        let (u, v) = (cell((k + 1) % 3), cell((k + 2) % 3));
        let interleaved = (0..10).fold(0, |bits, b| bits | (u >> b & 1) << (2 * b) | (v >> b & 1) << (2 * b + 1));
        (k, d[k] < 0.0, interleaved)
    };
    let mut order: Vec<u32> = (0..directions.len() as u32).collect();
    order.sort_by_key(|&j| key(directions[j as usize]));
    order
}
