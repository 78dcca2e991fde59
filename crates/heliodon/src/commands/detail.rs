//! `heliodon detail`: fine patterns for surfaces that are seen from near.

use crate::App;
use crate::failure::{WrongArguments, wrong_arguments};
use crate::files;
use anyhow::{Result, bail};
use heliodon_bake::report::Reporter;
use heliodon_bundle::detail::{check_grey, check_sides};
use heliodon_image::SrgbImage;
use heliodon_image::detail::{DetailImport, DetailKind, DetailParams, DetailTexture, NEUTRAL, Seam};
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Makes a detail texture, which is multiplied onto surfaces seen from near, or checks an image that is to be one.
///
/// KIND is noise, band, stone, plaster or wood (whose fibre runs down); ./stone names a file. Codes below 128 darken, above it
/// brighten; the mean is exactly 128, so that nothing changes its brightness where the detail fades in. Of a FILE (PNG, JPEG) the mean,
/// the seam and what else is doubtful is told, and what a bake would refuse is refused; with -o colours become the greys that are written, without
/// nothing is written.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon detail stone -o stone.png\n  heliodon detail wood --size 512 --seed 7 --knots 2 -o oak.png --picture oak-walls.png\n  heliodon detail photo.png --json\n  heliodon detail photo.png --correct --contrast 15 -o fine.png"
)]
pub struct Args {
    /// What to generate, or an image to check
    #[arg(value_name = "KIND|FILE")]
    what: PathBuf,
    /// Texels along each side of what is generated: 64, 128, 256 or 512 [default: 256]
    #[arg(long, value_name = "N")]
    size: Option<u32>,
    /// Which of all textures of its kind [default: 0]
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Standard deviation of the codes, 1 to 40 [default: the kind's own, or the image's]
    #[arg(long, value_name = "C")]
    contrast: Option<f32>,
    /// Texels from crest to crest of `band`, from 4 to an eighth of the size [default: 6]
    #[arg(long, value_name = "TEXELS")]
    wavelength: Option<f32>,
    /// Knots in a tile of `wood`, at most 8 [default: 0]
    #[arg(long, value_name = "K")]
    knots: Option<u32>,
    /// Shift an image whose mean is not 128
    #[arg(long)]
    correct: bool,
    /// Write the texture: grey, 8 bits; replaces nothing but a detail texture
    #[arg(short, long, value_name = "PNG")]
    output: Option<PathBuf>,
    /// Draw it, 3 x 3 tiles, alone and on a beige and a grey wall
    #[arg(long, value_name = "PNG")]
    picture: Option<PathBuf>,
}

/// What is asked for.
enum Plan<'a> {
    Generate(DetailParams),
    Import(&'a Path, DetailImport),
}

#[derive(Serialize)]
struct DetailReport {
    /// The kind, or the image's file.
    source: String,
    /// Where it was written.
    file: Option<PathBuf>,
    width: u32,
    height: u32,
    mip_levels: u32,
    seed: Option<u64>,
    /// Of the codes: exact.
    mean: u8,
    /// Standard deviation of the codes.
    contrast: f32,
    /// Share of codes that are 0 or 255.
    share_at_limits: f32,
    seam: SeamReport,
    /// Of an image: what it was before.
    image: Option<ImageReport>,
    warnings: Vec<String>,
}

#[derive(Serialize)]
struct SeamReport {
    /// Steps across the left and right, and across the upper and lower edges, against those inside.
    u: f32,
    v: f32,
    verdict: &'static str,
}

#[derive(Serialize)]
struct ImageReport {
    mean: f64,
    contrast: f32,
    /// How many of its codes are others now.
    changed: u64,
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let plan = plan(args)?;
    refuse_places(args, &plan)?;
    let (texture, report) = make(args, &plan)?;
    report.warnings.iter().for_each(|warning| app.progress.warning(warning));
    // both are encoded before either is written
    let drawn = args.picture.as_ref().map(|_| texture.preview().to_png_bytes()).transpose()?;
    if let Some(path) = &args.output {
        let bytes = texture.to_png_bytes()?;
        files::write_whole(path, |file| file.write_all(&bytes))?;
    }
    if let (Some(path), Some(drawn)) = (&args.picture, drawn) {
        files::write_whole(path, |file| file.write_all(&drawn))?;
    }
    app.output.result(&report, describe)
}

/// What the arguments mean together.
fn plan(args: &Args) -> Result<Plan<'_>> {
    for path in args.output.iter().chain(&args.picture) {
        if !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png")) {
            wrong_arguments!("{}: textures and pictures are written as PNG; give a name that ends in .png", path.display());
        }
    }
    if args.output.is_some() && args.output == args.picture {
        wrong_arguments!("-o and --picture name the same file; give each its own");
    }
    let Some(kind) = args.what.to_str().and_then(DetailKind::named) else {
        let made = [args.size.is_some(), args.seed.is_some(), args.wavelength.is_some(), args.knots.is_some()];
        let known = DetailKind::ALL.map(|kind| kind.name()).join(", ");
        if !args.what.exists() && args.what.extension().is_none() {
            wrong_arguments!("{} is no kind of detail and no file; kinds are {known}", args.what.display());
        }
        if made.contains(&true) {
            wrong_arguments!("an image is taken as it is; leave out --size, --seed, --wavelength and --knots");
        }
        if args.contrast.is_some() && !args.correct {
            wrong_arguments!("another contrast changes the image; give --correct with --contrast");
        }
        return Ok(Plan::Import(&args.what, DetailImport { correct: args.correct, contrast: args.contrast }));
    };
    if args.correct {
        wrong_arguments!("--correct is for images; the mean of what is generated is exact");
    }
    if args.output.is_none() && args.picture.is_none() {
        wrong_arguments!("say where to write it: -o {}.png", kind.name());
    }
    let kind = match (kind, args.wavelength, args.knots) {
        (DetailKind::Band { wavelength }, asked, None) => DetailKind::Band { wavelength: asked.unwrap_or(wavelength) },
        (DetailKind::Wood { knots }, None, asked) => DetailKind::Wood { knots: asked.unwrap_or(knots) },
        (kind, None, None) => kind,
        _ => wrong_arguments!("--wavelength is for band, --knots for wood"),
    };
    let natural = DetailParams::new(kind);
    let params = DetailParams {
        kind,
        size: args.size.unwrap_or(natural.size),
        seed: args.seed.unwrap_or(natural.seed),
        contrast: args.contrast.unwrap_or(natural.contrast),
    };
    params.validate().map_err(|error| WrongArguments(error.to_string()))?;
    Ok(Plan::Generate(params))
}

/// Looks whether everything can be written, and whether nothing of anybody's is written over.
fn refuse_places(args: &Args, plan: &Plan<'_>) -> Result<()> {
    for path in args.output.iter().chain(&args.picture) {
        files::check_place(path)?;
        if let Plan::Import(input, _) = plan
            && files::is_within(input, path)
        {
            bail!("{} would be written over, and it is read here; name another place", input.display());
        }
    }
    if let Some(path) = &args.output
        && path.exists()
        && !is_detail(path)
    {
        bail!("{} exists, and is no detail texture; move it away, or name another place", path.display());
    }
    Ok(())
}

/// Whether a file is a detail texture to the bit: such a file can be made again, any other is somebody's.
fn is_detail(path: &Path) -> bool {
    let read = DetailTexture::read(path, &DetailImport::strict());
    read.is_ok_and(|read| read.mean_before == f64::from(NEUTRAL) && read.changed == 0)
}

fn make(args: &Args, plan: &Plan<'_>) -> Result<(DetailTexture, DetailReport)> {
    let (texture, image, seed, seam, warnings) = match plan {
        Plan::Generate(params) => {
            let texture = DetailTexture::generate(params)?;
            let seam = texture.seam();
            (texture, None, Some(params.seed), seam, Vec::new())
        }
        Plan::Import(path, import) => {
            let (image, name) = (SrgbImage::read(path)?, path.display().to_string());
            check_sides(&image, &name)?;
            // what is written is grey, whatever the image was
            if args.output.is_none() {
                check_grey(&image, &name)?;
            }
            let read = DetailTexture::from_image(&image, &name, import)?;
            let image = ImageReport { mean: read.mean_before, contrast: read.contrast_before, changed: read.changed };
            (read.texture, Some(image), None, read.seam, read.warnings)
        }
    };
    let Seam { u, v, verdict } = seam;
    let report = DetailReport {
        source: args.what.display().to_string(),
        file: args.output.clone(),
        width: texture.width(),
        height: texture.height(),
        mip_levels: texture.mip_bytes().1,
        seed,
        mean: NEUTRAL,
        contrast: texture.contrast(),
        share_at_limits: texture.share_at_limits(),
        seam: SeamReport { u, v, verdict: verdict.name() },
        image,
        warnings,
    };
    Ok((texture, report))
}

fn describe(report: &DetailReport) -> String {
    let DetailReport { source, width, height, mip_levels, mean, contrast, seam, .. } = report;
    let seed = report.seed.map_or_else(String::new, |seed| format!(", seed {seed}"));
    let mut text = format!("{source}: {width} x {height} texels, {mip_levels} mip levels{seed}\n");
    if let Some(image) = &report.image {
        text += &format!("was: mean {:.2}, contrast {:.1} codes; ", image.mean, image.contrast);
        text += &format!("{} of its codes changed\n", crate::output::count(image.changed));
    }
    text +=
        &format!("mean {mean}, contrast {contrast:.1} codes ({:.0} % of brightness)\n", contrast / f32::from(*mean) * 100.0);
    let edges = match seam.verdict {
        "seamless" => "seamless".to_owned(),
        verdict => format!("a {verdict} seam"),
    };
    text += &format!("{edges}: steps across its edges are {:.2} and {:.2} times those inside\n", seam.u, seam.v);
    match &report.file {
        Some(file) => format!("{text}Written to {}.\n", file.display()),
        None => text,
    }
}
