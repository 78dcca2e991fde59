//! `heliodon bench frame`: how long the viewer's frames take.

use super::{Figures, figures};
use crate::failure::wrong_arguments;
use crate::swarming::Particles;
use crate::{acting, values};
use anyhow::Result;
use glam::Vec3;
use heliodon_bundle::{BundleReader, display};
use heliodon_mesh::Mesh;
use heliodon_view::Pose;
use heliodon_view::bench::{FrameBench, frame_times};
use heliodon_view::impostor::Views;

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
    /// For frame: which views of impostors are shown
    #[arg(long, value_enum, value_name = "VIEWS", default_value = "blended")]
    impostors: ImpostorViews,
    /// For frame: impostors cast no shadows
    #[arg(long)]
    no_impostor_shadows: bool,
    /// For frame: how many impostors cast shadows, the nearest [default: all]
    #[arg(long, value_name = "N", conflicts_with = "no_impostor_shadows")]
    impostor_shadows: Option<u32>,
    /// For frame: the bundle's films are left out
    #[arg(long)]
    no_films: bool,
    /// For frame: who simulates sources of very many particles
    #[arg(long, value_enum, value_name = "BY", default_value_t)]
    particles: Particles,
    /// For frame: particles that the processor draws at most [default: 12000]
    #[arg(long, value_name = "N")]
    most_particles: Option<usize>,
    /// For frame: the day stands still
    #[arg(long)]
    paused: bool,
    /// For frame: samples of a pixel: 1, 2, 4 or 8
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = values::samples)]
    msaa: u32,
    /// For frame: size of a picture
    #[arg(long, value_name = "WxH", default_value = "1024x768", value_parser = values::size)]
    size: values::Size,
    /// For frame: two pictures a frame, one for each eye, in so many passes [default: auto]
    #[arg(long, value_enum, value_name = "PASSES", num_args = 0..=1, default_missing_value = "auto")]
    stereo: Option<Passes>,
}

/// Which views of impostors are shown.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum ImpostorViews {
    /// Those around the eye
    Blended,
    /// The nearest alone
    Nearest,
}

/// In how many passes both eyes are drawn.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Passes {
    /// One where it is quicker
    Auto,
    /// One where the device can
    One,
    /// One for each eye
    Two,
}

impl From<Passes> for display::Passes {
    fn from(passes: Passes) -> Self {
        match passes {
            Passes::Auto => Self::Auto,
            Passes::One => Self::One,
            Passes::Two => Self::Two,
        }
    }
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
    let stereo = asked.stereo.map(display::Passes::from);
    let (values::Size { width, height }, samples) = (asked.size, asked.msaa);
    let (playing, swaying) = (!asked.paused, asked.moving);
    let mut bench = FrameBench { width, height, samples, playing, swaying, stereo, pose, ..FrameBench::default() };
    asked.acting.apply(&mut bench.actors);
    if let Some(frames) = args.walk.frames {
        (bench.frames, bench.warm_up) = (frames, bench.warm_up.min(frames));
    }
    bench.without_films = asked.no_films;
    bench.particles = asked.particles.into();
    bench.most_particles = asked.most_particles.unwrap_or(bench.most_particles);
    bench.impostors.casters = if asked.no_impostor_shadows { 0 } else { asked.impostor_shadows.unwrap_or(u32::MAX) };
    bench.impostors.views = match asked.impostors {
        ImpostorViews::Blended => Views::Blended,
        ImpostorViews::Nearest => Views::Nearest,
    };
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
        if let Some(passes) = times.stereo_passes {
            figures.more.insert("stereo_passes".to_owned(), f64::from(passes));
        }
        let told = times.actors;
        if told.actors > 0 {
            figures.more.insert("actors_directions".to_owned(), told.directions as f64);
            figures.more.insert("actors_vertices".to_owned(), told.vertices as f64);
            figures.more.insert("actors_ms".to_owned(), f64::from(told.ms));
        }
        let told = times.particles;
        if told.sources > 0 {
            figures.more.insert("particles".to_owned(), told.particles as f64);
            figures.more.insert("particles_by_device".to_owned(), told.by_device as f64);
            figures.more.insert("particles_ms".to_owned(), f64::from(told.ms));
        }
        if times.films.films > 0 {
            figures.more.insert("films".to_owned(), times.films.films as f64);
            figures.more.insert("films_shown".to_owned(), times.films.shown as f64);
            figures.more.insert("films_missed".to_owned(), times.films.missed as f64);
            figures.more.insert("films_ms".to_owned(), f64::from(times.films.ms));
        }
        figures.scene = format!("{} on {}", figures.scene.split(" on ").next().unwrap_or_default(), times.device);
    }
    figures.more.insert("empty_scene_ms".to_owned(), empty.mean_ms);
    Ok(figures)
}
