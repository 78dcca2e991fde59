//! What comes from outside: files that are none, places that are none, a thousand sounds at once.
#![expect(clippy::unwrap_used, reason = "helpers of tests: a test that cannot go on has failed")]

use glam::{Quat, Vec3};
use heliodon_math::random::Pcg32;
use heliodon_sound::file::{read_clip, wav_bytes, write_wav};
use heliodon_sound::generate::{GenerateParams, SoundKind, generate};
use heliodon_sound::offline::OffLine;
use heliodon_sound::room::{Room, Walls};
use heliodon_sound::{Clip, Content, ControlError, DayCurve, MixerSettings, RATE_HZ, SourceSettings};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

fn data(name: &str) -> PathBuf {
    Path::new("tests/data").join(name)
}

fn noise() -> Arc<Clip> {
    let mut random = Pcg32::new(5, 5);
    Arc::new(Clip::new((0..RATE_HZ).map(|_| random.range_f32(-0.5, 0.5)).collect(), 1).unwrap())
}

/// How much of a sound is a tone of 1 kHz, against all of it.
fn purity(clip: &Clip) -> f64 {
    let ear: Vec<f64> = clip.samples().iter().step_by(clip.channels()).map(|s| f64::from(*s)).collect();
    let middle = &ear[ear.len() / 4..ear.len() / 4 + 9600];
    let (mut re, mut im) = (0.0, 0.0);
    for (k, sample) in middle.iter().enumerate() {
        let phase = std::f64::consts::TAU * 1000.0 * k as f64 / f64::from(RATE_HZ);
        re += sample * phase.cos();
        im += sample * phase.sin();
    }
    2.0 * (re * re + im * im) / middle.len() as f64 / middle.iter().map(|s| s * s).sum::<f64>()
}

#[test]
fn every_format_is_read() {
    let home = tempfile::tempdir().unwrap();
    for name in ["tone.ogg", "tone.flac", "tone.mp3"] {
        let (clip, facts) = read_clip(&data(name)).unwrap();
        assert_eq!((facts.rate_hz, facts.channels, facts.damaged, clip.channels()), (44_100, 2, 0, 2), "{name}");
        assert!((clip.seconds() - 0.5).abs() < 0.06, "{name}: {}", clip.seconds());
        assert!(purity(&clip) > 0.999, "{name}: {}", purity(&clip));
    }
    let (clip, _) = read_clip(&data("tone.flac")).unwrap();
    let path = home.path().join("again.wav");
    write_wav(&path, clip.samples(), 2).unwrap();
    let (again, facts) = read_clip(&path).unwrap();
    assert_eq!((facts.rate_hz, again.frames()), (RATE_HZ, clip.frames()));
    let worst = again.samples().iter().zip(clip.samples()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(worst < 2.0 / 32_768.0, "{worst}");
}

/// A WAV of floats, with any header.
fn floats(samples: &[f32], channels: u16, rate: u32, told_bytes: u32) -> Vec<u8> {
    let mut bytes = wav_bytes(&[], 1);
    bytes[20..22].copy_from_slice(&3_u16.to_le_bytes());
    bytes[22..24].copy_from_slice(&channels.to_le_bytes());
    bytes[24..28].copy_from_slice(&rate.to_le_bytes());
    bytes[28..32].copy_from_slice(&rate.wrapping_mul(4).wrapping_mul(channels.into()).to_le_bytes());
    bytes[32..34].copy_from_slice(&channels.wrapping_mul(4).to_le_bytes());
    bytes[34..36].copy_from_slice(&32_u16.to_le_bytes());
    bytes[40..44].copy_from_slice(&told_bytes.to_le_bytes());
    bytes[4..8].copy_from_slice(&told_bytes.saturating_add(36).to_le_bytes());
    bytes.extend(samples.iter().flat_map(|s| s.to_le_bytes()));
    bytes
}

#[test]
fn broken_files_are_refused_by_name_with_a_remedy() {
    let home = tempfile::tempdir().unwrap();
    let ogg = std::fs::read(data("tone.ogg")).unwrap();
    let good = vec![0.25_f32; 4800];
    let bytes = (good.len() * 4) as u32;
    let cases: Vec<(&str, Vec<u8>)> = vec![
        ("empty.wav", vec![]),
        ("text.mp3", b"this is a shopping list: olives, marble, more marble\n".repeat(50)),
        ("head.wav", wav_bytes(&[0.5; 100], 1)[..20].to_vec()),
        ("nothing.wav", wav_bytes(&[], 1)),
        ("no-channels.wav", floats(&good, 0, 48_000, bytes)),
        ("no-rate.wav", floats(&good, 1, 0, bytes)),
        ("fast.wav", floats(&good, 1, 4_000_000_000, bytes)),
        ("many.wav", floats(&good, 999, 48_000, bytes)),
        ("nan.wav", floats(&[0.0, f32::NAN, 0.0, 0.0].repeat(100), 1, 48_000, 1600)),
        ("infinite.wav", floats(&[0.0, f32::INFINITY].repeat(100), 1, 48_000, 800)),
        ("huge.wav", floats(&[0.0, 1.0e30].repeat(100), 2, 48_000, 800)),
        ("cut.ogg", ogg[..200].to_vec()),
        ("random.flac", (0..5000_u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 24) as u8).collect()),
    ];
    for (name, bytes) in cases {
        let path = home.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let told = read_clip(&path).expect_err(name).to_string();
        println!("{}", told.replace(&home.path().display().to_string(), ""));
        assert!(told.contains(name) && (told.contains(';') || told.contains(':')), "{told}");
    }
    assert!(read_clip(home.path()).unwrap_err().to_string().contains("folder"));
    assert!(read_clip(&home.path().join("none.wav")).unwrap_err().to_string().contains("none.wav"));
    // a header that promises more than there is: what there is, is heard
    let path = home.path().join("cut.wav");
    std::fs::write(&path, floats(&good, 1, 48_000, u32::MAX - 100)).unwrap();
    assert!(read_clip(&path).is_ok_and(|(clip, _)| clip.frames() <= 4800));
}

#[test]
fn files_with_bits_turned_over_neither_panic_nor_hang_nor_shout() {
    let home = tempfile::tempdir().unwrap();
    let mut random = Pcg32::new(11, 4);
    let began = Instant::now();
    let (mut read, mut refused) = (0, 0);
    for name in ["tone.ogg", "tone.flac", "tone.mp3", "tone.wav"] {
        let good = if name == "tone.wav" { wav_bytes(&[0.1; 5000], 2) } else { std::fs::read(data(name)).unwrap() };
        for turn in 0..60 {
            let mut bytes = good.clone();
            for _ in 0..1 + random.next_u32() % 12 {
                // headers more often than the rest
                let most = if turn % 2 == 0 { bytes.len().min(120) } else { bytes.len() };
                let at = random.next_u32() as usize % most;
                bytes[at] ^= 1 << (random.next_u32() % 8);
            }
            if turn % 5 == 0 {
                bytes.truncate(random.next_u32() as usize % bytes.len());
            }
            let path = home.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            match read_clip(&path) {
                Ok((clip, _)) => {
                    assert!(clip.samples().iter().all(|s| s.is_finite()));
                    read += 1;
                }
                Err(error) => {
                    assert!(error.to_string().contains(name), "{error}");
                    refused += 1;
                }
            }
        }
    }
    println!("{read} read, {refused} refused in {:.1} s", began.elapsed().as_secs_f64());
    assert!(began.elapsed().as_secs() < 60);
}

#[test]
fn places_that_are_none_are_told_and_change_nothing() {
    let scene = |odd: bool| {
        let mut offline = OffLine::new(&MixerSettings::default());
        let good = SourceSettings { place: Vec3::new(1.0, 0.0, -2.0), looping: true, ..SourceSettings::default() };
        let id = offline.control.add(Content::Clip(noise()), &good).unwrap();
        if odd {
            let nowhere = Vec3::new(0.0, f32::NAN, 0.0);
            let control = &mut offline.control;
            let mut refused = vec![
                control.place(id, nowhere).unwrap_err(),
                control.place(id, Vec3::splat(f32::INFINITY)).unwrap_err(),
                control.listener(nowhere, Quat::IDENTITY).unwrap_err(),
                control.listener(Vec3::ZERO, Quat::from_xyzw(0.0, 0.0, 0.0, 0.0)).unwrap_err(),
                control.listener(Vec3::ZERO, Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0)).unwrap_err(),
                control.gain(id, f32::NAN).unwrap_err(),
                control.gain(id, -1.0).unwrap_err(),
                control.rate(id, 0.0).unwrap_err(),
                control.occlusion(id, 1.5).unwrap_err(),
                control.seek(id, f64::NAN).unwrap_err(),
                control.hour(f32::INFINITY).unwrap_err(),
                control.volume(f32::NAN).unwrap_err(),
                control.ear_spacing(0.0).unwrap_err(),
            ];
            for bad in [
                SourceSettings { place: nowhere, ..good },
                SourceSettings { gain: f32::INFINITY, ..good },
                SourceSettings { reference_m: 0.0, ..good },
                SourceSettings { radius_m: f32::NAN, ..good },
                SourceSettings { rolloff: -3.0, ..good },
                SourceSettings { rate: 1000.0, ..good },
            ] {
                refused.push(control.add(Content::Clip(noise()), &bad).unwrap_err());
            }
            let tomb = Room::with_walls("tomb", Vec3::ZERO, Vec3::splat(4.0), Walls::Stone);
            refused.push(control.rooms(&[Room { max: nowhere, ..tomb.clone() }]).unwrap_err());
            refused.push(control.rooms(&vec![tomb; 99]).unwrap_err());
            refused.push(control.add_bed(Content::Clip(noise()), DayCurve::constant(1.0), f32::NAN, true).unwrap_err());
            refused.iter().for_each(|error| assert!(error.to_string().contains(';'), "{error}"));
        }
        // so far away, and so much at the centre of the head, that formulas divide by nothing
        for place in [Vec3::splat(1.0e30), Vec3::ZERO, Vec3::splat(f32::MIN_POSITIVE), Vec3::new(1.0, 0.0, -2.0)] {
            offline.control.place(id, place).unwrap();
            offline.advance(0.1);
        }
        assert!(offline.samples().iter().all(|s| s.abs() <= 1.0));
        offline.take()
    };
    assert!(scene(false) == scene(true));
}

#[test]
fn sounds_that_are_gone_are_told_and_slots_are_used_again() {
    let mut offline = OffLine::new(&MixerSettings { sources: 3, ..MixerSettings::default() });
    let blip = Arc::new(Clip::new(vec![0.2; 500], 1).unwrap());
    for _ in 0..20 {
        let ids: Vec<_> = (0..3)
            .map(|_| offline.control.add(Content::Clip(Arc::clone(&blip)), &SourceSettings::default()).unwrap())
            .collect();
        let full = offline.control.add(Content::Clip(Arc::clone(&blip)), &SourceSettings::default());
        assert!(matches!(full, Err(ControlError::Full { most: 3, .. })));
        offline.advance(0.3);
        assert_eq!(offline.control.take_finished().len(), 3);
        assert_eq!(offline.control.gain(ids[0], 1.0), Err(ControlError::Gone));
    }
    assert_eq!(Arc::strong_count(&blip), 1, "what is at its end is freed");
    // nobody renders: the queue fills, and that is told, not waited for
    let (mut control, _mixer) = MixerSettings::default().build();
    let refused = (0..100_000).find_map(|_| control.listener(Vec3::ZERO, Quat::IDENTITY).err());
    assert_eq!(refused, Some(ControlError::Busy));
}

fn thousand(reflected: usize, voices: usize) -> OffLine {
    let mut offline = OffLine::new(&MixerSettings { voices, reflected, ..MixerSettings::default() });
    let hall = Room::with_walls("hall", Vec3::new(-30.0, 0.0, -30.0), Vec3::new(30.0, 12.0, 30.0), Walls::Stone);
    offline.control.rooms(&[hall]).unwrap();
    let (clip, mut random) = (noise(), Pcg32::new(1, 2));
    for _ in 0..1000 {
        let place = Vec3::new(random.range_f32(-60.0, 60.0), random.range_f32(0.0, 4.0), random.range_f32(-60.0, 60.0));
        let settings = SourceSettings { place, looping: true, gain: 0.2, ..SourceSettings::default() };
        offline.control.add(Content::Clip(Arc::clone(&clip)), &settings).unwrap();
    }
    offline
}

/// Seconds that this thread has had a processor: other programs on the machine do not count. Where the system does not say, the time.
fn busy_s(began: Instant) -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok());
    nanoseconds.map_or(began.elapsed().as_secs_f64(), |ns| ns * 1.0e-9)
}

fn walk(offline: &mut OffLine, seconds: f64) -> f64 {
    let began = Instant::now();
    let before = busy_s(began);
    offline
        .script(seconds, 1.0 / 60.0, |t, control| control.listener(Vec3::new(t as f32 * 2.0, 1.7, 0.0), Quat::IDENTITY))
        .unwrap();
    (busy_s(began) - before) / seconds
}

#[test]
fn a_thousand_sounds_at_once_stay_within_their_time() {
    let mut offline = thousand(6, 48);
    offline.advance(0.2);
    let share = walk(&mut offline, 2.0);
    println!("1000 sounds, 48 of them rendered: {:.1} % of real time on one core", share * 100.0);
    // loose: a slow machine
    assert!(share < 0.6, "{share}");
    let told = offline.control.statistics();
    assert!(told.sources == 1000 && (40..=48).contains(&told.voices), "{told:?}");
    assert!(offline.samples().iter().all(|s| s.abs() <= heliodon_sound::limiter::CEILING));
}

/// `cargo test -p heliodon_sound --test all speed -- --ignored --nocapture`
#[test]
#[ignore = "prints figures"]
fn speed() {
    for (voices, reflected) in [(1, 0), (16, 0), (48, 0), (48, 6), (128, 6)] {
        let mut offline = thousand(reflected, voices);
        offline.advance(0.5);
        let share = walk(&mut offline, 5.0);
        println!("1000 sounds, {voices} rendered, {reflected} with reflections: {:.2} % of one core", share * 100.0);
    }
    let (mut control, mut mixer) = MixerSettings::default().build();
    let settings = SourceSettings { looping: true, ..SourceSettings::default() };
    let clip = noise();
    (0..4096).for_each(|_| {
        control.add(Content::Clip(Arc::clone(&clip)), &settings).ok();
    });
    let began = Instant::now();
    let before = busy_s(began);
    let passed = mixer.pass(10 * RATE_HZ as usize);
    println!(
        "4096 sounds unheard: {:.2} % of one core",
        100.0 * (busy_s(began) - before) / (passed as f64 / f64::from(RATE_HZ))
    );
    for kind in SoundKind::ALL {
        let began = Instant::now();
        let before = busy_s(began);
        let clip = generate(&GenerateParams::new(*kind)).unwrap();
        println!("{}: {:.1} s made in {:.2} s", kind.name(), clip.seconds(), busy_s(began) - before);
    }
}
