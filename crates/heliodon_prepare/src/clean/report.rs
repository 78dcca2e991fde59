//! What cleaning found and did.

use super::{center, double_area};
use glam::Vec3;
use heliodon_mesh::Mesh;
use serde::{Deserialize, Serialize};
use std::fmt;

/// What became of a triangle, or what is said of it. Of several that apply the one that stands first here counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
pub enum Mark {
    /// Removed: a corner is not finite.
    NonFinite,
    /// Removed: corners at one place, or no area and an edge without a neighbour.
    Degenerate,
    /// Removed: the same triangle is there already.
    Duplicate,
    /// Removed, or kept if [`super::DoubleWalls`] says so: see [`Mark::DoubleWall`].
    RemovedDoubleWall,
    /// Removed: part of a bit that is too small.
    Isolated,
    /// Turned round.
    Flipped,
    /// Kept, though wound against its neighbours, or part of a closed surface that is inside out.
    WrongWay,
    /// Kept, part of a surface with one side only.
    OneSided,
    /// Kept, though it has no area: it holds its neighbours together, and without it a vertex of one would lie on an edge of another.
    Flat,
    /// Kept: one of two that look opposite ways at the same places.
    DoubleWall,
    /// Kept, at an edge where more than two triangles meet.
    NonManifold,
    /// Kept: a vertex of another triangle lies on the inside of an edge without a neighbour, or did, and the triangle was parted there.
    TJunction,
    /// Kept, at an edge without a neighbour.
    Open,
    /// Kept, and nothing to say.
    #[default]
    Kept,
}

impl Mark {
    /// All of them, in order.
    pub const ALL: [Self; 14] = [
        Self::NonFinite,
        Self::Degenerate,
        Self::Duplicate,
        Self::RemovedDoubleWall,
        Self::Isolated,
        Self::Flipped,
        Self::WrongWay,
        Self::OneSided,
        Self::Flat,
        Self::DoubleWall,
        Self::NonManifold,
        Self::TJunction,
        Self::Open,
        Self::Kept,
    ];

    /// Whether the triangle is gone.
    #[must_use]
    pub fn is_removed(self) -> bool {
        self <= Self::Isolated
    }
}

/// Triangles of one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Finding {
    /// How many triangles.
    pub triangles: u64,
    /// Their area in square metres.
    pub area_m2: f64,
    /// The middle of the first of them, metres.
    pub first: Option<[f32; 3]>,
}

impl Finding {
    /// Notes a triangle, whose corners are finite.
    pub(crate) fn add(&mut self, mesh: &Mesh, triangle: usize) {
        self.triangles += 1;
        self.area_m2 += double_area(mesh, triangle).length() * 0.5;
        self.first.get_or_insert_with(|| center(mesh, triangle).to_array());
    }
}

/// Edges of one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct EdgeFinding {
    /// How many edges.
    pub edges: u64,
    /// Their length in metres.
    pub length_m: f64,
    /// The middle of the first of them, metres.
    pub first: Option<[f32; 3]>,
}

impl EdgeFinding {
    /// Notes an edge.
    pub(super) fn add(&mut self, a: Vec3, b: Vec3) {
        self.edges += 1;
        self.length_m += a.as_dvec3().distance(b.as_dvec3());
        self.first.get_or_insert_with(|| ((a.as_dvec3() + b.as_dvec3()) * 0.5).as_vec3().to_array());
    }
}

/// Vertices of one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct VertexFinding {
    /// At how many places.
    pub vertices: u64,
    /// Where the first of them is, metres.
    pub first: Option<[f32; 3]>,
}

/// What cleaning found and did. Its `Display` is a few lines for people.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct CleanReport {
    /// Vertices of the mesh as it came.
    pub vertices_before: u64,
    /// Triangles of the mesh as it came.
    pub triangles_before: u64,
    /// Vertices that are left.
    pub vertices_after: u64,
    /// Triangles that are left.
    pub triangles_after: u64,
    /// Normals, texture coordinates and colours that broke the mesh's promises and were mended.
    pub mended_attributes: u64,
    /// Vertices that were moved onto another one, within the distance asked for.
    pub moved_vertices: u64,
    /// Removed: a corner is not finite. Without area or place.
    pub non_finite: Finding,
    /// Removed: corners at one place, or no area and an edge without a neighbour.
    pub degenerate: Finding,
    /// Kept, though without area: they hold their neighbours together.
    pub flat: Finding,
    /// Removed: there already, the same way round.
    pub duplicate: Finding,
    /// Triangles that stand at the same places as another one that looks the opposite way; both of each pair count.
    pub double_walls: Finding,
    /// How many of these were removed.
    pub double_walls_removed: u64,
    /// Removed: triangles of bits that are too small.
    pub isolated: Finding,
    /// How many bits those were.
    pub isolated_bits: u64,
    /// Pieces that hang together by a corner at least, of what is left.
    pub pieces: u64,
    /// Patches (triangles that hang together by edges where two meet) that enclose a space.
    pub closed_patches: u64,
    /// All patches.
    pub patches: u64,
    /// Triangles that were wound against most of their patch.
    pub inconsistent: Finding,
    /// Triangles of closed patches that were inside out.
    pub inside_out: Finding,
    /// Closed patches that look inwards and should: hollows within bodies, and rooms.
    pub hollows: u64,
    /// Triangles of patches that cannot be wound consistently, as a Moebius strip; left as they are.
    pub one_sided: Finding,
    /// Triangles that were turned round.
    pub flipped: u64,
    /// Normals that were turned with them.
    pub flipped_normals: u64,
    /// Edges where more than two triangles meet; kept as they are.
    pub non_manifold: EdgeFinding,
    /// Edges of one triangle only.
    pub open: EdgeFinding,
    /// Runs of open edges: holes, and the rims of what is meant to be open. Those that touch at a corner count as one.
    pub rims: u64,
    /// The length of the longest of them, metres.
    pub longest_rim_m: f64,
    /// Vertices without a neighbour on one side that lie on the inside of another triangle's edge without one, within the weld's reach: T-junctions.
    pub t_junctions: VertexFinding,
    /// Those at which triangles were parted, so that they are none any more.
    #[serde(default)]
    pub t_junctions_mended: VertexFinding,
    /// What became of each triangle of the mesh as it came, for [`super::paint`].
    #[serde(skip)]
    pub marks: Vec<Mark>,
}

impl CleanReport {
    pub(super) fn before(&mut self, mesh: &Mesh) {
        (self.vertices_before, self.triangles_before) = (mesh.positions.len() as u64, mesh.triangles.len() as u64);
    }

    pub(super) fn after(&mut self, mesh: &Mesh) {
        (self.vertices_after, self.triangles_after) = (mesh.positions.len() as u64, mesh.triangles.len() as u64);
    }
}

/// A measure with four digits that say something, however small it is.
pub(crate) struct Measure(pub f64);

impl fmt::Display for Measure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.abs() {
            0.0 => f.write_str("0"),
            size if size < 0.01 => write!(f, "{:.3e}", self.0),
            _ => write!(f, "{:.3}", self.0),
        }
    }
}

impl fmt::Display for CleanReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { vertices_before, triangles_before, vertices_after, triangles_after, .. } = self;
        write!(f, "{triangles_before} triangles over {vertices_before} vertices, now {triangles_after} over {vertices_after}")?;
        write!(f, "\n  {} pieces, {} of {} patches closed", self.pieces, self.closed_patches, self.patches)?;
        let count = |f: &mut fmt::Formatter<'_>, count: u64, what: &str| match count {
            0 => Ok(()),
            count => write!(f, "\n  {count} {what}"),
        };
        let faces = |f: &mut fmt::Formatter<'_>, found: &Finding, what: &str| match found {
            Finding { triangles: 0, .. } => Ok(()),
            Finding { triangles, area_m2, first: Some([x, y, z]) } => {
                let area = Measure(*area_m2);
                write!(f, "\n  {triangles} triangles ({area} m2) {what}, first at ({x:.3}, {y:.3}, {z:.3})")
            }
            Finding { triangles, .. } => write!(f, "\n  {triangles} triangles {what}"),
        };
        let edges = |f: &mut fmt::Formatter<'_>, found: &EdgeFinding, what: &str| match found {
            EdgeFinding { edges, length_m, first: Some([x, y, z]) } => {
                let length = Measure(*length_m);
                write!(f, "\n  {edges} edges ({length} m) {what}, first at ({x:.3}, {y:.3}, {z:.3})")
            }
            EdgeFinding { first: None, .. } => Ok(()),
        };
        count(f, self.mended_attributes, "normals, texture coordinates or colours that were no numbers, mended")?;
        count(f, self.moved_vertices, "vertices moved onto one beside them")?;
        faces(f, &self.non_finite, "with a corner that is not finite, removed")?;
        faces(f, &self.degenerate, "without area, removed")?;
        faces(f, &self.flat, "without area, kept, for they hold their neighbours together")?;
        faces(f, &self.duplicate, "there twice, removed")?;
        let walls = match self.double_walls_removed {
            0 => "back to back at the same places, kept".to_owned(),
            removed => format!("back to back at the same places, {removed} removed"),
        };
        faces(f, &self.double_walls, &walls)?;
        faces(f, &self.isolated, &format!("of {} small loose bits, removed", self.isolated_bits))?;
        faces(f, &self.inconsistent, "wound against their neighbours")?;
        faces(f, &self.inside_out, "of closed surfaces inside out")?;
        count(f, self.flipped, "triangles turned round for it")?;
        count(f, self.flipped_normals, "normals turned with them")?;
        count(f, self.hollows, "closed surfaces look inwards as hollows or rooms do, kept")?;
        faces(f, &self.one_sided, "of surfaces with one side only, which no winding suits, kept")?;
        edges(f, &self.non_manifold, "where more than two triangles meet, kept")?;
        edges(
            f,
            &self.open,
            &format!("without a neighbour, in {} rims, the longest {} m", self.rims, Measure(self.longest_rim_m)),
        )?;
        let vertices = |f: &mut fmt::Formatter<'_>, found: &VertexFinding, what: &str| match found {
            VertexFinding { vertices, first: Some([x, y, z]) } => {
                write!(
                    f,
                    "\n  {vertices} vertices on the inside of edges without a neighbour (T-junctions){what}, first at ({x:.3}, {y:.3}, {z:.3})"
                )
            }
            VertexFinding { first: None, .. } => Ok(()),
        };
        vertices(f, &self.t_junctions, "")?;
        vertices(f, &self.t_junctions_mended, ", mended by parting the triangles")
    }
}
