//! A mesh that moves, posed and lit on the GPU that draws it: nothing comes back.
//!
//! M. Sattler, R. Sarlette, G. Zachmann, R. Klein: "Hardware-accelerated ambient occlusion computation", VMV 2004, with what its section 8.1 hopes for, the light
//! summed where it is shown, and the posing there as well. A frame goes up as a [`Palette`] and a radiance from each direction, some kilobytes; compute passes make
//! positions and normals of it, fit the triangles' hierarchy, ask which directions and whether the sun reach each vertex, sum the light, and leave what is drawn in two
//! vertex buffers. All of it is recorded into the caller's own encoder: nothing here submits, waits or maps a buffer for reading.
//!
//! All corners are asked in every frame. Which ones an eye sees (the paper's section 4.1) would have to be known before, on the processor, whose positions this does
//! without.

mod upload;

use crate::buffers::{compute, empty, filled, fits, shader, storage, uniform, workgroups};
use crate::hierarchy::{Hierarchy, RefitPipelines};
use crate::visibility::{Answered, Asked, Atlas, Drawn, MapsPipelines, Method, Query, QueryPipelines, encode, quantities};
use crate::{GpuError, morton};
use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Mat4, Vec3};
use heliodon_mesh::motion::{MovingMesh, Palette, PoseRules};
use std::f32::consts::FRAC_1_PI;
use std::sync::Arc;
use upload::Upload;
use wgpu::{Buffer, BufferSlice, BufferUsages, CommandEncoder, ComputePipeline, Device};

/// The shaders, whole.
const POSE: &str = concat!(include_str!("rule.wgsl"), include_str!("pose.wgsl"));
const CACHED: &str = include_str!("cached.wgsl");
const NORMALS: &str = concat!(include_str!("rule.wgsl"), include_str!("normals.wgsl"));
const LIGHT: &str = include_str!("light.wgsl");

/// `Pose` of pose.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct PoseUniform {
    corners: u32,
    weights: u32,
    row: u32,
    farthest: f32,
}

/// `Cached` of cached.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct CachedUniform {
    corners: u32,
    row: u32,
    padding: [u32; 2],
}

/// `Normals` of normals.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct NormalsUniform {
    corners: u32,
    weights: u32,
    row: u32,
    spread: u32,
}

/// `Light` of light.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct LightUniform {
    world_from_mesh: [f32; 16],
    sun: [f32; 3],
    follow: f32,
    irradiance: [f32; 3],
    corners: u32,
    origin: [f32; 3],
    spacing: f32,
    size: [u32; 3],
    row: u32,
}

/// A vertex of what is drawn: one of the moving mesh, seen from one side. A mesh with several materials may have several of one vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Corner {
    /// Of the moving mesh.
    pub vertex: u32,
    /// Lit as the back is, its normal turned round.
    pub back: bool,
}

impl Corner {
    /// Each vertex of a mesh once, from the front.
    #[must_use]
    pub fn of_all(vertices: usize) -> Vec<Self> {
        (0..vertices as u32).map(|vertex| Self { vertex, back: false }).collect()
    }
}

/// How much of the sun reaches the points of a lattice in the world, x fastest, then y, then z; between them it goes straight, beyond them it stays.
#[derive(Clone, Copy, Debug)]
pub struct SunLattice<'a> {
    /// The first point, in metres.
    pub origin: Vec3,
    /// Between points, in metres, above 0.
    pub spacing_m: f32,
    /// Points along each axis, 1 at the least.
    pub size: [u32; 3],
    /// 0 to 1 for each.
    pub reached: &'a [f32],
}

/// The sun of a frame.
#[derive(Clone, Copy, Debug)]
pub struct MovingSun<'a> {
    /// Unit direction to it in the mesh's own space.
    pub direction: Vec3,
    /// At normal incidence, exposed as the light is to be.
    pub irradiance: Vec3,
    /// How much of it the surroundings let through; all without.
    pub lattice: Option<SunLattice<'a>>,
}

/// What a frame is made of.
#[derive(Clone, Copy, Debug)]
pub struct MovingFrame<'a> {
    /// The pose; none for the one before, which is then not asked anew unless the directions are others.
    pub palette: Option<&'a Palette>,
    /// Where the mesh stands. Its rotation must be in `directions` as well: they are of the mesh's own space.
    pub world_from_mesh: Affine3A,
    /// Unit directions to the light in the mesh's own space, and their solid angles.
    pub directions: &'a [Vec3],
    /// The solid angle of each direction, in steradians.
    pub weights: &'a [f32],
    /// Radiance from each direction, exposed as the light is to be.
    pub radiance: &'a [Vec3],
    /// The sun, if there is any.
    pub sun: Option<MovingSun<'a>>,
    /// How much of the way from the sky's light of the frame before to that of this one the shown light goes, 0 to 1: [`follow`]. The first frame goes all of it, and the
    /// sun's light always does.
    pub follow: f32,
}

/// The part of the way that shown light goes in `dt_s` seconds, if it follows within `follow_s`; all of it where nothing came before.
#[must_use]
pub fn follow(dt_s: Option<f32>, follow_s: f32) -> f32 {
    // libm, so that the same frames have the same light everywhere
    dt_s.map_or(1.0, |dt_s| (1.0 - libm::expf(-dt_s / follow_s)).clamp(0.0, 1.0))
}

/// What all moving meshes of a device share.
pub struct MovingPipelines {
    pose: ComputePipeline,
    cached: ComputePipeline,
    normals: ComputePipeline,
    light: ComputePipeline,
    refit: RefitPipelines,
    query: QueryPipelines,
    maps: MapsPipelines,
}

impl MovingPipelines {
    /// Whether a device can do it: compute shaders that bind eight storage buffers, as all of WebGPU's own limits allow. Where not, [`MovingMesh::pose`] and a
    /// processor's rays answer the same questions.
    #[must_use]
    pub fn supports(device: &Device) -> bool {
        let limits = device.limits();
        limits.max_storage_buffers_per_shader_stage >= 8 && limits.max_compute_invocations_per_workgroup >= 64
    }

    /// On a device that it [`Self::supports`].
    #[must_use]
    pub fn new(device: &Device) -> Self {
        let of = |label, wgsl| compute(device, &shader(device, label, wgsl), "main");
        Self {
            pose: of("moving_pose", POSE),
            cached: of("moving_cached", CACHED),
            normals: of("moving_normals", NORMALS),
            light: of("moving_light", LIGHT),
            refit: RefitPipelines::new(device),
            query: QueryPipelines::new(device),
            maps: MapsPipelines::new(device),
        }
    }
}

/// A mesh that moves, on the GPU.
pub struct MovingGpu {
    device: Device,
    pipelines: Arc<MovingPipelines>,
    method: Method,
    upload: Upload,
    /// In the mesh's own space.
    positions: Buffer,
    normals: Buffer,
    hierarchy: Hierarchy,
    atlas: Option<Atlas>,
    /// All corners, neighbours together.
    order: Buffer,
    gathered: Buffer,
    open: Buffer,
    sky: Buffer,
    world: Buffer,
    shown: Buffer,
    asked: Option<(Vec<Vec3>, Query)>,
    sun_asked: Option<(Vec3, Query)>,
    posed: bool,
    lit: bool,
}

impl MovingGpu {
    /// Takes a mesh to the device. All of its triangles occlude; what is drawn is `corners`, of which each vertex of a triangle needs one that is seen from the front.
    ///
    /// # Errors
    /// Corners that are not the mesh's, a negative offset, a device that [`MovingPipelines::supports`] not, or more than its buffers hold.
    pub fn new(
        device: &Device,
        pipelines: &Arc<MovingPipelines>,
        moving: &MovingMesh,
        corners: &[Corner],
        method: impl Into<Method>,
    ) -> Result<Self, GpuError> {
        let method = method.into();
        method.check()?;
        if !MovingPipelines::supports(device) {
            return Err(GpuError::Input("this GPU binds fewer than eight storage buffers; light the mesh by the processor"));
        }
        let upload = Upload::new(device, moving, corners)?;
        let count = u64::from(upload.corners);
        let usage = BufferUsages::STORAGE | BufferUsages::VERTEX | BufferUsages::COPY_SRC;
        let made = |label, bytes| empty(device, label, bytes * count, usage);
        let (positions, normals) = (made("moving_positions", 16), made("moving_normals", 16));
        let (refit, offset_m) = (&pipelines.refit, method.rays().offset_m);
        let hierarchy = Hierarchy::new(device, refit, &positions, &upload.places, &upload.triangle_list, offset_m)?;
        let atlas = match method.answers(device, corners.len(), upload.triangle_list.len()) {
            Answered::Rays => None,
            Answered::DepthMaps => {
                let (radius, edge, size_px) = (upload.radius, upload.edge, method.maps().size_px);
                Some(Atlas::new(device, radius, edge, upload.triangle_count, size_px))
            }
        };
        let order = morton::order(&upload.places, &upload.normals);
        Ok(Self {
            device: device.clone(),
            pipelines: Arc::clone(pipelines),
            method,
            positions,
            normals,
            hierarchy,
            atlas,
            order: storage(device, "moving_order", bytemuck::cast_slice(&order)),
            gathered: made("moving_gathered", 16),
            open: made("moving_open", 4),
            sky: made("moving_sky", 16),
            world: made("moving_world", 16),
            shown: made("moving_light", 8),
            upload,
            asked: None,
            sun_asked: None,
            posed: false,
            lit: false,
        })
    }

    /// Where the corners are in the world, in metres: three `f32` each, a vertex buffer of stride 12.
    #[must_use]
    pub fn world_positions(&self) -> BufferSlice<'_> {
        self.world.slice(..(12 * u64::from(self.upload.corners)).max(12))
    }

    /// The corners' unit normals in the world, on the octahedron: 2 x snorm16 each, a vertex buffer of stride 4.
    #[must_use]
    pub fn world_normals(&self) -> BufferSlice<'_> {
        self.world.slice(12 * u64::from(self.upload.corners)..)
    }

    /// Irradiance / pi of the corners, exposed, and the part of the sun's at normal incidence in it that comes straight from the sun: four `f16` each, a vertex buffer
    /// of stride 8.
    #[must_use]
    pub fn light(&self) -> &Buffer {
        &self.shown
    }

    /// Positions and unit normals in the mesh's own space, a `vec4<f32>` each; the fourth numbers are for the shaders here.
    #[must_use]
    pub fn posed(&self) -> [&Buffer; 2] {
        [&self.positions, &self.normals]
    }

    /// Corners that are drawn.
    #[must_use]
    pub fn corner_count(&self) -> u32 {
        self.upload.corners
    }

    /// How it is asked.
    #[must_use]
    pub fn answered(&self) -> Answered {
        if self.atlas.is_some() { Answered::DepthMaps } else { Answered::Rays }
    }

    /// Records a frame: what [`Self::world_positions`] and [`Self::light`] hold when the encoder's commands are done. It must be submitted before the next is, for the next builds
    /// on it.
    ///
    /// # Errors
    /// A frame that does not go together, or whose matrix is more than the device's buffers hold; nothing is recorded then.
    pub fn record(&mut self, encoder: &mut CommandEncoder, frame: &MovingFrame<'_>) -> Result<(), GpuError> {
        self.check(frame)?;
        if self.upload.corners == 0 {
            return Ok(());
        }
        let (count, device) = (self.upload.corners, self.device.clone());
        let query = match self.asked.take_if(|(directions, _)| directions != frame.directions) {
            Some((_, old)) => Some(Query::new(&device, count, frame.directions, Some(old.bits))?),
            None if self.asked.is_none() => Some(Query::new(&device, count, frame.directions, None)?),
            None => None,
        };
        let others = query.is_some();
        if let Some(query) = query {
            self.asked = Some((frame.directions.to_vec(), query));
        }
        let toward = frame.sun.as_ref().map_or(Vec3::ZERO, |sun| sun.direction);
        let turned = self.sun_asked.as_ref().is_none_or(|(direction, _)| *direction != toward);
        if turned {
            let spare = self.sun_asked.take().map(|(_, query)| query.bits);
            self.sun_asked = Some((toward, Query::new(&device, count, &[toward], spare)?));
        }
        if let Some(palette) = frame.palette {
            self.pose(encoder, palette);
            self.hierarchy.encode(encoder);
            self.posed = true;
        }
        let moved = frame.palette.is_some();
        let asked = self.asked.as_ref().map(|(_, query)| query).filter(|_| moved || others);
        let sunned = self.sun_asked.as_ref().map(|(_, query)| query).filter(|_| (moved || turned) && frame.sun.is_some());
        for query in asked.into_iter().chain(sunned) {
            self.ask(encoder, query);
        }
        self.light_up(encoder, frame);
        self.lit = true;
        Ok(())
    }

    fn check(&self, frame: &MovingFrame<'_>) -> Result<(), GpuError> {
        if frame.weights.len() != frame.directions.len() || frame.radiance.len() != frame.directions.len() {
            return Err(GpuError::Input("the light needs one weight and one radiance for each direction"));
        }
        fits(
            &self.device,
            "the bits of the visibility matrix",
            Query::bytes(self.upload.corners, frame.directions.len()),
            "ask for fewer directions",
        )?;
        fits(&self.device, "the directions", 16 * frame.directions.len() as u64, "ask for fewer")?;
        let Upload { matrices, weights, parts, vertices, cached, .. } = self.upload;
        let fitting = |palette: &Palette| {
            palette.matrices.len() == matrices
                && palette.weights.len() == weights
                && palette.moves.len() == parts
                && (!cached || palette.positions.len() == vertices)
        };
        match frame.palette {
            None if !self.posed => return Err(GpuError::Input("the first frame of a mesh needs its pose")),
            Some(palette) if !fitting(palette) => return Err(GpuError::Input("the palette is not of this mesh")),
            _ => {}
        }
        let whole = |lattice: &SunLattice<'_>| {
            let points: u64 = lattice.size.iter().map(|&n| u64::from(n)).product();
            points > 0 && points == lattice.reached.len() as u64 && lattice.spacing_m > 0.0
        };
        if !frame.sun.iter().filter_map(|sun| sun.lattice.as_ref()).all(whole) {
            return Err(GpuError::Input("the sun's lattice has not a number for each of its points"));
        }
        Ok(())
    }

    /// Records positions and normals of a pose.
    fn pose(&self, encoder: &mut CommandEncoder, palette: &Palette) {
        let (device, upload) = (&self.device, &self.upload);
        let [x, y] = workgroups(upload.corners);
        let moves = palette.moves.iter().map(|&moves| f32::from(moves));
        let levers: Vec<f32> = palette.weights.iter().copied().chain(moves).collect();
        let levers = storage(device, "moving_levers", bytemuck::cast_slice(&levers));
        if upload.cached {
            let constants = CachedUniform { corners: upload.corners, row: x, padding: [0; 2] };
            let constants = uniform(device, bytemuck::bytes_of(&constants));
            let places = storage(device, "moving_places", bytemuck::cast_slice(&palette.positions));
            let bound = [&constants, &upload.sources, &places, &self.positions];
            encode(device, encoder, &self.pipelines.cached, &bound, [x, y, 1]);
        } else {
            let (corners, weights) = (upload.corners, upload.weights as u32);
            let constants = PoseUniform { corners, weights, row: x, farthest: PoseRules::FARTHEST_M };
            let constants = uniform(device, bytemuck::bytes_of(&constants));
            let matrices = storage(device, "moving_palette", bytemuck::cast_slice(&palette.matrices));
            let Upload { sources, rules, influences, deltas, .. } = upload;
            let bound = [&constants, sources, rules, influences, deltas, &matrices, &levers, &self.positions, &self.normals];
            encode(device, encoder, &self.pipelines.pose, &bound, [x, y, 1]);
        }
        let maps = self.atlas.is_some();
        if upload.renews || maps {
            let (corners, weights) = (upload.corners, upload.weights as u32);
            let constants = NormalsUniform { corners, weights, row: x, spread: u32::from(maps) };
            let constants = uniform(device, bytemuck::bytes_of(&constants));
            let Upload { sources, rules, around, triangles, .. } = upload;
            let bound = [&constants, sources, rules, &levers, around, triangles, &self.positions, &self.normals];
            encode(device, encoder, &self.pipelines.normals, &bound, [x, y, 1]);
        }
    }

    fn corners(&self) -> Asked<'_> {
        Asked { points: self.upload.corners, positions: &self.positions, normals: &self.normals }
    }

    /// Records which of a query's directions reach the corners.
    fn ask(&self, encoder: &mut CommandEncoder, query: &Query) {
        let (device, asked) = (&self.device, self.corners());
        let Some(atlas) = &self.atlas else {
            let (order, all) = (&self.order, (query, 0..query.words()));
            self.pipelines.query.encode_rays(device, encoder, &asked, (order, asked.points), &self.hierarchy, all);
            return;
        };
        let (indices, extent) = (&self.upload.triangles, &self.hierarchy.extent);
        let index_count = 3 * self.upload.triangle_count;
        let drawn = Drawn { atlas, indices, index_count, extent, bias: self.method.maps().bias };
        for first in (0..query.count).step_by(atlas.batch as usize) {
            self.pipelines.maps.encode(device, encoder, &asked, &drawn, query, first);
        }
    }

    /// Records the light.
    fn light_up(&self, encoder: &mut CommandEncoder, frame: &MovingFrame<'_>) {
        let (Some((_, query)), Some((toward, sunned))) = (&self.asked, &self.sun_asked) else { return };
        let (device, asked) = (&self.device, self.corners());
        let amounts = storage(device, "light_quantities", bytemuck::cast_slice(&quantities(frame.weights, frame.radiance)));
        let sums = [&self.gathered, &self.open];
        self.pipelines.query.encode_gather(device, encoder, &asked, query, &amounts, sums);
        let everywhere = SunLattice { origin: Vec3::ZERO, spacing_m: 1.0, size: [1; 3], reached: &[1.0] };
        let lattice = frame.sun.and_then(|sun| sun.lattice).unwrap_or(everywhere);
        let [x, y] = workgroups(self.upload.corners);
        let constants = LightUniform {
            world_from_mesh: Mat4::from(frame.world_from_mesh).to_cols_array(),
            sun: toward.to_array(),
            follow: if self.lit { frame.follow } else { 1.0 },
            irradiance: frame.sun.map_or(Vec3::ZERO, |sun| sun.irradiance * FRAC_1_PI).to_array(),
            corners: self.upload.corners,
            origin: lattice.origin.to_array(),
            spacing: lattice.spacing_m,
            size: lattice.size,
            row: x,
        };
        let constants = uniform(device, bytemuck::bytes_of(&constants));
        let reached = filled(device, "moving_lattice", bytemuck::cast_slice(lattice.reached), BufferUsages::STORAGE);
        let bound = [
            &constants,
            &self.positions,
            &self.normals,
            &self.gathered,
            &sunned.bits,
            &reached,
            &self.sky,
            &self.world,
            &self.shown,
        ];
        encode(device, encoder, &self.pipelines.light, &bound, [x, y, 1]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::buffers::testing::assert_valid;

    #[test]
    fn shaders_are_valid() {
        let rule = ("Rule", size_of::<upload::Rule>());
        let pose = ("Pose", size_of::<PoseUniform>());
        assert_valid("moving_pose", POSE, &[pose, rule, ("Delta", size_of::<upload::Delta>()), ("Influence", 16)]);
        assert_valid("moving_cached", CACHED, &[("Cached", size_of::<CachedUniform>())]);
        assert_valid("moving_normals", NORMALS, &[("Normals", size_of::<NormalsUniform>()), rule]);
        assert_valid("moving_light", LIGHT, &[("Light", size_of::<LightUniform>())]);
    }

    /// The encoder is the caller's: a shown light that was read back here would need one of these.
    #[test]
    fn nothing_is_submitted_or_read_back() {
        let sources = [include_str!("mod.rs"), include_str!("upload.rs"), include_str!("../hierarchy/mod.rs")];
        let code = sources.map(|source| source.split("#[cfg(test)]").next().unwrap_or_default());
        for verb in ["submit(", ".poll(", "map_async", "MAP_READ", "readback", "Queue"] {
            assert!(code.iter().all(|code| !code.contains(verb)), "{verb}");
        }
    }
}
