//! The scene as the solver knows it: where each texel looks from, and which texel a ray has met.

use super::Scene;
use crate::refine::Place;
use crate::texels::{Texel, cell};
use crate::walls::ABOVE;
use glam::{Vec2, Vec3};
use heliodon_math::frame::unit_or;
use heliodon_rays::{Hit, Ray};
use rayon::prelude::*;

const NOBODY: u32 = u32::MAX;

/// Places nearer to a side of their triangle than so many starting distances are moved in by as much: a ray that starts in the very plane of the wall that rises
/// from there would have both sides of it.
const INWARD: f32 = 4.0;
/// Texels so far around one with a wall on it may stand for a place of it, and so many are asked whether they see it.
const AROUND: i32 = 2;
const ASKED: usize = 4;

pub(super) struct Stage<'a> {
    pub scene: &'a Scene<'a>,
    pub places: Vec<Place>,
    /// The normal of the plane of each texel's triangle.
    pub planes: Vec<Vec3>,
    /// Where its rays start.
    pub origins: Vec<Vec3>,
    pub offset_m: f32,
    /// Texels that stand for both sides of a wall; none where empty.
    pub parted: Vec<bool>,
    /// Which texels stand for one place, so that they can be asked for its light: valid, and no wall on them. All where empty.
    pub whole: Vec<bool>,
    texel_at: Vec<u32>,
    /// Where each triangle that has texels lies in the texture.
    charted: Vec<Charted>,
}

/// Where a triangle lies in the texture, texels: its first corner, the ways from there to the others, and which sheet.
struct Charted {
    first: Vec2,
    ways: [Vec2; 2],
    sheet: u16,
}

/// What a ray has met.
pub(super) enum Met {
    /// A front that has a texel.
    Texel(u32),
    /// A back, a triangle without texels, or a texel that has light of both sides of a wall.
    Other,
}

/// Where a path goes on, what it faces there, and what is handed on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Onward {
    pub origin: Vec3,
    pub normal: Vec3,
    pub albedo: Vec3,
}

/// Whether a direction is above both a surface and what it is shaded as.
pub(super) fn faces(normal: Vec3, plane: Vec3, direction: Vec3) -> bool {
    normal.dot(direction) > 0.0 && plane.dot(direction) > 0.0
}

impl<'a> Stage<'a> {
    /// And what each texel hands on of the light that it has.
    pub fn new(scene: &'a Scene<'a>, offset_m: f32) -> (Self, Vec<Vec3>) {
        let [width, height] = scene.sides;
        let sheets = scene.unwrapped.packing.sheets as usize;
        let mut texel_at = vec![NOBODY; width as usize * height as usize * sheets];
        for (index, texel) in scene.texels.iter().enumerate() {
            texel_at[cell(scene.sides, texel.sheet, u32::from(texel.x), u32::from(texel.y))] = index as u32;
        }
        let of_texel = |texel: &Texel| {
            let corners = scene.corners(texel.triangle);
            let plane = unit_or((corners[1] - corners[0]).cross(corners[2] - corners[0]), Vec3::ZERO);
            let shading = texel.mix(scene.triangles[texel.triangle as usize].map(|v| scene.normals[v as usize]));
            let normal = unit_or(shading, unit_or(plane, Vec3::Y));
            let plane = unit_or(plane, normal);
            let position = texel.mix(corners);
            let origin = inward(corners, position, INWARD * offset_m) + plane * offset_m;
            let albedo = scene.handed_on(texel.triangle, texel.weights.y, texel.weights.z);
            ((Place { position, normal }, plane), (origin, albedo))
        };
        let (faces, starts): (Vec<_>, Vec<_>) = scene.texels.par_iter().map(of_texel).unzip();
        let (places, planes) = faces.into_iter().unzip();
        let (origins, albedo) = starts.into_iter().unzip();
        let size = Vec2::new(width as f32, height as f32);
        let charted = |(corners, &sheet): (&[u32; 3], &u16)| {
            let [first, b, c] = corners.map(|v| scene.unwrapped.uvs[v as usize] * size);
            Charted { first, ways: [b - first, c - first], sheet }
        };
        let charted = scene.unwrapped.triangles.iter().zip(&scene.unwrapped.sheet).map(charted).collect();
        let (parted, whole) = (Vec::new(), Vec::new());
        (Self { scene, places, planes, origins, offset_m, parted, whole, texel_at, charted }, albedo)
    }

    /// Where a texel's rays start, and the normal of its triangle's plane.
    pub fn start(&self, texel: u32) -> (Vec3, Vec3) {
        (self.origins[texel as usize], self.planes[texel as usize])
    }

    /// Whether a texel's rays go in a direction.
    pub fn faces(&self, texel: u32, direction: Vec3) -> bool {
        faces(self.places[texel as usize].normal, self.planes[texel as usize], direction)
    }

    /// What was met, by a ray that met something.
    pub fn met(&self, hit: &Hit) -> Met {
        let scene = self.scene;
        if !hit.back
            && let Some(charted) = self.charted.get(hit.triangle as usize)
        {
            let last = Vec2::new(scene.sides[0] as f32, scene.sides[1] as f32) - 1.0;
            let at = charted.first + charted.ways[0] * hit.u + charted.ways[1] * hit.v;
            let at = at.max(Vec2::ZERO).min(last).as_uvec2();
            let texel = self.texel_at[cell(scene.sides, charted.sheet, at.x, at.y)];
            if texel != NOBODY {
                let place = || {
                    let [a, b, c] = scene.corners(hit.triangle);
                    a + (b - a) * hit.u + (c - a) * hit.v
                };
                let asked = if self.is_parted(texel) { self.on_this_side(texel, place()) } else { Some(texel) };
                return asked.map_or(Met::Other, Met::Texel);
            }
        }
        Met::Other
    }

    /// The nearest of the texels around one with a wall on it that has none and sees a place of it.
    pub fn on_this_side(&self, texel: u32, place: Vec3) -> Option<u32> {
        let scene = self.scene;
        let own = &scene.texels[texel as usize];
        let up = self.planes[texel as usize];
        let chart = |texel: &Texel| scene.unwrapped.chart[texel.triangle as usize];
        let beside = |dx: i32, dy: i32| {
            let (x, y) = (u32::from(own.x).checked_add_signed(dx)?, u32::from(own.y).checked_add_signed(dy)?);
            let other =
                *self.texel_at.get(cell(scene.sides, own.sheet, x, y)).filter(|_| x < scene.sides[0] && y < scene.sides[1])?;
            let is_asked = other != NOBODY && self.whole[other as usize] && chart(&scene.texels[other as usize]) == chart(own);
            is_asked.then(|| (place.distance_squared(self.places[other as usize].position), other))
        };
        // no heap: this is asked of millions of hits
        let mut around = [(f32::INFINITY, NOBODY); ((2 * AROUND + 1) * (2 * AROUND + 1)) as usize];
        let all = (-AROUND..=AROUND).flat_map(|dy| (-AROUND..=AROUND).filter_map(move |dx| beside(dx, dy)));
        around.iter_mut().zip(all).for_each(|(to, of)| *to = of);
        let (asked, ..) = around.select_nth_unstable_by(ASKED, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        asked.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let sees = |&&(far_squared, other): &&(f32, u32)| {
            let far = far_squared.sqrt();
            let start = place + up * (self.offset_m + ABOVE * far);
            let end = self.origins[other as usize] + self.planes[other as usize] * (ABOVE * far);
            let mut occluded = [0];
            scene.rays.occluded(&[Ray { origin: start, direction: end - start, t_min: 0.0, t_max: 1.0 }], &mut occluded);
            occluded == [0]
        };
        asked.iter().filter(|(_, other)| *other != NOBODY).find(sees).map(|(_, other)| *other)
    }

    /// Whether a texel stands for both sides of a wall.
    pub fn is_parted(&self, texel: u32) -> bool {
        self.parted.get(texel as usize).is_some_and(|parted| *parted)
    }

    /// Where a path goes on that came in such a direction.
    pub fn goes_on(&self, hit: &Hit, direction: Vec3) -> Onward {
        let [a, b, c] = self.scene.corners(hit.triangle);
        let plane = unit_or((b - a).cross(c - a), -direction);
        let plane = if plane.dot(direction) > 0.0 { -plane } else { plane };
        let place = inward([a, b, c], a + (b - a) * hit.u + (c - a) * hit.v, INWARD * self.offset_m);
        Onward {
            origin: place + plane * self.offset_m,
            normal: plane,
            albedo: self.scene.handed_on(hit.triangle, hit.u, hit.v),
        }
    }
}

/// A place of a triangle, moved towards its middle where it lies nearer than `by_m` to a side.
fn inward([a, b, c]: [Vec3; 3], place: Vec3, by_m: f32) -> Vec3 {
    let near_side = [(a, b), (b, c), (c, a)].iter().any(|&(from, to)| {
        let along = to - from;
        (place - from).cross(along).length() < by_m * along.length()
    });
    let to_middle = (a + b + c) / 3.0 - place;
    let distance = to_middle.length();
    if near_side && distance > 0.0 { place + to_middle * (by_m / distance).min(0.5) } else { place }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_at_a_side_move_in_and_others_stay() {
        let corners = [Vec3::ZERO, Vec3::X * 3.0, Vec3::Y * 3.0];
        assert_eq!(inward(corners, Vec3::new(1.0, 0.5, 0.0), 0.1), Vec3::new(1.0, 0.5, 0.0));
        let moved = inward(corners, Vec3::new(1.0, 0.0, 0.0), 0.1);
        assert!((moved - Vec3::new(1.0, 0.1, 0.0)).length() < 1e-6);
        assert_eq!(inward([Vec3::ONE; 3], Vec3::ONE, 0.1), Vec3::ONE);
    }
}
