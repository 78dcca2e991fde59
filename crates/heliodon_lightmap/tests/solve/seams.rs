//! Charts' borders show the same on both sides.

use crate::bench::{Bench, WHITE, light, sun};
use glam::Vec3;
use heliodon_lightmap::charts::ChartParams;
use heliodon_lightmap::lights::{Amount, LightSpec, PointSpec};
use heliodon_lightmap::packing::PackParams;
use heliodon_lightmap::solve::SolveParams;
use heliodon_lightmap::unwrap::UnwrapParams;
use heliodon_mesh::temple::{self, TempleParams};
use heliodon_mesh::workshop::{WorkshopParams, workshop};
use heliodon_testkit::scenes::{Scene, ball, cuboid, ground};

/// A mesh of hills.
fn hills(parts: u32) -> Scene {
    let mut scene = ground(4.0, parts);
    let height = |p: Vec3| 0.6 * libm::sinf(2.3 * p.x + 0.4) * libm::cosf(1.9 * p.z);
    for i in 0..scene.positions.len() {
        let p = scene.positions[i];
        let slope = |by: Vec3| (height(p + by) - height(p - by)) / (2.0 * by.length());
        scene.normals[i] = Vec3::new(-slope(Vec3::X * 1e-2), 1.0, -slope(Vec3::Z * 1e-2)).normalize_or(Vec3::Y);
        scene.positions[i].y = height(p);
    }
    scene
}

/// The sculptor's workshop: thousands of charts, many of them a texel or two wide, with boards and tiles on one another.
fn studio() -> Scene {
    all_of(workshop(&WorkshopParams::default()).parts.into_iter().map(|part| part.mesh))
}

/// A temple in ruins: drums, blocks that reach into the ground, and eroded ground, of 50,000 triangles.
fn ruins() -> Scene {
    all_of(
        temple::build(&TempleParams { triangles: 50_000, ..TempleParams::default() }).parts.into_iter().map(|part| part.mesh),
    )
}

fn all_of(meshes: impl Iterator<Item = heliodon_mesh::Mesh>) -> Scene {
    let scene =
        |mesh: heliodon_mesh::Mesh| Scene { positions: mesh.positions, normals: mesh.normals, triangles: mesh.triangles };
    meshes.map(scene).fold(Scene::default(), Scene::and)
}

/// An oil lamp, whose bowl has hundreds of times the light that there is elsewhere.
fn oil_lamp(place: [f64; 3]) -> LightSpec {
    LightSpec::Point(PointSpec { name: None, place, colour: [9.0, 5.0, 1.9], amount: Amount::RadiantIntensity(1.0) })
}

/// A scene, and what it is called.
type Named = (&'static str, fn() -> Scene);

/// Scenes with charts of all kinds on the bench, and how they are solved.
pub fn benches() -> impl Iterator<Item = (&'static str, Bench, SolveParams)> {
    let meshes: [Named; 8] = [
        ("ball", || ball(1.0, 32)),
        ("hills", || hills(40)),
        ("balls on a floor", || {
            ball(0.5, 24).moved(Vec3::Y * 0.5).and(ground(4.0, 8)).and(ball(0.3, 16).moved(Vec3::new(1.0, 0.3, 0.2)))
        }),
        ("room with a ball", || {
            cuboid(Vec3::ZERO, Vec3::splat(3.0), 4).inside_out().and(ball(0.7, 24).moved(Vec3::splat(1.2)))
        }),
        // a sharp shadow runs over borders of small charts
        ("tower on tiles", || ground(4.0, 24).and(cuboid(Vec3::new(-0.3, 0.0, -0.3), Vec3::new(0.3, 2.0, 0.3), 1))),
        ("ruins", ruins),
        ("workshop", studio),
        ("workshop with lamps", studio),
    ];
    meshes.into_iter().map(|(name, scene)| {
        let is_workshop = name.starts_with("workshop");
        let side = if is_workshop || name == "ruins" { 384 } else { 256 };
        let scene = scene();
        let (all, longest) = (scene.triangles.len(), if name.ends_with("tiles") { 0.1 } else { 1.0 });
        let charts = ChartParams { longest, ..ChartParams::default() };
        let mut bench = Bench::cut(scene, side, all, charts).under(WHITE).reflecting(0.6);
        bench = if is_workshop { bench } else { bench.lit(sun([0.5, 0.8, 0.3], 0.27, 2.0)) };
        if name.ends_with("lamps") {
            for place in [[-4.9, 1.733, 2.95], [-4.9, 1.733, -2.75], [6.3, 1.743, -3.2]] {
                bench = bench.lit(light(&oil_lamp(place)));
            }
        }
        let (error, samples) = if is_workshop || name == "ruins" { (0.1, 128) } else { (0.02, 2048) };
        (name, bench, SolveParams { bounces: 2, error, samples, ..SolveParams::default() })
    })
}

#[test]
fn shaded_differences_across_borders_are_below_what_eight_bits_show() {
    for (name, bench, params) in benches() {
        let solve = |match_seams: bool| bench.solve(&SolveParams { match_seams, ..params.clone() });
        let (open, closed) = (solve(false), solve(true));
        let notes = &closed.notes;
        // half of a code is what rounding to eight bits hides
        assert!(notes.widest_seam_codes <= 0.5, "{name}: {} codes", notes.widest_seam_codes);
        let [matched, hidden] = notes.seam_places;
        println!("{name}: {} codes, {matched} places matched, {hidden} hidden", notes.widest_seam_codes);
        assert_eq!(open.notes.seam_places, notes.seam_places, "{name}");
        // the ruins' drums and blocks reach into the ground and lie on one another
        let most = if name == "ruins" { matched / 2 } else { matched / 50 };
        assert!(hidden <= most, "{name}: {matched} places are matched, {hidden} hidden");
        let mut bright: Vec<f32> = closed.light.iter().map(|light| light.max_element()).collect();
        bright.sort_by(f32::total_cmp);
        let white = bright[bright.len() * 95 / 100].max(1e-3);
        let moved = open.light.iter().zip(&closed.light).map(|(a, b)| (*a - *b).abs().max_element().min(white));
        let moved = moved.sum::<f32>() / (white * open.light.len() as f32);
        // charts of ruins are a few texels wide: nearly all lie at a border
        let most = if name == "ruins" { 0.05 } else { 0.01 };
        assert!(moved < most, "{name}: texels stay what they were, but for {moved}");
    }
}

#[test]
fn several_textures_show_what_one_does() {
    let scene = || ground(4.0, 4).and(ball(0.6, 16).moved(Vec3::Y * 0.8));
    let of = |sheets: u32| {
        let pack = PackParams { width: 128, height: 128, sheets, ..PackParams::default() };
        let params = UnwrapParams { pack, ..UnwrapParams::default() };
        let bench = Bench::unwrapped(scene(), scene().triangles.len(), params).under(WHITE).reflecting(0.5);
        assert_eq!(bench.unwrapped.packing.sheets, sheets);
        let map = bench.solve(&SolveParams::default());
        assert!(map.notes.seam_places[0] > 0 && map.notes.widest_seam_codes < 0.55, "{:?}", map.notes);
        for sheet in 0..sheets as u16 {
            let image = map.image(&bench.texels, sheet, [128; 2]);
            assert!(image.pixels.iter().all(|p| p.min_element() > 0.05), "what no texel covers is filled");
        }
        let mean = |wanted: fn(Vec3) -> bool| {
            let found = bench.at(&map, |_, normal| wanted(normal));
            found.iter().map(|(_, light)| light.x).sum::<f32>() / found.len() as f32
        };
        [mean(|normal| normal.x > 0.9), mean(|normal| normal.z < -0.9), mean(|normal| normal.y > 0.9)]
    };
    let (one, two) = (of(1), of(2));
    for (one, two) in one.into_iter().zip(two) {
        assert!((one / two - 1.0).abs() < 0.02, "{one} and {two}");
    }
}
