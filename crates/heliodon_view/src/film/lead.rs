//! Somebody who goes ahead of the visitor along a path, and waits where they fall behind.

use glam::{Vec2, Vec3};

/// How far ahead along the path a guide likes to be, metres; nearer than `NEAR_M` it sets off, and beyond `FAR_M` it waits.
const LIKED_M: f32 = 3.0;
const NEAR_M: f32 = 2.5;
const FAR_M: f32 = 4.0;
/// Who is farther off the path than this is not following it, metres.
const OFF_M: f32 = 8.0;
/// A guide's quickest step, metres a second: quicker than visitors walk, so that it is not overtaken for long.
const MOST_M_S: f32 = 2.5;
/// How fast it goes for each metre that it is nearer than it likes to be, 1/s.
const EAGER: f32 = 1.5;
/// How soon it is as fast as it wishes to be, 1/s.
const NIMBLE: f32 = 4.0;

/// A guide on a path.
#[derive(Clone, Debug, PartialEq)]
pub struct Leader {
    points: Vec<Vec3>,
    /// Metres from the first point to each.
    metres: Vec<f32>,
    at_m: f32,
    followed_m: f32,
    speed_m_s: f32,
    goes: bool,
}

impl Leader {
    /// At the beginning of a path, of at least one point.
    #[must_use]
    pub fn new(mut points: Vec<Vec3>) -> Self {
        points.dedup();
        let mut sum = 0.0;
        let step = |i: usize| if i == 0 { 0.0 } else { points[i].distance(points[i - 1]) };
        let metres = (0..points.len())
            .map(|i| {
                sum += step(i);
                sum
            })
            .collect();
        Self { points, metres, at_m: 0.0, followed_m: 0.0, speed_m_s: 0.0, goes: false }
    }

    /// Where it is.
    #[must_use]
    pub fn place(&self) -> Vec3 {
        self.point(self.at_m)
    }

    /// How far ahead of the visitor along the path it is, metres.
    #[must_use]
    pub fn ahead_m(&self) -> f32 {
        self.at_m - self.followed_m
    }

    /// Whether it has come to the path's end.
    #[must_use]
    pub fn has_arrived(&self) -> bool {
        self.at_m >= self.length_m()
    }

    /// So much time passes, with the visitor's eyes somewhere. It never goes back.
    pub fn pass(&mut self, seconds: f32, visitor: Vec3) {
        let (along_m, off_m) = self.nearest(visitor);
        self.followed_m = self.followed_m.max(along_m);
        let ahead_m = self.ahead_m();
        self.goes = off_m < OFF_M && !self.has_arrived() && if self.goes { ahead_m < FAR_M } else { ahead_m < NEAR_M };
        let wished = if self.goes { (EAGER * (LIKED_M - ahead_m)).clamp(0.0, MOST_M_S) } else { 0.0 };
        self.speed_m_s += (wished - self.speed_m_s) * (NIMBLE * seconds).clamp(0.0, 1.0);
        // eases out without leaving the range behind
        let most_m = (self.followed_m + FAR_M).max(self.at_m).min(self.length_m());
        self.at_m = (self.at_m + self.speed_m_s * seconds.max(0.0)).min(most_m);
    }

    fn length_m(&self) -> f32 {
        self.metres.last().copied().unwrap_or(0.0)
    }

    /// The point so many metres along.
    fn point(&self, metres: f32) -> Vec3 {
        if self.points.len() < 2 {
            return self.points.first().copied().unwrap_or_default();
        }
        let i = self.metres.partition_point(|&m| m <= metres).clamp(1, self.points.len() - 1);
        let (from, to) = (self.metres[i - 1], self.metres[i]);
        self.points[i - 1].lerp(self.points[i], ((metres - from) / (to - from)).clamp(0.0, 1.0))
    }

    /// How far along the path somebody is, and how far off it, seen from above; not farther along than a guide may lead, so that a path that comes
    /// back to where it was is followed in its order.
    fn nearest(&self, place: Vec3) -> (f32, f32) {
        let flat = |p: Vec3| Vec2::new(p.x, p.z);
        let mut best = (0.0, self.points.first().map_or(0.0, |first| flat(*first).distance(flat(place))));
        for (pair, metres) in self.points.windows(2).zip(&self.metres) {
            let (a, b) = (flat(pair[0]), flat(pair[1]));
            let along = ((flat(place) - a).dot(b - a) / (b - a).length_squared().max(1e-12)).clamp(0.0, 1.0);
            let off_m = a.lerp(b, along).distance(flat(place));
            let along_m = metres + along * pair[0].distance(pair[1]);
            if along_m <= self.at_m + FAR_M && off_m < best.1 {
                best = (along_m, off_m);
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner() -> Leader {
        Leader::new(vec![Vec3::ZERO, Vec3::new(10.0, 0.0, 0.0), Vec3::new(10.0, 0.0, -10.0)])
    }

    #[test]
    fn a_guide_keeps_ahead_and_waits() {
        let mut guide = corner();
        let mut last = guide.place();
        // a visitor who walks 1.2 m/s along the path for 10 s, stands for 5 s, and goes on
        let walked = |t: f32| 1.2 * if t < 10.0 { t } else { (t - 5.0).max(10.0) };
        let at = |m: f32| if m < 10.0 { Vec3::new(m, 1.7, 0.2) } else { Vec3::new(10.2, 1.7, 10.0 - m) };
        let mut stood = None;
        for i in 0..1200 {
            let t = i as f32 / 60.0;
            guide.pass(1.0 / 60.0, at(walked(t)));
            assert!(guide.place().distance(last) < 0.06, "no leaps: {t}");
            last = guide.place();
            if t > 3.0 && !guide.has_arrived() {
                assert!((2.0..=4.0).contains(&guide.ahead_m()), "{} m ahead at {t}", guide.ahead_m());
            }
            if (13.0..15.0).contains(&t) {
                assert!(stood.is_none_or(|place: Vec3| place.distance(last) < 0.05), "it waits");
                stood = stood.or(Some(last));
            }
        }
        for _ in 0..600 {
            guide.pass(1.0 / 60.0, at(20.0));
        }
        assert_eq!(guide.place(), Vec3::new(10.0, 0.0, -10.0), "at the end it stays");
        guide.pass(1.0, at(0.0));
        assert_eq!(guide.place(), Vec3::new(10.0, 0.0, -10.0), "and never goes back");
    }

    #[test]
    fn who_is_elsewhere_is_waited_for() {
        let mut guide = corner();
        (0..600).for_each(|_| guide.pass(1.0 / 60.0, Vec3::new(-30.0, 1.7, 0.0)));
        assert_eq!(guide.place(), Vec3::ZERO);
    }

    #[test]
    fn paths_of_one_place_are_stood_on() {
        let mut guide = Leader::new(vec![Vec3::X, Vec3::X]);
        guide.pass(1.0, Vec3::ZERO);
        assert_eq!(guide.place(), Vec3::X);
        assert!(guide.has_arrived());
    }
}
