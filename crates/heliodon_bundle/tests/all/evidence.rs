//! What colours rest on: what `site.toml` may say of it, and its way into a bundle and out of it.

use crate::common::{MONO, chunks, lapse, meta, texture_png};
use heliodon_bundle::inspect::BundleSummary;
use heliodon_bundle::layout::EVIDENCE_FORMAT_VERSION;
use heliodon_bundle::site::{InputKind, Site};
use heliodon_bundle::{BundleReader, BundleWriter, EvidenceInfo};

fn site(part: &str) -> String {
    format!("[site]\nname = \"a\"\n[[part]]\nfile = \"a.obj\"\n{part}\n[sky]\nprobes = \"a.hdr\"\nmapping = \"angular\"\n")
}

#[test]
fn a_site_names_an_image_for_an_image() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.obj", "a.hdr", "atlas.png", "evidence.png"] {
        std::fs::write(folder.path().join(name), "x").unwrap();
    }
    let path = folder.path().join("site.toml");
    std::fs::write(&path, site("albedo = \"atlas.png\"\nevidence = \"evidence.png\"")).unwrap();
    let read = Site::read(&path).unwrap();
    assert_eq!(read.parts[0].evidence.as_deref(), Some("evidence.png"));
    let files = read.input_files().unwrap();
    assert_eq!((files[2].kind, files[2].name.as_str()), (InputKind::Evidence(0), "evidence.png"));
    assert!(files[..3].iter().all(|file| file.kind.mesh_part() == Some(0)) && files[3].kind.mesh_part().is_none());
    for (part, words) in [
        ("evidence = \"evidence.png\"", ["site.toml:5:", "the part has none"]),
        ("albedo = [0.5, 0.5, 0.5]\nevidence = \"evidence.png\"", ["site.toml:6:", "add the albedo"]),
        ("albedo = \"atlas.png\"\nevidence = \"\"", ["site.toml:6:", "evidence"]),
        ("albedo = \"atlas.png\"\nevidence = \"none.png\"", ["site.toml:6:", "there is no file `none.png`"]),
    ] {
        std::fs::write(&path, site(part)).unwrap();
        let error = Site::read(&path).and_then(|site| site.input_files()).unwrap_err().to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{part}: {error}");
    }
}

#[test]
fn evidence_reads_back_and_a_manifest_that_says_too_much_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    let mut writer = BundleWriter::create(&target, meta(MONO)).unwrap();
    let texture = writer.add_texture("ground.png", &texture_png()).unwrap();
    chunks(MONO, Some(texture)).iter().for_each(|chunk| writer.push_chunk(chunk).unwrap());
    let told = |error: Result<(), heliodon_bundle::WriteError>| error.unwrap_err().to_string();
    assert!(told(writer.add_evidence(7, [texture], EvidenceInfo { seen: 0.5 })).contains("no such part"));
    assert!(told(writer.add_evidence(1, [7], EvidenceInfo { seen: 0.5 })).contains("no texture 7"));
    assert!(told(writer.add_evidence(1, [texture], EvidenceInfo { seen: f64::NAN })).contains("a share of NaN"));
    writer.add_evidence(1, [texture], EvidenceInfo { seen: 0.75 }).unwrap();
    for path in ["sky/0000.hdr", "sky/0001.hdr"] {
        writer.add_sky_map(path, b"unread").unwrap();
    }
    let manifest = writer.finish(&lapse(MONO)).unwrap();
    assert_eq!(manifest.version, EVIDENCE_FORMAT_VERSION);
    let reader = BundleReader::open(&target).unwrap();
    assert_eq!(reader.manifest().parts[1].evidence, Some(EvidenceInfo { seen: 0.75 }));
    assert!(reader.manifest().parts[0].evidence.is_none() && reader.manifest().textures[0].evidence);
    let summary = BundleSummary::of(&reader).to_string();
    assert!(summary.contains("photographs saw 75 % of it"), "{summary}");
    drop(reader);

    let path = target.join("manifest.json");
    let text = std::fs::read_to_string(&path).unwrap();
    for (from, to, word) in
        [("\"seen\": 0.75", "\"seen\": 1.5", "a share of 1.5"), ("\"version\": 6", "\"version\": 5", "version 5 has none")]
    {
        assert!(text.contains(from), "{from}");
        std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
        let error = BundleReader::open(&target).unwrap_err().to_string();
        assert!(error.contains(word) && error.contains("the evidence of part"), "{error}");
    }
}
