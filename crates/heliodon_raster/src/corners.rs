//! Where a group's vertices lie on the picture.

use crate::item_buffer::MAX_SIDE;
use crate::perspective::{GUARD, Perspective, Place};
use glam::Vec3;

/// Parts of a pixel that corners are rounded to: 2 to this power.
pub const FRACTION: u32 = 8;
/// Half a pixel in those.
pub const HALF: i32 = 1 << (FRACTION - 1);
/// The most vertices of a group.
const MOST: usize = 256;

/// A corner on the picture.
#[derive(Clone, Copy, Debug, Default)]
pub struct Corner {
    pub x: i32,
    pub y: i32,
    /// 1 / distance along forward.
    pub nearness: f32,
    /// Of [`Perspective::beyond`]: what keeps it from having a place.
    pub beyond: u32,
}

/// Twice the area of two corners and a place, in parts of pixels; positive where they run counterclockwise.
#[inline(always)]
pub fn cross(p: Corner, q: Corner, x: i32, y: i32) -> i64 {
    i64::from(q.x - p.x) * i64::from(y - p.y) - i64::from(q.y - p.y) * i64::from(x - p.x)
}

impl Corner {
    /// Of a place, on a picture of this size.
    #[inline(always)]
    pub fn new(perspective: &Perspective, size: [usize; 2], at: Place) -> Self {
        let beyond = perspective.beyond(at, GUARD);
        let [x, y, w] = at;
        let nearness = 1.0 / w;
        // Beside 1.5 times 2^23 a float's last bits are a whole number, the nearest, with its sign.
        let place = |x: f32, side: usize| {
            let half = (side << (FRACTION - 1)) as f32;
            let parts = (x * nearness * half).clamp(-LARGEST, LARGEST);
            (parts + BESIDE).to_bits() as i32 - BESIDE.to_bits() as i32 + half as i32
        };
        Self { x: place(x, size[0]), y: place(y, size[1]), nearness, beyond }
    }
}

/// Half the width of the numbers that are rounded so.
const LARGEST: f32 = (1 << 22) as f32;
const BESIDE: f32 = 3.0 * LARGEST;
// The farthest place within the guard is one.
const _: () = assert!((MAX_SIDE << (FRACTION - 1)) as f32 * GUARD <= LARGEST);

/// The corners of a group.
#[derive(Clone, Debug)]
pub struct Corners(Box<[Corner; MOST]>);

impl Default for Corners {
    fn default() -> Self {
        Self(Box::new([Corner { beyond: u32::MAX, ..Corner::default() }; MOST]))
    }
}

impl Corners {
    /// Places a group's vertices.
    #[inline(always)]
    pub fn place(&mut self, perspective: &Perspective, size: [usize; 2], [x, y, z]: [&[f32]; 3]) {
        assert!(x.len() <= MOST && y.len() == x.len() && z.len() == x.len(), "a group of {} vertices", x.len());
        for (((&x, &y), &z), to) in x.iter().zip(y).zip(z).zip(self.0.iter_mut()) {
            *to = Corner::new(perspective, size, perspective.place(Vec3::new(x, y, z)));
        }
    }

    /// The corner of a vertex.
    #[inline(always)]
    pub fn at(&self, vertex: u8) -> Corner {
        self.0[usize::from(vertex)]
    }
}
