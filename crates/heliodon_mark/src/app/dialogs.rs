//! What is asked in a window of its own.

use super::MarkApp;
use super::keys::HELP;
use crate::document::Edit;
use eframe::egui::{self, Align2, Color32, ComboBox, Context, Key, RichText, TextEdit, Ui, ViewportCommand};
use heliodon_photo::model::table::{Kind, ShapeRow};

/// What is asked.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Dialog {
    None,
    Help,
    /// Work that a crash left.
    LeftWork,
    /// Another program wrote the project.
    ChangedOutside,
    /// There is unsaved work.
    Close,
    Rename {
        from: String,
        to: String,
    },
    Distance {
        between: [String; 2],
        metres: String,
    },
    Shape(Box<ShapeDraft>),
}

/// A shape as it is put together.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ShapeDraft {
    name: String,
    kind: Kind,
    /// What each list of the kind has, as names between commas.
    lists: Vec<String>,
    watertight: bool,
    upright: bool,
}

/// The lists of points that a kind has, and what they mean.
fn lists(kind: Kind) -> &'static [(&'static str, &'static str)] {
    match kind {
        Kind::Polygon => &[("points", "corners, in order")],
        Kind::Box => {
            &[("points", "four bottom corners counter-clockwise from above, then those above them; - for one not marked")]
        }
        Kind::Gable => {
            &[("points", "four eaves counter-clockwise from above, the first two along the ridge, then the ridge's ends")]
        }
        Kind::Cylinder | Kind::Column => {
            &[("bottom", "on the lower rim"), ("top", "on the upper rim"), ("points", "anywhere on it")]
        }
        Kind::Arch => &[("inner", "inner edge from springing to springing"), ("outer", "outer edge"), ("back", "on its back")],
        Kind::Revolution => &[("rings", "rings from the bottom up, with a ; between them")],
        Kind::Extrusion => &[("points", "corners, in order"), ("along", "two points: from, to")],
    }
}

const KINDS: [(Kind, &str); 8] = [
    (Kind::Polygon, "polygon"),
    (Kind::Box, "box"),
    (Kind::Gable, "gable"),
    (Kind::Cylinder, "cylinder"),
    (Kind::Column, "column"),
    (Kind::Arch, "arch"),
    (Kind::Revolution, "revolution"),
    (Kind::Extrusion, "extrusion"),
];

impl ShapeDraft {
    pub fn of(points: &[String], name: String) -> Self {
        let kind = if points.len() > 4 { Kind::Box } else { Kind::Polygon };
        let mut draft = Self { name, kind, lists: Vec::new(), watertight: false, upright: false };
        draft.become_kind(kind, points);
        draft
    }

    fn become_kind(&mut self, kind: Kind, points: &[String]) {
        self.kind = kind;
        self.lists = vec![String::new(); lists(kind).len()];
        self.lists[0] = points.join(", ");
        self.watertight = !matches!(kind, Kind::Polygon);
        self.upright = false;
    }

    fn may_be_upright(&self) -> bool {
        matches!(self.kind, Kind::Box | Kind::Gable | Kind::Cylinder | Kind::Column | Kind::Revolution)
    }

    /// The row, or what it lacks.
    fn row(&self) -> Result<ShapeRow, String> {
        let names = |text: &str| -> Vec<String> {
            text.split([',', ';']).map(str::trim).filter(|name| !name.is_empty()).map(str::to_owned).collect()
        };
        let mut row = ShapeRow {
            name: self.name.trim().to_owned(),
            kind: self.kind,
            watertight: self.watertight,
            upright: self.upright && self.may_be_upright(),
            part: None,
            points: Vec::new(),
            on: Default::default(),
            bottom: Vec::new(),
            top: Vec::new(),
            inner: Vec::new(),
            outer: Vec::new(),
            back: Vec::new(),
            rings: Vec::new(),
            along: None,
            axis: None,
            edges: Vec::new(),
            depth_m: None,
            flatten: false,
            entasis: false,
            sides: None,
            mirror: Vec::new(),
            repeat: None,
            tolerance_m: None,
        };
        for ((list, _), text) in lists(self.kind).iter().zip(&self.lists) {
            match *list {
                "points" => row.points = names(text),
                "bottom" => row.bottom = names(text),
                "top" => row.top = names(text),
                "inner" => row.inner = names(text),
                "outer" => row.outer = names(text),
                "back" => row.back = names(text),
                "rings" => row.rings = text.split(';').map(names).filter(|ring| !ring.is_empty()).collect(),
                _ => {
                    let ends = <[String; 2]>::try_from(names(text));
                    row.along = Some(ends.map_err(|_| "along needs two points".to_owned())?);
                }
            }
        }
        if row.name.is_empty() {
            return Err("a shape needs a name".to_owned());
        }
        let named = [&row.points, &row.bottom, &row.top, &row.inner, &row.outer, &row.rings.concat()].map(|list| list.len());
        if named.iter().all(|count| *count == 0) {
            return Err("name points, or choose them with X first".to_owned());
        }
        Ok(row)
    }
}

impl MarkApp {
    pub(super) fn new_shape_name(&self) -> String {
        let shapes = &self.document.project().file.shape;
        let is_free = |name: &String| shapes.iter().all(|shape| shape.name != *name);
        (1..).map(|n| format!("shape {n}")).find(is_free).unwrap_or_default()
    }

    pub(super) fn begin_distance(&mut self) {
        match <[String; 2]>::try_from(self.selected.clone()) {
            Ok(between) => {
                let [a, b] = &between;
                let known = |names: &[String; 2]| names.contains(a) && names.contains(b);
                let found = self.document.project().file.distance.iter().find(|entry| known(&entry.between));
                let metres = found.map(|entry| entry.metres.to_string()).unwrap_or_default();
                self.dialog = Dialog::Distance { between, metres };
            }
            Err(chosen) => {
                self.say(format!("a distance lies between two points: choose them with X ({} are chosen)", chosen.len()))
            }
        }
    }

    pub(super) fn show_dialog(&mut self, ctx: &Context) {
        let mut dialog = std::mem::replace(&mut self.dialog, Dialog::None);
        let stays = match &mut dialog {
            Dialog::None => false,
            Dialog::Help => help(ctx),
            Dialog::LeftWork => self.left_work(ctx),
            Dialog::ChangedOutside => self.ask_about_theirs(ctx),
            Dialog::Close => self.ask_about_closing(ctx),
            Dialog::Rename { from, to } => self.ask_name(ctx, from, to),
            Dialog::Distance { between, metres } => self.ask_distance(ctx, between, metres),
            Dialog::Shape(draft) => self.ask_shape(ctx, draft),
        };
        // What it did may have opened another.
        if stays && self.dialog == Dialog::None {
            self.dialog = dialog;
        }
    }

    fn left_work(&mut self, ctx: &Context) -> bool {
        window(ctx, "Unsaved work", |ui| {
            ui.label("The last time, this project was not closed. What had not been saved was found beside it.");
            choices(ui, &["Take it up", "Forget it"], false)
        })
        .is_none_or(|choice| {
            match choice {
                0 => match self.document.take_up() {
                    Ok(()) => self.say("unsaved work taken up; Ctrl+Z goes back to what was saved".to_owned()),
                    Err(error) => self.complain(error.to_string()),
                },
                _ => self.document.forget_unsaved(),
            }
            false
        })
    }

    fn ask_about_theirs(&mut self, ctx: &Context) -> bool {
        window(ctx, "The project was changed", |ui| {
            ui.label("Another program wrote photos.toml since it was read here.");
            choices(ui, &["Take theirs", "Keep mine"], true)
        })
        .is_none_or(|choice| {
            if choice == 0 {
                match self.document.take_theirs() {
                    Ok(()) => self.say("read again; Ctrl+Z goes back to what was here".to_owned()),
                    Err(error) => self.complain(error.to_string()),
                }
            } else {
                self.document.keep_ours();
                self.say("kept; the next save replaces what the other program wrote".to_owned());
            }
            false
        })
    }

    fn ask_about_closing(&mut self, ctx: &Context) -> bool {
        window(ctx, "Save before closing?", |ui| {
            ui.label("There are changes that have not been saved.");
            choices(ui, &["Save", "Do not save", "Stay"], true)
        })
        .is_none_or(|choice| {
            let closes = match choice {
                0 => self.save(),
                1 => {
                    self.document.forget_unsaved();
                    true
                }
                _ => false,
            };
            if closes {
                self.may_close = true;
                ctx.send_viewport_cmd(ViewportCommand::Close);
            }
            false
        })
    }

    fn ask_name(&mut self, ctx: &Context, from: &str, to: &mut String) -> bool {
        let done = window(ctx, "Rename", |ui| {
            ui.label(format!("Another name for {from}:"));
            let field = ui.add(TextEdit::singleline(to).desired_width(260.0));
            focus_once(ui, &field);
            finished(ui, "Rename")
        });
        done.is_none_or(|is_wanted| {
            let (from, to) = (from.to_owned(), to.trim().to_owned());
            if is_wanted && self.edit(&Edit::RenamePoint { from: from.clone(), to: to.clone() }) {
                self.selected.iter_mut().filter(|name| **name == from).for_each(|name| name.clone_from(&to));
                self.active_point = Some(to);
            }
            false
        })
    }

    fn ask_distance(&mut self, ctx: &Context, between: &[String; 2], metres: &mut String) -> bool {
        let done = window(ctx, "Distance", |ui| {
            ui.label(format!("{} to {}, metres:", between[0], between[1]));
            let field = ui.add(TextEdit::singleline(metres).desired_width(160.0));
            focus_once(ui, &field);
            finished(ui, "Set")
        });
        done.is_none_or(|is_wanted| {
            if is_wanted {
                match metres.trim().replace(',', ".").parse::<f64>() {
                    Ok(metres) => {
                        self.edit(&Edit::SetDistance { between: between.clone(), metres });
                    }
                    Err(_) => self.complain(format!("\"{metres}\" is no number of metres")),
                }
            }
            false
        })
    }

    fn ask_shape(&mut self, ctx: &Context, draft: &mut ShapeDraft) -> bool {
        let selected = self.selected.clone();
        let done = window(ctx, "Shape", |ui| {
            ui.horizontal(|ui| {
                ui.label("Name");
                let field = ui.add(TextEdit::singleline(&mut draft.name).desired_width(200.0));
                focus_once(ui, &field);
                let mut kind = draft.kind;
                let word = KINDS.iter().find(|(known, _)| *known == kind).map_or("", |(_, word)| word);
                ComboBox::from_id_salt("kind").selected_text(word).show_ui(ui, |ui| {
                    for (each, word) in KINDS {
                        ui.selectable_value(&mut kind, each, word);
                    }
                });
                if kind != draft.kind {
                    draft.become_kind(kind, &selected);
                }
            });
            for ((list, meaning), text) in lists(draft.kind).iter().zip(&mut draft.lists) {
                ui.label(RichText::new(format!("{list}: {meaning}")).small());
                ui.add(TextEdit::singleline(text).desired_width(460.0));
            }
            ui.horizontal(|ui| {
                ui.checkbox(&mut draft.watertight, "closed");
                if draft.may_be_upright() {
                    ui.checkbox(&mut draft.upright, "upright");
                }
            });
            let row = draft.row();
            if let Err(why) = &row {
                ui.colored_label(Color32::from_rgb(255, 190, 120), why);
            }
            finished(ui, "Make").map(|is_wanted| is_wanted.then_some(row))
        });
        match done {
            None => true,
            Some(None) => false,
            Some(Some(Ok(row))) => {
                self.edit(&Edit::AddShape(Box::new(row)));
                self.selected.clear();
                false
            }
            Some(Some(Err(why))) => {
                self.complain(why);
                true
            }
        }
    }
}

/// A window in the middle; what its contents return closes it.
fn window<R>(ctx: &Context, title: &str, contents: impl FnOnce(&mut Ui) -> Option<R>) -> Option<R> {
    let shown = egui::Window::new(title)
        .collapsible(false)
        .resizable(false)
        .anchor(Align2::CENTER_CENTER, egui::Vec2::ZERO)
        .show(ctx, contents);
    shown.and_then(|shown| shown.inner).flatten()
}

/// Buttons, of which the first is also Enter and, where that does no harm, the last also Esc.
fn choices(ui: &mut Ui, words: &[&str], may_escape: bool) -> Option<usize> {
    ui.add_space(6.0);
    let (enter, escape) = ui.input(|input| (input.key_pressed(Key::Enter), may_escape && input.key_pressed(Key::Escape)));
    let clicked = ui.horizontal(|ui| words.iter().position(|word| ui.button(*word).clicked())).inner;
    clicked.or(enter.then_some(0)).or(escape.then_some(words.len() - 1))
}

/// Whether what was asked is wanted, once that is known.
fn finished(ui: &mut Ui, word: &str) -> Option<bool> {
    choices(ui, &[word, "Cancel"], true).map(|choice| choice == 0)
}

/// A field that is typed into from the moment that its window opens.
fn focus_once(ui: &Ui, field: &egui::Response) {
    if ui.memory(|memory| memory.focused()).is_none() {
        field.request_focus();
    }
}

fn help(ctx: &Context) -> bool {
    let closed = window(ctx, "Keys", |ui| {
        ui.horizontal_top(|ui| {
            for column in [&HELP[..1], &HELP[1..3], &HELP[3..]] {
                ui.vertical(|ui| {
                    ui.set_width(330.0);
                    for (title, keys) in column {
                        ui.strong(*title);
                        egui::Grid::new(*title).num_columns(2).spacing([10.0, 3.0]).show(ui, |ui| {
                            for (key, does) in *keys {
                                ui.label(RichText::new(*key).color(super::panes::ACTIVE));
                                ui.add(egui::Label::new(RichText::new(*does).color(Color32::from_gray(215))).wrap());
                                ui.end_row();
                            }
                        });
                        ui.add_space(10.0);
                    }
                });
            }
        });
        ui.button("Close").clicked().then_some(())
    });
    closed.is_none()
}
