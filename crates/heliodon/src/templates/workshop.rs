//! The sculptor's workshop as a site.

use super::{NewSite, TemplateParams, athens, clear_sky, short_seed, write_parts, write_site};
use anyhow::Result;
use heliodon_bundle::site::{
    Along, Bake, Detail, DetailPattern, Lamp, Part, Room, SITE_FILE_NAME, SiteFile, SiteInfo, Transfer, UtcOffset,
};
use heliodon_image::detail::{DetailKind, DetailParams, DetailTexture};
use heliodon_mesh::workshop::{WorkshopParams, workshop};
use std::path::Path;

mod living;
mod people;

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

/// A detail of some parts. A texel is then 2 to 6 mm, a ring of wood 3 cm.
struct Laid {
    parts: &'static [&'static str],
    file: &'static str,
    kind: DetailKind,
    /// The length of a tile, metres.
    size_m: f64,
    /// The axis along which fibres run.
    along: Along,
    /// How much of it is shown.
    strength: f64,
}

const WOOD: Laid = Laid {
    parts: &["roof"],
    file: "wood.png",
    kind: DetailKind::Wood { knots: 0 },
    size_m: 0.6,
    along: Along::X,
    strength: 0.9,
};

const DETAILS: [Laid; 6] = [
    Laid { parts: &["walls"], file: "plaster.png", kind: DetailKind::Plaster, size_m: 1.6, along: Along::Y, strength: 1.0 },
    Laid {
        parts: &["columns", "floor"],
        file: "stone.png",
        kind: DetailKind::Stone,
        size_m: 1.0,
        along: Along::Y,
        strength: 0.8,
    },
    // tie beams span the nave, benches and what lies on trestles stand along it
    Laid { size_m: 0.7, along: Along::Z, ..WOOD },
    Laid { parts: &["benches"], ..WOOD },
    Laid { parts: &["scaffold"], along: Along::Y, ..WOOD },
    Laid { parts: &["ground"], file: "noise.png", kind: DetailKind::Noise, size_m: 0.5, along: Along::Y, strength: 0.8 },
];
/// Texels along a side of each.
const DETAIL_TEXELS: u32 = 256;
/// Up to where they are full, metres: the nave's width.
const DETAIL_NEAR_M: f64 = 8.0;

/// Generates the details' images and lays them onto the parts; answers the files' names.
fn write_details(folder: &Path, seed: u64, site: &mut SiteFile) -> Result<Vec<String>> {
    let mut files = Vec::new();
    for Laid { parts, file, kind, size_m, along, strength } in DETAILS {
        if !files.iter().any(|known| known == file) {
            let params = DetailParams { size: DETAIL_TEXELS, seed, ..DetailParams::new(kind) };
            DetailTexture::generate(&params)?.write_png(folder.join(file))?;
            files.push(file.to_owned());
        }
        let of_file = Detail { file: Some(file.to_owned()), kind: None, ..Detail::of_kind(DetailPattern::Stone) };
        let detail = Detail { size_m: Some(size_m), along, strength, near_m: DETAIL_NEAR_M, ..of_file };
        let named = |part: &&mut Part| part.name.as_deref().is_some_and(|name| parts.contains(&name));
        site.parts.iter_mut().filter(named).for_each(|part| part.detail = vec![detail.clone()]);
    }
    Ok(files)
}

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
    files.extend(write_details(folder, params.seed, &mut site)?);
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
    files.extend(living::furnish(folder, &hall.things, &mut site)?);
    write_site(folder, &site)?;
    files.push(SITE_FILE_NAME.to_owned());
    Ok(NewSite { name: site.site.name, triangles: hall.triangle_count() as u64, files })
}
