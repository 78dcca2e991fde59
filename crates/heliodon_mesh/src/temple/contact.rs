//! Where stones lie against one another, found from their undamaged shapes.
//!
//! Masons closed joints to a hair, so nothing of a joint but its worn rim is seen or lit. A face that others cover wholly
//! reaches into them ([`BULGE`]), and a face covered in part keeps its plane there, while weather eats at what is free: the
//! vertices of joints then lie inside of stone, where a bake leaves them out, and not in hollows, which are black and into
//! which triangles would carry light. Whoever sets a stone need not say what it will touch.

use super::block::Block;
use super::tube::Tube;
use super::yard::Element;
use glam::Vec3;
use rayon::prelude::*;
use std::sync::Arc;

/// How far a covered face reaches into its neighbours, metres: more than stones stand before one another, less than what
/// would come out at the other side of the thinnest.
pub const BULGE: f32 = 0.015;
/// Neighbours must go on so far beyond a covered face.
const DEPTH: f32 = BULGE + 0.005;
/// The rim of a face that may be free though the face counts as covered: what wear takes away.
const RIM: f32 = 0.025;
/// A place of a face lies inside a joint if others cover it so far about.
const ABOUT: f32 = 0.04;
/// Distance between the places of a face that are looked at, and how many along a side at most.
const SPACING: f32 = 0.15;
const MOST_PLACES: usize = 14;
/// Cells of the plan in which neighbours are looked for, metres.
const CELL: f32 = 2.0;
/// Stones more worn than this have no shape to rely on.
const WORN: f32 = 0.06;

/// The undamaged shape of a stone.
#[derive(Clone, Debug)]
pub enum Body {
    /// Between planes: outward normals and distances.
    Planes([(Vec3, f32); 6]),
    /// About an axis from a point: heights and radii.
    Round {
        /// Where heights are zero.
        origin: Vec3,
        /// The axis, a unit vector.
        up: Vec3,
        /// Heights and radii, from below.
        profile: Vec<(f32, f32)>,
    },
}

impl Body {
    /// Whether a point lies inside.
    pub fn holds(&self, p: Vec3) -> bool {
        match self {
            Self::Planes(planes) => planes.iter().all(|&(normal, distance)| normal.dot(p) < distance),
            Self::Round { origin, up, profile } => {
                let to = p - *origin;
                let y = to.dot(*up);
                let out = (to - *up * y).length();
                profile.windows(2).any(|pair| {
                    let ((low, r0), (high, r1)) = (pair[0], pair[1]);
                    (low..high).contains(&y) && out < r0 + (r1 - r0) * (y - low) / (high - low)
                })
            }
        }
    }

    fn of_block(block: &Block) -> Option<Self> {
        let sound = block.wear.round < WORN && block.wear.breaks <= 1 && !block.ornament;
        sound.then(|| {
            Self::Planes(std::array::from_fn(|face| {
                let normal = block.face_normal(face);
                (normal, normal.dot(block.face_point(face, 0.5, 0.5)))
            }))
        })
    }

    fn of_tube(tube: &Tube) -> Option<Self> {
        let unit = tube.axes.iter().all(|axis| (axis.length_squared() - 1.0).abs() < 1e-3);
        (unit && !tube.ornament).then(|| {
            // between the arrises and the bottoms of the flutes
            let profile = tube.knots.iter().map(|k| (k.y, k.radius * (1.0 - 0.05 * k.flute))).collect();
            Self::Round { origin: tube.origin, up: tube.axes[1], profile }
        })
    }
}

/// What lies against the faces of one block.
#[derive(Clone, Debug, Default)]
pub struct Contacts {
    /// Faces that others cover wholly (`FACE_*`).
    pub whole: u8,
    /// Faces that others cover in part, and by what.
    part: Vec<(u8, Arc<Body>)>,
}

impl Contacts {
    /// Whether a face is covered in part, `at` a place of it and a hand about it.
    pub fn cover(&self, face: usize, at: Vec3, normal: Vec3, across: [Vec3; 2]) -> bool {
        let any = |p: Vec3| self.part.iter().any(|(of, body)| usize::from(*of) == face && body.holds(p));
        let at = at + normal * DEPTH;
        any(at) && across.iter().all(|&side| any(at + side * ABOUT) && any(at - side * ABOUT))
    }
}

/// A stone that others may lie against, in a box.
struct Neighbour {
    body: Arc<Body>,
    low: Vec3,
    high: Vec3,
}

/// Neighbours by cells of the plan.
struct Plan {
    neighbours: Vec<Option<Neighbour>>,
    cells: Vec<Vec<u32>>,
    corner: Vec3,
    size: [usize; 2],
}

impl Plan {
    fn new(neighbours: Vec<Option<Neighbour>>) -> Self {
        let low = neighbours.iter().flatten().fold(Vec3::MAX, |low, n| low.min(n.low));
        let high = neighbours.iter().flatten().fold(Vec3::MIN, |high, n| high.max(n.high));
        let count = |from: f32, to: f32| ((to - from).max(0.0) / CELL) as usize + 1;
        let size = [count(low.x, high.x), count(low.z, high.z)];
        let mut plan = Self { neighbours: Vec::new(), cells: vec![Vec::new(); size[0] * size[1]], corner: low, size };
        for (i, neighbour) in neighbours.iter().enumerate() {
            if let Some(neighbour) = neighbour {
                for cell in plan.cells_of(neighbour.low, neighbour.high) {
                    plan.cells[cell].push(i as u32);
                }
            }
        }
        plan.neighbours = neighbours;
        plan
    }

    fn cells_of(&self, low: Vec3, high: Vec3) -> impl Iterator<Item = usize> + use<> {
        let cell = |x: f32, count: usize| ((x / CELL).max(0.0) as usize).min(count - 1);
        let (low, high, [columns, rows]) = (low - self.corner, high - self.corner, self.size);
        let (from, to) = (cell(low.x, columns), cell(high.x, columns));
        (cell(low.z, rows)..=cell(high.z, rows)).flat_map(move |row| (from..=to).map(move |column| row * columns + column))
    }

    /// Stones other than `own` whose boxes meet the given one, in their order.
    fn meeting(&self, own: usize, low: Vec3, high: Vec3) -> Vec<&Arc<Body>> {
        let mut found: Vec<u32> = self.cells_of(low, high).flat_map(|cell| self.cells[cell].iter().copied()).collect();
        found.sort_unstable();
        found.dedup();
        let meets = |n: &&Neighbour| n.low.cmple(high).all() && n.high.cmpge(low).all();
        let others = found.into_iter().map(|i| i as usize).filter(|&i| i != own);
        others.filter_map(|i| self.neighbours[i].as_ref()).filter(meets).map(|n| &n.body).collect()
    }
}

/// Finds what lies against the faces of all blocks.
pub fn note_contacts(parts: &mut [&mut [Element]]) {
    let neighbours = parts.iter().flat_map(|elements| elements.iter()).map(neighbour).collect();
    let plan = Plan::new(neighbours);
    let mut first = 0;
    for elements in parts {
        elements.par_iter_mut().enumerate().for_each(|(i, element)| {
            if let Element::Block(block) = element {
                block.contacts = contacts(block, &plan, first + i);
            }
        });
        first += elements.len();
    }
}

fn neighbour(element: &Element) -> Option<Neighbour> {
    let (body, points): (_, Vec<Vec3>) = match element {
        Element::Block(block) => (Body::of_block(block)?, block.corners.to_vec()),
        Element::Tube(tube) => {
            let radius = Vec3::splat(tube.knots.iter().map(|k| k.radius).fold(0.0, f32::max));
            let axis = tube.knots.iter().map(|k| tube.origin + tube.axes[1] * k.y);
            (Body::of_tube(tube)?, axis.flat_map(|p| [p - radius, p + radius]).collect())
        }
    };
    let low = points.iter().fold(Vec3::MAX, |low, &p| low.min(p));
    let high = points.iter().fold(Vec3::MIN, |high, &p| high.max(p));
    Some(Neighbour { body: Arc::new(body), low, high })
}

fn contacts(block: &Block, plan: &Plan, own: usize) -> Contacts {
    let mut contacts = Contacts::default();
    for face in 0..6 {
        let normal = block.face_normal(face);
        let beyond = |u: f32, v: f32| block.face_point(face, u, v) + normal * DEPTH;
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|(u, v)| beyond(u, v));
        let low = corners.into_iter().fold(Vec3::MAX, Vec3::min) - Vec3::splat(ABOUT);
        let high = corners.into_iter().fold(Vec3::MIN, Vec3::max) + Vec3::splat(ABOUT);
        let bodies = plan.meeting(own, low, high);
        if bodies.is_empty() {
            continue;
        }
        let rows = places(corners[0].distance(corners[2]));
        let columns = places(corners[0].distance(corners[1]));
        let at = rows.iter().flat_map(|&v| columns.iter().map(move |&u| (u, v)));
        let free = at.filter(|&(u, v)| !bodies.iter().any(|body| body.holds(beyond(u, v)))).count();
        if free == 0 {
            contacts.whole |= 1 << face;
        } else if free < rows.len() * columns.len() {
            contacts.part.extend(bodies.into_iter().map(|body| (face as u8, Arc::clone(body))));
        }
    }
    contacts
}

/// Places along a side, as parts of its length.
fn places(length: f32) -> Vec<f32> {
    let count = ((length / SPACING).ceil() as usize).clamp(2, MOST_PLACES);
    let rim = (RIM / length.max(1e-3)).min(0.25);
    (0..=count).map(|i| rim + (1.0 - 2.0 * rim) * i as f32 / count as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::super::block::{FACE_BOTTOM, FACE_LEFT, FACE_RIGHT, FACE_TOP};
    use super::super::yard::{Frame, Yard};
    use super::*;

    #[test]
    fn covered_faces_are_told_from_free_and_from_half_covered_ones() {
        let mut yard = Yard::new(1, 1, 0.5, 1);
        let frame = Frame::facing(Vec3::Z, Vec3::ZERO);
        let look = yard.marble(0.0, 0.0);
        // two stones side by side on a wider one
        yard.ashlar(&frame, (-1.0, 1.0), (0.0, 0.5), (-0.5, 0.2), 0, look);
        yard.ashlar(&frame, (-0.9, 0.0), (0.5, 1.0), (-0.5, 0.0), 0, look);
        yard.ashlar(&frame, (0.0, 0.9), (0.5, 1.0), (-0.5, 0.0), 0, look);
        note_contacts(&mut [&mut yard.elements]);
        let found: Vec<&Block> =
            yard.elements.iter().filter_map(|e| if let Element::Block(block) = e { Some(block) } else { None }).collect();
        assert_eq!([0, 1, 2].map(|i| found[i].contacts.whole), [0, FACE_BOTTOM | FACE_RIGHT, FACE_BOTTOM | FACE_LEFT]);
        let top = FACE_TOP.trailing_zeros() as usize;
        let cover = |u: f32, v: f32| {
            let base = found[0];
            base.contacts.cover(top, base.face_point(top, u, v), Vec3::Y, [Vec3::X, Vec3::Z])
        };
        // the top's first axis runs outwards, its second along
        assert!(cover(0.3, 0.3) && cover(0.4, 0.5) && !cover(0.9, 0.5) && !cover(0.3, 0.99) && !cover(0.70, 0.5));
    }
}
