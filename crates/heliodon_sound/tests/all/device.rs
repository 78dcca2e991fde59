//! Devices: none, none wanted, and ALSA's null device, which takes everything and plays nothing.

use glam::Vec3;
use heliodon_sound::output::{Output, OutputSettings, OutputState};
use heliodon_sound::{Clip, Content, MixerSettings, RATE_HZ, SourceSettings};
use std::sync::Arc;
use std::time::{Duration, Instant};

fn until(mut done: impl FnMut() -> bool) -> bool {
    let began = Instant::now();
    while !done() {
        if began.elapsed() > Duration::from_secs(20) {
            return false;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    true
}

#[test]
fn off_plays_nothing_and_time_goes_on() {
    let (control, mixer) = MixerSettings::default().build();
    let output = Output::start(mixer, &OutputSettings::from_setting(Some("off"))).unwrap();
    assert!(until(|| control.clock().rendered_frames() > u64::from(RATE_HZ) / 10));
    assert_eq!((output.state(), output.take_news().len(), output.asked_frames()), (OutputState::Off, 0, 0));
}

#[test]
fn a_device_that_is_not_there_is_told_once_and_tried_again() {
    let (mut control, mixer) = MixerSettings::default().build();
    let again = Duration::from_millis(60);
    let settings = OutputSettings { device: Some("a device that nobody has".to_owned()), again, ..OutputSettings::default() };
    let output = Output::start(mixer, &settings).unwrap();
    let blip = Content::Clip(Arc::new(Clip::new(vec![0.1; 100], 1).unwrap()));
    control.add(blip, &SourceSettings::default()).unwrap();
    assert!(until(|| matches!(output.state(), OutputState::Silent { .. })));
    // sounds come to their end, unheard
    assert!(until(|| control.take_finished().len() == 1));
    std::thread::sleep(again * 5);
    let news = output.take_news();
    assert!(news.len() == 1 && news[0].contains("no sound") && news[0].contains("tried again"), "{news:?}");
    println!("{}", news[0]);
}

#[test]
fn words_choose_the_device() {
    assert!(!OutputSettings::from_setting(Some(" none ")).on);
    assert!(OutputSettings::from_setting(None).on && OutputSettings::from_setting(Some("default")).device.is_none());
    assert_eq!(OutputSettings::from_setting(Some("USB")).device.as_deref(), Some("USB"));
}

/// Run by the test below, with ALSA told that its null device is the default one.
#[test]
#[ignore = "needs ALSA_CONFIG_PATH"]
fn null_device() {
    let (mut control, mixer) = MixerSettings::default().build();
    let clock = control.clock();
    let tone = (0..RATE_HZ).map(|k| (k as f32 * 0.05).sin() * 0.3).collect();
    let settings = SourceSettings { place: Vec3::new(1.0, 0.0, -1.0), looping: true, ..SourceSettings::default() };
    control.add(Content::Clip(Arc::new(Clip::new(tone, 1).unwrap())), &settings).unwrap();
    let output = Output::start(mixer, &OutputSettings::default()).unwrap();
    let plays = until(|| output.asked_frames() > 20_000 || !output.take_news().is_empty());
    println!("state {:?}, asked {}, rendered {}", output.state(), output.asked_frames(), clock.rendered_frames());
    assert!(plays && matches!(output.state(), OutputState::Playing { .. }), "{:?} {:?}", output.state(), output.take_news());
    assert!(clock.rendered_frames() > 10_000 && clock.heard_frame(Instant::now()) <= clock.rendered_frames() as f64);
    assert!(control.statistics().loudest > 0.01 && control.statistics().voices == 1);
    // it ends in time, and gives everything back
    let began = Instant::now();
    drop(output);
    assert!(began.elapsed() < Duration::from_secs(5));
}

#[cfg(target_os = "linux")]
#[test]
fn the_callback_runs_on_alsas_null_device() {
    let home = tempfile::tempdir().unwrap();
    let config = home.path().join("asoundrc");
    for kind in ["null", "plug at 44.1 kHz"] {
        let slave = "pcm.!default { type null }\nctl.!default { type null }\n";
        let plug = "pcm.!default { type rate slave { pcm { type null } rate 44100 } }\nctl.!default { type null }\n";
        std::fs::write(&config, if kind == "null" { slave } else { plug }).unwrap();
        let ran = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "null_device", "--ignored", "--nocapture"])
            .env("ALSA_CONFIG_PATH", &config)
            .output()
            .unwrap();
        let text = String::from_utf8_lossy(&ran.stdout).into_owned() + &String::from_utf8_lossy(&ran.stderr);
        println!("{kind}: {text}");
        assert!(ran.status.success() || kind != "null", "{kind}: {text}");
    }
}
