//! What rays have met, to be kept: whoever asks again under other suns, another sky or another albedo traces none of them.
//!
//! A gather's rays depend on the points and the surfaces alone; suns and albedo decide only which points look again and what the hits bring.
//! A hit is kept as the ray engine told it, the triangle and the distance, eight bytes; where on the triangle it lies is reckoned from these
//! whether it was kept or just traced ([`Surfaces`] does so), so that both give the same numbers to the bit.

use crate::block_bytes::{number, put_list, take, take_groups, take_list};
use crate::cells::BACK;
use crate::gather::{Direction, unit_ranges};
use crate::{LightError, LightParams, Surfaces};
use glam::Vec3;
use heliodon_rays::{Hit, NO_HIT, facing, set_bits};
use std::ops::Range;

/// Eight bytes that name the format and its version.
const MAGIC: [u8; 8] = *b"HELTRAC2";

/// A hit as it is kept: the triangle of the rays' scene, whose highest bit tells the back, and the bits of the distance.
pub(crate) type KeptHit = [u32; 2];

/// A hit of the ray engine, to be kept; a miss is `None`.
pub(crate) fn kept(hit: &Hit) -> Option<KeptHit> {
    (hit.triangle != NO_HIT).then(|| [hit.triangle | if hit.back { BACK } else { 0 }, hit.t.to_bits()])
}

/// The engine's hit; its place on the triangle is still to be told.
pub(crate) fn of_kept([triangle, t]: KeptHit) -> Hit {
    Hit { triangle: triangle & !BACK, t: f32::from_bits(t), u: 0.0, v: 0.0, back: triangle & BACK != 0 }
}

/// What the rays of some points met in the directions of a lattice.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Met {
    /// For each direction a bit for each point whose ray met something, in words of 64 points.
    pub bits: Vec<u64>,
    /// What they met, in the order of the bits.
    pub hits: Vec<KeptHit>,
}

/// What is known of some points' rays before they are traced.
pub(crate) struct Known {
    /// For each direction a bit for each point whose ray is known; `None`: all are.
    known: Option<Vec<u64>>,
    met: Met,
}

impl Known {
    /// All rays.
    pub fn all(met: Met) -> Self {
        Self { known: None, met }
    }

    /// The rays that have a bit in `known`.
    pub fn of(known: Vec<u64>, met: Met) -> Self {
        Self { known: Some(known), met }
    }

    /// What is known of the rays of those `wanted` points that are among `points`, both ascending, of which this tells.
    pub fn of_some(&self, points: &[u32], wanted: &[u32]) -> Self {
        let met = &self.met;
        let (words, new_words) = (points.len().div_ceil(64), wanted.len().div_ceil(64));
        let places: Vec<Option<usize>> = wanted.iter().map(|point| points.binary_search(point).ok()).collect();
        let mut some = Met::default();
        let mut known = Vec::with_capacity(met.bits.len().div_ceil(words.max(1)) * new_words);
        let mut first = 0;
        let mut of_point = vec![None; points.len()];
        for (direction, met_words) in met.bits.chunks_exact(words.max(1)).enumerate() {
            let known_words = self.known.as_ref().map(|known| &known[direction * words..(direction + 1) * words]);
            let is_known = |point: usize| known_words.is_none_or(|known| known[point / 64] >> (point % 64) & 1 == 1);
            of_point.fill(None);
            for point in set_bits(met_words) {
                of_point[point] = met.hits.get(first).copied();
                first += 1;
            }
            let begin = some.bits.len();
            some.bits.resize(begin + new_words, 0);
            known.resize(begin + new_words, 0);
            for (i, point) in places.iter().enumerate().filter_map(|(i, place)| Some((i, (*place).filter(|&p| is_known(p))?))) {
                known[begin + i / 64] |= 1 << (i % 64);
                if let Some(hit) = of_point[point] {
                    some.bits[begin + i / 64] |= 1 << (i % 64);
                    some.hits.push(hit);
                }
            }
        }
        Self { known: Some(known), met: some }
    }
}

/// How many rays there are, and how many of them were not known before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Rays {
    pub all: u64,
    pub traced: u64,
}

impl Rays {
    /// The sum.
    pub fn plus(self, more: Self) -> Self {
        Self { all: self.all + more.all, traced: self.traced + more.traced }
    }

    /// Adds rays that were traced.
    pub fn add(&mut self, rays: u64) {
        self.all += rays;
        self.traced += rays;
    }
}

/// As [`crate::gather::for_each_direction`], where rays may be known; returns what all of them met.
pub(crate) fn for_each_known_direction(
    surfaces: &Surfaces,
    (origins, normals): (&[Vec3], &[Vec3]),
    directions: &[Vec3],
    known: Option<&Known>,
    mut then: impl FnMut(&Direction),
) -> (Met, Rays) {
    let words = origins.len().div_ceil(64);
    let (mut active, mut asked) = (vec![0_u64; words], vec![0_u64; words]);
    let (mut raw, mut hits) = (vec![Hit::MISS; origins.len()], vec![Hit::MISS; origins.len()]);
    let (mut met, mut rays) = (Met { bits: Vec::with_capacity(words * directions.len()), hits: Vec::new() }, Rays::default());
    let mut next = known.map(|known| known.met.hits.iter());
    for (index, &direction) in directions.iter().enumerate() {
        rays.all += u64::from(facing(normals, direction, &mut active));
        let of_direction = index * words..(index + 1) * words;
        for (word, asked) in asked.iter_mut().enumerate() {
            let known =
                known.map_or(0, |known| known.known.as_ref().map_or(u64::MAX, |known| known[of_direction.start + word]));
            *asked = active[word] & !known;
        }
        let traced: u32 = asked.iter().map(|word| word.count_ones()).sum();
        rays.traced += u64::from(traced);
        if traced > 0 {
            surfaces.rays.closest_parallel(origins, direction, &asked, &mut raw);
        }
        for word in 0..words {
            let known_met = known.map_or(0, |known| known.met.bits[of_direction.start + word]);
            let mut met_now = 0;
            for bit in set_bits(&[active[word]]) {
                let point = word * 64 + bit;
                let hit = if asked[word] >> bit & 1 == 1 {
                    kept(&raw[point])
                } else if known_met >> bit & 1 == 1 {
                    next.as_mut().and_then(Iterator::next).copied()
                } else {
                    None
                };
                hits[point] = match hit {
                    Some(hit) => {
                        met_now |= 1 << bit;
                        met.hits.push(hit);
                        surfaces.told(origins[point], direction, of_kept(hit))
                    }
                    None => Hit::MISS,
                };
            }
            met.bits.push(met_now);
        }
        then(&Direction { index, direction, active: &active, hits: &hits });
    }
    (met, rays)
}

/// What the rays of a run of points met that are gathered together.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct UnitTraces {
    /// In the lattice that all points look in.
    pub first: Met,
    /// The points that looked in further lattices, ascending.
    pub erring: Vec<u32>,
    /// What they met there, lattice by lattice; nothing where only the sky was looked for.
    pub further: Vec<Met>,
    /// For each point how much of its view insides of things fill, and the rays that told so besides those of the first lattice.
    pub back: Vec<f32>,
    pub back_rays: u64,
    /// What followed paths met, group by group of points: how many rays, then the hits; a miss is [`MISSED`].
    pub path_counts: Vec<u32>,
    pub paths: Vec<KeptHit>,
}

/// What is known of the rays of such a run.
pub(crate) struct KnownUnit {
    pub first: Known,
    pub erring: Vec<u32>,
    pub further: Vec<Known>,
    /// As in [`UnitTraces`], with the number of rays.
    pub back: Option<(Vec<f32>, u64)>,
    pub path_counts: Vec<u32>,
    pub paths: Vec<KeptHit>,
}

impl From<UnitTraces> for KnownUnit {
    fn from(traces: UnitTraces) -> Self {
        let UnitTraces { first, erring, further, back, back_rays, path_counts, paths } = traces;
        let further = further.into_iter().map(Known::all).collect();
        Self { first: Known::all(first), erring, further, back: Some((back, back_rays)), path_counts, paths }
    }
}

/// A path's ray that met nothing.
pub(crate) const MISSED: KeptHit = [NO_HIT, 0];

/// What the rays of a range of points met. Good for the same points among the same surfaces, with the same samples and seed; followed paths
/// depend on albedo and bounces as well ([`Traces::without_paths`]).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Traces {
    /// The points.
    pub range: Range<usize>,
    /// Run by run; `None` where it would take more than the budget of kept hits.
    pub(crate) units: Vec<Option<UnitTraces>>,
    /// Rays that were traced because they were not known.
    pub traced: u64,
}

impl Traces {
    /// The same, for surfaces of another albedo or another number of bounces.
    #[must_use]
    pub fn without_paths(mut self) -> Self {
        for unit in self.units.iter_mut().flatten() {
            (unit.path_counts, unit.paths) = (Vec::new(), Vec::new());
        }
        self
    }

    /// Whether they are of these points, and name nothing that is not there.
    ///
    /// # Errors
    /// What is wrong.
    pub fn validate(&self, range: &Range<usize>, surfaces: &Surfaces, params: &LightParams) -> Result<(), LightError> {
        let triangles = surfaces.detail.map_or(surfaces.triangles.len(), |detail| detail.stands_for.len());
        self.validate_among(range, triangles, params)
    }

    /// The same for other surfaces, whose rays could meet so many triangles.
    ///
    /// # Errors
    /// As [`Traces::validate`].
    pub fn validate_among(&self, range: &Range<usize>, triangles: usize, params: &LightParams) -> Result<(), LightError> {
        let wrong = |what| Err(LightError::Block(what));
        let runs = unit_ranges(range);
        if self.range != *range || self.units.len() != runs.len() {
            return wrong("traces of other points");
        }
        let named = |hit: &KeptHit| ((hit[0] & !BACK) as usize) < triangles && f32::from_bits(hit[1]).is_finite();
        let fits = |met: &Met, points: usize| {
            let hits: usize = met.bits.iter().map(|word| word.count_ones() as usize).sum();
            met.bits.len() == params.directions() as usize * points.div_ceil(64)
                && hits == met.hits.len()
                && met.hits.iter().all(named)
        };
        for (unit, run) in self.units.iter().zip(runs).filter_map(|(unit, run)| Some((unit.as_ref()?, run))) {
            let looked = unit.erring.iter().all(|&point| (point as usize) < run.len()) && unit.erring.is_sorted();
            let further = unit.further.len() <= params.further_lattices as usize;
            if !fits(&unit.first, run.len()) || !looked || !further || unit.back.len() != run.len() {
                return wrong("traces that do not fit their points");
            }
            if !unit.further.iter().all(|met| fits(met, unit.erring.len())) {
                return wrong("traces of further looks that do not fit");
            }
            let counted = unit.path_counts.iter().map(|&count| count as usize).sum::<usize>() == unit.paths.len();
            if !counted || !unit.paths.iter().all(|hit| *hit == MISSED || named(hit)) {
                return wrong("paths that do not fit");
            }
        }
        Ok(())
    }

    /// As bytes, without a checksum.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = Vec::new();
        out.extend(MAGIC);
        for number in [self.range.start as u64, self.range.end as u64, self.units.len() as u64] {
            out.extend(number.to_le_bytes());
        }
        for unit in &self.units {
            out.push(u8::from(unit.is_some()));
            let Some(unit) = unit else { continue };
            put_list(&mut out, &unit.erring, |x| x.to_le_bytes());
            put_list(&mut out, &unit.back, |x| x.to_le_bytes());
            out.extend(unit.back_rays.to_le_bytes());
            put_list(&mut out, &unit.path_counts, |x| x.to_le_bytes());
            put_list(&mut out, unit.paths.as_flattened(), |x| x.to_le_bytes());
            out.extend((unit.further.len() as u64).to_le_bytes());
            for met in std::iter::once(&unit.first).chain(&unit.further) {
                put_list(&mut out, &met.bits, |x| x.to_le_bytes());
                put_list(&mut out, met.hits.as_flattened(), |x| x.to_le_bytes());
            }
        }
        out
    }

    /// From their bytes; check them with [`Traces::validate`].
    ///
    /// # Errors
    /// Bytes of something else, too few or too many of them.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, LightError> {
        let mut rest = bytes;
        if take::<8>(&mut rest)? != MAGIC {
            return Err(LightError::Block("of another format or version"));
        }
        let [start, end, count] = [number(&mut rest)?, number(&mut rest)?, number(&mut rest)?];
        let range = usize::try_from(start).ok().zip(usize::try_from(end).ok()).filter(|(start, end)| start <= end);
        let (start, end) = range.ok_or(LightError::Block("a range that is none"))?;
        let mut units = Vec::new();
        for _ in 0..count {
            units.push(if take(&mut rest)? == [0] { None } else { Some(UnitTraces::taken(&mut rest)?) });
        }
        if !rest.is_empty() {
            return Err(LightError::Block("more bytes than it should have"));
        }
        Ok(Self { range: start..end, units, traced: 0 })
    }
}

impl UnitTraces {
    fn taken(rest: &mut &[u8]) -> Result<Self, LightError> {
        let (erring, back) = (take_list(rest, u32::from_le_bytes)?, take_list(rest, f32::from_le_bytes)?);
        let back_rays = number(rest)?;
        let (path_counts, paths) = (take_list(rest, u32::from_le_bytes)?, take_groups(rest)?);
        let further = number(rest)?;
        let mut met = || Ok::<_, LightError>(Met { bits: take_list(rest, u64::from_le_bytes)?, hits: take_groups(rest)? });
        let first = met()?;
        let further = (0..further).map(|_| met()).collect::<Result<_, _>>()?;
        Ok(Self { first, erring, further, back, back_rays, path_counts, paths })
    }
}
