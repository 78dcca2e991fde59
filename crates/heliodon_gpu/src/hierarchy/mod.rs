//! A hierarchy of bounding volumes in buffers: its shape is made once on the processor, its boxes are fitted on the GPU wherever the vertices go.

mod build;

use crate::GpuError;
use crate::buffers::{entries, storage, uniform, workgroups};
use build::{LEAF, Topology};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use wgpu::{
    BindGroup, BindGroupDescriptor, Buffer, BufferDescriptor, BufferUsages, CommandEncoder, ComputePassDescriptor,
    ComputePipeline, Device,
};

/// What fits boxes.
pub(crate) const REFIT: &str = concat!(include_str!("extent.wgsl"), include_str!("node.wgsl"), include_str!("refit.wgsl"));

/// Boxes of one size that make one of the next: FOLD of refit.wgsl.
const FOLD: u32 = 16;
/// Sizes of boxes at most.
const LEVELS: usize = 8;
/// Bytes of a place: three corners.
const PLACE_BYTES: u64 = 48;
/// A leaf's places are stored times this, and how many.
const LEAF_SCALE: u32 = 8;
const _: () = assert!((LEAF as u32) < LEAF_SCALE);

/// `Refit` of refit.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct RefitUniform {
    anchor: [f32; 3],
    offset: f32,
    triangles: u32,
    nodes: u32,
    levels: u32,
    level: u32,
    count: u32,
    row: u32,
    below: u32,
    padding: u32,
    first: [u32; LEVELS],
}

/// `Extent` of extent.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub(crate) struct Extent {
    /// The bounding sphere.
    pub center: [f32; 3],
    pub radius: f32,
    /// Subtracted from everything that rays are asked of.
    pub anchor: [f32; 3],
    /// How far off the surface rays start.
    pub offset: f32,
    /// By which boxes are wider than what they hold.
    pub margin: f32,
    pub padding: [f32; 3],
}

/// `Node` of node.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Node {
    low: [f32; 3],
    next: u32,
    high: [f32; 3],
    leaf: u32,
}

pub(crate) struct RefitPipelines {
    place: ComputePipeline,
    join: ComputePipeline,
    survey: ComputePipeline,
    fit: ComputePipeline,
}

impl RefitPipelines {
    pub fn new(device: &Device) -> Self {
        let module = crate::buffers::shader(device, "hierarchy_refit", REFIT);
        let of = |entry| crate::buffers::compute(device, &module, entry);
        Self { place: of("place"), join: of("join"), survey: of("survey"), fit: of("fit") }
    }
}

/// Triangles and boxes over them.
pub(crate) struct Hierarchy {
    /// `array<Node>`.
    pub nodes: Buffer,
    pub node_count: u32,
    /// Three `vec4` a place, relative to the anchor.
    pub corners: Buffer,
    /// [`Extent`]; a uniform for those who read it.
    pub extent: Buffer,
    steps: Vec<(ComputePipeline, BindGroup, [u32; 2])>,
}

impl Hierarchy {
    /// Bytes of the largest buffer that so many triangles take.
    pub fn bytes(triangles: usize) -> u64 {
        // Nodes: 32 bytes each, and at most twice as many as triangles. Corners take less.
        64 * triangles as u64
    }

    /// Over `triangles` as they lie when `rest` is given; `positions` has a `vec4` for each vertex, its fourth 0 for one that is nowhere. `offset_m` is where rays
    /// start; none for what the size asks for. Boxes are there after the first [`Self::encode`].
    ///
    /// # Errors
    /// More triangles than a binding holds.
    pub fn new(
        device: &Device,
        pipelines: &RefitPipelines,
        positions: &Buffer,
        rest: &[Vec3],
        triangles: &[[u32; 3]],
        offset_m: Option<f32>,
    ) -> Result<Self, GpuError> {
        let limits = device.limits();
        let most_bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let needed_bytes = Self::bytes(triangles.len());
        if needed_bytes > most_bytes || triangles.len() > (u32::MAX / LEAF_SCALE) as usize {
            let remedy = "split the mesh, ask by depth maps, or compute on the processor";
            return Err(GpuError::TooLarge { what: "the triangles' hierarchy", needed_bytes, most_bytes, remedy });
        }
        let anchor = middle(rest, triangles);
        let corner = |i: u32| if usable(rest[i as usize]) { rest[i as usize] - anchor } else { Vec3::ZERO };
        let corners: Vec<[Vec3; 3]> = triangles.iter().map(|t| t.map(corner)).collect();
        let Topology { order, branches } = Topology::new(&corners);
        let vertices: Vec<u32> = order.iter().flat_map(|&t| triangles[t as usize]).collect();
        let ranges: Vec<[u32; 2]> = branches.iter().map(|b| [b.first, b.first + b.count]).collect();
        let node = |(i, b): (u32, &build::Branch)| Node {
            low: [0.0; 3],
            next: i + b.size,
            high: [0.0; 3],
            leaf: if b.size == 1 { b.first * LEAF_SCALE + b.count } else { 0 },
        };
        let nodes: Vec<Node> = (0..).zip(&branches).map(node).collect();
        let count = triangles.len() as u32;
        let mut sizes = vec![count];
        while let Some(&last) = sizes.last().filter(|&&last| last > FOLD) {
            sizes.push(last.div_ceil(FOLD));
        }
        let mut first = [0; LEVELS];
        for level in 2..sizes.len() {
            first[level] = first[level - 1] + sizes[level - 1];
        }
        let boxes: u32 = sizes[1..].iter().sum();
        let empty = |label, bytes: u64, usage| {
            device.create_buffer(&BufferDescriptor { label: Some(label), size: bytes, usage, mapped_at_creation: false })
        };
        let this = Self {
            nodes: storage(device, "hierarchy_nodes", bytemuck::cast_slice(&nodes)),
            node_count: nodes.len() as u32,
            corners: empty("hierarchy_corners", PLACE_BYTES * u64::from(count.max(1)), BufferUsages::STORAGE),
            extent: empty("hierarchy_extent", size_of::<Extent>() as u64, BufferUsages::STORAGE | BufferUsages::UNIFORM),
            steps: Vec::new(),
        };
        let boxes = empty("hierarchy_boxes", 32 * u64::from(boxes.max(1)), BufferUsages::STORAGE);
        let vertices = storage(device, "hierarchy_vertices", bytemuck::cast_slice(&vertices));
        let ranges = storage(device, "hierarchy_ranges", bytemuck::cast_slice(&ranges));
        let whole = RefitUniform {
            anchor: anchor.to_array(),
            offset: offset_m.unwrap_or(-1.0),
            triangles: count,
            nodes: this.node_count,
            levels: sizes.len() as u32,
            level: 0,
            count,
            row: 0,
            below: 0,
            padding: 0,
            first,
        };
        let all = [positions, &vertices, &this.corners, &boxes, &ranges, &this.nodes, &this.extent];
        let step = |pipeline: &ComputePipeline, of: RefitUniform, bound: &[u32]| {
            let [x, y] = workgroups(of.count);
            let constants = uniform(device, bytemuck::bytes_of(&RefitUniform { row: x, ..of }));
            let mut entries = entries(&[&constants]);
            entries.extend(
                bound
                    .iter()
                    .map(|&binding| wgpu::BindGroupEntry { binding, resource: all[binding as usize - 1].as_entire_binding() }),
            );
            let layout = pipeline.get_bind_group_layout(0);
            let descriptor = BindGroupDescriptor { label: Some("hierarchy_refit"), layout: &layout, entries: &entries };
            (pipeline.clone(), device.create_bind_group(&descriptor), [x, y])
        };
        let mut steps = vec![step(&pipelines.place, whole, &[1, 2, 3])];
        for (level, pair) in (1..).zip(sizes.windows(2)) {
            steps.push(step(&pipelines.join, RefitUniform { level, count: pair[1], below: pair[0], ..whole }, &[3, 4]));
        }
        let (_, group, _) = step(&pipelines.survey, RefitUniform { count: sizes[sizes.len() - 1], ..whole }, &[3, 4, 7]);
        steps.push((pipelines.survey.clone(), group, [1, 1]));
        steps.push(step(&pipelines.fit, RefitUniform { count: this.node_count, ..whole }, &[3, 4, 5, 6, 7]));
        Ok(Self { steps, ..this })
    }

    /// Fits the boxes to where the vertices are by then.
    pub fn encode(&self, encoder: &mut CommandEncoder) {
        let descriptor = ComputePassDescriptor { label: Some("hierarchy_refit"), timestamp_writes: None };
        let mut pass = encoder.begin_compute_pass(&descriptor);
        for (pipeline, group, [x, y]) in &self.steps {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(*x, *y, 1);
        }
    }
}

/// Whether a place can be asked, and hold a corner: finite, and near enough that products of three coordinates are.
pub(crate) fn usable(p: Vec3) -> bool {
    p.abs().cmple(Vec3::splat(1e12)).all()
}

/// The middle of the triangles' box.
fn middle(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec3 {
    let corners = triangles.as_flattened().iter().map(|&i| positions[i as usize]).filter(|&p| usable(p));
    let (low, high) = corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    if low.x <= high.x { 0.5 * low + 0.5 * high } else { Vec3::ZERO }
}

/// How far off the surface rays start where nobody says: what `survey` of refit.wgsl finds. A ten-thousandth of the diagonal is enough for the facets of a smooth
/// surface and too little to lose a contact that its triangles could show; 32 roundings of 2^-24 of the greatest coordinate are what the arithmetic asks for (a
/// vertex and its normal, the way to the anchor and to the ray's origin, and the shear round 9 times an axis; depth is interpolated between those).
pub(crate) fn start_offset(positions: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
    let corners = triangles.as_flattened().iter().map(|&i| positions[i as usize]).filter(|&p| usable(p));
    let (low, high) = corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    if !low.cmple(high).all() {
        return 0.0;
    }
    let reach = low.abs().max(high.abs()).max((high - low) * 0.5).max_element();
    (1e-4 * low.distance(high)).max(16.0 * f32::EPSILON * reach)
}
