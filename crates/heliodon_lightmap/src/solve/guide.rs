//! Directions through the openings by which texels close to one another see the sky.
//!
//! Indoors nearly all light comes through a door, a few windows, the gap below the eaves, and of the even directions a handful finds them. Those that escaped from any texel of a unit tell
//! where openings are: further directions lie in caps around them, the more the more light came from there, the same for all texels of the unit, so that their rays are parallel too. All
//! directions count by the balance heuristic (E. Veach, L. Guibas: "Optimally Combining Sampling Techniques for Monte Carlo Rendering", SIGGRAPH 1995), so an opening that none found is still
//! worth what the even ones find of it. Only texels that are not certain yet, or have found nothing, look again.

use super::directions::{Block, sobol2};
use super::gather::{Gather, Open};
use glam::Vec3;
use heliodon_math::frame::orthonormal_basis;
use heliodon_math::random::{hash2_u32, unit_f32};
use heliodon_rays::set_bits;
use std::f32::consts::{PI, TAU};

/// Directions through openings.
const DIRECTIONS: u32 = 32;
/// Texels that look through the same ones: what lies a few steps further sees an opening elsewhere.
pub(super) const TOGETHER: usize = 64;
/// A cap has so many times the solid angle that an even direction stands for: caps of neighbours overlap.
const CAP: f32 = 2.0;
/// The greatest, a part of the sphere.
const WIDEST: f32 = 1.0 / 32.0;

/// Which rays of a unit's texels escaped, direction after direction.
pub(super) struct Escaped {
    /// Words for a direction.
    words: usize,
    bits: Vec<u64>,
}

impl Escaped {
    pub fn new(texels: usize) -> Self {
        Self { words: texels.div_ceil(64), bits: Vec::new() }
    }

    /// Makes room for so many further directions.
    pub fn begin(&mut self, directions: usize) {
        self.bits.resize(self.bits.len() + directions * self.words, 0);
    }

    pub fn add(&mut self, direction: usize, of: u32) {
        self.bits[direction * self.words + of as usize / 64] |= 1 << (of % 64);
    }

    fn has(&self, direction: usize, of: u32) -> bool {
        self.bits[direction * self.words + of as usize / 64] >> (of % 64) & 1 == 1
    }
}

/// Directions around one that escaped.
struct Cap {
    axis: Vec3,
    least_cosine: f32,
    /// How many directions lie in a solid angle there.
    density: f32,
}

/// What some texels of a unit see through openings.
pub(super) struct Openings {
    open: Open,
    caps: Vec<Cap>,
    directions: Vec<Vec3>,
    escaped: Escaped,
}

impl Openings {
    /// Of texels that have looked in these blocks; none where nothing escaped. Adds the number of rays.
    pub fn find(gather: &Gather, open: Open, blocks: &[Block], escaped: &Escaped, seed: u32, rays: &mut u64) -> Option<Self> {
        let all = || blocks.iter().flat_map(|block| (0..block.directions.len()).map(move |d| (block, d)));
        let light = |(number, (block, d)): (usize, (&Block, usize))| {
            let seen = (0..open.numbers.len()).filter(|&i| escaped.has(number, open.numbers[i]));
            let cosines: f32 = seen.map(|i| open.normals[i].dot(block.directions[d]).max(0.0)).sum();
            cosines * block.escaped[d].max_element().max(0.0) * block.solid_angles[d]
        };
        let lights: Vec<f32> = all().enumerate().map(light).collect();
        let sum: f32 = lights.iter().sum();
        if !(sum > 0.0 && sum.is_finite()) {
            return None;
        }
        let cap = |((block, d), light): ((&Block, usize), &f32)| {
            let part = (CAP * block.solid_angles[d] / (blocks.len() as f32 * 4.0 * PI)).min(WIDEST);
            let density = DIRECTIONS as f32 * light / (sum * 4.0 * PI * part);
            Cap { axis: block.directions[d], least_cosine: 1.0 - 2.0 * part, density }
        };
        let lit = || all().zip(&lights).filter(|(_, light)| **light > 0.0);
        let caps: Vec<Cap> = lit().map(cap).collect();
        // one after the other through all caps, so that each has as many as it is worth
        let first = unit_f32(hash2_u32(seed, 3));
        let (mut directions, mut until) = (Vec::with_capacity(DIRECTIONS as usize), 0.0);
        for (cap, (_, light)) in caps.iter().zip(lit()) {
            until += light / sum * DIRECTIONS as f32;
            while directions.len() < DIRECTIONS as usize && directions.len() as f32 + first < until {
                directions.push(cap.direction(sobol2(directions.len() as u32, seed)));
            }
        }
        let mut own = Escaped::new(open.numbers.len());
        own.begin(directions.len());
        let (mut active, mut occluded) = (Vec::new(), Vec::new());
        for (number, &direction) in directions.iter().enumerate() {
            *rays += open.ask(gather.stage, direction, &mut active, &mut occluded);
            let escaped: Vec<u64> = active.iter().zip(&occluded).map(|(active, occluded)| active & !occluded).collect();
            set_bits(&escaped).for_each(|i| own.add(number, i as u32));
        }
        Some(Self { open, caps, directions, escaped: own })
    }

    /// How many of the directions lie in a solid angle there.
    fn density(&self, direction: Vec3) -> f32 {
        let around = self.caps.iter().filter(|cap| cap.axis.dot(direction) >= cap.least_cosine);
        around.map(|cap| cap.density).sum()
    }

    /// What comes from the sky to each of the texels: its number in the unit, and irradiance over pi, of its own directions and of the blocks that it has `taken`.
    pub fn light(&self, gather: &Gather, set: u16, blocks: &[Block], escaped: &Escaped, taken: &[usize]) -> Vec<(u32, Vec3)> {
        let open = &self.open;
        let most = open.numbers.iter().map(|&of| taken[of as usize]).max().unwrap_or(0);
        let blocks = &blocks[..most];
        let through = |directions: &[Vec3]| directions.iter().map(|&d| self.density(d)).collect::<Vec<f32>>();
        let through_even: Vec<Vec<f32>> = blocks.iter().map(|block| through(&block.directions)).collect();
        let through_own = through(&self.directions);
        let even: Vec<f32> = self.directions.iter().map(|&d| gather.lookouts.density(gather.stage, set, d)).collect();
        let from_sky: Vec<Vec3> = self.directions.iter().map(|&d| gather.escaping(d)).collect();
        let of_texel = |i: usize| {
            let of = open.numbers[i];
            let count = taken[of as usize];
            let (mut light, mut whole) = (Vec3::ZERO, 0.0);
            let mut add = |direction: Vec3, density: f32, has_escaped: bool, from_sky: Vec3| {
                let cosine = open.normals[i].dot(direction);
                let weight = 1.0 / density.max(f32::MIN_POSITIVE);
                whole += cosine * weight;
                if has_escaped {
                    light += from_sky * (gather.models.surface.response(cosine) * weight);
                }
            };
            let mut number = 0;
            for (block, through) in blocks[..count].iter().zip(&through_even) {
                for (d, &direction) in block.directions.iter().enumerate() {
                    if open.faces(i, direction) {
                        let density = count as f32 / block.solid_angles[d] + through[d];
                        add(direction, density, escaped.has(number, of), block.escaped[d]);
                    }
                    number += 1;
                }
            }
            for (d, &direction) in self.directions.iter().enumerate().filter(|(_, direction)| open.faces(i, **direction)) {
                let density = count as f32 * even[d] + through_own[d];
                add(direction, density, self.escaped.has(d, i as u32), from_sky[d]);
            }
            (of, if whole > 0.0 { light / whole } else { Vec3::ZERO })
        };
        (0..open.numbers.len()).map(of_texel).collect()
    }
}

impl Cap {
    /// Evenly over it.
    fn direction(&self, [u, v]: [f32; 2]) -> Vec3 {
        let cosine = 1.0 - u * (1.0 - self.least_cosine);
        let (sin, cos) = libm::sincosf(TAU * v);
        let (x, y) = orthonormal_basis(self.axis);
        let off = (1.0 - cosine * cosine).max(0.0).sqrt();
        self.axis * cosine + (x * cos + y * sin) * off
    }
}
