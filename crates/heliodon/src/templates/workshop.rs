//! The sculptor's workshop as a site.

use super::{NewSite, TemplateParams, athens, clear_sky, short_seed, write_parts, write_site};
use anyhow::Result;
use heliodon_bundle::site::{Bake, Lamp, Room, SITE_FILE_NAME, SiteInfo, Transfer, UtcOffset};
use heliodon_mesh::workshop::{WorkshopParams, workshop};
use std::path::Path;

/// A little more than its shapes have, which it has without `--triangles`. More are not needed: its light is in texels.
pub const LEAST_TRIANGLES: u64 = 40_000;
/// The equinox: the sun enters the high windows of the south at noon and falls upon the middle of the floor.
const DATE: &str = "2003-03-21";
/// Rays of each vertex: an interior is lit by little openings, which few rays find.
const SAMPLES: u32 = 512;
/// Bounces: behind the columns most light has been reflected three times and more.
const BOUNCES: u32 = 6;
/// What an oil lamp gives, in the unit of the sky's: enough to be seen beside daylight in the hall.
const FLAME: [f64; 3] = [9.0, 5.0, 1.9];
/// How far it reaches, metres.
const FLAME_REACH_M: f64 = 9.0;

pub fn make(folder: &Path, params: &TemplateParams) -> Result<NewSite> {
    let mut workshop_params =
        WorkshopParams { triangles: params.triangles.unwrap_or_default() as usize, ..WorkshopParams::default() };
    if let Some(seed) = short_seed(params) {
        workshop_params.seed = seed;
    }
    let hall = workshop(&workshop_params);
    let texels = Some(heliodon_bundle::site::DEFAULT_TEXELS);
    let bake = Bake { samples: SAMPLES, bounces: BOUNCES, transfer: Transfer::Rgb, texels, ..Bake::default() };
    let mut site = athens("A sculptor's workshop at Olympia", clear_sky(DATE)?, bake);
    site.site = SiteInfo {
        latitude_deg: Some(37.64),
        longitude_deg: Some(21.63),
        utc_offset: UtcOffset::from_seconds(2 * 3600).unwrap_or_default(),
        ..site.site
    };
    let mut files = write_parts(folder, &hall.parts, &mut site)?;
    let point = |point: glam::Vec3| point.to_array().map(f64::from);
    site.rooms.push(Room {
        name: "the nave".to_owned(),
        min: point(hall.room.0),
        max: point(hall.room.1),
        windows: Vec::new(),
        looks_at: Some(point(hall.look_at)),
    });
    site.lamps = hall
        .lamps
        .iter()
        .enumerate()
        .map(|(k, &flame)| Lamp {
            name: Some(format!("oil lamp {}", k + 1)),
            reach_m: FLAME_REACH_M,
            ..Lamp::at(point(flame), FLAME)
        })
        .collect();
    write_site(folder, &site)?;
    files.push(SITE_FILE_NAME.to_owned());
    Ok(NewSite { name: site.site.name, triangles: hall.triangle_count() as u64, files })
}
