//! A view of all frames, drawn and averaged.

use super::fill::{Counted, fill};
use super::fit::{PosedFrame, Poses};
use super::{LEVELS, openness};
use glam::{Vec2, Vec3, Vec4};
use heliodon_bundle::impostor::ImpostorInfo;
use heliodon_mesh::Mesh;
use heliodon_mesh::albedo::MeshAlbedo;
use heliodon_raster::{Group, ItemBuffer, NOTHING, Perspective};

/// What is drawn of a view.
pub struct Viewed<'a> {
    /// The impostor.
    pub info: &'a ImpostorInfo,
    /// Right, up, and towards the view.
    pub axes: &'a [Vec3; 3],
    /// Left, bottom, right, top, metres.
    pub window: &'a [f32; 4],
    /// Samples along a texel's side.
    pub samples: u32,
}

/// A level of a view's two layers.
pub struct Level {
    /// Sides of a layer.
    pub size: [u32; 2],
    /// Its looks, and its shapes.
    pub texels: [Vec<[u8; 4]>; 2],
}

/// Albedo, and how open; normal, and depth: all times how much of a texel is covered.
type Sum = [Vec4; 2];

/// Triangles of a group, which share no vertices.
const GROUP: usize = 80;

/// Draws one frame, on a level of its own.
pub fn draw_one(mesh: &Mesh, albedo: &MeshAlbedo, poses: &Poses, frame: usize, viewed: &Viewed) -> Level {
    let size = viewed.info.frame_px;
    let texels = || vec![[0; 4]; size[0] as usize * size[1] as usize];
    let mut level = Level { size, texels: [texels(), texels()] };
    let samples = size.map(|side| (side * viewed.samples) as usize);
    let mut picture = ItemBuffer::new(samples[0], samples[1]);
    let seen = Seen::new(&poses.frames[frame], poses.center, viewed);
    seen.draw(mesh, &mut picture);
    let (mut sums, counts) = seen.average(mesh, albedo, &picture);
    let size = size.map(|side| side as usize);
    fill(Counted { size, numbers: &mut sums, counts: &counts });
    level.put(0, 1, size, &sums, &counts);
    level
}

/// Draws all frames.
pub fn draw(mesh: &Mesh, albedo: &MeshAlbedo, poses: &Poses, viewed: &Viewed) -> Vec<Level> {
    let layer_px = viewed.info.layer_px();
    let mut levels: Vec<Level> = (0..LEVELS)
        .map(|level| {
            let size = layer_px.map(|side| side >> level);
            let texels = || vec![[0; 4]; size[0] as usize * size[1] as usize];
            Level { size, texels: [texels(), texels()] }
        })
        .collect();
    let samples = viewed.info.frame_px.map(|side| (side * viewed.samples) as usize);
    let mut picture = ItemBuffer::new(samples[0], samples[1]);
    for (number, frame) in poses.frames.iter().enumerate() {
        picture.clear();
        let seen = Seen::new(frame, poses.center, viewed);
        seen.draw(mesh, &mut picture);
        let (mut sums, mut counts) = seen.average(mesh, albedo, &picture);
        let mut size = viewed.info.frame_px.map(|side| side as usize);
        for (k, level) in levels.iter_mut().enumerate() {
            if k > 0 {
                (sums, counts) = halve(&sums, &counts, size);
                size = size.map(|side| side / 2);
            }
            let mut filled = sums.clone();
            fill(Counted { size, numbers: &mut filled, counts: &counts });
            level.put(number as u32, viewed.info.grid[0], size, &filled, &counts);
        }
    }
    levels
}

/// Half as large, each texel the mean of four; sides are even.
fn halve(sums: &[Sum], counts: &[f32], [width, height]: [usize; 2]) -> (Vec<Sum>, Vec<f32>) {
    let half = [width / 2, height / 2];
    let at = |i: usize| {
        let first = i / half[0] * 2 * width + i % half[0] * 2;
        [first, first + 1, first + width, first + width + 1]
    };
    let sum = |i: usize| {
        at(i).map(|j| sums[j]).iter().fold([Vec4::ZERO; 2], |all, s| [all[0] + s[0], all[1] + s[1]]).map(|s| s * 0.25)
    };
    let count = |i: usize| at(i).map(|j| counts[j]).iter().sum::<f32>() * 0.25;
    let all = 0..half[0] * half[1];
    (all.clone().map(sum).collect(), all.map(count).collect())
}

impl Level {
    /// Writes a frame's texels to its place.
    fn put(&mut self, frame: u32, columns: u32, [width, height]: [usize; 2], filled: &[Sum], counts: &[f32]) {
        let [left, top] = [(frame % columns) as usize * width, (frame / columns) as usize * height];
        let code = |x: f32| (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        for (i, ([look, shape], count)) in filled.iter().zip(counts).enumerate() {
            let at = (top + i / width) * self.size[0] as usize + left + i % width;
            let [r, g, b] = look.truncate().max(Vec3::ZERO).to_array().map(|x| code(x.sqrt()));
            self.texels[0][at] = [r, g, b, code(*count)];
            let normal = shape.truncate().try_normalize().unwrap_or(Vec3::Z);
            let across = Vec2::new(normal.x, normal.y);
            // what looks away from the view is seen at its edge
            let across = if normal.z < 0.0 { across.try_normalize().unwrap_or(across) } else { across };
            let [x, y] = (across * 0.5 + 0.5).to_array().map(code);
            self.texels[1][at] = [x, y, code(look.w), code(shape.w * 0.5 + 0.5)];
        }
    }
}

/// A frame as a view sees it.
struct Seen<'a> {
    frame: &'a PosedFrame,
    viewed: &'a Viewed<'a>,
    /// In samples from the lower left, and how far towards the view, in radii.
    places: Vec<Vec3>,
}

impl<'a> Seen<'a> {
    fn new(frame: &'a PosedFrame, center: Vec3, viewed: &'a Viewed<'a>) -> Self {
        let [right, up, toward] = *viewed.axes;
        let [left, bottom, beyond, top] = *viewed.window;
        let [width, height] = viewed.info.frame_px.map(|side| (side * viewed.samples) as f32);
        let place = |&p: &Vec3| {
            let off = p - center;
            let x = (off.dot(right) - left) / (beyond - left) * width;
            let y = (off.dot(up) - bottom) / (top - bottom) * height;
            Vec3::new(x, y, off.dot(toward) / viewed.info.radius_m)
        };
        Self { frame, viewed, places: frame.positions.iter().map(place).collect() }
    }

    /// Draws the triangles' numbers. A parallel projection for who draws perspectives: places times their distance are seen in the same place from
    /// everywhere, and those that are nearer stay nearer.
    fn draw(&self, mesh: &Mesh, picture: &mut ItemBuffer) {
        // far enough that depths, which the picture takes for those of a perspective, bend by less than 1/200 radius within a triangle that is as large as the model
        const FAR: f32 = 64.0;
        let eye = Perspective { eye: Vec3::ZERO, axes: [Vec3::X, Vec3::Y, Vec3::NEG_Z], near_m: 0.5 * FAR };
        let half = self.viewed.info.frame_px.map(|side| (side * self.viewed.samples) as f32 * 0.5);
        let mut axes: [Vec<f32>; 3] = Default::default();
        let numbers: Vec<[u8; 3]> = (0..GROUP as u8).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        for (block, triangles) in mesh.triangles.chunks(GROUP).enumerate() {
            axes.iter_mut().for_each(Vec::clear);
            for place in triangles.iter().flatten().map(|&vertex| self.places[vertex as usize]) {
                let distance = FAR - place.z;
                axes[0].push((place.x / half[0] - 1.0) * distance);
                axes[1].push((place.y / half[1] - 1.0) * distance);
                axes[2].push(-distance);
            }
            let group = Group { points: axes.each_ref().map(Vec::as_slice), triangles: &numbers[..triangles.len()] };
            picture.draw(&eye, group, |number| (block * GROUP + number) as u32, |_| false);
        }
    }

    /// For each texel from the top left what its samples show, and how many of them show anything.
    fn average(&self, mesh: &Mesh, albedo: &MeshAlbedo, picture: &ItemBuffer) -> (Vec<Sum>, Vec<f32>) {
        let [width, height] = self.viewed.info.frame_px.map(|side| side as usize);
        let samples = self.viewed.samples as usize;
        let share = 1.0 / (samples * samples) as f32;
        let mut sums = vec![[Vec4::ZERO; 2]; width * height];
        let mut counts = vec![0.0; width * height];
        for (y, row) in picture.rows().enumerate() {
            let line = (height - 1 - y / samples) * width;
            for (x, &id) in row.iter().enumerate().filter(|(_, id)| **id != NOTHING) {
                let at = line + x / samples;
                let [look, shape] = self.sample(mesh, albedo, id, Vec2::new(x as f32, y as f32) + 0.5);
                sums[at][0] += look * share;
                sums[at][1] += shape * share;
                counts[at] += share;
            }
        }
        (sums, counts)
    }

    fn sample(&self, mesh: &Mesh, albedo: &MeshAlbedo, triangle: u32, at: Vec2) -> Sum {
        let corners = mesh.triangles[triangle as usize];
        let [a, b, c] = corners.map(|vertex| self.places[vertex as usize]);
        let (ab, ac, ap) = (b.truncate() - a.truncate(), c.truncate() - a.truncate(), at - a.truncate());
        let doubled = ab.perp_dot(ac);
        let share = if doubled == 0.0 { 0.0 } else { 1.0 / doubled };
        let v = (ap.perp_dot(ac) * share).clamp(0.0, 1.0);
        let w = (ab.perp_dot(ap) * share).clamp(0.0, 1.0 - v);
        let weights = Vec3::new(1.0 - v - w, v, w);
        let color = albedo.albedo(triangle, v, w);
        let open = openness::between(&self.frame.openness, corners, weights);
        let [n0, n1, n2] = corners.map(|vertex| self.frame.normals[vertex as usize]);
        let normal = n0 * weights.x + n1 * weights.y + n2 * weights.z;
        // backs are seen, too: their normals look the other way
        let normal = if doubled < 0.0 { -normal } else { normal };
        let [right, up, toward] = *self.viewed.axes;
        let normal = Vec3::new(normal.dot(right), normal.dot(up), normal.dot(toward)).try_normalize().unwrap_or(Vec3::Z);
        let depth = a.z * weights.x + b.z * weights.y + c.z * weights.z;
        [color.extend(open), normal.extend(depth)]
    }
}
