//! Parts: the bodies of one or several shapes in one mesh.

use super::body::Body;
use glam::{Vec2, Vec3};
use heliodon_mesh::Mesh;
use heliodon_mesh::topology::{Edges, HalfEdge, places};

/// One mesh of a model, with what its textures need to know.
#[derive(Clone, Debug, Default)]
pub struct Part {
    /// Its name.
    pub name: String,
    /// Positions and triangles, counter-clockwise from outside. No normals and texture coordinates yet.
    pub mesh: Mesh,
    /// For each triangle the face that it belongs to: a polygon, a shaft's side.
    pub face: Vec<u32>,
    /// Where each triangle's corners lie on their face once that is laid flat, metres.
    pub flat: Vec<[Vec2; 3]>,
    /// For each face whether light runs on smoothly over it.
    pub smooth: Vec<bool>,
    /// Whether its rows asked for it to close.
    pub watertight: bool,
    /// Sides of triangles at which no other lies: 0 where it is closed.
    pub open_edges: usize,
}

/// What becomes a part.
pub(super) struct Gathered {
    pub name: String,
    solids: Body,
    polygons: Body,
    watertight: bool,
}

/// Polygons' vertices nearer than this are one: far above the rounding of a mirrored point, far below what anyone marks.
const WELD_M: f32 = 1.0e-4;

impl Gathered {
    pub fn new(name: String) -> Self {
        Self { name, solids: Body::default(), polygons: Body::default(), watertight: false }
    }

    pub fn add(&mut self, body: &Body, is_polygon: bool, watertight: bool) {
        let to = if is_polygon { &mut self.polygons } else { &mut self.solids };
        to.append(body);
        self.watertight |= watertight;
    }

    pub fn part(self) -> Part {
        let mut body = self.solids;
        body.append(&welded(self.polygons));
        let positions: Vec<Vec3> = body.positions.iter().map(|p| p.as_vec3()).collect();
        let at = places(&positions, 0.0);
        let is_surface = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| at[v as usize]);
            a != b && b != c && c != a
        };
        let kept: Vec<usize> = (0..body.triangles.len()).filter(|&t| is_surface(&body.triangles[t])).collect();
        let triangles: Vec<[u32; 3]> = kept.iter().map(|&t| body.triangles[t]).collect();
        let mut open_edges = 0;
        Edges::new(&triangles, &at, |_| true).for_each(|_, sides| open_edges += sides.len() % 2);
        Part {
            name: self.name,
            mesh: Mesh { positions, triangles, ..Mesh::default() },
            face: kept.iter().map(|&t| body.faces[t]).collect(),
            flat: kept.iter().map(|&t| body.flat[t].map(|p| p.as_vec2())).collect(),
            smooth: body.smooth,
            watertight: self.watertight,
            open_edges,
        }
    }
}

/// Polygons with shared vertices, all that hang together turned the same way: outwards where they close, else as most of them (by area) were.
fn welded(mut body: Body) -> Body {
    if body.triangles.is_empty() {
        return body;
    }
    let positions: Vec<Vec3> = body.positions.iter().map(|p| p.as_vec3()).collect();
    let at = places(&positions, WELD_M);
    body.triangles.iter_mut().for_each(|t| *t = t.map(|v| at[v as usize]));
    let mut used = vec![u32::MAX; body.positions.len()];
    let mut positions = Vec::new();
    for v in body.triangles.iter_mut().flatten() {
        let new = &mut used[*v as usize];
        if *new == u32::MAX {
            *new = positions.len() as u32;
            positions.push(body.positions[*v as usize]);
        }
        *v = *new;
    }
    body.positions = positions;
    // neighbours over an edge, and whether one of them must turn for both to face the same way
    let mut neighbors: Vec<Vec<(usize, bool)>> = vec![Vec::new(); body.triangles.len()];
    let same: Vec<u32> = (0..body.positions.len() as u32).collect();
    let is_surface = |t: usize| {
        let [a, b, c] = body.triangles[t];
        a != b && b != c && c != a
    };
    Edges::new(&body.triangles, &same, is_surface).for_each(|_, sides| {
        let sides: Vec<HalfEdge> = sides.collect();
        if let [one, other] = sides.as_slice() {
            let (a, b) = (one.triangle as usize, other.triangle as usize);
            neighbors[a].push((b, one.down == other.down));
            neighbors[b].push((a, one.down == other.down));
        }
    });
    let mut turned: Vec<Option<bool>> = vec![None; body.triangles.len()];
    for seed in 0..body.triangles.len() {
        if turned[seed].is_some() {
            continue;
        }
        turned[seed] = Some(false);
        let mut patch = vec![seed];
        let mut next = 0;
        while next < patch.len() {
            let t = patch[next];
            for &(neighbor, differs) in &neighbors[t] {
                if turned[neighbor].is_none() {
                    turned[neighbor] = turned[t].map(|is_turned| is_turned != differs);
                    patch.push(neighbor);
                }
            }
            next += 1;
        }
        let corner = |v: u32| body.positions[v as usize] - body.positions[body.triangles[seed][0] as usize];
        let signed = |t: &usize| if turned[*t] == Some(true) { -1.0 } else { 1.0 };
        let is_closed = patch.iter().all(|&t| neighbors[t].len() == 3);
        let sum: f64 = patch
            .iter()
            .map(|t| {
                let [a, b, c] = body.triangles[*t].map(corner);
                signed(t) * if is_closed { a.dot(b.cross(c)) } else { (b - a).cross(c - a).length() }
            })
            .sum();
        if sum < 0.0 {
            patch.iter().for_each(|&t| turned[t] = turned[t].map(|is_turned| !is_turned));
        }
    }
    for (t, _) in turned.iter().enumerate().filter(|(_, turned)| **turned == Some(true)) {
        body.triangles[t].swap(1, 2);
        body.flat[t].swap(1, 2);
    }
    body
}
