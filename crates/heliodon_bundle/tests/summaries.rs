//! What people are told of a bundle and a site.

mod common;

use common::{RGB, write};
use heliodon_bundle::inspect::{BundleSummary, SiteSummary};
use heliodon_bundle::site::Site;
use heliodon_bundle::{BundleReader, WriterOptions};

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
