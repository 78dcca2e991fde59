//! What is written is what is read.

use crate::common;
use crate::common::{MONO, RGB, chunks, lapse, meta, write};
use glam::{Vec2, Vec3};
use heliodon_bundle::export::{ExportOptions, export_lit};
use heliodon_bundle::{BundleReader, BundleWriter, LightLayout, LitChunk, VertexAlbedo, WriterOptions};
use heliodon_image::TextureWrap;

fn rounded(chunk: &LitChunk) -> LitChunk {
    let code = |c: f32| f32::from((c * 65_535.0 + 0.5) as u16) / 65_535.0;
    let mut chunk = chunk.clone();
    chunk.albedo.iter_mut().for_each(|a| *a = Vec3::new(code(a.x), code(a.y), code(a.z)));
    chunk
}

#[test]
fn every_layout_and_file_split_reads_back() {
    let folder = tempfile::tempdir().unwrap();
    let mut layouts = vec![MONO, RGB];
    for sun_steps in [1, 31, 32, 33, 64, 65, 1024] {
        for (coefficients, channels, sun_bounce_functions) in [(4, 1, 0), (4, 3, 8), (9, 1, 1), (9, 3, 0)] {
            layouts.push(LightLayout { sun_steps, coefficients, channels, sun_bounce_functions });
        }
    }
    for (i, layout) in layouts.into_iter().enumerate() {
        let textured = i % 2 == 0;
        for max_glb_bytes in [2 << 30, 1] {
            let target = folder.path().join("bundle");
            let manifest = write(&target, layout, textured, WriterOptions { max_glb_bytes });
            let reader = BundleReader::open(&target).unwrap();
            assert_eq!(*reader.manifest(), manifest);
            assert_eq!(manifest.geometry.len(), if max_glb_bytes == 1 { 4 } else { 1 });
            assert_eq!(*reader.lapse(), lapse(layout));
            let expected = chunks(layout, textured.then_some(0));
            assert_eq!(reader.chunk_count(), expected.len());
            for (i, chunk) in expected.iter().enumerate() {
                let info = reader.chunk_info(i);
                assert_eq!((info.part, info.texture), (chunk.part, chunk.texture));
                assert_eq!((info.vertices as usize, info.triangles as usize), (chunk.vertex_count(), chunk.triangles.len()));
                assert_eq!(reader.read_chunk(i).unwrap(), rounded(chunk));
            }
            if textured {
                assert_eq!(reader.texture_bytes(0).unwrap(), common::texture_png());
            }
            reader.verify().unwrap();
            assert!(reader.sky_map_path(1).is_file());
        }
    }
}

#[test]
fn textures_go_on_as_they_did() {
    use TextureWrap::{Clamp, Mirror, Repeat};
    let wraps = [[Repeat, Repeat], [Clamp, Clamp], [Mirror, Clamp], [Repeat, Repeat], [Clamp, Mirror]];
    let folder = tempfile::tempdir().unwrap();
    for max_glb_bytes in [2 << 30, 1] {
        let target = folder.path().join("bundle");
        let mut writer = BundleWriter::create_with(&target, meta(MONO), WriterOptions { max_glb_bytes }).unwrap();
        for (index, wrap) in wraps.into_iter().enumerate() {
            let texture = writer.add_texture_wrapped(&format!("{index}.png"), &common::texture_png(), wrap).unwrap();
            let mut chunk = common::chunk(MONO, 0, Some(texture), 4, 0.0);
            // beyond the image, in its second texel from the right: repeated it is the second from the left
            chunk.uvs.fill(Vec2::new(1.375, 0.25));
            writer.push_chunk(&chunk).unwrap();
        }
        for path in ["sky/0000.hdr", "sky/0001.hdr"] {
            writer.add_sky_map(path, b"unread").unwrap();
        }
        writer.finish(&lapse(MONO)).unwrap();
        let reader = BundleReader::open(&target).unwrap();
        assert_eq!((0..wraps.len()).map(|texture| reader.texture_wrap(texture)).collect::<Vec<_>>(), wraps);
        // the image's last pixel in its upper row is dark, all others are bright
        let mut albedo = VertexAlbedo::new(&reader);
        let dark: Vec<bool> = (0..wraps.len()).map(|i| albedo.of(&reader.read_chunk(i).unwrap()).unwrap()[0].x < 0.1).collect();
        assert_eq!(dark, [false, true, false, false, true]);

        let lit = folder.path().join("lit.glb");
        export_lit(&reader, "07:00".parse().unwrap(), &ExportOptions::default(), &lit).unwrap();
        let file = std::fs::read(&lit).unwrap();
        let length = u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
        let json: serde_json::Value = serde_json::from_slice(&file[20..20 + length]).unwrap();
        let samplers: Vec<(u64, u64)> = json["samplers"]
            .as_array()
            .unwrap()
            .iter()
            .map(|sampler| (sampler["wrapS"].as_u64().unwrap(), sampler["wrapT"].as_u64().unwrap()))
            .collect();
        assert_eq!(samplers, [(10497, 10497), (33071, 33071), (33648, 33071), (33071, 33648)], "one for each way");
    }
}

#[test]
fn a_chunk_of_the_largest_size_reads_back() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("large");
    let mut chunk = common::chunk(MONO, 0, None, 30_000, 0.0);
    assert!(chunk.validate().is_err(), "59,998 triangles are too many");
    chunk.triangles.truncate(20_000);
    let mut writer = BundleWriter::create(&target, meta(MONO)).unwrap();
    writer.push_chunk(&chunk).unwrap();
    for path in ["sky/0000.hdr", "sky/0001.hdr"] {
        writer.add_sky_map(path, b"unread").unwrap();
    }
    writer.finish(&lapse(MONO)).unwrap();
    assert_eq!(BundleReader::open(&target).unwrap().read_chunk(0).unwrap(), rounded(&chunk));
}

#[test]
fn the_same_input_makes_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (folder.path().join("a"), folder.path().join("b"));
    let options = WriterOptions { max_glb_bytes: 6000 };
    write(&a, RGB, true, options);
    write(&b, RGB, true, options);
    let manifest = std::fs::read(a.join("manifest.json")).unwrap();
    assert_eq!(manifest, std::fs::read(b.join("manifest.json")).unwrap());
    BundleReader::open(&b).unwrap().verify().unwrap();
}
