//! Writes tone-mapped pictures of model skies at several heights of the sun, to look at:
//! `cargo run -p heliodon_sky --example sky_strip -- OUT.png [turbidity] [hosek-wilkie]`.
#![expect(clippy::print_stdout, reason = "an example reports on stdout")]

use heliodon_image::{SheetLayout, SrgbImage, contact_sheet};
use heliodon_math::color::{luminance, srgb8_from_linear};
use heliodon_math::sphere::direction_from_azimuth_elevation;
use heliodon_sky::model::{ModelKind, ModelParams, ModelSky};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let out = args.next().unwrap_or_else(|| "sky_strip.png".into());
    let turbidity = args.next().and_then(|t| t.parse().ok()).unwrap_or(2.0);
    let kind = ModelKind::from_name(&args.next().unwrap_or_else(|| "atmosphere".into()))?;
    let start = std::time::Instant::now();
    let sky = ModelSky::new(&ModelParams { kind, turbidity, ..ModelParams::default() })?;
    println!("ready after {:.0?}", start.elapsed());
    let mut pictures = Vec::new();
    for elevation in [-12.0, -8.0, -6.0, -4.0, -2.0, 0.0, 2.0, 5.0, 10.0, 20.0, 40.0, 70.0_f64] {
        let sun = direction_from_azimuth_elevation(0.6, elevation.to_radians());
        let start = std::time::Instant::now();
        let map = sky.map(sun, 512, 256);
        let took = start.elapsed();
        let upper = &map.pixels[..512 * 128];
        let mean = upper.iter().map(|&c| luminance(c)).sum::<f32>() / upper.len() as f32;
        let zenith = map.pixel(256, 0);
        println!(
            "sun {elevation:>5}: mean {mean:.3e} kcd/m2, zenith {zenith:?}, sun {:?}, {took:.0?}",
            sky.sun(sun).map(|s| s.0)
        );
        let scale = 0.35 / mean;
        let pixels = map.pixels.iter().map(|&c| {
            let c = (c * scale).map(|v| 1.0 - (-v).exp());
            [srgb8_from_linear(c.x), srgb8_from_linear(c.y), srgb8_from_linear(c.z), 255]
        });
        pictures.push(SrgbImage { width: 512, height: 256, pixels: pixels.collect() });
    }
    contact_sheet(&pictures, &SheetLayout { columns: 3, ..SheetLayout::default() }).write_png(out)?;
    Ok(())
}
