//! Sites of several parts that touch: no crack opens between them, and what they bury of each other is not drawn.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::Vec3;
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bake::prepare::{Prepared, prepare};
use heliodon_bake::report::Collector;
use heliodon_bundle::site::Site;
use heliodon_image::HdrImage;
use heliodon_mesh::Mesh;
use heliodon_mesh::topology::{Edges, places};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// An edge by the bits of its ends.
type Edge = [[u32; 3]; 2];

/// A site of these parts, each with what `site.toml` says of it; `more` follows.
fn site(parts: &[(&str, &str, String)], more: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    HdrImage::from_fn(8, 4, |_, _| Vec3::ONE).write_hdr(folder.path().join("sky.hdr")).unwrap();
    for (name, _, obj) in parts {
        fs::write(folder.path().join(format!("{name}.obj")), obj).unwrap();
    }
    let parts: Vec<(&str, &str)> = parts.iter().map(|(name, says, _)| (*name, *says)).collect();
    describe(folder.path(), &parts, more);
    folder
}

fn describe(folder: &Path, parts: &[(&str, &str)], more: &str) {
    let part = |(name, says): &(&str, &str)| format!("[[part]]\nfile = \"{name}.obj\"\n{says}");
    let parts: String = parts.iter().map(part).collect();
    let text = format!("[site]\nname = \"parts\"\n{parts}[sky]\nprobes = \"sky.hdr\"\nmapping = \"lat-long\"\n{more}");
    fs::write(folder.join("site.toml"), text).unwrap();
}

fn prepared(folder: &Path) -> (Prepared, Collector) {
    let heard = Collector::default();
    let plan = Plan::new(Site::read(folder).unwrap(), BakeOptions::new(folder.join("bundle"))).unwrap();
    let made = prepare(&plan, plan.site.prepare.as_ref().unwrap(), None, &heard).unwrap();
    (made, heard)
}

/// Bumpy ground of a square metre from `x` on, as OBJ.
fn tile(x: u32, quads: u32) -> String {
    let mut text = String::new();
    let at = |i: u32| f64::from(i) / f64::from(quads);
    for (i, j) in (0..=quads).flat_map(|i| (0..=quads).map(move |j| (i, j))) {
        let (x, z) = (f64::from(x) + at(i), at(j));
        let y = 0.05 * (9.0 * x).sin() * (7.0 * z).cos() + 0.01 * (61.0 * x).sin() * (47.0 * z).sin();
        text += &format!("v {x} {y} {z}\n");
    }
    let corner = |i: u32, j: u32| i * (quads + 1) + j + 1;
    for (i, j) in (0..quads).flat_map(|i| (0..quads).map(move |j| (i, j))) {
        text += &format!("f {} {} {} {}\n", corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j));
    }
    text
}

/// A box, as OBJ.
fn block(low: Vec3, high: Vec3) -> String {
    let corner = |i: u32| Vec3::select(glam::BVec3::new(i & 1 == 0, i & 2 == 0, i & 4 == 0), low, high);
    let vertices: String = (0..8).map(corner).map(|p| format!("v {} {} {}\n", p.x, p.y, p.z)).collect();
    vertices + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"
}

/// The open edges of a part, drawn or not, of which both ends have this x.
fn border(made: &Prepared, part: usize, x: f32) -> BTreeSet<Edge> {
    let range = &made.scene.parts[part];
    let mesh = &made.scene.mesh;
    let mut edges = BTreeSet::new();
    let triangles = &mesh.triangles[range.triangles.clone()];
    Edges::new(triangles, &places(&mesh.positions, 0.0), |_| true).for_each(|ends, sides| {
        let [a, b] = ends.map(|v| mesh.positions[v as usize]);
        if sides.len() == 1 && a.x == x && b.x == x {
            let [a, b] = [a, b].map(|p| p.to_array().map(f32::to_bits));
            edges.insert([a.min(b), a.max(b)]);
        }
    });
    edges
}

/// All that is drawn, rays meet, and light is solved at.
fn all_of(made: &Prepared) -> impl PartialEq + use<> {
    let Mesh { positions, normals, triangles, .. } = &made.scene.mesh;
    let original = made.scene.original.as_ref().unwrap();
    (
        (positions.clone(), normals.clone(), triangles.clone()),
        (original.positions.clone(), original.triangles.clone()),
        (original.stands_for.clone(), original.clearance_m.clone()),
    )
}

const STRONG: &str = "[prepare]\nerror_m = 0.1\nedge_m = 1.0\n";

#[test]
fn two_tiles_simplified_strongly_keep_their_border() {
    let folder = site(&[("west", "", tile(0, 50)), ("east", "", tile(1, 50))], STRONG);
    let (made, _) = prepared(folder.path());
    let [west, east] = [0, 1].map(|part| border(&made, part, 1.0));
    assert_eq!((west.len(), &west), (50, &east));
    for part in &made.report.parts {
        assert!(part.triangles_drawn * 6 < part.triangles_read, "{}", made.report);
        let borders = part.borders.unwrap();
        assert_eq!((borders.held_places, borders.moved_vertices, borders.split_triangles), (51, 0, 0));
    }
    let told = made.report.to_string();
    assert!(told.contains("borders: 51 places shared with other parts, 51 of them at a rim, held"), "{told}");
    let json = serde_json::to_value(&made.report).unwrap();
    assert_eq!(json["parts"][1]["borders"]["held_places"], 51);
}

#[test]
fn tiles_that_were_placed_apart_meet_within_the_weld_s_reach() {
    let more = format!("{STRONG}weld_m = 0.0001\n");
    let folder = site(&[("west", "", tile(0, 20)), ("east", "translate = [0.00003, 0, 0.00002]\n", tile(1, 20))], &more);
    let (made, _) = prepared(folder.path());
    let [west, east] = [0, 1].map(|part| border(&made, part, 1.0));
    assert_eq!((west.len(), &west), (20, &east));
    assert_eq!([0, 1].map(|part| made.report.parts[part].borders.unwrap().moved_vertices), [0, 21]);
    // what rays meet agrees as well
    let original = made.scene.original.unwrap();
    assert_eq!(original.positions.iter().filter(|p| p.x == 1.0).count(), 42);
}

#[test]
fn the_finer_part_s_border_is_both_s_whatever_their_roles() {
    // ground that gives way where there are too many triangles, and what is lit by texels and hence not split
    let room = "[bake]\ntexels = 64\n[prepare]\ntriangles = 400\npurge = false\n[display]\nwidth_px = 320\nheight_px = 240\n\
                [[room]]\nname = \"above\"\nmin = [0.9, 1.0, 0.4]\nmax = [1.1, 1.1, 0.6]\n";
    for says in ["role = \"ground\"\n", "light = \"texel\"\n"] {
        let folder = site(&[("west", "light = \"vertex\"\n", tile(0, 4)), ("east", says, tile(1, 4))], room);
        let (made, _) = prepared(folder.path());
        let [west, east] = &made.report.parts[..] else { panic!() };
        assert!(east.triangles_original < west.triangles_original / 2, "{says}: {}", made.report);
        assert!(east.borders.unwrap().split_triangles > 0 && west.borders.unwrap().split_triangles == 0, "{}", made.report);
        let [west, east] = [0, 1].map(|part| border(&made, part, 1.0));
        assert!(west.len() >= 32, "{says}: {} edges", west.len());
        assert_eq!(west, east, "{says}");
    }
}

#[test]
fn a_part_is_prepared_again_where_its_border_changes_and_not_where_another_part_moves() {
    let far = |x: u32| format!("translate = [0, {x}, 0]\n");
    let parts = [("west", "", tile(0, 30)), ("east", "", tile(1, 30)), ("block", "", block(Vec3::ONE, Vec3::splat(2.0)))];
    let folder = site(&parts, STRONG);
    let [near, aside] = [String::new(), "translate = [0, 0, 3]\n".to_owned()];
    let mut stages = Vec::new();
    for (east, block) in [(&near, far(5)), (&near, far(6)), (&aside, far(6)), (&near, far(6))] {
        let says = [("west", ""), ("east", east.as_str()), ("block", block.as_str())];
        describe(folder.path(), &says, STRONG);
        let (made, heard) = prepared(folder.path());
        let simplified = heard.heard().stages.iter().filter(|(name, _)| name == "simplifying").count();
        stages.push(simplified);
        let fresh = site(&parts, STRONG);
        describe(fresh.path(), &says, STRONG);
        assert!(all_of(&made) == all_of(&prepared(fresh.path()).0), "{says:?}");
        assert_eq!(border(&made, 0, 1.0) == border(&made, 1, 1.0), east.is_empty());
    }
    // of three parts; the block alone; both tiles, of which one moved; both again
    assert_eq!(stages, [3, 1, 2, 2]);
}

#[test]
fn parts_that_touch_nowhere_are_what_they_are_alone() {
    let aside = "translate = [0, 0, 0.0137]\n";
    let folder = site(&[("west", "", tile(0, 30)), ("east", aside, tile(1, 30))], STRONG);
    let (made, _) = prepared(folder.path());
    assert!(made.report.parts.iter().all(|part| part.borders.is_none() && part.buried.triangles == 0));
    for (index, part) in [("west", "", tile(0, 30)), ("east", aside, tile(1, 30))].into_iter().enumerate() {
        let folder = site(&[part], STRONG);
        let (alone, _) = prepared(folder.path());
        assert!(!alone.report.steps.iter().any(|step| step.name == "comparing borders"));
        let range = made.scene.parts[index].vertices.clone();
        assert!(made.scene.mesh.positions[range.clone()] == alone.scene.mesh.positions);
        assert!(made.scene.mesh.normals[range] == alone.scene.mesh.normals);
    }
}

const FILLING: &str = "role = \"filling\"\n";

#[test]
fn a_wall_between_two_parts_is_not_drawn_without_rooms() {
    let parts = [
        ("left", FILLING, block(Vec3::ZERO, Vec3::ONE)),
        ("right", FILLING, block(Vec3::X, Vec3::new(2.0, 1.0, 1.0))),
        ("far", FILLING, block(Vec3::splat(9.0), Vec3::splat(10.0))),
    ];
    let folder = site(&parts, "[prepare]\n");
    let (made, heard) = prepared(folder.path());
    assert!(made.report.purge.is_none());
    let drawn: Vec<u64> = made.report.parts.iter().map(|part| part.triangles_drawn).collect();
    let hidden: Vec<u64> = made.report.parts.iter().map(|part| part.triangles_hidden).collect();
    assert_eq!((drawn, hidden), (vec![10, 10, 12], vec![2, 2, 0]), "{}", made.report);
    for (range, part) in made.scene.parts.iter().zip(&made.report.parts).take(2) {
        assert!((part.buried.area_m2 - 1.0).abs() < 1e-6);
        let x = |t: usize| made.scene.mesh.corners(t).map(|p| p.x);
        assert!(range.drawn_triangles().all(|t| x(t) != [1.0; 3]));
    }
    // rays meet all of it, and every triangle has one that stands for it
    let original = made.scene.original.as_ref().unwrap();
    assert_eq!((original.triangles.len(), original.stands_for.len()), (36, 36));
    let told = made.report.to_string();
    assert!(
        told.contains("buried in solids of all parts together: 2 triangles (1.000 m2), not drawn, first at (1.000"),
        "{told}"
    );
    assert_eq!(serde_json::to_value(&made.report).unwrap()["parts"][0]["buried"]["triangles"], 2);
    assert_eq!(heard.heard().warnings, Vec::<String>::new());
    // the setting that lets solids be lets these be, too
    let folder = site(&parts, "[prepare]\nsolids = false\n");
    assert_eq!(prepared(folder.path()).0.report.triangles_drawn, 36);
}

#[test]
fn what_stands_in_another_part_s_solid_is_not_drawn() {
    // a ground that runs through a block: what is in it goes, what is outside stays
    let sheet = "v -1 0.5 -1\nv 2 0.5 -1\nv 2 0.5 2\nv -1 0.5 2\nf 1 4 3 2\n".to_owned();
    let parts = [
        ("big", FILLING, block(Vec3::ZERO, Vec3::ONE)),
        ("small", "", block(Vec3::splat(0.3), Vec3::splat(0.4))),
        ("ground", "role = \"ground\"\n", sheet),
    ];
    let folder = site(&parts, "[prepare]\nedge_m = 0.1\n");
    let (made, heard) = prepared(folder.path());
    let [big, small, ground] = &made.report.parts[..] else { panic!() };
    assert_eq!((big.triangles_hidden, small.triangles_drawn), (0, 0), "{}", made.report);
    assert!(ground.buried.area_m2 > 0.6 && ground.buried.area_m2 <= 1.0, "{}", made.report);
    let warnings = heard.heard().warnings;
    let [told] = &warnings[..] else { panic!("{warnings:?}") };
    assert!(told.starts_with("part small: 12 of its 12 triangles lie within solids of other parts"), "{told}");
    // a block around a room is no solid; outside of it what nobody sees goes besides what is buried
    let seen_from = |low: &str, high: &str, purge: bool| {
        let room = format!(
            "purge = {purge}\npurge_effort = \"preview\"\nedge_px = 10\n[display]\nwidth_px = 160\nheight_px = 120\n\
             [[room]]\nname = \"cell\"\nmin = {low}\nmax = {high}\n"
        );
        prepared(site(&parts, &format!("[prepare]\n{room}")).path()).0
    };
    let within = seen_from("[0.4, 0.6, 0.4]", "[0.6, 0.7, 0.6]", false);
    assert!(within.report.parts.iter().all(|part| part.buried.triangles == 0 && part.triangles_hidden == 0));
    let beside = seen_from("[2.5, 1.0, 2.5]", "[2.6, 1.1, 2.6]", true);
    let [big, small, ground] = &beside.report.parts[..] else { panic!() };
    assert!(beside.report.purge.is_some() && big.triangles_drawn > 0, "{}", beside.report);
    assert!(small.triangles_drawn == 0 && small.buried.triangles > 0, "{}", beside.report);
    assert!(ground.buried.triangles > 0 && ground.triangles_drawn > 0, "{}", beside.report);
}

#[test]
fn a_t_junction_in_a_part_is_told() {
    let text = block(Vec3::ZERO, Vec3::ONE).replace("f 1 3 4 2\n", "v 0.5 0 0\nf 9 1 3\nf 9 3 4\nf 9 4 2\n");
    let folder = site(&[("block", "", text.clone())], "[prepare]\n");
    let (made, _) = prepared(folder.path());
    let found = made.report.parts[0].clean.as_ref().unwrap().t_junctions;
    assert_eq!((found.vertices, found.first), (1, Some([0.5, 0.0, 0.0])), "{}", made.report);
    assert_eq!(made.scene.prepared.unwrap().parts[0].found["t_junctions"], 1);
    // of what was modelled it is mended, and the block is a solid
    let folder = site(&[("block", FILLING, text)], "[prepare]\n");
    let (made, _) = prepared(folder.path());
    let clean = made.report.parts[0].clean.as_ref().unwrap();
    assert_eq!((clean.t_junctions_mended.vertices, clean.closed_patches, clean.open.edges), (1, 1, 0), "{}", made.report);
    assert_eq!(made.scene.prepared.unwrap().parts[0].found["t_junctions_mended"], 1);
}

#[test]
fn threads_do_not_matter() {
    let of = |threads: usize| {
        let parts = [
            ("west", "", tile(0, 30)),
            ("east", "", tile(1, 20)),
            ("block", FILLING, block(Vec3::new(1.0, -0.5, 0.0), Vec3::new(1.5, 0.5, 0.5))),
        ];
        let folder = site(&parts, "[prepare]\nerror_m = 0.02\nedge_m = 0.1\n");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (made, _) = pool.install(|| prepared(folder.path()));
        all_of(&made)
    };
    assert!(of(1) == of(4));
}
