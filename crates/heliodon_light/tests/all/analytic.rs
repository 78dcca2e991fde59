//! Light that is known in closed form.

#![expect(clippy::unwrap_used, reason = "a test that panics has failed")]

use crate::common::{Lit, UNIFORM_SKY, params};
use glam::Vec3;
use heliodon_light::{Channels, LightParams, bake};
use heliodon_math::sh::open_transfer9;
use heliodon_testkit::scenes::{corner_form_factor, cuboid, ground, rectangle};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_4};

/// What a lattice of `samples` directions above a point is off by at most for a view cut by a few edges: its discrepancy falls
/// with the power -3/4 (Brauchart, Saff, Sloan, Womersley: "QMC Designs", Math. Comp. 83, 2014).
fn lattice_tolerance(samples: u32) -> f32 {
    1.0 / (samples as f32).powf(0.75)
}

/// The vertex nearest to a place among those whose normal is `normal`.
fn vertex_at(lit: &Lit, place: Vec3, normal: Vec3) -> usize {
    let distance = |v: usize| lit.scene.positions[v].distance_squared(place);
    (0..lit.scene.positions.len())
        .filter(|&v| lit.scene.normals[v].dot(normal) > 0.99)
        .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
        .unwrap()
}

fn uniform(light: &heliodon_light::VertexLight, vertex: usize) -> f32 {
    let mut sky = [Vec3::ZERO; 9];
    sky[0] = Vec3::splat(UNIFORM_SKY);
    light.sky_light(vertex, &sky[..light.coefficients]).x
}

#[test]
fn an_open_plane_keeps_exactly_the_cosine_lobe() {
    let lit = Lit::new(ground(2.0, 3), 0.5);
    for (samples, coefficients) in [(4, 4), (64, 9), (333, 9)] {
        let params = LightParams { coefficients, ..params(samples, 4) };
        let baked = bake(&lit.surfaces(), &[], false, &params).unwrap();
        let open = open_transfer9(Vec3::Y);
        for transfer in baked.light.sky_transfer.chunks_exact(coefficients) {
            assert_eq!(transfer, &open[..coefficients], "{samples} samples");
        }
        assert!((uniform(&baked.light, 0) - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_wall_takes_half_of_the_sky() {
    // a wall so long and high that it fills all but 1 / 1000 of half the view
    let wall = rectangle(Vec3::new(-0.01, -1.0, 2000.0), Vec3::NEG_Z * 4000.0, Vec3::Y * 2000.0, 1);
    let lit = Lit::new(ground(0.5, 2).moved(Vec3::X * 0.25).and(wall), 0.0);
    let baked = bake(&lit.surfaces(), &[], false, &LightParams { max_sub_cells: 100, ..params(2048, 0) }).unwrap();
    let light = uniform(&baked.light, vertex_at(&lit, Vec3::new(0.0, 0.0, 0.0), Vec3::Y));
    assert!((light - 0.5).abs() < lattice_tolerance(2048) + 1e-3, "{light}");
}

#[test]
fn a_roof_hides_its_form_factor() {
    // a canopy over one quarter; the other three are open
    let canopy = rectangle(Vec3::new(0.0, 1.0, 0.0), Vec3::X * 2.0, Vec3::Z * 1.5, 4);
    let lit = Lit::new(ground(0.2, 2).and(canopy), 0.0);
    let samples = 4096;
    let baked = bake(&lit.surfaces(), &[], false, &params(samples, 0)).unwrap();
    let light = uniform(&baked.light, vertex_at(&lit, Vec3::ZERO, Vec3::Y));
    let exact = 1.0 - corner_form_factor(2.0, 1.5, 1.0) as f32;
    assert!((light - exact).abs() < lattice_tolerance(samples), "{light} against {exact}");
}

#[test]
fn sky_that_reaches_a_room_by_the_window_alone_obeys_the_furnace() {
    // The furnace of a box that emits has no place in a transfer, which knows no emission; its balance has: what comes in by the
    // window is absorbed by the walls or goes out again.
    let lit = Lit::new(room_with_window(12), 0.5);
    let mut direct_params = params(512, 0);
    direct_params.cell_size_m = Some(10.0);
    let direct = bake(&lit.surfaces(), &[], false, &direct_params).unwrap();
    let full = bake(&lit.surfaces(), &[], false, &LightParams { bounces: 60, ..direct_params }).unwrap();
    // A patch sees the window with the weight with which the window sees the patch, so light that leaves by the window is the
    // area's mean of (light straight from the window) * albedo * light, and light that enters is that of the direct light alone.
    let (mut area, mut absorbed, mut out, mut flown_in) = (0.0, 0.0, 0.0, 0.0);
    for t in &lit.scene.triangles {
        let [a, b, c] = t.map(|i| lit.scene.positions[i as usize]);
        let share = (b - a).cross(c - a).length() * 0.5 / 3.0;
        for &v in t {
            let (d, f) = (uniform(&direct.light, v as usize), uniform(&full.light, v as usize));
            area += share;
            flown_in += share * d;
            absorbed += share * 0.5 * f;
            out += share * d * 0.5 * f;
        }
    }
    let window = 0.5 * 0.5;
    assert!((flown_in / window - 1.0).abs() < 0.05, "window {window}, light in {flown_in}");
    assert!(((absorbed + out) / flown_in - 1.0).abs() < 0.03, "in {flown_in}, absorbed {absorbed}, out {out}, of {area}");
}

/// A unit room that looks inwards, with a window of half a metre in the middle of its ceiling.
fn room_with_window(parts: u32) -> heliodon_testkit::scenes::Scene {
    let mut room = cuboid(Vec3::splat(-0.5), Vec3::splat(0.5), parts).inside_out();
    let positions = room.positions.clone();
    room.triangles.retain(|t| {
        let centre = t.map(|i| positions[i as usize]).iter().sum::<Vec3>() / 3.0;
        !(centre.y > 0.499 && centre.x.abs() < 0.25 && centre.z.abs() < 0.25)
    });
    room
}

#[test]
fn a_closed_room_is_dark_whatever_bounces() {
    for parts in [1, 4] {
        let lit = Lit::new(cuboid(Vec3::splat(-0.5), Vec3::splat(0.5), parts).inside_out(), 0.9);
        let baked = bake(&lit.surfaces(), &[Vec3::Y], true, &LightParams { max_sub_cells: 2000, ..params(32, 3) }).unwrap();
        assert!(baked.light.sky_transfer.iter().all(|&t| t == 0.0));
        assert!(baked.masks.words.iter().all(|&w| w == 0));
        // points in the very edges of the room look along its walls; none may be taken for one inside a stone
        assert!(baked.light.validity.valid.iter().all(|&v| v == 1));
    }
}

#[test]
fn bounced_sun_of_a_lit_plane_meets_a_wall() {
    // a vertical wall over a wide sunlit ground sees ground with half its view: a cos / (2 pi); the sun stands behind the wall's
    // back, which a step behind hides from the ground by nothing
    let sun = Vec3::new(-0.6, 0.8, 0.0);
    let wall = rectangle(Vec3::new(0.0, 0.5, 0.01), Vec3::NEG_Z * 0.02, Vec3::Y * 0.02, 1);
    let lit = Lit::new(ground(400.0, 100).and(wall), 0.4);
    let samples = 512;
    let params = LightParams { cell_size_m: Some(10.0), ..params(samples, 1) };
    let baked = bake(&lit.surfaces(), &[sun], true, &params).unwrap();
    let wall_vertex = (0..lit.scene.positions.len()).find(|&v| lit.scene.normals[v].y.abs() < 0.5).unwrap();
    assert!(lit.scene.normals[wall_vertex].dot(sun) < 0.0, "the wall's front lies in the shade");
    assert!(!baked.masks.is_lit(wall_vertex, 0));
    let exact = 0.5 * 0.4 * 0.8 * FRAC_1_PI;
    let light = baked.light.bounced_sun(wall_vertex, 0).x;
    // the ground ends at 200 m: the view's lowest 2.5 / 1000 of a radian are missing
    assert!((light / exact - 1.0).abs() < 2.0 * lattice_tolerance(samples) + 0.005, "{light} against {exact}");
}

#[test]
fn the_back_of_an_open_sheet_has_light_of_its_own() {
    // under a canopy of a single sheet, whose top the sun lights: what bounces down is the ground's light, not the sun's
    let canopy = rectangle(Vec3::new(-0.6, 1.0, 0.6), Vec3::X * 1.2, Vec3::NEG_Z * 1.2, 4);
    assert_eq!(canopy.normals[0], Vec3::Y);
    let lit = Lit::new(ground(4.0, 8).and(canopy), 0.8);
    let two_sided = bake(&lit.surfaces(), &[Vec3::Y], true, &params(64, 1)).unwrap();
    let centre = vertex_at(&lit, Vec3::ZERO, Vec3::Y);
    assert!(lit.scene.positions[centre].y == 0.0);
    assert!(!two_sided.masks.is_lit(centre, 0));
    assert_eq!(two_sided.light.bounced_sun(centre, 0), Vec3::ZERO, "the canopy's lit top shines through");
    // sky light from the ground's rim reaches the underside and comes back down: second bounce
    let dark = bake(&lit.surfaces(), &[], false, &LightParams { back_side_rounds: 0, ..params(64, 1) }).unwrap();
    assert!(uniform(&two_sided.light, centre) > uniform(&dark.light, centre) + 0.01);
}

#[test]
fn transfer_between_two_patches_is_reciprocal() {
    // two squares of different size and albedo that face each other; sky blocked by nothing else. A_1 F_12 = A_2 F_21
    let low = ground(1.0, 12);
    let high = rectangle(Vec3::new(-1.0, 1.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0, 16);
    assert_eq!(high.normals[0], Vec3::NEG_Y);
    let count = low.positions.len();
    let lit = Lit::new(low.and(high), 0.0);
    let baked = bake(&lit.surfaces(), &[], false, &params(256, 0)).unwrap();
    let blocked = |vertices: std::ops::Range<usize>| -> f32 {
        let triangles = lit.scene.triangles.iter().filter(|t| vertices.contains(&(t[0] as usize)));
        triangles
            .map(|t| {
                let [a, b, c] = t.map(|i| lit.scene.positions[i as usize]);
                let area = (b - a).cross(c - a).length() * 0.5;
                t.iter().map(|&v| (1.0 - uniform(&baked.light, v as usize)) * area / 3.0).sum::<f32>()
            })
            .sum()
    };
    let (up, down) = (blocked(0..count), blocked(count..lit.scene.positions.len()));
    assert!((up / down - 1.0).abs() < 0.01, "{up} against {down}");
}

#[test]
fn a_box_of_twelve_triangles_is_solved_like_a_fine_one() {
    // two sheets of two triangles each, one above the other, under a uniform sky with many bounces
    let light_of = |parts: u32| {
        let roof = rectangle(Vec3::new(-1.0, 0.5, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0, parts);
        let lit = Lit::new(ground(2.0, parts).and(roof).and(ground(0.02, 1).moved(Vec3::Y * 1e-3)), 0.7);
        let baked = bake(&lit.surfaces(), &[], false, &LightParams { max_sub_cells: 4000, ..params(128, 4) }).unwrap();
        uniform(&baked.light, lit.scene.positions.len() - 1)
    };
    let (coarse, fine) = (light_of(1), light_of(24));
    assert!((coarse / fine - 1.0).abs() < 0.02, "{coarse} against {fine}");
}

#[test]
fn a_sundial_shows_the_hour() {
    // a thin plate stands on the ground; its shadow falls where the sun says
    let gnomon = rectangle(Vec3::new(-0.1, 0.0, 0.0), Vec3::X * 0.2, Vec3::Y, 1);
    let lit = Lit::new(ground(6.0, 60).and(gnomon), 0.5);
    let suns: Vec<Vec3> = (0..40)
        .map(|t| {
            let angle = FRAC_PI_4 * (0.5 + 3.0 * t as f32 / 39.0);
            Vec3::new(angle.cos() * 0.3, angle.sin(), 0.6).normalize_or_zero()
        })
        .collect();
    let baked = bake(&lit.surfaces(), &suns, false, &params(4, 0)).unwrap();
    let mut shadowed = 0;
    for v in 0..61 * 61 {
        let p = lit.scene.positions[v];
        for (t, sun) in suns.iter().enumerate() {
            // where the ray from the point crosses the plate's plane
            let reach = -p.z / sun.z;
            let (x, y) = (p.x + sun.x * reach, sun.y * reach);
            let margin = (x.abs() - 0.1).abs().min((y - 1.0).abs()).min(p.z.abs());
            if margin > 1e-3 {
                let hidden = reach > 0.0 && x.abs() < 0.1 && y < 1.0;
                assert_eq!(baked.masks.is_lit(v, t as u32), !hidden, "step {t} at {p}");
                shadowed += u32::from(hidden);
            }
        }
    }
    assert!(shadowed > 200, "only {shadowed} shadowed");
}

#[test]
fn a_shaded_valley_sees_its_own_shade_beside_it() {
    // all that the middle of a valley sees of its slopes lies within millimetres; leaves keep one sun off there, and off little else
    let slope = |x: f32| [-1.0, 0.0, 1.0].map(|z| (Vec3::new(x, 0.4, z), Vec3::new(-0.4 * x, 1.0, 0.0).normalize_or_zero()));
    let valley = [-1.0, 0.0, 1.0].map(|z| (Vec3::new(0.0, 0.0, z), Vec3::Y));
    let (positions, normals) = slope(-1.0).into_iter().chain(valley).chain(slope(1.0)).unzip();
    let triangles = [0, 1, 3, 4].into_iter().flat_map(|i| [[i, i + 1, i + 4], [i, i + 4, i + 3]]).collect();
    // so that days differ from place to place, and are told by two functions
    let awning = rectangle(Vec3::new(0.3, 0.7, 1.0), Vec3::X * 0.5, Vec3::NEG_Z * 2.0, 4);
    let open = heliodon_testkit::scenes::Scene { positions, normals, triangles }.and(awning);
    let leaf = |z: f32| rectangle(Vec3::new(-0.004, 0.5, z + 0.004), Vec3::X * 0.008, Vec3::NEG_Z * 0.008, 1);
    let suns = [Vec3::Y, Vec3::new(0.0, 0.8, 0.6)];
    let [shaded, lit] = [open.clone().and(leaf(-1.0)).and(leaf(0.0)).and(leaf(1.0)), open].map(|scene| {
        let light = bake(&Lit::new(scene, 0.5).surfaces(), &suns, true, &params(256, 1)).unwrap().light;
        [0, 1].map(|step| light.bounced_sun(4, step).x)
    });
    assert!(lit[0] > 0.01 && (shaded[1] / lit[1] - 1.0).abs() < 0.02, "{lit:?} {shaded:?}");
    assert!(shaded[0] < 0.02 * lit[0], "{shaded:?} where {lit:?} comes without the leaves");
}

#[test]
fn coloured_walls_tint_and_grey_ones_do_not() {
    struct Red;
    impl heliodon_light::SurfaceAlbedo for Red {
        fn albedo(&self, _: u32, _: f32, _: f32) -> Vec3 {
            Vec3::new(0.8, 0.2, 0.1)
        }
        fn mean(&self, t: u32) -> Vec3 {
            self.albedo(t, 0.0, 0.0)
        }
    }
    let lit = Lit::new(ground(2.0, 6).and(rectangle(Vec3::new(0.0, 0.0, 1.0), Vec3::NEG_Z * 2.0, Vec3::Y, 6)), 0.5);
    let surfaces = heliodon_light::Surfaces { albedo: &Red, ..lit.surfaces() };
    let params = LightParams { channels: Channels::Rgb, ..params(128, 2) };
    let baked = bake(&surfaces, &[Vec3::Y], true, &params).unwrap();
    baked.light.validate().unwrap();
    let foot = vertex_at(&lit, Vec3::new(-0.3, 0.0, 0.0), Vec3::Y);
    let mut sky = [Vec3::ZERO; 4];
    sky[0] = Vec3::splat(UNIFORM_SKY);
    let light = baked.light.sky_light(foot, &sky);
    assert!(light.x > light.y && light.y > light.z, "{light}");
    let grey = bake(&lit.surfaces(), &[], false, &params).unwrap().light.sky_light(foot, &sky);
    assert!(grey.x == grey.y && grey.y == grey.z, "{grey}");
}
