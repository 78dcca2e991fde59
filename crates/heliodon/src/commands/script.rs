//! `heliodon script`: what happens on a site.

use crate::App;
use anyhow::{Context, Result, bail};
use heliodon_script::diagnostic::{Diagnostic, Severity};
use heliodon_script::manual::manual;
use heliodon_script::names::{Kind, Names};
use heliodon_script::program::{Program, Source};
use heliodon_script::texts::Texts;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Checks scripts, or prints the manual of everything that they can wait for, do and ask.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon script manual > scripts.md\n  heliodon script check scripts/*.rhai --texts texts.toml"
)]
pub struct Args {
    /// What to do
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, clap::Subcommand)]
enum Verb {
    /// Prints the manual, in Markdown
    Manual,
    /// Finds what is wrong with scripts, all those of a site together, and runs nothing
    Check {
        /// The scripts
        #[arg(required = true, value_name = "FILE")]
        files: Vec<PathBuf>,
        /// The table of texts: its keys are checked, and told where a language is missing
        #[arg(long, value_name = "TOML")]
        texts: Option<PathBuf>,
    },
}

#[derive(Serialize)]
struct Manual {
    manual: String,
}

#[derive(Serialize)]
struct Checked {
    scripts: usize,
    texts: usize,
    languages: Vec<String>,
    told: Vec<Diagnostic>,
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    match &args.verb {
        Verb::Manual => app.output.result(&Manual { manual: manual() }, |manual| manual.manual.clone()),
        Verb::Check { files, texts } => check(app, files, texts.as_deref()),
    }
}

fn read(file: &Path) -> Result<String> {
    std::fs::read_to_string(file).with_context(|| format!("{} cannot be read", file.display()))
}

fn check(app: &App, files: &[PathBuf], texts: Option<&Path>) -> Result<()> {
    let mut names = Names::unchecked();
    let (mut told, mut keys, mut languages) = (Vec::new(), 0, Vec::new());
    if let Some(file) = texts {
        let texts = Texts::parse(&read(file)?, &file.display().to_string())?;
        names.add(Kind::Text, texts.keys());
        (keys, languages) = (texts.keys().count(), texts.languages().to_vec());
        told.extend(texts.missing());
    }
    let source = |file: &PathBuf| Ok(Source::new(file.display().to_string(), read(file)?));
    let sources: Vec<Source> = files.iter().map(source).collect::<Result<_>>()?;
    told.extend(Program::compile(&sources, &names).1);
    let wrong = told.iter().filter(|told| told.severity == Severity::Error).map(ToString::to_string).collect::<Vec<_>>();
    if !wrong.is_empty() && !app.output.json {
        bail!("{}", wrong.join("\n"));
    }
    app.output.result(&Checked { scripts: sources.len(), texts: keys, languages, told }, |checked| {
        let lines: String = checked.told.iter().map(|told| format!("{told}\n")).collect();
        lines + if checked.told.is_empty() { "Nothing is wrong." } else { "They can run; look at the warnings." }
    })?;
    if wrong.is_empty() { Ok(()) } else { bail!("the scripts have errors: {}", wrong.len()) }
}
