//! The window itself, without what opens it: it runs in any egui context, and so in tests.

mod actions;
mod dialogs;
mod input;
mod keys;
mod marking;
mod overlay;
mod paint;
mod panels;
mod panes;
mod shape;

use crate::document::Document;
use crate::pictures::{Loading, Pictures, Tiles, View};
use crate::solving::{Outcome, Solver};
use dialogs::Dialog;
use eframe::egui::{self, Context, Event, TextureHandle, Ui};
use glam::DVec2;
use heliodon_photo::formats::cameras_file::CAMERAS_FILE_NAME;
use heliodon_photo::project::AxisEntry;
use marking::Drag;
use shape::{Preview, ShapeDraft, Which};
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::sync::Arc;

/// Seconds between writes of unsaved work beside the project.
const AUTOSAVE_S: f64 = 10.0;
/// Seconds of rest after which a change is solved.
const SOLVE_AFTER_S: f64 = 0.6;
/// Seconds between looks at whether another program wrote the project.
const WATCH_S: f64 = 1.0;
/// The most panes.
const MOST_PANES: usize = 4;

/// So many marks.
fn marks_told(count: usize) -> String {
    if count == 1 { "1 mark".to_owned() } else { format!("{count} marks") }
}

/// What the pointer does.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Tool {
    /// Marks the active point.
    Mark,
    /// Draws edges along an axis of the building, from end to end.
    Edge { axis: AxisEntry, first: Option<(usize, DVec2)> },
    /// Draws an edge of the shape that is put together: between two of its corners, or along the side of a shaft.
    Witness { which: Which, first: Option<(usize, DVec2)> },
}

/// One of the photographs side by side.
#[derive(Clone, Debug, Default)]
struct Pane {
    photo: usize,
    view: Option<View>,
    /// Where the keyboard's cursor is, pixels of the photograph.
    cursor: Option<DVec2>,
    /// What is to be brought into the middle once the photograph is there.
    goal: Option<DVec2>,
}

/// What is drawn over photographs, and how.
#[derive(Clone, Copy, Debug)]
struct Shown {
    /// By how much residuals are drawn longer; 0 for not at all.
    residuals: f64,
    model: bool,
    lines: bool,
    names: bool,
    snap: bool,
    solve_as_marked: bool,
}

/// What the status line tells of what was done last.
#[derive(Clone, Debug)]
struct Message {
    text: String,
    is_fault: bool,
}

/// Dark, so that photographs are the brightest there is, and small words large enough to be read.
pub fn dress(ctx: &Context) {
    ctx.set_theme(egui::Theme::Dark);
    ctx.all_styles_mut(|style| {
        style.text_styles.insert(egui::TextStyle::Small, egui::FontId::proportional(12.0));
        style.visuals.widgets.noninteractive.fg_stroke.color = egui::Color32::from_gray(205);
    });
}

/// The window for marks.
pub struct MarkApp {
    document: Document,
    solver: Solver,
    outcome: Option<Outcome>,
    /// Why the last solve failed, or which text was solved last.
    solve_fault: Option<String>,
    asked_text: Option<String>,
    pictures: Pictures,
    tiles: Tiles,
    small: BTreeMap<String, TextureHandle>,
    panes: [Pane; MOST_PANES],
    pane_count: usize,
    active_pane: usize,
    active_point: Option<String>,
    selected: Vec<String>,
    tool: Tool,
    cursor_mode: bool,
    drag: Option<Drag>,
    dialog: Dialog,
    /// What is asked again if the window is not closed after all.
    waiting: Dialog,
    /// Whether what is asked now is about closing the window.
    is_closing: bool,
    /// The shape whose edges are drawn meanwhile.
    aside: Option<Box<ShapeDraft>>,
    preview: Option<Preview>,
    search: String,
    focus_search: bool,
    scroll_to_point: bool,
    shown: Shown,
    message: Option<Message>,
    tabs: i32,
    /// What was pressed after a key that opens or closes a dialog, for the next frame.
    held_back: Vec<Event>,
    seen_text: String,
    changed_at: f64,
    autosaved_at: f64,
    watched_at: f64,
    may_close: bool,
}

impl MarkApp {
    /// A window on a document. `wake` asks for another frame, from any thread.
    #[must_use]
    pub fn new(document: Document, wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        let photos = document.project().file.photo.len();
        let mut panes: [Pane; MOST_PANES] = Default::default();
        for (i, pane) in panes.iter_mut().enumerate() {
            pane.photo = i.min(photos.saturating_sub(1));
        }
        let dialog = if document.has_left_work() { Dialog::LeftWork } else { Dialog::None };
        let shown = Shown { residuals: 10.0, model: true, lines: true, names: true, snap: true, solve_as_marked: true };
        Self {
            active_point: document.project().file.point.first().map(|point| point.name.clone()),
            seen_text: document.text().to_owned(),
            document,
            solver: Solver::start(Arc::clone(&wake)),
            outcome: None,
            solve_fault: None,
            asked_text: None,
            pictures: Pictures::start(wake),
            tiles: Tiles::default(),
            small: BTreeMap::new(),
            panes,
            pane_count: photos.clamp(1, 2),
            active_pane: 0,
            selected: Vec::new(),
            tool: Tool::Mark,
            cursor_mode: false,
            drag: None,
            dialog,
            waiting: Dialog::None,
            is_closing: false,
            aside: None,
            preview: None,
            search: String::new(),
            focus_search: false,
            scroll_to_point: false,
            shown,
            message: None,
            tabs: 0,
            held_back: Vec::new(),
            changed_at: f64::NEG_INFINITY,
            autosaved_at: 0.0,
            watched_at: 0.0,
            may_close: false,
        }
    }

    /// The document that is worked on.
    #[must_use]
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// What was solved last.
    #[must_use]
    pub fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }

    /// The point that is being marked.
    #[must_use]
    pub fn active_point(&self) -> Option<&str> {
        self.active_point.as_deref()
    }

    /// What a pane shows, once it has been drawn.
    #[must_use]
    pub fn view(&self, pane: usize) -> Option<View> {
        self.panes.get(pane)?.view
    }

    /// Whether photographs are still being decoded or cameras solved.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.solver.is_busy() || self.pictures.is_busy(self.document.project().file.photo.len())
    }

    /// What the status line says of what was done last.
    #[must_use]
    pub fn message(&self) -> Option<&str> {
        self.message.as_ref().map(|message| message.text.as_str())
    }

    /// One frame.
    pub fn show(&mut self, ui: &mut Ui) {
        let ctx = ui.ctx().clone();
        let now = ctx.input(|input| input.time);
        self.tiles.begin_frame();
        self.ask_for_pictures();
        self.hear_solver();
        self.handle_close(&ctx);
        self.handle_keys(&ctx);
        self.top_bar(ui);
        self.status_line(ui);
        self.photo_list(ui);
        self.point_list(ui);
        self.show_panes(ui);
        self.show_dialog(&ctx);
        self.follow_draft(&ctx);
        self.look_after(&ctx, now);
    }

    fn ask_for_pictures(&mut self) {
        let project = self.document.project();
        let wish = |photo: &heliodon_photo::project::PhotoEntry| (photo.name().to_owned(), project.folder().join(&photo.file));
        let all: Vec<(String, PathBuf)> = project.file.photo.iter().map(wish).collect();
        let mut order: Vec<usize> = (0..self.pane_count).collect();
        // The one that is worked in first.
        order.sort_by_key(|pane| *pane != self.active_pane);
        let looked_at: Vec<(String, PathBuf)> =
            order.iter().filter_map(|pane| all.get(self.panes[*pane].photo).cloned()).collect();
        self.pictures.want(&looked_at, &all);
    }

    fn hear_solver(&mut self) {
        match self.solver.told() {
            None => {}
            Some(Err(why)) => self.solve_fault = Some(why),
            Some(Ok(outcome)) => {
                let (cameras, points) = outcome.counts();
                let had = self.outcome.as_ref().map_or(0, |before| before.counts().0);
                if cameras == 0 && had > 0 {
                    // What was solved is kept; why it no longer is stands in the notes.
                    let why = outcome.notes.first().cloned();
                    self.solve_fault = Some(why.unwrap_or_else(|| "no camera can be solved any more".to_owned()));
                    return;
                }
                self.solve_fault = None;
                let all = outcome.photos.len();
                self.say(format!("{cameras} of {all} photographs and {points} points solved"));
                self.outcome = Some(outcome);
                self.write_cameras();
            }
        }
    }

    /// Writes `cameras.json`, where what was solved is what is saved: for the commands that go on from there.
    fn write_cameras(&mut self) {
        let Some(outcome) = &self.outcome else { return };
        if self.document.is_changed() || outcome.text != self.document.text() || outcome.counts().0 == 0 {
            return;
        }
        let path = self.document.project().folder().join(CAMERAS_FILE_NAME);
        let written = outcome.file.text().map_err(|error| error.to_string());
        if let Err(why) = written.and_then(|text| fs::write(&path, text).map_err(|error| error.to_string())) {
            self.complain(format!("{}: {why}", path.display()));
        }
    }

    /// What has to be done from time to time.
    fn look_after(&mut self, ctx: &Context, now: f64) {
        if self.seen_text != self.document.text() {
            self.document.text().clone_into(&mut self.seen_text);
            self.changed_at = now;
            self.forget_what_is_gone();
        }
        let is_resting = self.drag.is_none() && now - self.changed_at > SOLVE_AFTER_S;
        let is_new = self.asked_text.as_deref() != Some(self.document.text());
        let has_marks = self.document.project().file.point.iter().any(|point| !point.marks.is_empty());
        if self.shown.solve_as_marked && is_resting && is_new && has_marks && !self.solver.is_busy() {
            self.solve();
        }
        // what was let go of on closing is not written once more
        if now - self.autosaved_at > AUTOSAVE_S && !self.may_close {
            self.autosaved_at = now;
            if let Err(error) = self.document.autosave() {
                self.complain(error.to_string());
            }
        }
        if now - self.watched_at > WATCH_S {
            self.watched_at = now;
            let is_ours_changed = self.document.is_changed();
            if self.document.changed_outside().is_some() && self.dialog == Dialog::None {
                if is_ours_changed {
                    self.dialog = Dialog::ChangedOutside;
                } else {
                    match self.document.take_theirs() {
                        Ok(()) => self.say("the project was changed by another program, and read again".to_owned()),
                        Err(error) => {
                            self.complain(error.to_string());
                            self.dialog = Dialog::ChangedOutside;
                        }
                    }
                }
            }
        }
        // A window that nobody touches draws itself no oftener than it has to look at its file: without a graphics card each frame is work.
        let is_due = self.shown.solve_as_marked && is_new && has_marks;
        let wait = if !self.held_back.is_empty() {
            0.0
        } else if self.is_busy() {
            0.1
        } else if is_due {
            0.4
        } else {
            WATCH_S as f32
        };
        ctx.request_repaint_after_secs(wait);
    }

    fn forget_what_is_gone(&mut self) {
        let file = &self.document.project().file;
        let is_there = |name: &String| file.point.iter().any(|point| point.name == *name);
        self.selected.retain(is_there);
        self.active_point = self.active_point.take().filter(is_there);
        for pane in &mut self.panes {
            pane.photo = pane.photo.min(file.photo.len().saturating_sub(1));
        }
    }

    fn say(&mut self, text: String) {
        self.message = Some(Message { text, is_fault: false });
    }

    fn complain(&mut self, text: String) {
        self.message = Some(Message { text, is_fault: true });
    }

    /// The name of the photograph in a pane.
    fn photo_in(&self, pane: usize) -> Option<String> {
        Some(self.document.project().file.photo.get(self.panes.get(pane)?.photo)?.name().to_owned())
    }

    fn picture_in(&self, pane: usize) -> Option<Arc<crate::pictures::Picture>> {
        match self.pictures.get(&self.photo_in(pane)?) {
            Loading::Ready(picture) => Some(picture),
            _ => None,
        }
    }

    /// Where a point is marked in a photograph.
    fn mark(&self, point: &str, photo: &str) -> Option<DVec2> {
        if let Some(drag) = self.drag.as_ref().filter(|drag| drag.point == point && drag.photo == photo) {
            return Some(drag.pixel);
        }
        let entry = self.document.project().file.point.iter().find(|entry| entry.name == point)?;
        entry.marks.get(photo).map(|pixel| DVec2::from(*pixel))
    }
}
