//! From the light of cells to that of the points which see them: the last step of every bounce, and all that receivers need.

use crate::bounce::Lanes;
use crate::cells::{Among, BACK};
use crate::follow::Arrival;
use crate::gather::{GatherBlock, Lattice, UnitHits, trace_hits};
use crate::{Followed, Surfaces};
use glam::Vec3;
use half::f16;
use half::slice::HalfFloatSliceExt;
use heliodon_math::color::linear_from_rgb9e5;
use heliodon_rays::set_bits;
use std::borrow::Cow;
use std::ops::Range;

/// What points among cells see.
#[derive(Clone, Copy)]
pub(crate) struct Seen<'a> {
    pub surfaces: &'a Surfaces<'a>,
    pub among: Among<'a>,
    pub lattice: &'a Lattice,
}

impl Seen<'_> {
    /// The number of a cell that a hit names, or `None` for a back that nothing lights.
    #[inline]
    pub fn cell_index(&self, cell: u32) -> Option<usize> {
        if cell & BACK == 0 {
            return Some(cell as usize);
        }
        let back = self.among.layout.back_cells().binary_search(&(cell & !BACK)).ok()?;
        Some(self.among.layout.front_cell_count() + back)
    }

    fn hits_of<'b>(&self, unit: &UnitOf<'b>) -> Cow<'b, UnitHits> {
        match unit.hits {
            Some(hits) => Cow::Borrowed(hits),
            None => Cow::Owned(trace_hits(self.surfaces, self.among, unit.range.clone(), self.lattice)),
        }
    }

    /// One unit's light in the lanes from `first` on: the sun's first bounce, from the cells that it sees and from followed paths;
    /// cosine-weighted means.
    pub fn gathered<const W: usize>(
        &self,
        unit: &UnitOf<'_>,
        reflected: &CellsAt<'_, W>,
        arrived: &[Arrived<W>],
        lanes: Lanes,
        first: usize,
    ) -> Vec<[f32; W]> {
        let (channels, sky_lanes, sun_lanes) = (lanes.channels.count(), lanes.sky(), lanes.sun());
        let channel_of: [usize; W] = std::array::from_fn(|l| (first + l) % channels);
        let normals = &self.among.points.normals[unit.range.clone()];
        let hits = self.hits_of(unit);
        let first_bounce = |point: usize| {
            let sun = &unit.block.sun[(unit.offset() + point) * sun_lanes..(unit.offset() + point + 1) * sun_lanes];
            std::array::from_fn(|l| (first + l).checked_sub(sky_lanes).and_then(|lane| sun.get(lane)).copied().unwrap_or(0.0))
        };
        let mut sums: Vec<[f32; W]> = (0..normals.len()).map(first_bounce).collect();
        pulp::Arch::new().dispatch(AddHits { seen: self, hits: &hits, normals, newest: reflected.newest, sums: &mut sums });
        for arrived in arrived {
            for (sum, x) in sums[arrived.point].iter_mut().zip(&arrived.light) {
                *sum += x;
            }
        }
        for &[key, share, cell] in &unit.followed().ends {
            let Arrival { point, bounce } = Arrival::of(key);
            let cells = bounce.checked_sub(1).and_then(|before| reflected.older.get(before));
            let (Some(cells), Some(cell)) = (cells, self.cell_index(cell)) else { continue };
            let (share, mut light) = (linear_from_rgb9e5(share), [0.0; W]);
            cells[cell].convert_to_f32_slice(&mut light);
            for ((sum, x), &channel) in sums[point].iter_mut().zip(&light).zip(&channel_of) {
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

/// Adds to the sums of points what the cells that they see reflect; compiled for the instructions that there are.
struct AddHits<'a, const W: usize> {
    seen: &'a Seen<'a>,
    hits: &'a UnitHits,
    normals: &'a [Vec3],
    newest: &'a [[f32; W]],
    sums: &'a mut [[f32; W]],
}

impl<const W: usize> pulp::NullaryFnOnce for AddHits<'_, W> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { seen, hits, normals, newest, sums } = self;
        let mut next = hits.cells.iter();
        for (met, &direction) in hits.met.chunks_exact(normals.len().div_ceil(64)).zip(&seen.lattice.directions) {
            for (point, &cell) in set_bits(met).zip(&mut next) {
                let Some(cell) = seen.cell_index(cell) else { continue };
                let cos = normals[point].dot(direction);
                // in whole arrays: through slices that may lie over one another it goes number by number
                let (sum, light) = (sums[point], newest[cell]);
                sums[point] = std::array::from_fn(|l| sum[l] + cos * light[l]);
            }
        }
    }
}

/// What cells reflected, for those that see them.
pub(crate) struct CellsAt<'a, const W: usize> {
    /// At the last bounce.
    pub newest: &'a [[f32; W]],
    /// At each bounce before, the latest first.
    pub older: Vec<&'a [[f16; W]]>,
}

/// A run of points that is gathered together, and where its hits are.
pub(crate) struct UnitOf<'a> {
    pub block: &'a GatherBlock,
    pub index: usize,
    pub range: Range<usize>,
    /// Traced again where they are not at hand.
    pub hits: Option<&'a UnitHits>,
}

impl<'a> UnitOf<'a> {
    pub fn followed(&self) -> &'a Followed {
        &self.block.followed[self.index]
    }

    /// Adds, in the lanes that do not go on, the sun's first bounce and what followed paths bring to the numbers of the unit's points.
    pub fn add_first_bounce(&self, lanes: Lanes, bounces: usize, points: &mut [f32]) {
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
    pub fn offset(&self) -> usize {
        self.range.start - self.block.range.start
    }
}

/// Sky and sun that followed paths bring to a point after so many bounces.
pub(crate) struct Arrived<const W: usize> {
    point: usize,
    pub bounce: usize,
    light: [f32; W],
}

/// What arrives at the points of a unit in the lanes from `first` on, sorted by bounce.
pub(crate) fn arrivals<const W: usize>(unit: &UnitOf, lanes: Lanes, first: usize) -> Vec<Arrived<W>> {
    let followed = unit.followed();
    let arrived = |(&key, light): (&u32, &[f32])| {
        let Arrival { point, bounce } = Arrival::of(key);
        Arrived { point, bounce, light: std::array::from_fn(|l| light.get(first + l).copied().unwrap_or(0.0)) }
    };
    let mut arrived: Vec<_> = followed.keys.iter().zip(followed.light.chunks_exact(lanes.count())).map(arrived).collect();
    arrived.sort_by_key(|a| a.bounce);
    arrived
}
