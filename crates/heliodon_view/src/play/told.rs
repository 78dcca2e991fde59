//! How a played visit went.

/// What frames took, milliseconds of the clock: the processor's work, and the GPU's where a picture waits for it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameTimes {
    /// How many there were.
    pub frames: usize,
    /// The mean.
    pub mean_ms: f32,
    /// Of twenty frames, nineteen take less.
    pub p95_ms: f32,
    /// The longest.
    pub most_ms: f32,
}

impl FrameTimes {
    /// Of frames that took so many milliseconds each.
    #[must_use]
    pub fn of(frames_ms: &[f32]) -> Self {
        let mut sorted = frames_ms.to_vec();
        sorted.sort_by(f32::total_cmp);
        let frames = sorted.len();
        let Some(&most_ms) = sorted.last() else { return Self::default() };
        let mean_ms = sorted.iter().sum::<f32>() / frames as f32;
        Self { frames, mean_ms, p95_ms: sorted[(frames * 95 / 100).min(frames - 1)], most_ms }
    }
}

/// How a visit went.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Played {
    /// Seconds of the visit.
    pub seconds: f64,
    /// The keys of the tasks that stood, with the second in which each was set.
    pub tasks: Vec<(String, f64)>,
    /// Lines of the script that were done.
    pub lines: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_frames_are_told_apart_from_the_mean() {
        assert_eq!(FrameTimes::of(&[]), FrameTimes::default());
        let mut times = [2.0; 100];
        (times[7], times[50]) = (52.0, 9.0);
        assert_eq!(FrameTimes::of(&times), FrameTimes { frames: 100, mean_ms: 2.57, p95_ms: 2.0, most_ms: 52.0 });
        assert_eq!(FrameTimes::of(&[3.0]), FrameTimes { frames: 1, mean_ms: 3.0, p95_ms: 3.0, most_ms: 3.0 });
    }
}
