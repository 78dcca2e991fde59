//! The photographs side by side, and the pointer in them.

use super::MarkApp;
use crate::pictures::{Loading, View};
use eframe::egui::{self, Align2, Color32, CursorIcon, FontId, PointerButton, Pos2, Rect, Sense, Stroke, StrokeKind, Ui, Vec2};

/// Between panes, points.
const GAP: f32 = 4.0;
/// How much a notch of the wheel zooms: this to the power of points scrolled.
const WHEEL: f64 = 1.004;
pub(super) const ACTIVE: Color32 = Color32::from_rgb(255, 214, 64);
const GROUND: Color32 = Color32::from_rgb(24, 26, 29);

impl MarkApp {
    /// Where each pane is.
    fn pane_rects(&self, all: Rect) -> Vec<Rect> {
        let (columns, rows) = match self.pane_count {
            1 => (1, 1),
            2 => (2, 1),
            _ => (2, 2),
        };
        let size = Vec2::new(
            (all.width() - GAP * (columns - 1) as f32) / columns as f32,
            (all.height() - GAP * (rows - 1) as f32) / rows as f32,
        );
        let at = |i: usize| all.min + Vec2::new((i % columns) as f32 * (size.x + GAP), (i / columns) as f32 * (size.y + GAP));
        (0..self.pane_count).map(|i| Rect::from_min_size(at(i), size.max(Vec2::splat(1.0)))).collect()
    }

    pub(super) fn pane_at(&self, at: Pos2) -> Option<usize> {
        (0..self.pane_count).find(|pane| self.panes[*pane].view.is_some_and(|view| view.rect.contains(at)))
    }

    pub(super) fn show_panes(&mut self, ui: &mut Ui) {
        let frame = egui::Frame::NONE.fill(Color32::from_rgb(14, 15, 17));
        egui::CentralPanel::default().frame(frame).show(ui, |ui| {
            for (pane, rect) in self.pane_rects(ui.max_rect()).into_iter().enumerate() {
                self.show_pane(ui, pane, rect);
            }
        });
    }

    fn show_pane(&mut self, ui: &mut Ui, pane: usize, rect: Rect) {
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 0.0, GROUND);
        let response = ui.interact(rect, ui.id().with(("pane", pane)), Sense::click_and_drag());
        let Some(photo) = self.photo_in(pane) else {
            painter.text(rect.center(), Align2::CENTER_CENTER, "no photograph", FontId::proportional(14.0), Color32::GRAY);
            return;
        };
        let words = match self.pictures.get(&photo) {
            Loading::Ready(picture) => {
                let scale = f64::from(ui.ctx().pixels_per_point());
                let size = picture.size();
                // What shows all of it goes on to, whatever becomes of the window.
                let is_whole = |view: &View| *view == View::whole(view.rect, view.scale, size);
                let kept = self.panes[pane].view.filter(|view| !is_whole(view));
                let mut view = kept.unwrap_or_else(|| View::whole(rect, scale, size));
                (view.rect, view.scale) = (rect, scale);
                if let Some(goal) = self.panes[pane].goal.take() {
                    (view.centre, view.zoom) = (goal, view.zoom.max(1.0));
                }
                view.hold(size);
                self.panes[pane].view = Some(view);
                self.point_at(ui, &response, pane);
                let view = self.panes[pane].view.unwrap_or(view);
                self.tiles.draw(ui.ctx(), &painter, &photo, &picture, &view);
                let pointer = response.hover_pos();
                self.paint_over(ui, &painter, pane, &photo, &view, pointer);
                self.magnify(ui, &painter, pane, &photo, &picture, &view, pointer);
                None
            }
            Loading::Waiting => Some(("reading ...".to_owned(), Color32::GRAY)),
            Loading::Failed(why) => Some((why, Color32::from_rgb(255, 120, 110))),
        };
        if response.clicked() || response.drag_started() {
            self.active_pane = pane;
        }
        if let Some((words, colour)) = words {
            let text = painter.layout(words, FontId::proportional(14.0), colour, rect.width() - 40.0);
            painter.galley(rect.center() - text.size() / 2.0, text, colour);
        }
        self.paint_title(&painter, pane, &photo, rect);
        let is_active = pane == self.active_pane && self.pane_count > 1;
        let stroke = if is_active { Stroke::new(2.0, ACTIVE) } else { Stroke::new(1.0, Color32::from_gray(50)) };
        painter.rect_stroke(rect, 0.0, stroke, StrokeKind::Inside);
    }

    /// What the pointer does in a pane.
    fn point_at(&mut self, ui: &Ui, response: &egui::Response, pane: usize) {
        let (space, is_free, scroll, zoom, delta) = ui.input(|input| {
            let is_free = input.modifiers.alt;
            (input.key_down(egui::Key::Space), is_free, input.smooth_scroll_delta(), input.zoom_delta(), input.pointer.delta())
        });
        if let Some(at) = response.hover_pos()
            && let Some(view) = &mut self.panes[pane].view
        {
            let factor = WHEEL.powf(f64::from(scroll.y)) * f64::from(zoom);
            if factor != 1.0 {
                view.zoom_about(at, factor);
            }
        }
        let is_panning = response.dragged_by(PointerButton::Middle) || (space && response.dragged_by(PointerButton::Primary));
        if is_panning {
            self.drag = None;
            if let Some(view) = &mut self.panes[pane].view {
                view.pan(delta.x, delta.y);
            }
            ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
            return;
        }
        if response.hovered() && self.dialog == super::Dialog::None {
            ui.ctx().set_cursor_icon(if space { CursorIcon::Grab } else { CursorIcon::Crosshair });
        }
        let (is_pressed, is_released, origin, now) = ui.input(|input| {
            let pointer = &input.pointer;
            let button = PointerButton::Primary;
            (pointer.button_pressed(button), pointer.button_released(button), pointer.press_origin(), pointer.interact_pos())
        });
        let is_picking = matches!(self.dialog, super::Dialog::Shape(_));
        if is_pressed
            && !space
            && response.contains_pointer()
            && (is_picking || self.dialog == super::Dialog::None)
            && let Some(at) = origin.or(now)
        {
            // What is typed in a field stays there.
            ui.ctx().memory_mut(|memory| {
                if let Some(focused) = memory.focused() {
                    memory.surrender_focus(focused);
                }
            });
            self.cursor_mode = false;
            if is_picking {
                self.pick_at(pane, at);
                return;
            }
            self.press(pane, at, is_free, ui.input(|input| input.modifiers.shift));
        }
        let is_ours = self.drag.as_ref().is_some_and(|drag| drag.pane == pane);
        if is_ours && let Some(at) = now {
            self.drag_to(at, is_free);
        }
        if is_ours && is_released {
            self.release();
        }
    }
}
