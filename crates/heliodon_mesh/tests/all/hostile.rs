//! Every importer through the hostile corpus: no panic, a valid mesh or an error that says what to do.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

use heliodon_mesh::albedo::MeshAlbedo;
use heliodon_mesh::import::{Format, ImportError, ImportOptions, ImportReport, Place, from_bytes, read_reporting};
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

/// A binary PLY of a triangle for each of `data`'s faces, whose header says what it likes.
fn counted(vertices: u64, faces: u64, held: usize) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    bytes.extend([0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()));
    for _ in 0..held {
        bytes.push(3);
        bytes.extend([0_i32, 1, 2].iter().flat_map(|i| i.to_le_bytes()));
    }
    bytes
}

#[test]
fn faces_that_are_cut_off_are_told_before_they_are_read() {
    // a gigabyte of faces would be read for minutes before its end is met
    let error = read(&counted(3, 1000, 999), "ply").unwrap_err();
    assert_eq!(error.place(), &Place::File);
    assert!(error.problem().contains("promises 1000 rows of \"face\""), "{error}");
    assert_eq!(read(&counted(3, 1000, 1000), "ply").unwrap().triangles.len(), 1000);
}

#[test]
fn headers_that_count_too_few_rows_are_told() {
    let warnings = |bytes: &[u8]| {
        let mut report = ImportReport::default();
        let name = Path::new("few.ply");
        from_bytes(bytes, Format::Ply, name, &ImportOptions::default(), &mut report).unwrap();
        report.warnings.concat()
    };
    assert!(warnings(&counted(3, 1, 5)).contains("few.ply: 52 bytes behind its last row are not read"));
    let mut ended = counted(3, 5, 5);
    ended.extend(b"\r\n");
    assert_eq!(warnings(&ended), "");
    let text = |faces: u32, rows: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             element face {faces}\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n{rows}"
        )
    };
    assert!(warnings(text(1, "3 0 1 2\n3 2 1 0\n").as_bytes()).contains("bytes behind its last row"));
    assert_eq!(warnings(text(2, "3 0 1 2\n3 2 1 0\n\n").as_bytes()), "");
    // too few vertices: what follows them is read as faces, and is none
    let error = read(&counted(2, 1, 1), "ply").unwrap_err().to_string();
    assert!(error.contains("counts are wrong"), "{error}");
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
