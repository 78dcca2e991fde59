//! When particles are born, and how old they are: a closed function of the time, so that a picture of any moment is the same whatever was drawn before it.

use heliodon_math::random::{Pcg32, hash2_u32, unit_f32};

/// From when until when a source gives particles, seconds of the visit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Since when; negative infinity: for so long that it is full at the beginning.
    pub since_s: f64,
    /// Until when; infinity: for ever.
    pub until_s: f64,
}

impl Span {
    /// From before the visit on.
    pub const ALWAYS: Self = Self { since_s: f64::NEG_INFINITY, until_s: f64::INFINITY };
    /// Never.
    pub const NEVER: Self = Self { since_s: f64::INFINITY, until_s: f64::INFINITY };

    /// It starts, unless it goes on already.
    pub fn start(&mut self, now_s: f64) {
        if !(self.since_s <= now_s && now_s < self.until_s) {
            *self = Self { since_s: now_s, until_s: f64::INFINITY };
        }
    }

    /// It stops.
    pub fn stop(&mut self, now_s: f64) {
        self.until_s = self.until_s.min(now_s);
    }

    /// Whether anything born in it can still be there, if nothing lives longer than `life_s`.
    #[must_use]
    pub fn is_seen(&self, now_s: f64, life_s: f64) -> bool {
        self.since_s <= now_s && now_s - life_s < self.until_s
    }

    /// How much of what hangs in the air is there, 0 to 1, where it comes and goes within `fade_s`.
    #[must_use]
    pub fn presence(&self, now_s: f64, fade_s: f64) -> f32 {
        let come = ((now_s - self.since_s) / fade_s).clamp(0.0, 1.0);
        let left = ((self.until_s + fade_s - now_s) / fade_s).clamp(0.0, 1.0);
        come.min(left) as f32
    }
}

/// A particle.
#[derive(Debug)]
pub struct Born {
    /// What is random about it.
    pub random: Pcg32,
    /// A random number of its own, in [0, 1).
    pub own: f32,
    /// Seconds since its birth.
    pub age_s: f32,
}

/// How a source gives birth.
#[derive(Clone, Copy, Debug)]
pub struct Births {
    /// Of what is random.
    pub seed: u32,
    /// Particles a second.
    pub per_s: f64,
    /// None lives longer.
    pub most_s: f64,
    /// The share of them that is shown, 0 to 1: of a lesser share none that a greater one would not show.
    pub share: f32,
    /// When it does.
    pub span: Span,
}

impl Births {
    /// Those who may be there at a time, from the oldest on. It takes as long as there are shown, not as long as there would be: of a share from 1/4 to 1/2 only even numbers are asked,
    /// of one from 1/8 to 1/4 every fourth, and so on.
    pub fn at(self, now_s: f64) -> impl Iterator<Item = Born> {
        let Self { seed, per_s, most_s, share, span } = self;
        let (first, last) = (((now_s - most_s) * per_s).floor() as i64 - 1, (now_s * per_s).floor() as i64);
        let (step, between) = steps(share);
        let first = first + (-first).rem_euclid(step);
        // the number 0 is of every share but none
        let last = if share > 0.0 { last } else { first - 1 };
        (first..=last).step_by(step as usize).filter_map(move |number| {
            // the number's lower half repeats after four billion particles
            let hash = hash2_u32(seed, number as u32);
            if number & (2 * step - 1) != 0 && unit_f32(hash2_u32(hash, 1)) >= between {
                return None;
            }
            let own = unit_f32(hash);
            let born_s = (number as f64 + f64::from(own)) / per_s;
            let age_s = now_s - born_s;
            let there = (0.0..most_s).contains(&age_s) && span.since_s <= born_s && born_s < span.until_s;
            there.then(|| Born { random: Pcg32::new(u64::from(hash), u64::from(seed)), own, age_s: age_s as f32 })
        })
    }
}

/// What is shown of a share: of those whose numbers a power of two divides every other one, and of those between them a part. At a whole power of two it is all or none of these, so
/// that no more come or go there than elsewhere.
fn steps(share: f32) -> (i64, f32) {
    let mut step = 1;
    while step < 1 << 30 && share * (2 * step) as f32 <= 1.0 {
        step *= 2;
    }
    (step, share * (2 * step) as f32 - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    fn births(span: Span) -> Births {
        Births { seed: 5, per_s: 100.0, most_s: 2.0, share: 1.0, span }
    }

    fn owns(births: Births, now_s: f64) -> Vec<(u32, u32)> {
        births.at(now_s).map(|born| (born.own.to_bits(), (born.age_s * 1e3).round() as u32)).collect()
    }

    #[test]
    fn a_moment_is_the_same_whatever_was_before_it() {
        let always = births(Span::ALWAYS);
        assert_eq!(owns(always, 7.3), owns(always, 7.3));
        assert!((190..=210).contains(&owns(always, 0.0).len()), "full from the beginning");
        // whoever is there a tenth of a second later was born since, or is older by it
        let (before, after) = (owns(always, 7.3), owns(always, 7.4));
        let aged = |&(own, ms): &(u32, u32)| before.iter().any(|b| b.0 == own && ms.abs_diff(b.1 + 100) <= 1);
        assert!(after.iter().filter(|one| aged(one)).count() > 180);
        assert!(after.iter().filter(|one| !aged(one)).all(|one| one.1 <= 100));
    }

    #[test]
    fn what_is_stopped_dies_out_and_what_is_started_fills_up() {
        let mut span = Span::NEVER;
        assert!(!span.is_seen(3.0, 2.0) && owns(births(span), 3.0).is_empty());
        span.start(3.0);
        let counts = [3.5, 4.0, 6.0].map(|now_s| owns(births(span), now_s).len());
        assert!(counts[0] < counts[1] && counts[1] < counts[2], "{counts:?}");
        // whoever starts what goes on already does not begin anew
        span.start(6.0);
        span.stop(6.0);
        let counts = [6.0, 7.0, 8.1].map(|now_s| owns(births(span), now_s).len());
        assert!(counts[0] > counts[1] && counts[1] > 0 && counts[2] == 0, "{counts:?}");
        assert!(span.is_seen(7.9, 2.0) && !span.is_seen(8.1, 2.0));
        assert_eq!([3.0, 4.0, 9.0].map(|now_s| span.presence(now_s, 1.0)), [0.0, 1.0, 0.0]);
    }

    #[test]
    fn a_share_shows_as_many_as_it_says_and_none_that_a_greater_one_does_not() {
        let many = |share| Births { share, per_s: 100_000.0, ..births(Span::ALWAYS) };
        let numbers = |share| many(share).at(9.0).map(|born| born.own.to_bits()).collect::<Vec<_>>();
        let all = numbers(1.0);
        assert!(all.len().abs_diff(200_000) < 2);
        let mut more: HashSet<u32> = all.iter().copied().collect();
        for share in [0.9, 0.501, 0.5, 0.499, 0.37, 0.25, 0.1, 0.0626, 0.06, 0.01] {
            let some = numbers(share);
            let off = some.len() as f32 / (share * 200_000.0) - 1.0;
            assert!(off.abs() < 0.04, "{share}: {off}");
            assert!(some.iter().all(|own| more.contains(own)), "{share}");
            more = some.into_iter().collect();
        }
        assert_eq!(Births { share: 0.0, ..births(Span::ALWAYS) }.at(1.0).count(), 0);
    }

    #[test]
    fn all_are_shown_of_the_whole_before_the_beginning_too() {
        for now_s in [-7.0, 0.0, 0.505, 4e7] {
            let births = births(Span::ALWAYS);
            let (first, last) =
                (((now_s - births.most_s) * births.per_s).floor() as i64 - 1, (now_s * births.per_s).floor() as i64);
            let own = |number: i64| unit_f32(hash2_u32(births.seed, number as u32));
            let is_there = |&number: &i64| {
                let born_s = (number as f64 + f64::from(own(number))) / births.per_s;
                (0.0..births.most_s).contains(&(now_s - born_s))
            };
            let all: Vec<f32> = (first..=last).filter(is_there).map(own).collect();
            assert_eq!(births.at(now_s).map(|born| born.own).collect::<Vec<_>>(), all);
        }
    }

    #[test]
    fn a_small_share_of_very_many_is_soon_told() {
        // five hundred times water from a roof of two by five metres, for half a second; all of them would be minutes
        let source = Births { per_s: 1.8e6, most_s: 3.8, share: 1e-5, ..births(Span::ALWAYS) };
        let (step, between) = steps(source.share);
        assert!(source.per_s * source.most_s / step as f64 <= 2.0 * 1e-5 * source.per_s * source.most_s);
        assert!((0.0..1.0).contains(&between));
        let shown: usize = (0..200).map(|frame| source.at(f64::from(frame) * 5.0).count()).sum();
        assert!((shown as f64 / (200.0 * 68.4) - 1.0).abs() < 0.05, "{shown}");
    }
}
