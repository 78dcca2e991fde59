//! Which stones, and which of their faces, a visitor can see at all: the rest is cut coarsely.
//!
//! The paper that this follows (Callieri et al. 2006, section 5) takes away what no point of the visitor's room sees. Here it
//! stays, because it throws shadows and because visitors may leave the room. All stones are drawn coarsely from five eyes
//! of the view into depth pictures; a face that wins a pixel in one of them is seen.

use super::projected::{DepthPicture, PictureCamera};
use super::sizing::{FOCAL_PX, Grain, View};
use super::solid::SolidMesh;
use super::yard::Element;
use glam::Vec3;
use rayon::prelude::*;

/// How coarse the stones are drawn, in pixels.
const DRAWN_PX: f32 = 11.0;
/// The depth pictures: as sharp as the visitor's, and wider, for a turned head (111 degrees).
const SIZE: (u32, u32) = (2400, 960);
/// The middle of the room and every other of its corners.
const EYES: [usize; 5] = [0, 3, 5, 6, 8];

/// Faces seen of each stone of each part: bits `FACE_*` of a block, any bit of a tube. `None` for stones beside and behind the
/// pictures, of which nothing is known; they are coarser by their place already.
pub fn seen_faces(parts: &[&[Element]], ground: &SolidMesh, view: &View) -> Vec<Vec<Option<u8>>> {
    let grain = Grain { view, px: DRAWN_PX, ornaments: true };
    let solids: Vec<Vec<(SolidMesh, [usize; 6])>> = parts
        .iter()
        .map(|elements| elements.par_iter().map(|element| (element.shape(&grain), element.face_counts(&grain))).collect())
        .collect();
    let pictures: Vec<DepthPicture> = EYES.par_iter().map(|&eye| draw(&solids, ground, view, view.eyes()[eye])).collect();
    let stones = solids.iter().map(Vec::len).sum::<usize>();
    let mut seen = vec![0_u8; stones + 1];
    for id in pictures.iter().flat_map(DepthPicture::winners) {
        seen[(id / 8) as usize] |= 1 << (id % 8);
    }
    let mut flags = seen.into_iter();
    let mut of_part = |part: &Vec<(SolidMesh, [usize; 6])>| -> Vec<Option<u8>> {
        part.iter().zip(&mut flags).map(|((solid, _), seen)| (seen != 0 || !is_beside(view, solid)).then_some(seen)).collect()
    };
    solids.iter().map(&mut of_part).collect()
}

/// Whether a stone lies outside of the pictures.
fn is_beside(view: &View, solid: &SolidMesh) -> bool {
    let Some(&at) = solid.positions.first() else { return true };
    let to = at - view.centre();
    let flat = Vec3::new(to.x, 0.0, to.z);
    flat.dot(view.forward()) < 0.6 * flat.length()
}

fn draw(solids: &[Vec<(SolidMesh, [usize; 6])>], ground: &SolidMesh, view: &View, eye: Vec3) -> DepthPicture {
    // a little upwards, as visitors look at a temple
    let look_at = eye + view.forward() + Vec3::Y * 0.15;
    let mut picture = DepthPicture::new(PictureCamera { eye, look_at, size: SIZE, focal_px: FOCAL_PX });
    let whole_ground = (ground, [ground.triangles.len(), 0, 0, 0, 0, 0]);
    let stones = solids.iter().flatten().map(|(solid, counts)| (solid, *counts));
    for (stone, (solid, counts)) in stones.chain(std::iter::once(whole_ground)).enumerate() {
        let points: Vec<Option<Vec3>> = solid.positions.iter().map(|&p| picture.project(p)).collect();
        let faces = counts.into_iter().enumerate().flat_map(|(face, count)| std::iter::repeat_n(face, count));
        for (triangle, face) in solid.triangles.iter().zip(faces) {
            if let [Some(a), Some(b), Some(c)] = triangle.map(|i| points[i as usize]) {
                picture.draw([a, b, c], (stone * 8 + face) as u32);
            }
        }
    }
    picture
}
