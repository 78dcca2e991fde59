//! Points of a room from which eyes look.

use crate::ViewCell;
use crate::purge::windows::corners_of;
use glam::{DVec3, Vec3};
use heliodon_math::random::{hash2_u32, unit_f32};
use heliodon_math::sphere::fibonacci_sphere;
use heliodon_rays::{Hit, Ray, TriangleScene};

/// Directions that are asked whether an eye lies inside stone.
const DIRECTIONS: u32 = 16;

/// The k-th of a room's eye points: its corners first, then by turns a point within and a point on the surface. (Of an empty room
/// all that its eyes see outside is seen from its surface.) The points follow R. Roberts' sequence "R3" (2018), 1/g, 1/g^2 and 1/g^3 of
/// the root g of x^4 = x + 1, which fills the box evenly however many are taken.
pub(super) fn eye_point(cell: &ViewCell, k: u32, seed: u32) -> Vec3 {
    if let Some(corner) = corners_of(cell).get(k as usize) {
        return *corner;
    }
    const STEP: DVec3 = DVec3::new(0.819_172_513_396_164_4, 0.671_043_606_703_789_3, 0.549_700_477_901_970_3);
    let start = DVec3::from_array(core::array::from_fn(|axis| f64::from(unit_f32(hash2_u32(seed, axis as u32)))));
    let mut share = (start + f64::from(k) * STEP).fract();
    if k % 2 == 1 {
        share[(k / 2 % 3) as usize] = f64::from(k / 6 % 2);
    }
    let (low, high) = (cell.low.as_dvec3(), cell.high.as_dvec3());
    (low + share * (high - low)).as_vec3().clamp(cell.low, cell.high)
}

/// Eyes of a room that are asked how much of it lies in stone.
const ASKED: u32 = 256;

/// The part of a room that lies inside stone, from 0 to 1.
#[must_use]
pub fn stone_share(scene: &TriangleScene, cell: &ViewCell) -> f64 {
    let in_stone = (0..ASKED).filter(|&k| is_in_stone(scene, eye_point(cell, k, 0))).count();
    in_stone as f64 / f64::from(ASKED)
}

/// Whether an eye lies inside stone: whether in most directions it sees a back first, or leaves more surfaces by their backs than it
/// enters. Backs alone would not do where bodies run into each other, nor numbers where there is a floor of one sheet below.
pub(super) fn is_in_stone(scene: &TriangleScene, eye: Vec3) -> bool {
    let ray = |direction| Ray { origin: eye, direction, t_min: 0.0, t_max: f32::INFINITY };
    let rays: Vec<Ray> = fibonacci_sphere(DIRECTIONS).into_iter().map(ray).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    scene.closest(&rays, &mut hits);
    let backs = hits.iter().filter(|hit| hit.back).count();
    let fronts: Vec<Ray> = rays.iter().zip(&hits).filter(|(_, hit)| hit.is_some() && !hit.back).map(|(ray, _)| *ray).collect();
    let mut counts = vec![0; fronts.len()];
    scene.enclosures(&fronts, &mut counts);
    let within = backs + counts.into_iter().filter(|&count| count > 0).count();
    // Under an endless floor it is half of them, and that is no inside; in stone it is all, but for cracks.
    4 * within > 3 * DIRECTIONS as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_rays::BuildParams;
    use heliodon_testkit::scenes::{ball, ground};
    use std::f64::consts::PI;

    #[test]
    fn eyes_fill_the_box_its_surface_and_its_corners() {
        let cell = ViewCell { low: Vec3::new(1.0, 2.0, 3.0), high: Vec3::new(2.0, 4.0, 6.0), windows: Vec::new() };
        let eyes: Vec<Vec3> = (0..4008).map(|k| eye_point(&cell, k, 9)).collect();
        assert!(eyes.iter().all(|e| e.cmpge(cell.low).all() && e.cmple(cell.high).all()));
        assert_eq!(eyes[0], cell.low);
        assert_eq!(eyes[7], cell.high);
        let on_surface = |e: &&Vec3| (e.cmpeq(cell.low) | e.cmpeq(cell.high)).any();
        assert_eq!(eyes[8..].iter().filter(on_surface).count(), 2000);
        let mean = eyes.iter().sum::<Vec3>() / eyes.len() as f32;
        assert!((mean - 0.5 * (cell.low + cell.high)).length() < 0.01, "{mean}");
    }

    #[test]
    fn inside_a_ball_is_inside_stone_and_a_floor_has_no_inside() {
        let scene = ball(1.0, 24).and(ground(40.0, 4).moved(Vec3::NEG_Y * 2.0));
        let rays = TriangleScene::build(&scene.positions, &scene.triangles, &BuildParams::default()).unwrap();
        for (eye, inside) in [(Vec3::ZERO, true), (Vec3::X * 0.9, true), (Vec3::X * 1.1, false), (Vec3::Y * -2.5, false)] {
            assert_eq!(is_in_stone(&rays, eye), inside, "{eye}");
        }
        let share = |low: f32, high: f32| {
            let cell = ViewCell { low: Vec3::splat(low), high: Vec3::splat(high), windows: Vec::new() };
            stone_share(&rays, &cell)
        };
        assert_eq!((share(-0.4, 0.4), share(1.0, 2.0)), (1.0, 0.0));
        // of a cube of a metre, which holds an eighth of the ball, half of the eyes are within, and half on its six sides
        let expected = 0.5 * (PI / 6.0 + 0.5 * PI / 4.0);
        assert!((share(0.0, 1.0) - expected).abs() < 0.03, "{} of {expected}", share(0.0, 1.0));
    }
}
