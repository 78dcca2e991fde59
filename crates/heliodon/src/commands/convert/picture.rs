//! An image into a texture of blocks.

use super::Args;
use super::model::name;
use super::plan::Plan;
use super::report::{Detail, FileReport, Pair, PictureNumbers, timed};
use crate::files;
use anyhow::{Context, Result, bail};
use heliodon_image::ktx2::{Ktx2, TexelFormat};
use heliodon_image::texture::{TextureParams, TextureUse, clipped, texture, texture_bytes, texture_error};
use heliodon_image::{Picture, PictureFile};
use std::io::Write;

pub fn convert(args: &Args, plan: &Plan) -> Result<FileReport> {
    let before = timed(args.reads, || Ok(PictureFile::read(&plan.file)?))?;
    let PictureFile { picture, mut warnings, bytes } = before.value;
    if args.normal_map && matches!(picture, Picture::Hdr(_)) {
        bail!("{}: holds floats, and --normal-map takes images of 8 bits; save it as PNG", plan.file.display());
    }
    let usage = match (args.linear, args.normal_map) {
        (_, true) => TextureUse::NormalMap,
        (true, _) => TextureUse::Data,
        _ => TextureUse::Color,
    };
    let place = plan.output.display().to_string();
    let params = TextureParams { usage, quality: args.quality.into(), alone: args.no_mips };
    let made = texture(&picture, &params, &plan.file.display().to_string())?;
    let encoded = texture_bytes(&made, &place)?;
    let clipped = clipped(&picture);
    if clipped > 0 {
        warnings.push(format!("{}: {clipped} pixels are brighter than 65,504, and became that", plan.file.display()));
    }
    let after = if args.dry_run {
        timed(args.reads, || Ok(Ktx2::from_bytes(&encoded, &place)?))?
    } else {
        files::write_whole(&plan.output, |file| file.write_all(&encoded))?;
        timed(args.reads, || {
            let bytes = std::fs::read(&plan.output).with_context(|| format!("cannot read {place}"))?;
            Ok(Ktx2::from_bytes(&bytes, &place)?)
        })?
    };
    if after.value != made {
        bail!("{place}: what is read back is not what was written; check the disk");
    }
    let error = texture_error(&picture, &made);
    let numbers = PictureNumbers {
        width: made.width,
        height: made.height,
        levels: made.levels.len(),
        format: format_name(made.format),
        rms_error: error.rms,
        greatest_error: error.greatest,
    };
    let texels: u64 = (0..made.levels.len() as u32).map(|level| side(made.width, level) * side(made.height, level)).sum();
    let texel_bytes = if matches!(picture, Picture::Hdr(_)) { 8 } else { 4 };
    Ok(FileReport {
        file: plan.file.clone(),
        output: (!args.dry_run).then(|| plan.output.clone()),
        becomes: name(&plan.output),
        bytes: Pair { before: bytes, after: encoded.len() as u64 },
        gpu_bytes: Pair { before: texels * texel_bytes, after: made.levels.iter().map(|level| level.len() as u64).sum() },
        load_ms: Pair { before: before.median_ms, after: after.median_ms },
        reads: before.reads.min(after.reads),
        detail: Detail::Picture(numbers),
        warnings,
    })
}

fn side(texels: u32, level: u32) -> u64 {
    u64::from((texels >> level).max(1))
}

fn format_name(format: TexelFormat) -> &'static str {
    match format {
        TexelFormat::Bc6h => "BC6H",
        TexelFormat::Bc7Srgb => "BC7 sRGB",
        _ => "BC7 linear",
    }
}
