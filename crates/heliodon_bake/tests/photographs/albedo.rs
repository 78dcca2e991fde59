//! Stone's own colour from eight photographs of three hours, relit at a fourth.

use crate::render::{Painted, Stage, Stones, developed, difference, hours, look, photographed, rgb};
use crate::temple;
use glam::Vec3;
use heliodon_bake::photo::{HourLightParams, HourLights, HourSky, ProjectLight, known_albedo};
use heliodon_image::Picture;
use heliodon_photo::albedo::{Albedo, AlbedoParams, solve};
use heliodon_photo::camera::Camera;
use heliodon_photo::project::Project;
use heliodon_photo::texture::{Photograph, Survey, TextureParams};
use heliodon_rays::Ray;
use heliodon_testkit::flip::mean_flip;
use std::fmt::Write;
use std::time::Instant;

const TIMES: [&str; 3] = ["08:45", "12:00", "15:30"];
const FOURTH: &str = "10:20";
/// What a camera makes of a kcd/m2, so that sunlit marble is bright and not white.
const EXPOSURE: f32 = 1.0 / 32.0;
/// The photograph in which the grey card is looked at.
const CARD_IN: usize = 1;

struct Scale {
    size: [u32; 2],
    samples: u32,
    per_m: f32,
    relit: [u32; 2],
    relit_samples: u32,
    light: HourLightParams,
}

/// Each photograph's exposure and white balance.
fn gain(i: usize) -> Vec3 {
    let exposure = libm::exp2f([0.0, 0.25, -0.3, 0.1, -0.2, 0.2, -0.1, 0.15][i]);
    let warmth = [0.0, 0.04, -0.03, 0.05, -0.05, 0.0, 0.03, -0.04][i];
    Vec3::new(1.0 + warmth, 1.0, 1.0 - warmth) * exposure * EXPOSURE
}

fn project(cameras: &[Camera]) -> Project {
    let mut text = String::from(
        "[sky]\nlatitude_deg = 37.97\nlongitude_deg = 23.73\nutc_offset = \"+02:00\"\nnorth_deg = 0.0\nturbidity = 3.0\n",
    );
    for (i, camera) in cameras.iter().enumerate() {
        let [width, height] = [camera.intrinsics.width, camera.intrinsics.height];
        let time = TIMES[i % 3];
        writeln!(text, "[[photo]]\nfile = \"{i}.png\"\nsize_px = [{width}, {height}]\ntime = \"2024-04-20 {time}\"").unwrap();
    }
    let at = cameras[CARD_IN].project(temple::CARD_M).unwrap();
    writeln!(text, "[[grey]]\nphoto = \"{CARD_IN}.png\"\nat = [{}, {}]\nradius_px = 3\nalbedo = {}", at.x, at.y, temple::CARD)
        .unwrap();
    Project::parse(&text, "photos.toml").unwrap()
}

/// Whether the sun of an hour reaches a place.
fn sunlit(stage: &Stage, hour: &HourSky, place: Vec3, normal: Vec3) -> bool {
    let direction = hour.sun.unwrap().direction;
    let mut occluded = [0];
    let ray = Ray { origin: place + normal * 0.004, direction, t_min: 0.0, t_max: f32::INFINITY };
    stage.rays.occluded(&[ray], &mut occluded);
    occluded[0] == 0 && normal.dot(direction) > 0.0
}

fn at(sorted: &[f32], part: f32) -> f32 {
    sorted[((sorted.len() - 1) as f32 * part) as usize]
}

/// How far albedo is off, as parts, sorted.
struct Errors {
    all: Vec<f32>,
    /// Of texels by an edge of a shadow of any hour.
    edges: Vec<f32>,
    /// Of the others.
    others: Vec<f32>,
    /// For each hour the mean logarithm by which the lit sides of its shadows' edges are too bright against their shaded sides.
    steps: Vec<f32>,
    /// The median logarithm by which all of it is too bright.
    bias: f32,
}

fn errors(stage: &Stage, hours: &[HourSky], survey: &Survey, found: &Albedo, texel_m: f32) -> Errors {
    let places: Vec<(Vec3, Vec3)> = survey.places().collect();
    let around = survey.around(0.15);
    let lit: Vec<Vec<bool>> =
        hours.iter().map(|hour| places.iter().map(|(p, n)| sunlit(stage, hour, *p, *n)).collect()).collect();
    let (mut all, mut edges, mut others, mut logs) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut sides = vec![[(0.0, 0.0); 2]; hours.len()];
    for (i, color) in found.albedo.iter().enumerate().filter_map(|(i, color)| Some((i, (*color)?))) {
        let (place, normal) = places[i];
        let truth = temple::mean_albedo(place, normal, texel_m);
        let error = ((color - truth).abs() / truth).max_element();
        let log = libm::logf((color / truth).element_product()) / 3.0;
        all.push(error);
        logs.push(log);
        let mut is_edge = false;
        for (hour, lit) in lit.iter().enumerate() {
            if around.of(i).iter().any(|&other| lit[other as usize] != lit[i]) {
                is_edge = true;
                let side = &mut sides[hour][usize::from(lit[i])];
                side.0 += log;
                side.1 += 1.0;
            }
        }
        (if is_edge { &mut edges } else { &mut others }).push(error);
    }
    [&mut all, &mut edges, &mut others, &mut logs].into_iter().for_each(|errors| errors.sort_by(f32::total_cmp));
    let step = |[dark, lit]: &[(f32, f32); 2]| lit.0 / lit.1 - dark.0 / dark.1;
    Errors { all, edges, others, steps: sides.iter().map(step).collect(), bias: at(&logs, 0.5) }
}

fn judge(scale: &Scale) {
    let start = Instant::now();
    let parts = temple::truth();
    let stage = Stage::new(&parts);
    let stones = Stones(&stage);
    let cameras = temple::cameras(8, scale.size);
    let true_hours = hours(&TIMES);
    let pictures: Vec<Picture> = cameras
        .iter()
        .enumerate()
        .map(|(i, camera)| {
            let frame = photographed(&stage.surfaces(&stones), &true_hours[i % 3], camera, scale.samples, i as u32);
            let picture = developed(&frame, gain(i));
            look(&format!("photograph-{i}.png"), &picture);
            Picture::Eight(picture)
        })
        .collect();
    println!("photographed after {:.1} s", start.elapsed().as_secs_f64());
    let project = project(&cameras);
    let named: Vec<(String, Camera)> = cameras.iter().enumerate().map(|(i, camera)| (format!("{i}.png"), *camera)).collect();
    let photographs: Vec<Photograph> =
        named.iter().zip(&pictures).map(|((name, camera), picture)| Photograph { name, camera: *camera, picture }).collect();
    let model = temple::built(24, 0.004, 5);
    let params = TextureParams { most_per_m: scale.per_m, oversampling: 1.0, ..TextureParams::default() };
    let survey = Survey::new(&model, &[], &photographs, &params).unwrap();
    let names: Vec<&str> = named.iter().map(|(name, _)| name.as_str()).collect();
    let light = ProjectLight::of(&project, &names).unwrap();
    assert_eq!((light.hours.len(), &light.notes), (3, &Vec::new()));
    let hour_of: Vec<usize> = light.hour_of.iter().map(|hour| hour.unwrap()).collect();
    let lights = HourLights::new(&survey, &[], &light.hours, &hour_of, scale.light.clone());
    let (known, notes) = known_albedo(&project, &survey, &named);
    assert!(!known.is_empty() && notes.is_empty(), "{notes:?}");
    println!("{} texels, {} nodes, after {:.1} s", survey.places().len(), lights.node_count(), start.elapsed().as_secs_f64());
    let params = AlbedoParams { exposures_unknown: true, known, ..AlbedoParams::default() };
    let around = survey.around(0.1);
    let found = solve(survey.places().len(), survey.samples(), &names, &around, &params, |albedo| {
        println!("a round begins after {:.1} s", start.elapsed().as_secs_f64());
        lights.light(albedo).map_err(|error| error.to_string())
    })
    .unwrap();
    let Errors { all, edges, others, steps, bias } = errors(&stage, &true_hours, &survey, &found, 1.0 / scale.per_m);
    println!(
        "{} rounds, change {:.4}; albedo off: all in all {bias:.4}, median {:.4}, 95 % {:.4}; by shadows' edges {:.4}, {:.4} ({} texels); elsewhere {:.4}, {:.4}; steps {steps:.4?}; {} above 1; after {:.1} s",
        found.rounds,
        found.change,
        at(&all, 0.5),
        at(&all, 0.95),
        at(&edges, 0.5),
        at(&edges, 0.95),
        edges.len(),
        at(&others, 0.5),
        at(&others, 0.95),
        found.above_one,
        start.elapsed().as_secs_f64()
    );
    for (i, (agreement, gains)) in found.agreement.iter().zip(&found.gains).enumerate() {
        let off = gains.gain / gain(i) * gain(0) / found.gains[0].gain;
        println!(
            "  {}: median {:.4}, 95 % {:.4}, {} by edges; gain off {off:.4}",
            agreement.photograph, agreement.median, agreement.percentile_95, agreement.by_edges
        );
    }
    let painted = survey.painted(&found.albedo, found.gains.clone());
    look("albedo.png", &painted.atlas.image);
    let truth: Vec<Option<Vec3>> = survey.places().map(|(place, _)| Some(temple::albedo(place))).collect();
    look("albedo-true.png", &survey.painted(&truth, Vec::new()).atlas.image);
    look("evidence.png", &painted.evidence.image());
    let fourth = &hours(&[FOURTH])[0];
    let view = temple::new_view(scale.relit);
    let relit_stage = Stage::new(&model);
    let colors = Painted::new(&painted.meshes);
    let truth = photographed(&stage.surfaces(&stones), fourth, &view, scale.relit_samples, 100);
    let relit = photographed(&relit_stage.surfaces(&colors), fourth, &view, scale.relit_samples, 200);
    let [truth, relit] = [truth, relit].map(|frame| developed(&frame, Vec3::splat(EXPOSURE)));
    look("relit-true.png", &truth);
    look("relit.png", &relit);
    look("relit-difference.png", &difference(&relit, &truth));
    let flip = mean_flip(&rgb(&truth), &rgb(&relit), scale.relit[0], scale.relit[1]);
    println!("relit at {FOURTH}: mean FLIP {flip:.4}; after {:.1} s", start.elapsed().as_secs_f64());
    assert!(at(&all, 0.5) < 0.05, "{}", at(&all, 0.5));
    assert!(at(&edges, 0.5) < 1.5 * at(&others, 0.5).max(0.02), "{} {}", at(&edges, 0.5), at(&others, 0.5));
    assert!(edges.len() > 1000 && steps.iter().all(|step| step.abs() < 0.03), "{steps:?}");
    assert!(flip < 0.08, "{flip}");
}

#[test]
fn albedo_of_eight_photographs_relights() {
    judge(&Scale {
        size: [448, 336],
        samples: 32,
        per_m: 16.0,
        relit: [320, 240],
        relit_samples: 48,
        light: HourLightParams { sun_samples: 8, samples: 96, max_bounces: 3, ..HourLightParams::default() },
    });
}

/// The same as one would do it; minutes.
#[test]
#[ignore = "minutes"]
fn albedo_of_eight_finer_photographs_relights() {
    judge(&Scale {
        size: [1024, 768],
        samples: 48,
        per_m: 32.0,
        relit: [800, 600],
        relit_samples: 128,
        light: HourLightParams::default(),
    });
}
