//! Noise in space: what erosion, stains and rock are made of. Plain arithmetic and integer hashes, so the bits are the same
//! on every platform.

use glam::Vec3;
use heliodon_math::random::{hash_u32, unit_f32};

/// A hash of a lattice point.
#[inline]
fn lattice(seed: u32, x: i32, y: i32, z: i32) -> u32 {
    let mixed =
        (x as u32).wrapping_mul(0x8DA6_B343) ^ (y as u32).wrapping_mul(0xD816_3841) ^ (z as u32).wrapping_mul(0xCB1A_B31F);
    hash_u32(mixed ^ seed.wrapping_mul(0x9E37_79B9))
}

/// The dot product of a lattice point's gradient, one of the twelve edges of a cube (Perlin 2002), and an offset.
#[inline]
fn gradient_dot(hash: u32, d: Vec3) -> f32 {
    let h = hash >> 28;
    let u = if h < 8 { d.x } else { d.y };
    let v = if h < 4 {
        d.y
    } else if h == 12 || h == 14 {
        d.x
    } else {
        d.z
    };
    (if h & 1 == 0 { u } else { -u }) + (if h & 2 == 0 { v } else { -v })
}

/// Gradient noise with one feature a unit, about in [-1, 1], zero at the lattice points (Perlin, "Improving Noise", 2002).
#[inline]
pub fn gradient(seed: u32, p: Vec3) -> f32 {
    let floor = p.floor();
    let f = p - floor;
    let (x, y, z) = (floor.x as i32, floor.y as i32, floor.z as i32);
    let w = f * f * f * (f * (f * 6.0 - Vec3::splat(15.0)) + Vec3::splat(10.0));
    let corner = |dx: i32, dy: i32, dz: i32| {
        let hash = lattice(seed, x.wrapping_add(dx), y.wrapping_add(dy), z.wrapping_add(dz));
        gradient_dot(hash, f - Vec3::new(dx as f32, dy as f32, dz as f32))
    };
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let near = mix(mix(corner(0, 0, 0), corner(1, 0, 0), w.x), mix(corner(0, 1, 0), corner(1, 1, 0), w.x), w.y);
    let far = mix(mix(corner(0, 0, 1), corner(1, 0, 1), w.x), mix(corner(0, 1, 1), corner(1, 1, 1), w.x), w.y);
    mix(near, far, w.z)
}

/// Octaves of gradient noise, each twice as fine and half as strong; about in [-1, 1].
#[inline]
pub fn fbm(seed: u32, p: Vec3, octaves: u32) -> f32 {
    let (mut sum, mut amplitude, mut q, mut total) = (0.0, 1.0, p, 0.0);
    for octave in 0..octaves {
        sum += amplitude * gradient(seed.wrapping_add(octave * 0x51ED), q);
        total += amplitude;
        amplitude *= 0.5;
        // a shift that is no lattice vector keeps the zeros of the octaves apart
        q = q * 2.03 + Vec3::new(17.31, 5.77, 11.13);
    }
    sum / total
}

/// Noise with sharp crests, in [0, 1], one on the crest lines: cracks and veins.
#[inline]
pub fn ridged(seed: u32, p: Vec3, octaves: u32) -> f32 {
    let (mut sum, mut amplitude, mut q, mut total) = (0.0, 1.0, p, 0.0);
    for octave in 0..octaves {
        sum += amplitude * (1.0 - gradient(seed.wrapping_add(octave * 0x3779), q).abs().min(1.0));
        total += amplitude;
        amplitude *= 0.5;
        q = q * 2.11 + Vec3::new(3.7, 19.1, 7.3);
    }
    sum / total
}

/// Where a point lies among random points, one in each unit square of the plan (Worley 1996).
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// From the nearest point to the place.
    pub offset: Vec3,
    /// How much nearer the nearest point is than the second nearest; zero on the borders.
    pub border: f32,
    /// The nearest point's hash.
    pub id: u32,
}

/// The cell of a place of the plan; its height does not matter.
pub fn cell(seed: u32, p: Vec3) -> Cell {
    let (floor_x, floor_z) = (p.x.floor(), p.z.floor());
    let (x, z) = (floor_x as i32, floor_z as i32);
    let (mut first, mut second) = (f32::MAX, f32::MAX);
    let (mut offset, mut id) = (Vec3::ZERO, 0);
    for dz in -1..=1_i32 {
        for dx in -1..=1_i32 {
            let hash = lattice(seed, x.wrapping_add(dx), 0, z.wrapping_add(dz));
            let point = Vec3::new(
                floor_x + dx as f32 + unit_f32(hash),
                0.0,
                floor_z + dz as f32 + unit_f32(hash.wrapping_mul(0x9E37_79B9)),
            );
            let from = Vec3::new(p.x - point.x, 0.0, p.z - point.z);
            let distance = from.length_squared();
            if distance < first {
                (second, first) = (first, distance);
                (offset, id) = (from, hash);
            } else if distance < second {
                second = distance;
            }
        }
    }
    Cell { offset, border: second.sqrt() - first.sqrt(), id }
}

/// 0 below `low`, 1 above `high`, smooth between.
#[inline]
pub fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_zero_on_the_lattice_and_bounded_between() {
        assert_eq!(gradient(3, Vec3::new(4.0, -2.0, 7.0)), 0.0);
        let (mut low, mut high) = (0.0_f32, 0.0_f32);
        for i in 0..20_000 {
            let t = i as f32;
            let value = fbm(5, Vec3::new(t * 0.37, t * 0.11, -t * 0.23), 3);
            low = low.min(value);
            high = high.max(value);
        }
        assert!(low > -1.1 && high < 1.1, "{low} {high}");
        assert!(low < -0.4 && high > 0.4, "the noise has no contrast: {low} {high}");
    }

    #[test]
    fn a_cell_belongs_to_its_nearest_point() {
        for i in 0..500 {
            let p = Vec3::new(i as f32 * 0.173, 0.0, i as f32 * -0.071);
            let here = cell(1, p);
            assert!(here.border >= 0.0 && here.offset.length() < 1.5);
            // the point itself lies in the same cell
            assert_eq!(cell(1, p - here.offset).id, here.id);
        }
    }
}
