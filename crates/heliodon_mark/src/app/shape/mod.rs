//! Shapes put together beside the photographs: which point is which corner, how often it stands, what the model then looks like.

mod diagram;
mod draft;
mod fields;
mod line;
mod preview;
mod reckoned;
mod roles;

pub(super) use draft::ShapeDraft;
pub(super) use preview::Preview;
pub(super) use roles::Which;

use super::dialogs::{Dialog, FAULT, choices, sheet, turned_page};
use super::panels::GOOD;
use super::{MarkApp, Tool};
use crate::document::Edit;
use eframe::egui::{Context, Label, Pos2, RichText, Ui};
use glam::DVec2;
use reckoned::{Meant, NewCorner, meant};

/// What is to become of a shape's dialog.
enum Wish {
    Make,
    Remove,
    Leave,
    /// Another shape of the project, or with nothing a new one.
    Open(Option<String>),
    /// Edges are drawn in the photographs.
    Draw,
}

impl MarkApp {
    /// A new shape of the chosen points.
    pub(super) fn begin_shape(&mut self) {
        let shapes = &self.document.project().file.shape;
        let is_free = |name: &String| shapes.iter().all(|shape| shape.name != *name);
        let name = (1..).map(|n| format!("shape {n}")).find(is_free).unwrap_or_default();
        let is_level = self.outcome.as_ref().is_none_or(|outcome| outcome.is_level);
        self.dialog = Dialog::Shape(Box::new(ShapeDraft::begun(&self.selected, name, shapes.last(), is_level)));
    }

    /// Opens a shape of the project to change it.
    pub(super) fn open_shape(&mut self, name: &str) {
        if let Some(row) = self.document.project().file.shape.iter().find(|row| row.name == name) {
            self.dialog = Dialog::Shape(Box::new(ShapeDraft::of_row(row)));
        }
    }

    /// Opens the shape that the active point belongs to, or else the first.
    pub(super) fn open_some_shape(&mut self) {
        let shapes = &self.document.project().file.shape;
        let active = self.active_point.as_deref();
        let has_active = |draft: &ShapeDraft| active.is_some_and(|point| draft.place_of(point).is_some());
        let drafts: Vec<ShapeDraft> = shapes.iter().map(ShapeDraft::of_row).collect();
        match drafts.iter().find(|draft| has_active(draft)).or(drafts.first()) {
            Some(draft) => self.dialog = Dialog::Shape(Box::new(draft.clone())),
            None => self.say("there is no shape yet: choose points with X and make one with B".to_owned()),
        }
    }

    /// What an open dialog about a shape says of it.
    #[must_use]
    pub fn told_of_shape(&self) -> Vec<&str> {
        self.preview.iter().flat_map(|preview| preview.told()).map(|told| told.words.as_str()).collect()
    }

    /// The shape that is put together, also while its edges are drawn.
    pub(super) fn draft(&self) -> Option<&ShapeDraft> {
        match &self.dialog {
            Dialog::Shape(draft) => Some(draft),
            _ => self.aside.as_deref(),
        }
    }

    /// A click in a photograph while a shape is put together: the point that is marked there goes into the active place.
    pub(super) fn pick_at(&mut self, pane: usize, at: Pos2) {
        self.active_pane = pane;
        match self.mark_at(pane, at) {
            Some((name, _)) => self.pick(&name),
            None => self.say("click the mark of a point: it goes into the place that is yellow in the dialog".to_owned()),
        }
    }

    /// A point goes into the active place, where a shape is put together.
    pub(super) fn pick(&mut self, name: &str) {
        if let Dialog::Shape(draft) = &mut self.dialog {
            draft.pick(name);
        }
    }

    /// The dialog makes room for edges to be drawn.
    fn draw_edges(&mut self, draft: &ShapeDraft) {
        let known = roles::edges(draft.kind, draft.main_points().len());
        let which = known.get(draft.edge).copied().unwrap_or(Which::Side);
        self.tool = Tool::Witness { which, first: None };
        self.aside = Some(Box::new(draft.clone()));
        self.say("click both ends of the edge, in any photographs; Esc goes back to the shape".to_owned());
    }

    /// Back to the dialog.
    pub(super) fn end_drawing(&mut self) {
        self.tool = Tool::Mark;
        if let Some(draft) = self.aside.take() {
            self.dialog = Dialog::Shape(draft);
        }
    }

    /// An edge that was drawn between two pixels of a photograph.
    pub(super) fn add_witness(&mut self, photograph: String, which: Which, ends: [DVec2; 2]) {
        let [from, to] = ends.map(|end| end.to_array().map(|x| (x * 100.0).round() / 100.0));
        if from == to {
            self.complain("an edge needs two different ends".to_owned());
        } else if let Some(draft) = &mut self.aside {
            draft.edges.push(which.row(photograph, [from, to]));
            let edge = roles::edge(draft.kind, which);
            self.say(format!("{edge} edge drawn; draw another, or Esc to go back to the shape"));
        }
    }

    /// What an edge is called that is drawn now.
    pub(super) fn witness_name(&self, which: Which) -> String {
        self.draft().map_or_else(|| "side".to_owned(), |draft| roles::edge(draft.kind, which))
    }

    /// The preview follows the draft, and is gone without one.
    pub(super) fn follow_draft(&mut self, ctx: &Context) {
        let outcome = self.outcome.as_ref();
        let file = &self.document.project().file;
        let Some((meant, was)) = self.draft().map(|draft| (meant(draft, file, outcome), draft.was.clone())) else {
            self.preview = None;
            return;
        };
        let kept = self.preview.take().filter(|preview| preview.is_of(outcome, was.as_deref()));
        let mut preview = kept.unwrap_or_else(|| Preview::new(file, outcome, was.as_deref()));
        let now = ctx.input(|input| input.time);
        if preview.follow(meant, file, outcome, now) {
            ctx.request_repaint();
        }
        if let Some(left_s) = preview.rest(now) {
            ctx.request_repaint_after_secs(left_s as f32);
        }
        if let Some(outcome) = outcome {
            for pane in 0..self.pane_count {
                if let Some(photo) = self.photo_in(pane) {
                    preview.see(&photo, outcome);
                }
            }
        }
        self.preview = Some(preview);
    }

    /// Whether a draft says what the project does not.
    pub(super) fn is_unmade(&self, draft: &ShapeDraft) -> bool {
        let shapes = &self.document.project().file.shape;
        match &draft.was {
            Some(was) => shapes.iter().find(|row| row.name == *was).is_none_or(|row| draft.row().as_ref() != Ok(row)),
            None => !draft.main_points().is_empty(),
        }
    }

    /// Puts the shape into the project.
    pub(super) fn make(&mut self, draft: &ShapeDraft) -> bool {
        let (file, outcome) = (&self.document.project().file, self.outcome.as_ref());
        let meant = meant(draft, file, outcome).and_then(|meant| match preview::refused(&meant, file, outcome) {
            Some(why) => Err(why),
            None => Ok(meant),
        });
        let Meant { row, corners } = match meant {
            Ok(meant) => meant,
            Err(why) => {
                self.complain(why);
                return false;
            }
        };
        let is_namesake = |name: &String| *name == row.name && Some(name) != draft.was.as_ref();
        if self.document.project().file.shape.iter().any(|shape| is_namesake(&shape.name)) {
            self.complain(format!("there is a shape called {} already", row.name));
            return false;
        }
        let points = corners.into_iter().flat_map(|NewCorner { name, place_m }| {
            [Edit::AddPoint { name: name.clone() }, Edit::SetKnown { name, known_m: Some(place_m.to_array()) }]
        });
        let shape = match draft.was.clone() {
            Some(was) => Edit::SetShape { was, row: Box::new(row) },
            None => Edit::AddShape(Box::new(row)),
        };
        if !self.edit(&Edit::Together(points.chain([shape]).collect())) {
            return false;
        }
        // the model goes on as it was seen here, until it is solved again
        if let (Some(preview), Some(outcome)) = (self.preview.take(), &mut self.outcome) {
            outcome.lines = preview.into_lines(outcome);
        }
        self.selected.clear();
        true
    }

    pub(super) fn ask_shape(&mut self, ctx: &Context, draft: &mut ShapeDraft) -> bool {
        let file = &self.document.project().file;
        let names: Vec<String> = file.point.iter().map(|point| point.name.clone()).collect();
        let shapes: Vec<String> = file.shape.iter().map(|shape| shape.name.clone()).collect();
        let told = self.preview.as_ref().map(|preview| preview.told().to_vec()).unwrap_or_default();
        let chosen = self.selected.clone();
        let title = if draft.was.is_some() { "Shape" } else { "New shape" };
        let turned = turned_page(ctx, draft.was.as_ref(), &shapes).map(|name| Wish::Open(Some(name)));
        let is_new = draft.was.is_none();
        fields::keys(ctx, draft, &chosen);
        let contents = |ui: &mut Ui| {
            ui.set_width(610.0);
            let opened = fields::heading(ui, draft, &shapes, &chosen);
            ui.separator();
            ui.horizontal_top(|ui| {
                ui.vertical(|ui| {
                    ui.set_width(340.0);
                    fields::places(ui, draft, &names);
                });
                ui.vertical(|ui| {
                    if let Some(place) = diagram::show(ui, draft) {
                        (draft.active, draft.focus) = (place, Some(place));
                    }
                    fields::picker(ui, draft, &names);
                });
            });
            ui.separator();
            let drawn = fields::settings(ui, draft, &names);
            fields::spread_left(ui, draft, &names);
            draft.tidy();
            opened.or(drawn)
        };
        // what is missing stands beside the buttons, never out of sight
        let buttons = |ui: &mut Ui| {
            for told in &told {
                let colour = if told.is_fault { FAULT } else { GOOD };
                ui.add(Label::new(RichText::new(&told.words).color(colour)).wrap());
            }
            let (words, wishes) = if is_new {
                (&["Make", "Cancel"][..], vec![Wish::Make, Wish::Leave])
            } else {
                (&["Change", "Remove the shape", "Cancel"][..], vec![Wish::Make, Wish::Remove, Wish::Leave])
            };
            choices(ui, words, true).and_then(|choice| wishes.into_iter().nth(choice))
        };
        let wished = sheet(ctx, title, contents, buttons);
        match turned.or(wished) {
            None => true,
            Some(Wish::Leave) => false,
            Some(Wish::Make) => !self.make(draft),
            Some(Wish::Remove) => {
                let name = draft.was.clone().unwrap_or_default();
                !self.edit(&Edit::RemoveShape { name })
            }
            Some(Wish::Draw) => {
                self.draw_edges(draft);
                false
            }
            Some(Wish::Open(next)) => {
                // what was changed is put into the project before another is opened
                if self.is_unmade(draft) && !self.make(draft) {
                    return true;
                }
                match next {
                    Some(name) => self.open_shape(&name),
                    None => self.begin_shape(),
                }
                false
            }
        }
    }
}
