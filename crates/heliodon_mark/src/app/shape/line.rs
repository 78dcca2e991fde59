//! Several places typed as one line, with strokes between them: `-3.4 0 5.9 / 15.9 14.5 -21.4` is a box from corner to corner. A field and a key for each
//! had been more than half of all that a castle cost.

use super::draft::{Group, ShapeDraft};
use super::roles::{List, places};
use heliodon_photo::model::table::Kind;

/// What stands between two places of a line.
const STROKE: char = '/';

/// Whether words are several places, and not one with a point in it whose name has strokes.
pub(super) fn is_line(words: &str, is_point: &dyn Fn(&str) -> bool) -> bool {
    cut(words, is_point).len() > 1
}

/// The places of a line: what stands between strokes that are no part of a point's name.
fn cut<'w>(words: &'w str, is_point: &dyn Fn(&str) -> bool) -> Vec<&'w str> {
    let (mut pieces, mut begun, mut at) = (Vec::new(), 0, 0);
    if !words.contains(STROKE) {
        return vec![words];
    }
    while let Some(letter) = words[at..].chars().next() {
        if let Some(end) = name_end(words, at, is_point) {
            at = end;
            continue;
        }
        if letter == STROKE {
            pieces.push(&words[begun..at]);
            begun = at + STROKE.len_utf8();
        }
        at += letter.len_utf8();
    }
    pieces.push(&words[begun..]);
    pieces
}

/// Where the longest point's name ends that begins at a place of a line and has strokes in it. Names stand by themselves, or with more or less behind them.
fn name_end(words: &str, begin: usize, is_point: &dyn Fn(&str) -> bool) -> Option<usize> {
    let stands_apart = |letter: char| letter == STROKE || letter.is_whitespace();
    if words[begin..].starts_with(stands_apart) || !words[..begin].chars().next_back().is_none_or(stands_apart) {
        return None;
    }
    let may_follow = |letter: char| stands_apart(letter) || matches!(letter, '+' | '-' | ',' | ';');
    let inner = words[begin..].char_indices().filter(|(_, letter)| may_follow(*letter)).map(|(at, _)| begin + at);
    let ends: Vec<usize> = inner.chain([words.len()]).collect();
    ends.into_iter().rev().find(|end| words[begin..*end].contains(STROKE) && is_point(&words[begin..*end]))
}

impl ShapeDraft {
    /// The places of a line that was typed into one go into theirs. What comes after them: the next list's first place that is empty, if there is one.
    ///
    /// The active place, and the one that is to be typed into, are the same ones afterwards, whatever was put in before them.
    pub fn spread(&mut self, (group, slot): (usize, usize), is_point: &dyn Fn(&str) -> bool) -> Option<(usize, usize)> {
        let of = self.groups.get(group)?;
        let list = of.list;
        let mut pieces: Vec<String> =
            cut(of.slots.get(slot)?, is_point).into_iter().map(|piece| piece.trim().to_owned()).collect();
        while pieces.len() > 1 && pieces.last().is_some_and(String::is_empty) {
            pieces.pop();
        }
        let mut last = group;
        match (list, places(self.kind, list)) {
            // of a line of rings each place is one's
            (List::Ring(first), _) => {
                for (ring, piece) in pieces.into_iter().enumerate() {
                    last = group + ring;
                    if !matches!(self.groups.get(last), Some(Group { list: List::Ring(_), .. })) {
                        self.groups.insert(last, Group { list: List::Ring(first + ring), slots: Vec::new() });
                        self.move_on(|place| place.0 += usize::from(place.0 >= last));
                    }
                    let slots = &mut self.groups[last].slots;
                    slots.resize(slots.len().max(slot + 1), String::new());
                    slots[slot] = piece;
                }
            }
            (_, None) => {
                let more = pieces.len() - 1;
                self.groups[group].slots.splice(slot..=slot, pieces);
                self.move_on(|place| place.1 += if place.0 == group && place.1 > slot { more } else { 0 });
            }
            (_, Some(count)) => {
                let is_first = of.slots.iter().enumerate().all(|(at, words)| at == slot || words.trim().is_empty());
                let into: Vec<usize> = match (self.kind, list, pieces.len()) {
                    // from corner to corner; with a second one of its foot where it is turned
                    (Kind::Box, List::Points, 2) if is_first => vec![0, 6],
                    (Kind::Box, List::Points, 3) if is_first => vec![0, 1, 6],
                    _ => (slot..count).collect(),
                };
                // what is too much stays with the last, and is told to be no point
                if let Some(rest) = pieces.get(into.len()..).filter(|rest| !rest.is_empty()) {
                    let rest = rest.join(" / ");
                    pieces.truncate(into.len());
                    pieces.last_mut()?.push_str(&format!(" {STROKE} {rest}"));
                }
                let slots = &mut self.groups[group].slots;
                slots[slot].clear();
                for (place, piece) in into.into_iter().zip(pieces) {
                    slots[place] = piece;
                }
            }
        }
        // rings by radius and height want their axis next
        let axis = self.groups.iter().position(|group| group.list == List::Axis && group.slots.iter().all(String::is_empty));
        let next = self.next_empty(last + 1).or(axis.filter(|_| matches!(list, List::Ring(_))).map(|axis| (axis, 0)));
        self.tidy();
        next
    }

    /// The active place and the one that is to be typed into have other numbers.
    fn move_on(&mut self, renumber: impl Fn(&mut (usize, usize))) {
        [Some(&mut self.active), self.focus.as_mut()].into_iter().flatten().for_each(renumber);
    }

    /// All lines that stand in one place go into theirs.
    pub fn spread_all(&mut self, is_point: &dyn Fn(&str) -> bool) {
        let at = |draft: &Self| {
            let line = |group: &Group| group.slots.iter().position(|words| is_line(words, is_point));
            draft.groups.iter().enumerate().find_map(|(number, group)| Some((number, line(group)?)))
        };
        // at most as often as there are places: what is too much for a list stays a line
        for _ in 0..self.groups.len() {
            let Some(place) = at(self) else { return };
            self.spread(place, is_point);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn begun(kind: Kind, words: &str) -> (ShapeDraft, Option<(usize, usize)>) {
        let mut draft = ShapeDraft::new(&[], "s".to_owned());
        draft.become_kind(kind, &[]);
        words.clone_into(&mut draft.groups[0].slots[0]);
        let next = draft.spread((0, 0), &|_| false);
        (draft, next)
    }

    #[test]
    fn a_line_fills_the_places_of_its_kind_in_turn() {
        let (draft, next) = begun(Kind::Extrusion, "a / 1 2 3/c /");
        assert_eq!((draft.groups[0].slots.join("|").as_str(), next), ("a|1 2 3|c|", Some((1, 0))));
        let (draft, next) = begun(Kind::Gable, "a/b//d/e/f");
        assert_eq!((draft.groups[0].slots.join("|").as_str(), next), ("a|b||d|e|f", None));
        for (line, filled) in [("a / b", "a||||||b|"), ("a/b/c", "a|b|||||c|"), ("a/b/c/d", "a|b|c|d||||")] {
            assert_eq!(begun(Kind::Box, line).0.groups[0].slots.join("|"), filled, "{line}");
        }
        // the ninth and tenth of eight are not lost
        let (mut draft, _) = begun(Kind::Box, "1/2/3/4/5/6/7/8/9/10");
        assert_eq!(draft.groups[0].slots[7], "8 / 9 / 10");
        draft.spread_all(&|_| false);
        assert_eq!(draft.groups[0].slots[7], "8 / 9 / 10");
    }

    #[test]
    fn a_line_of_rings_makes_as_many_and_goes_on_to_their_axis() {
        let (draft, next) = begun(Kind::Revolution, "2 0 / 2 1 / 1 3");
        let rings: Vec<&str> = draft.groups.iter().take(3).map(|group| group.slots[0].as_str()).collect();
        assert_eq!(rings, ["2 0", "2 1", "1 3"]);
        let (group, _) = next.unwrap();
        assert_eq!(draft.groups[group].list, List::Axis);
    }

    #[test]
    fn what_is_put_in_before_the_active_place_leaves_it_the_active_one() {
        let mut draft = ShapeDraft::new(&[], "s".to_owned());
        draft.become_kind(Kind::Revolution, &[]);
        draft.go_to(List::Axis);
        "2 0 / 2 1 / 1 3 / 0 4".clone_into(&mut draft.groups[0].slots[0]);
        draft.spread((0, 0), &|_| false);
        assert_eq!((draft.groups[draft.active.0].list, draft.focus), (List::Axis, Some(draft.active)));
        // places of the same list, too
        draft.become_kind(Kind::Polygon, &["a".to_owned(), "b".to_owned()]);
        "p / q / r".clone_into(&mut draft.groups[0].slots[0]);
        (draft.active, draft.focus) = ((0, 1), None);
        draft.spread((0, 0), &|_| false);
        assert_eq!((draft.groups[0].slots.join("|").as_str(), draft.active), ("p|q|r|b|", (0, 3)));
    }

    #[test]
    fn strokes_in_names_of_points_cut_no_line() {
        let is_point = |name: &str| ["north/3", "north/3-b", "a b/c"].contains(&name);
        for (line, places) in [
            ("north/3", &["north/3"][..]),
            ("north/3+0.5 0 0", &["north/3+0.5 0 0"]),
            ("0 north/3, 0", &["0 north/3, 0"]),
            ("north/3-b-1 0 north/3", &["north/3-b-1 0 north/3"]),
            (" a b/c ", &["a b/c"]),
            ("north/3+0.5 0 0 / . . north/3/north/3", &["north/3+0.5 0 0", ". . north/3", "north/3"]),
            // others' names that have it in them
            ("north/33", &["north", "33"]),
            ("far-north/3", &["far-north", "3"]),
            ("a b c", &["a b c"]),
            ("1 2 3 /", &["1 2 3", ""]),
            ("höhe/ä/north/3", &["höhe", "ä", "north/3"]),
        ] {
            let cut: Vec<&str> = cut(line, &is_point).into_iter().map(str::trim).collect();
            assert_eq!((cut.as_slice(), is_line(line, &is_point)), (places, places.len() > 1), "{line}");
        }
        assert!(is_line("north/3", &|_| false));
    }
}
