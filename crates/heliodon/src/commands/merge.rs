//! `heliodon merge`: the bundle of what shards have baked.

use super::bake::{Target, describe};
use crate::App;
use anyhow::Result;
use heliodon_bake::merge::merge;

/// Makes the bundle of what `heliodon bake --shard` has left in the cache: the same, byte for byte, as that of one machine.
///
/// Tells which shards are missing, if any are, and what makes them. Work of shards that lies in several folders is joined by
/// copying their .heliodon folders into one another: no file of one has another content elsewhere.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example, on one machine:\n  for i in 1 2 3; do heliodon bake mysite --shard $i/3; done\n  heliodon merge mysite\nOn many: docs/many-machines.md"
)]
pub struct Args {
    #[command(flatten)]
    target: Target,
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let plan = args.target.plan()?;
    app.output.result(&merge(&plan, &app.progress)?, describe)
}
