//! The one clock of a film: its sound's where it is heard, else time itself.

/// How long sound may stand still before the film goes on without it, seconds: devices take a while to open, and longer than this nobody waits.
const PATIENCE_S: f64 = 1.0;

/// Which second of a film it is. It never steps back but where it is set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FilmClock {
    seconds: f64,
    heard_s: f64,
    still_s: f64,
    lost: bool,
}

impl FilmClock {
    /// A film that begins at a second of it.
    #[must_use]
    pub fn at(seconds: f64) -> Self {
        Self { seconds, heard_s: seconds, ..Self::default() }
    }

    /// The second that is shown and heard.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Whether the sound was given up, because it stood still.
    #[must_use]
    pub fn lost_sound(&self) -> bool {
        self.lost
    }

    /// So much time passes; `heard_s` is the second of the sound that is heard now, where there is any.
    pub fn pass(&mut self, passed_s: f64, heard_s: Option<f64>) {
        let Some(heard_s) = heard_s.filter(|_| !self.lost) else {
            self.seconds += passed_s.max(0.0);
            return;
        };
        if heard_s > self.heard_s {
            (self.heard_s, self.still_s) = (heard_s, 0.0);
        } else {
            self.still_s += passed_s;
            self.lost = self.still_s > PATIENCE_S;
        }
        self.seconds = self.seconds.max(heard_s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_follow_the_sound_that_is_heard() {
        let mut clock = FilmClock::at(0.0);
        // the device is still opening
        (0..10).for_each(|_| clock.pass(0.016, Some(0.0)));
        assert_eq!(clock.seconds(), 0.0);
        clock.pass(0.016, Some(0.2));
        assert_eq!(clock.seconds(), 0.2);
        // clocks of sound cards step back a little; pictures do not
        clock.pass(0.016, Some(0.19));
        assert_eq!(clock.seconds(), 0.2);
        // after the sound's end time goes on
        clock.pass(0.1, None);
        assert!((clock.seconds() - 0.3).abs() < 1e-12 && !clock.lost_sound());
    }

    #[test]
    fn a_sound_that_stands_still_stops_no_film() {
        let mut clock = FilmClock::at(0.0);
        clock.pass(0.1, Some(0.5));
        (0..12).for_each(|_| clock.pass(0.1, Some(0.5)));
        assert!(clock.lost_sound());
        let at = clock.seconds();
        clock.pass(0.1, Some(0.5));
        assert!((clock.seconds() - at - 0.1).abs() < 1e-12);
    }
}
