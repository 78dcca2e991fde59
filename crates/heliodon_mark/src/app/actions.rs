//! What keys, buttons and the pointer do.

use super::dialogs::Dialog;
use super::{MOST_PANES, MarkApp, Tool};
use crate::document::{Edit, Saved};
use glam::DVec2;
use heliodon_photo::project::AxisEntry;
use heliodon_photo::solve::{PhotoResult, PointResult};

impl MarkApp {
    /// Edits the document, or says why not.
    pub(super) fn edit(&mut self, edit: &Edit) -> bool {
        self.document.end_run();
        self.edit_run(edit, None)
    }

    pub(super) fn edit_run(&mut self, edit: &Edit, run: Option<&str>) -> bool {
        match self.document.edit_in_a_run(edit, run) {
            Ok(()) => {
                self.say(edit.what());
                true
            }
            Err(error) => {
                self.complain(error.to_string());
                false
            }
        }
    }

    pub(super) fn undo(&mut self) {
        match self.document.undo() {
            Some(what) => self.say(format!("undone: {what}")),
            None => self.say("nothing is left to undo".to_owned()),
        }
    }

    pub(super) fn redo(&mut self) {
        match self.document.redo() {
            Some(what) => self.say(format!("done again: {what}")),
            None => self.say("nothing is left to do again".to_owned()),
        }
    }

    pub(super) fn save(&mut self) -> bool {
        match self.document.save() {
            Ok(Saved::Written) => {
                self.say(format!("saved: {}", self.document.path().display()));
                self.write_cameras();
                true
            }
            Ok(Saved::ChangedOutside) => {
                self.dialog = Dialog::ChangedOutside;
                false
            }
            Err(error) => {
                self.complain(error.to_string());
                false
            }
        }
    }

    pub(super) fn solve(&mut self) {
        self.asked_text = Some(self.document.text().to_owned());
        self.solver.solve(self.document.project(), self.document.text());
    }

    /// A name that no point has yet.
    pub(super) fn new_name(&self) -> String {
        let points = &self.document.project().file.point;
        let is_free = |name: &String| points.iter().all(|point| point.name != *name);
        (1..).map(|n| format!("p{n}")).find(is_free).unwrap_or_default()
    }

    pub(super) fn new_point(&mut self) {
        let name = self.new_name();
        if self.edit(&Edit::AddPoint { name: name.clone() }) {
            self.activate(name);
        }
    }

    pub(super) fn activate(&mut self, point: String) {
        if self.active_point.as_ref() != Some(&point) {
            self.document.end_run();
            self.scroll_to_point = true;
        }
        self.active_point = Some(point);
    }

    /// Goes to another point of the list.
    pub(super) fn step_point(&mut self, steps: i32) {
        let names: Vec<String> =
            self.listed_points().into_iter().map(|i| self.document.project().file.point[i].name.clone()).collect();
        if names.is_empty() {
            return;
        }
        let at = names.iter().position(|name| Some(name) == self.active_point.as_ref());
        let count = names.len() as i32;
        let next = at.map_or(if steps > 0 { 0 } else { count - 1 }, |at| (at as i32 + steps).rem_euclid(count));
        self.activate(names[next as usize].clone());
    }

    /// Points that the search leaves, by their place in the file.
    pub(super) fn listed_points(&self) -> Vec<usize> {
        let search = self.search.to_lowercase();
        let points = self.document.project().file.point.iter().enumerate();
        points.filter(|(_, point)| point.name.to_lowercase().contains(&search)).map(|(i, _)| i).collect()
    }

    pub(super) fn show_photo(&mut self, pane: usize, photo: usize) {
        if self.panes[pane].photo != photo {
            self.document.end_run();
            self.panes[pane] = super::Pane { photo, ..Default::default() };
        }
    }

    pub(super) fn step_photo(&mut self, steps: i32) {
        let count = self.document.project().file.photo.len() as i32;
        if count > 0 {
            let next = (self.panes[self.active_pane].photo as i32 + steps).rem_euclid(count);
            self.show_photo(self.active_pane, next as usize);
        }
    }

    pub(super) fn set_panes(&mut self, count: usize) {
        self.pane_count = count.clamp(1, MOST_PANES);
        self.active_pane = self.active_pane.min(self.pane_count - 1);
    }

    pub(super) fn step_pane(&mut self) {
        self.active_pane = (self.active_pane + 1) % self.pane_count;
    }

    pub(super) fn remove_mark(&mut self) {
        match (self.active_point.clone(), self.photo_in(self.active_pane)) {
            (Some(point), Some(photo)) => {
                self.edit(&Edit::RemoveMark { point, photo });
            }
            _ => self.say("choose a point whose mark is to be removed".to_owned()),
        }
    }

    pub(super) fn remove_point(&mut self) {
        if let Some(name) = self.active_point.clone() {
            let next = self.listed_points();
            self.edit(&Edit::RemovePoint { name: name.clone() });
            let is_gone = self.document.project().file.point.iter().all(|point| point.name != name);
            if is_gone && next.len() > 1 {
                self.active_point = None;
            }
        }
    }

    pub(super) fn toggle_selected(&mut self, point: &str) {
        match self.selected.iter().position(|name| name == point) {
            Some(at) => drop(self.selected.remove(at)),
            None => self.selected.push(point.to_owned()),
        }
    }

    pub(super) fn toggle_ground(&mut self) {
        if let Some(name) = self.active_point.clone() {
            let ground = self.document.project().file.point.iter().any(|point| point.name == name && point.ground);
            self.edit(&Edit::SetGround { name, ground: !ground });
        }
    }

    pub(super) fn begin_edges(&mut self, axis: AxisEntry) {
        self.tool = Tool::Edge { axis, first: None };
        let along = ["east, or along the building (X)", "up (Y)", "south, or across the building (Z)"][axis as usize];
        let end = if axis == AxisEntry::Y { "its foot first" } else { "its lesser end first" };
        self.say(format!("edges that run {along}: click both ends of one, {end}"));
    }

    /// The nearest edge of the active pane's photograph to a pixel goes: one of the shape that is put together, where that one's are drawn.
    pub(super) fn remove_edge_near(&mut self, pane: usize, pixel: DVec2) {
        let (Some(photo), Some(view)) = (self.photo_in(pane), self.panes[pane].view) else { return };
        let distance = |ends: [[f64; 2]; 2]| {
            let [a, b] = ends.map(DVec2::from);
            let t = ((pixel - a).dot(b - a) / (b - a).length_squared().max(1e-12)).clamp(0.0, 1.0);
            pixel.distance(a + (b - a) * t)
        };
        let is_shapes = matches!(self.tool, Tool::Witness { .. });
        let of_shape = self.aside.iter().filter(|_| is_shapes).flat_map(|draft| draft.edges.iter().enumerate());
        let of_shape =
            of_shape.filter(|(_, edge)| edge.photograph == photo).map(|(i, edge)| (distance([edge.from, edge.to]), i, 0));
        let drawn =
            self.document.project().file.edge.iter().enumerate().filter(|(_, entry)| !is_shapes && entry.photo == photo);
        let segments =
            drawn.flat_map(|(i, entry)| entry.segments.iter().enumerate().map(move |(k, ends)| (distance(*ends), i, k)));
        let near = of_shape.chain(segments).filter(|(distance, ..)| *distance <= view.pixels(12.0));
        match near.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((_, edge, _)) if is_shapes => {
                if let Some(draft) = &mut self.aside {
                    draft.edges.remove(edge);
                }
            }
            Some((_, edge, segment)) => {
                self.edit(&Edit::RemoveSegment { edge, segment });
            }
            None => self.say("no edge is here: put the pointer or the cursor on it".to_owned()),
        }
    }

    /// Where the active point is to be looked for in a photograph: its mark, or where it was solved to be.
    pub(super) fn expected(&self, photo: &str) -> Option<DVec2> {
        let point = self.active_point.as_deref()?;
        self.mark(point, photo).or_else(|| {
            let outcome = self.outcome.as_ref()?;
            outcome.camera(photo)?.project(outcome.position_m(point)?)
        })
    }

    /// Brings the active point into the middle of every pane that knows where it is.
    pub(super) fn find_point(&mut self) {
        let mut found = false;
        for pane in 0..self.pane_count {
            let expected = self.photo_in(pane).and_then(|photo| self.expected(&photo));
            if let (Some(at), Some(view)) = (expected, &mut self.panes[pane].view) {
                view.centre = at;
                view.zoom = view.zoom.max(1.0);
                found = true;
            }
        }
        if !found {
            self.say("where this point is in these photographs is not known yet".to_owned());
        }
    }

    /// Shows a mark that was found wrong: the worst, or the next after the one that is shown.
    pub(super) fn show_wrong(&mut self) {
        let Some(outcome) = self.outcome.as_ref().filter(|outcome| !outcome.wrong_marks.is_empty()) else {
            self.say("no mark is known to be wrong".to_owned());
            return;
        };
        let shown = self.photo_in(self.active_pane).zip(self.active_point.clone());
        let at = outcome.wrong_marks.iter().position(|name| Some(name) == shown.as_ref());
        let (photo, point) = outcome.wrong_marks[at.map_or(0, |at| (at + 1) % outcome.wrong_marks.len())].clone();
        self.show_mark(&photo, point);
    }

    /// Brings a mark into the middle of the pane that shows its photograph, or else of the active one.
    pub(super) fn show_mark(&mut self, photo: &str, point: String) {
        let Some(index) = self.document.project().file.photo.iter().position(|entry| entry.name() == photo) else { return };
        if let Some(pane) = (0..self.pane_count).find(|pane| self.panes[*pane].photo == index) {
            self.active_pane = pane;
        }
        self.show_photo(self.active_pane, index);
        self.panes[self.active_pane].goal = self.mark(&point, photo);
        self.activate(point);
    }

    /// Moves the active point's mark, or else the cursor, by a way of the window.
    pub(super) fn nudge(&mut self, way: DVec2, is_fine: bool) {
        let pane = self.active_pane;
        let Some(photo) = self.photo_in(pane) else { return };
        let mark = self.active_point.clone().and_then(|point| Some((self.mark(&point, &photo)?, point)));
        match mark.filter(|_| !self.cursor_mode && self.tool == Tool::Mark) {
            Some((at, point)) => {
                let step = if is_fine { 0.1 } else { 1.0 };
                let run = format!("nudge {point} {photo}");
                let pixel = (at + way * step).to_array();
                self.edit_run(&Edit::SetMark { point, photo, pixel }, Some(&run));
            }
            None => {
                let Some(mut view) = self.panes[pane].view else { return };
                let step = view.pixels(if is_fine { 1.0 } else { 12.0 });
                let cursor = self.cursor(pane).unwrap_or(view.centre) + way * step;
                // It takes the photograph along at the margin.
                let at = view.to_window(cursor);
                let inner = view.rect.shrink(30.0);
                if !inner.contains(at) {
                    let to = inner.clamp(at);
                    view.pan(to.x - at.x, to.y - at.y);
                }
                self.panes[pane].cursor = Some(cursor);
                self.panes[pane].view = Some(view);
            }
        }
    }

    /// Where the keyboard's cursor is in a pane.
    pub(super) fn cursor(&self, pane: usize) -> Option<DVec2> {
        self.panes[pane].cursor
    }

    /// Marks at the cursor, as a click would.
    pub(super) fn mark_at_cursor(&mut self, is_free: bool) {
        let pane = self.active_pane;
        let (Some(view), Some(photo)) = (self.panes[pane].view, self.photo_in(pane)) else { return };
        let pixel = self.cursor(pane).unwrap_or(view.centre);
        if self.tool != Tool::Mark {
            self.edge_end(pane, pixel, is_free);
            return;
        }
        let point = self.active_point.clone().unwrap_or_else(|| self.new_name());
        let pixel = self.aimed(pane, pixel, is_free);
        self.set_mark(&point, &photo, pixel);
    }

    /// What would help most now, as the status line tells it.
    #[must_use]
    pub fn next_step(&self) -> String {
        let file = &self.document.project().file;
        if file.photo.is_empty() {
            return "add photographs: [[photo]] with file = \"...\" in photos.toml".to_owned();
        }
        if let Tool::Edge { axis, first } = self.tool {
            let axis = ["X", "Y (up)", "Z"][axis as usize];
            let ends = if first.is_some() { "click its other end" } else { "click one end of an edge" };
            return format!("edges along {axis}: {ends}; X, Y or Z for another axis, Delete removes one, Esc ends");
        }
        if let Tool::Witness { which, first } = self.tool {
            let edge = self.witness_name(which);
            let ends = if first.is_some() { "click its other end" } else { "click one end of it" };
            return format!("the {edge} edge of the shape: {ends}; Delete removes one, Esc goes back to the shape");
        }
        let Some(point) = &self.active_point else {
            return "click a corner that several photographs show: it becomes a point".to_owned();
        };
        let marks = file.point.iter().find(|entry| entry.name == *point).map_or(0, |entry| entry.marks.len());
        match marks {
            0 => return format!("click {point} in a photograph (N begins another point)"),
            1 => {
                let has_line = self.outcome.as_ref().is_some_and(|outcome| outcome.counts().0 > 1);
                let line = if has_line { ": it lies on the orange line" } else { "" };
                return format!("mark {point} in a second photograph{line}; PageDown shows the next");
            }
            _ => {}
        }
        if let Some(fault) = &self.solve_fault {
            return format!("not solved: {fault}");
        }
        let Some(outcome) = &self.outcome else {
            return "S solves; N begins the next point".to_owned();
        };
        if let Some((photo, point)) = outcome.wrong_marks.first() {
            let off = outcome.residual(photo, point).map_or(0.0, |residual| residual.off.length());
            return format!("O shows the mark that fits worst: {point} in {photo} is off by {off:.1} px");
        }
        if let Some(wrong) = outcome.wrong_shapes.first() {
            return wrong.clone();
        }
        // Points that are marked often enough, and are nowhere all the same.
        let is_marked = |name: &str| file.point.iter().any(|entry| entry.name == name && entry.marks.len() > 1);
        let astray = outcome.points.iter().find_map(|(name, found)| match found {
            PointResult::Unsolved(why) if is_marked(name) => Some((name, why)),
            _ => None,
        });
        let unsolved = outcome.photos.iter().find_map(|(name, photo)| match photo {
            PhotoResult::Unsolved(why) => Some((name, why)),
            PhotoResult::Solved(_) => None,
        });
        match unsolved.or(astray) {
            Some((name, why)) => format!("{name}: {why}"),
            None if file.distance.is_empty() && !outcome.file.metric => {
                "all is solved but for the scale: choose two points with X and give their distance with D".to_owned()
            }
            None if file.shape.is_empty() => "choose points with X and make a shape of them with B".to_owned(),
            None => "all is solved; N begins another point, Ctrl+S saves".to_owned(),
        }
    }
}
