//! Bundle adjustment: cameras, lenses and points moved together until the marks lie where they were drawn.
//!
//! B. Triggs, P. McLauchlan, R. Hartley, A. Fitzgibbon: Bundle Adjustment - A Modern Synthesis, 1999. Levenberg-Marquardt; points are eliminated
//! one by one (Schur complement, their section 6.1), so that the system to factor has the cameras', the lenses' and the frame's unknowns only.
//! That system is factored dense: photographs of one monument see mostly the same points, and fifty cameras make 300 unknowns.
//!
//! Sums that threads share are added per block in the order of the marks, so the number of threads changes no bit.

mod covariance;
mod edge;
mod jacobian;
mod normal;

pub use covariance::{Covariances, DatumSlope, GAUGE, Inverse};
pub use edge::Segment;
pub(crate) use edge::off_line;

use crate::camera::{Camera, Intrinsics, Pose};
use glam::{DQuat, DVec2, DVec3};
use rayon::prelude::*;

/// The most unknowns that a lens has: focal length, centre (2), radial (3), tangential (2).
pub const LENS_UNKNOWNS: usize = 8;

/// What a mark costs, in squared standard deviations, that its camera cannot see at all (behind it).
const UNSEEN_COST: f64 = 1e6;

/// The damping at which a small step means convergence.
const CONVERGED_DAMPING: f64 = 1e-8;

/// Which parts of a lens are solved for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Free {
    /// The focal length; both axes keep their ratio.
    pub focal: bool,
    /// The principal point.
    pub centre: bool,
    /// How many radial coefficients, from k1: 0 to 3.
    pub radial: u8,
    /// The tangential coefficients.
    pub tangential: bool,
}

impl Free {
    /// The indices of the unknowns that are solved for, rising.
    #[must_use]
    pub fn columns(self) -> Vec<usize> {
        let switch = [
            self.focal,
            self.centre,
            self.centre,
            self.radial > 0,
            self.radial > 1,
            self.radial > 2,
            self.tangential,
            self.tangential,
        ];
        (0..LENS_UNKNOWNS).filter(|&i| switch[i]).collect()
    }
}

/// A lens and what is known of it beforehand.
#[derive(Clone, Copy, Debug)]
pub struct Lens {
    /// The values; what is free starts from them.
    pub intrinsics: Intrinsics,
    /// What is solved for.
    pub free: Free,
    /// What the unknowns are pulled to.
    pub prior: [f64; LENS_UNKNOWNS],
    /// How strongly: one over the standard deviation, 0 for not at all.
    pub prior_weight: [f64; LENS_UNKNOWNS],
}

impl Lens {
    /// A lens whose unknowns nothing is known of.
    #[must_use]
    pub fn new(intrinsics: Intrinsics, free: Free) -> Self {
        Self { intrinsics, free, prior: unknowns(&intrinsics), prior_weight: [0.0; LENS_UNKNOWNS] }
    }
}

/// A photograph.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Where it was taken.
    pub pose: Pose,
    /// Which lens took it.
    pub lens: usize,
    /// Whether the place is held.
    pub fixed: bool,
}

/// A reference point.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Where it is.
    pub position: DVec3,
    /// Whether it is held.
    pub fixed: bool,
    /// Coordinates known beforehand, and one over their standard deviation.
    pub known: Option<(DVec3, f64)>,
}

/// A point marked in a photograph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Which photograph.
    pub view: usize,
    /// Which point.
    pub point: usize,
    /// Where in it.
    pub pixel: DVec2,
    /// One over the standard deviation of a coordinate in pixels.
    pub weight: f64,
}

/// All that is adjusted together.
#[derive(Clone, Debug, Default)]
pub struct Network {
    /// The lenses.
    pub lenses: Vec<Lens>,
    /// The photographs.
    pub views: Vec<View>,
    /// The points.
    pub points: Vec<Point>,
    /// The marks; no two of one point in one photograph.
    pub observations: Vec<Observation>,
    /// Drawn parallel edges.
    pub segments: Vec<Segment>,
    /// What the edges' axes are turned by: world from frame.
    pub frame: DQuat,
    /// Whether the frame is held.
    pub frame_fixed: bool,
}

/// How what lies far off counts; scales are in standard deviations of a mark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loss {
    /// Squares: best where no mark is wrong.
    Squared,
    /// Squares near, straight beyond the scale.
    Huber(f64),
    /// Squares near, logarithmic beyond the scale: wrong marks hardly pull.
    Cauchy(f64),
}

impl Loss {
    /// The cost of a squared residual and its derivative, which is the residual's weight.
    #[must_use]
    pub fn cost_and_weight(self, squared: f64) -> (f64, f64) {
        match self {
            Self::Squared => (squared, 1.0),
            Self::Huber(scale) if squared <= scale * scale => (squared, 1.0),
            Self::Huber(scale) => {
                let r = squared.sqrt();
                (2.0 * scale * r - scale * scale, scale / r)
            }
            Self::Cauchy(scale) => {
                let s2 = scale * scale;
                (s2 * libm::log1p(squared / s2), 1.0 / (1.0 + squared / s2))
            }
        }
    }
}

/// When the adjustment ends.
#[derive(Clone, Copy, Debug)]
pub struct Params {
    /// The most steps.
    pub max_steps: usize,
    /// Ends where a step lowers the cost by less than this part of it.
    pub relative_decrease: f64,
    /// How what lies far off counts.
    pub loss: Loss,
}

impl Default for Params {
    fn default() -> Self {
        Self { max_steps: 100, relative_decrease: 1e-9, loss: Loss::Squared }
    }
}

/// How an adjustment went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Half of the sum of costs at the start.
    pub cost_before: f64,
    /// The same at the end.
    pub cost_after: f64,
    /// Steps tried.
    pub steps: usize,
    /// False where `max_steps` ended it.
    pub converged: bool,
}

impl Network {
    /// A view's camera.
    #[must_use]
    pub fn camera(&self, view: usize) -> Camera {
        let View { pose, lens, .. } = self.views[view];
        Camera { intrinsics: self.lenses[lens].intrinsics, pose }
    }

    /// How far a point's picture lies from its mark, in pixels; `None` where the camera cannot see it.
    #[must_use]
    pub fn residual_px(&self, observation: &Observation) -> Option<DVec2> {
        let picture = self.camera(observation.view).project(self.points[observation.point].position)?;
        Some(picture - observation.pixel)
    }

    /// Half the sum of all costs.
    #[must_use]
    pub fn cost(&self, loss: Loss) -> f64 {
        const CHUNK: usize = 4096;
        let marks: f64 = self
            .observations
            .par_chunks(CHUNK)
            .map(|chunk| {
                chunk
                    .iter()
                    .map(|o| match self.residual_px(o) {
                        Some(r) => loss.cost_and_weight((r * o.weight).length_squared()).0,
                        None => loss.cost_and_weight(UNSEEN_COST).0,
                    })
                    .sum::<f64>()
            })
            .collect::<Vec<_>>()
            .iter()
            .sum();
        let edges: f64 = self.segments.iter().map(|s| loss.cost_and_weight(squared(edge::residual(self, s))).0).sum();
        let priors: f64 = self
            .lenses
            .iter()
            .map(|lens| {
                let now = unknowns(&lens.intrinsics);
                (0..LENS_UNKNOWNS).map(|i| squared((now[i] - lens.prior[i]) * lens.prior_weight[i])).sum::<f64>()
            })
            .sum();
        let known: f64 =
            self.points.iter().filter_map(|p| p.known.map(|(at, weight)| ((p.position - at) * weight).length_squared())).sum();
        0.5 * (marks + edges + priors + known)
    }
}

/// A lens's unknowns in their order: focal length along x, centre, radial, tangential.
#[must_use]
pub fn unknowns(lens: &Intrinsics) -> [f64; LENS_UNKNOWNS] {
    let Intrinsics { focal_px: [f, _], centre_px: [cx, cy], radial: [k1, k2, k3], tangential: [p1, p2], .. } = *lens;
    [f, cx, cy, k1, k2, k3, p1, p2]
}

/// The lens with its unknowns changed; the ratio of both focal lengths stays.
#[must_use]
pub fn with_unknowns(lens: &Intrinsics, values: [f64; LENS_UNKNOWNS]) -> Intrinsics {
    let [f, cx, cy, k1, k2, k3, p1, p2] = values;
    let ratio = lens.focal_px[1] / lens.focal_px[0];
    Intrinsics { focal_px: [f, f * ratio], centre_px: [cx, cy], radial: [k1, k2, k3], tangential: [p1, p2], ..*lens }
}

/// A small rotation vector as a quaternion.
#[must_use]
pub fn rotation_from_vector(vector: DVec3) -> DQuat {
    let angle = vector.length();
    if angle < 1e-12 {
        let half = 0.5 * vector;
        return DQuat::from_xyzw(half.x, half.y, half.z, 1.0).normalize();
    }
    let axis = vector / angle * libm::sin(0.5 * angle);
    DQuat::from_xyzw(axis.x, axis.y, axis.z, libm::cos(0.5 * angle))
}

/// A point's picture and how it moves with the point: one row an axis of the picture.
pub(crate) fn point_slope(camera: &Camera, world: DVec3) -> Option<(DVec2, [DVec3; 2])> {
    jacobian::project(camera, world).map(|p| (p.pixel, p.point.map(DVec3::from)))
}

/// Adjusts a network in place: never to a higher cost than it had.
pub fn adjust(network: &mut Network, params: &Params) -> Outcome {
    let structure = normal::Structure::of(network);
    let cost_before = network.cost(params.loss);
    let mut cost = cost_before;
    let mut damping = 1e-4;
    let mut growth = 2.0;
    let mut steps = 0;
    let mut converged = false;
    let mut equations = None;
    while steps < params.max_steps {
        steps += 1;
        let built = equations.get_or_insert_with(|| normal::Equations::build(network, &structure, params.loss));
        let Some(step) = built.solve(&structure, damping) else {
            damping *= growth;
            growth *= 2.0;
            if damping > 1e12 {
                break;
            }
            continue;
        };
        let trial = step.apply(network, &structure);
        let trial_cost = trial.cost(params.loss);
        let gained = cost - trial_cost;
        if gained >= 0.0 && trial_cost.is_finite() {
            let ratio = if step.predicted > 0.0 { gained / step.predicted } else { 1.0 };
            *network = trial;
            let small = gained <= params.relative_decrease * cost;
            cost = trial_cost;
            equations = None;
            damping = (damping * (1.0 - cubed(2.0 * ratio - 1.0)).max(0.1)).max(1e-12);
            growth = 2.0;
            // Under strong damping weak directions (a turn that a shift nearly makes good) move too little to show: first it must fall.
            if small && damping <= CONVERGED_DAMPING {
                converged = true;
                break;
            }
        } else {
            let exact = cost <= f64::EPSILON * network.observations.len() as f64;
            if exact || damping <= CONVERGED_DAMPING && step.predicted <= params.relative_decrease * cost {
                converged = true;
                break;
            }
            damping *= growth;
            growth *= 2.0;
            if damping > 1e12 {
                break;
            }
        }
    }
    Outcome { cost_before, cost_after: cost, steps, converged }
}

fn squared(x: f64) -> f64 {
    x * x
}

fn cubed(x: f64) -> f64 {
    x * x * x
}
