//! Light in texels goes into a bundle and comes out of it.

mod common;

use common::{MONO, chunk, lapse, meta};
use glam::Vec2;
use heliodon_bundle::layout::TEXEL_FORMAT_VERSION;
use heliodon_bundle::texels::{float_texture, sun_texture};
use heliodon_bundle::{BundleReader, BundleWriter, LightLayout, LitChunk, TexelInfo, TexelLight};

const INFO: TexelInfo = TexelInfo { width: 8, height: 8, per_m: 20.0, utilisation: 0.75, texels: 50 };

fn light(layout: LightLayout) -> TexelLight {
    let (words, floats, bounced) = (layout.mask_words(), layout.transfer_floats(), layout.bounce_floats());
    let masks: Vec<Vec<u32>> = [64, 16, 4].map(|texels| (0..texels * words).map(|i| i as u32).collect()).into();
    let level = |texels: usize| (0..texels * floats).map(|i| i as f32 / 512.0).collect();
    let (side, levels): (u32, Vec<Vec<f32>>) =
        if layout.channels == 3 { (4, [16, 4].map(level).into()) } else { (8, [64, 16, 4].map(level).into()) };
    TexelLight {
        sun: sun_texture(layout, [8, 8], &masks),
        sky: float_texture([side; 2], floats, &levels),
        bounce: (bounced > 0).then(|| float_texture([2, 2], bounced, &[vec![0.25; 4 * bounced]])),
    }
}

fn lit_by_texels(layout: LightLayout) -> LitChunk {
    let mut chunk = chunk(layout, 0, None, 4, 0.0);
    chunk.texel_uvs = (0..chunk.vertex_count()).map(|i| Vec2::new(i as f32 / 64.0, 0.5)).collect();
    chunk
}

#[test]
fn light_in_texels_reads_back() {
    for layout in [MONO, LightLayout { sun_steps: 130, coefficients: 9, channels: 3, sun_bounce_functions: 5 }] {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("bundle");
        let mut writer = BundleWriter::create(&target, meta(layout)).unwrap();
        assert!(writer.push_chunk(&lit_by_texels(layout)).unwrap_err().to_string().contains("none were added"));
        writer.add_texels(&light(layout), INFO).unwrap();
        assert!(writer.add_texels(&light(layout), INFO).unwrap_err().to_string().contains("already"));
        writer.push_chunk(&lit_by_texels(layout)).unwrap();
        writer.push_chunk(&chunk(layout, 1, None, 4, 0.0)).unwrap();
        for path in ["sky/0000.hdr", "sky/0001.hdr"] {
            writer.add_sky_map(path, b"unread").unwrap();
        }
        let manifest = writer.finish(&lapse(layout)).unwrap();
        assert_eq!((manifest.version, manifest.texels.as_ref()), (TEXEL_FORMAT_VERSION, Some(&INFO)));
        let reader = BundleReader::open(&target).unwrap();
        assert_eq!(reader.read_texels().unwrap().unwrap(), light(layout));
        assert_eq!(reader.read_chunk(0).unwrap().texel_uvs, lit_by_texels(layout).texel_uvs);
        assert!(reader.read_chunk(1).unwrap().texel_uvs.is_empty());
        reader.verify().unwrap();

        let path = target.join("texels/sky.ktx2");
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 9]).unwrap();
        assert!(BundleReader::open(&target).unwrap().read_texels().unwrap_err().to_string().contains("sky.ktx2"));
    }
}

#[test]
fn textures_of_another_layout_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = BundleWriter::create(folder.path().join("bundle"), meta(MONO)).unwrap();
    let other = light(LightLayout { coefficients: 9, ..MONO });
    assert!(writer.add_texels(&other, INFO).unwrap_err().to_string().contains("sky is"));
    let mut chunk = lit_by_texels(MONO);
    chunk.texel_uvs[3].x = 1.5;
    assert!(writer.push_chunk(&chunk).unwrap_err().to_string().contains("atlas"));
}
