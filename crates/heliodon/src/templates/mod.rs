//! Sites to start from.

mod sundial;
mod temple;
mod workshop;

use crate::failure::wrong_arguments;
use crate::output::count;
use anyhow::{Context, Result, ensure};
use clap::ValueEnum;
use heliodon_bundle::site::{Bake, BelowHorizon, Budget, Display, Part, Role, SITE_FILE_NAME, SiteFile, SiteInfo, Sky};
use heliodon_mesh::export::write_ply;
use heliodon_mesh::part::{PartRole, SitePart};
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

/// What a new site holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Template {
    /// A Doric temple with the Parthenon's measures, in ruins, under the clear sky of Athens
    Temple,
    /// A sculptor's workshop with the measures of the one at Olympia: an interior of few large polygons
    Workshop,
    /// A sundial's pillar on a plate under a clear sky
    Sundial,
    /// The same pillar under one grey sky image: the smallest site
    Grey,
}

impl Template {
    /// The fewest and the most triangles that it can have.
    fn triangles(self) -> (u64, u64) {
        match self {
            Self::Temple => (50_000, 100_000_000),
            Self::Workshop => (workshop::LEAST_TRIANGLES, 2_000_000),
            Self::Sundial | Self::Grey => (1_000, 20_000_000),
        }
    }
}

/// How it is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TemplateParams {
    /// Which one.
    pub template: Template,
    /// About how many triangles; `None` for the template's own choice.
    pub triangles: Option<u64>,
    /// Seed of what is random in it.
    pub seed: u64,
}

/// What was made.
#[derive(Debug, serde::Serialize)]
pub struct NewSite {
    /// The site's name.
    pub name: String,
    /// Triangles over all parts.
    pub triangles: u64,
    /// Files in the folder, in the order of their writing.
    pub files: Vec<String>,
}

/// Where a site is made before it is put in its place: an interrupted run leaves nothing else, and the next one removes it.
const BEGUN_FOLDER: &str = ".heliodon-new";

/// Makes a site in an empty or new folder, where it appears whole or not at all; `finish` may add to it before.
///
/// # Errors
/// A folder that holds something already, triangle counts that the template cannot have, files that cannot be written.
pub fn make(folder: &Path, params: &TemplateParams, finish: impl FnOnce(&Path, &NewSite) -> Result<()>) -> Result<NewSite> {
    let (least, most) = params.template.triangles();
    if let Some(triangles) = params.triangles.filter(|triangles| !(least..=most).contains(triangles)) {
        wrong_arguments!(
            "this template has {} to {} triangles, not {}; give --triangles N in that range",
            count(least),
            count(most),
            count(triangles)
        );
    }
    let begun = begun_folder(folder)?;
    let failed = || format!("cannot make the folder {}", folder.display());
    match fs::remove_dir_all(&begun) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error).with_context(failed),
        _ => fs::create_dir_all(&begun).with_context(failed)?,
    }
    let made = match params.template {
        Template::Temple => temple::make(&begun, params),
        Template::Workshop => workshop::make(&begun, params),
        Template::Sundial => sundial::make(&begun, params, sundial::Light::ClearSky),
        Template::Grey => sundial::make(&begun, params, sundial::Light::GreyImage),
    };
    let placed = made.and_then(|site| {
        finish(&begun, &site)?;
        put_in_place(&begun, folder).with_context(|| format!("cannot write {}", folder.display()))?;
        Ok(site)
    });
    placed.map_err(|error| {
        let _ = fs::remove_dir_all(&begun);
        anyhow::Error::msg(format!("{error:#}").replace(&begun.display().to_string(), &folder.display().to_string()))
    })
}

/// Where the site for `folder` is made: beside it, or, where it stands there already and empty, in it (it may be the one that a shell is in).
fn begun_folder(folder: &Path) -> Result<PathBuf> {
    if !folder.exists() {
        let mut name = OsString::from(format!("{BEGUN_FOLDER}-"));
        name.push(folder.file_name().with_context(|| format!("{} is no name for a folder", folder.display()))?);
        return Ok(folder.with_file_name(name));
    }
    ensure!(folder.is_dir(), "{} is a file; name a new folder", folder.display());
    for entry in fs::read_dir(folder).with_context(|| format!("cannot look into {}", folder.display()))? {
        ensure!(
            entry?.file_name() == BEGUN_FOLDER,
            "{} is not empty; name a new folder, so that nothing is overwritten",
            folder.display()
        );
    }
    Ok(folder.join(BEGUN_FOLDER))
}

/// Puts what is in `begun` into `folder`, `site.toml` last.
fn put_in_place(begun: &Path, folder: &Path) -> std::io::Result<()> {
    if !folder.exists() {
        return fs::rename(begun, folder);
    }
    let mut names: Vec<OsString> = fs::read_dir(begun)?.map(|entry| entry.map(|e| e.file_name())).collect::<Result<_, _>>()?;
    names.sort_by_key(|name| name == SITE_FILE_NAME);
    names.iter().try_for_each(|name| fs::rename(begun.join(name), folder.join(name)))?;
    fs::remove_dir(begun)
}

/// Writes `site.toml`, last of all: what it names is there then.
fn write_site(folder: &Path, site: &SiteFile) -> Result<()> {
    site.validate().context("the template is wrong")?;
    let path = folder.join(SITE_FILE_NAME);
    fs::write(&path, site.to_toml_string()).with_context(|| format!("cannot write {}", path.display()))
}

/// A part whose file is in metres and upright.
fn part(file: &str, name: &str, role: Role) -> Part {
    Part { name: Some(name.to_owned()), role, ..Part::of_file(file) }
}

/// Writes meshes as PLY files and adds them to the site; answers the files' names.
fn write_parts(folder: &Path, parts: &[SitePart], site: &mut SiteFile) -> Result<Vec<String>> {
    let mut files = Vec::new();
    for made in parts {
        let file = format!("{}.ply", made.name);
        let path = folder.join(&file);
        write_ply(&path, &made.mesh, None).with_context(|| format!("cannot write {}", path.display()))?;
        let role = match made.role {
            PartRole::Scan => Role::Scan,
            PartRole::Ground => Role::Ground,
            PartRole::Filling => Role::Filling,
            PartRole::Prop => Role::Prop,
        };
        site.parts.push(part(&file, made.name, role));
        files.push(file);
    }
    Ok(files)
}

/// The seed of a procedural monument; none where its own is to be kept.
fn short_seed(params: &TemplateParams) -> Option<u32> {
    (params.seed != 0).then_some((params.seed ^ (params.seed >> 32)) as u32)
}

/// A site in Athens without parts.
fn athens(name: &str, sky: Sky, bake: Bake) -> SiteFile {
    SiteFile {
        site: SiteInfo {
            name: name.to_owned(),
            latitude_deg: Some(37.9715),
            longitude_deg: Some(23.7267),
            // Eastern European Summer Time
            utc_offset: heliodon_bundle::site::UtcOffset::from_seconds(3 * 3600).unwrap_or_default(),
            north_deg: 0.0,
            origin: [0.0; 3],
        },
        parts: Vec::new(),
        sky,
        bake,
        rooms: Vec::new(),
        actors: Vec::new(),
        lamps: Vec::new(),
        mattes: Vec::new(),
        regions: Vec::new(),
        views: Vec::new(),
        paths: Vec::new(),
        materials: Vec::new(),
        films: Vec::new(),
        sounds: Vec::new(),
        echoes: Vec::new(),
        particles: Vec::new(),
        story: None,
        prepare: None,
        weathering: None,
        display: Display::default(),
        budget: Budget::default(),
    }
}

/// The clear sky of a day.
fn clear_sky(date: &str) -> Result<Sky> {
    Ok(Sky {
        model: Some(heliodon_bundle::site::SkyModel::Atmosphere),
        date: Some(date.parse().map_err(anyhow::Error::msg)?),
        opening_deg: 180.0,
        below_horizon: BelowHorizon::Keep,
        ..Sky::default()
    })
}
