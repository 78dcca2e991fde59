//! Doric columns, whole and broken, and their drums.

use super::block::{Block, Wear};
use super::marble::Look;
use super::measures::{ABACUS_HEIGHT, ABACUS_WIDTH, COLUMN_HEIGHT, COLUMN_UPPER_DIAMETER, ENTASIS, FLUTES};
use super::tube::{End, Knot, ShaftWear, Tube};
use super::yard::Yard;
use glam::Vec3;

/// How far shafts are let into what they stand on, metres.
const FOOT: f32 = 0.05;

/// A column's measures and place.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Middle of its foot.
    pub foot: Vec3,
    /// How far its top leans from the vertical.
    pub lean: Vec3,
    /// Diameters over the arrises.
    pub lower_diameter: f32,
    /// Diameter under the capital.
    pub upper_diameter: f32,
    /// Height with the capital.
    pub height: f32,
    /// The part of it that stands; 1 with the capital.
    pub standing: f32,
    /// Multiplies the length of the cut.
    pub coarser: f32,
}

/// Radius of a shaft at the part `t` of its height, with entasis (Penrose: a conic that lies 17 mm beyond the straight taper
/// at the middle; a parabola differs by less than a millimetre).
pub fn shaft_radius(lower: f32, upper: f32, height: f32, t: f32) -> f32 {
    let swelling = ENTASIS * height / COLUMN_HEIGHT;
    0.5 * (lower + (upper - lower) * t) + 4.0 * swelling * t * (1.0 - t)
}

impl Column {
    /// Height of the shaft below its capital.
    pub fn shaft_height(&self) -> f32 {
        self.height - 0.86 * self.height / COLUMN_HEIGHT
    }

    /// The unit direction of the axis, upwards.
    fn axis(&self) -> Vec3 {
        let up = Vec3::Y * self.height + self.lean;
        up / up.length()
    }

    fn axes(&self) -> [Vec3; 3] {
        let up = self.axis();
        let x = Vec3::X - up * up.x;
        let x = x / x.length();
        [x, up, x.cross(up)]
    }

    /// Adds the column's stones.
    pub fn build(&self, yard: &mut Yard, look: Look) {
        let seed = yard.seed();
        let whole = self.standing >= 1.0;
        let shaft = self.shaft_height();
        let top = if whole { shaft } else { shaft * self.standing };
        // a course of drums, about as high as half their diameter, none like the next
        let drums = ((11.0 / yard.merge.max(1) as f32) * shaft / (COLUMN_HEIGHT - 0.86)).round().max(1.0) as usize;
        let knot = |y: f32, joint: bool| Knot {
            y,
            radius: shaft_radius(self.lower_diameter, self.upper_diameter, shaft, (y / shaft).clamp(0.0, 1.0)),
            flute: 1.0,
            joint,
        };
        let mut knots = vec![knot(-FOOT, false)];
        let mut edges: Vec<f32> = (1..drums).map(|i| (i as f32 + yard.range(-0.16, 0.16)) / drums as f32 * shaft).collect();
        edges.retain(|&y| y < top - 0.25);
        let jointed = yard.merge <= 1;
        knots.extend(edges.into_iter().map(|y| knot(y, jointed)));
        let unit = self.height / COLUMN_HEIGHT;
        let echinus = self.upper_diameter / COLUMN_UPPER_DIAMETER;
        if whole {
            knots.push(knot(shaft, jointed));
            let r = 0.5 * self.upper_diameter;
            // neck, annulets, echinus: a straight flare that turns in quickly under the abacus
            let below = self.height - ABACUS_HEIGHT * unit;
            let profile: &[(f32, f32, f32)] = if yard.merge <= 2 {
                &[
                    (-0.372, 0.002, 1.0),
                    (-0.350, 0.016, 0.0),
                    (-0.290, 0.050, 0.0),
                    (-0.180, 0.140, 0.0),
                    (-0.085, 0.217, 0.0),
                    (-0.030, 0.250, 0.0),
                    (0.030, 0.240, 0.0),
                ]
            } else {
                &[(-0.350, 0.016, 0.0), (-0.085, 0.217, 0.0), (0.030, 0.240, 0.0)]
            };
            knots.extend(profile.iter().map(|&(y, out, flute)| Knot {
                y: below + y * unit,
                radius: r + out * echinus,
                flute,
                joint: false,
            }));
        } else {
            knots.push(knot(top, false));
        }
        let axes = self.axes();
        yard.push_tube(Tube {
            origin: self.foot,
            axes,
            knots,
            sides: FLUTES,
            fluted: true,
            wear: ShaftWear::standing(yard.erosion),
            look,
            seed,
            coarser: self.coarser,
            ornament: false,
            ends: [End::Covered, if whole { End::Covered } else { End::Broken }],
        });
        if whole {
            self.abacus(yard, look, axes, ABACUS_HEIGHT * unit, ABACUS_WIDTH * echinus);
        }
    }

    fn abacus(&self, yard: &mut Yard, look: Look, axes: [Vec3; 3], height: f32, width: f32) {
        let mut wear = Wear::dressed(yard.erosion);
        wear.chip *= 1.6;
        let centre = self.foot + axes[1] * (self.height - 0.5 * height);
        let half = Vec3::new(0.5 * width, 0.5 * height + 0.002, 0.5 * width);
        let mut abacus = Block::oriented(centre, axes, half, wear, look, super::block::FACE_TOP);
        abacus.seed = yard.seed();
        abacus.coarser = self.coarser;
        yard.push_block(abacus);
    }
}

/// A drum that lies about: its middle, its axes (the second one its own), its diameter and height.
pub fn fallen_drum(yard: &mut Yard, middle: Vec3, axes: [Vec3; 3], diameter: f32, height: f32, look: Look) {
    let seed = yard.seed();
    let knot = |y: f32, r: f32| Knot { y, radius: 0.5 * r * diameter, flute: 1.0, joint: false };
    yard.push_tube(Tube {
        origin: middle,
        axes,
        knots: vec![
            knot(-0.5 * height, 0.975),
            knot(-0.45 * height, 1.0),
            knot(0.45 * height, 0.985),
            knot(0.5 * height, 0.955),
        ],
        sides: FLUTES,
        fluted: true,
        wear: ShaftWear::fallen(yard.erosion),
        look,
        seed,
        coarser: 1.0,
        ornament: false,
        ends: [End::Dressed, End::Dressed],
    });
}
