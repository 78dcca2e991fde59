//! Corners that no photograph shows, typed into a place of a shape: a point of its own for each would be six keys and a dialog more.
//!
//! Three words stand for east, up and south; each is a number of metres or what a point has there, and as much more or less as is written behind it:
//! `foot-s+0.1 14.5 gutter-w`.

use super::draft::{ShapeDraft, is_marked};
use crate::app::dialogs::number;
use crate::solving::Outcome;
use glam::DVec3;
use heliodon_photo::model::table::ShapeRow;
use heliodon_photo::project::ProjectFile;

/// Reckoned places are written to this part of a metre.
const PARTS_OF_A_METRE: f64 = 1000.0;

/// A corner that is not in the project yet.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::app) struct NewCorner {
    pub name: String,
    pub place_m: DVec3,
}

/// What a draft says: its row, and the corners that are to be points before it can be one.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::app) struct Meant {
    pub row: ShapeRow,
    pub corners: Vec<NewCorner>,
}

/// Where three words say that a corner is; nothing where they are not meant so.
///
/// # Errors
/// The word that says nothing, in words.
fn reckoned(words: &str, place_of: &dyn Fn(&str) -> Option<DVec3>) -> Option<Result<DVec3, String>> {
    let words: Vec<&str> = words.split_whitespace().map(|word| word.trim_end_matches([',', ';'])).collect();
    let three = <[&str; 3]>::try_from(words).ok()?;
    let along = |axis: usize| {
        let word = three[axis];
        let of_point = |name: &str| place_of(name).map(|place| place[axis]);
        // names may have signs in them: the last one that leaves a point before it
        let moved = |(at, _): (usize, &str)| Some(of_point(&word[..at])? + number(&word[at..], "").ok()?);
        number(word, "").ok().or_else(|| of_point(word)).or_else(|| word.rmatch_indices(['+', '-']).find_map(moved))
    };
    let found = [0, 1, 2].map(along);
    if found == [None; 3] {
        return None;
    }
    let mut place = DVec3::ZERO;
    for (axis, (word, found)) in three.iter().zip(found).enumerate() {
        let Some(metres) = found else {
            return Some(Err(format!("{word} is neither metres nor a point that is solved")));
        };
        place[axis] = (metres * PARTS_OF_A_METRE).round() / PARTS_OF_A_METRE;
    }
    Some(Ok(place))
}

/// A draft's row with its reckoned corners as points: those that are in the project already are taken from there.
///
/// # Errors
/// What it lacks to be a row, in words.
pub(in crate::app) fn meant(draft: &ShapeDraft, file: &ProjectFile, outcome: Option<&Outcome>) -> Result<Meant, String> {
    let place_of = |name: &str| {
        let known_m = || file.point.iter().find(|point| point.name == name)?.known_m.map(DVec3::from);
        outcome.and_then(|outcome| outcome.position_m(name)).or_else(known_m)
    };
    let is_point = |name: &str| file.point.iter().any(|point| point.name == name);
    let (mut named, mut corners) = (draft.clone(), Vec::<NewCorner>::new());
    for group in &mut named.groups {
        for (slot, words) in group.slots.iter_mut().enumerate() {
            if !is_marked(words) || is_point(words.trim()) {
                continue;
            }
            let Some(place_m) = reckoned(words, &place_of) else { continue };
            let role = super::roles::place(draft.kind, group.list, slot);
            let place_m = place_m.map_err(|why| format!("{role}: {why}"))?;
            let is_there = |known_m: Option<[f64; 3]>| known_m == Some(place_m.to_array());
            let of_project = file.point.iter().find(|point| point.marks.is_empty() && is_there(point.known_m));
            let of_draft = || corners.iter().find(|corner| corner.place_m == place_m).map(|corner| corner.name.clone());
            *words = match of_project.map(|point| point.name.clone()).or_else(of_draft) {
                Some(name) => name,
                None => {
                    let first = format!("{} {}", draft.name.trim(), role.replace(',', "")).replace(char::is_whitespace, "-");
                    let is_free = |name: &String| !is_point(name) && corners.iter().all(|corner| corner.name != *name);
                    let others = (2..).map(|n| format!("{first}-{n}"));
                    let name = std::iter::once(first.clone()).chain(others).find(is_free).unwrap_or_default();
                    corners.push(NewCorner { name: name.clone(), place_m });
                    name
                }
            };
        }
    }
    Ok(Meant { row: named.row()?, corners })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(words: &str) -> Option<Result<DVec3, String>> {
        let place_of = |name: &str| match name {
            "foot-s" => Some(DVec3::new(1.0, 2.0, 3.0)),
            "foot" => Some(DVec3::new(7.0, 8.0, 9.0)),
            _ => None,
        };
        reckoned(words, &place_of)
    }

    #[test]
    fn three_words_are_metres_or_what_points_have_there() {
        for (words, place) in [
            ("1 -2.5 3", [1.0, -2.5, 3.0]),
            ("1, 0,8; 3", [1.0, 0.8, 3.0]),
            (" foot-s  foot foot-s", [1.0, 8.0, 3.0]),
            ("foot-s+0.25 foot-s-1 14.5", [1.25, 1.0, 14.5]),
            ("foot-1,5 0 foot+1e-1", [5.5, 0.0, 9.1]),
            ("0.12345 0 0", [0.123, 0.0, 0.0]),
        ] {
            assert_eq!(of(words), Some(Ok(DVec3::from(place))), "{words}");
        }
    }

    #[test]
    fn other_words_are_names_or_told_to_say_nothing() {
        for name in ["", "foot-s", "1 2", "1 2 3 4", "base west 2nd", "foot-s+1"] {
            assert_eq!(of(name), None, "{name}");
        }
        for (words, what) in [("1 2 head", "head"), ("foot-s+x 0 0", "foot-s+x"), ("0 nan 0", "nan")] {
            let told = of(words);
            assert!(told.as_ref().is_some_and(|told| told.as_ref().is_err_and(|why| why.starts_with(what))), "{told:?}");
        }
    }
}
