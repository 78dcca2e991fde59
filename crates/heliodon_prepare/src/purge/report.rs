//! What a purge did.

use crate::purge::verify::Verified;
use serde::{Deserialize, Serialize};
use std::fmt;

/// What a purge did.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct PurgeReport {
    /// Triangles of the model.
    pub triangles: u64,
    /// Triangles that are kept.
    pub kept: u64,
    /// Of those kept, how many were seen; the others are the ring around them.
    pub seen: u64,
    /// Dropped because all eyes are behind them and see no backs there: exact.
    pub facing_away: u64,
    /// Dropped because they lie beside all that is seen through windows: exact. (Only where every room has windows.)
    pub outside_windows: u64,
    /// Dropped because no picture and no ray showed them.
    pub occluded: u64,
    /// Of each room, in their order.
    pub rooms: Vec<RoomReport>,
    /// How often the result was checked; what all checks but the last found missing was put back.
    pub checks: u32,
    /// Whether the last check of every room found no more wrong pixels than allowed.
    pub passed: bool,
}

/// What a purge did for one room.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct RoomReport {
    /// Eye points that item buffers were drawn from.
    pub eyes: u64,
    /// The part of all eye points that lie inside stone, and were left out: more than 0 means that the room's box reaches into a wall.
    pub in_stone: f64,
    /// Pixels of item buffers that show something.
    pub pixels: u64,
    /// The part of the pixels of the last buffers that showed what none had shown before.
    pub fresh_share: f64,
    /// Rays aimed at faces that no item buffer showed.
    pub rays: u64,
    /// Triangles that item buffers showed.
    pub seen: u64,
    /// Triangles that only rays found.
    pub found_by_rays: u64,
    /// The last check.
    pub verified: Verified,
}

impl RoomReport {
    /// Whether nobody in the room sees anything: its box lies in stone, or its windows look at nothing.
    #[must_use]
    pub fn is_blind(&self) -> bool {
        self.seen + self.found_by_rays == 0
    }
}

impl fmt::Display for PurgeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { triangles, kept, seen, facing_away, outside_windows, occluded, .. } = self;
        write!(f, "purge: {kept} of {triangles} triangles kept, {seen} of them seen and the others beside these; dropped")?;
        write!(f, " {facing_away} that turn away, {outside_windows} beside all windows, {occluded} hidden")?;
        for (room, report) in self.rooms.iter().enumerate() {
            let Verified { frames, pixels, wrong, .. } = &report.verified;
            write!(
                f,
                "\n  room {}: {} eyes, {} rays; of {pixels} pixels of {frames} random frames {wrong} wrong",
                room + 1,
                report.eyes,
                report.rays
            )?;
            if report.in_stone > 0.0 {
                write!(f, "; {:.0} % of its box lies in stone", 100.0 * report.in_stone)?;
            }
            if report.is_blind() {
                write!(f, "; nobody in it sees anything")?;
            }
        }
        Ok(())
    }
}
