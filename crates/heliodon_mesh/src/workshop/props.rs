//! Furniture, tools and wares, each in a space of its own: height zero is what it stands on.

use super::measures::BITE;
use super::palette::{Material, Palette};
use super::pieces::{beam, cuboid, cuboid_at, hexahedron, lathe, placed, pole, smooth};
use super::statue;
use crate::figures::shape::{ball, pleated, sweep};
use crate::temple::solid::SolidMesh;
use glam::Vec3;
use std::f32::consts::TAU;

/// Height of a work bench.
pub const BENCH_HEIGHT: f32 = 0.86;
/// From a lamp's foot to its flame.
pub const FLAME_HEIGHT: f32 = 1.72;

/// A bench along X with a top of planks.
pub fn bench(length: f32, depth: f32, palette: &mut Palette) -> Vec<SolidMesh> {
    let mut solids = Vec::new();
    let (half, planks) = (0.5 * length, 3);
    for k in 0..planks {
        let z = depth * (k as f32 / planks as f32 - 0.5);
        let top = BENCH_HEIGHT - 0.002 * k as f32;
        let high = Vec3::new(half, top, z + depth / planks as f32 - 0.008);
        solids.push(cuboid(Vec3::new(-half, BENCH_HEIGHT - 0.07, z), high, palette.pick(Material::Plank)));
    }
    for x in [-half + 0.25, half - 0.25] {
        let wood = palette.pick(Material::Timber);
        let z = 0.5 * depth - 0.09;
        for z in [z, -z] {
            let at = |y: f32| Vec3::new(x, y, z);
            solids.push(beam(at(-BITE), at(BENCH_HEIGHT - 0.06), 0.1, 0.11, Vec3::X, wood));
        }
        solids.push(cuboid_at(Vec3::new(x, 0.24, 0.0), Vec3::new(0.06, 0.1, 2.0 * z), wood));
        solids.push(cuboid_at(Vec3::new(x, BENCH_HEIGHT - 0.115, 0.0), Vec3::new(0.07, 0.1, 2.0 * z), wood));
    }
    let wood = palette.pick(Material::Timber);
    solids.push(cuboid_at(Vec3::new(0.0, 0.24, 0.0), Vec3::new(length - 0.46, 0.08, 0.05), wood));
    solids
}

/// A stool with three legs.
pub fn stool(palette: &mut Palette) -> Vec<SolidMesh> {
    let wood = palette.pick(Material::Plank);
    let mut solids = vec![lathe(&[(0.17, 0.42), (0.19, 0.44), (0.19, 0.47)], 16, wood)];
    for k in 0..3 {
        let (sin, cos) = libm::sincosf(TAU * k as f32 / 3.0 + 0.4);
        let out = Vec3::new(cos, 0.0, sin);
        solids.push(pole(out * 0.21 - Vec3::Y * BITE, out * 0.11 + Vec3::Y * 0.43, (0.022, 0.026), 6, wood));
    }
    solids
}

/// A bronze stand with an oil lamp on it. The flame burns at [`FLAME_HEIGHT`], over the bowl.
pub fn lamp_stand(palette: &mut Palette) -> Vec<SolidMesh> {
    let bronze = palette.pick(Material::Bronze);
    let stand = [
        (0.2, 0.06),
        (0.15, 0.1),
        (0.045, 0.14),
        (0.022, 0.3),
        (0.02, 1.3),
        (0.035, 1.34),
        (0.022, 1.38),
        (0.03, 1.46),
        (0.16, 1.5),
        (0.16, 1.52),
        (0.0, 1.52),
    ];
    let bowl = [(0.05, 1.515), (0.1, 1.55), (0.11, 1.58), (0.08, 1.61), (0.07, 1.6), (0.085, 1.575), (0.0, 1.565)];
    let mut solids = vec![lathe(&stand, 10, bronze), lathe(&bowl, 10, palette.pick(Material::Clay))];
    for k in 0..3 {
        let (sin, cos) = libm::sincosf(TAU * k as f32 / 3.0);
        let out = Vec3::new(cos, 0.0, sin);
        solids.push(beam(out * 0.1 + Vec3::Y * 0.075, out * 0.26 + Vec3::Y * 0.025, 0.05, 0.06, Vec3::Y, bronze));
    }
    solids
}

/// A jar with a neck and two handles.
pub fn amphora(height: f32, palette: &mut Palette) -> Vec<SolidMesh> {
    let clay = palette.pick(Material::Clay);
    let profile = [
        (0.10, -0.01),
        (0.12, 0.03),
        (0.09, 0.05),
        (0.2, 0.25),
        (0.27, 0.48),
        (0.25, 0.62),
        (0.14, 0.74),
        (0.09, 0.8),
        (0.085, 0.93),
        (0.13, 0.97),
        (0.13, 1.0),
        (0.1, 1.0),
        (0.065, 0.93),
        (0.06, 0.85),
        (0.0, 0.84),
    ]
    .map(|(radius, y)| (radius * height, y * height));
    let handle = |way: f32| {
        let at = |x: f32, y: f32| ([way * x * height, y * height, 0.0], 0.03 * height, 0.018 * height);
        sweep(&[at(0.075, 0.92), at(0.2, 0.92), at(0.21, 0.78), at(0.19, 0.67)], Vec3::Z, 6, 5)
    };
    let mut solids = vec![lathe(&profile, 14, clay)];
    solids.extend([1.0, -1.0].map(|way| smooth(handle(way), clay)));
    solids
}

/// An open bowl.
pub fn bowl(radius: f32, palette: &mut Palette) -> Vec<SolidMesh> {
    let profile = [(0.4, -0.01), (0.45, 0.05), (0.8, 0.25), (1.0, 0.55), (0.93, 0.55), (0.72, 0.28), (0.0, 0.14)];
    vec![lathe(&profile.map(|(r, y)| (r * radius, y * radius)), 12, palette.pick(Material::Clay))]
}

/// A mallet that lies, its handle along X.
pub fn mallet(palette: &mut Palette) -> Vec<SolidMesh> {
    let wood = palette.pick(Material::Plank);
    let head = [(0.05, 0.0), (0.065, 0.02), (0.075, 0.14), (0.06, 0.16)];
    let handle = pole(Vec3::new(-0.02, 0.07, 0.0), Vec3::new(0.3, 0.03, 0.0), (0.016, 0.02), 8, wood);
    let mut lying = placed(vec![lathe(&head, 12, wood)], Vec3::ZERO, 0.0)
        .map(|mesh| super::pieces::framed(mesh, Vec3::new(0.0, 0.068, -0.08), [Vec3::X, Vec3::Z, Vec3::NEG_Y]))
        .collect::<Vec<_>>();
    lying.push(handle);
    lying
}

/// Chisels side by side, along X.
pub fn chisels(count: u32, palette: &mut Palette) -> Vec<SolidMesh> {
    let mut solids = Vec::new();
    for k in 0..count {
        let z = 0.07 * k as f32;
        let (length, skew) = (palette.between(0.18, 0.27), palette.between(-0.02, 0.02));
        let iron = palette.pick(Material::Bronze) * 0.6;
        let at = |x: f32, dz: f32| Vec3::new(x, 0.012, z + dz);
        solids.push(pole(at(0.0, 0.0), at(length, skew), (0.011, 0.007), 6, iron));
    }
    solids
}

/// A rough block of marble.
pub fn rough_block(size: Vec3, palette: &mut Palette) -> SolidMesh {
    let marble = palette.pick(Material::Marble);
    // corners move in the plane of each horizontal face, so that the faces' bends stay small
    let half = size * 0.5;
    let corners: [Vec3; 4] = std::array::from_fn(|i| {
        let way = |bit: usize| if i & bit == 0 { -1.0 } else { 1.0 };
        Vec3::new(way(1) * half.x * palette.between(0.94, 1.0), 0.0, way(2) * half.z * palette.between(0.94, 1.0))
    });
    // one draught for all sides, which keeps them flat
    let draught = palette.between(0.93, 0.98);
    hexahedron(
        std::array::from_fn(|i| {
            let foot = corners[(i & 1) | (i >> 1 & 2)];
            if i & 2 == 0 { foot - Vec3::Y * BITE } else { Vec3::new(foot.x * draught, size.y, foot.z * draught) }
        }),
        marble,
    )
}

/// A block on a sledge and rollers, along X.
pub fn sledge(palette: &mut Palette) -> Vec<SolidMesh> {
    let mut solids = Vec::new();
    for k in 0..4 {
        let x = 0.62 * k as f32 - 0.93 + palette.between(-0.06, 0.06);
        let at = |z: f32| Vec3::new(x, 0.085, z);
        solids.push(pole(at(-0.72), at(0.72), (0.09, 0.09), 12, palette.pick(Material::Plank)));
    }
    let wood = palette.pick(Material::Timber);
    for z in [0.42, -0.42] {
        solids.push(cuboid(Vec3::new(-1.25, 0.17, z - 0.08), Vec3::new(1.2, 0.33, z + 0.08), wood));
    }
    for x in [-0.75, 0.0, 0.75] {
        solids.push(cuboid(Vec3::new(x - 0.07, 0.32, -0.58), Vec3::new(x + 0.07, 0.41, 0.58), wood));
    }
    let block = rough_block(Vec3::new(1.75, 0.82, 0.95), palette);
    solids.extend(placed(vec![block], Vec3::Y * 0.41, 0.03));
    solids
}

/// A youth, worked out of his block as far as the hips: 2.4 m with the block, on a low turning stand.
pub fn unfinished_youth(palette: &mut Palette) -> Vec<SolidMesh> {
    let marble = palette.pick(Material::Marble);
    let wood = palette.pick(Material::Timber);
    let mut solids = vec![
        lathe(&[(0.62, -BITE), (0.62, 0.1), (0.56, 0.12), (0.56, 0.3)], 20, wood),
        hexahedron(
            std::array::from_fn(|i| {
                let (x, z) = (if i & 1 == 0 { -1.0 } else { 1.0 }, if i & 4 == 0 { -1.0 } else { 1.0 });
                if i & 2 == 0 { Vec3::new(0.37 * x, 0.29, 0.36 * z) } else { Vec3::new(0.33 * x, 1.15, 0.31 * z) }
            }),
            marble,
        ),
    ];
    let legs = sweep(&[([-0.12, 1.0, 0.0], 0.15, 0.17), ([-0.1, 1.5, 0.02], 0.11, 0.11)], Vec3::X, 5, 14);
    let shapes = vec![
        legs.mirrored(),
        legs,
        sweep(
            &[
                ([0.0, 1.27, 0.0], 0.25, 0.18),
                ([0.01, 1.55, 0.03], 0.2, 0.15),
                ([0.02, 1.85, 0.04], 0.27, 0.17),
                ([0.01, 2.02, 0.01], 0.25, 0.12),
                ([0.01, 2.1, 0.01], 0.1, 0.09),
            ],
            Vec3::X,
            14,
            18,
        ),
        sweep(&[([0.01, 2.0, 0.0], 0.085, 0.085), ([0.02, 2.25, 0.03], 0.075, 0.08)], Vec3::X, 4, 10),
        ball(Vec3::new(0.03, 2.32, 0.05), Vec3::new(0.1, 0.14, 0.125), 10, 14),
        ball(Vec3::new(0.03, 2.35, 0.02), Vec3::new(0.115, 0.13, 0.13), 8, 12),
        // one arm ends where the chisel left it
        sweep(
            &[([-0.27, 1.98, 0.01], 0.09, 0.09), ([-0.34, 1.7, 0.0], 0.08, 0.08), ([-0.31, 1.4, 0.08], 0.07, 0.07)],
            Vec3::X,
            8,
            10,
        ),
        sweep(&[([0.29, 1.98, 0.01], 0.09, 0.09), ([0.36, 1.74, 0.02], 0.085, 0.085)], Vec3::X, 5, 10),
    ];
    solids.extend(shapes.into_iter().map(|shape| smooth(shape, marble)));
    solids
}

/// The model of the god's head in clay, a third of a man's height, on a little pillar.
pub fn clay_head(palette: &mut Palette) -> Vec<SolidMesh> {
    const SCALE: f32 = 0.28;
    let clay = palette.pick(Material::Clay) * 1.2;
    let (skin, hair) = statue::head(Vec3::new(0.0, 1.3, 0.0));
    let mut solids: Vec<SolidMesh> =
        skin.into_iter().chain(hair).map(|shape| smooth(shape.moved(|p| p * SCALE), clay)).collect();
    solids.push(lathe(&[(0.11, -BITE), (0.11, 0.03), (0.07, 0.05), (0.09, 0.4)], 14, clay));
    solids
}

/// A tusk that lies.
pub fn tusk(length: f32, palette: &mut Palette) -> SolidMesh {
    let at = |x: f32, y: f32, z: f32, r: f32| ([x * length, y * length, z * length], r * length, r * length);
    let line =
        [at(0.0, 0.035, 0.0, 0.042), at(0.35, 0.032, 0.12, 0.038), at(0.7, 0.03, 0.1, 0.027), at(1.0, 0.05, -0.05, 0.006)];
    smooth(sweep(&line, Vec3::Y, 12, 10), palette.pick(Material::Ivory))
}

/// Height of the furnace's rim, and from its foot to the coals in it.
pub const FURNACE_HEIGHTS: (f32, f32) = (0.82, 0.62);

/// A round furnace of clay, open above.
pub fn furnace(palette: &mut Palette) -> Vec<SolidMesh> {
    let (rim, coals) = FURNACE_HEIGHTS;
    let outside = [(0.36, -BITE), (0.38, 0.06), (0.34, 0.1), (0.33, rim - 0.1), (0.37, rim - 0.06), (0.37, rim)];
    let inside = [(0.27, rim), (0.25, coals - 0.04), (0.0, coals - 0.04)];
    vec![lathe(&[&outside[..], &inside].concat(), 20, palette.pick(Material::Clay))]
}

/// The coals in it.
pub fn coals(palette: &mut Palette) -> Vec<SolidMesh> {
    const COALS: u32 = 13;
    let coal = |k: u32| {
        // on a spiral, so that they neither touch the wall nor leave a hole in the middle
        let (sin, cos) = libm::sincosf(2.4 * k as f32);
        let far = 0.2 * (k as f32 / COALS as f32).sqrt();
        let middle = Vec3::new(far * cos, FURNACE_HEIGHTS.1 - 0.01 + palette.between(0.0, 0.015), far * sin);
        let size = Vec3::new(palette.between(0.025, 0.04), palette.between(0.02, 0.03), palette.between(0.025, 0.04));
        smooth(ball(middle, size, 4, 6), palette.pick(Material::Ebony) * 0.6)
    };
    (0..COALS).map(coal).collect()
}

/// A pot to melt in, its foot at the origin.
pub fn crucible(palette: &mut Palette) -> SolidMesh {
    let profile = [(0.055, 0.0), (0.09, 0.05), (0.1, 0.15), (0.085, 0.15), (0.075, 0.06), (0.0, 0.05)];
    lathe(&profile, 16, palette.pick(Material::Clay) * 0.7)
}

/// A clay mould for a fold of the golden robe, that lies: a shallow, ribbed shell.
pub fn mould(palette: &mut Palette) -> SolidMesh {
    let ribs = |along: f32, angle: f32| 1.0 + 0.14 * libm::cosf(5.0 * angle + 3.0 * along);
    let line = [([-0.24, 0.05, 0.0], 0.13, 0.055), ([0.0, 0.07, 0.0], 0.17, 0.075), ([0.24, 0.05, 0.02], 0.12, 0.05)];
    smooth(pleated(&line, Vec3::Z, 8, 20, ribs), palette.pick(Material::Clay))
}

/// A basket, or with little height a tray, of wood.
pub fn bucket(palette: &mut Palette) -> Vec<SolidMesh> {
    let profile = [(0.13, -BITE), (0.17, 0.3), (0.155, 0.3), (0.12, 0.03), (0.0, 0.03)];
    vec![lathe(&profile, 14, palette.pick(Material::Plank))]
}
