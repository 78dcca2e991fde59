//! Jumps: what no body does, until the tracker insists.

use glam::Vec3;

/// By how much reports may be nearer in arrival than they were in the tracker, seconds: networks and schedulers bunch them.
const JITTER_S: f64 = 0.01;

/// Reports that it takes at least to confirm a jump, however slow the tracker is.
const CONFIRMATIONS: u32 = 3;

/// What is said of a position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// A body may move so.
    Moved,
    /// It would have had to be faster than any: not to be used.
    Refused,
    /// So it was, but the tracker has kept saying so.
    Confirmed,
}

/// Watches the positions of one body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gate {
    /// The last position that was not refused.
    accepted: Vec3,
    /// When anything was heard last, refused or not.
    heard_s: f64,
    jump: Option<Jump>,
}

/// A place where the tracker says the body is now.
#[derive(Clone, Copy, Debug)]
struct Jump {
    position: Vec3,
    since_s: f64,
    reports: u32,
}

impl Gate {
    pub(super) fn new(position: Vec3, arrival_s: f64) -> Self {
        Self { accepted: position, heard_s: arrival_s, jump: None }
    }

    /// Judges the next position.
    pub(super) fn judge(&mut self, position: Vec3, arrival_s: f64, max_speed_m_s: f32, confirm_s: f32) -> Verdict {
        // since anything was heard, not since the last that was accepted: else whoever waits for a moment may go anywhere
        let reach_m = f64::from(max_speed_m_s) * ((arrival_s - self.heard_s).max(0.0) + JITTER_S);
        let within_reach = |from: Vec3| f64::from((position - from).length()) <= reach_m;
        self.heard_s = arrival_s;
        if within_reach(self.accepted) {
            (self.accepted, self.jump) = (position, None);
            return Verdict::Moved;
        }
        let jump = match self.jump {
            Some(jump) if within_reach(jump.position) => Jump { position, reports: jump.reports + 1, ..jump },
            _ => Jump { position, since_s: arrival_s, reports: 1 },
        };
        if jump.reports >= CONFIRMATIONS && arrival_s - jump.since_s >= f64::from(confirm_s) {
            (self.accepted, self.jump) = (position, None);
            return Verdict::Confirmed;
        }
        self.jump = Some(jump);
        Verdict::Refused
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a tracker of 100 Hz is told of positions along X.
    fn verdicts(positions: impl IntoIterator<Item = f32>) -> Vec<Verdict> {
        let mut gate = Gate::new(Vec3::ZERO, 0.0);
        let judged = |(i, x): (usize, f32)| gate.judge(Vec3::X * x, (i + 1) as f64 * 0.01, 15.0, 0.1);
        positions.into_iter().enumerate().map(judged).collect()
    }

    #[test]
    fn whoever_runs_is_followed() {
        let run = (1..100).map(|i| 0.14 * i as f32);
        assert!(verdicts(run).iter().all(|verdict| *verdict == Verdict::Moved));
    }

    #[test]
    fn a_glitch_is_refused_and_forgotten() {
        let glitch = verdicts([0.0, 2.0, 2.0, 2.0, 0.1, 2.0, 0.1]);
        let (moved, refused) = (Verdict::Moved, Verdict::Refused);
        assert_eq!(glitch, [moved, refused, refused, refused, moved, refused, moved]);
    }

    #[test]
    fn a_jump_is_taken_after_its_time_however_near() {
        for x in [0.4, 2.0, 900.0] {
            let jump = verdicts([x; 20]);
            let first = jump.iter().position(|verdict| *verdict != Verdict::Refused).unwrap();
            // heard first at 0.01 s, so confirmed at 0.11 s, give or take a rounding of the clock
            assert!((10..=11).contains(&first) && jump[first] == Verdict::Confirmed, "{x}: {first}");
            assert!(jump[first + 1..].iter().all(|verdict| *verdict == Verdict::Moved));
        }
    }

    #[test]
    fn noise_all_over_the_place_is_never_taken() {
        let noise = (0..200).map(|i| if i % 2 == 0 { 50.0 } else { -50.0 });
        assert!(verdicts(noise).iter().all(|verdict| *verdict == Verdict::Refused));
    }

    #[test]
    fn slow_trackers_need_three_reports_and_silence_lets_bodies_go_far() {
        let mut gate = Gate::new(Vec3::ZERO, 0.0);
        let verdicts = [10.2, 10.3, 10.4].map(|at| gate.judge(Vec3::X * 500.0, at, 15.0, 0.1));
        assert_eq!(verdicts, [Verdict::Refused, Verdict::Refused, Verdict::Confirmed]);
        assert_eq!(gate.judge(Vec3::ZERO, 60.0, 15.0, 0.1), Verdict::Moved);
    }
}
