//! The purge over all parts, and what stands for the light of what is dropped.

use super::Work;
use super::arrays::{Reader, Writer, textures_of};
use super::limits::coarser;
use super::part::{Part, count, piece_name};
use super::pieces::{PIECE, Piece};
use super::report::PrepareReport;
use super::steps::{Step, Steps};
use crate::cache::CacheError;
use crate::error::BakeError;
use glam::Vec3;
use heliodon_bundle::site::{Prepare, PurgeEffort};
use heliodon_mesh::Mesh;
use heliodon_prepare::purge::{PurgeParams, PurgeReport, Purged, Surface, purge_telling};
use heliodon_prepare::simplify::{SimplifyParams, measure_telling, nearest_triangles_telling, simplify_telling};
use heliodon_prepare::{Tell, Views};
use heliodon_rays::{BuildParams, TriangleScene};

/// A part after the purge.
pub(super) struct Reduced {
    /// What is drawn.
    pub drawn: Mesh,
    /// What is not, and holds the light that it reflects.
    pub hidden: Mesh,
    /// For each triangle of the part's original the one that stands for it, those of `hidden` counted after those of `drawn`.
    pub stands_for: Vec<u32>,
    /// For each vertex of `drawn`, then of `hidden`, how far the original departs from the triangles around it, metres.
    pub clearance_m: Vec<f32>,
    /// What that took.
    steps: Vec<Step>,
}

/// What nobody sees is simplified so many times further: it only reflects, and what it reflects is a mean over many square centimetres.
const COARSER: f32 = 4.0;

/// The parts of the time after which what nobody sees is known, simplified, and mapped.
const REDUCED: [f64; 3] = [0.1, 0.5, 0.75];

/// What the purge leaves.
pub(super) struct Seen {
    /// For each triangle of all parts whether it is drawn.
    pub keep: Vec<bool>,
    /// For each whether somebody was found to see it; empty where nothing is known of that.
    pub seen: Vec<bool>,
    pub report: PurgeReport,
    pub steps: Vec<Step>,
}

/// How the site wants to be looked at.
pub(super) fn purge_params(settings: &Prepare) -> PurgeParams {
    let effort = match settings.purge_effort {
        PurgeEffort::Preview => PurgeParams::preview(),
        PurgeEffort::Usual => PurgeParams::default(),
        PurgeEffort::Archival => PurgeParams::archival(),
    };
    PurgeParams { ring: settings.ring, ..effort }
}

/// What the purge's piece is called.
pub(super) fn purge_name() -> String {
    format!("{PIECE}purge")
}

/// Which triangles somebody can see, over all parts in order; none where that is not asked.
///
/// # Errors
/// More geometry than the ray engine holds, or a cache that cannot be written.
pub(super) fn seen(work: &Work, meshes: &[Mesh]) -> Result<Option<Seen>, BakeError> {
    if !work.purges() {
        return Ok(None);
    }
    let params = purge_params(work.settings);
    Ok(Some(work.pieces.kept_or(&purge_name(), &[], || look_around(work, meshes, &params))?))
}

/// Drops from the parts, each simplified with its own of `params`, what nobody sees.
///
/// # Errors
/// A coloured mesh or a cache that cannot be written.
pub(super) fn reduce(
    work: &Work,
    parts: Vec<Part>,
    mut keep: &[bool],
    params: &[SimplifyParams],
    report: &mut PrepareReport,
) -> Result<Vec<Reduced>, BakeError> {
    let mut reduced = Vec::with_capacity(parts.len());
    for (index, part) in parts.into_iter().enumerate() {
        let (of_part, rest) = keep.split_at(part.mesh.triangles.len());
        keep = rest;
        work.looks.kept(index, &part.mesh, of_part)?;
        let (textures, coarse) = (textures_of(&part.mesh.materials), coarser(&params[index], COARSER));
        let make = || {
            let mut steps = Steps::new(work.reporter);
            let made = {
                let total = count(&part.mesh);
                steps.run("simplifying what nobody sees", total, |tell| reduce_part(part, of_part, &work.views, &coarse, tell))
            };
            Ok(Reduced { steps: steps.taken, ..made })
        };
        let mut part: Reduced = work.pieces.kept_or(&piece_name(index, "reduced"), &textures, make)?;
        report.steps.append(&mut part.steps);
        reduced.push(part);
    }
    Ok(reduced)
}

/// The view-cell purge of all parts.
///
/// # Errors
/// More geometry than the ray engine holds.
pub(super) fn look_around(work: &Work, meshes: &[Mesh], params: &PurgeParams) -> Result<Seen, BakeError> {
    let mut steps = Steps::new(work.reporter);
    let (positions, triangles) = all_of(meshes);
    let rays = steps.run("building", 0, |_| TriangleScene::build(&positions, &triangles, &BuildParams::default()))?;
    let surface = Surface { positions: &positions, triangles: &triangles, single_sided: &[] };
    let Purged { keep, seen, report } = {
        let total = triangles.len() as u64;
        steps.run("purging", total, |tell| purge_telling(&rays, &surface, &work.views, params, tell))
    };
    Ok(Seen { keep, seen, report, steps: steps.taken })
}

impl Piece for Seen {
    fn write(&self, into: &mut Writer) -> Result<(), CacheError> {
        let bytes = |flags: &[bool]| flags.iter().map(|&flag| u8::from(flag)).collect::<Vec<_>>();
        into.array("keep", &bytes(&self.keep))?;
        into.array("seen", &bytes(&self.seen))?;
        into.told(&self.report);
        into.told(&self.steps);
        Ok(())
    }

    fn read(from: &mut Reader) -> Option<Self> {
        let mut flags = |name| Some(from.array::<u8>(name)?.into_iter().map(|flag| flag != 0).collect());
        let (keep, seen) = (flags("keep")?, flags("seen")?);
        Some(Self { keep, seen, report: from.told()?, steps: from.told()? })
    }
}

impl Piece for Reduced {
    fn write(&self, into: &mut Writer) -> Result<(), CacheError> {
        into.mesh("drawn", &self.drawn)?;
        into.mesh("hidden", &self.hidden)?;
        into.array("stands-for", &self.stands_for)?;
        into.array("clearance", &self.clearance_m)?;
        into.told(&self.steps);
        Ok(())
    }

    fn read(from: &mut Reader) -> Option<Self> {
        Some(Self {
            drawn: from.mesh("drawn")?,
            hidden: from.mesh("hidden")?,
            stands_for: from.array("stands-for")?,
            clearance_m: from.array("clearance")?,
            steps: from.told()?,
        })
    }
}

/// The places and triangles of all parts.
fn all_of(meshes: &[Mesh]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for mesh in meshes {
        let first = positions.len() as u32;
        positions.extend_from_slice(&mesh.positions);
        triangles.extend(mesh.triangles.iter().map(|t| t.map(|vertex| vertex + first)));
    }
    (positions, triangles)
}

fn reduce_part(part: Part, keep: &[bool], views: &Views, coarse: &SimplifyParams, tell: Tell) -> Reduced {
    let Part { mesh, mut stands_for, clearance_m } = part;
    let which = |kept: bool| -> Vec<u32> { (0..keep.len() as u32).filter(|&t| keep[t as usize] == kept).collect() };
    let (kept, dropped) = (which(true), which(false));
    let (drawn, drawn_vertices) = mesh.with_triangles(&kept);
    let (unseen, unseen_vertices) = mesh.with_triangles(&dropped);
    drop(mesh);
    let mut clearance: Vec<f32> = drawn_vertices.iter().map(|&v| clearance_m[v as usize]).collect();
    // where each triangle from before the purge went
    let mut now = vec![0; keep.len()];
    kept.iter().enumerate().for_each(|(place, &t)| now[t as usize] = place as u32);
    let hidden = if dropped.is_empty() {
        unseen
    } else {
        let [parted, simple, mapped] = REDUCED;
        let simplified = simplify_telling(&unseen, views, coarse, tell.within(parted, simple));
        let nearest = nearest_triangles_telling(&unseen, &simplified.mesh, views, coarse, tell.within(simple, mapped));
        let measured = measure_telling(&unseen, &simplified.mesh, views, coarse, tell.within(mapped, 1.0)).clearance_m;
        let before: Vec<f32> = unseen_vertices.iter().map(|&v| clearance_m[v as usize]).collect();
        let before = carried_over(&before, &unseen, &simplified.mesh, &nearest.triangle);
        clearance.extend(measured.into_iter().zip(before).map(|(measured, before)| measured + before));
        for (&t, place) in dropped.iter().zip(nearest.triangle) {
            now[t as usize] = kept.len() as u32 + place;
        }
        simplified.mesh
    };
    stands_for.iter_mut().for_each(|t| *t = now[*t as usize]);
    Reduced { drawn, hidden, stands_for, clearance_m: clearance, steps: Vec::new() }
}

/// The clearances of a mesh at the vertices of what it was simplified to: the greatest of the triangles for which those around a vertex stand. What departs from these
/// departs by no more than that besides from what they became. Measuring against the scan again would be tighter, and would ask for each of its vertices a second time.
fn carried_over(clearance_m: &[f32], mesh: &Mesh, simplified: &Mesh, stands_for: &[u32]) -> Vec<f32> {
    let mut carried = vec![0.0_f32; simplified.positions.len()];
    for (triangle, &stand_in) in mesh.triangles.iter().zip(stands_for) {
        let most = triangle.iter().map(|&v| clearance_m[v as usize]).fold(0.0, f32::max);
        for &vertex in simplified.triangles.get(stand_in as usize).into_iter().flatten() {
            let carried = &mut carried[vertex as usize];
            *carried = carried.max(most);
        }
    }
    carried
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::random::Pcg32;
    use heliodon_prepare::Screen;
    use heliodon_prepare::simplify::{measure, nearest_triangles, simplify};

    /// Rough ground of 2 m, 160 by 160 squares, its places up to 4 mm off a plane.
    fn rough() -> Mesh {
        const SIDE: u32 = 160;
        let mut random = Pcg32::new(11, 3);
        let mut at = |x: u32, z: u32| 2.0 / SIDE as f32 * Vec3::new(x as f32, random.range_f32(-0.32, 0.32), z as f32);
        let positions = (0..=SIDE).flat_map(|z| (0..=SIDE).map(move |x| (x, z))).map(|(x, z)| at(x, z)).collect();
        let row = SIDE + 1;
        let square = |a: u32| [[a, a + row, a + 1], [a + 1, a + row, a + row + 1]];
        let triangles = (0..SIDE).flat_map(|z| (0..SIDE).flat_map(move |x| square(z * row + x))).collect();
        Mesh { positions, triangles, ..Mesh::default() }
    }

    #[test]
    fn the_purge_looks_as_long_as_the_site_wants() {
        let of = |purge_effort| purge_params(&Prepare { purge_effort, ring: 3, ..Prepare::default() });
        assert_eq!(of(PurgeEffort::Usual), PurgeParams { ring: 3, ..PurgeParams::default() });
        let [preview, usual, archival] = [PurgeEffort::Preview, PurgeEffort::Usual, PurgeEffort::Archival].map(of);
        assert!(preview.frames < usual.frames && usual.frames < archival.frames);
        assert!(preview.wrong_share > usual.wrong_share && usual.wrong_share > archival.wrong_share);
        assert_eq!([preview.ring, archival.ring], [3, 3]);
    }

    #[test]
    fn what_is_simplified_twice_clears_the_scan() {
        let nowhere = Views { cells: Vec::new(), screen: Screen { width_px: 1024, height_px: 768, fov_rad: 1.0 } };
        let scan = rough();
        let params = SimplifyParams { error_m: 0.02, edge_m: 0.1, ..SimplifyParams::screen() };
        let simple = simplify(&scan, &nowhere, &params).mesh;
        assert!(4 * simple.triangles.len() < scan.triangles.len(), "{}", simple.triangles.len());
        let clearance_m = measure(&scan, &simple, &nowhere, &params).clearance_m;
        let stands_for = nearest_triangles(&scan, &simple, &nowhere, &params).triangle;
        let keep = vec![false; simple.triangles.len()];
        // the second time hardly anything may change: only what was lost the first time counts
        let again = SimplifyParams { error_m: 1.0e-4, ..params };
        let part = Part { mesh: simple, stands_for, clearance_m };
        let Reduced { hidden, stands_for, clearance_m, .. } = reduce_part(part, &keep, &nowhere, &again, Tell::NOBODY);
        assert_eq!(clearance_m.len(), hidden.positions.len());
        let off = |p: Vec3, t: u32| {
            let [a, b, c] = hidden.corners(t as usize);
            (p - a).dot((b - a).cross(c - a).normalize_or_zero()).abs()
        };
        let far = scan.triangles.iter().zip(&stands_for).filter(|&(corners, &stand_in)| {
            let clear = hidden.triangles[stand_in as usize].iter().map(|&v| clearance_m[v as usize]).fold(0.0, f32::max);
            corners.iter().any(|&v| off(scan.positions[v as usize], stand_in) > clear + 1.0e-5)
        });
        // planes go on beyond the rims of their triangles, so that a few places lie off them
        let share = far.count() as f64 / scan.triangles.len() as f64;
        assert!(share < 0.05, "{share} of the scan reaches beyond where rays start");
    }
}
