//! Simulated photographs of two blocks on a field: pictures with corners whose place is known, and marks at them.

use glam::{DVec2, DVec3};
use heliodon_image::SrgbImage;
use heliodon_photo::camera::{Camera, Intrinsics, Pose};
use std::fmt::Write;
use std::path::Path;

/// Two blocks, from their least to their greatest corner.
const BLOCKS: [(&str, [[f64; 3]; 2]); 2] =
    [("tower", [[-1.2, 0.0, -1.0], [0.8, 3.4, 1.0]]), ("house", [[1.4, 0.0, -1.6], [4.2, 1.6, 0.7]])];

/// The name of each corner, by its bits: x, y, z.
const CORNERS: [&str; 8] = ["nw", "ne", "nw-top", "ne-top", "sw", "se", "sw-top", "se-top"];

/// Photographs of a scene.
pub struct Scene {
    width: u32,
    height: u32,
    count: usize,
}

/// A corner of a block.
pub struct Corner {
    pub name: String,
    pub place: DVec3,
}

impl Scene {
    pub fn new(width: u32, count: usize) -> Self {
        Self { width, height: width * 3 / 4, count }
    }

    pub fn photo(number: usize) -> String {
        format!("photo-{}.png", number + 1)
    }

    pub fn camera(&self, number: usize) -> Camera {
        let turn = 0.36 * (number as f64 - 0.5 * (self.count as f64 - 1.0)) + 0.12;
        let eye = DVec3::new(11.0 * turn.sin() + 1.0, 2.2 + 0.7 * (number % 3) as f64, 11.0 * turn.cos());
        let pose = Pose::look_at(eye, DVec3::new(1.3, 1.2, 0.0)).expect("it does not stand there");
        let mut intrinsics = Intrinsics::pinhole(self.width, self.height, 1.15 * f64::from(self.width));
        intrinsics.radial[0] = -0.12;
        Camera { intrinsics, pose }
    }

    pub fn corners() -> Vec<Corner> {
        let of = |(block, [least, most]): &(&str, [[f64; 3]; 2])| {
            let place = |i: usize| DVec3::from([0, 1, 2].map(|axis| if i >> axis & 1 == 1 { most[axis] } else { least[axis] }));
            CORNERS
                .iter()
                .enumerate()
                .map(|(i, name)| Corner { name: format!("{block}-{name}"), place: place(i) })
                .collect::<Vec<_>>()
        };
        BLOCKS.iter().flat_map(of).collect()
    }

    /// Where a corner is in a photograph, where that shows it.
    pub fn shows(&self, number: usize, corner: &Corner) -> Option<DVec2> {
        let camera = self.camera(number);
        let pixel = camera.project(corner.place)?;
        let (origin, direction) = camera.ray(pixel);
        let is_in = pixel.cmpge(DVec2::splat(12.0)).all()
            && pixel.x < f64::from(self.width) - 12.0
            && pixel.y < f64::from(self.height) - 12.0;
        let distance = origin.distance(corner.place);
        let hidden =
            BLOCKS.iter().filter_map(|(_, block)| entered(block, origin, direction)).any(|(at, ..)| at < distance - 1e-6);
        (is_in && !hidden).then_some(pixel)
    }

    /// Writes the photographs into a folder.
    pub fn write_photographs(&self, folder: &Path) {
        for number in 0..self.count {
            let camera = self.camera(number);
            let pixel = |i: u32| {
                let corner = DVec2::new(f64::from(i % self.width), f64::from(i / self.width));
                let samples = [[0.125, 0.375], [0.375, 0.875], [0.625, 0.125], [0.875, 0.625]];
                let sum: DVec3 = samples.iter().map(|s| colour(&camera, corner + DVec2::from(*s))).sum();
                let [r, g, b] = (sum / 4.0 * 255.0).to_array().map(|v| v.round().clamp(0.0, 255.0) as u8);
                [r, g, b, 255]
            };
            let pixels = (0..self.width * self.height).map(pixel).collect();
            let image = SrgbImage { width: self.width, height: self.height, pixels };
            image.write_png(folder.join(Self::photo(number))).expect("the folder can be written to");
        }
    }

    /// Writes a project in which all corners that two photographs show are marked, but for those that `leaves` names with their photograph; one mark is
    /// wrong where `wrong` says so.
    pub fn write_project(&self, folder: &Path, leaves: impl Fn(&str, usize) -> bool, wrong: Option<(&str, usize)>) {
        let mut text = String::from("# made by a program; nothing here was photographed\n[project]\nname = \"Two blocks\"\n");
        let mut line = |words: String| writeln!(text, "{words}").expect("a string takes all");
        for number in 0..self.count {
            line(format!("\n[[photo]]\nfile = \"{}\"\nlens = \"the one\"", Self::photo(number)));
        }
        line("\n[[lens]]\nname = \"the one\"\nfocal = \"free\"".to_owned());
        for corner in Self::corners() {
            let marks: Vec<(usize, DVec2)> = (0..self.count)
                .filter(|number| !leaves(&corner.name, *number))
                .filter_map(|number| Some((number, self.shows(number, &corner)?)))
                .collect();
            if marks.len() < 2 {
                continue;
            }
            line(format!("\n[[point]]\nname = \"{}\"\n[point.marks]", corner.name));
            for (number, pixel) in marks {
                let off = if wrong == Some((corner.name.as_str(), number)) { 37.0 } else { 0.0 };
                line(format!("\"{}\" = [{:.2}, {:.2}]", Self::photo(number), pixel.x + off, pixel.y - 0.4 * off));
            }
        }
        line("\n[[distance]]   # by tape\nbetween = [\"tower-sw\", \"tower-sw-top\"]\nmetres = 3.4".to_owned());
        let box_of = |block: &str| {
            let names = ["sw", "se", "ne", "nw", "sw-top", "se-top", "ne-top", "nw-top"];
            let is_marked = |name: &&str| {
                Self::corners().iter().any(|corner| {
                    let shown = |number: &usize| !leaves(&corner.name, *number) && self.shows(*number, corner).is_some();
                    corner.name == format!("{block}-{name}") && (0..self.count).filter(shown).count() >= 2
                })
            };
            names.map(|name| if is_marked(&name) { format!("\"{block}-{name}\"") } else { "\"-\"".to_owned() }).join(", ")
        };
        line(format!("\n[[shape]]\nname = \"tower\"\nkind = \"box\"\npoints = [{}]\nwatertight = true", box_of("tower")));
        std::fs::write(folder.join("photos.toml"), text).expect("the folder can be written to");
    }
}

/// Where a ray enters a block: the distance, the place and the axis of the face.
fn entered([least, most]: &[[f64; 3]; 2], origin: DVec3, direction: DVec3) -> Option<(f64, DVec3, usize)> {
    let (mut near, mut far, mut face) = (0.0, f64::INFINITY, None);
    for axis in 0..3 {
        let (a, b) = ((least[axis] - origin[axis]) / direction[axis], (most[axis] - origin[axis]) / direction[axis]);
        if a.min(b) > near {
            (near, face) = (a.min(b), Some(axis));
        }
        far = a.max(b).min(far);
    }
    face.filter(|_| near < far).map(|face| (near, origin + direction * near, face))
}

/// A number from 0 to 1 for a place of a grid.
fn dice(x: i64, y: i64, z: i64) -> f64 {
    let mut hash = (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
        ^ (z as u64).wrapping_mul(0x1656_67B1_9E37_79F9);
    hash ^= hash >> 29;
    hash = hash.wrapping_mul(0xBF58_476D_1CE4_E5B9);
    (hash >> 40) as f64 / (1u64 << 24) as f64
}

/// What is seen along a pixel: stones in courses, a field, a sky.
fn colour(camera: &Camera, pixel: DVec2) -> DVec3 {
    let (origin, direction) = camera.ray(pixel);
    let hits = BLOCKS.iter().enumerate().filter_map(|(i, (_, block))| entered(block, origin, direction).map(|hit| (i, hit)));
    if let Some((block, (_, place, axis))) = hits.min_by(|a, b| a.1.0.total_cmp(&b.1.0)) {
        let light = [0.62, 0.95, 0.8][axis];
        let along = if axis == 0 { place.z } else { place.x };
        let row = (place.y / 0.34).floor();
        let stone = (along / 0.62 + 0.5 * (row as i64 % 2) as f64).floor();
        let tone = if axis == 1 { 0.9 } else { 0.78 + 0.22 * dice(stone as i64, row as i64, axis as i64 + 3 * block as i64) };
        let base = [DVec3::new(0.93, 0.86, 0.72), DVec3::new(0.80, 0.62, 0.5)][block];
        return base * (light * tone);
    }
    if direction.y < -1e-6 {
        let place = origin + direction * (-origin.y / direction.y);
        let tone = 0.85 + 0.15 * dice((place.x / 0.8).floor() as i64, 0, (place.z / 0.8).floor() as i64);
        return DVec3::new(0.36, 0.43, 0.27) * tone;
    }
    DVec3::new(0.55, 0.68, 0.86).lerp(DVec3::new(0.30, 0.46, 0.74), direction.y.clamp(0.0, 1.0))
}
