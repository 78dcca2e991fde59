//! Daylight in texels, for parts whose triangles are too large for light at their vertices.
//!
//! One atlas for all such parts of a site, in whole squares of 4 x 4 texels, so that three mip levels of a chart take from no other. Light comes from the solve
//! of the vertices, by the very rays and sums that serve them: sun masks at every texel, the sky's transfer where it changes ([`heliodon_lightmap::refine`]),
//! the bounced sun, which changes slowly, at every square. Walls thinner than a texel keep dark rooms dark ([`walls`]).

mod atlas;
mod choice;
mod kept;
mod levels;
mod seams;
mod stage;
mod walls;
mod weathering;

pub use atlas::{Atlas, expects_texels, texels_first};
pub use choice::Choice;
pub(crate) use levels::{Owners, coarser, mean, most};
pub use stage::SolvedScene;
pub(crate) use stage::{Asked, Lit};
pub use weathering::{weather_texels, weathering_layer};

use crate::codec::{Decoder, Encoder};
use crate::error::BakeError;
use crate::names::TexelNames;
use crate::scene::Scene;
use crate::stages::Work;
use atlas::Texels;
use heliodon_bundle::texels::{TEXEL_LEVELS, float_texture, sky_level, sun_texture};
use heliodon_bundle::{LightLayout, TexelLight};
use heliodon_light::SunMasks;
use seams::{carry, closed};
use stage::TexelValues;
use walls::{Walled, is_dark};

/// Light in texels as it is solved, before it is put into textures.
#[derive(Clone, Debug, PartialEq)]
pub struct BakedTexels {
    /// W words for each texel of the finest level, in the atlas's order of texels.
    pub(crate) masks: Vec<u32>,
    /// The sky transfer's numbers for each.
    pub(crate) sky: Vec<f32>,
    /// The sun bounce's numbers for each texel of the coarsest level.
    pub(crate) bounce: Vec<f32>,
    /// Texels whose light was asked for, of the sky and of the bounce.
    pub samples: [u64; 2],
    /// Rays of their gather, and those that looked for walls between them,
    pub gather_rays: u64,
    /// and to the suns.
    pub mask_rays: u64,
}

/// Solves the light of an atlas.
///
/// # Errors
/// Input that the solver refuses, a cache that cannot be written.
pub fn bake_texels(
    solved: &SolvedScene,
    (scene, atlas): (&Scene, &Atlas),
    work: &Work,
    names: &TexelNames,
) -> Result<BakedTexels, BakeError> {
    let (fine, channels) = (atlas.texels(scene, 0), solved.channels() as usize);
    let masks = solved.masks(&(atlas, &fine), work, &names.masks)?;
    let above = atlas.texels(scene, sky_level(solved.channels()));
    let mut sky = solved.values(&(atlas, &above), Asked::Sky, work, &names.sky)?;
    let darkened = Walled { solved, atlas, texels: &above }.darken(&mut sky);
    let seams = atlas.seams(scene, &above);
    carry(&seams, &above.grid, &mut sky);
    let (masks, rays) = shown(Walled { solved, atlas, texels: &fine }, masks, (&above, &sky));
    let mut baked = BakedTexels {
        masks: masks.words,
        sky: closed(seams, (atlas, &above), &sky, &darkened, (Asked::Sky, channels)),
        bounce: Vec::new(),
        samples: [sky.samples, 0],
        gather_rays: sky.rays + rays,
        mask_rays: masks.rays,
    };
    if solved.sun.is_some() {
        let coarse = atlas.texels(scene, TEXEL_LEVELS - 1);
        let mut bounce = solved.values(&(atlas, &coarse), Asked::Bounce, work, &names.bounce)?;
        let darkened = Walled { solved, atlas, texels: &coarse }.darken(&mut bounce);
        let seams = atlas.seams(scene, &coarse);
        carry(&seams, &coarse.grid, &mut bounce);
        baked.bounce = closed(seams, (atlas, &coarse), &bounce, &darkened, (Asked::Bounce, channels));
        baked.samples[1] = bounce.samples;
        baked.gather_rays += bounce.rays;
    }
    Ok(baked)
}

/// The masks of texels: of those that lie inside of something, as the texels of the sky's level tell, the nearest that do not, and none beside walls of what is dark; and the rays that looked
/// for walls.
fn shown(fine: Walled, masks: SunMasks, (level, sky): (&Texels, &TexelValues)) -> (SunMasks, u64) {
    let valid = fine.texels.of_coarser(level, &sky.valid, true);
    let words = masks.words_per_point();
    let of = |&texel: &u32| &masks.words[texel as usize * words..(texel as usize + 1) * words];
    let mut shown: Vec<u32> = fine.texels.grid.nearest_valid(&valid).iter().flat_map(of).copied().collect();
    let brightest = sky.ambient.iter().copied().fold(0.0, f32::max);
    let dark: Vec<bool> = sky.ambient.iter().map(|&ambient| is_dark(ambient, brightest)).collect();
    let rays = fine.darken_masks(&mut shown, words, &valid, &fine.texels.of_coarser(level, &dark, false));
    (SunMasks { words: shown, ..masks }, rays)
}

impl BakedTexels {
    /// The textures of the bundle, and how many texels filtering may ask for.
    #[must_use]
    pub fn textures(&self, scene: &Scene, atlas: &Atlas, layout: LightLayout) -> (TexelLight, u64) {
        let levels: Vec<Texels> = (0..TEXEL_LEVELS).map(|level| atlas.texels(scene, level)).collect();
        let owners: Vec<Owners> =
            levels.iter().map(|level| Owners::new(level.side, &level.texels, &atlas.unwrapped().chart)).collect();
        let mut masks = vec![spread(&levels[0], &self.masks, layout.mask_words())];
        for pair in owners.windows(2) {
            masks.extend(masks.last().map(|finer| coarser(&pair[1], (&pair[0], finer), layout.mask_words(), most)));
        }
        let words = layout.mask_words();
        for (level, masks) in masks.iter_mut().enumerate().take(owners.len() - 1) {
            for (texel, of) in owners[level].rim(&owners[owners.len() - 1], (owners.len() - 1 - level) as u32) {
                masks.copy_within(of * words..(of + 1) * words, texel * words);
            }
        }
        let above = sky_level(layout.channels) as usize;
        let mut sky = vec![spread(&levels[above], &self.sky, layout.transfer_floats())];
        for pair in owners[above..].windows(2) {
            sky.extend(sky.last().map(|finer| coarser(&pair[1], (&pair[0], finer), layout.transfer_floats(), mean)));
        }
        let sides = |level: &Texels| [level.side; 2];
        let coarsest = &levels[levels.len() - 1];
        let bounced = layout.bounce_floats();
        let light = TexelLight {
            sun: sun_texture(layout, sides(&levels[0]), &masks),
            sky: float_texture(sides(&levels[above]), layout.transfer_floats(), &sky),
            bounce: (bounced > 0).then(|| float_texture(sides(coarsest), bounced, &[spread(coarsest, &self.bounce, bounced)])),
        };
        (light, levels[0].texels.len() as u64)
    }

    /// Bytes of it, to be kept until the bundle is written.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut encoder = Encoder::default();
        encoder.run(&self.masks).run(&self.sky).run(&self.bounce).run(&self.samples);
        encoder.run(&[self.gather_rays, self.mask_rays]);
        encoder.finish()
    }

    /// From such bytes; `None` where they are of something else.
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let mut decoder = Decoder::new(bytes);
        let (masks, sky, bounce) = (decoder.run()?, decoder.run()?, decoder.run()?);
        let samples = decoder.run::<u64>()?.try_into().ok()?;
        let [gather_rays, mask_rays] = decoder.run::<u64>()?[..] else { return None };
        decoder.is_empty().then_some(Self { masks, sky, bounce, samples, gather_rays, mask_rays })
    }
}

/// Values of a level's texels at their places in the atlas, `width` each.
fn spread<T: Copy + Default>(level: &Texels, values: &[T], width: usize) -> Vec<T> {
    let side = level.side as usize;
    let mut all = vec![T::default(); side * side * width];
    for (texel, own) in level.texels.iter().zip(values.chunks_exact(width.max(1))) {
        let place = (usize::from(texel.y) * side + usize::from(texel.x)) * width;
        all[place..place + width].copy_from_slice(own);
    }
    all
}
