//! A stone with eight corners: ashlar, beams, slabs, steps, boulders, carved panels.
//!
//! The six faces are cut independently, each as fine as the view asks, and agree along the edges: seen faces are regular
//! grids, a face that no eye sees is a fan between the steps of its neighbours. So a long wall costs the triangles of its
//! front and little more, and every stone stays closed.

use super::marble::Look;
use super::noise::{fbm, gradient, smoothstep};
use super::relief::Relief;
use super::sizing::Grain;
use super::solid::{RowVertex, SolidMesh, zip_rows};
use glam::Vec3;
use heliodon_math::frame::unit_or;
use heliodon_math::random::{hash2_u32, unit_f32};
use std::collections::HashMap;

/// Faces by axis and side: bit `2 * axis + side`.
pub const FACE_LEFT: u8 = 1 << 0;
pub const FACE_RIGHT: u8 = 1 << 1;
pub const FACE_BOTTOM: u8 = 1 << 2;
pub const FACE_TOP: u8 = 1 << 3;
pub const FACE_BACK: u8 = 1 << 4;
pub const FACE_FRONT: u8 = 1 << 5;

/// What time did to a stone, in metres.
#[derive(Clone, Copy, Debug)]
pub struct Wear {
    /// Radius of the worn edges.
    pub round: f32,
    /// Depth of chips broken out of edges and corners.
    pub chip: f32,
    /// Depth of the roughness of the faces.
    pub rough: f32,
    /// Corners broken off, each by a plane.
    pub breaks: u8,
}

impl Wear {
    /// A dressed stone in place; `erosion` from 0 (new) to 1.
    pub fn dressed(erosion: f32) -> Self {
        Self { round: 0.006 + 0.022 * erosion, chip: 0.26 * erosion, rough: 0.003 + 0.014 * erosion, breaks: 0 }
    }

    /// A stone that fell.
    pub fn fallen(erosion: f32) -> Self {
        Self { round: 0.02 + 0.07 * erosion, chip: 0.05 + 0.18 * erosion, rough: 0.008 + 0.03 * erosion, breaks: 3 }
    }

    /// The torn end of what still stands.
    pub fn torn(erosion: f32) -> Self {
        Self { round: 0.015 + 0.05 * erosion, chip: 0.05 + 0.25 * erosion, rough: 0.006 + 0.022 * erosion, breaks: 2 }
    }
}

/// A hexahedron of stone. Corner `i` has its bits for x (1), y (2) and z (4); the frame is right-handed.
#[derive(Clone, Debug)]
pub struct Block {
    pub corners: [Vec3; 8],
    pub wear: Wear,
    pub look: Look,
    pub seed: u32,
    /// Faces against which other stones lie (`FACE_*`): not fine unless they turn out to be seen.
    pub covered: u8,
    /// Faces that are seen (bits as `FACE_*`), once that is known; before, those that are turned to an eye count.
    pub seen: Option<u8>,
    /// Multiplies the length of the cut: more for what stands inside, behind walls.
    pub coarser: f32,
    /// Left out where its longest edge would be below a pixel or so.
    pub ornament: bool,
    /// Carving on the front face.
    pub relief: Option<Box<Relief>>,
}

/// How one block is cut.
struct Cut {
    /// Steps along each axis when seen, and when turned away.
    seen: [u32; 3],
    back: [u32; 3],
    /// 0 covered, 1 turned away, 2 seen; by face.
    quality: [u8; 6],
}

impl Cut {
    fn steps(&self, axis: usize, quality: u8) -> u32 {
        match quality {
            0 => 1,
            1 => self.back[axis],
            _ => self.seen[axis],
        }
    }

    /// Steps of the edge along `axis` at the sides (0 or 1) of the two other axes.
    fn edge_steps(&self, axis: usize, other: [usize; 2], sides: [usize; 2]) -> u32 {
        let quality = self.quality[2 * other[0] + sides[0]].max(self.quality[2 * other[1] + sides[1]]);
        self.steps(axis, quality)
    }

    /// Steps of a face: along its two axes inside, and on its four edges (u low v, u high v, v low u, v high u).
    fn face(&self, axis: usize, side: usize) -> ([usize; 2], [u32; 2], [u32; 4]) {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let quality = self.quality[2 * axis + side];
        let inner = [self.steps(u, quality), self.steps(v, quality)];
        let edges = [
            self.edge_steps(u, [axis, v], [side, 0]),
            self.edge_steps(u, [axis, v], [side, 1]),
            self.edge_steps(v, [axis, u], [side, 0]),
            self.edge_steps(v, [axis, u], [side, 1]),
        ];
        ([u, v], inner, edges)
    }
}

impl Block {
    /// A block whose corners are `f(x, y, z)` of the two ends of three ranges; mirrored frames are put right.
    pub fn new(corners: [Vec3; 8], wear: Wear, look: Look, covered: u8) -> Self {
        let mut block =
            Self { corners, wear, look, seed: look.seed, covered, seen: None, coarser: 1.0, ornament: false, relief: None };
        let [x, y, z] = block.axes();
        if x.cross(y).dot(z) < 0.0 {
            for pair in 0..4 {
                block.corners.swap(2 * pair, 2 * pair + 1);
            }
            let sides = block.covered & 3;
            block.covered = (block.covered & !3) | (sides >> 1) | ((sides & 1) << 1);
        }
        block
    }

    /// An upright box in a frame: half sizes along the frame's axes.
    pub fn oriented(centre: Vec3, axes: [Vec3; 3], half: Vec3, wear: Wear, look: Look, covered: u8) -> Self {
        let corner = |i: usize| {
            let sign = |bit: usize| if i & bit == 0 { -1.0 } else { 1.0 };
            centre + axes[0] * (sign(1) * half.x) + axes[1] * (sign(2) * half.y) + axes[2] * (sign(4) * half.z)
        };
        Self::new(std::array::from_fn(corner), wear, look, covered)
    }

    /// Mean edge vectors of the three axes.
    fn axes(&self) -> [Vec3; 3] {
        let c = &self.corners;
        let mean = |bit: usize| (0..8).filter(|i| i & bit == 0).map(|i| c[i | bit] - c[i]).sum::<Vec3>() * 0.25;
        [mean(1), mean(2), mean(4)]
    }

    /// The middle.
    pub fn centre(&self) -> Vec3 {
        self.corners.iter().sum::<Vec3>() * 0.125
    }

    fn cut(&self, grain: &Grain) -> Cut {
        let centre = self.centre();
        let axes = self.axes();
        let mut quality = [0; 6];
        for (face, quality) in quality.iter_mut().enumerate() {
            let covered = self.covered & (1 << face) != 0;
            let (axis, side) = (face / 2, face % 2);
            let sign = if side == 0 { -1.0 } else { 1.0 };
            let normal = unit_or(axes[(axis + 1) % 3].cross(axes[(axis + 2) % 3]), Vec3::Y) * sign;
            let at = centre + axes[axis] * (0.5 * sign);
            *quality = match self.seen {
                Some(seen) if seen & (1 << face) != 0 => 2,
                None if !covered && grain.view.sees(at, normal) => 2,
                _ if covered => 0,
                _ => 1,
            };
        }
        // where a stone is long, its nearer end decides
        let nearest = self.nearest_point(grain.view.centre());
        Cut {
            seen: std::array::from_fn(|a| grain.seen_steps(nearest, axes[a], self.coarser)),
            back: std::array::from_fn(|a| grain.back_steps(nearest, axes[a], self.coarser)),
            quality,
        }
    }

    fn nearest_point(&self, to: Vec3) -> Vec3 {
        let axes = self.axes();
        let centre = self.centre();
        let mut at = centre;
        for axis in axes {
            let along = (to - centre).dot(axis) / axis.length_squared().max(1e-12);
            at += axis * along.clamp(-0.5, 0.5);
        }
        at
    }

    fn is_left_out(&self, grain: &Grain) -> bool {
        self.ornament && !grain.shows(self.centre(), self.axes().iter().map(|a| a.length()).fold(0.0, f32::max), self.coarser)
    }

    /// Exactly as many triangles as [`Block::mesh`] makes.
    pub fn count(&self, grain: &Grain) -> usize {
        self.face_counts(grain).iter().sum()
    }

    /// Triangles of each face, in the order in which the mesh holds them.
    pub fn face_counts(&self, grain: &Grain) -> [usize; 6] {
        if self.is_left_out(grain) {
            return [0; 6];
        }
        let cut = self.cut(grain);
        std::array::from_fn(|face| {
            let (_, inner, edges) = cut.face(face / 2, face % 2);
            if is_regular(inner, edges) { 2 * (inner[0] * inner[1]) as usize } else { edges.iter().sum::<u32>() as usize }
        })
    }

    /// The closed mesh.
    pub fn mesh(&self, grain: &Grain) -> SolidMesh {
        let (mut mesh, lost) = self.shape(grain);
        mesh.compute_normals();
        mesh.paint(&self.look, &lost);
        mesh
    }

    /// Positions and triangles of the mesh, and how deep the stone is lost at each vertex.
    pub fn shape(&self, grain: &Grain) -> (SolidMesh, Vec<f32>) {
        let mut mesh = SolidMesh::default();
        if self.is_left_out(grain) {
            return (mesh, Vec::new());
        }
        let cut = self.cut(grain);
        let shape = Shape::new(self);
        // worn edges that show are one smooth surface; sharp ones are creases, so that faces keep their own light
        let smooth = grain.view.length_px(self.centre(), self.wear.round) > 0.55 * grain.px;
        let mut lost = Vec::new();
        let mut shared: HashMap<[u32; 3], u32> = HashMap::new();
        for face in 0..6 {
            let (axis, side) = (face / 2, face % 2);
            let (uv, inner, edges) = cut.face(axis, side);
            if !smooth {
                shared.clear();
            }
            let mut vertex = |u: f32, v: f32, mesh: &mut SolidMesh| {
                let mut q = [0.0; 3];
                q[axis] = side as f32;
                q[uv[0]] = u;
                q[uv[1]] = v;
                *shared.entry(q.map(f32::to_bits)).or_insert_with(|| {
                    let (p, gone) = shape.point(Vec3::from_array(q));
                    lost.push(gone);
                    mesh.vertex(p)
                })
            };
            let first = mesh.triangles.len();
            if is_regular(inner, edges) {
                let mut row = |j: u32, mesh: &mut SolidMesh| -> Vec<RowVertex> {
                    (0..=inner[0])
                        .map(|i| i as f32 / inner[0] as f32)
                        .map(|u| (u, vertex(u, j as f32 / inner[1] as f32, mesh)))
                        .collect()
                };
                let mut below = row(0, &mut mesh);
                for j in 1..=inner[1] {
                    let above = row(j, &mut mesh);
                    grid_strip(&below, &above, j, &mut mesh.triangles);
                    below = above;
                }
            } else {
                let mut rim = Vec::new();
                let mut walk = |n: u32, at: &dyn Fn(f32) -> (f32, f32), mesh: &mut SolidMesh| {
                    for i in 0..n {
                        let (u, v) = at(i as f32 / n as f32);
                        rim.push(vertex(u, v, mesh));
                    }
                };
                // the two far edges run backwards: their parameters must be those of the neighbour's grid, bit for bit
                walk(edges[0], &|t| (t, 0.0), &mut mesh);
                walk(edges[3], &|t| (1.0, t), &mut mesh);
                let backwards = |n: u32| (0..n).map(move |i| (n - i) as f32 / n as f32);
                for t in backwards(edges[1]) {
                    rim.push(vertex(t, 1.0, &mut mesh));
                }
                for t in backwards(edges[2]) {
                    rim.push(vertex(0.0, t, &mut mesh));
                }
                let hub = vertex(0.5, 0.5, &mut mesh);
                for (i, &a) in rim.iter().enumerate() {
                    mesh.triangles.push([a, rim[(i + 1) % rim.len()], hub]);
                }
            }
            if side == 0 {
                mesh.triangles[first..].iter_mut().for_each(|t| t.swap(1, 2));
            }
        }
        (mesh, lost)
    }
}

fn is_regular(inner: [u32; 2], edges: [u32; 4]) -> bool {
    edges == [inner[0], inner[0], inner[1], inner[1]]
}

/// Two triangles a cell between rows of equal counts, diagonals in a chequer.
fn grid_strip(below: &[RowVertex], above: &[RowVertex], row: u32, triangles: &mut Vec<[u32; 3]>) {
    if below.len() != above.len() {
        zip_rows(below, above, triangles);
        return;
    }
    for i in 0..below.len() - 1 {
        let (a, b, c, d) = (below[i].1, below[i + 1].1, above[i + 1].1, above[i].1);
        if (i as u32 + row) & 1 == 0 {
            triangles.push([a, b, c]);
            triangles.push([a, c, d]);
        } else {
            triangles.push([a, b, d]);
            triangles.push([b, c, d]);
        }
    }
}

/// The worn surface of a block as a function of where on the perfect one.
struct Shape<'a> {
    block: &'a Block,
    size: Vec3,
    breaks: Vec<(Vec3, f32)>,
    offset: Vec3,
}

impl<'a> Shape<'a> {
    fn new(block: &'a Block) -> Self {
        let axes = block.axes();
        let size = Vec3::new(axes[0].length(), axes[1].length(), axes[2].length());
        let random = |k: u32| unit_f32(hash2_u32(block.seed, 0xB10C + k));
        let breaks = (0..u32::from(block.wear.breaks))
            .map(|i| {
                // a plane across one corner, never one that is covered from below
                let sign = |k: u32| if random(10 * i + k) < 0.5 { -1.0 } else { 1.0 };
                let up = if random(10 * i + 9) < 0.75 { 1.0 } else { -1.0 };
                let corner = Vec3::new(sign(1), up, sign(2));
                let lean = Vec3::new(random(10 * i + 3), random(10 * i + 4), random(10 * i + 5)) + Vec3::splat(0.12);
                let normal = unit_or(corner * lean, Vec3::Y);
                let depth = (0.04 + 0.22 * random(10 * i + 6)) * size.min_element();
                (normal, (corner * size * 0.5).dot(normal) - depth)
            })
            .collect();
        let offset = Vec3::new(random(1), random(2), random(3)) * 40.0;
        Self { block, size, breaks, offset }
    }

    /// The point of the worn surface for the point `q` in [0, 1]^3 of the perfect one, and how deep the stone is lost there.
    fn point(&self, q: Vec3) -> (Vec3, f32) {
        let wear = &self.block.wear;
        let half = self.size * 0.5;
        let ideal = (q - Vec3::splat(0.5)) * self.size;
        let mut local = ideal;
        let mut lost = 0.0;

        // edges: rounded by rain, chipped by falls, both unevenly
        let place = ideal + self.offset;
        let uneven = 0.65 + 0.7 * gradient(self.block.seed, place * 2.7).max(-0.6);
        let chip = wear.chip * smoothstep(0.14, 0.66, fbm(self.block.seed + 1, place * 1.3, 3));
        let radius = (wear.round * uneven + chip).min(0.46 * half.min_element());
        let beyond = Vec3::new(
            (local.x.abs() - (half.x - radius)).max(0.0),
            (local.y.abs() - (half.y - radius)).max(0.0),
            (local.z.abs() - (half.z - radius)).max(0.0),
        );
        let length = beyond.length();
        if length > radius {
            let pulled = beyond * (radius / length);
            lost += (length - radius) * smoothstep(0.3, 1.0, chip / wear.chip.max(1e-6));
            local -= (beyond - pulled) * signs(local);
        }
        let outward = unit_or(beyond * signs(local), Vec3::ZERO);

        for &(normal, distance) in &self.breaks {
            let over = local.dot(normal) - distance;
            if over > 0.0 {
                local -= normal * over;
                lost += 0.05;
            }
        }

        // faces: hollows and pits, always inwards
        let rough = 0.5 + 0.5 * fbm(self.block.seed + 2, place * 3.4, 3);
        let pits = smoothstep(0.35, 0.8, gradient(self.block.seed + 3, place * 7.0));
        let depth = wear.rough * (1.1 * rough + 1.4 * pits);
        local -= outward * depth.min(0.2 * half.min_element());

        if let Some(relief) = &self.block.relief
            && q.z == 1.0
        {
            local.z += relief.height(local.x, local.y);
        }
        (self.world(local), lost)
    }

    fn world(&self, local: Vec3) -> Vec3 {
        // trilinear between the corners, so that tapers and slopes keep
        let t = local / self.size.max(Vec3::splat(1e-6)) + Vec3::splat(0.5);
        let c = &self.block.corners;
        let lerp = |a: Vec3, b: Vec3, t: f32| a + (b - a) * t;
        let low = lerp(lerp(c[0], c[1], t.x), lerp(c[2], c[3], t.x), t.y);
        let high = lerp(lerp(c[4], c[5], t.x), lerp(c[6], c[7], t.x), t.y);
        lerp(low, high, t.z)
    }
}

fn signs(v: Vec3) -> Vec3 {
    Vec3::new(1.0_f32.copysign(v.x), 1.0_f32.copysign(v.y), 1.0_f32.copysign(v.z))
}
