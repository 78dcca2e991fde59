//! Detail textures.

use crate::{done, json, run};
use heliodon_image::SrgbImage;
use std::fs;

#[test]
fn every_kind_is_made_the_same_each_time_and_can_be_checked() {
    let home = tempfile::tempdir().unwrap();
    for kind in ["noise", "band", "stone", "plaster", "wood"] {
        let path = home.path().join(format!("{kind}.png"));
        let made = json(&[&"detail", &kind, &"--size", &"64", &"--seed", &"5", &"-o", &path]);
        assert_eq!(
            (made["width"].as_u64(), made["mean"].as_u64(), made["mip_levels"].as_u64()),
            (Some(64), Some(128), Some(7))
        );
        assert_eq!((&made["seam"]["verdict"], &made["seed"], &made["image"]), (&"seamless".into(), &5.into(), &().into()));
        let bytes = fs::read(&path).unwrap();
        // made again, with one thread: it replaces itself
        done(&[&"detail", &kind, &"--size", &"64", &"--seed", &"5", &"-o", &path, &"--threads", &"1"]);
        assert_eq!(fs::read(&path).unwrap(), bytes, "{kind}");
        let checked = json(&[&"detail", &path]);
        assert_eq!((&checked["image"]["mean"], &checked["image"]["changed"]), (&128.0.into(), &0.into()));
        assert_eq!((&checked["contrast"], &checked["file"]), (&made["contrast"], &().into()));
        assert_eq!(checked["warnings"].as_array().unwrap().len(), 0, "{checked}");
    }
    let (oak, walls) = (home.path().join("oak.png"), home.path().join("walls.png"));
    let told = done(&[&"detail", &"wood", &"--knots", &"2", &"--contrast", &"25", &"-o", &oak, &"--picture", &walls]).out;
    assert!(told.contains("256 x 256") && told.contains("contrast 25.0") && told.contains("oak.png"), "{told}");
    let walls = SrgbImage::read(&walls).unwrap();
    assert_eq!((walls.width, walls.height), (3 * 768 + 32, 768 + 16));
    let soft = home.path().join("soft.png");
    assert_ne!(
        json(&[&"detail", &"band", &"--wavelength", &"12", &"-o", &soft])["contrast"],
        json(&[&"detail", &"band", &"--contrast", &"10", &"-o", &soft])["contrast"]
    );
}

#[test]
fn images_are_checked_and_corrected_only_where_one_asks() {
    let home = tempfile::tempdir().unwrap();
    let (photo, fine) = (home.path().join("photo.png"), home.path().join("fine.png"));
    let mut image = SrgbImage::filled(64, 64, [0, 0, 0, 255]);
    for (k, pixel) in (0_u32..).zip(&mut image.pixels) {
        let code = 140 + (k.wrapping_mul(2_654_435_761) >> 27) as u8 + (k % 64) as u8;
        *pixel = [code, code, code, 255];
    }
    image.write_png(&photo).unwrap();
    let refused = run(&[&"detail", &photo, &"-o", &fine]);
    assert!(refused.code == 1 && refused.err.contains("--correct") && refused.err.contains("photo.png"), "{}", refused.err);
    assert!(!fine.exists() && refused.out.is_empty());
    let corrected = json(&[&"detail", &photo, &"--correct", &"-o", &fine]);
    assert!(corrected["image"]["mean"].as_f64().unwrap() > 150.0 && corrected["image"]["changed"].as_u64().unwrap() > 4000);
    assert_eq!(corrected["seam"]["verdict"], "visible", "{corrected}");
    assert!(corrected["warnings"][0].as_str().unwrap().contains("left and right"));
    let told = done(&[&"detail", &fine]);
    assert!(told.out.contains("mean 128.00") && told.out.contains("0 of its codes changed"), "{}", told.out);
    assert!(told.err.contains("visible seam"), "{}", told.err);
    let stronger = json(&[&"detail", &photo, &"--correct", &"--contrast", &"30", &"-o", &fine]);
    assert!((stronger["contrast"].as_f64().unwrap() - 30.0).abs() < 0.1, "{stronger}");
}

#[test]
fn what_a_bake_refuses_is_refused() {
    let home = tempfile::tempdir().unwrap();
    let (image, grey) = (home.path().join("image.png"), home.path().join("grey.png"));
    let save = |width: u32, height: u32, two: [[u8; 4]; 2]| {
        let pixels = (0..width * height).map(|i| two[i as usize % 2]).collect();
        SrgbImage { width, height, pixels }.write_png(&image).unwrap();
    };
    let greys = [[90, 90, 90, 255], [166, 166, 166, 255]];
    for (width, height) in [(32, 32), (1024, 1024), (128, 64)] {
        save(width, height, greys);
        let refused = run(&[&"detail", &image]);
        assert!(refused.code == 1 && refused.err.contains("64, 128, 256 or 512"), "{width} x {height}: {}", refused.err);
    }
    save(64, 64, [[128, 90, 90, 255], [128, 166, 166, 255]]);
    let refused = run(&[&"detail", &image]);
    assert!(refused.code == 1 && refused.err.contains("grey image"), "{}", refused.err);
    done(&[&"detail", &image, &"--correct", &"-o", &grey]);
    done(&[&"detail", &grey]);
    save(64, 64, greys);
    done(&[&"detail", &image]);
}

#[test]
fn nothing_of_anybody_is_written_over() {
    let home = tempfile::tempdir().unwrap();
    let (mine, made) = (home.path().join("mine.png"), home.path().join("made.png"));
    SrgbImage::filled(64, 64, [200, 100, 50, 255]).write_png(&mine).unwrap();
    let before = fs::read(&mine).unwrap();
    let refused = run(&[&"detail", &"stone", &"-o", &mine]);
    assert!(refused.code == 1 && refused.err.contains("is no detail texture"), "{}", refused.err);
    done(&[&"detail", &"noise", &"-o", &made]);
    let refused = run(&[&"detail", &made, &"--correct", &"-o", &made]);
    assert!(refused.code == 1 && refused.err.contains("read here"), "{}", refused.err);
    let refused = run(&[&"detail", &mine, &"--correct", &"-o", &made]);
    assert!(refused.code == 1 && refused.err.contains("all texels have the code"), "{}", refused.err);
    fs::write(home.path().join("text.png"), "no picture").unwrap();
    let refused = run(&[&"detail", &home.path().join("text.png")]);
    assert!(refused.code == 1 && refused.err.contains("text.png"), "{}", refused.err);
    assert_eq!(run(&[&"detail", &home.path().join("none.png")]).code, 1);
    let refused = run(&[&"detail", &"stone", &"-o", &home.path().join("none/a.png")]);
    assert!(refused.code == 1 && refused.err.contains("there is no folder"), "{}", refused.err);
    assert_eq!(fs::read(&mine).unwrap(), before);
    assert_eq!(fs::read_dir(home.path()).unwrap().count(), 3, "nothing is left beside them");
}
