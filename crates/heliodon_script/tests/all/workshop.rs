//! The story of the template's workshop, from the welcome to the finished colossus, in two visits and with mistakes.
#![expect(clippy::unwrap_used, reason = "helpers of tests: a test that cannot go on has failed")]

use crate::common::*;
use heliodon_script::action::Action;
use heliodon_script::limits::Limits;
use heliodon_script::memory::Memory;
use heliodon_script::names::{Kind, Names};
use heliodon_script::program::{Program, Source};
use heliodon_script::runtime::Runtime;
use heliodon_script::texts::Texts;
use heliodon_script::world::World;

const TEXTS: &str = include_str!("../../../heliodon/src/templates/workshop/texts.toml");
const STORY: &str = include_str!("../../../heliodon/src/templates/workshop/story.rhai");

fn visit(memory: Memory) -> Stage {
    let texts = Texts::parse(TEXTS, "texts.toml").unwrap();
    assert_eq!(lines(&texts.missing()), "");
    let things =
        ["mallet", "ivory-block", "ivory-plate", "face-form", "ladle", "crucible", "victory-mould", "gold-sheet", "robe-panel"];
    let parts = ["zeus-face", "zeus-body", "zeus-hair", "zeus-robe", "zeus-victory", "zeus-sceptre", "throne"];
    let ways = ["to-the-carver", "to-the-ivory", "to-the-moulds", "to-the-mould", "to-the-gold"];
    let masters = ["carver", "ivory", "furnace", "gold", "statue"].map(|goal| format!("master-to-the-{goal}"));
    let names = Names::none()
        .with(Kind::Region, ["workshop"])
        .with(Kind::Thing, things)
        .with(Kind::Part, parts)
        .with(Kind::Actor, ["master", "carver", "helper", "porter"])
        .with(Kind::Animation, ["idle", "walk", "point", "hammer", "cheer"])
        .with(Kind::Material, ["ivory", "gold", "glass"])
        .with(Kind::Particles, ["dust", "fire", "smoke", "sparks", "chips", "steam"])
        .with(Kind::Sound, ["blow", "bell", "wind", "laid", "poured", "dipped", "cheering", "carving", "knock"])
        .with(Kind::Path, ways)
        .with(Kind::Path, masters)
        .with(Kind::View, ["before-the-statue"])
        .with(Kind::Text, texts.keys());
    let (program, told) = Program::compile(&[Source::new("story.rhai", STORY)], &names);
    assert!(program.is_sound() && told.is_empty(), "{}", lines(&told));
    let mut world = World::new();
    world.set_inside("workshop", true);
    for (name, place) in [("carver", [6.3, 0.0, 2.4]), ("face-form", [-2.0, 0.9, -3.2]), ("robe-panel", [2.9, 0.9, -3.2])] {
        world.set_place(name, place);
    }
    let mut stage = Stage { runtime: Runtime::new(program, memory, Limits::deterministic(), 1), world, now_s: 0.0 };
    stage.step();
    stage
}

fn covers(actions: &[Action], part: &str, of: &str) -> bool {
    actions.iter().any(|a| matches!(a, Action::Material { target, material, .. } if target == part && material == of))
}

fn follows(actions: &[Action]) -> Option<&str> {
    actions.iter().find_map(|action| match action {
        Action::Follow { path, .. } => Some(path.as_str()),
        _ => None,
    })
}

#[test]
fn zeus_is_finished_in_two_visits() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("memory.json");
    let mut stage = visit(Memory::open(&path).0);
    let welcome = stage.after(entered("workshop"));
    assert_eq!(said(&welcome), ["subtitle welcome", "task do-take-mallet"]);
    assert_eq!(follows(&welcome), Some("master-to-the-carver"), "the master goes ahead");
    assert_eq!(said(&stage.after(struck("ivory-block", "mallet", 3.0))), [""; 0], "the order of the work is kept");
    assert_eq!(said(&stage.after(grabbed("gold-sheet"))), ["hint for-gold-sheet"], "it is not needed yet");
    assert_eq!(said(&stage.wait(26.0)), ["hint help-take-mallet"], "who stands about is helped");
    assert_eq!(said(&stage.wait(26.0)), ["hint help-take-mallet"], "again");
    assert_eq!(said(&stage.after(grabbed("mallet"))), ["subtitle told-carve", "task do-carve"]);
    assert_eq!(said(&stage.after(struck("ivory-block", "mallet", 0.2))), ["hint harder"]);
    assert_eq!(said(&stage.after(struck("ivory-block", "mallet", 2.0))), ["task do-carve"]);
    assert_eq!(said(&stage.after(struck("ivory-block", "mallet", 2.0))), ["task do-carve"]);
    assert_eq!(said(&stage.after(struck("ivory-block", "mallet", 2.0))), ["subtitle told-ivory", "task do-ivory"]);
    assert_eq!(said(&stage.after(applied("face-form", "gold", "gold-sheet"))), ["hint wrong-face-form"]);
    assert_eq!(said(&stage.after(applied("robe-panel", "gold", "gold-sheet"))), ["hint order"]);
    let ivory = stage.after(applied("face-form", "ivory", "ivory-plate"));
    assert!(covers(&ivory, "zeus-face", "ivory") && covers(&ivory, "zeus-body", "ivory"), "{ivory:?} {}", stage.told());
    assert_eq!(said(&ivory), ["subtitle told-melt", "task do-melt"]);
    assert_eq!(said(&stage.after(applied("victory-mould", "glass", "ladle"))), ["hint empty"], "nothing is in the ladle yet");
    assert_eq!(said(&stage.after(applied("crucible", "glass", "ladle"))), ["task do-glass"]);
    stage.runtime.with_memory(|memory| memory.save(&path)).unwrap();
    assert_eq!(stage.told(), "");

    let mut stage = visit(Memory::open(&path).0);
    let back = stage.after(entered("workshop"));
    assert_eq!(said(&back), ["subtitle welcome-back", "task do-glass"]);
    assert!(covers(&back, "zeus-face", "ivory") && !covers(&back, "zeus-victory", "glass"));
    assert_eq!(said(&stage.after(applied("victory-mould", "glass", "ladle"))), ["hint too-hot"]);
    let cool = stage.wait(3.2);
    assert!(covers(&cool, "zeus-victory", "glass"));
    assert_eq!(said(&cool), ["subtitle told-gold", "task do-gold"]);
    let gold = stage.after(applied("robe-panel", "gold", "gold-sheet"));
    assert!(covers(&gold, "zeus-robe", "gold") && covers(&gold, "zeus-hair", "gold"));
    assert_eq!(said(&gold), ["no task", "subtitle finished"]);
    let end = stage.wait(7.0);
    assert!(end.contains(&Action::GoTo { view: "before-the-statue".into(), seconds: 0.0 }), "{end:?}");
    assert_eq!(said(&stage.wait(40.0)), [""; 0], "nobody needs help any more");
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
