//! `heliodon lightmap`: a site's light in textures, for one moment or one sky.

mod lamps;
mod scene;
mod sky;
mod write;

use crate::App;
use crate::failure::wrong_arguments;
use crate::output::{count, counted};
use crate::values::{self, Exposure};
use anyhow::Result;
use clap::ValueEnum;
use heliodon_bake::referenced_files;
use heliodon_bake::report::Reporter;
use heliodon_bundle::site::{Site, TimeOfDay};
use heliodon_lightmap::packing::{PackError, PackParams};
use heliodon_lightmap::solve::models::{Cartoon, Illumination, Lambertian, OcclusionOnly, Realistic, SkyOnly, SurfaceModel};
use heliodon_lightmap::solve::{self, DenoiseParams, LightMap, Models, Notes, SolveParams, clean_levels, solve};
use heliodon_lightmap::texels::texels;
use heliodon_lightmap::unwrap::{UnwrapParams, unwrap};
use scene::SiteScene;
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// Texels along a texture's side at most.
const LARGEST_SIZE: u32 = 16_384;
/// And textures.
const MOST_TEXTURES: u32 = 64;

/// Lights the parts of a site in texels: unwraps them into one texture (or several, see --textures), solves lamps, sun, sky and bounces for every texel, and writes the light with the model.
///
/// Parts have texels that a bake lights by texels: those with light = "texel" in site.toml, and, with texels = N in `[bake]`, those of large triangles; where that is no part, and with --every-part, all but those with light =
/// "vertex". How many each has beside the others is as its own texels = F says, and fewer away from the rooms. What has none stands in the light and reflects. Lamps are
/// those of `[[light]]` in site.toml (their shadows = false and reach_m are for the viewer alone); lights of all kinds (suns, panes, discs, meshes that shine, IES files) can be given in a file of their own.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon lightmap mysite --time 10:00\n  heliodon lightmap mysite --sky overcast --kind ktx2,combined --size 4096 -o grey\n  heliodon lightmap mysite --sky none --lights lamps.toml --error 0.005\n  heliodon lightmap mysite --model occlusion --kind exr --json\n\nA file of lights has tables as these:\n  [[light]]\n  kind = \"rectangle\"\n  corners = [[0, 2, 0], [1, 2, 0], [0, 2, 1]]\n  amount = { flux_lm = 800 }"
)]
pub struct Args {
    /// The site's folder, or its site.toml
    site: PathBuf,
    /// The folder to write into [default: lightmap, beside site.toml]
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// What to write: exr and ktx2 (BC6H) are linear; rgbe is a PNG with a common exponent; combined multiplies the albedo in
    #[arg(long, value_enum, value_delimiter = ',', default_value = "exr")]
    kind: Vec<Kind>,
    /// Light every part in texels, those of small triangles too, but not those with light = "vertex"
    #[arg(long)]
    every_part: bool,
    /// Texels along each side of the texture, 16 to 16384
    #[arg(long, value_name = "N", default_value_t = 2048, value_parser = clap::value_parser!(u32).range(16..=i64::from(LARGEST_SIZE)))]
    size: u32,
    /// Textures at most, 1 to 64, all of that size: charts become as large as all of them hold, so more give more texels for a metre. A chart lies in one of them, and with several,
    /// files are light-1.exr, light-2.exr ...
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_TEXTURES)))]
    textures: u32,
    /// Texels that stay free between charts; light.ktx2 has as many smaller versions as they keep apart: none below 4, 1 from there, 2 from 10, 3 from 22, 4 from 46 on
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u32).range(0..=64))]
    margin: u32,
    /// The time of day, `HH:MM[:SS]`, of the site's sky [default: 12:00]
    #[arg(long, value_name = "HH:MM")]
    time: Option<TimeOfDay>,
    /// Which sky
    #[arg(long, value_enum, default_value_t = SkyName::Site)]
    sky: SkyName,
    /// The radiance of an even sky, or of an overcast one's zenith [default: 1]
    #[arg(long, value_name = "L", value_parser = |text: &str| values::within(text, 0.0, 1e9))]
    radiance: Option<f64>,
    /// A sun without a disc: its shadows are sharp
    #[arg(long)]
    sharp_sun: bool,
    /// More lights, from a TOML file; models sky and occlusion have none
    #[arg(long, value_name = "FILE")]
    lights: Option<PathBuf>,
    /// What light there is, and what surfaces make of it
    #[arg(long, value_enum, default_value_t = ModelName::Realistic)]
    model: ModelName,
    /// How often light is reflected, not at all with models sky and occlusion [default: the site's own]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=1000))]
    bounces: Option<u32>,
    /// Directions that a texel looks in at most
    #[arg(long, value_name = "N", default_value_t = 2048, value_parser = clap::value_parser!(u32).range(64..=1_048_576))]
    samples: u32,
    /// Samples of a lamp with an area that a texel takes at most
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    light_samples: u32,
    /// The error that is asked for, as a part of the light around
    #[arg(long, value_name = "E", default_value_t = 0.02, value_parser = |text: &str| values::within(text, 1e-4, 1.0))]
    error: f64,
    /// Smooth what noise is left; it is noted in the result
    #[arg(long)]
    denoise: bool,
    /// Exposure of what is multiplied with the albedo, of --kind combined: auto, or stops [default: auto]
    #[arg(long, value_name = "auto|STOPS", value_parser = values::exposure, allow_negative_numbers = true)]
    exposure: Option<Exposure>,
}

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// OpenEXR, linear
    Exr,
    /// KTX 2.0, BC6H, with smaller versions
    Ktx2,
    /// PNG with a common exponent as alpha
    Rgbe,
    /// Multiplied with the albedo, in an unlit model
    Combined,
}

/// Which sky.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SkyName {
    /// The site's, at the time, with its sun
    Site,
    /// None
    None,
    /// The same from everywhere
    Even,
    /// The CIE's overcast sky
    Overcast,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ModelName {
    /// All light
    Realistic,
    /// The sky alone
    Sky,
    /// How open a place is
    Occlusion,
    /// All light, in three bands up to what 95 of 100 texels do not exceed
    Cartoon,
}

/// What was done, for programs; `lightmap.json` holds it.
#[derive(Debug, Serialize)]
pub struct Report {
    /// The files that were written.
    files: Vec<String>,
    size: u32,
    /// How many textures there are.
    textures: u32,
    texels_per_m: f32,
    utilisation: f32,
    charts: usize,
    sky: String,
    lights: Vec<String>,
    error: f64,
    samples: u32,
    light_samples: u32,
    /// Levels of the texture that hold no light of another chart.
    levels: u32,
    /// Multiplied light was scaled by two to the power of this.
    exposure_stops: Option<f32>,
    notes: Notes,
    seconds: f64,
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let begun = Instant::now();
    check(args)?;
    let site = Site::read(&args.site)?;
    let folder = args.output.clone().unwrap_or_else(|| site.folder().join("lightmap"));
    // lights first: what is wrong with them is told before anything takes long
    let (illumination, surface) = models(args.model);
    let (mut lights, mut read) = (Vec::new(), Vec::new());
    if illumination.has_lights() {
        (lights, read) = lamps::lights(&site, args.lights.as_deref())?;
        lamps::unheeded(&site).iter().for_each(|warning| app.progress.warning(warning));
    }
    let files = site.input_files()?;
    let shown = if illumination.is_sky_seen() { args.sky } else { SkyName::None };
    sky::check(&site, &files, shown, args)?;
    for file in &files {
        read.push(file.path.clone());
        read.extend(referenced_files(&file.path));
    }
    read.push(site.path().to_owned());
    write::make_folder(&folder, &args.kind, args.textures, &read)?;
    let scene = SiteScene::read(&site, &files, args.every_part, &app.progress)?;
    app.progress.stage("sky", 0);
    let sky = sky::light(&site, &files, shown, args);
    app.progress.finished();
    let sky = sky?;
    sky.notes.iter().for_each(|note| app.progress.warning(note));
    lights.extend(sky.sun.filter(|_| illumination.has_lights()));
    lamps::inside_something(&lights, &scene.rays).iter().for_each(|warning| app.progress.warning(warning));

    app.progress.stage("unwrapping", 0);
    let (sides, sheets) = ([args.size; 2], args.textures);
    let pack = PackParams { width: args.size, height: args.size, margin: args.margin, sheets, ..PackParams::default() };
    let params = UnwrapParams { pack, ..UnwrapParams::default() };
    let unwrapped = unwrap(&scene.mesh.positions, scene.with_texels(), &scene.density, &params);
    app.progress.finished();
    let unwrapped = unwrapped.map_err(|error| {
        let textures = counted(u64::from(sheets), "texture", "textures");
        let told = format!("the parts cannot be laid into {textures}; {}", more_room(&error, args.size, sheets));
        anyhow::Error::new(error).context(told)
    })?;
    let texels = texels(&unwrapped, args.size, args.size);

    let params = SolveParams {
        bounces: args.bounces.unwrap_or(site.bake.bounces),
        error: args.error as f32,
        samples: args.samples,
        light_samples: args.light_samples,
        denoise: args.denoise.then(DenoiseParams::default),
        ..SolveParams::default()
    };
    app.progress.stage("light", 0);
    let albedo = scene.albedo();
    let lit = solve::Scene {
        rays: &scene.rays,
        positions: &scene.mesh.positions,
        normals: &scene.mesh.normals,
        triangles: &scene.mesh.triangles,
        unwrapped: &unwrapped,
        texels: &texels,
        sides,
        albedo: &|triangle, u, v| albedo.albedo(triangle, u, v),
        lights: &lights,
        sky: sky.dome.as_ref(),
    };
    let map: LightMap = solve(&lit, &Models { illumination: illumination.as_ref(), surface: surface.as_ref() }, &params)?;
    app.progress.finished();
    map.validate()?;

    let levels = clean_levels(args.margin, sides);
    let output = write::Output { folder: &folder, scene: &scene, lit: &lit, map: &map, levels };
    let (mut written, exposure_stops) = output.write(&args.kind, args.exposure.unwrap_or(Exposure::Auto))?;
    written.push(write::REPORT.to_owned());
    let report = Report {
        files: written,
        size: args.size,
        textures: unwrapped.packing.sheets,
        texels_per_m: unwrapped.packing.per_m,
        utilisation: unwrapped.packing.utilisation,
        charts: unwrapped.charts.len(),
        sky: sky.name,
        lights: lights.iter().map(|light| light.title().to_owned()).collect(),
        error: args.error,
        samples: args.samples,
        light_samples: args.light_samples,
        levels,
        exposure_stops,
        notes: map.notes,
        seconds: begun.elapsed().as_secs_f64(),
    };
    write::report(&folder, &report)?;
    app.output.result(&report, |report| describe(report, &folder))
}

/// Refuses what would do nothing.
fn check(args: &Args) -> Result<()> {
    let is_sky_seen = args.model != ModelName::Occlusion;
    let has_lights = is_sky_seen && args.model != ModelName::Sky;
    let (time, radiance) = (("--time", args.time.is_some()), ("--radiance", args.radiance.is_some()));
    let (sharp, bounces) = (("--sharp-sun", args.sharp_sun), ("--bounces", args.bounces.is_some()));
    let lights = ("--lights", args.lights.is_some());
    for (option, given) in [time, sharp] {
        if given && args.sky != SkyName::Site {
            wrong_arguments!("{option} is of the site's own sky; leave it out, or leave --sky out");
        }
    }
    if args.radiance.is_some() && !matches!(args.sky, SkyName::Even | SkyName::Overcast) {
        wrong_arguments!("--radiance is of an even or overcast sky; leave it out, or give --sky even or --sky overcast");
    }
    for (option, given) in [sharp, bounces, lights] {
        if given && !has_lights {
            wrong_arguments!("{option} does nothing with --model sky or occlusion (no lamps, suns and bounces); leave it out");
        }
    }
    for (option, given) in [time, radiance] {
        if given && !is_sky_seen {
            wrong_arguments!("{option} does nothing with --model occlusion, for which all skies are alike; leave it out");
        }
    }
    if args.exposure.is_some() && !args.kind.contains(&Kind::Combined) {
        wrong_arguments!("--exposure is of --kind combined, others hold light as it is; leave it out, or add that kind");
    }
    Ok(())
}

fn models(name: ModelName) -> (Box<dyn Illumination>, Box<dyn SurfaceModel>) {
    match name {
        ModelName::Realistic => (Box::new(Realistic), Box::new(Lambertian)),
        ModelName::Sky => (Box::new(SkyOnly), Box::new(Lambertian)),
        ModelName::Occlusion => (Box::new(OcclusionOnly::default()), Box::new(Lambertian)),
        ModelName::Cartoon => (Box::new(Realistic), Box::new(Cartoon::default())),
    }
}

/// What helps where charts have no room in so many textures of a size.
fn more_room(error: &PackError, size: u32, textures: u32) -> String {
    let fewer = "fewer parts texels (light = \"vertex\")";
    let PackError::TooSmall { smallest, .. } = *error else { return format!("give {fewer}") };
    // more than there are in any case
    let needed = smallest.max(u64::from(size) + 1);
    if needed <= u64::from(LARGEST_SIZE) {
        format!("give --size {needed} or more, more --textures or {fewer}")
    } else if textures < MOST_TEXTURES {
        format!("textures of the largest --size are too few for them as well: give more --textures or {fewer}")
    } else {
        format!("as many of the largest --size are too few for them as well: give {fewer}")
    }
}

fn describe(report: &Report, folder: &std::path::Path) -> String {
    let notes = &report.notes;
    let [r, g, b] = notes.mean;
    format!(
        "{}: {} in {}\n\
         {} charts use {:.0} % of {} of {} x {} texels, {:.1} for a metre\n\
         {} texels, of which {} were sampled for lamps and sky, then {:?}; {} lie inside something\n\
         mean light {r:.4} {g:.4} {b:.4}, both sides of seams shown within {:.2} codes at {} places; {} by {}, {}{} rays in {:.0} s\n",
        folder.display(),
        report.files.join(", "),
        report.sky,
        count(report.charts as u64),
        100.0 * report.utilisation,
        counted(u64::from(report.textures), "texture", "textures"),
        report.size,
        report.size,
        report.texels_per_m,
        count(notes.texels as u64),
        count(notes.sampled.first().copied().unwrap_or(0) as u64),
        notes.sampled.get(1..).unwrap_or(&[]),
        count(notes.inside as u64),
        notes.widest_seam_codes,
        count(notes.seam_places[0] as u64),
        notes.illumination,
        notes.surface,
        if notes.denoised { "smoothed, " } else { "" },
        count(notes.rays),
        report.seconds,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_larger_than_the_largest_is_not_asked_for() {
        let told = |smallest: u64, size: u32, textures: u32| {
            more_room(&PackError::TooSmall { charts: 9, width: size, height: size, smallest }, size, textures)
        };
        assert!(told(66, 16, 1).contains("--size 66 or more"), "{}", told(66, 16, 1));
        assert!(told(64, 64, 1).contains("--size 65 or more"), "more than was too little");
        for (smallest, size) in [(16_385, 16), (16_384, 16_384)] {
            let (few, most) = (told(smallest, size, 1), told(smallest, size, 64));
            assert!(!few.contains("give --size") && few.contains("more --textures"), "{few}");
            assert!(!most.contains("--textures") && most.contains("fewer parts"), "{most}");
        }
    }
}
