//! How much of the sun the monument lets through to each place around an actor.

use glam::{DVec3, IVec3, Vec3};
use heliodon_bundle::grid::Grid;
use heliodon_bundle::moment::Moment;
use heliodon_gpu::moving::SunLattice;

/// Lattice points around an actor at most; larger ones are lit as their middle is.
const MOST_POINTS: i32 = 20_000;

/// The light grid's suns in a box, ready for every vertex in it.
#[derive(Clone, Debug)]
pub struct SunField {
    origin: Vec3,
    spacing_m: f32,
    size: IVec3,
    reached: Vec<f32>,
}

impl SunField {
    /// The box from `low` to `high`; places far off the grid are in the sun.
    #[must_use]
    pub fn new(grid: &Grid, moment: &Moment, low: Vec3, high: Vec3) -> Self {
        let points = grid.points();
        let (origin, spacing_m) = (DVec3::from_array(points.origin), points.spacing_m);
        let cell = |p: Vec3| ((p.as_dvec3() - origin) / spacing_m).floor().as_ivec3();
        let (mut first, mut last) = (cell(low), cell(high) + 1);
        if (last - first + 1).element_product() > MOST_POINTS || !(low.is_finite() && high.is_finite()) {
            first = cell((low + high) * 0.5);
            last = first + 1;
        }
        let size = last - first + 1;
        let place = |x, y, z| (origin + spacing_m * (first + IVec3::new(x, y, z)).as_dvec3()).as_vec3();
        let mut reached = Vec::with_capacity(size.element_product() as usize);
        for z in 0..size.z {
            for y in 0..size.y {
                for x in 0..size.x {
                    reached.push(sun_at(grid, moment, place(x, y, z)).unwrap_or(1.0));
                }
            }
        }
        Self { origin: place(0, 0, 0), spacing_m: spacing_m as f32, size, reached }
    }

    /// The lattice, as a GPU takes it.
    #[must_use]
    pub fn lattice(&self) -> SunLattice<'_> {
        let size = self.size.as_uvec3().to_array();
        SunLattice { origin: self.origin, spacing_m: self.spacing_m, size, reached: &self.reached }
    }

    /// The part of the sun that reaches a place, 0 to 1.
    #[must_use]
    pub fn at(&self, place: Vec3) -> f32 {
        let most = (self.size - 1).as_vec3();
        let at = ((place - self.origin) / self.spacing_m).clamp(Vec3::ZERO, most);
        let low = at.floor().min(most - 1.0).max(Vec3::ZERO);
        let (part, low) = (at - low, low.as_ivec3());
        let value = |step: i32| {
            let corner = (low + IVec3::new(step & 1, step >> 1 & 1, step >> 2)).min(self.size - 1);
            self.reached[((corner.z * self.size.y + corner.y) * self.size.x + corner.x) as usize]
        };
        let across = |y: i32| value(2 * y) + (value(2 * y + 1) - value(2 * y)) * part.x;
        let up = |z: i32| across(2 * z) + (across(2 * z + 1) - across(2 * z)) * part.y;
        up(0) + (up(1) - up(0)) * part.z
    }
}

/// The part of the moment's sun that reaches a place; `None` off the grid.
fn sun_at(grid: &Grid, moment: &Moment, place: Vec3) -> Option<f32> {
    let sample = grid.sample(place)?;
    let steps = moment.mask_bits.into_iter().zip(moment.mask_weights).filter(|(_, weight)| *weight > 0.0);
    Some(steps.map(|(step, weight)| weight * grid.sun_fraction(&sample, step)).sum())
}
