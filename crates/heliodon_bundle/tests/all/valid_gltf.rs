//! Bundles and exports pass the Khronos validator.
//!
//! Needs node and npm, and a network the first time; without them it says that it skips, or fails where
//! `HELIODON_REQUIRE_GLTF_VALIDATOR` is set.

use crate::common;
use crate::common::{MONO, RGB, chunk, lapse, meta, texture_png, write};
use heliodon_bundle::export::{ExportOptions, export_lit};
use heliodon_bundle::{BundleReader, BundleWriter, LightLayout, WriterOptions};
use heliodon_testkit::gltf::validate;

#[test]
fn every_variant_passes_the_khronos_validator() {
    let folder = tempfile::tempdir().unwrap();
    let mut files = Vec::new();
    let layout = |sun_steps, coefficients, channels, sun_bounce_functions| LightLayout {
        sun_steps,
        coefficients,
        channels,
        sun_bounce_functions,
    };
    let variants = [
        (MONO, false),
        (RGB, true),
        (layout(1, 4, 3, 0), true),
        (layout(92, 9, 1, 8), false),
        (layout(300, 4, 1, 5), true),
        (layout(1024, 9, 3, 8), false),
    ];
    for (i, (layout, textured)) in variants.into_iter().enumerate() {
        for max_glb_bytes in [2 << 30, 1] {
            let target = folder.path().join(format!("{i}-{max_glb_bytes}"));
            let manifest = write(&target, layout, textured, WriterOptions { max_glb_bytes });
            files.extend(manifest.geometry.iter().map(|name| target.join(name)));
            let reader = BundleReader::open(&target).unwrap();
            let lit = folder.path().join(format!("lit-{i}-{max_glb_bytes}.glb"));
            export_lit(
                &reader,
                "06:58".parse().unwrap_or(heliodon_bundle::site::TimeOfDay::NOON),
                &ExportOptions::default(),
                &lit,
            )
            .unwrap();
            files.push(lit);
        }
    }
    // a texture that some of the chunks show in a part where others do not, tinted, and one that nothing shows
    let target = folder.path().join("tinted");
    let mut writer = BundleWriter::create(&target, meta(MONO)).unwrap();
    let texture = writer.add_texture("a", &texture_png()).unwrap();
    writer.add_texture("unused", &texture_png()).unwrap();
    let mut tinted = chunk(MONO, 0, Some(texture), 4, 0.0);
    tinted.albedo[1] = glam::Vec3::new(0.5, 1.0, 0.25);
    writer.push_chunk(&tinted).unwrap();
    writer.push_chunk(&chunk(MONO, 0, None, 4, 1.0)).unwrap();
    for path in ["sky/0000.hdr", "sky/0001.hdr"] {
        writer.add_sky_map(path, b"unread").unwrap();
    }
    writer.finish(&lapse(MONO)).unwrap();
    assert_eq!(BundleReader::open(&target).unwrap().read_chunk(0).unwrap().texture, Some(0));
    files.push(target.join("site.glb"));

    // light grids: points, no triangles
    let triangles = files.len();
    for layout in [MONO, RGB, layout(1024, 9, 3, 44)] {
        let target = folder.path().join(format!("moving-{}", layout.sun_steps));
        common::write_moving(&target, layout, folder.path());
        files.push(target.join("grid.glb"));
    }
    let Some(reports) = validate(&files) else { return };
    assert_eq!(reports.len(), files.len());
    for (i, report) in reports.iter().enumerate() {
        let count = |key: &str| report[key].as_u64().unwrap();
        assert_eq!((count("numErrors"), count("numWarnings")), (0, 0), "{report:#}");
        assert_eq!((count("numInfos"), count("numHints")), (0, 0), "{report:#}");
        assert_eq!(count("totalTriangleCount") > 0, i < triangles);
    }
    println!("{} files valid", reports.len());
}

#[test]
fn the_validator_finds_a_fault() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    write(&target, MONO, false, WriterOptions::default());
    let glb = target.join("site.glb");
    let mut bytes = std::fs::read(&glb).unwrap();
    let at = bytes.windows(16).position(|w| w == b"\"componentType\":").unwrap() + 16;
    bytes[at..at + 4].copy_from_slice(b"5120");
    std::fs::write(&glb, bytes).unwrap();
    let Some(reports) = validate(&[glb]) else { return };
    assert!(reports[0]["numErrors"].as_u64().unwrap() > 0);
}
