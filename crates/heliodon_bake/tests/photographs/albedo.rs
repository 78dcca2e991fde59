//! Stone's own colour from eight photographs of three hours.

use crate::render::{Stage, Stones, developed, hours, look, photographed};
use crate::temple;
use glam::Vec3;

#[test]
fn speed() {
    let parts = temple::truth();
    let stage = Stage::new(&parts);
    let stones = Stones(&stage);
    let hours = hours(&["09:00"]);
    for camera in temple::cameras(12, [480, 360]).iter().take(3).enumerate() {
        let start = std::time::Instant::now();
        let frame = photographed(&stage.surfaces(&stones), &hours[0], camera.1, 16, 0);
        println!("{:.2} s, {} triangles", start.elapsed().as_secs_f64(), stage.triangles.len());
        look(&format!("speed-{}.png", camera.0), &developed(&frame, Vec3::splat(1.0 / 30.0)));
    }
}
