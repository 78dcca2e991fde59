//! A log of packets, sent again in its time: a tracker for whoever has none.

use super::PacketLog;
use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::ops::RangeInclusive;
use std::time::{Duration, Instant};
use thiserror::Error;

/// How many times as fast as it was a log may be sent.
const SPEED: RangeInclusive<f64> = 0.001..=1e6;

/// Why a log was not sent to its end.
#[derive(Debug, Error)]
pub enum SendError {
    /// The speed is none.
    #[error("the speed is {speed}; give a number from 0.001 to 1000000, 1 as it was")]
    Speed {
        /// What was given.
        speed: String,
    },
    /// The network refuses.
    #[error("packet {number} cannot be sent to {to}: {source}; check the address and the network")]
    Network {
        /// Where it should have gone.
        to: SocketAddr,
        /// Which packet, from 0.
        number: usize,
        /// Why.
        source: io::Error,
    },
}

/// Sends the packets of a log over UDP, each when it is due, `speed` times as fast as they were logged, the first at once.
/// Returns when the last has left; answers how many there were. What is late is sent at once, never left out.
///
/// # Errors
///
/// Where the speed is not from 0.001 to a million, or the network refuses a packet.
pub fn send(log: &PacketLog, to: SocketAddr, speed: f64) -> Result<usize, SendError> {
    if !SPEED.contains(&speed) {
        return Err(SendError::Speed { speed: speed.to_string() });
    }
    let here = SocketAddr::from(match to {
        SocketAddr::V4(_) => (std::net::IpAddr::from(Ipv4Addr::UNSPECIFIED), 0),
        SocketAddr::V6(_) => (Ipv6Addr::UNSPECIFIED.into(), 0),
    });
    let socket = UdpSocket::bind(here).map_err(|source| SendError::Network { to, number: 0, source })?;
    let start = Instant::now();
    let first_s = log.packets().first().map_or(0.0, |first| first.seconds);
    for (number, logged) in log.packets().iter().enumerate() {
        let due = Duration::from_secs_f64((logged.seconds - first_s) / speed);
        std::thread::sleep(due.saturating_sub(start.elapsed()));
        let sent = socket.send_to(&logged.packet, to);
        sent.map_err(|source| SendError::Network { to, number, source })?;
    }
    Ok(log.packets().len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::receiver::{Receiver, ReceiverSettings};

    #[test]
    fn packets_leave_when_they_are_due() {
        let mut receiver = Receiver::bind(&ReceiverSettings::default()).unwrap();
        let mut log = PacketLog::default();
        assert!((0..5_u8).all(|i| log.push(100.0 + f64::from(i), [i])));
        let start = Instant::now();
        assert_eq!(send(&log, receiver.address(), 50.0).unwrap(), 5);
        assert!(start.elapsed() >= Duration::from_millis(80));
        let mut arrivals = Vec::new();
        while arrivals.len() < 5 && start.elapsed() < Duration::from_secs(10) {
            receiver.drain(&mut arrivals);
        }
        assert!(arrivals.iter().map(|arrival| arrival.packet[0]).eq(0..5));
        for (i, arrival) in arrivals.iter().enumerate() {
            assert!(arrival.seconds_after(start) >= 0.02 * i as f64);
        }
    }

    #[test]
    fn a_speed_that_is_none_is_refused() {
        for speed in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = send(&PacketLog::default(), SocketAddr::from(([127, 0, 0, 1], 9)), speed).unwrap_err();
            assert!(error.to_string().contains("1 as it was"), "{error}");
        }
    }
}
