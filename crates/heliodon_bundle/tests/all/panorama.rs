//! A panorama goes into a bundle and comes out of it; one that is not what the manifest says is named.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use crate::common::{MONO, chunk, lapse, meta};
use heliodon_bundle::layout::PANORAMA_FORMAT_VERSION;
use heliodon_bundle::panorama::{albedo_texture, size_of, surface_texture};
use heliodon_bundle::site::Prepare;
use heliodon_bundle::texels::{TEXEL_LEVELS, float_texture, sky_level, sun_texture};
use heliodon_bundle::{BundleReader, BundleWriter, LightLayout, Panorama, PanoramaInfo, TexelLight};
use heliodon_image::ktx2::Ktx2;
use std::path::Path;

const INFO: PanoramaInfo = PanoramaInfo { side: 64, middle: [1.0, 1.5, -2.0], texels: 17 };
const RGB: LightLayout = LightLayout { sun_steps: 40, coefficients: 4, channels: 3, sun_bounce_functions: 2 };
const FILES: [&str; 5] = ["sun", "sky", "bounce", "surface", "albedo"];

fn panorama(layout: LightLayout, side: u32) -> Panorama {
    let size = size_of(side);
    let texels = |level: u32| ((size[0] >> level) * (size[1] >> level)) as usize;
    let numbers = |from: u32, width: usize| -> Vec<Vec<f32>> {
        (from..TEXEL_LEVELS).map(|level| (0..texels(level) * width).map(|i| (i % 997) as f32 / 512.0).collect()).collect()
    };
    let masks: Vec<Vec<u32>> =
        (0..TEXEL_LEVELS).map(|level| (0..texels(level) * layout.mask_words()).map(|i| i as u32).collect()).collect();
    let (above, floats, bounced) = (sky_level(layout.channels), layout.transfer_floats(), layout.bounce_floats());
    let albedo: Vec<Vec<[f32; 4]>> = (0..TEXEL_LEVELS).map(|level| vec![[0.25, 0.5, 0.75, 1.0]; texels(level)]).collect();
    Panorama {
        light: TexelLight {
            sun: sun_texture(layout, size, &masks),
            sky: float_texture(size.map(|side| side >> above), floats, &numbers(above, floats)),
            bounce: (bounced > 0).then(|| float_texture(size.map(|side| side / 4), bounced, &numbers(2, bounced))),
        },
        surface: surface_texture(size, &numbers(0, 4)),
        albedo: albedo_texture(size, &albedo),
    }
}

fn write(target: &Path, layout: LightLayout) {
    let mut meta = meta(layout);
    meta.parameters.prepare = Some(Prepare { panorama: INFO.side, ..Prepare::default() });
    let mut writer = BundleWriter::create(target, meta).unwrap();
    writer.add_panorama(&panorama(layout, INFO.side), INFO).unwrap();
    assert!(writer.add_panorama(&panorama(layout, INFO.side), INFO).unwrap_err().to_string().contains("already"));
    writer.push_chunk(&chunk(layout, 0, None, 4, 0.0)).unwrap();
    for path in ["sky/0000.hdr", "sky/0001.hdr"] {
        writer.add_sky_map(path, b"unread").unwrap();
    }
    assert_eq!(writer.finish(&lapse(layout)).unwrap().version, PANORAMA_FORMAT_VERSION);
}

#[test]
fn a_panorama_reads_back() {
    for layout in [MONO, RGB] {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("bundle");
        write(&target, layout);
        let reader = BundleReader::open(&target).unwrap();
        assert_eq!(reader.manifest().panorama, Some(INFO));
        assert_eq!(reader.read_panorama().unwrap().unwrap(), panorama(layout, INFO.side));
        assert!(reader.read_texels().unwrap().is_none());
        reader.verify().unwrap();
    }
}

#[test]
fn what_does_not_fit_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = BundleWriter::create(folder.path().join("bundle"), meta(MONO)).unwrap();
    let mut fault = |panorama: Panorama, info: PanoramaInfo| writer.add_panorama(&panorama, info).unwrap_err().to_string();
    assert!(fault(panorama(MONO, 80), INFO).contains("sun is R32Uint of 240 x 160"));
    assert!(fault(panorama(LightLayout { coefficients: 9, ..MONO }, 64), INFO).contains("sky is"));
    assert!(fault(panorama(MONO, 64), PanoramaInfo { side: 72, ..INFO }).contains("multiples of 16"));
    assert!(fault(panorama(MONO, 64), PanoramaInfo { middle: [0.0, f32::NAN, 0.0], ..INFO }).contains("nowhere"));
    let broken = panorama(MONO, 64);
    let surface = surface_texture(size_of(64), &[64_usize, 32, 16].map(|side| vec![f32::NAN; 6 * side * side * 4]));
    assert!(fault(Panorama { surface, ..broken }, INFO).contains("not finite"));
}

#[test]
fn files_that_are_cut_off_missing_or_of_another_size_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    write(&target, RGB);
    let read = || BundleReader::open(&target).and_then(|reader| reader.read_panorama()).unwrap_err().to_string();
    let sizes = panorama(RGB, 80);
    let other: [&Ktx2; 5] =
        [&sizes.light.sun, &sizes.light.sky, sizes.light.bounce.as_ref().unwrap(), &sizes.surface, &sizes.albedo];
    for (name, other) in FILES.into_iter().zip(other) {
        let file = format!("{name}.ktx2");
        let path = target.join("panorama").join(&file);
        let before = std::fs::read(&path).unwrap();
        std::fs::write(&path, &before[..before.len() - 9]).unwrap();
        assert!(read().contains(&file), "{}", read());
        // well formed, of another panorama
        std::fs::write(&path, other.to_bytes(name).unwrap()).unwrap();
        let error = read();
        assert!(error.contains(&file) && error.contains(" not ") && error.contains("texels"), "{error}");
        std::fs::write(&path, before).unwrap();
    }
    let manifest = target.join("manifest.json");
    let text = std::fs::read_to_string(&manifest).unwrap();
    for (from, to, word) in [
        ("\"path\": \"panorama/surface.ktx2\"", "\"path\": \"surface.ktx2\"", "`panorama/surface.ktx2` is not among its files"),
        ("\"path\": \"panorama/bounce.ktx2\"", "\"path\": \"bounce.ktx2\"", "`panorama/bounce.ktx2` is not among its files"),
        ("\"side\": 64", "\"side\": 72", "multiples of 16"),
        ("\"side\": 64", "\"side\": 4294967280", "multiples of 16"),
        ("\"version\": 7", "\"version\": 6", "version 6 has no panorama"),
    ] {
        assert!(text.contains(from), "{from}");
        std::fs::write(&manifest, text.replacen(from, to, 1)).unwrap();
        let error = BundleReader::open(&target).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
}
