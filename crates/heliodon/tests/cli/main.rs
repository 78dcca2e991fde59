//! The program as its users meet it: every test here runs the real binary.
#![expect(clippy::unwrap_used, reason = "helpers of tests: a test that cannot go on has failed")]

mod bad_input;
mod commands;
mod convert;
mod detail;
mod figures;
mod first_site;
mod impostor;
mod key;
mod lamps;
mod lightmap;
mod lightmap_probes;
mod looks;
mod means;
#[cfg(feature = "viewer")]
mod panorama;
mod photo;
mod pictures;
#[cfg(feature = "viewer")]
mod play;
mod prepared;
mod rebake;
mod resume;
#[cfg(feature = "viewer")]
mod rooms;
mod scripts;
mod shards;
mod sites;
mod skies;
#[cfg(target_os = "linux")]
mod slurm;
mod sound;
mod visibility;
mod workshop;

use serde_json::Value;
use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Output};

/// The program, quiet by default so that what it says on standard error is about the result.
fn heliodon(arguments: &[&dyn AsRef<OsStr>]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_heliodon"));
    command.args(arguments.iter().map(|argument| argument.as_ref()));
    command
}

/// What came of a run.
struct Ran {
    code: i32,
    out: String,
    err: String,
}

fn run(arguments: &[&dyn AsRef<OsStr>]) -> Ran {
    ran(heliodon(arguments).output().expect("the program starts"))
}

fn ran(output: Output) -> Ran {
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("the program writes UTF-8");
    let ran = Ran { code: output.status.code().unwrap_or(-1), out: text(output.stdout), err: text(output.stderr) };
    assert!(!ran.err.contains("bug in heliodon") && !ran.err.contains("panicked"), "{}", ran.err);
    ran
}

/// A run that must succeed.
fn done(arguments: &[&dyn AsRef<OsStr>]) -> Ran {
    let ran = run(arguments);
    assert_eq!(ran.code, 0, "{}", ran.err);
    ran
}

/// A run that must succeed, with its one JSON object.
fn json(arguments: &[&dyn AsRef<OsStr>]) -> Value {
    let mut all: Vec<&dyn AsRef<OsStr>> = arguments.to_vec();
    all.push(&"--json");
    let ran = done(&all);
    let value: Value = serde_json::from_str(&ran.out).unwrap_or_else(|error| panic!("{error}: {}", ran.out));
    assert!(value.is_object(), "one JSON object, not {value}");
    value
}

/// Shape and numbers of a NumPy file of little-endian f32.
fn read_npy_f32(path: &Path) -> (Vec<usize>, Vec<f32>) {
    let bytes = std::fs::read(path).unwrap();
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let header_end = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let header = std::str::from_utf8(&bytes[10..header_end]).unwrap();
    assert!(header.contains("'<f4'") && header.contains("'fortran_order': False"), "{header}");
    let shape = header.split("'shape': (").nth(1).unwrap().split(')').next().unwrap();
    let shape = shape.split(',').filter_map(|number| number.trim().parse().ok()).collect();
    let numbers = bytes[header_end..].chunks_exact(4).map(|number| f32::from_le_bytes(number.try_into().unwrap())).collect();
    (shape, numbers)
}

/// Names and bytes of all files below a folder, in order.
fn contents(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(&next).unwrap().map(|entry| entry.unwrap().path()) {
            if entry.is_dir() {
                folders.push(entry);
            } else {
                let name = entry.strip_prefix(folder).unwrap().to_string_lossy().into_owned();
                files.push((name, std::fs::read(&entry).unwrap()));
            }
        }
    }
    files.sort();
    files
}

/// Whether two bundles hold the same bytes; says which file differs.
fn assert_same_bundle(a: &Path, b: &Path) {
    let (a, b) = (contents(a), contents(b));
    let names = |files: &[(String, Vec<u8>)]| files.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&a), names(&b));
    for ((name, a), (_, b)) in a.iter().zip(&b) {
        assert!(a == b, "{name} differs");
    }
}
