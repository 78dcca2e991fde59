//! Discs: sampled through the square around them where they are near, by area where they are far; and the light from a disc on a
//! surface of any orientation in closed form.
//!
//! Near, a direction is picked evenly over the solid angle of the square around the disc and discarded where it misses (M. N. Gamito:
//! "Solid Angle Sampling of Disk and Cylinder Lights", Computer Graphics Forum 35(4), 2016): the weights stay bounded however near the
//! point is, numbers stay stratified, and at most about a quarter of the samples are lost. The exact even map (Guillén and others 2017)
//! costs elliptic integrals. From [`NEAR_RADII`] on, points are picked by area, none lost.

use crate::lights::polygon;
use crate::lights::rectangle::{Picked, Rectangle};
use crate::lights::vector::{basis, concentric_disc};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Distance from the centre, in radii, up to which the square's solid angle is sampled. At three radii densities by area vary over the disc by
/// less than two to one for points before it.
const NEAR_RADII: f64 = 3.0;

/// A disc's shape.
#[derive(Clone, Debug)]
pub(super) struct Disc {
    pub centre: DVec3,
    pub radius: f64,
    pub normal: DVec3,
    x: DVec3,
    y: DVec3,
    square: Rectangle,
}

impl Disc {
    /// A disc about a unit normal.
    pub fn new(centre: DVec3, normal: DVec3, radius: f64) -> Option<Self> {
        let (x, y) = basis(normal);
        let square = Rectangle::new(centre - (x + y) * radius, x * (2.0 * radius), y * (2.0 * radius))?;
        Some(Self { centre, radius, normal, x, y, square })
    }

    /// Four points of its rim.
    pub fn rim(&self) -> [DVec3; 4] {
        [self.x, self.y, -self.x, -self.y].map(|along| self.centre + along * self.radius)
    }

    pub fn area(&self) -> f64 {
        PI * self.radius * self.radius
    }

    /// How far a point lies before the plane, metres; negative behind.
    pub fn height_of(&self, point: DVec3) -> f64 {
        (point - self.centre).dot(self.normal)
    }

    fn is_near(&self, point: DVec3) -> bool {
        (point - self.centre).length_squared() < (NEAR_RADII * self.radius).powi(2)
    }

    /// A point on the disc; `None` from its plane, and where the square's sample misses the disc.
    pub fn sample(&self, point: DVec3, numbers: [f64; 2]) -> Option<Picked> {
        if self.is_near(point) {
            let picked = self.square.sample(point, numbers)?;
            return self.holds(picked.position).then_some(picked);
        }
        let [x, y] = concentric_disc(numbers);
        let position = self.centre + (self.x * x + self.y * y) * self.radius;
        Some(Picked { position, pdf_sr: self.pdf_sr(point, position) })
    }

    fn holds(&self, position: DVec3) -> bool {
        (position - self.centre).length_squared() <= self.radius * self.radius
    }

    /// With which density per steradian [`Disc::sample`] picks a point of the disc.
    pub fn pdf_sr(&self, point: DVec3, position: DVec3) -> f64 {
        let height = self.height_of(point).abs();
        if height == 0.0 {
            0.0
        } else if self.is_near(point) {
            self.square.pdf_sr(point, position)
        } else {
            let squared = (position - point).length_squared();
            squared * squared.sqrt() / (self.area() * height)
        }
    }

    /// Irradiance over pi from radiance one.
    pub fn irradiance_over_pi(&self, point: DVec3, normal: DVec3) -> f64 {
        irradiance_over_pi(self.centre - point, self.normal, self.radius, normal)
    }

    /// Where a ray of unit direction meets it: how far on.
    pub fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let t = -self.height_of(origin) / direction.dot(self.normal);
        (t > 0.0 && self.holds(origin + direction * t)).then_some(t)
    }
}

/// Irradiance over pi (0 to 1) at the origin, on a surface of unit normal `normal`, from a disc of radiance one about `centre` with unit
/// normal `facing` (either sign).
///
/// Lambert's contour integral taken around the circle, `1/(2 pi) * integral n . (r x dr) / r^2`, whose integrand is
/// `(p + q cos t + s sin t) / (a + d cos t)` when t counts from the rim's farthest point; where the horizon cuts the disc, along the arc
/// above it and back along the chord. Agrees with the catalogue's parallel and perpendicular cases (Howell, B-10 and B-12), and holds for
/// all.
pub(super) fn irradiance_over_pi(centre: DVec3, facing: DVec3, radius: f64, normal: DVec3) -> f64 {
    let height = centre.dot(facing);
    if height == 0.0 {
        return 0.0;
    }
    let in_plane = centre - facing * height;
    let x = in_plane.try_normalize().unwrap_or_else(|| basis(facing).0);
    // square to the normal even where little was left of the part in the plane
    let x = (x - facing * x.dot(facing)).try_normalize().unwrap_or_else(|| basis(facing).0);
    let y = facing.cross(x);
    let along = in_plane.dot(x);
    let rim = Rim {
        a: centre.length_squared() + radius * radius,
        d: 2.0 * radius * along,
        nearest: height * height + (along - radius).powi(2),
        farthest: height * height + (along + radius).powi(2),
        p: radius * radius * facing.dot(normal),
        q: radius * normal.dot(centre.cross(y)),
        s: -radius * normal.dot(centre.cross(x)),
    };
    // the rim is above the horizon where level + swing cos(t - top) >= 0
    let (level, nx, ny) = (centre.dot(normal), radius * x.dot(normal), radius * y.dot(normal));
    let swing = (nx * nx + ny * ny).sqrt();
    let sum = if level >= swing {
        rim.whole()
    } else if level > -swing {
        let (top, half) = (libm::atan2(ny, nx), libm::acos((-level / swing).clamp(-1.0, 1.0)));
        let at = |t: f64| centre + (x * libm::cos(t) + y * libm::sin(t)) * radius;
        rim.arc(top - half, top + half) + polygon::edge(at(top + half), at(top - half), normal)
    } else {
        return 0.0;
    };
    let light = sum.abs() / TAU;
    if light.is_finite() { light.min(1.0) } else { 0.0 }
}

/// `(p + q cos t + s sin t) / (a + d cos t)` around the circle, with `nearest = a - d` and `farthest = a + d` taken without their difference.
struct Rim {
    a: f64,
    d: f64,
    nearest: f64,
    farthest: f64,
    p: f64,
    q: f64,
    s: f64,
}

/// Up to this ratio of d to a the closed form of an arc takes differences of near numbers, and the integrand is so smooth that Gauss's rule
/// has all digits.
const SMOOTH: f64 = 0.1;

/// Gauss and Legendre's rule of eight points: places and weights of its positive half (Abramowitz, Stegun, table 25.4).
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_47),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

impl Rim {
    fn root(&self) -> f64 {
        (self.nearest * self.farthest).sqrt()
    }

    /// Around the whole circle: `2 pi (p/w - q d/(w (w + a)))` with `w = sqrt(a^2 - d^2)`; the sine's part vanishes.
    fn whole(&self) -> f64 {
        let w = self.root();
        TAU * (self.p / w - self.q * self.d / (w * (w + self.a)))
    }

    /// From t0 to t1, both within (-2 pi, 2 pi).
    fn arc(&self, t0: f64, t1: f64) -> f64 {
        if self.d < SMOOTH * self.a {
            return self.by_gauss(t0, t1);
        }
        let w = self.root();
        let (near, far) = (self.nearest.sqrt(), self.farthest.sqrt());
        // the integral of 1 / (a + d cos t), continuous over that range
        let inverse = |t: f64| 2.0 / w * libm::atan2(near * libm::sin(0.5 * t), far * libm::cos(0.5 * t));
        let below = |t: f64| self.a + self.d * libm::cos(t);
        let slope = self.q / self.d;
        let cosines = slope * (t1 - t0) + (self.p - slope * self.a) * (inverse(t1) - inverse(t0));
        cosines - self.s / self.d * libm::log(below(t1) / below(t0))
    }

    fn by_gauss(&self, t0: f64, t1: f64) -> f64 {
        const PANELS: u32 = 4;
        let half = 0.5 * (t1 - t0) / f64::from(PANELS);
        let value = |t: f64| {
            let (sin, cos) = (libm::sin(t), libm::cos(t));
            (self.p + self.q * cos + self.s * sin) / (self.a + self.d * cos)
        };
        let panel = |i: u32| {
            let middle = t0 + half * f64::from(2 * i + 1);
            let sum: f64 = GAUSS.iter().map(|&(x, w)| w * (value(middle + half * x) + value(middle - half * x))).sum();
            half * sum
        };
        (0..PANELS).map(panel).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::random::Pcg32;

    #[test]
    fn discs_have_the_catalogues_form_factors() {
        // radius over distance from the axis, height over distance from the axis
        for (r, h) in [(0.5, 1.0), (3.0, 0.2), (0.01, 0.5), (0.99, 0.01), (1e-3, 40.0)] {
            let z: f64 = 1.0 + h * h + r * r;
            let root = (z * z - 4.0 * r * r).sqrt();
            let centre = DVec3::new(1.0, h, 0.0);
            // (1 - (z - 2 r^2) / root) / 2, without the difference of near numbers where there is one
            let rest = z - 2.0 * r * r;
            let parallel = if rest > 0.0 { 2.0 * r * r * h * h / (root * (root + rest)) } else { 0.5 * (1.0 - rest / root) };
            let got = irradiance_over_pi(centre, DVec3::NEG_Y, r, DVec3::Y);
            assert!((got / parallel - 1.0).abs() < 1e-9, "parallel {r} {h}: {got} {parallel}");
            // a vertical receiver that looks towards the axis; the catalogue's needs the whole disc before it
            if r < 1.0 {
                let perpendicular = 0.5 * h * (4.0 * r * r) / (root * (z + root));
                let got = irradiance_over_pi(centre, DVec3::NEG_Y, r, DVec3::X);
                assert!((got / perpendicular - 1.0).abs() < 1e-9, "perpendicular {r} {h}: {got} {perpendicular}");
            }
        }
        let coaxial = irradiance_over_pi(DVec3::Y * 2.0, DVec3::Y, 1.5, DVec3::Y);
        assert!((coaxial - 2.25 / 6.25).abs() < 1e-15);
        assert_eq!(irradiance_over_pi(DVec3::X * 2.0, DVec3::Y, 1.5, DVec3::X), 0.0);
    }

    #[test]
    fn discs_are_polygons_of_many_corners() {
        let mut rng = Pcg32::new(4, 4);
        let mut number = |low: f32, high: f32| f64::from(rng.range_f32(low, high));
        for i in 0..300 {
            let size = [0.02, 0.5, 3.0][i % 3];
            let mut vector = || DVec3::new(number(-1.0, 1.0), number(-1.0, 1.0), number(-1.0, 1.0));
            let (centre, facing, normal) = (vector(), vector().try_normalize().unwrap(), vector().try_normalize().unwrap());
            let (x, y) = basis(facing);
            let sides = 2000;
            let at = |k: usize| {
                let t = TAU * k as f64 / sides as f64;
                centre + (x * libm::cos(t) + y * libm::sin(t)) * size
            };
            // as a fan, for a polygon of the clipper has at most four corners
            let exact: f64 = (0..sides).map(|k| polygon::irradiance_over_pi(&[centre, at(k), at(k + 1)], normal)).sum();
            let got = irradiance_over_pi(centre, facing, size, normal);
            assert!(
                (got - exact).abs() < 2e-5 * (exact + 0.01 * size * size),
                "{centre} {facing} {size} {normal}: {got} {exact}"
            );
        }
    }
}
