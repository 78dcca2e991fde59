//! The visibility matrix by depth maps.
//!
//! M. Sattler, R. Sarlette, G. Zachmann, R. Klein: "Hardware-accelerated ambient occlusion computation", VMV 2004. The paper draws the
//! depth of the mesh from each direction, then each vertex as a point with an occlusion query of its own, and fetches every answer. Here
//! many directions share one pass (a tile of an atlas each), a compute shader compares all vertices with it, and a bit an entry stays on
//! the GPU, where the light is summed as well (the paper's section 8.1).
//!
//! Against rays, a depth map errs where a shadow's edge passes within a texel of a vertex, and it must let things lie a little below the
//! map: [`DepthMaps::bias`]. Contact shadows narrower than that are lost.

mod atlas;
mod buffers;
mod pipelines;

use crate::readback::read;
use crate::{DeviceFault, GpuError};
use atlas::Atlas;
use buffers::{Points, entries, padded, storage};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use heliodon_math::visibility::{BLOCK, BLOCK_WORDS, PointLight, VisibilityBackend, VisibilityMatrix};
use pipelines::Pipelines;
use rayon::prelude::*;
use wgpu::{
    BindGroup, BindGroupDescriptor, Buffer, BufferUsages, CommandEncoder, CommandEncoderDescriptor, ComputePassDescriptor,
    Device, IndexFormat, LoadOp, Operations, Queue, RenderPassDepthStencilAttachment, RenderPassDescriptor, StoreOp,
};

/// Points of a workgroup.
const WORKGROUP: u32 = 64;
/// Workgroups that a dispatch may have along one axis, by wgpu's default limits.
const MOST_WORKGROUPS: u32 = 65_535;
/// Directions of a word.
const WORD: u32 = 32;

/// How fine the depth maps are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthMaps {
    /// Pixels of each direction's map. More: sharper shadows, and time with the square. `None` for as many as the mesh's edges warrant,
    /// from 128 to 2048.
    pub size_px: Option<u32>,
    /// How much nearer to the light than a point the map must be to occlude it: a factor, 1 by default, on what the slope and the mesh's
    /// roughness around the point ask for (a quarter of a texel where it is flat; `test.wgsl`). Less: contact shadows closer to the
    /// contact, and acne, where a surface shadows itself.
    pub bias: f32,
}

impl Default for DepthMaps {
    fn default() -> Self {
        Self { size_px: None, bias: 1.0 }
    }
}

/// What the shaders know of a batch; `Maps` of light_space.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct MapsUniform {
    center: [f32; 3],
    inverse_radius: f32,
    tile_px: f32,
    atlas_px: f32,
    across: u32,
    first: u32,
    count: u32,
    points: u32,
    bias: f32,
    row: u32,
}

/// `Sums` of gather.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct SumsUniform {
    points: u32,
    count: u32,
    row: u32,
    padding: u32,
}

/// The visibility matrix of a mesh, on the GPU.
pub struct VisibilityGpu {
    device: Device,
    queue: Queue,
    fault: DeviceFault,
    pipelines: Pipelines,
    maps: DepthMaps,
    points: Option<Points>,
    atlas: Option<Atlas>,
    columns: Option<Columns>,
    /// The bits of a matrix that no longer holds, for the next.
    spare: Option<Buffer>,
}

/// The matrix.
struct Columns {
    directions: Vec<Vec3>,
    direction_buffer: Buffer,
    bits: Buffer,
}

impl VisibilityGpu {
    /// On a given device: what is computed can be read by what else is drawn there. `fault` listens to it, or is told by whoever does.
    #[must_use]
    pub fn new(device: &Device, queue: &Queue, fault: &DeviceFault, maps: DepthMaps) -> Self {
        let (pipelines, fault) = (Pipelines::new(device), fault.clone());
        let (device, queue) = (device.clone(), queue.clone());
        Self { device, queue, fault, pipelines, maps, points: None, atlas: None, columns: None, spare: None }
    }

    /// [`VisibilityBackend::light`], left on the GPU: for each point the light's red, green, blue and ambient occlusion, `f32`; and
    /// [`PointLight::open`].
    ///
    /// # Errors
    /// No matrix, or not one weight and one radiance for each direction.
    pub fn light_buffers(&self, weights: &[f32], radiance: &[Vec3]) -> Result<(Buffer, Buffer), GpuError> {
        let (points, columns) = (self.points.as_ref().ok_or(NO_MESH)?, self.columns.as_ref().ok_or(NO_MATRIX)?);
        let count = columns.directions.len();
        if weights.len() != count || radiance.len() != count {
            return Err(GpuError::Input("the light needs one weight and one radiance for each direction of the matrix"));
        }
        let share = |(&w, &l): (&f32, &Vec3)| (l * (w * std::f32::consts::FRAC_1_PI)).extend(w).to_array();
        let quantities: Vec<[f32; 4]> = weights.iter().zip(radiance).map(share).collect();
        let quantities = storage(&self.device, "light_quantities", bytemuck::cast_slice(&quantities));
        let [light, open] = [("point_light", 16), ("point_open", 4)].map(|(label, bytes)| {
            self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: (bytes * u64::from(points.count)).max(bytes),
                usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::VERTEX,
                mapped_at_creation: false,
            })
        });
        let [x, y] = workgroups(points.count);
        let uniform = SumsUniform { points: points.count, count: count as u32, row: x, padding: 0 };
        let uniform = buffers::uniform(&self.device, bytemuck::bytes_of(&uniform));
        let buffers = [&uniform, &columns.direction_buffer, &points.normals, &columns.bits, &quantities, &light, &open];
        let group = self.device.create_bind_group(&BindGroupDescriptor {
            label: Some("visibility_gather"),
            layout: &self.pipelines.gather.get_bind_group_layout(0),
            entries: &entries(&buffers),
        });
        let mut encoder = self.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("visibility_gather") });
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        pass.set_pipeline(&self.pipelines.gather);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(x, y, 1);
        drop(pass);
        self.queue.submit([encoder.finish()]);
        Ok((light, open))
    }
}

impl VisibilityBackend for VisibilityGpu {
    type Error = GpuError;

    fn set_mesh(&mut self, positions: &[Vec3], normals: &[Vec3], triangles: &[[u32; 3]]) -> Result<(), GpuError> {
        (self.columns, self.atlas) = (None, None);
        self.points = Some(Points::new(&self.device, positions, normals, triangles)?);
        Ok(())
    }

    fn move_vertices(&mut self, positions: &[Vec3], normals: &[Vec3]) -> Result<(), GpuError> {
        let points = self.points.as_mut().ok_or(NO_MESH)?;
        points.write(&self.queue, positions, normals)?;
        self.spare = self.columns.take().map(|columns| columns.bits).or(self.spare.take());
        Ok(())
    }

    // The depth of a direction costs what it costs however few vertices are held against it: all are.
    fn compute_for(&mut self, wanted: &[bool], directions: &[Vec3]) -> Result<(), GpuError> {
        let points = self.points.as_ref().ok_or(NO_MESH)?;
        if wanted.len() != points.count as usize {
            return Err(GpuError::Input("which points are wanted must be said of each"));
        }
        if self.columns.as_ref().is_some_and(|columns| columns.directions == directions) {
            return Ok(());
        }
        self.compute(directions)
    }

    fn compute(&mut self, directions: &[Vec3]) -> Result<(), GpuError> {
        let points = self.points.as_ref().ok_or(NO_MESH)?;
        let words = directions.len().div_ceil(WORD as usize) as u64;
        let needed_bytes = 4 * words * u64::from(points.count);
        let limits = self.device.limits();
        let most_bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if needed_bytes > most_bytes {
            let remedy = "ask for fewer directions, or for a part of the vertices at a time";
            return Err(GpuError::TooLarge { what: "the bits of the visibility matrix", needed_bytes, most_bytes, remedy });
        }
        let atlas = self.atlas.get_or_insert_with(|| Atlas::new(&self.device, &limits, points, self.maps.size_px));
        let direction_buffer = storage(&self.device, "light_directions", bytemuck::cast_slice(&padded(directions)));
        let spare = self.columns.take().map(|columns| columns.bits).or(self.spare.take());
        let bits = match spare {
            Some(bits) if bits.size() == needed_bytes.max(4) => bits,
            _ => self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("visibility_bits"),
                size: needed_bytes.max(4),
                usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
        };
        if points.count > 0 {
            let uniform = MapsUniform {
                center: points.center.to_array(),
                inverse_radius: 1.0 / points.radius,
                tile_px: atlas.tile_px as f32,
                atlas_px: atlas.size_px as f32,
                across: atlas.across,
                first: 0,
                count: 0,
                points: points.count,
                bias: self.maps.bias,
                row: workgroups(points.count)[0],
            };
            for first in (0..directions.len() as u32).step_by(atlas.batch as usize) {
                let uniform = MapsUniform { first, count: atlas.batch.min(directions.len() as u32 - first), ..uniform };
                let mut encoder = self.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("visibility") });
                encode_batch(&mut encoder, &self.device, &self.pipelines, points, atlas, &direction_buffer, &bits, &uniform);
                self.queue.submit([encoder.finish()]);
            }
        }
        self.columns = Some(Columns { directions: directions.to_vec(), direction_buffer, bits });
        self.fault.check()
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
        let count = self.points.as_ref().map_or(0, |points| points.count as usize);
        open.truncate(count);
        let sums = &sums[..count];
        Ok(PointLight {
            light: sums.iter().map(|s| Vec3::new(s[0], s[1], s[2])).collect(),
            ambient_occlusion: sums.iter().map(|s| s[3]).collect(),
            open,
        })
    }

    fn matrix(&mut self) -> Result<VisibilityMatrix, GpuError> {
        let (points, columns) = (self.points.as_ref().ok_or(NO_MESH)?, self.columns.as_ref().ok_or(NO_MATRIX)?);
        let count = points.count as usize;
        let words: Vec<u32> = read(&self.device, &self.queue, &columns.bits)?;
        let mut matrix = VisibilityMatrix::new((0..points.count).collect(), &points.unit_normals, &columns.directions);
        let directions = columns.directions.len();
        matrix.blocks_mut().enumerate().for_each(|(block, bits)| {
            let rows = block * BLOCK..((block + 1) * BLOCK).min(count);
            for (direction, column) in bits.chunks_exact_mut(BLOCK_WORDS).enumerate().take(directions) {
                let of_word = &words[direction / WORD as usize * count..][rows.clone()];
                for (i, word) in of_word.iter().enumerate() {
                    column[i / 64] |= u64::from(word >> (direction as u32 % WORD) & 1) << (i % 64);
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

/// Workgroups for so many points, along two axes.
fn workgroups(points: u32) -> [u32; 2] {
    let groups = points.div_ceil(WORKGROUP).max(1);
    let row = groups.min(MOST_WORKGROUPS);
    [row, groups.div_ceil(row)]
}

/// The depth of a batch of directions, and what it says of the points.
#[expect(clippy::too_many_arguments, reason = "what a pass binds")]
fn encode_batch(
    encoder: &mut CommandEncoder,
    device: &Device,
    pipelines: &Pipelines,
    points: &Points,
    atlas: &Atlas,
    directions: &Buffer,
    bits: &Buffer,
    uniform: &MapsUniform,
) {
    let uniform_buffer = buffers::uniform(device, bytemuck::bytes_of(uniform));
    let group = |layout, entries: &[wgpu::BindGroupEntry<'_>]| -> BindGroup {
        device.create_bind_group(&BindGroupDescriptor { label: Some("visibility"), layout: &layout, entries })
    };
    let depth_ops = Operations { load: LoadOp::Clear(1.0), store: StoreOp::Store };
    let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
        label: Some("visibility_depth"),
        depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
            view: &atlas.view,
            depth_ops: Some(depth_ops),
            stencil_ops: None,
        }),
        ..RenderPassDescriptor::default()
    });
    pass.set_pipeline(&pipelines.depth);
    pass.set_bind_group(0, &group(pipelines.depth.get_bind_group_layout(0), &entries(&[&uniform_buffer, directions])), &[]);
    pass.set_vertex_buffer(0, points.positions.slice(..));
    pass.set_index_buffer(points.indices.slice(..), IndexFormat::Uint32);
    pass.draw_indexed(0..points.index_count, 0, 0..uniform.count);
    drop(pass);

    let mut bound = entries(&[&uniform_buffer, directions, &points.positions, &points.normals]);
    bound.push(wgpu::BindGroupEntry { binding: 4, resource: wgpu::BindingResource::TextureView(&atlas.view) });
    bound.push(wgpu::BindGroupEntry { binding: 5, resource: bits.as_entire_binding() });
    let mut pass =
        encoder.begin_compute_pass(&ComputePassDescriptor { label: Some("visibility_test"), timestamp_writes: None });
    pass.set_pipeline(&pipelines.test);
    pass.set_bind_group(0, &group(pipelines.test.get_bind_group_layout(0), &bound), &[]);
    let [x, y] = workgroups(points.count);
    pass.dispatch_workgroups(x, y, uniform.count.div_ceil(WORD));
}

#[cfg(test)]
mod tests {
    use super::*;
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    /// Every shader is valid without a GPU, and its constants have the size that they have here.
    #[test]
    fn shaders_are_valid() {
        let sizes =
            [("Maps", size_of::<MapsUniform>()), ("Maps", size_of::<MapsUniform>()), ("Sums", size_of::<SumsUniform>())];
        for ((label, source), (name, size)) in pipelines::SHADERS.into_iter().zip(sizes) {
            let module =
                naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{label}: {}", e.emit_to_string(source)));
            Validator::new(ValidationFlags::all(), Capabilities::empty())
                .validate(&module)
                .unwrap_or_else(|error| panic!("{label}: {}", error.emit_to_string(source)));
            let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name)).map(|(_, ty)| &ty.inner);
            let Some(naga::TypeInner::Struct { span, .. }) = found else { panic!("{label} has no {name}") };
            assert_eq!((*span as usize).next_multiple_of(16), size, "{label}");
        }
    }

    #[test]
    fn dispatches_stay_within_the_limits() {
        for (points, expected) in
            [(0, [1, 1]), (64, [1, 1]), (65, [2, 1]), (64 * 65_535, [65_535, 1]), (64 * 65_535 + 1, [65_535, 2])]
        {
            assert_eq!(workgroups(points), expected);
        }
    }
}
