//! Cameras, points and the model, solved on a thread of their own while marks go on being set.

use crate::wires::{Drawn, Wires};
use glam::{DVec2, DVec3};
use heliodon_photo::camera::{Camera, Intrinsics};
use heliodon_photo::formats::cameras_file::CamerasFile;
use heliodon_photo::model;
use heliodon_photo::project::{Project, Witnesses};
use heliodon_photo::solve::bundle::LENS_UNKNOWNS;
use heliodon_photo::solve::{self, LensResult, MarkResult, PhotoResult, PointResult};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

/// How a mark fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    /// From the mark to the point's picture, pixels.
    pub off: DVec2,
    /// Whether it was found wrong and left out.
    pub is_wrong: bool,
}

/// What was found of a lens.
#[derive(Clone, Debug, PartialEq)]
pub struct SolvedLens {
    /// The photographs that it took.
    pub photos: Vec<String>,
    /// Its values.
    pub intrinsics: Intrinsics,
    /// Standard deviations: focal length, centre, radial, tangential; 0 for what was held.
    pub sigmas: [f64; LENS_UNKNOWNS],
    /// Whether any of its photographs was solved.
    pub is_solved: bool,
}

/// What was solved, told by names: points and photographs may come and go in the meantime.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The project's text that it was solved from.
    pub text: String,
    /// Of photographs.
    pub photos: BTreeMap<String, PhotoResult>,
    /// Of lenses.
    pub lenses: Vec<SolvedLens>,
    /// Of points.
    pub points: BTreeMap<String, PointResult>,
    /// Of marks, by photograph and point.
    pub residuals: BTreeMap<(String, String), Residual>,
    /// Who looks and what was found, as shapes are made of it.
    pub witnesses: Witnesses,
    /// The model's lines in each photograph.
    pub lines: BTreeMap<String, Vec<Drawn>>,
    /// Whether anything but how cameras are held says what is level.
    pub is_level: bool,
    /// Marks that were found wrong, the worst first: photograph, point.
    pub wrong_marks: Vec<(String, String)>,
    /// What is wrong with shapes.
    pub wrong_shapes: Vec<String>,
    /// What else is to be said.
    pub notes: Vec<String>,
    /// All of it, as `cameras.json` has it.
    pub file: CamerasFile,
}

impl Outcome {
    /// The camera of a photograph.
    #[must_use]
    pub fn camera(&self, photo: &str) -> Option<&Camera> {
        match self.photos.get(photo)? {
            PhotoResult::Solved(solved) => Some(&solved.camera),
            PhotoResult::Unsolved(_) => None,
        }
    }

    /// Where a point is.
    #[must_use]
    pub fn position_m(&self, point: &str) -> Option<DVec3> {
        match self.points.get(point)? {
            PointResult::Solved(solved) => Some(solved.position_m),
            PointResult::Unsolved(_) => None,
        }
    }

    /// The lens that took a photograph.
    #[must_use]
    pub fn lens_of(&self, photo: &str) -> Option<&SolvedLens> {
        self.lenses.iter().find(|lens| lens.photos.iter().any(|name| name == photo))
    }

    /// How a mark fits.
    #[must_use]
    pub fn residual(&self, photo: &str, point: &str) -> Option<Residual> {
        self.residuals.get(&(photo.to_owned(), point.to_owned())).copied()
    }

    /// How many photographs and points are solved.
    #[must_use]
    pub fn counts(&self) -> (usize, usize) {
        let photos = self.photos.values().filter(|photo| matches!(photo, PhotoResult::Solved(_))).count();
        (photos, self.points.values().filter(|point| matches!(point, PointResult::Solved(_))).count())
    }
}

/// Solves a project, opening its photographs for what their EXIF says.
///
/// # Errors
/// Where it cannot be loaded, in words.
pub fn solved(project: &Project, text: &str) -> Result<Outcome, String> {
    let loaded = project.load().map_err(|error| error.to_string())?;
    let problem = &loaded.problem;
    let solution = solve::solve(problem, &project.params());
    let mut file = CamerasFile::new(problem, &solution);
    file.notes.extend(loaded.notes);
    let witnesses = project.witnesses(&file);
    let model = model::build(&project.file.shape, &witnesses.points, &witnesses.photographs);
    let mut residuals = BTreeMap::new();
    for (mark, result) in problem.marks.iter().zip(&solution.marks) {
        let residual = match *result {
            MarkResult::Used(off) => Residual { off, is_wrong: false },
            MarkResult::Wrong(off) => Residual { off, is_wrong: true },
            MarkResult::Idle => continue,
        };
        let name = (problem.photos[mark.photo].name.clone(), problem.points[mark.point].name.clone());
        residuals.insert(name, residual);
    }
    let off = |name: &(String, String)| residuals.get(name).map_or(0.0, |residual: &Residual| residual.off.length());
    let mut wrong_marks: Vec<(String, String)> =
        residuals.iter().filter(|(_, residual)| residual.is_wrong).map(|(name, _)| name.clone()).collect();
    wrong_marks.sort_by(|a, b| off(b).total_cmp(&off(a)));
    // Shapes are tried from the first mark on; what they lack is to be told once there are points to lack.
    let refused = model.refused.iter().filter(|_| witnesses.points.len() > 2).map(ToString::to_string);
    let noted = model.shapes.iter().flat_map(|shape| shape.notes.iter().map(|note| format!("{}: {note}", shape.shape)));
    let wrong_shapes = refused.chain(noted).collect();
    let checks = file
        .checks
        .iter()
        .filter(|check| check.off >= 0.0005)
        .map(|check| format!("{} is missed by {:.4} {}", check.what, check.off, check.unit));
    let wires = Wires::new(&model.parts);
    let lines = witnesses.photographs.iter().map(|(name, camera)| (name.clone(), wires.seen_by(camera))).collect();
    let lens = |(number, found): (usize, &LensResult)| SolvedLens {
        photos: problem.photos.iter().filter(|photo| photo.lens == number).map(|photo| photo.name.clone()).collect(),
        intrinsics: found.intrinsics,
        sigmas: found.sigmas,
        is_solved: found.solved,
    };
    Ok(Outcome {
        text: text.to_owned(),
        lenses: solution.lenses.iter().enumerate().map(lens).collect(),
        photos: problem.photos.iter().map(|photo| photo.name.clone()).zip(solution.photos).collect(),
        points: problem.points.iter().map(|point| point.name.clone()).zip(solution.points).collect(),
        residuals,
        witnesses,
        lines,
        wrong_marks,
        wrong_shapes,
        is_level: solution.alignment.level_from.is_some(),
        notes: checks.chain(folded(&file.notes)).collect(),
        file,
    })
}

/// Notes that say the same of several photographs, said once.
fn folded(notes: &[String]) -> Vec<String> {
    let mut told: Vec<(&str, &str, usize)> = Vec::new();
    for note in notes {
        let (who, what) = note.split_once(' ').unwrap_or(("", note));
        match told.iter_mut().find(|(_, known, _)| *known == what && !what.is_empty()) {
            Some((.., count)) => *count += 1,
            None => told.push((who, what, 1)),
        }
    }
    let word = |(who, what, count): (&str, &str, usize)| match count {
        1 => format!("{who} {what}").trim().to_owned(),
        _ => format!("{what} ({who} and {} more)", count - 1),
    };
    told.into_iter().map(word).collect()
}

struct Job {
    project: Project,
    text: String,
}

/// A thread that solves what it was asked last.
pub struct Solver {
    ask: Sender<Job>,
    told: Receiver<Result<Outcome, String>>,
    asked: usize,
}

impl Solver {
    /// Starts it; `wake` is called whenever something was solved.
    #[must_use]
    pub fn start(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        let (ask, jobs) = channel::<Job>();
        let (tell, told) = channel();
        thread::spawn(move || {
            while let Ok(job) = jobs.recv() {
                let result = catch_unwind(AssertUnwindSafe(|| solved(&job.project, &job.text)));
                let result = result
                    .unwrap_or_else(|_| Err("the solver broke off: undo the last marks, and report this project".to_owned()));
                if tell.send(result).is_err() {
                    return;
                }
                wake();
            }
        });
        Self { ask, told, asked: 0 }
    }

    /// Whether something is being solved.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.asked > 0
    }

    /// Asks for a solution; one at a time, so a wish while it is busy is not heard.
    pub fn solve(&mut self, project: &Project, text: &str) -> bool {
        if self.is_busy() {
            return false;
        }
        let sent = self.ask.send(Job { project: project.clone(), text: text.to_owned() }).is_ok();
        self.asked += usize::from(sent);
        sent
    }

    /// What was solved since it was asked.
    pub fn told(&mut self) -> Option<Result<Outcome, String>> {
        let told = self.told.try_recv().ok()?;
        self.asked = self.asked.saturating_sub(1);
        Some(told)
    }
}
