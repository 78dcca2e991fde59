//! Looks at everything that a site names, and bakes nothing.

use crate::actors::read_figures;
use crate::budget::{shown_counts, viewer_bytes, viewer_doubt};
use crate::details::Details;
use crate::error::BakeError;
use crate::estimate::USUAL_FUNCTIONS;
use crate::grid::GridPlan;
use crate::ground::{as_given, doubts, on_the_ground};
use crate::lamps;
use crate::panorama::side_of;
use crate::report::Reporter;
use crate::rooms;
use crate::scan::is_wanted;
use crate::scene;
use crate::sky::{lapse_params, place_warnings};
use crate::texels::{Atlas, expects_texels};
use heliodon_bundle::LightLayout;
use heliodon_bundle::manifest::Counts;
use heliodon_bundle::site::{InputKind, Role, Site};
use heliodon_light::median_edge_m;
use heliodon_rays::{BuildParams, TriangleScene};
use heliodon_sky::day::{self, LapseParams};
use serde::Serialize;

/// What is in a site.
#[derive(Clone, Debug, Serialize)]
pub struct CheckReport {
    /// The site's name.
    pub name: String,
    /// Its parts, in order.
    pub parts: Vec<CheckedPart>,
    /// Vertices over all parts.
    pub vertices: u64,
    /// Triangles over all parts.
    pub triangles: u64,
    /// Points of the light grid, at most: what lies below the ground of rooms is left out by the bake.
    pub grid_points: u64,
    /// Names of the actors.
    pub actors: Vec<String>,
    /// Its day.
    pub day: CheckedDay,
    /// What is odd but need not stop a bake.
    pub warnings: Vec<String>,
}

/// What is in a part.
#[derive(Clone, Debug, Serialize)]
pub struct CheckedPart {
    /// Its name, or its file pattern.
    pub name: String,
    /// What it is.
    pub role: Role,
    /// Files that it was read from.
    pub files: usize,
    /// Its vertices.
    pub vertices: u64,
    /// Its triangles.
    pub triangles: u64,
    /// The lower corner of its box, metres in the site's space.
    pub min: [f32; 3],
    /// The upper corner.
    pub max: [f32; 3],
    /// The median length of its edges, metres: light is as sharp as that.
    pub median_edge_m: f32,
}

/// The day of a site.
#[derive(Clone, Debug, Serialize)]
pub struct CheckedDay {
    /// Sky images; 0 for a model.
    pub probes: usize,
    /// Sun steps.
    pub sun_steps: u32,
    /// Of these, steps with a sun.
    pub suns: usize,
    /// Entries of the sky.
    pub sky_steps: usize,
    /// The first entry's time.
    pub first: String,
    /// The last entry's time.
    pub last: String,
}

/// Width of the sky maps that a check makes and throws away, pixels.
const CHECK_MAP_WIDTH: u32 = 32;

/// Extents of a part beyond which its unit is more likely wrong than the monument that large, metres.
const LIKELY_EXTENT_M: std::ops::RangeInclusive<f32> = 0.02..=20_000.0;
/// Coordinates from which `f32` resolves no more than a millimetre, metres.
const FAR_M: f32 = 10_000.0;

/// Reads everything that a site names.
///
/// # Errors
/// The first thing that a bake would stop at.
pub fn check(site: &Site, reporter: &dyn Reporter) -> Result<CheckReport, BakeError> {
    let files = site.input_files()?;
    let figures = read_figures(site, &files)?;
    let bake = &site.bake;
    let layout = LightLayout {
        sun_steps: bake.sun_steps,
        coefficients: bake.coefficients(),
        channels: bake.channels(),
        sun_bounce_functions: 0,
    };
    let mut grid = GridPlan::new(site, &as_given(site), layout, None)?;
    let details = Details::read(site, &files, reporter)?;
    let scene = scene::read(site, &files, reporter)?;
    let mut warnings: Vec<String> = figures.iter().flat_map(|figure| figure.warnings.iter().cloned()).collect();
    // what is prepared is cleaned first
    let stands_as_it_is = site.prepare.is_none() && !site.rooms.is_empty();
    if !site.actors.is_empty() || !site.lamps.is_empty() || stands_as_it_is {
        reporter.stage("rays", 0);
        let rays = TriangleScene::build(&scene.mesh.positions, &scene.mesh.triangles, &BuildParams::default())?;
        reporter.finished();
        let actors = on_the_ground(site, &figures, &rays);
        warnings.extend(doubts(site, &actors, &figures, &rays));
        warnings.extend(lamps::doubts(site, &rays));
        if stands_as_it_is {
            warnings.extend(rooms::stone_doubts(site, &rays));
        }
        grid = GridPlan::new(site, &actors, layout, None)?;
    }
    match (Atlas::new(site, &scene, None), &site.prepare) {
        (Err(error), None) => return Err(error),
        // what is prepared has other triangles, fewer or more of them
        (Err(error), Some(_)) => warnings.push(format!("of the parts as they are before [prepare]: {error}")),
        (Ok(_), _) => {}
    }
    let parts: Vec<CheckedPart> = scene.parts.iter().enumerate().map(|(index, _)| checked_part(site, &scene, index)).collect();
    for (index, part) in parts.iter().enumerate() {
        warn_of_part(part, &mut warnings);
        if part.role == Role::Ground && looks_down(&scene, index) {
            warnings.push(format!(
                "part {}: a ground whose faces look down: it will be lit from below; turn its faces round (flip or recalculate its normals)",
                part.name
            ));
        }
    }

    let params = LapseParams { map_width: CHECK_MAP_WIDTH, ..lapse_params(site, &files)? };
    reporter.stage("sky", 0);
    let built = day::build(&params, &mut |_| Ok(()))?;
    reporter.finished();
    warnings.extend(place_warnings(site));
    warnings.extend(built.notes.iter().map(ToString::to_string));
    if let (Some(date), 0) = (site.sky.date, built.suns.iter().flatten().count()) {
        warnings.push(format!("the sun does not rise at this place on {date}: no step of the day has one"));
    }
    warnings.extend(details.doubts(site, &scene));
    warnings.extend(rooms::doubt(site, &scene));
    warnings.extend(viewer_warning(site, &scene, LightLayout { sun_steps: built.sun_steps, ..layout }));
    for warning in &warnings {
        reporter.warning(warning);
    }
    let warnings = scene.warnings.iter().cloned().chain(warnings).collect();
    Ok(CheckReport {
        name: site.site.name.clone(),
        vertices: scene.mesh.positions.len() as u64,
        triangles: scene.mesh.triangles.len() as u64,
        parts,
        grid_points: grid.cells.len() as u64,
        actors: site.actors.iter().map(|actor| actor.display_name().to_owned()).collect(),
        day: CheckedDay {
            probes: files.iter().filter(|file| file.kind == InputKind::Probe).count(),
            sun_steps: built.sun_steps,
            suns: built.suns.iter().flatten().count(),
            sky_steps: built.lapse.steps.len(),
            first: built.lapse.steps.first().map_or_else(String::new, |step| step.time.clone()),
            last: built.lapse.steps.last().map_or_else(String::new, |step| step.time.clone()),
        },
        warnings,
    })
}

/// A sentence where the viewer will need more than `[budget]` gives it; where geometry is to be prepared, by the most that is drawn of it.
fn viewer_warning(site: &Site, scene: &scene::Scene, layout: LightLayout) -> Option<String> {
    let mesh = &scene.mesh;
    let read = mesh.triangles.len() as u64;
    let splits = site.parts.iter().any(|part| part.role != Role::Scan);
    let triangles = match &site.prepare {
        Some(prepare) if prepare.triangles > 0 => {
            if splits {
                prepare.triangles
            } else {
                prepare.triangles.min(read)
            }
        }
        _ => read,
    };
    let vertices = (mesh.positions.len() as f64 * triangles as f64 / read.max(1) as f64) as u64;
    let functions = if site.bake.sun_bounce { USUAL_FUNCTIONS.min(layout.sun_steps) } else { 0 };
    let counts = Counts { vertices, triangles, ..Counts::default() };
    let layout = LightLayout { sun_bounce_functions: functions, ..layout };
    let atlas = expects_texels(scene).then(|| site.bake.effective_texels());
    let of_scan = Counts { vertices: mesh.positions.len() as u64, triangles: read, ..Counts::default() };
    let counts = shown_counts(counts, is_wanted(site).then_some(of_scan));
    let needs = viewer_bytes(counts, layout, mesh.texture_bytes() as u64, [atlas, side_of(site)]);
    viewer_doubt(site.budget.viewer_bytes(), needs)
}

fn checked_part(site: &Site, scene: &scene::Scene, index: usize) -> CheckedPart {
    let (part, range) = (&site.parts[index], &scene.parts[index]);
    let positions = &scene.mesh.positions[range.vertices.clone()];
    let triangles = &scene.mesh.triangles[range.triangles.clone()];
    let low = positions.iter().copied().fold(glam::Vec3::INFINITY, glam::Vec3::min);
    let high = positions.iter().copied().fold(glam::Vec3::NEG_INFINITY, glam::Vec3::max);
    CheckedPart {
        name: part.display_name(),
        role: part.role,
        files: range.files,
        vertices: positions.len() as u64,
        triangles: triangles.len() as u64,
        min: low.to_array(),
        max: high.to_array(),
        median_edge_m: median_edge_m(&scene.mesh.positions, triangles),
    }
}

/// The part of its area by which a ground looks more down than up before it is told: one that is closed below does both alike, but for rounding.
const LOOKS_DOWN: f64 = 0.1;

/// Whether more of a part's area, seen from above or below, has its front below than above.
fn looks_down(scene: &scene::Scene, part: usize) -> bool {
    let mesh = &scene.mesh;
    let (mut up, mut all) = (0.0, 0.0);
    for triangle in &mesh.triangles[scene.parts[part].triangles.clone()] {
        let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
        let area = f64::from((b - a).cross(c - a).y.abs());
        // normals that the file has decide what is lit; they may contradict the order of the corners
        let normal: glam::Vec3 = triangle.iter().map(|&vertex| mesh.normals[vertex as usize]).sum();
        up += area.copysign(normal.y.into());
        all += area;
    }
    up < -LOOKS_DOWN * all
}

fn warn_of_part(part: &CheckedPart, warnings: &mut Vec<String>) {
    let extent = (0..3).map(|axis| part.max[axis] - part.min[axis]).fold(0.0, f32::max);
    if !LIKELY_EXTENT_M.contains(&extent) {
        let extent = if extent < 0.001 { format!("{extent:.1e}") } else { format!("{extent:.3}") };
        warnings.push(format!("part {}: {extent} m across; is its unit right (unit = \"mm\", \"cm\", \"m\" ...)?", part.name));
    }
    let farthest = part.min.iter().chain(&part.max).fold(0.0_f32, |far, coordinate| far.max(coordinate.abs()));
    if farthest > FAR_M {
        warnings.push(format!(
            "part {}: coordinates reach {farthest} m, where 32-bit numbers no longer hold millimetres; subtract an origin in [site]",
            part.name
        ));
    }
}
