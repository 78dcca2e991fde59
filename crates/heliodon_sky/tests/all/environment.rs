//! Environments as the light sphere sees them.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

use glam::{Quat, Vec3};
use heliodon_image::HdrImage;
use heliodon_math::light_sphere::LightSphere;
use heliodon_sky::environment::{Environment, blur_rad};
use heliodon_sky::mapping::{Geometry, Mapping};
use heliodon_sky::probe::Probe;
use std::f32::consts::{FRAC_PI_2, PI};

fn lat_long(width: u32, radiance: impl Fn(Vec3) -> Vec3) -> HdrImage {
    let geometry = Geometry::new(Mapping::LatLong, width, width / 2, 0.0).unwrap();
    HdrImage::from_fn(width, width / 2, |x, y| {
        radiance(geometry.direction(f64::from(x) + 0.5, f64::from(y) + 0.5).unwrap().as_vec3())
    })
}

#[test]
fn an_even_environment_is_even_at_every_level() {
    for (width, level) in [(2, 0), (64, 1), (512, 3), (512, 5)] {
        let sphere = LightSphere::new(level);
        let environment = Environment::from_lat_long(lat_long(width, |_| Vec3::new(1.0, 2.0, 0.5)));
        let sigma = blur_rad(sphere.directions().len());
        for l in environment.radiance(sphere.directions(), sphere.weights(), sigma, Quat::IDENTITY) {
            assert!((l / Vec3::new(1.0, 2.0, 0.5) - 1.0).abs().max_element() < 1e-5, "{width} {level}: {l}");
        }
    }
}

#[test]
fn no_light_is_lost_and_it_stays_where_it_was() {
    // A lamp of 3 degrees, to the west of the zenith, in a dim sky.
    let lamp = Vec3::new(-0.6, 0.8, 0.0);
    let map = lat_long(1024, |d| Vec3::splat(if d.dot(lamp) > 3f32.to_radians().cos() { 1000.0 } else { 0.1 }));
    let flux = 0.1 * 4.0 * PI + 999.9 * 2.0 * PI * (1.0 - 3f32.to_radians().cos());
    let environment = Environment::from_lat_long(map);
    for level in 2..=5 {
        let sphere = LightSphere::new(level);
        let sigma = blur_rad(sphere.directions().len());
        let radiance = environment.radiance(sphere.directions(), sphere.weights(), sigma, Quat::IDENTITY);
        let sum: f32 = radiance.iter().zip(sphere.weights()).map(|(l, w)| l.x * w).sum();
        assert!((sum / flux - 1.0).abs() < 0.01, "level {level}: {sum} of {flux}");
        let mean: Vec3 =
            sphere.directions().iter().zip(&radiance).zip(sphere.weights()).map(|((&d, l), w)| d * (l.x * w)).sum();
        assert!(mean.angle_between(lamp) < 0.5 * sigma as f32, "level {level}: {mean}");
    }
}

#[test]
fn turning_the_object_is_looking_the_other_way() {
    let map = lat_long(256, |d| Vec3::new(1.0 + d.x, 1.0 + d.y, 1.0 + d.z));
    let environment = Environment::from_lat_long(map);
    let sphere = LightSphere::new(2);
    let turn = Quat::from_rotation_y(FRAC_PI_2);
    let look = |turn| environment.radiance(sphere.directions(), sphere.weights(), 0.1, turn);
    let (still, turned) = (look(Quat::IDENTITY), look(turn));
    for (j, &d) in sphere.directions().iter().enumerate() {
        let same = sphere.directions().iter().position(|&other| (other - turn * d).length() < 1e-5).unwrap();
        assert!((turned[j] - still[same]).length() < 0.01, "{d}");
    }
}

#[test]
fn probes_of_all_mappings_shine_alike() {
    let sky = |d: Vec3| Vec3::new(1.0 + d.y, 1.0 + 0.5 * d.x, 1.0);
    let sphere = LightSphere::new(2);
    let look = |environment: &Environment| environment.radiance(sphere.directions(), sphere.weights(), 0.2, Quat::IDENTITY);
    let expected = look(&Environment::from_lat_long(lat_long(512, sky)));
    for (mapping, width, height) in [
        (Mapping::Angular, 256, 256),
        (Mapping::CubeCross, 192, 256),
        (Mapping::CubeCross, 256, 192),
        (Mapping::CubeCross, 384, 64),
        (Mapping::CubeCross, 64, 384),
    ] {
        let geometry = Geometry::new(mapping, width, height, 0.0).unwrap();
        let image = HdrImage::from_fn(width, height, |x, y| {
            geometry.direction(f64::from(x) + 0.5, f64::from(y) + 0.5).map_or(Vec3::ZERO, |d| sky(d.as_vec3()))
        });
        let environment = Environment::from_probe(&Probe::new(image, mapping, 0.0).unwrap());
        for (got, wanted) in look(&environment).iter().zip(&expected) {
            assert!((*got - *wanted).abs().max_element() < 0.02, "{mapping:?}: {got} {wanted}");
        }
    }
}

#[test]
fn nothing_shines_from_an_empty_map() {
    let sphere = LightSphere::new(0);
    for map in [HdrImage::filled(0, 0, Vec3::ZERO), HdrImage::filled(4, 2, Vec3::ZERO)] {
        let radiance = Environment::from_lat_long(map).radiance(sphere.directions(), sphere.weights(), 0.5, Quat::IDENTITY);
        assert_eq!(radiance, vec![Vec3::ZERO; 6]);
    }
}
