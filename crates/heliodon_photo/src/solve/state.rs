//! What is solved so far, and its adjustment.

use super::bundle::{self, Free, Lens, Loss, Network, Observation, Point, Segment, View};
use super::problem::{Focal, Params, Problem};
use super::triangulate::{self, Gate};
use crate::camera::{Camera, Intrinsics, Pose};
use glam::{DQuat, DVec2, DVec3};

/// How far a focal length from EXIF may be wrong: one standard deviation of its logarithm.
const EXIF_SIGMA: f64 = 0.1;

/// Standard deviations that lenses' other unknowns have beforehand: they hold what the marks do not tell.
const CENTRE_SIGMA: f64 = 0.02;
const RADIAL_SIGMA: f64 = 0.3;
const TANGENTIAL_SIGMA: f64 = 0.005;

#[derive(Clone, Debug)]
pub(super) struct State<'a> {
    pub(super) problem: &'a Problem,
    pub(super) params: Params,
    pub(super) lenses: Vec<Intrinsics>,
    /// Whether a lens has taken part, so that its focal length is more than a guess.
    pub(super) met: Vec<bool>,
    pub(super) poses: Vec<Option<Pose>>,
    pub(super) points: Vec<Option<DVec3>>,
    /// Which marks count.
    pub(super) used: Vec<bool>,
    /// World from the frame of the edges, once known.
    pub(super) frame: Option<DQuat>,
    /// Photographs whose pose was taken over and is kept.
    pub(super) held: Vec<bool>,
    /// Whether EXIF's focal lengths are doubted: photographs may have been cropped, or zoomed by computation.
    pub(super) doubts_exif: bool,
    /// Whether poses are already in the world's space, by coordinates of points.
    pub(super) placed: bool,
    /// Which edges count.
    pub(super) edges_used: Vec<bool>,
    /// Points whose marks agree in more than one way.
    pub(super) ambiguous: Vec<bool>,
    /// Marks of every point.
    pub(super) marks_of: Vec<Vec<usize>>,
}

/// A network and where its parts come from.
pub(super) struct Extract {
    pub(super) network: Network,
    pub(super) views: Vec<usize>,
    pub(super) points: Vec<usize>,
    pub(super) marks: Vec<usize>,
}

impl<'a> State<'a> {
    pub(super) fn new(problem: &'a Problem, params: Params) -> Self {
        let lenses = problem
            .lenses
            .iter()
            .map(|lens| with_focal(&lens.intrinsics, first_focal(&lens.focal, &lens.intrinsics)))
            .collect();
        let mut marks_of = vec![Vec::new(); problem.points.len()];
        for (i, mark) in problem.marks.iter().enumerate() {
            if mark.pixel.is_finite() {
                marks_of[mark.point].push(i);
            }
        }
        Self {
            problem,
            params,
            lenses,
            met: vec![false; problem.lenses.len()],
            poses: vec![None; problem.photos.len()],
            points: vec![None; problem.points.len()],
            used: vec![false; problem.marks.len()],
            frame: None,
            held: vec![false; problem.photos.len()],
            doubts_exif: false,
            placed: false,
            edges_used: vec![true; problem.edges.len()],
            ambiguous: vec![false; problem.points.len()],
            marks_of,
        }
    }

    pub(super) fn camera(&self, photo: usize) -> Option<Camera> {
        let pose = self.poses[photo]?;
        Some(Camera { intrinsics: self.lenses[self.problem.photos[photo].lens], pose })
    }

    /// How far a mark may be off while the lens is not yet known well.
    pub(super) fn reach_px(&self, lens: usize) -> f64 {
        let lens = &self.lenses[lens];
        (6.0 * self.params.mark_sigma_px).max(0.003 * f64::from(lens.width.max(lens.height)))
    }

    /// Finds all points anew from all solved photographs, and with them which marks count.
    pub(super) fn triangulate(&mut self) {
        let gate_px = (0..self.lenses.len()).map(|l| self.reach_px(l)).fold(0.0, f64::max);
        for point in 0..self.points.len() {
            let seen: Vec<(usize, Camera)> =
                self.marks_of[point].iter().filter_map(|&m| self.camera(self.problem.marks[m].photo).map(|c| (m, c))).collect();
            for &m in &self.marks_of[point] {
                self.used[m] = false;
            }
            let cameras: Vec<Camera> = seen.iter().map(|s| s.1).collect();
            let pixels: Vec<DVec2> = seen.iter().map(|s| self.problem.marks[s.0].pixel).collect();
            let gate = Gate { reach_px: gate_px, min_parallax_rad: 0.5 * self.params.min_parallax_rad };
            let found = triangulate::robustly(&cameras, &pixels, gate);
            self.points[point] = found.as_ref().map(|f| f.position);
            if let Some(found) = found {
                for ((m, _), agrees) in seen.iter().zip(found.agrees) {
                    self.used[*m] = agrees;
                }
            }
        }
    }

    /// The network of all that is solved. Lenses keep their focal length where `hold_lenses` says so.
    pub(super) fn extract(&self, hold_lenses: bool) -> Extract {
        let mut network = Network { frame: self.frame.unwrap_or(DQuat::IDENTITY), ..Network::default() };
        for (group, now) in self.problem.lenses.iter().zip(&self.lenses) {
            let free = Free { focal: !matches!(group.focal, Focal::Known(_)), ..group.free };
            network.lenses.push(prepared_lens(group, *now, if hold_lenses { Free::default() } else { free }));
        }
        let mut view_of = vec![None; self.poses.len()];
        let mut views = Vec::new();
        for (photo, pose) in self.poses.iter().enumerate() {
            if let Some(pose) = *pose {
                view_of[photo] = Some(views.len());
                views.push(photo);
                network.views.push(View { pose, lens: self.problem.photos[photo].lens, fixed: self.held[photo] });
            }
        }
        let (mut points, mut marks) = (Vec::new(), Vec::new());
        for (point, position) in self.points.iter().enumerate() {
            let Some(position) = *position else { continue };
            let used: Vec<usize> = self.marks_of[point].iter().copied().filter(|m| self.used[*m]).collect();
            let number = points.len();
            let mut seen = 0;
            for m in used {
                if let Some(view) = view_of[self.problem.marks[m].photo] {
                    let pixel = self.problem.marks[m].pixel;
                    network.observations.push(Observation {
                        view,
                        point: number,
                        pixel,
                        weight: 1.0 / self.params.mark_sigma_px,
                    });
                    marks.push(m);
                    seen += 1;
                }
            }
            if seen == 0 {
                continue;
            }
            points.push(point);
            network.points.push(Point { position, fixed: false, known: None });
        }
        if self.frame.is_some() {
            for (edge, _) in self.problem.edges.iter().zip(&self.edges_used).filter(|(_, used)| **used) {
                if let Some(view) = view_of[edge.photo] {
                    let axis = DVec3::AXES[edge.axis];
                    network.segments.push(Segment { view, axis, ends: edge.ends, weight: 1.0 / self.params.mark_sigma_px });
                }
            }
        }
        Extract { network, views, points, marks }
    }

    /// Takes an adjusted network's values over.
    pub(super) fn take(&mut self, extract: &Extract) {
        for (view, &photo) in extract.network.views.iter().zip(&extract.views) {
            self.poses[photo] = Some(view.pose);
        }
        for (point, &index) in extract.network.points.iter().zip(&extract.points) {
            self.points[index] = Some(point.position);
        }
        for (lens, now) in extract.network.lenses.iter().zip(&mut self.lenses) {
            *now = lens.intrinsics;
        }
        if self.frame.is_some() {
            self.frame = Some(extract.network.frame);
        }
    }

    /// Adjusts all that is solved.
    pub(super) fn adjust(&mut self, hold_lenses: bool, loss: Loss, max_steps: usize) -> bundle::Outcome {
        let mut extract = self.extract(hold_lenses);
        let params = bundle::Params { max_steps, loss, ..bundle::Params::default() };
        let outcome = bundle::adjust(&mut extract.network, &params);
        self.take(&extract);
        outcome
    }

    /// Unsolved photographs and how many marks of solved points each has.
    pub(super) fn waiting(&self) -> Vec<(usize, usize)> {
        let mut counts = vec![0; self.poses.len()];
        for mark in &self.problem.marks {
            if self.points[mark.point].is_some() {
                counts[mark.photo] += 1;
            }
        }
        (0..self.poses.len()).filter(|p| self.poses[*p].is_none()).map(|p| (p, counts[p])).collect()
    }

    /// How much is solved: photographs, then marks that agree.
    pub(super) fn rank(&self) -> (usize, usize) {
        (self.poses.iter().flatten().count(), self.used.iter().filter(|u| **u).count())
    }
}

fn first_focal(focal: &Focal, lens: &Intrinsics) -> f64 {
    match *focal {
        Focal::Known(px) | Focal::Guess(px) => px,
        // what a phone's or a standard zoom's usual setting has
        Focal::Free => 1.1 * f64::from(lens.width.max(lens.height)),
    }
}

/// The lens with another focal length along x; y keeps the ratio.
pub(crate) fn with_focal(lens: &Intrinsics, focal_px: f64) -> Intrinsics {
    let ratio = lens.focal_px[1] / lens.focal_px[0];
    let ratio = if ratio.is_finite() && ratio > 0.0 { ratio } else { 1.0 };
    Intrinsics { focal_px: [focal_px, focal_px * ratio], ..*lens }
}

pub(super) fn prepared_lens(group: &super::problem::LensGroup, now: Intrinsics, free: Free) -> Lens {
    let mut lens = Lens { intrinsics: now, ..Lens::new(group.intrinsics, free) };
    let size = f64::from(now.width.max(now.height));
    if let Focal::Guess(px) = group.focal {
        lens.prior[0] = px;
        lens.prior_weight[0] = 1.0 / (EXIF_SIGMA * px);
    }
    lens.prior_weight[1..3].fill(1.0 / (CENTRE_SIGMA * size));
    lens.prior_weight[3..6].fill(1.0 / RADIAL_SIGMA);
    lens.prior_weight[6..8].fill(1.0 / TANGENTIAL_SIGMA);
    lens
}

/// Focal lengths to try, in pixels: from a wide angle of 100 degrees to a long lens of 10, EXIF's first.
pub(super) fn focal_candidates(focal: &Focal, lens: &Intrinsics, doubts_exif: bool) -> Vec<f64> {
    let size = f64::from(lens.width.max(lens.height));
    let all = || [1.1, 0.9, 1.35, 0.75, 1.65, 0.6, 2.0, 2.5, 0.45, 3.2, 4.2, 5.6].iter().map(|r| r * size);
    match *focal {
        Focal::Known(px) => vec![px],
        Focal::Guess(px) if doubts_exif => std::iter::once(px).chain(all()).collect(),
        Focal::Guess(px) => vec![px],
        Focal::Free => all().collect(),
    }
}
