//! Bakes of prepared scans with a panorama: it holds what the middle of the room sees of the original, and nothing of what that does not see.

use crate::waves::{PREPARE, baked, own_cache, plan, red, site, wave};
use glam::{UVec2, Vec2, Vec3, Vec4};
use half::f16;
use heliodon_bake::bake::bake;
use heliodon_bake::merge::{bake_shard, begin_shards, merge};
use heliodon_bake::report::Silent;
use heliodon_bundle::moment::{Blend, Day};
use heliodon_bundle::panorama::{direction_of, size_of, uv_of};
use heliodon_bundle::site::Site;
use heliodon_bundle::{BundleReader, Panorama};
use heliodon_image::ktx2::Ktx2;
use heliodon_math::color::linear_from_srgb;
use heliodon_math::frame::unit_or;
use std::fs;
use tempfile::TempDir;

const SIDE: u32 = 128;
const MIDDLE: Vec3 = Vec3::new(0.0, 1.5, 0.0);

fn with_panorama() -> TempDir {
    site(&format!("{PREPARE}panorama = {SIDE}\n"))
}

fn place(texture: &Ktx2, texel: UVec2) -> usize {
    (texel.y * texture.width + texel.x) as usize
}

/// The normal of a texel, and 1 over how far it lies along its face's axis.
fn surface(panorama: &Panorama, texel: UVec2) -> Vec4 {
    let bytes = &panorama.surface.levels[0][place(&panorama.surface, texel) * 8..];
    Vec4::from_array(std::array::from_fn(|i| f16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]).to_f32()))
}

/// Its albedo.
fn albedo(panorama: &Panorama, texel: UVec2) -> Vec3 {
    let bytes = &panorama.albedo.levels[0][place(&panorama.albedo, texel) * 4..];
    Vec3::from_array(std::array::from_fn(|i| linear_from_srgb(f32::from(bytes[i]) / 255.0)))
}

fn texels() -> impl Iterator<Item = UVec2> {
    let [width, height] = size_of(SIDE);
    (0..height).flat_map(move |y| (0..width).map(move |x| UVec2::new(x, y)))
}

/// The texel that a place off the middle lies in.
fn texel_of(point: Vec3) -> UVec2 {
    (uv_of(SIDE, point - MIDDLE) * Vec2::from(size_of(SIDE).map(|side| side as f32))).as_uvec2()
}

#[test]
fn texels_hold_what_the_original_has() {
    let folder = with_panorama();
    let (report, bundle) = baked(folder.path(), "bundle");
    bundle.verify().unwrap();
    let manifest = bundle.manifest();
    let info = manifest.panorama.as_ref().unwrap();
    assert_eq!((manifest.version, info.side, Vec3::from(info.middle)), (7, SIDE, MIDDLE));
    let wall = manifest.parts[0].counts.triangles;
    assert!(wall > 0 && wall * 20 < 2 * 120 * 120, "the waves are simplified: {wall} triangles");
    let panorama = bundle.read_panorama().unwrap().unwrap();
    let (mut told, mut tilted, mut of_mesh) = (0, 0.0_f32, 0);
    for texel in texels() {
        let nearness = surface(&panorama, texel).w;
        let ray = direction_of(SIDE, 0, texel);
        told += u64::from(nearness > 0.0);
        // of the wall's middle, well inside its rim
        let at = MIDDLE + ray * (6.0 / ray.x);
        if ray.x <= 0.0 || !(0.5..3.5).contains(&at.y) || at.z.abs() > 2.5 || nearness == 0.0 {
            continue;
        }
        of_mesh += 1;
        let reach = ray / ray.abs().max_element() / nearness;
        assert!((reach.x - 6.0).abs() < 0.1, "{texel} lies on what is drawn: {reach}");
        let [_, dy, dz] = wave(at.y, at.z);
        let normal = unit_or(Vec3::new(-1.0, -dy, -dz), Vec3::NEG_X);
        let found = surface(&panorama, texel).truncate();
        // the place is where the line meets the waves, up to 5 cm before the plane
        assert!(found.dot(normal) > 0.97, "{texel}: {found}, not {normal}");
        tilted = tilted.max(Vec2::new(found.y, found.z).length());
        assert!((albedo(&panorama, texel).x - red(at.z)).abs() < 0.03, "{texel}: {}", albedo(&panorama, texel));
    }
    assert!(of_mesh > 100 && told == info.texels, "{of_mesh} {told}");
    assert!(tilted > 0.15, "the waves' own normals, not those of a plane: {tilted}");
    assert!(report.measures["panorama_mask_rays"] > 0.0 && report.measures["panorama_sky_samples"] > 100.0);

    // the wall looks west, where the sun is; behind it lies its shadow, as far as it is high
    let day = Day::new(bundle.lapse().clone());
    let moment = day.at(day.span_seconds().0, Blend::Smooth);
    let light = |point: Vec3, normal: Vec3| {
        let uv = uv_of(SIDE, point - MIDDLE);
        panorama.light.light(manifest.light, &moment, uv, normal)
    };
    let on_wall = light(Vec3::new(6.0, 1.5, 0.0), Vec3::NEG_X);
    assert!(on_wall.sun.x > 0.1 && on_wall.sky.x > 0.2, "{on_wall:?}");
    // half of the sky, and what the ground reflects of it
    assert!((0.4..0.9).contains(&on_wall.sky.x), "{on_wall:?}");
    let on_ground = light(Vec3::new(-3.0, 0.0, 0.5), Vec3::Y);
    assert!((0.8..1.1).contains(&on_ground.sky.x) && on_ground.sun.x > 0.1, "{on_ground:?}");
}

#[test]
fn what_the_middle_does_not_see_is_not_told_of() {
    let folder = with_panorama();
    let (_, bundle) = baked(folder.path(), "bundle");
    let panorama = bundle.read_panorama().unwrap().unwrap();
    let (mut before, mut behind) = (0, 0);
    for chunk in (0..bundle.chunk_count()).map(|chunk| bundle.read_chunk(chunk).unwrap()).filter(|chunk| chunk.part == 1) {
        for triangle in &chunk.triangles {
            let corners = triangle.map(|vertex| chunk.positions[vertex as usize]);
            let point = corners.iter().sum::<Vec3>() / 3.0;
            let texel = texel_of(point);
            let nearness = surface(&panorama, texel).w;
            // along the line to it the wall is met, where it is behind that
            let crossing = MIDDLE + (point - MIDDLE) * (6.0 / point.x);
            let hidden = point.x > 6.3 && (0.4..3.6).contains(&crossing.y) && crossing.z.abs() < 2.6;
            // as fragments ask: whether the texel lies in the plane of what is drawn
            let own = nearness > 0.0 && (MIDDLE + direction_of(SIDE, 0, texel) / nearness).y.abs() < 0.05;
            if hidden {
                behind += 1;
                assert!(!own, "{point} is hidden, and {nearness} tells of it");
            } else if point.x < 5.0 && point.length() < 8.0 {
                before += 1;
                assert!(own, "{point} is seen, and {nearness} tells of something else");
            }
        }
    }
    assert!(before > 20 && behind > 20, "{before} {behind}");
    // of the sky above there is nothing
    assert_eq!(surface(&panorama, texel_of(MIDDLE + Vec3::Y)).w, 0.0);
}

#[test]
fn shards_and_other_numbers_of_threads_make_the_same_bytes() {
    let folder = with_panorama();
    let files = |bundle: &str| {
        let all = ["sun", "sky", "bounce", "surface", "albedo"];
        all.map(|name| fs::read(folder.path().join(bundle).join(format!("panorama/{name}.ktx2"))).unwrap())
    };
    baked(folder.path(), "whole");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| bake(&own_cache(folder.path(), "single"), &Silent).unwrap());
    let sharded = own_cache(folder.path(), "sharded");
    begin_shards(&sharded, 2, &Silent).unwrap();
    for shard in ["1/2", "2/2"] {
        bake_shard(&sharded, shard.parse().unwrap(), None, &Silent).unwrap();
    }
    merge(&sharded, &Silent).unwrap();
    let whole = files("whole");
    assert!(whole.iter().all(|file| file.len() > 500));
    assert!(files("single") == whole, "one thread");
    assert!(files("sharded") == whole, "two shards");
}

#[test]
fn another_size_prepares_nothing_again() {
    let folder = with_panorama();
    baked(folder.path(), "bundle");
    let text = fs::read_to_string(folder.path().join("site.toml")).unwrap();
    let size = format!("panorama = {SIDE}");
    fs::write(folder.path().join("site.toml"), text.replace(&size, "panorama = 208")).unwrap();
    let heard = heliodon_bake::report::Collector::default();
    bake(&plan(folder.path(), "bundle"), &heard).unwrap();
    let notes = heard.heard().notes;
    assert!(notes.iter().any(|note| note.contains("geometry is prepared")), "{notes:?}");
    let bundle = BundleReader::open(folder.path().join("bundle")).unwrap();
    assert_eq!(bundle.manifest().panorama.as_ref().unwrap().side, 208);
    // and without, nothing is left of it
    fs::write(folder.path().join("site.toml"), text.replace(&size, "panorama = 0")).unwrap();
    let (_, bundle) = baked(folder.path(), "bundle");
    assert_eq!((bundle.manifest().panorama.clone(), bundle.manifest().version), (None, 2));
    assert!(bundle.read_panorama().unwrap().is_none() && !folder.path().join("bundle/panorama").exists());
}

#[test]
fn what_a_panorama_cannot_be_is_told() {
    let error = |more: &str| Site::read(site(more).path()).unwrap_err().to_string();
    for side in [1, 63, 100, 4096] {
        let error = error(&format!("[prepare]\npanorama = {side}\n"));
        assert!(error.contains("multiple of 16 from 64 to 2048") && error.contains("panorama = 1024"), "{error}");
    }
    let room = "[[room]]\nname = \"another\"\nmin = [2, 1, 2]\nmax = [3, 2, 3]\n";
    let two = error(&format!("{room}[prepare]\npanorama = 64\n"));
    assert!(two.contains("one room, and the site has 2"), "{two}");
    let weathered = error("[prepare]\npanorama = 64\n[weathering]\ndust = 0.5\n");
    assert!(weathered.contains("[weathering]") && weathered.contains("take one of them out"), "{weathered}");
    let folder = site("[prepare]\npanorama = 64\n");
    let text = fs::read_to_string(folder.path().join("site.toml")).unwrap();
    let (before, after) = (text.find("[[room]]").unwrap(), text.find("[display]").unwrap());
    fs::write(folder.path().join("site.toml"), format!("{}{}", &text[..before], &text[after..])).unwrap();
    let none = Site::read(folder.path()).unwrap_err().to_string();
    assert!(none.contains("the site has 0"), "{none}");
}
