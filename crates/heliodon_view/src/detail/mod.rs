//! Details on the GPU: what is finer, or truer to where somebody stands, than the image of a part. Fine patterns that are multiplied onto the albedo of parts near the eye, and what single photographs saw takes the place of
//! albedo for whoever stands where they were taken; both in the pass that draws them.
//!
//! Each is a group of its own, the last that stone binds: a texture of codes that are numbers (`R8Unorm`, not sRGB) with levels whose mean is
//! exactly 128, a sampler that repeats it, 32 bytes of settings, and the colours and directions of photographs' views as layers of two more textures. Parts without one are drawn by the pipelines that they always had, and so is
//! everything without views while details are switched off, so that they cost nothing then. `heliodon_bundle::detail` and
//! `heliodon_image::view_layers` say what is shown, and are the references that tests compare with.

mod views;

use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderDevice, RenderQueue};
use bytemuck::{Pod, Zeroable};
use heliodon_bundle::detail::flat_level;
use heliodon_bundle::site::{Along, DetailMapping};
use heliodon_bundle::{BundleReader, DetailInfo, ReadError, ViewsInfo};
use heliodon_image::detail::DetailTexture;
use heliodon_image::view_layers::ViewLayers;
use views::{PreparedViews, ViewTextures, views_on_gpu};

/// WGSL of what a fragment reads of a detail; it names its bind group `DETAIL_GROUP`.
pub const DETAIL_WGSL: &str = include_str!("detail.wgsl");
/// WGSL of photographs' views, for stone with a texture; after [`DETAIL_WGSL`].
pub const VIEWED_WGSL: &str = include_str!("viewed.wgsl");

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

/// A detail on its way to the GPU: a pattern, photographs' views, or both.
#[derive(Clone, Debug)]
pub struct PreparedDetail {
    uniform: DetailUniform,
    /// Texels along a side.
    side: u32,
    /// Codes of all levels, the finest first, and how many levels.
    levels: (Vec<u8>, u32),
    views: Option<PreparedViews>,
}

impl PreparedDetail {
    /// Makes the levels of a pattern and of views, or of one of both.
    #[must_use]
    pub fn new(pattern: Option<(&DetailInfo, &DetailTexture)>, views: Option<ViewLayers>) -> Self {
        let views = views.map(PreparedViews::new);
        let layers = views.as_ref().map_or(0, |views| views.layers() as u32);
        let Some((info, texture)) = pattern else {
            let uniform = DetailUniform { scale: [0.0; 4], mapping: [0, 0, layers, 0] };
            return Self { uniform, side: 1, levels: (vec![128], 1), views };
        };
        let flat = flat_level(&texture.mip_levels());
        let by_uv = info.mapping == DetailMapping::Uv;
        let along = match info.along {
            Along::X => 0,
            Along::Y => 1,
            Along::Z => 2,
        };
        let scale = [info.tiles as f32, info.strength as f32, 1.0 / info.near_m as f32, flat];
        let uniform = DetailUniform { scale, mapping: [u32::from(by_uv), along, layers, 0] };
        Self { uniform, side: texture.width(), levels: texture.mip_bytes(), views }
    }

    /// Bytes of its levels and views.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.levels.0.len() + self.views.as_ref().map_or(0, PreparedViews::bytes)
    }
}

/// What a chunk may have of both kinds.
type Both = (Option<DetailInfo>, Option<ViewsInfo>);

/// The details of a bundle, and which of them each part's chunks have.
#[derive(Clone, Debug, Default)]
pub struct PartDetails {
    infos: Vec<Both>,
    /// Of each part that of chunks which say nothing, then those of its materials.
    of_parts: Vec<Vec<Option<u32>>>,
}

impl PartDetails {
    /// Reads those of a bundle, each that differs once, and hands them to `take` in the order of their numbers; false from it ends the reading.
    ///
    /// # Errors
    /// If one cannot be read.
    pub fn read(reader: &BundleReader, mut take: impl FnMut(PreparedDetail) -> bool) -> Result<Self, ReadError> {
        let mut details = Self::default();
        for (part, info) in reader.manifest().parts.iter().enumerate() {
            let patterns = std::iter::once(info.detail.as_ref()).chain(info.material_details.iter().map(Some));
            let mut of_part = Vec::new();
            for pattern in patterns {
                let own = (pattern.cloned(), info.views.clone());
                if own == (None, None) {
                    of_part.push(None);
                    continue;
                }
                let known = details.infos.iter().position(|known| *known == own);
                of_part.push(Some(known.unwrap_or(details.infos.len()) as u32));
                if known.is_none() {
                    let texture = pattern.map(|pattern| reader.read_detail(pattern)).transpose()?;
                    let prepared = PreparedDetail::new(pattern.zip(texture.as_ref()), reader.read_views(part)?);
                    details.infos.push(own);
                    if !take(prepared) {
                        return Ok(details);
                    }
                }
            }
            details.of_parts.push(of_part);
        }
        Ok(details)
    }

    /// The number of a chunk's detail, which says `of_material` of it; none for chunks without the texture coordinates that all of it goes by.
    #[must_use]
    pub fn of(&self, part: u16, of_material: Option<u32>, has_texture: bool) -> Option<u32> {
        let place = of_material.map_or(0, |index| index as usize + 1);
        let number = (*self.of_parts.get(usize::from(part))?.get(place)?)?;
        let (pattern, _) = self.infos.get(number as usize)?;
        let without_texture = pattern.as_ref().is_some_and(|pattern| pattern.mapping != DetailMapping::Uv);
        (has_texture || without_texture).then_some(number)
    }
}

/// Details on the GPU, by their numbers.
#[derive(Debug, Default)]
pub struct DetailsGpu {
    sampler: Option<Sampler>,
    /// What stone binds, and whether there are views in it.
    groups: Vec<(BindGroup, bool)>,
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
        let ViewTextures { colors, directions } = views_on_gpu(device, queue, detail.views.as_ref());
        let entries =
            BindGroupEntries::sequential((uniform.as_entire_buffer_binding(), &view, &*sampler, &colors, &directions));
        self.groups.push((device.create_bind_group("detail", layout, &entries), detail.views.is_some()));
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// Whether there is one to show: views always, others with their `patterns`.
    #[must_use]
    pub fn shows_any(&self, patterns: bool) -> bool {
        self.groups.iter().any(|&(_, has_views)| patterns || has_views)
    }

    /// What stone with this detail binds, where it is shown.
    #[must_use]
    pub fn bind_group(&self, number: u32, patterns: bool) -> Option<&BindGroup> {
        let (group, has_views) = self.groups.get(number as usize)?;
        (patterns || *has_views).then_some(group)
    }
}
