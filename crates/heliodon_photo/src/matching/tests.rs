//! Matching with a program that stands in for COLMAP; the real one is run by `tests/all/colmap.rs`.
#![cfg(unix)]

use super::*;
use crate::camera::Intrinsics;
use crate::solve::bundle::Free;
use crate::solve::{Focal, LensGroup, Photo};
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;

/// A project in a folder with a name that programs stumble over, and a program in it.
struct Stand {
    _temporary: tempfile::TempDir,
    folder: PathBuf,
    program: PathBuf,
    files: Vec<String>,
    problem: Problem,
}

impl Stand {
    /// Photographs `a.jpg` to `c.jpg` and a shell script with the cases of its first argument, the step.
    fn new(cases: &str) -> Self {
        let temporary = tempfile::tempdir().unwrap();
        let folder = temporary.path().join("Été au château, \"1\"");
        std::fs::create_dir_all(folder.join("côté nord")).unwrap();
        let files: Vec<String> = ["a.jpg", "côté nord/b 1.jpg", "c.jpg"].map(str::to_owned).into();
        for file in &files {
            std::fs::write(folder.join(file), b"").unwrap();
        }
        let program = folder.join("stand-in");
        // The last argument of `out` is the folder that a model goes to; a model is its photographs' names.
        let script = format!(
            r#"#!/bin/sh
step="$1"
all="$*"
while [ $# -gt 0 ]; do
  case "$1" in
    --output_path) out="$2" ;;
    --snapshot_path|--Mapper.snapshot_path) snapshots="$2" ;;
    --image_list_path) list="$2" ;;
    --database_path) database="$2" ;;
  esac
  shift
done
model() {{
  mkdir -p "$1"; folder="$1"; shift
  printf '1 PINHOLE 640 480 500 500 320 240\n' > "$folder/cameras.txt"
  : > "$folder/images.txt"
  number=0
  for name in "$@"; do
    number=$((number + 1))
    printf '%d 1 0 0 0 %d 0 0 1 %s\n\n' $number $number "$name" >> "$folder/images.txt"
  done
}}
case "$step" in
{cases}
esac
"#
        );
        std::fs::write(&program, script).unwrap();
        std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
        let lens = LensGroup {
            name: "lens".to_owned(),
            intrinsics: Intrinsics::pinhole(640, 480, 640.0),
            focal: Focal::Guess(500.0),
            free: Free { radial: 1, ..Free::default() },
        };
        let photos = files.iter().map(|name| Photo { name: name.clone(), lens: 0, pose: None }).collect();
        let problem = Problem { lenses: vec![lens], photos, ..Problem::default() };
        Self { _temporary: temporary, folder, program, files, problem }
    }

    fn run(&self) -> Result<Matched, MatchError> {
        self.run_by(self.program.as_os_str())
    }

    fn run_by(&self, program: &OsStr) -> Result<Matched, MatchError> {
        let request = Request { program, folder: &self.folder, files: &self.files, problem: &self.problem };
        run(&request, &mut |_| {})
    }

    fn log(&self, step: &str) -> String {
        std::fs::read_to_string(self.folder.join(COLMAP_FOLDER).join(format!("{step}.log"))).unwrap()
    }
}

/// What COLMAP says of photographs that it takes.
const EXTRACTS: &str = r#"feature_extractor)
    : > "$database"
    while read -r name; do
      printf 'Processed file [1/3]\n  Name:            %s\n  Camera:          #1 - SIMPLE_RADIAL\n  Features:        900\n' "$name"
    done < "$list" ;;"#;

fn names(matched: &Matched) -> Vec<&str> {
    matched.cameras.cameras.iter().map(|c| c.name.as_str()).collect()
}

#[test]
fn what_colmap_writes_is_read_back() {
    // As a version without a GPU fails on one.
    let stand = Stand::new(
        r#"feature_extractor|exhaustive_matcher)
    case "$all" in *use_gpu\ 1*) echo "F1 opengl.cc:5] Check failed: context"; exit 134 ;; esac ;;
  mapper) model "$out/0" a.jpg; model "$out/1" "côté nord/b 1.jpg" c.jpg ;;"#,
    );
    let matched = stand.run().unwrap();
    assert_eq!((matched.model.as_str(), matched.models), ("colmap/refined", 2));
    assert_eq!(names(&matched), ["côté nord/b 1.jpg", "c.jpg"]);
    // The adjusted model is COLMAP's own format again.
    let written = crate::formats::colmap::read(&stand.folder.join(&matched.model)).unwrap();
    assert_eq!(written.cameras.len(), 2);
    assert_eq!(written.cameras[0].name, "côté nord/b 1.jpg");
    let [left] = &matched.left_out[..] else { panic!("{:?}", matched.left_out) };
    assert_eq!(left.photo, "a.jpg");
    // The focal length that EXIF told, and a model with k1 and k2.
    let log = stand.log("feature_extractor");
    assert!(log.contains("--ImageReader.camera_model RADIAL --ImageReader.camera_params 500,320,240,0,0"), "{log}");
}

#[test]
fn photographs_left_out_are_told_with_a_reason_each() {
    let stand = Stand::new(&format!(
        r#"{EXTRACTS}
  mapper) model "$out/0" a.jpg c.jpg
    printf 'Registering image #2 (3)\n\n  => Image sees 12 / 300 points\n  => Could not register\n' ;;"#
    ));
    let why = |stand: &Stand| stand.run().unwrap().left_out[0].why.clone();
    assert!(why(&stand).contains("seems to show 12 points"), "{}", why(&stand));
    let elsewhere = Stand::new(&format!(
        r#"{EXTRACTS}
  mapper) model "$out/0" c.jpg "côté nord/b 1.jpg" ; model "$out/1" a.jpg d.jpg ;;"#
    ));
    assert!(why(&elsewhere).contains("fits together with d.jpg, but not with the rest"), "{}", why(&elsewhere));
    let broken = Stand::new(
        r#"feature_extractor)
    printf '  Name:            a.jpg\n  ERROR: Failed to read image file format.\n' ;;
  mapper) model "$out/0" c.jpg "côté nord/b 1.jpg" ;;"#,
    );
    assert!(why(&broken).contains("Failed to read image file format"), "{}", why(&broken));
    let alone = Stand::new(&format!(
        r#"{EXTRACTS}
  mapper) model "$out/0" c.jpg "côté nord/b 1.jpg" ;;"#
    ));
    assert!(why(&alone).contains("shares nothing with the others"), "{}", why(&alone));
}

#[test]
fn what_a_run_complains_of_is_no_photographs_fault() {
    let log = "$ colmap feature_extractor\n  Name: a.jpg\n  Camera: #1 - RADIAL\n  Features: 43\n$ colmap feature_extractor\n\
               ERROR: Failed to parse options\n";
    let [photo] = &extracted(log)[..] else { panic!() };
    assert_eq!((photo.camera, photo.features, &photo.error), (Some(1), 43, &None));
}

#[test]
fn what_a_colmap_that_fails_half_way_has_made_is_kept() {
    // The matcher dies after some pairs, the mapper in its second model; a third was being written.
    let stand = Stand::new(&format!(
        r#"{EXTRACTS}
  exhaustive_matcher) echo "matched 2 of 3 pairs"; kill -9 $$ ;;
  mapper) model "$out/0" a.jpg c.jpg
    mkdir -p "$out/1"; printf 'x' > "$out/1/cameras.bin"
    echo "F1 incremental.cc:9] Check failed: out of memory"; exit 134 ;;"#
    ));
    let matched = stand.run().unwrap();
    assert_eq!(names(&matched), ["a.jpg", "c.jpg"]);
    let notes = matched.notes.join("\n");
    for words in [
        "exhaustive_matcher failed (signal: 9",
        "what had been matched by then was used",
        "out of memory",
        "a model was left out",
    ] {
        assert!(notes.contains(words), "{words}: {notes}");
    }
    // Not even one model was finished, but there is a picture of the first.
    let snapshot = Stand::new(&format!(
        r#"{EXTRACTS}
  mapper) model "$snapshots/0001" a.jpg c.jpg; model "$snapshots/0002" a.jpg c.jpg "côté nord/b 1.jpg"; exit 1 ;;"#
    ));
    let matched = snapshot.run().unwrap();
    assert_eq!(matched.cameras.cameras.len(), 3);
    assert!(matched.notes.join("\n").contains("what it had mapped by then was taken"), "{:?}", matched.notes);
    // Where there is nothing, the step that failed is what is told, with its log.
    let nothing =
        Stand::new(&format!("{EXTRACTS}\n  exhaustive_matcher) echo 'no space left'; exit 1 ;;\n  mapper) exit 0 ;;"));
    let error = nothing.run().unwrap_err().to_string();
    assert!(error.contains("colmap exhaustive_matcher failed: no space left"), "{error}");
    let crashed = Stand::new(&format!("{EXTRACTS}\n  mapper) echo 'F1 a.cc:1] Check failed: b'; exit 134 ;;"));
    let error = crashed.run().unwrap_err().to_string();
    assert!(error.contains("colmap mapper failed: Check failed: b"), "{error}");
}

#[test]
fn features_are_found_anew_only_where_photographs_or_lenses_changed() {
    let mut stand = Stand::new(&format!("{EXTRACTS}\n  mapper) model \"$out/0\" a.jpg c.jpg ;;"));
    let runs = |stand: &Stand| stand.log("feature_extractor").matches("$ colmap").count();
    stand.run().unwrap();
    assert!(stand.run().unwrap().notes.iter().any(|note| note.contains("last run were kept")));
    assert_eq!(runs(&stand), 1);
    stand.problem.lenses[0].focal = Focal::Known(700.0);
    assert!(!stand.run().unwrap().notes.iter().any(|note| note.contains("last run were kept")));
    assert!(stand.log("feature_extractor").contains("700,320,240"));
    std::fs::write(stand.folder.join("a.jpg"), b"another").unwrap();
    assert!(!stand.run().unwrap().notes.iter().any(|note| note.contains("last run were kept")));
}

#[test]
fn an_unknown_focal_length_is_held_at_guesses_where_the_mapper_fails() {
    let mut stand = Stand::new(&format!(
        r#"{EXTRACTS}
  mapper)
    case "$all" in
      *input_path*refine_focal_length\ 0*) model "$out" a.jpg c.jpg "côté nord/b 1.jpg" ;;
      *) echo "ERROR: failed to create sparse model"; exit 1 ;;
    esac ;;"#
    ));
    stand.problem.lenses[0].focal = Focal::Free;
    let matched = stand.run().unwrap();
    assert_eq!((matched.cameras.cameras.len(), matched.models), (3, 1));
    assert!(matched.notes.iter().any(|note| note.contains("held at guesses")), "{:?}", matched.notes);
    assert!(!stand.log("feature_extractor").contains("camera_params"));
    // A focal length that is known is not guessed at.
    stand.problem.lenses[0].focal = Focal::Known(700.0);
    let error = stand.run().unwrap_err();
    assert!(matches!(error, MatchError::Nothing(_)), "{error}");
    // All three have one reason, told once.
    assert_eq!(error.to_string().matches("shares nothing").count(), 1, "{error}");
}

#[test]
fn a_missing_colmap_is_said_with_how_to_install_it() {
    let mut stand = Stand::new("");
    let said = |stand: &Stand, program: &str| stand.run_by(OsStr::new(program)).unwrap_err().to_string();
    assert!(said(&stand, "no-such-colmap").contains("apt-get install colmap"));
    // A program that fails is told with its step and log; one that does nothing makes no model.
    assert!(said(&stand, "false").contains("colmap feature_extractor failed"));
    assert!(said(&stand, "true").contains("no two photographs"));
    stand.files[1] = "not there.jpg".to_owned();
    assert!(said(&stand, "true").contains("not there.jpg: COLMAP needs"));
}
