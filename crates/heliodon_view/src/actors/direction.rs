//! What somebody is told to do in place of their course and clip.

use glam::Affine3A;
use heliodon_mesh::motion::Clip;

/// What a story tells somebody.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Direction {
    /// From the model's space, in which +Z is forward, to the world; none leaves them on their course.
    pub world_from_model: Option<Affine3A>,
    /// They are not there.
    pub hidden: bool,
    /// What they perform.
    pub clip: Option<Performed>,
}

/// A clip that is performed.
#[derive(Clone, Debug, PartialEq)]
pub struct Performed {
    /// Its name.
    pub clip: String,
    /// When it began, seconds since the actors did.
    pub since_s: f64,
    /// Whether it begins again at its end; else its last picture stays.
    pub repeat: bool,
}

impl Performed {
    /// Which of the clips it is, and the time in it; none where there is no such clip.
    #[must_use]
    pub fn at(&self, clips: &[Clip], seconds: f32) -> Option<(usize, f32)> {
        let clip = clips.iter().position(|clip| clip.name == self.clip)?;
        Some((clip, within(clips[clip].duration_s, seconds - self.since_s as f32, self.repeat)))
    }
}

/// The time in a clip of a length.
#[must_use]
pub fn within(length_s: f32, passed_s: f32, repeat: bool) -> f32 {
    match (length_s > 0.0, repeat) {
        (false, _) => 0.0,
        (true, true) => passed_s.rem_euclid(length_s),
        // a hair before its end, which is the next one's beginning
        (true, false) => passed_s.clamp(0.0, length_s * (1.0 - 1e-4)),
    }
}

#[cfg(test)]
mod tests {
    use super::within;

    #[test]
    fn a_clip_begins_again_or_stays_at_its_end() {
        assert_eq!(within(2.0, 5.0, true), 1.0);
        assert!((within(2.0, 5.0, false) - 2.0).abs() < 1e-3 && within(2.0, 5.0, false) < 2.0);
        assert_eq!(within(2.0, -1.0, false), 0.0);
        assert_eq!(within(0.0, 5.0, true), 0.0);
    }
}
