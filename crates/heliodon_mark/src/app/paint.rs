//! Marks, lines and words over a photograph. All of it has a dark border, to be seen on marble and in shadow.

use super::panes::ACTIVE;
use super::{MarkApp, Tool};
use crate::pictures::{Picture, View};
use crate::solving::Residual;
use eframe::egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke, StrokeKind, Ui, Vec2};
use glam::DVec2;
use heliodon_photo::project::AxisEntry;
use heliodon_photo::snap::SnappedTo;
use heliodon_photo::solve::PhotoResult;

const MARK: Color32 = Color32::from_rgb(90, 215, 255);
const WRONG: Color32 = Color32::from_rgb(255, 72, 66);
const WRONG_WORDS: Color32 = Color32::from_rgb(255, 128, 120);
const LINE: Color32 = Color32::from_rgb(255, 160, 50);
const LINE_FAINT: Color32 = Color32::from_rgba_premultiplied(115, 72, 22, 115);
const MODEL: Color32 = Color32::from_rgb(90, 225, 165);
const MODEL_INNER: Color32 = Color32::from_rgba_premultiplied(41, 101, 74, 115);
const MODEL_HIDDEN: Color32 = Color32::from_rgba_premultiplied(49, 124, 91, 140);
/// Edges of a shape.
const WITNESS: Color32 = Color32::from_rgb(255, 225, 120);
const PREDICTED: Color32 = Color32::from_rgb(240, 130, 255);
const BORDER: Color32 = Color32::from_rgba_premultiplied(0, 0, 0, 170);
const AXES: [Color32; 3] =
    [Color32::from_rgb(255, 130, 170), Color32::from_rgb(215, 255, 60), Color32::from_rgb(110, 150, 255)];

/// A mark's arms begin and end so far from it, points.
const ARM: [f32; 2] = [3.0, 9.0];
const TITLE_HEIGHT: f32 = 22.0;
const NAME_SIZE: f32 = 12.0;
/// The magnifier: its side, and how much larger than the photograph it shows things at least.
const MAGNIFIER: f32 = 150.0;
const MAGNIFIED: f64 = 8.0;

fn line(painter: &Painter, points: Vec<Pos2>, width: f32, colour: Color32) {
    painter.add(Shape::line(points.clone(), Stroke::new(width + 2.0, BORDER)));
    painter.add(Shape::line(points, Stroke::new(width, colour)));
}

fn cross(painter: &Painter, at: Pos2, width: f32, colour: Color32) {
    for (pass_width, pass_colour) in [(width + 2.0, BORDER), (width, colour)] {
        for way in [Vec2::X, -Vec2::X, Vec2::Y, -Vec2::Y] {
            painter.line_segment([at + way * ARM[0], at + way * ARM[1]], Stroke::new(pass_width, pass_colour));
        }
    }
}

/// Words beside marks, none over another.
#[derive(Default)]
struct Names {
    taken: Vec<Rect>,
}

impl Names {
    /// Draws it where there is room, or, if it has to be seen, anywhere.
    fn put(&mut self, painter: &Painter, at: Pos2, words: &str, colour: Color32, is_needed: bool) {
        let text = painter.layout_no_wrap(words.to_owned(), FontId::proportional(NAME_SIZE), colour);
        let size = text.size();
        let places = [
            Vec2::new(11.0, -size.y / 2.0 - 9.0),
            Vec2::new(11.0, 4.0),
            Vec2::new(-11.0 - size.x, -size.y / 2.0 - 9.0),
            Vec2::new(-11.0 - size.x, 4.0),
            Vec2::new(-size.x / 2.0, -size.y - 16.0),
            Vec2::new(-size.x / 2.0, 16.0),
            Vec2::new(11.0, -size.y - 26.0),
            Vec2::new(11.0, 26.0),
            Vec2::new(-11.0 - size.x, -size.y - 26.0),
        ];
        let room = painter.clip_rect().shrink(2.0);
        let rects = places.map(|place| Rect::from_min_size(at + place, size).expand(2.0));
        let is_free = |rect: &&Rect| room.contains_rect(**rect) && self.taken.iter().all(|taken| !taken.intersects(**rect));
        let Some(rect) = rects.iter().find(is_free).or(rects.first().filter(|_| is_needed)) else { return };
        painter.rect_filled(*rect, 3.0, Color32::from_black_alpha(150));
        painter.galley(rect.min + Vec2::splat(2.0), text, colour);
        self.taken.push(*rect);
    }
}

impl MarkApp {
    pub(super) fn paint_over(
        &mut self,
        ui: &Ui,
        painter: &Painter,
        pane: usize,
        photo: &str,
        view: &View,
        pointer: Option<Pos2>,
    ) {
        let to_window = |pixels: &[DVec2]| -> Vec<Pos2> { pixels.iter().map(|p| view.to_window(*p)).collect() };
        let solved = self.outcome.as_ref().and_then(|outcome| outcome.lines.get(photo));
        // a shape that is put together stands among the others at once
        let previewed = self.preview.as_ref().and_then(|preview| preview.lines(photo));
        let model = previewed.or(solved).filter(|_| self.shown.model);
        for drawn in model.into_iter().flatten() {
            let points = to_window(&drawn.line);
            match (drawn.is_seen, drawn.is_border) {
                (true, true) => line(painter, points, 1.5, MODEL),
                (true, false) => drop(painter.add(Shape::line(points, Stroke::new(1.0, MODEL_INNER)))),
                (false, true) => painter.extend(Shape::dashed_line(&points, Stroke::new(1.0, MODEL_HIDDEN), 3.0, 5.0)),
                (false, false) => {}
            }
        }
        self.paint_edges(painter, pane, photo, view, pointer);
        let mut names = Names::default();
        if self.shown.lines {
            // Where it is marked already, they only show how well that fits.
            let is_marked = self.active_point.as_deref().is_some_and(|point| self.mark(point, photo).is_some());
            for pixels in self.lines_in(photo).into_iter().flat_map(|(_, lines)| lines) {
                if is_marked && self.drag.is_none() {
                    painter.add(Shape::line(to_window(&pixels), Stroke::new(1.0, LINE_FAINT)));
                } else {
                    line(painter, to_window(&pixels), 1.2, LINE);
                }
            }
        }
        self.paint_marks(painter, photo, view, &mut names);
        if let Some(at) = pointer.filter(|_| self.drag.is_none() && self.shown.snap && !ui.input(|input| input.modifiers.alt)) {
            self.paint_snap(painter, pane, view, at);
        }
        let is_cursor = pane == self.active_pane && (self.cursor_mode || self.cursor(pane).is_some() && pointer.is_none());
        if let Some(at) = self.cursor(pane).filter(|_| is_cursor).map(|pixel| view.to_window(pixel)) {
            for way in [Vec2::X, Vec2::Y] {
                for side in [-1.0, 1.0] {
                    let ends = vec![at + way * (side * 5.0), at + way * (side * 22.0)];
                    line(painter, ends, 1.5, Color32::WHITE);
                }
            }
            painter.circle_stroke(at, 10.0, Stroke::new(1.5, Color32::WHITE));
        }
    }

    fn paint_marks(&self, painter: &Painter, photo: &str, view: &View, names: &mut Names) {
        let room = view.rect.expand(20.0);
        let mut marks: Vec<(&str, DVec2, bool)> = Vec::new();
        let file = &self.document.project().file;
        for point in &file.point {
            if let Some(pixel) = self.mark(&point.name, photo) {
                marks.push((&point.name, pixel, self.active_point.as_ref() == Some(&point.name)));
            }
        }
        if let Some(drag) = self.drag.as_ref().filter(|drag| drag.photo == photo)
            && marks.iter().all(|(name, ..)| *name != drag.point)
        {
            marks.push((&drag.point, drag.pixel, true));
        }
        names.taken.extend(
            marks.iter().map(|(_, pixel, _)| Rect::from_center_size(view.to_window(*pixel), Vec2::splat(2.0 * ARM[1] - 5.0))),
        );
        // The active one is named first and drawn last.
        marks.sort_by_key(|(.., is_active)| !is_active);
        // To where the mark is now, which may have been moved since it was solved.
        let residual = |name: &str, mark: DVec2| {
            let solved = self.outcome.as_ref()?.residual(photo, name)?;
            Some(Residual { off: self.predicted(photo, name).map_or(solved.off, |picture| picture - mark), ..solved })
        };
        for &(name, pixel, is_active) in &marks {
            let at = view.to_window(pixel);
            if !room.contains(at) {
                continue;
            }
            let wrong = residual(name, pixel).filter(|residual| residual.is_wrong);
            let words = match wrong {
                Some(wrong) => format!("{name}: off by {:.1} px", wrong.off.length()),
                None => name.to_owned(),
            };
            let colour = if wrong.is_some() {
                WRONG_WORDS
            } else if is_active {
                ACTIVE
            } else {
                MARK
            };
            if self.shown.names || is_active || wrong.is_some() {
                names.put(painter, at, &words, colour, is_active || wrong.is_some());
            }
        }
        for &(name, pixel, is_active) in marks.iter().rev() {
            let at = view.to_window(pixel);
            if !room.contains(at) {
                continue;
            }
            let residual = residual(name, pixel);
            let is_wrong = residual.is_some_and(|residual| residual.is_wrong);
            if let Some(residual) = residual.filter(|_| self.shown.residuals > 0.0) {
                let tip = view.to_window(pixel + residual.off * self.shown.residuals);
                arrow(painter, at, tip, if is_wrong { WRONG } else { Color32::WHITE });
            }
            let colour = if is_wrong {
                WRONG
            } else if is_active {
                ACTIVE
            } else {
                MARK
            };
            cross(painter, at, if is_active { 2.0 } else { 1.4 }, colour);
            let is_chosen = match self.draft() {
                Some(draft) => draft.place_of(name).is_some(),
                None => self.selected.iter().any(|chosen| chosen == name),
            };
            if is_chosen {
                painter.circle_stroke(at, 12.0, Stroke::new(3.5, BORDER));
                painter.circle_stroke(at, 12.0, Stroke::new(1.6, colour));
            }
        }
        // Where to look for the active point, if it is not marked here.
        if let Some(name) = self.active_point.as_deref().filter(|name| marks.iter().all(|(marked, ..)| marked != name))
            && let Some(at) = self.predicted(photo, name).map(|pixel| view.to_window(pixel)).filter(|at| room.contains(*at))
        {
            let corners = [Vec2::X, Vec2::Y, -Vec2::X, -Vec2::Y, Vec2::X].map(|way| at + way * 9.0);
            line(painter, corners.to_vec(), 1.5, PREDICTED);
            names.put(painter, at, &format!("{name} should be here"), PREDICTED, true);
        }
    }

    fn paint_edges(&self, painter: &Painter, pane: usize, photo: &str, view: &View, pointer: Option<Pos2>) {
        let draw = |axis: AxisEntry, ends: [Pos2; 2]| {
            let colour = AXES[axis as usize];
            line(painter, ends.to_vec(), 1.8, colour);
            painter.circle_filled(ends[0], 3.0, colour);
            arrow(painter, ends[0], ends[1], colour);
        };
        let witness = |ends: [Pos2; 2]| {
            line(painter, ends.to_vec(), 2.2, WITNESS);
            for end in ends {
                painter.circle_filled(end, 3.0, WITNESS);
            }
        };
        for edge in self.draft().into_iter().flat_map(|draft| &draft.edges).filter(|edge| edge.photograph == photo) {
            witness([edge.from, edge.to].map(|end| view.to_window(DVec2::from(end))));
        }
        for edge in self.document.project().file.edge.iter().filter(|edge| edge.photo == photo) {
            for ends in &edge.segments {
                draw(edge.axis, ends.map(|end| view.to_window(DVec2::from(end))));
            }
        }
        if let Tool::Edge { first: Some((index, start)), .. } | Tool::Witness { first: Some((index, start)), .. } = self.tool
            && index == self.panes[pane].photo
        {
            let start = view.to_window(start);
            let end = pointer.or_else(|| self.cursor(pane).map(|pixel| view.to_window(pixel))).unwrap_or(start);
            match self.tool {
                Tool::Edge { axis, .. } => draw(axis, [start, end]),
                _ => witness([start, end]),
            }
        }
    }

    /// Where a click would mark.
    fn paint_snap(&self, painter: &Painter, pane: usize, view: &View, at: Pos2) {
        let Some(picture) = self.picture_in(pane) else { return };
        let Some((pixel, to)) = super::marking::snapped(&picture, view, view.to_pixel(at)) else { return };
        let place = view.to_window(pixel);
        match to {
            SnappedTo::Corner => {
                for (width, colour) in [(3.5, BORDER), (1.5, ACTIVE)] {
                    let square = Rect::from_center_size(place, Vec2::splat(10.0));
                    painter.rect_stroke(square, 0.0, Stroke::new(width, colour), StrokeKind::Middle);
                }
            }
            SnappedTo::Edge(along) => {
                let way = Vec2::new(along.x as f32, along.y as f32) * 8.0;
                line(painter, vec![place - way, place + way], 1.5, ACTIVE);
            }
        }
    }

    /// The photograph about the pointer, larger, in the corner that is farthest from it.
    #[expect(clippy::too_many_arguments, reason = "a pane and what it shows")]
    pub(super) fn magnify(
        &mut self,
        ui: &Ui,
        painter: &Painter,
        pane: usize,
        photo: &str,
        picture: &Picture,
        view: &View,
        pointer: Option<Pos2>,
    ) {
        let dragged = self.drag.as_ref().filter(|drag| drag.pane == pane).map(|drag| drag.pixel);
        let cursor = self.cursor(pane).filter(|_| self.cursor_mode && pane == self.active_pane);
        let Some(about) = dragged.or(cursor).or(pointer.map(|at| view.to_pixel(at))) else { return };
        let is_small = view.rect.width().min(view.rect.height()) < 2.0 * MAGNIFIER;
        if view.zoom >= MAGNIFIED / 2.0 || is_small || !(about.cmpge(DVec2::ZERO) & about.cmple(picture.size())).all() {
            return;
        }
        let at = view.to_window(about);
        let right = at.x < view.rect.center().x;
        let x = if right { view.rect.right() - MAGNIFIER - 8.0 } else { view.rect.left() + 8.0 };
        let rect = Rect::from_min_size(Pos2::new(x, view.rect.bottom() - MAGNIFIER - 8.0), Vec2::splat(MAGNIFIER));
        if rect.expand(20.0).contains(at) {
            return;
        }
        let inner = View { centre: about, zoom: MAGNIFIED, rect, ..*view };
        let painter = painter.with_clip_rect(rect.intersect(painter.clip_rect()));
        painter.rect_filled(rect, 0.0, Color32::BLACK);
        self.tiles.draw(ui.ctx(), &painter, photo, picture, &inner);
        self.paint_marks(&painter, photo, &inner, &mut Names::default());
        if dragged.is_none() {
            for way in [Vec2::X, Vec2::Y] {
                painter.line_segment([rect.center() - way * 12.0, rect.center() - way * 3.0], Stroke::new(1.0, Color32::WHITE));
                painter.line_segment([rect.center() + way * 12.0, rect.center() + way * 3.0], Stroke::new(1.0, Color32::WHITE));
            }
        }
        painter.rect_stroke(rect, 0.0, Stroke::new(2.0, Color32::from_gray(200)), StrokeKind::Inside);
    }

    /// A pane's photograph and how it is solved.
    pub(super) fn paint_title(&self, painter: &Painter, pane: usize, photo: &str, rect: Rect) {
        let strip = Rect::from_min_size(rect.min, Vec2::new(rect.width(), TITLE_HEIGHT));
        painter.rect_filled(strip, 0.0, Color32::from_black_alpha(185));
        let zoom = self.panes[pane].view.map(|view| format!("{:.0} %", view.zoom * 100.0)).unwrap_or_default();
        let marks = super::marks_told(
            self.document.project().file.point.iter().filter(|point| point.marks.contains_key(photo)).count(),
        );
        let (solved, colour) = match self.outcome.as_ref().and_then(|outcome| outcome.photos.get(photo)) {
            Some(PhotoResult::Solved(solved)) => (format!(", {:.2} px rms", solved.rms_px), Color32::from_gray(230)),
            Some(PhotoResult::Unsolved(_)) => (", not solved".to_owned(), Color32::from_rgb(255, 190, 120)),
            None => (String::new(), Color32::from_gray(230)),
        };
        let font = FontId::proportional(13.0);
        let right = painter.text(
            strip.right_center() - Vec2::new(8.0, 0.0),
            Align2::RIGHT_CENTER,
            zoom,
            font.clone(),
            Color32::from_gray(190),
        );
        let room = strip.with_max_x(right.left() - 8.0);
        let words = format!("{photo}   {marks}{solved}");
        painter.with_clip_rect(room.intersect(painter.clip_rect())).text(
            strip.left_center() + Vec2::new(8.0, 0.0),
            Align2::LEFT_CENTER,
            words,
            font,
            colour,
        );
    }
}

fn arrow(painter: &Painter, from: Pos2, tip: Pos2, colour: Color32) {
    let way = tip - from;
    if way.length() < 2.0 {
        return;
    }
    line(painter, vec![from, tip], 1.4, colour);
    let along = way / way.length();
    let across = Vec2::new(-along.y, along.x);
    let head = (way.length() * 0.5).min(7.0);
    painter.add(Shape::convex_polygon(
        vec![tip, tip - along * head + across * (head * 0.5), tip - along * head - across * (head * 0.5)],
        colour,
        Stroke::new(1.0, BORDER),
    ));
}
