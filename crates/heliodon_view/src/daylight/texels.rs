//! Daylight in texels on the GPU: an atlas of sun masks that fragments read, and the sky's light and the bounced sun's, which are lit once for each moment.
//!
//! Of the masks a fragment takes the moment's bits of nine texels. Sky and bounce have dozens of numbers, but fewer texels than there are pixels in a frame or two: lit in a pass of
//! their own they are filtered as two colours, and cost nothing while the clock stands still.

use super::layout::VertexLayout;
use super::moment::layer_weights;
use super::pipelines::StagePipelines;
use bevy::log::warn;
use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderDevice, RenderQueue};
use bytemuck::{Pod, Zeroable};
use glam::Vec4;
use heliodon_bundle::moment::Moment;
use heliodon_bundle::panorama::inset;
use heliodon_bundle::{Panorama, PanoramaInfo, TexelLight};
use heliodon_image::ktx2::{Ktx2, TexelFormat};
use std::sync::atomic::{AtomicBool, Ordering};

/// WGSL of the moment that texels are lit at.
pub const TEXELS_WGSL: &str = include_str!("texels.wgsl");
/// WGSL of what fragments read of an atlas.
pub const TEXEL_LIGHT_WGSL: &str = include_str!("texel_light.wgsl");
/// WGSL of what fragments read of a panorama besides.
pub const PANORAMA_WGSL: &str = include_str!("panorama.wgsl");
/// WGSL of what lights the texels of the sky and of the bounced sun.
pub const TEXEL_RELIGHT_WGSL: &str = include_str!("texel_relight.wgsl");

/// Layers of nine coefficients of three channels.
const SKY_LAYERS: usize = 7;
/// Layers of 64 functions of three channels.
const BOUNCE_LAYERS: usize = 48;
/// Texels along a side of a workgroup that lights texels.
const GROUP: u32 = 16;

/// `TexelMoment` of texels.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct TexelMoment {
    sun_direction: Vec4,
    sun_over_pi: Vec4,
    sun: Vec4,
    mask_weights: Vec4,
    mask: [u32; 4],
    layers: [u32; 4],
    sky: [[Vec4; 3]; SKY_LAYERS],
    bounce: [[Vec4; 3]; BOUNCE_LAYERS],
    middle: Vec4,
}

/// Size of `TexelMoment` in texels.wgsl, which a test compares with what the shader's compiler says.
pub const TEXEL_MOMENT_BYTES: usize = 16 * (7 + 3 * (SKY_LAYERS + BOUNCE_LAYERS));
const _: () = assert!(size_of::<TexelMoment>() == TEXEL_MOMENT_BYTES);

impl TexelMoment {
    /// The uniform for `moment` with all light multiplied by `exposure`.
    #[must_use]
    pub fn new(layout: VertexLayout, moment: &Moment, exposure: f32) -> Self {
        let mut uniform = Self::zeroed();
        let (light, channels) = (layout.0, layout.0.channels as usize);
        let sun = moment.shading.sun_irradiance * exposure;
        uniform.sun_direction = moment.sun_direction.extend(0.0);
        uniform.sun_over_pi = (sun * std::f32::consts::FRAC_1_PI).extend(0.0);
        uniform.sun = sun.extend(0.0);
        uniform.mask_weights = Vec4::new(moment.mask_weights[0], moment.mask_weights[1], 0.0, 0.0);
        let [a, b] = moment.mask_bits.map(|bit| bit.min(light.sun_steps - 1));
        uniform.mask = [a / 32, a % 32, b / 32, b % 32];
        let layers = [light.transfer_floats(), light.bounce_floats()].map(|floats| floats.div_ceil(4) as u32);
        uniform.layers = [layers[0], layers[1], 0, 0];
        let sky = moment.shading.sky.iter().take(light.coefficients as usize).map(|&coefficient| coefficient * exposure);
        layer_weights(channels, sky, &mut uniform.sky);
        let functions = moment.bounce.iter().take(light.sun_bounce_functions as usize).map(|&f| glam::Vec3::splat(f));
        layer_weights(channels, functions, &mut uniform.bounce);
        uniform
    }
}

/// Which texture of an atlas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Of {
    /// Sun masks.
    Sun,
    /// Sky transfer.
    Sky,
    /// Sun bounce.
    Bounce,
    /// What the weather has left.
    Weathering,
    /// Normals of a panorama, and how far what is drawn lies.
    Surface,
    /// Albedo of a panorama.
    Albedo,
}

/// A layer of a level of an atlas's texture, on its way to the GPU.
#[derive(Debug)]
pub struct TexelPiece {
    /// Of which texture.
    pub of: Of,
    /// How its texels are stored.
    pub format: TexelFormat,
    /// Sides of the first level, layers and levels of the texture.
    pub shape: [u32; 4],
    /// The level,
    pub level: u32,
    /// and the layer,
    pub layer: u32,
    /// with its bytes.
    pub bytes: Vec<u8>,
}

/// The pieces of an atlas, texture after texture.
pub fn pieces(light: TexelLight, weathering: Option<Ktx2>) -> impl Iterator<Item = TexelPiece> {
    pieces_of(of_light(light).into_iter().chain([(Of::Weathering, weathering)]))
}

/// The pieces of a panorama, texture after texture.
pub fn panorama_pieces(panorama: Panorama) -> impl Iterator<Item = TexelPiece> {
    let Panorama { light, surface, albedo } = panorama;
    pieces_of(of_light(light).into_iter().chain([(Of::Surface, Some(surface)), (Of::Albedo, Some(albedo))]))
}

fn of_light(light: TexelLight) -> [(Of, Option<Ktx2>); 3] {
    [(Of::Sun, Some(light.sun)), (Of::Sky, Some(light.sky)), (Of::Bounce, light.bounce)]
}

fn pieces_of(textures: impl Iterator<Item = (Of, Option<Ktx2>)>) -> impl Iterator<Item = TexelPiece> {
    textures.filter_map(|(of, texture)| Some((of, texture?))).flat_map(|(of, texture)| {
        let Ktx2 { format, width, height, layers, levels } = texture;
        let shape = [width, height, layers, levels.len() as u32];
        (0..).zip(levels).flat_map(move |(level, bytes)| {
            let of_layer = (bytes.len() / layers.max(1) as usize).max(1);
            let layers = (0..).zip(bytes.chunks_exact(of_layer).map(<[u8]>::to_vec).collect::<Vec<_>>());
            layers.map(move |(layer, bytes)| TexelPiece { of, format, shape, level, layer, bytes })
        })
    })
}

/// An atlas on the GPU.
#[derive(Debug, Default)]
pub struct TexelsGpu {
    sun: Option<Texture>,
    sky: Option<Texture>,
    bounce: Option<Texture>,
    weathering: Option<Texture>,
    /// Of a panorama.
    looks: [Option<Texture>; 2],
    middle: Vec4,
    ready: Option<Ready>,
    moment: Option<TexelMoment>,
    /// Whether sky and bounce have not yet the moment's light: told to the GPU's work of the frame, which is asked for once a frame and more.
    stale: AtomicBool,
}

/// What drawing binds.
#[derive(Debug)]
struct Ready {
    uniform: Buffer,
    /// What lights the levels of the sky.
    sky: Vec<Relit>,
    /// What lights the bounced sun; none where no sun bounces.
    bounce: Option<Relit>,
    /// By the base colour image; the last is that of stone without one.
    groups: Vec<BindGroup>,
}

/// Texels that are lit, and how many there are along both sides.
#[derive(Debug)]
struct Relit {
    group: BindGroup,
    size: [u32; 2],
}

impl TexelsGpu {
    /// Takes a piece. Levels that are too large for the device are passed over: what they light is drawn as from further away.
    pub fn write(&mut self, device: &RenderDevice, queue: &RenderQueue, piece: &TexelPiece) {
        let slot = match piece.of {
            Of::Sun => &mut self.sun,
            Of::Sky => &mut self.sky,
            Of::Bounce => &mut self.bounce,
            Of::Weathering => &mut self.weathering,
            Of::Surface => &mut self.looks[0],
            Of::Albedo => &mut self.looks[1],
        };
        let [width, height, layers, levels] = piece.shape;
        let limits = device.limits();
        let skipped = skipped_levels(width.max(height), limits.max_texture_dimension_2d).min(levels - 1);
        if piece.level < skipped {
            if piece.layer == 0 {
                let most = limits.max_texture_dimension_2d;
                warn!(
                    "the atlas of {width} x {height} texels is too large for the device, which has {most}: it is drawn coarser"
                );
            }
            return;
        }
        let texture = slot.get_or_insert_with(|| {
            let format = match piece.format {
                TexelFormat::R32Uint => TextureFormat::R32Uint,
                TexelFormat::Rgba8Srgb => TextureFormat::Rgba8UnormSrgb,
                _ => TextureFormat::Rgba16Float,
            };
            let [width, height] = [width, height].map(|side| (side >> skipped).max(1));
            create(device, "texels", [width, height, layers, levels - skipped], format, TextureUsages::COPY_DST)
        });
        let side = |texels: u32| (texels >> piece.level).max(1);
        let origin = Origin3d { x: 0, y: 0, z: piece.layer };
        let bytes_per_row = Some(side(width) * piece.format.block_bytes());
        queue.write_texture(
            TexelCopyTextureInfo { texture, mip_level: piece.level - skipped, origin, aspect: TextureAspect::All },
            &piece.bytes,
            TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None },
            Extent3d { width: side(width), height: side(height), depth_or_array_layers: 1 },
        );
    }

    /// From where the panorama is seen, and what part of a face is its quarter of the view; to be told before [`Self::finish`].
    pub fn see_from(&mut self, info: &PanoramaInfo) {
        self.middle = glam::Vec3::from(info.middle).extend(inset(info.side));
    }

    /// Makes what drawing binds, once all pieces are there; `images` are the base colour images of the bundle.
    pub fn finish(
        &mut self,
        (device, queue): (&RenderDevice, &RenderQueue),
        (cache, pipelines): (&PipelineCache, &StagePipelines),
        images: &[(TextureView, Sampler)],
    ) {
        let (Some(sun), Some(sky)) = (&self.sun, &self.sky) else { return };
        let uniform = device.create_buffer(&BufferDescriptor {
            label: Some("texel_moment"),
            size: TEXEL_MOMENT_BYTES as u64,
            usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let array = |base_mip_level: u32, mip_level_count: Option<u32>| TextureViewDescriptor {
            dimension: Some(TextureViewDimension::D2Array),
            base_mip_level,
            mip_level_count,
            ..Default::default()
        };
        let lit = |size: [u32; 2], levels: u32| {
            let usages = TextureUsages::STORAGE_BINDING;
            create(device, "texels_lit", [size[0], size[1], 1, levels], TextureFormat::Rgba16Float, usages)
        };
        let layout = cache.get_bind_group_layout(&pipelines.texel_relight_layout);
        let relit = |baked: &Texture, lit: &Texture, level: u32| {
            let own = TextureViewDescriptor { base_mip_level: level, mip_level_count: Some(1), ..Default::default() };
            let (from, to) = (baked.create_view(&array(level, Some(1))), lit.create_view(&own));
            let entries = BindGroupEntries::sequential((uniform.as_entire_buffer_binding(), &from, &to));
            let size = [baked.width(), baked.height()].map(|texels| (texels >> level).max(1));
            Relit { group: device.create_bind_group("texel_relight", &layout, &entries), size }
        };
        let sky_lit = lit([sky.width(), sky.height()], sky.mip_level_count());
        let of_sky = (0..sky.mip_level_count()).map(|level| relit(sky, &sky_lit, level)).collect();
        let bounced = lit(self.bounce.as_ref().map_or([1; 2], |bounce| [bounce.width(), bounce.height()]), 1);
        let of_bounce = self.bounce.as_ref().map(|bounce| relit(bounce, &bounced, 0));
        let [bounced, sky_lit] = [bounced, sky_lit].map(|lit| lit.create_view(&TextureViewDescriptor::default()));
        let sampler = device.create_sampler(&SamplerDescriptor {
            label: Some("texels"),
            mag_filter: FilterMode::Linear,
            min_filter: FilterMode::Linear,
            mipmap_filter: MipmapFilterMode::Linear,
            ..Default::default()
        });
        let white = create(device, "white", [1, 1, 1, 1], TextureFormat::Rgba8UnormSrgb, TextureUsages::COPY_DST);
        queue.write_texture(
            white.as_image_copy(),
            &[255; 4],
            TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4), rows_per_image: None },
            Extent3d { width: 1, height: 1, depth_or_array_layers: 1 },
        );
        // nothing, where the weather has left none: textures begin with zeros
        let clean = create(device, "clean", [1, 1, 1, 1], TextureFormat::Rgba8UnormSrgb, TextureUsages::COPY_DST);
        let weathering = self.weathering.as_ref().unwrap_or(&clean).create_view(&TextureViewDescriptor::default());
        let white = (white.create_view(&TextureViewDescriptor::default()), sampler.clone());
        let sun = sun.create_view(&array(0, None));
        let [surface, albedo] = self
            .looks
            .each_ref()
            .map(|texture| texture.as_ref().map(|texture| texture.create_view(&TextureViewDescriptor::default())));
        let layouts = [&pipelines.texels_layout, &pipelines.panorama_layout].map(|layout| cache.get_bind_group_layout(layout));
        let group = |(image, of_image): &(TextureView, Sampler)| {
            let whole = uniform.as_entire_buffer_binding();
            let light = (image, of_image, whole, &sun, &sky_lit, &bounced, &sampler, &weathering);
            let entries = DynamicBindGroupEntries::sequential(light);
            match (&surface, &albedo) {
                (Some(surface), Some(albedo)) => {
                    device.create_bind_group("stone_panorama", &layouts[1], &entries.extend_sequential((surface, albedo)))
                }
                _ => device.create_bind_group("stone_texels", &layouts[0], &entries),
            }
        };
        let groups = images.iter().chain([&white]).map(group).collect();
        self.ready = Some(Ready { uniform, sky: of_sky, bounce: of_bounce, groups });
    }

    /// What stone with this base colour image binds, or without.
    #[must_use]
    pub fn bind_group(&self, image: Option<u32>) -> Option<&BindGroup> {
        let groups = &self.ready.as_ref()?.groups;
        let index = image.map_or(groups.len().checked_sub(1)?, |image| image as usize);
        groups.get(index)
    }

    /// Takes a moment.
    pub fn light_at(&mut self, queue: &RenderQueue, moment: TexelMoment) {
        let Some(ready) = &self.ready else { return };
        let moment = TexelMoment { middle: self.middle, ..moment };
        if self.moment != Some(moment) {
            queue.write_buffer(&ready.uniform, 0, bytemuck::bytes_of(&moment));
            self.moment = Some(moment);
            self.stale.store(true, Ordering::Relaxed);
        }
    }

    /// Whether texels have another moment's light.
    #[must_use]
    pub fn is_stale(&self) -> bool {
        self.stale.load(Ordering::Relaxed)
    }

    /// Lights the texels of the sky and of the bounced sun, by a pipeline for each.
    pub fn encode(&self, pass: &mut ComputePass<'_>, [sky, bounce]: [&ComputePipeline; 2]) {
        self.stale.store(false, Ordering::Relaxed);
        let Some(ready) = &self.ready else { return };
        for (pipeline, relit) in
            ready.sky.iter().map(|relit| (sky, relit)).chain(ready.bounce.iter().map(|relit| (bounce, relit)))
        {
            let [width, height] = relit.size.map(|texels| texels.div_ceil(GROUP));
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &*relit.group, &[]);
            pass.dispatch_workgroups(width, height, 1);
        }
    }
}

/// How many levels of a texture are too large for a device.
fn skipped_levels(side: u32, most: u32) -> u32 {
    (0..32).find(|level| side >> level <= most).unwrap_or(31)
}

fn create(
    device: &RenderDevice,
    label: &str,
    [width, height, layers, levels]: [u32; 4],
    format: TextureFormat,
    usage: TextureUsages,
) -> Texture {
    device.create_texture(&TextureDescriptor {
        label: Some(label),
        size: Extent3d { width, height, depth_or_array_layers: layers },
        mip_level_count: levels,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage: usage | TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_bundle::texels::{MAX_TEXEL_SIDE, TEXEL_LEVELS};

    #[test]
    fn levels_that_a_device_cannot_hold_are_passed_over_and_one_is_always_left() {
        let skipped = [(4096, 8192), (8192, 8192), (8193, 8192), (16_384, 8192), (16_384, 4096)];
        assert_eq!(skipped.map(|(side, most)| skipped_levels(side, most)), [0, 0, 1, 1, 2]);
        // 4096 are what every Vulkan device has
        assert!(skipped_levels(MAX_TEXEL_SIDE, 4096) < TEXEL_LEVELS);
    }
}
