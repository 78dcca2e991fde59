//! The model as lines in a photograph, what stands before a line told from what does not.

use glam::{DVec2, DVec3, Vec3};
use heliodon_photo::camera::Camera;
use heliodon_photo::model::Part;
use heliodon_rays::{BuildParams, Ray, TriangleScene};
use std::collections::{BTreeMap, BTreeSet};

/// Pieces that a line is cut into, for lenses that bend and for what hides a part of it.
const PIECES: usize = 24;
/// How near its own end a ray to a line still meets faces that the line borders, as a part of its length.
const OWN_FACES: f32 = 1.0e-3;

/// A line of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Wire {
    ends: [DVec3; 2],
    /// Whether it is within a smooth face, no border of it.
    is_inner: bool,
}

/// A line of the model in a photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawn {
    /// Pixels.
    pub line: Vec<DVec2>,
    /// Whether it borders a face, rather than to run within one that is smooth.
    pub is_border: bool,
    /// Whether nothing of the model stands before it.
    pub is_seen: bool,
}

/// A model's lines, ready to be seen from anywhere.
pub struct Wires {
    wires: Vec<Wire>,
    scene: Option<TriangleScene>,
}

struct Edge {
    vertices: [u32; 2],
    triangles: usize,
    faces: BTreeSet<u32>,
}

impl Wires {
    /// Edges at which faces end, and those within faces that are smooth. Diagonals of flat faces are no lines.
    #[must_use]
    pub fn new(parts: &[Part]) -> Self {
        let mut positions: Vec<Vec3> = Vec::new();
        let mut triangles: Vec<[u32; 3]> = Vec::new();
        for part in parts {
            let first = positions.len() as u32;
            positions.extend(&part.mesh.positions);
            triangles.extend(part.mesh.triangles.iter().map(|t| t.map(|v| v + first)));
        }
        // Without a scene nothing is hidden.
        let scene = TriangleScene::build(&positions, &triangles, &BuildParams::default()).ok();
        Self { wires: parts.iter().flat_map(wires).collect(), scene }
    }

    /// The lines as a camera sees them.
    #[must_use]
    pub fn seen_by(&self, camera: &Camera) -> Vec<Drawn> {
        let eye = camera.centre();
        let middles = |wire: &Wire| {
            let [a, b] = wire.ends;
            (0..PIECES).map(move |i| a + (b - a) * ((i as f64 + 0.5) / PIECES as f64)).collect::<Vec<_>>()
        };
        let ray =
            |to: DVec3| Ray { origin: eye.as_vec3(), direction: (to - eye).as_vec3(), t_min: 0.0, t_max: 1.0 - OWN_FACES };
        let rays: Vec<Ray> = self.wires.iter().flat_map(middles).map(ray).collect();
        let mut hidden = vec![0u64; rays.len().div_ceil(64)];
        if let Some(scene) = &self.scene {
            scene.occluded(&rays, &mut hidden);
        }
        let is_hidden = |piece: usize| hidden[piece / 64] >> (piece % 64) & 1 == 1;
        let mut drawn: Vec<Drawn> = Vec::new();
        for (number, wire) in self.wires.iter().enumerate() {
            let [a, b] = wire.ends;
            let pixel = |i: usize| camera.project(a + (b - a) * (i as f64 / PIECES as f64));
            let mut goes_on = false;
            for i in 0..PIECES {
                let (Some(from), Some(to)) = (pixel(i), pixel(i + 1)) else {
                    goes_on = false;
                    continue;
                };
                let is_seen = !is_hidden(number * PIECES + i);
                match drawn.last_mut().filter(|last| goes_on && last.is_seen == is_seen) {
                    Some(last) => last.line.push(to),
                    None => drawn.push(Drawn { line: vec![from, to], is_border: !wire.is_inner, is_seen }),
                }
                goes_on = true;
            }
        }
        drawn
    }
}

fn wires(part: &Part) -> Vec<Wire> {
    let place = |vertex: u32| part.mesh.positions[vertex as usize];
    let key = |vertex: u32| place(vertex).to_array().map(f32::to_bits);
    let mut edges: BTreeMap<[[u32; 3]; 2], Edge> = BTreeMap::new();
    for (triangle, face) in part.mesh.triangles.iter().zip(&part.face) {
        for [a, b] in [[0, 1], [1, 2], [2, 0]].map(|ends: [usize; 2]| ends.map(|i| triangle[i])) {
            let mut ends = [key(a), key(b)];
            ends.sort_unstable();
            let edge = edges.entry(ends).or_insert(Edge { vertices: [a, b], triangles: 0, faces: BTreeSet::new() });
            edge.triangles += 1;
            edge.faces.insert(*face);
        }
    }
    let smooth = |face: &u32| part.smooth.get(*face as usize).copied().unwrap_or(false);
    let wire = |edge: &Edge| {
        let is_border = edge.faces.len() > 1 || edge.triangles == 1;
        let is_inner = !is_border && edge.faces.iter().any(smooth);
        (is_border || is_inner).then(|| Wire { ends: edge.vertices.map(|v| place(v).as_dvec3()), is_inner })
    };
    edges.values().filter_map(wire).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;
    use heliodon_photo::camera::{Intrinsics, Pose};
    use heliodon_photo::model::table::ShapeRow;
    use heliodon_photo::model::{NamedPoint, build};

    fn block() -> Vec<Part> {
        let places = [[0, 0, 1], [1, 0, 1], [1, 0, 0], [0, 0, 0], [0, 1, 1], [1, 1, 1], [1, 1, 0], [0, 1, 0]];
        let point = |(i, p): (usize, &[i32; 3])| NamedPoint {
            name: format!("p{i}"),
            position: DVec3::from(p.map(f64::from)),
            covariance: DMat3::IDENTITY * 1e-6,
            seen_in: Vec::new(),
        };
        let points: Vec<NamedPoint> = places.iter().enumerate().map(point).collect();
        let row: ShapeRow = toml_edit::de::from_str(
            "name = \"b\"\nkind = \"box\"\npoints = [\"p0\", \"p1\", \"p2\", \"p3\", \"p4\", \"p5\", \"p6\", \"p7\"]\nwatertight = true",
        )
        .unwrap();
        let model = build(&[row], &points, &[]);
        assert!(model.refused.is_empty(), "{:?}", model.refused);
        model.parts
    }

    #[test]
    fn a_block_has_twelve_lines_of_which_nine_are_seen_from_above_a_corner() {
        let wires = Wires::new(&block());
        assert_eq!(wires.wires.len(), 12);
        let pose = Pose::look_at(DVec3::new(6.0, 4.0, 5.0), DVec3::splat(0.5)).unwrap();
        let drawn = wires.seen_by(&Camera { intrinsics: Intrinsics::pinhole(800, 600, 900.0), pose });
        let whole = |drawn: &&Drawn| drawn.line.len() == PIECES + 1;
        let count = |is_seen: bool| drawn.iter().filter(|d| d.is_seen == is_seen).filter(whole).count();
        assert_eq!((count(true), count(false)), (9, 3), "{}", drawn.len());
    }

    #[test]
    fn what_is_behind_the_camera_is_not_drawn() {
        let wires = Wires::new(&block());
        let pose = Pose::look_at(DVec3::new(6.0, 4.0, 5.0), DVec3::splat(10.0)).unwrap();
        assert_eq!(wires.seen_by(&Camera { intrinsics: Intrinsics::pinhole(800, 600, 900.0), pose }), Vec::new());
        assert_eq!(Wires::new(&[]).wires, Vec::new());
    }
}
