//! The stage: a bundle, loaded while it can already be seen.

pub(crate) mod background;
mod cluster_tree;
pub mod feed;
pub mod frame;
pub mod ground;
mod load;
pub(crate) mod texture;

use crate::daylight::chunk::stone_kind;
use crate::daylight::layout::VertexLayout;
use crate::daylight::pages::Remaining;
use crate::daylight::pipelines::KINDS;
use crate::time_lapse::TimeLapse;
use bevy::prelude::*;
use feed::{Feed, OfScan};
use frame::StageFrame;
use ground::Ground;
use heliodon_bundle::{BundleReader, Manifest, ReadError};
use load::Progress;
use std::path::Path;
use std::sync::mpsc::{Receiver, TryRecvError, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};

/// How far the bundle is loaded.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum StageStatus {
    /// No bundle was opened.
    #[default]
    Empty,
    /// Chunks are coming in; those that came are drawn.
    Loading {
        /// Chunks read.
        done: usize,
        /// All chunks.
        total: usize,
    },
    /// Everything was read.
    Ready,
    /// Reading failed; what came before is drawn.
    Failed(String),
}

/// The bundle on the stage. Open one with [`Stage::open`]; cameras with [`crate::DaylightCamera`] see it.
#[derive(Resource, Default)]
pub struct Stage {
    bundle: Option<Arc<BundleReader>>,
    feed: Option<Arc<Feed>>,
    progress: Option<Mutex<Receiver<Progress>>>,
    status: StageStatus,
    ground: Ground,
    serial: u64,
}

impl Stage {
    /// Opens the bundle in `folder` and starts to load it in the background, in place of the one before.
    ///
    /// # Errors
    /// If it is no bundle, or its manifest, lapse or geometry are malformed. The stage then stays as it was. What is wrong with the scan itself that a bundle may hold is
    /// told by [`Stage::status`] once the rest is there.
    pub fn open(&mut self, folder: impl AsRef<Path>) -> Result<(), ReadError> {
        let bundle = Arc::new(BundleReader::open(folder)?);
        let scan = bundle.scan();
        let of_scan = scan.as_ref().ok().and_then(Option::as_ref);
        let of_scan = of_scan.map(|scan| OfScan::new(bundle.manifest(), scan)).unwrap_or_default();
        let mut total = [Remaining::default(); KINDS.len()];
        for chunk in (0..bundle.chunk_count()).map(|chunk| bundle.chunk_info(chunk)) {
            total[stone_kind(chunk.texture, chunk.by_texels, bundle.manifest().panorama.is_some()) as usize]
                .add(u64::from(chunk.vertices), u64::from(chunk.triangles));
        }
        let (to_gpu, from_loader) = sync_channel(load::QUEUE_LENGTH);
        let (to_stage, progress) = channel();
        self.serial += 1;
        let feed = Feed::new(self.serial, VertexLayout(bundle.manifest().light), (total, of_scan), from_loader);
        let wants_scan = Arc::clone(feed.wants_scan());
        self.feed = Some(feed);
        self.progress = Some(Mutex::new(progress));
        self.status = StageStatus::Loading { done: 0, total: bundle.chunk_count() };
        self.ground = Ground::default();
        self.bundle = Some(Arc::clone(&bundle));
        std::thread::spawn(move || load::run(&bundle, (scan, &*wants_scan), &to_gpu, &to_stage));
        Ok(())
    }

    /// How far the bundle is loaded.
    #[must_use]
    pub fn status(&self) -> &StageStatus {
        &self.status
    }

    /// Whether everything was read and has reached the GPU.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        // what is drawn is ready before the scan itself was read, which may fail
        let ended = self.status == StageStatus::Ready && self.progress.is_none();
        ended && self.feed.as_ref().is_some_and(|feed| feed.is_uploaded())
    }

    /// What the open bundle is.
    #[must_use]
    pub fn manifest(&self) -> Option<&Manifest> {
        self.bundle.as_deref().map(BundleReader::manifest)
    }

    /// The open bundle.
    #[must_use]
    pub fn bundle(&self) -> Option<&Arc<BundleReader>> {
        self.bundle.as_ref()
    }

    /// What feet stand on: nothing until all of it was read, for where the floor is still to come is no hole to fall through.
    #[must_use]
    pub fn footing(&self) -> Option<&Ground> {
        (!matches!(self.status, StageStatus::Loading { .. })).then_some(&self.ground)
    }

    /// The geometry that was read so far.
    #[must_use]
    pub fn ground(&self) -> &Ground {
        &self.ground
    }

    /// A number that changes with the bundle.
    #[must_use]
    pub fn serial(&self) -> u64 {
        self.serial
    }
}

/// Keeps the [`Stage`] up to date.
#[derive(Default)]
pub struct StagePlugin;

impl Plugin for StagePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Stage>().add_systems(PreUpdate, follow_loading);
    }
}

fn follow_loading(mut stage: ResMut<Stage>, mut frame: ResMut<StageFrame>, mut lapse: ResMut<TimeLapse>) {
    if stage.serial != frame.feed.as_ref().map_or(0, |feed| feed.serial) {
        frame.feed = stage.feed.clone();
        lapse.begin(stage.bundle.as_deref().map(BundleReader::lapse));
    }
    if stage.progress.is_none() {
        // Not to be taken for changed.
        return;
    }
    let stage = &mut *stage;
    let Some(progress) = &stage.progress else { return };
    let progress = progress.lock().unwrap_or_else(PoisonError::into_inner);
    let mut ended = false;
    while !ended {
        let news = match progress.try_recv() {
            Ok(news) => news,
            Err(TryRecvError::Empty) => break,
            // It says how it ends, unless it panics.
            Err(TryRecvError::Disconnected) => Progress::Failed("the bundle's loading thread broke off".to_owned()),
        };
        match news {
            Progress::Chunk(kept) => {
                stage.ground.push(kept);
                if let StageStatus::Loading { done, .. } = &mut stage.status {
                    *done += 1;
                }
            }
            Progress::Failed(what) => {
                warn!("the bundle could not be read to its end: {what}");
                stage.status = StageStatus::Failed(what);
                ended = true;
            }
            Progress::Drawn => stage.status = StageStatus::Ready,
            Progress::Done => ended = true,
        }
    }
    drop(progress);
    if ended {
        stage.progress = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loading_thread_that_breaks_off_is_told() {
        let (to_stage, progress) = channel::<Progress>();
        let mut app = App::new();
        app.insert_resource(Stage {
            progress: Some(Mutex::new(progress)),
            status: StageStatus::Loading { done: 0, total: 7 },
            ..Stage::default()
        })
        .init_resource::<StageFrame>()
        .init_resource::<TimeLapse>()
        .add_systems(Update, follow_loading);
        app.update();
        assert_eq!(app.world().resource::<Stage>().status, StageStatus::Loading { done: 0, total: 7 });
        assert!(app.world().resource::<Stage>().footing().is_none());
        drop(to_stage);
        app.update();
        assert!(matches!(app.world().resource::<Stage>().status, StageStatus::Failed(_)));
        assert!(app.world().resource::<Stage>().footing().is_some());
    }
}
