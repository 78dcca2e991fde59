//! The hierarchy of rays, kept while a bake goes on where it took long to build: whoever is killed need not build it again, nor does the next shard.

use crate::cache::Cache;
use crate::codec::{Decoder, Encoder};
use crate::error::BakeError;
use crate::report::Reporter;
use crate::scene::Scene;
use heliodon_mesh::export::token;
use heliodon_rays::TriangleScene;

/// A hierarchy is kept of so many triangles: building it takes 5 s, of 50 million half a minute.
const MANY: usize = 10_000_000;

/// The most bytes of a block.
const BLOCK_BYTES: usize = 1 << 26;

/// What all blocks' names begin with.
const RAYS: &str = "rays-";
/// Written last: with it, all is there. It names the others, which are those of one run: the answers of two hierarchies over the same triangles are the
/// same, their nodes need not be.
const REST: &str = "rays-rest";
/// Whoever builds holds it.
const BUILDING: &str = "rays.lock";

/// What the blocks of nodes and of triangles are called that a run with this token has kept.
fn names(token: u64) -> [String; 2] {
    ["nodes", "packets"].map(|what| format!("{RAYS}{token:016x}-{what}"))
}

/// The scene's rays ([`Scene::take_rays`]), or those that an earlier run of the same bake has kept in `cache`. Of several shards one builds them.
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
    let rays = match load(cache) {
        Some(rays) => rays,
        None => {
            let _building =
                cache.lock(BUILDING, || reporter.note("another shard builds the hierarchy of rays: waiting for it"))?;
            match load(cache) {
                Some(rays) => rays,
                None => return build(scene, cache),
            }
        }
    };
    scene.give_up_original();
    Ok(rays)
}

fn build(scene: &mut Scene, cache: &Cache) -> Result<TriangleScene, BakeError> {
    let rays = scene.take_rays()?;
    cache.remove_blocks(RAYS);
    if !store(cache, &rays) {
        // no room, say: what is not kept costs only time, and half of it only room
        cache.remove_blocks(RAYS);
    }
    Ok(rays)
}

fn store(cache: &Cache, rays: &TriangleScene) -> bool {
    let (stored, token) = (rays.stored(), token());
    let all = |stage: &str, bytes: &[u8]| {
        bytes.chunks(BLOCK_BYTES).enumerate().all(|(block, bytes)| cache.store(stage, block, bytes).is_ok())
    };
    let [nodes, packets] = names(token);
    let mut rest = Encoder::default();
    rest.number(token).run(&stored.rest);
    all(&nodes, stored.nodes) && all(&packets, stored.packets) && cache.store(REST, 0, &rest.finish()).is_ok()
}

fn load(cache: &Cache) -> Option<TriangleScene> {
    let rest = cache.load(REST, 0)?;
    let mut rest = Decoder::new(&rest);
    let [nodes, packets] = names(rest.number()?);
    let all = |stage: &str, into: &mut [u8]| {
        into.chunks_mut(BLOCK_BYTES).enumerate().all(|(block, into)| {
            let bytes = cache.load(stage, block).filter(|bytes| bytes.len() == into.len());
            bytes.inspect(|bytes| into.copy_from_slice(bytes)).is_some()
        })
    };
    TriangleScene::restored(&rest.run::<u8>()?, |into| all(&nodes, into), |into| all(&packets, into))
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
        let packets = || {
            let mut stages = cache.stages_in(cache.folder(), RAYS).into_iter();
            stages.find(|(stage, _)| stage.ends_with("-packets")).expect("kept").1
        };
        let before = packets();
        fs::write(&before, "damaged").unwrap();
        assert_eq!(above(&rays(scene(), 0), 200.5), 201);
        assert!(packets() != before && !before.exists(), "those of two runs are not mixed");
        fs::write(packets(), "damaged").unwrap();
        assert_eq!(rays(nothing(), 0).bounds(), None, "it was damaged");
    }
}
