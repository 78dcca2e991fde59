//! What is known before cameras are solved for, and what is known after.

use super::bundle::{Free, LENS_UNKNOWNS};
use crate::camera::{Camera, Intrinsics, Pose};
use glam::{DMat3, DVec2, DVec3};

/// What is known of a lens's focal length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Focal {
    /// In pixels, held.
    Known(f64),
    /// In pixels, as EXIF tells it: a start that marks may correct by some per cent.
    Guess(f64),
    /// Nothing.
    Free,
}

/// A lens at one setting; photographs that share it share its unknowns.
#[derive(Clone, Debug, PartialEq)]
pub struct LensGroup {
    /// For messages.
    pub name: String,
    /// Size, centre and distortion to start from; its focal length counts as a ratio of both axes only.
    pub intrinsics: Intrinsics,
    /// What is known of the focal length.
    pub focal: Focal,
    /// What else is solved for; `focal` herein is not looked at.
    pub free: Free,
}

/// A photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct Photo {
    /// For messages.
    pub name: String,
    /// Which lens took it.
    pub lens: usize,
    /// A pose taken over from elsewhere, in the world's space.
    pub pose: Option<Pose>,
}

/// A reference point.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// For messages.
    pub name: String,
    /// Coordinates in the world, where they are known.
    pub known_m: Option<DVec3>,
    /// Whether it lies on level ground of height 0.
    pub ground: bool,
}

/// A reference point's place in a photograph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Which photograph.
    pub photo: usize,
    /// Which point.
    pub point: usize,
    /// Where.
    pub pixel: DVec2,
}

/// A straight edge in a photograph that runs along an axis of the frame, from its lesser to its greater coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Which photograph.
    pub photo: usize,
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// Both ends in the photograph.
    pub ends: [DVec2; 2],
}

/// A distance between two points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// Both points.
    pub between: [usize; 2],
    /// In metres.
    pub metres: f64,
}

/// A direction from one point to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// From the first to the second.
    pub between: [usize; 2],
    /// The unit vector in the world: north is -Z, up +Y.
    pub world: DVec3,
}

/// All that is known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Problem {
    /// The lenses.
    pub lenses: Vec<LensGroup>,
    /// The photographs.
    pub photos: Vec<Photo>,
    /// The points.
    pub points: Vec<Reference>,
    /// The marks; no two of one point in one photograph.
    pub marks: Vec<Mark>,
    /// The parallel edges.
    pub edges: Vec<Edge>,
    /// The distances.
    pub distances: Vec<Distance>,
    /// The directions.
    pub directions: Vec<Direction>,
}

/// How a solution is sought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// The standard deviation of a mark's coordinate: what a careful hand reaches. A larger one forgives more.
    pub mark_sigma_px: f64,
    /// Marks are judged no more sharply than if this were their standard deviation: few of them tell their spread badly, and a lucky fit must not
    /// condemn honest ones.
    pub least_sigma_px: f64,
    /// The most draws of every robust start; more find a way through more wrong marks.
    pub rounds: usize,
    /// How many standard deviations a mark may be off before it counts as wrong.
    pub wrong_from: f64,
    /// Which pairs of photographs see a start at all: the least median angle between their rays.
    pub min_parallax_rad: f64,
    /// Of all draws.
    pub seed: u64,
}

impl Default for Params {
    fn default() -> Self {
        // 4.5 standard deviations in two dimensions: one right mark of 25,000 is called wrong.
        Self { mark_sigma_px: 0.5, least_sigma_px: 0.25, rounds: 2000, wrong_from: 4.5, min_parallax_rad: 0.02, seed: 1 }
    }
}

/// What was found of a photograph.
#[derive(Clone, Debug, PartialEq)]
pub enum PhotoResult {
    /// Its camera is known.
    Solved(Box<SolvedPhoto>),
    /// Why it is not.
    Unsolved(String),
}

/// A photograph whose camera is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolvedPhoto {
    /// Its camera in the world.
    pub camera: Camera,
    /// Marks that were used.
    pub marks: usize,
    /// The root of the mean squared distance between marks and pictures; 0 without marks.
    pub rms_px: f64,
    /// The covariance of its centre, in square metres; `None` where it could not be told.
    pub centre_covariance_m2: Option<DMat3>,
    /// The standard deviation of its turn about the worst axis.
    pub rotation_sigma_rad: Option<f64>,
}

/// What was found of a point.
#[derive(Clone, Debug, PartialEq)]
pub enum PointResult {
    /// Its place is known.
    Solved(SolvedPoint),
    /// Why it is not.
    Unsolved(String),
}

/// A point whose place is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolvedPoint {
    /// In the world, metres where the scale is known.
    pub position_m: DVec3,
    /// Its covariance, in square metres.
    pub covariance_m2: Option<DMat3>,
    /// Marks that were used.
    pub marks: usize,
    /// The root of the mean squared distance between marks and pictures.
    pub rms_px: f64,
    /// The largest angle between rays to it.
    pub parallax_rad: f64,
}

/// What became of a mark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MarkResult {
    /// Used; from the mark to the point's picture.
    Used(DVec2),
    /// Found wrong and left out; from the mark to the point's picture.
    Wrong(DVec2),
    /// Its photograph or its point is unsolved.
    Idle,
}

/// What was found of a lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensResult {
    /// Its values.
    pub intrinsics: Intrinsics,
    /// Standard deviations: focal length, centre, radial, tangential; 0 for what was held.
    pub sigmas: [f64; LENS_UNKNOWNS],
    /// Whether any photograph of it was solved.
    pub solved: bool,
}

/// How well a thing known beforehand is met.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// What: `distance a - b`.
    pub what: String,
    /// By how much it is missed, in its unit.
    pub off: f64,
    /// `m` or `deg`.
    pub unit: &'static str,
}

/// What place, turn and scale of the whole rest on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Alignment {
    /// In words, `None` where nothing says it.
    pub scale_from: Option<String>,
    /// What says which way is up.
    pub level_from: Option<String>,
    /// What says where north is.
    pub north_from: Option<String>,
    /// What says where the origin is.
    pub origin_from: Option<String>,
    /// How well all that is met.
    pub checks: Vec<Check>,
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Of every lens.
    pub lenses: Vec<LensResult>,
    /// Of every photograph.
    pub photos: Vec<PhotoResult>,
    /// Of every point.
    pub points: Vec<PointResult>,
    /// Of every mark.
    pub marks: Vec<MarkResult>,
    /// What the whole rests on.
    pub alignment: Alignment,
    /// The standard deviation of a mark's coordinate, as the residuals tell it.
    pub sigma_px: f64,
    /// What else should be said: what is missing, what is weak.
    pub notes: Vec<String>,
}

impl Solution {
    /// The camera of a photograph, where it was solved.
    #[must_use]
    pub fn camera(&self, photo: usize) -> Option<Camera> {
        match self.photos.get(photo)? {
            PhotoResult::Solved(solved) => Some(solved.camera),
            PhotoResult::Unsolved(_) => None,
        }
    }

    /// The place of a point, where it was solved.
    #[must_use]
    pub fn position_m(&self, point: usize) -> Option<DVec3> {
        match self.points.get(point)? {
            PointResult::Solved(solved) => Some(solved.position_m),
            PointResult::Unsolved(_) => None,
        }
    }

    /// Sentences about wrong marks, the worst first: `column-3-top in north-east.jpg is off by 41 px`.
    #[must_use]
    pub fn wrong_marks(&self, problem: &Problem) -> Vec<String> {
        let mut wrong: Vec<(f64, usize)> = (self.marks.iter().enumerate())
            .filter_map(|(i, m)| if let MarkResult::Wrong(off) = m { Some((off.length(), i)) } else { None })
            .collect();
        wrong.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let say = |(off, i): (f64, usize)| {
            let mark = problem.marks[i];
            let (point, photo) = (&problem.points[mark.point].name, &problem.photos[mark.photo].name);
            if off < 10.0 {
                format!("{point} in {photo} is off by {off:.1} px")
            } else {
                format!("{point} in {photo} is off by {off:.0} px")
            }
        };
        wrong.into_iter().map(say).collect()
    }

    /// How many photographs were solved.
    #[must_use]
    pub fn solved_photos(&self) -> usize {
        self.photos.iter().filter(|p| matches!(p, PhotoResult::Solved(_))).count()
    }
}
