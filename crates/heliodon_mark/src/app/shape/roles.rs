//! What the places of a shape are called, and what a kind has of them: said here once, for the dialog's words, its drawing and its photographs.

use heliodon_photo::model::table::{EdgeRow, Kind, Rim};

/// All kinds, as the dialog names them.
pub(super) const KINDS: [(Kind, &str); 8] = [
    (Kind::Polygon, "polygon"),
    (Kind::Box, "box"),
    (Kind::Gable, "gable"),
    (Kind::Cylinder, "cylinder"),
    (Kind::Column, "column"),
    (Kind::Arch, "arch"),
    (Kind::Revolution, "revolution"),
    (Kind::Extrusion, "extrusion"),
];

/// A list of points that a shape's row has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::app) enum List {
    Points,
    Bottom,
    Top,
    Inner,
    Outer,
    Back,
    Ring(usize),
    /// On a face, by the name that the project's file has for it.
    On(&'static str),
    Along,
    Axis,
    Mirror,
    Repeat,
}

const BOX: [&str; 8] = [
    "lower front left",
    "lower front right",
    "lower back right",
    "lower back left",
    "upper front left",
    "upper front right",
    "upper back right",
    "upper back left",
];
const GABLE: [&str; 6] =
    ["eaves front left", "eaves front right", "eaves back right", "eaves back left", "ridge left end", "ridge right end"];

/// Which edge of a shape a photograph shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::app) enum Which {
    /// Where what is round ends to the eye.
    Side,
    /// Between two corners.
    Between([usize; 2]),
    /// Of an arch's front.
    Rim(Rim),
}

impl Which {
    /// That of an edge as the project's file has it.
    pub fn of(edge: &EdgeRow) -> Self {
        edge.between.map(Self::Between).or(edge.of.map(Self::Rim)).unwrap_or(Self::Side)
    }

    /// As the file has it.
    pub fn row(self, photograph: String, [from, to]: [[f64; 2]; 2]) -> EdgeRow {
        let (between, of) = match self {
            Self::Side => (None, None),
            Self::Between(corners) => (Some(corners), None),
            Self::Rim(rim) => (None, Some(rim)),
        };
        EdgeRow { photograph, from, to, between, of }
    }
}

/// Edges between two corners.
type Edges = &'static [([usize; 2], &'static str)];

const BOX_EDGES: Edges = &[
    ([0, 1], "lower front"),
    ([1, 2], "lower right"),
    ([2, 3], "lower back"),
    ([3, 0], "lower left"),
    ([4, 5], "upper front"),
    ([5, 6], "upper right"),
    ([6, 7], "upper back"),
    ([7, 4], "upper left"),
    ([0, 4], "front left upright"),
    ([1, 5], "front right upright"),
    ([2, 6], "back right upright"),
    ([3, 7], "back left upright"),
];
const GABLE_EDGES: Edges = &[
    ([0, 1], "front eaves"),
    ([2, 3], "back eaves"),
    ([1, 2], "right foot"),
    ([3, 0], "left foot"),
    ([4, 5], "ridge"),
    ([0, 4], "front left verge"),
    ([1, 5], "front right verge"),
    ([2, 5], "back right verge"),
    ([3, 4], "back left verge"),
];

const BOX_FACES: [(&str, &str); 6] = [
    ("bottom", "its underside"),
    ("top", "its top"),
    ("side-01", "its front"),
    ("side-12", "its right side"),
    ("side-23", "its back"),
    ("side-30", "its left side"),
];
const GABLE_FACES: [(&str, &str); 5] = [
    ("bottom", "its underside"),
    ("side-01", "its front slope"),
    ("side-12", "its right gable"),
    ("side-23", "its back slope"),
    ("side-30", "its left gable"),
];

/// Faces that points may lie on: the file's name and people's.
fn faces(kind: Kind) -> &'static [(&'static str, &'static str)] {
    match kind {
        Kind::Box => &BOX_FACES,
        Kind::Gable => &GABLE_FACES,
        _ => &[],
    }
}

/// Edges between corners that have names.
pub(super) fn named_edges(kind: Kind) -> Edges {
    match kind {
        Kind::Box => BOX_EDGES,
        Kind::Gable => GABLE_EDGES,
        _ => &[],
    }
}

/// Edges that photographs may bear witness of, where there is a choice; of a shape with so many corners.
pub(super) fn edges(kind: Kind, corners: usize) -> Vec<Which> {
    match kind {
        Kind::Box | Kind::Gable => named_edges(kind).iter().map(|(ends, _)| Which::Between(*ends)).collect(),
        Kind::Polygon | Kind::Extrusion => (0..corners).map(|i| Which::Between([i, (i + 1) % corners])).collect(),
        Kind::Arch => vec![Which::Rim(Rim::Inner), Which::Rim(Rim::Outer)],
        Kind::Cylinder | Kind::Column | Kind::Revolution => Vec::new(),
    }
}

/// What an edge is called.
pub(super) fn edge(kind: Kind, which: Which) -> String {
    match which {
        Which::Side => "side".to_owned(),
        Which::Rim(Rim::Inner) => "inner".to_owned(),
        Which::Rim(Rim::Outer) => "outer".to_owned(),
        Which::Between([a, b]) => {
            let is_it = |ends: [usize; 2]| ends == [a, b] || ends == [b, a];
            let named = named_edges(kind).iter().find(|(ends, _)| is_it(*ends));
            named.map_or_else(|| format!("{} to {}", a + 1, b + 1), |(_, name)| (*name).to_owned())
        }
    }
}

/// The lists that make a kind, in the order in which chosen points fill them.
pub(super) fn main_lists(kind: Kind) -> &'static [List] {
    match kind {
        Kind::Polygon | Kind::Box | Kind::Gable => &[List::Points],
        Kind::Cylinder | Kind::Column => &[List::Bottom, List::Top, List::Points],
        Kind::Arch => &[List::Inner, List::Outer, List::Back],
        Kind::Revolution => &[List::Ring(0), List::Ring(1)],
        Kind::Extrusion => &[List::Points, List::Along],
    }
}

/// Lists that a kind may have beside those, and those that all have.
pub(super) fn more_lists(kind: Kind) -> Vec<List> {
    let has_axis = matches!(kind, Kind::Cylinder | Kind::Column | Kind::Revolution);
    let on = faces(kind).iter().map(|(face, _)| List::On(face));
    on.chain(has_axis.then_some(List::Axis)).chain([List::Mirror, List::Repeat]).collect()
}

/// How many places a list has, where that is fixed.
pub(super) fn places(kind: Kind, list: List) -> Option<usize> {
    match (kind, list) {
        (Kind::Box, List::Points) => Some(BOX.len()),
        (Kind::Gable, List::Points) => Some(GABLE.len()),
        (_, List::Along | List::Axis | List::Repeat) => Some(2),
        _ => None,
    }
}

/// What a list is, above its places.
pub(super) fn title(kind: Kind, list: List) -> String {
    let words = match (kind, list) {
        (Kind::Box | Kind::Gable, List::Points) => "Corners",
        (Kind::Polygon, List::Points) => "Corners, in order around it",
        (Kind::Extrusion, List::Points) => "Corners of its front, in order",
        (_, List::Points) => "Anywhere on its side",
        (_, List::Bottom) => "On the lower rim",
        (_, List::Top) => "On the upper rim",
        (_, List::Inner) => "On the inner edge, from springing to springing",
        (_, List::Outer) => "On the outer edge",
        (_, List::Back) => "On its back",
        (_, List::Ring(0)) => "On the lowest ring",
        (_, List::Ring(ring)) => return format!("On ring {}", ring + 1),
        (_, List::On(face)) => {
            let known = faces(kind).iter().find(|(each, _)| *each == face);
            return format!("Anywhere on {}", known.map_or(face, |(_, words)| words));
        }
        (_, List::Along) => "It is drawn by the way between two points",
        (_, List::Axis) => "Two points near its axis, to begin with",
        (_, List::Mirror) => "Two that mirror each other, or three of the mirror",
        (_, List::Repeat) => "Two points",
    };
    words.to_owned()
}

/// What a place of a list is called.
pub(super) fn place(kind: Kind, list: List, place: usize) -> String {
    let number = place + 1;
    let ends = |names: [&str; 2]| names.get(place).map_or_else(String::new, |name| (*name).to_owned());
    match (kind, list) {
        (Kind::Box, List::Points) => BOX.get(place).map_or_else(String::new, |name| (*name).to_owned()),
        (Kind::Gable, List::Points) => GABLE.get(place).map_or_else(String::new, |name| (*name).to_owned()),
        (Kind::Polygon | Kind::Extrusion, List::Points) => format!("corner {number}"),
        (_, List::Points) => format!("side {number}"),
        (_, List::Bottom) => format!("lower rim {number}"),
        (_, List::Top) => format!("upper rim {number}"),
        (_, List::Inner) => format!("inner edge {number}"),
        (_, List::Outer) => format!("outer edge {number}"),
        (_, List::Back) => format!("back {number}"),
        (_, List::Ring(ring)) => format!("ring {}, {number}", ring + 1),
        (_, List::On(_)) => format!("point {number}"),
        (_, List::Along) => ends(["from", "to"]),
        (_, List::Axis) => ends(["axis, one", "axis, other"]),
        (_, List::Mirror) => format!("mirror {number}"),
        (_, List::Repeat) => ends(["from", "to"]),
    }
}

/// What a kind needs, for who begins one.
pub(super) fn needs(kind: Kind) -> &'static str {
    match kind {
        Kind::Polygon => "three points or more; polygons of one mesh share the points that they name alike",
        Kind::Box => "four corners that tell length, height and width; each more makes it surer",
        Kind::Gable => "eaves and ridge; what is not marked follows from the rest",
        Kind::Cylinder | Kind::Column => {
            "a point on each rim, and its axis: three on each rim, both its sides seen in two photographs, or upright and three points"
        }
        Kind::Arch => "three points on its inner edge, one on its outer, and its back or its depth",
        Kind::Revolution => "two rings or more from the bottom up, one of them with three points, or its axis",
        Kind::Extrusion => "a front of three points or more, and two points whose way it is drawn along",
    }
}

/// Which settings beside points a kind knows.
pub(super) struct Settings {
    pub upright: bool,
    pub flatten: bool,
    pub entasis: bool,
    pub depth: bool,
    pub sides: bool,
}

pub(super) fn settings(kind: Kind) -> Settings {
    let is_shaft = matches!(kind, Kind::Cylinder | Kind::Column);
    let has_corners = matches!(kind, Kind::Box | Kind::Gable);
    Settings {
        upright: has_corners || is_shaft || kind == Kind::Revolution,
        flatten: kind == Kind::Polygon,
        entasis: kind == Kind::Column,
        depth: kind == Kind::Arch,
        sides: is_shaft || matches!(kind, Kind::Arch | Kind::Revolution),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_names_the_edges_that_its_file_knows() {
        let row = |which: Which| which.row("a.jpg".to_owned(), [[1.0, 2.0], [3.0, 4.0]]);
        for (kind, _) in KINDS {
            let known = edges(kind, 4);
            for which in known.iter().copied().chain([Which::Side]) {
                assert_eq!(Which::of(&row(which)), which);
            }
            let mut names: Vec<String> = known.iter().map(|which| edge(kind, *which)).collect();
            names.sort();
            names.dedup();
            assert_eq!(names.len(), known.len(), "{kind:?}");
        }
        assert_eq!(edge(Kind::Polygon, edges(Kind::Polygon, 4)[3]), "4 to 1");
        assert_eq!((edges(Kind::Box, 0).len(), edges(Kind::Arch, 0).len(), edges(Kind::Revolution, 9).len()), (12, 2, 0));
    }
}
