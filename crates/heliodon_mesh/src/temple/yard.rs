//! The masons' yard: frames to build along, and the list of stones that grows.

use super::block::{Block, Wear};
use super::marble::{Look, Stone};
use super::measures::curvature;
use super::sizing::Grain;
use super::solid::SolidMesh;
use super::tube::Tube;
use glam::Vec3;
use heliodon_math::random::{hash2_u32, unit_f32};

/// One closed solid.
#[derive(Clone, Debug)]
pub enum Element {
    /// With eight corners.
    Block(Block),
    /// About an axis.
    Tube(Tube),
}

impl Element {
    /// Triangles it will have.
    pub fn count(&self, grain: &Grain) -> usize {
        match self {
            Self::Block(block) => block.count(grain),
            Self::Tube(tube) => tube.count(grain),
        }
    }

    /// Its positions and triangles alone.
    pub fn shape(&self, grain: &Grain) -> SolidMesh {
        match self {
            Self::Block(block) => block.shape(grain).mesh,
            Self::Tube(tube) => tube.shape(grain).0,
        }
    }

    /// Triangles of its faces, in order; a tube counts as one.
    pub fn face_counts(&self, grain: &Grain) -> [usize; 6] {
        match self {
            Self::Block(block) => block.face_counts(grain),
            Self::Tube(tube) => [tube.count(grain), 0, 0, 0, 0, 0],
        }
    }

    /// Notes which faces are seen; a stone of which none is seen is cut that much coarser.
    pub fn note_seen(&mut self, seen: u8, coarser: f32) {
        let factor = if seen == 0 { coarser } else { 1.0 };
        match self {
            Self::Block(block) => {
                block.seen = Some(seen);
                block.coarser *= factor;
            }
            Self::Tube(tube) => tube.coarser *= factor,
        }
    }

    /// Its mesh.
    pub fn mesh(&self, grain: &Grain) -> SolidMesh {
        match self {
            Self::Block(block) => block.mesh(grain),
            Self::Tube(tube) => tube.mesh(grain),
        }
    }
}

/// A vertical plane to build along: `along` to the right seen from before it, `out` towards the viewer.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Where all three coordinates are zero, the height apart.
    pub origin: Vec3,
    /// Direction of the first coordinate.
    pub along: Vec3,
    /// Direction of the third.
    pub out: Vec3,
}

impl Frame {
    /// The frame that faces `out` (a horizontal unit vector) from a place of the plan.
    pub fn facing(out: Vec3, origin: Vec3) -> Self {
        Self { origin, along: Vec3::Y.cross(out), out }
    }

    /// A point by its three coordinates; heights follow the curvature of the stylobate.
    pub fn point(&self, s: f32, y: f32, o: f32) -> Vec3 {
        let flat = self.origin + self.along * s + self.out * o;
        Vec3::new(flat.x, y + curvature(flat.x, flat.z), flat.z)
    }
}

/// A range along an axis of a frame.
pub type Span = (f32, f32);

/// Stones of one part of the site, in building order.
#[derive(Debug)]
pub struct Yard {
    /// The stones.
    pub elements: Vec<Element>,
    /// Weathering, 0 to 1.
    pub erosion: f32,
    /// How many blocks or courses are made as one stone where triangles are few.
    pub merge: u32,
    seed: u32,
    counter: u32,
}

impl Yard {
    /// An empty yard. Yards of other `stream`s draw other numbers.
    pub fn new(seed: u32, stream: u32, erosion: f32, merge: u32) -> Self {
        Self { elements: Vec::new(), erosion, merge, seed: hash2_u32(seed, stream), counter: 0 }
    }

    /// A fresh seed.
    pub fn seed(&mut self) -> u32 {
        self.counter += 1;
        hash2_u32(self.seed, self.counter)
    }

    /// A fresh number in [0, 1).
    pub fn random(&mut self) -> f32 {
        unit_f32(self.seed())
    }

    /// A fresh number in [low, high).
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.random()
    }

    /// A fresh look of old marble; one stone in `1 / new` is a restorer's.
    pub fn marble(&mut self, shelter: f32, new: f32) -> Look {
        let stone = if self.random() < new { Stone::NewMarble } else { Stone::Marble };
        Look { stone, seed: self.seed(), shelter, age: 0.25 + 0.75 * self.erosion }
    }

    /// A dressed stone between three spans of a frame, set as masons' stones are after centuries: a few millimetres before
    /// or behind its neighbours, and into them, so that no two faces lie in one plane.
    pub fn ashlar(&mut self, frame: &Frame, s: Span, y: Span, o: Span, covered: u8, look: Look) -> &mut Block {
        let wear = Wear::dressed(self.erosion);
        self.stone(frame, s, y, o, covered, look, wear)
    }

    /// [`Yard::ashlar`] with its own wear.
    #[expect(clippy::too_many_arguments, reason = "three spans are one box; a struct would only rename them")]
    pub fn stone(&mut self, frame: &Frame, s: Span, y: Span, o: Span, covered: u8, look: Look, wear: Wear) -> &mut Block {
        let slack = 0.0015 + 0.004 * self.erosion;
        let proud = self.range(-slack, slack);
        let lean = [0, 1, 2].map(|_| self.range(-0.4 * slack, 0.4 * slack));
        let bed = 0.003 + self.range(0.0, 0.002);
        let corner = |i: usize| {
            let right = i & 1 != 0;
            let up = i & 2 != 0;
            let front = i & 4 != 0;
            let s = if right { s.1 + bed } else { s.0 - bed };
            let y = if up { y.1 } else { y.0 - bed };
            let sign = |positive: bool| if positive { 1.0 } else { -1.0 };
            let turn = lean[0] * sign(right) + lean[1] * sign(up);
            let o = if front { o.1 + proud + turn } else { o.0 + lean[2] };
            frame.point(s, y, o)
        };
        self.push_block(Block::new(std::array::from_fn(corner), wear, look, covered))
    }

    /// Adds a block.
    pub fn push_block(&mut self, block: Block) -> &mut Block {
        self.elements.push(Element::Block(block));
        match self.elements.last_mut() {
            Some(Element::Block(block)) => block,
            _ => unreachable!("a block was pushed just now"),
        }
    }

    /// Adds a tube.
    pub fn push_tube(&mut self, tube: Tube) {
        self.elements.push(Element::Tube(tube));
    }
}
