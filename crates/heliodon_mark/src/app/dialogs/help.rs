//! All keys, from the table that lists them.

use super::form::window;
use crate::app::keys::HELP;
use crate::app::panes::ACTIVE;
use eframe::egui::{Color32, Context, Grid, Label, RichText};

/// Whether it stays open.
pub(super) fn help(ctx: &Context) -> bool {
    let closed = window(ctx, "Keys", |ui| {
        ui.horizontal_top(|ui| {
            for column in [&HELP[..2], &HELP[2..4], &HELP[4..]] {
                ui.vertical(|ui| {
                    ui.set_width(330.0);
                    for (title, keys) in column {
                        ui.strong(*title);
                        Grid::new(*title).num_columns(2).spacing([10.0, 3.0]).show(ui, |ui| {
                            for (key, does) in *keys {
                                ui.label(RichText::new(*key).color(ACTIVE));
                                ui.add(Label::new(RichText::new(*does).color(Color32::from_gray(215))).wrap());
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
