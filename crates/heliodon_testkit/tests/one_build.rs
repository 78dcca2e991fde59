//! The demo and the tests share one compiled Bevy: no crate that the program is built of may get other features in the tests'
//! build, or `./x test` after `./x demo` compiles a quarter of an hour's worth of Bevy again.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

/// Feature sets in which each package (name and version) is compiled in the build that `selection` makes: more than one where
/// build scripts and macros use it as well.
fn features(selection: &[&str]) -> BTreeMap<String, BTreeSet<String>> {
    let manifest = "../../Cargo.toml";
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--prefix", "none", "--format", "{p}|{f}", "--manifest-path", manifest])
        .args(selection)
        .output()
        .expect("cargo tree runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("cargo tree prints UTF-8");
    let mut packages: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (package, features) in text.lines().filter_map(|line| line.split_once('|')) {
        // a star marks what the tree has shown before
        packages.entry(package.to_string()).or_default().insert(features.trim_end_matches(" (*)").to_string());
    }
    packages
}

#[test]
fn machines_that_only_bake_compile_nothing_that_draws() {
    let program = features(&["--package", "heliodon", "--no-default-features", "--edges", "normal,build"]);
    assert!(program.keys().any(|package| package.starts_with("heliodon_bake ")), "the program bakes");
    let draws = |package: &&String| ["bevy", "wgpu", "winit"].iter().any(|name| package.starts_with(name));
    assert_eq!(program.keys().filter(draws).collect::<Vec<_>>(), Vec::<&String>::new());
}

#[test]
fn the_tests_build_asks_for_the_programs_features() {
    let program = features(&["--package", "heliodon", "--edges", "normal,build"]);
    let tests = features(&["--workspace", "--edges", "normal,build,dev"]);
    assert!(program.keys().any(|package| package.starts_with("bevy_render ")), "the program draws with Bevy");
    let differences: Vec<String> = program
        .iter()
        .filter(|(package, of_program)| tests.get(*package).is_none_or(|of_tests| !of_program.is_subset(of_tests)))
        .map(|(package, of_program)| format!("{package}: {of_program:?} in the program, {:?} in the tests", tests.get(package)))
        .collect();
    assert!(differences.is_empty(), "ask for the same in crates/heliodon/Cargo.toml:\n{}", differences.join("\n"));
}
