//! The modes of blocks that are written: where which bit of theirs lies, and what colours they give.

use glam::Vec3;

/// How far each step lies from a region's first endpoint, in sixty-fourths: of one region, and of two.
const SIXTEEN: [u32; 16] = [0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64];
const EIGHT: [u32; 8] = [0, 9, 18, 27, 37, 46, 55, 64];

/// Which pixels of a block are of its second region, the first pixel's in the lowest bit.
pub(super) const PARTITIONS: [u16; 32] = [
    0xCCCC, 0x8888, 0xEEEE, 0xECC8, 0xC880, 0xFEEC, 0xFEC8, 0xEC80, 0xC800, 0xFFEC, 0xFE80, 0xE800, 0xFFE8, 0xFF00, 0xFFF0,
    0xF000, 0xF710, 0x008E, 0x7100, 0x08CE, 0x008C, 0x7310, 0x3100, 0x8CCE, 0x088C, 0x3110, 0x6666, 0x366C, 0x17E8, 0x0FF0,
    0x718E, 0x399C,
];
/// The pixels of the second regions whose steps are of the lower half; of the first it is the first.
const ANCHORS: [usize; 32] =
    [15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 2, 8, 2, 2, 8, 8, 15, 2, 8, 2, 2, 8, 8, 2, 2];

/// A mode.
#[derive(Debug)]
pub(super) struct Mode {
    /// Its number, and how many bits that has.
    code: [u32; 2],
    /// 1 or 2.
    pub regions: usize,
    /// Bits of an endpoint's component.
    precision: u32,
    /// Bits of the other endpoints' components, as differences from the first's; as many as `precision`: as they are.
    differences: [u32; 3],
    /// Its endpoints' bits, in their order.
    fields: &'static [Field],
}

/// Bits of an endpoint's component, from the first one on.
#[derive(Debug)]
struct Field {
    component: usize,
    end: usize,
    first: u32,
    count: u32,
}

const RED: usize = 0;
const GREEN: usize = 1;
const BLUE: usize = 2;

macro_rules! fields {
    ($($component:ident $end:literal: $first:literal $count:literal),*) => {
        &[$(Field { component: $component, end: $end, first: $first, count: $count }),*]
    };
}

/// All that are written: of one region, and of two.
pub(super) static MODES: [Mode; 9] = [
    Mode {
        code: [0b01111, 5],
        regions: 1,
        precision: 16,
        differences: [4; 3],
        fields: fields!(
            RED 0: 0 10, GREEN 0: 0 10, BLUE 0: 0 10,
            RED 1: 0 4, RED 0: 15 1, RED 0: 14 1, RED 0: 13 1, RED 0: 12 1, RED 0: 11 1, RED 0: 10 1,
            GREEN 1: 0 4, GREEN 0: 15 1, GREEN 0: 14 1, GREEN 0: 13 1, GREEN 0: 12 1, GREEN 0: 11 1, GREEN 0: 10 1,
            BLUE 1: 0 4, BLUE 0: 15 1, BLUE 0: 14 1, BLUE 0: 13 1, BLUE 0: 12 1, BLUE 0: 11 1, BLUE 0: 10 1
        ),
    },
    Mode {
        code: [0b01011, 5],
        regions: 1,
        precision: 12,
        differences: [8; 3],
        fields: fields!(
            RED 0: 0 10, GREEN 0: 0 10, BLUE 0: 0 10,
            RED 1: 0 8, RED 0: 11 1, RED 0: 10 1, GREEN 1: 0 8, GREEN 0: 11 1, GREEN 0: 10 1,
            BLUE 1: 0 8, BLUE 0: 11 1, BLUE 0: 10 1
        ),
    },
    Mode {
        code: [0b00111, 5],
        regions: 1,
        precision: 11,
        differences: [9; 3],
        fields: fields!(
            RED 0: 0 10, GREEN 0: 0 10, BLUE 0: 0 10,
            RED 1: 0 9, RED 0: 10 1, GREEN 1: 0 9, GREEN 0: 10 1, BLUE 1: 0 9, BLUE 0: 10 1
        ),
    },
    Mode {
        code: [0b00011, 5],
        regions: 1,
        precision: 10,
        differences: [10; 3],
        fields: fields!(RED 0: 0 10, GREEN 0: 0 10, BLUE 0: 0 10, RED 1: 0 10, GREEN 1: 0 10, BLUE 1: 0 10),
    },
    Mode {
        code: [0b00, 2],
        regions: 2,
        precision: 10,
        differences: [5; 3],
        fields: fields!(
            GREEN 2: 4 1, BLUE 2: 4 1, BLUE 3: 4 1, RED 0: 0 10, GREEN 0: 0 10, BLUE 0: 0 10,
            RED 1: 0 5, GREEN 3: 4 1, GREEN 2: 0 4, GREEN 1: 0 5, BLUE 3: 0 1, GREEN 3: 0 4, BLUE 1: 0 5, BLUE 3: 1 1,
            BLUE 2: 0 4, RED 2: 0 5, BLUE 3: 2 1, RED 3: 0 5, BLUE 3: 3 1
        ),
    },
    Mode {
        code: [0b01110, 5],
        regions: 2,
        precision: 9,
        differences: [5; 3],
        fields: fields!(
            RED 0: 0 9, BLUE 2: 4 1, GREEN 0: 0 9, GREEN 2: 4 1, BLUE 0: 0 9, BLUE 3: 4 1,
            RED 1: 0 5, GREEN 3: 4 1, GREEN 2: 0 4, GREEN 1: 0 5, BLUE 3: 0 1, GREEN 3: 0 4, BLUE 1: 0 5, BLUE 3: 1 1,
            BLUE 2: 0 4, RED 2: 0 5, BLUE 3: 2 1, RED 3: 0 5, BLUE 3: 3 1
        ),
    },
    Mode {
        code: [0b10010, 5],
        regions: 2,
        precision: 8,
        differences: [6, 5, 5],
        fields: fields!(
            RED 0: 0 8, GREEN 3: 4 1, BLUE 2: 4 1, GREEN 0: 0 8, BLUE 3: 2 1, GREEN 2: 4 1, BLUE 0: 0 8, BLUE 3: 3 1,
            BLUE 3: 4 1, RED 1: 0 6, GREEN 2: 0 4, GREEN 1: 0 5, BLUE 3: 0 1, GREEN 3: 0 4, BLUE 1: 0 5, BLUE 3: 1 1,
            BLUE 2: 0 4, RED 2: 0 6, RED 3: 0 6
        ),
    },
    Mode {
        code: [0b01, 2],
        regions: 2,
        precision: 7,
        differences: [6; 3],
        fields: fields!(
            GREEN 2: 5 1, GREEN 3: 4 1, GREEN 3: 5 1, RED 0: 0 7, BLUE 3: 0 1, BLUE 3: 1 1, BLUE 2: 4 1, GREEN 0: 0 7,
            BLUE 2: 5 1, BLUE 3: 2 1, GREEN 2: 4 1, BLUE 0: 0 7, BLUE 3: 3 1, BLUE 3: 5 1, BLUE 3: 4 1,
            RED 1: 0 6, GREEN 2: 0 4, GREEN 1: 0 6, GREEN 3: 0 4, BLUE 1: 0 6, BLUE 2: 0 4, RED 2: 0 6, RED 3: 0 6
        ),
    },
    Mode {
        code: [0b11110, 5],
        regions: 2,
        precision: 6,
        differences: [6; 3],
        fields: fields!(
            RED 0: 0 6, GREEN 3: 4 1, BLUE 3: 0 1, BLUE 3: 1 1, BLUE 2: 4 1, GREEN 0: 0 6, GREEN 2: 5 1, BLUE 2: 5 1,
            BLUE 3: 2 1, GREEN 2: 4 1, BLUE 0: 0 6, GREEN 3: 5 1, BLUE 3: 3 1, BLUE 3: 5 1, BLUE 3: 4 1,
            RED 1: 0 6, GREEN 2: 0 4, GREEN 1: 0 6, GREEN 3: 0 4, BLUE 1: 0 6, BLUE 2: 0 4, RED 2: 0 6, RED 3: 0 6
        ),
    },
];

/// Both endpoints of the first region, then those of the second.
pub(super) type Ends = [[u32; 3]; 4];

/// What a block says.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    pub mode: &'static Mode,
    /// Of two regions which pixels are of the second.
    pub partition: usize,
    pub ends: Ends,
    pub steps: [u8; 16],
}

impl Mode {
    /// The largest that a component can be.
    pub fn largest(&self) -> u32 {
        (1 << self.precision) - 1
    }

    /// Steps between a region's endpoints.
    pub fn weights(&self) -> &'static [u32] {
        if self.regions == 1 { &SIXTEEN } else { &EIGHT }
    }

    /// The bits that come nearest to a half's.
    pub fn quantized(&self, half: Vec3) -> [u32; 3] {
        half.to_array().map(|x| {
            let guess = (x * (64.0 / 31.0 / 65_536.0) * (1_u32 << self.precision) as f32).round().max(0.0) as u32;
            let near = guess.saturating_sub(1)..=(guess + 1).min(self.largest());
            let off = |&q: &u32| (f64::from(finished(self.unquantized(q))) - f64::from(x)).abs();
            near.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(self.largest())
        })
    }

    fn unquantized(&self, bits: u32) -> u32 {
        match bits {
            0 => 0,
            _ if self.precision >= 15 => bits,
            _ if bits == self.largest() => 0xFFFF,
            _ => ((bits << 16) + 0x8000) >> self.precision,
        }
    }

    /// Whether all endpoints are near enough to the first.
    pub fn holds(&self, ends: &Ends) -> bool {
        let is_near = |end: &[u32; 3], c: usize| {
            let reach = 1 << (self.differences[c] - 1);
            self.is_direct(c) || (-reach..reach).contains(&(end[c] as i32 - ends[0][c] as i32))
        };
        ends[1..2 * self.regions].iter().all(|end| (0..3).all(|c| is_near(end, c)))
    }

    fn is_direct(&self, component: usize) -> bool {
        self.differences[component] == self.precision
    }

    /// The colours between two endpoints, as halves' bits; as many as there are weights.
    pub fn palette(&self, ends: &[[u32; 3]]) -> [Vec3; 16] {
        let weights = self.weights();
        let [a, b] = [ends[0], ends[1]].map(|end| end.map(|bits| self.unquantized(bits)));
        std::array::from_fn(|step| {
            let weight = weights[step.min(weights.len() - 1)];
            let component = |c: usize| finished((a[c] * (64 - weight) + b[c] * weight + 32) >> 6) as f32;
            Vec3::new(component(0), component(1), component(2))
        })
    }

    /// Which pixels are of the second region.
    pub fn second(&self, partition: usize) -> u16 {
        if self.regions == 1 { 0 } else { PARTITIONS[partition] }
    }

    /// The pixel of a region whose step is of the lower half.
    pub fn anchor(&self, partition: usize, region: usize) -> usize {
        if region == 0 { 0 } else { ANCHORS[partition] }
    }

    fn step_bits(&self, partition: usize, pixel: usize) -> u32 {
        let bits = if self.regions == 1 { 4 } else { 3 };
        let is_anchor = (0..self.regions).any(|region| self.anchor(partition, region) == pixel);
        if is_anchor { bits - 1 } else { bits }
    }
}

impl Block {
    pub fn black() -> Self {
        Self { mode: &MODES[0], partition: 0, ends: [[0; 3]; 4], steps: [0; 16] }
    }

    pub fn written(&self) -> u128 {
        let mode = self.mode;
        let mut bits = Bits { block: 0, at: 0 };
        bits.put(mode.code[0], mode.code[1]);
        for field in mode.fields {
            let (end, c) = (self.ends[field.end], field.component);
            let is_whole = field.end == 0 || mode.is_direct(c);
            let value = if is_whole { end[c] } else { end[c].wrapping_sub(self.ends[0][c]) };
            bits.put(value >> field.first, field.count);
        }
        if mode.regions == 2 {
            bits.put(self.partition as u32, 5);
        }
        let steps = self.steps.iter().enumerate();
        steps.for_each(|(pixel, &step)| bits.put(u32::from(step), mode.step_bits(self.partition, pixel)));
        bits.block
    }

    /// `None` of modes that are not written here.
    pub fn read(block: u128) -> Option<Self> {
        let code = |length: u32| block as u32 & ((1 << length) - 1);
        let mode = MODES.iter().find(|mode| code(mode.code[1]) == mode.code[0])?;
        let mut bits = Bits { block, at: mode.code[1] };
        let mut ends = Ends::default();
        for field in mode.fields {
            ends[field.end][field.component] |= bits.take(field.count) << field.first;
        }
        for (end, c) in (1..2 * mode.regions).flat_map(|end| (0..3).map(move |c| (end, c))).filter(|(_, c)| !mode.is_direct(*c))
        {
            let unused = 32 - mode.differences[c];
            let difference = (ends[end][c] << unused) as i32 >> unused;
            ends[end][c] = ends[0][c].wrapping_add_signed(difference) & mode.largest();
        }
        let partition = if mode.regions == 2 { bits.take(5) as usize } else { 0 };
        let steps = std::array::from_fn(|pixel| bits.take(mode.step_bits(partition, pixel)) as u8);
        Some(Self { mode, partition, ends, steps })
    }

    /// What a pixel can be, step by step, as halves' bits.
    pub fn choices(&self, pixel: usize) -> impl Iterator<Item = Vec3> + use<> {
        let Self { mode, partition, ends, .. } = *self;
        let region = usize::from(mode.second(partition) >> pixel & 1);
        mode.palette(&ends[2 * region..]).into_iter().take(1 << mode.step_bits(partition, pixel))
    }

    /// What its pixels are, as halves' bits.
    pub fn pixels(&self) -> [Vec3; 16] {
        let palettes = [0, 2].map(|end| self.mode.palette(&self.ends[end..]));
        let second = self.mode.second(self.partition);
        std::array::from_fn(|pixel| palettes[usize::from(second >> pixel & 1)][usize::from(self.steps[pixel])])
    }
}

/// A block, bit by bit.
struct Bits {
    block: u128,
    at: u32,
}

impl Bits {
    fn put(&mut self, value: u32, count: u32) {
        self.block |= u128::from(value & ((1 << count) - 1)) << self.at;
        self.at += count;
    }

    fn take(&mut self, count: u32) -> u32 {
        let value = (self.block >> self.at) as u32 & ((1 << count) - 1);
        self.at += count;
        value
    }
}

fn finished(value: u32) -> u32 {
    (value * 31) >> 6
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::random::Pcg32;

    #[test]
    fn blocks_of_every_mode_are_read_as_they_were_written() {
        let mut rng = Pcg32::new(2, 9);
        for mode in &MODES {
            let ends = mode.fields.iter().map(|field| field.count).sum::<u32>();
            let of_shape = if mode.regions == 2 { 5 } else { 0 };
            let steps = |partition: usize| (0..16).map(|pixel| mode.step_bits(partition, pixel)).sum::<u32>();
            for partition in 0..32 {
                assert_eq!(mode.code[1] + ends + of_shape + steps(partition), 128, "{mode:?}");
            }
            for _ in 0..200 {
                let bits = u128::from(rng.next_u32()) | u128::from(rng.next_u32()) << 32;
                let bits = bits | bits.rotate_left(64) ^ u128::from(rng.next_u32()) << 80;
                let bits = bits >> mode.code[1] << mode.code[1] | u128::from(mode.code[0]);
                let block = Block::read(bits).unwrap();
                assert!(std::ptr::eq(block.mode, mode));
                assert_eq!(block.written(), bits, "{mode:?}");
            }
        }
    }
}
