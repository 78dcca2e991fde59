//! The light of lamps and suns: what would come if nothing lay between, times the part that does.
//!
//! Where a closed form tells the whole, only the part that is seen is sampled, and what nothing shades has no noise at all.

use super::directions::sobol2;
use super::stage::Stage;
use super::{Models, SolveParams};
use crate::lights::Light;
use glam::Vec3;
use heliodon_math::color::luminance;
use heliodon_rays::{Ray, beam_order, set_bits};
use rayon::prelude::*;

/// Texels that are asked together.
const UNIT: usize = 512;
/// Samples of a block, and blocks that each texel takes.
const BLOCK: u32 = 16;
const LEAST_BLOCKS: u32 = 3;
/// A ray to a lamp ends before it by this part of its way, or it would meet the lamp itself.
const SHORT: f32 = 1.0e-4;

/// How long a ray to a lamp is.
pub(super) fn reach(distance_m: f32, offset_m: f32) -> f32 {
    (distance_m * (1.0 - SHORT) - 2.0 * offset_m).max(0.0)
}

/// Adds all lamps' light to what texels have already; returns the number of rays.
pub(super) fn add_lamps(
    stage: &Stage,
    models: &Models,
    params: &SolveParams,
    floor: f32,
    texels: &[u32],
    light: &mut [Vec3],
) -> u64 {
    if !models.illumination.has_lights() || stage.scene.lights.is_empty() {
        return 0;
    }
    let origins: Vec<Vec3> = texels.iter().map(|&texel| stage.origins[texel as usize]).collect();
    let order = beam_order(&origins, None);
    let units: Vec<(Vec<Vec3>, u64)> = order
        .par_chunks(UNIT)
        .map(|unit| {
            let mut sum: Vec<Vec3> = unit.iter().map(|&i| light[i as usize]).collect();
            let unit: Vec<u32> = unit.iter().map(|&i| texels[i as usize]).collect();
            let mut lamps = Lamps { stage, models, params, floor, texels: &unit, rays: 0 };
            for (number, light) in stage.scene.lights.iter().enumerate() {
                lamps.add(number as u32, light, &mut sum);
            }
            (sum, lamps.rays)
        })
        .collect();
    for (&i, sum) in order.iter().zip(units.iter().flat_map(|(sums, _)| sums)) {
        light[i as usize] = *sum;
    }
    units.iter().map(|(_, rays)| rays).sum()
}

struct Lamps<'a> {
    stage: &'a Stage<'a>,
    models: &'a Models<'a>,
    params: &'a SolveParams,
    floor: f32,
    texels: &'a [u32],
    rays: u64,
}

/// One lamp's samples at one texel.
#[derive(Clone, Copy, Default)]
struct Seen {
    /// Its light where nothing lies between, if a closed form tells.
    whole: Option<Vec3>,
    open: bool,
    samples: f32,
    light: Vec3,
    all: f32,
    seen: f32,
    of_block: [f32; 2],
    blocks: f32,
    mean: f32,
    squares: f32,
}

impl Lamps<'_> {
    fn add(&mut self, number: u32, light: &Light, sums: &mut [Vec3]) {
        let mut seen: Vec<Seen> = self.texels.iter().map(|&texel| self.before(light, texel)).collect();
        let least = if light.is_delta() { 1 } else { LEAST_BLOCKS };
        let blocks = if light.is_delta() { 1 } else { (self.params.light_samples / BLOCK).max(LEAST_BLOCKS) };
        let of_block = if light.is_delta() { 1 } else { BLOCK };
        for block in 0..blocks {
            if !seen.iter().any(|seen| seen.open) {
                break;
            }
            for sample in block * of_block..(block + 1) * of_block {
                let numbers = sobol2(sample, self.params.seed ^ (number << 8) ^ 0x1A3B);
                if light.is_directional() {
                    self.ask_afar(light, numbers, &mut seen)
                } else {
                    self.ask(light, numbers, &mut seen)
                }
            }
            for (seen, sum) in seen.iter_mut().zip(sums.iter()).filter(|(seen, _)| seen.open) {
                seen.end_block();
                let most = 0.5 * self.params.error * (sum.element_sum() + 3.0 * self.floor);
                seen.open = block + 1 < least || !seen.is_certain(0.5 * self.params.error, most);
            }
        }
        sums.iter_mut().zip(&seen).for_each(|(sum, seen)| *sum += seen.light());
    }

    fn before(&self, light: &Light, texel: u32) -> Seen {
        let (origin, normal) = (self.stage.origins[texel as usize], self.stage.places[texel as usize].normal);
        let whole = if self.models.surface.is_lambertian() { light.unhidden(origin, normal) } else { None };
        let open = match whole {
            Some(whole) => whole != Vec3::ZERO,
            None => light.upper_bound(origin, normal) > 0.0,
        };
        Seen { whole, open, ..Seen::default() }
    }

    /// One sample at every texel that still asks.
    fn ask(&mut self, light: &Light, numbers: [f32; 2], seen: &mut [Seen]) {
        let mut rays = Vec::with_capacity(seen.len());
        let mut came = Vec::with_capacity(seen.len());
        for (i, seen) in seen.iter_mut().enumerate().filter(|(_, seen)| seen.open) {
            seen.samples += 1.0;
            let origin = self.stage.origins[self.texels[i] as usize];
            let Some(sample) = light.sample(origin, numbers) else { continue };
            if let Some(light) = self.counted(i, sample.direction, sample.light) {
                let t_max = reach(sample.distance_m, self.stage.offset_m);
                rays.push(Ray { origin, direction: sample.direction, t_min: 0.0, t_max });
                came.push((i, light));
            }
        }
        let mut occluded = vec![0_u64; rays.len().div_ceil(64)];
        self.stage.scene.rays.occluded(&rays, &mut occluded);
        self.rays += rays.len() as u64;
        for (ray, (i, light)) in came.into_iter().enumerate() {
            seen[i].take(light, occluded[ray / 64] >> (ray % 64) & 1 == 0);
        }
    }

    /// The same for a lamp that lies infinitely far away, whose rays are parallel.
    fn ask_afar(&mut self, light: &Light, numbers: [f32; 2], seen: &mut [Seen]) {
        let origins: Vec<Vec3> = self.texels.iter().map(|&texel| self.stage.origins[texel as usize]).collect();
        let mut active = vec![0_u64; seen.len().div_ceil(64)];
        let mut occluded = active.clone();
        let sample = origins.first().and_then(|&origin| light.sample(origin, numbers));
        seen.iter_mut().filter(|seen| seen.open).for_each(|seen| seen.samples += 1.0);
        let Some(sample) = sample else { return };
        let counted = |i: usize| self.counted(i, sample.direction, sample.light);
        for i in (0..seen.len()).filter(|&i| seen[i].open) {
            active[i / 64] |= u64::from(counted(i).is_some()) << (i % 64);
        }
        self.stage.scene.rays.occluded_parallel(&origins, sample.direction, &active, &mut occluded);
        for i in set_bits(&active) {
            if let Some(light) = counted(i) {
                seen[i].take(light, occluded[i / 64] >> (i % 64) & 1 == 0);
            }
        }
        self.rays += active.iter().map(|word| u64::from(word.count_ones())).sum::<u64>();
    }

    /// What a sample brings if nothing lies between.
    fn counted(&self, i: usize, direction: Vec3, light: Vec3) -> Option<Vec3> {
        let cosine = self.stage.places[self.texels[i] as usize].normal.dot(direction);
        (cosine > 0.0).then(|| light * self.models.surface.response(cosine))
    }
}

impl Seen {
    fn take(&mut self, light: Vec3, is_seen: bool) {
        let bright = luminance(light);
        self.of_block[0] += bright;
        if is_seen {
            self.of_block[1] += bright;
            self.light += light;
        }
    }

    fn end_block(&mut self) {
        let [all, seen] = std::mem::take(&mut self.of_block);
        self.all += all;
        self.seen += seen;
        let value = match self.whole {
            Some(whole) if all > 0.0 => whole.element_sum() * (seen / all),
            Some(_) => return,
            None => 3.0 * seen / BLOCK as f32,
        };
        self.blocks += 1.0;
        let off = value - self.mean;
        self.mean += off / self.blocks;
        self.squares += off * (value - self.mean);
    }

    fn is_certain(&self, error: f32, beside: f32) -> bool {
        let most = error * self.mean + beside;
        self.squares <= most * most * self.blocks * (self.blocks - 1.0).max(0.0)
    }

    fn light(&self) -> Vec3 {
        match self.whole {
            Some(whole) if self.all > 0.0 => whole * (self.seen / self.all),
            Some(_) => Vec3::ZERO,
            None if self.samples > 0.0 => self.light / self.samples,
            None => Vec3::ZERO,
        }
    }
}
