//! One glTF file of a bundle: where its chunks lie.

use super::ChunkInfo;
use super::error::{ReadError, io_error, malformed};
use super::positional::read_exact_at;
use crate::chunk::{LightLayout, LitChunk, MAX_CHUNK_TRIANGLES, MAX_CHUNK_VERTICES, VertexLight};
use crate::glb::{BIN_CHUNK, JSON_CHUNK, MAGIC, POINTS};
use crate::gltf::{Accessor, Gltf, Material, Primitive, Sampler};
use crate::grid::{AXES, GridInfo, GridPoints};
use crate::layout::{
    self, AttributeType, COLOR_U16, FLAG_U8, LightAttributes, MASK_U16, PROFILE_VERSION, VEC2_F32, VEC3_F32, VEC4_F32,
    component,
};
use crate::manifest::{Bounds, Manifest};
use glam::{DVec3, Vec3};
use heliodon_image::TextureWrap;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Bytes of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Span {
    offset: u64,
    len: u64,
}

/// A base colour image in a glTF file.
#[derive(Clone, Copy, Debug)]
pub(super) struct EmbeddedImage {
    /// The bundle's texture that it is.
    pub(super) texture: u32,
    pub(super) bytes: Span,
    /// How it goes on along u and v.
    pub(super) wrap: [TextureWrap; 2],
}

/// A glTF file, open.
#[derive(Debug)]
pub(super) struct GlbFile {
    path: PathBuf,
    file: File,
}

/// Where a chunk's arrays lie.
#[derive(Debug)]
pub(super) struct ChunkPlace {
    pub(super) file: usize,
    pub(super) info: ChunkInfo,
    positions: Span,
    normals: Span,
    uvs: Option<Span>,
    texel_uvs: Option<Span>,
    colors: Option<Span>,
    light: LightPlace,
    valid: Option<Span>,
    indices: Span,
}

/// Where the light of some vertices lies.
#[derive(Debug)]
struct LightPlace {
    masks: Vec<Span>,
    transfers: Vec<Span>,
    bounces: Vec<Span>,
}

/// Where a primitive of a light grid lies.
#[derive(Debug)]
pub(super) struct GridPlace {
    positions: Span,
    light: LightPlace,
    valid: Option<Span>,
}

/// The JSON of a file, with what is needed to check its offsets.
struct Document<'a> {
    path: &'a Path,
    gltf: Gltf,
    bin: Span,
}

impl GlbFile {
    /// Opens a file; answers with its chunks, in order, and with the images that it embeds.
    pub(super) fn open(
        path: &Path,
        number: usize,
        manifest: &Manifest,
    ) -> Result<(Self, Vec<ChunkPlace>, Vec<EmbeddedImage>), ReadError> {
        let (this, document) = Self::open_document(path)?;
        let chunks = document.chunks(number, manifest)?;
        let images = document.images()?;
        Ok((this, chunks, images))
    }

    /// Opens the file of a light grid; answers with its primitives, in order.
    pub(super) fn open_grid(path: &Path, info: &GridInfo, manifest: &Manifest) -> Result<(Self, Vec<GridPlace>), ReadError> {
        let (this, document) = Self::open_document(path)?;
        let places = document.grid(info, manifest.light)?;
        Ok((this, places))
    }

    fn open_document(path: &Path) -> Result<(Self, Document<'_>), ReadError> {
        let file = File::open(path).map_err(io_error(path))?;
        let size = file.metadata().map_err(io_error(path))?.len();
        let wrong = |what: &str| malformed(path, what);
        let header = |offset: u64, words: &mut [u32]| -> Result<(), ReadError> {
            let mut bytes = vec![0; words.len() * 4];
            if offset + bytes.len() as u64 > size {
                return Err(wrong("the file is cut short"));
            }
            read_exact_at(&file, &mut bytes, offset).map_err(io_error(path))?;
            for (word, b) in words.iter_mut().zip(bytes.as_chunks::<4>().0) {
                *word = u32::from_le_bytes(*b);
            }
            Ok(())
        };
        let mut words = [0; 5];
        header(0, &mut words)?;
        let [magic, version, length, json_len, json_kind] = words;
        if (magic, version, json_kind) != (MAGIC, 2, JSON_CHUNK) {
            return Err(wrong("not a binary glTF 2.0 file"));
        }
        let bin_header = 20 + u64::from(json_len);
        let mut words = [0; 2];
        if u64::from(length) != size || bin_header + 8 > size {
            return Err(wrong("its size is not the one that it says"));
        }
        header(bin_header, &mut words)?;
        let bin = Span { offset: bin_header + 8, len: u64::from(words[0]) };
        if words[1] != BIN_CHUNK || bin.offset + bin.len > size {
            return Err(wrong("its buffer is cut short"));
        }
        let this = Self { path: path.to_owned(), file };
        let json = this.read_span(Span { offset: 20, len: u64::from(json_len) })?;
        let gltf: Gltf = serde_json::from_slice(&json).map_err(|e| malformed(path, format!("its JSON: {e}")))?;
        Ok((this, Document { path, gltf, bin }))
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Reads bytes that were found to lie within the file.
    pub(super) fn read_span(&self, span: Span) -> Result<Vec<u8>, ReadError> {
        let mut bytes = vec![0; span.len as usize];
        read_exact_at(&self.file, &mut bytes, span.offset).map_err(io_error(&self.path))?;
        Ok(bytes)
    }

    pub(super) fn read_chunk(&self, place: &ChunkPlace, layout: LightLayout) -> Result<LitChunk, ReadError> {
        let n = place.info.vertices as usize;
        Ok(LitChunk {
            part: place.info.part,
            texture: place.info.texture,
            detail: place.info.detail,
            positions: layout::read_vec3(&self.read_span(place.positions)?),
            normals: layout::read_vec3(&self.read_span(place.normals)?),
            uvs: place.uvs.map_or(Ok(Vec::new()), |span| Ok(layout::read_vec2(&self.read_span(span)?)))?,
            texel_uvs: place.texel_uvs.map_or(Ok(Vec::new()), |span| Ok(layout::read_vec2(&self.read_span(span)?)))?,
            albedo: match place.colors {
                Some(span) => layout::read_colors(&self.read_span(span)?),
                None => vec![Vec3::ONE; n],
            },
            triangles: layout::read_triangles(&self.read_span(place.indices)?),
            valid: match place.valid {
                Some(span) => self.read_span(span)?.into_iter().step_by(FLAG_U8.stride as usize).collect(),
                None => vec![1; n],
            },
            light: self.read_light(&place.light, layout, n)?,
        })
    }

    /// The light of so many vertices.
    fn read_light(&self, place: &LightPlace, layout: LightLayout, vertices: usize) -> Result<VertexLight, ReadError> {
        let mut light = layout::empty_light(layout, vertices);
        for (i, &span) in place.masks.iter().enumerate() {
            let bytes = self.read_span(span)?;
            let words = bytes.as_chunks::<4>().0.iter().map(|&b| u32::from_le_bytes(b));
            layout::scatter(words, 2, i, layout.mask_words(), &mut light.sun_mask);
        }
        for (i, &span) in place.transfers.iter().enumerate() {
            let bytes = self.read_span(span)?;
            layout::scatter(layout::read_f32(&bytes), 4, i, layout.transfer_floats(), &mut light.sky_transfer);
        }
        for (i, &span) in place.bounces.iter().enumerate() {
            let bytes = self.read_span(span)?;
            layout::scatter(layout::read_f32(&bytes), 4, i, layout.bounce_floats(), &mut light.sun_bounce);
        }
        Ok(light)
    }

    /// All points of a light grid.
    pub(super) fn read_grid(
        &self,
        places: &[GridPlace],
        info: &GridInfo,
        layout: LightLayout,
    ) -> Result<GridPoints, ReadError> {
        let mut grid = GridPoints {
            origin: info.origin,
            spacing_m: info.spacing_m,
            light: layout::empty_light(layout, 0),
            ..GridPoints::default()
        };
        for place in places {
            let positions = layout::read_vec3(&self.read_span(place.positions)?);
            for six in positions.as_chunks::<6>().0 {
                grid.cells.push(cell_at(six[0], info).ok_or_else(|| malformed(&self.path, "a point is not on the lattice"))?);
            }
            let light = self.read_light(&place.light, layout, positions.len())?;
            grid.light.sun_mask.extend(light.sun_mask);
            grid.light.sky_transfer.extend(light.sky_transfer);
            grid.light.sun_bounce.extend(light.sun_bounce);
            match place.valid {
                Some(span) => {
                    let flags = self.read_span(span)?;
                    grid.valid.extend(flags.into_iter().step_by(FLAG_U8.stride as usize * AXES.len()));
                }
                None => grid.valid.resize(grid.cells.len(), 1),
            }
        }
        Ok(grid)
    }
}

/// How far off its place on the lattice a stored point may be, in cells: what 32-bit coordinates of a place as far as a lattice may
/// reach are rounded by stays below.
const OFF_LATTICE_CELLS: f64 = 0.25;

/// The lattice coordinates of a stored point.
fn cell_at(position: Vec3, info: &GridInfo) -> Option<[u32; 3]> {
    let at = (position.as_dvec3() - DVec3::from_array(info.origin)) / info.spacing_m;
    let cell = at.round();
    let off = (at - cell).abs().max_element();
    let within = (0..3).all(|axis| cell[axis] >= 0.0 && cell[axis] < f64::from(info.cells[axis]));
    // a NaN is nowhere
    (within && off <= OFF_LATTICE_CELLS).then(|| cell.to_array().map(|c| c as u32))
}

/// Where all attributes of the light are, as `span` finds each.
fn light_place(
    layout: LightLayout,
    span: impl Fn(&str, AttributeType) -> Result<Span, ReadError>,
) -> Result<LightPlace, ReadError> {
    let names = LightAttributes::of(layout);
    let all = |names: &[String], kind| names.iter().map(|name| span(name, kind)).collect::<Result<Vec<_>, _>>();
    Ok(LightPlace {
        masks: all(&names.masks, MASK_U16)?,
        transfers: all(&names.transfers, VEC4_F32)?,
        bounces: all(&names.bounces, VEC4_F32)?,
    })
}

impl Document<'_> {
    fn wrong(&self, what: impl Into<String>) -> ReadError {
        malformed(self.path, what)
    }

    /// The chunks in bundle order: nodes of the scene, each with its mesh's primitives.
    fn chunks(&self, number: usize, manifest: &Manifest) -> Result<Vec<ChunkPlace>, ReadError> {
        let gltf = &self.gltf;
        let profile = gltf.asset.extras.as_ref().and_then(|e| e.heliodon_profile);
        if profile != Some(PROFILE_VERSION) {
            return Err(self.wrong(format!("its profile is {profile:?}, not {PROFILE_VERSION}")));
        }
        if let Some(extension) = gltf.extensions_required.first() {
            return Err(self.wrong(format!("it requires the extension {extension}")));
        }
        let scene = gltf.scene.and_then(|i| gltf.scenes.get(i)).ok_or_else(|| self.wrong("it has no scene"))?;
        let mut chunks = Vec::new();
        // more primitives than accessors means that meshes are used twice, which the profile does not do
        let most = gltf.accessors.len();
        for &node in &scene.nodes {
            let node = gltf.nodes.get(node).ok_or_else(|| self.wrong(format!("there is no node {node}")))?;
            let part = node.extras.as_ref().map(|e| e.part).ok_or_else(|| self.wrong("a node belongs to no part"))?;
            if usize::from(part) >= manifest.parts.len() {
                return Err(self.wrong(format!("a node names part {part} of {}", manifest.parts.len())));
            }
            if node.matrix.is_some() || node.translation.is_some() || node.rotation.is_some() || node.scale.is_some() {
                return Err(self.wrong("a node is moved, which the profile has not"));
            }
            let mesh = node.mesh.and_then(|i| gltf.meshes.get(i)).ok_or_else(|| self.wrong("a node has no mesh"))?;
            for primitive in &mesh.primitives {
                if chunks.len() > most {
                    return Err(self.wrong("meshes are used more than once"));
                }
                chunks.push(self.chunk(number, part, primitive, manifest)?);
            }
        }
        Ok(chunks)
    }

    fn chunk(&self, file: usize, part: u16, primitive: &Primitive, manifest: &Manifest) -> Result<ChunkPlace, ReadError> {
        if primitive.mode.is_some_and(|mode| mode != 4) {
            return Err(self.wrong("a primitive is no list of triangles"));
        }
        let accessor = |name: &str| primitive.attributes.get(name).map(|&i| self.accessor(i)).transpose();
        let need = |name: &str| accessor(name)?.ok_or_else(|| self.wrong(format!("a primitive has no {name}")));
        let position = need("POSITION")?;
        let vertices = position.count;
        if vertices > MAX_CHUNK_VERTICES as u64 {
            return Err(self.wrong(format!("a primitive has {vertices} vertices")));
        }
        let span = |name: &str, kind| self.span(need(name)?, kind, vertices, name);
        let optional = |name: &str, kind| accessor(name)?.map(|a| self.span(a, kind, vertices, name)).transpose();
        let texture = self.texture(primitive.material)?;
        if texture.is_some_and(|t| t as usize >= manifest.textures.len()) {
            return Err(self.wrong(format!("a primitive names texture {texture:?} of {}", manifest.textures.len())));
        }
        let detail = self.material(primitive.material)?.and_then(|material| material.extras).and_then(|extras| extras.detail);
        let details = manifest.parts[usize::from(part)].material_details.len();
        if detail.is_some_and(|detail| detail as usize >= details) {
            return Err(self.wrong(format!("a primitive names detail {detail:?} of {details}")));
        }
        let index_accessor = primitive.indices.ok_or_else(|| self.wrong("a primitive has no indices"))?;
        let index_accessor = self.accessor(index_accessor)?;
        let corners = index_accessor.count;
        if corners % 3 != 0 || corners / 3 > MAX_CHUNK_TRIANGLES as u64 {
            return Err(self.wrong(format!("a primitive has {corners} indices")));
        }
        let index_type =
            AttributeType { component: component::UNSIGNED_SHORT, kind: "SCALAR", normalized: false, stride: 2, spaced: false };
        let colors = optional("COLOR_0", COLOR_U16)?;
        if colors.is_none() && texture.is_none() {
            return Err(self.wrong("a primitive has neither COLOR_0 nor a texture"));
        }
        let texel_uvs = optional(layout::TEXEL_UV, VEC2_F32)?;
        if texel_uvs.is_some() && manifest.texels.is_none() {
            return Err(self.wrong("a primitive is lit by texels that the bundle has not"));
        }
        Ok(ChunkPlace {
            file,
            info: ChunkInfo {
                part,
                texture,
                detail,
                by_texels: texel_uvs.is_some(),
                vertices: vertices as u32,
                triangles: (corners / 3) as u32,
                bounds: self.bounds(position)?,
            },
            positions: span("POSITION", VEC3_F32)?,
            normals: span("NORMAL", VEC3_F32)?,
            uvs: texture.map(|_| span("TEXCOORD_0", VEC2_F32)).transpose()?,
            texel_uvs,
            colors,
            light: light_place(manifest.light, span)?,
            valid: optional("_VALID", FLAG_U8)?,
            indices: self.span(index_accessor, index_type, corners, "indices")?,
        })
    }

    /// The primitives of a light grid.
    fn grid(&self, info: &GridInfo, layout: LightLayout) -> Result<Vec<GridPlace>, ReadError> {
        let gltf = &self.gltf;
        let profile = gltf.asset.extras.as_ref().and_then(|e| e.heliodon_profile);
        if profile != Some(PROFILE_VERSION) {
            return Err(self.wrong(format!("its profile is {profile:?}, not {PROFILE_VERSION}")));
        }
        let [mesh] = &gltf.meshes[..] else { return Err(self.wrong("it has not one mesh")) };
        let mut found = 0;
        let places: Vec<GridPlace> = mesh
            .primitives
            .iter()
            .map(|primitive| {
                let accessor = |name: &str| primitive.attributes.get(name).map(|&i| self.accessor(i)).transpose();
                let need = |name: &str| accessor(name)?.ok_or_else(|| self.wrong(format!("a primitive has no {name}")));
                let vertices = need("POSITION")?.count;
                if primitive.mode != Some(POINTS) || vertices > MAX_CHUNK_VERTICES as u64 || vertices % AXES.len() as u64 != 0 {
                    return Err(
                        self.wrong(format!("a primitive is no list of points, six for each of the lattice ({vertices})"))
                    );
                }
                found += vertices / AXES.len() as u64;
                let span = |name: &str, kind| self.span(need(name)?, kind, vertices, name);
                let valid = accessor("_VALID")?.map(|a| self.span(a, FLAG_U8, vertices, "_VALID")).transpose()?;
                Ok(GridPlace { positions: span("POSITION", VEC3_F32)?, light: light_place(layout, span)?, valid })
            })
            .collect::<Result<_, _>>()?;
        if found != info.points {
            return Err(self.wrong(format!("it holds {found} points, not {}", info.points)));
        }
        Ok(places)
    }

    fn accessor(&self, index: usize) -> Result<&Accessor, ReadError> {
        self.gltf.accessors.get(index).ok_or_else(|| self.wrong(format!("there is no accessor {index}")))
    }

    /// Where an accessor's elements lie in the file, after all of its claims are checked.
    fn span(&self, accessor: &Accessor, kind: AttributeType, count: u64, name: &str) -> Result<Span, ReadError> {
        let is = (accessor.component_type, accessor.kind.as_str(), accessor.normalized);
        if is != (kind.component, kind.kind, kind.normalized) || accessor.sparse.is_some() || accessor.byte_offset != 0 {
            return Err(self.wrong(format!("{name} is not laid out as the profile says")));
        }
        if accessor.count != count {
            return Err(self.wrong(format!("{name} has {} elements, not {count}", accessor.count)));
        }
        let view = accessor.buffer_view.and_then(|i| self.gltf.buffer_views.get(i));
        let view = view.ok_or_else(|| self.wrong(format!("{name} has no buffer view")))?;
        if view.buffer != 0 || view.byte_stride.is_some_and(|s| s != kind.stride) || view.byte_stride.is_some() != kind.spaced {
            return Err(self.wrong(format!("{name} is not spaced as the profile says")));
        }
        // counts are at most 60,000 here, so this does not overflow
        let len = count * u64::from(kind.stride);
        if view.byte_length != len {
            return Err(self.wrong(format!("the view of {name} has {} bytes, not {len}", view.byte_length)));
        }
        self.within_buffer(view.byte_offset, len).ok_or_else(|| self.wrong(format!("{name} lies beyond the buffer")))
    }

    fn within_buffer(&self, offset: u64, len: u64) -> Option<Span> {
        let end = offset.checked_add(len)?;
        (end <= self.bin.len).then(|| Span { offset: self.bin.offset + offset, len })
    }

    fn bounds(&self, position: &Accessor) -> Result<Bounds, ReadError> {
        let corner = |values: &Option<Vec<f64>>| match values.as_deref() {
            Some(&[x, y, z]) if [x, y, z].iter().all(|c| (*c as f32).is_finite()) => Ok([x as f32, y as f32, z as f32]),
            _ => Err(self.wrong("POSITION has no bounds")),
        };
        Ok(Bounds { min: corner(&position.min)?, max: corner(&position.max)? })
    }

    /// A material by its index.
    fn material(&self, index: Option<usize>) -> Result<Option<&Material>, ReadError> {
        let of =
            |index: usize| self.gltf.materials.get(index).ok_or_else(|| self.wrong(format!("there is no material {index}")));
        index.map(of).transpose()
    }

    /// The texture that a material shows.
    fn texture(&self, material: Option<usize>) -> Result<Option<u32>, ReadError> {
        let gltf = &self.gltf;
        let Some(material) = self.material(material)? else { return Ok(None) };
        let Some(shown) = &material.pbr_metallic_roughness.base_color_texture else { return Ok(None) };
        let image = gltf.textures.get(shown.index).and_then(|t| t.source).and_then(|i| gltf.images.get(i));
        let index = image.and_then(|i| i.extras.as_ref()).map(|e| e.texture);
        index.map(Some).ok_or_else(|| self.wrong("a material shows an image that is not there"))
    }

    fn images(&self) -> Result<Vec<EmbeddedImage>, ReadError> {
        let mut found = Vec::new();
        for (index, image) in self.gltf.images.iter().enumerate() {
            let view = image.buffer_view.and_then(|i| self.gltf.buffer_views.get(i));
            let span = view.and_then(|v| self.within_buffer(v.byte_offset, v.byte_length));
            let (Some(extras), Some(bytes)) = (&image.extras, span) else {
                return Err(self.wrong("an image lies beyond the buffer"));
            };
            found.push(EmbeddedImage { texture: extras.texture, bytes, wrap: self.wrap_of(index)? });
        }
        Ok(found)
    }

    /// How the first texture that shows an image goes on; without a sampler it repeats, as glTF has it.
    fn wrap_of(&self, image: usize) -> Result<[TextureWrap; 2], ReadError> {
        let sampler =
            self.gltf.textures.iter().find(|texture| texture.source == Some(image)).and_then(|texture| texture.sampler);
        let Some(sampler) = sampler else { return Ok([TextureWrap::Repeat; 2]) };
        let wrap = self.gltf.samplers.get(sampler).and_then(Sampler::wrap);
        wrap.ok_or_else(|| self.wrong(format!("sampler {sampler} is not there, or wraps in no way that glTF has")))
    }
}
