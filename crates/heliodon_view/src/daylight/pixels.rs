//! A camera's pixels, where stone is lit pixel by pixel.

use super::pages::{GpuChunk, Page};
use super::raster::{Lens, Raster, Stone};
use super::relight::Relight;
use super::sight::SightKey;
use super::view::ClusterRef;
use crate::covering::gpu::Worn;
use bevy::prelude::*;
use bevy::render::render_resource::{BindGroup, BindGroupEntries, BindGroupLayout};
use bevy::render::renderer::{RenderDevice, RenderQueue};

/// What the pixels show, which holds until the camera or the stage changes.
#[derive(Debug)]
pub struct Pixels {
    key: SightKey,
    /// What is seen.
    pub raster: Raster,
    relight: Relight,
    /// What they are lit from.
    pub bind_group: BindGroup,
}

/// A picture that is asked for.
#[derive(Clone, Copy, Debug)]
pub struct Wanted<'a> {
    /// When it is another.
    pub key: SightKey,
    /// Pixels, which [`Raster::can_be`] allows.
    pub size: UVec2,
    /// The camera.
    pub lens: Lens,
    /// What parts wear: no more than colour.
    pub worn: &'a [Worn],
}

impl Pixels {
    /// The pixels of a frame, from those of the frame before if there are any, else of what `cull` leaves of the stone. None where [`Relight::new`] says so.
    #[must_use]
    pub fn next(
        before: Option<Self>,
        wanted: &Wanted<'_>,
        (pages, chunks): (&[Page], &[GpuChunk]),
        (device, queue): (&RenderDevice, &RenderQueue),
        layout: &BindGroupLayout,
        cull: impl FnOnce(&[GpuChunk]) -> Vec<ClusterRef>,
    ) -> Option<Self> {
        let Wanted { key, size, lens, worn } = *wanted;
        let mut pixels = match before {
            Some(before) if before.key == key => return Some(before),
            Some(before) if before.relight.is(size, pages) => Self { key, ..before },
            before => {
                let relight = Relight::new(device, pages, size)?;
                let entries = BindGroupEntries::sequential((&relight.pixels, &relight.depth, &relight.light));
                let bind_group = device.create_bind_group("relight", layout, &entries);
                Self { key, raster: before.map(|before| before.raster).unwrap_or_default(), relight, bind_group }
            }
        };
        pixels.raster.draw(size, &lens, Stone { chunks, page_rows: &pixels.relight.page_rows, worn }, &cull(chunks));
        pixels.relight.show(queue, &pixels.raster.words, &pixels.raster.depth);
        Some(pixels)
    }

    /// Takes the light of the moment.
    pub fn light(&self, encoder: &mut wgpu::CommandEncoder, pages: &[Page]) {
        self.relight.light(encoder, pages.iter().map(|page| &page.lit));
    }
}
