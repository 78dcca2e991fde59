//! What fits of all kinds of shapes share: names looked up, small geometry, and how residuals are told.

use super::body::Body;
use super::fit::{Fit, Witness, gradient};
use super::table::ShapeRow;
use super::{EdgeResidual, ModelError, NamedPoint, PointResidual, ShownBy};
use crate::camera::Camera;
use glam::{DMat3, DVec2, DVec3};
use std::collections::BTreeMap;

/// A number of a fitted shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measure {
    /// What it is, with its unit.
    pub name: &'static str,
    /// The number.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// A shape after its fit.
pub(super) struct Fitted {
    pub body: Body,
    pub points: Vec<PointResidual>,
    pub edges: Vec<EdgeResidual>,
    pub measures: Vec<Measure>,
    pub notes: Vec<String>,
}

/// What names in a row stand for.
pub(super) struct Names<'a> {
    pub shape: &'a str,
    pub points: &'a BTreeMap<&'a str, usize>,
    pub photographs: &'a [(String, Camera)],
    pub tolerance_m: f64,
}

/// How far stone is from a plane or a circle where the row says nothing: a hand-dressed block's bow.
const TOLERANCE_M: f64 = 0.005;

impl<'a> Names<'a> {
    /// Those of a row.
    pub fn of(row: &'a ShapeRow, points: &'a BTreeMap<&'a str, usize>, photographs: &'a [(String, Camera)]) -> Self {
        Self { shape: &row.name, points, photographs, tolerance_m: row.tolerance_m.unwrap_or(TOLERANCE_M) }
    }

    pub fn point(&self, name: &str) -> Result<usize, ModelError> {
        let unknown = || ModelError::Point { shape: self.shape.into(), point: name.into() };
        self.points.get(name).copied().ok_or_else(unknown)
    }

    pub fn points(&self, names: &[String]) -> Result<Vec<usize>, ModelError> {
        names.iter().map(|name| self.point(name)).collect()
    }

    pub fn pair(&self, names: &[String; 2]) -> Result<[usize; 2], ModelError> {
        Ok([self.point(&names[0])?, self.point(&names[1])?])
    }

    pub fn photograph(&self, name: &str) -> Result<usize, ModelError> {
        let unknown = || ModelError::Photograph { shape: self.shape.into(), photograph: name.into() };
        self.photographs.iter().position(|(known, _)| known == name).ok_or_else(unknown)
    }

    pub fn refused(&self, why: String) -> ModelError {
        ModelError::Shape { shape: self.shape.into(), why }
    }

    /// How far each point is from where the shape has it, in metres and in the photographs that show it.
    pub fn fitted(
        &self,
        body: Body,
        witnesses: &[Witness],
        points: &[NamedPoint],
        numbers: &[f64],
        measures: Vec<Measure>,
    ) -> Fitted {
        let mut nearest: BTreeMap<usize, DVec3> = BTreeMap::new();
        let mut edges: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
        for witness in witnesses {
            match witness {
                Witness::At { point, place } => *nearest.entry(*point).or_default() += place(numbers) - points[*point].position,
                Witness::On { point, off_m } => {
                    let at = points[*point].position;
                    let normal = gradient(|p| off_m(numbers, p), at);
                    let step = normal * (off_m(numbers, at) / normal.length_squared().max(1.0e-12));
                    *nearest.entry(*point).or_default() -= step;
                }
                Witness::Touches { edge, off_px } => {
                    let entry = edges.entry(*edge).or_default();
                    *entry = (entry.0 + off_px(numbers) * off_px(numbers), entry.1 + 1.0);
                }
            }
        }
        let points = nearest.into_iter().map(|(point, off)| self.residual(&points[point], off)).collect();
        let edge = |(edge, (sum, count)): (usize, (f64, f64))| EdgeResidual { edge, off_px: (sum / count).sqrt() };
        Fitted { body, points, edges: edges.into_iter().map(edge).collect(), measures, notes: Vec::new() }
    }

    /// A point and how far the shape is from it.
    pub fn residual(&self, point: &NamedPoint, off: DVec3) -> PointResidual {
        let in_photograph = |&photograph: &usize| {
            let (name, camera) = self.photographs.get(photograph)?;
            let off_px = camera.project(point.position)?.distance(camera.project(point.position + off)?);
            Some(ShownBy { photograph: name.clone(), off_px })
        };
        let direction = off.try_normalize().unwrap_or(DVec3::Y);
        let sigma = (direction.dot(point.covariance * direction) + self.tolerance_m * self.tolerance_m).sqrt();
        PointResidual {
            point: point.name.clone(),
            off_m: off.length(),
            sigmas: off.length() / sigma,
            photographs: point.seen_in.iter().filter_map(in_photograph).collect(),
        }
    }
}

/// How a fit's number is told.
pub(super) fn measure(name: &'static str, fit: &Fit, number: usize) -> Measure {
    Measure { name, value: fit.numbers[number], sigma: fit.sigmas[number] }
}

/// The turn about a vector by its length, radians (Rodrigues).
pub(super) fn rotation(about: DVec3) -> DMat3 {
    let angle = about.length();
    let Some(axis) = about.try_normalize() else { return DMat3::IDENTITY };
    let cross =
        DMat3::from_cols(DVec3::new(0.0, axis.z, -axis.y), DVec3::new(-axis.z, 0.0, axis.x), DVec3::new(axis.y, -axis.x, 0.0));
    DMat3::IDENTITY + cross * libm::sin(angle) + cross * cross * (1.0 - libm::cos(angle))
}

pub(super) fn turned_about_up(angle_rad: f64) -> DMat3 {
    rotation(DVec3::Y * angle_rad)
}

/// A right-handed frame whose y is given.
pub(super) fn frame_about(axis: DVec3) -> DMat3 {
    let x = axis.any_orthonormal_vector();
    DMat3::from_cols(x, axis, x.cross(axis))
}

/// The plane that is nearest to points, each weighted: its middle and unit normal. The normal is the eigenvector of the least eigenvalue of the points'
/// scatter, found by Jacobi's rotations; none where points are on a line.
pub(super) fn best_plane(points: &[(DVec3, f64)]) -> Option<(DVec3, DVec3)> {
    let weight: f64 = points.iter().map(|(_, weight)| weight).sum();
    let middle = points.iter().map(|(p, weight)| *p * *weight).sum::<DVec3>() / weight;
    let mut scatter = DMat3::ZERO;
    for (p, weight) in points {
        let d = *p - middle;
        scatter += DMat3::from_cols(d * d.x, d * d.y, d * d.z) * (*weight / points.iter().map(|(_, w)| w).sum::<f64>());
    }
    let (values, vectors) = eigen(scatter);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let [_, second, third] = order.map(|i| values[i]);
    // on a line: spread across it is what rounding leaves
    (second > 1.0e-12 * third && third > 0.0).then(|| (middle, vectors.col(order[0])))
}

/// Eigenvalues and, as columns, eigenvectors of a symmetric matrix.
fn eigen(mut a: DMat3) -> (DVec3, DMat3) {
    let mut vectors = DMat3::IDENTITY;
    // each sweep squares what is off the diagonal
    for _ in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let off = a.col(q)[p];
            if off == 0.0 {
                continue;
            }
            let theta = (a.col(q)[q] - a.col(p)[p]) / (2.0 * off);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            let mut turn = DMat3::IDENTITY;
            turn.col_mut(p)[p] = c;
            turn.col_mut(q)[q] = c;
            turn.col_mut(q)[p] = s;
            turn.col_mut(p)[q] = -s;
            a = turn.transpose() * a * turn;
            vectors *= turn;
        }
    }
    (DVec3::new(a.col(0)[0], a.col(1)[1], a.col(2)[2]), vectors)
}

/// The circle through points of a plane, least squares of the algebraic distance (Kasa): its middle and radius.
pub(super) fn circle(points: &[DVec2]) -> Option<(DVec2, f64)> {
    let n = points.len() as f64;
    let mean = points.iter().sum::<DVec2>() / n;
    let mut a = vec![0.0; 4];
    let mut b = vec![0.0; 2];
    for p in points.iter().map(|p| *p - mean) {
        let half = 0.5 * p.length_squared();
        for (row, x) in p.to_array().into_iter().enumerate() {
            b[row] += x * half;
            a[row * 2] += x * p.x;
            a[row * 2 + 1] += x * p.y;
        }
    }
    let centre = DVec2::from_slice(&super::fit::solved(a, b)?);
    let square = points.iter().map(|p| (*p - mean - centre).length_squared()).sum::<f64>() / n;
    Some((mean + centre, square.sqrt()))
}

/// The circle through points of space that lie about in a plane: middle, unit normal, radius.
pub(super) fn circle_in_space(points: &[DVec3]) -> Option<(DVec3, DVec3, f64)> {
    let (middle, normal) = best_plane(&points.iter().map(|p| (*p, 1.0)).collect::<Vec<_>>())?;
    let x = normal.any_orthonormal_vector();
    let y = normal.cross(x);
    let flat: Vec<DVec2> = points.iter().map(|p| *p - middle).map(|p| DVec2::new(p.dot(x), p.dot(y))).collect();
    let (centre, radius) = circle(&flat)?;
    Some((middle + x * centre.x + y * centre.y, normal, radius))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leaning_circle_is_found() {
        let frame = rotation(DVec3::new(0.4, -0.2, 1.1));
        let middle = DVec3::new(100.0, 2.0, -50.0);
        let place = |angle: f64| middle + frame * DVec3::new(libm::cos(angle), 0.0, libm::sin(angle)) * 3.0;
        let points: Vec<DVec3> = [0.1, 0.9, 1.4, 2.8].map(place).to_vec();
        let (found, normal, radius) = circle_in_space(&points).unwrap();
        assert!(found.distance(middle) < 1e-9 && (radius - 3.0).abs() < 1e-9);
        assert!(normal.cross(frame.col(1)).length() < 1e-9);
        assert!(best_plane(&[(DVec3::ZERO, 1.0), (DVec3::X, 1.0), (DVec3::X * 3.0, 2.0)]).is_none());
    }
}
