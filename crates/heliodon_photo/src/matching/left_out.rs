//! Why a photograph has no camera.

use super::features::Extracted;
use crate::formats::ImportedCameras;

/// Fewer features than this hardly match anything.
const FEW_FEATURES: usize = 50;

/// How many names are told of the photographs that another model has.
const MOST_NAMES: usize = 3;

/// A photograph without a camera.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeftOut {
    /// Its file.
    pub photo: String,
    /// Why, in words.
    pub why: String,
}

/// What the mapper said when it tried a photograph last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Tried {
    image: usize,
    sees: usize,
}

/// The photographs without a camera in the best of all models, and why, by the other models and the logs.
pub(super) fn reasons(
    files: &[String],
    best: Option<&ImportedCameras>,
    all: &[ImportedCameras],
    photos: &[Extracted],
    mapper_log: &str,
) -> Vec<LeftOut> {
    let has = |model: &ImportedCameras, file: &str| model.cameras.iter().any(|camera| camera.name == file);
    let tried = tried(mapper_log);
    let why = |file: &String| {
        let photo = photos.iter().find(|photo| photo.file == *file);
        if let Some(error) = photo.and_then(|photo| photo.error.as_ref()) {
            return format!("COLMAP cannot take it: {error}");
        }
        if let Some(photo) = photo.filter(|photo| photo.features < FEW_FEATURES && photo.camera.is_some()) {
            return format!("COLMAP finds only {} features in it: it is dark, blurred or bare", photo.features);
        }
        let elsewhere =
            all.iter().filter(|model| best.is_none_or(|best| !std::ptr::eq(best, *model))).find(|model| has(model, file));
        if let Some(model) = elsewhere {
            let others: Vec<&str> = model.cameras.iter().map(|c| c.name.as_str()).filter(|name| name != file).collect();
            let names = others.iter().take(MOST_NAMES).copied().collect::<Vec<_>>().join(", ");
            let more =
                if others.len() > MOST_NAMES { format!(" and {} more", others.len() - MOST_NAMES) } else { String::new() };
            return format!(
                "it fits together with {names}{more}, but not with the rest: photographs between them are missing, or it is another place"
            );
        }
        // The database numbers photographs in the order in which they were taken in.
        let number =
            photos.iter().filter(|photo| photo.camera.is_some()).position(|photo| photo.file == *file).map(|at| at + 1);
        match number.and_then(|number| tried.iter().find(|t| t.image == number)) {
            Some(Tried { sees, .. }) => format!(
                "it seems to show {sees} points of the others, but no camera agrees with them: it overlaps too little, or is of another place that looks alike"
            ),
            None => "it shares nothing with the others that COLMAP can match: another place, or too little overlap".to_owned(),
        }
    };
    let missing = files.iter().filter(|file| best.is_none_or(|best| !has(best, file)));
    missing.map(|file| LeftOut { photo: file.clone(), why: why(file) }).collect()
}

/// `Registering image #14 (4)`, `=> Image sees 49 / 682 points`: of every photograph the last.
fn tried(log: &str) -> Vec<Tried> {
    let mut all: Vec<Tried> = Vec::new();
    let mut image = None;
    for line in log.lines() {
        let number_after = |words: &str| {
            let rest = line.split_once(words)?.1;
            rest.split(|c: char| !c.is_ascii_digit()).next()?.parse::<usize>().ok()
        };
        image = number_after("Registering image #").or(image);
        if let (Some(image), Some(sees)) = (image, number_after("Image sees ")) {
            all.retain(|tried| tried.image != image);
            all.push(Tried { image, sees });
        }
    }
    all
}
