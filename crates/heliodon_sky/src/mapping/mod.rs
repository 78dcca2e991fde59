//! Where each pixel of a probe looks, both ways, and what solid angle it stands for.
//!
//! Frame: +Y up, +X east, -Z north. Positions are in pixels from the top left corner, pixel centres at `k + 0.5`.
//!
//! - **lat-long**: the middle column looks north, east to its right, the top row up.
//! - **angular** (Debevec's light probe): the whole sphere seen along -Z, image up is +Y, image right is +X, radius proportional to
//!   the angle from -Z.
//! - **mirror-ball**: the same with radius = sin(angle / 2).
//! - **fisheye**: seen from below, equidistant from the zenith, north at the top, east at the left.
//! - **cube-cross**: the face that looks north (-Z) in the middle, west (-X) on its left, east (+X) on its right, up above it and down
//!   below it; the face that looks south is right of the east face in a 4 x 3 cross, and upside down below the lower face
//!   in a 3 x 4 cross. Six faces in a row or a column (6 x 1, 1 x 6) come as graphics libraries number them, right, left, top, bottom,
//!   front, back: looking east, west, up, down, north, south; up with south at its upper edge, down with north there.

mod cross;
mod disc;
mod grid;

pub use grid::ProbeGrid;

use crate::error::SkyError;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// How a probe's pixels lie on the sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mapping {
    /// Latitude and longitude.
    LatLong,
    /// The whole sphere along -Z, equidistant.
    Angular,
    /// The whole sphere along -Z, equal-area.
    MirrorBall,
    /// About the zenith, equidistant.
    Fisheye {
        /// The angle across the whole disc, in degrees: 180 for the upper half.
        opening_deg: f64,
    },
    /// Six faces of a cube: a cross, 3 x 4 or 4 x 3, or a strip, 6 x 1 or 1 x 6.
    CubeCross,
}

impl Mapping {
    /// The mapping of a name in `site.toml`; `opening_deg` is for fisheyes (180 if absent).
    ///
    /// # Errors
    /// Where the name is unknown, or the opening angle lies outside of (0, 360].
    pub fn from_name(name: &str, opening_deg: Option<f64>) -> Result<Self, SkyError> {
        let opening_deg = opening_deg.unwrap_or(180.0);
        if !(opening_deg > 0.0 && opening_deg <= 360.0) {
            return Err(SkyError::setting(
                "opening_deg",
                format!("{opening_deg} is no opening angle"),
                "give degrees above 0, at most 360",
            ));
        }
        match name {
            "lat-long" => Ok(Self::LatLong),
            "angular" => Ok(Self::Angular),
            "mirror-ball" => Ok(Self::MirrorBall),
            "fisheye" => Ok(Self::Fisheye { opening_deg }),
            "cube-cross" => Ok(Self::CubeCross),
            other => Err(SkyError::setting(
                "mapping",
                format!("`{other}` is unknown"),
                "give lat-long, angular, mirror-ball, fisheye or cube-cross",
            )),
        }
    }

    /// The name in `site.toml`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::LatLong => "lat-long",
            Self::Angular => "angular",
            Self::MirrorBall => "mirror-ball",
            Self::Fisheye { .. } => "fisheye",
            Self::CubeCross => "cube-cross",
        }
    }
}

/// What a probe shows below the horizon.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BelowHorizon {
    /// What is in the image.
    #[default]
    Keep,
    /// Nothing.
    Black,
    /// The upper half, without the sun, mirrored at the horizon.
    Mirror,
}

impl BelowHorizon {
    /// The rule of a name in `site.toml`.
    ///
    /// # Errors
    /// Where the name is unknown.
    pub fn from_name(name: &str) -> Result<Self, SkyError> {
        match name {
            "keep" => Ok(Self::Keep),
            "black" => Ok(Self::Black),
            "mirror" => Ok(Self::Mirror),
            other => Err(SkyError::setting("below_horizon", format!("`{other}` is unknown"), "give keep, black or mirror")),
        }
    }
}

/// How far from a pixel's middle the nodes of two-point Gauss quadrature lie: `1 / (2 sqrt 3)`.
const NODE_OFFSET: f64 = 0.288_675_134_594_812_9;

/// A mapping at an image size, turned to the north.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    mapping: Mapping,
    width: u32,
    height: u32,
    turn_rad: f64,
}

impl Geometry {
    /// The geometry of images of a size. `turn_rad` is the compass bearing, clockwise, of what the mapping calls north.
    ///
    /// # Errors
    /// Where the size is nothing, or the faces of a cube are neither 3 x 4, 4 x 3, 6 x 1 nor 1 x 6.
    pub fn new(mapping: Mapping, width: u32, height: u32, turn_rad: f64) -> Result<Self, SkyError> {
        let wrong = |problem: String, remedy| Err(SkyError::Probe { name: mapping.name().into(), problem, remedy });
        if width == 0 || height == 0 {
            return wrong(format!("an image of {width} x {height} pixels"), "give an image with pixels");
        }
        if mapping == Mapping::CubeCross && cross::face_count(width, height).is_none() {
            return wrong(
                format!("{width} x {height} pixels are no six square faces of a cube"),
                "give an image of 3 x 4, 4 x 3, 6 x 1 or 1 x 6 faces, or another mapping",
            );
        }
        if !turn_rad.is_finite() {
            return Err(SkyError::setting("turn_deg", "is not finite", "give degrees"));
        }
        Ok(Self { mapping, width, height, turn_rad })
    }

    /// The mapping.
    #[must_use]
    pub fn mapping(&self) -> Mapping {
        self.mapping
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Whether two pixels belong to images that only lie side by side: faces of a cube in a row.
    pub(crate) fn are_parted(&self, a: (u32, u32), b: (u32, u32)) -> bool {
        let side = (self.mapping == Mapping::CubeCross).then(|| cross::strip_side(self.width, self.height)).flatten();
        side.is_some_and(|side| (a.0 / side, a.1 / side) != (b.0 / side, b.1 / side))
    }

    /// The unit direction in which the image looks at a position; `None` outside of the disc, the cross or the image.
    #[must_use]
    pub fn direction(&self, x: f64, y: f64) -> Option<DVec3> {
        let (w, h) = (f64::from(self.width), f64::from(self.height));
        if !(x >= 0.0 && x <= w && y >= 0.0 && y <= h) {
            return None;
        }
        let own = match self.mapping {
            Mapping::LatLong => {
                let azimuth = (x / w - 0.5) * TAU;
                let colatitude = y / h * PI;
                let (s, c) = libm::sincos(colatitude);
                let (sa, ca) = libm::sincos(azimuth);
                Some(DVec3::new(s * sa, c, -s * ca))
            }
            Mapping::CubeCross => cross::direction(w, h, x, y),
            _ => {
                let (a, b) = disc::from_pixel(w, h, x, y);
                disc::direction(self.mapping, a, b)
            }
        };
        own.map(|d| turned(d, self.turn_rad))
    }

    /// The position at which the image shows a unit direction; `None` where it does not.
    #[must_use]
    pub fn position(&self, direction: DVec3) -> Option<(f64, f64)> {
        let (w, h) = (f64::from(self.width), f64::from(self.height));
        let d = turned(direction, -self.turn_rad);
        match self.mapping {
            Mapping::LatLong => {
                let azimuth = libm::atan2(d.x, -d.z);
                let colatitude = libm::atan2(libm::hypot(d.x, d.z), d.y);
                Some(((azimuth / TAU + 0.5) * w, colatitude / PI * h))
            }
            Mapping::CubeCross => Some(cross::position(w, h, d)),
            _ => disc::position(self.mapping, d).map(|(a, b)| disc::to_pixel(w, h, a, b)),
        }
    }

    /// Solid angle for each pixel's area, in sr per square pixel, at a position.
    fn density(&self, x: f64, y: f64) -> f64 {
        let (w, h) = (f64::from(self.width), f64::from(self.height));
        match self.mapping {
            Mapping::LatLong => libm::sin(y / h * PI).max(0.0) * TAU * PI / (w * h),
            Mapping::CubeCross => cross::density(w, h, x, y),
            _ => {
                let (a, b) = disc::from_pixel(w, h, x, y);
                let radius_px = 0.5 * w.min(h);
                disc::density(self.mapping, a, b) / (radius_px * radius_px)
            }
        }
    }

    /// Four directions that stand for a pixel (Gauss points), and their shares of it, which sum to 1; points beyond a disc's rim are drawn onto it.
    #[must_use]
    pub fn pixel_nodes(&self, x: u32, y: u32) -> [(DVec3, f64); 4] {
        let centre = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        let mut nodes = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(dx, dy)| {
            let (px, py) = (centre.0 + dx * NODE_OFFSET, centre.1 + dy * NODE_OFFSET);
            (self.direction_drawn_in(px, py), self.density(px, py))
        });
        let sum: f64 = nodes.iter().map(|n| n.1).sum();
        for node in &mut nodes {
            node.1 = if sum > 0.0 { node.1 / sum } else { 0.25 };
        }
        nodes
    }

    /// For a lat-long map, which lies in rows and columns: the horizontal directions of the two nodes of each column, east and north.
    pub(crate) fn column_nodes(&self) -> Vec<[(f64, f64); 2]> {
        let w = f64::from(self.width);
        let at = |x: f64| libm::sincos((x / w - 0.5) * TAU + self.turn_rad);
        (0..self.width).map(|x| [0.5 - NODE_OFFSET, 0.5 + NODE_OFFSET].map(|dx| at(f64::from(x) + dx))).collect()
    }

    /// For a lat-long map: sine and cosine of the colatitude of the two nodes of a row, and their shares, which sum to 1.
    pub(crate) fn row_nodes(&self, y: u32) -> [(f64, f64, f64); 2] {
        let h = f64::from(self.height);
        let nodes = [0.5 - NODE_OFFSET, 0.5 + NODE_OFFSET].map(|dy| libm::sincos((f64::from(y) + dy) / h * PI));
        let sum = nodes[0].0 + nodes[1].0;
        nodes.map(|(s, c)| (s, c, s / sum))
    }

    /// The direction at a position, or at the disc's rim where the position lies beyond it.
    pub(crate) fn direction_drawn_in(&self, x: f64, y: f64) -> DVec3 {
        if let Some(d) = self.direction(x, y) {
            return d;
        }
        let (w, h) = (f64::from(self.width), f64::from(self.height));
        let own = match self.mapping {
            Mapping::LatLong | Mapping::CubeCross => DVec3::Y,
            _ => {
                let (a, b) = disc::from_pixel(w, h, x, y);
                // a hair inside, where the division by the radius cannot leave the disc again
                let scale = (1.0 - 1e-12) / libm::hypot(a, b).max(1e-300);
                disc::direction(self.mapping, a * scale, b * scale).unwrap_or(DVec3::Y)
            }
        };
        turned(own, self.turn_rad)
    }
}

/// `d` turned clockwise (as on a compass) about +Y.
pub(crate) fn turned(d: DVec3, turn_rad: f64) -> DVec3 {
    if turn_rad == 0.0 {
        return d;
    }
    let (s, c) = libm::sincos(turn_rad);
    DVec3::new(d.x * c - d.z * s, d.y, d.z * c + d.x * s)
}
