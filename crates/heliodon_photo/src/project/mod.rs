//! A project: `photos.toml` beside the photographs, written by people or by the window.
//!
//! One mark a line and everything in a fixed order, so that a project under version control shows which mark was moved.

mod hours;
mod load;
mod matched;
mod photo_file;
mod source;
mod types;
mod witness;

pub use hours::{Taken, utc_offset_hours};
pub use load::{LoadError, Loaded};
pub use photo_file::PhotoFile;
pub use source::ProjectError;
pub use types::*;
pub use witness::Witnesses;

use crate::camera::Intrinsics;
use crate::exif::PhotoFacts;
use crate::formats::ImportedCameras;
use crate::solve::bundle::Free;
use crate::solve::{Direction, Distance, Edge, Focal, LensGroup, Mark, Params, Photo, Problem, Reference, with_focal};
use glam::{DVec2, DVec3};
use source::Source;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The name of the file that makes a folder a project.
pub const PROJECT_FILE_NAME: &str = "photos.toml";

/// A project that was read and checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Project {
    /// What stands in it.
    pub file: ProjectFile,
    path: PathBuf,
}

impl Project {
    /// Reads and checks a project, given its file or its folder.
    ///
    /// # Errors
    /// The first thing that is wrong, with its place.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ProjectError> {
        let path = path.as_ref();
        let path = if path.is_dir() { path.join(PROJECT_FILE_NAME) } else { path.to_owned() };
        let text = std::fs::read_to_string(&path).map_err(|error| ProjectError {
            file: path.clone(),
            place: None,
            message: format!("the project cannot be read: {error}; give a folder with {PROJECT_FILE_NAME}"),
        })?;
        Self::parse(&text, &path)
    }

    /// Parses and checks the text of a project; `path` is its file.
    ///
    /// # Errors
    /// The first thing that is wrong, with its place.
    pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Self, ProjectError> {
        let source = Source { file: path.as_ref(), text };
        let file: ProjectFile = source.parse()?;
        check(&file, &source)?;
        Ok(Self { file, path: path.as_ref().to_owned() })
    }

    /// The folder from which relative paths start.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
    }

    /// The text of the project, points by name, marks by photograph.
    ///
    /// # Errors
    /// Where a number cannot be written.
    pub fn text(&self) -> Result<String, ProjectError> {
        let mut file = self.file.clone();
        file.point.sort_by(|a, b| a.name.cmp(&b.name));
        toml::to_string(&file).map_err(|error| ProjectError {
            file: self.path.clone(),
            place: None,
            message: format!("the project cannot be written: {error}"),
        })
    }

    /// Writes the project to its file: beside it first, then renamed into place, so that a crash leaves the old or the new one.
    ///
    /// # Errors
    /// Where the folder cannot be written to.
    pub fn save(&self) -> Result<(), ProjectError> {
        let text = self.text()?;
        let fault = |error: std::io::Error| ProjectError {
            file: self.path.clone(),
            place: None,
            message: format!("the project cannot be written: {error}"),
        };
        let beside = self.path.with_extension("toml.new");
        std::fs::write(&beside, text).map_err(fault)?;
        std::fs::rename(&beside, &self.path).map_err(fault)
    }

    /// The parameters that the project gives, with defaults for what it does not.
    #[must_use]
    pub fn params(&self) -> Params {
        let base = Params::default();
        let info = &self.file.project;
        // Who says what marks are good to knows the stone: no fit of a few of them shall narrow that.
        let sigmas = info.mark_sigma_px.map_or([base.mark_sigma_px, base.least_sigma_px], |sigma| [sigma; 2]);
        Params { mark_sigma_px: sigmas[0], least_sigma_px: sigmas[1], seed: info.seed.unwrap_or(base.seed), ..base }
    }

    /// The problem to solve. `facts` are of the photographs, in their order; cameras taken over are found by the photographs' names.
    ///
    /// # Errors
    /// Where a photograph's size is known from nowhere, or photographs of one lens differ in size.
    pub fn problem(&self, facts: &[PhotoFacts], imported: &[ImportedCameras]) -> Result<Problem, ProjectError> {
        let file = &self.file;
        let fault = |message: String| ProjectError { file: self.path.clone(), place: None, message };
        let mut problem = Problem::default();
        let mut lens_of: BTreeMap<String, usize> = BTreeMap::new();
        for (index, entry) in file.photo.iter().enumerate() {
            let facts = facts.get(index).cloned().unwrap_or_default();
            let taken = imported.iter().find_map(|i| i.cameras.iter().find(|c| same_photo(&c.name, entry)));
            let size = entry
                .size_px
                .or(facts.size_px)
                .or(taken.map(|t| [t.camera.intrinsics.width, t.camera.intrinsics.height]).filter(|s| s[0] > 0))
                .ok_or_else(|| {
                    fault(format!(
                        "the size of {} is not known: its file cannot be read; add size_px = [width, height]",
                        entry.name()
                    ))
                })?;
            let key = entry.lens.clone().unwrap_or_else(|| match (&taken, facts.lens_key()) {
                (Some(t), _) => format!("{} taken over", t.lens),
                (None, Some(key)) => format!("{key}, {} x {}", size[0], size[1]),
                (None, None) => format!("of {}", entry.name()),
            });
            let lens = match lens_of.get(&key) {
                Some(&lens) => lens,
                None => {
                    let named = entry.lens.as_ref().and_then(|name| file.lens.iter().find(|l| l.name == *name));
                    let group = match taken {
                        Some(taken) => taken_lens(key.clone(), named, taken.intrinsics(size)),
                        None => lens_group(key.clone(), named, size, &facts),
                    };
                    problem.lenses.push(group);
                    lens_of.insert(key.clone(), problem.lenses.len() - 1);
                    problem.lenses.len() - 1
                }
            };
            let Intrinsics { width, height, .. } = problem.lenses[lens].intrinsics;
            if [width, height] != size {
                return Err(fault(format!(
                    "{} is {} x {} pixels, other photographs of lens {key} are {width} x {height}: give it a lens of its own",
                    entry.name(),
                    size[0],
                    size[1]
                )));
            }
            problem.photos.push(Photo { name: entry.name().to_owned(), lens, pose: taken.map(|t| t.camera.pose) });
        }
        let photo = |name: &str| file.photo.iter().position(|p| p.name() == name);
        let point = |name: &str| file.point.iter().position(|p| p.name == name);
        for (index, entry) in file.point.iter().enumerate() {
            let known_m = entry.known_m.map(DVec3::from);
            problem.points.push(Reference { name: entry.name.clone(), known_m, ground: entry.ground });
            for (name, pixel) in &entry.marks {
                if let Some(photo) = photo(name) {
                    problem.marks.push(Mark { photo, point: index, pixel: DVec2::from(*pixel) });
                }
            }
        }
        for entry in &file.edge {
            if let Some(photo) = photo(&entry.photo) {
                let axis = entry.axis as usize;
                problem.edges.extend(entry.segments.iter().map(|s| Edge { photo, axis, ends: s.map(DVec2::from) }));
            }
        }
        for entry in &file.distance {
            if let (Some(a), Some(b)) = (point(&entry.between[0]), point(&entry.between[1])) {
                problem.distances.push(Distance { between: [a, b], metres: entry.metres });
            }
        }
        for entry in &file.direction {
            if let (Some(a), Some(b)) = (point(&entry.from), point(&entry.to)) {
                problem.directions.push(Direction { between: [a, b], world: entry.toward.unit() });
            }
        }
        Ok(problem)
    }
}

/// Other programs name photographs with or without folders.
fn same_photo(name: &str, entry: &PhotoEntry) -> bool {
    name == entry.file || name.rsplit(['/', '\\']).next() == Some(entry.name())
}

/// A lens taken over, held: its cameras' poses are worth nothing with another. What the project says of it goes before.
fn taken_lens(name: String, entry: Option<&LensEntry>, taken: Intrinsics) -> LensGroup {
    let entry = entry.cloned().unwrap_or_default();
    let focal_px = match entry.focal {
        FocalEntry::Known(px) => px,
        FocalEntry::Exif | FocalEntry::Free => taken.focal_px[0],
    };
    let intrinsics = Intrinsics {
        centre_px: entry.centre_px.unwrap_or(taken.centre_px),
        radial: entry.radial.unwrap_or(taken.radial),
        tangential: entry.tangential.unwrap_or(taken.tangential),
        ..with_focal(&taken, focal_px)
    };
    LensGroup { name, intrinsics, focal: Focal::Known(focal_px), free: Free::default() }
}

fn lens_group(name: String, entry: Option<&LensEntry>, size: [u32; 2], facts: &PhotoFacts) -> LensGroup {
    let [width, height] = size;
    let fallback = LensEntry::default();
    let entry = entry.unwrap_or(&fallback);
    let mut intrinsics = Intrinsics::pinhole(width, height, f64::from(width.max(height)));
    if let Some(centre) = entry.centre_px {
        intrinsics.centre_px = centre;
    }
    intrinsics.radial = entry.radial.unwrap_or_default();
    intrinsics.tangential = entry.tangential.unwrap_or_default();
    let focal = match (entry.focal, facts.focal_px(size)) {
        (FocalEntry::Known(px), _) => Focal::Known(px),
        (FocalEntry::Exif, Some(px)) => Focal::Guess(px),
        _ => Focal::Free,
    };
    let free = match entry.distortion {
        DistortionEntry::None => Free::default(),
        DistortionEntry::Radial1 => Free { radial: 1, ..Free::default() },
        DistortionEntry::Radial2 => Free { radial: 2, ..Free::default() },
        DistortionEntry::Full => Free { radial: 3, tangential: true, centre: true, ..Free::default() },
    };
    LensGroup { name, intrinsics, focal, free }
}

fn check(file: &ProjectFile, source: &Source<'_>) -> Result<(), ProjectError> {
    let number = |i: usize| i.to_string();
    if let Some(sigma) = file.project.mark_sigma_px
        && !(sigma > 0.0 && sigma.is_finite())
    {
        return Err(source.error_at(&["project", "mark_sigma_px"], "mark_sigma_px is above 0"));
    }
    let mut photos = BTreeMap::new();
    for (i, photo) in file.photo.iter().enumerate() {
        let at = number(i);
        if photo.name().is_empty() {
            return Err(source.error_at(&["photo", &at, "file"], "name a photograph's file"));
        }
        if photos.insert(photo.name(), i).is_some() {
            let message = format!("two photographs are called {}: marks could not tell them apart; rename one", photo.name());
            return Err(source.error_at(&["photo", &at, "file"], message));
        }
        if photo.size_px.is_some_and(|s| s.contains(&0)) {
            return Err(source.error_at(&["photo", &at, "size_px"], "width and height are above 0"));
        }
        if let Some(lens) = &photo.lens
            && file.lens.iter().all(|l| l.name != *lens)
        {
            return Err(source.error_at(&["photo", &at, "lens"], format!("there is no [[lens]] called {lens}")));
        }
    }
    for (i, lens) in file.lens.iter().enumerate() {
        if file.lens[..i].iter().any(|l| l.name == lens.name) {
            return Err(source.error_at(&["lens", &number(i), "name"], format!("there are two lenses called {}", lens.name)));
        }
        let numbers =
            lens.centre_px.iter().flatten().chain(lens.radial.iter().flatten()).chain(lens.tangential.iter().flatten());
        if numbers.into_iter().any(|n| !n.is_finite()) {
            return Err(source.error_at(&["lens", &number(i)], "a lens's values are numbers"));
        }
    }
    let mut points = BTreeMap::new();
    for (i, point) in file.point.iter().enumerate() {
        let at = number(i);
        if points.insert(point.name.as_str(), i).is_some() {
            return Err(source.error_at(&["point", &at, "name"], format!("there are two points called {}", point.name)));
        }
        if point.known_m.iter().flatten().any(|n| !n.is_finite()) {
            return Err(source.error_at(&["point", &at, "known_m"], "coordinates are numbers"));
        }
        for (photo, pixel) in &point.marks {
            let place = ["point", &at, "marks", photo];
            if !photos.contains_key(photo.as_str()) {
                let message = format!("{} is marked in {photo}, but there is no [[photo]] of that name", point.name);
                return Err(source.error_at(&place, message));
            }
            if pixel.iter().any(|n| !n.is_finite()) {
                return Err(source.error_at(&place, "a mark is two numbers"));
            }
        }
    }
    for (i, edge) in file.edge.iter().enumerate() {
        let at = number(i);
        if !photos.contains_key(edge.photo.as_str()) {
            return Err(source.error_at(&["edge", &at, "photo"], format!("there is no [[photo]] called {}", edge.photo)));
        }
        if edge.segments.iter().any(|s| s[0] == s[1] || s.iter().flatten().any(|n| !n.is_finite())) {
            return Err(source.error_at(&["edge", &at, "segments"], "a segment has two different ends"));
        }
    }
    let known = |name: &str| points.contains_key(name);
    for (i, distance) in file.distance.iter().enumerate() {
        let at = number(i);
        if let Some(name) = distance.between.iter().find(|n| !known(n)) {
            return Err(source.error_at(&["distance", &at, "between"], format!("there is no [[point]] called {name}")));
        }
        if distance.between[0] == distance.between[1] || !(distance.metres > 0.0 && distance.metres.is_finite()) {
            return Err(source.error_at(&["distance", &at], "a distance lies between two different points and is above 0"));
        }
    }
    for (i, direction) in file.direction.iter().enumerate() {
        let at = number(i);
        if let Some(name) = [&direction.from, &direction.to].into_iter().find(|n| !known(n)) {
            return Err(source.error_at(&["direction", &at], format!("there is no [[point]] called {name}")));
        }
        if direction.from == direction.to {
            return Err(source.error_at(&["direction", &at], "a direction leads from one point to another"));
        }
    }
    hours::check(file, source)
}

#[cfg(test)]
mod tests;
