//! `heliodon display FILE --listen`: what trackers say, before there are pictures.

use crate::App;
use anyhow::{Result, bail};
use heliodon_bundle::display::Display;

use heliodon_view::tracking::{State, Trackers};
use serde::Serialize;
use std::time::{Duration, Instant};

/// Trackers are asked as often as a viewer asks them.
const FRAME: Duration = Duration::from_millis(10);

/// Bodies at one moment.
#[derive(Serialize)]
struct Moment {
    seconds: f64,
    bodies: Vec<Body>,
    trackers: Vec<Tracker>,
}

/// One body, in the room.
#[derive(Serialize)]
struct Body {
    tracker: String,
    body: &'static str,
    /// "never", "tracked" or "lost".
    state: &'static str,
    /// Metres.
    position: Option<[f32; 3]>,
    /// Clockwise from -Z, and upwards.
    heading_deg: Option<f32>,
    pitch_deg: Option<f32>,
}

/// What came of one tracker.
#[derive(Serialize)]
struct Tracker {
    tracker: String,
    packets: u64,
    malformed: u64,
    ignored: u64,
    /// How long ago the newest report that is used arrived.
    newest_ms: Option<f64>,
}

/// Listens for so many seconds.
pub fn run(app: &App, display: &Display, seconds: f64) -> Result<()> {
    let mut trackers = Trackers::new(display)?;
    if !trackers.faults().is_empty() {
        bail!("{}", trackers.faults().join("\n"));
    }
    if trackers.bodies().next().is_none() {
        bail!("{}: there is no [[tracker]] to listen to", display.path().display());
    }
    let (begun, mut told) = (Instant::now(), 0.0);
    while told < seconds {
        std::thread::sleep(FRAME);
        trackers.take();
        let now_s = begun.elapsed().as_secs_f64();
        if now_s >= told + 1.0 {
            told = now_s.floor();
            app.output.result(&moment(&trackers, told), text)?;
        }
    }
    Ok(())
}

fn moment(trackers: &Trackers, seconds: f64) -> Moment {
    let bodies = trackers.bodies().map(|(tracker, body, state, pose)| {
        let forward = pose.map(|pose| pose.orientation * glam::Vec3::NEG_Z);
        Body {
            tracker: tracker.to_owned(),
            body: body.name(),
            state: match state {
                State::Never => "never",
                State::Tracked => "tracked",
                State::Lost { .. } => "lost",
            },
            position: pose.map(|pose| pose.position.to_array()),
            heading_deg: forward.map(|forward| forward.x.atan2(-forward.z).to_degrees()),
            pitch_deg: forward.map(|forward| forward.y.clamp(-1.0, 1.0).asin().to_degrees()),
        }
    });
    let trackers_told = trackers.told().map(|(tracker, statistics, _)| Tracker {
        tracker: tracker.to_owned(),
        packets: statistics.packets,
        malformed: statistics.malformed,
        ignored: statistics.ignored,
        newest_ms: statistics.latency_s.map(|latency_s| latency_s * 1e3),
    });
    Moment { seconds, bodies: bodies.collect(), trackers: trackers_told.collect() }
}

fn text(moment: &Moment) -> String {
    let body = |body: &Body| {
        let place = body.position.map_or_else(String::new, |[x, y, z]| format!("  {x:7.3} {y:7.3} {z:7.3} m"));
        let turn = body.heading_deg.zip(body.pitch_deg);
        let turn =
            turn.map_or_else(String::new, |(heading, pitch)| format!("  heading {heading:6.1}, pitch {pitch:5.1} degrees"));
        format!("{:5.0} s  {} {:<9} {:<7}{place}{turn}", moment.seconds, body.tracker, body.body, body.state)
    };
    let tracker = |tracker: &Tracker| {
        let newest = tracker.newest_ms.map_or_else(|| "nothing heard".to_owned(), |ms| format!("heard {ms:.0} ms ago"));
        let Tracker { tracker, packets, malformed, ignored, .. } = tracker;
        // Not all come in packets.
        let counted = match packets {
            0 => String::new(),
            _ => format!("; {packets} packets, {malformed} malformed, {ignored} of nobody here"),
        };
        format!("         {tracker}: {newest}{counted}")
    };
    let lines: Vec<String> = moment.bodies.iter().map(body).chain(moment.trackers.iter().map(tracker)).collect();
    lines.join("\n")
}
