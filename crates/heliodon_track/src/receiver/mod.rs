//! Packets from the network, received on a thread of their own, so that none is late because a frame was.
//!
//! The operating system queues some 200 KiB for a socket and drops the newest beyond it; here the **oldest** are dropped, for
//! what was true before is of no use to a tracker's follower. Why not Tokio or `mio`: one socket and one blocking call need
//! neither.

mod queue;

pub use queue::Arrival;

use queue::{BUFFER_BYTES, Queue};
use serde::{Deserialize, Serialize};
use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use thiserror::Error;

/// How long the thread listens before it looks whether it should stop: a quarter of what stopping may take.
const LISTEN: Duration = Duration::from_millis(50);

/// How long it waits after an error, so that one that stays does not keep a processor busy.
const AFTER_ERROR: Duration = Duration::from_millis(5);

/// Where to listen, and how much to keep.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReceiverSettings {
    /// The address of this machine at which to listen. 127.0.0.1, as it comes: this machine's own programs alone are heard.
    /// That of a network's interface: whoever is on that network is heard, and nothing asks who it is. 0.0.0.0: all of them.
    pub address: IpAddr,
    /// The port; 0, as it comes: any that is free, told by [`Receiver::address`].
    pub port: u16,
    /// Packets that are kept until they are drained, at least 1. Less: a long frame loses some. More: after a long pause there
    /// is more of yesterday to go through.
    pub queue_packets: usize,
    /// Bytes that they may have together, at least those of one packet. Less: a flood of long packets pushes good ones out
    /// sooner. More: memory.
    pub queue_bytes: usize,
}

impl Default for ReceiverSettings {
    fn default() -> Self {
        Self { address: Ipv4Addr::LOCALHOST.into(), port: 0, queue_packets: 1024, queue_bytes: 4 << 20 }
    }
}

impl ReceiverSettings {
    /// At a port of this machine, for its own programs.
    #[must_use]
    pub fn local(port: u16) -> Self {
        Self { port, ..Self::default() }
    }
}

/// What a receiver has done since it was made. Counters only rise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReceiverCounters {
    /// Packets that came.
    pub received: u64,
    /// Of these, those that were dropped because nobody drained the queue in time.
    pub dropped: u64,
    /// Errors of the network; it listens on.
    pub errors: u64,
}

/// Why nothing can be received.
#[derive(Debug, Error)]
pub enum ReceiverError {
    /// The address cannot be listened at.
    #[error("{address} (UDP) cannot be listened at: {source}; {remedy}")]
    Bind {
        /// Where.
        address: SocketAddr,
        /// Why.
        source: io::Error,
        /// What to do about it.
        remedy: &'static str,
    },
    /// The operating system gives no thread.
    #[error("no thread can be started to listen at {address} (UDP): {source}; end other programs")]
    Thread {
        /// Where.
        address: SocketAddr,
        /// Why.
        source: io::Error,
    },
}

/// Listens until it is dropped.
#[derive(Debug)]
pub struct Receiver {
    address: SocketAddr,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    queue: Mutex<Queue>,
    stop: AtomicBool,
    received: AtomicU64,
    dropped: AtomicU64,
    errors: AtomicU64,
}

impl Receiver {
    /// Begins to listen.
    ///
    /// # Errors
    ///
    /// Where the address cannot be listened at, such as a port that another program has.
    pub fn bind(settings: &ReceiverSettings) -> Result<Self, ReceiverError> {
        let wanted = SocketAddr::new(settings.address, settings.port);
        let refused = |source: io::Error| {
            let remedy = remedy(source.kind());
            ReceiverError::Bind { address: wanted, source, remedy }
        };
        let socket = UdpSocket::bind(wanted).map_err(refused)?;
        socket.set_read_timeout(Some(LISTEN)).map_err(refused)?;
        let address = socket.local_addr().map_err(refused)?;
        let shared = Arc::new(Shared::default());
        let (theirs, limits) = (Arc::clone(&shared), *settings);
        let thread = std::thread::Builder::new()
            .name(format!("tracker at {address}"))
            .spawn(move || theirs.listen(&socket, &limits))
            .map_err(|source| ReceiverError::Thread { address, source })?;
        Ok(Self { address, shared, thread: Some(thread) })
    }

    /// Where it listens, with the port that it was given.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Appends what has come since the last time, in its order. Never waits for the network.
    pub fn drain(&mut self, into: &mut Vec<Arrival>) {
        self.shared.queue().drain(into);
    }

    /// What it has done.
    #[must_use]
    pub fn counters(&self) -> ReceiverCounters {
        let Shared { received, dropped, errors, .. } = &*self.shared;
        ReceiverCounters {
            received: received.load(Ordering::Relaxed),
            dropped: dropped.load(Ordering::Relaxed),
            errors: errors.load(Ordering::Relaxed),
        }
    }
}

impl Drop for Receiver {
    /// Stops listening, within a fifth of a second.
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // had it panicked, that would have been told
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn listen(&self, socket: &UdpSocket, limits: &ReceiverSettings) {
        let mut buffer = vec![0; BUFFER_BYTES];
        while !self.stop.load(Ordering::Relaxed) {
            match socket.recv_from(&mut buffer) {
                Ok((length, from)) => {
                    let arrival = Arrival { at: Instant::now(), from, packet: buffer[..length].to_vec() };
                    let mut queue = self.queue();
                    // with the queue in hand: whoever sees it counted finds it there
                    self.received.fetch_add(1, Ordering::Relaxed);
                    let dropped = queue.push(arrival, limits);
                    drop(queue);
                    self.dropped.fetch_add(dropped, Ordering::Relaxed);
                }
                Err(error) => match error.kind() {
                    io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted => {}
                    _ => {
                        self.errors.fetch_add(1, Ordering::Relaxed);
                        std::thread::sleep(AFTER_ERROR);
                    }
                },
            }
        }
    }
}

fn remedy(kind: io::ErrorKind) -> &'static str {
    match kind {
        io::ErrorKind::AddrInUse => {
            "another program listens there: end it, perhaps a second viewer, or choose another port here and in the tracker"
        }
        io::ErrorKind::AddrNotAvailable => {
            "give an address of this machine: 127.0.0.1 for its own programs, 0.0.0.0 for all of its networks"
        }
        io::ErrorKind::PermissionDenied => "choose a port from 1024 up",
        _ => "check the address and the network",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Drains until there are as many as wanted, ten seconds at most.
    fn drained(receiver: &mut Receiver, wanted: usize) -> Vec<Arrival> {
        let (mut arrivals, start) = (Vec::new(), Instant::now());
        while arrivals.len() < wanted && start.elapsed() < Duration::from_secs(10) {
            receiver.drain(&mut arrivals);
            std::thread::sleep(Duration::from_millis(1));
        }
        arrivals
    }

    fn sender() -> UdpSocket {
        UdpSocket::bind("127.0.0.1:0").unwrap()
    }

    #[test]
    fn packets_come_in_their_order_and_whole() {
        let start = Instant::now();
        let mut receiver = Receiver::bind(&ReceiverSettings::default()).unwrap();
        assert!(receiver.address().ip().is_loopback() && receiver.address().port() != 0);
        let sender = sender();
        for length in [0, 1, 1500, 60_000] {
            sender.send_to(&vec![length as u8; length], receiver.address()).unwrap();
        }
        let arrivals = drained(&mut receiver, 4);
        assert_eq!(arrivals.iter().map(|arrival| arrival.packet.len()).collect::<Vec<_>>(), [0, 1, 1500, 60_000]);
        assert!(arrivals.iter().all(|arrival| arrival.from == sender.local_addr().unwrap()));
        assert!(arrivals.windows(2).all(|two| two[0].at <= two[1].at) && arrivals[0].seconds_after(start) > 0.0);
        assert!(arrivals[0].seconds_after(Instant::now()) < 0.0);
        assert_eq!(receiver.counters(), ReceiverCounters { received: 4, dropped: 0, errors: 0 });
    }

    #[test]
    fn a_port_in_use_is_told_with_a_remedy() {
        let receiver = Receiver::bind(&ReceiverSettings::default()).unwrap();
        let error = Receiver::bind(&ReceiverSettings::local(receiver.address().port())).unwrap_err().to_string();
        assert!(error.contains(&receiver.address().to_string()) && error.contains("choose another port"), "{error}");
        let elsewhere = ReceiverSettings { address: [203, 0, 113, 7].into(), ..ReceiverSettings::default() };
        let error = Receiver::bind(&elsewhere).unwrap_err().to_string();
        assert!(error.contains("203.0.113.7:0") && error.contains("127.0.0.1"), "{error}");
    }

    #[test]
    fn a_receiver_stops_at_once_when_it_is_dropped() {
        let stopping = || {
            let receiver = Receiver::bind(&ReceiverSettings::default()).unwrap();
            let (address, start) = (receiver.address(), Instant::now());
            drop(receiver);
            let took = start.elapsed();
            Receiver::bind(&ReceiverSettings::local(address.port())).unwrap();
            took
        };
        // the best of three, for the machine may have other things to do
        let best = (0..3).map(|_| stopping()).min().unwrap();
        assert!(best < Duration::from_millis(200), "{best:?}");
    }

    #[test]
    fn a_flood_from_the_network_stays_within_its_bounds() {
        let settings = ReceiverSettings { queue_packets: 16, ..ReceiverSettings::default() };
        let mut receiver = Receiver::bind(&settings).unwrap();
        let sender = sender();
        let (mut last, start) = (0_u32, Instant::now());
        // the operating system may drop some as well
        while receiver.counters().dropped < 1000 && start.elapsed() < Duration::from_secs(10) {
            last += 1;
            sender.send_to(&last.to_be_bytes(), receiver.address()).unwrap();
        }
        let counters = receiver.counters();
        assert!(counters.dropped >= 1000 && counters.received > counters.dropped);
        std::thread::sleep(Duration::from_millis(20));
        let arrivals = drained(&mut receiver, 16);
        let numbers: Vec<u32> = arrivals.iter().map(|a| u32::from_be_bytes(a.packet[..].try_into().unwrap())).collect();
        assert!(numbers.len() == 16 && numbers.windows(2).all(|two| two[0] < two[1]), "{numbers:?}");
    }
}
