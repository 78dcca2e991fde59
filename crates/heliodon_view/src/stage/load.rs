//! The loading thread: reads chunk after chunk, makes each ready, and hands it on.

use super::feed::Delivery;
use super::texture::{Level, halved};
use crate::culling::{CullingScene, OfChunk};
use crate::daylight::chunk::{KeptChunk, PreparedChunk};
use crate::daylight::closed::{Bodies, ClosedBodies};
use crate::daylight::layout::VertexLayout;
use crate::daylight::texels::{panorama_pieces, pieces};
use crate::detail::PartDetails;
use bevy::log::debug;
use heliodon_bundle::manifest::{Manifest, PartInfo};
use heliodon_bundle::site::Role;
use heliodon_bundle::{BundleReader, ReadError};
use heliodon_image::SrgbImage;
use heliodon_math::color::linear_from_srgb8_table;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, SyncSender};
use std::time::Instant;

/// What the stage learns from the loading thread.
#[derive(Debug)]
pub enum Progress {
    /// A chunk is on its way to the GPU.
    Chunk(Arc<KeptChunk>),
    /// Nothing more will come, because of this.
    Failed(String),
    /// All chunks that are drawn were read.
    Drawn,
    /// The scan itself was read too, where there is one.
    Done,
}

/// Deliveries that may wait for the GPU: enough to keep both sides busy, few enough to be no second copy of the bundle.
pub const QUEUE_LENGTH: usize = 4;

/// Reads all of `reader`, and of the scan that it may hold while that is wanted, until done, an error, or nobody listens any more.
pub fn run(
    reader: &BundleReader,
    (scan, wants_scan): (Result<Option<BundleReader>, ReadError>, &AtomicBool),
    to_gpu: &SyncSender<Delivery>,
    to_stage: &Sender<Progress>,
) {
    // The stage may have gone to another bundle: then nobody wants to know.
    match deliver(reader, to_gpu, to_stage) {
        Ok(stone) => {
            to_stage.send(Progress::Drawn).ok();
            // of a scan that breaks off nothing is shown
            match scan.and_then(|scan| scan.map_or(Ok(()), |scan| deliver_scan(&scan, wants_scan, to_gpu))) {
                Ok(()) => {
                    to_gpu.send(Delivery::Whole).ok();
                    to_stage.send(Progress::Done).ok();
                }
                Err(error) => drop(to_stage.send(Progress::Failed(format!(
                    "{error} (what is drawn of the scan is there, the scan itself is not; copy the bundle again, or bake it again)"
                )))),
            }
            if let Some(stone) = stone {
                // Only now: it takes seconds of a large bundle, and pictures are the same before.
                let begun = Instant::now();
                let scene = CullingScene::new(&stone.chunks, &stone.of_chunks, &stone.bodies, &reader.manifest().mattes);
                debug!("{} occluders found in {:?}", scene.occluders.len(), begun.elapsed());
                to_gpu.send(Delivery::Culling(Arc::new(scene))).ok();
            }
        }
        Err(what) => drop(to_stage.send(Progress::Failed(what))),
    }
}

/// What was read of the stone.
struct Stone {
    chunks: Vec<Arc<KeptChunk>>,
    of_chunks: Vec<OfChunk>,
    bodies: Bodies,
}

/// Hands on the scan itself; nothing comes of it if nobody listens any more, or wants it.
fn deliver_scan(reader: &BundleReader, wanted: &AtomicBool, to_gpu: &SyncSender<Delivery>) -> Result<(), ReadError> {
    let layout = VertexLayout(reader.manifest().light);
    for index in 0..reader.chunk_count() {
        if !wanted.load(Ordering::Acquire) {
            break;
        }
        let chunk = reader.read_chunk(index)?;
        if to_gpu.send(Delivery::Scan(Box::new(PreparedChunk::new(layout, &chunk, false)))).is_err() {
            break;
        }
    }
    Ok(())
}

/// Hands on all that is drawn; nothing comes of it if nobody listens any more.
fn deliver(reader: &BundleReader, to_gpu: &SyncSender<Delivery>, to_stage: &Sender<Progress>) -> Result<Option<Stone>, String> {
    let layout = VertexLayout(reader.manifest().light);
    let decode = linear_from_srgb8_table();
    for (index, texture) in reader.manifest().textures.iter().enumerate() {
        let bytes = reader.texture_bytes(index).map_err(|error| error.to_string())?;
        let mut image = if bytes.is_empty() {
            SrgbImage { width: 1, height: 1, pixels: vec![[255; 4]] }
        } else {
            SrgbImage::from_bytes(&bytes, &texture.name).map_err(|error| error.to_string())?
        };
        drop(bytes);
        if !texture.evidence {
            image.pixels.iter_mut().for_each(|pixel| pixel[3] = u8::MAX);
        }
        let wrap = reader.texture_wrap(index);
        loop {
            let smaller = (image.width.max(image.height) > 1).then(|| halved(&image, &decode));
            if to_gpu.send(Delivery::Texture(Level { texture: index, wrap, image })).is_err() {
                return Ok(None);
            }
            match smaller {
                Some(level) => image = level,
                None => break,
            }
        }
    }
    if let Some(light) = reader.read_texels().map_err(|error| error.to_string())? {
        let weathering = reader.read_texel_weathering().map_err(|error| error.to_string())?;
        for piece in pieces(light, weathering) {
            if to_gpu.send(Delivery::Texels(piece)).is_err() {
                return Ok(None);
            }
        }
    }
    if let Some(panorama) = reader.read_panorama().map_err(|error| error.to_string())? {
        for piece in panorama_pieces(panorama) {
            if to_gpu.send(Delivery::Panorama(piece)).is_err() {
                return Ok(None);
            }
        }
    }
    let panorama = &reader.manifest().panorama;
    if reader.manifest().texels.is_some() || panorama.is_some() {
        to_gpu.send(Delivery::TexelsDone(panorama.clone())).ok();
    }
    let details =
        PartDetails::read(reader, |detail| to_gpu.send(Delivery::Detail(detail)).is_ok()).map_err(|error| error.to_string())?;
    let mut bodies = ClosedBodies::default();
    let mut chunks = Vec::with_capacity(reader.chunk_count());
    let of_parts = of_parts(reader.manifest());
    let mut of_chunks = Vec::with_capacity(reader.chunk_count());
    for index in 0..reader.chunk_count() {
        let chunk = reader.read_chunk(index).map_err(|error| error.to_string())?;
        let detail = details.of(chunk.part, chunk.detail, chunk.texture.is_some());
        let prepared = PreparedChunk { detail, ..PreparedChunk::new(layout, &chunk, panorama.is_some()) };
        of_chunks.push(of_parts.get(usize::from(chunk.part)).copied().unwrap_or_default());
        drop(chunk);
        let kept = Arc::clone(&prepared.kept);
        bodies.push(&kept);
        chunks.push(Arc::clone(&kept));
        if to_gpu.send(Delivery::Chunk(Box::new(prepared))).is_err() || to_stage.send(Progress::Chunk(kept)).is_err() {
            return Ok(None);
        }
    }
    let bodies = bodies.finish();
    let closed = bodies.closed_chunks();
    debug!("{} of {} chunks are closed bodies", closed.iter().filter(|closed| **closed).count(), closed.len());
    if to_gpu.send(Delivery::Closed(closed)).is_err() {
        return Ok(None);
    }
    Ok(Some(Stone { chunks, of_chunks, bodies }))
}

/// What culling is told of each part.
fn of_parts(manifest: &Manifest) -> Vec<OfChunk> {
    let said = |part: usize| manifest.parameters.parts.get(part);
    let least_px = |part: usize| said(part).and_then(|part| part.least_px).map(|pixels| pixels as f32);
    let of = |(part, info): (usize, &PartInfo)| OfChunk { is_ground: info.role == Role::Ground, least_px: least_px(part) };
    manifest.parts.iter().enumerate().map(of).collect()
}
