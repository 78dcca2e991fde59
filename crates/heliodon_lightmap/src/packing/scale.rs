//! The largest scale at which all charts fit.

use super::lay::{Laid, Laying, Shape};
use super::sheet::LARGEST;
use super::{PackParams, Placement};
use rayon::prelude::*;

/// Scales that are tried at once, whatever the number of threads, so that it does not matter.
const AT_ONCE: usize = 2;
/// The scale that is found is no more than this part below one that did not fit: each round leaves a third of what was between.
const PRECISION: f32 = 0.006;
/// How full, margins counted, the first ones would make the textures: jagged charts fill 0.75 of them, rectangles 0.95.
const FIRST: [f64; 2] = [0.83, 0.98];
/// Rounds at most in which none fits: what is reckoned of very small textures is not true.
const MOST_FAILED: u32 = 8;
/// Where the lowest one fails, the next one is so many times as large.
const LOWER: f32 = 0.9;

/// The largest scale that was found, texels a metre, and where charts lie at it.
pub(super) fn largest(shapes: &[Shape], params: &PackParams) -> (f32, Vec<Placement>) {
    let area: f64 = shapes.iter().map(|shape| shape.area).sum();
    let whole = |mut laying: Laying| (laying.run(None) == Laid::All).then_some((laying.scale, laying.placements));
    if area <= 0.0 {
        return whole(Laying::new(shapes, 0.0, params)).unwrap_or_default();
    }
    let texels = f64::from(params.width) * f64::from(params.height) * f64::from(params.sheets.max(1));
    let demand = Demand::of(shapes, texels, params);
    let scale_of = |fullness: f64| demand.scale(fullness * texels).min(params.most_per_m);
    let [mut from, mut high] = FIRST.map(scale_of);
    // those that are likely to fit, the largest last
    let mut likely: Vec<Laying> = Vec::new();
    let mut failed = 0;
    while failed < MOST_FAILED && (likely.is_empty() || high - from > PRECISION * high) {
        let first = if likely.is_empty() { 0.0 } else { 1.0 };
        let step = |i: usize| from + (high - from) * (i as f32 + first) / (AT_ONCE as f32 + first);
        let attempt = |scale: f32| {
            let mut laying = Laying::new(shapes, scale, params);
            let laid = laying.run(Some(&demand.of_each(scale)));
            (laid, laying)
        };
        let tried: Vec<(Laid, Laying)> = (0..AT_ONCE).into_par_iter().map(step).map(attempt).collect();
        for (laid, laying) in tried {
            if laid == Laid::No {
                high = laying.scale;
                break;
            }
            from = laying.scale;
            likely.push(laying);
        }
        if likely.is_empty() {
            (failed, from) = (failed + 1, from.min(LOWER * high));
        }
        // what is as large as may be need not be tried again
        if from >= high {
            break;
        }
    }
    let mut scale = likely.first().map_or(high, |laying| laying.scale);
    if let Some(found) = likely.into_iter().rev().find_map(whole) {
        return found;
    }
    // in the end each takes one texel, and there is room for that: it was asked for before
    loop {
        if let Some(found) = whole(Laying::new(shapes, scale, params)) {
            return found;
        }
        scale *= LOWER;
    }
}

/// How many texels charts take with half of their margins, for two share one: for each a s^2 + b s + c at the scale s, for it has its area, its rim and its
/// corners.
struct Demand {
    each: Vec<[f64; 3]>,
}

impl Demand {
    /// Seen at two scales, at which the charts alone would take so many texels and a quarter of these.
    fn of(shapes: &[Shape], texels: f64, params: &PackParams) -> Self {
        let scale = (texels / shapes.iter().map(|shape| shape.area).sum::<f64>()).sqrt();
        let of_shape = |shape: &Shape| {
            let rest = |scale: f64| {
                // who is larger than the largest texture is not asked
                let bitmap = shape.bitmap(scale as f32, LARGEST).map(|(bitmap, _)| bitmap);
                let taken = bitmap.map_or(0, |bitmap| bitmap.count() + u64::from(params.margin) * bitmap.rim() / 2);
                taken as f64 - shape.area * scale * scale
            };
            let (all, half) = (rest(scale), rest(0.5 * scale));
            [shape.area, 2.0 * (all - half) / scale, 2.0 * half - all]
        };
        Self { each: shapes.par_iter().map(of_shape).collect() }
    }

    /// What each takes at a scale.
    fn of_each(&self, scale: f32) -> Vec<f64> {
        let s = f64::from(scale);
        self.each.iter().map(|[a, b, c]| ((a * s + b) * s + c).max(1.0)).collect()
    }

    /// At which scale they take so many together; 0 where they always take more.
    fn scale(&self, texels: f64) -> f32 {
        let sum = |i: usize| self.each.iter().map(|each| each[i]).sum::<f64>();
        let [a, b, c] = [sum(0), sum(1), sum(2)];
        let root = (b * b - 4.0 * a * (c - texels)).max(0.0).sqrt();
        ((root - b) / (2.0 * a)).max(0.0) as f32
    }
}
