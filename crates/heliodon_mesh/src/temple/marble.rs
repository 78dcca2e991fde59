//! Albedo of the stones: weathered Pentelic marble, the marble of restorations, the limestone of the rock.
//!
//! Levels are those of measured surfaces: fresh Pentelic marble reflects about 0.7 to 0.75 of the light, the weathered one
//! of the monument 0.5 to 0.6 with a warm patina of iron oxides where sun and rain reach it, dark gypsum crusts where rain
//! does not (Skoulikidis and others on the Acropolis; the film "The Parthenon" found 0.4 to 0.6 by inverse rendering).

use super::noise::{fbm, gradient, ridged, smoothstep};
use glam::Vec3;
use heliodon_math::random::{hash2_u32, unit_f32};

/// What a stone is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stone {
    /// Pentelic marble, two and a half thousand years old.
    Marble,
    /// The same, new: a restorer's fill.
    NewMarble,
    /// Grey limestone of the rock.
    Rock,
}

/// How a stone looks.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// What it is made of.
    pub stone: Stone,
    /// Tells stones apart: tone, hue, direction of the veins.
    pub seed: u32,
    /// 0 in the open, 1 below a cornice where rain never washes: crusts and streaks.
    pub shelter: f32,
    /// 0 clean and new, 1 fully weathered.
    pub age: f32,
}

/// The seeds of the fields that run through all stones, so that stains cross joints.
const PATINA: u32 = 101;
const STREAKS: u32 = 202;
const GRAIN: u32 = 303;
const LICHEN: u32 = 404;

impl Look {
    /// Linear Rec. 709 albedo at a world position with a normal, where `lost` metres of the stone have weathered away.
    pub fn albedo(&self, p: Vec3, n: Vec3, lost: f32) -> Vec3 {
        match self.stone {
            Stone::Rock => self.rock(p, n),
            Stone::Marble | Stone::NewMarble => self.marble(p, n, lost),
        }
    }

    fn random(&self, k: u32) -> f32 {
        unit_f32(hash2_u32(self.seed, k))
    }

    fn marble(&self, p: Vec3, n: Vec3, lost: f32) -> Vec3 {
        let new = self.stone == Stone::NewMarble;
        let age = if new { self.age * 0.25 } else { self.age };
        // the quarry: each stone has its own white
        let tone = 1.0 + (if new { 0.05 } else { 0.17 }) * (self.random(1) - 0.5);
        let warm = self.random(2);
        let mut albedo = Vec3::new(0.665, 0.630, 0.565).lerp(Vec3::new(0.650, 0.595, 0.500), warm) * tone;
        if new {
            albedo = Vec3::new(0.715, 0.700, 0.665) * tone;
        }

        // veins of mica and chlorite: thin grey-green sheets, bedded along one plane a stone
        let tilt = self.random(3) * 0.9 - 0.45;
        let bed = Vec3::new(p.x * 0.55 + p.y * tilt, p.y * 1.9 - p.x * tilt * 0.7, p.z * 0.55 + p.y * 0.3);
        let vein = smoothstep(0.80, 0.985, ridged(self.seed, bed, 3)) * smoothstep(0.25, 0.8, self.random(4));
        albedo = albedo.lerp(Vec3::new(0.44, 0.44, 0.40), vein * 0.55);

        // golden-brown patina where rain and sun reach: south and west most, in clouds that run across the joints
        let exposed = 0.55 + 0.35 * n.z - 0.25 * n.x + 0.1 * n.y;
        let cloud = 0.5 + 0.75 * fbm(PATINA, p * 0.23, 3) + 0.35 * fbm(PATINA + 1, p * 1.15, 2);
        let patina = smoothstep(0.18, 0.95, cloud * (0.55 + 0.75 * exposed)) * age;
        albedo *= Vec3::ONE.lerp(Vec3::new(0.90, 0.755, 0.545), patina * 0.80);

        // dark crust: streaks that hang from overhangs, soot on undersides, a veil in shelter
        let hang = Vec3::new(p.x * 1.9, p.y * 0.20, p.z * 1.9);
        let streak = smoothstep(0.12, 0.62, fbm(STREAKS, hang, 3) + 0.35 * self.shelter - 0.12);
        let under = smoothstep(0.15, -0.65, n.y);
        let crust = (streak * (0.22 + 0.55 * self.shelter) + under * (0.25 + 0.45 * self.shelter)).min(0.88) * age;
        albedo = albedo.lerp(Vec3::new(0.175, 0.160, 0.142), crust * 0.72);

        // dust, lichen and rain-wash on tops
        let top = smoothstep(0.55, 0.95, n.y);
        let lichen = smoothstep(0.0, 0.5, fbm(LICHEN, p * 1.7, 3));
        albedo = albedo.lerp(Vec3::new(0.42, 0.385, 0.31), top * age * (0.25 + 0.40 * lichen));

        // where the surface broke away the stone is pale again, and rough: tiny shadows dull it a little
        let broken = smoothstep(0.015, 0.07, lost);
        albedo = albedo.lerp(Vec3::new(0.61, 0.575, 0.515) * tone, broken * 0.55);

        // crystals and pits
        let grain = 1.0 + 0.055 * gradient(GRAIN, p * 9.0) + 0.05 * fbm(GRAIN + 7, p * 3.1, 2);
        (albedo * grain).clamp(Vec3::splat(0.04), Vec3::splat(0.80))
    }

    fn rock(&self, p: Vec3, n: Vec3) -> Vec3 {
        let tone = 1.0 + 0.22 * (self.random(1) - 0.5);
        rock_albedo(p, n, self.random(2)) * tone
    }
}

/// The limestone of the Acropolis: grey-blue with reddish and pale parts, darker in cracks.
pub fn rock_albedo(p: Vec3, n: Vec3, warm: f32) -> Vec3 {
    let clouds = fbm(511, p * 0.31, 3);
    let fine = fbm(512, p * 2.3, 3);
    let mut albedo = Vec3::new(0.345, 0.330, 0.305).lerp(Vec3::new(0.395, 0.345, 0.280), warm * 0.7 + 0.3 * clouds);
    albedo *= 1.0 + 0.22 * clouds + 0.16 * fine;
    // calcite runs pale, cracks hold dark earth
    let calcite = smoothstep(0.90, 0.99, ridged(513, p * 0.8, 2));
    albedo = albedo.lerp(Vec3::new(0.50, 0.475, 0.43), calcite * 0.5);
    let crack = smoothstep(0.86, 0.97, ridged(514, p * Vec3::new(1.1, 0.5, 1.1), 2));
    albedo = albedo.lerp(Vec3::new(0.17, 0.145, 0.115), crack * 0.45);
    let steep = smoothstep(0.85, 0.4, n.y);
    albedo *= 1.0 - 0.15 * steep;
    albedo.clamp(Vec3::splat(0.04), Vec3::splat(0.6))
}
