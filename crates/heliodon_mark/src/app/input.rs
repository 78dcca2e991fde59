//! What arrives between two frames, in its order: a key or a click that may open or close a dialog ends the frame's share, for what was pressed after it is
//! meant for what is there then. On a machine without a graphics card several keys fall into every frame.

use super::MarkApp;
use super::dialogs::Dialog;
use eframe::egui::{Context, Event, Key, Modifiers, RawInput};

/// Keys that open a dialog, or a field to type into, from the photographs.
const OPENS: [Key; 9] = [Key::B, Key::D, Key::E, Key::F1, Key::F2, Key::L, Key::P, Key::Questionmark, Key::Slash];
/// Keys that end what is typed, go on to another field or dialog, or press a button.
const CLOSES: [Key; 6] = [Key::Enter, Key::Escape, Key::PageDown, Key::PageUp, Key::Space, Key::Tab];
/// Keys that, with Ctrl, go to another field.
const LEAPS: [Key; 10] =
    [Key::M, Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8, Key::R];

impl MarkApp {
    /// To be called on a frame's input before egui takes it up: what comes after a dialog is kept for when it is there, and Tab goes from point to point
    /// here, not from button to button.
    pub fn take_input(&mut self, ctx: &Context, input: &mut RawInput) {
        let later = std::mem::take(&mut input.events);
        input.events = std::mem::take(&mut self.held_back);
        input.events.extend(later);
        let is_typing = ctx.egui_wants_keyboard_input() || self.dialog != Dialog::None;
        let leaps = |key: &Key, modifiers: &Modifiers| is_typing && modifiers.command && LEAPS.contains(key);
        let turns = |event: &Event| match event {
            Event::PointerButton { pressed, .. } => !pressed,
            Event::Key { key: Key::Escape, pressed, .. } => *pressed,
            Event::Key { key, pressed: true, modifiers, .. } if leaps(key, modifiers) => true,
            Event::Key { key, pressed: true, .. } => (if is_typing { CLOSES.as_slice() } else { &OPENS }).contains(key),
            _ => false,
        };
        // what was typed goes to its field first: a list of places grows as one is filled, and whoever is clicked takes the keys at once
        let steps = |event: &Event| match event {
            Event::Key { key: Key::Tab, pressed, .. } | Event::PointerButton { pressed, .. } => is_typing && *pressed,
            Event::Key { key, pressed, modifiers, .. } => *pressed && leaps(key, modifiers),
            _ => false,
        };
        let step = input.events.iter().skip(1).position(steps).map(|at| at + 1);
        // the letter that a key itself writes is no part of what is typed next
        let writes = |at: usize| matches!(input.events.get(at + 1), Some(Event::Text(_)));
        let turn = input.events.iter().position(turns).map(|at| at + 1 + usize::from(writes(at)));
        if let Some(end) = step.into_iter().chain(turn).min() {
            self.held_back = input.events.split_off(end);
        }
        if is_typing {
            return;
        }
        input.events.retain(|event| match event {
            Event::Key { key: Key::Tab, pressed, modifiers, .. } => {
                if *pressed {
                    self.tabs += if modifiers.shift { -1 } else { 1 };
                }
                false
            }
            _ => true,
        });
    }
}
