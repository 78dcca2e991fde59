//! The largest scale at which all charts fit.

use super::bitmap::Bitmap;
use super::lay::{Laid, Laying, Shape};
use super::sheet::LARGEST;
use super::{PackParams, Placement};
use rayon::prelude::*;

/// Scales that are tried at once, whatever the number of threads, so that it does not matter.
const AT_ONCE: usize = 2;
/// The scale that is found is no more than this part below one that did not fit.
const PRECISION: f32 = 0.007;
/// How full, margins counted, the textures are expected to be: 0.77 to 0.85 of them were found with jagged charts, which fill 0.62 of their rectangles, 0.94 to
/// 0.97 with rectangles (2,048 texels a side; ten meshes). This line goes through them.
const FULL: [f64; 2] = [0.53, 0.45];
/// No texture becomes fuller than this.
const FULLEST: f64 = 0.985;
/// The scales that are tried first, for the one expected: the larger one is about as likely to fit as not.
const FIRST: [f32; AT_ONCE] = [0.985, 1.005];
/// Those after them as long as none fits, for the least that does not; further down each round.
const LOWER: [f32; AT_ONCE] = [0.97, 0.985];
/// Rounds at most in which none fits: what is reckoned of very small textures is not true.
const MOST_FAILED: i32 = 6;
/// So many of those that are likely to fit are kept until the largest did: each has its sheets, 34 MB for a texture of the largest size.
const KEPT: usize = 3;
/// Where none fits, the next one is so many times as large.
const BACK: f32 = 0.9;

/// What is known of scales.
#[derive(Clone, Copy, Debug)]
struct Known {
    fits: Option<f32>,
    fails: f32,
    rounds: i32,
}

impl Known {
    /// What is to be tried, ascending; none where it is known well enough.
    fn next(self, expected: f32) -> Option<[f32; AT_ONCE]> {
        let Self { fits, fails, rounds } = self;
        match fits {
            _ if rounds == 0 => Some(FIRST.map(|part| part * expected)),
            // the steps become longer, so that an expectation that is wrong by much is left soon
            None => (rounds < MOST_FAILED).then(|| LOWER.map(|step| fails * (1.0 + (step - 1.0) * (1 << (rounds - 1)) as f32))),
            Some(fits) => (fails - fits > PRECISION * fails)
                .then(|| core::array::from_fn(|i| fits + (fails - fits) * (i + 1) as f32 / (AT_ONCE + 1) as f32)),
        }
    }
}

/// The largest scale that was found, texels a metre, and where charts lie at it; none where not even a texel for each finds room.
pub(super) fn largest(shapes: &[Shape], params: &PackParams) -> Option<(f32, Vec<Placement>)> {
    let area: f64 = shapes.iter().map(|shape| shape.area).sum();
    let whole = |mut laying: Laying| (laying.run(None) == Laid::All).then_some((laying.scale, laying.placements));
    if area <= 0.0 {
        return whole(Laying::new(shapes, 0.0, params));
    }
    let texels = f64::from(params.width) * f64::from(params.height) * f64::from(params.sheets);
    let demand = Demand::of(shapes, texels, params);
    let scale_of = |fullness: f64| demand.scale(fullness * texels);
    let expected = scale_of(FULL[0] + FULL[1] * demand.filled);
    let attempt = |scale: f32| {
        let mut laying = Laying::new(shapes, scale.min(params.most_per_m), params);
        let laid = laying.run(Some(&demand.of_each(laying.scale)));
        (laid, laying)
    };
    let mut known = Known { fits: None, fails: scale_of(FULLEST), rounds: 0 };
    // those that are likely to fit, the largest last
    let mut likely: Vec<Laying> = Vec::new();
    loop {
        // what is as large as may be need not be tried again
        while known.fits.is_none_or(|fits| fits < params.most_per_m)
            && let Some(scales) = known.next(expected)
        {
            let tried: Vec<(Laid, Laying)> = scales.into_par_iter().map(attempt).collect();
            for (laid, laying) in tried {
                if laid == Laid::No {
                    known.fails = laying.scale;
                    break;
                }
                known.fits = Some(laying.scale);
                likely.push(laying);
            }
            likely.drain(..likely.len().saturating_sub(KEPT));
            known.rounds += 1;
        }
        let Some(largest) = likely.pop() else { break };
        known.fails = largest.scale;
        if let Some(found) = whole(largest) {
            return Some(found);
        }
        known.fits = likely.last().map(|laying| laying.scale);
    }
    // in the end each takes one texel, and there is room for that: it was asked for before
    let mut scale = known.fails.min(params.most_per_m);
    while scale > 0.0 {
        if let Some(found) = whole(Laying::new(shapes, scale, params)) {
            return Some(found);
        }
        scale *= BACK;
    }
    whole(Laying::new(shapes, 0.0, params))
}

/// How many texels charts take with half of their margins, for two share one: for each a s^2 + b s + c at the scale s, for it has its area, its rim and its
/// corners.
struct Demand {
    each: Vec<[f64; 3]>,
    /// The part of its rectangle that a texel's chart fills, in the mean.
    filled: f64,
}

impl Demand {
    /// Seen at two scales, at which the charts alone would take so many texels and a quarter of these.
    fn of(shapes: &[Shape], texels: f64, params: &PackParams) -> Self {
        let scale = (texels / shapes.iter().map(|shape| shape.area).sum::<f64>()).sqrt();
        let of_shape = |shape: &Shape| {
            // who is larger than the largest texture is not asked
            let bitmap = |scale: f64| shape.bitmap(scale as f32, LARGEST).map(|(bitmap, _)| bitmap);
            let rest = |bitmap: &Option<Bitmap>, scale: f64| {
                let taken = bitmap.as_ref().map_or(0, |bitmap| bitmap.count() + u64::from(params.margin) * bitmap.rim() / 2);
                taken as f64 - shape.area * scale * scale
            };
            let (whole, half) = (bitmap(scale), bitmap(0.5 * scale));
            let texels = whole.as_ref().map_or(0.0, |bitmap| bitmap.count() as f64);
            let filled = whole.as_ref().map_or(0.0, |bitmap| texels / (f64::from(bitmap.width) * f64::from(bitmap.height)));
            let (all, half) = (rest(&whole, scale), rest(&half, 0.5 * scale));
            ([shape.area, 2.0 * (all - half) / scale, 2.0 * half - all], [texels, texels * filled])
        };
        let (each, filled): (Vec<[f64; 3]>, Vec<[f64; 2]>) = shapes.par_iter().map(of_shape).unzip();
        let sum = |i: usize| filled.iter().map(|filled| filled[i]).sum::<f64>();
        Self { each, filled: sum(1) / sum(0).max(1.0) }
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
