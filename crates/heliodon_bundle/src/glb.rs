//! Writes a binary glTF file whose buffer is streamed: what comes in goes to a spool file, because the JSON, which is known
//! only at the end, stands before the buffer. The copy at the end costs one more pass over at most one file, and the disk
//! space of it for a moment.

use crate::chunk::LitChunk;
use crate::gltf::{Accessor, Buffer, BufferView, Gltf, Image, ImageExtras, Primitive, Sampler, Texture};
use crate::grid::GridPoints;
use crate::layout::{self, AttributeType, VEC3_F32, component};
use crate::storage::{HashedFile, StoredFile, WriteFault, io_fault};
use glam::Vec3;
use heliodon_image::TextureWrap;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Read, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

pub(crate) const MAGIC: u32 = 0x4654_6C67; // "glTF"
pub(crate) const JSON_CHUNK: u32 = 0x4E4F_534A; // "JSON"
pub(crate) const BIN_CHUNK: u32 = 0x004E_4942; // "BIN\0"
/// glTF's mode of a primitive that is a list of points.
pub(crate) const POINTS: u32 = 0;
const ARRAY_BUFFER: u32 = 34_962;
const ELEMENT_ARRAY_BUFFER: u32 = 34_963;
/// JSON of one buffer view with its accessor, at most: fifteen-digit numbers in every place, and bounds.
const JSON_BYTES_PER_VIEW: u64 = 600;

/// A GLB in the making.
pub(crate) struct GlbBuilder {
    pub(crate) gltf: Gltf,
    spool_path: PathBuf,
    spool: BufWriter<File>,
    bin_len: u64,
}

impl GlbBuilder {
    pub(crate) fn create(spool_path: PathBuf) -> Result<Self, WriteFault> {
        let file = File::create_new(&spool_path).map_err(io_fault(&spool_path))?;
        Ok(Self { gltf: Gltf::default(), spool_path, spool: BufWriter::with_capacity(1 << 20, file), bin_len: 0 })
    }

    /// The size of the file if it were finished now, never underestimated.
    pub(crate) fn estimated_len(&self) -> u64 {
        self.bin_len + 4096 + JSON_BYTES_PER_VIEW * (self.gltf.buffer_views.len() as u64 + 8)
    }

    /// Appends bytes to the buffer, aligned to 4, and answers with their view.
    fn push_view(&mut self, bytes: &[u8], stride: Option<u32>, target: Option<u32>) -> Result<usize, WriteFault> {
        let padding = (4 - self.bin_len % 4) % 4;
        self.spool.write_all(&[0; 3][..padding as usize]).map_err(io_fault(&self.spool_path))?;
        self.spool.write_all(bytes).map_err(io_fault(&self.spool_path))?;
        let view = BufferView {
            buffer: 0,
            byte_offset: self.bin_len + padding,
            byte_length: bytes.len() as u64,
            byte_stride: stride,
            target,
        };
        self.bin_len += padding + bytes.len() as u64;
        self.gltf.buffer_views.push(view);
        Ok(self.gltf.buffer_views.len() - 1)
    }

    fn push_accessor(&mut self, view: usize, kind: AttributeType, count: usize, bounds: Option<(Vec3, Vec3)>) -> usize {
        // exact in f64, so that a validator that compares with the data finds them equal
        let exact = |v: Vec3| v.to_array().map(f64::from).to_vec();
        self.gltf.accessors.push(Accessor {
            buffer_view: Some(view),
            byte_offset: 0,
            component_type: kind.component,
            normalized: kind.normalized,
            count: count as u64,
            kind: kind.kind.to_owned(),
            min: bounds.map(|b| exact(b.0)),
            max: bounds.map(|b| exact(b.1)),
            sparse: None,
        });
        self.gltf.accessors.len() - 1
    }

    /// Appends an attribute; POSITION comes with its bounds.
    pub(crate) fn push_attribute(
        &mut self,
        kind: AttributeType,
        bytes: &[u8],
        bounds: Option<(Vec3, Vec3)>,
    ) -> Result<usize, WriteFault> {
        let view = self.push_view(bytes, kind.spaced.then_some(kind.stride), Some(ARRAY_BUFFER))?;
        Ok(self.push_accessor(view, kind, bytes.len() / kind.stride as usize, bounds))
    }

    /// Appends triangles as 16-bit indices.
    pub(crate) fn push_triangles(&mut self, triangles: &[[u32; 3]]) -> Result<usize, WriteFault> {
        let view = self.push_view(&layout::indices_bytes(triangles), None, Some(ELEMENT_ARRAY_BUFFER))?;
        let scalar = AttributeType { component: component::UNSIGNED_SHORT, kind: "SCALAR", ..VEC3_F32 };
        Ok(self.push_accessor(view, scalar, triangles.len() * 3, None))
    }

    /// Appends all attributes of a chunk.
    pub(crate) fn push_chunk_attributes(&mut self, chunk: &LitChunk) -> Result<BTreeMap<String, usize>, WriteFault> {
        let mut attributes = BTreeMap::new();
        for (name, kind, bytes) in layout::encode(chunk) {
            let bounds = (name == "POSITION").then(|| bounds(&chunk.positions));
            attributes.insert(name, self.push_attribute(kind, &bytes, bounds)?);
        }
        Ok(attributes)
    }

    /// Appends some lattice points of a grid as a primitive of points.
    pub(crate) fn push_grid(&mut self, points: &GridPoints, range: Range<usize>) -> Result<Primitive, WriteFault> {
        let positions: Vec<Vec3> = points.cells[range.clone()].iter().map(|&cell| points.position(cell)).collect();
        let mut attributes = BTreeMap::new();
        for (name, kind, bytes) in layout::encode_grid(points, range) {
            let bounds = (name == "POSITION").then(|| bounds(&positions));
            attributes.insert(name, self.push_attribute(kind, &bytes, bounds)?);
        }
        Ok(Primitive { attributes, mode: Some(POINTS), ..Primitive::default() })
    }

    /// Embeds an image and answers with the index of a texture that shows it and goes on as `wrap` says.
    pub(crate) fn push_texture(
        &mut self,
        index: u32,
        name: &str,
        mime: &str,
        wrap: [TextureWrap; 2],
        bytes: &[u8],
    ) -> Result<usize, WriteFault> {
        let view = self.push_view(bytes, None, None)?;
        let samplers = &mut self.gltf.samplers;
        let wanted = Sampler::trilinear(wrap);
        let sampler = samplers.iter().position(|sampler| *sampler == wanted).unwrap_or_else(|| {
            samplers.push(wanted);
            samplers.len() - 1
        });
        self.gltf.images.push(Image {
            name: Some(name.to_owned()),
            mime_type: Some(mime.to_owned()),
            buffer_view: Some(view),
            extras: Some(ImageExtras { texture: index }),
        });
        self.gltf.textures.push(Texture { sampler: Some(sampler), source: Some(self.gltf.images.len() - 1) });
        Ok(self.gltf.textures.len() - 1)
    }

    /// Writes the file, syncs it, and removes the spool.
    pub(crate) fn finish(mut self, path: &Path, name: &str) -> Result<StoredFile, WriteFault> {
        let padding = (4 - self.bin_len % 4) % 4;
        self.spool.write_all(&[0; 3][..padding as usize]).map_err(io_fault(&self.spool_path))?;
        self.spool.flush().map_err(io_fault(&self.spool_path))?;
        let bin_len = self.bin_len + padding;
        self.gltf.buffers = vec![Buffer { byte_length: bin_len, uri: None }];
        let mut json = serde_json::to_vec(&self.gltf).map_err(|e| WriteFault::json(path, &e))?;
        json.resize(json.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + json.len() as u64 + 8 + bin_len;
        let lengths = (u32::try_from(total), u32::try_from(bin_len));
        let (Ok(total), Ok(bin_len)) = lengths else {
            return Err(WriteFault::TooLarge { path: path.to_owned(), bytes: total });
        };

        let mut out = HashedFile::create(path)?;
        for word in [MAGIC, 2, total, json.len() as u32, JSON_CHUNK] {
            out.write(&word.to_le_bytes())?;
        }
        out.write(&json)?;
        for word in [bin_len, BIN_CHUNK] {
            out.write(&word.to_le_bytes())?;
        }
        let mut spool = File::open(&self.spool_path).map_err(io_fault(&self.spool_path))?;
        let mut block = vec![0; 1 << 20];
        loop {
            let n = spool.read(&mut block).map_err(io_fault(&self.spool_path))?;
            if n == 0 {
                break;
            }
            out.write(&block[..n])?;
        }
        std::fs::remove_file(&self.spool_path).map_err(io_fault(&self.spool_path))?;
        out.finish(name)
    }
}

/// The corners of the box around at least one point.
pub(crate) fn bounds(points: &[Vec3]) -> (Vec3, Vec3) {
    points.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), &p| (lo.min(p), hi.max(p)))
}
