//! A site: the folder with `site.toml` that a bake starts from.
//!
//! [`Site::read`] answers with a site whose every number is in range and whose every file exists, or with a [`SiteError`]
//! that names the line and column to mend.

mod actor;
mod budget;
mod check;
mod detail;
mod error;
mod files;
mod lamp;
mod matte;
mod parse;
mod placement;
mod prepare;
mod template;
mod types;
mod values;
mod weathering;

pub use actor::{Actor, CACHE_FRAMES_PER_S_RANGE, DEFAULT_WALK_SPEED, Ground, Walk};
pub use budget::Budget;
pub(crate) use check::check_lone_actor as check_actor;
pub(crate) use check::check_lone_lamp as check_lamp;
pub(crate) use check::check_lone_matte as check_matte;
pub use detail::{Along, DEFAULT_DETAIL_TEXELS, Detail, DetailMapping, DetailPattern};
pub use error::SiteError;
pub use files::{InputFile, InputKind};
pub use heliodon_math::unit::Unit;
pub use lamp::Lamp;
pub use matte::{MAX_MATTE_CORNERS, Matte};
pub use prepare::{Prepare, Winding};
pub use types::{
    Albedo, Bake, BelowHorizon, Between, DEFAULT_GRID_M, DEFAULT_TEXELS, Display, LightStorage, MAX_SKY_STEPS, MAX_SUN_STEPS,
    Mapping, Part, Role, Room, SiteFile, SiteInfo, Sky, SkyModel, Transfer, UpAxis,
};
pub use values::{Date, ProbeTimes, TimeOfDay, UtcOffset};
pub use weathering::{OwnWeathering, PartWeathering, Weathering};

use parse::Source;
use std::ops::Deref;
use std::path::{Path, PathBuf};

/// The name of the file that makes a folder a site.
pub const SITE_FILE_NAME: &str = "site.toml";

/// A site that was read and checked; dereferences to its [`SiteFile`].
#[derive(Clone, Debug)]
pub struct Site {
    file: SiteFile,
    folder: PathBuf,
    source: Source,
}

impl Site {
    /// Reads and checks `site.toml`, given itself or its folder, and looks for every file that it names.
    ///
    /// # Errors
    /// The first thing that is wrong, with its place and remedy.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SiteError> {
        let path = path.as_ref();
        let file = if path.is_dir() { path.join(SITE_FILE_NAME) } else { path.to_owned() };
        let text = std::fs::read_to_string(&file).map_err(|error| SiteError {
            file: file.clone(),
            place: None,
            message: match error.kind() {
                std::io::ErrorKind::NotFound => "there is no such file".to_owned(),
                std::io::ErrorKind::InvalidData => "the file is not UTF-8 text".to_owned(),
                _ => format!("the file cannot be read: {error}"),
            },
            remedy: "give a site's folder or its site.toml; `heliodon new DIR` makes one".to_owned(),
        })?;
        let site = Self::parse(&text, &file)?;
        site.input_files()?;
        Ok(site)
    }

    /// Parses and checks the text of a `site.toml`; `file` is its path, from which relative paths start and which messages
    /// name. Looks for no other file.
    ///
    /// # Errors
    /// The first thing that is wrong, with its place and remedy.
    pub fn parse(text: &str, file: impl AsRef<Path>) -> Result<Self, SiteError> {
        let source = Source::new(file.as_ref(), text);
        let parsed = source.parse()?;
        check::check(&parsed).map_err(|fault| source.error_at(&fault.path, fault.message, fault.remedy))?;
        let folder = file.as_ref().parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")).to_owned();
        Ok(Self { file: parsed, folder, source })
    }

    /// The folder from which relative paths start.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The path of `site.toml`.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.source.file()
    }

    /// The text of `site.toml` as it was read; the file may be another by now.
    #[must_use]
    pub fn text(&self) -> &str {
        self.source.text()
    }

    /// What `site.toml` holds.
    #[must_use]
    pub fn file(&self) -> &SiteFile {
        &self.file
    }

    /// Whether `site.toml` itself has a key in a table, rather than leaving it to its default.
    #[must_use]
    pub fn says(&self, table: &str, key: &str) -> bool {
        self.source.has(table, key)
    }

    /// An error about a key of `site.toml`, for what only later stages can find: `&["part", "0", "file"]`.
    #[must_use]
    pub fn error_at(&self, key_path: &[&str], message: impl Into<String>, remedy: impl Into<String>) -> SiteError {
        let path: Vec<String> = key_path.iter().map(|&s| s.to_owned()).collect();
        self.source.error_at(&path, message.into(), remedy.into())
    }
}

impl Deref for Site {
    type Target = SiteFile;

    fn deref(&self) -> &SiteFile {
        &self.file
    }
}

impl SiteFile {
    /// Checks everything that can be checked without reading other files.
    ///
    /// # Errors
    /// The first fault, without a place; `file` is `site.toml`.
    pub fn validate(&self) -> Result<(), SiteError> {
        check::check(self).map_err(|fault| SiteError {
            file: PathBuf::from(SITE_FILE_NAME),
            place: None,
            message: format!("{}: {}", fault.path.join("."), fault.message),
            remedy: fault.remedy,
        })
    }

    /// The commented text of a `site.toml` that holds this, for people to go on from.
    #[must_use]
    pub fn to_toml_string(&self) -> String {
        template::write(self)
    }

    /// The JSON schema of `site.toml`, as committed in `schema/site.schema.json`.
    #[must_use]
    pub fn json_schema() -> String {
        let schema = schemars::schema_for!(Self);
        let mut text = serde_json::to_string_pretty(&schema).unwrap_or_default();
        text.push('\n');
        text
    }
}
