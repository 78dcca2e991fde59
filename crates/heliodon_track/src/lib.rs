//! Where heads and hands are: what a VR room's trackers report becomes poses that a viewer asks for once a frame.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`receiver`] | UDP packets on a thread of their own, a bounded queue of them |
//! | [`osc`], [`dtrack`] | from packets to [reports](report::Report): Open Sound Control, A.R.T. DTrack2 and DTrack3 |
//! | [`settings`] | which bodies are followed, and how the tracker names them |
//! | [`calibration`] | from the tracker's coordinates to the room's, and how that is found from measured points |
//! | [`filter`] | smoothing, prediction, loss and return, jumps |
//! | [`follow`] | all of these behind one question: where is a body at a time |
//! | [`recording`] | poses and packets in files; played back, sent again |
//! | [`gesture`] | flicks of a free-floating mouse or a wand |
//! | [`pose`], [`report`], [`rotation`] | the words that they share |
//!
//! Spaces: right-handed, metres, **+Y up**, +X right, -Z ahead, of the room as of the world; a pose is `room_from_body`, and a
//! head looks along its -Z. Times are `f64` seconds of one clock of the caller's that does not go back. Nothing here reads a
//! clock but the [receiver](receiver::Arrival::at) and the [sender](fn@recording::send); nothing prints. Trigonometry is
//! [`libm`]'s: the same reports make the same poses on every machine.
//!
//! Whatever a packet holds, nothing panics, no pose is ever other than finite, and no memory grows: `tests/hostile.rs` holds
//! all three to 200,000 packets, or to as many as `HELIODON_PACKETS` says.
//!
//! # Example
//!
//! ```
//! use heliodon_track::follow::{Follower, Protocol, State};
//! use heliodon_track::pose::Pose;
//! use heliodon_track::receiver::{Receiver, ReceiverSettings};
//! use heliodon_track::settings::{Body, Settings};
//! use std::time::Instant;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let settings = Settings { bodies: vec![Body::osc("head", "/heliodon/head")], ..Settings::default() };
//! let mut follower = Follower::new(settings)?;
//! let mut receiver = Receiver::bind(&ReceiverSettings::default())?;
//! let start = Instant::now();
//!
//! // somewhere, a tracker
//! let tracker = std::net::UdpSocket::bind("127.0.0.1:0")?;
//! let standing = Pose { position: glam::Vec3::new(0.0, 1.7, 0.0), ..Pose::IDENTITY };
//! tracker.send_to(&heliodon_track::osc::pose_packet("/heliodon/head", &standing), receiver.address())?;
//!
//! // once a frame
//! let mut arrivals = Vec::new();
//! # while arrivals.is_empty() && start.elapsed().as_secs() < 10 {
//! receiver.drain(&mut arrivals);
//! # }
//! for arrival in arrivals.drain(..) {
//!     // a malformed packet is counted: see the statistics
//!     let _ = follower.packet(Protocol::Osc, &arrival.packet, arrival.seconds_after(start));
//! }
//! let now_s = start.elapsed().as_secs_f64();
//! let head = follower.pose(0, now_s).ok_or("nothing was heard")?;
//! assert!((head.position - standing.position).length() < 0.001);
//! assert!(follower.state(0, now_s) != State::Never && follower.statistics(now_s).malformed == 0);
//! # Ok(())
//! # }
//! ```
//!
//! # Why there is no VRPN
//!
//! VRPN, the Virtual-Reality Peripheral Network, is what many older rooms speak. Its protocol (a handshake over UDP, then TCP
//! with its own framing, types numbered anew by every connection) is that of one C++ library, and no kept Rust library speaks
//! it: neither `vrpn` nor `vrpn-rs` is on crates.io as of 2026-11-23. To bind the C++ library would bring a C++ toolchain and
//! `unsafe` into every build. Most trackers that VRPN servers are run for also send OSC or DTrack's datagrams themselves; where
//! one does not, a VRPN client of twenty lines that sends OSC joins it to us.

pub mod calibration;
pub mod dtrack;
pub mod filter;
pub mod follow;
pub mod gesture;
pub mod osc;
pub mod pose;
pub mod receiver;
pub mod recording;
pub mod report;
pub mod rotation;
pub mod settings;
