//! From the files of a site to the geometry that is drawn, and what stands behind it in the light.
//!
//! Part after part is read, cleaned, split where it is coarse and simplified to what the display can show from the rooms ([`part`]); of all
//! parts together what no eye in any room can see is dropped ([`dropped`]). Light is then solved at the vertices that are left, among the
//! original geometry: what is dropped is not drawn, but still occludes, and a coarse form of it still holds the light that it reflects.

mod dropped;
mod kept;
mod looks;
mod part;
mod report;
mod steps;
mod views;

pub(crate) use kept::GEOMETRY;
pub use part::PartReport;
pub use report::PrepareReport;
pub use steps::Step;
pub use views::views;

use crate::cache::Cache;
use crate::error::BakeError;
use crate::plan::Plan;
use crate::report::Reporter;
use crate::scene::{Original, PartRange, Scene};
use dropped::{Reduced, coarser, reduce, seen};
use heliodon_bundle::site::{InputFile, Prepare, Site};
use heliodon_mesh::Mesh;
use heliodon_mesh::import::ImportReport;
use heliodon_prepare::Views;
use heliodon_prepare::purge::PurgeParams;
use heliodon_prepare::simplify::{SimplifyParams, simplify};
use kept::{geometry_key, keep, recall};
use looks::Looks;
use part::{compare, prepare_part, simplifies, simplify_params};
use std::path::Path;
use steps::Steps;

/// What preparation makes of a site.
#[derive(Debug)]
pub struct Prepared {
    /// What is drawn and what reflects, and the original that rays meet.
    pub scene: Scene,
    /// What was found and done.
    pub report: PrepareReport,
}

/// Reads and prepares every part of a site. Into the folder `looks`, which must exist, coloured meshes are written that show what was found
/// and done.
///
/// # Errors
/// Files that cannot be read, and what cannot be prepared within the limits of the formats.
pub fn prepare(
    site: &Site,
    files: &[InputFile],
    settings: &Prepare,
    looks: Option<&Path>,
    reporter: &dyn Reporter,
) -> Result<Prepared, BakeError> {
    let views = views(site);
    let looks = Looks::new(site, looks);
    let mut import = ImportReport::default();
    let mut original = Original::default();
    let (mut meshes, mut ends) = (Vec::with_capacity(site.parts.len()), Vec::with_capacity(site.parts.len()));
    let mut report = PrepareReport::default();
    for index in 0..site.parts.len() {
        let mut steps = Steps::new(reporter);
        let mesh = steps.run("reading", || crate::scene::read_part(site, files, index, &mut import))?;
        let (mesh, of_part) = prepare_part(site, index, mesh, &views, settings, &mut original, &looks, &mut steps)?;
        meshes.push(mesh);
        ends.push((original.positions.len(), original.triangles.len()));
        report.parts.push(of_part);
    }
    let mut steps = Steps::new(reporter);
    let params = fit(&mut meshes, &views, settings, &mut steps)?;
    (report.error_px, report.edge_px) = (f64::from(params.error_px), f64::from(params.edge_px));
    let keep = if settings.purge && !views.cells.is_empty() {
        let (keep, purged) = seen(&meshes, &views, &PurgeParams { ring: settings.ring, ..PurgeParams::default() }, &mut steps)?;
        report.purge = Some(purged);
        keep
    } else {
        vec![true; meshes.iter().map(|mesh| mesh.triangles.len()).sum()]
    };
    let (mut parts, mut begin) = (Vec::with_capacity(meshes.len()), (0, 0));
    for ((mesh, of_part), end) in meshes.into_iter().zip(&mut report.parts).zip(ends) {
        let as_scanned = Mesh {
            positions: original.positions[begin.0..end.0].to_vec(),
            triangles: original.triangles[begin.1..end.1].iter().map(|t| t.map(|v| v - begin.0 as u32)).collect(),
            ..Mesh::default()
        };
        parts.push(compare(&as_scanned, mesh, &views, &params, of_part, &mut steps));
        begin = end;
    }
    let reduced = reduce(parts, &keep, &views, &params, &looks, &mut steps)?;
    report.steps = steps.taken;
    let scene = join(reduced, original, files, import.warnings)?;
    report.count(&scene);
    Ok(Prepared { scene, report })
}

/// Rounds of [`fit`] at most.
const MOST_ROUNDS: usize = 6;
/// What is drawn fits where it is no more than so many times what is asked for.
const FITS: f64 = 1.05;
/// Limits grow by at least this much in each round.
const LEAST_GROWTH: f64 = 1.1;

/// Simplifies further until about as many triangles are drawn as the site wants; returns the limits with which they do. What is simplified again is a
/// subset of the original's vertices still, and is compared with the original in the end.
fn fit(meshes: &mut [Mesh], views: &Views, settings: &Prepare, steps: &mut Steps) -> Result<SimplifyParams, BakeError> {
    let mut params = simplify_params(settings);
    if settings.triangles == 0 || !simplifies(&params, views) {
        return Ok(params);
    }
    for _ in 0..MOST_ROUNDS {
        let drawn = if settings.purge && !views.cells.is_empty() {
            let purge = PurgeParams { ring: settings.ring, max_checks: 1, ..PurgeParams::preview() };
            seen(meshes, views, &purge, steps)?.0.into_iter().filter(|kept| *kept).count()
        } else {
            meshes.iter().map(|mesh| mesh.triangles.len()).sum()
        };
        let excess = drawn as f64 / settings.triangles as f64;
        if excess <= FITS {
            break;
        }
        // triangles have areas
        params = coarser(&params, excess.sqrt().max(LEAST_GROWTH) as f32);
        for mesh in &mut *meshes {
            *mesh = steps.run("simplifying to the number wanted", || simplify(mesh, views, &params)).mesh;
        }
    }
    Ok(params)
}

/// The prepared scene of a plan: as it was kept, or made now and kept.
///
/// # Errors
/// As [`prepare`], and a cache that cannot be written.
pub fn prepared_scene(plan: &Plan, settings: &Prepare, reporter: &dyn Reporter) -> Result<Scene, BakeError> {
    // shards of one site may do this side by side: what they write is the same
    let cache = Cache::join(&plan.cache_root(), &geometry_key(plan), &plan.owner())?;
    if let Some(scene) = recall(&cache) {
        reporter.note("going on: the geometry is prepared");
        scene.warnings.iter().for_each(|warning| reporter.warning(warning));
        return Ok(scene);
    }
    let Prepared { scene, report } = prepare(&plan.site, &plan.files, settings, None, reporter)?;
    scene.warnings.iter().for_each(|warning| reporter.warning(warning));
    keep(&cache, &scene, &serde_json::to_vec_pretty(&report).unwrap_or_default())?;
    Ok(scene)
}

/// Puts the parts together into one mesh.
fn join(parts: Vec<Reduced>, mut original: Original, files: &[InputFile], warnings: Vec<String>) -> Result<Scene, BakeError> {
    let mut scene = Scene { mesh: Mesh::default(), parts: Vec::new(), warnings, original: None };
    for (index, part) in parts.into_iter().enumerate() {
        let (first_vertex, first_triangle) = (scene.mesh.positions.len(), scene.mesh.triangles.len());
        let drawn = part.drawn.triangles.len();
        original.stands_for.extend(part.stands_for.iter().map(|&t| first_triangle as u32 + t));
        original.clearance_m.extend(part.clearance_m);
        for mesh in [part.drawn, part.hidden] {
            if scene.mesh.positions.is_empty() {
                scene.mesh = mesh;
            } else {
                scene.mesh.append(&mesh)?;
            }
        }
        scene.parts.push(PartRange {
            vertices: first_vertex..scene.mesh.positions.len(),
            triangles: first_triangle..scene.mesh.triangles.len(),
            drawn,
            files: crate::scene::files_of(files, index).count(),
        });
    }
    scene.original = Some(original);
    Ok(scene)
}
