//! Closed rooms stay dark, however bright it is outside.

use crate::bench::{Bench, light, sun};
use glam::{Quat, Vec3};
use heliodon_lightmap::lights::{Amount, LightSpec, PointSpec};
use heliodon_lightmap::solve::SolveParams;
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
    let t = thickness;
    cuboid(Vec3::new(-2.0, -t, -2.0), Vec3::new(6.0, 0.0, 7.0), 1)
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
