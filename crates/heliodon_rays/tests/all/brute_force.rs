//! Every question against a plain loop over all triangles.

use crate::common::{build, check_hit, direction, exact, number, point, sheet, soup};
use glam::Vec3;
use heliodon_math::random::Pcg32;
use heliodon_rays::{Hit, Ray};

fn rays(count: usize, seed: u64) -> Vec<Ray> {
    let mut rng = Pcg32::new(seed, 3);
    (0..count)
        .map(|i| {
            let mut d = direction(&mut rng) * (1.0 + number(&mut rng) * 0.9);
            if i % 5 == 0 {
                d[i / 5 % 3] = 0.0;
            }
            if i % 25 == 0 {
                d = Vec3::ZERO;
                d[i / 25 % 3] = if i % 2 == 0 { 1.0 } else { -1.0 };
            }
            let t_min = if i % 3 == 0 { 0.3 } else { 0.0 };
            let t_max = if i % 4 == 0 { 1.5 } else { f32::INFINITY };
            Ray { origin: point(&mut rng) * 2.5, direction: d, t_min, t_max }
        })
        .collect()
}

#[test]
fn closest_and_occluded_match() {
    for (seed, soup) in [soup(1, 1), soup(7, 2), soup(40, 3), soup(700, 4), sheet(12, 5)].into_iter().enumerate() {
        let scene = build(&soup);
        let rays = rays(1500, seed as u64);
        let mut hits = vec![Hit::MISS; rays.len()];
        scene.closest(&rays, &mut hits);
        let mut bits = vec![0; rays.len().div_ceil(64)];
        scene.occluded(&rays, &mut bits);
        for (i, (ray, hit)) in rays.iter().zip(&hits).enumerate() {
            check_hit(&soup, ray, hit);
            assert_eq!(bits[i / 64] >> (i % 64) & 1 == 1, hit.is_some(), "{ray:?}");
        }
        assert!(seed == 0 || hits.iter().any(Hit::is_some));
    }
}

#[test]
fn enclosures_are_backs_less_fronts() {
    let (mut sure, mut most) = (0, 0);
    for (seed, soup) in [soup(40, 3), soup(700, 4), sheet(12, 5)].into_iter().enumerate() {
        let scene = build(&soup);
        let rays = rays(1500, seed as u64);
        let mut counts = vec![0; rays.len()];
        scene.enclosures(&rays, &mut counts);
        for (ray, &count) in rays.iter().zip(&counts) {
            let mut met = Vec::new();
            let mut clear = true;
            for crossing in soup.1.iter().filter_map(|t| exact(ray, t.map(|v| soup.0[v as usize]))) {
                let ends = [ray.t_min, ray.t_max].map(|end| (crossing.t - f64::from(end)).abs());
                clear &= crossing.margin.abs() > 1e-3 && ends[0].min(ends[1]) > 1e-4;
                if crossing.margin > 0.0 && crossing.t > f64::from(ray.t_min) && crossing.t < f64::from(ray.t_max) {
                    met.push(if crossing.back { 1 } else { -1 });
                }
            }
            if clear {
                assert_eq!(count, met.iter().sum::<i32>(), "{ray:?}");
                sure += 1;
                most = most.max(met.len());
            }
        }
    }
    assert!(sure > 2000 && most > 3, "{sure} rays, {most} crossings at the most");
}

#[test]
fn parallel_is_the_same_as_one_by_one() {
    for (seed, soup) in [soup(1, 1), soup(300, 6), sheet(40, 7)].into_iter().enumerate() {
        let scene = build(&soup);
        let mut rng = Pcg32::new(seed as u64, 4);
        for _ in 0..12 {
            let d = direction(&mut rng);
            let mut origins: Vec<Vec3> = (0..200).map(|_| point(&mut rng) * 2.0).collect();
            origins.extend(soup.0.iter().take(800).map(|p| *p + Vec3::Y * 1e-3));
            let active: Vec<u64> = (0..origins.len().div_ceil(64)).map(|_| u64::from(rng.next_u32()) * 0x1_0000_0003).collect();
            let rays: Vec<Ray> =
                origins.iter().map(|&origin| Ray { origin, direction: d, t_min: 0.0, t_max: f32::INFINITY }).collect();
            let mut expected = vec![Hit::MISS; rays.len()];
            scene.closest(&rays, &mut expected);
            let mut hits = vec![Hit { triangle: 5, ..Hit::MISS }; rays.len()];
            scene.closest_parallel(&origins, d, &active, &mut hits);
            let mut bits = vec![u64::MAX; active.len()];
            scene.occluded_parallel(&origins, d, &active, &mut bits);
            for (i, hit) in hits.iter().enumerate() {
                let asked = active[i / 64] >> (i % 64) & 1 == 1;
                assert_eq!(*hit, if asked { expected[i] } else { Hit::MISS }, "origin {i}, {:?}", origins[i]);
                assert_eq!(bits[i / 64] >> (i % 64) & 1 == 1, hit.is_some(), "origin {i}");
            }
        }
    }
}
