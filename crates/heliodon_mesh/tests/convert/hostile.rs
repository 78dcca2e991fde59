//! Whatever a file holds: a model that is read back, or an error that says what to do.

use super::{PACKED, flag, read_back};
use heliodon_mesh::convert::{ConvertParams, convert};
use heliodon_mesh::export::write_glb;
use heliodon_mesh::import::ImportReport;
use heliodon_testkit::hostile::files::{self, File};
use proptest::prelude::*;
use std::path::Path;

/// Whether it was converted.
fn try_it(path: &Path) -> bool {
    match convert(path, &PACKED, &mut ImportReport::default()) {
        Ok(converted) => {
            let mut report = ImportReport::default();
            let options = heliodon_mesh::import::ImportOptions::default();
            let format = heliodon_mesh::import::Format::Gltf;
            let back = heliodon_mesh::motion::from_bytes(&converted.bytes, format, path, &options, &mut report);
            // what a broken animation or skin makes impossible was so before
            if let Ok(back) = back {
                back.validate().unwrap();
            }
            true
        }
        Err(error) => {
            assert!(!error.problem().is_empty() && !error.remedy().is_empty());
            assert!(error.to_string().starts_with(&path.display().to_string()), "{error}");
            false
        }
    }
}

#[test]
fn every_hostile_file_ends_in_a_model_or_in_words() {
    let folder = tempfile::tempdir().unwrap();
    for File { ending, bytes, .. } in files::all() {
        let path = folder.path().join(format!("hostile.{ending}"));
        std::fs::write(&path, &bytes).unwrap();
        try_it(&path);
    }
}

#[test]
fn cut_off_files_end_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flag.glb");
    write_glb(&path, &flag()).unwrap();
    let whole = std::fs::read(&path).unwrap();
    for length in (0..whole.len()).step_by(37) {
        std::fs::write(&path, &whole[..length]).unwrap();
        assert!(!try_it(&path), "{length} of {}", whole.len());
    }
}

#[test]
fn extensions_that_point_into_buffers_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("it.gltf");
    let triangle = "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    let document = |node: &str| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0{node}}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
            "bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"byteLength":36,"uri":"{triangle}"}}]}}"#
        )
    };
    std::fs::write(&path, document(r#","extensions":{"KHR_lights_punctual":{"light":0}},"extras":{"indices":[1]}"#)).unwrap();
    let converted = convert(&path, &ConvertParams::default(), &mut ImportReport::default()).unwrap();
    assert_eq!(super::document(&converted)["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"], 0);
    assert_eq!(read_back(&converted).rest().triangles.len(), 1);
    std::fs::write(&path, document(r#","extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":0}}}"#)).unwrap();
    let error = convert(&path, &ConvertParams::default(), &mut ImportReport::default()).unwrap_err().to_string();
    assert!(error.contains("nodes[0].extensions: has EXT_mesh_gpu_instancing"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]
    #[test]
    fn changed_bytes_do_not_panic(at in 0.0_f64..1.0, value: u8, more in 0.0_f64..1.0) {
        let mut bytes = Vec::new();
        heliodon_mesh::export::glb(&mut bytes, &flag()).unwrap();
        for at in [at, more] {
            let at = (at * bytes.len() as f64) as usize;
            bytes[at] = value;
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("it.glb");
        std::fs::write(&path, &bytes).unwrap();
        try_it(&path);
    }
}
