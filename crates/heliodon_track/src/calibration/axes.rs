//! Which way a tracker's axes point: one of the 48 ways to lay three axes along three others.

use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// The tracker's axes that lie along +X, +Y and +Z (right, up, backwards), written as three words: `x y z` for a tracker that
/// has them as we do, `x z -y` for one whose Z points up and whose Y forwards, `x y -z` for a left-handed one whose Z points
/// forwards, as Unity's and VMC's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Axes {
    /// For each of our axes, the index of the tracker's, each once.
    from: [usize; 3],
    /// Whether that one points the other way.
    turned: [bool; 3],
}

impl Default for Axes {
    fn default() -> Self {
        Self::SAME
    }
}

impl Axes {
    /// `x y z`.
    pub const SAME: Self = Self { from: [0, 1, 2], turned: [false; 3] };

    /// `x z -y`: Z up.
    pub const Z_UP: Self = Self { from: [0, 2, 1], turned: [false, false, true] };

    /// All 48, right-handed and left-handed.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
        let signs = (0..8).map(|bits| [0, 1, 2].map(|axis| bits >> axis & 1 == 1));
        signs.flat_map(|turned| orders.map(|from| Self { from, turned })).collect()
    }

    /// Whether the tracker is left-handed.
    #[must_use]
    pub fn mirrors(self) -> bool {
        let odd_order = (self.from[0] + 1) % 3 != self.from[1];
        odd_order != (self.turned.iter().filter(|turned| **turned).count() % 2 == 1)
    }

    /// A point or direction of the tracker's along our axes.
    #[must_use]
    pub fn point(self, p_tracker: Vec3) -> Vec3 {
        let coordinate = |axis: usize| {
            let value = p_tracker[self.from[axis]];
            if self.turned[axis] { -value } else { value }
        };
        Vec3::new(coordinate(0), coordinate(1), coordinate(2))
    }

    /// An orientation of the tracker's along our axes: `M R M^-1` of the matrices, so that the body's own axes are relaid like
    /// the room's, and what is not turned is not turned afterwards either.
    #[must_use]
    pub fn rotation(self, orientation: Quat) -> Quat {
        // the axis of a rotation is a direction, but one that a mirror turns round
        let axis = self.point(Vec3::new(orientation.x, orientation.y, orientation.z));
        let axis = if self.mirrors() { -axis } else { axis };
        Quat::from_xyzw(axis.x, axis.y, axis.z, orientation.w)
    }
}

impl fmt::Display for Axes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, (from, turned)) in self.from.iter().zip(self.turned).enumerate() {
            let (blank, sign) = (if i == 0 { "" } else { " " }, if turned { "-" } else { "" });
            write!(f, "{blank}{sign}{}", ["x", "y", "z"][*from])?;
        }
        Ok(())
    }
}

impl FromStr for Axes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` names no axes; write x, y and z in some order, each with or without -: \"x z -y\"");
        let mut axes = Self::SAME;
        let mut words = text.split_ascii_whitespace();
        for axis in 0..3 {
            let word = words.next().ok_or_else(wrong)?;
            let name = word.trim_start_matches(['-', '+']);
            axes.from[axis] = ["x", "y", "z"].iter().position(|known| *known == name).ok_or_else(wrong)?;
            axes.turned[axis] = match &word[..word.len() - 1] {
                "" | "+" => false,
                "-" => true,
                _ => return Err(wrong()),
            };
        }
        let each_once = (0..3).all(|axis| axes.from.contains(&axis));
        if each_once && words.next().is_none() { Ok(axes) } else { Err(wrong()) }
    }
}

impl TryFrom<String> for Axes {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Axes> for String {
    fn from(axes: Axes) -> Self {
        axes.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Mat3;
    use std::collections::HashSet;

    /// The axes as a matrix, from what [`Axes::point`] does.
    fn matrix(axes: Axes) -> Mat3 {
        Mat3::from_cols(axes.point(Vec3::X), axes.point(Vec3::Y), axes.point(Vec3::Z))
    }

    #[test]
    fn there_are_forty_eight_and_half_of_them_mirror() {
        let all: HashSet<Axes> = Axes::all().into_iter().collect();
        assert_eq!(all.len(), 48);
        assert_eq!(all.iter().filter(|axes| axes.mirrors()).count(), 24);
        for axes in all {
            let determinant = matrix(axes).determinant();
            assert_eq!(determinant, if axes.mirrors() { -1.0 } else { 1.0 }, "{axes}");
        }
    }

    #[test]
    fn every_one_is_read_as_it_is_written() {
        for axes in Axes::all() {
            assert_eq!(axes.to_string().parse(), Ok(axes));
        }
        assert_eq!("x z -y".parse(), Ok(Axes::Z_UP));
        assert_eq!(" +x\ty  z ".parse(), Ok(Axes::SAME));
        for wrong in ["", "x y", "x y y", "x y z w", "x y --z", "x y -", "xyz", "x y Z", "x y é", "x y é-z"] {
            let error = wrong.parse::<Axes>().unwrap_err();
            assert!(error.contains("x z -y"), "{error}");
        }
    }

    #[test]
    fn orientations_are_relaid_as_their_matrices_are() {
        let orientation = crate::rotation::from_vector(Vec3::new(0.4, -1.1, 0.7));
        for axes in Axes::all() {
            let m = matrix(axes);
            let expected = m * Mat3::from_quat(orientation) * m.inverse();
            let got = Mat3::from_quat(axes.rotation(orientation));
            assert!(got.abs_diff_eq(expected, 1e-6), "{axes}");
            assert_eq!(axes.rotation(Quat::IDENTITY), Quat::IDENTITY, "{axes}");
        }
    }

    #[test]
    fn a_tracker_with_z_up_turns_left_about_our_y() {
        let left = crate::rotation::from_vector(Vec3::Z * 0.5);
        assert!((crate::rotation::to_vector(Axes::Z_UP.rotation(left)) - Vec3::Y * 0.5).length() < 1e-6);
        assert_eq!(Axes::Z_UP.point(Vec3::new(1.0, 2.0, 3.0)), Vec3::new(1.0, 3.0, -2.0));
        // Unity: +Y up, a positive turn about it goes to the right
        let unity: Axes = "x y -z".parse().unwrap();
        let right = crate::rotation::from_vector(Vec3::Y * 0.5);
        assert!((crate::rotation::to_vector(unity.rotation(right)) + Vec3::Y * 0.5).length() < 1e-6);
    }
}
