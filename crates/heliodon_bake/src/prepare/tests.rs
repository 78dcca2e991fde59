//! Preparation that is broken off within its steps.

use super::*;
use crate::plan::BakeOptions;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Duration;
use tempfile::TempDir;

/// Two sheets of rough ground, which share a row of vertices but for one that stands in the middle of an edge, seen from a room over them.
const SITE: &str = r#"[site]
name = "Rough ground"
latitude_deg = 37.97
longitude_deg = 23.73
utc_offset = "+02:00"
[[part]]
file = "left.ply"
[[part]]
file = "right.ply"
[sky]
model = "atmosphere"
date = "2024-05-01"
[prepare]
[[room]]
name = "above"
min = [-0.5, 1.2, -0.5]
max = [0.5, 1.8, 0.5]
[display]
width_px = 320
height_px = 240
"#;

/// Vertices along a sheet's side.
const SIDE: u32 = 161;

fn sheet(path: PathBuf, begin_x: f32, columns: u32) {
    let height = |x: f32, z: f32| 0.03 * (7.0 * x).sin() * (5.0 * z).cos();
    let place = |i: u32, j: u32| {
        let (x, z) = (begin_x + 4.0 * i as f32 / columns as f32, 8.0 * j as f32 / (SIDE - 1) as f32 - 4.0);
        glam::Vec3::new(x, height(x, z), z)
    };
    let positions = (0..=columns).flat_map(|i| (0..SIDE).map(move |j| place(i, j))).collect();
    let square = |a: u32| [[a, a + 1, a + SIDE], [a + 1, a + SIDE + 1, a + SIDE]];
    let triangles = (0..columns).flat_map(|i| (0..SIDE - 1).flat_map(move |j| square(i * SIDE + j))).collect();
    let mesh = Mesh { positions, triangles, ..Mesh::default() };
    heliodon_mesh::export::write_ply(&path, &mesh, None).unwrap();
}

fn site() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    sheet(folder.path().join("left.ply"), -4.0, 160);
    sheet(folder.path().join("right.ply"), 0.0, 80);
    std::fs::write(folder.path().join("site.toml"), SITE).unwrap();
    folder
}

/// Breaks a run off, as a kill would, once so much of a stage is done; notes what every stage began with.
struct Breaking {
    stage: &'static str,
    at: f64,
    heard: Mutex<Vec<(String, u64, Vec<u64>)>>,
}

impl Breaking {
    fn at(stage: &'static str, at: f64) -> Self {
        Self { stage, at, heard: Mutex::default() }
    }

    /// What was told first of a stage's work, as a part of it.
    fn first(&self, stage: &str) -> f64 {
        let heard = self.heard.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let (_, total, told) = heard.iter().find(|(name, ..)| name == stage).expect("the stage was gone through");
        told.get(1).map_or(1.0, |&first| first as f64 / *total as f64)
    }
}

impl Reporter for Breaking {
    fn stage(&self, name: &str, total: u64) {
        self.heard.lock().unwrap().push((name.to_owned(), total, Vec::new()));
    }
    fn progress(&self, done: u64) {
        let mut heard = self.heard.lock().unwrap();
        let Some((name, total, told)) = heard.last_mut() else { return };
        told.push(done);
        let enough = name == self.stage && done as f64 >= self.at * *total as f64;
        drop(heard);
        assert!(!enough, "broken off");
    }
    fn finished(&self) {}
    fn note(&self, _text: &str) {}
    fn warning(&self, _text: &str) {}
}

fn prepared(plan: &Plan, cache: Option<&Cache>, reporter: &Breaking) -> Prepared {
    let (site, files, settings) = (&plan.site, &plan.files, plan.site.prepare.as_ref().unwrap());
    let parts = (0..site.parts.len()).map(|part| part_digest(plan, settings, part)).collect();
    let mut pieces = Pieces::new(cache, true, reporter);
    (pieces.due, pieces.worth) = (Duration::ZERO, 0);
    let work = Work { plan, site, files, settings, views: views(site), looks: Looks::new(site, None), pieces, parts, reporter };
    // two threads, whatever the machine has: batches of runs are short then
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    pool.install(|| make(&work)).unwrap()
}

fn assert_same(a: &Prepared, b: &Prepared) {
    let (of_a, of_b) = (&a.scene.mesh, &b.scene.mesh);
    assert!(of_a.positions == of_b.positions && of_a.triangles == of_b.triangles && of_a.normals == of_b.normals);
    let (of_a, of_b) = (a.scene.original.as_ref().unwrap(), b.scene.original.as_ref().unwrap());
    assert!(of_a.positions == of_b.positions && of_a.triangles == of_b.triangles);
    assert!(of_a.stands_for == of_b.stands_for && of_a.clearance_m == of_b.clearance_m);
    let told = |prepared: &Prepared| {
        let parts = prepared.report.parts.iter().cloned();
        let timeless = parts.map(|part| PartReport { steps: Vec::new(), ..part });
        serde_json::to_string(&timeless.collect::<Vec<_>>()).unwrap()
    };
    assert_eq!(told(a), told(b));
}

fn plan(folder: &TempDir) -> Plan {
    Plan::new(Site::read(folder.path()).unwrap(), BakeOptions::new(folder.path().join("bundle"))).unwrap()
}

fn cache(plan: &Plan) -> Cache {
    let key = geometry_key(plan, plan.site.prepare.as_ref().unwrap());
    Cache::join(&plan.cache_root(), &key, &plan.owner()).unwrap()
}

/// Each of cleaning's stages is gone through once, however often it is broken off behind one.
#[test]
fn cleaning_goes_on_where_it_was_broken_off() {
    let folder = site();
    let plan = plan(&folder);
    let cache = cache(&plan);
    for (at, first) in [(0.35, 0.0), (0.65, 0.3), (1.0, 0.6)] {
        let breaking = Breaking::at("cleaning", at);
        assert!(catch_unwind(AssertUnwindSafe(|| prepared(&plan, Some(&cache), &breaking))).is_err(), "{at}: not broken off");
        let begun = breaking.first("cleaning");
        assert!(begun > first, "broken off at {at}, it had begun at {begun}");
    }
}

/// Broken off in one step after the other, each time with what was kept within the steps before: all of it comes out as in one go.
#[test]
fn who_is_broken_off_within_a_step_ends_with_the_same() {
    let folder = site();
    let plan = plan(&folder);
    let cache = cache(&plan);
    let whole = prepared(&plan, None, &Breaking::at("", 1.0));
    let borders = whole.report.parts[0].borders.unwrap();
    assert!(borders.shared_places > 0 && whole.report.parts[1].borders.unwrap().held_places > 0, "{borders}");

    let first_kept = |what: &str| {
        let mut stages = cache.stages_in(cache.folder(), PIECE).into_iter();
        let (_, path) = stages.find(|(stage, path)| stage.ends_with(what) && path.to_string_lossy().ends_with("-00000"))?;
        path.metadata().and_then(|data| data.modified()).ok()
    };
    for (stage, at, kept) in [("simplifying", 0.5, "simplifying"), ("measuring", 0.5, "measured"), ("mapping", 0.7, "nearest")]
    {
        let broken_off = || {
            let breaking = Breaking::at(stage, at);
            let run = catch_unwind(AssertUnwindSafe(|| prepared(&plan, Some(&cache), &breaking)));
            assert!(run.is_err(), "{stage} was not broken off");
            first_kept(kept)
        };
        let once = broken_off();
        // two files written at different times do not have the same time
        assert!(once.is_some() && broken_off() == once, "{stage}: what was kept was made again");
    }
    let quiet = Breaking::at("", 1.0);
    let last = prepared(&plan, Some(&cache), &quiet);
    assert_same(&last, &whole);
    assert!(quiet.heard.lock().unwrap().iter().all(|(name, ..)| name != "cleaning" && name != "comparing borders"));
    // nothing of what was on the way is left
    let left = cache.stages_in(cache.folder(), PIECE);
    let on_the_way = |stage: &str| ["halfway", "simplifying", "measured", "nearest"].iter().any(|name| stage.contains(name));
    assert!(left.iter().all(|(stage, _)| !on_the_way(stage)), "{left:?}");
}
