//! The tables of what happens, for people to go on from.

use super::living::{
    Echo, Faces, Film, Living, Material, ParticleKind, Particles, Region, SoundSource, Story, Thing, View, Walls, Way,
};
use crate::config::write::{Writer, write_example};

/// What is there, and of what is not an example.
pub(super) fn write_living(w: &mut Writer, living: &Living) {
    write_all(w, &living.regions, &example_region(), write_region);
    let view = View { name: "door".to_owned(), place: [0.0, 1.7, 9.0], look_at: [0.0, 3.0, 0.0] };
    write_all(w, &living.views, &view, write_view);
    let way = Way { name: "round".to_owned(), points: vec![[0.0, 0.0, 6.0], [3.0, 0.0, 0.0]] };
    write_all(w, &living.paths, &way, write_way);
    let gold = Material { name: "gold".to_owned(), albedo: [0.94, 0.72, 0.3], grain: 0.0, metal: 1.0 };
    write_all(w, &living.materials, &gold, write_material);
    write_all(w, &living.films, &example_film(), write_film);
    write_all(w, &living.sounds, &example_sound(), write_sound);
    let Region { name, min, max } = example_region();
    let echo = Echo { name, min, max, walls: Walls::Stone, level: 1.0 };
    write_all(w, &living.echoes, &echo, write_echo);
    let fire = Particles {
        name: "fire".to_owned(),
        kind: ParticleKind::Fire,
        place: [3.0, 0.0, 0.0],
        extent: [0.2; 3],
        density: 1.0,
        size: 1.0,
        plays: true,
    };
    write_all(w, &living.particles, &fire, write_particles);
    let story = Story { scripts: vec!["story.rhai".to_owned()], texts: None, language: None, font: None, remembers: true };
    write_all(w, living.story.as_slice(), &story, write_story);
}

fn write_all<T>(w: &mut Writer, tables: &[T], example: &T, write: impl Fn(&mut Writer, &T)) {
    tables.iter().for_each(|table| write(w, table));
    if tables.is_empty() {
        write_example(w, |w| write(w, example));
    }
}

fn example_region() -> Region {
    Region { name: "hall".to_owned(), min: [-4.0, 0.0, -8.0], max: [4.0, 6.0, 8.0] }
}

fn example_film() -> Film {
    Film {
        name: "mason".to_owned(),
        file: Some("mason.mp4".to_owned()),
        kind: None,
        mask: None,
        place: [0.0; 3],
        height_m: 1.8,
        faces: Faces::Visitor,
        turn_deg: 0.0,
        repeat: true,
        plays: true,
        with_clock: false,
        lit: 1.0,
        volume: 1.0,
        leads: None,
        surface: None,
    }
}

fn example_sound() -> SoundSource {
    SoundSource {
        name: "fire".to_owned(),
        file: None,
        kind: Some("fire".to_owned()),
        seed: 0,
        from: None,
        place: Some([3.0, 1.0, 0.0]),
        reference_m: 1.0,
        volume: 1.0,
        repeat: false,
        plays: false,
        hours: Vec::new(),
    }
}

fn write_region(w: &mut Writer, region: &Region) {
    w.line("\n[[region]]  # a box that visitors enter and leave");
    w.set("name", &region.name, "");
    w.set("min", region.min, "");
    w.set("max", region.max, "");
}

fn write_view(w: &mut Writer, view: &View) {
    w.line("\n[[view]]  # a place to look from");
    w.set("name", &view.name, "");
    w.set("place", view.place, "of the eyes");
    w.set("look_at", view.look_at, "");
}

fn write_way(w: &mut Writer, way: &Way) {
    w.line("\n[[path]]  # a way for actors and visitors");
    w.set("name", &way.name, "");
    w.set("points", &way.points, "");
}

fn write_material(w: &mut Writer, material: &Material) {
    w.line("\n[[material]]  # what parts can be covered with");
    w.set("name", &material.name, "");
    w.set("albedo", material.albedo, "");
    w.optional("grain", &material.grain, &0.0, "how much of the part's own shades stays, 0 to 1");
    w.optional("metal", &material.metal, &0.0, "how much it shines like metal, 0 to 1");
}

fn write_film(w: &mut Writer, film: &Film) {
    w.line("\n[[film]]  # a film on an upright surface");
    w.set("name", &film.name, "");
    w.absent("file", film.file.as_ref(), "\"mason.mp4\"", "mp4 or webm");
    w.absent("kind", film.kind.as_ref(), "\"water\"", "in place of a file, on a part: embers or water");
    w.absent("mask", film.mask.as_ref(), "\"mason_mask.mp4\"", "of the pair that `heliodon key` makes");
    w.set("place", film.place, "of the middle of its lower edge");
    w.optional("height_m", &film.height_m, &1.8, "");
    w.optional("faces", &film.faces, &Faces::Visitor, "visitor or fixed");
    w.optional("turn_deg", &film.turn_deg, &0.0, "where it looks if it is fixed");
    w.optional("repeat", &film.repeat, &true, "");
    w.optional("plays", &film.plays, &true, "from the beginning; else a script starts it");
    w.optional("with_clock", &film.with_clock, &false, "it stands still while the hour does");
    w.optional("lit", &film.lit, &1.0, "0 shines by itself, 1 is lit as what stands beside it");
    w.optional("volume", &film.volume, &1.0, "");
    w.absent("leads", film.leads.as_ref(), "\"round\"", "a path along which it goes ahead of the visitor");
    w.absent("surface", film.surface.as_ref(), "\"panel\"", "a part that shows it in place of its colour");
}

fn write_sound(w: &mut Writer, sound: &SoundSource) {
    w.line("\n[[sound]]  # a source of sound");
    w.set("name", &sound.name, "");
    w.absent("kind", sound.kind.as_ref(), "\"fire\"", "one that is made, see `heliodon sound`; or a file:");
    w.absent("file", sound.file.as_ref(), "\"bell.ogg\"", "wav, ogg, flac or mp3");
    w.optional("seed", &sound.seed, &0, "of one that is made");
    w.absent("place", sound.place.as_ref(), "[3.0, 1.0, 0.0]", "default: all around");
    w.absent("from", sound.from.as_ref(), "\"guide\"", "in place of it, an actor that it goes with");
    w.optional("reference_m", &sound.reference_m, &1.0, "where it has its own level");
    w.optional("volume", &sound.volume, &1.0, "");
    w.optional("repeat", &sound.repeat, &false, "");
    w.optional("plays", &sound.plays, &false, "from the beginning; else a script starts it");
    w.optional("hours", &sound.hours, &Vec::new(), "its level through the day: [[\"06:00\", 0.2], [\"20:00\", 1.0]]");
}

fn write_echo(w: &mut Writer, echo: &Echo) {
    w.line("\n[[echo]]  # a box with an echo of its own");
    w.set("name", &echo.name, "");
    w.set("min", echo.min, "");
    w.set("max", echo.max, "");
    w.optional("walls", &echo.walls, &Walls::Stone, "stone, plaster, wood or soft");
    w.optional("level", &echo.level, &1.0, "how loud it is beside that of such a box");
}

fn write_particles(w: &mut Writer, particles: &Particles) {
    w.line("\n[[particles]]  # many small things in the air");
    w.set("name", &particles.name, "");
    w.set("kind", particles.kind, "dust, smoke, fire, sparks or water");
    w.set("place", particles.place, "");
    w.optional("extent", &particles.extent, &[0.2; 3], "how far from it they come");
    w.optional("density", &particles.density, &1.0, "");
    w.optional("size", &particles.size, &1.0, "");
    w.optional("plays", &particles.plays, &true, "from the beginning; else a script starts them");
}

fn write_story(w: &mut Writer, story: &Story) {
    w.line("\n[story]  # what happens: `heliodon script manual`");
    w.set("scripts", &story.scripts, "");
    w.absent("texts", story.texts.as_ref(), "\"texts.toml\"", "what they say, in several languages");
    w.absent("language", story.language.as_ref(), "\"en\"", "default: the texts' first");
    w.absent("font", story.font.as_ref(), "\"NotoSansGeorgian.ttf\"", "for letters other than Latin, Greek and Cyrillic");
    w.optional("remembers", &story.remembers, &true, "whether what they remember is kept between visits");
}

/// What makes an actor a thing.
pub(super) fn write_thing(w: &mut Writer, thing: &Thing) {
    w.line("\n[actor.thing]  # of the actor above: it can be touched and taken");
    w.optional("carried", &thing.carried, &false, "a hand can take it away");
    w.optional("tool", &thing.tool, &false, "it strikes what it meets");
    w.absent("brings", thing.brings.as_ref(), "\"gold\"", "the material that it brings onto what it touches");
    w.optional("hidden", &thing.hidden, &false, "a script shows it");
}
