//! How a vertex's baked light lies in GPU memory.
//!
//! In texels of four words, for a processor that draws loads texels much faster than words of a buffer. A row of a page's texture
//! is a texel of each of [`BLOCK`] vertices; a block of vertices takes one row after the other: the normal (octahedral,
//! 2 x snorm16), the sky transfer as half floats, two a word, the sun bounce (grey, likewise; in colour, a word for each function,
//! [`shared_exponent`]), and the sun mask's words, of which a moment reads two. Neighbouring shader lanes read neighbouring
//! texels, and a chunk is one contiguous upload. With the paper's 92 steps and grey transfer that is 32 bytes a vertex.

use glam::Vec3;
use half::f16;
use heliodon_bundle::{LightLayout, VertexLight};
use rayon::prelude::*;

/// Vertices a block and invocations a workgroup: the most that every device has. On software Vulkan a workgroup costs a
/// fixed time, so few large ones are quicker.
pub const BLOCK: u32 = 256;

/// Vertices that are lit together: as many as a processor handles at once, and few, for most triangles do not show.
pub const GROUP: u32 = 8;

/// Words of a texel.
pub const TEXEL_WORDS: u32 = 4;

/// The light shader and the packing for one [`LightLayout`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VertexLayout(pub LightLayout);

impl VertexLayout {
    /// Words of the sky transfer.
    #[must_use]
    pub fn transfer_words(self) -> u32 {
        (self.0.transfer_floats() as u32).div_ceil(2)
    }

    /// Words of the sun bounce.
    #[must_use]
    pub fn bounce_words(self) -> u32 {
        if self.0.channels == 3 { self.0.sun_bounce_functions } else { self.0.sun_bounce_functions.div_ceil(2) }
    }

    /// Where the mask begins, in words.
    fn mask_at(self) -> u32 {
        1 + self.transfer_words() + self.bounce_words()
    }

    /// Texels a vertex.
    #[must_use]
    pub fn texels(self) -> u32 {
        (self.mask_at() + self.0.mask_words() as u32).div_ceil(TEXEL_WORDS)
    }

    /// The shader that takes the normals out of what is baked, complete.
    #[must_use]
    pub fn normals_wgsl(self) -> String {
        format!("const BLOCK: u32 = {BLOCK}u;\nconst TEXELS: u32 = {}u;\n{}", self.texels(), crate::lamps::NORMALS_WGSL)
    }

    /// The light shader for this layout, complete.
    #[must_use]
    pub fn light_wgsl(self) -> String {
        let mut gather = String::new();
        for word in 0..self.mask_at() {
            let (texel, lane) = (word / TEXEL_WORDS, ["x", "y", "z", "w"][(word % TEXEL_WORDS) as usize]);
            if word % TEXEL_WORDS == 0 {
                gather += &format!("    texel = textureLoad(baked, at + vec2<u32>(0u, {texel}u), 0);\n");
            }
            gather += &match word.checked_sub(1) {
                None => format!("    found.normal = texel.{lane};\n"),
                Some(k) if k < self.transfer_words() => format!("    found.sky += sky_part({k}u, texel.{lane});\n"),
                Some(k) => format!("    found.bounced += bounce_part({}u, texel.{lane});\n", k - self.transfer_words()),
            };
        }
        format!(
            "const BLOCK: u32 = {BLOCK}u;\nconst GROUP: u32 = {GROUP}u;\nconst TEXELS: u32 = {}u;\nconst MASK_AT: u32 = {}u;\n\
             const CHANNELS: u32 = {}u;\n{}\nfn gather(at: vec2<u32>) -> Found {{\n    var found: Found;\n    \
             var texel: vec4<u32>;\n{gather}    return found;\n}}\n",
            self.texels(),
            self.mask_at(),
            self.0.channels,
            include_str!("light.wgsl"),
        )
    }
}

/// A chunk's baked light as [`pack`] takes it.
#[derive(Clone, Copy, Debug)]
pub struct Baked<'a> {
    /// Unit normals.
    pub normals: &'a [Vec3],
    /// The stored light.
    pub light: &'a VertexLight,
}

/// The texels' words of a chunk whose vertex `i` is vertex `order[i]` of `baked`; whole blocks, the rest zero.
#[must_use]
pub fn pack(layout: VertexLayout, baked: Baked<'_>, order: &[u32]) -> Vec<u32> {
    let block = BLOCK as usize;
    let lanes = TEXEL_WORDS as usize;
    let words = layout.texels() as usize * lanes;
    let mask = layout.0.mask_words();
    let transfer = layout.0.transfer_floats();
    let bounce = layout.0.bounce_floats();
    let mut packed = vec![0u32; order.len().div_ceil(block) * block * words];
    for (to, &from) in order.iter().enumerate() {
        let from = from as usize;
        let base = to / block * block * words + to % block * lanes;
        let mut number = 0;
        let mut put = |word: u32| {
            packed[base + number / lanes * lanes * block + number % lanes] = word;
            number += 1;
        };
        put(octahedral(baked.normals[from]));
        for pair in baked.light.sky_transfer[from * transfer..][..transfer].chunks(2) {
            put(halves(pair));
        }
        let bounced = &baked.light.sun_bounce[from * bounce..][..bounce];
        if layout.0.channels == 3 {
            bounced.as_chunks().0.iter().for_each(|&rgb| put(shared_exponent(rgb)));
        } else {
            bounced.chunks(2).for_each(|pair| put(halves(pair)));
        }
        baked.light.sun_mask[from * mask..][..mask].iter().for_each(|&word| put(word));
    }
    packed
}

/// The texels' words of single vertices, each out of the blocks ([`pack`]) of some chunk, with its number there; whole blocks, the rest zero.
#[must_use]
pub fn gather<'a>(layout: VertexLayout, count: usize, vertex: impl Fn(usize) -> (&'a [u32], usize) + Sync) -> Vec<u32> {
    let (block, lanes) = (BLOCK as usize, TEXEL_WORDS as usize);
    let row = block * lanes;
    let of_block = row * layout.texels() as usize;
    let mut gathered = vec![0; count.div_ceil(block) * of_block];
    gathered.par_chunks_mut(of_block).enumerate().for_each(|(number, to)| {
        for at in 0..block.min(count - number * block) {
            let (from, index) = vertex(number * block + at);
            let from = &from[index / block * of_block + index % block * lanes..];
            for (to, from) in to[at * lanes..].chunks_mut(row).zip(from.chunks(row)) {
                to[..lanes].copy_from_slice(&from[..lanes]);
            }
        }
    });
    gathered
}

/// Two half floats, the first in the low bits, as WGSL's `unpack2x16float` reads them.
fn halves(pair: &[f32]) -> u32 {
    let low = u32::from(f16::from_f32(pair[0]).to_bits());
    let high = pair.get(1).map_or(0, |&value| u32::from(f16::from_f32(value).to_bits()));
    low | high << 16
}

/// Three numbers of either sign as multiples, nine bits each, of one power of two from 2^-24 on, whose exponent is the highest
/// five bits: at most 1/256 of the largest of them off. (Textures of RGB9E5 have no sign.)
#[must_use]
pub fn shared_exponent(rgb: [f32; 3]) -> u32 {
    let largest = rgb.into_iter().fold(0.0f32, |largest, v| largest.max(v.abs())).min(32_640.0);
    // The least step of which the largest is at most 255.
    let exponent = ((largest / 255.0).log2().ceil() + 24.0).clamp(0.0, 31.0) as u32;
    let step = (exponent as f32 - 24.0).exp2();
    let nine_bits = |v: f32| ((v / step).round().clamp(-255.0, 255.0) as i32 as u32) & 0x1ff;
    nine_bits(rgb[0]) | nine_bits(rgb[1]) << 9 | nine_bits(rgb[2]) << 18 | exponent << 27
}

/// A unit vector on the octahedron, 2 x snorm16: at most 0.004 degrees off (Cigolle, Donow, Evangelakos, Mara, McGuire,
/// Meyer: "A Survey of Efficient Representations for Independent Unit Vectors", JCGT 3(2), 2014).
#[must_use]
pub fn octahedral(n: Vec3) -> u32 {
    let sum = n.x.abs() + n.y.abs() + n.z.abs();
    let (mut x, mut y) = if sum > 0.0 { (n.x / sum, n.y / sum) } else { (0.0, 0.0) };
    if n.z < 0.0 {
        (x, y) = ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y));
    }
    let snorm = |v: f32| u32::from(((v.clamp(-1.0, 1.0) * 32767.0).round() as i16) as u16);
    snorm(x) | snorm(y) << 16
}

/// Linear albedo as three square roots of ten bits: `Unorm10_10_10_2`. Ten bits of the root resolve 1/500 of an albedo of 0.5
/// and 1/70 of one of 0.01, where eight linear bits would leave steps that show.
#[must_use]
pub fn albedo_roots(albedo: Vec3) -> u32 {
    let root = |v: f32| (v.clamp(0.0, 1.0).sqrt() * 1023.0).round() as u32;
    root(albedo.x) | root(albedo.y) << 10 | root(albedo.z) << 20 | 3 << 30
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::random::hash2_u32;
    use heliodon_math::sphere::fibonacci_sphere;

    fn decode(word: u32) -> Vec3 {
        let snorm = |bits: u32| (f32::from(bits as u16 as i16) / 32767.0).max(-1.0);
        let (x, y) = (snorm(word), snorm(word >> 16));
        let mut n = Vec3::new(x, y, 1.0 - x.abs() - y.abs());
        let fold = (-n.z).max(0.0);
        n.x -= fold.copysign(n.x);
        n.y -= fold.copysign(n.y);
        heliodon_math::frame::unit_or(n, Vec3::Z)
    }

    #[test]
    fn octahedral_normals_are_within_a_hundredth_of_a_degree() {
        for n in fibonacci_sphere(5000).into_iter().chain([Vec3::Z, Vec3::NEG_Z, Vec3::X, Vec3::NEG_Y]) {
            assert!(decode(octahedral(n)).angle_between(n).to_degrees() < 0.03, "{n}");
            assert!((decode(octahedral(n)) - n).length() < 1.2e-4, "{n}");
        }
    }

    #[test]
    fn albedo_survives_ten_bits_of_its_root() {
        for i in 0..=1000 {
            let albedo = i as f32 / 1000.0;
            let code = albedo_roots(Vec3::splat(albedo)) & 1023;
            let back = (code as f32 / 1023.0).powi(2);
            assert!((back - albedo).abs() <= 0.001 * albedo.sqrt() + 1e-6);
        }
    }

    #[test]
    fn shared_exponents_keep_nine_bits_of_the_largest() {
        let decode = |word: u32| {
            let step = ((word >> 27) as f32 - 24.0).exp2();
            [23, 14, 5].map(|shift| (((word << shift) as i32) >> 23) as f32 * step)
        };
        for i in 0..2000u32 {
            let value = |k: u32| {
                let bits = hash2_u32(i, k);
                let magnitude = ((bits & 0xff) as f32 / 12.0 - 12.0).exp2();
                if bits & 0x100 == 0 { magnitude } else { -magnitude }
            };
            let rgb = [0, 1, 2].map(value);
            let largest = rgb.into_iter().fold(0.0f32, |a, b| a.max(b.abs()));
            for (got, wanted) in decode(shared_exponent(rgb)).into_iter().zip(rgb) {
                assert!((got - wanted).abs() <= largest / 254.0, "{got} for {wanted} of {rgb:?}");
            }
        }
        assert_eq!(decode(shared_exponent([0.0; 3])), [0.0; 3]);
        assert_eq!(decode(shared_exponent([1e9, -1e9, 255.0])), [32_640.0, -32_640.0, 256.0]);
        assert_eq!(decode(shared_exponent([-1.0, 0.5, 0.25])), [-1.0, 0.5, 0.25]);
    }

    #[test]
    fn vertices_that_are_gathered_are_those_that_would_be_packed() {
        let shape = LightLayout { sun_steps: 40, coefficients: 4, channels: 3, sun_bounce_functions: 3 };
        let (layout, count) = (VertexLayout(shape), 700_u32);
        let mut light = VertexLight::zeros(shape, count as usize);
        (0..).zip(&mut light.sun_mask).for_each(|(i, word)| *word = hash2_u32(i, 1));
        (0..).zip(&mut light.sky_transfer).for_each(|(i, value)| *value = hash2_u32(i, 2) as f32 * 1e-9);
        (0..).zip(&mut light.sun_bounce).for_each(|(i, value)| *value = hash2_u32(i, 3) as f32 * 1e-9);
        let normals = fibonacci_sphere(count);
        let baked = Baked { normals: &normals, light: &light };
        // of two chunks, every third vertex from behind
        let chunks = [(0..300).collect::<Vec<u32>>(), (300..count).collect()];
        let packed = chunks.each_ref().map(|order| pack(layout, baked, order));
        let some: Vec<u32> = (0..count).rev().step_by(3).chain([5, 5]).collect();
        let gathered = gather(layout, some.len(), |number| {
            let vertex = some[number] as usize;
            let chunk = usize::from(vertex >= 300);
            (&packed[chunk], vertex - 300 * chunk)
        });
        assert!(gathered == pack(layout, baked, &some));
    }

    #[test]
    fn vertices_take_their_place_in_the_blocks() {
        let shape = LightLayout { sun_steps: 40, coefficients: 4, channels: 1, sun_bounce_functions: 3 };
        let layout = VertexLayout(shape);
        assert_eq!((layout.mask_at(), layout.texels()), (1 + 2 + 2, 2));
        let count = 300usize;
        let light = VertexLight {
            sun_mask: (0..count as u32 * 2).collect(),
            sky_transfer: (0..count * 4).map(|i| i as f32).collect(),
            sun_bounce: vec![0.5; count * 3],
            ..VertexLight::zeros(shape, count)
        };
        let baked = Baked { normals: &vec![Vec3::Y; count], light: &light };
        let order: Vec<u32> = (0..count as u32).rev().collect();
        let packed = pack(layout, baked, &order);
        assert_eq!(packed.len(), 2 * BLOCK as usize * 8);
        // Vertex 0 of the chunk is vertex 299 of the input; vertex 299 lies in the second block.
        let at = |vertex: usize, word: usize| packed[((vertex / 256 * 2 + word / 4) * 256 + vertex % 256) * 4 + word % 4];
        assert_eq!((at(0, 5), at(0, 6)), (598, 599));
        assert_eq!((at(299, 5), at(299, 6)), (0, 1));
        assert_eq!(f16::from_bits((at(299, 1) >> 16) as u16).to_f32(), 1.0);
        assert_eq!(f16::from_bits(at(7, 3) as u16).to_f32(), 0.5);
        assert_eq!((at(7, 4) >> 16, at(7, 7)), (0, 0), "the odd half and the last word are padding");
    }
}
