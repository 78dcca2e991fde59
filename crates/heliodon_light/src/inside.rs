//! Whether points lie inside something: further looks around for those of which the gather's own rays do not tell.

use crate::gather::{Lattice, for_each_direction};
use crate::{PointSet, Surfaces};
use glam::Vec3;
use heliodon_rays::{NO_HIT, Ray, set_bits};
use std::ops::Range;

/// A point of whose rays more than this part meets back faces lies inside something; see [`crate::GatherBlock::back`].
pub const BACK_LIMIT: f32 = 0.5;

/// A point that sees less than this part of the sky may lie inside something whatever it sees first.
pub(crate) const SHUT: f32 = 0.02;

/// Every how-maniest direction tells whether a point lies inside something.
const LOOK_STRIDE: usize = 8;

/// About so many directions upwards tell how many surfaces a point lies within.
const DIRECTIONS_THROUGH: usize = 64;

/// Every how-maniest of them is enough where those agree.
const FEW_STRIDE: usize = 8;

/// A vertex at the foot of a wall that reaches a little into the floor lies inside the floor, even where its origin was moved out of
/// it: the larger `back` of both places counts. Returns the number of rays.
pub(crate) fn look_from_unmoved(
    surfaces: &Surfaces,
    points: &PointSet,
    range: Range<usize>,
    lattice: &Lattice,
    offset_m: f32,
    back: &mut [f32],
) -> u64 {
    let within = |end: usize| points.unmoved.partition_point(|u| (u.0 as usize) < end);
    let unmoved = &points.unmoved[within(range.start)..within(range.end)];
    let origins: Vec<Vec3> = unmoved.iter().map(|u| u.1).collect();
    let normals: Vec<Vec3> = unmoved.iter().map(|u| points.normals[u.0 as usize]).collect();
    let (mut all, mut inside) = (vec![0.0_f32; origins.len()], vec![0.0_f32; origins.len()]);
    let directions = lattice.directions.iter().copied().skip(LOOK_STRIDE / 2).step_by(LOOK_STRIDE);
    let rays = for_each_direction(surfaces, &origins, &normals, directions, |at| {
        for point in set_bits(at.active) {
            let (cos, hit) = (normals[point].dot(at.direction), &at.hits[point]);
            all[point] += cos;
            // a wall in whose very plane the place lies is met or not as rounding has it: that tells nothing
            if hit.triangle != NO_HIT && hit.back && hit.t > offset_m {
                inside[point] += cos;
            }
        }
    });
    for ((all, inside), (point, _)) in all.into_iter().zip(inside).zip(unmoved) {
        let back = &mut back[*point as usize - range.start];
        *back = back.max(if all > 0.0 { inside / all } else { 0.0 });
    }
    rays
}

/// The corner of a block within another block sees third ones that reach in as well, and may meet few backs first. So some points (indices
/// of `shut`) ask how many surfaces all in all lie behind their rays. Upwards, for below there may be no more than a sheet of ground.
/// Raises `back` to the part of rays that leave more than they enter, and returns the number of rays.
pub(crate) fn look_through(surfaces: &Surfaces, origins: &[Vec3], shut: &[usize], lattice: &Lattice, back: &mut [f32]) -> u64 {
    let stride = (lattice.directions.len() / (2 * DIRECTIONS_THROUGH)).max(1);
    let upwards: Vec<Vec3> = lattice.directions.iter().copied().step_by(stride).filter(|d| d.y > 0.0).collect();
    let few: Vec<Vec3> = upwards.iter().copied().step_by(FEW_STRIDE).collect();
    let others: Vec<Vec3> = upwards.iter().copied().enumerate().filter(|(i, _)| i % FEW_STRIDE != 0).map(|(_, d)| d).collect();
    let mut rays = 0;
    let mut count_within = |origin: Vec3, directions: &[Vec3]| {
        let ray = |&direction: &Vec3| Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
        let mut counts = vec![0; directions.len()];
        surfaces.rays.enclosures(&directions.iter().map(ray).collect::<Vec<_>>(), &mut counts);
        rays += directions.len() as u64;
        counts.iter().filter(|&&count| count > 0).count()
    };
    for &point in shut {
        let (mut within, mut asked) = (count_within(origins[point], &few), few.len());
        if within > 0 && within < asked {
            within += count_within(origins[point], &others);
            asked = upwards.len();
        }
        back[point] = back[point].max(within as f32 / asked.max(1) as f32);
    }
    rays
}
