//! The way of chunks and textures from the loading thread to the GPU.

use super::texture::Level;
use crate::culling::CullingScene;
use crate::daylight::chunk::PreparedChunk;
use crate::daylight::layout::VertexLayout;
use crate::daylight::pages::Remaining;
use crate::daylight::pipelines::KINDS;
use crate::daylight::texels::TexelPiece;
use crate::detail::PreparedDetail;
use heliodon_bundle::{BundleReader, Manifest, PanoramaInfo};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex, PoisonError};

/// Something for the GPU.
#[derive(Debug)]
pub enum Delivery {
    /// A level of a base colour image: image by image in the order of their index, from large to small, before the chunks.
    Texture(Level),
    /// A layer of a level of the atlas of light in texels; before the chunks.
    Texels(TexelPiece),
    /// The same of the panorama.
    Panorama(TexelPiece),
    /// After all of these; with what the manifest says of the panorama, where there is one.
    TexelsDone(Option<PanoramaInfo>),
    /// A detail, in the order of their numbers; before the chunks.
    Detail(PreparedDetail),
    /// A chunk.
    Chunk(Box<PreparedChunk>),
    /// After all chunks: which of them, in their order, are parts of closed bodies.
    Closed(Vec<bool>),
    /// A chunk of the scan itself ([`BundleReader::scan`]), after those that are drawn.
    Scan(Box<PreparedChunk>),
    /// All that is to be seen is there.
    Whole,
    /// Last, some time later: what culling knows of the bundle.
    Culling(Arc<CullingScene>),
}

/// What a bundle holds of the scan itself.
#[derive(Clone, Debug, Default)]
pub struct OfScan {
    /// Its chunks, all of plain stone.
    pub total: Remaining,
    /// Of each part whether it is in it: others are drawn as ever.
    pub parts: Vec<bool>,
    /// Whether all stone is in it.
    pub is_whole: bool,
}

impl OfScan {
    /// Of a bundle and its scan.
    #[must_use]
    pub fn new(bundle: &Manifest, scan: &BundleReader) -> Self {
        let mut total = Remaining::default();
        for chunk in (0..scan.chunk_count()).map(|chunk| scan.chunk_info(chunk)) {
            total.add(u64::from(chunk.vertices), u64::from(chunk.triangles));
        }
        let parts: Vec<bool> = scan.manifest().parts.iter().map(|part| part.counts.chunks > 0).collect();
        let is_whole = bundle.parts.iter().zip(&parts).all(|(part, &is_in)| is_in || part.counts.chunks == 0);
        Self { total, parts, is_whole }
    }
}

/// The stage of one bundle, as the render world sees it. The queue is short, so that a bundle is never in memory twice; and
/// since the levels of an image follow one another in it, it never holds two large images either.
#[derive(Debug)]
pub struct Feed {
    /// What tells this bundle from the one before.
    pub serial: u64,
    /// Shape of its light.
    pub layout: VertexLayout,
    /// All chunks that will come, by kinds of stone: plain, textured, lit by texels, by the panorama; those of the scan not among them.
    pub total: [Remaining; KINDS.len()],
    /// The scan.
    pub of_scan: OfScan,
    receiver: Mutex<Receiver<Delivery>>,
    /// Whether the loader is to read the scan; it may have begun.
    wants_scan: Arc<AtomicBool>,
    has_pages: AtomicBool,
    uploaded: AtomicBool,
}

impl Feed {
    /// A feed from `receiver`.
    #[must_use]
    pub fn new(
        serial: u64,
        layout: VertexLayout,
        (total, of_scan): ([Remaining; KINDS.len()], OfScan),
        receiver: Receiver<Delivery>,
    ) -> Arc<Self> {
        Arc::new(Self {
            serial,
            layout,
            total,
            of_scan,
            receiver: Mutex::new(receiver),
            wants_scan: Arc::new(AtomicBool::new(true)),
            has_pages: AtomicBool::new(false),
            uploaded: AtomicBool::new(false),
        })
    }

    /// What tells the loader whether anybody wants the scan.
    #[must_use]
    pub fn wants_scan(&self) -> &Arc<AtomicBool> {
        &self.wants_scan
    }

    /// All that is drawn has reached the GPU, and nothing of the scan will: it stays in main memory, or is not wanted at all.
    pub fn scan_stays_off(&self, wanted: bool) {
        self.wants_scan.store(wanted, Ordering::Release);
        self.has_pages.store(true, Ordering::Release);
    }

    /// Whether all stone that will be on the GPU is there.
    #[must_use]
    pub fn has_pages(&self) -> bool {
        self.has_pages.load(Ordering::Acquire)
    }

    /// The next thing, if one is ready.
    #[must_use]
    pub fn next(&self) -> Option<Delivery> {
        use std::sync::mpsc::TryRecvError;
        match self.receiver.lock().unwrap_or_else(PoisonError::into_inner).try_recv() {
            Ok(delivery) => Some(delivery),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                self.end();
                None
            }
        }
    }

    /// All that is to be seen has reached the GPU.
    pub fn end(&self) {
        self.has_pages.store(true, Ordering::Release);
        self.uploaded.store(true, Ordering::Release);
    }

    /// Whether all that is to be seen has reached the GPU.
    #[must_use]
    pub fn is_uploaded(&self) -> bool {
        self.uploaded.load(Ordering::Acquire)
    }
}
