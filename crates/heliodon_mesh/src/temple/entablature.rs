//! Architrave, frieze and cornice of the four sides.

use super::block::{Block, FACE_BACK, FACE_BOTTOM, FACE_FRONT, FACE_LEFT, FACE_RIGHT, FACE_TOP, Wear};
use super::krepis::SIDES;
use super::measures::{
    ARCHITRAVE_DEPTH, ARCHITRAVE_HEIGHT, COLUMN_TOP, COLUMNS_LONG, COLUMNS_SHORT, FRIEZE_HEIGHT, GEISON_HEIGHT,
    GEISON_PROJECTION, HALF_AXES, ROOF_SLOPE, TRIGLYPH_WIDTH, column_places,
};
use super::peristyle::long_side_standing;
use super::relief::Relief;
use super::tube::{End, Knot, ShaftWear, Tube};
use super::yard::{Frame, Span, Yard};
use super::{State, marble::Look};
use glam::{Vec2, Vec3};

/// Half the depth of the architrave: its face before the columns' axes.
pub const FACE: f32 = 0.5 * ARCHITRAVE_DEPTH;
const FRIEZE_BOTTOM: f32 = COLUMN_TOP + ARCHITRAVE_HEIGHT;
const GEISON_BOTTOM: f32 = FRIEZE_BOTTOM + FRIEZE_HEIGHT;

/// How high the entablature of a bay still is: 0 nothing, 1 the architrave, 2 with the frieze, 3 with the cornice.
fn levels(state: State, side: usize, bay: usize) -> u32 {
    if state == State::Intact {
        return 3;
    }
    // bays counted from west to east on the flanks, from north to south on the fronts
    match side {
        0 | 1 => {
            let south = side == 1;
            let whole = |i: usize| long_side_standing(state, south, i) >= 1.0;
            if !(whole(bay) && whole(bay + 1)) {
                return 0;
            }
            match (south, bay) {
                (_, 0..=2) => 3,
                (false, 3 | 4) => 2,
                (false, 5 | 6) => 1,
                (false, 10) => 1,
                (false, 11 | 12) => 2,
                (true, 3) => 2,
                (true, 4) => 1,
                (true, 12) => 1,
                (true, 13) => 2,
                _ => 3,
            }
        }
        2 => 3,
        _ => [3, 3, 2, 1, 1, 2, 3][bay.min(6)],
    }
}

/// Adds the entablature of all sides.
pub fn build(yard: &mut Yard, state: State) {
    let (half_x, half_z) = HALF_AXES;
    for (side, out) in SIDES.into_iter().enumerate() {
        let long = side < 2;
        let (half, depth, count) = if long { (half_x, half_z, COLUMNS_LONG) } else { (half_z, half_x, COLUMNS_SHORT) };
        let frame = Frame::facing(out, out * depth);
        let places = column_places(count, half);
        for bay in 0..count - 1 {
            // `along` runs west to east on the south side and north to south on the west side only
            let forward = frame.along.x + frame.along.z > 0.0;
            let index = if forward { bay } else { count - 2 - bay };
            let levels = levels(state, side, index);
            let ends = (bay == 0, bay == count - 2);
            let bay = Bay { frame, from: places[bay], to: places[bay + 1], ends, long };
            if levels >= 1 {
                bay.architrave(yard);
            }
            if levels >= 2 {
                bay.frieze(yard, state);
            }
            if levels >= 3 {
                bay.geison(yard);
            }
        }
    }
}

/// The stretch between two columns.
struct Bay {
    frame: Frame,
    from: f32,
    to: f32,
    /// Whether the bay ends at a corner of the temple.
    ends: (bool, bool),
    long: bool,
}

impl Bay {
    /// The stretch of a layer whose face lies `face` before the axes: at corners the long sides run through.
    fn span(&self, face: f32) -> Span {
        let reach = if self.long { face } else { -FACE + 0.02 };
        (if self.ends.0 { self.from - reach } else { self.from }, if self.ends.1 { self.to + reach } else { self.to })
    }

    fn architrave(&self, yard: &mut Yard) {
        let s = self.span(FACE);
        // let into the abaci, whose tops follow the columns' lean
        let y = (COLUMN_TOP - 0.03, COLUMN_TOP + ARCHITRAVE_HEIGHT);
        let ends = FACE_LEFT | FACE_RIGHT;
        // inner and outer beam, set back to back; above columns their undersides lie on the abaci
        let look = yard.marble(0.15, 0.04);
        yard.ashlar(&self.frame, s, y, (0.0, FACE), FACE_BACK | FACE_TOP | ends, look);
        let look = yard.marble(0.5, 0.0);
        yard.ashlar(&self.frame, s, y, (-FACE, 0.004), FACE_FRONT | FACE_TOP | ends, look);
        let look = yard.marble(0.35, 0.04);
        let taenia = (y.1 - 0.115, y.1 + 0.004);
        let s = self.span(FACE + 0.06);
        yard.ashlar(&self.frame, s, taenia, (FACE - 0.1, FACE + 0.062), FACE_BACK | FACE_TOP, look);
    }

    /// Middles of the bay's triglyphs: one over each column and one between; the corner's stands at the corner.
    fn triglyphs(&self) -> [f32; 3] {
        let corner = FACE - 0.5 * TRIGLYPH_WIDTH;
        let left = if self.ends.0 { self.from - corner } else { self.from };
        let right = if self.ends.1 { self.to + corner } else { self.to };
        [left, 0.5 * (left + right), right]
    }

    fn frieze(&self, yard: &mut Yard, state: State) {
        let y = (FRIEZE_BOTTOM, GEISON_BOTTOM);
        let s = self.span(FACE - 0.25);
        let look = yard.marble(0.5, 0.0);
        yard.ashlar(&self.frame, s, y, (-FACE + 0.05, FACE - 0.27), FACE_TOP | FACE_BOTTOM, look);
        let middles = self.triglyphs();
        for (i, &middle) in middles.iter().enumerate() {
            // a bay makes its left and middle triglyph, and the last one of a side
            if i < 2 || self.ends.1 {
                self.triglyph(yard, middle);
            }
            self.regula(yard, middle, i == 2 && !self.ends.1);
        }
        for pair in middles.windows(2) {
            self.metope(yard, (pair[0] + 0.5 * TRIGLYPH_WIDTH, pair[1] - 0.5 * TRIGLYPH_WIDTH), state);
        }
    }

    fn triglyph(&self, yard: &mut Yard, middle: f32) {
        let look = yard.marble(0.4, 0.05);
        let w = TRIGLYPH_WIDTH;
        let cap = FRIEZE_HEIGHT - 0.17;
        let ends = (middle - 0.5 * w, middle + 0.5 * w);
        let bed = FACE - 0.34;
        let y = (FRIEZE_BOTTOM, FRIEZE_BOTTOM + FRIEZE_HEIGHT);
        let ground = FACE - 0.085;
        yard.ashlar(&self.frame, ends, y, (bed, ground), FACE_TOP | FACE_BOTTOM | FACE_BACK, look);
        // three upright bars with bevelled sides; between them and beside them the grooves
        for k in -1..=1 {
            let at = middle + k as f32 * w / 3.0;
            let (foot, face) = (0.145, 0.075);
            let corner = |i: usize| {
                let front = i & 4 != 0;
                let reach = if front { face } else { foot };
                let s = at + if i & 1 == 0 { -reach } else { reach };
                let h = if i & 2 == 0 { y.0 - 0.004 } else { FRIEZE_BOTTOM + cap + 0.02 };
                self.frame.point(s, h, if front { FACE + 0.002 } else { ground - 0.012 })
            };
            let wear = Wear::dressed(yard.erosion);
            let mut bar = Block::new(std::array::from_fn(corner), wear, look, FACE_TOP | FACE_BOTTOM | FACE_BACK);
            bar.seed = yard.seed();
            bar.ornament = true;
            yard.push_block(bar);
        }
        let y = (FRIEZE_BOTTOM + cap, FRIEZE_BOTTOM + FRIEZE_HEIGHT);
        let s = (ends.0 - 0.01, ends.1 + 0.01);
        yard.ashlar(&self.frame, s, y, (bed, FACE + 0.022), FACE_TOP | FACE_BACK, look);
    }

    fn metope(&self, yard: &mut Yard, s: Span, state: State) {
        let ruined = state == State::Ruined;
        let seed = yard.seed();
        let damage = if ruined { yard.range(0.05, 0.75) } else { 0.0 };
        // the flanks lost most of theirs to museums and powder: plain slabs, or holes
        let missing = ruined && yard.random() < 0.18;
        let look = yard.marble(0.55, 0.04);
        let y = (FRIEZE_BOTTOM, FRIEZE_BOTTOM + FRIEZE_HEIGHT - 0.12);
        let band = (y.1, FRIEZE_BOTTOM + FRIEZE_HEIGHT);
        let (back, face) = (FACE - 0.32, FACE - 0.135);
        let covered = FACE_BACK | FACE_TOP | FACE_BOTTOM | FACE_LEFT | FACE_RIGHT;
        if !missing {
            let half = Vec2::new(0.5 * (s.1 - s.0), 0.5 * (y.1 - y.0));
            let slab = yard.ashlar(&self.frame, s, y, (back, face), covered, look);
            slab.relief = Some(Box::new(Relief::metope(half, 0.17, damage, seed)));
        }
        yard.ashlar(&self.frame, s, band, (back, FACE - 0.06), FACE_BACK | FACE_TOP | FACE_LEFT | FACE_RIGHT, look);
    }

    /// The fillet below the taenia under a triglyph, with its six drops.
    fn regula(&self, yard: &mut Yard, middle: f32, skip: bool) {
        if skip {
            return;
        }
        let top = FRIEZE_BOTTOM - 0.113;
        let look = yard.marble(0.4, 0.04);
        let s = (middle - 0.5 * TRIGLYPH_WIDTH, middle + 0.5 * TRIGLYPH_WIDTH);
        yard.ashlar(&self.frame, s, (top - 0.085, top), (FACE - 0.05, FACE + 0.055), FACE_BACK | FACE_TOP, look).ornament =
            true;
        for k in 0..6 {
            let at = middle + (k as f32 - 2.5) * TRIGLYPH_WIDTH / 6.0;
            self.drop(yard, self.frame.point(at, top - 0.083, FACE + 0.012), Vec3::Y, look);
        }
    }

    /// A gutta that hangs from a point.
    fn drop(&self, yard: &mut Yard, top: Vec3, up: Vec3, look: Look) {
        let seed = yard.seed();
        if yard.merge > 1 || yard.random() < 0.25 * yard.erosion {
            return;
        }
        let x = self.frame.along;
        let knot = |y: f32, radius: f32| Knot { y, radius, flute: 0.0, joint: false };
        yard.push_tube(Tube {
            origin: top,
            axes: [x, up, x.cross(up)],
            knots: vec![knot(-0.055, 0.038), knot(0.035, 0.030)],
            sides: 6,
            fluted: false,
            wear: ShaftWear { arris: 0.0, spall: 0.0, rough: 0.002 * yard.erosion, shift: 0.0 },
            look,
            seed,
            coarser: 1.0,
            ornament: true,
            ends: [End::Dressed, End::Covered],
        });
    }

    fn geison(&self, yard: &mut Yard) {
        let out = FACE + GEISON_PROJECTION;
        let reach = if self.long { out } else { out - 0.015 };
        let s = (if self.ends.0 { self.from - reach } else { self.from }, if self.ends.1 { self.to + reach } else { self.to });
        let look = yard.marble(0.5, 0.03);
        let bed = self.span(FACE + 0.05);
        yard.ashlar(
            &self.frame,
            bed,
            (GEISON_BOTTOM - 0.012, GEISON_BOTTOM + 0.25),
            (-FACE + 0.1, FACE + 0.075),
            FACE_TOP | FACE_BOTTOM,
            look,
        );
        // the corona in stones as wide as a mutule and a gap; its soffit slopes as the roof does
        let count = 4_u32.div_ceil(yard.merge);
        for i in 0..count {
            let at = |i: u32| s.0 + (s.1 - s.0) * i as f32 / count as f32;
            let (left, right) = (at(i), at(i + 1));
            let look = yard.marble(0.25, 0.05);
            let hurt = yard.random() < 0.22 * yard.erosion;
            let wear = if hurt { Wear { breaks: 1, ..Wear::torn(yard.erosion) } } else { Wear::dressed(yard.erosion) };
            let proud = yard.range(-0.004, 0.004);
            let corner = |c: usize| {
                let front = c & 4 != 0;
                let s = if c & 1 == 0 { left - 0.004 } else { right + 0.004 };
                let o = if front { out + proud } else { -FACE + 0.02 };
                let soffit = 0.22 - ROOF_SLOPE * (o - FACE).max(-0.05);
                let h = if c & 2 == 0 { GEISON_BOTTOM + soffit } else { GEISON_BOTTOM + GEISON_HEIGHT };
                self.frame.point(s, h, o)
            };
            let mut stone = Block::new(std::array::from_fn(corner), wear, look, FACE_LEFT | FACE_RIGHT | FACE_BACK);
            stone.seed = yard.seed();
            yard.push_block(stone);
        }
        let middles = self.triglyphs();
        let first = middles[0];
        let last = middles[2];
        for k in 0..4 {
            self.mutule(yard, first + (last - first) * k as f32 / 4.0);
        }
        if self.ends.1 {
            self.mutule(yard, last);
        }
    }

    /// The slab with three rows of drops that hangs below the cornice over each triglyph and each metope.
    fn mutule(&self, yard: &mut Yard, middle: f32) {
        let look = yard.marble(0.6, 0.04);
        let half = 0.5 * TRIGLYPH_WIDTH;
        let (near, far) = (FACE + 0.08, FACE + GEISON_PROJECTION - 0.10);
        let soffit = |o: f32| GEISON_BOTTOM + 0.22 - ROOF_SLOPE * (o - FACE);
        let corner = |c: usize| {
            let s = middle + if c & 1 == 0 { -half } else { half };
            let o = if c & 4 == 0 { near } else { far };
            self.frame.point(s, soffit(o) + if c & 2 == 0 { -0.055 } else { 0.02 }, o)
        };
        let mut slab = Block::new(std::array::from_fn(corner), Wear::dressed(yard.erosion), look, FACE_TOP);
        slab.seed = yard.seed();
        slab.ornament = true;
        yard.push_block(slab);
        for row in 0..3 {
            let o = near + (far - near) * (row as f32 + 0.5) / 3.0;
            for k in 0..6 {
                let at = middle + (k as f32 - 2.5) * TRIGLYPH_WIDTH / 6.0;
                self.drop(yard, self.frame.point(at, soffit(o) - 0.053, o), Vec3::Y, look);
            }
        }
    }
}
