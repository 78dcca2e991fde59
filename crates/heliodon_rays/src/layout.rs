//! What lies in memory: nodes of eight children and packets of eight triangles, both transposed so that one vector holds
//! one coordinate of all eight.
//!
//! Eight and not four: one AVX register; and a packet of at most eight triangles costs about as much as one of one.
//! Bounds are plain `f32`. Quantising them would save about 6 bytes a triangle of some 70 and cost a conversion a node, and
//! the exact bounds are what makes culling exact (see [`crate::shear`]).

use glam::Vec3;

/// Set in a child reference that means a packet.
pub(crate) const LEAF: u32 = 1 << 31;

/// Eight children of the hierarchy. Slots without a child have bounds that nothing meets.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Node {
    /// `bounds[0]` are the minima, `bounds[1]` the maxima, by axis and then by child.
    pub bounds: [[[f32; 8]; 3]; 2],
    /// Index of a node, or of a packet with [`LEAF`] set.
    pub child: [u32; 8],
}

impl Node {
    /// Without children.
    pub const EMPTY: Self = Self { bounds: [[[f32::INFINITY; 8]; 3], [[f32::NEG_INFINITY; 8]; 3]], child: [0; 8] };

    /// Gives a slot a child.
    pub fn set(&mut self, slot: usize, bounds: [Vec3; 2], reference: u32) {
        for (of, corner) in self.bounds.iter_mut().zip(bounds) {
            for (axis, value) in of.iter_mut().zip(corner.to_array()) {
                axis[slot] = value;
            }
        }
        self.child[slot] = reference;
    }
}

/// Up to eight triangles; lanes without one hold NaN, which no comparison lets through.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct Packet {
    /// By vertex, axis and lane; relative to the scene's centre.
    pub vertex: [[[f32; 8]; 3]; 3],
    /// The triangles' own indices.
    pub id: [u32; 8],
}

impl Packet {
    /// Without triangles.
    pub const EMPTY: Self = Self { vertex: [[[f32::NAN; 8]; 3]; 3], id: [u32::MAX; 8] };
}
