//! The directions in which texels look around, in blocks.
//!
//! Why the same for all texels and not random ones for each: rays of one direction are parallel, which the ray engine answers several times as fast; neighbours err
//! alike, so that refinement finds them to agree and no noise stands between them. Blocks are runs of a Sobol sequence, each spread evenly over the sphere and
//! all of them together more so; what blocks differ by tells how many a texel needs.
//!
//! Flat charts that face one way, as walls and floors do, share directions of their own where they are many: as dense as their cosine is great, so that fewer rays
//! tell as much.

use super::models::Illumination;
use super::stage::Stage;
use glam::Vec3;
use heliodon_math::dome::Environment;
use heliodon_math::random::{hash2_u32, unit_f32};
use heliodon_math::sphere::concentric_cosine_hemisphere;
use std::collections::BTreeMap;
use std::f32::consts::PI;
use std::f64::consts::TAU;

/// Directions of a block that are spread evenly over the sphere.
pub(super) const EVEN: u32 = 64;
/// And those that go where the sky is bright.
const BRIGHT: u32 = 32;

/// Directions that flat charts share have as many texels at least: fewer make no beams.
const SHARED: usize = 2048;
/// Sets of directions at most.
const MOST_SETS: usize = 48;
/// Normals of one set differ by less than this, radians: steps of their coordinates.
const ALIKE: f32 = 1.0 / 1024.0;

/// Directions that stand for the whole sphere, or for the half of it that a flat chart faces.
#[derive(Clone, Debug, Default)]
pub(super) struct Block {
    pub directions: Vec<Vec3>,
    /// How many of them, the first, are spread without a look at the sky.
    pub even: usize,
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

/// Where directions of a block lie, if nobody looks at the sky.
#[derive(Clone, Copy, Debug)]
enum Spread {
    /// Evenly over the sphere.
    Sphere,
    /// About a normal, as dense as the cosine is great.
    Facing(Vec3),
}

impl Spread {
    /// Of a block.
    fn directions(self, block: u32, seed: u32) -> Vec<Vec3> {
        let of = |count: u32| (block * count..(block + 1) * count).map(move |i| sobol2(i, seed));
        match self {
            Self::Sphere => of(EVEN).map(even).collect(),
            Self::Facing(normal) => of(EVEN / 2).map(|numbers| concentric_cosine_hemisphere(normal, numbers)).collect(),
        }
    }

    /// How many directions of a block lie in a solid angle there.
    fn density(self, direction: Vec3) -> f32 {
        match self {
            Self::Sphere => EVEN as f32 / (4.0 * PI),
            Self::Facing(normal) => (EVEN / 2) as f32 * normal.dot(direction).max(0.0) / PI,
        }
    }
}

fn sky_block(block: u32, seed: u32, spread: Spread, illumination: &dyn Illumination, sky: &dyn Environment) -> Block {
    let mut directions = spread.directions(block, seed);
    let even = directions.len();
    if illumination.is_sky_seen() {
        let numbers = (block * BRIGHT..(block + 1) * BRIGHT).map(|i| sobol2(i, seed ^ 0x5EED));
        directions.extend(numbers.filter_map(|numbers| Some(sky.sample(numbers)?.0)));
    }
    let bright = (directions.len() - even) as f32;
    // the balance heuristic: each direction over the density of both ways to pick it (Veach, Guibas 1995)
    let solid_angle = |&d: &Vec3| {
        let density = spread.density(d) + if bright > 0.0 { bright * sky.density(d) } else { 0.0 };
        1.0 / density.max(f32::MIN_POSITIVE)
    };
    let solid_angles = directions.iter().map(solid_angle).collect();
    let finite = |light: Vec3| if light.is_finite() { light } else { Vec3::ZERO };
    let escaped = directions.iter().map(|&d| finite(illumination.escaped(sky, d))).collect();
    Block { directions, even, solid_angles, escaped }
}

/// A block for light that surfaces reflect.
fn even_block(block: u32, seed: u32, spread: Spread) -> Block {
    let directions = spread.directions(block, seed);
    let solid_angles = directions.iter().map(|&d| 1.0 / spread.density(d).max(f32::MIN_POSITIVE)).collect();
    Block { even: directions.len(), solid_angles, escaped: vec![Vec3::ZERO; directions.len()], directions }
}

/// Blocks of one spread.
struct Set {
    sky: Vec<Block>,
    even: Vec<Block>,
}

/// Where each texel looks.
pub(super) struct Lookouts {
    /// The first is for all that have none of their own.
    sets: Vec<Set>,
    /// Of each texel.
    set: Vec<u16>,
}

impl Lookouts {
    /// So many blocks for all texels of a stage.
    pub fn new(stage: &Stage, count: u32, seed: u32, illumination: &dyn Illumination) -> Self {
        let (normals, set) = flat_sets(stage);
        let of = |spread: Spread| Set {
            sky: (0..count).map(|block| sky_block(block, seed, spread, illumination, stage.scene.sky)).collect(),
            even: (0..count).map(|block| even_block(block, seed, spread)).collect(),
        };
        let spreads = std::iter::once(Spread::Sphere).chain(normals.into_iter().map(Spread::Facing));
        Self { sets: spreads.map(of).collect(), set }
    }

    /// How many sets there are.
    pub fn sets(&self) -> u16 {
        self.sets.len() as u16
    }

    /// Which set is a texel's.
    pub fn set(&self, texel: u32) -> u16 {
        self.set[texel as usize]
    }

    /// The blocks of a set for light that escapes to the sky; the even directions of both kinds are the same.
    pub fn sky(&self, set: u16) -> &[Block] {
        &self.sets[usize::from(set)].sky
    }

    /// And for light that surfaces reflect.
    pub fn even(&self, set: u16) -> &[Block] {
        &self.sets[usize::from(set)].even
    }
}

/// The normals that many texels of flat charts share, and for each texel 0 or one more than the number of its own.
fn flat_sets(stage: &Stage) -> (Vec<Vec3>, Vec<u16>) {
    let chart = |texel: usize| stage.scene.unwrapped.chart[stage.scene.texels[texel].triangle as usize];
    let all: Vec<usize> = (0..stage.places.len()).collect();
    let charts: Vec<&[usize]> = all.chunk_by(|&a, &b| chart(a) == chart(b)).collect();
    let key = |normal: Vec3| (normal / ALIKE).round().as_ivec3().to_array();
    let alike = |a: Vec3, b: Vec3| (a - b).abs().max_element() <= ALIKE;
    let mut of_key: BTreeMap<[i32; 3], Vec<usize>> = BTreeMap::new();
    for (number, texels) in charts.iter().enumerate() {
        let plane = stage.planes[texels[0]];
        let is_flat = texels.iter().all(|&t| alike(stage.planes[t], plane) && alike(stage.places[t].normal, plane));
        if is_flat {
            of_key.entry(key(plane)).or_default().push(number);
        }
    }
    let count = |of: &[usize]| of.iter().map(|&number| charts[number].len()).sum::<usize>();
    let mut many: Vec<Vec<usize>> = of_key.into_values().filter(|of| count(of) >= SHARED).collect();
    many.sort_by_key(|of| std::cmp::Reverse(count(of)));
    many.truncate(MOST_SETS);
    let mut set = vec![0; stage.places.len()];
    for (of, number) in many.iter().zip(1..) {
        of.iter().flat_map(|&chart| charts[chart]).for_each(|&texel| set[texel] = number);
    }
    (many.iter().map(|of| stage.planes[charts[of[0]][0]]).collect(), set)
}

#[cfg(test)]
mod tests {
    use super::super::models::Realistic;
    use super::*;
    use heliodon_math::dome::{ConstantSky, LatLongSky};

    #[test]
    fn every_block_covers_the_sphere() {
        for block in (0..4).map(|block| even_block(block, 7, Spread::Sphere)) {
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
        let fine: Vec<Block> = (0..4096).map(|block| even_block(block, 5, Spread::Sphere)).collect();
        let sum: f32 = fine.iter().flat_map(|b| &b.directions).map(|&d| sky.radiance(d).x * normal.dot(d).max(0.0)).sum();
        let exact = sum * 4.0 / (4096.0 * EVEN as f32);
        for spread in [Spread::Sphere, Spread::Facing(normal)] {
            let mean = (0..16).map(|block| estimate(&sky_block(block, 3, spread, &Realistic, &sky))).sum::<f32>() / 16.0;
            assert!((mean / exact - 1.0).abs() < 0.02, "{mean} and {exact}");
        }
        let plain = sky_block(0, 3, Spread::Sphere, &Realistic, &ConstantSky(Vec3::ONE));
        assert_eq!([plain.directions.len(), plain.even], [EVEN as usize; 2]);
    }

    #[test]
    fn directions_about_a_normal_count_as_much_as_their_cosines() {
        let normal = Vec3::new(0.6, 0.0, 0.8);
        for block in (0..4).map(|block| even_block(block, 7, Spread::Facing(normal))) {
            let each: Vec<f32> = block.directions.iter().zip(&block.solid_angles).map(|(d, w)| normal.dot(*d) * w).collect();
            assert_eq!(each.len(), EVEN as usize / 2);
            assert!(each.iter().all(|one| (one / each[0] - 1.0).abs() < 1e-3), "{each:?}");
            assert!((each.iter().sum::<f32>() - PI).abs() < 1e-3);
        }
    }
}
