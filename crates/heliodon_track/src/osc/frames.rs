//! The frames of a packet: a message, or bundles of messages and bundles.

use super::wrong;
use crate::report::Malformed;

/// Bundles inside bundles: senders nest one or two.
pub const MAX_DEPTH: usize = 8;

/// Messages and bundles of one packet: 64 bodies with 16 messages each.
pub const MAX_ELEMENTS: usize = 1024;

/// Gives each message's place in the packet to `each`, and stops at the first thing that is wrong.
pub(super) fn messages(packet: &[u8], mut each: impl FnMut(usize, usize) -> Result<(), Malformed>) -> Result<(), Malformed> {
    Walk { packet, elements: 0, each: &mut each }.element(0, packet.len(), 0)
}

/// The address that a message begins with; it begins at `at` in its packet.
pub(super) fn address(message: &[u8], at: usize) -> Result<&[u8], Malformed> {
    let Some(address) = message.split(|byte| *byte == 0).next().filter(|address| address.len() < message.len()) else {
        return wrong(at, "an address does not end");
    };
    if address.first() != Some(&b'/') {
        return wrong(at, "an address does not begin with /");
    }
    Ok(address)
}

struct Walk<'a, F> {
    packet: &'a [u8],
    elements: usize,
    each: &'a mut F,
}

impl<F: FnMut(usize, usize) -> Result<(), Malformed>> Walk<'_, F> {
    /// Reads the message or bundle from `at` up to `end`.
    fn element(&mut self, at: usize, end: usize, depth: usize) -> Result<(), Malformed> {
        self.elements += 1;
        if self.elements > MAX_ELEMENTS {
            return wrong(at, "more messages than a packet may have");
        }
        if at == end || !(end - at).is_multiple_of(4) {
            return wrong(at, "the length is not a multiple of four above 0");
        }
        if !self.packet[at..end].starts_with(b"#bundle\0") {
            return (self.each)(at, end);
        }
        if depth == MAX_DEPTH {
            return wrong(at, "bundles are nested too deep");
        }
        // the name and the time tag have eight bytes each
        let mut at = at + 16;
        if at > end {
            return wrong(end, "a bundle without a time tag");
        }
        while at < end {
            // whatever is left is a multiple of four
            let length = self.packet[at..at + 4].iter().fold(0, |length, byte| (length << 8) | usize::from(*byte));
            at += 4;
            if length > end - at {
                return wrong(at - 4, "an element of a bundle is longer than the bundle");
            }
            self.element(at, at + length, depth + 1)?;
            at += length;
        }
        Ok(())
    }
}
