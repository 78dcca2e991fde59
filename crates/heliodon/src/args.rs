//! The command line as it is written: raw arguments, which every command turns into a validated plan.

use crate::commands;
use clap::{Parser, Subcommand};

/// Light a monument once, walk around it at any hour of the day.
#[derive(Debug, Parser)]
#[command(
    name = "heliodon",
    version,
    arg_required_else_help = true,
    after_help = "Examples:\n  heliodon demo                     a temple's day, from nothing, in a few minutes\n  heliodon new mysite               a site folder of your own to start from\n  heliodon bake mysite              compute its light; run again, it goes on where it stopped\n  heliodon render mysite/bundle --time 10:00 -o ten.png\n\nExit codes: 0 done, 1 failed, 2 wrong arguments."
)]
pub struct Args {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// What every command knows.
    #[command(flatten)]
    pub common: Common,
}

/// What every command knows.
#[derive(Clone, Debug, clap::Args)]
pub struct Common {
    /// Print the result as one JSON object
    #[arg(long, global = true, help_heading = "Everywhere")]
    pub json: bool,
    /// Use at most N processor cores; results do not depend on it [default: all]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), help_heading = "Everywhere")]
    pub threads: Option<u16>,
    /// Show no progress; warnings are still told
    #[arg(long, short, global = true, help_heading = "Everywhere")]
    pub quiet: bool,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// A Doric temple's day: builds the site, bakes it, opens the viewer or makes pictures and a film
    Demo(commands::demo::Args),
    /// Makes a site folder to start from
    New(commands::new::Args),
    /// Checks site.toml and everything that it names; bakes nothing
    Check(commands::check::Args),
    /// Finds the light of the day in sky probes, or computes it from a sky model
    Sky(commands::sky::Args),
    /// Cleans a site's geometry and reduces it to what can be seen; reports what it found
    Prepare(commands::prepare::Args),
    /// Computes a site's light; run again after an interruption, it goes on where it stopped
    Bake(commands::bake::Args),
    /// Makes the bundle of what shards of a bake have left
    Merge(commands::merge::Args),
    /// Opens the viewer
    #[cfg(feature = "viewer")]
    View(commands::view::Args),
    /// Plays a visit by a script of inputs
    #[cfg(feature = "viewer")]
    Play(commands::play::Args),
    /// Writes stills, contact sheets and films
    #[cfg(feature = "viewer")]
    Render(commands::render::Args),
    /// Writes a display.toml to start from, or checks one: screens, trackers, keys
    #[cfg(feature = "viewer")]
    Display(commands::display::Args),
    /// Lights a site in texels for one moment or one sky, and writes the light map with the model
    Lightmap(commands::lightmap::Args),
    /// Ambient occlusion, bent normals or image-based light of any mesh, or the visibility matrix itself
    Visibility(commands::visibility::Args),
    /// Writes what was baked as NumPy arrays
    Arrays(commands::arrays::Args),
    /// Writes the monument lit as at one hour, for programs that know nothing of Heliodon
    Export(commands::export::Args),
    /// Makes objects that move: a walking skeleton, a curtain in the wind, a mason's yard
    Figures(commands::figures::Args),
    /// Captures a model from many sides into a billboard that the hour's light falls on
    Impostor(commands::impostor::Args),
    /// Brings models and images into the forms that load fastest
    Convert(commands::convert::Args),
    /// Makes or checks a detail texture: a fine pattern for surfaces that are seen from near
    Detail(commands::detail::Args),
    /// Checks scripts of what happens on a site, or prints their manual
    Script(commands::script::Args),
    /// Turns a film before a blue or green screen into an image and its mask
    Key(commands::key::Args),
    /// Cameras from photographs: marks solved, or matched by COLMAP
    Photo(commands::photo::Args),
    /// Makes a sound (a fire, a chisel, wind, a crowd), or tells what is in a sound file
    Sound(commands::sound::Args),
    /// Tells what is in a mesh, an image, a site or a bundle
    Inspect(commands::inspect::Args),
    /// Runs a benchmark
    Bench(commands::bench::Args),
}
