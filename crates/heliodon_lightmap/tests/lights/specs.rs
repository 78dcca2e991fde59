//! Lights in files, and what is wrong with them.

use crate::scenes::{Files, disc, mesh, point, rectangle, spot, sun};
use heliodon_lightmap::lights::{Amount, Light, LightSpec, LightSpecError, NoFiles, Photometry};
use serde::{Deserialize, Serialize};

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct File {
    light: Vec<LightSpec>,
}

const SITE: &str = r#"
[[light]]
kind = "point"
name = "oil lamp"
place = [1, 2, 3]
colour = [1.0, 0.6, 0.2]
amount = { flux_lm = 12 }

[[light]]
kind = "spot"
place = [0, 3, 0]
look_at = [0, 0, 0]
angle_deg = 40
amount = { intensity_cd = 500 }

[[light]]
kind = "ies"
file = "lamps/street.ies"
place = [0, 3, 0]
factor = 0.8

[[light]]
kind = "directional"
direction = [1, 1, 0]
angular_radius_deg = 0.2665
amount = { illuminance_lx = 100000 }

[[light]]
kind = "rectangle"
corners = [[0, 1, 0], [1, 1, 0], [0, 2, 0]]
two_sided = true
amount = { luminance_cd_m2 = 3000 }

[[light]]
kind = "disc"
place = [0, 3, 0]
look_at = [0, 0, 0]
radius_m = 0.2
amount = { radiant_flux = 3 }

[[light]]
kind = "mesh"
file = "globe"
amount = { radiance = 2.5 }
"#;

#[test]
fn lights_are_read_from_toml_and_written_back() {
    let file: File = toml::from_str(SITE).unwrap();
    assert_eq!(file.light.len(), 7);
    for spec in &file.light {
        Light::new(spec, Photometry::default(), &Files).unwrap();
        let moved = spec.relative_to([100.0, 0.0, -5.0]);
        moved.validate().unwrap();
        assert_eq!(moved.relative_to([-100.0, 0.0, 5.0]), *spec);
    }
    assert_eq!(file.light[0].name(), Some("oil lamp"));
    assert_eq!(file.light[2].file(), Some("lamps/street.ies"));
    let written = toml::to_string(&file).unwrap();
    assert_eq!(toml::from_str::<File>(&written).unwrap(), file);
}

#[test]
fn slips_in_files_are_refused() {
    for slip in ["colour", "flux_lm", "place"] {
        let broken = SITE.replacen(slip, &format!("{slip}x"), 1);
        assert!(toml::from_str::<File>(&broken).is_err(), "{slip}");
    }
    assert!(toml::from_str::<File>(&SITE.replacen("\"point\"", "\"lava\"", 1)).is_err());
    assert!(toml::from_str::<File>(&SITE.replacen("{ flux_lm = 12 }", "{ flux_lm = 12, radiance = 3 }", 1)).is_err());
}

fn field_of(spec: &LightSpec) -> &'static str {
    match Light::new(spec, Photometry::default(), &Files) {
        Err(error @ LightSpecError::Field { field, .. }) => {
            assert!(error.to_string().contains(field) && error.to_string().contains("must be"), "{error}");
            field
        }
        Err(LightSpecError::Unit { unit, .. }) => unit,
        Err(LightSpecError::File { .. }) => "file",
        Ok(_) => "nothing",
    }
}

#[test]
fn every_field_out_of_range_is_named() {
    let (zero, down) = ([0.0; 3], [0.0, -1.0, 0.0]);
    let lumens = Amount::FluxLm(1.0);
    for bad in [f64::NAN, f64::INFINITY, -1.0, -f64::MIN_POSITIVE, 1e300] {
        assert_eq!(field_of(&point(zero, Amount::FluxLm(bad))), "flux_lm", "{bad}");
        assert_eq!(field_of(&rectangle([zero, [1.0, 0.0, 0.0], down], false, Amount::Radiance(bad))), "radiance");
        assert_eq!(field_of(&sun(down, 1.0, Amount::IlluminanceLx(bad))), "illuminance_lx");
        assert_eq!(field_of(&spot(zero, down, bad, 0.0, lumens)), "angle_deg");
        assert_eq!(field_of(&spot(zero, down, 30.0, bad, lumens)), "edge");
        assert_eq!(field_of(&disc(zero, down, bad, false, lumens)), "radius_m");
        assert_eq!(field_of(&sun(down, bad, Amount::IlluminanceLx(1.0))), "angular_radius_deg");
        let mut coloured = point(zero, lumens);
        if let LightSpec::Point(s) = &mut coloured {
            s.colour[1] = bad;
        }
        assert_eq!(field_of(&coloured), "colour");
    }
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        assert_eq!(field_of(&point([0.0, bad, 0.0], lumens)), "place");
        assert_eq!(field_of(&rectangle([zero, [bad, 0.0, 0.0], down], false, lumens)), "corners");
    }
    assert_eq!(field_of(&spot(zero, down, 0.0, 0.0, lumens)), "angle_deg");
    assert_eq!(field_of(&spot(zero, down, 361.0, 0.0, lumens)), "angle_deg");
    assert_eq!(field_of(&spot(zero, zero, 30.0, 0.0, lumens)), "look_at");
    assert_eq!(field_of(&sun(zero, 0.0, Amount::IlluminanceLx(1.0))), "direction");
    assert_eq!(field_of(&disc(zero, down, 0.0, false, lumens)), "radius_m");
    // no area, and no right angle
    assert_eq!(field_of(&rectangle([zero, zero, down], false, lumens)), "corners");
    assert_eq!(field_of(&rectangle([zero, down, down], false, lumens)), "corners");
    assert_eq!(field_of(&rectangle([zero, [1.0, 0.0, 0.0], [0.1, 1.0, 0.0]], false, lumens)), "corners");
    // light beyond single precision
    assert_eq!(field_of(&disc(zero, down, 1e-12, false, Amount::FluxLm(1e15))), "amount");
    assert_eq!(field_of(&point(zero, Amount::FluxLm(0.0))), "nothing");
}

#[test]
fn units_that_say_nothing_of_a_light_are_refused() {
    let (zero, down) = ([0.0; 3], [0.0, -1.0, 0.0]);
    assert_eq!(field_of(&point(zero, Amount::LuminanceCdM2(1.0))), "luminance_cd_m2");
    assert_eq!(field_of(&point(zero, Amount::Irradiance(1.0))), "irradiance");
    assert_eq!(field_of(&sun(down, 0.0, Amount::LuminanceCdM2(1.0))), "luminance_cd_m2");
    assert_eq!(field_of(&sun(down, 1.0, Amount::FluxLm(1.0))), "flux_lm");
    assert_eq!(field_of(&mesh("lamp", false, Amount::IntensityCd(1.0))), "intensity_cd");
    let error = Light::new(&point(zero, Amount::LuminanceCdM2(1.0)), Photometry::HOUSE, &NoFiles).unwrap_err();
    let told = "light of kind point: luminance_cd_m2 says nothing for a point light; give its amount as flux_lm, intensity_cd, \
                radiant_flux or radiant_intensity";
    assert_eq!(error.to_string(), told);
}

#[test]
fn files_that_are_missing_are_named() {
    let spec = mesh("nowhere.glb", false, Amount::FluxLm(1.0));
    let error = Light::new(&spec, Photometry::HOUSE, &Files).unwrap_err();
    assert_eq!(error.to_string(), "light of kind mesh: file \"nowhere.glb\": is not there: check its name");
    let blind = Photometry { lumens_per_unit: 0.0 };
    assert!(Light::new(&point([0.0; 3], Amount::FluxLm(1.0)), blind, &NoFiles).is_err());
}
