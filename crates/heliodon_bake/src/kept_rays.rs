//! The hierarchy of rays, kept while a bake goes on where it took long to build: whoever is killed need not build it again, nor does the next shard.

use crate::cache::Cache;
use crate::error::BakeError;
use crate::scene::Scene;
use heliodon_rays::TriangleScene;

/// A hierarchy is kept of so many triangles: building it takes 5 s, of 50 million half a minute.
const MANY: usize = 10_000_000;

/// The most bytes of a block.
const BLOCK_BYTES: usize = 1 << 26;

/// What the blocks of all of it are called, before what they hold.
const RAYS: &str = "rays-";
const NODES: &str = "rays-nodes";
const PACKETS: &str = "rays-packets";
/// Written last: with it, all is there.
const REST: &str = "rays-rest";

/// The scene's rays ([`Scene::take_rays`]), or those that an earlier run of the same bake has kept in `cache`.
///
/// # Errors
/// More geometry than the ray engine holds.
pub(crate) fn kept_rays(scene: &mut Scene, cache: &Cache) -> Result<TriangleScene, BakeError> {
    kept_where(scene, cache, MANY)
}

/// What is kept on disk of a hierarchy over so many triangles that takes so many bytes.
pub(crate) fn kept_bytes(triangles: u64, bytes: u64) -> u64 {
    if triangles >= MANY as u64 { bytes } else { 0 }
}

fn kept_where(scene: &mut Scene, cache: &Cache, many: usize) -> Result<TriangleScene, BakeError> {
    if let Some(rays) = load(cache) {
        scene.give_up_original();
        return Ok(rays);
    }
    let triangles = scene.original.as_ref().map_or(scene.mesh.triangles.len(), |original| original.triangles.len());
    let rays = scene.take_rays()?;
    if triangles >= many && !store(cache, &rays) {
        // no room, say: what is not kept costs only time, and half of it only room
        cache.remove_blocks(RAYS);
    }
    Ok(rays)
}

fn store(cache: &Cache, rays: &TriangleScene) -> bool {
    let stored = rays.stored();
    let all = |stage: &str, bytes: &[u8]| {
        bytes.chunks(BLOCK_BYTES).enumerate().all(|(block, bytes)| cache.store(stage, block, bytes).is_ok())
    };
    all(NODES, stored.nodes) && all(PACKETS, stored.packets) && cache.store(REST, 0, &stored.rest).is_ok()
}

fn load(cache: &Cache) -> Option<TriangleScene> {
    if !cache.has(REST, 0) {
        return None;
    }
    let all = |stage: &str, into: &mut [u8]| {
        into.chunks_mut(BLOCK_BYTES).enumerate().all(|(block, into)| {
            let bytes = cache.load(stage, block).filter(|bytes| bytes.len() == into.len());
            bytes.inspect(|bytes| into.copy_from_slice(bytes)).is_some()
        })
    };
    TriangleScene::restored(&cache.load(REST, 0)?, |into| all(NODES, into), |into| all(PACKETS, into))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use heliodon_mesh::Mesh;
    use heliodon_rays::{Hit, Ray};
    use std::fs;
    use std::path::Path;

    /// A fan of triangles over the origin, each higher than the one before.
    fn scene() -> Scene {
        let count = 300;
        let corner = |t: u32, angle: f32| Vec3::new(angle.cos(), t as f32, angle.sin());
        let positions = (0..count).flat_map(|t| [corner(t, 0.0), corner(t, 2.0), corner(t, 4.0)]).collect();
        let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let mesh = Mesh { positions, triangles, ..Mesh::default() };
        Scene { mesh, parts: Vec::new(), warnings: Vec::new(), original: None, prepared: None }
    }

    fn above(rays: &TriangleScene, height: f32) -> u32 {
        let mut hits = [Hit::MISS];
        let ray = Ray { origin: Vec3::Y * height, direction: Vec3::Y, t_min: 0.0, t_max: f32::INFINITY };
        rays.closest(&[ray], &mut hits);
        hits[0].triangle
    }

    #[test]
    fn what_is_kept_is_taken_and_what_is_damaged_built() {
        let root = tempfile::tempdir().unwrap();
        let cache = Cache::open(root.path(), "key", Path::new("bundle")).unwrap();
        assert_eq!(above(&kept_rays(&mut scene(), &cache).unwrap(), 7.5), 8);
        assert!(!cache.has(REST, 0), "it took no time");
        assert_eq!(above(&kept_where(&mut scene(), &cache, 300).unwrap(), 7.5), 8);
        assert!(cache.has(REST, 0) && cache.has(NODES, 0) && cache.has(PACKETS, 0));
        // nothing is built: nothing is there to build from
        let nothing = || Scene { mesh: Mesh::default(), ..scene() };
        assert_eq!(above(&kept_rays(&mut nothing(), &cache).unwrap(), 200.5), 201);
        fs::write(cache.folder().join("rays-packets-00000"), "damaged").unwrap();
        assert_eq!(above(&kept_rays(&mut scene(), &cache).unwrap(), 200.5), 201);
        assert_eq!(kept_rays(&mut nothing(), &cache).unwrap().bounds(), None, "it was damaged");
    }
}
