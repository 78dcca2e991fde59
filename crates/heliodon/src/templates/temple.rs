//! The procedural temple as a site.

use super::{NewSite, TemplateParams, athens, clear_sky, short_seed, write_parts, write_site};
use anyhow::Result;
use heliodon_bundle::site::{Bake, Room, SITE_FILE_NAME, Transfer};
use heliodon_mesh::temple::{TempleParams, build};
use std::path::Path;

/// The compass bearing of the model's -Z: the temple's east front, which the model has along +X, looks to 77 degrees
/// (W. B. Dinsmoor: "The Architecture of Ancient Greece", 1950, gives the axis to the nearest degree).
const NORTH_DEG: f64 = 77.0 - 90.0;
/// A day whose sun sets far enough in the north to light the long north side from the visitor's room in the evening.
const DATE: &str = "2006-05-20";
/// Rays of each vertex: errors of about one per cent, a minute or two for a million triangles on two cores.
const SAMPLES: u32 = 128;

pub fn make(folder: &Path, params: &TemplateParams) -> Result<NewSite> {
    let mut temple_params = TempleParams::default();
    if let Some(triangles) = params.triangles {
        temple_params.triangles = triangles as usize;
    }
    if let Some(seed) = short_seed(params) {
        temple_params.seed = seed;
    }
    let temple = build(&temple_params);
    let bake = Bake { samples: SAMPLES, transfer: Transfer::Rgb, ..Bake::default() };
    let mut site = athens("A temple with the Parthenon's measures", clear_sky(DATE)?, bake);
    site.site.north_deg = NORTH_DEG;
    let triangles = temple.triangle_count() as u64;
    let mut files = write_parts(folder, &temple.parts, &mut site)?;
    let corner = |corner: glam::Vec3| corner.to_array().map(f64::from);
    site.rooms.push(Room {
        name: "north-west of the temple".to_owned(),
        min: corner(temple.room.0),
        max: corner(temple.room.1),
        windows: Vec::new(),
        looks_at: Some(corner(temple.look_at)),
    });
    write_site(folder, &site)?;
    files.push(SITE_FILE_NAME.to_owned());
    Ok(NewSite { name: site.site.name, triangles, files })
}
