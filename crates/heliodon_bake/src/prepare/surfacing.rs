//! What the vertices of a part's original look like, kept small while the part is simplified.

use glam::Vec3;
use heliodon_mesh::Mesh;
use heliodon_prepare::simplify::Look;

/// Steps of a colour in [0, 1], and of a coordinate of a normal to each side of 0.
const STEPS: [f32; 2] = [65535.0, 32767.0];

/// Colours and normals, as far as the part has them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surfacing {
    pub colors: Vec<[u16; 3]>,
    pub normals: Vec<[i16; 3]>,
}

impl Surfacing {
    pub fn new(mesh: &Mesh) -> Self {
        let color = |color: &Vec3| (*color * STEPS[0]).to_array().map(|v| v.round() as u16);
        let normal = |normal: &Vec3| (*normal * STEPS[1]).to_array().map(|v| v.round() as i16);
        Self { colors: mesh.colors_linear.iter().map(color).collect(), normals: mesh.normals.iter().map(normal).collect() }
    }

    /// Adds those of the vertices that follow, so many: of what they do not have, what changes nothing.
    pub fn append(&mut self, part: &Self, vertices: usize) {
        let filled = |len: usize| if len == 0 { vertices } else { 0 };
        self.colors.extend_from_slice(&part.colors);
        self.colors.extend(std::iter::repeat_n([u16::MAX; 3], filled(part.colors.len())));
        self.normals.extend_from_slice(&part.normals);
        self.normals.extend(std::iter::repeat_n([0; 3], filled(part.normals.len())));
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.normals.is_empty()
    }

    /// Of a vertex; zero of what the part does not have.
    pub fn of(&self, vertex: u32) -> Look {
        let color = self.colors.get(vertex as usize).copied().unwrap_or_default();
        let normal = self.normals.get(vertex as usize).copied().unwrap_or_default();
        [Vec3::from(color.map(f32::from)) / STEPS[0], Vec3::from(normal.map(f32::from)) / STEPS[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_keep_what_can_be_seen() {
        let (color, normal) = (Vec3::new(0.0, 0.3333, 1.0), Vec3::new(-0.6, 0.8, 0.0));
        let mesh = Mesh { colors_linear: vec![color], normals: vec![normal], ..Mesh::default() };
        let [seen, faced] = Surfacing::new(&mesh).of(0);
        assert!(seen.abs_diff_eq(color, 1e-5) && faced.abs_diff_eq(normal, 2e-5));
        assert_eq!(Surfacing::default().of(7), [Vec3::ZERO; 2]);
    }
}
