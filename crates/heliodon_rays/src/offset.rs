//! How far from a surface a ray must start.

use crate::scene::TriangleScene;

impl TriangleScene {
    /// A distance (metres) along the normal at which a ray that starts off a surface does not meet that surface again
    /// by rounding alone. It bounds this engine's arithmetic, as pbrt's `OffsetRayOrigin` does its own, not the shape of the
    /// model: a scan's noise, or normals that are smoothed over a coarse mesh, may ask for more.
    ///
    /// Let u = 2^-24 and M the greatest coordinate (absolute, or from the centre). Each axis of `position + distance * normal`
    /// is rounded (u M), as is its difference to the scene's centre (u M) and its sheared coordinate (3 u M, of which
    /// the product takes 1 and the difference of values up to 2 M takes 2); the triangle's corners carry the last two. That
    /// is 9 u M an axis, at most 9 sqrt(3) < 16 u M along the normal. Interpolating the depth of a triangle of longest
    /// side S and height h adds up to 32 u S^2 / h, which stays below 16 u M while S^2 / h < M / 2: for all triangles but
    /// slivers as long as the scene. Together 32 u M: 2e-4 m in a scene of 100 m.
    pub fn start_offset(&self) -> f32 {
        let (low, high) = self.bounds().unwrap_or_default();
        let reach = low.abs().max(high.abs()).max_element().max(self.extent);
        (16.0 * f32::EPSILON * reach).max(f32::MIN_POSITIVE)
    }
}
