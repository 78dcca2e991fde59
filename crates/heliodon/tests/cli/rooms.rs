//! Displays and the pictures of their screens.

use crate::sites::{TestSite, sunny_probe, waves};
use crate::{done, json, run};
use heliodon_image::SrgbImage;
use std::net::UdpSocket;

#[test]
fn a_preset_is_written_once_and_holds_together() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("display.toml");
    for preset in ["desktop", "monitor", "flatworld", "cave", "ring"] {
        std::fs::remove_file(&file).ok();
        done(&[&"display", &"--preset", &preset, &"-o", &file]);
        let told = json(&[&"display", &file]);
        assert_eq!(told["name"], preset);
        assert_eq!(told["faults"].as_array().unwrap().len(), 0);
    }
    let again = run(&[&"display", &"--preset", &"cave", &"-o", &file]);
    assert!(again.code == 1 && again.err.contains("not replaced"), "{}", again.err);
    let unknown = run(&[&"display", &"--preset", &"cavern"]);
    assert!(unknown.code == 2 && unknown.err.contains("flatworld"), "{}", unknown.err);
}

#[test]
fn actions_are_listed() {
    let actions = json(&[&"display", &"--actions"]);
    let play = actions["actions"].as_array().unwrap().iter().find(|one| one["action"] == "day.play").unwrap();
    assert_eq!(play["triggers"][0], "Space");
    assert!(done(&[&"display", &"--actions"]).out.contains("An action can be bound to"));
}

#[test]
fn what_is_wrong_with_a_display_is_told_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("display.toml");
    let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port();
    let text = format!(
        "[input]\nbind = {{ \"day.play\" = [\"Sapce\"], \"day.fly\" = [] }}\n[[tracker]]\nname = \"phone\"\nprotocol = \"osc\"\n\
         listen = \"{port}\"\n[[tracker.body]]\nis = \"head\"\naddress = \"/head\"\n[control]\nsites = {{ temple = \"nowhere\" }}\n"
    );
    std::fs::write(&file, text).unwrap();
    let told = run(&[&"display", &file]);
    assert_eq!(told.code, 1);
    for wanted in ["`Sapce`", "day.fly", "phone", "temple", "display.toml:2:"] {
        assert!(told.err.contains(wanted), "{wanted} is not in {}", told.err);
    }
}

#[test]
fn every_eye_of_every_screen_gets_its_picture() {
    let site = TestSite::smallest(&waves(24));
    sunny_probe().write_hdr(site.path("grey.hdr")).unwrap();
    done(&[&"bake", &site.folder()]);
    let display = site.path("display.toml");
    let text = done(&[&"display", &"--preset", &"flatworld"]).out.replace("[1024, 768]", "[160, 120]");
    std::fs::write(
        &display,
        text.replacen("stereo = \"pair\"", "stereo = \"top-bottom\"", 1).replacen(
            "\noutput_right = { size_px = [160, 120] }",
            "",
            1,
        ),
    )
    .unwrap();
    let (bundle, out) = (site.path("bundle"), site.path("room.png"));
    let shot = |more: &str| {
        run(&[&"render", &bundle, &"--display", &display, &"--time", &"12:00", &"--size", &"96x72", &more, &"-o", &out])
    };
    let ran = shot("--preview");
    if ran.err.contains("no graphics driver") {
        eprintln!("skipped: this machine has no graphics driver");
        return;
    }
    assert_eq!(ran.code, 0, "{}", ran.err);
    for (name, size) in [
        ("left-left", (160, 60)),
        ("left-right", (160, 60)),
        ("right-left", (160, 120)),
        ("right-right", (160, 120)),
        ("preview", (96, 72)),
    ] {
        let picture = SrgbImage::read(site.path(&format!("room-{name}.png"))).unwrap();
        assert_eq!((picture.width, picture.height), size, "{name}");
    }
    assert_eq!(shot("--outputs").code, 0);
    let packed = SrgbImage::read(site.path("room-left.png")).unwrap();
    assert_eq!((packed.width, packed.height), (160, 120));
    let desktop = run(&[&"render", &bundle, &"--display", &"desktop", &"--time", &"12:00", &"-o", &out]);
    assert!(desktop.code == 1 && desktop.err.contains("no [[screen]]"), "{}", desktop.err);
}
