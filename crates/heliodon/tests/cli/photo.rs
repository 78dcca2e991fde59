//! From photographs to a textured model, by the command line.

use crate::{done, json, run};
use glam::{DMat3, DQuat, DVec2, DVec3};
use heliodon_image::SrgbImage;
use heliodon_photo::camera::{Camera, Intrinsics, Pose};
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
    let textured = json(&[&"photo", &"texture", &folder, &"--side", &"512", &"-o", &folder.join("textured")]);
    let seen = textured["texture"]["seen"].as_f64().unwrap();
    // nobody has looked from the north or from below
    assert!((0.3..0.8).contains(&seen), "{textured}");
    let atlas = SrgbImage::read(folder.join("textured/atlas.png")).unwrap();
    let like = atlas.pixels.iter().filter(|pixel| pixel.iter().zip(GREY).all(|(a, b)| a.abs_diff(b) <= 2)).count();
    assert!(like * 10 > atlas.pixels.len() * 3, "{like} of {}", atlas.pixels.len());
    assert!(folder.join("textured/evidence.png").exists());
    assert!(fs::read_to_string(folder.join("textured/The-walls.obj")).unwrap().contains("\nvt "));
}
