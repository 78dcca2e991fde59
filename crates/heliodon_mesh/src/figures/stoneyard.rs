//! x
/// x
pub fn stoneyard() {}
