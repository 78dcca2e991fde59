//! `heliodon sky`: the light of a day, as found in probes or computed by a model.

use crate::App;
use crate::failure::wrong_arguments;
use crate::files;
use anyhow::{Context, Result};
use clap::ValueEnum;
use heliodon_bake::report::Reporter;
use heliodon_bake::sky::lapse_params;
use heliodon_bundle::site::Site;
use heliodon_image::{HdrImage, SheetLayout, SrgbImage, contact_sheet};
use heliodon_sky::day::{self, LapseParams, ProbeFile, ProbeSeries, SkySource};
use heliodon_sky::lapse::Lapse;
use heliodon_sky::mapping::Mapping;
use heliodon_sky::picture::found_picture;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Finds the sun and the sky of each probe, or computes both from a site's sky model, and prints the day as a table.
///
/// With --json the day lapse itself, as lapse.json holds it.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon sky mysite\n  heliodon sky sky/*.hdr --mapping angular -o lapse.json\n  heliodon sky noon.exr --mapping lat-long --json"
)]
pub struct Args {
    /// A site's folder or site.toml; or probes (.hdr, .exr), whose times stand in their names
    #[arg(required = true, value_name = "SITE|HDR")]
    paths: Vec<PathBuf>,
    /// How the probes map directions to pixels
    #[arg(long, value_enum)]
    mapping: Option<MappingName>,
    /// Opening angle of a fisheye, degrees
    #[arg(long, value_name = "DEG", default_value_t = 180.0, value_parser = |text: &str| crate::values::within(text, 1.0, 360.0))]
    opening: f64,
    /// The compass bearing, clockwise in degrees, of what the mapping calls north
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true, value_parser = |text: &str| crate::values::within(text, -360.0, 360.0))]
    turn: f64,
    /// Entries of the sky for several probes [default: one for each]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16_384))]
    steps: Option<u32>,
    /// Write the lapse, and its sky maps into sky/ beside it
    #[arg(short, long, value_name = "LAPSE")]
    output: Option<PathBuf>,
    /// Draw what was found: probes with the sun marked, and the skies rebuilt from their coefficients [default with -o: sky.png beside it]
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
}

/// Skies in the picture at most, spread over the day, in rows of so many.
const PICTURED: u32 = 12;
const PICTURED_IN_ROW: u32 = 4;
/// Columns of each sky, alone and among others.
const WIDE_ALONE: u32 = 1024;
const WIDE_AMONG_OTHERS: u32 = 384;

/// A mapping by the name that `site.toml` gives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum MappingName {
    /// Latitude and longitude, north in the middle
    LatLong,
    /// Light probe: the whole sphere seen along -Z
    Angular,
    /// Mirror ball seen along -Z
    MirrorBall,
    /// The faces of a cube, 3 x 4 or 4 x 3
    CubeCross,
    /// The upper half seen from below
    Fisheye,
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let params = params(args)?;
    args.picture.as_deref().map_or(Ok(()), files::check_place)?;
    app.progress.stage("sky", u64::from(params.sky_steps));
    app.progress.progress(0);
    let maps = args.output.as_deref().map(maps_folder);
    let picture = args.picture.clone().or_else(|| maps.as_ref().map(|folder| folder.join("sky.png")));
    let mut pictured: Vec<(String, HdrImage)> = Vec::new();
    let built = day::build(&params, &mut |map| {
        app.progress.progress(u64::from(map.index) + 1);
        if picture.is_some() && is_pictured(map.index, map.count) {
            let width = if map.count == 1 { WIDE_ALONE } else { WIDE_AMONG_OTHERS }.min(map.image.width.max(2));
            pictured.push((map.name.to_owned(), map.image.resized_lat_long(width, width / 2)));
        }
        let Some(folder) = &maps else { return Ok(()) };
        let path = folder.join(map.name);
        let parent = path.parent().unwrap_or(folder);
        fs::create_dir_all(parent).map_err(|error| format!("cannot make the folder {}: {error}", parent.display()))?;
        files::replace(&path, |beside| Ok(map.image.write_hdr(beside)?)).map_err(|error| format!("{error:#}"))
    });
    app.progress.finished();
    let built = built?;
    built.notes.iter().for_each(|note| app.progress.warning(&note.to_string()));
    if let Some(path) = &args.output {
        let text = serde_json::to_vec_pretty(&built.lapse).context("the lapse cannot be written as JSON")?;
        files::write_whole(path, |file| file.write_all(&text))?;
    }
    if let Some(path) = &picture {
        let drawn = draw(&built.lapse, &pictured);
        files::write_whole(path, |file| file.write_all(&drawn.to_png_bytes().map_err(std::io::Error::other)?))?;
    }
    app.output.result(&built.lapse, |lapse: &Lapse| day::table(lapse, params.north_deg))
}

/// Whether a map is one of those that are drawn: evenly spread, the first among them.
fn is_pictured(index: u32, count: u32) -> bool {
    let count = u64::from(count.max(1));
    let wanted = u64::from(PICTURED).min(count);
    let slot = |index: u64| index * wanted / count;
    index == 0 || slot(u64::from(index)) != slot(u64::from(index) - 1)
}

/// What was found, sky by sky.
fn draw(lapse: &Lapse, maps: &[(String, HdrImage)]) -> SrgbImage {
    let drawn: Vec<SrgbImage> = maps
        .iter()
        .filter_map(|(name, map)| {
            let step = lapse.steps.iter().find(|step| step.sky_map == *name)?;
            Some(found_picture(map, step, map.width))
        })
        .collect();
    contact_sheet(&drawn, &SheetLayout { columns: PICTURED_IN_ROW.min(drawn.len().max(1) as u32), ..SheetLayout::default() })
}

/// The folder from which the lapse's paths to its maps start.
fn maps_folder(lapse: &Path) -> PathBuf {
    lapse.parent().map(Path::to_owned).unwrap_or_default()
}

/// What the arguments mean together.
fn params(args: &Args) -> Result<LapseParams> {
    let is_site = |path: &Path| path.is_dir() || path.extension().is_some_and(|ending| ending == "toml");
    if args.paths.iter().any(|path| is_site(path)) {
        let [path] = &args.paths[..] else { wrong_arguments!("name one site, or probes only") };
        if args.mapping.is_some() || args.steps.is_some() {
            wrong_arguments!("a site's own site.toml says how its sky is read; leave out --mapping and --steps");
        }
        let site = Site::read(path)?;
        return Ok(lapse_params(&site, &site.input_files()?)?);
    }
    let Some(mapping) = args.mapping else {
        wrong_arguments!(
            "say how the probes map directions to pixels: --mapping lat-long (or angular, mirror-ball, cube-cross, fisheye)"
        )
    };
    let mapping = match mapping {
        MappingName::LatLong => Mapping::LatLong,
        MappingName::Angular => Mapping::Angular,
        MappingName::MirrorBall => Mapping::MirrorBall,
        MappingName::CubeCross => Mapping::CubeCross,
        MappingName::Fisheye => Mapping::Fisheye { opening_deg: args.opening },
    };
    let probes: Vec<ProbeFile> = args.paths.iter().map(|path| ProbeFile { path: path.clone(), time: None }).collect();
    let steps = args.steps.unwrap_or(probes.len() as u32);
    let series = ProbeSeries { turn_deg: args.turn, ..ProbeSeries::new(probes, mapping) };
    Ok(LapseParams { sun_steps: steps.min(1024), sky_steps: steps, ..LapseParams::new(SkySource::Probes(series)) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_drawn_skies_are_spread_over_the_day() {
        let drawn = |count: u32| (0..count).filter(|&index| is_pictured(index, count)).count() as u32;
        assert_eq!((drawn(1), drawn(5), drawn(12), drawn(13), drawn(184)), (1, 5, 12, 12, 12));
    }
}
