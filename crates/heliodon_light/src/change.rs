//! What is known of rays among surfaces of which a part has moved, come or gone since they were traced.
//!
//! A ray's answer is a function of the ray and the triangles. A ray that met a triangle which is still there meets it again, unless something
//! new stands before it; one that met nothing meets nothing, unless something new stands in its way. So of all rays only those are traced
//! again whose triangle has gone or whose way to it crosses a box of what is new; of rays to the suns, which tell only whether, those that
//! were stopped and cross a box of what has gone, and those that were not and cross a box of what is new. Boxes are larger than what they
//! hold by far more than rays err, so nothing is missed; what they hold in vain costs a ray each.

use crate::cells::BACK;
use crate::gather::{Lattice, unit_ranges};
use crate::traces::{Known, KnownUnit, Met};
use crate::{LightParams, PointSet, Traces};
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;

/// By how much boxes are larger than what they hold, as a part of the largest coordinate: rays err by less than a millionth of it.
const MARGIN: f32 = 1e-5;

/// An axis-aligned box: the least and the greatest coordinates.
pub type Bounds = [Vec3; 2];

/// What differs between the surfaces among which rays were traced and those of now.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Change {
    same: Vec<[u32; 3]>,
    gone: Vec<Bounds>,
    come: Vec<Bounds>,
}

impl Change {
    /// `same` are runs of triangles (as rays meet them) that are as they were: the first of then, the first of now, how many; ascending in
    /// both. `gone` holds all others of then, `come` all others of now.
    #[must_use]
    pub fn new(same: Vec<[u32; 3]>, gone: Vec<Bounds>, come: Vec<Bounds>) -> Self {
        let widened = |bounds: Vec<Bounds>| -> Vec<Bounds> {
            let wider = |[low, high]: Bounds| {
                let margin = MARGIN * low.abs().max(high.abs()).max_element();
                [low - margin, high + margin]
            };
            bounds.into_iter().map(wider).collect()
        };
        Self { same, gone: widened(gone), come: widened(come) }
    }

    /// What a triangle of then is now.
    fn now(&self, triangle: u32) -> Option<u32> {
        let run = self.same.partition_point(|run| run[0] <= triangle).checked_sub(1)?;
        let [then, now, count] = self.same[run];
        (triangle - then < count).then(|| now + (triangle - then))
    }

    /// What has gone and what has come, as far as parallel rays from within `bounds` may cross it.
    pub(crate) fn within_reach(&self, bounds: Bounds, direction: Vec3) -> [Vec<Bounds>; 2] {
        [&self.gone, &self.come].map(|boxes| crossed(boxes, bounds, direction).collect())
    }
}

/// The boxes that parallel rays from within `bounds` may cross.
fn crossed(boxes: &[Bounds], bounds: Bounds, direction: Vec3) -> impl Iterator<Item = Bounds> {
    let (centre, half) = (0.5 * bounds[0] + 0.5 * bounds[1], 0.5 * bounds[1] - 0.5 * bounds[0]);
    // rounding of centre and half
    let half = half + MARGIN * bounds[0].abs().max(bounds[1].abs()).max_element();
    boxes.iter().copied().filter(move |b| crosses([b[0] - half, b[1] + half], centre, direction, f32::INFINITY))
}

/// The box about some points.
pub(crate) fn bounds_of(points: &[Vec3]) -> Bounds {
    points.iter().fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], &p| [low.min(p), high.max(p)])
}

/// Whether a ray enters any of some boxes before a distance.
pub(crate) fn crosses_any(boxes: &[Bounds], origin: Vec3, direction: Vec3, t: f32) -> bool {
    boxes.iter().any(|&bounds| crosses(bounds, origin, direction, t * (1.0 + MARGIN)))
}

/// Whether a ray enters a box before a distance.
fn crosses([low, high]: Bounds, origin: Vec3, direction: Vec3, t: f32) -> bool {
    let (mut near, mut far) = (0.0_f32, t);
    for axis in 0..3 {
        let (low, high, from, along) = (low[axis], high[axis], origin[axis], direction[axis]);
        if along == 0.0 {
            if from < low || from > high {
                return false;
            }
            continue;
        }
        let (a, b) = ((low - from) / along, (high - from) / along);
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    // quotients err by a part of themselves
    near * (1.0 - MARGIN) <= far * (1.0 + MARGIN)
}

/// Where a point stood in an earlier bake: the index of its traces, and its own within their range.
pub type Before = (usize, usize);

/// What earlier traces tell of the rays of some points; for [`crate::gather_knowing`].
#[derive(Default)]
pub struct KnownTraces {
    pub(crate) units: Vec<Option<KnownUnit>>,
}

impl From<Traces> for KnownTraces {
    fn from(traces: Traces) -> Self {
        Self { units: traces.units.into_iter().map(|unit| unit.map(KnownUnit::from)).collect() }
    }
}

impl KnownTraces {
    /// What is known of the points in `range` from earlier traces, of which `before` tells point by point where they are; the rays' origins and
    /// normals must be the same to the bit. Traces must be valid for their own points and the same samples and seed.
    #[must_use]
    pub fn among(
        change: &Change,
        points: &PointSet,
        range: &Range<usize>,
        params: &LightParams,
        earlier: &[Traces],
        before: &[Option<Before>],
    ) -> Self {
        let lattices = Lattice::all(params);
        let earlier: Vec<Vec<Option<Ranked>>> = earlier
            .iter()
            .map(|traces| traces.units.iter().map(|unit| Some(Ranked::new(unit.as_ref()?, &lattices))).collect())
            .collect();
        let first = range.start;
        let unit = |run: Range<usize>| {
            let (origins, _) = points.run(run.clone());
            let bounds = bounds_of(origins);
            let places: Vec<Option<(&Ranked, usize)>> = before[run.start - first..run.end - first]
                .iter()
                .map(|before| {
                    let (traces, point) = (*before)?;
                    let unit = earlier[traces].get(point / crate::gather::UNIT)?.as_ref()?;
                    Some((unit, point % crate::gather::UNIT))
                })
                .collect();
            if places.iter().all(Option::is_none) {
                return None;
            }
            let erred = |place: &Option<(&Ranked, usize)>| {
                place.as_ref().and_then(|(unit, point)| unit.unit.erring.binary_search(&(*point as u32)).ok())
            };
            let erring: Vec<u32> = (0..places.len() as u32).filter(|&i| erred(&places[i as usize]).is_some()).collect();
            let of_first: Vec<Option<(&RankedMet, usize)>> =
                places.iter().map(|place| place.as_ref().map(|(unit, point)| (&unit.mets[0], *point))).collect();
            let first = known(change, origins, bounds, &lattices[0].directions, &of_first);
            let erring_origins: Vec<Vec3> = erring.iter().map(|&i| origins[i as usize]).collect();
            let further = lattices[1..].iter().filter(|_| !erring.is_empty()).enumerate().map(|(number, lattice)| {
                let of_lattice = |&i: &u32| {
                    let place = &places[i as usize];
                    Some((place.as_ref()?.0.mets.get(number + 1)?, erred(place)?))
                };
                let rows: Vec<Option<(&RankedMet, usize)>> = erring.iter().map(of_lattice).collect();
                known(change, &erring_origins, bounds, &lattice.directions, &rows)
            });
            Some(KnownUnit {
                first,
                further: further.collect(),
                erring,
                back: None,
                path_counts: Vec::new(),
                paths: Vec::new(),
            })
        };
        Self { units: unit_ranges(range).into_par_iter().map(unit).collect() }
    }
}

/// A run's traces whose hits can be asked for one by one.
struct Ranked<'a> {
    unit: &'a crate::traces::UnitTraces,
    /// Of the first lattice, then of the further ones.
    mets: Vec<RankedMet<'a>>,
}

struct RankedMet<'a> {
    met: &'a Met,
    /// Words of a direction.
    words: usize,
    /// Hits before each word.
    before: Vec<u32>,
}

impl<'a> Ranked<'a> {
    fn new(unit: &'a crate::traces::UnitTraces, lattices: &[Lattice]) -> Self {
        let ranked = |met: &'a Met| {
            let mut sum = 0;
            let before = met.bits.iter().map(|word| {
                sum += word.count_ones();
                sum - word.count_ones()
            });
            let before = before.collect();
            RankedMet { met, words: met.bits.len() / lattices[0].directions.len().max(1), before }
        };
        Self { unit, mets: std::iter::once(&unit.first).chain(&unit.further).map(ranked).collect() }
    }
}

/// What is known of rays from some origins in the directions of a lattice: `rows` tells of which points of which traces they are.
fn known(
    change: &Change,
    origins: &[Vec3],
    bounds: Bounds,
    directions: &[Vec3],
    rows: &[Option<(&RankedMet, usize)>],
) -> Known {
    let words = origins.len().div_ceil(64);
    let (mut all_known, mut met) = (Vec::with_capacity(words * directions.len()), Met::default());
    for (index, &direction) in directions.iter().enumerate() {
        let [_, come] = change.within_reach(bounds, direction);
        let begin = all_known.len();
        all_known.resize(begin + words, 0_u64);
        met.bits.resize(begin + words, 0_u64);
        for (i, row) in rows.iter().enumerate() {
            let Some((ranked, point)) = row else { continue };
            let (word, bit) = (index * ranked.words + point / 64, point % 64);
            let bits = ranked.met.bits[word];
            let hit = (bits >> bit & 1 == 1).then(|| {
                let rank = ranked.before[word] + (bits & ((1_u64 << bit) - 1)).count_ones();
                ranked.met.hits[rank as usize]
            });
            let t = hit.map_or(f32::INFINITY, |hit| f32::from_bits(hit[1]));
            if crosses_any(&come, origins[i], direction, t) {
                continue;
            }
            if let Some([triangle, t]) = hit {
                let Some(now) = change.now(triangle & !BACK) else { continue };
                met.hits.push([now | triangle & BACK, t]);
                met.bits[begin + i / 64] |= 1 << (i % 64);
            }
            all_known[begin + i / 64] |= 1 << (i % 64);
        }
    }
    Known::of(all_known, met)
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::random::Pcg32;

    #[test]
    fn boxes_are_crossed_as_a_walk_along_the_ray_finds() {
        let mut random = Pcg32::new(7, 3);
        let mut place =
            |size: f32| Vec3::from_array(std::array::from_fn(|_| (random.next_u32() as f32 / u32::MAX as f32 - 0.5) * size));
        let (mut met, mut missed) = (0, 0);
        for _ in 0..400 {
            let (a, b, origin, to) = (place(4.0), place(4.0), place(8.0), place(8.0));
            let bounds = [a.min(b), a.max(b)];
            let direction = (to - origin).normalize_or_zero();
            let t = 6.0;
            let inside = |p: Vec3| p.cmpge(bounds[0]).all() && p.cmple(bounds[1]).all();
            let walked = (0..3000).any(|i| inside(origin + direction * (t * i as f32 / 2999.0)));
            let crossed = crosses(bounds, origin, direction, t);
            assert!(!walked || crossed, "{bounds:?} {origin} {direction}");
            met += u32::from(walked);
            missed += u32::from(!crossed);
        }
        assert!(met > 20 && missed > 100, "{met} {missed}");
        let unit = [Vec3::ZERO, Vec3::ONE];
        assert!(
            crosses(unit, Vec3::new(0.5, 3.0, 0.5), Vec3::NEG_Y, 2.5)
                && !crosses(unit, Vec3::new(0.5, 3.0, 0.5), Vec3::NEG_Y, 1.5)
        );
        assert!(!crosses(unit, Vec3::new(1.5, 3.0, 0.5), Vec3::NEG_Y, 9.0) && !crosses(unit, Vec3::splat(3.0), Vec3::Y, 9.0));
    }

    #[test]
    fn triangles_are_told_by_their_runs() {
        let change = Change::new(vec![[0, 0, 5], [9, 5, 3]], Vec::new(), Vec::new());
        assert_eq!([0, 4, 5, 8, 9, 11, 12].map(|t| change.now(t)), [Some(0), Some(4), None, None, Some(5), Some(7), None]);
    }
}
