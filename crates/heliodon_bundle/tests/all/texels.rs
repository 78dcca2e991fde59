//! Light in texels goes into a bundle and comes out of it.

use crate::common::{MONO, TEXELS, chunk, lapse, lit_by_texels, meta, texel_light, write_texels};
use heliodon_bundle::layout::{MOVING_FORMAT_VERSION, STILL_FORMAT_VERSION, TEXEL_FORMAT_VERSION};
use heliodon_bundle::site::{Lamp, Matte};
use heliodon_bundle::{BundleMeta, BundleReader, BundleWriter, LightLayout};
use heliodon_image::ktx2::Ktx2;

#[test]
fn light_in_texels_reads_back() {
    for layout in [MONO, LightLayout { sun_steps: 130, coefficients: 9, channels: 3, sun_bounce_functions: 5 }] {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("bundle");
        let mut writer = BundleWriter::create(&target, meta(layout)).unwrap();
        assert!(writer.push_chunk(&lit_by_texels(layout)).unwrap_err().to_string().contains("none were added"));
        writer.add_texels(&texel_light(layout), TEXELS).unwrap();
        assert!(writer.add_texels(&texel_light(layout), TEXELS).unwrap_err().to_string().contains("already"));
        writer.push_chunk(&lit_by_texels(layout)).unwrap();
        writer.push_chunk(&chunk(layout, 1, None, 4, 0.0)).unwrap();
        for path in ["sky/0000.hdr", "sky/0001.hdr"] {
            writer.add_sky_map(path, b"unread").unwrap();
        }
        let manifest = writer.finish(&lapse(layout)).unwrap();
        assert_eq!((manifest.version, manifest.texels.as_ref()), (TEXEL_FORMAT_VERSION, Some(&TEXELS)));
        let reader = BundleReader::open(&target).unwrap();
        assert_eq!(reader.read_texels().unwrap().unwrap(), texel_light(layout));
        assert_eq!(reader.read_chunk(0).unwrap().texel_uvs, lit_by_texels(layout).texel_uvs);
        assert!(reader.read_chunk(1).unwrap().texel_uvs.is_empty());
        reader.verify().unwrap();

        let path = target.join("texels/sky.ktx2");
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 9]).unwrap();
        assert!(BundleReader::open(&target).unwrap().read_texels().unwrap_err().to_string().contains("sky.ktx2"));
    }
}

#[test]
fn textures_of_another_layout_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = BundleWriter::create(folder.path().join("bundle"), meta(MONO)).unwrap();
    let other = texel_light(LightLayout { coefficients: 9, ..MONO });
    assert!(writer.add_texels(&other, TEXELS).unwrap_err().to_string().contains("sky is"));
    let mut chunk = lit_by_texels(MONO);
    chunk.texel_uvs[3].x = 1.5;
    assert!(writer.push_chunk(&chunk).unwrap_err().to_string().contains("atlas"));
}

#[test]
fn a_key_of_a_later_version_makes_the_bundle_one_of_that_version() {
    let version = |change: &dyn Fn(&mut BundleMeta)| {
        let folder = tempfile::tempdir().unwrap();
        let mut meta = meta(MONO);
        change(&mut meta);
        let mut writer = BundleWriter::create(folder.path().join("bundle"), meta).unwrap();
        writer.push_chunk(&chunk(MONO, 0, None, 4, 0.0)).unwrap();
        for path in ["sky/0000.hdr", "sky/0001.hdr"] {
            writer.add_sky_map(path, b"unread").unwrap();
        }
        let manifest = writer.finish(&lapse(MONO)).unwrap();
        assert_eq!(BundleReader::open(folder.path().join("bundle")).unwrap().manifest(), &manifest);
        manifest.version
    };
    assert_eq!(version(&|_| ()), STILL_FORMAT_VERSION);
    assert_eq!(version(&|meta| meta.lamps.push(Lamp::at([0.0; 3], [1.0; 3]))), MOVING_FORMAT_VERSION);
    let triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    assert_eq!(version(&|meta| meta.mattes.push(Matte::new(triangle))), TEXEL_FORMAT_VERSION);
    assert_eq!(version(&|meta| meta.parameters.bake.texels = Some(128)), TEXEL_FORMAT_VERSION);
    assert_eq!(version(&|meta| meta.parameters.weathering = Some(Default::default())), TEXEL_FORMAT_VERSION);
}

#[test]
fn textures_that_the_manifest_does_not_tell_of_are_not_unpacked() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    write_texels(&target, MONO, None);
    let read = || BundleReader::open(&target).and_then(|reader| reader.read_texels().map(|_| reader.read_texel_weathering()));
    read().unwrap().unwrap();
    // well formed, and a hundred times as large
    let path = target.join("texels/sun.ktx2");
    let sun = Ktx2 { width: 80, height: 80, levels: vec![vec![0; 80 * 80 * 4]], ..texel_light(MONO).sun };
    let before = std::fs::read(&path).unwrap();
    std::fs::write(&path, sun.to_bytes("sun").unwrap()).unwrap();
    let error = read().unwrap_err().to_string();
    assert!(error.contains("80 x 80") && error.contains("8 x 8") && error.contains("sun.ktx2"), "{error}");
    std::fs::write(&path, before).unwrap();
    let weathering = target.join("texels/weathering.ktx2");
    std::fs::write(&weathering, sun.to_bytes("sun").unwrap()).unwrap();
    assert!(read().unwrap().unwrap_err().to_string().contains("Rgba8Srgb of 4 x 4"));

    let manifest = target.join("manifest.json");
    let text = std::fs::read_to_string(&manifest).unwrap();
    for (from, to, word) in [
        ("\"path\": \"texels/sky.ktx2\"", "\"path\": \"texels/sky.png\"", "`texels/sky.ktx2` is not among its files"),
        ("\"path\": \"texels/bounce.ktx2\"", "\"path\": \"bounce.ktx2\"", "`texels/bounce.ktx2` is not among its files"),
        ("\"width\": 8", "\"width\": 10", "sides are multiples of 4"),
    ] {
        assert!(text.contains(from), "{from}");
        std::fs::write(&manifest, text.replacen(from, to, 1)).unwrap();
        let error = BundleReader::open(&target).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
}
