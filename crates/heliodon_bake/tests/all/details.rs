//! Details of some of a part's materials, on their way into a bundle.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::Vec3;
use heliodon_bake::bake::bake;
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bake::report::Collector;
use heliodon_bundle::BundleReader;
use heliodon_bundle::site::Site;
use heliodon_image::HdrImage;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;

/// Squares side by side, each of a material of its own.
fn squares(materials: &[&str]) -> String {
    let mut text = "mtllib looks.mtl\n".to_owned();
    for (i, material) in materials.iter().enumerate() {
        let first = 4 * i + 1;
        for [x, z] in [[0, 0], [0, 1], [1, 1], [1, 0]] {
            writeln!(text, "v {} 0 {}", 2 * (i + x), 2 * z).unwrap();
        }
        writeln!(text, "usemtl {material}\nf {first} {} {} {}", first + 1, first + 2, first + 3).unwrap();
    }
    text
}

/// Bakes the squares, whose materials have looks or names alone, and answers with the details of the chunks over each, by the lower corner along x, and the warnings.
fn baked(more: &str, light: &str, has_looks: bool) -> (BTreeMap<i32, Option<String>>, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let site = format!(
        "[site]\nname = \"squares\"\n[[part]]\nfile = \"squares.obj\"\nlight = \"{light}\"\n\
        detail = [{{ material = \"oak*\", kind = \"wood\" }}, {{ material = \"none\", kind = \"noise\" }}, {{ material = \"paving\", kind = \"stone\", mapping = \"uv\" }}]\n\
        [sky]\nprobes = \"sky.hdr\"\nmapping = \"lat-long\"\n[bake]\nsamples = 16\nbounces = 0\ntexels = 64\n\
        [[room]]\nname = \"above\"\nmin = [0, 1, 0]\nmax = [8, 2, 2]\n{more}"
    );
    fs::write(folder.path().join("site.toml"), site).unwrap();
    fs::write(folder.path().join("squares.obj"), squares(&["oak_beam", "paving", "gold", "oak"])).unwrap();
    // two look the same, and are two all the same
    let look = |(name, shade): (&str, f32)| format!("newmtl {name}\nKd {shade} {shade} {shade}\n");
    let looks: String = [("oak_beam", 0.5), ("paving", 0.5), ("gold", 0.7), ("oak", 0.3)].map(look).concat();
    fs::write(folder.path().join("looks.mtl"), if has_looks { looks } else { String::new() }).unwrap();
    HdrImage::filled(16, 8, Vec3::ONE).write_hdr(folder.path().join("sky.hdr")).unwrap();
    let plan = Plan::new(Site::read(folder.path()).unwrap(), BakeOptions::new(folder.path().join("bundle"))).unwrap();
    let heard = Collector::default();
    bake(&plan, &heard).unwrap();
    let bundle = BundleReader::open(folder.path().join("bundle")).unwrap();
    bundle.verify().unwrap();
    let mut found: BTreeMap<i32, Option<String>> = BTreeMap::new();
    for index in 0..bundle.chunk_count() {
        let (chunk, info) = (bundle.read_chunk(index).unwrap(), bundle.chunk_info(index));
        let detail = bundle.manifest().parts[0].detail_of(chunk.detail);
        assert_eq!((chunk.detail, info.by_texels), (info.detail, light == "texel"));
        for triangle in &chunk.triangles {
            let middle = triangle.iter().map(|&v| chunk.positions[v as usize].x).sum::<f32>() / 3.0;
            let square = 2 * (middle / 2.0) as i32;
            let file = detail.map(|detail| detail.file.clone());
            assert_eq!(found.entry(square).or_insert_with(|| file.clone()), &file, "one detail for each square");
        }
    }
    (found, heard.heard().warnings)
}

#[test]
fn every_material_has_the_first_detail_that_is_for_it() {
    let [wood, stone] = [0, 2].map(|k| Some(format!("detail/{k}.png")));
    let wanted = BTreeMap::from([(0, wood.clone()), (2, stone), (4, None), (6, wood)]);
    for (more, light, has_looks) in [
        ("", "vertex", true),
        ("", "texel", true),
        ("[prepare]\n", "vertex", true),
        ("", "vertex", false),
        ("[prepare]\n", "vertex", false),
    ] {
        let (found, warnings) = baked(more, light, has_looks);
        assert_eq!(found, wanted, "{more} {light} {has_looks}");
        let told = |words: &str| assert!(warnings.iter().any(|warning| warning.contains(words)), "{words}: {warnings:?}");
        told("no material `none` of its detail is left for it; there are: gold, oak, oak_beam, paving");
        told("triangles have no texture, whose coordinates its detail goes by");
    }
}
