//! What preparation will cost, before any of it is begun.
//!
//! Every part is read once (a hundredth of the whole), a few patches of it are split and simplified as the site wants it, in rounds too, and timed; the
//! rest is reckoned. What each step costs for a triangle beside simplification was measured of the procedural temple (BENCHMARKS.md), on the machine
//! and in the run that measured simplification: machines differ by the same factor in all of them, nearly.

use super::arrays::index_of;
use super::buried::has_solids;
use super::dropped::purge_params;
use super::fit::MOST_ROUNDS;
use super::kept::{FINISHED, geometry_key};
use super::limits::{Grained, Limits};
use super::part::{Grain, forget_names, simplifies, simplify_params};
use super::patches::{Looked, inner_triangles, look};
use super::views;
use crate::budget::Need;
use crate::cache::has_block;
use crate::error::BakeError;
use crate::plan::Plan;
use crate::report::Reporter;
use crate::scene;
use crate::texels::Choice;
use heliodon_bundle::site::{Prepare, Role};
use heliodon_mesh::Mesh;
use heliodon_mesh::import::ImportReport;
use heliodon_prepare::Views;
use heliodon_prepare::purge::PurgeParams;
use heliodon_prepare::simplify::{SimplifyParams, simplify};
use rayon::prelude::*;
use serde::Serialize;
use std::time::Instant;

/// What preparation will cost on this machine.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PrepareEstimate {
    /// Whether it is done already and kept: then nothing of this is to be done again.
    pub kept: bool,
    /// Triangles in the files.
    pub triangles_read: u64,
    /// About how many triangles rays of light will meet.
    pub triangles_original: u64,
    /// About how many will be drawn.
    pub triangles_drawn: u64,
    /// About how many will not be drawn and hold the light that they reflect.
    pub triangles_hidden: u64,
    /// At about how many vertices light will be solved.
    pub vertices: u64,
    /// Whether any part is lit by texels.
    pub by_texels: bool,
    /// Bytes of what is drawn and what reflects, with its textures.
    pub mesh_bytes: u64,
    /// Bytes of the textures, each a pixel's four.
    pub texture_bytes: u64,
    /// Bytes of the largest of them.
    pub largest_texture_bytes: u64,
    /// Step after step, each over all parts.
    pub steps: Vec<StepEstimate>,
    /// Seconds of all steps.
    pub seconds: f64,
    /// The most memory at once.
    pub memory_bytes: u64,
    /// The most room that kept work takes on disk; what is left of it in the end is less.
    pub cache_bytes: u64,
}

/// What a step will cost.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StepEstimate {
    /// What is done.
    pub name: String,
    /// How often, for those that may have to be repeated.
    pub times: u32,
    /// Seconds of all of them.
    pub seconds: f64,
    /// The most memory that the process will have taken in it.
    pub memory_bytes: u64,
    /// What is kept on disk after it.
    pub cache_bytes: u64,
}

/// What steps take for a triangle, over what simplification takes for one.
mod times {
    pub(super) const CLEAN: f64 = 1.1;
    pub(super) const UNITE: f64 = 14.0;
    /// Of each triangle that is made.
    pub(super) const SPLIT: f64 = 1.4;
    /// Of each triangle, where there are several parts: 4.8 s of 12.7 million beside 13 s of simplifying 9.5.
    pub(super) const BORDERS: f64 = 0.28;
    pub(super) const MEASURE: f64 = 0.9;
    pub(super) const MAP: f64 = 0.68;
    pub(super) const AVERAGE: f64 = 0.4;
    /// Of the hierarchy and what does not depend on the number of rooms; of each room.
    pub(super) const PURGE: f64 = 2.0;
    pub(super) const PURGE_ROOM: f64 = 2.0;
    /// Of a ray of the check, and the item buffers that come with it.
    pub(super) const RAY: f64 = 1.1;
    /// Of a place of the original that is asked where it lies on what was simplified before, for each triangle of the original: a guess so far.
    pub(super) const WITNESS: f64 = 0.4;
    /// Of what nobody sees: simplified, mapped and measured once more.
    pub(super) const HIDE: f64 = 2.6;
}

/// Bytes that steps take at once for each triangle, beside meshes.
mod bytes {
    pub(super) const CLEAN: f64 = 46.0;
    pub(super) const UNITE: f64 = 200.0;
    /// Of each triangle that splitting makes.
    pub(super) const SPLIT: f64 = 60.0;
    /// Of each triangle, where there are several parts: places that they may have in common, by their vertices. Reckoned from
    /// what is allocated, not measured.
    pub(super) const BORDERS: f64 = 26.0;
    pub(super) const SIMPLIFY: f64 = 48.0;
    /// Of each that the purge is asked for, its hierarchy, and the meshes that it is asked for.
    pub(super) const PURGE: f64 = 235.0;
    /// Of the original's surface, when it is asked for what is nearest.
    pub(super) const SURFACE: f64 = 60.0;
    /// Of the original, which rays of light meet: two triangles share a vertex.
    pub(super) const ORIGINAL: f64 = 18.0;
    /// Of the original, whose vertices' colours and normals are kept until they are averaged, and of what is left, of which each has its sums.
    pub(super) const LOOK: f64 = 6.0;
    pub(super) const SUMS: f64 = 96.0;
    /// Of each vertex that is left.
    pub(super) const AVERAGES: f64 = 24.0;
    /// Of a triangle of a tile that is simplified, and of a whole one of 131,072; and of how many at once the figures above hold.
    pub(super) const TILED: u64 = 200;
    pub(super) const TILE: u64 = TILED << 17;
    pub(super) const TIMED_THREADS: u64 = 2;
    /// What the program takes without any work.
    pub(super) const PROGRAM: f64 = 10e6;
}

/// The part of what is simplified that is seen from a room: 0.62 to 0.71 of the procedural temple.
const SEEN: f64 = 0.66;
/// How many times fewer triangles what nobody sees has once it is simplified further: 2.3 to 3 of the temple.
const HIDDEN_FEWER: f64 = 2.7;
/// Vertices of each triangle that is left: neighbours share them, but for rims and seams. 0.55 to 0.59 of the temple.
const VERTICES_A_TRIANGLE: f64 = 0.57;

/// Whether the geometry was prepared before with the same files and settings, and is kept.
pub(crate) fn is_prepared(plan: &Plan, settings: &Prepare) -> bool {
    let folder = plan.cache_root().join(geometry_key(plan, settings));
    has_block(&folder, &index_of(FINISHED), 0)
}

/// Looks at every part and reckons; `each` is handed every part's mesh as it was read.
///
/// # Errors
/// Files that cannot be read.
pub(crate) fn estimate_with(
    plan: &Plan,
    settings: &Prepare,
    reporter: &dyn Reporter,
    mut each: impl FnMut(usize, &Mesh, &Views) -> Result<(), BakeError>,
) -> Result<PrepareEstimate, BakeError> {
    let (site, files, views) = (&plan.site, &plan.files, views(&plan.site));
    let params = simplify_params(settings);
    let total = (0..site.parts.len()).map(|part| scene::part_bytes(files, part)).sum();
    reporter.stage("looking at the parts", total);
    let (mut looked, mut done, mut any_texels) = (Vec::new(), 0, false);
    for (index, part) in site.parts.iter().enumerate() {
        let begun = Instant::now();
        let tell = |read| reporter.progress(done + read);
        let mut mesh = scene::read_part(site, files, index, &mut ImportReport::default(), &tell)?;
        forget_names(part, &mut mesh);
        let reading_s = begun.elapsed().as_secs_f64();
        let file_bytes = scene::part_bytes(files, index);
        done += file_bytes;
        let unites = settings.solids && has_solids(part.role);
        let by_texels = Choice::of(site, index).is_texels(&site.rooms, &mesh.positions, &mesh.triangles);
        any_texels |= by_texels;
        let grain = Grain::new(mesh.triangles.len(), part.role, settings, &views).filter(|_| !by_texels);
        let is_ground = part.role == Role::Ground;
        looked.push(Looked { unites, is_ground, file_bytes, reading_s, ..look(&mesh, grain.as_ref()) });
        each(index, &mesh, &views)?;
    }
    reporter.finished();
    reporter.stage("timing", 0);
    let estimate = Reckoning { settings, views: &views, looked: &looked, steps: Vec::new(), kept: 0.0 }.reckon(&params);
    reporter.finished();
    Ok(PrepareEstimate { by_texels: any_texels, ..estimate })
}

/// What preparation needs, for a budget. Parts are done one after the other anyway; threads work on tiles of one.
pub(crate) fn preparation_need(estimate: &PrepareEstimate) -> Need {
    let all = estimate.memory_bytes;
    let thread = bytes::TILE.min(bytes::TILED * estimate.triangles_original);
    Need { least: all.saturating_sub(bytes::TIMED_THREADS * thread).max(all / 2), thread, kept: 0 }
}

/// What preparing a plan's site will cost.
///
/// # Errors
/// Files that cannot be read.
pub fn estimate(plan: &Plan, settings: &Prepare, reporter: &dyn Reporter) -> Result<PrepareEstimate, BakeError> {
    let kept = is_prepared(plan, settings);
    Ok(PrepareEstimate { kept, ..estimate_with(plan, settings, reporter, |_, _, _| Ok(()))? })
}

/// Bytes of a part as rays meet it, with its textures.
fn whole(part: &Looked) -> f64 {
    part.mesh_bytes(part.original) + part.texture_bytes
}

struct Reckoning<'a> {
    settings: &'a Prepare,
    views: &'a Views,
    looked: &'a [Looked],
    steps: Vec<StepEstimate>,
    /// Bytes on disk so far.
    kept: f64,
}

impl Reckoning<'_> {
    /// Triangles of each part that are left with its `params`, and what simplification took for a triangle.
    fn simplified(&self, params: &[SimplifyParams]) -> (Vec<f64>, f64) {
        let begun = Instant::now();
        let patches: Vec<(usize, &Mesh)> = self
            .looked
            .iter()
            .enumerate()
            .flat_map(|(part, looked)| looked.patches.iter().map(move |patch| (part, patch)))
            .collect();
        let made: Vec<f64> = patches
            .par_iter()
            .map(|(part, patch)| inner_triangles(&simplify(patch, self.views, &params[*part]).mesh))
            .collect();
        let seconds = begun.elapsed().as_secs_f64();
        let triangles: usize = patches.iter().map(|(_, patch)| patch.triangles.len()).sum();
        let left = |part: usize| {
            let before: f64 = self.looked[part].patches.iter().map(inner_triangles).sum();
            let of_part = patches.iter().zip(&made).filter(|((of, _), _)| *of == part);
            let after: f64 = of_part.map(|(_, made)| made).sum();
            if before > 0.0 { self.looked[part].original * (after / before).min(1.0) } else { 0.0 }
        };
        ((0..self.looked.len()).map(left).collect(), seconds / triangles.max(1) as f64)
    }

    fn step(&mut self, name: &str, times: u32, seconds: f64, memory: f64, kept: f64) {
        self.kept += kept;
        self.steps.push(StepEstimate {
            name: name.to_owned(),
            times,
            seconds,
            memory_bytes: (memory + bytes::PROGRAM) as u64,
            cache_bytes: self.kept as u64,
        });
    }

    /// The most that any part takes in a step before borders are compared, beside what is held of those before it.
    fn most_before(&self, of_part: impl Fn(&Looked) -> f64) -> f64 {
        let (mut held, mut most) = (0.0, 0.0_f64);
        for looked in self.looked {
            most = most.max(held + of_part(looked));
            held += whole(looked);
        }
        most
    }

    /// The most that any part takes in a step after it, beside those to come and what is held of those before it: their originals and what is left
    /// of them.
    fn most_after(&self, left: &[f64], of_part: impl Fn(&Looked, f64) -> f64) -> f64 {
        let (mut held, mut most): (f64, _) = (self.looked.iter().map(whole).sum(), 0.0_f64);
        for (looked, &left) in self.looked.iter().zip(left) {
            held -= whole(looked);
            most = most.max(held + of_part(looked, left));
            held += (bytes::ORIGINAL + bytes::LOOK) * looked.original + looked.mesh_bytes(left) + looked.texture_bytes;
        }
        most
    }

    fn reckon(mut self, params: &SimplifyParams) -> PrepareEstimate {
        let looked = self.looked;
        let sum = |of: &dyn Fn(&Looked) -> f64| looked.iter().map(of).sum::<f64>();
        let (read, original) = (sum(&|part| part.triangles), sum(&|part| part.original));
        let (first, unit) = self.simplified(&vec![params.clone(); looked.len()]);
        let simplifies = simplifies(params, self.views);
        let mut left = if simplifies { first } else { looked.iter().map(|part| part.original).collect() };
        let textures = sum(&|part| part.texture_bytes);

        let memory = self.most_before(|part| part.mesh_bytes(part.triangles) + part.texture_bytes + part.file_bytes as f64);
        self.step("reading", 1, sum(&|part| part.reading_s), memory, 0.0);
        if self.settings.clean {
            let memory =
                self.most_before(|part| part.mesh_bytes(part.triangles) + part.texture_bytes + bytes::CLEAN * part.triangles);
            self.step("cleaning", 1, unit * times::CLEAN * read, memory, 0.0);
        }
        let united = sum(&|part| if part.unites { part.triangles } else { 0.0 });
        if united > 0.0 {
            let memory = self.most_before(|part| {
                let more = if part.unites { bytes::UNITE * part.triangles } else { 0.0 };
                part.mesh_bytes(part.triangles) + part.texture_bytes + more
            });
            self.step("uniting solids", 1, unit * times::UNITE * united, memory, 0.0);
        }
        let made = sum(&|part| part.original - part.triangles);
        if made > 0.0 {
            let memory = self.most_before(|part| {
                part.mesh_bytes(part.triangles) + whole(part) + bytes::SPLIT * (part.original - part.triangles)
            });
            self.step("splitting", 1, unit * times::SPLIT * made, memory, 0.0);
        }
        self.kept += sum(&whole);
        if looked.len() > 1 {
            let memory = sum(&whole) + bytes::BORDERS * original;
            // what is changed for others is kept once more, at the most all of it
            self.step("comparing borders", 1, unit * times::BORDERS * original, memory, sum(&whole));
        }
        if simplifies {
            let memory = self.most_after(&left, |part, left| {
                bytes::ORIGINAL * part.original + whole(part) + bytes::SIMPLIFY * part.original + part.mesh_bytes(left)
            });
            let kept = self.meshes(&left);
            self.step("simplifying", 1, unit * original, memory, kept);
        }
        let purges = self.settings.purge && !self.views.cells.is_empty();
        let seen = if purges { SEEN } else { 1.0 };
        let looks = if simplifies { bytes::LOOK } else { 0.0 };
        let held = (bytes::ORIGINAL + looks) * original + textures;
        if simplifies && self.settings.triangles > 0 {
            let (mut rounds, mut again_s, mut purge_s) = (0, 0.0, 0.0);
            let grained = looked.iter().map(|part| Grained { is_ground: part.is_ground, times_split: part.times_split });
            let mut limits = Limits::new(params, grained.collect());
            let most: f64 = left.iter().sum();
            for _ in 0..MOST_ROUNDS {
                let triangles: f64 = left.iter().sum();
                purge_s += if purges { unit * self.purge_units(triangles, &PurgeParams::preview()) } else { 0.0 };
                let drawn: Vec<f64> = left.iter().map(|left| seen * left).collect();
                let Some(grown) = limits.grow(&drawn, self.settings.triangles as f64) else { break };
                // every place of the original is asked where it lies on what is left
                again_s += grown.iter().map(|&part| unit * (left[part] + times::WITNESS * looked[part].original)).sum::<f64>();
                rounds += 1;
                left = self.simplified(&limits.params).0;
                self.kept += self.meshes(&left);
            }
            if purges {
                self.step("counting what is seen", rounds + 1, purge_s, held + bytes::PURGE * most, 0.0);
            }
            if rounds > 0 {
                let memory = held + self.meshes(&left) + bytes::SIMPLIFY * most;
                self.step("simplifying to the number wanted", rounds, again_s, memory, 0.0);
            }
        }
        let triangles: f64 = left.iter().sum();
        if purges {
            let seconds = unit * self.purge_units(triangles, &purge_params(self.settings));
            self.step("purging", 1, seconds, held + bytes::PURGE * triangles, triangles);
        }
        let drawn = seen * triangles;
        let hidden = (triangles - drawn) / HIDDEN_FEWER;
        let simple = self.meshes(&left);
        if simplifies {
            let largest = looked.iter().map(|part| part.original).fold(0.0, f64::max);
            let memory = held + simple + (bytes::ORIGINAL + bytes::SURFACE) * largest;
            self.step("measuring", 1, unit * times::MEASURE * original, memory, 0.0);
            self.step("mapping", 1, unit * times::MAP * original, memory, 4.0 * original);
            let sums = held + simple + bytes::ORIGINAL * largest + bytes::SUMS * triangles;
            let kept = bytes::AVERAGES * VERTICES_A_TRIANGLE * triangles;
            self.step("averaging", 1, unit * times::AVERAGE * original, sums, kept);
        }
        let finished = held + 4.0 * original + simple * (drawn + hidden) / triangles.max(1.0);
        if purges {
            let seconds = unit * times::HIDE * (triangles - drawn);
            self.step("simplifying what nobody sees", 1, seconds, finished + simple, simple + 4.0 * original);
        }
        self.kept += finished;
        let steps = self.steps;
        PrepareEstimate {
            kept: false,
            triangles_read: read as u64,
            triangles_original: original as u64,
            triangles_drawn: drawn as u64,
            triangles_hidden: hidden as u64,
            vertices: (VERTICES_A_TRIANGLE * (drawn + hidden)) as u64,
            by_texels: false,
            mesh_bytes: (simple * (drawn + hidden) / triangles.max(1.0) + textures) as u64,
            texture_bytes: textures as u64,
            largest_texture_bytes: looked.iter().map(|part| part.largest_texture_bytes).max().unwrap_or(0),
            seconds: steps.iter().map(|step| step.seconds).sum(),
            memory_bytes: steps.iter().map(|step| step.memory_bytes).max().unwrap_or(0),
            cache_bytes: self.kept as u64,
            steps,
        }
    }

    /// What a purge of so many triangles takes, over what simplifying one does.
    fn purge_units(&self, triangles: f64, params: &PurgeParams) -> f64 {
        let rays = f64::from(params.frames) * f64::from(params.pixels);
        triangles * (times::PURGE + times::PURGE_ROOM * self.views.cells.len() as f64) + times::RAY * rays
    }

    /// Bytes of all parts' meshes over so many triangles each.
    fn meshes(&self, triangles: &[f64]) -> f64 {
        self.looked.iter().zip(triangles).map(|(part, &triangles)| part.mesh_bytes(triangles)).sum()
    }
}
