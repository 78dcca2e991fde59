//! Which part of a photograph a pane shows, and how large.

use eframe::egui::{Pos2, Rect};
use glam::DVec2;

/// Pixels of the screen that one of the photograph is shown by, at most and at least.
const MOST_ZOOM: f64 = 64.0;
const LEAST_ZOOM: f64 = 1.0 / 256.0;

/// A view of a photograph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// What is in the middle, pixels of the photograph.
    pub centre: DVec2,
    /// Pixels of the screen for one of the photograph.
    pub zoom: f64,
    /// Pixels of the screen for one point of the window system.
    pub scale: f64,
    /// Where on the window it is.
    pub rect: Rect,
}

impl View {
    /// All of a photograph.
    #[must_use]
    pub fn whole(rect: Rect, scale: f64, size: DVec2) -> Self {
        let room = DVec2::new(f64::from(rect.width()), f64::from(rect.height())) * scale;
        let zoom = (room / size.max(DVec2::ONE)).min_element().clamp(LEAST_ZOOM, MOST_ZOOM);
        Self { centre: size / 2.0, zoom, scale, rect }
    }

    fn points_per_pixel(&self) -> f64 {
        self.zoom / self.scale
    }

    /// Where a pixel is on the window.
    #[must_use]
    pub fn to_window(&self, pixel: DVec2) -> Pos2 {
        let from_middle = (pixel - self.centre) * self.points_per_pixel();
        let middle = self.rect.center();
        // In f64 up to here: a photograph of 60,000 columns at 64 times is too far for f32.
        Pos2::new((f64::from(middle.x) + from_middle.x) as f32, (f64::from(middle.y) + from_middle.y) as f32)
    }

    /// Which pixel is at a place of the window.
    #[must_use]
    pub fn to_pixel(&self, at: Pos2) -> DVec2 {
        let from_middle = at - self.rect.center();
        self.centre + DVec2::new(f64::from(from_middle.x), f64::from(from_middle.y)) / self.points_per_pixel()
    }

    /// A length on the window in pixels of the photograph.
    #[must_use]
    pub fn pixels(&self, points: f64) -> f64 {
        points / self.points_per_pixel()
    }

    /// Zooms; what is at a place of the window stays there.
    pub fn zoom_about(&mut self, at: Pos2, factor: f64) {
        let held = self.to_pixel(at);
        self.zoom = (self.zoom * factor).clamp(LEAST_ZOOM, MOST_ZOOM);
        self.centre += held - self.to_pixel(at);
    }

    /// Moves what is shown by a way on the window.
    pub fn pan(&mut self, x: f32, y: f32) {
        self.centre -= DVec2::new(f64::from(x), f64::from(y)) / self.points_per_pixel();
    }

    /// Keeps the middle in the photograph.
    pub fn hold(&mut self, size: DVec2) {
        self.centre = if self.centre.is_finite() { self.centre.clamp(DVec2::ZERO, size) } else { size / 2.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pixel_under_the_pointer_stays_there() {
        let rect = Rect::from_min_max(Pos2::new(100.0, 50.0), Pos2::new(700.0, 450.0));
        let mut view = View::whole(rect, 1.5, DVec2::new(6000.0, 4000.0));
        assert!((view.zoom - 0.15).abs() < 1e-9);
        assert!((view.to_window(DVec2::ZERO) - Pos2::new(100.0, 50.0)).length() < 1e-3);
        let at = Pos2::new(233.0, 301.0);
        let pixel = view.to_pixel(at);
        for factor in [1.3, 7.0, 1e9, 1e-3, 1e-9, 4.0] {
            view.zoom_about(at, factor);
            assert!(view.to_pixel(at).distance(pixel) < 1e-6 * 6000.0 / view.zoom.min(1.0));
            assert!((LEAST_ZOOM..=MOST_ZOOM).contains(&view.zoom));
        }
        view.pan(10.0, 0.0);
        assert!((view.to_window(pixel) - at).length() > 9.9);
        view.centre = DVec2::NAN;
        view.hold(DVec2::new(6000.0, 4000.0));
        assert_eq!(view.centre, DVec2::new(3000.0, 2000.0));
    }
}
