//! What is known beforehand: distances and directions between two points, and where a point is.

use super::form::{QUIET, choices, finished, focus_once, number, number_field, window};
use super::{Dialog, FAULT};
use crate::app::MarkApp;
use crate::document::Edit;
use eframe::egui::{Context, Label, RichText, TextEdit, Ui};
use heliodon_photo::project::{DirectionEntry, Toward};
use heliodon_photo::solve::{PointResult, worst_sigma};

/// Where the way from one point to another leads, as it is typed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::app) struct DirectionDraft {
    ends: [String; 2],
    toward: String,
    is_known: bool,
}

/// Where a point is, as it is typed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::app) struct PlaceDraft {
    point: String,
    known_m: [String; 3],
    is_known: bool,
}

/// A direction from its word, as much of it as tells it from others, or from degrees.
fn toward(text: &str) -> Result<Toward, String> {
    let text = text.trim().to_lowercase();
    if text.is_empty() {
        return Err("type north, south, east, west, up or down, or degrees clockwise from north".to_owned());
    }
    if let Some((toward, _)) = Toward::WORDS.iter().find(|(_, word)| word.starts_with(&text)) {
        return Ok(*toward);
    }
    let bearing_deg = number(text.trim_end_matches(['\u{b0}', ' ']), "a bearing")?;
    if bearing_deg.abs() > 360.0 {
        return Err("a bearing is -360 to 360 degrees, clockwise from north".to_owned());
    }
    Ok(Toward::Bearing(bearing_deg))
}

impl MarkApp {
    /// The two points that are chosen, or words that they are to be.
    fn two_chosen(&mut self, what: &str) -> Option<[String; 2]> {
        let between = <[String; 2]>::try_from(self.selected.clone());
        between.map_err(|chosen| self.say(format!("{what} two points: choose them with X ({} are chosen)", chosen.len()))).ok()
    }

    pub(in crate::app) fn begin_distance(&mut self) {
        if let Some(between) = self.two_chosen("a distance lies between") {
            self.open_distance(between);
        }
    }

    /// Opens the distance between two points, or begins it.
    pub(in crate::app) fn open_distance(&mut self, between: [String; 2]) {
        let is_it = |names: &[String; 2]| between.iter().all(|name| names.contains(name));
        let found = self.document.project().file.distance.iter().find(|entry| is_it(&entry.between));
        let metres = found.map(|entry| entry.metres.to_string()).unwrap_or_default();
        self.dialog = Dialog::Distance { between, metres };
    }

    pub(in crate::app) fn begin_direction(&mut self) {
        if let Some(ends) = self.two_chosen("a direction leads between") {
            self.open_direction(ends);
        }
    }

    /// Opens what is known of the way between two points, or begins it.
    pub(in crate::app) fn open_direction(&mut self, ends: [String; 2]) {
        let is_it = |entry: &&DirectionEntry| ends.contains(&entry.from) && ends.contains(&entry.to);
        let draft = match self.document.project().file.direction.iter().find(is_it) {
            Some(entry) => DirectionDraft {
                ends: [entry.from.clone(), entry.to.clone()],
                toward: entry.toward.to_string(),
                is_known: true,
            },
            None => DirectionDraft { ends, toward: String::new(), is_known: false },
        };
        self.dialog = Dialog::Direction(draft);
    }

    pub(in crate::app) fn begin_place(&mut self) {
        let active = self.active_point.as_deref();
        let Some(entry) = self.document.project().file.point.iter().find(|entry| Some(entry.name.as_str()) == active) else {
            self.say("choose the point whose place is known".to_owned());
            return;
        };
        let known_m = entry.known_m.map_or_else(Default::default, |place| place.map(|x| x.to_string()));
        self.dialog = Dialog::Place(PlaceDraft { point: entry.name.clone(), known_m, is_known: entry.known_m.is_some() });
    }

    pub(super) fn ask_distance(&mut self, ctx: &Context, between: &[String; 2], metres: &mut String) -> bool {
        let solved = self.way_m(between).map(|way| format!("{:.3} m as it is solved now", way.length()));
        let done = window(ctx, "Distance", |ui| {
            ui.label(format!("From {} to {}:", between[0], between[1]));
            ui.horizontal(|ui| {
                let field = ui.add(TextEdit::singleline(metres).desired_width(120.0));
                focus_once(ui, &field, metres);
                ui.label("m");
            });
            quiet(ui, solved.as_deref());
            finished(ui, "Set")
        });
        done.is_none_or(|is_wanted| {
            if is_wanted {
                match number(metres, "a distance") {
                    Ok(metres) => {
                        self.edit(&Edit::SetDistance { between: between.clone(), metres });
                    }
                    Err(why) => self.complain(why),
                }
            }
            false
        })
    }

    pub(super) fn ask_direction(&mut self, ctx: &Context, draft: &mut DirectionDraft) -> bool {
        let solved = self.way_m(&draft.ends).map(|way| {
            let bearing = way.x.atan2(-way.z).to_degrees().rem_euclid(360.0);
            let rise = way.y.atan2(way.x.hypot(way.z)).to_degrees();
            format!("as it is solved now: bearing {bearing:.2}\u{b0}, rising {rise:.2}\u{b0}")
        });
        let done = window(ctx, "Direction", |ui| {
            ui.horizontal(|ui| {
                ui.label(format!("From {} to {} leads", draft.ends[0], draft.ends[1]));
                if ui.button("Turn around").clicked() {
                    draft.ends.reverse();
                }
            });
            ui.horizontal(|ui| {
                let field = ui.add(TextEdit::singleline(&mut draft.toward).hint_text("north or 37.5").desired_width(120.0));
                focus_once(ui, &field, &draft.toward);
                ui.label("or degrees, clockwise from north, level");
            });
            ui.horizontal(|ui| {
                let now = toward(&draft.toward).ok();
                for (each, word) in Toward::WORDS {
                    if ui.selectable_label(now == Some(each), word).clicked() {
                        word.clone_into(&mut draft.toward);
                    }
                }
            });
            match toward(&draft.toward) {
                Err(why) => drop(ui.add(Label::new(RichText::new(why).color(FAULT)).wrap())),
                Ok(toward) => drop(ui.label(RichText::new(format!("it leads {toward}")).color(QUIET))),
            }
            quiet(ui, solved.as_deref());
            let words = if draft.is_known { &["Set", "Remove", "Cancel"][..] } else { &["Set", "Cancel"] };
            choices(ui, words, true).map(|choice| words[choice])
        });
        let [from, to] = draft.ends.clone();
        match done {
            None => true,
            Some("Set") => match toward(&draft.toward) {
                Ok(toward) => !self.edit(&Edit::SetDirection(DirectionEntry { from, to, toward })),
                Err(why) => {
                    self.complain(why);
                    true
                }
            },
            Some("Remove") => !self.edit(&Edit::RemoveDirection { between: [from, to] }),
            Some(_) => false,
        }
    }

    pub(super) fn ask_place(&mut self, ctx: &Context, draft: &mut PlaceDraft) -> bool {
        let solved = self.outcome.as_ref().and_then(|outcome| match outcome.points.get(&draft.point)? {
            PointResult::Solved(solved) => Some((solved.position_m, solved.covariance_m2.as_ref().map(worst_sigma))),
            PointResult::Unsolved(_) => None,
        });
        let done = window(ctx, "Known place", |ui| {
            ui.label(format!("{} lies, from the origin,", draft.point));
            let ways = [("x", "m east"), ("y", "m up"), ("z", "m south")];
            let fields = draft
                .known_m
                .iter_mut()
                .zip(ways)
                .map(|(text, (name, unit))| ui.horizontal(|ui| number_field(ui, name, text, "0.0", unit)).inner);
            if let Some(first) = fields.collect::<Vec<_>>().first() {
                focus_once(ui, first, &draft.known_m[0]);
            }
            if let Some((place, sigma)) = solved {
                let [x, y, z] = place.to_array();
                let sigma = sigma.map(|sigma| format!(" \u{b1}{sigma:.3}")).unwrap_or_default();
                quiet(ui, Some(&format!("as it is solved now: {x:.3}, {y:.3}, {z:.3} m{sigma}")));
                if ui.button("Take that").clicked() {
                    draft.known_m = place.to_array().map(|x| format!("{x:.3}"));
                }
            }
            let words = if draft.is_known { &["Set", "Not known", "Cancel"][..] } else { &["Set", "Cancel"] };
            choices(ui, words, true).map(|choice| words[choice])
        });
        let name = draft.point.clone();
        match done {
            None => true,
            Some("Set") => {
                let all = draft.known_m.iter().zip(["x", "y", "z"]).map(|(text, what)| number(text, what));
                match all.collect::<Result<Vec<f64>, String>>() {
                    Ok(all) => !self.edit(&Edit::SetKnown { name, known_m: Some([all[0], all[1], all[2]]) }),
                    Err(why) => {
                        self.complain(why);
                        true
                    }
                }
            }
            Some("Not known") => !self.edit(&Edit::SetKnown { name, known_m: None }),
            Some(_) => false,
        }
    }

    /// From one point to another, where both are solved.
    fn way_m(&self, ends: &[String; 2]) -> Option<glam::DVec3> {
        let outcome = self.outcome.as_ref()?;
        Some(outcome.position_m(&ends[1])? - outcome.position_m(&ends[0])?)
    }
}

fn quiet(ui: &mut Ui, words: Option<&str>) {
    if let Some(words) = words {
        ui.label(RichText::new(words).color(QUIET));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_words_their_beginnings_or_degrees() {
        for (text, expected) in [
            ("north", Toward::North),
            ("N", Toward::North),
            (" we", Toward::West),
            ("d", Toward::Down),
            ("37.5", Toward::Bearing(37.5)),
            ("37,5\u{b0}", Toward::Bearing(37.5)),
            ("-90 \u{b0}", Toward::Bearing(-90.0)),
        ] {
            assert_eq!(toward(text), Ok(expected), "{text}");
        }
        for wrong in ["", "nord", "361", "nan", "north 3"] {
            assert!(toward(wrong).is_err(), "{wrong}");
        }
    }
}
