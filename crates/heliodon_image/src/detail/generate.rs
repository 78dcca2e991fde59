//! What is generated, and with which parameters.

use super::quantise::with_contrast;
use super::{DetailError, DetailTexture, noise, plaster, stone, wood};

/// What a generated texture looks like.
///
/// Its features are measured in texels, not in tiles: a larger texture shows more of the same material, and repeats less.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DetailKind {
    /// White Gaussian noise: every texel for itself. The paper's own choice.
    Noise,
    /// Gaussian noise of one size of grain, the same in all directions.
    Band {
        /// Texels from crest to crest, from 4 to an eighth of the size. Longer is softer, and repeats more visibly; below 4 the
        /// texels' own grid would show.
        wavelength: f32,
    },
    /// Dressed stone: grain at many scales, small pits, broken veins.
    Stone,
    /// Plaster: soft overlapping strokes of a trowel, fine sand.
    Plaster,
    /// Wood cut along the fibre, which runs down the columns: rings, fibres, pores.
    Wood {
        /// Knots in a tile, at most 8. Each is seen again in every tile: 0 repeats least.
        knots: u32,
    },
}

impl DetailKind {
    /// One of each, with the parameters that they have when nothing else is said.
    pub const ALL: [Self; 5] =
        [Self::Noise, Self::Band { wavelength: 6.0 }, Self::Stone, Self::Plaster, Self::Wood { knots: 0 }];

    /// Its name on the command line.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Noise => "noise",
            Self::Band { .. } => "band",
            Self::Stone => "stone",
            Self::Plaster => "plaster",
            Self::Wood { .. } => "wood",
        }
    }

    /// The kind of a name, with its own parameters.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// The contrast that looks natural, as in [`DetailParams::contrast`].
    #[must_use]
    pub fn natural_contrast(&self) -> f32 {
        match self {
            Self::Noise => 14.0,
            Self::Band { .. } | Self::Stone => 16.0,
            Self::Plaster => 9.0,
            Self::Wood { .. } => 18.0,
        }
    }
}

/// What to generate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetailParams {
    /// What it looks like.
    pub kind: DetailKind,
    /// Texels along each side: 64, 128, 256 or 512. Larger repeats less, and takes four times the memory for each step: 512 takes
    /// 341 KiB with its mip levels.
    pub size: u32,
    /// Which of all textures of its kind; any number.
    pub seed: u64,
    /// The standard deviation of the codes, from 1 to 40. 13 lets two thirds of a surface vary by at most a tenth. Up to 40, at most 2 % of the
    /// codes end at 0 or 255.
    pub contrast: f32,
}

impl DetailParams {
    /// A texture of 256 x 256 with the contrast that looks natural.
    #[must_use]
    pub fn new(kind: DetailKind) -> Self {
        Self { kind, size: 256, seed: 0, contrast: kind.natural_contrast() }
    }

    /// Small enough for any machine, as in the paper: 64 x 64.
    #[must_use]
    pub fn small(kind: DetailKind) -> Self {
        Self { size: 64, ..Self::new(kind) }
    }

    /// What repeats least: 512 x 512.
    #[must_use]
    pub fn large(kind: DetailKind) -> Self {
        Self { size: 512, ..Self::new(kind) }
    }

    /// # Errors
    /// The first parameter outside of its range.
    pub fn validate(&self) -> Result<(), DetailError> {
        let wrong = |parameter, value: String, allowed| Err(DetailError::Parameter { parameter, value, allowed });
        if ![64, 128, 256, 512].contains(&self.size) {
            return wrong("the size", self.size.to_string(), "64, 128, 256 or 512");
        }
        // comparisons that what is not a number fails
        if !(1.0..=40.0).contains(&self.contrast) {
            return wrong("the contrast", self.contrast.to_string(), "a standard deviation from 1 to 40 codes");
        }
        match self.kind {
            DetailKind::Band { wavelength } if !(4.0..=self.size as f32 / 8.0).contains(&wavelength) => {
                wrong("the wavelength", wavelength.to_string(), "4 texels to an eighth of the size")
            }
            DetailKind::Wood { knots } if knots > 8 => wrong("the number of knots", knots.to_string(), "0 to 8"),
            _ => Ok(()),
        }
    }
}

impl DetailTexture {
    /// Makes a texture: seamless in both directions, of exact mean, the same to the bit on every platform.
    ///
    /// Takes about a second for 512 x 512 on one core.
    ///
    /// # Errors
    /// As [`DetailParams::validate`].
    pub fn generate(params: &DetailParams) -> Result<Self, DetailError> {
        params.validate()?;
        let (size, seed) = (params.size as usize, params.seed);
        let field = match params.kind {
            DetailKind::Noise => noise::white(size, seed),
            DetailKind::Band { wavelength } => noise::band(size, seed, f64::from(wavelength)),
            DetailKind::Stone => stone::stone(size, seed),
            DetailKind::Plaster => plaster::plaster(size, seed),
            DetailKind::Wood { knots } => wood::wood(size, seed, knots),
        };
        let codes = with_contrast(&field.normalised().values, f64::from(params.contrast));
        Ok(Self { width: params.size, height: params.size, codes })
    }
}
