//! Bakes of sites with `[prepare]`: what is drawn, what is not and still casts its shadow, and that it is the same however it was come by.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::Vec3;
use heliodon_bake::bake::{BakeReport, bake};
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bake::prepare::{PrepareReport, estimate, prepare};
use heliodon_bake::report::{Collector, Silent};
use heliodon_bundle::BundleReader;
use heliodon_bundle::site::Site;
use heliodon_image::{HdrImage, SrgbImage};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A room that looks east through a window over a wide ground of two triangles, a finely scanned wall to look at, and a tower in the north-east,
/// beside all that the window shows, between the sun and what it shows.
const SITE: &str = r#"[site]
name = "A tower beside the window"
[[part]]
file = "ground.obj"
role = "ground"
[[part]]
file = "wall.obj"
[[part]]
file = "tower.obj"
[sky]
probes = "sky.hdr"
mapping = "lat-long"
[bake]
samples = 32
bounces = 1
[[room]]
name = "cell"
min = [-0.5, 1.2, -0.5]
max = [0.5, 1.8, 0.5]
windows = [[[2, 0.5, -0.7], [2, 0.5, 0.7], [2, 2.5, -0.7]]]
[display]
width_px = 320
height_px = 240
"#;

const PREPARE: &str = "[prepare]\nwinding = \"report\"\n";

/// A rectangle of `parts` by `parts` quadrilaterals, as OBJ.
fn sheet(corner: Vec3, a: Vec3, b: Vec3, parts: u32) -> String {
    let mut text = String::new();
    for i in 0..=parts {
        for j in 0..=parts {
            let p = corner + a * (i as f32 / parts as f32) + b * (j as f32 / parts as f32);
            text += &format!("v {} {} {}\n", p.x, p.y, p.z);
        }
    }
    let at = |i: u32, j: u32| i * (parts + 1) + j + 1;
    for (i, j) in (0..parts).flat_map(|i| (0..parts).map(move |j| (i, j))) {
        text += &format!("f {} {} {} {}\n", at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
    }
    text
}

fn site(more: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("ground.obj", &sheet(Vec3::new(-20.0, 0.0, -60.0), Vec3::Z * 120.0, Vec3::X * 80.0, 1));
    write("wall.obj", &sheet(Vec3::new(30.0, 0.0, -3.0), Vec3::Z * 6.0, Vec3::Y * 4.0, 120));
    write("tower.obj", &sheet(Vec3::new(18.0, 0.0, -30.0), Vec3::X * 4.0, Vec3::Y * 40.0, 40));
    // the sun stands in the north, half-way up
    let sun = |x: u32, y: u32| (127..129).contains(&x) && (31..33).contains(&y);
    let sky = HdrImage::from_fn(256, 128, |x, y| if sun(x, y) { Vec3::splat(20_000.0) } else { Vec3::ONE });
    sky.write_hdr(folder.path().join("sky.hdr")).unwrap();
    write("site.toml", &(SITE.to_owned() + more));
    folder
}

/// Writes the site without its room.
fn leave_room_out(folder: &Path) {
    let text = fs::read_to_string(folder.join("site.toml")).unwrap();
    let (before, room) = text.split_once("[[room]]").unwrap();
    let (_, after) = room.split_once("[display]").unwrap();
    fs::write(folder.join("site.toml"), format!("{before}[display]{after}")).unwrap();
}

fn prepared(folder: &Path) -> PrepareReport {
    let plan = Plan::new(Site::read(folder).unwrap(), BakeOptions::new(folder.join("bundle"))).unwrap();
    prepare(&plan, plan.site.prepare.as_ref().unwrap(), None, &Silent).unwrap().report
}

fn baked(folder: &Path, bundle: &str) -> (BakeReport, Vec<String>) {
    let heard = Collector::default();
    let plan = Plan::new(Site::read(folder).unwrap(), BakeOptions::new(folder.join(bundle))).unwrap();
    (bake(&plan, &heard).unwrap(), heard.heard().notes)
}

#[test]
fn what_no_eye_sees_is_not_drawn_and_casts_its_shadow() {
    let folder = site(PREPARE);
    let report = prepared(folder.path());
    let [ground, wall, tower] = &report.parts[..] else { panic!("{report}") };
    assert!(ground.triangles_read == 2 && ground.triangles_drawn > 100, "split for its light: {report}");
    assert!(wall.triangles_drawn > 0 && 4 * wall.triangles_drawn < wall.triangles_read, "{report}");
    assert_eq!(tower.triangles_drawn, 0, "beside the window: {report}");
    assert!(tower.triangles_hidden > 0 && tower.triangles_hidden < tower.triangles_read, "{report}");
    assert!(report.purge.as_ref().unwrap().passed && wall.error.unwrap().from_original.max_px < 1.0, "{report}");

    let (bake, _) = baked(folder.path(), "bundle");
    assert_eq!(bake.counts.triangles, report.triangles_drawn);
    let bundle = BundleReader::open(folder.path().join("bundle")).unwrap();
    bundle.verify().unwrap();
    assert_eq!((bundle.manifest().version, bundle.manifest().parts[2].counts.triangles), (2, 0));
    assert!(bundle.manifest().parameters.prepare.is_some());
    // the tower's shadow lies before its foot, 40 m long and 4 m wide
    let (mut shadowed, mut lit) = (0, 0);
    for chunk in (0..bundle.chunk_count()).map(|chunk| bundle.read_chunk(chunk).unwrap()).filter(|chunk| chunk.part == 0) {
        for (v, p) in chunk.positions.iter().enumerate() {
            let beneath = (18.3..21.7).contains(&p.x) && (-28.0..8.0).contains(&p.z);
            let beside = (8.0..17.0).contains(&p.x);
            shadowed += usize::from(beneath);
            lit += usize::from(beside);
            assert!(!(beneath && chunk.light.sun_reaches(v, 0)), "sun at {p}");
            assert!(!beside || chunk.light.sun_reaches(v, 0), "no sun at {p}");
        }
    }
    assert!(shadowed > 3 && lit > 3, "{shadowed} {lit}");
}

#[test]
fn geometry_is_prepared_once_and_a_damaged_piece_again() {
    let folder = site(PREPARE);
    let (_, notes) = baked(folder.path(), "first");
    assert!(!notes.iter().any(|note| note.contains("geometry")), "{notes:?}");
    let (_, notes) = baked(folder.path(), "second");
    assert!(notes.iter().any(|note| note.contains("geometry is prepared")), "{notes:?}");
    let of = |bundle: &str| fs::read(folder.path().join(bundle).join("site.glb")).unwrap();
    assert_eq!(of("first"), of("second"));
    let cache = folder.path().join(".heliodon/cache");
    let folders = fs::read_dir(&cache).unwrap().map(|entry| entry.unwrap().path());
    let piece = folders.map(|folder| folder.join("scene-stands-for-00000")).find(|piece| piece.exists()).unwrap();
    let mut bytes = fs::read(&piece).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(&piece, bytes).unwrap();
    let (_, notes) = baked(folder.path(), "third");
    assert!(!notes.iter().any(|note| note.contains("geometry is prepared")), "{notes:?}");
    assert_eq!(of("first"), of("third"));
}

#[test]
fn what_moves_no_vertex_keeps_the_prepared_geometry() {
    let folder = site(PREPARE);
    let text = fs::read_to_string(folder.path().join("site.toml")).unwrap();
    let is_kept = |wall: &str, more: &str| {
        let wall = format!("file = \"wall.obj\"\n{wall}");
        fs::write(folder.path().join("site.toml"), text.replace("file = \"wall.obj\"\n", &wall) + more).unwrap();
        let plan = Plan::new(Site::read(folder.path()).unwrap(), BakeOptions::new(folder.path().join("bundle"))).unwrap();
        estimate(&plan, plan.site.prepare.as_ref().unwrap(), &Silent).unwrap().kept
    };
    assert!(!is_kept("", ""));
    prepared(folder.path());
    let grey = SrgbImage { width: 64, height: 64, pixels: vec![[128, 128, 128, 255]; 64 * 64] };
    fs::write(folder.path().join("grey.png"), grey.to_png_bytes().unwrap()).unwrap();
    assert!(is_kept("", ""));
    assert!(is_kept("detail = { kind = \"stone\" }\n", "[weathering]\n"));
    assert!(is_kept("detail = { file = \"grey.png\" }\nweathering = false\n", "[weathering]\n"));
    // without an atlas what is left to itself is lit at its vertices, as it says here
    assert!(is_kept("light = \"vertex\"\ntexels = 2\n", ""));
    assert!(!is_kept("light = \"texel\"\n", ""), "not split");
    assert!(!is_kept("scale = 2.0\n", ""));
    fs::write(folder.path().join("wall.obj"), sheet(Vec3::new(30.0, 0.0, -3.0), Vec3::Z * 6.0, Vec3::Y * 4.0, 100)).unwrap();
    assert!(!is_kept("", ""));
}

#[test]
fn what_no_step_of_a_part_reads_leaves_the_parts_as_they_were_prepared() {
    let folder = site(PREPARE);
    prepared(folder.path());
    let text = fs::read_to_string(folder.path().join("site.toml")).unwrap();
    let more = |more: &str| text.replace(PREPARE, &format!("{PREPARE}{more}"));
    for (text, kept) in [
        (more("ring = 3\n"), 3),
        (text.replace("name = \"cell\"", "name = \"cella\"\nlooks_at = [30, 1.5, 0]"), 3),
        (more("triangles = 600000\n"), 2),
        (more("edge_px = 6\n"), 0),
    ] {
        let fresh = site("");
        let [again, whole] = [folder.path(), fresh.path()].map(|folder| {
            fs::write(folder.join("site.toml"), &text).unwrap();
            let heard = Collector::default();
            let plan = Plan::new(Site::read(folder).unwrap(), BakeOptions::new(folder.join("bundle"))).unwrap();
            let scene = prepare(&plan, plan.site.prepare.as_ref().unwrap(), None, &heard).unwrap().scene;
            let original = scene.original.unwrap();
            let made = (scene.mesh.positions, scene.mesh.normals, scene.mesh.triangles);
            ((made, original.positions, original.stands_for, original.clearance_m), heard.heard().notes)
        });
        let told = format!("preparation has read {kept} of 3 parts");
        assert_eq!(again.1.iter().any(|note| note.contains(&told)), kept > 0, "{:?} after {text}", again.1);
        assert!(again.0 == whole.0, "after {text}");
    }
}

#[test]
fn what_is_lit_by_texels_is_not_split() {
    let folder = site(PREPARE);
    let text = fs::read_to_string(folder.path().join("site.toml")).unwrap();
    // the ground by its word, the finely scanned wall left to itself, the tower by its edges of a metre
    let text = text.replace("role = \"ground\"\n", "role = \"ground\"\nlight = \"texel\"\n");
    fs::write(folder.path().join("site.toml"), text.replace("bounces = 1\n", "bounces = 1\ntexels = 256\n")).unwrap();
    let report = prepared(folder.path());
    let [ground, wall, tower] = &report.parts[..] else { panic!("{report}") };
    assert_eq!([ground, wall, tower].map(|part| part.by_texels), [true, false, false], "{report}");
    assert!(ground.split.is_none() && ground.triangles_drawn <= 2, "{report}");
    let (bake, _) = baked(folder.path(), "bundle");
    let bundle = BundleReader::open(folder.path().join("bundle")).unwrap();
    assert_eq!((bundle.manifest().texels.is_some(), bake.counts.triangles), (true, report.triangles_drawn));
    for chunk in (0..bundle.chunk_count()).map(|chunk| bundle.chunk_info(chunk)) {
        assert_eq!(chunk.by_texels, chunk.part == 0, "part {}", chunk.part);
    }
}

#[test]
fn more_is_simplified_until_the_number_fits() {
    let folder = site(&(PREPARE.to_owned() + "edge_px = 2\nerror_px = 0.3\n"));
    let many = prepared(folder.path());
    let folder = site(&format!("{PREPARE}edge_px = 2\nerror_px = 0.3\ntriangles = {}\n", many.triangles_drawn / 3));
    let few = prepared(folder.path());
    let wanted = many.triangles_drawn as f64 / 3.0;
    assert!((0.4 * wanted..1.1 * wanted).contains(&(few.triangles_drawn as f64)), "{} of {wanted}: {few}", few.triangles_drawn);
    let [ground, wall, _] = &few.parts[..] else { panic!("{few}") };
    assert!(ground.edge_px > 1.3 * 2.0 && wall.edge_px < ground.edge_px, "ground gives way first: {few}");
    // what is simplified twice keeps to the limit as well
    for part in &few.parts {
        let error = part.error.unwrap();
        assert!(f64::from(error.from_original.max_px) <= part.error_px, "{few}");
    }
}

#[test]
fn the_error_alone_limits_simplification_where_nothing_is_said_of_edges() {
    let folder = site(&format!("{PREPARE}error_px = 0.5\nedge_px = 0\npurge = false\n"));
    let report = prepared(folder.path());
    let [ground, wall, _] = &report.parts[..] else { panic!("{report}") };
    assert!(ground.split.is_none() && ground.triangles_drawn == 2, "{report}");
    assert!(4 * wall.triangles_drawn < wall.triangles_read && wall.triangles_drawn > 2, "{report}");
    assert!(report.to_string().contains("simplified to 0.50 px of error and edges of 7.5 px"), "{report}");

    let folder = site(&format!("{PREPARE}error_m = 0.02\n"));
    leave_room_out(folder.path());
    let report = prepared(folder.path());
    let [ground, wall, _] = &report.parts[..] else { panic!("{report}") };
    assert!(ground.split.is_none() && ground.triangles_drawn == 2, "{report}");
    assert!(4 * wall.triangles_drawn < wall.triangles_read && wall.triangles_drawn > 200, "{report}");
    assert!(f64::from(wall.error.unwrap().from_original.max_m) <= wall.error_m, "{report}");
    let told = report.to_string();
    for words in ["simplified to 0.0200 m of error and edges of 0.300 m", "off the original by 0.0000 m in the mean"] {
        assert!(told.contains(words) && !told.contains(" px"), "`{words}` in\n{told}");
    }
}

#[test]
fn more_triangles_than_the_site_wants_are_told_with_why() {
    let told = |folder: &TempDir| {
        let heard = Collector::default();
        let plan = Plan::new(Site::read(folder.path()).unwrap(), BakeOptions::new(folder.path().join("bundle"))).unwrap();
        prepare(&plan, plan.site.prepare.as_ref().unwrap(), None, &heard).unwrap();
        heard.heard().warnings.into_iter().filter(|warning| warning.contains("triangles are drawn")).collect::<Vec<_>>()
    };
    let folder = site(&format!("{PREPARE}triangles = 1000\n"));
    assert_eq!(told(&folder), Vec::<String>::new());
    leave_room_out(folder.path());
    let without_room = told(&folder);
    assert!(
        without_room.len() == 1 && without_room[0].contains("[prepare] wants about 1000: without a [[room]]"),
        "{without_room:?}"
    );
    let exact = told(&site(&format!("{PREPARE}triangles = 1000\nerror_px = 0\npurge = false\n")));
    assert!(exact.len() == 1 && exact[0].contains("error_px = 0"), "{exact:?}");
}

#[test]
fn a_scan_that_was_thinned_out_before_is_split_for_its_light() {
    let folder = site(PREPARE);
    fs::write(folder.path().join("wall.obj"), sheet(Vec3::new(30.0, 0.0, -3.0), Vec3::Z * 6.0, Vec3::Y * 4.0, 1)).unwrap();
    let report = prepared(folder.path());
    let wall = &report.parts[1];
    assert!(wall.triangles_read == 2 && wall.triangles_drawn > 50, "{report}");
}

#[test]
fn ground_is_split_to_no_more_than_its_share_is_worth() {
    // without windows all around is seen
    let folder = site(&format!("{PREPARE}triangles = 3000\n"));
    let text = fs::read_to_string(folder.path().join("site.toml")).unwrap();
    let without: Vec<&str> = text.lines().filter(|line| !line.starts_with("windows")).collect();
    fs::write(folder.path().join("site.toml"), without.join("\n")).unwrap();
    let report = prepared(folder.path());
    let ground = &report.parts[0];
    assert!(ground.split.unwrap().triangles_after <= 12_000 && ground.edge_px > 5.0, "{report}");
}

#[test]
fn a_scan_in_the_wrong_unit_is_told_of() {
    let warnings = |more: &str| {
        let folder = site(&(PREPARE.to_owned() + more));
        let at = Vec3::new(0.6, 1.5, 0.0);
        fs::write(folder.path().join("wall.obj"), sheet(at, Vec3::Z * 0.01, Vec3::Y * 0.02, 10)).unwrap();
        let heard = Collector::default();
        let plan = Plan::new(Site::read(folder.path()).unwrap(), BakeOptions::new(folder.path().join("bundle"))).unwrap();
        prepare(&plan, plan.site.prepare.as_ref().unwrap(), None, &heard).unwrap();
        heard.heard().warnings
    };
    let told = warnings("");
    assert!(told.iter().any(|warning| warning.contains("part wall: it is 0.022 m large")), "{told:?}");
    let told = warnings("nearest_m = 0.02\n");
    assert!(!told.iter().any(|warning| warning.contains("m large")), "{told:?}");
}
