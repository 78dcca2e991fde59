//! Which closed patches are bodies, which are hollows in them, and which are rooms or inside out.

use super::{Patch, Patches};
use glam::{DVec3, Vec3};
use heliodon_mesh::Mesh;
use heliodon_rays::{BuildParams, Ray, TriangleScene};

/// A closed patch whose volume is less than this part of its bounding box's diagonal cubed is a sheet with two sides, and has no inside.
/// A square metre of tin a tenth of a millimetre thick has 4e-5.
const LEAST_VOLUME: f64 = 1.0e-9;

/// Rays that ask whether a point lies inside: in no plane that anything built by people has, and odd in number.
pub(crate) const DIRECTIONS: [Vec3; 5] = [
    Vec3::new(0.4321, 0.7717, 0.4663),
    Vec3::new(-0.6373, 0.2917, 0.7133),
    Vec3::new(0.1931, -0.8839, 0.4259),
    Vec3::new(-0.3217, 0.6131, -0.7219),
    Vec3::new(0.7741, -0.2143, -0.5957),
];

/// What a patch is, wound as most of it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sense {
    /// It has rims.
    Open,
    /// No winding suits it.
    OneSided,
    /// Closed, but around nothing.
    Sheet,
    /// Closed and looks outwards.
    Body,
    /// Closed, looks inwards, and lies within bodies.
    Hollow,
    /// Closed, with an eye in what would be its material: seen from within.
    Room,
    /// Closed and looks inwards with no reason to.
    InsideOut,
}

/// Whether most of a patch is wound against its first triangle.
pub(crate) fn turned_mostly(patch: &Patch) -> bool {
    2 * u64::from(patch.turned) > u64::from(patch.triangles)
}

/// What each patch is.
pub(crate) fn senses(mesh: &Mesh, patches: &Patches, eyes: &[Vec3]) -> Vec<Sense> {
    let bounds = patches.closed_bounds(&mesh.positions, &mesh.triangles);
    let sense = |(patch, (low, high)): (&Patch, &(DVec3, DVec3))| {
        let outwards = (patch.volume_m3 > 0.0) != turned_mostly(patch);
        match patch {
            Patch { one_sided: true, .. } => Sense::OneSided,
            Patch { closed: false, .. } => Sense::Open,
            _ if patch.volume_m3.abs() <= LEAST_VOLUME * low.distance(*high).powi(3) => Sense::Sheet,
            _ if outwards => Sense::Body,
            _ => Sense::InsideOut,
        }
    };
    let mut senses: Vec<Sense> = patches.list.iter().zip(&bounds).map(sense).collect();
    find_hollows(mesh, patches, &bounds, &mut senses);
    for &eye in eyes {
        find_rooms(mesh, patches, &bounds, eye, &mut senses);
    }
    senses
}

fn holds((low, high): &(DVec3, DVec3), p: Vec3) -> bool {
    low.cmple(p.as_dvec3()).all() && high.cmpge(p.as_dvec3()).all()
}

/// Of what looks inwards, what lies within bodies, seen from the middle of its first triangle.
fn find_hollows(mesh: &Mesh, patches: &Patches, bounds: &[(DVec3, DVec3)], senses: &mut [Sense]) {
    let suspects: Vec<usize> = (0..senses.len()).filter(|&index| senses[index] == Sense::InsideOut).collect();
    let center = |suspect: &usize| mesh.corners(patches.list[*suspect].first as usize).iter().sum::<Vec3>() / 3.0;
    let points: Vec<Vec3> = suspects.iter().map(center).collect();
    let around: Vec<bool> = senses
        .iter()
        .zip(bounds)
        .map(|(&sense, bounds)| sense == Sense::Body && points.iter().any(|&p| holds(bounds, p)))
        .collect();
    if !around.contains(&true) {
        return;
    }
    let Some(scene) = scene(mesh, patches, |patch| around[patch]) else { return };
    for (suspect, within) in suspects.into_iter().zip(within(&scene, &points)) {
        if within * 2 > DIRECTIONS.len() {
            senses[suspect] = Sense::Hollow;
        }
    }
}

/// Some patches for rays, each as most of it is wound. None where rays cannot be asked: too many triangles.
pub(crate) fn scene(mesh: &Mesh, patches: &Patches, chosen: impl Fn(usize) -> bool) -> Option<TriangleScene> {
    let of_chosen = |t: usize| {
        let (patch, turned) = patches.of(t).filter(|&(patch, _)| chosen(patch))?;
        let [a, b, c] = mesh.triangles[t];
        Some(if turned == turned_mostly(&patches.list[patch]) { [a, b, c] } else { [a, c, b] })
    };
    let triangles: Vec<[u32; 3]> = (0..mesh.triangles.len()).filter_map(of_chosen).collect();
    TriangleScene::build(&mesh.positions, &triangles, &BuildParams::default()).ok()
}

/// For each point in how many of [`DIRECTIONS`] it lies within something.
pub(crate) fn within(scene: &TriangleScene, points: &[Vec3]) -> Vec<usize> {
    let ray = |&origin: &Vec3| DIRECTIONS.map(|direction| Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY });
    let rays: Vec<Ray> = points.iter().flat_map(ray).collect();
    let mut counts = vec![0; rays.len()];
    scene.enclosures(&rays, &mut counts);
    counts.chunks(DIRECTIONS.len()).map(|counts| counts.iter().filter(|&&count| count > 0).count()).collect()
}

/// An eye is in no material: bodies around it whose hollows are not around it as well are rooms, and so is what looks inwards around it.
fn find_rooms(mesh: &Mesh, patches: &Patches, bounds: &[(DVec3, DVec3)], eye: Vec3, senses: &mut [Sense]) {
    let near: Vec<bool> = bounds.iter().map(|bounds| holds(bounds, eye)).collect();
    if !near.contains(&true) {
        return;
    }
    let mut covered = vec![0.0_f64; near.len()];
    for t in 0..mesh.triangles.len() {
        if let Some((patch, turned)) = patches.of(t).filter(|&(patch, _)| near[patch]) {
            let angle = solid_angle(mesh.corners(t).map(|p| p.as_dvec3() - eye.as_dvec3()));
            covered[patch] += if turned == turned_mostly(&patches.list[patch]) { angle } else { -angle };
        }
    }
    // the whole sphere is 4 pi, seen from outside it is 0
    let around =
        |index: usize, sense: Sense, senses: &[Sense]| senses[index] == sense && covered[index].abs() > std::f64::consts::TAU;
    let all = || 0..covered.len();
    let bodies = all().filter(|&index| around(index, Sense::Body, senses)).count();
    let hollows = all().filter(|&index| around(index, Sense::Hollow, senses)).count();
    for index in all() {
        if around(index, Sense::InsideOut, senses) || (bodies > hollows && around(index, Sense::Body, senses)) {
            senses[index] = Sense::Room;
        }
    }
}

/// The solid angle under which a triangle is seen from the origin, in steradians, positive from its back.
///
/// A. van Oosterom, J. Strackee, "The Solid Angle of a Plane Triangle", IEEE Transactions on Biomedical Engineering 30(2), 1983, (8).
fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    2.0 * libm::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_octant_is_an_eighth_of_the_sphere() {
        let octant = solid_angle([DVec3::X, DVec3::Y * 7.0, DVec3::Z * 0.1]);
        assert!((octant - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert!((solid_angle([DVec3::Y, DVec3::X, DVec3::Z]) + octant).abs() < 1e-12);
    }
}
