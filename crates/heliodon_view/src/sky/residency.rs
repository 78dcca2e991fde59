//! Which sky maps are in memory.

use super::pack;
use crate::stage::Stage;
use crate::stage::frame::StageFrame;
use crate::time_lapse::TimeLapse;
use bevy::prelude::*;
use bevy::tasks::{AsyncComputeTaskPool, Task, block_on};
use heliodon_image::HdrImage;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The most maps that are resident.
const MAX_RESIDENT: usize = 3;

struct Resident {
    path: PathBuf,
    /// The entry for which it was loaded; others may share the map.
    entry: usize,
    image: Handle<Image>,
}

/// The maps in memory.
#[derive(Resource, Default)]
pub struct SkyMaps {
    /// Whether a frame waits for its maps: for pictures that must be right, not quick.
    pub wait: bool,
    serial: u64,
    resident: Vec<Resident>,
    loading: Option<(usize, PathBuf, Task<Option<Image>>)>,
    failed: BTreeSet<PathBuf>,
}

impl SkyMaps {
    /// How many maps are resident.
    #[must_use]
    pub fn resident_count(&self) -> usize {
        self.resident.len()
    }

    fn find(&self, path: &Path) -> Option<AssetId<Image>> {
        self.resident.iter().find(|map| map.path == path).map(|map| map.image.id())
    }

    /// The map loaded for the entry that is nearest to `entry`.
    fn nearest(&self, entry: usize) -> Option<AssetId<Image>> {
        self.resident.iter().min_by_key(|map| map.entry.abs_diff(entry)).map(|map| map.image.id())
    }

    fn admit(
        &mut self,
        (entry, path): (usize, PathBuf),
        image: Option<Image>,
        images: &mut Assets<Image>,
        wanted: &[(usize, PathBuf)],
    ) {
        let Some(image) = image else {
            self.failed.insert(path);
            return;
        };
        while self.resident.len() >= MAX_RESIDENT {
            // The oldest that the frame does not want; with three wanted at most, and this one among them, there is one.
            let leaves = self.resident.iter().position(|map| wanted.iter().all(|(_, path)| *path != map.path)).unwrap_or(0);
            self.resident.remove(leaves);
        }
        self.resident.push(Resident { path, entry, image: images.add(image) });
    }
}

/// Reads a map. One that cannot be read is told once, and the dome goes on without it.
fn read(path: &Path) -> Option<Image> {
    match HdrImage::read(path) {
        Ok(map) => Some(pack::image(map)),
        Err(error) => {
            warn!("a sky map is missing: {error}");
            None
        }
    }
}

/// Looks after the maps of the moment, and names them to the frame.
pub(super) fn follow(
    stage: Res<Stage>,
    lapse: Res<TimeLapse>,
    mut maps: ResMut<SkyMaps>,
    mut images: ResMut<Assets<Image>>,
    mut frame: ResMut<StageFrame>,
) {
    let maps = &mut *maps;
    if maps.serial != stage.serial() {
        *maps = SkyMaps { serial: stage.serial(), wait: maps.wait, ..default() };
    }
    let (Some(bundle), Some(moment)) = (stage.bundle(), &frame.moment) else {
        frame.sky.maps = default();
        return;
    };
    let [a, b] = moment.entries;
    let share = moment.entry_fraction;
    let last = bundle.lapse().steps.len() - 1;
    let forwards = lapse.speed >= 0.0;
    let next = match (lapse.playing, forwards) {
        (false, _) => b,
        (true, true) if b < last => b + 1,
        (true, true) => 0,
        (true, false) if a > 0 => a - 1,
        (true, false) => last,
    };
    let mut wanted: Vec<(usize, PathBuf)> = Vec::with_capacity(MAX_RESIDENT);
    for entry in [a, b, next] {
        let path = bundle.sky_map_path(entry);
        if wanted.iter().all(|(_, known)| *known != path) {
            wanted.push((entry, path));
        }
    }

    if maps.loading.as_ref().is_some_and(|(.., task)| maps.wait || task.is_finished())
        && let Some((entry, path, task)) = maps.loading.take()
    {
        let image = block_on(task);
        maps.admit((entry, path), image, &mut images, &wanted);
    }
    for (entry, path) in wanted.clone() {
        if maps.find(&path).is_some() || maps.failed.contains(&path) {
            continue;
        }
        if maps.wait && [a, b].contains(&entry) {
            let image = read(&path);
            maps.admit((entry, path), image, &mut images, &wanted);
        } else if !maps.wait && maps.loading.is_none() {
            let reading = path.clone();
            maps.loading = Some((entry, path, AsyncComputeTaskPool::get().spawn(async move { read(&reading) })));
        }
    }

    let at = |entry: usize| maps.find(&bundle.sky_map_path(entry));
    frame.sky.maps = match (at(a), at(b)) {
        (Some(a), Some(b)) if a == b => [(Some(a), 1.0), (None, 0.0)],
        (Some(a), Some(b)) => [(Some(a), 1.0 - share), (Some(b), share)],
        (Some(only), None) | (None, Some(only)) => [(Some(only), 1.0), (None, 0.0)],
        // Where frames take longer than entries last, or the timeline is dragged, maps come late: the nearest stands in.
        (None, None) => [(maps.nearest(a), 1.0), (None, 0.0)],
    };
}
