//! Charts' borders show the same on both sides.

use crate::bench::{Bench, WHITE, sun};
use glam::Vec3;
use heliodon_lightmap::solve::SolveParams;
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

#[test]
fn shaded_differences_across_borders_are_below_what_eight_bits_show() {
    let meshes = [
        ("ball", ball(1.0, 32)),
        ("hills", hills(40)),
        (
            "balls on a floor",
            ball(0.5, 24).moved(Vec3::Y * 0.5).and(ground(4.0, 8)).and(ball(0.3, 16).moved(Vec3::new(1.0, 0.3, 0.2))),
        ),
        ("room with a ball", cuboid(Vec3::ZERO, Vec3::splat(3.0), 4).inside_out().and(ball(0.7, 24).moved(Vec3::splat(1.2)))),
    ];
    for (name, scene) in meshes {
        let bench = Bench::new(scene, 256).under(WHITE).reflecting(0.6).lit(sun([0.5, 0.8, 0.3], 0.27, 2.0));
        let solve = |match_seams: bool| bench.solve(&SolveParams { bounces: 2, match_seams, ..SolveParams::default() });
        let (open, closed) = (solve(false), solve(true));
        let mut bright: Vec<f32> = closed.light.iter().map(|light| light.max_element()).collect();
        bright.sort_by(f32::total_cmp);
        let white = bright[bright.len() * 95 / 100].max(1e-3);
        assert!(closed.notes.widest_seam < white / 255.0, "{name}: {} of {white}", closed.notes.widest_seam);
        let moved = open.light.iter().zip(&closed.light).map(|(a, b)| (*a - *b).abs().max_element());
        assert!(moved.sum::<f32>() < 0.01 * white * open.light.len() as f32, "{name}: texels stay what they were");
    }
}
