//! One part: from its files to what the display can show of it.

use super::Work;
use super::arrays::{Reader, Writer, textures_of};
use super::borders::Border;
use super::buried::has_solids;
use super::halfway::{HalfMapped, Halfway};
use super::pieces::{PART, PIECE, Piece};
use super::steps::{Step, Steps};
use super::surfacing::Surfacing;
use crate::cache::CacheError;
use crate::error::BakeError;
use crate::key::Digest;
use crate::scene::Original;
use crate::texels::Choice;
use glam::Vec3;
use heliodon_bundle::site::{self, InputKind, Prepare, Role, Winding};
use heliodon_mesh::import::ImportReport;
use heliodon_mesh::{Mesh, MeshError};
use heliodon_prepare::borders::BorderReport;
use heliodon_prepare::clean::{self, CleanParams, CleanReport, Finding, TJunctions};
use heliodon_prepare::simplify::{
    Averages, COARSEST_EDGE, MeasureReport, SimplifyParams, SimplifyReport, averages, measure_resuming,
    nearest_triangles_resuming, simplify_resuming,
};
use heliodon_prepare::solids::{SolidsParams, SolidsReport, unite_resuming};
use heliodon_prepare::split::{SplitError, SplitReport, split_telling};
use heliodon_prepare::{Tell, Views};
use serde::{Deserialize, Serialize};

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
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
pub struct PartReport {
    /// Its name.
    pub name: String,
    /// Vertices in its files.
    pub vertices_read: u64,
    /// Triangles in its files.
    pub triangles_read: u64,
    /// Whether it is lit by texels; then no triangle is split for light's sake.
    pub by_texels: bool,
    /// Faults that were found and mended.
    pub clean: Option<CleanReport>,
    /// Solids that were united, and what was buried in them.
    pub solids: Option<SolidsReport>,
    /// Large triangles that were split.
    pub split: Option<SplitReport>,
    /// What it shares with other parts; none where that is nothing.
    pub borders: Option<BorderReport>,
    /// Triangles after cleaning and splitting: what rays of light meet.
    pub triangles_original: u64,
    /// What simplification did.
    pub simplify: Option<SimplifyReport>,
    /// By how many times longer than the site says splitting let edges be, so that ground does not become too many triangles; 1 for everything else.
    pub times_split: f64,
    /// The error that was allowed in the end, pixels: as the site says, or more where the number of triangles wanted it; 0 without rooms.
    pub error_px: f64,
    /// The edge that was allowed in the end, pixels: of splitting or of simplification, whichever is longer; 0 without rooms.
    pub edge_px: f64,
    /// As `error_px` of a site without rooms, metres; 0 with any.
    pub error_m: f64,
    /// As `edge_px` of a site without rooms, metres; 0 with any.
    pub edge_m: f64,
    /// How far the result is off the original.
    pub error: Option<MeasureReport>,
    /// What is not drawn since it lies within solids of all parts together, or between two that touch.
    pub buried: Finding,
    /// Triangles that are drawn.
    pub triangles_drawn: u64,
    /// Triangles that are not drawn and hold the light that they reflect.
    pub triangles_hidden: u64,
    /// What its steps took, in order.
    pub steps: Vec<Step>,
}

/// How the site wants stone simplified.
pub(super) fn simplify_params(settings: &Prepare) -> SimplifyParams {
    let [error_px, error_m] = [settings.error_px, settings.error_m.unwrap_or(0.0)].map(|error| error as f32);
    // where nothing is said of edges the error alone decides
    let edge = |asked: f64, error: f32| if asked > 0.0 { asked as f32 } else { COARSEST_EDGE * error };
    SimplifyParams {
        error_px,
        edge_px: edge(settings.edge_px, error_px),
        nearest_m: settings.nearest_m as f32,
        error_m,
        edge_m: edge(asked_edge_m(settings), error_m),
        ..SimplifyParams::screen()
    }
}

/// How long edges may be where there are no rooms, metres; 0 where nothing is said.
fn asked_edge_m(settings: &Prepare) -> f64 {
    settings.edge_m.unwrap_or(0.0)
}

impl PartReport {
    /// Tells with what limits the part was simplified in the end, in a site with or without rooms.
    pub(super) fn tell_limits(&mut self, settings: &Prepare, params: &SimplifyParams, with_rooms: bool) {
        let longer = |asked: f64, simplified: f32| (self.times_split * asked).max(f64::from(simplified));
        if with_rooms {
            (self.error_px, self.edge_px) = (f64::from(params.error_px), longer(settings.edge_px, params.edge_px));
        } else {
            (self.error_m, self.edge_m) = (f64::from(params.error_m), longer(asked_edge_m(settings), params.edge_m));
        }
    }
}

/// Clearances are at most this many times the error that was allowed: where a face without area was dropped, the surface nearest to its tip is
/// another one.
const MOST_CLEARANCE: f32 = 2.0;

/// What a part's pieces are called that depend on the others, too.
pub(super) fn piece_name(part: usize, step: &str) -> String {
    format!("{PIECE}part{part}-{step}")
}

/// What the names of pieces begin with of a part that is not whole yet.
pub(super) fn halfway_name(part: usize) -> String {
    piece_name(part, "halfway")
}

/// What pieces of a part are called that depend on that part alone.
pub(super) fn lasting_name(work: &Work, part: usize, step: &str) -> String {
    lasting(&work.parts[part], step)
}

/// What pieces are called that depend on what is in this digest alone.
fn lasting(digest: &Digest, step: &str) -> String {
    format!("{PART}{}-{step}", digest.digits())
}

/// What the names of pieces begin with that are gone when what they lead to is kept, which is decided by this digest.
fn passing(digest: &Digest) -> String {
    format!("{PIECE}{}-", digest.digits())
}

/// A part as rays meet it.
pub(super) struct Whole {
    pub mesh: Mesh,
    /// What was left out or looked odd in its files.
    pub warnings: Vec<String>,
    pub report: PartReport,
}

/// A part as the display shows it.
struct Simple {
    mesh: Mesh,
    report: PartReport,
}

/// What stands for a part's original.
struct Mapped {
    stands_for: Vec<u32>,
    clearance_m: Vec<f32>,
    averages: Averages,
    error: MeasureReport,
    steps: Vec<Step>,
}

/// Reads, cleans and splits a part.
///
/// # Errors
/// Files that cannot be read, or more triangles than splitting may make.
pub(super) fn whole_part(work: &Work, index: usize) -> Result<Whole, BakeError> {
    let whole = work.pieces.kept_or(&lasting_name(work, index, "whole"), &[], || make_whole(work, index))?;
    work.pieces.remove(&halfway_name(index));
    Ok(whole)
}

/// Simplifies a part; what rays will meet of it is added to `original`, what it looks like to `looks`. Returns what is left of it.
///
/// # Errors
/// More vertices over all parts than an index counts, and a cache that cannot be written.
pub(super) fn prepare_part(
    work: &Work,
    whole: Whole,
    border: &Border,
    original: &mut Original,
    looks: &mut Vec<Surfacing>,
) -> Result<(Mesh, PartReport), BakeError> {
    push_original(original, &whole.mesh)?;
    let is_simplified = simplifies(&simplify_params(work.settings), &work.views);
    let is_looked_at = is_simplified || work.settings.shows_original();
    looks.push(if is_looked_at { Surfacing::new(&whole.mesh) } else { Surfacing::default() });
    if !is_simplified {
        return Ok((whole.mesh, whole.report));
    }
    let textures = textures_of(&whole.mesh.materials);
    // what was found of borders is this run's, also where nothing of it changes the part
    let borders = whole.report.borders;
    let make = || Ok(make_simple(work, &whole.mesh, border, whole.report));
    let Simple { mesh, mut report } = work.pieces.kept_or(&lasting(&border.digest, "simple"), &textures, make)?;
    work.pieces.remove(&passing(&border.digest));
    report.borders = borders;
    Ok((mesh, report))
}

/// Whether anything is simplified.
pub(super) fn simplifies(params: &SimplifyParams, views: &Views) -> bool {
    (if views.cells.is_empty() { params.error_m } else { params.error_px }) > 0.0
}

/// How what is left of a part, simplified with `params`, belongs to its original. `digest` has what decided the part so far.
///
/// # Errors
/// A cache that cannot be written.
pub(super) fn compare(
    work: &Work,
    digest: &Digest,
    (original, looks): (&Mesh, &Surfacing),
    mut mesh: Mesh,
    params: &SimplifyParams,
    report: &mut PartReport,
) -> Result<Part, BakeError> {
    if !simplifies(params, &work.views) {
        let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len() as u32);
        return Ok(Part { mesh, stands_for: (0..triangles).collect(), clearance_m: vec![0.0; vertices] });
    }
    let mut digest = digest.clone();
    digest.run(format!("{params:?}").as_bytes());
    digest.run(bytemuck::cast_slice(&mesh.positions));
    digest.run(bytemuck::cast_slice(&mesh.triangles));
    let make = || Ok(make_mapped(work, (original, looks), &mesh, params, &digest));
    let mut mapped = work.pieces.kept_or(&lasting(&digest, "mapped"), &[], make)?;
    work.pieces.remove(&passing(&digest));
    report.error = Some(mapped.error);
    report.steps.append(&mut mapped.steps);
    if let Some(simplify) = &mut report.simplify {
        (simplify.triangles_after, simplify.vertices_after) = (mesh.triangles.len(), mesh.positions.len());
    }
    (mesh.colors_linear, mesh.normals) = (mapped.averages.colors_linear, mapped.averages.normals);
    Ok(Part { mesh, stands_for: mapped.stands_for, clearance_m: mapped.clearance_m })
}

/// The triangles of a mesh, as steps count them.
pub(super) fn count(mesh: &Mesh) -> u64 {
    mesh.triangles.len() as u64
}

/// Takes the names of materials away where no detail goes by them: simplification keeps the borders of materials of different names.
pub(super) fn forget_names(part: &site::Part, mesh: &mut Mesh) {
    if !part.has_material_details() {
        mesh.materials.iter_mut().for_each(|material| material.name.clear());
    }
}

/// Reads a part's files.
fn read(work: &Work, index: usize) -> Result<Halfway, BakeError> {
    let Work { plan, site, files, .. } = work;
    let (mut steps, mut import) = (Steps::new(work.reporter), ImportReport::default());
    let bytes = crate::scene::part_bytes(files, index);
    let mut mesh = steps.run("reading", bytes, |tell| {
        crate::scene::read_part(site, files, index, &mut import, &|read| tell.done(read as f64 / bytes.max(1) as f64))
    })?;
    let of_part = |kind: InputKind| kind.mesh_part() == Some(index);
    // it will be kept under the hash that the file had before
    plan.check_unchanged(of_part)?;
    let part = &site.parts[index];
    let report = PartReport {
        name: part.display_name(),
        vertices_read: mesh.positions.len() as u64,
        triangles_read: mesh.triangles.len() as u64,
        by_texels: Choice::of(site, index).is_texels(&site.rooms, &mesh.positions, &mesh.triangles),
        steps: steps.taken,
        ..PartReport::default()
    };
    forget_names(part, &mut mesh);
    Ok(Halfway { mesh, warnings: import.warnings, report, ..Halfway::default() })
}

/// Reads, cleans and splits.
fn make_whole(work: &Work, index: usize) -> Result<Whole, BakeError> {
    let Work { site, settings, views, looks, .. } = work;
    let part = &site.parts[index];
    let milestones = Halfway::milestones(work, index);
    let mut half = match milestones.last::<Halfway>() {
        Some(half) => half,
        None => {
            let read = read(work, index)?;
            read.reached(&milestones);
            read
        }
    };
    if settings.clean && half.report.clean.is_none() {
        let params = clean_params(settings, part.role, views);
        let as_read = looks.wanted().then(|| half.mesh.clone());
        let mut steps = Steps::new(work.reporter);
        steps.run("cleaning", count(&half.mesh), |tell| {
            while half.cleaning.go_on(&mut half.mesh, &params, tell) {
                half.reached(&milestones);
            }
        });
        half.report.steps.append(&mut steps.taken);
        let found = std::mem::take(&mut half.cleaning.report);
        if let Some(as_read) = as_read {
            looks.found(index, &as_read, &found)?;
        }
        half.report.clean = Some(found);
        half.reached(&milestones);
    }
    if settings.solids && has_solids(part.role) && half.report.solids.is_none() {
        let params = SolidsParams { eyes: eyes(views), ..SolidsParams::default() };
        let before = looks.wanted().then(|| half.mesh.clone());
        let mut steps = Steps::new(work.reporter);
        let interim = work.pieces.interim(halfway_name(index) + "united");
        let triangles = count(&half.mesh);
        let unite = |tell: Tell| unite_resuming(&mut half.mesh, &params, (&interim, tell));
        let found = steps.run("uniting solids", triangles, unite);
        half.report.steps.append(&mut steps.taken);
        if let Some(before) = before {
            looks.united(index, &before, &found)?;
        }
        half.report.solids = Some(found);
        half.reached(&milestones);
    }
    let Halfway { mut mesh, warnings, mut report, .. } = half;
    // texels have the grain of shadows, whatever the triangles are
    let (split, times) = if report.by_texels {
        (None, 1.0)
    } else {
        let mut steps = Steps::new(work.reporter);
        let splitting = |tell: Tell| split_coarse(&mut mesh, part.role, settings, views, tell);
        let split = steps.run("splitting", report.triangles_read, splitting)?;
        report.steps.append(&mut steps.taken);
        split
    };
    (report.split, report.times_split) = (split, f64::from(times));
    report.triangles_original = mesh.triangles.len() as u64;
    Ok(Whole { mesh, warnings, report })
}

/// How finely splitting splits a part.
pub(super) struct Grain<'a> {
    params: SimplifyParams,
    views: &'a Views,
    /// The most triangles that a ground is split into before it is split less finely; none for what is not, and where rooms have windows.
    most: Option<usize>,
}

impl<'a> Grain<'a> {
    /// Of a part of so many triangles; none where nothing is split.
    pub fn new(triangles: usize, role: Role, settings: &Prepare, views: &'a Views) -> Option<Self> {
        let asked = if views.cells.is_empty() { asked_edge_m(settings) } else { settings.edge_px };
        if asked <= 0.0 {
            return None;
        }
        let grain = Self { params: simplify_params(settings), views, most: None };
        // what the number of triangles takes away again need not be made; through windows little of it may be seen
        let around = !views.cells.is_empty() && views.cells.iter().all(|cell| cell.windows.is_empty());
        let wanted = usize::try_from(settings.triangles).unwrap_or(usize::MAX);
        let limited = role == Role::Ground && around && wanted > 0;
        let most = limited.then(|| wanted.saturating_mul(MOST_SPLIT_GROUND).max(2 * triangles).min(MOST_TRIANGLES));
        Some(Self { most, ..grain })
    }

    fn target_m(&self, place: Vec3) -> f32 {
        let Self { params, views, .. } = self;
        if views.cells.is_empty() { params.edge_m } else { params.edge_px * views.pixel_m(place, params.nearest_m) }
    }

    /// The longest that an edge at a place may be, along a direction.
    pub fn longest_m(&self, place: Vec3, along: Vec3) -> f32 {
        // an edge that runs towards the eye shows little of its length
        LONGEST_EDGE * self.target_m(place) / self.views.across(place, along).max(LEAST_ACROSS)
    }

    /// Splits a mesh with `try_split`, which is told how many times longer edges may be and how many triangles may come of it; longer and longer ones
    /// where too many would. Answers with that number of times.
    pub fn fit<T>(&self, mut try_split: impl FnMut(f32, usize) -> Result<T, SplitError>) -> Result<(T, f32), SplitError> {
        let mut times = 1.0;
        if let Some(most) = self.most {
            while times < LONGEST_GROUND {
                if let Ok(split) = try_split(times, most) {
                    return Ok((split, times));
                }
                times *= std::f32::consts::SQRT_2;
            }
        }
        Ok((try_split(times, MOST_TRIANGLES)?, times))
    }
}

/// Splits edges that are longer than light is to be grained: modelled walls of two triangles, and scans that were thinned out before, whose long
/// triangles would carry the light of corners that lie inside of other stones. Tells as well how many times longer than asked for edges may be.
fn split_coarse(
    mesh: &mut Mesh,
    role: Role,
    settings: &Prepare,
    views: &Views,
    tell: Tell,
) -> Result<(Option<SplitReport>, f32), SplitError> {
    let Some(grain) = Grain::new(mesh.triangles.len(), role, settings, views) else { return Ok((None, 1.0)) };
    let (report, times) =
        grain.fit(|times, most| split_telling(mesh, |place, along| times * grain.longest_m(place, along), most, tell))?;
    Ok((Some(report), times))
}

/// How far simplification may depart from the original, metres.
fn error_m(work: &Work, params: &SimplifyParams, place: Vec3) -> f32 {
    if work.views.cells.is_empty() { params.error_m } else { params.error_px * work.views.pixel_m(place, params.nearest_m) }
}

fn make_simple(work: &Work, whole: &Mesh, border: &Border, mut report: PartReport) -> Simple {
    let (mut steps, params) = (Steps::new(work.reporter), simplify_params(work.settings));
    let interim = work.pieces.interim(passing(&border.digest) + "simplifying");
    let simplify = |tell: Tell| simplify_resuming(whole, &border.held, &work.views, &params, (&interim, tell));
    let simplified = steps.run("simplifying", count(whole), simplify);
    report.simplify = Some(simplified.report);
    report.steps.append(&mut steps.taken);
    Simple { mesh: simplified.mesh, report }
}

fn make_mapped(
    work: &Work,
    (original, looks): (&Mesh, &Surfacing),
    simple: &Mesh,
    params: &SimplifyParams,
    digest: &Digest,
) -> Mapped {
    let milestones = work.pieces.milestones(passing(digest) + "mapped", HalfMapped::STAGES);
    let mut half: HalfMapped = milestones.last().unwrap_or_default();
    let mut steps = Steps::new(work.reporter);
    if half.clearance_m.is_empty() {
        let interim = work.pieces.interim(passing(digest) + "measured");
        let measure = |tell: Tell| measure_resuming(original, simple, &work.views, params, (&interim, tell));
        let measured = steps.run("measuring", count(original), measure);
        let most = |place| MOST_CLEARANCE * error_m(work, params, place);
        half.clearance_m = simple.positions.iter().zip(measured.clearance_m).map(|(&p, c)| c.min(most(p))).collect();
        half.error = measured.report;
        half.steps.append(&mut steps.taken);
        milestones.reached(1, &half);
    }
    if half.stands_for.is_empty() {
        let interim = work.pieces.interim(passing(digest) + "nearest");
        let map = |tell: Tell| nearest_triangles_resuming(original, simple, &work.views, params, (&interim, tell));
        half.stands_for = steps.run("mapping", count(original), map).triangle;
        half.steps.append(&mut steps.taken);
        milestones.reached(2, &half);
    }
    let average = |_: Tell| averages(original, |vertex| looks.of(vertex), simple, &half.stands_for);
    let averages = steps.run("averaging", count(original), average);
    half.steps.append(&mut steps.taken);
    let HalfMapped { error, clearance_m, stands_for, steps } = half;
    Mapped { stands_for, clearance_m, averages, error, steps }
}

impl Piece for Whole {
    fn write(&self, into: &mut Writer) -> Result<(), CacheError> {
        into.mesh("mesh", &self.mesh)?;
        into.told(&self.warnings);
        into.told(&self.report);
        Ok(())
    }

    fn read(from: &mut Reader) -> Option<Self> {
        Some(Self { mesh: from.mesh("mesh")?, warnings: from.told()?, report: from.told()? })
    }
}

impl Piece for Simple {
    fn write(&self, into: &mut Writer) -> Result<(), CacheError> {
        into.mesh("mesh", &self.mesh)?;
        into.told(&self.report);
        Ok(())
    }

    fn read(from: &mut Reader) -> Option<Self> {
        Some(Self { mesh: from.mesh("mesh")?, report: from.told()? })
    }
}

impl Piece for Mapped {
    fn write(&self, into: &mut Writer) -> Result<(), CacheError> {
        into.array("stands-for", &self.stands_for)?;
        into.array("clearance", &self.clearance_m)?;
        into.array("colors", &self.averages.colors_linear)?;
        into.array("normals", &self.averages.normals)?;
        into.told(&self.error);
        into.told(&self.steps);
        Ok(())
    }

    fn read(from: &mut Reader) -> Option<Self> {
        let (stands_for, clearance_m) = (from.array("stands-for")?, from.array("clearance")?);
        let averages = Averages { colors_linear: from.array("colors")?, normals: from.array("normals")? };
        Some(Self { stands_for, clearance_m, averages, error: from.told()?, steps: from.told()? })
    }
}

/// Edges are split that are longer than simplification lets them become: half as long again as what is asked for.
const LONGEST_EDGE: f32 = 1.5;
/// The least part of its length that an edge is taken to show.
const LEAST_ACROSS: f32 = 1.0 / 16.0;

/// No edge of ground may be longer than this many times what is asked for, whatever its triangles come to.
const LONGEST_GROUND: f32 = 100.0;
/// Ground is split to so many times the triangles that are wanted of all parts at most: simplification still finds the better ones of them.
const MOST_SPLIT_GROUND: usize = 4;
/// The most triangles that splitting may make of a part.
pub(super) const MOST_TRIANGLES: usize = 200_000_000;

pub(super) fn clean_params(settings: &Prepare, role: Role, views: &Views) -> CleanParams {
    let of_role = if role == Role::Scan { CleanParams::default() } else { CleanParams::modelled() };
    CleanParams {
        weld_m: of_role.weld_m.max(settings.weld_m as f32),
        isolated_m: settings.isolated_m as f32,
        winding: match settings.winding {
            Winding::Mend => clean::Winding::Mend,
            Winding::Report => clean::Winding::Report,
        },
        // another look at all edges, which tens of millions of triangles of ground are not worth
        t_junctions: if has_solids(role) { of_role.t_junctions } else { TJunctions::Report },
        eyes: eyes(views),
        ..of_role
    }
}

/// A place in each room.
pub(super) fn eyes(views: &Views) -> Vec<Vec3> {
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
