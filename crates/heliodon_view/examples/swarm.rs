//! Draws a bundle's particles by the processor, which may have as many as there are, and by whatever device draws, for comparison: a picture of each, and how long one takes.
//!
//! `cargo run -p heliodon_view --example swarm BUNDLE FOLDER EYE LOOK [FRAMES]`, with places as `X,Y,Z`: 1024 x 768, the mean of so many pictures of a visit that goes on by a thirtieth of a second, each
//! waited for. Pictures go into the folder.

#![expect(clippy::print_stdout, reason = "an example speaks to people")]

use glam::Vec3;
use heliodon_bundle::BundleReader;
use heliodon_view::Pose;
use heliodon_view::headless::{RenderOptions, Renderer, Shot};
use heliodon_view::particles::{Particles, ParticlesBy};
use std::path::Path;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [bundle, folder, eye, look, more @ ..] = arguments.as_slice() else { return Err("BUNDLE FOLDER EYE LOOK".into()) };
    let place = |text: &str| -> Result<Vec3, Box<dyn std::error::Error>> {
        let numbers: Result<Vec<f32>, _> = text.split(',').map(str::parse).collect();
        Ok(Vec3::from(<[f32; 3]>::try_from(numbers?).map_err(|_| "three numbers are a place")?))
    };
    let pose = Pose::looking(place(eye)?, place(look)?);
    let frames: u32 = more.first().map_or(Ok(20), |text| text.parse())?;
    let reader = BundleReader::open(bundle)?;
    for (name, by) in [("processor", ParticlesBy::Processor), ("device", ParticlesBy::Device)] {
        let prepare = |app: &mut bevy::prelude::App| by.prepare(app, &reader.living().particles);
        let mut renderer = Renderer::with(bundle, [1024, 768], RenderOptions { samples: 1 }, prepare)?;
        renderer.app_mut().world_mut().resource_mut::<Particles>().options.most = usize::MAX;
        let mut shot = Shot { pose, actors_s: 30.0, ..renderer.home_shot(11.0 * 3600.0) };
        // pipelines, and what is there from the beginning
        let mut next = |renderer: &mut Renderer| {
            shot.actors_s += 1.0 / 30.0;
            renderer.render(&shot)
        };
        for frame in 0..40 {
            next(&mut renderer)?;
            let told = renderer.app_mut().world().resource::<Particles>().told();
            if frame > 5 && (told.by_device > 0) == (by == ParticlesBy::Device) {
                break;
            }
        }
        let start = Instant::now();
        for _ in 0..frames {
            next(&mut renderer)?;
        }
        let ms = start.elapsed().as_secs_f64() * 1e3 / f64::from(frames);
        let picture = next(&mut renderer)?;
        let told = renderer.app_mut().world().resource::<Particles>().told();
        println!("{name}: {ms:.1} ms a picture, {told:?}");
        picture.write_png(Path::new(folder).join(format!("{name}.png")))?;
    }
    Ok(())
}
