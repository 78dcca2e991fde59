//! Cameras, points and the model, solved on a thread of their own while marks go on being set.

use glam::{DVec2, DVec3};
use heliodon_photo::camera::Camera;
use heliodon_photo::formats::cameras_file::CamerasFile;
use heliodon_photo::model::{self, Part};
use heliodon_photo::project::Project;
use heliodon_photo::solve::{self, MarkResult, PhotoResult, PointResult};
use std::collections::{BTreeMap, BTreeSet};
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

/// A line of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wire {
    /// Both ends, metres.
    pub ends: [DVec3; 2],
    /// Whether a face that is smooth goes on beyond it.
    pub is_inner: bool,
}

/// What was solved, told by names: points and photographs may come and go in the meantime.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The project's text that it was solved from.
    pub text: String,
    /// Of photographs.
    pub photos: BTreeMap<String, PhotoResult>,
    /// Of points.
    pub points: BTreeMap<String, PointResult>,
    /// Of marks, by photograph and point.
    pub residuals: BTreeMap<(String, String), Residual>,
    /// The model's lines.
    pub wires: Vec<Wire>,
    /// What is wrong with marks and shapes, the worst first.
    pub wrong: Vec<String>,
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
    let mut wrong = file.wrong_marks.clone();
    // Shapes are tried from the first mark on; what they lack is to be told once there are points to lack.
    if witnesses.points.len() > 2 {
        wrong.extend(model.refused.iter().map(ToString::to_string));
    }
    wrong.extend(model.shapes.iter().flat_map(|shape| shape.notes.iter().map(|note| format!("{}: {note}", shape.shape))));
    Ok(Outcome {
        text: text.to_owned(),
        photos: problem.photos.iter().map(|photo| photo.name.clone()).zip(solution.photos).collect(),
        points: problem.points.iter().map(|point| point.name.clone()).zip(solution.points).collect(),
        residuals,
        wires: model.parts.iter().flat_map(wires).collect(),
        wrong,
        notes: file.notes.clone(),
        file,
    })
}

/// Edges at which a part's faces end, and those within faces that are smooth. Diagonals of flat faces are no lines.
fn wires(part: &Part) -> Vec<Wire> {
    let place = |vertex: u32| part.mesh.positions[vertex as usize];
    let key = |vertex: u32| place(vertex).to_array().map(f32::to_bits);
    let mut edges: BTreeMap<[[u32; 3]; 2], Edge> = BTreeMap::new();
    for (triangle, face) in part.mesh.triangles.iter().zip(&part.face) {
        for [a, b] in [[0, 1], [1, 2], [2, 0]].map(|ends: [usize; 2]| ends.map(|i| triangle[i])) {
            let mut ends = [key(a), key(b)];
            ends.sort_unstable();
            let edge = edges.entry(ends).or_insert(Edge { vertices: [a, b], triangles: 0, faces: BTreeSet::new() });
            edge.triangles += 1;
            edge.faces.insert(*face);
        }
    }
    let smooth = |face: &u32| part.smooth.get(*face as usize).copied().unwrap_or(false);
    let wire = |edge: &Edge| {
        let is_border = edge.faces.len() > 1 || edge.triangles == 1;
        let is_inner = !is_border && edge.faces.iter().any(smooth);
        (is_border || is_inner).then(|| Wire { ends: edge.vertices.map(|v| place(v).as_dvec3()), is_inner })
    };
    edges.values().filter_map(wire).collect()
}

struct Edge {
    vertices: [u32; 2],
    triangles: usize,
    faces: BTreeSet<u32>,
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
