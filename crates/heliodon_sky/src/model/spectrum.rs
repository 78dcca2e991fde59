//! Eight wavelengths, and what they look like.
//!
//! Everything is computed for a sun of equal energy at every wavelength; the sun's spectrum enters with the eye's curves when the eight values
//! become a colour. What the air does to light changes slowly with the wavelength, so eight straight pieces between them follow it closely,
//! where three wavelengths (the usual shortcut) make twilight too purple or too green.

use glam::{DMat3, DVec3, Vec3};

/// How many wavelengths.
pub(crate) const COUNT: usize = 8;

/// One value for each wavelength.
pub(crate) type Spectrum = [f32; COUNT];

/// The wavelengths in nanometres.
pub(crate) const WAVELENGTHS_NM: [f64; COUNT] = [400.0, 440.0, 480.0, 520.0, 560.0, 600.0, 640.0, 690.0];

/// Solar irradiance above the air in W/(m2 nm), means of 10 nm from 360 nm: ASTM G-173.
const SOLAR: [f64; 48] = [
    1.11776, 1.14259, 1.01249, 1.14716, 1.72765, 1.73054, 1.6887, 1.61253, 1.91198, 2.03474, 2.02042, 2.02212, 1.93377,
    1.95809, 1.91686, 1.8298, 1.8685, 1.8931, 1.85149, 1.8504, 1.8341, 1.8345, 1.8147, 1.78158, 1.7533, 1.6965, 1.68194,
    1.64654, 1.6048, 1.52143, 1.55622, 1.5113, 1.474, 1.4482, 1.41018, 1.36775, 1.34188, 1.31429, 1.28303, 1.26758, 1.2367,
    1.2082, 1.18737, 1.14683, 1.12362, 1.1058, 1.07124, 1.04992,
];

/// Absorption cross-sections of ozone at 233 K in m2, means of 10 nm from 360 nm: Serdyuchenko, Gorshelev et al., 2011.
const OZONE: [f64; 48] = [
    1.18e-27, 2.182e-28, 2.818e-28, 6.636e-28, 1.527e-27, 2.763e-27, 5.52e-27, 8.451e-27, 1.582e-26, 2.316e-26, 3.669e-26,
    4.924e-26, 7.752e-26, 9.016e-26, 1.48e-25, 1.602e-25, 2.139e-25, 2.755e-25, 3.091e-25, 3.5e-25, 4.266e-25, 4.672e-25,
    4.398e-25, 4.701e-25, 5.019e-25, 4.305e-25, 3.74e-25, 3.215e-25, 2.662e-25, 2.238e-25, 1.852e-25, 1.473e-25, 1.209e-25,
    9.423e-26, 7.455e-26, 6.566e-26, 5.105e-26, 4.15e-26, 4.228e-26, 3.237e-26, 2.451e-26, 2.801e-26, 2.534e-26, 1.624e-26,
    1.465e-26, 2.078e-26, 1.383e-26, 7.105e-27,
];

fn bin(table: &[f64; 48], nm: f64) -> f64 {
    table[(((nm - 360.0) / 10.0) as usize).min(47)]
}

/// Ozone's cross-section about a wavelength, in m2: the mean of the two bins that meet there.
pub(crate) fn ozone_m2(nm: f64) -> f64 {
    0.5 * (bin(&OZONE, nm - 5.0) + bin(&OZONE, nm + 5.0))
}

/// Linear Rec. 709 from XYZ (IEC 61966-2-1).
const REC709_FROM_XYZ: DMat3 =
    DMat3::from_cols_array(&[3.2406, -0.9689, 0.0557, -1.5372, 1.8758, -0.2040, -0.4986, 0.0415, 1.0570]);

/// The eye's curves: Wyman, Sloan, Shirley, "Simple Analytic Approximations to the CIE XYZ Color Matching Functions", JCGT 2(2), 2013.
fn eye(nm: f64) -> DVec3 {
    let lobe = |middle: f64, below: f64, above: f64| {
        let t = (nm - middle) / if nm < middle { below } else { above };
        libm::exp(-0.5 * t * t)
    };
    DVec3::new(
        1.056 * lobe(599.8, 37.9, 31.0) + 0.362 * lobe(442.0, 16.0, 26.7) - 0.065 * lobe(501.1, 20.4, 26.2),
        0.821 * lobe(568.8, 46.9, 40.5) + 0.286 * lobe(530.9, 16.3, 31.1),
        1.217 * lobe(437.0, 11.8, 36.0) + 0.681 * lobe(459.0, 26.0, 13.8),
    )
}

/// For each wavelength, the colour of one unit there: its share of the solar spectrum through the eye's curves, in kilolumens.
pub(crate) fn colors() -> [Vec3; COUNT] {
    let mut sums = [DVec3::ZERO; COUNT];
    for nm in 380..780 {
        let nm = f64::from(nm) + 0.5;
        // 683 lm/W
        let color = REC709_FROM_XYZ * eye(nm) * (0.683 * bin(&SOLAR, nm));
        let after = WAVELENGTHS_NM.iter().position(|&w| w > nm).unwrap_or(COUNT);
        match after {
            0 => sums[0] += color,
            COUNT => sums[COUNT - 1] += color,
            k => {
                let t = (nm - WAVELENGTHS_NM[k - 1]) / (WAVELENGTHS_NM[k] - WAVELENGTHS_NM[k - 1]);
                sums[k - 1] += color * (1.0 - t);
                sums[k] += color * t;
            }
        }
    }
    sums.map(|s| s.as_vec3())
}

/// A spectrum that goes smoothly through a linear colour's blue, green and red at 450, 540 and 620 nm.
pub(crate) fn from_albedo(albedo: Vec3) -> Spectrum {
    let knots = [(450.0, albedo.z), (540.0, albedo.y), (620.0, albedo.x)];
    WAVELENGTHS_NM.map(|nm| {
        let after = knots.iter().position(|k| k.0 > nm).unwrap_or(3);
        match after {
            0 => knots[0].1,
            3 => knots[2].1,
            k => {
                let t = ((nm - knots[k - 1].0) / (knots[k].0 - knots[k - 1].0)) as f32;
                knots[k - 1].1 + (knots[k].1 - knots[k - 1].1) * t
            }
        }
    })
}

/// The colour of a spectrum.
pub(crate) fn to_color(spectrum: &Spectrum, colors: &[Vec3; COUNT]) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for (&value, &color) in spectrum.iter().zip(colors) {
        sum += color * value;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::color::luminance;

    #[test]
    fn the_sun_above_the_air_gives_134_kilolux() {
        let sun = to_color(&[1.0; COUNT], &colors());
        // the solar illuminance constant: 133 to 134 klx (IES: 127.5 to 134)
        assert!((luminance(sun) - 133.0).abs() < 3.0, "{sun} {}", luminance(sun));
        // nearly white, a little warmer than D65
        assert!((sun / luminance(sun) - Vec3::ONE).abs().max_element() < 0.12, "{sun}");
    }
}
