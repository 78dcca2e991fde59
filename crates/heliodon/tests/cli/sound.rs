//! Sounds that are made, and sound files.

use crate::{done, json, run};
use std::fs;

#[test]
fn sounds_are_made_the_same_each_time_and_can_be_inspected() {
    let home = tempfile::tempdir().unwrap();
    for (kind, channels) in [("chisel", 1), ("wind", 2), ("steps-earth", 1)] {
        let path = home.path().join(format!("{kind}.wav"));
        let made = json(&[&"sound", &kind, &"--seed", &"5", &"--seconds", &"2", &"-o", &path]);
        assert_eq!(
            (made["channels"].as_u64(), made["seed"].as_u64(), made["rate_hz"].as_u64()),
            (Some(channels), Some(5), Some(48_000))
        );
        let bytes = fs::read(&path).unwrap();
        // it replaces itself
        done(&[&"sound", &kind, &"--seed", &"5", &"--seconds", &"2", &"-o", &path]);
        assert_eq!(fs::read(&path).unwrap(), bytes, "{kind}");
        let told = json(&[&"sound", &"inspect", &path]);
        assert_eq!((told["seconds"].as_f64(), told["damaged"].as_u64()), (Some(2.0), Some(0)));
        assert!((told["peak_db"].as_f64().unwrap() - made["peak_db"].as_f64().unwrap()).abs() < 0.05, "{told}");
    }
    let told = done(&[&"sound", &"fire", &"--seconds", &"2", &"-o", &home.path().join("fire.wav")]).out;
    assert!(told.contains("2.00 s") && told.contains("without a seam") && told.contains("fire.wav"), "{told}");
}

#[test]
fn what_cannot_be_is_refused() {
    let home = tempfile::tempdir().unwrap();
    let path = home.path().join("theirs.wav");
    fs::write(&path, b"RIFF, or so it says").unwrap();
    let refused = run(&[&"sound", &"fire", &"-o", &path]);
    assert!(refused.code == 1 && refused.err.contains("not made here"), "{}", refused.err);
    let refused = run(&[&"sound", &"inspect", &path]);
    assert!(refused.code == 1 && refused.err.contains("theirs.wav"), "{}", refused.err);
    for (wrong, word) in [
        (vec!["sound", "fanfare", "-o", "x.wav"], "chisel"),
        (vec!["sound", "fire"], "-o fire.wav"),
        (vec!["sound", "fire", "-o", "fire.mp3"], ".wav"),
        (vec!["sound", "fire", "--seconds", "1", "-o", "fire.wav"], "seconds"),
        (vec!["sound", "fire", "other.wav", "-o", "fire.wav"], "inspect"),
        (vec!["sound", "inspect"], "name"),
    ] {
        let arguments: Vec<&dyn AsRef<std::ffi::OsStr>> =
            wrong.iter().map(|word| word as &dyn AsRef<std::ffi::OsStr>).collect();
        let ran = run(&arguments);
        assert!(ran.code == 2 && ran.err.contains(word), "{wrong:?}: {}", ran.err);
    }
}
