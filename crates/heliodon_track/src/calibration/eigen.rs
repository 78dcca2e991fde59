//! Eigenvalues of small symmetric matrices by Jacobi's rotations.
//!
//! Golub, Van Loan: "Matrix Computations", 4th edition, 2013, section 8.5. Square roots, products and sums alone: the same bits
//! everywhere.

/// Sweeps over all pairs of rows; convergence is quadratic, and matrices of this size need five or six.
const SWEEPS: usize = 32;

/// The eigenvalues of a symmetric matrix, each with its eigenvector of length one, the largest first.
pub(super) fn symmetric<const N: usize>(mut a: [[f64; N]; N]) -> [(f64, [f64; N]); N] {
    let mut v = [[0.0; N]; N];
    (0..N).for_each(|i| v[i][i] = 1.0);
    for _ in 0..SWEEPS {
        for p in 0..N {
            for q in p + 1..N {
                let (c, s) = rotation(a[p][p], a[p][q], a[q][q]);
                // a <- J^T a J, v <- v J
                for row in a.iter_mut().chain(&mut v) {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
                let (row_p, row_q) = (a[p], a[q]);
                a[p] = std::array::from_fn(|k| c * row_p[k] - s * row_q[k]);
                a[q] = std::array::from_fn(|k| s * row_p[k] + c * row_q[k]);
            }
        }
    }
    let mut pairs: [(f64, [f64; N]); N] = std::array::from_fn(|i| (a[i][i], v.map(|row| row[i])));
    pairs.sort_by(|one, other| other.0.total_cmp(&one.0));
    pairs
}

/// Cosine and sine of the rotation that makes the element beside the diagonal zero (section 8.5.2).
fn rotation(pp: f64, pq: f64, qq: f64) -> (f64, f64) {
    if pq == 0.0 {
        return (1.0, 0.0);
    }
    let tau = (qq - pp) / (2.0 * pq);
    let t = 1.0_f64.copysign(tau) / (tau.abs() + (1.0 + tau * tau).sqrt());
    let c = 1.0 / (1.0 + t * t).sqrt();
    (c, t * c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::random::Pcg32;

    #[test]
    fn eigenvectors_are_stretched_by_their_eigenvalues() {
        let mut rng = Pcg32::new(3, 1);
        for _ in 0..200 {
            let numbers: [[f64; 4]; 4] = [(); 4].map(|()| [(); 4].map(|()| f64::from(rng.range_f32(-10.0, 10.0))));
            let a: [[f64; 4]; 4] = std::array::from_fn(|i: usize| std::array::from_fn(|k: usize| numbers[i.min(k)][i.max(k)]));
            let pairs = symmetric(a);
            for (value, vector) in pairs {
                assert!((vector.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
                for (row, x) in a.iter().zip(vector) {
                    let stretched: f64 = row.iter().zip(vector).map(|(a, v)| a * v).sum();
                    assert!((stretched - value * x).abs() < 1e-11);
                }
            }
            assert!(pairs.windows(2).all(|two| two[0].0 >= two[1].0));
        }
    }

    #[test]
    fn a_matrix_of_zeros_has_axes_all_the_same() {
        assert_eq!(symmetric([[0.0; 3]; 3]).map(|(value, _)| value), [0.0; 3]);
    }
}
