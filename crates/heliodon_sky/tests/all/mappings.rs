//! The five mappings: both ways, solid angles, coefficients, conversion.

use glam::{DVec3, Vec3};
use heliodon_image::HdrImage;
use heliodon_math::sphere::fibonacci_sphere;
use heliodon_sky::mapping::{BelowHorizon, Geometry, Mapping, ProbeGrid};
use heliodon_sky::probe::Probe;
use std::f64::consts::PI;

const FISHEYE: Mapping = Mapping::Fisheye { opening_deg: 180.0 };

fn all(scale: u32) -> Vec<(Mapping, u32, u32)> {
    vec![
        (Mapping::LatLong, 2 * scale, scale),
        (Mapping::Angular, scale, scale),
        (Mapping::Angular, scale + 7, scale),
        (Mapping::MirrorBall, scale, scale),
        (FISHEYE, scale, scale),
        (Mapping::Fisheye { opening_deg: 360.0 }, scale, scale),
        (Mapping::CubeCross, 3 * scale, 4 * scale),
        (Mapping::CubeCross, 4 * scale, 3 * scale),
        (Mapping::CubeCross, 6 * scale, scale),
        (Mapping::CubeCross, scale, 6 * scale),
    ]
}

#[test]
fn published_places_are_where_they_belong() {
    let at = |mapping, w, h, d: DVec3| Geometry::new(mapping, w, h, 0.0).unwrap().position(d).unwrap();
    let close = |a: (f64, f64), b: (f64, f64)| assert!((a.0 - b.0).abs() < 1e-9 && (a.1 - b.1).abs() < 1e-9, "{a:?} {b:?}");
    close(at(Mapping::LatLong, 400, 200, DVec3::NEG_Z), (200.0, 100.0));
    close(at(Mapping::LatLong, 400, 200, DVec3::X), (300.0, 100.0));
    close(at(Mapping::Angular, 200, 200, DVec3::NEG_Z), (100.0, 100.0));
    close(at(Mapping::Angular, 200, 200, DVec3::Y), (100.0, 50.0));
    close(at(Mapping::Angular, 200, 200, DVec3::X), (150.0, 100.0));
    close(at(Mapping::MirrorBall, 200, 200, DVec3::X), (100.0 + 100.0 * 0.5_f64.sqrt(), 100.0));
    close(at(FISHEYE, 200, 200, DVec3::Y), (100.0, 100.0));
    close(at(FISHEYE, 200, 200, DVec3::NEG_Z), (100.0, 0.0));
    close(at(FISHEYE, 200, 200, DVec3::X), (0.0, 100.0));
    assert_eq!(Geometry::new(FISHEYE, 200, 200, 0.0).unwrap().position(DVec3::NEG_Y), None);
    close(at(Mapping::CubeCross, 300, 400, DVec3::NEG_Z), (150.0, 150.0));
    close(at(Mapping::CubeCross, 300, 400, DVec3::Y), (150.0, 50.0));
    close(at(Mapping::CubeCross, 300, 400, DVec3::Z), (150.0, 350.0));
    close(at(Mapping::CubeCross, 400, 300, DVec3::Z), (350.0, 150.0));
    close(at(Mapping::CubeCross, 400, 300, DVec3::X), (250.0, 150.0));
    let faces = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::NEG_Z, DVec3::Z];
    for (face, place) in faces.into_iter().zip([50.0, 150.0, 250.0, 350.0, 450.0, 550.0]) {
        close(at(Mapping::CubeCross, 600, 100, face), (place, 50.0));
        close(at(Mapping::CubeCross, 100, 600, face), (50.0, place));
    }
    // seen from inside: south of the east is on its right, north of the nadir above it
    close(at(Mapping::CubeCross, 600, 100, DVec3::new(1.0, 0.0, 0.5)), (75.0, 50.0));
    close(at(Mapping::CubeCross, 600, 100, DVec3::new(0.0, -1.0, -0.5)), (350.0, 25.0));
    // a turn of 90 degrees: what the image calls north lies in the east
    let turned = Geometry::new(Mapping::LatLong, 400, 200, 0.5 * PI).unwrap();
    close(turned.position(DVec3::X).unwrap(), (200.0, 100.0));
    assert!(Geometry::new(Mapping::CubeCross, 300, 300, 0.0).is_err());
    assert!(Geometry::new(Mapping::LatLong, 0, 300, 0.0).is_err());
}

#[test]
fn directions_and_positions_are_inverse() {
    for (mapping, w, h) in all(64) {
        for turn in [0.0, 1.3] {
            let geometry = Geometry::new(mapping, w, h, turn).unwrap();
            for d in fibonacci_sphere(4001) {
                let d = d.as_dvec3().try_normalize().unwrap();
                let Some((x, y)) = geometry.position(d) else {
                    assert!(mapping == FISHEYE && d.y < 0.0, "{mapping:?} hides {d}");
                    continue;
                };
                let back = geometry.direction(x.clamp(0.0, f64::from(w)), y.clamp(0.0, f64::from(h)));
                // at the rim of a disc a rounding may fall outside
                let Some(back) = back else { continue };
                assert!((back - d).length() < 1e-7, "{mapping:?} {d} {back}");
            }
        }
    }
}

#[test]
fn a_cross_is_continuous_where_faces_touch() {
    for (w, h, a, b) in [
        (300, 400, (150.0, 99.999), (150.0, 100.001)),
        (300, 400, (99.999, 130.0), (100.001, 130.0)),
        (300, 400, (199.999, 130.0), (200.001, 130.0)),
        (300, 400, (130.0, 199.999), (130.0, 200.001)),
        (300, 400, (130.0, 299.999), (130.0, 300.001)),
        (400, 300, (299.999, 130.0), (300.001, 130.0)),
    ] {
        let geometry = Geometry::new(Mapping::CubeCross, w, h, 0.0).unwrap();
        let (p, q) = (geometry.direction(a.0, a.1).unwrap(), geometry.direction(b.0, b.1).unwrap());
        assert!((p - q).length() < 1e-4, "{w}x{h} at {a:?}");
    }
}

#[test]
fn solid_angles_sum_to_the_sphere_and_agree_with_small_triangles() {
    for (mapping, w, h) in all(96).into_iter().chain(all(1)).chain(all(2)) {
        let grid = ProbeGrid::new(mapping, w, h, 0.0).unwrap();
        let sum: f64 = grid.solid_angles().iter().map(|&s| f64::from(s)).sum();
        let whole = if mapping == FISHEYE { 2.0 * PI } else { 4.0 * PI };
        assert!((sum / whole - 1.0).abs() < 2e-7, "{mapping:?} {w}x{h}: {sum}");
    }
    // an inner pixel against 64 x 64 quads measured by cross products
    for (mapping, w, h) in all(96) {
        let grid = ProbeGrid::new(mapping, w, h, 0.0).unwrap();
        let geometry = grid.geometry();
        let (x, y) = if mapping == Mapping::CubeCross && w.max(h) < 6 * w.min(h) {
            (w / 3 + 5, h / 3 + 7)
        } else {
            (w / 2 + 9, h / 3 + 2)
        };
        let mut sum = 0.0;
        for j in 0..64 {
            for i in 0..64 {
                let at = |dx: f64, dy: f64| {
                    geometry
                        .direction(f64::from(x) + (f64::from(i) + dx) / 64.0, f64::from(y) + (f64::from(j) + dy) / 64.0)
                        .unwrap()
                };
                let (p, q, r, s) = (at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0));
                sum += 0.5 * ((r - p).cross(s - q)).length();
            }
        }
        let stored = f64::from(grid.solid_angles()[(y * w + x) as usize]);
        assert!((stored / sum - 1.0).abs() < 1e-5, "{mapping:?}: {stored} {sum}");
    }
}

#[test]
fn a_constant_image_of_one_is_the_root_of_four_pi() {
    for (mapping, w, h) in all(192) {
        let probe = Probe::new(HdrImage::filled(w, h, Vec3::ONE), mapping, 0.4).unwrap();
        let below = if mapping == FISHEYE { BelowHorizon::Mirror } else { BelowHorizon::Keep };
        let s = probe.coefficients(9, below);
        assert!((s[0].x - (4.0 * PI).sqrt() as f32).abs() < 1e-5, "{mapping:?}: {}", s[0]);
        for (i, c) in s.iter().enumerate().skip(1) {
            assert!(c.abs().max_element() < 1e-5, "{mapping:?} S{i}: {c}");
        }
    }
}

#[test]
fn a_linear_sky_has_its_exact_coefficients_in_every_mapping() {
    // L = 2 + x + 0.5 y - 0.25 z: S0 = 2 sqrt(4 pi), S1 = sqrt(4 pi / 3) * (y, z, x)
    let sky = |d: DVec3| Vec3::splat((2.0 + d.x + 0.5 * d.y - 0.25 * d.z) as f32);
    let k = (4.0 * PI / 3.0).sqrt() as f32;
    for (mapping, w, h) in all(128) {
        if mapping == FISHEYE {
            continue;
        }
        let geometry = Geometry::new(mapping, w, h, 0.0).unwrap();
        let image = HdrImage::from_fn(w, h, |x, y| {
            geometry.direction(f64::from(x) + 0.5, f64::from(y) + 0.5).map_or(Vec3::splat(1e6), sky)
        });
        let s = Probe::new(image, mapping, 0.0).unwrap().coefficients(4, BelowHorizon::Keep);
        for (got, exact) in s.iter().map(|c| c.x).zip([2.0 * (4.0 * PI).sqrt() as f32, 0.5 * k, -0.25 * k, k]) {
            assert!((got - exact).abs() < 2e-3, "{mapping:?}: {got} {exact}");
        }
    }
}

#[test]
fn black_and_mirrored_lower_halves_count_as_said() {
    let image = HdrImage::from_fn(64, 32, |_, y| if y < 16 { Vec3::ONE } else { Vec3::splat(50.0) });
    let probe = Probe::new(image, Mapping::LatLong, 0.0).unwrap();
    let full = (4.0 * PI).sqrt() as f32;
    let black = probe.coefficients(4, BelowHorizon::Black);
    assert!((black[0].x - 0.5 * full).abs() < 1e-5 && black[1].x > 0.1);
    let mirror = probe.coefficients(4, BelowHorizon::Mirror);
    assert!((mirror[0].x - full).abs() < 1e-5 && mirror[1].x.abs() < 1e-5);
    let map = probe.to_lat_long(64, 32, BelowHorizon::Mirror, &probe);
    assert!(map.pixels.iter().all(|p| (*p - Vec3::ONE).length() < 1e-5));
    let map = probe.to_lat_long(64, 32, BelowHorizon::Black, &probe);
    assert_eq!(map.pixel(3, 31), Vec3::ZERO);
}

#[test]
fn conversion_to_lat_long_keeps_the_light() {
    let sky = |d: DVec3| Vec3::new(1.0 + d.y as f32, 2.0 + (3.0 * d.x * d.z) as f32, 1.0);
    for (mapping, w, h) in all(256) {
        if mapping == FISHEYE {
            continue;
        }
        let geometry = Geometry::new(mapping, w, h, 0.7).unwrap();
        let image =
            HdrImage::from_fn(w, h, |x, y| geometry.direction(f64::from(x) + 0.5, f64::from(y) + 0.5).map_or(Vec3::ZERO, sky));
        let probe = Probe::new(image, mapping, 0.7).unwrap();
        let map = probe.to_lat_long(128, 64, BelowHorizon::Keep, &probe);
        let lat_long = Geometry::new(Mapping::LatLong, 128, 64, 0.0).unwrap();
        for y in 0..64 {
            for x in 0..128 {
                let d = lat_long.direction(f64::from(x) + 0.5, f64::from(y) + 0.5).unwrap();
                let error = (map.pixel(x, y) - sky(d)).abs().max_element();
                // towards its rim a pixel of a mirror ball spans several degrees
                let tolerance = if mapping == Mapping::MirrorBall { 0.1 } else { 0.02 };
                assert!(error < tolerance, "{mapping:?} ({x}, {y}): {error}");
            }
        }
    }
}
