//! What makes a `site.toml` that parses a sensible one.

use super::actor::{Actor, CACHE_FRAMES_PER_S_RANGE, MAX_COUNT};
use super::budget;
use super::detail::{Detail, DetailMapping, MAX_DETAILS};
use super::lamp::Lamp;
use super::living_check::{check_living, check_things};
use super::matte::Matte;
use super::prepare::Prepare;
use super::types::{Albedo, LightStorage, MAX_SKY_STEPS, MAX_SUN_STEPS, Mapping, Part, Room, SiteFile, Sky};
use super::values::ProbeTimes;
use super::weathering::{PartWeathering, WIND_M_PER_S, Weathering};
use crate::config::rules::{COORDINATES_M, Checked, fault, finite, not_empty, within};
use crate::panorama::{PANORAMA_SIDES, is_side};
use crate::texels::{BOUNCE_BLOCK, MAX_TEXEL_SIDE};

/// The first fault of a site, if it has one.
pub(super) fn check(site: &SiteFile) -> Checked {
    let info = &site.site;
    not_empty(&["site", "name"], &info.name)?;
    if let Some(latitude) = info.latitude_deg {
        within(&["site", "latitude_deg"], latitude, -90.0, 90.0)?;
    }
    if let Some(longitude) = info.longitude_deg {
        within(&["site", "longitude_deg"], longitude, -180.0, 180.0)?;
    }
    within(&["site", "north_deg"], info.north_deg, -360.0, 360.0)?;
    finite(&["site", "origin"], &info.origin)?;
    if site.parts.is_empty() {
        return fault(&["site"], "the site has no parts", "add a table [[part]] with file = \"...\"");
    }
    if site.parts.len() > usize::from(u16::MAX) {
        return fault(&["part"], format!("{} parts", site.parts.len()), "a bundle holds 65,535; join some with globs");
    }
    for (i, part) in site.parts.iter().enumerate() {
        let index = i.to_string();
        check_part(&["part", &index], part)?;
        check_part_weathering(&["part", &index, "weathering"], part.weathering.as_ref(), site.weathering.is_some())?;
    }
    check_sky(site, &site.sky)?;
    check_bake(site)?;
    for (i, room) in site.rooms.iter().enumerate() {
        check_room(&["room", &i.to_string()], room)?;
    }
    for (i, actor) in site.actors.iter().enumerate() {
        check_actor(&["actor", &i.to_string()], actor)?;
        if !actor.lanes.is_empty() {
            let remedy = "take it out: count and spread_m say how many there are, and where";
            return fault(&["actor", &i.to_string(), "lanes"], "lanes are found by the bake", remedy);
        }
        let folder = |actor: &Actor| actor.display_name().to_lowercase();
        if site.actors[..i].iter().any(|earlier| folder(earlier) == folder(actor)) {
            let message = format!("another actor is called `{}`", actor.display_name());
            let key = if actor.name.is_some() { "name" } else { "file" };
            return fault(&["actor", &i.to_string(), key], message, "give each a name of its own, whatever the capitals");
        }
    }
    for (i, lamp) in site.lamps.iter().enumerate() {
        check_lamp(&["light", &i.to_string()], lamp)?;
    }
    for (i, matte) in site.mattes.iter().enumerate() {
        check_matte(&["matte", &i.to_string()], matte)?;
    }
    check_living(&site.living())?;
    check_things(site)?;
    for (name, mib) in [("bake_mib", site.budget.bake_mib), ("viewer_mib", site.budget.viewer_mib)] {
        let (least, most) = (*budget::MIB.start() as f64, *budget::MIB.end() as f64);
        within(&["budget", name], mib.map_or(least, |mib| mib as f64), least, most)?;
    }
    if let Some(prepare) = &site.prepare {
        check_prepare(prepare)?;
        check_panorama(prepare.panorama, site.rooms.len(), site.weathering.is_some())?;
        if prepare.scan {
            check_scan(&site.parts, site.weathering.is_some())?;
        }
    }
    if let Some(weathering) = &site.weathering {
        check_weathering(&["weathering"], weathering)?;
    }
    let display = &site.display;
    within(&["display", "width_px"], f64::from(display.width_px), 1.0, 65_536.0)?;
    within(&["display", "height_px"], f64::from(display.height_px), 1.0, 65_536.0)?;
    within(&["display", "fov_deg"], display.fov_deg, 1.0, 170.0)
}

fn check_prepare(prepare: &Prepare) -> Checked {
    let key = |name| ["prepare", name];
    within(&key("weld_m"), prepare.weld_m, 0.0, 1.0)?;
    within(&key("isolated_m"), prepare.isolated_m, 0.0, 1000.0)?;
    within(&key("error_px"), prepare.error_px, 0.0, 100.0)?;
    within(&key("edge_px"), prepare.edge_px, 0.0, 1000.0)?;
    within(&key("nearest_m"), prepare.nearest_m, f64::MIN_POSITIVE, 1000.0)?;
    within(&key("error_m"), prepare.error_m.unwrap_or(0.0), 0.0, 1000.0)?;
    within(&key("edge_m"), prepare.edge_m.unwrap_or(0.0), 0.0, 10_000.0)?;
    within(&key("ring"), f64::from(prepare.ring), 0.0, 16.0)
}

fn check_panorama(side: u32, rooms: usize, weathers: bool) -> Checked {
    let key = ["prepare", "panorama"];
    if side == 0 {
        return Ok(());
    }
    if !is_side(side) {
        let (least, most) = (PANORAMA_SIDES.start(), PANORAMA_SIDES.end());
        let message = format!("{side} is not a multiple of 16 from {least} to {most}");
        return fault(&key, message, "write panorama = 1024, or 0 for none");
    }
    if rooms != 1 {
        let message = format!("a panorama is seen from the middle of one room, and the site has {rooms}");
        return fault(&key, message, "leave one [[room]], or take panorama out");
    }
    if weathers {
        let message = "a panorama shows the colours of the scan, without what [weathering] leaves on its vertices";
        return fault(&key, message, "take one of them out");
    }
    Ok(())
}

/// Of a site that wants the scan itself beside what is drawn.
fn check_scan(parts: &[Part], weathers: bool) -> Checked {
    let key = ["prepare", "scan"];
    if weathers {
        let message = "the scan itself has its own colours, without what [weathering] leaves on the vertices that are drawn";
        return fault(&key, message, "take one of them out");
    }
    let is_in = |part: &Part| part.light != LightStorage::Texel && !matches!(part.albedo, Some(Albedo::Image(_)));
    if !parts.iter().any(is_in) {
        let message = "parts that are lit by texels or have textures are not in the scan, and there are no others";
        return fault(&key, message, "light one of them by its vertices, or take scan out");
    }
    Ok(())
}

fn check_part(at: &[&str; 2], part: &Part) -> Checked {
    let key = |name| [at[0], at[1], name];
    not_empty(&key("file"), &part.file)?;
    if let Some(name) = &part.name {
        not_empty(&key("name"), name)?;
    }
    check_albedo(&key("albedo"), part.albedo.as_ref())?;
    if let Some(evidence) = &part.evidence {
        not_empty(&key("evidence"), evidence)?;
        if !matches!(part.albedo, Some(Albedo::Image(_))) {
            let remedy = "add the albedo = \"atlas.png\" that it tells of, or take it out";
            return fault(&key("evidence"), "evidence tells of an image of the albedo, and the part has none", remedy);
        }
    }
    if let Some(views) = &part.views {
        not_empty(&key("views"), views)?;
        if !matches!(part.albedo, Some(Albedo::Image(_))) {
            let remedy = "add the albedo = \"atlas.png\" beside it, or take it out";
            return fault(&key("views"), "views are laid on by the albedo's image, and the part has none", remedy);
        }
    }
    finite(&key("translate"), &part.translate)?;
    finite(&key("rotate_deg"), &part.rotate_deg)?;
    within(&key("texels"), part.texels, 0.01, 100.0)?;
    check_details(at, part)?;
    if let Some(least_px) = part.least_px {
        within(&key("least_px"), least_px, 0.0, 1000.0)?;
    }
    if let Some(crease) = part.crease_deg {
        within(&key("crease_deg"), crease, 0.0, 180.0)?;
    }
    check_scale(&key("scale"), part.scale)
}

fn check_details(at: &[&str; 2], part: &Part) -> Checked {
    if part.detail.len() > MAX_DETAILS {
        let remedy = format!("{MAX_DETAILS} at most; let one be for several materials: material = \"wood*\"");
        return fault(&[at[0], at[1], "detail"], format!("{} details", part.detail.len()), &remedy);
    }
    for (k, detail) in part.detail.iter().enumerate() {
        let number = k.to_string();
        let at = [at[0], at[1], "detail", &number];
        check_detail(&at, detail)?;
        if let Some(pattern) = &detail.material {
            let key = [at[0], at[1], at[2], at[3], "material"];
            not_empty(&key, pattern)?;
            if part.albedo.is_some() {
                let remedy = "take the albedo or the material out";
                return fault(
                    &key,
                    "the part's albedo takes the place of its materials, so that there are no names to go by",
                    remedy,
                );
            }
        } else if k + 1 < part.detail.len() {
            let remedy = "put it last, or say which materials it is for: material = \"wood*\"";
            return fault(
                &at,
                "the details after this one are never used: without `material` it is for all that those before it leave",
                remedy,
            );
        }
    }
    Ok(())
}

fn check_detail(at: &[&str; 4], detail: &Detail) -> Checked {
    let key = |name| [at[0], at[1], at[2], at[3], name];
    match (&detail.file, detail.kind) {
        (Some(_), Some(_)) => return fault(&key("kind"), "the detail has both a file and a kind", "take one of the two out"),
        (None, None) => {
            let remedy = "add kind = \"stone\" (noise, stone, plaster, wood), or file = \"detail/stone.png\"";
            return fault(at, "the detail has neither a file nor a kind", remedy);
        }
        (Some(file), None) => {
            not_empty(&key("file"), file)?;
            for (name, given) in [("texels", detail.texels.is_some()), ("seed", detail.seed.is_some())] {
                if given {
                    return fault(&key(name), format!("{name} belongs to a built-in kind, not to a file"), "take it out");
                }
            }
        }
        (None, Some(_)) => {
            if detail.correct {
                let remedy = "take it out: the mean of what is built in is 128";
                return fault(&key("correct"), "correct belongs to a file, not to a built-in kind", remedy);
            }
        }
    }
    if let Some(texels) = detail.texels.filter(|texels| ![64, 128, 256, 512].contains(texels)) {
        return fault(&key("texels"), format!("texels is {texels}"), "give 64, 128, 256 or 512");
    }
    match (detail.mapping, detail.size_m, detail.repeat) {
        (DetailMapping::Triplanar, _, Some(_)) => {
            return fault(&key("repeat"), "repeat belongs to mapping = \"uv\"", "give size_m, the length of a tile in metres");
        }
        (DetailMapping::Uv, Some(_), _) => {
            let remedy = "give repeat, the tiles in a unit of the texture coordinates";
            return fault(&key("size_m"), "size_m belongs to mapping = \"triplanar\"", remedy);
        }
        _ => {}
    }
    if let Some(size_m) = detail.size_m {
        within(&key("size_m"), size_m, 0.001, 1000.0)?;
    }
    if let Some(repeat) = detail.repeat {
        within(&key("repeat"), repeat, 0.001, 100_000.0)?;
    }
    within(&key("strength"), detail.strength, 0.0, 1.0)?;
    within(&key("near_m"), detail.near_m, 0.01, 100_000.0)
}

fn check_albedo(key: &[&str], albedo: Option<&Albedo>) -> Checked {
    match albedo {
        Some(Albedo::Rgb(rgb)) => {
            if let Some(wrong) = rgb.iter().find(|c| !(0.0..=1.0).contains(*c)) {
                let remedy = "give three linear numbers from 0 to 1; 8-bit colours must be divided by 255 and linearised";
                return fault(key, format!("albedo holds {wrong}"), remedy);
            }
            Ok(())
        }
        Some(Albedo::Image(image)) => not_empty(key, image),
        None => Ok(()),
    }
}

fn check_weathering(at: &[&str], weathering: &Weathering) -> Checked {
    let key = |name| [at, &[name]].concat();
    within(&key("dust"), weathering.dust, 0.0, 1.0)?;
    within(&key("corrosion"), weathering.corrosion, 0.0, 1.0)?;
    check_color(&key("dust_color"), weathering.dust_color)?;
    check_color(&key("corrosion_color"), weathering.corrosion_color)?;
    within(&key("wind_from_deg"), weathering.wind_from_deg.unwrap_or(0.0), -360.0, 360.0)?;
    within(&key("wind_m_per_s"), weathering.wind_m_per_s, *WIND_M_PER_S.start(), *WIND_M_PER_S.end())
}

pub(super) fn check_color(key: &[&str], rgb: [f64; 3]) -> Checked {
    match rgb.iter().find(|c| !(0.0..=1.0).contains(*c)) {
        None => Ok(()),
        Some(wrong) => {
            let remedy = "give three linear numbers from 0 to 1; 8-bit colours must be divided by 255 and linearised";
            fault(key, format!("{} holds {wrong}", key.last().unwrap_or(&"")), remedy)
        }
    }
}

/// `whole`: the site has a table `[weathering]`.
fn check_part_weathering(at: &[&str; 3], part: Option<&PartWeathering>, whole: bool) -> Checked {
    match part {
        None | Some(PartWeathering::As(false)) => Ok(()),
        Some(_) if !whole => fault(
            at,
            "the part is weathered, but the site has no table [weathering]",
            "add [weathering]; empty, it weathers no other part",
        ),
        Some(PartWeathering::As(true)) => Ok(()),
        Some(PartWeathering::Own(own)) => {
            let default = Weathering::default();
            let whole = Weathering {
                dust: own.dust.unwrap_or(0.0),
                corrosion: own.corrosion.unwrap_or(0.0),
                dust_color: own.dust_color.unwrap_or(default.dust_color),
                corrosion_color: own.corrosion_color.unwrap_or(default.corrosion_color),
                ..default
            };
            check_weathering(at, &whole)
        }
    }
}

fn check_scale(key: &[&str], scale: f64) -> Checked {
    if scale == 0.0 || !COORDINATES_M.contains(&scale) {
        return fault(key, format!("scale is {scale}"), "give a number that is not 0");
    }
    Ok(())
}

/// The longest name of an actor, for it is a folder's.
const LONGEST_NAME: usize = 100;

/// Whether every file system takes a name for a folder.
fn names_a_folder(name: &str) -> bool {
    let strange = |c: char| c.is_control() || "/\\:*?\"<>|".contains(c);
    !name.contains(strange) && !name.starts_with(['.', ' ']) && !name.ends_with(['.', ' ']) && name.len() <= LONGEST_NAME
}

/// What is wrong with an actor that stands in no `site.toml`.
pub(crate) fn check_lone_actor(actor: &Actor) -> Result<(), String> {
    check_actor(&["actor", "0"], actor).map_err(|fault| fault.message)
}

fn check_actor(at: &[&str; 2], actor: &Actor) -> Checked {
    let key = |name| [at[0], at[1], name];
    not_empty(&key("file"), &actor.file)?;
    let named = if actor.name.is_some() { "name" } else { "file" };
    not_empty(&key(named), actor.display_name())?;
    if !names_a_folder(actor.display_name()) {
        let remedy =
            format!("give a name without / \\ : * ? \" < > | and outer dots or blanks, at most {LONGEST_NAME} bytes long");
        return fault(&key(named), format!("`{}` cannot name the actor's folder", actor.display_name()), remedy);
    }
    for (name, text) in [("cache", &actor.cache), ("animation", &actor.animation)] {
        if let Some(text) = text {
            not_empty(&key(name), text)?;
        }
    }
    check_count(at, actor)?;
    if let Some(frames_per_s) = actor.cache_frames_per_s {
        let at = key("cache_frames_per_s");
        if actor.cache.is_none() {
            let remedy =
                "add cache = \"....pc2\", or take the key out; other animations know their own times, and speed changes them";
            return fault(&at, "cache_frames_per_s belongs to a vertex cache, and the actor has none", remedy);
        }
        within(&at, frames_per_s, *CACHE_FRAMES_PER_S_RANGE.start(), *CACHE_FRAMES_PER_S_RANGE.end())?;
    }
    if !(actor.speed >= 0.0 && COORDINATES_M.contains(&actor.speed)) {
        return fault(&key("speed"), format!("speed is {}", actor.speed), "give a number from 0 up; 1 plays as it was made");
    }
    match (&actor.place, &actor.path) {
        (Some(_), Some(_)) => {
            return fault(&key("path"), "the actor has both a place and a path", "take one of the two out");
        }
        (None, None) => {
            let remedy = "add place = [x, y, z], or path = [[x, y, z], [x, y, z]] to walk along";
            return fault(&key("place"), "the actor has neither a place nor a path", remedy);
        }
        (Some(place), None) => {
            finite(&key("place"), place)?;
        }
        (None, Some(path)) => {
            if path.len() < 2 {
                let remedy = "give at least two, or place = [x, y, z] to stand";
                return fault(&key("path"), format!("the path has {} points", path.len()), remedy);
            }
            finite(&key("path"), path.as_flattened())?;
            if path.iter().all(|point| *point == path[0]) {
                return fault(&key("path"), "all points of the path are the same", "give place = [x, y, z] to stand");
            }
        }
    }
    if !(actor.walk_speed > 0.0 && COORDINATES_M.contains(&actor.walk_speed)) {
        let remedy = "give metres a second above 0; to stand, give place in place of path";
        return fault(&key("walk_speed"), format!("walk_speed is {}", actor.walk_speed), remedy);
    }
    finite(&key("turn_deg"), &[actor.turn_deg])?;
    check_scale(&key("scale"), actor.scale)?;
    finite(&key("rotate_deg"), &actor.rotate_deg)?;
    check_albedo(&key("albedo"), actor.albedo.as_ref())
}

/// What there are several of, and what an impostor cannot have, for it is shown as it was captured.
fn check_count(at: &[&str; 2], actor: &Actor) -> Checked {
    let key = |name| [at[0], at[1], name];
    if !(1..=MAX_COUNT).contains(&actor.count) {
        return fault(&key("count"), format!("count is {}", actor.count), "give 1 to 10,000");
    }
    if !(actor.spread_m >= 0.0 && COORDINATES_M.contains(&actor.spread_m)) {
        return fault(&key("spread_m"), format!("spread_m is {}", actor.spread_m), "give metres from 0 up");
    }
    for lane in &actor.lanes {
        finite(&key("lanes"), lane.as_flattened())?;
    }
    if actor.thing.is_some() && actor.count > 1 {
        return fault(&key("count"), "things are one each", "write an [[actor]] for each");
    }
    if !actor.is_impostor() {
        if actor.count > 1 {
            let remedy =
                "capture the model (`heliodon impostor`) and name the file that comes of it, or write an [[actor]] for each";
            return fault(&key("count"), "only impostors can be many", remedy);
        }
        return Ok(());
    }
    let plain = Actor::at("", [0.0; 3]);
    let taken = [
        ("cache", actor.cache.is_some()),
        ("albedo", actor.albedo.is_some()),
        ("unit", actor.unit != plain.unit),
        ("up", actor.up != plain.up),
        ("rotate_deg", actor.rotate_deg != plain.rotate_deg),
    ];
    if let Some((name, _)) = taken.into_iter().find(|(_, given)| *given) {
        let remedy = "give it to the model when you capture it (`heliodon impostor`), and take it out here";
        return fault(&key(name), format!("an impostor is shown as it was captured: {name} says nothing"), remedy);
    }
    if actor.scale <= 0.0 {
        return fault(&key("scale"), format!("an impostor of scale {}", actor.scale), "give a number above 0");
    }
    Ok(())
}

/// What is wrong with a lamp that stands in no `site.toml`.
pub(crate) fn check_lone_lamp(lamp: &Lamp) -> Result<(), String> {
    check_lamp(&["light", "0"], lamp).map_err(|fault| fault.message)
}

fn check_lamp(at: &[&str; 2], lamp: &Lamp) -> Checked {
    let key = |name| [at[0], at[1], name];
    finite(&key("place"), &lamp.place)?;
    if let Some(wrong) = lamp.intensity.iter().find(|&&c| !(c >= 0.0 && COORDINATES_M.contains(&c))) {
        let remedy = "give three numbers from 0 up: the irradiance one metre away, in the unit of the sky's";
        return fault(&key("intensity"), format!("intensity holds {wrong}"), remedy);
    }
    if let Some(look_at) = &lamp.look_at {
        finite(&key("look_at"), look_at)?;
        if *look_at == lamp.place {
            return fault(&key("look_at"), "the lamp looks at its own place", "give a point in front of it, or take it out");
        }
    }
    within(&key("angle_deg"), lamp.angle_deg, 1.0, 170.0)?;
    within(&key("edge"), lamp.edge, 0.0, 1.0)?;
    if !(lamp.reach_m > 0.0 && COORDINATES_M.contains(&lamp.reach_m)) {
        return fault(&key("reach_m"), format!("reach_m is {}", lamp.reach_m), "give metres above 0");
    }
    Ok(())
}

/// What is wrong with a matte that stands in no `site.toml`.
pub(crate) fn check_lone_matte(matte: &Matte) -> Result<(), String> {
    check_matte(&["matte", "0"], matte).map_err(|fault| fault.message)
}

fn check_matte(at: &[&str; 2], matte: &Matte) -> Checked {
    let key = [at[0], at[1], "corners"];
    finite(&key, matte.corners.as_flattened())?;
    matte.fault().map_or(Ok(()), |(message, remedy)| fault(&key, message, remedy))
}

fn check_sky(site: &SiteFile, sky: &Sky) -> Checked {
    within(&["sky", "turn_deg"], sky.turn_deg, -360.0, 360.0)?;
    if !(sky.opening_deg > 0.0 && sky.opening_deg <= 360.0) {
        return fault(
            &["sky", "opening_deg"],
            format!("opening_deg is {}", sky.opening_deg),
            "give degrees above 0, at most 360",
        );
    }
    if let Some(rgb) = sky.sun_irradiance
        && rgb.iter().any(|c| !(c.is_finite() && *c >= 0.0))
    {
        return fault(&["sky", "sun_irradiance"], format!("sun_irradiance holds {rgb:?}"), "give three numbers from 0 up");
    }
    match (&sky.probes, sky.model) {
        (Some(_), Some(_)) => {
            return fault(&["sky", "model"], "the sky has both probes and a model", "take one of the two out");
        }
        (None, None) => {
            let remedy = "add probes = \"sky/*.hdr\" and mapping, or model = \"atmosphere\" and date";
            return fault(&["sky"], "the sky has neither probes nor a model", remedy);
        }
        (Some(probes), None) => {
            not_empty(&["sky", "probes"], probes)?;
            if sky.mapping.is_none() {
                let remedy = "add mapping = \"lat-long\", \"angular\", \"mirror-ball\", \"cube-cross\" or \"fisheye\"";
                return fault(&["sky", "probes"], "the probes have no mapping", remedy);
            }
            if sky.opening_deg != Sky::default().opening_deg && sky.mapping != Some(Mapping::Fisheye) {
                let remedy = "take it out, or write mapping = \"fisheye\"";
                return fault(&["sky", "opening_deg"], "opening_deg belongs to the mapping \"fisheye\"", remedy);
            }
            for key in ["date", "turbidity"] {
                let given = if key == "date" { sky.date.is_some() } else { sky.turbidity.is_some() };
                if given {
                    return fault(&["sky", key], format!("{key} belongs to a sky model, not to probes"), "take it out");
                }
            }
        }
        (None, Some(_)) => {
            if sky.date.is_none() {
                return fault(&["sky", "model"], "a sky model needs a date", "add date = \"2006-05-03\"");
            }
            if site.site.latitude_deg.is_none() || site.site.longitude_deg.is_none() {
                let remedy = "add latitude_deg and longitude_deg to [site]";
                return fault(&["sky", "model"], "a sky model needs the place of the site", remedy);
            }
            if let Some(turbidity) = sky.turbidity {
                within(&["sky", "turbidity"], turbidity, 1.0, 10.0)?;
            }
            let default = Sky::default();
            for (key, given) in [
                ("mapping", sky.mapping.is_some()),
                ("times", sky.times != default.times),
                ("between", sky.between != default.between),
                ("opening_deg", sky.opening_deg != default.opening_deg),
                ("turn_deg", sky.turn_deg != default.turn_deg),
                ("below_horizon", sky.below_horizon != default.below_horizon),
                ("sun_irradiance", sky.sun_irradiance.is_some()),
            ] {
                if given {
                    return fault(&["sky", key], format!("{key} belongs to probes, not to a sky model"), "take it out");
                }
            }
        }
    }
    if let ProbeTimes::List(times) = &sky.times {
        if times.is_empty() {
            return fault(&["sky", "times"], "the list of times is empty", "give one for each probe, or take the key out");
        }
        if let Some(i) = times.windows(2).position(|pair| pair[0] >= pair[1]) {
            let message = format!("{} comes after {}", times[i + 1], times[i]);
            return fault(&["sky", "times"], message, "list times in the order of the day, each once");
        }
    }
    Ok(())
}

fn check_bake(site: &SiteFile) -> Checked {
    let bake = &site.bake;
    if !(1..=MAX_SUN_STEPS).contains(&bake.sun_steps) {
        let message = format!("sun_steps is {}", bake.sun_steps);
        return fault(&["bake", "sun_steps"], message, format!("the format holds from 1 to {MAX_SUN_STEPS}"));
    }
    let sky_steps = bake.effective_sky_steps();
    within(&["bake", "sky_steps"], f64::from(sky_steps), 1.0, f64::from(MAX_SKY_STEPS))?;
    if let (Some(first), Some(last)) = (bake.first, bake.last)
        && first > last
    {
        return fault(
            &["bake", "first"],
            format!("the day begins at {first}, after its end at {last}"),
            "exchange first and last",
        );
    }
    if !(1..=2).contains(&bake.order) {
        let remedy = "give 1 (4 coefficients) or 2 (9 coefficients)";
        return fault(&["bake", "order"], format!("order is {}", bake.order), remedy);
    }
    within(&["bake", "bounces"], f64::from(bake.bounces), 0.0, 64.0)?;
    within(&["bake", "samples"], f64::from(bake.samples), 16.0, 1_048_576.0)?;
    if let Some(grid) = bake.grid_m {
        within(&["bake", "grid_m"], grid, 0.1, 10.0)?;
    }
    if let Some(texels) = bake.texels {
        within(&["bake", "texels"], f64::from(texels), 64.0, f64::from(MAX_TEXEL_SIDE))?;
        if !texels.is_multiple_of(BOUNCE_BLOCK) {
            return fault(&["bake", "texels"], format!("texels is {texels}"), "give a multiple of 4, such as 2048");
        }
    }
    match bake.offset_m {
        Some(offset) if !(offset > 0.0 && offset <= 10.0) => fault(
            &["bake", "offset_m"],
            format!("offset_m is {offset}"),
            "give metres above 0, at most 10, or take the key out",
        ),
        _ => Ok(()),
    }
}

/// A box has a volume.
pub(super) fn check_box(at: &[&str; 2], min: [f64; 3], max: [f64; 3]) -> Checked {
    finite(&[at[0], at[1], "min"], &min)?;
    finite(&[at[0], at[1], "max"], &max)?;
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        if min[axis] >= max[axis] {
            let message = format!("min {} is not below max {} along {name}", min[axis], max[axis]);
            return fault(&[at[0], at[1], "min"], message, "give a box with a volume");
        }
    }
    Ok(())
}

fn check_room(at: &[&str; 2], room: &Room) -> Checked {
    let key = |name| [at[0], at[1], name];
    not_empty(&key("name"), &room.name)?;
    check_box(at, room.min, room.max)?;
    for corners in &room.windows {
        finite(&key("windows"), corners.as_flattened())?;
    }
    if let Some(point) = &room.looks_at {
        finite(&key("looks_at"), point)?;
    }
    Ok(())
}
