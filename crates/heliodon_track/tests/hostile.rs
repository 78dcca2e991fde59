//! Packets that no tracker sends: nothing panics, no pose is other than finite, no memory grows.
//!
//! 200,000 packets in the ordinary test; `HELIODON_PACKETS=10000000 cargo test -p heliodon_track --test hostile` for a longer
//! night.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::{Quat, Vec3};
use heliodon_math::random::Pcg32;
use heliodon_track::follow::{Follower, Protocol};
use heliodon_track::pose::{FARTHEST_M, Pose};
use heliodon_track::settings::{Body, DtrackTarget, Settings};
use heliodon_track::{dtrack, osc, rotation};

const BODIES: usize = 3;

fn packets() -> u32 {
    std::env::var("HELIODON_PACKETS").ok().and_then(|count| count.parse().ok()).unwrap_or(200_000)
}

fn settings() -> Settings {
    let osc_and_dtrack = |name: &str, target| Body { dtrack: Some(target), ..Body::osc(name, format!("/heliodon/{name}")) };
    let offset = Pose { position: Vec3::new(0.02, -0.1, 0.08), orientation: Quat::from_xyzw(0.0, 0.6, 0.0, 0.8) };
    let bodies = vec![
        Body { target_from_body: offset, ..osc_and_dtrack("head", DtrackTarget::Body(0)) },
        osc_and_dtrack("hand", DtrackTarget::Body(1)),
        osc_and_dtrack("wand", DtrackTarget::Flystick(0)),
    ];
    Settings { bodies, ..Settings::default() }
}

fn below(rng: &mut Pcg32, count: usize) -> usize {
    rng.next_u32() as usize % count.max(1)
}

/// A number that may be any, strange ones more often than their share.
fn number(rng: &mut Pcg32) -> f32 {
    match rng.next_u32() % 8 {
        0 => f32::from_bits(rng.next_u32()),
        1 => [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN_POSITIVE, -0.0][below(rng, 6)],
        _ => rng.range_f32(-2.0, 2.0),
    }
}

/// A pose such as trackers tell, or any numbers at all.
fn pose(rng: &mut Pcg32) -> Pose {
    if !rng.next_u32().is_multiple_of(4) {
        let mut vector = || Vec3::from_array(std::array::from_fn(|_| rng.range_f32(-1.5, 1.5)));
        return Pose { position: vector(), orientation: rotation::from_vector(vector()) };
    }
    let mut numbers = || number(rng);
    let position = Vec3::new(numbers(), numbers(), numbers());
    Pose { position, orientation: Quat::from_xyzw(numbers(), numbers(), numbers(), numbers()) }
}

/// A packet that a tracker could have sent but for its numbers.
fn sound(rng: &mut Pcg32, protocol: Protocol) -> Vec<u8> {
    let address = ["/heliodon/head", "/heliodon/hand", "/heliodon/wand", "/elsewhere"][below(rng, 4)];
    match (protocol, rng.next_u32() % 5) {
        (Protocol::Osc, 0) => osc::button_packet(address, rng.next_u32() % 40, rng.next_u32().is_multiple_of(2)),
        (Protocol::Osc, 1) => osc::axis_packet(address, below(rng, 10), number(rng)),
        (Protocol::Osc, 2) => osc::lost_packet(address),
        (Protocol::Osc, 3) => {
            // a bundle of bundles of messages
            let mut packet = osc::pose_packet(address, &pose(rng));
            for _ in 0..rng.next_u32() % 12 {
                let length = packet.len() as u32;
                packet = [b"#bundle\0\0\0\0\0\0\0\0\x01", &length.to_be_bytes()[..], &packet].concat();
            }
            packet
        }
        (Protocol::Osc, _) => osc::pose_packet(address, &pose(rng)),
        (Protocol::Dtrack, seen) => {
            let body = |rng: &mut Pcg32| (rng.next_u32() % 4, (!rng.next_u32().is_multiple_of(4)).then(|| pose(rng)));
            let bodies = [body(rng), body(rng)];
            let axes = (0..below(rng, 12)).map(|_| rng.range_f32(-1.0, 1.0)).collect();
            let stick = dtrack::FlystickState { pose: (seen > 0).then(|| pose(rng)), buttons: rng.next_u32() as u8, axes };
            dtrack::packet(rng.next_u32(), &bodies, &[stick]).into_bytes()
        }
    }
}

/// The same with a few bytes changed, put in, taken out, doubled or cut off.
fn mutated(rng: &mut Pcg32, mut packet: Vec<u8>) -> Vec<u8> {
    for _ in 0..rng.next_u32() % 4 {
        let at = below(rng, packet.len());
        match rng.next_u32() % 6 {
            0 => packet.truncate(at),
            1 => packet.insert(at.min(packet.len()), rng.next_u32() as u8),
            2 if !packet.is_empty() => drop(packet.remove(at)),
            3 if !packet.is_empty() => packet.extend_from_within(at..),
            4 if !packet.is_empty() => packet[at] = b" []-.,/\0\n09e#"[below(rng, 13)],
            _ if !packet.is_empty() => packet[at] ^= 1 << below(rng, 8),
            _ => {}
        }
    }
    packet
}

fn hostile(rng: &mut Pcg32, protocol: Protocol) -> Vec<u8> {
    match rng.next_u32() % 8 {
        0 => {
            let length = below(rng, 200);
            (0..length).map(|_| rng.next_u32() as u8).collect()
        }
        1 => sound(rng, protocol),
        _ => {
            let packet = sound(rng, protocol);
            mutated(rng, packet)
        }
    }
}

/// A clock that mostly goes on, at times leaps, stands, goes back, or is none.
fn next_s(rng: &mut Pcg32, now_s: f64) -> f64 {
    match rng.next_u32() % 500 {
        0 => now_s + 1000.0,
        1 => now_s - 0.5,
        2 => now_s - 5000.0,
        3 => f64::NAN,
        4 => f64::INFINITY,
        5..100 => now_s,
        _ => now_s + f64::from(rng.range_f32(0.0, 0.02)),
    }
}

fn check(follower: &Follower, now_s: f64) {
    for body in 0..BODIES {
        for asked_s in [now_s, now_s + 0.01, now_s - 1.0, now_s + 1e6, f64::NAN, f64::NEG_INFINITY] {
            if let Some(pose) = follower.pose(body, asked_s) {
                // at most the longest prediction at the highest speed beyond the kilometre
                assert!(pose.is_finite() && pose.position.abs().max_element() < FARTHEST_M + 10.0, "{pose:?}");
                assert!((pose.orientation.length() - 1.0).abs() < 1e-4, "{pose:?}");
            }
            let velocity = follower.velocity(body, asked_s);
            assert!(velocity.linear_m_s.is_finite() && velocity.angular_rad_s.is_finite());
            assert!(follower.axes(body, asked_s).iter().all(|axis| axis.is_finite()));
        }
    }
}

/// Pages of memory that the process has, where the system tells.
fn resident_pages() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/statm").ok()?;
    status.split_whitespace().nth(1)?.parse().ok()
}

fn survive(protocol: Protocol, seed: u64) {
    let mut rng = Pcg32::new(seed, 77);
    let mut follower = Follower::new(settings()).unwrap();
    let (mut now_s, count) = (0.0, packets() / 2);
    let (mut accepted, mut pages) = (0_u32, None);
    for i in 0..count {
        let packet = hostile(&mut rng, protocol);
        let arrival_s = next_s(&mut rng, now_s);
        now_s = if arrival_s.is_finite() { arrival_s } else { now_s };
        accepted += u32::from(follower.packet(protocol, &packet, arrival_s).is_ok());
        check(&follower, now_s);
        if i == count / 4 {
            pages = resident_pages();
        }
    }
    let statistics = follower.statistics(now_s);
    assert_eq!(statistics.packets, u64::from(count));
    assert_eq!(statistics.malformed, u64::from(count - accepted));
    assert!(statistics.malformed > 0 && statistics.invalid > 0 && statistics.ignored > 0, "{statistics:?}");
    assert!(accepted > count / 5, "the packets are too strange to test anything: {accepted} of {count}");
    if let (Some(before), Some(after)) = (pages, resident_pages()) {
        // pages have at least 4 KiB; the two tests of this file run side by side
        assert!(after.saturating_sub(before) < 4096, "{before} pages became {after}");
    }
}

#[test]
fn osc_of_any_kind_is_survived() {
    survive(Protocol::Osc, 1);
}

#[test]
fn dtrack_of_any_kind_is_survived() {
    survive(Protocol::Dtrack, 2);
}
