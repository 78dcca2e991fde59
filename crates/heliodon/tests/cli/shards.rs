//! Bakes that many machines share: shards, their merge, and what goes wrong between them.

#[cfg(unix)]
use crate::resume::with_little_room;
use crate::resume::{blocks, long_site};
use crate::sites::{TestSite, waves};
use crate::{assert_same_bundle, done, heliodon, json, run};
use std::path::Path;
use std::process::Stdio;

/// A site of which every stage has work: skies of a model, bounced sun, a light grid, an actor, back sides.
fn rich_site() -> TestSite {
    let site = TestSite::smallest(&waves(40));
    site.edit("[site]", "[site]\nlatitude_deg = 37.97\nlongitude_deg = 23.7\nutc_offset = \"+03:00\"");
    site.edit("probes = \"grey.hdr\"\nmapping = \"lat-long\"", "model = \"hosek-wilkie\"\ndate = \"2006-06-21\"");
    site.edit("samples = 64", "samples = 512\nsun_steps = 3\nsky_steps = 5\ngrid_m = 0.1");
    let more = "[[room]]\nname = \"above\"\nmin = [0.2, 0.2, -0.8]\nmax = [0.8, 0.5, -0.2]\n\
                [[actor]]\nfile = \"mesh.obj\"\nplace = [0.5, 0.3, -0.5]\nground = \"ignore\"\n";
    let text = std::fs::read_to_string(site.path("site.toml")).unwrap();
    site.write("site.toml", text + more);
    site
}

/// Runs some shards of `count`, one after the other.
fn run_shards(site: &TestSite, bundle: &Path, order: impl IntoIterator<Item = u32>, count: u32) {
    for index in order {
        done(&[&"bake", &site.folder(), &"-o", &bundle, &"--shard", &format!("{index}/{count}")]);
    }
}

#[test]
fn any_number_of_shards_in_any_order_makes_the_bundle_of_one_machine() {
    let site = rich_site();
    let whole = site.path("whole");
    done(&[&"bake", &site.folder(), &"-o", &whole, &"--no-cache"]);
    let orders: [(u32, &[u32]); 4] = [(1, &[1]), (2, &[2, 1]), (3, &[3, 1, 3, 2]), (7, &[4, 7, 1, 2, 6, 5, 3])];
    for (count, order) in orders {
        let bundle = site.path(&format!("of-{count}"));
        run_shards(&site, &bundle, order.iter().copied(), count);
        assert!(!bundle.exists(), "a shard writes no bundle");
        let again = json(&[&"bake", &site.folder(), &"-o", &bundle, &"--shard", &format!("1/{count}")]);
        assert_eq!((again["computed"].as_u64(), again["missing"].as_u64()), (Some(0), Some(0)), "{again}");
        assert!(again["own"].as_u64().unwrap() >= again["blocks"].as_u64().unwrap() / u64::from(count));
        let merged = json(&[&"merge", &site.folder(), &"-o", &bundle, &"--no-cache"]);
        assert!(merged["measures"]["grid_points"].as_f64().unwrap() > 0.0, "{merged}");
        assert_same_bundle(&bundle, &whole);
        assert!(!site.path(".heliodon").exists());
        let after = json(&[&"bake", &site.folder(), &"-o", &bundle, &"--shard", &format!("1/{count}")]);
        assert_eq!(after["up_to_date"], true);
    }
}

#[test]
fn shards_at_once_share_the_work() {
    let site = rich_site();
    let whole = site.path("whole");
    done(&[&"bake", &site.folder(), &"-o", &whole, &"--no-cache"]);
    let bundle = site.path("bundle");
    let shards = ["1/2", "2/2", "2/2"].map(|shard| {
        let mut command = heliodon(&[&"bake", &site.folder(), &"--threads", &"1", &"--shard", &shard]);
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    });
    for mut shard in shards {
        assert!(shard.wait().unwrap().success());
    }
    done(&[&"merge", &site.folder()]);
    assert_same_bundle(&bundle, &whole);
}

#[test]
fn what_is_missing_is_named_with_what_makes_it() {
    let site = long_site();
    let none = run(&[&"merge", &site.folder()]);
    assert_eq!(none.code, 1);
    assert!(none.err.contains("no shard of this bake has run") && none.err.contains("--shard I/N"), "{}", none.err);
    run_shards(&site, &site.path("bundle"), [2], 3);
    let some = run(&[&"merge", &site.folder()]);
    assert_eq!(some.code, 1);
    assert!(some.err.contains("shards 1/3, 3/3") && some.err.contains("--shard 1/3`"), "{}", some.err);
    assert!(!site.path("bundle").exists());
    run_shards(&site, &site.path("bundle"), [3, 1], 3);
    done(&[&"merge", &site.folder()]);
}

#[test]
fn shards_of_another_plan_are_refused() {
    let site = long_site();
    run_shards(&site, &site.path("bundle"), [1, 2], 2);
    let report = json(&[&"bake", &site.folder(), &"--shard", &"1/2"]);
    let key = report["plan"].as_str().unwrap();
    site.edit("samples = 512", "samples = 500");
    let merged = run(&[&"merge", &site.folder()]);
    assert_eq!(merged.code, 1);
    assert!(merged.err.contains("another plan") && merged.err.contains("bake.samples (512 there, 500 here)"), "{}", merged.err);
    let shard = run(&[&"bake", &site.folder(), &"--shard", &"1/2", &"--plan", &key]);
    assert_eq!(shard.code, 1);
    assert!(shard.err.contains("site.toml") && shard.err.contains("bake.samples"), "{}", shard.err);
    site.edit("samples = 500", "samples = 512");
    let old = site.path("mesh.obj");
    let mesh = std::fs::read_to_string(&old).unwrap();
    site.write("mesh.obj", mesh.replace("v 0 ", "v -0.001 "));
    let merged = run(&[&"merge", &site.folder()]);
    assert!(merged.err.contains("the file mesh.obj"), "{}", merged.err);
    site.write("mesh.obj", mesh);
    done(&[&"merge", &site.folder()]);
}

#[test]
fn damaged_blocks_of_shards_are_done_again() {
    let site = long_site();
    let whole = site.path("whole");
    done(&[&"bake", &site.folder(), &"-o", &whole, &"--no-cache"]);
    run_shards(&site, &site.path("bundle"), [1, 2], 2);
    let damage = |index: usize| {
        let mut gathered = blocks(site.folder(), "gather");
        gathered.sort();
        let mut bytes = std::fs::read(&gathered[index]).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        std::fs::write(&gathered[index], bytes).unwrap();
    };
    (0..2).for_each(damage);
    let computed = |shard: &str| json(&[&"bake", &site.folder(), &"--shard", &shard])["computed"].as_u64().unwrap();
    assert_eq!((computed("1/2"), computed("2/2")), (1, 1));
    damage(1);
    let merged = done(&[&"merge", &site.folder()]);
    assert!(merged.err.contains("was damaged and is done again"), "{}", merged.err);
    assert_same_bundle(&site.path("bundle"), &whole);
}

#[test]
fn folders_of_their_own_are_joined_by_copying() {
    let site = rich_site();
    let whole = site.path("whole");
    done(&[&"bake", &site.folder(), &"-o", &whole, &"--no-cache"]);
    for (cache, shard) in [("one", "1/2"), ("two", "2/2")] {
        done(&[&"bake", &site.folder(), &"--cache", &site.path(cache), &"--shard", &shard]);
    }
    for (name, bytes) in crate::contents(&site.path("two")) {
        std::fs::write(site.path("one").join(name), bytes).unwrap();
    }
    done(&[&"merge", &site.folder(), &"--cache", &site.path("one")]);
    assert_same_bundle(&site.path("bundle"), &whole);
}

#[test]
fn a_shard_and_a_whole_bake_do_not_mix() {
    let site = long_site();
    let mut whole = heliodon(&[&"bake", &site.folder()]).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    while blocks(site.folder(), "masks").is_empty() {
        assert!(whole.try_wait().unwrap().is_none(), "the bake ended before it could be met");
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    let shard = run(&[&"bake", &site.folder(), &"--shard", &"1/2"]);
    assert!(whole.wait().unwrap().success());
    assert_eq!(shard.code, 1, "{}", shard.err);
    assert!(shard.err.contains("another bake"), "{}", shard.err);
}

#[test]
#[cfg(unix)]
fn a_full_disk_stops_a_shard_and_a_merge_and_spoils_nothing() {
    let site = rich_site();
    let whole = site.path("whole");
    done(&[&"bake", &site.folder(), &"-o", &whole, &"--no-cache"]);
    let folder = site.folder().to_str().unwrap().to_owned();
    let refused = |arguments: &[&str]| {
        let mut failures = 0;
        for kib in [0, 4, 32, 256, 2048] {
            let full = with_little_room(kib, arguments);
            if full.code == 0 {
                break;
            }
            failures += 1;
            assert_eq!(full.code, 1, "{}", full.err);
            assert_eq!(full.err.lines().filter(|line| line.starts_with("error:")).count(), 1, "{}", full.err);
            assert!(!site.path("bundle").exists());
        }
        failures
    };
    assert!(refused(&["bake", &folder, "--shard", "1/1"]) >= 3);
    done(&[&"bake", &site.folder(), &"--shard", &"1/1"]);
    assert!(refused(&["merge", &folder]) >= 2);
    done(&[&"merge", &site.folder()]);
    assert_same_bundle(&site.path("bundle"), &whole);
}

#[test]
fn arguments_that_do_not_go_together_are_told() {
    let site = TestSite::smallest(&waves(8));
    let wrong: [&[&str]; 6] = [
        &["--shard", "3/2"],
        &["--shard", "1"],
        &["--on", "slurm"],
        &["--shards", "2"],
        &["--shard", "1/2", "--estimate"],
        &["--plan", "abc"],
    ];
    for more in wrong {
        let mut command = heliodon(&[&"bake", &site.folder()]);
        assert_eq!(command.args(more).output().unwrap().status.code(), Some(2), "{more:?}");
    }
}
