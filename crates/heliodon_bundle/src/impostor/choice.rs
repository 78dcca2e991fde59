//! Which views are shown.

use super::{ImpostorInfo, Ring};
use glam::Vec3;

/// Views, and how much of each.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Choice {
    /// Numbers of views, of those with a weight of 0 any.
    pub views: [u32; 4],
    /// 0 to 1, together 1, the largest first.
    pub weights: [f32; 4],
}

/// A view's axes in the model's space: to its right, up, and from the model's middle towards it.
#[must_use]
pub fn axes(elevation_deg: f32, azimuth_deg: f32) -> [Vec3; 3] {
    let (sin_e, cos_e) = libm::sincosf(elevation_deg.to_radians());
    let (sin_a, cos_a) = libm::sincosf(azimuth_deg.to_radians());
    let right = Vec3::new(cos_a, 0.0, -sin_a);
    let toward = Vec3::new(sin_a * cos_e, sin_e, cos_a * cos_e);
    [right, toward.cross(right), toward]
}

/// Two views of a ring beside an azimuth, and how much of the second.
fn beside(ring: &Ring, azimuth_deg: f32) -> ([u32; 2], f32) {
    if ring.views == 1 {
        return ([0; 2], 0.0);
    }
    if ring.is_closed() {
        let at = (azimuth_deg - ring.from_deg).rem_euclid(360.0) / 360.0 * ring.views as f32;
        let first = (at as u32).min(ring.views - 1);
        return ([first, (first + 1) % ring.views], (at - first as f32).clamp(0.0, 1.0));
    }
    // beyond both ends the nearer one
    let span = ring.to_deg - ring.from_deg;
    let middle = ring.from_deg + 0.5 * span;
    let off = (azimuth_deg - middle + 180.0).rem_euclid(360.0) - 180.0;
    let at = ((off / span + 0.5).clamp(0.0, 1.0)) * (ring.views - 1) as f32;
    let first = (at as u32).min(ring.views - 2);
    ([first, first + 1], at - first as f32)
}

impl Choice {
    /// How much each view may lose at most: of four that are alike a fifth of each stays.
    pub const MOST_SPARED: f32 = 0.2;

    /// Fewer views, for who is too far away to tell: each loses `spared` (0 to [`Choice::MOST_SPARED`]) of the whole, those that have no more go, and what is left is a whole again. Weights still
    /// change continuously, but quicker.
    #[must_use]
    pub fn sparing(self, spared: f32) -> Self {
        if spared.is_nan() || spared <= 0.0 {
            return self;
        }
        let spared = spared.min(Self::MOST_SPARED);
        let left = self.weights.map(|weight| (weight - spared).max(0.0));
        let whole: f32 = left.iter().sum();
        Self { weights: left.map(|weight| weight / whole), ..self }
    }
}

impl ImpostorInfo {
    /// The views around the direction from the model's middle to an eye, in the model's space: of the rings above and below it two each.
    /// Weights change continuously with the direction.
    #[must_use]
    pub fn choose(&self, toward: Vec3) -> Choice {
        let toward = toward.try_normalize().unwrap_or(Vec3::Z);
        let elevation = libm::asinf(toward.y.clamp(-1.0, 1.0)).to_degrees();
        let azimuth = libm::atan2f(toward.x, toward.z).to_degrees();
        let above = self.rings.iter().position(|ring| ring.elevation_deg > elevation).unwrap_or(self.rings.len());
        let below = above.saturating_sub(1);
        let above = above.min(self.rings.len().saturating_sub(1));
        let Some((low, high)) = self.rings.get(below).zip(self.rings.get(above)) else { return Choice::default() };
        let part = match high.elevation_deg - low.elevation_deg {
            rise if rise > 0.0 => ((elevation - low.elevation_deg) / rise).clamp(0.0, 1.0),
            _ => 0.0,
        };
        let first_of = |ring: usize| self.rings[..ring].iter().map(|ring| ring.views).sum::<u32>();
        let mut found = [(0, 0.0); 4];
        for (half, (ring, number, share)) in [(low, below, 1.0 - part), (high, above, part)].into_iter().enumerate() {
            let (views, second) = beside(ring, azimuth);
            let first = first_of(number);
            found[2 * half] = (first + views[0], share * (1.0 - second));
            found[2 * half + 1] = (first + views[1], share * second);
        }
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        Choice { views: found.map(|(view, _)| view), weights: found.map(|(_, weight)| weight) }
    }

    /// The view nearest to that direction alone.
    #[must_use]
    pub fn nearest(&self, toward: Vec3) -> Choice {
        let nearest = self.view_axes().enumerate().max_by(|(_, a), (_, b)| a[2].dot(toward).total_cmp(&b[2].dot(toward)));
        let view = nearest.map_or(0, |(view, _)| view as u32);
        Choice { views: [view; 4], weights: [1.0, 0.0, 0.0, 0.0] }
    }

    /// The axes of all views, in their order.
    pub fn view_axes(&self) -> impl Iterator<Item = [Vec3; 3]> {
        self.rings.iter().flat_map(|ring| (0..ring.views).map(|view| axes(ring.elevation_deg, ring.azimuth_deg(view))))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::info;
    use super::*;

    #[test]
    fn axes_are_right_handed_and_look_at_the_model() {
        for (elevation, azimuth) in [(0.0, 0.0), (30.0, 77.0), (-80.0, 200.0), (90.0, 10.0)] {
            let [right, up, toward] = axes(elevation, azimuth);
            assert!(right.cross(up).abs_diff_eq(toward, 1e-6) && (right.length() - 1.0).abs() < 1e-6);
        }
        assert!(axes(0.0, 0.0)[2].abs_diff_eq(Vec3::Z, 1e-6) && axes(0.0, 90.0)[2].abs_diff_eq(Vec3::X, 1e-6));
    }

    #[test]
    fn a_view_is_chosen_alone_from_where_it_was_taken() {
        let info = info();
        for (number, [_, _, toward]) in info.view_axes().enumerate() {
            let choice = info.choose(toward);
            assert_eq!(choice.views[0], number as u32);
            assert!(choice.weights[0] > 0.999, "{number}: {choice:?}");
            assert_eq!(info.nearest(toward).views[0], number as u32);
        }
    }

    #[test]
    fn sparing_leaves_few_views_and_jumps_nowhere() {
        let info = info();
        let (mut before, mut after) = (0, 0);
        let mut last: Option<Choice> = None;
        for step in 0..=1440 {
            let choice = info.choose(axes(17.0, step as f32 * 0.25)[2]);
            assert_eq!(choice.sparing(0.0), choice);
            let fewer = choice.sparing(1.0);
            assert!((fewer.weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
            assert!(fewer.weights.is_sorted_by(|a, b| a >= b) && fewer.weights[0] >= choice.weights[0]);
            let shown = |choice: &Choice| choice.weights.iter().filter(|weight| **weight > 0.0).count();
            (before, after) = (before + shown(&choice), after + shown(&fewer));
            if let Some(last) = last.replace(fewer).filter(|last| last.views[0] == fewer.views[0]) {
                // behind an arc its ends meet
                assert!((last.weights[0] - fewer.weights[0]).abs() < 0.1 || (719..=721).contains(&step), "{step}: {fewer:?}");
            }
        }
        assert!(after * 4 < before * 3, "{after} of {before}");
    }

    #[test]
    fn weights_are_a_whole_and_nothing_jumps() {
        let info = info();
        let full = |choice: &Choice| {
            let mut all = [0.0; 15];
            choice.views.iter().zip(choice.weights).for_each(|(&view, weight)| all[view as usize] += weight);
            all
        };
        for elevation in [-60, -10, -3, 5, 20, 39, 70] {
            let mut last = full(&info.choose(axes(elevation as f32, 0.0)[2]));
            for step in 1..=720 {
                let choice = info.choose(axes(elevation as f32, step as f32 * 0.5)[2]);
                let now = full(&choice);
                assert!((now.iter().sum::<f32>() - 1.0).abs() < 1e-5 && choice.weights.iter().all(|w| (0.0..=1.0).contains(w)));
                let jump = now.iter().zip(last).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                // behind an arc its ends meet
                let behind = elevation > 5 && (359..=361).contains(&step);
                assert!(jump < 0.06 || behind, "{elevation} at {step}: {jump}");
                last = now;
            }
        }
        for toward in [Vec3::ZERO, Vec3::NAN, Vec3::Y, Vec3::NEG_Y] {
            assert!((info.choose(toward).weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        }
    }
}
