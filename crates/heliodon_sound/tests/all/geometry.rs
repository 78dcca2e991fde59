//! Level and delay at both ears, as geometry predicts, for ten places; worked out here anew, in double precision.
#![expect(clippy::unwrap_used, reason = "helpers of tests: a test that cannot go on has failed")]

use glam::{Quat, Vec3};
use heliodon_sound::Content;
use heliodon_sound::clip::Clip;
use heliodon_sound::mixer::{Mixer, MixerSettings};
use heliodon_sound::offline::OffLine;
use heliodon_sound::{LATENCY_FRAMES, RATE_HZ};
use heliodon_sound::{SourceSettings, Travel};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

const C: f64 = 343.2;
const A: f64 = 0.0875;
const BEFORE: usize = 2400;
const LEVEL: f64 = 0.1;

/// Way and alpha, by the formulas in `head.rs`.
fn predicted(p_head: Vec3, side: f64) -> (f64, f64) {
    let p = p_head.as_dvec3();
    let distance = p.length();
    let theta = (side * p.x / distance).clamp(-1.0, 1.0).acos();
    let way = if theta.cos() >= A / distance {
        (distance * distance + A * A - 2.0 * distance * A * theta.cos()).sqrt()
    } else {
        (distance * distance - A * A).sqrt() + A * (theta - (A / distance).acos())
    };
    (way, 1.05 + 0.95 * (theta.to_degrees() * 180.0 / 150.0).to_radians().cos())
}

/// One pole that takes `db` at 4 kHz: its answer at a frequency (magnitude, phase).
fn dull(db: f64, hz: f64) -> (f64, f64) {
    let w = |hz: f64| TAU * hz / f64::from(RATE_HZ);
    let (mut low, mut high) = (0.0, 0.9999);
    let magnitude = |a: f64, w: f64| (1.0 - a) / (1.0 - 2.0 * a * w.cos() + a * a).sqrt();
    for _ in 0..100 {
        let a = f64::midpoint(low, high);
        if 20.0 * magnitude(a, w(4000.0)).log10() > -db { low = a } else { high = a }
    }
    (magnitude(low, w(hz)), -(low * w(hz).sin()).atan2(1.0 - low * w(hz).cos()))
}

/// The head's shadow.
fn shadow(alpha: f64, hz: f64) -> (f64, f64) {
    // the bilinear transform bends frequencies
    let x = 2.0 * f64::from(RATE_HZ) * (PI * hz / f64::from(RATE_HZ)).tan() / (2.0 * C / A);
    (((1.0 + alpha * alpha * x * x) / (1.0 + x * x)).sqrt(), (alpha * x).atan() - x.atan())
}

fn impulse() -> Content {
    let mut samples = vec![0.0; BEFORE + 4800];
    samples[BEFORE] = LEVEL as f32;
    Content::Clip(Arc::new(Clip::new(samples, 1).unwrap()))
}

/// What both ears hear of an impulse.
fn heard(position: Vec3, orientation: Quat, settings: &SourceSettings) -> OffLine {
    let mut offline = OffLine::new(&MixerSettings::default());
    offline.control.listener(position, orientation).unwrap();
    offline.control.add(impulse(), settings).unwrap();
    offline.advance(0.6);
    offline
}

/// Magnitude and phase at a frequency, with the phase of an impulse at `origin` (samples) taken off.
fn spectrum(samples: &[f32], hz: f64, origin: f64) -> (f64, f64) {
    let (mut re, mut im) = (0.0, 0.0);
    for (k, sample) in samples.iter().enumerate() {
        let phase = -TAU * hz / f64::from(RATE_HZ) * (k as f64 - origin);
        re += f64::from(*sample) * phase.cos();
        im += f64::from(*sample) * phase.sin();
    }
    (re.hypot(im), im.atan2(re))
}

fn places() -> [(Vec3, f32, f32); 10] {
    [
        (Vec3::new(0.0, 0.0, -2.0), 0.0, 0.0),
        (Vec3::new(2.0, 0.0, 0.0), 0.0, 0.0),
        (Vec3::new(-3.0, 0.5, -1.0), 0.0, 0.0),
        (Vec3::new(0.5, 1.0, 4.0), 0.0, 0.0),
        (Vec3::new(0.3, -0.2, -0.1), 0.0, 0.0),
        (Vec3::new(-40.0, 5.0, 20.0), 0.0, 0.0),
        (Vec3::new(10.0, 0.0, -10.0), 70.0, 0.0),
        (Vec3::new(-1.0, 0.0, -1.0), -130.0, 20.0),
        (Vec3::new(0.0, 6.0, 0.1), 33.0, -15.0),
        (Vec3::new(15.0, -3.0, 60.0), 190.0, 5.0),
    ]
}

#[test]
fn level_and_delay_at_both_ears_for_ten_places() {
    let (mut worst_db, mut worst_samples) = (0.0_f64, 0.0_f64);
    let listener = Vec3::new(3.0, 1.7, -8.0);
    for (offset, yaw, pitch) in places() {
        let turned = Quat::from_rotation_y(yaw.to_radians()) * Quat::from_rotation_x(pitch.to_radians());
        let settings = SourceSettings { place: listener + offset, ..SourceSettings::default() };
        let offline = heard(listener, turned, &settings);
        for (ear, side) in [-1.0, 1.0].into_iter().enumerate() {
            let (way, alpha) = predicted(turned.inverse() * offset, side);
            let origin = BEFORE as f64 + LATENCY_FRAMES as f64 + way / C * f64::from(RATE_HZ);
            let samples = offline.ear(ear);
            for hz in [150.0, 400.0, 1000.0, 2500.0, 4000.0, 7000.0] {
                let (level, phase) = spectrum(&samples, hz, origin);
                let (air, air_phase) = dull(0.03 * f64::from(offset.length()), hz);
                let (head, head_phase) = shadow(alpha, hz);
                let expected = LEVEL / way.max(0.3) * air * head;
                let db = 20.0 * (level / expected).log10();
                let turn = (phase - air_phase - head_phase + PI).rem_euclid(TAU) - PI;
                let late = -turn / (TAU * hz / f64::from(RATE_HZ));
                assert!(db.abs() < 0.5, "{offset} ear {ear} at {hz} Hz: {db:.3} dB");
                assert!(late.abs() < 1.0, "{offset} ear {ear} at {hz} Hz: {late:.3} samples");
                (worst_db, worst_samples) = (worst_db.max(db.abs()), worst_samples.max(late.abs()));
            }
        }
    }
    println!("ten places, both ears, six frequencies: at most {worst_db:.3} dB and {worst_samples:.3} samples off");
}

#[test]
fn the_nearer_ear_hears_first_and_louder() {
    let settings = SourceSettings { place: Vec3::new(2.0, 0.0, 0.0), ..SourceSettings::default() };
    let offline = heard(Vec3::ZERO, Quat::IDENTITY, &settings);
    let peak = |ear: usize| {
        let samples = offline.ear(ear);
        let at = (0..samples.len()).max_by(|a, b| samples[*a].abs().total_cmp(&samples[*b].abs())).unwrap();
        (at, samples[at])
    };
    let ((left, left_level), (right, right_level)) = (peak(0), peak(1));
    let woodworth = A * (1.0 + PI / 2.0) / C * f64::from(RATE_HZ);
    assert!(right_level > 4.0 * left_level.abs());
    assert!((left as f64 - right as f64 - woodworth).abs() < 10.0, "{left} {right} {woodworth}");
}

#[test]
fn a_films_sound_is_not_late_but_for_the_difference_between_the_ears() {
    for distance in [1.0_f32, 10.0, 60.0] {
        let place = Vec3::new(distance, 0.0, 0.0);
        let settings = SourceSettings { place, travel: Travel::Immediate, gain: distance, ..SourceSettings::default() };
        let offline = heard(Vec3::ZERO, Quat::IDENTITY, &settings);
        let right = offline.ear(1);
        let at = (0..right.len()).max_by(|a, b| right[*a].abs().total_cmp(&right[*b].abs())).unwrap();
        assert!(at.abs_diff(BEFORE + LATENCY_FRAMES as usize) <= 1, "{distance} m: {at}");
    }
}

#[test]
fn rolloff_reference_and_radius_are_what_they_say() {
    let level = |settings: SourceSettings| {
        let offline = heard(Vec3::ZERO, Quat::IDENTITY, &settings);
        let origin = BEFORE as f64;
        spectrum(&offline.ear(0), 200.0, origin).0
    };
    let at = |metres: f32| SourceSettings { place: Vec3::new(0.0, 0.0, -metres), ..SourceSettings::default() };
    let (near, far) = (level(at(4.0)), level(at(8.0)));
    assert!((near / far - 2.0).abs() < 0.01, "{}", near / far);
    let flat = |metres| level(SourceSettings { rolloff: 0.0, ..at(metres) });
    assert!((flat(4.0) / flat(20.0) - 1.0).abs() < 0.01);
    let wide = |metres| level(SourceSettings { radius_m: 3.0, ..at(metres) });
    assert!((wide(1.0) / wide(2.0) - 1.0).abs() < 0.01);
    let carried = level(SourceSettings { reference_m: 4.0, ..at(8.0) });
    assert!((carried / far - 4.0).abs() < 0.02);
}

#[test]
fn doppler_is_what_physics_says_it_is() {
    // 100 samples a period, towards the listener at 20 m/s. The way is that of the moment at which it is heard, so the pitch is
    // 1 + v / c = 1.0583 times as high; physics' 1 / (1 - v / c) = 1.0619 is a seventeenth of a semitone more
    let tone: Vec<f32> = (0..48_000).map(|k| (TAU * 480.0 * f64::from(k) / 48_000.0).sin() as f32 * 0.5).collect();
    let clip = Content::Clip(Arc::new(Clip::new(tone, 1).unwrap()));
    let mut offline = OffLine::new(&MixerSettings::default());
    let start = SourceSettings { place: Vec3::new(0.0, 0.0, -60.0), looping: true, gain: 10.0, ..SourceSettings::default() };
    let id = offline.control.add(clip, &start).unwrap();
    offline.script(1.5, 1.0 / 120.0, |t, control| control.place(id, Vec3::new(0.0, 0.0, -60.0 + 20.0 * t as f32))).unwrap();
    let late = &offline.ear(0)[48_000..];
    let crossings: Vec<usize> = (1..late.len()).filter(|k| late[k - 1] < 0.0 && late[*k] >= 0.0).collect();
    let period = (crossings[crossings.len() - 1] - crossings[0]) as f64 / (crossings.len() - 1) as f64;
    let hz = 48_000.0 / period;
    assert!((hz / (480.0 * (1.0 + 20.0 / C)) - 1.0).abs() < 0.002, "{hz}");
}

#[test]
fn occluded_sources_are_quieter_and_duller() {
    let at = |occlusion: f32| {
        let settings = SourceSettings { place: Vec3::new(1.0, 0.0, -5.0), occlusion, ..SourceSettings::default() };
        let offline = heard(Vec3::ZERO, Quat::IDENTITY, &settings);
        [200.0, 4000.0].map(|hz| 20.0 * spectrum(&offline.ear(0), hz, 0.0).0.log10())
    };
    let (open, half, hidden) = (at(0.0), at(0.5), at(1.0));
    assert!((open[0] - hidden[0] - 12.0).abs() < 0.5 && (open[1] - hidden[1] - 24.0).abs() < 0.5, "{open:?} {hidden:?}");
    assert!(half[0] < open[0] - 4.0 && half[0] > hidden[0] + 4.0 && half[1] < open[1] - 9.0);
}

#[test]
fn any_division_into_blocks_gives_the_same_bits() {
    let scene = |render: &dyn Fn(&mut Mixer, &mut [f32])| {
        let (mut control, mut mixer) = MixerSettings { voices: 5, ..MixerSettings::default() }.build();
        let noise: Vec<f32> =
            (0..9000_u32).map(|k| heliodon_math::random::unit_f32(heliodon_math::random::hash_u32(k)) - 0.5).collect();
        let clip = Arc::new(Clip::new(noise, 1).unwrap());
        let room = heliodon_sound::room::Room::with_walls(
            "hall",
            Vec3::new(-9.0, -1.0, -9.0),
            Vec3::new(9.0, 8.0, 9.0),
            heliodon_sound::room::Walls::Stone,
        );
        control.rooms(&[room]).unwrap();
        let ids: Vec<_> = (0..9)
            .map(|k| {
                control.when(Some(k * 777));
                let place = Vec3::new(k as f32 - 4.0, 1.0, -2.0 - k as f32 * 0.5);
                let settings =
                    SourceSettings { place, looping: k % 2 == 0, rate: 1.0 + 0.03 * k as f32, ..SourceSettings::default() };
                control.add(Content::Clip(Arc::clone(&clip)), &settings).unwrap()
            })
            .collect();
        for step in 0..60_u64 {
            control.when(Some(step * 800));
            control.listener(Vec3::new(0.1 * step as f32, 1.7, 0.0), Quat::from_rotation_y(0.1 * step as f32)).unwrap();
            let _ = control.place(ids[step as usize % 9], Vec3::new(3.0, 1.0, step as f32 * 0.3 - 9.0));
        }
        let mut out = vec![0.0; 2 * 50_000];
        render(&mut mixer, &mut out);
        out
    };
    let whole = scene(&|mixer, out| mixer.render(out));
    assert!(whole.iter().any(|s| s.abs() > 0.01));
    for block in [2, 74, 128, 960, 2048, 30_000] {
        let parts = scene(&|mixer, out| out.chunks_mut(block).for_each(|part| mixer.render(part)));
        assert!(parts == whole, "blocks of {block} samples");
    }
}
