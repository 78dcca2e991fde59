//! A part of the site that shows a film: its own geometry and texture coordinates, drawn once more over itself.

use bevy::math::{Vec2, Vec3};
use heliodon_bundle::moment::Moment;
use heliodon_bundle::shade::chunk_light;
use heliodon_bundle::{BundleReader, LitChunk};

/// The most vertices of a part that shows a film: their light is worked out on the processor in every frame of a day that passes.
const MOST_VERTICES: usize = 20_000;

/// Where a film is shown on a part.
#[derive(Clone, Debug)]
pub struct Surface {
    chunks: Vec<LitChunk>,
    /// The side of a tile, where it lies as places say and not as texture coordinates do, metres.
    tile_m: Option<f32>,
}

impl Surface {
    /// Of a bundle's part; with a tile's side in metres it needs no texture coordinates.
    ///
    /// # Errors
    /// Where there is nothing to lay a film on, in words.
    pub fn read(bundle: &BundleReader, part: &str, tile_m: Option<f32>) -> Result<Self, String> {
        let parts = &bundle.manifest().parts;
        let is_its =
            |number: &usize| parts.get(usize::from(bundle.chunk_info(*number).part)).is_some_and(|own| own.name == part);
        let numbers = (0..bundle.chunk_count()).filter(is_its);
        let chunks = numbers.map(|number| bundle.read_chunk(number)).collect::<Result<Vec<_>, _>>();
        Self::new(chunks.map_err(|error| error.to_string())?, part, tile_m)
    }

    /// Of a part's chunks.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn new(chunks: Vec<LitChunk>, part: &str, tile_m: Option<f32>) -> Result<Self, String> {
        if chunks.iter().all(|chunk| chunk.triangles.is_empty()) {
            return Err(format!("there is no part `{part}`; name one of the site"));
        }
        let tile_m = tile_m.filter(|_| chunks.iter().any(|chunk| chunk.uvs.is_empty()));
        if tile_m.is_none() && chunks.iter().any(|chunk| chunk.uvs.is_empty()) {
            return Err(format!("the part `{part}` has no texture coordinates; give it an image as its albedo"));
        }
        let count: usize = chunks.iter().map(|chunk| chunk.positions.len()).sum();
        if count > MOST_VERTICES {
            return Err(format!(
                "the part `{part}` has {count} vertices, of at most {MOST_VERTICES}; make what shows the film a part of its own"
            ));
        }
        Ok(Self { chunks, tile_m })
    }

    /// Places, metres.
    pub fn positions(&self) -> impl Iterator<Item = Vec3> {
        self.chunks.iter().flat_map(|chunk| chunk.positions.iter().copied())
    }

    /// Unit normals.
    pub fn normals(&self) -> impl Iterator<Item = Vec3> {
        self.chunks.iter().flat_map(|chunk| chunk.normals.iter().copied())
    }

    /// Where on the film each vertex is, from its upper left corner.
    pub fn uvs(&self) -> Vec<Vec2> {
        match self.tile_m {
            Some(tile_m) => self.positions().zip(self.normals()).map(|(place, normal)| laid(place, normal) / tile_m).collect(),
            None => self.chunks.iter().flat_map(|chunk| chunk.uvs.iter().copied()).collect(),
        }
    }

    /// Three vertices a triangle.
    #[must_use]
    pub fn indices(&self) -> Vec<u32> {
        let mut first = 0;
        let mut indices = Vec::new();
        for chunk in &self.chunks {
            indices.extend(chunk.triangles.iter().flatten().map(|vertex| first + vertex));
            first += chunk.positions.len() as u32;
        }
        indices
    }

    /// What of the light reaches each vertex, as the stone's own is lit; `elsewhere` lights what has its light in texels, which are not asked here.
    #[must_use]
    pub fn light(&self, moment: &Moment, elsewhere: impl Fn(Vec3, Vec3) -> Vec3) -> Vec<Vec3> {
        let mut light = Vec::new();
        for chunk in &self.chunks {
            if chunk.texel_uvs.is_empty() {
                light.extend(chunk_light(moment, chunk));
            } else {
                light.extend(chunk.positions.iter().zip(&chunk.normals).map(|(&place, &normal)| elsewhere(place, normal)));
            }
        }
        light
    }
}

/// Metres along the two axes that a surface shows most of, the second downwards where it is steep.
fn laid(place: Vec3, normal: Vec3) -> Vec2 {
    let across = normal.abs();
    if across.y >= across.x.max(across.z) {
        Vec2::new(place.x, place.z)
    } else if across.x > across.z {
        Vec2::new(place.z, -place.y)
    } else {
        Vec2::new(place.x, -place.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_bundle::{LightLayout, VertexLight};

    fn chunk(with_uvs: bool) -> LitChunk {
        let layout = LightLayout { sun_steps: 1, coefficients: 4, channels: 1, sun_bounce_functions: 0 };
        let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        LitChunk {
            part: 0,
            texture: with_uvs.then_some(0),
            detail: None,
            normals: vec![Vec3::Z; 3],
            uvs: if with_uvs { corners.iter().map(|p| p.truncate()).collect() } else { Vec::new() },
            texel_uvs: Vec::new(),
            albedo: vec![Vec3::ONE; 3],
            triangles: vec![[0, 1, 2]],
            valid: vec![1; 3],
            light: VertexLight::zeros(layout, 3),
            positions: corners,
        }
    }

    #[test]
    fn chunks_of_a_part_are_one_surface() {
        let surface = Surface::new(vec![chunk(true), chunk(true)], "panel", None).unwrap();
        assert_eq!(surface.indices(), [0, 1, 2, 3, 4, 5]);
        assert_eq!((surface.positions().count(), surface.uvs().get(4)), (6, Some(&Vec2::X)));
    }

    #[test]
    fn what_is_made_lies_by_places_where_there_are_no_coordinates() {
        let surface = Surface::new(vec![chunk(false)], "basin", Some(0.5)).unwrap();
        assert_eq!(surface.uvs(), [Vec2::ZERO, 2.0 * Vec2::X, -2.0 * Vec2::Y]);
        // those that there are stay
        let surface = Surface::new(vec![chunk(true)], "basin", Some(0.5)).unwrap();
        assert_eq!(surface.uvs(), [Vec2::ZERO, Vec2::X, Vec2::Y]);
    }

    #[test]
    fn what_shows_no_film_is_told() {
        let why = |chunks| Surface::new(chunks, "panel", None).unwrap_err();
        assert!(why(Vec::new()).contains("no part `panel`"));
        assert!(why(vec![chunk(true), chunk(false)]).contains("no texture coordinates"));
        assert!(why(vec![chunk(true); 7000]).contains("21000 vertices"));
    }
}
