//! Scenes and a plain loop over all triangles, in double precision where it matters.

use glam::{DVec3, Vec3};
use heliodon_math::random::Pcg32;
use heliodon_rays::{BuildParams, Hit, Quality, Ray, TriangleScene};

/// Positions and triangles.
pub type Soup = (Vec<Vec3>, Vec<[u32; 3]>);

pub fn number(rng: &mut Pcg32) -> f32 {
    rng.next_f32() * 2.0 - 1.0
}

pub fn point(rng: &mut Pcg32) -> Vec3 {
    Vec3::new(number(rng), number(rng), number(rng))
}

pub fn direction(rng: &mut Pcg32) -> Vec3 {
    loop {
        let d = point(rng);
        if d.length_squared() > 0.01 {
            return d;
        }
    }
}

/// Triangles of very different sizes, some along the axes.
pub fn soup(count: usize, seed: u64) -> Soup {
    let mut rng = Pcg32::new(seed, 1);
    let mut positions = Vec::new();
    for i in 0..count {
        let size = if i % 10 == 0 { 1.0 } else { 0.1 };
        let at = point(&mut rng) * 2.0;
        for _ in 0..3 {
            let mut corner = point(&mut rng) * size;
            if i % 7 == 0 {
                corner.y = 0.0;
            }
            positions.push(at + corner);
        }
    }
    (positions, (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// A bumpy sheet of n x n quads in [-1, 1], as a scan is: connected, about evenly sized.
pub fn sheet(n: usize, seed: u64) -> Soup {
    let mut rng = Pcg32::new(seed, 2);
    let mut positions = Vec::new();
    for z in 0..=n {
        for x in 0..=n {
            let (u, v) = (x as f32 / n as f32 * 2.0 - 1.0, z as f32 / n as f32 * 2.0 - 1.0);
            let height = 0.3 * (u * 5.0).sin() * (v * 4.0).cos() + number(&mut rng) * 0.3 / n as f32;
            positions.push(Vec3::new(u, height, v));
        }
    }
    let row = n as u32 + 1;
    let quad = |i: u32| [[i, i + row, i + 1], [i + 1, i + row, i + row + 1]];
    let triangles = (0..n as u32).flat_map(|z| (0..n as u32).flat_map(move |x| quad(z * row + x))).collect();
    (positions, triangles)
}

pub fn build(soup: &Soup) -> TriangleScene {
    TriangleScene::build(&soup.0, &soup.1, &BuildParams::default()).expect("indices in range")
}

pub fn build_with(soup: &Soup, quality: Quality) -> TriangleScene {
    TriangleScene::build(&soup.0, &soup.1, &BuildParams { quality }).expect("indices in range")
}

/// What one triangle says about one ray, in double precision.
pub struct Exact {
    pub t: f64,
    pub u: f64,
    pub v: f64,
    pub back: bool,
    /// How far the ray passes inside (positive) or outside the triangle's edges, as the least barycentric weight.
    pub margin: f64,
}

pub fn exact(ray: &Ray, corners: [Vec3; 3]) -> Option<Exact> {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let (o, d): (DVec3, DVec3) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (e1, e2) = (b - a, c - a);
    let normal = e1.cross(e2);
    let det = -d.dot(normal);
    if det == 0.0 {
        return None;
    }
    let s = o - a;
    let t = s.dot(normal) / det;
    let along = s.cross(d);
    let (u, v) = (e2.dot(along) / det, -e1.dot(along) / det);
    Some(Exact { t, u, v, back: det < 0.0, margin: u.min(v).min(1.0 - u - v) })
}

/// Checks a hit against all triangles: right where the question has a clear answer, and possible everywhere.
pub fn check_hit(soup: &Soup, ray: &Ray, hit: &Hit) {
    let all: Vec<(u32, Exact)> = soup
        .1
        .iter()
        .enumerate()
        .filter_map(|(i, t)| exact(ray, t.map(|v| soup.0[v as usize])).map(|e| (i as u32, e)))
        .collect();
    let (slack, slack_t) = (1e-3, 1e-4);
    let counts = |e: &Exact, t_slack: f64| e.t > f64::from(ray.t_min) + t_slack && e.t < f64::from(ray.t_max) - t_slack;
    let sure =
        all.iter().filter(|(_, e)| e.margin > slack && counts(e, slack_t)).map(|(_, e)| e.t).fold(f64::INFINITY, f64::min);
    if !hit.is_some() {
        assert!(sure.is_infinite(), "{ray:?} meets something at {sure} that was missed");
        return;
    }
    let (_, found) = all.iter().find(|(i, _)| *i == hit.triangle).expect("a triangle that the ray can meet");
    assert!(found.margin > -slack && counts(found, -slack_t), "{ray:?} does not meet {hit:?}");
    assert!(f64::from(hit.t) < sure + slack_t, "{ray:?} meets something at {sure}, before {hit:?}");
    assert!((f64::from(hit.t) - found.t).abs() < slack_t, "{hit:?} should be at {}", found.t);
    assert!(
        (f64::from(hit.u) - found.u).abs() < slack && (f64::from(hit.v) - found.v).abs() < slack,
        "{hit:?} {} {}",
        found.u,
        found.v
    );
    assert_eq!(hit.back, found.back, "{ray:?} {hit:?}");
}
