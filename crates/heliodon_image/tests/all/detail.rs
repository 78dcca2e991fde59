//! Detail textures: what is promised of every one of them.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

use glam::Vec3;
use heliodon_image::SrgbImage;
use heliodon_image::detail::{
    DetailError, DetailImport, DetailKind, DetailParams, DetailTexture, MAX_SIDE, NEUTRAL, SeamVerdict, factor,
};
use heliodon_math::color::linear_from_srgb;
use proptest::prelude::*;

const KNOTTY: DetailKind = DetailKind::Wood { knots: 3 };

fn kinds() -> impl Iterator<Item = DetailKind> {
    DetailKind::ALL.into_iter().chain([KNOTTY, DetailKind::Band { wavelength: 4.0 }])
}

fn generate(kind: DetailKind, size: u32, seed: u64) -> DetailTexture {
    DetailTexture::generate(&DetailParams { size, seed, ..DetailParams::new(kind) }).unwrap()
}

fn sum(codes: &[u8]) -> u64 {
    codes.iter().map(|&code| u64::from(code)).sum()
}

fn assert_exact(texture: &DetailTexture) {
    texture.validate().unwrap();
    let levels = texture.mip_levels();
    assert_eq!(levels.len() as u32, 1 + texture.width().max(texture.height()).ilog2());
    assert_eq!(levels[0].codes, texture.codes());
    for (k, level) in levels.iter().enumerate() {
        let size = ((texture.width() >> k).max(1), (texture.height() >> k).max(1));
        assert_eq!((level.width, level.height), size);
        let count = u64::from(level.width) * u64::from(level.height);
        assert_eq!(level.codes.len() as u64, count);
        assert_eq!(sum(&level.codes), u64::from(NEUTRAL) * count, "level {k}");
    }
    assert_eq!(levels.last().unwrap().codes, [NEUTRAL]);
    let (bytes, count) = texture.mip_bytes();
    assert_eq!((bytes.len(), count as usize), (levels.iter().map(|level| level.codes.len()).sum(), levels.len()));
}

#[test]
fn every_kind_and_size_has_the_exact_mean_its_contrast_and_no_seam() {
    for kind in kinds() {
        for (size, seeds) in [(64, 0..12), (128, 0..6), (256, 0..3), (512, 0..1)] {
            for seed in seeds {
                let texture = generate(kind, size, seed * 0x1234_5678_9abc);
                let what = format!("{kind:?} {size} {seed}");
                assert_exact(&texture);
                assert!((texture.contrast() - kind.natural_contrast()).abs() < 0.05, "{what}: {}", texture.contrast());
                assert_eq!(texture.share_at_limits(), 0.0, "{what}");
                let seam = texture.seam();
                assert_eq!(seam.verdict, SeamVerdict::Seamless, "{what}: {seam:?}");
                assert!(seam.u > 0.2 && seam.v > 0.2, "{what}: {seam:?}");
            }
        }
    }
}

/// FNV-1a.
fn hash(codes: &[u8]) -> u64 {
    codes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &code| (hash ^ u64::from(code)).wrapping_mul(0x0100_0000_01b3))
}

#[test]
fn the_same_bits_for_ever() {
    let golden = [
        0xc30c838d13023427_u64,
        0x664c1e3db9314583,
        0xd2d81d833e0744d5,
        0xe4f3e651cecbc007,
        0xbf255c6d92e96001,
        0x4112d8586c0e642d,
    ];
    let found: Vec<u64> =
        DetailKind::ALL.into_iter().chain([KNOTTY]).map(|kind| hash(generate(kind, 128, 7).codes())).collect();
    assert_eq!(found, golden, "{found:#x?}");
    for kind in DetailKind::ALL {
        let texture = generate(kind, 128, 7);
        assert_eq!(texture, generate(kind, 128, 7));
        assert_ne!(texture, generate(kind, 128, 8));
        // seeds that differ in their upper half only
        assert_ne!(texture, generate(kind, 128, 7 + (1 << 40)));
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for kind in kinds() {
        assert_eq!(one.install(|| generate(kind, 64, 3)), generate(kind, 64, 3));
    }
}

#[test]
fn a_step_across_the_edge_is_like_one_inside() {
    // for each kind over many seeds, the mean square of steps across both edges against that of all others, which chance moves by less
    for kind in kinds() {
        let (mut across, mut inside) = ([0.0; 2], [0.0; 2]);
        for seed in 100..140 {
            let texture = generate(kind, 64, seed);
            let code = |x: usize, y: usize| f64::from(texture.codes()[y % 64 * 64 + x % 64]);
            for (x, y) in (0..64).flat_map(|y| (0..64).map(move |x| (x, y))) {
                let steps = [code(x + 1, y) - code(x, y), code(x, y + 1) - code(x, y)];
                for (axis, at) in [(0, x), (1, y)] {
                    let square = steps[axis] * steps[axis];
                    if at == 63 { across[axis] += square } else { inside[axis] += square / 63.0 }
                }
            }
        }
        for axis in 0..2 {
            let ratio = (across[axis] / inside[axis]).sqrt();
            assert!((ratio - 1.0).abs() < 0.12, "{kind:?} along {axis}: {ratio}");
        }
    }
}

#[test]
fn a_wall_sends_out_the_same_light_with_and_without_detail() {
    assert_eq!((factor(0), factor(NEUTRAL), factor(255)), (0.0, 1.0, 255.0 / 128.0));
    let albedo = Vec3::new(0.3, 0.25, 0.2);
    let texture = generate(DetailKind::Stone, 64, 1);
    let wall = texture.wall(albedo, 2);
    assert_eq!((wall.width, wall.height), (128, 128));
    let mean = wall.pixels.iter().map(|p| f64::from(linear_from_srgb(f32::from(p[0]) / 255.0))).sum::<f64>() / 16_384.0;
    // the picture's own rounding
    assert!((mean - 0.3).abs() < 2e-3, "{mean}");
    let sheet = texture.preview();
    assert_eq!((sheet.width, sheet.height), (3 * 192 + 32, 192 + 16));
}

#[test]
fn mips_are_means_of_what_they_cover() {
    let texture = generate(DetailKind::Wood { knots: 1 }, 64, 5);
    for (k, level) in texture.mip_levels().into_iter().enumerate() {
        let side = 1_usize << k;
        for (i, &code) in level.codes.iter().enumerate() {
            let (x, y) = (i % level.width as usize * side, i / level.width as usize * side);
            let rows = (y..y + side).map(|y| sum(&texture.codes()[y * 64 + x..][..side])).sum::<u64>();
            let mean = rows as f64 / (side * side) as f64;
            assert!((mean - f64::from(code)).abs() < 1.0, "level {k}: {mean} {code}");
        }
    }
}

#[test]
fn parameters_out_of_range_are_refused() {
    let told = |params: DetailParams| DetailTexture::generate(&params).unwrap_err().to_string();
    let stone = DetailParams::new(DetailKind::Stone);
    assert!(told(DetailParams { size: 100, ..stone }).contains("64, 128, 256 or 512"));
    for contrast in [0.0, 41.0, -3.0, f32::NAN, f32::INFINITY] {
        assert!(told(DetailParams { contrast, ..stone }).contains("contrast"));
    }
    for wavelength in [0.0, 33.0, f32::NAN] {
        assert!(told(DetailParams::new(DetailKind::Band { wavelength })).contains("wavelength"));
    }
    assert!(told(DetailParams::small(DetailKind::Wood { knots: 9 })).contains("knots"));
    assert_eq!(DetailParams::large(DetailKind::Noise).size, 512);
    assert!(DetailKind::ALL.iter().all(|kind| DetailKind::named(kind.name()) == Some(*kind)));
    assert_eq!(DetailKind::named("marble"), None);
}

/// A grey image of a code for each place.
fn grey(width: u32, height: u32, code: impl Fn(u32, u32) -> u8) -> SrgbImage {
    let mut image = SrgbImage::filled(width, height, [0, 0, 0, 255]);
    for (k, pixel) in (0..).zip(&mut image.pixels) {
        *pixel = [[code(k % width, k / width); 3].as_slice(), &[255]].concat().try_into().unwrap();
    }
    image
}

fn import(image: &SrgbImage, how: DetailImport) -> Result<heliodon_image::detail::ImportedDetail, DetailError> {
    DetailTexture::from_image(image, "wall.png", &how)
}

#[test]
fn what_is_written_is_read_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stone.png");
    let texture = generate(DetailKind::Stone, 128, 2);
    texture.write_png(&path).unwrap();
    let back = DetailTexture::read(&path, &DetailImport::strict()).unwrap();
    assert_eq!((back.texture, back.mean_before, back.changed), (texture, 128.0, 0));
    assert_eq!(back.warnings, Vec::<String>::new());
    assert!(matches!(DetailTexture::read(folder.path().join("no.png"), &DetailImport::strict()), Err(DetailError::Image(_))));
}

#[test]
fn an_image_that_is_off_is_refused_or_corrected_with_its_contrast() {
    let noise = generate(DetailKind::Noise, 64, 4);
    let bright = grey(64, 64, |x, y| noise.codes()[(y * 64 + x) as usize] + 30);
    let refused = import(&bright, DetailImport::strict()).unwrap_err().to_string();
    for part in ["wall.png", "158.00", "brighter", "23.4 %", "--correct"] {
        assert!(refused.contains(part), "{refused}");
    }
    let mended = import(&bright, DetailImport::corrected()).unwrap();
    assert_eq!((&mended.texture, mended.mean_before), (&noise, 158.0));
    let stronger = import(&bright, DetailImport { correct: true, contrast: Some(20.0) }).unwrap();
    assert!((stronger.texture.contrast() - 20.0).abs() < 0.05 && (stronger.contrast_before - 14.0).abs() < 0.05);
    for (correct, contrast) in [(false, 20.0), (true, 0.0), (true, f32::NAN)] {
        let how = DetailImport { correct, contrast: Some(contrast) };
        assert!(matches!(import(&bright, how), Err(DetailError::Parameter { .. })));
    }
    // a third of a code: within the tolerance, made exact by a third of the texels, each by one
    let near = grey(64, 64, |x, y| noise.codes()[(y * 64 + x) as usize] + u8::from((x + y) % 3 == 0));
    let taken = import(&near, DetailImport::strict()).unwrap();
    assert_exact(&taken.texture);
    let off = taken.mean_before - 128.0;
    assert!((off - 1.0 / 3.0).abs() < 0.01 && taken.changed == (off * 4096.0).round() as u64);
    let by = |i: usize| near.pixels[i][0].abs_diff(taken.texture.codes()[i]);
    assert!((0..4096).all(|i| by(i) <= 1));
}

#[test]
fn images_that_cannot_serve_end_in_a_message() {
    let told = |image: &SrgbImage| import(image, DetailImport::corrected()).unwrap_err().to_string();
    let ramp = |width, height| grey(width, height, |x, y| (x * 7 + y) as u8);
    assert!(told(&ramp(300, 200)).contains("scale it to 256 x 256"), "{}", told(&ramp(300, 200)));
    assert!(told(&ramp(8, 8)).contains("16 to 2048") && told(&ramp(2 * MAX_SIDE, 16)).contains("16 to 2048"));
    assert!(told(&grey(64, 64, |_, _| 90)).contains("all texels have the code 90"));
    assert!(told(&SrgbImage { width: 64, height: 64, pixels: Vec::new() }).contains("are not 64 x 64"));
    assert!(told(&SrgbImage { width: 0, height: 0, pixels: Vec::new() }).contains("0 x 0"));
}

#[test]
fn doubts_are_told() {
    let warnings = |image: &SrgbImage| import(image, DetailImport::corrected()).unwrap().warnings.join("\n");
    let noise = generate(DetailKind::Noise, 64, 9);
    let at = |x: u32, y: u32| noise.codes()[(y * 64 + x) as usize];
    assert_eq!(warnings(&grey(64, 64, at)), "");
    // light from the left, below the grain: seen by its coarse levels
    assert!(warnings(&grey(64, 64, |x, y| at(x, y) / 2 + x as u8)).contains("left and right"));
    assert!(warnings(&grey(64, 64, |x, y| at(x, y) / 2 + y as u8)).contains("upper and lower"));
    assert!(warnings(&grey(64, 64, |x, y| if at(x, y) > 128 { 255 } else { 0 })).contains("0 or 255"));
    assert!(warnings(&grey(64, 64, |x, y| 128 + at(x, y) % 2)).contains("hardly to be seen"));
    assert!(warnings(&grey(16, 64, at)).contains("16 x 64 texels repeat"));
    let mut coloured = grey(64, 64, at);
    coloured.pixels[5] = [255, 0, 0, 255];
    assert!(warnings(&coloured).contains("colours"));
    coloured.pixels[5] = [255, 255, 255, 0];
    assert!(warnings(&coloured).contains("transparent"));
    let transparent = import(&coloured, DetailImport::corrected()).unwrap();
    assert!(transparent.texture.codes()[5].abs_diff(NEUTRAL) <= 1);
}

#[test]
fn a_piece_cut_out_of_a_pattern_has_a_seam() {
    for kind in [DetailKind::Band { wavelength: 6.0 }, DetailKind::Plaster, DetailKind::Stone] {
        let whole = generate(kind, 256, 3);
        let piece = grey(128, 128, |x, y| whole.codes()[((y + 37) * 256 + x + 51) as usize]);
        let seam = import(&piece, DetailImport::corrected()).unwrap().seam;
        assert!(seam.verdict > SeamVerdict::Seamless, "{kind:?}: {seam:?}");
    }
}

#[test]
fn colours_become_the_grey_of_their_luminance() {
    let mut image = grey(64, 64, |x, _| 98 + x as u8);
    // of linear luminance 0.7152: code 220
    image.pixels[0] = [0, 255, 0, 255];
    let before = import(&image, DetailImport::corrected()).unwrap();
    let shift = f64::from(NEUTRAL) - before.mean_before;
    assert!((f64::from(before.texture.codes()[0]) - 220.0 - shift).abs() <= 1.0, "{}", before.texture.codes()[0]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_seed_and_contrast_keeps_every_promise(
        kind in 0..6_usize, seed: u64, contrast in 1.0_f32..=40.0, size in prop::sample::select(vec![64_u32, 128]),
    ) {
        let kind = DetailKind::ALL.into_iter().chain([KNOTTY]).nth(kind).unwrap();
        let texture = DetailTexture::generate(&DetailParams { kind, size, seed, contrast }).unwrap();
        assert_exact(&texture);
        prop_assert!((texture.contrast() - contrast).abs() < 0.05 + 0.002 * contrast, "{} for {contrast}", texture.contrast());
        prop_assert!(texture.share_at_limits() <= 0.02, "{}", texture.share_at_limits());
    }

    #[test]
    fn any_image_becomes_exact_or_is_refused(codes in prop::collection::vec(any::<[u8; 4]>(), 256), correct: bool) {
        let image = SrgbImage { width: 16, height: 16, pixels: codes };
        match DetailTexture::from_image(&image, "any.png", &DetailImport { correct, contrast: None }) {
            Ok(imported) => assert_exact(&imported.texture),
            Err(DetailError::Mean { mean, .. }) => prop_assert!(!correct && (mean - 128.0).abs() > 0.5),
            Err(other) => prop_assert!(false, "{other}"),
        }
    }

    #[test]
    fn an_image_of_two_codes_at_the_ends_is_corrected(share in 1..255_usize) {
        let image = grey(16, 16, |x, y| if (y * 16 + x) < share as u32 { 255 } else { 0 });
        let imported = import(&image, DetailImport::corrected()).unwrap();
        assert_exact(&imported.texture);
    }
}
