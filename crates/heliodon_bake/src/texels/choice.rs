//! Which parts are lit by texels: decided once, from their triangles as they were read, before preparation splits or simplifies any.

use super::atlas::nearness;
use glam::Vec3;
use heliodon_bundle::site::{LightStorage, Room, SiteFile};
use serde::Serialize;

/// Parts whose triangles have longer edges are lit by texels unless told otherwise, metres: some ten texels of a room's atlas.
const AUTO_EDGE_M: f32 = 0.3;

/// Where a part's light is stored, as far as `site.toml` decides it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Choice {
    /// At vertices.
    Vertices,
    /// In texels.
    Texels,
    /// As its triangles are.
    ByEdges,
}

impl Choice {
    /// Of a part of a site: left to itself, it is only where the site has an atlas that its triangles are asked.
    ///
    /// # Panics
    /// If there is no such part.
    #[must_use]
    pub fn of(site: &SiteFile, part: usize) -> Self {
        match site.parts[part].light {
            LightStorage::Vertex => Self::Vertices,
            LightStorage::Texel => Self::Texels,
            LightStorage::Auto if site.bake.texels.is_some() => Self::ByEdges,
            LightStorage::Auto => Self::Vertices,
        }
    }

    /// Whether a part of these triangles, as they were read, is lit by texels: by edges it is where they are larger, as seen from the rooms, than light at
    /// their corners can be told from.
    #[must_use]
    pub fn is_texels(self, rooms: &[Room], positions: &[Vec3], triangles: &[[u32; 3]]) -> bool {
        match self {
            Self::Vertices => false,
            Self::Texels => true,
            Self::ByEdges => usual_edge_m(rooms, positions, triangles) > AUTO_EDGE_M,
        }
    }
}

/// The longest edge that triangles have, metres in a room, or as large as they look from there: the median by the area that they show.
fn usual_edge_m(rooms: &[Room], positions: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
    let of = |t: &[u32; 3]| {
        let corners = t.map(|v| positions[v as usize]);
        let [a, b, c] = corners;
        let near = nearness(rooms, corners);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        (longest * near, 0.5 * (b - a).cross(c - a).length() * near * near)
    };
    let mut edges: Vec<(f32, f32)> =
        triangles.iter().map(of).filter(|(edge, area)| edge.is_finite() && area.is_finite()).collect();
    edges.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all: f64 = edges.iter().map(|edge| f64::from(edge.1)).sum();
    let mut so_far = 0.0;
    let middle = edges.iter().find(|edge| {
        so_far += f64::from(edge.1);
        so_far > 0.5 * all
    });
    middle.map_or(0.0, |edge| edge.0)
}
