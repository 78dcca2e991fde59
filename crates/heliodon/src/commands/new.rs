//! `heliodon new`: a site folder to start from.

use crate::App;
use crate::output::count;
use crate::templates::{self, NewSite, Template, TemplateParams};
use anyhow::Result;
use heliodon_bake::report::Reporter;
use std::path::PathBuf;

/// Makes a folder with meshes, a sky and a commented site.toml, from which a site of your own can grow.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  heliodon new mysite\n  heliodon new temple --template temple --triangles 500000 --seed 7")]
pub struct Args {
    /// The folder to make; it must not hold anything yet
    dir: PathBuf,
    /// What is in it
    #[arg(long, value_enum, default_value_t = Template::Sundial)]
    template: Template,
    /// About how many triangles [default: the template's own]
    #[arg(long, value_name = "N")]
    triangles: Option<u64>,
    /// Seed of erosion, stains and rocks, or of shades and what lies about
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    app.progress.stage("building", 0);
    let params = TemplateParams { template: args.template, triangles: args.triangles, seed: args.seed };
    let site = templates::make(&args.dir, &params, |_, _| Ok(()));
    app.progress.finished();
    app.output.result(&site?, |site: &NewSite| {
        let dir = args.dir.display();
        format!(
            "{} in {dir}: {} triangles in {} files.\nNext: heliodon check {dir}, then heliodon bake {dir}",
            site.name,
            count(site.triangles),
            site.files.len()
        )
    })
}
