//! What can be done to a project's file: each leaves all lines that it does not mean as they are, comments and layout with them.

use super::merge::become_table;
use heliodon_photo::model::table::ShapeRow;
use heliodon_photo::project::{AxisEntry, DirectionEntry, LensEntry, Toward};
use toml_edit::{Array, ArrayOfTables, DocumentMut, Item, RawString, Table, TableLike, Value};

/// Marks are written to this part of a pixel.
const PARTS_OF_A_PIXEL: f64 = 100.0;

/// One thing done to a project.
#[derive(Clone, Debug, PartialEq)]
pub enum Edit {
    /// Marks a point in a photograph, or moves its mark.
    SetMark {
        /// The point's name.
        point: String,
        /// The photograph's name.
        photo: String,
        /// Where.
        pixel: [f64; 2],
    },
    /// Takes a mark away.
    RemoveMark {
        /// The point's name.
        point: String,
        /// The photograph's name.
        photo: String,
    },
    /// A new photograph.
    AddPhoto {
        /// Its file, from the project's folder.
        file: String,
    },
    /// A new point.
    AddPoint {
        /// Its name.
        name: String,
    },
    /// Another name for a point, wherever it is named.
    RenamePoint {
        /// The old name.
        from: String,
        /// The new one.
        to: String,
    },
    /// Takes a point away, with its marks and the distances and directions to it.
    RemovePoint {
        /// Its name.
        name: String,
    },
    /// Says whether a point lies on level ground.
    SetGround {
        /// Its name.
        name: String,
        /// Whether.
        ground: bool,
    },
    /// A piece of an edge along an axis of the building.
    AddSegment {
        /// The photograph's name.
        photo: String,
        /// The axis.
        axis: AxisEntry,
        /// From the axis's lesser to its greater coordinate.
        ends: [[f64; 2]; 2],
    },
    /// Takes a piece of an edge away.
    RemoveSegment {
        /// Which `[[edge]]`, in the file's order.
        edge: usize,
        /// Which of its segments.
        segment: usize,
    },
    /// Several, undone together; told by the last.
    Together(Vec<Edit>),
    /// A new shape.
    AddShape(Box<ShapeRow>),
    /// A shape becomes another.
    SetShape {
        /// What it was called.
        was: String,
        /// What it is now.
        row: Box<ShapeRow>,
    },
    /// Takes a shape away.
    RemoveShape {
        /// Its name.
        name: String,
    },
    /// Says how far two points are apart.
    SetDistance {
        /// Both.
        between: [String; 2],
        /// How far.
        metres: f64,
    },
    /// Takes a known distance away.
    RemoveDistance {
        /// Both points.
        between: [String; 2],
    },
    /// Says where the way between two points leads; what was said of these two goes.
    SetDirection(DirectionEntry),
    /// Takes a known direction away.
    RemoveDirection {
        /// Both points, whichever way it leads.
        between: [String; 2],
    },
    /// Says where a point is, or that this is not known.
    SetKnown {
        /// Its name.
        name: String,
        /// East, up and south of the origin.
        known_m: Option<[f64; 3]>,
    },
    /// What is known of a lens, and which photographs it took.
    SetLens {
        /// What it was called, nothing for a new one.
        was: Option<String>,
        /// What it is now.
        lens: Box<LensEntry>,
        /// The photographs' names; others that had it have none of their own then.
        photos: Vec<String>,
    },
    /// Takes a lens away; its photographs have none of their own then.
    RemoveLens {
        /// Its name.
        name: String,
    },
}

impl Edit {
    /// What it is, for people.
    #[must_use]
    pub fn what(&self) -> String {
        match self {
            Self::SetMark { point, photo, .. } => format!("{point} marked in {photo}"),
            Self::RemoveMark { point, photo } => format!("mark of {point} removed from {photo}"),
            Self::AddPhoto { file } => format!("photograph {file} added"),
            Self::AddPoint { name } => format!("point {name} added"),
            Self::RenamePoint { from, to } => format!("point {from} renamed to {to}"),
            Self::RemovePoint { name } => format!("point {name} removed"),
            Self::SetGround { name, ground: true } => format!("{name} lies on the ground"),
            Self::SetGround { name, ground: false } => format!("{name} need not lie on the ground"),
            Self::AddSegment { photo, .. } => format!("edge drawn in {photo}"),
            Self::RemoveSegment { .. } => "edge removed".to_owned(),
            Self::Together(all) => all.last().map_or_else(String::new, Self::what),
            Self::AddShape(row) => format!("shape {} added", row.name),
            Self::SetShape { row, .. } => format!("shape {} changed", row.name),
            Self::RemoveShape { name } => format!("shape {name} removed"),
            Self::SetDistance { between: [a, b], metres } => format!("{a} - {b} set to {metres} m"),
            Self::RemoveDistance { between: [a, b] } => format!("distance {a} - {b} removed"),
            Self::SetDirection(DirectionEntry { from, to, toward }) => format!("{from} to {to} leads {toward}"),
            Self::RemoveDirection { between: [a, b] } => format!("direction {a} - {b} removed"),
            Self::SetKnown { name, known_m: Some([x, y, z]) } => format!("{name} lies at {x}, {y}, {z} m"),
            Self::SetKnown { name, known_m: None } => format!("{name} lies where photographs say"),
            Self::SetLens { was: None, lens, .. } => format!("lens {} added", lens.name),
            Self::SetLens { lens, .. } => format!("lens {} changed", lens.name),
            Self::RemoveLens { name } => format!("lens {name} removed"),
        }
    }

    /// Does it.
    ///
    /// # Errors
    /// Where what it names is not there, in words.
    pub(super) fn apply(&self, doc: &mut DocumentMut) -> Result<(), String> {
        match self {
            Self::SetMark { point, photo, pixel } => set_mark(doc, point, photo, *pixel),
            Self::RemoveMark { point, photo } => {
                let table = entry(doc, "point", "name", point)?;
                let marks = table.get_mut("marks").and_then(Item::as_table_like_mut);
                let found = marks.and_then(|marks| marks.remove(photo).map(|_| marks.is_empty()));
                let is_empty = found.ok_or_else(|| format!("{point} is not marked in {photo}"))?;
                if is_empty {
                    table.remove("marks");
                }
                Ok(())
            }
            Self::AddPhoto { file } => pushed(doc, "photo", table([("file", file.as_str().into())])),
            Self::AddPoint { name } => pushed(doc, "point", table([("name", name.as_str().into())])),
            Self::RenamePoint { from, to } => rename_point(doc, from, to),
            Self::RemovePoint { name } => remove_point(doc, name),
            Self::SetGround { name, ground } => {
                let point = entry(doc, "point", "name", name)?;
                if *ground {
                    set(point.entry("ground").or_insert(Item::None), true.into());
                } else {
                    point.remove("ground");
                }
                Ok(())
            }
            Self::AddSegment { photo, axis, ends } => add_segment(doc, photo, *axis, ends),
            Self::RemoveSegment { edge, segment } => {
                let gone = "that edge is no longer there";
                let edges = tables(doc, "edge")?;
                let segments = edges.get_mut(*edge).and_then(|e| e.get_mut("segments")?.as_array_mut()).ok_or(gone)?;
                if *segment >= segments.len() {
                    return Err(gone.to_owned());
                }
                segments.remove(*segment);
                if segments.is_empty() {
                    edges.remove(*edge);
                    dropped_if_empty(doc, "edge");
                }
                Ok(())
            }
            Self::Together(all) => all.iter().try_for_each(|edit| edit.apply(doc)),
            Self::AddShape(row) => {
                let row = shape_table(row)?;
                pushed(doc, "shape", row)
            }
            Self::SetShape { was, row } => {
                let row = shape_table(row)?;
                become_table(entry(doc, "shape", "name", was)?, &row);
                Ok(())
            }
            Self::RemoveShape { name } => removed(doc, "shape", |shape| text(shape, "name") == Some(name))
                .then_some(())
                .ok_or(format!("there is no shape called {name}")),
            Self::SetDistance { between, metres } => {
                let known = tables(doc, "distance")?.iter_mut().find(|d| is_between(*d, between));
                if let Some(known) = known {
                    set(known.entry("metres").or_insert(Item::None), (*metres).into());
                    return Ok(());
                }
                let names: Array = between.iter().map(String::as_str).collect();
                pushed(doc, "distance", table([("between", names.into()), ("metres", (*metres).into())]))
            }
            Self::RemoveDistance { between } => {
                let [a, b] = between;
                removed(doc, "distance", |d| is_between(d, between))
                    .then_some(())
                    .ok_or(format!("no distance {a} - {b} is known"))
            }
            Self::SetDirection(DirectionEntry { from, to, toward }) => {
                let between = [from.clone(), to.clone()];
                let toward = match toward {
                    Toward::Bearing(bearing_deg) => (*bearing_deg).into(),
                    word => word.to_string().into(),
                };
                let new = table([("from", from.as_str().into()), ("to", to.as_str().into()), ("toward", toward)]);
                let known = tables(doc, "direction")?.iter_mut().find(|d| leads_between(*d, &between));
                if let Some(known) = known {
                    become_table(known, &new);
                    return Ok(());
                }
                pushed(doc, "direction", new)
            }
            Self::RemoveDirection { between } => {
                let [a, b] = between;
                removed(doc, "direction", |d| leads_between(d, between))
                    .then_some(())
                    .ok_or(format!("no direction {a} - {b} is known"))
            }
            Self::SetKnown { name, known_m } => {
                let point = entry(doc, "point", "name", name)?;
                match known_m {
                    Some(place) => {
                        let place = place.iter().copied().collect::<Array>();
                        set(point.entry("known_m").or_insert(Item::None), place.into());
                    }
                    None => drop(point.remove("known_m")),
                }
                Ok(())
            }
            Self::SetLens { was, lens, photos } => set_lens(doc, was.as_deref(), lens, photos),
            Self::RemoveLens { name } => {
                if !removed(doc, "lens", |lens| text(lens, "name") == Some(name)) {
                    return Err(format!("there is no lens called {name}"));
                }
                let taken = tables(doc, "photo")?.iter_mut().filter(|photo| text(*photo, "lens") == Some(name));
                taken.for_each(|photo| drop(photo.remove("lens")));
                Ok(())
            }
        }
    }
}

/// A shape as its table is written: one line for each of its settings.
fn shape_table(row: &ShapeRow) -> Result<Table, String> {
    let row = toml_edit::ser::to_document(row).map_err(|error| format!("the shape cannot be written: {error}"))?;
    let mut table = row.as_table().clone();
    for (_, item) in table.iter_mut() {
        if let Some(inner) = item.as_table().cloned() {
            *item = Item::Value(inner.into_inline_table().into());
        }
    }
    Ok(table)
}

fn set_lens(doc: &mut DocumentMut, was: Option<&str>, lens: &LensEntry, photos: &[String]) -> Result<(), String> {
    let name = lens.name.as_str();
    if name.is_empty() {
        return Err("a lens needs a name".to_owned());
    }
    let written = toml_edit::ser::to_document(lens).map_err(|error| format!("the lens cannot be written: {error}"))?;
    match was {
        Some(was) => become_table(entry(doc, "lens", "name", was)?, written.as_table()),
        None => pushed(doc, "lens", written.as_table().clone())?,
    }
    for photo in tables(doc, "photo")?.iter_mut() {
        let file = text(photo, "file").unwrap_or_default();
        let is_its = photos.iter().any(|photo| file.rsplit(['/', '\\']).next() == Some(photo.as_str()));
        if is_its {
            set(photo.entry("lens").or_insert(Item::None), name.into());
        } else if text(photo, "lens").is_some_and(|of| of == name || Some(of) == was) {
            photo.remove("lens");
        }
    }
    Ok(())
}

fn leads_between(direction: &dyn TableLike, between: &[String; 2]) -> bool {
    let ends = ["from", "to"].map(|end| text(direction, end));
    let [a, b] = [&between[0], &between[1]].map(|name| Some(name.as_str()));
    ends == [a, b] || ends == [b, a]
}

fn set_mark(doc: &mut DocumentMut, point: &str, photo: &str, pixel: [f64; 2]) -> Result<(), String> {
    if !pixel.iter().all(|x| x.is_finite()) {
        return Err(format!("{point} cannot be marked where there is no pixel"));
    }
    let marks = entry(doc, "point", "name", point)?.entry("marks").or_insert_with(|| Item::Table(close_table()));
    let marks = marks.as_table_like_mut().ok_or_else(|| format!("marks of {point} is not a table"))?;
    let new = pixel_value(pixel);
    match marks.get_mut(photo) {
        // Number by number: a comment within stays.
        Some(item) => match item.as_array_mut().filter(|array| array.len() == 2) {
            Some(array) => {
                for (old, x) in array.iter_mut().zip(pixel) {
                    let decor = old.decor().clone();
                    *old = rounded(x).into();
                    *old.decor_mut() = decor;
                }
            }
            None => set(item, new),
        },
        None => {
            marks.insert(photo, Item::Value(new));
        }
    }
    Ok(())
}

fn rename_point(doc: &mut DocumentMut, from: &str, to: &str) -> Result<(), String> {
    if to.is_empty() {
        return Err("a point needs a name".to_owned());
    }
    if to != from && tables(doc, "point")?.iter().any(|p| text(p, "name") == Some(to)) {
        return Err(format!("there is a point called {to} already"));
    }
    set(entry(doc, "point", "name", from)?.entry("name").or_insert(Item::None), to.into());
    for list in ["distance", "direction", "shape"] {
        for table in tables(doc, list)?.iter_mut() {
            rename_in(table, from, to);
        }
    }
    Ok(())
}

/// Keys whose words are not names of points.
const OTHER_WORDS: [&str; 5] = ["name", "kind", "part", "photograph", "toward"];

fn rename_in(table: &mut dyn TableLike, from: &str, to: &str) {
    for (key, item) in table.iter_mut() {
        if OTHER_WORDS.contains(&key.get()) {
            continue;
        }
        match item {
            Item::Value(value) => rename_in_value(value, from, to),
            Item::Table(inner) => rename_in(inner, from, to),
            Item::ArrayOfTables(all) => all.iter_mut().for_each(|inner| rename_in(inner, from, to)),
            Item::None => {}
        }
    }
}

fn rename_in_value(value: &mut Value, from: &str, to: &str) {
    match value {
        Value::String(word) if word.value() == from => {
            let decor = value.decor().clone();
            *value = to.into();
            *value.decor_mut() = decor;
        }
        Value::Array(array) => array.iter_mut().for_each(|inner| rename_in_value(inner, from, to)),
        Value::InlineTable(table) => rename_in(table, from, to),
        _ => {}
    }
}

fn remove_point(doc: &mut DocumentMut, name: &str) -> Result<(), String> {
    let names_it = |shape: &Table| {
        let mut renamed = shape.clone();
        rename_in(&mut renamed, name, "");
        renamed.to_string() != shape.to_string()
    };
    if let Some(shape) = tables(doc, "shape")?.iter().find(|shape| names_it(shape)) {
        let shape = text(shape, "name").unwrap_or("without a name");
        return Err(format!("shape {shape} needs {name}: remove the shape first"));
    }
    if !removed(doc, "point", |point| text(point, "name") == Some(name)) {
        return Err(format!("there is no point called {name}"));
    }
    removed(doc, "distance", |d| {
        d.get("between").and_then(Item::as_array).is_some_and(|b| b.iter().any(|n| n.as_str() == Some(name)))
    });
    removed(doc, "direction", |d| ["from", "to"].iter().any(|end| text(d, end) == Some(name)));
    Ok(())
}

fn add_segment(doc: &mut DocumentMut, photo: &str, axis: AxisEntry, ends: &[[f64; 2]; 2]) -> Result<(), String> {
    if ends.iter().flatten().any(|x| !x.is_finite()) || ends[0] == ends[1] {
        return Err("an edge needs two different ends".to_owned());
    }
    let axis = ["x", "y", "z"][axis as usize];
    let mut segment = Value::Array(ends.iter().map(|end| pixel_value(*end)).collect());
    let found = tables(doc, "edge")?.iter_mut().find(|e| text(*e, "axis") == Some(axis) && text(*e, "photo") == Some(photo));
    if let Some(segments) = found.and_then(|edge| edge.get_mut("segments")?.as_array_mut()) {
        appended_in_layout(segments, &mut segment);
        segments.push_formatted(segment);
        return Ok(());
    }
    // One a line, so that one more is one line more.
    segment.decor_mut().set_prefix("\n    ");
    let mut segments = Array::new();
    segments.push_formatted(segment);
    segments.set_trailing("\n");
    segments.set_trailing_comma(true);
    pushed(doc, "edge", table([("axis", axis.into()), ("photo", photo.into()), ("segments", segments.into())]))
}

/// Gives a value the layout of those before it, and leaves a comment behind the last of them there.
fn appended_in_layout(array: &mut Array, new: &mut Value) {
    let words = |raw: Option<&RawString>| raw.and_then(RawString::as_str).unwrap_or_default().to_owned();
    let has_comma = array.trailing_comma();
    let trailing = words(Some(array.trailing()));
    let Some(last) = array.iter_mut().last() else { return };
    // A comment before the last one is its own.
    let prefix = words(last.decor().prefix());
    let prefix = prefix.rfind('\n').map_or("", |end| &prefix[end..]);
    let tail = if has_comma { trailing } else { words(last.decor().suffix()) };
    let (comment, rest) = match tail.find('\n') {
        Some(end) if tail[..end].contains('#') => tail.split_at(end),
        _ => ("", tail.as_str()),
    };
    // The first of a line stands at its bracket, others behind a comma.
    let prefix = if prefix.is_empty() { " " } else { prefix };
    new.decor_mut().set_prefix(format!("{comment}{prefix}"));
    if has_comma {
        array.set_trailing(rest);
    } else {
        last.decor_mut().set_suffix("");
        new.decor_mut().set_suffix(rest);
    }
}

fn rounded(x: f64) -> f64 {
    (x * PARTS_OF_A_PIXEL).round() / PARTS_OF_A_PIXEL
}

fn pixel_value(pixel: [f64; 2]) -> Value {
    Value::Array(pixel.iter().map(|x| rounded(*x)).collect())
}

/// Replaces a value and leaves what stands about it.
fn set(item: &mut Item, new: Value) {
    let decor = item.as_value().map(|value| value.decor().clone());
    let mut new = new;
    if let Some(decor) = decor {
        *new.decor_mut() = decor;
    }
    *item = Item::Value(new);
}

/// A table without an empty line before it.
fn close_table() -> Table {
    let mut table = Table::new();
    table.decor_mut().set_prefix("");
    table
}

fn table<const N: usize>(entries: [(&str, Value); N]) -> Table {
    let mut table = Table::new();
    for (key, value) in entries {
        table.insert(key, Item::Value(value));
    }
    table
}

fn text<'a>(table: &'a dyn TableLike, key: &str) -> Option<&'a str> {
    table.get(key)?.as_str()
}

fn is_between(distance: &dyn TableLike, between: &[String; 2]) -> bool {
    let names: Vec<&str> =
        distance.get("between").and_then(Item::as_array).into_iter().flatten().filter_map(Value::as_str).collect();
    let [a, b] = between;
    names == [a.as_str(), b.as_str()] || names == [b.as_str(), a.as_str()]
}

/// The tables of a list, made where there is none; one that was written in brackets becomes tables.
fn tables<'a>(doc: &'a mut DocumentMut, list: &str) -> Result<&'a mut ArrayOfTables, String> {
    let item = doc.entry(list).or_insert_with(|| Item::ArrayOfTables(ArrayOfTables::new()));
    if item.is_value() {
        let taken = std::mem::take(item);
        *item = taken.into_array_of_tables().map_or_else(|other| other, Item::ArrayOfTables);
    }
    item.as_array_of_tables_mut().ok_or_else(|| format!("{list} is not a list of tables"))
}

fn entry<'a>(doc: &'a mut DocumentMut, list: &str, key: &str, name: &str) -> Result<&'a mut Table, String> {
    tables(doc, list)?
        .iter_mut()
        .find(|t| text(*t, key) == Some(name))
        .ok_or_else(|| format!("there is no {list} called {name}"))
}

/// One table more, an empty line before it.
fn pushed(doc: &mut DocumentMut, list: &str, mut table: Table) -> Result<(), String> {
    let is_first = doc.iter().all(|(_, item)| item.as_array_of_tables().is_some_and(ArrayOfTables::is_empty));
    table.decor_mut().set_prefix(if is_first { "" } else { "\n" });
    tables(doc, list)?.push(table);
    Ok(())
}

/// Whether there was one to remove.
fn removed(doc: &mut DocumentMut, list: &str, is_meant: impl Fn(&Table) -> bool) -> bool {
    let Ok(all) = tables(doc, list) else { return false };
    let before = all.len();
    all.retain(|table| !is_meant(table));
    let found = all.len() < before;
    dropped_if_empty(doc, list);
    found
}

fn dropped_if_empty(doc: &mut DocumentMut, list: &str) {
    if doc.get(list).and_then(Item::as_array_of_tables).is_some_and(ArrayOfTables::is_empty) {
        doc.remove(list);
    }
}
