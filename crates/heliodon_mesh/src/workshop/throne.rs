//! What the god sits on, in his own space: throne and footstool; and the base under all.

use super::measures::BASE_TOP;
use super::palette::{Material, Palette};
use super::pieces::{cuboid, lathe, placed};
use crate::temple::solid::SolidMesh;
use glam::Vec3;

/// Height of the footstool: how far the figure's origin is above the base.
pub const FOOTSTOOL_HEIGHT: f32 = 0.45;
/// The top of the base, a little within which everything on it stands.
const FLOOR: f32 = -FOOTSTOOL_HEIGHT - 0.02;

/// A box that is symmetric about the figure's plane of symmetry.
fn across(half: f32, y: (f32, f32), z: (f32, f32), color: Vec3) -> SolidMesh {
    cuboid(Vec3::new(-half, y.0, z.0), Vec3::new(half, y.1, z.1), color)
}

/// A box on the figure's left and its image on the right.
fn pair(x: (f32, f32), y: (f32, f32), z: (f32, f32), color: Vec3) -> [SolidMesh; 2] {
    [
        cuboid(Vec3::new(x.0, y.0, z.0), Vec3::new(x.1, y.1, z.1), color),
        cuboid(Vec3::new(-x.1, y.0, z.0), Vec3::new(-x.0, y.1, z.1), color),
    ]
}

/// The throne.
pub fn throne(palette: &mut Palette) -> Vec<SolidMesh> {
    let (ebony, gold) = (palette.pick(Material::Ebony), palette.pick(Material::Gold));
    let ivory = palette.pick(Material::Ivory);
    let mut solids = vec![
        across(2.02, (2.06, 2.5), (-1.55, 1.95), ebony),
        // a golden moulding around the seat
        across(2.06, (2.2, 2.34), (-1.59, 1.99), gold),
        across(1.72, (2.45, 7.25), (-1.86, -1.66), ebony),
        across(1.4, (4.6, 6.9), (-1.67, -1.62), ivory),
        across(1.95, (7.2, 7.5), (-1.93, -1.59), gold),
        // panels between the legs, painted
        across(1.62, (-0.1, 1.5), (-1.38, -1.3), ebony),
    ];
    for x in [1.76, -1.76] {
        for (z, top) in [(-1.34, 2.08), (1.72, 2.08)] {
            let turned = [
                (0.24, FLOOR),
                (0.24, -0.2),
                (0.15, -0.12),
                (0.19, 0.5),
                (0.25, 0.95),
                (0.25, 1.05),
                (0.15, 1.15),
                (0.2, 1.6),
                (0.26, 1.85),
                (0.26, top),
            ];
            solids.extend(placed(vec![lathe(&turned, 12, ebony)], Vec3::new(x, 0.0, z), 0.0));
        }
        // posts of the back with the Graces and the Hours on top
        let post = [
            (0.19, FLOOR),
            (0.19, 7.6),
            (0.26, 7.68),
            (0.26, 7.75),
            (0.15, 7.8),
            (0.12, 8.0),
            (0.17, 8.18),
            (0.07, 8.34),
            (0.1, 8.45),
            (0.0, 8.55),
        ];
        solids.extend(placed(vec![lathe(&post, 10, gold)], Vec3::new(x, 0.0, -1.77), 0.0));
        let support = [(0.2, 2.48), (0.2, 2.6), (0.1, 2.75), (0.2, 3.4), (0.12, 4.0), (0.2, 4.2), (0.2, 4.33)];
        solids.extend(placed(vec![lathe(&support, 10, gold)], Vec3::new(1.035 * x, 0.0, 1.5), 0.0));
    }
    solids.extend(pair((1.7, 1.78), (-0.1, 1.5), (-1.2, 1.58), palette.pick(Material::Clay)));
    solids.extend(pair((1.72, 1.78), (2.44, 4.32), (-1.5, 1.2), ebony));
    solids.extend(pair((1.62, 2.3), (4.3, 4.52), (-1.7, 1.85), ebony));
    solids.extend(pair((1.6, 2.32), (4.37, 4.45), (-1.68, 1.88), gold));
    // the footstool on four lions, here their bodies only
    solids.push(across(1.6, (-0.17, 0.0), (2.25, 4.55), gold));
    solids.push(across(1.5, (-0.3, -0.15), (2.35, 4.45), ebony));
    for z in [(2.42, 2.95), (3.85, 4.38)] {
        solids.extend(pair((1.02, 1.42), (FLOOR, -0.28), z, gold));
    }
    solids
}

/// The base, height zero on the floor.
pub fn base(palette: &mut Palette) -> Vec<SolidMesh> {
    let (dark, light) = (palette.pick(Material::Limestone) * 0.45, palette.pick(Material::Marble));
    let (back, front) = (-2.4, 5.15);
    let mut solids = vec![
        across(2.8, (-0.03, 0.2), (back - 0.2, front + 0.2), light),
        across(2.6, (0.18, BASE_TOP - 0.12), (back, front), dark),
        across(2.75, (BASE_TOP - 0.14, BASE_TOP), (back - 0.15, front + 0.15), light),
    ];
    // golden figures along the front: the birth of Aphrodite
    let gold = palette.pick(Material::Gold);
    for k in -4..=4 {
        let x = 0.55 * k as f32;
        let relief = [(0.1, 0.22), (0.13, 0.3), (0.08, 0.5), (0.11, 0.62), (0.04, 0.68), (0.07, 0.74), (0.0, 0.81)];
        solids.extend(placed(vec![lathe(&relief, 6, gold)], Vec3::new(x, 0.0, front + 0.03), 0.0));
    }
    solids
}
