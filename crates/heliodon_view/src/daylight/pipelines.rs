//! The pipelines that draw stone and sky, one for each kind of target.

use super::depth_map;
pub use super::key::{Finish, KINDS, Near, PipelineKey, STONES, SUBJECTS, StoneKind, Subject};
use super::layout::{BLOCK, VertexLayout};
use super::multiview::{BothEyesPipelines, layer_wgsl};
use super::sight::NUMBER_FORMAT;
use super::texels::{TEXEL_MOMENT_BYTES, TEXEL_RELIGHT_WGSL, TEXELS_WGSL};
use super::view::VIEW_BYTES;
use crate::actors::render::shade_layout;
use crate::covering::uniform::COVERS_BYTES;
use crate::daylight::moment::MOMENT_BYTES;
use crate::detail::DETAIL_BYTES;
use crate::tonemap::{DisplayKey, ToneCurve};
use bevy::asset::uuid::Uuid;
use bevy::core_pipeline::core_3d::CORE_3D_DEPTH_FORMAT;
use bevy::mesh::VertexBufferLayout;
use bevy::prelude::*;
use bevy::render::render_resource::binding_types::{
    sampler, storage_buffer_read_only_sized, storage_buffer_sized, texture_2d, texture_2d_array, texture_storage_2d,
    uniform_buffer_sized,
};
use bevy::render::render_resource::*;
use bevy::render::renderer::RenderDevice;
use bevy::shader::Shader;
use std::collections::HashMap;
use std::num::NonZeroU64;

/// WGSL of what draws depth alone.
pub const CASTER_WGSL: &str = include_str!("caster.wgsl");

/// WGSL of `View` and its binding.
pub const VIEW_WGSL: &str = include_str!("view.wgsl");

/// The whole text of the shader that numbers triangles.
#[must_use]
pub fn sight_wgsl() -> String {
    format!("enable primitive_index;\n{}\n{}", resolved(VIEW_WGSL, &[("ONE_VIEW", true)]), include_str!("sight.wgsl"))
}

/// The whole text of the shader that lights stone pixel by pixel.
#[must_use]
pub(crate) fn relight_wgsl(display: DisplayKey) -> String {
    format!("{}const BLOCK: u32 = {BLOCK}u;\n{}", display.wgsl(), include_str!("relight.wgsl"))
}

/// A shader with the lines that its `#ifdef`s keep, those of whose names all are defined, so that what a test validates is what runs.
pub(crate) fn resolved(source: &str, defined: &[(&str, bool)]) -> String {
    let is_defined = |name: &str| defined.iter().any(|&(known, yes)| known == name && yes);
    let mut keep = true;
    let mut out = String::with_capacity(source.len());
    for line in source.lines() {
        match line.trim().strip_prefix("#ifdef ") {
            Some(names) => keep = names.split(' ').all(is_defined),
            None if line.trim() == "#endif" => keep = true,
            None if keep => {
                out.push_str(line);
                out.push('\n');
            }
            None => {}
        }
    }
    out
}

/// Bind group layouts, and the pipelines that were asked for so far.
#[derive(Resource)]
pub struct StagePipelines {
    /// The moment's uniform.
    pub moment_layout: BindGroupLayoutDescriptor,
    /// A page's light buffers.
    pub light_layout: BindGroupLayoutDescriptor,
    /// The camera's uniform, and what is worn.
    pub view_layout: BindGroupLayoutDescriptor,
    /// A base colour texture.
    pub texture_layout: BindGroupLayoutDescriptor,
    /// A base colour texture, and an atlas of light in texels.
    pub texels_layout: BindGroupLayoutDescriptor,
    /// The same, and what a panorama has besides light.
    pub panorama_layout: BindGroupLayoutDescriptor,
    /// A detail.
    pub detail_layout: BindGroupLayoutDescriptor,
    /// What texels of the sky or of the bounced sun are lit from, and they.
    pub texel_relight_layout: BindGroupLayoutDescriptor,
    /// The dome's two maps.
    pub sky_layout: BindGroupLayoutDescriptor,
    /// The matrix of a map of depth.
    pub caster_layout: BindGroupLayoutDescriptor,
    /// What is baked of a page, and where its normals go.
    pub normals_layout: BindGroupLayoutDescriptor,
    /// What pixels are lit from, where stone is lit pixel by pixel.
    pub relight_layout: BindGroupLayoutDescriptor,
    /// What draws both eyes at once.
    pub both_eyes: BothEyesPipelines,
    layer_made: HashMap<(TextureFormat, u32), CachedRenderPipelineId>,
    made: HashMap<PipelineKey, CachedRenderPipelineId>,
    relight_made: HashMap<DisplayKey, CachedRenderPipelineId>,
    /// Bevy's cache frees none: bundles of one layout share theirs.
    light_made: Vec<(VertexLayout, CachedComputePipelineId)>,
    sight_made: Option<[CachedRenderPipelineId; 2]>,
    caster_made: Option<CachedRenderPipelineId>,
    normals_made: Vec<(VertexLayout, CachedComputePipelineId)>,
    texel_relight_made: Option<[CachedComputePipelineId; 2]>,
    shaders: u128,
}

impl Default for StagePipelines {
    fn default() -> Self {
        let uniform = |bytes: usize| uniform_buffer_sized(false, NonZeroU64::new(bytes as u64));
        let image = || texture_2d(TextureSampleType::Float { filterable: true });
        let images = || texture_2d_array(TextureSampleType::Float { filterable: true });
        let of_texels = || {
            DynamicBindGroupLayoutEntries::sequential(
                ShaderStages::FRAGMENT,
                (
                    image(),
                    sampler(SamplerBindingType::Filtering),
                    uniform(TEXEL_MOMENT_BYTES),
                    texture_2d_array(TextureSampleType::Uint),
                    image(),
                    image(),
                    sampler(SamplerBindingType::Filtering),
                    image(),
                ),
            )
        };
        Self {
            moment_layout: BindGroupLayoutDescriptor::new(
                "stone_moment",
                &BindGroupLayoutEntries::single(ShaderStages::COMPUTE, uniform(MOMENT_BYTES)),
            ),
            light_layout: BindGroupLayoutDescriptor::new(
                "stone_light",
                &BindGroupLayoutEntries::sequential(
                    ShaderStages::COMPUTE,
                    (
                        storage_buffer_read_only_sized(false, None),
                        texture_2d(TextureSampleType::Uint),
                        storage_buffer_sized(false, None),
                    ),
                ),
            ),
            view_layout: BindGroupLayoutDescriptor::new(
                "stone_view",
                &BindGroupLayoutEntries::sequential(
                    ShaderStages::VERTEX_FRAGMENT,
                    (uniform(VIEW_BYTES), uniform(COVERS_BYTES)),
                ),
            ),
            texture_layout: BindGroupLayoutDescriptor::new(
                "stone_texture",
                &BindGroupLayoutEntries::sequential(ShaderStages::FRAGMENT, (image(), sampler(SamplerBindingType::Filtering))),
            ),
            texels_layout: BindGroupLayoutDescriptor::new("stone_texels", &of_texels()),
            panorama_layout: BindGroupLayoutDescriptor::new(
                "stone_panorama",
                &of_texels().extend_sequential((image(), image())),
            ),
            detail_layout: BindGroupLayoutDescriptor::new(
                "stone_detail",
                &BindGroupLayoutEntries::sequential(
                    ShaderStages::FRAGMENT,
                    (uniform(DETAIL_BYTES), image(), sampler(SamplerBindingType::Filtering), images(), images()),
                ),
            ),
            texel_relight_layout: BindGroupLayoutDescriptor::new(
                "texel_relight",
                &BindGroupLayoutEntries::sequential(
                    ShaderStages::COMPUTE,
                    (
                        uniform(TEXEL_MOMENT_BYTES),
                        texture_2d_array(TextureSampleType::Float { filterable: false }),
                        texture_storage_2d(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly),
                    ),
                ),
            ),
            sky_layout: BindGroupLayoutDescriptor::new(
                "sky_maps",
                &BindGroupLayoutEntries::sequential(
                    ShaderStages::FRAGMENT,
                    (image(), image(), sampler(SamplerBindingType::Filtering)),
                ),
            ),
            caster_layout: BindGroupLayoutDescriptor::new(
                "caster",
                &BindGroupLayoutEntries::single(ShaderStages::VERTEX, uniform(size_of::<Mat4>())),
            ),
            normals_layout: BindGroupLayoutDescriptor::new(
                "stone_normals",
                &BindGroupLayoutEntries::sequential(
                    ShaderStages::COMPUTE,
                    (texture_2d(TextureSampleType::Uint), storage_buffer_sized(false, None)),
                ),
            ),
            relight_layout: BindGroupLayoutDescriptor::new(
                "relight",
                &BindGroupLayoutEntries::sequential(
                    ShaderStages::FRAGMENT,
                    (
                        texture_2d(TextureSampleType::Uint),
                        texture_2d(TextureSampleType::Float { filterable: false }),
                        texture_2d(TextureSampleType::Float { filterable: false }),
                    ),
                ),
            ),
            both_eyes: BothEyesPipelines::default(),
            layer_made: HashMap::new(),
            made: HashMap::new(),
            relight_made: HashMap::new(),
            light_made: Vec::new(),
            sight_made: None,
            caster_made: None,
            normals_made: Vec::new(),
            texel_relight_made: None,
            shaders: 0,
        }
    }
}

impl StagePipelines {
    /// Gives `source` to the cache under a name of its own.
    pub fn shader(&mut self, cache: &mut PipelineCache, source: String, name: &str) -> Handle<Shader> {
        // Ours alone: the upper half is a random number.
        let uuid = Uuid::from_u128(0x5f1d_9c1e_7a42_4b0b_0000_0000_0000_0000 + self.shaders);
        self.shaders += 1;
        cache.set_shader(AssetId::Uuid { uuid }, Shader::from_wgsl(source, format!("heliodon/{name}.wgsl")));
        Handle::Uuid(uuid, std::marker::PhantomData)
    }

    /// The light pipeline for a bundle's layout.
    pub fn light(&mut self, cache: &mut PipelineCache, layout: VertexLayout) -> CachedComputePipelineId {
        if let Some((_, id)) = self.light_made.iter().find(|(made, _)| *made == layout) {
            return *id;
        }
        let shader = self.shader(cache, layout.light_wgsl(), "light");
        let id = cache.queue_compute_pipeline(ComputePipelineDescriptor {
            label: Some("stone_light".into()),
            layout: vec![self.moment_layout.clone(), self.light_layout.clone()],
            shader,
            entry_point: Some("main".into()),
            ..default()
        });
        self.light_made.push((layout, id));
        id
    }

    /// The pipelines that light texels: of the sky, and of the bounced sun.
    pub fn texel_relight(&mut self, cache: &mut PipelineCache) -> [CachedComputePipelineId; 2] {
        if let Some(ids) = self.texel_relight_made {
            return ids;
        }
        let shader = self.shader(cache, format!("{TEXELS_WGSL}{TEXEL_RELIGHT_WGSL}"), "texel_relight");
        let ids = ["sky", "bounce"].map(|entry| {
            cache.queue_compute_pipeline(ComputePipelineDescriptor {
                label: Some("texel_relight".into()),
                layout: vec![self.texel_relight_layout.clone()],
                shader: shader.clone(),
                entry_point: Some(entry.into()),
                ..default()
            })
        });
        self.texel_relight_made = Some(ids);
        ids
    }

    /// The pipelines that number the triangles of surfaces and of closed bodies.
    pub fn sight(&mut self, cache: &mut PipelineCache) -> [CachedRenderPipelineId; 2] {
        if let Some(ids) = self.sight_made {
            return ids;
        }
        let shader = self.shader(cache, sight_wgsl(), "sight");
        let ids = [false, true].map(|closed| {
            let target = ColorTargetState { format: NUMBER_FORMAT, blend: None, write_mask: ColorWrites::ALL };
            cache.queue_render_pipeline(RenderPipelineDescriptor {
                label: Some("stone_sight".into()),
                layout: vec![self.view_layout.clone()],
                vertex: VertexState {
                    shader: shader.clone(),
                    entry_point: Some("vertex".into()),
                    buffers: vec![vertex_buffer(0, VertexFormat::Float32x3)],
                    ..default()
                },
                primitive: sides(closed),
                depth_stencil: Some(depth_test(true)),
                fragment: Some(FragmentState {
                    shader: shader.clone(),
                    entry_point: Some("fragment".into()),
                    targets: vec![Some(target)],
                    ..default()
                }),
                ..default()
            })
        });
        self.sight_made = Some(ids);
        ids
    }

    /// The pipeline that draws depth alone, from positions.
    pub fn caster(&mut self, cache: &mut PipelineCache) -> CachedRenderPipelineId {
        if let Some(id) = self.caster_made {
            return id;
        }
        let shader = self.shader(cache, CASTER_WGSL.to_owned(), "caster");
        let id = cache.queue_render_pipeline(RenderPipelineDescriptor {
            label: Some("caster".into()),
            layout: vec![self.caster_layout.clone()],
            vertex: VertexState {
                shader,
                entry_point: Some("vertex".into()),
                buffers: vec![vertex_buffer(0, VertexFormat::Float32x3)],
                ..default()
            },
            depth_stencil: Some(DepthStencilState {
                format: depth_map::FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(CompareFunction::LessEqual),
                stencil: default(),
                bias: default(),
            }),
            ..default()
        });
        self.caster_made = Some(id);
        id
    }

    /// The pipeline that takes normals out of what is baked.
    pub fn normals(&mut self, cache: &mut PipelineCache, layout: VertexLayout) -> CachedComputePipelineId {
        if let Some((_, id)) = self.normals_made.iter().find(|(made, _)| *made == layout) {
            return *id;
        }
        let shader = self.shader(cache, layout.normals_wgsl(), "normals");
        let id = cache.queue_compute_pipeline(ComputePipelineDescriptor {
            label: Some("stone_normals".into()),
            layout: vec![self.normals_layout.clone()],
            shader,
            entry_point: Some("main".into()),
            ..default()
        });
        self.normals_made.push((layout, id));
        id
    }

    /// The pipeline that lights stone pixel by pixel.
    pub fn relight(&mut self, cache: &mut PipelineCache, curve: ToneCurve, format: TextureFormat) -> CachedRenderPipelineId {
        let key = DisplayKey { curve, format };
        if let Some(&id) = self.relight_made.get(&key) {
            return id;
        }
        let shader = self.shader(cache, relight_wgsl(key), "relight");
        let layout = vec![self.view_layout.clone(), self.relight_layout.clone()];
        let id = cache.queue_render_pipeline(whole_picture("relight", layout, shader, format, 1));
        self.relight_made.insert(key, id);
        id
    }

    /// Lets the colour pipeline for a target be made, if it is not.
    pub fn want(&mut self, cache: &mut PipelineCache, device: &RenderDevice, key: PipelineKey) {
        if key.both_eyes {
            if !self.both_eyes.has(key) {
                let descriptor = self.colour(key, self.both_eyes.views_layout.clone(), Handle::default());
                self.both_eyes.make(cache, device, key, descriptor);
            }
        } else if !self.made.contains_key(&key) {
            let shader = self.shader(cache, key.wgsl(), "colour");
            let id = cache.queue_render_pipeline(self.colour(key, self.view_layout.clone(), shader));
            self.made.insert(key, id);
        }
    }

    /// A colour pipeline that was [wanted](Self::want), once it is there.
    #[must_use]
    pub fn get<'a>(&'a self, cache: &'a PipelineCache, key: PipelineKey) -> Option<&'a RenderPipeline> {
        match key.both_eyes {
            true => self.both_eyes.get(key),
            false => self.made.get(&key).and_then(|&id| cache.get_render_pipeline(id)),
        }
    }

    /// The pipeline that hands an eye its layer.
    pub fn layer(&mut self, cache: &mut PipelineCache, format: TextureFormat, samples: u32) -> CachedRenderPipelineId {
        if let Some(&id) = self.layer_made.get(&(format, samples)) {
            return id;
        }
        let shader = self.shader(cache, layer_wgsl(samples > 1), "layer");
        let layout = vec![self.both_eyes.layer_layout(samples).clone()];
        let id = cache.queue_render_pipeline(whole_picture("eye_layer", layout, shader, format, samples));
        self.layer_made.insert((format, samples), id);
        id
    }

    /// The colour pipeline for a target.
    fn colour(&self, key: PipelineKey, view: BindGroupLayoutDescriptor, shader: Handle<Shader>) -> RenderPipelineDescriptor {
        let stone = key.subject != Subject::Sky;
        let mut layout = vec![view];
        if key.near != Near::Nothing {
            layout.push(shade_layout());
        }
        match key.subject {
            Subject::Stone { kind: StoneKind::Plain, .. } => {}
            Subject::Stone { kind: StoneKind::Textured, .. } => layout.push(self.texture_layout.clone()),
            Subject::Stone { kind: StoneKind::Texels, .. } => layout.push(self.texels_layout.clone()),
            Subject::Stone { kind: StoneKind::Panorama, .. } => layout.push(self.panorama_layout.clone()),
            Subject::Sky => layout.push(self.sky_layout.clone()),
        }
        if key.detailed {
            layout.push(self.detail_layout.clone());
        }
        RenderPipelineDescriptor {
            label: Some(if stone { "stone" } else { "sky" }.into()),
            layout,
            vertex: VertexState {
                shader: shader.clone(),
                entry_point: Some("vertex".into()),
                buffers: if stone { vertex_buffers(key) } else { Vec::new() },
                ..default()
            },
            primitive: match key.finish {
                Finish::Outlined => PrimitiveState { cull_mode: Some(Face::Front), ..default() },
                _ => sides(matches!(key.subject, Subject::Stone { closed: true, .. })),
            },
            depth_stencil: Some(depth_test(stone)),
            multisample: MultisampleState { count: key.samples, ..default() },
            fragment: Some(FragmentState {
                shader,
                entry_point: Some("fragment".into()),
                targets: vec![Some(ColorTargetState { format: key.display.format, blend: None, write_mask: ColorWrites::ALL })],
                ..default()
            }),
            ..default()
        }
    }
}

/// What fills a picture, colour and depth, by one triangle.
fn whole_picture(
    label: &'static str,
    layout: Vec<BindGroupLayoutDescriptor>,
    shader: Handle<Shader>,
    format: TextureFormat,
    samples: u32,
) -> RenderPipelineDescriptor {
    RenderPipelineDescriptor {
        label: Some(label.into()),
        layout,
        vertex: VertexState { shader: shader.clone(), entry_point: Some("vertex".into()), ..default() },
        depth_stencil: Some(depth_test(true)),
        multisample: MultisampleState { count: samples, ..default() },
        fragment: Some(FragmentState {
            shader,
            entry_point: Some("fragment".into()),
            targets: vec![Some(ColorTargetState { format, blend: None, write_mask: ColorWrites::ALL })],
            ..default()
        }),
        ..default()
    }
}

/// Which sides of a triangle are drawn.
fn sides(closed: bool) -> PrimitiveState {
    PrimitiveState { cull_mode: closed.then_some(Face::Back), ..default() }
}

/// Nothing is drawn behind what is there, and stone hides what comes after it.
fn depth_test(stone: bool) -> DepthStencilState {
    DepthStencilState {
        format: CORE_3D_DEPTH_FORMAT,
        depth_write_enabled: Some(stone),
        // Depth is reversed: near is 1.
        depth_compare: Some(CompareFunction::GreaterEqual),
        stencil: default(),
        bias: default(),
    }
}

fn vertex_buffer(location: u32, format: VertexFormat) -> VertexBufferLayout {
    VertexBufferLayout {
        array_stride: format.size(),
        step_mode: VertexStepMode::Vertex,
        attributes: vec![VertexAttribute { format, offset: 0, shader_location: location }],
    }
}

/// Position, light, albedo, the normal where there are lamps, texels or a detail, and texture coordinates, each from a buffer of its own.
fn vertex_buffers(key: PipelineKey) -> Vec<VertexBufferLayout> {
    let mut formats = vec![(0, VertexFormat::Float32x3), (1, VertexFormat::Float16x4), (2, VertexFormat::Unorm10_10_10_2)];
    if key.has_normals() {
        formats.push((4, VertexFormat::Snorm16x2));
    }
    if key.subject.textured() {
        formats.push((3, VertexFormat::Float32x2));
    }
    if key.subject.by_texels() {
        formats.push((5, VertexFormat::Float32x2));
    }
    formats.into_iter().map(|(location, format)| vertex_buffer(location, format)).collect()
}
