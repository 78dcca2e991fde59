//! What single photographs saw of a part: what `site.toml` may say of it, and its way into a bundle and out of it.

use crate::common::{MONO, chunks, lapse, meta, texture_png};
use glam::Vec3;
use heliodon_bundle::inspect::BundleSummary;
use heliodon_bundle::layout::EVIDENCE_FORMAT_VERSION;
use heliodon_bundle::site::{InputKind, Site};
use heliodon_bundle::{BundleReader, BundleWriter, WriteError};
use heliodon_image::SrgbImage;
use heliodon_image::view_layers::{ViewLayer, ViewLayers, direction_code};

fn layers() -> ViewLayers {
    let layer = |color: u8, direction: Vec3| ViewLayer {
        colors: SrgbImage::filled(5, 3, [color, 90, 80, 200]),
        directions: SrgbImage::filled(5, 3, direction_code(direction)),
    };
    ViewLayers { layers: vec![layer(10, Vec3::X), layer(200, Vec3::X), layer(90, Vec3::NEG_Z)] }
}

#[test]
fn a_site_names_them_beside_an_image() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.obj", "a.hdr", "atlas.png", "views.json"] {
        std::fs::write(folder.path().join(name), "x").unwrap();
    }
    let path = folder.path().join("site.toml");
    let site = |part: &str| {
        format!("[site]\nname = \"a\"\n[[part]]\nfile = \"a.obj\"\n{part}\n[sky]\nprobes = \"a.hdr\"\nmapping = \"angular\"\n")
    };
    std::fs::write(&path, site("albedo = \"atlas.png\"\nviews = \"views.json\"")).unwrap();
    let files = Site::read(&path).unwrap().input_files().unwrap();
    assert_eq!((files[2].kind, files[2].name.as_str()), (InputKind::Views(0), "views.json"));
    for (part, words) in [
        ("views = \"views.json\"", ["site.toml:5:", "the part has none"]),
        ("albedo = \"atlas.png\"\nviews = \"\"", ["site.toml:6:", "views"]),
        ("albedo = \"atlas.png\"\nviews = \"none.json\"", ["site.toml:6:", "there is no file `none.json`"]),
    ] {
        std::fs::write(&path, site(part)).unwrap();
        let error = Site::read(&path).and_then(|site| site.input_files()).unwrap_err().to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{part}: {error}");
    }
}

#[test]
fn they_read_back_and_a_manifest_that_does_not_fit_them_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    let mut writer = BundleWriter::create(&target, meta(MONO)).unwrap();
    let texture = writer.add_texture("ground.png", &texture_png()).unwrap();
    chunks(MONO, Some(texture)).iter().for_each(|chunk| writer.push_chunk(chunk).unwrap());
    let told = |error: Result<(), WriteError>| error.unwrap_err().to_string();
    assert!(told(writer.add_views(7, &layers())).contains("no such part"));
    assert!(told(writer.add_views(1, &ViewLayers::default())).contains("0 layers"));
    writer.add_views(1, &layers()).unwrap();
    assert!(told(writer.add_views(1, &layers())).contains("some already"));
    for path in ["sky/0000.hdr", "sky/0001.hdr"] {
        writer.add_sky_map(path, b"unread").unwrap();
    }
    let manifest = writer.finish(&lapse(MONO)).unwrap();
    assert_eq!(manifest.version, EVIDENCE_FORMAT_VERSION);
    let reader = BundleReader::open(&target).unwrap();
    assert_eq!(reader.read_views(1).unwrap().unwrap(), layers());
    assert!(reader.read_views(0).unwrap().is_none());
    reader.verify().unwrap();
    // two layers look the same way, and one file says so
    let views = manifest.parts[1].views.as_ref().unwrap();
    assert_eq!(views.layers[0].directions, views.layers[1].directions);
    assert_eq!(manifest.files.iter().filter(|file| file.path.starts_with("views/")).count(), 5);
    let summary = BundleSummary::of(&reader).to_string();
    assert!(summary.contains("3 view-dependent layers of 5 x 3 texels"), "{summary}");
    drop(reader);

    let path = target.join("manifest.json");
    let text = std::fs::read_to_string(&path).unwrap();
    for (from, to, word) in [
        ("\"version\": 6", "\"version\": 5", "version 5 has none"),
        ("\"colors\": \"views/0.png\"", "\"colors\": \"views/9.png\"", "`views/9.png` is not among its files"),
    ] {
        assert!(text.contains(from), "{from}");
        std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
        let error = BundleReader::open(&target).unwrap_err().to_string();
        assert!(error.contains(word) && error.contains("the views of part"), "{error}");
    }
    std::fs::write(&path, text).unwrap();
    SrgbImage::filled(2, 2, [1; 4]).write_png(target.join("views/0.png")).unwrap();
    let error = BundleReader::open(&target).unwrap().read_views(1).unwrap_err().to_string();
    assert!(error.contains("2 x 2 texels") && error.contains("5 x 3"), "{error}");
}
