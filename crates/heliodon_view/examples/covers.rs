//! Makes a picture of a bundle in which parts or things are covered, faded or marked, as scripts do it while a site is visited.
//!
//! `cargo run -p heliodon_view --example covers BUNDLE OUT.png HH:MM EYE TARGET [NAME=LOOK]...`: places as `x,y,z`, metres; a look is `gold`, `ivory`, a part of
//! one on its way (`gold:0.5`), `fade:0.5` or `mark`. Without a name it lists those that there are.

#![expect(clippy::print_stdout, reason = "an example speaks to people")]

use bevy::time::TimeUpdateStrategy;
use glam::Vec3;
use heliodon_bundle::BundleReader;
use heliodon_bundle::site::{Material, TimeOfDay};
use heliodon_view::Pose;
use heliodon_view::covering::Covering;
use heliodon_view::headless::{RenderOptions, Renderer, Shot};
use std::error::Error;
use std::time::Duration;

fn material(name: &str) -> Option<Material> {
    let (albedo, grain, metal) = match name {
        "gold" => ([1.0, 0.78, 0.34], 0.0, 1.0),
        "ivory" => ([0.85, 0.78, 0.62], 0.3, 0.0),
        _ => return None,
    };
    Some(Material { name: name.to_owned(), albedo, grain, metal })
}

fn place(text: &str) -> Result<Vec3, Box<dyn Error>> {
    let numbers: Vec<f32> = text.split(',').map(str::parse).collect::<Result<_, _>>()?;
    Ok(Vec3::from(<[f32; 3]>::try_from(numbers).map_err(|_| format!("{text} is no place: x,y,z"))?))
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [bundle, out, time, eye, target, looks @ ..] = &arguments[..] else {
        return Err("covers BUNDLE OUT.png HH:MM EYE TARGET [NAME=LOOK]...".into());
    };
    if looks.is_empty() {
        let reader = BundleReader::open(bundle)?;
        reader.manifest().parts.iter().for_each(|part| println!("{}", part.name));
        reader.actors().iter().for_each(|actor| println!("{}", actor.display_name()));
    }
    let clock_s = f64::from(time.parse::<TimeOfDay>()?.seconds());
    let mut renderer = Renderer::new(bundle, 960, 720, RenderOptions::film())?;
    let shot = Shot { pose: Pose::looking(place(eye)?, place(target)?), ..renderer.home_shot(clock_s) };
    // Materials take a second, of which as much passes as is asked for.
    let mut part = 1.0;
    for look in looks {
        let (name, look) = look.split_once('=').ok_or_else(|| format!("{look} is no NAME=LOOK"))?;
        let (look, much) = look.split_once(':').unwrap_or((look, "1"));
        let mut covering = renderer.app_mut().world_mut().resource_mut::<Covering>();
        match (look, material(look)) {
            ("fade", _) => covering.fade(name, much.parse()?, 0.0),
            ("mark", _) => covering.highlight(name, true),
            (_, Some(material)) => {
                covering.cover(name, material, 1.0);
                part = much.parse::<f32>()?.min(part);
            }
            _ => return Err(format!("{look} is neither gold, ivory, fade nor mark").into()),
        }
    }
    // Bevy lets no more than a quarter of a second pass in a frame.
    for seconds in [part / 5.0; 5].into_iter().chain([0.0; 3]) {
        let passes = TimeUpdateStrategy::ManualDuration(Duration::from_secs_f32(seconds));
        renderer.app_mut().insert_resource(passes);
        renderer.render(&shot)?;
    }
    std::fs::write(out, renderer.render(&shot)?.to_png_bytes()?)?;
    Ok(())
}
