//! The purge over all parts, and what stands for the light of what is dropped.

use super::looks::Looks;
use super::part::Part;
use super::steps::Steps;
use crate::error::BakeError;
use glam::Vec3;
use heliodon_mesh::Mesh;
use heliodon_prepare::Views;
use heliodon_prepare::purge::{PurgeParams, PurgeReport, Surface, purge};
use heliodon_prepare::simplify::{SimplifyParams, measure, nearest_triangles, simplify};
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
}

/// What nobody sees is simplified so many times further: it only reflects, and what it reflects is a mean over many square centimetres.
const COARSER: f32 = 4.0;

/// Which triangles somebody may see, over all parts in order.
///
/// # Errors
/// More geometry than the ray engine holds.
pub(super) fn seen(
    meshes: &[Mesh],
    views: &Views,
    params: &PurgeParams,
    steps: &mut Steps,
) -> Result<(Vec<bool>, PurgeReport), BakeError> {
    let (positions, triangles) = all_of(meshes);
    steps.run("purging", || {
        let rays = TriangleScene::build(&positions, &triangles, &BuildParams::default())?;
        let surface = Surface { positions: &positions, triangles: &triangles, single_sided: &[] };
        let purged = purge(&rays, &surface, views, params);
        Ok((purged.keep, purged.report))
    })
}

/// Drops from the parts what nobody sees; `params` is how the parts were simplified.
///
/// # Errors
/// A coloured mesh that cannot be written.
pub(super) fn reduce(
    parts: Vec<Part>,
    mut keep: &[bool],
    views: &Views,
    params: &SimplifyParams,
    looks: &Looks,
    steps: &mut Steps,
) -> Result<Vec<Reduced>, BakeError> {
    let coarse = coarser(params, COARSER);
    let mut reduced = Vec::with_capacity(parts.len());
    for (index, part) in parts.into_iter().enumerate() {
        let (of_part, rest) = keep.split_at(part.mesh.triangles.len());
        keep = rest;
        looks.kept(index, &part.mesh, of_part)?;
        reduced.push(steps.run("simplifying what nobody sees", || reduce_part(part, of_part, views, &coarse)));
    }
    Ok(reduced)
}

/// As `params`, with limits so many times as large.
pub(super) fn coarser(params: &SimplifyParams, times: f32) -> SimplifyParams {
    SimplifyParams {
        error_px: times * params.error_px,
        edge_px: times * params.edge_px,
        error_m: times * params.error_m,
        edge_m: times * params.edge_m,
        ..params.clone()
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

fn reduce_part(part: Part, keep: &[bool], views: &Views, coarse: &SimplifyParams) -> Reduced {
    let Part { mesh, mut stands_for, clearance_m } = part;
    let which = |kept: bool| -> Vec<u32> { (0..keep.len() as u32).filter(|&t| keep[t as usize] == kept).collect() };
    let (kept, dropped) = (which(true), which(false));
    let (drawn, drawn_vertices) = mesh.with_triangles(&kept);
    let (unseen, _) = mesh.with_triangles(&dropped);
    drop(mesh);
    let mut clearance: Vec<f32> = drawn_vertices.iter().map(|&v| clearance_m[v as usize]).collect();
    // where each triangle from before the purge went
    let mut now = vec![0; keep.len()];
    kept.iter().enumerate().for_each(|(place, &t)| now[t as usize] = place as u32);
    let hidden = if dropped.is_empty() {
        unseen
    } else {
        let simplified = simplify(&unseen, views, coarse);
        let nearest = nearest_triangles(&unseen, &simplified.mesh, views, coarse);
        for (&t, place) in dropped.iter().zip(nearest.triangle) {
            now[t as usize] = kept.len() as u32 + place;
        }
        clearance.extend(measure(&unseen, &simplified.mesh, views, coarse).clearance_m);
        simplified.mesh
    };
    stands_for.iter_mut().for_each(|t| *t = now[*t as usize]);
    Reduced { drawn, hidden, stands_for, clearance_m: clearance }
}
