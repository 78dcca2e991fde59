//! Closing the window, with work that is not saved and a project that others write at the same time.

use crate::desk::Desk;
use eframe::egui::{Event, Key, Modifiers, ViewportCommand};
use heliodon_mark::document::Document;
use std::fs;

fn autosave(desk: &Desk) -> std::path::PathBuf {
    desk.home.path().join(".photos.toml.autosave")
}

/// A desk with a point more than its file has.
fn changed_desk() -> Desk {
    let mut desk = Desk::new(|_, _| false, None);
    desk.rest();
    desk.key(Key::N, Modifiers::NONE);
    assert!(desk.app.document().is_changed());
    desk
}

fn has_point(text: &str) -> bool {
    text.contains("name = \"p1\"")
}

fn asks_to_stay(desk: &mut Desk) {
    desk.close();
    assert_eq!(desk.commands, [ViewportCommand::CancelClose]);
    desk.settle();
}

fn is_closed(desk: &mut Desk) -> bool {
    if desk.commands != [ViewportCommand::Close] {
        return false;
    }
    // the owner asks once more, and is let
    desk.close();
    desk.commands.is_empty()
}

#[test]
fn without_changes_it_closes_at_once() {
    let mut desk = Desk::new(|_, _| false, None);
    desk.rest();
    desk.close();
    assert!(desk.commands.is_empty());
    // what was done and undone leaves nothing to be found the next time
    desk.key(Key::N, Modifiers::NONE);
    desk.time += 11.0;
    desk.frame(Vec::new());
    assert!(autosave(&desk).exists());
    desk.key(Key::Z, Modifiers::COMMAND);
    desk.close();
    assert!(desk.commands.is_empty() && !autosave(&desk).exists());
    // a dialog that only looks at a shape keeps nothing open
    desk.key(Key::B, Modifiers::SHIFT);
    desk.close();
    assert!(desk.commands.is_empty());
}

#[test]
fn unsaved_work_is_saved_let_go_or_gone_on_with() {
    let mut desk = changed_desk();
    let before = fs::read_to_string(desk.file()).unwrap();
    asks_to_stay(&mut desk);
    desk.key(Key::Escape, Modifiers::NONE);
    assert!(desk.app.document().is_changed(), "gone on with");
    desk.key(Key::N, Modifiers::NONE);
    assert!(desk.app.document().text().contains("name = \"p2\""), "and it can be gone on with");
    // asked twice it is still one question
    asks_to_stay(&mut desk);
    asks_to_stay(&mut desk);
    desk.click(desk.find("Do not save"), Modifiers::NONE);
    assert!(is_closed(&mut desk));
    assert_eq!(fs::read_to_string(desk.file()).unwrap(), before);
    // the autosave does not come back behind it
    desk.time += 20.0;
    desk.frame(Vec::new());
    assert!(!autosave(&desk).exists());
    assert!(!Document::open(desk.home.path()).unwrap().has_left_work());

    let mut desk = changed_desk();
    asks_to_stay(&mut desk);
    desk.frame(vec![Event::Key {
        key: Key::Enter,
        physical_key: None,
        pressed: true,
        repeat: false,
        modifiers: Modifiers::NONE,
    }]);
    assert!(is_closed(&mut desk));
    assert!(has_point(&fs::read_to_string(desk.file()).unwrap()));
}

#[test]
fn what_another_program_wrote_meanwhile_is_asked_about_before_it_closes() {
    for (answer, ours, closes) in
        [("Save mine over it", true, true), ("Leave theirs, close", false, true), ("Stay", false, false)]
    {
        let mut desk = changed_desk();
        let theirs = fs::read_to_string(desk.file()).unwrap().replace("Two blocks", "Three blocks");
        asks_to_stay(&mut desk);
        fs::write(desk.file(), &theirs).unwrap();
        desk.click(desk.find("Save"), Modifiers::NONE);
        assert_eq!(fs::read_to_string(desk.file()).unwrap(), theirs, "nothing is written over it unasked");
        desk.settle();
        desk.click(desk.find(answer), Modifiers::NONE);
        assert_eq!(is_closed(&mut desk), closes, "{answer}");
        let text = fs::read_to_string(desk.file()).unwrap();
        assert_eq!((has_point(&text), text == theirs), (ours, !ours), "{answer}");
        if !closes {
            assert!(has_point(desk.app.document().text()), "ours is still there");
            // and may be closed later, once more asked about
            asks_to_stay(&mut desk);
        } else {
            assert!(!autosave(&desk).exists());
        }
    }
}

#[test]
fn a_shape_that_is_not_made_yet_is_not_lost_without_a_word() {
    let mut desk = Desk::new(|_, _| false, None);
    desk.rest();
    let begin = |desk: &mut Desk| {
        for _ in 0..3 {
            desk.key(Key::Tab, Modifiers::NONE);
            desk.key(Key::X, Modifiers::NONE);
        }
        desk.key(Key::B, Modifiers::NONE);
    };
    begin(&mut desk);
    asks_to_stay(&mut desk);
    desk.click(desk.find("Stay"), Modifiers::NONE);
    desk.frame(Vec::new());
    // the dialog is there again, as it was
    desk.click_words("Make");
    assert_eq!(desk.app.document().project().file.shape.len(), 2);
    desk.key(Key::Z, Modifiers::COMMAND);
    assert!(!desk.app.document().is_changed());
    begin(&mut desk);
    asks_to_stay(&mut desk);
    desk.click(desk.find("Save"), Modifiers::NONE);
    assert!(is_closed(&mut desk));
    assert_eq!(desk.saved().file.shape.len(), 2);
}

#[test]
fn where_it_cannot_be_saved_it_stays_open_and_says_why() {
    let mut desk = changed_desk();
    asks_to_stay(&mut desk);
    // a folder stands where the file is to be written first
    fs::create_dir(desk.home.path().join(".photos.toml.new")).unwrap();
    desk.click(desk.find("Save"), Modifiers::NONE);
    assert!(!is_closed(&mut desk));
    assert!(desk.app.message().unwrap().contains("cannot be written"), "{:?}", desk.app.message());
    fs::remove_dir(desk.home.path().join(".photos.toml.new")).unwrap();
    desk.key(Key::S, Modifiers::COMMAND);
    assert!(has_point(&fs::read_to_string(desk.file()).unwrap()));
}
