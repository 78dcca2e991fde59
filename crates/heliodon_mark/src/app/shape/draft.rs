//! A shape as it is put together: what the dialog's fields hold, and the row that comes of it.

use super::roles::{List, main_lists, more_lists, places, settings};
use crate::app::dialogs::{number, shown};
use heliodon_photo::model::table::{EdgeRow, Kind, RepeatRow, ShapeRow};

/// A point that was not marked, as the project's file writes it.
const UNMARKED: &str = "-";

/// The points of one list.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::app) struct Group {
    pub list: List,
    /// Names; an empty one was not marked. Lists without a fixed length end in one that is empty.
    pub slots: Vec<String>,
}

/// How often a shape stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::app) enum Again {
    Once,
    Step,
    Span,
    Around,
}

impl Again {
    /// The next way, after the last the first.
    pub fn next(self) -> Self {
        match self {
            Self::Once => Self::Step,
            Self::Step => Self::Span,
            Self::Span => Self::Around,
            Self::Around => Self::Once,
        }
    }
}

/// A shape as it is put together.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::app) struct ShapeDraft {
    /// The shape of the project that is changed, nothing for a new one.
    pub was: Option<String>,
    pub name: String,
    pub kind: Kind,
    pub part: String,
    pub groups: Vec<Group>,
    /// The place that the next point is for: list and place in it.
    pub active: (usize, usize),
    pub watertight: bool,
    pub upright: bool,
    /// Whether a new shape is upright if its kind can be.
    pub is_level: bool,
    pub flatten: bool,
    pub as_listed: bool,
    pub entasis: bool,
    pub depth_m: String,
    pub sides: String,
    pub tolerance_m: String,
    pub again: Again,
    pub count: String,
    pub angle_deg: String,
    pub edges: Vec<EdgeRow>,
    /// Which edge of a box or a roof is drawn next.
    pub edge: usize,
    /// The place whose field is to be typed into next.
    pub focus: Option<(usize, usize)>,
    /// Whether how often it stands is to be typed next.
    pub focus_count: bool,
}

impl ShapeDraft {
    /// A new shape of chosen points.
    pub fn new(points: &[String], name: String) -> Self {
        let kind = if points.len() > 4 { Kind::Box } else { Kind::Polygon };
        let mut draft = Self {
            was: None,
            name,
            kind,
            part: String::new(),
            groups: Vec::new(),
            active: (0, 0),
            watertight: false,
            upright: false,
            is_level: false,
            flatten: false,
            as_listed: false,
            entasis: false,
            depth_m: String::new(),
            sides: String::new(),
            tolerance_m: String::new(),
            again: Again::Once,
            count: String::new(),
            angle_deg: String::new(),
            edges: Vec::new(),
            edge: 0,
            focus: None,
            focus_count: false,
        };
        draft.become_kind(kind, points);
        draft
    }

    /// Whatever stands upright does so from the first, where it is known what is level; without points it is of the kind and mesh that were made last.
    pub fn begun(points: &[String], name: String, last: Option<&ShapeRow>, is_level: bool) -> Self {
        let mut draft = Self::new(points, name);
        draft.part = last.and_then(|row| row.part.clone()).unwrap_or_default();
        if let Some(row) = last.filter(|_| points.is_empty()) {
            draft.become_kind(row.kind, points);
        }
        draft.is_level = is_level;
        draft.upright = is_level && settings(draft.kind).upright;
        draft
    }

    /// A shape of the project, to be changed.
    pub fn of_row(row: &ShapeRow) -> Self {
        let mut draft = Self::new(&[], row.name.clone());
        draft.was = Some(row.name.clone());
        draft.kind = row.kind;
        draft.part = row.part.clone().unwrap_or_default();
        let ring_count = row.rings.len().max(2);
        let mains = main_lists(row.kind).iter().copied().filter(|list| !matches!(list, List::Ring(_)));
        let rings = (0..ring_count).map(List::Ring).filter(|_| row.kind == Kind::Revolution);
        let lists = mains.chain(rings).chain(more_lists(row.kind));
        draft.groups = lists.map(|list| Group { list, slots: slots_of(row, list) }).collect();
        (draft.watertight, draft.upright) = (row.watertight, row.upright);
        (draft.flatten, draft.as_listed, draft.entasis) = (row.flatten, row.as_listed, row.entasis);
        (draft.depth_m, draft.tolerance_m) = (shown(row.depth_m), shown(row.tolerance_m));
        draft.sides = row.sides.map(|sides| sides.to_string()).unwrap_or_default();
        if let Some(repeat) = &row.repeat {
            draft.count = repeat.count.to_string();
            draft.angle_deg = shown(repeat.angle_deg);
            draft.again = match (&repeat.step, &repeat.span) {
                (Some(_), _) => Again::Step,
                (None, Some(_)) => Again::Span,
                (None, None) => Again::Around,
            };
        }
        draft.edges.clone_from(&row.edges);
        draft.tidy();
        draft.active = draft.next_empty(0).unwrap_or((0, 0));
        draft
    }

    /// Another kind: points that were chosen already go into its lists in their order.
    pub fn become_kind(&mut self, kind: Kind, points: &[String]) {
        self.kind = kind;
        let lists = main_lists(kind).iter().copied().chain(more_lists(kind));
        let kept: Vec<Group> = std::mem::take(&mut self.groups);
        let kept_slots = |list: List| kept.iter().find(|group| group.list == list).map(|group| group.slots.clone());
        self.groups =
            lists.map(|list| Group { list, slots: kept_slots(list).filter(|_| !is_main(list)).unwrap_or_default() }).collect();
        self.watertight = kind != Kind::Polygon;
        let knows = settings(kind);
        self.upright = knows.upright && (self.upright || (self.was.is_none() && self.is_level));
        self.flatten &= knows.flatten;
        self.as_listed &= knows.flatten;
        self.entasis &= knows.entasis;
        self.edge = 0;
        self.edges.clear();
        self.tidy();
        self.active = (0, 0);
        for point in points {
            self.pick(point);
        }
    }

    /// All points of the lists that make its kind.
    pub fn main_points(&self) -> Vec<String> {
        let mains = self.groups.iter().filter(|group| is_main(group.list));
        mains.flat_map(|group| group.slots.iter().filter(|name| is_marked(name)).cloned()).collect()
    }

    /// A ring more, above the others.
    pub fn add_ring(&mut self) {
        let is_ring = |group: &&Group| matches!(group.list, List::Ring(_));
        let count = self.groups.iter().filter(is_ring).count();
        self.groups.insert(count, Group { list: List::Ring(count), slots: vec![String::new()] });
        self.active = (count, 0);
        self.focus = Some(self.active);
    }

    /// The place of a list's first point is typed into next.
    pub fn go_to(&mut self, list: List) {
        if let Some(group) = self.groups.iter().position(|group| group.list == list) {
            self.active = (group, 0);
            self.focus = Some(self.active);
        }
    }

    /// How often it stands, which is twice at first, and is typed next.
    pub fn stand(&mut self, again: Again) {
        self.again = again;
        self.focus_count = again != Again::Once;
        if self.focus_count && self.count.is_empty() {
            "2".clone_into(&mut self.count);
        }
    }

    /// Puts a point into the active place, and goes on to the next that is empty. A point that its list has already moves there.
    pub fn pick(&mut self, name: &str) {
        let (group, slot) = self.active;
        let Some(list) = self.groups.get_mut(group) else { return };
        list.slots.iter_mut().filter(|other| *other == name).for_each(String::clear);
        if let Some(place) = list.slots.get_mut(slot) {
            name.clone_into(place);
        }
        self.tidy();
        // what follows in its list first: a ring of points goes on until another list is chosen
        let after = |from: usize| self.groups[group].slots.iter().skip(from).position(String::is_empty).map(|at| at + from);
        self.active = match after(slot).or(after(0)) {
            Some(next) => (group, next),
            None => self.next_empty(group + 1).unwrap_or(self.active),
        };
        self.focus = Some(self.active);
    }

    /// The first place without a point in the main lists from one on.
    pub fn next_empty(&self, from: usize) -> Option<(usize, usize)> {
        let mut later = self.groups.iter().enumerate().skip(from).filter(|(_, group)| is_main(group.list));
        later.find_map(|(i, group)| Some((i, group.slots.iter().position(String::is_empty)?)))
    }

    /// Lists of fixed length have it, others end in one place that is empty, and have none but the active one before it.
    pub fn tidy(&mut self) {
        for (number, group) in self.groups.iter_mut().enumerate() {
            if let Some(count) = places(self.kind, group.list) {
                group.slots.resize(count, String::new());
                continue;
            }
            let mut slot = 0;
            while slot < group.slots.len() {
                if group.slots[slot].trim().is_empty() && self.active != (number, slot) {
                    group.slots.remove(slot);
                    if self.active.0 == number && self.active.1 > slot {
                        self.active.1 -= 1;
                    }
                } else {
                    slot += 1;
                }
            }
            if group.slots.last().is_none_or(|last| !last.trim().is_empty()) {
                group.slots.push(String::new());
            }
            if self.active.0 == number {
                self.active.1 = self.active.1.min(group.slots.len() - 1);
            }
        }
    }

    /// The row, or what it lacks to be one.
    pub fn row(&self) -> Result<ShapeRow, String> {
        let named = |list: List| -> Vec<String> {
            let group = self.groups.iter().find(|group| group.list == list);
            let slots = group.into_iter().flat_map(|group| &group.slots);
            slots.map(|name| name.trim().to_owned()).filter(|name| is_marked(name)).collect()
        };
        let pair = |list: List, what: &str| match <[String; 2]>::try_from(named(list)) {
            Ok(pair) if pair[0] == pair[1] => Err(format!("{what} needs two different points")),
            Ok(pair) => Ok(Some(pair)),
            Err(some) if some.is_empty() => Ok(None),
            Err(_) => Err(format!("{what} needs two points")),
        };
        let points = match self.groups.iter().find(|group| group.list == List::Points) {
            Some(group) if places(self.kind, List::Points).is_some() => {
                group.slots.iter().map(|name| if is_marked(name) { name.trim() } else { UNMARKED }.to_owned()).collect()
            }
            _ => named(List::Points),
        };
        let is_ring = |group: &&Group| matches!(group.list, List::Ring(_));
        let rings = self.groups.iter().filter(is_ring).map(|group| named(group.list)).filter(|ring| !ring.is_empty());
        let on = self.groups.iter().filter_map(|group| match group.list {
            List::On(face) => Some((face.to_owned(), named(group.list))).filter(|(_, points)| !points.is_empty()),
            _ => None,
        });
        let knows = settings(self.kind);
        let metres = |text: &str, what: &str| -> Result<Option<f64>, String> {
            if text.trim().is_empty() { Ok(None) } else { number(text, what).map(Some) }
        };
        let sides = match metres(if knows.sides { &self.sides } else { "" }, "sides")? {
            Some(sides) if sides.fract() == 0.0 && (1.0..=f64::from(u32::MAX)).contains(&sides) => Some(sides as u32),
            Some(_) => return Err(format!("\"{}\" is no number of sides", self.sides.trim())),
            None => None,
        };
        let row = ShapeRow {
            name: self.name.trim().to_owned(),
            kind: self.kind,
            part: Some(self.part.trim().to_owned()).filter(|part| !part.is_empty()),
            points,
            on: on.collect(),
            bottom: named(List::Bottom),
            top: named(List::Top),
            inner: named(List::Inner),
            outer: named(List::Outer),
            back: named(List::Back),
            rings: rings.collect(),
            along: pair(List::Along, "the way that it is drawn along")?,
            axis: pair(List::Axis, "its axis")?,
            edges: self.edges.clone(),
            depth_m: if knows.depth { metres(&self.depth_m, "depth")? } else { None },
            upright: self.upright && knows.upright,
            flatten: self.flatten && knows.flatten,
            as_listed: self.as_listed && knows.flatten,
            entasis: self.entasis && knows.entasis,
            watertight: self.watertight,
            sides,
            mirror: named(List::Mirror),
            repeat: self.repeat(pair(List::Repeat, "its repetition")?)?,
            tolerance_m: metres(&self.tolerance_m, "tolerance")?,
        };
        if row.name.is_empty() {
            return Err("a shape needs a name".to_owned());
        }
        if self.main_points().is_empty() {
            return Err(
                "it has no points yet: click marks in the photographs, or type names into the places on the left".to_owned()
            );
        }
        Ok(row)
    }

    fn repeat(&self, between: Option<[String; 2]>) -> Result<Option<RepeatRow>, String> {
        if self.again == Again::Once {
            return Ok(None);
        }
        let count = number(&self.count, "how many there are")?;
        if count.fract() != 0.0 || !(1.0..=f64::from(u32::MAX)).contains(&count) {
            return Err(format!("\"{}\" is not how many there are", self.count.trim()));
        }
        let between = between.ok_or(match self.again {
            Again::Step => "its repetition needs two points that are one step apart",
            Again::Span => "its repetition needs a point of the first and that point of the last",
            _ => "its repetition needs two points of the axis that it goes around",
        })?;
        let mut row = RepeatRow { count: count as u32, step: None, span: None, around: None, angle_deg: None };
        match self.again {
            Again::Step => row.step = Some(between),
            Again::Span => row.span = Some(between),
            _ => {
                row.around = Some(between);
                if !self.angle_deg.trim().is_empty() {
                    row.angle_deg = Some(number(&self.angle_deg, "the angle")?);
                }
            }
        }
        Ok(Some(row))
    }

    /// The place that a point has in it, for its mark in a photograph.
    pub fn place_of(&self, point: &str) -> Option<(usize, usize)> {
        let in_group = |group: &Group| group.slots.iter().position(|name| name.trim() == point);
        self.groups.iter().enumerate().find_map(|(number, group)| Some((number, in_group(group)?)))
    }
}

/// Whether a place is filled.
pub(super) fn is_marked(name: &str) -> bool {
    !name.trim().is_empty() && name.trim() != UNMARKED
}

/// Whether a list is one of those that make a kind.
pub(super) fn is_main(list: List) -> bool {
    !matches!(list, List::On(_) | List::Axis | List::Mirror | List::Repeat)
}

fn slots_of(row: &ShapeRow, list: List) -> Vec<String> {
    let pair = |pair: &Option<[String; 2]>| pair.as_ref().map(|pair| pair.to_vec()).unwrap_or_default();
    let mut slots = match list {
        List::Points => row.points.clone(),
        List::Bottom => row.bottom.clone(),
        List::Top => row.top.clone(),
        List::Inner => row.inner.clone(),
        List::Outer => row.outer.clone(),
        List::Back => row.back.clone(),
        List::Ring(ring) => row.rings.get(ring).cloned().unwrap_or_default(),
        List::On(face) => row.on.get(face).cloned().unwrap_or_default(),
        List::Along => pair(&row.along),
        List::Axis => pair(&row.axis),
        List::Mirror => row.mirror.clone(),
        List::Repeat => {
            let repeat = row.repeat.as_ref();
            repeat
                .and_then(|repeat| repeat.step.as_ref().or(repeat.span.as_ref()).or(repeat.around.as_ref()))
                .map_or_else(Vec::new, |pair| pair.to_vec())
        }
    };
    slots.iter_mut().filter(|name| !is_marked(name)).for_each(String::clear);
    slots
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(text: &str) -> ShapeRow {
        toml_edit::de::from_str(text).unwrap()
    }

    /// One of each kind with all that the project's reader knows of it.
    fn rows() -> Vec<ShapeRow> {
        [
            "name = \"a\"\nkind = \"polygon\"\npoints = [\"p\", \"q\", \"r\"]\nflatten = true\npart = \"walls\"",
            "name = \"b\"\nkind = \"box\"\npoints = [\"p\", \"-\", \"r\", \"s\", \"-\", \"t\", \"-\", \"-\"]\nupright = true\nwatertight = true\n\
             on = { top = [\"u\"], side-12 = [\"v\", \"w\"] }\nmirror = [\"p\", \"r\"]\ntolerance_m = 0.02\n\
             edges = [{ photograph = \"x.jpg\", from = [1.0, 2.0], to = [3.5, 4.0], between = [0, 4] }]",
            "name = \"c\"\nkind = \"gable\"\npoints = [\"p\", \"q\", \"r\", \"-\", \"t\", \"-\"]\non = { side-30 = [\"u\"] }",
            "name = \"d\"\nkind = \"cylinder\"\nbottom = [\"p\"]\ntop = [\"q\"]\npoints = [\"r\", \"s\"]\naxis = [\"t\", \"u\"]\nsides = 12\n\
             edges = [{ photograph = \"x.jpg\", from = [1.0, 2.0], to = [3.5, 4.0] }]",
            "name = \"e\"\nkind = \"column\"\nbottom = [\"p\"]\ntop = [\"q\"]\nentasis = true\nwatertight = true\n\
             repeat = { count = 8, step = [\"p\", \"r\"] }",
            "name = \"f\"\nkind = \"arch\"\ninner = [\"p\", \"q\", \"r\"]\nouter = [\"s\"]\nback = [\"t\"]\ndepth_m = 0.4\nsides = 24\n\
             repeat = { count = 3, span = [\"p\", \"r\"] }",
            "name = \"g\"\nkind = \"revolution\"\nrings = [[\"p\", \"q\", \"r\"], [\"s\"], [\"t\", \"u\"]]\naxis = [\"p\", \"q\"]\n\
             repeat = { count = 6, around = [\"p\", \"q\"], angle_deg = 30.5 }",
            "name = \"h\"\nkind = \"extrusion\"\npoints = [\"p\", \"q\", \"r\"]\nalong = [\"p\", \"s\"]\nwatertight = true\nmirror = [\"p\", \"q\", \"r\"]",
        ]
        .map(row)
        .to_vec()
    }

    #[test]
    fn every_row_that_the_reader_knows_comes_back_from_the_dialogs_fields() {
        for row in rows() {
            assert_eq!(ShapeDraft::of_row(&row).row(), Ok(row.clone()), "{row:?}");
        }
    }

    #[test]
    fn points_fill_the_places_of_a_kind_and_go_along_to_another() {
        let names: Vec<String> = ["a", "b", "c", "d", "e"].map(str::to_owned).to_vec();
        let mut draft = ShapeDraft::new(&names, "s".to_owned());
        assert_eq!((draft.kind, draft.active), (Kind::Box, (0, 5)));
        assert_eq!(draft.row().unwrap().points, ["a", "b", "c", "d", "e", "-", "-", "-"]);
        // chosen again for another place it moves there
        draft.active = (0, 6);
        draft.pick("a");
        assert_eq!(draft.row().unwrap().points, ["-", "b", "c", "d", "e", "-", "a", "-"]);
        assert_eq!(draft.active, (0, 7));
        let chosen = draft.main_points();
        draft.become_kind(Kind::Polygon, &chosen);
        assert_eq!(draft.row().unwrap().points, ["b", "c", "d", "e", "a"]);
        // an emptied place in the middle closes up once another is active
        draft.groups[0].slots[1].clear();
        draft.tidy();
        assert_eq!(draft.row().unwrap().points, ["b", "d", "e", "a"]);
        draft.become_kind(Kind::Extrusion, &draft.main_points());
        draft.active = (1, 0);
        draft.pick("b");
        assert!(draft.row().unwrap_err().contains("two points"));
        draft.pick("f");
        assert_eq!(draft.row().unwrap().along, Some(["b".to_owned(), "f".to_owned()]));
    }

    #[test]
    fn what_cannot_be_a_row_is_said() {
        let begun = || ShapeDraft::of_row(&rows()[4]);
        let with = |change: &dyn Fn(&mut ShapeDraft)| {
            let mut draft = begun();
            change(&mut draft);
            draft.row().unwrap_err()
        };
        assert!(with(&|draft| draft.name = " ".into()).contains("name"));
        assert!(with(&|draft| draft.sides = "many".into()).contains("sides"));
        assert!(with(&|draft| draft.sides = "2.5".into()).contains("sides"));
        assert!(with(&|draft| draft.count = "0".into()).contains("how many"));
        assert!(with(&|draft| draft.groups.iter_mut().for_each(|group| group.slots.clear())).contains("needs"));
        let mut empty = ShapeDraft::new(&[], "s".to_owned());
        assert!(empty.row().unwrap_err().contains("no points yet"));
        empty.pick("-");
        assert!(empty.row().unwrap_err().contains("no points yet"));
    }
}
