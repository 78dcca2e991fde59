//! The fields of a shape's dialog.

use super::Wish;
use super::draft::{Again, ShapeDraft, is_main, is_marked};
use super::line::is_line;
use super::roles::{self, List, Which};
use crate::app::dialogs::{QUIET, focus_once, number_field, type_over};
use crate::app::panes::ACTIVE;
use eframe::egui::{
    CollapsingHeader, Color32, ComboBox, Context, Grid, Id, Key, Label, Modifiers, RichText, ScrollArea, Sense, TextEdit, Ui,
};
use heliodon_photo::model::table::Kind;

/// Which shape, its name and its kind.
pub(super) fn heading(ui: &mut Ui, draft: &mut ShapeDraft, shapes: &[String], chosen: &[String]) -> Option<Wish> {
    let mut wish = None;
    ui.horizontal(|ui| {
        ui.label("Name");
        let field = ui.add(TextEdit::singleline(&mut draft.name).desired_width(190.0));
        focus_once(ui, &field, &draft.name);
        ui.label("Mesh").on_hover_text("Shapes of one mesh go into one file, and polygons of it share points");
        let mesh = ui.add(TextEdit::singleline(&mut draft.part).hint_text("of its own").desired_width(120.0));
        // the mesh is that of the shape before: whoever comes here has another in mind
        if mesh.gained_focus() && is_tab(ui) {
            type_over(ui, &mesh, &draft.part);
        }
        // from here on its places are typed: kinds have keys of their own
        if mesh.lost_focus() && is_tab(ui) {
            draft.focus = Some(draft.active);
        }
        if !shapes.is_empty() {
            let shown = draft.was.clone().unwrap_or_else(|| "new".to_owned());
            ComboBox::from_id_salt("which shape").selected_text(shown).width(120.0).show_ui(ui, |ui| {
                if ui.selectable_label(draft.was.is_none(), "new").clicked() && draft.was.is_some() {
                    wish = Some(Wish::Open(None));
                }
                for name in shapes {
                    let is_it = draft.was.as_ref() == Some(name);
                    if ui.selectable_label(is_it, name.as_str()).clicked() && !is_it {
                        wish = Some(Wish::Open(Some(name.clone())));
                    }
                }
            });
        }
    });
    ui.horizontal_wrapped(|ui| {
        for (number, (kind, word)) in roles::KINDS.into_iter().enumerate() {
            let label = ui.selectable_label(draft.kind == kind, word).on_hover_text(format!("Ctrl+{}", number + 1));
            if label.clicked() {
                become_kind(draft, kind, chosen);
            }
        }
    });
    ui.add(Label::new(RichText::new(format!("It needs {}.", roles::needs(draft.kind))).small().color(QUIET)).wrap());
    wish
}

/// Another kind, whose places are typed next.
fn become_kind(draft: &mut ShapeDraft, kind: Kind, chosen: &[String]) {
    if draft.kind != kind {
        let points = draft.main_points();
        draft.become_kind(kind, if points.is_empty() { chosen } else { &points });
    }
    draft.focus = Some(draft.active);
}

/// Keys that spare the way to what they choose: the kind, its mirror, how often it stands.
pub(super) fn keys(ctx: &Context, draft: &mut ShapeDraft, chosen: &[String]) {
    const DIGITS: [Key; 8] = [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8];
    let pressed = |key| ctx.input_mut(|input| input.consume_key(Modifiers::COMMAND, key));
    for (key, (kind, _)) in DIGITS.into_iter().zip(roles::KINDS) {
        if pressed(key) {
            become_kind(draft, kind, chosen);
        }
    }
    if pressed(Key::M) {
        draft.go_to(List::Mirror);
    }
    if pressed(Key::R) {
        draft.stand(draft.again.next());
    }
}

/// Whether Tab goes on from here.
fn is_tab(ui: &Ui) -> bool {
    ui.input(|input| input.key_pressed(Key::Tab) && !input.modifiers.shift)
}

/// The lists of points, each place with its name.
pub(super) fn places(ui: &mut Ui, draft: &mut ShapeDraft, names: &[String]) {
    let mains: Vec<usize> = (0..draft.groups.len()).filter(|group| is_main(draft.groups[*group].list)).collect();
    for group in mains {
        list(ui, draft, group, names);
    }
    if draft.kind == Kind::Revolution && ui.button("A ring more, above").clicked() {
        draft.add_ring();
    }
    let others = (0..draft.groups.len()).filter(|group| matches!(draft.groups[*group].list, List::On(_) | List::Axis));
    for group in others.collect::<Vec<_>>() {
        folded(ui, draft, group, names);
    }
}

/// A list that most shapes do without, folded until it has points.
fn folded(ui: &mut Ui, draft: &mut ShapeDraft, group: usize, names: &[String]) {
    let of = &draft.groups[group];
    let is_used = of.slots.iter().any(|name| !name.trim().is_empty());
    let of = of.list;
    let title = roles::title(draft.kind, of);
    let is_open = is_used || draft.active.0 == group;
    let header = CollapsingHeader::new(RichText::new(&title).color(QUIET)).id_salt((draft.kind as usize, &title));
    let header = header.open(is_open.then_some(true)).show(ui, |ui| rows(ui, draft, group, names));
    if header.header_response.clicked() && !is_open {
        draft.go_to(of);
    }
}

fn list(ui: &mut Ui, draft: &mut ShapeDraft, group: usize, names: &[String]) {
    ui.label(RichText::new(roles::title(draft.kind, draft.groups[group].list)).strong());
    rows(ui, draft, group, names);
}

fn rows(ui: &mut Ui, draft: &mut ShapeDraft, group: usize, names: &[String]) {
    let (kind, of) = (draft.kind, draft.groups[group].list);
    let is_point = |typed: &str| names.iter().any(|name| name == typed);
    Grid::new(("places", group)).num_columns(2).min_col_width(112.0).spacing([8.0, 3.0]).show(ui, |ui| {
        for slot in 0..draft.groups[group].slots.len() {
            let is_active = draft.active == (group, slot);
            let colour = if is_active { ACTIVE } else { Color32::from_gray(205) };
            let label =
                Label::new(RichText::new(roles::place(kind, of, slot)).color(colour)).selectable(false).sense(Sense::CLICK);
            if ui.add(label).clicked() {
                (draft.active, draft.focus) = ((group, slot), Some((group, slot)));
            }
            let id = place_id((group, slot));
            let is_focused = ui.memory(|memory| memory.has_focus(id));
            let is_wanted = draft.focus == Some((group, slot));
            // before it is drawn, to hear what is typed in this frame already; fields let go of the keys again where something was clicked
            if is_wanted && !ui.input(|input| input.pointer.any_released()) {
                ui.memory_mut(|memory| memory.request_focus(id));
            }
            let text = &mut draft.groups[group].slots[slot];
            if is_focused {
                let step = ui.input_mut(|input| {
                    let mut pressed = |key| i32::from(input.consume_key(Modifiers::NONE, key));
                    pressed(Key::ArrowDown) - pressed(Key::ArrowUp)
                });
                if let Some(next) = stepped(names, text, step) {
                    *text = next;
                }
            }
            // three words are a place by its coordinates, two of a ring by its radius and height
            let count = text.split_whitespace().count();
            let is_place = count == 3 || (count == 2 && matches!(of, List::Ring(_))) || is_line(text, &is_point);
            let is_known = !is_marked(text) || is_place || is_point(text.trim());
            let words = if is_known { Color32::from_gray(235) } else { Color32::from_rgb(255, 128, 120) };
            let field = TextEdit::singleline(text).id(id).hint_text("-").text_color(words).desired_width(206.0);
            let field = ui.add(field).on_hover_text(
                "Type a name, press Down for the next that fits, or click its mark; or metres east, up and south of the origin, \
                 with points for any of them: foot+0.5 3.2 wall. A dot is what the place before has: . .+0.4 . \
                 All places in one line: 0 0 0 / 4 3 -2",
            );
            if field.gained_focus() {
                draft.active = (group, slot);
            }
            if is_wanted {
                draft.focus = None;
                field.request_focus();
            }
            ui.end_row();
        }
    });
}

fn place_id((group, slot): (usize, usize)) -> Id {
    Id::new(("place of a shape", group, slot))
}

/// A line whose field was left goes into its places, after all fields were drawn and while no button is held: what is clicked would not be where it was when
/// the button went down.
pub(super) fn spread_left(ui: &Ui, draft: &mut ShapeDraft, names: &[String]) {
    if ui.input(|input| input.pointer.any_down()) {
        return;
    }
    let is_point = |typed: &str| names.iter().any(|name| name == typed);
    let is_typed = |place| draft.focus == Some(place) || ui.memory(|memory| memory.has_focus(place_id(place)));
    let all = draft.groups.iter().enumerate().flat_map(|(group, of)| (0..of.slots.len()).map(move |slot| (group, slot)));
    let left =
        all.filter(|place| !is_typed(*place)).find(|(group, slot)| is_line(&draft.groups[*group].slots[*slot], &is_point));
    let Some(left) = left else { return };
    let active = draft.active;
    if let Some(next) = draft.spread(left, &is_point).filter(|_| is_tab(ui)) {
        draft.active = next;
    }
    // the next one; or that which was clicked has another number now, and so another field: that hears already what is typed in the next frame
    if draft.active != active {
        draft.focus = Some(draft.active);
        ui.memory_mut(|memory| memory.request_focus(place_id(draft.active)));
    }
}

/// The name after or before the one that is typed; where that is none, the first or last that has it in it.
fn stepped(names: &[String], typed: &str, step: i32) -> Option<String> {
    if step == 0 || names.is_empty() {
        return None;
    }
    let typed = typed.trim();
    if let Some(at) = names.iter().position(|name| name == typed) {
        return Some(names[(at as i32 + step).rem_euclid(names.len() as i32) as usize].clone());
    }
    let mut fitting = names.iter().filter(|name| name.to_lowercase().contains(&typed.to_lowercase()));
    if step > 0 { fitting.next() } else { fitting.next_back() }.cloned()
}

/// Names to click; Tab passes them by, for a field's arrows go through them as well.
pub(super) fn picker(ui: &mut Ui, draft: &mut ShapeDraft, names: &[String]) {
    let (group, slot) = draft.active;
    let typed = draft.groups.get(group).and_then(|group| group.slots.get(slot)).map_or("", |name| name.trim());
    let is_whole = names.iter().any(|name| name == typed);
    let typed = if is_whole || typed == "-" { String::new() } else { typed.to_lowercase() };
    let of = draft.groups.get(group).map_or(List::Points, |group| group.list);
    ui.label(RichText::new(format!("for {}:", roles::place(draft.kind, of, slot))).color(ACTIVE));
    let mut picked = None;
    // as high however few names fit: what is below it stays where it is
    let area = ScrollArea::vertical().id_salt("names").max_height(150.0).min_scrolled_height(150.0).auto_shrink([true, false]);
    area.show(ui, |ui| {
        ui.set_width(240.0);
        for name in names.iter().filter(|name| name.to_lowercase().contains(&typed)) {
            let is_used = draft.place_of(name).is_some();
            let colour = if is_used { Color32::from_gray(130) } else { Color32::from_gray(225) };
            let label = Label::new(RichText::new(name).color(colour)).selectable(false).sense(Sense::CLICK);
            if ui.add(label).clicked() {
                picked = Some(name.clone());
            }
        }
        if names.is_empty() {
            ui.label(RichText::new("no point has been marked yet").color(QUIET));
        }
    });
    if let Some(name) = picked {
        // of a line that stands there its first place only
        draft.spread_all(&|typed| names.iter().any(|name| name == typed));
        draft.pick(&name);
    }
}

/// All that a shape has beside its points.
pub(super) fn settings(ui: &mut Ui, draft: &mut ShapeDraft, names: &[String]) -> Option<Wish> {
    let knows = roles::settings(draft.kind);
    ui.horizontal_wrapped(|ui| {
        ui.checkbox(&mut draft.watertight, "closed").on_hover_text("It has caps, and its mesh is to be watertight");
        if knows.upright {
            ui.checkbox(&mut draft.upright, "upright").on_hover_text("Its axis, or its sides, are plumb");
        }
        if knows.flatten {
            ui.checkbox(&mut draft.flatten, "flat").on_hover_text("It is laid onto the plane nearest to its points");
            ui.checkbox(&mut draft.as_listed, "front as listed")
                .on_hover_text("Its front is where its corners run counter-clockwise, and not where the photographs are");
        }
        if knows.entasis {
            ui.checkbox(&mut draft.entasis, "swells").on_hover_text("Its shaft has an entasis");
        }
        if knows.sides {
            let usual = if draft.kind == Kind::Arch { "16" } else { "24" };
            number_field(ui, "sides", &mut draft.sides, usual, "");
        }
        if knows.depth {
            number_field(ui, "depth", &mut draft.depth_m, "0.4", "m");
        }
        number_field(ui, "rough by", &mut draft.tolerance_m, "0.005", "m")
            .on_hover_text("How far stone is from such a shape anyhow; counts beside the points' own uncertainty");
    });
    let drawn = edges(ui, draft);
    ui.horizontal_wrapped(|ui| {
        ui.label("It stands");
        for (again, word) in [
            (Again::Once, "once"),
            (Again::Step, "in steps"),
            (Again::Span, "from first to last"),
            (Again::Around, "around an axis"),
        ] {
            if ui.selectable_label(draft.again == again, word).on_hover_text("Ctrl+R: the next of these").clicked() {
                draft.stand(again);
            }
        }
    });
    // in a row of its own: fields that are wrapped are drawn over what stands before them
    if draft.again != Again::Once {
        ui.horizontal(|ui| {
            let mut last = number_field(ui, "in all", &mut draft.count, "8", "times");
            if std::mem::take(&mut draft.focus_count) {
                type_over(ui, &last, &draft.count);
            }
            if draft.again == Again::Around {
                last = number_field(ui, "every", &mut draft.angle_deg, "a full turn", "\u{b0}");
            }
            // its mirror stands between
            if last.lost_focus() && is_tab(ui) {
                draft.go_to(List::Repeat);
            }
        });
    }
    for group in 0..draft.groups.len() {
        match draft.groups[group].list {
            List::Repeat if draft.again != Again::Once => {
                let words = match draft.again {
                    Again::Step => "Two points that are one step apart",
                    Again::Span => "A point of the first one, and that point of the last",
                    _ => "Two points of the axis",
                };
                ui.label(RichText::new(words).color(QUIET));
                rows(ui, draft, group, names);
            }
            List::Mirror => folded(ui, draft, group, names),
            _ => {}
        }
    }
    drawn
}

/// Edges that photographs bear witness of.
fn edges(ui: &mut Ui, draft: &mut ShapeDraft) -> Option<Wish> {
    let mut removed = None;
    let known = roles::edges(draft.kind, draft.main_points().len());
    let wish = ui.horizontal_wrapped(|ui| {
        ui.label("Seen edges").on_hover_text("What photographs show of its edges counts beside its points");
        if !known.is_empty() {
            let shown = known.get(draft.edge).map_or_else(String::new, |which| roles::edge(draft.kind, *which));
            ComboBox::from_id_salt("which edge").selected_text(shown).width(150.0).show_ui(ui, |ui| {
                for (number, which) in known.iter().enumerate() {
                    ui.selectable_value(&mut draft.edge, number, roles::edge(draft.kind, *which));
                }
            });
        }
        let draw = ui.button("Draw in the photographs");
        for (number, edge) in draft.edges.iter().enumerate() {
            let name = roles::edge(draft.kind, Which::of(edge));
            let told = format!("{name}, {}", edge.photograph);
            ui.label(RichText::new(told).small());
            if ui.small_button("x").on_hover_text("Remove this edge").clicked() {
                removed = Some(number);
            }
        }
        draw.clicked().then_some(Wish::Draw)
    });
    if let Some(number) = removed {
        draft.edges.remove(number);
    }
    wish.inner
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrows_complete_what_is_typed_and_go_on_from_there() {
        let names: Vec<String> = ["door", "Tower-sw", "tower-se"].map(str::to_owned).to_vec();
        let next = |typed: &str, step: i32| stepped(&names, typed, step);
        assert_eq!(next("tow", 1).as_deref(), Some("Tower-sw"));
        assert_eq!(next("tow", -1).as_deref(), Some("tower-se"));
        assert_eq!(next("tower-se", 1).as_deref(), Some("door"));
        assert_eq!(next("", 1).as_deref(), Some("door"));
        assert_eq!((next("x", 1), next("door", 0), stepped(&[], "", 1)), (None, None, None));
    }
}
