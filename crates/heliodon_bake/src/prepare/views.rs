//! Where the site's visitors stand and what they look at.

use glam::{DVec3, Vec3};
use heliodon_bundle::site::Site;
use heliodon_prepare::{Screen, ViewCell, Views};

/// The rooms and the display of a site.
#[must_use]
pub fn views(site: &Site) -> Views {
    let point = |p: [f64; 3]| -> Vec3 { DVec3::from(p).as_vec3() };
    let cells = site.rooms.iter().map(|room| ViewCell {
        low: point(room.min),
        high: point(room.max),
        windows: room.windows.iter().map(|window| window.map(point)).collect(),
    });
    let display = &site.display;
    let screen =
        Screen { width_px: display.width_px, height_px: display.height_px, fov_rad: display.fov_deg.to_radians() as f32 };
    Views { cells: cells.collect(), screen }
}
