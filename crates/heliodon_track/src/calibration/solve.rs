//! The calibration that fits points measured in both spaces best.
//!
//! Berthold K. P. Horn: "Closed-form solution of absolute orientation using unit quaternions", Journal of the Optical Society
//! of America A 4(4), 1987. Section and equation numbers are of this paper.
//!
//! Why Horn and not the singular value decomposition (Kabsch, Umeyama): both find the same optimum, but a quaternion cannot
//! mirror, so that noisy points near a plane need no correction of a sign; and four rows of Jacobi's method are fifty lines.

use super::eigen::symmetric;
use super::{Axes, Calibration};
use crate::rotation;
use glam::{DVec3, Quat, Vec3};
use thiserror::Error;

/// Points nearer to one line than this part of their spread tell nothing reliable of the turn about it: a millimetre of noise
/// on a metre's spread would turn the room by six degrees.
const THINNEST: f64 = 0.01;

/// What is known beforehand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SolveSettings {
    /// Which way the tracker's axes point. Only its handedness matters: whatever turn is wrong in it, the solution makes up
    /// for.
    pub axes: Axes,
    /// Metres in the tracker's unit of length; none: solved as well, which three points more or less a metre apart and measured
    /// to a millimetre settle to a part in a thousand. A known one makes the rest surer.
    pub scale: Option<f32>,
}

/// A calibration and how well it fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solved {
    /// `room_from_tracker`.
    pub calibration: Calibration,
    /// The root mean square of the distances between the points in the room and where the calibration puts them, metres.
    pub rms_m: f32,
    /// What it would be with a tracker of the other hand. Where this is much smaller, the axes are wrong. Points in one plane
    /// tell nothing of it: then both are the same.
    pub mirrored_rms_m: f32,
}

/// Why points settle no calibration.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SolveError {
    /// Fewer than three pairs.
    #[error("{count} pairs of points settle no calibration; measure three or more")]
    TooFew {
        /// How many there are.
        count: usize,
    },
    /// The points lie on one line, or all in one place.
    #[error("the points lie on one line in the {space}'s coordinates; measure one that is well beside it")]
    OneLine {
        /// "tracker" or "room".
        space: &'static str,
    },
    /// A point is not finite.
    #[error("pair {index} holds a number that is not finite; measure it again")]
    NotFinite {
        /// Which pair, from 0.
        index: usize,
    },
    /// The scale given or found is none.
    #[error("the scale {scale} is none; give metres in the tracker's unit of length, from 1e-6 to 1e6")]
    Scale {
        /// The scale, as text.
        scale: String,
    },
}

/// Fits a calibration to at least three pairs of points (tracker, room), the first in the tracker's coordinates and units of
/// length (DTrack's in metres), the second in the room's, metres.
///
/// # Errors
///
/// Where there are fewer than three pairs, all on or nearly on one line, or a number is not finite.
pub fn solve(pairs: &[(Vec3, Vec3)], settings: &SolveSettings) -> Result<Solved, SolveError> {
    if pairs.len() < 3 {
        return Err(SolveError::TooFew { count: pairs.len() });
    }
    if let Some(index) = pairs.iter().position(|(p_tracker, p_room)| !(p_tracker.is_finite() && p_room.is_finite())) {
        return Err(SolveError::NotFinite { index });
    }
    let laid = |p: &(Vec3, Vec3)| settings.axes.point(p.0).as_dvec3();
    let left = Cloud::new(pairs.iter().map(laid));
    let right = Cloud::new(pairs.iter().map(|(_, p_room)| p_room.as_dvec3()));
    for (cloud, space) in [(&left, "tracker"), (&right, "room")] {
        if cloud.is_line() {
            return Err(SolveError::OneLine { space });
        }
    }
    let fit = Fit::new(&left, &right, settings.scale);
    let mirrored = Cloud { points: left.points.iter().map(|p| -*p).collect(), ..left };
    let mirrored_rms_m = Fit::new(&mirrored, &right, settings.scale).rms(&mirrored, &right);
    let scale = fit.scale as f32;
    let [w, x, y, z] = fit.rotation.map(|value| value as f32);
    let rotation = rotation::unit(Quat::from_xyzw(x, y, z, w)).unwrap_or(Quat::IDENTITY);
    // (equation in section 2.D) the centroid goes to the centroid
    let translation = right.centre - fit.turned(left.centre) * fit.scale;
    let calibration = Calibration { axes: settings.axes, scale, rotation, translation: translation.as_vec3() };
    if calibration.validate().is_err() {
        return Err(SolveError::Scale { scale: scale.to_string() });
    }
    Ok(Solved { calibration, rms_m: fit.rms(&left, &right) as f32, mirrored_rms_m: mirrored_rms_m as f32 })
}

/// Points about their centroid (section 2.C).
struct Cloud {
    centre: DVec3,
    points: Vec<DVec3>,
}

impl Cloud {
    fn new(points: impl Iterator<Item = DVec3>) -> Self {
        let points: Vec<DVec3> = points.collect();
        let centre = points.iter().sum::<DVec3>() / points.len() as f64;
        Self { centre, points: points.into_iter().map(|p| p - centre).collect() }
    }

    fn sum_of_squares(&self) -> f64 {
        self.points.iter().map(|p| p.length_squared()).sum()
    }

    /// Whether the second widest direction is thinner than [`THINNEST`] of the widest.
    fn is_line(&self) -> bool {
        let mut spread = [[0.0; 3]; 3];
        for p in &self.points {
            for (row, a) in spread.iter_mut().zip(p.to_array()) {
                row.iter_mut().zip(p.to_array()).for_each(|(sum, b)| *sum += a * b);
            }
        }
        let [(widest, _), (second, _), _] = symmetric(spread);
        widest <= 0.0 || second < THINNEST * THINNEST * widest
    }
}

/// Rotation and scale between two clouds.
struct Fit {
    /// w, x, y, z.
    rotation: [f64; 4],
    scale: f64,
}

impl Fit {
    fn new(left: &Cloud, right: &Cloud, scale: Option<f32>) -> Self {
        // section 4.A: sums of products of coordinates
        let mut m = [[0.0; 3]; 3];
        for (l, r) in left.points.iter().zip(&right.points) {
            for (row, l) in m.iter_mut().zip(l.to_array()) {
                row.iter_mut().zip(r.to_array()).for_each(|(sum, r)| *sum += l * r);
            }
        }
        let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = m;
        // the rotation is the eigenvector of the largest eigenvalue of N
        let n = [
            [xx + yy + zz, yz - zy, zx - xz, xy - yx],
            [yz - zy, xx - yy - zz, xy + yx, zx + xz],
            [zx - xz, xy + yx, -xx + yy - zz, yz + zy],
            [xy - yx, zx + xz, yz + zy, -xx - yy + zz],
        ];
        let [(_, rotation), ..] = symmetric(n);
        // section 2.E: the symmetric scale, which asks neither space to be the exact one
        let scale = scale.map_or_else(|| (right.sum_of_squares() / left.sum_of_squares()).sqrt(), f64::from);
        Self { rotation, scale }
    }

    fn turned(&self, p: DVec3) -> DVec3 {
        let [w, x, y, z] = self.rotation;
        let axis = DVec3::new(x, y, z);
        let twice = axis.cross(p) * 2.0;
        p + twice * w + axis.cross(twice)
    }

    fn rms(&self, left: &Cloud, right: &Cloud) -> f64 {
        let pairs = left.points.iter().zip(&right.points);
        let sum: f64 = pairs.map(|(l, r)| (*r - self.turned(*l) * self.scale).length_squared()).sum();
        (sum / left.points.len() as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::random::Pcg32;

    fn points(count: usize, seed: u64) -> Vec<Vec3> {
        let mut rng = Pcg32::new(seed, 9);
        (0..count).map(|_| Vec3::from_array(std::array::from_fn(|_| rng.range_f32(-2.0, 2.0)))).collect()
    }

    fn truth(axes: Axes) -> Calibration {
        let rotation = rotation::from_vector(Vec3::new(0.3, 2.1, -0.8));
        Calibration { axes, scale: 0.025, rotation, translation: Vec3::new(1.0, -0.4, 7.0) }
    }

    #[test]
    fn exact_points_give_the_exact_calibration_for_all_axes() {
        for axes in Axes::all() {
            let truth = truth(axes);
            let pairs: Vec<_> = points(4, 1).into_iter().map(|p| (p * 40.0, truth.point(p * 40.0))).collect();
            let solved = solve(&pairs, &SolveSettings { axes, scale: None }).unwrap();
            assert!(solved.rms_m < 1e-5, "{axes}: {}", solved.rms_m);
            assert!((solved.calibration.scale - truth.scale).abs() < 1e-6);
            for p in points(10, 2) {
                assert!((solved.calibration.point(p * 40.0) - truth.point(p * 40.0)).length() < 1e-4, "{axes}");
            }
            let turned = solved.calibration.rotation * truth.rotation.conjugate();
            assert!(rotation::to_vector(turned).length() < 1e-4, "{axes}");
        }
    }

    #[test]
    fn three_points_suffice_and_the_residual_tells_their_noise() {
        let truth = truth(Axes::SAME);
        let mut rng = Pcg32::new(5, 0);
        let mut noise = || Vec3::from_array(std::array::from_fn(|_| rng.range_f32(-0.002, 0.002)));
        let mut rms = |count| {
            let pairs: Vec<_> = points(count, 4).into_iter().map(|p| (p * 40.0, truth.point(p * 40.0) + noise())).collect();
            solve(&pairs, &SolveSettings { scale: Some(0.025), ..SolveSettings::default() }).unwrap().rms_m
        };
        assert!(rms(3) < 0.003);
        // uniform noise of half a width h has a variance of h^2 / 3 an axis; 6 of 3,000 degrees of freedom are fitted
        assert!((rms(1000) - 0.002).abs() < 0.0001);
    }

    #[test]
    fn the_wrong_hand_is_told_by_the_residuals() {
        let left_handed: Axes = "x y -z".parse().unwrap();
        let pairs: Vec<_> = points(5, 6).into_iter().map(|p| (p, left_handed.point(p))).collect();
        let wrong = solve(&pairs, &SolveSettings::default()).unwrap();
        assert!(wrong.rms_m > 0.3 && wrong.mirrored_rms_m < 1e-5);
        let right = solve(&pairs, &SolveSettings { axes: left_handed, scale: None }).unwrap();
        assert!(right.rms_m < 1e-5 && right.mirrored_rms_m > 0.3);
    }

    #[test]
    fn points_that_settle_nothing_are_refused() {
        let pairs = |list: &[Vec3]| -> Vec<(Vec3, Vec3)> { list.iter().map(|p| (*p, *p)).collect() };
        let refused = |list: &[(Vec3, Vec3)]| solve(list, &SolveSettings::default()).unwrap_err();
        assert_eq!(refused(&pairs(&[Vec3::X, Vec3::Y])), SolveError::TooFew { count: 2 });
        let line = [Vec3::ZERO, Vec3::ONE, Vec3::ONE * 2.0, Vec3::ONE * 5.0 + Vec3::X * 0.01];
        assert_eq!(refused(&pairs(&line)), SolveError::OneLine { space: "tracker" });
        assert_eq!(refused(&pairs(&[Vec3::ONE; 3])), SolveError::OneLine { space: "tracker" });
        let flat: Vec<_> = points(3, 7).into_iter().map(|p| (p, Vec3::X * p.x)).collect();
        assert_eq!(refused(&flat), SolveError::OneLine { space: "room" });
        assert_eq!(refused(&pairs(&[Vec3::X, Vec3::NAN, Vec3::Y])), SolveError::NotFinite { index: 1 });
        let huge: Vec<_> = points(3, 7).into_iter().map(|p| (p * 1e-9, p)).collect();
        assert!(matches!(refused(&huge), SolveError::Scale { .. }));
        assert!(refused(&pairs(&[Vec3::X])).to_string().contains("three or more"));
    }
}
