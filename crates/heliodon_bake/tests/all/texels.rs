//! Bakes of sites with light in texels: it agrees with that of vertices, and nothing leaks.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::{Vec2, Vec3};
use heliodon_bake::bake::{BakeReport, bake};
use heliodon_bake::check::check;
use heliodon_bake::merge::{bake_shard, begin_shards};
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bake::report::Silent;
use heliodon_bundle::moment::{Blend, Day, Moment};
use heliodon_bundle::shade::{Light, vertex_light};
use heliodon_bundle::site::Site;
use heliodon_bundle::{BundleReader, LitChunk, TexelLight};
use heliodon_image::HdrImage;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const SKY: &str = "[sky]\nprobes = \"sky.hdr\"\nmapping = \"lat-long\"\n";

/// Several rectangles as OBJ, each a corner, two sides and how often they are divided.
fn rectangles(all: &[(Vec3, Vec3, Vec3, u32)]) -> String {
    let (mut text, mut first) = (String::new(), 1);
    for &(corner, a, b, parts) in all {
        let share = |i: u32| i as f32 / parts as f32;
        for (j, i) in (0..=parts).flat_map(|j| (0..=parts).map(move |i| (j, i))) {
            let p = corner + a * share(i) + b * share(j);
            writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap();
        }
        for (j, i) in (0..parts).flat_map(|j| (0..parts).map(move |i| (j, i))) {
            let v = first + j * (parts + 1) + i;
            writeln!(text, "f {v} {} {}\nf {v} {} {}", v + 1, v + parts + 2, v + parts + 2, v + parts + 1).unwrap();
        }
        first += (parts + 1) * (parts + 1);
    }
    text
}

/// The six sides of a box, from outside, or from inside.
fn cuboid(low: Vec3, high: Vec3, parts: u32, from_inside: bool) -> Vec<(Vec3, Vec3, Vec3, u32)> {
    let size = high - low;
    let (x, y, z) = (Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z);
    let sides = [(low, z, y), (low + x, y, z), (low, x, z), (low + y, z, x), (low, y, x), (low + z, x, y)];
    sides.map(|(corner, a, b)| if from_inside { (corner, b, a, parts) } else { (corner, a, b, parts) }).into()
}

/// Half as bright in the north as in the south, and a sun in the east, half way up.
fn sky() -> HdrImage {
    let mut image = HdrImage::filled(64, 32, Vec3::splat(0.5));
    for (i, pixel) in image.pixels.iter_mut().enumerate() {
        let north = (i % 64).abs_diff(32) < 16;
        *pixel = if north { Vec3::new(0.3, 0.4, 0.5) } else { Vec3::new(0.6, 0.6, 0.6) };
        if (i % 64, i / 64) == (48, 8) {
            *pixel = Vec3::splat(2000.0);
        }
    }
    image
}

struct Baked {
    folder: TempDir,
    report: BakeReport,
    bundle: BundleReader,
}

fn bake_site(site: &str, files: &[(&str, String)]) -> Baked {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("site.toml"), site).unwrap();
    files.iter().for_each(|(name, text)| fs::write(folder.path().join(name), text).unwrap());
    sky().write_hdr(folder.path().join("sky.hdr")).unwrap();
    let (report, bundle) = bake_again(folder.path());
    Baked { folder, report, bundle }
}

fn bake_again(folder: &Path) -> (BakeReport, BundleReader) {
    let bundle = folder.join("bundle");
    let report = bake(&Plan::new(Site::read(folder).unwrap(), BakeOptions::new(&bundle)).unwrap(), &Silent).unwrap();
    (report, BundleReader::open(bundle).unwrap())
}

impl Baked {
    fn chunks(&self) -> Vec<LitChunk> {
        (0..self.bundle.chunk_count()).map(|chunk| self.bundle.read_chunk(chunk).unwrap()).collect()
    }

    fn moment(&self) -> Moment {
        Day::new(self.bundle.lapse().clone()).at(12.0 * 3600.0, Blend::default())
    }

    /// Places all over the triangles of wanted normals, so many for a metre along their longest sides, with their normals and what the atlas shows there.
    fn shown(&self, per_m: f32, wanted: impl Fn(Vec3) -> bool, mut visit: impl FnMut(Vec3, Vec3, Light)) {
        let texels: TexelLight = self.bundle.read_texels().unwrap().unwrap();
        let (layout, moment) = (self.bundle.manifest().light, self.moment());
        for chunk in self.chunks() {
            for corners in chunk.triangles.iter().map(|t| t.map(|v| v as usize)) {
                let normal = chunk.normals[corners[0]];
                let [a, b, c] = corners.map(|v| chunk.positions[v]);
                let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
                let steps = (longest * per_m).ceil() as u16;
                let shares = (0..=steps).flat_map(|i| (0..=steps - i).map(move |j| [i, j]));
                for [u, v] in shares.filter(|_| wanted(normal)).map(|shares| shares.map(|i| f32::from(i) / f32::from(steps))) {
                    let mix =
                        |of: &dyn Fn(usize) -> Vec3| of(corners[0]) * (1.0 - u - v) + of(corners[1]) * u + of(corners[2]) * v;
                    let uv = mix(&|corner| chunk.texel_uvs[corner].extend(0.0)).truncate();
                    visit(mix(&|corner| chunk.positions[corner]), normal, texels.light(layout, &moment, uv, normal));
                }
            }
        }
    }
}

/// The place in the atlas of a point of a chunk's surface.
fn uv_at(chunk: &LitChunk, p: Vec3) -> Option<Vec2> {
    chunk.triangles.iter().find_map(|t| {
        let [a, b, c] = t.map(|v| chunk.positions[v as usize]);
        let normal = (b - a).cross(c - a);
        let weight = |from: Vec3, to: Vec3| (to - from).cross(p - from).dot(normal) / normal.length_squared();
        let weights = Vec3::new(weight(b, c), weight(c, a), weight(a, b));
        let uv = |i: usize| chunk.texel_uvs[t[i] as usize];
        (weights.min_element() > -1e-4).then(|| uv(0) * weights.x + uv(1) * weights.y + uv(2) * weights.z)
    })
}

fn ground_and_block(light: &str, parts: u32) -> Baked {
    let site = format!(
        "[site]\nname = \"A block\"\n[[part]]\nfile = \"ground.obj\"\nrole = \"ground\"\nlight = \"{light}\"\n[[part]]\n\
         file = \"block.obj\"\nlight = \"vertex\"\n{SKY}[bake]\nsamples = 1024\nbounces = 3\ntexels = 256\n"
    );
    let ground = rectangles(&[(Vec3::new(-4.0, 0.0, 4.0), Vec3::X * 8.0, Vec3::NEG_Z * 8.0, parts)]);
    let block = rectangles(&cuboid(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 2.0, 1.0), 16, false));
    bake_site(&site, &[("ground.obj", ground), ("block.obj", block)])
}

#[test]
fn texels_are_lit_as_the_vertices_beside_them() {
    let (coarse, dense) = (ground_and_block("texel", 1), ground_and_block("vertex", 64));
    let texels = coarse.bundle.read_texels().unwrap().unwrap();
    assert!(dense.bundle.read_texels().unwrap().is_none());
    let (layout, moment) = (coarse.bundle.manifest().light, coarse.moment());
    let chunks = coarse.chunks();
    assert_eq!((chunks[0].triangles.len(), chunks[1].texel_uvs.len()), (2, 0));
    assert!(coarse.report.measures["texel_sky_samples"] > 100.0);
    let (mut shadows_differ, mut lit, mut all_off) = (0, 0, Vec::new());
    for chunk in dense.chunks().iter().filter(|chunk| chunk.part == 0) {
        for (vertex, &p) in chunk.positions.iter().enumerate() {
            // within the block, and at its very foot, nothing is shown
            if p.x.abs().max(p.z.abs()) < 1.2 || p.x.abs().max(p.z.abs()) > 3.9 {
                continue;
            }
            let own = vertex_light(&dense.moment(), &chunk.light, vertex, Vec3::Y);
            let found = texels.light(layout, &moment, uv_at(&chunks[0], p).unwrap(), Vec3::Y);
            lit += usize::from(own.sun.x > 0.0);
            shadows_differ += usize::from((own.sun.x - found.sun.x).abs() > 0.02 * moment.shading.sun_irradiance.x);
            let diffuse = |light: Light| light.sky + light.bounce;
            all_off.push((diffuse(own) - diffuse(found)).abs().max_element() / diffuse(own).max_element());
        }
    }
    all_off.sort_by(f32::total_cmp);
    let compared = all_off.len();
    let (mean, most_part, worst) =
        (all_off.iter().sum::<f32>() / compared as f32, all_off[compared * 98 / 100], all_off[compared - 1]);
    assert!(compared > 2000 && lit > 1000 && lit < compared, "{compared} {lit}");
    assert!(mean < 0.005 && most_part < 0.02 && worst < 0.05, "{mean} in the mean, {most_part} of 98 %, {worst} at most");
    // along the shadow's edge only: it is some ten metres long, in texels of 3 cm
    assert!(shadows_differ < compared / 20, "{shadows_differ} of {compared}");
}

#[test]
fn what_is_baked_again_is_the_same_and_nothing_is_solved_twice() {
    let baked = ground_and_block("texel", 2);
    let hashes = |bundle: &BundleReader| bundle.manifest().files.clone();
    fs::rename(baked.folder.path().join("bundle"), baked.folder.path().join("before")).unwrap();
    let (report, again) = bake_again(baked.folder.path());
    assert_eq!(hashes(&again), hashes(&BundleReader::open(baked.folder.path().join("before")).unwrap()));
    for stage in ["all light", "charts"] {
        assert!(
            report.taken.iter().any(|taken| taken.stage == stage && taken.blocks == taken.of),
            "{stage}: {:?}",
            report.taken
        );
    }
    again.verify().unwrap();
}

/// A closed room with walls of 0.2 m, and the world around it.
fn closed_room() -> Baked {
    let site = format!(
        "[site]\nname = \"A room\"\n[[part]]\nfile = \"room.obj\"\nlight = \"texel\"\n{SKY}[bake]\nsamples = 64\nbounces = 4\ntexels = 128\n"
    );
    let inside = cuboid(Vec3::splat(-2.0), Vec3::splat(2.0), 1, true);
    let outside = cuboid(Vec3::splat(-2.2), Vec3::splat(2.2), 1, false);
    bake_site(&site, &[("room.obj", rectangles(&[inside, outside].concat()))])
}

#[test]
fn a_closed_room_stays_dark_to_the_last_texel() {
    let baked = closed_room();
    let (mut inside, mut outside, mut bright) = (0, 0, 0);
    baked.shown(
        5.0,
        |_| true,
        |p, _, light| {
            if p.abs().max_element() < 2.1 {
                inside += 1;
                assert_eq!(light.total(), Vec3::ZERO, "{p}");
            } else {
                outside += 1;
                bright += u32::from(light.sky.min_element() > 0.05);
            }
        },
    );
    assert!(inside > 2000 && bright == outside, "{inside} inside, {bright} of {outside} bright");
}

#[test]
fn a_strip_before_a_wall_narrower_than_a_texel_is_as_dark_as_its_room() {
    // a socle that runs on beneath the wall on it, five centimetres of it within the room
    let site = format!(
        "[site]\nname = \"A socle\"\n[[part]]\nfile = \"room.obj\"\nlight = \"texel\"\n{SKY}[bake]\nsamples = 64\nbounces = 2\ntransfer = \"rgb\"\ntexels = 128\n"
    );
    let boxes = [
        ([0.0, 0.0, -3.0], [1.2, 1.0, 3.0]),
        ([0.1, 0.99, -2.99], [1.15, 3.05, 2.99]),
        ([0.05, 3.0, -3.1], [5.6, 3.2, 3.1]),
        ([5.0, -0.1, -3.0], [5.5, 3.1, 3.0]),
        ([0.02, -0.1, 2.8], [5.4, 3.1, 3.05]),
        ([0.02, -0.1, -3.05], [5.4, 3.1, -2.8]),
        ([-0.1, -0.3, -3.2], [5.7, 0.05, 3.2]),
    ];
    let boxes =
        boxes.into_iter().flat_map(|(low, high)| cuboid(Vec3::from(low), Vec3::from(high), 1, false)).collect::<Vec<_>>();
    let baked = bake_site(&site, &[("room.obj", rectangles(&boxes))]);
    let texel_m = 1.0 / baked.bundle.manifest().texels.as_ref().unwrap().per_m;
    let (mut strip, mut outside) = (0, 0.0_f32);
    baked.shown(
        60.0,
        |normal| normal.y > 0.9,
        |p, _, light| {
            if p.y == 1.0 && p.x > 1.155 && p.z.abs() < 2.7 {
                strip += 1;
                assert!(light.total().max_element() < 0.02, "{p}: {light:?}");
            } else if p.y == 1.0 && p.x < 0.05 {
                outside = outside.max(light.sky.max_element());
            }
        },
    );
    assert!(texel_m > 0.05 && strip > 500 && outside > 0.2, "{texel_m}: {strip}, {outside}");
}

#[test]
fn what_walls_keep_dark_is_so_from_kept_blocks_too() {
    let baked = room_of_slabs(0.05, 9, (128, "rgb"));
    let files = baked.bundle.manifest().files.clone();
    let plan =
        Plan::new(Site::read(baked.folder.path()).unwrap(), BakeOptions::new(baked.folder.path().join("bundle"))).unwrap();
    let kept = fs::read_dir(plan.cache_root()).unwrap().flatten().flat_map(|folder| fs::read_dir(folder.path()).unwrap());
    let of_all = kept.flatten().filter(|file| file.file_name().to_string_lossy().starts_with("texel-light-"));
    assert_eq!(of_all.map(|file| fs::remove_file(file.path()).unwrap()).count(), 1);
    fs::rename(baked.folder.path().join("bundle"), baked.folder.path().join("before")).unwrap();
    let (report, again) = bake_again(baked.folder.path());
    assert_eq!(again.manifest().files, files);
    for stage in ["sun on texels", "sky on texels", "bounced sun on texels"] {
        let all = |stage: &str| report.taken.iter().any(|taken| taken.stage == stage && taken.blocks == taken.of);
        assert!(all(stage), "{stage}: {:?}", report.taken);
    }
}

#[test]
fn a_wall_in_the_open_keeps_its_sun() {
    let site = format!(
        "[site]\nname = \"A wall\"\n[[part]]\nfile = \"wall.obj\"\nlight = \"texel\"\n{SKY}[bake]\nsamples = 64\nbounces = 1\ntexels = 128\n"
    );
    let ground = (Vec3::new(-4.0, 0.0, 4.0), Vec3::X * 8.0, Vec3::NEG_Z * 8.0, 1);
    let wall = cuboid(Vec3::new(-0.05, 0.0, -3.0), Vec3::new(0.0, 2.0, 3.0), 1, false);
    let baked = bake_site(&site, &[("wall.obj", rectangles(&[vec![ground], wall].concat()))]);
    let texel_m = 1.0 / baked.bundle.manifest().texels.as_ref().unwrap().per_m;
    let (mut sunlit, mut shaded) = (0, 0);
    baked.shown(
        24.0,
        |normal| normal.y > 0.5,
        |p, _, light| {
            if p.y == 0.0 && p.z.abs() < 2.0 && p.x.abs() > texel_m && p.x.abs() < 1.5 {
                assert_eq!(light.sun.x > 1.0, p.x > 0.0, "{p}: {}", light.sun);
                *(if p.x > 0.0 { &mut sunlit } else { &mut shaded }) += 1;
            }
        },
    );
    assert!(texel_m > 0.05 && sunlit.min(shaded) > 1000, "{texel_m}: {sunlit} and {shaded}");
}

#[test]
fn what_an_atlas_cannot_hold_is_told_before_anything_is_traced() {
    let folder = tempfile::tempdir().unwrap();
    let site = |texels: u32| {
        format!("[site]\nname = \"a\"\n[[part]]\nfile = \"a.obj\"\nlight = \"texel\"\n{SKY}[bake]\ntexels = {texels}\n")
    };
    let boxes: Vec<_> = (0..60_u8)
        .flat_map(|i| cuboid(Vec3::splat(3.0 * f32::from(i)), Vec3::splat(3.0 * f32::from(i) + 1.0), 1, false))
        .collect();
    fs::write(folder.path().join("a.obj"), rectangles(&boxes)).unwrap();
    sky().write_hdr(folder.path().join("sky.hdr")).unwrap();
    fs::write(folder.path().join("site.toml"), site(64)).unwrap();
    let plan = Plan::new(Site::read(folder.path()).unwrap(), BakeOptions::new(folder.path().join("bundle"))).unwrap();
    let error = bake(&plan, &Silent).unwrap_err().to_string();
    assert!(error.contains("360 charts") && error.contains("64 x 64 texels"), "{error}");
    // 19 by 19 squares of four texels
    assert!(error.contains("write texels = 76 or more in [bake]"), "{error}");
    // and to shards, though the merge alone needs it
    assert_eq!(begin_shards(&plan, 2, &Silent).unwrap_err().to_string(), error);
    assert_eq!(bake_shard(&plan, "1/2".parse().unwrap(), None, &Silent).unwrap_err().to_string(), error);
    // and by a check, which does not know what preparation will leave
    let check_of = |text: String| {
        fs::write(folder.path().join("site.toml"), text).unwrap();
        check(&Site::read(folder.path()).unwrap(), &Silent)
    };
    assert_eq!(check_of(site(64)).unwrap_err().to_string(), error);
    let prepared = |texels| site(texels) + "[prepare]\n";
    let warnings = check_of(prepared(64)).unwrap().warnings;
    let of_atlas: Vec<_> = warnings.iter().filter(|warning| warning.contains("360 charts")).collect();
    assert!(of_atlas.len() == 1 && of_atlas[0].starts_with("of the parts as they are before [prepare]: "), "{warnings:?}");
    assert!(check_of(prepared(76)).unwrap().warnings.iter().all(|warning| !warning.contains("charts")));
    // and that does
    fs::write(folder.path().join("site.toml"), site(76)).unwrap();
    let plan = Plan::new(Site::read(folder.path()).unwrap(), BakeOptions::new(folder.path().join("bundle"))).unwrap();
    bake(&plan, &Silent).unwrap();
    for wrong in [2, 130, 20_000] {
        fs::write(folder.path().join("site.toml"), site(wrong)).unwrap();
        let error = Site::read(folder.path()).unwrap_err().to_string();
        assert!(error.contains("texels"), "{wrong}: {error}");
    }
}

#[test]
fn an_atlas_counts_in_the_memory_that_a_bake_needs() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.obj"), rectangles(&[(Vec3::ZERO, Vec3::X, Vec3::NEG_Z, 1)])).unwrap();
    sky().write_hdr(folder.path().join("sky.hdr")).unwrap();
    let baked = |light: &str, texels: u32| {
        let site = format!(
            "[site]\nname = \"a\"\n[[part]]\nfile = \"a.obj\"\nlight = \"{light}\"\n{SKY}[bake]\nsamples = 16\nbounces = 0\ntexels = {texels}\n[budget]\nbake_mib = 200\n"
        );
        fs::write(folder.path().join("site.toml"), site).unwrap();
        bake(&Plan::new(Site::read(folder.path()).unwrap(), BakeOptions::new(folder.path().join("bundle"))).unwrap(), &Silent)
    };
    let refused = baked("texel", 2048).unwrap_err().to_string();
    assert!(refused.contains("the light") && refused.contains("bake_mib"), "{refused}");
    baked("texel", 128).unwrap();
    baked("vertex", 2048).unwrap();
}

#[test]
fn left_to_itself_a_part_is_lit_by_texels_where_its_triangles_are_large_and_there_is_an_atlas() {
    let bake_with = |texels: &str| {
        let site = format!(
            "[site]\nname = \"a\"\n[[part]]\nfile = \"coarse.obj\"\n[[part]]\nfile = \"dense.obj\"\n{SKY}[bake]\nsamples = 16\nbounces = 0\n{texels}"
        );
        let plate = |x: f32, parts: u32| rectangles(&[(Vec3::new(x, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, parts)]);
        bake_site(&site, &[("coarse.obj", plate(-4.0, 2)), ("dense.obj", plate(0.0, 40))])
    };
    let by_texels =
        |baked: &Baked| baked.chunks().iter().map(|chunk| (chunk.part, !chunk.texel_uvs.is_empty())).collect::<Vec<_>>();
    assert_eq!(by_texels(&bake_with("texels = 128\n")), [(0, true), (1, false)]);
    assert_eq!(by_texels(&bake_with("")), [(0, false), (1, false)]);
}

/// A closed room of slabs so thick that touch and reach into each other, on a floor that goes on outside, of so many squares a side.
fn room_of_slabs(thickness: f32, squares: u32, (texels, transfer): (u32, &str)) -> Baked {
    let site = format!(
        "[site]\nname = \"A room\"\n[[part]]\nfile = \"room.obj\"\nlight = \"texel\"\n{SKY}[bake]\nsamples = 64\nbounces = 3\ntransfer = \"{transfer}\"\ntexels = {texels}\n"
    );
    let t = thickness;
    let floor = cuboid(Vec3::new(-2.0, -t, -2.0), Vec3::new(7.0, 0.0, 7.0), squares, false);
    let slabs = [
        (Vec3::new(-t, 0.0, -t), Vec3::new(0.0, 3.0, 5.0 + t)),
        (Vec3::new(4.0, 0.0, -t), Vec3::new(4.0 + t, 3.0, 5.0 + t)),
        (Vec3::new(-0.5 * t, -0.5 * t, -t), Vec3::new(4.0 + 0.5 * t, 3.0 + 0.5 * t, 0.0)),
        (Vec3::new(0.0, 0.0, 5.0), Vec3::new(4.0, 3.0, 5.0 + t)),
        (Vec3::new(-t, 3.0, -t), Vec3::new(4.0 + t, 3.0 + t, 5.0 + t)),
    ];
    let slabs = slabs.into_iter().flat_map(|(low, high)| cuboid(low, high, 1, false));
    let slabs: Vec<_> = floor.into_iter().chain(slabs).collect();
    bake_site(&site, &[("room.obj", rectangles(&slabs))])
}

#[test]
fn walls_thinner_than_a_texel_keep_a_room_dark() {
    // Cells of the vertices' solve, in which surfaces reflect, end at walls where squares do. Where they do not a little light comes in with them, and of the bounced sun with
    // those of thicker walls, which is no matter of texels.
    let mono = (128, "mono");
    for (thickness, squares, atlas, brought_in) in [
        (0.05, 9, mono, 0.0),
        (0.05, 9, (256, "rgb"), 0.0),
        (0.15, 9, (128, "rgb"), 1.0e-3),
        (0.05, 1, mono, 2.0e-2),
        (0.05, 1, (256, "rgb"), 2.0e-2),
    ] {
        let baked = room_of_slabs(thickness, squares, atlas);
        let manifest = baked.bundle.manifest();
        let texel_m = 1.0 / manifest.texels.as_ref().unwrap().per_m;
        assert!(texel_m > thickness && manifest.light.bounce_floats() > 0, "{texel_m}");
        // at the foot of walls, farther inside, and outside
        let (mut most, mut counts) = ([[0.0_f32; 3]; 3], [0; 3]);
        let is_level = |normal: Vec3| normal.y.abs() > 0.5;
        baked.shown(24.0, is_level, |p, normal, light| {
            let from_wall = p.x.min(4.0 - p.x).min(p.z).min(5.0 - p.z);
            let is_floor = p.y == 0.0 && normal.y > 0.0;
            let place = if from_wall > 2e-3 && (is_floor || (p.y == 3.0 && normal.y < 0.0)) {
                // within a texel of the coarsest level, that of the bounced sun
                usize::from(from_wall > 4.0 * texel_m)
            } else if is_floor && from_wall < -0.4 {
                2
            } else {
                return;
            };
            counts[place] += 1;
            let lights = [light.sun, light.sky, light.bounce];
            most[place].iter_mut().zip(lights).for_each(|(most, light)| *most = most.max(light.max_element()));
        });
        let [foot, inside, outside] = most;
        let told = format!(
            "{thickness}, {squares} squares, {atlas:?}, texels of {texel_m} m: sun, sky and bounce {foot:?}, {inside:?}, {outside:?}"
        );
        assert!(counts.iter().all(|count| *count > 1000) && outside.iter().all(|light| *light > 0.0), "{told}");
        let is_within =
            |lights: [f32; 3], part: f32| lights.iter().zip(outside).all(|(light, outside)| *light <= part * outside);
        assert!(is_within(foot, f32::max(brought_in, 1.0e-3)) && is_within(inside, brought_in), "{told}");
    }
}
