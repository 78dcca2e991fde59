//! Frames a second as a fraction.

/// Frames a second, exactly: 30000/1001 is the 29.97 of television.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rate {
    /// Frames in `denominator` seconds; at least 1.
    pub numerator: u32,
    /// Seconds; at least 1.
    pub denominator: u32,
}

/// The slowest rate that a film is taken to have, frames a second; slower ones are told at this.
const SLOWEST: f64 = 0.5;
/// The fastest rate that pictures are delivered at, frames a second.
const FASTEST: f64 = 240.0;

impl Rate {
    /// Of films that do not say: PAL's.
    pub const ASSUMED: Self = Self { numerator: 25, denominator: 1 };

    /// The rates that cameras have.
    const STANDARD: [Self; 11] = [
        Self { numerator: 24_000, denominator: 1001 },
        Self { numerator: 24, denominator: 1 },
        Self { numerator: 25, denominator: 1 },
        Self { numerator: 30_000, denominator: 1001 },
        Self { numerator: 30, denominator: 1 },
        Self { numerator: 48, denominator: 1 },
        Self { numerator: 50, denominator: 1 },
        Self { numerator: 60_000, denominator: 1001 },
        Self { numerator: 60, denominator: 1 },
        Self { numerator: 15, denominator: 1 },
        Self { numerator: 12, denominator: 1 },
    ];

    /// The camera's rate nearest to `per_second` where one lies within 1 %, or `per_second` to a thousandth. Held in [0.5, 240].
    #[must_use]
    pub fn nearest(per_second: f64) -> Self {
        let held = if per_second.is_finite() { per_second.clamp(SLOWEST, FASTEST) } else { Self::ASSUMED.per_second() };
        let distance = |rate: &Self| (rate.per_second() / held - 1.0).abs();
        let nearest = Self::STANDARD.into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        match nearest {
            Some(rate) if distance(&rate) < 0.01 => rate,
            _ => Self { numerator: (held * 1000.0).round() as u32, denominator: 1000 },
        }
    }

    /// A fraction as `ffprobe` writes it; `None` for 0/0 and whatever else is no rate.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let (numerator, denominator) = text.split_once('/')?;
        let rate = Self { numerator: numerator.parse().ok()?, denominator: denominator.parse().ok()? };
        (rate.numerator > 0 && rate.denominator > 0).then_some(rate)
    }

    /// Frames a second.
    #[must_use]
    pub fn per_second(&self) -> f64 {
        f64::from(self.numerator) / f64::from(self.denominator)
    }

    /// When frame `number` begins, in seconds.
    #[must_use]
    pub fn time_of(&self, number: u64) -> f64 {
        number as f64 * f64::from(self.denominator) / f64::from(self.numerator)
    }

    /// The frame that shows at `time_s`: the latest that has begun. 0 before the beginning and for what is no number.
    #[must_use]
    pub fn frame_at(&self, time_s: f64) -> u64 {
        // a frame's own time, rounded to f64, must give that frame: the slack is a millionth of a frame
        let frames = time_s * self.per_second() + 1e-6;
        if frames > 0.0 { frames as u64 } else { 0 }
    }

    /// As an argument of `ffmpeg`.
    pub(crate) fn argument(&self) -> String {
        format!("{}/{}", self.numerator, self.denominator)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_rates_are_exact() {
        let film = Rate { numerator: 24_000, denominator: 1001 };
        assert_eq!(Rate::nearest(23.976), film);
        assert_eq!(Rate::nearest(30.117), Rate { numerator: 30, denominator: 1 });
        assert_eq!(Rate::nearest(29.97), Rate { numerator: 30_000, denominator: 1001 });
        assert_eq!(Rate::nearest(17.5), Rate { numerator: 17_500, denominator: 1000 });
        assert_eq!(Rate::nearest(f64::NAN), Rate::ASSUMED);
        assert_eq!(Rate::nearest(90_000.0).per_second(), 240.0);
        assert_eq!(Rate::parse("0/0"), None);
        assert_eq!(Rate::parse("24000/1001"), Some(film));
        for number in (0..200_000).step_by(37) {
            assert_eq!(film.frame_at(film.time_of(number)), number);
            assert_eq!(film.frame_at(film.time_of(number) - 1e-4), number.saturating_sub(1));
        }
        assert_eq!((film.frame_at(-1.0), film.frame_at(f64::NAN)), (0, 0));
    }
}
