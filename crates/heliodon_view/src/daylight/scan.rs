//! The scan itself, for eyes at rest: a bundle may hold it beside the few triangles that are drawn of it ([`heliodon_bundle::BundleReader::scan`]).
//!
//! Where a processor draws it stays in main memory. Once an eye rests, a thread finds which triangle of the scan each pixel shows, and puts what was baked of just
//! their vertices together; from then on these are lit, and pixels from them (relight.rs), so that a frame takes as long as there are pixels, whatever the number of
//! triangles. Nobody waits for it: until it is there, and as soon as the eye moves, the few triangles are seen.

use super::chunk::PreparedChunk;
use super::layout::{BLOCK, GROUP, TEXEL_WORDS, VertexLayout, gather};
use super::lit::LitVertices;
use super::pages::GpuChunk;
use super::pixels::Wanted;
use super::raster::{Lens, Raster, Stone};
use super::relight::Relight;
use super::sight::SightKey;
use super::view::{Look, cull};
use crate::covering::gpu::{Sight, Worn};
use bevy::log::debug;
use bevy::prelude::*;
use bevy::render::render_resource::{BindGroup, BindGroupEntries, BindGroupLayout};
use bevy::render::renderer::{RenderDevice, RenderQueue};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::Instant;

/// The scan in main memory.
#[derive(Debug)]
pub struct Scan {
    layout: VertexLayout,
    chunks: Vec<GpuChunk>,
    /// What was baked of each.
    baked: Vec<Vec<u32>>,
}

/// What it looks like to a camera.
#[derive(Debug)]
struct Picture {
    words: Vec<[u32; 4]>,
    depth: Vec<f32>,
    /// What was baked of the vertices whose light its pixels take, in their order.
    baked: Vec<u32>,
    triangles: u64,
}

impl Scan {
    /// Without chunks.
    #[must_use]
    pub fn new(layout: VertexLayout) -> Self {
        Self { layout, chunks: Vec::new(), baked: Vec::new() }
    }

    /// Adds a chunk.
    pub fn push(&mut self, chunk: PreparedChunk) {
        let PreparedChunk { kept, baked, part, kind, .. } = chunk;
        self.chunks.push(GpuChunk {
            page: 0,
            base_vertex: 0,
            first_index: 0,
            kept,
            parts: OnceLock::new(),
            part,
            texture: None,
            detail: None,
            kind,
            closed: false,
            lit_at: Vec::new(),
        });
        self.baked.push(baked);
    }

    fn draw(&self, size: UVec2, (look, lens): (Look, Lens), worn: &[Worn], is_off: &AtomicBool) -> Option<Picture> {
        let begun = Instant::now();
        let mut clusters = cull(&self.chunks, &[look]);
        let is_hidden = |part: u16| worn.get(usize::from(part)).is_some_and(|worn| worn.sight == Sight::Hidden);
        clusters.retain(|one| !is_hidden(self.chunks[one.chunk as usize].part));
        let mut raster = Raster::default();
        let stone = Stone { chunks: &self.chunks, page_rows: &[], worn };
        let vertices = raster.draw_numbered(size, &lens, stone, &clusters, is_off)?;
        let triangles = raster.triangle_count();
        let Raster { words, depth, .. } = raster;
        let baked = gather(self.layout, vertices.len(), |number| {
            let (chunk, vertex) = vertices[number];
            (&self.baked[chunk as usize], usize::from(vertex))
        });
        debug!("{triangles} triangles of the scan with {} vertices show, found in {:?}", vertices.len(), begun.elapsed());
        Some(Picture { words, depth, baked, triangles })
    }
}

/// A picture that is being found.
#[derive(Debug)]
struct Finding {
    key: SightKey,
    off: Off,
    thread: JoinHandle<Option<Picture>>,
}

/// Ends a search when it goes.
#[derive(Debug, Default)]
struct Off(Arc<AtomicBool>);

impl Off {
    fn end(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    fn is_ended(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

impl Drop for Off {
    fn drop(&mut self) {
        self.end();
    }
}

/// The scan's pixels on the GPU.
#[derive(Debug)]
pub struct ScanPixels {
    relight: Relight,
    vertices: Vec<LitVertices>,
    triangles: u64,
    /// The moment, by its serial number, whose light they have; and whether they had not before this frame.
    lit_at: u64,
    is_stale: bool,
    /// What the pixels are lit from.
    pub bind_group: BindGroup,
}

impl ScanPixels {
    fn new(
        picture: &Picture,
        size: UVec2,
        layout: VertexLayout,
        (device, queue): (&RenderDevice, &RenderQueue),
        (light_layout, relight_layout): (&BindGroupLayout, &BindGroupLayout),
    ) -> Option<Self> {
        let block_words = layout.texels() as usize * (BLOCK * TEXEL_WORDS) as usize;
        let of_each = LitVertices::most(layout) / BLOCK;
        let vertices: Vec<LitVertices> = picture
            .baked
            .chunks(of_each as usize * block_words)
            .map(|baked| {
                let count = (baked.len() / block_words) as u32 * BLOCK;
                let lit = LitVertices::new(device, layout, light_layout, count);
                lit.write(queue, layout, 0, baked);
                let groups: Vec<u32> = (0..count / GROUP).collect();
                queue.write_buffer(&lit.work, 0, bytemuck::cast_slice(&groups));
                lit
            })
            .collect();
        let relight = Relight::of(device, vertices.iter(), size)?;
        relight.show(queue, &picture.words, &picture.depth);
        let entries = BindGroupEntries::sequential((&relight.pixels, &relight.depth, &relight.light));
        let bind_group = device.create_bind_group("relight", relight_layout, &entries);
        Some(Self { relight, vertices, triangles: picture.triangles, lit_at: 0, is_stale: false, bind_group })
    }

    /// Notes of which moment the light is.
    pub fn light_at(&mut self, serial: u64) {
        self.is_stale = self.lit_at != serial;
        self.lit_at = serial;
    }

    /// What is to be lit in this frame, and how many workgroups do it.
    pub fn stale(&self) -> impl Iterator<Item = (&LitVertices, u32)> {
        self.vertices.iter().filter(|_| self.is_stale).map(|lit| (lit, lit.blocks()))
    }

    /// Takes the light of the moment.
    pub fn light(&self, encoder: &mut wgpu::CommandEncoder) {
        self.relight.light(encoder, self.vertices.iter());
    }

    /// Triangles that show.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        self.triangles
    }
}

/// How far a camera's rest has come.
#[derive(Debug, Default)]
pub struct ScanSight {
    key: Option<SightKey>,
    finding: Option<Finding>,
    /// Whether it was found that it cannot be shown.
    given_up: bool,
    /// What was found and waits for the other eye's.
    found: Option<ScanPixels>,
    /// What it shows in this frame.
    pub shown: Option<ScanPixels>,
}

impl ScanSight {
    /// Whether it has its picture, shown or not.
    #[must_use]
    pub fn is_found(&self) -> bool {
        self.found.is_some() || self.shown.is_some()
    }

    /// Goes on to the next frame of a camera that wants such a picture, if it does; where it `may_show` it: else one eye of a pair would see what the other does not.
    pub fn next(
        &mut self,
        scan: Option<&Arc<Scan>>,
        look: Look,
        (wanted, may_show): (Option<&Wanted<'_>>, bool),
        gpu: (&RenderDevice, &RenderQueue),
        layouts: (&BindGroupLayout, &BindGroupLayout),
    ) {
        let (Some(scan), Some(wanted)) = (scan, wanted) else {
            self.off();
            return;
        };
        if self.key != Some(wanted.key) {
            // what was asked for is not wanted any more, and a frame that moved asks for nothing
            self.off();
            self.key = Some(wanted.key);
            return;
        }
        if may_show && self.found.is_some() {
            self.shown = self.found.take();
        }
        if self.is_found() || self.given_up {
            return;
        }
        match self.finding.take() {
            None => self.finding = Some(Self::find(scan, look, wanted)),
            Some(finding) if !finding.thread.is_finished() => self.finding = Some(finding),
            Some(Finding { key, off, thread }) => match thread.join() {
                Ok(picture) if key == wanted.key && !off.is_ended() => {
                    self.found = picture.and_then(|it| ScanPixels::new(&it, wanted.size, scan.layout, gpu, layouts));
                    self.given_up = self.found.is_none();
                    if self.given_up {
                        debug!("the scan at rest has more vertices than a texture of this device holds: what is drawn stays");
                    }
                }
                // of another place, or broken off on the way back to this one; the next frame asks anew
                Ok(_) => {}
                Err(_) => self.given_up = true,
            },
        }
    }

    fn find(scan: &Arc<Scan>, look: Look, &Wanted { key, size, lens, worn }: &Wanted<'_>) -> Finding {
        let off = Off::default();
        let (scan, is_off, worn) = (Arc::clone(scan), Arc::clone(&off.0), worn.to_vec());
        let thread = std::thread::spawn(move || scan.draw(size, (look, lens), &worn, &is_off));
        Finding { key, off, thread }
    }

    /// Nothing of it is shown, and nothing more is found.
    fn off(&mut self) {
        self.key = None;
        self.given_up = false;
        (self.found, self.shown) = (None, None);
        if let Some(finding) = &self.finding {
            finding.off.end();
        }
    }
}
