//! A small temple: what a person would mark of it, the shapes that stand for it, and what it is made of.

use glam::{DMat3, DVec2, DVec3, Vec3};
use heliodon_math::frame::orthonormal_basis;
use heliodon_math::random::hash3_u32;
use heliodon_photo::camera::{Camera, Intrinsics, Pose};
use heliodon_photo::model::table::ShapeRow;
use heliodon_photo::model::{NamedPoint, Part, build};
use heliodon_photo::solve::random::Random;

/// The scene's size, metres: the lowest step's length.
pub const SIZE_M: f64 = 12.4;

#[derive(serde::Deserialize)]
struct Table {
    shape: Vec<ShapeRow>,
}

/// The temple in words, as a project would have it; `SIDES` stands for the columns' sides.
const SHAPES: &str = r#"
    [[shape]]
    name = "step 1"
    kind = "box"
    points = ["s1-sw", "s1-se", "s1-ne", "s1-nw", "s1-sw-top", "s1-se-top", "s1-ne-top", "s1-nw-top"]
    [[shape]]
    name = "step 2"
    kind = "box"
    points = ["s2-sw", "s2-se", "s2-ne", "s2-nw", "s2-sw-top", "s2-se-top", "s2-ne-top", "s2-nw-top"]
    [[shape]]
    name = "cella"
    kind = "box"
    points = ["c-sw", "c-se", "c-ne", "c-nw", "c-sw-top", "c-se-top", "c-ne-top", "c-nw-top"]
    [[shape]]
    name = "architrave"
    kind = "box"
    points = ["e-sw", "e-se", "e-ne", "e-nw", "e-sw-top", "e-se-top", "e-ne-top", "e-nw-top"]
    [[shape]]
    name = "roof"
    kind = "gable"
    points = ["g-se", "g-ne", "g-nw", "g-sw", "ridge-s", "ridge-n"]
    watertight = true
    [[shape]]
    name = "ground"
    kind = "polygon"
    points = ["f-sw", "f-se", "f-ne", "f-nw"]
"#;

const COLUMN: &str = r#"
    [[shape]]
    name = "NAME"
    kind = "column"
    bottom = ["NAME-foot-0", "NAME-foot-1", "NAME-foot-2", "NAME-foot-3", "NAME-foot-4"]
    top = ["NAME-neck-0", "NAME-neck-1", "NAME-neck-2", "NAME-neck-3", "NAME-neck-4"]
    axis = ["NAME-foot-0", "NAME-neck-0"]
    upright = true
    sides = SIDES
    repeat = { count = COUNT, span = ["NAME-foot-0", "LAST-foot-0"] }
"#;

/// Columns on each flank, corners and all, and across the fronts between them.
const FLANK: u32 = 5;
const FRONT: u32 = 2;

/// The shapes, their columns of so many sides.
pub fn shapes(sides: u32) -> Vec<ShapeRow> {
    let mut text = SHAPES.to_owned();
    for (name, last, count) in
        [("sw", "nw", FLANK), ("se", "ne", FLANK), ("south-1", "south-2", FRONT), ("north-1", "north-2", FRONT)]
    {
        let column = COLUMN.replace("NAME", name).replace("LAST", last);
        text += &column.replace("SIDES", &sides.to_string()).replace("COUNT", &count.to_string());
    }
    toml::from_str::<Table>(&text).unwrap().shape
}

const FOOT_M: f64 = 0.7;
const NECK_M: f64 = 4.7;
const FOOT_RADIUS_M: f64 = 0.45;
const NECK_RADIUS_M: f64 = 0.36;

/// Every point by its name. Columns' rims are marked where arrises meet the step: outward, and to both sides.
pub fn points() -> Vec<(String, DVec3)> {
    let mut all: Vec<(String, DVec3)> = Vec::new();
    let mut add_box = |name: &str, x: f64, z: f64, low: f64, high: f64| {
        for (corner, sx, sz) in [("sw", -1.0, 1.0), ("se", 1.0, 1.0), ("ne", 1.0, -1.0), ("nw", -1.0, -1.0)] {
            all.push((format!("{name}-{corner}"), DVec3::new(sx * x, low, sz * z)));
            if high > low {
                all.push((format!("{name}-{corner}-top"), DVec3::new(sx * x, high, sz * z)));
            }
        }
    };
    add_box("s1", 4.2, 6.2, 0.0, 0.35);
    add_box("s2", 3.8, 5.8, 0.35, FOOT_M);
    add_box("c", 1.9, 3.6, FOOT_M, NECK_M);
    add_box("e", 3.15, 5.15, NECK_M, 5.7);
    add_box("g", 3.6, 5.6, 5.7, 5.7);
    add_box("f", 6.0, 8.0, 0.0, 0.0);
    all.push(("ridge-s".into(), DVec3::new(0.0, 7.3, 5.6)));
    all.push(("ridge-n".into(), DVec3::new(0.0, 7.3, -5.6)));
    let corners: [(&str, f64, f64); 4] = [("sw", -2.95, 4.95), ("se", 2.95, 4.95), ("ne", 2.95, -4.95), ("nw", -2.95, -4.95)];
    let fronts: [(&str, f64, f64); 4] =
        [("south-1", -1.0, 4.95), ("south-2", 1.0, 4.95), ("north-1", -1.0, -4.95), ("north-2", 1.0, -4.95)];
    for (name, x, z) in corners.into_iter().chain(fronts) {
        let outward = if x.abs() < 2.0 { DVec3::new(0.0, 0.0, z.signum()) } else { DVec3::new(x.signum(), 0.0, z.signum()) };
        let outward = outward.try_normalize().unwrap();
        let aside = outward.cross(DVec3::Y);
        for (rim, height, radius) in [("foot", FOOT_M, FOOT_RADIUS_M), ("neck", NECK_M, NECK_RADIUS_M)] {
            for (i, turn) in [0.0, 0.7, -0.7, 1.3, -1.3].into_iter().enumerate() {
                let way = outward * libm::cos(turn) + aside * libm::sin(turn);
                all.push((format!("{name}-{rim}-{i}"), DVec3::new(x, height, z) + way * radius));
            }
        }
    }
    all
}

/// Shapes for points of which some were not found: boxes do without a corner, shafts without a place of their rims.
pub fn shapes_without(sides: u32, is_found: impl Fn(&str) -> bool) -> Vec<ShapeRow> {
    let mut rows = shapes(sides);
    for row in &mut rows {
        row.points.iter_mut().filter(|name| !is_found(name)).for_each(|name| *name = "-".into());
        row.bottom.retain(|name| is_found(name));
        row.top.retain(|name| is_found(name));
    }
    rows
}

/// The temple itself: its shapes on its own points, columns rounder than anyone models them.
pub fn truth() -> Vec<Part> {
    built(64, 0.0, 0)
}

/// Its shapes on points that are off by so much.
pub fn built(sides: u32, off_m: f64, seed: u64) -> Vec<Part> {
    let mut random = Random::new(seed);
    let point = |(name, position): (String, DVec3)| {
        let covariance = DMat3::from_diagonal(DVec3::splat(1e-10 + off_m * off_m));
        let off = DVec3::new(random.normal(), random.normal(), random.normal()) * off_m;
        NamedPoint { name, position: position + off, covariance, seen_in: vec![] }
    };
    let points: Vec<NamedPoint> = points().into_iter().map(point).collect();
    let model = build(&shapes(sides), &points, &[]);
    assert_eq!(model.refused, []);
    model.parts
}

/// The middle of a grey card that hangs on the architrave's south front, and its albedo.
pub const CARD_M: DVec3 = DVec3::new(0.8, 5.2, 5.15);
pub const CARD: f32 = 0.3;

/// What its stones are: blocks of marble that differ, joints, patina and a grain, tiles on the roof, gravel about it.
pub fn albedo(p: Vec3) -> Vec3 {
    let wave = libm::sinf;
    let cell = |x: f32| libm::floorf(x) as i32 as u32;
    let patina = wave(1.3 * p.x + 0.9 * wave(1.1 * p.y + 0.3)) * wave(1.6 * p.z + 1.2 * wave(0.8 * p.x + 1.0));
    let grain = wave(8.0 * p.x + 2.0 * p.y) * wave(7.0 * p.y - 3.0 * p.z + 1.0) * wave(9.0 * p.z + 2.0 * p.x);
    let texture = 1.0 + 0.14 * patina + 0.08 * grain;
    if p.y < 0.02 {
        return Vec3::new(0.30, 0.26, 0.20) * (1.0 + 0.25 * patina + 0.15 * grain);
    }
    if p.y > 5.75 && p.z.abs() < 5.58 {
        let tile = hash3_u32(cell(p.z / 0.6), cell((p.x.abs() + 0.1) / 0.7), 3) as f32 / u32::MAX as f32;
        return Vec3::new(0.46, 0.25, 0.16) * (0.75 + 0.5 * tile) * texture;
    }
    let from_card = (p - CARD_M.as_vec3()).abs();
    if from_card.max_element() < 0.45 {
        return Vec3::splat(CARD);
    }
    let course = cell((p.y + 0.02) / 0.61);
    let shift = if course % 2 == 0 { 0.0 } else { 0.45 };
    let block = hash3_u32(course, cell((p.x + shift + 40.0) / 0.9), cell((p.z + shift + 40.0) / 0.9)) as f32 / u32::MAX as f32;
    let joint = |x: f32, size: f32| {
        let off = (x / size - libm::roundf(x / size)).abs() * size;
        1.0 - 0.3 * (1.0 - (off / 0.06).min(1.0))
    };
    let joints = joint(p.y + 0.02, 0.61);
    Vec3::new(0.66, 0.58, 0.47) * (0.72 + 0.5 * block) * texture * joints
}

/// The mean of [`albedo`] over a square of a surface: what a texel, or a pixel, can tell of it.
pub fn mean_albedo(place: Vec3, normal: Vec3, side_m: f32) -> Vec3 {
    let (right, up) = orthonormal_basis(normal);
    let at = |k: i32| (k % 5 - 2) as f32 / 5.0 * side_m;
    (0..25).map(|k| albedo(place + right * at(k) + up * at(k / 5))).sum::<Vec3>() / 25.0
}

/// Photographs taken on a way about it, of so many columns and rows, by one lens.
pub fn cameras(count: u32, size: [u32; 2]) -> Vec<Camera> {
    (0..count)
        .map(|i| {
            let angle = std::f64::consts::TAU * (f64::from(i) + 0.3) / f64::from(count);
            let away = [1.0, 1.15, 0.92][i as usize % 3];
            let eye =
                DVec3::new(15.0 * away * libm::sin(angle), [1.7, 2.6, 6.5][i as usize % 3], 17.5 * away * libm::cos(angle));
            camera(eye, DVec3::new(0.3, 2.9, -0.2), size)
        })
        .collect()
}

/// A camera of the lens that all share: mildly distorted.
pub fn camera(eye: DVec3, target: DVec3, [width, height]: [u32; 2]) -> Camera {
    let lens = Intrinsics { radial: [-0.08, 0.0, 0.0], ..Intrinsics::pinhole(width, height, 0.82 * f64::from(width)) };
    Camera { intrinsics: lens, pose: Pose::look_at(eye, target).unwrap() }
}

/// A view that no photograph has.
pub fn new_view(size: [u32; 2]) -> Camera {
    camera(DVec3::new(9.5, 2.6, 11.0), DVec3::new(0.0, 2.8, 0.0), size)
}

/// Whether a pixel lies in its photograph.
pub fn is_inside(camera: &Camera, pixel: DVec2) -> bool {
    let size = DVec2::new(f64::from(camera.intrinsics.width), f64::from(camera.intrinsics.height));
    pixel.cmpge(DVec2::ZERO).all() && pixel.cmplt(size).all()
}
