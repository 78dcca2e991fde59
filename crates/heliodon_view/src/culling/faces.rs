//! Occluders on large flat faces of surfaces that are no closed bodies: walls that are modelled as sheets.
//!
//! Triangles that share edges and lie in one plane make a patch, without a gap since they share their corners; rectangles in its outline are occluders.
//! A patch is flat but for a hair, and its occluders keep off its rim by so many hairs that no ray that may be hidden passes the
//! surface beside it: where a sheet's height over its plane stays below h, a ray of slope s crosses the sheet within h / s of where it crosses the plane.

use super::shadow::{GRAZING, Kind, Occluder};
use super::slice::{Axes, Segment, rectangles};
use super::solids::{LEAST_AREA_M2, Stone, worth};
use glam::Vec3;
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// Surfaces of more triangles are scans, of which no wall is flat; looking at each would take seconds.
const MOST_TRIANGLES: usize = 1 << 21;
/// The largest triangles that are tried as beginnings of patches.
const BEGINNINGS: usize = 512;
/// Occluders on faces: a view looks at each.
const MOST_OCCLUDERS: usize = 128;
/// A patch is flat but for this, as a part of the distance from the origin: four steps of single precision.
const OFF_PLANE: f32 = 4.0 * f32::EPSILON;
/// The least cosine between normals of a patch: one degree.
const SAME_NORMAL: f32 = 0.99985;

/// A triangle of an open surface: the numbers of its corners, which positions share, its unit normal and its area.
struct Face {
    corners: [u32; 3],
    normal: Vec3,
    area: f32,
}

/// Occluders on the largest flat patches of surfaces that are not closed.
#[must_use]
pub fn occluders(stone: Stone) -> Vec<Occluder> {
    let Some((positions, faces)) = open_faces(stone) else { return Vec::new() };
    let mut edges = SidesOfEdges::new();
    for (number, face) in faces.iter().enumerate() {
        sides(face).for_each(|(a, b)| match edges.entry((a.min(b), a.max(b))) {
            Entry::Vacant(edge) => drop(edge.insert([number as u32, NOBODY])),
            Entry::Occupied(mut edge) => {
                let [_, other] = edge.get_mut();
                *other = if *other == NOBODY { number as u32 } else { MANY };
            }
        });
    }
    let mut order: Vec<usize> = (0..faces.len()).collect();
    order.sort_by(|&a, &b| faces[b].area.total_cmp(&faces[a].area));
    let mut patch_of = vec![u32::MAX; faces.len()];
    let mut found = Vec::new();
    for (patch, &first) in (0u32..).zip(order.iter().take(BEGINNINGS)) {
        if patch_of[first] != u32::MAX {
            continue;
        }
        let off_m = OFF_PLANE * positions[faces[first].corners[0] as usize].length().max(1.0);
        let members = grow(&faces, &positions, &edges, &mut patch_of, (patch, first), off_m);
        let axes = Axes::new(faces[first].normal);
        let plan = |corner: u32| axes.of(positions[corner as usize]);
        let is_rim = |&(a, b): &(u32, u32)| match edges[&(a.min(b), a.max(b))] {
            [_, NOBODY | MANY] => true,
            [one, other] => patch_of[one as usize] != patch_of[other as usize],
        };
        let outline: Vec<Segment> = members
            .iter()
            .flat_map(|&member| sides(&faces[member]).filter(is_rim))
            .map(|(a, b)| [plan(a).truncate(), plan(b).truncate()])
            .collect();
        let height = plan(faces[first].corners[0]).z;
        let rim = f64::from(off_m / GRAZING);
        for [low, high] in rectangles(&outline, LEAST_AREA_M2) {
            let inner = [low.map(|at| at + rim), high.map(|at| at - rim)];
            if inner[0][0] < inner[1][0] && inner[0][1] < inner[1][1] {
                found.push((worth(&inner), Occluder::new(axes.corners(inner, height).into(), Kind::Face(off_m))));
            }
        }
    }
    // stable: of equals the first
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().take(MOST_OCCLUDERS).map(|(_, occluder)| occluder).collect()
}

/// The triangles on both sides of each edge, whose second may be [`NOBODY`] or [`MANY`]: then it is a rim.
type SidesOfEdges = HashMap<(u32, u32), [u32; 2]>;
const NOBODY: u32 = u32::MAX;
const MANY: u32 = u32::MAX - 1;

fn sides(face: &Face) -> impl Iterator<Item = (u32, u32)> + use<> {
    let [a, b, c] = face.corners;
    [(a, b), (b, c), (c, a)].into_iter()
}

/// Positions and faces of all bodies that are neither closed nor ground; none if there are too many.
fn open_faces(stone: Stone) -> Option<(Vec<Vec3>, Vec<Face>)> {
    let (mut numbers, mut positions, mut faces): (HashMap<[u32; 3], u32>, Vec<Vec3>, Vec<Face>) = Default::default();
    let walls = stone.chunks.iter().zip(&stone.bodies.of_vertex).zip(stone.of_chunks).filter(|(_, of)| !of.is_ground);
    for ((chunk, bodies), _) in walls {
        for triangle in chunk.indices.chunks_exact(3) {
            if stone.bodies.closed[bodies[usize::from(triangle[0])] as usize] {
                continue;
            }
            if faces.len() == MOST_TRIANGLES {
                return None;
            }
            let points = [0, 1, 2].map(|k| chunk.positions[usize::from(triangle[k])]);
            let doubled = (points[1] - points[0]).cross(points[2] - points[0]);
            let Some(normal) = doubled.try_normalize() else { continue };
            let corners = points.map(|point| {
                // Adding zero makes one of the two zeros.
                *numbers.entry((point + Vec3::ZERO).to_array().map(f32::to_bits)).or_insert_with(|| {
                    positions.push(point);
                    positions.len() as u32 - 1
                })
            });
            faces.push(Face { corners, normal, area: doubled.length() * 0.5 });
        }
    }
    Some((positions, faces))
}

/// Takes into a patch all faces that its first one reaches over shared edges, and that lie in its plane but for `off_m`.
fn grow(
    faces: &[Face],
    positions: &[Vec3],
    edges: &SidesOfEdges,
    patch_of: &mut [u32],
    (patch, first): (u32, usize),
    off_m: f32,
) -> Vec<usize> {
    let normal = faces[first].normal;
    let origin = positions[faces[first].corners[0] as usize];
    let flat = |face: &Face| {
        let near = |&corner: &u32| (positions[corner as usize] - origin).dot(normal).abs() <= off_m;
        face.normal.dot(normal) >= SAME_NORMAL && face.corners.iter().all(near)
    };
    patch_of[first] = patch;
    let mut members = vec![first];
    let mut next = 0;
    while next < members.len() {
        for (a, b) in sides(&faces[members[next]]) {
            let sides = edges[&(a.min(b), a.max(b))];
            if matches!(sides[1], NOBODY | MANY) {
                continue;
            }
            for neighbour in sides.map(|side| side as usize) {
                if patch_of[neighbour] == u32::MAX && flat(&faces[neighbour]) {
                    patch_of[neighbour] = patch;
                    members.push(neighbour);
                }
            }
        }
        next += 1;
    }
    members
}
