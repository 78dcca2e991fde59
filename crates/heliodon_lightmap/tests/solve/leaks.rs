//! Closed rooms stay dark, however bright it is outside.

use crate::bench::{Bench, light, sun};
use glam::{Quat, Vec3};
use heliodon_lightmap::charts::ChartParams;
use heliodon_lightmap::lights::{Amount, LightSpec, PointSpec};
use heliodon_lightmap::solve::{LightMap, SolveParams};
use heliodon_math::dome::ConstantSky;
use heliodon_testkit::scenes::{Scene, cuboid};

/// One shell that faces inwards.
fn shell() -> Scene {
    cuboid(Vec3::ZERO, Vec3::new(4.0, 3.0, 5.0), 2).inside_out()
}

/// Walls with a thickness, and shells on both sides.
fn walls(thickness: f32) -> Scene {
    let by = Vec3::splat(thickness);
    shell().and(cuboid(-by, Vec3::new(4.0, 3.0, 5.0) + by, 2))
}

/// Six slabs that touch and reach into each other, on a floor that goes on outside.
fn slabs(thickness: f32) -> Scene {
    slabs_on_floor(thickness, 1)
}

/// The same, the floor of so many squares a side.
fn slabs_on_floor(thickness: f32, parts: u32) -> Scene {
    let t = thickness;
    cuboid(Vec3::new(-2.0, -t, -2.0), Vec3::new(6.0, 0.0, 7.0), parts)
        .and(cuboid(Vec3::new(-t, 0.0, -t), Vec3::new(0.0, 3.0, 5.0 + t), 1))
        .and(cuboid(Vec3::new(4.0, 0.0, -t), Vec3::new(4.0 + t, 3.0, 5.0 + t), 1))
        .and(cuboid(Vec3::new(-0.5 * t, -0.5 * t, -t), Vec3::new(4.0 + 0.5 * t, 3.0 + 0.5 * t, 0.0), 1))
        .and(cuboid(Vec3::new(0.0, 0.0, 5.0), Vec3::new(4.0, 3.0, 5.0 + t), 1))
        .and(cuboid(Vec3::new(-2.0 * t, 3.0, -2.0 * t), Vec3::new(4.0 + 2.0 * t, 3.0 + t, 5.0 + 2.0 * t), 1))
}

#[test]
fn no_light_comes_into_a_closed_room() {
    let turns = [Quat::IDENTITY, Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.7, 0.2)];
    let scenes = [("shell", shell()), ("walls", walls(0.2)), ("thin walls", walls(0.05)), ("slabs", slabs(0.3))];
    for (name, scene) in scenes {
        for (turn, away) in turns.iter().flat_map(|&turn| [Vec3::ZERO, Vec3::new(800.0, 20.0, -300.0)].map(|away| (turn, away)))
        {
            let mut placed = scene.clone();
            placed.positions.iter_mut().for_each(|p| *p = turn * *p + away);
            placed.normals.iter_mut().for_each(|n| *n = turn * *n);
            let place = (turn * Vec3::new(2.0, 8.0, 2.0) + away).as_dvec3().to_array();
            let amount = Amount::RadiantIntensity(1.0e6);
            let bench = Bench::new(placed, 192)
                .under(ConstantSky(Vec3::splat(1000.0)))
                .reflecting(0.9)
                .lit(sun([0.3, 1.0, 0.2], 0.27, 1.0e5))
                .lit(light(&LightSpec::Point(PointSpec { name: None, place, colour: [1.0; 3], amount })));
            let map = bench.solve(&SolveParams {
                bounces: 3,
                error: 0.05,
                samples: 512,
                light_samples: 64,
                ..SolveParams::default()
            });
            let within = |p: Vec3| {
                let p = turn.inverse() * (p - away);
                p.cmpge(Vec3::splat(-0.01)).all() && p.cmple(Vec3::new(4.0, 3.0, 5.0) + 0.01).all()
            };
            // towards the middle of the room
            let inwards = |p: Vec3, n: Vec3| (turn * Vec3::new(2.0, 1.5, 2.5) + away - p).dot(n) > 0.1;
            let (mut brightest, mut lit) = (0.0_f32, 0);
            for (p, light) in bench.at(&map, |p, n| within(p) && inwards(p, n)) {
                if light.max_element() > 0.0 {
                    (brightest, lit) = (brightest.max(light.max_element()), lit + 1);
                    if lit < 5 {
                        println!("{} has {light}", turn.inverse() * (p - away));
                    }
                }
            }
            assert_eq!(brightest, 0.0, "{name} {turn} {away}: {lit} texels");
        }
    }
}

/// Bright days around a room.
fn bright(bench: Bench, first_stride: u32) -> (Bench, LightMap) {
    let bench = bench.under(ConstantSky(Vec3::splat(1000.0))).reflecting(0.9).lit(sun([0.3, 1.0, 0.2], 0.27, 1.0e5));
    let params =
        SolveParams { bounces: 3, error: 0.05, samples: 512, light_samples: 64, first_stride, ..SolveParams::default() };
    let map = bench.solve(&params);
    (bench, map)
}

/// The brightest that filtering shows within a room whose walls' inner sides lie at the sides of `shell`, of its floor and ceiling, and of the ground around it.
pub fn inside_and_outside(bench: &Bench, map: &LightMap) -> (f32, f32) {
    let is_inside = |p: Vec3| p.x > 2e-3 && p.x < 3.998 && p.z > 2e-3 && p.z < 4.998 && (p.y == 0.0 || p.y == 3.0);
    let is_outside = |p: Vec3| p.x < -0.4 && p.y == 0.0;
    let all = bench.filtered(map);
    let brightest = |wanted: &dyn Fn(Vec3) -> bool| {
        let wanted: Vec<f32> = all.iter().filter(|(p, _)| wanted(*p)).map(|(_, light)| light.max_element()).collect();
        assert!(wanted.len() > 1000, "{} places", wanted.len());
        wanted.iter().copied().fold(0.0, f32::max)
    };
    (brightest(&is_inside), brightest(&is_outside))
}

/// Rooms of slabs on a floor of small charts, which lies outside as well, with walls of a thickness and textures of a side.
fn on_small_charts(thickness: f32, side: u32, longest: f32) -> (Bench, LightMap) {
    let scene = slabs_on_floor(thickness, 9);
    let all = scene.triangles.len();
    bright(Bench::cut(scene, side, all, ChartParams { longest, ..ChartParams::default() }), 8)
}

/// Some that are entirely dark.
pub fn dark_rooms() -> impl Iterator<Item = (Bench, LightMap)> {
    [(192, 0.12), (128, 0.06)].into_iter().map(|(side, longest)| on_small_charts(0.3, side, longest))
}

#[test]
fn seams_of_a_floor_under_walls_bring_no_light_into_a_room() {
    // in the third a corner sees a little of the day, matched or not
    for (thickness, side, longest, most) in
        [(0.3, 192, 0.12, 0.0), (0.3, 128, 0.06, 0.0), (0.2, 192, 0.06, 1.0e-6), (0.2, 256, 0.12, 0.0)]
    {
        let (bench, map) = on_small_charts(thickness, side, longest);
        assert!(bench.unwrapped.charts.len() > 40, "{} charts", bench.unwrapped.charts.len());
        let (inside, outside) = inside_and_outside(&bench, &map);
        assert!(inside <= most * outside && outside > 1000.0, "{thickness} {side} {longest}: {inside} of {outside}");
    }
}

#[test]
fn walls_thinner_than_a_texel_keep_a_room_dark() {
    for (side, first_stride) in [(96, 1), (192, 1), (96, 8), (192, 8)] {
        let (bench, map) = bright(Bench::new(slabs(0.05), side), first_stride);
        assert!(1.0 / bench.unwrapped.packing.per_m > 0.08, "texels are larger than walls");
        assert!(map.notes.parted > 100, "{:?}", map.notes);
        let (inside, outside) = inside_and_outside(&bench, &map);
        // between samples further apart, light is told as exactly as was asked for beside that of the day
        let most = if first_stride == 1 { 0.0 } else { 1.0e-3 * outside };
        assert!(inside <= most && outside > 1000.0, "{side}, {first_stride}: {inside} of {outside}");
    }
}
