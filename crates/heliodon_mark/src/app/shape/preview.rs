//! The model with a shape as it is put together, and what is to be said of that shape before it is in the project.

use super::reckoned::{Meant, NewCorner};
use crate::solving::Outcome;
use crate::wires::{Drawn, Wires};
use glam::DMat3;
use heliodon_photo::model::table::ShapeRow;
use heliodon_photo::model::{Measure, Model, ModelError, NamedPoint, Part, ShapeReport, build};
use heliodon_photo::project::ProjectFile;
use std::collections::BTreeMap;

/// Seconds after the last change until its lines are drawn anew: which of them are hidden takes longer than a letter.
const REST_S: f64 = 0.25;
/// The most unknown names that are told at once.
const MOST_UNKNOWN: usize = 3;

/// A sentence about a shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::app) struct Told {
    pub words: String,
    pub is_fault: bool,
}

impl Told {
    fn fault(words: String) -> Self {
        Self { words, is_fault: true }
    }
}

/// The model as it would be.
pub(in crate::app) struct Preview {
    /// Which text was solved, and which shape of it is left out.
    of: (Option<String>, Option<String>),
    others: Vec<Part>,
    meant: Option<Result<Meant, String>>,
    parts: Vec<Part>,
    /// When it became another, where its lines are of what it was before.
    changed_at: Option<f64>,
    /// None until it rested for the first time: until then the model is seen as it was solved.
    wires: Option<Wires>,
    lines: BTreeMap<String, Vec<Drawn>>,
    told: Vec<Told>,
}

impl Preview {
    /// The model of all shapes but one that is changed.
    pub fn new(file: &ProjectFile, outcome: Option<&Outcome>, was: Option<&str>) -> Self {
        let rows: Vec<ShapeRow> = file.shape.iter().filter(|row| Some(row.name.as_str()) != was).cloned().collect();
        let others = outcome.map(|outcome| build(&rows, &outcome.witnesses.points, &outcome.witnesses.photographs).parts);
        Self {
            of: Self::key(outcome, was),
            others: others.unwrap_or_default(),
            meant: None,
            parts: Vec::new(),
            changed_at: None,
            wires: None,
            lines: BTreeMap::new(),
            told: Vec::new(),
        }
    }

    fn key(outcome: Option<&Outcome>, was: Option<&str>) -> (Option<String>, Option<String>) {
        (outcome.map(|outcome| outcome.text.clone()), was.map(str::to_owned))
    }

    /// Whether it is of what was solved last, and of that shape.
    pub fn is_of(&self, outcome: Option<&Outcome>, was: Option<&str>) -> bool {
        self.of.0.as_deref() == outcome.map(|outcome| outcome.text.as_str()) && self.of.1.as_deref() == was
    }

    /// Takes up what is meant now, and tells whether it was something else.
    pub fn follow(&mut self, meant: Result<Meant, String>, file: &ProjectFile, outcome: Option<&Outcome>, now: f64) -> bool {
        if self.meant.as_ref() == Some(&meant) {
            return false;
        }
        self.told.clear();
        let mut parts = self.others.clone();
        match &meant {
            Err(why) => self.told.push(Told::fault(why.clone())),
            Ok(Meant { row, corners }) => {
                let namesake = |other: &&ShapeRow| other.name == row.name && Some(other.name.as_str()) != self.of.1.as_deref();
                if file.shape.iter().any(|other| namesake(&other)) {
                    self.told.push(Told::fault(format!("there is a shape called {} already", row.name)));
                }
                let unknown = unknown(row, corners, file);
                self.told.extend(unknown.iter().map(|name| Told::fault(nameless(name))));
                match outcome.filter(|_| unknown.is_empty()) {
                    Some(outcome) => {
                        let mut made = made(row, corners, file, outcome);
                        parts.append(&mut made.parts);
                        self.told.extend(made.refused.iter().map(|why| Told::fault(refusal(why))));
                        self.told.extend(made.shapes.iter().flat_map(report));
                    }
                    None if unknown.is_empty() => {
                        let words = "it is seen over the photographs once its points are solved".to_owned();
                        self.told.push(Told { words, is_fault: false });
                    }
                    None => {}
                }
            }
        }
        self.parts = parts;
        self.changed_at = Some(now);
        self.meant = Some(meant);
        true
    }

    /// Takes up its lines once it rests, and tells after how many seconds that will be.
    pub fn rest(&mut self, now: f64) -> Option<f64> {
        let left = self.changed_at? + REST_S - now;
        if left <= 0.0 {
            self.draw_anew();
        }
        (left > 0.0).then_some(left)
    }

    fn draw_anew(&mut self) {
        self.wires = Some(Wires::new(&self.parts));
        self.lines.clear();
        self.changed_at = None;
    }

    /// Makes sure that its lines in a photograph are known, once it has any.
    pub fn see(&mut self, photo: &str, outcome: &Outcome) {
        let Some(wires) = &self.wires else { return };
        if let Some(camera) = outcome.camera(photo).filter(|_| !self.lines.contains_key(photo)) {
            self.lines.insert(photo.to_owned(), wires.seen_by(camera));
        }
    }

    /// Its lines in a photograph.
    pub fn lines(&self, photo: &str) -> Option<&Vec<Drawn>> {
        self.lines.get(photo)
    }

    /// Its lines in all photographs, for the model to go on with until it is solved again.
    pub fn into_lines(mut self, outcome: &Outcome) -> BTreeMap<String, Vec<Drawn>> {
        if self.changed_at.is_some() {
            self.draw_anew();
        }
        for photo in outcome.photos.keys() {
            self.see(photo, outcome);
        }
        self.lines
    }

    /// What is wrong or missing, and what it measures.
    pub fn told(&self) -> &[Told] {
        &self.told
    }
}

/// Why a shape cannot be made, if that is so. One whose points only wait for being solved can.
pub(super) fn refused(meant: &Meant, file: &ProjectFile, outcome: Option<&Outcome>) -> Option<String> {
    let Meant { row, corners } = meant;
    if let Some(name) = unknown(row, corners, file).first() {
        return Some(nameless(name));
    }
    let made = made(row, corners, file, outcome?);
    made.refused.iter().find(|why| matches!(why, ModelError::Shape { .. })).map(|why| format!("{}: {}", row.name, refusal(why)))
}

fn nameless(name: &str) -> String {
    format!("there is no point called {name}")
}

/// The first few names that are no points.
fn unknown<'r>(row: &'r ShapeRow, corners: &[NewCorner], file: &ProjectFile) -> Vec<&'r String> {
    let is_reckoned = |name: &str| corners.iter().any(|corner| corner.name == name);
    let is_marked = |name: &str| file.point.iter().any(|point| point.name == name);
    names(row).into_iter().filter(|name| !is_marked(name) && !is_reckoned(name)).take(MOST_UNKNOWN).collect()
}

/// A shape by itself.
fn made(row: &ShapeRow, corners: &[NewCorner], file: &ProjectFile, outcome: &Outcome) -> Model {
    let witnesses = &outcome.witnesses;
    let is_solved = |name: &str| witnesses.points.iter().any(|point| point.name == name);
    // corners of a shape that was made a moment ago need no solving
    let typed = file.point.iter().filter(|point| point.marks.is_empty() && !is_solved(&point.name));
    let typed = typed.filter_map(|point| Some(NewCorner { name: point.name.clone(), place_m: point.known_m?.into() }));
    let typed: Vec<NamedPoint> = typed.map(|corner| as_point(&corner)).collect();
    let points: Vec<NamedPoint> = witnesses.points.iter().cloned().chain(typed).chain(corners.iter().map(as_point)).collect();
    build(std::slice::from_ref(row), &points, &witnesses.photographs)
}

/// A corner as shapes are fitted to it: certain, and seen in no photograph.
fn as_point(corner: &NewCorner) -> NamedPoint {
    NamedPoint { name: corner.name.clone(), position: corner.place_m, covariance: DMat3::ZERO, seen_in: Vec::new() }
}

/// All points that a row names.
fn names(row: &ShapeRow) -> Vec<&String> {
    let lists = [&row.points, &row.bottom, &row.top, &row.inner, &row.outer, &row.back, &row.mirror];
    let repeats = row.repeat.iter().flat_map(|repeat| [&repeat.step, &repeat.span, &repeat.around]);
    let twos = [&row.along, &row.axis].into_iter().chain(repeats).flatten().flatten();
    let all = lists.into_iter().chain(&row.rings).chain(row.on.values()).flatten().chain(twos);
    all.filter(|name| *name != "-").collect()
}

fn refusal(error: &ModelError) -> String {
    match error {
        ModelError::Shape { why, .. } => format!("it {why}"),
        ModelError::Point { point, .. } => format!("{point} is not marked, or was not solved yet"),
        ModelError::Photograph { photograph, .. } => format!("an edge is in {photograph}, whose camera is not solved"),
    }
}

fn report(report: &ShapeReport) -> Vec<Told> {
    let measure = |measure: &Measure| {
        let name = measure.name.trim_end_matches("_m").replace('_', " ");
        let sigma = if measure.sigma > 0.0 { format!(" \u{b1}{:.3}", measure.sigma) } else { String::new() };
        format!("{name} {:.3}{sigma} m", measure.value)
    };
    let measures = report.measures.iter().map(measure).collect::<Vec<_>>().join(", ");
    let edges = report.edges.iter().filter(|edge| edge.off_px > 3.0);
    let edges = edges.map(|edge| Told::fault(format!("edge {} is {:.1} px off", edge.edge + 1, edge.off_px)));
    let notes = report.notes.iter().map(|note| Told::fault(note.clone())).chain(edges);
    let told = if measures.is_empty() { "it can be made".to_owned() } else { measures };
    std::iter::once(Told { words: told, is_fault: false }).chain(notes).collect()
}
