//! Frames of a model that moves: posed, seen, asked and lit anew, with and without vertex filtering.
//!
//! Table 1 of M. Sattler, R. Sarlette, G. Zachmann, R. Klein: "Hardware-accelerated ambient occlusion computation", VMV 2004. A model that does not move is computed
//! as often, as if it did.

use super::{Args, Figures, figures, name_of};
use crate::failure::wrong_arguments;
use crate::raster::three_quarters;
use anyhow::Result;
use glam::{UVec2, Vec3};
use heliodon_math::light_sphere::LightSphere;
use heliodon_math::visibility::VisibilityBackend;
use heliodon_mesh::import::{ImportOptions, ImportReport};
use heliodon_mesh::motion::{Pose, read_cached, read_moving};
use heliodon_rays::{EyeView, VertexFilter, VisibilityCpu};
use std::time::Instant;

/// The paper's pictures.
const PICTURE_PX: UVec2 = UVec2::new(1280, 960);
/// Frames of a run, over the whole clip.
const FRAMES: u32 = 48;
/// Of the triangles as many may be unseen when all count as seen.
const THRESHOLD: f32 = 0.03;

/// Runs it.
pub fn run(args: &Args) -> Result<Figures> {
    let Some(path) = &args.input else { wrong_arguments!("name a model: heliodon bench motion FILE [--cache FILE]") };
    let (options, mut report) = (ImportOptions::default(), ImportReport::default());
    let model = match &args.cache {
        Some(cache) => read_cached(path, cache, &options, &mut report)?,
        None => read_moving(path, &options, &mut report)?,
    };
    let rest = model.rest();
    let mut figures = figures(args, name_of(path), rest);
    let sphere = LightSphere::new(args.level);
    let clip_from_mesh = three_quarters(rest.bounds().unwrap_or_default(), (PICTURE_PX.x, PICTURE_PX.y));
    let view = EyeView { clip_from_mesh, size_px: PICTURE_PX };
    let radiance = vec![Vec3::ONE; sphere.directions().len()];
    let duration_s = model.clips().first().map_or(0.0, |clip| clip.duration_s);
    figures.more.insert("directions".to_owned(), sphere.directions().len() as f64);
    for (filtering, name) in [(false, "all"), (true, "filtered")] {
        let mut pose = Pose::default();
        let mut backend = VisibilityCpu::default();
        backend.set_mesh(&rest.positions, &rest.normals, &rest.triangles)?;
        let mut filter = VertexFilter::new(rest.positions.len(), &rest.triangles, THRESHOLD);
        let everything = vec![true; rest.positions.len()];
        let mut times = [0.0; 5];
        let (mut asked, mut runs) = (0, Vec::new());
        for _ in 0..args.runs {
            let run = Instant::now();
            for frame in 0..FRAMES {
                let mut begun = Instant::now();
                let mut phase = |k: usize| {
                    times[k] += begun.elapsed().as_secs_f64();
                    begun = Instant::now();
                };
                model.pose(0, duration_s * frame as f32 / FRAMES as f32, &mut pose);
                phase(0);
                backend.move_vertices(&pose.positions, &pose.normals)?;
                phase(1);
                if filtering {
                    filter.reset();
                    filter.look(&pose.positions, &view);
                }
                phase(2);
                let wanted = if filtering { filter.wanted() } else { &everything };
                backend.compute_for(wanted, sphere.directions())?;
                phase(3);
                std::hint::black_box(backend.light(sphere.weights(), &radiance)?);
                phase(4);
                asked += wanted.iter().filter(|&&wanted| wanted).count();
            }
            runs.push(run.elapsed().as_secs_f64() / f64::from(FRAMES));
        }
        let frames = f64::from(FRAMES) * f64::from(args.runs);
        for (phase, seconds) in ["pose", "hierarchy", "filter", "visibility", "light"].into_iter().zip(times) {
            figures.more.insert(format!("{name}_{phase}_ms"), seconds * 1e3 / frames);
        }
        figures.more.insert(format!("{name}_vertices"), asked as f64 / frames);
        runs.sort_by(f64::total_cmp);
        figures.more.insert(format!("{name}_frames_per_second"), 1.0 / runs[runs.len() / 2]);
        if filtering {
            figures.seconds = runs;
        }
    }
    Ok(figures)
}
