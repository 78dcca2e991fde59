//! `heliodon merge`: the bundle of what shards have baked.

use super::bake::{default_bundle, describe};
use crate::App;
use anyhow::Result;
use heliodon_bake::merge::merge;
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bundle::site::Site;
use std::path::PathBuf;

/// Makes the bundle of what `heliodon bake --shard` has left in the cache: the same, byte for byte, as that of one machine.
///
/// Tells which shards are missing, if any are, and what makes them. Work of shards that lies in several folders is joined by
/// copying their .heliodon folders into one another: no file of one has another content elsewhere.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example, on one machine:\n  for i in 1 2 3; do heliodon bake mysite --shard $i/3; done\n  heliodon merge mysite\nOn many: docs/many-machines.md"
)]
pub struct Args {
    /// The site's folder, or its site.toml
    site: PathBuf,
    /// Where the bundle stands [default: bundle, in the site's folder]
    #[arg(short, long, value_name = "BUNDLE")]
    output: Option<PathBuf>,
    /// Merge even where the bundle is up to date
    #[arg(long)]
    again: bool,
    /// The folder of finished work [default: .heliodon/cache, beside the bundle]
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Keep the finished work after success, too
    #[arg(long)]
    keep_cache: bool,
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let site = Site::read(&args.site)?;
    let options = BakeOptions {
        bundle: args.output.clone().unwrap_or_else(|| default_bundle(&site)),
        cache: args.cache.clone(),
        keep_cache: args.keep_cache,
        again: args.again,
    };
    let plan = Plan::new(site, options)?;
    app.output.result(&merge(&plan, &app.progress)?, describe)
}
