//! `manifest.json`: what a bundle is, from what it was made, and what its files must hold.
//!
//! It holds no times and no paths of the machine, so that the same input makes the same bytes.

use crate::chunk::LightLayout;
use crate::detail::DetailInfo;
use crate::grid::GridInfo;
use crate::layout::{
    DETAIL_FORMAT_VERSION, EVIDENCE_FORMAT_VERSION, LIVING_FORMAT_VERSION, MATERIALS_FORMAT_VERSION, MOVING_FORMAT_VERSION,
    PANORAMA_FORMAT_VERSION, PARTS_FORMAT_VERSION, SCAN_FORMAT_VERSION, STILL_FORMAT_VERSION, TEXEL_FORMAT_VERSION,
};
use crate::lineage::Prepared;
use crate::panorama::PanoramaInfo;
use crate::site::{
    Actor, Bake, Display, Lamp, Living, Matte, Part, PartWeathering, Prepare, Role, Room, SiteFile, SiteInfo, Sky, Weathering,
    told_path,
};
use crate::storage::StoredFile;
use crate::texels::TexelInfo;
use heliodon_image::view_layers::{LayerFiles, MOST_LAYERS};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// What `format` says in every manifest.
pub const FORMAT_NAME: &str = "heliodon-bundle";
/// The manifest's file name.
pub const MANIFEST_FILE_NAME: &str = "manifest.json";
/// The lapse's file name.
pub const LAPSE_FILE_NAME: &str = "lapse.json";

/// What the one who writes a bundle knows beforehand.
#[derive(Clone, Debug, PartialEq)]
pub struct BundleMeta {
    /// The writing program and its version, such as `heliodon 0.1.0`.
    pub tool: String,
    /// What and where the site is.
    pub site: SiteInfo,
    /// Name, role and files of each part; a chunk's `part` is an index into it.
    pub parts: Vec<PartMeta>,
    /// Where a visitor's eyes can be.
    pub rooms: Vec<Room>,
    /// The lamps, in the bundle's space.
    pub lamps: Vec<Lamp>,
    /// Polygons that hide what lies behind them, in the bundle's space.
    pub mattes: Vec<Matte>,
    /// What happens, in the bundle's space; files are paths from the site's folder.
    pub living: Living,
    /// The display that the site was prepared for.
    pub display: Display,
    /// The effective parameters of parts, sky, bake and preparation.
    pub parameters: Parameters,
    /// How far off the surface rays started, metres.
    pub offset_m: f64,
    /// Shape of the stored light.
    pub light: LightLayout,
    /// The files from which the bundle was made.
    pub inputs: Vec<StoredFile>,
    /// Figures of the bake that depend on nothing but its input, by name.
    pub measures: BTreeMap<String, f64>,
    /// What preparation made of the parts, where there was any.
    pub prepared: Option<Prepared>,
}

impl BundleMeta {
    /// What follows from a site: its names, rooms, display and parameters. Parts are named as in the site, or by their file
    /// pattern's name without its ending.
    #[must_use]
    pub fn from_site(site: &SiteFile, light: LightLayout, offset_m: f64) -> Self {
        let parts = site.parts.iter().map(|part| PartMeta { name: part.display_name(), role: part.role });
        Self {
            tool: concat!("heliodon ", env!("CARGO_PKG_VERSION")).to_owned(),
            site: site.site.clone(),
            parts: parts.collect(),
            rooms: site.rooms.clone(),
            lamps: site.lamps.iter().map(|lamp| lamp.relative_to(site.site.origin)).collect(),
            mattes: site.mattes.iter().map(|matte| matte.relative_to(site.site.origin)).collect(),
            living: site.living().relative_to(site.site.origin),
            display: site.display.clone(),
            parameters: Parameters::from_site(site),
            offset_m,
            light,
            inputs: Vec::new(),
            measures: BTreeMap::new(),
            prepared: None,
        }
    }
}

/// A part's name and role.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PartMeta {
    /// Its name, for people.
    pub name: String,
    /// What it is.
    pub role: Role,
}

/// The effective parameters of a bake. `[budget]` is not among them: whatever it gives, the result is the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// The parts as the site has them, in bundle order; empty where it says no more of any than its file, its name and its role. Files are told by
    /// [`told_path`]. From version 9 on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<Part>,
    /// `[sky]`, its probes told likewise.
    pub sky: Sky,
    /// `[bake]`.
    pub bake: Bake,
    /// `[prepare]`, where the geometry was prepared: from version 2 on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prepare: Option<Prepare>,
    /// `[weathering]`, where there is any: from version 3 on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weathering: Option<Weathering>,
    /// Of each part how it departs from it, in bundle order; empty where none does.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub part_weathering: Vec<Option<PartWeathering>>,
}

impl Parameters {
    fn from_site(site: &SiteFile) -> Self {
        let own: Vec<_> = site.parts.iter().map(|part| part.weathering.clone()).collect();
        let departs = site.weathering.is_some() && own.iter().any(Option::is_some);
        let says_more = site.parts.iter().any(|part| *part != part.bare());
        let probes = site.sky.probes.as_ref().map(|probes| told_path(Path::new(probes)));
        Self {
            parts: if says_more { site.parts.iter().map(Part::told).collect() } else { Vec::new() },
            sky: Sky { probes, ..site.sky.clone() },
            bake: site.bake.clone(),
            prepare: site.prepare.clone(),
            weathering: site.weathering.clone(),
            part_weathering: if departs { own } else { Vec::new() },
        }
    }
}

/// All of `manifest.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Always [`FORMAT_NAME`].
    pub format: String,
    /// Version of the format; readers refuse a later one.
    pub version: u32,
    /// The writing program and its version.
    pub tool: String,
    /// What and where the site is.
    pub site: SiteInfo,
    /// Shape of the stored light.
    pub light: LightLayout,
    /// How far off the surface rays started, metres.
    pub offset_m: f64,
    /// How much there is.
    pub counts: Counts,
    /// The box around all geometry.
    pub bounds: Bounds,
    /// The parts, in bundle order.
    pub parts: Vec<PartInfo>,
    /// The base colour images.
    pub textures: Vec<TextureInfo>,
    /// The light grid, where there is one: from version 2 on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grid: Option<GridInfo>,
    /// Light in texels, where there is any: from version 3 on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub texels: Option<TexelInfo>,
    /// What a room's middle sees of what was scanned, where the viewer is to show that: from version 7 on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub panorama: Option<PanoramaInfo>,
    /// How much the scan itself holds, where it lies beside what is drawn of it ([`crate::layout::SCAN_FOLDER`]): from version 8 on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scan: Option<Counts>,
    /// The actors, as the site has them, but: each has its name; files are paths within the bundle; place and path are in the bundle's
    /// space, the site's origin subtracted. From version 2 on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub actors: Vec<Actor>,
    /// The lamps, in the bundle's space, the site's origin subtracted. From version 2 on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lamps: Vec<Lamp>,
    /// Invisible polygons that hide what lies behind them, in the bundle's space, the site's origin subtracted. From version 3 on; some bundles of version 2
    /// have them, which programs that read no later version call malformed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mattes: Vec<Matte>,
    /// What happens, as the site has it, but in the bundle's space; files are paths within the bundle. From version 5 on.
    #[serde(default, skip_serializing_if = "Living::is_empty")]
    pub living: Living,
    /// Where a visitor's eyes can be.
    pub rooms: Vec<Room>,
    /// The display that the site was prepared for.
    pub display: Display,
    /// The effective parameters of parts, sky, bake and preparation.
    pub parameters: Parameters,
    /// Figures of the bake, by name.
    pub measures: BTreeMap<String, f64>,
    /// What preparation made of the parts, where there was any: from version 2 on, but some bundles of version 2 do not tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prepared: Option<Prepared>,
    /// The files from which the bundle was made, relative to the site.
    pub inputs: Vec<StoredFile>,
    /// The glTF files, in bundle order; among `files`.
    pub geometry: Vec<String>,
    /// All files of the bundle but this one.
    pub files: Vec<StoredFile>,
}

/// How much a bundle holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Counts {
    /// Chunks.
    pub chunks: u64,
    /// N, vertices; those at the borders of chunks count in each.
    pub vertices: u64,
    /// M, triangles.
    pub triangles: u64,
    /// Vertices that lie inside something and borrowed their light.
    pub invalid_vertices: u64,
}

impl Counts {
    pub(crate) fn add(&mut self, more: Self) {
        self.chunks += more.chunks;
        self.vertices += more.vertices;
        self.triangles += more.triangles;
        self.invalid_vertices += more.invalid_vertices;
    }
}

/// A box.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bounds {
    /// Its lower corner.
    pub min: [f32; 3],
    /// Its upper corner.
    pub max: [f32; 3],
}

/// A part of a bundle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PartInfo {
    /// Its name, for people.
    pub name: String,
    /// What it is.
    pub role: Role,
    /// How much it holds.
    pub counts: Counts,
    /// The pattern that is multiplied onto its albedo, where there is one: from version 4 on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detail: Option<DetailInfo>,
    /// In its place those of its materials, which chunks name by their index, where it has several or one for some materials: from version 10 on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub material_details: Vec<DetailInfo>,
    /// What its colours rest on, where that is known: from version 6 on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub evidence: Option<EvidenceInfo>,
    /// What single photographs saw of it, where that is shown: from version 6 on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub views: Option<ViewsInfo>,
}

impl PartInfo {
    /// All details of the part, whichever materials they are for.
    pub fn details(&self) -> impl Iterator<Item = &DetailInfo> {
        self.detail.iter().chain(&self.material_details)
    }

    /// The detail of a chunk, of which the chunk says `number`.
    #[must_use]
    pub fn detail_of(&self, number: Option<u32>) -> Option<&DetailInfo> {
        match number {
            Some(number) => self.material_details.get(number as usize),
            None => self.detail.as_ref(),
        }
    }
}

/// What single photographs saw of a part, by the coordinates of its base colour image ([`ViewLayers`](heliodon_image::view_layers::ViewLayers)).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViewsInfo {
    /// Columns and rows of every image.
    pub size: [u32; 2],
    /// Their files, among the bundle's; directions are in the bundle's space.
    pub layers: Vec<LayerFiles>,
}

impl ViewsInfo {
    /// # Errors
    /// Too few or too many layers, in words.
    pub(crate) fn validate(&self) -> Result<(), String> {
        let count = self.layers.len();
        if (1..=MOST_LAYERS).contains(&count) {
            Ok(())
        } else {
            Err(format!("{count} layers, where there are 1 to {MOST_LAYERS}"))
        }
    }
}

/// What the colours of a part rest on; the alpha of its base colour image says it place by place: 1 where a photograph saw the surface, 0.5 and less where
/// the colour is guessed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EvidenceInfo {
    /// The share of its surface that was seen, 0 to 1.
    pub seen: f64,
}

impl EvidenceInfo {
    /// # Errors
    /// A share that is none, in words.
    pub(crate) fn validate(self) -> Result<(), String> {
        if (0.0..=1.0).contains(&self.seen) { Ok(()) } else { Err(format!("a share of {} was seen", self.seen)) }
    }
}

/// A base colour image of a bundle.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TextureInfo {
    /// Its name, for people.
    pub name: String,
    /// `image/png` or `image/jpeg`.
    pub mime: String,
    /// Its size as a file.
    pub bytes: u64,
    /// BLAKE3 of its bytes, in hexadecimal.
    pub blake3: String,
    /// Whether its alpha says what its colours rest on ([`EvidenceInfo`]); otherwise alpha means nothing.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub evidence: bool,
}

/// What a manifest of any version holds.
#[derive(Deserialize)]
pub(crate) struct Preamble {
    pub(crate) format: String,
    pub(crate) version: u64,
}

impl Manifest {
    pub(crate) fn new(meta: &BundleMeta) -> Self {
        Self {
            format: FORMAT_NAME.to_owned(),
            version: STILL_FORMAT_VERSION,
            tool: meta.tool.clone(),
            site: meta.site.clone(),
            light: meta.light,
            offset_m: meta.offset_m,
            counts: Counts::default(),
            bounds: Bounds { min: [f32::MAX; 3], max: [f32::MIN; 3] },
            parts: meta
                .parts
                .iter()
                .map(|part| PartInfo {
                    name: part.name.clone(),
                    role: part.role,
                    counts: Counts::default(),
                    detail: None,
                    material_details: Vec::new(),
                    evidence: None,
                    views: None,
                })
                .collect(),
            textures: Vec::new(),
            grid: None,
            texels: None,
            panorama: None,
            scan: None,
            actors: Vec::new(),
            lamps: meta.lamps.clone(),
            mattes: meta.mattes.clone(),
            living: Living::default(),
            rooms: meta.rooms.clone(),
            display: meta.display.clone(),
            parameters: meta.parameters.clone(),
            measures: meta.measures.clone(),
            prepared: meta.prepared.clone(),
            inputs: meta.inputs.clone(),
            geometry: Vec::new(),
            files: Vec::new(),
        }
    }

    /// The manifest with what was completed in `meta` since [`Manifest::new`].
    pub(crate) fn with_late_meta(self, meta: BundleMeta) -> Self {
        let complete = Self {
            tool: meta.tool,
            site: meta.site,
            offset_m: meta.offset_m,
            rooms: meta.rooms,
            lamps: meta.lamps,
            mattes: meta.mattes,
            display: meta.display,
            parameters: meta.parameters,
            measures: meta.measures,
            prepared: meta.prepared,
            inputs: meta.inputs,
            ..self
        };
        Self { version: complete.least_version(), ..complete }
    }

    /// Whether both have parts of the same names and roles, in the same order.
    pub(crate) fn same_parts(&self, other: &Self) -> bool {
        let told = |part: &PartInfo| (part.name.clone(), part.role);
        self.parts.iter().map(told).eq(other.parts.iter().map(told))
    }

    /// The earliest version that has all of it: programs refuse a key that they do not know as malformed, a later version as what it is.
    fn least_version(&self) -> u32 {
        let parameters = &self.parameters;
        let living = !self.living.is_empty() || self.actors.iter().any(|actor| actor.thing.is_some());
        let has_details = self.parts.iter().any(|part| part.details().next().is_some());
        // `[bake]` says how large an atlas would be, even where no part is lit by texels
        let of_texels = self.texels.is_some() || parameters.bake.texels.is_some();
        let moving = self.grid.is_some() || !self.actors.is_empty() || !self.lamps.is_empty();
        let has_effort = parameters.prepare.as_ref().is_some_and(|prepare| !prepare.purge_effort.is_usual());
        let says = |part: &Part| part.least_px.is_some() || part.has_material_details();
        if self.parts.iter().any(|part| !part.material_details.is_empty()) || parameters.parts.iter().any(says) {
            return MATERIALS_FORMAT_VERSION;
        }
        if !parameters.parts.is_empty() || has_effort {
            return PARTS_FORMAT_VERSION;
        }
        // `[prepare]` says that there would be a scan, or how large a panorama would be, even where nothing is drawn of them
        if self.scan.is_some() || parameters.prepare.as_ref().is_some_and(|prepare| prepare.scan) {
            SCAN_FORMAT_VERSION
        } else if self.panorama.is_some() || parameters.prepare.as_ref().is_some_and(|prepare| prepare.panorama > 0) {
            PANORAMA_FORMAT_VERSION
        } else if self.parts.iter().any(|part| part.evidence.is_some() || part.views.is_some()) {
            EVIDENCE_FORMAT_VERSION
        } else if living {
            LIVING_FORMAT_VERSION
        } else if has_details {
            DETAIL_FORMAT_VERSION
        } else if of_texels || parameters.weathering.is_some() || !self.mattes.is_empty() {
            TEXEL_FORMAT_VERSION
        } else if moving || parameters.prepare.is_some() || self.prepared.is_some() {
            MOVING_FORMAT_VERSION
        } else {
            STILL_FORMAT_VERSION
        }
    }

    pub(crate) fn to_json(&self) -> Result<Vec<u8>, serde_json::Error> {
        let mut text = serde_json::to_vec_pretty(self)?;
        text.push(b'\n');
        Ok(text)
    }
}
