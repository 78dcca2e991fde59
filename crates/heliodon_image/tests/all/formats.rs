//! Files of every kind: what is written comes back, what others write is understood, what is broken is refused.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

use glam::Vec3;
use heliodon_image::{ExrSamples, HdrImage, ImageError, SrgbImage, TextureWrap};
use proptest::prelude::*;

fn ramp(width: u32, height: u32) -> HdrImage {
    HdrImage::from_fn(width, height, |x, y| {
        Vec3::new(x as f32 * 0.25, 1.0 + y as f32, if x % 9 < 5 { 1e4 } else { 1e-3 * (x + y) as f32 })
    })
}

fn hdr(header: &str, pixels: &[u8]) -> Vec<u8> {
    let mut bytes = header.as_bytes().to_vec();
    bytes.extend(pixels);
    bytes
}

#[test]
fn radiance_pictures_come_back_within_their_precision() {
    // 5: below the run-length form; 300: several runs and literals
    for (width, height) in [(5, 3), (8, 2), (300, 7), (1, 1)] {
        let image = ramp(width, height);
        let back = HdrImage::from_bytes(&image.to_hdr_bytes(), "ramp.hdr").unwrap();
        assert_eq!((back.width, back.height), (width, height));
        for (a, b) in image.pixels.iter().zip(&back.pixels) {
            assert!((*a - *b).abs().max_element() <= a.max_element() / 256.0, "{a} {b}");
        }
    }
    let one = HdrImage::filled(64, 32, Vec3::ONE);
    assert_eq!(HdrImage::from_bytes(&one.to_hdr_bytes(), "one.hdr").unwrap(), one);
    let runs = HdrImage::filled(300, 8, Vec3::ONE).to_hdr_bytes().len();
    assert!(runs < 300, "a constant picture packs: {runs} bytes");
}

#[test]
fn old_run_lengths_repeat_the_last_pixel() {
    let header = "#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 300\n";
    // one pixel, then 256 * 1 + 43 = 299 more of it: counts follow low byte first
    let image = HdrImage::from_bytes(&hdr(header, &[128, 64, 0, 129, 1, 1, 1, 43, 1, 1, 1, 1]), "old.hdr").unwrap();
    assert_eq!(image.pixels, vec![Vec3::new(1.0, 0.5, 0.0); 300]);
}

#[test]
fn all_eight_orientations_show_the_same_picture() {
    // a picture of 2 x 3 whose red is 1..6 in rows from the top left
    let red = |x: u8, y: u8| 1 + x + 2 * y;
    for (line, fast_is_x) in [
        ("-Y 3 +X 2", true),
        ("-Y 3 -X 2", true),
        ("+Y 3 +X 2", true),
        ("+Y 3 -X 2", true),
        ("+X 2 -Y 3", false),
        ("-X 2 -Y 3", false),
        ("+X 2 +Y 3", false),
        ("-X 2 +Y 3", false),
    ] {
        let mut pixels = Vec::new();
        let order = |sign: &str, count: u8, forward: bool| -> Vec<u8> {
            if line.contains(sign) == forward { (0..count).collect() } else { (0..count).rev().collect() }
        };
        let (xs, ys) = (order("+X", 2, true), order("-Y", 3, true));
        if fast_is_x {
            ys.iter().for_each(|&y| xs.iter().for_each(|&x| pixels.extend([red(x, y), 0, 0, 136])));
        } else {
            xs.iter().for_each(|&x| ys.iter().for_each(|&y| pixels.extend([red(x, y), 0, 0, 136])));
        }
        let header = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{line}\n");
        let image = HdrImage::from_bytes(&hdr(&header, &pixels), line).unwrap();
        assert_eq!((image.width, image.height), (2, 3), "{line}");
        let got: Vec<f32> = image.pixels.iter().map(|p| p.x).collect();
        assert_eq!(got, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], "{line}");
    }
}

#[test]
fn exposure_and_colour_correction_are_taken_out() {
    let header = "#?RADIANCE\n# a comment = nothing\nPRIMARIES=0 0 0 0 0 0 0 0\nEXPOSURE= 2.0\nEXPOSURE=2\nCOLORCORR=1 2 4\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n";
    let image = HdrImage::from_bytes(&hdr(header, &[128, 128, 128, 131]), "x.hdr").unwrap();
    assert_eq!(image.pixels, vec![Vec3::new(1.0, 0.5, 0.25)]);
}

#[test]
fn xyze_white_is_white() {
    let header = "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n";
    let image = HdrImage::from_bytes(&hdr(header, &[128, 128, 128, 129]), "x.hdr").unwrap();
    assert!((image.pixels[0] - Vec3::ONE).abs().max_element() < 1e-3, "{}", image.pixels[0]);
}

#[test]
fn broken_radiance_pictures_say_where() {
    let whole = ramp(40, 6).to_hdr_bytes();
    let cut = HdrImage::from_bytes(&whole[..whole.len() - 10], "cut.hdr").unwrap_err().to_string();
    assert!(cut.contains("cut.hdr") && cut.contains("scanline 6 of 6") && cut.contains("again"), "{cut}");
    for (header, pixels, says) in [
        ("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n", &[][..], "no end"),
        ("#?RADIANCE\nFORMAT=jpeg\n\n-Y 1 +X 1\n", &[], "unknown format"),
        ("#?RADIANCE\nEXPOSURE=0\n\n-Y 1 +X 1\n", &[], "EXPOSURE"),
        ("#?RADIANCE\n\n-Y 1 +Y 1\n", &[], "no image size"),
        ("#?RADIANCE\n\n-Y 0 +X 1\n", &[], "0 pixels"),
        ("#?RADIANCE\n\n-Y 4294967295 +X 4294967295\n", &[], "at most 65536"),
        ("#?RADIANCE\n\n-Y 65536 +X 65536\n", &[], "more than"),
        ("#?RADIANCE\n\n-Y 1 +X 9\n", &[2, 2, 0, 8, 137, 0], "not the image's width"),
        ("#?RADIANCE\n\n-Y 1 +X 8\n", &[2, 2, 0, 8, 137, 0], "beyond"),
        ("#?RADIANCE\n\n-Y 1 +X 3\n", &[1, 1, 1, 3], "before any pixel"),
        ("#?RADIANCE\n\n-Y 1 +X 3\n", &[9, 9, 9, 9, 1, 1, 1, 3], "beyond"),
    ] {
        let message = HdrImage::from_bytes(&hdr(header, pixels), "b.hdr").unwrap_err().to_string();
        assert!(message.starts_with("b.hdr: ") && message.contains(says), "{message}");
    }
}

#[test]
fn openexr_comes_back_exactly_as_float_and_closely_as_half() {
    let dir = tempfile::tempdir().unwrap();
    let image = ramp(37, 21);
    let path = dir.path().join("a.exr");
    image.write_exr(&path).unwrap();
    assert_eq!(HdrImage::read(&path).unwrap(), image);
    image.write_exr_as(&path, ExrSamples::Half).unwrap();
    for (a, b) in image.pixels.iter().zip(&HdrImage::read(&path).unwrap().pixels) {
        assert!((*a - *b).abs().max_element() <= a.max_element() / 1024.0);
    }
}

#[test]
fn openexr_of_tiles_layers_and_luminance_is_read() {
    use exr::prelude::*;
    let bytes_of = |names: [&'static str; 3], blocks: Blocks, compression: Compression| {
        let plane = |k: usize| FlatSamples::F32((0..40 * 30).map(|i| (i * (k + 1)) as f32).collect());
        let list = names.iter().enumerate().map(|(k, &name)| AnyChannel::new(name, plane(k))).collect();
        let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
        let layer = Layer::new((40, 30), LayerAttributes::default(), encoding, AnyChannels::sort(list));
        let mut out = std::io::Cursor::new(Vec::new());
        Image::from_layer(layer).write().to_buffered(&mut out).unwrap();
        out.into_inner()
    };
    let tiles = bytes_of(["R", "G", "B"], Blocks::Tiles(Vec2(16, 16)), Compression::PIZ);
    let image = HdrImage::from_bytes(&tiles, "tiles.exr").unwrap();
    assert_eq!(image.pixel(39, 29), Vec3::new(1199.0, 2398.0, 3597.0));
    let layered = bytes_of(["Combined.R", "Combined.G", "Combined.B"], Blocks::ScanLines, Compression::RLE);
    assert_eq!(HdrImage::from_bytes(&layered, "layer.exr").unwrap().pixel(2, 0), Vec3::new(2.0, 4.0, 6.0));
    let grey = bytes_of(["Y", "Z", "id"], Blocks::ScanLines, Compression::Uncompressed);
    assert_eq!(HdrImage::from_bytes(&grey, "grey.exr").unwrap().pixel(3, 1), Vec3::splat(43.0));
    let depth = bytes_of(["U", "V", "Z"], Blocks::ScanLines, Compression::Uncompressed);
    let message = HdrImage::from_bytes(&depth, "depth.exr").unwrap_err().to_string();
    assert!(message.contains("neither R, G, B nor Y") && message.contains("U, V, Z"), "{message}");
}

/// An OpenEXR file of one pixel, shown in a window of `side` by `side`.
fn exr_in_a_window(side: usize) -> Vec<u8> {
    use exr::prelude::*;
    let channels = ["R", "G", "B"].map(|name| AnyChannel::new(name, FlatSamples::F32(vec![1.0])));
    let layer = Layer::new(
        (1, 1),
        LayerAttributes::default(),
        Encoding::FAST_LOSSLESS,
        AnyChannels::sort(channels.into_iter().collect()),
    );
    let window = IntegerBounds::new((0, 0), (side, side));
    let mut out = std::io::Cursor::new(Vec::new());
    Image::new(ImageAttributes::new(window), layer).write().to_buffered(&mut out).unwrap();
    out.into_inner()
}

#[test]
fn a_small_file_takes_no_large_memory() {
    let shown = HdrImage::from_bytes(&exr_in_a_window(500), "crop.exr").unwrap();
    assert_eq!((shown.width, shown.pixel(0, 0), shown.pixel(1, 0)), (500, Vec3::ONE, Vec3::ZERO));
    let far = exr_in_a_window(11_000);
    assert!(far.len() < 1000);
    let message = HdrImage::from_bytes(&far, "window.exr").unwrap_err().to_string();
    assert!(message.contains("more pixels than the file can hold"), "{message}");

    // 65,535 pixels of one colour in twelve bytes, as often as there are scanlines
    let flat = |rows: usize| {
        let scanline = [9, 9, 9, 9, 1, 1, 1, 254, 1, 1, 1, 255];
        hdr(&format!("#?RADIANCE\n\n-Y {rows} +X 65535\n"), &scanline.repeat(rows))
    };
    assert_eq!(HdrImage::from_bytes(&flat(20), "flat.hdr").unwrap().pixels.len(), 65_535 * 20);
    let message = HdrImage::from_bytes(&flat(2000), "flat.hdr").unwrap_err().to_string();
    assert!(message.contains("more pixels than the file can hold"), "{message}");
    let message = HdrImage::from_bytes(b"#?RADIANCE\n\n-Y 1 +X 65537\n\x09\x09\x09\x09", "wide.hdr").unwrap_err().to_string();
    assert!(message.contains("a side has at most 65536"), "{message}");
}

#[test]
fn atlases_of_16k_are_read_and_larger_ones_named() {
    // the header alone: what is refused here is only what follows it
    let header = |side: u32| {
        let mut chunk = b"IHDR".to_vec();
        chunk.extend([side.to_be_bytes(), side.to_be_bytes()].concat());
        chunk.extend([8, 2, 0, 0, 0]);
        let mut png = b"\x89PNG\r\n\x1a\n\x00\x00\x00\x0d".to_vec();
        png.extend(&chunk);
        png.extend(crc32(&chunk).to_be_bytes());
        png.extend(b"\x00\x00\x00\x00IDAT\x35\xaf\x06\x1e\x00\x00\x00\x00IEND\xae\x42\x60\x82");
        png
    };
    let message = |side| SrgbImage::from_bytes(&header(side), "atlas.png").unwrap_err().to_string();
    // room enough is what it asks for next: such a file would have to be longer
    assert!(message(16_384).contains("more pixels than the file can hold"), "{}", message(16_384));
    assert!(message(16_385).contains("16385 x 16385 pixels are 268468225, more than the 268435456"), "{}", message(16_385));
}

/// The check sum of PNG's chunks.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 })
    })
}

#[test]
fn png_comes_back_and_sixteen_bits_become_eight() {
    let mut image = SrgbImage::filled(3, 2, [10, 20, 30, 255]);
    image.pixels[4] = [1, 2, 3, 4];
    let bytes = image.to_png_bytes().unwrap();
    assert_eq!(SrgbImage::from_bytes(&bytes, "a.png").unwrap(), image);
    let mut deep = std::io::Cursor::new(Vec::new());
    image::ImageBuffer::<image::Luma<u16>, _>::from_raw(1, 1, vec![0x8080_u16])
        .unwrap()
        .write_to(&mut deep, image::ImageFormat::Png)
        .unwrap();
    assert_eq!(SrgbImage::from_bytes(&deep.into_inner(), "b.png").unwrap().pixels, vec![[128, 128, 128, 255]]);
    assert!(SrgbImage { width: 2, height: 2, pixels: vec![] }.to_png_bytes().is_err());
    let cut = SrgbImage::from_bytes(&bytes[..bytes.len() - 20], "c.png").unwrap_err().to_string();
    assert!(cut.starts_with("c.png: "), "{cut}");
}

#[test]
fn textures_go_on_as_asked_and_are_filtered_in_linear_light() {
    let image = SrgbImage { width: 2, height: 1, pixels: vec![[0, 0, 0, 255], [255, 255, 255, 255]] };
    let sample = |u, v, wrap| image.sample_bilinear(u, v, [wrap, TextureWrap::Repeat]);
    assert_eq!(sample(0.25, 0.5, TextureWrap::Repeat).x, 0.0);
    assert_eq!(sample(0.75, -7.5, TextureWrap::Repeat).x, 1.0);
    assert!((sample(0.5, 0.5, TextureWrap::Repeat).x - 0.5).abs() < 1e-6);
    assert!((sample(3.0, 0.5, TextureWrap::Repeat).x - 0.5).abs() < 1e-6);
    assert_eq!(sample(1.25, 0.5, TextureWrap::Clamp).x, 1.0);
    assert_eq!(sample(1.25, 0.5, TextureWrap::Mirror).x, 1.0);
    assert_eq!(sample(1.25, 0.5, TextureWrap::Repeat).x, 0.0);
    assert_eq!(sample(f32::NAN, 0.5, TextureWrap::Repeat), glam::Vec4::ZERO);
}

#[test]
fn a_missing_file_is_named() {
    let message = HdrImage::read("no/such/probe.hdr").unwrap_err().to_string();
    assert!(message.contains("no/such/probe.hdr") && message.contains("check"), "{message}");
    assert!(matches!(SrgbImage::from_bytes(b"GIF89a", "x.gif"), Err(ImageError::UnknownFormat { .. })));
}

/// Whatever the bytes, an answer comes and no panic.
fn survives(bytes: &[u8]) {
    let _ = HdrImage::from_bytes(bytes, "hostile");
    let _ = SrgbImage::from_bytes(bytes, "hostile");
}

fn seeds() -> Vec<Vec<u8>> {
    let dir = tempfile::tempdir().unwrap();
    let image = ramp(24, 10);
    let exr = |samples| {
        let path = dir.path().join("s.exr");
        image.write_exr_as(&path, samples).unwrap();
        std::fs::read(&path).unwrap()
    };
    let old = hdr("#?RADIANCE\n\n-Y 2 +X 4\n", &[9, 9, 9, 9, 1, 1, 1, 3, 9, 9, 9, 9, 1, 1, 1, 3]);
    vec![
        image.to_hdr_bytes(),
        old,
        exr(ExrSamples::Half),
        exr(ExrSamples::Float),
        SrgbImage::filled(20, 20, [1, 2, 3, 4]).to_png_bytes().unwrap(),
    ]
}

#[test]
fn every_truncation_is_refused_or_read_without_panic() {
    for seed in seeds() {
        (0..seed.len()).step_by(1 + seed.len() / 200).for_each(|end| survives(&seed[..end]));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn flipped_bytes_never_panic(which in 0_usize..5, flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        thread_local!(static SEEDS: Vec<Vec<u8>> = seeds());
        let mut bytes = SEEDS.with(|s| s[which].clone());
        for (at, value) in flips {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        survives(&bytes);
    }
}
