//! The light grid: what lights a figure that moves where no surface is.
//!
//! A sparse lattice of points through the rooms and along the actors' paths. Each point has, for the six directions of the axes as
//! normals, what vertices have: sky transfer and bounced sunlight, and one sun mask for all six, for it tells whether the sun
//! reaches the place, whatever stands there. A surface of normal n takes the squares of n's components of the three that it faces (an
//! ambient cube), and the sun's own light by the mask.
//!
//! `grid.glb` is plain glTF 2.0 whose primitives are lists of points (mode 0), at most 10,000 lattice points each. Each lattice point
//! is six vertices in a row, with normals +X -X +Y -Y +Z -Z and the attributes of [`crate::layout`] but `COLOR_0`, `TEXCOORD_0` and
//! indices: `POSITION` (the same for all six), `NORMAL`, `_SUN_MASK_n` (the same), `_SKY_TRANSFER_n`, `_SUN_BOUNCE_n`, and `_VALID`
//! where one is 0. The manifest's `grid` names the file and the lattice: point (i, j, k) is at `origin + spacing_m * (i, j, k)`.
//!
//! **How to interpolate.** Between the eight corners of the cell that holds a place, trilinearly; corners that are not in the lattice
//! or not valid (they lie in stone and hold the light of a neighbour, perhaps of the stone's other side) weigh nothing, and the other
//! weights are scaled to sum to 1. Where no corner is left, the valid points within two cells, each with the weight
//! `((R - d) / (R d))^2`, R two cells (R. Franke: "Scattered data interpolation: tests of some methods", Math. Comp. 38, 1982); deep
//! in a thick wall the corners' borrowed light; farther out nothing. A wall that is thinner than a cell and passes between two valid
//! points is not seen: there light is mixed over at most one cell.

use crate::chunk::{LightLayout, VertexLight};
use crate::layout::LightAttributes;
use crate::moment::Moment;
use crate::shade::{sun_reached, vertex_light};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::f32::consts::FRAC_1_PI;
use thiserror::Error;

/// The normals of a lattice point's six vertices, in order.
pub const AXES: [Vec3; 6] = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
/// The most points of a lattice.
pub const MAX_GRID_POINTS: usize = 1_000_000;
/// Lattice points of a primitive.
pub(crate) const POINTS_PER_PRIMITIVE: usize = 10_000;
/// How far off the lattice a place looks for points, in cells.
const REACH_CELLS: f32 = 2.0;
/// The largest coordinate of a lattice: steps of a cell then stay exact in 32-bit floats.
const MAX_CELL: u32 = 1 << 20;

/// What a manifest says of the light grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GridInfo {
    /// The glTF file; among the manifest's `files`.
    pub file: String,
    /// Where point (0, 0, 0) of the lattice is or would be, metres in the bundle's space.
    pub origin: [f64; 3],
    /// The distance between neighbours along each axis, metres.
    pub spacing_m: f64,
    /// The size of the box of lattice coordinates that holds all points.
    pub cells: [u32; 3],
    /// Points in it.
    pub points: u64,
    /// Of these, points that lie inside something and borrowed their light.
    pub invalid_points: u64,
}

/// Bytes that a lattice point takes in the bundle, at most.
#[must_use]
pub fn point_bytes(layout: LightLayout) -> u64 {
    AXES.len() as u64 * (POSITION_NORMAL_AND_FLAG_BYTES + LightAttributes::of(layout).bytes())
}

/// Bytes of a vertex besides its light.
const POSITION_NORMAL_AND_FLAG_BYTES: u64 = 12 + 12 + 4;

/// What is wrong with a light grid.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("light grid: {0}")]
pub struct GridFault(String);

/// The light of a lattice of L points, as the bake makes it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GridPoints {
    /// Where lattice coordinates (0, 0, 0) are, metres in the bundle's space.
    pub origin: [f64; 3],
    /// The distance between neighbours along each axis, metres.
    pub spacing_m: f64,
    /// L lattice coordinates, each once, ascending.
    pub cells: Vec<[u32; 3]>,
    /// L flags: 0 where the point lies inside something and borrowed its light, else 1.
    pub valid: Vec<u8>,
    /// The light of 6 L vertices, those of a point in the order of [`AXES`]; the masks of the six are the same.
    pub light: VertexLight,
}

impl GridPoints {
    /// Where a lattice point is.
    #[must_use]
    pub fn position(&self, cell: [u32; 3]) -> Vec3 {
        (DVec3::from_array(self.origin) + self.spacing_m * DVec3::from_array(cell.map(f64::from))).as_vec3()
    }

    /// The size of the box of coordinates that holds all points.
    #[must_use]
    pub fn extent(&self) -> [u32; 3] {
        let most = self.cells.iter().fold([0; 3], |most: [u32; 3], cell| [0, 1, 2].map(|axis| most[axis].max(cell[axis] + 1)));
        if self.cells.is_empty() { [0; 3] } else { most }
    }

    /// Whether all arrays fit together and all values are in range.
    ///
    /// # Errors
    /// The first fault.
    pub fn validate(&self) -> Result<(), GridFault> {
        let fault = |what: String| Err(GridFault(what));
        let count = self.cells.len();
        if !(1..=MAX_GRID_POINTS).contains(&count) {
            return fault(format!("{count} points; a grid holds 1 to 1,000,000"));
        }
        let finite = self.origin.iter().all(|x| x.is_finite());
        if !(finite && self.spacing_m.is_finite() && self.spacing_m > 0.0) {
            return fault(format!("origin {:?} and spacing {} are no lattice", self.origin, self.spacing_m));
        }
        if let Some(cell) = self.cells.iter().find(|cell| cell.iter().any(|&c| c >= MAX_CELL)) {
            return fault(format!("the point {cell:?} is farther out than 1,048,576 cells"));
        }
        if let Some(pair) = self.cells.windows(2).find(|pair| pair[0] >= pair[1]) {
            return fault(format!("the points {:?} and {:?} are not in order", pair[0], pair[1]));
        }
        let layout = self.light.layout();
        layout.validate().map_err(|fault| GridFault(fault.to_string()))?;
        let vertices = count * AXES.len();
        for (what, found, expected) in [
            ("valid", self.valid.len(), count),
            ("sun_mask", self.light.sun_mask.len(), vertices * layout.mask_words()),
            ("sky_transfer", self.light.sky_transfer.len(), vertices * layout.transfer_floats()),
            ("sun_bounce", self.light.sun_bounce.len(), vertices * layout.bounce_floats()),
        ] {
            if found != expected {
                return fault(format!("{what} has {found} elements, not {expected}"));
            }
        }
        if self.valid.iter().any(|&flag| flag > 1) {
            return fault("a flag is neither 0 nor 1".to_owned());
        }
        if !self.light.sky_transfer.iter().chain(&self.light.sun_bounce).all(|x| x.is_finite()) {
            return fault("light that is not finite".to_owned());
        }
        let words = layout.mask_words();
        if self
            .light
            .sun_mask
            .chunks_exact(AXES.len() * words)
            .any(|six| six.chunks_exact(words).any(|own| *own != six[..words]))
        {
            return fault("the six masks of a point differ".to_owned());
        }
        Ok(())
    }
}

/// A light grid that answers for any place.
#[derive(Clone, Debug)]
pub struct Grid {
    points: GridPoints,
    /// Only looked up, never walked.
    point_at: HashMap<[u32; 3], u32>,
}

/// The points that light a place, and how much each counts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GridSample {
    /// Points of [`GridPoints::cells`] with weights that sum to 1.
    pub weights: Vec<(u32, f32)>,
}

/// The light of a place at a moment. The sun's own light is not among it: it comes by [`AmbientCube::sun_visible`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AmbientCube {
    /// Light (irradiance / pi) of sky and bounced sun on surfaces with the normals [`AXES`], linear RGB, not negative.
    pub sky_and_bounce: [Vec3; 6],
    /// The part of the sun that reaches the place, 0 to 1.
    pub sun_visible: f32,
}

impl AmbientCube {
    /// Light (irradiance / pi) of sky and bounced sun on a surface of unit normal `normal`.
    #[must_use]
    pub fn ambient(&self, normal: Vec3) -> Vec3 {
        let squares = normal * normal;
        let faced = |axis: usize| self.sky_and_bounce[2 * axis + usize::from(normal[axis] < 0.0)];
        faced(0) * squares.x + faced(1) * squares.y + faced(2) * squares.z
    }

    /// All light (irradiance / pi) of such a surface, the sun's with it where the figure itself does not shade it.
    #[must_use]
    pub fn light(&self, moment: &Moment, normal: Vec3) -> Vec3 {
        let facing = self.sun_visible * normal.dot(moment.sun_direction).max(0.0) * FRAC_1_PI;
        self.ambient(normal) + moment.shading.sun_irradiance * facing
    }
}

impl Grid {
    /// Makes a grid ready to be asked.
    ///
    /// # Errors
    /// As [`GridPoints::validate`].
    pub fn new(points: GridPoints) -> Result<Self, GridFault> {
        points.validate()?;
        let point_at = points.cells.iter().copied().zip(0..).collect();
        Ok(Self { points, point_at })
    }

    /// The points with their light.
    #[must_use]
    pub fn points(&self) -> &GridPoints {
        &self.points
    }

    /// How many points there are.
    #[must_use]
    pub fn point_count(&self) -> usize {
        self.points.cells.len()
    }

    /// Where a point is.
    ///
    /// # Panics
    /// If there is no such point.
    #[must_use]
    pub fn position(&self, point: usize) -> Vec3 {
        self.points.position(self.points.cells[point])
    }

    /// The points that light a place, as the module says; `None` farther than two cells off the lattice.
    #[must_use]
    pub fn sample(&self, position: Vec3) -> Option<GridSample> {
        if !position.is_finite() {
            return None;
        }
        let at = ((position.as_dvec3() - DVec3::from_array(self.points.origin)) / self.points.spacing_m).as_vec3();
        // beyond, no cell is within reach, and whole numbers stay exact
        if at.abs().max_element() > MAX_CELL as f32 + REACH_CELLS {
            return None;
        }
        let only_valid = |point: &(u32, f32)| self.points.valid[point.0 as usize] != 0;
        let corners = self.corners(at);
        scaled(corners.iter().copied().filter(only_valid).collect())
            .or_else(|| scaled(self.near(at).into_iter().filter(only_valid).collect()))
            .or_else(|| scaled(corners))
    }

    /// The corners of the cell that holds a place, with their trilinear weights.
    fn corners(&self, at: Vec3) -> Vec<(u32, f32)> {
        let (low, part) = (at.floor().as_ivec3(), at - at.floor());
        let corner = |corner: i32| {
            let steps = [corner & 1, corner >> 1 & 1, corner >> 2];
            let weight: f32 = (0..3).map(|axis| if steps[axis] == 1 { part[axis] } else { 1.0 - part[axis] }).product();
            Some((self.point(low.to_array(), steps)?, weight))
        };
        (0..8).filter_map(corner).collect()
    }

    /// The points within reach of a place, with weights that fall with their distance.
    fn near(&self, at: Vec3) -> Vec<(u32, f32)> {
        let low = at.floor().as_ivec3().to_array();
        let reach = REACH_CELLS as i32;
        let steps = || -reach..=reach + 1;
        let mut near = Vec::new();
        for (z, y) in steps().flat_map(|z| steps().map(move |y| (z, y))) {
            for x in steps() {
                let distance = (Vec3::from_array([low[0] + x, low[1] + y, low[2] + z].map(|c| c as f32)) - at).length();
                if let Some(point) = self.point(low, [x, y, z]).filter(|_| distance < REACH_CELLS) {
                    // at a point itself its own light: a weight that no other comes near, and that stays finite
                    let weight = (REACH_CELLS - distance) / (REACH_CELLS * distance.max(f32::EPSILON));
                    near.push((point, weight * weight));
                }
            }
        }
        near
    }

    fn point(&self, low: [i32; 3], steps: [i32; 3]) -> Option<u32> {
        let cell = [0, 1, 2].map(|axis| u32::try_from(low[axis] + steps[axis]));
        let [Ok(x), Ok(y), Ok(z)] = cell else { return None };
        self.point_at.get(&[x, y, z]).copied()
    }

    /// The part of the sun of a step that reaches a place, 0 to 1.
    ///
    /// # Panics
    /// If there is no such step, or the sample is of another grid.
    #[must_use]
    pub fn sun_fraction(&self, sample: &GridSample, step: u32) -> f32 {
        let reaches = |point: u32| self.points.light.sun_reaches(point as usize * AXES.len(), step);
        sample.weights.iter().filter(|(point, _)| reaches(*point)).map(|(_, weight)| weight).sum()
    }

    /// The light of a place at a moment.
    ///
    /// # Panics
    /// If the moment or the sample are not of this grid's bundle.
    #[must_use]
    pub fn light(&self, moment: &Moment, sample: &GridSample) -> AmbientCube {
        let mut cube = AmbientCube::default();
        let light = &self.points.light;
        for &(point, weight) in &sample.weights {
            let first = point as usize * AXES.len();
            cube.sun_visible += weight * sun_reached(moment, light, first);
            for (axis, sum) in cube.sky_and_bounce.iter_mut().enumerate() {
                let own = vertex_light(moment, light, first + axis, AXES[axis]);
                *sum += weight * (own.sky + own.bounce);
            }
        }
        cube.sun_visible = cube.sun_visible.clamp(0.0, 1.0);
        cube
    }

    /// The light of a place at a moment; `None` farther than two cells off the lattice, where the open sky is the best guess.
    ///
    /// # Panics
    /// If the moment is not of this grid's bundle.
    #[must_use]
    pub fn light_at(&self, moment: &Moment, position: Vec3) -> Option<AmbientCube> {
        Some(self.light(moment, &self.sample(position)?))
    }
}

/// Weights that sum to 1; `None` where there are none.
fn scaled(mut weights: Vec<(u32, f32)>) -> Option<GridSample> {
    weights.retain(|(_, weight)| *weight > 0.0);
    let sum: f32 = weights.iter().map(|(_, weight)| weight).sum();
    weights.iter_mut().for_each(|(_, weight)| *weight /= sum);
    (!weights.is_empty()).then_some(GridSample { weights })
}
