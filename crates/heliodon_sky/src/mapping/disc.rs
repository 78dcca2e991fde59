//! The three mappings onto a disc. Disc coordinates: a to the right, b up, the rim at radius 1.

use super::Mapping;
use glam::DVec3;
use std::f64::consts::PI;

/// Pixel position to disc coordinates; the disc is the largest circle about the image's centre.
pub(super) fn from_pixel(w: f64, h: f64, x: f64, y: f64) -> (f64, f64) {
    let radius = 0.5 * w.min(h);
    ((x - 0.5 * w) / radius, (0.5 * h - y) / radius)
}

pub(super) fn to_pixel(w: f64, h: f64, a: f64, b: f64) -> (f64, f64) {
    let radius = 0.5 * w.min(h);
    (0.5 * w + a * radius, 0.5 * h - b * radius)
}

/// The angle at the rim of the equidistant mappings.
fn rim_angle(mapping: Mapping) -> f64 {
    match mapping {
        Mapping::Fisheye { opening_deg } => 0.5 * opening_deg.to_radians(),
        _ => PI,
    }
}

pub(super) fn direction(mapping: Mapping, a: f64, b: f64) -> Option<DVec3> {
    let r = libm::hypot(a, b);
    if r > 1.0 {
        return None;
    }
    // sine of the angle from the axis, over r; and the cosine
    let (sine_over_r, cosine) = match mapping {
        // sin t = 2 sin(t/2) cos(t/2), cos t = 1 - 2 sin^2(t/2)
        Mapping::MirrorBall => (2.0 * (1.0 - r * r).max(0.0).sqrt(), 1.0 - 2.0 * r * r),
        _ => {
            let k = rim_angle(mapping);
            let (s, c) = libm::sincos(k * r);
            (if r > 1e-9 { s / r } else { k }, c)
        }
    };
    Some(match mapping {
        Mapping::Fisheye { .. } => DVec3::new(-sine_over_r * a, cosine, -sine_over_r * b),
        _ => DVec3::new(sine_over_r * a, sine_over_r * b, -cosine),
    })
}

pub(super) fn position(mapping: Mapping, d: DVec3) -> Option<(f64, f64)> {
    let (cosine, right, up) = match mapping {
        Mapping::Fisheye { .. } => (d.y, -d.x, -d.z),
        _ => (-d.z, d.x, d.y),
    };
    let sine = libm::hypot(right, up);
    let angle = libm::atan2(sine, cosine);
    let r = match mapping {
        Mapping::MirrorBall => libm::sin(0.5 * angle),
        _ => angle / rim_angle(mapping),
    };
    if r > 1.0 {
        return None;
    }
    Some(if sine > 0.0 { (right / sine * r, up / sine * r) } else { (r, 0.0) })
}

/// Solid angle for area of the unit disc, in sr.
pub(super) fn density(mapping: Mapping, a: f64, b: f64) -> f64 {
    match mapping {
        Mapping::MirrorBall => 4.0,
        _ => {
            let k = rim_angle(mapping);
            let u = (k * libm::hypot(a, b)).min(k);
            k * k * if u > 1e-9 { libm::sin(u) / u } else { 1.0 }
        }
    }
}

/// `(1 - cos t(r)) / r^2` from `r^2`: solid angle within radius r is `2 pi r^2` times this.
fn cap_over_r2(mapping: Mapping, r2: f64) -> f64 {
    match mapping {
        Mapping::MirrorBall => 2.0,
        _ => {
            let k = rim_angle(mapping);
            // (1 - cos u) / u^2 = 1/2! - u^2/4! + u^4/6! ..., u at most pi: the terms left out are below 1e-15
            let u2 = k * k * r2;
            let mut sum = 0.0;
            for n in (0..14_u32).rev() {
                sum = SERIES[n as usize] - sum * u2;
            }
            k * k * sum
        }
    }
}

/// `1 / (2 n + 2)!`
const SERIES: [f64; 14] = {
    let mut series = [0.0; 14];
    let mut factorial = 2.0;
    let mut n = 0;
    while n < 14 {
        series[n] = 1.0 / factorial;
        factorial *= ((2 * n + 3) * (2 * n + 4)) as f64;
        n += 1;
    }
    series
};

/// Nodes and weights of three-point Gauss-Legendre quadrature on [0, 1].
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// `integral (1 - cos t) dphi` along the part of a segment that lies in the disc. By Green's theorem the solid angle of a region is
/// this integral around it; neighbours share edges, so that the pixels' sum is the disc's solid angle but for rounding.
fn along_segment(mapping: Mapping, from: (f64, f64), to: (f64, f64)) -> f64 {
    let Some((t0, t1)) = inside_disc(from, to) else { return 0.0 };
    let step = (to.0 - from.0, to.1 - from.1);
    // a db - b da is constant along a straight line
    let turn = from.0 * step.1 - from.1 * step.0;
    let mut sum = 0.0;
    for (node, weight) in GAUSS {
        let t = t0 + (t1 - t0) * node;
        let (a, b) = (from.0 + t * step.0, from.1 + t * step.1);
        sum += weight * cap_over_r2(mapping, a * a + b * b);
    }
    sum * turn * (t1 - t0)
}

/// The part of a segment within the unit circle, as two parameters in [0, 1].
fn inside_disc(from: (f64, f64), to: (f64, f64)) -> Option<(f64, f64)> {
    let norm2 = |p: (f64, f64)| p.0 * p.0 + p.1 * p.1;
    if norm2(from) <= 1.0 && norm2(to) <= 1.0 {
        return Some((0.0, 1.0));
    }
    let step = (to.0 - from.0, to.1 - from.1);
    let (a, b, c) = (norm2(step), from.0 * step.0 + from.1 * step.1, norm2(from) - 1.0);
    let discriminant = b * b - a * c;
    if discriminant <= 0.0 || a <= 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    let (t0, t1) = (((-b - root) / a).max(0.0), ((-b + root) / a).min(1.0));
    (t0 < t1).then_some((t0, t1))
}

/// The solid angle of the part of a pixel that lies in the disc; corners in disc coordinates.
pub(super) fn pixel_solid_angle(mapping: Mapping, left: f64, right: f64, bottom: f64, top: f64) -> f64 {
    let corners = [(left, bottom), (right, bottom), (right, top), (left, top)];
    let edges: f64 = (0..4).map(|i| along_segment(mapping, corners[i], corners[(i + 1) % 4])).sum();
    let far = corners.iter().any(|p| p.0 * p.0 + p.1 * p.1 > 1.0);
    let arcs = if far { cap_over_r2(mapping, 1.0) * arc_inside(left, right, bottom, top) } else { 0.0 };
    (edges + arcs).max(0.0)
}

/// How much of the unit circle, in radians, runs inside a rectangle.
fn arc_inside(left: f64, right: f64, bottom: f64, top: f64) -> f64 {
    let mut angles = [0.0; 9];
    let mut count = 0;
    let mut add = |a: f64, b: f64| {
        angles[count] = libm::atan2(b, a);
        count += 1;
    };
    for a in [left, right] {
        if a.abs() <= 1.0 {
            let b = (1.0 - a * a).sqrt();
            for b in [b, -b] {
                if b >= bottom && b <= top {
                    add(a, b);
                }
            }
        }
    }
    for b in [bottom, top] {
        if b.abs() <= 1.0 {
            let a = (1.0 - b * b).sqrt();
            for a in [a, -a] {
                if a >= left && a <= right {
                    add(a, b);
                }
            }
        }
    }
    let contains = |angle: f64| {
        let (b, a) = libm::sincos(angle);
        a > left && a < right && b > bottom && b < top
    };
    if count == 0 {
        return if contains(0.0) { 2.0 * PI } else { 0.0 };
    }
    let found = &mut angles[..count];
    found.sort_by(f64::total_cmp);
    let mut sum = 0.0;
    for i in 0..count {
        let next = if i + 1 < count { found[i + 1] } else { found[0] + 2.0 * PI };
        if contains(0.5 * (found[i] + next)) {
            sum += next - found[i];
        }
    }
    sum
}
