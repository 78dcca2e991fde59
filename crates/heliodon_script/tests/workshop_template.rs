//! The story of the template's workshop, from the welcome to the finished colossus, in two visits and with mistakes.
#![expect(clippy::unwrap_used, reason = "helpers of tests: a test that cannot go on has failed")]

mod common;

use common::*;
use heliodon_script::action::Action;
use heliodon_script::limits::Limits;
use heliodon_script::memory::Memory;
use heliodon_script::names::{Kind, Names};
use heliodon_script::program::{Program, Source};
use heliodon_script::runtime::Runtime;
use heliodon_script::texts::Texts;
use heliodon_script::world::World;

const TEXTS: &str = include_str!("../../heliodon/src/templates/workshop/texts.toml");
const STORY: &str = include_str!("../../heliodon/src/templates/workshop/story.rhai");

fn visit(memory: Memory) -> Stage {
    let texts = Texts::parse(TEXTS, "texts.toml").unwrap();
    assert_eq!(lines(&texts.missing()), "");
    let things = ["mallet", "ivory-block", "ivory-plate", "face-form", "ladle", "victory-mould", "gold-sheet", "robe-panel"];
    let parts = ["zeus-face", "zeus-body", "zeus-hair", "zeus-robe", "zeus-victory", "zeus-sceptre"];
    let names = Names::none()
        .with(Kind::Region, ["workshop"])
        .with(Kind::Thing, things)
        .with(Kind::Part, parts)
        .with(Kind::Material, ["ivory", "gold", "glass"])
        .with(Kind::Sound, ["blow", "bell", "wind", "laid", "poured", "cheering"])
        .with(Kind::Path, ["to-the-carver", "to-the-ivory", "to-the-moulds", "to-the-gold"])
        .with(Kind::View, ["before-the-statue"])
        .with(Kind::Text, texts.keys());
    let (program, told) = Program::compile(&[Source::new("story.rhai", STORY)], &names);
    assert!(program.is_sound() && told.is_empty(), "{}", lines(&told));
    let mut world = World::new();
    world.set_inside("workshop", true);
    let mut stage = Stage { runtime: Runtime::new(program, memory, Limits::deterministic(), 1), world, now_s: 0.0 };
    stage.step();
    stage
}

fn covers(actions: &[Action], part: &str, of: &str) -> bool {
    actions.iter().any(|a| matches!(a, Action::Material { target, material, .. } if target == part && material == of))
}

#[test]
fn zeus_is_finished_in_two_visits() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("memory.json");
    let mut stage = visit(Memory::open(&path).0);
    assert_eq!(said(&stage.after(entered("workshop"))), ["subtitle welcome", "task take-mallet"]);
    assert_eq!(said(&stage.after(struck("ivory-block", "mallet", 3.0))), [""; 0], "the order of the work is kept");
    assert_eq!(said(&stage.after(grabbed("gold-sheet"))), ["hint for-gold-sheet"], "it is not needed yet");
    assert_eq!(said(&stage.after(grabbed("mallet"))), ["task carve"]);
    assert_eq!(said(&stage.after(struck("ivory-block", "mallet", 0.2))), ["hint harder"]);
    assert_eq!(said(&stage.after(struck("ivory-block", "mallet", 2.0))), ["task carve"]);
    assert_eq!(said(&stage.after(struck("ivory-block", "mallet", 2.0))), ["task carve"]);
    assert_eq!(said(&stage.after(struck("ivory-block", "mallet", 2.0))), ["task ivory"]);
    assert_eq!(said(&stage.after(applied("face-form", "gold", "gold-sheet"))), ["hint wrong-face-form"]);
    assert_eq!(said(&stage.after(applied("robe-panel", "gold", "gold-sheet"))), ["hint order"]);
    let ivory = stage.after(applied("face-form", "ivory", "ivory-plate"));
    assert!(covers(&ivory, "zeus-face", "ivory") && covers(&ivory, "zeus-body", "ivory"), "{ivory:?}");
    assert_eq!(said(&ivory), ["task glass"]);
    stage.runtime.with_memory(|memory| memory.save(&path)).unwrap();
    assert_eq!(stage.told(), "");

    let mut stage = visit(Memory::open(&path).0);
    let back = stage.after(entered("workshop"));
    assert_eq!(said(&back), ["subtitle welcome-back", "task glass"]);
    assert!(covers(&back, "zeus-face", "ivory") && !covers(&back, "zeus-robe", "gold"));
    assert_eq!(said(&stage.after(applied("victory-mould", "glass", "ladle"))), ["hint too-hot"]);
    let cool = stage.wait(3.2);
    assert!(covers(&cool, "zeus-victory", "glass"));
    assert_eq!(said(&cool), ["task gold"]);
    let gold = stage.after(applied("robe-panel", "gold", "gold-sheet"));
    assert!(covers(&gold, "zeus-robe", "gold") && covers(&gold, "zeus-hair", "gold"));
    assert_eq!(said(&gold), ["no task", "subtitle finished"]);
    let end = stage.wait(1.7);
    assert!(end.contains(&Action::GoTo { view: "before-the-statue".into(), seconds: 0.0 }), "{end:?}");
    assert_eq!(stage.told(), "");
    stage.runtime.with_memory(|memory| memory.save(&path)).unwrap();

    // who comes back to the finished statue is not taken anywhere
    let mut stage = visit(Memory::open(&path).0);
    let back = stage.after(entered("workshop"));
    assert_eq!(said(&back), ["subtitle welcome-back", "subtitle admire"]);
    assert!(
        covers(&back, "zeus-face", "ivory") && covers(&back, "zeus-victory", "glass") && covers(&back, "zeus-robe", "gold")
    );
    assert!(!stage.wait(3.0).iter().any(|action| matches!(action, Action::GoTo { .. })));
    assert_eq!(stage.told(), "");
}
