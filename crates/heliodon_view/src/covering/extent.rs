//! How large what is covered is, and what its own colour is.

use super::gpu::luminance;
use super::uniform::Extent;
use crate::actors::Actors;
use crate::actors::render::ActorsFrame;
use crate::stage::Stage;
use glam::{Affine3A, UVec3, Vec3};
use heliodon_bundle::BundleReader;

/// Who knows how large things are.
pub(super) struct Extents<'a> {
    pub(super) stage: &'a Stage,
    pub(super) bundle: &'a BundleReader,
    pub(super) actors: &'a Actors,
    pub(super) looks: &'a ActorsFrame,
}

impl Extents<'_> {
    pub(super) fn is_part(&self, name: &str) -> bool {
        self.bundle.manifest().parts.iter().any(|part| part.name == name)
    }

    /// Of all parts of a name.
    pub(super) fn part(&self, name: &str) -> Extent {
        let parts = &self.bundle.manifest().parts;
        let is_its =
            |number: &usize| parts.get(usize::from(self.bundle.chunk_info(*number).part)).is_some_and(|part| part.name == name);
        let its: Vec<usize> = (0..self.bundle.chunk_count()).filter(is_its).collect();
        let bounds = its.iter().map(|&number| self.bundle.chunk_info(number).bounds);
        let bounds = bounds.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), bounds| {
            (low.min(Vec3::from(bounds.min)), high.max(Vec3::from(bounds.max)))
        });
        let roots = its.iter().filter_map(|&number| self.stage.ground().chunks().get(number)).flat_map(|chunk| &chunk.albedo);
        let whole = Extent::default();
        let bounds = if bounds.0.cmple(bounds.1).all() { bounds } else { whole.bounds };
        Extent { bounds, mean: mean_luminance(roots).unwrap_or(whole.mean), ..whole }
    }

    /// Of an actor that is on the stage.
    pub(super) fn actor(&self, name: &str) -> Option<Extent> {
        let (stands, bounds) = self.actors.whereabouts(name)?;
        let look = self.actors.number(name).and_then(|number| self.looks.looks.get(number))?;
        let local_from_world = stands.inverse();
        let mean = mean_luminance(look.albedo.iter()).unwrap_or(Extent::default().mean);
        Some(Extent { local_from_world, bounds: boxed(local_from_world, bounds), mean })
    }
}

/// The mean luminance of albedo as it lies on the GPU.
fn mean_luminance<'a>(roots: impl Iterator<Item = &'a u32>) -> Option<f32> {
    let (mut sum, mut count) = (0.0_f64, 0_u64);
    for &word in roots {
        let root = (UVec3::new(word, word >> 10, word >> 20) & 1023).as_vec3() / 1023.0;
        sum += f64::from(luminance(root * root));
        count += 1;
    }
    (count > 0).then(|| (sum / count as f64) as f32)
}

/// The box around a box that was moved.
pub(super) fn boxed(to: Affine3A, (low, high): (Vec3, Vec3)) -> (Vec3, Vec3) {
    let corners = (0..8).map(|i| Vec3::select(glam::BVec3::new(i & 1 == 1, i & 2 == 2, i & 4 == 4), high, low));
    corners
        .map(|corner| to.transform_point3(corner))
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), corner| (low.min(corner), high.max(corner)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::daylight::layout::albedo_roots;

    #[test]
    fn mean_luminance_is_that_of_the_albedo() {
        let roots = [Vec3::ONE, Vec3::ZERO, Vec3::splat(0.25)].map(albedo_roots);
        let mean = mean_luminance(roots.iter()).unwrap();
        assert!((mean - 1.25 / 3.0).abs() < 2e-3, "{mean}");
        assert_eq!(mean_luminance([].iter()), None);
    }

    #[test]
    fn a_box_that_was_moved_is_within_its_box() {
        let to = Affine3A::from_rotation_y(std::f32::consts::FRAC_PI_4);
        let (low, high) = boxed(to, (Vec3::NEG_ONE, Vec3::ONE));
        let wide = 2f32.sqrt();
        assert!(low.abs_diff_eq(Vec3::new(-wide, -1.0, -wide), 1e-5) && high.abs_diff_eq(Vec3::new(wide, 1.0, wide), 1e-5));
    }
}
