//! `heliodon sky`: the light of a day, as found in probes or computed by a model.

use crate::App;
use crate::failure::wrong_arguments;
use crate::files::{self, NewFolder};
use crate::probe_args::ProbeArgs;
use anyhow::{Context, Result, bail, ensure};
use heliodon_bake::report::Reporter;
use heliodon_bake::sky::{lapse_params, place_warnings};
use heliodon_bundle::site::Site;
use heliodon_image::{HdrImage, SheetLayout, SrgbImage, contact_sheet};
use heliodon_sky::day::{self, LapseParams, ProbeFile, ProbeSeries, SkySource};
use heliodon_sky::lapse::Lapse;
use heliodon_sky::picture::found_picture;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Finds the sun and the sky of each probe, or computes both from a site's sky model, and prints the day as a table.
///
/// With --json the day lapse itself, as lapse.json holds it. With -o it is written whole, with its maps, or not at all.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon sky mysite\n  heliodon sky sky/*.hdr --mapping angular -o day.json\n  heliodon sky noon.exr --mapping lat-long --json"
)]
pub struct Args {
    /// A site's folder or site.toml; or probes (.hdr, .exr), whose times stand in their names
    #[arg(required = true, value_name = "SITE|HDR")]
    paths: Vec<PathBuf>,
    #[command(flatten)]
    probes: ProbeArgs,
    /// Entries of the sky for several probes [default: one for each]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16_384))]
    steps: Option<u32>,
    /// Write the lapse, and its sky maps into a folder beside it: day.sky for day.json
    #[arg(short, long, value_name = "LAPSE")]
    output: Option<PathBuf>,
    /// Draw what was found: probes with the sun marked, and the skies rebuilt from their coefficients [default with -o: found.png among the maps]
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
}

/// Skies in the picture at most, spread over the day, in rows of so many.
const PICTURED: u32 = 12;
const PICTURED_IN_ROW: u32 = 4;
/// Columns of each sky, alone and among others.
const WIDE_ALONE: u32 = 1024;
const WIDE_AMONG_OTHERS: u32 = 384;

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let (params, inputs) = params(app, args)?;
    let target = args.output.as_deref().map(Target::new).transpose()?;
    args.picture.as_deref().map_or(Ok(()), files::check_place)?;
    let targets = target.iter().flat_map(|target| [target.lapse.as_path(), target.maps.as_path()]);
    files::refuse_inputs(&inputs, targets.chain(args.picture.as_deref()))?;
    let maps = target.as_ref().map(|target| NewFolder::create(&target.maps)).transpose()?;
    let draws = maps.is_some() || args.picture.is_some();
    app.progress.stage("sky", u64::from(params.sky_count()?));
    app.progress.progress(0);
    let mut pictured: Vec<(String, HdrImage)> = Vec::new();
    let built = day::build(&params, &mut |map| {
        app.progress.progress(u64::from(map.index) + 1);
        if draws && is_pictured(map.index, map.count) {
            let width = if map.count == 1 { WIDE_ALONE } else { WIDE_AMONG_OTHERS }.min(map.image.width.max(2));
            pictured.push((map.name.to_owned(), map.image.resized_lat_long(width, width / 2)));
        }
        let Some(folder) = &maps else { return Ok(()) };
        map.image.write_hdr(folder.path().join(file_name(map.name))).map_err(|error| error.to_string())
    });
    app.progress.finished();
    let mut built = built?;
    built.notes.iter().for_each(|note| app.progress.warning(&note.to_string()));
    let drawn = if draws { draw(&built.lapse, &pictured).to_png_bytes()? } else { Vec::new() };
    if let Some(path) = &args.picture {
        files::write_whole(path, |file| file.write_all(&drawn))?;
    }
    if let (Some(target), Some(maps)) = (target, maps) {
        for step in &mut built.lapse.steps {
            step.sky_map = format!("{}/{}", target.maps_name, file_name(&step.sky_map));
        }
        let text = serde_json::to_vec_pretty(&built.lapse).context("the lapse cannot be written as JSON")?;
        if args.picture.is_none() {
            files::write_whole(&maps.path().join(PICTURE_FILE), |file| file.write_all(&drawn))?;
        }
        maps.commit(|| files::write_whole(&target.lapse, |file| file.write_all(&text)))?;
    }
    app.output.result(&built.lapse, |lapse: &Lapse| day::table(lapse, params.north_deg))
}

/// The picture's name among the maps.
const PICTURE_FILE: &str = "found.png";

/// The last part of a map's path.
fn file_name(map: &str) -> &str {
    map.rsplit('/').next().unwrap_or(map)
}

/// Where a lapse and its maps are written.
struct Target {
    lapse: PathBuf,
    maps: PathBuf,
    maps_name: String,
}

impl Target {
    /// Looks whether both can be written, and whether nothing is lost by it.
    fn new(lapse: &Path) -> Result<Self> {
        files::check_place(lapse)?;
        let Some(stem) = lapse.file_stem().and_then(|stem| stem.to_str()) else {
            wrong_arguments!(
                "{}: the lapse names its maps' folder after itself, so its name must be readable text",
                lapse.display()
            );
        };
        let maps_name = format!("{stem}.sky");
        let maps = lapse.with_file_name(&maps_name);
        let ours = |name: &str| name == PICTURE_FILE || name.strip_suffix(".hdr").is_some_and(|n| n.parse::<u32>().is_ok());
        if maps.exists() {
            ensure!(maps.is_dir(), "{} is a file, and the sky maps' folder would be there; name another -o", maps.display());
            if let Some(name) = files::find_foreign(&maps, ours)? {
                bail!("{} holds {}, which is no sky map of an earlier run; name another -o", maps.display(), name.display());
            }
        }
        Ok(Self { lapse: lapse.to_owned(), maps, maps_name })
    }
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

/// What the arguments mean together, and the files that are read.
fn params(app: &App, args: &Args) -> Result<(LapseParams, Vec<PathBuf>)> {
    if let Some(missing) = args.paths.iter().find(|path| !path.exists()) {
        bail!("{}: there is no such file or folder; name a site, or probes (.hdr, .exr)", missing.display());
    }
    let is_site = |path: &Path| path.is_dir() || path.extension().is_some_and(|ending| ending == "toml");
    if args.paths.iter().any(|path| is_site(path)) {
        let [path] = &args.paths[..] else { wrong_arguments!("name one site, or probes only") };
        if args.probes.any() || args.steps.is_some() {
            wrong_arguments!(
                "a site's own site.toml says how its sky is read; leave out --mapping, --opening, --turn and --steps"
            );
        }
        let site = Site::read(path)?;
        place_warnings(&site).iter().for_each(|warning| app.progress.warning(warning));
        let read = site.input_files()?;
        let params = lapse_params(&site, &read)?;
        return Ok((params, read.into_iter().map(|file| file.path).chain([site.path().to_owned()]).collect()));
    }
    let Some(mapping) = args.probes.mapping()? else {
        wrong_arguments!(
            "say how the probes map directions to pixels: --mapping lat-long (or angular, mirror-ball, cube-cross, fisheye)"
        )
    };
    let probes: Vec<ProbeFile> = args.paths.iter().map(|path| ProbeFile { path: path.clone(), time: None }).collect();
    let steps = args.steps.unwrap_or(probes.len() as u32);
    let series = ProbeSeries { turn_deg: args.probes.turn_deg(), ..ProbeSeries::new(probes, mapping) };
    let params = LapseParams { sun_steps: steps.min(1024), sky_steps: steps, ..LapseParams::new(SkySource::Probes(series)) };
    Ok((params, args.paths.clone()))
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
