//! How sure cameras, lenses and points are: blocks of the inverse of the normal equations.
//!
//! Photographs alone fix no place, turn or scale of the whole. The inverse is first taken with the cameras' mean held, then carried over to
//! whatever datum the alignment uses (the S-transformation of W. Baarda: S-transformations and criterion matrices, 1973): near known points
//! what is solved is surer than far from them.

use super::normal::{Equations, Structure, unit_diagonal};
use super::{LENS_UNKNOWNS, Loss, Network};
use glam::{DMat2, DMat3, DVec3};
use nalgebra::{DMatrix, Matrix3xX, SMatrix};
use rayon::prelude::*;

/// Seven: shift, turn and scale of the whole.
pub const GAUGE: usize = 7;

/// How the datum moves with a point: the change of the similarity (shift, turn vector, logarithm of scale) that an alignment would apply if
/// this point moved, one column an axis.
pub type DatumSlope = SMatrix<f64, GAUGE, 3>;

/// Covariances of what was adjusted, for marks of the standard deviations that their weights say.
#[derive(Clone, Debug)]
pub struct Covariances {
    /// Of the views' six unknowns (turn in the camera's space, shift of the translation); zero for a held view.
    pub views: Vec<SMatrix<f64, 6, 6>>,
    /// Standard deviations of the lenses' unknowns; zero for what is held.
    pub lenses: Vec<[f64; LENS_UNKNOWNS]>,
    /// Of the points, in square world units.
    pub points: Vec<DMat3>,
    /// Of the views' centres, in square world units.
    pub centres: Vec<DMat3>,
}

/// The inverse of a converged network's normal equations, from which all else is read.
pub struct Inverse<'a> {
    network: &'a Network,
    structure: Structure,
    equations: Equations,
    points: Vec<DMat3>,
    cameras: DMatrix<f64>,
    held: bool,
}

impl<'a> Inverse<'a> {
    /// `None` where the equations leave something undetermined besides place, turn and scale of the whole.
    #[must_use]
    pub fn of(network: &'a Network) -> Option<Self> {
        let structure = Structure::of(network);
        let equations = Equations::build(network, &structure, Loss::Squared);
        let points = equations.point_inverses(0.0)?;
        let mut reduced = equations.reduced(&structure, &points);
        let n = structure.size;
        let scale = unit_diagonal(&mut reduced)?;
        let held = network.views.iter().any(|v| v.fixed) || network.points.iter().any(|p| p.fixed || p.known.is_some());
        let free = if held { DMatrix::zeros(n, 0) } else { orthonormal(scaled_gauge(network, &structure, &scale)) };
        // The unit diagonal makes 1 a fair stiffness of the gauge's own directions.
        for j in 0..n {
            for i in j..n {
                reduced[(i, j)] += (0..free.ncols()).map(|k| free[(i, k)] * free[(j, k)]).sum::<f64>();
            }
        }
        let mut cameras = reduced.cholesky()?.inverse();
        cameras -= &free * free.transpose();
        for j in 0..n {
            for i in 0..n {
                cameras[(i, j)] *= scale[i] * scale[j];
            }
        }
        cameras.iter().all(|v| v.is_finite()).then_some(Self { network, structure, equations, points, cameras, held })
    }

    /// The covariance of a point's picture in a view, for marks of the standard deviations that their weights say: how much of a mark's noise
    /// the solution follows. The pair may but need not have been marked.
    #[must_use]
    pub fn picture(&self, view: usize, point: usize) -> Option<DMat2> {
        let camera = self.network.camera(view);
        let projection = super::jacobian::project(&camera, self.network.points[point].position)?;
        let by_point = SMatrix::<f64, 2, 3>::from_fn(|i, j| projection.point[i][j]);
        let own = by_point * matrix3(&self.points[point]) * by_point.transpose();
        // The point answers to its cameras: dX = -V^-1 W^T dc.
        let mut row: std::collections::BTreeMap<usize, [f64; 2]> = std::collections::BTreeMap::new();
        for (offset, size, coupling) in self.equations.couplings(&self.structure, point) {
            for i in 0..size {
                let moved = self.points[point] * coupling[i];
                row.insert(offset + i, [0, 1].map(|k| -DVec3::from(projection.point[k]).dot(moved)));
            }
        }
        let mut add = |at: usize, by: [f64; 2]| {
            let entry = row.entry(at).or_insert([0.0; 2]);
            *entry = [entry[0] + by[0], entry[1] + by[1]];
        };
        if let Some(range) = self.structure.view_range(view) {
            range.enumerate().for_each(|(i, at)| add(at, [projection.pose[0][i], projection.pose[1][i]]));
        }
        if let Some((range, columns)) = self.structure.lens_range(self.network.views[view].lens) {
            range.zip(columns).for_each(|(at, &c)| add(at, [projection.lens[0][c], projection.lens[1][c]]));
        }
        let mut sum = [[own[(0, 0)], own[(0, 1)]], [own[(1, 0)], own[(1, 1)]]];
        for (&i, a) in &row {
            for (&j, b) in &row {
                let c = self.cameras[(i, j)];
                for k in 0..2 {
                    for l in 0..2 {
                        sum[k][l] += a[k] * c * b[l];
                    }
                }
            }
        }
        Some(DMat2::from_cols_array(&[sum[0][0], sum[1][0], sum[0][1], sum[1][1]]))
    }

    /// All covariances. `datum` gives the points on which the alignment rests; without any, the cameras' mean is the datum.
    #[must_use]
    pub fn covariances(&self, datum: &[(usize, DatumSlope)]) -> Covariances {
        let Self { network, structure, equations, points: inverses, cameras: inverse, held } = self;
        let n = structure.size;
        // delta, the datum's answer to all points: its covariance with the cameras and with itself.
        let mut gathered = DMatrix::zeros(n, GAUGE);
        let mut own = SMatrix::<f64, GAUGE, GAUGE>::zeros();
        let datum = if *held { &[][..] } else { datum };
        for (point, slope) in datum {
            let v = matrix3(&inverses[*point]);
            let pulled = slope * v;
            own += pulled * slope.transpose();
            for (offset, size, coupling) in equations.couplings(structure, *point) {
                for i in 0..size {
                    for k in 0..GAUGE {
                        gathered[(offset + i, k)] += (0..3).map(|a| coupling[i][a] * pulled[(k, a)]).sum::<f64>();
                    }
                }
            }
        }
        let through = inverse * &gathered;
        let delta = own + SMatrix::<f64, GAUGE, GAUGE>::from_fn(|i, j| gathered.column(i).dot(&through.column(j)));
        let gauge = view_gauge(network);
        let views: Vec<SMatrix<f64, 6, 6>> = (0..network.views.len())
            .map(|view| {
                let Some(range) = structure.view_range(view) else { return SMatrix::zeros() };
                let plain = SMatrix::<f64, 6, 6>::from_fn(|i, j| inverse[(range.start + i, range.start + j)]);
                let crossed = SMatrix::<f64, 6, GAUGE>::from_fn(|i, k| -through[(range.start + i, k)]);
                let mixed = crossed * gauge[view].transpose();
                plain + gauge[view] * delta * gauge[view].transpose() + mixed + mixed.transpose()
            })
            .collect();
        let lenses = (0..network.lenses.len())
            .map(|lens| {
                let mut sigmas = [0.0; LENS_UNKNOWNS];
                if let Some((range, columns)) = structure.lens_range(lens) {
                    for (at, &column) in range.zip(columns) {
                        sigmas[column] = inverse[(at, at)].max(0.0).sqrt();
                    }
                }
                sigmas
            })
            .collect();
        let slopes: std::collections::BTreeMap<usize, &DatumSlope> = datum.iter().map(|(p, s)| (*p, s)).collect();
        let points = (0..network.points.len())
            .into_par_iter()
            .map(|point| {
                let v = matrix3(&inverses[point]);
                let gauge = point_gauge(network.points[point].position);
                // V^-1 W^T, 3 rows by the coupled unknowns
                let coupled: Vec<(usize, DVec3)> = equations
                    .couplings(structure, point)
                    .flat_map(|(offset, size, c)| (0..size).map(move |i| (offset + i, c[i])))
                    .map(|(at, c)| (at, inverses[point] * c))
                    .collect();
                let mut pulled = Matrix3xX::zeros(coupled.len());
                for (column, (_, c)) in coupled.iter().enumerate() {
                    pulled.column_mut(column).copy_from_slice(&c.to_array());
                }
                let block = DMatrix::from_fn(coupled.len(), coupled.len(), |i, j| inverse[(coupled[i].0, coupled[j].0)]);
                let plain = v + &pulled * block * pulled.transpose();
                let rows = DMatrix::from_fn(coupled.len(), GAUGE, |i, k| through[(coupled[i].0, k)]);
                let mut crossed = SMatrix::<f64, 3, GAUGE>::zeros();
                crossed += &pulled * rows;
                if let Some(slope) = slopes.get(&point) {
                    crossed += v * slope.transpose();
                }
                let mixed = crossed * gauge.transpose();
                let all = plain + gauge * delta * gauge.transpose() + mixed + mixed.transpose();
                DMat3::from_cols_array(&std::array::from_fn(|i| all[(i % 3, i / 3)]))
            })
            .collect();
        let centres = (0..network.views.len()).map(|view| centre_covariance(network, view, &views[view])).collect();
        Covariances { views, lenses, points, centres }
    }
}

/// The centre is -R^T t: a turn w moves it by R^T (w x t), a shift by -R^T.
fn centre_covariance(network: &Network, view: usize, covariance: &SMatrix<f64, 6, 6>) -> DMat3 {
    let pose = network.views[view].pose;
    let back = DMat3::from_quat(pose.rotation).transpose();
    let mut slope = SMatrix::<f64, 3, 6>::zeros();
    for axis in 0..3 {
        let turned = back * DVec3::AXES[axis].cross(pose.translation);
        let shifted = back * -DVec3::AXES[axis];
        slope.column_mut(axis).copy_from_slice(&turned.to_array());
        slope.column_mut(axis + 3).copy_from_slice(&shifted.to_array());
    }
    let all = slope * covariance * slope.transpose();
    DMat3::from_cols_array(&std::array::from_fn(|i| all[(i % 3, i / 3)]))
}

fn matrix3(m: &DMat3) -> SMatrix<f64, 3, 3> {
    SMatrix::from_column_slice(&m.to_cols_array())
}

/// How a point moves with shift, turn and scale of the whole.
fn point_gauge(point: DVec3) -> SMatrix<f64, 3, GAUGE> {
    let mut gauge = SMatrix::<f64, 3, GAUGE>::zeros();
    for axis in 0..3 {
        gauge[(axis, axis)] = 1.0;
        let turned = DVec3::AXES[axis].cross(point);
        gauge.column_mut(axis + 3).copy_from_slice(&turned.to_array());
    }
    gauge.column_mut(6).copy_from_slice(&point.to_array());
    gauge
}

/// How the views' unknowns move with it, so that every picture stays.
fn view_gauge(network: &Network) -> Vec<SMatrix<f64, 6, GAUGE>> {
    let of = |pose: &crate::camera::Pose| {
        let mut gauge = SMatrix::<f64, 6, GAUGE>::zeros();
        for axis in 0..3 {
            let turned = pose.rotation * -DVec3::AXES[axis];
            for i in 0..3 {
                gauge[(i + 3, axis)] = turned[i];
                gauge[(i, axis + 3)] = turned[i];
            }
        }
        for i in 0..3 {
            gauge[(i + 3, 6)] = pose.translation[i];
        }
        gauge
    };
    network.views.iter().map(|v| of(&v.pose)).collect()
}

/// The gauge's directions in the scaled unknowns.
fn scaled_gauge(network: &Network, structure: &Structure, scale: &nalgebra::DVector<f64>) -> DMatrix<f64> {
    let mut gauge = DMatrix::zeros(structure.size, GAUGE);
    for (view, part) in view_gauge(network).iter().enumerate() {
        if let Some(range) = structure.view_range(view) {
            gauge.view_mut((range.start, 0), (6, GAUGE)).copy_from(part);
        }
    }
    if let Some(range) = structure.frame_range() {
        for axis in 0..3 {
            gauge[(range.start + axis, axis + 3)] = 1.0;
        }
    }
    for i in 0..structure.size {
        for k in 0..GAUGE {
            gauge[(i, k)] /= scale[i];
        }
    }
    gauge
}

/// Gram-Schmidt, twice for digits; directions that add nothing are left out.
fn orthonormal(mut columns: DMatrix<f64>) -> DMatrix<f64> {
    let mut kept: Vec<usize> = Vec::new();
    for k in 0..columns.ncols() {
        let before = columns.column(k).norm();
        for _ in 0..2 {
            for &j in &kept {
                let along = columns.column(k).dot(&columns.column(j));
                let other = columns.column(j).clone_owned();
                columns.column_mut(k).axpy(-along, &other, 1.0);
            }
        }
        let norm = columns.column(k).norm();
        if norm > 1e-9 * before {
            columns.column_mut(k).unscale_mut(norm);
            kept.push(k);
        }
    }
    columns.select_columns(&kept)
}
