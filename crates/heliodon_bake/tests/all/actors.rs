//! Bakes of sites with actors: what the bundle holds, and that it holds the same however it was come by.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::Vec3;
use heliodon_bake::bake::{BakeReport, bake};
use heliodon_bake::check::check;
use heliodon_bake::estimate::estimate;
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bake::report::{Collector, Silent};
use heliodon_bundle::inspect::{BundleSummary, SiteSummary};
use heliodon_bundle::moment::{Blend, Day};
use heliodon_bundle::site::{Albedo, Ground, Site, Walk};
use heliodon_bundle::{BundleReader, Manifest};
use heliodon_image::{HdrImage, SrgbImage};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A ground of 40 m with a roof over its western half, 3 m up; the sun of the one image that is its sky stands high in the north, along
/// the roof's edge.
struct TestSite {
    folder: TempDir,
}

const SITE: &str = r#"[site]
name = "Half a roof"
origin = [100, 0, 0]
[[part]]
file = "ground.obj"
role = "ground"
[[part]]
file = "roof.obj"
[sky]
probes = "sky.hdr"
mapping = "lat-long"
[bake]
samples = 64
bounces = 1
"#;

const ACTORS: &str = r#"
[[room]]
name = "east"
min = [4, 1.2, -1]
max = [6, 1.8, 1]
[[actor]]
file = "people/walker.obj"
cache = "people/cloth.pc2"
path = [[94, 0, 0], [106, 0, 0]]
walk = "back-and-forth"
[[actor]]
name = "guard"
file = "people/guard.gltf"
animation = "breathe"
place = [95, 0, 3]
albedo = "skin.png"
"#;

/// An upright slab between two corners, as OBJ.
fn slab(low: Vec3, high: Vec3) -> String {
    let mut text = String::new();
    for corner in 0..8 {
        let at = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
        text += &format!("v {} {} {}\n", at(0), at(1), at(2));
    }
    for [a, b, c, d] in [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]] {
        text += &format!("f {a} {b} {c} {d}\n");
    }
    text
}

/// A vertex cache of one sample, in which all points are at zero.
fn cloth(points: u32) -> Vec<u8> {
    let header =
        [&b"POINTCACHE2\0"[..], &1_u32.to_le_bytes(), &points.to_le_bytes(), &0_f32.to_le_bytes(), &1_f32.to_le_bytes()];
    [header.concat(), 1_u32.to_le_bytes().to_vec(), vec![0; 12 * points as usize]].concat()
}

impl TestSite {
    fn new(more: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        fs::create_dir_all(root.join("people/maps")).unwrap();
        let write = |name: &str, text: &str| fs::write(root.join(name), text).unwrap();
        write("ground.obj", &slab(Vec3::new(80.0, -1.0, -20.0), Vec3::new(120.0, 0.0, 20.0)));
        write("roof.obj", &slab(Vec3::new(80.0, 3.0, -20.0), Vec3::new(100.0, 3.2, 20.0)));
        let sun = |x: u32, y: u32| (127..129).contains(&x) && (42..44).contains(&y);
        let sky = HdrImage::from_fn(256, 128, |x, y| if sun(x, y) { Vec3::splat(20_000.0) } else { Vec3::ONE });
        sky.write_hdr(root.join("sky.hdr")).unwrap();
        let person = slab(Vec3::new(-0.2, 0.0, -0.1), Vec3::new(0.2, 1.8, 0.1));
        write("people/walker.obj", &format!("mtllib walker.mtl\nusemtl skin\n{person}"));
        write("people/walker.mtl", "newmtl skin\nmap_Kd maps/skin.png\n");
        fs::write(root.join("people/cloth.pc2"), cloth(8)).unwrap();
        let skin = SrgbImage::filled(2, 2, [200, 150, 120, 255]).to_png_bytes().unwrap();
        fs::write(root.join("people/maps/skin.png"), &skin).unwrap();
        fs::write(root.join("skin.png"), &skin).unwrap();
        // a triangle, then the one time and the one place of its clip
        let numbers: [f32; 13] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        fs::write(root.join("people/guard.bin"), bytes).unwrap();
        write(
            "people/guard.gltf",
            r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
                "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
                "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
                    {"bufferView":0,"byteOffset":36,"componentType":5126,"count":1,"type":"SCALAR","min":[0],"max":[0]},
                    {"bufferView":0,"byteOffset":40,"componentType":5126,"count":1,"type":"VEC3"}],
                "bufferViews":[{"buffer":0,"byteLength":52}],"buffers":[{"uri":"guard.bin","byteLength":52}],
                "animations":[{"name":"breathe","channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}],
                    "samplers":[{"input":1,"output":2}]}]}"#,
        );
        write("site.toml", &(SITE.to_owned() + more));
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn plan(&self, bundle: &str, options: impl Fn(BakeOptions) -> BakeOptions) -> Plan {
        let options = options(BakeOptions::new(self.path(bundle)));
        Plan::new(Site::read(self.folder.path()).unwrap(), options).unwrap()
    }

    fn bake(&self, bundle: &str) -> BakeReport {
        bake(&self.plan(bundle, |options| options), &Silent).unwrap()
    }
}

/// All files of a bundle with their bytes.
fn contents(bundle: &Path) -> Vec<(String, Vec<u8>)> {
    let manifest: Manifest = serde_json::from_slice(&fs::read(bundle.join("manifest.json")).unwrap()).unwrap();
    let names = manifest.files.iter().map(|file| file.path.as_str()).chain(["manifest.json"]);
    names.map(|name| (name.to_owned(), fs::read(bundle.join(name)).unwrap())).collect()
}

#[test]
fn a_figure_that_walks_under_the_roof_darkens() {
    let site = TestSite::new(ACTORS);
    let report = site.bake("bundle");
    let bundle = BundleReader::open(site.path("bundle")).unwrap();
    bundle.verify().unwrap();
    assert_eq!(bundle.manifest().version, 2);
    let grid = bundle.read_grid().unwrap().unwrap();
    assert_eq!(report.measures["grid_points"], grid.point_count() as f64);
    let moment = Day::new(bundle.lapse()).at(12.0 * 3600.0, Blend::Smooth);
    let at = |x: f32| grid.light_at(&moment, Vec3::new(x, 1.0, 0.0)).unwrap();
    let (shade, open) = (at(-5.0), at(5.0));
    assert_eq!((shade.sun_visible, open.sun_visible), (0.0, 1.0));
    assert!(moment.shading.sun_irradiance.x > 0.1, "{moment:?}");
    let up = |cube: &heliodon_bundle::AmbientCube| cube.light(&moment, Vec3::Y).x;
    assert!(up(&open) > 10.0 * up(&shade), "{} {}", up(&open), up(&shade));
    assert!(shade.sky_and_bounce[3].x > 0.0 && open.sky_and_bounce[3].x > shade.sky_and_bounce[3].x, "from the ground");
    let visible: Vec<f32> = (-30..30).map(|i| at(i as f32 * 0.1).sun_visible).collect();
    assert!(visible.is_sorted() && visible[0] == 0.0 && visible[59] == 1.0, "{visible:?}");
    assert!(visible.iter().any(|part| (0.2..0.8).contains(part)), "the edge is not harder than the grid");
    // the room goes down to the ground; far off there is nothing
    assert!(grid.sample(Vec3::new(5.0, 0.1, 0.9)).is_some());
    assert!(grid.sample(Vec3::new(0.0, 1.0, 15.0)).is_none() && grid.sample(Vec3::NAN).is_none());
    assert!(grid.points().valid.contains(&0), "below the ground");
}

#[test]
fn the_actors_files_go_with_the_bundle() {
    let site = TestSite::new(ACTORS);
    site.bake("bundle");
    let bundle = BundleReader::open(site.path("bundle")).unwrap();
    let [walker, guard] = bundle.actors() else { panic!("{:?}", bundle.actors()) };
    assert_eq!((walker.display_name(), walker.file.as_str()), ("walker", "actors/walker/walker.obj"));
    assert_eq!((walker.cache.as_deref(), walker.walk), (Some("actors/walker/cloth.pc2"), Walk::BackAndForth));
    assert_eq!(walker.stations(), [[-6.0, 0.0, 0.0], [6.0, 0.0, 0.0]], "in the space of site.glb");
    assert_eq!((guard.display_name(), guard.animation.as_deref()), ("guard", Some("breathe")));
    assert_eq!(
        (guard.place, &guard.albedo),
        (Some([-5.0, 0.0, 3.0]), &Some(Albedo::Image("actors/guard/skin.png".to_owned())))
    );
    for (copy, original) in [
        ("actors/walker/walker.obj", "people/walker.obj"),
        ("actors/walker/walker.mtl", "people/walker.mtl"),
        ("actors/walker/maps/skin.png", "people/maps/skin.png"),
        ("actors/walker/cloth.pc2", "people/cloth.pc2"),
        ("actors/guard/guard.gltf", "people/guard.gltf"),
        ("actors/guard/guard.bin", "people/guard.bin"),
        ("actors/guard/skin.png", "skin.png"),
    ] {
        assert_eq!(fs::read(site.path("bundle").join(copy)).unwrap(), fs::read(site.path(original)).unwrap(), "{copy}");
    }
    let mesh =
        heliodon_mesh::import::read(&site.path("bundle").join(&walker.file), &heliodon_mesh::import::ImportOptions::default())
            .unwrap();
    assert!(mesh.materials[0].texture.is_some(), "the copy finds its texture");
    let told = BundleSummary::of(&bundle).to_string();
    assert!(told.contains("actor walker (actors/walker/walker.obj): walks 12.0 m over 2 points"), "{told}");
    assert!(told.contains("actor guard (actors/guard/guard.gltf, breathe): stands at -5.00, 0.00, 3.00"), "{told}");
    assert!(told.contains("light grid: ") && told.contains(" points 0.5 m apart ("), "{told}");

    // up to date until a texture changes that nothing in site.toml names
    assert!(site.bake("bundle").up_to_date);
    let skin = SrgbImage::filled(2, 2, [1, 2, 3, 255]).to_png_bytes().unwrap();
    fs::write(site.path("people/maps/skin.png"), &skin).unwrap();
    assert!(!site.bake("bundle").up_to_date);
    assert_eq!(fs::read(site.path("bundle/actors/walker/maps/skin.png")).unwrap(), skin);
}

#[test]
fn the_vertices_light_is_that_of_a_site_without_actors() {
    let (with, without) = (TestSite::new(ACTORS), TestSite::new(""));
    with.bake("bundle");
    without.bake("bundle");
    let file = |site: &TestSite, name: &str| fs::read(site.path("bundle").join(name)).unwrap();
    for name in ["site.glb", "lapse.json"] {
        assert!(file(&with, name) == file(&without, name), "{name}");
    }
    let bundle = BundleReader::open(without.path("bundle")).unwrap();
    assert!(bundle.manifest().version == 1 && bundle.read_grid().unwrap().is_none() && bundle.actors().is_empty());
    assert!(!without.path("bundle/grid.glb").exists() && !without.path("bundle/actors").exists());
}

#[test]
fn the_same_bytes_for_any_number_of_threads_and_after_an_interruption() {
    let site = TestSite::new(ACTORS);
    let plan = site.plan("bundle", |options| options);
    bake(&plan, &Silent).unwrap();
    let whole = contents(&site.path("bundle"));
    let kept = |starts: &str, ends: &str| -> Vec<PathBuf> {
        let folders = fs::read_dir(plan.cache_root()).unwrap().flatten();
        let files = folders.flat_map(|folder| fs::read_dir(folder.path()).unwrap().flatten()).map(|file| file.path());
        let named = |path: &PathBuf| {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            name.starts_with(starts) && name.contains(ends)
        };
        files.filter(named).collect()
    };
    let again = |notes: &[&str]| {
        let reporter = Collector::default();
        bake(&site.plan("bundle", |options| BakeOptions { again: true, ..options }), &reporter).unwrap();
        assert!(contents(&site.path("bundle")) == whole);
        let heard = reporter.heard().notes.join("\n");
        for note in notes {
            assert!(heard.contains(note), "{note} is not in\n{heard}");
        }
    };
    again(&["the light is solved"]);
    // killed after the points in space had been gathered
    for path in kept("grid-", "light").into_iter().chain(kept("grid-", "masks")) {
        fs::remove_file(path).unwrap();
    }
    again(&["of sky transfer are done", "blocks of light of space are done"]);
    // and while they were
    fs::write(&kept("grid-", "gather")[0], b"cut").unwrap();
    fs::remove_file(&kept("grid-", "light")[0]).unwrap();
    again(&["of sky transfer are done", "of light of space was damaged", "of sun in space are done"]);
    // another room changes no block of the vertices
    let text = fs::read_to_string(site.path("site.toml")).unwrap();
    fs::write(site.path("site.toml"), text.replace("max = [6, 1.8, 1]", "max = [6, 1.8, 4]")).unwrap();
    let reporter = Collector::default();
    bake(&site.plan("bundle", |options| options), &reporter).unwrap();
    let heard = reporter.heard().notes.join("\n");
    assert!(heard.contains("of sky transfer are done") && !heard.contains("of light of space"), "{heard}");
    assert!(contents(&site.path("bundle")) != whole);
    fs::write(site.path("site.toml"), text).unwrap();

    let single = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let anew = site.plan("single", |options| BakeOptions { no_cache: true, ..options });
    single.install(|| bake(&anew, &Silent).unwrap());
    assert!(contents(&site.path("single")) == whole);
}

#[test]
fn who_is_off_the_ground_is_told_by_check_and_by_the_bake() {
    let site =
        TestSite::new(&ACTORS.replace("[106, 0, 0]]", "[106, 1, 0]]").replace("place = [95, 0, 3]", "place = [95, -0.7, 3]"));
    let mut told = check(&Site::read(site.folder.path()).unwrap(), &Silent).unwrap().warnings;
    told.retain(|line| line.starts_with("actor "));
    let [walker, guard, stone] = &told[..] else { panic!("{told:?}") };
    assert!(walker.starts_with("actor walker: its lowest point is above the ground along 10."), "{walker}");
    assert!(walker.contains("see metre 12.0 (106.00, 1.00, 0.00): by 1.00 m, for the ground there is at y = 0.00"), "{walker}");
    assert!(
        guard.starts_with("actor guard: its lowest point is below the ground at its place 95.00, -0.70, 3.00: by 0.70 m"),
        "{guard}"
    );
    assert!(stone.starts_with("actor guard: it is within stone at half its height at its place 95.00, -0.70, 3.00"), "{stone}");
    let heard = Collector::default();
    let report = bake(&site.plan("bundle", |options| options), &heard).unwrap();
    assert!(told.iter().all(|line| report.warnings.contains(line)) && report.warnings == heard.heard().warnings);
}

#[test]
fn who_follows_the_ground_is_on_it_in_the_bundle() {
    let follow = ACTORS
        .replace("[94, 0, 0], [106, 0, 0]]", "[94, 0.7, 0], [106, -0.4, 0]]\nground = \"follow\"\ncache_frames_per_s = 30");
    let (site, flat) = (TestSite::new(&follow), TestSite::new(ACTORS));
    assert_eq!(site.bake("bundle").warnings, flat.bake("bundle").warnings);
    let bundle = BundleReader::open(site.path("bundle")).unwrap();
    let walker = &bundle.actors()[0];
    assert_eq!((walker.ground, walker.cache_frames_per_s), (Ground::Check, Some(30.0)));
    let stations = walker.stations();
    assert!(stations.len() == 2 && stations.iter().all(|at| at[1].abs() < 1e-6), "{stations:?}");
    // its light is baked where it goes, not where it was said to
    let grid =
        |site: &TestSite| BundleReader::open(site.path("bundle")).unwrap().read_grid().unwrap().unwrap().points().cells.clone();
    assert_eq!(grid(&site), grid(&flat));
}

#[test]
fn what_a_bake_stops_at_is_told_beforehand() {
    let fault = |from: &str, to: &str| {
        let site = TestSite::new(&ACTORS.replace(from, to));
        let plan = Site::read(site.folder.path()).map(|site| Plan::new(site, BakeOptions::new("bundle")));
        match plan {
            Ok(plan) => {
                let by_check = check(&Site::read(site.folder.path()).unwrap(), &Silent).unwrap_err().to_string();
                let by_bake = plan.unwrap_err().to_string();
                assert_eq!(by_check, by_bake);
                by_bake
            }
            Err(error) => error.to_string(),
        }
    };
    let error = fault("\"breathe\"", "\"walk\"");
    assert!(error.contains("site.toml:28:13: people/guard.gltf has no animation `walk`; it has breathe"), "{error}");
    let error = fault("cloth.pc2", "cape.pc2");
    assert!(error.contains("site.toml:22:9: there is no file `people/cape.pc2`"), "{error}");
    let error = fault("people/walker.obj", "people/cloth.pc2");
    assert!(error.contains("cloth.pc2"), "{error}");
    // a cache that opens, and one that is of this mesh
    let error = fault("people/cloth.pc2", "people/guard.bin");
    assert!(error.contains("guard.bin") && error.contains("is no PointCache2 file"), "{error}");
    let error = fault("\"people/guard.gltf\"", "\"people/guard.gltf\"\ncache = \"people/cloth.pc2\"");
    assert!(error.contains("cloth.pc2") && error.contains("has 8 points, but the mesh has 3 vertices"), "{error}");
    let error = fault("max = [6, 1.8, 1]", "max = [600, 180, 100]");
    assert!(error.contains("site.toml:18:1: this room needs") && error.contains("grid_m = 1 or more"), "{error}");

    let site = TestSite::new(ACTORS);
    let read = Site::read(site.folder.path()).unwrap();
    let report = check(&read, &Silent).unwrap();
    assert_eq!(report.actors, ["walker", "guard"]);
    let told = SiteSummary::of(&read).unwrap().to_string();
    assert!(told.contains("actor guard (people/guard.gltf, breathe): stands at 95.00, 0.00, 3.00"), "{told}");
    let estimated = estimate(&site.plan("bundle", |options| options), &Silent).unwrap();
    assert!(estimated.grid_points > 500 && estimated.grid_points <= report.grid_points);
    let baked = site.bake("bundle");
    assert_eq!(baked.measures["grid_points"], estimated.grid_points as f64);
}
