//! The visibility matrix on a GPU, by depth maps or by rays.
//!
//! M. Sattler, R. Sarlette, G. Zachmann, R. Klein: "Hardware-accelerated ambient occlusion computation", VMV 2004. The paper draws the
//! depth of the mesh from each direction, then each vertex as a point with an occlusion query of its own, and fetches every answer. Here
//! many directions share one pass (a tile of an atlas each), a compute shader compares all vertices with it, and a bit an entry stays on
//! the GPU, where the light is summed as well (the paper's section 8.1).
//!
//! Against rays, a depth map errs where a shadow's edge passes within a texel of a vertex, and it must let things lie a little below the
//! map: [`DepthMaps::bias`]. Contact shadows narrower than that are lost. [`Rays`] have neither: a compute shader walks a hierarchy of boxes whose shape is
//! made once, and whose boxes are fitted on the GPU where vertices move. They write the same bits, and what follows is shared.

mod atlas;
mod maps;
mod method;
mod points;
mod query;

pub use method::{Answered, DepthMaps, Method, Rays};
pub(crate) use {
    atlas::Atlas,
    maps::{Drawn, MapsPipelines},
    points::median_edge,
    query::{Asked, Query, QueryPipelines, encode, quantities},
};

use crate::buffers::{empty, storage};
use crate::hierarchy::{Hierarchy, RefitPipelines, start_offset};
use crate::readback::read;
use crate::{DeviceFault, GpuError, morton};
use glam::Vec3;
use heliodon_math::visibility::{BLOCK, BLOCK_WORDS, PointLight, VisibilityBackend, VisibilityMatrix};
use points::Points;
use rayon::prelude::*;
use wgpu::{Buffer, BufferUsages, CommandEncoderDescriptor, Device, Queue};

/// Directions of a word.
pub(crate) const WORD: u32 = 32;
/// Rays that one submission asks at most, for drivers give up on what takes seconds.
const MOST_RAYS: u64 = 64 << 20;

/// The visibility matrix of a mesh, on the GPU.
pub struct VisibilityGpu {
    device: Device,
    queue: Queue,
    fault: DeviceFault,
    method: Method,
    maps: Option<MapsPipelines>,
    query: QueryPipelines,
    refit: Option<RefitPipelines>,
    mesh: Option<Mesh>,
    columns: Option<Columns>,
    /// The bits of a matrix that no longer holds, for the next.
    spare: Option<Buffer>,
}

struct Mesh {
    points: Points,
    way: Way,
}

/// What answers.
enum Way {
    DepthMaps(Option<Atlas>),
    Rays {
        hierarchy: Hierarchy,
        /// Points, neighbours together.
        order: Vec<u32>,
        /// Whether the boxes are where the vertices are.
        fitted: bool,
    },
}

/// The matrix.
struct Columns {
    directions: Vec<Vec3>,
    query: Query,
    /// Which points have a row.
    known: Vec<bool>,
}

impl VisibilityGpu {
    /// On a given device: what is computed can be read by what else is drawn there. `fault` listens to it, or is told by whoever does.
    #[must_use]
    pub fn new(device: &Device, queue: &Queue, fault: &DeviceFault, method: impl Into<Method>) -> Self {
        let (query, fault) = (QueryPipelines::new(device), fault.clone());
        let (device, queue, method) = (device.clone(), queue.clone(), method.into());
        Self { device, queue, fault, method, maps: None, query, refit: None, mesh: None, columns: None, spare: None }
    }

    /// How the mesh that was set is asked; none without one.
    #[must_use]
    pub fn answered(&self) -> Option<Answered> {
        self.mesh.as_ref().map(|mesh| match mesh.way {
            Way::DepthMaps(_) => Answered::DepthMaps,
            Way::Rays { .. } => Answered::Rays,
        })
    }

    /// How far off the surface rays start, in metres; none without a mesh, or where depth maps are asked.
    #[must_use]
    pub fn offset_m(&self) -> Option<f32> {
        let mesh = self.mesh.as_ref().filter(|mesh| matches!(mesh.way, Way::Rays { .. }))?;
        let given = self.method.rays().offset_m;
        Some(given.unwrap_or_else(|| start_offset(&mesh.points.places, &mesh.points.all_triangles)))
    }

    /// [`VisibilityBackend::light`], left on the GPU: for each point the light's red, green, blue and ambient occlusion, `f32`; and
    /// [`PointLight::open`], here also of points without a row, whose light is 0.
    ///
    /// # Errors
    /// No matrix, or not one weight and one radiance for each direction.
    pub fn light_buffers(&self, weights: &[f32], radiance: &[Vec3]) -> Result<(Buffer, Buffer), GpuError> {
        let (mesh, columns) = (self.mesh.as_ref().ok_or(NO_MESH)?, self.columns.as_ref().ok_or(NO_MATRIX)?);
        let count = columns.directions.len();
        if weights.len() != count || radiance.len() != count {
            return Err(GpuError::Input("the light needs one weight and one radiance for each direction of the matrix"));
        }
        let quantities = storage(&self.device, "light_quantities", bytemuck::cast_slice(&quantities(weights, radiance)));
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::VERTEX;
        let made = |label, bytes| empty(&self.device, label, bytes * u64::from(mesh.points.count), usage);
        let (light, open) = (made("point_light", 16), made("point_open", 4));
        let mut encoder = self.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("visibility_gather") });
        let asked = mesh.points.asked();
        self.query.encode_gather(&self.device, &mut encoder, &asked, &columns.query, &quantities, [&light, &open]);
        self.queue.submit([encoder.finish()]);
        Ok((light, open))
    }

    /// Asks the points that are marked.
    fn ask(&mut self, wanted: Option<&[bool]>, directions: &[Vec3]) -> Result<(), GpuError> {
        let Self { device, queue, mesh, columns, spare, .. } = self;
        let Mesh { points, way } = mesh.as_mut().ok_or(NO_MESH)?;
        let kept = columns.take().filter(|columns| wanted.is_some() && columns.directions == directions);
        let asked = points.asked();
        let mut columns = match kept {
            Some(columns) => columns,
            None => {
                let query = Query::new(device, points.count, directions, spare.take())?;
                Columns { directions: directions.to_vec(), query, known: vec![false; points.count as usize] }
            }
        };
        let query = &columns.query;
        let missing = |i: usize| wanted.is_none_or(|wanted| wanted[i]) && !columns.known[i];
        let fresh = columns.known.iter().all(|known| !known);
        match way {
            // The depth of a direction costs what it costs however few vertices are held against it: all are.
            Way::DepthMaps(atlas) => {
                if fresh && points.count > 0 {
                    let Points { radius, edge, index_count, .. } = *points;
                    let size_px = self.method.maps().size_px;
                    let atlas = atlas.get_or_insert_with(|| Atlas::new(device, radius, edge, index_count / 3, size_px));
                    let (indices, extent) = (&points.indices, &points.extent);
                    let drawn = Drawn { atlas, indices, index_count, extent, bias: self.method.maps().bias };
                    let maps = self.maps.get_or_insert_with(|| MapsPipelines::new(device));
                    for first in (0..query.count).step_by(atlas.batch as usize) {
                        let mut encoder =
                            device.create_command_encoder(&CommandEncoderDescriptor { label: Some("visibility") });
                        maps.encode(device, &mut encoder, &asked, &drawn, query, first);
                        queue.submit([encoder.finish()]);
                    }
                }
                columns.known.fill(true);
            }
            Way::Rays { hierarchy, order, fitted } => {
                let list: Vec<u32> = order.iter().copied().filter(|&i| missing(i as usize)).collect();
                let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor { label: Some("visibility") });
                if !*fitted {
                    hierarchy.encode(&mut encoder);
                    *fitted = true;
                }
                if fresh && list.len() < order.len() {
                    encoder.clear_buffer(&query.bits, 0, None);
                }
                let count = list.len() as u32;
                let at_once = (MOST_RAYS / (u64::from(count.max(1)) * u64::from(WORD)))
                    .clamp(1, u64::from(crate::buffers::MOST_WORKGROUPS));
                let buffer = storage(device, "visibility_order", bytemuck::cast_slice(&list));
                for first in (0..query.words()).step_by(at_once as usize).filter(|_| count > 0) {
                    let words = first..(first + at_once as u32).min(query.words());
                    self.query.encode_rays(device, &mut encoder, &asked, (&buffer, count), hierarchy, (query, words));
                    let next = CommandEncoderDescriptor { label: Some("visibility") };
                    queue.submit([std::mem::replace(&mut encoder, device.create_command_encoder(&next)).finish()]);
                }
                queue.submit([encoder.finish()]);
                list.iter().for_each(|&i| columns.known[i as usize] = true);
            }
        }
        self.columns = Some(columns);
        self.fault.check()
    }

    /// The matrix no longer holds; its buffer may serve the next.
    fn forget(&mut self) {
        self.spare = self.columns.take().map(|columns| columns.query.bits).or(self.spare.take());
    }
}

impl VisibilityBackend for VisibilityGpu {
    type Error = GpuError;

    fn set_mesh(&mut self, positions: &[Vec3], normals: &[Vec3], triangles: &[[u32; 3]]) -> Result<(), GpuError> {
        (self.columns, self.mesh) = (None, None);
        self.method.check()?;
        let device = &self.device;
        let points = Points::new(device, positions, normals, triangles)?;
        let way = match self.method.answers(device, positions.len(), triangles.len()) {
            Answered::DepthMaps => Way::DepthMaps(None),
            Answered::Rays => {
                let refit = self.refit.get_or_insert_with(|| RefitPipelines::new(device));
                let offset_m = self.method.rays().offset_m;
                let hierarchy = Hierarchy::new(device, refit, &points.positions, positions, triangles, offset_m)?;
                Way::Rays { hierarchy, order: morton::order(positions, normals), fitted: false }
            }
        };
        self.mesh = Some(Mesh { points, way });
        Ok(())
    }

    fn move_vertices(&mut self, positions: &[Vec3], normals: &[Vec3]) -> Result<(), GpuError> {
        let mesh = self.mesh.as_mut().ok_or(NO_MESH)?;
        mesh.points.write(&self.queue, positions, normals)?;
        if let Way::Rays { fitted, .. } = &mut mesh.way {
            *fitted = false;
        }
        self.forget();
        Ok(())
    }

    fn compute_for(&mut self, wanted: &[bool], directions: &[Vec3]) -> Result<(), GpuError> {
        if wanted.len() != self.mesh.as_ref().ok_or(NO_MESH)?.points.count as usize {
            return Err(GpuError::Input("which points are wanted must be said of each"));
        }
        if self.columns.as_ref().is_some_and(|columns| columns.directions != directions) {
            self.forget();
        }
        self.ask(Some(wanted), directions)
    }

    fn compute(&mut self, directions: &[Vec3]) -> Result<(), GpuError> {
        self.forget();
        self.ask(None, directions)
    }

    fn wait(&mut self) -> Result<(), GpuError> {
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| GpuError::Device(error.to_string()))?;
        self.fault.check()
    }

    fn light(&mut self, weights: &[f32], radiance: &[Vec3]) -> Result<PointLight, GpuError> {
        let (light, open) = self.light_buffers(weights, radiance)?;
        self.fault.check()?;
        let sums: Vec<[f32; 4]> = read(&self.device, &self.queue, &light)?;
        let mut open: Vec<f32> = read(&self.device, &self.queue, &open)?;
        let known = self.columns.as_ref().map_or(&[][..], |columns| &columns.known);
        open.truncate(known.len());
        open.iter_mut().zip(known).filter(|(_, known)| !**known).for_each(|(open, _)| *open = 0.0);
        let sums = &sums[..known.len()];
        Ok(PointLight {
            light: sums.iter().map(|s| Vec3::new(s[0], s[1], s[2])).collect(),
            ambient_occlusion: sums.iter().map(|s| s[3]).collect(),
            open,
        })
    }

    fn matrix(&mut self) -> Result<VisibilityMatrix, GpuError> {
        let (mesh, columns) = (self.mesh.as_ref().ok_or(NO_MESH)?, self.columns.as_ref().ok_or(NO_MATRIX)?);
        let count = mesh.points.count as usize;
        let words: Vec<u32> = read(&self.device, &self.queue, &columns.query.bits)?;
        let order: Vec<u32> = (0..count as u32).filter(|&i| columns.known[i as usize]).collect();
        let mut matrix = VisibilityMatrix::new(order.clone(), &mesh.points.unit_normals, &columns.directions);
        let directions = columns.directions.len();
        matrix.blocks_mut().zip(order.par_chunks(BLOCK)).for_each(|(bits, rows)| {
            for (direction, column) in bits.chunks_exact_mut(BLOCK_WORDS).enumerate().take(directions) {
                let of_word = &words[direction / WORD as usize * count..][..count];
                for (i, &point) in rows.iter().enumerate() {
                    column[i / 64] |= u64::from(of_word[point as usize] >> (direction as u32 % WORD) & 1) << (i % 64);
                }
            }
        });
        Ok(matrix)
    }

    fn most_directions(&self, points: usize) -> usize {
        let limits = self.device.limits();
        let words = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / (4 * points.max(1) as u64);
        // Quantities of so many directions must fit as well.
        (words * u64::from(WORD)).clamp(1, 1 << 20) as usize
    }
}

const NO_MESH: GpuError = GpuError::Input("there is no mesh yet");
const NO_MATRIX: GpuError = GpuError::Input("the matrix is not computed yet");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::buffers::testing::assert_valid;
    use crate::hierarchy::{Extent, REFIT, RefitUniform};

    #[test]
    fn shaders_are_valid() {
        let (maps, extent) = (("Maps", size_of::<maps::MapsUniform>()), ("Extent", size_of::<Extent>()));
        assert_valid("visibility_depth", maps::DEPTH, &[maps, extent]);
        assert_valid("visibility_test", maps::TEST, &[maps, extent]);
        assert_valid("visibility_gather", query::GATHER, &[("Sums", size_of::<query::SumsUniform>())]);
        assert_valid("visibility_rays", query::RAYS, &[("Rays", size_of::<query::RaysUniform>()), extent, ("Node", 32)]);
        assert_valid("hierarchy_refit", REFIT, &[("Refit", size_of::<RefitUniform>()), extent, ("Node", 32), ("Box", 32)]);
    }
}
