//! Whether the sun was brighter than the image could hold.

use super::SUN_RADIUS_DEG;
use super::aperture::{Element, Measured, Patch, angle};
use glam::DVec3;

/// Values at which formats and programs stop: 8 bits, 1, the largest half float, 65,535.
const CEILINGS: [f32; 4] = [1.0, 255.0, 65_504.0, 65_535.0];

/// Two tests: the largest component near the sun is one at which images are known to end; or pixels that the sun covers to
/// different parts have the same value, which only clipping does (what it covers wholly is equal in a sharp rendering too).
pub(super) fn is_clipped(patch: &Patch, measured: &Measured) -> bool {
    let largest = largest(patch);
    if CEILINGS.contains(&largest) {
        return true;
    }
    let mut least = 1.0_f64;
    let mut most = 0.0_f64;
    for e in at_most(patch, largest) {
        let covered = coverage(&e.looks, measured.direction);
        least = least.min(covered);
        most = most.max(covered);
    }
    most - least > 0.35
}

/// Pixels that must have the largest value for a top to be flat: a disc that is smaller than they are covers one to four of them to parts
/// that are as good as never the same.
const FLAT: usize = 3;

/// A third test, for spots that are too weak for a sun: whether several pixels have the largest value. Where few pixels are clipped the middle of
/// them is taken for the sun's, which then seems to cover all of them alike.
pub(super) fn has_flat_top(patch: &Patch) -> bool {
    at_most(patch, largest(patch)).count() >= FLAT
}

/// The largest component near the sun.
fn largest(patch: &Patch) -> f32 {
    patch.elements.iter().map(|e| e.color.max_element() as f32).fold(0.0, f32::max)
}

/// The pixels with that value.
fn at_most(patch: &Patch, largest: f32) -> impl Iterator<Item = &Element> {
    // a pixel's worth of the format's precision: Radiance files have steps of 1/256 to 1/128
    let same = move |e: &&Element| (e.color.max_element() as f32 - largest).abs() <= 0.004 * largest;
    patch.elements.iter().filter(same)
}

/// The part of a pixel that the sun's disc covers.
fn coverage(looks: &[DVec3], sun: DVec3) -> f64 {
    let radius = SUN_RADIUS_DEG.to_radians();
    looks.iter().filter(|&&look| angle(look, sun) <= radius).count() as f64 / looks.len() as f64
}
