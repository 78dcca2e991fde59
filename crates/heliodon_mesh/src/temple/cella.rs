//! The cella: its walls of ashlar, doors, dividing wall, the porches' beams and frieze, and the inner colonnade.

use super::State;
use super::block::{FACE_BACK, FACE_BOTTOM, FACE_FRONT, FACE_LEFT, FACE_RIGHT, FACE_TOP, Wear};
use super::column::Column;
use super::measures::{
    CELLA_PLATFORM, CELLA_WALL, CELLA_WIDTH, COLUMN_LOWER_DIAMETER, COLUMN_UPPER_DIAMETER, COURSE_HEIGHT, COURSE_LENGTH, DOOR,
    INNER_LOWER, INNER_UPPER, ORTHOSTATE_HEIGHT, PORCH_COLUMN_HEIGHT, PORCH_COLUMNS, PORCH_SPACING, STYLOBATE_TOP, curvature,
};
use super::noise::gradient;
use super::peristyle::{PORCH_AXIS, porch_standing};
use super::relief::Relief;
use super::yard::{Frame, Span, Yard};
use glam::{Vec2, Vec3};

const FLOOR: f32 = STYLOBATE_TOP + CELLA_PLATFORM;
/// Top of the walls, below the frieze that runs around them.
const WALL_TOP: f32 = FLOOR + PORCH_COLUMN_HEIGHT;
/// Outer faces of the long walls.
const HALF_WIDTH: f32 = 0.5 * CELLA_WIDTH - 0.55;
/// Ends of the long walls, the antae behind the porches.
const HALF_LENGTH: f32 = 24.4;

/// A stretch of wall of two leaves.
struct Wall<'a> {
    frame: Frame,
    s: Span,
    /// Outer face of each leaf and its depth; the first is the front one.
    thickness: f32,
    /// What stands: height over the floor at a place along the wall.
    height: &'a dyn Fn(f32) -> f32,
    /// A door: its span and height.
    door: Option<(Span, f32)>,
    coarser: f32,
}

impl Wall<'_> {
    fn build(&self, yard: &mut Yard) {
        let merge = yard.merge;
        let mut bottom = 0.0;
        let mut course = 0_u32;
        while bottom < PORCH_COLUMN_HEIGHT - 0.1 {
            let height = if course == 0 { ORTHOSTATE_HEIGHT } else { COURSE_HEIGHT * merge.min(4) as f32 };
            let top = (bottom + height).min(PORCH_COLUMN_HEIGHT);
            self.course(yard, course, bottom, top);
            (bottom, course) = (top, course + 1);
        }
    }

    fn stands(&self, s: f32, top: f32) -> bool {
        s > self.s.0 && s < self.s.1 && top <= (self.height)(s) + 0.05
    }

    fn course(&self, yard: &mut Yard, course: u32, bottom: f32, top: f32) {
        let orthostate = course == 0;
        let length = COURSE_LENGTH * if orthostate { 1.5 } else { 1.0 } * yard.merge as f32;
        let count = ((self.s.1 - self.s.0) / length).round().max(1.0) as i32;
        let step = (self.s.1 - self.s.0) / count as f32;
        let shift = if course % 2 == 1 { 0.5 } else { 0.0 };
        let half = 0.5 * self.thickness;
        for i in -1..count {
            let from = (self.s.0 + (i as f32 + shift) * step).max(self.s.0);
            let to = (self.s.0 + (i as f32 + 1.0 + shift) * step).min(self.s.1);
            if to - from < 0.05 {
                continue;
            }
            for piece in self.beside_door((from, to), top) {
                let middle = 0.5 * (piece.0 + piece.1);
                if piece.1 - piece.0 < 0.05 || !self.stands(middle, top) {
                    continue;
                }
                let next_course = top + COURSE_HEIGHT * yard.merge.min(4) as f32;
                let crowned = self.stands(middle, next_course) || top > PORCH_COLUMN_HEIGHT - 0.1;
                let flanked = self.stands(middle - step, top) && self.stands(middle + step, top);
                let torn = !crowned || !flanked;
                let mut covered = FACE_BOTTOM | FACE_LEFT | FACE_RIGHT;
                if crowned {
                    covered |= FACE_TOP;
                }
                if !flanked {
                    covered &= !(FACE_LEFT | FACE_RIGHT);
                }
                for (front, o) in [(true, (-half - 0.004, 0.0)), (false, (-self.thickness, -half))] {
                    let look = yard.marble(0.2, if torn { 0.0 } else { 0.05 });
                    let wear = if torn && yard.random() < 0.7 * yard.erosion {
                        Wear { breaks: 1, ..Wear::torn(yard.erosion) }
                    } else {
                        Wear::dressed(yard.erosion)
                    };
                    let inner = if front { FACE_BACK } else { FACE_FRONT };
                    // the first course is let into the floor
                    let y = (FLOOR + if course == 0 { -0.04 } else { bottom }, FLOOR + top);
                    let block = yard.stone(&self.frame, piece, y, o, covered | inner, look, wear);
                    block.coarser = self.coarser;
                }
            }
        }
    }

    /// What a door leaves of a stone: the parts at its sides.
    fn beside_door(&self, piece: Span, top: f32) -> Vec<Span> {
        match self.door {
            Some((door, height)) if top <= height => {
                [(piece.0, piece.1.min(door.0)), (piece.0.max(door.1), piece.1)].into_iter().filter(|p| p.1 > p.0).collect()
            }
            _ => vec![piece],
        }
    }
}

/// Adds the cella.
pub fn build(yard: &mut Yard, state: State) {
    let ruined = state == State::Ruined;
    let seed = yard.seed();
    // the explosion of 1687 threw the middle down; restorers laid some courses again
    let long = |south: bool| {
        move |x: f32| {
            if !ruined {
                return PORCH_COLUMN_HEIGHT;
            }
            let jag = 1.3 * gradient(seed ^ u32::from(south), Vec3::new(x * 0.32, 0.0, 0.5));
            let west = 10.4 - 0.85 * (x + HALF_LENGTH - 6.5).max(0.0);
            let east = 6.3 - 0.75 * (HALF_LENGTH - 3.0 - x).max(0.0);
            let low = if south { 1.3 } else { 2.3 };
            let height = west.max(east).max(low) + jag;
            if x < -HALF_LENGTH + 6.5 { PORCH_COLUMN_HEIGHT } else { height.clamp(1.2, PORCH_COLUMN_HEIGHT) }
        }
    };
    for (south, out) in [(false, Vec3::NEG_Z), (true, Vec3::Z)] {
        let frame = Frame::facing(out, out * HALF_WIDTH);
        let profile = long(south);
        let along = frame.along.x;
        let height = move |s: f32| profile(s * along);
        let s = (-HALF_LENGTH, HALF_LENGTH);
        Wall { frame, s, thickness: CELLA_WALL, height: &height, door: None, coarser: 1.0 }.build(yard);
    }
    let across = HALF_WIDTH - CELLA_WALL + 0.01;
    let door = Some(((-0.5 * DOOR.0, 0.5 * DOOR.0), DOOR.1));
    let full = |_: f32| PORCH_COLUMN_HEIGHT;
    let low = move |s: f32| if ruined { 2.2 + 1.5 * gradient(seed, Vec3::new(s * 0.4, 3.0, 0.5)) } else { PORCH_COLUMN_HEIGHT };
    let east = move |s: f32| {
        if ruined { 3.6 + 0.25 * s.abs() + 1.2 * gradient(seed, Vec3::new(s * 0.4, 7.0, 0.5)) } else { PORCH_COLUMN_HEIGHT }
    };
    // the west door's wall, the wall between the two rooms, the east door's wall
    let west_frame = Frame::facing(Vec3::NEG_X, Vec3::NEG_X * 22.9);
    Wall { frame: west_frame, s: (-across, across), thickness: 1.9, height: &full, door, coarser: 1.0 }.build(yard);
    let middle = Frame::facing(Vec3::NEG_X, Vec3::NEG_X * 7.6);
    Wall { frame: middle, s: (-across, across), thickness: 1.0, height: &low, door: None, coarser: 1.5 }.build(yard);
    let east_frame = Frame::facing(Vec3::X, Vec3::X * 22.9);
    Wall { frame: east_frame, s: (-across, across), thickness: 1.9, height: &east, door, coarser: 1.5 }.build(yard);
    crown(yard, state);
    inner_colonnade(yard, state);
}

/// What lies on the walls and the porches: a beam and the carved frieze with its procession.
fn crown(yard: &mut Yard, state: State) {
    let ruined = state == State::Ruined;
    for (west, x) in [(true, -PORCH_AXIS), (false, PORCH_AXIS)] {
        let out = if west { Vec3::NEG_X } else { Vec3::X };
        let frame = Frame::facing(out, Vec3::X * x);
        let at = |i: usize| (i as f32 - 2.5) * PORCH_SPACING;
        for bay in 0..PORCH_COLUMNS - 1 {
            // the columns are counted from the north, which is the left of the west side only
            let columns = if west { (bay, bay + 1) } else { (PORCH_COLUMNS - 1 - bay, PORCH_COLUMNS - 2 - bay) };
            if porch_standing(state, !west, columns.0) < 1.0 || porch_standing(state, !west, columns.1) < 1.0 {
                continue;
            }
            let reach = |end: bool| if end { 0.78 } else { 0.0 };
            let s = (at(bay) - reach(bay == 0), at(bay + 1) + reach(bay + 2 == PORCH_COLUMNS));
            beam_and_frieze(yard, &frame, s, 0.78, 1.1);
        }
    }
    for (south, out) in [(false, Vec3::NEG_Z), (true, Vec3::Z)] {
        let frame = Frame::facing(out, out * (HALF_WIDTH - 0.5 * CELLA_WALL));
        let count = 12;
        let half = PORCH_AXIS - 0.75;
        for i in 0..count {
            let place = |i: u32| (2.0 * i as f32 / count as f32 - 1.0) * half;
            let s = (place(i), place(i + 1));
            let x = 0.5 * (s.0 + s.1) * frame.along.x;
            // of the flanks' frieze only the west end hangs, over the walls that carry it
            if ruined && x > -HALF_LENGTH + if south { 2.0 } else { 6.0 } {
                continue;
            }
            beam_and_frieze(yard, &frame, s, 0.5 * CELLA_WALL + 0.02, 1.0);
        }
    }
}

fn beam_and_frieze(yard: &mut Yard, frame: &Frame, s: Span, face: f32, coarser: f32) {
    let (beam, frieze, band) = (WALL_TOP + 0.95, WALL_TOP + 1.97, WALL_TOP + 2.25);
    let look = yard.marble(0.45, 0.04);
    yard.ashlar(frame, s, (WALL_TOP - 0.02, beam), (-face, face), FACE_TOP | FACE_LEFT | FACE_RIGHT, look).coarser = coarser;
    let look = yard.marble(0.5, 0.02);
    let (seed, damage) = (yard.seed(), yard.range(0.1, 0.5) * yard.erosion);
    let o = (-face + 0.1, face - 0.05);
    let stone = yard.ashlar(frame, s, (beam, frieze), o, FACE_TOP | FACE_BOTTOM | FACE_LEFT | FACE_RIGHT, look);
    stone.coarser = coarser;
    let half = Vec2::new(0.5 * (s.1 - s.0), 0.5 * (frieze - beam));
    stone.relief = Some(Box::new(Relief::procession(half, 0.06, damage, seed)));
    let look = yard.marble(0.5, 0.02);
    yard.ashlar(frame, s, (frieze, band), (-face, face + 0.06), FACE_LEFT | FACE_RIGHT, look).coarser = coarser;
}

/// Columns in two storeys about the statue's place: ten along each side, five across the end, corners counted twice.
fn inner_colonnade(yard: &mut Yard, state: State) {
    let mut places = Vec::new();
    for i in 0..10 {
        let x = -4.2 + 2.62 * i as f32;
        places.extend([Vec3::new(x, 0.0, -5.2), Vec3::new(x, 0.0, 5.2)]);
    }
    places.extend((1..4).map(|i| Vec3::new(-4.2, 0.0, -5.2 + 2.6 * i as f32)));
    for (i, place) in places.into_iter().enumerate() {
        // the ruin keeps stumps
        let standing = match state {
            State::Intact => 1.0,
            State::Ruined => [0.0, 0.22, 0.0, 0.0, 0.4, 0.12, 0.0, 0.3, 0.0, 0.0, 0.17][i % 11],
        };
        inner_column(yard, place, FLOOR, INNER_LOWER, standing);
        if state == State::Intact {
            inner_column(yard, place, FLOOR + INNER_LOWER.1 + 0.75, INNER_UPPER, 1.0);
        }
    }
    if state == State::Intact {
        let frame = Frame::facing(Vec3::Z, Vec3::ZERO);
        for y in [FLOOR + INNER_LOWER.1, FLOOR + INNER_LOWER.1 + 0.75 + INNER_UPPER.1] {
            let span = (y - 0.01, y + 0.75);
            for z in [-5.2, 5.2] {
                let look = yard.marble(0.3, 0.0);
                yard.ashlar(&frame, (-4.6, 19.8), span, (z - 0.42, z + 0.42), 0, look).coarser = 2.0;
            }
            let look = yard.marble(0.3, 0.0);
            yard.ashlar(&frame, (-4.58, -3.8), (span.0 + 0.003, span.1 - 0.004), (-4.8, 4.8), 0, look).coarser = 2.0;
        }
        // the four tall columns of the western room
        for (x, z) in [(-17.0, -3.4), (-17.0, 3.4), (-11.8, -3.4), (-11.8, 3.4)] {
            inner_column(yard, Vec3::new(x, 0.0, z), FLOOR, (1.25, PORCH_COLUMN_HEIGHT), 1.0);
        }
    }
}

fn inner_column(yard: &mut Yard, place: Vec3, foot: f32, (diameter, height): (f32, f32), standing: f32) {
    let look = yard.marble(0.3, 0.0);
    if standing <= 0.0 {
        return;
    }
    let column = Column {
        foot: Vec3::new(place.x, foot + curvature(place.x, place.z), place.z),
        lean: Vec3::ZERO,
        lower_diameter: diameter,
        upper_diameter: diameter * COLUMN_UPPER_DIAMETER / COLUMN_LOWER_DIAMETER,
        height,
        standing,
        coarser: 2.0,
    };
    column.build(yard, look);
}
