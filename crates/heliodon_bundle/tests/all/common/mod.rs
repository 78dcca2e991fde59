//! A small bundle that has everything a bundle can have, its numbers from a fixed seed.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::{Vec2, Vec3};
use heliodon_bundle::manifest::Manifest;
use heliodon_bundle::site::{Actor, Detail, DetailPattern, Matte, Role, Site, Weathering};
use heliodon_bundle::texels::{float_texture, sun_texture, weathering_texture};
use heliodon_bundle::{
    ActorFile, ActorMeta, BundleMeta, BundleWriter, GridPoints, LightLayout, LitChunk, PartMeta, StoredFile, TexelInfo,
    TexelLight, VertexLight, WriterOptions,
};
use heliodon_image::detail::DetailTexture;
use heliodon_image::ktx2::Ktx2;
use heliodon_image::{HdrImage, SrgbImage};
use heliodon_math::frame::unit_or;
use heliodon_math::random::Pcg32;
use heliodon_sky::lapse::{Lapse, LapseStep, Sun, SunBounceBasis};
use std::path::Path;

pub const MONO: LightLayout = LightLayout { sun_steps: 5, coefficients: 4, channels: 1, sun_bounce_functions: 2 };
pub const RGB: LightLayout = LightLayout { sun_steps: 300, coefficients: 9, channels: 3, sun_bounce_functions: 3 };

pub fn site() -> Site {
    let text = r#"
        [site]
        name = "Sample"
        latitude_deg = 37.9715
        utc_offset = "+02:00"
        [[part]]
        file = "column.ply"
        role = "scan"
        [[part]]
        file = "ground.ply"
        role = "ground"
        [sky]
        probes = "sky/*.hdr"
        mapping = "lat-long"
        [[room]]
        name = "in front"
        min = [-1, 1, 3]
        max = [1, 2, 5]
    "#;
    Site::parse(text, "site/site.toml").unwrap()
}

pub fn meta(layout: LightLayout) -> BundleMeta {
    let mut meta = BundleMeta::from_site(&site(), layout, 0.001);
    meta.tool = "heliodon frozen".to_owned();
    meta.inputs = vec![StoredFile { path: "column.ply".to_owned(), bytes: 3, blake3: "00".repeat(32) }];
    meta.measures.insert("sun_bounce_relative_error".to_owned(), 0.0125);
    assert_eq!(meta.parts[1], PartMeta { name: "ground".to_owned(), role: Role::Ground });
    meta
}

/// A bumpy strip of `columns` by 2 vertices, moved by `shift`.
pub fn chunk(layout: LightLayout, part: u16, texture: Option<u32>, columns: u32, shift: f32) -> LitChunk {
    let mut random = Pcg32::new(7, u64::from(part) * 31 + u64::from(columns));
    let n = 2 * columns as usize;
    let mut next = |low: f32, high: f32| low + (high - low) * random.next_f32();
    let positions: Vec<Vec3> =
        (0..n).map(|i| Vec3::new(shift + (i / 2) as f32 * 0.1, next(0.0, 0.02), (i % 2) as f32 * 0.1)).collect();
    let normals = (0..n).map(|_| unit_or(Vec3::new(next(-0.2, 0.2), 1.0, next(-0.2, 0.2)), Vec3::Y)).collect();
    let uvs = positions.iter().map(|p| Vec2::new(p.x, p.z)).filter(|_| texture.is_some()).collect();
    let albedo = (0..n).map(|i| if texture.is_some() { Vec3::ONE } else { Vec3::splat((i % 11) as f32 / 10.0) }).collect();
    let triangles = (0..columns - 1).flat_map(|c| [[2 * c, 2 * c + 1, 2 * c + 2], [2 * c + 1, 2 * c + 3, 2 * c + 2]]).collect();
    let mut light = VertexLight::zeros(layout, n);
    let words = layout.mask_words();
    for (i, word) in light.sun_mask.iter_mut().enumerate() {
        let used = (layout.sun_steps as usize - 32 * (i % words)).min(32);
        *word = ((next(0.0, 1.0) * 4.0e9) as u32) & (u32::MAX >> (32 - used));
    }
    light.sky_transfer.iter_mut().for_each(|v| *v = next(-0.2, 1.0));
    light.sun_bounce.iter_mut().for_each(|v| *v = next(-0.1, 0.3));
    let valid = (0..n).map(|i| u8::from(part != 0 || i % 5 != 3)).collect();
    LitChunk { part, texture, detail: None, positions, normals, uvs, texel_uvs: Vec::new(), albedo, triangles, valid, light }
}

/// Two sky entries for each sun step, ten minutes apart from 06:57 on, the last without a sun.
pub fn lapse(layout: LightLayout) -> Lapse {
    let count = (2 * layout.sun_steps).min(24);
    let mut random = Pcg32::new(11, 3);
    let mut color = |scale: f32| [scale * random.next_f32(), scale * random.next_f32(), scale * random.next_f32()];
    let steps = (0..count).map(|i| {
        let minutes = 6 * 60 + 57 + 10 * i;
        let mask_bit = i * layout.sun_steps / count;
        let direction = unit_or(Vec3::new(1.0 - 0.3 * mask_bit as f32, 0.4, 0.3), Vec3::Y);
        let mut step = blank_step();
        step.time = format!("{:02}:{:02}", minutes / 60, minutes % 60);
        step.sun = (i + 2 < count).then(|| Sun { direction: direction.to_array(), irradiance: color(9.0), clipped: i == 0 });
        step.sky = (0..layout.coefficients).map(|_| color(2.0)).collect();
        step.exposure_stops = 0.25 * i as f32 - 1.0;
        step.sky_map = format!("sky/{:04}.hdr", i % 2);
        step.mask_bit = mask_bit;
        step
    });
    let steps = steps.collect();
    let functions = (0..layout.sun_bounce_functions)
        .map(|r| (0..layout.sun_steps).map(|t| ((r + 1) * (t + 2) % 7) as f32 * 0.25 - 0.5).collect())
        .collect();
    let basis = SunBounceBasis { channels: layout.channels, functions };
    Lapse { steps, sun_bounce_basis: (layout.sun_bounce_functions > 0).then_some(basis) }
}

fn blank_step() -> LapseStep {
    serde_json::from_str(r#"{"time":"00:00","sun":null,"sky":[],"exposure_stops":0,"sky_map":"","mask_bit":0}"#).unwrap()
}

pub fn texture_png() -> Vec<u8> {
    let mut image = SrgbImage::filled(4, 2, [200, 100, 50, 255]);
    image.pixels[3] = [10, 20, 30, 255];
    image.to_png_bytes().unwrap()
}

/// Writes a bundle of two parts, the second textured where `textured`.
pub fn write(target: &Path, layout: LightLayout, textured: bool, options: WriterOptions) -> Manifest {
    let mut writer = BundleWriter::create_with(target, meta(layout), options).unwrap();
    let texture = textured.then(|| writer.add_texture("ground.png", &texture_png()).unwrap());
    for chunk in chunks(layout, texture) {
        writer.push_chunk(&chunk).unwrap();
    }
    for i in 0..2 {
        let map = HdrImage::from_fn(4, 2, |x, y| Vec3::new(x as f32, y as f32, i as f32) * 0.5 + 0.1);
        writer.add_sky_map(&format!("sky/{i:04}.hdr"), &map.to_hdr_bytes()).unwrap();
    }
    writer.finish(&lapse(layout)).unwrap()
}

pub fn chunks(layout: LightLayout, texture: Option<u32>) -> Vec<LitChunk> {
    vec![
        chunk(layout, 0, None, 5, 0.0),
        chunk(layout, 0, None, 8, 0.4),
        chunk(layout, 1, texture, 4, -1.0),
        chunk(layout, 1, None, 3, -0.7),
    ]
}

/// A lattice of 4 x 3 x 2 points without one corner, its numbers from a fixed seed; every fifth point is not valid.
pub fn grid(layout: LightLayout) -> GridPoints {
    let mut random = Pcg32::new(5, 9);
    let all = (0..24).map(|i| [i / 6, i / 2 % 3, i % 2]);
    let cells: Vec<[u32; 3]> = all.filter(|cell| *cell != [0, 2, 1]).collect();
    let words = layout.mask_words();
    let mut light = VertexLight::zeros(layout, 6 * cells.len());
    for six in light.sun_mask.chunks_exact_mut(6 * words) {
        for (i, word) in six[..words].iter_mut().enumerate() {
            let used = (layout.sun_steps as usize - 32 * i).min(32);
            *word = random.next_u32() & (u32::MAX >> (32 - used));
        }
        let (own, others) = six.split_at_mut(words);
        others.chunks_exact_mut(words).for_each(|other| other.copy_from_slice(own));
    }
    light.sky_transfer.iter_mut().for_each(|t| *t = random.next_f32() - 0.25);
    light.sun_bounce.iter_mut().for_each(|b| *b = 0.5 * random.next_f32());
    let valid = (0..cells.len()).map(|i| u8::from(i % 5 != 4)).collect();
    GridPoints { origin: [-1.25, 0.125, 2.5], spacing_m: 0.5, cells, valid, light }
}

/// Writes a bundle that has a grid and an actor of two files, which `files` is to hold.
pub fn write_moving(target: &Path, layout: LightLayout, files: &Path) -> Manifest {
    std::fs::create_dir_all(files).unwrap();
    for (name, bytes) in [("walker.glb", "a model"), ("skin.png", "its skin")] {
        std::fs::write(files.join(name), bytes).unwrap();
    }
    let mut writer = BundleWriter::create(target, meta(layout)).unwrap();
    for chunk in chunks(layout, None) {
        writer.push_chunk(&chunk).unwrap();
    }
    writer.add_grid(&grid(layout)).unwrap();
    writer.add_actor(&actor(files)).unwrap();
    for i in 0..2 {
        writer
            .add_sky_map(&format!("sky/{i:04}.hdr"), b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x80\x80\x81")
            .unwrap();
    }
    writer.finish(&lapse(layout)).unwrap()
}

pub const TEXELS: TexelInfo = TexelInfo { width: 8, height: 8, per_m: 20.0, utilisation: 0.75, texels: 50 };

/// The light of an atlas of 8 x 8 texels, of numbers that are exact in every representation.
pub fn texel_light(layout: LightLayout) -> TexelLight {
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

pub fn lit_by_texels(layout: LightLayout) -> LitChunk {
    let mut chunk = chunk(layout, 0, None, 4, 0.0);
    chunk.texel_uvs = (0..chunk.vertex_count()).map(|i| Vec2::new(i as f32 / 64.0, 0.5)).collect();
    chunk
}

/// Weathering of that atlas.
pub fn texel_weathering() -> Ktx2 {
    weathering_texture([4, 4], &[16, 4].map(|texels| (0..texels).map(|i| [0.0, 0.25, 0.5, i as f32 / 16.0]).collect()))
}

/// Writes a bundle that has light and weathering in texels, and a matte; with a `detail` of the second part also that.
pub fn write_texels(target: &Path, layout: LightLayout, detail: Option<&DetailTexture>) -> Manifest {
    let mut meta = meta(layout);
    meta.parameters.bake.texels = Some(8);
    meta.parameters.weathering = Some(Weathering { dust: 0.5, ..Weathering::default() });
    meta.mattes = vec![Matte::new([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 2.0, 1.0]])];
    let mut writer = BundleWriter::create(target, meta).unwrap();
    writer.add_texels(&texel_light(layout), TEXELS).unwrap();
    writer.add_texel_weathering(&texel_weathering()).unwrap();
    if let Some(texture) = detail {
        writer.add_detail(1, texture, &Detail::of_kind(DetailPattern::Stone)).unwrap();
    }
    writer.push_chunk(&lit_by_texels(layout)).unwrap();
    writer.push_chunk(&chunk(layout, 1, None, 4, 0.0)).unwrap();
    for i in 0..2 {
        writer
            .add_sky_map(&format!("sky/{i:04}.hdr"), b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x80\x80\x81")
            .unwrap();
    }
    writer.finish(&lapse(layout)).unwrap()
}

pub fn actor(files: &Path) -> ActorMeta {
    let path = Some(vec![[0.0, 0.0, 3.0], [2.0, 0.5, 3.0]]);
    let file = |source: &str, name: &str| ActorFile { source: files.join(source), name: name.to_owned() };
    ActorMeta {
        actor: Actor { path, place: None, animation: Some("walk".to_owned()), ..Actor::at("walker.glb", [0.0; 3]) },
        files: vec![file("walker.glb", "walker.glb"), file("skin.png", "maps/skin.png")],
    }
}
