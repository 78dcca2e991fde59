//! Prints chromaticities (CIE 1931 x, y) of model skies at the zenith and upright to the sun beside Preetham, Shirley and Smits' zenith ("A Practical Analytic
//! Model for Daylight", SIGGRAPH 1999, appendix A.2): `cargo run -p heliodon_sky --example sky_colors -- [turbidity]`.
#![expect(clippy::print_stdout, reason = "an example reports on stdout")]

use glam::{Mat3, Vec3};
use heliodon_image::HdrImage;
use heliodon_math::sphere::direction_from_azimuth_elevation;
use heliodon_sky::model::{ModelKind, ModelParams, ModelSky};

/// Chromaticity of a linear Rec. 709 colour.
fn xy(color: Vec3) -> (f32, f32) {
    let xyz = Mat3::from_cols_array(&[0.4124, 0.2126, 0.0193, 0.3576, 0.7152, 0.1192, 0.1805, 0.0722, 0.9505]) * color;
    (xyz.x / xyz.element_sum(), xyz.y / xyz.element_sum())
}

fn preetham(turbidity: f32, sun_elevation_deg: f32) -> (f32, f32) {
    let s = (90.0 - sun_elevation_deg).to_radians();
    let (s2, s3) = (s * s, s * s * s);
    let x = turbidity * turbidity * (0.00166 * s3 - 0.00375 * s2 + 0.00209 * s)
        + turbidity * (-0.02903 * s3 + 0.06377 * s2 - 0.03202 * s + 0.00394)
        + (0.11693 * s3 - 0.21196 * s2 + 0.06052 * s + 0.25886);
    let y = turbidity * turbidity * (0.00275 * s3 - 0.00610 * s2 + 0.00317 * s)
        + turbidity * (-0.04214 * s3 + 0.08970 * s2 - 0.04153 * s + 0.00516)
        + (0.15346 * s3 - 0.26756 * s2 + 0.06670 * s + 0.26688);
    (x, y)
}

fn at(map: &HdrImage, azimuth_deg: f32, elevation_deg: f32) -> Vec3 {
    let x = ((azimuth_deg / 360.0 + 0.5).rem_euclid(1.0) * map.width as f32) as u32;
    let y = ((90.0 - elevation_deg) / 180.0 * map.height as f32) as u32;
    map.pixel(x.min(map.width - 1), y.min(map.height - 1))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let turbidity = std::env::args().nth(1).and_then(|t| t.parse().ok()).unwrap_or(2.0);
    let make = |kind| ModelSky::new(&ModelParams { kind, turbidity, ..ModelParams::default() });
    let skies = [make(ModelKind::Atmosphere)?, make(ModelKind::HosekWilkie)?];
    println!(
        "turbidity {turbidity}; x y of: atmosphere zenith, 40 above the far horizon, 3 above it, Y; the same of Hosek and Wilkie; Preetham's zenith"
    );
    for elevation in [5.0_f32, 10.0, 20.0, 30.0, 45.0, 60.0, 75.0] {
        let sun = direction_from_azimuth_elevation(0.0, f64::from(elevation).to_radians());
        print!("{elevation:>4}:");
        for sky in &skies {
            let map = sky.map(sun, 512, 256);
            for (azimuth, height) in [(180.0, 89.5), (180.0, 40.0), (180.0, 3.0)] {
                let (x, y) = xy(at(&map, azimuth, height));
                print!(" {x:.3} {y:.3},");
            }
            print!(" Y {:.2} |", heliodon_math::color::luminance(at(&map, 180.0, 89.5)));
        }
        let (x, y) = preetham(turbidity, elevation);
        println!(" {x:.3} {y:.3}");
    }
    // the glow: radiance at the sun's own height, by the angle from it, over that at 90 degrees
    println!(
        "luminance on the sun's parallel over that 90 degrees from the sun, at 3, 5, 10, 20, 40, 60 degrees: atmosphere | Hosek and Wilkie"
    );
    for elevation in [5.0_f32, 10.0, 20.0, 30.0, 45.0] {
        let sun = direction_from_azimuth_elevation(0.0, f64::from(elevation).to_radians());
        print!("{elevation:>4}:");
        for sky in &skies {
            let map = sky.map(sun, 1024, 512);
            let luminance = |apart_deg: f32| {
                let half = (0.5 * apart_deg).to_radians().sin() / elevation.to_radians().cos();
                heliodon_math::color::luminance(at(&map, 2.0 * half.min(1.0).asin().to_degrees(), elevation))
            };
            for apart in [3.0, 5.0, 10.0, 20.0, 40.0, 60.0] {
                print!(" {:.2}", luminance(apart) / luminance(90.0));
            }
            print!(" |");
        }
        println!();
    }
    let cie = |deg: f32| {
        let g = deg.to_radians();
        1.0 + 10.0 * ((-3.0 * g).exp() - (-1.5 * std::f32::consts::PI).exp()) + 0.45 * g.cos() * g.cos()
    };
    print!("CIE clear sky (ISO 15469, type 12):");
    for apart in [3.0, 5.0, 10.0, 20.0, 40.0, 60.0] {
        print!(" {:.2}", cie(apart) / cie(90.0));
    }
    println!();
    Ok(())
}
