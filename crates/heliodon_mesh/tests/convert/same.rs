//! Whether two models are one within bounds: triangle by triangle, whatever their order and their first corners, at rest and in every clip.

use glam::{Vec2, Vec3};
use heliodon_mesh::convert::Bounds;
use heliodon_mesh::motion::{MovingMesh, Pose};
use heliodon_mesh::{Material, Mesh};

/// What floats lose on the way, metres and parts.
const ROUNDING: f32 = 2.0e-5;

/// What the most uneven node of these tests makes of an angle between normals, at most: its scales go from 0.5 to 2.
const UNEVEN: f32 = 4.0;

struct Corner {
    position: Vec3,
    normal: Vec3,
    uv: Vec2,
    color: Vec3,
}

fn corner(mesh: &Mesh, vertex: u32) -> Corner {
    let vertex = vertex as usize;
    Corner {
        position: mesh.positions[vertex],
        normal: mesh.normals[vertex],
        uv: mesh.uvs.get(vertex).copied().unwrap_or_default(),
        color: mesh.colors_linear.get(vertex).copied().unwrap_or_default(),
    }
}

fn is_near(a: &Corner, b: &Corner, bounds: &Bounds) -> bool {
    a.position.distance(b.position) <= bounds.position_m as f32 + ROUNDING
        && (a.uv - b.uv).abs().max_element() <= bounds.uv as f32 * 1.01 + ROUNDING * 0.1
        && (a.color - b.color).abs().max_element() <= bounds.color as f32 * 1.01 + 1e-6
        && a.normal.angle_between(b.normal).to_degrees() <= bounds.normal_deg as f32 * UNEVEN + 0.05
}

fn look(mesh: &Mesh, triangle: usize) -> (String, Option<String>) {
    let material = mesh.triangle_material.get(triangle).map(|&m| &mesh.materials[usize::from(m)]);
    let color = |m: &Material| format!("{} {:?}", m.name, m.base_color_linear);
    (material.map(color).unwrap_or_default(), material.and_then(|m| m.texture.as_ref()).map(|t| format!("{:?}", t.wrap)))
}

/// The corners of `after` that are those of `before`, for every triangle.
fn pairs(before: &Mesh, after: &Mesh, bounds: &Bounds) -> Vec<(u32, u32)> {
    let mut taken = vec![false; after.triangles.len()];
    // sorted by x, so that only what is near is looked at
    let middle = |mesh: &Mesh, t: usize| mesh.corners(t).iter().map(|p| p.x).sum::<f32>() / 3.0;
    let mut order: Vec<(f32, usize)> = (0..after.triangles.len()).map(|t| (middle(after, t), t)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let reach = bounds.position_m as f32 + ROUNDING;
    let mut pairs = Vec::new();
    for (t, triangle) in before.triangles.iter().enumerate() {
        let x = middle(before, t);
        let near = &order[order.partition_point(|(other, _)| *other < x - reach)..];
        let mut near =
            near.iter().take_while(|(other, _)| *other <= x + reach).map(|(_, other)| *other).filter(|&other| !taken[other]);
        let found = near.find_map(|other| {
            let turn = (0..3).find(|turn| {
                (0..3).all(|k| {
                    let mate = after.triangles[other][(k + turn) % 3];
                    is_near(&corner(before, triangle[k]), &corner(after, mate), bounds)
                })
            })?;
            (look(before, t) == look(after, other)).then_some((other, turn))
        });
        let (other, turn) = found.unwrap_or_else(|| panic!("triangle {t} {:?} is not there", before.corners(t)));
        taken[other] = true;
        pairs.extend((0..3).map(|k| (triangle[k], after.triangles[other][(k + turn) % 3])));
    }
    pairs
}

/// Panics where they are not.
pub fn assert_same(before: &MovingMesh, after: &MovingMesh, bounds: &Bounds) {
    let (a, b) = (before.rest(), after.rest());
    assert_eq!(a.triangles.len(), b.triangles.len());
    let pairs = pairs(a, b, bounds);
    assert_eq!(before.clips(), after.clips());
    let (mut one, mut other) = (Pose::default(), Pose::default());
    for (k, clip) in before.clips().iter().enumerate() {
        for part in 0..=4 {
            let time_s = clip.duration_s * part as f32 / 4.0;
            before.pose(k, time_s, &mut one);
            after.pose(k, time_s, &mut other);
            for &(vertex, mate) in &pairs {
                let off = one.positions[vertex as usize].distance(other.positions[mate as usize]);
                // weights are off by a part of 65,535 each; limbs are a metre or two from their joints
                let allowed = (bounds.position_m + 8.0 * bounds.weight) as f32 + ROUNDING;
                assert!(off <= allowed, "{} at {time_s} s: {off} m, not {allowed}", clip.name);
            }
        }
    }
}
