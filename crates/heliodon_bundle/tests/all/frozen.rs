//! Bundles of released format versions, frozen: they are read as they were meant, and the writer still makes the same bytes.
//!
//! `tests/frozen/v1` was written by `cargo test -p heliodon_bundle --test all frozen:: -- --ignored`. It changes only before its
//! format version is released; afterwards a change of the format needs a new version and a new folder.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use crate::common;
use crate::common::{lapse, meta, texture_png};
use glam::Vec3;
use heliodon_bundle::manifest::Manifest;
use heliodon_bundle::moment::{Blend, Day};
use heliodon_bundle::shade::vertex_light;
use heliodon_bundle::site::{Detail, DetailPattern};
use heliodon_bundle::{BundleReader, BundleWriter, LightLayout, WriterOptions};
use heliodon_image::detail::DetailTexture;
use std::fs;
use std::path::{Path, PathBuf};

const LAYOUT: LightLayout = LightLayout { sun_steps: 34, coefficients: 4, channels: 3, sun_bounce_functions: 2 };
const FILES: [&str; 6] = ["lapse.json", "manifest.json", "site-1.glb", "site.glb", "sky/0000.hdr", "sky/0001.hdr"];

fn frozen() -> PathBuf {
    PathBuf::from("tests/frozen/v1")
}

/// Two chunks in two files, the second textured; numbers that are exact in every representation.
fn write(target: &Path) {
    let mut writer = BundleWriter::create_with(target, meta(LAYOUT), WriterOptions { max_glb_bytes: 1 }).unwrap();
    let texture = writer.add_texture("ground.png", &fixed_png()).unwrap();
    for (part, texture) in [(0, None), (1, Some(texture))] {
        let mut chunk = common::chunk(LAYOUT, part, texture, 2, f32::from(part));
        for (i, position) in chunk.positions.iter_mut().enumerate() {
            *position = Vec3::new(f32::from(part) + (i / 2) as f32 * 0.5, 0.25, (i % 2) as f32 * 0.5);
        }
        chunk.normals.fill(Vec3::Y);
        chunk.light.sun_mask.iter_mut().enumerate().for_each(|(i, w)| *w = if i % 2 == 0 { 0x8000_0001 + i as u32 } else { 2 });
        chunk.light.sky_transfer.iter_mut().enumerate().for_each(|(i, t)| *t = i as f32 / 64.0);
        chunk.light.sun_bounce.iter_mut().enumerate().for_each(|(i, b)| *b = 0.5 - i as f32 / 32.0);
        writer.push_chunk(&chunk).unwrap();
    }
    for i in 0..2 {
        writer.add_sky_map(&format!("sky/{i:04}.hdr"), HDR).unwrap();
    }
    let mut lapse = lapse(LAYOUT);
    lapse.steps.truncate(4);
    for (i, step) in lapse.steps.iter_mut().enumerate() {
        step.sky = vec![[1.0 + i as f32, 0.5, 0.25]; 4];
        step.mask_bit = [0, 0, 31, 33][i];
        if let Some(sun) = &mut step.sun {
            sun.direction = [0.0, 1.0, 0.0];
            sun.irradiance = [8.0, 4.0, 2.0];
        }
    }
    writer.finish(&lapse).unwrap();
}

/// A Radiance file of one pixel.
const HDR: &[u8] = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x80\x80\x81";

/// The texture's bytes as they were at the time: an encoder may come to make others.
fn fixed_png() -> Vec<u8> {
    match BundleReader::open(frozen()) {
        Ok(reader) => reader.texture_bytes(0).unwrap(),
        Err(_) => texture_png(),
    }
}

#[test]
fn version_1_is_read() {
    let reader = BundleReader::open(frozen()).unwrap();
    reader.verify().unwrap();
    let manifest = reader.manifest();
    assert_eq!((manifest.version, manifest.light, manifest.offset_m), (1, LAYOUT, 0.001));
    assert_eq!((manifest.counts.vertices, manifest.counts.triangles, manifest.counts.invalid_vertices), (8, 4, 1));
    assert_eq!(manifest.site.latitude_deg, Some(37.9715));
    assert_eq!(manifest.rooms[0].max, [1.0, 2.0, 5.0]);
    assert_eq!(manifest.parts[1].name, "ground");

    let second = reader.read_chunk(1).unwrap();
    assert_eq!((second.part, second.texture), (1, Some(0)));
    assert_eq!(second.positions[3], Vec3::new(1.5, 0.25, 0.5));
    assert_eq!(second.triangles, [[0, 1, 2], [1, 3, 2]]);
    assert_eq!(reader.read_chunk(0).unwrap().valid, [1, 1, 1, 0]);
    assert_eq!(reader.texture_image(0).unwrap().pixel(0, 0), [200, 100, 50, 255]);
    let light = &second.light;
    assert_eq!(light.sun_mask[..4], [0x8000_0001, 2, 0x8000_0003, 2]);
    assert_eq!((light.sky_transfer[13], light.sun_bounce[7]), (13.0 / 64.0, 0.5 - 7.0 / 32.0));
    assert!(light.sun_reaches(1, 0) && light.sun_reaches(1, 1) && light.sun_reaches(1, 31) && light.sun_reaches(1, 33));
    assert!(!light.sun_reaches(1, 2) && !light.sun_reaches(1, 32));

    // sun 8/pi; sky (0 + 3 + 6 + 9) / 64 for the first channel, by 2 at the second entry; bounce 8 max(0, b0 f0 + b1 f1)
    let moment = Day::new(reader.lapse()).at(7.0 * 3600.0 + 7.0 * 60.0, Blend::Hard);
    let shaded = vertex_light(&moment, light, 0, Vec3::Y);
    assert!((shaded.sun.x - 8.0 / std::f32::consts::PI).abs() < 1e-6);
    assert!((shaded.sky.x - 2.0 * 18.0 / 64.0).abs() < 1e-6, "{}", shaded.sky);
    let functions = &reader.lapse().sun_bounce_basis.as_ref().unwrap().functions;
    let bounced = 0.5 * functions[0][0] + (0.5 - 3.0 / 32.0) * functions[1][0];
    assert!((shaded.bounce.x - 8.0 * bounced.max(0.0)).abs() < 1e-6);
}

#[test]
fn version_1_is_written_byte_for_byte() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("v1");
    write(&target);
    for name in FILES {
        assert!(fs::read(target.join(name)).unwrap() == fs::read(frozen().join(name)).unwrap(), "{name} differs");
    }
}

/// Version 2 is version 1 with a light grid and actors.
const MOVING: LightLayout = LightLayout { sun_steps: 34, coefficients: 4, channels: 1, sun_bounce_functions: 2 };

#[test]
fn version_2_is_read_and_written_byte_for_byte() {
    let frozen = PathBuf::from("tests/frozen/v2");
    let reader = BundleReader::open(&frozen).unwrap();
    reader.verify().unwrap();
    let [walker] = reader.actors() else { panic!("{:?}", reader.actors()) };
    assert_eq!((walker.file.as_str(), walker.animation.as_deref()), ("actors/walker/walker.glb", Some("walk")));
    assert_eq!(walker.path, Some(vec![[0.0, 0.0, 3.0], [2.0, 0.5, 3.0]]));
    assert_eq!(*reader.read_grid().unwrap().unwrap().points(), common::grid(MOVING));
    let folder = tempfile::tempdir().unwrap();
    let manifest = common::write_moving(&folder.path().join("v2"), MOVING, &folder.path().join("files"));
    assert_eq!((manifest.version, &manifest), (2, reader.manifest()));
    for name in manifest.files.iter().map(|file| file.path.as_str()).chain(["manifest.json"]) {
        assert!(
            fs::read(folder.path().join("v2").join(name)).unwrap() == fs::read(frozen.join(name)).unwrap(),
            "{name} differs"
        );
    }
}

/// Version 3 is version 2 with light and weathering in texels, and mattes; version 4 is that with details.
const TEXEL: LightLayout = LightLayout { sun_steps: 34, coefficients: 4, channels: 3, sun_bounce_functions: 2 };

#[test]
fn versions_3_and_4_are_read_and_written_byte_for_byte() {
    for version in [3, 4] {
        let frozen = PathBuf::from(format!("tests/frozen/v{version}"));
        let reader = BundleReader::open(&frozen).unwrap();
        reader.verify().unwrap();
        assert_eq!(reader.manifest().version, version);
        assert_eq!(reader.read_texels().unwrap().unwrap(), common::texel_light(TEXEL));
        assert_eq!(reader.read_texel_weathering().unwrap().unwrap(), common::texel_weathering());
        assert_eq!(reader.read_chunk(0).unwrap().texel_uvs, common::lit_by_texels(TEXEL).texel_uvs);
        let manifest = reader.manifest();
        assert_eq!((manifest.parameters.bake.texels, manifest.mattes[0].corners[2]), (Some(8), [1.0, 2.0, 1.0]));
        assert_eq!(manifest.parameters.weathering.as_ref().map(|weathering| weathering.dust), Some(0.5));
        // the pattern as it was at the time: generators may come to make others
        let detail = manifest.parts[1].detail.as_ref().map(|detail| reader.read_detail(detail).unwrap());
        assert_eq!(detail.is_some(), version == 4);
        let folder = tempfile::tempdir().unwrap();
        let written = common::write_texels(&folder.path().join("again"), TEXEL, detail.as_ref());
        // and so may packers: numbers count, not how they are packed
        let is_packed = |name: &str| name.ends_with(".ktx2") || name.ends_with(".png");
        let unpacked = |manifest: &Manifest| {
            let files = manifest.files.iter().filter(|file| !is_packed(&file.path)).cloned().collect();
            Manifest { files, ..manifest.clone() }
        };
        assert_eq!(unpacked(&written), unpacked(manifest), "version {version}");
        for name in unpacked(&written).files.iter().map(|file| &file.path) {
            assert!(
                fs::read(folder.path().join("again").join(name)).unwrap() == fs::read(frozen.join(name)).unwrap(),
                "{name} of version {version} differs"
            );
        }
    }
}

#[test]
#[ignore = "writes tests/frozen/v3 and v4 anew; only before these versions are released"]
fn freeze_versions_3_and_4() {
    common::write_texels(Path::new("tests/frozen/v3"), TEXEL, None);
    let stone = Detail { texels: Some(64), ..Detail::of_kind(DetailPattern::Stone) };
    let stone = DetailTexture::generate(&stone.generated().unwrap()).unwrap();
    common::write_texels(Path::new("tests/frozen/v4"), TEXEL, Some(&stone));
}

#[test]
#[ignore = "writes tests/frozen/v2 anew; only before the version is released"]
fn freeze_version_2() {
    let folder = tempfile::tempdir().unwrap();
    common::write_moving(Path::new("tests/frozen/v2"), MOVING, folder.path());
}

#[test]
#[ignore = "writes tests/frozen/v1 anew; only before the version is released"]
fn freeze() {
    write(&frozen());
}
