//! Bundles that someone has been at: an error that names the file, never a panic, never a large allocation.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use crate::common::{RGB, write};
use heliodon_bundle::{BundleReader, ReadError, WriterOptions};
use proptest::prelude::*;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// One bundle for all tests; each changes a copy.
static BUNDLE: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("b"), RGB, true, WriterOptions { max_glb_bytes: 40_000 });
    folder
});

fn copy() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("b");
    fs::create_dir_all(target.join("sky")).unwrap();
    let source = BUNDLE.path().join("b");
    for name in ["manifest.json", "lapse.json", "site.glb", "site-1.glb", "sky/0000.hdr", "sky/0001.hdr"] {
        fs::copy(source.join(name), target.join(name)).unwrap();
    }
    (folder, target)
}

/// Reads everything there is.
fn read_all(target: &Path) -> Result<(), ReadError> {
    let reader = BundleReader::open(target)?;
    for i in 0..reader.chunk_count() {
        reader.read_chunk(i)?.validate().expect("what is read is valid");
    }
    for i in 0..reader.manifest().textures.len() {
        reader.texture_bytes(i)?;
    }
    Ok(())
}

fn change(target: &Path, name: &str, edit: impl FnOnce(&mut Vec<u8>)) {
    let mut bytes = fs::read(target.join(name)).unwrap();
    edit(&mut bytes);
    fs::write(target.join(name), bytes).unwrap();
}

fn replace(target: &Path, name: &str, from: &str, to: &str) {
    change(target, name, |bytes| {
        let text = String::from_utf8_lossy(bytes);
        assert!(text.contains(from), "{from}");
        *bytes = text.replacen(from, to, 1).into_bytes();
    });
}

/// Replaces text in the JSON of a GLB; padded or cut to the same length by spaces.
fn replace_in_glb(target: &Path, from: &str, to: &str) {
    change(target, "site.glb", |bytes| {
        let at = bytes.windows(from.len()).position(|w| w == from.as_bytes()).expect(from);
        let end = 20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let mut json = bytes[20..end].to_vec();
        json.splice(at - 20..at - 20 + from.len(), to.bytes());
        while json.len() > end - 20 && json.last() == Some(&b' ') {
            json.pop();
        }
        let padded = json.len().next_multiple_of(4).max(end - 20);
        json.resize(padded, b' ');
        let total = bytes.len() - (end - 20) + padded;
        bytes.splice(20..end, json);
        bytes[12..16].copy_from_slice(&(padded as u32).to_le_bytes());
        bytes[8..12].copy_from_slice(&(total as u32).to_le_bytes());
    });
}

#[test]
fn the_bundle_itself_is_read() {
    let (_folder, target) = copy();
    read_all(&target).unwrap();
}

#[test]
fn changed_manifests_are_refused() {
    let cases: [(&str, &str, &str); 9] = [
        ("\"version\": 1", "\"version\": 11", "update Heliodon"),
        ("\"version\": 1", "\"version\": 99999999999", "update Heliodon"),
        ("\"version\": 1", "\"version\": 0", "bake it again"),
        ("heliodon-bundle", "other-bundle", "its format is `other-bundle`"),
        ("\"sun_steps\": 300", "\"sun_steps\": 4000000000", "sun_steps is 4000000000"),
        ("\"path\": \"lapse.json\"", "\"path\": \"../lapse.json\"", "no path within the bundle"),
        ("\"triangles\":", "\"triangels\":", "unknown field"),
        ("\"coefficients\": 9", "\"coefficients\": 4", "sky coefficients"),
        ("\"site-1.glb\"", "\"/etc/passwd\"", "within the bundle"),
    ];
    for (from, to, words) in cases {
        let (_folder, target) = copy();
        replace(&target, "manifest.json", from, to);
        if to.contains("passwd") {
            replace(&target, "manifest.json", "\"path\": \"site-1.glb\"", "\"path\": \"/etc/passwd\"");
        }
        let error = read_all(&target).expect_err(to).to_string();
        assert!(error.contains(words) || error.contains("is not among its files"), "{error}");
    }
    let (_folder, target) = copy();
    fs::remove_file(target.join("manifest.json")).unwrap();
    assert!(matches!(read_all(&target), Err(ReadError::NoBundle { .. })));
}

#[test]
fn changed_lapses_are_refused() {
    for (from, to) in [
        ("\"mask_bit\": 0", "\"mask_bit\": 300"),
        ("\"time\": \"06:57\"", "\"time\": \"26:57\""),
        ("\"time\": \"06:57\"", "\"time\": \"23:57\""),
        ("\"sky/0000.hdr\"", "\"../../0000.hdr\""),
        ("\"channels\": 3", "\"channels\": 1"),
        ("\"exposure_stops\": -1.0", "\"exposure_stops\": 1e60"),
    ] {
        let (_folder, target) = copy();
        replace(&target, "lapse.json", from, to);
        let error = read_all(&target).expect_err(to).to_string();
        assert!(error.contains("lapse.json"), "{error}");
    }
}

#[test]
fn changed_gltf_is_refused() {
    for (from, to) in [
        ("\"count\":10", "\"count\":18446744073709551615"),
        ("\"count\":10", "\"count\":60001"),
        ("\"count\":24", "\"count\":25"),
        ("\"componentType\":5126", "\"componentType\":5125"),
        ("\"byteLength\":120", "\"byteLength\":18446744073709551612"),
        ("\"byteOffset\":120", "\"byteOffset\":18446744073709551612"),
        ("\"POSITION\":0", "\"POSITION\":4000000000"),
        ("\"indices\":", "\"indicez\":"),
        ("\"part\":0", "\"part\":77"),
        ("\"heliodon_profile\":1", "\"heliodon_profile\":2"),
        ("\"mesh\":0", "\"mesh\":0,\"translation\":[1,0,0]"),
        ("\"nodes\":[0]", "\"nodes\":[0,0,0,0,0,0]"),
        ("\"nodes\":[0]", "\"nodes\":[9]"),
        ("\"version\":\"2.0\"", "\"version\":\"2.0"),
    ] {
        let (_folder, target) = copy();
        replace_in_glb(&target, from, to);
        let error = read_all(&target).expect_err(to).to_string();
        assert!(error.contains("site.glb") || error.contains("manifest.json"), "{error}");
    }
    // millions of uses of one small mesh must not become millions of chunks
    let (_folder, target) = copy();
    replace_in_glb(&target, "\"nodes\":[0]", &format!("\"nodes\":[{}0]", "0,".repeat(1_000_000)));
    assert!(read_all(&target).expect_err("a million chunks").to_string().contains("more than once"));
}

#[test]
fn truncated_files_are_refused_and_changed_bytes_found() {
    for name in ["manifest.json", "lapse.json", "site.glb", "site-1.glb"] {
        let len = fs::metadata(BUNDLE.path().join("b").join(name)).unwrap().len() as usize;
        for keep in [0, 3, 11, 19, 20, 100, len / 2, len - 1] {
            let (_folder, target) = copy();
            change(&target, name, |bytes| bytes.truncate(keep));
            // the last byte of the JSON files is a line's end, without which they are whole
            let whole = keep == len - 1 && name.ends_with("json");
            assert_eq!(read_all(&target).is_err(), !whole, "{name} cut at {keep}");
            if whole && name == "lapse.json" {
                assert!(BundleReader::open(&target).unwrap().verify().is_err());
            }
        }
    }
    let (_folder, target) = copy();
    change(&target, "site.glb", |bytes| *bytes.last_mut().unwrap() ^= 1);
    let reader = BundleReader::open(&target).unwrap();
    assert!(matches!(reader.verify(), Err(ReadError::Changed { .. })));
    let (_folder, target) = copy();
    fs::remove_file(target.join("sky/0001.hdr")).unwrap();
    assert!(BundleReader::open(&target).unwrap().verify().unwrap_err().to_string().contains("0001.hdr"));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_damage_never_panics(which in 0..4_usize, flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6), cut in prop::option::of(any::<prop::sample::Index>())) {
        let name = ["manifest.json", "lapse.json", "site.glb", "site-1.glb"][which];
        let (_folder, target) = copy();
        change(&target, name, |bytes| {
            // half of the flips where the structure is
            let head = bytes.len().min(6000);
            for (i, (at, value)) in flips.iter().enumerate() {
                let at = at.index(if i % 2 == 0 { head } else { bytes.len() });
                bytes[at] ^= value;
            }
            if let Some(cut) = cut { bytes.truncate(cut.index(bytes.len())); }
        });
        // an error or, where the bytes were spared or only numbers changed, a valid bundle
        let _ = read_all(&target);
    }
}
