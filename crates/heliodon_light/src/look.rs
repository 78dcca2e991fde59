//! A look around from some points, and how much the lattice may err.
//!
//! Every direction counts to one of two halves of the lattice, the even or the odd ones. Where they disagree, some small bright thing
//! fills few directions (a streak of sun in the shade of a colonnade), and the point looks again in other lattices.

use crate::follow::Near;
use crate::gather::{Lattice, UnitHits};
use crate::traces::{Known, Met, Rays, for_each_known_direction};
use crate::{BouncedSun, Layout, Surfaces};
use glam::Vec3;
use heliodon_math::sh::basis9;
use heliodon_rays::{NO_HIT, facing, set_bits};

/// Light (irradiance / pi, of suns of unit irradiance or of a sky of unit radiance) below which errors do not count: a twentieth of
/// about the mean of a sunny scene, and as much of a sky.
const SUN_FLOOR: f32 = 0.0075;
const SKY_FLOOR: f32 = 0.05;

/// Directions in which the sky is looked for together.
const FAN: usize = 32;

/// What some points see.
pub(crate) struct Look {
    /// Cosine-weighted sums of the sky's basis over directions that escape, and
    pub escaped: Vec<[f32; 9]>,
    /// over those that do not; nine coefficients, so that inner loops have a fixed length.
    pub stopped: Vec<[f32; 9]>,
    /// Of the even directions the cosines of those that escape, and of all.
    even: Vec<[f32; 2]>,
    /// Curves over the day of the sun's first bounce, two for each point: of even and of odd directions.
    pub curves: Vec<f32>,
    /// Cosines of the directions that meet backs, and
    pub back: Vec<f32>,
    /// of those that escape below the horizon.
    pub sunk: Vec<f32>,
    /// Sums of the cosines of directions that meet something over its distance in metres.
    pub nearness: Vec<f32>,
    /// What is met from near, where it is asked for.
    pub near: Vec<Near>,
    /// Rays of the look.
    pub rays: Rays,
}

impl Look {
    /// Looks in all directions of a lattice; `keep` takes the hits that are not near, and has the near ones listed. Rays that are `known`
    /// are not traced; what all of them met comes back with the look.
    pub fn around(
        surfaces: &Surfaces,
        layout: &Layout,
        sun: Option<&BouncedSun>,
        (origins, normals): (&[Vec3], &[Vec3]),
        (lattice, known): (&Lattice, Option<&Known>),
        mut keep: Option<&mut UnitHits>,
    ) -> (Self, Met) {
        let count = normals.len();
        let len = sun.map_or(0, |sun| sun.patches.curve_len());
        let mut look = Self::nothing_seen(count, len);
        let (met, rays) = for_each_known_direction(surfaces, (origins, normals), &lattice.directions, known, |at| {
            let (basis, half) = (&lattice.basis[at.index], lattice.halves[at.index]);
            for point in set_bits(at.active) {
                let cos = normals[point].dot(at.direction);
                let hit = &at.hits[point];
                let escapes = hit.triangle == NO_HIT;
                look.add_sky(point, (cos, escapes), (half, basis));
                if escapes {
                    look.sunk[point] += if at.direction.y < 0.0 { cos } else { 0.0 };
                    continue;
                }
                look.back[point] += if hit.back { cos } else { 0.0 };
                look.nearness[point] += cos / hit.t.max(f32::MIN_POSITIVE);
                if let Some(sun) = sun {
                    let curves = &mut look.curves[(2 * point + half) * len..(2 * point + half + 1) * len];
                    sun.patches.add_reflected(surfaces, hit, Vec3::splat(cos), curves);
                }
                if keep.is_some() && layout.is_near(hit) {
                    look.near.push(Near { point: point as u32, cos, direction: at.direction, hit: *hit });
                }
            }
            if let Some(hits) = &mut keep {
                at.keep(layout, hits);
            }
        });
        look.rays = rays;
        (look, met)
    }

    /// Looks only whether the sky is seen in all directions of a lattice, which asks for no hits and costs a fraction.
    pub fn for_sky(surfaces: &Surfaces, (origins, normals): (&[Vec3], &[Vec3]), lattice: &Lattice) -> Self {
        let (count, words) = (normals.len(), normals.len().div_ceil(64));
        let mut look = Self::nothing_seen(count, 0);
        let (mut active, mut occluded) = (vec![0_u64; words * FAN], vec![0_u64; words * FAN]);
        for (number, directions) in lattice.directions.chunks(FAN).enumerate() {
            let asked = 0..words * directions.len();
            for (direction, active) in directions.iter().zip(active.chunks_exact_mut(words.max(1))) {
                look.rays.add(u64::from(facing(normals, *direction, active)));
            }
            surfaces.rays.occluded_fan(origins, directions, &active[asked.clone()], &mut occluded[asked]);
            for (i, &direction) in directions.iter().enumerate() {
                let (half, basis) = (lattice.halves[number * FAN + i], &lattice.basis[number * FAN + i]);
                let of_direction = i * words..(i + 1) * words;
                for point in set_bits(&active[of_direction.clone()]) {
                    let stopped = occluded[of_direction.start + point / 64] >> (point % 64) & 1 == 1;
                    let cos = normals[point].dot(direction);
                    look.add_sky(point, (cos, !stopped), (half, basis));
                }
            }
        }
        look
    }

    fn nothing_seen(count: usize, curve_len: usize) -> Self {
        Self {
            escaped: vec![[0.0; 9]; count],
            stopped: vec![[0.0; 9]; count],
            even: vec![[0.0; 2]; count],
            curves: vec![0.0; 2 * count * curve_len],
            back: vec![0.0; count],
            sunk: vec![0.0; count],
            nearness: vec![0.0; count],
            near: Vec::new(),
            rays: Rays::default(),
        }
    }

    /// Adds what a point sees of the sky in a direction of one half of a lattice.
    fn add_sky(&mut self, point: usize, (cos, escapes): (f32, bool), (half, basis): (usize, &[f32; 9])) {
        let sums = if escapes { &mut self.escaped[point] } else { &mut self.stopped[point] };
        for (sum, y) in sums.iter_mut().zip(basis) {
            *sum += cos * y;
        }
        if half == 0 {
            self.even[point][0] += if escapes { cos } else { 0.0 };
            self.even[point][1] += cos;
        }
    }

    /// The sum of the basis function 0 over all directions of a point.
    pub fn all(&self, point: usize) -> f32 {
        self.escaped[point][0] + self.stopped[point][0]
    }

    /// How much of what a point could see of the sky above the horizon it sees.
    pub fn open_part(&self, point: usize) -> f32 {
        // cosines sum to what the constant function's sums are, divided by its value
        let sunk = self.sunk[point] * basis9(Vec3::Y)[0];
        let all = self.all(point) - sunk;
        if all > 0.0 { (self.escaped[point][0] - sunk) / all } else { 0.0 }
    }

    /// The curves of both halves of a point, one after the other.
    pub fn curves(&self, point: usize) -> (&[f32], &[f32]) {
        let of_point = self.curves.len() / self.escaped.len().max(1);
        self.curves[point * of_point..(point + 1) * of_point].split_at(of_point / 2)
    }

    /// By how much the light of a point may be wrong, of the sky or of the sun, as a part of itself. Over the day it is the fourth root of
    /// the mean fourth power: an hour in which a streak of sun comes by counts for more than its share of the day.
    pub fn likely_error(&self, point: usize, sun: Option<&BouncedSun>) -> f32 {
        // cosines sum to what the constant function's sums are, divided by its value
        let y0 = basis9(Vec3::Y)[0];
        let [escaped, even_all] = self.even[point];
        let odd_all = self.all(point) / y0 - even_all;
        if even_all <= 0.0 || odd_all <= 0.0 {
            return 0.0;
        }
        let (even, odd) = (escaped / even_all, (self.escaped[point][0] / y0 - escaped) / odd_all);
        let sky = (even - odd).abs() / ((even + odd) / 2.0).max(SKY_FLOOR);
        let (even, odd) = self.curves(point);
        let mut fourths = 0.0;
        for (e, o) in even.iter().zip(odd) {
            let (e, o) = (e / even_all, o / odd_all);
            let relative = (e - o) / ((e + o) / 2.0).max(SUN_FLOOR);
            fourths += relative.powi(4);
        }
        let sun = sun.map_or(0.0, |sun| (fourths / sun.patches.live_numbers() as f32).sqrt().sqrt());
        HALF_OF_DIFFERENCE * sky.max(sun)
    }

    /// Adds what the points `points` saw in a further look; what is near is followed from the first alone.
    pub fn add(&mut self, points: &[u32], more: Self) {
        let len = self.curves.len() / self.escaped.len().max(1);
        for (i, &point) in points.iter().enumerate() {
            let point = point as usize;
            let sums = [(&mut self.escaped[point], &more.escaped[i]), (&mut self.stopped[point], &more.stopped[i])];
            for (sums, more) in sums {
                sums.iter_mut().zip(more).for_each(|(sum, x)| *sum += x);
            }
            self.even[point].iter_mut().zip(&more.even[i]).for_each(|(sum, x)| *sum += x);
            let curves = self.curves[point * len..(point + 1) * len].iter_mut();
            curves.zip(&more.curves[i * len..(i + 1) * len]).for_each(|(sum, x)| *sum += x);
        }
        self.rays.all += more.rays.all;
        self.rays.traced += more.rays.traced;
    }
}

/// The error of a whole lattice over the difference of its halves: with an error that falls with the power -3/4 of the count, halves
/// err by 2^(3/4), their difference by the square root of 2 times that.
const HALF_OF_DIFFERENCE: f32 = 0.42;
