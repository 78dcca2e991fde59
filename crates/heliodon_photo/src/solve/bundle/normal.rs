//! The normal equations in blocks, and their solution with the points eliminated.

use super::jacobian::project;
use super::{LENS_UNKNOWNS, Loss, Network, edge, rotation_from_vector, unknowns, with_unknowns};
use glam::{DMat3, DVec3};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::ops::Range;

/// The most unknowns of one block: a lens.
const MAX_BLOCK: usize = LENS_UNKNOWNS;

/// A block of what a point's coordinates are coupled to: unknowns of a view or a lens, by the point's three.
pub(super) type Coupling = [DVec3; MAX_BLOCK];

/// Unknowns that belong together: a view's six, a lens's, the frame's three.
#[derive(Clone, Debug)]
struct Block {
    offset: usize,
    size: usize,
    /// (point, number in its list) of all points that this block is coupled to.
    coupled: Vec<(usize, usize)>,
}

/// Which unknown stands where, and which marks belong to which point and view; the same for all steps of an adjustment.
#[derive(Clone, Debug)]
pub(super) struct Structure {
    blocks: Vec<Block>,
    /// The blocks of views (none of a held one) and of lenses (none without free unknowns).
    view_block: Vec<Option<usize>>,
    lens_block: Vec<Option<usize>>,
    frame_block: Option<usize>,
    columns: Vec<Vec<usize>>,
    /// Unknowns besides the points'.
    pub(super) size: usize,
    observations_of_view: Vec<Vec<usize>>,
    observations_of_point: Vec<Vec<usize>>,
    /// The blocks that a point is coupled to, rising; none for a held point.
    blocks_of_point: Vec<Vec<usize>>,
}

impl Structure {
    pub(super) fn of(network: &Network) -> Self {
        let mut blocks: Vec<Block> = Vec::new();
        let mut size = 0;
        let mut add = |unknowns: usize| {
            if unknowns == 0 {
                return None;
            }
            blocks.push(Block { offset: size, size: unknowns, coupled: Vec::new() });
            size += unknowns;
            Some(blocks.len() - 1)
        };
        let mut observations_of_view = vec![Vec::new(); network.views.len()];
        let mut observations_of_point = vec![Vec::new(); network.points.len()];
        for (i, o) in network.observations.iter().enumerate() {
            observations_of_view[o.view].push(i);
            observations_of_point[o.point].push(i);
        }
        let mut used = vec![false; network.lenses.len()];
        network.observations.iter().for_each(|o| used[network.views[o.view].lens] = true);
        network.segments.iter().for_each(|s| used[network.views[s.view].lens] = true);
        let view_block: Vec<_> = network.views.iter().map(|v| add(if v.fixed { 0 } else { 6 })).collect();
        let columns: Vec<_> =
            network.lenses.iter().zip(&used).map(|(l, &used)| if used { l.free.columns() } else { Vec::new() }).collect();
        let lens_block: Vec<_> = columns.iter().map(|c| add(c.len())).collect();
        let frame_block = add(if network.segments.is_empty() || network.frame_fixed { 0 } else { 3 });
        let mut blocks_of_point = Vec::with_capacity(network.points.len());
        for (index, point) in network.points.iter().enumerate() {
            let mut coupled: Vec<usize> = Vec::new();
            if !point.fixed {
                for &o in &observations_of_point[index] {
                    let view = network.observations[o].view;
                    coupled.extend(view_block[view]);
                    coupled.extend(lens_block[network.views[view].lens]);
                }
                coupled.sort_unstable();
                coupled.dedup();
                for (number, &block) in coupled.iter().enumerate() {
                    blocks[block].coupled.push((index, number));
                }
            }
            blocks_of_point.push(coupled);
        }
        Self {
            blocks,
            view_block,
            lens_block,
            frame_block,
            columns,
            size,
            observations_of_view,
            observations_of_point,
            blocks_of_point,
        }
    }

    fn range(&self, block: Option<usize>) -> Option<Range<usize>> {
        block.map(|b| self.blocks[b].offset..self.blocks[b].offset + self.blocks[b].size)
    }

    /// Where a view's six unknowns stand.
    pub(super) fn view_range(&self, view: usize) -> Option<Range<usize>> {
        self.range(self.view_block[view])
    }

    /// Where a lens's unknowns stand, and which they are.
    pub(super) fn lens_range(&self, lens: usize) -> Option<(Range<usize>, &[usize])> {
        Some((self.range(self.lens_block[lens])?, &self.columns[lens]))
    }

    /// Where the frame's three unknowns stand.
    pub(super) fn frame_range(&self) -> Option<Range<usize>> {
        self.range(self.frame_block)
    }
}

/// A point's part: its own block of the normal equations, its gradient, and what it is coupled to.
#[derive(Clone, Debug)]
struct PointPart {
    own: DMat3,
    gradient: DVec3,
    couplings: Vec<Coupling>,
}

/// J^T J and J^T r at one state of the network.
#[derive(Clone, Debug)]
pub(super) struct Equations {
    cameras: DMatrix<f64>,
    gradient: DVector<f64>,
    points: Vec<PointPart>,
}

/// What one view adds to the cameras' own part.
struct ViewPart {
    pose: [[f64; 6]; 6],
    mixed: [[f64; LENS_UNKNOWNS]; 6],
    lens: [[f64; LENS_UNKNOWNS]; LENS_UNKNOWNS],
    pose_gradient: [f64; 6],
    lens_gradient: [f64; LENS_UNKNOWNS],
}

impl Equations {
    pub(super) fn build(network: &Network, structure: &Structure, loss: Loss) -> Self {
        let points: Vec<PointPart> =
            (0..network.points.len()).into_par_iter().map(|p| point_part(network, structure, loss, p)).collect();
        let views: Vec<ViewPart> =
            (0..network.views.len()).into_par_iter().map(|v| view_part(network, structure, loss, v)).collect();
        let mut cameras = DMatrix::zeros(structure.size, structure.size);
        let mut gradient = DVector::zeros(structure.size);
        for (view, part) in views.iter().enumerate() {
            let lens = structure.lens_range(network.views[view].lens);
            if let Some(pose) = structure.view_range(view) {
                for i in 0..6 {
                    gradient[pose.start + i] += part.pose_gradient[i];
                    for j in 0..6 {
                        cameras[(pose.start + i, pose.start + j)] += part.pose[i][j];
                    }
                    if let Some((range, columns)) = &lens {
                        for (at, &column) in range.clone().zip(*columns) {
                            cameras[(pose.start + i, at)] += part.mixed[i][column];
                            cameras[(at, pose.start + i)] += part.mixed[i][column];
                        }
                    }
                }
            }
            if let Some((range, columns)) = lens {
                for (a, &i) in range.clone().zip(columns) {
                    gradient[a] += part.lens_gradient[i];
                    for (b, &j) in range.clone().zip(columns) {
                        cameras[(a, b)] += part.lens[i][j];
                    }
                }
            }
        }
        for (index, lens) in network.lenses.iter().enumerate() {
            let Some((range, columns)) = structure.lens_range(index) else { continue };
            let now = unknowns(&lens.intrinsics);
            for (at, &i) in range.zip(columns) {
                let weight = lens.prior_weight[i] * lens.prior_weight[i];
                cameras[(at, at)] += weight;
                gradient[at] += weight * (now[i] - lens.prior[i]);
            }
        }
        add_segments(network, structure, loss, &mut cameras, &mut gradient);
        Self { cameras, gradient, points }
    }

    /// The step that Levenberg-Marquardt takes under a damping; `None` where the damped equations are not positive definite.
    pub(super) fn solve(&self, structure: &Structure, damping: f64) -> Option<Step> {
        let inverses = self.point_inverses(damping)?;
        let mut reduced = self.reduced(structure, &inverses);
        let mut right = -&self.gradient;
        for (point, part) in self.points.iter().enumerate() {
            let pulled = inverses[point] * part.gradient;
            for (&block, coupling) in structure.blocks_of_point[point].iter().zip(&part.couplings) {
                let Block { offset, size, .. } = structure.blocks[block];
                for i in 0..size {
                    right[offset + i] += coupling[i].dot(pulled);
                }
            }
        }
        for i in 0..structure.size {
            reduced[(i, i)] += damping * self.cameras[(i, i)] + f64::MIN_POSITIVE;
        }
        let cameras = solve_scaled(reduced, &right)?;
        let points: Vec<DVec3> = self
            .points
            .par_iter()
            .enumerate()
            .map(|(point, part)| {
                let mut sum = -part.gradient;
                for (&block, coupling) in structure.blocks_of_point[point].iter().zip(&part.couplings) {
                    let Block { offset, size, .. } = structure.blocks[block];
                    for i in 0..size {
                        sum -= coupling[i] * cameras[offset + i];
                    }
                }
                inverses[point] * sum
            })
            .collect();
        let mut predicted = 0.0;
        for i in 0..structure.size {
            predicted += cameras[i] * (damping * self.cameras[(i, i)] * cameras[i] - self.gradient[i]);
        }
        for (step, part) in points.iter().zip(&self.points) {
            predicted += step.dot(damping * diagonal(&part.own) * *step - part.gradient);
        }
        (cameras.iter().all(|v| v.is_finite())).then_some(Step { cameras, points, predicted: 0.5 * predicted })
    }

    /// The inverses of the points' own blocks; zero for a held point or one that no mark pins down.
    pub(super) fn point_inverses(&self, damping: f64) -> Option<Vec<DMat3>> {
        Some(
            self.points
                .par_iter()
                .map(|part| {
                    if part.own == DMat3::ZERO {
                        return DMat3::ZERO;
                    }
                    let own = part.own + DMat3::from_diagonal(diagonal(&part.own) * damping);
                    let inverse = own.inverse();
                    if own.determinant() > 0.0 && inverse.is_finite() { inverse } else { DMat3::ZERO }
                })
                .collect(),
        )
    }

    /// The cameras' equations with the points eliminated; only the lower triangle is filled.
    pub(super) fn reduced(&self, structure: &Structure, inverses: &[DMat3]) -> DMatrix<f64> {
        let rows: Vec<Vec<f64>> = structure
            .blocks
            .par_iter()
            .enumerate()
            .map(|(index, block)| {
                let width = structure.size - block.offset;
                let mut rows = vec![0.0; block.size * width];
                for &(point, number) in &block.coupled {
                    let part = &self.points[point];
                    let mine = &part.couplings[number];
                    let inverse = &inverses[point];
                    let mut pulled = [DVec3::ZERO; MAX_BLOCK];
                    for i in 0..block.size {
                        pulled[i] = *inverse * mine[i];
                    }
                    let others = structure.blocks_of_point[point][number..].iter().zip(&part.couplings[number..]);
                    for (&other, coupling) in others {
                        let Block { offset, size, .. } = structure.blocks[other];
                        let start = offset - block.offset;
                        for (i, pulled) in pulled[..block.size].iter().enumerate() {
                            let row = &mut rows[i * width + start..i * width + start + size];
                            for (value, c) in row.iter_mut().zip(&coupling[..size]) {
                                *value -= pulled.dot(*c);
                            }
                        }
                    }
                    debug_assert_eq!(structure.blocks_of_point[point][number], index);
                }
                rows
            })
            .collect();
        let mut reduced = self.cameras.clone();
        for (block, rows) in structure.blocks.iter().zip(&rows) {
            let width = structure.size - block.offset;
            for i in 0..block.size {
                for j in 0..width {
                    // Rows of the upper triangle become columns of the lower one; within the diagonal block both come, and the lower counts.
                    if j >= i {
                        reduced[(block.offset + j, block.offset + i)] += rows[i * width + j];
                    }
                }
            }
        }
        reduced
    }

    /// What a point is coupled to: where a block of unknowns begins, how many there are, and the coupling.
    pub(super) fn couplings<'a>(
        &'a self,
        structure: &'a Structure,
        point: usize,
    ) -> impl Iterator<Item = (usize, usize, &'a Coupling)> {
        structure.blocks_of_point[point].iter().zip(&self.points[point].couplings).map(|(&block, coupling)| {
            let Block { offset, size, .. } = structure.blocks[block];
            (offset, size, coupling)
        })
    }
}

/// Solves a symmetric positive definite system given by its lower triangle, first scaled to a unit diagonal: rotations, metres and pixels
/// differ by many orders.
fn solve_scaled(mut matrix: DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let scale = unit_diagonal(&mut matrix)?;
    let factor = matrix.cholesky()?;
    let solved = factor.solve(&right.component_mul(&scale));
    Some(solved.component_mul(&scale))
}

/// Scales a symmetric matrix's lower triangle to a unit diagonal and returns by what; `None` where the diagonal is not positive.
pub(super) fn unit_diagonal(matrix: &mut DMatrix<f64>) -> Option<DVector<f64>> {
    let n = matrix.nrows();
    let scale = DVector::from_fn(n, |i, _| 1.0 / matrix[(i, i)].sqrt());
    if !scale.iter().all(|s| s.is_finite()) {
        return None;
    }
    for j in 0..n {
        for i in j..n {
            matrix[(i, j)] *= scale[i] * scale[j];
        }
    }
    Some(scale)
}

fn diagonal(m: &DMat3) -> DVec3 {
    DVec3::new(m.x_axis.x, m.y_axis.y, m.z_axis.z)
}

fn point_part(network: &Network, structure: &Structure, loss: Loss, index: usize) -> PointPart {
    let blocks = &structure.blocks_of_point[index];
    let mut part =
        PointPart { own: DMat3::ZERO, gradient: DVec3::ZERO, couplings: vec![[DVec3::ZERO; MAX_BLOCK]; blocks.len()] };
    let point = &network.points[index];
    if point.fixed {
        return part;
    }
    for &o in &structure.observations_of_point[index] {
        let o = &network.observations[o];
        let Some(projection) = project(&network.camera(o.view), point.position) else { continue };
        let residual = projection.pixel - o.pixel;
        let weight = o.weight * o.weight * loss.cost_and_weight((residual * o.weight).length_squared()).1;
        let rows = projection.point.map(DVec3::from);
        for (row, r) in rows.into_iter().zip(residual.to_array()) {
            let weighted = row * weight;
            part.own += DMat3::from_cols(weighted * row.x, weighted * row.y, weighted * row.z);
            part.gradient += weighted * r;
        }
        let place = |block: Option<usize>| block.and_then(|b| blocks.binary_search(&b).ok());
        if let Some(number) = place(structure.view_block[o.view]) {
            let coupling = &mut part.couplings[number];
            for i in 0..6 {
                coupling[i] += weight * (projection.pose[0][i] * rows[0] + projection.pose[1][i] * rows[1]);
            }
        }
        let lens = network.views[o.view].lens;
        if let Some(number) = place(structure.lens_block[lens]) {
            let coupling = &mut part.couplings[number];
            for (i, &column) in structure.columns[lens].iter().enumerate() {
                coupling[i] += weight * (projection.lens[0][column] * rows[0] + projection.lens[1][column] * rows[1]);
            }
        }
    }
    if let Some((at, weight)) = point.known {
        part.own += DMat3::IDENTITY * (weight * weight);
        part.gradient += weight * weight * (point.position - at);
    }
    part
}

fn view_part(network: &Network, structure: &Structure, loss: Loss, view: usize) -> ViewPart {
    let mut part = ViewPart {
        pose: [[0.0; 6]; 6],
        mixed: [[0.0; LENS_UNKNOWNS]; 6],
        lens: [[0.0; LENS_UNKNOWNS]; LENS_UNKNOWNS],
        pose_gradient: [0.0; 6],
        lens_gradient: [0.0; LENS_UNKNOWNS],
    };
    let camera = network.camera(view);
    for &o in &structure.observations_of_view[view] {
        let o = &network.observations[o];
        let Some(projection) = project(&camera, network.points[o.point].position) else { continue };
        let residual = projection.pixel - o.pixel;
        let weight = o.weight * o.weight * loss.cost_and_weight((residual * o.weight).length_squared()).1;
        for (row, r) in residual.to_array().into_iter().enumerate() {
            let (pose, lens) = (&projection.pose[row], &projection.lens[row]);
            for i in 0..6 {
                let weighted = weight * pose[i];
                part.pose_gradient[i] += weighted * r;
                for j in 0..6 {
                    part.pose[i][j] += weighted * pose[j];
                }
                for j in 0..LENS_UNKNOWNS {
                    part.mixed[i][j] += weighted * lens[j];
                }
            }
            for i in 0..LENS_UNKNOWNS {
                let weighted = weight * lens[i];
                part.lens_gradient[i] += weighted * r;
                for j in 0..LENS_UNKNOWNS {
                    part.lens[i][j] += weighted * lens[j];
                }
            }
        }
    }
    part
}

fn add_segments(network: &Network, structure: &Structure, loss: Loss, cameras: &mut DMatrix<f64>, gradient: &mut DVector<f64>) {
    for segment in &network.segments {
        let lens = network.views[segment.view].lens;
        let columns = &structure.columns[lens];
        let Some(slope) = edge::slope(network, segment, columns) else { continue };
        let weight = loss.cost_and_weight(slope.residual * slope.residual).1;
        let mut row: Vec<(usize, f64)> = Vec::new();
        if let Some(range) = structure.view_range(segment.view) {
            row.extend(range.zip(slope.pose));
        }
        if let Some((range, columns)) = structure.lens_range(lens) {
            row.extend(range.zip(columns.iter().map(|&c| slope.lens[c])));
        }
        if let Some(range) = structure.frame_range() {
            row.extend(range.zip(slope.frame));
        }
        for &(i, a) in &row {
            gradient[i] += weight * a * slope.residual;
            for &(j, b) in &row {
                cameras[(i, j)] += weight * a * b;
            }
        }
    }
}

/// A change of all unknowns.
pub(super) struct Step {
    cameras: DVector<f64>,
    points: Vec<DVec3>,
    /// By how much the cost would fall if the network were linear.
    pub(super) predicted: f64,
}

impl Step {
    pub(super) fn apply(&self, network: &Network, structure: &Structure) -> Network {
        let mut moved = network.clone();
        let three = |at: usize| DVec3::new(self.cameras[at], self.cameras[at + 1], self.cameras[at + 2]);
        for (index, view) in moved.views.iter_mut().enumerate() {
            if let Some(range) = structure.view_range(index) {
                view.pose.rotation = (rotation_from_vector(three(range.start)) * view.pose.rotation).normalize();
                view.pose.translation += three(range.start + 3);
            }
        }
        for (index, lens) in moved.lenses.iter_mut().enumerate() {
            if let Some((range, columns)) = structure.lens_range(index) {
                let mut values = unknowns(&lens.intrinsics);
                for (at, &column) in range.zip(columns) {
                    values[column] += self.cameras[at];
                }
                // A focal length that a step turns round would mirror the photograph; half of it is as far as one step goes.
                values[0] = values[0].max(0.5 * lens.intrinsics.focal_px[0]);
                lens.intrinsics = with_unknowns(&lens.intrinsics, values);
            }
        }
        if let Some(range) = structure.frame_range() {
            moved.frame = (rotation_from_vector(three(range.start)) * moved.frame).normalize();
        }
        for (point, step) in moved.points.iter_mut().zip(&self.points) {
            point.position += *step;
        }
        moved
    }
}
