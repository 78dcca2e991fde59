//! A site: the folder with `site.toml` that a bake starts from.
//!
//! [`Site::read`] answers with a site whose every number is in range and whose every file exists, or with a [`ConfigError`]
//! that names the line and column to mend.

mod actor;
mod budget;
mod check;
mod detail;
mod files;
mod lamp;
mod living;
mod living_check;
mod living_template;
mod matte;
mod placement;
mod prepare;
mod template;
mod types;
mod values;
mod weathering;

pub use actor::{Actor, CACHE_FRAMES_PER_S_RANGE, DEFAULT_WALK_SPEED, Ground, MAX_COUNT, MAX_LANES, Walk};
pub use budget::Budget;
pub(crate) use check::check_lone_actor as check_actor;
pub(crate) use check::check_lone_lamp as check_lamp;
pub(crate) use check::check_lone_matte as check_matte;
pub use detail::{Along, DEFAULT_DETAIL_TEXELS, Detail, DetailMapping, DetailPattern, MAX_DETAILS};
pub use files::{InputFile, InputKind, told_path};
pub use heliodon_math::unit::Unit;
pub use lamp::Lamp;
pub use living::{
    Echo, Faces, Film, FilmKind, Living, Material, ParticleKind, Particles, Region, SoundSource, Story, Thing, View, Walls,
    Way, is_font,
};
pub(crate) use living_check::check_lone_living as check_living;
pub use matte::{MAX_MATTE_CORNERS, Matte};
pub use prepare::{Prepare, PurgeEffort, Winding};
pub use types::{
    Albedo, Bake, BelowHorizon, Between, DEFAULT_GRID_M, DEFAULT_TEXELS, Display, LightStorage, MAX_SKY_STEPS, MAX_SUN_STEPS,
    Mapping, Part, Role, Room, SiteFile, SiteInfo, Sky, SkyModel, Transfer, UpAxis,
};
pub use values::{Date, ProbeTimes, TimeOfDay, UtcOffset};
pub use weathering::{OwnWeathering, PartWeathering, Weathering};

use crate::config::{ConfigError, Kind, Source};
use std::ops::Deref;
use std::path::{Path, PathBuf};

/// The name of the file that makes a folder a site.
pub const SITE_FILE_NAME: &str = "site.toml";

const KIND: Kind = Kind {
    many_tables: &[
        "part",
        "room",
        "actor",
        "light",
        "matte",
        "region",
        "view",
        "path",
        "material",
        "film",
        "sound",
        "echo",
        "particles",
    ],
    subject: "a site",
    reference: "schema/site.schema.json and `heliodon new` show what can be written",
    missing: &[
        ("site", "begin with a table [site] that holds name = \"...\""),
        ("sky", "add a table [sky] with probes and mapping, or with model and date"),
    ],
    no_file: "give a site's folder or its site.toml; `heliodon new DIR` makes one",
};

/// A site that was read and checked; dereferences to its [`SiteFile`].
#[derive(Clone, Debug)]
pub struct Site {
    file: SiteFile,
    source: Source,
}

impl Site {
    /// Reads and checks `site.toml`, given itself or its folder, and looks for every file that it names.
    ///
    /// # Errors
    /// The first thing that is wrong, with its place and remedy.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ConfigError> {
        let path = path.as_ref();
        let file = if path.is_dir() { path.join(SITE_FILE_NAME) } else { path.to_owned() };
        let site = Self::from_source(Source::read(&KIND, &file)?)?;
        site.input_files()?;
        Ok(site)
    }

    /// Parses and checks the text of a `site.toml`; `file` is its path, from which relative paths start and which messages
    /// name. Looks for no other file.
    ///
    /// # Errors
    /// The first thing that is wrong, with its place and remedy.
    pub fn parse(text: &str, file: impl AsRef<Path>) -> Result<Self, ConfigError> {
        Self::from_source(Source::new(&KIND, file.as_ref(), text))
    }

    fn from_source(source: Source) -> Result<Self, ConfigError> {
        let file = source.parse()?;
        check::check(&file).map_err(|fault| source.fault(fault))?;
        Ok(Self { file, source })
    }

    /// The folder from which relative paths start.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.source.folder()
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
    pub fn error_at(&self, key_path: &[&str], message: impl Into<String>, remedy: impl Into<String>) -> ConfigError {
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
    pub fn validate(&self) -> Result<(), ConfigError> {
        check::check(self).map_err(|fault| ConfigError {
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
        crate::config::json_schema::<Self>()
    }
}
