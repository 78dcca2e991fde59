//! A `display.toml` for people to go on from: what is set, and beside it, commented out, what could be.

use super::types::{
    Blend, BodyEntry, BodyKind, Control, Correction, DisplayFile, DisplayInfo, Headset, InputSettings, Kiosk, MonitorName,
    Output, Place, Protocol, ScreenEntry, Stereo, TrackerEntry,
};
use crate::config::write::{Writer, write_example};

pub(super) fn write(file: &DisplayFile) -> String {
    let mut w = Writer::default();
    w.line("# A display of Heliodon: its screens, its trackers, its keys. Lengths in metres in the room where it stands: +Y up from the floor,");
    w.line("# -Z ahead, the visitor's right +X. Lines that begin with # show what else can be said, with its default.");
    w.line("");
    write_info(&mut w, &file.display);
    write_place(&mut w, &file.place);
    if file.screens.is_empty() {
        write_example(&mut w, |w| write_screen(w, &example_screen()));
    }
    file.screens.iter().for_each(|screen| write_screen(&mut w, screen));
    if file.trackers.iter().all(|tracker| tracker.protocol != Protocol::Osc) {
        write_example(&mut w, |w| write_tracker(w, &example_tracker()));
    }
    file.trackers.iter().for_each(|tracker| write_tracker(&mut w, tracker));
    write_input(&mut w, &file.input);
    write_headset(&mut w, &file.headset);
    match &file.kiosk {
        Some(kiosk) => write_kiosk(&mut w, kiosk),
        None => write_example(&mut w, |w| write_kiosk(w, &Kiosk::default())),
    }
    match &file.control {
        Some(control) => write_control(&mut w, control),
        None => write_example(&mut w, |w| write_control(w, &Control::default())),
    }
    w.text
}

/// What stands in a file without screens for the one to write.
fn example_screen() -> ScreenEntry {
    ScreenEntry {
        name: "front".to_owned(),
        corners: [[-1.6, 0.0, -2.0], [1.6, 0.0, -2.0], [-1.6, 2.4, -2.0]],
        stereo: Stereo::Mono,
        output: Output { monitor: Some(MonitorName::Number(1)), ..Output::default() },
        output_right: None,
        blend: Blend::default(),
        colour: Correction::default(),
    }
}

fn example_tracker() -> TrackerEntry {
    let head = BodyEntry { is: BodyKind::Head, address: Some("/head".to_owned()), id: None, flystick: None, offset: [0.0; 3] };
    TrackerEntry {
        listen: Some("127.0.0.1:5000".to_owned()),
        bodies: vec![head],
        ..TrackerEntry::new("optical", Protocol::Osc)
    }
}

fn write_info(w: &mut Writer, info: &DisplayInfo) {
    let default = DisplayInfo::default();
    w.line("[display]");
    w.set("name", &info.name, "");
    w.optional("eye", &info.eye, &default.eye, "where the middle between the eyes rests while nobody is tracked");
    w.optional("eye_separation_m", &info.eye_separation_m, &default.eye_separation_m, "");
    w.optional("near_m", &info.near_m, &default.near_m, "nothing nearer is drawn");
    w.absent("far_m", info.far_m.as_ref(), "10000.0", "nothing farther is drawn; default: no end");
    w.optional("passes", &info.passes, &default.passes, "in which both eyes are drawn: auto, one or two");
    w.optional("navigation", &info.navigation, &default.navigation, "or window, walk, guided");
    w.absent("hud", info.hud.as_ref(), "\"none\"", "the screen with text and timeline; default: the first");
}

fn write_place(w: &mut Writer, place: &Place) {
    let default = Place::default();
    w.line(if *place == default { "\n# [place]" } else { "\n[place]" });
    w.absent("room", place.room.as_ref(), "\"in front\"", "the site's room whose middle the eye rests at; default: the first");
    w.absent("at", place.at.as_ref(), "[0.0, 0.0, 20.0]", "where this room's origin is in the site, in place of that");
    w.absent("heading_deg", place.heading_deg.as_ref(), "0.0", "where -Z points, clockwise from the site's -Z");
    w.optional("scale", &place.scale, &default.scale, "metres of the site for each metre of the room");
}

fn write_screen(w: &mut Writer, screen: &ScreenEntry) {
    w.line("\n[[screen]]");
    w.set("name", &screen.name, "");
    w.set("corners", screen.corners, "lower left, lower right, upper left");
    let ways = "or side-by-side, top-bottom, rows, columns, checkerboard, anaglyph, pair, left, right";
    w.optional("stereo", &screen.stereo, &Stereo::default(), ways);
    let places = "or { monitor = \"HDMI-1\" }, { window = [0, 0, 1024, 768] }, { image = \"left.png\", size_px = [1024, 768] }";
    w.set("output", &screen.output, places);
    w.absent("output_right", screen.output_right.as_ref(), "{ monitor = 2 }", "the right eye's, where stereo is \"pair\"");
    w.optional("blend", &screen.blend, &Blend::default(), "parts of the picture that overlap with a neighbour's");
    w.optional("colour", &screen.colour, &Correction::default(), "");
}

fn write_tracker(w: &mut Writer, tracker: &TrackerEntry) {
    let default = TrackerEntry::new("", tracker.protocol);
    w.line("\n[[tracker]]");
    w.set("name", &tracker.name, "");
    w.set("protocol", tracker.protocol, "osc, dtrack, openxr, recording or simulated");
    w.absent("listen", tracker.listen.as_ref(), "\"127.0.0.1:5000\"", "0.0.0.0 takes packets of other machines");
    w.absent("file", tracker.file.as_ref(), "\"walk.poses\"", "a recording's");
    w.optional("repeat", &tracker.repeat, &default.repeat, "the recording");
    w.optional("axes", &tracker.axes, &default.axes, "which of the tracker's are the room's x, y, z");
    w.optional("rotate_deg", &tracker.rotate_deg, &default.rotate_deg, "around x, then y, then z");
    w.optional("translate", &tracker.translate, &default.translate, "the tracker's origin in the room");
    w.optional("scale", &tracker.scale, &default.scale, "metres for each of its units");
    w.optional("smoothing_hz", &tracker.smoothing_hz, &default.smoothing_hz, "less is smoother and later; 0 for none");
    w.optional("smoothing_beta", &tracker.smoothing_beta, &default.smoothing_beta, "how much of it motion takes away");
    w.optional("prediction_ms", &tracker.prediction_ms, &default.prediction_ms, "the time from the tracker to the screen");
    w.optional("lost_after_ms", &tracker.lost_after_ms, &default.lost_after_ms, "");
    for body in &tracker.bodies {
        w.line("[[tracker.body]]");
        w.set("is", body.is, "head, wand or left-hand");
        w.absent("address", body.address.as_ref(), "\"/head\"", "OSC");
        w.absent("id", body.id.as_ref(), "0", "a standard body of DTrack");
        w.absent("flystick", body.flystick.as_ref(), "0", "a Flystick of DTrack");
        w.optional("offset", &body.offset, &[0.0; 3], "from the target to the middle between the eyes, in its axes");
    }
}

fn write_input(w: &mut Writer, input: &InputSettings) {
    let default = InputSettings::default();
    w.line(if *input == default { "\n# [input]" } else { "\n[input]" });
    w.optional("dead_zone", &input.dead_zone, &default.dead_zone, "what of a stick's way counts for nothing");
    w.optional("pace_m_s", &input.pace_m_s, &default.pace_m_s, "");
    w.optional("turn_deg_s", &input.turn_deg_s, &default.turn_deg_s, "");
    w.optional("flick_px_s", &input.flick_px_s, &default.flick_px_s, "the least of a flick in the air");
    w.optional("air_mouse", &input.air_mouse, &default.air_mouse, "a free-floating mouse, whose motion is for flicks");
    match input.bind.is_empty() {
        true => w.line("# bind = { \"day.play\" = [\"Space\", \"pad:South\"] }  # `heliodon display --actions` lists them"),
        false => w.set("bind", &input.bind, ""),
    }
}

fn write_headset(w: &mut Writer, headset: &Headset) {
    let default = Headset::default();
    w.line(if *headset == default { "\n# [headset]" } else { "\n[headset]" });
    w.optional("snap_turn_deg", &headset.snap_turn_deg, &default.snap_turn_deg, "0 turns smoothly");
    w.optional("vignette", &headset.vignette, &default.vignette, "how far the edge is darkened in motion, 0 to 1");
    w.optional("timeline", &headset.timeline, &default.timeline, "or floor, hidden");
}

fn write_kiosk(w: &mut Writer, kiosk: &Kiosk) {
    let default = Kiosk::default();
    w.line("\n[kiosk]");
    w.optional("idle_s", &kiosk.idle_s, &default.idle_s, "without a hand on anything, all begins anew");
    w.optional("may_quit", &kiosk.may_quit, &default.may_quit, "whether Escape ends it");
    w.absent("log", kiosk.log.as_ref(), "\"frames.log\"", "slow frames are written there");
    w.optional("slow_ms", &kiosk.slow_ms, &default.slow_ms, "");
}

fn write_control(w: &mut Writer, control: &Control) {
    w.line("\n[control]");
    w.set("listen", &control.listen, "orders by OSC; anything but a loopback address lets the network give them");
    match control.sites.is_empty() {
        true => w.line("# sites = { temple = \"temple/bundle\" }  # what /heliodon/site may open"),
        false => w.set("sites", &control.sites, ""),
    }
}
