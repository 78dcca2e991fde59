//! Details of parts: what `site.toml` may say of them, and their way into a bundle and out of it.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use crate::common::{MONO, chunk, lapse, meta};
use heliodon_bundle::detail::DetailInfo;
use heliodon_bundle::layout::{DETAIL_FORMAT_VERSION, FORMAT_VERSION};
use heliodon_bundle::site::{Along, Detail, DetailMapping, DetailPattern, InputKind, Site};
use heliodon_bundle::{BundleReader, BundleWriter, LitChunk};
use heliodon_image::detail::DetailTexture;

fn site(detail: &str) -> String {
    format!(
        "[site]\nname = \"a\"\n[[part]]\nfile = \"a.ply\"\ndetail = {detail}\n[sky]\nprobes = \"a.hdr\"\nmapping = \"angular\"\n"
    )
}

fn told(detail: &str) -> String {
    Site::parse(&site(detail), "s/site.toml").expect_err(detail).to_string()
}

#[test]
fn a_site_says_it_in_a_line() {
    let read = |detail: &str| Site::parse(&site(detail), "s/site.toml").unwrap();
    let stone = read("{ kind = \"stone\" }");
    assert_eq!(stone.parts[0].detail, [Detail::of_kind(DetailPattern::Stone)]);
    let wood = "{ kind = \"wood\", texels = 512, seed = 3, size_m = 0.5, along = \"x\", strength = 0.75, near_m = 4 }";
    let wood = read(wood).parts[0].detail[0].clone();
    assert_eq!((wood.tiles(), wood.along, wood.strength, wood.near_m), (2.0, Along::X, 0.75, 4.0));
    let params = wood.generated().unwrap();
    assert_eq!((params.kind.name(), params.size, params.seed), ("wood", 512, 3));
    let uv = read("{ file = \"detail/stone.png\", mapping = \"uv\", repeat = 8, correct = true }");
    let detail = &uv.parts[0].detail[0];
    assert_eq!((detail.mapping, detail.tiles()), (DetailMapping::Uv, 8.0));
    // what is written for people to go on from says the same
    let several =
        "[{ material = \"oak*\", kind = \"wood\" }, { material = \"wall?\", kind = \"plaster\" }, { kind = \"stone\" }]";
    let (several, one) = (read(several), read("{ material = \"oak\", kind = \"wood\" }"));
    let fits = |name: &str| several.parts[0].detail.iter().position(|detail| detail.is_for(name));
    assert_eq!(["oak, old", "wall2", "wall", ""].map(fits), [Some(0), Some(1), Some(2), Some(2)]);
    // names have brackets, and two stars are one
    let brackets = read("[{ material = \"[Wood **Floor]\", kind = \"wood\" }, { material = \"a[\", kind = \"plaster\" }]");
    let fits = |name: &str| brackets.parts[0].detail.iter().position(|detail| detail.is_for(name));
    assert_eq!(["[Wood Floor]", "[Wood old Floor]", "W", "a["].map(fits), [Some(0), Some(0), None, Some(1)]);
    for site in [stone, uv, several, one] {
        let text = site.file().to_toml_string();
        assert_eq!(Site::parse(&text, "s/site.toml").unwrap().parts[0].detail, site.parts[0].detail, "{text}");
    }
}

#[test]
fn slips_are_told_with_their_place_and_remedy() {
    for (detail, words) in [
        ("{}", &["5:1", "neither a file nor a kind", "add kind"][..]),
        ("{ kind = \"stone\", file = \"a.png\" }", &["5:19", "both a file and a kind"]),
        ("{ kind = \"marble\" }", &["noise, stone, plaster, wood"]),
        ("{ kind = \"stone\", texels = 100 }", &["texels is 100", "64, 128, 256 or 512"]),
        ("{ file = \"a.png\", texels = 128 }", &["belongs to a built-in kind"]),
        ("{ kind = \"stone\", correct = true }", &["correct belongs to a file"]),
        ("{ kind = \"stone\", repeat = 2 }", &["repeat belongs to mapping", "give size_m"]),
        ("{ kind = \"stone\", mapping = \"uv\", size_m = 2 }", &["size_m belongs to", "give repeat"]),
        ("{ kind = \"stone\", size_m = 0 }", &["size_m is 0", "0.001 to 1000"]),
        ("{ kind = \"stone\", strength = 1.5 }", &["strength is 1.5", "from 0 to 1"]),
        ("{ kind = \"stone\", near_m = nan }", &["near_m is NaN"]),
        ("{ kind = \"stone\", maping = \"uv\" }", &["did you mean `mapping`?"]),
        ("{ kind = \"stone\", along = \"up\" }", &["write one of: x, y, z"]),
        ("\"stone\"", &["[part.detail], or several, [[part.detail]]"]),
        ("[{ material = \"a\", kind = \"stone\" }, {}]", &["5:44", "neither a file nor a kind"]),
        ("[{ kind = \"stone\" }, { material = \"a\", kind = \"wood\" }]", &["never used", "put it last"]),
        ("{ material = \"\", kind = \"wood\" }", &["material"]),
        ("{ material = \"a\", kind = \"wood\" }\nalbedo = [0.5, 0.5, 0.5]", &["takes the place of its materials"]),
    ] {
        let message = told(detail);
        // an inline table's key has its own place, or that of the table
        for word in words.iter().filter(|word| !word.contains(':') || word.contains(' ')) {
            assert!(message.contains(word), "`{word}` is not in: {message}");
        }
        assert!(message.starts_with("s/site.toml:5:"), "{message}");
    }
}

#[test]
fn its_image_is_among_the_site_s_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("site.toml");
    std::fs::write(&path, site("{ file = \"stone.png\" }")).unwrap();
    for name in ["a.ply", "a.hdr"] {
        std::fs::write(folder.path().join(name), "x").unwrap();
    }
    let missing = Site::read(&path).unwrap_err().to_string();
    assert!(missing.contains("there is no file `stone.png`") && missing.contains("site.toml:5:"), "{missing}");
    std::fs::write(folder.path().join("stone.png"), "x").unwrap();
    let files = Site::read(&path).unwrap().input_files().unwrap();
    assert_eq!((files[1].kind, files[1].name.as_str()), (InputKind::Detail(0, 0), "stone.png"));
}

fn stone() -> DetailTexture {
    DetailTexture::generate(&Detail::of_kind(DetailPattern::Stone).generated().unwrap()).unwrap()
}

#[test]
fn a_detail_reads_back_and_parts_share_its_image() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    let mut writer = BundleWriter::create(&target, meta(MONO)).unwrap();
    let (near, far) = (Detail::of_kind(DetailPattern::Stone), Detail { near_m: 30.0, ..Detail::of_kind(DetailPattern::Stone) });
    writer.add_detail(0, &stone(), &near).unwrap();
    writer.add_detail(1, &stone(), &far).unwrap();
    assert!(writer.add_detail(1, &stone(), &far).unwrap_err().to_string().contains("already"));
    assert!(writer.add_detail(2, &stone(), &far).unwrap_err().to_string().contains("no such part"));
    for part in [0, 1] {
        writer.push_chunk(&chunk(MONO, part, None, 4, 0.0)).unwrap();
    }
    for path in ["sky/0000.hdr", "sky/0001.hdr"] {
        writer.add_sky_map(path, b"unread").unwrap();
    }
    let manifest = writer.finish(&lapse(MONO)).unwrap();
    assert_eq!(manifest.version, DETAIL_FORMAT_VERSION);
    let of = |part: usize| manifest.parts[part].detail.clone().unwrap();
    assert_eq!(of(0), DetailInfo::new("detail/0.png".to_owned(), &near));
    assert_eq!((of(1).file.as_str(), of(1).near_m), ("detail/0.png", 30.0));
    let reader = BundleReader::open(&target).unwrap();
    reader.verify().unwrap();
    assert_eq!(reader.read_detail(&of(1)).unwrap(), stone());

    // a manifest that says too much, and an image that is none
    let path = target.join("manifest.json");
    let text = std::fs::read_to_string(&path).unwrap();
    for (from, to, word) in [
        ("\"near_m\": 30.0", "\"near_m\": -1.0", "near_m is -1"),
        ("\"version\": 4", "\"version\": 3", "version 3 has none"),
        ("\"file\": \"detail/0.png\"", "\"file\": \"detail/9.png\"", "not among its files"),
    ] {
        assert!(text.contains(from), "{from}");
        std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
        let error = BundleReader::open(&target).unwrap_err().to_string();
        assert!(error.contains(word) && error.contains("the detail of part"), "{error}");
    }
    std::fs::write(&path, &text).unwrap();
    std::fs::write(target.join("detail/0.png"), b"no image").unwrap();
    assert!(BundleReader::open(&target).unwrap().read_detail(&of(0)).unwrap_err().to_string().contains("0.png"));
}

#[test]
fn chunks_name_the_details_of_their_materials() {
    const PNG: &[u8] = &[0x89, b'P', b'N', b'G'];
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    let mut writer = BundleWriter::create(&target, meta(MONO)).unwrap();
    let [wood, plaster] = [DetailPattern::Wood, DetailPattern::Plaster].map(Detail::of_kind);
    writer.add_material_detail(1, &stone(), &wood).unwrap();
    writer.add_material_detail(1, &stone(), &plaster).unwrap();
    assert!(writer.add_detail(1, &stone(), &plaster).unwrap_err().to_string().contains("already"));
    writer.add_detail(0, &stone(), &plaster).unwrap();
    assert!(writer.add_material_detail(0, &stone(), &wood).unwrap_err().to_string().contains("all of it has one"));
    let texture = writer.add_texture("a.png", PNG).unwrap();
    let of = |part, texture, detail| LitChunk { detail, ..chunk(MONO, part, texture, 4, 0.0) };
    let wrong = writer.push_chunk(&of(0, None, Some(0))).unwrap_err().to_string();
    assert!(wrong.contains("it names detail Some(0) of 0"), "{wrong}");
    let chunks =
        [(0, None, None), (1, Some(texture), Some(0)), (1, Some(texture), Some(1)), (1, None, Some(1)), (1, None, None)];
    for (part, texture, detail) in chunks {
        writer.push_chunk(&of(part, texture, detail)).unwrap();
    }
    for path in ["sky/0000.hdr", "sky/0001.hdr"] {
        writer.add_sky_map(path, b"unread").unwrap();
    }
    let manifest = writer.finish(&lapse(MONO)).unwrap();
    assert_eq!(manifest.version, FORMAT_VERSION);
    let reader = BundleReader::open(&target).unwrap();
    reader.verify().unwrap();
    for (index, (part, texture, detail)) in chunks.into_iter().enumerate() {
        let info = reader.chunk_info(index);
        assert_eq!((info.part, info.texture, info.detail), (part, texture, detail));
        assert_eq!(reader.read_chunk(index).unwrap().detail, detail);
    }
    assert_eq!(reader.texture_bytes(0).unwrap(), PNG, "once, though two materials show it");
    let part = &reader.manifest().parts[1];
    assert_eq!(part.detail_of(Some(1)), Some(&DetailInfo::new("detail/0.png".to_owned(), &plaster)));
    assert_eq!((part.detail_of(None), part.detail_of(Some(2))), (None, None));

    let path = target.join("manifest.json");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replacen("\"version\": 10", "\"version\": 9", 1)).unwrap();
    assert!(BundleReader::open(&target).unwrap_err().to_string().contains("version 9 has none"));
    let refused = |change: &dyn Fn(&mut serde_json::Value)| {
        let mut manifest: serde_json::Value = serde_json::from_str(&text).unwrap();
        change(&mut manifest["parts"][1]);
        std::fs::write(&path, manifest.to_string()).unwrap();
        BundleReader::open(&target).unwrap_err().to_string()
    };
    let both = refused(&|part| part["detail"] = part["material_details"][0].clone());
    assert!(both.contains("one detail for all of it"), "{both}");
    let many = refused(&|part| {
        let one = part["material_details"][0].clone();
        part["material_details"] = vec![one; 257].into();
    });
    assert!(many.contains("they are 257, and 256 at most"), "{many}");
    // a chunk that names what its part has not
    let of_one: serde_json::Value = serde_json::from_str(&text).unwrap();
    let mut fewer = of_one;
    fewer["parts"][1]["material_details"].as_array_mut().unwrap().pop();
    std::fs::write(&path, fewer.to_string()).unwrap();
    let error = BundleReader::open(&target).unwrap_err().to_string();
    assert!(error.contains("a primitive names detail Some(1) of 1"), "{error}");
}
