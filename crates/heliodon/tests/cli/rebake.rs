//! Bakes after a change: what the change does not reach is taken from the cache, and the bundle is that of a bake from nothing.

use crate::sites::{TestSite, plane, waves};
use crate::{assert_same_bundle, done, json};
use serde_json::Value;

/// A site under a model's sky, with a light grid.
fn site() -> TestSite {
    let site = TestSite::smallest(&waves(40));
    site.edit("[site]", "[site]\nlatitude_deg = 37.97\nlongitude_deg = 23.7\nutc_offset = \"+03:00\"");
    site.edit("probes = \"grey.hdr\"\nmapping = \"lat-long\"", "model = \"hosek-wilkie\"\ndate = \"2006-06-21\"");
    site.edit("samples = 64", "samples = 64\nsun_steps = 5\nsky_steps = 10\ngrid_m = 0.1");
    let room = "[[room]]\nname = \"above\"\nmin = [0.2, 0.2, -0.8]\nmax = [0.8, 0.5, -0.2]\n";
    let text = std::fs::read_to_string(site.path("site.toml")).unwrap();
    site.write("site.toml", text + room);
    site
}

/// Bakes with and without what the cache has; what was taken, once both are the same.
fn rebaked(site: &TestSite) -> Value {
    let report = json(&[&"bake", &site.folder()]);
    let (whole, cache) = (site.path("whole"), site.path("no-cache"));
    done(&[&"bake", &site.folder(), &"-o", &whole, &"--cache", &cache, &"--no-cache"]);
    assert_same_bundle(&site.path("bundle"), &whole);
    assert!(report["kept_bytes"].as_u64().unwrap() > 0);
    report["taken"].clone()
}

/// Blocks, or where these were not there rays, that were taken of a stage; of so many.
fn of(taken: &Value, stage: &str, what: &str) -> (u64, u64) {
    let all = taken.as_array().unwrap();
    let found = all.iter().find(|entry| entry["stage"] == stage).unwrap_or_else(|| panic!("{stage} in {taken}"));
    (found[what].as_u64().unwrap(), found[if what == "rays" { "of_rays" } else { "of" }].as_u64().unwrap())
}

fn has(taken: &Value, stage: &str) -> bool {
    taken.as_array().unwrap().iter().any(|entry| entry["stage"] == stage)
}

#[test]
fn a_name_or_a_comment_takes_all_light() {
    let site = site();
    rebaked(&site);
    site.edit("[site]\n", "[site]\nnorth_deg = 0.0 # as the map has it\n");
    let taken = rebaked(&site);
    assert!(has(&taken, "all light") && !has(&taken, "sky transfer"), "{taken}");
}

#[test]
fn other_suns_trace_no_ray_between_surfaces() {
    let site = site();
    let first = rebaked(&site);
    assert_eq!((of(&first, "sun masks", "blocks").0, of(&first, "sky transfer", "rays").0), (0, 0));
    for (old, new) in [
        ("sun_steps = 5", "sun_steps = 9"),
        ("2006-06-21", "2006-12-21"),
        ("sun_steps = 9", "sun_steps = 9\nfirst = \"10:00\""),
    ] {
        site.edit(old, new);
        let taken = rebaked(&site);
        assert_eq!(of(&taken, "sun masks", "blocks").0, 0, "{taken}");
        for stage in ["sky transfer", "light of space"] {
            let (known, all) = of(&taken, stage, "rays");
            // points that err under these suns only look again
            assert!(known * 10 > all * 8, "{taken}");
        }
    }
    // without bounced sunlight the gather knows of no sun
    site.edit("sun_steps = 9", "sun_bounce = false\nsun_steps = 9");
    rebaked(&site);
    site.edit("sun_steps = 9", "sun_steps = 4");
    let taken = rebaked(&site);
    let (known, all) = of(&taken, "sky transfer", "blocks");
    assert!(known == all && of(&taken, "sun masks", "blocks").0 == 0, "{taken}");
}

#[test]
fn another_sky_takes_all_light() {
    let site = site();
    rebaked(&site);
    site.edit("hosek-wilkie", "atmosphere");
    let taken = rebaked(&site);
    assert!(of(&taken, "sky", "blocks").0 == 0 && has(&taken, "all light"), "{taken}");
}

#[test]
fn order_bounces_and_albedo_take_masks_and_rays() {
    let site = site();
    rebaked(&site);
    for (old, new) in [
        ("bounces = 4", "bounces = 3"),
        ("bounces = 3", "bounces = 3\norder = 2"),
        ("albedo = [0.5, 0.5, 0.5]", "albedo = [0.7, 0.5, 0.2]"),
    ] {
        site.edit(old, new);
        let taken = rebaked(&site);
        for stage in ["sun masks", "sun on surfaces", "sun in space"] {
            let (known, all) = of(&taken, stage, "blocks");
            assert!(known == all && all > 0, "{stage}: {taken}");
        }
        let (known, all) = of(&taken, "sky transfer", "rays");
        assert!(known * 10 > all * 8, "{taken}");
    }
    site.edit("samples = 64", "samples = 65");
    let taken = rebaked(&site);
    let (known, all) = of(&taken, "sun masks", "blocks");
    assert!(known == all && of(&taken, "sky transfer", "rays").0 == 0, "{taken}");
}

#[test]
fn superseded_blocks_go_and_two_ways_of_one_site_do_not_mix() {
    let site = site();
    let kept = |site: &TestSite| json(&[&"bake", &site.folder(), &"--again"])["kept_bytes"].as_u64().unwrap();
    rebaked(&site);
    let (first, folders) = (kept(&site), || std::fs::read_dir(site.path(".heliodon/cache")).unwrap().count());
    site.edit("sun_steps = 5", "sun_steps = 6");
    rebaked(&site);
    site.edit("sun_steps = 6", "sun_steps = 5");
    rebaked(&site);
    // rays of points that erred under the other suns may stay
    assert!(folders() == 1 && kept(&site).abs_diff(first) * 20 < first, "{} {first}", kept(&site));
}

/// The hills of [`site`], a far plain that keeps the bounds, and a plate that can be moved.
fn site_with_plate(place: &str) -> TestSite {
    let site = site();
    site.write("plain.obj", "v -9 -1 -9\nv -9 -1 9\nv 9 -1 9\nv 9 -1 -9\nv 0 9 0\nv 0.1 9 0\nv 0 9 0.1\nf 1 2 3 4\nf 5 6 7\n");
    site.write("plate.obj", plane(6));
    let text = std::fs::read_to_string(site.path("site.toml")).unwrap();
    let plate = format!("[[part]]\nfile = \"plain.obj\"\n[[part]]\nfile = \"plate.obj\"\nscale = 0.3\ntranslate = {place}\n");
    site.write("site.toml", text.replace("[sky]", &format!("{plate}[sky]")));
    site
}

/// What part of a stage's rays was known, where its blocks were not there.
fn known(taken: &Value, stage: &str) -> f64 {
    assert_eq!(of(taken, stage, "blocks").0, 0, "{taken}");
    let (known, all) = of(taken, stage, "rays");
    known as f64 / all as f64
}

#[test]
fn a_moved_part_is_met_where_it_is_and_nowhere_else() {
    let site = site_with_plate("[-6.0, 0.2, 0.0]");
    rebaked(&site);
    let places = ["[-6.0, 0.2, 0.5]", "[0.35, 0.15, -0.35]", "[0.4, 0.15, -0.35]", "[-6.0, 0.2, 0.0]"];
    for (then, now) in [("[-6.0, 0.2, 0.0]", places[0]), (places[0], places[1]), (places[1], places[2]), (places[2], places[3])]
    {
        site.edit(then, now);
        let taken = rebaked(&site);
        // out of sight or in the way: most rays of the hills are what they were
        for stage in ["sky transfer", "light of space", "sun masks", "sun on surfaces"] {
            assert!(known(&taken, stage) > 0.4, "{stage} at {now}: {taken}");
        }
    }
}

#[test]
fn parts_come_and_go() {
    let site = site_with_plate("[0.35, 0.15, -0.35]");
    rebaked(&site);
    let whole = std::fs::read_to_string(site.path("site.toml")).unwrap();
    let begin = whole.find("[[part]]\nfile = \"plate.obj\"").unwrap();
    let end = whole.find("[sky]").unwrap();
    site.write("site.toml", format!("{}{}", &whole[..begin], &whole[end..]));
    assert!(known(&rebaked(&site), "sky transfer") > 0.4);
    site.write("site.toml", whole);
    assert!(known(&rebaked(&site), "sky transfer") > 0.4);
    site.write("plate.obj", plane(5));
    assert!(known(&rebaked(&site), "sky transfer") > 0.4);
}
