//! A model into binary glTF.

use super::Args;
use super::plan::Plan;
use super::report::{Detail, FileReport, ModelNumbers, Pair, timed};
use crate::files;
use anyhow::{Context, Result, bail};
use heliodon_mesh::convert::{self, ConvertParams, NormalBits, compare};
use heliodon_mesh::import::{Format, ImportOptions, ImportReport};
use heliodon_mesh::motion::{MovingMesh, from_bytes, read_moving};
use std::io::Write;
use std::path::Path;

pub fn convert(args: &Args, plan: &Plan) -> Result<FileReport> {
    let options = ImportOptions::default();
    let mut told = ImportReport::default();
    let before = timed(args.reads, || {
        told = ImportReport::default();
        Ok(read_moving(&plan.file, &options, &mut told)?)
    })?;
    let normals = if args.normal_bits == "16" { NormalBits::Sixteen } else { NormalBits::Eight };
    let params = ConvertParams { tolerance_m: args.tolerance / 1000.0, normals, compress: args.meshopt };
    let mut own = ImportReport::default();
    let converted = convert::convert(&plan.file, &params, &mut own)?;
    let report = &converted.report;
    let check = |after: &MovingMesh| {
        compare(&before.value, after, report)
            .map_err(anyhow::Error::msg)
            .with_context(|| format!("{}: what was made of it is not what it was; it is not written", plan.file.display()))
    };
    let read_back = || from_bytes(&converted.bytes, Format::Gltf, &plan.output, &options, &mut ImportReport::default());
    check(&read_back()?)?;
    let after = if args.dry_run {
        timed(args.reads, || Ok(read_back()?))?
    } else {
        files::write_whole(&plan.output, |file| file.write_all(&converted.bytes))?;
        timed(args.reads, || Ok(read_moving(&plan.output, &options, &mut ImportReport::default())?))?
    };
    if after.value.rest().triangles.is_empty() {
        bail!("{}: nothing is read back", plan.output.display());
    }
    let mut warnings = told.warnings;
    own.warnings.retain(|warning| !warnings.contains(warning));
    warnings.extend(own.warnings);
    let bounds = report.bounds;
    let numbers = ModelNumbers {
        triangles: pair(report.triangles),
        vertices: pair(report.vertices),
        cache_misses_a_triangle: Pair {
            before: report.cache_misses.before as f64 / 100.0,
            after: report.cache_misses.after as f64 / 100.0,
        },
        position_error_mm: bounds.position_m * 1000.0,
        normal_error_deg: bounds.normal_deg,
        texture_coordinate_error: bounds.uv,
        colour_error: bounds.color,
        weight_error: bounds.weight,
        meshes_kept_as_floats: report.kept_floats,
        clips: after.value.clips().len(),
    };
    Ok(FileReport {
        file: plan.file.clone(),
        output: (!args.dry_run).then(|| plan.output.clone()),
        becomes: name(&plan.output),
        bytes: pair(report.bytes),
        gpu_bytes: pair(report.gpu_bytes),
        load_ms: Pair { before: before.median_ms, after: after.median_ms },
        reads: before.reads.min(after.reads),
        detail: Detail::Model(numbers),
        warnings,
    })
}

fn pair(change: convert::Change) -> Pair<u64> {
    Pair { before: change.before, after: change.after }
}

pub fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
