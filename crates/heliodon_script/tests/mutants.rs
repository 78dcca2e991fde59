//! Mutated scripts, random events: nothing panics, and whatever compiles stays within its limits.

mod common;

use common::*;
use heliodon_script::action::Hand;
use heliodon_script::event::Event;
use heliodon_script::limits::Limits;
use heliodon_script::memory::Memory;
use heliodon_script::program::{Program, Source};
use heliodon_script::runtime::Runtime;
use heliodon_script::vocabulary::words;
use proptest::prelude::*;

/// Pieces that scripts are made of, so that much of what is put together compiles.
const PIECES: &[&str] = &[
    "state.a",
    "state",
    " += 1",
    " = ",
    "[1, 2]",
    "#{ a: 1 }",
    "\"mallet\"",
    "\"*\"",
    "|e| ",
    "|| ",
    "{ ",
    " }",
    "(",
    ")",
    ";",
    ",",
    "if true ",
    "else ",
    "loop ",
    "while state.a < 3 ",
    "for i in 0..3 ",
    "fn f(x) ",
    "f(1)",
    "e.thing",
    "e.given",
    "let x = ",
    "x",
    "x.push(x)",
    "return",
    "break",
    "throw 1",
    "try ",
    "catch (e) ",
    "1.5",
    "-1",
    "9223372036854775807",
    " * ",
    " / ",
    " % 0",
    "`${x}`",
    "x[0]",
    "x.a.b",
    "x.call()",
    "f",
    "at(1, 2, 3)",
    "print(x)",
    "switch x { 1 => 2, _ => 3 }",
    "//",
    "/*",
    "*/",
    "\n",
    "'",
    "\\",
    "x.map(|y| y)",
    "x.sort(|a, b| 1)",
    "x.reduce(|a, b| a + b)",
    "x.sub_string(3)",
    "x.pad(5, 'a')",
    "this",
    "is_def_fn(\"f\", 1)",
    "x.drain(0..9)",
    "x.splice(1..2, [3])",
    "x.extract(-1)",
    "0..9",
    "x[-1]",
    "x[1..3]",
    "\u{1F3DB}",
    "type_of(x)",
    "x ?? 1",
    "x?.a",
    "!",
];

fn script() -> impl Strategy<Value = String> {
    let examples: Vec<&'static str> = words().map(|word| word.example).collect();
    let piece = prop_oneof![
        3 => prop::sample::select(PIECES.to_vec()).prop_map(str::to_owned),
        2 => prop::sample::select(examples).prop_map(|example| format!("{example}\n")),
    ];
    let mutated = (
        prop::collection::vec(piece, 1..12),
        prop::collection::vec((any::<prop::sample::Index>(), 0..3_u8, any::<char>()), 0..4),
    );
    mutated.prop_map(|(pieces, changes)| {
        let mut letters: Vec<char> = pieces.concat().chars().collect();
        for (at, what, letter) in changes {
            if letters.is_empty() {
                break;
            }
            let at = at.index(letters.len());
            match what {
                0 => drop(letters.remove(at)),
                1 => letters.insert(at, letter),
                _ => letters.swap(at, 0),
            }
        }
        letters.into_iter().collect()
    })
}

fn event() -> impl Strategy<Value = Event> {
    let name = prop::sample::select(vec!["mallet", "zeus/face", "workshop", "guide", "gold", "", "*"]).prop_map(str::to_owned);
    (name, 0..9_u8, any::<f32>()).prop_map(|(name, kind, number)| match kind {
        0 => Event::Entered { region: name },
        1 => Event::LookedAt { thing: name },
        2 => Event::LookedAway { thing: name },
        3 => Event::Grabbed { thing: name, hand: Hand::Left },
        4 => Event::Released { thing: name, hand: Hand::Right, place: [number; 3] },
        5 => Event::Struck { target: name.clone(), tool: name, speed: number, place: [number; 3] },
        6 => Event::Applied { target: name.clone(), material: name.clone(), tool: name },
        7 => Event::Ended { what: name },
        _ => touched(&name),
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn whatever_is_written_is_compiled_run_or_told(text in script(), events in prop::collection::vec(event(), 0..6), times in prop::collection::vec(any::<f64>(), 4)) {
        let (program, told) = Program::compile(&[Source::new("a.rhai", text)], &names());
        prop_assert!(program.is_sound() || !told.is_empty());
        for told in &told {
            prop_assert!(!told.message.is_empty());
        }
        let limits = Limits { start_operations: 5_000, handler_operations: 5_000, ..Limits::deterministic() };
        let mut runtime = Runtime::new(program, Memory::default(), limits, 1);
        let mut world = world();
        for time in times {
            for event in &events {
                runtime.event(event.clone());
            }
            world.set_hour_s(time.abs() % 86_400.0);
            runtime.step(time.abs() % 1000.0, &world);
        }
        let sound = runtime.with_memory(|memory| memory.validate());
        prop_assert!(sound);
    }
}

/// More with `HELIODON_SCRIPTS=20000`.
fn cases() -> u32 {
    std::env::var("HELIODON_SCRIPTS").ok().and_then(|text| text.parse().ok()).unwrap_or(500)
}
