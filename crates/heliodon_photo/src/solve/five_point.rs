//! Two cameras with known lenses from five common points.
//!
//! D. Nister: An Efficient Solution to the Five-Point Relative Pose Problem, IEEE PAMI 26(6), 2004; sections 3.1 to 3.3.

use super::polynomial::{product, real_roots, value};
use crate::camera::Pose;
use glam::{DMat3, DQuat, DVec3};
use nalgebra::{DMatrix, SMatrix};

/// A polynomial in x, y, z of degree at most 3: coefficients by exponents, `TERMS` their order.
type Cubic = [f64; 20];

/// Exponents of x, y, z in the order that the elimination wants (Nister's table 1): the first ten are eliminated.
const TERMS: [[u8; 3]; 20] = [
    [3, 0, 0],
    [0, 3, 0],
    [2, 1, 0],
    [1, 2, 0],
    [2, 0, 1],
    [2, 0, 0],
    [0, 2, 1],
    [0, 2, 0],
    [1, 1, 1],
    [1, 1, 0],
    [1, 0, 2],
    [1, 0, 1],
    [1, 0, 0],
    [0, 1, 2],
    [0, 1, 1],
    [0, 1, 0],
    [0, 0, 3],
    [0, 0, 2],
    [0, 0, 1],
    [0, 0, 0],
];

const LINEAR: [usize; 4] = [12, 15, 18, 19];

fn term(exponents: [u8; 3]) -> Option<usize> {
    TERMS.iter().position(|t| *t == exponents)
}

/// Products up to degree 3; what would be higher does not come up.
struct Table([[u8; 20]; 20]);

impl Table {
    fn new() -> Self {
        let mut table = [[u8::MAX; 20]; 20];
        for (i, a) in TERMS.iter().enumerate() {
            for (j, b) in TERMS.iter().enumerate() {
                if let Some(k) = term([a[0] + b[0], a[1] + b[1], a[2] + b[2]]) {
                    table[i][j] = k as u8;
                }
            }
        }
        Self(table)
    }

    fn multiply(&self, a: &Cubic, b: &Cubic) -> Cubic {
        let mut all = [0.0; 20];
        for (i, x) in a.iter().enumerate().filter(|(_, x)| **x != 0.0) {
            for (j, y) in b.iter().enumerate().filter(|(_, y)| **y != 0.0) {
                if let Some(value) = all.get_mut(usize::from(self.0[i][j])) {
                    *value += x * y;
                }
            }
        }
        all
    }
}

fn add(a: &mut Cubic, b: &Cubic, scale: f64) {
    for (x, y) in a.iter_mut().zip(b) {
        *x += scale * y;
    }
}

/// Draws essential matrices (second^T E first = 0) from five or more pairs of directions; with more than five, E is sought in the four
/// directions of least error.
pub(super) struct Solver(Table);

impl Solver {
    pub(super) fn new() -> Self {
        Self(Table::new())
    }

    pub(super) fn essentials(&self, first: &[DVec3], second: &[DVec3]) -> Vec<DMat3> {
        let Some(basis) = null_space(first, second) else { return Vec::new() };
        let table = &self.0;
        // E = x X + y Y + z Z + W, entry by entry
        let e: [[Cubic; 3]; 3] = std::array::from_fn(|r| {
            std::array::from_fn(|c| {
                let mut entry = [0.0; 20];
                for (k, at) in LINEAR.iter().enumerate() {
                    entry[*at] = basis[k][3 * r + c];
                }
                entry
            })
        });
        // det E = 0, and 2 E E^T E - trace(E E^T) E = 0
        let mut rows: Vec<Cubic> = Vec::with_capacity(10);
        let minor = |c0: usize, c1: usize| {
            let mut m = table.multiply(&e[1][c0], &e[2][c1]);
            add(&mut m, &table.multiply(&e[1][c1], &e[2][c0]), -1.0);
            m
        };
        let mut determinant = table.multiply(&e[0][0], &minor(1, 2));
        add(&mut determinant, &table.multiply(&e[0][1], &minor(0, 2)), -1.0);
        add(&mut determinant, &table.multiply(&e[0][2], &minor(0, 1)), 1.0);
        let mut square = [[[0.0; 20]; 3]; 3];
        for r in 0..3 {
            for c in 0..3 {
                for k in 0..3 {
                    add(&mut square[r][c], &table.multiply(&e[r][k], &e[c][k]), 1.0);
                }
            }
        }
        let mut half_trace = [0.0; 20];
        for (k, row) in square.iter().enumerate() {
            add(&mut half_trace, &row[k], 0.5);
        }
        for (k, row) in square.iter_mut().enumerate() {
            add(&mut row[k], &half_trace, -1.0);
        }
        for row in &square {
            for c in 0..3 {
                let mut sum = [0.0; 20];
                for k in 0..3 {
                    add(&mut sum, &table.multiply(&row[k], &e[k][c]), 1.0);
                }
                rows.push(sum);
            }
        }
        rows.push(determinant);
        let Some(reduced) = eliminate(&rows) else { return Vec::new() };
        // Rows of x^2 z, x^2; y^2 z, y^2; x y z, x y: the first less z times the second leaves polynomials in z before x, y and 1.
        let pair = |row: usize| {
            let (a, b) = (&reduced[row], &reduced[row + 1]);
            let part = |from: usize, count: usize| {
                let mut p = vec![0.0; count + 1];
                for i in 0..count {
                    p[count - 1 - i] += a[from + i];
                    p[count - i] -= b[from + i];
                }
                p
            };
            [part(0, 3), part(3, 3), part(6, 4)]
        };
        let b = [pair(4), pair(6), pair(8)];
        let cross = |i: usize, j: usize| {
            let mut p = product(&b[0][i], &b[1][j]);
            p.iter_mut().zip(product(&b[0][j], &b[1][i])).for_each(|(x, y)| *x -= y);
            p
        };
        let minors = [cross(1, 2), cross(2, 0), cross(0, 1)];
        let mut tenth = vec![0.0; 11];
        for (m, c) in minors.iter().zip(&b[2]) {
            tenth.iter_mut().zip(product(m, c)).for_each(|(x, y)| *x += y);
        }
        let mut found = Vec::new();
        for z in real_roots(&tenth) {
            let at: [f64; 3] = std::array::from_fn(|k| value(&minors[k], z));
            if at[2].abs() < f64::MIN_POSITIVE {
                continue;
            }
            let (x, y) = (at[0] / at[2], at[1] / at[2]);
            let entries: [f64; 9] = std::array::from_fn(|i| x * basis[0][i] + y * basis[1][i] + z * basis[2][i] + basis[3][i]);
            let e = DMat3::from_cols_array(&entries).transpose();
            let norm = e.to_cols_array().iter().map(|v| v * v).sum::<f64>().sqrt();
            if norm.is_finite() && norm > 0.0 {
                found.push(e * (1.0 / norm));
            }
        }
        found
    }
}

/// The four directions in which the pairs' equations are least violated.
fn null_space(first: &[DVec3], second: &[DVec3]) -> Option<[[f64; 9]; 4]> {
    if first.len() < 5 || first.len() != second.len() {
        return None;
    }
    let rows = DMatrix::from_fn(first.len(), 9, |i, k| second[i][k / 3] * first[i][k % 3]);
    let normal: SMatrix<f64, 9, 9> = SMatrix::from_fn(|i, j| rows.column(i).dot(&rows.column(j)));
    let eigen = nalgebra::SymmetricEigen::try_new(normal, f64::EPSILON, 1000)?;
    let mut order: Vec<usize> = (0..9).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    Some(std::array::from_fn(|k| std::array::from_fn(|i| eigen.eigenvectors[(i, order[k])])))
}

/// Gauss and Jordan with pivots: the last ten columns where the first ten have become the identity.
fn eliminate(rows: &[Cubic]) -> Option<Vec<[f64; 10]>> {
    let mut rows: Vec<Cubic> = rows.to_vec();
    for column in 0..10 {
        let pivot = (column..10).max_by(|a, b| rows[*a][column].abs().total_cmp(&rows[*b][column].abs()))?;
        rows.swap(column, pivot);
        let head = rows[column][column];
        if head.abs() < 1e-300 {
            return None;
        }
        let scaled = rows[column].map(|v| v / head);
        rows[column] = scaled;
        for (r, row) in rows.iter_mut().enumerate() {
            if r != column {
                let factor = row[column];
                add(row, &scaled, -factor);
            }
        }
    }
    Some(rows.iter().map(|row| std::array::from_fn(|i| row[10 + i])).collect())
}

/// The four poses (second from first, |t| = 1) that an essential matrix allows.
pub(super) fn poses(essential: &DMat3) -> Vec<Pose> {
    let m = SMatrix::<f64, 3, 3>::from_column_slice(&essential.to_cols_array());
    let Some(svd) = nalgebra::SVD::try_new(m, true, true, f64::EPSILON, 1000) else { return Vec::new() };
    let (Some(u), Some(vt)) = (svd.u, svd.v_t) else { return Vec::new() };
    // The least singular value's vectors are the translation and its counterpart.
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| svd.singular_values[*b].total_cmp(&svd.singular_values[*a]));
    let column = |k: usize| DVec3::new(u[(0, order[k])], u[(1, order[k])], u[(2, order[k])]);
    let row = |k: usize| DVec3::new(vt[(order[k], 0)], vt[(order[k], 1)], vt[(order[k], 2)]);
    let (u0, u1) = (column(0), column(1));
    let (v0, v1) = (row(0), row(1));
    let (u2, v2) = (u0.cross(u1), v0.cross(v1));
    let v_transposed = DMat3::from_cols(v0, v1, v2).transpose();
    let w_turn = |sign: f64| DMat3::from_cols(u1 * sign, u0 * -sign, u2) * v_transposed;
    let mut all = Vec::with_capacity(4);
    for turn in [w_turn(1.0), w_turn(-1.0)] {
        for t in [u2, -u2] {
            all.push(Pose { rotation: DQuat::from_mat3(&turn), translation: t });
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;

    #[test]
    fn the_true_pose_is_among_those_of_five_points() {
        let mut random = Random::new(7);
        for _ in 0..20 {
            let pose = Pose {
                rotation: DQuat::from_euler(glam::EulerRot::XYZ, random.unit() - 0.5, random.unit() - 0.5, random.unit()),
                translation: DVec3::new(random.normal(), random.normal(), random.normal()).try_normalize().unwrap(),
            };
            let points: Vec<DVec3> =
                (0..5).map(|_| DVec3::new(random.normal(), random.normal(), 6.0 + random.normal())).collect();
            let first: Vec<DVec3> = points.iter().map(|p| *p / p.length()).collect();
            let second: Vec<DVec3> = points.iter().map(|p| pose.to_camera(*p)).map(|p| p / p.length()).collect();
            let best = Solver::new()
                .essentials(&first, &second)
                .iter()
                .flat_map(poses)
                .map(|p| {
                    let turn = (p.rotation.dot(pose.rotation).abs().min(1.0)).acos();
                    turn + (p.translation - pose.translation).length()
                })
                .fold(f64::INFINITY, f64::min);
            assert!(best < 1e-6, "{best}");
        }
    }
}
