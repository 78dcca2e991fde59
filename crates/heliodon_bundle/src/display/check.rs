//! What makes a `display.toml` that parses a sensible one.

use super::types::{BodyEntry, Correction, DisplayFile, Output, Protocol, ScreenEntry, Stereo, TrackerEntry};
use crate::config::rules::{Checked, fault, finite, not_empty, within};
use heliodon_math::glam::DVec3;
use std::collections::BTreeMap;

/// The longest side of a window or image, pixels.
const MOST_PX: u32 = 16_384;

/// The first fault of a display, if it has one.
pub(super) fn check(file: &DisplayFile) -> Checked {
    let info = &file.display;
    not_empty(&["display", "name"], &info.name)?;
    finite(&["display", "eye"], &info.eye)?;
    within(&["display", "eye_separation_m"], info.eye_separation_m, 0.0, 1.0)?;
    within(&["display", "near_m"], info.near_m, 0.001, 10.0)?;
    if let Some(far) = info.far_m
        && (far.is_nan() || far <= info.near_m)
    {
        return fault(
            &["display", "far_m"],
            format!("far_m is {far}, but near_m {}", info.near_m),
            "give a greater number, or none",
        );
    }
    if let Some(hud) = &info.hud
        && hud != "none"
        && !file.screens.iter().any(|screen| screen.name == *hud)
    {
        return fault(&["display", "hud"], format!("there is no screen `{hud}`"), "name a [[screen]], or \"none\"");
    }
    check_place(file)?;
    for (i, screen) in file.screens.iter().enumerate() {
        check_screen(&["screen", &i.to_string()], screen, info.eye)?;
    }
    check_outputs(file)?;
    for (i, tracker) in file.trackers.iter().enumerate() {
        check_tracker(&["tracker", &i.to_string()], tracker)?;
    }
    check_bodies(file)?;
    check_ports(file)?;
    let input = &file.input;
    within(&["input", "dead_zone"], input.dead_zone, 0.0, 0.9)?;
    within(&["input", "pace_m_s"], input.pace_m_s, 0.01, 200.0)?;
    within(&["input", "turn_deg_s"], input.turn_deg_s, 1.0, 720.0)?;
    within(&["input", "flick_px_s"], input.flick_px_s, 10.0, 1e5)?;
    within(&["headset", "snap_turn_deg"], file.headset.snap_turn_deg, 0.0, 180.0)?;
    within(&["headset", "vignette"], file.headset.vignette, 0.0, 1.0)?;
    if let Some(kiosk) = &file.kiosk {
        within(&["kiosk", "idle_s"], kiosk.idle_s, 1.0, 86_400.0)?;
        within(&["kiosk", "slow_ms"], kiosk.slow_ms, 1.0, 60_000.0)?;
    }
    Ok(())
}

fn check_place(file: &DisplayFile) -> Checked {
    let place = &file.place;
    if let Some(at) = &place.at {
        finite(&["place", "at"], at)?;
    }
    if let Some(heading) = place.heading_deg {
        within(&["place", "heading_deg"], heading, -360.0, 360.0)?;
    }
    within(&["place", "scale"], place.scale, 0.001, 1000.0)
}

fn check_screen(path: &[&str; 2], screen: &ScreenEntry, eye: [f64; 3]) -> Checked {
    let at = |key: &'static str| [path[0], path[1], key];
    not_empty(&at("name"), &screen.name)?;
    screen.corners.iter().try_for_each(|corner| finite(&at("corners"), corner))?;
    let flat = match screen.screen() {
        Ok(flat) => flat,
        Err(why) => {
            let remedy = "give lower left, lower right and upper left corner of a rectangle, in metres";
            return fault(&at("corners"), format!("screen `{}`: {why}", screen.name), remedy);
        }
    };
    if flat.distance(DVec3::from(eye)) <= 0.0 {
        let message = format!(
            "screen `{}` shows its back to the eye: its corners are mirrored, or the eye stands behind it",
            screen.name
        );
        return fault(&at("corners"), message, "swap the left and the right corner, as the visitor sees them, or move `eye`");
    }
    match (screen.stereo, &screen.output_right) {
        (Stereo::Pair, None) => {
            return fault(&at("stereo"), "a pair of projectors needs output_right", "add output_right = { monitor = 2 }");
        }
        (Stereo::Pair, Some(_)) | (_, None) => {}
        _ => {
            return fault(
                &at("output_right"),
                "only stereo = \"pair\" has a second output",
                "remove it, or set stereo = \"pair\"",
            );
        }
    }
    check_output(&at("output"), &screen.output)?;
    if let Some(output) = &screen.output_right {
        check_output(&at("output_right"), output)?;
    }
    let blend = &screen.blend;
    for (key, share) in [("left", blend.left), ("right", blend.right), ("top", blend.top), ("bottom", blend.bottom)] {
        within(&[path[0], path[1], "blend", key], share, 0.0, 0.5)?;
    }
    within(&[path[0], path[1], "blend", "gamma"], blend.gamma, 1.0, 4.0)?;
    let Correction { gain, gamma, black } = &screen.colour;
    for (key, values, low, high) in [("gain", gain, 0.0, 4.0), ("gamma", gamma, 0.1, 10.0), ("black", black, 0.0, 0.5)] {
        values.iter().try_for_each(|&value| within(&[path[0], path[1], "colour", key], value, low, high))?;
    }
    Ok(())
}

fn check_output(path: &[&str; 3], output: &Output) -> Checked {
    let ways = [output.monitor.is_some(), output.window.is_some(), output.image.is_some()];
    if ways.into_iter().filter(|&way| way).count() > 1 {
        return fault(path, "one picture is bound to several places", "keep one of monitor, window and image");
    }
    if let Some([left, top, width, height]) = output.window {
        let far = |at: i32| at.unsigned_abs() > 8 * MOST_PX;
        if width <= 0 || height <= 0 || far(left) || far(top) {
            return fault(
                path,
                format!("window is {left}, {top}, {width}, {height}"),
                "give left, top, width and height in pixels",
            );
        }
    }
    let [width, height] = output.size_px();
    if !(1..=MOST_PX).contains(&width) || !(1..=MOST_PX).contains(&height) {
        return fault(path, format!("{width} x {height} pixels"), format!("each side is from 1 to {MOST_PX} pixels long"));
    }
    if output.monitor == Some(super::MonitorName::Number(0)) {
        return fault(path, "there is no monitor 0", "monitors are counted from 1");
    }
    Ok(())
}

/// No two pictures go to one place.
fn check_outputs(file: &DisplayFile) -> Checked {
    let mut taken: BTreeMap<String, &str> = BTreeMap::new();
    let mut names: BTreeMap<&str, usize> = BTreeMap::new();
    for (i, screen) in file.screens.iter().enumerate() {
        let number = i.to_string();
        if names.insert(&screen.name, i).is_some() || screen.name == "none" {
            let message = format!("another screen is called `{}` already, or nothing may be", screen.name);
            return fault(&["screen", &number, "name"], message, "give it another name");
        }
        for (key, output) in [("output", Some(&screen.output)), ("output_right", screen.output_right.as_ref())] {
            let Some(output) = output else { continue };
            let place = match (&output.monitor, &output.image) {
                (Some(monitor), _) => format!("monitor {monitor:?}"),
                (_, Some(image)) => format!("image {}", image.display()),
                _ => continue,
            };
            if let Some(other) = taken.insert(place, &screen.name) {
                let message = format!("screens `{other}` and `{}` go to one place", screen.name);
                return fault(&["screen", &number, key], message, "bind each picture to a monitor or image of its own");
            }
        }
    }
    Ok(())
}

fn check_tracker(path: &[&str; 2], tracker: &TrackerEntry) -> Checked {
    let at = |key: &'static str| [path[0], path[1], key];
    not_empty(&at("name"), &tracker.name)?;
    let over_udp = matches!(tracker.protocol, Protocol::Osc | Protocol::Dtrack);
    if over_udp && tracker.address().is_none() {
        let message = format!("`{}` is no address with a port", tracker.listen.as_deref().unwrap_or_default());
        return fault(&at("listen"), message, "write \"127.0.0.1:5000\", or \"0.0.0.0:5000\" for packets of other machines");
    }
    if !over_udp && tracker.listen.is_some() {
        return fault(&at("listen"), "only \"osc\" and \"dtrack\" listen", "remove it");
    }
    match (tracker.protocol, &tracker.file) {
        (Protocol::Recording, None) => {
            return fault(&at("protocol"), "a recording needs its file", "add file = \"walk.poses\"");
        }
        (Protocol::Recording, Some(_)) | (_, None) => {}
        _ => return fault(&at("file"), "only \"recording\" has a file", "remove it"),
    }
    finite(&at("translate"), &tracker.translate)?;
    finite(&at("rotate_deg"), &tracker.rotate_deg)?;
    within(&at("scale"), tracker.scale, 1e-4, 1e4)?;
    within(&at("smoothing_hz"), tracker.smoothing_hz, 0.0, 120.0)?;
    within(&at("smoothing_beta"), tracker.smoothing_beta, 0.0, 1000.0)?;
    within(&at("prediction_ms"), tracker.prediction_ms, 0.0, 200.0)?;
    within(&at("lost_after_ms"), tracker.lost_after_ms, 10.0, 10_000.0)?;
    if tracker.bodies.is_empty() {
        return fault(path, format!("tracker `{}` tracks nothing", tracker.name), "add [[tracker.body]] with is = \"head\"");
    }
    for (i, body) in tracker.bodies.iter().enumerate() {
        check_body(&[path[0], path[1], "body", &i.to_string()], tracker.protocol, body)?;
    }
    Ok(())
}

fn check_body(path: &[&str], protocol: Protocol, body: &BodyEntry) -> Checked {
    finite(path, &body.offset)?;
    match protocol {
        Protocol::Osc if body.address.as_ref().is_none_or(|address| !address.starts_with('/')) => {
            fault(path, "a body of an OSC tracker needs its address", "add address = \"/head\"")
        }
        Protocol::Openxr if body.address.as_ref().is_some_and(|path| !path.starts_with("/user/")) => fault(
            path,
            "a body's OpenXR path begins with /user/",
            "write \"/user/head\", \"/user/hand/right\" or \"/user/vive_tracker_htcx/role/waist\", or leave it out",
        ),
        Protocol::Dtrack if body.id.is_some() == body.flystick.is_some() => {
            fault(path, "a body of DTrack needs its number", "add id = 0 for a standard body, or flystick = 0")
        }
        _ => Ok(()),
    }
}

/// No body is tracked twice.
fn check_bodies(file: &DisplayFile) -> Checked {
    let mut known = BTreeMap::new();
    let (mut runtime, mut paths) = (None, BTreeMap::new());
    for (i, tracker) in file.trackers.iter().enumerate() {
        let of_runtime = tracker.protocol == Protocol::Openxr;
        if let Some(other) = of_runtime.then(|| runtime.replace(&tracker.name)).flatten() {
            let message = format!("trackers `{other}` and `{}` both ask the OpenXR runtime, which answers one", tracker.name);
            return fault(&["tracker", &i.to_string(), "protocol"], message, "give one of them all bodies");
        }
        for (k, body) in tracker.bodies.iter().enumerate() {
            if let Some(path) = body.address.as_ref().filter(|_| of_runtime)
                && let Some(other) = paths.insert(path, body.is)
            {
                let message = format!("the {} and the {} both follow {path}", other.name(), body.is.name());
                return fault(&["tracker", &i.to_string(), "body", &k.to_string()], message, "give each a path of its own");
            }
            if let Some(other) = known.insert(body.is, &tracker.name) {
                let message = format!("trackers `{other}` and `{}` both track the {}", tracker.name, body.is.name());
                return fault(&["tracker", &i.to_string(), "body", &k.to_string()], message, "keep one of them");
            }
        }
    }
    Ok(())
}

/// No port is listened at twice.
fn check_ports(file: &DisplayFile) -> Checked {
    let mut taken = BTreeMap::new();
    if let Some(control) = &file.control {
        match control.address() {
            Some(address) => drop(taken.insert(address.port(), "the control")),
            None => {
                let message = format!("`{}` is no address with a port", control.listen);
                return fault(&["control", "listen"], message, "write \"127.0.0.1:9000\"");
            }
        }
    }
    for (i, tracker) in file.trackers.iter().enumerate() {
        let listens = matches!(tracker.protocol, Protocol::Osc | Protocol::Dtrack);
        let Some(address) = tracker.address().filter(|address| listens && address.port() != 0) else { continue };
        if let Some(other) = taken.insert(address.port(), &tracker.name) {
            let message = format!("{other} and tracker `{}` listen at the same port", tracker.name);
            return fault(&["tracker", &i.to_string(), "listen"], message, "give each a port of its own");
        }
    }
    Ok(())
}
