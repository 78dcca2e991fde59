//! Every key, and what it does: handled and told in the same place.

use super::dialogs::Dialog;
use super::{MarkApp, Tool};
use eframe::egui::{Context, Event, Key, Modifiers};
use glam::DVec2;
use heliodon_photo::project::AxisEntry;

/// A group of keys, for the help.
pub(super) type Group = (&'static str, &'static [(&'static str, &'static str)]);

/// All of them, as the help shows them.
pub(super) const HELP: [Group; 6] = [
    (
        "Marking",
        &[
            ("click", "mark the active point; press and move to place it"),
            ("drag a mark", "move it; a click chooses its point"),
            ("Shift+click", "mark even where another mark is"),
            ("Alt", "held: marks do not snap (K: off and on)"),
            ("Arrows, Shift", "move the mark by 1 pixel, by 0.1"),
            ("Enter", "mark at the keyboard's cursor"),
            ("Arrows", "without a mark here, or after C: the cursor"),
            ("Delete", "remove the mark here; Shift: the point"),
            ("Esc", "let go, leave a tool"),
        ],
    ),
    (
        "Points",
        &[
            ("N", "new point"),
            ("Tab, Shift+Tab", "next, previous point"),
            ("F2", "rename"),
            ("F", "find the point in all photographs"),
            ("O", "show the mark that fits worst, the next one"),
            ("G", "it lies on the ground"),
            ("X", "choose it, for a shape or a distance"),
            ("D, Shift+D", "distance of the two chosen points; direction"),
            ("P", "its place, where that is known"),
            ("/", "search"),
        ],
    ),
    (
        "Shapes",
        &[
            ("B, Shift+B", "a shape of the chosen points; change one"),
            ("click a mark", "in the dialog: it goes into the yellow place"),
            ("Down, Up", "in a place: complete its name, next name"),
            ("x y z", "in a place: a corner by metres, or by points"),
            (". .+0.4 .", "in a place: by the place before"),
            ("x y z / x y z", "all places of a list in one line"),
            ("Ctrl+1 to 8", "in the dialog: its kind"),
            ("Ctrl+M, Ctrl+R", "in the dialog: mirror, repetition"),
            ("PageUp, PageDown", "in the dialog: other shapes"),
            ("B, Esc", "back from drawing its edges"),
        ],
    ),
    (
        "Photographs",
        &[
            ("wheel, + -", "zoom"),
            ("0, 9", "all of it; pixel by pixel"),
            ("middle, Space+drag", "move it (Ctrl+Arrows)"),
            ("PageUp, PageDown", "previous, next photograph"),
            ("1, 2, 4", "so many side by side"),
            ("W", "next pane"),
            ("Shift+L", "their lens"),
        ],
    ),
    (
        "Edges",
        &[
            ("E", "draw edges along the building's axes"),
            ("X, Y, Z", "which axis"),
            ("click, Enter", "one end, then the other"),
            ("Delete", "remove the edge under pointer or cursor"),
        ],
    ),
    (
        "Project",
        &[
            ("S", "solve; Shift: after every change, or not"),
            ("Ctrl+S", "save"),
            ("Ctrl+Z, Ctrl+Y", "undo, do again"),
            ("R", "residuals longer, shorter, off"),
            ("M, L, T", "model, epipolar lines, names"),
            ("F1, ?", "this help"),
        ],
    ),
];

/// How much longer residuals are drawn than they are.
const RESIDUALS: [f64; 4] = [10.0, 100.0, 0.0, 1.0];

impl MarkApp {
    pub(super) fn handle_keys(&mut self, ctx: &Context) {
        let tabs = std::mem::take(&mut self.tabs);
        if tabs != 0 {
            self.step_point(tabs);
        }
        let keys: Vec<(Key, Modifiers)> = ctx.input(|input| {
            let pressed = |event: &Event| match event {
                Event::Key { key, pressed: true, modifiers, .. } => Some((*key, *modifiers)),
                _ => None,
            };
            input.events.iter().filter_map(pressed).collect()
        });
        let is_typing = ctx.egui_wants_keyboard_input();
        for (key, modifiers) in keys {
            // These never are part of a text.
            match (key, modifiers.command) {
                (Key::S, true) if self.dialog == Dialog::None => {
                    self.save();
                    continue;
                }
                (Key::F1, _) if matches!(self.dialog, Dialog::None | Dialog::Help) => {
                    self.dialog = if self.dialog == Dialog::Help { Dialog::None } else { Dialog::Help };
                    continue;
                }
                _ => {}
            }
            if self.dialog != Dialog::None {
                if self.dialog == Dialog::Help && matches!(key, Key::Escape | Key::Questionmark | Key::Enter) {
                    self.dialog = Dialog::None;
                }
                continue;
            }
            if is_typing {
                continue;
            }
            if modifiers.command { self.command(key, modifiers) } else { self.key(ctx, key, modifiers) }
        }
    }

    fn command(&mut self, key: Key, modifiers: Modifiers) {
        match key {
            Key::Z if modifiers.shift => self.redo(),
            Key::Z => self.undo(),
            Key::Y => self.redo(),
            Key::ArrowLeft => self.pan_by(40.0, 0.0),
            Key::ArrowRight => self.pan_by(-40.0, 0.0),
            Key::ArrowUp => self.pan_by(0.0, 40.0),
            Key::ArrowDown => self.pan_by(0.0, -40.0),
            _ => {}
        }
    }

    fn key(&mut self, ctx: &Context, key: Key, modifiers: Modifiers) {
        if let Tool::Edge { .. } = self.tool {
            let axis = match key {
                Key::X => Some(AxisEntry::X),
                Key::Y => Some(AxisEntry::Y),
                Key::Z => Some(AxisEntry::Z),
                _ => None,
            };
            if let Some(axis) = axis {
                self.begin_edges(axis);
                return;
            }
        }
        match key {
            Key::ArrowLeft => self.nudge(DVec2::NEG_X, modifiers.shift),
            Key::ArrowRight => self.nudge(DVec2::X, modifiers.shift),
            Key::ArrowUp => self.nudge(DVec2::NEG_Y, modifiers.shift),
            Key::ArrowDown => self.nudge(DVec2::Y, modifiers.shift),
            Key::Enter => self.mark_at_cursor(modifiers.alt),
            Key::Delete | Key::Backspace if self.tool != Tool::Mark => {
                let pointer = ctx.input(|input| input.pointer.hover_pos()).filter(|_| !self.cursor_mode);
                let pane = pointer.and_then(|at| self.pane_at(at)).unwrap_or(self.active_pane);
                let view = self.panes[pane].view;
                let at = pointer.and_then(|at| Some(view?.to_pixel(at))).or(self.cursor(pane));
                if let Some(at) = at.or(view.map(|view| view.centre)) {
                    self.remove_edge_near(pane, at);
                }
            }
            Key::Delete | Key::Backspace if modifiers.shift => self.remove_point(),
            Key::Delete | Key::Backspace => self.remove_mark(),
            Key::Escape => {
                self.escape();
                // a dialog that comes back by it is not left by it as well
                if self.dialog != Dialog::None {
                    ctx.input_mut(|input| input.consume_key(modifiers, Key::Escape));
                }
            }
            Key::PageUp => self.step_photo(-1),
            Key::PageDown => self.step_photo(1),
            Key::Plus | Key::Equals => self.zoom_by(1.25),
            Key::Minus => self.zoom_by(0.8),
            Key::Num0 | Key::Home => self.panes[self.active_pane].view = None,
            Key::Num9 => {
                if let Some(view) = &mut self.panes[self.active_pane].view {
                    view.zoom = 1.0;
                }
            }
            Key::Num1 => self.set_panes(1),
            Key::Num2 => self.set_panes(2),
            Key::Num4 => self.set_panes(4),
            Key::Questionmark => self.dialog = Dialog::Help,
            Key::Slash if modifiers.shift => self.dialog = Dialog::Help,
            Key::Slash => self.focus_search = true,
            Key::F2 => {
                if let Some(from) = self.active_point.clone() {
                    self.dialog = Dialog::Rename { to: from.clone(), from };
                }
            }
            Key::B if self.aside.is_some() => self.end_drawing(),
            Key::B if modifiers.shift => self.open_some_shape(),
            Key::B => self.begin_shape(),
            Key::C => self.toggle_cursor(),
            Key::D if modifiers.shift => self.begin_direction(),
            Key::D => self.begin_distance(),
            Key::E => match self.tool {
                Tool::Mark => self.begin_edges(AxisEntry::Y),
                Tool::Edge { .. } | Tool::Witness { .. } => self.end_drawing(),
            },
            Key::F => self.find_point(),
            Key::G => self.toggle_ground(),
            Key::K => {
                self.shown.snap = !self.shown.snap;
                self.say(
                    if self.shown.snap { "marks snap to corners and edges" } else { "marks stay where they are set" }
                        .to_owned(),
                );
            }
            Key::L if modifiers.shift => self.begin_lens(),
            Key::L => self.shown.lines = !self.shown.lines,
            Key::M => self.shown.model = !self.shown.model,
            Key::N => self.new_point(),
            Key::O => self.show_wrong(),
            Key::P => self.begin_place(),
            Key::R => self.longer_residuals(),
            Key::S if modifiers.shift => self.toggle_solving(),
            Key::S => self.solve(),
            Key::T => self.shown.names = !self.shown.names,
            Key::W => self.step_pane(),
            Key::X => {
                if let Some(point) = self.active_point.clone() {
                    self.toggle_selected(&point);
                }
            }
            _ => {}
        }
    }

    fn escape(&mut self) {
        if self.drag.take().is_some() {
            self.say("let go: the mark stays as it was".to_owned());
        } else if let Tool::Edge { axis, first: Some(_) } = self.tool {
            self.tool = Tool::Edge { axis, first: None };
        } else if let Tool::Witness { which, first: Some(_) } = self.tool {
            self.tool = Tool::Witness { which, first: None };
        } else if self.tool != Tool::Mark {
            self.end_drawing();
        } else if self.cursor_mode {
            self.cursor_mode = false;
        } else if self.selected.is_empty() {
            self.active_point = None;
        } else {
            self.selected.clear();
        }
    }

    fn toggle_cursor(&mut self) {
        self.cursor_mode = !self.cursor_mode;
        let pane = &mut self.panes[self.active_pane];
        pane.cursor = pane.cursor.or(pane.view.map(|view| view.centre));
    }

    pub(super) fn longer_residuals(&mut self) {
        let at = RESIDUALS.iter().position(|times| *times == self.shown.residuals).unwrap_or(0);
        self.shown.residuals = RESIDUALS[(at + 1) % RESIDUALS.len()];
        let times = self.shown.residuals;
        self.say(if times > 0.0 {
            format!("residuals are drawn {times} times as long as they are")
        } else {
            "residuals are not drawn".to_owned()
        });
    }

    pub(super) fn toggle_solving(&mut self) {
        self.shown.solve_as_marked = !self.shown.solve_as_marked;
        let when = if self.shown.solve_as_marked { "solved after every change" } else { "solved when S is pressed" };
        self.say(when.to_owned());
    }

    fn zoom_by(&mut self, factor: f64) {
        let pane = self.active_pane;
        let anchor = self.cursor(pane).filter(|_| self.cursor_mode);
        let anchor = anchor.or_else(|| self.photo_in(pane).and_then(|photo| self.mark(self.active_point.as_deref()?, &photo)));
        if let Some(view) = &mut self.panes[pane].view {
            let at = anchor.map(|pixel| view.to_window(pixel)).filter(|at| view.rect.contains(*at));
            view.zoom_about(at.unwrap_or(view.rect.center()), factor);
        }
    }

    fn pan_by(&mut self, x: f32, y: f32) {
        if let Some(view) = &mut self.panes[self.active_pane].view {
            view.pan(x, y);
        }
    }
}
