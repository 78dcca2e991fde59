//! Several places typed as one line, with strokes between them: `-3.4 0 5.9 / 15.9 14.5 -21.4` is a box from corner to corner. A field and a key for each
//! had been more than half of all that a castle cost.

use super::draft::{Group, ShapeDraft};
use super::roles::{List, places};
use heliodon_photo::model::table::Kind;

/// What stands between two places of a line.
const STROKE: char = '/';

/// Whether words are several places, and not the name of one point.
pub(super) fn is_line(words: &str, is_point: &dyn Fn(&str) -> bool) -> bool {
    words.contains(STROKE) && !is_point(words.trim())
}

impl ShapeDraft {
    /// The places of a line that was typed into one go into theirs. What comes after them: the next list's first place that is empty, if there is one.
    pub fn spread(&mut self, (group, slot): (usize, usize)) -> Option<(usize, usize)> {
        let of = self.groups.get(group)?;
        let (list, pieces) = (of.list, of.slots.get(slot)?.split(STROKE).map(|piece| piece.trim().to_owned()));
        let mut pieces: Vec<String> = pieces.collect();
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
                    }
                    let slots = &mut self.groups[last].slots;
                    slots.resize(slots.len().max(slot + 1), String::new());
                    slots[slot] = piece;
                }
            }
            (_, None) => drop(self.groups[group].slots.splice(slot..=slot, pieces)),
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

    /// All lines that stand in one place go into theirs.
    pub fn spread_all(&mut self, is_point: &dyn Fn(&str) -> bool) {
        let at = |draft: &Self| {
            let line = |group: &Group| group.slots.iter().position(|words| is_line(words, is_point));
            draft.groups.iter().enumerate().find_map(|(number, group)| Some((number, line(group)?)))
        };
        // at most as often as there are places: what is too much for a list stays a line
        for _ in 0..self.groups.len() {
            let Some(place) = at(self) else { return };
            self.spread(place);
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
        let next = draft.spread((0, 0));
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
    fn a_point_whose_name_has_a_stroke_in_it_is_no_line() {
        assert!(
            !is_line("north/3", &|name| name == "north/3") && is_line("north/3", &|_| false) && !is_line("a b c", &|_| false)
        );
    }
}
