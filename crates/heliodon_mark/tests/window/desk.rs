//! A window and who sits before it.

use crate::scene::{Corner, Scene};
use eframe::egui::epaint::{ClippedShape, ColorMode};
use eframe::egui::{
    Color32, Context, Event, Id, Key, Modifiers, PointerButton, Pos2, RawInput, Rect, Shape, Vec2, ViewportCommand,
    ViewportEvent, ViewportId,
};
use glam::DVec2;
use heliodon_mark::app::MarkApp;
use heliodon_mark::document::Document;
use heliodon_mark::solving::Outcome;
use heliodon_photo::project::Project;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

pub const COUNT: usize = 4;

/// What lines of the model are drawn in that nothing hides.
const MODEL: Color32 = Color32::from_rgb(90, 225, 165);

/// A window and who sits before it.
pub struct Desk {
    pub home: tempfile::TempDir,
    pub scene: Scene,
    pub ctx: Context,
    pub app: MarkApp,
    pub time: f64,
    held: Modifiers,
    /// What the last frame drew, and what it asked the window's owner for.
    drawn: Vec<ClippedShape>,
    pub commands: Vec<ViewportCommand>,
}

impl Desk {
    /// All corners are marked but for those that are left out.
    pub fn new(leaves: impl Fn(&str, usize) -> bool, wrong: Option<(&str, usize)>) -> Self {
        let home = tempfile::tempdir().expect("the desk is set");
        let scene = Scene::new(560, COUNT);
        scene.write_photographs(home.path());
        scene.write_project(home.path(), leaves, wrong);
        let app = MarkApp::new(Document::open(home.path()).expect("the desk is set"), Arc::new(|| {}));
        let mut desk = Self {
            home,
            scene,
            ctx: Context::default(),
            app,
            time: 0.0,
            held: Modifiers::NONE,
            drawn: Vec::new(),
            commands: Vec::new(),
        };
        desk.rest();
        desk
    }

    pub fn file(&self) -> PathBuf {
        self.home.path().join("photos.toml")
    }

    pub fn frame(&mut self, events: Vec<Event>) {
        self.time += 1.0 / 60.0;
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, Vec2::new(1500.0, 900.0)));
        let input =
            RawInput { screen_rect, time: Some(self.time), modifiers: self.held, events, focused: true, ..RawInput::default() };
        self.run(input);
    }

    fn run(&mut self, mut input: RawInput) {
        self.app.take_input(&self.ctx, &mut input);
        let app = &mut self.app;
        let output = self.ctx.run_ui(input, |ui| app.show(ui));
        self.drawn = output.shapes;
        self.commands = output.viewport_output.into_values().flat_map(|viewport| viewport.commands).collect();
    }

    /// A frame in which the window's owner wants it closed.
    pub fn close(&mut self) {
        self.time += 1.0 / 60.0;
        let mut input = RawInput { time: Some(self.time), focused: true, ..RawInput::default() };
        input.screen_rect = Some(Rect::from_min_size(Pos2::ZERO, Vec2::new(1500.0, 900.0)));
        input.viewports.entry(ViewportId::ROOT).or_default().events.push(ViewportEvent::Close);
        self.run(input);
    }

    /// All words on the window, with where they stand and where they would be cut off.
    pub fn words(&self) -> Vec<(String, Rect, Rect)> {
        let mut found = Vec::new();
        for clipped in &self.drawn {
            gather(&clipped.shape, clipped.clip_rect, &mut found);
        }
        found
    }

    /// How many of the model's lines stand over the photographs in the last frame, hidden ones not counted.
    pub fn model_lines(&self) -> usize {
        fn count(shape: &Shape) -> usize {
            match shape {
                Shape::Vec(all) => all.iter().map(count).sum(),
                Shape::Path(path) => usize::from(path.stroke.color == ColorMode::Solid(MODEL)),
                _ => 0,
            }
        }
        self.drawn.iter().map(|clipped| count(&clipped.shape)).sum()
    }

    /// Where words stand, those that were drawn last.
    pub fn find(&self, words: &str) -> Pos2 {
        let all = self.words();
        let found = all.iter().rev().find(|(each, place, clip)| each == words && clip.intersects(*place));
        let Some((_, place, _)) = found else {
            panic!("{words} is nowhere: {:?}", all.iter().map(|(words, ..)| words).collect::<Vec<_>>())
        };
        place.center()
    }

    /// Frames in which a dialog that has just opened becomes as large as what is in it.
    pub fn settle(&mut self) {
        (0..4).for_each(|_| self.frame(Vec::new()));
    }

    /// Clicks words, once they stand where they stay.
    pub fn click_words(&mut self, words: &str) {
        self.settle();
        self.click(self.find(words), Modifiers::NONE);
        self.frame(Vec::new());
    }

    /// Tab until a field has it.
    pub fn tab_to(&mut self, id: Id) {
        for _ in 0..60 {
            if self.ctx.memory(|memory| memory.focused()) == Some(id) {
                return;
            }
            self.key(Key::Tab, Modifiers::NONE);
        }
        panic!("Tab never gets there");
    }

    /// Until everything has been read, and what was asked for is solved.
    pub fn rest(&mut self) {
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

    pub fn key(&mut self, key: Key, modifiers: Modifiers) {
        for pressed in [true, false] {
            self.held = modifiers;
            self.frame(vec![Event::Key { key, physical_key: None, pressed, repeat: false, modifiers }]);
        }
        self.held = Modifiers::NONE;
    }

    pub fn type_in(&mut self, text: &str) {
        self.frame(vec![Event::Text(text.to_owned())]);
    }

    pub fn button(&mut self, at: Pos2, pressed: bool, modifiers: Modifiers) {
        self.held = modifiers;
        self.frame(vec![Event::PointerMoved(at)]);
        self.frame(vec![Event::PointerButton { pos: at, button: PointerButton::Primary, pressed, modifiers }]);
        self.held = Modifiers::NONE;
    }

    pub fn click(&mut self, at: Pos2, modifiers: Modifiers) {
        self.button(at, true, modifiers);
        self.button(at, false, modifiers);
    }

    /// Where a pixel of a pane's photograph is on the window.
    pub fn at(&self, pane: usize, pixel: DVec2) -> Pos2 {
        self.app.view(pane).expect("the desk is set").to_window(pixel)
    }

    pub fn corner(&self, name: &str) -> Corner {
        Scene::corners().into_iter().find(|corner| corner.name == name).expect("the desk is set")
    }

    pub fn shows(&self, name: &str, photo: usize) -> DVec2 {
        self.scene.shows(photo, &self.corner(name)).expect("the desk is set")
    }

    pub fn mark(&self, point: &str, photo: usize) -> Option<DVec2> {
        let file = &self.app.document().project().file;
        file.point.iter().find(|entry| entry.name == point)?.marks.get(&Scene::photo(photo)).map(|pixel| DVec2::from(*pixel))
    }

    /// What was solved last.
    pub fn solved(&self) -> &Outcome {
        self.app.outcome().expect("it was solved")
    }

    pub fn saved(&self) -> Project {
        Project::read(self.file()).expect("the desk is set")
    }
}

fn gather(shape: &Shape, clip: Rect, found: &mut Vec<(String, Rect, Rect)>) {
    match shape {
        Shape::Vec(all) => all.iter().for_each(|shape| gather(shape, clip, found)),
        Shape::Text(text) => {
            let place = text.galley.rect.translate(text.pos.to_vec2());
            found.push((text.galley.text().to_owned(), place, clip));
        }
        _ => {}
    }
}
