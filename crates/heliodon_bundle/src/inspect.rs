//! What is in a bundle or a site, for people and for programs.

use crate::chunk::LightLayout;
use crate::config::ConfigError;
use crate::detail::DetailInfo;
use crate::grid::GridInfo;
use crate::layout::SCAN_FOLDER;
use crate::lineage::{InputState, Prepared, PreparedPart, compare_inputs};
use crate::manifest::{Bounds, Counts, Manifest, Parameters, PartInfo};
use crate::panorama::PanoramaInfo;
use crate::reader::BundleReader;
use crate::site::{Actor, Albedo, Display, InputKind, Lamp, Part, Role, Site, SiteInfo};
use crate::texels::TexelInfo;
use glam::DVec3;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

/// What is in a bundle.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BundleSummary {
    /// The site's name.
    pub name: String,
    /// The program that wrote it.
    pub tool: String,
    /// Version of the format.
    pub version: u32,
    /// How much there is.
    pub counts: Counts,
    /// The box around it.
    pub bounds: Bounds,
    /// The parts.
    pub parts: Vec<PartInfo>,
    /// Base colour images.
    pub textures: usize,
    /// Shape of the stored light.
    pub light: LightLayout,
    /// How far off the surface rays started, metres.
    pub offset_m: f64,
    /// The first and the last entry's time.
    pub day: [String; 2],
    /// Entries of the lapse.
    pub sky_steps: usize,
    /// How many of them have a sun.
    pub sky_steps_with_sun: usize,
    /// Names of the rooms.
    pub rooms: Vec<String>,
    /// The actors.
    pub actors: Vec<ActorSummary>,
    /// The lamps, in words.
    pub lamps: Vec<String>,
    /// How many mattes there are.
    pub mattes: usize,
    /// The light grid, where there is one.
    pub grid: Option<GridInfo>,
    /// Light in texels, where there is any.
    pub texels: Option<TexelInfo>,
    /// What a room's middle sees of what was scanned, where that is shown.
    pub panorama: Option<PanoramaInfo>,
    /// How much the scan itself holds, where it lies beside what is drawn of it.
    pub scan: Option<Counts>,
    /// glTF files.
    pub geometry_files: Vec<String>,
    /// Size of all files but the manifest.
    pub bytes: u64,
    /// What it was made of, and how.
    pub lineage: Lineage,
}

/// What a bundle was made of, and how.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Lineage {
    /// The files from which it was made.
    pub inputs: Vec<InputSummary>,
    /// What and where the site is.
    pub site: SiteInfo,
    /// The effective parameters of parts, sky, bake and preparation.
    pub parameters: Parameters,
    /// The display that it was prepared for.
    pub display: Display,
    /// Figures of the bake, by name.
    pub measures: BTreeMap<String, f64>,
    /// What preparation made of the parts, where there was any and the bundle tells.
    pub prepared: Option<Prepared>,
}

/// A file from which a bundle was made.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct InputSummary {
    /// Its path, relative to the site; of one that lies outside only its name.
    pub path: String,
    /// Its size.
    pub bytes: u64,
    /// BLAKE3 of its bytes, in hexadecimal.
    pub blake3: String,
    /// Whether it is still the same, where a site was looked at.
    pub state: Option<InputState>,
}

impl Lineage {
    fn of(manifest: &Manifest) -> Self {
        let input = |input: &crate::StoredFile| InputSummary {
            path: input.path.clone(),
            bytes: input.bytes,
            blake3: input.blake3.clone(),
            state: None,
        };
        Self {
            inputs: manifest.inputs.iter().map(input).collect(),
            site: manifest.site.clone(),
            parameters: manifest.parameters.clone(),
            display: manifest.display.clone(),
            measures: manifest.measures.clone(),
            prepared: manifest.prepared.clone(),
        }
    }
}

impl BundleSummary {
    /// Summarises a bundle.
    #[must_use]
    pub fn of(reader: &BundleReader) -> Self {
        let (manifest, steps) = (reader.manifest(), &reader.lapse().steps);
        let time = |step: Option<&heliodon_sky::lapse::LapseStep>| step.map_or(String::new(), |s| s.time.clone());
        Self {
            name: manifest.site.name.clone(),
            tool: manifest.tool.clone(),
            version: manifest.version,
            counts: manifest.counts,
            bounds: manifest.bounds,
            parts: manifest.parts.clone(),
            textures: manifest.textures.len(),
            light: manifest.light,
            offset_m: manifest.offset_m,
            day: [time(steps.first()), time(steps.last())],
            sky_steps: steps.len(),
            sky_steps_with_sun: steps.iter().filter(|s| s.sun.is_some()).count(),
            rooms: manifest.rooms.iter().map(|r| r.name.clone()).collect(),
            actors: manifest.actors.iter().map(ActorSummary::of).collect(),
            lamps: manifest.lamps.iter().map(lamp_in_words).collect(),
            mattes: manifest.mattes.len(),
            grid: manifest.grid.clone(),
            texels: manifest.texels.clone(),
            panorama: manifest.panorama.clone(),
            scan: manifest.scan,
            geometry_files: manifest.geometry.clone(),
            bytes: manifest.files.iter().map(|f| f.bytes).sum(),
            lineage: Lineage::of(manifest),
        }
    }

    /// The same, with a word on each input: whether the files of a site's folder are still what the bundle was made of.
    #[must_use]
    pub fn compared_with(mut self, reader: &BundleReader, site: &Path) -> Self {
        let states = compare_inputs(&reader.manifest().inputs, site);
        self.lineage.inputs.iter_mut().zip(states).for_each(|(input, state)| input.state = Some(state));
        self
    }
}

/// An actor of a bundle or a site.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ActorSummary {
    /// Its name.
    pub name: String,
    /// Its model.
    pub file: String,
    /// The clip that is played, where one is named.
    pub animation: Option<String>,
    /// What it does, in words.
    pub does: String,
}

impl ActorSummary {
    fn of(actor: &Actor) -> Self {
        let does = match (&actor.path, actor.place) {
            (Some(path), _) => {
                let stations = actor.stations();
                let between = |pair: &[[f64; 3]]| DVec3::from(pair[0]).distance(DVec3::from(pair[1]));
                let length: f64 = stations.windows(2).map(between).sum();
                let points = path.len();
                format!("walks {length:.1} m over {points} points at {} m/s, {}", actor.walk_speed, word(actor.walk))
            }
            (None, place) => {
                let [x, y, z] = place.unwrap_or_default();
                format!("stands at {x:.2}, {y:.2}, {z:.2}")
            }
        };
        Self { name: actor.display_name().to_owned(), file: actor.file.clone(), animation: actor.animation.clone(), does }
    }
}

impl fmt::Display for ActorSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "actor {} ({}", self.name, self.file)?;
        if let Some(animation) = &self.animation {
            write!(f, ", {animation}")?;
        }
        write!(f, "): {}", self.does)
    }
}

/// A lamp in words.
fn lamp_in_words(lamp: &Lamp) -> String {
    let [x, y, z] = lamp.place;
    let name = lamp.name.as_deref().map_or(String::new(), |name| format!(" {name}"));
    let kind =
        if lamp.look_at.is_some() { format!("a spot light of {} degrees", lamp.angle_deg) } else { "a point light".to_owned() };
    format!("light{name}: {kind} at {x:.2}, {y:.2}, {z:.2}, reaches {} m", lamp.reach_m)
}

/// `1234567` as `1,234,567`.
fn thousands(number: u64) -> String {
    let digits = number.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

/// `1 file`, `2 files`.
fn counted(number: u64, what: &str) -> String {
    format!("{} {what}{}", thousands(number), if number == 1 { "" } else { "s" })
}

/// `1 sky entry`, `2 sky entries`.
fn entries(number: u64) -> String {
    format!("{} sky {}", thousands(number), if number == 1 { "entry" } else { "entries" })
}

/// A number above 0 with three digits that count.
fn rounded(number: f64) -> String {
    let digits = (2.0 - libm::floor(libm::log10(number.abs().max(1e-12)))).clamp(0.0, 12.0);
    format!("{number:.*}", digits as usize)
}

fn role_name(role: Role) -> &'static str {
    match role {
        Role::Scan => "scan",
        Role::Ground => "ground",
        Role::Filling => "filling",
        Role::Prop => "prop",
    }
}

impl fmt::Display for BundleSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: a bundle of format version {}, written by {}", self.name, self.version, self.tool)?;
        let (min, max) = (self.bounds.min, self.bounds.max);
        let size = [0, 1, 2].map(|i| f64::from(max[i]) - f64::from(min[i]));
        writeln!(
            f,
            "  {} triangles, {} vertices ({} of them borrow their light), {} chunks, {:.2} x {:.2} x {:.2} m",
            thousands(self.counts.triangles),
            thousands(self.counts.vertices),
            thousands(self.counts.invalid_vertices),
            thousands(self.counts.chunks),
            size[0],
            size[1],
            size[2],
        )?;
        for part in &self.parts {
            let (name, role) = (&part.name, role_name(part.role));
            let one = |detail: &DetailInfo| format!(", detail {} up to {} m", detail.file, rounded(2.0 * detail.near_m));
            let detail: String = part.details().map(one).collect();
            let evidence = part.evidence.map_or_else(String::new, |evidence| {
                format!(", photographs saw {:.0} % of it, the rest is guessed", 100.0 * evidence.seen)
            });
            let views = part.views.as_ref().map_or_else(String::new, |views| {
                let [width, height] = views.size;
                format!(", {} of {width} x {height} texels", counted(views.layers.len() as u64, "view-dependent layer"))
            });
            writeln!(f, "  part {name} ({role}): {} triangles{detail}{evidence}{views}", thousands(part.counts.triangles))?;
        }
        let channels = if self.light.channels == 1 { "mono" } else { "rgb" };
        writeln!(
            f,
            "  light: {}, {} sky coefficients ({channels}), {} of bounced sun, rays start {} mm off",
            counted(u64::from(self.light.sun_steps), "sun step"),
            self.light.coefficients,
            counted(u64::from(self.light.sun_bounce_functions), "function"),
            rounded(self.offset_m * 1e3),
        )?;
        let [first, last] = &self.day;
        writeln!(f, "  day: {first} to {last}, {}, {} with a sun", entries(self.sky_steps as u64), self.sky_steps_with_sun)?;
        for room in &self.rooms {
            writeln!(f, "  room {room}")?;
        }
        for actor in &self.actors {
            writeln!(f, "  {actor}")?;
        }
        for lamp in &self.lamps {
            writeln!(f, "  {lamp}")?;
        }
        if self.mattes > 0 {
            writeln!(f, "  {}", counted(self.mattes as u64, "matte"))?;
        }
        if let Some(grid) = &self.grid {
            writeln!(
                f,
                "  light grid: {} points {} m apart ({} of them borrow their light)",
                thousands(grid.points),
                grid.spacing_m,
                thousands(grid.invalid_points)
            )?;
        }
        if let Some(texels) = &self.texels {
            let TexelInfo { width, height, per_m, utilisation, texels } = texels;
            let (covered, texels) = (100.0 * utilisation, thousands(*texels));
            writeln!(
                f,
                "  light in texels: an atlas of {width} x {height}, {covered:.0} % covered, {texels} texels, {per_m:.1} a metre"
            )?;
        }
        if let Some(PanoramaInfo { side, middle: [x, y, z], texels }) = &self.panorama {
            let texels = thousands(*texels);
            writeln!(f, "  a panorama from ({x:.2}, {y:.2}, {z:.2}): six faces of {side} x {side}, {texels} texels")?;
        }
        if let Some(scan) = &self.scan {
            writeln!(
                f,
                "  the scan itself in {SCAN_FOLDER}/, for eyes at rest: {} triangles, {} vertices, {} chunks",
                thousands(scan.triangles),
                thousands(scan.vertices),
                thousands(scan.chunks)
            )?;
        }
        let (files, textures) = (self.geometry_files.join(", "), counted(self.textures as u64, "texture"));
        writeln!(f, "  {:.1} MB in all; geometry in {files}, {textures}", self.bytes as f64 / 1e6)?;
        self.write_lineage(f)
    }
}

/// Digits of a hash that tell files apart; the JSON has all of them.
const HASH_DIGITS: usize = 16;

impl BundleSummary {
    fn write_lineage(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Lineage { inputs, site, parameters, display, measures, prepared } = &self.lineage;
        let (program, revision) = self.tool.rsplit_once(' ').unwrap_or((&self.tool, "unknown"));
        writeln!(f, "made by {program}, revision {revision}, of")?;
        for InputSummary { path, bytes, blake3, state } in inputs {
            let state = match state {
                None => "",
                Some(InputState::Same) => ", as it is now",
                Some(InputState::Changed) => ", CHANGED since",
                Some(InputState::Missing) => ", NOT THERE any more",
            };
            let hash = blake3.get(..HASH_DIGITS).unwrap_or(blake3);
            writeln!(f, "  {path}: {} bytes, blake3 {hash}{state}", thousands(*bytes))?;
        }
        if let Some(prepared) = prepared {
            self.write_prepared(f, prepared)?;
        } else if parameters.prepare.is_some() {
            writeln!(f, "prepared, by a program that did not tell yet what became of the parts")?;
        }
        write!(f, "with the parameters")?;
        for (table, values) in [
            ("site", serde_json::to_value(site)),
            ("sky", serde_json::to_value(&parameters.sky)),
            ("bake", serde_json::to_value(&parameters.bake)),
            ("display", serde_json::to_value(display)),
            ("prepare", serde_json::to_value(&parameters.prepare)),
            ("weathering", serde_json::to_value(&parameters.weathering)),
        ] {
            // plain structs always have a JSON form, and a table that is not there has no keys
            let values = values.unwrap_or_default();
            for (key, value) in values.as_object().into_iter().flatten().filter(|(_, value)| !value.is_null()) {
                write!(f, "\n  {table}.{key} = {value}")?;
            }
        }
        for (part, said) in self.parts.iter().zip(&parameters.parts) {
            write!(f, "\n  part {}: {}", part.name, said_of(said).join(", "))?;
        }
        if !measures.is_empty() {
            write!(f, "\nmeasured")?;
        }
        measures.iter().try_for_each(|(name, value)| write!(f, "\n  {name} = {value}"))
    }

    fn write_prepared(&self, f: &mut fmt::Formatter<'_>, prepared: &Prepared) -> fmt::Result {
        writeln!(f, "prepared")?;
        for (part, became) in self.parts.iter().zip(&prepared.parts) {
            let PreparedPart { triangles_read, triangles_cleaned, triangles_original, .. } = became;
            writeln!(
                f,
                "  part {}: {} triangles read, {} cleaned, {} that rays of light meet, {} drawn, {} that only reflect",
                part.name,
                thousands(*triangles_read),
                thousands(*triangles_cleaned),
                thousands(*triangles_original),
                thousands(became.triangles_drawn),
                thousands(became.triangles_hidden)
            )?;
            if !became.found.is_empty() {
                let found =
                    became.found.iter().map(|(what, count)| format!("{} {}", thousands(*count), what.replace('_', " ")));
                writeln!(f, "    found by cleaning: {}", found.collect::<Vec<_>>().join(", "))?;
            }
            if let Some(error) = &became.error {
                writeln!(f, "    simplified to {}", became.limits())?;
                writeln!(f, "    off the original by {error}")?;
            }
        }
        if let Some(purge) = &prepared.purge {
            let (wrong, pixels) = (thousands(purge.wrong), thousands(purge.pixels));
            writeln!(f, "  what nobody sees is not drawn: {wrong} of {pixels} pixels of random frames show another triangle")?;
        }
        Ok(())
    }
}

/// The file of a part, and what is said of it besides its name and its role.
fn said_of(part: &Part) -> Vec<String> {
    // plain structs always have a JSON form
    let [said, bare] = [part, &part.bare()].map(|part| serde_json::to_value(part).unwrap_or_default());
    let is_told =
        |(key, value): &(&String, &serde_json::Value)| key.as_str() == "file" || bare.get(key.as_str()) != Some(*value);
    let told = said.as_object().into_iter().flatten().filter(is_told);
    told.map(|(key, value)| format!("{key} = {value}")).collect()
}

/// What is in a site.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SiteSummary {
    /// The site's name.
    pub name: String,
    /// The parts.
    pub parts: Vec<PartSummary>,
    /// Where the light comes from, in words.
    pub sky: String,
    /// The sky's image files.
    pub probes: Vec<String>,
    /// Sun positions of the day.
    pub sun_steps: u32,
    /// Sky entries of the day.
    pub sky_steps: u32,
    /// Shape of what is stored and how it is computed, in words.
    pub bake: String,
    /// Names of the rooms.
    pub rooms: Vec<String>,
    /// The actors.
    pub actors: Vec<ActorSummary>,
    /// The lamps, in words.
    pub lamps: Vec<String>,
    /// How many mattes there are.
    pub mattes: usize,
}

/// A part of a site.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartSummary {
    /// Its name.
    pub name: String,
    /// Its file pattern.
    pub pattern: String,
    /// What it is.
    pub role: Role,
    /// Where its albedo comes from, in words.
    pub albedo: String,
    /// Its files.
    pub files: Vec<String>,
    /// Their size.
    pub bytes: u64,
}

impl SiteSummary {
    /// Summarises a site.
    ///
    /// # Errors
    /// If a file that it names is not there.
    pub fn of(site: &Site) -> Result<Self, ConfigError> {
        let inputs = site.input_files()?;
        let part = |(i, part): (usize, &Part)| {
            let own = || inputs.iter().filter(move |f| f.kind == InputKind::Geometry(i));
            PartSummary {
                name: part.display_name(),
                pattern: part.file.clone(),
                role: part.role,
                albedo: match &part.albedo {
                    None => "from the files, or 0.5".to_owned(),
                    Some(Albedo::Rgb(rgb)) => format!("{} {} {}", rgb[0], rgb[1], rgb[2]),
                    Some(Albedo::Image(image)) => image.clone(),
                },
                files: own().map(|f| f.name.clone()).collect(),
                bytes: own().filter_map(|f| std::fs::metadata(&f.path).ok()).map(|m| m.len()).sum(),
            }
        };
        let (sky, bake) = (&site.sky, &site.bake);
        let probes: Vec<String> = inputs.iter().filter(|f| f.kind == InputKind::Probe).map(|f| f.name.clone()).collect();
        let from = match (sky.model, sky.date) {
            (Some(model), Some(date)) => format!("{} of {date}", word(model)),
            _ => format!("{}, {}", counted(probes.len() as u64, "probe"), sky.mapping.map_or(String::new(), word)),
        };
        let bounces = if bake.sun_bounce { "sky and sun" } else { "the sky" };
        Ok(Self {
            name: site.site.name.clone(),
            parts: site.parts.iter().enumerate().map(part).collect(),
            sky: from,
            // one probe stands for all times
            sun_steps: if probes.len() == 1 { 1 } else { bake.sun_steps },
            sky_steps: if probes.len() == 1 { 1 } else { bake.effective_sky_steps() },
            bake: format!(
                "{} coefficients ({}), {} rays of each point, {} of {bounces}",
                bake.coefficients(),
                word(bake.transfer),
                bake.samples,
                counted(u64::from(bake.bounces), "bounce"),
            ),
            rooms: site.rooms.iter().map(|r| r.name.clone()).collect(),
            actors: site.actors.iter().map(ActorSummary::of).collect(),
            lamps: site.lamps.iter().map(lamp_in_words).collect(),
            mattes: site.mattes.len(),
            probes,
        })
    }
}

/// The word that stands for a value in `site.toml`.
fn word(value: impl Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(word)) => word,
        _ => String::new(),
    }
}

impl fmt::Display for SiteSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: a site", self.name)?;
        for part in &self.parts {
            let (role, files) = (role_name(part.role), counted(part.files.len() as u64, "file"));
            let size = part.bytes as f64 / 1e6;
            let size = if size < 0.1 { format!("{:.1} kB", size * 1e3) } else { format!("{size:.1} MB") };
            let (name, pattern, albedo) = (&part.name, &part.pattern, &part.albedo);
            writeln!(f, "  part {name} ({role}): {files} ({pattern}), {size}, albedo {albedo}")?;
        }
        writeln!(f, "  sky: {}", self.sky)?;
        let sun_steps = counted(u64::from(self.sun_steps), "sun step");
        writeln!(f, "  bake: {sun_steps}, {}, {}", entries(u64::from(self.sky_steps)), self.bake)?;
        write!(f, "  rooms: {}", if self.rooms.is_empty() { "none".to_owned() } else { self.rooms.join(", ") })?;
        self.actors.iter().try_for_each(|actor| write!(f, "\n  {actor}"))?;
        self.lamps.iter().try_for_each(|lamp| write!(f, "\n  {lamp}"))?;
        if self.mattes > 0 { write!(f, "\n  {}", counted(self.mattes as u64, "matte")) } else { Ok(()) }
    }
}
