//! The scan itself goes into a bundle's folder as a bundle and comes out of it; one that is not what the manifest says is named.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use crate::common::{MONO, RGB, chunk, chunks, lapse, meta};
use glam::Vec3;
use heliodon_bundle::inspect::BundleSummary;
use heliodon_bundle::layout::{SCAN_FOLDER, SCAN_FORMAT_VERSION};
use heliodon_bundle::manifest::Manifest;
use heliodon_bundle::site::Prepare;
use heliodon_bundle::{BundleReader, BundleWriter, LightLayout, LitChunk, ReadError};
use std::path::Path;

/// More of both parts, in a colour that 16 bits hold as it is.
fn finer(layout: LightLayout) -> Vec<LitChunk> {
    let white = |chunk: LitChunk| LitChunk { albedo: vec![Vec3::ONE; chunk.vertex_count()], ..chunk };
    vec![white(chunk(layout, 0, None, 40, 0.0)), white(chunk(layout, 1, None, 25, -1.0))]
}

/// A writer with all but the scan.
fn begin(target: &Path, layout: LightLayout) -> BundleWriter {
    let mut writer = BundleWriter::create(target, meta(layout)).unwrap();
    chunks(layout, None).iter().for_each(|chunk| writer.push_chunk(chunk).unwrap());
    for name in ["sky/0000.hdr", "sky/0001.hdr"] {
        writer.add_sky_map(name, name.as_bytes()).unwrap();
    }
    writer
}

fn write(target: &Path, layout: LightLayout) -> Manifest {
    let mut writer = begin(target, layout);
    let mut scan = writer.begin_scan(meta(layout)).unwrap();
    finer(layout).iter().for_each(|chunk| scan.push_chunk(chunk).unwrap());
    writer.end_scan(scan, &lapse(layout)).unwrap();
    writer.finish(&lapse(layout)).unwrap()
}

#[test]
fn a_scan_reads_back() {
    for layout in [MONO, RGB] {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("bundle");
        let manifest = write(&target, layout);
        let reader = BundleReader::open(&target).unwrap();
        assert_eq!((reader.manifest(), manifest.version), (&manifest, SCAN_FORMAT_VERSION));
        let scan = reader.scan().unwrap().unwrap();
        assert_eq!(Some(scan.manifest().counts), manifest.scan);
        assert_eq!((scan.lapse(), scan.manifest().light), (reader.lapse(), layout));
        let read: Vec<LitChunk> = (0..scan.chunk_count()).map(|chunk| scan.read_chunk(chunk).unwrap()).collect();
        assert_eq!(read, finer(layout));
        assert_eq!(std::fs::read(scan.sky_map_path(1)).unwrap(), b"sky/0001.hdr");
        assert!(scan.scan().unwrap().is_none());
        scan.verify().unwrap();
        reader.verify().unwrap();
        let left: Vec<_> = std::fs::read_dir(&target).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert!(left.iter().all(|name| !name.to_string_lossy().starts_with('.')), "{left:?}");
        let told = BundleSummary::of(&reader).to_string();
        assert!(told.contains("the scan itself in scan/, for eyes at rest: 126 triangles, 130 vertices, 2 chunks"), "{told}");
        // and it can be replaced, by one without
        begin(&target, layout).finish(&lapse(layout)).unwrap();
        let without = BundleReader::open(&target).unwrap();
        assert!(without.scan().unwrap().is_none() && !target.join(SCAN_FOLDER).exists());
        assert_eq!(without.manifest().version, 1);
    }
}

#[test]
fn a_site_that_asks_for_one_makes_the_version_that_has_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = begin(&folder.path().join("bundle"), MONO);
    writer.meta_mut().parameters.prepare = Some(Prepare { scan: true, panorama: 64, ..Prepare::default() });
    assert_eq!(writer.finish(&lapse(MONO)).unwrap().version, SCAN_FORMAT_VERSION);
    let text = |prepare: &Prepare| serde_json::to_string(prepare).unwrap();
    assert!(
        !text(&Prepare::default()).contains("scan") && text(&Prepare { scan: true, ..Prepare::default() }).contains("scan")
    );
}

#[test]
fn every_byte_of_it_is_verified() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    let manifest = write(&target, MONO);
    let own: Vec<&str> =
        manifest.files.iter().map(|file| file.path.as_str()).filter(|path| path.starts_with("scan/")).collect();
    assert_eq!(own, ["scan/lapse.json", "scan/manifest.json", "scan/site.glb", "scan/sky/0000.hdr", "scan/sky/0001.hdr"]);
    let reader = BundleReader::open(&target).unwrap();
    for path in own {
        let path = target.join(path);
        let before = std::fs::read(&path).unwrap();
        let mut bytes = before.clone();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        // what is shared with the bundle around it is not to change with it
        std::fs::remove_file(&path).unwrap();
        std::fs::write(&path, bytes).unwrap();
        assert!(matches!(reader.verify(), Err(ReadError::Changed { path: found }) if found == path));
        std::fs::write(&path, before).unwrap();
    }
    reader.verify().unwrap();
}

#[test]
fn what_does_not_fit_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = begin(&folder.path().join("bundle"), MONO);
    let unfit = |writer: &BundleWriter, change: &dyn Fn(&mut heliodon_bundle::BundleMeta)| {
        let mut meta = meta(MONO);
        change(&mut meta);
        writer.begin_scan(meta).err().unwrap().to_string()
    };
    assert!(unfit(&writer, &|meta| meta.light = RGB).contains("other parts or another light"));
    assert!(unfit(&writer, &|meta| meta.parts.truncate(1)).contains("other parts or another light"));
    let empty = writer.begin_scan(meta(MONO)).unwrap();
    assert!(writer.end_scan(empty, &lapse(MONO)).unwrap_err().to_string().contains("holds no triangles"));
    let another = begin(&folder.path().join("another"), MONO);
    let of_another = another.begin_scan(meta(MONO)).unwrap();
    assert!(writer.end_scan(of_another, &lapse(MONO)).unwrap_err().to_string().contains("another bundle"));
    let mut scan = writer.begin_scan(meta(MONO)).unwrap();
    finer(MONO).iter().for_each(|chunk| scan.push_chunk(chunk).unwrap());
    writer.end_scan(scan, &lapse(MONO)).unwrap();
    assert!(unfit(&writer, &|_| ()).contains("already"));
    writer.finish(&lapse(MONO)).unwrap();
}

#[test]
fn a_manifest_that_says_something_else_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    let manifest = write(&target, MONO);
    let vertices = manifest.scan.unwrap().vertices;
    let read = || BundleReader::open(&target).and_then(|reader| reader.scan().map(|_| ())).unwrap_err().to_string();
    let changed = |file: &str, from: &str, to: &str, word: &str| {
        let path = target.join(file);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{from}");
        std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
        let error = read();
        assert!(error.contains(word), "{error}");
        std::fs::write(&path, text).unwrap();
    };
    changed("manifest.json", "\"version\": 8", "\"version\": 7", "version 7 has no scan");
    changed("manifest.json", "\"scan/manifest.json\"", "\"scan/manifest\"", "`scan/manifest.json` is not among its files");
    changed("manifest.json", &format!("\"vertices\": {vertices}"), "\"vertices\": 7", "counts are not");
    changed("scan/manifest.json", "\"name\": \"ground\"", "\"name\": \"floor\"", "parts are not");
    changed("scan/lapse.json", "\"exposure_stops\": -1.0", "\"exposure_stops\": 1.0", "day is not");
    std::fs::remove_file(target.join("scan/manifest.json")).unwrap();
    assert!(read().contains("not a bundle"));
}
