//! Details on the GPU: fine patterns that are multiplied onto the albedo of parts near the eye, in the pass that draws them.
//!
//! Each is a group of its own, the last that stone binds: a texture of codes that are numbers (`R8Unorm`, not sRGB) with levels whose mean is
//! exactly 128, a sampler that repeats it, and 32 bytes of settings. Parts without one are drawn by the pipelines that they always had, and so is
//! everything while details are switched off, so that they cost nothing then. `heliodon_bundle::detail` says what is shown, and is the
//! reference that a test compares with.

use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderDevice, RenderQueue};
use bytemuck::{Pod, Zeroable};
use heliodon_bundle::detail::flat_level;
use heliodon_bundle::site::{Along, DetailMapping};
use heliodon_bundle::{BundleReader, DetailInfo, ReadError};
use heliodon_image::detail::DetailTexture;

/// WGSL of what a fragment reads of a detail; it names its bind group `DETAIL_GROUP`.
pub const DETAIL_WGSL: &str = include_str!("detail.wgsl");

/// `Detail` of detail.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct DetailUniform {
    scale: [f32; 4],
    mapping: [u32; 4],
}

/// Size of `Detail` in detail.wgsl, which a test compares with what the shader's compiler says.
pub const DETAIL_BYTES: usize = 32;
const _: () = assert!(size_of::<DetailUniform>() == DETAIL_BYTES);

/// A detail on its way to the GPU.
#[derive(Clone, Debug)]
pub struct PreparedDetail {
    uniform: DetailUniform,
    /// Texels along a side.
    side: u32,
    /// Codes of all levels, the finest first, and how many levels.
    levels: (Vec<u8>, u32),
}

impl PreparedDetail {
    /// Makes the levels of a detail.
    #[must_use]
    pub fn new(info: &DetailInfo, texture: &DetailTexture) -> Self {
        let flat = flat_level(&texture.mip_levels());
        let by_uv = info.mapping == DetailMapping::Uv;
        let along = match info.along {
            Along::X => 0,
            Along::Y => 1,
            Along::Z => 2,
        };
        let scale = [info.tiles as f32, info.strength as f32, 1.0 / info.near_m as f32, flat];
        let uniform = DetailUniform { scale, mapping: [u32::from(by_uv), along, 0, 0] };
        Self { uniform, side: texture.width(), levels: texture.mip_bytes() }
    }

    /// Bytes of its levels.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.levels.0.len()
    }
}

/// The details of a bundle, and which of them each part has.
#[derive(Clone, Debug, Default)]
pub struct PartDetails {
    infos: Vec<DetailInfo>,
    of_parts: Vec<Option<u32>>,
}

impl PartDetails {
    /// Reads those of a bundle, each that differs once, and hands them to `take` in the order of their numbers; false from it ends the reading.
    ///
    /// # Errors
    /// If one cannot be read.
    pub fn read(reader: &BundleReader, mut take: impl FnMut(PreparedDetail) -> bool) -> Result<Self, ReadError> {
        let mut details = Self::default();
        for (part, info) in reader.manifest().parts.iter().enumerate() {
            let Some(detail) = &info.detail else {
                details.of_parts.push(None);
                continue;
            };
            let known = details.infos.iter().position(|known| known == detail);
            if known.is_none() {
                let Some(texture) = reader.read_detail(part)? else {
                    details.of_parts.push(None);
                    continue;
                };
                details.infos.push(detail.clone());
                if !take(PreparedDetail::new(detail, &texture)) {
                    break;
                }
            }
            details.of_parts.push(Some(known.unwrap_or(details.infos.len() - 1) as u32));
        }
        Ok(details)
    }

    /// The number of a part's detail; none for chunks without the texture coordinates that it goes by.
    #[must_use]
    pub fn of(&self, part: u16, has_texture: bool) -> Option<u32> {
        let number = (*self.of_parts.get(usize::from(part))?)?;
        let by_uv = self.infos.get(number as usize)?.mapping == DetailMapping::Uv;
        (has_texture || !by_uv).then_some(number)
    }
}

/// Details on the GPU, by their numbers.
#[derive(Debug, Default)]
pub struct DetailsGpu {
    sampler: Option<Sampler>,
    groups: Vec<BindGroup>,
}

impl DetailsGpu {
    /// Takes the next.
    pub fn push(&mut self, device: &RenderDevice, queue: &RenderQueue, layout: &BindGroupLayout, detail: &PreparedDetail) {
        let (codes, levels) = &detail.levels;
        let texture = device.create_texture(&TextureDescriptor {
            label: Some("detail"),
            size: Extent3d { width: detail.side, height: detail.side, depth_or_array_layers: 1 },
            mip_level_count: *levels,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: TextureFormat::R8Unorm,
            usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let mut from = 0;
        for mip_level in 0..*levels {
            let side = (detail.side >> mip_level).max(1);
            let to = from + (side * side) as usize;
            queue.write_texture(
                TexelCopyTextureInfo { texture: &texture, mip_level, origin: Origin3d::ZERO, aspect: TextureAspect::All },
                &codes[from..to],
                TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(side), rows_per_image: None },
                Extent3d { width: side, height: side, depth_or_array_layers: 1 },
            );
            from = to;
        }
        let uniform = device.create_buffer_with_data(&BufferInitDescriptor {
            label: Some("detail"),
            contents: bytemuck::bytes_of(&detail.uniform),
            usage: BufferUsages::UNIFORM,
        });
        let sampler = self.sampler.get_or_insert_with(|| {
            device.create_sampler(&SamplerDescriptor {
                label: Some("detail"),
                address_mode_u: AddressMode::Repeat,
                address_mode_v: AddressMode::Repeat,
                mag_filter: FilterMode::Linear,
                min_filter: FilterMode::Linear,
                mipmap_filter: MipmapFilterMode::Linear,
                ..Default::default()
            })
        });
        let view = texture.create_view(&TextureViewDescriptor::default());
        let entries = BindGroupEntries::sequential((uniform.as_entire_buffer_binding(), &view, &*sampler));
        self.groups.push(device.create_bind_group("detail", layout, &entries));
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// What stone with this detail binds.
    #[must_use]
    pub fn bind_group(&self, number: u32) -> Option<&BindGroup> {
        self.groups.get(number as usize)
    }
}
