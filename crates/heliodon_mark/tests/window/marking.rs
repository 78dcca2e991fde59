//! Marks and edges in photographs, by hand and by the keyboard alone.

use crate::desk::{COUNT, Desk};
use crate::scene::Scene;
use eframe::egui::{Event, Key, Modifiers, Vec2};
use glam::DVec2;
use heliodon_mark::app::MarkApp;
use heliodon_mark::document::Document;
use std::fs;
use std::sync::Arc;

#[test]
fn a_corner_is_marked_in_two_photographs_solved_undone_and_saved() {
    let mut desk = Desk::new(|corner, _| corner == "tower-se-top", None);
    let before = fs::read_to_string(desk.file()).unwrap();
    desk.key(Key::N, Modifiers::NONE);
    assert_eq!(desk.app.active_point(), Some("p1"));
    for pane in 0..2 {
        let truth = desk.shows("tower-se-top", pane);
        // Aimed a little beside it: it snaps.
        let at = desk.at(pane, truth) + Vec2::new(3.0, 2.0);
        desk.click(at, Modifiers::NONE);
        let mark = desk.mark("p1", pane).unwrap();
        assert!(mark.distance(truth) < 0.35, "{mark} {truth}");
    }
    assert_eq!(fs::read_to_string(desk.file()).unwrap(), before, "nothing is written before it is saved");
    desk.key(Key::S, Modifiers::NONE);
    desk.rest();
    let outcome = desk.app.outcome().unwrap();
    assert_eq!(outcome.counts().0, COUNT, "{:?}", outcome.notes);
    let place = outcome.position_m("p1").unwrap();
    // The tape was held along the next corner, which is as high.
    let foot = outcome.position_m("tower-se").unwrap();
    assert!((place.distance(foot) - 3.4).abs() < 0.05, "{}", place.distance(foot));
    desk.key(Key::S, Modifiers::COMMAND);
    let saved = desk.saved();
    let point = saved.file.point.iter().find(|point| point.name == "p1").unwrap();
    assert_eq!(point.marks.len(), 2);
    let text = fs::read_to_string(desk.file()).unwrap();
    assert!(text.starts_with("# made by a program") && text.contains("# by tape"), "{text}");
    assert!(desk.home.path().join("cameras.json").exists());
    for _ in 0..3 {
        desk.key(Key::Z, Modifiers::COMMAND);
    }
    assert_eq!(desk.app.document().text(), before);
    desk.key(Key::Y, Modifiers::COMMAND);
    assert_eq!(desk.mark("p1", 0), None, "the point is there again, without its marks");
    desk.key(Key::S, Modifiers::COMMAND);
    assert_eq!(desk.saved().file.point.iter().find(|point| point.name == "p1").unwrap().marks.len(), 0);
}

#[test]
fn a_wrong_mark_is_shown_and_put_right_by_the_mouse() {
    let mut desk = Desk::new(|_, _| false, Some(("tower-se-top", 1)));
    desk.rest();
    let wrong = (Scene::photo(1), "tower-se-top".to_owned());
    assert_eq!(desk.app.outcome().unwrap().wrong_marks, vec![wrong]);
    assert!(desk.app.next_step().contains("tower-se-top in photo-2.png"), "{}", desk.app.next_step());
    desk.key(Key::O, Modifiers::NONE);
    desk.rest();
    assert_eq!(desk.app.active_point(), Some("tower-se-top"));
    let (mark, truth) = (desk.mark("tower-se-top", 1).unwrap(), desk.shows("tower-se-top", 1));
    let middle = desk.app.view(1).unwrap().rect.center();
    assert!((desk.at(1, mark) - middle).length() < 1.0, "it is brought into the middle");
    // Let go by Esc, it stays; dropped, it snaps.
    for is_dropped in [false, true] {
        desk.button(desk.at(1, mark), true, Modifiers::NONE);
        let to = desk.at(1, truth) + Vec2::new(2.0, -3.0);
        for step in 1..=4 {
            let at = desk.at(1, mark).lerp(to, step as f32 / 4.0);
            desk.frame(vec![Event::PointerMoved(at)]);
        }
        if !is_dropped {
            desk.key(Key::Escape, Modifiers::NONE);
        }
        desk.button(to, false, Modifiers::NONE);
        assert_eq!(desk.mark("tower-se-top", 1).unwrap() != mark, is_dropped);
    }
    assert!(desk.mark("tower-se-top", 1).unwrap().distance(truth) < 0.35);
    desk.rest();
    assert_eq!(desk.app.outcome().unwrap().wrong_marks, Vec::new());
}

#[test]
fn everything_is_done_by_the_keyboard_alone() {
    let mut desk = Desk::new(|_, _| false, None);
    let before = desk.app.document().text().to_owned();
    desk.key(Key::N, Modifiers::NONE);
    desk.key(Key::F2, Modifiers::NONE);
    desk.key(Key::A, Modifiers::COMMAND);
    desk.type_in("sill");
    desk.key(Key::Enter, Modifiers::NONE);
    assert_eq!(desk.app.active_point(), Some("sill"), "{:?}", desk.app.message());
    // Without a mark here arrows move the cursor.
    let start = desk.app.view(0).unwrap().centre;
    for (key, count) in [(Key::ArrowRight, 3), (Key::ArrowUp, 2)] {
        (0..count).for_each(|_| desk.key(key, Modifiers::NONE));
    }
    desk.key(Key::Enter, Modifiers::ALT);
    let mark = desk.mark("sill", 0).unwrap();
    let step = desk.app.view(0).unwrap().pixels(12.0);
    assert!(mark.distance(start + DVec2::new(3.0, -2.0) * step) < 0.01, "{mark}");
    // With one they move it, and all of it is undone at once.
    let steps = desk.app.document().steps().0;
    for modifiers in [Modifiers::NONE, Modifiers::SHIFT, Modifiers::SHIFT] {
        desk.key(Key::ArrowLeft, modifiers);
    }
    assert!((desk.mark("sill", 0).unwrap() - mark + DVec2::new(1.2, 0.0)).length() < 0.011);
    assert_eq!(desk.app.document().steps().0, steps + 1);
    desk.key(Key::Z, Modifiers::COMMAND);
    assert_eq!(desk.mark("sill", 0), Some(mark));
    // The other pane, another photograph in it, the mark there, and away with it.
    desk.key(Key::W, Modifiers::NONE);
    desk.key(Key::PageDown, Modifiers::NONE);
    desk.rest();
    desk.key(Key::Enter, Modifiers::NONE);
    assert!(desk.mark("sill", 2).is_some());
    desk.key(Key::Delete, Modifiers::NONE);
    assert!(desk.mark("sill", 2).is_none());
    desk.key(Key::G, Modifiers::NONE);
    assert!(desk.app.document().project().file.point.iter().any(|point| point.name == "sill" && point.ground));
    desk.key(Key::Delete, Modifiers::SHIFT);
    assert!(desk.app.document().project().file.point.iter().all(|point| point.name != "sill"));
    // Two points and their distance; three and a shape.
    let first = desk.app.document().project().file.point[0].name.clone();
    desk.key(Key::Tab, Modifiers::NONE);
    assert_eq!(desk.app.active_point(), Some(first.as_str()));
    desk.key(Key::X, Modifiers::NONE);
    desk.key(Key::Tab, Modifiers::NONE);
    desk.key(Key::X, Modifiers::NONE);
    desk.key(Key::D, Modifiers::NONE);
    desk.type_in("3.25");
    desk.key(Key::Enter, Modifiers::NONE);
    let file = &desk.app.document().project().file;
    assert_eq!(file.distance.last().map(|d| (d.between[0].as_str(), d.metres)), Some((first.as_str(), 3.25)));
    desk.key(Key::Tab, Modifiers::NONE);
    desk.key(Key::X, Modifiers::NONE);
    desk.key(Key::B, Modifiers::NONE);
    desk.key(Key::Enter, Modifiers::NONE);
    let file = &desk.app.document().project().file;
    assert_eq!(file.shape.last().map(|shape| (shape.name.as_str(), shape.points.len())), Some(("shape 1", 3)));
    while desk.app.document().is_changed() && desk.app.document().steps().0 > 0 {
        desk.key(Key::Z, Modifiers::COMMAND);
    }
    assert_eq!(desk.app.document().text(), before);
}

#[test]
fn edges_are_drawn_from_end_to_end_and_removed() {
    let mut desk = Desk::new(|_, _| false, None);
    let (foot, top) = (desk.shows("tower-se", 0), desk.shows("tower-se-top", 0));
    desk.key(Key::E, Modifiers::NONE);
    for end in [foot.lerp(top, 0.2), foot.lerp(top, 0.8)] {
        desk.click(desk.at(0, end) + Vec2::new(2.0, 0.0), Modifiers::NONE);
    }
    let file = &desk.app.document().project().file;
    let edge = file.edge[0].clone();
    assert_eq!((edge.photo.as_str(), edge.segments.len(), edge.axis as usize), ("photo-1.png", 1, 1));
    let along = (top - foot).try_normalize().unwrap();
    for end in edge.segments[0] {
        // The lens bends it, by less than a pixel over this length.
        let off = along.perp_dot(DVec2::from(end) - foot).abs();
        assert!(off < 1.0, "it snaps onto the edge: {off}");
    }
    desk.frame(vec![Event::PointerMoved(desk.at(0, foot.lerp(top, 0.5)))]);
    desk.key(Key::Delete, Modifiers::NONE);
    assert!(desk.app.document().project().file.edge.is_empty(), "{:?}", desk.app.message());
    assert!(!desk.app.document().is_changed());
}

#[test]
fn with_alt_a_mark_stays_where_it_was_set_and_the_wheel_holds_what_is_under_it() {
    let mut desk = Desk::new(|_, _| false, None);
    let truth = desk.shows("house-se-top", 1);
    let at = desk.at(1, truth) + Vec2::new(4.0, 3.0);
    let aimed = desk.app.view(1).unwrap().to_pixel(at);
    desk.key(Key::N, Modifiers::NONE);
    // A mark is there already: without Shift it would be chosen.
    desk.click(at, Modifiers { shift: true, ..Modifiers::ALT });
    assert!(desk.mark("p1", 1).unwrap().distance(aimed) < 0.01);
    let zoom = desk.app.view(1).unwrap().zoom;
    let held = desk.app.view(1).unwrap().to_pixel(at);
    for _ in 0..12 {
        let delta = Vec2::new(0.0, 3.0);
        desk.frame(vec![Event::MouseWheel {
            unit: eframe::egui::MouseWheelUnit::Line,
            delta,
            phase: eframe::egui::TouchPhase::Move,
            modifiers: Modifiers::NONE,
        }]);
    }
    desk.rest();
    let view = desk.app.view(1).unwrap();
    assert!(view.zoom > 3.0 * zoom, "{} {zoom}", view.zoom);
    assert!(view.to_pixel(at).distance(held) < 0.01);
}

#[test]
fn a_crash_loses_ten_seconds_at_most() {
    let mut desk = Desk::new(|_, _| false, None);
    desk.key(Key::N, Modifiers::NONE);
    desk.time += 11.0;
    desk.frame(Vec::new());
    desk.frame(Vec::new());
    assert!(desk.home.path().join(".photos.toml.autosave").exists());
    // The next window asks, and nothing else is done before that is answered.
    desk.app = MarkApp::new(Document::open(desk.home.path()).unwrap(), Arc::new(|| {}));
    desk.rest();
    desk.key(Key::N, Modifiers::NONE);
    desk.key(Key::S, Modifiers::COMMAND);
    desk.key(Key::Escape, Modifiers::NONE);
    assert!(desk.app.document().has_left_work() && !desk.app.document().is_changed());
    desk.key(Key::Enter, Modifiers::NONE);
    assert!(desk.app.document().project().file.point.iter().any(|point| point.name == "p1"));
    desk.key(Key::S, Modifiers::COMMAND);
    assert!(!desk.home.path().join(".photos.toml.autosave").exists());
}

#[test]
fn what_another_program_writes_is_taken_up_and_what_was_solved_is_kept_where_that_cannot_be() {
    let mut desk = Desk::new(|_, _| false, None);
    desk.rest();
    let solved = desk.app.outcome().unwrap().counts();
    assert_eq!(solved.0, COUNT);
    let text = fs::read_to_string(desk.file()).unwrap();
    fs::write(desk.file(), format!("{text}\n[[photo]]\nfile = \"gone.png\"\n")).unwrap();
    desk.rest();
    desk.rest();
    assert_eq!(desk.app.document().project().file.photo.len(), COUNT + 1);
    assert_eq!(desk.app.outcome().unwrap().counts(), solved);
    assert!(desk.app.next_step().contains("gone.png"), "{}", desk.app.next_step());
    // With changes of one's own, it is asked about.
    desk.key(Key::N, Modifiers::NONE);
    fs::write(desk.file(), &text).unwrap();
    desk.rest();
    desk.key(Key::Escape, Modifiers::NONE);
    assert_eq!(desk.app.document().project().file.photo.len(), COUNT + 1, "kept");
    desk.key(Key::S, Modifiers::COMMAND);
    assert!(desk.saved().file.point.iter().any(|point| point.name == "p1"));
}
