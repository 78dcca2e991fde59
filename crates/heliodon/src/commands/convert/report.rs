//! What is told of converted files.

use crate::output::{bytes, count, counted};
use anyhow::Result;
use serde::Serialize;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Before and after.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Pair<T> {
    pub before: T,
    pub after: T,
}

#[derive(Debug, Serialize)]
pub struct Report {
    pub dry_run: bool,
    pub files: Vec<FileReport>,
}

#[derive(Debug, Serialize)]
pub struct FileReport {
    pub file: PathBuf,
    /// None where nothing was written.
    pub output: Option<PathBuf>,
    #[serde(skip)]
    pub becomes: String,
    pub bytes: Pair<u64>,
    /// Of a device's memory: vertices and indices of models, with what they need until they are placed; textures of images, before as texels that are not packed.
    pub gpu_bytes: Pair<u64>,
    /// Medians, from the file to what is ready to be handed over.
    pub load_ms: Pair<f64>,
    pub reads: u32,
    #[serde(flatten)]
    pub detail: Detail,
    pub warnings: Vec<String>,
}

#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Detail {
    Model(ModelNumbers),
    Picture(PictureNumbers),
}

#[derive(Debug, Serialize)]
pub struct ModelNumbers {
    pub triangles: Pair<u64>,
    pub vertices: Pair<u64>,
    /// By a cache of 16 vertices.
    pub cache_misses_a_triangle: Pair<f64>,
    /// At most, as all of these.
    pub position_error_mm: f64,
    pub normal_error_deg: f64,
    /// Of a texture's side.
    pub texture_coordinate_error: f64,
    pub colour_error: f64,
    pub weight_error: f64,
    pub meshes_kept_as_floats: u64,
    pub clips: usize,
}

#[derive(Debug, Serialize)]
pub struct PictureNumbers {
    pub width: u32,
    pub height: u32,
    pub levels: usize,
    pub format: &'static str,
    /// Of a component's range; of BC6H parts of each pixel's brightest component.
    pub rms_error: f64,
    pub greatest_error: f64,
}

/// What was read, and how long it took.
pub struct Timed<T> {
    pub value: T,
    pub median_ms: f64,
    pub reads: u32,
}

/// After so long a file is not read again.
const LONG_ENOUGH: Duration = Duration::from_secs(10);

/// Does it so often, and takes the median.
pub fn timed<T>(times: u32, mut read: impl FnMut() -> Result<T>) -> Result<Timed<T>> {
    let begun = Instant::now();
    let mut taken = Vec::new();
    loop {
        let start = Instant::now();
        let value = read()?;
        taken.push(start.elapsed().as_secs_f64() * 1000.0);
        if taken.len() >= times as usize || begun.elapsed() > LONG_ENOUGH {
            taken.sort_by(f64::total_cmp);
            return Ok(Timed { value, median_ms: taken[taken.len() / 2], reads: taken.len() as u32 });
        }
    }
}

pub fn describe(report: &Report) -> String {
    let mut text: String = report.files.iter().map(describe_file).collect();
    if report.dry_run {
        text += "Nothing was written.\n";
    }
    text
}

fn describe_file(file: &FileReport) -> String {
    let mut text = match &file.output {
        Some(output) => format!("{} -> {}\n", file.file.display(), output.display()),
        None => format!("{} would become {}\n", file.file.display(), file.becomes),
    };
    text += &match &file.detail {
        Detail::Model(model) => describe_model(model),
        Detail::Picture(picture) => format!(
            "  {} x {} texels of {}, {}; off by {:.2} % (root mean square), {:.1} % at most{}\n",
            picture.width,
            picture.height,
            picture.format,
            counted(picture.levels as u64, "level", "levels"),
            picture.rms_error * 100.0,
            picture.greatest_error * 100.0,
            if picture.format == "BC6H" { ", of each pixel's own light" } else { "" }
        ),
    };
    text += &format!(
        "  file {} -> {}, graphics memory {} -> {}, read in {} -> {} ms (median of {})\n",
        bytes(file.bytes.before),
        bytes(file.bytes.after),
        bytes(file.gpu_bytes.before),
        bytes(file.gpu_bytes.after),
        milliseconds(file.load_ms.before),
        milliseconds(file.load_ms.after),
        file.reads
    );
    text
}

fn milliseconds(ms: f64) -> String {
    if ms < 10.0 { format!("{ms:.2}") } else { format!("{ms:.0}") }
}

fn describe_model(model: &ModelNumbers) -> String {
    let change = |pair: Pair<u64>| {
        if pair.before == pair.after { count(pair.after) } else { format!("{} -> {}", count(pair.before), count(pair.after)) }
    };
    let mut text = format!(
        "  triangles {}, vertices {}, {:.2} -> {:.2} vertices worked on a triangle\n",
        change(model.triangles),
        change(model.vertices),
        model.cache_misses_a_triangle.before,
        model.cache_misses_a_triangle.after
    );
    let bounds = [
        (model.position_error_mm, "positions", format!("{:.4} mm", model.position_error_mm)),
        (model.normal_error_deg, "normals", format!("{:.3} degrees", model.normal_error_deg)),
        (model.texture_coordinate_error, "texture coordinates", part(model.texture_coordinate_error)),
        (model.colour_error, "colours", part(model.colour_error)),
        (model.weight_error, "weights", part(model.weight_error)),
    ];
    let told: Vec<String> =
        bounds.iter().filter(|(error, ..)| *error > 0.0).map(|(_, what, error)| format!("{what} by {error}")).collect();
    text += &if told.is_empty() {
        "  all numbers are as they were\n".to_owned()
    } else {
        format!("  off at most: {}\n", told.join(", "))
    };
    if model.meshes_kept_as_floats > 0 {
        let kept = counted(model.meshes_kept_as_floats, "mesh keeps", "meshes keep");
        text += &format!("  {kept} floats: 16 bits would be off by more than --tolerance\n");
    }
    text
}

fn part(error: f64) -> String {
    format!("1/{:.0}", 1.0 / error)
}
