//! The frozen bundle with one of its files replaced by anything. Seed the corpus with that file and a byte in front: 0 manifest, 1 lapse, 2 geometry.
#![no_main]

use heliodon_bundle::BundleReader;
use libfuzzer_sys::fuzz_target;
use std::path::Path;

const FILES: [&str; 4] = ["manifest.json", "lapse.json", "site.glb", "site-1.glb"];

fuzz_target!(|input: (u8, &[u8])| {
    let frozen = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/frozen/v1");
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (i, name) in FILES.iter().enumerate() {
        let target = folder.path().join(name);
        if i == usize::from(input.0) % FILES.len() {
            std::fs::write(target, input.1).expect("a temporary file");
        } else {
            std::fs::copy(frozen.join(name), target).expect("the frozen file");
        }
    }
    if let Ok(reader) = BundleReader::open(folder.path()) {
        for chunk in 0..reader.chunk_count() {
            if let Ok(chunk) = reader.read_chunk(chunk) {
                chunk.validate().expect("what is read is valid");
            }
        }
    }
});
