//! What is asked about files: work that a crash left, what another program wrote, what is not saved yet.

use super::Dialog;
use super::form::{choices, window};
use crate::app::MarkApp;
use eframe::egui::{Context, ViewportCommand};

impl MarkApp {
    /// The window is to be closed: at once, or after a question about what would be lost.
    pub(in crate::app) fn handle_close(&mut self, ctx: &Context) {
        if !ctx.input(|input| input.viewport().close_requested()) || self.may_close {
            return;
        }
        let is_asked = self.dialog == Dialog::Close || self.is_closing;
        let is_begun = self.draft().is_some_and(|draft| self.is_unmade(draft));
        if is_asked || self.document.is_changed() || is_begun {
            ctx.send_viewport_cmd(ViewportCommand::CancelClose);
            // whatever else is asked waits, and comes back
            if !is_asked {
                self.waiting = std::mem::replace(&mut self.dialog, Dialog::Close);
            }
        } else if let Err(error) = self.document.autosave() {
            // without changes it takes away what was written before they were undone
            self.complain(error.to_string());
        }
    }

    fn close(&mut self, ctx: &Context) {
        self.may_close = true;
        ctx.send_viewport_cmd(ViewportCommand::Close);
    }

    /// Nothing is closed after all: what was asked before is asked again.
    fn stay(&mut self) {
        self.is_closing = false;
        self.dialog = std::mem::replace(&mut self.waiting, Dialog::None);
    }

    pub(super) fn ask_about_closing(&mut self, ctx: &Context) -> bool {
        let begun = match &self.waiting {
            Dialog::Shape(draft) => Some(draft),
            _ => self.aside.as_ref(),
        };
        let begun = begun.filter(|draft| self.is_unmade(draft)).cloned();
        let chosen = window(ctx, "Save before closing?", |ui| {
            if self.document.is_changed() {
                ui.label("There are changes that have not been saved.");
            }
            if begun.is_some() {
                ui.label("The shape that is put together is not in the project yet.");
            }
            choices(ui, &["Save", "Do not save", "Stay"], true)
        });
        match chosen {
            None => return true,
            Some(0) => {
                if begun.is_some_and(|draft| !self.make(&draft)) {
                    self.stay();
                    return false;
                }
                (self.waiting, self.aside) = (Dialog::None, None);
                self.is_closing = true;
                if self.save() {
                    self.close(ctx);
                } else if self.dialog == Dialog::None {
                    // it could not be written; why is told in the status line
                    self.stay();
                }
            }
            Some(1) => {
                self.document.forget_unsaved();
                self.close(ctx);
            }
            Some(_) => self.stay(),
        }
        false
    }

    pub(super) fn left_work(&mut self, ctx: &Context) -> bool {
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

    pub(super) fn ask_about_theirs(&mut self, ctx: &Context) -> bool {
        let is_closing = self.is_closing;
        let chosen = window(ctx, "The project was changed", |ui| {
            ui.label("Another program wrote photos.toml since it was read here.");
            if is_closing {
                choices(ui, &["Save mine over it", "Leave theirs, close", "Stay"], true)
            } else {
                choices(ui, &["Take theirs", "Keep mine"], true)
            }
        });
        let Some(choice) = chosen else { return true };
        match (is_closing, choice) {
            (true, 0) => {
                self.document.keep_ours();
                if self.save() { self.close(ctx) } else { self.stay() }
            }
            (true, 1) => {
                self.document.forget_unsaved();
                self.close(ctx);
            }
            (true, _) => self.stay(),
            (false, 0) => match self.document.take_theirs() {
                Ok(()) => self.say("read again; Ctrl+Z goes back to what was here".to_owned()),
                Err(error) => self.complain(error.to_string()),
            },
            (false, _) => {
                self.document.keep_ours();
                self.say("kept; the next save replaces what the other program wrote".to_owned());
            }
        }
        false
    }
}
