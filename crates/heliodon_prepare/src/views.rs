//! Where eyes can be, and how finely they see.

use glam::Vec3;

/// The screen that a site is prepared for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Screen {
    /// Columns.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
    /// Vertical opening angle in radians.
    pub fov_rad: f32,
}

impl Screen {
    /// The side of a pixel, in metres, in a plane before the eye at this distance in metres: that of the middle of the screen, where
    /// pixels are as large as anywhere.
    #[must_use]
    pub fn pixel_m(&self, distance_m: f32) -> f32 {
        2.0 * (0.5 * self.fov_rad).tan() * distance_m / self.height_px.max(1) as f32
    }
}

/// A box in which eyes can be, metres.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewCell {
    /// Its least corner.
    pub low: Vec3,
    /// Its greatest corner.
    pub high: Vec3,
    /// Virtual windows: three corners each (lower left, lower right, upper left, seen from inside). With any, eyes see only through them.
    pub windows: Vec<[Vec3; 3]>,
}

impl ViewCell {
    /// The distance from a point to the box, 0 within.
    #[must_use]
    pub fn distance_m(&self, point: Vec3) -> f32 {
        self.distance_to_box_m(point, point)
    }

    /// The least distance between another box and this one, 0 where they meet.
    #[must_use]
    pub fn distance_to_box_m(&self, low: Vec3, high: Vec3) -> f32 {
        (low - self.high).max(self.low - high).max(Vec3::ZERO).length()
    }
}

/// All boxes in which eyes can be, and the screen that they look at.
#[derive(Clone, Debug, PartialEq)]
pub struct Views {
    /// The boxes; without any, nothing is known of where eyes will be.
    pub cells: Vec<ViewCell>,
    /// The screen.
    pub screen: Screen,
}

impl Views {
    /// The distance from a point to the nearest box; infinite without boxes.
    #[must_use]
    pub fn distance_m(&self, point: Vec3) -> f32 {
        self.distance_to_box_m(point, point)
    }

    /// The least distance between a box and the nearest of those that eyes are in; infinite without any.
    #[must_use]
    pub fn distance_to_box_m(&self, low: Vec3, high: Vec3) -> f32 {
        self.cells.iter().map(|cell| cell.distance_to_box_m(low, high)).fold(f32::INFINITY, f32::min)
    }

    /// The greatest cosine, up to sign, between a normal at a point and the way to any place where an eye can be, or a little more; 1 without
    /// boxes, and within one. A surface shows at most this part of its area.
    #[must_use]
    pub fn facing(&self, point: Vec3, normal: Vec3) -> f32 {
        let of_cell = |cell: &ViewCell| {
            // the distance to the plane is greatest at a corner, for it is linear; that to the point is least where it is least
            let corner = |i: u32| Vec3::select(glam::BVec3::new(i & 1 == 0, i & 2 == 0, i & 4 == 0), cell.low, cell.high);
            let off_plane = (0..8).map(|i| normal.dot(corner(i) - point).abs()).fold(0.0, f32::max);
            let nearest = cell.distance_m(point);
            if off_plane < nearest { off_plane / nearest } else { 1.0 }
        };
        if self.cells.is_empty() { 1.0 } else { self.cells.iter().map(of_cell).fold(0.0, f32::max) }
    }

    /// The greatest sine of the angle between a direction at a point and the way to an eye, or a little less: the part of its length that a short
    /// edge shows at most; 1 without boxes. Asked of the corners and the middle of each box, and its place nearest to the point.
    #[must_use]
    pub fn across(&self, point: Vec3, direction: Vec3) -> f32 {
        let length = direction.length();
        let sine = |eye: Vec3| {
            let way = eye - point;
            let all = way.length() * length;
            if all > 0.0 { way.cross(direction).length() / all } else { 1.0 }
        };
        let of_cell = |cell: &ViewCell| {
            let corner = |i: u32| Vec3::select(glam::BVec3::new(i & 1 == 0, i & 2 == 0, i & 4 == 0), cell.low, cell.high);
            let nearest = point.clamp(cell.low, cell.high);
            (0..8).map(corner).chain([0.5 * (cell.low + cell.high), nearest]).map(sine).fold(0.0, f32::max)
        };
        if self.cells.is_empty() { 1.0 } else { self.cells.iter().map(of_cell).fold(0.0, f32::max).min(1.0) }
    }

    /// How large, in metres, a pixel is on a surface that faces the eye at a point, seen from the nearest place an eye can be, but from no
    /// nearer than `nearest_m`: visitors do not put an eye onto the stone.
    #[must_use]
    pub fn pixel_m(&self, point: Vec3, nearest_m: f32) -> f32 {
        self.screen.pixel_m(self.distance_m(point).max(nearest_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn views() -> Views {
        let cell = |x: f32| ViewCell { low: Vec3::new(x, 0.0, 0.0), high: Vec3::new(x + 2.0, 2.0, 2.0), windows: Vec::new() };
        let screen = Screen { width_px: 1024, height_px: 768, fov_rad: std::f32::consts::FRAC_PI_2 };
        Views { cells: vec![cell(0.0), cell(10.0)], screen }
    }

    #[test]
    fn distances_are_those_to_the_nearest_box() {
        let views = views();
        assert_eq!(views.distance_m(Vec3::new(1.0, 1.0, 1.0)), 0.0);
        assert_eq!(views.distance_m(Vec3::new(5.0, 6.0, 1.0)), 5.0);
        assert_eq!(views.distance_m(Vec3::new(9.0, 1.0, 1.0)), 1.0);
        assert_eq!(views.distance_to_box_m(Vec3::new(3.0, 0.0, 0.0), Vec3::new(4.0, 1.0, 1.0)), 1.0);
        assert_eq!(views.distance_to_box_m(Vec3::new(-5.0, -5.0, -5.0), Vec3::splat(50.0)), 0.0);
        let nowhere = Views { cells: Vec::new(), ..views };
        assert_eq!(nowhere.distance_m(Vec3::ZERO), f32::INFINITY);
    }

    #[test]
    fn ground_far_off_shows_a_small_part_of_its_area() {
        let views = views();
        let far = views.facing(Vec3::new(-40.0, 0.0, 1.0), Vec3::Y);
        assert!((far - 2.0 / 40.0).abs() < 1e-6, "{far}");
        assert_eq!(views.facing(Vec3::new(-40.0, 0.0, 1.0), Vec3::X), 1.0);
        assert_eq!(views.facing(Vec3::new(1.0, 0.0, 1.0), Vec3::Y), 1.0, "beneath the eyes");
        let far = Vec3::new(-40.0, 0.0, 1.0);
        // the eye is two metres higher and one to the side
        assert!((views.across(far, Vec3::X) - 5.0_f32.sqrt() / 40.0).abs() < 1e-3, "along the view");
        assert!(views.across(far, Vec3::NEG_Z) > 0.99, "across it");
        assert_eq!(views.across(Vec3::ZERO, Vec3::X), 1.0, "where eyes are");
        let nowhere = Views { cells: Vec::new(), ..views };
        assert_eq!((nowhere.facing(Vec3::ZERO, Vec3::Y), nowhere.across(Vec3::ZERO, Vec3::Y)), (1.0, 1.0));
    }

    #[test]
    fn a_right_angle_shows_twice_the_distance_in_all_rows() {
        let views = views();
        assert!((views.screen.pixel_m(384.0) - 1.0).abs() < 1e-6);
        assert!((views.pixel_m(Vec3::new(1.0, 1.0, 1.0), 3.84) - 0.01).abs() < 1e-8);
    }
}
