//! Files that somebody writes after they were hashed and before they are read: told, and nothing kept or made of them.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::Vec3;
use heliodon_bake::BakeError;
use heliodon_bake::bake::bake;
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bake::report::Silent;
use heliodon_bundle::BundleReader;
use heliodon_bundle::site::Site;
use heliodon_image::HdrImage;
use std::fs;
use std::path::Path;

const SITE: &str = r#"[site]
name = "Somebody writes"
[[part]]
file = "mesh.obj"
[[actor]]
file = "actor.obj"
place = [0.0, 1.0, 0.0]
ground = "ignore"
[sky]
probes = "sky.hdr"
mapping = "lat-long"
[bake]
samples = 16
bounces = 1
grid_m = 0.5
"#;

fn triangle(height: f32) -> String {
    format!("v 0 0 0\nv 0 0 1\nv 1 {height} 0\nf 1 2 3\n")
}

fn write_sky(folder: &Path, radiance: f32) {
    HdrImage::filled(32, 16, Vec3::splat(radiance)).write_hdr(folder.join("sky.hdr")).unwrap();
}

fn plan(folder: &Path) -> Plan {
    Plan::new(Site::read(folder).unwrap(), BakeOptions::new(folder.join("bundle"))).unwrap()
}

/// Names of all that is kept in the cache.
fn kept(folder: &Path) -> Vec<String> {
    let folders = fs::read_dir(folder.join(".heliodon/cache")).into_iter().flatten().flatten();
    let files = folders.flat_map(|folder| fs::read_dir(folder.path()).into_iter().flatten().flatten());
    files.map(|file| file.file_name().to_string_lossy().into_owned()).collect()
}

#[test]
fn what_was_written_meanwhile_is_told_and_not_kept() {
    for more in ["", "[prepare]\n"] {
        let home = tempfile::tempdir().unwrap();
        let folder = home.path();
        fs::write(folder.join("site.toml"), SITE.to_owned() + more).unwrap();
        fs::write(folder.join("mesh.obj"), triangle(0.25)).unwrap();
        fs::write(folder.join("actor.obj"), triangle(0.5)).unwrap();
        write_sky(folder, 1.0);
        let refused = |plan: &Plan, name: &str| {
            let error = bake(plan, &Silent).unwrap_err();
            assert!(matches!(&error, BakeError::Changed { path } if path.ends_with(name)), "{name}: {error}");
            assert!(!folder.join("bundle").exists());
        };

        let planned = plan(folder);
        fs::write(folder.join("mesh.obj"), triangle(0.75)).unwrap();
        refused(&planned, "mesh.obj");
        let blocks: Vec<String> = kept(folder).into_iter().filter(|name| name.contains("-0")).collect();
        assert!(blocks.is_empty(), "{blocks:?}");

        let planned = plan(folder);
        write_sky(folder, 2.0);
        refused(&planned, "sky.hdr");
        assert!(!kept(folder).iter().any(|name| name.starts_with("sky-")), "{:?}", kept(folder));

        let planned = plan(folder);
        fs::write(folder.join("actor.obj"), triangle(0.125)).unwrap();
        refused(&planned, "actor.obj");

        // of site.toml only what was read counts: the bundle is that of what it said
        let planned = plan(folder);
        fs::write(folder.join("site.toml"), "").unwrap();
        bake(&planned, &Silent).unwrap();
        let bundle = BundleReader::open(folder.join("bundle")).unwrap();
        assert_eq!(bundle.manifest().inputs, planned.inputs);
        fs::write(folder.join("site.toml"), SITE.to_owned() + more).unwrap();
        assert!(plan(folder).is_up_to_date());
    }
}
