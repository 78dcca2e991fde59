//! Where a part stands in the site: unit, up axis, scale, rotation, translation and the site's origin.
//!
//! A position of the file becomes a position of the site by these steps, in this order, all in `f64` and rounded once at the end:
//!
//! 1. `unit`: the file's numbers become metres;
//! 2. `up`: with `up = "z"`, (x, y, z) becomes (x, z, -y), so that what was north (+y) is the site's north (-Z);
//! 3. `scale`: along the site's axes, about the file's zero;
//! 4. `rotate_deg`: first about X, then about Y, then about Z (fixed axes, right-handed, so `Rz * Ry * Rx`);
//! 5. `translate`: in metres, along the site's axes;
//! 6. `origin`: subtracted; it is written in the site's axes and in metres, so survey coordinates (east, north, height) with
//!    `up = "z"` take `origin = [east, height, -north]`.
//!
//! A transform that mirrors (an odd number of negative scales) also turns the triangles round, so that fronts stay fronts.

use glam::{DMat3, DVec3, Vec3};
pub use heliodon_math::unit::Unit;
use serde::{Deserialize, Serialize};

/// The axis that points up in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Up {
    /// +Y, as in glTF and here.
    #[default]
    Y,
    /// +Z, as in surveys, scans and CAD.
    Z,
}

/// Where a part stands in the site; see the module for the order of its steps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Placement {
    /// The unit of the file's numbers.
    pub unit: Unit,
    /// The file's up axis.
    pub up: Up,
    /// Factors along the site's X, Y and Z; negative ones mirror, zero is not allowed.
    pub scale: [f64; 3],
    /// Rotations about X, Y and Z in degrees, applied in that order about fixed axes.
    pub rotate_deg: [f64; 3],
    /// Metres along the site's axes.
    pub translate: [f64; 3],
    /// The site's origin in metres in the site's axes, subtracted last.
    pub origin: [f64; 3],
}

impl Default for Placement {
    fn default() -> Self {
        Self { unit: Unit::Metre, up: Up::Y, scale: [1.0; 3], rotate_deg: [0.0; 3], translate: [0.0; 3], origin: [0.0; 3] }
    }
}

/// A placement that is no transform of space.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlacementError {
    /// A number is NaN or infinite.
    #[error("{field} is {value:?}; every number of a placement must be finite")]
    NotFinite {
        /// The field's name.
        field: &'static str,
        /// Its value.
        value: [f64; 3],
    },
    /// A scale of zero flattens the part.
    #[error("scale is {0:?}; a factor of zero would flatten the part, use factors other than zero")]
    Flat([f64; 3]),
}

impl Placement {
    /// The affine map that it describes, `p_site = linear * p_file + offset`.
    ///
    /// # Errors
    /// When a number is not finite or a scale is zero.
    pub fn affine(&self) -> Result<Affine, PlacementError> {
        let fields =
            [("scale", self.scale), ("rotate_deg", self.rotate_deg), ("translate", self.translate), ("origin", self.origin)];
        for (field, value) in fields {
            if value.iter().any(|x| !x.is_finite()) {
                return Err(PlacementError::NotFinite { field, value });
            }
        }
        if self.scale.contains(&0.0) {
            return Err(PlacementError::Flat(self.scale));
        }
        let site_from_file_axes = match self.up {
            Up::Y => DMat3::IDENTITY,
            Up::Z => DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y),
        };
        let [x, y, z] = self.rotate_deg;
        let rotation = rotation(2, z) * rotation(1, y) * rotation(0, x);
        let linear = rotation * DMat3::from_diagonal(DVec3::from(self.scale)) * site_from_file_axes * self.unit.metres();
        Ok(Affine::new(linear, DVec3::from(self.translate) - DVec3::from(self.origin)))
    }
}

/// The rotation by `degrees` about axis 0, 1 or 2; quarter turns are exact.
fn rotation(axis: usize, degrees: f64) -> DMat3 {
    let turned = degrees.rem_euclid(360.0);
    let (sin, cos) = match turned {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        other => libm::sincos(other.to_radians()),
    };
    match axis {
        0 => DMat3::from_cols(DVec3::X, DVec3::new(0.0, cos, sin), DVec3::new(0.0, -sin, cos)),
        1 => DMat3::from_cols(DVec3::new(cos, 0.0, -sin), DVec3::Y, DVec3::new(sin, 0.0, cos)),
        _ => DMat3::from_cols(DVec3::new(cos, sin, 0.0), DVec3::new(-sin, cos, 0.0), DVec3::Z),
    }
}

/// An affine map of positions in `f64`, with what normals and triangles need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    linear: DMat3,
    offset: DVec3,
    normal_matrix: DMat3,
    mirrors: bool,
}

impl Affine {
    /// Leaves everything where it is.
    pub const IDENTITY: Self =
        Self { linear: DMat3::IDENTITY, offset: DVec3::ZERO, normal_matrix: DMat3::IDENTITY, mirrors: false };

    /// The map `p -> linear * p + offset`.
    #[must_use]
    pub fn new(linear: DMat3, offset: DVec3) -> Self {
        // The inverse transpose up to a positive factor: the cofactors, times the sign of the determinant.
        let (x, y, z) = (linear.x_axis, linear.y_axis, linear.z_axis);
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
        let mirrors = linear.determinant() < 0.0;
        let normal_matrix = if mirrors { cofactors * -1.0 } else { cofactors };
        Self { linear, offset, normal_matrix, mirrors }
    }

    /// This map after `inner`.
    #[must_use]
    pub fn after(&self, inner: &Self) -> Self {
        Self::new(self.linear * inner.linear, self.linear * inner.offset + self.offset)
    }

    /// Whether it turns right hands into left ones, so that triangles must be turned round.
    #[must_use]
    pub fn mirrors(&self) -> bool {
        self.mirrors
    }

    /// Whether it leaves less than three dimensions.
    #[must_use]
    pub fn is_flat(&self) -> bool {
        self.normal_matrix.to_cols_array() == [0.0; 9] || self.linear.determinant() == 0.0
    }

    /// The linear part: a column for each axis of the source.
    #[must_use]
    pub fn linear(&self) -> DMat3 {
        self.linear
    }

    /// Where the source's zero goes.
    #[must_use]
    pub fn offset(&self) -> DVec3 {
        self.offset
    }

    /// The position `p` mapped, still in `f64`.
    #[must_use]
    #[inline]
    pub fn position(&self, p: DVec3) -> DVec3 {
        self.linear * p + self.offset
    }

    /// The normal `n` mapped; unit, or zero where `n` has no direction.
    #[must_use]
    #[inline]
    pub fn normal(&self, n: DVec3) -> Vec3 {
        (self.normal_matrix * n).try_normalize().unwrap_or(DVec3::ZERO).as_vec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placed(placement: Placement, p: [f64; 3]) -> DVec3 {
        placement.affine().unwrap().position(DVec3::from(p))
    }

    #[test]
    fn z_up_turns_north_to_minus_z() {
        let placement = Placement { up: Up::Z, ..Placement::default() };
        assert_eq!(placed(placement, [1.0, 2.0, 3.0]), DVec3::new(1.0, 3.0, -2.0));
    }

    #[test]
    fn the_steps_are_applied_in_the_documented_order() {
        let placement = Placement {
            unit: Unit::Centimetre,
            up: Up::Z,
            scale: [2.0, 3.0, 4.0],
            rotate_deg: [90.0, 90.0, 0.0],
            translate: [10.0, 20.0, 30.0],
            origin: [1.0, 2.0, 3.0],
        };
        // (100, 200, 300) cm -> (1, 2, 3) m -> (1, 3, -2) -> (2, 9, -8) -> about X: (2, 8, 9) -> about Y: (9, 8, -2)
        assert!(placed(placement, [100.0, 200.0, 300.0]).distance(DVec3::new(18.0, 26.0, 25.0)) < 1e-12);
    }

    #[test]
    fn survey_coordinates_keep_their_digits() {
        let placement = Placement { up: Up::Z, origin: [476_000.0, 120.0, -4_202_000.0], ..Placement::default() };
        let p = placed(placement, [476_000.123, 4_202_000.456, 121.0]).as_vec3();
        assert!((p - Vec3::new(0.123, 1.0, -0.456)).length() < 1e-6);
    }

    #[test]
    fn mirroring_keeps_normals_outside() {
        let affine = Placement { scale: [1.0, 1.0, -2.0], ..Placement::default() }.affine().unwrap();
        assert!(affine.mirrors());
        assert_eq!(affine.normal(DVec3::Z), Vec3::NEG_Z);
        assert_eq!(affine.normal(DVec3::X), Vec3::X);
    }

    #[test]
    fn unequal_scales_keep_normals_upright() {
        let affine = Placement { scale: [1.0, 4.0, 1.0], ..Placement::default() }.affine().unwrap();
        let (tangent, normal) = (DVec3::new(1.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 0.0));
        let moved = affine.position(tangent) - affine.position(DVec3::ZERO);
        assert!(affine.normal(normal).as_dvec3().dot(moved).abs() < 1e-6);
    }

    #[test]
    fn what_is_no_transform_is_refused() {
        assert!(Placement { scale: [1.0, 0.0, 1.0], ..Placement::default() }.affine().is_err());
        assert!(Placement { translate: [f64::NAN, 0.0, 0.0], ..Placement::default() }.affine().is_err());
    }
}
