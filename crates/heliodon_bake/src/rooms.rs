//! Rooms: how far things are from them, and whether they lie in stone.

use crate::prepare::{stone_doubt, views};
use crate::scene::Scene;
use glam::Vec3;
use heliodon_bundle::site::{Room, Site};
use heliodon_prepare::purge::stone_share;
use heliodon_rays::TriangleScene;

/// Rooms so many times as far off as all parts together are across are not meant: from there the site is seen within six degrees.
const FAR: f32 = 10.0;

/// How far the boxes of a room and of something else, from its lower to its upper corner, lie apart, metres.
#[must_use]
pub(crate) fn distance_m(room: &Room, [low, high]: [Vec3; 2]) -> f32 {
    let (min, max) = (Vec3::from(room.min.map(|x| x as f32)), Vec3::from(room.max.map(|x| x as f32)));
    (min - high).max(low - max).max(Vec3::ZERO).length()
}

/// A sentence where no part is near any room: coordinates of parts are moved by the site's origin, those of rooms are not.
#[must_use]
pub fn doubt(site: &Site, scene: &Scene) -> Option<String> {
    let held = |[low, high]: [Vec3; 2], [a, b]: [Vec3; 2]| [low.min(a), high.max(b)];
    let empty = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    let boxes: Vec<[Vec3; 2]> = scene
        .parts
        .iter()
        .filter(|part| !part.vertices.is_empty())
        .map(|part| scene.mesh.positions[part.vertices.clone()].iter().map(|&p| [p, p]).fold(empty, held))
        .collect();
    let [low, high] = boxes.iter().copied().fold(empty, held);
    let across = low.distance(high);
    let distances = site.rooms.iter().flat_map(|room| boxes.iter().map(move |&part| distance_m(room, part)));
    let nearest = distances.reduce(f32::min)?;
    let remedy = if site.site.origin == [0.0; 3] {
        "look over min and max of [[room]], and unit and translate of [[part]]"
    } else {
        "[site] origin moves parts, lamps and actors, but not rooms: give their min and max as they are once it is subtracted"
    };
    (nearest > FAR * across).then(|| {
        format!("no part is near a room: the nearest is {nearest:.0} m off, and all are {across:.0} m across; {remedy}")
    })
}

/// A sentence for each room that lies in stone or reaches into it. The purge tells that itself, of geometry that has been cleaned.
#[must_use]
pub fn stone_doubts(site: &Site, rays: &TriangleScene) -> Vec<String> {
    let cells = views(site).cells;
    site.rooms.iter().zip(&cells).filter_map(|(room, cell)| stone_doubt(room, stone_share(rays, cell))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::PartRange;
    use heliodon_mesh::Mesh;

    /// Two parts, five metres across, by the origin; and what is told of them with some rooms.
    fn told(origin: &str, rooms: &[[f64; 3]]) -> Option<String> {
        let room = |[x, y, z]: &[f64; 3]| {
            format!(
                "[[room]]\nname = \"r\"\nmin = [{x:?}, {y:?}, {z:?}]\nmax = [{:?}, {:?}, {:?}]\n",
                x + 1.0,
                y + 1.0,
                z + 1.0
            )
        };
        let rooms: String = rooms.iter().map(room).collect();
        let text = format!(
            "[site]\nname = \"a\"\norigin = {origin}\n[[part]]\nfile = \"a.ply\"\n[[part]]\nfile = \"b.ply\"\n\
             [sky]\nprobes = \"a.hdr\"\nmapping = \"lat-long\"\n{rooms}"
        );
        let site = Site::parse(&text, "site.toml").unwrap();
        let part =
            |first: usize| PartRange { vertices: first..first + 2, triangles: 0..0, drawn: 0, files: 1, by_texels: false };
        let positions = vec![Vec3::ZERO, Vec3::ONE, Vec3::new(3.0, 0.0, 3.0), Vec3::new(4.0, 1.0, 3.0)];
        let mesh = Mesh { positions, ..Mesh::default() };
        let scene = Scene { mesh, parts: vec![part(0), part(2)], warnings: Vec::new(), original: None, prepared: None };
        doubt(&site, &scene)
    }

    #[test]
    fn rooms_that_did_not_move_with_the_site_are_told() {
        let survey = "[476000.0, 120.0, -4202000.0]";
        assert_eq!(told(survey, &[]), None);
        assert_eq!(told(survey, &[[2.0, 1.5, 8.0]]), None);
        assert_eq!(told(survey, &[[476_000.0, 120.0, -4_202_000.0], [-30.0, 1.5, 0.0]]), None, "one that is near is enough");
        let far = told(survey, &[[476_000.0, 120.0, -4_202_000.0]]).unwrap();
        assert!(far.contains("but not rooms"), "{far}");
        let plain = told("[0.0, 0.0, 0.0]", &[[0.0, 1.5, 900.0]]).unwrap();
        assert!(plain.contains("897 m off") && plain.contains("5 m across") && !plain.contains("origin"), "{plain}");
    }
}
