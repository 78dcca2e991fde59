//! A pillar on a plate: few triangles, every kind of light.

use super::{NewSite, TemplateParams, athens, clear_sky, part, write_site};
use anyhow::{Context, Result};
use glam::Vec3;
use heliodon_bundle::site::{Albedo, Bake, Mapping, Role, Room, Sky};
use heliodon_image::HdrImage;
use heliodon_mesh::Mesh;
use heliodon_mesh::export::write_obj;
use std::f32::consts::TAU;
use std::path::Path;

/// What lights it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// A sky model.
    ClearSky,
    /// One image of constant radiance 1.
    GreyImage,
}

const DEFAULT_TRIANGLES: u64 = 20_000;
const PLATE_SIDE_M: f32 = 6.0;
const PILLAR_RADIUS_M: f32 = 0.15;
const PILLAR_HEIGHT_M: f32 = 2.0;
/// The pillar stands a little in the plate, so that no light shines through between them.
const PILLAR_FOOT_M: f32 = -0.05;
/// The part of the triangles that the plate gets, where the shadow is seen.
const PLATE_PART: f64 = 0.8;

pub fn make(folder: &Path, params: &TemplateParams, light: Light) -> Result<NewSite> {
    let triangles = params.triangles.unwrap_or(DEFAULT_TRIANGLES);
    let plate = plate(triangles as f64 * PLATE_PART);
    let pillar = pillar(triangles as f64 * (1.0 - PLATE_PART));
    let mut files = Vec::new();
    for (name, mesh) in [("plate.obj", &plate), ("pillar.obj", &pillar)] {
        let path = folder.join(name);
        write_obj(&path, mesh).with_context(|| format!("cannot write {}", path.display()))?;
        files.push(name.to_owned());
    }
    let (name, sky, bake) = match light {
        Light::ClearSky => ("Sundial", clear_sky("2006-06-21")?, Bake { samples: 256, ..Bake::default() }),
        Light::GreyImage => {
            HdrImage::filled(64, 32, Vec3::ONE).write_hdr(folder.join("grey.hdr"))?;
            files.push("grey.hdr".to_owned());
            let sky = Sky {
                probes: Some("grey.hdr".to_owned()),
                mapping: Some(Mapping::LatLong),
                opening_deg: 180.0,
                ..Sky::default()
            };
            ("Pillar under a grey sky", sky, Bake { sun_steps: 1, samples: 256, ..Bake::default() })
        }
    };
    let mut site = athens(name, sky, bake);
    for (file, name, role, albedo) in
        [("plate.obj", "plate", Role::Ground, [0.35, 0.33, 0.3]), ("pillar.obj", "pillar", Role::Scan, [0.65, 0.6, 0.52])]
    {
        site.parts.push(heliodon_bundle::site::Part { albedo: Some(Albedo::Rgb(albedo)), ..part(file, name, role) });
    }
    site.rooms.push(Room {
        name: "in front".to_owned(),
        min: [-3.0, 1.2, 4.5],
        max: [3.0, 2.2, 8.0],
        windows: Vec::new(),
        looks_at: Some([0.0, 0.8, 0.0]),
    });
    write_site(folder, &site)?;
    files.push(heliodon_bundle::site::SITE_FILE_NAME.to_owned());
    let triangles = (plate.triangles.len() + pillar.triangles.len()) as u64;
    Ok(NewSite { name: site.site.name, triangles, files })
}

/// Adds shapes to a mesh.
trait Grid {
    /// A grid of `columns` x `rows` quadrangles; `position` maps (0..=columns, 0..=rows), `wrap` joins the last column to the
    /// first. Fronts are where columns x rows points.
    fn grid(&mut self, columns: u32, rows: u32, wrap: bool, position: impl Fn(u32, u32) -> Vec3);
}

impl Grid for Mesh {
    fn grid(&mut self, columns: u32, rows: u32, wrap: bool, position: impl Fn(u32, u32) -> Vec3) {
        let first = self.positions.len() as u32;
        let stride = if wrap { columns } else { columns + 1 };
        for row in 0..=rows {
            self.positions.extend((0..stride).map(|column| position(column, row)));
        }
        let index = |column: u32, row: u32| first + row * stride + if wrap { column % columns } else { column };
        for row in 0..rows {
            for column in 0..columns {
                let [a, b, c, d] =
                    [index(column, row), index(column + 1, row), index(column + 1, row + 1), index(column, row + 1)];
                self.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
}

/// A square with its front up.
fn plate(triangles: f64) -> Mesh {
    let cells = (triangles / 2.0).sqrt().round().max(1.0) as u32;
    let coordinate = |index: u32| (index as f32 / cells as f32 - 0.5) * PLATE_SIDE_M;
    let mut plate = Mesh::default();
    plate.grid(cells, cells, false, |column, row| Vec3::new(coordinate(column), 0.0, -coordinate(row)));
    plate
}

/// A round shaft with a lid that has vertices of its own, so that the edge stays sharp.
fn pillar(triangles: f64) -> Mesh {
    // Quadrangles as high as wide: columns * rows with rows = columns * height / circumference.
    let circumference = TAU * PILLAR_RADIUS_M;
    let columns = ((triangles / 2.0 * f64::from(circumference / PILLAR_HEIGHT_M)).sqrt().round() as u32).max(8);
    let rows = ((columns as f32 * PILLAR_HEIGHT_M / circumference).round() as u32).max(1);
    let around = |column: u32, radius: f32, y: f32| {
        let angle = TAU * column as f32 / columns as f32;
        // the same sine and cosine on every machine
        Vec3::new(radius * libm::cosf(angle), y, -radius * libm::sinf(angle))
    };
    let mut pillar = Mesh::default();
    let height = PILLAR_HEIGHT_M - PILLAR_FOOT_M;
    pillar.grid(columns, rows, true, |column, row| {
        around(column, PILLAR_RADIUS_M, PILLAR_FOOT_M + height * row as f32 / rows as f32)
    });
    let rim = pillar.positions.len() as u32;
    pillar.positions.extend((0..columns).map(|column| around(column, PILLAR_RADIUS_M, PILLAR_HEIGHT_M)));
    let centre = pillar.positions.len() as u32;
    pillar.positions.push(Vec3::new(0.0, PILLAR_HEIGHT_M, 0.0));
    pillar.triangles.extend((0..columns).map(|column| [rim + column, rim + (column + 1) % columns, centre]));
    pillar
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fronts_look_outwards() {
        for (mesh, outwards) in [
            (plate(200.0), (|_| Vec3::Y) as fn(Vec3) -> Vec3),
            (pillar(2000.0), |p| if p.y > PILLAR_HEIGHT_M - 1e-4 { Vec3::Y } else { Vec3::new(p.x, 0.0, p.z) }),
        ] {
            for triangle in &mesh.triangles {
                let [a, b, c] = triangle.map(|index| mesh.positions[index as usize]);
                assert!((b - a).cross(c - a).dot(outwards((a + b + c) / 3.0)) > 0.0);
            }
        }
    }
}
