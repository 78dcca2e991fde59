//! Bounced sunlight over the day, told by a few functions.
//!
//! The bounced sunlight of a point is a curve over the T sun steps. Over all points the curves differ little: their principal
//! components, of a sample of points, span nearly all of them (J. Lehtinen, J. Kautz: "Matrix Radiance Transfer", I3D 2003, compress
//! transfer likewise). Bounces are linear and do not mix times, so the direct sunlight of every cell is projected to the R
//! functions first, and only R numbers bounce instead of T: the result is the projection of the full solution, exactly.
//!
//! Curves enter the components divided by their own size, so that shade counts as much as sun: what is kept small is the
//! relative error, which is what is seen once exposure follows the light. Curves too weak to be seen beside direct light count less.
//! And each step enters divided by the square root of the mean over all curves: else a low sun's few lit walls would be left out for the
//! noon's many. (Divided by the mean itself noon would be the one that is left out; the worst step is as good either way.)

use heliodon_math::random::Pcg32;

/// The functions and what they leave out.
#[derive(Clone, Debug, PartialEq)]
pub struct DayFunctions {
    /// R functions of T values.
    pub functions: Vec<Vec<f32>>,
    /// R functions of T values that tell a curve's numbers: number r is the sum over the steps of the curve times the r-th of these. They
    /// are what `functions` are but for a factor for each step; the sum over the steps of one of each is 1 for a pair, 0 for others.
    pub duals: Vec<Vec<f32>>,
    /// Relative error of the sample's curves that are not dark all day, median: root mean square over the day of what is left out, divided by that of
    /// the curve or by half of the mean curve's, whichever is larger; all curves divided step by step by
    /// the square root of their mean.
    pub median_error: f32,
    /// The same, 95th percentile.
    pub p95_error: f32,
}

/// Curves weaker than this part of the mean are weighted as if they were this strong: about a twentieth of all light in a sunny scene, of
/// which a tenth bounces.
const FLOOR: f64 = 0.5;
/// Steps whose mean is less than this part of the largest count as if it were as much.
const DIMMEST: f64 = 0.05;
/// Vectors iterated beyond those asked for, so that the last of these converge too.
const EXTRA: usize = 8;
/// Rounds of subspace iteration; each multiplies what is foreign to the subspace by the ratio of eigenvalues across its edge.
const ROUNDS: usize = 40;

/// Finds at most `most` functions for `curves`, a list of curves of `steps` values; fewer where the 95th percentile of the
/// relative error is already at most `error`.
#[must_use]
pub fn day_functions(curves: &[f32], steps: usize, most: usize, error: f32) -> DayFunctions {
    let none = DayFunctions { functions: Vec::new(), duals: Vec::new(), median_error: 0.0, p95_error: 0.0 };
    if steps == 0 {
        return none;
    }
    let Some(units) = step_units(curves, steps) else {
        // nothing bounces: one function keeps the shape of the result
        let functions = vec![vec![1.0 / (steps as f32).sqrt(); steps]];
        return DayFunctions { duals: functions.clone(), functions, ..none };
    };
    let curves: Vec<f32> = curves
        .chunks_exact(steps)
        .flat_map(|curve| curve.iter().zip(&units).map(|(&x, unit)| (f64::from(x) / unit) as f32))
        .collect();
    let energy: Vec<f64> = curves.chunks_exact(steps).map(|c| c.iter().map(|&x| f64::from(x).powi(2)).sum()).collect();
    let mean = energy.iter().map(|e| e.sqrt()).sum::<f64>() / energy.len().max(1) as f64;
    let size: Vec<f64> = energy.iter().map(|e| e.max((FLOOR * mean).powi(2))).collect();
    let covariance = covariance(&curves, steps, &size);
    let vectors = principal_vectors(&covariance, steps, most.min(steps));

    let mut left = energy.clone();
    let mut found = none;
    for vector in vectors {
        for (left, curve) in left.iter_mut().zip(curves.chunks_exact(steps)) {
            let dot: f64 = vector.iter().zip(curve).map(|(v, &x)| v * f64::from(x)).sum();
            *left = (*left - dot * dot).max(0.0);
        }
        // points that nothing bounces to need no function
        let bounced = left.iter().zip(&size).zip(&energy).filter(|(_, energy)| **energy > 0.0);
        let mut relative: Vec<f64> = bounced.map(|((l, s), _)| (l / s).sqrt()).collect();
        relative.sort_unstable_by(f64::total_cmp);
        let at = |part: f64| relative[((relative.len() - 1) as f64 * part) as usize] as f32;
        found.functions.push(vector.iter().zip(&units).map(|(x, unit)| (x * unit) as f32).collect());
        found.duals.push(vector.iter().zip(&units).map(|(x, unit)| (x / unit) as f32).collect());
        (found.median_error, found.p95_error) = (at(0.5), at(0.95));
        if found.p95_error <= error {
            break;
        }
    }
    found
}

/// What each step is measured in: the square root of the mean over all curves, or of part of the largest mean, as multiples of their root
/// mean square. `None` where all are dark.
fn step_units(curves: &[f32], steps: usize) -> Option<Vec<f64>> {
    let mut sums = vec![0.0; steps];
    for curve in curves.chunks_exact(steps) {
        sums.iter_mut().zip(curve).for_each(|(sum, &x)| *sum += f64::from(x));
    }
    let least = DIMMEST * sums.iter().copied().fold(0.0, f64::max);
    sums.iter_mut().for_each(|sum| *sum = sum.max(least).sqrt());
    let size = (dot(&sums, &sums) / steps as f64).sqrt();
    (size > 0.0).then(|| sums.iter().map(|sum| sum / size).collect())
}

/// The weighted second moments of the curves, T x T.
fn covariance(curves: &[f32], steps: usize, size: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; steps * steps];
    for (curve, size) in curves.chunks_exact(steps).zip(size) {
        for (row, &x) in sum.chunks_exact_mut(steps).zip(curve) {
            if x != 0.0 {
                let x = f64::from(x) / size;
                for (sum, &y) in row.iter_mut().zip(curve) {
                    *sum += x * f64::from(y);
                }
            }
        }
    }
    sum
}

/// The `count` eigenvectors of the largest eigenvalues of a symmetric matrix without negative ones, largest first, by subspace
/// iteration and a Rayleigh-Ritz step.
fn principal_vectors(matrix: &[f64], n: usize, count: usize) -> Vec<Vec<f64>> {
    let width = (count + EXTRA).min(n);
    let mut rng = Pcg32::new(92, 7);
    let mut basis: Vec<Vec<f64>> = (0..width).map(|_| (0..n).map(|_| f64::from(rng.range_f32(-1.0, 1.0))).collect()).collect();
    orthonormalise(&mut basis);
    for _ in 0..ROUNDS {
        for vector in &mut basis {
            *vector = times(matrix, vector);
        }
        orthonormalise(&mut basis);
    }
    let images: Vec<Vec<f64>> = basis.iter().map(|v| times(matrix, v)).collect();
    let small: Vec<Vec<f64>> = basis.iter().map(|a| images.iter().map(|b| dot(a, b)).collect()).collect();
    let (values, rotation) = jacobi(small);
    let mut order: Vec<usize> = (0..basis.len()).collect();
    order.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
    order
        .into_iter()
        .take(count)
        .map(|k| {
            let mut vector = vec![0.0; n];
            for (row, b) in rotation.iter().zip(&basis) {
                for (v, b) in vector.iter_mut().zip(b) {
                    *v += row[k] * b;
                }
            }
            let sign = if vector.iter().sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
            vector.iter().map(|v| v * sign).collect()
        })
        .collect()
}

fn times(matrix: &[f64], vector: &[f64]) -> Vec<f64> {
    matrix.chunks_exact(vector.len()).map(|row| dot(row, vector)).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Gram-Schmidt, twice over for accuracy; what vanishes is dropped.
fn orthonormalise(vectors: &mut Vec<Vec<f64>>) {
    let mut done: Vec<Vec<f64>> = Vec::with_capacity(vectors.len());
    for mut vector in vectors.drain(..) {
        let before = dot(&vector, &vector).sqrt();
        for _ in 0..2 {
            for other in &done {
                let part = dot(&vector, other);
                vector.iter_mut().zip(other).for_each(|(v, o)| *v -= part * o);
            }
        }
        let length = dot(&vector, &vector).sqrt();
        // below the rounding of the subtraction nothing of the vector's own is left
        if length > before * 1e-14 {
            vector.iter_mut().for_each(|v| *v /= length);
            done.push(vector);
        }
    }
    *vectors = done;
}

/// Eigenvalues and eigenvectors (in columns) of a small symmetric matrix by cyclic Jacobi rotations (G. Golub, C. Van Loan:
/// "Matrix Computations", 4th ed., section 8.5).
fn jacobi(mut a: Vec<Vec<f64>>) -> (Vec<f64>, Vec<Vec<f64>>) {
    let n = a.len();
    let mut v: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    for _ in 0..30 {
        let off: f64 = (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| a[i][j] * a[i][j]).sum();
        let diagonal: f64 = (0..n).map(|i| a[i][i] * a[i][i]).sum();
        if off <= diagonal * 1e-28 {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                if a[p][q] == 0.0 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for row in &mut a {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
                let (before_q, from_q) = a.split_at_mut(q);
                for (x, y) in before_q[p].iter_mut().zip(&mut from_q[0]) {
                    (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
                }
                for row in &mut v {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
            }
        }
    }
    ((0..n).map(|i| a[i][i]).collect(), v)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mixed_curves(steps: usize, functions: usize, count: usize) -> Vec<f32> {
        let mut rng = Pcg32::new(5, 5);
        let mut curves = Vec::new();
        for _ in 0..count {
            let weights: Vec<f32> = (0..functions).map(|_| rng.range_f32(0.1, 1.0)).collect();
            for t in 0..steps {
                let x = t as f32 / steps as f32;
                curves.push(weights.iter().enumerate().map(|(k, w)| w * (1.0 + libm::cosf(x * (k + 1) as f32))).sum());
            }
        }
        curves
    }

    #[test]
    fn curves_of_three_dimensions_need_three_functions() {
        let curves = mixed_curves(92, 3, 200);
        let found = day_functions(&curves, 92, 8, 1e-4);
        assert_eq!(found.functions.len(), 3);
        assert!(found.p95_error < 1e-3, "{}", found.p95_error);
        for (i, a) in found.functions.iter().enumerate() {
            for (j, b) in found.duals.iter().enumerate() {
                let dot: f32 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                assert!((dot - f32::from(u8::from(i == j))).abs() < 1e-5, "<{i}, {j}> = {dot}");
            }
        }
    }

    #[test]
    fn functions_are_the_best_that_can_be_had() {
        // four curves along the first axis, three along the second, two along the third: sizes do not count
        let [x, y, z] = [[2.0_f32, 0.0, 0.0], [0.0, 2.1, 0.0], [0.0, 0.0, 2.0]];
        let curves = [x, y, z, x, y, x, z, y, x];
        let found = day_functions(curves.as_flattened(), 3, 2, 0.0);
        for (k, (function, dual)) in found.functions.iter().zip(&found.duals).enumerate() {
            assert!((function[k] * dual[k] - 1.0).abs() < 1e-6, "{function:?} {dual:?}");
        }
        assert!(found.median_error < 1e-6 && found.p95_error > 0.9, "{} {}", found.median_error, found.p95_error);
    }

    #[test]
    fn a_day_of_one_step_is_exact_and_darkness_has_a_shape() {
        let one = day_functions(&[0.5, 2.0, 0.1], 1, 8, 0.01);
        assert_eq!(one.functions, [[1.0]]);
        assert_eq!(one.median_error, 0.0);
        assert_eq!(day_functions(&[0.0; 12], 4, 8, 0.01).functions, [[0.5; 4]]);
        assert_eq!(day_functions(&[], 4, 8, 0.01).functions.len(), 1);
        assert!(day_functions(&[], 0, 8, 0.01).functions.is_empty());
    }
}
