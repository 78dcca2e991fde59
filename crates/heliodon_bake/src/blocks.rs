//! Work in blocks that are kept as soon as they are done.

use crate::cache::{Cache, CacheError};
use crate::report::Reporter;
use rayon::prelude::*;
use std::ops::Range;

/// Rays that a block should have: a kill costs about a second's work of two cores. With a sixteenth of it, a block of points with 1,024
/// rays each was a single granule, and one core did it.
const RAYS_PER_BLOCK: u64 = 1 << 24;

/// Threads that share a block; with more, several blocks are done at once.
const THREADS_PER_BLOCK: usize = 4;

/// The granule of the gather's runs of points; blocks are whole numbers of it, so that their division changes no number.
pub const GRANULE: usize = 1024;

/// How many points go into a block where each sends `rays_per_point`.
#[must_use]
pub fn points_per_block(rays_per_point: u64) -> usize {
    ((RAYS_PER_BLOCK / rays_per_point.max(1)) as usize).next_multiple_of(GRANULE).max(GRANULE)
}

/// The ranges of the blocks over `points`, the first beginning where `points` begins.
pub fn block_ranges(points: Range<usize>, per_block: usize) -> impl Iterator<Item = Range<usize>> {
    let end = points.end;
    points.step_by(per_block.max(1)).map(move |first| first..(first + per_block).min(end))
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
}

impl BlockStage<'_> {
    /// Does the blocks of `ranges` in order, or takes them from an earlier run; `first_block` numbers them.
    ///
    /// `decode` answers `None` for bytes that do not fit, which are done again; `compute` makes a block; `encode` its bytes.
    ///
    /// # Errors
    /// Those of `compute`, and of the cache where a block cannot be kept.
    pub fn run<T: Send, E: From<CacheError> + Send>(
        &self,
        ranges: &[Range<usize>],
        first_block: usize,
        decode: impl Fn(&[u8], &Range<usize>) -> Option<T>,
        compute: impl Fn(Range<usize>) -> Result<T, E> + Sync,
        encode: impl Fn(&T) -> Vec<u8> + Sync,
    ) -> Result<Vec<T>, E> {
        let points = |ranges: &[Range<usize>]| ranges.iter().map(|range| range.len() as u64).sum::<u64>();
        self.reporter.stage(self.name, points(ranges));
        let kept: Vec<bool> =
            (0..ranges.len()).map(|i| self.cache.is_some_and(|cache| cache.has(self.file_stage, first_block + i))).collect();
        let kept_count = kept.iter().filter(|kept| **kept).count();
        if kept_count > 0 {
            self.reporter.note(&format!("going on: {kept_count} of {} blocks of {} are done", ranges.len(), self.name));
        }
        let mut blocks: Vec<Option<T>> = ranges.iter().map(|_| None).collect();
        let mut done = 0;
        for (i, range) in ranges.iter().enumerate().filter(|(i, _)| kept[*i]) {
            let bytes = self.cache.and_then(|cache| cache.load(self.file_stage, first_block + i));
            blocks[i] = bytes.and_then(|bytes| decode(&bytes, range));
            match blocks[i] {
                Some(_) => done += range.len() as u64,
                None => self.reporter.note(&format!("block {} of {} was damaged and is done again", i + 1, self.name)),
            }
        }
        self.reporter.progress(done);
        let missing: Vec<usize> = (0..ranges.len()).filter(|&i| blocks[i].is_none()).collect();
        for at_once in missing.chunks(rayon::current_num_threads().div_ceil(THREADS_PER_BLOCK)) {
            let computed: Vec<T> = at_once
                .par_iter()
                .map(|&i| {
                    let block = compute(ranges[i].clone())?;
                    if let Some(cache) = self.cache {
                        cache.store(self.file_stage, first_block + i, &encode(&block))?;
                    }
                    Ok(block)
                })
                .collect::<Result<_, E>>()?;
            for (&i, block) in at_once.iter().zip(computed) {
                blocks[i] = Some(block);
                done += ranges[i].len() as u64;
            }
            self.reporter.progress(done);
        }
        self.reporter.finished();
        Ok(blocks.into_iter().flatten().collect())
    }
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
            let per_block = points_per_block(rays);
            assert!(per_block.is_multiple_of(GRANULE));
            let ranges: Vec<_> = block_ranges(points.clone(), per_block).collect();
            let flat: Vec<usize> = ranges.iter().cloned().flatten().collect();
            assert_eq!(flat, points.collect::<Vec<_>>());
        }
        assert_eq!(points_per_block(u64::MAX), GRANULE);
    }

    #[test]
    fn a_second_run_computes_only_what_is_missing_or_damaged() {
        let root = tempfile::tempdir().unwrap();
        let cache = Cache::open(root.path(), "key", Path::new("bundle")).unwrap();
        let computed = AtomicUsize::new(0);
        let ranges: Vec<_> = block_ranges(0..10, 3).collect();
        let run = |reporter: &Collector| {
            let stage = BlockStage { cache: Some(&cache), reporter, file_stage: "test", name: "the test" };
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
}
