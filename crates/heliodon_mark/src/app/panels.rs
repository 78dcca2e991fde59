//! What stands around the photographs: their list, the points, buttons and the status line.

use super::dialogs::Dialog;
use super::{MarkApp, Tool};
use crate::document::Edit;
use crate::pictures::small_texture;
use eframe::egui::{self, Align, Color32, Layout, Panel, RichText, ScrollArea, Sense, TextEdit, Ui, Vec2};
use heliodon_photo::project::{AxisEntry, DirectionEntry, DistanceEntry};
use heliodon_photo::solve::{PhotoResult, PointResult, worst_sigma};

const FAULT: Color32 = Color32::from_rgb(255, 120, 110);
const DOUBT: Color32 = Color32::from_rgb(255, 190, 120);
pub(super) const GOOD: Color32 = Color32::from_rgb(140, 225, 140);
/// The small photographs' width, points.
const SMALL_WIDTH: f32 = 132.0;

/// What a click in the list of what is known opens.
enum Opens {
    Shape(String),
    Distance([String; 2]),
    Direction([String; 2]),
    Lens(String),
}

/// A line of that list.
struct Thing {
    words: String,
    hint: &'static str,
    opens: Opens,
    removes: Edit,
}

impl MarkApp {
    pub(super) fn top_bar(&mut self, ui: &mut Ui) {
        Panel::top("commands").show(ui, |ui| {
            ui.horizontal_wrapped(|ui| {
                ui.spacing_mut().item_spacing.x = 6.0;
                let (undos, redos) = self.document.steps();
                let save = if self.document.is_changed() { "Save *" } else { "Save" };
                if button(ui, save, "Ctrl+S", true) {
                    self.save();
                }
                if button(ui, "Undo", "Ctrl+Z", undos > 0) {
                    self.undo();
                }
                if button(ui, "Redo", "Ctrl+Y", redos > 0) {
                    self.redo();
                }
                ui.separator();
                if button(ui, if self.solver.is_busy() { "Solving ..." } else { "Solve" }, "S", !self.solver.is_busy()) {
                    self.solve();
                }
                let mut on = self.shown.solve_as_marked;
                if ui.checkbox(&mut on, "as marked").on_hover_text("Solve after every change (Shift+S)").clicked() {
                    self.toggle_solving();
                }
                ui.separator();
                for count in [1, 2, 4] {
                    let words = format!("{count}");
                    if ui
                        .selectable_label(self.pane_count == count, words)
                        .on_hover_text(format!("So many side by side ({count})"))
                        .clicked()
                    {
                        self.set_panes(count);
                    }
                }
                ui.separator();
                for (axis, name) in [(AxisEntry::X, "X"), (AxisEntry::Y, "Y"), (AxisEntry::Z, "Z")] {
                    let is_on = matches!(self.tool, Tool::Edge { axis: on, .. } if on == axis);
                    let told = format!("Draw edges along the building's {name} axis (E, then {name})");
                    if ui.selectable_label(is_on, format!("Edge {name}")).on_hover_text(told).clicked() {
                        if is_on { self.tool = Tool::Mark } else { self.begin_edges(axis) }
                    }
                }
                ui.separator();
                if button(ui, "Shape", "B", true) {
                    self.begin_shape();
                }
                let has_two = self.selected.len() == 2;
                if button(ui, "Distance", "D: how far the two chosen points are apart", has_two) {
                    self.begin_distance();
                }
                if button(ui, "Direction", "Shift+D: where the way between the two chosen points leads", has_two) {
                    self.begin_direction();
                }
                if button(ui, "Place", "P: where the active point is", self.active_point.is_some()) {
                    self.begin_place();
                }
                if button(ui, "Lens", "Shift+L: what is known of the active photograph's lens", true) {
                    self.begin_lens();
                }
                ui.separator();
                ui.checkbox(&mut self.shown.snap, "Snap").on_hover_text("Marks go to corners and edges (K; Alt held: not now)");
                ui.checkbox(&mut self.shown.model, "Model").on_hover_text("M");
                ui.checkbox(&mut self.shown.lines, "Lines").on_hover_text("Where the active point has to lie (L)");
                let times = self.shown.residuals;
                let words = if times > 0.0 { format!("Residuals x{times}") } else { "Residuals off".to_owned() };
                if ui.button(words).on_hover_text("Longer, off (R)").clicked() {
                    self.longer_residuals();
                }
                ui.separator();
                if button(ui, "Help", "F1", true) {
                    self.dialog = Dialog::Help;
                }
            });
        });
    }

    pub(super) fn status_line(&mut self, ui: &mut Ui) {
        Panel::bottom("status").show(ui, |ui| {
            ui.horizontal(|ui| {
                let is_fault = self.solve_fault.is_some();
                ui.label(RichText::new("Next:").strong());
                let next = self.next_step();
                ui.add(
                    egui::Label::new(RichText::new(next).color(if is_fault { FAULT } else { Color32::from_gray(225) }))
                        .truncate(),
                );
            });
            ui.horizontal(|ui| {
                if let Some(message) = &self.message {
                    let colour = if message.is_fault { FAULT } else { Color32::from_gray(165) };
                    ui.add(egui::Label::new(RichText::new(&message.text).color(colour)).truncate());
                } else {
                    ui.label(RichText::new(self.document.path().display().to_string()).color(Color32::from_gray(140)));
                }
            });
        });
    }

    pub(super) fn photo_list(&mut self, ui: &mut Ui) {
        Panel::left("photographs").resizable(false).exact_size(SMALL_WIDTH + 26.0).show(ui, |ui| {
            ui.add_space(4.0);
            ui.strong("Photographs");
            ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
                let names: Vec<String> =
                    self.document.project().file.photo.iter().map(|photo| photo.name().to_owned()).collect();
                for (index, name) in names.iter().enumerate() {
                    self.small_photo(ui, index, name);
                }
            });
        });
    }

    fn small_photo(&mut self, ui: &mut Ui, index: usize, name: &str) {
        if !self.small.contains_key(name)
            && let Some(level) = self.pictures.small(name)
        {
            let texture = small_texture(ui.ctx(), name, level);
            self.small.insert(name.to_owned(), texture);
        }
        let height =
            self.small.get(name).map_or(0.7, |texture| texture.size_vec2().y / texture.size_vec2().x).min(1.6) * SMALL_WIDTH;
        let (rect, response) = ui.allocate_exact_size(Vec2::new(SMALL_WIDTH, height + 34.0), Sense::click());
        if ui.is_rect_visible(rect) {
            let in_pane = (0..self.pane_count).find(|pane| self.panes[*pane].photo == index);
            let painter = ui.painter_at(rect.expand(2.0));
            let fill = if in_pane.is_some() { Color32::from_gray(62) } else { Color32::from_gray(34) };
            painter.rect_filled(rect, 3.0, fill);
            let picture = egui::Rect::from_min_size(rect.min, Vec2::new(SMALL_WIDTH, height)).shrink(3.0);
            match self.small.get(name) {
                Some(texture) => {
                    let all = egui::Rect::from_min_max(egui::Pos2::ZERO, egui::Pos2::new(1.0, 1.0));
                    painter.image(texture.id(), picture, all, Color32::WHITE);
                }
                None => {
                    painter.rect_filled(picture, 0.0, Color32::from_gray(22));
                }
            }
            let marks = super::marks_told(
                self.document.project().file.point.iter().filter(|point| point.marks.contains_key(name)).count(),
            );
            let (told, colour) = match self.outcome.as_ref().and_then(|outcome| outcome.photos.get(name)) {
                Some(PhotoResult::Solved(solved)) => (format!("{marks}, {:.2} px", solved.rms_px), GOOD),
                Some(PhotoResult::Unsolved(_)) => (format!("{marks}, not solved"), DOUBT),
                None => (marks, Color32::from_gray(170)),
            };
            let left = egui::Pos2::new(rect.left() + 4.0, picture.bottom() + 2.0);
            let font = egui::FontId::proportional(12.0);
            painter.text(left, egui::Align2::LEFT_TOP, name, font.clone(), Color32::from_gray(230));
            painter.text(left + Vec2::new(0.0, 15.0), egui::Align2::LEFT_TOP, told, font, colour);
        }
        let why = match self.outcome.as_ref().and_then(|outcome| outcome.photos.get(name)) {
            Some(PhotoResult::Unsolved(why)) => format!("{name}: {why}"),
            _ => format!("{name}: click to show it in the active pane"),
        };
        if response.on_hover_text(why).clicked() {
            self.show_photo(self.active_pane, index);
        }
        ui.add_space(4.0);
    }

    pub(super) fn point_list(&mut self, ui: &mut Ui) {
        Panel::right("points").default_size(330.0).size_range(240.0..=560.0).show(ui, |ui| {
            ui.add_space(4.0);
            ui.horizontal(|ui| {
                ui.strong("Points");
                if button(ui, "New", "N", true) {
                    self.new_point();
                }
                let search = ui.add(TextEdit::singleline(&mut self.search).hint_text("search  /").desired_width(f32::INFINITY));
                if std::mem::take(&mut self.focus_search) {
                    search.request_focus();
                }
            });
            ui.separator();
            let bottom = self.notes_height();
            let height = (ui.available_height() - bottom).max(80.0);
            ScrollArea::vertical().id_salt("points").max_height(height).auto_shrink([false, false]).show(ui, |ui| {
                for index in self.listed_points() {
                    let name = self.document.project().file.point[index].name.clone();
                    self.point_row(ui, index, &name);
                }
                self.scroll_to_point = false;
            });
            self.notes(ui);
        });
    }

    fn point_row(&mut self, ui: &mut Ui, index: usize, name: &str) {
        let entry = &self.document.project().file.point[index];
        let marks = super::marks_told(entry.marks.len());
        let ground = if entry.ground { ", ground" } else { "" };
        let known = if entry.known_m.is_some() { ", known" } else { "" };
        let is_active = self.active_point.as_deref() == Some(name);
        let is_selected = self.selected.iter().position(|chosen| chosen == name);
        let is_wrong = self.outcome.as_ref().is_some_and(|outcome| {
            entry.marks.keys().any(|photo| outcome.residual(photo, name).is_some_and(|residual| residual.is_wrong))
        });
        let (place, colour) = match self.outcome.as_ref().and_then(|outcome| outcome.points.get(name)) {
            Some(PointResult::Solved(solved)) => {
                let sigma = solved.covariance_m2.map(|c| format!("  ±{:.3}", worst_sigma(&c))).unwrap_or_default();
                let [x, y, z] = solved.position_m.to_array();
                (format!("{x:.3}  {y:.3}  {z:.3}{sigma}"), if is_wrong { FAULT } else { GOOD })
            }
            Some(PointResult::Unsolved(why)) => (why.clone(), DOUBT),
            None => (marks.clone(), Color32::from_gray(165)),
        };
        let number = is_selected.map(|at| format!("[{}] ", at + 1)).unwrap_or_default();
        let fill = if is_active { Color32::from_rgb(74, 66, 30) } else { Color32::TRANSPARENT };
        let shown = egui::Frame::NONE.fill(fill).inner_margin(egui::Margin::symmetric(4, 2)).show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.spacing_mut().item_spacing.y = 0.0;
            ui.horizontal(|ui| {
                let colour = if is_active { super::panes::ACTIVE } else { Color32::from_gray(235) };
                ui.add(egui::Label::new(RichText::new(format!("{number}{name}")).color(colour)).selectable(false).truncate());
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    let told = RichText::new(format!("{marks}{ground}{known}")).small().color(Color32::from_gray(165));
                    ui.add(egui::Label::new(told).selectable(false));
                });
            });
            ui.add(egui::Label::new(RichText::new(&place).small().color(colour)).selectable(false).truncate());
        });
        let response = ui.interact(shown.response.rect, ui.id().with(("point", name)), Sense::click());
        if is_active && self.scroll_to_point {
            response.scroll_to_me(None);
        }
        if response.double_clicked() && self.dialog == Dialog::None {
            self.dialog = Dialog::Rename { from: name.to_owned(), to: name.to_owned() };
        } else if response.clicked() {
            if let Dialog::Shape(draft) = &mut self.dialog {
                draft.pick(name);
            } else if ui.input(|input| input.modifiers.command) {
                self.toggle_selected(name);
            } else {
                self.activate(name.to_owned());
            }
        }
        response.on_hover_text(format!("{place}\nClick: mark it. Ctrl+click or X: choose it. Double click or F2: rename."));
    }

    fn notes_height(&self) -> f32 {
        let told = self
            .outcome
            .as_ref()
            .map_or(0, |outcome| outcome.wrong_marks.len() + outcome.wrong_shapes.len() + outcome.notes.len());
        (60.0 + 18.0 * (told + self.known_things().len()) as f32).min(260.0)
    }

    /// Shapes, distances, directions and lenses of the project.
    fn known_things(&self) -> Vec<Thing> {
        let file = &self.document.project().file;
        let shapes = file.shape.iter().map(|shape| Thing {
            words: format!("{:?} {}", shape.kind, shape.name),
            hint: "Change it (Shift+B)",
            opens: Opens::Shape(shape.name.clone()),
            removes: Edit::RemoveShape { name: shape.name.clone() },
        });
        let distances = file.distance.iter().map(|DistanceEntry { between, metres }| Thing {
            words: format!("{} - {}: {metres} m", between[0], between[1]),
            hint: "Change it (choose both points, D)",
            opens: Opens::Distance(between.clone()),
            removes: Edit::RemoveDistance { between: between.clone() },
        });
        let directions = file.direction.iter().map(|DirectionEntry { from, to, toward }| Thing {
            words: format!("{from} to {to}: {toward}"),
            hint: "Change it (choose both points, Shift+D)",
            opens: Opens::Direction([from.clone(), to.clone()]),
            removes: Edit::RemoveDirection { between: [from.clone(), to.clone()] },
        });
        let lenses = file.lens.iter().map(|lens| Thing {
            words: format!("Lens {}", lens.name),
            hint: "Change it (Shift+L)",
            opens: Opens::Lens(lens.name.clone()),
            removes: Edit::RemoveLens { name: lens.name.clone() },
        });
        shapes.chain(distances).chain(directions).chain(lenses).collect()
    }

    /// What the project knows beside points, and what the solver has to say.
    fn notes(&mut self, ui: &mut Ui) {
        ui.separator();
        let (mut remove, mut show, mut open) = (None, None, None);
        ScrollArea::vertical().id_salt("notes").auto_shrink([false, false]).show(ui, |ui| {
            for thing in self.known_things() {
                ui.horizontal(|ui| {
                    let words = RichText::new(&thing.words).small();
                    if ui.add(egui::Button::new(words).frame(false)).on_hover_text(thing.hint).clicked() {
                        open = Some(thing.opens);
                    }
                    if ui.small_button("x").on_hover_text("Remove it").clicked() {
                        remove = Some(thing.removes);
                    }
                });
            }
            if let Some(fault) = &self.solve_fault {
                ui.label(RichText::new(format!("What was solved is kept. {fault}")).small().color(FAULT));
            }
            if let Some(outcome) = &self.outcome {
                for (photo, point) in &outcome.wrong_marks {
                    let off = outcome.residual(photo, point).map_or(0.0, |residual| residual.off.length());
                    let words = RichText::new(format!("{point} in {photo} is off by {off:.1} px")).small().color(FAULT);
                    if ui.add(egui::Label::new(words).sense(Sense::click())).on_hover_text("Click to look at it (O)").clicked()
                    {
                        show = Some((photo.clone(), point.clone()));
                    }
                }
                for wrong in &outcome.wrong_shapes {
                    ui.label(RichText::new(wrong).small().color(FAULT));
                }
                for note in &outcome.notes {
                    ui.label(RichText::new(note).small().color(Color32::from_gray(175)));
                }
            }
        });
        if let Some((photo, point)) = show {
            self.show_mark(&photo, point);
        }
        match open.filter(|_| self.dialog == Dialog::None) {
            Some(Opens::Shape(name)) => self.open_shape(&name),
            Some(Opens::Distance(between)) => self.open_distance(between),
            Some(Opens::Direction(ends)) => self.open_direction(ends),
            Some(Opens::Lens(name)) => self.open_lens(&name),
            None => {}
        }
        if let Some(edit) = remove {
            self.edit(&edit);
        }
    }
}

fn button(ui: &mut Ui, words: &str, key: &str, is_enabled: bool) -> bool {
    ui.add_enabled(is_enabled, egui::Button::new(words)).on_hover_text(key).clicked()
}
