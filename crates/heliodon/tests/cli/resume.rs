//! Bakes that end before their time: kill -9, damaged leftovers, a full disk.

use crate::sites::{TestSite, waves};
use crate::{Ran, assert_same_bundle, contents, done, heliodon, json, ran};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

/// A site whose gather has several blocks of a tenth of a second.
pub fn long_site() -> TestSite {
    let site = TestSite::smallest(&waves(64));
    site.edit("samples = 64", "samples = 512");
    site
}

pub fn blocks(folder: &Path, stage: &str) -> Vec<PathBuf> {
    let bakes = std::fs::read_dir(folder.join(".heliodon/cache")).into_iter().flatten().flatten();
    let files = bakes.flat_map(|bake| std::fs::read_dir(bake.path()).into_iter().flatten().flatten());
    files
        .map(|file| file.path())
        .filter(|path| path.file_name().unwrap().to_string_lossy().starts_with(stage) && path.extension().is_none())
        .collect()
}

#[test]
fn a_killed_bake_goes_on_and_ends_with_the_same_bytes() {
    let site = long_site();
    let whole = site.path("whole");
    done(&[&"bake", &site.folder(), &"-o", &whole, &"--no-cache"]);

    let mut child =
        heliodon(&[&"bake", &site.folder(), &"--threads", &"1"]).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let patience = Instant::now();
    while blocks(site.folder(), "gather").len() < 2 {
        assert!(child.try_wait().unwrap().is_none(), "the bake ended before it could be killed: too few blocks");
        assert!(patience.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!site.path("bundle").exists(), "a killed bake leaves no half bundle");

    let resumed = done(&[&"bake", &site.folder(), &"--no-cache"]);
    assert!(resumed.err.contains("going on: "), "{}", resumed.err);
    assert_same_bundle(&site.path("bundle"), &whole);
    assert!(!site.path(".heliodon").exists());
}

#[test]
fn damaged_leftovers_are_done_again() {
    let site = long_site();
    done(&[&"bake", &site.folder()]);
    let good = site.path("good");
    std::fs::rename(site.path("bundle"), &good).unwrap();
    for (stage, damage) in [("light", true), ("gather", true), ("masks", false)] {
        for path in blocks(site.folder(), stage) {
            let mut bytes = std::fs::read(&path).unwrap();
            let middle = bytes.len() / 2;
            if damage {
                bytes[middle] ^= 0x10
            } else {
                bytes.truncate(middle)
            }
            std::fs::write(&path, bytes).unwrap();
        }
    }
    let again = done(&[&"bake", &site.folder()]);
    assert!(again.err.contains("was damaged and is done again"), "{}", again.err);
    assert_same_bundle(&site.path("bundle"), &good);
}

#[test]
fn a_sky_goes_on_within_the_day() {
    let site = TestSite::smallest(&waves(8));
    site.edit("[site]", "[site]\nlatitude_deg = 37.97\nlongitude_deg = 23.7\nutc_offset = \"+03:00\"");
    site.edit("probes = \"grey.hdr\"\nmapping = \"lat-long\"", "model = \"atmosphere\"\ndate = \"2006-06-21\"");
    site.edit("[bake]", "[bake]\nsun_steps = 3\nsky_steps = 6");
    done(&[&"bake", &site.folder()]);
    let good = site.path("good");
    std::fs::rename(site.path("bundle"), &good).unwrap();
    // as a kill after four of the six would leave it, one of them damaged
    for lapse in blocks(site.folder(), "fitted-lapse") {
        std::fs::remove_file(lapse).unwrap();
    }
    let mut records = blocks(site.folder(), "sky-open");
    records.sort();
    assert_eq!(records.len(), 6);
    records[4..].iter().for_each(|record| std::fs::remove_file(record).unwrap());
    std::fs::write(&records[1], "damaged").unwrap();
    let again = done(&[&"bake", &site.folder()]);
    assert!(again.err.contains("going on: 4 of 6 skies are done"), "{}", again.err);
    assert_same_bundle(&site.path("bundle"), &good);
}

#[test]
fn a_shared_cache_tells_bundles_of_one_name_apart() {
    let (one, other) = (long_site(), long_site());
    other.edit("samples = 512", "samples = 16");
    let cache = one.path("shared");
    // both type ./bundle, each in its own folder
    let bake = |site: &TestSite, more: &[&str]| {
        let mut command = heliodon(&[&"bake", &".", &"-o", &"./bundle", &"--cache", &cache]);
        let output = command.args(more).current_dir(site.folder()).output().unwrap();
        let ran = ran(output);
        assert_eq!(ran.code, 0, "{}", ran.err);
    };
    bake(&one, &[]);
    let kept = contents(&cache).len();
    bake(&other, &["--no-cache"]);
    assert_eq!(contents(&cache).len(), kept, "another's work stays");
    // one's own goes, however its place is typed
    done(&[&"bake", &one.folder(), &"--cache", &cache, &"--again", &"--no-cache"]);
    assert!(!cache.exists());
}

#[test]
fn a_bundle_of_another_revision_is_baked_again() {
    let site = TestSite::smallest(&waves(8));
    done(&[&"bake", &site.folder()]);
    let path = site.path("bundle/manifest.json");
    let text = std::fs::read_to_string(&path).unwrap();
    let manifest: serde_json::Value = serde_json::from_str(&text).unwrap();
    let tool = manifest["tool"].as_str().unwrap();
    let (version, revision) = tool.rsplit_once(' ').unwrap();
    assert!(revision.len() == 16 && u64::from_str_radix(revision, 16).is_ok(), "{tool}");
    assert_eq!(json(&[&"bake", &site.folder()])["up_to_date"], true);
    std::fs::write(&path, text.replace(tool, &format!("{version} 0123456789abcdef"))).unwrap();
    assert_eq!(json(&[&"bake", &site.folder()])["up_to_date"], false);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
}

#[test]
#[cfg(unix)]
fn a_new_site_on_a_full_disk_can_be_made_again() {
    let home = tempfile::tempdir().unwrap();
    let site = home.path().join("site");
    let full = with_little_room(4, &["new", site.to_str().unwrap()]);
    assert_eq!(full.code, 1, "{}", full.err);
    assert!(full.err.contains("plate.obj") && !full.err.contains(".heliodon-new"), "{}", full.err);
    assert_eq!(std::fs::read_dir(home.path()).unwrap().count(), 0);
    // what a kill leaves is no hindrance, neither beside a new folder nor in one that is there
    std::fs::create_dir_all(home.path().join(".heliodon-new-site/junk")).unwrap();
    done(&[&"new", &site, &"--triangles", &"1000"]);
    let there = home.path().join("there");
    std::fs::create_dir_all(there.join(".heliodon-new/junk")).unwrap();
    done(&[&"new", &there, &"--triangles", &"1000"]);
    assert_eq!(contents(&site), contents(&there));
    assert_eq!(std::fs::read_dir(home.path()).unwrap().count(), 2);
}

#[test]
fn two_bakes_of_one_site_at_once_do_not_mix() {
    let site = long_site();
    let mut first = heliodon(&[&"bake", &site.folder()]).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let patience = Instant::now();
    while blocks(site.folder(), "gather").is_empty() {
        assert!(first.try_wait().unwrap().is_none() && patience.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(2));
    }
    let second = crate::run(&[&"bake", &site.folder()]);
    let first_code = first.wait().unwrap();
    assert!(first_code.success());
    assert_eq!(second.code, 1, "{}", second.err);
    assert!(second.err.contains("another bake"), "{}", second.err);
}

/// Runs the program with files limited to `kib` KiB: writes beyond fail as they do on a full disk.
#[cfg(unix)]
pub fn with_little_room(kib: u64, arguments: &[&str]) -> Ran {
    // ulimit counts blocks of 512 bytes; the ignored signal stays ignored across exec, so that the write itself fails
    let script = format!("trap '' XFSZ; ulimit -f {}; exec \"$0\" \"$@\"", kib * 2);
    let output = std::process::Command::new("sh")
        .args(["-c", &script, env!("CARGO_BIN_EXE_heliodon")])
        .args(arguments)
        .output()
        .unwrap();
    ran(output)
}

#[test]
#[cfg(unix)]
fn a_full_disk_leaves_the_old_bundle_and_no_junk() {
    let site = TestSite::smallest(&waves(40));
    let folder = site.folder().to_str().unwrap().to_owned();
    json(&[&"bake", &site.folder()]);
    let before = contents(&site.path("bundle"));
    site.edit("bounces = 4", "bounces = 3");
    let mut failures = 0;
    for kib in [0, 1, 4, 16, 64, 128, 256, 512] {
        let full = with_little_room(kib, &["bake", &folder]);
        if full.code == 0 {
            // enough room after all: the rest of the list is larger still
            break;
        }
        failures += 1;
        assert_eq!(full.code, 1, "{}", full.err);
        let errors: Vec<&str> = full.err.lines().filter(|line| line.starts_with("error:")).collect();
        assert_eq!(errors.len(), 1, "{}", full.err);
        assert_eq!(contents(&site.path("bundle")), before, "with {kib} KiB");
        let names: Vec<String> = std::fs::read_dir(site.folder())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .filter(|name| name.starts_with('.') && name != ".heliodon")
            .collect();
        assert!(names.is_empty(), "{names:?}");
    }
    assert!(failures >= 3);
    assert_eq!(json(&[&"bake", &site.folder()])["up_to_date"], false);
}
