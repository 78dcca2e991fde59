//! Bounces: light from cell to point to cell over the kept hits.
//!
//! With the gather `G` (a point's light from the cells it sees) and the albedo `rho`, sky light that has bounced up to B times is
//! `z_B`, from `z_0 = 0` and `z_{b+1} = G rho (s + z_b)`, where `s` arrives directly. Sunlight's first bounce `f` was summed when its
//! rays were traced: `z_{b+1} = f + G rho z_b`, and only its first functions go on. Sky coefficients, functions of the sun and colour channels are lanes of one such sum: a
//! hit is read once for up to sixteen of them. Followed paths add what they bring from sky and sun once they have made their k bounces,
//! and, where they end in a cell, its light of k bounces before.

use crate::block_bytes::hits_of_block;
use crate::cells::{Layout, NONE};
use crate::follow::MAX_FOLLOWED;
use crate::from_cells::{Arrived, CellsAt, Seen, UnitOf, arrivals};
use crate::gather::{GatherBlock, Lattice, UnitHits, unit_ranges};
use crate::inside::BACK_LIMIT;
use crate::kept_bounces::{Bouncing, KeptBounces};
use crate::surfaces::reflected;
use crate::{Channels, LightParams, Surfaces, Validity};
use glam::Vec3;
use half::f16;
use half::slice::HalfFloatSliceExt;
use rayon::prelude::*;
use std::collections::VecDeque;

/// Lanes that bounce together.
pub(crate) const LANES: usize = 16;

/// Everything that bounces share.
pub(crate) struct Transport<'a> {
    seen: Seen<'a>,
    blocks: &'a [GatherBlock],
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
    pub fn going_on(&self) -> usize {
        self.sky() + self.going_on * self.channels.count()
    }

    pub fn count(&self) -> usize {
        self.sky() + self.sun()
    }
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
        Self { seen: Seen { surfaces, among: layout.own(), lattice }, blocks, albedo, lit_by }
    }

    /// The points that light a cell, and its albedo in the channels solved.
    fn cell(&self, index: usize) -> (impl Iterator<Item = usize>, Vec3) {
        (self.lit_by[index].into_iter().filter(|&p| p != NONE).map(|p| p as usize), self.albedo[index])
    }

    /// The units of each block.
    fn units(&self) -> Vec<Vec<UnitOf<'a>>> {
        let of_block = |block: &'a GatherBlock| {
            let units = unit_ranges(&block.range).into_iter().enumerate();
            units.map(|(index, range)| UnitOf { block, index, range, hits: block.hits[index].as_ref() }).collect()
        };
        self.blocks.iter().map(of_block).collect()
    }

    /// Light that has bounced up to `bounces` times, a number for each lane of each point; where it is asked for, also what the cells last reflected, for
    /// points that come later. `kept` is where it goes on from.
    pub fn bounced(
        &self,
        lanes: Lanes,
        bounces: u32,
        mut keep: Option<&mut CellLight>,
        kept: Option<&dyn KeptBounces>,
    ) -> Vec<f32> {
        let (count, going_on) = (lanes.count(), lanes.going_on());
        let mut all = vec![0.0; self.seen.among.points.len() * count];
        for first in (0..going_on).step_by(LANES) {
            let width = (going_on - first).min(LANES);
            let mut put = |light: &[f32], padded: usize| {
                for (to, from) in all.chunks_exact_mut(count).zip(light.chunks_exact(padded)) {
                    to[first..first + width].copy_from_slice(&from[..width]);
                }
            };
            let keep = keep.as_deref_mut();
            match width.next_multiple_of(4) {
                4 => put(self.bounced_lanes::<4>(lanes, first, bounces, keep, kept).as_flattened(), 4),
                8 => put(self.bounced_lanes::<8>(lanes, first, bounces, keep, kept).as_flattened(), 8),
                12 => put(self.bounced_lanes::<12>(lanes, first, bounces, keep, kept).as_flattened(), 12),
                _ => put(self.bounced_lanes::<LANES>(lanes, first, bounces, keep, kept).as_flattened(), LANES),
            }
        }
        if going_on < count && bounces > 0 {
            for unit in self.units().into_iter().flatten() {
                let points = &mut all[unit.range.start * count..unit.range.end * count];
                unit.add_first_bounce(lanes, bounces as usize, points);
            }
        }
        all
    }

    fn bounced_lanes<const W: usize>(
        &self,
        lanes: Lanes,
        first: usize,
        bounces: u32,
        keep: Option<&mut CellLight>,
        kept: Option<&dyn KeptBounces>,
    ) -> Vec<[f32; W]> {
        let (sizes, group, bounces) = ((self.seen.among.points.len(), self.albedo.len()), first / LANES, bounces as usize);
        let channels = lanes.channels.count();
        // reckoned once: a division for each lane of each cell took as long as the sums
        let channel_of: [usize; W] = std::array::from_fn(|l| (first + l) % channels);
        let coefficient_of: [usize; W] = std::array::from_fn(|l| (first + l) / channels);
        let sky_lanes = lanes.sky().saturating_sub(first);
        let units = self.units();
        let paths_end = keep.is_some() || units.iter().flatten().any(|unit| !unit.followed().ends.is_empty());
        let before = kept.and_then(|kept| Bouncing::of_runs(&kept.take(group)?, sizes, bounces, paths_end));
        let mut now = before.unwrap_or_else(|| Bouncing::<W>::new(sizes));
        let tell = |done: usize| kept.iter().for_each(|kept| kept.told((group * bounces + done) as u64));
        tell(now.done);
        let of_block = |units: &Vec<UnitOf>| units.par_iter().map(|unit| arrivals(unit, lanes, first)).collect();
        let arrivals: Vec<Vec<Vec<Arrived<W>>>> = units.par_iter().map(of_block).collect();
        for bounce in now.done..bounces {
            if bounce > 0 && paths_end {
                now.reflected.grow_older();
            }
            let light: Vec<[f32; W]> = units
                .par_iter()
                .flatten()
                .flat_map_iter(|unit| {
                    let sky = &unit.block.sky[unit.offset() * lanes.coefficients..];
                    let bounced = &now.points[unit.range.clone()];
                    bounced.iter().zip(sky.chunks_exact(lanes.coefficients)).map(|(z, sky)| {
                        // what arrives directly from the sky; the sun's first bounce has been summed
                        let direct = |l: usize| if l < sky_lanes { sky[coefficient_of[l]] } else { 0.0 };
                        std::array::from_fn(|l| direct(l) + z[l])
                    })
                })
                .collect();
            now.reflected.newest.par_iter_mut().enumerate().for_each(|(index, out)| {
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
            let reflected = now.reflected.told();
            let of_block = |(number, (units, arrivals)): (usize, (&Vec<UnitOf>, &Vec<Vec<Arrived<W>>>))| {
                let hits = kept.and_then(|kept| hits_beside(units, number, kept));
                let gather = |(index, (unit, arrivals)): (usize, (&UnitOf, &Vec<Arrived<W>>))| {
                    // sorted by bounce
                    let arrived = arrivals.partition_point(|a| a.bounce <= bounce + 1);
                    let hits = unit.hits.or_else(|| hits.as_ref()?[index].as_ref());
                    let unit = UnitOf { range: unit.range.clone(), hits, ..*unit };
                    self.seen.gathered(&unit, &reflected, &arrivals[..arrived], lanes, first)
                };
                match &hits {
                    // a thread that waits for another would take up a block of its own, and hold its hits as well
                    Some(_) => units.iter().zip(arrivals).enumerate().map(gather).collect(),
                    None => units.par_iter().zip(arrivals).enumerate().map(gather).collect(),
                }
            };
            let gathered: Vec<Vec<Vec<[f32; W]>>> = units.par_iter().zip(&arrivals).enumerate().map(of_block).collect();
            for (unit, light) in units.iter().flatten().zip(gathered.into_iter().flatten()) {
                now.points[unit.range.clone()].copy_from_slice(&light);
            }
            now.done = bounce + 1;
            tell(now.done);
            if let Some(kept) = kept.filter(|kept| kept.is_due()) {
                kept.keep(group, &now.runs(paths_end));
            }
        }
        if let Some(keep) = keep {
            let Reflected { newest, older } = now.reflected;
            let older = older.into_iter().map(Vec::into_flattened).collect();
            keep.groups.push(CellGroup { width: W, newest: newest.into_flattened(), older });
        }
        now.points
    }
}

/// The hits of a block's units where not all of them are at hand, but all lie beside.
fn hits_beside(units: &[UnitOf], number: usize, kept: &dyn KeptBounces) -> Option<Vec<Option<UnitHits>>> {
    let bytes = if units.iter().all(|unit| unit.hits.is_some()) { None } else { kept.block(number) };
    hits_of_block(&bytes?).ok().filter(|hits| hits.len() == units.len())
}

/// What cells reflect: lanes that bounce together.
pub(crate) struct Reflected<const W: usize> {
    pub newest: Vec<[f32; W]>,
    /// At the bounces before, the latest first, of which only paths that end on a cell ask.
    pub older: VecDeque<Vec<[f16; W]>>,
}

impl<const W: usize> Reflected<W> {
    /// Lets what is the newest become older.
    fn grow_older(&mut self) {
        let mut cells = match self.older.len() {
            MAX_FOLLOWED => self.older.pop_back().unwrap_or_default(),
            _ => vec![[f16::ZERO; W]; self.newest.len()],
        };
        cells.par_iter_mut().zip(&self.newest).for_each(|(to, from)| to.convert_from_f32_slice(from));
        self.older.push_front(cells);
    }

    fn told(&self) -> CellsAt<'_, W> {
        CellsAt { newest: &self.newest, older: self.older.iter().map(Vec::as_slice).collect() }
    }
}

/// What cells reflected at the last bounces, from which points that come later take their light ([`crate::Receivers`]).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CellLight {
    /// Lanes that bounced together, in order.
    pub(crate) groups: Vec<CellGroup>,
    /// How often light has bounced.
    pub(crate) bounces: u32,
    /// Functions of the day.
    pub(crate) functions: usize,
}

/// Lanes of all cells that bounced together.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CellGroup {
    /// Lanes of a cell, padded.
    pub width: usize,
    /// At the last bounce, the lanes of one cell after the other.
    pub newest: Vec<f32>,
    /// At each bounce before, the latest first.
    pub older: Vec<Vec<f16>>,
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
