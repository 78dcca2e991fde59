//! The hierarchy of rays, kept while a bake goes on where it took long to build: whoever is killed need not build it again, nor does the next shard.

use crate::cache::Cache;
use crate::error::BakeError;
use crate::report::Reporter;
use crate::scene::Scene;
use heliodon_rays::{KeptTiles, TriangleScene};
use std::sync::atomic::{AtomicBool, Ordering};

/// A hierarchy is kept of so many triangles: building one of 300,000 takes 1.7 s of one processor, of 50 million half a minute of two.
const MANY: usize = 100_000;

/// What all blocks' names begin with.
const RAYS: &str = "rays-";
const TILES: &str = "rays-tiles";
/// Written last: with it, all is there.
const REST: &str = "rays-rest";
/// Whoever builds holds it.
const BUILDING: &str = "rays.lock";

/// The blocks of a hierarchy.
struct Blocks<'a> {
    cache: &'a Cache,
    /// Whether there was no room, say: what is not kept costs only time.
    full: AtomicBool,
}

impl Blocks<'_> {
    fn store(&self, stage: &str, block: usize, bytes: &[u8]) {
        if !self.full.load(Ordering::Relaxed) && self.cache.store(stage, block, bytes).is_err() {
            self.full.store(true, Ordering::Relaxed);
        }
    }
}

impl KeptTiles for Blocks<'_> {
    fn take(&self, tile: usize) -> Option<Vec<u8>> {
        self.cache.load(TILES, tile)
    }

    fn keep(&self, tile: usize, bytes: &[u8]) {
        self.store(TILES, tile, bytes);
    }

    fn take_rest(&self) -> Option<Vec<u8>> {
        self.cache.load(REST, 0)
    }

    fn keep_rest(&self, bytes: &[u8]) {
        self.store(REST, 0, bytes);
    }
}

/// The scene's rays ([`Scene::take_rays`]), or what of them an earlier run of the same bake has kept in `cache`. Of several shards one builds them.
///
/// # Errors
/// More geometry than the ray engine holds, and a cache that cannot be written.
pub(crate) fn kept_rays(scene: &mut Scene, cache: &Cache, reporter: &dyn Reporter) -> Result<TriangleScene, BakeError> {
    kept_where(scene, cache, MANY, reporter)
}

/// What is kept on disk of a hierarchy over so many triangles that takes so many bytes.
pub(crate) fn kept_bytes(triangles: u64, bytes: u64) -> u64 {
    if triangles >= MANY as u64 { bytes } else { 0 }
}

fn kept_where(scene: &mut Scene, cache: &Cache, many: usize, reporter: &dyn Reporter) -> Result<TriangleScene, BakeError> {
    let triangles = scene.original.as_ref().map_or(scene.mesh.triangles.len(), |original| original.triangles.len());
    if triangles < many {
        return scene.take_rays();
    }
    let blocks = Blocks { cache, full: AtomicBool::new(false) };
    let rays = match TriangleScene::restored(&blocks) {
        Some(rays) => rays,
        None => {
            let _building =
                cache.lock(BUILDING, || reporter.note("another shard builds the hierarchy of rays: waiting for it"))?;
            match TriangleScene::restored(&blocks) {
                Some(rays) => rays,
                None => return build(scene, &blocks),
            }
        }
    };
    scene.give_up_original();
    Ok(rays)
}

fn build(scene: &mut Scene, blocks: &Blocks) -> Result<TriangleScene, BakeError> {
    let rays = scene.build_rays(Some(blocks))?;
    if blocks.full.load(Ordering::Relaxed) {
        // half of it costs only room
        blocks.cache.remove_blocks(RAYS);
    }
    Ok(rays)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Silent;
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
        let rays = |mut scene: Scene, many: usize| kept_where(&mut scene, &cache, many, &Silent).unwrap();
        assert_eq!(above(&rays(scene(), 301), 7.5), 8);
        assert!(cache.stages_in(cache.folder(), RAYS).is_empty(), "they are few");
        assert_eq!(above(&rays(scene(), 300), 7.5), 8);
        // nothing is built: nothing is there to build from
        let nothing = || Scene { mesh: Mesh::default(), ..scene() };
        assert_eq!(above(&rays(nothing(), 0), 200.5), 201);
        let blocks = |stage: &str| {
            let mut stages = cache.stages_in(cache.folder(), RAYS).into_iter();
            stages.find(|(name, _)| name == stage).expect("kept").1
        };
        fs::write(blocks(TILES), "damaged").unwrap();
        assert_eq!(above(&rays(scene(), 0), 200.5), 201, "the tile is built again");
        assert_eq!(above(&rays(nothing(), 0), 200.5), 201, "and kept");
        fs::write(blocks(REST), "damaged").unwrap();
        assert_eq!(above(&rays(scene(), 0), 7.5), 8);
        fs::write(blocks(TILES), "damaged").unwrap();
        assert_eq!(rays(nothing(), 0).bounds(), None, "it was damaged");
    }
}
