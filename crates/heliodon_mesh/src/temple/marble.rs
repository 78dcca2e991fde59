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
        let tone = 1.0 + (if new { 0.05 } else { 0.20 }) * (self.random(1) - 0.5);
        let warm = self.random(2);
        let mut albedo = Vec3::new(0.655, 0.622, 0.560).lerp(Vec3::new(0.640, 0.575, 0.475), warm) * tone;
        if new {
            albedo = Vec3::new(0.720, 0.705, 0.670) * tone;
        }

        // veins of mica and chlorite: thin grey-green sheets, bedded along one plane a stone
        let tilt = self.random(3) * 0.9 - 0.45;
        let bed = Vec3::new(p.x * 0.55 + p.y * tilt, p.y * 1.9 - p.x * tilt * 0.7, p.z * 0.55 + p.y * 0.3);
        let vein = smoothstep(0.80, 0.985, ridged(self.seed, bed, 3)) * smoothstep(0.25, 0.8, self.random(4));
        albedo = albedo.lerp(Vec3::new(0.42, 0.42, 0.385), vein * 0.6);

        // golden-brown patina where rain and sun reach: south and west most, in clouds that run across the joints
        let exposed = 0.55 + 0.35 * n.z - 0.25 * n.x + 0.1 * n.y;
        let cloud = 0.5 + 0.85 * fbm(PATINA, p * 0.21, 3) + 0.45 * fbm(PATINA + 1, p * 1.15, 3) + 0.25 * (self.random(5) - 0.5);
        let patina = smoothstep(0.12, 0.95, cloud * (0.55 + 0.75 * exposed)) * age;
        albedo *= Vec3::ONE.lerp(Vec3::new(0.86, 0.665, 0.440), patina * 0.85);

        // dark crust: streaks that hang from overhangs, soot on undersides, a veil in shelter
        let hang = Vec3::new(p.x * 2.1, p.y * 0.22, p.z * 2.1);
        let streak = smoothstep(0.02, 0.50, fbm(STREAKS, hang, 4) + 0.35 * self.shelter - 0.10);
        let veil = smoothstep(-0.1, 0.6, fbm(STREAKS + 9, p * 0.33, 3) + 0.25 * self.shelter);
        let under = smoothstep(0.15, -0.65, n.y);
        let crust =
            streak * (0.25 + 0.55 * self.shelter) + veil * (0.10 + 0.22 * self.shelter) + under * (0.22 + 0.40 * self.shelter);
        albedo = albedo.lerp(Vec3::new(0.165, 0.148, 0.130), crust.min(0.85) * age * 0.78);

        // dust, lichen and rain-wash on tops
        let top = smoothstep(0.55, 0.95, n.y);
        let lichen = smoothstep(0.0, 0.5, fbm(LICHEN, p * 1.7, 3));
        albedo = albedo.lerp(Vec3::new(0.40, 0.365, 0.29), top * age * (0.25 + 0.45 * lichen));
        // orange and grey lichens in spots on all that is old
        let spots = smoothstep(0.32, 0.55, fbm(LICHEN + 3, p * 3.3, 2)) * smoothstep(-0.1, 0.35, fbm(LICHEN + 5, p * 0.4, 2));
        albedo = albedo.lerp(Vec3::new(0.33, 0.29, 0.22), spots * 0.45 * age);

        // where the surface broke away the stone is pale again, and rough: tiny shadows dull it a little
        let broken = smoothstep(0.012, 0.06, lost);
        albedo = albedo.lerp(Vec3::new(0.635, 0.60, 0.54) * tone, broken * 0.65);

        // crystals and pits
        let grain = 1.0 + 0.07 * gradient(GRAIN, p * 9.0) + 0.07 * fbm(GRAIN + 7, p * 3.1, 2);
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
