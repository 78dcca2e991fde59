//! The light of an atlas: sun masks at every texel, bounced light at every square of them, the sky where it changes.

use super::atlas::{Atlas, Texels};
use crate::blocks::{BlockStage, block_ranges, points_per_block};
use crate::codec::{Decoder, Encoder};
use crate::error::BakeError;
use crate::light::LightInput;
use crate::report::Batches;
use crate::stages::{Work, decode_masks, encode_masks};
use heliodon_light::{
    BouncedSun, CellLight, LightParams, MaskParams, Received, Receivers, Receiving, SunMasks, bake_sun_masks,
};
use heliodon_lightmap::refine::{Grid, RefineParams, Refined, Sampled, refine};
use std::ops::Range;

/// Texels of one resolution that take light.
pub trait Lit {
    /// What lies beside what.
    fn grid(&self) -> &Grid;

    /// Some of them, by their numbers, as receivers of light.
    fn receivers<'a>(&self, receiving: &'a Receiving<'a>, texels: &[u32]) -> Receivers<'a>;
}

impl Lit for (&Atlas, &Texels) {
    fn grid(&self) -> &Grid {
        &self.1.grid
    }

    fn receivers<'a>(&self, receiving: &'a Receiving<'a>, texels: &[u32]) -> Receivers<'a> {
        let (atlas, all) = self;
        let places: Vec<_> = texels.iter().map(|&texel| atlas.place(&all.texels[texel as usize])).collect();
        receiving.at(&places)
    }
}

/// What is solved of the scene, from which texels take their light.
pub struct SolvedScene<'a> {
    /// What was solved, and how finely.
    pub input: &'a LightInput<'a>,
    /// Where texels can be, all back sides added.
    pub receiving: &'a Receiving<'a>,
    /// What the cells reflect.
    pub cells: &'a CellLight,
    /// Where the suns shine, if their light bounces.
    pub sun: Option<&'a BouncedSun>,
}

/// The light of some texels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TexelValues {
    /// Numbers of each, texel by texel.
    pub values: Vec<f32>,
    /// How much of a sky that is the same all over reaches each: what no sky reaches is dark.
    pub ambient: Vec<f32>,
    /// Whether each lies where light can be.
    pub valid: Vec<bool>,
    /// Texels that were sampled.
    pub samples: u64,
    /// Rays that were traced for them.
    pub rays: u64,
}

/// What is asked of texels, besides the sky.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Asked {
    /// The sky's transfer.
    Sky,
    /// The bounced sun.
    Bounce,
}

/// Numbers nearer to 0 than this are as good as dark, of suns and skies of unit radiance.
const FLOOR: f32 = 0.02;
/// How large an error is, in those of sampling: interpolation is to add less than there is.
const ERROR_PER_SAMPLE: f32 = 4.0;
/// But no more than this.
const LEAST_ERROR: f32 = 0.01;

impl SolvedScene<'_> {
    fn params(&self) -> &LightParams {
        self.input.params
    }

    /// Channels of the light.
    #[must_use]
    pub fn channels(&self) -> u32 {
        self.params().channels.count() as u32
    }

    /// Numbers of the sky's transfer and of the bounced sun at a place.
    #[must_use]
    pub fn widths(&self) -> [usize; 2] {
        let params = self.params();
        [params.coefficients, self.sun.map_or(0, BouncedSun::function_count)].map(|count| count * params.channels.count())
    }

    /// Which suns reach each texel.
    ///
    /// # Errors
    /// A cache that cannot be written.
    pub fn masks(&self, texels: &dyn Lit, work: &Work, name: &str) -> Result<SunMasks, BakeError> {
        let all: Vec<u32> = (0..texels.grid().len() as u32).collect();
        let receivers = texels.receivers(self.receiving, &all);
        let masks = self.masks_at(&receivers, &self.mask_ranges(all.len()), (&work.stage(name, "sun on texels"), 0))?;
        let words = receivers.in_order_of_places(&masks.words, masks.words_per_point());
        Ok(SunMasks { words, ..masks })
    }

    /// The blocks in which so many receivers are asked for the suns.
    #[must_use]
    pub fn mask_ranges(&self, receivers: usize) -> Vec<Range<usize>> {
        block_ranges(0..receivers, points_per_block(receivers, (self.input.suns.len() as u64).div_ceil(2))).collect()
    }

    /// Which suns reach each receiver of some blocks, in the receivers' own order. They are kept as those of a stage from a number on.
    ///
    /// # Errors
    /// A cache that cannot be written.
    pub fn masks_at(
        &self,
        receivers: &Receivers,
        ranges: &[Range<usize>],
        (stage, first_block): (&BlockStage, usize),
    ) -> Result<SunMasks, BakeError> {
        let surfaces = &self.input.surfaces;
        let (suns, steps) = (self.input.suns, self.input.suns.len() as u32);
        let points = receivers.points();
        let parts = stage.run(
            ranges,
            first_block,
            |bytes, range| {
                let (rays, words) = decode_masks(bytes)?;
                let masks = SunMasks { steps, rays, words };
                let fits = masks.words.len() == range.len() * masks.words_per_point() && masks.validate().is_ok();
                fits.then_some(masks)
            },
            |range| Ok::<_, BakeError>(bake_sun_masks(surfaces, points, suns, range, &MaskParams::default())?),
            |masks| encode_masks(masks),
        )?;
        let mut all = SunMasks { steps, ..SunMasks::default() };
        for part in &parts {
            all.append(part)?;
        }
        Ok(all)
    }

    /// The numbers of all texels, of which those are sampled between which light changes.
    ///
    /// # Errors
    /// Input that the solver refuses, a cache that cannot be written.
    pub fn values(&self, texels: &dyn Lit, asked: Asked, work: &Work, name: &str) -> Result<TexelValues, BakeError> {
        let (params, [sky, bounce]) = (self.params(), self.widths());
        let channels = params.channels.count();
        // the sky's first numbers are of what is the same all over; with the bounced sun they come last
        let (count, ambient) =
            if asked == Asked::Sky { (sky, 0..channels) } else { (bounce + channels, bounce..bounce + channels) };
        let refining = RefineParams {
            first_stride: if asked == Asked::Sky { 8 } else { 1 },
            error: (ERROR_PER_SAMPLE / params.samples as f32).max(LEAST_ERROR),
            floor: FLOOR,
            ..RefineParams::default()
        };
        let told = if asked == Asked::Sky { "sky on texels" } else { "bounced sun on texels" };
        work.reporter.stage(told, texels.grid().len() as u64);
        // lattice after lattice, of which nobody knows beforehand how many texels they will ask for
        let batches = Batches::new(work.reporter);
        let stage = BlockStage { reporter: &batches, ..work.stage(name, told) };
        let (mut first_block, mut rays, mut failed) = (0, 0, None);
        let mut sample = |texels_asked: &[u32]| -> Sampled {
            let received = match failed {
                None => self.receive(texels, texels_asked, asked, &stage, &mut first_block),
                Some(_) => Ok(Received::default()),
            };
            match received {
                Ok(received) if failed.is_none() => {
                    rays += received.rays;
                    let of_both = |texel: usize| {
                        let of_sky = &received.sky_transfer[texel * sky..][..channels];
                        received.sun_bounce[texel * bounce..][..bounce].iter().chain(of_sky).copied()
                    };
                    let values = match asked {
                        Asked::Sky => received.sky_transfer,
                        Asked::Bounce => (0..texels_asked.len()).flat_map(of_both).collect(),
                    };
                    Sampled { values, valid: received.valid.iter().map(|&flag| flag == 1).collect(), reach_m: received.reach_m }
                }
                other => {
                    failed = failed.take().or(other.err());
                    let len = texels_asked.len();
                    Sampled { values: vec![0.0; len * count], valid: vec![true; len], reach_m: vec![f32::INFINITY; len] }
                }
            }
        };
        let Refined { values, valid, samples, .. } = refine(texels.grid(), count, &refining, &mut sample);
        work.reporter.finished();
        match failed {
            Some(error) => Err(error),
            None => {
                let of_texels = || values.chunks_exact(count);
                let ambient = of_texels().map(|of| of[ambient.clone()].iter().copied().fold(0.0, f32::max)).collect();
                let values =
                    if asked == Asked::Sky { values } else { of_texels().flat_map(|of| &of[..bounce]).copied().collect() };
                Ok(TexelValues { values, ambient, valid, samples: samples as u64, rays })
            }
        }
    }

    /// The light of some texels, in their order, in blocks that are kept.
    fn receive(
        &self,
        texels: &dyn Lit,
        some: &[u32],
        asked: Asked,
        stage: &BlockStage,
        first_block: &mut usize,
    ) -> Result<Received, BakeError> {
        let receivers = texels.receivers(self.receiving, some);
        let ranges = self.ranges(some.len());
        let blocks = self.received(&receivers, &ranges, asked, (stage, *first_block))?;
        *first_block += ranges.len();
        let mut all = Received::default();
        blocks.into_iter().for_each(|block| all.append(block));
        let [sky, bounce] = self.widths();
        let bounce = if asked == Asked::Bounce { bounce } else { 0 };
        Ok(Received {
            sky_transfer: receivers.in_order_of_places(&all.sky_transfer, sky),
            sun_bounce: receivers.in_order_of_places(&all.sun_bounce, bounce),
            valid: receivers.in_order_of_places(&all.valid, 1),
            reach_m: receivers.in_order_of_places(&all.reach_m, 1),
            rays: all.rays,
        })
    }

    /// The blocks of so many receivers.
    #[must_use]
    pub fn ranges(&self, receivers: usize) -> Vec<Range<usize>> {
        block_ranges(0..receivers, points_per_block(receivers, u64::from(self.params().samples))).collect()
    }

    /// The light of some blocks of receivers, in the receivers' own order: the sky's, and with the bounced sun asked for both. They are kept as those of a stage from a
    /// number on.
    ///
    /// # Errors
    /// Input that the solver refuses, a cache that cannot be written.
    pub fn received(
        &self,
        receivers: &Receivers,
        ranges: &[Range<usize>],
        asked: Asked,
        (stage, first_block): (&BlockStage, usize),
    ) -> Result<Vec<Received>, BakeError> {
        let params = self.params();
        let sun = self.sun.filter(|_| asked == Asked::Bounce);
        let functions = sun.map_or(0, BouncedSun::function_count);
        stage.run(
            ranges,
            first_block,
            |bytes, range| decode_received(bytes).filter(|block| block.validate(range.len(), functions, params).is_ok()),
            |range| Ok::<_, BakeError>(receivers.receive(self.cells, sun, range)?),
            |block| encode_received(block),
        )
    }
}

fn encode_received(block: &Received) -> Vec<u8> {
    let mut encoder = Encoder::default();
    encoder.number(block.rays).run(&block.sky_transfer).run(&block.sun_bounce).run(&block.valid).run(&block.reach_m);
    encoder.finish()
}

fn decode_received(bytes: &[u8]) -> Option<Received> {
    let mut decoder = Decoder::new(bytes);
    let rays = decoder.number()?;
    let (sky_transfer, sun_bounce) = (decoder.run()?, decoder.run()?);
    let block = Received { rays, sky_transfer, sun_bounce, valid: decoder.run()?, reach_m: decoder.run()? };
    decoder.is_empty().then_some(block)
}
