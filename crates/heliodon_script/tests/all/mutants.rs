//! Mutated scripts, random events: nothing panics, and whatever compiles stays within its limits.

use crate::common::*;
use heliodon_script::action::Hand;
use heliodon_script::event::Event;
use heliodon_script::limits::Limits;
use heliodon_script::memory::Memory;
use heliodon_script::program::{Program, Source};
use heliodon_script::runtime::Runtime;
use heliodon_script::vocabulary::words;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

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

fn mutant() -> impl Strategy<Value = String> {
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

/// Expressions that parse; what they are of is left to chance.
fn expression() -> impl Strategy<Value = String> {
    let leaves = [
        "1",
        "2.5",
        "-1",
        "0",
        "9223372036854775807",
        "true",
        "()",
        "\"mallet\"",
        "\"*\"",
        "'a'",
        "x",
        "y",
        "state.a",
        "[1, [2]]",
        "#{ a: 1 }",
        "at(1, 2, 3)",
        "visitor()",
        "hour()",
        "random()",
        "f",
        "|z| z",
        "0..9",
    ];
    let leaf = prop::sample::select(leaves.to_vec()).prop_map(str::to_owned);
    let operators = ["+", "-", "*", "/", "%", "**", "==", "<", "&&", "||", "??", "in", "<<", "|"];
    // with as many arguments as they have: another number is found before they run
    let methods = [
        "push(B)",
        "map(|z| z)",
        "map(B)",
        "sort()",
        "sort(B)",
        "len()",
        "pad(B, x)",
        "index_of(B)",
        "contains(B)",
        "remove(B)",
        "split(B)",
        "replace(B, x)",
        "sub_string(B)",
        "to_string()",
        "drain(B)",
        "reduce(|z, w| w)",
        "filter(B)",
        "keys()",
        "extract(B)",
        "insert(B, x)",
        "reverse()",
        "chop(B)",
        "truncate(B)",
        "abs()",
        "to_upper()",
        "dedup()",
        "append(B)",
        "set(B, x)",
        "get(B)",
        "splice(B, x, y)",
        "zip(B, |z, w| z)",
        "crop(B)",
        "call(B)",
        "floor()",
        "to_int()",
        "values()",
        "mixin(B)",
        "all(|z| z == x)",
    ];
    leaf.prop_recursive(4, 24, 3, move |inner| {
        let two = (inner.clone(), inner.clone());
        prop_oneof![
            (two.clone(), prop::sample::select(operators.to_vec())).prop_map(|((a, b), o)| format!("(f({a}) {o} f({b}))")),
            (two.clone(), prop::sample::select(methods.to_vec()))
                .prop_map(|((a, b), m)| format!("({a}).{}", m.replace('B', &b))),
            two.clone().prop_map(|(a, b)| format!("[{a}, {b}]")),
            two.clone().prop_map(|(a, b)| format!("f({a})[f({b})]")),
            two.clone().prop_map(|(a, b)| format!("if f({a}) {{ {b} }} else {{ x }}")),
            inner.clone().prop_map(|a| format!("#{{ a: {a} }}")),
            inner.clone().prop_map(|a| format!("({a}).a")),
            inner.clone().prop_map(|a| format!("`${{{a}}}`")),
            inner.clone().prop_map(|a| format!("f({a})")),
        ]
    })
}

/// Statements that stand where there are `x` and `y`.
fn statement() -> impl Strategy<Value = String> {
    let simple = (expression(), 0..16_u8).prop_map(|(e, kind)| match kind {
        0 => format!("let x = {e};"),
        1 => format!("y = {e};"),
        2 => format!("state.a = {e};"),
        3 => format!("y.push({e});"),
        4 => format!("y = {e}; send(\"a\", \"b\", y);"),
        5 => format!("y = {e}; remember(\"n\", y);"),
        6 => format!("print({e});"),
        7 => format!("throw {e};"),
        8 => format!("y = {e}; place(y);"),
        9 => format!("y = {e}; move_to(x, y, x);"),
        10 => format!("y = {e}; after(y, |e| print(e.given), x);"),
        11 => format!("y = {e}; subtitle(x, x, y);"),
        12 => format!("state[\"k\" + x] = {e};"),
        13 => format!("y = {e}; when_touch(y, |e| print(e.given), x);"),
        14 => format!("x += {e};"),
        _ => format!("y = {e}; keep(x); y[0] = x; y.a = x;"),
    });
    simple.prop_recursive(2, 8, 3, |inner| {
        (expression(), prop::collection::vec(inner, 1..3), 0..4_u8).prop_map(|(e, inner, kind)| {
            let inner = inner.join(" ");
            match kind {
                0 => format!("for i in f({e}) {{ {inner} }}"),
                1 => format!("while f({e}) {{ {inner} }}"),
                2 => format!("try {{ {inner} }} catch (error) {{ y = error; print(error); }}"),
                _ => format!("if f({e}) {{ {inner} }}"),
            }
        })
    })
}

/// A script that most likely compiles.
fn sentence() -> impl Strategy<Value = String> {
    let block = || prop::collection::vec(statement(), 1..4).prop_map(|statements| statements.join("\n"));
    (block(), block(), block()).prop_map(|(top, touched, heard)| {
        format!(
            "fn f(x) {{ x }}\nstate.a = [];\nlet x = 1;\nlet y = [];\nwhen_touch(\"*\", |e| {{ let x = e.thing; let y = [e];\n{touched} }});\n\
             when_message(\"*\", \"*\", |e| {{ let x = 1; let y = e.data;\n{heard} }});\n{top}"
        )
    })
}

fn script() -> impl Strategy<Value = String> {
    prop_oneof![mutant(), sentence()]
}

fn event() -> impl Strategy<Value = Event> {
    let name = prop::sample::select(vec!["mallet", "zeus/face", "workshop", "guide", "gold", "", "*"]).prop_map(str::to_owned);
    (name, 0..10_u8, any::<f32>()).prop_map(|(name, kind, number)| match kind {
        0 => Event::Entered { region: name },
        1 => Event::LookedAt { thing: name },
        2 => Event::LookedAway { thing: name },
        3 => Event::Grabbed { thing: name, hand: Hand::Left },
        4 => Event::Released { thing: name, hand: Hand::Right, place: [number; 3] },
        5 => Event::Struck { target: name.clone(), tool: name, speed: number, place: [number; 3] },
        6 => Event::Applied { target: name.clone(), material: name.clone(), tool: name },
        7 => Event::Hit { thing: name.clone(), on: name, speed: number, place: [number; 3] },
        8 => Event::Ended { what: name },
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
        let visit = || {
            let limits = Limits { start_operations: 5_000, handler_operations: 5_000, ..Limits::deterministic() };
            let mut runtime = Runtime::new(program.clone(), Memory::default(), limits, 1);
            let (mut world, mut actions) = (world(), Vec::new());
            for time in &times {
                for event in &events {
                    runtime.event(event.clone());
                }
                world.set_hour_s(time.abs() % 86_400.0);
                actions.extend(runtime.step(time.abs() % 1000.0, &world));
            }
            (format!("{actions:?}"), lines(&runtime.take_told()), runtime.with_memory(|memory| memory.validate()))
        };
        let (actions, told, sound) = visit();
        prop_assert_eq!((actions, told, sound), visit(), "the same visit is another");
        prop_assert!(sound);
    }
}

#[test]
fn many_of_the_mutants_run() {
    let mut runner = TestRunner::deterministic();
    let strategy = script();
    let sound = (0..500).filter(|_| {
        let text = strategy.new_tree(&mut runner).map(|tree| tree.current()).unwrap_or_default();
        Program::compile(&[Source::new("a.rhai", text)], &names()).0.is_sound()
    });
    let sound = sound.count();
    assert!(sound > 100, "{sound} of 500 compile: the others test the parser alone");
}

/// More with `HELIODON_SCRIPTS=20000`.
fn cases() -> u32 {
    std::env::var("HELIODON_SCRIPTS").ok().and_then(|text| text.parse().ok()).unwrap_or(500)
}
