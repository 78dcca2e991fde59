//! The tables of `site.toml`, one type each.
//!
//! Every key that is not here is an error, so that a slip of the pen is not taken for a default.

use super::actor::Actor;
use super::budget::Budget;
use super::detail::{Detail, one_or_several};
use super::lamp::Lamp;
use super::living::{Echo, Film, Living, Material, Particles, Region, SoundSource, Story, View, Way};
use super::matte::Matte;
use super::prepare::Prepare;
use super::told_path;
use super::values::{Date, ProbeTimes, TimeOfDay, UtcOffset};
use super::weathering::{PartWeathering, Weathering};
use heliodon_math::unit::Unit;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The most sun steps that the bundle format holds.
pub const MAX_SUN_STEPS: u32 = 1024;
/// The most entries of the sky in a day: one for each second would be more than anyone can store.
pub const MAX_SKY_STEPS: u32 = 16_384;

/// The distance between points of the light grid unless a site says otherwise: less than a figure's width, metres.
pub const DEFAULT_GRID_M: f64 = 0.5;

/// Texels along a side of the atlas unless a site says otherwise.
pub const DEFAULT_TEXELS: u32 = 2048;

/// All of `site.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "site.toml", description = "A site of Heliodon: a monument, its sky, and how its light is baked.")]
pub struct SiteFile {
    /// What and where the site is.
    pub site: SiteInfo,
    /// The geometry, in the order in which it is stored.
    #[serde(rename = "part", default)]
    pub parts: Vec<Part>,
    /// The light of the day.
    pub sky: Sky,
    /// How light is computed and stored.
    #[serde(default)]
    pub bake: Bake,
    /// Where a visitor's eyes can be.
    #[serde(rename = "room", default, skip_serializing_if = "Vec::is_empty")]
    pub rooms: Vec<Room>,
    /// Figures that walk or stand in the site.
    #[serde(rename = "actor", default, skip_serializing_if = "Vec::is_empty")]
    pub actors: Vec<Actor>,
    /// Lamps.
    #[serde(rename = "light", default, skip_serializing_if = "Vec::is_empty")]
    pub lamps: Vec<Lamp>,
    /// Invisible polygons that hide what lies behind them.
    #[serde(rename = "matte", default, skip_serializing_if = "Vec::is_empty")]
    pub mattes: Vec<Matte>,
    /// Boxes that visitors enter and leave.
    #[serde(rename = "region", default, skip_serializing_if = "Vec::is_empty")]
    pub regions: Vec<Region>,
    /// Places to look from.
    #[serde(rename = "view", default, skip_serializing_if = "Vec::is_empty")]
    pub views: Vec<View>,
    /// Ways that actors follow and visitors are shown.
    #[serde(rename = "path", default, skip_serializing_if = "Vec::is_empty")]
    pub paths: Vec<Way>,
    /// What parts can be covered with while the site is visited.
    #[serde(rename = "material", default, skip_serializing_if = "Vec::is_empty")]
    pub materials: Vec<Material>,
    /// Films.
    #[serde(rename = "film", default, skip_serializing_if = "Vec::is_empty")]
    pub films: Vec<Film>,
    /// Sounds.
    #[serde(rename = "sound", default, skip_serializing_if = "Vec::is_empty")]
    pub sounds: Vec<SoundSource>,
    /// Boxes with an echo.
    #[serde(rename = "echo", default, skip_serializing_if = "Vec::is_empty")]
    pub echoes: Vec<Echo>,
    /// Fires, dust, smoke, sparks, water.
    #[serde(rename = "particles", default, skip_serializing_if = "Vec::is_empty")]
    pub particles: Vec<Particles>,
    /// Scripts and their texts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub story: Option<Story>,
    /// How geometry is cleaned and reduced; without it, it is taken as it comes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prepare: Option<Prepare>,
    /// What the weather has left on the surfaces; without it, nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weathering: Option<Weathering>,
    /// The display that the site is prepared for.
    #[serde(default)]
    pub display: Display,
    /// The memory that there is.
    #[serde(default, skip_serializing_if = "Budget::is_empty")]
    pub budget: Budget,
}

impl SiteFile {
    /// What happens in the site.
    #[must_use]
    pub fn living(&self) -> Living {
        Living {
            regions: self.regions.clone(),
            views: self.views.clone(),
            paths: self.paths.clone(),
            materials: self.materials.clone(),
            films: self.films.clone(),
            sounds: self.sounds.clone(),
            echoes: self.echoes.clone(),
            particles: self.particles.clone(),
            story: self.story.clone(),
        }
    }
}

/// `[site]`: what and where the site is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SiteInfo {
    /// The site's name, for people.
    pub name: String,
    /// Geographic latitude in degrees, north positive. Needed by sky models.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -90, max = 90))]
    pub latitude_deg: Option<f64>,
    /// Geographic longitude in degrees, east positive. Needed by sky models.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -180, max = 180))]
    pub longitude_deg: Option<f64>,
    /// The offset from UTC in which all times of day of the site are written, such as "+02:00".
    #[serde(default)]
    pub utc_offset: UtcOffset,
    /// The compass bearing, clockwise, of the model's -Z, in degrees.
    #[serde(default)]
    pub north_deg: f64,
    /// Subtracted on reading, in f64 (survey coordinates), from the coordinates of parts, actors, lamps, mattes, regions, views, paths,
    /// films, sounds, echoes and particles. Not from those of `[[room]]`: rooms say where they are once it is subtracted.
    #[serde(default)]
    pub origin: [f64; 3],
}

/// `[[part]]`: one or several files of geometry that share role, albedo and placement.
///
/// Placement applies to a file's points in this order: `unit` and `up`, `scale`, `rotate_deg`, `translate`, then the site's
/// `origin` is subtracted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// A PLY, OBJ, glTF, GLB or STL file relative to the site's folder; globs (`*`, `?`, `[a-z]`, `**`) name several.
    pub file: String,
    /// The part's name, for people and in site.glb. Default: the file's name without its ending; of "scans/*.ply" the folder's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// What the geometry is.
    #[serde(default)]
    pub role: Role,
    /// Albedo in place of whatever colours the files have: linear [r, g, b] in [0, 1], or an image (PNG, JPEG) for the files'
    /// texture coordinates. Default: the files' own colours, and 0.5 without any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub albedo: Option<Albedo>,
    /// An image (PNG, JPEG) as large as the albedo's that says what its colours rest on, as `heliodon photo` writes it: white where a photograph saw the
    /// surface, mid grey where it was guessed, in between as likely as that; black lies on no surface. Visitors can have what was guessed shown. Default: nothing is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub evidence: Option<String>,
    /// The views.json of `heliodon photo texture --views`: what single photographs saw of the surface, as large as the albedo's image, which whoever stands where
    /// a photograph was taken sees in its place. Default: the albedo is the same from everywhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub views: Option<String>,
    /// The length that the file's numbers count.
    #[serde(default)]
    #[schemars(schema_with = "unit_schema")]
    pub unit: Unit,
    /// The file's axis that points up. With "z", a point (x, y, z) becomes (x, z, -y).
    #[serde(default)]
    pub up: UpAxis,
    /// Moves the part, in metres.
    #[serde(default)]
    pub translate: [f64; 3],
    /// Turns the part about the fixed axes X, then Y, then Z, in degrees, counter-clockwise seen against the axis.
    #[serde(default)]
    pub rotate_deg: [f64; 3],
    /// Multiplies the part's size; negative mirrors it through its origin.
    #[serde(default = "one")]
    pub scale: f64,
    /// Edges where faces meet at more than this angle in degrees are hard, and the normals are computed, whatever the files say; 180
    /// rounds everything. Default: the files' normals; without any, computed ones that leave STL's edges of more than 60 degrees hard,
    /// for its facets are all that it has, and round everything else.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 180))]
    pub crease_deg: Option<f64>,
    /// Where light is stored.
    #[serde(default)]
    pub light: LightStorage,
    /// Texels along a metre beside other parts that are lit by texels: 2 has twice as many. Surfaces far from all rooms have fewer in any case.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    #[schemars(range(min = 0.01, max = 100))]
    pub texels: f64,
    /// How the part departs from `[weathering]`: `false`, or a table of what is its own. Default: it does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weathering: Option<PartWeathering>,
    /// A fine pattern on its surfaces, for who comes near: `detail = { kind = "stone" }`; or several, each for some of its materials (`[[part.detail]]`). Default: none.
    #[serde(default, with = "one_or_several", skip_serializing_if = "Vec::is_empty")]
    #[schemars(schema_with = "one_or_several::schema")]
    pub detail: Vec<Detail>,
    /// Objects of it that are smaller than so many pixels are not drawn, where small things are left out; in place of the viewer's own threshold. Much for what is of little
    /// importance, as plants, 0 for what is to be seen however small it is. Default: the viewer's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 1000))]
    pub least_px: Option<f64>,
}

pub(super) fn unit_schema(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "enum": Unit::ALL.map(Unit::name) })
}

impl Part {
    /// A part of which nothing is said but its file.
    #[must_use]
    pub fn of_file(file: impl Into<String>) -> Self {
        Self {
            file: file.into(),
            name: None,
            role: Role::default(),
            albedo: None,
            evidence: None,
            views: None,
            unit: Unit::default(),
            up: UpAxis::default(),
            translate: [0.0; 3],
            rotate_deg: [0.0; 3],
            scale: 1.0,
            crease_deg: None,
            light: LightStorage::default(),
            texels: 1.0,
            weathering: None,
            detail: Vec::new(),
            least_px: None,
        }
    }

    /// Whether any of its details is for materials of some names.
    #[must_use]
    pub fn has_material_details(&self) -> bool {
        self.detail.iter().any(|detail| detail.material.is_some())
    }

    /// The part without what is said of it besides its file, its name and its role.
    #[must_use]
    pub fn bare(&self) -> Self {
        Self { name: self.name.clone(), role: self.role, ..Self::of_file(self.file.clone()) }
    }

    /// The part with its files as manifests tell them ([`told_path`]).
    #[must_use]
    pub fn told(&self) -> Self {
        let told = |file: &String| told_path(Path::new(file));
        Self {
            file: told(&self.file),
            albedo: self.albedo.as_ref().map(|albedo| match albedo {
                Albedo::Image(image) => Albedo::Image(told(image)),
                Albedo::Rgb(rgb) => Albedo::Rgb(*rgb),
            }),
            evidence: self.evidence.as_ref().map(told),
            views: self.views.as_ref().map(told),
            detail: self
                .detail
                .iter()
                .map(|detail| Detail { file: detail.file.as_ref().map(told), ..detail.clone() })
                .collect(),
            ..self.clone()
        }
    }

    /// The part's name: as given, else of its file, without folders and ending; of a pattern that names nothing but an ending
    /// (`scans/*.ply`) its folder.
    #[must_use]
    pub fn display_name(&self) -> String {
        if let Some(name) = &self.name {
            return name.clone();
        }
        let names = |part: &&str| !part.trim_matches(['*', '?', '.']).is_empty();
        let mut folders = self.file.rsplit('/');
        let file = folders.next().unwrap_or_default();
        let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem);
        [stem].into_iter().chain(folders).find(names).unwrap_or(&self.file).to_owned()
    }
}

fn one() -> f64 {
    1.0
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's skip_serializing_if passes a reference")]
fn is_one(value: &f64) -> bool {
    *value == 1.0
}

/// What a part is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// The monument itself, dense.
    #[default]
    Scan,
    /// What it stands on; walkers stand on it too.
    Ground,
    /// Modelled geometry that closes the holes of a scan.
    Filling,
    /// Anything else.
    Prop,
}

/// Albedo of a part: a colour or an image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "albedo is [r, g, b] in linear numbers from 0 to 1, or the path of an image")]
pub enum Albedo {
    /// Linear Rec. 709, each in [0, 1].
    Rgb([f64; 3]),
    /// An 8-bit sRGB image (PNG, JPEG) relative to the site's folder, laid on by the files' texture coordinates.
    Image(String),
}

/// The axis that points up in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum UpAxis {
    /// +Y, as in glTF.
    #[default]
    Y,
    /// +Z, as surveyors have it.
    Z,
}

/// Where a part's light is stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum LightStorage {
    /// In texels where `[bake]` gives them and the part's triangles, as its files have them, are large, seen from the rooms; else at vertices.
    #[default]
    Auto,
    /// At vertices.
    Vertex,
    /// In texels of an atlas that all such parts share.
    Texel,
}

/// `[sky]`: probes, or a model of the clear sky. Exactly one of `probes` and `model` is given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Sky {
    /// HDR images (.hdr, .exr) relative to the site's folder; globs name a series.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub probes: Option<String>,
    /// How the probes map directions to pixels. Needed with `probes`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mapping: Option<Mapping>,
    /// When the probes of a series were taken.
    #[serde(skip_serializing_if = "ProbeTimes::are_in_names")]
    pub times: ProbeTimes,
    /// What holds between two probes' times.
    pub between: Between,
    /// Opening angle of a fisheye probe, degrees.
    #[serde(skip_serializing_if = "is_half_turn")]
    #[schemars(range(max = 360), extend("exclusiveMinimum" = 0))]
    pub opening_deg: f64,
    /// Turns the probes clockwise seen from above, degrees; added to what the mapping says.
    pub turn_deg: f64,
    /// What of the probes below the horizon gives light.
    pub below_horizon: BelowHorizon,
    /// The sun's irradiance at normal incidence, linear [r, g, b] in the probes' unit, in place of what a clipped probe shows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sun_irradiance: Option<[f64; 3]>,
    /// A model of the clear sky, in place of probes. Needs `date` and the site's latitude and longitude.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<SkyModel>,
    /// The model's day, ISO 8601, proleptic Gregorian; years before 1 CE as -0437.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub date: Option<Date>,
    /// The model's turbidity: 2 is very clear, 3 clear, 6 hazy. Default 2.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 10))]
    pub turbidity: Option<f64>,
}

impl Default for Sky {
    fn default() -> Self {
        Self {
            probes: None,
            mapping: None,
            times: ProbeTimes::InNames,
            between: Between::Interpolate,
            opening_deg: 180.0,
            turn_deg: 0.0,
            below_horizon: BelowHorizon::Keep,
            sun_irradiance: None,
            model: None,
            date: None,
            turbidity: None,
        }
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's skip_serializing_if passes a reference")]
fn is_half_turn(angle_deg: &f64) -> bool {
    *angle_deg == 180.0
}

/// How a probe maps directions to pixels. +Y up, +X east, -Z north.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Mapping {
    /// Latitude-longitude: the middle column looks north, east to its right, the top row up.
    LatLong,
    /// Angular (light probe): the whole sphere seen along -Z, radius proportional to the angle from -Z.
    Angular,
    /// Mirror ball: as angular, radius = sin(angle / 2).
    MirrorBall,
    /// Faces of a cube: a cross, 3 x 4 or 4 x 3, or a strip, 6 x 1 or 1 x 6.
    CubeCross,
    /// Equidistant fisheye of the upper half, north at the top, east at the left.
    Fisheye,
}

/// What holds between two probes' times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Between {
    /// The nearer probe.
    Nearest,
    /// Both, weighted by their distance in time.
    #[default]
    Interpolate,
}

/// What of a probe below the horizon gives light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BelowHorizon {
    /// What the probe shows.
    #[default]
    Keep,
    /// Nothing.
    Black,
    /// The upper half, mirrored.
    Mirror,
}

/// A model of the clear sky.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SkyModel {
    /// Scattering in the atmosphere, valid into twilight.
    Atmosphere,
    /// Hosek and Wilkie 2012, for a sun above the horizon.
    HosekWilkie,
}

/// `[bake]`: how light is computed and stored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Bake {
    /// Sun positions of the day, 1 to 1,024; 32 more cost 4 bytes a vertex, and shadow rays in proportion.
    #[schemars(range(min = 1, max = 1024))]
    pub sun_steps: u32,
    /// Sky entries of the day, spread evenly over the same span. Default: two for each sun step.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 16384))]
    pub sky_steps: Option<u32>,
    /// The first step's time. Default: the probes' first, or civil dawn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first: Option<TimeOfDay>,
    /// The last step's time. Default: the probes' last, or civil dusk.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last: Option<TimeOfDay>,
    /// Highest band of the spherical harmonics: 1 stores 4 coefficients, 2 stores 9 (sharper shading under uneven skies).
    #[schemars(range(min = 1, max = 2))]
    pub order: u32,
    /// Times that light is reflected between surfaces; 0 keeps only what comes straight from sky and sun.
    #[schemars(range(max = 64))]
    pub bounces: u32,
    /// Rays of each point, spread over the hemisphere that its surface sees; more cost time in proportion and leave less noise.
    #[schemars(range(min = 16, max = 1048576))]
    pub samples: u32,
    /// Seed of whatever is random.
    pub seed: u64,
    /// How far off the surface rays start, metres. Default: from the size of the scene and its triangles.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset_m: Option<f64>,
    /// The distance, in metres, between the points of space at which the light of rooms and actors is baked. Default 0.5. Half of it:
    /// shadows that fall on actors are twice as sharp, at eight times the points.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 10))]
    pub grid_m: Option<f64>,
    /// Texels along a side of the atlas that lights parts in texels, a multiple of 4. Default 2048. Where it is given, parts that say nothing of their `light` are lit by texels if their triangles are large.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 64, max = 16384))]
    pub texels: Option<u32>,
    /// Whether sky light keeps the colour that it takes on by bouncing.
    pub transfer: Transfer,
    /// Whether the sun's bounced light is baked.
    pub sun_bounce: bool,
}

impl Default for Bake {
    fn default() -> Self {
        Self {
            sun_steps: 92,
            sky_steps: None,
            first: None,
            last: None,
            order: 1,
            bounces: 4,
            samples: 1024,
            seed: 0,
            offset_m: None,
            grid_m: None,
            texels: None,
            transfer: Transfer::Mono,
            sun_bounce: true,
        }
    }
}

impl Bake {
    /// Sky entries of the day: as given, or two for each sun step.
    #[must_use]
    pub fn effective_sky_steps(&self) -> u32 {
        self.sky_steps.unwrap_or(self.sun_steps * 2)
    }

    /// The distance between points of the light grid, metres: as given, or [`DEFAULT_GRID_M`].
    #[must_use]
    pub fn effective_grid_m(&self) -> f64 {
        self.grid_m.unwrap_or(DEFAULT_GRID_M)
    }

    /// Texels along a side of the atlas: as given, or [`DEFAULT_TEXELS`].
    #[must_use]
    pub fn effective_texels(&self) -> u32 {
        self.texels.unwrap_or(DEFAULT_TEXELS)
    }

    /// Coefficients of the sky transfer per channel: `(order + 1)^2`.
    #[must_use]
    pub fn coefficients(&self) -> u32 {
        (self.order + 1) * (self.order + 1)
    }

    /// Channels of the stored light: 1 or 3.
    #[must_use]
    pub fn channels(&self) -> u32 {
        match self.transfer {
            Transfer::Mono => 1,
            Transfer::Rgb => 3,
        }
    }
}

/// Channels of the stored light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Transfer {
    /// One, as in the paper: bounces keep the sky's colour.
    #[default]
    Mono,
    /// Three: bounces take on the colour of what they meet. Three times the space.
    Rgb,
}

/// `[[room]]`: the box where a visitor's eyes can be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Room {
    /// The room's name.
    pub name: String,
    /// The box's lower corner, metres, once the site's `origin` is subtracted, as all of a room's coordinates.
    pub min: [f64; 3],
    /// The box's upper corner.
    pub max: [f64; 3],
    /// Virtual windows: three corners each (lower left, lower right, upper left, seen from inside).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub windows: Vec<[[f64; 3]; 3]>,
    /// Where a visitor looks at first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub looks_at: Option<[f64; 3]>,
}

/// `[display]`: the display that the site is prepared for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Display {
    /// Columns.
    #[schemars(range(min = 1, max = 65536))]
    pub width_px: u32,
    /// Rows.
    #[schemars(range(min = 1, max = 65536))]
    pub height_px: u32,
    /// Vertical opening angle, degrees.
    #[schemars(range(min = 1, max = 170))]
    pub fov_deg: f64,
}

impl Default for Display {
    fn default() -> Self {
        Self { width_px: 1024, height_px: 768, fov_deg: 50.0 }
    }
}
