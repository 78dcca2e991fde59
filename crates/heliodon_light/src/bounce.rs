//! Bounces: light from cell to point to cell over the kept hits.
//!
//! With the gather `G` (a point's light from the cells it sees) and the albedo `rho`, sky light that has bounced up to B times is
//! `z_B`, from `z_0 = 0` and `z_{b+1} = G rho (s + z_b)`, where `s` arrives directly. Sunlight's first bounce `f` was summed when its
//! rays were traced: `z_{b+1} = f + G rho z_b`, and only its first functions go on. Sky coefficients, functions of the sun and colour channels are lanes of one such sum: a
//! hit is read once for up to sixteen of them. Followed paths add what they bring from sky and sun once they have made their k bounces,
//! and, where they end in a cell, its light of k bounces before.

use crate::cells::{BACK, Layout, NONE};
use crate::follow::{Arrival, MAX_FOLLOWED};
use crate::gather::{GatherBlock, Lattice, UnitHits, bits, trace_hits, unit_ranges};
use crate::inside::BACK_LIMIT;
use crate::surfaces::reflected;
use crate::{Channels, Followed, LightParams, Surfaces, Validity};
use glam::Vec3;
use heliodon_math::color::linear_from_rgb9e5;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::VecDeque;
use std::ops::Range;

/// Lanes that bounce together.
const LANES: usize = 16;

/// Everything that bounces share.
pub(crate) struct Transport<'a> {
    pub surfaces: &'a Surfaces<'a>,
    pub layout: &'a Layout,
    pub blocks: &'a [GatherBlock],
    pub lattice: &'a Lattice,
    /// Albedo of every front cell, then of every cell whose back is lit.
    albedo: Vec<Vec3>,
    /// The points that light a cell, `NONE` where it has fewer than three.
    lit_by: Vec<[u32; 3]>,
}

/// What bounces together: sky coefficients first, then functions of the sun, each with its colour channels.
#[derive(Clone, Copy)]
pub(crate) struct Lanes {
    pub coefficients: usize,
    /// Functions of the day, R.
    pub functions: usize,
    /// Those of them that go on after the first bounce.
    going_on: usize,
    pub channels: Channels,
}

impl Lanes {
    pub fn new(params: &LightParams, functions: usize) -> Self {
        let going_on = params.functions_going_on(functions);
        Self { coefficients: params.coefficients, functions, going_on, channels: params.channels }
    }

    pub fn sky(&self) -> usize {
        self.coefficients * self.channels.count()
    }

    pub fn sun(&self) -> usize {
        self.functions * self.channels.count()
    }

    /// Those that go on after the first bounce.
    fn going_on(&self) -> usize {
        self.sky() + self.going_on * self.channels.count()
    }

    pub fn count(&self) -> usize {
        self.sky() + self.sun()
    }
}

/// A run of points that is gathered together, and where its hits are.
pub(crate) struct UnitOf<'a> {
    pub block: &'a GatherBlock,
    pub index: usize,
    pub range: Range<usize>,
}

impl<'a> Transport<'a> {
    pub fn new(
        surfaces: &'a Surfaces<'a>,
        layout: &'a Layout,
        blocks: &'a [GatherBlock],
        validity: &Validity,
        lattice: &'a Lattice,
        channels: Channels,
    ) -> Self {
        let fronts = layout.front_cell_count();
        let albedo_of = |cell: u32| {
            let albedo = match layout.place_of_cell(cell) {
                (triangle, None) => surfaces.albedo.mean(triangle),
                (triangle, Some((u, v))) => surfaces.albedo.albedo(triangle, u, v),
            };
            reflected(albedo, channels)
        };
        let cells = (0..fronts as u32).into_par_iter().map(|cell| (cell, false));
        let backs = layout.back_cells().par_iter().map(|&cell| (cell, true));
        let (albedo, lit_by) = cells
            .chain(backs)
            .map(|(cell, back)| {
                let sites = layout.sites_of_cell(surfaces, cell);
                let points = if back {
                    sites.map(|site| layout.back_point(site).unwrap_or(NONE))
                } else if cell as usize >= surfaces.triangles.len() {
                    sites.map(|site| layout.front_point(site))
                } else {
                    front_points(layout, validity, sites)
                };
                (albedo_of(cell), points)
            })
            .unzip();
        Self { surfaces, layout, blocks, lattice, albedo, lit_by }
    }

    /// The number of a cell that a hit names, or `None` for a back that nothing lights.
    #[inline]
    fn cell_index(&self, cell: u32) -> Option<usize> {
        if cell & BACK == 0 {
            return Some(cell as usize);
        }
        let back = self.layout.back_cells().binary_search(&(cell & !BACK)).ok()?;
        Some(self.layout.front_cell_count() + back)
    }

    /// The points that light a cell, and its albedo in the channels solved.
    fn cell(&self, index: usize) -> (impl Iterator<Item = usize>, Vec3) {
        (self.lit_by[index].into_iter().filter(|&p| p != NONE).map(|p| p as usize), self.albedo[index])
    }

    fn units(&self) -> Vec<UnitOf<'a>> {
        let of_block = |block: &'a GatherBlock| {
            unit_ranges(&block.range).into_iter().enumerate().map(move |(index, range)| UnitOf { block, index, range })
        };
        self.blocks.iter().flat_map(of_block).collect()
    }

    fn hits_of(&self, unit: &UnitOf<'a>) -> Cow<'a, UnitHits> {
        match &unit.block.hits[unit.index] {
            Some(hits) => Cow::Borrowed(hits),
            None => Cow::Owned(trace_hits(self.surfaces, self.layout, unit.range.clone(), self.lattice)),
        }
    }

    /// Light that has bounced up to `bounces` times, a number for each lane of each point.
    pub fn bounced(&self, lanes: Lanes, bounces: u32) -> Vec<f32> {
        let (count, going_on) = (lanes.count(), lanes.going_on());
        let mut all = vec![0.0; self.layout.points().len() * count];
        for first in (0..going_on).step_by(LANES) {
            let width = (going_on - first).min(LANES);
            let mut put = |light: &[f32], padded: usize| {
                for (to, from) in all.chunks_exact_mut(count).zip(light.chunks_exact(padded)) {
                    to[first..first + width].copy_from_slice(&from[..width]);
                }
            };
            match width {
                0..=4 => put(self.bounced_lanes::<4>(lanes, first, bounces).as_flattened(), 4),
                5..=8 => put(self.bounced_lanes::<8>(lanes, first, bounces).as_flattened(), 8),
                9..=12 => put(self.bounced_lanes::<12>(lanes, first, bounces).as_flattened(), 12),
                _ => put(self.bounced_lanes::<16>(lanes, first, bounces).as_flattened(), 16),
            }
        }
        if going_on < count && bounces > 0 {
            for unit in self.units() {
                let points = &mut all[unit.range.start * count..unit.range.end * count];
                unit.add_first_bounce(lanes, bounces as usize, points);
            }
        }
        all
    }

    fn bounced_lanes<const W: usize>(&self, lanes: Lanes, first: usize, bounces: u32) -> Vec<[f32; W]> {
        let points = self.layout.points().len();
        let channels = lanes.channels.count();
        // reckoned once: a division for each lane of each cell took as long as the sums
        let channel_of: [usize; W] = std::array::from_fn(|l| (first + l) % channels);
        let coefficient_of: [usize; W] = std::array::from_fn(|l| (first + l) / channels);
        let sky_lanes = lanes.sky().saturating_sub(first);
        let mut bounced = vec![[0.0_f32; W]; points];
        let units = self.units();
        let arrivals: Vec<Vec<Arrived<W>>> = units.par_iter().map(|unit| arrivals(unit, lanes, first)).collect();
        let paths_end = units.iter().any(|unit| !unit.followed().ends.is_empty());
        // what the cells reflect, the latest first
        let mut reflected: VecDeque<Vec<[f32; W]>> = VecDeque::new();
        for bounce in 0..bounces as usize {
            let oldest = if paths_end { MAX_FOLLOWED } else { 0 };
            let spare = if reflected.len() > oldest { reflected.pop_back() } else { None };
            let mut cells = spare.unwrap_or_else(|| vec![[0.0_f32; W]; self.albedo.len()]);
            let light: Vec<[f32; W]> = units
                .par_iter()
                .flat_map_iter(|unit| {
                    let sky = &unit.block.sky[unit.offset() * lanes.coefficients..];
                    let bounced = &bounced[unit.range.clone()];
                    bounced.iter().zip(sky.chunks_exact(lanes.coefficients)).map(|(z, sky)| {
                        // what arrives directly from the sky; the sun's first bounce has been summed
                        let direct = |l: usize| if l < sky_lanes { sky[coefficient_of[l]] } else { 0.0 };
                        std::array::from_fn(|l| direct(l) + z[l])
                    })
                })
                .collect();
            cells.par_iter_mut().enumerate().for_each(|(index, out)| {
                let (lit_by, albedo) = self.cell(index);
                let (mut sum, mut count) = ([0.0_f32; W], 0.0_f32);
                for point in lit_by {
                    count += 1.0;
                    for (sum, x) in sum.iter_mut().zip(&light[point]) {
                        *sum += x;
                    }
                }
                let mean = if count > 0.0 { 1.0 / count } else { 0.0 };
                *out = std::array::from_fn(|l| sum[l] * (mean * albedo[channel_of[l]]));
            });
            reflected.push_front(cells);
            let gathered: Vec<Vec<[f32; W]>> = units
                .par_iter()
                .zip(&arrivals)
                .map(|(unit, arrivals)| {
                    // sorted by bounce
                    let arrived = arrivals.partition_point(|a| a.bounce <= bounce + 1);
                    self.gathered(unit, &reflected, &arrivals[..arrived], lanes, first)
                })
                .collect();
            for (unit, light) in units.iter().zip(gathered) {
                bounced[unit.range.clone()].copy_from_slice(&light);
            }
        }
        bounced
    }

    /// One unit's light in the lanes from `first` on: the sun's first bounce, from the cells that it sees and from followed paths;
    /// cosine-weighted means.
    fn gathered<const W: usize>(
        &self,
        unit: &UnitOf<'a>,
        reflected: &VecDeque<Vec<[f32; W]>>,
        arrived: &[Arrived<W>],
        lanes: Lanes,
        first: usize,
    ) -> Vec<[f32; W]> {
        let (channels, sky_lanes, sun_lanes) = (lanes.channels.count(), lanes.sky(), lanes.sun());
        let channel_of: [usize; W] = std::array::from_fn(|l| (first + l) % channels);
        let normals = &self.layout.points().normals[unit.range.clone()];
        let hits = self.hits_of(unit);
        let first_bounce = |point: usize| {
            let sun = &unit.block.sun[(unit.offset() + point) * sun_lanes..(unit.offset() + point + 1) * sun_lanes];
            std::array::from_fn(|l| (first + l).checked_sub(sky_lanes).and_then(|lane| sun.get(lane)).copied().unwrap_or(0.0))
        };
        let mut sums: Vec<[f32; W]> = (0..normals.len()).map(first_bounce).collect();
        let mut next = hits.cells.iter();
        for (met, &direction) in hits.met.chunks_exact(normals.len().div_ceil(64)).zip(&self.lattice.directions) {
            for (point, &cell) in bits(met).zip(&mut next) {
                let Some(cell) = self.cell_index(cell) else { continue };
                let cos = normals[point].dot(direction);
                for (sum, x) in sums[point].iter_mut().zip(&reflected[0][cell]) {
                    *sum += cos * x;
                }
            }
        }
        for arrived in arrived {
            for (sum, x) in sums[arrived.point].iter_mut().zip(&arrived.light) {
                *sum += x;
            }
        }
        for &[key, share, cell] in &unit.followed().ends {
            let Arrival { point, bounce } = Arrival::of(key);
            let (Some(cells), Some(cell)) = (reflected.get(bounce), self.cell_index(cell)) else { continue };
            let share = linear_from_rgb9e5(share);
            for ((sum, x), &channel) in sums[point].iter_mut().zip(&cells[cell]).zip(&channel_of) {
                *sum += share[channel] * x;
            }
        }
        for (sum, scale) in sums.iter_mut().zip(&unit.block.scale[unit.offset()..]) {
            for x in sum {
                *x *= scale;
            }
        }
        sums
    }
}

impl<'a> UnitOf<'a> {
    fn followed(&self) -> &'a Followed {
        &self.block.followed[self.index]
    }

    /// Adds, in the lanes that do not go on, the sun's first bounce and what followed paths bring to the numbers of the unit's points.
    fn add_first_bounce(&self, lanes: Lanes, bounces: usize, points: &mut [f32]) {
        let (count, sky_lanes, sun_lanes) = (lanes.count(), lanes.sky(), lanes.sun());
        let mut add = |point: usize, sun: &[f32]| {
            let scale = self.block.scale[self.offset() + point];
            let sums =
                points[point * count..(point + 1) * count].iter_mut().zip(std::iter::repeat_n(&0.0, sky_lanes).chain(sun));
            sums.skip(lanes.going_on()).for_each(|(sum, x)| *sum += x * scale);
        };
        for point in 0..self.range.len() {
            add(point, &self.block.sun[(self.offset() + point) * sun_lanes..(self.offset() + point + 1) * sun_lanes]);
        }
        let followed = self.followed();
        for (&key, light) in followed.keys.iter().zip(followed.light.chunks_exact(count)) {
            let Arrival { point, bounce } = Arrival::of(key);
            if bounce <= bounces {
                add(point, &light[sky_lanes..]);
            }
        }
    }

    /// Its first point in its block.
    fn offset(&self) -> usize {
        self.range.start - self.block.range.start
    }
}

/// Sky and sun that followed paths bring to a point after so many bounces.
struct Arrived<const W: usize> {
    point: usize,
    bounce: usize,
    light: [f32; W],
}

/// What arrives at the points of a unit in the lanes from `first` on, sorted by bounce.
fn arrivals<const W: usize>(unit: &UnitOf, lanes: Lanes, first: usize) -> Vec<Arrived<W>> {
    let followed = unit.followed();
    let arrived = |(&key, light): (&u32, &[f32])| {
        let Arrival { point, bounce } = Arrival::of(key);
        Arrived { point, bounce, light: std::array::from_fn(|l| light.get(first + l).copied().unwrap_or(0.0)) }
    };
    let mut arrived: Vec<_> = followed.keys.iter().zip(followed.light.chunks_exact(lanes.count())).map(arrived).collect();
    arrived.sort_by_key(|a| a.bounce);
    arrived
}

/// The points of a triangle's valid vertices; of those they borrow from where none is valid.
fn front_points(layout: &Layout, validity: &Validity, vertices: [u32; 3]) -> [u32; 3] {
    let any = vertices.iter().any(|&v| validity.valid[v as usize] != 0);
    vertices.map(|v| match (any, validity.valid[v as usize]) {
        (true, 0) => NONE,
        _ => layout.front_point(validity.source[v as usize]),
    })
}

/// Which vertices see the open, those with a direction to look in and no more than half their view filled by insides; and what light
/// the others show.
pub(crate) fn find_validity(surfaces: &Surfaces, layout: &Layout, blocks: &[GatherBlock]) -> Validity {
    let sites = valid_sites(layout, blocks);
    let valid = sites[..layout.vertex_count()].to_vec();
    let mut validity = Validity::new(valid, surfaces.positions, surfaces.normals, surfaces.triangles);
    let lost: Vec<(u32, u32, f32)> = layout
        .divided()
        .flat_map(|(triangle, cells)| {
            let corners = surfaces.triangles[triangle as usize].into_iter().filter(|&v| validity.is_lost(v));
            corners.flat_map(move |v| cells.clone().map(move |cell| (v, cell)))
        })
        .filter(|&(_, cell)| sites[cell as usize] != 0)
        .map(|(v, cell)| (v, cell, layout.origin_of(cell).distance_squared(surfaces.positions[v as usize])))
        .collect();
    validity.borrow_from_cells(lost.into_iter());
    validity
}

fn valid_sites(layout: &Layout, blocks: &[GatherBlock]) -> Vec<u8> {
    let mut valid = vec![0; layout.site_count()];
    for block in blocks {
        for (i, point) in block.range.clone().enumerate() {
            if let Some(valid) = valid.get_mut(layout.points().sites[point] as usize) {
                *valid = u8::from(block.scale[i] > 0.0 && block.back[i] <= BACK_LIMIT);
            }
        }
    }
    valid
}
