//! What happens in a site: places that scripts name, materials, films, sounds, fires, and the story that joins them.
//!
//! Coordinates are those of the parts before the site's `origin` is subtracted; in a bundle's manifest, after.

use super::values::TimeOfDay;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Everything that happens in a site. In a bundle's manifest, files are paths within the bundle.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Living {
    /// Boxes that visitors enter and leave.
    #[serde(rename = "region", skip_serializing_if = "Vec::is_empty")]
    pub regions: Vec<Region>,
    /// Places to look from.
    #[serde(rename = "view", skip_serializing_if = "Vec::is_empty")]
    pub views: Vec<View>,
    /// Ways that actors follow and visitors are shown.
    #[serde(rename = "path", skip_serializing_if = "Vec::is_empty")]
    pub paths: Vec<Way>,
    /// What parts can be covered with.
    #[serde(rename = "material", skip_serializing_if = "Vec::is_empty")]
    pub materials: Vec<Material>,
    /// Films.
    #[serde(rename = "film", skip_serializing_if = "Vec::is_empty")]
    pub films: Vec<Film>,
    /// Sounds.
    #[serde(rename = "sound", skip_serializing_if = "Vec::is_empty")]
    pub sounds: Vec<SoundSource>,
    /// Boxes with an echo.
    #[serde(rename = "echo", skip_serializing_if = "Vec::is_empty")]
    pub echoes: Vec<Echo>,
    /// Fires, dust, smoke, sparks, water.
    #[serde(rename = "particles", skip_serializing_if = "Vec::is_empty")]
    pub particles: Vec<Particles>,
    /// Scripts and their texts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub story: Option<Story>,
}

/// `[[region]]`: a box that visitors enter and leave, with their feet or their eyes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Its name for scripts, unique among regions.
    pub name: String,
    /// The box's lower corner, metres.
    pub min: [f64; 3],
    /// The box's upper corner.
    pub max: [f64; 3],
}

/// `[[view]]`: a place to look from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct View {
    /// Its name for scripts, unique among views.
    pub name: String,
    /// Where the eyes are, metres.
    pub place: [f64; 3],
    /// What they look at.
    pub look_at: [f64; 3],
}

/// `[[path]]`: a way that actors follow and visitors are shown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Way {
    /// Its name for scripts, unique among paths.
    pub name: String,
    /// At least two points, metres.
    pub points: Vec<[f64; 3]>,
}

/// `[[material]]`: what parts and things can be covered with while the site is visited.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Its name for scripts, unique among materials.
    pub name: String,
    /// Its albedo, linear [r, g, b] in [0, 1]; of a metal the share that it reflects.
    pub albedo: [f64; 3],
    /// How much of the part's own shades of colour stays: 0 none, 1 all.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1))]
    pub grain: f64,
    /// How much it shines like metal: 0 not at all, 1 as gold does.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1))]
    pub metal: f64,
}

/// `[[film]]`: a film on an upright surface in the scene, or on a part: with its mask, or its own alpha, somebody who was filmed; without, a picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Film {
    /// Its name for scripts, unique among films.
    pub name: String,
    /// An MP4 or WebM file relative to the site's folder; with a mask, the image of the pair that `heliodon key` makes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// In place of a file: what a part's surface looks like that flows or flickers; a tile of it is `height_m` high.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<FilmKind>,
    /// The inverted mask of the pair.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mask: Option<String>,
    /// Where the middle of its lower edge stands, metres.
    pub place: [f64; 3],
    /// Its height, metres; the width follows from the film's shape.
    #[serde(default = "person_m")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub height_m: f64,
    /// Whether it turns towards the visitor.
    #[serde(default)]
    pub faces: Faces,
    /// Where it looks if it does not turn: counter-clockwise from +Z seen from above, degrees.
    #[serde(default)]
    pub turn_deg: f64,
    /// Whether it begins again at its end.
    #[serde(default = "yes")]
    pub repeat: bool,
    /// Whether it plays from the beginning of a visit; else a script starts it, and until then it is not there.
    #[serde(default = "yes")]
    pub plays: bool,
    /// Whether it stands still while the hour does.
    #[serde(default)]
    pub with_clock: bool,
    /// How much the light of the place changes it: 0 it shines by itself as a screen does, 1 it is as bright as what stands beside it.
    #[serde(default = "one")]
    #[schemars(range(min = 0, max = 1))]
    pub lit: f64,
    /// The level of its sound; 0 leaves it out.
    #[serde(default = "one")]
    #[schemars(range(min = 0, max = 64))]
    pub volume: f64,
    /// A path along which it goes ahead of the visitor, waiting where they fall behind.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub leads: Option<String>,
    /// A part that shows the film in place of its own colour, by its texture coordinates; what is made needs none. `place` then is where its sound comes from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface: Option<String>,
}

/// A film that is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum FilmKind {
    /// Coals that glow, now here, now there.
    Embers,
    /// Water that runs over the part, towards its texture's lower edge; without texture coordinates, downwards.
    Water,
}

/// Whether a film turns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Faces {
    /// About the vertical, to whoever looks.
    #[default]
    Visitor,
    /// It does not.
    Fixed,
}

/// `[[sound]]`: a source of sound. Exactly one of `file` and `kind` is given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SoundSource {
    /// Its name for scripts, unique among sounds.
    pub name: String,
    /// A WAV, Ogg Vorbis, FLAC or MP3 file relative to the site's folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// One of the sounds that are made: see `heliodon sound`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
    /// Another number makes another sound of its kind.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub seed: u64,
    /// Where it sounds, metres; without, all around, and neither distance nor walls change it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<[f64; 3]>,
    /// In place of `place`, the name of an actor from whom it comes, wherever they go.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// The distance at which it has its own level, metres; beyond, it falls as one over the distance.
    #[serde(default = "one")]
    #[schemars(range(min = 0.01, max = 1000))]
    pub reference_m: f64,
    /// Its level: 1 as it was recorded.
    #[serde(default = "one")]
    #[schemars(range(min = 0, max = 64))]
    pub volume: f64,
    /// Whether it begins again at its end.
    #[serde(default)]
    pub repeat: bool,
    /// Whether it sounds from the beginning of a visit; else a script starts it.
    #[serde(default)]
    pub plays: bool,
    /// Its level through the day, as parts of `volume`: times in their order, with straight lines between them and round midnight.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hours: Vec<(TimeOfDay, f64)>,
}

/// `[[particles]]`: many small things in the air.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Particles {
    /// Its name for scripts, unique among particles.
    pub name: String,
    /// What they are.
    pub kind: ParticleKind,
    /// The middle of where they come from, metres; of dust, of where it hangs.
    pub place: [f64; 3],
    /// How far they come from, to all sides of the place, metres.
    #[serde(default = "particle_m")]
    pub extent: [f64; 3],
    /// How many there are beside what is usual. Where all sources together want more than some 20,000, a GPU simulates them in visits, or they are thinned.
    #[serde(default = "one")]
    #[schemars(range(min = 0, max = 500))]
    pub density: f64,
    /// How large they are beside what is usual.
    #[serde(default = "one")]
    #[schemars(range(min = 0.01, max = 100))]
    pub size: f64,
    /// Whether they are there from the beginning of a visit; else a script starts them.
    #[serde(default = "yes")]
    pub plays: bool,
}

/// What particles are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ParticleKind {
    /// Hangs in the air, and is seen where the sun falls on it.
    Dust,
    /// Rises, spreads, and takes light away.
    Smoke,
    /// Burns, and gives light.
    Fire,
    /// Fly off, glow and fall.
    Sparks,
    /// Falls in drops.
    Water,
}

/// `[story]`: scripts, their texts, and what is kept of a visit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Story {
    /// Scripts (.rhai) relative to the site's folder.
    pub scripts: Vec<String>,
    /// What scripts say, in several languages (.toml), relative to the site's folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub texts: Option<String>,
    /// The language of a visit unless its own says otherwise, as in the texts: "en". Default: their first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub language: Option<String>,
    /// A font for texts in letters other than Latin, Greek and Cyrillic (.ttf or .otf), relative to the site's folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub font: Option<String>,
    /// Whether what scripts remember is kept between visits.
    #[serde(default = "yes")]
    pub remembers: bool,
}

/// `[actor.thing]`: the actor is a thing that can be touched and taken.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Thing {
    /// Whether a hand can take it away.
    pub carried: bool,
    /// Whether it strikes what it meets.
    pub tool: bool,
    /// The material that it brings onto what it touches.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub brings: Option<String>,
    /// Whether it is there only once a script shows it.
    pub hidden: bool,
}

/// `[[echo]]`: a box with an echo of its own; where several hold a listener, the smallest counts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Echo {
    /// Its name, for people.
    pub name: String,
    /// The box's lower corner, metres.
    pub min: [f64; 3],
    /// The box's upper corner.
    pub max: [f64; 3],
    /// What its walls are.
    #[serde(default)]
    pub walls: Walls,
    /// How loud the echo is beside that of such a box: 0 none, 1 as it is.
    #[serde(default = "one")]
    #[schemars(range(min = 0, max = 4))]
    pub level: f64,
}

/// What the walls of a box are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Walls {
    /// Bare marble or limestone.
    #[default]
    Stone,
    /// Plaster on brick.
    Plaster,
    /// Timber walls and ceiling.
    Wood,
    /// Earth, cloth and straw.
    Soft,
}

/// Whether bytes begin as a TrueType or OpenType font does, or a collection of them.
#[must_use]
pub fn is_font(bytes: &[u8]) -> bool {
    [&[0, 1, 0, 0], b"OTTO", b"true", b"ttcf"].iter().any(|tag: &&[u8; 4]| bytes.starts_with(*tag))
}

impl Living {
    /// Whether nothing happens.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// The names of its files, as [`Living::files_mut`] has them.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        let films = self.films.iter().flat_map(|film| film.file.iter().chain(&film.mask));
        let sounds = self.sounds.iter().filter_map(|sound| sound.file.as_ref());
        let story = self.story.iter().flat_map(|story| story.scripts.iter().chain(&story.texts).chain(&story.font));
        films.chain(sounds).chain(story).map(String::as_str)
    }

    /// The names of its files, each with what may change it: in a site relative to its folder, in a manifest within the bundle.
    pub fn files_mut(&mut self) -> impl Iterator<Item = &mut String> {
        let films = self.films.iter_mut().flat_map(|film| film.file.iter_mut().chain(&mut film.mask));
        let sounds = self.sounds.iter_mut().filter_map(|sound| sound.file.as_mut());
        let story =
            self.story.iter_mut().flat_map(|story| story.scripts.iter_mut().chain(&mut story.texts).chain(&mut story.font));
        films.chain(sounds).chain(story)
    }

    /// All of it moved by minus the site's origin: from the site's coordinates to the bundle's.
    #[must_use]
    pub fn relative_to(&self, origin: [f64; 3]) -> Self {
        let mut moved = self.clone();
        let regions = moved.regions.iter_mut().flat_map(|region| [&mut region.min, &mut region.max]);
        let echoes = moved.echoes.iter_mut().flat_map(|echo| [&mut echo.min, &mut echo.max]);
        let views = moved.views.iter_mut().flat_map(|view| [&mut view.place, &mut view.look_at]);
        let paths = moved.paths.iter_mut().flat_map(|path| &mut path.points);
        let films = moved.films.iter_mut().map(|film| &mut film.place);
        let sounds = moved.sounds.iter_mut().filter_map(|sound| sound.place.as_mut());
        let particles = moved.particles.iter_mut().map(|particles| &mut particles.place);
        for point in regions.chain(echoes).chain(views).chain(paths).chain(films).chain(sounds).chain(particles) {
            for (coordinate, origin) in point.iter_mut().zip(origin) {
                *coordinate -= origin;
            }
        }
        moved
    }
}

fn one() -> f64 {
    1.0
}

fn yes() -> bool {
    true
}

fn person_m() -> f64 {
    1.8
}

fn particle_m() -> [f64; 3] {
    [0.2; 3]
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's skip_serializing_if passes a reference")]
fn is_zero(seed: &u64) -> bool {
    *seed == 0
}
