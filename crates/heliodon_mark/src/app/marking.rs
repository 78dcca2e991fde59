//! Setting marks by pointer or cursor: what is grabbed, and where it snaps.

use super::{MarkApp, Tool};
use crate::document::Edit;
use crate::pictures::{Picture, View};
use eframe::egui::Pos2;
use glam::DVec2;
use heliodon_photo::snap::{Grey, SnappedTo, snap};

/// How near a mark the pointer grabs it, points of the window.
const GRAB: f32 = 9.0;
/// How far marks snap at the size that the photograph is shown at, points of the window: about what a hand misses by. Farther, they go to whatever is
/// sharpest nearby, in a photograph at half its size more often than to what was meant.
const SNAP: f64 = 5.0;
/// How far they may go on in each finer level of it, pixels of that level.
const FINER_PX: f64 = 3.0;

/// A mark that is being set or moved.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Drag {
    pub pane: usize,
    pub point: String,
    pub photo: String,
    /// Where it would be set now.
    pub pixel: DVec2,
    /// From the pointer to the mark as it was grabbed.
    grip: DVec2,
    /// Where the pointer pressed; a mark that was grabbed stays until it moves from there.
    pressed: Pos2,
    has_moved: bool,
}

/// Where a mark at a pixel was meant to be, by the picture from the size that it is shown at to the finest.
pub(super) fn snapped(picture: &Picture, view: &View, pixel: DVec2) -> Option<(DVec2, SnappedTo)> {
    let coarsest = ((1.0 / view.zoom).log2().round().max(0.0) as usize).min(picture.levels().len() - 1);
    let mut found: Option<(DVec2, SnappedTo)> = None;
    for level in (0..=coarsest).rev() {
        let size = (1u64 << level) as f64;
        let radius = if level == coarsest { (view.pixels(SNAP) / size).clamp(1.5, 12.0) } else { FINER_PX };
        let at = found.map_or(pixel, |(at, _)| at) / size;
        let Some((grey, from)) = picture.grey(level, at, Grey::reach_px(radius)) else { break };
        match snap(&grey, at - from, radius) {
            Some(snapped) => found = Some(((snapped.pixel + from) * size, snapped.to)),
            // What the coarse picture shows and a finer one does not is placed as well as it can be.
            None => break,
        }
    }
    found
}

impl MarkApp {
    /// Where a mark is set that was aimed at a pixel.
    pub(super) fn aimed(&self, pane: usize, pixel: DVec2, is_free: bool) -> DVec2 {
        if is_free || !self.shown.snap {
            return pixel;
        }
        let (Some(picture), Some(view)) = (self.picture_in(pane), self.panes[pane].view) else { return pixel };
        snapped(&picture, &view, pixel).map_or(pixel, |(at, _)| at)
    }

    /// The mark nearest to a place of a pane's window.
    pub(super) fn mark_at(&self, pane: usize, at: Pos2) -> Option<(String, DVec2)> {
        let (view, photo) = (self.panes[pane].view?, self.photo_in(pane)?);
        let marks = self.document.project().file.point.iter().filter_map(|point| {
            let pixel = DVec2::from(*point.marks.get(&photo)?);
            Some((view.to_window(pixel).distance(at), point.name.clone(), pixel))
        });
        let near = marks.filter(|(distance, ..)| *distance <= GRAB);
        // Of marks in one place the active point's is meant.
        let rank = |(distance, name, _): &(f32, String, DVec2)| {
            if self.active_point.as_ref() == Some(name) { distance - GRAB } else { *distance }
        };
        near.min_by(|a, b| rank(a).total_cmp(&rank(b))).map(|(_, name, pixel)| (name, pixel))
    }

    /// The pointer presses: a mark is grabbed, or a new one begun, also over one that is there if it is to be `over`.
    pub(super) fn press(&mut self, pane: usize, at: Pos2, is_free: bool, over: bool) {
        self.active_pane = pane;
        let (Some(view), Some(photo)) = (self.panes[pane].view, self.photo_in(pane)) else { return };
        let pixel = view.to_pixel(at);
        if self.tool != Tool::Mark {
            self.edge_end(pane, pixel, is_free);
            return;
        }
        if let Some((point, mark)) = self.mark_at(pane, at).filter(|_| !over) {
            self.activate(point.clone());
            let grip = mark - pixel;
            self.drag = Some(Drag { pane, point, photo, pixel: mark, grip, pressed: at, has_moved: false });
            return;
        }
        let is_in = self.picture_in(pane).is_some_and(|p| (pixel.cmpge(DVec2::ZERO) & pixel.cmple(p.size())).all());
        if !is_in {
            self.say("marks lie inside of a photograph that has been read".to_owned());
            return;
        }
        let point = self.active_point.clone().unwrap_or_else(|| self.new_name());
        let pixel = self.aimed(pane, pixel, is_free);
        self.drag = Some(Drag { pane, point, photo, pixel, grip: DVec2::ZERO, pressed: at, has_moved: true });
    }

    /// The pointer moves while it is pressed.
    pub(super) fn drag_to(&mut self, at: Pos2, is_free: bool) {
        let Some(mut drag) = self.drag.take() else { return };
        drag.has_moved |= drag.pressed.distance(at) > 3.0;
        if let Some(view) = self.panes[drag.pane].view.filter(|_| drag.has_moved) {
            drag.pixel = self.aimed(drag.pane, view.to_pixel(at) + drag.grip, is_free);
        }
        self.drag = Some(drag);
    }

    /// The pointer lets go.
    pub(super) fn release(&mut self) {
        let Some(drag) = self.drag.take() else { return };
        if drag.has_moved {
            self.set_mark(&drag.point, &drag.photo, drag.pixel);
        }
    }

    /// Marks a point, which is made where there is none of that name.
    pub(super) fn set_mark(&mut self, point: &str, photo: &str, pixel: DVec2) {
        self.document.end_run();
        let is_new = self.document.project().file.point.iter().all(|entry| entry.name != point);
        let run = is_new.then(|| format!("new {point}"));
        if is_new && !self.edit_run(&Edit::AddPoint { name: point.to_owned() }, run.as_deref()) {
            return;
        }
        let edit = Edit::SetMark { point: point.to_owned(), photo: photo.to_owned(), pixel: pixel.to_array() };
        if self.edit_run(&edit, run.as_deref()) {
            self.document.end_run();
            self.activate(point.to_owned());
        }
    }

    /// One end of an edge; the second finishes it.
    pub(super) fn edge_end(&mut self, pane: usize, pixel: DVec2, is_free: bool) {
        let Some(photo) = self.photo_in(pane) else { return };
        let pixel = self.aimed(pane, pixel, is_free);
        let index = self.panes[pane].photo;
        let begun = |first: Option<(usize, DVec2)>| first.filter(|(in_photo, _)| *in_photo == index).map(|(_, start)| start);
        match self.tool {
            Tool::Mark => {}
            Tool::Edge { axis, first } => match begun(first) {
                None => self.tool = Tool::Edge { axis, first: Some((index, pixel)) },
                Some(start) => {
                    self.edit(&Edit::AddSegment { photo, axis, ends: [start.to_array(), pixel.to_array()] });
                    self.tool = Tool::Edge { axis, first: None };
                }
            },
            Tool::Witness { which, first } => match begun(first) {
                None => self.tool = Tool::Witness { which, first: Some((index, pixel)) },
                Some(start) => {
                    self.add_witness(photo, which, [start, pixel]);
                    self.tool = Tool::Witness { which, first: None };
                }
            },
        }
    }
}
