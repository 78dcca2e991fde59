//! The whole way: a log is sent over the network, received, followed.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::Vec3;
use heliodon_track::filter::FilterSettings;
use heliodon_track::follow::{Follower, Protocol, State};
use heliodon_track::pose::Pose;
use heliodon_track::receiver::{Receiver, ReceiverSettings};
use heliodon_track::recording::{PacketLog, send};
use heliodon_track::settings::{Body, DtrackTarget, Settings};
use heliodon_track::{dtrack, osc, rotation};
use std::time::{Duration, Instant};

const RATE_HZ: f64 = 120.0;
const FRAMES: u32 = 180;

/// A visitor who walks to and fro and looks about.
fn script(t: f64) -> Pose {
    let (sine, cosine) = (libm::sin(t * 2.0) as f32, libm::cos(t * 2.0) as f32);
    let position = Vec3::new(0.4 * sine, 1.7 + 0.02 * cosine, -0.3 * cosine);
    Pose { position, orientation: rotation::from_vector(Vec3::new(0.1 * cosine, 0.8 * sine, 0.0)) }
}

/// Sends the script in its time, follows it as it comes, and answers how late each packet was, sorted.
fn followed(protocol: Protocol, packet: impl Fn(u32, &Pose) -> Vec<u8>) -> Vec<f64> {
    let body = Body { dtrack: Some(DtrackTarget::Body(0)), ..Body::osc("head", "/heliodon/head") };
    let settings = Settings { bodies: vec![body], filter: FilterSettings::unfiltered(), ..Settings::default() };
    let mut follower = Follower::new(settings).unwrap();
    let mut receiver = Receiver::bind(&ReceiverSettings::default()).unwrap();
    let mut log = PacketLog::default();
    for frame in 0..FRAMES {
        let t = f64::from(frame) / RATE_HZ;
        assert!(log.push(t, packet(frame, &script(t))));
    }
    // by way of the text, as from a file
    let log = PacketLog::parse(&log.to_text()).unwrap();
    let (start, to) = (Instant::now(), receiver.address());
    let mut late = Vec::new();
    std::thread::scope(|scope| {
        let sender = scope.spawn(|| send(&log, to, 1.0));
        let mut arrivals = Vec::new();
        while late.len() < FRAMES as usize && start.elapsed() < Duration::from_secs(20) {
            receiver.drain(&mut arrivals);
            for arrival in arrivals.drain(..) {
                let arrival_s = arrival.seconds_after(start);
                follower.packet(protocol, &arrival.packet, arrival_s).unwrap();
                let t = late.len() as f64 / RATE_HZ;
                let (seen, truth) = (follower.pose(0, arrival_s).unwrap(), script(t));
                assert!((seen.position - truth.position).length() < 0.001, "{t} s: {seen:?}");
                let turned = seen.orientation * truth.orientation.conjugate();
                assert!(rotation::to_vector(turned).length() < 0.001, "{t} s: {seen:?}");
                assert_eq!(follower.state(0, arrival_s), State::Tracked);
                late.push(arrival_s - t);
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        assert_eq!(sender.join().unwrap().unwrap(), FRAMES as usize);
    });
    assert_eq!(late.len(), FRAMES as usize, "loopback loses nothing of so little");
    let statistics = follower.statistics(start.elapsed().as_secs_f64());
    assert_eq!((statistics.packets, statistics.malformed, statistics.refused_jumps), (u64::from(FRAMES), 0, 0));
    late.sort_by(f64::total_cmp);
    late
}

#[test]
fn a_head_is_followed_to_a_millimetre() {
    let by_osc = followed(Protocol::Osc, |_, pose| osc::pose_packet("/heliodon/head", pose));
    let by_dtrack = followed(Protocol::Dtrack, |frame, pose| dtrack::packet(frame, &[(0, Some(*pose))], &[]).into_bytes());
    for late in [by_osc, by_dtrack] {
        // half a millisecond on a machine at rest; generous, for this one may have other things to do
        let median = late[late.len() / 2];
        assert!(late[0] >= 0.0 && median < 0.05, "the median packet was {median} s late");
    }
}
