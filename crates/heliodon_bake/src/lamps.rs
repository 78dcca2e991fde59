//! Lamps that light nothing where they stand.

use glam::{DVec3, Vec3};
use heliodon_bundle::site::Site;
use heliodon_math::sphere::fibonacci_sphere;
use heliodon_rays::{Hit, Ray, TriangleScene};

/// Directions in which a place is asked whether it lies inside of something: none may deny it, for a lamp in an open shade is well
/// placed.
const LOOKS: u32 = 64;

/// Surfaces lie on one another, such as a column's foot on the ground, if one is farther by less than this part of the distance: far
/// more than distances are rounded by, and less than a wall is thick.
const ON_ONE_ANOTHER: f32 = 1e-4;

/// Whether a place lies inside of something closed. A direction tells so if it first leaves something by the back, or leaves more than
/// it enters all the way: a column is left before the ground below it and the room around it are met. It tells nothing where a back and
/// a front lie on one another, as of walls that have both, and denies it else.
#[must_use]
pub fn is_enclosed(place: Vec3, rays: &TriangleScene) -> bool {
    let ray = |direction| Ray { origin: place, direction, t_min: 0.0, t_max: f32::INFINITY };
    let looks: Vec<Ray> = fibonacci_sphere(LOOKS).into_iter().map(ray).collect();
    let mut hits = vec![Hit::MISS; looks.len()];
    rays.closest(&looks, &mut hits);
    let to_first = |(look, hit): (&Ray, &Hit)| Ray { t_max: hit.t * (1.0 + ON_ONE_ANOTHER), ..*look };
    let firsts: Vec<Ray> = looks.iter().zip(&hits).map(to_first).collect();
    let (mut first, mut all) = (vec![0; looks.len()], vec![0; looks.len()]);
    rays.enclosures(&firsts, &mut first);
    rays.enclosures(&looks, &mut all);
    let tells = |i: &usize| first[*i].max(all[*i]) > 0;
    let denies = |i: usize| !tells(&i) && (first[i] < 0 || !hits[i].is_some());
    !(0..looks.len()).any(denies) && 2 * (0..looks.len()).filter(tells).count() > looks.len()
}

/// What is wrong with a lamp that [`is_enclosed`].
#[must_use]
pub fn doubt(name: &str) -> String {
    format!("light {name} lies inside of something closed, and lights nothing outside of it: move its place")
}

/// A line for each lamp of `[[light]]` that lies inside of something closed; one without a name is told by its number, from 1.
#[must_use]
pub fn doubts(site: &Site, rays: &TriangleScene) -> Vec<String> {
    let origin = DVec3::from(site.site.origin);
    let enclosed =
        site.lamps.iter().enumerate().filter(|(_, lamp)| is_enclosed((DVec3::from(lamp.place) - origin).as_vec3(), rays));
    enclosed.map(|(index, lamp)| doubt(lamp.name.as_deref().unwrap_or(&(index + 1).to_string()))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_rays::BuildParams;
    use heliodon_testkit::scenes::{Scene, cuboid, ground};

    fn is_told(scene: &Scene, place: Vec3) -> bool {
        is_enclosed(place, &TriangleScene::build(&scene.positions, &scene.triangles, &BuildParams::default()).unwrap())
    }

    /// A closed column whose foot lies at the origin.
    fn column() -> Scene {
        cuboid(Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 3.0, 0.5), 1)
    }

    /// A room as it is seen from inside.
    fn shell() -> Scene {
        cuboid(Vec3::new(-4.0, -0.2, -4.0), Vec3::new(4.0, 5.0, 4.0), 1).inside_out()
    }

    const IN_COLUMN: Vec3 = Vec3::new(0.11, 1.3, 0.07);
    const BESIDE: Vec3 = Vec3::new(1.6, 1.3, 0.9);

    #[test]
    fn a_lamp_in_a_column_is_told_over_ground_and_in_a_room() {
        let below = ground(40.0, 3).moved(Vec3::new(0.3, -0.2, 0.1));
        let at_its_foot = ground(40.0, 3).moved(Vec3::new(0.3, 0.0, 0.1));
        let scenes = [
            column(),
            column().and(below),
            column().and(at_its_foot.clone()),
            at_its_foot.and(column()),
            column().and(shell()),
        ];
        for (number, scene) in scenes.iter().enumerate() {
            assert!(is_told(scene, IN_COLUMN), "{number}");
            assert!(!is_told(scene, BESIDE), "{number}");
        }
    }

    #[test]
    fn a_lamp_in_a_room_is_not_told_however_its_walls_are_modelled() {
        let thick = shell().and(cuboid(Vec3::new(-4.3, -0.5, -4.3), Vec3::new(4.3, 5.3, 4.3), 1));
        let twice = [shell().and(shell().inside_out()), shell().inside_out().and(shell())];
        for (number, room) in [shell(), thick].iter().chain(&twice).enumerate() {
            assert!(!is_told(room, BESIDE), "{number}");
        }
    }
}
