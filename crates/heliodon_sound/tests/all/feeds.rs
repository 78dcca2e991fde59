//! Sound of films and of long files, in step with pictures: within 40 milliseconds is asked, and a fortieth of that is kept.

use glam::Vec3;
use heliodon_sound::feed::{FeedError, feed};
use heliodon_sound::file::write_wav;
use heliodon_sound::offline::OffLine;
use heliodon_sound::output::{Output, OutputSettings};
use heliodon_sound::stream::Stream;
use heliodon_sound::{Content, MixerSettings, RATE_HZ, SourceSettings, Travel};
use std::time::{Duration, Instant};

/// A film's sound: a tick at every whole half second.
fn ticks(rate_hz: u32, channels: usize, from_s: f64, seconds: f64) -> Vec<f32> {
    let first = (from_s * f64::from(rate_hz)).round() as u64;
    (first..first + (seconds * f64::from(rate_hz)) as u64)
        .flat_map(|k| {
            let since = k % u64::from(rate_hz / 2);
            let tick = if since < 20 { 0.3 } else { 0.0 };
            std::iter::repeat_n(tick, channels)
        })
        .collect()
}

fn voice() -> SourceSettings {
    SourceSettings {
        place: Vec3::new(0.0, 0.0, -8.0),
        reference_m: 8.0,
        travel: Travel::Immediate,
        ..SourceSettings::default()
    }
}

#[test]
fn the_clock_of_a_film_tells_what_is_heard() {
    for (rate_hz, channels) in [(48_000, 1), (44_100, 2), (22_050, 1)] {
        let (mut writer, reader) = feed(rate_hz, channels, 1.0).unwrap();
        let clock = writer.clock();
        let mut offline = OffLine::new(&MixerSettings::default());
        let mixers = offline.control.clock();
        offline.control.add(Content::Feed(Box::new(reader)), &voice()).unwrap();
        let film = ticks(rate_hz, channels, 0.0, 4.0);
        let (mut sent, mut worst, mut heard) = (0, 0.0_f64, 0);
        for _picture in 0..75 {
            sent += writer.push(&film[sent..]) * channels;
            let before = offline.samples().len() / 2;
            offline.advance(1.0 / 30.0);
            let now = clock.heard_s(&mixers, Instant::now());
            // a tick in this picture's sound: how much of the film has gone by since it, as the clock has it, and as it is heard
            let ear = offline.ear(0);
            if let Some(k) = (before..ear.len())
                .find(|k| ear[*k].abs() > 0.1 && ear[k.saturating_sub(200)..*k].iter().all(|s| s.abs() < 0.1))
            {
                let since_heard = (ear.len() - k) as f64 / f64::from(RATE_HZ);
                let tick = (now * 2.0).round() / 2.0;
                // what is rendered is 1.4 ms ahead of what the clock calls heard
                worst = worst.max((now - tick - since_heard).abs());
                heard += 1;
            }
        }
        println!("{rate_hz} Hz, {channels} channels: {heard} ticks, at most {:.2} ms off", worst * 1e3);
        assert!(heard >= 4 && worst < 0.004, "{heard} {worst}");
        assert_eq!(clock.dry(), 0);
    }
}

#[test]
fn a_film_that_is_wound_goes_on_from_there() {
    let (mut writer, reader) = feed(RATE_HZ, 1, 2.0).unwrap();
    let mut offline = OffLine::new(&MixerSettings::default());
    let mixers = offline.control.clock();
    offline.control.add(Content::Feed(Box::new(reader)), &voice()).unwrap();
    writer.push(&ticks(RATE_HZ, 1, 0.0, 1.5));
    offline.advance(0.6);
    assert!((writer.clock().heard_s(&mixers, Instant::now()) - 0.6).abs() < 0.01);
    writer.restart(30.0);
    writer.push(&ticks(RATE_HZ, 1, 30.0, 1.0));
    offline.advance(0.3);
    let heard = writer.clock().heard_s(&mixers, Instant::now());
    assert!((heard - 30.3).abs() < 0.01, "{heard}");
    // it runs dry, and stands
    offline.advance(2.0);
    let stands = writer.clock().heard_s(&mixers, Instant::now());
    assert!((stands - 31.0).abs() < 0.02 && writer.clock().dry() == 1, "{stands}");
    writer.push(&ticks(RATE_HZ, 1, 31.0, 1.0));
    writer.end();
    offline.advance(1.5);
    assert_eq!(offline.control.take_finished().len(), 1, "it is at its end");
    assert_eq!(writer.waiting_s(), 0.0);
}

#[test]
fn running_dry_and_winding_do_not_click() {
    let (mut writer, reader) = feed(RATE_HZ, 1, 2.0).unwrap();
    let mut offline = OffLine::new(&MixerSettings::default());
    offline.control.add(Content::Feed(Box::new(reader)), &voice()).unwrap();
    let w = std::f32::consts::TAU * 400.0 / RATE_HZ as f32;
    let tone: Vec<f32> = (0..RATE_HZ).map(|k| (w * k as f32).sin() * 0.4).collect();
    let mut sent = 0;
    for piece in [5000, 9001, 300, 20_000, 1234] {
        sent += writer.push(&tone[sent..sent + piece]);
        offline.advance(0.05);
        if piece == 9001 {
            writer.restart(5.0);
        }
        offline.advance(0.3);
    }
    let ear = offline.ear(0);
    let bend = ear.windows(3).map(|s| (s[0] - 2.0 * s[1] + s[2]).abs()).fold(0.0, f32::max);
    assert!(bend < 2.5 * w * w * 0.4, "{}", bend / (w * w * 0.4));
}

#[test]
fn odd_feeds_and_odd_samples_are_told_or_silent() {
    assert!(matches!(feed(48_000, 0, 1.0), Err(FeedError::Channels(0))));
    assert!(matches!(feed(48_000, 1, f64::NAN), Err(FeedError::Buffer(_))));
    assert!(matches!(feed(0, 1, 1.0), Err(FeedError::Rate(_))));
    let (mut writer, reader) = feed(44_100, 2, 1.0).unwrap();
    let mut offline = OffLine::new(&MixerSettings::default());
    offline.control.add(Content::Feed(Box::new(reader)), &voice()).unwrap();
    for odd in [f32::NAN, f32::INFINITY, f32::MAX, 1.0e-40] {
        writer.push(&vec![odd; 2001]);
        offline.advance(0.05);
    }
    assert!(offline.samples().iter().all(|s| s.abs() <= 1.0));
    drop(offline);
    assert!(writer.is_abandoned());
    assert!(writer.push(&[0.0; 2_000_000]) < 1_000_000, "what nobody hears is not kept for ever");
}

#[test]
fn long_files_are_streamed_in_step_wound_and_repeated() {
    let home = tempfile::tempdir().unwrap();
    let path = home.path().join("long.wav");
    write_wav(&path, &ticks(RATE_HZ, 1, 0.0, 6.0), 1).unwrap();
    let (stream, reader) = Stream::open(&path, true).unwrap();
    assert_eq!(stream.seconds(), Some(6.0));
    let mut offline = OffLine::new(&MixerSettings::default());
    let (mixers, clock) = (offline.control.clock(), stream.clock());
    offline.control.add(Content::Feed(Box::new(reader)), &voice()).unwrap();
    let onsets = |ear: &[f32]| -> Vec<usize> {
        (200..ear.len()).filter(|k| ear[*k].abs() > 0.1 && ear[k - 200..*k].iter().all(|s| s.abs() < 0.1)).collect()
    };
    for step in 0..100 {
        let (waiting, patience) = (clock.waiting_s(), Duration::from_secs(20));
        assert!(stream.wait(0.5, patience), "{step}: {waiting} s, {:?}", stream.take_trouble());
        offline.advance(0.08);
    }
    // eight seconds of a file of six: a tick every half second, to the sample, across its end too
    let ticks = onsets(&offline.ear(0));
    assert!(ticks.len() >= 14 && ticks.windows(2).all(|pair| pair[1] - pair[0] == RATE_HZ as usize / 2), "{ticks:?}");
    stream.wind(2.25);
    let began = Instant::now();
    while (clock.heard_s(&mixers, Instant::now()) - 2.25).abs() > 0.2 && began.elapsed() < Duration::from_secs(20) {
        std::thread::sleep(Duration::from_millis(5));
        offline.advance(0.001);
    }
    // the mixer lets go of what was read before
    offline.advance(0.01);
    assert!(stream.wait(0.5, Duration::from_secs(20)));
    let (before, time) = (offline.ear(0).len(), clock.heard_s(&mixers, Instant::now()));
    offline.advance(0.4);
    let tick = onsets(&offline.ear(0)[before..])[0] as f64 / f64::from(RATE_HZ);
    assert!((time + tick - 2.5).abs() < 0.005, "{time} {tick}");
    assert_eq!((clock.dry(), stream.take_trouble()), (0, None));
}

#[test]
fn a_film_goes_on_in_its_time_where_nothing_plays_it() {
    let (mut writer, reader) = feed(RATE_HZ, 1, 5.0).unwrap();
    let clock = writer.clock();
    let (mut control, mixer) = MixerSettings::default().build();
    let mixers = control.clock();
    control.add(Content::Feed(Box::new(reader)), &voice()).unwrap();
    writer.push(&ticks(RATE_HZ, 1, 0.0, 4.0));
    let output = Output::start(mixer, &OutputSettings::from_setting(Some("off"))).unwrap();
    let wait = |seconds: f64| {
        let began = Instant::now();
        while clock.heard_s(&mixers, Instant::now()) < seconds && began.elapsed() < Duration::from_secs(20) {
            std::thread::sleep(Duration::from_millis(2));
        }
        Instant::now()
    };
    let (first, second) = (wait(0.2), wait(1.2));
    let took = second.duration_since(first).as_secs_f64();
    // a busy machine may have kept this thread or that one from running for a while
    assert!((took - 1.0).abs() < 0.3, "a second of film took {took} s");
    drop(output);
}
