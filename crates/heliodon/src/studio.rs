//! Where pictures are made: everything of the program that needs the viewer or the reference path tracer.

use crate::acting;
use crate::reference::{self, ReferenceStage};
use crate::values::Exposure;
use anyhow::{Context, Result, bail};
use glam::Vec3;
use heliodon_bundle::BundleReader;
use heliodon_bundle::site::TimeOfDay;
use heliodon_image::{HdrImage, SrgbImage};
use heliodon_light::reference::{Camera, ReferenceFrame};
use heliodon_view::actors::Actors;
use heliodon_view::film::Films;
use heliodon_view::headless::{RenderOptions, Renderer, Shot, ShotExposure};
use heliodon_view::navigation::pose::{Pose, fov_deg};
use heliodon_view::stage::frame::StageFrame;
use heliodon_view::{Blend, ToneCurve, tonemap};
use std::path::Path;

/// What pictures of a bundle look like, but for their hour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The eye; `None` for where a visitor begins.
    pub eye: Option<Vec3>,
    /// What it looks at; `None` for what a visitor looks at.
    pub target: Option<Vec3>,
    /// Vertical opening angle in degrees; `None` for the site's.
    pub fov_deg: Option<f32>,
    /// Exposure.
    pub exposure: Exposure,
    /// Tone curve of 8-bit pictures.
    pub curve: ToneCurve,
    /// How the steps are joined.
    pub blend: Blend,
    /// Samples along each side of a pixel.
    pub samples: u32,
    /// How long actors have acted in the first picture, in seconds.
    pub actors_s: f64,
    /// How they are lit.
    pub acting: acting::Args,
    /// Whether details are switched off.
    pub without_details: bool,
    /// Whether what no photograph saw is shown in blue.
    pub shows_guessed: bool,
}

impl Look {
    /// Pictures as a visitor sees them who just came.
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            eye: None,
            target: None,
            fov_deg: None,
            exposure: Exposure::Auto,
            curve: ToneCurve::Clamp,
            blend: Blend::Smooth,
            samples: RenderOptions::film().samples,
            actors_s: 0.0,
            acting: acting::Args::default(),
            without_details: false,
            shows_guessed: false,
        }
    }
}

/// Draws pictures of one bundle, as the viewer does or as the path tracer does.
pub struct Studio {
    bundle: BundleReader,
    look: Look,
    pose: Pose,
    fov_deg: f32,
    painter: Painter,
}

enum Painter {
    Viewer(Box<Renderer>),
    Reference(Box<ReferenceStage>),
}

impl Studio {
    /// Opens a bundle; with `reference_samples`, its pictures are traced with so many paths a pixel.
    ///
    /// # Errors
    /// If the bundle cannot be read, or pictures of that size cannot be drawn.
    pub fn open(folder: &Path, look: Look, reference_samples: Option<u32>) -> Result<Self> {
        let bundle = BundleReader::open(folder)?;
        let home = Pose::home(bundle.manifest());
        let eye = look.eye.unwrap_or(home.eye);
        let pose = match look.target {
            Some(target) => Pose::looking(eye, target),
            None => Pose { eye, ..home },
        };
        let painter = match reference_samples {
            Some(samples) => Painter::Reference(Box::new(ReferenceStage::new(&bundle, samples)?)),
            None => {
                let options = RenderOptions { samples: look.samples };
                let mut renderer = Renderer::new(folder, look.width, look.height, options)?;
                look.acting.apply(&mut renderer.app_mut().world_mut().resource_mut::<Actors>().options);
                let mut frame = renderer.app_mut().world_mut().resource_mut::<StageFrame>();
                (frame.without_details, frame.shows_guessed) = (look.without_details, look.shows_guessed);
                Painter::Viewer(Box::new(renderer))
            }
        };
        let fov_deg = look.fov_deg.unwrap_or_else(|| fov_deg(bundle.manifest()));
        Ok(Self { bundle, look, pose, fov_deg, painter })
    }

    /// Has traced pictures show the geometry of another bundle, with this one's light, normals and colours.
    ///
    /// # Errors
    /// If it cannot be read, was not prepared or has another origin, or these pictures are not traced.
    pub fn show_shape_of(&mut self, prepared: &Path) -> Result<()> {
        let Painter::Reference(stage) = &mut self.painter else { bail!("only traced pictures show another bundle's shape") };
        let shown = stage.show_shape_of(&BundleReader::open(prepared)?, &self.bundle);
        shown.with_context(|| format!("{} cannot be the shape", prepared.display()))
    }

    /// What the viewer would show and these pictures do not, if they are traced.
    pub fn left_out(&self) -> Option<String> {
        let manifest = self.bundle.manifest();
        let details = manifest.parts.iter().any(|part| part.details().next().is_some());
        let views = manifest.parts.iter().any(|part| part.views.is_some());
        let purged = !manifest.rooms.is_empty() && manifest.parameters.prepare.as_ref().is_some_and(|prepare| prepare.purge);
        let there = [
            ("actors", !self.bundle.actors().is_empty()),
            ("films", !self.bundle.living().films.is_empty()),
            ("lamps", !self.bundle.lamps().is_empty()),
            ("details", details),
            ("photographs' views", views),
            ("what no room sees, so that light comes in where that was ([prepare], purge = false keeps it)", purged),
        ];
        let names: Vec<&str> = there.into_iter().filter_map(|(name, there)| there.then_some(name)).collect();
        let traced = matches!(self.painter, Painter::Reference(_));
        (traced && !names.is_empty())
            .then(|| format!("the path tracer leaves out what it knows nothing of: {}", names.join(", ")))
    }

    /// What was odd or missing in the pictures so far, such as films that cannot be played.
    pub fn take_problems(&mut self) -> Vec<String> {
        match &mut self.painter {
            Painter::Viewer(renderer) => renderer.app_mut().world_mut().resource_mut::<Films>().take_problems(),
            Painter::Reference(_) => Vec::new(),
        }
    }

    /// The bundle's day in seconds after midnight.
    pub fn day(&self) -> (f64, f64) {
        heliodon_bundle::moment::Day::new(self.bundle.lapse()).span_seconds()
    }

    /// Refuses a time that the bundle knows no light of; one with a single step has light for any.
    ///
    /// # Errors
    /// A time outside of the day.
    pub fn check_time(&self, time: TimeOfDay) -> Result<()> {
        let steps = &self.bundle.lapse().steps;
        let (first, last) = self.day();
        if steps.len() > 1 && !(first..=last).contains(&f64::from(time.seconds())) {
            let name = |step: Option<&heliodon_sky::lapse::LapseStep>| step.map_or_else(String::new, |step| step.time.clone());
            bail!("{time} is outside of the bundle's day; give a time from {} to {}", name(steps.first()), name(steps.last()));
        }
        Ok(())
    }

    fn shot(&self, clock_s: f64, actors_s: f64) -> Shot {
        Shot {
            clock_s,
            pose: self.pose,
            fov_deg: self.fov_deg,
            exposure: match self.look.exposure {
                Exposure::Auto => ShotExposure::Lapse(0.0),
                Exposure::Stops(stops) => ShotExposure::Stops(stops),
            },
            curve: self.look.curve,
            blend: self.look.blend,
            actors_s,
        }
    }

    /// Pictures at these times, in seconds after midnight, one after the other; actors act for `actors_step_s` seconds between two.
    ///
    /// # Errors
    /// What keeps a picture from being made, or what `take` says.
    pub fn pictures(
        &mut self,
        times: &[f64],
        actors_step_s: f64,
        mut take: impl FnMut(usize, SrgbImage) -> Result<()> + Send,
    ) -> Result<()> {
        let acted = |index: usize| self.look.actors_s + index as f64 * actors_step_s;
        let shots: Vec<Shot> = times.iter().enumerate().map(|(index, &clock_s)| self.shot(clock_s, acted(index))).collect();
        match &mut self.painter {
            Painter::Viewer(renderer) => renderer.render_all(shots, take),
            Painter::Reference(_) => {
                for (index, &clock_s) in times.iter().enumerate() {
                    let (frame, stops) = self.trace(clock_s)?;
                    take(index, self.developed(&frame, stops))?;
                }
                Ok(())
            }
        }
    }

    /// A traced picture, and in grey how much of each of its pixels shows geometry.
    ///
    /// # Errors
    /// What keeps it from being made; a studio without the path tracer.
    pub fn traced_with_coverage(&self, clock_s: f64) -> Result<(SrgbImage, SrgbImage)> {
        let (frame, stops) = self.trace(clock_s)?;
        let grey = |coverage: &f32| {
            let code = (coverage * 255.0 + 0.5) as u8;
            [code, code, code, u8::MAX]
        };
        let coverage =
            SrgbImage { width: frame.width, height: frame.height, pixels: frame.coverage.iter().map(grey).collect() };
        Ok((self.developed(&frame, stops), coverage))
    }

    /// The picture's linear radiance.
    ///
    /// # Errors
    /// What keeps it from being made.
    pub fn linear(&mut self, clock_s: f64) -> Result<HdrImage> {
        let shot = self.shot(clock_s, self.look.actors_s);
        if let Painter::Viewer(renderer) = &mut self.painter {
            return Ok(renderer.render_linear(&shot)?);
        }
        let (frame, _) = self.trace(clock_s)?;
        Ok(HdrImage { width: frame.width, height: frame.height, pixels: frame.radiance })
    }

    /// A traced frame and the exposure that the viewer would give it.
    fn trace(&self, clock_s: f64) -> Result<(ReferenceFrame, f32)> {
        let Painter::Reference(stage) = &self.painter else { bail!("this studio has no path tracer") };
        let moment = reference::moment(&self.bundle, clock_s, self.look.blend);
        let forward = self.pose.rotation() * Vec3::NEG_Z;
        let (eye, fov_rad) = (self.pose.eye, self.fov_deg.to_radians());
        let camera = Camera::look_at(eye, eye + forward, Vec3::Y, fov_rad, self.look.width, self.look.height);
        let stops = match self.look.exposure {
            Exposure::Auto => moment.exposure_stops,
            Exposure::Stops(stops) => stops,
        };
        Ok((stage.render(&self.bundle, &moment, &camera)?, stops))
    }

    /// A traced frame through the viewer's exposure, tone curve, display gamma and dither.
    fn developed(&self, frame: &ReferenceFrame, stops: f32) -> SrgbImage {
        let code = |(at, radiance): (u32, &Vec3)| {
            let shown = tonemap::display(*radiance, stops, self.look.curve);
            let [r, g, b] = tonemap::codes::dithered(shown, at % frame.width, at / frame.width);
            [r, g, b, u8::MAX]
        };
        SrgbImage { width: frame.width, height: frame.height, pixels: (0..).zip(&frame.radiance).map(code).collect() }
    }
}

/// `count` times from `first` to `last`, both included.
pub fn spread(first: f64, last: f64, count: usize) -> Vec<f64> {
    let steps = count.saturating_sub(1).max(1) as f64;
    (0..count).map(|index| first + (last - first) * index as f64 / steps).collect()
}
