//! What is stated comes: flux through a sphere around each light, and amounts in each unit.

use crate::scenes::{Dice, disc, light, measured, mesh, point, rectangle, spot, sun};
use glam::Vec3;
use heliodon_lightmap::lights::{Amount, Light, LightSpec, NoFiles, Photometry};
use heliodon_math::color::luminance;
use heliodon_math::random::Pcg32;
use heliodon_math::sphere::fibonacci_sphere;
use std::f64::consts::PI;

/// Flux through a sphere of that radius, from the light that its inside receives.
fn flux_through_sphere(light: &Light, radius: f32) -> f64 {
    let directions = fibonacci_sphere(40_000);
    let sum: f64 = directions.iter().map(|&d| f64::from(luminance(light.closed_form(d * radius, -d).unwrap()))).sum();
    sum * PI * 4.0 * PI * f64::from(radius).powi(2) / directions.len() as f64
}

#[test]
fn all_of_the_flux_arrives_on_a_sphere_around() {
    let lumens = Amount::FluxLm(800.0);
    let mut dice = Dice(Pcg32::new(31, 1));
    let mut specs: Vec<LightSpec> = Vec::new();
    for both in [false, true] {
        specs.push(rectangle(dice.corners(0.6), both, lumens));
        specs.push(disc(dice.place(0.5), dice.place(0.5), 0.4, both, lumens));
        specs.push(mesh("pane", both, lumens));
    }
    for angle in [30.0, 90.0, 180.0, 360.0] {
        specs.extend([0.0, 0.3, 1.0].map(|edge| spot(dice.place(0.5), dice.place(0.5), angle, edge, lumens)));
    }
    specs.extend([point(dice.place(0.5), lumens), mesh("lamp", false, lumens), mesh("globe", false, lumens)]);
    specs.extend([0.0, 33.0].map(|turn| measured(dice.place(0.5), dice.place(0.5), turn, Some(lumens))));
    for spec in specs {
        let light = light(&spec);
        let got = flux_through_sphere(&light, 2.0);
        // sharp cones cut the lattice's cells
        assert!((got / 800.0 - 1.0).abs() < 0.01, "{spec:?}: {got}");
        assert!((f64::from(luminance(light.power(1.0))) / 800.0 - 1.0).abs() < 1e-5);
    }
}

#[test]
fn a_file_gives_the_lumens_that_it_holds() {
    let light = light(&measured([0.0; 3], [0.0, -1.0, 0.0], 0.0, None));
    let stated = f64::from(luminance(light.power(1.0)));
    assert!((flux_through_sphere(&light, 1.0) / stated - 1.0).abs() < 1e-3);
    // nadir: 100 cd, multiplier 2, ballast 0.9; over pi
    let below = luminance(light.closed_form(Vec3::NEG_Y * 3.0, Vec3::Y).unwrap());
    assert!((f64::from(below) * 9.0 * PI / 180.0 - 1.0).abs() < 1e-5);
    // 40 degrees towards north: horizontal angle 90
    let north = Vec3::new(0.0, -libm::cosf(0.698_131_7), -libm::sinf(0.698_131_7));
    let e = luminance(light.closed_form(north, -north).unwrap());
    assert!((f64::from(e) * PI / 450.0 - 1.0).abs() < 1e-4, "{e}");
}

#[test]
fn units_of_one_light_agree() {
    let e = |spec: &LightSpec| luminance(light(spec).closed_form(Vec3::new(0.2, -3.0, 0.1), Vec3::Y).unwrap());
    let same = |a: LightSpec, b: LightSpec| {
        let (a, b) = (e(&a), e(&b));
        assert!(a > 0.0 && (a / b - 1.0).abs() < 1e-5, "{a} {b}");
    };
    let at = [0.0; 3];
    same(point(at, Amount::FluxLm(4.0 * PI)), point(at, Amount::IntensityCd(1.0)));
    let corners = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 0.0, 0.5]];
    same(rectangle(corners, false, Amount::FluxLm(PI)), rectangle(corners, false, Amount::LuminanceCdM2(1.0)));
    same(rectangle(corners, true, Amount::FluxLm(2.0 * PI)), rectangle(corners, false, Amount::IntensityCd(1.0)));
    let up = [0.1, 1.0, 0.0];
    same(sun(up, 0.0, Amount::IlluminanceLx(7.0)), sun(up, 10.0, Amount::IlluminanceLx(7.0)));
    let sine = libm::sin(10.0_f64.to_radians());
    same(sun(up, 10.0, Amount::IlluminanceLx(PI * sine * sine)), sun(up, 10.0, Amount::LuminanceCdM2(1.0)));
}

#[test]
fn a_sun_on_the_horizon_gives_less_than_its_centre_would() {
    // the catalogue of suns: half of a wide one is below the horizon of a surface that its centre grazes
    let soft = light(&sun([1.0, 0.0, 0.0], 20.0, Amount::IlluminanceLx(1.0)));
    let grazing = soft.closed_form(Vec3::ZERO, Vec3::Y).unwrap();
    assert!(luminance(grazing) > 0.0);
    assert_eq!(soft.closed_form(Vec3::ZERO, Vec3::new(-0.5, 0.866_025_4, 0.0)), Some(Vec3::ZERO));
    // well above the horizon the disc gives exactly what its centre does
    let normal = Vec3::new(0.8, 0.6, 0.0);
    let sharp = light(&sun([1.0, 0.0, 0.0], 0.0, Amount::IlluminanceLx(1.0)));
    let (a, b) = (soft.closed_form(Vec3::ZERO, normal).unwrap(), sharp.closed_form(Vec3::ZERO, normal).unwrap());
    assert!((a - b).abs().max_element() < 1e-6);
}

#[test]
fn the_houses_unit_is_that_of_its_skies_and_radiometric_values_stand_as_given() {
    let spec = sun([0.0, 1.0, 0.0], 0.0, Amount::IlluminanceLx(100_000.0));
    let noon = Light::new(&spec, Photometry::HOUSE, &NoFiles).unwrap();
    // 100 klx on flat ground, over pi
    assert!((f64::from(luminance(noon.closed_form(Vec3::ZERO, Vec3::Y).unwrap())) * PI - 100.0).abs() < 1e-4);
    let spec = point([0.0, 1.0, 0.0], Amount::RadiantIntensity(PI));
    for photometry in [Photometry::HOUSE, Photometry::RADIANCE_WHITE] {
        let lamp = Light::new(&spec, photometry, &NoFiles).unwrap();
        assert!((lamp.closed_form(Vec3::ZERO, Vec3::Y).unwrap() - Vec3::new(1.0, 0.8, 0.5)).length() < 1e-6);
    }
}
