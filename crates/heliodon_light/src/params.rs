//! How finely light is solved.

use crate::LightError;
use crate::bounce::LANES;

/// The most sun steps that a mask can hold (the bundle format's limit).
pub const MAX_SUN_STEPS: usize = 1024;

/// Functions of the sun that go on after its first bounce, and where so few samples are taken that they err more than that: with four
/// coefficients and one channel, one pass.
const GOING_ON: usize = 28;
const FEW_GOING_ON: usize = 12;
const FEW_SAMPLES: u32 = 256;

/// An error of the functions of the day that is no more than that of the sampling, over the number of samples. It is the mean over the
/// day, and single hours err by more.
const FUNCTION_ERROR_PER_SAMPLE: f32 = 8.0;

/// Whether light takes on the colour of what it bounces off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    /// One number for all colours: bounces use the albedo's luminance, as the 2006 system did. A third of the memory.
    Mono,
    /// Red, green and blue: coloured stone tints what lies near it.
    Rgb,
}

impl Channels {
    /// 1 or 3.
    #[must_use]
    pub fn count(self) -> usize {
        match self {
            Self::Mono => 1,
            Self::Rgb => 3,
        }
    }
}

/// How the transfer of sky light and the bounced sunlight are solved.
#[derive(Clone, Debug, PartialEq)]
pub struct LightParams {
    /// Rays that leave each point, on average: `2 * samples` directions are spread over the whole sphere, the same ones for all
    /// points, and a point uses those above its surface. Time and memory grow in proportion; the error falls with about the
    /// power -3/4, for the directions are a lattice. 4 to 65,536.
    pub samples: u32,
    /// Points at which a lattice of directions likely errs by more than `20 / samples` of their light (a streak of sun in deep shade) look
    /// around in so many further ones; where no sun bounces from `5 / samples` on, for the sky alone.
    pub further_lattices: u32,
    /// Further diffuse bounces after the light's first arrival. Each costs one pass over the kept hits, no new rays; what the
    /// next one would add is at most albedo to the power `bounces + 1` of the light.
    pub bounces: u32,
    /// Spherical harmonic coefficients of the sky: 4, or 9 for skies with sharper features at more than twice the storage.
    pub coefficients: usize,
    /// One channel or three.
    pub channels: Channels,
    /// How far rays start off the surface along the normal, in metres. Too small: rays meet the surface that they leave. Too
    /// large: light leaks through cracks and contact shadows are lost. [`crate::default_offset_m`] is a good choice.
    pub offset_m: f32,
    /// Triangles with an edge longer than this are divided into cells, each with light of its own; `None` chooses
    /// [`crate::default_cell_size_m`]. Smaller: finer bounced light of large flat faces, more points to solve.
    pub cell_size_m: Option<f32>,
    /// Upper limit of the cells that division may make; the cell size grows until it holds. Each costs as much as a vertex.
    pub max_sub_cells: usize,
    /// Bytes that kept hits may take. Beyond, they are read for every bounce from where [`crate::KeptBounces`] has them, or traced again: the same result,
    /// as many times the rays as there are passes ([`LightParams::bounce_passes`]).
    pub hit_budget_bytes: u64,
    /// How often the back sides of open surfaces, once rays from valid points have met them, are given points of their own (a
    /// gather for each vertex concerned) and searched for further ones. 0 leaves back sides black.
    pub back_side_rounds: u32,
    /// The most functions that bounced sunlight is stored by over the day; each is a float per vertex and channel.
    pub sun_functions: usize,
    /// The relative error (root mean square over the day, 95th percentile of the points) at which fewer functions are enough; 8 in `samples`
    /// where that is more.
    pub sun_error: f32,
    /// Turns the set of directions.
    pub seed: u32,
}

impl Default for LightParams {
    /// What a bake uses: errors of about one percent on a dense mesh.
    fn default() -> Self {
        Self {
            samples: 256,
            further_lattices: 3,
            bounces: 4,
            coefficients: 4,
            channels: Channels::Mono,
            offset_m: 1e-4,
            cell_size_m: None,
            max_sub_cells: 500_000,
            hit_budget_bytes: 4 << 30,
            back_side_rounds: 1,
            sun_functions: 44,
            sun_error: 0.02,
            seed: 0,
        }
    }
}

impl LightParams {
    /// A quick look: a quarter of the rays, two bounces.
    #[must_use]
    pub fn preview() -> Self {
        Self { samples: 64, further_lattices: 0, bounces: 2, max_sub_cells: 50_000, sun_functions: 4, ..Self::default() }
    }

    /// To keep: sixteen times the rays of the default, colour, nine coefficients, eight bounces.
    #[must_use]
    pub fn archival() -> Self {
        Self {
            samples: 4096,
            bounces: 8,
            coefficients: 9,
            channels: Channels::Rgb,
            max_sub_cells: 4_000_000,
            back_side_rounds: 3,
            sun_functions: 64,
            sun_error: 0.004,
            ..Self::default()
        }
    }

    /// Whether every field lies in its range.
    ///
    /// # Errors
    /// [`LightError::Parameter`] names the first that does not.
    pub fn validate(&self) -> Result<(), LightError> {
        let bad = |name, value: String, allowed| Err(LightError::Parameter { name, value, allowed });
        if !(4..=65_536).contains(&self.samples) {
            return bad("samples", self.samples.to_string(), "between 4 and 65536");
        }
        if self.further_lattices > 64 {
            return bad("further_lattices", self.further_lattices.to_string(), "at most 64");
        }
        if self.bounces > 1000 {
            return bad("bounces", self.bounces.to_string(), "at most 1000");
        }
        if self.coefficients != 4 && self.coefficients != 9 {
            return bad("coefficients", self.coefficients.to_string(), "4 or 9");
        }
        if !(self.offset_m.is_finite() && self.offset_m >= 0.0) {
            return bad("offset_m", self.offset_m.to_string(), "a finite number of metres, not negative");
        }
        if let Some(size) = self.cell_size_m
            && !(size.is_finite() && size > 0.0)
        {
            return bad("cell_size_m", size.to_string(), "a finite positive number of metres");
        }
        if !(1..=64).contains(&self.sun_functions) {
            return bad("sun_functions", self.sun_functions.to_string(), "between 1 and 64");
        }
        if !(self.sun_error.is_finite() && self.sun_error >= 0.0) {
            return bad("sun_error", self.sun_error.to_string(), "a finite number, not negative");
        }
        Ok(())
    }

    /// The relative error at which fewer functions of the day are enough: no finer than sampling errs.
    pub(crate) fn function_error(&self) -> f32 {
        self.sun_error.max(FUNCTION_ERROR_PER_SAMPLE / self.samples as f32)
    }

    /// Of so many functions of the day, those that go on after the sun's first bounce: what has bounced twice changes slowly over the day.
    pub(crate) fn functions_going_on(&self, functions: usize) -> usize {
        functions.min(if self.samples < FEW_SAMPLES { FEW_GOING_ON } else { GOING_ON })
    }

    /// With so many functions of the day, how often light is passed on over all points: each bounce of each sixteen lanes is a pass.
    #[must_use]
    pub fn bounce_passes(&self, functions: usize) -> u64 {
        let going_on = (self.coefficients + self.functions_going_on(functions)) * self.channels.count();
        u64::from(self.bounces) * going_on.div_ceil(LANES) as u64
    }

    /// Directions over the whole sphere.
    #[must_use]
    pub fn directions(&self) -> u32 {
        2 * self.samples
    }
}
