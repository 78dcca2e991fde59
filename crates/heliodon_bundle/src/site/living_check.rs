//! What makes tables of what happens sensible ones.

use super::check::{check_box, check_color};
use super::living::{Film, Living, Material, Particles, SoundSource, Story};
use super::types::{Part, SiteFile};
use crate::config::rules::{COORDINATES_M, Checked, fault, finite, not_empty, within};

/// The most of one kind.
const MAX_OF_A_KIND: usize = 4096;

/// What is wrong with what happens in a bundle.
pub(crate) fn check_lone_living(living: &Living) -> Result<(), String> {
    check_living(living).map_err(|fault| format!("{}: {}", fault.path.join("."), fault.message))
}

/// Every table by itself, and names against one another.
pub(super) fn check_living(living: &Living) -> Checked {
    check_names("region", living.regions.iter().map(|region| region.name.as_str()))?;
    check_names("view", living.views.iter().map(|view| view.name.as_str()))?;
    check_names("path", living.paths.iter().map(|way| way.name.as_str()))?;
    check_names("material", living.materials.iter().map(|material| material.name.as_str()))?;
    check_names("film", living.films.iter().map(|film| film.name.as_str()))?;
    check_names("sound", living.sounds.iter().map(|sound| sound.name.as_str()))?;
    check_names("echo", living.echoes.iter().map(|echo| echo.name.as_str()))?;
    check_names("particles", living.particles.iter().map(|particles| particles.name.as_str()))?;
    for (i, region) in living.regions.iter().enumerate() {
        check_box(&["region", &i.to_string()], region.min, region.max)?;
    }
    for (i, echo) in living.echoes.iter().enumerate() {
        check_box(&["echo", &i.to_string()], echo.min, echo.max)?;
        within(&["echo", &i.to_string(), "level"], echo.level, 0.0, 4.0)?;
    }
    for (i, view) in living.views.iter().enumerate() {
        let index = i.to_string();
        finite(&["view", &index, "place"], &view.place)?;
        finite(&["view", &index, "look_at"], &view.look_at)?;
        if view.place == view.look_at {
            return fault(&["view", &index, "look_at"], "the view looks at its own place", "give a point in front of it");
        }
    }
    for (i, way) in living.paths.iter().enumerate() {
        let index = i.to_string();
        let key = ["path", &index, "points"];
        finite(&key, way.points.as_flattened())?;
        if way.points.len() < 2 || way.points.iter().all(|point| *point == way.points[0]) {
            return fault(&key, "the path leads nowhere", "give at least two different points");
        }
    }
    for (i, material) in living.materials.iter().enumerate() {
        check_material(&["material", &i.to_string()], material)?;
    }
    for (i, film) in living.films.iter().enumerate() {
        check_film(&["film", &i.to_string()], film, living)?;
    }
    for (i, sound) in living.sounds.iter().enumerate() {
        check_sound(&["sound", &i.to_string()], sound)?;
    }
    for (i, particles) in living.particles.iter().enumerate() {
        check_particles(&["particles", &i.to_string()], particles)?;
    }
    living.story.as_ref().map_or(Ok(()), check_story)
}

/// What actors bring are materials, sounds come from actors that there are, and films are on parts that there are.
pub(super) fn check_things(site: &SiteFile) -> Checked {
    for (i, sound) in site.sounds.iter().enumerate() {
        let Some(from) = &sound.from else { continue };
        let key = ["sound", &i.to_string(), "from"];
        if sound.place.is_some() {
            return fault(&key, "it has a place and comes from an actor", "take one of them out");
        }
        if !site.actors.iter().any(|actor| actor.display_name() == from) {
            return fault(&key, format!("there is no actor `{from}`"), "give the name of an [[actor]]");
        }
    }
    for (i, film) in site.films.iter().enumerate() {
        let Some(surface) = &film.surface else { continue };
        let key = ["film", &i.to_string(), "surface"];
        if film.leads.is_some() {
            return fault(&key, "it is on a part and leads along a path", "take one of them out");
        }
        let known: Vec<String> = site.parts.iter().map(Part::display_name).collect();
        if !known.contains(surface) {
            return fault(&key, format!("there is no part `{surface}`"), format!("there are: {}", known.join(", ")));
        }
    }
    for (i, actor) in site.actors.iter().enumerate() {
        let Some(brings) = actor.thing.as_ref().and_then(|thing| thing.brings.as_ref()) else { continue };
        if !site.materials.iter().any(|material| material.name == *brings) {
            let known: Vec<&str> = site.materials.iter().map(|material| material.name.as_str()).collect();
            let remedy =
                if known.is_empty() { "add a [[material]]".to_owned() } else { format!("there are: {}", known.join(", ")) };
            let key = ["actor", &i.to_string(), "thing", "brings"];
            return fault(&key, format!("there is no material `{brings}`"), remedy);
        }
    }
    Ok(())
}

/// There are not too many, each has a name, and no two have the same.
fn check_names<'a>(table: &str, names: impl Iterator<Item = &'a str>) -> Checked {
    let mut known: std::collections::HashSet<&str> = std::collections::HashSet::new();
    for (i, name) in names.enumerate() {
        let index = i.to_string();
        let key = [table, &index, "name"];
        not_empty(&key, name)?;
        if !known.insert(name) {
            return fault(&key, format!("two tables [[{table}]] are called `{name}`"), "give each a name of its own");
        }
        if i == MAX_OF_A_KIND {
            return fault(&key, format!("more than {MAX_OF_A_KIND} tables [[{table}]]"), "take some out");
        }
    }
    Ok(())
}

fn check_material(at: &[&str; 2], material: &Material) -> Checked {
    let key = |name| [at[0], at[1], name];
    check_color(&key("albedo"), material.albedo)?;
    within(&key("grain"), material.grain, 0.0, 1.0)?;
    within(&key("metal"), material.metal, 0.0, 1.0)
}

fn check_film(at: &[&str; 2], film: &Film, living: &Living) -> Checked {
    let key = |name| [at[0], at[1], name];
    match (&film.file, film.kind) {
        (Some(_), Some(_)) => return fault(&key("kind"), "the film has both a file and a kind", "take one of the two out"),
        (None, None) => {
            return fault(at, "the film has neither a file nor a kind", "add file = \"guide.mp4\", or kind = \"water\"");
        }
        (Some(file), None) => not_empty(&key("file"), file)?,
        (None, Some(_)) if film.surface.is_none() => {
            return fault(&key("kind"), "what is made is for a part", "add surface = \"NAME\" of a part");
        }
        (None, Some(_)) => {}
    }
    if let Some(mask) = &film.mask {
        not_empty(&key("mask"), mask)?;
        if film.file.is_none() {
            return fault(&key("mask"), "a mask without an image", "add the pair's image as file");
        }
    }
    finite(&key("place"), &film.place)?;
    finite(&key("turn_deg"), &[film.turn_deg])?;
    if !(film.height_m > 0.0 && COORDINATES_M.contains(&film.height_m)) {
        return fault(&key("height_m"), format!("height_m is {}", film.height_m), "give metres above 0");
    }
    within(&key("lit"), film.lit, 0.0, 1.0)?;
    within(&key("volume"), film.volume, 0.0, 64.0)?;
    match &film.leads {
        Some(path) if !living.paths.iter().any(|way| way.name == *path) => {
            let known: Vec<&str> = living.paths.iter().map(|way| way.name.as_str()).collect();
            let remedy =
                if known.is_empty() { "add a [[path]]".to_owned() } else { format!("there are: {}", known.join(", ")) };
            fault(&key("leads"), format!("there is no path `{path}`"), remedy)
        }
        _ => Ok(()),
    }
}

fn check_sound(at: &[&str; 2], sound: &SoundSource) -> Checked {
    let key = |name| [at[0], at[1], name];
    match (&sound.file, &sound.kind) {
        (Some(_), Some(_)) => {
            return fault(&key("kind"), "the sound has both a file and a kind", "take one of the two out");
        }
        (None, None) => {
            let remedy = "add file = \"sounds/bell.wav\", or a kind of `heliodon sound`: kind = \"fire\"";
            return fault(at, "the sound has neither a file nor a kind", remedy);
        }
        (Some(file), None) => not_empty(&key("file"), file)?,
        (None, Some(kind)) => not_empty(&key("kind"), kind)?,
    }
    if let Some(place) = &sound.place {
        finite(&key("place"), place)?;
    }
    within(&key("reference_m"), sound.reference_m, 0.01, 1000.0)?;
    within(&key("volume"), sound.volume, 0.0, 64.0)?;
    for (_, level) in &sound.hours {
        within(&key("hours"), *level, 0.0, 64.0)?;
    }
    if let Some(pair) = sound.hours.windows(2).find(|pair| pair[0].0 >= pair[1].0) {
        let message = format!("{} comes after {}", pair[1].0, pair[0].0);
        return fault(&key("hours"), message, "list times in the order of the day, each once");
    }
    Ok(())
}

fn check_particles(at: &[&str; 2], particles: &Particles) -> Checked {
    let key = |name| [at[0], at[1], name];
    finite(&key("place"), &particles.place)?;
    finite(&key("extent"), &particles.extent)?;
    if particles.extent.iter().any(|&metres| metres < 0.0) {
        return fault(&key("extent"), "extent is below 0", "give three lengths from 0 up, metres");
    }
    within(&key("density"), particles.density, 0.0, 500.0)?;
    within(&key("size"), particles.size, 0.01, 100.0)
}

fn check_story(story: &Story) -> Checked {
    if story.scripts.is_empty() {
        return fault(&["story", "scripts"], "the story has no scripts", "add scripts = [\"story.rhai\"], or take [story] out");
    }
    for (i, script) in story.scripts.iter().enumerate() {
        not_empty(&["story", "scripts", &i.to_string()], script)?;
        if story.scripts[..i].contains(script) {
            let message = format!("`{script}` is listed twice");
            return fault(&["story", "scripts", &i.to_string()], message, "list each script once");
        }
    }
    if let Some(language) = &story.language {
        not_empty(&["story", "language"], language)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use crate::site::Site;

    /// A site with more after it.
    fn told(more: &str) -> Result<Site, String> {
        let site = format!(
            "[site]\nname = \"s\"\n[[part]]\nfile = \"a.obj\"\n[sky]\nprobes = \"g.hdr\"\nmapping = \"lat-long\"\n{more}\n"
        );
        Site::parse(&site, "site.toml").map_err(|error| error.to_string())
    }

    #[test]
    fn a_living_site_is_taken() {
        let more = r#"
            [[region]]
            name = "workshop"
            min = [0.0, 0.0, 0.0]
            max = [1.0, 2.0, 1.0]
            [[view]]
            name = "door"
            place = [0.0, 1.7, 3.0]
            look_at = [0.0, 1.7, 0.0]
            [[path]]
            name = "round"
            points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
            [[material]]
            name = "gold"
            albedo = [1.0, 0.7, 0.3]
            metal = 1.0
            [[film]]
            name = "guide"
            file = "image.mp4"
            mask = "mask.mp4"
            place = [0.0, 0.0, 0.0]
            leads = "round"
            [[sound]]
            name = "birds"
            kind = "birds"
            hours = [["05:00", 0.0], ["07:00", 1.0]]
            [[echo]]
            name = "hall"
            min = [0.0, 0.0, 0.0]
            max = [9.0, 9.0, 9.0]
            walls = "plaster"
            [[particles]]
            name = "hearth"
            kind = "fire"
            place = [0.0, 0.0, 0.0]
            [story]
            scripts = ["story.rhai"]
            [[actor]]
            file = "mallet.glb"
            place = [0.0, 0.0, 0.0]
            thing = { carried = true, tool = true, brings = "gold" }"#;
        let site = told(more).unwrap();
        let written = site.file().to_toml_string();
        let read = Site::parse(&written, "site.toml").unwrap_or_else(|error| panic!("{error}\n{written}"));
        assert_eq!(read.file(), site.file(), "{written}");
    }

    #[test]
    fn what_cannot_be_is_told_with_its_place() {
        let wrong = |more: &str, wanted: &str| {
            let message = told(more).unwrap_err();
            assert!(message.contains(wanted), "{message}");
        };
        wrong("[[region]]\nname = \"a\"\nmin = [0.0, 0.0, 0.0]\nmax = [1.0, 0.0, 1.0]", "not below max 0 along y");
        wrong("[[view]]\nname = \"a\"\nplace = [0.0, 0.0, 0.0]\nlook_at = [0.0, 0.0, 0.0]", "looks at its own place");
        wrong("[[path]]\nname = \"a\"\npoints = [[0.0, 0.0, 0.0]]", "leads nowhere");
        let region = "[[region]]\nname = \"a\"\nmin = [0.0, 0.0, 0.0]\nmax = [1.0, 1.0, 1.0]\n";
        wrong(&region.repeat(2), "two tables [[region]] are called `a`");
        wrong("[[material]]\nname = \"gold\"\nalbedo = [255.0, 0.0, 0.0]", "albedo holds 255");
        wrong("[[film]]\nname = \"a\"\nfile = \"a.mp4\"\nplace = [0.0, 0.0, 0.0]\nleads = \"up\"", "there is no path `up`");
        let film = "[[film]]\nname = \"a\"\nfile = \"a.mp4\"\nplace = [0.0, 0.0, 0.0]\nsurface = \"b\"";
        wrong(film, "there is no part `b`");
        wrong("[[film]]\nname = \"a\"\nplace = [0.0, 0.0, 0.0]", "neither a file nor a kind");
        wrong("[[film]]\nname = \"a\"\nkind = \"water\"\nplace = [0.0, 0.0, 0.0]", "what is made is for a part");
        wrong("[[film]]\nname = \"a\"\nkind = \"lava\"\nplace = [0.0, 0.0, 0.0]", "unknown value `lava`");
        let path = "[[path]]\nname = \"p\"\npoints = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]\n";
        wrong(&format!("{path}{film}\nleads = \"p\""), "on a part and leads");
        wrong("[[sound]]\nname = \"a\"", "neither a file nor a kind");
        wrong("[[sound]]\nname = \"a\"\nkind = \"a\"\nhours = [[\"07:00\", 1.0], [\"05:00\", 1.0]]", "05:00 comes after 07:00");
        wrong("[story]\nscripts = [\"a.rhai\", \"a.rhai\"]", "listed twice");
        wrong("[[particles]]\nname = \"a\"\nkind = \"fog\"\nplace = [0.0, 0.0, 0.0]", "unknown value `fog`");
        let thing = "[[actor]]\nfile = \"a.glb\"\nplace = [0.0, 0.0, 0.0]\nthing = { brings = \"gold\" }";
        wrong(thing, "there is no material `gold`");
    }
}
