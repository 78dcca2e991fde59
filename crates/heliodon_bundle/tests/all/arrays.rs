//! What numpy sees is what the bundle holds.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use crate::common::{MONO, RGB, chunks, write};
use heliodon_bundle::arrays::write_arrays;
use heliodon_bundle::{BundleReader, VertexAlbedo, WriterOptions, npy};
use std::fs;
use std::path::Path;

/// Type, shape and data of an array file.
fn load(folder: &Path, name: &str) -> (String, Vec<usize>, Vec<u8>) {
    let bytes = fs::read(folder.join(format!("{name}.npy"))).unwrap();
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let len = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    assert_eq!(len % 64, 0);
    let text = std::str::from_utf8(&bytes[10..len]).unwrap();
    assert!(text.ends_with('\n') && text.contains("'fortran_order': False"));
    let between = |a: &str, b: &str| text.split(a).nth(1).unwrap().split(b).next().unwrap().to_owned();
    let shape = between("'shape': (", ")").split(',').filter_map(|s| s.trim().parse().ok()).collect();
    (between("'descr': '", "'"), shape, bytes[len..].to_vec())
}

fn f32s(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
}

fn u32s(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes(b.try_into().unwrap())).collect()
}

#[test]
fn headers_are_those_that_numpy_writes() {
    // numpy.save of zeros((3,), "<f4"), to the byte
    let mut expected = b"\x93NUMPY\x01\x00\x76\x00{'descr': '<f4', 'fortran_order': False, 'shape': (3,), }".to_vec();
    expected.resize(127, b' ');
    expected.push(b'\n');
    assert_eq!(npy::header("<f4", &[3]), expected);
    assert_eq!(npy::header("<u4", &[4_000_000_000, 1_000_000, 3]).len() % 64, 0);
}

#[test]
fn arrays_hold_the_bundle() {
    for (layout, textured) in [(MONO, false), (RGB, true)] {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("bundle");
        write(&target, layout, textured, WriterOptions { max_glb_bytes: 40_000 });
        let reader = BundleReader::open(&target).unwrap();
        let out = folder.path().join("a/b");
        let report = write_arrays(&reader, &out, true).unwrap();
        let expected = chunks(layout, textured.then_some(0));
        let n: usize = expected.iter().map(|c| c.vertex_count()).sum();
        let m: usize = expected.iter().map(|c| c.triangles.len()).sum();
        assert_eq!((report.vertices, report.triangles), (n as u64, m as u64));
        let mut names: Vec<_> =
            fs::read_dir(&out).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        let mut told = report.files.clone();
        told.sort();
        assert_eq!(names, told);

        let concatenated =
            |of: &dyn Fn(&heliodon_bundle::LitChunk) -> Vec<f32>| expected.iter().flat_map(of).collect::<Vec<f32>>();
        let floats = |name: &str, shape: &[usize]| {
            let (kind, found, data) = load(&out, name);
            assert_eq!((kind.as_str(), found.as_slice()), ("<f4", shape), "{name}");
            f32s(&data)
        };
        assert_eq!(floats("positions", &[n, 3]), concatenated(&|c| c.positions.iter().flat_map(|v| v.to_array()).collect()));
        assert_eq!(floats("normals", &[n, 3]), concatenated(&|c| c.normals.iter().flat_map(|v| v.to_array()).collect()));
        let (c, words) = (layout.coefficients as usize, layout.mask_words());
        let shape: &[usize] = if layout.channels == 3 { &[n, c, 3] } else { &[n, c] };
        assert_eq!(floats("sky_transfer", shape), concatenated(&|c| c.light.sky_transfer.clone()));

        let (kind, shape, data) = load(&out, "sun_mask");
        assert_eq!((kind.as_str(), shape), ("<u4", vec![n, words]));
        assert_eq!(u32s(&data), expected.iter().flat_map(|c| c.light.sun_mask.clone()).collect::<Vec<_>>());
        let (kind, shape, data) = load(&out, "valid");
        assert_eq!((kind.as_str(), shape), ("|u1", vec![n]));
        assert_eq!(data, expected.iter().flat_map(|c| c.valid.clone()).collect::<Vec<_>>());
        assert!(data.contains(&0));
        let (kind, shape, data) = load(&out, "part");
        assert_eq!((kind.as_str(), shape), ("<u2", vec![n]));
        assert_eq!(u16::from_le_bytes([data[0], data[1]]), 0);
        assert_eq!(data[data.len() - 2..], [1, 0]);

        let (kind, shape, data) = load(&out, "triangles");
        assert_eq!((kind.as_str(), shape), ("<u4", vec![m, 3]));
        let first = expected[0].vertex_count() as u32;
        let at = expected[0].triangles.len() * 3;
        assert_eq!(u32s(&data)[at..at + 3], expected[1].triangles[0].map(|i| i + first));

        let mut albedo = VertexAlbedo::new(&reader);
        let all: Vec<f32> = (0..reader.chunk_count())
            .flat_map(|i| albedo.of(&reader.read_chunk(i).unwrap()).unwrap())
            .flat_map(|v| v.to_array())
            .collect();
        assert_eq!(floats("albedo", &[n, 3]), all);
        if textured {
            // a texel of sRGB (200, 100, 50) at the texture's middle
            let linear = heliodon_math::color::linear_from_srgb(200.0 / 255.0);
            assert!(all.iter().any(|&a| (a - linear).abs() < 1e-3));
        }

        let t = layout.sun_steps as usize;
        let bounced = floats("sun_bounce", &[t, n, 3]);
        let basis = reader.lapse().sun_bounce_basis.clone().unwrap();
        let (step, vertex) = (t - 2, expected[0].vertex_count() + 3);
        let own = &expected[1].light.sun_bounce[3 * layout.bounce_floats()..];
        for c in 0..3 {
            let ch = layout.channels as usize;
            let sum: f32 = (0..basis.functions.len()).map(|r| own[r * ch + c % ch] * basis.functions[r][step]).sum();
            assert!((bounced[(step * n + vertex) * 3 + c] - sum.max(0.0)).abs() < 1e-6);
        }
        assert_eq!(fs::read(out.join("lapse.json")).unwrap(), fs::read(target.join("lapse.json")).unwrap());
        let without = write_arrays(&reader, &folder.path().join("c"), false).unwrap();
        assert!(!without.files.contains(&"sun_bounce.npy".to_owned()));
    }
}

#[test]
fn a_damaged_bundle_gives_no_arrays() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    write(&target, MONO, false, WriterOptions::default());
    let reader = BundleReader::open(&target).unwrap();
    let mut bytes = fs::read(target.join("site.glb")).unwrap();
    let end = bytes.len();
    bytes[end - 400..].fill(0xFF);
    fs::write(target.join("site.glb"), bytes).unwrap();
    let out = folder.path().join("out");
    assert!(write_arrays(&reader, &out, true).is_err());
    assert_eq!(fs::read_dir(&out).unwrap().count(), 0, "no junk");
}
