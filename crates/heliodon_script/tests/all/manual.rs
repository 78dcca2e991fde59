//! The manual's examples compile and run.

use crate::common;
use crate::common::Stage;
use heliodon_script::manual::manual;
use heliodon_script::names::{Kind, Names};
use heliodon_script::program::{Program, Source};
use heliodon_script::vocabulary::words;

#[test]
fn every_example_compiles_and_runs() {
    for word in words() {
        let name = format!("{}.rhai", word.name);
        let mut stage = Stage::new(&[(&name, word.example)]);
        stage.step();
        assert_eq!(stage.told(), "", "{}", word.name);
    }
}

#[test]
fn the_scripts_of_the_beginning_compile() {
    let manual = manual();
    let beginning = manual.split("\n## What happens").next().unwrap();
    let names = common::names().with(Kind::Text, ["about-face", "about-robe"]);
    let mut count = 0;
    for block in beginning.split("```rhai\n").skip(1) {
        let text = block.split("```").next().unwrap();
        let (program, told) = Program::compile(&[Source::new("manual.rhai", text)], &names);
        assert!(program.is_sound() && told.is_empty(), "{text}\n{}", common::lines(&told));
        count += 1;
    }
    assert!(count >= 2);
}

#[test]
fn every_word_that_is_registered_is_in_the_table_and_the_manual() {
    // what a script can call is found by asking for it: a name that the table lacks is refused before it runs
    let refused = |text: &str| !Program::compile(&[Source::new("a.rhai", text)], &Names::unchecked()).0.is_sound();
    for word in words() {
        let arguments = vec!["\"*\""; word.required].join(", ");
        let known = !refused(&format!("fn f() {{ is_def_fn(\"{0}\", {1}); }}", word.name, word.required));
        assert!(known && manual().contains(&word.signature()), "{}({arguments})", word.name);
    }
    assert!(refused("sleep(10);") && refused("exit();") && refused("timestamp();") && refused("open_file(\"x\");"));
}
