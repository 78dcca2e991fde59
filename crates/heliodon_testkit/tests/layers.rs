//! The layers of ARCHITECTURE.md, enforced: a crate uses crates of lower layers only; data and base also their own.

use serde_json::Value;
use std::process::Command;

/// Layers from the bottom. `dev` crates may be used by all, as dev-dependencies only.
const LAYERS: &[(&str, &[&str])] = &[
    ("base", &["heliodon_math"]),
    (
        "data",
        &[
            "heliodon_mesh",
            "heliodon_image",
            "heliodon_sky",
            "heliodon_bundle",
            "heliodon_track",
            "heliodon_film",
            "heliodon_sound",
            "heliodon_script",
        ],
    ),
    ("kernel", &["heliodon_rays", "heliodon_raster", "heliodon_gpu"]),
    ("solve", &["heliodon_light", "heliodon_prepare", "heliodon_lightmap", "heliodon_capture", "heliodon_photo"]),
    ("flow", &["heliodon_bake"]),
    ("runtime", &["heliodon_view"]),
    // windows to work in: they may solve what they show
    ("tools", &["heliodon_mark"]),
    ("apps", &["heliodon"]),
];
const DEV: &str = "heliodon_testkit";

fn layer_of(name: &str) -> Option<usize> {
    LAYERS.iter().position(|(_, crates)| crates.contains(&name))
}

/// Why `user` may not depend on `used`, if it may not.
fn objection(user: &str, used: &str, dev_dependency: bool) -> Option<String> {
    if used == DEV {
        return (!dev_dependency).then(|| format!("{user} uses {DEV} outside its tests"));
    }
    if dev_dependency {
        return None;
    }
    let (Some(above), Some(below)) = (layer_of(user), layer_of(used)) else {
        return Some(format!("{user} -> {used}: one of them stands in no layer of this test"));
    };
    let (above_name, below_name) = (LAYERS[above].0, LAYERS[below].0);
    if below > above {
        return Some(format!("{user} ({above_name}) uses {used} of the higher layer {below_name}"));
    }
    if below == above && !["data", "base"].contains(&above_name) {
        return Some(format!("{user} and {used} stand side by side in {above_name} and may not know one another"));
    }
    // the viewer shows what was baked: it neither solves nor runs the pipeline
    if above_name == "runtime" && ["solve", "flow"].contains(&below_name) {
        return Some(format!("{user} (runtime) uses {used} ({below_name})"));
    }
    None
}

#[test]
fn crates_use_lower_layers_only() {
    let manifest = "../../Cargo.toml";
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline", "--manifest-path", manifest])
        .output()
        .expect("cargo metadata runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("cargo metadata prints JSON");
    let packages = metadata["packages"].as_array().expect("packages");
    assert!(packages.len() >= 10, "the workspace has lost its crates");
    let mut objections = Vec::new();
    for package in packages {
        let user = package["name"].as_str().expect("name");
        for dependency in package["dependencies"].as_array().expect("dependencies") {
            let used = dependency["name"].as_str().expect("name");
            if user != DEV && used.starts_with("heliodon") {
                objections.extend(objection(user, used, dependency["kind"] == "dev"));
            }
        }
    }
    assert!(objections.is_empty(), "{}", objections.join("\n"));
}

#[test]
fn the_check_objects_to_what_it_should() {
    assert!(objection("heliodon_rays", "heliodon_light", false).is_some(), "upwards");
    assert!(objection("heliodon_view", "heliodon_light", false).is_some(), "the viewer solves");
    assert!(objection("heliodon_light", "heliodon_prepare", false).is_some(), "solvers know one another");
    assert!(objection("heliodon_light", DEV, false).is_some(), "test crate in a product");
    assert!(objection("heliodon_light", DEV, true).is_none());
    assert!(objection("heliodon_sky", "heliodon_image", false).is_none());
    assert!(objection("heliodon", "heliodon_bake", false).is_none());
    assert!(objection("heliodon_mark", "heliodon_photo", false).is_none(), "a tool solves as one works");
    assert!(objection("heliodon_view", "heliodon_mark", false).is_some(), "the viewer needs no tool");
}
