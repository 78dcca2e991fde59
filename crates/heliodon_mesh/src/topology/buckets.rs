//! Items sorted by a number below n: counted, laid side by side, and sorted within.

use rayon::prelude::*;

/// Buckets that one task sorts.
const BLOCK: usize = 1 << 14;

/// Items in buckets, sorted within each: in linear time, 4 bytes a bucket beyond the items.
pub struct Buckets<T> {
    starts: Vec<u32>,
    items: Vec<T>,
}

impl<T: Copy + Ord + Send + Sync + Default> Buckets<T> {
    /// Sorts the items that `items` makes into `count` buckets. `items` calls its argument with each bucket's number and item, and
    /// is called twice.
    ///
    /// # Panics
    /// From 2^32 items on.
    pub fn new(count: usize, items: impl Fn(&mut dyn FnMut(u32, T))) -> Self {
        let mut starts = vec![0_u32; count + 1];
        let mut total = 0_u64;
        items(&mut |bucket, _| {
            starts[bucket as usize] += 1;
            total += 1;
        });
        assert!(u32::try_from(total).is_ok(), "more items than buckets can count");
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        // filled from the end of each bucket, starts end up at the beginnings
        let mut sorted = vec![T::default(); total as usize];
        items(&mut |bucket, item| {
            let at = &mut starts[bucket as usize];
            *at -= 1;
            sorted[*at as usize] = item;
        });
        let mut buckets = Self { starts, items: sorted };
        buckets.sort();
        buckets
    }

    fn sort(&mut self) {
        let mut rest = self.items.as_mut_slice();
        let mut blocks = Vec::with_capacity(self.starts.len() / BLOCK + 1);
        for starts in self.starts.windows(BLOCK + 1).step_by(BLOCK).chain(last_block(&self.starts)) {
            let (first, last) = (starts[0], starts[starts.len() - 1]);
            let (block, after) = rest.split_at_mut((last - first) as usize);
            blocks.push((starts, block));
            rest = after;
        }
        blocks.into_par_iter().for_each(|(starts, block)| {
            for bounds in starts.windows(2) {
                block[(bounds[0] - starts[0]) as usize..(bounds[1] - starts[0]) as usize].sort_unstable();
            }
        });
    }

    /// All buckets in order.
    pub fn iter(&self) -> impl Iterator<Item = (u32, &[T])> {
        (0..self.starts.len() - 1).map(|bucket| (bucket as u32, self.bucket(bucket)))
    }

    /// One bucket, in order.
    ///
    /// # Panics
    /// If there are not so many.
    pub fn bucket(&self, bucket: usize) -> &[T] {
        &self.items[self.starts[bucket] as usize..self.starts[bucket + 1] as usize]
    }
}

/// What whole blocks leave over.
fn last_block(starts: &[u32]) -> Option<&[u32]> {
    let whole = (starts.len() - 1) / BLOCK * BLOCK;
    (whole + 1 < starts.len()).then(|| &starts[whole..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_is_in_its_bucket_and_in_order() {
        for count in [0_usize, 1, 3, BLOCK, BLOCK + 1, 3 * BLOCK + 5] {
            let items = |give: &mut dyn FnMut(u32, u64)| {
                for i in 0..2 * count as u64 {
                    give((i * 7919 % count as u64) as u32, u64::MAX - i);
                }
            };
            let buckets = Buckets::new(count, items);
            let mut total = 0;
            for (bucket, items) in buckets.iter() {
                assert!(items.iter().all(|&item| ((u64::MAX - item) * 7919 % count as u64) as u32 == bucket));
                assert!(items.is_sorted());
                total += items.len();
            }
            assert_eq!(total, 2 * count);
        }
    }
}
