//! A recording of poses, played by time.

use super::{PoseRecording, Sample};
use crate::report::{Buttons, Report, Sight};

/// Answers where the bodies of a recording are at any time.
#[derive(Clone, Debug)]
pub struct Player {
    /// The samples of each body, in the order of their times.
    bodies: Vec<Vec<Sample>>,
    first_s: f64,
    duration_s: f64,
    repeat: bool,
}

impl Player {
    /// A player that starts at the recording's first sample and, with `repeat`, begins again after its last; else it holds that
    /// one.
    #[must_use]
    pub fn new(recording: &PoseRecording, repeat: bool) -> Self {
        let samples = recording.samples();
        let bodies = samples.iter().map(|sample| sample.body + 1).max().unwrap_or(0);
        let of = |body: usize| samples.iter().filter(|sample| sample.body == body).copied().collect();
        let first_s = samples.first().map_or(0.0, |first| first.seconds);
        let duration_s = samples.last().map_or(0.0, |last| last.seconds - first_s);
        Self { bodies: (0..bodies).map(of).collect(), first_s, duration_s, repeat }
    }

    /// From the first sample to the last, seconds from 0 up.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// A body `seconds` after the start: between two samples on the way from one to the other, with the buttons of the earlier;
    /// lost from a sample that says so to the next; nothing before its first sample and for a body that the recording does not
    /// have.
    #[must_use]
    pub fn sample(&self, body: usize, seconds: f64) -> Option<Sample> {
        let samples = self.bodies.get(body)?;
        // a question at no time is one about the start
        let seconds = if seconds > 0.0 { seconds } else { 0.0 };
        let played_s = if self.repeat && self.duration_s > 0.0 {
            seconds.min(f64::MAX).rem_euclid(self.duration_s)
        } else {
            seconds.min(self.duration_s)
        };
        let now_s = self.first_s + played_s;
        let after = samples.partition_point(|sample| sample.seconds <= now_s);
        let before = *samples.get(after.checked_sub(1)?)?;
        let pose = match (before.pose, samples.get(after)) {
            (Some(from), Some(Sample { pose: Some(to), seconds, .. })) => {
                let part = (now_s - before.seconds) / (seconds - before.seconds);
                Some(from.interpolate(to, part as f32))
            }
            (pose, _) => pose,
        };
        Some(Sample { seconds: now_s, pose, ..before })
    }

    /// Appends a report of each body that is there `seconds` after the start, as if it had arrived at `arrival_s`.
    pub fn reports(&self, seconds: f64, arrival_s: f64, into: &mut Vec<Report>) {
        for body in 0..self.bodies.len() {
            let Some(sample) = self.sample(body, seconds) else { continue };
            let sight = sample.pose.map_or(Sight::Lost, Sight::Pose);
            let buttons = sample.buttons.map(Buttons::all);
            into.push(Report { buttons, ..Report::of(body, arrival_s).with_sight(sight) });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn player(repeat: bool) -> Player {
        let text = "10 0 0 0 0 0 0 0 1 1\n11 2 5 0 0 0 0 0 1\n12 0 2 0 0 0 1 0 0 2\n13 0 lost\n14 0 4 0 0 0 0 0 1\n";
        Player::new(&PoseRecording::parse(text).unwrap(), repeat)
    }

    fn x(player: &Player, seconds: f64) -> Option<f32> {
        Some(player.sample(0, seconds)?.pose?.position.x)
    }

    #[test]
    fn bodies_go_evenly_from_sample_to_sample() {
        let player = player(false);
        assert_eq!(player.duration_s(), 4.0);
        let places = [0.0, 0.5, 1.0, 2.0, 2.9, 3.0, 3.9, 4.0, 1e9].map(|at| x(&player, at));
        let held = Some(4.0);
        assert_eq!(places, [Some(0.0), Some(0.5), Some(1.0), Some(2.0), Some(2.0), None, None, held, held]);
        let halfway = player.sample(0, 1.0).unwrap();
        let forwards = halfway.pose.unwrap().orientation * glam::Vec3::NEG_Z;
        assert!((forwards - glam::Vec3::NEG_X).length() < 1e-6, "a quarter of a turn");
        assert_eq!((halfway.buttons, player.sample(0, 2.0).unwrap().buttons), (Some(1), Some(2)));
    }

    #[test]
    fn a_repeated_recording_begins_again() {
        let player = player(true);
        assert_eq!([0.5, 4.5, 8.5, 4000.5].map(|at| x(&player, at)), [Some(0.5); 4]);
        for at in [f64::NAN, f64::INFINITY, -1.0, 1e300] {
            assert!(player.sample(0, at).is_some());
        }
    }

    #[test]
    fn only_who_is_there_is_reported() {
        let player = player(false);
        let bodies = |seconds| {
            let mut reports = Vec::new();
            player.reports(seconds, 100.0, &mut reports);
            reports.iter().map(|report| (report.body, report.sight == Sight::Lost)).collect::<Vec<_>>()
        };
        assert_eq!((bodies(0.5), bodies(1.5)), (vec![(0, false)], vec![(0, false), (2, false)]));
        assert_eq!(bodies(3.5), [(0, true), (2, false)]);
        assert_eq!(player.sample(1, 1.0), None);
        assert_eq!(Player::new(&PoseRecording::default(), true).sample(0, 0.0), None);
    }
}
