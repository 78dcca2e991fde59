//! What a follower counts.

use crate::report::Malformed;

/// What has been heard since the follower was made. Counters only rise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Packets, whatever was in them.
    pub packets: u64,
    /// Packets that were dropped because something in them is not as it should be.
    pub malformed: u64,
    /// Why the last of them was.
    pub last_malformed: Option<Malformed>,
    /// Messages and targets that belong to no body of the settings.
    pub ignored: u64,
    /// Reports with numbers that cannot be: not finite, a quaternion of zeros, beyond a kilometre.
    pub invalid: u64,
    /// Reports of jumps that were refused; of a jump that is confirmed in the end, those before.
    pub refused_jumps: u64,
    /// Packets and reports that came after later ones.
    pub overtaken: u64,
    /// How long ago the last report that is used arrived, when the statistics were asked for, seconds from 0 up; none: there
    /// was none.
    pub latency_s: Option<f64>,
}
