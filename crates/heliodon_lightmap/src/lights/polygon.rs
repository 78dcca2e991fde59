//! Light from a uniform polygon by its edges alone.
//!
//! J. H. Lambert: "Photometria", 1760; in the vector form of Baum, Rushmeier, Winget: "Improving Radiosity Solutions Through the Use of
//! Analytically Determined Form-Factors", SIGGRAPH 1989, with the part below the receiver's horizon cut off first.

use crate::lights::vector::angle_between;
use glam::DVec3;
use std::f64::consts::TAU;

/// A quadrilateral cut by one plane has at most five corners.
const MOST: usize = 5;

/// Irradiance over pi (0 to 1) at the origin, on a surface of unit normal `normal`, from a flat convex polygon of radiance one with three or
/// four `corners` relative to the receiver. It counts from both of its sides; 0 from its own plane.
pub(super) fn irradiance_over_pi(corners: &[DVec3], normal: DVec3) -> f64 {
    let mut above = [DVec3::ZERO; MOST];
    let count = clip_to_horizon(corners, normal, &mut above);
    let above = &above[..count];
    let sum: f64 = (0..count).map(|i| edge(above[i], above[(i + 1) % count], normal)).sum();
    // the sum's sign only says which way round the corners go
    (sum.abs() / TAU).min(1.0)
}

/// One edge's share of the contour integral: its angle times the cosine between the receiver's normal and that of the plane through
/// edge and receiver.
pub(super) fn edge(from: DVec3, to: DVec3, normal: DVec3) -> f64 {
    let across = from.cross(to);
    let length = across.length();
    if length > 0.0 { angle_between(from, to) * (across.dot(normal) / length) } else { 0.0 }
}

/// Sutherland and Hodgman's clipping ("Reentrant Polygon Clipping", CACM 17(1), 1974) against one plane through the origin.
fn clip_to_horizon(corners: &[DVec3], normal: DVec3, above: &mut [DVec3; MOST]) -> usize {
    let mut count = 0;
    let mut keep = |corner: DVec3| {
        if let Some(place) = above.get_mut(count) {
            *place = corner;
            count += 1;
        }
    };
    for (i, &from) in corners.iter().enumerate() {
        let to = corners[(i + 1) % corners.len()];
        let (a, b) = (from.dot(normal), to.dot(normal));
        if a >= 0.0 {
            keep(from);
        }
        if (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0) {
            keep(from + (to - from) * (a / (a - b)));
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From a differential element to a parallel rectangle one of whose corners lies on its normal (Howell's catalogue, B-3).
    fn corner_form_factor(x: f64, y: f64) -> f64 {
        let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
        (x / p * libm::atan(y / p) + y / q * libm::atan(x / q)) / TAU
    }

    #[test]
    fn rectangles_have_the_catalogues_form_factors() {
        for (x, y) in [(1.0, 1.0), (0.1, 3.0), (1e-3, 2e-3), (50.0, 50.0), (1e4, 1e4)] {
            let corners = [[0.0, 0.0], [x, 0.0], [x, y], [0.0, y]].map(|[x, y]| DVec3::new(x, 1.0, y));
            let got = irradiance_over_pi(&corners, DVec3::Y);
            assert!((got / corner_form_factor(x, y) - 1.0).abs() < 1e-9, "{x} {y}: {got}");
        }
    }

    #[test]
    fn a_vertical_receiver_sees_half_of_a_ceiling() {
        let corners = [[-1e6, -1e6], [1e6, -1e6], [1e6, 1e6], [-1e6, 1e6]].map(|[x, z]| DVec3::new(x, 1.0, z));
        assert!((irradiance_over_pi(&corners, DVec3::Y) - 1.0).abs() < 1e-6);
        assert!((irradiance_over_pi(&corners, DVec3::X) - 0.5).abs() < 1e-6);
        assert_eq!(irradiance_over_pi(&corners, DVec3::NEG_Y), 0.0);
        // in the receiver's own plane, around it
        let flat = corners.map(|c| c - DVec3::Y);
        assert!(irradiance_over_pi(&flat, DVec3::X) < 1.0);
        assert_eq!(irradiance_over_pi(&[DVec3::ZERO; 4], DVec3::X), 0.0);
    }
}
