//! Work in blocks that are kept as soon as they are done.

use crate::cache::{Cache, CacheError};
use crate::report::Reporter;
use crate::shard::Shard;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// Rays that a block should have at most: a kill costs each core a few seconds' work.
const MOST_RAYS: u64 = 1 << 24;

/// And at least: a tenth of a second of two cores. Of the temple's 60,000 triangles, 128 samples a point, 2^24 rays made a single block, which
/// no second machine could share.
const LEAST_RAYS: u64 = 1 << 19;

/// Blocks of a stage whose rays allow it: enough for dozens of machines to come out even, and few enough files.
const BLOCKS: u64 = 256;

/// Blocks that are done at once for each thread: small ones have too few granules for all threads.
const BLOCKS_PER_THREAD: usize = 4;

/// The granule of the gather's runs of points; blocks are whole numbers of it, so that their division changes no number.
pub const GRANULE: usize = 1024;

/// How many of `points` go into a block where each sends `rays_per_point`.
#[must_use]
pub fn points_per_block(points: usize, rays_per_point: u64) -> usize {
    let rays_per_point = rays_per_point.max(1);
    let rays = (points as u64 * rays_per_point / BLOCKS).clamp(LEAST_RAYS, MOST_RAYS);
    ((rays / rays_per_point) as usize).next_multiple_of(GRANULE).max(GRANULE)
}

/// The ranges of the blocks over `points`, the first beginning where `points` begins.
pub fn block_ranges(points: Range<usize>, per_block: usize) -> impl Iterator<Item = Range<usize>> {
    let end = points.end;
    points.step_by(per_block.max(1)).map(move |first| first..(first + per_block).min(end))
}

/// A shard's part of a stage.
#[derive(Clone, Copy, Debug)]
pub struct Share {
    /// The shard.
    pub shard: Shard,
    /// The number of the stage's first block among those of all stages.
    pub first: usize,
}

impl Share {
    /// Whether a block of the stage is its own.
    #[must_use]
    pub fn takes(self, block: usize) -> bool {
        self.shard.takes(self.first + block)
    }

    /// Its own blocks first, then those of others from the end: who helps another begins where that one is last.
    #[must_use]
    pub fn in_order(self, blocks: impl Iterator<Item = usize>) -> Vec<usize> {
        let (mut own, others): (Vec<usize>, Vec<usize>) = blocks.partition(|&block| self.takes(block));
        own.extend(others.into_iter().rev());
        own
    }
}

/// A stage of the pipeline whose blocks are kept.
pub struct BlockStage<'a> {
    /// Where finished blocks are kept; `None` keeps none.
    pub cache: Option<&'a Cache>,
    /// Told of progress.
    pub reporter: &'a dyn Reporter,
    /// Name of the files.
    pub file_stage: &'a str,
    /// Name for people, "the gather".
    pub name: &'a str,
    /// The part of a shard; others' blocks may appear in the cache meanwhile.
    pub share: Option<Share>,
    /// Whether it was told already what of it is done: a stage in batches tells of all of them at once.
    pub told: bool,
}

impl BlockStage<'_> {
    /// Says how many of some blocks are done already.
    pub fn tell_kept(&self, blocks: Range<usize>) {
        let (of, kept) = (blocks.len(), blocks.filter(|&block| self.has(block)).count());
        if kept > 0 {
            self.reporter.note(&format!("going on: {kept} of {of} blocks of {} are done", self.name));
        }
    }

    /// Does the blocks of `ranges`, or takes them from an earlier run; `first_block` numbers them. A shard does its own first, then those
    /// that no other has done meanwhile: what comes next needs all of them.
    ///
    /// `decode` answers `None` for bytes that do not fit, which are done again; `compute` makes a block; `encode` its bytes, and lets go of what is kept with them and
    /// need not be in memory.
    ///
    /// # Errors
    /// Those of `compute`, and of the cache where a block cannot be kept.
    pub fn run<T: Send, E: From<CacheError> + Send>(
        &self,
        ranges: &[Range<usize>],
        first_block: usize,
        decode: impl Fn(&[u8], &Range<usize>) -> Option<T> + Sync,
        compute: impl Fn(Range<usize>) -> Result<T, E> + Sync,
        encode: impl Fn(&mut T) -> Vec<u8> + Sync,
    ) -> Result<Vec<T>, E> {
        self.reporter.stage(self.name, points(ranges));
        if !self.told {
            self.tell_kept(first_block..first_block + ranges.len());
        }
        let load = |i: usize| {
            let bytes = self.cache.and_then(|cache| cache.load(self.file_stage, first_block + i));
            bytes.and_then(|bytes| decode(&bytes, &ranges[i]))
        };
        let kept = |i: usize| {
            let was_there = self.has(first_block + i);
            let block = if was_there { load(i) } else { None };
            if was_there && block.is_none() {
                self.reporter.note(&format!("block {} of {} was damaged and is done again", first_block + i + 1, self.name));
            }
            block
        };
        let mut blocks: Vec<Option<T>> = (0..ranges.len()).into_par_iter().map(kept).collect();
        let missing = (0..ranges.len()).filter(|&i| blocks[i].is_none());
        let missing = match self.share {
            Some(share) => share.in_order(missing),
            None => missing.collect(),
        };
        if let Some(cache) = self.cache {
            cache.taken(self.name, ranges.len() - missing.len(), ranges.len());
        }
        let make = |i: usize| match self.share.filter(|_| self.has(first_block + i)).and_then(|_| load(i)) {
            Some(of_another) => Ok(of_another),
            None => self.make(first_block + i, ranges[i].clone(), &compute, &encode),
        };
        for (i, block) in self.each(&missing, ranges, make)? {
            blocks[i] = Some(block);
        }
        self.reporter.finished();
        Ok(blocks.into_iter().flatten().collect())
    }

    /// Does the blocks of a shard that are not there yet or are damaged, and keeps nothing of them in memory. Returns how many it has done.
    ///
    /// # Errors
    /// As [`BlockStage::run`].
    pub fn run_own<T: Send, E: From<CacheError> + Send>(
        &self,
        ranges: &[Range<usize>],
        compute: impl Fn(Range<usize>) -> Result<T, E> + Sync,
        encode: impl Fn(&mut T) -> Vec<u8> + Sync,
    ) -> Result<usize, E> {
        let own: Vec<usize> = (0..ranges.len()).filter(|&i| self.share.is_none_or(|share| share.takes(i))).collect();
        let own_ranges: Vec<Range<usize>> = own.iter().map(|&i| ranges[i].clone()).collect();
        self.reporter.stage(self.name, points(&own_ranges));
        let is_whole = |i: usize| self.has(i) && self.cache.is_some_and(|cache| cache.load(self.file_stage, i).is_some());
        let missing: Vec<usize> = (0..own.len()).filter(|&k| !is_whole(own[k])).collect();
        if missing.len() < own.len() {
            let done = own.len() - missing.len();
            self.reporter.note(&format!("going on: {done} of this shard's {} blocks of {} are done", own.len(), self.name));
        }
        let make = |k: usize| self.make(own[k], own_ranges[k].clone(), &compute, &encode).map(drop);
        self.each(&missing, &own_ranges, make)?;
        self.reporter.finished();
        Ok(missing.len())
    }

    fn has(&self, block: usize) -> bool {
        self.cache.is_some_and(|cache| cache.has(self.file_stage, block))
    }

    fn make<T, E: From<CacheError>>(
        &self,
        block: usize,
        range: Range<usize>,
        compute: &impl Fn(Range<usize>) -> Result<T, E>,
        encode: &impl Fn(&mut T) -> Vec<u8>,
    ) -> Result<T, E> {
        let mut made = compute(range)?;
        if let Some(cache) = self.cache {
            let bytes = encode(&mut made);
            // without what it has let go of there may be room
            cache.store(self.file_stage, block, &bytes).or_else(|_| cache.store(self.file_stage, block, &encode(&mut made)))?;
        }
        Ok(made)
    }

    /// Makes the blocks `missing` of `ranges`, some at once, and tells of each.
    fn each<T: Send, E: Send>(
        &self,
        missing: &[usize],
        ranges: &[Range<usize>],
        make: impl Fn(usize) -> Result<T, E> + Sync,
    ) -> Result<Vec<(usize, T)>, E> {
        let left: u64 = missing.iter().map(|&i| ranges[i].len() as u64).sum();
        let done = Mutex::new(points(ranges) - left);
        let tell = |more: u64| {
            // whoever panicked while it was told has added its number before
            let mut done = done.lock().unwrap_or_else(PoisonError::into_inner);
            *done += more;
            self.reporter.progress(*done);
        };
        tell(0);
        let mut made = Vec::with_capacity(missing.len());
        for at_once in missing.chunks(rayon::current_num_threads() * BLOCKS_PER_THREAD) {
            let blocks = at_once.par_iter().map(|&i| {
                let block = make(i)?;
                tell(ranges[i].len() as u64);
                Ok((i, block))
            });
            made.extend(blocks.collect::<Result<Vec<_>, E>>()?);
        }
        Ok(made)
    }
}

fn points(ranges: &[Range<usize>]) -> u64 {
    ranges.iter().map(|range| range.len() as u64).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Collector;
    use std::path::Path;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn blocks_cover_all_points_once_in_whole_granules() {
        for (points, rays) in [(0..1, 1), (5000..100_000, 256), (0..10_000_000, 46), (0..0, 9)] {
            let per_block = points_per_block(points.len(), rays);
            assert!(per_block.is_multiple_of(GRANULE));
            let ranges: Vec<_> = block_ranges(points.clone(), per_block).collect();
            let flat: Vec<usize> = ranges.iter().cloned().flatten().collect();
            assert_eq!(flat, points.collect::<Vec<_>>());
        }
        assert_eq!(points_per_block(1, u64::MAX), GRANULE);
        // small stages have small blocks, large ones no larger than a few seconds' work
        assert_eq!(points_per_block(97_000, 128), 4 * GRANULE);
        assert_eq!(points_per_block(100_000_000, 256), (1 << 24) / 256);
    }

    #[test]
    fn a_second_run_computes_only_what_is_missing_or_damaged() {
        let root = tempfile::tempdir().unwrap();
        let cache = Cache::open(root.path(), "key", Path::new("bundle")).unwrap();
        let computed = AtomicUsize::new(0);
        let ranges: Vec<_> = block_ranges(0..10, 3).collect();
        let run = |reporter: &Collector| {
            let stage =
                BlockStage { cache: Some(&cache), reporter, file_stage: "test", name: "the test", share: None, told: false };
            stage
                .run::<u64, CacheError>(
                    &ranges,
                    0,
                    |bytes, _| Some(u64::from_le_bytes(bytes.try_into().ok()?)),
                    |range| {
                        computed.fetch_add(1, Ordering::Relaxed);
                        Ok(range.sum::<usize>() as u64)
                    },
                    |sum| sum.to_le_bytes().to_vec(),
                )
                .unwrap()
        };
        let first = run(&Collector::default());
        assert_eq!((first.as_slice(), computed.load(Ordering::Relaxed)), (&[3, 12, 21, 9][..], 4));
        std::fs::write(cache.folder().join("test-00001"), b"damaged").unwrap();
        std::fs::remove_file(cache.folder().join("test-00003")).unwrap();
        let reporter = Collector::default();
        assert_eq!(run(&reporter), first);
        assert_eq!(computed.load(Ordering::Relaxed), 6);
        let notes = reporter.heard().notes;
        assert_eq!(
            notes,
            ["going on: 3 of 4 blocks of the test are done", "block 2 of the test was damaged and is done again"]
        );
    }

    #[test]
    fn a_shard_does_its_own_and_helps_from_the_end() {
        let root = tempfile::tempdir().unwrap();
        let cache = Cache::join(root.path(), "key", Path::new("bundle")).unwrap();
        let ranges: Vec<_> = block_ranges(0..10, 2).collect();
        let reporter = Collector::default();
        let share = Share { shard: "1/2".parse().unwrap(), first: 1 };
        assert_eq!(share.in_order(0..5), [1, 3, 4, 2, 0]);
        let stage = BlockStage {
            cache: Some(&cache),
            reporter: &reporter,
            file_stage: "test",
            name: "it",
            share: Some(share),
            told: false,
        };
        let sum = |range: Range<usize>| Ok::<u64, CacheError>(range.sum::<usize>() as u64);
        let encode = |sum: &mut u64| sum.to_le_bytes().to_vec();
        assert_eq!(stage.run_own(&ranges, sum, encode).unwrap(), 2);
        let there: Vec<usize> = (0..5).filter(|&block| cache.has("test", block)).collect();
        assert_eq!(there, [1, 3]);
        assert_eq!(stage.run_own(&ranges, sum, encode).unwrap(), 0);
        std::fs::write(cache.folder().join("test-00003"), "damaged").unwrap();
        assert_eq!(stage.run_own(&ranges, sum, encode).unwrap(), 1);
        let decode = |bytes: &[u8], _: &Range<usize>| Some(u64::from_le_bytes(bytes.try_into().ok()?));
        assert_eq!(stage.run(&ranges, 0, decode, sum, encode).unwrap(), [1, 5, 9, 13, 17]);
        assert!((0..5).all(|block| cache.has("test", block)));
    }
}
