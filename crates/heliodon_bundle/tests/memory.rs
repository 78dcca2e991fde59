//! The memory of this process. One test, for others beside it would be in the same process.
#![cfg(all(target_os = "linux", target_env = "gnu"))]

use heliodon_bundle::memory::{give_back_freed_memory, peak_resident_bytes, resident_bytes};

#[test]
fn the_peak_grows_with_what_is_touched_and_what_is_free_goes_back() {
    let before = peak_resident_bytes().unwrap();
    let block = std::hint::black_box(vec![1_u8; 64 << 20]);
    assert!(peak_resident_bytes().unwrap() >= before.max(64 << 20));
    drop(block);
    // blocks too small to have pages of their own, of which every hundredth stays, so that no end of a heap is free
    let mut blocks: Vec<Option<Box<[u8]>>> = (0..60_000_u32).map(|i| Some(vec![i as u8; 2048].into())).collect();
    blocks.iter_mut().enumerate().filter(|(i, _)| i % 100 != 0).for_each(|(_, block)| *block = None);
    let before = resident_bytes().unwrap();
    give_back_freed_memory();
    let after = resident_bytes().unwrap();
    assert!(after + (80 << 20) < before, "{before} to {after} bytes");
    assert!(blocks.iter().enumerate().step_by(100).all(|(i, block)| block.as_ref().is_some_and(|own| own[2047] == i as u8)));
}
