//! `heliodon check`: whether a site can be baked.

use crate::App;
use crate::output::{count, counted, table};
use anyhow::{Context, Result, bail};
use heliodon_bake::check::{CheckReport, check};
use heliodon_bundle::site::{Part, Site, is_font};
use heliodon_script::book::Book;
use heliodon_sound::generate::SoundKind;
use std::path::PathBuf;

/// Reads site.toml and everything that it names, and tells what is wrong or odd; bakes nothing.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  heliodon check mysite")]
pub struct Args {
    /// The site's folder, or its site.toml
    site: PathBuf,
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let site = Site::read(&args.site)?;
    let mut report = check(&site, &app.progress)?;
    check_sounds(&site)?;
    check_font(&site)?;
    report.warnings.extend(check_story(&site)?);
    app.output.result(&report, describe)
}

/// Whether sounds that are to be made can be.
fn check_sounds(site: &Site) -> Result<()> {
    for (i, sound) in site.sounds.iter().enumerate() {
        let Some(kind) = sound.kind.as_deref().filter(|kind| SoundKind::named(kind).is_none()) else { continue };
        let known: Vec<&str> = SoundKind::ALL.iter().map(|kind| kind.name()).collect();
        let remedy = format!("write one of: {}", known.join(", "));
        return Err(site.error_at(&["sound", &i.to_string(), "kind"], format!("there is no sound `{kind}`"), remedy).into());
    }
    Ok(())
}

/// Whether the story's font is one.
fn check_font(site: &Site) -> Result<()> {
    let Some(font) = site.story.as_ref().and_then(|story| story.font.as_deref()) else { return Ok(()) };
    let path = site.folder().join(font);
    let bytes = std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
    if is_font(&bytes) {
        return Ok(());
    }
    let remedy = "name a TrueType or OpenType file (.ttf, .otf)".to_owned();
    Err(site.error_at(&["story", "font"], format!("`{font}` is no font"), remedy).into())
}

/// What is odd about a site's scripts and texts.
///
/// # Errors
/// What is wrong with them, all of it.
fn check_story(site: &Site) -> Result<Vec<String>> {
    if site.story.is_none() {
        return Ok(Vec::new());
    }
    let names: Vec<String> = site.parts.iter().map(Part::display_name).collect();
    let parts = names.iter().map(String::as_str);
    let book = Book::read(site.folder(), &site.living(), &site.actors, &site.lamps, parts);
    let wrong: Vec<String> = book.errors().map(ToString::to_string).collect();
    if !wrong.is_empty() {
        bail!("{}", wrong.join("\n"));
    }
    Ok(book.told.iter().map(ToString::to_string).collect())
}

fn describe(report: &CheckReport) -> String {
    let size = |part: &heliodon_bake::check::CheckedPart| {
        let side = |axis: usize| format!("{:.2}", part.max[axis] - part.min[axis]);
        format!("{} x {} x {}", side(0), side(1), side(2))
    };
    let rows: Vec<Vec<String>> = report
        .parts
        .iter()
        .map(|part| {
            let role = format!("{:?}", part.role).to_lowercase();
            let edge = format!("{:.4}", part.median_edge_m);
            vec![part.name.clone(), role, part.files.to_string(), count(part.triangles), count(part.vertices), edge, size(part)]
        })
        .collect();
    let mut text = format!("{}\n", report.name);
    text += &table(&["part", "role", "files", "triangles", "vertices", "edge m", "size m"], &rows);
    let day = &report.day;
    let sky = match day.probes {
        0 => "from a model".to_owned(),
        1 => "from one image".to_owned(),
        probes => format!("from {probes} images"),
    };
    text += &format!(
        "\nday {} to {}: {} {sky}, {}, {} with a sun\n",
        day.first,
        day.last,
        counted(day.sky_steps as u64, "sky", "skies"),
        counted(u64::from(day.sun_steps), "sun step", "sun steps"),
        day.suns
    );
    for actor in &report.actors {
        text += &format!("actor {actor}\n");
    }
    if report.grid_points > 0 {
        text += &format!("light grid: {} at most\n", counted(report.grid_points, "point", "points"));
    }
    text += match report.warnings.len() {
        0 => "\nNothing is wrong.\n",
        1 => "\nIt can be baked; look at the warning.\n",
        _ => "\nIt can be baked; look at the warnings.\n",
    };
    text
}
