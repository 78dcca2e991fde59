//! `display.toml`: what is read, what is refused and where, the schema, the template.

use heliodon_bundle::display::{Display, DisplayFile, MonitorName, Preset, Stereo};
use proptest::prelude::*;
use std::path::Path;

const ROOM: &str = r#"[display]
name = "our room"
near_m = 0.1
[[screen]]
name = "left"
corners = [[-2.0, 0.0, 0.0], [0.0, 0.0, -2.0], [-2.0, 2.0, 0.0]]
stereo = "pair"
output = { monitor = 1 }
output_right = { monitor = "HDMI-2" }
blend = { right = 0.1 }
[[screen]]
name = "right"
corners = [[0.0, 0.0, -2.0], [2.0, 0.0, 0.0], [0.0, 2.0, -2.0]]
output = { window = [0, 0, 800, 600] }
[[tracker]]
name = "optical"
protocol = "dtrack"
axes = "x z -y"
[[tracker.body]]
is = "head"
id = 0
[[tracker.body]]
is = "wand"
flystick = 0
[input]
bind = { "day.play" = ["Space", "pad:South"] }
[kiosk]
idle_s = 60.0
[control]
listen = "9000"
"#;

#[test]
fn a_room_is_read_as_written() {
    let room = Display::parse(ROOM, "rooms/display.toml").unwrap();
    assert_eq!(room.screens[0].stereo, Stereo::Pair);
    assert_eq!(room.screens[0].output_right.as_ref().unwrap().monitor, Some(MonitorName::Name("HDMI-2".to_owned())));
    assert_eq!(room.screens[1].output.size_px(), [800, 600]);
    assert_eq!(room.trackers[0].address().unwrap().to_string(), "127.0.0.1:5000");
    assert_eq!(room.control.as_ref().unwrap().address().unwrap().to_string(), "127.0.0.1:9000");
    assert_eq!(room.resolve(Path::new("walk.poses")), Path::new("rooms/walk.poses"));
    let again = Display::parse(&room.to_toml_string(), "display.toml").unwrap();
    assert_eq!(again.file(), room.file());
}

#[test]
fn an_empty_file_is_a_desktop() {
    let desktop = Display::parse("", "display.toml").unwrap();
    assert!(desktop.screens.is_empty());
    assert_eq!(*desktop.file(), DisplayFile::default());
}

/// What is said of a room in which `from` is replaced by `to`.
#[track_caller]
#[expect(clippy::unwrap_used, reason = "a helper of tests")]
fn refusal(from: &str, to: &str) -> String {
    assert!(ROOM.contains(from), "{from}");
    Display::parse(&ROOM.replacen(from, to, 1), "display.toml").unwrap_err().to_string()
}

#[test]
fn what_is_wrong_is_told_with_its_place_and_remedy() {
    let collinear = refusal("[0.0, 0.0, -2.0], [-2.0, 2.0, 0.0]]", "[0.0, 0.0, -2.0], [2.0, 0.0, -4.0]]");
    assert!(
        collinear.starts_with("display.toml:6:1: screen `left`: the three corners lie on one line; give lower left"),
        "{collinear}"
    );
    let mirrored = refusal(
        "[[0.0, 0.0, -2.0], [2.0, 0.0, 0.0], [0.0, 2.0, -2.0]]",
        "[[2.0, 0.0, 0.0], [0.0, 0.0, -2.0], [2.0, 2.0, 0.0]]",
    );
    assert!(mirrored.contains("display.toml:13:1") && mirrored.contains("mirrored") && mirrored.contains("swap"), "{mirrored}");
    let cases = [
        ("near_m = 0.1", "near_m = 0.1\nfar_m = 0.05", "give a greater number"),
        ("near_m = 0.1", "near_m = 0.1\nhud = \"middle\"", "there is no screen `middle`"),
        ("output_right = { monitor = \"HDMI-2\" }\n", "", "a pair of projectors needs output_right"),
        ("output_right = { monitor = \"HDMI-2\" }", "output_right = { monitor = 1 }", "go to one place"),
        ("output = { monitor = 1 }", "output = { monitor = 1, image = \"a.png\" }", "bound to several places"),
        ("output = { monitor = 1 }", "output = { monitor = 0 }", "counted from 1"),
        ("[0, 0, 800, 600]", "[0, 0, -800, 600]", "give left, top, width and height"),
        ("{ right = 0.1 }", "{ right = 0.7 }", "give a number from 0 to 0.5"),
        ("name = \"right\"", "name = \"left\"", "give it another name"),
        ("stereo = \"pair\"", "stereo = \"sidebyside\"", "did you mean `side-by-side`?"),
        ("id = 0", "", "a body of DTrack needs its number"),
        ("is = \"wand\"", "is = \"head\"", "both track the head"),
        ("protocol = \"dtrack\"", "protocol = \"dtrack\"\nlisten = \"here\"", "is no address with a port"),
        ("protocol = \"dtrack\"", "protocol = \"recording\"", "a recording needs its file"),
        ("listen = \"9000\"", "listen = \"5000\"", "listen at the same port"),
        ("idle_s = 60.0", "idle_s = 0.0", "give a number from 1 to 86400"),
        ("idle_s = 60.0", "idle_s = nan", "give a number from 1 to 86400"),
        ("[[tracker.body]]\nis = \"head\"\nid = 0\n[[tracker.body]]\nis = \"wand\"\nflystick = 0\n", "", "tracks nothing"),
    ];
    for (from, to, wanted) in cases {
        let told = refusal(from, to);
        assert!(told.contains(wanted) && told.starts_with("display.toml:"), "{told}");
    }
    let absent = Display::read("nowhere/display.toml").unwrap_err().to_string();
    assert!(absent.contains("heliodon display --preset"), "{absent}");
}

#[test]
fn the_template_shows_every_key() {
    let schema: serde_json::Value = serde_json::from_str(&DisplayFile::json_schema()).unwrap();
    let tables =
        ["DisplayInfo", "Place", "ScreenEntry", "TrackerEntry", "BodyEntry", "InputSettings", "Headset", "Kiosk", "Control"];
    for text in [Preset::Desktop, Preset::Flatworld].map(|preset| preset.file().to_toml_string()) {
        for table in tables {
            for key in schema["$defs"][table]["properties"].as_object().unwrap().keys().filter(|key| *key != "body") {
                let shown = text.lines().any(|line| line.trim_start_matches("# ").starts_with(&format!("{key} = ")));
                assert!(shown, "{table}.{key} stands nowhere in\n{text}");
            }
        }
    }
}

#[test]
fn the_committed_schema_is_current() {
    let path = Path::new("../../schema/display.schema.json");
    let current = DisplayFile::json_schema();
    if std::env::var_os("HELIODON_BLESS").is_some() {
        std::fs::write(path, &current).unwrap();
    }
    let committed = std::fs::read_to_string(path).unwrap_or_default();
    assert!(
        committed == current,
        "schema/display.schema.json is old: HELIODON_BLESS=1 cargo test -p heliodon_bundle --test all display::"
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn broken_rooms_are_refused_without_a_panic(cut in 0..ROOM.len(), put in "[-0-9.a-z\\[\\]\"=\\n]{0,6}", gone in 0_usize..12) {
        let (low, high) = (cut, (cut + gone).min(ROOM.len()));
        let text = format!("{}{put}{}", &ROOM[..low], &ROOM[high..]);
        if let Err(error) = Display::parse(&text, "display.toml") {
            prop_assert!(error.to_string().starts_with("display.toml"));
        }
    }
}
