//! Writes a bundle, chunk by chunk.

use crate::actors::{ActorMeta, copy_actor, copy_living, folders_of};
use crate::chunk::{ChunkFault, LitChunk};
use crate::detail::{DETAIL_FOLDER, DetailInfo};
use crate::glb::{GlbBuilder, bounds};
use crate::gltf::{Asset, AssetExtras, Material, MaterialExtras, Mesh, Node, NodeExtras, Pbr, Primitive, Scene, TextureRef};
use crate::grid::{GridInfo, GridPoints, POINTS_PER_PRIMITIVE};
use crate::lapse_check::check_lapse;
use crate::layout::{PROFILE_VERSION, SCAN_FOLDER, VIEWS_FOLDER};
use crate::manifest::{
    BundleMeta, Counts, EvidenceInfo, LAPSE_FILE_NAME, MANIFEST_FILE_NAME, Manifest, TextureInfo, ViewsInfo,
};
use crate::panorama::{self, PANORAMA_FOLDER, Panorama, PanoramaInfo};
use crate::site::Detail;
use crate::staging::{Staging, sync_folder};
use crate::storage::{StoredFile, WriteFault, io_fault, share, store};
use crate::texels::{
    BOUNCE_FILE, SKY_FILE, SUN_FILE, TEXELS_FOLDER, TexelInfo, TexelLight, WEATHERING_FILE, validate_weathering,
};
use glam::Vec3;
use heliodon_image::detail::DetailTexture;
use heliodon_image::ktx2::Ktx2;
use heliodon_image::view_layers::{LayerFiles, ViewLayers};
use heliodon_image::{SrgbImage, TextureWrap};
use heliodon_sky::lapse::Lapse;
use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// What keeps a bundle from being written. Whatever it is, a bundle that was there before is still there.
#[derive(Debug, Error)]
pub enum WriteError {
    /// The file system refused.
    #[error(transparent)]
    Fault(#[from] WriteFault),
    /// The place is taken by something that is not a bundle.
    #[error("{}: not replaced, for {what}; choose another place or move it away", .path.display())]
    NotABundle {
        /// The place.
        path: PathBuf,
        /// What is there.
        what: String,
    },
    /// Another process writes the same bundle.
    #[error("{}: another process is writing this bundle; wait until it ends", .path.display())]
    Busy {
        /// The bundle.
        path: PathBuf,
    },
    /// A chunk is not as it must be.
    #[error("chunk {index}: {fault}")]
    Chunk {
        /// Its index.
        index: u64,
        /// What is wrong.
        fault: ChunkFault,
    },
    /// Something does not fit what the bundle already holds.
    #[error("{0}")]
    Unfit(String),
}

/// Settings of the writer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WriterOptions {
    /// A glTF file that would grow beyond this is ended and another begun. Stock viewers have trouble above 2 GiB; the format
    /// ends at 4 GiB.
    pub max_glb_bytes: u64,
}

impl Default for WriterOptions {
    fn default() -> Self {
        Self { max_glb_bytes: 2 << 30 }
    }
}

/// Writes a bundle: chunks are streamed in, in the order of parts, and at the end everything is renamed into place at once.
///
/// A writer that is dropped before [`BundleWriter::finish`] leaves nothing behind and what was there untouched.
pub struct BundleWriter {
    /// Last in use, first to be declared: a spool file is closed before its folder goes.
    glb: Option<OpenGlb>,
    staging: Staging,
    meta: BundleMeta,
    options: WriterOptions,
    manifest: Manifest,
    low: Vec3,
    high: Vec3,
    textures: Vec<SpooledTexture>,
    /// Those that were added.
    actors: Vec<ActorMeta>,
}

/// A base colour image that waits for the first glTF file that shows it.
struct SpooledTexture {
    path: PathBuf,
    wrap: [TextureWrap; 2],
}

/// The glTF file that is being filled.
struct OpenGlb {
    builder: GlbBuilder,
    name: String,
    /// Material by texture.
    /// By texture and by detail.
    materials: BTreeMap<(Option<u32>, Option<u32>), usize>,
    /// The mesh that takes the next chunk, with its part.
    mesh: Option<u16>,
}

impl BundleWriter {
    /// Begins a bundle that will stand at `target`.
    ///
    /// # Errors
    /// If the place is taken by something that is not a bundle, or cannot be written to, or another process writes there; if
    /// the layout of `meta` is not one that the format holds.
    pub fn create(target: impl AsRef<Path>, meta: BundleMeta) -> Result<Self, WriteError> {
        Self::create_with(target, meta, WriterOptions::default())
    }

    /// As [`BundleWriter::create`], with settings.
    ///
    /// # Errors
    /// As [`BundleWriter::create`].
    pub fn create_with(target: impl AsRef<Path>, meta: BundleMeta, options: WriterOptions) -> Result<Self, WriteError> {
        meta.light.validate().map_err(|fault| WriteError::Unfit(fault.to_string()))?;
        let staging = Staging::create(target.as_ref())?;
        let manifest = Manifest::new(&meta);
        let (low, high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        Ok(Self { glb: None, staging, meta, options, manifest, low, high, textures: Vec::new(), actors: Vec::new() })
    }

    /// What goes into the manifest, to be completed before the end: inputs, measures, parameters. Parts and layout stay.
    pub fn meta_mut(&mut self) -> &mut BundleMeta {
        &mut self.meta
    }

    /// Adds a base colour image that repeats outside of [0, 1]; see [`BundleWriter::add_texture_wrapped`].
    ///
    /// # Errors
    /// As [`BundleWriter::add_texture_wrapped`].
    pub fn add_texture(&mut self, name: &str, bytes: &[u8]) -> Result<u32, WriteError> {
        self.add_texture_wrapped(name, bytes, [TextureWrap::Repeat; 2])
    }

    /// Adds a base colour image, the bytes of a PNG or JPEG file, that goes on outside of [0, 1] along u and v as `wrap` says, and
    /// answers with the index by which chunks name it.
    ///
    /// # Errors
    /// If the bytes are of neither kind, or cannot be written.
    pub fn add_texture_wrapped(&mut self, name: &str, bytes: &[u8], wrap: [TextureWrap; 2]) -> Result<u32, WriteError> {
        let mime = match bytes {
            [0x89, b'P', b'N', b'G', ..] => "image/png",
            [0xFF, 0xD8, 0xFF, ..] => "image/jpeg",
            _ => return Err(WriteError::Unfit(format!("texture `{name}` is neither PNG nor JPEG"))),
        };
        let index = self.textures.len() as u32;
        let spool = format!(".texture-{index}");
        let stored = store(self.staging.folder(), &spool, bytes)?;
        self.textures.push(SpooledTexture { path: self.staging.folder().join(spool), wrap });
        let info = TextureInfo {
            name: name.to_owned(),
            mime: mime.to_owned(),
            bytes: stored.bytes,
            blake3: stored.blake3,
            evidence: false,
        };
        self.manifest.textures.push(info);
        Ok(index)
    }

    /// Adds a sky image at its path within the bundle, such as `sky/0001.hdr`.
    ///
    /// # Errors
    /// If the path is not a plain one below `sky/`, or there already, or cannot be written.
    pub fn add_sky_map(&mut self, path: &str, bytes: &[u8]) -> Result<(), WriteError> {
        let name = path.strip_prefix("sky/").filter(|n| !n.is_empty() && !n.starts_with('.') && !n.contains(['/', '\\', ':']));
        if name.is_none() || self.manifest.files.iter().any(|f| f.path == path) {
            return Err(WriteError::Unfit(format!("sky map `{path}`: give each a name of its own, sky/NAME.hdr")));
        }
        let folder = self.staging.folder().join("sky");
        std::fs::create_dir_all(&folder).map_err(io_fault(&folder))?;
        let stored = store(self.staging.folder(), path, bytes)?;
        self.manifest.files.push(stored);
        Ok(())
    }

    /// Adds the light grid, whose light has the bundle's layout; at most one.
    ///
    /// # Errors
    /// If it is malformed, does not fit the bundle, is there already, or cannot be written.
    pub fn add_grid(&mut self, points: &GridPoints) -> Result<(), WriteError> {
        points.validate().map_err(|fault| WriteError::Unfit(fault.to_string()))?;
        if points.light.layout() != self.manifest.light {
            let layout = points.light.layout();
            return Err(WriteError::Unfit(format!("the grid's light is {layout:?}, the bundle's {:?}", self.manifest.light)));
        }
        if self.manifest.grid.is_some() {
            return Err(WriteError::Unfit("the bundle has a light grid already".to_owned()));
        }
        let mut builder = GlbBuilder::create(self.staging.folder().join(format!(".{GRID_FILE_NAME}.spool")))?;
        builder.gltf.asset = asset(&self.meta.tool);
        let count = points.cells.len();
        let primitives: Vec<Primitive> = (0..count)
            .step_by(POINTS_PER_PRIMITIVE)
            .map(|first| builder.push_grid(points, first..(first + POINTS_PER_PRIMITIVE).min(count)))
            .collect::<Result<_, _>>()?;
        let name = Some("light grid".to_owned());
        builder.gltf.meshes = vec![Mesh { name: name.clone(), primitives }];
        builder.gltf.nodes = vec![Node { name, mesh: Some(0), ..Node::default() }];
        builder.gltf.scene = Some(0);
        builder.gltf.scenes = vec![Scene { nodes: vec![0] }];
        self.manifest.files.push(builder.finish(&self.staging.folder().join(GRID_FILE_NAME), GRID_FILE_NAME)?);
        self.manifest.grid = Some(GridInfo {
            file: GRID_FILE_NAME.to_owned(),
            origin: points.origin,
            spacing_m: points.spacing_m,
            cells: points.extent(),
            points: count as u64,
            invalid_points: points.valid.iter().filter(|&&valid| valid == 0).count() as u64,
        });
        Ok(())
    }

    /// Adds light in texels, of the bundle's layout, before any chunk that shows it; at most once.
    ///
    /// # Errors
    /// If it does not fit the bundle, is there already, or cannot be written.
    pub fn add_texels(&mut self, light: &TexelLight, info: TexelInfo) -> Result<(), WriteError> {
        if self.manifest.texels.is_some() {
            return Err(WriteError::Unfit("the bundle has light in texels already".to_owned()));
        }
        light.validate(self.manifest.light, info.size()).map_err(|fault| WriteError::Unfit(fault.to_string()))?;
        let textures = [(SUN_FILE, Some(&light.sun)), (SKY_FILE, Some(&light.sky)), (BOUNCE_FILE, light.bounce.as_ref())];
        self.store_textures(TEXELS_FOLDER, &textures)?;
        self.manifest.texels = Some(info);
        Ok(())
    }

    /// Adds a panorama of the bundle's layout; at most once.
    ///
    /// # Errors
    /// If it does not fit the bundle, is there already, or cannot be written.
    pub fn add_panorama(&mut self, panorama: &Panorama, info: PanoramaInfo) -> Result<(), WriteError> {
        if self.manifest.panorama.is_some() {
            return Err(WriteError::Unfit("the bundle has a panorama already".to_owned()));
        }
        panorama.validate(self.manifest.light, &info).map_err(|fault| WriteError::Unfit(fault.to_string()))?;
        let Panorama { light, surface, albedo } = panorama;
        let textures = [
            (panorama::SUN_FILE, Some(&light.sun)),
            (panorama::SKY_FILE, Some(&light.sky)),
            (panorama::BOUNCE_FILE, light.bounce.as_ref()),
            (panorama::SURFACE_FILE, Some(surface)),
            (panorama::ALBEDO_FILE, Some(albedo)),
        ];
        self.store_textures(PANORAMA_FOLDER, &textures)?;
        self.manifest.panorama = Some(info);
        Ok(())
    }

    /// Begins the scan itself, a bundle of the same parts and light within this one: to be filled with chunks, and given to [`BundleWriter::end_scan`]. It needs no
    /// sky maps of its own.
    ///
    /// # Errors
    /// If it does not fit the bundle, is there already, or cannot be written.
    pub fn begin_scan(&self, meta: BundleMeta) -> Result<Self, WriteError> {
        if self.manifest.scan.is_some() {
            return Err(WriteError::Unfit("the bundle has a scan beside it already".to_owned()));
        }
        let scan = Self::create_with(self.scan_folder(), meta, self.options)?;
        if scan.manifest.light != self.manifest.light || !scan.manifest.same_parts(&self.manifest) {
            return Err(WriteError::Unfit("the scan has other parts or another light than the bundle".to_owned()));
        }
        Ok(scan)
    }

    /// Ends the scan of this bundle, after the last sky map was added: it shares those, and has this lapse, which [`BundleWriter::finish`] must be given too.
    ///
    /// # Errors
    /// If it was not begun here, as [`BundleWriter::finish`] would end it, or if it cannot be written.
    pub fn end_scan(&mut self, mut scan: Self, lapse: &Lapse) -> Result<(), WriteError> {
        let folder = self.scan_folder();
        if scan.staging.target() != folder {
            return Err(WriteError::Unfit("the scan was begun for another bundle".to_owned()));
        }
        for map in self.manifest.files.iter().filter(|file| file.path.starts_with("sky/")) {
            let (from, to) = (self.staging.folder().join(&map.path), scan.staging.folder().join(&map.path));
            to.parent().map_or(Ok(()), std::fs::create_dir_all).map_err(io_fault(&to))?;
            share(&from, &to)?;
            scan.manifest.files.push(map.clone());
        }
        let manifest = scan.finish(lapse)?;
        let path = folder.join(MANIFEST_FILE_NAME);
        let own = StoredFile::hash(&path, MANIFEST_FILE_NAME).map_err(io_fault(&path))?;
        let within = |file: StoredFile| StoredFile { path: format!("{SCAN_FOLDER}/{}", file.path), ..file };
        self.manifest.files.extend(manifest.files.into_iter().chain([own]).map(within));
        self.manifest.scan = Some(manifest.counts);
        Ok(())
    }

    /// Where the scan stands while the bundle is written.
    fn scan_folder(&self) -> PathBuf {
        self.staging.folder().join(SCAN_FOLDER)
    }

    /// Stores those textures that there are, all in one folder.
    fn store_textures(&mut self, folder: &str, textures: &[(&str, Option<&Ktx2>)]) -> Result<(), WriteError> {
        let folder = self.staging.folder().join(folder);
        std::fs::create_dir_all(&folder).map_err(io_fault(&folder))?;
        for &(name, texture) in textures {
            if let Some(texture) = texture {
                let bytes = texture.to_bytes(name).map_err(|e| WriteError::Unfit(e.to_string()))?;
                self.manifest.files.push(store(self.staging.folder(), name, &bytes)?);
            }
        }
        Ok(())
    }

    /// Adds what the weather has left on parts that are lit by texels, as [`crate::texels::weathering_texture`] has it, after their light; at most once.
    ///
    /// # Errors
    /// If the bundle has no light in texels, it is of another size, is there already, the bundle's parameters have no weathering, or it cannot be written.
    pub fn add_texel_weathering(&mut self, layer: &Ktx2) -> Result<(), WriteError> {
        let unfit = |what: &str| Err(WriteError::Unfit(what.to_owned()));
        let Some(info) = &self.manifest.texels else { return unfit("weathering in texels needs light in texels") };
        validate_weathering(layer, info).map_err(|fault| WriteError::Unfit(fault.to_string()))?;
        if self.manifest.files.iter().any(|file| file.path == WEATHERING_FILE) {
            return unfit("the bundle has weathering in texels already");
        }
        if self.meta.parameters.weathering.is_none() {
            return unfit("the bundle's parameters have no weathering");
        }
        let bytes = layer.to_bytes(WEATHERING_FILE).map_err(|e| WriteError::Unfit(e.to_string()))?;
        self.manifest.files.push(store(self.staging.folder(), WEATHERING_FILE, &bytes)?);
        Ok(())
    }

    /// Adds the detail of all of a part; details with the same image share its file.
    ///
    /// # Errors
    /// If there is no such part, it has one already, the image is not square or of another size than a detail's, a number is out of
    /// range, or it cannot be written.
    pub fn add_detail(&mut self, part: usize, texture: &DetailTexture, settings: &Detail) -> Result<(), WriteError> {
        let info = self.detail_info(part, texture, settings)?;
        match &mut self.manifest.parts[part] {
            known if known.details().next().is_some() => Err(unfit_detail(part, "it has one already")),
            known => {
                known.detail = Some(info);
                Ok(())
            }
        }
    }

    /// Adds the next detail of some materials of a part, before its chunks, which name it by its index.
    ///
    /// # Errors
    /// As [`BundleWriter::add_detail`], and where all of the part has one.
    pub fn add_material_detail(&mut self, part: usize, texture: &DetailTexture, settings: &Detail) -> Result<(), WriteError> {
        let info = self.detail_info(part, texture, settings)?;
        let known = &mut self.manifest.parts[part];
        if known.detail.is_some() {
            return Err(unfit_detail(part, "all of it has one already"));
        }
        known.material_details.push(info);
        Ok(())
    }

    /// What a manifest says of a detail of a part that there is, whose image is in its place.
    fn detail_info(&mut self, part: usize, texture: &DetailTexture, settings: &Detail) -> Result<DetailInfo, WriteError> {
        if part >= self.manifest.parts.len() {
            return Err(unfit_detail(part, "there is no such part"));
        }
        let bytes = texture.to_png_bytes().map_err(|e| unfit_detail(part, e))?;
        DetailInfo::texture(&bytes, "the image").map_err(|fault| unfit_detail(part, fault))?;
        let info = DetailInfo::new(self.add_image(DETAIL_FOLDER, &bytes)?, settings);
        info.validate().map_err(|fault| unfit_detail(part, fault))?;
        Ok(info)
    }

    /// Adds what single photographs saw of a part, with directions in the bundle's space.
    ///
    /// # Errors
    /// If there is no such part, it has views already, layers do not fit together, or they cannot be written.
    pub fn add_views(&mut self, part: usize, views: &ViewLayers) -> Result<(), WriteError> {
        let unfit = |what: String| WriteError::Unfit(format!("the views of part {part}: {what}"));
        match self.manifest.parts.get(part) {
            None => return Err(unfit("there is no such part".to_owned())),
            Some(known) if known.views.is_some() => return Err(unfit("it has some already".to_owned())),
            Some(_) => {}
        }
        views.validate().map_err(unfit)?;
        let mut info = ViewsInfo { size: views.size(), layers: Vec::new() };
        for layer in &views.layers {
            let mut add = |image: &SrgbImage| {
                let bytes = image.to_png_bytes().map_err(|e| unfit(e.to_string()))?;
                self.add_image(VIEWS_FOLDER, &bytes)
            };
            info.layers.push(LayerFiles { colors: add(&layer.colors)?, directions: add(&layer.directions)? });
        }
        self.manifest.parts[part].views = Some(info);
        Ok(())
    }

    /// Puts a PNG file into a folder that has nothing else, once however often it comes, and answers with its path.
    fn add_image(&mut self, folder: &str, bytes: &[u8]) -> Result<String, WriteError> {
        let stored = StoredFile::of_bytes(bytes, "");
        let in_folder = |file: &&StoredFile| file.path.starts_with(folder);
        if let Some(known) = self.manifest.files.iter().filter(in_folder).find(|file| file.blake3 == stored.blake3) {
            return Ok(known.path.clone());
        }
        let path = self.staging.folder().join(folder);
        std::fs::create_dir_all(&path).map_err(io_fault(&path))?;
        let name = format!("{folder}/{}.png", self.manifest.files.iter().filter(in_folder).count());
        self.manifest.files.push(store(self.staging.folder(), &name, bytes)?);
        Ok(name)
    }

    /// Says that the alpha of base colour images, by their indices, tells what the colours of a part rest on.
    ///
    /// # Errors
    /// If there is no such part or image, or the share that was seen is not in [0, 1].
    pub fn add_evidence(
        &mut self,
        part: usize,
        textures: impl IntoIterator<Item = u32>,
        evidence: EvidenceInfo,
    ) -> Result<(), WriteError> {
        let unfit = |what: String| WriteError::Unfit(format!("the evidence of part {part}: {what}"));
        evidence.validate().map_err(unfit)?;
        let Some(known) = self.manifest.parts.get_mut(part) else { return Err(unfit("there is no such part".to_owned())) };
        known.evidence = Some(evidence);
        for texture in textures {
            let Some(info) = self.manifest.textures.get_mut(texture as usize) else {
                return Err(unfit(format!("there is no texture {texture}")));
            };
            info.evidence = true;
        }
        Ok(())
    }

    /// Adds an actor, and copies its files into the bundle.
    ///
    /// # Errors
    /// If another has its name, a file has a name that a bundle cannot hold, or something cannot be read or written.
    pub fn add_actor(&mut self, meta: &ActorMeta) -> Result<(), WriteError> {
        let name = meta.actor.display_name();
        if self.manifest.actors.iter().any(|known| known.display_name().eq_ignore_ascii_case(name)) {
            return Err(WriteError::Unfit(format!("two actors are called `{name}`")));
        }
        let (actor, files) = copy_actor(self.staging.folder(), meta, &self.actors)?;
        self.actors.push(meta.clone());
        self.manifest.actors.push(actor);
        self.manifest.files.extend(files);
        Ok(())
    }

    /// Adds what happens in the site, and copies its files from the site's folder into the bundle.
    ///
    /// # Errors
    /// If two files have the same name, one has a name that a bundle cannot hold, or something cannot be read or written.
    pub fn add_living(&mut self, site: &Path) -> Result<(), WriteError> {
        let (living, files) = copy_living(self.staging.folder(), site, &self.meta.living)?;
        self.manifest.living = living;
        self.manifest.files.extend(files);
        Ok(())
    }

    /// Appends a chunk. Chunks come in the order of their parts.
    ///
    /// # Errors
    /// If the chunk is malformed, does not fit the bundle, or cannot be written.
    pub fn push_chunk(&mut self, chunk: &LitChunk) -> Result<(), WriteError> {
        let index = self.manifest.counts.chunks;
        chunk.validate().map_err(|fault| WriteError::Chunk { index, fault })?;
        let unfit = |what: String| Err(WriteError::Unfit(format!("chunk {index}: {what}")));
        if chunk.light.layout() != self.manifest.light {
            return unfit(format!("its light is {:?}, the bundle's {:?}", chunk.light.layout(), self.manifest.light));
        }
        let part = usize::from(chunk.part);
        if part >= self.manifest.parts.len() {
            return unfit(format!("it names part {part} of {}", self.manifest.parts.len()));
        }
        if self.manifest.parts[part + 1..].iter().any(|p| p.counts.chunks > 0) {
            return unfit(format!("part {part} comes after a later part"));
        }
        if chunk.texture.is_some_and(|t| t as usize >= self.textures.len()) {
            return unfit(format!("it names texture {:?} of {}", chunk.texture, self.textures.len()));
        }
        let details = self.manifest.parts[part].material_details.len();
        if chunk.detail.is_some_and(|detail| detail as usize >= details) {
            return unfit(format!("it names detail {:?} of {details}", chunk.detail));
        }
        if !chunk.texel_uvs.is_empty() && self.manifest.texels.is_none() {
            return unfit("it is lit by texels, of which none were added".to_owned());
        }
        self.make_room(chunk)?;
        let glb = match &mut self.glb {
            Some(glb) => glb,
            None => self.glb.insert(OpenGlb::create(self.staging.folder(), self.manifest.geometry.len(), &self.meta.tool)?),
        };
        glb.push(chunk, &self.manifest, &self.textures)?;
        let (low, high) = bounds(&chunk.positions);
        (self.low, self.high) = (self.low.min(low), self.high.max(high));
        let more = Counts {
            chunks: 1,
            vertices: chunk.positions.len() as u64,
            triangles: chunk.triangles.len() as u64,
            invalid_vertices: chunk.valid.iter().filter(|&&v| v == 0).count() as u64,
        };
        self.manifest.counts.add(more);
        self.manifest.parts[part].counts.add(more);
        Ok(())
    }

    /// Ends the open glTF file where the chunk would make it too large.
    fn make_room(&mut self, chunk: &LitChunk) -> Result<(), WriteError> {
        let Some(glb) = &self.glb else { return Ok(()) };
        let layout = chunk.light.layout();
        let floats = 10 + layout.transfer_floats() + layout.bounce_floats() + 16;
        let vertex_bytes = 4 * (floats + layout.mask_words() + 1) as u64 + 8;
        let has = |texture: u32| glb.materials.keys().any(|(known, _)| *known == Some(texture));
        let texture_bytes = match chunk.texture.filter(|&texture| !has(texture)) {
            Some(t) => self.manifest.textures[t as usize].bytes,
            None => 0,
        };
        let more = vertex_bytes * chunk.positions.len() as u64 + 6 * chunk.triangles.len() as u64 + texture_bytes;
        if glb.builder.estimated_len() + more > self.options.max_glb_bytes {
            self.close_glb()?;
        }
        Ok(())
    }

    fn close_glb(&mut self) -> Result<(), WriteError> {
        if let Some(glb) = self.glb.take() {
            let stored = glb.builder.finish(&self.staging.folder().join(&glb.name), &glb.name)?;
            self.manifest.geometry.push(glb.name);
            self.manifest.files.push(stored);
        }
        Ok(())
    }

    /// Writes the lapse and the manifest, and puts the bundle in its place.
    ///
    /// # Errors
    /// If there are no chunks, the lapse does not fit the light or names a sky map that was not added, or something cannot be
    /// written.
    pub fn finish(mut self, lapse: &Lapse) -> Result<Manifest, WriteError> {
        if self.manifest.counts.chunks == 0 {
            return Err(WriteError::Unfit("the bundle holds no triangles".to_owned()));
        }
        check_lapse(lapse, self.manifest.light).map_err(WriteError::Unfit)?;
        let has_map = |path: &str| self.manifest.files.iter().any(|f| f.path == path);
        if let Some(step) = lapse.steps.iter().find(|step| !has_map(&step.sky_map)) {
            return Err(WriteError::Unfit(format!(
                "the step at {} names sky map `{}`, which was not added",
                step.time, step.sky_map
            )));
        }
        self.close_glb()?;
        for texture in &self.textures {
            std::fs::remove_file(&texture.path).map_err(io_fault(&texture.path))?;
        }
        let folder = self.staging.folder();
        let lapse_path = folder.join(LAPSE_FILE_NAME);
        let mut text = serde_json::to_vec_pretty(lapse).map_err(|e| WriteFault::json(&lapse_path, &e))?;
        text.push(b'\n');
        self.manifest.files.push(store(folder, LAPSE_FILE_NAME, &text)?);
        self.manifest.files.sort_by(|a, b| a.path.cmp(&b.path));
        self.manifest.bounds = crate::manifest::Bounds { min: self.low.to_array(), max: self.high.to_array() };
        let manifest = self.manifest.with_late_meta(self.meta);
        let text = manifest.to_json().map_err(|e| WriteFault::json(&folder.join(MANIFEST_FILE_NAME), &e))?;
        let _: StoredFile = store(folder, MANIFEST_FILE_NAME, &text)?;
        for inner in folders_of(&manifest.files) {
            sync_folder(&folder.join(inner))?;
        }
        self.staging.commit()?;
        Ok(manifest)
    }
}

fn unfit_detail(part: usize, what: impl Display) -> WriteError {
    WriteError::Unfit(format!("the detail of part {part}: {what}"))
}

/// The file of the light grid.
const GRID_FILE_NAME: &str = "grid.glb";

/// What a glTF file says of itself.
fn asset(tool: &str) -> Asset {
    Asset {
        version: "2.0".to_owned(),
        generator: Some(tool.to_owned()),
        extras: Some(AssetExtras { heliodon_profile: Some(PROFILE_VERSION), ..AssetExtras::default() }),
    }
}

impl OpenGlb {
    fn create(folder: &Path, number: usize, tool: &str) -> Result<Self, WriteFault> {
        let name = if number == 0 { "site.glb".to_owned() } else { format!("site-{number}.glb") };
        let mut builder = GlbBuilder::create(folder.join(format!(".{name}.spool")))?;
        builder.gltf.asset = asset(tool);
        builder.gltf.scene = Some(0);
        builder.gltf.scenes = vec![Scene::default()];
        Ok(Self { builder, name, materials: BTreeMap::new(), mesh: None })
    }

    fn push(&mut self, chunk: &LitChunk, manifest: &Manifest, textures: &[SpooledTexture]) -> Result<(), WriteFault> {
        let look = (chunk.texture, chunk.detail);
        let material = match self.materials.get(&look) {
            Some(&material) => material,
            None => self.add_material(look, manifest, textures)?,
        };
        let attributes = self.builder.push_chunk_attributes(chunk)?;
        let indices = self.builder.push_triangles(&chunk.triangles)?;
        let gltf = &mut self.builder.gltf;
        if self.mesh != Some(chunk.part) {
            self.mesh = Some(chunk.part);
            let part = &manifest.parts[usize::from(chunk.part)];
            gltf.meshes.push(Mesh { name: Some(part.name.clone()), primitives: Vec::new() });
            gltf.nodes.push(Node {
                name: Some(part.name.clone()),
                mesh: Some(gltf.meshes.len() - 1),
                extras: Some(NodeExtras { part: chunk.part, role: Some(part.role) }),
                ..Node::default()
            });
            gltf.scenes[0].nodes.push(gltf.nodes.len() - 1);
        }
        if let Some(mesh) = gltf.meshes.last_mut() {
            mesh.primitives.push(Primitive { attributes, indices: Some(indices), material: Some(material), mode: None });
        }
        Ok(())
    }

    fn add_material(
        &mut self,
        look: (Option<u32>, Option<u32>),
        manifest: &Manifest,
        files: &[SpooledTexture],
    ) -> Result<usize, WriteFault> {
        let (texture, detail) = look;
        let same = self.materials.iter().find(|((known, _), _)| texture.is_some() && *known == texture);
        let known =
            same.and_then(|(_, &material)| self.builder.gltf.materials[material].pbr_metallic_roughness.base_color_texture);
        let shown = match texture {
            Some(_) if known.is_some() => known,
            Some(index) => {
                let (info, SpooledTexture { path, wrap }) = (&manifest.textures[index as usize], &files[index as usize]);
                let bytes = std::fs::read(path).map_err(io_fault(path))?;
                Some(TextureRef { index: self.builder.push_texture(index, &info.name, &info.mime, *wrap, &bytes)? })
            }
            None => None,
        };
        let pbr = Pbr { base_color_texture: shown, metallic_factor: 0.0, roughness_factor: 1.0 };
        let extras = detail.map(|_| MaterialExtras { detail });
        let material = Material { pbr_metallic_roughness: pbr, double_sided: true, extras, ..Material::default() };
        let materials = &mut self.builder.gltf.materials;
        materials.push(material);
        self.materials.insert(look, materials.len() - 1);
        Ok(materials.len() - 1)
    }
}
