//! Who simulates sources of very many particles, as the viewer's commands are asked for it.

use clap::ValueEnum;
use heliodon_view::particles::ParticlesBy;

/// Who simulates sources of very many particles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Particles {
    /// The GPU that draws; the processor where that draws
    #[default]
    Auto,
    /// The processor, which thins them
    Processor,
    /// Whatever draws
    Device,
}

impl From<Particles> for ParticlesBy {
    fn from(asked: Particles) -> Self {
        match asked {
            Particles::Auto => Self::Auto,
            Particles::Processor => Self::Processor,
            Particles::Device => Self::Device,
        }
    }
}
