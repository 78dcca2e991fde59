//! How a measured luminaire shines.

use glam::{DVec3, Vec3};
use std::f64::consts::TAU;

/// Which edition of the standard a file follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IesStandard {
    /// LM-63-1986: no header line.
    Lm63_1986,
    /// LM-63-1991: `IESNA91`.
    Lm63_1991,
    /// LM-63-1995: `IESNA:LM-63-1995`.
    Lm63_1995,
    /// LM-63-2002: `IESNA:LM-63-2002`.
    Lm63_2002,
    /// A later one, read as LM-63-2002: `IES:LM-63-2019`.
    Later,
}

/// What the planes that are not in the file are like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Symmetry {
    /// One plane: the same all around.
    Axial,
    /// 0 to 90 degrees: each quadrant mirrors the first.
    Quadrant,
    /// 0 to 180 degrees: mirrored in the plane of 0 and 180.
    Halves,
    /// 90 to 270 degrees: mirrored in the plane of 90 and 270.
    AcrossSides,
    /// 0 to 360 degrees: nothing mirrored.
    None,
}

/// Candelas over angles.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Table {
    /// Rising, at least two.
    pub vertical_deg: Vec<f64>,
    /// Rising, at least one.
    pub horizontal_deg: Vec<f64>,
    /// For each horizontal angle those of all vertical angles, with all factors applied.
    pub candelas: Vec<f64>,
    pub symmetry: Symmetry,
}

/// How a lamp's output depends on its tilt.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tilt {
    /// Rising, at least one, and as many factors.
    pub angles_deg: Vec<f64>,
    pub factors: Vec<f64>,
}

/// The photometry of a luminaire, from an IES file (type C).
///
/// The luminaire's frame is the house's, as it hangs: **nadir (vertical angle 0) is -Y, zenith (180) is +Y; horizontal angle 0 is +X and 90
/// is -Z**, counterclockwise seen from above. Beyond the vertical angles that were measured it is dark.
#[derive(Clone, Debug, PartialEq)]
pub struct IesProfile {
    table: Table,
    standard: IesStandard,
    tilt: Option<Tilt>,
    lumens_per_lamp: f64,
    size_m: [f64; 3],
    input_watts: f64,
    flux_lm: f64,
    highest_cd: f64,
}

impl IesProfile {
    pub(super) fn new(
        table: Table,
        standard: IesStandard,
        tilt: Option<Tilt>,
        lumens_per_lamp: f64,
        size_m: [f64; 3],
        input_watts: f64,
    ) -> Self {
        let flux_lm = table.flux();
        let highest_cd = table.candelas.iter().copied().fold(0.0, f64::max);
        Self { table, standard, tilt, lumens_per_lamp, size_m, input_watts, flux_lm, highest_cd }
    }

    /// Intensity, candelas, into a direction (of any length but zero) away from the luminaire, in its own frame: linear in both angles between
    /// those measured. 0 for what is no direction. Multiplier and ballast factors are in it, the tilt's factor is not.
    #[must_use]
    pub fn intensity_cd(&self, direction: Vec3) -> f64 {
        if direction.is_finite() && direction != Vec3::ZERO { self.candela(direction.as_dvec3()) } else { 0.0 }
    }

    pub(in crate::lights) fn candela(&self, direction: DVec3) -> f64 {
        let across = (direction.x * direction.x + direction.z * direction.z).sqrt();
        let vertical = libm::atan2(across, -direction.y).to_degrees();
        let around = libm::atan2(-direction.z, direction.x).to_degrees();
        self.table.at(vertical, if around < 0.0 { around + 360.0 } else { around })
    }

    /// Luminous flux in all directions, lumens: the integral of [`IesProfile::intensity_cd`], exact.
    #[must_use]
    pub fn flux_lm(&self) -> f64 {
        self.flux_lm
    }

    /// The highest intensity, candelas.
    #[must_use]
    pub fn highest_cd(&self) -> f64 {
        self.highest_cd
    }

    /// What tilting the luminaire by an angle (degrees from hanging straight, 0 to 180) makes of its light: from `TILT=INCLUDE`, linear between
    /// its angles, constant beyond; 1 with `TILT=NONE`.
    #[must_use]
    pub fn tilt_factor(&self, angle_deg: f64) -> f64 {
        let Some(tilt) = &self.tilt else { return 1.0 };
        let (index, part) = bracket(&tilt.angles_deg, angle_deg.clamp(0.0, 180.0));
        let low = tilt.factors.get(index).copied().unwrap_or(1.0);
        low + part * (tilt.factors.get(index + 1).copied().unwrap_or(low) - low)
    }

    /// The edition of the standard.
    #[must_use]
    pub fn standard(&self) -> IesStandard {
        self.standard
    }

    /// The lumens of one bare lamp, as stated; -1 where the candelas were measured absolutely.
    #[must_use]
    pub fn lumens_per_lamp(&self) -> f64 {
        self.lumens_per_lamp
    }

    /// Width (along horizontal angle 0), length (along 90) and height of the luminous opening, metres; negative ones stand for round shapes.
    #[must_use]
    pub fn size_m(&self) -> [f64; 3] {
        self.size_m
    }

    /// The electrical power that it takes, watts, as stated.
    #[must_use]
    pub fn input_watts(&self) -> f64 {
        self.input_watts
    }

    /// The vertical angles that were measured, degrees from nadir, rising.
    #[must_use]
    pub fn vertical_deg(&self) -> &[f64] {
        &self.table.vertical_deg
    }

    /// The horizontal angles that were measured, degrees, rising; a full circle ends with 360.
    #[must_use]
    pub fn horizontal_deg(&self) -> &[f64] {
        &self.table.horizontal_deg
    }
}

/// The interval of rising angles that holds one, and where in it (0 to 1); the ends hold what lies beyond.
fn bracket(angles: &[f64], angle: f64) -> (usize, f64) {
    let index = angles.partition_point(|&a| a <= angle).saturating_sub(1).min(angles.len().saturating_sub(2));
    match (angles.get(index), angles.get(index + 1)) {
        (Some(low), Some(high)) => (index, ((angle - low) / (high - low)).clamp(0.0, 1.0)),
        _ => (0, 0.0),
    }
}

impl Table {
    fn at(&self, vertical_deg: f64, around_deg: f64) -> f64 {
        let (Some(&lowest), Some(&highest)) = (self.vertical_deg.first(), self.vertical_deg.last()) else { return 0.0 };
        // straight up and down may miss the end by rounding
        let beyond = vertical_deg < lowest - 1e-9 || vertical_deg > highest + 1e-9;
        if beyond || vertical_deg.is_nan() {
            return 0.0;
        }
        let (row, part) = bracket(&self.vertical_deg, vertical_deg);
        let in_plane = |plane: usize| {
            let at = plane * self.vertical_deg.len() + row;
            let low = self.candelas.get(at).copied().unwrap_or(0.0);
            low + part * (self.candelas.get(at + 1).copied().unwrap_or(low) - low)
        };
        let (plane, across) = bracket(&self.horizontal_deg, self.folded(around_deg));
        let low = in_plane(plane);
        if across > 0.0 { low + across * (in_plane(plane + 1) - low) } else { low }
    }

    /// The horizontal angle in the file that is like one in [0, 360].
    fn folded(&self, around: f64) -> f64 {
        let half = if around > 180.0 { 360.0 - around } else { around };
        match self.symmetry {
            Symmetry::Axial | Symmetry::None => around,
            Symmetry::Quadrant if half > 90.0 => 180.0 - half,
            Symmetry::Quadrant | Symmetry::Halves => half,
            Symmetry::AcrossSides if around < 90.0 => 180.0 - around,
            Symmetry::AcrossSides if around > 270.0 => 540.0 - around,
            Symmetry::AcrossSides => around,
        }
    }

    /// The integral over the sphere: linear around, and by parts over the vertical angle.
    fn flux(&self) -> f64 {
        let rows = self.vertical_deg.len();
        let planes: Vec<f64> = self.candelas.chunks_exact(rows.max(1)).map(|plane| self.plane_integral(plane)).collect();
        if self.symmetry == Symmetry::Axial {
            return TAU * planes.first().copied().unwrap_or(0.0);
        }
        let copies = match self.symmetry {
            Symmetry::Quadrant => 4.0,
            Symmetry::Halves | Symmetry::AcrossSides => 2.0,
            Symmetry::Axial | Symmetry::None => 1.0,
        };
        let wedges = self.horizontal_deg.windows(2).zip(planes.windows(2));
        copies * wedges.map(|(at, light)| (at[1] - at[0]).to_radians() * 0.5 * (light[0] + light[1])).sum::<f64>()
    }

    /// The integral of I(v) sin(v) over the vertical angle, I linear between the angles.
    fn plane_integral(&self, candelas: &[f64]) -> f64 {
        let steps = self.vertical_deg.windows(2).zip(candelas.windows(2));
        steps
            .map(|(at, light)| {
                let (v0, v1) = (at[0].to_radians(), at[1].to_radians());
                let slope = (light[1] - light[0]) / (v1 - v0);
                light[0] * libm::cos(v0) - light[1] * libm::cos(v1) + slope * (libm::sin(v1) - libm::sin(v0))
            })
            .sum()
    }
}
