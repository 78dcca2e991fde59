//! What colours rest on comes into the bundle, of parts as they were read and of prepared ones.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use heliodon_bake::bake::bake;
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bake::report::Silent;
use heliodon_bundle::BundleReader;
use heliodon_bundle::site::Site;
use heliodon_image::{HdrImage, SrgbImage};
use std::fs;
use std::path::Path;

const FLOOR: &str = "v -2 0 2\nv 2 0 2\nv 2 0 -2\nv -2 0 -2\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
const SIDE: u32 = 32;

/// Bakes a floor of 4 m whose left quarter was guessed, after `more` of site.toml.
fn baked(folder: &Path, evidence: &SrgbImage, more: &str) -> Result<BundleReader, String> {
    let site = format!(
        "[site]\nname = \"A floor\"\n[[part]]\nfile = \"floor.obj\"\nrole = \"ground\"\nlight = \"vertex\"\nalbedo = \"atlas.png\"\n\
         evidence = \"evidence.png\"\n[sky]\nprobes = \"sky.hdr\"\nmapping = \"lat-long\"\n[bake]\nsamples = 16\nbounces = 0\n{more}"
    );
    fs::write(folder.join("site.toml"), site).unwrap();
    fs::write(folder.join("floor.obj"), FLOOR).unwrap();
    fs::write(folder.join("atlas.png"), SrgbImage::filled(SIDE, SIDE, [150, 140, 120, 255]).to_png_bytes().unwrap()).unwrap();
    fs::write(folder.join("evidence.png"), evidence.to_png_bytes().unwrap()).unwrap();
    HdrImage::filled(32, 16, glam::Vec3::ONE).write_hdr(folder.join("sky.hdr")).unwrap();
    let bundle = folder.join("bundle");
    let plan = Plan::new(Site::read(folder).unwrap(), BakeOptions::new(&bundle)).unwrap();
    bake(&plan, &Silent).map_err(|error| error.to_string())?;
    Ok(BundleReader::open(bundle).unwrap())
}

fn left_quarter_guessed() -> SrgbImage {
    let grey = |at: u32| if at % SIDE < SIDE / 4 { 128 } else { 255 };
    SrgbImage { width: SIDE, height: SIDE, pixels: (0..SIDE * SIDE).map(|at| [grey(at), grey(at), grey(at), 255]).collect() }
}

#[test]
fn it_is_the_alpha_of_the_image_and_the_manifest_tells_the_share() {
    for more in ["", "[prepare]\nedge_px = 200.0\n[[room]]\nname = \"above\"\nmin = [-1.0, 1.0, -1.0]\nmax = [1.0, 2.0, 1.0]\n"]
    {
        let folder = tempfile::tempdir().unwrap();
        let bundle = baked(folder.path(), &left_quarter_guessed(), more).unwrap();
        let seen = bundle.manifest().parts[0].evidence.unwrap().seen;
        assert!((seen - 0.75).abs() < 0.02, "{seen} of {more}");
        assert!(bundle.manifest().textures[0].evidence);
        let image = bundle.texture_image(0).unwrap();
        assert_eq!(image.pixel(3, 9), [150, 140, 120, 128]);
        assert_eq!(image.pixel(20, 9), [150, 140, 120, 255]);
    }
}

#[test]
fn evidence_of_another_size_is_refused_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let error = baked(folder.path(), &SrgbImage::filled(8, 8, [255; 4]), "").unwrap_err();
    let words = ["site.toml:8:", "the evidence is 8 x 8", "32 x 32", "as large as the albedo"];
    assert!(words.iter().all(|word| error.contains(word)), "{error}");
}
