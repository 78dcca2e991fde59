//! Fitting a shape's few numbers to what was marked: Levenberg-Marquardt with differences for derivatives and Huber's weights.
//!
//! A shape has at most some thirty numbers, so the normal equations are dense and small, and are solved here.

use super::NamedPoint;
use glam::{DMat3, DVec3};

/// How far a point is off something, metres, by the shape's numbers.
type DistanceOf<'a> = Box<dyn Fn(&[f64], DVec3) -> f64 + 'a>;
/// Where a point should be.
type PlaceOf<'a> = Box<dyn Fn(&[f64]) -> DVec3 + 'a>;
/// By how many pixels an edge is missed.
type PixelsOf<'a> = Box<dyn Fn(&[f64]) -> f64 + 'a>;

/// Something that was marked, and what the shape says of it.
pub(super) enum Witness<'a> {
    /// The point, by its index, lies on something.
    On { point: usize, off_m: DistanceOf<'a> },
    /// The point is a place of the shape.
    At { point: usize, place: PlaceOf<'a> },
    /// An edge in a photograph touches the shape.
    Touches { edge: usize, off_px: PixelsOf<'a> },
}

/// Marked edges are as sharp as this, pixels.
const EDGE_SIGMA_PX: f64 = 1.0;
/// Beyond so many standard deviations what is marked counts less: 95 % as good as least squares where errors are normal (Huber).
const HUBER: f64 = 1.345;
const STEPS: usize = 100;

/// A shape's numbers.
pub(super) struct Fit {
    pub numbers: Vec<f64>,
    /// Standard deviation of each.
    pub sigmas: Vec<f64>,
}

/// How far off what was marked is, in its standard deviations.
fn residuals(witnesses: &[Witness], points: &[NamedPoint], tolerance_m: f64, numbers: &[f64]) -> Vec<[f64; 3]> {
    let of = |witness: &Witness| match witness {
        Witness::On { point, off_m } => {
            let point = &points[*point];
            let normal = gradient(|p| off_m(numbers, p), point.position);
            let variance = normal.dot(point.covariance * normal) + tolerance_m * tolerance_m;
            [off_m(numbers, point.position) / variance.sqrt(), 0.0, 0.0]
        }
        Witness::At { point, place } => {
            let point = &points[*point];
            let covariance = point.covariance + DMat3::from_diagonal(DVec3::splat(tolerance_m * tolerance_m));
            whitened(covariance, point.position - place(numbers)).to_array()
        }
        Witness::Touches { off_px, .. } => [off_px(numbers) / EDGE_SIGMA_PX, 0.0, 0.0],
    };
    witnesses.iter().map(of).collect()
}

/// The difference over a tenth of a millimetre, which is far above rounding a kilometre from the origin and far below any stone.
const PROBE_M: f64 = 1.0e-4;

pub(super) fn gradient(of: impl Fn(DVec3) -> f64, at: DVec3) -> DVec3 {
    let along = |axis: DVec3| (of(at + axis * PROBE_M) - of(at - axis * PROBE_M)) / (2.0 * PROBE_M);
    DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z))
}

/// L^-1 v, the covariance being L L^T: a vector whose length is v's in standard deviations.
fn whitened(covariance: DMat3, v: DVec3) -> DVec3 {
    let c = |row: usize, column: usize| covariance.col(column)[row];
    let l00 = c(0, 0).sqrt();
    let (l10, l20) = (c(1, 0) / l00, c(2, 0) / l00);
    let l11 = (c(1, 1) - l10 * l10).sqrt();
    let l21 = (c(2, 1) - l20 * l10) / l11;
    let l22 = (c(2, 2) - l20 * l20 - l21 * l21).sqrt();
    let x = v.x / l00;
    let y = (v.y - l10 * x) / l11;
    DVec3::new(x, y, (v.z - l20 * x - l21 * y) / l22)
}

/// The sum that is made least, and each witness's weight in the next step.
fn cost(residuals: &[[f64; 3]]) -> (f64, Vec<f64>) {
    let mut sum = 0.0;
    let weight = |r: &[f64; 3]| {
        let length = r.iter().map(|x| x * x).sum::<f64>().sqrt();
        let (cost, weight) =
            if length <= HUBER { (0.5 * length * length, 1.0) } else { (HUBER * (length - 0.5 * HUBER), HUBER / length) };
        sum += cost;
        weight
    };
    let weights = residuals.iter().map(weight).collect();
    (sum, weights)
}

/// The numbers that agree best with all witnesses; none where these leave one of the numbers open.
pub(super) fn fit(witnesses: &[Witness], points: &[NamedPoint], tolerance_m: f64, start: Vec<f64>) -> Option<Fit> {
    let n = start.len();
    let evaluate = |numbers: &[f64]| residuals(witnesses, points, tolerance_m, numbers);
    let mut numbers = start;
    let mut now = evaluate(&numbers);
    let mut damping = 1.0e-4;
    let mut matrix = vec![0.0; n * n];
    for _ in 0..STEPS {
        let (before, weights) = cost(&now);
        if !before.is_finite() {
            return None;
        }
        let columns: Vec<Vec<[f64; 3]>> = (0..n)
            .map(|i| {
                let (mut less, mut more) = (numbers.clone(), numbers.clone());
                less[i] -= PROBE_M;
                more[i] += PROBE_M;
                let (less, more) = (evaluate(&less), evaluate(&more));
                let slope = |(a, b): (&[f64; 3], &[f64; 3])| std::array::from_fn(|k| (b[k] - a[k]) / (2.0 * PROBE_M));
                less.iter().zip(&more).map(slope).collect()
            })
            .collect();
        let product = |a: &[[f64; 3]], b: &[[f64; 3]]| {
            weights.iter().zip(a.iter().zip(b)).map(|(w, (a, b))| w * (0..3).map(|k| a[k] * b[k]).sum::<f64>()).sum::<f64>()
        };
        for row in 0..n {
            for column in 0..n {
                matrix[row * n + column] = product(&columns[row], &columns[column]);
            }
        }
        let slope: Vec<f64> = columns.iter().map(|column| -product(column, &now)).collect();
        let mut better = false;
        while damping < 1.0e12 {
            let mut damped = matrix.clone();
            (0..n).for_each(|i| damped[i * n + i] *= 1.0 + damping);
            let Some(step) = solved(damped, slope.clone()) else {
                damping = (damping * 10.0).max(1.0e-9);
                continue;
            };
            let moved: Vec<f64> = numbers.iter().zip(&step).map(|(x, d)| x + d).collect();
            let there = evaluate(&moved);
            let (after, _) = cost(&there);
            if after < before {
                better = before - after > 1.0e-12 * before;
                (numbers, now) = (moved, there);
                damping = (damping * 0.1).max(1.0e-12);
                break;
            }
            damping *= 10.0;
        }
        if !better {
            break;
        }
    }
    let unit = |i: usize| (0..n).map(|k| f64::from(u8::from(k == i))).collect::<Vec<f64>>();
    let sigmas = (0..n).map(|i| solved(matrix.clone(), unit(i)).map(|column| column[i].max(0.0).sqrt()));
    Some(Fit { numbers, sigmas: sigmas.collect::<Option<_>>()? })
}

/// A pivot below this part of its diagonal entry was lost in rounding: the number that it stands for is open.
const LOST: f64 = 1.0e-11;

/// x of A x = b, A symmetric and positive definite (Cholesky); none where it is not.
pub(crate) fn solved(mut a: Vec<f64>, mut b: Vec<f64>) -> Option<Vec<f64>> {
    let n = b.len();
    for j in 0..n {
        let whole = a[j * n + j];
        let pivot = whole - (0..j).map(|k| a[j * n + k] * a[j * n + k]).sum::<f64>();
        if pivot.is_nan() || pivot <= LOST * whole.abs() || pivot <= 0.0 {
            return None;
        }
        let l = pivot.sqrt();
        a[j * n + j] = l;
        for i in j + 1..n {
            let rest = a[i * n + j] - (0..j).map(|k| a[i * n + k] * a[j * n + k]).sum::<f64>();
            a[i * n + j] = rest / l;
        }
    }
    for i in 0..n {
        let rest = b[i] - (0..i).map(|k| a[i * n + k] * b[k]).sum::<f64>();
        b[i] = rest / a[i * n + i];
    }
    for i in (0..n).rev() {
        let rest = b[i] - (i + 1..n).map(|k| a[k * n + i] * b[k]).sum::<f64>();
        b[i] = rest / a[i * n + i];
    }
    Some(b)
}
