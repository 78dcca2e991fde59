//! Vertices that are one in position, and what lies around a set of triangles.

use glam::Vec3;
use rayon::prelude::*;

/// Which vertices share a position, to the bit (0 and -0 are the same).
pub(super) struct Weld {
    /// For each vertex the first that lies where it does.
    first: Vec<u32>,
}

impl Weld {
    pub fn new(positions: &[Vec3]) -> Self {
        let key = |i: usize| ((positions[i] + Vec3::ZERO).to_array().map(f32::to_bits), i as u32);
        let mut sorted: Vec<([u32; 3], u32)> = (0..positions.len()).into_par_iter().map(key).collect();
        sorted.par_sort_unstable();
        let mut first = vec![0; positions.len()];
        for same in sorted.chunk_by(|a, b| a.0 == b.0) {
            for (_, vertex) in same {
                first[*vertex as usize] = same[0].1;
            }
        }
        Self { first }
    }

    /// The vertices of a triangle, one for each position.
    pub fn corners(&self, triangle: [u32; 3]) -> [u32; 3] {
        triangle.map(|i| self.first[i as usize])
    }

    /// Calls for every triangle that shares a vertex with one that `is_in` answers true for; with these too.
    pub fn around(&self, triangles: &[[u32; 3]], is_in: impl Fn(usize) -> bool, mut found: impl FnMut(usize)) {
        let mut touched = vec![false; self.first.len()];
        for (t, &triangle) in triangles.iter().enumerate() {
            if is_in(t) {
                self.corners(triangle).into_iter().for_each(|v| touched[v as usize] = true);
            }
        }
        for (t, &triangle) in triangles.iter().enumerate() {
            if self.corners(triangle).into_iter().any(|v| touched[v as usize]) {
                found(t);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_those_that_share_a_position() {
        let positions =
            [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(-0.0, 0.0, -0.0), -Vec3::X, -Vec3::Y, Vec3::Z, Vec3::ONE, Vec3::NAN];
        let triangles = [[0, 1, 2], [3, 4, 5], [6, 7, 8]];
        let weld = Weld::new(&positions);
        assert_eq!(weld.corners([3, 4, 8]), [0, 4, 8]);
        let mut found = Vec::new();
        weld.around(&triangles, |t| t == 1, |t| found.push(t));
        assert_eq!(found, [0, 1]);
    }
}
