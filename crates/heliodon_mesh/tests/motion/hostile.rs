//! Damaged files: no panic, and poses that keep their promises.

use crate::glb::{arm, float_weights, morphing, objects};
use heliodon_mesh::import::{Format, ImportOptions, ImportReport};
use heliodon_mesh::motion::{from_bytes, pc2};
use proptest::prelude::*;
use std::path::Path;

fn read(bytes: &[u8]) -> bool {
    match from_bytes(bytes, Format::Gltf, Path::new("hostile.glb"), &ImportOptions::default(), &mut ImportReport::default()) {
        Ok(moving) => {
            moving.validate().unwrap();
            for clip in 0..moving.clips().len() {
                assert_eq!(moving.rigid_at(clip, 0.3).is_some(), moving.rigid(clip));
            }
            true
        }
        Err(error) => {
            assert!(!error.problem().is_empty() && !error.remedy().is_empty());
            false
        }
    }
}

fn good() -> [Vec<u8>; 4] {
    [arm(float_weights), objects(), morphing(true), morphing(false)]
}

#[test]
fn files_cut_off_anywhere_do_no_harm() {
    for bytes in good() {
        for length in (0..bytes.len()).step_by(3) {
            assert!(!read(&bytes[..length]));
        }
    }
}

#[test]
fn every_byte_of_an_arm_s_data_may_be_anything() {
    let bytes = arm(float_weights);
    let json = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let mut read_anyway = 0;
    for at in 28 + json..bytes.len() {
        for value in [0, 0x7f, 0x80, 0xff] {
            let mut bytes = bytes.clone();
            bytes[at] = value;
            read_anyway += u32::from(read(&bytes));
        }
    }
    assert!(read_anyway > 0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn damaged_files_do_no_harm(
        which in any::<prop::sample::Index>(),
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0_u8..4), 1..6),
    ) {
        let mut bytes = which.get(&good()).clone();
        for (place, value, how) in damage {
            let at = place.index(bytes.len());
            match how {
                0 => bytes[at] = value,
                1 => bytes[at] ^= 1 << (value % 8),
                2 => bytes.insert(at, value),
                _ => { bytes.remove(at); }
            }
        }
        read(&bytes);
    }

    #[test]
    fn digits_changed_in_documents_do_no_harm(
        which in any::<prop::sample::Index>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), prop::sample::select(vec!["-", "0", "7", "9", "2e3", "1e99", "4294967295", "[", ""])), 1..4),
    ) {
        let mut bytes = which.get(&good()).clone();
        let mut json = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        for (place, value) in changes {
            let digits: Vec<usize> = (20..20 + json).filter(|&i| bytes[i].is_ascii_digit()).collect();
            let at = *place.get(&digits);
            bytes.splice(at..=at, value.bytes());
            json = json + value.len() - 1;
        }
        bytes[12..16].copy_from_slice(&(json as u32).to_le_bytes());
        let length = bytes.len() as u32;
        bytes[8..12].copy_from_slice(&length.to_le_bytes());
        read(&bytes);
    }

    #[test]
    fn caches_of_any_bytes_do_no_harm(head in prop::collection::vec(any::<u8>(), 20), tail in prop::collection::vec(any::<u8>(), 0..100)) {
        let bytes = [&b"POINTCACHE2\0"[..], &head, &tail].concat();
        let _ = pc2::from_bytes(&bytes, Path::new("hostile.pc2"));
        let header = [&b"POINTCACHE2\0\x01\0\0\0"[..], &[head[0] % 3, 0, 0, 0], &head[8..12], &1_f32.to_le_bytes(), &[head[1] % 3, 0, 0, 0], &tail].concat();
        if let Ok(cache) = pc2::from_bytes(&header, Path::new("hostile.pc2")) {
            cache.validate().unwrap();
        }
    }
}
