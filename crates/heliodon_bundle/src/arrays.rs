//! What was baked, as NumPy files: numbers for others' programs.
//!
//! N vertices and M triangles over all parts, in bundle order; vertices at the borders of chunks come once for each chunk.
//!
//! | file | shape | holds |
//! | --- | --- | --- |
//! | `positions.npy`, `normals.npy` | (N,3) f32 | metres; unit length |
//! | `albedo.npy` | (N,3) f32 | linear, textures included |
//! | `triangles.npy` | (M,3) u32 | vertex indices |
//! | `part.npy` | (N) u16 | index of the part |
//! | `valid.npy` | (N) u8 | 0 where the vertex borrowed its light |
//! | `sun_mask.npy` | (N,W) u32 | bit t mod 32 of word t / 32 |
//! | `sky_transfer.npy` | (N,C) or (N,C,3) f32 | irradiance / pi per coefficient |
//! | `sun_bounce.npy` | (T,N,3) f32 | on request: bounced sunlight at each step, irradiance / pi for a sun of unit irradiance |
//! | `lapse.json` | | the light of the day |

use crate::albedo::VertexAlbedo;
use crate::chunk::LitChunk;
use crate::layout::vec3_bytes;
use crate::manifest::LAPSE_FILE_NAME;
use crate::npy::NpyFile;
use crate::reader::{BundleReader, ReadError};
use crate::storage::{WriteFault, io_fault};
use glam::Vec3;
use serde::Serialize;
use std::path::Path;
use thiserror::Error;

/// What keeps arrays from being written.
#[derive(Debug, Error)]
pub enum ArraysError {
    /// The bundle cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The arrays cannot be written.
    #[error(transparent)]
    Write(#[from] WriteFault),
    /// There are more vertices than 32-bit indices name.
    #[error("{0} vertices are more than the indices of triangles.npy can name")]
    TooMany(u64),
}

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ArraysReport {
    /// N.
    pub vertices: u64,
    /// M.
    pub triangles: u64,
    /// The files, in the order in which they were written.
    pub files: Vec<String>,
}

struct Arrays {
    positions: NpyFile,
    normals: NpyFile,
    albedo: NpyFile,
    triangles: NpyFile,
    part: NpyFile,
    valid: NpyFile,
    sun_mask: NpyFile,
    sky_transfer: NpyFile,
    sun_bounce: Option<NpyFile>,
}

/// Writes a bundle's arrays into a folder, which is made where it is not there. Holds one chunk in memory.
///
/// With `sun_bounce` also the sun's bounced light at every sun step, rebuilt from its functions; zero where none was baked.
///
/// # Errors
/// If the bundle cannot be read or the arrays cannot be written; then none of the files gets its name.
pub fn write_arrays(reader: &BundleReader, folder: &Path, sun_bounce: bool) -> Result<ArraysReport, ArraysError> {
    let (n, m) = (reader.vertex_count(), reader.triangle_count());
    if n > u64::from(u32::MAX) {
        return Err(ArraysError::TooMany(n));
    }
    std::fs::create_dir_all(folder).map_err(io_fault(folder))?;
    let layout = reader.manifest().light;
    let file = |name: &str, dtype: &str, shape: &[u64]| NpyFile::create(folder, name, dtype, shape);
    let coefficients = u64::from(layout.coefficients);
    let transfer_shape: &[u64] = if layout.channels == 3 { &[n, coefficients, 3] } else { &[n, coefficients] };
    let mut arrays = Arrays {
        positions: file("positions", "<f4", &[n, 3])?,
        normals: file("normals", "<f4", &[n, 3])?,
        albedo: file("albedo", "<f4", &[n, 3])?,
        triangles: file("triangles", "<u4", &[m, 3])?,
        part: file("part", "<u2", &[n])?,
        valid: file("valid", "|u1", &[n])?,
        sun_mask: file("sun_mask", "<u4", &[n, layout.mask_words() as u64])?,
        sky_transfer: file("sky_transfer", "<f4", transfer_shape)?,
        sun_bounce: None,
    };
    if sun_bounce {
        arrays.sun_bounce = Some(file("sun_bounce", "<f4", &[u64::from(layout.sun_steps), n, 3])?);
    }
    let mut albedo = VertexAlbedo::new(reader);
    let mut first = 0;
    for index in 0..reader.chunk_count() {
        let chunk = reader.read_chunk(index)?;
        let albedo = albedo.of(&chunk)?;
        arrays.push(reader, &chunk, &albedo, first)?;
        first += chunk.vertex_count() as u64;
    }
    let lapse_part = folder.join(".lapse.json.part");
    let source = reader.folder().join(LAPSE_FILE_NAME);
    std::fs::copy(&source, &lapse_part).map_err(io_fault(&lapse_part))?;
    let mut files = arrays.publish()?;
    let target = folder.join(LAPSE_FILE_NAME);
    std::fs::rename(&lapse_part, &target).map_err(io_fault(&target))?;
    files.push(LAPSE_FILE_NAME.to_owned());
    Ok(ArraysReport { vertices: n, triangles: m, files })
}

impl Arrays {
    fn push(&mut self, reader: &BundleReader, chunk: &LitChunk, albedo: &[Vec3], first: u64) -> Result<(), WriteFault> {
        self.positions.write(&vec3_bytes(&chunk.positions))?;
        self.normals.write(&vec3_bytes(&chunk.normals))?;
        self.albedo.write(&vec3_bytes(albedo))?;
        let corners = chunk.triangles.as_flattened().iter();
        let corners: Vec<u8> = corners.flat_map(|&i| (first as u32 + i).to_le_bytes()).collect();
        self.triangles.write(&corners)?;
        self.part.write(&chunk.part.to_le_bytes().repeat(chunk.vertex_count()))?;
        self.valid.write(&chunk.valid)?;
        let words: Vec<u8> = chunk.light.sun_mask.iter().flat_map(|w| w.to_le_bytes()).collect();
        self.sun_mask.write(&words)?;
        let floats: Vec<u8> = chunk.light.sky_transfer.iter().flat_map(|f| f.to_le_bytes()).collect();
        self.sky_transfer.write(&floats)?;
        if let Some(file) = &mut self.sun_bounce {
            let functions = reader.lapse().sun_bounce_basis.as_ref().map_or(&[][..], |basis| &basis.functions);
            for step in 0..chunk.light.sun_steps {
                let bounced = bounced_sun(chunk, functions, step as usize);
                let offset = 12 * (u64::from(step) * reader.vertex_count() + first);
                file.write_at(offset, &vec3_bytes(&bounced))?;
            }
        }
        Ok(())
    }

    fn publish(mut self) -> Result<Vec<String>, WriteFault> {
        let mut all = vec![
            self.positions,
            self.normals,
            self.albedo,
            self.triangles,
            self.part,
            self.valid,
            self.sun_mask,
            self.sky_transfer,
        ];
        all.extend(self.sun_bounce.take());
        for file in &mut all {
            file.finish()?;
        }
        let mut names = Vec::new();
        for file in all {
            names.push(file.publish()?);
        }
        Ok(names)
    }
}

/// Bounced sunlight of every vertex at a step: `max(0, sum_r b_r f_r(t))`, grey for all three channels.
fn bounced_sun(chunk: &LitChunk, functions: &[Vec<f32>], step: usize) -> Vec<Vec3> {
    let layout = chunk.light.layout();
    let (count, channels) = (layout.bounce_floats(), layout.channels as usize);
    let of_vertex = |vertex: usize| {
        let own = &chunk.light.sun_bounce[vertex * count..(vertex + 1) * count];
        let mut sum = [0.0; 3];
        for (values, function) in own.chunks_exact(channels).zip(functions) {
            for (c, total) in sum.iter_mut().enumerate() {
                *total += values[c % channels] * function[step];
            }
        }
        Vec3::from_array(sum).max(Vec3::ZERO)
    };
    (0..chunk.vertex_count()).map(of_vertex).collect()
}
