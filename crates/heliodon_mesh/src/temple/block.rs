//! A stone with eight corners: ashlar, beams, slabs, steps, boulders, carved panels.
//!
//! The six faces are cut independently, each as fine as the view asks, and agree along the edges: seen faces are regular
//! grids, a face that no eye sees is a fan between the steps of its neighbours. So a long wall costs the triangles of its
//! front and little more, and every stone stays closed.
//!
//! A face that other stones cover wholly is dressed: it keeps its plane, reaches into them and has few vertices of its own;
//! between it and the worn rim runs a groove a finger deep, the joint that one sees.

use super::contact::{BULGE, Contacts};
use super::marble::Look;
use super::noise::{fbm, gradient, smoothstep};
use super::relief::Relief;
use super::sizing::Grain;
use super::solid::{RowVertex, SolidMesh, zip_rows};
use glam::Vec3;
use heliodon_math::frame::unit_or;
use heliodon_math::random::{hash2_u32, unit_f32};
use std::collections::HashMap;
use std::ops::Range;

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
    /// What lies against its faces, once that is known.
    pub contacts: Contacts,
}

/// Carved faces are cut to this part of the length.
const CARVED: f32 = 0.85;
/// How far the worn rim of a covered face recedes into the joint at most, metres.
const RECESS: f32 = 0.012;

/// How one block is cut.
struct Cut {
    /// Steps along each axis when seen, and when turned away.
    seen: [u32; 3],
    back: [u32; 3],
    /// 0 covered, 1 turned away, 2 seen; by face.
    quality: [u8; 6],
    /// Faces that others cover wholly (`FACE_*`).
    whole: u8,
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

    fn is_whole(&self, face: usize) -> bool {
        self.whole & (1 << face) != 0
    }

    /// Which of a wholly covered face's edges, in [`Cut::face`]'s order, show the groove of the joint.
    fn grooves(&self, axis: usize, edges: [u32; 4]) -> [bool; 4] {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let beside = [2 * v, 2 * v + 1, 2 * u, 2 * u + 1];
        std::array::from_fn(|k| edges[k] > 1 || self.quality[beside[k]] == 2)
    }
}

/// The edges of a face in the order and direction of a walk around it, as places in [`Cut::face`]'s order, and whether the
/// walk runs along the edge; edge `k` of the walk leads from its corner `k` to the next.
const WALK: [(usize, bool); 4] = [(0, true), (3, true), (1, false), (2, false)];

/// By corner of the walk: whether the groove passes it.
fn grooved_corners(grooves: [bool; 4]) -> [bool; 4] {
    std::array::from_fn(|k| grooves[WALK[k].0] || grooves[WALK[(k + 3) % 4].0])
}

impl Block {
    /// A block whose corners are `f(x, y, z)` of the two ends of three ranges; mirrored frames are put right.
    pub fn new(corners: [Vec3; 8], wear: Wear, look: Look, covered: u8) -> Self {
        let mut block = Self {
            corners,
            wear,
            look,
            seed: look.seed,
            covered,
            seen: None,
            coarser: 1.0,
            ornament: false,
            relief: None,
            contacts: Contacts::default(),
        };
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

    /// The outward normal of a face of the undamaged stone.
    pub fn face_normal(&self, face: usize) -> Vec3 {
        let along = self.face_point(face, 1.0, 0.5) - self.face_point(face, 0.0, 0.5);
        let normal = unit_or(along.cross(self.face_point(face, 0.5, 1.0) - self.face_point(face, 0.5, 0.0)), Vec3::Y);
        if face.is_multiple_of(2) { -normal } else { normal }
    }

    /// A point of a face of the undamaged stone, by parts of its two axes (the next ones after the face's own).
    pub fn face_point(&self, face: usize, u: f32, v: f32) -> Vec3 {
        let mut q = [0.0; 3];
        q[face / 2] = (face % 2) as f32;
        q[(face / 2 + 1) % 3] = u;
        q[(face / 2 + 2) % 3] = v;
        self.ideal(q)
    }

    /// The point of the undamaged stone at parts of its axes: trilinear, so that tapers and slopes keep.
    fn ideal(&self, [x, y, z]: [f32; 3]) -> Vec3 {
        let c = &self.corners;
        let lerp = |a: Vec3, b: Vec3, t: f32| a + (b - a) * t;
        let low = lerp(lerp(c[0], c[1], x), lerp(c[2], c[3], x), y);
        let high = lerp(lerp(c[4], c[5], x), lerp(c[6], c[7], x), y);
        lerp(low, high, z)
    }

    fn cut(&self, grain: &Grain) -> Cut {
        let axes = self.axes();
        let mut quality = [0; 6];
        for (face, quality) in quality.iter_mut().enumerate() {
            if self.contacts.whole & (1 << face) != 0 {
                continue;
            }
            let covered = self.covered & (1 << face) != 0;
            let normal = self.face_normal(face);
            let at = self.face_point(face, 0.5, 0.5);
            *quality = match self.seen {
                Some(seen) if seen & (1 << face) != 0 => 2,
                None if !covered && grain.view.sees(at, normal) => 2,
                _ if covered => 0,
                _ => 1,
            };
        }
        // where a stone is long, its nearer end decides; carving has slopes
        let nearest = self.nearest_point(grain.view.centre());
        let carved = if self.relief.is_some() { CARVED } else { 1.0 };
        Cut {
            seen: std::array::from_fn(|a| grain.seen_steps(nearest, axes[a], self.coarser * carved)),
            back: std::array::from_fn(|a| grain.back_steps(nearest, axes[a], self.coarser)),
            quality,
            whole: self.contacts.whole,
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
            if cut.is_whole(face) {
                whole_count(cut.grooves(face / 2, edges), edges)
            } else if is_regular(inner, edges) {
                2 * (inner[0] * inner[1]) as usize
            } else {
                edges.iter().sum::<u32>() as usize
            }
        })
    }

    /// The closed mesh.
    pub fn mesh(&self, grain: &Grain) -> SolidMesh {
        let BlockShape { mut mesh, lost, covered } = self.shape(grain);
        mesh.compute_normals(&covered);
        mesh.paint(&self.look, &lost);
        mesh
    }

    /// The mesh without normals and colours.
    pub fn shape(&self, grain: &Grain) -> BlockShape {
        let mut built = BlockShape { mesh: SolidMesh::default(), lost: Vec::new(), covered: Vec::new() };
        if self.is_left_out(grain) {
            return built;
        }
        let cut = self.cut(grain);
        let mut cutter = Cutter {
            shape: Shape::new(self),
            lost: Vec::new(),
            vertices: HashMap::new(),
            rims: HashMap::new(),
            mesh: SolidMesh::default(),
        };
        // worn edges that show are one smooth surface; sharp ones are creases, so that faces keep their own light
        let smooth = grain.view.length_px(self.centre(), self.wear.round) > 0.55 * grain.px;
        let mut faces: [Vec<[u32; 3]>; 6] = Default::default();
        for face in (0..6).filter(|&face| !cut.is_whole(face)) {
            faces[face] = cutter.free_face(&cut, face);
            if !smooth && cut.whole == 0 {
                cutter.vertices.clear();
            } else if !smooth {
                for (q, vertex) in cutter.vertices.drain() {
                    cutter.rims.entry(q).or_insert(vertex);
                }
            }
        }
        // the rim of a covered face is that of the free face beside it, whose normal alone counts
        if !smooth {
            cutter.vertices = std::mem::take(&mut cutter.rims);
        }
        for face in (0..6).filter(|&face| cut.is_whole(face)) {
            faces[face] = cutter.whole_face(&cut, face);
        }
        (built.mesh, built.lost) = (cutter.mesh, cutter.lost);
        for (face, mut triangles) in faces.into_iter().enumerate() {
            if face % 2 == 0 {
                triangles.iter_mut().for_each(|t| t.swap(1, 2));
            }
            let first = built.mesh.triangles.len();
            built.mesh.triangles.append(&mut triangles);
            if cut.is_whole(face) {
                built.covered.push(first..built.mesh.triangles.len());
            }
        }
        built
    }
}

/// A block cut into triangles, face after face.
pub struct BlockShape {
    /// Positions and triangles.
    pub mesh: SolidMesh,
    /// How deep the stone is lost at each vertex.
    lost: Vec<f32>,
    /// Triangles of wholly covered faces.
    covered: Vec<Range<usize>>,
}

/// Triangles of a wholly covered face.
fn whole_count(grooves: [bool; 4], edges: [u32; 4]) -> usize {
    let corners = grooved_corners(grooves);
    let along = |k: usize| {
        let ends = usize::from(corners[k]) + usize::from(corners[(k + 1) % 4]);
        if grooves[WALK[k].0] { edges[WALK[k].0] as usize + 1 } else { ends }
    };
    2 + (0..4).map(along).sum::<usize>()
}

/// Cuts the faces of one block.
struct Cutter<'a> {
    shape: Shape<'a>,
    mesh: SolidMesh,
    lost: Vec<f32>,
    /// Vertices by their place on the undamaged stone: those that the faces being cut share, and those of free faces.
    vertices: HashMap<[u32; 3], u32>,
    rims: HashMap<[u32; 3], u32>,
}

impl Cutter<'_> {
    /// The vertex of a face at parts of its two axes.
    fn vertex(&mut self, face: usize, u: f32, v: f32) -> u32 {
        let mut q = [0.0; 3];
        q[face / 2] = (face % 2) as f32;
        q[(face / 2 + 1) % 3] = u;
        q[(face / 2 + 2) % 3] = v;
        *self.vertices.entry(q.map(f32::to_bits)).or_insert_with(|| {
            let (p, gone) = self.shape.point(Vec3::from_array(q));
            self.lost.push(gone);
            self.mesh.vertex(p)
        })
    }

    /// The vertices of an edge of a face in the direction of the walk, both ends included. Parameters are those of the
    /// neighbour's grid, bit for bit.
    fn edge(&mut self, face: usize, edges: [u32; 4], k: usize) -> Vec<u32> {
        let (edge, forwards) = WALK[k];
        let n = edges[edge];
        (0..=n)
            .map(|i| if forwards { i } else { n - i } as f32 / n as f32)
            .map(|t| match edge {
                0 => self.vertex(face, t, 0.0),
                1 => self.vertex(face, t, 1.0),
                2 => self.vertex(face, 0.0, t),
                _ => self.vertex(face, 1.0, t),
            })
            .collect()
    }

    /// A grid where the edges' steps are those inside, otherwise a fan.
    fn free_face(&mut self, cut: &Cut, face: usize) -> Vec<[u32; 3]> {
        let (_, inner, edges) = cut.face(face / 2, face % 2);
        let mut triangles = Vec::new();
        if is_regular(inner, edges) {
            let mut below = Vec::new();
            for j in 0..=inner[1] {
                let v = j as f32 / inner[1] as f32;
                let row: Vec<RowVertex> =
                    (0..=inner[0]).map(|i| i as f32 / inner[0] as f32).map(|u| (u, self.vertex(face, u, v))).collect();
                if j > 0 {
                    grid_strip(&below, &row, j, &mut triangles);
                }
                below = row;
            }
            return triangles;
        }
        let mut rim = Vec::new();
        for k in 0..4 {
            rim.append(&mut self.edge(face, edges, k));
            rim.pop();
        }
        let hub = self.vertex(face, 0.5, 0.5);
        for (i, &a) in rim.iter().enumerate() {
            triangles.push([a, rim[(i + 1) % rim.len()], hub]);
        }
        triangles
    }

    /// A quadrangle that reaches into the neighbour, and strips from it to the rims that show.
    fn whole_face(&mut self, cut: &Cut, face: usize) -> Vec<[u32; 3]> {
        let (axes, _, edges) = cut.face(face / 2, face % 2);
        let grooves = cut.grooves(face / 2, edges);
        let grooved = grooved_corners(grooves);
        let inset = axes.map(|axis| self.shape.inset(axis));
        let corner: [u32; 4] = std::array::from_fn(|k| {
            let (far_u, far_v) = (k == 1 || k == 2, k >= 2);
            let part = |far: bool, inset: f32| {
                let inset = if grooved[k] { inset } else { 0.0 };
                if far { 1.0 - inset } else { inset }
            };
            self.vertex(face, part(far_u, inset[0]), part(far_v, inset[1]))
        });
        let mut triangles = vec![[corner[0], corner[1], corner[2]], [corner[0], corner[2], corner[3]]];
        for k in 0..4 {
            let next = (k + 1) % 4;
            if !grooved[k] && !grooved[next] {
                continue;
            }
            let rim = self.edge(face, edges, k);
            if grooves[WALK[k].0] || (grooved[k] && grooved[next]) {
                let n = rim.len() as f32;
                let rim: Vec<RowVertex> = rim.into_iter().enumerate().map(|(i, v)| (i as f32 / n, v)).collect();
                zip_rows(&rim, &[(0.0, corner[k]), (0.5, corner[next])], &mut triangles);
            } else {
                triangles.push([rim[0], rim[1], if grooved[k] { corner[k] } else { corner[next] }]);
            }
        }
        triangles
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

    /// How far, as a part of its length along an axis, the groove of a joint reaches in from the rim: past what is worn.
    fn inset(&self, axis: usize) -> f32 {
        let wear = &self.block.wear;
        ((0.010 + 0.3 * (wear.round + 0.45 * wear.chip)) / self.size[axis].max(1e-3)).min(0.3)
    }

    /// Faces (`FACE_*`) on which a place lies.
    fn faces_at(q: Vec3) -> u8 {
        (0..3).map(|axis| (u8::from(q[axis] == 0.0) | u8::from(q[axis] == 1.0) << 1) << (2 * axis)).sum()
    }

    /// Whether other stones lie against a face at a place and about it.
    fn is_covered(&self, face: usize, at: Vec3) -> bool {
        let block = self.block;
        block.contacts.whole & (1 << face) != 0 || {
            let across = [1, 2].map(|k| block.face_normal((face + 2 * k) % 6));
            block.contacts.cover(face, at, block.face_normal(face), across)
        }
    }

    /// The point of the worn surface for the point `q` in [0, 1]^3 of the perfect one, and how deep the stone is lost there.
    fn point(&self, q: Vec3) -> (Vec3, f32) {
        let (whole, on) = (self.block.contacts.whole, Self::faces_at(q));
        let at = self.block.ideal(q.to_array());
        if on != 0 && (0..6).all(|face| on & (1 << face) == 0 || self.is_covered(face, at)) {
            let mut local = (q - Vec3::splat(0.5)) * self.size;
            for axis in 0..3 {
                if (on & whole) >> (2 * axis) & 3 != 0 {
                    local[axis] += BULGE.copysign(local[axis]);
                }
            }
            self.break_off(&mut local);
            return (self.world(local), 0.0);
        }
        self.worn(q, on)
    }

    /// Cuts off the broken corners; whether a point was on one.
    fn break_off(&self, local: &mut Vec3) -> bool {
        let mut broken = false;
        for &(normal, distance) in &self.breaks {
            let over = local.dot(normal) - distance;
            if over > 0.0 {
                *local -= normal * over;
                broken = true;
            }
        }
        broken
    }

    /// [`Shape::point`] where weather reaches the stone.
    fn worn(&self, q: Vec3, on: u8) -> (Vec3, f32) {
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

        // faces: hollows and pits, always inwards
        let rough = 0.5 + 0.5 * fbm(self.block.seed + 2, place * 3.4, 3);
        let pits = smoothstep(0.35, 0.8, gradient(self.block.seed + 3, place * 7.0));
        let depth = wear.rough * (1.1 * rough + 1.4 * pits);
        local -= outward * depth.min(0.2 * half.min_element());
        // joints stay narrow
        for axis in 0..3 {
            if (on & self.block.contacts.whole) >> (2 * axis) & 3 != 0 {
                local[axis] = ideal[axis] - (ideal[axis] - local[axis]).clamp(-RECESS, RECESS);
            }
        }
        if self.break_off(&mut local) {
            lost += 0.05;
        }

        if let Some(relief) = &self.block.relief
            && q.z == 1.0
        {
            local.z += relief.height(local.x, local.y);
        }
        (self.world(local), lost)
    }

    fn world(&self, local: Vec3) -> Vec3 {
        self.block.ideal((local / self.size.max(Vec3::splat(1e-6)) + Vec3::splat(0.5)).to_array())
    }
}

fn signs(v: Vec3) -> Vec3 {
    Vec3::new(1.0_f32.copysign(v.x), 1.0_f32.copysign(v.y), 1.0_f32.copysign(v.z))
}
