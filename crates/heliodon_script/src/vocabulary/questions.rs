//! What scripts keep and ask.

use super::{Argument, ArgumentKind, Group, Word};
use crate::desk::Desk;
use crate::diagnostic::Wrong;
use crate::names::Kind;
use crate::place::Spot;
use crate::value::Value;
use heliodon_math::random::Pcg32;
use rhai::Dynamic;

const NAME: Argument = Argument { name: "name", kind: ArgumentKind::Key };
const THING: Argument = Argument { name: "thing", kind: ArgumentKind::Name(&[Kind::Thing]) };
const COORDINATE: ArgumentKind = ArgumentKind::Number(-1.0e6, 1.0e6);
const WHERE: ArgumentKind = ArgumentKind::Place;

/// From 0 to below 1, in steps of 2^-24.
fn random(desk: &mut Desk) -> f64 {
    let sheet = desk.sheet();
    f64::from(sheet.random.get_or_insert_with(|| Pcg32::new(0, 0)).next_f32())
}

pub(super) const WORDS: &[Word] = &[
    Word {
        name: "keep",
        group: Group::Memory,
        arguments: &[NAME],
        required: 1,
        fields: &[],
        what: "From here on state.NAME outlives a reload of the script: where the version before had it, its value is taken over now. Write it after the line that gives the value at the very start.",
        example: "state.blows = 0;\nkeep(\"blows\");",
        run: |call| {
            let (name, script) = (call.text(0), call.desk.speaker);
            if let Some(value) = call.desk.sheet().inherited.remove(&name) {
                call.desk.set_state(script, &name, value)?;
            }
            call.desk.sheet().keeps.insert(name);
            Ok(Dynamic::UNIT)
        },
    },
    Word {
        name: "remember",
        group: Group::Memory,
        arguments: &[NAME, Argument { name: "value", kind: ArgumentKind::Data }],
        required: 2,
        fields: &[],
        what: "Remembers a value by a name, for all scripts, for this visit and the next ones.",
        example: r#"when_grab("mallet", || remember("has-mallet", true));"#,
        run: |call| {
            let value = Value::from_script(&call.data(1), crate::memory::MAX_ENTRY_BYTES)?;
            let name = call.text(0);
            call.desk.memory.set(&name, value).map(|()| Dynamic::UNIT)
        },
    },
    Word {
        name: "recall",
        group: Group::Memory,
        arguments: &[NAME, Argument { name: "otherwise", kind: ArgumentKind::Data }],
        required: 1,
        fields: &[],
        what: "What a name was remembered with; where it was not, what stands as `otherwise`, or false.",
        example: r#"if recall("has-mallet") { task("strike"); } else { task("take-mallet"); }"#,
        run: |call| {
            let name = call.text(0);
            let remembered = call.desk.memory.get(&name).map(Value::to_script);
            Ok(remembered.unwrap_or_else(|| {
                let otherwise = call.data(1);
                if otherwise.is_unit() { false.into() } else { otherwise }
            }))
        },
    },
    Word {
        name: "forget",
        group: Group::Memory,
        arguments: &[NAME],
        required: 1,
        fields: &[],
        what: "Forgets what was remembered by a name.",
        example: r#"remember("has-mallet", true);
forget("has-mallet");"#,
        run: |call| {
            let name = call.text(0);
            call.desk.memory.forget(&name);
            Ok(Dynamic::UNIT)
        },
    },
    Word {
        name: "at",
        group: Group::Questions,
        arguments: &[
            Argument { name: "x", kind: COORDINATE },
            Argument { name: "y", kind: COORDINATE },
            Argument { name: "z", kind: COORDINATE },
        ],
        required: 3,
        fields: &[],
        what: "A place: metres to the east, up and to the south. Places can be added, and have .x, .y and .z.",
        example: r#"move_to("mallet", place("bench") + at(0, 0.9, 0));"#,
        run: |call| Ok(Dynamic::from(Spot([call.number_or(0, 0.0), call.number_or(1, 0.0), call.number_or(2, 0.0)]))),
    },
    Word {
        name: "place",
        group: Group::Questions,
        arguments: &[Argument { name: "what", kind: WHERE }],
        required: 1,
        fields: &[],
        what: "Where a thing, part, actor, region or view is.",
        example: r#"if place("mallet").y < 0.2 { hint("pick-it-up"); }"#,
        run: |call| call.spot(0).map(Dynamic::from).ok_or_else(|| Wrong::new("place: there is no such place", "give a name")),
    },
    Word {
        name: "visitor",
        group: Group::Questions,
        arguments: &[],
        required: 0,
        fields: &[],
        what: "Where the visitor stands.",
        example: "if visitor().x > 10.0 { hint(\"turn-back\"); }",
        run: |call| Ok(Dynamic::from(Spot::from_world(call.desk.world.read().visitor))),
    },
    Word {
        name: "distance",
        group: Group::Questions,
        arguments: &[Argument { name: "from", kind: WHERE }, Argument { name: "to", kind: WHERE }],
        required: 2,
        fields: &[],
        what: "How far apart two places are, metres. \"visitor\" is the visitor's.",
        example: r#"if distance("visitor", "fire") < 1.0 { subtitle("too-hot"); }"#,
        run: |call| match (call.spot(0), call.spot(1)) {
            (Some(from), Some(to)) => Ok(from.distance(to).into()),
            _ => Err(Wrong::new("distance: a place is missing", "give two")),
        },
    },
    Word {
        name: "hour",
        group: Group::Questions,
        arguments: &[],
        required: 0,
        fields: &[],
        what: "The hour of the day by the site's clock: 13.5 is half past one.",
        example: "if hour() > 18.0 { start_particles(\"fire\"); }",
        run: |call| Ok((call.desk.world.read().hour_s / 3600.0).into()),
    },
    Word {
        name: "now",
        group: Group::Questions,
        arguments: &[],
        required: 0,
        fields: &[],
        what: "Seconds since the visit began.",
        example: "state.began = now();",
        run: |call| Ok(call.desk.now_s.into()),
    },
    Word {
        name: "is_held",
        group: Group::Questions,
        arguments: &[THING],
        required: 1,
        fields: &[],
        what: "Whether the visitor has a thing in a hand.",
        example: r#"if !is_held("chisel") { hint("take-chisel"); }"#,
        run: |call| {
            let thing = call.text(0);
            let held = call.desk.world.read().held.iter().flatten().any(|held| *held == thing);
            Ok(held.into())
        },
    },
    Word {
        name: "held",
        group: Group::Questions,
        arguments: &[Argument { name: "hand", kind: ArgumentKind::OneOf(crate::action::Hand::WORDS) }],
        required: 0,
        fields: &[],
        what: "What a hand holds, the right one where none is named; \"\" where it is empty.",
        example: r#"if held("left") == "" { hint("both-hands"); }"#,
        run: |call| {
            let hand = call.hand(0);
            let held = call.desk.world.read().held[hand as usize].clone();
            Ok(held.unwrap_or_default().into())
        },
    },
    Word {
        name: "is_inside",
        group: Group::Questions,
        arguments: &[Argument { name: "region", kind: ArgumentKind::Name(&[Kind::Region]) }],
        required: 1,
        fields: &[],
        what: "Whether the visitor is in a region.",
        example: r#"if is_inside("workshop") { task("take-mallet"); }"#,
        run: |call| Ok(call.desk.world.read().inside.contains(&call.text(0)).into()),
    },
    Word {
        name: "is_shown",
        group: Group::Questions,
        arguments: &[Argument { name: "what", kind: ArgumentKind::Name(&[Kind::Thing, Kind::Part, Kind::Actor]) }],
        required: 1,
        fields: &[],
        what: "Whether a thing, part or actor is shown.",
        example: r#"if is_shown("ladder") { hide("ladder"); }"#,
        run: |call| Ok((!call.desk.world.read().hidden.contains(&call.text(0))).into()),
    },
    Word {
        name: "material_of",
        group: Group::Questions,
        arguments: &[Argument { name: "target", kind: ArgumentKind::Name(&[Kind::Thing, Kind::Part]) }],
        required: 1,
        fields: &[],
        what: "What a thing or part is covered with; \"\" where nobody has said.",
        example: r#"if material_of("zeus/robe") == "gold" { subtitle("finished"); }"#,
        run: |call| {
            let material = call.desk.world.read().materials.get(&call.text(0)).cloned();
            Ok(material.unwrap_or_default().into())
        },
    },
    Word {
        name: "language",
        group: Group::Questions,
        arguments: &[],
        required: 0,
        fields: &[],
        what: "The visitor's language, as the table of texts has it: \"en\".",
        example: "if language() == \"el\" { play_sound(\"voice-el\"); } else { play_sound(\"voice-en\"); }",
        run: |call| Ok(call.desk.world.read().language.clone().into()),
    },
    Word {
        name: "random",
        group: Group::Questions,
        arguments: &[Argument { name: "least", kind: COORDINATE }, Argument { name: "most", kind: COORDINATE }],
        required: 0,
        fields: &[],
        what: "A number by chance, from `least` to below `most`; with one number from 0 to it, with none from 0 to 1. A visit that is played again draws the same.",
        example: "after(random(2, 5), || play_sound(\"wood\"));",
        run: |call| {
            let one = call.number_or(0, 1.0);
            let (least, most) = if call.given.len() < 2 { (0.0, one) } else { (one, call.number_or(1, 1.0)) };
            let drawn = random(call.desk);
            Ok((least + (most - least) * drawn).into())
        },
    },
];
