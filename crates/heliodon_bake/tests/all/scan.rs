//! Bakes of prepared scans with the scan itself beside what is drawn: it is what stands behind that, in the light that it would have by itself.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use crate::waves::{PREPARE, baked, own_cache, plan, red, sheet, site};
use glam::Vec3;
use heliodon_bake::bake::bake;
use heliodon_bake::merge::{bake_shard, begin_shards, merge};
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bake::prepare::prepare;
use heliodon_bake::report::{Collector, Silent};
use heliodon_bundle::moment::{Blend, Day};
use heliodon_bundle::shade::vertex_light;
use heliodon_bundle::site::Site;
use heliodon_bundle::{BundleReader, LitChunk};
use heliodon_image::SrgbImage;
use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const SCAN: &str = "scan = true\n";

/// The wall with waves under a sky whose sun goes its way, with more behind it that no eye sees, and a board with a picture on it.
fn many_suns() -> TempDir {
    let folder = site(&format!("{PREPARE}{SCAN}"));
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("hidden.ply", &sheet(20, |s, t| Vec3::new(7.0, 1.0 + s, 1.0 - 2.0 * t), |_| [90; 3]));
    let board = "v 3 0.5 3\nv 3 0.5 4\nv 3 1.5 4\nv 3 1.5 3\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    write("board.obj", board);
    fs::write(folder.path().join("board.png"), SrgbImage::filled(4, 4, [200, 100, 50, 255]).to_png_bytes().unwrap()).unwrap();
    let text = fs::read_to_string(folder.path().join("site.toml")).unwrap();
    let parts = "[[part]]\nfile = \"hidden.ply\"\n[[part]]\nfile = \"board.obj\"\nalbedo = \"board.png\"\n[sky]\n";
    let text = text
        .replace("waves\"\n", "waves\"\nlatitude_deg = 38.0\nlongitude_deg = 23.7\nutc_offset = \"+02:00\"\n")
        .replace("[sky]\n", parts)
        .replace("probes = \"sky.hdr\"\nmapping = \"lat-long\"\n", "model = \"atmosphere\"\ndate = \"2024-05-01\"\n")
        .replace("samples = 32\n", "samples = 64\nsun_steps = 12\noffset_m = 0.001\n");
    write("site.toml", &text);
    folder
}

fn chunks(bundle: &BundleReader) -> Vec<LitChunk> {
    (0..bundle.chunk_count()).map(|chunk| bundle.read_chunk(chunk).unwrap()).collect()
}

fn bits(p: Vec3) -> [u32; 3] {
    p.to_array().map(f32::to_bits)
}

/// A triangle by the places of its corners, from the least on.
fn told(corners: [Vec3; 3]) -> [[u32; 3]; 3] {
    let mut corners = corners.map(bits);
    let least = (0..3).min_by_key(|&i| corners[i]).unwrap();
    corners.rotate_left(least);
    corners
}

#[test]
fn it_is_the_original_behind_what_is_drawn_in_its_own_light() {
    let folder = many_suns();
    let (report, bundle) = baked(folder.path(), "bundle");
    bundle.verify().unwrap();
    let scan = bundle.scan().unwrap().unwrap();
    scan.verify().unwrap();
    let manifest = bundle.manifest();
    assert_eq!((manifest.version, manifest.scan), (9, Some(scan.manifest().counts)));
    let triangles: Vec<u64> = scan.manifest().parts.iter().map(|part| part.counts.triangles).collect();
    let drawn: Vec<u64> = manifest.parts.iter().map(|part| part.counts.triangles).collect();
    assert!(triangles[0] > 20 * drawn[0] && triangles[1] >= drawn[1], "{triangles:?} {drawn:?}");
    assert_eq!((drawn[2], triangles[2], triangles[3]), (0, 0, 0), "nobody sees it; it has a texture");
    assert!(drawn[3] > 0);
    assert!(report.measures["scan_gather_rays"] > 0.0 && report.measures["scan_mask_rays"] > 0.0);

    // triangle for triangle
    let plan = plan(folder.path(), "bundle");
    let scene = prepare(&plan, plan.site.prepare.as_ref().unwrap(), None, &Silent).unwrap().scene;
    let original = scene.original.as_ref().unwrap();
    let is_shown = |stand_in: usize| scene.parts[..3].iter().any(|part| part.drawn_triangles().contains(&stand_in));
    let behind = original.triangles.iter().zip(&original.stands_for).filter(|&(_, &stand_in)| is_shown(stand_in as usize));
    let expected: HashSet<_> = behind.map(|(t, _)| told(t.map(|v| original.positions[v as usize]))).collect();
    let of_scan = chunks(&scan);
    let found: HashSet<_> =
        of_scan.iter().flat_map(|c| c.triangles.iter().map(|t| told(t.map(|v| c.positions[v as usize])))).collect();
    assert_eq!(scan.triangle_count(), found.len() as u64);
    assert!(found == expected, "{} {}", found.len(), expected.len());

    // the same site as it was scanned
    let text = fs::read_to_string(folder.path().join("site.toml")).unwrap();
    fs::write(folder.path().join("site.toml"), text.replace(&format!("{PREPARE}{SCAN}"), "")).unwrap();
    let (_, bare) = baked(folder.path(), "bare");
    assert!(bare.scan().unwrap().is_none());
    let of_bare = chunks(&bare);
    let mut places = HashMap::new();
    for (number, chunk) in of_bare.iter().enumerate() {
        places.extend(chunk.positions.iter().enumerate().map(|(vertex, &p)| ((chunk.part, bits(p)), (number, vertex))));
    }
    let [moment, bare_moment] = [&scan, &bare].map(|bundle| Day::new(bundle.lapse().clone()).at(11.0 * 3600.0, Blend::Smooth));
    let (mut compared, mut masks, mut lit, mut off, mut sum) = (0_u32, 0_u32, 0_u32, 0.0_f32, 0.0_f32);
    for chunk in &of_scan {
        for (vertex, &p) in chunk.positions.iter().enumerate() {
            let Some(&(number, other)) = places.get(&(chunk.part, bits(p))) else { continue };
            let bare = &of_bare[number];
            assert!(chunk.normals[vertex].dot(bare.normals[other]) > 0.999, "{p}");
            assert!((chunk.albedo[vertex] - bare.albedo[other]).abs().max_element() < 1.0e-3, "{p}");
            if chunk.valid[vertex] == 0 || bare.valid[other] == 0 {
                continue;
            }
            compared += 1;
            for step in 0..12 {
                let [own, bares] = [(&chunk.light, vertex), (&bare.light, other)].map(|(light, v)| light.sun_reaches(v, step));
                masks += u32::from(own == bares);
                lit += u32::from(own);
            }
            let own = vertex_light(&moment, &chunk.light, vertex, chunk.normals[vertex]);
            let by_itself = vertex_light(&bare_moment, &bare.light, other, bare.normals[other]);
            off += (own.sky - by_itself.sky).abs().element_sum();
            sum += by_itself.sky.element_sum();
        }
    }
    let vertices = u32::try_from(scan.vertex_count()).unwrap();
    assert!(compared > vertices * 8 / 10, "{compared} of {vertices}");
    assert!(lit > compared && lit < 11 * compared, "{lit}");
    assert!(masks > 12 * compared / 1000 * 995, "{masks} of {}", 12 * compared);
    assert!(off < 0.03 * sum, "{off} of {sum}");
    // how finely the day of the bounced sun is told depends on how much is drawn: what is drawn is the measure here
    // by areas, for along a border that parts share vertices are as dense as they were scanned
    let bounced = |chunks: &[LitChunk]| {
        let (mut area, mut light) = (0.0_f32, 0.0_f32);
        for c in chunks.iter().filter(|chunk| chunk.part == 0) {
            let of = |v: u32| vertex_light(&moment, &c.light, v as usize, c.normals[v as usize]).bounce.x;
            for t in &c.triangles {
                let [p, q, r] = t.map(|v| c.positions[v as usize]);
                let double = (q - p).cross(r - p).length();
                area += double;
                light += double * t.map(of).iter().sum::<f32>() / 3.0;
            }
        }
        light / area
    };
    let (own, drawn) = (bounced(&of_scan), bounced(&chunks(&bundle)));
    assert!(own > 0.1 && (own / drawn - 1.0).abs() < 0.01, "{own} {drawn}");
    // and its own colours
    let wall = of_scan.iter().filter(|chunk| chunk.part == 0);
    assert!(wall.flat_map(|c| c.positions.iter().zip(&c.albedo)).all(|(p, albedo)| (albedo.x - red(p.z)).abs() < 0.01));
}

/// All of a bundle's files, whose bytes the manifest tells.
fn files(folder: &Path, bundle: &str) -> Vec<u8> {
    fs::read(folder.join(bundle).join("manifest.json")).unwrap()
}

#[test]
fn however_it_is_come_by_it_has_the_same_bytes() {
    let folder = site(&format!("{PREPARE}{SCAN}panorama = 64\n"));
    let (_, bundle) = baked(folder.path(), "whole");
    assert!(bundle.scan().unwrap().is_some() && bundle.read_panorama().unwrap().is_some());
    let whole = files(folder.path(), "whole");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| bake(&own_cache(folder.path(), "single"), &Silent).unwrap());
    assert!(files(folder.path(), "single") == whole, "one thread");
    let sharded = own_cache(folder.path(), "sharded");
    begin_shards(&sharded, 2, &Silent).unwrap();
    for shard in ["1/2", "2/2"] {
        bake_shard(&sharded, shard.parse().unwrap(), None, &Silent).unwrap();
    }
    merge(&sharded, &Silent).unwrap();
    assert!(files(folder.path(), "sharded") == whole, "two shards");

    // what is finished is taken as it is; what is lost or damaged of it is solved again
    let notes = |cut: &dyn Fn(&Path)| {
        let cache = folder.path().join("single-cache");
        for block in fs::read_dir(&cache).unwrap().flat_map(|entry| fs::read_dir(entry.unwrap().path()).unwrap()) {
            cut(&block.unwrap().path());
        }
        let heard = Collector::default();
        let plan = own_cache(folder.path(), "single");
        let options = BakeOptions { again: true, ..plan.options.clone() };
        bake(&Plan::new(Site::read(folder.path()).unwrap(), options).unwrap(), &heard).unwrap();
        assert!(files(folder.path(), "single") == whole);
        heard.heard().notes
    };
    let is = |block: &Path, begin: &str| block.file_name().unwrap().to_string_lossy().starts_with(begin);
    let said = |notes: &[String], what: &str| notes.iter().any(|note| note.contains(what));
    let finished = notes(&|_| ());
    assert!(said(&finished, "the light is solved"), "{finished:?}");
    let lost = notes(&|block| {
        if is(block, "scan-light") {
            fs::remove_file(block).unwrap();
        }
    });
    assert!(
        !said(&lost, "the light is solved") && said(&lost, "blocks of sky and bounced sun on the scan are done"),
        "{lost:?}"
    );
    let damaged = notes(&|block| {
        if is(block, "scan-light") {
            fs::write(block, "damaged").unwrap();
        } else if is(block, "scan-sky") {
            fs::remove_file(block).unwrap();
        }
    });
    assert!(said(&damaged, "blocks of sun on the scan are done"), "{damaged:?}");
    assert!(!said(&damaged, "on the scan is done again") && !said(&damaged, "bounced sun on the scan are"), "{damaged:?}");
}

#[test]
fn other_suns_ask_nothing_of_the_sky_again_where_none_bounces() {
    let folder = many_suns();
    let site = folder.path().join("site.toml");
    let text = fs::read_to_string(&site).unwrap().replace("sun_steps = 12\n", "sun_steps = 12\nsun_bounce = false\n");
    fs::write(&site, &text).unwrap();
    baked(folder.path(), "kept");
    fs::write(&site, text.replace("sun_steps = 12\n", "sun_steps = 9\n")).unwrap();
    let (report, _) = baked(folder.path(), "kept");
    let taken =
        |stage: &str| report.taken.iter().find(|taken| taken.stage == stage).map(|taken| [taken.blocks, taken.of]).unwrap();
    let [known, all] = taken("sky and bounced sun on the scan");
    assert!(known == all && all > 1, "{known} of {all}");
    assert_eq!(taken("sun on the scan")[0], 0);
    bake(&own_cache(folder.path(), "anew"), &Silent).unwrap();
    assert!(files(folder.path(), "kept") == files(folder.path(), "anew"));
}

#[test]
fn to_want_it_prepares_nothing_again_and_to_want_it_no_more_leaves_nothing() {
    let folder = site(&format!("{PREPARE}panorama = 64\n"));
    let (_, first) = baked(folder.path(), "bundle");
    assert_eq!((first.manifest().version, first.manifest().scan), (7, None));
    let before = files(folder.path(), "bundle");
    let text = fs::read_to_string(folder.path().join("site.toml")).unwrap();
    fs::write(folder.path().join("site.toml"), format!("{text}{SCAN}")).unwrap();
    let heard = Collector::default();
    bake(&plan(folder.path(), "bundle"), &heard).unwrap();
    let notes = heard.heard().notes;
    assert!(notes.iter().any(|note| note.contains("geometry is prepared")), "{notes:?}");
    assert!(BundleReader::open(folder.path().join("bundle")).unwrap().scan().unwrap().is_some());
    fs::write(folder.path().join("site.toml"), text).unwrap();
    baked(folder.path(), "bundle");
    assert!(files(folder.path(), "bundle") == before && !folder.path().join("bundle/scan").exists());
}

#[test]
fn a_site_of_which_nothing_can_be_in_it_says_so_and_has_none() {
    // what its triangles decide is known only when they are read
    let folder = site(&format!("{PREPARE}{SCAN}"));
    let text = fs::read_to_string(folder.path().join("site.toml")).unwrap();
    let (head, rest) = text.split_once("[[part]]").unwrap();
    let (_, rest) = rest.split_once("[sky]").unwrap();
    let text =
        format!("{head}[[part]]\nfile = \"slab.obj\"\n[sky]{}", rest.replace("bounces = 1\n", "bounces = 1\ntexels = 128\n"));
    fs::write(folder.path().join("slab.obj"), "v 3 0 -2\nv 3 0 2\nv 3 3 2\nv 3 3 -2\nf 1 2 3 4\n").unwrap();
    fs::write(folder.path().join("site.toml"), text).unwrap();
    let (report, bundle) = baked(folder.path(), "bundle");
    assert!(bundle.manifest().texels.is_some() && bundle.scan().unwrap().is_none());
    assert!(report.warnings.iter().any(|warning| warning.contains("[prepare] scan")), "{:?}", report.warnings);
}

#[test]
fn what_a_scan_cannot_be_is_told() {
    let error = |more: &str, from: &str, to: &str| {
        let folder = site(more);
        let text = fs::read_to_string(folder.path().join("site.toml")).unwrap();
        fs::write(folder.path().join("site.toml"), text.replace(from, to)).unwrap();
        Site::read(folder.path()).map(|_| ()).map_err(|error| error.to_string())
    };
    let weathered = error("[prepare]\nscan = true\n[weathering]\ndust = 0.5\n", "", "").unwrap_err();
    assert!(weathered.contains("[weathering]") && weathered.contains("take one of them out"), "{weathered}");
    let by_texels = |files: &[&str]| {
        let folder = site("[prepare]\nscan = true\n");
        let mut site = fs::read_to_string(folder.path().join("site.toml")).unwrap();
        for file in files {
            let part = format!("file = \"{file}\"\n");
            site = site.replace(&part, &format!("{part}light = \"texel\"\n"));
        }
        fs::write(folder.path().join("site.toml"), site.replace("bounces = 1\n", "bounces = 1\ntexels = 128\n")).unwrap();
        Site::read(folder.path()).map(|_| ()).map_err(|error| error.to_string())
    };
    by_texels(&["wall.ply"]).unwrap();
    let none = by_texels(&["wall.ply", "ground.ply"]).unwrap_err();
    assert!(none.contains("parts that are lit by texels or have textures") && none.contains("take scan out"), "{none}");
    // without a room nothing is left out, and with several it is what all of them see
    error(
        "[prepare]\nscan = true\n",
        "[[room]]\nname = \"before the wall\"\nmin = [-0.5, 1.2, -0.5]\nmax = [0.5, 1.8, 0.5]\n",
        "",
    )
    .unwrap();
}
