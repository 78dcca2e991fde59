//! The gather: what every point sees in each of the fixed directions.
//!
//! Light that escapes to the sky is summed at once into the transfer coefficients
//! `T_i = 1/pi integral V(w) max(n.w, 0) y_i(w) dw`; of what meets a surface, the cell is kept (four bytes a hit), for the same
//! hits serve every bounce of sky and sun: bounces are linear in the light of the cells. The sun's first bounce is summed at once too,
//! step by step of the day, from the very places that are met.
//!
//! The lattice's sum over all directions differs a little from the integral. Its known part is taken out: with the exact
//! coefficients `O_i` of an open surface, the sums `E_i` over escaped and `A_i` over all directions, and the visible part
//! `V = E_0 / A_0`, `T_i = E_i + V (O_i - A_i)` is exact for an open point and 0 for a closed one.

use crate::cells::{Among, BACK};
use crate::change::KnownTraces;
use crate::directions::gather_directions;
use crate::follow::{Arrival, Followed, follow};
use crate::inside::{BACK_LIMIT, SHUT, look_from_unmoved, look_through};
use crate::look::Look;
use crate::traces::{KnownUnit, Rays, Traces, UnitTraces};
use crate::{BouncedSun, Layout, LightError, LightParams, PointSet, Surfaces};
use glam::Vec3;
use heliodon_math::sh::{basis9, open_transfer9};
use heliodon_rays::{Hit, NO_HIT, facing, morton_order, set_bits};
use rayon::prelude::*;
use std::ops::Range;

/// Points that are gathered together: their rays of one direction are one call, their sums stay in the cache.
pub(crate) const UNIT: usize = 1024;

/// A point whose likely error is larger than this over the number of samples looks around in further lattices.
const ERROR_PER_SAMPLE: f32 = 20.0;

/// The same where no sun bounces: to see whether the sky is seen costs less.
const SKY_ERROR_PER_SAMPLE: f32 = 5.0;

/// Rays that escape below the horizon do not speak for the open, but never count for nothing by more than this part of all.
const LEAST_COUNTED: f32 = 0.5;

/// What a run of points sees.
#[derive(Clone, Debug, PartialEq)]
pub struct GatherBlock {
    /// The points, in the layout's order.
    pub range: Range<usize>,
    /// C transfer coefficients of the sky's own light for each point.
    pub sky: Vec<f32>,
    /// R functions of the day of the sun's first bounce for each point, function-major, then channel; sums that `scale` makes means.
    pub sun: Vec<f32>,
    /// What each point's cosines must be multiplied with so that those of all its directions sum to one; 0 where a point has
    /// no direction.
    pub scale: Vec<f32>,
    /// The cosine-weighted part of each point's rays that met back faces. Rays that escape below the horizon are left out of the
    /// whole, up to half of it: the foot of a column that stands in an open sheet of ground sees the sheet's back above it and
    /// nothing below, and lies inside all the same. Where next to nothing of the sky is seen it is, if larger, the part of rays
    /// upwards that leave more surfaces than they enter: insides of stones are full of the fronts of others that reach into them.
    pub back: Vec<f32>,
    /// Cells whose back was met by points that do not lie inside something themselves, and how often; sorted.
    pub back_cells: Vec<[u32; 2]>,
    /// The hits of each run of points; `None` where they were too many to keep: they are taken from where [`crate::KeptBounces`] has them for each bounce, or
    /// traced again.
    pub hits: Vec<Option<UnitHits>>,
    /// What followed hits bring to each run of points.
    pub followed: Vec<Followed>,
    /// Rays that were traced.
    pub rays: u64,
}

impl GatherBlock {
    /// Lets go of hits beyond the budget, as [`gather`] does: who gathered may have had another. The light is the same whatever is kept.
    pub fn stay_within_budget(&mut self, layout: &Layout, params: &LightParams) {
        for (hits, points) in self.hits.iter_mut().zip(unit_ranges(&self.range)) {
            hits.take_if(|hits| !hits.are_kept(points.len(), layout, params));
        }
    }
}

/// What the rays of a run of points met, direction by direction.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UnitHits {
    /// For each direction, a bit for each point whose ray met something, in words of 64 points.
    pub met: Vec<u64>,
    /// The cells met, in the order of the bits; the highest bit tells the back.
    pub cells: Vec<u32>,
}

impl UnitHits {
    fn bytes(&self) -> usize {
        self.met.len() * 8 + self.cells.len() * 4
    }

    /// Whether those of so many points are kept. Every point has its part of the budget, whatever the others need: results do not depend on what is kept.
    fn are_kept(&self, points: usize, layout: &Layout, params: &LightParams) -> bool {
        let per_point = params.hit_budget_bytes as f64 / layout.points().len().max(1) as f64;
        self.bytes() as f64 <= per_point * points as f64
    }
}

/// The gather's fixed directions with what is the same for all points.
pub(crate) struct Lattice {
    /// Along a Morton curve: rays that follow one another meet the same boxes and cells.
    pub directions: Vec<Vec3>,
    pub basis: Vec<[f32; 9]>,
    /// Which half of the lattice each belongs to, 0 or 1: every other one of the spiral.
    pub halves: Vec<usize>,
}

impl Lattice {
    /// The lattice whose hits are kept.
    pub fn new(params: &LightParams) -> Self {
        Self::turned(params, 0)
    }

    /// That one, and those that are looked in where it errs.
    pub fn all(params: &LightParams) -> Vec<Self> {
        (0..=params.further_lattices).map(|number| Self::turned(params, number)).collect()
    }

    fn turned(params: &LightParams, number: u32) -> Self {
        let lattice = gather_directions(params.directions(), params.seed ^ (number << 16));
        let order = morton_order(&lattice);
        let directions: Vec<Vec3> = order.iter().map(|&of| lattice[of as usize]).collect();
        let basis = directions.iter().map(|&d| basis9(d)).collect();
        Self { directions, basis, halves: order.iter().map(|of| (of % 2) as usize).collect() }
    }
}

/// Gathers the points in `range`; `sun` is what the suns shine on where their light bounces. Ranges may be computed apart, in any
/// order: every number is the same however the points are divided. Multiples of 1,024 points are fastest.
///
/// # Errors
/// Invalid parameters or a range beyond the points.
pub fn gather(
    surfaces: &Surfaces,
    layout: &Layout,
    sun: Option<&BouncedSun>,
    range: Range<usize>,
    params: &LightParams,
) -> Result<GatherBlock, LightError> {
    let (mut block, _) = gather_knowing(surfaces, layout, sun, range, params, None)?;
    block.stay_within_budget(layout, params);
    Ok(block)
}

/// As [`gather`], which traces only rays that are not `known` from an earlier gather of the same points ([`Traces`]), and hands out what all
/// of them met. The block is the same whatever is known; it holds all hits, whatever their budget is ([`GatherBlock::stay_within_budget`]).
///
/// # Errors
/// As [`gather`], and traces of other points.
pub fn gather_knowing(
    surfaces: &Surfaces,
    layout: &Layout,
    sun: Option<&BouncedSun>,
    range: Range<usize>,
    params: &LightParams,
    known: Option<KnownTraces>,
) -> Result<(GatherBlock, Traces), LightError> {
    params.validate()?;
    if range.start > range.end || range.end > layout.points().len() {
        return Err(LightError::Mismatch(format!("points {range:?} of {}", layout.points().len())));
    }
    let lattices = Lattice::all(params);
    let runs = unit_ranges(&range);
    let known = match known {
        Some(known) if known.units.len() != runs.len() => return Err(LightError::Block("traces of other points")),
        Some(known) => known.units,
        None => runs.iter().map(|_| None).collect(),
    };
    let units: Vec<(Unit, Option<UnitTraces>)> = runs
        .into_par_iter()
        .zip(known)
        .map(|(unit, known)| {
            let (unit, traces) = gather_unit(surfaces, layout.own(), sun, unit, params, &lattices, known);
            let traces = unit.hits.are_kept(unit.scale.len(), layout, params).then_some(traces);
            (unit, traces)
        })
        .collect();
    let mut traces = Traces { range: range.clone(), ..Traces::default() };
    let mut block = GatherBlock {
        range,
        sky: Vec::new(),
        sun: Vec::new(),
        scale: Vec::new(),
        back: Vec::new(),
        back_cells: Vec::new(),
        hits: Vec::new(),
        followed: Vec::new(),
        rays: 0,
    };
    for (unit, of_unit) in units {
        traces.units.push(of_unit);
        traces.traced += unit.rays.traced;
        block.sky.extend(unit.sky);
        block.sun.extend(unit.sun);
        block.scale.extend(unit.scale);
        block.back.extend(unit.back);
        block.back_cells.extend(unit.back_cells);
        block.followed.push(unit.followed);
        block.rays += unit.rays.all;
        block.hits.push(Some(unit.hits));
    }
    block.back_cells = counted(block.back_cells);
    Ok((block, traces))
}

/// The runs of points that are gathered together.
pub(crate) fn unit_ranges(range: &Range<usize>) -> Vec<Range<usize>> {
    range.clone().step_by(UNIT).map(|first| first..(first + UNIT).min(range.end)).collect()
}

/// [`GatherBlock`] of a run of points.
pub(crate) struct Unit {
    sky: Vec<f32>,
    sun: Vec<f32>,
    pub scale: Vec<f32>,
    pub back: Vec<f32>,
    back_cells: Vec<[u32; 2]>,
    hits: UnitHits,
    followed: Followed,
    /// Harmonic means of the distances of all that points see, metres; infinite of what sees nothing but the sky.
    pub reach_m: Vec<f32>,
    pub rays: Rays,
}

impl Unit {
    /// As a block of its own.
    pub fn into_block(self, range: Range<usize>) -> GatherBlock {
        GatherBlock {
            range,
            sky: self.sky,
            sun: self.sun,
            scale: self.scale,
            back: self.back,
            back_cells: self.back_cells,
            hits: vec![Some(self.hits)],
            followed: vec![self.followed],
            rays: self.rays.all,
        }
    }

    /// The sun's first bounce, that of followed hits with it: `sun_lanes` numbers a point.
    pub fn first_bounce(&self, sky_lanes: usize, sun_lanes: usize) -> Vec<f32> {
        let mut sums = self.sun.clone();
        for (&key, light) in self.followed.keys.iter().zip(self.followed.light.chunks_exact(sky_lanes + sun_lanes)) {
            let Arrival { point, bounce } = Arrival::of(key);
            if bounce == 1 {
                let sums = &mut sums[point * sun_lanes..(point + 1) * sun_lanes];
                sums.iter_mut().zip(&light[sky_lanes..]).for_each(|(sum, x)| *sum += x);
            }
        }
        sums
    }
}

/// Only the hits of some points, for bounces whose hits were not kept.
pub(crate) fn trace_hits(surfaces: &Surfaces, among: Among, range: Range<usize>, lattice: &Lattice) -> UnitHits {
    let mut hits = UnitHits::default();
    let (origins, normals) = among.points.run(range);
    let directions = lattice.directions.iter().copied();
    for_each_direction(surfaces, origins, normals, directions, |at| at.keep(among.layout, &mut hits));
    hits
}

/// Gathers a run of at most [`UNIT`] points; the first of the lattices is looked in by all, the others by points that err. Rays that are
/// `known` are not traced.
pub(crate) fn gather_unit(
    surfaces: &Surfaces,
    among: Among,
    sun: Option<&BouncedSun>,
    range: Range<usize>,
    params: &LightParams,
    lattices: &[Lattice],
    known: Option<KnownUnit>,
) -> (Unit, UnitTraces) {
    let (first, coefficients, lattice) = (range.start, params.coefficients, &lattices[0]);
    let (layout, (origins, normals)) = (among.layout, among.points.run(range));
    let count = normals.len();
    let mut hits = UnitHits::default();
    let known = known.as_ref();
    let points = (origins, normals);
    let (mut look, first_met) =
        Look::around(surfaces, layout, sun, points, (lattice, known.map(|known| &known.first)), Some(&mut hits));

    let y0 = basis9(Vec3::Y)[0];
    let over = |sum: f32, x: f32| if sum > 0.0 { x / sum } else { 0.0 };
    let reach_m = look.nearness.iter().enumerate().map(|(point, &near)| look.all(point) / y0 / near).collect();
    let scale: Vec<f32> = (0..count).map(|point| over(look.all(point), y0)).collect();
    let counted = |point: usize| (1.0 - look.sunk[point] * scale[point]).max(LEAST_COUNTED);
    let (back, back_rays) = match known.and_then(|known| known.back.as_ref()) {
        Some((back, rays)) => {
            look.rays.all += rays;
            (back.clone(), *rays)
        }
        None => {
            let mut back: Vec<f32> = (0..count).map(|point| look.back[point] * scale[point] / counted(point)).collect();
            let mut rays = look_from_unmoved(surfaces, among.points, first..first + count, lattice, params.offset_m, &mut back);
            let is_shut = |&point: &usize| back[point] <= BACK_LIMIT && look.open_part(point) < SHUT;
            let shut: Vec<usize> = (0..count).filter(is_shut).collect();
            rays += look_through(surfaces, origins, &shut, lattice, &mut back);
            look.rays.add(rays);
            (back, rays)
        }
    };

    // what lies inside shows what it borrows
    let limit = if sun.is_some() { ERROR_PER_SAMPLE } else { SKY_ERROR_PER_SAMPLE } / params.samples as f32;
    let errs = |&point: &u32| back[point as usize] <= BACK_LIMIT && look.likely_error(point as usize, sun) > limit;
    let erring: Vec<u32> = if lattices.len() > 1 { (0..count as u32).filter(errs).collect() } else { Vec::new() };
    let of_erring = |all: &[Vec3]| erring.iter().map(|&point| all[point as usize]).collect::<Vec<_>>();
    let (origins, erring_normals) = (of_erring(origins), of_erring(normals));
    let once: Vec<f32> = (0..count).map(|point| look.all(point)).collect();
    let mut further = Vec::new();
    for (number, lattice) in lattices[1..].iter().enumerate().filter(|_| !erring.is_empty()) {
        let points = (origins.as_slice(), erring_normals.as_slice());
        let more = match sun {
            Some(_) => {
                let met = known.and_then(|known| Some((known.further.get(number)?, &known.erring)));
                let known = met.map(|(met, points)| met.of_some(points, &erring));
                let (more, met) = Look::around(surfaces, layout, sun, points, (lattice, known.as_ref()), None);
                further.push(met);
                more
            }
            None => Look::for_sky(surfaces, points, lattice),
        };
        look.add(&erring, more);
    }
    let erring = if further.is_empty() { Vec::new() } else { erring };
    // what the points that looked several times saw counts as if they had once
    let share: Vec<f32> = (0..count).map(|point| over(look.all(point), once[point])).collect();

    let mut unit = Unit {
        sky: Vec::with_capacity(count * coefficients),
        sun: Vec::new(),
        scale,
        back,
        back_cells: Vec::new(),
        hits,
        followed: Followed::default(),
        reach_m,
        rays: look.rays,
    };
    for point in 0..count {
        let (escaped, stopped) = (&look.escaped[point], &look.stopped[point]);
        let visible = over(look.all(point), escaped[0]);
        // 4 pi / count, divided by pi
        let weight = 4.0 / lattice.directions.len() as f32 * share[point];
        let open = open_transfer9(normals[point]);
        unit.sky.extend((0..coefficients).map(|i| {
            let (escaped, stopped) = (escaped[i] * weight, stopped[i] * weight);
            if visible >= 1.0 { open[i] } else { escaped + visible * (open[i] - (escaped + stopped)) }
        }));
        if let Some(sun) = sun {
            let (even, odd) = look.curves(point);
            let curves: Vec<f32> = even.iter().zip(odd).map(|(e, o)| (e + o) * share[point]).collect();
            sun.project(&curves, &mut unit.sun);
        }
    }
    unit.back_cells = met_back_cells(&unit.hits, &unit.back);
    let mut near = look.near;
    near.retain(|n| unit.back[n.point as usize] <= BACK_LIMIT);
    let known_paths = known.map(|known| (known.path_counts.as_slice(), known.paths.as_slice()));
    let done = follow(surfaces, among, sun, params, (first, near), known_paths);
    unit.followed = done.followed;
    unit.rays.all += done.rays.all;
    unit.rays.traced += done.rays.traced;
    let (path_counts, paths) = (done.counts, done.paths);
    let traces = UnitTraces { first: first_met, erring, further, back: unit.back.clone(), back_rays, path_counts, paths };
    (unit, traces)
}

/// Every how-maniest direction tells whether a back lies in a closed inside.
const PROBE_STRIDE: usize = 4;

/// For each point whether all that it sees is backs: what lies so lies within a closed stone, and gets no light.
pub(crate) fn sees_only_backs(surfaces: &Surfaces, points: &PointSet, params: &LightParams) -> Vec<bool> {
    let directions = gather_directions(params.directions(), params.seed);
    let look = |range: Range<usize>| {
        let mut closed = vec![true; range.len()];
        let (origins, normals) = points.run(range);
        for_each_direction(surfaces, origins, normals, directions.iter().copied().step_by(PROBE_STRIDE), |at| {
            for point in set_bits(at.active) {
                closed[point] &= at.hits[point].triangle != NO_HIT && at.hits[point].back;
            }
        });
        closed
    };
    unit_ranges(&(0..points.len())).into_par_iter().flat_map_iter(look).collect()
}

/// Cells whose back was met by points that do not themselves lie inside something.
fn met_back_cells(hits: &UnitHits, back: &[f32]) -> Vec<[u32; 2]> {
    let words = back.len().div_ceil(64);
    let mut cells = Vec::new();
    let mut next = hits.cells.iter();
    for met in hits.met.chunks(words.max(1)) {
        for (point, &cell) in set_bits(met).zip(&mut next) {
            if cell & BACK != 0 && back[point] <= BACK_LIMIT {
                cells.push([cell & !BACK, 1]);
            }
        }
    }
    counted(cells)
}

/// Each cell once, sorted, with the sum of its counts.
pub(crate) fn counted(mut cells: Vec<[u32; 2]>) -> Vec<[u32; 2]> {
    cells.sort_unstable();
    cells.dedup_by(|next, first| {
        let same = next[0] == first[0];
        if same {
            first[1] = first[1].saturating_add(next[1]);
        }
        same
    });
    cells
}

/// The rays of a run of points in one direction.
pub(crate) struct Direction<'a> {
    pub index: usize,
    pub direction: Vec3,
    pub active: &'a [u64],
    pub hits: &'a [Hit],
}

impl Direction<'_> {
    pub fn keep(&self, layout: &Layout, kept: &mut UnitHits) {
        for (word, &active) in self.active.iter().enumerate() {
            let mut met = 0;
            for bit in set_bits(&[active]) {
                let hit = &self.hits[word * 64 + bit];
                if hit.triangle != NO_HIT && !layout.is_near(hit) {
                    met |= 1 << bit;
                    kept.cells.push(layout.cell_of_hit(hit));
                }
            }
            kept.met.push(met);
        }
    }
}

/// Traces some points in all directions; returns the number of rays.
pub(crate) fn for_each_direction(
    surfaces: &Surfaces,
    origins: &[Vec3],
    normals: &[Vec3],
    directions: impl Iterator<Item = Vec3>,
    mut then: impl FnMut(&Direction),
) -> u64 {
    let mut active = vec![0_u64; origins.len().div_ceil(64)];
    let mut hits = vec![Hit::MISS; origins.len()];
    let mut rays = 0;
    for (index, direction) in directions.enumerate() {
        let count = facing(normals, direction, &mut active);
        if count > 0 {
            surfaces.closest_parallel(origins, direction, &active, &mut hits);
        }
        rays += u64::from(count);
        then(&Direction { index, direction, active: &active, hits: &hits });
    }
    rays
}

impl GatherBlock {
    /// Whether lengths, bits and cells agree with a layout, parameters and the number of the day's functions that bounce.
    ///
    /// # Errors
    /// What is wrong.
    pub fn validate(&self, layout: &Layout, functions: usize, params: &LightParams) -> Result<(), LightError> {
        let wrong = |what| Err(LightError::Block(what));
        let (count, channels) = (self.range.len(), params.channels.count());
        if self.range.end > layout.points().len() {
            return wrong("points that the layout has not");
        }
        let right = [(&self.sky, params.coefficients), (&self.sun, functions * channels), (&self.scale, 1), (&self.back, 1)];
        if right.iter().any(|(list, of_point)| list.len() != count * of_point) {
            return wrong("numbers and points do not agree");
        }
        if !right.iter().all(|(list, _)| list.iter().all(|x| x.is_finite())) {
            return wrong("numbers that are not finite");
        }
        let cells = layout.front_cell_count();
        if self.back_cells.iter().any(|c| c[0] as usize >= cells) {
            return wrong("cells that the layout has not");
        }
        let units = unit_ranges(&self.range);
        if self.followed.len() != units.len() {
            return wrong("paths of another number of points");
        }
        for (followed, unit) in self.followed.iter().zip(&units) {
            followed.validate(unit.len(), cells, (params.coefficients + functions) * channels)?;
        }
        if self.hits.len() != units.len() {
            return wrong("hits of another number of points");
        }
        for (hits, unit) in self.hits.iter().zip(units).filter_map(|(hits, unit)| Some((hits.as_ref()?, unit))) {
            if hits.met.len() != params.directions() as usize * unit.len().div_ceil(64) {
                return wrong("hits of another number of directions");
            }
            if hits.met.iter().map(|w| w.count_ones() as usize).sum::<usize>() != hits.cells.len() {
                return wrong("hits and cells do not agree");
            }
            if hits.cells.iter().any(|&c| (c & !BACK) as usize >= cells) {
                return wrong("cells that the layout has not");
            }
        }
        Ok(())
    }

    /// The same block of points in free space, of which the layout has the first at another place than when they were gathered.
    #[must_use]
    pub fn moved_to(self, first: usize) -> Self {
        Self { range: first..first + self.range.len(), ..self }
    }

    /// Bytes of the kept hits and of what was followed.
    #[must_use]
    pub fn hit_bytes(&self) -> usize {
        self.hits.iter().flatten().map(UnitHits::bytes).sum::<usize>()
            + self.followed.iter().map(Followed::bytes).sum::<usize>()
    }
}
