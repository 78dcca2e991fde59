//! Bakes of weathered sites: dust lies where it should, at vertices and in texels, the light stays as it is, and nothing is solved twice.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::{Vec2, Vec3};
use heliodon_bake::bake::{BakeReport, bake};
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bake::report::Silent;
use heliodon_bundle::site::Site;
use heliodon_bundle::texels::weathered;
use heliodon_bundle::{BundleReader, LitChunk};
use heliodon_image::{HdrImage, SrgbImage};
use std::fmt::Write;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const STONE: Vec3 = Vec3::splat(0.5);
const DUST: Vec3 = Vec3::new(0.4, 0.3, 0.2);
const CORRODED: Vec3 = Vec3::new(0.1, 0.1, 0.05);
const BOTH: &str =
    "[weathering]\ndust = 0.8\ncorrosion = 0.6\ndust_color = [0.4, 0.3, 0.2]\ncorrosion_color = [0.1, 0.1, 0.05]\n";

/// A square of `2 * half` metres about the y axis that looks up, divided.
fn square(height: f32, half: f32, parts: u32) -> String {
    let mut text = String::new();
    let at = |i: u32| half * (2.0 * i as f32 / parts as f32 - 1.0);
    let share = |i: u32| i as f32 / parts as f32;
    for (j, i) in (0..=parts).flat_map(|j| (0..=parts).map(move |i| (j, i))) {
        writeln!(text, "v {} {height} {}\nvt {} {}", at(i), -at(j), share(i), share(j)).unwrap();
    }
    for (j, i) in (0..parts).flat_map(|j| (0..parts).map(move |i| (j, i))) {
        let v = 1 + j * (parts + 1) + i;
        let [a, b, c, d] = [v, v + 1, v + parts + 2, v + parts + 1];
        writeln!(text, "f {a}/{a} {b}/{b} {c}/{c}\nf {a}/{a} {c}/{c} {d}/{d}").unwrap();
    }
    text
}

/// A closed box about the y axis.
fn slab(low: f32, high: f32, half: f32) -> String {
    let mut text = String::new();
    for (y, (x, z)) in [low, high].into_iter().flat_map(|y| [(-1, 1), (1, 1), (1, -1), (-1, -1)].map(|xz| (y, xz))) {
        writeln!(text, "v {} {y} {}", x as f32 * half, z as f32 * half).unwrap();
    }
    text + "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
}

/// Whether an albedo is another but for the 16 bits in which it is stored.
fn is_close(albedo: Vec3, other: Vec3) -> bool {
    albedo.abs_diff_eq(other, 1.0 / 65535.0)
}

/// A floor of 8 m, and over its middle a wide roof, close above it.
fn write_site(folder: &Path, floor: &str, parts: u32, weathering: &str) {
    // there is an atlas: parts that say nothing would choose it
    let light = if floor.contains("light =") { "" } else { "light = \"vertex\"\n" };
    let site = format!(
        "[site]\nname = \"A roof\"\n[[part]]\nfile = \"floor.obj\"\nrole = \"ground\"\n{light}{floor}\n[[part]]\nfile = \"roof.obj\"\n\
         light = \"vertex\"\nalbedo = [0.5, 0.5, 0.5]\n[sky]\nprobes = \"sky.hdr\"\nmapping = \"lat-long\"\n[bake]\nsamples = 64\nbounces = 1\n\
         texels = 128\n{weathering}"
    );
    fs::write(folder.join("site.toml"), site).unwrap();
    fs::write(folder.join("floor.obj"), square(0.0, 4.0, parts)).unwrap();
    fs::write(folder.join("roof.obj"), slab(0.1, 0.2, 2.0)).unwrap();
    HdrImage::filled(32, 16, Vec3::ONE).write_hdr(folder.join("sky.hdr")).unwrap();
}

fn bake_in(folder: &Path) -> (BakeReport, BundleReader) {
    let bundle = folder.join("bundle");
    let report = bake(&Plan::new(Site::read(folder).unwrap(), BakeOptions::new(&bundle)).unwrap(), &Silent).unwrap();
    let bundle = BundleReader::open(bundle).unwrap();
    bundle.verify().unwrap();
    (report, bundle)
}

fn baked(floor: &str, parts: u32, weathering: &str) -> (TempDir, BundleReader) {
    let folder = tempfile::tempdir().unwrap();
    write_site(folder.path(), floor, parts, weathering);
    let (_, bundle) = bake_in(folder.path());
    (folder, bundle)
}

fn chunks(bundle: &BundleReader) -> Vec<LitChunk> {
    (0..bundle.chunk_count()).map(|chunk| bundle.read_chunk(chunk).unwrap()).collect()
}

/// Albedo at the vertex nearest to a place.
fn albedo_at(chunks: &[LitChunk], part: u16, place: Vec3) -> Vec3 {
    let of_part = chunks.iter().filter(|chunk| chunk.part == part);
    let all = of_part.flat_map(|chunk| chunk.positions.iter().zip(&chunk.albedo));
    *all.min_by(|a, b| a.0.distance(place).total_cmp(&b.0.distance(place))).unwrap().1
}

const PLAIN: &str = "albedo = [0.5, 0.5, 0.5]";

#[test]
fn dust_lies_beneath_the_roof_and_what_is_open_corrodes() {
    let (_folder, bundle) = baked(PLAIN, 32, BOTH);
    let (_other, sound) = baked(PLAIN, 32, "");
    let chunks = chunks(&bundle);
    let (middle, open) = (albedo_at(&chunks, 0, Vec3::ZERO), albedo_at(&chunks, 0, Vec3::new(3.75, 0.0, 3.75)));
    assert!(middle.abs_diff_eq(STONE.lerp(DUST, 0.8), 0.02), "{middle}");
    assert!(open.abs_diff_eq(STONE.lerp(CORRODED, 0.6), 0.03), "{open}");
    let corner = albedo_at(&chunks, 1, Vec3::new(2.0, 0.2, 2.0));
    assert!(!is_close(corner, STONE), "{corner}");
    // the light is that of the sound stone
    for (weathered, sound) in chunks.iter().zip(self::chunks(&sound)) {
        assert_eq!(weathered.light, sound.light);
        assert_eq!((&weathered.positions, &weathered.valid), (&sound.positions, &sound.valid));
        assert!(sound.albedo.iter().all(|&albedo| is_close(albedo, STONE)));
    }
    let (manifest, sound) = (bundle.manifest(), sound.manifest());
    // both know of an atlas, which no part uses, and of what the site says of the parts
    assert_eq!((manifest.version, sound.version), (9, 9));
    assert_eq!(manifest.parameters.weathering.as_ref().unwrap().dust, 0.8);
    assert_eq!(sound.parameters.weathering, None);
}

#[test]
fn what_is_off_changes_no_byte() {
    let (without, _) = baked(PLAIN, 8, "");
    for (floor, weathering) in
        [(PLAIN.to_owned(), "[weathering]\n"), (format!("{PLAIN}\nweathering = false"), "[weathering]\ndust = 0.0\n")]
    {
        let (off, bundle) = baked(&floor, 8, weathering);
        for name in ["site.glb", "lapse.json"] {
            let read = |folder: &TempDir| fs::read(folder.path().join("bundle").join(name)).unwrap();
            assert!(read(&without) == read(&off), "{name}");
        }
        assert!(!bundle.manifest().measures.keys().any(|name| name.contains("weather")));
    }
    let text = fs::read_to_string(without.path().join("bundle/manifest.json")).unwrap();
    assert!(!text.contains("weather"), "{text}");
}

#[test]
fn parts_have_their_own() {
    let (_folder, bundle) = baked(&format!("{PLAIN}\nweathering = false"), 8, BOTH);
    let chunks = chunks(&bundle);
    assert!(
        chunks.iter().filter(|chunk| chunk.part == 0).all(|chunk| chunk.albedo.iter().all(|&albedo| is_close(albedo, STONE)))
    );
    assert!(!is_close(albedo_at(&chunks, 1, Vec3::new(2.0, 0.2, 2.0)), STONE));
    assert_eq!(bundle.manifest().parameters.part_weathering.len(), 2);
}

#[test]
fn textured_parts_are_weathered_by_their_factor() {
    let folder = tempfile::tempdir().unwrap();
    write_site(folder.path(), "albedo = \"tiles.png\"", 32, BOTH);
    let image = SrgbImage { width: 2, height: 1, pixels: vec![[150, 200, 200, 255], [200, 150, 150, 255]] };
    fs::write(folder.path().join("tiles.png"), image.to_png_bytes().unwrap()).unwrap();
    let (_, bundle) = bake_in(folder.path());
    let chunks = chunks(&bundle);
    let linear = heliodon_math::color::linear_from_srgb;
    let mean = Vec3::splat((linear(150.0 / 255.0) + linear(200.0 / 255.0)) * 0.5);
    let factor = albedo_at(&chunks, 0, Vec3::ZERO);
    assert!((factor * mean).abs_diff_eq(mean.lerp(DUST, 0.8), 0.02), "{factor} {mean}");
    assert!(chunks.iter().filter(|chunk| chunk.part == 0).all(|chunk| chunk.texture.is_some()));
}

#[test]
fn texels_have_a_layer_of_their_own() {
    let (_folder, bundle) = baked(&format!("{PLAIN}\nlight = \"texel\""), 1, BOTH);
    let (_other, dense) = baked(PLAIN, 32, BOTH);
    let layer = bundle.read_texel_weathering().unwrap().unwrap();
    assert!(dense.read_texel_weathering().unwrap().is_none());
    let (chunks, dense) = (chunks(&bundle), chunks(&dense));
    let floor = chunks.iter().find(|chunk| chunk.part == 0).unwrap();
    assert!(floor.albedo.iter().all(|&albedo| is_close(albedo, STONE)), "the layer is not laid on twice");
    // the floor's square is one chart: its corners tell where its places lie
    let corner = |x: f32, z: f32| {
        let place = |p: &&(Vec3, Vec2)| p.0.x.signum() == x && p.0.z.signum() == z;
        let all: Vec<(Vec3, Vec2)> = floor.positions.iter().copied().zip(floor.texel_uvs.iter().copied()).collect();
        all.iter().find(place).unwrap().1
    };
    let (origin, u, v) = (corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0));
    let mut worst = 0.0_f32;
    for (i, j) in (1..32).flat_map(|j| (1..32).map(move |i| (i as f32 / 32.0, j as f32 / 32.0))) {
        let uv = origin + (u - origin) * i + (v - origin) * j;
        let (own, beside) = (weathered(&layer, uv, STONE), albedo_at(&dense, 0, Vec3::new(8.0 * i - 4.0, 0.0, 8.0 * j - 4.0)));
        // where the roof's edge is above, a texel mixes what vertices tell apart
        let inner = |x: f32| ((8.0 * x - 4.0).abs() - 2.0).abs() > 0.4;
        if inner(i) && inner(j) {
            worst = worst.max((own - beside).abs().max_element());
        }
    }
    assert!(worst < 0.03, "{worst}");
    assert_ne!(weathered(&layer, (u + v) * 0.5, STONE), STONE);
}

#[test]
fn a_change_of_weather_solves_no_light_again() {
    let folder = tempfile::tempdir().unwrap();
    let taken = |report: &BakeReport, stage: &str| {
        let of: Vec<bool> = report.taken.iter().filter(|t| t.stage == stage).map(|t| t.blocks == t.of && t.of > 0).collect();
        (!of.is_empty()).then(|| of.iter().all(|&all| all))
    };
    let floor = format!("{PLAIN}\nlight = \"texel\"");
    write_site(folder.path(), &floor, 1, "");
    bake_in(folder.path());
    let mut bundles = Vec::new();
    for (weathering, weather_kept) in [
        (BOTH.to_owned(), Some(false)),
        (BOTH.replace("dust = 0.8", "dust = 0.3"), Some(true)),
        (format!("{BOTH}wind_from_deg = 45.0\n"), Some(false)),
        (String::new(), None),
    ] {
        write_site(folder.path(), &floor, 1, &weathering);
        let (report, bundle) = bake_in(folder.path());
        assert!(!report.up_to_date, "another weather is another bundle");
        assert_eq!(taken(&report, "all light"), Some(true), "{weathering} {:?}", report.taken);
        for stage in ["weather", "weather on texels"] {
            assert_eq!(taken(&report, stage), weather_kept, "{weathering} {stage} {:?}", report.taken);
        }
        bundles.push((chunks(&bundle), bundle.read_texel_weathering().unwrap()));
    }
    let [first, weaker, turned, none] = &bundles[..] else { panic!() };
    assert!(first != weaker && first != turned && first.1.is_some() && none.1.is_none());
    assert!(bake_in(folder.path()).0.up_to_date);
}
