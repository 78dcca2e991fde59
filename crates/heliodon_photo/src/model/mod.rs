//! Models of few polygons from marked points: polygons over them, and the shapes of architecture fitted to them with the photographs as witness.
//!
//! [`build`] takes points with their uncertainty, the photographs' cameras and rows of a table ([`table`]), and gives a mesh for each part, in metres.
//! Every fit weighs points by their covariance and edges by a pixel, gives what is far off little weight, and tells how far off each is.

mod arch;
mod block;
mod body;
mod edges;
mod fit;
mod flat;
mod imported;
mod part;
mod repeat;
mod round;
mod shape;
pub mod table;

pub(crate) use fit::solved;
pub use part::Part;
pub use shape::Measure;

use crate::camera::Camera;
use glam::{DMat3, DVec3};
use part::Gathered;
use shape::{Fitted, Names};
use std::collections::BTreeMap;
use table::{Kind, ShapeRow};

/// A point that was marked in photographs and back-projected.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedPoint {
    /// Its name.
    pub name: String,
    /// Where it is, metres.
    pub position: DVec3,
    /// How uncertain that is, square metres; symmetric, no eigenvalue below 0.
    pub covariance: DMat3,
    /// The photographs in which it was marked, by their index.
    pub seen_in: Vec<usize>,
}

/// By how much a photograph sees a point beside where the shape has it.
#[derive(Clone, Debug, PartialEq)]
pub struct ShownBy {
    /// The photograph.
    pub photograph: String,
    /// Pixels.
    pub off_px: f64,
}

/// How far a point is off the shape that was fitted to it.
#[derive(Clone, Debug, PartialEq)]
pub struct PointResidual {
    /// The point.
    pub point: String,
    /// Metres.
    pub off_m: f64,
    /// The same in standard deviations, of the point's own and the shape's tolerance.
    pub sigmas: f64,
    /// In the photographs that show it.
    pub photographs: Vec<ShownBy>,
}

/// How far a marked edge is off the shape's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeResidual {
    /// Which of the row's edges.
    pub edge: usize,
    /// Root of the mean square over its pixels.
    pub off_px: f64,
}

/// What became of a row.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeReport {
    /// The row's name.
    pub shape: String,
    /// The shape's numbers.
    pub measures: Vec<Measure>,
    /// How far its points are off.
    pub points: Vec<PointResidual>,
    /// How far its edges are off.
    pub edges: Vec<EdgeResidual>,
    /// What else is to be known, in words.
    pub notes: Vec<String>,
}

/// A model.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Its parts, in the order in which rows first name them.
    pub parts: Vec<Part>,
    /// What became of each row that could be fitted.
    pub shapes: Vec<ShapeReport>,
    /// Why others could not; the rest of the model is without them.
    pub refused: Vec<ModelError>,
}

/// Why a row could not be made into a shape.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// It names a point that there is not.
    #[error("shape \"{shape}\" names the point \"{point}\", which is not marked or was not solved")]
    Point {
        /// The row.
        shape: String,
        /// The point.
        point: String,
    },
    /// It names a photograph that there is not.
    #[error("shape \"{shape}\" has an edge in \"{photograph}\", which is no photograph of this project or has no camera yet")]
    Photograph {
        /// The row.
        shape: String,
        /// The photograph.
        photograph: String,
    },
    /// What it says does not make a shape.
    #[error("shape \"{shape}\" {why}")]
    Shape {
        /// The row.
        shape: String,
        /// What is missing, or contradicts.
        why: String,
    },
}

/// Fits all rows to points, and joins what they make into parts. `photographs` are names and cameras, in the order that points know them by.
///
/// A row that cannot be fitted is left out and told in [`Model::refused`].
#[must_use]
pub fn build(rows: &[ShapeRow], points: &[NamedPoint], photographs: &[(String, Camera)]) -> Model {
    let index: BTreeMap<&str, usize> = points.iter().enumerate().map(|(i, point)| (point.name.as_str(), i)).collect();
    let mut settled = points.to_vec();
    edges::settle(rows, (&index, photographs), &mut settled);
    let mut model = Model::default();
    let mut gathered: Vec<Gathered> = Vec::new();
    for row in rows {
        let points = if matches!(row.kind, Kind::Polygon | Kind::Extrusion) { &settled } else { points };
        match made(row, &Names::of(row, &index, photographs), points) {
            Err(error) => model.refused.push(error),
            Ok(Fitted { body, points, edges, measures, notes }) => {
                model.shapes.push(ShapeReport { shape: row.name.clone(), measures, points, edges, notes });
                let name = row.part.as_ref().unwrap_or(&row.name);
                let part = match gathered.iter_mut().find(|part| part.name == *name) {
                    Some(part) => part,
                    None => {
                        gathered.push(Gathered::new(name.clone()));
                        let last = gathered.len() - 1;
                        &mut gathered[last]
                    }
                };
                part.add(&body, row.kind == Kind::Polygon, row.watertight);
            }
        }
    }
    model.parts = gathered.into_iter().map(Gathered::part).collect();
    model
}

fn made(row: &ShapeRow, names: &Names, points: &[NamedPoint]) -> Result<Fitted, ModelError> {
    check(row, names, points)?;
    let mut fitted = match row.kind {
        Kind::Polygon => flat::polygon(row, names, points)?,
        Kind::Extrusion => flat::extrusion(row, names, points)?,
        Kind::Box | Kind::Gable => block::block(row, names, points)?,
        Kind::Cylinder | Kind::Column => round::shaft(row, names, points)?,
        Kind::Revolution => round::revolution(row, names, points)?,
        Kind::Arch => arch::arch(row, names, points)?,
    };
    fitted.body = repeat::repeated(fitted.body, row, names, points)?;
    if fitted.body.positions.iter().any(|p| !p.is_finite()) {
        return Err(names.refused("comes out without finite coordinates: look at its marks again".into()));
    }
    let far = fitted.points.iter().filter(|point| point.sigmas > FAR_SIGMAS);
    let told =
        far.map(|p| format!("\"{}\" is {:.3} m off, {:.1} times what its uncertainty allows", p.point, p.off_m, p.sigmas));
    let told: Vec<String> = told.collect();
    fitted.notes.extend(told);
    Ok(fitted)
}

/// Where a point's mark is doubted: one in ten thousand is so far off by chance.
const FAR_SIGMAS: f64 = 4.0;
/// The most sides that stand for a circle.
const MOST_SIDES: u32 = 1024;

/// Settings that the kind knows nothing of are mistakes, and so are those out of range.
fn check(row: &ShapeRow, names: &Names, points: &[NamedPoint]) -> Result<(), ModelError> {
    use Kind::{Arch, Box, Column, Cylinder, Extrusion, Gable, Polygon, Revolution};
    let known: [(&str, bool, &[Kind]); 15] = [
        ("points", !row.points.is_empty(), &[Polygon, Box, Gable, Cylinder, Column, Extrusion]),
        ("on", !row.on.is_empty(), &[Box, Gable]),
        ("bottom", !row.bottom.is_empty(), &[Cylinder, Column]),
        ("top", !row.top.is_empty(), &[Cylinder, Column]),
        ("inner", !row.inner.is_empty(), &[Arch]),
        ("outer", !row.outer.is_empty(), &[Arch]),
        ("back", !row.back.is_empty(), &[Arch]),
        ("rings", !row.rings.is_empty(), &[Revolution]),
        ("along", row.along.is_some(), &[Extrusion]),
        ("axis", row.axis.is_some(), &[Cylinder, Column, Revolution]),
        ("depth_m", row.depth_m.is_some(), &[Arch]),
        ("upright", row.upright, &[Box, Gable, Cylinder, Column, Revolution]),
        ("flatten", row.flatten, &[Polygon]),
        ("as_listed", row.as_listed, &[Polygon]),
        ("entasis", row.entasis, &[Column]),
    ];
    if let Some((setting, ..)) = known.iter().find(|(_, is_set, kinds)| *is_set && !kinds.contains(&row.kind)) {
        return Err(names.refused(format!("has {setting}, which means nothing for its kind")));
    }
    if let Some(sides) = row.sides.filter(|sides| !(1..=MOST_SIDES).contains(sides)) {
        return Err(names.refused(format!("has {sides} sides; it is 1 to {MOST_SIDES}, 3 at least for what is round")));
    }
    for (setting, value) in [("tolerance_m", row.tolerance_m), ("depth_m", row.depth_m)] {
        if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
            return Err(names.refused(format!("has {setting} = {value}; it is to be above 0")));
        }
    }
    let has_corners = matches!(row.kind, Box | Gable | Polygon | Extrusion);
    if row.edges.iter().any(|edge| edge.between.is_some() != has_corners) {
        let why = if has_corners {
            "has an edge that does not say between which corners"
        } else {
            "has an edge between corners, of which it has none"
        };
        return Err(names.refused(why.into()));
    }
    if row.edges.iter().any(|edge| edge.of.is_some() != (row.kind == Arch)) {
        let why = if row.kind == Arch {
            "has an edge that does not say whether it is of = \"inner\" or \"outer\""
        } else {
            "has an edge of an arch, which it is not"
        };
        return Err(names.refused(why.into()));
    }
    let pixels = row.edges.iter().flat_map(|edge| edge.from.into_iter().chain(edge.to));
    if pixels.into_iter().any(|x| !x.is_finite()) {
        return Err(names.refused("has an edge whose pixels are not finite".into()));
    }
    let listed = [&row.points, &row.bottom, &row.top, &row.inner, &row.outer, &row.back];
    for name in listed.into_iter().chain(row.on.values()).chain(&row.rings).flatten().filter(|name| *name != "-") {
        let point = &points[names.point(name)?];
        let spread = [0, 1, 2].map(|i| point.covariance.col(i)[i]);
        if !point.position.is_finite() || spread.iter().any(|v| !(v.is_finite() && *v >= 0.0)) {
            return Err(names.refused(format!("uses the point \"{name}\", whose place or uncertainty is not finite")));
        }
    }
    Ok(())
}

/// The sum of directions from a place to the photographs that show points.
fn toward_cameras<'a>(place: DVec3, points: impl Iterator<Item = &'a NamedPoint>, photographs: &[(String, Camera)]) -> DVec3 {
    let cameras = points.flat_map(|point| &point.seen_in).filter_map(|&photograph| photographs.get(photograph));
    cameras.filter_map(|(_, camera)| (camera.centre() - place).try_normalize()).sum()
}
