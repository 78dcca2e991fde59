//! A `site.toml` for people to go on from: what is set, and beside it, commented out, what could be.

use super::actor::{Actor, Ground, Walk};
use super::budget::Budget;
use super::detail::{Detail, DetailPattern};
use super::lamp::{self, Lamp};
use super::living::Thing;
use super::living_template::{write_living, write_thing};
use super::matte::Matte;
use super::prepare::{Prepare, Winding};
use super::types::{Albedo, Bake, Display, Part, Room, SiteFile, SiteInfo, Sky};
use super::values::ProbeTimes;
use super::weathering::Weathering;
use crate::config::write::{Writer, write_example};
use heliodon_math::unit::Unit;

/// An example of a room's windows.
const WINDOWS: &str = "[[[-2.0, 1.0, 20.0], [2.0, 1.0, 20.0], [-2.0, 2.5, 20.0]]]";

pub(super) fn write(site: &SiteFile) -> String {
    let mut w = Writer::default();
    w.line("# A site of Heliodon. Lengths in metres, +Y up, +X east, -Z north; angles in degrees; albedo linear.");
    w.line("# Lines that begin with # show what else can be said, with its default.");
    w.line("");
    write_info(&mut w, &site.site);
    for part in &site.parts {
        write_part(&mut w, part);
    }
    if site.parts.iter().all(|part| part.detail.is_empty()) {
        write_example(&mut w, |w| write_detail(w, &Detail::of_kind(DetailPattern::Stone), false));
    }
    write_sky(&mut w, &site.sky);
    write_bake(&mut w, &site.bake);
    match &site.weathering {
        Some(weathering) => write_weathering(&mut w, weathering),
        None => write_example(&mut w, |w| write_weathering(w, &Weathering::default())),
    }
    for room in &site.rooms {
        write_room(&mut w, room);
    }
    if site.rooms.is_empty() {
        w.line("\n# [[room]]  # the box where a visitor's eyes can be");
        w.line("# name = \"in front\"\n# min = [-2.0, 1.2, 20.0]\n# max = [2.0, 2.2, 24.0]");
        w.line(&format!("# windows = {WINDOWS}  # three corners each: lower left, lower right, upper left"));
        w.line("# looks_at = [0.0, 5.0, 0.0]  # at first");
    }
    for actor in &site.actors {
        write_actor(&mut w, actor);
    }
    if site.actors.is_empty() {
        write_example(&mut w, |w| write_actor(w, &Actor::at("walker.glb", [0.0, 0.0, 5.0])));
    }
    if site.actors.iter().all(|actor| actor.thing.is_none()) {
        write_example(&mut w, |w| write_thing(w, &Thing::default()));
    }
    for lamp in &site.lamps {
        write_lamp(&mut w, lamp);
    }
    if site.lamps.is_empty() {
        write_example(&mut w, |w| write_lamp(w, &Lamp::at([0.0, 2.0, 5.0], [10.0, 8.0, 5.0])));
    }
    for matte in &site.mattes {
        write_matte(&mut w, matte);
    }
    if site.mattes.is_empty() {
        let corners = [[-2.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 3.0, 0.0], [-2.0, 3.0, 0.0]];
        write_example(&mut w, |w| write_matte(w, &Matte::new(corners)));
    }
    write_living(&mut w, &site.living());
    match &site.prepare {
        Some(prepare) => write_prepare(&mut w, prepare),
        None => write_example(&mut w, |w| write_prepare(w, &Prepare::default())),
    }
    write_display(&mut w, &site.display);
    write_budget(&mut w, &site.budget);
    w.text
}

fn write_info(w: &mut Writer, info: &SiteInfo) {
    w.line("[site]");
    w.set("name", &info.name, "");
    w.absent("latitude_deg", info.latitude_deg.as_ref(), "37.9715", "north positive; sky models need it");
    w.absent("longitude_deg", info.longitude_deg.as_ref(), "23.7267", "east positive");
    w.optional("utc_offset", &info.utc_offset, &super::UtcOffset::default(), "in which all times here are written");
    w.optional("north_deg", &info.north_deg, &0.0, "compass bearing, clockwise, of the model's -Z");
    w.optional("origin", &info.origin, &[0.0; 3], "subtracted from all coordinates but those of rooms (survey coordinates)");
}

fn write_part(w: &mut Writer, part: &Part) {
    w.line("\n[[part]]");
    w.set("file", &part.file, "ply, obj, gltf, glb or stl; globs name several");
    w.absent("name", part.name.as_ref(), "\"temple\"", "default: from the file's name");
    w.set("role", part.role, "scan, ground, filling or prop");
    w.absent::<Albedo>("albedo", part.albedo.as_ref(), "[0.5, 0.5, 0.5]", "in place of the file's own colours; or an image");
    w.absent(
        "evidence",
        part.evidence.as_ref(),
        "\"evidence.png\"",
        "of an image of the albedo: white where it was seen, grey where it is guessed",
    );
    w.absent(
        "views",
        part.views.as_ref(),
        "\"views.json\"",
        "what single photographs saw of it, for who stands where they were taken",
    );
    w.optional("unit", &part.unit, &Unit::Metre, &Unit::ALL.map(Unit::name).join(", "));
    w.optional("up", &part.up, &super::UpAxis::Y, "y or z");
    w.optional("scale", &part.scale, &1.0, "first");
    w.optional("rotate_deg", &part.rotate_deg, &[0.0; 3], "then, about the fixed axes x, y, z in this order");
    w.optional("translate", &part.translate, &[0.0; 3], "last");
    w.absent("crease_deg", part.crease_deg.as_ref(), "60.0", "sharper edges are hard; default: the files' normals");
    w.optional("light", &part.light, &super::LightStorage::Auto, "auto, vertex or texel");
    w.optional("texels", &part.texels, &1.0, "along a metre, beside other parts lit by texels");
    w.absent("least_px", part.least_px.as_ref(), "8.0", "smaller objects are not drawn, where small things are left out");
    w.absent("weathering", part.weathering.as_ref(), "{ dust = 0.2 }", "in place of what [weathering] says; or false");
    if part.detail.is_empty() {
        w.absent::<Detail>("detail", None, "{ kind = \"stone\" }", "a fine pattern for who comes near: [part.detail]");
    }
    part.detail.iter().for_each(|detail| write_detail(w, detail, part.detail.len() > 1));
}

fn write_detail(w: &mut Writer, detail: &Detail, of_several: bool) {
    let default = Detail::of_kind(DetailPattern::Stone);
    let table = if of_several { "[[part.detail]]" } else { "[part.detail]" };
    w.line(&format!("\n{table}  # of the part above: a grey pattern on its surfaces, for who comes near"));
    w.absent(
        "material",
        detail.material.as_ref(),
        "\"wood*\"",
        "only on these of the files' materials: [[part.detail]] for several",
    );
    w.absent("kind", detail.kind.as_ref(), "\"stone\"", "noise, stone, plaster or wood; or an image:");
    w.absent("file", detail.file.as_ref(), "\"stone.png\"", "square, grey, 64 to 512 texels, of mean 128");
    w.optional("correct", &detail.correct, &false, "shift an image whose mean is not 128");
    w.absent("texels", detail.texels.as_ref(), "256", "along a side of a built-in kind: 64, 128, 256 or 512");
    w.absent("seed", detail.seed.as_ref(), "0", "of a built-in kind");
    w.optional("mapping", &detail.mapping, &default.mapping, "triplanar, or uv: by the part's texture coordinates");
    w.absent("size_m", detail.size_m.as_ref(), "1.0", "of triplanar: the length of a tile");
    w.absent("repeat", detail.repeat.as_ref(), "1.0", "of uv: tiles in a unit of the coordinates");
    w.optional("along", &detail.along, &default.along, "x, y or z: the axis along which fibres run, of triplanar");
    w.optional("strength", &detail.strength, &default.strength, "0 to 1");
    w.optional("near_m", &detail.near_m, &default.near_m, "full up to this distance, gone at twice as much");
}

fn write_sky(w: &mut Writer, sky: &Sky) {
    let default = Sky::default();
    w.line("\n[sky]");
    let probes = sky.probes.is_some();
    if !probes {
        w.line("# either a model of the clear sky, at the place that [site] gives:");
        write_model(w, sky);
        w.line("# or, in place of a model, photographs:");
    }
    w.absent("probes", sky.probes.as_ref(), "\"sky/*.hdr\"", "hdr or exr; globs name a series");
    w.absent("mapping", sky.mapping.as_ref(), "\"lat-long\"", "lat-long, angular, mirror-ball, cube-cross or fisheye");
    w.optional("times", &sky.times, &ProbeTimes::InNames, "from the files' names, or a list");
    w.optional("between", &sky.between, &default.between, "nearest or interpolate");
    w.optional("opening_deg", &sky.opening_deg, &default.opening_deg, "of a fisheye");
    w.absent("sun_irradiance", sky.sun_irradiance.as_ref(), "[1.0, 1.0, 1.0]", "where the probes' sun is clipped");
    w.optional("turn_deg", &sky.turn_deg, &default.turn_deg, "clockwise seen from above");
    w.optional("below_horizon", &sky.below_horizon, &default.below_horizon, "keep, black or mirror");
    if probes {
        w.line("# or, in place of photographs, a model of the clear sky at the place that [site] gives:");
        write_model(w, sky);
    }
}

fn write_model(w: &mut Writer, sky: &Sky) {
    w.absent("model", sky.model.as_ref(), "\"atmosphere\"", "atmosphere or hosek-wilkie");
    w.absent("date", sky.date.as_ref(), "\"2006-05-03\"", "years before 1 CE as -0437");
    w.absent("turbidity", sky.turbidity.as_ref(), "2.0", "2 very clear, 6 hazy");
}

fn write_bake(w: &mut Writer, bake: &Bake) {
    let default = Bake::default();
    w.line("\n[bake]");
    w.optional("sun_steps", &bake.sun_steps, &default.sun_steps, "1 to 1024");
    w.absent("sky_steps", bake.sky_steps.as_ref(), "184", "default: two for each sun step");
    w.absent("first", bake.first.as_ref(), "\"06:57\"", "default: the probes' first, or civil dawn");
    w.absent("last", bake.last.as_ref(), "\"17:34\"", "default: the probes' last, or civil dusk");
    w.optional("order", &bake.order, &default.order, "1: 4 coefficients, 2: 9");
    w.optional("bounces", &bake.bounces, &default.bounces, "");
    w.optional("samples", &bake.samples, &default.samples, "rays of each point");
    w.optional("seed", &bake.seed, &default.seed, "");
    w.absent("offset_m", bake.offset_m.as_ref(), "0.001", "how far off the surface rays start; default: from the scene");
    w.absent("grid_m", bake.grid_m.as_ref(), "0.5", "between points of space that light actors, in rooms and along paths");
    w.absent("texels", bake.texels.as_ref(), "2048", "along a side of the atlas that lights parts in texels");
    w.optional("transfer", &bake.transfer, &default.transfer, "mono or rgb");
    w.optional("sun_bounce", &bake.sun_bounce, &default.sun_bounce, "the sun's own bounced light");
}

fn write_room(w: &mut Writer, room: &Room) {
    w.line("\n[[room]]");
    w.set("name", &room.name, "the box where a visitor's eyes can be");
    w.set("min", room.min, "once [site] origin is subtracted");
    w.set("max", room.max, "");
    let windows = Some(&room.windows).filter(|windows| !windows.is_empty());
    w.absent("windows", windows, WINDOWS, "three corners each: lower left, lower right, upper left");
    w.absent("looks_at", room.looks_at.as_ref(), "[0.0, 5.0, 0.0]", "at first");
}

fn write_lamp(w: &mut Writer, lamp: &Lamp) {
    w.line("\n[[light]]  # a lamp, beside sun and sky");
    w.absent("name", lamp.name.as_ref(), "\"oil lamp\"", "for people");
    w.set("place", lamp.place, "");
    w.set("intensity", lamp.intensity, "irradiance one metre away, in the unit of the sky's");
    w.absent("look_at", lamp.look_at.as_ref(), "[0.0, 0.0, 0.0]", "makes it a spot light");
    w.optional("angle_deg", &lamp.angle_deg, &lamp::angle_deg(), "of a spot light's cone");
    w.optional("edge", &lamp.edge, &lamp::edge(), "the part of the half angle in which a spot light fades");
    w.optional("reach_m", &lamp.reach_m, &lamp::reach_m(), "where its light is faded out");
    w.optional("shadows", &lamp.shadows, &true, "");
}

fn write_matte(w: &mut Writer, matte: &Matte) {
    w.line("\n[[matte]]  # invisible: what lies behind it is not drawn; belongs inside walls");
    w.absent("name", matte.name.as_ref(), "\"inside the back wall\"", "for people");
    w.set("corners", &matte.corners, "three or more around it, planar and convex");
}

fn write_actor(w: &mut Writer, actor: &Actor) {
    w.line("\n[[actor]]  # a figure that stands or walks, lit by the place where it is");
    w.set("file", &actor.file, "ply, obj, gltf, glb or stl; or an impostor, .impostor.ktx2");
    w.optional("count", &actor.count, &1, "of an impostor: how many there are");
    w.optional("spread_m", &actor.spread_m, &0.0, "how far off the place or to the sides of the path they are");
    w.optional("seed", &actor.seed, &0, "scatters them in another way");
    w.absent("name", actor.name.as_ref(), "\"walker\"", "default: from the file's name");
    w.absent("cache", actor.cache.as_ref(), "\"cloth.pc2\"", "a vertex cache for the file's vertices");
    w.absent("cache_frames_per_s", actor.cache_frames_per_s.as_ref(), "25.0", "of the cache, whose file does not say");
    w.absent("animation", actor.animation.as_ref(), "\"walk\"", "default: the file's first");
    w.optional("speed", &actor.speed, &1.0, "of the animation");
    w.absent("place", actor.place.as_ref(), "[0.0, 0.0, 5.0]", "of the model's origin; or:");
    w.absent("path", actor.path.as_ref(), "[[-2.0, 0.0, 5.0], [2.0, 0.0, 5.0]]", "points between which it walks");
    w.optional("walk_speed", &actor.walk_speed, &super::DEFAULT_WALK_SPEED, "metres a second");
    w.optional("walk", &actor.walk, &Walk::Circle, "circle, back-and-forth or once");
    let ground = "check, follow (the bake puts it onto what is beneath) or ignore (it hangs or flies)";
    w.optional("ground", &actor.ground, &Ground::Check, ground);
    w.optional("turn_deg", &actor.turn_deg, &0.0, "about +Y, after it faces along its path");
    w.optional("unit", &actor.unit, &Unit::Metre, &Unit::ALL.map(Unit::name).join(", "));
    w.optional("up", &actor.up, &super::UpAxis::Y, "y or z; +Z of the model then looks forward");
    w.optional("scale", &actor.scale, &1.0, "");
    w.optional("rotate_deg", &actor.rotate_deg, &[0.0; 3], "of the model itself");
    w.absent::<Albedo>("albedo", actor.albedo.as_ref(), "[0.5, 0.5, 0.5]", "in place of the file's own colours; or an image");
    match &actor.thing {
        Some(thing) => write_thing(w, thing),
        None => w.absent::<Thing>("thing", None, "{ carried = true }", "it can be touched and taken: [actor.thing]"),
    }
}

fn write_prepare(w: &mut Writer, prepare: &Prepare) {
    let default = Prepare::default();
    w.line(
        "\n[prepare]  # geometry is cleaned and reduced to what a visitor can tell apart; without this table it stays as it is",
    );
    w.optional(
        "clean",
        &prepare.clean,
        &default.clean,
        "weld vertices, drop degenerate and doubled faces, mend T-junctions of what is modelled",
    );
    w.optional("weld_m", &prepare.weld_m, &default.weld_m, "vertices nearer than this become one");
    w.optional("isolated_m", &prepare.isolated_m, &default.isolated_m, "loose pieces smaller than this are left out");
    w.optional("winding", &prepare.winding, &Winding::Mend, "mend or report");
    w.optional("solids", &prepare.solids, &default.solids, "unite fillings and props that run into each other");
    w.optional("error_px", &prepare.error_px, &default.error_px, "simplify so far, in pixels from the nearest room; 0: not");
    w.optional("edge_px", &prepare.edge_px, &default.edge_px, "the grain of light, in the same pixels");
    w.optional("nearest_m", &prepare.nearest_m, &default.nearest_m, "no eye comes nearer to stone");
    w.absent("error_m", prepare.error_m.as_ref(), "0.002", "in place of error_px where there are no rooms; no default");
    w.absent("edge_m", prepare.edge_m.as_ref(), "0.02", "in place of edge_px where there are no rooms; no default");
    w.optional(
        "triangles",
        &prepare.triangles,
        &default.triangles,
        "about as many are drawn; error and edge grow until it fits; 0: no limit",
    );
    w.optional("purge", &prepare.purge, &default.purge, "drop what no eye in any room can see; it still gives shadow");
    w.optional("ring", &prepare.ring, &default.ring, "rings of neighbours kept around what is seen");
    let effort = "preview, usual or archival: how much is looked at before a face counts as unseen";
    w.optional("purge_effort", &prepare.purge_effort, &default.purge_effort, effort);
    let seen = "texels along a side of what the room's middle sees of the original, laid over what is drawn: 1024; 0: none";
    w.optional("panorama", &prepare.panorama, &default.panorama, seen);
    w.optional("scan", &prepare.scan, &default.scan, "the scan itself beside it, for eyes at rest");
}

fn write_weathering(w: &mut Writer, weathering: &Weathering) {
    let default = Weathering::default();
    w.line("\n[weathering]  # dust and corrosion over the albedo; light bounces as without them");
    w.optional("dust", &weathering.dust, &default.dust, "how far it covers where it lies thickest, 0 to 1");
    w.optional("corrosion", &weathering.corrosion, &default.corrosion, "how far it shows where rain and sky reach, 0 to 1");
    w.optional("dust_color", &weathering.dust_color, &default.dust_color, "albedo, linear");
    w.optional("corrosion_color", &weathering.corrosion_color, &default.corrosion_color, "");
    w.absent(
        "wind_from_deg",
        weathering.wind_from_deg.as_ref(),
        "225.0",
        "compass bearing that rain is driven from; default: none prevails",
    );
    w.optional("wind_m_per_s", &weathering.wind_m_per_s, &default.wind_m_per_s, "at the walls, while it rains");
}

fn write_display(w: &mut Writer, display: &Display) {
    let default = Display::default();
    w.line(if *display == default { "\n# [display]" } else { "\n[display]" });
    w.optional("width_px", &display.width_px, &default.width_px, "");
    w.optional("height_px", &display.height_px, &default.height_px, "");
    w.optional("fov_deg", &display.fov_deg, &default.fov_deg, "vertical");
}

fn write_budget(w: &mut Writer, budget: &Budget) {
    w.line(if budget.is_empty() { "\n# [budget]" } else { "\n[budget]" });
    let bake = "memory that bake and prepare may take, MiB; default: what they need";
    w.absent("bake_mib", budget.bake_mib.as_ref(), "8192", bake);
    let viewer = "beyond an empty window's, MiB; check and bake warn where the bundle needs more";
    w.absent("viewer_mib", budget.viewer_mib.as_ref(), "1024", viewer);
}
