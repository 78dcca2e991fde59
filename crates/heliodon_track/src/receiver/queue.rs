//! Packets that wait to be drained, as many as are allowed.

use super::ReceiverSettings;
use std::collections::VecDeque;
use std::net::SocketAddr;
use std::time::Instant;

/// The longest packet that UDP carries, and a byte more.
pub(super) const BUFFER_BYTES: usize = 65_536;

/// A packet that has come.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Arrival {
    /// When.
    pub at: Instant,
    /// From where.
    pub from: SocketAddr,
    /// What, up to 65,507 bytes.
    pub packet: Vec<u8>,
}

impl Arrival {
    /// When it came, seconds after another moment; negative before it.
    #[must_use]
    pub fn seconds_after(&self, start: Instant) -> f64 {
        match self.at.checked_duration_since(start) {
            Some(after) => after.as_secs_f64(),
            None => -start.duration_since(self.at).as_secs_f64(),
        }
    }
}

/// The oldest first.
#[derive(Debug, Default)]
pub(super) struct Queue {
    arrivals: VecDeque<Arrival>,
    bytes: usize,
}

impl Queue {
    /// Takes everything out.
    pub(super) fn drain(&mut self, into: &mut Vec<Arrival>) {
        into.extend(self.arrivals.drain(..));
        self.bytes = 0;
    }

    /// Appends a packet, for which the oldest make room; answers how many.
    pub(super) fn push(&mut self, arrival: Arrival, limits: &ReceiverSettings) -> u64 {
        let mut dropped = 0;
        let (packets, bytes) = (limits.queue_packets.max(1), limits.queue_bytes.max(BUFFER_BYTES));
        self.bytes += arrival.packet.len();
        self.arrivals.push_back(arrival);
        while self.arrivals.len() > packets || self.bytes > bytes {
            let Some(oldest) = self.arrivals.pop_front() else { break };
            self.bytes -= oldest.packet.len();
            dropped += 1;
        }
        dropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::Ipv4Addr;

    #[test]
    fn a_flood_pushes_the_oldest_out() {
        let from = SocketAddr::new(Ipv4Addr::LOCALHOST.into(), 1);
        let arrival = |first: u8, length: usize| Arrival { at: Instant::now(), from, packet: vec![first; length] };
        let limits = ReceiverSettings { queue_packets: 10, queue_bytes: 100_000, ..ReceiverSettings::default() };
        let mut queue = Queue::default();
        let dropped: u64 = (0..100).map(|i| queue.push(arrival(i, 10), &limits)).sum();
        assert_eq!((dropped, queue.arrivals.len(), queue.bytes, queue.arrivals[0].packet[0]), (90, 10, 100, 90));
        assert_eq!(queue.push(arrival(200, 60_000), &limits), 1);
        assert_eq!(queue.push(arrival(201, 60_000), &limits), 10, "the bytes are too many");
        assert_eq!((queue.arrivals.len(), queue.bytes), (1, 60_000));
        let nothing = ReceiverSettings { queue_packets: 0, queue_bytes: 0, ..limits };
        assert_eq!((queue.push(arrival(202, 65_507), &nothing), queue.arrivals.len()), (1, 1), "one is always kept");
    }
}
