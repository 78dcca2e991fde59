//! Binary glTF files as tests look at them: their document, their numbers, and what the Khronos validator says of them.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A binary glTF file, taken apart.
#[derive(Clone, Debug)]
pub struct Glb {
    /// Its document.
    pub json: Value,
    /// Its buffer.
    pub bin: Vec<u8>,
}

impl Glb {
    /// Of a file's bytes.
    ///
    /// # Panics
    /// Where they are no such file.
    #[must_use]
    pub fn new(bytes: &[u8]) -> Self {
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
        let end = 20 + word(12);
        assert_eq!((&bytes[16..20], &bytes[end + 4..end + 8]), (&b"JSON"[..], &b"BIN\0"[..]));
        Self { json: serde_json::from_slice(&bytes[20..end]).unwrap(), bin: bytes[end + 8..].to_vec() }
    }

    /// A file on the disk.
    ///
    /// # Panics
    /// As [`Glb::new`], and where it cannot be read.
    #[must_use]
    pub fn read(path: &Path) -> Self {
        Self::new(&std::fs::read(path).unwrap())
    }

    /// The numbers of an accessor of floats that lie side by side, `N` of each element.
    ///
    /// # Panics
    /// Where there is no such accessor.
    #[must_use]
    pub fn floats<const N: usize>(&self, accessor: &Value) -> Vec<[f32; N]> {
        let (accessor, bytes) = self.elements(accessor);
        let kind = match N {
            1 => "SCALAR",
            2 => "VEC2",
            3 => "VEC3",
            _ => "VEC4",
        };
        assert_eq!((accessor["componentType"].as_u64(), accessor["type"].as_str()), (Some(5126), Some(kind)));
        let element = |bytes: &[u8]| std::array::from_fn(|i| f32::from_le_bytes(bytes[4 * i..4 * i + 4].try_into().unwrap()));
        let count = accessor["count"].as_u64().unwrap() as usize;
        bytes[..4 * N * count].chunks_exact(4 * N).map(element).collect()
    }

    /// The triangles of an accessor of indices.
    ///
    /// # Panics
    /// Where there is no such accessor.
    #[must_use]
    pub fn triangles(&self, accessor: &Value) -> Vec<[u32; 3]> {
        let (accessor, bytes) = self.elements(accessor);
        let count = accessor["count"].as_u64().unwrap() as usize;
        let indices: Vec<u32> = match accessor["componentType"].as_u64() {
            Some(5123) => bytes.as_chunks::<2>().0.iter().map(|two| u32::from(u16::from_le_bytes(*two))).collect(),
            Some(5125) => bytes.as_chunks::<4>().0.iter().map(|four| u32::from_le_bytes(*four)).collect(),
            other => panic!("indices of the type {other:?}"),
        };
        indices[..count].as_chunks::<3>().0.to_vec()
    }

    /// An accessor, and the bytes from its first element to the end of its view.
    fn elements(&self, accessor: &Value) -> (&Value, &[u8]) {
        let number = |value: &Value| value.as_u64().unwrap() as usize;
        let accessor = &self.json["accessors"][number(accessor)];
        let view = &self.json["bufferViews"][number(&accessor["bufferView"])];
        assert!(view["byteStride"].is_null(), "elements side by side");
        let offset = |value: &Value| value["byteOffset"].as_u64().unwrap_or(0) as usize;
        let (at, end) = (offset(view) + offset(accessor), offset(view) + number(&view["byteLength"]));
        (accessor, &self.bin[at..end])
    }
}

/// The Khronos validator's reports on files, or `None`, which it says, where it is not to be had: it needs node and npm, and a network the first time.
///
/// # Panics
/// Where it is not to be had and `HELIODON_REQUIRE_GLTF_VALIDATOR` is set, or where it says what is no report.
#[expect(clippy::print_stdout, reason = "a test that skips says so")]
#[must_use]
pub fn validate(files: &[PathBuf]) -> Option<Vec<Value>> {
    // of whoever runs the test, where it says so: checkouts that share a target folder share what this crate was compiled to
    let package =
        std::env::var_os("CARGO_MANIFEST_DIR").map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")), PathBuf::from);
    let script = package.join("../../scripts/validate_gltf/validate");
    let run = Command::new("bash").arg(script).args(files).output();
    let missing = match &run {
        Ok(output) if output.status.code() != Some(3) => None,
        Ok(output) => Some(String::from_utf8_lossy(&output.stderr).into_owned()),
        Err(error) => Some(format!("bash: {error}")),
    };
    if let Some(why) = missing {
        assert!(std::env::var_os("HELIODON_REQUIRE_GLTF_VALIDATOR").is_none(), "{why}");
        println!("skipped: {why}");
        return None;
    }
    let output = run.ok()?;
    let text = String::from_utf8_lossy(&output.stdout);
    Some(serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {text} {}", String::from_utf8_lossy(&output.stderr))))
}

/// Asserts that files are valid: no error, no warning, and no more to say than that what is there for other programs shows nothing in a plain viewer (texture
/// coordinates without a texture).
///
/// # Panics
/// Where one is not; where the validator is not to be had, as [`validate`].
pub fn assert_valid(files: &[PathBuf]) {
    let Some(reports) = validate(files) else { return };
    assert_eq!(reports.len(), files.len());
    for report in reports {
        let is_for_others = |message: &Value| {
            message["code"] == "UNUSED_OBJECT"
                && message["pointer"].as_str().is_some_and(|at| at.contains("/attributes/TEXCOORD_"))
        };
        assert!(report["messages"].as_array().unwrap().iter().all(is_for_others), "{report:#}");
    }
}
