//! What all dialogs are made of: their window, fields, and the buttons at their end.

use eframe::egui::text::{CCursor, CCursorRange};
use eframe::egui::text_edit::TextEditState;
use eframe::egui::{self, Align2, Color32, Context, Key, RichText, ScrollArea, TextEdit, Ui, Vec2};

pub(in crate::app) const FAULT: Color32 = Color32::from_rgb(255, 190, 120);
pub(in crate::app) const QUIET: Color32 = Color32::from_gray(165);

/// A window in the middle; what its contents return closes it.
pub(in crate::app) fn window<R>(ctx: &Context, title: &str, contents: impl FnOnce(&mut Ui) -> Option<R>) -> Option<R> {
    let shown = egui::Window::new(title)
        .collapsible(false)
        .resizable(false)
        .anchor(Align2::CENTER_CENTER, Vec2::ZERO)
        .show(ctx, contents);
    shown.and_then(|shown| shown.inner).flatten()
}

/// A window at the right that can be moved out of the way, for work in the photographs goes on beside it.
pub(in crate::app) fn sheet<R>(
    ctx: &Context,
    title: &str,
    contents: impl FnOnce(&mut Ui) -> Option<R>,
    buttons: impl FnOnce(&mut Ui) -> Option<R>,
) -> Option<R> {
    let room = ctx.content_rect();
    let shown = egui::Window::new(title)
        .collapsible(false)
        .resizable(false)
        .pivot(Align2::RIGHT_TOP)
        .default_pos(room.right_top() + Vec2::new(-8.0, 40.0))
        .show(ctx, |ui| {
            let scrolled = ScrollArea::vertical().max_height((room.height() - 170.0).max(200.0)).show(ui, contents).inner;
            let pressed = buttons(ui);
            scrolled.or(pressed)
        });
    shown.and_then(|shown| shown.inner).flatten()
}

/// Buttons, of which the first is also Enter, unless that was meant for another button, and, where that does no harm, the last also Esc.
pub(in crate::app) fn choices(ui: &mut Ui, words: &[&str], may_escape: bool) -> Option<usize> {
    ui.add_space(6.0);
    let clicked = ui.horizontal(|ui| words.iter().position(|word| ui.button(*word).clicked())).inner;
    // what was clicked does not hold on to the keys: Enter is the first button's again, and what is typed goes into a field
    let is_on_button = |ui: &Ui| ui.memory(|memory| memory.focused()).is_some() && !ui.ctx().text_edit_focused();
    if ui.input(|input| input.pointer.any_released()) && is_on_button(ui) {
        ui.memory_mut(|memory| {
            if let Some(focused) = memory.focused() {
                memory.surrender_focus(focused);
            }
        });
    }
    // on a button that Tab went to, Enter is that one's
    let is_elsewhere = is_on_button(ui);
    let (enter, escape) = ui.input(|input| (input.key_pressed(Key::Enter), may_escape && input.key_pressed(Key::Escape)));
    clicked.or((enter && !is_elsewhere).then_some(0)).or(escape.then_some(words.len() - 1))
}

/// Whether what was asked is wanted, once that is known.
pub(in crate::app) fn finished(ui: &mut Ui, word: &str) -> Option<bool> {
    choices(ui, &[word, "Cancel"], true).map(|choice| choice == 0)
}

/// A field that is typed into from the moment that its window opens, in place of what stands in it.
pub(in crate::app) fn focus_once(ui: &Ui, field: &egui::Response, text: &str) {
    if ui.memory(|memory| memory.focused()).is_none() && !field.lost_focus() {
        type_over(ui, field, text);
    }
}

/// What is typed next goes into a field, in place of what stands in it.
pub(in crate::app) fn type_over(ui: &Ui, field: &egui::Response, text: &str) {
    field.request_focus();
    let mut state = TextEditState::load(ui.ctx(), field.id).unwrap_or_default();
    let all = CCursorRange::two(CCursor::default(), CCursor::new(text.chars().count()));
    state.cursor.set_char_range(Some(all));
    state.store(ui.ctx(), field.id);
}

/// A field for a number, its name before it and its unit behind.
pub(in crate::app) fn number_field(
    ui: &mut Ui,
    name: &str,
    text: &mut String,
    hint: &'static str,
    unit: &str,
) -> egui::Response {
    ui.label(name);
    let field = ui.add(TextEdit::singleline(text).hint_text(hint).desired_width(64.0));
    if !unit.is_empty() {
        ui.label(RichText::new(unit).color(QUIET));
    }
    field
}

/// A number as people write it.
///
/// # Errors
/// Where it is none, in words.
pub(in crate::app) fn number(text: &str, what: &str) -> Result<f64, String> {
    let parsed = text.trim().replace(',', ".").parse::<f64>();
    let wrong = || match text.trim() {
        "" => format!("{what}: a number is missing"),
        text => format!("{what}: \"{text}\" is no number"),
    };
    parsed.ok().filter(|number| number.is_finite()).ok_or_else(wrong)
}

/// A number of the project's file as a field shows it.
pub(in crate::app) fn shown(value: Option<f64>) -> String {
    value.map(|value| value.to_string()).unwrap_or_default()
}

/// PageUp and PageDown go from one of several to the one before and after.
pub(in crate::app) fn turned_page(ctx: &Context, now: Option<&String>, all: &[String]) -> Option<String> {
    let turned = ctx.input(|input| i32::from(input.key_pressed(Key::PageDown)) - i32::from(input.key_pressed(Key::PageUp)));
    if turned == 0 || all.is_empty() {
        return None;
    }
    let next = match all.iter().position(|name| Some(name) == now) {
        Some(at) => (at as i32 + turned).rem_euclid(all.len() as i32) as usize,
        None if turned > 0 => 0,
        None => all.len() - 1,
    };
    Some(all[next].clone())
}
