//! How actors are lit, as the viewer's commands are asked for it.

use clap::ValueEnum;
use heliodon_view::actors::levels::Directions;
use heliodon_view::actors::{ActorsOptions, Backend};

/// The arguments.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// What poses actors and asks for their light
    #[arg(long, value_enum, default_value = "auto")]
    actors_backend: ActorsBackend,
    /// Light actors from the light sphere of this level (0: 6 directions, 1: 18, 2: 66, 3: 258, 4: 1026, 5: 4098) [default: what the frames leave time for]
    #[arg(long, value_name = "L", value_parser = clap::value_parser!(u32).range(0..=5))]
    actors_level: Option<u32>,
}

/// What poses actors and asks for their light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum ActorsBackend {
    /// The GPU that draws; the processor where that draws
    #[default]
    Auto,
    /// Rays on the processor
    Cpu,
    /// The GPU that draws
    Gpu,
}

impl Args {
    /// Changes what was asked for.
    pub fn apply(self, options: &mut ActorsOptions) {
        options.backend = match self.actors_backend {
            ActorsBackend::Auto => Backend::Auto,
            ActorsBackend::Cpu => Backend::Cpu,
            ActorsBackend::Gpu => Backend::Gpu,
        };
        if let Some(level) = self.actors_level {
            options.directions = Directions::Fixed(level);
        }
    }
}
