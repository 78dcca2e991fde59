//! Shapes that tests of several modules use.

use glam::Vec3;
use heliodon_mesh::Mesh;

/// A closed box of 12 triangles over 8 vertices.
pub(crate) fn cube(low: Vec3, high: Vec3) -> Mesh {
    let pick = |bit: u32, low: f32, high: f32| if bit == 1 { high } else { low };
    let corner = |i: u32| Vec3::new(pick(i & 1, low.x, high.x), pick(i >> 1 & 1, low.y, high.y), pick(i >> 2, low.z, high.z));
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh { positions: (0..8).map(corner).collect(), triangles, ..Mesh::default() }
}

/// A square of one metre over so many quads each way, at the heights that a function of x and z says.
pub(crate) fn grid(quads: u32, height: impl Fn(f32, f32) -> f32) -> Mesh {
    let at = |i: u32| i as f32 / quads as f32;
    let row = |i: u32| (0..=quads).map(move |j| (at(i), at(j)));
    let positions = (0..=quads).flat_map(row).map(|(x, z)| Vec3::new(x, height(x, z), z)).collect();
    let quad = |i: u32, j: u32| {
        let a = i * (quads + 1) + j;
        [[a, a + 1, a + quads + 2], [a, a + quads + 2, a + quads + 1]]
    };
    let triangles = (0..quads).flat_map(|i| (0..quads).flat_map(move |j| quad(i, j))).collect();
    Mesh { positions, triangles, ..Mesh::default() }
}

/// Meshes side by side in one.
pub(crate) fn joined(meshes: &[Mesh]) -> Mesh {
    let mut all = Mesh::default();
    for mesh in meshes {
        all.append(mesh).unwrap();
    }
    all
}

/// A strip of so many quads with half a turn in it.
pub(crate) fn moebius(quads: u32) -> Mesh {
    let point = |i: u32, side: f32| {
        let around = i as f32 / quads as f32 * std::f32::consts::TAU;
        let (sin, cos) = (0.5 * around).sin_cos();
        let radius = 1.0 + side * 0.3 * cos;
        Vec3::new(radius * around.cos(), side * 0.3 * sin, radius * around.sin())
    };
    let positions = (0..quads).flat_map(|i| [point(i, -1.0), point(i, 1.0)]).collect();
    let quad = |i: u32| {
        let (a, b) = (2 * i, 2 * i + 1);
        let (c, d) = if i + 1 == quads { (1, 0) } else { (a + 2, b + 2) };
        [[a, b, c], [b, d, c]]
    };
    Mesh { positions, triangles: (0..quads).flat_map(quad).collect(), ..Mesh::default() }
}
