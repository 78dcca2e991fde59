//! Carved figures in relief: what is left of centaurs, riders and gods on metopes and friezes.

use super::noise::{fbm, smoothstep};
use glam::Vec2;
use glam::Vec3;
use heliodon_math::random::Pcg32;

/// A limb: a capsule in the panel's plane that swells out of it.
#[derive(Clone, Copy, Debug)]
struct Limb {
    from: Vec2,
    to: Vec2,
    radius_from: f32,
    radius_to: f32,
}

/// Figures on a panel, as a height over it.
#[derive(Clone, Debug)]
pub struct Relief {
    limbs: Vec<Limb>,
    half: Vec2,
    depth: f32,
    seed: u32,
    damage: f32,
}

impl Relief {
    /// Two wrestling figures, or what the hammers left of them, on a panel of the given half size (metres).
    pub fn metope(half: Vec2, depth: f32, damage: f32, seed: u32) -> Self {
        let mut rng = Pcg32::new(u64::from(seed), 0x3E10);
        let mut limbs = Vec::new();
        let centaur = rng.next_f32() < 0.6;
        Self::person(&mut limbs, &mut rng, -0.42 * half.x, half, 1.0);
        if centaur {
            Self::horse(&mut limbs, &mut rng, 0.30 * half.x, half, -1.0);
        } else {
            Self::person(&mut limbs, &mut rng, 0.42 * half.x, half, -1.0);
        }
        Self { limbs, half, depth, seed, damage }
    }

    /// A procession: riders and walkers along a low, long panel.
    pub fn procession(half: Vec2, depth: f32, damage: f32, seed: u32) -> Self {
        let mut rng = Pcg32::new(u64::from(seed), 0xF12E);
        let mut limbs = Vec::new();
        let mut x = -half.x + 0.45 * half.y;
        while x < half.x - 0.4 * half.y {
            if rng.next_f32() < 0.55 {
                Self::horse(&mut limbs, &mut rng, x + 0.5 * half.y, half, 1.0);
                x += half.y * rng.range_f32(1.15, 1.5);
            } else {
                Self::person(&mut limbs, &mut rng, x, half, 1.0);
                x += half.y * rng.range_f32(0.6, 0.8);
            }
        }
        Self { limbs, half, depth, seed, damage }
    }

    /// A standing or striding person that fills the panel's height; `facing` is the sign of x.
    fn person(limbs: &mut Vec<Limb>, rng: &mut Pcg32, x: f32, half: Vec2, facing: f32) {
        let h = half.y;
        let at = |x: f32, y: f32| Vec2::new(x, y);
        let sway = rng.range_f32(-0.10, 0.16) * h * facing;
        let pelvis = at(x, rng.range_f32(-0.10, 0.0) * h);
        let neck = at(x + sway, 0.52 * h);
        let stride = rng.range_f32(0.16, 0.42) * h;
        let mut limb = |from: Vec2, to: Vec2, radius_from: f32, radius_to: f32| {
            limbs.push(Limb { from, to, radius_from: radius_from * h, radius_to: radius_to * h });
        };
        limb(pelvis, neck, 0.17, 0.20);
        let head = neck + at(0.05 * h * facing, 0.20 * h);
        limb(head, head + at(0.0, 0.03 * h), 0.115, 0.105);
        for side in [-1.0, 1.0] {
            let knee = pelvis + at(side * stride * 0.55 + 0.06 * h * facing, -0.42 * h);
            let foot = at(knee.x + side * stride * 0.35 - 0.04 * h * facing, -0.93 * h);
            limb(pelvis, knee, 0.125, 0.09);
            limb(knee, foot, 0.085, 0.055);
            let reach = rng.range_f32(-0.5, 0.75);
            let elbow = neck + at(side * 0.24 * h, (-0.22 + 0.25 * reach) * h);
            let hand = elbow + at((0.22 * facing + 0.05 * side) * h, (0.28 * reach - 0.06) * h);
            limb(neck - at(0.0, 0.07 * h), elbow, 0.075, 0.06);
            limb(elbow, hand, 0.055, 0.04);
        }
    }

    /// A horse, or a centaur's body with a rider's trunk.
    fn horse(limbs: &mut Vec<Limb>, rng: &mut Pcg32, x: f32, half: Vec2, facing: f32) {
        let h = half.y;
        let at = |dx: f32, y: f32| Vec2::new(x + dx * h * facing, y * h);
        let mut limb = |from: Vec2, to: Vec2, radius_from: f32, radius_to: f32| {
            limbs.push(Limb { from, to, radius_from: radius_from * h, radius_to: radius_to * h });
        };
        let rear = rng.range_f32(-0.05, 0.12);
        limb(at(-0.42, -0.12), at(0.30, rear), 0.22, 0.21);
        limb(at(0.30, rear), at(0.42, 0.45 + rear), 0.17, 0.15);
        let head = at(0.50, 0.66 + rear);
        limb(head, head + Vec2::new(0.03 * h * facing, 0.03 * h), 0.115, 0.10);
        for (hip, reach) in [(-0.44, -0.10), (-0.34, 0.10), (0.26, 0.28), (0.36, 0.05)] {
            let bend = rng.range_f32(-0.05, 0.12);
            let knee = at(hip + reach * 0.7 + bend, -0.52);
            limb(at(hip, -0.15), knee, 0.10, 0.065);
            limb(knee, at(hip + reach * 0.4 - bend, -0.94), 0.06, 0.045);
        }
        limb(at(-0.55, -0.02), at(-0.72, -0.5), 0.055, 0.03);
        limb(at(-0.05, 0.1), at(-0.02, 0.55), 0.13, 0.12);
    }

    /// Height over the panel's plane in metres, never below it, at a point of the panel; zero along its rim.
    pub fn height(&self, x: f32, y: f32) -> f32 {
        let p = Vec2::new(x, y);
        let ripple = 0.018 * fbm(self.seed, Vec3::new(x * 5.0, y * 5.0, 0.5), 2);
        let mut height = 0.0_f32;
        for limb in &self.limbs {
            let along = limb.to - limb.from;
            let t = ((p - limb.from).dot(along) / along.length_squared().max(1e-9)).clamp(0.0, 1.0);
            let radius = limb.radius_from + (limb.radius_to - limb.radius_from) * t;
            let distance = (p - limb.from - along * t).length() + ripple;
            let bulge = (1.0 - (distance / radius) * (distance / radius)).max(0.0).sqrt() * radius;
            // a smooth union, so that limbs grow from bodies
            let k = 0.03;
            let blend = (0.5 + 0.5 * (bulge - height) / k).clamp(0.0, 1.0);
            height = height + (bulge - height) * blend + k * blend * (1.0 - blend) * if bulge > 0.0 { 1.0 } else { 0.0 };
        }
        let lost = smoothstep(0.05, 0.45, fbm(self.seed + 5, Vec3::new(x * 1.4, y * 1.4, 3.0), 3) + 1.3 * self.damage - 0.65);
        let kept = 1.0 - 0.88 * lost;
        let rim = smoothstep(0.0, 0.08, self.half.x - x.abs()) * smoothstep(0.0, 0.08, self.half.y - y.abs());
        (height * self.depth / (0.2 * self.half.y) * kept).clamp(0.0, self.depth * 1.4) * rim
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_stand_out_inside_and_never_on_the_rim() {
        let half = Vec2::new(0.62, 0.66);
        let mut carved = 0;
        for seed in 0..8 {
            let relief = Relief::metope(half, 0.2, 0.2, seed);
            for i in 0..=20 {
                let t = i as f32 / 10.0 - 1.0;
                for (x, y) in [(half.x, t * half.y), (-half.x, t * half.y), (t * half.x, half.y), (t * half.x, -half.y)] {
                    assert_eq!(relief.height(x, y), 0.0);
                }
                for j in 1..20 {
                    let h = relief.height(t * half.x, (j as f32 / 10.0 - 1.0) * half.y);
                    assert!((0.0..=0.281).contains(&h));
                    carved += usize::from(h > 0.06);
                }
            }
        }
        assert!(carved > 500, "{carved} of 3192 samples are carved");
    }
}
