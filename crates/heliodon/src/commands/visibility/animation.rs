//! `--animation`: a model that moves, frame after frame, as a film or as a vertex cache.

use super::engine::{Engine, Question, ask};
use super::found::{Found, lit_colors, vertex_albedo};
use super::scene::Scene;
use super::{Args, Moving, Phases};
use crate::App;
use crate::film::Film;
use crate::raster::{Raster, three_quarters};
use anyhow::{Context, Result, bail};
use glam::Vec3;
use heliodon_bake::report::Reporter;
use heliodon_math::light_sphere::LightSphere;
use heliodon_math::visibility::VisibilityBackend;
use heliodon_mesh::export::write_pc2;
use heliodon_mesh::import::{ImportOptions, ImportReport};
use heliodon_mesh::motion::pc2::PointCache;
use heliodon_mesh::motion::{CACHE_FRAMES_PER_S, MovingMesh, Pose, read_cached, read_moving};
use heliodon_rays::VisibilityCpu;
use std::path::{Path, PathBuf};

/// A film's picture.
const FILM_PX: (u32, u32) = (1024, 768);

/// The model, its clip, and the length of that in seconds.
pub struct Acted {
    pub model: MovingMesh,
    pub clip: usize,
    pub duration_s: f32,
}

/// Reads a model that moves.
///
/// # Errors
/// What keeps it from being read; no such clip.
pub fn read(app: &App, args: &Args, name: &str) -> Result<Acted> {
    let [path] = args.meshes.as_slice() else { bail!("--animation takes one model, not {}", args.meshes.len()) };
    let (options, mut report) = (ImportOptions::default(), ImportReport::default());
    let mut model = match &args.cache {
        Some(cache) => read_cached(path, cache, &options, &mut report)?,
        None => read_moving(path, &options, &mut report)?,
    };
    report.warnings.iter().for_each(|warning| app.progress.warning(warning));
    if let Some(frames_per_s) = args.cache_frames_per_s {
        model.set_cache_frames_per_s(frames_per_s);
    }
    let clips: Vec<&str> = model.clips().iter().map(|clip| clip.name.as_str()).collect();
    let clip = model.clip_named(name).with_context(|| {
        let known = if clips.is_empty() { "nothing in it moves".to_owned() } else { format!("it has {}", clips.join(", ")) };
        format!("{} has no animation {name}; {known}", path.display())
    })?;
    let duration_s = model.clips()[clip].duration_s;
    Ok(Acted { model, clip, duration_s })
}

/// What lights the frames.
pub struct Lighting<'a> {
    pub sphere: &'a LightSphere,
    /// Of each direction, where an environment shines.
    pub radiance: Option<Vec<Vec3>>,
}

/// Computes the light of `args.frames` moments spread over the clip, and writes it; answers what was found of the last.
///
/// # Errors
/// A backend that fails, or a place that cannot be written.
pub fn run(
    app: &App,
    args: &Args,
    form: Moving,
    acted: &Acted,
    lighting: Lighting<'_>,
    phases: &mut Phases,
) -> Result<(Scene, Found, Engine, Vec<PathBuf>)> {
    let Some(path) = &args.output else { bail!("say where the film or the cache goes: -o FILE.mp4 or -o FILE.pc2") };
    let scene = Scene::of(acted.model.rest().clone());
    let rest = &scene.mesh;
    // A pose is a frame of the film; a clip of one pose is shown as long as it is asked for.
    let fps =
        if acted.duration_s > 0.0 { f64::from(args.frames as f32 / acted.duration_s) } else { f64::from(CACHE_FRAMES_PER_S) };
    let film = if form == Moving::Mp4 { Some(Film::new(FILM_PX.0, FILM_PX.1, fps.clamp(1.0, 240.0))?) } else { None };
    let camera = three_quarters(rest.bounds().unwrap_or_default(), FILM_PX);
    let mut made = Made { film, raster: Raster::new(FILM_PX, camera), albedo: vertex_albedo(rest), ..Made::default() };
    let Lighting { sphere, radiance } = lighting;
    let question = Question { scene: &scene, sphere, radiance, bent: args.bent, matrix: false };
    #[cfg(feature = "gpu")]
    let gpu =
        super::engine::gpu(args, rest.positions.len() as u64 * u64::from(args.frames) * sphere.directions().len() as u64 / 2)?;
    #[cfg(feature = "gpu")]
    let (found, engine) = match gpu {
        Some((mut backend, device)) => {
            let found = frames(app, args, &mut backend, acted, &question, &mut made, phases)?;
            (found, Engine::gpu(&backend, device))
        }
        None => by_rays(app, args, acted, &question, &mut made, phases)?,
    };
    #[cfg(not(feature = "gpu"))]
    let (found, engine) = by_rays(app, args, acted, &question, &mut made, phases)?;
    let written = phases.time("writing", || made.write(path))?;
    Ok((scene, found, engine, written))
}

fn by_rays(
    app: &App,
    args: &Args,
    acted: &Acted,
    question: &Question<'_>,
    made: &mut Made,
    phases: &mut Phases,
) -> Result<(Found, Engine)> {
    let mut backend = VisibilityCpu::new(args.offset);
    let found = frames(app, args, &mut backend, acted, question, made, phases)?;
    let engine = Engine::rays(&backend);
    Ok((found, engine))
}

fn frames<B: VisibilityBackend>(
    app: &App,
    args: &Args,
    backend: &mut B,
    acted: &Acted,
    question: &Question<'_>,
    made: &mut Made,
    phases: &mut Phases,
) -> Result<Found> {
    let mut pose = Pose::default();
    let mut last = None;
    app.progress.stage("frames", u64::from(args.frames));
    for frame in 0..args.frames {
        let time_s = acted.duration_s * frame as f32 / args.frames as f32;
        phases.time("pose", || acted.model.pose(acted.clip, time_s, &mut pose));
        phases.time("hierarchy", || match frame {
            0 => backend.set_mesh(&pose.positions, &pose.normals, &question.scene.mesh.triangles),
            _ => backend.move_vertices(&pose.positions, &pose.normals),
        })?;
        let found = ask(None, backend, question, phases)?;
        phases.time("picture", || made.take(args, question.scene, &pose, &found))?;
        app.progress.progress(u64::from(frame) + 1);
        last = Some(found);
    }
    app.progress.finished();
    last.context("there is no frame")
}

/// What was made so far.
#[derive(Default)]
struct Made {
    film: Option<Film>,
    raster: Raster,
    albedo: Vec<Vec3>,
    /// Three numbers a vertex and frame, and where the vertices are.
    values: Vec<Vec3>,
    positions: Vec<Vec3>,
    frames: usize,
}

impl Made {
    fn take(&mut self, args: &Args, scene: &Scene, pose: &Pose, found: &Found) -> Result<()> {
        let shown = match args.env {
            Some(_) => lit_colors(&found.light.light, &self.albedo, args.exposure),
            None => found.light.ambient_occlusion.iter().map(|&ao| Vec3::splat(ao)).collect(),
        };
        if let Some(film) = &mut self.film {
            return film.push(&self.raster.draw(&pose.positions, &shown, &scene.mesh.triangles));
        }
        let values = match (args.bent, args.env.is_some()) {
            (true, _) => &found.bent,
            (false, true) => &found.light.light,
            (false, false) => &shown,
        };
        self.frames += 1;
        self.values.extend(scene.own_of(values));
        self.positions.extend(scene.own_of(&pose.positions));
        Ok(())
    }

    /// The film; or the values, and beside them the positions.
    fn write(self, path: &Path) -> Result<Vec<PathBuf>> {
        if let Some(film) = self.film {
            film.finish(path)?;
            return Ok(vec![path.to_owned()]);
        }
        let positions = path.with_extension("positions.pc2");
        for (path, samples) in [(path, self.values), (&positions, self.positions)] {
            let points = samples.len() / self.frames.max(1);
            let cache = PointCache { points, start_frame: 0.0, frames_per_sample: 1.0, positions: samples };
            write_pc2(path, &cache)?;
        }
        Ok(vec![path.to_owned(), positions])
    }
}
