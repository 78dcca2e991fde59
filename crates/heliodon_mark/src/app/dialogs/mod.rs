//! What is asked in a window of its own.

mod closing;
mod form;
mod help;
mod known;
mod lens;

pub(super) use form::*;

use super::MarkApp;
use super::shape::ShapeDraft;
use crate::document::Edit;
use eframe::egui::{Context, TextEdit};
use known::{DirectionDraft, PlaceDraft};
use lens::LensDraft;

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
    Direction(DirectionDraft),
    Place(PlaceDraft),
    Lens(Box<LensDraft>),
    Shape(Box<ShapeDraft>),
}

impl MarkApp {
    pub(super) fn show_dialog(&mut self, ctx: &Context) {
        let mut dialog = std::mem::replace(&mut self.dialog, Dialog::None);
        let was_open = dialog != Dialog::None;
        let stays = match &mut dialog {
            Dialog::None => false,
            Dialog::Help => help::help(ctx),
            Dialog::LeftWork => self.left_work(ctx),
            Dialog::ChangedOutside => self.ask_about_theirs(ctx),
            Dialog::Close => self.ask_about_closing(ctx),
            Dialog::Rename { from, to } => self.ask_name(ctx, from, to),
            Dialog::Distance { between, metres } => self.ask_distance(ctx, between, metres),
            Dialog::Direction(draft) => self.ask_direction(ctx, draft),
            Dialog::Lens(draft) => self.ask_lens(ctx, draft),
            Dialog::Place(draft) => self.ask_place(ctx, draft),
            Dialog::Shape(draft) => self.ask_shape(ctx, draft),
        };
        // What it did may have opened another.
        if stays && self.dialog == Dialog::None {
            self.dialog = dialog;
        }
        // a field of a dialog that is gone would hold on to the keys for a frame more
        if was_open && self.dialog == Dialog::None {
            ctx.memory_mut(|memory| {
                if let Some(focused) = memory.focused() {
                    memory.surrender_focus(focused);
                }
            });
        }
    }

    fn ask_name(&mut self, ctx: &Context, from: &str, to: &mut String) -> bool {
        let done = window(ctx, "Rename", |ui| {
            ui.label(format!("Another name for {from}:"));
            let field = ui.add(TextEdit::singleline(to).desired_width(260.0));
            focus_once(ui, &field, to);
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
}
