//! Both sides of triangles reflect, though only fronts have texels.

use crate::bench::{Bench, sun};
use glam::Vec3;
use heliodon_lightmap::solve::SolveParams;
use heliodon_testkit::scenes::{Scene, cuboid, ground, rectangle};

/// The light of the ground around a screen that stands upright on it.
fn around(screen: Scene, with_texels: bool) -> Vec<f32> {
    let ground = ground(4.0, 1);
    let scene = ground.and(screen);
    let triangles = if with_texels { scene.triangles.len() } else { 2 };
    let bench = Bench::with_texels_on(scene, 128, triangles).reflecting(0.7).lit(sun([0.5, 1.0, 0.6], 0.0, 3.0));
    let map =
        bench.solve(&SolveParams { bounces: 3, error: 0.01, first_stride: 1, match_seams: false, ..SolveParams::default() });
    // in a net of squares, for charts lie differently
    let mut sums = vec![[0.0_f32; 2]; 64];
    for (p, light) in bench.at(&map, |p, n| n.y > 0.9 && p.y < 1e-3 && p.z.abs() > 0.1) {
        let at = ((p.x + 2.0) * 2.0).clamp(0.0, 7.0) as usize * 8 + ((p.z + 2.0) * 2.0).clamp(0.0, 7.0) as usize;
        sums[at][0] += light.x;
        sums[at][1] += 1.0;
    }
    sums.iter().map(|[sum, count]| sum / count).collect()
}

#[test]
fn a_screen_reflects_alike_with_texels_on_one_side_on_both_or_on_none() {
    let front = rectangle(Vec3::new(-1.0, 0.0, 0.0), Vec3::X * 2.0, Vec3::Y, 1);
    let away = front.clone().inside_out();
    let thick = cuboid(Vec3::new(-1.0, 0.0, -0.004), Vec3::new(1.0, 1.0, 0.004), 1);
    let truth = around(thick, true);
    for (name, found) in [
        ("towards the sun", around(front.clone(), true)),
        ("away from it", around(away, true)),
        ("without texels", around(front, false)),
    ] {
        let mean = truth.iter().sum::<f32>() / 64.0;
        let off: Vec<f32> = truth.iter().zip(&found).map(|(a, b)| (a - b).abs()).collect();
        let (most, sum) = (off.iter().copied().fold(0.0, f32::max), off.iter().sum::<f32>() / 64.0);
        assert!(most < 0.06 * mean && sum < 0.005 * mean, "{name}: {most} and {sum} of {mean}");
    }
}
