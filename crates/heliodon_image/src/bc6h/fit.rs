//! The block that comes nearest to sixteen pixels.
//!
//! Endpoints are fitted by the principal axis and then by least squares, in the halves' own bits, in which an error is one of the value's part. Two regions are tried
//! where one leaves an error, and of their 32 shapes those whose regions' pixels are most alike; what is left of it is looked for one bit away.

use super::modes::{Block, Ends, MODES, Mode, PARTITIONS};
use glam::Vec3;

/// Largest half float that is finite, as bits.
pub(super) const LARGEST: f32 = 31_743.0;
/// Rounds of least squares.
const ROUNDS: usize = 3;
/// The mean square of bits below which nobody looks for better: two thousandths of the value.
const FINE: f32 = 4.0;
/// Shapes of two regions that are fitted.
const SHAPES: usize = 3;
/// Times that every endpoint is moved by a bit.
const MOVES: usize = 1;

/// What a block is to hold.
pub(super) struct Pixels {
    /// As halves' bits.
    colors: [Vec3; 16],
    /// Those that count, the first in the lowest bit, and those of them that are 0.
    counted: u16,
    dark: u16,
}

/// A block before it is known which of a region's endpoints is the first, and how far off it is.
#[derive(Clone, Copy)]
struct Candidate {
    block: Block,
    off: f32,
}

impl Pixels {
    /// Those that count decide; where none counts, all do.
    pub fn new(colors: [Vec3; 16], counts: [bool; 16]) -> Self {
        let counted = set(|i| counts[i]);
        let counted = if counted == 0 { u16::MAX } else { counted };
        let dark = set(|i| colors[i] == Vec3::ZERO) & counted;
        Self { colors, counted, dark }
    }

    pub fn block(&self) -> Block {
        let (one, two) = MODES.split_at(MODES.iter().take_while(|mode| mode.regions == 1).count());
        let line = self.line(u16::MAX).unwrap_or_default();
        let mut best = one.iter().filter_map(|mode| self.fit(mode, 0, [line; 2])).min_by(nearer);
        let fine = FINE * self.counted.count_ones() as f32;
        if best.is_none_or(|best| best.off > fine) {
            let of_two = self.shapes().into_iter().flat_map(|shape| {
                let lines = [!PARTITIONS[shape], PARTITIONS[shape]].map(|region| self.line(region));
                // where nothing counts anything will do, and what is near is told by all modes
                let lines = [lines[0].or(lines[1]), lines[1].or(lines[0])].map(Option::unwrap_or_default);
                two.iter().filter_map(move |mode| self.fit(mode, shape, lines))
            });
            best = best.into_iter().chain(of_two).min_by(nearer).map(|best| self.moved(best, fine));
        }
        best.and_then(|best| best.anchored()).unwrap_or_else(Block::black)
    }

    fn counted(&self, region: u16) -> impl Iterator<Item = Vec3> + Clone + '_ {
        members(region & self.counted).map(|i| self.colors[i])
    }

    /// Where a region's colours lie: both ends of a line, the first of them 0 where one of its pixels is that; `None` where none counts.
    fn line(&self, region: u16) -> Option<[Vec3; 2]> {
        let colors = self.counted(region);
        let count = colors.clone().count() as f32;
        if count == 0.0 {
            return None;
        }
        if self.dark & region != 0 {
            let brightest = colors.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
            return brightest.map(|brightest| [Vec3::ZERO, brightest]);
        }
        let mean = colors.clone().sum::<Vec3>() / count;
        let axis = principal_axis(colors.clone(), mean);
        let along = colors.map(|color| (color - mean).dot(axis));
        let (low, high) = along.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        Some([mean + axis * low, mean + axis * high])
    }

    /// The partitions whose regions' pixels are most alike, the best first.
    fn shapes(&self) -> [usize; SHAPES] {
        let mean = self.counted(u16::MAX).sum::<Vec3>() / self.counted.count_ones() as f32;
        let squares = |region: u16| {
            let (count, sum, squares) = self.counted(region).fold((0.0, Vec3::ZERO, 0.0), |(count, sum, squares), color| {
                (count + 1.0, sum + (color - mean), squares + color.distance_squared(mean))
            });
            if count > 0.0 { squares - sum.length_squared() / count } else { 0.0 }
        };
        let mut shapes: [(f32, usize); 32] =
            std::array::from_fn(|shape| (squares(PARTITIONS[shape]) + squares(!PARTITIONS[shape]), shape));
        shapes.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        std::array::from_fn(|i| shapes[i].1)
    }

    /// For each pixel the step that is nearest. What is 0 and counts stays that, or it is infinitely far off.
    fn told(&self, mode: &'static Mode, partition: usize, ends: Ends) -> Candidate {
        let count = mode.weights().len();
        let palettes = [0, 2].map(|end| mode.palette(&ends[end..]));
        let second = mode.second(partition);
        let mut sum = 0.0;
        let steps = std::array::from_fn(|i| {
            let palette = &palettes[usize::from(second >> i & 1)][..count];
            let (mut best, mut least) = (0, f32::INFINITY);
            for (step, color) in palette.iter().enumerate() {
                let off = color.distance_squared(self.colors[i]);
                if off < least {
                    (best, least) = (step as u8, off);
                }
            }
            if self.dark >> i & 1 == 1 && least > 0.0 {
                sum = f32::INFINITY;
            }
            sum += if self.counted >> i & 1 == 1 { least } else { 0.0 };
            best
        });
        Candidate { block: Block { mode, partition, ends, steps }, off: sum }
    }

    /// The best of a mode near these lines; `None` where it cannot tell them.
    fn fit(&self, mode: &'static Mode, partition: usize, lines: [[Vec3; 2]; 2]) -> Option<Candidate> {
        let quantized = |lines: [[Vec3; 2]; 2]| -> Ends {
            let [[a, b], [c, d]] = lines;
            [a, b, c, d].map(|end| mode.quantized(end))
        };
        let second = mode.second(partition);
        let (mut lines, mut best) = (lines, self.told(mode, partition, quantized(lines)));
        for _ in 0..ROUNDS {
            for (line, region) in lines.iter_mut().zip([!second, second]).take(mode.regions) {
                *line = self.fitted(region, &best.block).unwrap_or(*line);
            }
            let next = self.told(mode, partition, quantized(lines));
            if next.off >= best.off || !mode.holds(&next.block.ends) {
                break;
            }
            best = next;
        }
        best.anchored().map(|_| best)
    }

    /// The endpoints from which a region's pixels at their steps are least off.
    fn fitted(&self, region: u16, block: &Block) -> Option<[Vec3; 2]> {
        let (mut aa, mut ab, mut bb) = (0.0, 0.0, 0.0);
        let (mut a, mut b) = (Vec3::ZERO, Vec3::ZERO);
        for i in members(region & self.counted) {
            let share = block.mode.weights()[usize::from(block.steps[i])] as f32 / 64.0;
            aa += (1.0 - share) * (1.0 - share);
            ab += (1.0 - share) * share;
            bb += share * share;
            a += self.colors[i] * (1.0 - share);
            b += self.colors[i] * share;
        }
        let limit = |end: Vec3| end.clamp(Vec3::ZERO, Vec3::splat(LARGEST));
        if self.dark & region != 0 {
            return (bb > 0.0).then(|| [Vec3::ZERO, limit(b / bb)]);
        }
        let determinant = aa * bb - ab * ab;
        (determinant > 1e-3).then(|| [limit((a * bb - b * ab) / determinant), limit((b * aa - a * ab) / determinant)])
    }

    /// With endpoints a bit away, as long as that is nearer.
    fn moved(&self, mut best: Candidate, fine: f32) -> Candidate {
        for _ in 0..MOVES {
            let before = best.off;
            for (end, c) in (0..2 * best.block.mode.regions).flat_map(|end| (0..3).map(move |c| (end, c))) {
                for by in [1, -1] {
                    let Block { mode, partition, mut ends, .. } = best.block;
                    ends[end][c] = ends[end][c].saturating_add_signed(by).min(mode.largest());
                    let next = self.told(mode, partition, ends);
                    if next.off < best.off && next.anchored().is_some() {
                        best = next;
                    }
                }
            }
            if best.off <= fine || best.off >= before {
                break;
            }
        }
        best
    }
}

impl Candidate {
    /// As it is written: the step of one pixel of each region has one bit less, it is of the lower half. `None` where endpoints then lie too far from the first.
    fn anchored(&self) -> Option<Block> {
        let mut block = self.block;
        let Block { mode, partition, .. } = block;
        let last = mode.weights().len() as u8 - 1;
        for region in 0..mode.regions {
            if block.steps[mode.anchor(partition, region)] > last / 2 {
                block.ends.swap(2 * region, 2 * region + 1);
                let pixels = if region == 1 { mode.second(partition) } else { !mode.second(partition) };
                members(pixels).for_each(|i| block.steps[i] = last - block.steps[i]);
            }
        }
        mode.holds(&block.ends).then_some(block)
    }
}

fn nearer(a: &Candidate, b: &Candidate) -> std::cmp::Ordering {
    a.off.total_cmp(&b.off)
}

/// Pixels as bits, and back.
fn set(is_in: impl Fn(usize) -> bool) -> u16 {
    (0..16).fold(0, |set, i| set | u16::from(is_in(i)) << i)
}

fn members(set: u16) -> impl Iterator<Item = usize> + Clone {
    (0..16).filter(move |i| set >> i & 1 == 1)
}

/// The direction in which colours differ most, by powers of their covariance.
fn principal_axis(colors: impl Iterator<Item = Vec3>, mean: Vec3) -> Vec3 {
    let [mut xx, mut xy, mut xz] = [Vec3::ZERO; 3];
    for color in colors {
        let off = color - mean;
        (xx, xy, xz) = (xx + off * off.x, xy + off * off.y, xz + off * off.z);
    }
    let mut axis = [xx, xy, xz].into_iter().max_by(|a, b| a.length_squared().total_cmp(&b.length_squared())).unwrap_or(xx);
    for _ in 0..8 {
        let Some(unit) = axis.try_normalize() else { return Vec3::ONE.normalize_or_zero() };
        axis = xx * unit.x + xy * unit.y + xz * unit.z;
    }
    axis.normalize_or(Vec3::ONE.normalize_or_zero())
}
