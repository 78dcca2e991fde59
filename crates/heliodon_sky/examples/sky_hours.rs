//! Writes the model's sky over Athens on a day of May as the viewer shows it (the lapse's exposure, clamped), lat-long, at sunset, in twilight and at
//! some hours between, and prints how far from the sun the picture is clipped: `cargo run -p heliodon_sky --example sky_hours -- OUT.png [turbidity]`.
#![expect(clippy::print_stdout, reason = "an example reports on stdout")]

use glam::Vec3;
use heliodon_image::{SheetLayout, SrgbImage, contact_sheet};
use heliodon_math::color::srgb8_from_linear;
use heliodon_sky::day::{LapseParams, ModelDay, SkySource, build};
use heliodon_sky::model::ModelParams;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let out = args.next().unwrap_or_else(|| "sky_hours.png".into());
    let mut model = ModelParams::default();
    if let Some(turbidity) = args.next() {
        model.turbidity = turbidity.parse()?;
    }
    let day =
        ModelDay { model, latitude_deg: 37.9715, longitude_deg: 23.7267, utc_offset_hours: 2.0, date: "2023-05-01".parse()? };
    let mut maps = Vec::new();
    let built = build(&LapseParams::new(SkySource::Model(day)), &mut |map| {
        maps.push(map.image.clone());
        Ok(())
    })?;
    let hours = ["04:55", "05:40", "07:00", "09:00", "12:20", "16:00", "18:00", "18:45", "19:10"];
    let mut pictures = Vec::new();
    for hour in hours {
        let Some((step, map)) = built.lapse.steps.iter().zip(&maps).find(|(step, _)| step.time.to_string().as_str() >= hour)
        else {
            continue;
        };
        let scale = step.exposure_stops.exp2();
        let show = |v: f32| srgb8_from_linear((v * scale).min(1.0));
        if let Some(sun) = &step.sun {
            let sun = Vec3::from_array(sun.direction);
            let (w, h) = (f64::from(map.width), f64::from(map.height));
            let mut clipped = [0.0_f64; 2];
            for (i, pixel) in map.pixels.iter().enumerate() {
                let (x, y) = (f64::from(i as u32 % map.width) + 0.5, f64::from(i as u32 / map.width) + 0.5);
                let elevation = (0.5 - y / h) * std::f64::consts::PI;
                let d =
                    heliodon_math::sphere::direction_from_azimuth_elevation((x / w - 0.5) * std::f64::consts::TAU, elevation);
                if elevation > 0.0 && d.dot(sun) > 0.0 {
                    let area = elevation.cos() * std::f64::consts::PI / h * std::f64::consts::TAU / w;
                    clipped[0] += if pixel.max_element() * scale > 1.0 { area } else { 0.0 };
                    clipped[1] += if pixel.min_element() * scale > 1.0 { area } else { 0.0 };
                }
            }
            // the half-angle of a disc of that solid angle
            let [some, all] = clipped.map(|area| (1.0 - area / std::f64::consts::TAU).clamp(-1.0, 1.0).acos().to_degrees());
            println!(
                "{}: clipped as far as a disc of {some:.1} degrees about the sun (one channel), {all:.1} (all three)",
                step.time
            );
        }
        let pixels = map.pixels.iter().map(|c| [show(c.x), show(c.y), show(c.z), 255]).collect();
        pictures.push(SrgbImage { width: map.width, height: map.height, pixels });
    }
    contact_sheet(&pictures, &SheetLayout { columns: 3, ..SheetLayout::default() }).write_png(out)?;
    Ok(())
}
