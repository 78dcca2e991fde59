//! Every importer through the hostile corpus: no panic, a valid mesh or an error that says what to do.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

use heliodon_mesh::albedo::MeshAlbedo;
use heliodon_mesh::import::{Format, ImportError, ImportOptions, ImportReport, from_bytes, read_reporting};
use heliodon_mesh::{Mesh, chunk, export};
use heliodon_testkit::hostile::files::{self, File, Outcome};
use heliodon_testkit::hostile::meshes;
use proptest::prelude::*;
use std::path::{Path, PathBuf};

fn read(bytes: &[u8], ending: &str) -> Result<Mesh, ImportError> {
    let name = PathBuf::from(format!("hostile.{ending}"));
    let format = Format::of_name(&name).unwrap();
    let result = from_bytes(bytes, format, &name, &ImportOptions::default(), &mut ImportReport::default());
    check(&result);
    result
}

fn check(result: &Result<Mesh, ImportError>) {
    match result {
        Ok(mesh) => {
            mesh.validate().unwrap();
            assert!(!mesh.triangles.is_empty());
            assert_eq!(mesh.normals.len(), mesh.positions.len());
            let chunks = chunk::split(mesh, 100);
            assert_eq!(chunks.iter().map(|c| c.triangles.len()).sum::<usize>(), mesh.triangles.len());
            let albedo = MeshAlbedo::new(mesh, 0.1);
            assert!(
                (0..mesh.triangles.len() as u32).all(|t| albedo.mean(t).is_finite() && albedo.albedo(t, 0.2, 0.3).is_finite())
            );
        }
        Err(error) => {
            assert!(!error.problem().is_empty() && !error.remedy().is_empty());
            assert!(error.to_string().starts_with(&error.file().display().to_string()), "{error}");
        }
    }
}

#[test]
fn every_file_ends_as_it_must() {
    for File { name, ending, bytes, outcome } in files::all() {
        match (outcome, read(&bytes, ending)) {
            (Outcome::Refused, Ok(mesh)) => panic!("{name}: read as {} triangles", mesh.triangles.len()),
            (Outcome::Triangles(_), Err(error)) => panic!("{name}: {error}"),
            (Outcome::Triangles(count), Ok(mesh)) if count != usize::MAX => assert_eq!(mesh.triangles.len(), count, "{name}"),
            _ => {}
        }
    }
}

#[test]
fn errors_name_the_place() {
    for (name, place) in [
        ("PLY: a word where a number belongs", " line 11: has \"zero\""),
        ("PLY: an index too high", " face 0: names vertex 3"),
        ("OBJ: a coordinate that is no number", " line 2: \"o\" is no number"),
        ("OBJ: an index too high", " line 5: a face names vertex 5, but there are 4"),
        ("glTF: a count beyond the view", " accessors[0]: its 4 elements go beyond"),
        ("glTF: a negative offset", " line 4:"),
        ("STL: a coordinate that is no number", " line 5: has \"x\""),
    ] {
        let file = files::all().into_iter().find(|f| f.name == name).unwrap();
        let error = read(&file.bytes, file.ending).unwrap_err().to_string();
        assert!(error.contains(place), "{name}: {error}");
    }
}

#[test]
fn good_files_cut_off_anywhere_do_no_harm() {
    for File { ending, bytes, .. } in files::good() {
        for length in 0..bytes.len() {
            let _ = read(&bytes[..length], ending);
        }
    }
}

#[test]
fn hostile_meshes_pass_through_every_writer_and_reader() {
    for hostile in meshes() {
        let scene = &hostile.scene;
        let mesh = Mesh {
            positions: scene.positions.clone(),
            normals: scene.normals.clone(),
            triangles: scene.triangles.clone(),
            ..Mesh::default()
        };
        let (mut ply, mut obj) = (Vec::new(), Vec::new());
        export::ply(&mut ply, &mesh, None).unwrap();
        export::obj(&mut obj, &mesh).unwrap();
        let results = [read(&ply, "ply"), read(&obj, "obj")];
        let counts = results.each_ref().map(|r| r.as_ref().ok().map(|m| (m.positions.len(), m.triangles.len())));
        assert_eq!(counts[0], counts[1], "{}", hostile.name);
        if let Ok(read) = &results[0] {
            assert_eq!(read.positions.len(), mesh.positions.len(), "{}", hostile.name);
        }
    }
}

/// Runs `each` over all files below a folder of the shared data, and says so where there is none.
fn shared_files(folder: &str, each: &mut dyn FnMut(&Path)) {
    let root = Path::new("../../../shared/data").join(folder);
    if !root.is_dir() {
        println!("skipped: no {}", root.display());
        return;
    }
    let mut folders = vec![root];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() { folders.push(path) } else { each(&path) }
        }
    }
}

#[test]
fn shared_files_are_read_or_refused() {
    let (mut read, mut refused) = (0, 0);
    shared_files("malformed", &mut |path| {
        if Format::of_name(path).is_none() {
            return;
        }
        let result = read_reporting(path, &ImportOptions::default(), &mut ImportReport::default());
        check(&result);
        if result.is_ok() { read += 1 } else { refused += 1 }
    });
    println!("{read} read, {refused} refused");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn damaged_files_do_no_harm(
        which in any::<prop::sample::Index>(),
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0_u8..4), 1..6),
    ) {
        let good = files::good();
        let file = which.get(&good);
        let mut bytes = file.bytes.clone();
        for (place, value, how) in damage {
            if bytes.is_empty() {
                break;
            }
            let at = place.index(bytes.len());
            match how {
                0 => bytes[at] = value,
                1 => bytes[at] ^= 1 << (value % 8),
                2 => bytes.insert(at, value),
                _ => { bytes.remove(at); }
            }
        }
        let _ = read(&bytes, file.ending);
    }

    #[test]
    fn digits_changed_in_texts_do_no_harm(
        which in any::<prop::sample::Index>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), prop::sample::select(vec!["-1", "0", "7", "4294967295", "18446744073709551615", "1e39", "nan", ""])), 1..4),
    ) {
        let good = files::good();
        let file = which.get(&good);
        let mut bytes = file.bytes.clone();
        for (place, value) in changes {
            let digits: Vec<usize> = (0..bytes.len()).filter(|&i| bytes[i].is_ascii_digit()).collect();
            if digits.is_empty() {
                break;
            }
            let at = *place.get(&digits);
            bytes.splice(at..=at, value.bytes());
        }
        let _ = read(&bytes, file.ending);
    }
}
