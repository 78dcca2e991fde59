//! A small drawing of a kind of shape, with a spot for every place that a point can have in it.

use super::draft::{Group, ShapeDraft};
use super::roles::{self, List};
use crate::app::panes::ACTIVE;
use eframe::egui::{Color32, Painter, Pos2, Sense, Shape, Stroke, Ui, Vec2};
use heliodon_photo::model::table::Kind;
use std::f32::consts::{PI, TAU};

const SIZE: Vec2 = Vec2::new(250.0, 180.0);
/// How near a spot a click chooses it, points of the window.
const GRAB: f32 = 14.0;
const OUTLINE: Color32 = Color32::from_gray(150);
const HIDDEN: Color32 = Color32::from_gray(85);
const MARKED: Color32 = Color32::from_rgb(90, 225, 165);

/// Corners of a box as it is drawn, the width and height of the drawing being 1.
const BOX: [[f32; 2]; 8] =
    [[0.15, 0.9], [0.62, 0.9], [0.87, 0.66], [0.4, 0.66], [0.15, 0.4], [0.62, 0.4], [0.87, 0.16], [0.4, 0.16]];
const GABLE: [[f32; 2]; 6] = [[0.1, 0.88], [0.66, 0.88], [0.92, 0.62], [0.36, 0.62], [0.23, 0.26], [0.79, 0.26]];
/// Where a house's front is, for extrusions.
const FRONT: [[f32; 2]; 5] = [[0.12, 0.9], [0.5, 0.9], [0.5, 0.5], [0.31, 0.34], [0.12, 0.5]];
const WAY: Vec2 = Vec2::new(0.34, -0.2);

/// A line of a drawing.
struct Line {
    points: Vec<Pos2>,
    /// The list whose points lie along it.
    list: Option<List>,
    is_hidden: bool,
}

fn at(place: [f32; 2]) -> Pos2 {
    Pos2::new(place[0], place[1])
}

/// Middle, half width and half height of an ellipse.
type Ellipse = (Pos2, Vec2);

/// The rims of what is turned, from the lowest up.
fn rims(kind: Kind, count: usize) -> Vec<Ellipse> {
    let rim = |y: f32, half: f32| (Pos2::new(0.5, y), Vec2::new(half, 0.26 * half));
    match kind {
        Kind::Cylinder => vec![rim(0.82, 0.24), rim(0.18, 0.24)],
        Kind::Column => vec![rim(0.82, 0.25), rim(0.18, 0.19)],
        // a vase, however many rings it has
        _ => {
            let part = |ring: usize| ring as f32 / (count.max(2) - 1) as f32;
            let half = |part: f32| 0.13 + 0.13 * (PI * (0.25 + 0.9 * part)).sin().abs();
            (0..count.max(2)).map(|ring| rim(0.86 - 0.72 * part(ring), half(part(ring)))).collect()
        }
    }
}

fn on_ellipse((middle, half): Ellipse, angle: f32) -> Pos2 {
    middle + Vec2::new(half.x * angle.cos(), half.y * angle.sin())
}

fn ellipse(of: Ellipse) -> Vec<Pos2> {
    (0..=32).map(|i| on_ellipse(of, TAU * i as f32 / 32.0)).collect()
}

/// An arch's edges: its front's inner and outer one, and its back's.
fn arc(list: List) -> (Pos2, f32) {
    match list {
        List::Inner => (Pos2::new(0.42, 0.86), 0.25),
        List::Outer => (Pos2::new(0.42, 0.86), 0.38),
        _ => (Pos2::new(0.56, 0.76), 0.38),
    }
}

fn on_arc((middle, radius): (Pos2, f32), part: f32) -> Pos2 {
    let angle = PI * (1.0 - part);
    // the drawing is wider than high
    middle + Vec2::new(radius * angle.cos(), -radius * SIZE.x / SIZE.y * angle.sin())
}

fn ring_count(draft: &ShapeDraft) -> usize {
    draft.groups.iter().filter(|group| matches!(group.list, List::Ring(_))).count()
}

fn lines(draft: &ShapeDraft) -> Vec<Line> {
    let line = |points: Vec<Pos2>, list: Option<List>| Line { points, list, is_hidden: false };
    let between = |places: &[[f32; 2]], ends: [usize; 2], is_hidden: bool| Line {
        points: ends.map(|end| at(places[end])).to_vec(),
        list: None,
        is_hidden,
    };
    match draft.kind {
        Kind::Box => roles::named_edges(Kind::Box).iter().map(|(ends, _)| between(&BOX, *ends, ends.contains(&3))).collect(),
        Kind::Gable => {
            roles::named_edges(Kind::Gable).iter().map(|(ends, _)| between(&GABLE, *ends, ends.contains(&3))).collect()
        }
        Kind::Polygon => {
            let count = corner_count(draft);
            vec![line((0..=count).map(|i| corner(Kind::Polygon, i % count, count)).collect(), None)]
        }
        Kind::Extrusion => {
            let count = corner_count(draft);
            let front: Vec<Pos2> = (0..=count).map(|i| corner(Kind::Extrusion, i % count, count)).collect();
            let back = front.iter().map(|p| *p + WAY).collect();
            let ways =
                front.iter().skip(1).map(|p| Line { points: vec![*p, *p + WAY], list: Some(List::Along), is_hidden: false });
            ways.chain([Line { points: back, list: None, is_hidden: true }, line(front.clone(), None)]).collect()
        }
        Kind::Arch => {
            let arc_of = |list: List| {
                let points = (0..=24).map(|i| on_arc(arc(list), i as f32 / 24.0)).collect();
                Line { points, list: Some(list), is_hidden: list == List::Back }
            };
            let joint = |part: f32| line(vec![on_arc(arc(List::Inner), part), on_arc(arc(List::Outer), part)], None);
            let depth = |part: f32| line(vec![on_arc(arc(List::Outer), part), on_arc(arc(List::Back), part)], None);
            [List::Back, List::Inner, List::Outer]
                .map(arc_of)
                .into_iter()
                .chain([joint(0.0), joint(1.0), depth(0.5), depth(1.0)])
                .collect()
        }
        kind => {
            let rims = rims(kind, ring_count(draft));
            let last = rims.len() - 1;
            let list = |ring: usize| match kind {
                Kind::Revolution => List::Ring(ring),
                _ if ring == 0 => List::Bottom,
                _ => List::Top,
            };
            let side = |angle: f32| line(rims.iter().map(|rim| on_ellipse(*rim, angle)).collect(), Some(List::Points));
            let axis = vec![rims[last].0 - Vec2::new(0.0, 0.1), rims[0].0 + Vec2::new(0.0, 0.1)];
            let rings = rims.iter().enumerate().map(|(ring, rim)| line(ellipse(*rim), Some(list(ring))));
            [Line { points: axis, list: Some(List::Axis), is_hidden: true }, side(0.0), side(PI)]
                .into_iter()
                .chain(rings)
                .collect()
        }
    }
}

fn corner_count(draft: &ShapeDraft) -> usize {
    let points = draft.groups.iter().find(|group| group.list == List::Points);
    points.map_or(0, |group| group.slots.len()).max(if draft.kind == Kind::Extrusion { FRONT.len() } else { 4 })
}

/// The corner of a number among all of a polygon's, counter-clockwise.
fn corner(kind: Kind, number: usize, count: usize) -> Pos2 {
    if kind == Kind::Extrusion && count == FRONT.len() {
        return at(FRONT[number]);
    }
    let middle = if kind == Kind::Extrusion { Pos2::new(0.32, 0.62) } else { Pos2::new(0.5, 0.5) };
    let half = if kind == Kind::Extrusion { Vec2::new(0.22, 0.28) } else { Vec2::new(0.36, 0.4) };
    // from the lower left on, as one writes down corners of a wall
    on_ellipse((middle, half), TAU * (0.36 - number as f32 / count as f32))
}

/// Where a place of a list is drawn; places that belong to no line of the drawing are not.
fn spot(draft: &ShapeDraft, group: &Group, slot: usize) -> Option<Pos2> {
    let part = (slot as f32 + 0.5) / group.slots.len() as f32;
    let middle = |corners: &[[f32; 2]]| {
        let sum = corners.iter().fold(Vec2::ZERO, |sum, place| sum + at(*place).to_vec2());
        (sum / corners.len() as f32).to_pos2()
    };
    // points along a rim are drawn on the side that is seen
    let on_rim = |rim: Ellipse| on_ellipse(rim, PI * (1.0 - part));
    match (draft.kind, group.list) {
        (Kind::Box, List::Points) => BOX.get(slot).map(|place| at(*place)),
        (Kind::Gable, List::Points) => GABLE.get(slot).map(|place| at(*place)),
        (kind @ (Kind::Polygon | Kind::Extrusion), List::Points) => Some(corner(kind, slot, corner_count(draft))),
        (kind, List::Bottom) => Some(on_rim(rims(kind, 2)[0])),
        (kind, List::Top) => Some(on_rim(rims(kind, 2)[1])),
        (kind, List::Ring(ring)) => rims(kind, ring_count(draft)).get(ring).map(|rim| on_rim(*rim)),
        (kind, List::Points) => {
            let [low, high] = [rims(kind, 2)[0], rims(kind, 2)[1]].map(on_rim);
            Some(low.lerp(high, 0.5))
        }
        (_, List::Inner | List::Outer | List::Back) => Some(on_arc(arc(group.list), 0.04 + 0.92 * part)),
        (_, List::Along) => Some(at(FRONT[1]) + if slot == 0 { Vec2::ZERO } else { WAY } + Vec2::new(0.06, 0.02)),
        (kind, List::Axis) => {
            let rims = rims(kind, ring_count(draft));
            let ends = [rims[0].0 + Vec2::new(0.0, 0.1), rims[rims.len() - 1].0 - Vec2::new(0.0, 0.1)];
            ends.get(slot).copied()
        }
        (kind, List::On(face)) => {
            let places: &[[f32; 2]] = if kind == Kind::Box { &BOX } else { &GABLE };
            let corners: &[usize] = match (kind, face) {
                (_, "bottom") => &[0, 1, 2, 3],
                (Kind::Box, "top") => &[4, 5, 6, 7],
                (Kind::Box, "side-01") => &[0, 1, 5, 4],
                (Kind::Box, "side-12") => &[1, 2, 6, 5],
                (Kind::Box, "side-23") => &[2, 3, 7, 6],
                (Kind::Box, _) => &[3, 0, 4, 7],
                (_, "side-01") => &[0, 1, 5, 4],
                (_, "side-12") => &[1, 2, 5],
                (_, "side-23") => &[2, 3, 4, 5],
                _ => &[3, 0, 4],
            };
            let face: Vec<[f32; 2]> = corners.iter().map(|corner| places[*corner]).collect();
            Some(middle(&face) + Vec2::new(0.05 * (part - 0.5), 0.0))
        }
        (_, List::Mirror | List::Repeat) => None,
    }
}

/// Draws it; a place that is clicked is told.
pub(super) fn show(ui: &mut Ui, draft: &ShapeDraft) -> Option<(usize, usize)> {
    let (rect, response) = ui.allocate_exact_size(SIZE, Sense::CLICK);
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 3.0, Color32::from_gray(18));
    let room = rect.shrink(8.0);
    let place = |p: Pos2| room.min + p.to_vec2() * room.size();
    let active = draft.groups.get(draft.active.0).map(|group| group.list);
    let edge = roles::named_edges(draft.kind).get(draft.edge).filter(|_| !draft.edges.is_empty()).map(|(ends, _)| *ends);
    for (number, line) in lines(draft).iter().enumerate() {
        let points: Vec<Pos2> = line.points.iter().map(|p| place(*p)).collect();
        let is_active = line.list.is_some() && line.list == active;
        let is_edge = edge.is_some() && roles::named_edges(draft.kind).get(number).map(|(ends, _)| *ends) == edge;
        let colour = if is_active {
            ACTIVE
        } else if is_edge {
            MARKED
        } else if line.is_hidden {
            HIDDEN
        } else {
            OUTLINE
        };
        let stroke = Stroke::new(if is_active || is_edge { 2.0 } else { 1.2 }, colour);
        if line.is_hidden && !is_active {
            painter.extend(Shape::dashed_line(&points, stroke, 4.0, 4.0));
        } else {
            painter.add(Shape::line(points, stroke));
        }
    }
    let mut nearest: Option<(f32, (usize, usize))> = None;
    for (number, group) in draft.groups.iter().enumerate() {
        for (slot, name) in group.slots.iter().enumerate() {
            let Some(at) = spot(draft, group, slot).map(place) else { continue };
            let is_active = draft.active == (number, slot);
            let is_marked = !name.trim().is_empty();
            // of lists beside those that make it, only what is used is shown
            if !super::draft::is_main(group.list) && !is_marked && draft.active.0 != number {
                continue;
            }
            paint_spot(&painter, at, is_active, is_marked);
            if let Some(click) = response.interact_pointer_pos() {
                let distance = click.distance(at);
                if distance < GRAB && nearest.is_none_or(|(least, _)| distance < least) {
                    nearest = Some((distance, (number, slot)));
                }
            }
        }
    }
    nearest.filter(|_| response.clicked()).map(|(_, place)| place)
}

fn paint_spot(painter: &Painter, at: Pos2, is_active: bool, is_marked: bool) {
    let colour = if is_active { ACTIVE } else { MARKED };
    if is_marked {
        painter.circle_filled(at, 4.5, colour);
    } else {
        painter.circle(at, 4.0, Color32::from_gray(18), Stroke::new(1.4, if is_active { ACTIVE } else { OUTLINE }));
    }
    if is_active {
        painter.circle_stroke(at, 8.5, Stroke::new(1.8, ACTIVE));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::Rect;

    #[test]
    fn every_place_that_makes_a_kind_has_a_spot_of_its_own_inside_the_drawing() {
        for (kind, word) in roles::KINDS {
            let mut draft = ShapeDraft::new(&[], "s".to_owned());
            draft.become_kind(kind, &[]);
            let mut spots: Vec<Pos2> = Vec::new();
            for group in &draft.groups {
                for slot in 0..group.slots.len() {
                    let Some(spot) = spot(&draft, group, slot) else { continue };
                    assert!(
                        Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0)).contains(spot),
                        "{word} {:?} {slot}: {spot}",
                        group.list
                    );
                    if super::super::draft::is_main(group.list) {
                        let near = spots.iter().any(|other| ((*other - spot) * SIZE).length() < 10.0);
                        assert!(!near, "{word} {:?} {slot}", group.list);
                        spots.push(spot);
                    }
                }
            }
            assert!(!spots.is_empty(), "{word}");
        }
    }
}
