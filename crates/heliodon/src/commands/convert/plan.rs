//! What is to become of which file; nobody's file is written over.

use super::Args;
use crate::failure::wrong_arguments;
use crate::files;
use anyhow::{Context, Result, bail};
use heliodon_image::ktx2::Ktx2;
use heliodon_image::texture::WRITER;
use heliodon_mesh::convert::wrote;
use heliodon_mesh::import::Format;
use std::fs;
use std::path::{Path, PathBuf};

/// What a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Model,
    Picture,
}

/// One file, and what becomes of it.
#[derive(Debug)]
pub struct Plan {
    pub file: PathBuf,
    pub kind: Kind,
    pub output: PathBuf,
}

const PICTURES: [&str; 9] = ["png", "jpg", "jpeg", "tga", "tif", "tiff", "exr", "hdr", "pic"];

/// One for each file; before anything is done, everything that could stand in the way is looked for.
pub fn plans(args: &Args) -> Result<Vec<Plan>> {
    let plans: Vec<Plan> = args.files.iter().map(|file| plan(args, file)).collect::<Result<_>>()?;
    for (k, plan) in plans.iter().enumerate() {
        if let Some(other) = plans[..k].iter().find(|other| other.output == plan.output) {
            let [one, other, place] = [&other.file, &plan.file, &plan.output].map(|path| path.display());
            wrong_arguments!("{one} and {other} would both become {place}; convert them into different folders with -o");
        }
        if let Some(read) = plans.iter().find(|other| files::is_within(&other.file, &plan.output)) {
            wrong_arguments!("{} would be written over, and it is read here; name another folder with -o", read.file.display());
        }
        if plan.output.is_file() && !is_ours(plan) {
            bail!(
                "{} exists, and was not made by `heliodon convert`; move it away, or name another folder with -o",
                plan.output.display()
            );
        }
    }
    if !args.dry_run {
        if let Some(folder) = &args.output {
            fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
        }
        plans.iter().try_for_each(|plan| files::check_place(&plan.output))?;
    }
    Ok(plans)
}

fn plan(args: &Args, file: &Path) -> Result<Plan> {
    let ending = file.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let (kind, new) = if Format::of_name(file).is_some() {
        (Kind::Model, "glb")
    } else if PICTURES.contains(&ending.as_str()) {
        (Kind::Picture, "ktx2")
    } else {
        wrong_arguments!(
            "{}: no model or image by its name; give files that end in .ply, .obj, .gltf, .glb, .stl, .{}",
            file.display(),
            PICTURES.join(", .")
        );
    };
    let folder = args.output.as_deref().or(file.parent()).unwrap_or(Path::new(""));
    let name = Path::new(file.file_name().unwrap_or_default()).with_extension(new);
    Ok(Plan { file: file.to_owned(), kind, output: folder.join(name) })
}

fn is_ours(plan: &Plan) -> bool {
    let Ok(bytes) = fs::read(&plan.output) else { return false };
    match plan.kind {
        Kind::Model => wrote(&bytes),
        Kind::Picture => Ktx2::text_of(&bytes, "KTXwriter") == Some(WRITER),
    }
}
