//! Corners that no photograph shows, typed into a place of a shape: a point of its own for each would be six keys and a dialog more.
//!
//! Three words stand for east, up and south; each is a number of metres or what a point has there, and as much more or less as is written behind it:
//! `foot-s+0.1 14.5 gutter-w`. A dot is what the place before has: `. .+0.3 .`. Of a list's first place that is the last one of the list before, but where a
//! way begins (what a shape is drawn along or repeated by, its mirror, its axis) it is the shape's first corner. A revolution's axis has no place before it, for
//! its rings rest on that.
//!
//! What follows from the rest is not typed: a box has two opposite corners, a way begins at the first corner, an axis is plumb, a ring is a radius and a height
//! about it.

use super::draft::{Again, Group, ShapeDraft, is_main, is_marked};
use super::roles::{self, List};
use crate::app::dialogs::number;
use crate::solving::Outcome;
use glam::DVec3;
use heliodon_photo::model::table::{Kind, ShapeRow};
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

/// What words of a place may rest on.
struct Grounds<'a> {
    place_of: &'a dyn Fn(&str) -> Option<DVec3>,
    /// The place before.
    before: Option<DVec3>,
    /// A point of the plumb axis that a ring is about.
    axis: Option<DVec3>,
}

/// What is typed behind the dot of a word that means the place before.
fn behind_dot(word: &str) -> Option<&str> {
    word.strip_prefix('.').filter(|more| more.is_empty() || more.starts_with(['+', '-']))
}

/// How much more or less than a dot is typed behind it.
fn more_than_dot(word: &str) -> Option<f64> {
    behind_dot(word).and_then(|more| if more.is_empty() { Some(0.0) } else { number(more, "").ok() })
}

/// The words of a place, without what people write between numbers.
fn words_of(place: &str) -> Vec<&str> {
    place.split_whitespace().map(|word| word.trim_end_matches([',', ';'])).collect()
}

/// Whether a place is a radius and a height by its words.
fn is_about_axis(place: &str) -> bool {
    matches!(words_of(place).as_slice(), [radius, _] if number(radius, "").is_ok() || more_than_dot(radius).is_some())
}

/// As reckoned places are written.
fn rounded(place_m: DVec3) -> DVec3 {
    (place_m * PARTS_OF_A_METRE).round() / PARTS_OF_A_METRE
}

impl Grounds<'_> {
    /// Metres along an axis, by a word.
    fn along(&self, word: &str, axis: usize) -> Option<f64> {
        let of_point = |name: &str| (self.place_of)(name).map(|place| place[axis]);
        // names may have signs in them: the last one that leaves a point before it
        let moved = |(at, _): (usize, &str)| Some(of_point(&word[..at])? + number(&word[at..], "").ok()?);
        let as_before = || Some(self.before?[axis] + more_than_dot(word)?);
        let of_points = || of_point(word).or_else(|| word.rmatch_indices(['+', '-']).find_map(moved));
        number(word, "").ok().or_else(as_before).or_else(of_points)
    }

    /// Metres from an axis, by a word; a dot is as far as the place before is from it.
    fn out(&self, word: &str, axis: DVec3) -> Option<f64> {
        let as_before = || Some((self.before? - axis).with_y(0.0).length() + more_than_dot(word)?);
        number(word, "").ok().or_else(as_before)
    }

    /// Where words say that a corner is: three for its coordinates, or two for a radius about an axis and a height; nothing where they are not meant so.
    ///
    /// # Errors
    /// The word that says nothing, in words.
    fn reckoned(&self, words: &str) -> Option<Result<DVec3, String>> {
        let words = words_of(words);
        let (three, found) = match (words.as_slice(), self.axis) {
            (&[east, up, south], _) => {
                ([east, up, south], [(east, 0), (up, 1), (south, 2)].map(|(word, i)| self.along(word, i)))
            }
            (&[radius, height], Some(axis)) => {
                let east = self.out(radius, axis).map(|radius| axis.x + radius);
                ([radius, height, ""], [east, self.along(height, 1), Some(axis.z)])
            }
            _ => return None,
        };
        if three.iter().zip(found).all(|(word, found)| word.is_empty() || (found.is_none() && behind_dot(word).is_none())) {
            return None;
        }
        let mut place = DVec3::ZERO;
        for (axis, (word, found)) in three.iter().zip(found).enumerate() {
            let Some(metres) = found else {
                let why = match behind_dot(word) {
                    Some(_) if self.before.is_none() => "rests on a place before it, and there is none",
                    _ => "is neither metres nor a point that is solved",
                };
                return Some(Err(format!("{word} {why}")));
            };
            place[axis] = metres;
        }
        Some(Ok(rounded(place)))
    }
}

/// The corners of a shape: points of the project, and those that are to be.
struct Corners<'a> {
    file: &'a ProjectFile,
    shape: &'a str,
    new: Vec<NewCorner>,
}

impl Corners<'_> {
    fn is_point(&self, name: &str) -> bool {
        self.file.point.iter().any(|point| point.name == name)
    }

    /// Where a point is that no photograph moves: one that is to be, or one that is known by measure alone.
    fn fixed_m(&self, name: &str) -> Option<DVec3> {
        let new = || self.new.iter().find(|corner| corner.name == name).map(|corner| corner.place_m);
        let of_project = self.file.point.iter().find(|point| point.name == name.trim() && point.marks.is_empty());
        of_project.and_then(|point| point.known_m).map(DVec3::from).or_else(new)
    }

    /// The name of the corner at a place: one that is there already, or a new one by its role.
    fn named(&mut self, place_m: DVec3, role: &str) -> String {
        let is_there = |known_m: Option<[f64; 3]>| known_m == Some(place_m.to_array());
        let of_project = self.file.point.iter().find(|point| point.marks.is_empty() && is_there(point.known_m));
        if let Some(point) = of_project {
            return point.name.clone();
        }
        if let Some(corner) = self.new.iter().find(|corner| corner.place_m == place_m) {
            return corner.name.clone();
        }
        let first = format!("{} {}", self.shape.trim(), role.replace(',', "")).replace(char::is_whitespace, "-");
        let is_free = |name: &String| !self.is_point(name) && self.new.iter().all(|corner| corner.name != *name);
        let others = (2..).map(|n| format!("{first}-{n}"));
        let name = std::iter::once(first.clone()).chain(others).find(is_free).unwrap_or_default();
        self.new.push(NewCorner { name: name.clone(), place_m });
        name
    }
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
    let mut named = draft.clone();
    let mut corners = Corners { file, shape: &draft.name, new: Vec::new() };
    named.spread_all(&|name| corners.is_point(name));
    // where the shape begins, and where its axis is
    let (mut first, mut last, mut axis, mut is_plumb) = (None, None, None, false);
    // rings rest on their axis, others may have theirs by their first corner
    let is_before = |group: &Group| draft.kind == Kind::Revolution && group.list == List::Axis;
    let mut order: Vec<usize> = (0..named.groups.len()).collect();
    order.sort_by_key(|at| !is_before(&named.groups[*at]));
    for at in order {
        let Group { list, slots } = &mut named.groups[at];
        let is_way = matches!(list, List::Along | List::Axis | List::Mirror | List::Repeat);
        let is_ring = matches!(list, List::Ring(_));
        let mut before = if is_way { first } else { last };
        for (slot, words) in slots.iter_mut().enumerate().filter(|(_, words)| is_marked(words)) {
            let grounds = Grounds { place_of: &place_of, before, axis: axis.filter(|_| is_ring) };
            let place_m = if corners.is_point(words.trim()) {
                place_of(words.trim())
            } else if let Some(place_m) = grounds.reckoned(words) {
                let role = roles::place(draft.kind, *list, slot);
                let place_m = place_m.map_err(|why| format!("{role}: {why}"))?;
                // what lies along the axes is upright, whatever else is level
                is_plumb |= grounds.axis.is_some() && words.split_whitespace().count() == 2;
                *words = corners.named(place_m, &role);
                Some(place_m)
            } else if is_ring && axis.is_none() && is_about_axis(words) {
                let (role, words) = (roles::place(draft.kind, *list, slot), words.trim());
                return Err(format!(
                    "{role}: {words} is a radius and a height about a plumb axis, and none is known: type one place of it"
                ));
            } else {
                None
            };
            before = place_m.or(before);
        }
        match list {
            List::Axis => axis = before.filter(|_| draft.upright || slots.iter().filter(|words| is_marked(words)).count() == 1),
            _ if !is_way => {
                let of_first = || slots.iter().find(|words| is_marked(words)).map(|words| words.trim().to_owned());
                if first.is_none()
                    && is_main(*list)
                    && let Some(name) = of_first()
                {
                    first = place_of(&name).or_else(|| corners.new.iter().find(|new| new.name == name).map(|new| new.place_m));
                }
                last = before;
            }
            _ => {}
        }
    }
    named.upright |= is_plumb;
    complete(&mut named, &mut corners, &place_of);
    Ok(Meant { row: named.row()?, corners: corners.new })
}

/// What goes without saying.
fn complete(named: &mut ShapeDraft, corners: &mut Corners<'_>, place_of: &dyn Fn(&str) -> Option<DVec3>) {
    let place = |corners: &Corners<'_>, name: &str| {
        let new = || corners.new.iter().find(|corner| corner.name == name).map(|corner| corner.place_m);
        place_of(name.trim()).or_else(new)
    };
    let first = named.main_points().first().cloned();
    let (kind, again) = (named.kind, named.again);
    for Group { list, slots } in &mut named.groups {
        let marked: Vec<String> = slots.iter().filter(|words| is_marked(words)).cloned().collect();
        let [one] = marked.as_slice() else { continue };
        match list {
            List::Axis => {}
            List::Repeat if again == Again::Around => {}
            List::Along | List::Mirror | List::Repeat => {
                // from the first corner to there
                *slots = first.iter().chain([one]).cloned().collect();
                continue;
            }
            _ => continue,
        }
        // plumb
        if let Some(foot_m) = place(corners, one) {
            let role = roles::place(kind, *list, 1);
            *slots = vec![one.clone(), corners.named(rounded(foot_m + DVec3::Y), &role)];
        }
    }
    let has_faces =
        named.groups.iter().any(|group| matches!(group.list, List::On(_)) && group.slots.iter().any(|words| is_marked(words)));
    if kind == Kind::Box && !has_faces {
        named.upright |= square(&mut named.groups[0].slots, corners);
    }
}

/// A box of two opposite corners lies along the axes: they go into the places that they are in then, and a third beside the first. Whether it is one:
/// corners that are marked move with what is solved, and a third would stay where it was.
fn square(slots: &mut [String], corners: &mut Corners<'_>) -> bool {
    let marked: Vec<usize> = (0..slots.len()).filter(|slot| is_marked(&slots[*slot])).collect();
    let &[a, b] = marked.as_slice() else { return false };
    if ![[0, 6], [1, 7], [2, 4], [3, 5]].contains(&[a, b]) {
        return false;
    }
    let names = [a, b].map(|slot| slots[slot].clone());
    let (Some(p), Some(q)) = (corners.fixed_m(&names[0]), corners.fixed_m(&names[1])) else { return false };
    let way = q - p;
    if way.abs().min_element() < 1.0 / PARTS_OF_A_METRE {
        return false;
    }
    // places count along the front, then back, below and above
    let slot = |is_right: bool, is_back: bool, is_upper: bool| match (is_right, is_back) {
        (false, false) => 0,
        (true, false) => 1,
        (true, true) => 2,
        (false, true) => 3,
    } + if is_upper { 4 } else { 0 };
    let (is_right, is_back, is_upper) = (way.x < 0.0, way.z > 0.0, way.y < 0.0);
    let beside = slot(!is_right, is_back, is_upper);
    let third = corners.named(rounded(DVec3::new(q.x, p.y, p.z)), &roles::place(Kind::Box, List::Points, beside));
    let [first, other] = names;
    slots.iter_mut().for_each(String::clear);
    slots[slot(is_right, is_back, is_upper)] = first;
    slots[slot(!is_right, !is_back, !is_upper)] = other;
    slots[beside] = third;
    true
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
        Grounds { place_of: &place_of, before: Some(DVec3::new(4.0, 5.0, 6.0)), axis: None }.reckoned(words)
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
            (". .5 .-0.5", [4.0, 0.5, 5.5]),
            (".+1, . foot", [5.0, 5.0, 9.0]),
        ] {
            assert_eq!(of(words), Some(Ok(DVec3::from(place))), "{words}");
        }
    }

    #[test]
    fn two_words_are_a_radius_about_an_axis_and_a_height() {
        let grounds = Grounds { place_of: &|_| None, before: None, axis: Some(DVec3::new(4.0, 5.0, 6.0)) };
        assert_eq!(grounds.reckoned("1.5 20"), Some(Ok(DVec3::new(5.5, 20.0, 6.0))));
        assert_eq!(of("1.5 20"), None);
        for words in ["1.5 .+2", ". 2", ".+1 2"] {
            let told = grounds.reckoned(words);
            assert!(told.as_ref().is_some_and(|told| told.as_ref().is_err_and(|why| why.contains("place before"))), "{told:?}");
        }
        // as far out as the place before, wherever about the axis that is
        let above = Grounds { before: Some(DVec3::new(1.0, 7.0, 10.0)), ..grounds };
        for (words, place) in [(". .+2", [9.0, 9.0, 6.0]), (".-0.5, 1", [8.5, 1.0, 6.0]), ("2 .", [6.0, 7.0, 6.0])] {
            assert_eq!(above.reckoned(words), Some(Ok(DVec3::from(place))), "{words}");
        }
        assert!(above.reckoned(".+x 2").is_some_and(|told| told.is_err_and(|why| why.starts_with(".+x is neither"))));
        for (words, is_it) in
            [("1.5 0", true), (". 0", true), (".+1 foot", true), ("base 2", false), ("1", false), ("1 2 3", false)]
        {
            assert_eq!(is_about_axis(words), is_it, "{words}");
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
