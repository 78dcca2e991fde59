//! What people are told of a bundle and a site.

use crate::common;
use crate::common::{RGB, write};
use heliodon_bundle::inspect::{BundleSummary, SiteSummary};
use heliodon_bundle::lineage::{MeasuredError, Prepared, PreparedPart, PurgeCheck};
use heliodon_bundle::site::Site;
use heliodon_bundle::{BundleReader, BundleWriter, WriterOptions};

#[test]
fn bundles_and_sites_are_summarised() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    write(&target, RGB, true, WriterOptions::default());
    let summary = BundleSummary::of(&BundleReader::open(&target).unwrap());
    let text = summary.to_string();
    for words in [
        "Sample: a bundle of format version 1, written by heliodon frozen",
        "32 triangles, 40 vertices (5 of them borrow their light), 4 chunks",
        "part column (scan): 22 triangles",
        "300 sun steps, 9 sky coefficients (rgb), 3 functions",
        "day: 06:57 to 10:47, 24 sky entries, 22 with a sun",
        "room in front",
        "geometry in site.glb, 1 texture",
    ] {
        assert!(text.contains(words), "`{words}` is not in\n{text}");
    }
    let json = serde_json::to_value(&summary).unwrap();
    assert_eq!(json["counts"]["triangles"], 32);
    for words in [
        "made by heliodon, revision frozen, of",
        "column.ply: 3 bytes, blake3 0000000000000000\n",
        "sky.mapping = \"lat-long\"",
        "bake.sun_steps = 92",
        "display.height_px = 768",
        "sun_bounce_relative_error = 0.0125",
    ] {
        assert!(text.contains(words), "`{words}` is not in\n{text}");
    }
    assert_eq!(json["lineage"]["inputs"][0]["blake3"], "00".repeat(32));

    let root = folder.path().join("site");
    std::fs::create_dir_all(root.join("sky")).unwrap();
    for name in ["column.ply", "ground.ply", "sky/0700.hdr"] {
        std::fs::write(root.join(name), "x").unwrap();
    }
    std::fs::write(root.join("site.toml"), common::site().to_toml_string()).unwrap();
    let summary = SiteSummary::of(&Site::read(&root).unwrap()).unwrap();
    let text = summary.to_string();
    assert!(
        text.contains("sky: 1 probe, lat-long") && text.contains("4 coefficients (mono), 1024 rays of each point"),
        "{text}"
    );
    assert!(text.contains("1 sun step, 1 sky entry"), "one probe stands for all times: {text}");
    assert!(text.contains("1 file (column.ply), 0.0 kB"), "{text}");
}

#[test]
fn what_became_of_the_parts_is_kept_and_told() {
    let part = |read: u64, drawn: u64| PreparedPart {
        vertices_read: read,
        triangles_read: read,
        triangles_cleaned: read - 2,
        triangles_original: 5 * read,
        triangles_drawn: drawn,
        triangles_hidden: 1,
        error_px: 1.5,
        edge_px: 7.5,
        error_m: 0.0,
        edge_m: 0.0,
        found: [("degenerate".to_owned(), 2), ("open_edges".to_owned(), 1700)].into(),
        error: Some(MeasuredError { mean_px: 0.125, p95_px: 0.5, max_px: 2.0, mean_m: 0.001, max_m: 0.25 }),
    };
    let prepared =
        Prepared { parts: vec![part(1000, 22), part(2000, 10)], purge: Some(PurgeCheck { pixels: 12_264_000, wrong: 2 }) };
    let folder = tempfile::tempdir().unwrap();
    let written = |name: &str, prepared: Prepared| {
        let target = folder.path().join(name);
        let mut meta = common::meta(common::MONO);
        meta.prepared = Some(prepared);
        let mut writer = BundleWriter::create(&target, meta).unwrap();
        writer.push_chunk(&common::chunk(common::MONO, 0, None, 4, 0.0)).unwrap();
        for i in 0..2 {
            writer.add_sky_map(&format!("sky/{i:04}.hdr"), b"x").unwrap();
        }
        writer.finish(&common::lapse(common::MONO)).unwrap();
        target
    };
    let target = written("whole", prepared.clone());
    let reader = BundleReader::open(&target).unwrap();
    assert_eq!((reader.manifest().version, reader.manifest().prepared.as_ref()), (2, Some(&prepared)));
    let text = BundleSummary::of(&reader).to_string();
    for words in [
        "simplified to 1.50 px of error and edges of 7.5 px",
        "part column: 1,000 triangles read, 998 cleaned, 5,000 that rays of light meet, 22 drawn, 1 that only reflect",
        "found by cleaning: 2 degenerate, 1,700 open edges",
        "off the original by 0.12 px in the mean, 0.50 px at the 95th percentile, 2.0 px (0.2500 m) at most",
        "2 of 12,264,000 pixels of random frames",
    ] {
        assert!(text.contains(words), "`{words}` is not in\n{text}");
    }
    // without rooms there are no pixels
    let error = MeasuredError { mean_m: 0.001, max_m: 0.25, ..MeasuredError::default() };
    let metres = PreparedPart { error_m: 0.02, edge_m: 0.3, error: Some(error), ..PreparedPart::default() };
    assert_eq!(metres.limits(), "0.0200 m of error and edges of 0.300 m");
    assert_eq!(error.to_string(), "0.0010 m in the mean, 0.2500 m at most");
    // what contradicts itself is refused
    let short = written("short", Prepared { parts: vec![part(3, 3)], ..prepared });
    assert!(BundleReader::open(&short).unwrap_err().to_string().contains("more or fewer parts"));
    let manifest = target.join("manifest.json");
    let text = std::fs::read_to_string(&manifest).unwrap();
    std::fs::write(&manifest, text.replace("\"version\": 2", "\"version\": 1")).unwrap();
    assert!(BundleReader::open(&target).unwrap_err().to_string().contains("tells nothing of preparation"));
}
