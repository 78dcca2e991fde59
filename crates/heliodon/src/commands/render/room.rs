//! Pictures and films of a room's screens.

use super::{Args, Tone, Work, usual_samples, write_png};
use crate::App;
use crate::commands::display;
use crate::failure::wrong_arguments;
use crate::files;
use crate::film::{self, Film};
use crate::output::{count, duration};
use crate::studio::spread;
use crate::values::{Exposure, TimeSpan};
use anyhow::Result;
use heliodon_bake::report::Reporter;
use heliodon_view::actors::Actors;
use heliodon_view::film::Films;
use heliodon_view::headless::room::{RoomPictures, RoomRenderer};
use heliodon_view::headless::{RenderOptions, Shot, ShotExposure};
use heliodon_view::navigation::pose::Pose;
use heliodon_view::stage::frame::StageFrame;
use heliodon_view::{Blend, ToneCurve};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// What was made.
#[derive(Serialize)]
struct Rendered {
    files: Vec<PathBuf>,
    pictures: usize,
    seconds: f64,
}

/// The file of one picture: pictures.png is pictures-left.png for the screen `left`.
fn beside(path: &Path, name: &str) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    // A screen's name may be anything.
    let name: String = name.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' }).collect();
    path.with_file_name(format!("{stem}-{name}.{ending}"))
}

/// Runs it.
pub(super) fn run(app: &App, args: &Args, work: Work, display: &Path) -> Result<()> {
    let (times, fps): (Option<TimeSpan>, f64) = (args.time, args.fps);
    let frames = match work {
        Work::Still { .. } => 1,
        Work::Film { frames } => frames,
        Work::Linear { .. } | Work::Sheet { .. } => wrong_arguments!("pictures of a room are .png, films of it .mp4"),
    };
    let mut display = display::read(display)?;
    if let Some(track) = &args.track {
        display = display.with_recording(track, true);
    }
    files::check_place(&args.output)?;
    let begun = Instant::now();
    let options = RenderOptions { samples: args.samples.unwrap_or_else(|| usual_samples(work)) };
    let of = if args.outputs { RoomPictures::Outputs } else { RoomPictures::Eyes };
    let outside = args.preview.then_some((args.size.width, args.size.height));
    app.progress.stage("loading", 0);
    let opened = RoomRenderer::new(&args.bundle, &Arc::new(display), of, outside, options);
    app.progress.finished();
    let mut renderer = opened?;
    args.acting.apply(&mut renderer.app_mut().world_mut().resource_mut::<Actors>().options);
    let mut frame = renderer.app_mut().world_mut().resource_mut::<StageFrame>();
    (frame.without_details, frame.shows_guessed) = (args.no_details, args.guessed);
    let sizes: Vec<_> = renderer.pictures().map(|(name, size)| (beside(&args.output, name), size)).collect();
    let (first, last) = match times {
        None => renderer.day_s(),
        Some(TimeSpan { first, last }) => (f64::from(first.seconds()), f64::from(last.unwrap_or(first).seconds())),
    };
    let shot = |clock_s: f64, seconds: f64| Shot {
        clock_s,
        // The room's own.
        pose: Pose { eye: glam::Vec3::ZERO, yaw_rad: 0.0, pitch_rad: 0.0 },
        fov_deg: 50.0,
        exposure: match args.exposure {
            Exposure::Auto => ShotExposure::Lapse(0.0),
            Exposure::Stops(stops) => ShotExposure::Stops(stops),
        },
        curve: if args.tone == Tone::Filmic { ToneCurve::Filmic } else { ToneCurve::Clamp },
        blend: if args.hard_steps { Blend::Hard } else { Blend::Smooth },
        actors_s: args.actors_time + seconds,
    };
    if frames == 1 {
        for (picture, (path, _)) in renderer.render(&shot(first, 0.0), 0.0)?.iter().zip(&sizes) {
            write_png(path, picture)?;
        }
    } else {
        for (path, size) in &sizes {
            if let Err(error) = film::check_size(size.x, size.y) {
                wrong_arguments!("{}: {error}", path.display());
            }
        }
        let films: Result<Vec<Film>> = sizes.iter().map(|(_, size)| Film::new(size.x, size.y, fps)).collect();
        let mut films = films?;
        app.progress.stage("film", frames as u64);
        for (number, clock_s) in spread(first, last, frames).into_iter().enumerate() {
            let seconds = number as f64 / fps;
            for (film, picture) in films.iter_mut().zip(renderer.render(&shot(clock_s, seconds), seconds)?) {
                film.push(&picture)?;
            }
            app.progress.progress(number as u64 + 1);
        }
        app.progress.finished();
        for (film, (path, _)) in films.into_iter().zip(&sizes) {
            film.finish(path)?;
        }
    }
    let problems = renderer.app_mut().world_mut().resource_mut::<Films>().take_problems();
    problems.iter().for_each(|problem| app.progress.warning(problem));
    let rendered = Rendered {
        files: sizes.into_iter().map(|(path, _)| path).collect(),
        pictures: frames,
        seconds: begun.elapsed().as_secs_f64(),
    };
    app.output.result(&rendered, |rendered| {
        let names: Vec<String> = rendered.files.iter().map(|file| file.display().to_string()).collect();
        let pictures = if rendered.pictures == 1 {
            "a picture".to_owned()
        } else {
            format!("{} pictures", count(rendered.pictures as u64))
        };
        format!("{}: {pictures} each in {}", names.join(", "), duration(rendered.seconds))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_called_by_their_screens() {
        assert_eq!(beside(Path::new("out/room.png"), "left-right"), Path::new("out/room-left-right.png"));
        assert_eq!(beside(Path::new("room.mp4"), "../my wall"), Path::new("room-..-my-wall.mp4"));
    }
}
