//! A small site, and a runtime that goes through it step by step.
#![allow(dead_code, reason = "each test file uses its own part")]

use heliodon_script::action::Action;
use heliodon_script::diagnostic::Diagnostic;
use heliodon_script::event::Event;
use heliodon_script::limits::Limits;
use heliodon_script::memory::Memory;
use heliodon_script::names::{Kind, Names};
use heliodon_script::program::{Program, Source};
use heliodon_script::runtime::Runtime;
use heliodon_script::world::World;

/// Seconds of a frame.
pub const FRAME_S: f64 = 1.0 / 60.0;

/// The names that the manual's examples use.
pub fn names() -> Names {
    Names::none()
        .with(Kind::Region, ["workshop", "yard"])
        .with(Kind::Thing, ["mallet", "chisel", "ladle", "mould", "ladder", "door", "zeus", "bench", "fire"])
        .with(Kind::Part, ["zeus/face", "zeus/robe", "zeus/hand"])
        .with(Kind::Actor, ["guide", "worker"])
        .with(Kind::Animation, ["hammer", "point"])
        .with(Kind::Material, ["ivory", "gold", "clay"])
        .with(Kind::Film, ["casting"])
        .with(Kind::Sound, ["wood", "noon-bell", "voice-el", "voice-en"])
        .with(Kind::Particles, ["dust", "fire"])
        .with(Kind::Light, ["oil-lamp"])
        .with(
            Kind::Text,
            [
                "welcome",
                "farewell",
                "take-mallet",
                "take-chisel",
                "take-ladle",
                "strike",
                "the-face",
                "harder",
                "not-that",
                "hurry",
                "too-hot",
                "turn-back",
                "both-hands",
                "pick-it-up",
                "finished",
                "blows-left",
                "well-done",
            ],
        )
        .with(Kind::View, ["before-the-statue"])
        .with(Kind::Path, ["to-the-statue"])
}

/// The world of the examples.
pub fn world() -> World {
    let mut world = World::new();
    for (name, place) in
        [("bench", [1.0, 0.0, 2.0]), ("mallet", [1.0, 0.9, 2.0]), ("fire", [5.0, 0.0, 0.0]), ("zeus", [0.0, 0.0, -8.0])]
    {
        world.set_place(name, place);
    }
    world.set_language("en");
    world
}

/// Compiles scripts that must be sound, and may be warned of.
pub fn program(scripts: &[(&str, &str)]) -> Program {
    let sources: Vec<Source> = scripts.iter().map(|(name, text)| Source::new(*name, *text)).collect();
    let (program, told) = Program::compile(&sources, &names());
    assert!(program.is_sound(), "{}", lines(&told));
    program
}

/// What is told, a line each.
pub fn lines(told: &[Diagnostic]) -> String {
    told.iter().map(|diagnostic| format!("{diagnostic}\n")).collect()
}

/// A runtime at its first frame, and its time.
pub struct Stage {
    pub runtime: Runtime,
    pub world: World,
    pub now_s: f64,
}

impl Stage {
    pub fn new(scripts: &[(&str, &str)]) -> Self {
        Self::with_limits(scripts, Limits::deterministic())
    }

    pub fn with_limits(scripts: &[(&str, &str)], limits: Limits) -> Self {
        Self { runtime: Runtime::new(program(scripts), Memory::default(), limits, 7), world: world(), now_s: 0.0 }
    }

    /// A frame; answers with what was asked for.
    pub fn step(&mut self) -> Vec<Action> {
        self.now_s += FRAME_S;
        self.runtime.step(self.now_s, &self.world)
    }

    /// Tells an event and steps.
    pub fn after(&mut self, event: Event) -> Vec<Action> {
        self.runtime.event(event);
        self.step()
    }

    /// Steps through so many seconds; answers with all that was asked for.
    pub fn wait(&mut self, seconds: f64) -> Vec<Action> {
        let until = self.now_s + seconds;
        let mut actions = Vec::new();
        while self.now_s < until {
            actions.extend(self.step());
        }
        actions
    }

    /// What was told, a line each.
    pub fn told(&mut self) -> String {
        lines(&self.runtime.take_told())
    }
}

pub fn entered(region: &str) -> Event {
    Event::Entered { region: region.to_owned() }
}

pub fn touched(thing: &str) -> Event {
    Event::Touched { thing: thing.to_owned(), hand: heliodon_script::action::Hand::Right }
}

pub fn grabbed(thing: &str) -> Event {
    Event::Grabbed { thing: thing.to_owned(), hand: heliodon_script::action::Hand::Right }
}

pub fn struck(target: &str, tool: &str, speed: f32) -> Event {
    Event::Struck { target: target.to_owned(), tool: tool.to_owned(), speed, place: [0.0; 3] }
}

pub fn applied(target: &str, material: &str, tool: &str) -> Event {
    Event::Applied { target: target.to_owned(), material: material.to_owned(), tool: tool.to_owned() }
}

pub fn arrived(what: &str) -> Event {
    Event::Arrived { what: what.to_owned() }
}

pub fn ended(what: &str) -> Event {
    Event::Ended { what: what.to_owned() }
}

/// The keys of all subtitles and tasks among actions, as `subtitle welcome`, `task strike`.
pub fn said(actions: &[Action]) -> Vec<String> {
    let line = |action: &Action| match action {
        Action::Subtitle { text, .. } => Some(format!("subtitle {text}")),
        Action::Task { text, .. } => Some(format!("task {text}")),
        Action::Hint { text, .. } => Some(format!("hint {text}")),
        Action::NoTask => Some("no task".to_owned()),
        _ => None,
    };
    actions.iter().filter_map(line).collect()
}
