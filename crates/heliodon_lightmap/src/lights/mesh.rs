//! Triangles that shine.
//!
//! Which triangle: a mesh of up to [`BY_SOLID_ANGLE`] triangles (an opening, a lantern's panes) is weighed anew for every point, each
//! triangle by the solid angle that it turns towards the point, so the whole mesh is sampled evenly over its solid angle; a larger one by
//! running sums of area and a binary search, which, unlike an alias table, keeps neighbouring numbers on neighbouring triangles. Of a
//! closed mesh sampled so about half of the samples fall on triangles that look away, and are lost; and as a sample's first number picks
//! the triangle as well as the place on it, 24 random bits leave few places on each of millions of triangles.
//! Where on it: evenly over its spherical triangle (Arvo 1995), or by area where that is small.

use crate::lights::polygon;
use crate::lights::rectangle::Picked;
use crate::lights::triangle;
use crate::lights::vector::pick;
use glam::{DVec3, Vec3};

/// Up to so many triangles the exact weights cost less than a ray.
const BY_SOLID_ANGLE: usize = 32;

/// Below this solid angle (steradians) a triangle is sampled by area: Arvo's map keeps four digits down to here.
const SMALLEST_SR: f64 = 1e-4;

/// Up to so many triangles are looked at whether they form a convex body: the test takes each with each corner.
const CONVEX_TEST: usize = 512;

/// What the corners of a convex body may stand out, relative to its size: the rounding of single precision places.
const CONVEX_ROUNDING: f64 = 1e-5;

/// The triangles of a mesh that shines.
#[derive(Clone, Debug, PartialEq)]
pub struct EmissiveTriangles {
    /// Corners, metres, in the coordinates of the scene.
    pub positions: Vec<Vec3>,
    /// Three indices of `positions` each, counterclockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
}

/// A mesh with what sampling needs.
#[derive(Clone, Debug)]
pub(super) struct Mesh {
    mesh: EmissiveTriangles,
    /// Running sums of areas, one more than there are triangles.
    areas: Vec<f64>,
    two_sided: bool,
    /// No triangle hides another from any point before both.
    convex: bool,
}

/// A triangle relative to a point.
struct Relative {
    corners: [DVec3; 3],
    /// The cross product of two edges.
    normal: DVec3,
}

impl Mesh {
    /// # Errors
    /// What is wrong with the mesh, and what to do.
    pub fn new(mesh: EmissiveTriangles, two_sided: bool) -> Result<Self, String> {
        let count = mesh.positions.len();
        if mesh.triangles.is_empty() {
            return Err("has no triangles: name a mesh that has faces".to_owned());
        }
        if mesh.triangles.len() > u32::MAX as usize {
            return Err("has more triangles than 32 bits count: split it".to_owned());
        }
        if let Some(i) = mesh.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= count)) {
            return Err(format!("triangle {i} names a corner that is not there (there are {count}): export it again"));
        }
        let far = |p: &Vec3| p.abs().max_element() > 1e9 || !p.is_finite();
        if let Some(i) = mesh.positions.iter().position(far) {
            return Err(format!("corner {i} lies at {}, which is no place within 1e9 metres: mend it", mesh.positions[i]));
        }
        let mut this = Self { areas: Vec::with_capacity(mesh.triangles.len() + 1), mesh, two_sided, convex: false };
        let mut sum = 0.0;
        this.areas.push(sum);
        for i in 0..this.mesh.triangles.len() {
            sum += 0.5 * this.relative(i, DVec3::ZERO).normal.length();
            this.areas.push(sum);
        }
        if sum <= 0.0 {
            return Err("all of its triangles have no area: check its unit and export it again".to_owned());
        }
        this.convex = this.is_convex();
        Ok(this)
    }

    pub fn area(&self) -> f64 {
        self.areas.last().copied().unwrap_or(0.0)
    }

    pub fn positions(&self) -> impl Iterator<Item = Vec3> {
        self.mesh.triangles.iter().flatten().map(|&v| self.mesh.positions[v as usize])
    }

    /// The middles of `most` triangles at most, spread over all, with their normals.
    pub fn some_middles(&self, most: usize) -> Vec<(DVec3, DVec3)> {
        let every = self.len().div_ceil(most.max(1));
        let middle = |triangle: usize| {
            let [a, b, c] = self.relative(triangle, DVec3::ZERO).corners;
            ((a + b + c) / 3.0, self.normal(triangle as u32))
        };
        (0..self.len()).step_by(every.max(1)).map(middle).collect()
    }

    pub fn len(&self) -> usize {
        self.mesh.triangles.len()
    }

    fn relative(&self, triangle: usize, point: DVec3) -> Relative {
        let [a, b, c] = self.mesh.triangles[triangle].map(|v| self.mesh.positions[v as usize].as_dvec3());
        Relative { corners: [a - point, b - point, c - point], normal: (b - a).cross(c - a) }
    }

    /// The unit normal of a triangle's front; zero where it has none.
    pub fn normal(&self, triangle: u32) -> DVec3 {
        let triangle = triangle as usize;
        if triangle >= self.len() {
            return DVec3::ZERO;
        }
        self.relative(triangle, DVec3::ZERO).normal.try_normalize().unwrap_or(DVec3::ZERO)
    }

    /// The solid angle that it shines from, steradians; 0 from behind.
    fn shining(&self, relative: &Relative) -> f64 {
        let signed = triangle::solid_angle(relative.corners, relative.normal);
        if self.two_sided { signed.abs() } else { signed.max(0.0) }
    }

    /// Running sums of the solid angles, for meshes of few triangles.
    fn solid_angles(&self, point: DVec3) -> Option<[f64; BY_SOLID_ANGLE + 1]> {
        if self.len() > BY_SOLID_ANGLE {
            return None;
        }
        let mut sums = [0.0; BY_SOLID_ANGLE + 1];
        for i in 0..BY_SOLID_ANGLE {
            let part = if i < self.len() { self.shining(&self.relative(i, point)) } else { 0.0 };
            sums[i + 1] = sums[i] + part;
        }
        Some(sums)
    }

    /// A point on a triangle; `None` where the picked one shows its dark side, or none shines here.
    pub fn sample(&self, point: DVec3, numbers: [f64; 2]) -> Option<Picked> {
        let by_angle = self.solid_angles(point);
        let sums = by_angle.as_ref().map_or(&self.areas[..], |sums| &sums[..]);
        let (index, within) = pick(sums, numbers[0])?;
        let relative = self.relative(index, point);
        let shining = self.shining(&relative);
        if shining <= 0.0 {
            return None;
        }
        let [a, b, c] = relative.corners;
        let offset = if shining > SMALLEST_SR {
            let direction = triangle::sample_direction(relative.corners, shining, [within, numbers[1]])?;
            direction * (a.dot(relative.normal) / direction.dot(relative.normal))
        } else {
            // evenly over the area: Turk, "Generating Random Points in Triangles", Graphics Gems, 1990
            let root = within.sqrt();
            a * (1.0 - root) + b * (root * (1.0 - numbers[1])) + c * (root * numbers[1])
        };
        let chance = (sums[index + 1] - sums[index]) / sums.last().copied()?;
        let pdf_sr = chance * density(&relative, offset, shining);
        (offset.is_finite()).then_some(Picked { position: point + offset, pdf_sr })
    }

    /// With which density per steradian [`Mesh::sample`] picks a point of a triangle.
    pub fn pdf_sr(&self, point: DVec3, triangle: u32, position: DVec3) -> f64 {
        let index = triangle as usize;
        if index >= self.len() {
            return 0.0;
        }
        let relative = self.relative(index, point);
        let shining = self.shining(&relative);
        if shining <= 0.0 {
            return 0.0;
        }
        let by_angle = self.solid_angles(point);
        let sums = by_angle.as_ref().map_or(&self.areas[..], |sums| &sums[..]);
        let chance = (sums[index + 1] - sums[index]) / sums.last().copied().unwrap_or(1.0);
        chance * density(&relative, position - point, shining)
    }

    /// Irradiance over pi from radiance one; `None` for meshes that may hide parts of themselves.
    pub fn irradiance_over_pi(&self, point: DVec3, normal: DVec3) -> Option<f64> {
        self.convex.then(|| self.irradiance_of_all(point, normal))
    }

    /// The same, as if no triangle hid another.
    pub fn irradiance_of_all(&self, point: DVec3, normal: DVec3) -> f64 {
        let parts = (0..self.len()).map(|i| {
            let relative = self.relative(i, point);
            if self.shining(&relative) > 0.0 { polygon::irradiance_over_pi(&relative.corners, normal) } else { 0.0 }
        });
        parts.sum()
    }

    /// All corners lie behind or in the plane of every triangle; for meshes that shine to both sides, in it.
    fn is_convex(&self) -> bool {
        let size = self.positions().fold(0.0_f64, |far, p| far.max((p - self.mesh.positions[0]).as_dvec3().length()));
        let limit = CONVEX_ROUNDING * size;
        self.len() <= CONVEX_TEST
            && (0..self.len()).all(|i| {
                let relative = self.relative(i, DVec3::ZERO);
                let Some(normal) = relative.normal.try_normalize() else { return true };
                self.positions().all(|p| {
                    let out = (p.as_dvec3() - relative.corners[0]).dot(normal);
                    out <= limit && (!self.two_sided || out >= -limit)
                })
            })
    }

    /// The first triangle that a ray of unit direction meets from its shining side or the other: which, and how far on. Each triangle is
    /// asked: scenes of many triangles have their own ray engine.
    ///
    /// Möller, Trumbore: "Fast, Minimum Storage Ray/Triangle Intersection", Journal of Graphics Tools 2(1), 1997.
    pub fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<(u32, f64)> {
        let mut first: Option<(u32, f64)> = None;
        for i in 0..self.len() {
            let [a, b, c] = self.relative(i, origin).corners;
            let (e1, e2) = (b - a, c - a);
            let across = direction.cross(e2);
            let scale = 1.0 / e1.dot(across);
            let u = -a.dot(across) * scale;
            let other = (-a).cross(e1);
            let v = direction.dot(other) * scale;
            let t = e2.dot(other) * scale;
            let meets = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0;
            if meets && first.is_none_or(|(_, nearest)| t < nearest) {
                first = Some((i as u32, t));
            }
        }
        first
    }
}

/// Density per steradian within a triangle, for a place relative to the point.
fn density(relative: &Relative, offset: DVec3, shining: f64) -> f64 {
    if shining > SMALLEST_SR {
        return 1.0 / shining;
    }
    let squared = offset.length_squared();
    // distance^2 over (area * cosine), where the normal's length is twice the area
    2.0 * squared * squared.sqrt() / offset.dot(relative.normal).abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::random::Pcg32;

    fn square() -> EmissiveTriangles {
        let positions =
            vec![Vec3::new(-1.0, 2.0, -1.0), Vec3::new(1.0, 2.0, -1.0), Vec3::new(1.0, 2.0, 1.0), Vec3::new(-1.0, 2.0, 1.0)];
        EmissiveTriangles { positions, triangles: vec![[0, 1, 2], [0, 2, 3]] }
    }

    #[test]
    fn flat_meshes_and_boxes_are_convex_and_bent_ones_are_not() {
        assert!(Mesh::new(square(), true).unwrap().convex);
        let mut bent = square();
        bent.positions[3].y = 1.5;
        let (up, both) = (Mesh::new(bent.clone(), false).unwrap(), Mesh::new(bent.clone(), true).unwrap());
        bent.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        let down = Mesh::new(bent, false).unwrap();
        assert!(up.convex != down.convex && !both.convex);
    }

    /// Random triangles that hide nothing: both ways of picking one sum to the same as all edges.
    #[test]
    fn samples_sum_to_the_light_of_all_triangles() {
        let mut rng = Pcg32::new(8, 2);
        for (count, two_sided) in [(20, false), (20, true), (BY_SOLID_ANGLE + 1, false), (200, true)] {
            let positions: Vec<Vec3> =
                (0..3 * count).map(|_| Vec3::from_array([(); 3].map(|()| rng.range_f32(-1.0, 1.0)))).collect();
            let triangles = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let mesh = Mesh::new(EmissiveTriangles { positions, triangles }, two_sided).unwrap();
            for (place, normal) in
                [(DVec3::ZERO, DVec3::Y), (DVec3::new(0.3, -2.0, 0.1), DVec3::Y), (DVec3::X * 40.0, DVec3::NEG_X)]
            {
                let exact = mesh.irradiance_of_all(place, normal);
                let (mut sum, mut squares, n) = (0.0, 0.0, 20_000);
                for _ in 0..n {
                    let numbers = [f64::from(rng.next_f32()), f64::from(rng.next_f32())];
                    let estimate = mesh.sample(place, numbers).map_or(0.0, |picked| {
                        let cos = (picked.position - place).try_normalize().unwrap().dot(normal).max(0.0);
                        cos / (std::f64::consts::PI * picked.pdf_sr)
                    });
                    sum += estimate;
                    squares += estimate * estimate;
                }
                let mean = sum / f64::from(n);
                let error = ((squares / f64::from(n) - mean * mean) / f64::from(n)).sqrt();
                assert!((mean - exact).abs() < 5.0 * error, "{count} from {place}: {mean} {exact} {error}");
            }
        }
    }

    #[test]
    fn broken_meshes_are_told() {
        let told = |mesh: EmissiveTriangles| Mesh::new(mesh, false).unwrap_err();
        assert!(told(EmissiveTriangles { positions: vec![], triangles: vec![] }).contains("no triangles"));
        assert!(told(EmissiveTriangles { triangles: vec![[0, 1, 9]], ..square() }).contains("triangle 0"));
        assert!(told(EmissiveTriangles { triangles: vec![[0, 1, 1]], ..square() }).contains("no area"));
        let mut nan = square();
        nan.positions[2].x = f32::NAN;
        assert!(told(nan).contains("corner 2"));
    }
}
