//! Scripts as their authors check them.

use crate::{done, run};
use serde_json::Value;

#[test]
fn the_manual_is_printed() {
    let manual = done(&[&"script", &"manual"]).out;
    assert!(manual.starts_with("# Scripts of a site") && manual.contains("\n### when_struck\n"), "{manual}");
}

#[test]
fn scripts_are_checked_with_their_texts() {
    let folder = tempfile::tempdir().unwrap();
    let (script, texts) = (folder.path().join("yard.rhai"), folder.path().join("texts.toml"));
    std::fs::write(&texts, "languages = [\"en\"]\n[texts.welcome]\nen = \"Welcome\"\n").unwrap();
    std::fs::write(&script, "when_enter(\"yard\", || subtitle(\"welcome\"));\n").unwrap();
    let checked = [&"script" as &dyn AsRef<std::ffi::OsStr>, &"check", &script, &"--texts", &texts];
    assert!(done(&checked).out.contains("Nothing is wrong."));

    std::fs::write(&script, "when_enter(\"yard\", ||\n  subtitle(\"welcom\"));\n").unwrap();
    let wrong = run(&checked);
    assert_eq!(wrong.code, 1);
    assert!(wrong.err.contains("yard.rhai:2:12: there is no text `welcom`; did you mean `welcome`?"), "{}", wrong.err);
    let told = run(&[&"script", &"check", &script, &"--texts", &texts, &"--json"]);
    assert_eq!(told.code, 1);
    let value: Value = serde_json::from_str(&told.out).unwrap();
    assert_eq!(value["told"][0]["place"][0], 2, "{value}");

    let missing = run(&[&"script", &"check", &folder.path().join("no.rhai")]);
    assert!(missing.code == 1 && missing.err.contains("no.rhai cannot be read"), "{}", missing.err);
}
