//! The window, driven by mouse and keys without a display: marking, solving, undoing, saving.

#[path = "../examples/scene/mod.rs"]
mod scene;

use eframe::egui::{Context, Event, Key, Modifiers, PointerButton, Pos2, RawInput, Rect, Vec2};
use glam::DVec2;
use heliodon_mark::app::MarkApp;
use heliodon_mark::document::Document;
use heliodon_photo::project::Project;
use scene::{Corner, Scene};
use std::fs;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

const COUNT: usize = 4;

/// A window and who sits before it.
struct Desk {
    home: tempfile::TempDir,
    scene: Scene,
    ctx: Context,
    app: MarkApp,
    time: f64,
    held: Modifiers,
}

impl Desk {
    /// All corners are marked but for those that are left out.
    fn new(leaves: impl Fn(&str, usize) -> bool, wrong: Option<(&str, usize)>) -> Self {
        let home = tempfile::tempdir().unwrap();
        let scene = Scene::new(560, COUNT);
        scene.write_photographs(home.path());
        scene.write_project(home.path(), leaves, wrong);
        let app = MarkApp::new(Document::open(home.path()).unwrap(), Arc::new(|| {}));
        let mut desk = Self { home, scene, ctx: Context::default(), app, time: 0.0, held: Modifiers::NONE };
        desk.rest();
        desk
    }

    fn file(&self) -> PathBuf {
        self.home.path().join("photos.toml")
    }

    fn frame(&mut self, events: Vec<Event>) {
        self.time += 1.0 / 60.0;
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, Vec2::new(1500.0, 900.0)));
        let mut input =
            RawInput { screen_rect, time: Some(self.time), modifiers: self.held, events, focused: true, ..RawInput::default() };
        self.app.take_input(&self.ctx, &mut input);
        let app = &mut self.app;
        let _ = self.ctx.run_ui(input, |ui| app.show(ui));
    }

    /// Until everything has been read, and what was asked for is solved.
    fn rest(&mut self) {
        for _ in 0..2 {
            self.time += 1.0;
            self.frame(Vec::new());
        }
        for _ in 0..3000 {
            self.frame(Vec::new());
            if !self.app.is_busy() {
                self.frame(Vec::new());
                return;
            }
            thread::sleep(Duration::from_millis(10));
        }
        panic!("it never comes to rest");
    }

    fn key(&mut self, key: Key, modifiers: Modifiers) {
        for pressed in [true, false] {
            self.held = modifiers;
            self.frame(vec![Event::Key { key, physical_key: None, pressed, repeat: false, modifiers }]);
        }
        self.held = Modifiers::NONE;
    }

    fn type_in(&mut self, text: &str) {
        self.frame(vec![Event::Text(text.to_owned())]);
    }

    fn button(&mut self, at: Pos2, pressed: bool, modifiers: Modifiers) {
        self.held = modifiers;
        self.frame(vec![Event::PointerMoved(at)]);
        self.frame(vec![Event::PointerButton { pos: at, button: PointerButton::Primary, pressed, modifiers }]);
        self.held = Modifiers::NONE;
    }

    fn click(&mut self, at: Pos2, modifiers: Modifiers) {
        self.button(at, true, modifiers);
        self.button(at, false, modifiers);
    }

    /// Where a pixel of a pane's photograph is on the window.
    fn at(&self, pane: usize, pixel: DVec2) -> Pos2 {
        self.app.view(pane).unwrap().to_window(pixel)
    }

    fn corner(&self, name: &str) -> Corner {
        Scene::corners().into_iter().find(|corner| corner.name == name).unwrap()
    }

    fn shows(&self, name: &str, photo: usize) -> DVec2 {
        self.scene.shows(photo, &self.corner(name)).unwrap()
    }

    fn mark(&self, point: &str, photo: usize) -> Option<DVec2> {
        let file = &self.app.document().project().file;
        file.point.iter().find(|entry| entry.name == point)?.marks.get(&Scene::photo(photo)).map(|pixel| DVec2::from(*pixel))
    }

    fn saved(&self) -> Project {
        Project::read(self.file()).unwrap()
    }
}

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
