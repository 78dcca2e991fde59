//! What an earlier bake of the same bundle, among other geometry, has left that still holds.
//!
//! A part that was moved, replaced, added or taken away changes the geometry, and with it the names of all blocks. But rays that neither met
//! it nor cross its place meet what they met before ([`Change`]). So each bake leaves a record of its parts, of where its points are, and of
//! what its blocks are called; the next looks for the points of its own that were there already, and traces only what the change reaches.

use crate::cache::{Cache, CacheError};
use crate::codec::{Decoder, Encoder};
use crate::key::Digest;
use crate::light::LightInput;
use crate::names::PointNames;
use crate::scene::Scene;
use crate::stages::{decode_masks, decode_traces};
use glam::Vec3;
use heliodon_light::{Before, Bounds, Change, KnownTraces, LightParams, MasksBefore, PatchesBefore, PointSet, Traces};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A part's triangles, as rays meet them or as light is solved on them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct PartRecord {
    digest: [u8; 32],
    first: u32,
    count: u32,
    /// Least and greatest coordinates.
    boxes: Vec<[[f32; 3]; 2]>,
}

/// What a scene is made of, part by part.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneRecord {
    /// What rays meet.
    rays: Vec<PartRecord>,
    /// What light is solved on.
    surfaces: Vec<PartRecord>,
}

/// A part is told by so many times a halving of its triangles.
const HALVINGS: u32 = 6;

impl SceneRecord {
    /// That of a scene whose original is still there ([`Scene::take_rays`] gives it up).
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let mesh = &scene.mesh;
        let clearance = scene.original.as_ref().map(|original| original.clearance_m.as_slice());
        let surface =
            |part: &crate::scene::PartRange| record(&mesh.positions, &mesh.triangles, part.triangles.clone(), clearance);
        let surfaces: Vec<PartRecord> = scene.parts.iter().map(surface).collect();
        let rays = match &scene.original {
            None => surfaces.clone(),
            Some(original) => {
                let mut first = 0;
                let ends = scene.parts.iter().map(|part| {
                    let rest = &original.stands_for[first..];
                    let count = rest.iter().take_while(|&&t| part.triangles.contains(&(t as usize))).count();
                    first += count;
                    first - count..first
                });
                ends.collect::<Vec<_>>()
                    .into_iter()
                    .map(|range| record(&original.positions, &original.triangles, range, None))
                    .collect()
            }
        };
        Self { rays, surfaces }
    }
}

/// Triangles that are hashed at once.
const HASHED: usize = 1 << 16;

fn record(positions: &[Vec3], triangles: &[[u32; 3]], range: Range<usize>, clearance: Option<&[f32]>) -> PartRecord {
    let mut digest = Digest::default();
    let corners = |triangle: &[u32; 3]| triangle.map(|vertex| positions[vertex as usize]);
    for triangles in triangles[range.clone()].chunks(HASHED) {
        digest.run(bytemuck::cast_slice(&triangles.iter().map(corners).collect::<Vec<_>>()));
        if let Some(clearance) = clearance {
            let of_corners = |triangle: &[u32; 3]| triangle.map(|vertex| clearance[vertex as usize]);
            digest.run(bytemuck::cast_slice(&triangles.iter().map(of_corners).collect::<Vec<_>>()));
        }
    }
    let bounds = |triangle: &[u32; 3]| {
        let [a, b, c] = corners(triangle);
        let bounds = [a.min(b).min(c), a.max(b).max(c)];
        // what has no place is met by no ray
        (a.is_finite() && b.is_finite() && c.is_finite()).then_some((0.5 * bounds[0] + 0.5 * bounds[1], bounds))
    };
    let mut centres: Vec<(Vec3, Bounds)> = triangles[range.clone()].par_iter().filter_map(bounds).collect();
    let boxes = halved(&mut centres, HALVINGS);
    let boxes = boxes.into_iter().map(|bounds| bounds.map(|corner: Vec3| corner.to_array())).collect();
    PartRecord { digest: digest.bytes(), first: range.start as u32, count: range.len() as u32, boxes }
}

/// Boxes about some triangles, given by their boxes and the centres of these.
fn halved(triangles: &mut [(Vec3, Bounds)], times: u32) -> Vec<Bounds> {
    let Some(&(_, first)) = triangles.first() else { return Vec::new() };
    let join = |[low, high]: Bounds, [l, h]: Bounds| [low.min(l), high.max(h)];
    let [low, high] = triangles.par_iter().map(|(_, bounds)| *bounds).reduce(|| first, join);
    if times == 0 || triangles.len() < 2 {
        return vec![[low, high]];
    }
    let axis = (high - low).max_position();
    let middle = triangles.len() / 2;
    triangles.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]));
    let (near, far) = triangles.split_at_mut(middle);
    let (mut near, mut far) = rayon::join(|| halved(near, times - 1), || halved(far, times - 1));
    near.append(&mut far);
    near
}

/// The longest list of parts that are in both, in order: rays that meet two triangles at once take the first.
fn in_both(then: &[PartRecord], now: &[PartRecord]) -> Vec<(usize, usize)> {
    let same = |i: usize, j: usize| then[i].digest == now[j].digest && then[i].count == now[j].count;
    let mut longest = vec![vec![0_u32; now.len() + 1]; then.len() + 1];
    for i in (0..then.len()).rev() {
        for j in (0..now.len()).rev() {
            let skipped = longest[i + 1][j].max(longest[i][j + 1]);
            longest[i][j] = if same(i, j) { skipped.max(longest[i + 1][j + 1] + 1) } else { skipped };
        }
    }
    let (mut i, mut j, mut pairs) = (0, 0, Vec::new());
    while i < then.len() && j < now.len() {
        if same(i, j) && longest[i][j] == longest[i + 1][j + 1] + 1 {
            pairs.push((i, j));
            (i, j) = (i + 1, j + 1);
        } else if longest[i + 1][j] >= longest[i][j + 1] {
            i += 1;
        } else {
            j += 1;
        }
    }
    pairs
}

/// What differs between the parts of then and of now.
fn change(then: &[PartRecord], now: &[PartRecord]) -> Change {
    let pairs = in_both(then, now);
    let same = pairs.iter().map(|&(i, j)| [then[i].first, now[j].first, then[i].count]).collect();
    let boxes = |parts: &[PartRecord], kept: Vec<usize>| -> Vec<Bounds> {
        let others = parts.iter().enumerate().filter(|(i, _)| !kept.contains(i));
        others.flat_map(|(_, part)| part.boxes.iter().map(|bounds| bounds.map(Vec3::from_array))).collect()
    };
    let gone = boxes(then, pairs.iter().map(|pair| pair.0).collect());
    let come = boxes(now, pairs.iter().map(|pair| pair.1).collect());
    Change::new(same, gone, come)
}

/// What a bake tells those to come.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct BakeRecord {
    scene: SceneRecord,
    /// What coordinates are relative to where rays are answered: it decides how these are rounded.
    center: [u32; 3],
    /// What the suns are, and the samples.
    day: String,
    sampling: String,
    fronts: PointRecord,
    space: PointRecord,
    patches: String,
    /// How the surfaces are divided into patches.
    plan: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct PointRecord {
    places: String,
    masks: String,
    traces: String,
}

/// Points of an earlier bake by their places.
type Places = HashMap<[u32; 6], u32>;

/// The earlier bake, as far as it serves this one.
pub struct Earlier<'a> {
    cache: &'a Cache,
    folder: PathBuf,
    record: BakeRecord,
    change: Change,
    day_is_same: bool,
    sampling_is_same: bool,
    paths: u64,
}

/// Points of an earlier bake, and what is left of them.
pub struct EarlierPoints<'a> {
    of: &'a Earlier<'a>,
    names: &'a PointRecord,
    places: Places,
    /// How many there were: several may have had one place.
    count: usize,
    /// The first of them in the earlier layout.
    first: usize,
    /// Which suns reached them, a number of words each; empty where that is not known for these suns.
    masks: Vec<u32>,
    /// Where the blocks of traces begin, ascending.
    traces: Vec<usize>,
}

fn key_of(origin: Vec3, normal: Vec3) -> [u32; 6] {
    let [a, b, c] = origin.to_array().map(f32::to_bits);
    let [d, e, f] = normal.to_array().map(f32::to_bits);
    [a, b, c, d, e, f]
}

/// Leaves a record of this bake's parts, and of the points that it asks, for bakes to come.
///
/// # Errors
/// A cache that cannot be written.
pub fn leave_record(input: &LightInput, cache: &Cache) -> Result<(), CacheError> {
    let names = input.names;
    let point = |names: &PointNames| PointRecord {
        places: names.places.clone(),
        masks: names.masks.clone(),
        traces: names.traces.clone(),
    };
    let record = BakeRecord {
        scene: input.record.clone(),
        center: input.surfaces.rays.center().to_array().map(f32::to_bits),
        day: names.day.clone(),
        sampling: names.sampling.clone(),
        fronts: point(&names.fronts),
        space: point(&names.space),
        patches: names.patches.clone(),
        plan: names.plan.clone(),
    };
    if !cache.has(&names.record, 0) {
        // plain numbers and words always have a JSON form; an empty record serves nobody
        cache.store(&names.record, 0, &serde_json::to_vec(&record).unwrap_or_default())?;
    }
    Ok(())
}

/// Leaves the places of some points.
///
/// # Errors
/// A cache that cannot be written.
pub fn leave_places(points: &PointSet, range: Range<usize>, name: &str, cache: &Cache) -> Result<(), CacheError> {
    if cache.has(name, 0) {
        return Ok(());
    }
    let mut encoder = Encoder::default();
    let (origins, normals) = (&points.origins[range.clone()], &points.normals[range.clone()]);
    encoder.number(range.start as u64).run(origins).run(normals);
    cache.store(name, 0, &encoder.finish())
}

impl<'a> Earlier<'a> {
    /// The latest other bake of the bundle whose rays can be compared with this one's.
    #[must_use]
    pub fn find(input: &LightInput, cache: &'a Cache) -> Option<Self> {
        let names = input.names;
        let center = input.surfaces.rays.center().to_array().map(f32::to_bits);
        let mut found: Vec<(std::time::SystemTime, PathBuf, BakeRecord)> = Vec::new();
        for folder in cache.others_of_owner() {
            for (stage, path) in cache.stages_in(&folder, crate::names::RECORD) {
                let record =
                    cache.load_from(&folder, &stage, 0).and_then(|bytes| serde_json::from_slice::<BakeRecord>(&bytes).ok());
                let written = path.metadata().and_then(|data| data.modified()).unwrap_or(std::time::UNIX_EPOCH);
                found.extend(
                    record
                        .filter(|record| record.center == center && stage != names.record)
                        .map(|record| (written, folder.clone(), record)),
                );
            }
        }
        found.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.cmp(&b.1)));
        let (_, folder, record) = found.pop()?;
        let change = change(&record.scene.rays, &input.record.rays);
        let (day_is_same, sampling_is_same) = (record.day == names.day, record.sampling == names.sampling);
        Some(Self { cache, folder, record, change, day_is_same, sampling_is_same, paths: names.paths })
    }

    /// The earlier bake's points on fronts, or in space.
    #[must_use]
    pub fn points(&'a self, in_space: bool, steps: usize) -> Option<EarlierPoints<'a>> {
        let names = if in_space { &self.record.space } else { &self.record.fronts };
        let bytes = self.cache.load_from(&self.folder, &names.places, 0)?;
        let mut decoder = Decoder::new(&bytes);
        let (first, origins, normals) = (decoder.number()?, decoder.run::<Vec3>()?, decoder.run::<Vec3>()?);
        let places: Places = origins.iter().zip(&normals).enumerate().map(|(i, (&o, &n))| (key_of(o, n), i as u32)).collect();
        let masks = if self.day_is_same { self.all_masks(&names.masks).unwrap_or_default() } else { Vec::new() };
        let mut traces = Vec::new();
        if self.sampling_is_same {
            traces =
                self.cache.stages_in(&self.folder, &names.traces).into_iter().filter_map(|(_, path)| block_of(&path)).collect();
            traces.sort_unstable();
        }
        // of masks that are not whole none is taken
        let masks = if masks.len() == origins.len() * steps.div_ceil(32) { masks } else { Vec::new() };
        Some(EarlierPoints { of: self, names, places, count: origins.len(), first: first as usize, masks, traces })
    }

    fn all_masks(&self, name: &str) -> Option<Vec<u32>> {
        let blocks = self.cache.stages_in(&self.folder, name).len();
        let mut words = Vec::new();
        for block in 0..blocks {
            words.extend(decode_masks(&self.cache.load_from(&self.folder, name, block)?)?.1);
        }
        Some(words)
    }

    /// What is known of the suns on the surfaces; the number of triangles is that of now.
    #[must_use]
    pub fn patches(&self, input: &LightInput) -> Option<PatchesBefore<'_>> {
        let width = input.suns.len().div_ceil(32);
        if !self.day_is_same || width == 0 {
            return None;
        }
        let bytes = self.cache.load_from(&self.folder, &self.record.plan, 0)?;
        let mut decoder = Decoder::new(&bytes);
        let (offset, parts) = (decoder.number()?, decoder.run::<[u32; 2]>()?);
        if offset != u64::from(input.params.offset_m.to_bits()) {
            return None;
        }
        let words = self.all_masks(&self.record.patches)?;
        let mut splits_then = HashMap::with_capacity(parts.len());
        let mut first = 0;
        for [triangle, parts] in parts {
            splits_then.insert(triangle, (parts, first));
            first += (parts * parts) as usize;
        }
        if words.len() != first * width {
            return None;
        }
        let (then, now) = (&self.record.scene.surfaces, &input.record.surfaces);
        let mut splits = vec![None; input.surfaces.triangles.len()];
        for (i, j) in in_both(then, now) {
            for k in 0..then[i].count {
                splits[(now[j].first + k) as usize] = splits_then.get(&(then[i].first + k)).copied();
            }
        }
        Some(PatchesBefore { change: &self.change, splits, words })
    }
}

fn block_of(path: &Path) -> Option<usize> {
    path.file_name()?.to_str()?.rsplit_once('-')?.1.parse().ok()
}

impl EarlierPoints<'_> {
    fn before(&self, points: &PointSet, range: &Range<usize>) -> Vec<Option<u32>> {
        let of = |i: usize| self.places.get(&key_of(points.origins[i], points.normals[i])).copied();
        range.clone().map(of).collect()
    }

    /// What is known of which suns reach some points.
    #[must_use]
    pub fn masks(&self, points: &PointSet, range: &Range<usize>) -> Option<MasksBefore<'_>> {
        if self.masks.is_empty() {
            return None;
        }
        let width = self.masks.len() / self.count;
        let before = self.before(points, range);
        let known = before.iter().map(Option::is_some).collect();
        let mut words = Vec::with_capacity(before.len() * width);
        for point in before {
            let at = point.unwrap_or(0) as usize * width;
            words.extend_from_slice(&self.masks[at..at + width]);
        }
        Some(MasksBefore { change: &self.of.change, words, known })
    }

    /// What is known of what some points' rays meet.
    #[must_use]
    pub fn traces(&self, points: &PointSet, range: &Range<usize>, params: &LightParams) -> Option<KnownTraces> {
        if self.traces.is_empty() {
            return None;
        }
        let mut loaded: Vec<Traces> = Vec::new();
        let mut number_of: HashMap<usize, Option<usize>> = HashMap::new();
        let mut load = |start: usize| -> Option<usize> {
            let bytes = self.of.cache.load_from(&self.of.folder, &self.names.traces, start)?;
            let traces = decode_traces(&bytes, self.of.paths)?.pop()?;
            traces.validate_among(&traces.range, usize::MAX, params).ok()?;
            loaded.push(traces);
            Some(loaded.len() - 1)
        };
        let mut before: Vec<Option<Before>> = Vec::with_capacity(range.len());
        for place in self.before(points, range) {
            let found = place.and_then(|place| {
                let point = self.first + place as usize;
                let start = *self.traces.get(self.traces.partition_point(|&start| start <= point).checked_sub(1)?)?;
                let number = (*number_of.entry(start).or_insert_with(|| load(start)))?;
                Some((number, point - start))
            });
            before.push(found);
        }
        let before: Vec<Option<Before>> =
            before.into_iter().map(|before| before.filter(|&(number, point)| point < loaded[number].range.len())).collect();
        before.iter().any(Option::is_some).then(|| KnownTraces::among(&self.of.change, points, range, params, &loaded, &before))
    }
}
