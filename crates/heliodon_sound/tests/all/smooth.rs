//! Nothing clicks: a tone's second difference is `(w / rate)^2` times its level, a click's is its whole height.
#![expect(clippy::unwrap_used, reason = "helpers of tests: a test that cannot go on has failed")]

use glam::{Quat, Vec3};
use heliodon_sound::offline::OffLine;
use heliodon_sound::room::{Room, Walls};
use heliodon_sound::{Clip, Content, Control, ControlError, MixerSettings, RATE_HZ, SourceId, SourceSettings};
use std::f64::consts::TAU;
use std::sync::Arc;

const HZ: f64 = 400.0;

fn tone() -> Arc<Clip> {
    let wave = (0..RATE_HZ).map(|k| (TAU * HZ * f64::from(k) / f64::from(RATE_HZ)).sin() as f32 * 0.5);
    Arc::new(Clip::new(wave.collect(), 1).unwrap())
}

fn bend(samples: &[f32]) -> f32 {
    samples.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).fold(0.0, f32::max)
}

/// The worst second difference of a scene with one tone, against a still tone's of the loudest level that is met.
fn roughness(settings: SourceSettings, told: impl FnMut(f64, &mut Control, SourceId) -> Result<(), ControlError>) -> f32 {
    roughness_in(&[], settings, told)
}

fn roughness_in(
    rooms: &[Room],
    settings: SourceSettings,
    mut told: impl FnMut(f64, &mut Control, SourceId) -> Result<(), ControlError>,
) -> f32 {
    let mut offline = OffLine::new(&MixerSettings::default());
    offline.control.rooms(rooms).unwrap();
    let id = offline.control.add(Content::Clip(tone()), &settings).unwrap();
    // it is there and has settled before anything happens
    offline.advance(0.5);
    offline.take();
    offline.script(2.0, 1.0 / 60.0, |t, control| told(t, control, id)).unwrap();
    let w = (TAU * HZ / f64::from(RATE_HZ)) as f32;
    (0..2)
        .map(|ear| {
            let samples = offline.ear(ear);
            let loudest = samples.iter().fold(0.0_f32, |a, b| a.max(b.abs()));
            assert!(loudest > 0.01, "something is heard");
            bend(&samples) / (w * w * loudest)
        })
        .fold(0.0, f32::max)
}

fn at(place: Vec3) -> SourceSettings {
    SourceSettings { place, looping: true, stays: true, ..SourceSettings::default() }
}

/// Of a still tone 1; what moves fast is higher (Doppler) and what fades fast has sidebands.
const SMOOTH: f32 = 1.5;

#[test]
fn what_is_still_is_smooth() {
    let rough = roughness(at(Vec3::new(1.0, 0.0, -2.0)), |_, _, _| Ok(()));
    println!("still {rough:.3}");
    assert!(rough < 1.02, "{rough}");
}

#[test]
fn walking_sources_and_walking_and_turning_heads_do_not_click() {
    let source = roughness(at(Vec3::new(-2.0, 0.0, -1.0)), |t, control, id| {
        control.place(id, Vec3::new(-2.0 + 1.5 * t as f32, 0.0, -1.0))
    });
    let head = roughness(at(Vec3::new(-1.0, 1.7, -2.0)), |t, control, _| {
        control.listener(Vec3::new(0.0, 1.7, 1.5 - 3.0 * t as f32), Quat::from_rotation_y(9.0 * t as f32))
    });
    // 12 frames a second, at a run past the ear
    let mut last = -1.0;
    let coarse = roughness(at(Vec3::new(-2.0, 0.0, -0.5)), |t, control, id| {
        if t - last < 1.0 / 12.0 {
            return Ok(());
        }
        last = t;
        control.place(id, Vec3::new(-4.0 + 4.0 * t as f32, 0.0, -0.5))
    });
    println!("source {source:.3}, head {head:.3}, 12 frames a second {coarse:.3}");
    assert!(source < SMOOTH && head < SMOOTH && coarse < SMOOTH);
}

#[test]
fn jumps_do_not_click() {
    let jump = |every: f64| {
        let (mut next, mut side) = (0.1, 1.0_f32);
        roughness(at(Vec3::new(2.0, 0.0, -1.0)), move |t, control, id| {
            if t < next {
                return Ok(());
            }
            (next, side) = (next + every, -side);
            control.place(id, Vec3::new(side * 2.0, 0.0, side * 9.0 - 4.0))
        })
    };
    let (now_and_then, always) = (jump(0.3), jump(0.0));
    let teleport = roughness(at(Vec3::new(2.0, 0.0, -1.0)), |t, control, _| {
        let there = if ((t * 3.0) as u32).is_multiple_of(2) { Vec3::ZERO } else { Vec3::new(40.0, 0.0, -3.0) };
        control.listener(there, Quat::from_rotation_y(t as f32 * 40.0))
    });
    println!("jumps {now_and_then:.3}, at every frame {always:.3}, teleports {teleport:.3}");
    assert!(now_and_then < SMOOTH && always < SMOOTH && teleport < SMOOTH);
}

#[test]
fn starting_stopping_winding_and_levels_do_not_click() {
    let phase = |t: f64| (t * 60.0).round() as u32 % 12;
    let start = roughness(at(Vec3::new(1.0, 0.0, -1.0)), |t, control, id| match phase(t) {
        3 => control.stop(id),
        8 => control.start(id),
        _ => Ok(()),
    });
    let seek = roughness(at(Vec3::new(1.0, 0.0, -1.0)), |t, control, id| match phase(t) {
        5 => control.seek(id, 0.2503 + 0.1 * t),
        _ => Ok(()),
    });
    let gain = roughness(at(Vec3::new(1.0, 0.0, -1.0)), |t, control, id| match phase(t) {
        2 => control.gain(id, 0.0),
        8 => control.gain(id, 1.0),
        _ => Ok(()),
    });
    let hide =
        roughness(at(Vec3::new(1.0, 0.0, -1.0)), |t, control, id| control.occlusion(id, if phase(t) < 6 { 1.0 } else { 0.0 }));
    let whole = roughness(at(Vec3::new(1.0, 0.0, -1.0)), |t, control, _| match phase(t) {
        1 => control.mute(true),
        3 => control.mute(false),
        5 => control.pause(true),
        7 => control.pause(false),
        9 => control.volume(0.3),
        11 => control.volume(1.0),
        _ => Ok(()),
    });
    println!("start and stop {start:.3}, wind {seek:.3}, level {gain:.3}, hide {hide:.3}, all {whole:.3}");
    assert!([start, seek, gain, hide, whole].iter().all(|rough| *rough < 2.0), "a rise of 1.3 ms has its own bend");
    assert!([gain, hide, whole].iter().all(|rough| *rough < SMOOTH));
}

#[test]
fn walking_from_room_to_room_does_not_click() {
    let room = |name, x: f32| Room::with_walls(name, Vec3::new(x, -1.0, -6.0), Vec3::new(x + 8.0, 6.0, 6.0), Walls::Stone);
    let rooms = [room("pronaos", -8.0), room("cella", 0.0)];
    let walk = roughness_in(&rooms, at(Vec3::new(3.0, 1.0, -2.0)), |t, control, _| {
        control.listener(Vec3::new(-6.0 + 6.0 * t as f32, 1.7, 0.0), Quat::IDENTITY)
    });
    let carried = roughness_in(&rooms, at(Vec3::new(3.0, 1.0, -2.0)), |t, control, id| {
        control.place(id, Vec3::new(4.0 - 4.0 * t as f32, 1.0, -2.0))
    });
    let changed = roughness_in(&rooms, at(Vec3::new(3.0, 1.0, -2.0)), |t, control, _| {
        if (t * 60.0).round() as u32 % 30 == 5 { control.rooms(if t < 1.0 { &rooms[..1] } else { &rooms[..] }) } else { Ok(()) }
    });
    println!("walk {walk:.3}, carried {carried:.3}, other rooms {changed:.3}");
    assert!(walk < SMOOTH && carried < SMOOTH && changed < SMOOTH);
}

#[test]
fn voices_that_change_hands_do_not_click() {
    let settings = MixerSettings { voices: 6, ..MixerSettings::default() };
    let mut offline = OffLine::new(&settings);
    let clip = tone();
    for k in 0..80_i16 {
        let place = Vec3::new(f32::from(k % 10) * 4.0, 0.0, f32::from(k / 10) * -4.0);
        offline.control.add(Content::Clip(Arc::clone(&clip)), &SourceSettings { gain: 0.3, ..at(place) }).unwrap();
    }
    offline.advance(0.5);
    offline.take();
    offline
        .script(4.0, 1.0 / 60.0, |t, control| control.listener(Vec3::new(t as f32 * 9.0, 1.0, t as f32 * -7.0), Quat::IDENTITY))
        .unwrap();
    let w = (TAU * HZ / f64::from(RATE_HZ)) as f32;
    let samples = offline.ear(0);
    let loudest = samples.iter().fold(0.0_f32, |a, b| a.max(b.abs()));
    let rough = bend(&samples) / (w * w * loudest);
    println!("voices {rough:.3}");
    assert!(rough < SMOOTH, "{rough}");
    assert_eq!(offline.control.statistics().sources, 80);
    assert!(offline.control.statistics().voices <= 6);
}

#[test]
fn ambience_follows_its_hour_without_a_click() {
    let mut offline = OffLine::new(&MixerSettings::default());
    let day = heliodon_sound::DayCurve::new(&[(6.0, 0.0), (9.0, 1.0), (18.0, 1.0), (20.0, 0.0)]).unwrap();
    offline.control.hour(12.0).unwrap();
    offline.control.add_bed(Content::Clip(tone()), day, 1.0, true).unwrap();
    let level = |offline: &mut OffLine| {
        offline.take();
        offline.advance(0.2);
        offline.samples().iter().fold(0.0_f32, |a, b| a.max(b.abs()))
    };
    offline.advance(8.0);
    assert!((level(&mut offline) - 0.5).abs() < 0.01);
    offline.control.hour(2.0).unwrap();
    offline.take();
    offline.advance(12.0);
    let w = (TAU * HZ / f64::from(RATE_HZ)) as f32;
    assert!(bend(&offline.ear(0)) < 1.1 * w * w * 0.5);
    assert!(level(&mut offline) < 1e-3);
    // behind closed doors at noon
    let shut = Room { openness: 0.0, ..Room::with_walls("adyton", Vec3::splat(-4.0), Vec3::splat(4.0), Walls::Stone) };
    offline.control.hour(12.0).unwrap();
    offline.control.rooms(&[shut]).unwrap();
    offline.advance(12.0);
    assert!(level(&mut offline) < 1e-3);
}
