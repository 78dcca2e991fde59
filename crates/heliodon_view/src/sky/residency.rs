//! Which sky maps are in memory.

use super::pack;
use crate::stage::Stage;
use crate::stage::frame::StageFrame;
use crate::time_lapse::TimeLapse;
use bevy::prelude::*;
use bevy::tasks::{AsyncComputeTaskPool, Task, block_on};
use heliodon_bundle::BundleReader;
use heliodon_image::HdrImage;
use std::path::Path;

/// The most maps that are resident.
const MAX_RESIDENT: usize = 3;

struct Resident {
    /// As the lapse names it.
    name: String,
    /// The entry for which it was loaded; others may share the map.
    entry: usize,
    image: Handle<Image>,
}

/// A map, or why there is none.
type Read = Result<Image, String>;

/// The maps in memory.
#[derive(Resource, Default)]
pub struct SkyMaps {
    /// Whether a frame waits for its maps: for pictures that must be right, not quick.
    pub wait: bool,
    serial: u64,
    resident: Vec<Resident>,
    loading: Option<(usize, Task<Read>)>,
    /// Maps that cannot be read, and why.
    failed: Vec<(String, String)>,
    missing: Option<String>,
}

impl SkyMaps {
    /// How many maps are resident.
    #[must_use]
    pub fn resident_count(&self) -> usize {
        self.resident.len()
    }

    /// Why the frame's dome is not what it should be: a map of its moment cannot be read, and its neighbour stands in.
    #[must_use]
    pub fn missing(&self) -> Option<&str> {
        self.missing.as_deref()
    }

    /// Why the first map that could not be read could not.
    #[must_use]
    pub fn first_failure(&self) -> Option<&str> {
        self.failed.first().map(|(_, why)| why.as_str())
    }

    fn find(&self, name: &str) -> Option<AssetId<Image>> {
        self.resident.iter().find(|map| map.name == name).map(|map| map.image.id())
    }

    fn failure(&self, name: &str) -> Option<&str> {
        self.failed.iter().find(|(failed, _)| failed == name).map(|(_, why)| why.as_str())
    }

    /// The map loaded for the entry that is nearest to `entry`.
    fn nearest(&self, entry: usize) -> Option<AssetId<Image>> {
        self.resident.iter().min_by_key(|map| map.entry.abs_diff(entry)).map(|map| map.image.id())
    }

    /// Takes the map of `entry`; `wanted` names those that the frame wants.
    fn admit(&mut self, entry: usize, name: &str, read: Read, images: &mut ResMut<Assets<Image>>, wanted: [&str; 3]) {
        let image = match read {
            Ok(image) => image,
            Err(why) => {
                warn!("{why}");
                self.failed.push((name.to_owned(), why));
                return;
            }
        };
        while self.resident.len() >= MAX_RESIDENT {
            // The oldest that the frame does not want; with three wanted at most, and this one among them, there is one.
            let leaves = self.resident.iter().position(|map| !wanted.contains(&map.name.as_str())).unwrap_or(0);
            self.resident.remove(leaves);
        }
        self.resident.push(Resident { name: name.to_owned(), entry, image: images.add(image) });
    }

    /// The maps of the moment between the entries `a` and `b`, and their weights; `next` is loaded ahead.
    fn of_moment(
        &mut self,
        bundle: &BundleReader,
        [a, b]: [usize; 2],
        share: f32,
        next: usize,
        images: &mut ResMut<Assets<Image>>,
    ) -> [(Option<AssetId<Image>>, f32); 2] {
        let name = |entry: usize| bundle.lapse().steps[entry].sky_map.as_str();
        let wanted = [a, b, next].map(name);
        if self.loading.as_ref().is_some_and(|(_, task)| self.wait || task.is_finished())
            && let Some((entry, task)) = self.loading.take()
        {
            self.admit(entry, name(entry), block_on(task), images, wanted);
        }
        for (entry, weight) in [(a, 1.0 - share), (b, share), (next, 0.0)] {
            if self.find(name(entry)).is_some() || self.failure(name(entry)).is_some() {
                continue;
            }
            let path = bundle.sky_map_path(entry);
            if self.wait && weight > 0.0 {
                self.admit(entry, name(entry), read(&path), images, wanted);
            } else if !self.wait && self.loading.is_none() {
                self.loading = Some((entry, AsyncComputeTaskPool::get().spawn(async move { read(&path) })));
            }
        }
        let mut shown = [(a, 1.0 - share), (b, share)].into_iter().filter(|&(_, weight)| weight > 0.0);
        self.missing = shown.find_map(|(entry, _)| self.failure(name(entry))).map(str::to_owned);
        match (self.find(name(a)), self.find(name(b))) {
            (Some(a), Some(b)) if a == b => [(Some(a), 1.0), (None, 0.0)],
            (Some(a), Some(b)) => [(Some(a), 1.0 - share), (Some(b), share)],
            (Some(only), None) | (None, Some(only)) => [(Some(only), 1.0), (None, 0.0)],
            // Where frames take longer than entries last, or the timeline is dragged, maps come late: the nearest stands in.
            (None, None) => [(self.nearest(a), 1.0), (None, 0.0)],
        }
    }
}

fn read(path: &Path) -> Read {
    HdrImage::read(path).map(pack::image).map_err(|error| format!("a sky map of the bundle is missing or damaged: {error}"))
}

/// The entry whose map comes after the two of the moment.
fn next_entry(lapse: &TimeLapse, [a, b]: [usize; 2], last: usize) -> usize {
    match (lapse.playing, lapse.speed >= 0.0) {
        (false, _) => b,
        (true, true) if b < last => b + 1,
        (true, true) => 0,
        (true, false) if a > 0 => a - 1,
        (true, false) => last,
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
    if frame.feed.as_ref().map_or(0, |feed| feed.serial) != stage.serial() {
        // The frame is still of the bundle before.
        return;
    }
    let maps = maps.bypass_change_detection();
    if maps.serial != stage.serial() {
        *maps = SkyMaps { serial: stage.serial(), wait: maps.wait, ..default() };
    }
    let shown = match (stage.bundle(), &frame.moment) {
        (Some(bundle), Some(moment)) => {
            let next = next_entry(&lapse, moment.entries, bundle.lapse().steps.len() - 1);
            maps.of_moment(bundle, moment.entries, moment.entry_fraction, next, &mut images)
        }
        _ => default(),
    };
    if frame.sky.maps != shown {
        frame.sky.maps = shown;
    }
}
