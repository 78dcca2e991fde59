//! The manifest tells every parameter, and nothing of the machine.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use crate::common::{MONO, chunks, lapse};
use heliodon_bundle::inspect::BundleSummary;
use heliodon_bundle::layout::{
    FORMAT_VERSION, MOVING_FORMAT_VERSION, PARTS_FORMAT_VERSION, SCAN_FORMAT_VERSION, STILL_FORMAT_VERSION,
};
use heliodon_bundle::site::{Part, Site, SiteFile};
use heliodon_bundle::{BundleMeta, BundleReader, BundleWriter};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::Path;

/// A site with a part of which everything is said, and one of which hardly anything is.
const SITE: &str = r#"
[site]
name = "Everything is said"
[[part]]
file = "/home/someone/scans/*.ply"
name = "temple"
role = "filling"
albedo = "../colours/marble.png"
evidence = "colours/evidence.png"
views = "colours/views.json"
unit = "mm"
up = "z"
translate = [1, 2, 3]
rotate_deg = [0, 90, 0]
scale = -2
crease_deg = 30
light = "texel"
texels = 2
weathering = false
detail = { file = "/home/someone/stone.png", strength = 0.5 }
least_px = 4
[[part]]
file = "ground.ply"
[sky]
probes = "/home/someone/sky/*.hdr"
mapping = "lat-long"
"#;

/// Writes a bundle of a site, and reads its manifest as what it is.
fn written(target: &Path, site: &str) -> Value {
    let site = Site::parse(site, "site/site.toml").unwrap();
    let mut writer = BundleWriter::create(target, BundleMeta::from_site(&site, MONO, 0.001)).unwrap();
    chunks(MONO, None).iter().for_each(|chunk| writer.push_chunk(chunk).unwrap());
    for name in ["sky/0000.hdr", "sky/0001.hdr"] {
        writer.add_sky_map(name, b"x").unwrap();
    }
    let manifest = writer.finish(&lapse(MONO)).unwrap();
    assert_eq!(*BundleReader::open(target).unwrap().manifest(), manifest);
    serde_json::from_slice(&std::fs::read(target.join("manifest.json")).unwrap()).unwrap()
}

#[test]
fn every_key_of_a_part_is_in_the_manifest() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    let manifest = written(&target, SITE);
    assert_eq!(manifest["version"], FORMAT_VERSION);
    let said = manifest["parameters"]["parts"][0].as_object().unwrap();
    let schema: Value = serde_json::from_str(&SiteFile::json_schema()).unwrap();
    let all: BTreeSet<&String> = schema["$defs"]["Part"]["properties"].as_object().unwrap().keys().collect();
    assert_eq!(said.keys().collect::<BTreeSet<_>>(), all, "keys that the site sets, and those that there are");
    let of_site = Site::parse(SITE, "site/site.toml").unwrap();
    for (key, value) in serde_json::to_value(&of_site.parts[0]).unwrap().as_object().unwrap() {
        let told = match key.as_str() {
            "file" => json!("*.ply"),
            "albedo" => json!("marble.png"),
            "detail" => {
                let mut detail = value.clone();
                detail["file"] = json!("stone.png");
                detail
            }
            _ => value.clone(),
        };
        assert_eq!(said[key], told, "{key}");
    }
    assert_eq!(manifest["parameters"]["parts"].as_array().unwrap().len(), 2);
    assert_eq!(manifest["parameters"]["sky"]["probes"], "*.hdr");
    let text = manifest.to_string();
    assert!(!text.contains("someone") && !text.contains(".."), "{text}");

    let told = BundleSummary::of(&BundleReader::open(&target).unwrap()).to_string();
    let temple = told.lines().find(|line| line.starts_with("  part temple: ")).unwrap();
    for words in ["file = \"*.ply\"", "scale = -2.0", "up = \"z\"", "unit = \"mm\"", "translate = [1.0,2.0,3.0]"] {
        assert!(temple.contains(words), "`{words}` is not in\n{temple}");
    }
    assert!(told.ends_with("\n  part ground: file = \"ground.ply\""), "{told}");
}

#[test]
fn what_contradicts_itself_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    let manifest = written(&target, SITE);
    let refused = |change: &dyn Fn(&mut Value)| {
        let mut changed = manifest.clone();
        change(&mut changed);
        std::fs::write(target.join("manifest.json"), changed.to_string()).unwrap();
        BundleReader::open(&target).unwrap_err().to_string()
    };
    let earlier = refused(&|manifest| manifest["version"] = json!(SCAN_FORMAT_VERSION));
    assert!(earlier.contains("does not tell what is said of the parts"), "{earlier}");
    let fewer = refused(&|manifest| drop(manifest["parameters"]["parts"].as_array_mut().unwrap().pop()));
    assert!(fewer.contains("more or fewer parts"), "{fewer}");
}

#[test]
fn parts_of_which_nothing_is_said_make_no_later_version() {
    let folder = tempfile::tempdir().unwrap();
    let head = "[site]\nname = \"a\"\n";
    let sky = "[sky]\nprobes = \"a.hdr\"\nmapping = \"lat-long\"\n";
    let bare = "[[part]]\nfile = \"a.ply\"\nname = \"west\"\nrole = \"ground\"\n[[part]]\nfile = \"b.ply\"\n";
    let manifest = written(&folder.path().join("bare"), &format!("{head}{bare}{sky}"));
    assert_eq!((&manifest["version"], manifest["parameters"].get("parts")), (&json!(STILL_FORMAT_VERSION), None));
    let manifest = written(&folder.path().join("said"), &format!("{head}{bare}up = \"z\"\n{sky}"));
    assert_eq!(manifest["parameters"]["parts"][1]["up"], "z");
    assert_eq!(Part::of_file("a.ply").bare(), Part::of_file("a.ply"));
    // likewise keys of [prepare] that earlier programs do not know
    for (more, version) in [("", MOVING_FORMAT_VERSION), ("purge_effort = \"archival\"\n", PARTS_FORMAT_VERSION)] {
        let target = folder.path().join(format!("prepared-{version}"));
        let manifest = written(&target, &format!("{head}{bare}{sky}[prepare]\n{more}"));
        assert_eq!(manifest["version"], version);
        assert_eq!(manifest["parameters"]["prepare"].get("purge_effort").is_some(), !more.is_empty());
    }
}
