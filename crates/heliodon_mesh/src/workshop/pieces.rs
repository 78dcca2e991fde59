//! Closed pieces of one material: boxes, beams, turned pieces, bars with an outline. Faces that meet at a crease have vertices
//! of their own.

use crate::figures::shape::Shape;
use crate::temple::solid::SolidMesh;
use glam::{Vec2, Vec3};
use heliodon_math::frame::unit_or;
use std::f32::consts::TAU;

/// Where the outline of a turned piece bends by less than 40 degrees, it is smooth there.
const CREASE_COSINE: f32 = 0.766;

/// Adds a flat convex polygon, counter-clockwise seen from its front, with vertices of its own.
pub fn add_polygon(mesh: &mut SolidMesh, corners: &[Vec3], color_linear: Vec3) {
    let first = mesh.positions.len() as u32;
    // Newell's sum: right for any polygon, also where its first corners lie on one line
    let sum = corners.iter().zip(corners.iter().cycle().skip(1)).fold(Vec3::ZERO, |sum, (a, b)| sum + a.cross(*b - *a));
    let normal = unit_or(sum, Vec3::Y);
    for &corner in corners {
        mesh.positions.push(corner);
        mesh.normals.push(normal);
        mesh.colors_linear.push(color_linear);
    }
    mesh.triangles.extend((2..corners.len() as u32).map(|k| [first, first + k - 1, first + k]));
}

/// A box between its least and its greatest corner.
pub fn cuboid(low: Vec3, high: Vec3, color_linear: Vec3) -> SolidMesh {
    hexahedron(
        std::array::from_fn(|i| {
            Vec3::new(
                if i & 1 == 0 { low.x } else { high.x },
                if i & 2 == 0 { low.y } else { high.y },
                if i & 4 == 0 { low.z } else { high.z },
            )
        }),
        color_linear,
    )
}

/// A box by its middle and its size.
pub fn cuboid_at(middle: Vec3, size: Vec3, color_linear: Vec3) -> SolidMesh {
    cuboid(middle - size * 0.5, middle + size * 0.5, color_linear)
}

/// A solid with six flat faces. The bits of a corner's number say whether it lies high along X (1), Y (2) and Z (4).
pub fn hexahedron(corners: [Vec3; 8], color_linear: Vec3) -> SolidMesh {
    const FACES: [[usize; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let mut mesh = SolidMesh::default();
    for face in FACES {
        add_polygon(&mut mesh, &face.map(|i| corners[i]), color_linear);
    }
    mesh
}

/// A straight timber from `from` to `to`: `width` sideways and `height` in the plane of `up`.
pub fn beam(from: Vec3, to: Vec3, width: f32, height: f32, up: Vec3, color_linear: Vec3) -> SolidMesh {
    let along = unit_or(to - from, Vec3::X);
    let side = unit_or(along.cross(up), along.any_orthonormal_vector());
    let up = side.cross(along);
    hexahedron(
        std::array::from_fn(|i| {
            (if i & 1 == 0 { from } else { to })
                + up * (height * if i & 2 == 0 { -0.5 } else { 0.5 })
                + side * (width * if i & 4 == 0 { -0.5 } else { 0.5 })
        }),
        color_linear,
    )
}

/// A bar with a convex outline, given counter-clockwise in X and Y, from `z0` to `z1`.
pub fn extruded(outline: &[Vec2], z0: f32, z1: f32, color_linear: Vec3) -> SolidMesh {
    let mut mesh = SolidMesh::default();
    let front: Vec<Vec3> = outline.iter().map(|p| p.extend(z1)).collect();
    let back: Vec<Vec3> = outline.iter().rev().map(|p| p.extend(z0)).collect();
    add_polygon(&mut mesh, &front, color_linear);
    add_polygon(&mut mesh, &back, color_linear);
    for (a, b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
        add_polygon(&mut mesh, &[a.extend(z0), b.extend(z0), b.extend(z1), a.extend(z1)], color_linear);
    }
    mesh
}

/// A piece turned about +Y: `profile` holds radii and heights, from the lowest inside to the highest, on the way that keeps the
/// solid to its left. An end off the axis gets a flat lid.
pub fn lathe(profile: &[(f32, f32)], sides: u32, color_linear: Vec3) -> SolidMesh {
    let mut mesh = SolidMesh::default();
    let at = |k: u32, (radius, y): (f32, f32)| {
        let (sin, cos) = libm::sincosf(TAU * (k % sides) as f32 / sides as f32);
        (Vec3::new(radius * cos, y, -radius * sin), Vec3::new(cos, 0.0, -sin))
    };
    let slopes: Vec<Vec2> =
        profile.windows(2).map(|pair| Vec2::new(pair[1].1 - pair[0].1, pair[0].0 - pair[1].0).normalize_or(Vec2::X)).collect();
    // the normal of a row of one strip, smoothed with that of the strip beyond it
    let smoothed = |own: usize, other: Option<usize>| match other.and_then(|i| slopes.get(i)) {
        Some(other) if slopes[own].dot(*other) > CREASE_COSINE => (slopes[own] + *other).normalize_or(slopes[own]),
        _ => slopes[own],
    };
    for (strip, ends) in profile.windows(2).enumerate() {
        let rows = [(ends[0], smoothed(strip, strip.checked_sub(1))), (ends[1], smoothed(strip, Some(strip + 1)))];
        let first = mesh.positions.len() as u32;
        for (end, slope) in rows {
            for k in 0..sides {
                let (p, outwards) = at(k, end);
                mesh.positions.push(p);
                mesh.normals.push(unit_or(outwards * slope.x + Vec3::Y * slope.y, Vec3::Y));
                mesh.colors_linear.push(color_linear);
            }
        }
        for k in 0..sides {
            let [a, b] = [first + k, first + (k + 1) % sides];
            let [d, c] = [a + sides, b + sides];
            // at the axis one of the two has no area
            if ends[0].0 > 0.0 {
                mesh.triangles.push([a, b, c]);
            }
            if ends[1].0 > 0.0 {
                mesh.triangles.push([a, c, d]);
            }
        }
    }
    let lid = |end: Option<&(f32, f32)>, upwards: bool, mesh: &mut SolidMesh| {
        if let Some(&end) = end.filter(|end| end.0 > 0.0) {
            let mut ring: Vec<Vec3> = (0..sides).map(|k| at(k, end).0).collect();
            if !upwards {
                ring.reverse();
            }
            add_polygon(mesh, &ring, color_linear);
        }
    };
    lid(profile.first(), false, &mut mesh);
    lid(profile.last(), true, &mut mesh);
    mesh
}

/// A round pole from `from` to `to`.
pub fn pole(from: Vec3, to: Vec3, radii: (f32, f32), sides: u32, color_linear: Vec3) -> SolidMesh {
    let length = from.distance(to);
    let up = unit_or(to - from, Vec3::Y);
    let x = up.any_orthonormal_vector();
    framed(lathe(&[(radii.0, 0.0), (radii.1, length)], sides, color_linear), from, [x, up, x.cross(up)])
}

/// A smooth piece of one colour.
pub fn smooth(shape: Shape, color_linear: Vec3) -> SolidMesh {
    let mut mesh = SolidMesh { positions: shape.positions, triangles: shape.triangles, ..SolidMesh::default() };
    mesh.compute_normals(&[]);
    mesh.colors_linear = vec![color_linear; mesh.positions.len()];
    mesh
}

/// The piece with its axes along the right-handed unit vectors `axes` and its origin at `origin`.
pub fn framed(mut mesh: SolidMesh, origin: Vec3, axes: [Vec3; 3]) -> SolidMesh {
    let turned = |v: Vec3| axes[0] * v.x + axes[1] * v.y + axes[2] * v.z;
    mesh.positions.iter_mut().for_each(|p| *p = origin + turned(*p));
    mesh.normals.iter_mut().for_each(|n| *n = unit_or(turned(*n), Vec3::Y));
    mesh
}

/// The pieces turned about +Y, counter-clockwise seen from above, and moved.
pub fn placed(meshes: Vec<SolidMesh>, at: Vec3, yaw_rad: f32) -> impl Iterator<Item = SolidMesh> {
    let (sin, cos) = libm::sincosf(yaw_rad);
    let axes = [Vec3::new(cos, 0.0, -sin), Vec3::Y, Vec3::new(sin, 0.0, cos)];
    meshes.into_iter().map(move |mesh| framed(mesh, at, axes))
}
