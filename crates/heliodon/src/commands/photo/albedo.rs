//! `heliodon photo albedo`: the stone's own colour.

use super::made::{self, MadeReport, ModelArgs};
use super::turns::turns;
use crate::App;
use crate::failure::wrong_arguments;
use anyhow::Result;
use heliodon_bake::photo::{HourLightParams, HourLights, ProjectLight, known_albedo, surroundings};
use heliodon_bake::report::Reporter;
use heliodon_mesh::Mesh;
use heliodon_photo::albedo::{Albedo, AlbedoParams, solve};
use heliodon_photo::camera::Camera;
use heliodon_photo::texture::{Photograph, Survey, TextureParams};
use serde::Serialize;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(super) struct AlbedoArgs {
    #[command(flatten)]
    model: ModelArgs,
    /// The largest side of the map, texels, 64 to 16384
    #[arg(long, value_name = "TEXELS", default_value_t = TextureParams::default().most_side)]
    side: u32,
    /// Texels for a metre at most [default: as many as photographs show]
    #[arg(long, value_name = "X")]
    per_m: Option<f32>,
    /// Paths from each place that light of the sky and bounced light is traced at
    #[arg(long, value_name = "N", default_value_t = HourLightParams::default().samples)]
    samples: u32,
    /// The mean albedo of what photographs show, 0 to 1, where nothing in them is known; all of it is relative to this
    #[arg(long, value_name = "X", default_value_t = 0.5)]
    mean: f32,
    /// How far shadows may be off, metres: so near to their edges a photograph is not asked
    #[arg(long, value_name = "METRES", default_value_t = 0.1)]
    edge: f32,
}

/// What `albedo` has to say.
#[derive(Serialize)]
struct AlbedoReport {
    size: [u32; 2],
    texels: usize,
    /// The part of the texels whose albedo is known.
    known: f32,
    /// Whether something of known albedo makes it absolute.
    absolute: bool,
    rounds: u32,
    /// How much albedo changed in the last round, as a part.
    change: f32,
    above_one: usize,
    /// The median of how far it may be off, as a part.
    error: f32,
    hours: Vec<String>,
    photos: Vec<PhotoTold>,
    warnings: Vec<String>,
    folder: PathBuf,
}

#[derive(Serialize)]
struct PhotoTold {
    name: String,
    hour: String,
    /// How much brighter it is than the mean of all beside what its hour's light explains, for red, green and blue.
    gain: [f32; 3],
    /// How far it is off what all say, as a part: the median, and of 95 of 100 texels that others show as well.
    off: [f32; 2],
    texels: usize,
    compared: usize,
    by_edges: usize,
}

pub(super) fn run(app: &App, args: &AlbedoArgs) -> Result<()> {
    if !(args.mean > 0.0 && args.mean <= 1.0) {
        wrong_arguments!("--mean is above 0 and at most 1");
    }
    if !(args.edge >= 0.0 && args.edge.is_finite()) || args.samples == 0 {
        wrong_arguments!("--edge is 0 or more, and --samples at least 1");
    }
    let (project, witnesses) = made::solved(&args.model.project)?;
    let (model, folder) = made::modelled(&args.model, &project, &witnesses)?;
    let names: Vec<&str> = witnesses.photographs.iter().map(|(name, _)| name.as_str()).collect();
    app.progress.stage("skies", 0);
    let light = ProjectLight::of(&project, &names)?;
    let mut warnings = light.notes.clone();
    let (mut used, mut hour_of, mut files): (Vec<(String, Camera)>, Vec<usize>, Vec<String>) = Default::default();
    for ((photograph, file), hour) in witnesses.photographs.iter().zip(&witnesses.files).zip(&light.hour_of) {
        let Some(hour) = hour else { continue };
        used.push(photograph.clone());
        hour_of.push(*hour);
        files.push(file.clone());
    }
    let files = turns(app, &project, &files);
    let photographs: Vec<Photograph> =
        (used.iter().zip(&files)).map(|((name, camera), file)| Photograph { name, camera: *camera, picture: file }).collect();
    let around = surroundings(&project)?;
    let occluders: Vec<&Mesh> = around.iter().collect();
    app.progress.stage("photographs", photographs.len() as u64);
    let most_per_m = args.per_m.unwrap_or(f32::INFINITY);
    let params = TextureParams { most_side: args.side, most_per_m, ..TextureParams::default() };
    let survey = Survey::new(&model.parts, &occluders, &photographs, &params)?;
    app.progress.finished();
    warnings.extend_from_slice(survey.warnings());
    let (known, notes) = known_albedo(&project, &survey, &used);
    warnings.extend(notes);
    let lights = HourLights::new(
        &survey,
        &occluders,
        &light.hours,
        &hour_of,
        HourLightParams { samples: args.samples, ..HourLightParams::default() },
    );
    let params = AlbedoParams {
        exposures_unknown: !project.file.project.same_exposure,
        mean: Some(glam::Vec3::splat(args.mean)),
        known,
        ..AlbedoParams::default()
    };
    let texels = survey.places().len();
    app.progress.stage("light and albedo", u64::from(params.rounds));
    let mut round = 0;
    let found = solve(texels, survey.samples(), survey.names(), &survey.around(args.edge), &params, |albedo| {
        app.progress.progress(round);
        round += 1;
        lights.light(albedo).map_err(|error| error.to_string())
    })?;
    app.progress.finished();
    let painted = survey.painted(&found.albedo, found.gains.clone());
    let meshes: Vec<&Mesh> = painted.meshes.iter().collect();
    let parts: MadeReport = made::written(&model, &meshes, folder)?;
    let image = &painted.atlas.image;
    image.write_png(parts.folder.join("albedo.png"))?;
    painted.evidence.image().write_png(parts.folder.join("evidence.png"))?;
    let report = AlbedoReport {
        size: [image.width, image.height],
        texels,
        known: found.albedo.iter().flatten().count() as f32 / texels.max(1) as f32,
        absolute: found.known_off.iter().any(Option::is_some),
        rounds: found.rounds,
        change: found.change,
        above_one: found.above_one,
        error: median_error(&found),
        photos: told(&found, &hour_of, &light.names),
        hours: light.names,
        warnings,
        folder: parts.folder,
    };
    app.output.result(&report, describe)
}

fn median_error(found: &Albedo) -> f32 {
    let mut errors: Vec<f32> = found.error.iter().copied().filter(|error| error.is_finite()).collect();
    if errors.is_empty() {
        return f32::INFINITY;
    }
    let middle = errors.len() / 2;
    *errors.select_nth_unstable_by(middle, f32::total_cmp).1
}

fn told(found: &Albedo, hour_of: &[usize], hours: &[String]) -> Vec<PhotoTold> {
    let photo = |(i, agreement): (usize, &heliodon_photo::albedo::Agreement)| PhotoTold {
        name: agreement.photograph.clone(),
        hour: hours[hour_of[i]].clone(),
        gain: found.gains.get(i).map_or([1.0; 3], |gain| gain.gain.to_array()),
        off: [agreement.median, agreement.percentile_95],
        texels: agreement.texels,
        compared: agreement.compared,
        by_edges: agreement.by_edges,
    };
    found.agreement.iter().enumerate().map(photo).collect()
}

fn describe(report: &AlbedoReport) -> String {
    let [width, height] = report.size;
    let mut text = format!(
        "albedo.png: {width} x {height}, known for {:.0} % of {} texels, off by about {:.1} %\n",
        100.0 * report.known,
        report.texels,
        100.0 * report.error
    );
    text += if report.absolute {
        "it is absolute, by what [[grey]] knows\n"
    } else {
        "it is relative: nothing in the photographs is known; add a [[grey]] place, or give --mean\n"
    };
    text += &format!("light and albedo agree after {} rounds to {:.2} %\n", report.rounds, 100.0 * report.change);
    for photo in &report.photos {
        let stops: Vec<String> = photo.gain.iter().map(|gain| format!("{:+.2}", gain.log2())).collect();
        let [median, most] = photo.off.map(|off| 100.0 * off);
        text += &format!(
            "  {} ({}): off the rest by {median:.1} % (median), {most:.0} % (95th percentile); {} stops; {} texels, {} of them shown by others too, {} more by shadows' edges\n",
            photo.name,
            photo.hour,
            stops.join(" "),
            photo.texels,
            photo.compared,
            photo.by_edges
        );
    }
    if report.above_one > 0 {
        text += &format!(
            "{} texels reflect more than all: light there is too weak, or a photograph too bright\n",
            report.above_one
        );
    }
    report.warnings.iter().for_each(|warning| text += &format!("  {warning}\n"));
    text += &format!("written to {}\n", report.folder.display());
    text
}
