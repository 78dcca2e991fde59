//! The `heliodon` program: arguments, a validated plan, the run; each command in a file of its own.

#[cfg(feature = "viewer")]
mod acting;
mod args;
mod commands;
mod failure;
mod files;
mod film;
mod output;
mod probe_args;
mod progress;
mod raster;
#[cfg(feature = "viewer")]
mod reference;
mod slurm;
#[cfg(feature = "viewer")]
mod studio;
#[cfg(feature = "viewer")]
mod swarming;
mod templates;
#[cfg_attr(not(feature = "viewer"), expect(dead_code, reason = "some values only the viewer's commands take"))]
mod values;

use anyhow::{Context, Result};
use args::{Args, Command};
use clap::Parser;
use output::Output;
use progress::Progress;
use std::process::ExitCode;

/// What every command works with.
struct App {
    output: Output,
    progress: Progress,
}

fn main() -> ExitCode {
    failure::install_panic_hook();
    // the hook has told what there is to tell; a panic fails like everything else
    match std::panic::catch_unwind(|| run(Args::parse())) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(error)) => failure::report(&error),
        Err(_) => ExitCode::FAILURE,
    }
}

fn run(args: Args) -> Result<()> {
    if let Some(threads) = args.common.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(usize::from(threads))
            .build_global()
            .context("the threads cannot be started")?;
    }
    let app = App { output: Output { json: args.common.json }, progress: Progress::new(args.common.quiet) };
    let done = match args.command {
        Command::Demo(args) => commands::demo::run(&app, &args),
        Command::New(args) => commands::new::run(&app, &args),
        Command::Check(args) => commands::check::run(&app, &args),
        Command::Sky(args) => commands::sky::run(&app, &args),
        Command::Prepare(args) => commands::prepare::run(&app, &args),
        Command::Bake(args) => commands::bake::run(&app, &args),
        Command::Merge(args) => commands::merge::run(&app, &args),
        #[cfg(feature = "viewer")]
        Command::Play(args) => commands::play::run(&app, &args),
        #[cfg(feature = "viewer")]
        Command::View(args) => commands::view::run(&app, &args),
        #[cfg(feature = "viewer")]
        Command::Render(args) => commands::render::run(&app, &args),
        #[cfg(feature = "viewer")]
        Command::Display(args) => commands::display::run(&app, &args),
        Command::Lightmap(args) => commands::lightmap::run(&app, &args),
        Command::Visibility(args) => commands::visibility::run(&app, &args),
        Command::Arrays(args) => commands::arrays::run(&app, &args),
        Command::Export(args) => commands::export::run(&app, &args),
        Command::Figures(args) => commands::figures::run(&app, &args),
        Command::Impostor(args) => commands::impostor::run(&app, &args),
        Command::Convert(args) => commands::convert::run(&app, &args),
        Command::Detail(args) => commands::detail::run(&app, &args),
        Command::Script(args) => commands::script::run(&app, &args),
        Command::Key(args) => commands::key::run(&app, &args),
        Command::Photo(args) => commands::photo::run(&app, &args),
        Command::Sound(args) => commands::sound::run(&app, &args),
        Command::Inspect(args) => commands::inspect::run(&app, &args),
        Command::Bench(args) => commands::bench::run(&app, &args),
    };
    app.progress.tell_warnings();
    done
}
