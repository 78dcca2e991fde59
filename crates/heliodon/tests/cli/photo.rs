//! From photographs to a textured model, by the command line.

use crate::{done, json, run};
use glam::{DMat3, DQuat, DVec2, DVec3};
use heliodon_image::SrgbImage;
use heliodon_image::view_layers::{VIEWS_FILE, ViewLayers};
use heliodon_photo::camera::{Camera, Intrinsics, Pose};
use std::ffi::OsStr;
use std::fmt::Write;
use std::fs;
use std::path::Path;

const WIDTH: u32 = 400;
const HEIGHT: u32 = 300;
const FOCAL_PX: f64 = 430.0;
const GREY: [u8; 4] = [120, 130, 140, 255];

/// A box's corners, as its shape names them, and what stands about.
const POINTS: [(&str, [f64; 3]); 14] = [
    ("sw", [-1.0, 0.0, 1.5]),
    ("se", [1.0, 0.0, 1.5]),
    ("ne", [1.0, 0.0, -1.5]),
    ("nw", [-1.0, 0.0, -1.5]),
    ("sw-top", [-1.0, 2.0, 1.5]),
    ("se-top", [1.0, 2.0, 1.5]),
    ("ne-top", [1.0, 2.0, -1.5]),
    ("nw-top", [-1.0, 2.0, -1.5]),
    ("post", [-2.0, 1.1, 1.9]),
    ("stump", [2.1, 0.4, 1.2]),
    ("wire", [0.3, 2.7, 0.4]),
    ("gate", [-1.6, 0.7, -2.2]),
    ("roof", [0.0, 2.4, -0.8]),
    ("stone", [1.7, 0.1, 2.1]),
];

fn camera(number: usize) -> Camera {
    let angle = 0.5 * number as f64 - 1.0;
    let eye = DVec3::new(9.0 * angle.sin(), 2.0 + 0.6 * number as f64, 9.0 * angle.cos());
    let ahead = (DVec3::new(0.0, 1.0, 0.0) - eye).try_normalize().unwrap();
    let right = ahead.cross(DVec3::Y).try_normalize().unwrap();
    let rotation = DQuat::from_mat3(&DMat3::from_cols(right, ahead.cross(right), ahead).transpose());
    let mut intrinsics = Intrinsics::pinhole(WIDTH, HEIGHT, FOCAL_PX);
    intrinsics.centre_px = [200.0, 150.0];
    Camera { intrinsics, pose: Pose { rotation, translation: -(rotation * eye) } }
}

/// Photographs of one colour, and marks in all of them.
fn project(folder: &Path) {
    let mut text = String::from("[project]\nname = \"A box\"\n");
    for number in 0..5 {
        let image = SrgbImage { width: WIDTH, height: HEIGHT, pixels: vec![GREY; (WIDTH * HEIGHT) as usize] };
        image.write_png(folder.join(format!("{number}.png"))).unwrap();
        write!(text, "[[photo]]\nfile = \"{number}.png\"\n").unwrap();
    }
    for (name, place) in POINTS {
        write!(text, "[[point]]\nname = \"{name}\"\n").unwrap();
        if name.len() == 2 || name == "sw-top" {
            writeln!(text, "known_m = {place:?}").unwrap();
        }
        writeln!(text, "[point.marks]").unwrap();
        for number in 0..5 {
            let DVec2 { x, y } = camera(number).project(DVec3::from(place)).unwrap();
            writeln!(text, "\"{number}.png\" = [{x:.3}, {y:.3}]").unwrap();
        }
    }
    text += "[[shape]]\nname = \"The walls\"\nkind = \"box\"\nwatertight = true\n\
             points = [\"sw\", \"se\", \"ne\", \"nw\", \"sw-top\", \"se-top\", \"ne-top\", \"nw-top\"]\n";
    text += "[[shape]]\nname = \"a tower\"\nkind = \"cylinder\"\nbottom = [\"nowhere\"]\n";
    fs::write(folder.join("photos.toml"), text).unwrap();
}

#[test]
fn marks_become_cameras_a_model_and_its_texture() {
    let home = tempfile::tempdir().unwrap();
    let folder = home.path();
    project(folder);
    let early = run(&[&"photo", &"model", &folder]);
    assert!(early.code == 1 && early.err.contains("heliodon photo solve"), "{}", early.err);
    let told = done(&[&"photo", &"solve", &folder]).out;
    assert!(told.contains("5 of 5 photographs and 14 of 14 points"), "{told}");
    let model = json(&[&"photo", &"model", &folder]);
    assert_eq!(
        (model["parts"][0]["file"].as_str(), model["parts"][0]["triangles"].as_u64()),
        (Some("The-walls.obj"), Some(12))
    );
    assert_eq!(model["parts"][0]["open_edges"].as_u64(), Some(0));
    assert!(model["shapes"][0]["rms_m"].as_f64().unwrap() < 0.002, "{model}");
    assert!(model["refused"][0].as_str().unwrap().contains("nowhere"), "{model}");
    let obj = fs::read_to_string(folder.join("made/The-walls.obj")).unwrap();
    let highest =
        obj.lines().filter_map(|line| line.strip_prefix("v ")?.split(' ').nth(1)?.parse::<f64>().ok()).fold(0.0, f64::max);
    assert!((highest - 2.0).abs() < 0.005, "{highest}");
    assert_eq!(run(&[&"photo", &"texture", &folder, &"--views", &"9"]).code, 2);
    let to = folder.join("textured");
    let textured = json(&[&"photo", &"texture", &folder, &"--side", &"512", &"--views", &"3", &"-o", &to]);
    let seen = textured["texture"]["seen"].as_f64().unwrap();
    // nobody has looked from the north or from below
    assert!((0.3..0.8).contains(&seen), "{textured}");
    let atlas = SrgbImage::read(folder.join("textured/atlas.png")).unwrap();
    let like = atlas.pixels.iter().filter(|pixel| pixel.iter().zip(GREY).all(|(a, b)| a.abs_diff(b) <= 2)).count();
    assert!(like * 10 > atlas.pixels.len() * 3, "{like} of {}", atlas.pixels.len());
    assert!(folder.join("textured/evidence.png").exists());
    let views = ViewLayers::read(&to.join(VIEWS_FILE)).unwrap();
    assert_eq!((views.layers.len() as u64, views.size()), (3, [atlas.width, atlas.height]));
    assert_eq!(textured["texture"]["views"].as_u64(), Some(3));
    assert!(fs::read_to_string(folder.join("textured/The-walls.obj")).unwrap().contains("\nvt "));
    done(&[&"photo", &"texture", &folder, &"--side", &"256", &"-o", &to]);
    assert!(!to.join(VIEWS_FILE).exists(), "views of an atlas that is no more");
    // the mesh of a part that is no more goes; what somebody else put there stays
    fs::write(folder.join("made/mine.obj"), "v 0 0 0\n").unwrap();
    let toml = fs::read_to_string(folder.join("photos.toml")).unwrap();
    fs::write(folder.join("photos.toml"), toml.replace("\"The walls\"", "\"Walls\"")).unwrap();
    done(&[&"photo", &"model", &folder]);
    let there = ["The-walls.obj", "Walls.obj", "mine.obj"].map(|name| folder.join("made").join(name).exists());
    assert_eq!(there, [false, true, true]);
}

#[test]
fn a_photograph_that_went_missing_is_named() {
    let home = tempfile::tempdir().unwrap();
    let folder = home.path();
    project(folder);
    done(&[&"photo", &"solve", &folder]);
    fs::remove_file(folder.join("3.png")).unwrap();
    let told = run(&[&"photo", &"texture", &folder, &"--side", &"128"]);
    assert!(
        told.code == 1 && told.err.contains("photograph \"3.png\"") && told.err.contains("3.png: cannot be read"),
        "{}",
        told.err
    );
}

#[test]
fn albedo_wants_hours_and_a_sky_and_is_written_with_its_evidence() {
    let home = tempfile::tempdir().unwrap();
    let folder = home.path();
    project(folder);
    done(&[&"photo", &"solve", &folder]);
    let without = run(&[&"photo", &"albedo", &folder]);
    assert!(without.code == 1 && without.err.contains("nothing says when it was taken"), "{} {}", without.code, without.err);
    let file = folder.join("photos.toml");
    let mut text = fs::read_to_string(&file).unwrap();
    text += "[sky]\nlatitude_deg = 44.5\nlongitude_deg = 2.9\nutc_offset = \"+02:00\"\nnorth_deg = 0.0\n";
    for (number, hour) in ["09:00", "12:30", "16:00"].iter().enumerate() {
        let name = format!("file = \"{number}.png\"\n");
        text = text.replacen(&name, &format!("{name}time = \"2024-06-20 {hour}\"\n"), 1);
    }
    fs::write(&file, text).unwrap();
    let told = json(&[&"photo", &"albedo", &folder, &"--side", &"128", &"--samples", &"16"]);
    assert_eq!(told["hours"].as_array().unwrap().len(), 3, "{told}");
    assert_eq!(told["absolute"].as_bool(), Some(false), "nothing in them is of known albedo");
    assert!(told["known"].as_f64().unwrap() > 0.05, "{told}");
    // two photographs of five are of no known hour
    assert_eq!(told["photos"].as_array().unwrap().len(), 3, "{told}");
    let made = folder.join("made");
    let map = SrgbImage::read(made.join("albedo.png")).unwrap();
    assert_eq!(u64::from(map.width), told["size"][0].as_u64().unwrap());
    assert!(made.join("evidence.png").exists());
}

#[test]
fn a_window_wants_a_project() {
    assert_eq!(run(&[&"photo"]).code, 2);
    let home = tempfile::tempdir().unwrap();
    for arguments in [vec!["photo"], vec!["photo", "mark"]] {
        let mut arguments: Vec<&dyn AsRef<OsStr>> = arguments.iter().map(|argument| argument as &dyn AsRef<OsStr>).collect();
        let missing = home.path().join("nowhere");
        arguments.push(&missing);
        let told = run(&arguments);
        assert!(told.code == 1 && told.err.contains("nowhere"), "{} {}", told.code, told.err);
    }
}
