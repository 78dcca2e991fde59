//! Where to look for a point in one photograph that was marked in another: along the picture of the ray that it was seen by, bent as the lens bends it.

use crate::camera::Camera;
use glam::DVec2;

/// Pieces that a ray's picture is first cut into, before those that bend or are long are cut further.
const FIRST_PIECES: usize = 64;
/// How often a piece is halved at most.
const MOST_HALVINGS: usize = 10;
/// How far the middle of a piece may lie beside the straight line, pixels: below what is seen.
const STRAIGHT_PX: f64 = 0.2;
/// Pieces shorter than this are not cut further, pixels.
const SHORT_PX: f64 = 2.0;

/// The picture in `other` of the ray that `pixel` of `camera` saw, as lines from near to far: several where the picture leaves the photograph or the
/// lens's range. A margin of a tenth of the photograph is kept around it. Empty where nothing of the ray is seen, or both stand in one place.
#[must_use]
pub fn epipolar_lines(camera: &Camera, pixel: DVec2, other: &Camera) -> Vec<Vec<DVec2>> {
    let (origin, direction) = camera.ray(pixel);
    let near = other.pose.to_camera(origin);
    let far = other.pose.rotation * direction;
    let (Some(_), Some(_)) = (near.try_normalize(), direction.try_normalize()) else { return Vec::new() };
    // At s the point at the distance |near| * s / (1 - s): s = 1 is infinitely far, and as finely sampled as what is near.
    let scale = near.length();
    let place = |s: f64| other.intrinsics.project(near * (1.0 - s) + far * (scale * s));
    let size = DVec2::new(f64::from(other.intrinsics.width), f64::from(other.intrinsics.height));
    let is_inside = |p: DVec2| (p.cmpge(size * -0.1) & p.cmple(size * 1.1)).all();
    let mut samples: Vec<(f64, Option<DVec2>)> = Vec::new();
    let at = |i: usize| i as f64 / FIRST_PIECES as f64;
    for i in 0..FIRST_PIECES {
        let ends = [at(i), at(i + 1)];
        cut(&place, &is_inside, ends, ends.map(place), 0, &mut samples);
    }
    samples.push((1.0, place(1.0)));
    let mut lines: Vec<Vec<DVec2>> = vec![Vec::new()];
    for (_, sample) in samples {
        match (sample.filter(|p| is_inside(*p)), lines.last_mut()) {
            (Some(p), Some(line)) => line.push(p),
            (None, Some(line)) if !line.is_empty() => lines.push(Vec::new()),
            _ => {}
        }
    }
    lines.retain(|line| line.len() > 1);
    lines
}

/// Adds the samples of a piece without its end.
fn cut(
    place: &impl Fn(f64) -> Option<DVec2>,
    is_inside: &impl Fn(DVec2) -> bool,
    ends: [f64; 2],
    pixels: [Option<DVec2>; 2],
    halvings: usize,
    samples: &mut Vec<(f64, Option<DVec2>)>,
) {
    let middle = 0.5 * (ends[0] + ends[1]);
    let halfway = place(middle);
    let seen = |p: Option<DVec2>| p.filter(|p| is_inside(*p));
    let is_done = match [seen(pixels[0]), seen(halfway), seen(pixels[1])] {
        // A piece across the margin is cut to where it crosses; one that is outside at its ends and its middle is left out.
        [None, None, None] => halvings > 3,
        [Some(a), Some(m), Some(b)] => a.distance(b) < SHORT_PX || beside(m, a, b) < STRAIGHT_PX,
        _ => false,
    };
    if is_done || halvings == MOST_HALVINGS {
        samples.push((ends[0], pixels[0]));
        return;
    }
    cut(place, is_inside, [ends[0], middle], [pixels[0], halfway], halvings + 1, samples);
    cut(place, is_inside, [middle, ends[1]], [halfway, pixels[1]], halvings + 1, samples);
}

/// How far a point lies beside the line through two others.
fn beside(point: DVec2, a: DVec2, b: DVec2) -> f64 {
    match (b - a).try_normalize() {
        Some(along) => (point - a).perp_dot(along).abs(),
        None => point.distance(a),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Intrinsics, Pose};
    use glam::DVec3;

    fn cameras(radial: f64) -> [Camera; 2] {
        let intrinsics = Intrinsics { radial: [radial, 0.0, 0.0], ..Intrinsics::pinhole(1200, 900, 1000.0) };
        let eyes = [DVec3::new(-2.0, 1.0, 8.0), DVec3::new(3.0, 2.0, 7.0)];
        eyes.map(|eye| Camera { intrinsics, pose: Pose::look_at(eye, DVec3::ZERO).unwrap() })
    }

    fn distance(lines: &[Vec<DVec2>], p: DVec2) -> f64 {
        let of = |ends: &[DVec2]| {
            let along = ends[1] - ends[0];
            let t = ((p - ends[0]).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
            p.distance(ends[0] + along * t)
        };
        lines.iter().flat_map(|line| line.windows(2).map(of)).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn the_point_lies_on_the_line_however_far_it_is_and_however_the_lens_bends() {
        for radial in [0.0, -0.15, 0.1] {
            let [a, b] = cameras(radial);
            for point in [DVec3::ZERO, DVec3::new(1.0, 0.5, 3.0), DVec3::new(-1.0, -1.0, -4.0), DVec3::new(0.4, 0.2, -0.7)] {
                let (seen, expected) = (a.project(point).unwrap(), b.project(point).unwrap());
                let lines = epipolar_lines(&a, seen, &b);
                assert!(distance(&lines, expected) < 0.3, "{radial} {point}: {}", distance(&lines, expected));
                let off = distance(&lines, expected + DVec2::new(0.0, 40.0));
                assert!(off > 20.0, "a line, not the whole photograph: {off}");
            }
        }
    }

    #[test]
    fn a_bending_lens_bends_the_line_and_a_straight_one_does_not() {
        let bow = |radial: f64| {
            let [a, b] = cameras(radial);
            let lines = epipolar_lines(&a, DVec2::new(600.0, 150.0), &b);
            let line = lines.iter().max_by_key(|line| line.len()).unwrap().clone();
            let (first, last) = (line[0], line[line.len() - 1]);
            (line.iter().map(|p| beside(*p, first, last)).fold(0.0, f64::max), line.len())
        };
        assert!(bow(0.0).0 < 0.01);
        assert!(bow(-0.15).0 > 3.0, "{}", bow(-0.15).0);
        assert!(bow(-0.15).1 < 2000);
    }

    #[test]
    fn what_is_behind_or_in_one_place_has_no_line() {
        let [a, mut b] = cameras(0.0);
        assert_eq!(epipolar_lines(&a, DVec2::new(600.0, 450.0), &a), Vec::<Vec<DVec2>>::new());
        b.pose = Pose::look_at(DVec3::new(-2.0, 1.0, 8.5), DVec3::new(-2.0, 1.0, 20.0)).unwrap();
        assert_eq!(epipolar_lines(&a, DVec2::new(600.0, 450.0), &b), Vec::<Vec<DVec2>>::new());
        assert_eq!(epipolar_lines(&a, DVec2::NAN, &cameras(0.0)[1]).iter().flatten().filter(|p| !p.is_finite()).count(), 0);
    }
}
