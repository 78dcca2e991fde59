//! `heliodon bench walk`: what culling gains on a walk through a bundle.

use super::{Figures, figures};
use crate::failure::wrong_arguments;
use crate::values;
use anyhow::Result;
use glam::Vec3;
use heliodon_bundle::BundleReader;
use heliodon_mesh::Mesh;
use heliodon_view::bench::walk::{WalkBench, around_the_room, kinds, walk_times};

/// Where it goes, and how.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// For walk: a point of the way that the eye goes around; give several [default: around the first room]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::point, allow_hyphen_values = true)]
    path: Vec<Vec3>,
    /// For walk: frames of a walk [default: 120]; for frame: frames that are counted [default: 100]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub frames: Option<u32>,
    /// For walk: objects below so many pixels are left out by contribution culling
    #[arg(long, value_name = "PX", default_value_t = WalkBench::default().threshold_px, value_parser = values::pixels)]
    threshold_px: f32,
    /// For walk, where a processor draws: every triangle goes through its driver, as through a GPU's
    #[arg(long)]
    plain: bool,
}

/// The middle of what was measured.
fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}

/// Walks of a bundle without culling, with each kind, and with both; the seconds told are a frame's without.
pub fn run(args: &super::Args) -> Result<Figures> {
    let Some(folder) = &args.input else { wrong_arguments!("name a bundle: heliodon bench walk BUNDLE") };
    let bundle = BundleReader::open(folder)?;
    let mut figures = figures(args, bundle.manifest().site.name.clone(), &Mesh::default());
    (figures.vertices, figures.triangles) = (bundle.vertex_count(), bundle.triangle_count());
    let asked = &args.walk;
    let path = if asked.path.is_empty() { around_the_room(bundle.manifest()) } else { asked.path.clone() };
    if path.is_empty() {
        wrong_arguments!("the bundle has no room to walk around; give --path X,Y,Z --path X,Y,Z ...");
    }
    drop(bundle);
    let bench = WalkBench {
        path,
        frames: asked.frames.unwrap_or(WalkBench::default().frames),
        rounds: u32::from(args.runs),
        threshold_px: asked.threshold_px,
        plain: asked.plain,
        ..WalkBench::default()
    };
    let found = walk_times(folder, bench)?;
    figures.scene = format!("{} on {}", figures.scene, found.device);
    let [without, ..] = &found.kinds;
    figures.seconds = without.frame_ms.iter().map(|ms| ms / 1e3).collect();
    let mut tell = |name: String, value: f64| figures.more.insert(name, value);
    tell("triangles_met".to_owned(), without.met);
    for ((name, _), times) in kinds(asked.threshold_px).into_iter().zip(&found.kinds) {
        for (what, values) in [("ms", &times.frame_ms), ("processor_ms", &times.processor_ms)] {
            if let Some(middle) = median(values) {
                tell(format!("{name}_{what}"), middle);
            }
        }
        if times.small + times.hidden > 0.0 {
            tell(format!("{name}_small_part"), times.small / times.met);
            tell(format!("{name}_hidden_part"), times.hidden / times.met);
            tell(format!("{name}_occluders"), times.occluders);
        }
    }
    Ok(figures)
}
