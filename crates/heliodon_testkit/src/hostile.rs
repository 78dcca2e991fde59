//! The hostile corpus: meshes that are wrong, or right in an unkind way.

pub mod files;

use crate::scenes::{Scene, ground};
use glam::Vec3;

/// A hostile mesh and its name.
#[derive(Clone, Debug)]
pub struct Hostile {
    /// What is wrong with it.
    pub name: &'static str,
    /// The mesh; indices are always in range and there is one normal for each vertex.
    pub scene: Scene,
}

/// All of the corpus; every importer and solver must live through it, without panic, and without a number that is not finite
/// in what it makes.
#[must_use]
pub fn meshes() -> Vec<Hostile> {
    let triangle =
        || Scene { positions: vec![Vec3::ZERO, Vec3::Z, Vec3::X], normals: vec![Vec3::Y; 3], triangles: vec![[0, 1, 2]] };
    let changed = |name, change: &dyn Fn(&mut Scene)| {
        let mut scene = ground(2.0, 4);
        change(&mut scene);
        Hostile { name, scene }
    };
    vec![
        Hostile { name: "empty", scene: Scene::default() },
        Hostile { name: "one triangle", scene: triangle() },
        changed("vertices without triangles", &|s| s.triangles.clear()),
        changed("a vertex that is not a number", &|s| s.positions[7] = Vec3::NAN),
        changed("all vertices not numbers", &|s| s.positions.fill(Vec3::NAN)),
        changed("an infinite vertex", &|s| s.positions[7] = Vec3::INFINITY),
        changed("a vertex almost at infinity", &|s| s.positions[7] = Vec3::splat(3.0e38)),
        changed("normals that are not numbers", &|s| s.normals.fill(Vec3::NAN)),
        changed("zero normals", &|s| s.normals.fill(Vec3::ZERO)),
        changed("normals turned inside", &|s| s.normals.iter_mut().for_each(|n| *n = -*n)),
        changed("long normals", &|s| s.normals.iter_mut().for_each(|n| *n *= 1.0e20)),
        changed("all vertices at one place", &|s| s.positions.fill(Vec3::ONE)),
        changed("all vertices on one line", &|s| s.positions.iter_mut().for_each(|p| *p = Vec3::X * p.x)),
        changed("triangles of one vertex", &|s| s.triangles.iter_mut().for_each(|t| *t = [t[0]; 3])),
        changed("every triangle a hundred times", &|s| s.triangles = s.triangles.repeat(100)),
        changed("non-manifold fans", &|s| s.triangles.iter_mut().for_each(|t| t[0] = 0)),
        changed("huge", &|s| s.positions.iter_mut().for_each(|p| *p *= 1.0e18)),
        changed("tiny", &|s| s.positions.iter_mut().for_each(|p| *p *= 1.0e-18)),
        changed("tiny beyond denormals", &|s| s.positions.iter_mut().for_each(|p| *p *= 1.0e-42)),
        changed("a kilometre away", &|s| s.positions.iter_mut().for_each(|p| *p += Vec3::new(1000.0, -1000.0, 1000.0))),
        changed("an earth's radius away", &|s| s.positions.iter_mut().for_each(|p| *p += Vec3::X * 6.371e6)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_and_normals_are_in_step() {
        for Hostile { name, scene } in meshes() {
            assert_eq!(scene.positions.len(), scene.normals.len(), "{name}");
            assert!(scene.triangles.iter().flatten().all(|&i| (i as usize) < scene.positions.len()), "{name}");
        }
    }
}
