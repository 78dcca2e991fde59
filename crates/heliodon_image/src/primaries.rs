//! Colours in other primaries than Rec. 709, turned into Rec. 709.
//!
//! Whites are adapted by Bradford's transform (Lam, "Metamerism and Colour Constancy", 1985), so that white stays white.

use glam::{DMat3, DVec2, DVec3, Mat3};

/// Chromaticities (CIE 1931 x, y) of red, green, blue and white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Primaries {
    pub red: DVec2,
    pub green: DVec2,
    pub blue: DVec2,
    pub white: DVec2,
}

/// ITU-R BT.709, white D65.
pub(crate) const REC_709: Primaries = Primaries {
    red: DVec2::new(0.64, 0.33),
    green: DVec2::new(0.30, 0.60),
    blue: DVec2::new(0.15, 0.06),
    white: DVec2::new(0.3127, 0.3290),
};

/// The white of equal energy, in which Radiance's XYZE is written.
const WHITE_E: DVec2 = DVec2::new(1.0 / 3.0, 1.0 / 3.0);

/// `XYZ = matrix * LMS^-1`: Bradford's cone responses from XYZ.
const BRADFORD: DMat3 = DMat3::from_cols_array(&[0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296]);

/// Rec. 709 from colours in `primaries`; `None` where they span no triangle.
pub(crate) fn rec709_from(primaries: &Primaries) -> Option<Mat3> {
    if (primaries.red - REC_709.red).abs().max_element() < 0.002
        && (primaries.green - REC_709.green).abs().max_element() < 0.002
        && (primaries.blue - REC_709.blue).abs().max_element() < 0.002
        && (primaries.white - REC_709.white).abs().max_element() < 0.002
    {
        return Some(Mat3::IDENTITY);
    }
    let xyz_from_source = xyz_from(primaries)?;
    let adapted = adapt(primaries.white, REC_709.white)? * xyz_from_source;
    Some((invert(xyz_from(&REC_709)?)? * adapted).as_mat3())
}

/// Rec. 709 from XYZ with the white of equal energy, as in Radiance's XYZE pictures.
pub(crate) fn rec709_from_xyze() -> Option<Mat3> {
    Some((invert(xyz_from(&REC_709)?)? * adapt(WHITE_E, REC_709.white)?).as_mat3())
}

fn xyz_of(chromaticity: DVec2) -> Option<DVec3> {
    let xyz = DVec3::new(chromaticity.x / chromaticity.y, 1.0, (1.0 - chromaticity.x - chromaticity.y) / chromaticity.y);
    xyz.is_finite().then_some(xyz)
}

fn xyz_from(p: &Primaries) -> Option<DMat3> {
    let columns = DMat3::from_cols(xyz_of(p.red)?, xyz_of(p.green)?, xyz_of(p.blue)?);
    let scale = invert(columns)? * xyz_of(p.white)?;
    Some(columns * DMat3::from_diagonal(scale))
}

fn adapt(from_white: DVec2, to_white: DVec2) -> Option<DMat3> {
    let (from, to) = (BRADFORD * xyz_of(from_white)?, BRADFORD * xyz_of(to_white)?);
    let gain = to / from;
    gain.is_finite().then_some(invert(BRADFORD)? * DMat3::from_diagonal(gain) * BRADFORD)
}

fn invert(m: DMat3) -> Option<DMat3> {
    // chromaticity triangles of real devices have determinants far above this; below it the inverse only magnifies rounding
    (m.determinant().abs() > 1e-9).then(|| m.inverse())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn white_stays_white_and_rec709_stays_itself() {
        assert_eq!(rec709_from(&REC_709), Some(Mat3::IDENTITY));
        let p3 = Primaries { red: DVec2::new(0.68, 0.32), green: DVec2::new(0.265, 0.69), ..REC_709 };
        let m = rec709_from(&p3).unwrap();
        assert!((m * Vec3::ONE - Vec3::ONE).abs().max_element() < 1e-4);
        // published P3-D65 to Rec. 709 matrix: the red column is (1.2249, -0.0420, -0.0197)
        assert!((m.x_axis - Vec3::new(1.2249, -0.0420, -0.0197)).abs().max_element() < 2e-3, "{:?}", m.x_axis);
        assert!((rec709_from_xyze().unwrap() * Vec3::ONE - Vec3::ONE).abs().max_element() < 1e-4);
    }

    #[test]
    fn a_triangle_of_no_area_has_no_matrix() {
        let line = Primaries { red: DVec2::new(0.3, 0.3), green: DVec2::new(0.4, 0.4), blue: DVec2::new(0.5, 0.5), ..REC_709 };
        assert_eq!(rec709_from(&line), None);
        assert_eq!(rec709_from(&Primaries { red: DVec2::ZERO, ..REC_709 }), None);
    }
}
