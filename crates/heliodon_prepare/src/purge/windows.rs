//! What eyes see through windows.

use crate::ViewCell;
use glam::{DVec3, Mat3, Vec3};

/// How much wider than they are windows count while triangles are looked for: this part of their sides.
pub(super) const SLACK: f32 = 1e-3;

/// What coordinates in double precision may be off by, metres: kilometres times 2^-53, and a good deal more.
const ROUNDING_M: f64 = 1e-9;

/// A window seen from one eye: a pyramid of directions.
#[derive(Clone, Copy)]
pub(super) struct Gate {
    /// Inward normals of the planes through the eye that bound it.
    planes: [Vec3; 5],
}

impl Gate {
    /// `None` where the eye lies in the window's plane.
    pub fn new(eye: Vec3, [corner, right, top]: [Vec3; 3], slack: f32) -> Option<Self> {
        let basis = Mat3::from_cols(right - corner, top - corner, corner - eye);
        let size = basis.x_axis.length() * basis.y_axis.length() * basis.z_axis.length();
        // Flatter than what the coordinates' own rounding leaves of the angle.
        (basis.determinant().abs() > 1e-6 * size).then(|| {
            // A direction is k (u right + v up + the way to the corner): rows of the inverse give k u, k v and k.
            let inverse = basis.inverse().transpose();
            let [u, v, k] = [inverse.x_axis, inverse.y_axis, inverse.z_axis];
            let wide = slack * k;
            Self { planes: [u + wide, k - u + wide, v + wide, k - v + wide, k] }
        })
    }

    pub fn passes(&self, direction: Vec3) -> bool {
        self.planes.iter().all(|plane| plane.dot(direction) >= 0.0)
    }

    /// Whether a box, given relative to the eye, may be seen through it.
    pub fn may_show(&self, low: Vec3, high: Vec3) -> bool {
        self.planes.iter().all(|&n| (n * low).max(n * high).element_sum() >= 0.0)
    }
}

/// All windows of a room, seen from one eye.
#[derive(Clone)]
pub(super) struct Gates {
    open: bool,
    gates: Vec<Gate>,
}

impl Gates {
    pub fn new(eye: Vec3, cell: &ViewCell, slack: f32) -> Self {
        let gates = cell.windows.iter().filter_map(|&window| Gate::new(eye, window, slack)).collect();
        Self { open: cell.windows.is_empty(), gates }
    }

    /// Whether the eye sees in all directions.
    pub fn is_open(&self) -> bool {
        self.open
    }

    pub fn passes(&self, direction: Vec3) -> bool {
        self.open || self.gates.iter().any(|gate| gate.passes(direction))
    }

    pub fn may_show(&self, low: Vec3, high: Vec3) -> bool {
        self.open || self.gates.iter().any(|gate| gate.may_show(low, high))
    }
}

/// What no eye of a room sees through its windows, whatever stands in the way.
///
/// A plane through an edge of the window with the whole room on its one side and the window on the other: along a way from an eye
/// through the window the distance to that plane grows, so beyond the window everything seen lies on the window's side. The window's
/// own plane is another such. What lies between eye and window is in the box around both, and never counts as outside.
pub(super) struct Outside {
    windows: Vec<Beside>,
    margin_m: f64,
}

/// Of one window: the least and greatest corner of the box around it and the room, and the planes (unit normal, offset) that separate the two.
struct Beside {
    low: Vec3,
    high: Vec3,
    planes: Vec<(DVec3, f64)>,
}

impl Outside {
    /// `None` if the room has no windows.
    pub fn new(cell: &ViewCell, margin_m: f32) -> Option<Self> {
        let margin_m = f64::from(margin_m);
        let windows: Vec<_> = cell.windows.iter().map(|window| Beside::new(cell, window)).collect();
        (!windows.is_empty()).then_some(Self { windows, margin_m })
    }

    pub fn holds(&self, corners: [Vec3; 3]) -> bool {
        let (low, high) = (corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2]));
        let corners = corners.map(Vec3::as_dvec3);
        self.windows.iter().all(|beside| {
            let apart = low.cmpgt(beside.high).any() || high.cmplt(beside.low).any();
            apart && beside.planes.iter().any(|(n, at)| corners.iter().all(|c| n.dot(*c) - at < -self.margin_m))
        })
    }
}

impl Beside {
    fn new(cell: &ViewCell, &[a, b, c]: &[Vec3; 3]) -> Self {
        let ring = [a, b, b + c - a, c];
        let wide = ring.map(|p| p + 2.0 * SLACK * (p - 0.5 * (b + c)));
        let (low, high) = wide.iter().fold((cell.low, cell.high), |(l, h), &p| (l.min(p), h.max(p)));
        let window = wide.map(Vec3::as_dvec3);
        let room: [DVec3; 8] = corners_of(cell).map(Vec3::as_dvec3);
        let mut planes = Vec::new();
        let mut add = |normal: DVec3, through: DVec3| {
            let Some(n) = normal.try_normalize() else { return };
            for n in [n, -n] {
                let at = n.dot(through);
                let apart =
                    room.iter().all(|p| n.dot(*p) - at <= ROUNDING_M) && window.iter().all(|p| n.dot(*p) - at >= -ROUNDING_M);
                if apart {
                    planes.push((n, at));
                }
            }
        };
        add((window[1] - window[0]).cross(window[3] - window[0]), window[0]);
        for i in 0..4 {
            let (from, to) = (window[i], window[(i + 1) % 4]);
            room.iter().for_each(|&corner| add((to - from).cross(corner - from), from));
        }
        Self { low, high, planes }
    }
}

/// The corners of a room's box.
pub(super) fn corners_of(cell: &ViewCell) -> [Vec3; 8] {
    core::array::from_fn(|i| {
        let pick = |axis: usize| if i >> axis & 1 == 1 { cell.high[axis] } else { cell.low[axis] };
        Vec3::new(pick(0), pick(1), pick(2))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn room() -> ViewCell {
        let window = [Vec3::new(-0.5, 1.0, -3.0), Vec3::new(0.5, 1.0, -3.0), Vec3::new(-0.5, 2.0, -3.0)];
        ViewCell { low: Vec3::new(-1.0, 1.0, -1.0), high: Vec3::new(1.0, 2.0, 1.0), windows: vec![window] }
    }

    #[test]
    fn directions_pass_between_the_corners_only() {
        let eye = Vec3::new(0.0, 1.5, 0.0);
        let gates = Gates::new(eye, &room(), 0.0);
        for (x, y, passes) in
            [(0.0, 1.5, true), (0.49, 1.99, true), (0.51, 1.5, false), (0.0, 0.99, false), (-0.49, 1.01, true)]
        {
            assert_eq!(gates.passes(Vec3::new(x, y, -3.0) - eye), passes, "{x} {y}");
            assert!(!gates.passes(eye - Vec3::new(x, y, -3.0)), "nothing is seen backwards");
        }
        assert!(gates.may_show(Vec3::new(-9.0, 0.0, -9.0), Vec3::new(-0.9, 0.1, -4.0)));
        assert!(!gates.may_show(Vec3::new(2.0, 0.0, -4.0), Vec3::new(3.0, 0.1, -3.0)));
        let on_its_plane = Gates::new(Vec3::new(7.0, 1.5, -3.0), &room(), 0.0);
        assert!(!on_its_plane.passes(Vec3::NEG_X));
    }

    #[test]
    fn outside_is_what_no_eye_sees_through_the_window() {
        let room = room();
        let outside = Outside::new(&room, 1e-4).unwrap();
        let mut random = heliodon_math::random::Pcg32::new(5, 5);
        let (mut shown, mut hidden) = (0, 0);
        for _ in 0..3000 {
            let at = Vec3::from_array(core::array::from_fn(|_| random.range_f32(-12.0, 12.0)));
            let eyes = (0..400).map(|_| {
                let share = Vec3::from_array(core::array::from_fn(|_| random.next_f32()));
                room.low + share * (room.high - room.low)
            });
            let beyond = |eye: Vec3| Gates::new(eye, &room, 0.0).passes(at - eye) && at.z < -3.0;
            let seen = eyes.into_iter().chain(corners_of(&room)).any(beyond);
            assert!(!(seen && outside.holds([at; 3])), "{at} is seen");
            shown += usize::from(seen);
            hidden += usize::from(outside.holds([at; 3]));
        }
        // the room and the window take up little of the space; what lies neither seen nor outside is where few eyes look
        assert!(shown > 50 && shown + hidden > 2900, "{shown} {hidden}");
        assert!(!outside.holds([Vec3::new(0.0, 1.2, -2.0); 3]), "between eyes and window");
    }
}
