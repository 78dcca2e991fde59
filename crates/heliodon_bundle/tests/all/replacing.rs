//! A bundle appears whole or not at all, and nothing good is lost.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use crate::common::{MONO, RGB, chunk, lapse, meta, write};
use heliodon_bundle::{BundleReader, BundleWriter, WriteError, WriterOptions};
use std::fs;
use std::path::Path;

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_bundle_replaces_an_older_one() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    write(&target, MONO, false, WriterOptions { max_glb_bytes: 1 });
    for litter in [".DS_Store", "._site.glb", "Thumbs.db", "sky/.directory"] {
        fs::write(target.join(litter), "litter").unwrap();
    }
    write(&target, RGB, true, WriterOptions::default());
    let reader = BundleReader::open(&target).unwrap();
    assert_eq!(reader.manifest().light, RGB);
    reader.verify().unwrap();
    assert_eq!(names(folder.path()), ["bundle"], "nothing stays beside it");
    assert_eq!(names(&target), ["lapse.json", "manifest.json", "site.glb", "sky"]);
}

#[test]
fn a_writer_that_fails_or_is_dropped_leaves_the_old_bundle_and_no_junk() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    write(&target, MONO, false, WriterOptions::default());
    let before = fs::read(target.join("manifest.json")).unwrap();

    let mut dropped = BundleWriter::create(&target, meta(MONO)).unwrap();
    dropped.push_chunk(&chunk(MONO, 0, None, 5, 0.0)).unwrap();
    assert!(matches!(BundleWriter::create(&target, meta(MONO)), Err(WriteError::Busy { .. })), "one writer at a time");
    drop(dropped);

    let empty = BundleWriter::create(&target, meta(MONO)).unwrap();
    assert!(empty.finish(&lapse(MONO)).unwrap_err().to_string().contains("no triangles"));
    let mut without_sky = BundleWriter::create(&target, meta(MONO)).unwrap();
    without_sky.push_chunk(&chunk(MONO, 0, None, 5, 0.0)).unwrap();
    assert!(without_sky.finish(&lapse(MONO)).unwrap_err().to_string().contains("sky/0000.hdr"));

    assert_eq!(names(folder.path()), ["bundle"]);
    assert_eq!(fs::read(target.join("manifest.json")).unwrap(), before);
    BundleReader::open(&target).unwrap().verify().unwrap();
}

#[test]
fn what_is_no_bundle_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |target: &Path| match BundleWriter::create(target, meta(MONO)) {
        Err(error @ WriteError::NotABundle { .. }) => error.to_string(),
        Err(error) => panic!("{error}"),
        Ok(_) => panic!("{} was taken", target.display()),
    };
    let file = folder.path().join("file");
    fs::write(&file, "x").unwrap();
    refused(&file);
    let photos = folder.path().join("photos");
    fs::create_dir(&photos).unwrap();
    fs::write(photos.join("a.jpg"), "x").unwrap();
    refused(&photos);
    fs::write(photos.join("manifest.json"), r#"{"name": "a web page"}"#).unwrap();
    refused(&photos);
    let bundle = folder.path().join("bundle");
    write(&bundle, MONO, false, WriterOptions::default());
    fs::create_dir(bundle.join("stills")).unwrap();
    fs::write(bundle.join("stills/noon.png"), "x").unwrap();
    assert!(refused(&bundle).contains("stills/noon.png"));
    fs::remove_dir_all(bundle.join("stills")).unwrap();
    for own in [".gitignore", ".notes.txt", "sky/.env"] {
        fs::write(bundle.join(own), "mine").unwrap();
        assert!(refused(&bundle).contains(&format!("`{own}` in it does not belong to the bundle")));
        assert_eq!(fs::read(bundle.join(own)).unwrap(), b"mine");
        fs::remove_file(bundle.join(own)).unwrap();
    }
    assert!(BundleWriter::create(folder.path().join(".."), meta(MONO)).is_err());
    assert_eq!(names(folder.path()), ["bundle", "file", "photos"], "no junk");
    let empty = folder.path().join("empty");
    fs::create_dir(&empty).unwrap();
    write(&empty, MONO, false, WriterOptions::default());
}

#[test]
fn what_a_killed_writer_left_is_cleaned_up() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    write(&target, MONO, false, WriterOptions::default());
    // killed while writing
    fs::create_dir(folder.path().join(".bundle.tmp")).unwrap();
    fs::write(folder.path().join(".bundle.tmp/.site.glb.spool"), "half").unwrap();
    fs::write(folder.path().join(".bundle.lock"), "").unwrap();
    drop(BundleWriter::create(&target, meta(MONO)).unwrap());
    assert_eq!(names(folder.path()), ["bundle"]);
    // killed between the two moves, where folders cannot change places at once
    fs::rename(&target, folder.path().join(".bundle.old")).unwrap();
    drop(BundleWriter::create(&target, meta(MONO)).unwrap());
    assert_eq!(names(folder.path()), ["bundle"]);
    BundleReader::open(&target).unwrap().verify().unwrap();
}

#[test]
fn chunks_that_do_not_fit_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = BundleWriter::create(folder.path().join("bundle"), meta(MONO)).unwrap();
    let mut refused = |change: fn(&mut heliodon_bundle::LitChunk), words: &str| {
        let mut bad = chunk(MONO, 0, None, 4, 0.0);
        change(&mut bad);
        let error = writer.push_chunk(&bad).expect_err(words).to_string();
        assert!(error.starts_with("chunk 0: ") && error.contains(words), "{error}");
    };
    refused(|c| c.positions[1].x = f32::NAN, "position of vertex 1 is not finite");
    refused(|c| c.normals[2] *= 1.1, "normal of vertex 2 is not of unit length");
    refused(|c| c.albedo[3].y = 1.5, "albedo of vertex 3 is not in [0, 1]");
    refused(|c| c.triangles[0][1] = 8, "triangle 0 names vertex 8 of 8");
    refused(|c| c.triangles.clear(), "0 triangles");
    refused(|c| c.valid[0] = 2, "valid of vertex 0");
    refused(|c| c.light.sky_transfer[7] = f32::INFINITY, "sky transfer of vertex 1 is not finite");
    refused(|c| c.light.sun_mask[1] |= 1 << 5, "sun mask of vertex 1");
    refused(|c| c.light.sun_mask.push(0), "sun_mask has 9 elements, not 8");
    refused(|c| c.part = 2, "part 2 of 2");
    refused(|c| c.texture = Some(0), "uvs has 0 elements");
    refused(|c| *c = chunk(RGB, 0, None, 4, 0.0), "its light is");
    writer.push_chunk(&chunk(MONO, 1, None, 4, 0.0)).unwrap();
    assert!(writer.push_chunk(&chunk(MONO, 0, None, 4, 0.0)).unwrap_err().to_string().contains("after a later part"));
    assert!(writer.add_texture("t", b"GIF89a").is_err());
    for path in ["../x.hdr", "sky/../x.hdr", "x.hdr", "sky/", "sky/.x", "sky/a/b.hdr"] {
        assert!(writer.add_sky_map(path, b"x").is_err(), "{path}");
    }
}

/// Runs itself again under a limit on the size of files, which fails writes as a full disk does.
#[cfg(unix)]
#[test]
fn a_full_disk_leaves_the_old_bundle_and_no_junk() {
    const TARGET: &str = "HELIODON_TEST_FULL_DISK";
    if let Some(target) = std::env::var_os(TARGET) {
        let mut writer = BundleWriter::create(target, meta(MONO)).unwrap();
        let large = chunk(MONO, 0, None, 5000, 0.0);
        let error = (0..100).find_map(|_| writer.push_chunk(&large).err()).expect("the limit is reached");
        assert!(matches!(error, WriteError::Fault(_)), "{error}");
        assert!(error.to_string().contains("the file grew beyond"), "{error}");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    write(&target, MONO, false, WriterOptions::default());
    let before = fs::read(target.join("manifest.json")).unwrap();
    let output = std::process::Command::new("bash")
        .args(["-c", "trap '' XFSZ; ulimit -f 2000; exec \"$0\" --exact a_full_disk_leaves_the_old_bundle_and_no_junk"])
        .arg(std::env::current_exe().unwrap())
        .env(TARGET, &target)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    assert_eq!(names(folder.path()), ["bundle"]);
    assert_eq!(fs::read(target.join("manifest.json")).unwrap(), before);
    BundleReader::open(&target).unwrap().verify().unwrap();
}
