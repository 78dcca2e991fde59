//! Sun masks: whether the sun of each step of the day reaches a point.
//!
//! M. Callieri, P. Debevec, J. Pair, R. Scopigno: "A realtime immersive application with realistic lighting: The Parthenon",
//! Computers & Graphics 30, 2006, section 4.

use crate::change::{Change, bounds_of, crosses_any};
use crate::params::MAX_SUN_STEPS;
use crate::traces::Rays;
use crate::{LightError, PointSet, Surfaces};
use glam::Vec3;
use heliodon_rays::{facing, set_bits};
use rayon::prelude::*;
use std::ops::Range;

/// Points asked for together.
const TOGETHER: usize = 2048;

/// How sun masks are computed; the result does not depend on it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MaskParams {
    /// Points asked for together, a multiple of 64. More: fewer calls; less: the work divides more evenly among the cores.
    pub points_at_once: usize,
}

impl Default for MaskParams {
    fn default() -> Self {
        Self { points_at_once: TOGETHER }
    }
}

impl MaskParams {
    /// Sun masks are exact: a preview's are the same.
    #[must_use]
    pub fn preview() -> Self {
        Self::default()
    }

    /// Sun masks are exact: the archive's are the same.
    #[must_use]
    pub fn archival() -> Self {
        Self::default()
    }
}

/// One bit for each point and sun step: set where the sun reaches the point and stands above its surface.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SunMasks {
    /// Sun steps, T.
    pub steps: u32,
    /// `ceil(T / 32)` words a point; bit t is bit `t % 32` of word `t / 32`, unused ones 0.
    pub words: Vec<u32>,
    /// Rays that were traced.
    pub rays: u64,
}

impl SunMasks {
    /// Words of each point, W.
    #[must_use]
    pub fn words_per_point(&self) -> usize {
        (self.steps as usize).div_ceil(32)
    }

    /// Points that the masks are of; 0 for masks without steps.
    #[must_use]
    pub fn point_count(&self) -> usize {
        self.words.len().checked_div(self.words_per_point()).unwrap_or(0)
    }

    /// The words of one point.
    #[must_use]
    pub fn of_point(&self, point: usize) -> &[u32] {
        let w = self.words_per_point();
        &self.words[point * w..(point + 1) * w]
    }

    /// Whether the sun of step `step` reaches a point.
    #[must_use]
    pub fn is_lit(&self, point: usize, step: u32) -> bool {
        self.of_point(point)[step as usize / 32] >> (step % 32) & 1 == 1
    }

    /// Adds the masks of the points that follow.
    ///
    /// # Errors
    /// Masks of another number of steps.
    pub fn append(&mut self, next: &Self) -> Result<(), LightError> {
        if self.words.is_empty() {
            self.steps = next.steps;
        }
        if self.steps != next.steps {
            return Err(LightError::Mismatch(format!("masks of {} and of {} sun steps", self.steps, next.steps)));
        }
        self.words.extend_from_slice(&next.words);
        self.rays += next.rays;
        Ok(())
    }

    /// The masks of the points `picks`, in that order.
    #[must_use]
    pub fn pick(&self, picks: impl Iterator<Item = u32>) -> Self {
        let words = picks.flat_map(|p| self.of_point(p as usize).iter().copied()).collect();
        Self { steps: self.steps, words, rays: self.rays }
    }

    /// Whether shapes agree and unused bits are 0.
    ///
    /// # Errors
    /// What is wrong.
    pub fn validate(&self) -> Result<(), LightError> {
        check_sun_count(self.steps as usize)?;
        let w = self.words_per_point();
        if w == 0 || !self.words.len().is_multiple_of(w) {
            return if self.words.is_empty() { Ok(()) } else { Err(LightError::Mismatch("sun masks of broken length".into())) };
        }
        let used = self.steps % 32;
        if used != 0 && self.words.chunks_exact(w).any(|p| p[w - 1] >> used != 0) {
            return Err(LightError::Mismatch("sun masks with bits beyond the last step".into()));
        }
        Ok(())
    }
}

/// Whether masks can hold so many suns.
pub(crate) fn check_sun_count(suns: usize) -> Result<(), LightError> {
    if suns > MAX_SUN_STEPS {
        return Err(LightError::Parameter { name: "sun steps", value: suns.to_string(), allowed: "at most 1024" });
    }
    Ok(())
}

/// The masks of the points in `range` for the unit directions `suns`; a direction that is not finite or zero reaches nothing.
///
/// Ranges may be computed apart and appended: every bit is the same however the points are divided.
///
/// # Errors
/// More than 1,024 suns, or a range beyond the points.
pub fn bake_sun_masks(
    surfaces: &Surfaces,
    points: &PointSet,
    suns: &[Vec3],
    range: Range<usize>,
    params: &MaskParams,
) -> Result<SunMasks, LightError> {
    bake_sun_masks_knowing(surfaces, points, suns, range, params, None).map(|(masks, _)| masks)
}

/// What masks of the same suns were before surfaces changed, at points of the same origins and normals.
#[derive(Clone, Debug)]
pub struct MasksBefore<'a> {
    /// What has changed.
    pub change: &'a Change,
    /// The words of each point in turn; of a point that was not there before, anything.
    pub words: Vec<u32>,
    /// Whether each was there.
    pub known: Vec<bool>,
}

impl MasksBefore<'_> {
    fn all(&self) -> Earlier<'_> {
        Earlier { change: self.change, words: &self.words, known: &self.known }
    }
}

/// [`MasksBefore`] of some points.
#[derive(Clone, Copy)]
pub(crate) struct Earlier<'a> {
    pub change: &'a Change,
    pub words: &'a [u32],
    pub known: &'a [bool],
}

impl Earlier<'_> {
    /// Of some of them, whose masks have `width` words each.
    fn of(self, points: Range<usize>, width: usize) -> Option<Self> {
        let words = self.words.get(points.start * width..points.end * width)?;
        Some(Self { words, known: self.known.get(points)?, ..self })
    }
}

/// As [`bake_sun_masks`], which traces only rays of which nothing is known from `before` or that the change may reach; with the masks, how many
/// these were. The masks are the same whatever is known.
///
/// # Errors
/// As [`bake_sun_masks`].
pub fn bake_sun_masks_knowing(
    surfaces: &Surfaces,
    points: &PointSet,
    suns: &[Vec3],
    range: Range<usize>,
    params: &MaskParams,
    before: Option<&MasksBefore>,
) -> Result<(SunMasks, u64), LightError> {
    check_sun_count(suns.len())?;
    if range.start > range.end || range.end > points.len() {
        return Err(LightError::Mismatch(format!("points {range:?} of {}", points.len())));
    }
    let words_per_point = suns.len().div_ceil(32);
    let mut masks = SunMasks { steps: suns.len() as u32, words: vec![0; range.len() * words_per_point], rays: 0 };
    if words_per_point == 0 {
        return Ok((masks, 0));
    }
    let at_once = params.points_at_once.next_multiple_of(64).max(64);
    let rays = masks
        .words
        .par_chunks_mut(at_once * words_per_point)
        .enumerate()
        .map(|(i, words)| {
            let first = range.start + i * at_once;
            let count = words.len() / words_per_point;
            let at = first - range.start;
            let before = before.and_then(|before| before.all().of(at..at + count, words_per_point));
            unit_masks(surfaces, points.run(first..first + count), suns, before, words)
        })
        .reduce(Rays::default, Rays::plus);
    masks.rays = rays.all;
    Ok((masks, rays.traced))
}

/// The masks of some points in spatial order, on one thread; returns the number of rays.
pub(crate) fn run_masks(
    surfaces: &Surfaces,
    (origins, normals): (&[Vec3], &[Vec3]),
    suns: &[Vec3],
    before: Option<Earlier>,
    out: &mut [u32],
) -> Rays {
    let width = suns.len().div_ceil(32);
    let mut rays = Rays::default();
    let runs = origins.chunks(TOGETHER).zip(normals.chunks(TOGETHER)).zip(out.chunks_mut((TOGETHER * width).max(1)));
    for (i, ((origins, normals), out)) in runs.enumerate() {
        let points = i * TOGETHER..i * TOGETHER + origins.len();
        let before = before.and_then(|before| before.of(points, width));
        rays = rays.plus(unit_masks(surfaces, (origins, normals), suns, before, out));
    }
    rays
}

/// The masks of points that are asked for together; returns the number of rays.
fn unit_masks(
    surfaces: &Surfaces,
    (origins, normals): (&[Vec3], &[Vec3]),
    suns: &[Vec3],
    before: Option<Earlier>,
    out: &mut [u32],
) -> Rays {
    let words = origins.len().div_ceil(64);
    let words_per_point = suns.len().div_ceil(32);
    let mut rays = Rays::default();
    // bits of 32 steps: active[step][word of 64 points]
    let mut active = vec![0_u64; 32 * words];
    let mut occluded = vec![0_u64; 32 * words];
    // rays that need not be traced because they are known to reach the sun
    let mut lit_before = vec![0_u64; 32 * words];
    let bounds = bounds_of(origins);
    for (group, suns) in suns.chunks(32).enumerate() {
        active.fill(0);
        for (&sun, active) in suns.iter().zip(active.chunks_mut(words)) {
            if sun.is_finite() {
                rays.all += u64::from(facing(normals, sun, active));
            }
        }
        if let Some(before) = before {
            before.bits(group, words_per_point, words, &mut lit_before);
            let known = before.known_bits();
            for (step, &sun) in suns.iter().enumerate() {
                let [gone, come] = before.change.within_reach(bounds, sun);
                for (word, known) in known.iter().enumerate() {
                    let at = step * words + word;
                    let lit = lit_before[at];
                    // what was lit may be shaded by what has come, what was shaded lit past what has gone
                    let doubtful = if come.is_empty() { 0 } else { lit } | if gone.is_empty() { 0 } else { !lit };
                    let mut skipped = active[at] & known & !doubtful;
                    for bit in set_bits(&[active[at] & known & doubtful]) {
                        let boxes = if lit >> bit & 1 == 1 { &come } else { &gone };
                        if !crosses_any(boxes, origins[word * 64 + bit], sun, f32::INFINITY) {
                            skipped |= 1 << bit;
                        }
                    }
                    lit_before[at] &= skipped;
                    active[at] &= !skipped;
                }
            }
        }
        rays.traced += active.iter().map(|word| u64::from(word.count_ones())).sum::<u64>();
        let asked = ..suns.len() * words;
        surfaces.rays.occluded_fan(origins, suns, &active[asked], &mut occluded[asked]);
        let lit = |step: usize, word: usize| {
            let at = step * words + word;
            active[at] & !occluded[at] | lit_before[at]
        };
        for block in 0..origins.len().div_ceil(32) {
            let mut bits: [u32; 32] = std::array::from_fn(|step| (lit(step, block / 2) >> (32 * (block % 2))) as u32);
            transpose32(&mut bits);
            for (point, word) in (block * 32..origins.len()).zip(bits) {
                out[point * words_per_point + group] = word;
            }
        }
        lit_before.fill(0);
    }
    rays
}

impl Earlier<'_> {
    /// The bits of a group of 32 steps, as `unit_masks` has them.
    fn bits(&self, group: usize, words_per_point: usize, words: usize, out: &mut [u64]) {
        out.fill(0);
        for (block, points) in self.words.chunks(32 * words_per_point).enumerate() {
            let mut bits: [u32; 32] = std::array::from_fn(|i| points.get(i * words_per_point + group).copied().unwrap_or(0));
            transpose32(&mut bits);
            for (step, &bits) in bits.iter().enumerate() {
                out[step * words + block / 2] |= u64::from(bits) << (32 * (block % 2));
            }
        }
    }

    fn known_bits(&self) -> Vec<u64> {
        let word = |points: &[bool]| points.iter().enumerate().fold(0, |word, (i, &known)| word | u64::from(known) << i);
        self.known.chunks(64).map(word).collect()
    }
}

/// Transposes a matrix of 32 x 32 bits: bit j of word i changes places with bit i of word j (H. S. Warren: "Hacker's
/// Delight", 2nd ed., section 7-3, with the bits counted from the lowest).
fn transpose32(rows: &mut [u32; 32]) {
    let mut width = 16;
    let mut mask = 0x0000_ffff_u32;
    while width != 0 {
        let mut k = 0;
        while k < 32 {
            let swapped = ((rows[k] >> width) ^ rows[k + width]) & mask;
            rows[k] ^= swapped << width;
            rows[k + width] ^= swapped;
            k = (k + width + 1) & !width;
        }
        width >>= 1;
        mask ^= mask << width;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::random::Pcg32;

    #[test]
    fn bits_change_places() {
        let mut rng = Pcg32::new(3, 1);
        let rows: [u32; 32] = std::array::from_fn(|_| rng.next_u32());
        let mut turned = rows;
        transpose32(&mut turned);
        for (i, row) in rows.iter().enumerate() {
            for (j, column) in turned.iter().enumerate() {
                assert_eq!(row >> j & 1, column >> i & 1, "row {i} column {j}");
            }
        }
    }

    #[test]
    fn masks_with_stray_bits_or_broken_length_are_told() {
        let good = SunMasks { steps: 33, words: vec![u32::MAX, 1], rays: 0 };
        assert_eq!(good.validate(), Ok(()));
        assert!(SunMasks { words: vec![0, 2], ..good.clone() }.validate().is_err());
        assert!(SunMasks { words: vec![0; 3], ..good.clone() }.validate().is_err());
        assert!(SunMasks { steps: 1025, words: vec![], rays: 0 }.validate().is_err());
        assert!(good.clone().append(&SunMasks { steps: 32, words: vec![0], rays: 0 }).is_err());
    }
}
