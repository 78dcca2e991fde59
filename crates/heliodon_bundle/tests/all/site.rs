//! `site.toml`: what is read, what is refused and where, the schema, the template.

use heliodon_bundle::site::{
    Actor, Albedo, Bake, Between, Date, Display, Ground, Lamp, LightStorage, Mapping, Matte, OwnWeathering, PartWeathering,
    Prepare, ProbeTimes, PurgeEffort, Role, Room, Site, SiteFile, SkyModel, Transfer, Unit, UpAxis, Walk, Weathering, Winding,
};
use proptest::prelude::*;
use std::path::Path;

const SMALLEST: &str = r#"[site]
name = "Bunny under a grey sky"
[[part]]
file = "bunny.obj"
role = "scan"
albedo = [0.5, 0.5, 0.5]
[sky]
probes = "grey.hdr"
mapping = "lat-long"
[bake]
bounces = 4
samples = 1024
"#;

const FULL: &str = r#"[site]
name = "The Parthenon"
latitude_deg = 37.9715
longitude_deg = 23.7267
utc_offset = "+01:34:54"
north_deg = 77
origin = [475000.5, 150.25, 4201000.75]

[[part]]
file = "temple/*.ply"
name = "temple"
role = "scan"
albedo = "marble.png"
unit = "mm"
up = "z"
translate = [1, 2, 3]
rotate_deg = [0, 90, 0]
scale = -2.0
light = "vertex"

[[part]]
file = "ground.glb"
role = "ground"

[sky]
model = "atmosphere"
date = "-0437-08-01"
turbidity = 2.5

# how its light is computed

[bake]
sun_steps = 46
sky_steps = 92
first = 06:57:00
last = "17:34"
order = 2
bounces = 3
samples = 512
seed = 7
offset_m = 0.002
grid_m = 0.25
transfer = "rgb"
sun_bounce = false

[[room]]
name = "west"
min = [-50, 1, 0]
max = [-48, 2, 2]
windows = [[[-48, 1, 0], [-48, 1, 2], [-48, 2, 0]]]
looks_at = [0, 8, 0]

[display]
width_px = 1280
height_px = 800
fov_deg = 40

[[actor]]
file = "people/walker.glb"
cache = "people/cloth.pc2"
animation = "walk"
speed = 0.5
path = [[475000, 150, 4201000], [475010, 150, 4201000]]
walk_speed = 1
walk = "back-and-forth"
turn_deg = 90
scale = 1.1
unit = "cm"
up = "z"
rotate_deg = [0, 5, 0]
albedo = "people/skin.png"

[[actor]]
name = "guard"
file = "people/guard.obj"
place = [475003.5, 151, 4201000]
ground = "follow"

[[actor]]
file = "people/flag.obj"
cache = "people/flag.pc2"
cache_frames_per_s = 24
place = [475004, 160, 4201000]
ground = "ignore"
name = "flag"

[[light]]
name = "oil lamp"
place = [475002, 151.5, 4201001]
intensity = [3, 2, 1]
look_at = [475002, 150, 4201001]
angle_deg = 40
edge = 0.5
reach_m = 8
shadows = false

[prepare]
weld_m = 0.001
isolated_m = 0.25
winding = "report"
solids = false
error_px = 0.5
edge_px = 4
nearest_m = 2
error_m = 0.01
edge_m = 0.1
triangles = 1000000
purge = true
ring = 2
purge_effort = "archival"

[budget]
bake_mib = 4096

[[matte]]
name = "in the wall"
corners = [[475000.5, 150.25, 4201000.75], [475002.5, 150.25, 4201000.75], [475002.5, 153.25, 4201000.75]]
[weathering]
dust = 0.5
corrosion = 0.75
dust_color = [0.4, 0.3, 0.2]
wind_from_deg = 225
wind_m_per_s = 3
"#;

fn parse(text: &str) -> Result<Site, heliodon_bundle::ConfigError> {
    Site::parse(text, "somewhere/site.toml")
}

#[test]
fn the_smallest_site_works_as_written() {
    let site = parse(SMALLEST).unwrap();
    assert_eq!(site.site.name, "Bunny under a grey sky");
    assert_eq!(site.parts[0].albedo, Some(Albedo::Rgb([0.5; 3])));
    assert_eq!((site.parts[0].role, site.parts[0].unit, site.parts[0].up), (Role::Scan, Unit::Metre, UpAxis::Y));
    assert_eq!((site.sky.mapping, &site.sky.times), (Some(Mapping::LatLong), &ProbeTimes::InNames));
    assert_eq!(site.bake, Bake::default());
    assert_eq!((site.bake.effective_sky_steps(), site.bake.coefficients(), site.bake.channels()), (184, 4, 1));
    assert_eq!(site.folder(), Path::new("somewhere"));
}

#[test]
fn every_key_of_the_design_is_read() {
    let site = parse(FULL).unwrap();
    assert_eq!(site.site.utc_offset.seconds(), 5694);
    assert_eq!(site.site.origin[2], 4_201_000.75);
    let part = &site.parts[0];
    assert_eq!(part.albedo, Some(Albedo::Image("marble.png".to_owned())));
    assert_eq!((part.unit.metres(), part.up, part.scale, part.light), (0.001, UpAxis::Z, -2.0, LightStorage::Vertex));
    assert_eq!(site.sky.model, Some(SkyModel::Atmosphere));
    assert_eq!(site.sky.date, Some(Date { year: -437, month: 8, day: 1 }));
    assert_eq!(site.bake.first.map(|t| t.seconds()), Some(6 * 3600 + 57 * 60));
    assert_eq!((site.bake.coefficients(), site.bake.channels()), (9, 3));
    assert_eq!(site.rooms[0].windows[0][2], [-48.0, 2.0, 0.0]);
    let [walker, guard, flag] = &site.actors[..] else { panic!("{:?}", site.actors) };
    assert_eq!(
        (walker.display_name(), walker.walk, walker.unit, walker.up),
        ("walker", Walk::BackAndForth, Unit::Centimetre, UpAxis::Z)
    );
    assert_eq!((walker.speed, walker.walk_speed, walker.turn_deg, walker.scale), (0.5, 1.0, 90.0, 1.1));
    assert_eq!(walker.relative_to(site.site.origin).stations(), [[-0.5, -0.25, -0.75], [9.5, -0.25, -0.75]]);
    let stands = Actor::at("people/guard.obj", [475_003.5, 151.0, 4_201_000.0]);
    assert_eq!(guard, &Actor { name: Some("guard".into()), ground: Ground::Follow, ..stands });
    assert_eq!((walker.ground, walker.cache_frames_per_s), (Ground::Check, None));
    assert_eq!((flag.ground, flag.cache_frames_per_s), (Ground::Ignore, Some(24.0)));
    assert_eq!((site.bake.grid_m, site.bake.effective_grid_m()), (Some(0.25), 0.25));
    let [lamp] = &site.lamps[..] else { panic!("{:?}", site.lamps) };
    assert_eq!(
        (lamp.intensity, lamp.angle_deg, lamp.edge, lamp.reach_m, lamp.shadows),
        ([3.0, 2.0, 1.0], 40.0, 0.5, 8.0, false)
    );
    let lamp = lamp.relative_to(site.site.origin);
    assert_eq!((lamp.place, lamp.direction()), ([1.5, 1.25, 0.25], Some(glam::Vec3::NEG_Y)));
    assert_eq!(Lamp::at([0.0; 3], [1.0; 3]).direction(), None);
    let [matte] = &site.mattes[..] else { panic!("{:?}", site.mattes) };
    assert_eq!((matte.name.as_deref(), matte.area_m2()), (Some("in the wall"), 3.0));
    assert_eq!(
        matte.relative_to(site.site.origin),
        Matte { name: matte.name.clone(), ..Matte::new([[0.0; 3], [2.0, 0.0, 0.0], [2.0, 3.0, 0.0]]) }
    );
    let prepare = site.prepare.as_ref().unwrap();
    assert_eq!((prepare.clean, prepare.weld_m, prepare.winding, prepare.solids), (true, 0.001, Winding::Report, false));
    assert_eq!((prepare.error_px, prepare.edge_px, prepare.error_m, prepare.ring), (0.5, 4.0, Some(0.01), 2));
    assert_eq!((prepare.triangles, prepare.purge_effort), (1_000_000, PurgeEffort::Archival));
    assert_eq!((site.budget.bake_bytes(), site.budget.viewer_bytes()), (Some(4 << 30), None));
    assert!(parse(SMALLEST).unwrap().budget.is_empty());
    assert_eq!(parse(SMALLEST).unwrap().prepare, None);
    assert_eq!(parse(&SMALLEST.replacen("[bake]", "[prepare]\n[bake]", 1)).unwrap().prepare, Some(Prepare::default()));
    assert_eq!(site.display, Display { width_px: 1280, height_px: 800, fov_deg: 40.0 });
    let weathering = site.weathering.as_ref().unwrap();
    assert_eq!((weathering.corrosion, weathering.wind_from_deg, weathering.wind_m_per_s), (0.75, Some(225.0), 3.0));
    let own = "light = \"vertex\"\nweathering = { dust = 0.25, corrosion_color = [0.1, 0.2, 0.1] }";
    let site =
        parse(&FULL.replacen("light = \"vertex\"", own, 1).replacen("role = \"ground\"", "weathering = false", 1)).unwrap();
    let of = |part: usize| weathering.of_part(site.parts[part].weathering.as_ref());
    let own = of(0).unwrap();
    assert_eq!((own.dust, own.corrosion, own.dust_color, own.corrosion_color), (0.25, 0.75, [0.4, 0.3, 0.2], [0.1, 0.2, 0.1]));
    assert_eq!((of(1), weathering.of_part(None)), (None, Some(weathering.clone())));
    assert_eq!(parse(SMALLEST).unwrap().weathering, None);
    assert_eq!(Weathering::default().of_part(None), None, "the table alone weathers nothing");
}

/// A text with one line replaced, and where the fault is to be found: line, column, words of the message.
fn refused(text: &str, from: &str, to: &str, place: (usize, usize), words: &[&str]) {
    assert!(text.contains(from), "{from}");
    let error = parse(&text.replacen(from, to, 1)).expect_err(to);
    let message = error.to_string();
    assert_eq!(error.place, Some(place), "{message}");
    for word in words {
        assert!(message.contains(word), "`{word}` is not in: {message}");
    }
    assert!(message.starts_with(&format!("somewhere/site.toml:{}:{}: ", place.0, place.1)), "{message}");
    assert!(!error.remedy.is_empty(), "no remedy: {message}");
}

#[test]
fn a_wrong_actor_is_refused_where_it_is_wrong() {
    let place = "place = [475003.5, 151, 4201000]";
    for (from, to, at, words) in [
        (place, "", (73, 1), &["neither a place nor a path", "add place"][..]),
        (place, "place = [0, 0, 0]\npath = [[0, 0, 0], [1, 0, 0]]", (77, 1), &["both a place and a path"]),
        (place, "place = [0, 0, nan]", (76, 1), &["place holds NaN"]),
        (place, "place = [0, 0]", (76, 9), &[]),
        (place, "path = [[0, 0, 0]]", (76, 1), &["has 1 points", "at least two"]),
        (place, "path = [[0, 0, 0], [0, 0, 0]]", (76, 1), &["are the same"]),
        (place, "path = [[0, 0, 0], [inf, 0, 0]]", (76, 1), &["path holds inf"]),
        ("speed = 0.5", "speed = -1", (62, 9), &["speed is -1"]),
        ("walk_speed = 1", "walk_speed = 0", (64, 14), &["walk_speed is 0", "place in place of path"]),
        ("\"back-and-forth\"", "\"circel\"", (65, 8), &["unknown value `circel`", "did you mean `circle`?"]),
        ("turn_deg = 90", "turn_deg = nan", (66, 12), &["turn_deg holds NaN"]),
        ("scale = 1.1", "scale = 0", (67, 9), &["scale is 0"]),
        ("name = \"guard\"", "name = \"Walker\"", (74, 8), &["another actor is called `Walker`"]),
        ("name = \"guard\"", "name = \"../guard\"", (74, 8), &["cannot name the actor's folder"]),
        ("people/guard.obj", "", (75, 8), &["file is empty"]),
        ("albedo = \"people/skin.png\"", "albedo = [2, 0, 0]", (71, 1), &["albedo holds 2"]),
        ("[[actor]]\nname", "[[actor]]\nplaces = 1\nname", (74, 1), &["unknown key `places`", "did you mean `place`?"]),
        ("cache_frames_per_s = 24", "cache_frames_per_s = 0", (82, 22), &["cache_frames_per_s is 0", "from 0.001 to 1000"]),
        ("cache_frames_per_s = 24", "cache_frames_per_s = inf", (82, 22), &["cache_frames_per_s is inf"]),
        ("cache_frames_per_s = 24", "cache_frames_per_s = nan", (82, 22), &["cache_frames_per_s is NaN"]),
        ("cache_frames_per_s = 24", "cache_frames_per_s = 1000.5", (82, 22), &["cache_frames_per_s is 1000.5"]),
        ("cache = \"people/flag.pc2\"\n", "", (81, 22), &["belongs to a vertex cache", "add cache"]),
        ("ground = \"follow\"", "ground = \"folow\"", (77, 10), &["unknown value `folow`", "did you mean `follow`?"]),
        ("grid_m = 0.25", "grid_m = 0.01", (42, 10), &["grid_m is 0.01", "from 0.1 to 10"]),
    ] {
        refused(FULL, from, to, at, words);
    }
    let single = SMALLEST.to_owned() + "[actor]\nfile = \"a.glb\"\nplace = [0, 0, 0]\n";
    let error = parse(&single).unwrap_err();
    assert!(error.message.contains("[actor] is one table") && error.remedy.contains("[[actor]]"), "{error}");
}

#[test]
fn a_wrong_matte_is_refused_where_it_is_wrong() {
    let line = FULL.lines().position(|line| line.starts_with("corners =")).unwrap() + 1;
    let corners = FULL.lines().nth(line - 1).unwrap();
    for (to, words) in [
        ("corners = []", &["the matte has 0 corners", "3 to 16 points"][..]),
        ("corners = [[0, 0, 0], [1, 0, 0]]", &["the matte has 2 corners"]),
        ("corners = [[0, 0, 0], [1, 0, 0], [nan, 0, 1]]", &["corners holds NaN"]),
        ("corners = [[0, 0, 0], [1, 0, 0], [2, 0, 0]]", &["the matte has no area"]),
        ("corners = [[0, 0, 0], [1, 0, 0], [1, 0, 0], [0, 1, 0]]", &["corners 2 and 3 are the same"]),
        ("corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0.5], [0, 1, 0]]", &["not planar: corner", "two mattes"]),
        ("corners = [[0, 0, 0], [4, 0, 0], [1, 1, 0], [0, 4, 0]]", &["not convex", "inward at corner 3"]),
        ("corners = [[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0]]", &["no area", "around it"]),
    ] {
        refused(FULL, corners, to, (line, 1), words);
    }
    refused(FULL, "name = \"in the wall\"", "nane = \"a\"", (line - 1, 1), &["unknown key `nane`", "did you mean `name`?"]);
}

#[test]
fn what_belongs_to_probes_is_no_part_of_a_model_s_sky() {
    for key in [
        "turn_deg = 10",
        "below_horizon = \"mirror\"",
        "times = [\"10:00\"]",
        "sun_irradiance = [1, 1, 1]",
        "between = \"nearest\"",
    ] {
        let error = parse(&FULL.replacen("turbidity = 2.5", key, 1)).expect_err(key).to_string();
        assert!(error.contains("belongs to probes"), "{error}");
    }
    let error = parse(&SMALLEST.replacen("[bake]", "opening_deg = 170\n[bake]", 1)).unwrap_err().to_string();
    assert!(error.contains("fisheye"), "{error}");
}

#[test]
fn messages_speak_of_numbers_and_not_of_types() {
    for wrong in ["-1", "2.5"] {
        let error = parse(&SMALLEST.replacen("bounces = 4", &format!("bounces = {wrong}"), 1)).unwrap_err().to_string();
        assert!(error.contains("whole number from 0 up") && !error.contains("u32"), "{error}");
    }
}

#[test]
fn a_part_without_a_name_is_called_by_its_file() {
    for (file, name) in [
        ("bunny.obj", "bunny"),
        ("scans/west front.ply", "west front"),
        ("/data/a/temple.v2.ply", "temple.v2"),
        ("scans/*.ply", "scans"),
        ("scans/**/*.ply", "scans"),
        ("*.ply", "*.ply"),
        ("blocks_*.ply", "blocks_*"),
    ] {
        let site = parse(&SMALLEST.replacen("bunny.obj", file, 1)).unwrap();
        assert_eq!(site.parts[0].display_name(), name);
    }
}

/// The place of the line that is `text`, and a column.
fn line_of(whole: &str, text: &str, column: usize) -> (usize, usize) {
    let line = whole.lines().position(|line| line.trim_start().starts_with(text)).expect("the line is there");
    (line + 1, column)
}

#[test]
fn slips_are_told_with_their_place_and_remedy() {
    refused(SMALLEST, "samples =", "sampels =", (12, 1), &["unknown key `sampels`", "did you mean `samples`?"]);
    refused(SMALLEST, "[bake]", "[bkae]", (10, 2), &["unknown key `bkae`", "did you mean `bake`?"]);
    refused(SMALLEST, "\"scan\"", "\"scam\"", (5, 8), &["unknown value `scam`", "did you mean `scan`?"]);
    refused(SMALLEST, "\"scan\"", "\"temple\"", (5, 8), &["write one of: scan, ground, filling, prop"]);
    refused(SMALLEST, "\"lat-long\"", "\"latlong\"", (9, 11), &["did you mean `lat-long`?"]);
    // whatever the capitals, and no guess where two words are as near, or none is near
    refused(FULL, "up = \"z\"", "up = \"Z\"", line_of(FULL, "up = \"z\"", 6), &["did you mean `z`?"]);
    refused(SMALLEST, "[bake]", "[BAKE]", (10, 2), &["did you mean `bake`?"]);
    refused(FULL, "up = \"z\"", "up = \"x\"", line_of(FULL, "up = \"z\"", 6), &["write one of: y, z"]);
    refused(SMALLEST, "[site]", "name = \"x\"\n[site]", (1, 1), &["unknown key `name`", "write one of: site, part, sky"]);
    refused(SMALLEST, "[[part]]", "[part]", (3, 1), &["[part] is one table", "write [[part]], with two brackets"]);
    refused(FULL, "[[room]]", "[ room ]", line_of(FULL, "[[room]]", 1), &["write [[room]], with two brackets"]);
    refused(SMALLEST, "[bake]", "[matte]", (10, 1), &["[matte] is one table", "write [[matte]], with two brackets"]);
    let more = |line: &str| format!("{SMALLEST}[budget]\n{line}\n");
    assert!(parse(&more("bake_mib = 16\nviewer_mib = 300")).unwrap().budget.viewer_bytes() == Some(300 << 20));
    for (line, word) in [("bake_mib = 15", "bake_mib"), ("viewer_mib = 99999999", "viewer_mib"), ("bake_gib = 1", "bake_gib")] {
        let message = parse(&more(line)).unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
}

#[test]
fn values_out_of_range_are_told_with_their_place_and_remedy() {
    refused(SMALLEST, "[0.5, 0.5, 0.5]", "[0.5, 128, 0.5]", (6, 1), &["albedo holds 128", "linear"]);
    refused(SMALLEST, "[0.5, 0.5, 0.5]", "[0.5, nan, 0.5]", (6, 1), &["albedo holds NaN"]);
    refused(SMALLEST, "bounces = 4", "sun_steps = 1025", (11, 13), &["sun_steps is 1025", "from 1 to 1024"]);
    refused(SMALLEST, "bounces = 4", "sun_steps = 0", (11, 13), &["sun_steps is 0"]);
    refused(SMALLEST, "bounces = 4", "order = 3", (11, 9), &["order is 3", "4 coefficients"]);
    refused(SMALLEST, "bounces = 4", "bounces = 65", (11, 11), &["bounces is 65"]);
    refused(SMALLEST, "bounces = 4", "sky_steps = 20000", (11, 13), &["sky_steps is 20000"]);
    refused(SMALLEST, "samples = 1024", "samples = 0", (12, 11), &["samples is 0"]);
    refused(SMALLEST, "bounces = 4", "offset_m = 0.0", (11, 12), &["offset_m is 0"]);
    refused(SMALLEST, "file = \"bunny.obj\"", "file = \" \"", (4, 8), &["file is empty"]);
    refused(SMALLEST, "mapping = \"lat-long\"", "", (8, 10), &["no mapping", "lat-long"]);
    refused(SMALLEST, "probes = \"grey.hdr\"", "", (7, 2), &["neither probes nor a model"]);
    refused(SMALLEST, "mapping", "date = \"2000-01-01\"\nmapping", (9, 8), &["date belongs to a sky model"]);
    refused(SMALLEST, "mapping", "times = [\"07:00\", \"06:00\"]\nmapping", (9, 1), &["06:00 comes after 07:00"]);
    refused(FULL, "latitude_deg = 37.9715", "latitude_deg = 137.9", (3, 16), &["latitude_deg is 137.9", "-90 to 90"]);
    refused(FULL, "longitude_deg = 23.7267", "", (26, 9), &["needs the place"]);
    refused(FULL, "origin = [475000.5", "origin = [inf", (7, 1), &["origin holds inf"]);
    refused(FULL, "scale = -2.0", "scale = 0", (18, 9), &["scale is 0"]);
    refused(FULL, "scale = -2.0", "crease_deg = 181", (18, 14), &["crease_deg is 181", "from 0 to 180"]);
    refused(FULL, "min = [-50, 1, 0]", "min = [-50, 3, 0]", (48, 1), &["min 3 is not below max 2 along y"]);
    refused(FULL, "min = [-50, 1, 0]", "min = [-50, nan, 0]", (48, 1), &["min holds NaN"]);
    refused(FULL, "fov_deg = 40", "fov_deg = 180", (56, 11), &["fov_deg is 180"]);
    let line = |text, column| line_of(FULL, text, column);
    refused(FULL, "dust = 0.5", "dust = 1.5", line("dust = 0.5", 8), &["dust is 1.5", "from 0 to 1"]);
    refused(FULL, "corrosion = 0.75", "corrosion = nan", line("corrosion = 0.75", 13), &["corrosion is NaN"]);
    refused(FULL, "dust_color = [0.4,", "dust_color = [140,", line("dust_color", 1), &["dust_color holds 140", "linear"]);
    refused(FULL, "wind_from_deg = 225", "wind_from_deg = 500", line("wind_from_deg", 17), &["wind_from_deg is 500"]);
    refused(FULL, "wind_m_per_s = 3", "wind_m_per_s = -1", line("wind_m_per_s", 16), &["wind_m_per_s is -1", "from 0 to 40"]);
    let own = |weathering: &str| format!("scale = -2.0\nweathering = {{ {weathering} }}");
    refused(FULL, "scale = -2.0", &own("dust = -0.25"), (19, 23), &["dust is -0.25"]);
    refused(FULL, "scale = -2.0", &own("dirt = 0.25"), (19, 14), &["weathering is false, or a table"]);
    refused(SMALLEST, "role = \"scan\"", "weathering = { dust = 0.1 }", (5, 1), &["no table [weathering]", "empty"]);
    refused(
        FULL,
        "intensity = [3, 2, 1]",
        "intensity = [3, -2, 1]",
        line("intensity", 1),
        &["intensity holds -2", "one metre"],
    );
    refused(FULL, "look_at = [475002, 150,", "look_at = [475002, 151.5,", line("look_at = [475002", 1), &["its own place"]);
    refused(FULL, "angle_deg = 40", "angle_deg = 180", line("angle_deg = 40", 13), &["angle_deg is 180"]);
    refused(FULL, "edge = 0.5", "edge = 2", line("edge = 0.5", 8), &["edge is 2"]);
    refused(FULL, "reach_m = 8", "reach_m = 0", line("reach_m = 8", 11), &["reach_m is 0"]);
    refused(FULL, "weld_m = 0.001", "weld_m = 2", line("weld_m", 10), &["weld_m is 2", "from 0 to 1"]);
    refused(FULL, "nearest_m = 2", "nearest_m = 0", line("nearest_m", 13), &["nearest_m is 0"]);
    refused(FULL, "ring = 2", "ring = 17", line("ring = 2", 8), &["ring is 17"]);
    refused(FULL, "winding = \"report\"", "winding = \"turn\"", line("winding", 11), &["write one of: mend, report"]);
    refused(FULL, "first = 06:57:00", "first = 18:00:00", (35, 9), &["the day begins at 18:00, after its end at 17:34"]);
    refused(FULL, "date = \"-0437-08-01\"", "", (26, 9), &["needs a date"]);
    refused(FULL, "turbidity = 2.5", "probes = \"a.hdr\"", (26, 9), &["both probes and a model"]);
}

#[test]
fn text_that_does_not_parse_is_told_with_its_place() {
    for (from, to, line) in [
        ("\"17:34\"", "\"25:34\"", 36),
        ("date = \"-0437-08-01\"", "date = \"437-08-01\"", 27),
        ("utc_offset = \"+01:34:54\"", "utc_offset = \"two\"", 5),
        ("scale = -2.0", "scale = \"two\"", 18),
        ("scale = -2.0", "scale = ", 18),
        ("albedo = \"marble.png\"", "albedo = [1, 2]", 13),
        ("sun_steps = 46", "sun_steps = -1", 33),
        ("sun_steps = 46", "sun_steps = 46\nsun_steps = 47", 34),
    ] {
        assert!(FULL.contains(from), "{from}");
        let error = parse(&FULL.replacen(from, to, 1)).expect_err(to);
        assert_eq!(error.place.map(|p| p.0), Some(line), "{error}");
    }
    for text in ["", "[site]\nname = \"x\"", "[site]\n[sky]", "\u{0}", "[site", "site = 3"] {
        let error = parse(text).expect_err(text);
        assert!(error.to_string().starts_with("somewhere/site.toml"), "{error}");
    }
    let no_parts = parse("[site]\nname = \"x\"\n[sky]\nprobes = \"a\"\nmapping = \"angular\"").expect_err("no parts");
    assert!(no_parts.to_string().contains("the site has no parts"), "{no_parts}");
}

#[test]
fn files_are_found_sorted_and_missing_ones_told() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("a [site]");
    std::fs::create_dir_all(root.join("temple")).unwrap();
    std::fs::create_dir_all(root.join("sky")).unwrap();
    std::fs::create_dir_all(root.join("people")).unwrap();
    for name in [
        "temple/b.ply",
        "temple/a.ply",
        "temple/.hidden.ply",
        "ground.glb",
        "marble.png",
        "sky/0700.hdr",
        "sky/0600.hdr",
        "people/walker.glb",
        "people/cloth.pc2",
        "people/skin.png",
        "people/guard.obj",
        "people/flag.obj",
        "people/flag.pc2",
    ] {
        std::fs::write(root.join(name), "x").unwrap();
    }
    let text = FULL.replace(
        "model = \"atmosphere\"\ndate = \"-0437-08-01\"\nturbidity = 2.5",
        "probes = \"sky/*.hdr\"\nmapping = \"fisheye\"",
    );
    std::fs::write(root.join("site.toml"), &text).unwrap();
    let site = Site::read(&root).unwrap();
    let names: Vec<_> = site.input_files().unwrap().into_iter().map(|f| f.name).collect();
    assert_eq!(names[..6], ["temple/a.ply", "temple/b.ply", "marble.png", "ground.glb", "sky/0600.hdr", "sky/0700.hdr"]);
    assert_eq!(
        names[6..],
        ["people/walker.glb", "people/cloth.pc2", "people/skin.png", "people/guard.obj", "people/flag.obj", "people/flag.pc2"]
    );
    assert_eq!(Site::read(root.join("site.toml")).unwrap().part_files(0).unwrap().len(), 2);

    let read = |text: String| {
        std::fs::write(root.join("site.toml"), text).unwrap();
        Site::read(&root).expect_err("a file is missing")
    };
    let error = read(text.replace("temple/*.ply", "temples/*.ply"));
    assert_eq!(error.place, Some((10, 8)));
    assert!(error.to_string().contains("nothing matches `temples/*.ply`"), "{error}");
    let error = read(text.replace("ground.glb", "grund.glb"));
    assert_eq!(error.place, Some((22, 8)));
    assert!(error.to_string().contains("there is no file `grund.glb`"), "{error}");
    let error = read(text.replace("marble.png", "temple"));
    assert!(error.to_string().contains("`temple` is a folder"), "{error}");
    let error = read(text.replace("temple/*.ply", "temple/***.ply"));
    assert!(error.to_string().contains("is no pattern"), "{error}");
    std::fs::write(root.join("site.toml"), [0xFF, 0xFE]).unwrap();
    assert!(Site::read(&root).expect_err("not text").to_string().contains("not UTF-8"));
    assert!(Site::read(folder.path()).expect_err("no site").to_string().contains("no such file"));
}

#[test]
fn a_later_stage_can_point_at_a_key() {
    let site = parse(FULL).unwrap();
    assert_eq!(site.error_at(&["part", "1", "file"], "bad", "mend").place, Some((22, 8)));
    assert_eq!(site.error_at(&["part", "1", "albedo"], "bad", "mend").place, Some((21, 1)), "the nearest that is there");
    assert_eq!(site.error_at(&["nowhere"], "bad", "mend").place, None);
}

/// Every key that a table of `site.toml` can have.
#[expect(clippy::unwrap_used, reason = "a helper of tests")]
fn schema_keys() -> Vec<String> {
    let schema: serde_json::Value = serde_json::from_str(&SiteFile::json_schema()).unwrap();
    let tables = schema["$defs"].as_object().unwrap().values().filter_map(|table| table["properties"].as_object());
    let keys: Vec<String> = tables.flat_map(|table| table.keys().cloned()).collect();
    assert!(keys.len() > 30, "{keys:?}");
    keys
}

/// Whether a key is set or stands there as a comment.
fn shows(text: &str, key: &str) -> bool {
    text.lines().any(|line| line.trim_start_matches("# ").starts_with(&format!("{key} = ")))
}

#[test]
fn the_template_says_what_it_was_given() {
    let mut sites = vec![parse(SMALLEST).unwrap().file().clone(), parse(FULL).unwrap().file().clone()];
    let mut series = sites[0].clone();
    series.sky.times = ProbeTimes::List(vec!["06:57".parse().unwrap(), "07:04:30".parse().unwrap()]);
    series.sky.between = Between::Nearest;
    series.sky.mapping = Some(Mapping::Fisheye);
    series.sky.opening_deg = 190.0;
    series.sky.sun_irradiance = Some([1.0, 2.0, 3.5]);
    series.site.name = "with \"quotes\" and a \\".to_owned();
    series.bake.transfer = Transfer::Rgb;
    series.weathering = Some(Weathering { dust: 0.5, wind_from_deg: Some(-30.0), ..Weathering::default() });
    series.parts[0].weathering = Some(PartWeathering::Own(OwnWeathering { corrosion: Some(0.5), ..OwnWeathering::default() }));
    series.rooms.push(Room { name: "r".into(), min: [0.0; 3], max: [1.0; 3], windows: vec![], looks_at: None });
    sites.push(series);
    for site in sites {
        let text = site.to_toml_string();
        let read = parse(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
        assert_eq!(*read.file(), site, "{text}");
        let missing: Vec<String> = schema_keys().into_iter().filter(|key| !shows(&text, key)).collect();
        assert!(missing.is_empty(), "{missing:?} stand nowhere in\n{text}");
        // what stands there as a comment is right too, once uncommented
        let keys = ["# latitude_deg", "# longitude_deg", "# offset_m", "# name", "# first", "# unit", "# samples"];
        let spoken: Vec<String> = text
            .lines()
            .map(|line| if keys.iter().any(|k| line.starts_with(k)) { line[2..].to_owned() } else { line.to_owned() })
            .collect();
        let spoken = spoken.join("\n").split("\n# [[").next().unwrap().to_owned();
        parse(&spoken).unwrap_or_else(|error| panic!("{error}\n{spoken}"));
    }
}

#[test]
fn the_committed_schema_is_current() {
    let path = Path::new("../../schema/site.schema.json");
    let current = SiteFile::json_schema();
    if std::env::var_os("HELIODON_BLESS").is_some() {
        std::fs::write(path, &current).unwrap();
    }
    let committed = std::fs::read_to_string(path).unwrap_or_default();
    assert!(
        committed == current,
        "schema/site.schema.json is old: HELIODON_BLESS=1 cargo test -p heliodon_bundle --test all site::"
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_text_never_panics(cuts in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), "[ -~\n\u{e9}]{0,4}"), 1..5)) {
        let mut text: Vec<char> = FULL.chars().collect();
        for (from, len, new) in &cuts {
            let from = from.index(text.len());
            let end = (from + len.index(12)).min(text.len());
            text.splice(from..end, new.chars());
        }
        let text: String = text.into_iter().collect();
        if let Err(error) = parse(&text) {
            // the place lies within the text
            let lines = text.split('\n').count();
            prop_assert!(error.place.is_none_or(|(line, _)| line <= lines), "{error}");
        }
    }
}
