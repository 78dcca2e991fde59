//! `heliodon bench frame`: how long the viewer's frames take.

use super::{Figures, figures};
use crate::failure::wrong_arguments;
use crate::{acting, values};
use anyhow::Result;
use glam::Vec3;
use heliodon_bundle::BundleReader;
use heliodon_mesh::Mesh;
use heliodon_view::Pose;
use heliodon_view::bench::{FrameBench, frame_times};

/// What is seen, and how.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    acting: acting::Args,
    /// For frame: where the eye is, metres [default: the first room's middle]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::point, allow_hyphen_values = true, requires = "look")]
    eye: Option<Vec3>,
    /// For frame: what it looks at [default: what the room looks at]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::point, allow_hyphen_values = true, requires = "eye")]
    look: Option<Vec3>,
    /// For frame: the eye moves in every frame
    #[arg(long)]
    moving: bool,
    /// For frame: the day stands still
    #[arg(long)]
    paused: bool,
    /// For frame: two pictures a frame, one for each eye
    #[arg(long)]
    stereo: bool,
}

/// Frames of a bundle, and the memory that an empty scene needs in the same program.
pub fn run(args: &super::Args) -> Result<Figures> {
    let Some(folder) = &args.input else { wrong_arguments!("name a bundle: heliodon bench frame BUNDLE") };
    let bundle = BundleReader::open(folder)?;
    let mut figures = figures(args, bundle.manifest().site.name.clone(), &Mesh::default());
    (figures.vertices, figures.triangles) = (bundle.vertex_count(), bundle.triangle_count());
    drop(bundle);
    let asked = args.frame;
    let pose = asked.eye.zip(asked.look).map(|(eye, look)| Pose::looking(eye, look));
    let mut bench =
        FrameBench { playing: !asked.paused, swaying: asked.moving, stereo: asked.stereo, pose, ..FrameBench::default() };
    asked.acting.apply(&mut bench.actors);
    let empty = frame_times(None, bench)?;
    for _ in 0..args.runs {
        let times = frame_times(Some(folder), bench)?;
        figures.seconds.push(times.mean_ms / 1e3);
        if let (Some(with), Some(without)) = (times.resident_bytes, empty.resident_bytes) {
            figures.more.insert("resident_bytes_beyond_an_empty_scene".to_owned(), with as f64 - without as f64);
        }
        if let Some(ms) = times.processor_ms {
            figures.more.insert("processor_ms".to_owned(), ms);
        }
        let told = times.actors;
        if told.actors > 0 {
            figures.more.insert("actors_directions".to_owned(), told.directions as f64);
            figures.more.insert("actors_vertices".to_owned(), told.vertices as f64);
            figures.more.insert("actors_ms".to_owned(), f64::from(told.ms));
        }
        figures.scene = format!("{} on {}", figures.scene.split(" on ").next().unwrap_or_default(), times.device);
    }
    figures.more.insert("empty_scene_ms".to_owned(), empty.mean_ms);
    Ok(figures)
}
