//! `[[matte]]`: invisible polygons that hide what lies behind them.
//!
//! Georgios Papaioannou, Athanasios Gaitatzes, Dimitrios Christopoulos: "Enhancing Virtual Reality Walkthroughs of Archaeological
//! Sites", VAST 2003, section 3.2.1: occluders need not be visible geometry, they may be mattes that are put into the world for culling alone.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The most corners of a matte: each costs a test of everything that may lie behind it.
pub const MAX_MATTE_CORNERS: usize = 16;

/// How far corners may lie off their plane, as a part of the matte's size: what coordinates in single precision leave of a flat
/// polygon a thousand times its size away from the origin.
const OFF_PLANE: f64 = 1e-4;

/// Sine of the angle by which a corner may turn inward, so that corners in the middle of an edge are none that turn.
const STRAIGHT: f64 = 1e-6;

/// `[[matte]]`: an invisible polygon, planar and convex. A viewer that culls by shadows does not draw what lies wholly behind one, from
/// either side of it. Nothing is baked of it and it gives no shadow. Put it inside walls: one in free air hides what an eye should see.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Matte {
    /// The matte's name, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Its corners one after the other around it, either way, in the coordinates of the parts before the site's `origin` is
    /// subtracted; in a manifest, after.
    #[schemars(length(min = 3, max = 16))]
    pub corners: Vec<[f64; 3]>,
}

impl Matte {
    /// A matte without a name.
    #[must_use]
    pub fn new(corners: impl Into<Vec<[f64; 3]>>) -> Self {
        Self { name: None, corners: corners.into() }
    }

    /// The matte moved by minus the site's origin: from the site's coordinates to the bundle's.
    #[must_use]
    pub fn relative_to(&self, origin: [f64; 3]) -> Self {
        let moved = |point: &[f64; 3]| [0, 1, 2].map(|axis| point[axis] - origin[axis]);
        Self { name: self.name.clone(), corners: self.corners.iter().map(moved).collect() }
    }

    /// Its area, square metres.
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        0.5 * newell(&self.corners).length()
    }

    /// What is wrong with finite corners, and what to do about it.
    pub(super) fn fault(&self) -> Option<(String, String)> {
        let corners = &self.corners;
        let count = corners.len();
        if !(3..=MAX_MATTE_CORNERS).contains(&count) {
            let remedy = format!("give 3 to {MAX_MATTE_CORNERS} points around it; make a larger outline of several mattes");
            return Some((format!("the matte has {count} corners"), remedy));
        }
        let point = |i: usize| DVec3::from(corners[i % count]);
        let size = (1..count).map(|i| point(i).distance(point(0))).fold(0.0, f64::max);
        let normal = newell(corners);
        let remedy = "give corners one after the other around it";
        if let Some(i) = (0..count).find(|&i| point(i) == point(i + 1)) {
            return Some((format!("corners {} and {} are the same", i + 1, (i + 1) % count + 1), remedy.to_owned()));
        }
        // an area of nothing leaves no direction in which it looks
        let Some(normal) = normal.try_normalize().filter(|_| normal.length() > STRAIGHT * size * size) else {
            return Some(("the matte has no area".to_owned(), remedy.to_owned()));
        };
        let middle = (0..count).map(point).sum::<DVec3>() / count as f64;
        let off = |i: usize| (point(i) - middle).dot(normal).abs();
        let worst = (0..count).max_by(|&a, &b| off(a).total_cmp(&off(b))).unwrap_or(0);
        if off(worst) > OFF_PLANE * size {
            let message = format!("the matte is not planar: corner {} lies {:.3} m off its plane", worst + 1, off(worst));
            return Some((message, "move the corner into the plane of the others, or make two mattes of it".to_owned()));
        }
        // Around a convex polygon every corner turns the same way, and all of them together turn once.
        let mut turned_rad = 0.0;
        for i in 0..count {
            let [before, after] = [point(i + 1) - point(i), point(i + 2) - point(i + 1)].map(DVec3::normalize_or_zero);
            let turn = libm::atan2(before.cross(after).dot(normal), before.dot(after));
            if turn < -STRAIGHT {
                let message = format!("the matte is not convex: it turns inward at corner {}", (i + 1) % count + 1);
                return Some((message, format!("{remedy}, or divide it into convex mattes")));
            }
            turned_rad += turn;
        }
        if turned_rad > 1.5 * std::f64::consts::TAU {
            return Some(("the edges of the matte cross".to_owned(), remedy.to_owned()));
        }
        None
    }
}

/// Normal of a polygon, as long as twice its area (Martin Newell's sum).
fn newell(corners: &[[f64; 3]]) -> DVec3 {
    let first = corners.first().map_or(DVec3::ZERO, |&corner| DVec3::from(corner));
    let points = corners.iter().map(|&corner| DVec3::from(corner) - first);
    points.clone().zip(points.skip(1)).map(|(a, b)| a.cross(b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(points: &[[f64; 2]]) -> Matte {
        Matte::new(points.iter().map(|&[x, y]| [x, y, 0.5 * x]).collect::<Vec<_>>())
    }

    fn fault(matte: &Matte) -> String {
        matte.fault().map_or_else(String::new, |(message, _)| message)
    }

    #[test]
    fn convex_polygons_either_way_round_are_taken() {
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]];
        assert!((flat(&square).area_m2() - 12.0 * 1.25_f64.sqrt()).abs() < 1e-9);
        let back: Vec<[f64; 2]> = square.iter().rev().copied().collect();
        let middle_of_an_edge = [[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [0.0, 3.0]];
        for points in [&square[..], &back, &middle_of_an_edge, &square[..3]] {
            assert_eq!(fault(&flat(points)), "");
        }
        let far = flat(&square).relative_to([-4e5, 2e6, -3e6]);
        assert_eq!((fault(&far).as_str(), far.corners[0]), ("", [4e5, -2e6, 3e6]));
    }

    #[test]
    fn what_is_no_convex_polygon_is_told() {
        let dented = [[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]];
        assert!(fault(&flat(&dented)).contains("inward at corner 3"), "{}", fault(&flat(&dented)));
        let crossed = [[0.0, 0.0], [4.0, 3.0], [4.0, 0.0], [0.0, 4.0]];
        assert!(fault(&flat(&crossed)).contains("inward"), "{}", fault(&flat(&crossed)));
        let star: Vec<[f64; 2]> = (0..5).map(|k| (k as f64 * 0.8 * std::f64::consts::PI).sin_cos().into()).collect();
        assert_eq!(fault(&flat(&star)), "the edges of the matte cross");
        assert!(fault(&flat(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]])).contains("no area"));
        assert!(fault(&flat(&[[0.0, 0.0], [1.0, 1.0]])).contains("2 corners"));
        assert!(fault(&flat(&[[0.0, 0.0]; 17])).contains("17 corners"));
        assert!(fault(&flat(&[[0.0, 0.0], [1.0, 1.0], [1.0, 1.0], [0.0, 3.0]])).contains("2 and 3 are the same"));
        let mut bent = flat(&[[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]]);
        bent.corners[2][2] += 0.2;
        assert!(fault(&bent).contains("not planar") && fault(&bent).contains("0.0"), "{}", fault(&bent));
    }
}
