//! One part: from its files to what the display can show of it.

use super::looks::Looks;
use super::steps::{Step, Steps};
use crate::error::BakeError;
use crate::scene::Original;
use glam::Vec3;
use heliodon_bundle::site::{Prepare, Role, Site, Winding};
use heliodon_mesh::{Mesh, MeshError};
use heliodon_prepare::Views;
use heliodon_prepare::clean::{self, CleanParams, CleanReport, clean};
use heliodon_prepare::simplify::{MeasureReport, SimplifyParams, SimplifyReport, measure, nearest_triangles, simplify};
use heliodon_prepare::solids::{SolidsParams, SolidsReport, unite};
use heliodon_prepare::split::{SplitReport, split};
use serde::Serialize;

/// A part before the purge.
pub(super) struct Part {
    /// What the display can show of it.
    pub mesh: Mesh,
    /// For each triangle of the part's original the one of `mesh` that stands for it.
    pub stands_for: Vec<u32>,
    /// For each vertex of `mesh` how far the original departs from the triangles around it, metres.
    pub clearance_m: Vec<f32>,
}

/// What was found in a part, and done.
#[derive(Clone, Debug, Default, Serialize)]
pub struct PartReport {
    /// Its name.
    pub name: String,
    /// Vertices in its files.
    pub vertices_read: u64,
    /// Triangles in its files.
    pub triangles_read: u64,
    /// Faults that were found and mended.
    pub clean: Option<CleanReport>,
    /// Solids that were united, and what was buried in them.
    pub solids: Option<SolidsReport>,
    /// Large triangles that were split.
    pub split: Option<SplitReport>,
    /// Triangles after cleaning and splitting: what rays of light meet.
    pub triangles_original: u64,
    /// What simplification did.
    pub simplify: Option<SimplifyReport>,
    /// How far the result is off the original.
    pub error: Option<MeasureReport>,
    /// Triangles that are drawn.
    pub triangles_drawn: u64,
    /// Triangles that are not drawn and hold the light that they reflect.
    pub triangles_hidden: u64,
    /// What its steps took, in order.
    pub steps: Vec<Step>,
}

/// How the site wants stone simplified.
pub(super) fn simplify_params(settings: &Prepare) -> SimplifyParams {
    SimplifyParams {
        error_px: settings.error_px as f32,
        edge_px: settings.edge_px as f32,
        nearest_m: settings.nearest_m as f32,
        error_m: settings.error_m.unwrap_or(0.0) as f32,
        edge_m: settings.edge_m.unwrap_or(0.0) as f32,
        ..SimplifyParams::screen()
    }
}

/// Whether anything is simplified.
pub(super) fn simplifies(params: &SimplifyParams, views: &Views) -> bool {
    (if views.cells.is_empty() { params.error_m } else { params.error_px }) > 0.0
}

/// Clearances are at most this many times the error that was allowed: where a loose bit was dropped, the surface nearest to it is another one.
const MOST_CLEARANCE: f32 = 2.0;

/// How a part that was simplified with `params` belongs to its original.
pub(super) fn compare(
    original: &Mesh,
    mesh: Mesh,
    views: &Views,
    params: &SimplifyParams,
    report: &mut PartReport,
    steps: &mut Steps,
) -> Part {
    if !simplifies(params, views) {
        let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len() as u32);
        return Part { mesh, stands_for: (0..triangles).collect(), clearance_m: vec![0.0; vertices] };
    }
    let measured = steps.run("measuring", || measure(original, &mesh, views, params));
    let nearest = steps.run("mapping", || nearest_triangles(original, &mesh, views, params));
    let known = !views.cells.is_empty();
    let error_m = |place| if known { params.error_px * views.pixel_m(place, params.nearest_m) } else { params.error_m };
    let clearance = mesh.positions.iter().zip(measured.clearance_m);
    let clearance_m = clearance.map(|(&place, clearance)| clearance.min(MOST_CLEARANCE * error_m(place))).collect();
    report.error = Some(measured.report);
    if let Some(simplify) = &mut report.simplify {
        (simplify.triangles_after, simplify.vertices_after) = (mesh.triangles.len(), mesh.positions.len());
    }
    Part { mesh, stands_for: nearest.triangle, clearance_m }
}

#[expect(clippy::too_many_arguments, reason = "a step of the pipeline: what it works on, and what it adds to")]
/// Cleans, splits and simplifies a part; what rays will meet of it is added to `original`. Returns what is left.
///
/// # Errors
/// More vertices over all parts than an index counts, or more triangles than splitting may make.
pub(super) fn prepare_part(
    site: &Site,
    index: usize,
    mut mesh: Mesh,
    views: &Views,
    settings: &Prepare,
    original: &mut Original,
    looks: &Looks,
    steps: &mut Steps,
) -> Result<(Mesh, PartReport), BakeError> {
    let part = &site.parts[index];
    let mut report = PartReport {
        name: part.display_name(),
        vertices_read: mesh.positions.len() as u64,
        triangles_read: mesh.triangles.len() as u64,
        ..PartReport::default()
    };
    if settings.clean {
        let params = clean_params(settings, part.role, views);
        let as_read = looks.wanted().then(|| mesh.clone());
        let found = steps.run("cleaning", || clean(&mut mesh, &params));
        if let Some(as_read) = as_read {
            looks.found(index, &as_read, &found)?;
        }
        report.clean = Some(found);
    }
    if settings.solids && matches!(part.role, Role::Filling | Role::Prop) {
        let params = SolidsParams { eyes: eyes(views), ..SolidsParams::default() };
        let before = looks.wanted().then(|| mesh.clone());
        let found = steps.run("uniting solids", || unite(&mut mesh, &params));
        if let Some(before) = before {
            looks.united(index, &before, &found)?;
        }
        report.solids = Some(found);
    }
    let params = simplify_params(settings);
    let target_m =
        |place| if views.cells.is_empty() { params.edge_m } else { params.edge_px * views.pixel_m(place, params.nearest_m) };
    if part.role != Role::Scan && target_m(Vec3::ZERO) > 0.0 {
        // an edge that runs towards the eye shows little of its length
        let longest_m = |place, along| LONGEST_EDGE * target_m(place) / views.across(place, along).max(LEAST_ACROSS);
        report.split = Some(steps.run("splitting", || split(&mut mesh, longest_m, MOST_TRIANGLES))?);
    }
    report.triangles_original = mesh.triangles.len() as u64;
    push_original(original, &mesh)?;
    if simplifies(&params, views) {
        let simplified = steps.run("simplifying", || simplify(&mesh, views, &params));
        report.simplify = Some(simplified.report);
        mesh = simplified.mesh;
    }
    report.steps = std::mem::take(&mut steps.taken);
    Ok((mesh, report))
}

/// Edges are split that are longer than simplification lets them become: half as long again as what is asked for.
const LONGEST_EDGE: f32 = 1.5;
/// The least part of its length that an edge is taken to show.
const LEAST_ACROSS: f32 = 1.0 / 16.0;

/// The most triangles that splitting may make of a part.
const MOST_TRIANGLES: usize = 200_000_000;

fn clean_params(settings: &Prepare, role: Role, views: &Views) -> CleanParams {
    let of_role = if role == Role::Scan { CleanParams::default() } else { CleanParams::modelled() };
    CleanParams {
        weld_m: of_role.weld_m.max(settings.weld_m as f32),
        isolated_m: settings.isolated_m as f32,
        winding: match settings.winding {
            Winding::Mend => clean::Winding::Mend,
            Winding::Report => clean::Winding::Report,
        },
        eyes: eyes(views),
        ..of_role
    }
}

/// A place in each room.
fn eyes(views: &Views) -> Vec<Vec3> {
    views.cells.iter().map(|cell| 0.5 * (cell.low + cell.high)).collect()
}

/// Adds a part to what rays meet.
fn push_original(original: &mut Original, mesh: &Mesh) -> Result<(), BakeError> {
    let first = original.positions.len();
    let fits = u32::try_from(first + mesh.positions.len()).is_ok();
    let first = if fits { first as u32 } else { return Err(MeshError::TooMany("vertices").into()) };
    original.positions.extend_from_slice(&mesh.positions);
    original.triangles.extend(mesh.triangles.iter().map(|t| t.map(|vertex| vertex + first)));
    Ok(())
}
