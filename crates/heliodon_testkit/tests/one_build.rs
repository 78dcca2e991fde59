//! The demo and the tests share one compiled Bevy: no crate that the program is built of may get other features in the tests'
//! build, or `./x test` after `./x demo` compiles a quarter of an hour's worth of Bevy again.

use std::collections::BTreeMap;
use std::process::Command;

/// Features of each package (name and version) in the build that `selection` makes.
fn features(selection: &[&str]) -> BTreeMap<String, String> {
    let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/../../Cargo.toml");
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--prefix", "none", "--format", "{p}|{f}", "--no-dedupe", "--manifest-path", manifest])
        .args(selection)
        .output()
        .expect("cargo tree runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("cargo tree prints UTF-8");
    text.lines().filter_map(|line| line.split_once('|')).map(|(p, f)| (p.to_string(), f.to_string())).collect()
}

#[test]
fn the_tests_build_asks_for_the_programs_features() {
    let program = features(&["--package", "heliodon", "--edges", "normal,build"]);
    let tests = features(&["--workspace", "--edges", "normal,build,dev"]);
    assert!(program.keys().any(|package| package.starts_with("bevy_render ")), "the program draws with Bevy");
    let differences: Vec<String> = program
        .iter()
        .filter_map(|(package, of_program)| {
            let of_tests = tests.get(package)?;
            (of_program != of_tests).then(|| format!("{package}: [{of_program}] in the program, [{of_tests}] in the tests"))
        })
        .collect();
    assert!(differences.is_empty(), "ask for the same in crates/heliodon/Cargo.toml:\n{}", differences.join("\n"));
}
