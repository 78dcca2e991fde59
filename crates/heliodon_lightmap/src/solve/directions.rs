//! The directions in which all texels look around, in blocks.
//!
//! Why the same for all texels and not random ones for each: rays of one direction are parallel, which the ray engine answers several times as fast; neighbours err
//! alike, so that refinement finds them to agree and no noise stands between them. Blocks are runs of a Sobol sequence, each spread evenly over the sphere and
//! all of them together more so; what blocks differ by tells how many a texel needs.

use super::models::Illumination;
use glam::Vec3;
use heliodon_math::dome::Environment;
use heliodon_math::random::{hash2_u32, unit_f32};
use std::f32::consts::PI;
use std::f64::consts::TAU;

/// Directions of a block that are spread evenly over the sphere.
pub(super) const EVEN: u32 = 64;
/// And those that go where the sky is bright.
const BRIGHT: u32 = 32;

/// Directions that stand for the whole sphere.
#[derive(Clone, Debug, Default)]
pub(super) struct Block {
    pub directions: Vec<Vec3>,
    /// The solid angle that each stands for, about 4 pi together.
    pub solid_angles: Vec<f32>,
    /// What comes from there if nothing is met.
    pub escaped: Vec<Vec3>,
}

/// A point of the first two dimensions of Sobol's sequence, its bits flipped as `seed` says (T. Kollig, A. Keller: "Efficient Multidimensional Sampling", 2002).
pub(super) fn sobol2(index: u32, seed: u32) -> [f32; 2] {
    let (mut second, mut rest, mut direction) = (0_u32, index, 1_u32 << 31);
    while rest != 0 {
        if rest & 1 == 1 {
            second ^= direction;
        }
        rest >>= 1;
        direction ^= direction >> 1;
    }
    [index.reverse_bits() ^ hash2_u32(seed, 1), second ^ hash2_u32(seed, 2)].map(unit_f32)
}

/// The unit direction of two numbers, evenly over the sphere.
fn even([u, v]: [f32; 2]) -> Vec3 {
    let y = 1.0 - 2.0 * f64::from(u);
    let ring = (1.0 - y * y).max(0.0).sqrt();
    let (sin, cos) = libm::sincos(TAU * f64::from(v));
    Vec3::new((ring * cos) as f32, y as f32, (ring * sin) as f32)
}

/// So many blocks, for light that escapes to a sky.
pub(super) fn sky_blocks(count: u32, seed: u32, illumination: &dyn Illumination, sky: &dyn Environment) -> Vec<Block> {
    (0..count).map(|block| sky_block(block, seed, illumination, sky)).collect()
}

fn sky_block(block: u32, seed: u32, illumination: &dyn Illumination, sky: &dyn Environment) -> Block {
    let mut directions: Vec<Vec3> = (block * EVEN..(block + 1) * EVEN).map(|i| even(sobol2(i, seed))).collect();
    if illumination.is_sky_seen() {
        let numbers = (block * BRIGHT..(block + 1) * BRIGHT).map(|i| sobol2(i, seed ^ 0x5EED));
        directions.extend(numbers.filter_map(|numbers| Some(sky.sample(numbers)?.0)));
    }
    let bright = directions.len() as f32 - EVEN as f32;
    // the balance heuristic: each direction over the density of both ways to pick it (Veach, Guibas 1995)
    let solid_angle = |&d: &Vec3| {
        let density = EVEN as f32 / (4.0 * PI) + if bright > 0.0 { bright * sky.density(d) } else { 0.0 };
        1.0 / density
    };
    let solid_angles = directions.iter().map(solid_angle).collect();
    let finite = |light: Vec3| if light.is_finite() { light } else { Vec3::ZERO };
    let escaped = directions.iter().map(|&d| finite(illumination.escaped(sky, d))).collect();
    Block { directions, solid_angles, escaped }
}

/// So many blocks, for light that surfaces reflect.
pub(super) fn even_blocks(count: u32, seed: u32) -> Vec<Block> {
    let block = |block: u32| Block {
        directions: (block * EVEN..(block + 1) * EVEN).map(|i| even(sobol2(i, seed))).collect(),
        solid_angles: vec![4.0 * PI / EVEN as f32; EVEN as usize],
        escaped: vec![Vec3::ZERO; EVEN as usize],
    };
    (0..count).map(block).collect()
}

#[cfg(test)]
mod tests {
    use super::super::models::Realistic;
    use super::*;
    use heliodon_math::dome::{ConstantSky, LatLongSky};

    #[test]
    fn every_block_covers_the_sphere() {
        for block in even_blocks(4, 7) {
            assert!(block.directions.iter().all(|d| (d.length() - 1.0).abs() < 1e-5));
            assert!((block.directions.iter().sum::<Vec3>() / EVEN as f32).length() < 0.02);
        }
    }

    #[test]
    fn bright_places_are_found_and_count_once() {
        let pixels = (0..64 * 32).map(|i| Vec3::splat(if i == 64 * 9 + 20 { 5000.0 } else { 0.3 })).collect();
        let sky = LatLongSky::new(64, 32, pixels).unwrap();
        let normal = Vec3::Y;
        let estimate = |block: &Block| {
            let of = block.directions.iter().zip(&block.solid_angles).zip(&block.escaped);
            of.map(|((d, w), l)| normal.dot(*d).max(0.0) * w * l.x).sum::<f32>() / PI
        };
        let blocks = sky_blocks(16, 3, &Realistic, &sky);
        let mean = blocks.iter().map(estimate).sum::<f32>() / 16.0;
        let fine = even_blocks(4096, 5);
        let sum: f32 = fine.iter().flat_map(|b| &b.directions).map(|&d| sky.radiance(d).x * normal.dot(d).max(0.0)).sum();
        let exact = sum * 4.0 / (4096.0 * EVEN as f32);
        assert!((mean / exact - 1.0).abs() < 0.02, "{mean} and {exact}");
        assert_eq!(sky_block(0, 3, &Realistic, &ConstantSky(Vec3::ONE)).directions.len(), EVEN as usize);
    }
}
