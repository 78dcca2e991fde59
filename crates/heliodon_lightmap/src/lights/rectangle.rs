//! Rectangles, sampled evenly over the solid angle that they subtend.
//!
//! C. Ureña, M. Fajardo, A. King: "An Area-Preserving Parametrization for Spherical Rectangles", Computer Graphics Forum 32(4), 2013.
//! The weight of a sample is then the same for all, and only the cosine at the receiver varies; by area it would grow with the inverse
//! square of the distance and with it the noise beside a window. The angles at the corners are taken by arc tangents and not by
//! arc cosines as printed there, which keeps all digits of grazing rectangles.

use crate::lights::polygon;
use glam::DVec3;
use std::f64::consts::TAU;

/// Below this solid angle (steradians) the differences that the map takes have lost half their digits, and the rectangle is so small that
/// samples by area are as good.
const SMALLEST_SR: f64 = 1e-6;

/// A rectangle's shape.
#[derive(Clone, Debug)]
pub(super) struct Rectangle {
    corner: DVec3,
    /// Unit vectors along the edges, and their lengths.
    x: DVec3,
    y: DVec3,
    width: f64,
    height: f64,
    /// `x` cross `y`: the side from which corners go counterclockwise.
    pub normal: DVec3,
}

/// A rectangle as a point sees it: in its own axes, the point at the origin, the plane at `-depth`.
struct Seen {
    x0: f64,
    x1: f64,
    y0: f64,
    y1: f64,
    depth: f64,
    /// The two angles at the corners of the upper edge.
    g2: f64,
    g3: f64,
    solid_angle: f64,
}

/// A point on an emitter, and with which density per steradian it was picked.
pub(super) struct Picked {
    pub position: DVec3,
    pub pdf_sr: f64,
}

impl Rectangle {
    /// A rectangle by a corner and two edges of some length, the second made square to the first.
    pub fn new(corner: DVec3, along: DVec3, up: DVec3) -> Option<Self> {
        let x = along.try_normalize()?;
        let y = (up - x * up.dot(x)).try_normalize()?;
        Some(Self { corner, x, y, width: along.length(), height: up.length(), normal: x.cross(y) })
    }

    pub fn area(&self) -> f64 {
        self.width * self.height
    }

    pub fn corners(&self) -> [DVec3; 4] {
        let (along, up) = (self.x * self.width, self.y * self.height);
        [self.corner, self.corner + along, self.corner + along + up, self.corner + up]
    }

    /// How far a point lies before the plane, metres; negative behind.
    pub fn height_of(&self, point: DVec3) -> f64 {
        (point - self.corner).dot(self.normal)
    }

    /// `None` for points in its plane.
    fn seen_from(&self, point: DVec3) -> Option<Seen> {
        let to = self.corner - point;
        let depth = to.dot(self.normal).abs();
        if depth == 0.0 {
            return None;
        }
        let (x0, y0) = (to.dot(self.x), to.dot(self.y));
        let (x1, y1) = (x0 + self.width, y0 + self.height);
        // the angle between the planes through two neighbouring edges and the point, from the normals of eq. 3
        let at_corner = |x: f64, y: f64, sign: f64| libm::atan2(depth * (x * x + y * y + depth * depth).sqrt(), sign * x * y);
        let (g0, g1) = (at_corner(x1, y0, 1.0), at_corner(x1, y1, -1.0));
        let (g2, g3) = (at_corner(x0, y1, 1.0), at_corner(x0, y0, -1.0));
        Some(Seen { x0, x1, y0, y1, depth, g2, g3, solid_angle: g0 + g1 + g2 + g3 - TAU })
    }

    /// A point on the rectangle; `None` from its plane.
    pub fn sample(&self, point: DVec3, numbers: [f64; 2]) -> Option<Picked> {
        let seen = self.seen_from(point)?;
        let (along, up) = if seen.solid_angle > SMALLEST_SR {
            let (x, y) = seen.sample(numbers);
            (x - seen.x0, y - seen.y0)
        } else {
            (numbers[0] * self.width, numbers[1] * self.height)
        };
        let position = self.corner + self.x * along + self.y * up;
        Some(Picked { position, pdf_sr: self.density(&seen, point, position) })
    }

    /// With which density per steradian [`Rectangle::sample`] picks a point of the rectangle.
    pub fn pdf_sr(&self, point: DVec3, position: DVec3) -> f64 {
        self.seen_from(point).map_or(0.0, |seen| self.density(&seen, point, position))
    }

    fn density(&self, seen: &Seen, point: DVec3, position: DVec3) -> f64 {
        if seen.solid_angle > SMALLEST_SR {
            return 1.0 / seen.solid_angle;
        }
        let squared = (position - point).length_squared();
        squared * squared.sqrt() / (self.area() * seen.depth)
    }

    /// Irradiance over pi from radiance one.
    pub fn irradiance_over_pi(&self, point: DVec3, normal: DVec3) -> f64 {
        if self.height_of(point) == 0.0 {
            return 0.0;
        }
        polygon::irradiance_over_pi(&self.corners().map(|corner| corner - point), normal)
    }

    /// Where a ray of unit direction meets it: how far on.
    pub fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let t = -self.height_of(origin) / direction.dot(self.normal);
        let at = origin + direction * t - self.corner;
        let (x, y) = (at.dot(self.x), at.dot(self.y));
        let inside = (0.0..=self.width).contains(&x) && (0.0..=self.height).contains(&y);
        (t > 0.0 && inside).then_some(t)
    }
}

impl Seen {
    /// Listing 2 of the paper.
    fn sample(&self, numbers: [f64; 2]) -> (f64, f64) {
        let (depth, y0, y1) = (self.depth, self.y0, self.y1);
        // the z components of the planes' normals below and above
        let (b0, b1) = (-y0 / (y0 * y0 + depth * depth).sqrt(), y1 / (y1 * y1 + depth * depth).sqrt());
        let angle = numbers[0] * self.solid_angle + TAU - self.g2 - self.g3;
        let f = (libm::cos(angle) * b0 - b1) / libm::sin(angle);
        let c = (1.0_f64.copysign(f) / (f * f + b0 * b0).sqrt()).clamp(-1.0, 1.0);
        let x = inside(c * depth / ((1.0 - c) * (1.0 + c)).max(0.0).sqrt(), self.x0, self.x1);
        let d = (x * x + depth * depth).sqrt();
        let (h0, h1) = (y0 / (d * d + y0 * y0).sqrt(), y1 / (d * d + y1 * y1).sqrt());
        let h = (h0 + numbers[1] * (h1 - h0)).clamp(-1.0, 1.0);
        let y = inside(h * d / ((1.0 - h) * (1.0 + h)).max(0.0).sqrt(), y0, y1);
        (x, y)
    }
}

/// What rounding pushed out goes back in; what it left without a value goes to the low end.
fn inside(value: f64, low: f64, high: f64) -> f64 {
    if value.is_nan() { low } else { value.max(low).min(high) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::triangle;
    use heliodon_math::random::Pcg32;

    #[test]
    fn solid_angles_are_those_of_two_triangles() {
        let mut rng = Pcg32::new(5, 1);
        let mut vector = |size: f32| DVec3::from_array([(); 3].map(|()| f64::from(rng.range_f32(-size, size))));
        for size in [0.1, 1.0, 10.0, 1000.0] {
            for _ in 0..200 {
                let along = vector(2.0);
                let up = along.cross(vector(2.0));
                let rectangle = Rectangle::new(vector(2.0), along, up).unwrap();
                let point = vector(size);
                let [a, b, c, d] = rectangle.corners().map(|corner| corner - point);
                let normal = rectangle.normal * rectangle.area();
                let exact = (triangle::solid_angle([a, b, c], normal) + triangle::solid_angle([a, c, d], normal)).abs();
                let got = rectangle.seen_from(point).unwrap().solid_angle;
                assert!((got - exact).abs() < 1e-13 + 1e-9 * exact, "{got} {exact}");
            }
        }
    }

    #[test]
    fn samples_are_even_over_the_solid_angle() {
        let rectangle = Rectangle::new(DVec3::new(-1.0, 1.0, 2.0), DVec3::X * 3.0, DVec3::Z * 0.7).unwrap();
        let point = DVec3::new(0.4, 0.3, 1.5);
        let omega = rectangle.seen_from(point).unwrap().solid_angle;
        let n = 100;
        for (width, height) in [(1.0, 0.7), (1.7, 0.2), (3.0, 0.35)] {
            let part = Rectangle::new(rectangle.corner, DVec3::X * width, DVec3::Z * height).unwrap();
            let share = part.seen_from(point).unwrap().solid_angle / omega;
            let hits = (0..n * n)
                .filter(|i| {
                    let u = [(f64::from(i % n) + 0.5) / f64::from(n), (f64::from(i / n) + 0.5) / f64::from(n)];
                    let at = rectangle.sample(point, u).unwrap().position - rectangle.corner;
                    assert!(at.y.abs() < 1e-12 && (0.0..=3.0).contains(&at.x) && (0.0..=0.7).contains(&at.z));
                    at.x < width && at.z < height
                })
                .count();
            assert!((hits as f64 / f64::from(n * n) - share).abs() < 0.01, "{hits} {share}");
        }
    }
}
