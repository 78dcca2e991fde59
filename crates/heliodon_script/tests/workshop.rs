//! The Workshop of Feidias, in small: from the welcome to the finished colossus, in two visits.
#![expect(clippy::unwrap_used, reason = "helpers of tests: a test that cannot go on has failed")]

mod common;

use common::*;
use heliodon_script::action::{Action, Hand};
use heliodon_script::limits::Limits;
use heliodon_script::memory::Memory;
use heliodon_script::names::{Kind, Names};
use heliodon_script::program::{Program, Source};
use heliodon_script::runtime::Runtime;
use heliodon_script::texts::Texts;
use heliodon_script::world::World;

const TEXTS: &str = include_str!("workshop/texts.toml");

fn workshop_names(texts: &Texts) -> Names {
    Names::none()
        .with(Kind::Region, ["workshop"])
        .with(Kind::Thing, ["mallet", "chisel", "ladle", "mould", "bench", "zeus"])
        .with(Kind::Part, ["zeus/face", "zeus/hand", "zeus/robe"])
        .with(Kind::Actor, ["guide", "worker"])
        .with(Kind::Animation, ["hammer", "point"])
        .with(Kind::Material, ["ivory", "gold", "glass"])
        .with(Kind::Sound, ["chisel-on-wood", "hammering"])
        .with(Kind::Particles, ["dust", "fire"])
        .with(Kind::Light, ["furnace"])
        .with(Kind::View, ["before-the-statue"])
        .with(Kind::Path, ["round-the-statue"])
        .with(Kind::Text, texts.keys())
}

fn visit(memory: Memory) -> Stage {
    let texts = Texts::parse(TEXTS, "texts.toml").unwrap();
    let sources = [
        Source::new("story.rhai", include_str!("workshop/story.rhai")),
        Source::new("people.rhai", include_str!("workshop/people.rhai")),
    ];
    let (program, told) = Program::compile(&sources, &workshop_names(&texts));
    assert!(program.is_sound() && told.is_empty(), "{}", lines(&told));
    let mut world = World::new();
    world.set_place("bench", [2.0, 0.0, 1.0]);
    world.set_place("worker", [3.0, 0.0, 0.0]);
    world.set_inside("workshop", true);
    Stage { runtime: Runtime::new(program, memory, Limits::deterministic(), 1), world, now_s: 0.0 }
}

/// An event, and then the frame in which messages of its handlers are heard.
fn hear(stage: &mut Stage, event: heliodon_script::event::Event) -> Vec<Action> {
    let mut actions = stage.after(event);
    actions.extend(stage.step());
    actions
}

#[test]
fn the_texts_are_there_in_every_language() {
    assert_eq!(lines(&Texts::parse(TEXTS, "texts.toml").unwrap().missing()), "");
}

#[test]
fn the_visitor_finishes_zeus_in_two_visits() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("memory.json");
    let texts = Texts::parse(TEXTS, "texts.toml").unwrap();

    // the first visit: mallet, three blows, glass
    let mut stage = visit(Memory::open(&path).0);
    assert!(stage.step().contains(&Action::StartParticles { particles: "fire".into() }));
    let actions = hear(&mut stage, entered("workshop"));
    assert_eq!(said(&actions), ["subtitle welcome", "task take-mallet"]);
    assert!(actions.contains(&Action::Walk { actor: "guide".into(), to: [2.0, 0.0, 1.0] }));
    let pointing = stage.after(arrived("guide"));
    assert_eq!(pointing, [Action::Animate { what: "guide".into(), animation: "point".into(), repeat: false }]);
    assert_eq!(stage.after(ended("guide")), [Action::Follow { actor: "guide".into(), path: "round-the-statue".into() }]);

    assert_eq!(said(&hear(&mut stage, struck("zeus/face", "chisel", 3.0))), [""; 0], "the order of the work is kept");
    let carve = hear(&mut stage, grabbed("mallet"));
    let Some(Action::Task { text, values }) = carve.iter().find(|action| matches!(action, Action::Task { .. })) else {
        panic!("no task: {carve:?}")
    };
    assert_eq!(texts.show(text, "de", values).unwrap(), "Bearbeite das Gesicht: noch 3 Schläge.");
    assert_eq!(said(&hear(&mut stage, struck("zeus/face", "chisel", 3.0))), ["hint need-mallet"]);
    stage.world.set_held(Hand::Right, Some("mallet"));
    assert_eq!(said(&hear(&mut stage, struck("zeus/face", "chisel", 0.2))), ["hint harder"]);
    assert_eq!(said(&hear(&mut stage, struck("zeus/face", "chisel", 2.0))), ["task carve"]);
    assert_eq!(said(&hear(&mut stage, struck("zeus/face", "chisel", 2.0))), ["task carve"]);
    let last = hear(&mut stage, struck("zeus/face", "chisel", 2.0));
    assert_eq!(said(&last), ["task take-ladle"]);
    assert!(last.contains(&Action::StopAnimation { what: "worker".into() }), "the workers hear of it");
    assert_eq!(said(&hear(&mut stage, applied("mould", "glass", "ladle"))), ["hint too-hot"]);
    assert_eq!(said(&stage.wait(2.1)), ["task cover"]);
    stage.runtime.with_memory(|memory| memory.save(&path)).unwrap();
    assert_eq!(stage.told(), "");

    // the second: it goes on where the first was left
    let (memory, damaged) = Memory::open(&path);
    assert!(damaged.is_none());
    let mut stage = visit(memory);
    stage.step();
    assert_eq!(said(&hear(&mut stage, entered("workshop"))), ["subtitle welcome-back", "task cover"]);
    assert_eq!(said(&hear(&mut stage, applied("zeus/robe", "gold", "hand"))), ["hint ivory-first"]);
    assert_eq!(said(&hear(&mut stage, applied("zeus/face", "gold", "hand"))), ["hint ivory-first"]);
    for part in ["zeus/face", "zeus/hand"] {
        let covered = hear(&mut stage, applied(part, "ivory", "hand"));
        assert_eq!(covered, [Action::Material { target: part.into(), material: "ivory".into(), seconds: 2.0 }]);
    }
    let finished = hear(&mut stage, applied("zeus/robe", "gold", "hand"));
    assert_eq!(said(&finished), ["task finished", "subtitle finished", "no task"]);
    let end = stage.wait(1.5);
    assert!(end.contains(&Action::GoTo { view: "before-the-statue".into(), seconds: 0.0 }), "{end:?}");
    assert!(end.contains(&Action::SetHour { hour_s: 63_000.0, seconds: 10.0 }));
    assert_eq!(stage.told(), "");
    let hammering = stage.wait(8.0).iter().filter(|action| matches!(action, Action::PlaySound { .. })).count();
    assert_eq!(hammering, 2);
}
