//! The light of the scan's vertices, every one of which is asked.

use super::{NORMALS, POSITIONS, Scan, TRIANGLES};
use crate::blocks::{BlockStage, GRANULE, block_ranges};
use crate::cache::Cache;
use crate::chunks::{Numbers, VertexValues};
use crate::codec::{Decoder, Encoder};
use crate::error::BakeError;
use crate::names::TexelNames;
use crate::report::Batches;
use crate::stages::Work;
use crate::texels::{Asked, SolvedScene};
use glam::Vec3;
use half::f16;
use half::vec::HalfFloatVecExt;
use heliodon_light::{RayVertices, Validity};
use std::ops::Range;

/// The light of the scan's N vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BakedScan {
    /// W words for each.
    pub masks: Vec<u32>,
    /// The sky transfer's numbers for each, rounded to 16 bits: one part in 2,048 at most.
    pub sky: Vec<f16>,
    /// The sun bounce's numbers for each.
    pub bounce: Vec<f16>,
    /// 1 where a vertex sees the open; the others show the light of one that does, where their surface has any.
    pub valid: Vec<u8>,
    /// Rays of the gather,
    pub gather_rays: u64,
    /// and those to the suns.
    pub mask_rays: u64,
}

/// Blocks whose light is put into its place at once: all of a large scan would be there twice.
const AT_ONCE: usize = 64;
/// Vertices of a block of finished light.
const KEPT_AT_ONCE: usize = 1 << 18;

impl Scan<'_> {
    /// Its light.
    ///
    /// # Errors
    /// Input that the solver refuses, a cache that cannot be written.
    pub fn light(&self, solved: &SolvedScene, work: &Work, names: &TexelNames) -> Result<BakedScan, BakeError> {
        let (positions, normals): (Vec<Vec3>, Vec<Vec3>) = (self.array(POSITIONS)?, self.array(NORMALS)?);
        let vertices = RayVertices::new(&positions, &normals, &self.array::<[u32; 3]>(TRIANGLES)?);
        let count = positions.len();
        let (words, [sky, bounce]) = (solved.input.suns.len().div_ceil(u32::BITS as usize), solved.widths());
        let mut baked = BakedScan {
            masks: vec![0; count * words],
            sky: vec![f16::ZERO; count * sky],
            bounce: vec![f16::ZERO; count * bounce],
            valid: vec![0; count],
            gather_rays: 0,
            mask_rays: 0,
        };
        let pieces = || block_ranges(0..count, receiving_at_once(count));
        let some = || pieces().map(|range| vertices.receivers(solved.receiving, range));

        let batches = Batches::new(work.reporter);
        let blocks = pieces().map(|range| solved.mask_ranges(range.len()).len()).sum();
        let stage = begin(*work, &batches, (&names.masks, "sun on the scan"), (count, blocks));
        let mut first_block = 0;
        for receivers in some() {
            let ranges = solved.mask_ranges(receivers.points().len());
            let masks = solved.masks_at(&receivers, &ranges, (&stage, first_block))?;
            receivers.put(0..receivers.points().len(), &masks.words, words, &mut baked.masks);
            baked.mask_rays += masks.rays;
            first_block += ranges.len();
        }
        work.reporter.finished();

        let batches = Batches::new(work.reporter);
        let blocks = pieces().map(|range| solved.ranges(range.len()).len()).sum();
        let stage = begin(*work, &batches, (&names.sky, "sky and bounced sun on the scan"), (count, blocks));
        let mut first_block = 0;
        for receivers in some() {
            for ranges in solved.ranges(receivers.points().len()).chunks(AT_ONCE) {
                // whoever asks for the bounced sun gets the sky by the same rays
                let blocks = solved.received(&receivers, ranges, Asked::Bounce, (&stage, first_block))?;
                first_block += ranges.len();
                for (range, block) in ranges.iter().zip(blocks) {
                    receivers.put(range.clone(), &to_half(&block.sky_transfer), sky, &mut baked.sky);
                    receivers.put(range.clone(), &to_half(&block.sun_bounce), bounce, &mut baked.bounce);
                    receivers.put(range.clone(), &block.valid, 1, &mut baked.valid);
                    baked.gather_rays += block.rays;
                }
            }
        }
        work.reporter.finished();
        drop(vertices);

        let validity = Validity::new(baked.valid, &positions, &normals, &self.array::<[u32; 3]>(TRIANGLES)?);
        for (vertex, &source) in validity.source.iter().enumerate().filter(|&(vertex, &source)| source as usize != vertex) {
            let of = |width: usize| source as usize * width..(source as usize + 1) * width;
            baked.masks.copy_within(of(words), vertex * words);
            baked.sky.copy_within(of(sky), vertex * sky);
            baked.bounce.copy_within(of(bounce), vertex * bounce);
        }
        baked.valid = validity.valid;
        Ok(baked)
    }
}

impl BakedScan {
    /// As chunks show it.
    #[must_use]
    pub fn values(&self) -> VertexValues<'_> {
        let (sky, bounce) = (Numbers::Half(&self.sky), Numbers::Half(&self.bounce));
        VertexValues { valid: &self.valid, masks: &self.masks, sky, bounce }
    }

    /// Keeps it until the bundle is written.
    ///
    /// # Errors
    /// A cache that cannot be written.
    pub fn keep(&self, cache: &Cache, names: &TexelNames) -> Result<(), BakeError> {
        let count = self.valid.len();
        let mut head = Encoder::default();
        head.run(&[count as u64, self.gather_rays, self.mask_rays]);
        cache.store(&names.light, 0, &head.finish())?;
        for (block, range) in pieces(count).enumerate() {
            let mut encoder = Encoder::default();
            encoder.run(some(&self.masks, count, &range)).run(some(&self.sky, count, &range));
            encoder.run(some(&self.bounce, count, &range)).run(some(&self.valid, count, &range));
            cache.store(&names.light, block + 1, &encoder.finish())?;
        }
        Ok(())
    }

    /// What was kept of a scan; `widths` are words of masks, and numbers of the sky and of the bounced sun. `None` where it is not all there.
    #[must_use]
    pub fn kept(cache: &Cache, names: &TexelNames, scan: &Scan, widths: [usize; 3]) -> Option<Self> {
        let [count, gather_rays, mask_rays] = Decoder::new(&cache.load(&names.light, 0)?).run::<u64>()?[..] else {
            return None;
        };
        if count != scan.counts()[0] {
            return None;
        }
        let mut baked = Self { gather_rays, mask_rays, ..Self::default() };
        for (block, range) in pieces(usize::try_from(count).ok()?).enumerate() {
            let bytes = cache.load(&names.light, block + 1)?;
            let mut decoder = Decoder::new(&bytes);
            let (masks, sky, bounce) = (decoder.run::<u32>()?, decoder.run::<f16>()?, decoder.run::<f16>()?);
            let valid = decoder.run::<u8>()?;
            let lengths = [masks.len(), sky.len(), bounce.len()];
            if lengths != widths.map(|width| width * range.len()) || valid.len() != range.len() || !decoder.is_empty() {
                return None;
            }
            baked.masks.extend(masks);
            baked.sky.extend(sky);
            baked.bounce.extend(bounce);
            baked.valid.extend(valid);
        }
        Some(baked)
    }
}

/// Begins a stage of so many vertices, whose blocks are done batch by batch, and tells which of them are done already.
fn begin<'a>(
    work: Work<'a>,
    batches: &'a Batches<'a>,
    (file_stage, told): (&'a str, &'a str),
    (vertices, blocks): (usize, usize),
) -> BlockStage<'a> {
    work.reporter.stage(told, vertices as u64);
    let stage = BlockStage { reporter: batches, told: true, ..work.stage(file_stage, told) };
    stage.tell_kept(0..blocks);
    stage
}

/// How many of so many vertices receive light at once: an eighth, for the places of all take more memory than their light, but not so few that threads wait for one another.
fn receiving_at_once(count: usize) -> usize {
    (count / 8).next_multiple_of(GRANULE).clamp(4 * GRANULE, 1 << 20)
}

fn to_half(numbers: &[f32]) -> Vec<f16> {
    Vec::from_f32_slice(numbers)
}

/// Ranges of vertices that are kept together.
fn pieces(count: usize) -> impl Iterator<Item = Range<usize>> {
    crate::blocks::block_ranges(0..count, KEPT_AT_ONCE)
}

/// The values of some of `count` vertices.
fn some<'a, T>(all: &'a [T], count: usize, range: &Range<usize>) -> &'a [T] {
    let width = all.len() / count.max(1);
    &all[range.start * width..range.end * width]
}
