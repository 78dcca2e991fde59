//! Cleaning: what scanners, modellers and exporters leave behind that is no surface, or is one twice, or the wrong way round.
//!
//! All is decided by position, for a seam of texture or normals is no gap; vertices are united at the end only, where nothing tells
//! them apart. Everything is found by counting sorts and disjoint sets over plain arrays: 10 million triangles take 5 s on two
//! cores, and some 30 bytes each beyond the mesh. Only the edges where exactly two triangles meet tell how a patch is wound.

mod attributes;
mod faces;
mod junctions;
mod paint;
mod parts;
mod report;
mod rims;
mod winding;

pub use paint::{color, paint};
pub(crate) use report::Measure;
pub use report::{CleanReport, EdgeFinding, Finding, Mark, VertexFinding};

use crate::Tell;
use glam::Vec3;
use heliodon_mesh::Mesh;
use heliodon_mesh::topology::{places, settle};

/// What becomes of two triangles at the same three places that look opposite ways: both sides of a sheet, or the wall between two bodies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DoubleWalls {
    /// Both stay. Each side of a sheet has its own normals, so its own light, and maybe its own texture; a viewer that draws both
    /// sides of every triangle draws one of them, as its depth test has it. The wall between two bodies is for
    /// [`crate::solids`], which knows that it is one.
    #[default]
    Keep,
    /// The first stays, and occludes and reflects as both did; its other side shows the first one's light.
    KeepFirst,
    /// Both go. Right where all of them are walls between bodies; a lone sheet is lost.
    Remove,
}

/// What becomes of triangles that are wound against their neighbours, and of closed surfaces that are inside out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Winding {
    /// The lesser part of a patch is turned round, and closed surfaces look outwards; normals that look away from their turned
    /// triangles are turned with them. Hollows within other closed surfaces, and rooms that hold one of
    /// [`CleanParams::eyes`], keep looking inwards.
    #[default]
    Mend,
    /// It is told.
    Report,
}

/// What becomes of T-junctions: vertices on the inside of an edge without a neighbour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TJunctions {
    /// They are told.
    #[default]
    Report,
    /// Triangles are parted at the vertices on their edges.
    Mend,
}

/// How to clean.
#[derive(Clone, Debug, PartialEq)]
pub struct CleanParams {
    /// Vertices within this of one another are moved to one place, in metres; 0 unites none but those at the same place. More mends
    /// wider cracks, and eats detail of its size; above 0 takes longer, for 27 cells are searched for each place.
    pub weld_m: f32,
    /// Bits that hang together with nothing else and whose bounding box has a diagonal below this are removed, in metres. The largest
    /// piece always stays.
    pub isolated_m: f32,
    /// What becomes of double walls.
    pub double_walls: DoubleWalls,
    /// What becomes of wrong windings.
    pub winding: Winding,
    /// What becomes of T-junctions. Mending them takes another look at all edges; an edge is bent onto a vertex by [`CleanParams::weld_m`] at most.
    pub t_junctions: TJunctions,
    /// Vertices at one place with the same texture coordinates and colour become one where their normals differ by less, in radians.
    /// More leaves fewer vertices and blurs creases.
    pub crease_rad: f32,
    /// Places where eyes can be, in metres: a closed surface that looks inwards around one is a room, not a body inside out.
    pub eyes: Vec<Vec3>,
}

impl Default for CleanParams {
    fn default() -> Self {
        Self {
            weld_m: 0.0,
            isolated_m: 0.0,
            double_walls: DoubleWalls::default(),
            winding: Winding::default(),
            t_junctions: TJunctions::default(),
            crease_rad: 0.5_f32.to_radians(),
            eyes: Vec::new(),
        }
    }
}

impl CleanParams {
    /// For a scan: dust below 2 cm goes.
    #[must_use]
    pub fn scan() -> Self {
        Self { isolated_m: 0.02, ..Self::default() }
    }

    /// For modelled geometry in metres: what was meant to touch within a hundredth of a millimetre touches, and shares its vertices.
    #[must_use]
    pub fn modelled() -> Self {
        Self { weld_m: 1.0e-5, t_junctions: TJunctions::Mend, ..Self::default() }
    }
}

/// The parts of the time after which a step of cleaning begins.
mod share {
    pub(super) const PLACED: f64 = 0.15;
    pub(super) const FIT: f64 = 0.2;
    pub(super) const SINGLE: f64 = 0.35;
    pub(super) const EVEN: f64 = 0.4;
    pub(super) const JOINED: f64 = 0.5;
    pub(super) const EDGED: f64 = 0.65;
    pub(super) const PATCHED: f64 = 0.8;
    pub(super) const WOUND: f64 = 0.85;
}

/// Cleans a mesh in place, and tells what it found and did. The mesh is valid ([`Mesh::validate`]) after it if its arrays have the
/// right lengths and its textures are whole: attributes that are not finite or out of range are mended. Cleaning twice is cleaning once where no
/// T-junction is mended.
///
/// # Panics
/// Where a triangle names a vertex that does not exist, an array has a wrong length, or there are 2^31 vertices or 700 million triangles.
pub fn clean(mesh: &mut Mesh, params: &CleanParams) -> CleanReport {
    clean_telling(mesh, params, Tell::NOBODY)
}

/// As [`clean`], and tells how far it is.
///
/// # Panics
/// As [`clean`].
pub fn clean_telling(mesh: &mut Mesh, params: &CleanParams, tell: Tell) -> CleanReport {
    let mut cleaning = Cleaning::default();
    while cleaning.go_on(mesh, params, tell) {}
    cleaning.report
}

/// A cleaning that has come so far. Between its stages it and the mesh are all that decides the rest: kept together, and given back to who goes on,
/// they save what is done.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cleaning {
    /// Stages that are done, of [`Cleaning::STAGES`].
    pub done: u32,
    /// For each vertex the first one at its place.
    pub places: Vec<u32>,
    /// What was found so far.
    pub report: CleanReport,
}

impl Cleaning {
    /// From the beginning to the end.
    pub const STAGES: u32 = 4;

    /// Goes through the next stage, if there is one, and tells how far it is; whether there is another one then.
    ///
    /// # Panics
    /// As [`clean`], and where the mesh is not the one of the stages before.
    pub fn go_on(&mut self, mesh: &mut Mesh, params: &CleanParams, tell: Tell) -> bool {
        let Self { done, places: of_vertices, report } = self;
        match *done {
            0 => {
                report.marks = vec![Mark::Kept; mesh.triangles.len()];
                report.before(mesh);
                report.mended_attributes = attributes::mend(mesh);
                *of_vertices = places(&mesh.positions, params.weld_m);
                let moved = of_vertices.iter().zip(&mesh.positions).filter(|&(&place, p)| place_differs(mesh, place, *p));
                report.moved_vertices = moved.count() as u64;
                settle(&mut mesh.positions, of_vertices);
                tell.done(share::PLACED);
                faces::mark_unfit(mesh, of_vertices, report);
                tell.done(share::FIT);
            }
            1 => {
                faces::mark_repeated(mesh, of_vertices, params.double_walls, report);
                tell.done(share::SINGLE);
                faces::peel_flat(mesh, of_vertices, report);
                if params.t_junctions == TJunctions::Mend && junctions::mend(mesh, of_vertices, params.weld_m, report) {
                    // what was parted may be what stood beside it
                    faces::mark_repeated(mesh, of_vertices, params.double_walls, report);
                }
                tell.done(share::EVEN);
                parts::mark_isolated(mesh, of_vertices, params.isolated_m, report);
                tell.done(share::JOINED);
            }
            2 => {
                let edges = winding::mend(mesh, of_vertices, params, tell, report);
                let open = rims::mark(mesh, of_vertices, &edges, report);
                drop(edges);
                junctions::mark(mesh, &open, params.weld_m, report);
                tell.done(share::WOUND);
            }
            3 => {
                attributes::keep(mesh, of_vertices, params.crease_rad, &report.marks);
                // of what was parted, the first part stands for all
                report.marks.truncate(report.triangles_before as usize);
                *of_vertices = Vec::new();
                report.after(mesh);
                tell.done(1.0);
            }
            _ => return false,
        }
        *done += 1;
        *done < Self::STAGES
    }
}

fn place_differs(mesh: &Mesh, place: u32, p: Vec3) -> bool {
    mesh.positions.get(place as usize).is_some_and(|&place| place != p)
}

/// Twice a triangle's area, as a vector.
fn double_area(mesh: &Mesh, triangle: usize) -> glam::DVec3 {
    let [a, b, c] = mesh.corners(triangle).map(Vec3::as_dvec3);
    (b - a).cross(c - a)
}

/// A triangle's centroid.
fn center(mesh: &Mesh, triangle: usize) -> Vec3 {
    let [a, b, c] = mesh.corners(triangle).map(Vec3::as_dvec3);
    ((a + b + c) / 3.0).as_vec3()
}

#[cfg(test)]
mod tests;
