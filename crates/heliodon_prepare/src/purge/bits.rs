//! A set of triangles that many threads add to.

use std::sync::atomic::{AtomicU64, Ordering};

/// Members are only ever added, so what is in it does not depend on the order in which threads came.
pub(super) struct Bits(Vec<AtomicU64>);

impl Bits {
    pub fn new(len: usize) -> Self {
        Self((0..len.div_ceil(64)).map(|_| AtomicU64::new(0)).collect())
    }

    pub fn contains(&self, i: usize) -> bool {
        self.0[i / 64].load(Ordering::Relaxed) >> (i % 64) & 1 == 1
    }

    pub fn insert(&self, i: usize) {
        // A write takes the cache line from all other threads; most of what is seen has been seen before.
        if !self.contains(i) {
            self.0[i / 64].fetch_or(1 << (i % 64), Ordering::Relaxed);
        }
    }

    pub fn count(&self) -> u64 {
        self.0.iter().map(|word| u64::from(word.load(Ordering::Relaxed).count_ones())).sum()
    }
}

impl Clone for Bits {
    fn clone(&self) -> Self {
        Self(self.0.iter().map(|word| AtomicU64::new(word.load(Ordering::Relaxed))).collect())
    }
}
