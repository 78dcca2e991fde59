//! A mesh whose vertices a cache moves.

use super::pc2::PointCache;
use super::renewal::Renewal;
use super::{Clip, Pose};
use crate::Mesh;
use crate::import::{ImportError, Imported, Place, rounded};
use crate::place::Affine;
use glam::Vec3;
use std::path::Path;

/// The name of the clip that a cache makes.
pub(crate) const CLIP: &str = "cache";

/// Placed samples of the file's own vertices.
#[derive(Clone, Debug)]
pub(crate) struct Cache {
    points: usize,
    frames_per_sample: f32,
    frames_per_s: f32,
    positions: Vec<Vec3>,
    appended: Vec<u32>,
    renewal: Renewal,
}

impl Cache {
    /// Answers the cache and how many of its positions were not finite or out of reach; those stay at rest.
    pub fn new(
        cache: PointCache,
        frames_per_s: f32,
        imported: Imported,
        site_from_file: &Affine,
        file: &Path,
    ) -> Result<(Mesh, Self, u64), ImportError> {
        let own = imported.file_vertices();
        let Imported { mesh, appended } = imported;
        if cache.points != own {
            let problem = format!("has {} points, but the mesh has {own} vertices", cache.points);
            let remedy = "write mesh and cache from the same object, without modifiers between them, the mesh as OBJ or PLY";
            return Err(ImportError::new(file, Place::Byte(16), problem, remedy));
        }
        let PointCache { points, frames_per_sample, mut positions, .. } = cache;
        let mut bad = 0;
        for sample in positions.chunks_exact_mut(points) {
            for (p, rest) in sample.iter_mut().zip(&mesh.positions) {
                let placed = rounded(site_from_file.position(p.as_dvec3()));
                bad += u64::from(placed.is_nan());
                *p = if placed.is_nan() { *rest } else { placed };
            }
        }
        // Vertices that the file has twice at one place are a seam where they stay together, and two sheets where they part.
        let samples = positions.len() / points;
        let file_vertex = |v: usize| if v < own { v } else { appended[v - own] as usize };
        let together = |a: usize, b: usize| {
            let (a, b) = (file_vertex(a), file_vertex(b));
            [0, samples / 2, samples - 1].iter().all(|s| positions[s * points + a] == positions[s * points + b])
        };
        let renewal = Renewal::new(&mesh, together);
        Ok((mesh, Self { points, frames_per_sample, frames_per_s, positions, appended, renewal }, bad))
    }

    fn samples(&self) -> usize {
        self.positions.len() / self.points
    }

    pub fn clip(&self) -> Clip {
        let duration_s = (self.samples() - 1) as f32 * self.frames_per_sample / self.frames_per_s;
        Clip { name: CLIP.to_owned(), duration_s: if duration_s.is_finite() { duration_s } else { 0.0 } }
    }

    pub fn set_frames_per_s(&mut self, frames_per_s: f32) {
        self.frames_per_s = frames_per_s;
    }

    /// Which vertices share a normal.
    pub fn renewal(&self) -> &Renewal {
        &self.renewal
    }

    pub fn pose(&self, time_s: f32, rest: &Mesh, pose: &mut Pose) {
        self.place(time_s, &mut pose.positions);
        self.renewal.renew(rest, &pose.positions, &mut pose.normals);
    }

    /// Where the vertices are.
    pub fn place(&self, time_s: f32, positions: &mut Vec<Vec3>) {
        let last = self.samples() - 1;
        let at = (f64::from(time_s) * f64::from(self.frames_per_s) / f64::from(self.frames_per_sample)).clamp(0.0, last as f64);
        let (before, part) = (at as usize, at.fract() as f32);
        let sample = |k: usize| &self.positions[k * self.points..(k + 1) * self.points];
        positions.clear();
        let between = sample(before).iter().zip(sample((before + 1).min(last)));
        positions.extend(between.map(|(a, b)| *a + (*b - *a) * part));
        for &repeated in &self.appended {
            positions.push(positions[repeated as usize]);
        }
    }
}
