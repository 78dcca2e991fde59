//! Lit geometry for stock viewers.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use crate::common;
use crate::common::{MONO, RGB, write};
use glam::Vec3;
use heliodon_bundle::export::{ExportError, ExportOptions, export_lit};
use heliodon_bundle::moment::{Blend, Day};
use heliodon_bundle::shade::chunk_light;
use heliodon_bundle::{BundleReader, WriterOptions};
use serde_json::Value;

/// The JSON and the buffer of a GLB.
fn open(path: &std::path::Path) -> (Value, Vec<u8>) {
    let bytes = std::fs::read(path).unwrap();
    let json = 20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    (serde_json::from_slice(&bytes[20..json]).unwrap(), bytes[json + 8..].to_vec())
}

/// COLOR_0 of a primitive.
fn colors(gltf: &Value, bin: &[u8], mesh: usize, primitive: usize) -> Vec<Vec3> {
    let accessor =
        &gltf["accessors"][gltf["meshes"][mesh]["primitives"][primitive]["attributes"]["COLOR_0"].as_u64().unwrap() as usize];
    assert_eq!((accessor["componentType"].as_u64(), accessor["normalized"].as_bool()), (Some(5123), Some(true)));
    let view = &gltf["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let (at, len) = (view["byteOffset"].as_u64().unwrap_or(0) as usize, view["byteLength"].as_u64().unwrap() as usize);
    let component = |b: &[u8]| f32::from(u16::from_le_bytes([b[0], b[1]])) / 65_535.0;
    bin[at..at + len].chunks_exact(8).map(|c| Vec3::new(component(c), component(&c[2..]), component(&c[4..]))).collect()
}

#[test]
fn colours_are_albedo_times_light_times_exposure() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    write(&target, RGB, false, WriterOptions::default());
    let reader = BundleReader::open(&target).unwrap();
    let out = folder.path().join("lit.glb");
    let time = "07:12".parse().unwrap();
    for (blend, stops) in [(Blend::Smooth, None), (Blend::Hard, Some(-3.0))] {
        let report = export_lit(&reader, time, &ExportOptions { exposure_stops: stops, blend }, &out).unwrap();
        let moment = Day::new(reader.lapse()).at(f64::from(time.seconds()), blend);
        assert_eq!((report.exposure_stops, report.lowered_stops), (stops.unwrap_or(moment.exposure_stops), 0.0));
        let (gltf, bin) = open(&out);
        assert_eq!(gltf["extensionsUsed"][0], "KHR_materials_unlit");
        assert_eq!(gltf["asset"]["extras"]["lit_at"], "07:12");
        for (i, (mesh, primitive)) in [(0, 0), (0, 1), (1, 0), (1, 1)].into_iter().enumerate() {
            let chunk = reader.read_chunk(i).unwrap();
            let light = chunk_light(&moment, &chunk);
            for ((color, light), albedo) in colors(&gltf, &bin, mesh, primitive).iter().zip(light).zip(chunk.albedo) {
                let expected = (albedo * light * report.exposure_stops.exp2()).clamp(Vec3::ZERO, Vec3::ONE);
                assert!((*color - expected).abs().max_element() < 2e-5, "{color} {expected}");
            }
        }
    }
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left.len(), 2, "no junk: {left:?}");
}

#[test]
fn textured_parts_keep_their_highlights() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    write(&target, MONO, true, WriterOptions::default());
    let reader = BundleReader::open(&target).unwrap();
    let out = folder.path().join("lit.glb");
    let options = ExportOptions { exposure_stops: Some(4.0), ..ExportOptions::default() };
    let report = export_lit(&reader, "07:12".parse().unwrap(), &options, &out).unwrap();
    assert!(report.lowered_stops > 0.0 && (report.exposure_stops + report.lowered_stops - 4.0).abs() < 1e-5);
    let (gltf, bin) = open(&out);
    let brightest = colors(&gltf, &bin, 1, 0).into_iter().map(Vec3::max_element).fold(0.0, f32::max);
    assert!((brightest - 1.0).abs() < 1e-4, "{brightest}");
    assert_eq!(gltf["images"].as_array().unwrap().len(), 1);
}

#[test]
fn a_time_without_light_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    write(&target, MONO, false, WriterOptions::default());
    let reader = BundleReader::open(&target).unwrap();
    let out = folder.path().join("lit.glb");
    let error = export_lit(&reader, "03:00".parse().unwrap(), &ExportOptions::default(), &out).unwrap_err();
    assert!(matches!(error, ExportError::OutsideOfDay { .. }));
    assert_eq!(error.to_string(), "03:00 is outside of the bundle's day; give a time from 06:57 to 08:27");
    assert!(!out.exists());
}

#[test]
fn a_folder_that_is_not_there_is_told_with_the_file_that_was_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    common::write(&target, common::MONO, true, WriterOptions::default());
    let reader = BundleReader::open(&target).unwrap();
    let out = folder.path().join("nowhere/lit.glb");
    let told = export_lit(&reader, "07:00".parse().unwrap(), &ExportOptions::default(), &out).unwrap_err().to_string();
    assert!(told.contains("nowhere/lit.glb: there is no such folder") && !told.contains("spool"), "{told}");
    std::fs::write(folder.path().join("file"), "x").unwrap();
    let told = heliodon_bundle::arrays::write_arrays(&reader, &folder.path().join("file"), false).unwrap_err().to_string();
    assert!(told.contains("a file stands where a folder is needed"), "{told}");
}
