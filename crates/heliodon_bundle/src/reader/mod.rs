//! Reads a bundle, chunk by chunk, and trusts nothing in it.
//!
//! Opening reads the manifest, the lapse and the JSON of the glTF files, and checks every count and offset against the sizes
//! of the files; a chunk's bytes are read when it is asked for, from where they lie.

mod error;
mod glb;
mod positional;

pub use error::ReadError;

use crate::chunk::LitChunk;
use crate::detail::DetailInfo;
use crate::grid::{Grid, MAX_GRID_POINTS};
use crate::lapse_check::check_lapse;
use crate::layout::{
    DETAIL_FORMAT_VERSION, EVIDENCE_FORMAT_VERSION, FORMAT_VERSION, LIVING_FORMAT_VERSION, MATERIALS_FORMAT_VERSION,
    MOVING_FORMAT_VERSION, PANORAMA_FORMAT_VERSION, PARTS_FORMAT_VERSION, SCAN_FOLDER, SCAN_FORMAT_VERSION,
    STILL_FORMAT_VERSION, TEXEL_FORMAT_VERSION,
};
use crate::manifest::{Bounds, Counts, FORMAT_NAME, LAPSE_FILE_NAME, MANIFEST_FILE_NAME, Manifest, Preamble};
use crate::panorama::{self, Panorama};
use crate::site::{Actor, Albedo, Lamp, Living, MAX_DETAILS, check_actor, check_lamp, check_living, check_matte};
use crate::storage::StoredFile;
use crate::texels::{BOUNCE_FILE, SKY_FILE, SUN_FILE, Shapes, TexelFault, TexelLight, WEATHERING_FILE, is_shape};
use error::{io_error, malformed};
use glb::{ChunkPlace, EmbeddedImage, GlbFile, GridPlace};
use heliodon_image::detail::DetailTexture;
use heliodon_image::ktx2::{Ktx2, Ktx2Shape};
use heliodon_image::view_layers::{LayerFiles, ViewLayer, ViewLayers};
use heliodon_image::{SrgbImage, TextureWrap};
use heliodon_sky::lapse::Lapse;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// The largest JSON that is taken for a manifest or a lapse; one of 16,384 steps and 65,535 parts stays far below.
const MAX_JSON_BYTES: u64 = 256 << 20;

/// An open bundle. Reading needs no exclusive access, so that threads can share it.
#[derive(Debug)]
pub struct BundleReader {
    folder: PathBuf,
    manifest: Manifest,
    lapse: Lapse,
    files: Vec<GlbFile>,
    chunks: Vec<ChunkPlace>,
    textures: Vec<TexturePlace>,
    grid: Option<(GlbFile, Vec<GridPlace>)>,
}

/// Where a base colour image lies, and how it goes on.
#[derive(Clone, Copy, Debug, Default)]
struct TexturePlace {
    file: usize,
    bytes: glb::Span,
    wrap: [TextureWrap; 2],
}

/// What is known of a chunk without reading it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChunkInfo {
    /// Index of its part.
    pub part: u16,
    /// Index of its base colour image.
    pub texture: Option<u32>,
    /// Index of its detail among those of its part's materials.
    pub detail: Option<u32>,
    /// Whether it is lit by texels.
    pub by_texels: bool,
    /// Vertices.
    pub vertices: u32,
    /// Triangles.
    pub triangles: u32,
    /// The box around it, as the file says.
    pub bounds: Bounds,
}

impl BundleReader {
    /// Opens the bundle in a folder.
    ///
    /// # Errors
    /// If it is not one, is of a later version, or anything in it does not fit.
    pub fn open(folder: impl AsRef<Path>) -> Result<Self, ReadError> {
        let folder = folder.as_ref().to_owned();
        let manifest = read_manifest(&folder)?;
        let manifest_path = folder.join(MANIFEST_FILE_NAME);
        let lapse_path = folder.join(LAPSE_FILE_NAME);
        let text = read_small(&lapse_path)?;
        let lapse: Lapse = serde_json::from_slice(&text).map_err(|e| malformed(&lapse_path, e.to_string()))?;
        check_lapse(&lapse, manifest.light).map_err(|what| malformed(&lapse_path, what))?;
        for step in &lapse.steps {
            if !is_plain_path(&step.sky_map) {
                return Err(malformed(&lapse_path, format!("`{}` is no path within the bundle", step.sky_map)));
            }
        }
        let mut reader =
            Self { folder, manifest, lapse, files: Vec::new(), chunks: Vec::new(), textures: Vec::new(), grid: None };
        let mut textures = vec![None; reader.manifest.textures.len()];
        for (number, name) in reader.manifest.geometry.iter().enumerate() {
            let (file, chunks, images) = GlbFile::open(&reader.folder.join(name), number, &reader.manifest)?;
            for EmbeddedImage { texture, bytes, wrap } in images {
                if let Some(slot) = textures.get_mut(texture as usize) {
                    slot.get_or_insert(TexturePlace { file: number, bytes, wrap });
                }
            }
            reader.files.push(file);
            reader.chunks.extend(chunks);
        }
        if let Some(info) = &reader.manifest.grid {
            reader.grid = Some(GlbFile::open_grid(&reader.folder.join(&info.file), info, &reader.manifest)?);
        }
        let found = reader.count();
        if found != (Counts { invalid_vertices: 0, ..reader.manifest.counts }) {
            return Err(malformed(&manifest_path, format!("it counts {:?}, the files hold {found:?}", reader.manifest.counts)));
        }
        for (index, texture) in textures.into_iter().enumerate() {
            // an image that no chunk shows is in no file
            let shown = reader.chunks.iter().any(|c| c.info.texture == Some(index as u32));
            match texture {
                Some(place) => reader.textures.push(place),
                None if !shown => reader.textures.push(TexturePlace::default()),
                None => return Err(malformed(&manifest_path, format!("texture {index} is in none of the files"))),
            }
        }
        Ok(reader)
    }

    fn count(&self) -> Counts {
        let mut counts = Counts::default();
        for chunk in &self.chunks {
            counts.add(Counts {
                chunks: 1,
                vertices: u64::from(chunk.info.vertices),
                triangles: u64::from(chunk.info.triangles),
                invalid_vertices: 0,
            });
        }
        counts
    }

    /// The bundle's folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What the bundle is.
    #[must_use]
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// The light of the day.
    #[must_use]
    pub fn lapse(&self) -> &Lapse {
        &self.lapse
    }

    /// How many chunks there are.
    #[must_use]
    pub fn chunk_count(&self) -> usize {
        self.chunks.len()
    }

    /// N, vertices of all chunks.
    #[must_use]
    pub fn vertex_count(&self) -> u64 {
        self.manifest.counts.vertices
    }

    /// M, triangles of all chunks.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        self.manifest.counts.triangles
    }

    /// What is known of a chunk without reading it.
    ///
    /// # Panics
    /// If there is no such chunk.
    #[must_use]
    pub fn chunk_info(&self, chunk: usize) -> ChunkInfo {
        self.chunks[chunk].info
    }

    /// Reads a chunk, and nothing but it.
    ///
    /// # Errors
    /// If it cannot be read, or is malformed.
    ///
    /// # Panics
    /// If there is no such chunk.
    pub fn read_chunk(&self, chunk: usize) -> Result<LitChunk, ReadError> {
        let place = &self.chunks[chunk];
        let file = &self.files[place.file];
        let read = file.read_chunk(place, self.manifest.light)?;
        read.validate().map_err(|fault| malformed(file.path(), format!("chunk {chunk}: {fault}")))?;
        Ok(read)
    }

    /// The lamps.
    #[must_use]
    pub fn lamps(&self) -> &[Lamp] {
        &self.manifest.lamps
    }

    /// What happens, with paths within the bundle's folder.
    #[must_use]
    pub fn living(&self) -> &Living {
        &self.manifest.living
    }

    /// The actors, with paths within the bundle's folder.
    #[must_use]
    pub fn actors(&self) -> &[Actor] {
        &self.manifest.actors
    }

    /// Reads the light grid; `None` where the bundle has none.
    ///
    /// # Errors
    /// If it cannot be read, or is malformed.
    pub fn read_grid(&self) -> Result<Option<Grid>, ReadError> {
        let (Some((file, places)), Some(info)) = (&self.grid, &self.manifest.grid) else { return Ok(None) };
        let points = file.read_grid(places, info, self.manifest.light)?;
        Grid::new(points).map(Some).map_err(|fault| malformed(file.path(), fault.to_string()))
    }

    /// Reads light in texels; `None` where the bundle has none.
    ///
    /// # Errors
    /// If it cannot be read, or is malformed.
    pub fn read_texels(&self) -> Result<Option<TexelLight>, ReadError> {
        let Some(info) = &self.manifest.texels else { return Ok(None) };
        let wrong = |fault: TexelFault| malformed(&self.folder.join(SUN_FILE), fault.to_string());
        let Shapes { sun, sky, bounce } = Shapes::of(self.manifest.light, info.size()).map_err(wrong)?;
        let bounce = bounce.map(|wanted| self.read_texture(BOUNCE_FILE, wanted)).transpose()?;
        let light = TexelLight { sun: self.read_texture(SUN_FILE, sun)?, sky: self.read_texture(SKY_FILE, sky)?, bounce };
        light.validate(self.manifest.light, info.size()).map_err(wrong)?;
        Ok(Some(light))
    }

    /// Reads what the weather has left on parts that are lit by texels, as [`crate::texels::weathering_texture`] has it; `None` where the bundle has none.
    ///
    /// # Errors
    /// If it cannot be read, or is malformed.
    pub fn read_texel_weathering(&self) -> Result<Option<Ktx2>, ReadError> {
        let is_there = self.manifest.files.iter().any(|file| file.path == WEATHERING_FILE);
        let Some(info) = self.manifest.texels.as_ref().filter(|_| is_there) else { return Ok(None) };
        self.read_texture(WEATHERING_FILE, Shapes::weathering(info)).map(Some)
    }

    /// Reads the panorama; `None` where the bundle has none.
    ///
    /// # Errors
    /// If it cannot be read, or is malformed.
    pub fn read_panorama(&self) -> Result<Option<Panorama>, ReadError> {
        let Some(info) = &self.manifest.panorama else { return Ok(None) };
        let wrong = |fault: TexelFault| malformed(&self.folder.join(panorama::SUN_FILE), fault.to_string());
        let mut read = Panorama::files(self.manifest.light, info)
            .map_err(wrong)?
            .into_iter()
            .map(|(name, wanted)| Ok((name, self.read_texture(name, wanted)?)))
            .collect::<Result<BTreeMap<_, _>, ReadError>>()?;
        let bounce = read.remove(panorama::BOUNCE_FILE);
        let named = [panorama::SUN_FILE, panorama::SKY_FILE, panorama::SURFACE_FILE, panorama::ALBEDO_FILE];
        let [Some(sun), Some(sky), Some(surface), Some(albedo)] = named.map(|name| read.remove(name)) else {
            return Ok(None);
        };
        let panorama = Panorama { light: TexelLight { sun, sky, bounce }, surface, albedo };
        panorama.validate(self.manifest.light, info).map_err(wrong)?;
        Ok(Some(panorama))
    }

    /// Opens the scan itself, a bundle in the bundle's folder that shows the same parts through the same day; `None` where the bundle has none.
    ///
    /// # Errors
    /// As [`BundleReader::open`], and if it is not what the manifest says.
    pub fn scan(&self) -> Result<Option<Self>, ReadError> {
        let Some(counts) = self.manifest.scan else { return Ok(None) };
        let scan = Self::open(self.folder.join(SCAN_FOLDER))?;
        let (own, of_scan) = (&self.manifest, &scan.manifest);
        let same = [
            ("counts are", of_scan.counts == counts),
            ("parts are", own.same_parts(of_scan)),
            ("light is", own.light == of_scan.light),
            ("day is", self.lapse == scan.lapse),
            ("own scan is", of_scan.scan.is_none()),
            ("stone is", of_scan.textures.is_empty() && of_scan.texels.is_none() && of_scan.panorama.is_none()),
        ];
        match same.iter().find(|(_, same)| !same) {
            None => Ok(Some(scan)),
            Some((what, _)) => {
                let path = scan.folder.join(MANIFEST_FILE_NAME);
                Err(malformed(&path, format!("its {what} not what the bundle around it says")))
            }
        }
    }

    /// A texture that is what the manifest says; one that is not is not unpacked.
    fn read_texture(&self, name: &str, wanted: Ktx2Shape) -> Result<Ktx2, ReadError> {
        let path = self.folder.join(name);
        let bytes = std::fs::read(&path).map_err(io_error(&path))?;
        let found = Ktx2::shape_of(&bytes, name).map_err(|e| malformed(&path, e.to_string()))?;
        is_shape("it", found, wanted).map_err(|fault| malformed(&path, fault.to_string()))?;
        Ktx2::from_bytes(&bytes, name).map_err(|e| malformed(&path, e.to_string()))
    }

    /// Reads the image of a detail of a part.
    ///
    /// # Errors
    /// If it cannot be read, is no detail texture, or has not the mean of 128.
    pub fn read_detail(&self, detail: &DetailInfo) -> Result<DetailTexture, ReadError> {
        let path = self.folder.join(&detail.file);
        let bytes = std::fs::read(&path).map_err(io_error(&path))?;
        DetailInfo::texture(&bytes, &detail.file).map_err(|fault| malformed(&path, fault.to_string()))
    }

    /// Reads what single photographs saw of a part; `None` where nothing is told of that.
    ///
    /// # Errors
    /// If it cannot be read, or is not what the manifest says.
    ///
    /// # Panics
    /// If there is no such part.
    pub fn read_views(&self, part: usize) -> Result<Option<ViewLayers>, ReadError> {
        let Some(info) = &self.manifest.parts[part].views else { return Ok(None) };
        let image = |name: &String| {
            let path = self.folder.join(name);
            let image = SrgbImage::read(&path).map_err(|error| malformed(&path, error.to_string()))?;
            let [width, height] = info.size;
            if [image.width, image.height] == info.size {
                return Ok(image);
            }
            let what = format!("it has {} x {} texels, its manifest says {width} x {height}", image.width, image.height);
            Err(malformed(&path, what))
        };
        let layer = |files: &LayerFiles| Ok(ViewLayer { colors: image(&files.colors)?, directions: image(&files.directions)? });
        let layers = info.layers.iter().map(layer).collect::<Result<_, ReadError>>()?;
        Ok(Some(ViewLayers { layers }))
    }

    /// The bytes of a base colour image, a PNG or JPEG file; empty for one that no chunk shows.
    ///
    /// # Errors
    /// If it cannot be read.
    ///
    /// # Panics
    /// If there is no such image.
    pub fn texture_bytes(&self, texture: usize) -> Result<Vec<u8>, ReadError> {
        let TexturePlace { file, bytes, .. } = self.textures[texture];
        self.files[file].read_span(bytes)
    }

    /// How a base colour image goes on outside of [0, 1] along u and v.
    ///
    /// # Panics
    /// If there is no such image.
    #[must_use]
    pub fn texture_wrap(&self, texture: usize) -> [TextureWrap; 2] {
        self.textures[texture].wrap
    }

    /// A base colour image, decoded.
    ///
    /// # Errors
    /// If it cannot be read or is no image.
    ///
    /// # Panics
    /// If there is no such image.
    pub fn texture_image(&self, texture: usize) -> Result<SrgbImage, ReadError> {
        let bytes = self.texture_bytes(texture)?;
        let path = self.files[self.textures[texture].file].path();
        SrgbImage::from_bytes(&bytes, &self.manifest.textures[texture].name).map_err(|e| malformed(path, e.to_string()))
    }

    /// Where the sky image of a step of the lapse is.
    ///
    /// # Panics
    /// If there is no such step.
    #[must_use]
    pub fn sky_map_path(&self, step: usize) -> PathBuf {
        self.folder.join(&self.lapse.steps[step].sky_map)
    }

    /// Hashes all files and compares them with the manifest. Reads the whole bundle.
    ///
    /// # Errors
    /// The first file that is missing or not what it was.
    pub fn verify(&self) -> Result<(), ReadError> {
        for expected in &self.manifest.files {
            let path = self.folder.join(&expected.path);
            let found = StoredFile::hash(&path, &expected.path).map_err(io_error(&path))?;
            if found != *expected {
                return Err(ReadError::Changed { path });
            }
        }
        Ok(())
    }
}

fn read_manifest(folder: &Path) -> Result<Manifest, ReadError> {
    let path = folder.join(MANIFEST_FILE_NAME);
    if !path.is_file() {
        return Err(ReadError::NoBundle { path: folder.to_owned() });
    }
    let text = read_small(&path)?;
    let preamble: Preamble = serde_json::from_slice(&text).map_err(|e| malformed(&path, e.to_string()))?;
    if preamble.format != FORMAT_NAME {
        return Err(malformed(&path, format!("its format is `{}`, not `{FORMAT_NAME}`", preamble.format)));
    }
    if !(u64::from(STILL_FORMAT_VERSION)..=u64::from(FORMAT_VERSION)).contains(&preamble.version) {
        return Err(ReadError::Version { path, found: preamble.version, known: FORMAT_VERSION });
    }
    let manifest: Manifest = serde_json::from_slice(&text).map_err(|e| malformed(&path, e.to_string()))?;
    manifest.light.validate().map_err(|fault| malformed(&path, fault.to_string()))?;
    for file in &manifest.files {
        if !is_plain_path(&file.path) {
            return Err(malformed(&path, format!("`{}` is no path within the bundle", file.path)));
        }
    }
    for name in &manifest.geometry {
        if !manifest.files.iter().any(|f| f.path == *name) {
            return Err(malformed(&path, format!("`{name}` is not among its files")));
        }
    }
    if manifest.prepared.as_ref().is_some_and(|prepared| prepared.parts.len() != manifest.parts.len()) {
        return Err(malformed(&path, "it tells of the preparation of more or fewer parts than it has".to_owned()));
    }
    if manifest.prepared.is_some() && manifest.version < MOVING_FORMAT_VERSION {
        return Err(malformed(&path, format!("version {} tells nothing of preparation", manifest.version)));
    }
    if manifest.texels.is_some() && manifest.version < TEXEL_FORMAT_VERSION {
        return Err(malformed(&path, format!("version {} has no light in texels", manifest.version)));
    }
    if let Some(info) = &manifest.texels {
        let shapes = Shapes::of(manifest.light, info.size()).map_err(|fault| malformed(&path, fault.to_string()))?;
        let wanted = [Some(SUN_FILE), Some(SKY_FILE), shapes.bounce.map(|_| BOUNCE_FILE)];
        let is_missing = |name: &&str| !manifest.files.iter().any(|file| file.path == **name);
        if let Some(missing) = wanted.into_iter().flatten().find(is_missing) {
            return Err(malformed(&path, format!("it has light in texels, and `{missing}` is not among its files")));
        }
    }
    if let Some(info) = &manifest.panorama {
        if manifest.version < PANORAMA_FORMAT_VERSION {
            return Err(malformed(&path, format!("version {} has no panorama", manifest.version)));
        }
        let wanted = Panorama::files(manifest.light, info).map_err(|fault| malformed(&path, fault.to_string()))?;
        let is_missing = |(name, _): &&(&str, _)| !manifest.files.iter().any(|file| file.path == *name);
        if let Some((missing, _)) = wanted.iter().find(is_missing) {
            return Err(malformed(&path, format!("it has a panorama, and `{missing}` is not among its files")));
        }
    }
    if manifest.scan.is_some() {
        if manifest.version < SCAN_FORMAT_VERSION {
            return Err(malformed(&path, format!("version {} has no scan beside what is drawn", manifest.version)));
        }
        let name = format!("{SCAN_FOLDER}/{MANIFEST_FILE_NAME}");
        if !manifest.files.iter().any(|file| file.path == name) {
            return Err(malformed(&path, format!("it has a scan beside what is drawn, and `{name}` is not among its files")));
        }
    }
    let said = &manifest.parameters.parts;
    if !said.is_empty() && manifest.version < PARTS_FORMAT_VERSION {
        return Err(malformed(&path, format!("version {} does not tell what is said of the parts", manifest.version)));
    }
    if !said.is_empty() && said.len() != manifest.parts.len() {
        return Err(malformed(&path, "it tells what is said of more or fewer parts than it has".to_owned()));
    }
    if manifest.parameters.weathering.is_some() && manifest.version < TEXEL_FORMAT_VERSION {
        return Err(malformed(&path, format!("version {} has no weathering", manifest.version)));
    }
    let moving =
        manifest.grid.is_some() || !manifest.actors.is_empty() || !manifest.lamps.is_empty() || !manifest.mattes.is_empty();
    if moving && manifest.version < MOVING_FORMAT_VERSION {
        return Err(malformed(&path, format!("version {} has no light grid, actors, lamps or mattes", manifest.version)));
    }
    let is_there = |name: &String| manifest.files.iter().any(|f| f.path == *name);
    for part in &manifest.parts {
        let Some(evidence) = &part.evidence else { continue };
        let wrong = |what: String| malformed(&path, format!("the evidence of part `{}`: {what}", part.name));
        if manifest.version < EVIDENCE_FORMAT_VERSION {
            return Err(wrong(format!("version {} has none", manifest.version)));
        }
        evidence.validate().map_err(wrong)?;
    }
    for part in &manifest.parts {
        let Some(views) = &part.views else { continue };
        let wrong = |what: String| malformed(&path, format!("the views of part `{}`: {what}", part.name));
        if manifest.version < EVIDENCE_FORMAT_VERSION {
            return Err(wrong(format!("version {} has none", manifest.version)));
        }
        views.validate().map_err(wrong)?;
        let mut named = views.layers.iter().flat_map(|layer| [&layer.colors, &layer.directions]);
        if let Some(missing) = named.find(|name| !is_there(name)) {
            return Err(wrong(format!("`{missing}` is not among its files")));
        }
    }
    for part in &manifest.parts {
        let details = part.material_details.len();
        if details == 0 {
            continue;
        }
        let wrong = |what: String| malformed(&path, format!("details of materials of part `{}`: {what}", part.name));
        if manifest.version < MATERIALS_FORMAT_VERSION {
            return Err(wrong(format!("version {} has none", manifest.version)));
        }
        if details > MAX_DETAILS {
            return Err(wrong(format!("they are {details}, and {MAX_DETAILS} at most")));
        }
        if part.detail.is_some() || part.views.is_some() {
            return Err(wrong("it has one detail for all of it, or views, besides".to_owned()));
        }
    }
    for (part, detail) in manifest.parts.iter().flat_map(|part| part.details().map(move |detail| (part, detail))) {
        let wrong = |what: String| malformed(&path, format!("the detail of part `{}`: {what}", part.name));
        if manifest.version < DETAIL_FORMAT_VERSION {
            return Err(wrong(format!("version {} has none", manifest.version)));
        }
        if !is_there(&detail.file) {
            return Err(wrong(format!("`{}` is not among its files", detail.file)));
        }
        detail.validate().map_err(|fault| wrong(fault.to_string()))?;
    }
    if let Some(grid) = &manifest.grid
        && (!is_there(&grid.file) || grid.points > MAX_GRID_POINTS as u64)
    {
        return Err(malformed(&path, format!("its light grid of {} points is not in `{}`", grid.points, grid.file)));
    }
    for (i, lamp) in manifest.lamps.iter().enumerate() {
        check_lamp(lamp).map_err(|what| malformed(&path, format!("light {i}: {what}")))?;
    }
    for (i, matte) in manifest.mattes.iter().enumerate() {
        check_matte(matte).map_err(|what| malformed(&path, format!("matte {i}: {what}")))?;
    }
    for actor in &manifest.actors {
        let image = match &actor.albedo {
            Some(Albedo::Image(image)) => Some(image),
            _ => None,
        };
        let named = [Some(&actor.file), actor.cache.as_ref(), image];
        if let Some(missing) = named.into_iter().flatten().find(|name| !is_there(name)) {
            return Err(malformed(&path, format!("actor `{}`: `{missing}` is not among its files", actor.display_name())));
        }
        check_actor(actor).map_err(|what| malformed(&path, format!("actor `{}`: {what}", actor.display_name())))?;
    }
    let living = !manifest.living.is_empty() || manifest.actors.iter().any(|actor| actor.thing.is_some());
    if living && manifest.version < LIVING_FORMAT_VERSION {
        return Err(malformed(&path, format!("version {} has no things, films, sounds or scripts", manifest.version)));
    }
    if let Some(missing) = manifest.living.files().find(|name| !is_there(&(*name).to_owned())) {
        return Err(malformed(&path, format!("`{missing}` is not among its files")));
    }
    check_living(&manifest.living).map_err(|what| malformed(&path, what))?;
    Ok(manifest)
}

/// Whether a path stays within the bundle.
pub(crate) fn is_plain_path(path: &str) -> bool {
    !path.is_empty()
        && !path.contains(['\\', ':', '\0'])
        && Path::new(path).components().all(|c| matches!(c, Component::Normal(_)))
}

fn read_small(path: &Path) -> Result<Vec<u8>, ReadError> {
    let file = File::open(path).map_err(io_error(path))?;
    let bytes = file.metadata().map_err(io_error(path))?.len();
    if bytes > MAX_JSON_BYTES {
        return Err(malformed(path, format!("{bytes} bytes are too many for it")));
    }
    let mut text = Vec::with_capacity(bytes as usize);
    file.take(MAX_JSON_BYTES).read_to_end(&mut text).map_err(io_error(path))?;
    Ok(text)
}
