//! What lies in memory: nodes of eight children and packets of eight triangles, both transposed so that one vector holds
//! one coordinate of all eight.
//!
//! Eight and not four: one AVX register; and a packet of at most eight triangles costs about as much as one of one.
//! Bounds are plain `f32`. Quantising them would save about 6 bytes a triangle of some 70 and cost a conversion a node, and
//! the exact bounds are what makes culling exact (see [`crate::shear`]).

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Set in a child reference that means a packet.
pub(crate) const LEAF: u32 = 1 << 31;

/// Eight children of the hierarchy. Slots without a child have bounds that nothing meets.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(crate) struct Node {
    /// `bounds[0]` are the minima, `bounds[1]` the maxima, by axis and then by child.
    pub bounds: [[[f32; 8]; 3]; 2],
    /// Index of a node, or of a packet with [`LEAF`] set.
    pub child: [u32; 8],
    /// Up to the alignment, named so that all bytes have a value.
    unused: [u32; 8],
}

impl Node {
    /// The reference of a slot without a child: the root is nobody's.
    pub const NO_CHILD: u32 = 0;
    /// Without children.
    pub const EMPTY: Self =
        Self { bounds: [[[f32::INFINITY; 8]; 3], [[f32::NEG_INFINITY; 8]; 3]], child: [Self::NO_CHILD; 8], unused: [0; 8] };

    /// Gives a slot a child.
    pub fn set(&mut self, slot: usize, bounds: [Vec3; 2], reference: u32) {
        for (of, corner) in self.bounds.iter_mut().zip(bounds) {
            for (axis, value) in of.iter_mut().zip(corner.to_array()) {
                axis[slot] = value;
            }
        }
        self.child[slot] = reference;
    }

    /// Least and greatest corner of a slot.
    #[inline(always)]
    pub fn child_bounds(&self, slot: usize) -> [Vec3; 2] {
        self.bounds.map(|of| Vec3::from_array(of.map(|axis| axis[slot])))
    }

    /// Least and greatest corner of all.
    pub fn all_bounds(&self) -> [Vec3; 2] {
        let both = |[low, high]: [Vec3; 2], [l, h]: [Vec3; 2]| [low.min(l), high.max(h)];
        (1..8).fold(self.child_bounds(0), |all, slot| both(all, self.child_bounds(slot)))
    }
}

/// Up to eight triangles; lanes without one hold NaN, which no comparison lets through.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(32))]
pub(crate) struct Packet {
    /// By vertex, axis and lane; relative to the scene's centre.
    pub vertex: [[[f32; 8]; 3]; 3],
    /// The triangles' own indices.
    pub id: [u32; 8],
}

impl Packet {
    /// The index of a lane without a triangle.
    pub const NO_TRIANGLE: u32 = u32::MAX;
    /// Without triangles.
    pub const EMPTY: Self = Self { vertex: [[[f32::NAN; 8]; 3]; 3], id: [Self::NO_TRIANGLE; 8] };

    /// Gives a lane its corners, and `bounds` their extent.
    pub fn set(&mut self, lane: usize, corners: [Vec3; 3], bounds: &mut [Vec3; 2]) {
        for (vertex, corner) in corners.into_iter().enumerate() {
            *bounds = [bounds[0].min(corner), bounds[1].max(corner)];
            for axis in 0..3 {
                self.vertex[vertex][axis][lane] = corner[axis];
            }
        }
    }

    /// The lanes with triangles, and which.
    pub fn triangles(&self) -> impl Iterator<Item = (usize, u32)> + Clone + use<> {
        self.id.into_iter().enumerate().filter(|(_, id)| *id != Self::NO_TRIANGLE)
    }
}
