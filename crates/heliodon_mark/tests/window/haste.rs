//! Many keys within one frame, as they come where frames are slow.

use crate::desk::Desk;
use eframe::egui::{Event, Key, Modifiers};

/// A key pressed and let go of, with the letter that it writes.
fn struck(key: Key, modifiers: Modifiers, writes: &str) -> Vec<Event> {
    let event = |pressed| Event::Key { key, physical_key: None, pressed, repeat: false, modifiers };
    let text = Some(Event::Text(writes.to_owned())).filter(|_| !writes.is_empty());
    [Some(event(true)), text, Some(event(false))].into_iter().flatten().collect()
}

fn plain(key: Key) -> Vec<Event> {
    struck(key, Modifiers::NONE, "")
}

fn typed(words: &str) -> Vec<Event> {
    vec![Event::Text(words.to_owned())]
}

#[test]
fn keys_of_one_frame_go_to_the_dialog_that_one_of_them_opens_and_to_the_window_behind_it_once_it_is_closed() {
    let mut desk = Desk::new(|_, _| false, None);
    let before = desk.app.document().project().file.point.len();
    let renamed = |name: &str| {
        [
            struck(Key::N, Modifiers::NONE, "n"),
            plain(Key::F2),
            struck(Key::A, Modifiers::COMMAND, ""),
            typed(name),
            plain(Key::Enter),
        ]
        .concat()
    };
    let placed = |place: [&str; 3]| {
        let fields = place.iter().flat_map(|number| [typed(number), plain(Key::Tab)].concat());
        struck(Key::P, Modifiers::NONE, "p").into_iter().chain(fields.take(7)).chain(plain(Key::Enter)).collect::<Vec<_>>()
    };
    let all = [renamed("crown"), placed(["1", "2.5", "-3"]), renamed("foot"), struck(Key::G, Modifiers::NONE, "g")].concat();
    desk.frame(all);
    (0..20).for_each(|_| desk.frame(Vec::new()));
    let points = &desk.app.document().project().file.point;
    let new: Vec<(&str, Option<[f64; 3]>, bool)> =
        points[before..].iter().map(|point| (point.name.as_str(), point.known_m, point.ground)).collect();
    assert_eq!(new, [("crown", Some([1.0, 2.5, -3.0]), false), ("foot", None, true)], "{:?}", desk.app.message());
}

#[test]
fn keys_right_behind_a_click_that_closes_a_dialog_are_the_windows() {
    let mut desk = Desk::new(|_, _| false, None);
    let before = desk.app.document().project().file.point.len();
    desk.key(Key::F2, Modifiers::NONE);
    desk.settle();
    let pos = desk.find("Cancel");
    let press = |pressed| Event::PointerButton {
        pos,
        button: eframe::egui::PointerButton::Primary,
        pressed,
        modifiers: Modifiers::NONE,
    };
    desk.frame(vec![Event::PointerMoved(pos)]);
    desk.frame([vec![press(true), press(false)], struck(Key::N, Modifiers::NONE, "n")].concat());
    (0..4).for_each(|_| desk.frame(Vec::new()));
    assert_eq!(desk.app.document().project().file.point.len(), before + 1);
}
