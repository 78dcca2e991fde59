//! Whether the sun was brighter than the image could hold.

use super::SUN_RADIUS_DEG;
use super::aperture::{Measured, Patch, angle};
use glam::DVec3;

/// Values at which formats and programs stop: 8 bits, 1, the largest half float, 65,535.
const CEILINGS: [f32; 4] = [1.0, 255.0, 65_504.0, 65_535.0];

/// Two tests: the largest component near the sun is one at which images are known to end; or pixels that the sun covers to
/// different parts have the same value, which only clipping does (what it covers wholly is equal in a sharp rendering too).
pub(super) fn is_clipped(patch: &Patch, measured: &Measured) -> bool {
    let largest = patch.elements.iter().map(|e| e.color.max_element() as f32).fold(0.0, f32::max);
    // a pixel's worth of the format's precision: Radiance files have steps of 1/256 to 1/128
    let same = |a: f32, b: f32| (a - b).abs() <= 0.004 * b;
    if CEILINGS.contains(&largest) {
        return true;
    }
    let mut least = 1.0_f64;
    let mut most = 0.0_f64;
    for e in &patch.elements {
        if same(e.color.max_element() as f32, largest) {
            let covered = coverage(&e.looks, measured.direction);
            least = least.min(covered);
            most = most.max(covered);
        }
    }
    most - least > 0.35
}

/// The part of a pixel that the sun's disc covers.
fn coverage(looks: &[DVec3], sun: DVec3) -> f64 {
    let radius = SUN_RADIUS_DEG.to_radians();
    looks.iter().filter(|&&look| angle(look, sun) <= radius).count() as f64 / looks.len() as f64
}
