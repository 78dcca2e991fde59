//! Receivers: places on the surfaces that take light from solved cells and light none themselves, as texels do.
//!
//! A receiver sees what a vertex in its place would see, by the same rays and the same sums; but nothing bounces off it, so that its light is known as soon as
//! its rays are traced, and what they met is kept no longer than that: a light map of millions of texels takes the memory of a few thousand.

use crate::bounce::{CellGroup, CellLight, LANES, Lanes};
use crate::cells::{Among, NONE};
use crate::from_cells::{CellsAt, Seen, UnitOf, arrivals};
use crate::gather::{GatherBlock, Lattice, gather_unit, unit_ranges};
use crate::inside::BACK_LIMIT;
use crate::points::{Place, inward_shifts};
use crate::{BouncedSun, Layout, LightError, LightParams, PointSet, Surfaces};
use glam::Vec3;
use heliodon_rays::beam_order;
use rayon::prelude::*;
use std::ops::Range;

/// A place on a triangle; `u` and `v` weigh its second and third vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePlace {
    /// The triangle.
    pub triangle: u32,
    /// The weight of its second vertex, 0 to 1.
    pub u: f32,
    /// The weight of its third vertex, 0 to 1.
    pub v: f32,
}

/// A place on what rays meet, whatever of that the surfaces show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayPlace {
    /// Metres.
    pub position: Vec3,
    /// Unit.
    pub normal: Vec3,
}

/// Where receivers can be: solved surfaces, with what is the same for all of them however often others are asked for.
pub struct Receiving<'a> {
    surfaces: &'a Surfaces<'a>,
    layout: &'a Layout,
    params: &'a LightParams,
    /// See [`inward_shifts`].
    inward: Vec<Vec3>,
}

/// The vertices of triangles of the very geometry that rays meet. Some of them at a time are receivers: of a large scan all at once take more memory than their light.
pub struct RayVertices<'a> {
    positions: &'a [Vec3],
    normals: &'a [Vec3],
    /// See [`inward_shifts`].
    inward: Vec<Vec3>,
    /// Their numbers, neighbours together.
    order: Vec<u32>,
}

/// Receivers, in an order in which neighbours in space lie together.
pub struct Receivers<'a> {
    among: &'a Receiving<'a>,
    points: PointSet,
    /// For each of them the number of its place.
    place_of_point: Vec<u32>,
}

/// The light of a range of receivers, P of them, in their own order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Received {
    /// `P * C * channels` numbers, as [`crate::VertexLight::sky_transfer`].
    pub sky_transfer: Vec<f32>,
    /// `P * R * channels` numbers, as [`crate::SunBounce::coefficients`]; empty where no sun bounces.
    pub sun_bounce: Vec<f32>,
    /// 1 where a receiver sees the open, 0 where it lies inside something or has no normal: its light is not to be shown.
    pub valid: Vec<u8>,
    /// Harmonic means of the distances of what each sees, metres, infinite where it is the sky alone: within a small part of it, light changes little (G. J. Ward,
    /// F. M. Rubinstein, R. D. Clear: "A Ray Tracing Solution for Diffuse Interreflection", 1988).
    pub reach_m: Vec<f32>,
    /// Rays that were traced.
    pub rays: u64,
}

impl<'a> Receiving<'a> {
    /// On surfaces that a layout has divided, all back sides added ([`Layout::add_back_sides`]), and that were solved with these parameters.
    #[must_use]
    pub fn new(surfaces: &'a Surfaces<'a>, layout: &'a Layout, params: &'a LightParams) -> Self {
        Self { surfaces, layout, params, inward: inward_shifts(surfaces.positions, surfaces.triangles) }
    }

    /// Receivers at places.
    ///
    /// # Panics
    /// If there is no such triangle.
    #[must_use]
    pub fn at(&'a self, places: &[SurfacePlace]) -> Receivers<'a> {
        let surfaces = self.surfaces;
        let place = |(site, &SurfacePlace { triangle, u, v }): (usize, &SurfacePlace)| {
            let [a, b, c] = surfaces.triangles[triangle as usize].map(|vertex| self.inward[vertex as usize]);
            Place {
                position: surfaces.position_at(triangle, u, v),
                normal: surfaces.normal_at(triangle, u, v),
                inward: a * (1.0 - u - v) + b * u + c * v,
                lift_m: self.params.offset_m + surfaces.clearance_m(triangle),
                site: site as u32,
            }
        };
        self.of_points(PointSet::new(places.iter().enumerate().map(place)))
    }

    /// Receivers at places of the very geometry that rays meet: their rays start off that, by the offset alone.
    #[must_use]
    pub fn on_rays(&'a self, places: &[RayPlace]) -> Receivers<'a> {
        let place = |(site, &RayPlace { position, normal }): (usize, &RayPlace)| Place {
            position,
            normal,
            inward: Vec3::ZERO,
            lift_m: self.params.offset_m,
            site: site as u32,
        };
        self.of_points(PointSet::new(places.iter().enumerate().map(place)))
    }

    /// Receivers at points whose sites are the numbers of their places.
    fn of_points(&'a self, mut points: PointSet) -> Receivers<'a> {
        // they are of no vertex and no cell
        let none = vec![NONE; points.len()];
        let place_of_point = std::mem::replace(&mut points.sites, none);
        Receivers { among: self, points, place_of_point }
    }
}

impl<'a> RayVertices<'a> {
    /// With these normals.
    ///
    /// # Panics
    /// If there are not as many normals as positions, or a triangle names a vertex that is not there.
    #[must_use]
    pub fn new(positions: &'a [Vec3], normals: &'a [Vec3], triangles: &[[u32; 3]]) -> Self {
        let order = beam_order(positions, Some(normals));
        Self { positions, normals, inward: inward_shifts(positions, triangles), order }
    }

    /// Receivers at those that come in `range` of the order in which neighbours in space lie together; their places are the vertices. As from the surfaces' own vertices,
    /// rays from those of a rim start off the planes that meet there.
    ///
    /// # Panics
    /// If the range goes beyond the vertices.
    #[must_use]
    pub fn receivers<'r>(&self, among: &'r Receiving<'r>, range: Range<usize>) -> Receivers<'r> {
        let place = |&site: &u32| Place {
            position: self.positions[site as usize],
            normal: self.normals[site as usize],
            inward: self.inward[site as usize],
            lift_m: among.params.offset_m,
            site,
        };
        among.of_points(PointSet::new(self.order[range].iter().map(place)))
    }
}

impl Receivers<'_> {
    /// The receivers, in their order: [`crate::bake_sun_masks`] asks them for the suns.
    #[must_use]
    pub fn points(&self) -> &PointSet {
        &self.points
    }

    /// Numbers of the receivers in their order, `width` each, in the order of the places instead.
    #[must_use]
    pub fn in_order_of_places<T: Copy>(&self, numbers: &[T], width: usize) -> Vec<T> {
        let mut of_places = numbers.to_vec();
        self.put(0..self.points.len(), numbers, width, &mut of_places);
        of_places
    }

    /// Puts numbers of the receivers in `range`, in their order, `width` each, to where they belong among those of all places.
    ///
    /// # Panics
    /// If there are fewer numbers than that.
    pub fn put<T: Copy>(&self, range: Range<usize>, numbers: &[T], width: usize, of_places: &mut [T]) {
        for (point, &place) in self.place_of_point[range].iter().enumerate() {
            let to = place as usize * width;
            of_places[to..to + width].copy_from_slice(&numbers[point * width..(point + 1) * width]);
        }
    }

    /// The light of the receivers in `range`, any of their order; every number is the same however they are divided. `cells` are those of the solve
    /// ([`crate::solve_all`]), and with `sun` where its light is asked for; without, there is sky light alone.
    ///
    /// # Errors
    /// Parameters that are not valid, a range beyond the receivers, cells of another solve.
    pub fn receive(&self, cells: &CellLight, sun: Option<&BouncedSun>, range: Range<usize>) -> Result<Received, LightError> {
        let params = self.among.params;
        params.validate()?;
        let functions = sun.map_or(0, BouncedSun::function_count);
        if range.start > range.end || range.end > self.points.len() {
            return Err(LightError::Mismatch(format!("receivers {range:?} of {}", self.points.len())));
        }
        if cells.bounces != params.bounces || (sun.is_some() && functions != cells.functions) {
            return Err(LightError::Mismatch("receivers and cells of another solve".into()));
        }
        let lattices = Lattice::all(params);
        let of_unit = |unit: Range<usize>| self.of_unit(cells, sun, unit, &lattices);
        let units: Vec<Received> = unit_ranges(&range).into_par_iter().map(of_unit).collect();
        let mut all = Received::default();
        for unit in units {
            all.append(unit);
        }
        Ok(all)
    }

    fn of_unit(&self, cells: &CellLight, sun: Option<&BouncedSun>, range: Range<usize>, lattices: &[Lattice]) -> Received {
        let &Receiving { surfaces, layout, params, .. } = self.among;
        // they light no cell
        let among = Among { layout, points: &self.points, first_free: 0 };
        let (unit, _) = gather_unit(surfaces, among, sun, range.clone(), params, lattices, None);
        let reach_m = unit.reach_m.clone();
        let block = unit.into_block(range.clone());
        let seen = Seen { surfaces, among, lattice: &lattices[0] };
        let lanes = Lanes::new(params, sun.map_or(0, BouncedSun::function_count));
        let unit = UnitOf { block: &block, index: 0, range: range.clone(), hits: block.hits[0].as_ref() };
        let bounced = bounced(&seen, &unit, lanes, cells);
        let mut received = Received { reach_m, rays: block.rays, ..Received::default() };
        let sky_lanes = lanes.sky();
        for (point, bounced) in bounced.chunks_exact(lanes.count()).enumerate() {
            let sky = &block.sky[point * params.coefficients..];
            received.sky_transfer.extend((0..sky_lanes).map(|l| sky[l / params.channels.count()] + bounced[l]));
            received.sun_bounce.extend_from_slice(&bounced[sky_lanes..]);
        }
        received.valid = (0..range.len()).map(|point| u8::from(is_open(&block, point))).collect();
        received
    }
}

impl Received {
    /// Adds the receivers that follow.
    pub fn append(&mut self, mut next: Self) {
        self.sky_transfer.append(&mut next.sky_transfer);
        self.sun_bounce.append(&mut next.sun_bounce);
        self.valid.append(&mut next.valid);
        self.reach_m.append(&mut next.reach_m);
        self.rays += next.rays;
    }

    /// Whether shapes agree with so many receivers and with what is solved of each, and all numbers are ones.
    ///
    /// # Errors
    /// What is wrong.
    pub fn validate(&self, count: usize, functions: usize, params: &LightParams) -> Result<(), LightError> {
        let channels = params.channels.count();
        let lengths = [
            (self.sky_transfer.len(), params.coefficients * channels),
            (self.sun_bounce.len(), functions * channels),
            (self.valid.len(), 1),
            (self.reach_m.len(), 1),
        ];
        if lengths.iter().any(|&(len, of_one)| len != count * of_one) {
            return Err(LightError::Mismatch("light and receivers do not agree".into()));
        }
        let finite = self.sky_transfer.iter().chain(&self.sun_bounce).all(|x| x.is_finite());
        if !finite || self.reach_m.iter().any(|reach| reach.is_nan()) {
            return Err(LightError::Mismatch("light of receivers that is not a number".into()));
        }
        Ok(())
    }
}

fn is_open(block: &GatherBlock, point: usize) -> bool {
    block.scale[point] > 0.0 && block.back[point] <= BACK_LIMIT
}

/// What has bounced to the points of a unit, all lanes of one after the other.
fn bounced(seen: &Seen, unit: &UnitOf, lanes: Lanes, cells: &CellLight) -> Vec<f32> {
    let (count, going_on) = (lanes.count(), lanes.going_on());
    let mut all = vec![0.0; unit.range.len() * count];
    if cells.bounces == 0 {
        return all;
    }
    // groups are those of the solve, which has at least these lanes, the sky's first
    for (group, first) in cells.groups.iter().zip((0..going_on).step_by(LANES)) {
        let own = (going_on - first).min(LANES);
        let mut put = |light: &[f32]| {
            for (to, from) in all.chunks_exact_mut(count).zip(light.chunks_exact(group.width)) {
                to[first..first + own].copy_from_slice(&from[..own]);
            }
        };
        match group.width {
            4 => put(from_cells::<4>(seen, unit, group, lanes, first, cells.bounces).as_flattened()),
            8 => put(from_cells::<8>(seen, unit, group, lanes, first, cells.bounces).as_flattened()),
            12 => put(from_cells::<12>(seen, unit, group, lanes, first, cells.bounces).as_flattened()),
            _ => put(from_cells::<LANES>(seen, unit, group, lanes, first, cells.bounces).as_flattened()),
        }
    }
    unit.add_first_bounce(lanes, cells.bounces as usize, &mut all);
    all
}

fn from_cells<const W: usize>(
    seen: &Seen,
    unit: &UnitOf,
    group: &CellGroup,
    lanes: Lanes,
    first: usize,
    bounces: u32,
) -> Vec<[f32; W]> {
    let older = group.older.iter().map(|cells| cells.as_chunks().0).collect();
    let reflected = CellsAt { newest: group.newest.as_chunks().0, older };
    let arrivals = arrivals(unit, lanes, first);
    let arrived = arrivals.partition_point(|a| a.bounce <= bounces as usize);
    seen.gathered(unit, &reflected, &arrivals[..arrived], lanes, first)
}
