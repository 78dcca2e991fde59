//! From the files of a site to the geometry that is drawn, and what stands behind it in the light.
//!
//! Part after part is read, cleaned and split where it is coarse (`part`); what parts have in common is found, so that their borders stay the same
//! (`borders`), and each is simplified to what the display can show from the rooms. Of all parts together what no eye in any room can see is
//! dropped (`dropped`), and what lies within solids (`buried`). Light is then solved at the vertices that are left, among the
//! original geometry: what is dropped is not drawn, but still occludes, and a coarse form of it still holds the light that it reflects.
//!
//! Each step's result is kept as soon as it is there (`pieces`), and the finished geometry (`kept`), after which only those steps' stay that
//! depend on one part alone: where another part changes, they are taken from there.

mod arrays;
mod borders;
mod buried;
mod doubts;
mod dropped;
mod estimate;
mod fit;
mod halfway;
mod kept;
mod limits;
mod looks;
mod part;
mod patches;
mod pieces;
mod report;
mod steps;
mod surfacing;
mod views;

pub(crate) use arrays::{load_array, store_array, textures_of};
pub(crate) use doubts::stone_doubt;
pub use estimate::{PrepareEstimate, StepEstimate, estimate};
pub(crate) use estimate::{estimate_with, is_prepared, preparation_need};
pub(crate) use kept::GEOMETRY;
pub use part::PartReport;
pub use report::PrepareReport;
pub use steps::Step;
pub(crate) use surfacing::Surfacing;
pub use views::views;

use crate::budget::Means;
use crate::cache::Cache;
use crate::error::BakeError;
use crate::key::Digest;
use crate::plan::Plan;
use crate::report::Reporter;
use crate::scene::{Original, PartRange, Scene};
use borders::borders;
use buried::bury;
use doubts::{empty_parts, number_doubt, purge_doubts, room_doubts, small_parts};
use dropped::{Reduced, purge_name, purge_params, reduce, seen};
use fit::fit;
use heliodon_bundle::site::{InputFile, Prepare, Role, Site};
use heliodon_mesh::Mesh;
use heliodon_prepare::Views;
use kept::{FINISHED, geometry_key, part_digest};
use limits::Grained;
use looks::Looks;
use part::{compare, lasting_name, prepare_part, whole_part};
use pieces::{PART, PIECE, Pieces};
use std::path::Path;

/// What preparation makes of a site.
#[derive(Debug)]
pub struct Prepared {
    /// What is drawn and what reflects, and the original that rays meet.
    pub scene: Scene,
    /// What was found and done.
    pub report: PrepareReport,
}

/// What all steps work with.
struct Work<'a> {
    plan: &'a Plan,
    site: &'a Site,
    files: &'a [InputFile],
    settings: &'a Prepare,
    views: Views,
    looks: Looks,
    pieces: Pieces<'a>,
    /// What decides each part's own steps.
    parts: Vec<Digest>,
    reporter: &'a dyn Reporter,
}

/// Prepares every part of a plan's site, or goes on with what an earlier run with the same files and settings has left. Into the folder
/// `looks`, which must exist, coloured meshes are written that show what was found and done; for these, all is done again.
///
/// # Errors
/// Files that cannot be read, what cannot be prepared within the limits of the formats, and a cache that cannot be written.
pub fn prepare(plan: &Plan, settings: &Prepare, looks: Option<&Path>, reporter: &dyn Reporter) -> Result<Prepared, BakeError> {
    prepare_where(plan, settings, looks, reporter, |_| Ok(()))
}

/// As [`prepare`], where `may_begin` agrees with what is expected of it; it is asked where the site has a budget and nothing is finished yet.
pub(crate) fn prepare_where(
    plan: &Plan,
    settings: &Prepare,
    looks: Option<&Path>,
    reporter: &dyn Reporter,
    may_begin: impl FnOnce(&PrepareEstimate) -> Result<(), BakeError>,
) -> Result<Prepared, BakeError> {
    // several runs may have it open, but one at a time makes the geometry, and the others find it; without locks all make the same
    let cache = Cache::join(&plan.cache_root(), &geometry_key(plan, settings), &plan.owner())?;
    let pieces = Pieces::new(Some(&cache), looks.is_none(), reporter);
    let (site, files) = (&plan.site, &plan.files);
    if looks.is_some() && pieces.has(FINISHED) {
        reporter.note("coloured meshes need every step: what an earlier run has left is not used");
    }
    let prepared = match take_finished(&pieces, reporter) {
        Some(finished) => finished,
        None => {
            let mut waited = false;
            let _making = cache.lock(MAKING, || {
                waited = true;
                reporter.note("another run prepares the same geometry: waiting for it");
            })?;
            let of_another = if waited { take_finished(&pieces, reporter) } else { None };
            match of_another {
                Some(finished) => finished,
                None => {
                    if !plan.options.no_cache {
                        cache.adopt_where(|stage| stage.starts_with(PART))?;
                    }
                    let means = within_budget(plan, settings, reporter, may_begin)?;
                    let parts = (0..site.parts.len()).map(|part| part_digest(plan, settings, part)).collect();
                    let (views, looks) = (views(site), Looks::new(site, looks));
                    let work = Work { plan, site, files, settings, views, looks, pieces, parts, reporter };
                    let prepared = means.run(|| make(&work))?;
                    work.pieces.keep(FINISHED, &[], &prepared)?;
                    // who makes it is alone with it
                    [PIECE, PART].iter().for_each(|begin| cache.remove_begun(begin));
                    cache.remove_unused(PART, &work.pieces.asked());
                    cache.remove_others(GEOMETRY, &plan.owner());
                    prepared
                }
            }
        }
    };
    cache.remove_blocks(PIECE);
    if plan.options.no_cache {
        cache.remove_blocks(PART);
    }
    prepared.scene.warnings.iter().for_each(|warning| reporter.warning(warning));
    Ok(prepared)
}

/// The file that is locked by whoever makes the geometry.
const MAKING: &str = "making";

/// The whole geometry, if an earlier run has left it.
fn take_finished(pieces: &Pieces, reporter: &dyn Reporter) -> Option<Prepared> {
    let finished = pieces.take(FINISHED, &[])?;
    reporter.note("going on: the geometry is prepared");
    Some(finished)
}

/// The threads that preparation may use within the site's budget.
fn within_budget(
    plan: &Plan,
    settings: &Prepare,
    reporter: &dyn Reporter,
    may_begin: impl FnOnce(&PrepareEstimate) -> Result<(), BakeError>,
) -> Result<Means, BakeError> {
    let (budget, threads) = (plan.site.budget.bake_bytes(), rayon::current_num_threads());
    if budget.is_none() {
        return Ok(Means { threads, kept: 0 });
    }
    let expected = estimate(plan, settings, reporter)?;
    let means = preparation_need(&expected).within("preparation", budget, threads)?;
    may_begin(&expected)?;
    if means.threads < threads {
        reporter.note(&format!("preparation stays within [budget] with {} of {threads} threads", means.threads));
    }
    Ok(means)
}

impl Work<'_> {
    /// Whether what nobody sees is dropped.
    fn purges(&self) -> bool {
        self.settings.purge && !self.views.cells.is_empty()
    }
}

fn make(work: &Work) -> Result<Prepared, BakeError> {
    let count = work.site.parts.len();
    let begun = if work.looks.wanted() {
        0
    } else {
        (0..count).filter(|&part| work.pieces.has(&lasting_name(work, part, "whole"))).count()
    };
    if begun > 0 {
        let purged = if work.pieces.has(&purge_name()) { ", and what nobody sees is known" } else { "" };
        work.reporter.note(&format!("going on: preparation has read {begun} of {count} parts{purged}"));
    }
    let mut wholes = (0..count).map(|index| whole_part(work, index)).collect::<Result<Vec<_>, _>>()?;
    let (borders, steps) = borders(work, &mut wholes)?;
    let (mut original, mut warnings) = (Original::default(), Vec::new());
    let (mut meshes, mut ends) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let (mut report, mut looks) = (PrepareReport { steps, ..PrepareReport::default() }, Vec::with_capacity(count));
    for (mut whole, border) in wholes.into_iter().zip(&borders) {
        let first = original.positions.len();
        warnings.append(&mut whole.warnings);
        let (mesh, of_part) = prepare_part(work, whole, border, &mut original, &mut looks)?;
        if let (true, Some(look)) = (work.settings.shows_original(), looks.last()) {
            original.looks.append(look, original.positions.len() - first);
            original.colored.push(u8::from(!look.colors.is_empty()));
        }
        meshes.push(mesh);
        ends.push((original.positions.len(), original.triangles.len()));
        report.parts.push(of_part);
    }
    warnings.extend(empty_parts(work, &report)?);
    warnings.extend(small_parts(work, &meshes));
    let vertex_ends: Vec<usize> = ends.iter().map(|end| end.0).collect();
    let grained = report
        .parts
        .iter()
        .zip(&work.site.parts)
        .map(|(of_part, part)| Grained { is_ground: part.role == Role::Ground, times_split: of_part.times_split });
    let (params, mut steps) = fit(work, &mut meshes, (grained.collect(), &borders), &original.positions, &vertex_ends)?;
    report.steps.append(&mut steps);
    for (of_part, params) in report.parts.iter_mut().zip(&params) {
        of_part.tell_limits(work.settings, params, !work.views.cells.is_empty());
    }
    let (mut keep, is_seen) = match seen(work, &meshes)? {
        Some(mut seen) => {
            report.steps.append(&mut seen.steps);
            report.purge = Some(seen.report);
            (seen.keep, seen.seen)
        }
        None => (vec![true; meshes.iter().map(|mesh| mesh.triangles.len()).sum()], Vec::new()),
    };
    warnings.extend(bury(work, &meshes, (&mut keep, &is_seen), &mut report)?);
    let (mut parts, mut begin) = (Vec::with_capacity(count), (0, 0));
    for (index, ((mesh, end), of_part)) in meshes.into_iter().zip(ends).zip(&mut report.parts).enumerate() {
        let as_scanned = Mesh {
            positions: original.positions[begin.0..end.0].to_vec(),
            triangles: original.triangles[begin.1..end.1].iter().map(|t| t.map(|v| v - begin.0 as u32)).collect(),
            ..Mesh::default()
        };
        parts.push(compare(work, &borders[index].digest, (&as_scanned, &looks[index]), mesh, &params[index], of_part)?);
        begin = end;
    }
    let reduced = reduce(work, parts, &keep, &params, &mut report)?;
    if let Some(purge) = &report.purge {
        warnings.extend(room_doubts(&work.site.rooms, purge));
        warnings.extend(purge_doubts(&work.site.rooms, purge, &purge_params(work.settings)));
    }
    let by_texels = report.parts.iter().map(|part| part.by_texels).collect();
    let mut scene = join((reduced, by_texels), original, work.files, warnings)?;
    report.count(&scene);
    scene.warnings.extend(number_doubt(work, report.triangles_drawn));
    scene.prepared = Some(report.lineage());
    Ok(Prepared { scene, report })
}

/// Puts the parts together into one mesh.
fn join(
    (parts, by_texels): (Vec<Reduced>, Vec<bool>),
    mut original: Original,
    files: &[InputFile],
    warnings: Vec<String>,
) -> Result<Scene, BakeError> {
    let mut scene = Scene { mesh: Mesh::default(), parts: Vec::new(), warnings, original: None, prepared: None };
    for ((index, part), by_texels) in parts.into_iter().enumerate().zip(by_texels) {
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
            by_texels,
        });
    }
    scene.original = Some(original);
    Ok(scene)
}

#[cfg(test)]
mod tests;
