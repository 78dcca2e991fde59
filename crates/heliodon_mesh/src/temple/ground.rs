//! The rock on which the temple stands: a height and a colour over the plan.

use super::marble::rock_albedo;
use super::measures::{STYLOBATE_LENGTH, STYLOBATE_WIDTH};
use super::noise::{Cell, cell, fbm, gradient, ridged, smoothstep};
use glam::Vec3;
use heliodon_math::frame::unit_or;

/// The ground of a site.
#[derive(Debug)]
pub struct Ground {
    seed: u32,
    /// Where the visitor stands: the rock is even there.
    stand: Vec3,
}

impl Ground {
    /// The ground for a seed, level where the visitor stands.
    pub fn new(seed: u32, stand: Vec3) -> Self {
        Self { seed, stand: Vec3::new(stand.x, 0.0, stand.z) }
    }

    /// Height at a place of the plan.
    pub fn height(&self, x: f32, z: f32) -> f32 {
        let p = Vec3::new(x, 0.0, z);
        let beyond = beyond_steps(x, z);
        // the rock falls away from the temple, most to the west, as it does towards the gate of the Acropolis
        let west = smoothstep(10.0, -40.0, x);
        let fall = -(0.016 + 0.016 * west) * beyond.min(95.0) * smoothstep(0.0, 14.0, beyond);
        let broad = 0.50 * fbm(self.seed, p * 0.042, 3);
        let near = smoothstep(280.0, 130.0, p.length());
        let wild = if near > 0.0 { near * self.surface(p, broad) } else { 0.0 };
        // calm under the visitor, calm along the euthynteria, hidden below the temple
        let stand = smoothstep(1.5, 5.5, (p - self.stand).length());
        let foot = smoothstep(0.3, 5.0, beyond);
        let mut height = fall + wild * (0.25 + 0.75 * stand) * (0.18 + 0.82 * foot) - 0.17 + 0.05 * foot;
        if beyond < 0.5 {
            height = height.min(-0.12) + (-0.45 - height.min(-0.12)) * smoothstep(0.3, -1.2, beyond);
        }
        height + self.far(p)
    }

    /// The point of the ground at a place of the plan.
    pub fn point(&self, x: f32, z: f32) -> Vec3 {
        Vec3::new(x, self.height(x, z), z)
    }

    /// Rock and earth over the fall of the land.
    fn surface(&self, p: Vec3, broad: f32) -> f32 {
        let bare = self.bareness(p);
        // beds of limestone: ledges with worn edges
        let tilt = 0.5 * fbm(self.seed + 1, p * 0.10, 3) + 0.012 * p.x - 0.02 * p.z;
        let bed = tilt * 2.4;
        let ledge = (bed.floor() + smoothstep(0.45, 0.95, bed - bed.floor())) / 2.4;
        // fractured into slabs, each settled its own way
        let (slab, piece) = (self.slab(p), self.piece(p));
        let settle = |c: &Cell, scale: f32| {
            let signed = |bits: u32| (bits & 0xFF) as f32 / 127.5 - 1.0;
            let lean = Vec3::new(signed(c.id >> 8), 0.0, signed(c.id >> 16)).dot(c.offset);
            scale * (signed(c.id) + lean)
        };
        let open = smoothstep(-0.25, 0.30, fbm(self.seed + 42, p * 0.37, 2));
        let slabs = settle(&slab, 0.12) * smoothstep(0.0, 0.16, slab.border) - 0.11 * open * smoothstep(0.10, 0.0, slab.border);
        let pieces =
            settle(&piece, 0.024) * smoothstep(0.0, 0.14, piece.border) - 0.03 * open * smoothstep(0.08, 0.0, piece.border);
        let worn = 0.075 * fbm(self.seed + 2, p * 0.7, 3) + 0.032 * fbm(self.seed + 3, p * 2.9, 3);
        let rock = broad + 0.60 * (ledge - tilt * 0.75) + slabs + pieces + worn;
        let stones = self.stones(p);
        let earth = broad * 0.85 + 0.03 * fbm(self.seed + 6, p * 1.3, 3) - 0.05 + 0.6 * stones.0;
        earth + (rock - earth) * bare
    }

    /// The large fractures of the rock.
    fn slab(&self, p: Vec3) -> Cell {
        let warp = Vec3::new(gradient(self.seed + 31, p * 0.33), 0.0, gradient(self.seed + 32, p * 0.33));
        cell(self.seed + 4, p * 0.36 + warp * 0.35)
    }

    /// The small fractures of the rock.
    fn piece(&self, p: Vec3) -> Cell {
        let warp = Vec3::new(gradient(self.seed + 33, p * 1.1), 0.0, gradient(self.seed + 34, p * 1.1));
        cell(self.seed + 35, p * 1.25 + warp * 0.4)
    }

    /// Height of the pebbles that lie in the earth, metres, and a number in [0, 1) of the pebble there.
    fn stones(&self, p: Vec3) -> (f32, f32) {
        let pebble = cell(self.seed + 36, p * 7.5);
        let random = (pebble.id >> 20) as f32 / 4096.0;
        // few of the cells hold one, more where others lie
        let crowd = 0.22 + 0.5 * fbm(self.seed + 37, p * 0.45, 2);
        let size = smoothstep(crowd, crowd - 0.15, random) * (0.25 + 0.75 * ((pebble.id >> 8) & 0xFF) as f32 / 255.0);
        let dome = smoothstep(0.42 * size, 0.12 * size, pebble.offset.length());
        (0.055 * size * dome, random)
    }

    /// Plain and hills beyond the rock.
    fn far(&self, p: Vec3) -> f32 {
        let distance = p.length();
        let rim = smoothstep(150.0, 260.0, distance + 25.0 * fbm(self.seed + 8, p * 0.012, 2));
        let hills = smoothstep(330.0, 860.0, distance);
        let shape = 0.55 + 0.6 * fbm(self.seed + 9, p * 0.0045, 3);
        -9.0 * rim + 58.0 * hills * shape
    }

    /// 1 where the rock lies bare, 0 where earth covers it.
    fn bareness(&self, p: Vec3) -> f32 {
        smoothstep(-0.30, -0.02, fbm(self.seed + 5, p * 0.085, 3) + 0.30 * fbm(self.seed + 7, p * 0.6, 2))
    }

    /// How a stone of the given radius comes to lie at a place: the lowest height of the ground below it, and the unit normal of
    /// the ground about it.
    pub fn seat(&self, x: f32, z: f32, radius: f32) -> (f32, Vec3) {
        let around = [(radius, 0.0), (-radius, 0.0), (0.0, radius), (0.0, -radius)].map(|(dx, dz)| self.height(x + dx, z + dz));
        let normal = unit_or(Vec3::new(around[1] - around[0], 2.0 * radius, around[3] - around[2]), Vec3::Y);
        let level = [(around[0] + around[1]) * 0.5, (around[2] + around[3]) * 0.5, self.height(x, z)];
        (level.into_iter().fold(f32::MAX, f32::min), normal)
    }

    /// Linear Rec. 709 albedo at a point of the ground.
    pub fn albedo(&self, p: Vec3, n: Vec3) -> Vec3 {
        let plan = Vec3::new(p.x, 0.0, p.z);
        let far = smoothstep(170.0, 330.0, plan.length());
        let near = if far < 1.0 { self.near_albedo(p, plan, n) } else { Vec3::ZERO };
        // shrubs and dry slopes far off
        let slopes = Vec3::new(0.135, 0.140, 0.095)
            .lerp(Vec3::new(0.270, 0.240, 0.185), smoothstep(-0.25, 0.35, fbm(self.seed + 29, plan * 0.018, 4)));
        near.lerp(slopes, far).clamp(Vec3::splat(0.03), Vec3::splat(0.6))
    }

    fn near_albedo(&self, p: Vec3, plan: Vec3, n: Vec3) -> Vec3 {
        let (slab, piece) = (self.slab(plan), self.piece(plan));
        let tone = 1.0
            + 0.14 * (((slab.id >> 4) & 0xFF) as f32 / 127.5 - 1.0)
            + 0.08 * (((piece.id >> 4) & 0xFF) as f32 / 127.5 - 1.0);
        let mut rock = rock_albedo(p, n, 0.5 + 0.5 * gradient(self.seed + 21, plan * 0.09)) * tone;
        // lichens darken what nobody treads on
        let lichen = smoothstep(0.05, 0.42, fbm(self.seed + 38, plan * 2.6, 3))
            * smoothstep(-0.2, 0.3, fbm(self.seed + 39, plan * 0.3, 2));
        rock = rock.lerp(Vec3::new(0.175, 0.170, 0.155), 0.5 * lichen);
        // earth, trodden pale, and the dry grass of summer in it
        let trodden = smoothstep(-0.3, 0.5, fbm(self.seed + 22, plan * 0.16, 3));
        let mut soil = Vec3::new(0.225, 0.175, 0.120).lerp(Vec3::new(0.370, 0.315, 0.240), trodden);
        soil *= 1.0 + 0.20 * fbm(self.seed + 26, plan * 4.3, 3) + 0.16 * gradient(self.seed + 40, plan * 19.0);
        let (height, random) = self.stones(plan);
        let stone = Vec3::new(0.30, 0.28, 0.25).lerp(Vec3::new(0.52, 0.49, 0.44), smoothstep(0.0, 0.35, random));
        soil = soil.lerp(stone, smoothstep(0.004, 0.014, height));
        let tufts = smoothstep(0.02, 0.34, fbm(self.seed + 23, plan * 2.3, 3) + 0.55 * fbm(self.seed + 24, plan * 0.17, 2));
        let blades = 0.75 + 0.45 * gradient(self.seed + 41, plan * 13.0);
        let dry = Vec3::new(0.345, 0.290, 0.150)
            .lerp(Vec3::new(0.165, 0.175, 0.075), smoothstep(-0.1, 0.5, gradient(self.seed + 25, plan * 0.31)));
        soil = soil.lerp(dry * blades, 0.80 * tufts);
        // earth fills the cracks, and lies where rock does not come out
        let open = smoothstep(-0.25, 0.30, fbm(self.seed + 42, plan * 0.37, 2));
        let crack = open * smoothstep(0.11, 0.03, slab.border).max(0.8 * smoothstep(0.08, 0.02, piece.border));
        let bare = self.bareness(plan) * (1.0 - 0.9 * crack);
        let bare = smoothstep(0.25, 0.70, bare + 0.30 * fbm(self.seed + 27, plan * 1.4, 3));
        // chips of marble from two thousand years of masons lie about the temple
        let chips =
            smoothstep(0.80, 0.97, ridged(self.seed + 28, plan * 2.2, 2)) * smoothstep(30.0, 2.0, beyond_steps(p.x, p.z));
        soil.lerp(rock, bare).lerp(Vec3::new(0.50, 0.47, 0.41), 0.35 * chips)
    }
}

/// Metres outside the lowest step; negative within.
pub fn beyond_steps(x: f32, z: f32) -> f32 {
    let dx = x.abs() - (0.5 * STYLOBATE_LENGTH + 1.63);
    let dz = z.abs() - (0.5 * STYLOBATE_WIDTH + 1.63);
    let outside = Vec3::new(dx.max(0.0), 0.0, dz.max(0.0)).length();
    outside + dx.max(dz).min(0.0)
}
