//! One machine's part of a bake.
//!
//! The bake's blocks, all stages counted through, go to the shards in turn: neighbours in space, which cost alike, to different ones. No
//! block changes with the number of shards, so any number of machines, one by one or at once, fill the same cache with the same files.

use std::fmt;
use std::str::FromStr;

/// The most shards that a bake can be divided into.
pub const MOST_SHARDS: u32 = 10_000;

/// The how-maniest of so many equal parts, written `2/7`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: u32,
    count: u32,
}

impl Shard {
    /// Part `index` of `count`, both from 1 to [`MOST_SHARDS`]; `None` where they are not, or the index is above the count.
    #[must_use]
    pub fn new(index: u32, count: u32) -> Option<Self> {
        (1..=count).contains(&index).then_some(Self { index, count }).filter(|_| count <= MOST_SHARDS)
    }

    /// All the parts of which this is one.
    #[must_use]
    pub fn count(self) -> u32 {
        self.count
    }

    /// The part, of `count`, that a block belongs to; blocks count through all stages.
    #[must_use]
    pub fn of_block(block: usize, count: u32) -> u32 {
        (block % count.max(1) as usize) as u32 + 1
    }

    /// Whether a block belongs to this part.
    #[must_use]
    pub fn takes(self, block: usize) -> bool {
        Self::of_block(block, self.count) == self.index
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(index, count)| Some((index.parse().ok()?, count.parse().ok()?)));
        numbers
            .and_then(|(index, count)| Self::new(index, count))
            .ok_or_else(|| format!("write I/N, part I of N from 1/N to N/N, as in 2/7; N can be at most {MOST_SHARDS}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_block_belongs_to_one_part() {
        for count in [1, 2, 3, 7, 100] {
            for block in 0..50 {
                let takers: Vec<u32> = (1..=count).filter(|&i| Shard::new(i, count).is_some_and(|s| s.takes(block))).collect();
                assert_eq!(takers, [Shard::of_block(block, count)]);
            }
        }
    }

    #[test]
    fn parts_are_read_as_they_are_written() {
        let shard: Shard = "2/7".parse().unwrap();
        assert_eq!((shard, shard.to_string().as_str(), shard.count()), (Shard::new(2, 7).unwrap(), "2/7", 7));
        for wrong in ["", "2", "0/3", "4/3", "1/0", "-1/2", "1/2/3", "a/b", "1/10001"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }
}
