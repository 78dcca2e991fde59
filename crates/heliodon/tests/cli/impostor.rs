//! `heliodon impostor`, from a model to a crowd in a bundle.

use crate::sites::{TestSite, plane};
use crate::{done, json, run};
use heliodon_bundle::impostor::Impostor;
use std::fs;

#[test]
fn a_model_becomes_a_crowd_in_a_bundle() {
    let site = TestSite::smallest(&plane(8));
    let figures = site.path("figures");
    done(&[&"figures", &figures]);
    let (model, file, sheet) = (figures.join("walker.glb"), site.path("walker.impostor.ktx2"), site.path("walker.png"));
    let small: [&dyn AsRef<std::ffi::OsStr>; 10] =
        [&"impostor", &model, &"--draft", &"--size", &"32x64", &"--ring", &"5:4", &"--fps", &"3", &"-o"];
    let with = |more: &[&'static str]| {
        let mut all: Vec<&dyn AsRef<std::ffi::OsStr>> = small.to_vec();
        all.push(&file);
        all.extend(more.iter().map(|text| text as &dyn AsRef<std::ffi::OsStr>));
        all.into_iter().map(|text| text.as_ref().to_owned()).collect::<Vec<_>>()
    };
    let json_of = |more: &[&'static str]| {
        let arguments = with(more);
        json(&arguments.iter().map(|text| text as &dyn AsRef<std::ffi::OsStr>).collect::<Vec<_>>())
    };
    let estimated = json_of(&["--clip", "walk", "--estimate"]);
    assert!(!file.exists() && estimated["views"] == 4 && estimated["file"].is_null());
    let made = json_of(&["--clip", "walk"]);
    assert_eq!(
        (&made["texture_bytes"], &made["frames"], &made["clips"][0]["name"]),
        (&estimated["texture_bytes"], &estimated["frames"], &"walk".into())
    );
    assert!(made["used"].as_f64().unwrap() > 0.05);
    let impostor = Impostor::from_bytes(&fs::read(&file).unwrap(), "walker").unwrap();
    assert_eq!(impostor.info.frame_px, [32, 64]);
    done(&[
        &"impostor",
        &model,
        &"--draft",
        &"--size",
        &"32x64",
        &"--ring",
        &"5:4",
        &"--fps",
        &"3",
        &"--sheet",
        &sheet,
        &"-o",
        &file,
    ]);
    assert!(fs::read(&sheet).unwrap().starts_with(b"\x89PNG"));
    let told = done(&[&"inspect", &file]).out;
    assert!(told.contains("an impostor") && told.contains("\"idle\""), "{told}");

    let before = fs::read_to_string(site.path("site.toml")).unwrap();
    let crowd = |more: &str| format!("{before}\n[[actor]]\nfile = \"walker.impostor.ktx2\"\nplace = [0, 0, 0]\n{more}\n");
    site.write("site.toml", crowd("count = 5\nspread_m = 1.5\nground = \"follow\"\nanimation = \"walk\""));
    json(&[&"bake", &site.folder()]);
    let manifest: serde_json::Value = serde_json::from_slice(&fs::read(site.path("bundle/manifest.json")).unwrap()).unwrap();
    let actor = &manifest["actors"][0];
    assert_eq!((actor["count"].as_u64(), actor["lanes"].as_array().unwrap().len()), (Some(5), 5));
    assert!(site.path("bundle").join(actor["file"].as_str().unwrap()).is_file());

    for (more, words) in [
        ("count = 0", "count is 0"),
        ("spread_m = -1.0", "spread_m is -1"),
        ("albedo = [0.5, 0.5, 0.5]", "as it was captured"),
        ("animation = \"fly\"", "it has walk, idle"),
        ("scale = -1.0", "scale -1"),
        ("lanes = [[[0, 0, 0]]]", "lanes"),
    ] {
        site.write("site.toml", crowd(more));
        let refused = run(&[&"check", &site.folder()]);
        assert!(refused.code == 1 && refused.err.contains(words), "{more}: {}", refused.err);
    }
    site.write("site.toml", format!("{before}\n[[actor]]\nfile = \"figures/walker.glb\"\nplace = [0, 0, 0]\ncount = 2\n"));
    let refused = run(&[&"check", &site.folder()]);
    assert!(refused.code == 1 && refused.err.contains("only impostors"), "{}", refused.err);
}

#[test]
fn what_cannot_be_captured_is_refused_and_nothing_is_written_over() {
    let home = tempfile::tempdir().unwrap();
    let place = |name: &str| home.path().join(name);
    fs::write(place("points.obj"), "v 0 0 0\nv 1 0 0\n").unwrap();
    fs::write(place("cube.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    fs::write(place("mine.impostor.ktx2"), "mine").unwrap();
    let refused = |model: &str, more: &[&str], code: i32, words: &str| {
        let mut all: Vec<&dyn AsRef<std::ffi::OsStr>> = vec![&"impostor"];
        let model = place(model);
        all.push(&model);
        all.extend(more.iter().map(|text| text as &dyn AsRef<std::ffi::OsStr>));
        let ran = run(&all);
        assert!(ran.code == code && ran.err.contains(words), "{more:?}: {} {}", ran.code, ran.err);
    };
    let out = place("out.impostor.ktx2").display().to_string();
    let mine = place("mine.impostor.ktx2").display().to_string();
    refused("points.obj", &["-o", &out], 1, "points.obj");
    refused("cube.obj", &["-o", &out, "--clip", "walk"], 1, "no clip `walk`");
    refused("cube.obj", &["-o", &out, "--ring", "5"], 2, "a ring is");
    refused("cube.obj", &["-o", &out, "--ring", "5:8", "--ring", "5:4"], 2, "same elevation");
    refused("cube.obj", &["-o", &out, "--size", "20x20"], 1, "multiples of 16");
    refused("cube.obj", &["-o", &place("out.png").display().to_string()], 2, ".impostor.ktx2");
    refused("cube.obj", &["-o", &mine], 1, "no impostor");
    refused("missing.glb", &["-o", &out], 1, "missing.glb");
    assert_eq!(fs::read(place("mine.impostor.ktx2")).unwrap(), b"mine");
    assert!(!place("out.impostor.ktx2").exists());
}
