//! Films on the stage without a GPU, through the real ffmpeg; where it is not installed, every test here says that it is skipped.

use super::load::{Loaded, Opened};
use super::screen::{Passing, Screen};
use super::*;
use crate::sound::Sounds;
use crate::stage::StagePlugin;
use crate::story::StoryPlugin;
use crate::story::tests::write_bundle_of;
use crate::time_lapse::exposure::Exposure;
use bevy::time::TimeUpdateStrategy;
use heliodon_bundle::site::Site;
use heliodon_film::{FilmFormat, FilmWriter, Rate, WriteParams};
use heliodon_sound::{MixerSettings, RATE_HZ};
use std::path::Path;
use std::process::Command;
use std::time::Duration;

const RATE: Rate = Rate { numerator: 30, denominator: 1 };
/// Nothing here takes this long on a machine that works at all.
const PATIENCE: Duration = Duration::from_secs(60);

fn ffmpeg() -> bool {
    let there = Command::new("ffmpeg").arg("-version").output().is_ok();
    if !there {
        println!("skipped: ffmpeg is not installed");
    }
    there
}

/// Makes something with ffmpeg itself.
fn made(folder: &Path, arguments: &str, name: &str) {
    let arguments = arguments.split_whitespace();
    let output = Command::new("ffmpeg")
        .current_dir(folder)
        .args(["-v", "error", "-nostdin", "-y"])
        .args(arguments)
        .arg(name)
        .output()
        .unwrap();
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
}

/// The grey of a frame, which tells its number among 20.
fn grey(number: u64) -> u8 {
    (number % 20) as u8 * 12 + 8
}

fn number_of(grey: u8) -> u64 {
    (u64::from(grey) + 6 - 8) / 12
}

/// A film of greys.
fn greys(path: &Path, (width, height): (u32, u32), greys: impl Iterator<Item = u8>) {
    let params = WriteParams { format: FilmFormat::H264, ..WriteParams::archival(width, height, RATE) };
    let mut writer = FilmWriter::grey(path, &params).unwrap();
    for grey in greys {
        writer.write_grey(&vec![grey; (width * height) as usize]).unwrap();
    }
    writer.finish().unwrap();
}

fn film(name: &str, file: &str) -> Film {
    let text = format!(
        "[site]\nname = \"a\"\n[[part]]\nfile = \"a.obj\"\n[sky]\nprobes = \"*.hdr\"\nmapping = \"lat-long\"\n\
         [[film]]\nname = \"{name}\"\nfile = \"{file}\"\nplace = [0.0, 0.0, 0.0]\n"
    );
    Site::parse(&text, "site.toml").unwrap().file().films[0].clone()
}

fn passing(seconds: f64) -> Passing {
    Passing { seconds, hour_stands: false, waits: false, at_s: None, seen: true, visitor: None }
}

/// A film from a folder; what was told of it.
fn opened(folder: &Path, settings: &Film) -> (Option<Opened>, Vec<String>) {
    let mut loaded = Loaded::default();
    loaded.take(folder, settings, None);
    (loaded.films.pop(), loaded.told)
}

/// Passes until the picture of the time is there, or the film is not to be seen any more; problems on the way.
fn shown_number(screen: &mut Screen, passing: &Passing) -> (Option<u64>, Vec<String>) {
    let mut problems = Vec::new();
    let outcome = screen.pass(&Passing { waits: true, ..*passing }, None);
    problems.extend(outcome.problem);
    problems.extend(screen.pass(&Passing { waits: true, seconds: 0.0, ..*passing }, None).problem);
    (screen.picture().map(|frame| frame.number), problems)
}

#[test]
fn image_mask_and_sound_are_on_one_clock() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    // 3 s with a beep at each second; the image tells the frame's number, and so does the mask
    greys(&at("silent.mp4"), (64, 48), (0..90).map(grey));
    greys(&at("a.mask.mp4"), (64, 48), (0..90).map(grey));
    made(
        folder.path(),
        "-i silent.mp4 -f lavfi -i aevalsrc='0.8*lt(mod(t,1),0.05)*sin(2*PI*1000*t)':s=48000:d=3 -c:v copy -c:a aac -b:a 160k",
        "a.mp4",
    );
    let settings = Film { mask: Some("a.mask.mp4".to_owned()), ..film("guide", "a.mp4") };
    let (opened, told) = opened(folder.path(), &settings);
    assert!(told.is_empty(), "{told:?}");
    let (control, mut mixer) = MixerSettings::default().build();
    let mut sounds = Sounds::heard_by(control);
    let (mut screen, problem) = Screen::new(opened.unwrap(), &[], false);
    assert!(problem.is_none());
    assert_eq!(shown_number(&mut screen, &passing(0.0)).0, Some(0));
    // steps of 10 ms, and which frame is seen while which sample is heard
    const STEP: usize = RATE_HZ as usize / 100;
    let (mut heard, mut seen) = (Vec::new(), Vec::new());
    let begun = Instant::now();
    let mut block = [0.0; 2 * STEP];
    for _ in 0..700 {
        // the mixer is not kept waiting, for here its time does not pass by itself
        while screen.waiting_s().is_some_and(|waiting_s| waiting_s < 0.02) {
            assert!(begun.elapsed() < PATIENCE, "the sound never came");
            std::thread::sleep(Duration::from_millis(1));
        }
        mixer.render(&mut block);
        heard.extend(block.chunks_exact(2).map(|ears| ears[0].abs().max(ears[1].abs())));
        assert!(screen.pass(&passing(0.01), Some(&mut sounds)).problem.is_none());
        while RATE.frame_at(screen.seconds()) != screen.picture().unwrap().number {
            assert!(begun.elapsed() < PATIENCE, "the picture never came");
            std::thread::sleep(Duration::from_millis(1));
            screen.pass(&passing(0.0), Some(&mut sounds));
        }
        let frame = screen.picture().unwrap();
        let [grey, _, _, alpha] = frame.pixels[0];
        let (image, mask) = (number_of(grey), number_of(255 - alpha));
        assert_eq!((image, mask), (frame.number % 90 % 20, frame.number % 90 % 20), "image and mask of frame {}", frame.number);
        seen.push((heard.len(), frame.number));
    }
    // the beeps as they came out, each the first that is loud after a silence
    let loud: Vec<usize> = (0..heard.len()).filter(|&i| heard[i] > 0.02).collect();
    let beeps: Vec<usize> = loud
        .iter()
        .enumerate()
        .filter(|&(i, &at)| i == 0 || at - loud[i - 1] > RATE_HZ as usize / 4)
        .map(|(_, &at)| at)
        .collect();
    assert!(beeps.len() >= 6, "{} beeps", beeps.len());
    let begins = |number: u64| seen.iter().find(|(_, seen)| *seen >= number).map(|(samples, _)| *samples);
    let apart_s: Vec<f64> = (0_u64..)
        .zip(&beeps)
        .filter_map(|(second, &beep)| Some((begins(30 * second)? as f64 - beep as f64) / f64::from(RATE_HZ)))
        .collect();
    // the first picture is there before its sound is asked for
    let worst_s = apart_s.iter().skip(1).fold(0.0_f64, |worst, apart_s| worst.max(apart_s.abs()));
    assert!(apart_s.len() >= 6);
    println!("image, mask and sound are at most {:.1} ms apart", worst_s * 1e3);
    assert!(worst_s < 0.04, "image and sound are {:.1} ms apart", worst_s * 1e3);
}

#[test]
fn odd_films_are_told_and_shown() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let lavfi = |source: &str, rest: &str, name: &str| made(path, &format!("-f lavfi -i {source} {rest}"), name);
    lavfi("testsrc2=s=637x1281:r=24000/1001:d=1", "-c:v libx264 -pix_fmt yuv444p", "odd.mp4");
    lavfi("testsrc2=s=64x48:r=30:d=2", "-vf select=not(mod(n\\,7))+lt(n\\,20) -vsync vfr", "varies.mp4");
    lavfi("testsrc2=s=3000x100:r=10:d=1", "", "wide.mp4");
    greys(&path.join("image.mp4"), (64, 48), (0..60).map(grey));
    greys(&path.join("short.mp4"), (32, 32), (0..30).map(grey));
    for (file, mask, at_s, words) in [
        ("odd.mp4", None, 0.9, vec![]),
        ("varies.mp4", None, 1.0, vec!["no constant rate"]),
        ("wide.mp4", None, 0.5, vec!["scale it down"]),
        ("image.mp4", Some("short.mp4"), 0.5, vec!["the mask is stretched", "ends with the shorter one"]),
    ] {
        let settings = Film { mask: mask.map(str::to_owned), ..film("guide", file) };
        let (opened, told) = opened(path, &settings);
        assert_eq!(told.len(), words.len(), "{file}: {told:?}");
        assert!(told.iter().zip(&words).all(|(told, words)| told.contains(words)), "{file}: {told:?}");
        let mut screen = Screen::new(opened.unwrap(), &[], false).0;
        let (number, problems) = shown_number(&mut screen, &Passing { at_s: Some(at_s), ..passing(0.0) });
        assert!(problems.is_empty(), "{file}: {problems:?}");
        let rate = screen.opened.source.as_ref().unwrap().film().rate;
        assert_eq!(number, Some(rate.frame_at(at_s)), "{file}");
    }
    let wide = Opened::look(path, film("a", "wide.mp4"), &mut Vec::new()).unwrap();
    assert_eq!(wide.size, (2048, 68));
}

#[test]
fn what_is_no_film_is_told_once_and_ended() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    made(path, "-f lavfi -i sine=d=1", "sound.mp4");
    std::fs::write(path.join("text.mp4"), "no film at all").unwrap();
    made(path, "-f lavfi -i testsrc2=s=320x240:r=30:d=3 -c:v libx264 -movflags +faststart", "whole.mp4");
    let whole = std::fs::read(path.join("whole.mp4")).unwrap();
    std::fs::write(path.join("cut.mp4"), &whole[..whole.len() / 3]).unwrap();
    std::fs::write(path.join("stub.mp4"), &whole[..200]).unwrap();
    for file in ["nowhere.mp4", "sound.mp4", "text.mp4", "stub.mp4"] {
        let (opened, told) = opened(path, &film("guide", file));
        assert!(opened.is_none() && told.len() == 1, "{file}: {told:?}");
        assert!(told[0].contains("the film guide is not shown") && told[0].contains(file), "{told:?}");
    }
    // what breaks off goes on to be shown as far as it goes, or is told once; whoever waits for its end is told of it once
    let (opened, _) = opened(path, &Film { repeat: false, ..film("guide", "cut.mp4") });
    let mut screen = Screen::new(opened.unwrap(), &[], false).0;
    screen.begin(true);
    let (mut problems, mut ends) = (0, 0);
    let begun = Instant::now();
    while screen.is_playing() {
        assert!(begun.elapsed() < PATIENCE, "it never ends");
        let outcome = screen.pass(&passing(0.05), None);
        problems += u32::from(outcome.problem.is_some());
        ends += u32::from(outcome.ended);
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(problems <= 1 && ends == 1, "{problems} problems, {ends} ends");
    assert!(!screen.pass(&passing(0.05), None).ended && screen.picture().is_none());
}

const SITE: &str = r#"
[site]
name = "Hall"
[[part]]
file = "hall.obj"
[sky]
probes = "*.hdr"
mapping = "lat-long"
[[path]]
name = "round"
points = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]]
[[film]]
name = "guide"
file = "guide.mp4"
place = [0.0, 0.0, 0.0]
plays = false
repeat = false
leads = "round"
[[film]]
name = "crowd"
file = "crowd.mp4"
place = [3.0, 0.0, 0.0]
with_clock = true
[[film]]
name = "gone"
file = "gone.mp4"
place = [3.0, 0.0, 0.0]
plays = false
[story]
scripts = ["story.rhai"]
"#;

const SCRIPT: &str = r#"
after(0.2, || { play_film("guide"); play_film("gone"); });
when_ended("guide", || { stop_film("crowd"); remember("guide", "over"); });
when_ended("gone", || { remember("gone", "over"); });
"#;

#[test]
fn scripts_play_and_stop_films_and_hear_of_their_end() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("story.rhai"), SCRIPT).unwrap();
    std::fs::write(path.join("gone.mp4"), "no film").unwrap();
    greys(&path.join("guide.mp4"), (64, 48), (0..30).map(grey));
    greys(&path.join("crowd.mp4"), (64, 48), (0..30).map(grey));
    write_bundle_of(path, SITE);
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, StagePlugin, StoryPlugin, FilmPlugin))
        .init_resource::<StageFrame>()
        .init_resource::<TimeLapse>()
        .init_resource::<Exposure>()
        .init_resource::<Now>()
        .init_resource::<Actors>()
        .init_resource::<crate::impostor::Impostors>()
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)));
    app.world_mut().resource_mut::<Films>().wait = true;
    app.world_mut().resource_mut::<TimeLapse>().playing = true;
    app.world_mut().spawn(Visitor::default());
    app.world_mut().spawn((Camera::default(), DaylightCamera));
    let stand = |app: &mut App, x: f32| {
        let world = app.world_mut();
        let eye = Vec3::new(x, 1.7, 0.5);
        world.query::<&mut Visitor>().single_mut(world).unwrap().pose = crate::navigation::pose::Pose::looking(eye, Vec3::ZERO);
    };
    stand(&mut app, 0.0);
    app.world_mut().resource_mut::<Stage>().open(path.join("bundle")).unwrap();
    let begun = Instant::now();
    let films = |app: &App, name: &str| {
        (app.world().resource::<Films>().is_playing(name), app.world().resource::<Films>().whereabouts(name))
    };
    while !films(&app, "crowd").0 {
        assert!(begun.elapsed() < PATIENCE, "the films never came");
        app.update();
        std::thread::sleep(Duration::from_millis(1));
    }
    // the hour stands still, and so does the crowd, which goes by it
    app.world_mut().resource_mut::<TimeLapse>().playing = false;
    app.update();
    let stood_s = films(&app, "crowd").1.unwrap().0;
    (0..5).for_each(|_| app.update());
    assert_eq!(films(&app, "crowd").1.unwrap().0, stood_s);
    app.world_mut().resource_mut::<TimeLapse>().playing = true;
    let mut played = false;
    for frame in 0..200 {
        stand(&mut app, 0.02 * frame as f32);
        app.update();
        let (plays, at) = films(&app, "guide");
        let (seconds, place) = at.unwrap();
        played |= plays;
        assert!(!plays || seconds < 1.1, "it is over after its second");
        assert!(place.x <= 0.02 * frame as f32 + 4.01, "not farther ahead than it may be");
    }
    assert!(played && !films(&app, "guide").0, "it was started, and has ended");
    assert!(films(&app, "guide").1.unwrap().1.x > 1.0, "and has led on");
    assert!(!films(&app, "crowd").0, "the script has heard of it");
    let mut story = app.world_mut().resource_mut::<Story>();
    assert!(story.remembered("guide").is_some() && story.remembered("gone").is_some(), "what cannot be shown has ended, too");
    let told = app.world().resource::<Films>().told();
    assert!(told.shown > 30, "{told:?}");
    // again from its beginning, at once
    assert!(app.world_mut().resource_mut::<Films>().play("guide"));
    app.update();
    app.update();
    let (seconds, _) = films(&app, "guide").1.unwrap();
    assert!(seconds < 0.1, "{seconds}");
}
