//! What is found before anything runs, with line, column and remedy.

use crate::common::{lines, names};
use heliodon_script::diagnostic::Severity;
use heliodon_script::names::Names;
use heliodon_script::program::{Program, Source};

fn told_of(text: &str) -> String {
    lines(&Program::compile(&[Source::new("a.rhai", text)], &names()).1)
}

/// Exactly one thing is told, and it begins so.
#[track_caller]
fn tells(text: &str, begins: &str) {
    let told = told_of(text);
    assert!(told.lines().count() == 1 && told.starts_with(begins), "{text}\n{told}");
}

#[test]
fn unknown_names_are_told_with_what_was_meant() {
    tells("\n  when_touch(\"malet\", || {});", "a.rhai:2:14: there is no thing, part or actor `malet`; did you mean `mallet`?");
    tells(
        "when_touch(\"*\", |e| material(\"zeus/face\", \"ivry\"));",
        "a.rhai:1:43: there is no material `ivry`; did you mean `ivory`?",
    );
    tells("subtitle(\"welcom\");", "a.rhai:1:10: there is no text `welcom`; did you mean `welcome`?");
    tells(
        "play_film(\"mallet\");",
        "a.rhai:1:11: there is no film `mallet`; `mallet` is the name of something else here: thing",
    );
    tells("play_film(\"*\");", "a.rhai:1:11: there is no film `*`");
    tells(
        "move_to(\"mallet\", \"bnech\");",
        "a.rhai:1:19: there is no thing, part, actor, region or view `bnech`; did you mean `bench`?",
    );
    tells("const TOOL = \"malet\";\nwhen_grab(TOOL, || {});", "a.rhai:2:11: there is no thing `malet`");
    assert_eq!(told_of("const TOOL = \"mallet\";\nwhen_grab(TOOL, || {});\nfn f(TOOL) { show(TOOL) }\n"), "");
    assert_eq!(told_of("for part in [\"zeus/face\"] { show(part); }"), "", "what is not written out is found when it runs");
}

#[test]
fn without_a_site_names_are_not_checked() {
    let source = Source::new("a.rhai", "when_touch(\"anything\", || subtitle(\"whatever\"));");
    assert!(Program::compile(std::slice::from_ref(&source), &Names::unchecked()).1.is_empty());
    assert_eq!(Program::compile(&[source], &Names::none()).1.len(), 2);
}

#[test]
fn arguments_that_cannot_be_meant_are_told() {
    tells("after(\"2\", || {});", "a.rhai:1:7: `seconds` of after is a text; give a number from 0 to 86400");
    tells("fade(\"mallet\", 2);", "a.rhai:1:16: `opacity` of fade is 2; give a number from 0 to 1");
    tells("when_hour(\"25:00\", || {});", "a.rhai:1:11: `hour` of when_hour is `25:00`; give an hour");
    tells("give(\"mallet\", \"lft\");", "a.rhai:1:16: `hand` of give is `lft`; did you mean `left`?");
    tells("when_enter(\"yard\", subtitle);", "a.rhai:1:20: there is no variable `subtitle`");
    tells("when_enter(\"yard\", \"welcome\");", "a.rhai:1:20: `handler` of when_enter is a text; give what is done then");
    tells("when_enter(\"yard\");", "a.rhai:1:1: when_enter is given 1 argument; write when_enter(region, handler, [given])");
    tells("subtitle();", "a.rhai:1:1: subtitle is given 0 arguments; write subtitle(text, [seconds], [values])");
    tells("when_enter(\"yard\", |a, b| {});", "a.rhai:1:20: the handler of when_enter takes more than one argument");
    tells("highlight(\"mallet\", 1);", "a.rhai:1:21: `on` of highlight is the number 1; give true or false");
    tells("remember(\"\", 1);", "a.rhai:1:10: `name` of remember is empty");
}

#[test]
fn unknown_functions_variables_and_fields_are_told() {
    tells("subtitel(\"welcome\");", "a.rhai:1:1: there is no function `subtitel`; did you mean `subtitle`?");
    tells("fn open() { turn(\"door\", 90); }\nopne();", "a.rhai:2:1: there is no function `opne`; did you mean `open`?");
    tells("fn open(a) {}\nopen();", "a.rhai:2:1: open is given 0 arguments; give it 1");
    tells(
        "let f = |x| x;\nf(1);",
        "a.rhai:2:1: `f` is a variable, not a function; if a function was put into it, write f.call()",
    );
    tells("[1].push(1, 2, 3);", "a.rhai:1:5: push is given 4 arguments");
    tells(
        "state.a = 1;\nwhen_enter(\"yard\", || print(stat.a));",
        "a.rhai:2:29: there is no variable `stat`; did you mean `state`?",
    );
    tells(
        "when_touch(\"mallet\", |e| print(e.thng));",
        "a.rhai:1:34: the event of when_touch has no `thng`; did you mean `e.thing`?",
    );
    tells("when_struck(\"*\", \"*\", |e| print(e.place.x + e.sped));", "a.rhai:1:47: the event of when_struck has no `sped`");
    tells("let n = 0;\nwhen_enter(\"yard\", || { n += 1; });", "a.rhai:2:25: `n` cannot be changed here");
    tells("let l = [];\nwhen_enter(\"yard\", || { l[0] = 1; });", "a.rhai:2:25: `l` cannot be changed here");
    tells("let state = 1;", "a.rhai:1:5: `state` is there already");
    let outer = "fn later(part) { after(1, || material(part, \"gold\")); }";
    tells(outer, "a.rhai:1:39: `part` is not known here: a function sees what it is given");
    assert!(told_of(outer).contains("hand it over as the last argument and read e.given"));
    assert_eq!(
        told_of("let n = 1; fn f(x) { let y = x; for i in 0..3 { y += i + n; } try { y } catch (error) { print(error); } }"),
        ""
    );
}

#[test]
fn what_does_not_parse_is_told_in_plain_english() {
    tells("when_enter(\"yard\", || {", "a.rhai:1:");
    tells("when_enter(\"yard\" || {});", "a.rhai:1:");
    tells("let x = ;", "a.rhai:1:9: ");
    tells("let x = \"abc", "a.rhai:1:");
    for word in ["eval(\"1\")", "Fn(\"f\")", "f.curry(1)", "import \"secrets\" as s", "export x"] {
        let told = told_of(&format!("let f = 1; {word};"));
        let name = word.trim_start_matches("f.").split(['(', ' ']).next().unwrap();
        assert!(told.contains(&format!("`{name}` cannot be used in a site's scripts")), "{word}: {told}");
    }
    let deep = format!("let x = {}1{};", "(".repeat(200), ")".repeat(200));
    assert!(told_of(&deep).contains("too many expressions stand in one another"), "{}", told_of(&deep));
}

#[test]
fn what_only_all_scripts_show_is_a_warning() {
    let guide = Source::new("guide.rhai", "when_message(\"guide\", \"come\", |e| {});\nif recall(\"has-malet\") {}");
    let yard =
        Source::new("yard.rhai", "send(\"guide\", \"cmoe\");\nremember(\"has-mallet\", true);\nsend(\"guide\", \"come\");");
    let (program, told) = Program::compile(&[guide, yard], &names());
    assert!(program.is_sound() && told.iter().all(|told| told.severity == Severity::Warning));
    let told = lines(&told);
    assert!(told.contains("guide.rhai:2:11: warning: no script remembers `has-malet`; did you mean `has-mallet`?"), "{told}");
    assert!(
        told.contains("yard.rhai:1:6: warning: no script waits for the message `cmoe` to `guide`; did you mean `come`?"),
        "{told}"
    );
    assert_eq!(told.lines().count(), 2);
}

#[test]
fn a_script_with_errors_is_left_out_and_the_others_are_there() {
    let sources = [
        Source::new("good.rhai", "subtitle(\"welcome\");"),
        Source::new("bad.rhai", "subtitel(\"welcome\");"),
        Source::new("good.rhai", ""),
        Source::new("long.rhai", " ".repeat(300 * 1024)),
    ];
    let (program, told) = Program::compile(&sources, &names());
    assert!(!program.is_sound());
    assert_eq!(program.script_names().collect::<Vec<_>>(), ["good.rhai"]);
    let told = lines(&told);
    assert!(told.contains("another script has the same name") && told.contains("more than 256 KiB"), "{told}");
}
