//! Shapes put together beside the photographs.

use crate::desk::Desk;
use crate::scene::Scene;
use eframe::egui::{Id, Key, Modifiers, Vec2};
use heliodon_photo::model::table::{Kind, ShapeRow};

/// The places of a box, and the corner of the scene's houses that is there.
const CORNERS: [(&str, &str); 8] = [
    ("lower front left", "sw"),
    ("lower front right", "se"),
    ("lower back right", "ne"),
    ("lower back left", "nw"),
    ("upper front left", "sw-top"),
    ("upper front right", "se-top"),
    ("upper back right", "ne-top"),
    ("upper back left", "nw-top"),
];

pub fn solved_desk() -> Desk {
    let mut desk = Desk::new(|_, _| false, None);
    desk.rest();
    assert!(desk.app.outcome().is_some());
    desk
}

pub fn shape(desk: &Desk, name: &str) -> ShapeRow {
    let file = &desk.app.document().project().file;
    file.shape.iter().find(|shape| shape.name == name).unwrap_or_else(|| panic!("{name}: {:?}", desk.app.message())).clone()
}

pub fn told(desk: &Desk) -> String {
    desk.app.told_of_shape().join("; ")
}

pub fn place_id(list: usize, place: usize) -> Id {
    Id::new(("place of a shape", list, place))
}

/// How many lines the model has in the first photograph.
fn line_count(desk: &Desk) -> usize {
    desk.solved().lines[&Scene::photo(0)].len()
}

#[test]
fn a_box_is_put_together_by_clicking_marks_and_its_wire_follows_at_once() {
    let mut desk = solved_desk();
    let before = line_count(&desk);
    desk.key(Key::B, Modifiers::NONE);
    desk.click_words("box");
    let mut named = Vec::new();
    for (place, corner) in CORNERS {
        let name = format!("house-{corner}");
        // the dialog stands over a part of the other pane
        let Some(at) = desk.mark(&name, 0).map(|mark| desk.at(0, mark)) else {
            named.push("-".to_owned());
            continue;
        };
        desk.click_words(place);
        desk.click(at, Modifiers::NONE);
        named.push(name);
    }
    assert!(named.iter().filter(|name| *name != "-").count() >= 5, "{named:?}");
    desk.frame(Vec::new());
    // what was set up is 2.8 m long, 2.3 m wide and 1.6 m high
    let told = told(&desk);
    for (name, truth) in [("length", 2.8), ("width", 2.3), ("height", 1.6)] {
        let size = told.split(&format!("{name} ")).nth(1).and_then(|rest| rest.split(' ').next()?.parse::<f64>().ok());
        assert!(size.is_some_and(|size| (size - truth).abs() < 0.02), "{name}: {told}");
    }
    assert_eq!(desk.app.document().project().file.shape.len(), 1, "nothing is in the project yet");
    assert_eq!(line_count(&desk), before);
    desk.click_words("Make");
    assert_eq!(shape(&desk, "shape 1").points, named);
    assert!(line_count(&desk) >= before + 9, "the wire is there before anything is solved again");
    desk.rest();
    assert!(line_count(&desk) >= before + 9 && desk.solved().wrong_shapes.is_empty());
    desk.key(Key::Z, Modifiers::COMMAND);
    desk.rest();
    assert_eq!(line_count(&desk), before);
}

#[test]
fn the_model_stays_in_sight_when_a_shape_is_opened_and_when_it_is_solved_again_meanwhile() {
    let mut desk = solved_desk();
    let before = desk.model_lines();
    assert!(before >= 9, "{before}");
    desk.key(Key::B, Modifiers::SHIFT);
    for _ in 0..30 {
        desk.frame(Vec::new());
        assert_eq!(desk.model_lines(), before);
    }
    desk.key(Key::Escape, Modifiers::NONE);
    let solved = desk.solved().text.clone();
    while desk.app.active_point() != Some("tower-sw") {
        desk.key(Key::Tab, Modifiers::NONE);
    }
    // its mark moves
    desk.key(Key::ArrowUp, Modifiers::SHIFT);
    desk.key(Key::B, Modifiers::SHIFT);
    let mut rested = 0;
    for _ in 0..3000 {
        desk.frame(Vec::new());
        assert!(desk.model_lines() >= 9, "{}", desk.model_lines());
        rested += usize::from(desk.solved().text != solved);
        if rested > 30 {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(if rested == 0 { 10 } else { 0 }));
    }
    panic!("it was not solved again");
}

#[test]
fn what_is_wrong_or_missing_is_told_in_words_as_it_is_filled_in() {
    let mut desk = solved_desk();
    desk.key(Key::B, Modifiers::NONE);
    desk.frame(Vec::new());
    assert!(told(&desk).contains("no points yet"), "{}", told(&desk));
    desk.click_words("polygon");
    desk.tab_to(place_id(0, 0));
    desk.type_in("tower-sw");
    desk.frame(Vec::new());
    assert!(told(&desk).contains("a polygon needs three"), "{}", told(&desk));
    desk.key(Key::Tab, Modifiers::NONE);
    desk.type_in("steeple");
    desk.frame(Vec::new());
    assert!(told(&desk).contains("no point called steeple"), "{}", told(&desk));
    // Up and Down go through the names that there are
    desk.key(Key::A, Modifiers::COMMAND);
    desk.type_in("tower-se-t");
    desk.key(Key::ArrowDown, Modifiers::NONE);
    desk.key(Key::Tab, Modifiers::NONE);
    desk.type_in("tower-sw-top");
    desk.frame(Vec::new());
    assert!(told(&desk).contains("it can be made"), "{}", told(&desk));
    desk.click_words("column");
    assert!(told(&desk).contains("upper rim"), "{}", told(&desk));
    desk.click_words("polygon");
    desk.click_words("Make");
    let made = shape(&desk, "shape 1");
    assert_eq!((made.kind, made.points.join(" ").as_str()), (Kind::Polygon, "tower-sw tower-se-top tower-sw-top"));
}

#[test]
fn a_shape_of_the_project_is_changed_and_removed() {
    let mut desk = solved_desk();
    let before = desk.app.document().text().to_owned();
    desk.key(Key::B, Modifiers::SHIFT);
    desk.click_words("upright");
    desk.click_words("in steps");
    for _ in 0..2 {
        desk.frame(Vec::new());
    }
    assert!(told(&desk).contains("one step apart"), "{}", told(&desk));
    desk.key(Key::Escape, Modifiers::NONE);
    assert_eq!(desk.app.document().text(), before, "nothing was changed");
    desk.key(Key::B, Modifiers::SHIFT);
    desk.click_words("upright");
    // a corner less
    let corner = shape(&desk, "tower").points[4].clone();
    desk.click_words("upper front left");
    desk.key(Key::A, Modifiers::COMMAND);
    desk.key(Key::Delete, Modifiers::NONE);
    desk.key(Key::Enter, Modifiers::NONE);
    let changed = shape(&desk, "tower");
    assert_eq!((changed.upright, changed.points[4].as_str()), (true, "-"), "{corner}");
    assert!(desk.app.document().text().contains("# by tape"));
    desk.key(Key::Z, Modifiers::COMMAND);
    assert_eq!(desk.app.document().text(), before);
    desk.key(Key::B, Modifiers::SHIFT);
    desk.click_words("Remove the shape");
    assert!(desk.app.document().project().file.shape.is_empty());
}

#[test]
fn one_is_marked_and_eight_are_there() {
    let mut desk = solved_desk();
    let before = line_count(&desk);
    desk.key(Key::B, Modifiers::SHIFT);
    desk.click_words("in steps");
    let points_of_the_step = 8;
    desk.tab_to(place_id(points_of_the_step, 0));
    for name in ["tower-sw", "tower-se"] {
        desk.type_in(name);
        desk.key(Key::Tab, Modifiers::NONE);
    }
    desk.frame(Vec::new());
    let two = told(&desk);
    assert!(two.contains("length"), "{two}");
    desk.click_words("Change");
    let row = shape(&desk, "tower");
    let repeat = row.repeat.clone().unwrap();
    assert_eq!((repeat.count, repeat.step), (2, Some(["tower-sw".to_owned(), "tower-se".to_owned()])));
    desk.rest();
    let of_two = line_count(&desk);
    assert!(of_two > before);
    desk.key(Key::B, Modifiers::SHIFT);
    desk.settle();
    let at = desk.find("2");
    desk.click(at, Modifiers::NONE);
    desk.key(Key::A, Modifiers::COMMAND);
    desk.type_in("8");
    desk.key(Key::Enter, Modifiers::NONE);
    assert_eq!(shape(&desk, "tower").repeat.unwrap().count, 8);
    desk.rest();
    assert!(line_count(&desk) > of_two, "{} {of_two}", line_count(&desk));
}

#[test]
fn edges_that_photographs_show_are_drawn_for_a_shape() {
    let mut desk = solved_desk();
    desk.key(Key::B, Modifiers::SHIFT);
    desk.click_words("Draw in the photographs");
    let (left, right) = (desk.shows("tower-sw", 0), desk.shows("tower-se", 0));
    for part in [0.1, 0.9] {
        desk.click(desk.at(0, left.lerp(right, part)) + Vec2::new(0.0, 1.0), Modifiers::NONE);
    }
    // another one by the keyboard's cursor, and away with it
    desk.key(Key::C, Modifiers::NONE);
    desk.key(Key::Enter, Modifiers::ALT);
    (0..4).for_each(|_| desk.key(Key::ArrowUp, Modifiers::NONE));
    desk.key(Key::Enter, Modifiers::ALT);
    desk.key(Key::Delete, Modifiers::NONE);
    desk.key(Key::Escape, Modifiers::NONE);
    desk.frame(Vec::new());
    desk.click_words("Change");
    let edges = shape(&desk, "tower").edges;
    assert_eq!(edges.len(), 1, "{edges:?}");
    assert_eq!((edges[0].photograph.as_str(), edges[0].between), ("photo-1.png", Some([0, 1])));
    desk.rest();
    assert!(desk.solved().wrong_shapes.is_empty(), "{:?}", desk.solved().wrong_shapes);
}

#[test]
fn page_down_goes_on_to_the_next_shape_and_keeps_what_was_changed() {
    let mut desk = solved_desk();
    for _ in 0..3 {
        desk.key(Key::Tab, Modifiers::NONE);
        desk.key(Key::X, Modifiers::NONE);
    }
    desk.key(Key::B, Modifiers::NONE);
    desk.key(Key::Enter, Modifiers::NONE);
    desk.key(Key::B, Modifiers::SHIFT);
    desk.frame(Vec::new());
    desk.key(Key::PageDown, Modifiers::NONE);
    desk.frame(Vec::new());
    desk.click_words("closed");
    desk.key(Key::PageUp, Modifiers::NONE);
    desk.frame(Vec::new());
    desk.key(Key::Escape, Modifiers::NONE);
    let closed = |name: &str| shape(&desk, name).watertight;
    assert!(closed("tower") == closed("shape 1"), "one of the two was changed, whichever was open: {:?}", desk.app.message());
}

#[test]
fn no_words_of_a_dialog_are_cut_off() {
    let mut desk = solved_desk();
    let behind: Vec<String> = desk.words().into_iter().map(|(words, ..)| words).collect();
    let check = |desk: &mut Desk, what: &str| {
        (0..3).for_each(|_| desk.frame(Vec::new()));
        let words = desk.words().into_iter().filter(|(words, ..)| !behind.contains(words));
        let mut count = 0;
        for (words, place, clip) in words.filter(|(_, place, clip)| clip.contains(place.center())) {
            let is_wide = place.left() < clip.left() - 1.0 || place.right() > clip.right() + 1.0;
            assert!(!is_wide, "{what}: {words} at {place:?} in {clip:?}");
            count += 1;
        }
        assert!(count > 4, "{what}: a dialog is open");
    };
    desk.key(Key::B, Modifiers::NONE);
    for kind in ["polygon", "box", "gable", "cylinder", "column", "arch", "revolution", "extrusion"] {
        desk.click_words(kind);
        check(&mut desk, kind);
    }
    desk.click_words("around an axis");
    check(&mut desk, "around an axis");
    desk.key(Key::Escape, Modifiers::NONE);
    for (key, what) in [(Key::L, "lens"), (Key::D, "direction"), (Key::F1, "help")] {
        for _ in 0..2 {
            desk.key(Key::Tab, Modifiers::NONE);
            desk.key(Key::X, Modifiers::NONE);
        }
        desk.key(key, if key == Key::F1 { Modifiers::NONE } else { Modifiers::SHIFT });
        check(&mut desk, what);
        desk.key(Key::Escape, Modifiers::NONE);
        desk.key(Key::Escape, Modifiers::NONE);
    }
}

#[test]
fn corners_that_no_photograph_shows_are_typed_into_places_and_become_points() {
    let mut desk = solved_desk();
    let before = desk.app.document().text().to_owned();
    let points = desk.app.document().project().file.point.len();
    let lines = line_count(&desk);
    desk.key(Key::B, Modifiers::NONE);
    desk.type_in(" stair");
    desk.click_words("box");
    // chosen with a kind, its first place is typed into at once
    desk.frame(Vec::new());
    assert_eq!(desk.ctx.memory(|memory| memory.focused()), Some(place_id(0, 0)));
    let typed = ["tower-sw tower-sw tower-sw+1.5", "tower-sw+2, tower-sw, tower-sw+1.5", "tower-sw", "tower-sw+2 0.5 here"];
    let places = ["lower front left", "lower front right", "lower back left", "upper back right"];
    for (place, words) in places.into_iter().zip(typed) {
        desk.click_words(place);
        desk.type_in(words);
        desk.frame(Vec::new());
    }
    assert!(told(&desk).contains("upper back right: here is neither metres nor a point"), "{}", told(&desk));
    desk.key(Key::A, Modifiers::COMMAND);
    desk.type_in("tower-sw+2 tower-sw+0.6 tower-sw");
    desk.frame(Vec::new());
    let told = told(&desk);
    assert!(["length 2.0", "height 0.6", "width 1.5"].iter().all(|size| told.contains(size)), "{told}");
    let at = desk.solved().position_m("tower-sw").unwrap();
    desk.key(Key::Enter, Modifiers::NONE);
    let made = desk.app.document().project().file.shape.last().unwrap().points.clone();
    let file = &desk.app.document().project().file;
    assert_eq!((file.point.len(), made[3].as_str(), made[2].as_str()), (points + 3, "tower-sw", "-"), "{made:?}");
    let corner = file.point.iter().find(|point| point.name == made[6]).unwrap();
    assert!(corner.name.ends_with("stair-upper-back-right") && corner.marks.is_empty(), "{}", corner.name);
    let known = glam::DVec3::from(corner.known_m.unwrap());
    assert!(known.distance(at + glam::DVec3::new(2.0, 0.6, 0.0)) < 0.001, "{known} {at}");
    assert!(line_count(&desk) >= lines + 9, "the wire is there before anything is solved again");
    desk.rest();
    assert!(line_count(&desk) >= lines + 9 && desk.solved().wrong_shapes.is_empty(), "{:?}", desk.solved().wrong_shapes);
    // the same corner again is the same point; both go with one step back
    desk.key(Key::B, Modifiers::NONE);
    for (place, words) in [(0, typed[0]), (1, typed[1]), (3, typed[2]), (6, "tower-sw+2 tower-sw+0.9 tower-sw")] {
        desk.tab_to(place_id(0, place));
        desk.type_in(words);
    }
    desk.key(Key::Enter, Modifiers::NONE);
    let again = &desk.app.document().project().file;
    assert_eq!(again.shape.last().unwrap().points[..2], made[..2]);
    assert_eq!(again.point.len(), points + 4);
    for _ in 0..2 {
        desk.key(Key::Z, Modifiers::COMMAND);
    }
    assert_eq!(desk.app.document().text(), before);
}
